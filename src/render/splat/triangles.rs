//! Triangles: the images of suns and lamps on planar receivers.
//!
//! The facets of the casters are divided into patches of about equal flux, and the image of each patch into as many
//! triangles as its curvature asks for. The device chooses all counts again in every frame.

use crate::error::{Error, Result};
use crate::gpu::{
    BoundPipeline, Buffer, Context, Image, Recorder, Resource, Topology, Vertices, shaders,
};
use crate::render::device_scene::DeviceScene;
use crate::render::dispatch::threads;
use crate::render::gpu_types::constants::{
    ARGUMENT_WORDS, BATCH_DRAW_WORD, MAX_PATCH_DIVISION, MAX_PIECES, MAX_TRIANGLES_PER_PATCH,
    SHARE_LEVELS, SPLAT_GROUP,
};
use crate::render::gpu_types::{
    FacetImage, FacetPatches, FacetPush, ReceiverShare, TotalPush, TriangleSplat,
};
use crate::render::settings::{EXPECTED_ERROR, Method, Settings};
use crate::render::splat::prefix_sums::PrefixSums;
use crate::render::splat::quads::{self, draw_push};
use crate::render::splat::resolve::Levels;
use std::sync::Arc;

/// Triangles of one batch, 96 bytes each, at most.
const MAX_BATCH: u32 = 1 << 18;
/// Number of batches that a batch is made small enough for: smaller buffers, but a host's command buffer records all batches, and an
/// empty one costs time, too.
const FEW_BATCHES: u32 = 8;
/// Patches for each sample: flux is uneven, so that rounding up makes more patches than the shares say.
const SHARE_OF_SAMPLE: f32 = 2.0;
/// 1/share over the number of patches, at most: patches are divided further from 1.3 shares on.
const SHARES_PER_PATCH: f64 = 1.7;

pub struct Triangles {
    facet_flux: BoundPipeline,
    visible_flux: BoundPipeline,
    total_flux: BoundPipeline,
    facet_error: BoundPipeline,
    choose_share: BoundPipeline,
    facet_count: BoundPipeline,
    patch_sums: PrefixSums,
    trace_corners: BoundPipeline,
    patch_count: BoundPipeline,
    splat_sums: PrefixSums,
    project: BoundPipeline,
    draw: BoundPipeline,
    visibility: Buffer,
    quads: Buffer,
    /// Arguments of the passes over patches, and over triangles.
    pub patch_totals: Buffer,
    pub splat_totals: Buffer,
    /// Where the patches of facets and of blocks of them begin, and the packed triangles of every patch.
    pub patch_numbers: Buffer,
    pub patch_block_sums: Buffer,
    pub patch_splats: Buffer,
    /// The triangles of a batch.
    pub triangle_splats: Buffer,
    /// Number of triangles of a batch.
    pub batch: u32,
    /// Number of batches of triangles.
    pub batches: u32,
    /// Number of batches that a blocking frame records; `None` before one has read how many are in use.
    pub expected_batches: Option<u32>,
    /// Whether rays are traced from the corners of patches.
    pub traces_corners: bool,
    /// Patches that fit the buffers.
    pub patch_capacity: u32,
    /// Whether chains light receivers, too.
    has_chains: bool,
    aim: Aim,
    pub shares: Buffer,
    pub facet_patches: Buffer,
}

/// What decides the number of patches; see facet_push.glsl.
#[derive(Clone, Copy)]
struct Aim {
    division: u32,
    error: f32,
    patch_share: f32,
    patch_budget: u32,
}

impl Aim {
    fn new(settings: &Settings, budget: u32, lit_facets: u32, receivers: u32, pairs: u32) -> Self {
        let patch_share = SHARE_OF_SAMPLE / settings.samples as f32;
        let division = (settings.samples as f32 / lit_facets.max(1) as f32).sqrt();
        let division = match settings.method {
            Method::Beams => division.round().clamp(1.0, MAX_PATCH_DIVISION as f32) as u32,
            _ => 0,
        };
        let patch_budget = match settings.error {
            _ if division > 0 => pairs.saturating_mul(division * division),
            // Even the coarsest level takes up to some hundreds of patches for each receiver. Shaders may round differently.
            Some(_) => budget.max(1024 * receivers) / 16 * 17,
            // By Minkowski's inequality, since no facet has more than (sqrt(flux / share) + 1)^2 patches.
            None => {
                let shares = f64::from(receivers) / f64::from(patch_share);
                (shares + 2.0 * (shares * f64::from(pairs)).sqrt()) as u32
            }
        };
        Self {
            division,
            error: settings.error.unwrap_or(0.0),
            patch_share,
            patch_budget,
        }
    }
}

impl Triangles {
    /// # Errors
    /// [`Error::Usage`] where there are too many pairs of facet and light, [`Error::Device`] where the device fails.
    pub fn new(
        context: &Arc<Context>,
        scene: &mut DeviceScene,
        levels: &Levels,
        chain_errors: Option<&Buffer>,
        settings: &Settings,
    ) -> Result<Self> {
        let facets = &scene.facets;
        let receivers = u64::from(scene.receivers.planar_count);
        let targets = u64::from(scene.planar_targets());
        let lights = u64::from(scene.lights.part_count);
        let [facet_count, corner_count, outline_count] = facets.most();
        let pairs = u64::from(facet_count) * lights;
        let limit = u64::from(u32::MAX / SPLAT_GROUP);
        let aim = Aim::new(
            settings,
            scene.patch_budget,
            scene.casters.lit_count,
            scene.receivers.planar_count,
            pairs.min(limit) as u32,
        );
        let patches = pairs + u64::from(aim.patch_budget);
        let points = lights * u64::from(corner_count) + patches * 3 / 2;
        if patches.max(points) > limit {
            return Err(Error::Usage {
                reason: format!(
                    "{patches} patches of {pairs} pairs of facet and light are more than fit"
                ),
                remedy: "use coarser meshes, fewer lights or fewer samples".into(),
            });
        }
        // Parts of clipped patches are two triangles.
        let of_shares = f64::from(MAX_TRIANGLES_PER_PATCH) * SHARES_PER_PATCH * patches as f64;
        // Outlines take a triangle for each piece of the light's disc.
        let of_pieces = match settings.error {
            Some(_) => lights * u64::from(outline_count * (MAX_PIECES - 1)),
            None => 0,
        };
        let splats = 2 * ((patches + of_pieces) * targets.min(4) + of_shares as u64);
        let batch = splats.div_ceil(FEW_BATCHES.into()).next_power_of_two();
        let batch = batch.clamp(1 << 12, MAX_BATCH.into()) as u32;
        let batches = splats.div_ceil(batch.into()).max(1) as u32;
        let blocks = |units: u64| units.div_ceil(SPLAT_GROUP.into());
        let buffer = |name: &str, bytes: u64| Buffer::new(context, name, bytes);
        let facet_patches = buffer("facet patches", pairs * size_of::<FacetPatches>() as u64)?;
        let images = pairs * receivers * size_of::<FacetImage>() as u64;
        let facet_images = buffer("facet images", images)?;
        let shares = buffer("shares", receivers * size_of::<ReceiverShare>() as u64)?;
        let errors = 16 * blocks(pairs) * receivers * u64::from(SHARE_LEVELS);
        let errors = buffer("errors", errors)?;
        let patch_numbers = buffer("patch numbers", 8 * pairs)?;
        let patch_block_sums = buffer("patch sums", 8 * blocks(pairs))?;
        let patch_totals = buffer("patch totals", 4 * u64::from(ARGUMENT_WORDS))?;
        let visibility = buffer("visibility", 4 * points * targets.div_ceil(16))?;
        let splat_numbers = buffer("triangle numbers", 8 * patches)?;
        let patch_splats = buffer("triangles of patches", 4 * patches * targets)?;
        let splat_sums = buffer("triangle sums", 8 * blocks(patches))?;
        let words = ARGUMENT_WORDS * (batches + 1);
        let splat_totals = buffer("triangle totals", 4 * u64::from(words))?;
        let slots = u64::from(batch);
        let triangle_splats = buffer("triangles", slots * size_of::<TriangleSplat>() as u64)?;
        let quads = quads::indices(context, &mut scene.staging, "quads", batch)?;

        let own = [
            ("lights", &scene.lights.parts),
            ("facets", &facets.facets),
            ("facet_corners", &facets.corners),
            ("facet_patches", &facet_patches),
            ("facet_images", &facet_images),
            ("shares", &shares),
            ("errors", &errors),
            ("patch_numbers", &patch_numbers),
            ("patch_sums", &patch_block_sums),
            ("totals", &patch_totals),
            ("visibility", &visibility),
            ("splat_numbers", &splat_numbers),
            ("patch_splats", &patch_splats),
            ("splat_sums", &splat_sums),
            ("splat_totals", &splat_totals),
            ("triangle_splats", &triangle_splats),
            ("coarse", &levels.coarse),
            // Without chains, the shader names this buffer but does not read it.
            ("chain_errors", chain_errors.unwrap_or(&shares)),
        ]
        .map(|(name, buffer)| (name, Resource::Buffer(buffer)));
        let compute = |shader| scene.compute(context, shader, &own);
        let drawing = [&shaders::TRIANGLE_VERT, &shaders::TRIANGLE_FRAG];
        Ok(Self {
            facet_flux: compute(&shaders::FACET_FLUX_COMP)?,
            visible_flux: compute(&shaders::VISIBLE_FLUX_COMP)?,
            total_flux: compute(&shaders::TOTAL_FLUX_COMP)?,
            facet_error: compute(&shaders::FACET_ERROR_COMP)?,
            choose_share: compute(&shaders::CHOOSE_SHARE_COMP)?,
            facet_count: compute(&shaders::FACET_COUNT_COMP)?,
            patch_sums: PrefixSums::new(
                context,
                scene,
                [&patch_numbers, &patch_block_sums, &patch_totals],
                None,
            )?,
            trace_corners: compute(&shaders::TRACE_CORNERS_COMP)?,
            patch_count: compute(&shaders::PATCH_COUNT_COMP)?,
            splat_sums: PrefixSums::new(
                context,
                scene,
                [&splat_numbers, &splat_sums, &splat_totals],
                Some(&patch_totals),
            )?,
            project: compute(&shaders::PROJECT_TRIANGLES_COMP)?,
            draw: scene.graphics(context, drawing, Topology::Triangles, &own)?,
            visibility,
            quads,
            patch_totals,
            splat_totals,
            patch_numbers,
            patch_block_sums,
            patch_splats,
            triangle_splats,
            batch,
            batches,
            expected_batches: None,
            traces_corners: settings.method == Method::Footprint,
            patch_capacity: patches as u32,
            has_chains: chain_errors.is_some(),
            aim,
            shares,
            facet_patches,
        })
    }

    /// Whether an error is aimed for.
    pub fn has_error_target(&self) -> bool {
        self.aim.error > 0.0
    }

    /// Sets the error to aim for, if there is one.
    pub fn set_error(&mut self, error: f32) {
        if self.has_error_target() {
            self.aim.error = error;
        }
    }

    fn push(&self, scene: &DeviceScene, first_splat: u32) -> FacetPush {
        let [first_facet, facet_count] = scene.facets.facets();
        let [first_corner, corner_count] = scene.facets.corners();
        FacetPush {
            facet_count,
            corner_count,
            light_count: scene.lights.part_count,
            receiver_count: scene.receivers.planar_count,
            lobes: scene.casters.lobes,
            can_occlude: u32::from(scene.geometry.can_occlude),
            division: self.aim.division,
            error: self.aim.error,
            patch_share: self.aim.patch_share,
            patch_budget: self.aim.patch_budget / 17 * 16,
            is_lattice: 0,
            first_splat,
            has_chains: u32::from(self.has_chains),
            merging_error: scene.facets.merging_error(&scene.geometry) as f32 / EXPECTED_ERROR,
            first_facet,
            first_corner,
        }
    }

    /// One thread for each pair of facet and light.
    fn record_over_pairs(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        pipeline: &BoundPipeline,
    ) {
        let push = self.push(scene, 0);
        recorder.dispatch(pipeline, &push, threads(pairs(scene)));
    }

    /// Clears the marks of the corners.
    pub fn record_clear(&self, recorder: &mut Recorder) {
        recorder.zero(&self.visibility);
    }

    /// Finds the flux of every facet on every receiver.
    pub fn record_facet_flux(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        self.record_over_pairs(recorder, scene, &self.facet_flux);
    }

    /// Lowers it where corners of facets are blocked.
    pub fn record_visible_flux(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        self.record_over_pairs(recorder, scene, &self.visible_flux);
    }

    /// Adds it up.
    pub fn record_total_flux(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        let receiver_count = scene.receivers.planar_count;
        let push = TotalPush {
            pair_count: pairs(scene),
            receiver_count,
        };
        let threads = [receiver_count * SPLAT_GROUP, 1, 1];
        recorder.dispatch(&self.total_flux, &push, threads);
    }

    /// Estimates the error of every receiver for every level of patch shares.
    pub fn record_facet_error(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        let push = self.push(scene, 0);
        let blocks = pairs(scene).div_ceil(SPLAT_GROUP);
        let sums = blocks * scene.receivers.planar_count * SHARE_LEVELS;
        recorder.dispatch(&self.facet_error, &push, threads(sums));
    }

    /// Chooses the patch share of every receiver.
    pub fn record_choose_share(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        let push = self.push(scene, 0);
        let threads = [scene.receivers.planar_count * SPLAT_GROUP, 1, 1];
        recorder.dispatch(&self.choose_share, &push, threads);
    }

    /// Divides the facets into patches.
    pub fn record_facet_count(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        self.record_over_pairs(recorder, scene, &self.facet_count);
    }

    /// Numbers the patches within blocks.
    pub fn record_number_patches(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        self.patch_sums.record_number(recorder, pairs(scene));
    }

    /// Numbers the blocks.
    pub fn record_scan_patches(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        self.patch_sums
            .record_scan(recorder, pairs(scene), [0, self.batch]);
    }

    /// Traces rays from the corners of the facets.
    pub fn record_trace_facets(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        let push = self.push(scene, 0);
        let [_, corner_count] = scene.facets.corners();
        let corners = corner_count * scene.lights.part_count;
        recorder.dispatch(&self.trace_corners, &push, threads(corners));
    }

    /// Traces rays from the corners of the patches of divided facets.
    pub fn record_trace_patches(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        let push = FacetPush {
            is_lattice: 1,
            ..self.push(scene, 0)
        };
        recorder.dispatch_indirect(&self.trace_corners, &push, &self.patch_totals, 1);
    }

    /// Chooses the triangles of every patch.
    pub fn record_patch_count(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        let push = self.push(scene, 0);
        recorder.dispatch_indirect(&self.patch_count, &push, &self.patch_totals, 0);
    }

    /// Numbers the triangles within blocks of patches.
    pub fn record_number_triangles(&self, recorder: &mut Recorder) {
        self.splat_sums.record_number(recorder, self.patch_capacity);
    }

    /// Numbers the blocks.
    pub fn record_scan_triangles(&self, recorder: &mut Recorder) {
        (self.splat_sums).record_scan(recorder, self.patch_capacity, [self.batches, self.batch]);
    }

    /// Writes the triangles of a batch.
    pub fn record_project(&self, recorder: &mut Recorder, scene: &DeviceScene, batch: u32) {
        let push = self.push(scene, batch * self.batch);
        let arguments = (batch + 1) * ARGUMENT_WORDS / 3;
        recorder.dispatch_indirect(&self.project, &push, &self.splat_totals, arguments);
    }

    /// Draws the triangles of a batch into the light maps; `clear` clears the maps first.
    pub fn record_splat(
        &self,
        recorder: &mut Recorder,
        light_map: &Image,
        batch: u32,
        clear: bool,
    ) {
        let push = draw_push(light_map);
        recorder.draw_vertices(&self.draw, light_map, clear, &push, self.vertices(batch));
    }

    /// The quads of a batch of triangles.
    pub fn vertices(&self, batch: u32) -> Vertices<'_> {
        Vertices::Indexed {
            indices: &self.quads,
            arguments: &self.splat_totals,
            offset: 4 * u64::from((batch + 1) * ARGUMENT_WORDS + BATCH_DRAW_WORD),
        }
    }
}

fn pairs(scene: &DeviceScene) -> u32 {
    let [_, facet_count] = scene.facets.facets();
    facet_count * scene.lights.part_count
}
