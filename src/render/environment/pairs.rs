//! Pairs environment cells with levels of patch clusters.
//!
//! Every cell is projected by all patches of one level of the casters' clusters; bright cells get small patches. A
//! footprint displaces light by the widths of its cell and its patch. Among all ways to spend the budget of pairs, the
//! one with the smallest total displacement is chosen. A sun in the environment is projected by the same patches as
//! other suns.
//!
//! Halving cells and patches pair by pair, always where that narrows the footprints most, gave worse results: the sum
//! of the footprints is uneven where sizes change.

use crate::error::{Error, Result};
use crate::gpu::{Buffer, Context, Staging};
use crate::render::environment::cell::EnvironmentCell;
use crate::render::environment::cells::{CellRect, flux, subdivide};
use crate::render::geometry::device::DeviceGeometry;
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::Light;
use crate::render::lights::{EnvironmentLight, MAX_ENVIRONMENT_SUNS};
use crate::render::patches::clusters::{PatchClusters, Selection};
use crate::render::settings::Settings;
use crate::scene::{Geometry, Object, Scene, memory};
use glam::{DVec3, UVec2, Vec3};
use std::sync::Arc;

/// Minimum share of all flux for a cell that counts as a sun.
const MIN_SUN_SHARE: f64 = 0.01;
/// Patches of the coarsest level, and the factor from one level to the next.
const MIN_PATCHES: usize = 16;
const PATCH_FACTOR: usize = 2;
/// Maximum variance of a sun, both axes together, rad²: that of a disc with a radius of 3°.
const MAX_SUN_VARIANCE: f64 = 0.052 * 0.052 / 2.0;
/// Weight of the displacement by a cell's width relative to that by a patch's width. Unoccluded: cells are pinhole
/// images with sharp edges. Occluded: visibility is tested once for a whole cell. Meshes: cells are kernels as wide as
/// themselves. With 0.5, 0.7 and 1, L1 with 16 k samples was 5.1, 5.0, 5.0 % on `table`, 3.9, 4.1, 4.1 % on the ring
/// under windows, 5.9, 5.9, 3.9 % under an environment with a sun, but 2.8, 2.8, 3.6 % there with 64 k.
const WEIGHT_UNOCCLUDED: f64 = 0.4;
const WEIGHT_OCCLUDED: f64 = 0.7;
const WEIGHT_MESHES: f64 = 8.0;
/// Minimum number of cells, and the factor to the next number that is tried.
const MIN_CELLS: usize = 8;
const CELL_FACTOR: usize = 2;
/// Minimum share of the environment in the budget of pairs, because lights may change.
const MIN_SHARE: f64 = 1.0 / 16.0;
/// Maximum memory per pair, bytes, measured with one and four million samples.
const PAIR_BYTES: u64 = 400;

/// The environment as pairs of cell and patch cluster.
pub struct CellPatchPairs {
    pub lights: Buffer,
    pub patches: Buffer,
    /// Places on the patches where rays start.
    pub starts: Buffer,
    pub patch_count: u32,
    /// Patch and cell of each pair.
    pub pairs: Buffer,
    pub pair_count: u32,
    /// Cells that are as bright and small as a sun, at most [`MAX_ENVIRONMENT_SUNS`].
    suns: Vec<EnvironmentCell>,
    cells: Vec<EnvironmentCell>,
    clusters: PatchClusters,
    /// The patches in use.
    selection: Selection,
}

impl CellPatchPairs {
    /// Chooses about as many pairs as the settings ask for: `environment_images` for every sample, times the environment's
    /// share of the light beside `suns`, so that both are equally accurate.
    ///
    /// # Errors
    /// [`Error::Usage`] if host memory is insufficient, [`Error::Device`] if device memory is insufficient.
    pub fn new(
        context: &Arc<Context>,
        staging: &mut Staging,
        scene: &Scene,
        geometry: &DeviceGeometry,
        environment: &EnvironmentLight,
        suns: &[Light],
        settings: &Settings,
    ) -> Result<Self> {
        let store = &geometry.store;
        let weight = match geometry.can_occlude {
            _ if lights_meshes(scene) => WEIGHT_MESHES,
            true => WEIGHT_OCCLUDED,
            false => WEIGHT_UNOCCLUDED,
        };
        let share = share_of(environment, suns, scene, store.origin).max(MIN_SHARE);
        let budget = (f64::from(settings.samples) * f64::from(settings.environment_images) * share)
            .ceil() as usize;
        let what = format!("{budget} images of environment cells");
        memory::check(&what, PAIR_BYTES * budget as u64).map_err(|reason| Error::Usage {
            reason,
            remedy: "free some memory, or ask for fewer samples or fewer images for each".into(),
        })?;
        let steps = |first: usize, factor: usize| {
            std::iter::successors(Some(first), move |count| Some(count * factor))
        };
        let counts: Vec<usize> = steps(MIN_PATCHES, PATCH_FACTOR)
            .take_while(|&patches| patches == MIN_PATCHES || patches <= budget / MIN_CELLS)
            .collect();
        let distance = distance(scene);
        // Every object has patches of its own.
        let min_patches = MIN_PATCHES.max(scene.specular_objects().count());
        let max_cells = (settings.environment_cells as usize)
            .min(budget / min_patches)
            .max(MIN_CELLS);
        let cell_counts: Vec<usize> = steps(MIN_CELLS, CELL_FACTOR)
            .take_while(|&cells| cells < max_cells)
            .chain([max_cells])
            .collect();
        let clusters = PatchClusters::new(scene, store, &counts, distance);
        let sizes: Vec<usize> = (0..counts.len())
            .map(|level| clusters.count(level))
            .collect();
        let variances = clusters.variances(store, distance);
        let finest = (variances[variances.len() - 1] / (distance * distance)).min(MAX_SUN_VARIANCE);
        let subdivision = subdivide(environment.map, &cell_counts);
        let (suns, rects, chosen) = (subdivision.rects.iter())
            .map(|rects| {
                let (suns, rects) = separate_suns(rects.clone(), finest);
                let chosen = choose_levels(&rects, &sizes, &variances, distance, weight, budget);
                (suns, rects, chosen)
            })
            .min_by(|(_, _, a), (_, _, b)| a.width.total_cmp(&b.width))
            .expect("there are counts");
        let cells_of = |rects: &[CellRect]| -> Vec<EnvironmentCell> {
            (rects.iter()).map(|rect| subdivision.cell(rect)).collect()
        };
        let (suns, cells) = (cells_of(&suns), cells_of(&rects));
        let used = chosen.levels.iter().max().map_or(0, |finest| finest + 1);
        // Fewer subtriangles suffice if the finest levels are not in use.
        let clusters = match used == counts.len() {
            true => clusters,
            false => PatchClusters::new(scene, store, &counts[..used], distance),
        };
        let mut levels = Vec::new();
        let mut pairs = Vec::new();
        let mut first_patch = 0;
        for level in (0..used).filter(|level| chosen.levels.contains(level)) {
            let patches = clusters.count(level) as u32;
            for cell in (0..cells.len()).filter(|&cell| chosen.levels[cell] == level) {
                let of_cell = first_patch..first_patch + patches;
                pairs.extend(of_cell.map(|patch| UVec2::new(patch, cell as u32)));
            }
            levels.push(level);
            first_patch += patches;
        }
        let lights = lights_of(&cells, environment);
        let (selection, patches) = clusters.select(store, levels);
        let starts = clusters.starts(store, &selection);
        let buffer = |name, bytes: usize| Buffer::new(context, name, bytes as u64);
        let new = Self {
            lights: buffer("environment cells", size_of_val(&*lights))?,
            patches: buffer("patch clusters", size_of_val(&*patches))?,
            starts: buffer("starts of rays", size_of_val(&*starts))?,
            patch_count: patches.len() as u32,
            pairs: buffer("pairs", size_of_val(&*pairs))?,
            pair_count: pairs.len() as u32,
            suns,
            cells,
            clusters,
            selection,
        };
        staging.write(&new.lights, 0, &lights)?;
        staging.write(&new.patches, 0, &patches)?;
        staging.write(&new.starts, 0, &starts)?;
        staging.write(&new.pairs, 0, &pairs)?;
        Ok(new)
    }

    /// Number of cells, without those that act as suns.
    pub fn cell_count(&self) -> u32 {
        self.cells.len() as u32
    }

    /// Writes the cells for the present rotation and scale, and the patch clusters where a caster has moved.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn update(
        &self,
        staging: &mut Staging,
        store: &TriangleStore,
        environment: &EnvironmentLight,
        has_moved: bool,
    ) -> Result<()> {
        staging.write(&self.lights, 0, &lights_of(&self.cells, environment))?;
        if has_moved {
            let patches = self.clusters.patches(store, &self.selection);
            staging.write(&self.patches, 0, &patches)?;
            let starts = self.clusters.starts(store, &self.selection);
            staging.write(&self.starts, 0, &starts)?;
        }
        Ok(())
    }

    /// The cells that act as suns, for the present rotation and scale.
    pub fn suns_of(&self, environment: &EnvironmentLight) -> Vec<Light> {
        (self.suns.iter())
            .map(|sun| sun.sun(environment.scale, environment.rotation))
            .collect()
    }
}

fn lights_of(cells: &[EnvironmentCell], environment: &EnvironmentLight) -> Vec<Light> {
    (cells.iter())
        .map(|cell| cell.light(environment.scale, environment.rotation))
        .collect()
}

/// Whether a receiver is a mesh. On meshes, cells are kernels.
fn lights_meshes(scene: &Scene) -> bool {
    (scene.objects.iter())
        .any(|object| object.light_map.is_some() && !matches!(object.geometry, Geometry::Rect(_)))
}

/// Centre and radius of the sphere around an object's bounding box, m.
fn sphere_around(object: &Object) -> (DVec3, f64) {
    let [low, high] = object.geometry.bounds();
    (0.5 * (low + high), 0.5 * low.distance(high))
}

/// Typical distance that light travels from the casters to the receivers, m: the mean distance between their centres.
fn distance(scene: &Scene) -> f64 {
    let middle = |object: &Object| sphere_around(object).0;
    let casters: Vec<DVec3> = scene.specular_objects().map(|(_, o)| middle(o)).collect();
    let receivers: Vec<DVec3> = (scene.objects.iter())
        .filter(|object| object.light_map.is_some())
        .map(middle)
        .collect();
    let distances: Vec<f64> = (casters.iter())
        .flat_map(|a| receivers.iter().map(|b| a.distance(*b)))
        .collect();
    distances.iter().sum::<f64>() / distances.len().max(1) as f64
}

/// The environment's share of the light that reaches the casters, all channels and directions together. A lamp is
/// evaluated at the casters' centres, at a distance of at least half a diagonal.
fn share_of(environment: &EnvironmentLight, suns: &[Light], scene: &Scene, origin: DVec3) -> f64 {
    let spheres: Vec<(Vec3, f32)> = (scene.specular_objects())
        .map(|(_, object)| {
            let (middle, radius) = sphere_around(object);
            ((middle - origin).as_vec3(), (radius * radius) as f32)
        })
        .collect();
    let irradiance = |sun: &Light| -> f64 {
        let falloff = |(x, near): &(Vec3, f32)| match sun.is_lamp {
            0 => 1.0,
            _ => 1.0 / sun.place.distance_squared(*x).max(*near),
        };
        let falloffs: f32 = spheres.iter().map(falloff).sum();
        f64::from(sun.power.element_sum() * falloffs) / spheres.len() as f64
    };
    let others: f64 = suns.iter().map(irradiance).sum();
    let of_environment = f64::from(environment.scale) * flux(environment.map);
    match of_environment + others {
        0.0 => 1.0,
        all => of_environment / all,
    }
}

/// Separates the suns from the other cells: rects that are bright and whose variance, both axes together, is below
/// `variance`, the blur of the smallest patches.
fn separate_suns(mut rects: Vec<CellRect>, variance: f64) -> (Vec<CellRect>, Vec<CellRect>) {
    let total: f64 = rects.iter().map(|rect| rect.flux).sum();
    rects.sort_by(|a, b| b.flux.total_cmp(&a.flux));
    let (mut suns, mut others) = (Vec::new(), Vec::new());
    for rect in rects {
        let is_sun = rect.flux > MIN_SUN_SHARE * total && rect.variance < variance;
        if is_sun && suns.len() < MAX_ENVIRONMENT_SUNS {
            suns.push(rect);
        } else {
            others.push(rect);
        }
    }
    (suns, others)
}

struct ChosenLevels {
    /// Per cell: the level that projects it.
    levels: Vec<usize>,
    /// Sum of the displacement of light, weighted by flux.
    width: f64,
}

/// Chooses for every cell the level of the casters' clusters that minimises the displacement of light, within `budget`
/// pairs. `sizes` and `variances` are the levels' numbers of patches and their variances, m².
fn choose_levels(
    rects: &[CellRect],
    sizes: &[usize],
    variances: &[f64],
    distance: f64,
    weight: f64,
    budget: usize,
) -> ChosenLevels {
    let width = |rect: &CellRect, level: usize| {
        weight * distance * rect.error + rect.flux * variances[level].sqrt()
    };
    // Lagrange multipliers: `price` is the cost of a pair.
    let at = |price: f64| -> Vec<usize> {
        (rects.iter())
            .map(|rect| {
                let cost = |level: usize| width(rect, level) + price * sizes[level] as f64;
                (0..sizes.len())
                    .min_by(|&a, &b| cost(a).total_cmp(&cost(b)))
                    .unwrap_or(0)
            })
            .collect()
    };
    let pairs = |levels: &[usize]| levels.iter().map(|&d| sizes[d]).sum::<usize>();
    let total: f64 = rects.iter().map(|rect| width(rect, 0)).sum();
    // Bisection on the logarithm, from a price of almost nothing to one above every benefit.
    let (mut low, mut high) = ((total * 1e-18).ln(), (total * 1e3 + f64::MIN_POSITIVE).ln());
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if pairs(&at(middle.exp())) > budget {
            low = middle;
        } else {
            high = middle;
        }
    }
    let levels = at(high.exp());
    let sum = (rects.iter().zip(&levels)).map(|(rect, &level)| width(rect, level));
    ChosenLevels {
        width: sum.sum(),
        levels,
    }
}
