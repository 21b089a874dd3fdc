//! The frame: every pass and every barrier, in order.
//!
//! ```text
//! upload ─► sample ─► project ─► compact ─► splat ─► resolve ─► dilate      the caustic
//!                                                 direct ─► dilate ─► shade  the view
//! ```
//! A caster's triangles are divided into patches, the paper's sample points (sample). Each patch is a pinhole camera
//! that images each light onto each receiver (project). The images are listed (compact) and added to the receivers'
//! light maps (splat), wide ones to coarse levels (resolve). `pinhole` gathers over the patches at every texel instead,
//! as the paper does, and `points` splats single texels.

use crate::error::Result;
use crate::gpu::{Access, Image, Recorder};
use crate::render::device_scene::DeviceScene;
use crate::render::dispatch::{GroupRect, bands, first_groups, group_count};
use crate::render::methods::pinhole::Pinhole;
use crate::render::methods::points::Points;
use crate::render::patches::sample::{self, Sample};
use crate::render::receivers::dilate::Dilate;
use crate::render::receivers::light_maps::MAX_LEVEL;
use crate::render::splat::list::Batch;
use crate::render::splat::projector::Projector;
use crate::render::splat::resolve::Resolve;
use crate::render::view::camera::Shade;
use crate::render::view::direct::Direct;
use crate::scene::Camera;
use std::ops::Range;

/// Patches and points of a first submission, on a device of which nothing is known.
const FIRST_PATCHES: u64 = 1 << 16;
const FIRST_POINTS: u64 = 1 << 12;
/// Texels of a submission that clears or dilates: 40 ms on two CPU cores.
const CLEAR_BAND: u32 = 1 << 22;
const DILATE_BAND: u32 = 1 << 21;

/// All that reads or writes device memory, on either side of a barrier.
const ANY: Access = Access::ANY_READ.and(Access::ANY_WRITE);
/// What a draw reads of a splat list.
const LIST_READ: Access = Access::VERTEX_READ
    .and(Access::INDEX_READ)
    .and(Access::INDIRECT_READ);
/// What writes the light maps, and what then reads them.
pub const LIGHT_MAP_WRITE: Access = Access::BLEND.and(Access::COMPUTE_WRITE);

/// The stages of a method.
pub enum Caustic {
    Splat {
        sample: Sample,
        projectors: Vec<Projector>,
        resolve: Option<Resolve>,
    },
    Gather {
        sample: Sample,
        pinhole: Pinhole,
    },
    Points(Points),
}

/// What changed in the scene goes to the device. Whatever an earlier frame does is waited for, a host's reads of the
/// light maps included.
pub fn upload(recorder: &mut Recorder, scene: &mut DeviceScene) -> Result<()> {
    recorder.pass("upload", |r| {
        r.barrier(ANY, ANY);
        scene.staging.record(r);
        r.barrier(Access::TRANSFER_WRITE, Access::ANY_READ);
    })
}

/// The caustic, into the light maps. `dilate` is for those of meshes.
pub fn caustic(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    stages: &Caustic,
    light_map: &Image,
    dilate: Option<&Dilate>,
) -> Result<()> {
    let has_patches = scene.casters.patch_count > 0;
    let draws = match stages {
        Caustic::Splat { projectors, .. } => (projectors.iter()).any(|projector| {
            scene
                .groups(projector.source)
                .any(|group| group.pairs() > 0)
        }),
        Caustic::Points(points) => points.count > 0 && scene.casters.lit_count > 0,
        Caustic::Gather { .. } => false,
    };
    // The first draw of a frame clears a small light map itself.
    let mut clear = draws && bands([light_map.width, light_map.height], CLEAR_BAND).len() == 1;
    if !clear {
        clear_light_map(recorder, light_map)?;
    }
    match stages {
        Caustic::Splat {
            sample,
            projectors,
            resolve,
        } => {
            if has_patches {
                sample_patches(recorder, scene, sample)?;
            }
            zero(recorder, projectors, resolve.as_ref())?;
            for projector in projectors {
                splat(recorder, scene, projector, light_map, &mut clear)?;
            }
            if let Some(resolve) = resolve.as_ref().filter(|_| draws) {
                add_levels(recorder, scene, resolve)?;
            }
            // Footprints fall on the texels around the charts by themselves.
            Ok(())
        }
        Caustic::Gather { sample, pinhole } => {
            if has_patches {
                sample_patches(recorder, scene, sample)?;
                gather(recorder, scene, pinhole)?;
            }
            dilate_meshes(recorder, scene, dilate)
        }
        Caustic::Points(points) => {
            if draws {
                splat_points(recorder, scene, points, light_map, &mut clear)?;
            }
            dilate_meshes(recorder, scene, dilate)
        }
    }
}

/// Direct light, into the direct maps: that of the environment, and `with_lights` of suns and lamps.
pub fn direct_light(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    direct: &Direct,
    with_lights: bool,
    dilate: Option<&Dilate>,
) -> Result<()> {
    let first = first_groups(Direct::rays(scene, with_lights));
    let total = scene.receivers.group_count();
    recorder.tiled("direct", total, first, |r, done, limit| {
        let (tile, rect) = scene.receivers.group_rect(done, limit);
        r.pass("direct", |r| {
            direct.record(r, scene, (tile, rect), with_lights);
            r.barrier(Access::COMPUTE_WRITE, Access::COMPUTE);
        })?;
        Ok(rect.count())
    })?;
    dilate_meshes(recorder, scene, dilate)
}

/// The camera's picture, with `side`² samples a pixel.
pub fn view(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    shade: &Shade,
    camera: &Camera,
    side: u32,
) -> Result<()> {
    let size = shade.size();
    let first = first_groups(Shade::rays(scene, side));
    recorder.tiled("shade", group_count(size), first, |r, done, limit| {
        let rect = GroupRect::of(size, done, limit);
        r.pass("shade", |r| {
            r.barrier(LIGHT_MAP_WRITE, Access::COMPUTE);
            shade.record(r, scene, camera, side, rect);
        })?;
        Ok(rect.count())
    })
}

// --- The steps ------------------------------------------------------------------------------------

/// Fills the light maps with zeros, each band of rows in a submission of its own where there are several.
fn clear_light_map(recorder: &mut Recorder, light_map: &Image) -> Result<()> {
    for rows in bands([light_map.width, light_map.height], CLEAR_BAND) {
        recorder.pass("clear light map", |r| {
            r.clear(light_map, rows.clone());
            r.barrier(Access::BLEND, Access::BLEND.and(Access::COMPUTE));
        })?;
        submit_if(recorder, rows, light_map.height)?;
    }
    Ok(())
}

/// A band that is not the whole image is a submission of its own.
fn submit_if(recorder: &mut Recorder, rows: Range<u32>, height: u32) -> Result<()> {
    match rows.len() < height as usize {
        true => recorder.submit(),
        false => Ok(()),
    }
}

/// The patches of all lit triangles of casters.
fn sample_patches(recorder: &mut Recorder, scene: &DeviceScene, sample: &Sample) -> Result<()> {
    let total = scene.casters.patch_count.into();
    recorder.tiled("sample", total, FIRST_PATCHES, |r, done, limit| {
        let patches = limit.min(sample::BATCH.into()) as u32;
        r.pass("sample", |r| {
            sample.record(r, scene, done as u32, patches);
            r.barrier(Access::COMPUTE_WRITE, Access::COMPUTE_READ);
        })?;
        Ok(patches.into())
    })
}

/// Empties the lists.
fn zero(
    recorder: &mut Recorder,
    projectors: &[Projector],
    resolve: Option<&Resolve>,
) -> Result<()> {
    recorder.pass("clear lists", |r| {
        projectors
            .iter()
            .for_each(|projector| r.zero(&projector.list.arguments));
        resolve
            .iter()
            .for_each(|resolve| r.zero(&resolve.levels.coarse));
        r.barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
    })
}

/// The splats of a projector, listed in the order of their pairs and added to the light maps, in as many batches as
/// there is room and time for. Only the first batch of a frame has to `clear` the light maps.
fn splat(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    projector: &Projector,
    light_map: &Image,
    clear: &mut bool,
) -> Result<()> {
    let (list, passes) = (&projector.list, projector.passes);
    for group in scene.groups(projector.source) {
        let first = scene.first_pairs();
        recorder.tiled(passes.work, group.pairs(), first, |r, done, limit| {
            let batch = Batch {
                group,
                first_pair: done as u32,
                pair_count: limit.min(list.capacity.into()) as u32,
            };
            r.pass(passes.project, |r| {
                projector.record_project(r, scene, batch);
                r.barrier(Access::COMPUTE_WRITE, Access::COMPUTE_READ);
            })?;
            r.pass(passes.compact, |r| {
                list.record_compact(r, batch.pair_count);
                r.barrier(Access::COMPUTE_WRITE, LIST_READ);
            })?;
            r.pass(passes.splat, |r| {
                projector.record_splat(r, light_map, *clear);
                // The next batch overwrites what this one reads, and adds to its texels.
                r.barrier(
                    Access::BLEND.and(LIST_READ).and(Access::FRAGMENT_READ),
                    Access::BLEND.and(Access::COMPUTE),
                );
            })?;
            *clear = false;
            Ok(batch.pair_count.into())
        })?;
    }
    Ok(())
}

/// Adds the coarser levels to the finer ones, in steps of so many rows that each may be a submission of its own.
fn add_levels(recorder: &mut Recorder, scene: &DeviceScene, resolve: &Resolve) -> Result<()> {
    recorder.pass("find levels", |r| {
        resolve.record_levels(r, scene);
        r.barrier(
            Access::COMPUTE_WRITE,
            Access::COMPUTE.and(Access::INDIRECT_READ),
        );
    })?;
    let [_, height] = scene.receivers.largest_light_map();
    let is_split = height + 2 > resolve.levels.rows;
    for level in (0..MAX_LEVEL).rev() {
        // With one texel more all around than the level has.
        let rows = ((height - 1) >> level) + 3;
        for first_row in (0..rows).step_by(resolve.levels.rows as usize) {
            recorder.pass("resolve", |r| {
                resolve.record(r, level, first_row);
                r.barrier(Access::COMPUTE_WRITE, Access::COMPUTE);
            })?;
            if is_split {
                recorder.submit()?;
            }
        }
    }
    Ok(())
}

/// The paper's gather: the sum over all patches at every texel, a batch of patches at a time.
fn gather(recorder: &mut Recorder, scene: &DeviceScene, pinhole: &Pinhole) -> Result<()> {
    let (batch, patch_count) = (Pinhole::batch(scene), scene.casters.patch_count);
    let groups = scene.receivers.group_count();
    let total = groups * u64::from(patch_count.div_ceil(batch));
    let first = first_groups(Pinhole::rays(scene));
    recorder.tiled("gather", total, first, |r, done, limit| {
        let first_patch = (done / groups) as u32 * batch;
        let patches = (first_patch, batch.min(patch_count - first_patch));
        let (tile, rect) = scene.receivers.group_rect(done % groups, limit);
        r.pass("gather", |r| {
            pinhole.record(r, scene, patches, (tile, rect));
            r.barrier(Access::COMPUTE, Access::COMPUTE);
        })?;
        Ok(rect.count())
    })
}

/// Points, one texel each.
fn splat_points(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    points: &Points,
    light_map: &Image,
    clear: &mut bool,
) -> Result<()> {
    let total = points.count.into();
    recorder.tiled("points", total, FIRST_POINTS, |r, done, limit| {
        let batch = (done as u32, limit.min(points.batch.into()) as u32);
        r.pass("trace points", |r| {
            points.record_trace(r, scene, batch);
            r.barrier(Access::COMPUTE_WRITE, Access::VERTEX_READ);
        })?;
        r.pass("splat points", |r| {
            points.record_draw(r, scene, batch, light_map, *clear);
            r.barrier(
                Access::BLEND.and(Access::VERTEX_READ),
                Access::BLEND.and(Access::COMPUTE),
            );
        })?;
        *clear = false;
        Ok(batch.1.into())
    })
}

/// Continues the light maps of meshes around their charts.
fn dilate_meshes(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    dilate: Option<&Dilate>,
) -> Result<()> {
    let Some(dilate) = dilate else {
        return Ok(());
    };
    for (receiver, tile) in scene.receivers.mesh_tiles().iter().enumerate() {
        let [width, height] = tile.size;
        for rows in bands(tile.size, DILATE_BAND) {
            recorder.pass("dilate", |r| {
                r.barrier(LIGHT_MAP_WRITE, Access::COMPUTE);
                dilate.record(r, receiver as u32, width, rows.clone());
                r.barrier(Access::COMPUTE_WRITE, Access::COMPUTE.and(Access::BLEND));
            })?;
            submit_if(recorder, rows, height)?;
        }
    }
    Ok(())
}
