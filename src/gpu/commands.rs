//! What a recorder records: barriers, dispatches, draws, clears and copies.

use super::device::Device;
use super::memory::Buffer;
use super::texel::Texel;
use super::{Access, BoundPipeline, Image, Recorder};
use crate::error::Error;
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
        &self.context.device
    }

    /// Makes what `from` wrote visible to `to`, and orders them.
    pub fn barrier(&mut self, from: Access, to: Access) {
        let barrier = [vk::MemoryBarrier2::default()
            .src_stage_mask(from.0)
            .src_access_mask(from.1)
            .dst_stage_mask(to.0)
            .dst_access_mask(to.1)];
        let info = vk::DependencyInfo::default().memory_barriers(&barrier);
        // SAFETY: a recording command buffer, outside of rendering.
        unsafe { self.device().cmd_pipeline_barrier2(self.commands, &info) };
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
        self.use_pipeline(pipeline, push);
        // SAFETY: pipeline and resources are bound; the groups are within the limit.
        unsafe {
            self.device()
                .cmd_dispatch(self.commands, groups[0], groups[1], groups[2])
        };
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
        self.use_pipeline(pipeline, push);
        // SAFETY: pipeline and resources are bound; the buffer holds the command.
        unsafe {
            self.device()
                .cmd_dispatch_indirect(self.commands, arguments.handle, offset)
        };
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
        let load = match clear {
            true => vk::AttachmentLoadOp::CLEAR,
            false => vk::AttachmentLoadOp::LOAD,
        };
        let (area, viewport) = whole(target, 0..target.height);
        let draws = [(pipeline, *push, vertices)];
        self.draw_into(
            [attachment(target).load_op(load), Default::default()],
            area,
            viewport,
            &draws,
        );
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
        let [x, y, width, height] = area;
        let area = vk::Rect2D {
            offset: vk::Offset2D {
                x: x as i32,
                y: y as i32,
            },
            extent: vk::Extent2D { width, height },
        };
        let [x, y, width, height] = viewport;
        let viewport = vk::Viewport {
            x,
            y,
            width,
            height,
            min_depth: 0.0,
            max_depth: 1.0,
        };
        let nothing = match color.texel {
            Texel::Number => vk::ClearColorValue {
                uint32: [u32::MAX; 4],
            },
            _ => vk::ClearColorValue::default(),
        };
        let cleared = |image, value| {
            attachment(image)
                .load_op(vk::AttachmentLoadOp::CLEAR)
                .clear_value(value)
        };
        let color = cleared(color, vk::ClearValue { color: nothing });
        let depth = match are_kept {
            true => attachment(depth).load_op(vk::AttachmentLoadOp::LOAD),
            false => cleared(depth, vk::ClearValue::default()),
        };
        self.draw_into([color, depth], area, viewport, draws);
    }

    /// Draws over a color image where the draws are at least as near as what its depth image has: pipeline, push constants
    /// and what to draw.
    pub fn draw_over<P: Pod>(
        &mut self,
        [color, depth]: [&Image; 2],
        draws: &[(&BoundPipeline, P, Vertices)],
    ) {
        let loaded = |image| attachment(image).load_op(vk::AttachmentLoadOp::LOAD);
        let (area, viewport) = whole(color, 0..color.height);
        self.draw_into([loaded(color), loaded(depth)], area, viewport, draws);
    }

    fn draw_into<P: Pod>(
        &mut self,
        [color, depth]: [vk::RenderingAttachmentInfo; 2],
        area: vk::Rect2D,
        viewport: vk::Viewport,
        draws: &[(&BoundPipeline, P, Vertices)],
    ) {
        let colors = [color];
        let info = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(1)
            .color_attachments(&colors)
            .depth_attachment(&depth);
        // SAFETY: a recording command buffer and targets in layout GENERAL.
        unsafe {
            (self.device()).cmd_begin_rendering(self.commands, &info);
            (self.device()).cmd_set_viewport(self.commands, 0, &[viewport]);
            (self.device()).cmd_set_scissor(self.commands, 0, &[area]);
        }
        for (pipeline, push, vertices) in draws {
            self.use_pipeline(pipeline, push);
            self.record_draw(*vertices);
        }
        // SAFETY: rendering was begun.
        unsafe { self.device().cmd_end_rendering(self.commands) };
    }

    /// Pipeline and targets are bound.
    fn record_draw(&mut self, vertices: Vertices) {
        let (device, commands) = (self.device(), self.commands);
        // SAFETY: pipeline, resources and targets are bound; the buffer holds one command.
        unsafe {
            match vertices {
                Vertices::Count(count) => device.cmd_draw(commands, count, 1, 0, 0),
                Vertices::Indexed {
                    indices,
                    arguments,
                    offset,
                } => {
                    device.cmd_bind_index_buffer(
                        commands,
                        indices.handle,
                        0,
                        vk::IndexType::UINT32,
                    );
                    device.cmd_draw_indexed_indirect(commands, arguments.handle, offset, 1, 0);
                }
            }
        }
    }

    /// Fills rows of an image with zeros, as a pass of its own.
    pub fn clear(&mut self, image: &Image, rows: Range<u32>) {
        let (area, viewport) = whole(image, rows);
        let cleared = attachment(image).load_op(vk::AttachmentLoadOp::CLEAR);
        self.draw_into::<u32>([cleared, Default::default()], area, viewport, &[]);
    }

    fn use_pipeline<P: Pod>(&mut self, pipeline: &BoundPipeline, push: &P) {
        let commands = self.commands;
        self.device(); // it is recording
        // SAFETY: a recording command buffer of the same device.
        unsafe { pipeline.record(commands, bytemuck::bytes_of(push)) };
    }

    /// Fills a buffer with zeros.
    pub fn zero(&mut self, buffer: &Buffer) {
        // SAFETY: a live buffer; its size is a multiple of 4.
        unsafe {
            (self.device()).cmd_fill_buffer(self.commands, buffer.handle, 0, vk::WHOLE_SIZE, 0);
        }
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

/// An attachment that is kept.
fn attachment(image: &Image) -> vk::RenderingAttachmentInfo<'static> {
    vk::RenderingAttachmentInfo::default()
        .image_view(image.view)
        .image_layout(vk::ImageLayout::GENERAL)
        .store_op(vk::AttachmentStoreOp::STORE)
}

/// Rows of an image, and the viewport of all of it.
fn whole(image: &Image, rows: Range<u32>) -> (vk::Rect2D, vk::Viewport) {
    let area = vk::Rect2D {
        offset: vk::Offset2D {
            x: 0,
            y: rows.start as i32,
        },
        extent: vk::Extent2D {
            width: image.width,
            height: rows.end - rows.start,
        },
    };
    let viewport = vk::Viewport {
        x: 0.0,
        y: 0.0,
        width: image.width as f32,
        height: image.height as f32,
        min_depth: 0.0,
        max_depth: 1.0,
    };
    (area, viewport)
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
