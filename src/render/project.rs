//! project: the image of every light in every patch on every receiver, as a footprint; and
//! compact: the list of those that exist, in a fixed order.

use super::kernel::{FLAT_SPREAD, SPREAD, profiles};
use super::layout::{CompactPush, Footprint, ProjectPush};
use super::parts::batches;
use super::upload::{COARSEST, DeviceScene};
use crate::error::Result;
use crate::gpu::{Buffer, Context, Pipeline, Recorder, Resource, shaders};
use std::sync::Arc;

/// Workgroup size of project.comp and compact.comp.
const GROUP: u32 = 64;
/// Pairs of a thread of compact.comp.
const PAIRS: u32 = 8;
/// Footprints that a patch may throw on a receiver one way: one, and its fold.
const SLOTS: u32 = 2;
/// Bytes that the footprints of one batch may take.
const MOST_BYTES: u64 = 96 << 20;

pub struct Project {
    project: Pipeline,
    compact: Pipeline,
    pub footprints: Buffer,
    /// Index buffer of the listed footprints' quads.
    pub quads: Buffer,
    /// A `VkDrawIndexedIndirectCommand` over the quads, their number, and that of the pairs
    /// that have any.
    pub arguments: Buffer,
    /// Bit l is set for receivers that have footprints in level l of their light map.
    pub coarse: Buffer,
    /// A `VkDispatchIndirectCommand` for every step of resolve, by the level that is added to.
    pub steps: Buffer,
    /// Pairs of a batch.
    batch: u32,
    receiver_count: u32,
    lobes: u32,
}

impl Project {
    pub fn new(context: &Arc<Context>, scene: &DeviceScene, patches: &Buffer) -> Result<Self> {
        let receiver_count = scene.tiles.len() as u32;
        let pairs = scene.patch_room * scene.sun_count;
        let slots = SLOTS * scene.lobes * receiver_count;
        let bytes = size_of::<Footprint>() as u64 * u64::from(slots);
        let most = MOST_BYTES.min(context.max_storage_bytes()) / bytes;
        let batch = (most as u32 / GROUP * GROUP)
            .max(GROUP)
            .min(pairs.next_multiple_of(GROUP));

        let footprints = Buffer::new(context, "footprints", u64::from(batch) * bytes)?;
        let counts = Buffer::new(context, "footprint counts", 4 * u64::from(batch))?;
        let group_counts = Buffer::new(context, "group counts", 8 * u64::from(batch / GROUP))?;
        let quads = Buffer::new(context, "quads", 24 * u64::from(batch) * u64::from(slots))?;
        let arguments = Buffer::new(context, "draw arguments", 28)?;
        let coarse = Buffer::new(context, "coarse levels", 4 * u64::from(receiver_count))?;
        let steps = Buffer::new(context, "resolve steps", 12 * u64::from(COARSEST))?;
        let profiles = Buffer::with_data(context, "profiles", &profiles())?;
        let project = scene.compute(
            context,
            &shaders::PROJECT_COMP,
            &[
                ("patches", Resource::Buffer(patches)),
                ("profiles", Resource::Buffer(&profiles)),
                ("footprints", Resource::Buffer(&footprints)),
                ("counts", Resource::Buffer(&counts)),
                ("group_counts", Resource::Buffer(&group_counts)),
                ("coarse", Resource::Buffer(&coarse)),
            ],
        )?;
        let compact = scene.compute(
            context,
            &shaders::COMPACT_COMP,
            &[
                ("counts", Resource::Buffer(&counts)),
                ("group_counts", Resource::Buffer(&group_counts)),
                ("quads", Resource::Buffer(&quads)),
                ("arguments", Resource::Buffer(&arguments)),
                ("coarse", Resource::Buffer(&coarse)),
                ("steps", Resource::Buffer(&steps)),
            ],
        )?;
        Ok(Self {
            project,
            compact,
            footprints,
            quads,
            arguments,
            coarse,
            steps,
            batch,
            receiver_count,
            lobes: scene.lobes,
        })
    }

    /// (first pair, pairs): pairs are patch × sun.
    pub fn batches(&self, scene: &DeviceScene) -> Vec<(u32, u32)> {
        batches(scene.patch_count * scene.sun_count, self.batch).collect()
    }

    pub fn record_project(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        (first_pair, pair_count): (u32, u32),
    ) {
        let push = ProjectPush {
            first_pair,
            pair_count,
            patch_count: scene.patch_count,
            receiver_count: self.receiver_count,
            lobes: self.lobes,
            spread: SPREAD,
            flat_spread: FLAT_SPREAD,
            trace: u32::from(scene.trace),
        };
        recorder.dispatch(&self.project, &push, [pair_count, 1, 1]);
    }

    pub fn record_compact(&self, recorder: &mut Recorder, (_, pair_count): (u32, u32)) {
        let push = CompactPush {
            pair_count,
            slots: SLOTS * self.lobes * self.receiver_count,
            receiver_count: self.receiver_count,
        };
        recorder.dispatch(&self.compact, &push, [pair_count.div_ceil(PAIRS), 1, 1]);
    }
}
