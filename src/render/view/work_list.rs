//! Work lists: what a pass finds to be done by another one, counted on the device.

use crate::error::Result;
use crate::gpu::{BoundPipeline, Buffer, Context, Recorder, Resource, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::PlanPush;
use crate::render::gpu_types::constants::MAX_ROW;
use bytemuck::Pod;
use std::sync::Arc;

/// Items of a list that a dispatch is for.
#[derive(Debug, Clone, Copy)]
pub enum Items {
    /// First one, and number.
    Range(u32, u32),
    /// All items that the device has counted.
    All,
}

/// Two lists in one buffer, one from its front and one from its end.
pub struct WorkList {
    pub items: Buffer,
    /// Number of items of each list.
    pub counts: Buffer,
    /// A `VkDispatchIndirectCommand` for each.
    pub arguments: Buffer,
    plan: BoundPipeline,
    /// Items of a workgroup.
    pub per_group: u32,
}

impl WorkList {
    /// Lists of together at most `capacity` items of `bytes` each.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails or its memory is insufficient.
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        capacity: u64,
        bytes: u64,
        per_group: u32,
    ) -> Result<Self> {
        let items = Buffer::new(context, "work list", capacity * bytes)?;
        let counts = Buffer::new(context, "work counts", 8)?;
        let arguments = Buffer::new(context, "work arguments", 24)?;
        let own = [
            ("counts", Resource::Buffer(&counts)),
            ("arguments", Resource::Buffer(&arguments)),
        ];
        let plan = scene.compute(context, &shaders::PLAN_COMP, &own)?;
        Ok(Self {
            items,
            counts,
            arguments,
            plan,
            per_group,
        })
    }

    /// The resources that shaders call `counts` and `name`.
    pub fn resources(&self, name: &'static str) -> [(&'static str, Resource<'_>); 2] {
        let counts = ("counts", Resource::Buffer(&self.counts));
        [counts, (name, Resource::Buffer(&self.items))]
    }

    /// Records the sizes of the indirect dispatches.
    pub fn record_plan(&self, recorder: &mut Recorder) {
        let push = PlanPush {
            per_group: self.per_group,
        };
        recorder.dispatch(&self.plan, &push, [1, 1, 1]);
    }

    /// Submits what was recorded and waits; the number of items of list 0 or 1.
    ///
    /// # Errors
    /// As [`Recorder::submit`].
    pub fn count(&self, recorder: &mut Recorder, list: usize) -> Result<u32> {
        Ok(recorder.read::<u32>(&self.counts, 2)?[list])
    }

    /// Records `pipeline` over items of list 0 or 1. `push` takes the first one.
    pub fn record<P: Pod>(
        &self,
        recorder: &mut Recorder,
        pipeline: &BoundPipeline,
        push: impl Fn(u32) -> P,
        (list, items): (u32, Items),
    ) {
        match items {
            Items::Range(first, count) => {
                let groups = count.div_ceil(self.per_group);
                let groups = [groups.min(MAX_ROW), groups.div_ceil(MAX_ROW), 1];
                recorder.dispatch_groups(pipeline, &push(first), groups);
            }
            Items::All => recorder.dispatch_indirect(pipeline, &push(0), &self.arguments, list),
        }
    }

    pub fn bytes(&self) -> u64 {
        self.items.bytes() + self.counts.bytes() + self.arguments.bytes()
    }
}
