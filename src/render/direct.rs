//! direct: light that reaches the receivers without a mirror.

use super::layout::DirectPush;
use super::upload::DeviceScene;
use crate::error::Result;
use crate::gpu::{Context, Image, Pipeline, Recorder, Resource, shaders};
use std::sync::Arc;

pub struct Direct {
    pipeline: Pipeline,
}

impl Direct {
    pub fn new(context: &Arc<Context>, scene: &DeviceScene, direct_map: &Image) -> Result<Self> {
        let pipeline = Pipeline::compute(
            context,
            &shaders::DIRECT_COMP,
            &[
                ("triangles", Resource::Buffer(&scene.triangles)),
                ("nodes", Resource::Buffer(&scene.nodes)),
                ("suns", Resource::Buffer(&scene.suns)),
                ("receivers", Resource::Buffer(&scene.receivers)),
                ("environment", Resource::Image(&scene.environment)),
                ("direct_map", Resource::Image(direct_map)),
            ],
        )?;
        Ok(Self { pipeline })
    }

    /// Irradiance from the environment, and from the suns where `with_suns` (the view shades
    /// those itself, more sharply).
    pub fn record(&self, recorder: &mut Recorder, scene: &DeviceScene, with_suns: bool) {
        for (receiver, tile) in scene.tiles.iter().enumerate() {
            let push = DirectPush {
                receiver: receiver as u32,
                sun_count: if with_suns { scene.sun_count } else { 0 },
                has_environment: u32::from(scene.has_environment),
                rotation: scene.rotation,
            };
            let [width, height] = tile.size;
            recorder.dispatch(&self.pipeline, &push, [width, height, 1]);
        }
    }
}
