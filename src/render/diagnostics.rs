//! Diagnostics: why a caster contributes nothing to the caustic. Light is followed from points on the caster, with one
//! ray to a light and one along the outgoing direction.
//!
//! For messages only: no frame depends on the results.

use crate::render::device_scene::DeviceScene;
use crate::render::geometry::rays::Rays;
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::{self, Light};
use crate::render::lights::{direction_toward, outgoing_directions, pack};
use glam::{DVec3, Vec3};
use std::f64::consts::TAU;

/// Number of points that are tested on an object.
const POINTS: usize = 1024;
/// Number of environment directions that are tested at each point.
const DIRECTIONS: usize = 16;
/// Maximum number of lights that are tested.
const LIGHTS: usize = 64;

/// The furthest stage that any tested path of light reaches.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Stage {
    Away,
    Shadowed,
    Astray,
    Lands,
}

impl Stage {
    fn reason(self) -> Option<&'static str> {
        match self {
            Self::Away => Some("all of its faces look away from every light"),
            Self::Shadowed => {
                Some("other objects, or itself, keep all light from its faces that look toward one")
            }
            Self::Astray => Some(
                "the light that it sends on reaches no receiver: it misses them all, meets their backs, or is blocked",
            ),
            Self::Lands => None,
        }
    }
}

/// A sentence for every caster without any effect, judged by about a thousand of its points. `with_environment`: the
/// method supports caustics of environments.
pub fn sentences(device: &DeviceScene, with_environment: bool) -> Vec<String> {
    let scene = &device.scene;
    let lights = pack(scene, device.geometry.store.origin);
    let rays = device.geometry.store.rays();
    let sentence = |(index, object): (usize, &crate::scene::Object)| {
        let reason = best(device, &rays, &lights, with_environment, index).reason()?;
        let name = object.name.escape_debug();
        Some(format!("object \"{name}\" casts no caustic: {reason}"))
    };
    scene.specular_objects().filter_map(sentence).collect()
}

fn best(
    device: &DeviceScene,
    rays: &Rays,
    lights: &[Light],
    with_environment: bool,
    object: usize,
) -> Stage {
    let (scene, store) = (&device.scene, &device.geometry.store);
    let material = &scene.materials[scene.objects[object].material].kind;
    let places = store.indices(object);
    let step = places.len().div_ceil(POINTS).max(1);
    let of_each = (POINTS / places.len()).max(1);
    let mut best = Stage::Away;
    for &place in places.iter().step_by(step) {
        for number in 0..of_each {
            let (x, normal, geometric) = point(store, place, number);
            let environment = (with_environment && device.environment.casts_caustics)
                .then(|| (0..DIRECTIONS).map(direction))
                .into_iter()
                .flatten()
                .map(|toward| (toward, f64::INFINITY));
            let point_lights = lights.iter().take(LIGHTS).map(|light| {
                let toward = direction_toward(light, x);
                let (sine, distance) = match light.is_lamp {
                    0 => (light.size.sin(), f32::INFINITY),
                    _ => {
                        let distance = light.place.distance(x);
                        (light.size / distance, distance - light.size)
                    }
                };
                (
                    above_horizon(toward, normal, sine.into()),
                    f64::from(distance),
                )
            });
            for (toward, distance) in point_lights.chain(environment) {
                let mut stage = Stage::Away;
                for outgoing in outgoing_directions(material, normal, toward) {
                    stage = stage.max(Stage::Shadowed);
                    let side = geometric.dot(toward.as_vec3()).signum();
                    if rays.is_occluded(
                        x + offset(device, side * geometric),
                        toward.as_vec3(),
                        distance as f32,
                    ) {
                        continue;
                    }
                    stage = stage.max(Stage::Astray);
                    let side = geometric.dot(outgoing.as_vec3()).signum();
                    if lands(
                        device,
                        rays,
                        x + offset(device, side * geometric),
                        outgoing.as_vec3(),
                    ) {
                        return Stage::Lands;
                    }
                }
                best = best.max(stage);
            }
        }
    }
    best
}

/// Point `number` of a triangle, with the interpolated and the geometric normal.
fn point(store: &TriangleStore, place: u32, number: usize) -> (Vec3, DVec3, Vec3) {
    let (triangle, normals) = (store.triangle(place), store.normals(place));
    // The sequence R2 of Roberts (2018), folded into the triangle; the first point is the centroid.
    let [mut s, mut t] = match number {
        0 => [1.0 / 3.0; 2],
        _ => {
            [0.754_877_67, 0.569_840_3].map(|step: f64| (0.5 + number as f64 * step).fract() as f32)
        }
    };
    if s + t > 1.0 {
        (s, t) = (1.0 - s, 1.0 - t);
    }
    let x = triangle.position + s * triangle.edge1 + t * triangle.edge2;
    let normal = (1.0 - s - t) * normals.n0 + s * normals.n1 + t * normals.n2;
    let geometric = triangle.edge1.cross(triangle.edge2).normalize_or_zero();
    (x, normal.as_dvec3().normalize_or_zero(), geometric)
}

/// Direction `number` of a Fibonacci lattice on the sphere.
fn direction(number: usize) -> DVec3 {
    let share = (number as f64 + 0.5) / DIRECTIONS as f64;
    let (height, azimuth) = (
        1.0 - 2.0 * share,
        TAU * (number as f64 * 0.618_033_988_75).fract(),
    );
    let (sine, cosine) = azimuth.sin_cos();
    let radius = (1.0 - height * height).sqrt();
    DVec3::new(radius * cosine, height, radius * sine)
}

/// The direction toward a light's centre. Where the centre is below the horizon and the light's upper part is not, a
/// direction toward the upper part.
fn above_horizon(toward: DVec3, normal: DVec3, sine: f64) -> DVec3 {
    let height = normal.dot(toward);
    match (-sine..0.0).contains(&height) {
        true => (toward + 0.5 * (sine - height) * normal).normalize(),
        false => toward,
    }
}

/// Offset from a surface that excludes the surface's own triangle.
fn offset(device: &DeviceScene, normal: Vec3) -> Vec3 {
    1e-5 * device.bodies.size() as f32 * normal
}

/// Whether the first object that a ray meets is the front of a receiver.
fn lands(device: &DeviceScene, rays: &Rays, origin: Vec3, outgoing: Vec3) -> bool {
    let is_receiver = |triangle: &gpu_types::Triangle| {
        device.scene.objects[triangle.object as usize]
            .light_map
            .is_some()
    };
    let nearest = rays.nearest(origin, outgoing, is_receiver);
    nearest.is_some_and(|triangle| {
        is_receiver(triangle) && triangle.edge1.cross(triangle.edge2).dot(outgoing) < 0.0
    })
}
