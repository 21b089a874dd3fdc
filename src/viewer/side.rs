//! A side of the picture: a renderer, the technique that it was made for, and what it rendered last.

use super::dynamic_resolution::halvings;
use super::host::Host;
use super::reference::LightMap;
use super::technique::{Aim, Technique};
use super::upload::Uploads;
use ash::vk;
use nephroid::gpu::{Context, PassTime};
use nephroid::render::{
    Frame, FrameBudget, FrameCounts, MapImage, Overlay, ReceiverTile, Renderer, Settings,
};
use nephroid::scene::Scene;
use nephroid::{Error, Result};
use std::sync::Arc;
use std::time::Duration;

/// Largest number of sides: A, and B where two are compared.
pub const MAX_SIDES: usize = 2;

pub struct Side {
    renderer: Renderer,
    pub made_for: Technique,
    /// The images of the last frame that was recorded.
    pub maps: Option<Maps>,
    /// Light maps in place of the renderer's, with their number.
    reference: Option<(u64, Arc<Vec<LightMap>>)>,
    /// The number of those in the renderer's image.
    uploaded: Option<u64>,
    /// A time to keep, ms.
    budget: Option<(f32, FrameBudget)>,
}

#[derive(Debug, Clone)]
pub struct Maps {
    pub picture: MapImage,
    pub light_map: MapImage,
    pub receivers: Vec<ReceiverTile>,
}

impl Side {
    /// Makes a renderer, for frames of which `frames` are in flight.
    ///
    /// # Errors
    /// As [`Renderer::new`].
    pub fn new(
        context: &Arc<Context>,
        scene: &Scene,
        technique: &Technique,
        frames: usize,
    ) -> Result<Self> {
        // Beside a reference, a frame is recorded twice.
        let records = if technique.is_reference { 2 } else { 1 };
        let settings = Settings {
            frames_in_flight: records * frames as u32,
            ..technique.settings()
        };
        Ok(Self {
            renderer: Renderer::new(context, scene, &settings)?,
            made_for: *technique,
            maps: None,
            reference: None,
            uploaded: None,
            budget: None,
        })
    }

    /// The renderer's notes on light that it leaves out, one sentence each.
    pub fn notes(&self) -> Vec<String> {
        self.renderer.notes()
    }

    /// Shows these light maps in place of the renderer's. Other maps have another number.
    pub fn set_reference(&mut self, number: u64, maps: &Arc<Vec<LightMap>>) {
        self.reference = Some((number, maps.clone()));
    }

    /// Takes over a scene that differs from the last one only in what a frame can change; whether it does.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn update(&mut self, scene: &Scene) -> Result<bool> {
        match self.renderer.update(scene) {
            Ok(()) => Ok(true),
            Err(error @ Error::Device { .. }) => Err(error),
            // Other light maps, for instance, need another renderer.
            Err(_) => Ok(false),
        }
    }

    /// Has the next frame aim for what `technique` says, with this factor on the error.
    pub fn aim(&mut self, technique: &Technique, factor: f32) {
        let Some(mut error) = technique.error() else {
            self.budget = None;
            return;
        };
        match technique.aim {
            Aim::Budget(ms) => {
                if self.budget.as_ref().is_none_or(|(of, _)| *of != ms) {
                    self.budget = Some((ms, technique.budget(ms)));
                }
                if let Some((_, budget)) = &self.budget {
                    error = budget.error();
                }
            }
            _ => self.budget = None,
        }
        self.renderer.set_error((error * factor).clamp(1e-4, 1.0));
    }

    /// Has direct light from the next update on as coarse as pictures of this scale.
    pub fn fit(&mut self, scale: f32) {
        self.renderer.set_direct_halvings(halvings(scale));
    }

    /// Adjusts the error to the time of the last frame, if a time is to be kept.
    pub fn add_time(&mut self, time: Duration) {
        if let Some((_, budget)) = &mut self.budget {
            let asked = budget.error();
            budget.add(time, asked);
        }
    }

    /// Times passes and counts frames from now on, or no longer.
    pub fn profile(&mut self, on: bool) {
        self.renderer.time_passes(on);
        self.renderer.count_frames(on);
    }

    /// Draws these overlays over the next pictures.
    pub fn set_overlays(&mut self, overlays: &[Overlay]) {
        self.renderer.set_overlays(overlays);
    }

    /// Counts of the last frame that has ended.
    pub fn take_counts(&mut self) -> Option<FrameCounts> {
        self.renderer.take_counts()
    }

    /// Times of the passes of the last frame that has ended.
    pub fn take_times(&mut self) -> Vec<PassTime> {
        self.renderer.take_times()
    }

    /// Records a frame; the stages and accesses that its images wait for.
    ///
    /// # Errors
    /// As [`Renderer::record`].
    ///
    /// # Safety
    /// As [`Renderer::record`].
    unsafe fn record(
        &mut self,
        host: &Host,
        commands: vk::CommandBuffer,
        frame: &Frame,
        (uploads, slot): (&mut Uploads, usize),
    ) -> Result<(vk::PipelineStageFlags2, vk::AccessFlags2)> {
        if let Some((number, maps)) = &self.reference {
            // First the scene, then the light maps, which stay as they are while the scene does, and last the picture.
            let scene_only = Frame {
                view: None,
                ..*frame
            };
            // SAFETY: the caller's promise; the renderer was made for twice as many frames.
            let output = unsafe { self.renderer.record(commands, &scene_only) }?;
            if self.uploaded != Some(*number) {
                let (image, receivers) = (output.light_map, output.receivers);
                uploads.record(host, commands, slot, image, receivers, maps)?;
                self.uploaded = Some(*number);
            }
        }
        // SAFETY: the caller's promise.
        let output = unsafe { self.renderer.record(commands, frame) }?;
        let mut receivers = self
            .maps
            .take()
            .map(|maps| maps.receivers)
            .unwrap_or_default();
        receivers.clear();
        receivers.extend_from_slice(output.receivers);
        self.maps = output.view.map(|picture| Maps {
            picture,
            light_map: output.light_map,
            receivers,
        });
        Ok((output.last_stage, output.last_access))
    }
}

/// Records the pictures of all sides in a slot whose last frame has ended, and makes them readable.
///
/// # Errors
/// As [`Renderer::record`].
///
/// # Safety
/// As [`Renderer::record`].
pub unsafe fn record(
    sides: &mut [Side],
    host: &Host,
    commands: vk::CommandBuffer,
    frame: &Frame,
    uploads: &mut Uploads,
    slot: usize,
) -> Result<()> {
    let mut barrier = vk::MemoryBarrier2::default()
        .dst_stage_mask(
            vk::PipelineStageFlags2::FRAGMENT_SHADER
                | vk::PipelineStageFlags2::COMPUTE_SHADER
                | vk::PipelineStageFlags2::ALL_TRANSFER,
        )
        .dst_access_mask(vk::AccessFlags2::SHADER_READ | vk::AccessFlags2::TRANSFER_READ);
    for (index, side) in sides.iter_mut().enumerate() {
        let upload = (&mut *uploads, MAX_SIDES * slot + index);
        // SAFETY: the caller's promise.
        let (stage, access) = unsafe { side.record(host, commands, frame, upload) }?;
        barrier.src_stage_mask |= stage;
        barrier.src_access_mask |= access;
    }
    let barriers = [barrier];
    let dependency = vk::DependencyInfo::default().memory_barriers(&barriers);
    // SAFETY: a recording command buffer.
    unsafe { host.device.cmd_pipeline_barrier2(commands, &dependency) };
    Ok(())
}
