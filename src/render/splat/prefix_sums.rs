//! Prefix sums on the device: numbers of patches or triangles become positions in a list.

use crate::error::Result;
use crate::gpu::{BoundPipeline, Buffer, Context, Recorder, Resource, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::constants::SPLAT_GROUP;
use crate::render::gpu_types::{NumberPush, ScanPush};
use std::sync::Arc;

/// Largest number of workgroups along an axis that every device supports.
const MAX_GROUPS: u32 = 65_535;

/// Prefix sums in two steps.
pub struct PrefixSums {
    number: BoundPipeline,
    scan: BoundPipeline,
}

impl PrefixSums {
    /// Of `numbers`; `block_sums` and `totals` are written, too.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        numbers: &Buffer,
        block_sums: &Buffer,
        totals: &Buffer,
    ) -> Result<Self> {
        let [numbers, block_sums, totals] = [numbers, block_sums, totals].map(Resource::Buffer);
        let in_blocks = [("numbers", numbers), ("block_sums", block_sums)];
        let over_blocks = [("block_sums", block_sums), ("totals", totals)];
        Ok(Self {
            number: scene.compute(context, &shaders::NUMBER_COMP, &in_blocks)?,
            scan: scene.compute(context, &shaders::SCAN_COMP, &over_blocks)?,
        })
    }

    /// Sums within blocks of `count` numbers.
    pub fn record_number(&self, recorder: &mut Recorder, count: u32) {
        let push = NumberPush { count };
        let blocks = count.div_ceil(SPLAT_GROUP);
        recorder.dispatch(&self.number, &push, threads(blocks));
    }

    /// Sums over blocks, and the arguments of the passes that follow, in so many batches of such a size.
    pub fn record_scan(
        &self,
        recorder: &mut Recorder,
        count: u32,
        [batches, batch_size]: [u32; 2],
    ) {
        let push = ScanPush {
            block_count: count.div_ceil(SPLAT_GROUP),
            batches,
            batch_size,
        };
        recorder.dispatch(&self.scan, &push, [1, 1, 1]);
    }
}

/// Threads in as many rows of workgroups as the device needs.
pub fn threads(units: u32) -> [u32; 3] {
    let groups = units.div_ceil(SPLAT_GROUP);
    let columns = groups.min(MAX_GROUPS);
    [columns * SPLAT_GROUP, groups.div_ceil(columns.max(1)), 1]
}
