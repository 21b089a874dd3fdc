//! One command buffer: passes in named scopes, explicit barriers, submit and wait.

use super::device::Device;
use super::memory::{Buffer, Image};
use super::pace::{Allowance, Pace};
use super::timestamps::Timestamps;
use super::{BoundPipeline, Context, device_error};
use crate::error::{Error, Result};
use ash::vk;
use bytemuck::Pod;
use std::ffi::CString;
use std::ops::{ControlFlow, Range};
use std::sync::Arc;
use std::time::Instant;

/// One side of a barrier: which stages touch memory, and how.
#[derive(Debug, Clone, Copy)]
pub struct Access(vk::PipelineStageFlags2, vk::AccessFlags2);

impl Access {
    pub const COMPUTE_READ: Self = Self(
        vk::PipelineStageFlags2::COMPUTE_SHADER,
        vk::AccessFlags2::SHADER_READ,
    );
    pub const COMPUTE_WRITE: Self = Self(
        vk::PipelineStageFlags2::COMPUTE_SHADER,
        vk::AccessFlags2::SHADER_WRITE,
    );
    pub const COMPUTE: Self = Self::COMPUTE_READ.and(Self::COMPUTE_WRITE);
    pub const VERTEX_READ: Self = Self(
        vk::PipelineStageFlags2::VERTEX_SHADER,
        vk::AccessFlags2::SHADER_READ,
    );
    pub const FRAGMENT_READ: Self = Self(
        vk::PipelineStageFlags2::FRAGMENT_SHADER,
        vk::AccessFlags2::SHADER_READ,
    );
    pub const INDEX_READ: Self = Self(
        vk::PipelineStageFlags2::INDEX_INPUT,
        vk::AccessFlags2::INDEX_READ,
    );
    pub const INDIRECT_READ: Self = Self(
        vk::PipelineStageFlags2::DRAW_INDIRECT,
        vk::AccessFlags2::INDIRECT_COMMAND_READ,
    );
    /// Blending reads and writes.
    pub const BLEND: Self = Self(
        vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
        vk::AccessFlags2::from_raw(
            vk::AccessFlags2::COLOR_ATTACHMENT_READ.as_raw()
                | vk::AccessFlags2::COLOR_ATTACHMENT_WRITE.as_raw(),
        ),
    );
    pub const TRANSFER_READ: Self = Self(
        vk::PipelineStageFlags2::ALL_TRANSFER,
        vk::AccessFlags2::TRANSFER_READ,
    );
    pub const TRANSFER_WRITE: Self = Self(
        vk::PipelineStageFlags2::ALL_TRANSFER,
        vk::AccessFlags2::TRANSFER_WRITE,
    );
    pub const HOST_READ: Self = Self(vk::PipelineStageFlags2::HOST, vk::AccessFlags2::HOST_READ);
    /// For uploads and read-backs, where speed does not matter.
    pub const ANY_READ: Self = Self(
        vk::PipelineStageFlags2::ALL_COMMANDS,
        vk::AccessFlags2::MEMORY_READ,
    );
    pub const ANY_WRITE: Self = Self(
        vk::PipelineStageFlags2::ALL_COMMANDS,
        vk::AccessFlags2::MEMORY_WRITE,
    );

    /// For a barrier of a host.
    pub fn masks(self) -> (vk::PipelineStageFlags2, vk::AccessFlags2) {
        (self.0, self.1)
    }

    /// Both.
    pub const fn and(self, other: Self) -> Self {
        Self(
            vk::PipelineStageFlags2::from_raw(self.0.as_raw() | other.0.as_raw()),
            vk::AccessFlags2::from_raw(self.1.as_raw() | other.1.as_raw()),
        )
    }
}

/// What one pass cost.
#[derive(Debug, Clone)]
pub struct PassTime {
    pub name: &'static str,
    /// Between the device's timestamps, s; `None` where the queue has none.
    pub gpu: Option<f64>,
    /// From the start of recording to the end of waiting, s; only where each pass is submitted
    /// on its own.
    pub wall: Option<f64>,
}

/// Submissions of a frame.
#[derive(Debug, Clone, Copy, Default, PartialEq, serde::Serialize)]
pub struct Submissions {
    pub count: u32,
    /// Wall time of the longest one, from submitting to the end of waiting, s.
    pub longest: f64,
}

impl Submissions {
    /// The larger count and the longer time of two frames.
    pub fn max(self, other: Self) -> Self {
        Self {
            count: self.count.max(other.count),
            longest: self.longest.max(other.longest),
        }
    }
}

/// How far a long piece of work has come.
#[derive(Debug, Clone, Copy)]
pub struct Progress {
    /// What is being done, as in `shade`.
    pub work: &'static str,
    /// Of it, 0 to 1.
    pub done: f64,
}

/// Called after every submission; [`ControlFlow::Break`] stops the work with [`Error::Cancelled`].
pub type Watcher = Box<dyn FnMut(Progress) -> ControlFlow<()> + Send>;

/// A command buffer that is being recorded: one of ours, with the fence that [`Recorder::submit`] waits for, or a
/// host's, which the host submits.
///
/// After a failed submission ours begins anew, without what was recorded.
pub struct Recorder {
    context: Arc<Context>,
    /// Null for a host's command buffers.
    pool: vk::CommandPool,
    commands: vk::CommandBuffer,
    /// Whether `commands` can be recorded to: not after a `begin` that failed, nor before
    /// [`Recorder::begin_host`].
    recording: bool,
    fence: vk::Fence,
    timestamps: Timestamps,
    /// Passes recorded since the last submission.
    open: Vec<&'static str>,
    /// Passes since [`Recorder::begin_frame`].
    times: Vec<PassTime>,
    submissions: Submissions,
    pace: Pace,
    progress: Progress,
    watcher: Option<Watcher>,
    /// What cannot be run among what was recorded, for [`Recorder::submit`] to return.
    refused: Option<Error>,
    wait_each_pass: bool,
}

impl Recorder {
    /// For the command buffers of a host, one after the other.
    pub fn for_host(context: &Arc<Context>) -> Self {
        Self::idle(context)
    }

    /// Records into a host's command buffer until [`Recorder::end_host`].
    ///
    /// # Safety
    /// It is recording, outside of rendering, and of the context's device and queue family.
    pub unsafe fn begin_host(&mut self, commands: vk::CommandBuffer) {
        assert!(!self.is_ours(), "a recorder made for a host");
        (self.commands, self.recording) = (commands, true);
    }

    /// # Errors
    /// What cannot be run among what was recorded: the host must not submit it.
    pub fn end_host(&mut self) -> Result<()> {
        self.recording = false;
        self.refused.take().map_or(Ok(()), Err)
    }

    fn is_ours(&self) -> bool {
        self.pool != vk::CommandPool::null()
    }

    fn idle(context: &Arc<Context>) -> Self {
        Self {
            context: context.clone(),
            pool: vk::CommandPool::null(),
            commands: vk::CommandBuffer::null(),
            recording: false,
            fence: vk::Fence::null(),
            timestamps: Timestamps::new(context),
            open: Vec::new(),
            times: Vec::new(),
            submissions: Submissions::default(),
            pace: Pace::default(),
            progress: Progress {
                work: "",
                done: 0.0,
            },
            watcher: None,
            refused: None,
            wait_each_pass: false,
        }
    }

    /// Begins an empty command buffer.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails, [`Error::Host`] where it is a host's.
    pub fn new(context: &Arc<Context>) -> Result<Self> {
        if context.queue.is_none() {
            return Err(of_host());
        }
        let failed = || device_error("making a command buffer");
        let mut recorder = Self::idle(context);
        let device = &context.device;
        let pool = vk::CommandPoolCreateInfo::default().queue_family_index(context.queue_family);
        // SAFETY: a valid device; everything is destroyed in Drop.
        unsafe {
            recorder.pool = device.create_command_pool(&pool, None).map_err(failed())?;
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(recorder.pool)
                .command_buffer_count(1);
            recorder.commands = device.allocate_command_buffers(&info).map_err(failed())?[0];
            recorder.fence = device
                .create_fence(&vk::FenceCreateInfo::default(), None)
                .map_err(failed())?;
        }
        recorder.begin()?;
        Ok(recorder)
    }

    /// Submits and waits after every pass, so that [`PassTime::wall`] is known.
    pub fn wait_each_pass(&mut self, wait: bool) {
        self.wait_each_pass = wait;
    }

    /// Calls `watcher` after every submission from now on.
    pub fn watch(&mut self, watcher: Option<Watcher>) {
        self.watcher = watcher;
    }

    /// Times and submissions are counted from here.
    ///
    /// # Errors
    /// [`Error::Host`] where the device is a host's, who submits.
    pub fn begin_frame(&mut self) -> Result<()> {
        self.times.clear();
        self.submissions = Submissions::default();
        match self.is_ours() {
            true => Ok(()),
            false => Err(of_host()),
        }
    }

    /// Calls `record` with ranges (first, number) of `total` units of work, one after the other, so
    /// that no submission takes long on this device: submits in between where it would. `first` units are
    /// cheap enough on the slowest device, and `record` returns how many it took, `number` at most.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails, [`Error::Cancelled`] where the watcher says so.
    pub fn tiled(
        &mut self,
        work: &'static str,
        total: u64,
        first: u64,
        mut record: impl FnMut(&mut Self, u64, u64) -> Result<u64>,
    ) -> Result<()> {
        let mut done = 0;
        while done < total {
            if !self.is_ours() {
                done += record(self, done, total - done)?;
                continue;
            }
            let allowed = match self.pace.allowance(work, total - done, first) {
                Allowance::Units(units) => units,
                Allowance::Full => {
                    self.submit()?;
                    continue;
                }
            };
            let units = record(self, done, allowed)?;
            self.pace.spend(work, units);
            done += units;
            self.progress = Progress {
                work,
                done: done as f64 / total as f64,
            };
        }
        Ok(())
    }

    fn begin(&mut self) -> Result<()> {
        let info = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        let device = &self.context.device;
        self.recording = false;
        // SAFETY: the buffer is not in use: `submit` waits.
        unsafe {
            device
                .reset_command_pool(self.pool, vk::CommandPoolResetFlags::empty())
                .and_then(|()| device.begin_command_buffer(self.commands, &info))
                .map_err(device_error("beginning a command buffer"))?;
        }
        self.recording = true;
        Ok(())
    }

    /// Submits what was recorded, waits for it, and begins anew.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails or is lost, or something recorded is beyond its
    /// limits; then nothing was run.
    ///
    /// A host's command buffer is left to the host.
    pub fn submit(&mut self) -> Result<()> {
        if !self.is_ours() {
            return Ok(());
        }
        if !self.recording {
            // Beginning failed the last time, so nothing was recorded since.
            return self.begin();
        }
        let names = std::mem::take(&mut self.open);
        let start = Instant::now();
        let result = match self.refused.take() {
            Some(error) => Err(error),
            None => self.run(&names),
        };
        let wall = start.elapsed();
        if result.is_err() {
            self.timestamps.forget();
        }
        let learnt = result.is_ok() && !self.wait_each_pass;
        self.pace.close(learnt.then_some(wall));
        let begun = self.begin();
        let durations = result?;
        begun?;
        self.submissions = self.submissions.max(Submissions {
            count: self.submissions.count + 1,
            longest: wall.as_secs_f64(),
        });
        for (index, name) in names.into_iter().enumerate() {
            self.times.push(PassTime {
                name,
                gpu: durations.get(index).copied(),
                wall: None,
            });
        }
        let progress = self.progress;
        match self.watcher.as_mut().map(|watcher| watcher(progress)) {
            Some(ControlFlow::Break(())) => Err(Error::Cancelled),
            _ => Ok(()),
        }
    }

    /// Runs the command buffer to its end; the durations of its passes, if the queue has
    /// timestamps.
    fn run(&mut self, names: &[&'static str]) -> Result<Vec<f64>> {
        self.recording = false;
        let action = running(names);
        let failed = || device_error(&action);
        let device = &self.context.device;
        let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(self.commands)];
        let submit = [vk::SubmitInfo2::default().command_buffer_infos(&buffers)];
        // SAFETY: recorded commands refer to live objects; the fence is unsignalled; the queue is
        // locked while it is used.
        unsafe {
            device.end_command_buffer(self.commands).map_err(failed())?;
            let queue = self.context.queue.as_ref().expect("a device of ours");
            device
                .queue_submit2(
                    *queue.lock().expect("no panic while held"),
                    &submit,
                    self.fence,
                )
                .map_err(failed())?;
            let waited = device.wait_for_fences(&[self.fence], true, u64::MAX);
            if waited.is_err() {
                // Too little memory to wait for the fence, or the device is lost and its work
                // with it.
                let _queue = queue.lock();
                let _ = device.device_wait_idle();
            }
            waited
                .and(device.reset_fences(&[self.fence]))
                .map_err(failed())?;
        }
        self.timestamps.read()
    }

    /// Records the pass called `name`: its debug label, its timestamps and its row in the profile.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails (mostly only if passes are waited for).
    pub fn pass(&mut self, name: &'static str, record: impl FnOnce(&mut Self)) -> Result<()> {
        if !self.is_ours() {
            record(self);
            return Ok(());
        }
        let start = Instant::now();
        if !self.recording {
            self.begin()?;
        }
        let scope = self
            .timestamps
            .begin(self.commands)
            .unwrap_or_else(|error| {
                self.refused.get_or_insert(error);
                None
            });
        self.open.push(name);
        if let Some(debug) = &self.context.debug {
            let label = CString::new(name).expect("pass names have no NUL");
            let info = vk::DebugUtilsLabelEXT::default().label_name(&label);
            // SAFETY: a recording command buffer of this device.
            unsafe { debug.cmd_begin_debug_utils_label(self.commands, &info) };
        }
        record(self);
        if let Some(debug) = &self.context.debug {
            // SAFETY: as above.
            unsafe { debug.cmd_end_debug_utils_label(self.commands) };
        }
        if let Some(scope) = scope {
            self.timestamps.end(self.commands, scope);
        }
        if self.wait_each_pass {
            self.submit()?;
            if let Some(pass) = self.times.last_mut() {
                pass.wall = Some(start.elapsed().as_secs_f64());
            }
        }
        Ok(())
    }

    /// Times of the passes since [`Recorder::begin_frame`], in order.
    pub fn take_times(&mut self) -> Vec<PassTime> {
        std::mem::take(&mut self.times)
    }

    /// Submissions since [`Recorder::begin_frame`].
    pub fn submissions(&self) -> Submissions {
        self.submissions
    }

    /// The device, to record a command.
    fn device(&self) -> &Device {
        assert!(
            self.recording,
            "after an error from `submit`, record within a `pass`, which can begin anew"
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

    /// Draws into `target` the vertices that `indices` (u32) name, as many as `arguments` (a
    /// `VkDrawIndexedIndirectCommand`) say. `clear`: it is all zero before.
    pub fn draw_indexed_indirect<P: Pod>(
        &mut self,
        pipeline: &BoundPipeline,
        target: &Image,
        clear: bool,
        push: &P,
        indices: &Buffer,
        arguments: &Buffer,
    ) {
        self.begin_rendering(target, clear);
        self.use_pipeline(pipeline, push);
        let (device, commands) = (self.device(), self.commands);
        // SAFETY: pipeline, resources and target are bound; the buffer holds one command.
        unsafe {
            device.cmd_bind_index_buffer(commands, indices.handle, 0, vk::IndexType::UINT32);
            device.cmd_draw_indexed_indirect(commands, arguments.handle, 0, 1, 0);
            device.cmd_end_rendering(commands);
        }
    }

    /// Draws `vertices` vertices into `target`. `clear`: it is all zero before.
    pub fn draw<P: Pod>(
        &mut self,
        pipeline: &BoundPipeline,
        target: &Image,
        clear: bool,
        push: &P,
        vertices: u32,
    ) {
        self.begin_rendering(target, clear);
        self.use_pipeline(pipeline, push);
        // SAFETY: pipeline, resources and target are bound.
        unsafe {
            self.device().cmd_draw(self.commands, vertices, 1, 0, 0);
            self.device().cmd_end_rendering(self.commands);
        }
    }

    /// Fills rows of an image with zeros, as a pass of its own.
    pub fn clear(&mut self, image: &Image, rows: Range<u32>) {
        self.begin_rendering_rows(image, true, rows);
        // SAFETY: rendering was begun.
        unsafe { self.device().cmd_end_rendering(self.commands) };
    }

    fn begin_rendering(&mut self, target: &Image, clear: bool) {
        self.begin_rendering_rows(target, clear, 0..target.height);
    }

    fn begin_rendering_rows(&mut self, target: &Image, clear: bool, rows: Range<u32>) {
        let area = vk::Rect2D {
            offset: vk::Offset2D {
                x: 0,
                y: rows.start as i32,
            },
            extent: vk::Extent2D {
                width: target.width,
                height: rows.end - rows.start,
            },
        };
        let viewport = vk::Viewport {
            x: 0.0,
            y: 0.0,
            width: target.width as f32,
            height: target.height as f32,
            min_depth: 0.0,
            max_depth: 1.0,
        };
        let attachments = [vk::RenderingAttachmentInfo::default()
            .image_view(target.view)
            .image_layout(vk::ImageLayout::GENERAL)
            .load_op(match clear {
                true => vk::AttachmentLoadOp::CLEAR,
                false => vk::AttachmentLoadOp::LOAD,
            })
            .store_op(vk::AttachmentStoreOp::STORE)];
        let info = vk::RenderingInfo::default()
            .render_area(area)
            .layer_count(1)
            .color_attachments(&attachments);
        let device = self.device();
        // SAFETY: a recording command buffer and a target in layout GENERAL.
        unsafe {
            device.cmd_begin_rendering(self.commands, &info);
            device.cmd_set_viewport(self.commands, 0, &[viewport]);
            device.cmd_set_scissor(self.commands, 0, &[area]);
        }
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
            let device = &self.context.device;
            device.cmd_fill_buffer(self.commands, buffer.handle, 0, vk::WHOLE_SIZE, 0);
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

fn of_host() -> Error {
    Error::Host {
        reason: "on the device of a host nothing is submitted or waited for".into(),
        remedy: "record into a command buffer of the host".into(),
    }
}

/// Workgroups of `local_size` threads that hold `threads`.
fn groups(threads: [u32; 3], local_size: [u32; 3]) -> [u32; 3] {
    [0, 1, 2].map(|axis| threads[axis].div_ceil(local_size[axis]))
}

/// What a submission of these passes does, for messages: each name once.
fn running(names: &[&'static str]) -> String {
    let mut unique: Vec<&str> = Vec::new();
    for name in names {
        if !unique.contains(name) {
            unique.push(name);
        }
    }
    match unique.as_slice() {
        [] => "copying to or from the device".into(),
        [only] => format!("the pass {only}"),
        several => format!("one of the passes {}", several.join(", ")),
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        let device = &self.context.device;
        // SAFETY: submissions are waited for; null handles are allowed.
        unsafe {
            device.destroy_fence(self.fence, None);
            device.destroy_command_pool(self.pool, None);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn threads_fill_whole_groups() {
        assert_eq!(groups([1, 65, 0], [64, 8, 1]), [1, 9, 0]);
        assert_eq!(groups([u32::MAX, 64, 1], [64, 64, 1]), [1 << 26, 1, 1]);
    }

    /// A lost device names the passes that were on it.
    #[test]
    fn failures_name_the_passes_in_flight() {
        let lost = |names| device_error(&running(names))(vk::Result::ERROR_DEVICE_LOST).to_string();
        let several = lost(&["clear", "project", "splat", "project", "splat"]);
        let start =
            "one of the passes clear, project, splat failed on the device: the device was lost";
        assert!(several.starts_with(start), "{several}");
        assert!(lost(&["shade"]).starts_with("the pass shade failed"));
        assert!(lost(&[]).starts_with("copying to or from the device failed"));
    }
}
