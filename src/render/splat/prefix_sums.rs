//! Prefix sums on the device: numbers of patches or triangles become positions in a list.

use crate::error::Result;
use crate::gpu::{BoundPipeline, Buffer, Context, Recorder, Resource, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::dispatch::threads;
use crate::render::gpu_types::constants::SPLAT_GROUP;
use crate::render::gpu_types::{NumberPush, ScanPush};
use std::sync::Arc;

/// The first step: sums within blocks.
pub struct BlockSums {
    number: BoundPipeline,
    is_limited: bool,
}

impl BlockSums {
    /// Sums `numbers` and writes `block_sums`. With `units`, the number of summed numbers is limited to the number of units in these
    /// totals.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        [numbers, block_sums]: [&Buffer; 2],
        units: Option<&Buffer>,
    ) -> Result<Self> {
        let own = [
            ("numbers", Resource::Buffer(numbers)),
            ("block_sums", Resource::Buffer(block_sums)),
            ("unit_totals", Resource::Buffer(units.unwrap_or(block_sums))),
        ];
        Ok(Self {
            number: scene.compute(context, &shaders::NUMBER_COMP, &own)?,
            is_limited: units.is_some(),
        })
    }

    /// Sums within blocks of at most `count` numbers.
    pub fn record(&self, recorder: &mut Recorder, count: u32) {
        let push = NumberPush {
            count,
            is_limited: u32::from(self.is_limited),
        };
        let blocks = count.div_ceil(SPLAT_GROUP);
        recorder.dispatch(&self.number, &push, threads(blocks));
    }
}

/// Prefix sums in two steps.
pub struct PrefixSums {
    in_blocks: BlockSums,
    scan: BoundPipeline,
}

impl PrefixSums {
    /// Sums `numbers` and writes `block_sums` and `totals`. With `units`, the number of summed numbers is limited to the number of
    /// units in these totals.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        [numbers, block_sums, totals]: [&Buffer; 3],
        units: Option<&Buffer>,
    ) -> Result<Self> {
        let over_blocks = [
            ("block_sums", Resource::Buffer(block_sums)),
            ("totals", Resource::Buffer(totals)),
            ("unit_totals", Resource::Buffer(units.unwrap_or(block_sums))),
        ];
        Ok(Self {
            in_blocks: BlockSums::new(context, scene, [numbers, block_sums], units)?,
            scan: scene.compute(context, &shaders::SCAN_COMP, &over_blocks)?,
        })
    }

    /// Sums within blocks of at most `count` numbers.
    pub fn record_number(&self, recorder: &mut Recorder, count: u32) {
        self.in_blocks.record(recorder, count);
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
            is_limited: u32::from(self.in_blocks.is_limited),
            batches,
            batch_size,
        };
        recorder.dispatch(&self.scan, &push, [1, 1, 1]);
    }
}
