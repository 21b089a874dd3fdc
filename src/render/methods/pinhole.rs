//! pinhole: the paper's gather over all patches at every texel.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Image, Pipeline, Recorder, Resource, shaders};
use crate::render::Settings;
use crate::render::device_scene::DeviceScene;
use crate::render::dispatch::Part;
use crate::render::gpu_types::PinholePush;
use crate::render::splat::kernel_profiles::{SPREAD, profiles};
use std::sync::Arc;

/// Patches that one dispatch gathers at most; a texel's sum is that of its batches.
const BATCH: u32 = 1024;
/// Turns that all loops of an invocation take together. lavapipe leaves every loop without a word
/// after 65535 turns (Mesa, `LP_MAX_TGSI_LOOP_ITERATIONS`), version 22.3.6 after some 15000.
const MOST_TURNS: u32 = 8192;
/// Turns of the loop over an environment's taps at most.
const TAPS: u32 = 16;
/// Turns of a pair's rays through the hierarchy. Most pairs trace none.
const TRAVERSAL: u32 = 64;

pub struct Pinhole {
    pipeline: Pipeline,
    epsilon: f32,
    spread: f32,
    _profiles: Buffer,
}

impl Pinhole {
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        patches: &Buffer,
        light_map: &Image,
        settings: &Settings,
    ) -> Result<Self> {
        let profiles = Buffer::with_data(context, "profiles", &profiles())?;
        let own = [
            ("patches", Resource::Buffer(patches)),
            ("profiles", Resource::Buffer(&profiles)),
            ("light_map", Resource::Image(light_map)),
        ];
        let pipeline = scene.compute(context, &shaders::PINHOLE_COMP, &own)?;
        Ok(Self {
            pipeline,
            epsilon: settings.epsilon,
            spread: if settings.filter { SPREAD } else { 0.0 },
            _profiles: profiles,
        })
    }

    /// Patches that a dispatch gathers.
    pub fn batch(scene: &DeviceScene) -> u32 {
        let taps = if scene.has_environment { TAPS } else { 0 };
        let traversal = if scene.trace { TRAVERSAL } else { 0 };
        let turns = 1 + scene.lobes * (scene.sun_count + taps + traversal);
        (MOST_TURNS / turns).clamp(1, BATCH)
    }

    /// Rays of a texel in a dispatch. One in many pairs of texel and patch traces its rays, to the light and
    /// to the receiver; each looks the light up.
    pub fn rays(scene: &DeviceScene) -> u64 {
        (scene.lobes * Self::batch(scene)).into()
    }

    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        (first_patch, batch_patches): (u32, u32),
        (tile, part): (usize, Part),
    ) {
        let (receiver, is_curved) = scene.receiver_of(tile);
        let push = PinholePush {
            first: part.first,
            receiver,
            first_patch,
            batch_patches,
            sun_count: scene.sun_count,
            epsilon: self.epsilon,
            spread: self.spread,
            rotation: scene.rotation,
            has_environment: u32::from(scene.has_environment),
            trace: u32::from(scene.trace),
            is_curved: u32::from(is_curved),
        };
        recorder.dispatch(&self.pipeline, &push, part.threads());
    }
}
