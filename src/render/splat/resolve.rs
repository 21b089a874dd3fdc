//! resolve: adds each coarser level of the light maps to the next finer one.

use crate::error::Result;
use crate::gpu::{BoundPipeline, Buffer, Context, Image, Recorder, Resource, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::{LevelsPush, ResolvePush, constants};
use crate::render::receivers::light_maps::MAX_LEVEL;
use std::sync::Arc;

/// Texels per step of resolve: at most 20 ms on two CPU cores.
const STEP_TEXELS: u32 = 1 << 19;
/// Coarser rows of a thread.
const ROWS: u32 = constants::RESOLVE_ROWS as u32;

/// The levels that contain footprints.
pub struct Levels {
    /// Per planar receiver: bit l is set where its light map has footprints in level l.
    pub coarse: Buffer,
    /// Maximum number of coarser rows in one step of resolve, a multiple of `RESOLVE_ROWS`.
    pub rows: u32,
}

impl Levels {
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn new(context: &Arc<Context>, scene: &DeviceScene) -> Result<Self> {
        let receivers = &scene.receivers;
        let bytes = 4 * u64::from(receivers.planar_count);
        Ok(Self {
            coarse: Buffer::new(context, "coarse levels", bytes)?,
            rows: (STEP_TEXELS / receivers.largest_light_map()[0]).div_ceil(2 * ROWS) * ROWS,
        })
    }
}

pub struct Resolve {
    find_levels: BoundPipeline,
    resolve: BoundPipeline,
    pub levels: Levels,
    /// A `VkDispatchIndirectCommand` per level that is added to.
    steps: Buffer,
}

impl Resolve {
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        levels: Levels,
        light_map: &Image,
    ) -> Result<Self> {
        let steps = Buffer::new(context, "resolve steps", 12 * u64::from(MAX_LEVEL))?;
        let coarse = ("coarse", Resource::Buffer(&levels.coarse));
        let own = [coarse, ("steps", Resource::Buffer(&steps))];
        let find_levels = scene.compute(context, &shaders::LEVELS_COMP, &own)?;
        let own = [coarse, ("light_map", Resource::Image(light_map))];
        let resolve = scene.compute(context, &shaders::RESOLVE_COMP, &own)?;
        Ok(Self {
            find_levels,
            resolve,
            levels,
            steps,
        })
    }

    /// Finds the levels in use and writes the dispatch sizes.
    pub fn record_levels(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        let push = LevelsPush {
            receiver_count: scene.receivers.planar_count,
            rows: self.levels.rows,
        };
        recorder.dispatch(&self.find_levels, &push, [1, 1, 1]);
    }

    /// Adds the coarser rows of one step, from `first_row` on, to `level`. Does nothing where no coarser level has footprints.
    pub fn record(&self, recorder: &mut Recorder, level: u32, first_row: u32) {
        let push = ResolvePush {
            level: level as i32,
            first_row: first_row as i32,
        };
        recorder.dispatch_indirect(&self.resolve, &push, &self.steps, level);
    }
}
