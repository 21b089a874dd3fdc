//! listed: the room for what the pairs of patch and sun throw, and compact: the list of the slots that
//! are used, in a fixed order, for one indirect draw.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Image, Pipeline, Recorder, Resource, shaders};
use crate::render::device_scene::{COARSEST, DeviceScene};
use crate::render::environment::pairs::Class;
use crate::render::gpu_types::{CompactPush, DrawPush};
use glam::Vec2;
use std::sync::Arc;

/// Workgroup size of project.comp, curved.comp and compact.comp.
const GROUP: u32 = 64;
/// Pairs of a thread of compact.comp.
const PAIRS: u32 = 8;
/// Bytes that what is thrown by one batch may take.
const MOST_BYTES: u64 = 96 << 20;

/// Texels of a step of resolve: 40 ms on two CPU cores.
const STEP_TEXELS: u32 = 1 << 19;

/// Some pairs of a class.
#[derive(Debug, Clone, Copy)]
pub struct Batch {
    pub class: Class,
    pub first_pair: u32,
    pub pair_count: u32,
}

pub struct Listed {
    compact: Pipeline,
    /// What is thrown: `slots` a pair, the used ones first.
    pub thrown: Buffer,
    /// By pair, how many of its slots are used; and of a workgroup, beside its pairs that use any.
    pub counts: Buffer,
    pub group_counts: Buffer,
    /// Index buffer of the listed quads.
    pub quads: Buffer,
    /// A `VkDrawIndexedIndirectCommand` over the quads, their number, and that of the pairs
    /// that have any.
    pub arguments: Buffer,
    /// Bit l is set for receivers that have footprints in level l of their light map.
    pub coarse: Buffer,
    /// A `VkDispatchIndirectCommand` for every step of resolve, by the level that is added to.
    pub steps: Buffer,
    /// Pairs that there is room for at once.
    pub batch: u32,
    /// Of a pair.
    slots: u32,
    /// Receivers that have coarser levels.
    receiver_count: u32,
    /// Rows of a step of resolve, at most.
    pub rows: u32,
}

impl Listed {
    /// Room for `pairs`, or a batch of them, with `slots` of `slot_bytes` each; `receiver_count` receivers
    /// with coarser levels.
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        pairs: u32,
        slot_bytes: usize,
        slots: u32,
        receiver_count: u32,
    ) -> Result<Self> {
        let bytes = slot_bytes as u64 * u64::from(slots);
        let most = MOST_BYTES.min(context.max_storage_bytes()) / bytes;
        let batch = (most as u32 / GROUP * GROUP)
            .max(GROUP)
            .min(pairs.next_multiple_of(GROUP));

        let thrown = Buffer::new(context, "thrown", u64::from(batch) * bytes)?;
        let counts = Buffer::new(context, "counts", 4 * u64::from(batch))?;
        let group_counts = Buffer::new(context, "group counts", 8 * u64::from(batch / GROUP))?;
        let quads = Buffer::new(context, "quads", 24 * u64::from(batch) * u64::from(slots))?;
        let arguments = Buffer::new(context, "draw arguments", 28)?;
        let coarse = Buffer::new(context, "coarse levels", 4 * u64::from(receiver_count))?;
        let steps = Buffer::new(context, "resolve steps", 12 * u64::from(COARSEST))?;
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
            compact,
            thrown,
            counts,
            group_counts,
            quads,
            arguments,
            coarse,
            steps,
            batch,
            slots,
            receiver_count,
            rows: (STEP_TEXELS / scene.largest_light_map()[0]).max(1),
        })
    }

    pub fn record(&self, recorder: &mut Recorder, pair_count: u32) {
        let push = CompactPush {
            pair_count,
            slots: self.slots,
            receiver_count: self.receiver_count,
            rows: self.rows,
        };
        recorder.dispatch(&self.compact, &push, [pair_count.div_ceil(PAIRS), 1, 1]);
    }

    /// Draws the listed quads into the light maps, which `clear` empties before.
    pub fn record_draw(
        &self,
        recorder: &mut Recorder,
        pipeline: &Pipeline,
        light_map: &Image,
        clear: bool,
    ) {
        let push = DrawPush {
            atlas_size: Vec2::new(light_map.width as f32, light_map.height as f32),
        };
        let (quads, arguments) = (&self.quads, &self.arguments);
        recorder.draw_indexed_indirect(pipeline, light_map, clear, &push, quads, arguments);
    }
}
