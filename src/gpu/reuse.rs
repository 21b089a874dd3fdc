//! Parts of a host's frames that mostly have the commands of the frame before. A part that two frames in a row have is recorded once
//! more, and executed in the frames that follow: recording and submitting a frame of `ring` on lavapipe then takes 0.4 ms in place of 1 (docs/measurements.md).

use super::command::Command;
use super::retired::Retired;
use super::{Context, device_error};
use crate::error::Result;
use ash::vk;
use std::sync::Arc;

/// Commands with their push constants, one after the other.
#[derive(Default, PartialEq)]
pub struct CommandList {
    commands: Vec<Command>,
    push: Vec<u8>,
}

impl CommandList {
    pub fn add(&mut self, command: Command, push: &[u8]) {
        self.commands.push(command);
        self.push.extend_from_slice(push);
    }

    fn clear(&mut self) {
        self.commands.clear();
        self.push.clear();
    }

    /// # Safety
    /// As [`Command::record`].
    unsafe fn record(&self, context: &Context, commands: vk::CommandBuffer) {
        let mut push = self.push.as_slice();
        for command in &self.commands {
            let own = match *command {
                Command::Use(_, bytes) => push.split_off(..bytes).expect("as many as were added"),
                _ => &[],
            };
            // SAFETY: as the caller's.
            unsafe { command.record(context, commands, own) };
        }
    }
}

/// A part of the last frame that had it.
struct Known {
    name: &'static str,
    part: CommandList,
    /// Memory for the next one.
    spare: CommandList,
    /// Where it is recorded, once two frames in a row had it.
    recorded: Option<vk::CommandBuffer>,
}

pub struct ReusableParts {
    context: Arc<Context>,
    /// Null until it is needed.
    pool: vk::CommandPool,
    known: Vec<Known>,
    /// Command buffers of earlier parts.
    retired: Retired<vk::CommandBuffer>,
    /// Number of parts of the last frame that were executed, not recorded.
    pub reused: u32,
}

impl ReusableParts {
    /// For at most `frames` frames in flight.
    pub fn new(context: &Arc<Context>, frames: u32) -> Self {
        Self {
            context: context.clone(),
            pool: vk::CommandPool::null(),
            known: Vec::new(),
            retired: Retired::new(frames),
            reused: 0,
        }
    }

    /// Frees what no frame in flight has any more.
    pub fn begin_frame(&mut self) {
        self.reused = 0;
        for commands in self.retired.begin_frame() {
            // SAFETY: of this pool, and not in use.
            unsafe { (self.context.device).free_command_buffers(self.pool, &[commands]) };
        }
    }

    /// The last frame is not submitted.
    pub fn forget_last(&mut self) {
        self.retired.forget_last();
    }

    /// An empty part, with the number of those of its name.
    pub fn begin(&mut self, name: &'static str) -> (usize, CommandList) {
        let mut known = self.known.iter();
        let number = known.position(|known| known.name == name);
        let number = number.unwrap_or_else(|| {
            self.known.push(Known {
                name,
                part: CommandList::default(),
                spare: CommandList::default(),
                recorded: None,
            });
            self.known.len() - 1
        });
        let mut part = std::mem::take(&mut self.known[number].spare);
        part.clear();
        (number, part)
    }

    /// Records a part with its number into a frame.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    ///
    /// # Safety
    /// `frame` is a recording command buffer of the context's device, outside of rendering, and all objects of the part live.
    pub unsafe fn finish(
        &mut self,
        (number, part): (usize, CommandList),
        frame: vk::CommandBuffer,
    ) -> Result<()> {
        let known = &mut self.known[number];
        let is_same = known.part == part;
        known.spare = std::mem::replace(&mut known.part, part);
        if !is_same {
            if let Some(commands) = known.recorded.take() {
                self.retired.keep(commands);
            }
            // SAFETY: as the caller's.
            unsafe { known.part.record(&self.context, frame) };
            return Ok(());
        }
        if known.recorded.is_none() {
            // SAFETY: as the caller's.
            let commands = unsafe { recorded(&self.context, &mut self.pool, &known.part) };
            known.recorded = Some(commands?);
        }
        self.reused += 1;
        let commands = known.recorded.as_slice();
        // SAFETY: as the caller's; frames in flight share them, by SIMULTANEOUS_USE.
        unsafe { self.context.device.cmd_execute_commands(frame, commands) };
        Ok(())
    }
}

/// A secondary command buffer of a part.
///
/// # Safety
/// All objects of the part live.
unsafe fn recorded(
    context: &Context,
    pool: &mut vk::CommandPool,
    part: &CommandList,
) -> Result<vk::CommandBuffer> {
    let failed = || device_error("recording commands for several frames");
    let device = &context.device;
    if *pool == vk::CommandPool::null() {
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(context.queue_family);
        // SAFETY: a valid device; destroyed in Drop.
        *pool = unsafe { device.create_command_pool(&info, None) }.map_err(failed())?;
    }
    let info = vk::CommandBufferAllocateInfo::default()
        .command_pool(*pool)
        .level(vk::CommandBufferLevel::SECONDARY)
        .command_buffer_count(1);
    let inherited = vk::CommandBufferInheritanceInfo::default();
    let begin = vk::CommandBufferBeginInfo::default()
        .flags(vk::CommandBufferUsageFlags::SIMULTANEOUS_USE)
        .inheritance_info(&inherited);
    // SAFETY: a new command buffer; the objects are the caller's.
    unsafe {
        let commands = device.allocate_command_buffers(&info).map_err(failed())?[0];
        let begun = device.begin_command_buffer(commands, &begin);
        let ended = begun.and_then(|()| {
            part.record(context, commands);
            device.end_command_buffer(commands)
        });
        match ended {
            Ok(()) => Ok(commands),
            Err(error) => {
                device.free_command_buffers(*pool, &[commands]);
                Err(failed()(error))
            }
        }
    }
}

impl Drop for ReusableParts {
    fn drop(&mut self) {
        // SAFETY: as for the other objects of a renderer, no frame in flight uses it; null is allowed.
        unsafe { self.context.device.destroy_command_pool(self.pool, None) };
    }
}
