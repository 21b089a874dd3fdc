//! Prefix sums on the device: numbers of patches or triangles become positions in a list.

use crate::error::Result;
use crate::gpu::{BoundPipeline, Buffer, Context, Recorder, Resource, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::dispatch::threads;
use crate::render::gpu_types::constants::SPLAT_GROUP;
use crate::render::gpu_types::{NumberPush, ScanPush};
use std::sync::Arc;

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
