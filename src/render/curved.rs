//! curved: the images of the lights in the patches on the curved receivers, listed in a fixed order
//! and added to the light maps; and dilate: light maps continued around their charts.

use super::kernel::{FLAT_SPREAD, MERGED_SPREAD, SPREAD, profiles};
use super::layout::{CurvedPush, DilatePush, Spot};
use super::listed::{Batch, Listed};
use super::upload::DeviceScene;
use crate::error::Result;
use crate::gpu::{Access, Buffer, Context, Image, Pipeline, Recorder, Resource, Topology, shaders};
use glam::UVec2;
use std::sync::Arc;

/// Spots of a patch on a receiver one way; as in curved.comp.
const SLOTS: u32 = 32;

pub struct Splats {
    /// Of suns and lamps, by the patches that sample made.
    of_suns: Pipeline,
    /// Of the environment's cells, by merged patches.
    of_sky: Option<Pipeline>,
    draw: Pipeline,
    pub listed: Listed,
    /// In the place of the environment's.
    _no_pairs: Buffer,
}

impl Splats {
    pub fn new(context: &Arc<Context>, scene: &DeviceScene, patches: &Buffer) -> Result<Self> {
        let slots = SLOTS * scene.lobes * scene.curved_count();
        // Only flat receivers have coarser levels.
        let room = scene.pair_room();
        let listed = Listed::new(context, scene, room, size_of::<Spot>(), slots, 0)?;
        let profiles = Buffer::with_data(context, "profiles", &profiles())?;
        let pipeline = |patches: &Buffer, lights: &Buffer, pairs: &Buffer| {
            scene.compute(
                context,
                &shaders::CURVED_COMP,
                &[
                    ("patches", Resource::Buffer(patches)),
                    ("suns", Resource::Buffer(lights)),
                    ("pairs", Resource::Buffer(pairs)),
                    ("profiles", Resource::Buffer(&profiles)),
                    ("spots", Resource::Buffer(&listed.thrown)),
                    ("counts", Resource::Buffer(&listed.counts)),
                    ("group_counts", Resource::Buffer(&listed.group_counts)),
                ],
            )
        };
        let no_pairs = Buffer::new(context, "no pairs", size_of::<UVec2>() as u64)?;
        let of_suns = pipeline(patches, &scene.suns, &no_pairs)?;
        let of_sky = (scene.pairs.as_ref())
            .map(|pairs| pipeline(&pairs.patches, &pairs.lights, &pairs.pairs))
            .transpose()?;
        let draw = Pipeline::graphics(
            context,
            &shaders::CURVED_VERT,
            &shaders::CURVED_FRAG,
            Topology::Triangles,
            &[
                ("spots", Resource::Buffer(&listed.thrown)),
                ("atlas_texels", Resource::Buffer(&scene.atlas_texels)),
            ],
        )?;
        Ok(Self {
            of_suns,
            of_sky,
            draw,
            listed,
            _no_pairs: no_pairs,
        })
    }

    /// Those of the environment after the others.
    pub fn batches(&self, scene: &DeviceScene) -> impl Iterator<Item = (Batch, bool)> {
        self.listed.batches_and_sky(scene, [scene.all_lights()])
    }

    pub fn record_project(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        (batch, is_sky): (Batch, bool),
    ) {
        let push = CurvedPush {
            first_pair: batch.first_pair,
            pair_count: batch.pair_count,
            patch_count: batch.class.patch_count,
            curved_count: scene.curved_count(),
            lobes: scene.lobes,
            spread: if is_sky { MERGED_SPREAD } else { SPREAD },
            flat_spread: FLAT_SPREAD,
            trace: u32::from(scene.trace),
            merged: u32::from(is_sky),
        };
        let pipeline = match &self.of_sky {
            Some(of_sky) if is_sky => of_sky,
            _ => &self.of_suns,
        };
        recorder.dispatch(pipeline, &push, [batch.pair_count, 1, 1]);
    }

    pub fn record_draw(&self, recorder: &mut Recorder, light_map: &Image, clear: bool) {
        self.listed
            .record_draw(recorder, &self.draw, light_map, clear);
    }
}

/// Fills the texels around the charts of an image with the layout of the light maps.
pub struct Dilate {
    pipeline: Pipeline,
}

impl Dilate {
    pub fn new(context: &Arc<Context>, scene: &DeviceScene, light_map: &Image) -> Result<Self> {
        let own = [("light_map", Resource::Image(light_map))];
        let pipeline = scene.compute(context, &shaders::DILATE_COMP, &own)?;
        Ok(Self { pipeline })
    }

    /// Waits for `from`, which wrote the image.
    pub fn record(&self, recorder: &mut Recorder, scene: &DeviceScene, from: Access) {
        recorder.barrier(from, Access::COMPUTE);
        for (curved, tile) in scene.curved_tiles().iter().enumerate() {
            let push = DilatePush {
                curved: curved as u32,
            };
            let [width, height] = tile.size;
            recorder.dispatch(&self.pipeline, &push, [width, height, 1]);
        }
        recorder.barrier(Access::COMPUTE_WRITE, Access::COMPUTE.and(Access::BLEND));
    }
}
