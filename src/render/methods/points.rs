//! points: the simple baseline. Low-discrepancy points on the casters and in the lights' discs, one texel each.

use crate::error::{Error, Result};
use crate::gpu::{
    BoundPipeline, Buffer, Context, Image, Recorder, Resource, Topology, Vertices, shaders,
};
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::{PointSplat, PointsPush};
use crate::render::splat::quads::draw_push;
use std::sync::Arc;

/// Maximum size of the points of one batch, bytes. Larger batches are no faster and exceed the caches.
const MAX_BYTES: u64 = 8 << 20;
/// Points in a first submission, before the speed of the device is known.
const FIRST: u64 = 1 << 12;

pub struct Points {
    trace: BoundPipeline,
    draw: BoundPipeline,
    /// What the points of a batch light.
    pub splats: Buffer,
    /// Points for each light.
    points: u32,
    /// Points for all lights.
    pub count: u32,
    /// Capacity, points per batch.
    pub batch: u32,
}

/// Number of texels that a point may light: for each lobe one texel of each planar receiver, and one of all meshes,
/// because the nearest mesh stops the light.
fn targets(scene: &DeviceScene) -> u32 {
    scene.casters.lobes
        * (scene.receivers.planar_count + u32::from(scene.receivers.mesh_count() > 0))
}

impl Points {
    /// Points on the casters of `scene`, `samples` in total.
    pub fn new(context: &Arc<Context>, scene: &DeviceScene, samples: u32) -> Result<Self> {
        let points = samples.div_ceil(scene.lights.scene_count.max(1));
        let all = match points.checked_mul(scene.lights.scene_count) {
            Some(all) => all,
            None => {
                return Err(Error::Usage {
                    reason: format!(
                        "{points} points for each of {} suns",
                        scene.lights.scene_count
                    ),
                    remedy: "ask for fewer samples".into(),
                });
            }
        };
        let bytes = u64::from(targets(scene)) * size_of::<PointSplat>() as u64;
        let batch = (MAX_BYTES.min(context.max_storage_bytes()) / bytes).max(1) as u32;
        let splats = Buffer::new(context, "point splats", u64::from(batch.min(all)) * bytes)?;
        let own = [("splats", Resource::Buffer(&splats))];
        let trace = scene.compute(context, &shaders::POINTS_COMP, &own)?;
        let drawing = [&shaders::POINTS_VERT, &shaders::POINTS_FRAG];
        let draw = scene.graphics(context, drawing, Topology::Points, &own)?;
        Ok(Self {
            trace,
            draw,
            splats,
            points,
            count: all,
            batch,
        })
    }

    /// Calls `record` for batches of points, each the first one and their number, of the work `work`.
    ///
    /// # Errors
    /// Those of `record`, and as [`Recorder::tiled`].
    pub fn each_batch(
        &self,
        recorder: &mut Recorder,
        work: &'static str,
        mut record: impl FnMut(&mut Recorder, (u32, u32)) -> Result<()>,
    ) -> Result<()> {
        recorder.tiled(work, self.count.into(), FIRST, |r, done, limit| {
            let batch = (done as u32, limit.min(self.batch.into()) as u32);
            record(r, batch)?;
            Ok(batch.1.into())
        })
    }

    pub fn record_trace(&self, recorder: &mut Recorder, scene: &DeviceScene, batch: (u32, u32)) {
        let (first_point, batch_points) = batch;
        let push = PointsPush {
            first_point,
            batch_points,
            points: self.points,
            lit_triangle_count: scene.casters.lit_count,
            receiver_count: scene.receivers.planar_count,
            mesh_receiver_count: scene.receivers.mesh_count(),
            lobes: scene.casters.lobes,
            can_occlude: u32::from(scene.geometry.can_occlude),
            max_interfaces: match scene.lattices.may_chain {
                true => scene.scene.max_interfaces,
                false => 1,
            },
            area: scene.casters.area,
            spectral_middle: scene.spectrum.middle(),
        };
        recorder.dispatch(&self.trace, &push, [batch_points, 1, 1]);
    }

    pub fn record_draw(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        batch: (u32, u32),
        light_map: &Image,
        clear: bool,
    ) {
        let push = draw_push(light_map);
        let vertices = self.vertices(scene, batch);
        recorder.draw_vertices(&self.draw, light_map, clear, &push, vertices);
    }

    /// The points of a batch, once for each texel that they may light.
    pub fn vertices(&self, scene: &DeviceScene, batch: (u32, u32)) -> Vertices<'static> {
        Vertices::Count(batch.1 * targets(scene))
    }
}
