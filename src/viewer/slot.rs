//! Resources of the frames in flight, one slot each.

use super::host::{Host, failed};
use ash::vk;
use egui::TextureId;
use nephroid::Result;

/// Resources of a frame in flight.
pub struct Slot {
    pub commands: vk::CommandBuffer,
    pub fence: vk::Fence,
    pub acquired: vk::Semaphore,
    /// Textures of panels that no later frame shows.
    pub unused: Vec<TextureId>,
}

/// Creates one slot for each frame in flight, and the pool of their command buffers.
///
/// # Errors
/// [`nephroid::Error::Device`] where the device fails.
pub fn slots(host: &Host, frames: usize) -> Result<(vk::CommandPool, Vec<Slot>)> {
    let device = &host.device;
    let pool = vk::CommandPoolCreateInfo::default()
        .queue_family_index(host.queue_family)
        .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER);
    let signalled = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
    // SAFETY: create-infos that are valid for their calls; destroyed by the display.
    unsafe {
        let pool = device
            .create_command_pool(&pool, None)
            .map_err(failed("making a command pool"))?;
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(pool)
            .command_buffer_count(frames as u32);
        let buffers = device
            .allocate_command_buffers(&info)
            .map_err(failed("making command buffers"))?;
        let mut slots = Vec::new();
        for commands in buffers {
            slots.push(Slot {
                commands,
                fence: device
                    .create_fence(&signalled, None)
                    .map_err(failed("making a fence"))?,
                acquired: (device.create_semaphore(&vk::SemaphoreCreateInfo::default(), None))
                    .map_err(failed("making a semaphore"))?,
                unused: Vec::new(),
            });
        }
        Ok((pool, slots))
    }
}
