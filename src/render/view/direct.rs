//! direct: light that reaches the receivers without meeting a caster.

use crate::error::Result;
use crate::gpu::{BoundPipeline, Context, Image, Recorder, Resource, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::dispatch::GroupRect;
use crate::render::gpu_types::DirectPush;
use crate::render::gpu_types::constants::{DIRECT_ENVIRONMENT_RAYS, DIRECT_RAYS_SIDE};
use std::sync::Arc;

pub struct Direct {
    pipeline: BoundPipeline,
}

impl Direct {
    pub fn new(context: &Arc<Context>, scene: &DeviceScene, direct_map: &Image) -> Result<Self> {
        let own = [("direct_map", Resource::Image(direct_map))];
        let pipeline = scene.compute(context, &shaders::DIRECT_COMP, &own)?;
        Ok(Self { pipeline })
    }

    /// Rays per texel. `with_lights` as for [`Direct::record`].
    pub fn rays(scene: &DeviceScene, with_lights: bool) -> u64 {
        let lights = if with_lights {
            scene.lights.scene_count
        } else {
            0
        };
        let of_light = u64::from(DIRECT_RAYS_SIDE * DIRECT_RAYS_SIDE);
        let of_environment = u64::from(DIRECT_ENVIRONMENT_RAYS);
        of_light * u64::from(lights) + of_environment * u64::from(scene.environment.is_present)
    }

    /// Records the irradiance of a rectangle of a receiver from the environment, and from suns and lamps if
    /// `with_lights`. The view shades suns and lamps itself, with sharper shadows.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        (tile, rect): (usize, GroupRect),
        with_lights: bool,
    ) {
        let (receiver, is_mesh) = scene.receivers.of_tile(tile);
        let push = DirectPush {
            first: rect.first,
            receiver,
            triangle: scene
                .geometry
                .store
                .indices(scene.receivers.tiles[tile].object)[0],
            light_count: if with_lights {
                scene.lights.scene_count
            } else {
                0
            },
            has_environment: u32::from(scene.environment.is_present),
            rotation: scene.environment.rotation,
            is_mesh: u32::from(is_mesh),
        };
        recorder.dispatch(&self.pipeline, &push, rect.threads());
    }
}
