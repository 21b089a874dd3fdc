//! beams: patches carried along their corners' mirrored rays to the receivers, as triangles of even
//! irradiance. What most renderings of water do, and right for suns that blur much less than a texel: they are
//! the footprints of these.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Image, Pipeline, Recorder, Resource, Topology, shaders};
use crate::render::Area;
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::{Beam, BeamsPush};
use crate::render::splat::list::{Batch, Listed};
use std::sync::Arc;

pub struct Beams {
    map: Pipeline,
    draw: Pipeline,
    pub listed: Listed,
    area: Area,
}

impl Beams {
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        patches: &Buffer,
        area: Area,
    ) -> Result<Self> {
        let pairs = scene.patch_room * scene.light_count();
        let slots = scene.flat_targets();
        let listed = Listed::new(context, scene, pairs, size_of::<Beam>(), slots, 0)?;
        let map = scene.compute(
            context,
            &shaders::BEAMS_COMP,
            &[
                ("patches", Resource::Buffer(patches)),
                ("beams", Resource::Buffer(&listed.thrown)),
                ("counts", Resource::Buffer(&listed.counts)),
                ("group_counts", Resource::Buffer(&listed.group_counts)),
            ],
        )?;
        let draw = Pipeline::graphics(
            context,
            &shaders::BEAMS_VERT,
            &shaders::BEAMS_FRAG,
            Topology::Triangles,
            &[("beams", Resource::Buffer(&listed.thrown))],
        )?;
        Ok(Self {
            map,
            draw,
            listed,
            area,
        })
    }

    pub fn record_map(&self, recorder: &mut Recorder, scene: &DeviceScene, batch: Batch) {
        let pair_count = batch.pair_count;
        let push = BeamsPush {
            first_pair: batch.first_pair,
            pair_count,
            patch_count: batch.class.patch_count,
            first_light: batch.class.first_light,
            receiver_count: scene.flat_count,
            lobes: scene.lobes,
            trace: u32::from(scene.trace),
            product: u32::from(self.area == Area::Product),
        };
        recorder.dispatch(&self.map, &push, [pair_count, 1, 1]);
    }

    pub fn record_draw(&self, recorder: &mut Recorder, light_map: &Image, clear: bool) {
        self.listed
            .record_draw(recorder, &self.draw, light_map, clear);
    }
}
