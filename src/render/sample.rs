//! sample: cuts the mirrors' triangles into patches, the paper's sample points.

use super::layout::{Patch, SamplePush};
use super::upload::DeviceScene;
use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline, Recorder, Resource, shaders};
use std::sync::Arc;

pub struct Sample {
    pipeline: Pipeline,
    pub patches: Buffer,
}

impl Sample {
    pub fn new(context: &Arc<Context>, scene: &DeviceScene) -> Result<Self> {
        let bytes = u64::from(scene.patch_count) * size_of::<Patch>() as u64;
        let patches = Buffer::new(context, "patches", bytes)?;
        let pipeline = Pipeline::compute(
            context,
            &shaders::SAMPLE_COMP,
            &[
                ("triangles", Resource::Buffer(&scene.triangles)),
                ("normals", Resource::Buffer(&scene.normals)),
                ("reflectors", Resource::Buffer(&scene.reflectors)),
                ("patches", Resource::Buffer(&patches)),
            ],
        )?;
        Ok(Self { pipeline, patches })
    }

    pub fn record(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        let push = SamplePush {
            patch_count: scene.patch_count,
            reflector_count: scene.reflector_count,
        };
        recorder.dispatch(&self.pipeline, &push, [scene.patch_count, 1, 1]);
    }
}
