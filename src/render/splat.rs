//! splat: adds the footprints to the light maps, as quads that the vertex stage expands.

use super::layout::SplatPush;
use super::listed::Listed;
use crate::error::Result;
use crate::gpu::{Context, Image, Pipeline, Recorder, Resource, Topology, shaders};
use glam::Vec2;
use std::sync::Arc;

pub struct Splat {
    pipeline: Pipeline,
}

impl Splat {
    pub fn new(context: &Arc<Context>, listed: &Listed) -> Result<Self> {
        let pipeline = Pipeline::graphics(
            context,
            &shaders::SPLAT_VERT,
            &shaders::SPLAT_FRAG,
            Topology::Triangles,
            &[("footprints", Resource::Buffer(&listed.thrown))],
        )?;
        Ok(Self { pipeline })
    }

    pub fn record(&self, recorder: &mut Recorder, listed: &Listed, light_map: &Image, clear: bool) {
        let push = SplatPush {
            atlas_size: Vec2::new(light_map.width as f32, light_map.height as f32),
        };
        let (quads, arguments) = (&listed.quads, &listed.arguments);
        recorder.draw_indexed_indirect(&self.pipeline, light_map, clear, &push, quads, arguments);
    }
}
