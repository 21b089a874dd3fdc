//! project: the image of every light in every patch on every receiver, as a footprint.

use super::kernel::{FLAT_SPREAD, SPREAD, profiles};
use super::layout::{Footprint, ProjectPush};
use super::listed::Listed;
use super::upload::DeviceScene;
use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline, Recorder, Resource, shaders};
use std::sync::Arc;

/// Footprints that a patch may throw on a receiver one way: one, and its fold.
const SLOTS: u32 = 2;

pub struct Project {
    pipeline: Pipeline,
    pub listed: Listed,
}

impl Project {
    pub fn new(context: &Arc<Context>, scene: &DeviceScene, patches: &Buffer) -> Result<Self> {
        let slots = SLOTS * scene.flat_targets();
        let listed = Listed::new(
            context,
            scene,
            size_of::<Footprint>(),
            slots,
            scene.flat_count,
        )?;
        let profiles = Buffer::with_data(context, "profiles", &profiles())?;
        let pipeline = scene.compute(
            context,
            &shaders::PROJECT_COMP,
            &[
                ("patches", Resource::Buffer(patches)),
                ("profiles", Resource::Buffer(&profiles)),
                ("footprints", Resource::Buffer(&listed.thrown)),
                ("counts", Resource::Buffer(&listed.counts)),
                ("group_counts", Resource::Buffer(&listed.group_counts)),
                ("coarse", Resource::Buffer(&listed.coarse)),
            ],
        )?;
        Ok(Self { pipeline, listed })
    }

    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        (first_pair, pair_count): (u32, u32),
    ) {
        let push = ProjectPush {
            first_pair,
            pair_count,
            patch_count: scene.patch_count,
            receiver_count: scene.flat_count,
            lobes: scene.lobes,
            spread: SPREAD,
            flat_spread: FLAT_SPREAD,
            trace: u32::from(scene.trace),
        };
        recorder.dispatch(&self.pipeline, &push, [pair_count, 1, 1]);
    }
}
