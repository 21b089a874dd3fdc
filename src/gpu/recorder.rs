//! One command buffer: passes in named scopes, explicit barriers, submit and wait.

use super::command::{Command, LONGEST_LABEL};
use super::pace::{Allowance, Pace};
use super::reuse::{CommandList, ReusableParts};
use super::timestamps::Timestamps;
use super::{Buffer, Context, device_error};
use crate::error::{Error, Result};
use ash::vk;
use std::collections::VecDeque;
use std::ops::ControlFlow;
use std::sync::Arc;
use std::time::Instant;

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
    /// Name of the work, such as `shade`.
    pub work: &'static str,
    /// Share of the work that is done, 0 to 1.
    pub done: f64,
}

/// Called after every submission; [`ControlFlow::Break`] stops the work with [`Error::Cancelled`].
pub type Watcher = Box<dyn FnMut(Progress) -> ControlFlow<()> + Send>;

/// A command buffer that is being recorded: one of ours, with the fence that [`Recorder::submit`] waits for, or a
/// host's, which the host submits.
///
/// After a failed submission ours begins again, without what was recorded.
pub struct Recorder {
    pub(super) context: Arc<Context>,
    /// Null for a host's command buffers.
    pool: vk::CommandPool,
    pub(super) commands: vk::CommandBuffer,
    /// Whether `commands` can be recorded to: not after a `begin` that failed, nor before
    /// [`Recorder::begin_host`].
    pub(super) recording: bool,
    fence: vk::Fence,
    timestamps: Timestamps,
    /// Passes recorded since the last submission.
    open: Vec<&'static str>,
    /// Number of a host's frames that may be in flight while their passes are timed; 0 while they are not.
    pub(super) timed_frames: usize,
    /// Timestamps and passes of the last frames of a host.
    in_flight: VecDeque<(Timestamps, Vec<&'static str>)>,
    /// Passes since [`Recorder::begin_frame`].
    times: Vec<PassTime>,
    submissions: Submissions,
    pace: Pace,
    progress: Progress,
    watcher: Option<Watcher>,
    /// What cannot be run among what was recorded, for [`Recorder::submit`] to return.
    pub(super) refused: Option<Error>,
    pub(super) parts: ReusableParts,
    /// The reusable part that is being recorded.
    pub(super) open_part: Option<CommandList>,
    wait_each_pass: bool,
    /// Memory of the last [`Recorder::read`], which the next one uses again if it suffices.
    pub(super) readback: Option<Buffer>,
}

impl Recorder {
    /// Records into a host's command buffer until [`Recorder::end_host`].
    ///
    /// # Safety
    /// It is recording, outside of rendering, and of the context's device and queue family.
    pub unsafe fn begin_host(&mut self, commands: vk::CommandBuffer) {
        assert!(!self.is_ours(), "a recorder made for a host");
        (self.commands, self.recording) = (commands, true);
        self.parts.begin_frame();
    }

    /// # Errors
    /// What cannot be run among what was recorded: the host must not submit it.
    pub fn end_host(&mut self) -> Result<()> {
        self.recording = false;
        if self.timed_frames > 0 {
            let timestamps =
                std::mem::replace(&mut self.timestamps, Timestamps::new(&self.context));
            let passes = std::mem::take(&mut self.open);
            self.in_flight.push_back((timestamps, passes));
        }
        self.refused.take().map_or(Ok(()), Err)
    }

    /// The host does not submit the last frame, whose times are left out.
    pub fn forget_last(&mut self) {
        self.parts.forget_last();
        if self.timed_frames > 0 {
            self.in_flight.pop_back();
        }
    }

    /// Times the passes of a host's frames from the next one on, of which `frames` may be in flight; 0 ends it.
    pub fn time_frames(&mut self, frames: u32) {
        self.timed_frames = frames as usize;
    }

    /// Reads the times of the host's frame before those in flight, which has ended. Called before every frame.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn read_host_times(&mut self) -> Result<()> {
        self.times.clear();
        if self.timed_frames == 0 || self.in_flight.len() < self.timed_frames {
            return Ok(());
        }
        if let Some((mut timestamps, passes)) = self.in_flight.pop_front() {
            let durations = timestamps.read()?;
            self.times.extend(times_of(passes, &durations));
            self.timestamps = timestamps;
        }
        Ok(())
    }

    /// Number of [`Recorder::reusable`] parts of the last frame of a host that executed the commands of the frame before.
    pub fn reused_parts(&self) -> u32 {
        self.parts.reused
    }

    pub fn is_ours(&self) -> bool {
        self.pool != vk::CommandPool::null()
    }

    /// Without a command buffer: a host lends its own, one after the other. At most `frames` of them are in flight.
    pub fn for_host(context: &Arc<Context>, frames: u32) -> Self {
        Self {
            context: context.clone(),
            pool: vk::CommandPool::null(),
            commands: vk::CommandBuffer::null(),
            recording: false,
            fence: vk::Fence::null(),
            timestamps: Timestamps::new(context),
            open: Vec::new(),
            timed_frames: 0,
            in_flight: VecDeque::new(),
            times: Vec::new(),
            submissions: Submissions::default(),
            pace: Pace::default(),
            progress: Progress {
                work: "",
                done: 0.0,
            },
            watcher: None,
            refused: None,
            parts: ReusableParts::new(context, frames),
            open_part: None,
            wait_each_pass: false,
            readback: None,
        }
    }

    /// Begins an empty command buffer.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails, [`Error::Host`] where it is a host's.
    pub fn new(context: &Arc<Context>) -> Result<Self> {
        if context.is_of_host() {
            return Err(of_host());
        }
        let failed = || device_error("making a command buffer");
        let mut recorder = Self::for_host(context, 1);
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

    /// Whether every pass is submitted separately.
    pub fn waits_each_pass(&self) -> bool {
        self.wait_each_pass
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

    /// Submits what was recorded, waits for it, and begins again.
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
        self.times.extend(times_of(names, &durations));
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
        if !self.is_ours() && self.timed_frames == 0 {
            self.labelled(name, record);
            return Ok(());
        }
        let start = Instant::now();
        if !self.recording && self.is_ours() {
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
        self.labelled(name, record);
        if let Some(scope) = scope {
            self.timestamps.end(self.commands, scope);
        }
        if self.wait_each_pass && self.is_ours() {
            self.submit()?;
            if let Some(pass) = self.times.last_mut() {
                pass.wall = Some(start.elapsed().as_secs_f64());
            }
        }
        Ok(())
    }

    /// Calls `record` between the ends of a debug label.
    fn labelled(&mut self, name: &'static str, record: impl FnOnce(&mut Self)) {
        assert!(name.len() <= LONGEST_LABEL, "{name} is too long");
        let has_labels = self.context.debug.is_some();
        if has_labels {
            self.add(Command::BeginLabel(name), &[]);
        }
        record(self);
        if has_labels {
            self.add(Command::EndLabel, &[]);
        }
    }

    /// Times of the passes since [`Recorder::begin_frame`], in order.
    pub fn take_times(&mut self) -> Vec<PassTime> {
        std::mem::take(&mut self.times)
    }

    /// Submissions since [`Recorder::begin_frame`].
    pub fn submissions(&self) -> Submissions {
        self.submissions
    }
}

/// Passes with their durations on the device, where it has measured them.
fn times_of(names: Vec<&'static str>, durations: &[f64]) -> impl Iterator<Item = PassTime> {
    (names.into_iter().enumerate()).map(|(index, name)| PassTime {
        name,
        gpu: durations.get(index).copied(),
        wall: None,
    })
}

fn of_host() -> Error {
    Error::Host {
        reason: "on the device of a host nothing is submitted or waited for".into(),
        remedy: "record into a command buffer of the host".into(),
    }
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
