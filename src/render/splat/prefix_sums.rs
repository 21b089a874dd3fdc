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
    is_limited: bool,
}

impl PrefixSums {
    /// Of `numbers`; `block_sums` and `totals` are written, too. If there are `units`, there are at most as many numbers as units
    /// in these totals.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        [numbers, block_sums, totals]: [&Buffer; 3],
        units: Option<&Buffer>,
    ) -> Result<Self> {
        let [numbers, sums, totals] = [numbers, block_sums, totals].map(Resource::Buffer);
        let units_bound = ("unit_totals", units.map_or(sums, Resource::Buffer));
        let in_blocks = [("numbers", numbers), ("block_sums", sums), units_bound];
        let over_blocks = [("block_sums", sums), ("totals", totals), units_bound];
        Ok(Self {
            number: scene.compute(context, &shaders::NUMBER_COMP, &in_blocks)?,
            scan: scene.compute(context, &shaders::SCAN_COMP, &over_blocks)?,
            is_limited: units.is_some(),
        })
    }

    /// Sums within blocks of at most `count` numbers.
    pub fn record_number(&self, recorder: &mut Recorder, count: u32) {
        let push = NumberPush {
            count,
            is_limited: u32::from(self.is_limited),
        };
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
            count,
            is_limited: u32::from(self.is_limited),
            batches,
            batch_size,
        };
        recorder.dispatch(&self.scan, &push, [1, 1, 1]);
    }
}
