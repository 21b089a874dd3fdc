//! sample: cuts the mirrors' triangles into patches, the paper's sample points.

use super::layout::{Patch, SamplePush};
use super::upload::DeviceScene;
use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline, Recorder, Resource, shaders};
use std::sync::Arc;

/// Workgroup size of sample.comp.
const GROUP: u32 = 64;
/// Patches of a dispatch: no device takes fewer than 65 535 workgroups.
const BATCH: u32 = 65_535 * GROUP;

pub struct Sample {
    pipeline: Pipeline,
    pub patches: Buffer,
}

impl Sample {
    pub fn new(context: &Arc<Context>, scene: &DeviceScene) -> Result<Self> {
        let bytes = u64::from(scene.patch_count) * size_of::<Patch>() as u64;
        let patches = Buffer::new(context, "patches", bytes)?;
        let own = [("patches", Resource::Buffer(&patches))];
        let pipeline = scene.compute(context, &shaders::SAMPLE_COMP, &own)?;
        Ok(Self { pipeline, patches })
    }

    pub fn record(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        for first_patch in (0..scene.patch_count).step_by(BATCH as usize) {
            let push = SamplePush {
                first_patch,
                patch_count: scene.patch_count,
                reflector_count: scene.reflector_count,
            };
            let patches = BATCH.min(scene.patch_count - first_patch);
            recorder.dispatch(&self.pipeline, &push, [patches.div_ceil(GROUP), 1, 1]);
        }
    }
}
