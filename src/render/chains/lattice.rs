//! Lattices of rays from the suns, lamps and environment cells to the casters, the first rays of chains. The host chooses
//! them for every frame from the casters' bounding boxes.

use crate::error::{Error, Result};
use crate::gpu::{Buffer, Context, Staging};
use crate::render::bodies::Bodies;
use crate::render::environment::cell::EnvironmentCell;
use crate::render::environment::cells::subdivide;
use crate::render::geometry::occlusion::{MAX_PAIRS_IN_A_FRAME, is_affine_image, is_convex};
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::constants::{MAX_BANDS, MAX_RAYS};
use crate::render::gpu_types::{ChainLattice, Light};
use crate::render::light_parts::{part_count, split};
use crate::render::lights::EnvironmentLight;
use crate::render::settings::{Method, Settings};
use crate::render::spectrum::Coordinate;
use crate::scene::{LightKind, MaterialKind, Mesh, Object, Scene};
use glam::{DQuat, DVec2, DVec3, Vec2};
use std::ops::Range;
use std::sync::Arc;

/// Number of rays of a lattice for an error of 2 % of its own light, if all of them land. The error falls with the square root of their
/// number (measured on glass balls and a tumbler).
const RAYS_AT_2_PERCENT: f64 = 16_384.0;
/// Minimum and maximum number of rays of a lattice.
const RAYS: [f64; 2] = [1024.0, 262_144.0];
/// Number of rays of all lattices over the maximum number of one lattice, at most: the shares of light add up to 1, and a lattice
/// of a small share needs few.
const RAYS_OF_ALL: f64 = 2.25;
/// Number of rays before refinement: of all lattices, about, of which every group has the same share; and at least of one. A part of the
/// light that is not met by these rays is not looked for among the others as closely.
const PILOT_RAYS: f64 = 4096.0;
const MIN_PILOT_RAYS: f64 = 32.0;
/// Maximum number of pairs of face and vertex that are compared to find whether a caster is convex.
const MAX_PAIRS: usize = 1 << 24;
/// Maximum number of lattices of a lamp to a caster.
const FACES: u32 = 6;

/// Number of cells of an environment over the root of the number of rays of a lattice: with an error to aim for, where lattices may get more
/// rays than that, and with a number of samples. Directions and places of the rays are refined alike by it. On glass balls, mirrors and
/// irregular meshes, 512 cells at the default error and 256 at 16 384 samples gave the least error of 64 to 512, for about the same rays.
const CELLS_FOR_ERROR: f64 = 4.0;
const CELLS_FOR_SAMPLES: f64 = 2.0;
/// Its minimum and maximum.
const ENVIRONMENT_CELLS: [usize; 2] = [64, 1024];
/// Maximum number of lattices of an environment to all casters beyond that minimum.
const ENVIRONMENT_LATTICES: usize = 2048;

pub struct DeviceLattices {
    /// Suns and lamps, or the parts of wide ones, then the environment's cells.
    pub lights: Buffer,
    cells: Vec<EnvironmentCell>,
    /// Number of the environment's cells.
    cell_count: usize,
    pub buffer: Buffer,
    pub count: u32,
    /// Maximum number of lattices.
    pub capacity: u32,
    /// Number of rays before refinement, and its maximum.
    pub pilot_count: u32,
    pub pilot_capacity: u32,
    /// Maximum number of rays of a frame. A blocking frame that needs more is repeated.
    pub ray_capacity: u32,
    /// Upper bound of the flux of all rays in any channel, W.
    pub flux: f64,
    /// Whether there may be light of chains.
    pub may_chain: bool,
    /// Whether lattices follow it.
    pub is_needed: bool,
    /// The mesh of the only caster, where there is no light of chains because it is convex or flat.
    convex: Option<Arc<Mesh>>,
}

impl DeviceLattices {
    /// Allocates for the suns, lamps and environment cells of a scene. `rings` are those of parts of each sun and lamp.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if device memory is insufficient.
    pub fn new(
        context: &Arc<Context>,
        scene: &Scene,
        rings: &[u32],
        settings: &Settings,
    ) -> Result<Self> {
        let may_chain = may_chain(scene);
        let is_needed = may_chain && settings.method == Method::Footprint;
        let casters = (scene.objects.iter()).filter(|object| starts_chains(scene, object));
        let casters = if is_needed { casters.count() } else { 0 };
        let cell_count = environment_cells(settings, casters);
        let casting = (scene.lights.iter()).filter(|light| light.kind.casts_caustics());
        let mut rings = rings.iter();
        let mut parts = || part_count(*rings.next().expect("every sun and lamp has them"));
        // Numbers of lights and of lattices to a caster.
        let numbers: Vec<[u32; 2]> = casting
            .map(|light| match light.kind {
                LightKind::Environment { .. } => [cell_count as u32; 2],
                LightKind::Sun { .. } => [parts(); 2],
                LightKind::Lamp { .. } => {
                    let parts = parts();
                    [parts, FACES * parts]
                }
            })
            .collect();
        let lights: u32 = numbers.iter().map(|[lights, _]| lights).sum();
        let groups = numbers.len() * casters;
        let of_each = |of: &dyn Fn(u32) -> u32| {
            casters as u32
                * numbers
                    .iter()
                    .map(|&[_, lattices]| of(lattices))
                    .sum::<u32>()
        };
        let capacity = of_each(&|lattices| lattices);
        let bytes = u64::from(capacity.max(1)) * size_of::<ChainLattice>() as u64;
        let rays = rays_of_lattice(settings);
        // Rows and columns are rounded.
        let pilot_capacity =
            of_each(&|lattices| 2 * lattices * pilot_rays(groups, lattices as usize) as u32);
        let of_all = match Coordinate::of(scene) {
            None => RAYS_OF_ALL * rays,
            Some(_) => {
                let of_bands = RAYS_OF_ALL * rays * f64::from(MAX_BANDS);
                of_bands.min(MAX_RAYS.into())
            }
        };
        let light_bytes = u64::from(lights.max(1)) * size_of::<Light>() as u64;
        Ok(Self {
            lights: Buffer::new(context, "lights of chains", light_bytes)?,
            cells: Vec::new(),
            cell_count,
            buffer: Buffer::new(context, "lattices", bytes)?,
            count: 0,
            capacity,
            pilot_count: 0,
            pilot_capacity,
            ray_capacity: pilot_capacity.max(of_all as u32),
            flux: 0.0,
            may_chain,
            is_needed,
            convex: (only_caster(scene).filter(|_| !may_chain && scene.max_interfaces > 1))
                .and_then(|only| only.geometry.placement())
                .map(|(mesh, _)| mesh.clone()),
        })
    }

    /// Checks that there still is no light of chains in `scene` where there was none and so no room for it.
    ///
    /// # Errors
    /// [`Error::Usage`] where a mirror that was convex or an interface that was flat may not be so any more.
    pub fn check(&self, scene: &Scene) -> Result<()> {
        let (Some(known), Some(only)) = (&self.convex, only_caster(scene)) else {
            return Ok(());
        };
        let Some((mesh, _)) = only.geometry.placement() else {
            return Ok(());
        };
        let is_known = Arc::ptr_eq(known, mesh) || is_affine_image(known, mesh);
        if is_known || is_convex(mesh, refracts(scene, only), MAX_PAIRS_IN_A_FRAME) {
            return Ok(());
        }
        Err(Error::Usage {
            reason: format!(
                "the scene is another than before: light may now meet object `{}` several times",
                only.name
            ),
            remedy: "make a new renderer for it".into(),
        })
    }

    /// Whether chains draw the light that an object refracts even where it then lands, since it disperses it.
    pub fn disperses_at(&self, scene: &Scene, object: usize) -> bool {
        self.is_needed && disperses(scene, &scene.objects[object])
    }

    /// Chooses and stages the lattices. `lights` are the scene's suns and lamps, and `rings` those of their parts; `is_another`: the
    /// environment has another map than before.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    #[allow(clippy::too_many_arguments)] // one call
    pub fn update(
        &mut self,
        staging: &mut Staging,
        scene: &Scene,
        store: &TriangleStore,
        bodies: &Bodies,
        scene_lights: &[Light],
        rings: &[u32],
        is_another: bool,
        settings: &Settings,
    ) -> Result<()> {
        if !self.is_needed {
            return Ok(());
        }
        let mut lights = Vec::new();
        // Parts of a light, and the environment's cells, are planned together: one of them has too few rays to tell whether its light chains.
        let mut groups_of_lights: Vec<Range<u32>> = Vec::new();
        for (light, &rings) in scene_lights.iter().zip(rings) {
            let first = lights.len() as u32;
            lights.extend(split(light, rings));
            groups_of_lights.push(first..lights.len() as u32);
        }
        let environment = EnvironmentLight::of(scene)?.filter(|light| light.casts_caustics);
        if let Some(environment) = environment {
            if is_another {
                let subdivision = subdivide(environment.map, &[self.cell_count]);
                let cells = subdivision.rects[0].iter();
                self.cells = cells.map(|rect| subdivision.cell(rect)).collect();
            }
            let light =
                |cell: &EnvironmentCell| cell.light(environment.scale, environment.rotation);
            let first = lights.len() as u32;
            lights.extend(self.cells.iter().map(light));
            groups_of_lights.push(first..lights.len() as u32);
        }
        staging.write(&self.lights, 0, &lights)?;
        let casters: Vec<(u32, [DVec3; 2])> = (scene.objects.iter().zip(0..))
            .filter(|(object, _)| starts_chains(scene, object))
            .map(|(_, index)| {
                let bounds = bodies.bounds[index as usize];
                (index, bounds.map(|corner| corner - store.origin))
            })
            .collect();
        let windows = |light: u32, bounds| match &lights[light as usize] {
            sun if sun.is_lamp == 0 => vec![of_sun(sun, bounds, bodies.size())],
            lamp => of_lamp(lamp, bounds),
        };
        let groups: Vec<Group> = (casters.iter())
            .flat_map(|&(object, bounds)| {
                groups_of_lights.iter().map(move |lights| Group {
                    object,
                    windows: (lights.clone())
                        .flat_map(|light| {
                            windows(light, bounds).into_iter().map(move |w| (light, w))
                        })
                        .collect(),
                })
            })
            .collect();
        let windows = || groups.iter().flat_map(|group| &group.windows);
        let flux = |(light, window): &(u32, Window)| {
            // A lamp's windows are at a distance of at least 1 m: their areas are above their solid angles.
            f64::from(lights[*light as usize].power.max_element()) * window.area()
        };
        self.flux = windows().map(flux).sum();
        let rays = rays_of_lattice(settings);
        let group_count = groups.len();
        let mut first = 0;
        let mut lattices = Vec::new();
        for Group { object, windows } in groups {
            let group_size = windows.len() as u32;
            let first_light = windows.first().map_or(0, |(light, _)| *light);
            let pilot = pilot_rays(group_count, windows.len());
            let refinements = (0.5 * (rays / pilot).log2()).ceil().max(0.0) as u32;
            for (light, window) in windows {
                let (columns, rows) =
                    window.columns_and_rows(pilot.max(rays * 0.25f64.powi(refinements as i32)));
                let edge_u = window.edge_u / f64::from(columns);
                let edge_v = window.edge_v / f64::from(rows);
                lattices.push(ChainLattice {
                    origin: window.origin.as_vec3(),
                    first,
                    edge_u: edge_u.as_vec3(),
                    columns,
                    edge_v: edge_v.as_vec3(),
                    object,
                    direction: window.direction.as_vec3(),
                    light,
                    rows,
                    refinements,
                    group_size,
                    middle: window.middle as f32,
                    shift: shift_of(light - first_light).as_vec2(),
                    unused: Vec2::ZERO,
                });
                first += columns * rows;
            }
        }
        self.count = lattices.len() as u32;
        self.pilot_count = first;
        match lattices.is_empty() {
            true => Ok(()),
            false => staging.write(&self.buffer, 0, &lattices),
        }
    }
}

/// Whether an object refracts and disperses light, and chains may start there.
fn disperses(scene: &Scene, object: &Object) -> bool {
    object.blocks_light && (scene.materials[object.material].kind.dispersion()).is_some()
}

/// Number of rays before refinement of each of the `lattices` of one of `groups`, about.
fn pilot_rays(groups: usize, lattices: usize) -> f64 {
    (PILOT_RAYS / (groups * lattices).max(1) as f64).max(MIN_PILOT_RAYS)
}

/// Number of cells of an environment whose light a number of casters throw.
fn environment_cells(settings: &Settings, casters: usize) -> usize {
    let of_rays = match settings.error {
        Some(_) => CELLS_FOR_ERROR,
        None => CELLS_FOR_SAMPLES,
    };
    let cells = (of_rays * rays_of_lattice(settings).sqrt()) as usize;
    let [fewest, most] = ENVIRONMENT_CELLS;
    cells
        .clamp(fewest, most)
        .min((ENVIRONMENT_LATTICES / casters.max(1)).max(fewest))
}

/// Maximum number of rays of a lattice.
fn rays_of_lattice(settings: &Settings) -> f64 {
    let rays = match settings.error {
        Some(error) => RAYS_AT_2_PERCENT * (0.02 / f64::from(error)).powi(2),
        None => settings.samples.into(),
    };
    rays.clamp(RAYS[0], RAYS[1])
}

/// Whether chains start at an object. An object that casts no shadow does not stop their rays.
fn starts_chains(scene: &Scene, object: &Object) -> bool {
    object.blocks_light && scene.materials[object.material].kind.is_specular()
}

/// Whether there may be light of chains: that of several surfaces, and that which a surface disperses. Light that left a specular
/// surface cannot meet another one if there is but one object, which is flat, a convex mirror, or waves, whose slopes are small.
fn may_chain(scene: &Scene) -> bool {
    if (scene.objects.iter()).any(|object| disperses(scene, object)) {
        return true;
    }
    if scene.max_interfaces < 2 {
        return false;
    }
    match only_caster(scene) {
        None => (scene.objects.iter()).any(|object| starts_chains(scene, object)),
        Some(only) => (only.geometry.placement())
            .is_some_and(|(mesh, _)| !is_convex(mesh, refracts(scene, only), MAX_PAIRS)),
    }
}

/// The object where chains start, if there is but one.
fn only_caster(scene: &Scene) -> Option<&Object> {
    let mut casters = (scene.objects.iter()).filter(|object| starts_chains(scene, object));
    casters.next().filter(|_| casters.next().is_none())
}

fn refracts(scene: &Scene, object: &Object) -> bool {
    matches!(
        scene.materials[object.material].kind,
        MaterialKind::Dielectric(_)
    )
}

/// Lattices that are planned as one: of a light, or of all cells of the environment, to an object.
struct Group {
    object: u32,
    /// With the numbers of their lights.
    windows: Vec<(u32, Window)>,
}

/// By which the rays of a lattice of a group are shifted, in cells, for the number of its light in the group. The rays of each light pass
/// their cells at another place, so that errors which a coarse lattice makes at the outline of a caster cancel over the group. The places
/// are those of the additive recurrence R2 (Roberts, *The unreasonable effectiveness of quasirandom sequences*, 2018) from `WITHIN_CELL` on
/// (`lattice_ray.glsl`).
fn shift_of(number: u32) -> DVec2 {
    const WITHIN_CELL: DVec2 = DVec2::new(0.4716, 0.5387);
    const STEP: DVec2 = DVec2::new(0.754_877_666_246_692_8, 0.569_840_290_998_053_3);
    (WITHIN_CELL + f64::from(number) * STEP).fract() - WITHIN_CELL
}

/// A rectangle of rays: origin + u edge_u + v edge_v, u and v from 0 to 1.
struct Window {
    origin: DVec3,
    edge_u: DVec3,
    edge_v: DVec3,
    /// For a sun: direction of the rays.
    direction: DVec3,
    /// Distance from the rays' starts to the middle of the caster, m.
    middle: f64,
}

impl Window {
    fn area(&self) -> f64 {
        self.edge_u.cross(self.edge_v).length()
    }

    /// Columns and rows of about `rays` square cells.
    fn columns_and_rows(&self, rays: f64) -> (u32, u32) {
        let cell = (self.area() / rays).sqrt();
        // A window that is narrower than a cell still has one row.
        let count = |edge: DVec3| (edge.length() / cell).round().clamp(1.0, rays) as u32;
        (count(self.edge_u), count(self.edge_v))
    }
}

/// The box around a caster, seen from a sun. Rays start in front of a scene of the size `size`.
fn of_sun(light: &Light, bounds: [DVec3; 2], size: f64) -> Window {
    let toward = light.place.as_dvec3().normalize();
    let (u, v) = toward.any_orthonormal_pair();
    let [low, high] = bounds;
    let range = |axis: DVec3| {
        let (middle, reach) = (0.5 * axis.dot(low + high), 0.5 * axis.abs().dot(high - low));
        [middle - reach, middle + reach]
    };
    let ([u0, u1], [v0, v1], [behind, ahead]) = (range(u), range(v), range(toward));
    // The rays of the pieces of a disc meet at the depth of the caster's middle. Cells of an environment have no pieces.
    let depth = 0.5 * (ahead - behind);
    let beside = match light.half_azimuth > 0.0 {
        true => 0.0,
        false => 2.0 * depth * f64::from(light.axis1.length().max(light.axis2.length())),
    };
    let [u0, v0] = [u0, v0].map(|low| low - beside);
    let [u1, v1] = [u1, v1].map(|high| high + beside);
    Window {
        origin: u0 * u + v0 * v + (ahead + size) * toward,
        edge_u: (u1 - u0) * u,
        edge_v: (v1 - v0) * v,
        direction: -toward,
        middle: size + depth,
    }
}

/// The sphere around a caster, seen from a lamp or a part of it: a square, or a cube where the lamp is within the sphere or close to it.
/// A window's rays start beside the middle of the lamp by the place of the part on its disc, which faces along them (`start_along()`): in
/// the directions of a right-handed system whose first axis is that of the window.
fn of_lamp(light: &Light, [low, high]: [DVec3; 2]) -> Vec<Window> {
    /// Largest sine of the half angle at which the caster is seen through one square.
    const MAX_SINE: f64 = 0.8;
    let place = light.place.as_dvec3();
    let way = 0.5 * (low + high) - place;
    let distance = way.length();
    let radius = 0.5 * low.distance(high);
    let square = |[ahead, u, v]: [DVec3; 3], half: f64| Window {
        origin: place + ahead - half * (u + v),
        edge_u: 2.0 * half * u,
        edge_v: 2.0 * half * v,
        direction: DVec3::ZERO,
        middle: distance.max(radius),
    };
    let axes = |ahead: DVec3| {
        let (u, v) = ahead.any_orthonormal_pair();
        [ahead, u, v]
    };
    let [ahead, u, v] = axes(way.normalize_or(DVec3::Z));
    // Toward the part on the disc that faces the caster's middle, and the sine of the angle between the disc's middle and the part.
    let [x, y, z] = light.axis1.as_dvec3().to_array();
    let aside = x * u + y * v;
    let reach = f64::from(light.size) * aside.length();
    let sine = radius / (distance - reach);
    if sine > 0.0 && sine < MAX_SINE {
        let turn = match reach > 0.0 {
            true => {
                DQuat::from_axis_angle(ahead.cross(aside).normalize(), -(reach / distance).asin())
            }
            false => DQuat::IDENTITY,
        };
        // Rays beside the middle one start before or behind it, on the sphere around the lamp.
        let sine = sine * (1.0 + 0.5 * reach / (distance - reach) * sine);
        let half = sine / (1.0 - sine * sine).max(1e-3).sqrt();
        // The rays of the pieces of the disc meet at the distance of the caster's middle.
        let disc = f64::from(light.size) * if z > 0.0 { z } else { 1.0 };
        let half = half + disc / distance * sine;
        return vec![square([ahead, u, v].map(|axis| turn * axis), half)];
    }
    [DVec3::X, DVec3::Y, DVec3::Z]
        .into_iter()
        .flat_map(|axis| [axis, -axis])
        .map(|axis| square(axes(axis), 1.0))
        .collect()
}
