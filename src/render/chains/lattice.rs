//! Lattices of rays from the suns and lamps to the casters, the first rays of chains. Chosen on the host for every frame
//! from the casters' bounding boxes.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Staging};
use crate::render::geometry::occlusion::is_convex;
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::{ChainLattice, Light};
use crate::render::settings::{Method, Settings};
use crate::scene::{Geometry, MaterialKind, Object, Scene};
use glam::DVec3;
use std::sync::Arc;

/// Number of rays for an error of 2 %. The error falls with the square root of their number (measured on glass balls and a tumbler).
const RAYS_AT_2_PERCENT: f64 = 16_384.0;
/// Minimum and maximum number of rays of a sun or lamp.
const RAYS: [f64; 2] = [1024.0, 1_048_576.0];
/// Minimum share of a caster in the rays of a sun or lamp.
const LEAST_SHARE: f64 = 1.0 / 64.0;
/// Maximum number of pairs of face and vertex that are compared to find whether a caster is convex.
const MAX_PAIRS: usize = 1 << 24;
/// Maximum number of lattices of a lamp to a caster.
const FACES: u32 = 6;

pub struct DeviceLattices {
    pub buffer: Buffer,
    pub count: u32,
    /// Number of rays.
    pub ray_count: u32,
    /// Maximum number of rays of a frame.
    pub ray_capacity: u32,
    /// Whether chains are followed.
    pub is_needed: bool,
    /// The casters' bounding boxes, m; `None` for other objects.
    bounds: Vec<Option<[DVec3; 2]>>,
}

impl DeviceLattices {
    /// Allocates for `light_count` suns and lamps.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if device memory is insufficient.
    pub fn new(
        context: &Arc<Context>,
        scene: &Scene,
        light_count: u32,
        settings: &Settings,
    ) -> Result<Self> {
        let is_needed = settings.method == Method::Footprint && may_chain(scene);
        let casters = (scene.objects.iter()).filter(|object| starts_chains(scene, object));
        let lattices = match is_needed {
            true => light_count * casters.count() as u32 * FACES,
            false => 0,
        };
        let rays = f64::from(light_count) * rays_of_light(settings);
        // A lattice has whole rows and columns, and every caster its least share.
        let slack = f64::from(lattices) * (1.0 + rays * LEAST_SHARE);
        let bytes = u64::from(lattices.max(1)) * size_of::<ChainLattice>() as u64;
        Ok(Self {
            buffer: Buffer::new(context, "lattices", bytes)?,
            count: 0,
            ray_count: 0,
            ray_capacity: if is_needed {
                (1.5 * rays + slack) as u32
            } else {
                0
            },
            is_needed,
            bounds: vec![None; scene.objects.len()],
        })
    }

    /// Chooses and stages the lattices; `moved` objects have other bounds than before.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn update(
        &mut self,
        staging: &mut Staging,
        scene: &Scene,
        store: &TriangleStore,
        lights: &[Light],
        moved: &[usize],
        settings: &Settings,
    ) -> Result<()> {
        if !self.is_needed {
            return Ok(());
        }
        for &index in moved {
            let object = &scene.objects[index];
            self.bounds[index] =
                starts_chains(scene, object).then(|| object.geometry.mesh().bounds());
        }
        let casters: Vec<(u32, [DVec3; 2])> = (0..)
            .zip(&self.bounds)
            .filter_map(|(object, bounds)| {
                Some((object, (*bounds)?.map(|corner| corner - store.origin)))
            })
            .collect();
        let mut lattices = Vec::new();
        let mut first = 0;
        for (light, number) in lights.iter().zip(0..) {
            let windows: Vec<(u32, Window)> = (casters.iter())
                .flat_map(|&(object, bounds)| {
                    let windows = match light.is_lamp {
                        0 => vec![of_sun(light, bounds, store.size().into())],
                        _ => of_lamp(light, bounds),
                    };
                    windows.into_iter().map(move |window| (object, window))
                })
                .collect();
            let total: f64 = windows.iter().map(|(_, window)| window.area()).sum();
            let rays = rays_of_light(settings);
            for (object, window) in windows {
                let share = (window.area() / total).max(LEAST_SHARE);
                let (lattice, count) = window.lattice(share * rays, first, object, number);
                if first + count > self.ray_capacity {
                    break;
                }
                first += count;
                lattices.push(lattice);
            }
        }
        self.count = lattices.len() as u32;
        self.ray_count = first;
        match lattices.is_empty() {
            true => Ok(()),
            false => staging.write(&self.buffer, 0, &lattices),
        }
    }
}

fn rays_of_light(settings: &Settings) -> f64 {
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

/// Whether light that left a specular surface may meet another one. It cannot if there is but one object, which is flat,
/// a convex mirror, or waves, whose slopes are small.
fn may_chain(scene: &Scene) -> bool {
    let mut casters = (scene.objects.iter()).filter(|object| starts_chains(scene, object));
    let (Some(only), false) = (casters.next(), scene.max_interfaces < 2) else {
        return false;
    };
    if casters.next().is_some() {
        return true;
    }
    let is_dielectric = matches!(
        scene.materials[only.material].kind,
        MaterialKind::Dielectric(_)
    );
    match &only.geometry {
        Geometry::Mesh(mesh) => !is_convex(mesh, is_dielectric, MAX_PAIRS),
        Geometry::Rect(_) | Geometry::Waves(_) => false,
    }
}

/// A rectangle of rays: origin + u edge_u + v edge_v, u and v from 0 to 1.
struct Window {
    origin: DVec3,
    edge_u: DVec3,
    edge_v: DVec3,
    /// Sun: of the rays.
    direction: DVec3,
}

impl Window {
    fn area(&self) -> f64 {
        self.edge_u.cross(self.edge_v).length()
    }

    /// About `rays` rays in square cells; their number.
    fn lattice(&self, rays: f64, first: u32, object: u32, light: u32) -> (ChainLattice, u32) {
        let cell = (self.area() / rays).sqrt();
        let count = |edge: DVec3| (edge.length() / cell).ceil().clamp(1.0, 65_536.0);
        let [columns, rows] = [self.edge_u, self.edge_v].map(count);
        let lattice = ChainLattice {
            origin: self.origin.as_vec3(),
            first,
            edge_u: (self.edge_u / columns).as_vec3(),
            columns: columns as u32,
            edge_v: (self.edge_v / rows).as_vec3(),
            object,
            direction: self.direction.as_vec3(),
            light,
        };
        (lattice, columns as u32 * rows as u32)
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
    let ([u0, u1], [v0, v1], [_, ahead]) = (range(u), range(v), range(toward));
    Window {
        origin: u0 * u + v0 * v + (ahead + size) * toward,
        edge_u: (u1 - u0) * u,
        edge_v: (v1 - v0) * v,
        direction: -toward,
    }
}

/// The sphere around a caster, seen from the centre of a lamp: a square, or a cube where the lamp is within the sphere or
/// close to it.
fn of_lamp(light: &Light, [low, high]: [DVec3; 2]) -> Vec<Window> {
    /// Largest sine of the half angle at which the caster is seen through one square.
    const MAX_SINE: f64 = 0.8;
    let place = light.place.as_dvec3();
    let square = |ahead: DVec3, half: f64| {
        let (u, v) = ahead.any_orthonormal_pair();
        Window {
            origin: place + ahead - half * (u + v),
            edge_u: 2.0 * half * u,
            edge_v: 2.0 * half * v,
            direction: DVec3::ZERO,
        }
    };
    let way = 0.5 * (low + high) - place;
    let sine = 0.5 * low.distance(high) / way.length();
    if sine < MAX_SINE {
        return vec![square(way.normalize(), sine / (1.0 - sine * sine).sqrt())];
    }
    [DVec3::X, DVec3::Y, DVec3::Z]
        .into_iter()
        .flat_map(|axis| [square(axis, 1.0), square(-axis, 1.0)])
        .collect()
}
