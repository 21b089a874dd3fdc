//! direct: light that reaches the receivers without a mirror.

use crate::error::Result;
use crate::gpu::{BoundPipeline, Context, Image, Recorder, Resource, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::dispatch::GroupRect;
use crate::render::gpu_types::DirectPush;
use std::sync::Arc;

/// Of a texel, to each sun and to the environment; the constants of direct.comp.
const SUN_RAYS: u64 = 16;
const ENVIRONMENT_RAYS: u64 = 64;

pub struct Direct {
    pipeline: BoundPipeline,
}

impl Direct {
    pub fn new(context: &Arc<Context>, scene: &DeviceScene, direct_map: &Image) -> Result<Self> {
        let own = [("direct_map", Resource::Image(direct_map))];
        let pipeline = scene.compute(context, &shaders::DIRECT_COMP, &own)?;
        Ok(Self { pipeline })
    }

    /// Rays of a texel. `with_suns` as for [`Direct::record`].
    pub fn rays(scene: &DeviceScene, with_suns: bool) -> u64 {
        let suns = if with_suns {
            scene.lights.scene_count
        } else {
            0
        };
        SUN_RAYS * u64::from(suns) + ENVIRONMENT_RAYS * u64::from(scene.environment.is_present)
    }

    /// Irradiance of a part of a receiver from the environment, and from the suns where
    /// `with_suns` (the view shades those itself, more sharply).
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        (tile, part): (usize, GroupRect),
        with_suns: bool,
    ) {
        let (receiver, is_curved) = scene.receivers.of_tile(tile);
        let push = DirectPush {
            first: part.first,
            receiver,
            triangle: scene
                .geometry
                .store
                .indices(scene.receivers.tiles[tile].object)[0],
            sun_count: if with_suns {
                scene.lights.scene_count
            } else {
                0
            },
            has_environment: u32::from(scene.environment.is_present),
            rotation: scene.environment.rotation,
            is_curved: u32::from(is_curved),
        };
        recorder.dispatch(&self.pipeline, &push, part.threads());
    }
}
