//! The frame: every pass and every barrier, in order.
//!
//! ```text
//! upload ─► place ─► refit                                                           what moved
//!        ─► pilot ─► number                                                           chains: light of several surfaces
//!        ─► facet flux ─► trace ─► count ─► trace ─► count ─► project ─► splat ─► resolve  suns on planar receivers
//!        ─► trace ─► number ─► emit ─► … ─► finish ─► splat ─► resolve                chains
//!        ─► sample ─► project ─► compact ─► splat ─► resolve                         mesh receivers, environments
//! ```
//! The casters' triangles are facets. facet flux computes the light that each facet sends to the receivers. By this flux, count
//! divides facets into patches, the paper's sample points, and trace tests the visibility of their corners. Each patch is a
//! pinhole camera: project computes the image of a light on a receiver, in as many splats as it needs. splat adds the splats
//! to the light maps, wide ones to coarser levels, which resolve adds to the finer ones. Chains are light that meets several
//! specular surfaces: pilot finds how many rays they need, trace follows a wave of rays to the next surface, emit writes the
//! next wave and the splats, and finish follows the remaining rays to their end; chains/frame.rs lists their passes. For suns
//! and lamps on mesh receivers, sample makes patches of even size; environment cells are projected by patch clusters. compact
//! lists the splats of both. The method `pinhole` gathers over the patches of sample at every texel instead, as the paper does,
//! and `points` splats single texels; after them, dilate extends the light maps of meshes around their charts. view/frame.rs
//! continues with direct light and the camera's picture.

use crate::error::Result;
use crate::gpu::{Access, Image, Recorder};
use crate::render::barriers::{ANY, LIST_READ, after_draw, next};
use crate::render::caustic::Caustic;
use crate::render::chains::frame::{plan_chains, splat_chains};
use crate::render::device_scene::DeviceScene;
use crate::render::dispatch::{bands, first_groups};
use crate::render::methods::pinhole::Pinhole;
use crate::render::methods::points::Points;
use crate::render::patches::sample::{self, Sample};
use crate::render::receivers::dilate::Dilate;
use crate::render::receivers::light_maps::MAX_LEVEL;
use crate::render::receivers::tile::Tile;
use crate::render::splat::projector::Projector;
use crate::render::splat::resolve::Resolve;
use crate::render::splat::triangles::Triangles;
use std::ops::Range;

/// Patches in a first submission, before the speed of the device is known.
const FIRST_PATCHES: u64 = 1 << 16;
/// Texels per submission that clears or dilates: 40 ms on two CPU cores.
const CLEAR_BAND: u32 = 1 << 22;
const DILATE_BAND: u32 = 1 << 21;

/// Accesses that write the light maps.
pub const LIGHT_MAP_WRITE: Access = Access::BLEND.and(Access::COMPUTE_WRITE);

/// Copies the changes of the scene to the device, which places the triangles of objects that moved as a whole and refits the
/// hierarchy. The first barrier waits for all earlier frames, including a host's reads of the light maps.
pub fn upload(recorder: &mut Recorder, scene: &mut DeviceScene) -> Result<()> {
    scene.geometry.hierarchy.begin_frame();
    recorder.pass("upload", |r| {
        r.barrier(ANY, ANY);
        scene.staging.record(r);
        r.barrier(Access::TRANSFER_WRITE, ANY);
    })?;
    let geometry = &mut scene.geometry;
    if !geometry.is_moved {
        return Ok(());
    }
    if !geometry.to_place.is_empty() {
        recorder.pass("place triangles", |r| {
            geometry.record_place(r);
            r.barrier(Access::COMPUTE_WRITE, Access::ANY_READ);
        })?;
    }
    recorder.pass("refit hierarchy", |r| {
        geometry.hierarchy.record_refit(r);
        r.barrier(Access::COMPUTE_WRITE, Access::ANY_READ);
        geometry.hierarchy.record_cost(r);
    })?;
    geometry.is_moved = false;
    geometry.to_place.clear();
    Ok(())
}

/// Computes the caustic in the light maps. `dilate` extends the light maps of meshes.
pub fn caustic(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    stages: &Caustic,
    light_map: &Image,
    dilate: Option<&Dilate>,
) -> Result<()> {
    let has_patches = scene.casters.patch_count > 0;
    let draws = match stages {
        Caustic::Splat {
            triangles,
            chains,
            projectors,
            ..
        } => {
            triangles.is_some()
                || chains.is_some()
                || (projectors.iter()).any(|projector| {
                    scene
                        .group(projector.source)
                        .is_some_and(|group| group.pairs() > 0)
                })
        }
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
            triangles,
            chains,
            projectors,
            resolve,
        } => {
            zero(recorder, projectors, resolve.as_ref())?;
            // Patches get what chains leave of the error to aim for.
            if let Some(chains) = chains {
                plan_chains(recorder, scene, chains)?;
            }
            if let Some(triangles) = triangles {
                splat_triangles(recorder, scene, triangles, light_map, &mut clear)?;
            }
            if let Some(chains) = chains {
                splat_chains(recorder, scene, chains, light_map, &mut clear)?;
            }
            if let Some(sample) = sample.as_ref().filter(|_| has_patches) {
                sample_patches(recorder, scene, sample)?;
            }
            for projector in projectors {
                splat(recorder, scene, projector, light_map, &mut clear)?;
            }
            if let Some(resolve) = resolve.as_ref().filter(|_| draws) {
                add_levels(recorder, scene, resolve)?;
            }
            // Footprints light the texels around the charts directly.
            Ok(())
        }
        Caustic::Gather { sample, pinhole } => {
            if has_patches {
                sample_patches(recorder, scene, sample)?;
                gather(recorder, scene, pinhole)?;
            }
            dilate_meshes(recorder, scene.receivers.mesh_tiles().iter(), dilate)
        }
        Caustic::Points(points) => {
            if draws {
                splat_points(recorder, scene, points, light_map, &mut clear)?;
            }
            dilate_meshes(recorder, scene.receivers.mesh_tiles().iter(), dilate)
        }
    }
}

// --- The steps ------------------------------------------------------------------------------------

/// Clears the light maps. If there are several bands of rows, each is a submission of its own.
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

/// Submits a band that is not the whole image.
fn submit_if(recorder: &mut Recorder, rows: Range<u32>, height: u32) -> Result<()> {
    match rows.len() < height as usize {
        true => recorder.submit(),
        false => Ok(()),
    }
}

/// Computes the patches of the casters' lit triangles.
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

/// Clears the splat lists and the level masks.
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

/// Computes the splats of a projector, lists them in the order of their pairs, and adds them to the light maps, in
/// batches limited by capacity and time. If `clear` is set, the first batch clears the light maps.
fn splat(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    projector: &Projector,
    light_map: &Image,
    clear: &mut bool,
) -> Result<()> {
    let (list, passes) = (&projector.list, projector.passes);
    projector.each_batch(recorder, scene, passes.work, |r, batch| {
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
            // The next batch overwrites the buffers that this one reads, and blends into the same texels.
            r.barrier(
                Access::BLEND.and(LIST_READ).and(Access::FRAGMENT_READ),
                Access::BLEND.and(Access::COMPUTE),
            );
        })?;
        *clear = false;
        Ok(())
    })
}

/// Chooses the patches of suns and lamps and the triangles of their images, and adds the triangles to the light maps.
fn splat_triangles(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    triangles: &Triangles,
    light_map: &Image,
    clear: &mut bool,
) -> Result<()> {
    if scene.lights.count == 0 {
        return Ok(());
    }
    recorder.pass("clear counts", |r| {
        triangles.record_clear(r);
        r.barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
    })?;
    recorder.pass("facet flux", |r| {
        triangles.record_facet_flux(r, scene);
        next(r);
    })?;
    let is_traced = scene.geometry.can_occlude && triangles.traces_corners;
    if is_traced {
        recorder.pass("trace facets", |r| {
            triangles.record_trace_facets(r, scene);
            next(r);
        })?;
        recorder.pass("visible flux", |r| {
            triangles.record_visible_flux(r, scene);
            next(r);
        })?;
    }
    recorder.pass("total flux", |r| {
        triangles.record_total_flux(r, scene);
        next(r);
    })?;
    recorder.pass("choose shares", |r| {
        if triangles.has_error_target() {
            triangles.record_facet_error(r, scene);
            next(r);
        }
        triangles.record_choose_share(r, scene);
        next(r);
    })?;
    recorder.pass("count patches", |r| {
        triangles.record_facet_count(r, scene);
        next(r);
    })?;
    recorder.pass("number patches", |r| {
        triangles.record_number_patches(r, scene);
        next(r);
        triangles.record_scan_patches(r, scene);
        next(r);
    })?;
    if is_traced {
        recorder.pass("trace patches", |r| {
            triangles.record_trace_patches(r, scene);
            next(r);
        })?;
    }
    recorder.pass("count triangles", |r| {
        triangles.record_patch_count(r, scene);
        next(r);
    })?;
    recorder.pass("number triangles", |r| {
        triangles.record_number_triangles(r);
        next(r);
        triangles.record_scan_triangles(r);
        next(r);
    })?;
    // A host's command buffer records the maximum number of batches. A blocking frame records as many as earlier ones used, and
    // is recorded again where these are too few; the first one reads how many there are.
    let mut batches = triangles.batches;
    if recorder.is_ours() && batches > 1 {
        batches = match triangles.expected_batches {
            Some(expected) => expected,
            None => {
                recorder.submit()?;
                triangles.batches_in_use()?
            }
        };
    }
    let size = u64::from(triangles.batch);
    recorder.tiled(
        "triangles",
        u64::from(batches) * size,
        size,
        |r, done, _| {
            let batch = (done / size) as u32;
            r.pass("project triangles", |r| {
                triangles.record_project(r, scene, batch);
                r.barrier(Access::COMPUTE_WRITE, LIST_READ);
            })?;
            r.pass("splat triangles", |r| {
                triangles.record_splat(r, light_map, batch, *clear);
                after_draw(r);
            })?;
            *clear = false;
            Ok(size)
        },
    )
}

/// Adds the coarser levels to the finer ones, in steps of rows, each of which may be a submission of its own.
fn add_levels(recorder: &mut Recorder, scene: &DeviceScene, resolve: &Resolve) -> Result<()> {
    recorder.pass("find levels", |r| {
        resolve.record_levels(r, scene);
        r.barrier(
            Access::COMPUTE_WRITE,
            Access::COMPUTE.and(Access::INDIRECT_READ),
        );
    })?;
    let [_, height] = scene.receivers.largest_light_map();
    // Coarser levels have a border of one texel.
    let rows_of = |level: u32| ((height - 1) >> level) + 3;
    let is_split = rows_of(1) > resolve.levels.rows;
    for level in (0..MAX_LEVEL).rev() {
        let rows = rows_of(level + 1);
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

/// The paper's gather: sums over all patches at every texel, one batch of patches at a time.
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

/// Traces points and splats each onto one texel.
fn splat_points(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    points: &Points,
    light_map: &Image,
    clear: &mut bool,
) -> Result<()> {
    points.each_batch(recorder, "points", |r, batch| {
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
        Ok(())
    })
}

/// Extends the tiles of mesh receivers around their charts.
pub fn dilate_meshes<'a>(
    recorder: &mut Recorder,
    tiles: impl Iterator<Item = &'a Tile>,
    dilate: Option<&Dilate>,
) -> Result<()> {
    let Some(dilate) = dilate else {
        return Ok(());
    };
    for (receiver, tile) in (0..).zip(tiles) {
        let height = tile.size[1];
        for rows in bands(tile.size, DILATE_BAND) {
            recorder.pass("dilate", |r| {
                r.barrier(LIGHT_MAP_WRITE, Access::COMPUTE);
                dilate.record(r, receiver, tile, rows.clone());
                r.barrier(Access::COMPUTE_WRITE, Access::COMPUTE.and(Access::BLEND));
            })?;
            submit_if(recorder, rows, height)?;
        }
    }
    Ok(())
}
