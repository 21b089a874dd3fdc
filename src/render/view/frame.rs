//! The frame of the view: every pass and every barrier, in order, after those of render/frame.rs.
//!
//! ```text
//! open groups ─► environment rays ─► smooth environment ─► sharp environment
//!          ─► environment points ─► copy points            direct light of the environment, where it or geometry changed
//!          ─► classify blocks ─► list blocks ─► direct ─► mixed blocks ─► shadow edges ─► penumbra
//!          ─► direct points ─► copy points ─► direct atlas ─► dilate                    direct light, where the scene changed
//!          ─► visible ─► draw surfaces ─► list pixels ─► reflections ─► contrast ─► edges           the camera's picture
//! ```

use crate::error::Result;
use crate::gpu::{Access, Buffer, Recorder};
use crate::render::device_scene::DeviceScene;
use crate::render::dispatch::{GroupRect, first_groups, group_count};
use crate::render::frame::{LIGHT_MAP_WRITE, dilate_meshes};
use crate::render::gpu_types::constants::{ENVIRONMENT_PARTS, MAX_ROW, SPLAT_GROUP};
use crate::render::receivers::dilate::Dilate;
use crate::render::receivers::points::PointRanges;
use crate::render::view::camera::View;
use crate::render::view::direct::Direct;
use crate::render::view::work_list::{Items, WorkList};
use crate::scene::Camera;
use std::ops::Range;

/// Workgroups of a first submission that lists pixels: 20 ms.
const LISTED_GROUPS: u64 = 1 << 13;
/// Units of a workgroup, and of a dispatch.
const POINT_GROUP: u64 = SPLAT_GROUP as u64;
const MAX_POINTS: u64 = POINT_GROUP * MAX_ROW as u64;

/// Computes the direct light of rects from the environment.
pub fn environment_light(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    direct: &Direct,
) -> Result<()> {
    clear(recorder, &[&direct.sharp_texels.counts])?;
    let [first, first_sharp] = Direct::environment_rays().map(first_groups);
    let rects = || scene.surfaces.tiles.iter().filter(|tile| tile.is_rect());
    recorder.pass("open groups", |r| {
        direct.record_open_groups(r, scene);
        next(r);
    })?;
    for part in 0..ENVIRONMENT_PARTS {
        for tile in rects() {
            each_rect(
                recorder,
                "environment rays",
                tile.environment_threads(),
                first,
                |r, rect| direct.record_environment_rays(r, tile, part, rect),
            )?;
        }
    }
    for tile in rects() {
        each_rect(
            recorder,
            "smooth environment",
            tile.environment_size(),
            first,
            |r, rect| direct.record_smooth_environment(r, tile, rect),
        )?;
    }
    each_listed(
        recorder,
        "sharp environment",
        &direct.sharp_texels,
        0,
        first_sharp,
        |r, items| direct.record_sharp_environment(r, scene, items),
    )
}

/// Computes the direct light at points of meshes from the environment.
pub fn environment_points(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    direct: &Direct,
) -> Result<()> {
    let first = first_groups(Direct::point_rays());
    let [unmapped, mapped] = &scene.surfaces.points.ranges;
    for (is_mapped, points) in [(false, unmapped), (true, mapped)] {
        each_range(
            recorder,
            "environment points",
            points.traced.clone(),
            first,
            |r, points| direct.record_environment_points(r, is_mapped, points),
        )?;
    }
    copy_points(recorder, direct, true, mapped)
}

/// Copies light, or that of the environment, to points that are in one place with others.
fn copy_points(
    recorder: &mut Recorder,
    direct: &Direct,
    is_environment: bool,
    points: &PointRanges,
) -> Result<()> {
    each_range(
        recorder,
        "copy points",
        points.copies.clone(),
        LISTED_GROUPS,
        |r, copies| direct.record_copies(r, is_environment, copies),
    )
}

/// Between two computations. [`each_rect`], [`each_range`] and [`each_listed`] end in it.
fn next(recorder: &mut Recorder) {
    recorder.barrier(Access::COMPUTE_WRITE, Access::COMPUTE);
}

/// Computes the direct light of diffuse surfaces, after that from the environment.
pub fn direct_light(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    direct: &Direct,
    dilate: Option<&Dilate>,
) -> Result<()> {
    let tiles = &scene.surfaces.tiles;
    let [texels, rest] = direct.texels.each_ref().map(|list| &list.counts);
    clear(recorder, &[&direct.blocks.counts, texels, rest])?;
    let first = first_groups(Direct::rays(scene));
    if scene.lights.scene_count > 0 {
        let blocks = 0..scene.surfaces.block_count;
        each_range(
            recorder,
            "classify blocks",
            blocks.clone(),
            first,
            |r, blocks| direct.record_classify(r, scene, blocks),
        )?;
        each_range(recorder, "list blocks", blocks, first, |r, blocks| {
            direct.record_list_blocks(r, scene, blocks)
        })?;
    }
    let [unmapped, _] = &scene.surfaces.points.ranges;
    each_range(
        recorder,
        "direct points",
        unmapped.traced.clone(),
        first,
        |r, points| direct.record_points(r, scene, points),
    )?;
    copy_points(recorder, direct, false, unmapped)?;
    for tile in tiles {
        let pass = if tile.is_rect() {
            "direct"
        } else {
            "direct atlas"
        };
        each_rect(recorder, pass, tile.tile.size, first, |r, rect| {
            direct.record(r, scene, tile, rect)
        })?;
    }
    if scene.lights.scene_count > 0 {
        if scene.surfaces.is_in_motion() {
            each_listed(
                recorder,
                "mixed blocks",
                &direct.blocks,
                0,
                first,
                |r, items| direct.record_mixed_blocks(r, scene, items),
            )?;
        }
        each_listed(
            recorder,
            "shadow edges",
            &direct.blocks,
            0,
            LISTED_GROUPS,
            |r, items| direct.record_shadow_edges(r, scene, items),
        )?;
        let [texels, rest] = &direct.texels;
        for (pass, list, is_rest) in [("penumbra", texels, false), ("penumbra's rest", rest, true)]
        {
            each_listed(recorder, pass, list, 0, first, |r, items| {
                direct.record_penumbra(r, scene, is_rest, items)
            })?;
        }
    }
    let meshes = tiles
        .iter()
        .filter(|tile| !tile.is_rect())
        .map(|tile| &tile.tile);
    dilate_meshes(recorder, meshes, dilate)
}

/// Computes the camera's picture, tile by tile.
pub fn view(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    view: &View,
    camera: &Camera,
) -> Result<()> {
    const MAPS: Access = LIGHT_MAP_WRITE.and(Access::COMPUTE_READ);
    for tile in view.tiles() {
        clear(recorder, &[&view.pixels.counts, &view.untextured])?;
        // A unit of work: what it costs is not taken for that of the work before it.
        recorder.tiled("draw surfaces", 1, 1, |r, _, _| {
            r.pass("visible", |r| {
                // The tile before this one is shaded from the same images.
                r.barrier(
                    MAPS,
                    Access::DRAW
                        .and(Access::FRAGMENT_READ)
                        .and(Access::VERTEX_READ),
                );
                view.record_visible(r, scene, camera, tile);
            })?;
            r.pass("draw surfaces", |r| {
                // With one sample a pixel, its depth.
                r.barrier(Access::DRAW, Access::DRAW);
                view.record_surfaces(r, scene, camera, tile);
                r.barrier(Access::DRAW.and(MAPS), Access::COMPUTE);
            })?;
            Ok(1)
        })?;
        each_rect(recorder, "list pixels", tile.1, LISTED_GROUPS, |r, rect| {
            view.record_list(r, scene, camera, tile, rect)
        })?;
        for (list, pass) in [(0, "reflections"), (1, "edges")] {
            let first = first_groups(view.rays(scene, list));
            each_listed(recorder, pass, &view.pixels, list, first, |r, items| {
                view.record_shade(r, scene, camera, tile, (list, items))
            })?;
            if list == 0 && view.side > 1 {
                each_listed(
                    recorder,
                    "contrast",
                    &view.pixels,
                    0,
                    LISTED_GROUPS,
                    |r, items| view.record_contrast(r, scene, camera, tile, items),
                )?;
            }
        }
    }
    Ok(())
}

/// Clears the counts of work lists and other buffers.
fn clear(recorder: &mut Recorder, buffers: &[&Buffer]) -> Result<()> {
    recorder.pass("clear work lists", |r| {
        r.barrier(
            Access::COMPUTE.and(Access::INDIRECT_READ),
            Access::TRANSFER_WRITE,
        );
        buffers.iter().for_each(|buffer| r.zero(buffer));
        r.barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
    })
}

/// Records a pass over the items of list `list`. A host's command buffer has one dispatch, whose size the device counts. A
/// blocking frame reads the number, so that no submission takes long.
fn each_listed(
    recorder: &mut Recorder,
    pass: &'static str,
    list: &WorkList,
    index: u32,
    first: u64,
    record: impl Fn(&mut Recorder, Items),
) -> Result<()> {
    if !recorder.is_ours() {
        return recorder.pass(pass, |r| {
            list.record_plan(r);
            r.barrier(Access::COMPUTE_WRITE, Access::INDIRECT_READ);
            record(r, Items::All);
            next(r);
        });
    }
    let count = list.count(recorder, index as usize)?;
    let per_group = u64::from(list.per_group);
    let groups = u64::from(count.div_ceil(list.per_group));
    recorder.tiled(pass, groups, first, |r, done, limit| {
        let first = (done * per_group) as u32;
        let items = Items::Range(
            first,
            (limit * per_group).min(u64::from(count - first)) as u32,
        );
        r.pass(pass, |r| {
            record(r, items);
            next(r);
        })?;
        Ok(limit)
    })
}

/// Records a pass over a range of units, [`SPLAT_GROUP`] to a workgroup.
fn each_range(
    recorder: &mut Recorder,
    pass: &'static str,
    units: Range<u32>,
    first: u64,
    record: impl Fn(&mut Recorder, Range<u32>),
) -> Result<()> {
    let total = u64::from(units.end - units.start);
    recorder.tiled(pass, total, POINT_GROUP * first, |r, done, limit| {
        let limit = limit.min(MAX_POINTS);
        let [start, end] = [done, done + limit].map(|unit| units.start + unit as u32);
        r.pass(pass, |r| {
            record(r, start..end);
            next(r);
        })?;
        Ok(limit)
    })
}

/// Records a pass over rectangles of an image of `size` texels, so that no submission takes long.
fn each_rect(
    recorder: &mut Recorder,
    pass: &'static str,
    size: [u32; 2],
    first: u64,
    record: impl Fn(&mut Recorder, GroupRect),
) -> Result<()> {
    recorder.tiled(pass, group_count(size), first, |r, done, limit| {
        let rect = GroupRect::of(size, done, limit);
        r.pass(pass, |r| {
            record(r, rect);
            next(r);
        })?;
        Ok(rect.count())
    })
}
