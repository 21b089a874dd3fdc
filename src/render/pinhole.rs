//! pinhole: the paper's gather over all patches at every texel.

use super::Settings;
use super::kernel::{SPREAD, profiles};
use super::layout::PinholePush;
use super::upload::DeviceScene;
use crate::error::Result;
use crate::gpu::{Buffer, Context, Image, Pipeline, Recorder, Resource, shaders};
use std::sync::Arc;

/// Patches that one dispatch gathers, so that none runs for long.
const BATCH: u32 = 1024;

pub struct Pinhole {
    pipeline: Pipeline,
    epsilon: f32,
    spread: f32,
}

impl Pinhole {
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        patches: &Buffer,
        light_map: &Image,
        settings: &Settings,
    ) -> Result<Self> {
        let profiles = Buffer::with_data(context, "profiles", &profiles())?;
        let pipeline = Pipeline::compute(
            context,
            &shaders::PINHOLE_COMP,
            &[
                ("triangles", Resource::Buffer(&scene.triangles)),
                ("nodes", Resource::Buffer(&scene.nodes)),
                ("objects", Resource::Buffer(&scene.objects)),
                ("suns", Resource::Buffer(&scene.suns)),
                ("receivers", Resource::Buffer(&scene.receivers)),
                ("patches", Resource::Buffer(patches)),
                ("profiles", Resource::Buffer(&profiles)),
                ("environment", Resource::Image(&scene.environment)),
                ("light_map", Resource::Image(light_map)),
            ],
        )?;
        Ok(Self {
            pipeline,
            epsilon: settings.epsilon,
            spread: if settings.filter { SPREAD } else { 0.0 },
        })
    }

    /// (first patch, patches) of each dispatch.
    pub fn batches(scene: &DeviceScene) -> impl Iterator<Item = (u32, u32)> + use<> {
        let patches = scene.patch_count;
        (0..patches)
            .step_by(BATCH as usize)
            .map(move |first| (first, BATCH.min(patches - first)))
    }

    pub fn record(&self, recorder: &mut Recorder, scene: &DeviceScene, batch: (u32, u32)) {
        for (receiver, tile) in scene.tiles.iter().enumerate() {
            let push = PinholePush {
                receiver: receiver as u32,
                first_patch: batch.0,
                batch_patches: batch.1,
                sun_count: scene.sun_count,
                epsilon: self.epsilon,
                spread: self.spread,
                rotation: scene.rotation,
                has_environment: u32::from(scene.has_environment),
                trace: u32::from(scene.trace),
            };
            let [width, height] = tile.size;
            recorder.dispatch(&self.pipeline, &push, [width, height, 1]);
        }
    }
}
