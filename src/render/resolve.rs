//! resolve: the coarser levels of the light maps are added to the finer ones, one after the other.

use super::layout::ResolvePush;
use super::project::Project;
use super::upload::{DeviceScene, coarsest_level};
use crate::error::Result;
use crate::gpu::{Access, Context, Image, Pipeline, Recorder, Resource, shaders};
use std::sync::Arc;

/// Rows of a light map that are worked on side by side; their threads go on to the others.
const ROWS: u32 = 64;

pub struct Resolve {
    pipeline: Pipeline,
    /// Threads a receiver of each step, from the coarsest level to be added to, to level 0.
    steps: Vec<(i32, [u32; 2])>,
    receiver_count: u32,
}

impl Resolve {
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        project: &Project,
        light_map: &Image,
    ) -> Result<Self> {
        let pipeline = Pipeline::compute(
            context,
            &shaders::RESOLVE_COMP,
            &[
                ("receivers", Resource::Buffer(&scene.receivers)),
                ("coarse", Resource::Buffer(&project.coarse)),
                ("light_map", Resource::Image(light_map)),
            ],
        )?;
        let sizes = || scene.tiles.iter().map(|tile| tile.size);
        let coarsest = sizes().map(coarsest_level).max().unwrap_or(0);
        let threads = |level: u32| {
            let side = |axis: usize| sizes().map(|size| (size[axis] >> level) + 3).max();
            [side(0).unwrap_or(0), side(1).unwrap_or(0).min(ROWS)]
        };
        Ok(Self {
            pipeline,
            steps: (0..coarsest)
                .rev()
                .map(|level| (level as i32, threads(level)))
                .collect(),
            receiver_count: scene.tiles.len() as u32,
        })
    }

    pub fn record(&self, recorder: &mut Recorder) {
        for (level, [width, rows]) in &self.steps {
            let push = ResolvePush { level: *level };
            recorder.dispatch(
                &self.pipeline,
                &push,
                [width.div_ceil(64), *rows, self.receiver_count],
            );
            recorder.barrier(Access::COMPUTE_WRITE, Access::COMPUTE);
        }
    }
}
