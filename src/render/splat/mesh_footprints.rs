//! curved: the images of the lights in the patches on the curved receivers, listed in a fixed order
//! and added to the light maps; and dilate: light maps continued around their charts.

use crate::error::Result;
use crate::gpu::{Access, Buffer, Context, Image, Pipeline, Recorder, Resource, Topology, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::dispatch::bands;
use crate::render::gpu_types::{CurvedPush, DilatePush, Spot};
use crate::render::splat::footprints::Kernels;
use crate::render::splat::kernel_profiles::FLAT_SPREAD;
use crate::render::splat::list::{Batch, Listed};
use std::sync::Arc;

/// Spots of a patch on a receiver one way; as in curved.comp.
const SLOTS: u32 = 32;

pub struct Splats {
    kernels: Kernels,
    draw: Pipeline,
    pub listed: Listed,
}

impl Splats {
    pub fn new(context: &Arc<Context>, scene: &DeviceScene, patches: &Buffer) -> Result<Self> {
        let slots = SLOTS * scene.lobes * scene.curved_count();
        // Only flat receivers have coarser levels.
        let room = scene.pair_room();
        let listed = Listed::new(context, scene, room, size_of::<Spot>(), slots, 0)?;
        let own = [("spots", Resource::Buffer(&listed.thrown))];
        let kernels = Kernels::new(
            context,
            scene,
            &shaders::CURVED_COMP,
            patches,
            &listed,
            &own,
        )?;
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
            kernels,
            draw,
            listed,
        })
    }

    pub fn record_project(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        (batch, is_sky): (Batch, bool),
    ) {
        let (pipeline, spread) = self.kernels.of(is_sky);
        let push = CurvedPush {
            first_pair: batch.first_pair,
            pair_count: batch.pair_count,
            patch_count: batch.class.patch_count,
            curved_count: scene.curved_count(),
            lobes: scene.lobes,
            spread,
            flat_spread: FLAT_SPREAD,
            trace: u32::from(scene.trace),
            merged: u32::from(is_sky),
        };
        recorder.dispatch(pipeline, &push, [batch.pair_count, 1, 1]);
    }

    pub fn record_draw(&self, recorder: &mut Recorder, light_map: &Image, clear: bool) {
        self.listed
            .record_draw(recorder, &self.draw, light_map, clear);
    }
}

/// Texels of a submission: 40 ms on two CPU cores.
const BAND: u32 = 1 << 21;

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
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn record(&self, recorder: &mut Recorder, scene: &DeviceScene, from: Access) -> Result<()> {
        for (curved, tile) in scene.curved_tiles().iter().enumerate() {
            let [width, _] = tile.size;
            let bands = bands(tile.size, BAND);
            let is_split = bands.len() > 1;
            for rows in bands {
                recorder.pass("dilate", |r| {
                    r.barrier(from, Access::COMPUTE);
                    let push = DilatePush {
                        curved: curved as u32,
                        first_row: rows.start,
                    };
                    r.dispatch(&self.pipeline, &push, [width, rows.end - rows.start, 1]);
                    r.barrier(Access::COMPUTE_WRITE, Access::COMPUTE.and(Access::BLEND));
                })?;
                if is_split {
                    recorder.submit()?;
                }
            }
        }
        Ok(())
    }
}
