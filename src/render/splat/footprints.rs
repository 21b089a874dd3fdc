//! project: the image of every light in every patch on every receiver, as a footprint.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline, Recorder, Resource, Shader, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::environment::pairs::Class;
use crate::render::gpu_types::{Footprint, ProjectPush};
use crate::render::splat::kernel_profiles::{FLAT_SPREAD, MERGED_SPREAD, SPREAD, profiles};
use crate::render::splat::list::{Batch, Listed};
use glam::UVec2;
use std::sync::Arc;

/// Footprints that a patch may throw on a receiver one way: one, and its fold.
const SLOTS: u32 = 2;

/// A stage that throws kernels.
pub struct Kernels {
    /// Of suns and lamps, by the patches that sample made.
    of_suns: Pipeline,
    /// Of the environment's cells, by merged patches.
    of_sky: Option<Pipeline>,
    /// In the place of the environment's.
    _no_pairs: Buffer,
}

impl Kernels {
    /// With `own` buffers of the shader beside the patches, lights and lists that all such stages have.
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        shader: &'static Shader,
        patches: &Buffer,
        listed: &Listed,
        own: &[(&'static str, Resource)],
    ) -> Result<Self> {
        let profiles = Buffer::with_data(context, "profiles", &profiles())?;
        let pipeline = |patches: &Buffer, lights: &Buffer, pairs: &Buffer| {
            let mut all = own.to_vec();
            all.extend([
                ("patches", Resource::Buffer(patches)),
                ("suns", Resource::Buffer(lights)),
                ("pairs", Resource::Buffer(pairs)),
                ("profiles", Resource::Buffer(&profiles)),
                ("counts", Resource::Buffer(&listed.counts)),
                ("group_counts", Resource::Buffer(&listed.group_counts)),
            ]);
            scene.compute(context, shader, &all)
        };
        let no_pairs = Buffer::new(context, "no pairs", size_of::<UVec2>() as u64)?;
        let of_suns = pipeline(patches, &scene.suns, &no_pairs)?;
        let of_sky = (scene.pairs.as_ref())
            .map(|pairs| pipeline(&pairs.patches, &pairs.lights, &pairs.pairs))
            .transpose()?;
        Ok(Self {
            of_suns,
            of_sky,
            _no_pairs: no_pairs,
        })
    }

    /// The pipeline, and the kernels' variance over that of their patches.
    pub fn of(&self, is_sky: bool) -> (&Pipeline, f32) {
        match &self.of_sky {
            Some(of_sky) if is_sky => (of_sky, MERGED_SPREAD),
            _ => (&self.of_suns, SPREAD),
        }
    }
}

pub struct Project {
    kernels: Kernels,
    pub listed: Listed,
}

impl Project {
    pub fn new(context: &Arc<Context>, scene: &DeviceScene, patches: &Buffer) -> Result<Self> {
        let slots = SLOTS * scene.flat_targets();
        let listed = Listed::new(
            context,
            scene,
            scene.pair_room(),
            size_of::<Footprint>(),
            slots,
            scene.flat_count,
        )?;
        let own = [
            ("footprints", Resource::Buffer(&listed.thrown)),
            ("coarse", Resource::Buffer(&listed.coarse)),
        ];
        let kernels = Kernels::new(
            context,
            scene,
            &shaders::PROJECT_COMP,
            patches,
            &listed,
            &own,
        )?;
        Ok(Self { kernels, listed })
    }

    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        (batch, is_sky): (Batch, bool),
    ) {
        let Class {
            first_light,
            patch_count,
            ..
        } = batch.class;
        let (pipeline, spread) = self.kernels.of(is_sky);
        let push = ProjectPush {
            first_pair: batch.first_pair,
            pair_count: batch.pair_count,
            patch_count,
            first_light,
            receiver_count: scene.flat_count,
            lobes: scene.lobes,
            spread,
            flat_spread: FLAT_SPREAD,
            trace: u32::from(scene.trace),
            merged: u32::from(is_sky),
        };
        recorder.dispatch(pipeline, &push, [batch.pair_count, 1, 1]);
    }
}
