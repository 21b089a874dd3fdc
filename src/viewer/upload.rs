//! Writes the reference's light maps into a renderer's image.

use super::host::{Host, failed};
use super::reference::LightMap;
use super::swapchain::color_range;
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;
use nephroid::Result;
use nephroid::render::{MapImage, ReceiverTile};

const TEXEL_BYTES: u64 = size_of::<[f32; 4]>() as u64;

/// A buffer for each frame in flight that writes light maps. The host destroys them with [`Uploads::destroy`].
#[derive(Default)]
pub struct Uploads(Vec<Option<(vk::Buffer, Allocation)>>);

impl Uploads {
    /// Records that `image` holds these light maps and is black elsewhere. All earlier work on the image is waited for, and all
    /// later work has to wait. The slot's last frame has ended.
    ///
    /// # Errors
    /// [`nephroid::Error::Device`] where there is not enough memory.
    pub fn record(
        &mut self,
        host: &Host,
        commands: vk::CommandBuffer,
        slot: usize,
        image: MapImage,
        receivers: &[ReceiverTile],
        maps: &[LightMap],
    ) -> Result<()> {
        let device = &host.device;
        self.0.resize_with(self.0.len().max(slot + 1), || None);
        if let Some(buffer) = self.0[slot].take() {
            host.free_buffer(buffer);
        }
        let transfer = vk::PipelineStageFlags2::ALL_TRANSFER;
        let write = vk::AccessFlags2::TRANSFER_WRITE;
        let wait = |stages, accesses| {
            let barrier = [vk::MemoryBarrier2::default()
                .src_stage_mask(stages)
                .src_access_mask(accesses)
                .dst_stage_mask(transfer)
                .dst_access_mask(write)];
            let dependency = vk::DependencyInfo::default().memory_barriers(&barrier);
            // SAFETY: a recording command buffer.
            unsafe { device.cmd_pipeline_barrier2(commands, &dependency) };
        };
        wait(
            vk::PipelineStageFlags2::ALL_COMMANDS,
            vk::AccessFlags2::MEMORY_WRITE,
        );
        let black = vk::ClearColorValue { float32: [0.0; 4] };
        let (layout, ranges) = (image.layout, [color_range()]);
        // SAFETY: a recording command buffer; the image is in this layout.
        unsafe { device.cmd_clear_color_image(commands, image.image, layout, &black, &ranges) };
        let texels: u64 = maps.iter().map(|map| map.texels.len() as u64).sum();
        if texels == 0 {
            return Ok(());
        }
        wait(transfer, write);
        let usage = vk::BufferUsageFlags::TRANSFER_SRC;
        let bytes = texels * TEXEL_BYTES;
        let (buffer, mut memory) =
            host.buffer("reference", bytes, usage, MemoryLocation::CpuToGpu)?;
        let mut rest = memory
            .mapped_slice_mut()
            .ok_or(vk::Result::ERROR_MEMORY_MAP_FAILED);
        let mut regions = Vec::new();
        let mut offset = 0;
        for map in maps {
            let tile = receivers.iter().find(|tile| tile.object == map.receiver);
            let Some(tile) = tile.map(|tile| tile.light) else {
                continue;
            };
            let bytes: &[u8] = bytemuck::cast_slice(&map.texels);
            match &mut rest {
                Ok(rest) => rest[offset..offset + bytes.len()].copy_from_slice(bytes),
                Err(error) => return Err(failed("writing the reference")(*error)),
            }
            regions.push(
                vk::BufferImageCopy::default()
                    .buffer_offset(offset as u64)
                    .image_subresource(
                        vk::ImageSubresourceLayers::default()
                            .aspect_mask(vk::ImageAspectFlags::COLOR)
                            .layer_count(1),
                    )
                    .image_offset(vk::Offset3D {
                        x: tile.origin[0] as i32,
                        y: tile.origin[1] as i32,
                        z: 0,
                    })
                    .image_extent(vk::Extent3D {
                        width: tile.size[0],
                        height: tile.size[1],
                        depth: 1,
                    }),
            );
            offset += bytes.len();
        }
        // SAFETY: a recording command buffer; the buffer lives until the frame has ended.
        unsafe {
            device.cmd_copy_buffer_to_image(commands, buffer, image.image, layout, &regions);
        }
        self.0[slot] = Some((buffer, memory));
        Ok(())
    }

    /// The device must be idle.
    pub fn destroy(&mut self, host: &Host) {
        let buffers = self.0.iter_mut().filter_map(Option::take);
        buffers.for_each(|buffer| host.free_buffer(buffer));
    }
}
