//! Draws the window: the renderer's picture and the panels over it, with two frames in flight.

use super::capture::{Capture, Captured};
use super::compare::{Difference, Shown};
use super::differences::Differences;
use super::host::{Host, HostOptions, failed};
#[cfg(feature = "dev")]
use super::loss::Loss;
use super::present::Present;
use super::side::{MAX_SIDES, Side, record};
use super::slot::{Slot, slots};
use super::swapchain::{Presented, Swapchain};
use super::target::draw_to;
use super::technique::Technique;
use super::upload::Uploads;
use ash::vk;
use egui::{ClippedPrimitive, TexturesDelta};
use egui_ash_renderer::allocator::GpuAllocator;
use egui_ash_renderer::{DynamicRendering, Options, RenderMode, Renderer as PanelRenderer};
use nephroid::gpu::{Context, DeviceInfo};
use nephroid::render::{Frame, MapImage};
use nephroid::scene::Scene;
use nephroid::{Error, Result};
use std::collections::BTreeMap;
use std::sync::Arc;
use std::time::{Duration, Instant};
use winit::window::Window;

/// Frames that the device may have to do at a time.
pub const FRAMES_IN_FLIGHT: usize = 2;

/// The panels as egui draws them.
pub struct Panels {
    pub primitives: Vec<ClippedPrimitive>,
    pub textures: TexturesDelta,
    pub pixels_per_point: f32,
}

/// A frame of the window.
pub struct Draw<'a> {
    pub window: &'a Window,
    /// What to render; `None` shows the last picture again.
    pub picture: Option<Frame<'a>>,
    pub exposure_ev: f64,
    pub shown: Shown,
    /// Whether to add up the differences of the sides, relative to B or not.
    pub measures: Option<bool>,
    pub panels: Panels,
    /// Whether to read the picture back, which waits for it.
    pub captures: bool,
}

/// Outcome of a frame.
#[derive(Default)]
pub struct Drawn {
    /// Whether it was submitted: not where the window has no image for it.
    pub is_drawn: bool,
    /// Time of the host, without waiting for the device or the window.
    pub host: Duration,
    pub captured: Option<Captured>,
    /// Those of the last frame that was measured and has ended, if they are new.
    pub differences: Option<Vec<Difference>>,
}

pub struct Display {
    // The renderers, then the context, then the host.
    /// A, and B while both are compared.
    pub sides: Vec<Side>,
    pub(super) context: Arc<Context>,
    panels: PanelRenderer<GpuAllocator>,
    pub(super) swapchain: Swapchain,
    pub(super) present: Present,
    capture: Option<Capture>,
    pool: vk::CommandPool,
    slots: Vec<Slot>,
    next_slot: usize,
    /// While two sides are compared.
    pub(super) differences: Option<Differences>,
    uploads: Uploads,
    /// What the next frame is to lose, for tests.
    #[cfg(feature = "dev")]
    pub loses: Option<Loss>,
    /// Whether the images no longer fit the window.
    is_stale: bool,
    pub(super) host: Host,
}

impl Display {
    /// Opens the device for a window.
    ///
    /// # Errors
    /// As [`Host::new`].
    pub fn new(window: &Window, options: &HostOptions) -> Result<Self> {
        let (host, surface) = Host::new(window, options)?;
        let context = host.context()?;
        let swapchain = Swapchain::new(&host, surface)?;
        let format = swapchain.format.format;
        let encodes = !swapchain.encodes_srgb();
        let present = Present::new(&host, format, encodes, FRAMES_IN_FLIGHT)?;
        let panels = PanelRenderer::with_gpu_allocator(
            host.allocator().clone(),
            host.device.clone(),
            RenderMode::DynamicRendering(DynamicRendering {
                color_attachment_format: format,
                depth_attachment_format: None,
                stencil_attachment_format: None,
            }),
            Options {
                in_flight_frames: FRAMES_IN_FLIGHT,
                srgb_framebuffer: !encodes,
                ..Options::default()
            },
        )
        .map_err(panels_failed)?;
        let (pool, slots) = slots(&host, FRAMES_IN_FLIGHT)?;
        Ok(Self {
            sides: Vec::with_capacity(MAX_SIDES),
            context,
            panels,
            swapchain,
            present,
            capture: None,
            pool,
            slots,
            next_slot: 0,
            differences: None,
            uploads: Uploads::default(),
            #[cfg(feature = "dev")]
            loses: None,
            is_stale: true,
            host,
        })
    }

    pub fn device(&self) -> &DeviceInfo {
        &self.host.info
    }

    /// Whether the device is a CPU, on which pictures take long.
    pub fn is_cpu(&self) -> bool {
        self.device().kind == "cpu"
    }

    /// Makes a side's renderer, for another scene or another technique. Where that fails, the last one stays.
    ///
    /// # Errors
    /// As [`Side::new`].
    pub fn set_side(&mut self, index: usize, scene: &Scene, technique: &Technique) -> Result<()> {
        let side = Side::new(&self.context, scene, technique, FRAMES_IN_FLIGHT)?;
        if index > 0 && self.differences.is_none() {
            self.differences = Some(Differences::new(&self.host, FRAMES_IN_FLIGHT)?);
        }
        // The old one may be in use by frames in flight.
        self.host.wait_idle();
        match self.sides.get_mut(index) {
            Some(old) => *old = side,
            None => self.sides.push(side),
        }
        Ok(())
    }

    /// Keeps side A only.
    pub fn end_comparison(&mut self) {
        self.host.wait_idle();
        self.sides.truncate(1);
        self.uploads.destroy(&self.host);
        if let Some(mut differences) = self.differences.take() {
            differences.destroy(&self.host);
        }
    }

    /// Whether differences were recorded that no frame has told yet.
    pub fn has_pending_differences(&self) -> bool {
        (self.differences.as_ref()).is_some_and(Differences::are_pending)
    }

    /// The pictures that the sides rendered last; none if a side has none.
    fn pictures(&self) -> Vec<MapImage> {
        let pictures = self.sides.iter().map(|side| side.maps.as_ref());
        let pictures: Option<Vec<_>> = pictures.map(|maps| Some(maps?.picture)).collect();
        pictures.unwrap_or_default()
    }

    /// The window has another size.
    pub fn invalidate(&mut self) {
        self.is_stale = true;
    }

    /// Pixels of the window, once it was drawn.
    pub fn size(&self) -> [u32; 2] {
        self.swapchain.size
    }

    /// Device memory by the names of its allocations, bytes, and all that is reserved.
    pub fn memory(&self) -> (BTreeMap<String, u64>, u64) {
        self.host.memory()
    }

    /// Makes the images of the window again if they no longer fit. Returns whether there are any.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails, [`Error::Window`] where the surface was lost for good.
    pub fn prepare(&mut self, window: &Window) -> Result<bool> {
        // A window that changes all the time is tried again in the next frame.
        for _ in 0..3 {
            if !self.is_stale {
                return Ok(true);
            }
            self.host.wait_idle();
            let size = window.inner_size();
            match self.swapchain.resize(&self.host, size.into())? {
                Presented::Done(()) => self.is_stale = false,
                Presented::OutOfDate => {}
                Presented::NotReady => return Ok(false),
                Presented::SurfaceLost => self.swapchain.replace_surface(&self.host, window)?,
            }
        }
        Ok(!self.is_stale)
    }

    /// Draws a frame after [`Display::prepare`]; waits until at most two are in flight.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails or is lost.
    pub fn draw(&mut self, draw: Draw) -> Result<Drawn> {
        let mut start = Instant::now();
        let mut host = Duration::ZERO;
        self.load_textures(&draw.panels.textures)?;
        host += start.elapsed();

        let index = self.next_slot;
        let (commands, fence, acquired) = {
            let slot = &self.slots[index];
            (slot.commands, slot.fence, slot.acquired)
        };
        let device = self.host.device.clone();
        // SAFETY: handles of this device.
        unsafe { device.wait_for_fences(&[fence], true, u64::MAX) }
            .map_err(failed("waiting for a frame"))?;
        for texture in std::mem::take(&mut self.slots[index].unused) {
            self.panels.free_texture(texture).map_err(panels_failed)?;
        }
        self.slots[index].unused.extend(&draw.panels.textures.free);
        let mut drawn = Drawn {
            differences: self.read_differences(index),
            ..Drawn::default()
        };
        let image = match self.swapchain.acquire(acquired)? {
            Presented::Done(image) => image,
            Presented::NotReady => return Ok(drawn),
            Presented::OutOfDate => {
                self.is_stale = true;
                return Ok(drawn);
            }
            Presented::SurfaceLost => {
                self.lose_surface(draw.window)?;
                return Ok(drawn);
            }
        };

        start = Instant::now();
        let once = vk::CommandBufferBeginInfo::default()
            .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
        // SAFETY: the slot's last frame has ended.
        unsafe {
            device
                .reset_fences(&[fence])
                .map_err(failed("resetting a fence"))?;
            (device.begin_command_buffer(commands, &once))
                .map_err(failed("beginning a command buffer"))?;
        }
        if let Some(frame) = &draw.picture {
            // SAFETY: the command buffer is recording, is submitted below in the order of recording, and at most
            // FRAMES_IN_FLIGHT frames are in flight.
            unsafe {
                let (sides, uploads) = (&mut self.sides, &mut self.uploads);
                record(sides, &self.host, commands, frame, uploads, index)?;
            }
        }
        let pictures = self.pictures();
        let shown = match pictures.len() {
            MAX_SIDES => draw.shown,
            _ => Shown::One,
        };
        if let (Some(first), Some(last)) = (pictures.first(), pictures.last()) {
            (self.present).bind(&self.host, index, [*first, *last], shown)?;
        }
        if let (Some(is_relative), Some(differences)) = (draw.measures, &mut self.differences)
            && let [Some(a), Some(b)] = [0, 1].map(|side| self.sides.get(side)?.maps.as_ref())
        {
            differences.record(&self.host, commands, index, [a, b], is_relative)?;
        }
        let captures = draw.captures && !pictures.is_empty();
        if captures {
            self.record_capture(commands, index, &pictures, draw.exposure_ev, shown)?;
        }
        let shown = (!pictures.is_empty()).then_some(shown);
        self.record_window(commands, index, image, &draw, shown)?;
        // SAFETY: the command buffer is complete, and its resources live until its fence is signalled.
        unsafe {
            device
                .end_command_buffer(commands)
                .map_err(failed("ending a command buffer"))?;
            let waits = [vk::SemaphoreSubmitInfo::default()
                .semaphore(acquired)
                .stage_mask(vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT)];
            let signals = [vk::SemaphoreSubmitInfo::default()
                .semaphore(self.swapchain.finished(image))
                .stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)];
            let buffers = [vk::CommandBufferSubmitInfo::default().command_buffer(commands)];
            let submit = [vk::SubmitInfo2::default()
                .wait_semaphore_infos(&waits)
                .command_buffer_infos(&buffers)
                .signal_semaphore_infos(&signals)];
            let submitted = device.queue_submit2(self.host.queue, &submit, fence);
            #[cfg(feature = "dev")]
            let submitted = match self.loses {
                Some(Loss::Device) => Err(vk::Result::ERROR_DEVICE_LOST),
                _ => submitted,
            };
            submitted.map_err(failed("submitting a frame"))?;
        }
        host += start.elapsed();
        self.next_slot = (index + 1) % FRAMES_IN_FLIGHT;
        let presented = self.swapchain.present(&self.host, image)?;
        #[cfg(feature = "dev")]
        let presented = match self.loses.take() {
            Some(_) => Presented::SurfaceLost,
            None => presented,
        };
        match presented {
            Presented::Done(()) => {}
            Presented::OutOfDate | Presented::NotReady => self.is_stale = true,
            Presented::SurfaceLost => self.lose_surface(draw.window)?,
        }
        if let (true, Some(capture)) = (captures, &self.capture) {
            // SAFETY: a fence of this device.
            unsafe { device.wait_for_fences(&[fence], true, u64::MAX) }
                .map_err(failed("waiting for a screenshot"))?;
            drawn.captured = Some(capture.read()?);
            // All frames have ended, this one last.
            for slot in [self.next_slot, index] {
                drawn.differences = self.read_differences(slot).or(drawn.differences);
            }
        }
        drawn.is_drawn = true;
        drawn.host = host;
        Ok(drawn)
    }

    /// Waits for all frames.
    pub fn finish(&self) {
        self.host.wait_idle();
    }

    fn lose_surface(&mut self, window: &Window) -> Result<()> {
        self.host.wait_idle();
        self.is_stale = true;
        self.swapchain.replace_surface(&self.host, window)
    }

    /// Loads what panels need from now on.
    fn load_textures(&mut self, textures: &TexturesDelta) -> Result<()> {
        if !textures.set.is_empty() {
            // A texture that is replaced may be in use. This happens when new letters are shown.
            self.host.wait_idle();
        }
        for (id, deltas) in &textures.set {
            for delta in deltas {
                (self
                    .panels
                    .set_texture(self.host.queue, self.pool, *id, delta))
                .map_err(panels_failed)?;
            }
        }
        Ok(())
    }

    /// The differences of a slot whose frame has ended.
    fn read_differences(&mut self, slot: usize) -> Option<Vec<Difference>> {
        self.differences.as_mut()?.read(slot)
    }

    fn record_capture(
        &mut self,
        commands: vk::CommandBuffer,
        slot: usize,
        pictures: &[MapImage],
        exposure_ev: f64,
        shown: Shown,
    ) -> Result<()> {
        let host = &self.host;
        if let Some(capture) = &mut self.capture
            && !capture.fits(pictures)
        {
            host.wait_idle();
            capture.destroy(host);
            self.capture = None;
        }
        if self.capture.is_none() {
            let format = self.swapchain.format.format;
            let made = Capture::new(host, format, pictures[0].size, pictures.len())?;
            self.capture = Some(made);
        }
        if let Some(capture) = &self.capture {
            let present = &self.present;
            capture.record(host, commands, present, slot, pictures, exposure_ev, shown);
        }
        Ok(())
    }

    /// Draws picture and panels to an image of the window.
    fn record_window(
        &mut self,
        commands: vk::CommandBuffer,
        slot: usize,
        image: u32,
        draw: &Draw,
        shown: Option<Shown>,
    ) -> Result<()> {
        let (handle, view) = self.swapchain.images[image as usize];
        let size = self.swapchain.size;
        let (host, exposure) = (&self.host, draw.exposure_ev);
        if let Some(shown) = shown {
            (self.present).prepare(host, commands, slot, size, exposure, shown)?;
        }
        let target = MapImage {
            image: handle,
            view,
            layout: vk::ImageLayout::PRESENT_SRC_KHR,
            size,
        };
        // The window waits for the semaphore, not for a stage.
        let reader = (
            vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT,
            vk::AccessFlags2::NONE,
        );
        let load = vk::AttachmentLoadOp::CLEAR;
        draw_to(host, commands, &target, reader, load, || {
            if let Some(shown) = shown {
                (self.present).record(host, commands, slot, size, exposure, shown);
            }
            let panels = &draw.panels;
            let extent = vk::Extent2D {
                width: size[0],
                height: size[1],
            };
            let (scale, primitives) = (panels.pixels_per_point, &panels.primitives);
            (self.panels.cmd_draw(commands, extent, scale, primitives)).map_err(panels_failed)
        })
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        self.host.wait_idle();
        if let Some(mut capture) = self.capture.take() {
            capture.destroy(&self.host);
        }
        if let Some(differences) = &mut self.differences {
            differences.destroy(&self.host);
        }
        self.uploads.destroy(&self.host);
        self.present.destroy(&self.host);
        self.swapchain.destroy(&self.host);
        let device = &self.host.device;
        // SAFETY: the device is idle. The other fields free themselves, the host last.
        unsafe {
            for slot in &self.slots {
                device.destroy_fence(slot.fence, None);
                device.destroy_semaphore(slot.acquired, None);
            }
            device.destroy_command_pool(self.pool, None);
        }
    }
}

fn panels_failed(error: egui_ash_renderer::RendererError) -> Error {
    Error::Device {
        action: "drawing the panels".into(),
        reason: error.to_string(),
        remedy: "update the driver, or choose another device".into(),
    }
}
