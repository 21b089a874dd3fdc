//! resolve: the coarser levels of the light maps are added to the finer ones, one after the other.

use crate::error::Result;
use crate::gpu::{Access, Context, Image, Pipeline, Recorder, Resource, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::ResolvePush;
use crate::render::splat::list::Listed;
use std::sync::Arc;

pub struct Resolve {
    pipeline: Pipeline,
}

impl Resolve {
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        listed: &Listed,
        light_map: &Image,
    ) -> Result<Self> {
        let own = [
            ("coarse", Resource::Buffer(&listed.coarse)),
            ("light_map", Resource::Image(light_map)),
        ];
        let pipeline = scene.compute(context, &shaders::RESOLVE_COMP, &own)?;
        Ok(Self { pipeline })
    }

    /// Adds rows, of a number that `listed` has, from `first_row` on to a level. Nothing where no coarser level
    /// has footprints.
    pub fn record(&self, recorder: &mut Recorder, listed: &Listed, level: u32, first_row: u32) {
        let push = ResolvePush {
            level: level as i32,
            first_row: first_row as i32,
        };
        recorder.dispatch_indirect(&self.pipeline, &push, &listed.steps, level);
        recorder.barrier(Access::COMPUTE_WRITE, Access::COMPUTE);
    }
}
