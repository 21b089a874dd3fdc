//! beams: patches carried along their corners' mirrored rays to the receivers, as triangles of even
//! irradiance. What most renderings of water do.

use super::Area;
use super::layout::{Beam, BeamsDrawPush, BeamsPush};
use super::parts::batches;
use super::upload::DeviceScene;
use crate::error::{Error, Result};
use crate::gpu::{Buffer, Context, Image, Pipeline, Recorder, Resource, Topology, shaders};
use glam::Vec2;
use std::sync::Arc;

/// Bytes that the beams of one batch may take: more are not faster, and leave the caches.
const MOST_BYTES: u64 = 8 << 20;

pub struct Beams {
    map: Pipeline,
    draw: Pipeline,
    /// Pairs of a batch.
    batch: u32,
    area: Area,
}

impl Beams {
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        patches: &Buffer,
        area: Area,
    ) -> Result<Self> {
        if let Some(tile) = scene.curved_tiles().first() {
            return Err(Error::Usage {
                reason: format!(
                    "the method beams lights rects only, and object `{}` is a mesh with a light map",
                    scene.scene.objects[tile.object].name
                ),
                remedy: "name another --method, or remove the object's `lightmap`".into(),
            });
        }
        let pairs = scene.patch_room * scene.sun_count;
        let bytes = u64::from(scene.flat_targets()) * size_of::<Beam>() as u64;
        let batch = (MOST_BYTES.min(context.max_storage_bytes()) / bytes).max(1) as u32;
        let beams = Buffer::new(context, "beams", u64::from(batch.min(pairs)) * bytes)?;
        let beams = ("beams", Resource::Buffer(&beams));
        let own = [("patches", Resource::Buffer(patches)), beams];
        let map = scene.compute(context, &shaders::BEAMS_COMP, &own)?;
        let draw = Pipeline::graphics(
            context,
            &shaders::BEAMS_VERT,
            &shaders::BEAMS_FRAG,
            Topology::Triangles,
            &[beams],
        )?;
        Ok(Self {
            map,
            draw,
            batch,
            area,
        })
    }

    /// (first pair, pairs): pairs are patch × sun.
    pub fn batches(&self, scene: &DeviceScene) -> Vec<(u32, u32)> {
        batches(scene.patch_count * scene.sun_count, self.batch).collect()
    }

    pub fn record_map(&self, recorder: &mut Recorder, scene: &DeviceScene, batch: (u32, u32)) {
        let (first_pair, pair_count) = batch;
        let push = BeamsPush {
            first_pair,
            pair_count,
            patch_count: scene.patch_count,
            receiver_count: scene.flat_count,
            lobes: scene.lobes,
            trace: u32::from(scene.trace),
            product: u32::from(self.area == Area::Product),
        };
        recorder.dispatch(&self.map, &push, [pair_count, 1, 1]);
    }

    pub fn record_draw(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        batch: (u32, u32),
        light_map: &Image,
        clear: bool,
    ) {
        let push = BeamsDrawPush {
            atlas_size: Vec2::new(light_map.width as f32, light_map.height as f32),
        };
        let beams = batch.1 * scene.flat_targets();
        recorder.draw(&self.draw, light_map, clear, &push, 6 * beams);
    }
}
