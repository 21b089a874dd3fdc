//! The frame of the overlays: every pass and every barrier, in order, after those of view/frame.rs.
//!
//! ```text
//! project again ─► count splats ─► draw receivers ─► project again ─► outline splats ─► draw patches and cells
//! ```
//! Splats are computed again from the frame's patches, batch by batch, since the buffers hold the last batch only.

use crate::error::Result;
use crate::gpu::{Access, Recorder, Vertices};
use crate::render::barriers::ANY;
use crate::render::caustic::Caustic;
use crate::render::device_scene::DeviceScene;
use crate::render::view::camera::View;
use crate::render::view::overlay::Overlays;
use crate::scene::Camera;

/// Writes of the draws of overlays.
const WRITTEN: Access = Access::BLEND.and(Access::DRAW);

/// Draws overlays over the picture of the frame before.
pub fn overlays(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    caustic: &Caustic,
    overlays: &Overlays,
    view: &View,
    camera: &Camera,
) -> Result<()> {
    recorder.pass("begin overlays", |r| r.barrier(ANY, ANY))?;
    if let Some(counts) = &overlays.counts {
        recorder.pass("clear splat counts", |r| {
            r.clear(counts, 0..counts.height);
            r.barrier(Access::BLEND, Access::BLEND);
        })?;
        each_batch(recorder, scene, caustic, &mut |r, (kind, _), vertices| {
            r.pass("count splats", |r| {
                overlays.record_count(r, counts, kind, vertices);
                r.barrier(ANY, ANY);
            })
        })?;
        recorder.pass("draw receivers", |r| {
            r.barrier(Access::BLEND, Access::FRAGMENT_READ);
            overlays.record_receivers(r, scene, view, camera);
            r.barrier(WRITTEN, WRITTEN);
        })?;
    }
    if overlays.has_outlines() {
        each_batch(
            recorder,
            scene,
            caustic,
            &mut |r, (kind, pairs), vertices| {
                r.pass("outline splats", |r| {
                    overlays.record_outlines(r, scene, view, camera, (kind, pairs, vertices));
                    r.barrier(ANY, ANY);
                })
            },
        )?;
    }
    recorder.pass("draw patches and cells", |r| {
        overlays.record_patches(r, scene, view, camera);
        r.barrier(WRITTEN, WRITTEN);
    })
}

/// Draws a batch of splats.
type Draw<'a> = &'a mut dyn FnMut(&mut Recorder, (usize, u64), Vertices) -> Result<()>;

/// Computes the splats of a caustic, and has every batch drawn: the number of its kind, and of all
/// pairs of patch and light (1: all splats tile their receiver); and the vertices.
fn each_batch(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    caustic: &Caustic,
    draw: Draw,
) -> Result<()> {
    match caustic {
        Caustic::Gather { .. } => Ok(()),
        Caustic::Points(points) => {
            if scene.casters.lit_count == 0 {
                return Ok(());
            }
            points.each_batch(recorder, "overlays of points", |r, batch| {
                r.pass("trace points again", |r| {
                    points.record_trace(r, scene, batch);
                    r.barrier(ANY, ANY);
                })?;
                draw(r, (0, 1), points.vertices(scene, batch))
            })
        }
        Caustic::Splat {
            triangles,
            chains,
            projectors,
            ..
        } => {
            let mut kind = 0;
            if let Some(triangles) = triangles {
                let batches = match scene.lights.count {
                    0 => 0,
                    _ => triangles.expected_batches.unwrap_or(triangles.batches),
                };
                for batch in 0..batches {
                    recorder.pass("project triangles again", |r| {
                        triangles.record_project(r, scene, batch);
                        r.barrier(ANY, ANY);
                    })?;
                    draw(recorder, (kind, 1), triangles.vertices(batch))?;
                }
                kind += 1;
            }
            if let Some(chains) = chains {
                // One batch, which is in its buffer still.
                draw(
                    recorder,
                    (kind, scene.lattices.ray_capacity.into()),
                    chains.vertices(),
                )?;
                kind += 1;
            }
            for projector in projectors {
                let list = &projector.list;
                recorder.pass("clear list again", |r| {
                    r.zero(&list.arguments);
                    r.barrier(ANY, ANY);
                })?;
                projector.each_batch(recorder, scene, "overlays of pairs", |r, batch| {
                    r.pass("project pairs again", |r| {
                        projector.record_project(r, scene, batch);
                        r.barrier(ANY, ANY);
                        list.record_compact(r, batch.pair_count);
                        r.barrier(ANY, ANY);
                    })?;
                    draw(r, (kind, batch.group.pairs()), list.vertices())
                })?;
                kind += 1;
            }
            Ok(())
        }
    }
}
