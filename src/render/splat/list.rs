//! Splat list: the splats of a batch of pairs of patch and light, and compact, which lists the used slots in a fixed
//! order for one indirect draw. Equal input gives equal bits.

use crate::error::Result;
use crate::gpu::{BoundPipeline, Buffer, Context, Image, Recorder, Resource, Vertices, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::CompactPush;
use crate::render::gpu_types::constants::{PAIRS_PER_THREAD, SPLAT_GROUP};
use crate::render::lights::LightGroup;
use crate::render::splat::quads::draw_push;
use std::sync::Arc;

/// Maximum size of the splats of one batch, bytes.
const MAX_BYTES: u64 = 96 << 20;

/// A range of the pairs of a group of lights.
#[derive(Debug, Clone, Copy)]
pub struct Batch {
    pub group: LightGroup,
    pub first_pair: u32,
    pub pair_count: u32,
}

pub struct SplatList {
    compact: BoundPipeline,
    /// The slots of every pair; the used slots come first.
    pub splats: Buffer,
    /// Used slots per pair; and per workgroup, used slots and pairs that use any.
    pub counts: Buffer,
    pub group_counts: Buffer,
    /// Index buffer of the quads of the used slots.
    quads: Buffer,
    /// A `VkDrawIndexedIndirectCommand` for the quads, then the numbers of splats and of lit pairs.
    pub arguments: Buffer,
    /// Capacity, pairs per batch.
    pub capacity: u32,
    /// Slots per pair.
    slots: u32,
}

impl SplatList {
    /// A list for `pairs`, or for batches of them, with `slots` slots of `splat_bytes` each.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        pairs: u32,
        splat_bytes: usize,
        slots: u32,
    ) -> Result<Self> {
        let bytes = splat_bytes as u64 * u64::from(slots);
        let limit = MAX_BYTES.min(context.max_storage_bytes()) / bytes;
        let capacity = (limit as u32 / SPLAT_GROUP * SPLAT_GROUP)
            .max(SPLAT_GROUP)
            .min(pairs.next_multiple_of(SPLAT_GROUP));

        let splats = Buffer::new(context, "splats", u64::from(capacity) * bytes)?;
        let counts = Buffer::new(context, "counts", 4 * u64::from(capacity))?;
        let group_counts = Buffer::new(
            context,
            "group counts",
            8 * u64::from(capacity / SPLAT_GROUP),
        )?;
        let quads = Buffer::new(
            context,
            "quads",
            24 * u64::from(capacity) * u64::from(slots),
        )?;
        let arguments = Buffer::new(context, "draw arguments", 28)?;
        let compact = scene.compute(
            context,
            &shaders::COMPACT_COMP,
            &[
                ("counts", Resource::Buffer(&counts)),
                ("group_counts", Resource::Buffer(&group_counts)),
                ("quads", Resource::Buffer(&quads)),
                ("arguments", Resource::Buffer(&arguments)),
            ],
        )?;
        Ok(Self {
            compact,
            splats,
            counts,
            group_counts,
            quads,
            arguments,
            capacity,
            slots,
        })
    }

    /// Lists the used slots of these pairs.
    pub fn record_compact(&self, recorder: &mut Recorder, pair_count: u32) {
        let push = CompactPush {
            pair_count,
            slots: self.slots,
        };
        recorder.dispatch(
            &self.compact,
            &push,
            [pair_count.div_ceil(PAIRS_PER_THREAD), 1, 1],
        );
    }

    /// Draws the quads of the used slots into the light maps; `clear` clears the maps first.
    pub fn record_draw(
        &self,
        recorder: &mut Recorder,
        pipeline: &BoundPipeline,
        light_map: &Image,
        clear: bool,
    ) {
        let push = draw_push(light_map);
        recorder.draw_vertices(pipeline, light_map, clear, &push, self.vertices());
    }

    /// The quads of the used slots.
    pub fn vertices(&self) -> Vertices<'_> {
        Vertices::Indexed {
            indices: &self.quads,
            arguments: &self.arguments,
            offset: 0,
        }
    }
}
