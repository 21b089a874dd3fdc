//! What a recorder records: barriers, dispatches, draws, clears and copies.

use super::command::{Attachment, Command, Numbered};
use super::device::Device;
use super::memory::Buffer;
use super::texel::Texel;
use super::{Access, BoundPipeline, Image, Recorder};
use crate::error::{Error, Result};
use ash::vk;
use bytemuck::Pod;
use std::ops::Range;

/// What a draw draws.
#[derive(Clone, Copy)]
pub enum Vertices<'a> {
    /// So many vertices.
    Count(u32),
    /// Those that `indices` (u32) name, as many as the `VkDrawIndexedIndirectCommand` at byte `offset` of `arguments` says.
    Indexed {
        indices: &'a Buffer,
        arguments: &'a Buffer,
        offset: u64,
    },
}

impl Recorder {
    /// The device, to record a command.
    fn device(&self) -> &Device {
        assert!(
            self.recording,
            "after an error from `submit`, record within a `pass`, which can begin again"
        );
        assert!(self.open_part.is_none(), "a reusable part has no copies");
        &self.context.device
    }

    /// Records a command, or adds it to the reusable part that is open. `push`: push constants of a [`Command::Use`].
    pub(super) fn add(&mut self, command: Command, push: &[u8]) {
        if let Some(part) = &mut self.open_part {
            part.add(command, push);
            return;
        }
        self.device(); // it is recording
        // SAFETY: a recording command buffer; the objects are the caller's, and live.
        unsafe { command.record(&self.context, self.commands, push) };
    }

    /// Calls `record`, whose commands in a host's frame are mostly those of the frame before: such commands are executed once more, in
    /// place of being recorded. A frame has at most one part of a name, and parts have neither copies nor parts in them.
    ///
    /// # Errors
    /// Those of `record`, and [`Error::Device`] where the device fails.
    ///
    /// # Panics
    /// Within another part.
    pub fn reusable(
        &mut self,
        name: &'static str,
        record: impl FnOnce(&mut Self) -> Result<()>,
    ) -> Result<()> {
        // A command buffer of ours is recorded once; of a host's, every frame in flight has timestamps of its own.
        if self.is_ours() || self.timed_frames > 0 {
            return record(self);
        }
        assert!(self.open_part.is_none(), "{name} is in another part");
        let (number, part) = self.parts.begin(name);
        self.open_part = Some(part);
        let result = record(self);
        let part = self.open_part.take();
        result?;
        match part {
            // SAFETY: it is recording, by `begin_host`; passes keep their objects as long as frames in flight use them.
            Some(part) if self.refused.is_none() => unsafe {
                self.parts.finish((number, part), self.commands)
            },
            _ => Ok(()),
        }
    }

    /// Makes what `from` wrote visible to `to`, and orders them.
    pub fn barrier(&mut self, from: Access, to: Access) {
        self.add(Command::Barrier(from, to), &[]);
    }

    /// Runs a compute shader with at least `threads` threads along each axis, in as many whole
    /// workgroups as that takes. Beyond the device's limit nothing is recorded, and
    /// [`Recorder::submit`] fails.
    pub fn dispatch<P: Pod>(&mut self, pipeline: &BoundPipeline, push: &P, threads: [u32; 3]) {
        let groups = groups(threads, pipeline.local_size());
        let limits = &self.context.properties.limits;
        let most = limits.max_compute_work_group_count;
        if let Some(axis) = (0..3).find(|&axis| groups[axis] > most[axis]) {
            self.refused.get_or_insert(Error::Device {
                action: format!("running {}", pipeline.name),
                reason: format!(
                    "it needs {} workgroups and the device allows {}",
                    groups[axis], most[axis]
                ),
                remedy: "ask for fewer samples, or choose another device".into(),
            });
            return;
        }
        if self.use_pipeline(pipeline, push) {
            self.add(Command::Dispatch(groups), &[]);
        }
    }

    /// Runs so many workgroups of a compute shader, within the limits of every device.
    pub fn dispatch_groups<P: Pod>(
        &mut self,
        pipeline: &BoundPipeline,
        push: &P,
        groups: [u32; 3],
    ) {
        let size = pipeline.local_size();
        self.dispatch(
            pipeline,
            push,
            [0, 1, 2].map(|axis| groups[axis] * size[axis]),
        );
    }

    /// Runs as many workgroups as command number `index` of `arguments` (`VkDispatchIndirectCommand`)
    /// says.
    pub fn dispatch_indirect<P: Pod>(
        &mut self,
        pipeline: &BoundPipeline,
        push: &P,
        arguments: &Buffer,
        index: u32,
    ) {
        let offset = u64::from(index) * size_of::<vk::DispatchIndirectCommand>() as u64;
        let dispatch = Command::DispatchIndirect(Numbered::of(arguments), offset);
        if self.use_pipeline(pipeline, push) {
            self.add(dispatch, &[]);
        }
    }

    /// Draws `vertices` into `target`. `clear`: it is all zero before.
    pub fn draw_vertices<P: Pod>(
        &mut self,
        pipeline: &BoundPipeline,
        target: &Image,
        clear: bool,
        push: &P,
        vertices: Vertices,
    ) {
        let color = match clear {
            true => Attachment::of(target).cleared([0; 4]),
            false => Attachment::of(target),
        };
        let (area, viewport) = whole(target, 0..target.height);
        self.draw_into(color, None, area, viewport, &[(pipeline, *push, vertices)]);
    }

    /// Draws into a color image and a depth image that lie in the same places, one draw after the other: pipeline, push
    /// constants, what to draw. In the rectangle `area` (left, top, width, height), numbers are all ones before, light
    /// is 0, and so are depths unless they `are_kept`. `viewport` maps clip space to texels in the same way.
    pub fn draw_with_depth<P: Pod>(
        &mut self,
        [color, depth]: [&Image; 2],
        are_kept: bool,
        area: [u32; 4],
        viewport: [f32; 4],
        draws: &[(&BoundPipeline, P, Vertices)],
    ) {
        let nothing = match color.texel {
            Texel::Number => [u32::MAX; 4],
            _ => [0; 4],
        };
        let color = Attachment::of(color).cleared(nothing);
        let depth = match are_kept {
            true => Attachment::of(depth),
            false => Attachment::of(depth).cleared([0; 4]),
        };
        self.draw_into(color, Some(depth), area, viewport, draws);
    }

    /// Draws over a color image where the draws are at least as near as what its depth image has: pipeline, push constants
    /// and what to draw.
    pub fn draw_over<P: Pod>(
        &mut self,
        [color, depth]: [&Image; 2],
        draws: &[(&BoundPipeline, P, Vertices)],
    ) {
        let (area, viewport) = whole(color, 0..color.height);
        let [color, depth] = [color, depth].map(Attachment::of);
        self.draw_into(color, Some(depth), area, viewport, draws);
    }

    fn draw_into<P: Pod>(
        &mut self,
        color: Attachment,
        depth: Option<Attachment>,
        area: [u32; 4],
        viewport: [f32; 4],
        draws: &[(&BoundPipeline, P, Vertices)],
    ) {
        let begin = Command::BeginRendering {
            color,
            depth,
            area,
            viewport,
        };
        self.add(begin, &[]);
        for (pipeline, push, vertices) in draws {
            if !self.use_pipeline(pipeline, push) {
                continue;
            }
            let draw = match *vertices {
                Vertices::Count(count) => Command::Draw(count),
                Vertices::Indexed {
                    indices,
                    arguments,
                    offset,
                } => Command::DrawIndexedIndirect {
                    indices: Numbered::of(indices),
                    arguments: Numbered::of(arguments),
                    offset,
                },
            };
            self.add(draw, &[]);
        }
        self.add(Command::EndRendering, &[]);
    }

    /// Fills rows of an image with zeros, as a pass of its own.
    pub fn clear(&mut self, image: &Image, rows: Range<u32>) {
        let (area, viewport) = whole(image, rows);
        let color = Attachment::of(image).cleared([0; 4]);
        self.draw_into::<u32>(color, None, area, viewport, &[]);
    }

    /// Whether the commands that follow can use it. If not, [`Recorder::submit`] fails.
    fn use_pipeline<P: Pod>(&mut self, pipeline: &BoundPipeline, push: &P) -> bool {
        let push = bytemuck::bytes_of(push);
        match pipeline.with(push) {
            Ok(used) => {
                self.add(Command::Use(used, push.len()), push);
                true
            }
            Err(error) => {
                self.refused.get_or_insert(error);
                false
            }
        }
    }

    /// Fills a buffer with zeros.
    pub fn zero(&mut self, buffer: &Buffer) {
        self.add(Command::Zero(Numbered::of(buffer)), &[]);
    }

    /// The region lies within both buffers.
    pub(super) fn copy_buffer(&mut self, from: vk::Buffer, to: vk::Buffer, region: vk::BufferCopy) {
        // SAFETY: a recording command buffer, live buffers.
        unsafe { (self.device()).cmd_copy_buffer(self.commands, from, to, &[region]) };
    }

    /// The region lies within both; the image is in layout GENERAL.
    pub(super) fn copy_to_image(
        &mut self,
        from: vk::Buffer,
        to: vk::Image,
        region: vk::BufferImageCopy,
    ) {
        let layout = vk::ImageLayout::GENERAL;
        // SAFETY: a recording command buffer, a live buffer and image.
        unsafe {
            (self.device()).cmd_copy_buffer_to_image(self.commands, from, to, layout, &[region]);
        }
    }

    /// As [`Recorder::copy_to_image`].
    pub(super) fn copy_from_image(
        &mut self,
        from: vk::Image,
        to: vk::Buffer,
        region: vk::BufferImageCopy,
    ) {
        let layout = vk::ImageLayout::GENERAL;
        // SAFETY: as above.
        unsafe {
            (self.device()).cmd_copy_image_to_buffer(self.commands, from, layout, to, &[region]);
        }
    }

    /// Moves a new image to layout GENERAL, where it stays.
    pub(super) fn begin_general(&mut self, image: vk::Image, range: vk::ImageSubresourceRange) {
        let barrier = [vk::ImageMemoryBarrier2::default()
            .dst_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
            .dst_access_mask(vk::AccessFlags2::MEMORY_READ | vk::AccessFlags2::MEMORY_WRITE)
            .old_layout(vk::ImageLayout::UNDEFINED)
            .new_layout(vk::ImageLayout::GENERAL)
            .image(image)
            .subresource_range(range)];
        let info = vk::DependencyInfo::default().image_memory_barriers(&barrier);
        // SAFETY: a new image of this device.
        unsafe { self.device().cmd_pipeline_barrier2(self.commands, &info) };
    }
}

/// Rows of an image, and the rectangle that clip space is mapped to, all of it: left, top, width, height.
fn whole(image: &Image, rows: Range<u32>) -> ([u32; 4], [f32; 4]) {
    let area = [0, rows.start, image.width, rows.end - rows.start];
    (area, [0.0, 0.0, image.width as f32, image.height as f32])
}

/// Workgroups of `local_size` threads that hold `threads`.
fn groups(threads: [u32; 3], local_size: [u32; 3]) -> [u32; 3] {
    [0, 1, 2].map(|axis| threads[axis].div_ceil(local_size[axis]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_fill_whole_groups() {
        assert_eq!(groups([1, 65, 0], [64, 8, 1]), [1, 9, 0]);
        assert_eq!(groups([u32::MAX, 64, 1], [64, 64, 1]), [1 << 26, 1, 1]);
    }
}
