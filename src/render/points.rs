//! points: low-discrepancy points on the mirrors and in the suns' discs, one texel each. The
//! plain baseline.

use super::layout::{PointSplat, PointsDrawPush, PointsPush};
use super::upload::DeviceScene;
use crate::error::Result;
use crate::gpu::{Buffer, Context, Image, Pipeline, Recorder, Resource, Topology, shaders};
use glam::Vec2;
use std::sync::Arc;

/// Points of one batch; its buffer stays under the 128 MiB that lavapipe allows.
const BATCH: u32 = 1 << 17;

pub struct Points {
    trace: Pipeline,
    draw: Pipeline,
    /// Of each sun.
    points: u32,
    /// (first point, points)
    pub batches: Vec<(u32, u32)>,
}

impl Points {
    /// Points on `scene`'s mirrors, `samples` in all.
    pub fn new(context: &Arc<Context>, scene: &DeviceScene, samples: u32) -> Result<Self> {
        let points = samples.div_ceil(scene.sun_count.max(1));
        let all = if scene.reflector_count > 0 {
            points * scene.sun_count
        } else {
            0
        };
        let batches = (0..all)
            .step_by(BATCH as usize)
            .map(|first| (first, BATCH.min(all - first)))
            .collect();
        let bytes =
            u64::from(BATCH.min(all)) * scene.tiles.len() as u64 * size_of::<PointSplat>() as u64;
        let splats = Buffer::new(context, "point splats", bytes)?;
        let trace = Pipeline::compute(
            context,
            &shaders::POINTS_COMP,
            &[
                ("triangles", Resource::Buffer(&scene.triangles)),
                ("normals", Resource::Buffer(&scene.normals)),
                ("nodes", Resource::Buffer(&scene.nodes)),
                ("objects", Resource::Buffer(&scene.objects)),
                ("suns", Resource::Buffer(&scene.suns)),
                ("receivers", Resource::Buffer(&scene.receivers)),
                ("reflectors", Resource::Buffer(&scene.reflectors)),
                ("splats", Resource::Buffer(&splats)),
            ],
        )?;
        let draw = Pipeline::graphics(
            context,
            &shaders::POINTS_VERT,
            &shaders::POINTS_FRAG,
            Topology::Points,
            &[("splats", Resource::Buffer(&splats))],
        )?;
        Ok(Self {
            trace,
            draw,
            points,
            batches,
        })
    }

    pub fn record_trace(&self, recorder: &mut Recorder, scene: &DeviceScene, batch: (u32, u32)) {
        let (first_point, batch_points) = batch;
        let push = PointsPush {
            first_point,
            batch_points,
            points: self.points,
            reflector_count: scene.reflector_count,
            receiver_count: scene.tiles.len() as u32,
            trace: u32::from(scene.trace),
        };
        recorder.dispatch(&self.trace, &push, [batch_points, 1, 1]);
    }

    pub fn record_draw(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        batch: (u32, u32),
        map: &Image,
    ) {
        let push = PointsDrawPush {
            atlas_size: Vec2::new(map.width as f32, map.height as f32),
        };
        recorder.draw(&self.draw, map, &push, batch.1 * scene.tiles.len() as u32);
    }
}
