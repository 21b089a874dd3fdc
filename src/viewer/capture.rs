//! Reads pictures back: what the window shows, without its panels, and the linear radiance of each side.

use super::compare::Shown;
use super::host::Host;
use super::present::Present;
use super::target::{Target, extent};
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
    format: vk::Format,
    target: Target,
    /// Buffers of the picture as shown, and of the radiance of each side.
    buffers: Vec<(vk::Buffer, Allocation)>,
}

impl Capture {
    /// For pictures of `size` pixels and so many sides.
    ///
    /// # Errors
    /// [`Error::Device`] where there is not enough memory.
    pub fn new(host: &Host, format: vk::Format, size: [u32; 2], sides: usize) -> Result<Self> {
        let mut capture = Self {
            format,
            target: Target::new(host, "screenshot", format, size, true)?,
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

    /// Whether it is for such pictures.
    pub fn fits(&self, pictures: &[MapImage]) -> bool {
        self.buffers.len() == 1 + pictures.len()
            && pictures
                .iter()
                .all(|picture| picture.size == self.target.image.size)
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
        let MapImage {
            image,
            layout,
            size,
            ..
        } = self.target.image;
        (self.target).draw(host, commands, || {
            present.record(host, commands, slot, size, exposure_ev, shown);
        });
        // SAFETY: the command buffer is recording, and nothing else uses these resources.
        unsafe {
            let sides = pictures.iter().map(|side| (side.image, side.layout));
            let images = std::iter::once((image, layout)).chain(sides);
            for ((buffer, _), (image, layout)) in self.buffers.iter().zip(images) {
                let region = [vk::BufferImageCopy::default()
                    .image_subresource(
                        vk::ImageSubresourceLayers::default()
                            .aspect_mask(vk::ImageAspectFlags::COLOR)
                            .layer_count(1),
                    )
                    .image_extent(extent(size))];
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
        let [width, height] = self.target.image.size;
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
            size: [width, height],
            rgb,
            radiance: radiance.collect::<Result<_>>()?,
        })
    }

    /// The device must not use it any more.
    pub fn destroy(&mut self, host: &Host) {
        self.target.destroy(host);
        self.buffers
            .drain(..)
            .for_each(|buffer| host.free_buffer(buffer));
    }
}
