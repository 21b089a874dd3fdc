//! What command buffers consist of, but for copies and changes of layout, as values that can be compared before they are recorded.

use super::memory::Buffer;
use super::{Access, Context, Image};
use ash::vk;
use std::ffi::CStr;

/// Bytes of the longest label.
pub const LONGEST_LABEL: usize = 63;

/// A handle with the number of its object. A driver may give the handle of an object that is gone to a new one; a number is given once.
#[derive(Clone, Copy, PartialEq)]
pub struct Numbered<T> {
    pub handle: T,
    pub number: u64,
}

impl Numbered<vk::Buffer> {
    pub fn of(buffer: &Buffer) -> Self {
        Self {
            handle: buffer.handle,
            number: buffer.owned.number,
        }
    }
}

/// A pipeline with its descriptor set, whose number tells [`BoundPipeline`](super::BoundPipeline)s apart, also those without a set.
#[derive(Clone, Copy, PartialEq)]
pub struct PipelineUse {
    pub pipeline: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    pub stages: vk::ShaderStageFlags,
    pub bind_point: vk::PipelineBindPoint,
    /// Of the descriptor set, which is null where the shaders have no bindings.
    pub set: Numbered<vk::DescriptorSet>,
}

/// An attachment in layout GENERAL that is kept.
#[derive(Clone, Copy, PartialEq)]
pub struct Attachment {
    view: Numbered<vk::ImageView>,
    /// Bits of the four components, or of the depth, before the first draw; `None`: as they are.
    cleared: Option<[u32; 4]>,
}

impl Attachment {
    pub fn of(image: &Image) -> Self {
        Self {
            view: Numbered {
                handle: image.view,
                number: image.owned.number,
            },
            cleared: None,
        }
    }

    pub fn cleared(self, bits: [u32; 4]) -> Self {
        Self {
            cleared: Some(bits),
            ..self
        }
    }

    fn info(&self) -> vk::RenderingAttachmentInfo<'static> {
        let info = vk::RenderingAttachmentInfo::default()
            .image_view(self.view.handle)
            .image_layout(vk::ImageLayout::GENERAL)
            .store_op(vk::AttachmentStoreOp::STORE);
        match self.cleared {
            None => info.load_op(vk::AttachmentLoadOp::LOAD),
            Some(uint32) => {
                (info.load_op(vk::AttachmentLoadOp::CLEAR)).clear_value(vk::ClearValue {
                    color: vk::ClearColorValue { uint32 },
                })
            }
        }
    }
}

#[derive(Clone, Copy, PartialEq)]
pub enum Command {
    /// Makes what the first wrote visible to the second, and orders them.
    Barrier(Access, Access),
    /// With so many bytes of push constants.
    Use(PipelineUse, usize),
    /// Workgroups.
    Dispatch([u32; 3]),
    /// A `VkDispatchIndirectCommand` at a byte of the buffer.
    DispatchIndirect(Numbered<vk::Buffer>, u64),
    BeginRendering {
        color: Attachment,
        depth: Option<Attachment>,
        /// Left, top, width, height.
        area: [u32; 4],
        /// The same of the rectangle that clip space is mapped to.
        viewport: [f32; 4],
    },
    EndRendering,
    /// Vertices.
    Draw(u32),
    /// With a `VkDrawIndexedIndirectCommand` at a byte of `arguments`, and indices of u32.
    DrawIndexedIndirect {
        indices: Numbered<vk::Buffer>,
        arguments: Numbered<vk::Buffer>,
        offset: u64,
    },
    /// Fills with zeros.
    Zero(Numbered<vk::Buffer>),
    /// For the layers and debuggers, of at most [`LONGEST_LABEL`] bytes.
    BeginLabel(&'static str),
    EndLabel,
}

impl Command {
    /// `push`: the push constants of [`Command::Use`].
    ///
    /// # Safety
    /// `commands` is a recording command buffer of the context's device, outside of rendering but for what is drawn, and all objects
    /// live.
    pub unsafe fn record(&self, context: &Context, commands: vk::CommandBuffer, push: &[u8]) {
        let device: &ash::Device = &context.device;
        // SAFETY: as above.
        unsafe {
            match *self {
                Self::Barrier(from, to) => {
                    let barrier = [vk::MemoryBarrier2::default()
                        .src_stage_mask(from.0)
                        .src_access_mask(from.1)
                        .dst_stage_mask(to.0)
                        .dst_access_mask(to.1)];
                    let info = vk::DependencyInfo::default().memory_barriers(&barrier);
                    device.cmd_pipeline_barrier2(commands, &info);
                }
                Self::Use(by, _) => {
                    device.cmd_bind_pipeline(commands, by.bind_point, by.pipeline);
                    let set = by.set.handle;
                    if set != vk::DescriptorSet::null() {
                        let (point, layout) = (by.bind_point, by.layout);
                        device.cmd_bind_descriptor_sets(commands, point, layout, 0, &[set], &[]);
                    }
                    if !push.is_empty() {
                        device.cmd_push_constants(commands, by.layout, by.stages, 0, push);
                    }
                }
                Self::Dispatch([x, y, z]) => device.cmd_dispatch(commands, x, y, z),
                Self::DispatchIndirect(arguments, offset) => {
                    device.cmd_dispatch_indirect(commands, arguments.handle, offset);
                }
                Self::BeginRendering {
                    color,
                    depth,
                    area: [left, top, width, height],
                    viewport,
                } => {
                    let area = vk::Rect2D {
                        offset: vk::Offset2D {
                            x: left as i32,
                            y: top as i32,
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
                    let colors = [color.info()];
                    let depth = depth.map_or_else(Default::default, |depth| depth.info());
                    let info = vk::RenderingInfo::default()
                        .render_area(area)
                        .layer_count(1)
                        .color_attachments(&colors)
                        .depth_attachment(&depth);
                    device.cmd_begin_rendering(commands, &info);
                    device.cmd_set_viewport(commands, 0, &[viewport]);
                    device.cmd_set_scissor(commands, 0, &[area]);
                }
                Self::EndRendering => device.cmd_end_rendering(commands),
                Self::Draw(count) => device.cmd_draw(commands, count, 1, 0, 0),
                Self::DrawIndexedIndirect {
                    indices,
                    arguments,
                    offset,
                } => {
                    let kind = vk::IndexType::UINT32;
                    device.cmd_bind_index_buffer(commands, indices.handle, 0, kind);
                    device.cmd_draw_indexed_indirect(commands, arguments.handle, offset, 1, 0);
                }
                Self::Zero(buffer) => {
                    device.cmd_fill_buffer(commands, buffer.handle, 0, vk::WHOLE_SIZE, 0);
                }
                Self::BeginLabel(name) => {
                    let mut bytes = [0; LONGEST_LABEL + 1];
                    bytes[..name.len()].copy_from_slice(name.as_bytes());
                    let label = CStr::from_bytes_until_nul(&bytes).expect("the last byte is NUL");
                    let info = vk::DebugUtilsLabelEXT::default().label_name(label);
                    let debug = context.debug.iter();
                    debug.for_each(|debug| debug.cmd_begin_debug_utils_label(commands, &info));
                }
                Self::EndLabel => {
                    let debug = context.debug.iter();
                    debug.for_each(|debug| debug.cmd_end_debug_utils_label(commands));
                }
            }
        }
    }
}
