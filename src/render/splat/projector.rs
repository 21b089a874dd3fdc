//! A projector: patches and lights in, splats out. Projectors differ only in data; kinds.rs has it.

use crate::error::Result;
use crate::gpu::{BoundPipeline, Buffer, Context, Image, Recorder, Resource, Shader, Topology};
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::ProjectPush;
use crate::render::lights::Source;
use crate::render::splat::kernel_profiles::FLAT_SPREAD;
use crate::render::splat::list::{Batch, SplatList};
use crate::render::splat::resolve::Levels;
use std::sync::Arc;

/// The data that defines a kind of projector.
pub struct Description<'a> {
    pub shader: &'static Shader,
    /// Name of the shader's splat buffer.
    pub splats: &'static str,
    pub splat_bytes: usize,
    /// Maximum number of splats of a pair of patch and light.
    pub slots: u32,
    /// The shaders that draw a splat.
    pub draw: [&'static Shader; 2],
    /// Variance of a kernel over the variance of its patch.
    pub spread: f32,
    /// Coarser levels, to which wide splats on planar receivers go. Without them the projector lights mesh receivers.
    pub levels: Option<&'a Levels>,
    pub passes: Passes,
}

/// Names of a projector's passes, and of its work as a whole.
#[derive(Debug, Clone, Copy)]
pub struct Passes {
    pub work: &'static str,
    pub project: &'static str,
    pub compact: &'static str,
    pub splat: &'static str,
}

/// The names of a projector's passes, from the name of its splats.
macro_rules! passes {
    ($splats:literal) => {
        $crate::render::splat::projector::Passes {
            work: $splats,
            project: concat!("project ", $splats),
            compact: concat!("compact ", $splats),
            splat: concat!("splat ", $splats),
        }
    };
}
pub(super) use passes;

pub struct Projector {
    project: BoundPipeline,
    pub list: SplatList,
    draw: BoundPipeline,
    /// Name of the splats in the shaders that draw them, and the first of these.
    pub splats: &'static str,
    pub vertex: &'static Shader,
    /// The lights that the projector uses.
    pub source: Source,
    pub passes: Passes,
    receiver_count: u32,
    spread: f32,
}

impl Projector {
    /// A projector for the lights of `source`: with `patches`, or for an environment with its patch clusters.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        source: Source,
        patches: &Buffer,
        description: &Description,
    ) -> Result<Self> {
        let Description {
            shader,
            slots,
            splat_bytes,
            levels,
            ..
        } = *description;
        let capacity = scene.pair_capacity(source);
        let list = SplatList::new(context, scene, capacity, splat_bytes, slots)?;
        let mut resources = vec![
            ("counts", Resource::Buffer(&list.counts)),
            ("group_counts", Resource::Buffer(&list.group_counts)),
            (description.splats, Resource::Buffer(&list.splats)),
        ];
        match &scene.environment.pairs {
            Some(of) if source == Source::Environment => resources.extend([
                ("patches", Resource::Buffer(&of.patches)),
                ("lights", Resource::Buffer(&of.lights)),
                ("pairs", Resource::Buffer(&of.pairs)),
                ("starts", Resource::Buffer(&of.starts)),
            ]),
            _ => resources.extend([
                ("patches", Resource::Buffer(patches)),
                ("lights", Resource::Buffer(&scene.lights.parts)),
            ]),
        }
        resources.extend(levels.map(|levels| ("coarse", Resource::Buffer(&levels.coarse))));
        let project = scene.compute(context, shader, &resources)?;
        Ok(Self {
            project,
            draw: scene.graphics(context, description.draw, Topology::Triangles, &resources)?,
            list,
            splats: description.splats,
            vertex: description.draw[0],
            source,
            passes: description.passes,
            receiver_count: match levels {
                Some(_) => scene.receivers.planar_count,
                None => scene.receivers.mesh_count(),
            },
            spread: description.spread,
        })
    }

    /// Calls `record` for batches of pairs, limited by capacity and time, of the work `work`.
    ///
    /// # Errors
    /// Those of `record`, and as [`Recorder::tiled`].
    pub fn each_batch(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        work: &'static str,
        mut record: impl FnMut(&mut Recorder, Batch) -> Result<()>,
    ) -> Result<()> {
        let Some(group) = scene.group(self.source) else {
            return Ok(());
        };
        let first = scene.first_pairs();
        recorder.tiled(work, group.pairs(), first, |r, done, limit| {
            let batch = Batch {
                group,
                first_pair: done as u32,
                pair_count: limit.min(self.list.capacity.into()) as u32,
            };
            record(r, batch)?;
            Ok(batch.pair_count.into())
        })
    }

    /// Writes the splats of a batch of pairs.
    pub fn record_project(&self, recorder: &mut Recorder, scene: &DeviceScene, batch: Batch) {
        let push = ProjectPush {
            first_pair: batch.first_pair,
            pair_count: batch.pair_count,
            patch_count: batch.group.patch_count,
            receiver_count: self.receiver_count,
            lobes: scene.casters.lobes,
            spread: self.spread,
            flat_spread: FLAT_SPREAD,
            can_occlude: u32::from(scene.geometry.can_occlude),
        };
        recorder.dispatch(&self.project, &push, [batch.pair_count, 1, 1]);
    }

    /// Draws the splats in the used slots into the light maps; `clear` clears the maps first.
    pub fn record_splat(&self, recorder: &mut Recorder, light_map: &Image, clear: bool) {
        self.list
            .record_draw(recorder, &self.draw, light_map, clear);
    }
}
