//! Landings of chains on mesh receivers: the waves of chains list the paths that reach a mesh receiver. Each landing is a beam, and
//! has a mesh footprint for every square of texels that the beam meets, as the beam of a patch has. They are counted first, and then
//! projected and drawn in batches.

use crate::error::Result;
use crate::gpu::{
    BoundPipeline, Buffer, Constants, Context, Image, Recorder, Resource, Topology, Vertices,
    shaders,
};
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::constants::{ARGUMENT_WORDS, SPLAT_GROUP, UNITS_WORD, WAVE_WORDS};
use crate::render::gpu_types::{ChainHit, ChainPath, ChainPush, MeshFootprint};
use crate::render::splat::prefix_sums::{BlockSums, PrefixSums};
use crate::render::splat::quads::{self, draw_push};
use std::sync::Arc;

/// Maximum number of mesh footprints over the number of rays of the lattices. A footprint of a few texels has about 4.
const MESH_FOOTPRINTS_PER_RAY: f64 = 12.0;
/// The same where light is dispersed: a landing has footprints of every part of the spectrum.
const DISPERSED_MESH_FOOTPRINTS_PER_RAY: f64 = 48.0;
/// Maximum number of mesh footprints of a batch: 16 MiB.
const BATCH: u32 = 1 << 17;
/// Typical number of mesh footprints of a landing.
const FOOTPRINTS_PER_LANDING: u32 = 4;
/// Least number of threads that project the landings of a batch.
const LEAST_THREADS: u32 = 1024;
/// Words of a `VkDrawIndexedIndirectCommand`.
const DRAW_WORDS: u64 = 5;

/// The memory of the landings, which the passes of the waves write.
pub struct LandingBuffers {
    /// Of the paths of a wave, then of the landings.
    pub numbers: Buffer,
    pub sums: Buffer,
    /// See `scan_chains.comp`.
    pub sizes: Buffer,
    pub paths: Buffer,
    pub hits: Buffer,
    quads: Buffer,
    /// Maximum number of landings, and of paths of a wave.
    capacity: u32,
    /// Maximum number of mesh footprints of a batch, and of a frame.
    pub batch: u32,
    pub splat_capacity: u32,
}

impl LandingBuffers {
    /// `rays`: maximum number of rays of the lattices.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if device memory is insufficient.
    pub fn new(
        context: &Arc<Context>,
        scene: &mut DeviceScene,
        capacity: u32,
        rays: u32,
    ) -> Result<Self> {
        let of_ray = match scene.spectrum.coordinate {
            Some(_) => DISPERSED_MESH_FOOTPRINTS_PER_RAY,
            None => MESH_FOOTPRINTS_PER_RAY,
        };
        let splat_capacity = (of_ray * f64::from(rays)) as u32;
        let batch = splat_capacity.min(BATCH);
        let of_each =
            |name, bytes: usize| Buffer::new(context, name, u64::from(capacity) * bytes as u64);
        let blocks = u64::from(capacity.div_ceil(SPLAT_GROUP));
        Ok(Self {
            numbers: of_each("landing numbers", 8)?,
            sums: Buffer::new(context, "landing sums", 8 * blocks)?,
            sizes: Buffer::new(context, "landing sizes", 4 * u64::from(WAVE_WORDS))?,
            paths: of_each("landing paths", size_of::<ChainPath>())?,
            hits: of_each("landing hits", size_of::<ChainHit>())?,
            quads: quads::indices(context, &mut scene.staging, "chain mesh quads", batch)?,
            capacity,
            batch,
            splat_capacity,
        })
    }
}

/// The buffers of chains that the landings are listed from.
pub struct Waves<'a> {
    pub paths: &'a [Buffer; 2],
    pub hits: &'a Buffer,
    pub sizes: &'a [Buffer; 2],
    pub flux_sums: &'a Buffer,
}

pub struct Landings {
    /// For each direction between the two wave buffers.
    in_waves: [BlockSums; 2],
    list: [BoundPipeline; 2],
    count: BoundPipeline,
    footprint_sums: PrefixSums,
    project: BoundPipeline,
    draw: BoundPipeline,
    /// Of the mesh footprints, as `scan.comp` writes them.
    totals: Buffer,
    /// A `VkDrawIndexedIndirectCommand` of a batch.
    arguments: Buffer,
    pub buffers: LandingBuffers,
}

impl Landings {
    /// `constants`: those of the passes of chains.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn new(
        context: &Arc<Context>,
        scene: &DeviceScene,
        constants: Constants,
        waves: &Waves,
        buffers: LandingBuffers,
    ) -> Result<Self> {
        let splats = Buffer::new(
            context,
            "chain mesh footprints",
            u64::from(buffers.batch) * size_of::<MeshFootprint>() as u64,
        )?;
        let words = u64::from(ARGUMENT_WORDS);
        let totals = Buffer::new(context, "chain mesh footprint totals", 4 * words)?;
        let arguments = Buffer::new(context, "chain mesh footprint draw", 4 * DRAW_WORDS)?;

        let buffer = Resource::Buffer;
        let compute = |shader, own: &[_]| scene.compute_with(constants, context, shader, own);
        let list = |from: usize| {
            let own = [
                ("paths", buffer(&waves.paths[from])),
                ("hits", buffer(waves.hits)),
                ("waves", buffer(&waves.sizes[from])),
                ("landing_numbers", buffer(&buffers.numbers)),
                ("landing_sums", buffer(&buffers.sums)),
                ("landing_paths", buffer(&buffers.paths)),
                ("landing_hits", buffer(&buffers.hits)),
                ("flux_sums", buffer(waves.flux_sums)),
            ];
            compute(&shaders::LIST_LANDINGS_COMP, &own)
        };
        let numbers = [&buffers.numbers, &buffers.sums];
        let in_waves =
            |from: usize| BlockSums::new(context, scene, numbers, Some(&waves.sizes[from]));
        let landings = [
            ("paths", buffer(&buffers.paths)),
            ("landing_hits", buffer(&buffers.hits)),
            ("landing_sizes", buffer(&buffers.sizes)),
            ("numbers", buffer(&buffers.numbers)),
            ("block_sums", buffer(&buffers.sums)),
            ("mesh_footprints", buffer(&splats)),
            ("totals", buffer(&totals)),
            ("arguments", buffer(&arguments)),
            ("flux_sums", buffer(waves.flux_sums)),
        ];
        let footprint = [&shaders::MESH_FOOTPRINT_VERT, &shaders::MESH_FOOTPRINT_FRAG];
        let [numbers, sums] = numbers;
        Ok(Self {
            in_waves: [in_waves(0)?, in_waves(1)?],
            list: [list(0)?, list(1)?],
            count: compute(&shaders::COUNT_LANDINGS_COMP, &landings)?,
            footprint_sums: PrefixSums::new(
                context,
                scene,
                [numbers, sums, &totals],
                Some(&buffers.sizes),
            )?,
            project: compute(&shaders::PROJECT_LANDINGS_COMP, &landings)?,
            draw: scene.graphics(context, footprint, Topology::Triangles, &landings)?,
            totals,
            arguments,
            buffers,
        })
    }

    /// Submits what was recorded and waits; the number of mesh footprints, as far as there is room.
    ///
    /// # Errors
    /// As [`Recorder::submit`].
    pub fn splat_count(&self, recorder: &mut Recorder) -> Result<u32> {
        let totals: Vec<u32> = recorder.read(&self.totals, ARGUMENT_WORDS as usize)?;
        Ok(totals[UNITS_WORD as usize].min(self.buffers.splat_capacity))
    }

    /// Numbers the landings of a wave within blocks.
    pub fn record_number_in_wave(&self, recorder: &mut Recorder, wave: u32) {
        self.in_waves[wave as usize % 2].record(recorder, self.buffers.capacity);
    }

    /// Lists the landings of a wave, whose sizes are in `waves`.
    pub fn record_list(
        &self,
        recorder: &mut Recorder,
        push: &ChainPush,
        wave: u32,
        waves: &Buffer,
    ) {
        recorder.dispatch_indirect(&self.list[wave as usize % 2], push, waves, 0);
    }

    /// Counts the mesh footprints of each landing.
    pub fn record_count(&self, recorder: &mut Recorder, push: &ChainPush) {
        recorder.dispatch_indirect(&self.count, push, &self.buffers.sizes, 0);
    }

    /// Numbers the mesh footprints within blocks of landings.
    pub fn record_number(&self, recorder: &mut Recorder) {
        self.footprint_sums
            .record_number(recorder, self.buffers.capacity);
    }

    /// Numbers the blocks, and the mesh footprints in all.
    pub fn record_scan(&self, recorder: &mut Recorder) {
        (self.footprint_sums).record_scan(recorder, self.buffers.capacity, [0, 0]);
    }

    /// Writes the mesh footprints of a batch: its first one and their number. Passes that count the flux only count the landings without
    /// room.
    pub fn record_project(&self, recorder: &mut Recorder, push: &ChainPush, batch: [u32; 2]) {
        let [first_mesh_splat, mesh_splat_batch] = batch;
        let threads = (mesh_splat_batch / FOOTPRINTS_PER_LANDING).max(LEAST_THREADS);
        let push = ChainPush {
            first_mesh_splat,
            mesh_splat_batch,
            ..*push
        };
        recorder.dispatch(&self.project, &push, [threads, 1, 1]);
    }

    /// Draws the mesh footprints of the batch that was projected last into the light maps.
    pub fn record_splat(&self, recorder: &mut Recorder, light_map: &Image) {
        let push = draw_push(light_map);
        let vertices = Vertices::Indexed {
            indices: &self.buffers.quads,
            arguments: &self.arguments,
            offset: 0,
        };
        recorder.draw_vertices(&self.draw, light_map, false, &push, vertices);
    }
}
