//! Chains: light of suns and lamps that meets two or more specular surfaces on its way to the planar receivers. Rays of a
//! lattice are followed from surface to surface, a wave of them at a time, and each lands as a footprint.

pub mod lattice;

use crate::error::Result;
use crate::gpu::{BoundPipeline, Buffer, Context, Image, Recorder, Resource, Topology, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::dispatch::threads;
use crate::render::gpu_types::constants::SPLAT_GROUP;
use crate::render::gpu_types::{ChainHit, ChainLattice, ChainPath, ChainPush, Footprint};
use crate::render::splat::prefix_sums::PrefixSums;
use crate::render::splat::quads::{self, draw_push};
use crate::render::splat::resolve::Levels;
use std::sync::Arc;

/// Maximum number of paths of a wave over the number of rays of the lattices. A wave grows where both lobes are followed.
const PATHS_PER_RAY: f64 = 1.5;
/// Maximum number of footprints over the number of rays of the lattices.
const FOOTPRINTS_PER_RAY: f64 = 4.0;
/// Variance of a kernel over the square of the lattice's cell. Less leaves gaps where the cells' images do not join.
const SPREAD: f32 = 0.2;
/// Words of the buffer of waves: see advance_chains.comp.
const WAVE_WORDS: u32 = 14;
const DRAW_WORD: u32 = 9;

pub struct Chains {
    pilot: BoundPipeline,
    plan: BoundPipeline,
    /// From either buffer of paths to the other.
    trace: [BoundPipeline; 2],
    emit: [BoundPipeline; 2],
    sums: PrefixSums,
    advance: BoundPipeline,
    draw: BoundPipeline,
    waves: Buffer,
    quads: Buffer,
    path_capacity: u32,
    splat_capacity: u32,
}

impl Chains {
    /// `shares` are the receivers' shares of the light of single surfaces.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn new(
        context: &Arc<Context>,
        scene: &mut DeviceScene,
        shares: &Buffer,
        levels: &Levels,
    ) -> Result<Self> {
        let rays = scene.lattices.ray_capacity;
        let pilot_bytes = 4 * u64::from(scene.lattices.pilot_capacity);
        let pilot_shares = Buffer::new(context, "pilot shares", pilot_bytes)?;
        let lattice_bytes = scene.lattices.capacity as usize * size_of::<ChainLattice>();
        let refined = Buffer::new(context, "refined lattices", lattice_bytes as u64)?;
        let path_capacity = (PATHS_PER_RAY * f64::from(rays)) as u32;
        let splat_capacity = (FOOTPRINTS_PER_RAY * f64::from(rays)) as u32;
        let of_paths = |name, bytes: usize| {
            Buffer::new(context, name, u64::from(path_capacity) * bytes as u64)
        };
        let paths = [
            of_paths("chain paths", size_of::<ChainPath>())?,
            of_paths("next chain paths", size_of::<ChainPath>())?,
        ];
        let hits = of_paths("chain hits", size_of::<ChainHit>())?;
        let numbers = of_paths("chain numbers", 8)?;
        let blocks = u64::from(path_capacity.div_ceil(SPLAT_GROUP));
        let block_sums = Buffer::new(context, "chain sums", 8 * blocks)?;
        let totals = Buffer::new(context, "chain totals", 36)?;
        let waves = Buffer::new(context, "waves", 4 * u64::from(WAVE_WORDS))?;
        let splats = u64::from(splat_capacity);
        let footprints = Buffer::new(
            context,
            "chain footprints",
            splats * size_of::<Footprint>() as u64,
        )?;
        let quads = quads::indices(context, &mut scene.staging, "chain quads", splat_capacity)?;

        let buffer = Resource::Buffer;
        let coarse = ("lattices", buffer(&scene.lattices.buffer));
        let pilot_shares = ("pilot_shares", buffer(&pilot_shares));
        let own = [coarse, ("shares", buffer(shares)), pilot_shares];
        let pilot = scene.compute(context, &shaders::PILOT_CHAINS_COMP, &own)?;
        let own = [
            coarse,
            pilot_shares,
            ("refined", buffer(&refined)),
            ("waves", buffer(&waves)),
        ];
        let plan = scene.compute(context, &shaders::PLAN_CHAINS_COMP, &own)?;
        let lattices = ("lattices", buffer(&refined));
        let trace = |from: usize| {
            let own = [
                lattices,
                ("paths", buffer(&paths[from])),
                ("hits", buffer(&hits)),
                ("numbers", buffer(&numbers)),
                ("waves", buffer(&waves)),
            ];
            scene.compute(context, &shaders::TRACE_CHAINS_COMP, &own)
        };
        let emit = |from: usize| {
            let own = [
                lattices,
                ("paths", buffer(&paths[from])),
                ("hits", buffer(&hits)),
                ("numbers", buffer(&numbers)),
                ("block_sums", buffer(&block_sums)),
                ("waves", buffer(&waves)),
                ("next_paths", buffer(&paths[1 - from])),
                ("footprints", buffer(&footprints)),
                ("coarse", buffer(&levels.coarse)),
            ];
            scene.compute(context, &shaders::EMIT_CHAINS_COMP, &own)
        };
        let own = [("totals", buffer(&totals)), ("waves", buffer(&waves))];
        let advance = scene.compute(context, &shaders::ADVANCE_CHAINS_COMP, &own)?;
        let drawn = [("footprints", buffer(&footprints))];
        let [vertex, fragment] = [&shaders::FOOTPRINT_VERT, &shaders::FOOTPRINT_FRAG];
        let topology = Topology::Triangles;
        Ok(Self {
            pilot,
            plan,
            trace: [trace(0)?, trace(1)?],
            emit: [emit(0)?, emit(1)?],
            sums: PrefixSums::new(
                context,
                scene,
                [&numbers, &block_sums, &totals],
                Some(&waves),
            )?,
            advance,
            draw: BoundPipeline::graphics(context, vertex, fragment, topology, &drawn)?,
            waves,
            quads,
            path_capacity,
            splat_capacity,
        })
    }

    fn push(&self, scene: &DeviceScene, wave: u32) -> ChainPush {
        ChainPush {
            is_first: u32::from(wave == 0),
            lattice_count: scene.lattices.count,
            pilot_count: scene.lattices.pilot_count,
            receiver_count: scene.receivers.planar_count,
            max_interfaces: scene.scene.max_interfaces,
            ray_capacity: scene.lattices.ray_capacity,
            path_capacity: self.path_capacity,
            splat_capacity: self.splat_capacity,
            spread: SPREAD,
        }
    }

    /// Number of waves. The rays of the last one only land.
    pub fn waves(scene: &DeviceScene) -> u32 {
        scene.scene.max_interfaces + 1
    }

    /// Finds how much light of several surfaces the rays of the lattices bring to the receivers.
    pub fn record_pilot(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        let rays = threads(scene.lattices.pilot_count);
        recorder.dispatch(&self.pilot, &self.push(scene, 0), rays);
    }

    /// Refines the lattices, and begins the first wave.
    pub fn record_plan(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        let threads = [SPLAT_GROUP, 1, 1];
        recorder.dispatch(&self.plan, &self.push(scene, 0), threads);
    }

    /// Finds what the rays of a wave meet.
    pub fn record_trace(&self, recorder: &mut Recorder, scene: &DeviceScene, wave: u32) {
        self.record(recorder, scene, wave, &self.trace);
    }

    /// Writes the next wave, and the footprints of this one.
    pub fn record_emit(&self, recorder: &mut Recorder, scene: &DeviceScene, wave: u32) {
        self.record(recorder, scene, wave, &self.emit);
    }

    fn record(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        wave: u32,
        pipelines: &[BoundPipeline; 2],
    ) {
        let (push, pipeline) = (self.push(scene, wave), &pipelines[wave as usize % 2]);
        recorder.dispatch_indirect(pipeline, &push, &self.waves, 0);
    }

    /// Numbers the lobes and footprints of a wave within blocks.
    pub fn record_number(&self, recorder: &mut Recorder) {
        self.sums.record_number(recorder, self.path_capacity);
    }

    /// Numbers the blocks.
    pub fn record_scan(&self, recorder: &mut Recorder) {
        self.sums.record_scan(recorder, self.path_capacity, [0, 1]);
    }

    /// Goes on to the next wave.
    pub fn record_advance(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        recorder.dispatch(&self.advance, &self.push(scene, 1), [1, 1, 1]);
    }

    /// Draws the footprints of all waves into the light maps; `clear` clears the maps first.
    pub fn record_splat(&self, recorder: &mut Recorder, light_map: &Image, clear: bool) {
        let push = draw_push(light_map);
        let (draw, quads, waves) = (&self.draw, &self.quads, &self.waves);
        let offset = 4 * u64::from(DRAW_WORD);
        recorder.draw_indexed_indirect(draw, light_map, clear, &push, quads, waves, offset);
    }
}
