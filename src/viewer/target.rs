//! An image that a pass of the window draws to.

use super::cover::whole;
use super::host::{Host, failed};
use super::swapchain::color_range;
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;
use nephroid::Result;
use nephroid::render::MapImage;

/// The host destroys it with [`Target::destroy`].
pub struct Target {
    /// Its layout is that between two frames.
    pub image: MapImage,
    /// What reads it.
    reader: (vk::PipelineStageFlags2, vk::AccessFlags2),
    memory: Option<Allocation>,
}

impl Target {
    /// An image of `size` pixels that fragment shaders sample, or that is copied (`is_copied`).
    ///
    /// # Errors
    /// [`nephroid::Error::Device`] where there is not enough memory.
    pub fn new(
        host: &Host,
        name: &str,
        format: vk::Format,
        size: [u32; 2],
        is_copied: bool,
    ) -> Result<Self> {
        let (usage, layout, reader) = match is_copied {
            true => (
                vk::ImageUsageFlags::TRANSFER_SRC,
                vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
                (
                    vk::PipelineStageFlags2::ALL_TRANSFER,
                    vk::AccessFlags2::TRANSFER_READ,
                ),
            ),
            false => (
                vk::ImageUsageFlags::SAMPLED,
                vk::ImageLayout::SHADER_READ_ONLY_OPTIMAL,
                (
                    vk::PipelineStageFlags2::FRAGMENT_SHADER,
                    vk::AccessFlags2::SHADER_SAMPLED_READ,
                ),
            ),
        };
        let device = &host.device;
        // SAFETY: create-infos that are valid for their calls; destroyed by the host.
        unsafe {
            let info = vk::ImageCreateInfo::default()
                .image_type(vk::ImageType::TYPE_2D)
                .format(format)
                .extent(extent(size))
                .mip_levels(1)
                .array_layers(1)
                .samples(vk::SampleCountFlags::TYPE_1)
                .usage(vk::ImageUsageFlags::COLOR_ATTACHMENT | usage);
            let image = device
                .create_image(&info, None)
                .map_err(failed("making an image"))?;
            let requirements = device.get_image_memory_requirements(image);
            let memory = host.allocate(name, requirements, MemoryLocation::GpuOnly)?;
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
            Ok(Self {
                image: MapImage {
                    image,
                    view,
                    layout,
                    size,
                },
                reader,
                memory: Some(memory),
            })
        }
    }

    /// Records draws to all of it, as [`draw_to`].
    pub fn draw(&self, host: &Host, commands: vk::CommandBuffer, draws: impl FnOnce()) {
        let load = vk::AttachmentLoadOp::DONT_CARE;
        draw_to(host, commands, &self.image, self.reader, load, draws);
    }

    /// The device must not use it any more.
    pub fn destroy(&mut self, host: &Host) {
        // SAFETY: the caller's promise.
        unsafe {
            host.device.destroy_image_view(self.image.view, None);
            host.device.destroy_image(self.image.image, None);
        }
        if let Some(memory) = self.memory.take() {
            host.free(memory);
        }
    }
}

/// Records draws to all of an image, outside of rendering, once its reader of before has ended. The image is in its layout
/// afterwards, and visible to the reader, which is given by its stages and accesses.
pub fn draw_to<T>(
    host: &Host,
    commands: vk::CommandBuffer,
    image: &MapImage,
    reader: (vk::PipelineStageFlags2, vk::AccessFlags2),
    load: vk::AttachmentLoadOp,
    draws: impl FnOnce() -> T,
) -> T {
    let device = &host.device;
    let target = vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL;
    let writer = (
        vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
        vk::AccessFlags2::COLOR_ATTACHMENT_WRITE | vk::AccessFlags2::COLOR_ATTACHMENT_READ,
    );
    let barrier = |from, to, [old, new]: [vk::ImageLayout; 2]| {
        let (src_stage, src_access) = from;
        let (dst_stage, dst_access) = to;
        let barrier = [vk::ImageMemoryBarrier2::default()
            .src_stage_mask(src_stage)
            .src_access_mask(src_access)
            .dst_stage_mask(dst_stage)
            .dst_access_mask(dst_access)
            .old_layout(old)
            .new_layout(new)
            .image(image.image)
            .subresource_range(color_range())];
        let dependency = vk::DependencyInfo::default().image_memory_barriers(&barrier);
        // SAFETY: a recording command buffer, outside of rendering.
        unsafe { device.cmd_pipeline_barrier2(commands, &dependency) };
    };
    let before = (reader.0, vk::AccessFlags2::NONE);
    barrier(before, writer, [vk::ImageLayout::UNDEFINED, target]);
    let attachments = [vk::RenderingAttachmentInfo::default()
        .image_view(image.view)
        .image_layout(target)
        .load_op(load)
        .store_op(vk::AttachmentStoreOp::STORE)];
    let info = vk::RenderingInfo::default()
        .render_area(whole(image.size))
        .layer_count(1)
        .color_attachments(&attachments);
    // SAFETY: the image is in the layout of attachments.
    unsafe { device.cmd_begin_rendering(commands, &info) };
    let drawn = draws();
    // SAFETY: rendering was begun above.
    unsafe { device.cmd_end_rendering(commands) };
    barrier(writer, reader, [target, image.layout]);
    drawn
}

pub fn extent([width, height]: [u32; 2]) -> vk::Extent3D {
    vk::Extent3D {
        width,
        height,
        depth: 1,
    }
}
