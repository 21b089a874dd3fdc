//! Chains: light of suns, lamps and environment cells that meets two or more specular surfaces on its way to the receivers. Rays of a
//! lattice are followed from surface to surface, a wave of them at a time. Each lands as a footprint on a planar receiver, or as mesh
//! footprints.

mod flux;
pub mod frame;
pub mod landings;
pub mod lattice;

use crate::error::Result;
use crate::flux_balance::FluxBalance;
use crate::gpu::{
    BoundPipeline, Buffer, Context, Image, Recorder, Resource, Topology, Vertices, shaders,
};
use crate::render::chains::landings::{LandingBuffers, Landings, Waves};
use crate::render::device_scene::DeviceScene;
use crate::render::dispatch::threads;
use crate::render::gpu_types::constants::{
    ID_COUNTS_FLUX, SPLAT_GROUP, WAVE_DRAW_WORD, WAVE_WORDS,
};
use crate::render::gpu_types::{
    ChainFootprint, ChainHit, ChainPath, ChainPush, LatticePilot, LatticePlan, PilotRay,
};
use crate::render::splat::prefix_sums::{BlockSums, PrefixSums};
use crate::render::splat::quads::{self, draw_push};
use crate::render::splat::resolve::Levels;
use glam::Vec2;
use std::sync::Arc;

/// Maximum number of paths of a wave over the number of rays of the lattices. A wave grows where both lobes are followed.
const PATHS_PER_RAY: f64 = 1.5;
/// Maximum number of footprints over the number of rays of the lattices.
const FOOTPRINTS_PER_RAY: f64 = 2.0;
/// The same where light is dispersed, up to a number of footprints.
const DISPERSED_FOOTPRINTS_PER_RAY: f64 = 12.0;
const MAX_DISPERSED_FOOTPRINTS: u32 = 3 << 19; // 120 MiB, below what every device allows for a buffer
/// Variance of a kernel over the square of the lattice's cell. Less leaves gaps where the cells' images do not join.
const SPREAD: f32 = 0.2;
/// Number of waves where there are interfaces, after which every path follows one lobe of each surface to its end. One wave follows
/// paths from mirror to mirror until they land, which is the end of all but those that pass the edge of a receiver.
const WAVES: u32 = 6;

pub struct Chains {
    pilot: BoundPipeline,
    weigh: BoundPipeline,
    plan: BoundPipeline,
    count_rays: BoundPipeline,
    ray_sums: PrefixSums,
    /// One pipeline for each direction between the two wave buffers.
    trace: [BoundPipeline; 2],
    sums: [BlockSums; 2],
    scan: [BoundPipeline; 2],
    emit: [BoundPipeline; 2],
    finish: BoundPipeline,
    draw: BoundPipeline,
    waves: [Buffer; 2],
    flux_sums: Buffer,
    /// Of all waves.
    pub footprints: Buffer,
    quads: Buffer,
    ray_capacity: u32,
    path_capacity: u32,
    splat_capacity: u32,
    /// Number of waves.
    pub wave_count: u32,
    /// On mesh receivers, if there are any.
    pub landings: Option<Landings>,
    /// Of every receiver, the estimated relative L1 error that chains leave and their share of its light; then how many halvings
    /// there was no room for.
    pub errors: Buffer,
    /// Relative L1 error to aim for; 0 without one.
    error: f32,
    /// Of planar and mesh receivers.
    receiver_count: usize,
}

impl Chains {
    /// `error`: relative L1 error to aim for. `counts_flux`: the passes count the light by where it ends, for [`Self::read_flux_balance`].
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn new(
        context: &Arc<Context>,
        scene: &mut DeviceScene,
        levels: &Levels,
        error: Option<f32>,
        counts_flux: bool,
    ) -> Result<Self> {
        let rays = scene.lattices.ray_capacity;
        let pilot_bytes = scene.lattices.pilot_capacity as usize * size_of::<PilotRay>();
        let pilot_rays = Buffer::new(context, "pilot rays", pilot_bytes as u64)?;
        let cells = u64::from(scene.lattices.pilot_capacity);
        let ray_cells = Buffer::new(context, "cells of lattices", 4 * cells)?;
        let ray_numbers = Buffer::new(context, "ray numbers", 8 * cells)?;
        let ray_sums = Buffer::new(context, "ray sums", 8 * cells.div_ceil(SPLAT_GROUP.into()))?;
        let lattices = u64::from(scene.lattices.capacity);
        let of_lattices = |name, bytes: usize| Buffer::new(context, name, lattices * bytes as u64);
        let pilots = of_lattices("pilots of lattices", size_of::<LatticePilot>())?;
        let plans = of_lattices("plans of lattices", size_of::<LatticePlan>())?;
        let receivers = (scene.receivers.planar_count + scene.receivers.mesh_count()) as usize;
        let fluxes = of_lattices("fluxes of lattices", 16 * receivers)?;
        let errors = Buffer::new(context, "errors of chains", 8 * (receivers as u64 + 1))?;
        let path_capacity = (PATHS_PER_RAY * f64::from(rays)) as u32;
        let mut splat_capacity = (FOOTPRINTS_PER_RAY * f64::from(rays)) as u32;
        if scene.spectrum.coordinate.is_some() {
            let wanted = (DISPERSED_FOOTPRINTS_PER_RAY * f64::from(rays)) as u32;
            splat_capacity = splat_capacity.max(wanted.min(MAX_DISPERSED_FOOTPRINTS));
        }
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
        let sizes = |name| Buffer::new(context, name, 4 * u64::from(WAVE_WORDS));
        let waves = [sizes("wave")?, sizes("next wave")?];
        let splats = u64::from(splat_capacity);
        let footprints = Buffer::new(
            context,
            "chain footprints",
            splats * size_of::<ChainFootprint>() as u64,
        )?;
        let quads = quads::indices(context, &mut scene.staging, "chain quads", splat_capacity)?;

        let landing = match scene.receivers.mesh_count() {
            0 => None,
            _ => Some(LandingBuffers::new(context, scene, path_capacity, rays)?),
        };
        let flux_sums = flux::sums(context)?;
        let mut constants = scene.constants();
        constants[ID_COUNTS_FLUX as usize] = counts_flux;
        let wave_count = if scene.casters.lobes > 1 { WAVES } else { 1 };
        let last = wave_count as usize % 2;
        let buffer = Resource::Buffer;
        // Without mesh receivers, shaders name the landings' buffers but do not access them.
        let of_landings = |name, pick: fn(&LandingBuffers) -> &Buffer| {
            (name, buffer(landing.as_ref().map_or(&flux_sums, pick)))
        };
        // Everything that the passes name, where a wave is read from the one or the other of two buffers.
        let all = |from: usize| {
            [
                ("lattices", buffer(&scene.lattices.buffer)),
                ("lights", buffer(&scene.lattices.lights)),
                ("pilot_rays", buffer(&pilot_rays)),
                ("lattice_pilots", buffer(&pilots)),
                ("lattice_fluxes", buffer(&fluxes)),
                ("lattice_plans", buffer(&plans)),
                ("chain_errors", buffer(&errors)),
                ("ray_cells", buffer(&ray_cells)),
                ("ray_numbers", buffer(&ray_numbers)),
                ("ray_sums", buffer(&ray_sums)),
                ("paths", buffer(&paths[from])),
                ("traced", buffer(&paths[from])),
                ("next_paths", buffer(&paths[1 - from])),
                ("hits", buffer(&hits)),
                ("numbers", buffer(&numbers)),
                ("block_sums", buffer(&block_sums)),
                ("waves", buffer(&waves[from])),
                ("next_waves", buffer(&waves[1 - from])),
                ("footprints", buffer(&footprints)),
                ("coarse", buffer(&levels.coarse)),
                ("flux_sums", buffer(&flux_sums)),
                of_landings("landing_numbers", |of| &of.numbers),
                of_landings("landing_sums", |of| &of.sums),
                of_landings("landing_sizes", |of| &of.sizes),
                of_landings("landing_paths", |of| &of.paths),
                of_landings("landing_hits", |of| &of.hits),
            ]
        };
        let compute = |shader, from| scene.compute_with(constants, context, shader, &all(from));
        let both = |shader| Ok::<_, crate::Error>([compute(shader, 0)?, compute(shader, 1)?]);
        let sums = |from: usize| {
            let (own, paths) = ([&numbers, &block_sums], Some(&waves[from]));
            BlockSums::new(context, scene, own, paths)
        };
        let pilot = compute(&shaders::PILOT_CHAINS_COMP, 0)?;
        let weigh = compute(&shaders::WEIGH_LATTICES_COMP, 0)?;
        let plan = compute(&shaders::PLAN_CHAINS_COMP, 0)?;
        let count_rays = compute(&shaders::COUNT_RAYS_COMP, 0)?;
        let sums_of_rays =
            PrefixSums::new(context, scene, [&ray_numbers, &ray_sums, &waves[0]], None)?;
        let trace = both(&shaders::TRACE_CHAINS_COMP)?;
        let sums = [sums(0)?, sums(1)?];
        let scan = both(&shaders::SCAN_CHAINS_COMP)?;
        let emit = both(&shaders::EMIT_CHAINS_COMP)?;
        let finish = compute(&shaders::FINISH_CHAINS_COMP, last)?;
        let drawing = [
            &shaders::CHAIN_FOOTPRINT_VERT,
            &shaders::CHAIN_FOOTPRINT_FRAG,
        ];
        let draw = scene.graphics(context, drawing, Topology::Triangles, &all(last))?;
        let of_waves = Waves {
            paths: &paths,
            hits: &hits,
            sizes: &waves,
            flux_sums: &flux_sums,
        };
        let landings = (landing)
            .map(|buffers| Landings::new(context, scene, constants, &of_waves, buffers))
            .transpose()?;
        Ok(Self {
            pilot,
            weigh,
            plan,
            count_rays,
            ray_sums: sums_of_rays,
            trace,
            sums,
            scan,
            emit,
            finish,
            draw,
            waves,
            flux_sums,
            footprints,
            quads,
            ray_capacity: rays,
            path_capacity,
            splat_capacity,
            wave_count,
            landings,
            errors,
            error: error.unwrap_or(0.0),
            receiver_count: receivers,
        })
    }

    /// The sizes after all waves.
    pub fn last(&self) -> &Buffer {
        &self.waves[self.wave_count as usize % 2]
    }

    /// Push constants of a wave.
    fn push(&self, scene: &DeviceScene, wave: u32) -> ChainPush {
        ChainPush {
            is_first: u32::from(wave == 0),
            lattice_count: scene.lattices.count,
            pilot_count: scene.lattices.pilot_count,
            receiver_count: scene.receivers.planar_count,
            mesh_count: scene.receivers.mesh_count(),
            max_interfaces: scene.scene.max_interfaces,
            ray_capacity: self.ray_capacity,
            path_capacity: self.path_capacity,
            splat_capacity: self.splat_capacity,
            mesh_splat_capacity: self
                .landings
                .as_ref()
                .map_or(0, |of| of.buffers.splat_capacity),
            first_mesh_splat: 0,
            mesh_splat_batch: 0,
            spread: SPREAD,
            spectral_middle: scene.spectrum.middle(),
            flux_scale: flux::scale(scene.lattices.flux),
            error: self.error,
        }
    }

    /// Clears the sums of flux.
    pub fn record_clear(&self, recorder: &mut Recorder) {
        recorder.zero(&self.flux_sums);
    }

    /// Sets the relative L1 error to aim for.
    pub fn set_error(&mut self, error: f32) {
        if self.error > 0.0 {
            self.error = error;
        }
    }

    /// How often the rays of the last frame would have to be doubled to reach the error to aim for; 0 if there was room for all, and
    /// where meshes are receivers, on which no error is aimed for.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn lacking_halvings(&self) -> Result<u32> {
        if self.error == 0.0 || self.landings.is_some() {
            return Ok(0);
        }
        let errors: Vec<Vec2> = self.errors.read(self.receiver_count + 1)?;
        Ok(errors[self.receiver_count].x as u32)
    }

    /// Reads the balance of flux of chains that count it.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn read_flux_balance(&self, scene: &DeviceScene) -> Result<FluxBalance> {
        let scale = flux::scale(scene.lattices.flux);
        flux::read(&self.flux_sums, scale, scene.scene.max_interfaces)
    }

    /// Follows a ray through every cell of the lattices.
    pub fn record_pilot(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        let rays = threads(scene.lattices.pilot_count);
        recorder.dispatch(&self.pilot, &self.push(scene, 0), rays);
    }

    /// Adds up what these rays found.
    pub fn record_weigh(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        let threads = [SPLAT_GROUP * scene.lattices.count, 1, 1];
        recorder.dispatch(&self.weigh, &self.push(scene, 0), threads);
    }

    /// Chooses how fine each lattice is to be.
    pub fn record_plan(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        let threads = [SPLAT_GROUP, 1, 1];
        recorder.dispatch(&self.plan, &self.push(scene, 0), threads);
    }

    /// Divides the cells of the lattices.
    pub fn record_count_rays(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        let cells = threads(scene.lattices.pilot_count);
        recorder.dispatch(&self.count_rays, &self.push(scene, 0), cells);
    }

    /// Numbers the rays within blocks of cells.
    pub fn record_number_rays(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        (self.ray_sums).record_number(recorder, scene.lattices.pilot_count);
    }

    /// Numbers the blocks, and begins the first wave.
    pub fn record_scan_rays(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        (self.ray_sums).record_scan(recorder, scene.lattices.pilot_count, [0, 1]);
    }

    /// Finds what the rays of a wave meet.
    pub fn record_trace(&self, recorder: &mut Recorder, scene: &DeviceScene, wave: u32) {
        self.record(recorder, scene, wave, &self.trace);
    }

    /// Writes the next wave, and the footprints and landings of this one.
    pub fn record_emit(&self, recorder: &mut Recorder, scene: &DeviceScene, wave: u32) {
        self.record(recorder, scene, wave, &self.emit);
        if let Some(landings) = &self.landings {
            let (push, waves) = (self.push(scene, wave), &self.waves[wave as usize % 2]);
            landings.record_list(recorder, &push, wave, waves);
        }
    }

    fn record(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        wave: u32,
        pipelines: &[BoundPipeline; 2],
    ) {
        let (push, waves) = (self.push(scene, wave), &self.waves[wave as usize % 2]);
        recorder.dispatch_indirect(&pipelines[wave as usize % 2], &push, waves, 0);
    }

    /// Numbers the lobes, footprints and landings of a wave within blocks.
    pub fn record_number(&self, recorder: &mut Recorder, wave: u32) {
        self.sums[wave as usize % 2].record(recorder, self.path_capacity);
        if let Some(landings) = &self.landings {
            landings.record_number_in_wave(recorder, wave);
        }
    }

    /// Numbers the blocks, which gives the size of the next wave.
    pub fn record_scan(&self, recorder: &mut Recorder, scene: &DeviceScene, wave: u32) {
        let (push, threads) = (self.push(scene, wave), [SPLAT_GROUP, 1, 1]);
        recorder.dispatch(&self.scan[wave as usize % 2], &push, threads);
    }

    /// Writes the footprints of the paths that are left.
    pub fn record_finish(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        let (push, waves) = (self.push(scene, self.wave_count), self.last());
        recorder.dispatch_indirect(&self.finish, &push, waves, 0);
    }

    /// Draws the footprints of all waves into the light maps; `clear` clears the maps first.
    pub fn record_splat(&self, recorder: &mut Recorder, light_map: &Image, clear: bool) {
        let push = draw_push(light_map);
        recorder.draw_vertices(&self.draw, light_map, clear, &push, self.vertices());
    }

    /// The quads of the footprints of all waves.
    pub fn vertices(&self) -> Vertices<'_> {
        Vertices::Indexed {
            indices: &self.quads,
            arguments: self.last(),
            offset: 4 * WAVE_DRAW_WORD as u64,
        }
    }
}
