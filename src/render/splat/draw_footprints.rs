//! splat: adds the footprints to the light maps, as quads that the vertex stage expands.

use crate::error::Result;
use crate::gpu::{Context, Image, Pipeline, Recorder, Resource, Topology, shaders};
use crate::render::splat::list::Listed;
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
        listed.record_draw(recorder, &self.pipeline, light_map, clear);
    }
}
