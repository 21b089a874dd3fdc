//! shade: the camera's view of surfaces, direct light, mirrors and caustics.

use crate::error::Result;
use crate::gpu::{BoundPipeline, Context, Image, Recorder, Resource, Sampling, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::dispatch::GroupRect;
use crate::render::gpu_types::ShadePush;
use crate::render::gpu_types::constants::{VIEW_ENVIRONMENT_RAYS, VIEW_LIGHT_RAYS};
use crate::scene::Camera;
use glam::DVec3;
use std::sync::Arc;

pub struct Shade {
    pipeline: BoundPipeline,
    /// Linear radiance, W/m²/sr.
    pub view: Image,
}

impl Shade {
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        [light_map, direct_map]: [&Image; 2],
        size: [u32; 2],
    ) -> Result<Self> {
        let view = Image::new(context, "view", size, 1, Sampling::Clamp)?;
        let own = [
            ("light_map", Resource::Image(light_map)),
            ("direct_map", Resource::Image(direct_map)),
            ("view", Resource::Image(&view)),
        ];
        let pipeline = scene.compute(context, &shaders::SHADE_COMP, &own)?;
        Ok(Self { pipeline, view })
    }

    /// Pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.view.width, self.view.height]
    }

    /// Maximum number of rays of a pixel with `side`² samples.
    pub fn rays(scene: &DeviceScene, side: u32) -> u64 {
        let samples = u64::from(side) * u64::from(side);
        let of_sample =
            1 + u64::from(VIEW_ENVIRONMENT_RAYS) * u64::from(scene.environment.is_present);
        // Each sample has at least one ray to each light.
        let of_lights =
            u64::from(VIEW_LIGHT_RAYS).max(samples) * u64::from(scene.lights.scene_count);
        // With dielectrics, a sample splits into as many rays as the stack holds, plus one.
        let splits = if scene.casters.lobes > 1 { 7 } else { 1 };
        splits * (samples * of_sample + of_lights)
    }

    /// Records a rectangle of the picture of `camera` with `side`² samples per pixel.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        camera: &Camera,
        side: u32,
        rect: GroupRect,
    ) {
        let forward = (camera.target - camera.position).normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let up = right.cross(forward);
        let half_height = (0.5 * camera.fov).tan();
        let aspect = f64::from(self.view.width) / f64::from(self.view.height);
        let push = ShadePush {
            eye: (camera.position - scene.geometry.store.origin).as_vec3(),
            light_count: scene.lights.scene_count,
            right: (half_height * aspect * right).as_vec3(),
            has_environment: u32::from(scene.environment.is_present),
            up: (half_height * up).as_vec3(),
            rotation: scene.environment.rotation,
            forward: forward.as_vec3(),
            side,
            first: rect.first,
        };
        recorder.dispatch(&self.pipeline, &push, rect.threads());
    }
}
