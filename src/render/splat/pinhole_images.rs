//! light_image: the images of parts of the sky in merged patches on the rects, listed in a fixed order and
//! added to the light maps.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Image, Pipeline, Recorder, Resource, Topology, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::environment::pairs::Pairs;
use crate::render::gpu_types::{LightImage, LightImagePush};
use crate::render::splat::kernel_profiles::IMAGE_SPREAD;
use crate::render::splat::list::{Batch, Listed};
use std::sync::Arc;

pub struct LightImages {
    project: Pipeline,
    draw: Pipeline,
    pub listed: Listed,
}

impl LightImages {
    /// Levels of light maps that are used are marked in `coarse`.
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        pairs: &Pairs,
        coarse: &Buffer,
    ) -> Result<Self> {
        // Transparent surfaces have two sides. No levels of its own.
        let slots = scene.lobes * scene.lobes * scene.flat_count;
        let bytes = size_of::<LightImage>();
        let listed = Listed::new(context, scene, pairs.pair_count, bytes, slots, 0)?;
        let project = scene.compute(
            context,
            &shaders::LIGHT_IMAGE_COMP,
            &[
                ("patches", Resource::Buffer(&pairs.patches)),
                ("suns", Resource::Buffer(&pairs.lights)),
                ("pairs", Resource::Buffer(&pairs.pairs)),
                ("images", Resource::Buffer(&listed.thrown)),
                ("counts", Resource::Buffer(&listed.counts)),
                ("group_counts", Resource::Buffer(&listed.group_counts)),
                ("coarse", Resource::Buffer(coarse)),
            ],
        )?;
        let draw = Pipeline::graphics(
            context,
            &shaders::LIGHT_IMAGE_VERT,
            &shaders::LIGHT_IMAGE_FRAG,
            Topology::Triangles,
            &[("images", Resource::Buffer(&listed.thrown))],
        )?;
        Ok(Self {
            project,
            draw,
            listed,
        })
    }

    pub fn record_project(&self, recorder: &mut Recorder, scene: &DeviceScene, batch: Batch) {
        let push = LightImagePush {
            first_pair: batch.first_pair,
            pair_count: batch.pair_count,
            receiver_count: scene.flat_count,
            lobes: scene.lobes,
            spread: IMAGE_SPREAD,
            trace: u32::from(scene.trace),
        };
        recorder.dispatch(&self.project, &push, [batch.pair_count, 1, 1]);
    }

    pub fn record_draw(&self, recorder: &mut Recorder, light_map: &Image, clear: bool) {
        self.listed
            .record_draw(recorder, &self.draw, light_map, clear);
    }
}
