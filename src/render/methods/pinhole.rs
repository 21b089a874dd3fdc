//! pinhole: the paper's gather over all patches at every texel.

use crate::error::Result;
use crate::gpu::{BoundPipeline, Buffer, Context, Image, Recorder, Resource, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::dispatch::GroupRect;
use crate::render::gpu_types::PinholePush;
use crate::render::gpu_types::constants::MAX_TAPS;
use crate::render::settings::Settings;
use crate::render::splat::kernel_profiles::SPREAD;
use std::sync::Arc;

/// Maximum number of patches per dispatch. A texel sums over the batches.
const BATCH: u32 = 1024;
/// Maximum number of loop iterations of an invocation, all loops together. lavapipe silently ends a loop after 65535
/// iterations (Mesa, `LP_MAX_TGSI_LOOP_ITERATIONS`), version 22.3.6 after about 15000.
const MAX_ITERATIONS: u32 = 8192;
/// Iterations allowed for a pair's rays in the hierarchy. Most pairs trace none.
const TRAVERSAL: u32 = 64;

pub struct Pinhole {
    pipeline: BoundPipeline,
    epsilon: f32,
    spread: f32,
}

impl Pinhole {
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        patches: &Buffer,
        light_map: &Image,
        settings: &Settings,
    ) -> Result<Self> {
        let own = [
            ("patches", Resource::Buffer(patches)),
            ("light_map", Resource::Image(light_map)),
        ];
        let pipeline = scene.compute(context, &shaders::PINHOLE_COMP, &own)?;
        Ok(Self {
            pipeline,
            epsilon: settings.epsilon,
            spread: if settings.filter { SPREAD } else { 0.0 },
        })
    }

    /// Patches per dispatch.
    pub fn batch(scene: &DeviceScene) -> u32 {
        let taps = if scene.environment.casts_caustics {
            MAX_TAPS as u32
        } else {
            0
        };
        let traversal = if scene.geometry.can_occlude {
            TRAVERSAL
        } else {
            0
        };
        let iterations = 1 + scene.casters.lobes * (scene.lights.scene_count + taps + traversal);
        (MAX_ITERATIONS / iterations).clamp(1, BATCH)
    }

    /// Rays per texel in a dispatch, an estimate for the first submission: every pair of texel and patch looks up the
    /// light, and few pairs trace rays to the light and to the receiver.
    pub fn rays(scene: &DeviceScene) -> u64 {
        (scene.casters.lobes * Self::batch(scene)).into()
    }

    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        (first_patch, batch_patches): (u32, u32),
        (tile, rect): (usize, GroupRect),
    ) {
        let (receiver, is_mesh) = scene.receivers.of_tile(tile);
        let push = PinholePush {
            first: rect.first,
            receiver,
            first_patch,
            batch_patches,
            light_count: scene.lights.scene_count,
            epsilon: self.epsilon,
            spread: self.spread,
            rotation: scene.environment.rotation,
            has_environment: u32::from(scene.environment.casts_caustics),
            can_occlude: u32::from(scene.geometry.can_occlude),
            is_mesh: u32::from(is_mesh),
        };
        recorder.dispatch(&self.pipeline, &push, rect.threads());
    }
}
