//! shade: the camera's view of surfaces, direct light, mirrors and caustics.

use super::layout::ShadePush;
use super::upload::DeviceScene;
use crate::error::Result;
use crate::gpu::{Context, Image, Pipeline, Recorder, Resource, Sampling, shaders};
use crate::scene::Camera;
use glam::DVec3;
use std::sync::Arc;

pub struct Shade {
    pipeline: Pipeline,
    /// Linear radiance, W/m²/sr.
    pub view: Image,
}

impl Shade {
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        light_map: &Image,
        direct_map: &Image,
        size: [u32; 2],
    ) -> Result<Self> {
        let view = Image::new(context, "view", size, 1, Sampling::Clamp)?;
        let pipeline = Pipeline::compute(
            context,
            &shaders::SHADE_COMP,
            &[
                ("triangles", Resource::Buffer(&scene.triangles)),
                ("normals", Resource::Buffer(&scene.normals)),
                ("nodes", Resource::Buffer(&scene.nodes)),
                ("objects", Resource::Buffer(&scene.objects)),
                ("suns", Resource::Buffer(&scene.suns)),
                ("receivers", Resource::Buffer(&scene.receivers)),
                ("environment", Resource::Image(&scene.environment)),
                ("light_map", Resource::Image(light_map)),
                ("direct_map", Resource::Image(direct_map)),
                ("view", Resource::Image(&view)),
            ],
        )?;
        Ok(Self { pipeline, view })
    }

    /// The picture of `camera` with `side`² samples a pixel.
    pub fn record(&self, recorder: &mut Recorder, scene: &DeviceScene, camera: &Camera, side: u32) {
        let forward = (camera.target - camera.position).normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let up = right.cross(forward);
        let half_height = (0.5 * camera.fov).tan();
        let aspect = f64::from(self.view.width) / f64::from(self.view.height);
        let push = ShadePush {
            eye: (camera.position - scene.origin).as_vec3(),
            sun_count: scene.sun_count,
            right: (half_height * aspect * right).as_vec3(),
            has_environment: u32::from(scene.has_environment),
            up: (half_height * up).as_vec3(),
            rotation: scene.rotation,
            forward: forward.as_vec3(),
            side,
        };
        let pixels = [self.view.width, self.view.height, 1];
        recorder.dispatch(&self.pipeline, &push, pixels);
    }
}
