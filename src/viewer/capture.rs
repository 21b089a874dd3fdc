//! Reads pictures back: what the window shows, without its panels, and the linear radiance of each side.

use super::compare::Shown;
use super::host::{Host, failed};
use super::present::{Present, whole};
use super::swapchain::color_range;
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;
use nephroid::image_file::RgbImage;
use nephroid::render::MapImage;
use nephroid::{Error, Result};

/// A picture as shown, and as linear radiance.
pub struct Captured {
    pub size: [u32; 2],
    /// sRGB, three bytes a pixel.
    pub rgb: Vec<u8>,
    /// Of each side, W/m²/sr.
    pub radiance: Vec<RgbImage>,
}

/// An image that the picture is drawn to, and memory of the host for it and the radiance.
pub struct Capture {
    size: [u32; 2],
    format: vk::Format,
    image: vk::Image,
    view: vk::ImageView,
    image_memory: Option<Allocation>,
    /// Buffers of the picture as shown, and of the radiance of each side.
    buffers: Vec<(vk::Buffer, Allocation)>,
}

impl Capture {
    /// For pictures of `size` pixels and so many sides.
    ///
    /// # Errors
    /// [`Error::Device`] where there is not enough memory.
    pub fn new(host: &Host, format: vk::Format, size: [u32; 2], sides: usize) -> Result<Self> {
        let device = &host.device;
        let extent = extent(size);
        // SAFETY: create-infos that are valid for their calls; destroyed by the host.
        unsafe {
            let info = vk::ImageCreateInfo::default()
                .image_type(vk::ImageType::TYPE_2D)
                .format(format)
                .extent(extent)
                .mip_levels(1)
                .array_layers(1)
                .samples(vk::SampleCountFlags::TYPE_1)
                .usage(vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC);
            let image = device
                .create_image(&info, None)
                .map_err(failed("making an image"))?;
            let requirements = device.get_image_memory_requirements(image);
            let memory = host.allocate("screenshot", requirements, MemoryLocation::GpuOnly)?;
            (device.bind_image_memory(image, memory.memory(), memory.offset()))
                .map_err(failed("binding an image"))?;
            let info = vk::ImageViewCreateInfo::default()
                .image(image)
                .view_type(vk::ImageViewType::TYPE_2D)
                .format(format)
                .subresource_range(color_range());
            let view = device
                .create_image_view(&info, None)
                .map_err(failed("making an image view"))?;
            let mut capture = Self {
                size,
                format,
                image,
                view,
                image_memory: Some(memory),
                buffers: Vec::new(),
            };
            for bytes in std::iter::once(4u64).chain(std::iter::repeat_n(16, sides)) {
                let bytes = bytes * u64::from(size[0]) * u64::from(size[1]);
                let usage = vk::BufferUsageFlags::TRANSFER_DST;
                let made = host.buffer("screenshot", bytes, usage, MemoryLocation::GpuToCpu)?;
                capture.buffers.push(made);
            }
            Ok(capture)
        }
    }

    /// Whether it is for such pictures.
    pub fn fits(&self, pictures: &[MapImage]) -> bool {
        self.buffers.len() == 1 + pictures.len()
            && pictures.iter().all(|picture| picture.size == self.size)
    }

    /// Draws what `present` has bound, and copies it and the pictures of the sides to the host's memory, outside of rendering. The
    /// pictures are readable.
    #[allow(clippy::too_many_arguments)] // one call
    pub fn record(
        &self,
        host: &Host,
        commands: vk::CommandBuffer,
        present: &Present,
        slot: usize,
        pictures: &[MapImage],
        exposure_ev: f64,
        shown: Shown,
    ) {
        let device = &host.device;
        // SAFETY: the command buffer is recording, and nothing else uses these resources.
        unsafe {
            let image_barrier = |old: vk::ImageLayout, new: vk::ImageLayout| {
                vk::ImageMemoryBarrier2::default()
                    .src_stage_mask(
                        vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT
                            | vk::PipelineStageFlags2::ALL_TRANSFER,
                    )
                    .src_access_mask(vk::AccessFlags2::COLOR_ATTACHMENT_WRITE)
                    .dst_stage_mask(
                        vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT
                            | vk::PipelineStageFlags2::ALL_TRANSFER,
                    )
                    .dst_access_mask(
                        vk::AccessFlags2::COLOR_ATTACHMENT_WRITE | vk::AccessFlags2::TRANSFER_READ,
                    )
                    .old_layout(old)
                    .new_layout(new)
                    .image(self.image)
                    .subresource_range(color_range())
            };
            let before = [image_barrier(
                vk::ImageLayout::UNDEFINED,
                vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
            )];
            device.cmd_pipeline_barrier2(
                commands,
                &vk::DependencyInfo::default().image_memory_barriers(&before),
            );
            let attachments = [vk::RenderingAttachmentInfo::default()
                .image_view(self.view)
                .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
                .load_op(vk::AttachmentLoadOp::DONT_CARE)
                .store_op(vk::AttachmentStoreOp::STORE)];
            let info = vk::RenderingInfo::default()
                .render_area(whole(self.size))
                .layer_count(1)
                .color_attachments(&attachments);
            device.cmd_begin_rendering(commands, &info);
            present.record(host, commands, slot, self.size, exposure_ev, shown);
            device.cmd_end_rendering(commands);
            let source = vk::ImageLayout::TRANSFER_SRC_OPTIMAL;
            let after = [image_barrier(
                vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL,
                source,
            )];
            device.cmd_pipeline_barrier2(
                commands,
                &vk::DependencyInfo::default().image_memory_barriers(&after),
            );
            let sides = pictures.iter().map(|side| (side.image, side.layout));
            let images = std::iter::once((self.image, source)).chain(sides);
            for ((buffer, _), (image, layout)) in self.buffers.iter().zip(images) {
                let region = [vk::BufferImageCopy::default()
                    .image_subresource(
                        vk::ImageSubresourceLayers::default()
                            .aspect_mask(vk::ImageAspectFlags::COLOR)
                            .layer_count(1),
                    )
                    .image_extent(extent(self.size))];
                device.cmd_copy_image_to_buffer(commands, image, layout, *buffer, &region);
            }
            let to_host = [vk::MemoryBarrier2::default()
                .src_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
                .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
                .dst_stage_mask(vk::PipelineStageFlags2::HOST)
                .dst_access_mask(vk::AccessFlags2::HOST_READ)];
            device.cmd_pipeline_barrier2(
                commands,
                &vk::DependencyInfo::default().memory_barriers(&to_host),
            );
        }
    }

    /// What was copied, once the frame has ended.
    ///
    /// # Errors
    /// [`Error::Device`] where memory of the host cannot be read.
    pub fn read(&self) -> Result<Captured> {
        let [width, height] = self.size;
        let pixels = width as usize * height as usize;
        let bytes = |index: usize, size: usize| {
            let memory = self.buffers[index].1.mapped_slice();
            memory
                .map(|memory| &memory[..size * pixels])
                .ok_or_else(|| Error::Device {
                    action: "reading a screenshot".into(),
                    reason: "its memory is not mapped".into(),
                    remedy: "choose another device".into(),
                })
        };
        let is_bgr = matches!(
            self.format,
            vk::Format::B8G8R8A8_UNORM | vk::Format::B8G8R8A8_SRGB
        );
        let rgb = (bytes(0, 4)?.chunks_exact(4))
            .flat_map(|p| {
                if is_bgr {
                    [p[2], p[1], p[0]]
                } else {
                    [p[0], p[1], p[2]]
                }
            })
            .collect();
        let radiance = (1..self.buffers.len()).map(|side| {
            let radiance: Vec<[f32; 4]> = bytemuck::pod_collect_to_vec(bytes(side, 16)?);
            let pixels = radiance.iter().map(|[r, g, b, _]| [*r, *g, *b]).collect();
            Ok(RgbImage {
                width,
                height,
                pixels,
            })
        });
        Ok(Captured {
            size: self.size,
            rgb,
            radiance: radiance.collect::<Result<_>>()?,
        })
    }

    /// The device must not use it any more.
    pub fn destroy(&mut self, host: &Host) {
        // SAFETY: the caller's promise.
        unsafe {
            host.device.destroy_image_view(self.view, None);
            host.device.destroy_image(self.image, None);
        }
        if let Some(memory) = self.image_memory.take() {
            host.free(memory);
        }
        self.buffers
            .drain(..)
            .for_each(|buffer| host.free_buffer(buffer));
    }
}

fn extent([width, height]: [u32; 2]) -> vk::Extent3D {
    vk::Extent3D {
        width,
        height,
        depth: 1,
    }
}
