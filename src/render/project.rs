//! project: the image of every light in every patch on every receiver, as a footprint.

use super::kernel::{FLAT_SPREAD, MERGED_SPREAD, SPREAD, profiles};
use super::layout::{Footprint, ProjectPush};
use super::listed::{Batch, Listed};
use super::pairs::Class;
use super::upload::DeviceScene;
use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline, Recorder, Resource, shaders};
use glam::UVec2;
use std::sync::Arc;

/// Footprints that a patch may throw on a receiver one way: one, and its fold.
const SLOTS: u32 = 2;

pub struct Project {
    /// Of suns and lamps, by the patches that sample made.
    of_suns: Pipeline,
    /// Of the environment's cells, by merged patches.
    of_sky: Option<Pipeline>,
    pub listed: Listed,
    /// In the place of the environment's.
    _no_pairs: Buffer,
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
        let profiles = Buffer::with_data(context, "profiles", &profiles())?;
        let pipeline = |patches: &Buffer, lights: &Buffer, pairs: &Buffer| {
            scene.compute(
                context,
                &shaders::PROJECT_COMP,
                &[
                    ("patches", Resource::Buffer(patches)),
                    ("suns", Resource::Buffer(lights)),
                    ("pairs", Resource::Buffer(pairs)),
                    ("profiles", Resource::Buffer(&profiles)),
                    ("footprints", Resource::Buffer(&listed.thrown)),
                    ("counts", Resource::Buffer(&listed.counts)),
                    ("group_counts", Resource::Buffer(&listed.group_counts)),
                    ("coarse", Resource::Buffer(&listed.coarse)),
                ],
            )
        };
        let no_pairs = Buffer::new(context, "no pairs", size_of::<UVec2>() as u64)?;
        let of_suns = pipeline(patches, &scene.suns, &no_pairs)?;
        let of_sky = (scene.pairs.as_ref())
            .map(|pairs| pipeline(&pairs.patches, &pairs.lights, &pairs.pairs))
            .transpose()?;
        Ok(Self {
            of_suns,
            of_sky,
            listed,
            _no_pairs: no_pairs,
        })
    }

    /// Those of the environment after the others.
    pub fn batches(&self, scene: &DeviceScene) -> impl Iterator<Item = (Batch, bool)> {
        self.listed.batches_and_sky(scene, scene.lights(false))
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
        let push = ProjectPush {
            first_pair: batch.first_pair,
            pair_count: batch.pair_count,
            patch_count,
            first_light,
            receiver_count: scene.flat_count,
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
}
