//! lights: suns, lamps and sun-like cells of the environment, packed for the device and classified.
//!
//! A light is narrow where its blur is much smaller than a texel, so that its width does not matter. Under narrow
//! lights the image of a patch is a triangle, which is exact except for the blur. Under wide lights the image is a
//! kernel, whose blur is right but whose shape is approximate. Kernels overlap their neighbours and triangles do not,
//! so their sum would be uneven where the two meet. Each light therefore uses one of them everywhere, and keeps it when
//! the scene moves.

use crate::error::{Error, Result};
use crate::gpu::{Buffer, Context, Staging};
use crate::optics::{reflect, refract};
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::{Light, PlanarReceiver};
use crate::render::settings::Method;
use crate::scene::{EnvironmentMap, LightKind, MaterialKind, Scene};
use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};
use std::ops::Range;
use std::sync::Arc;

/// Maximum number of environment cells that act as suns.
pub const MAX_ENVIRONMENT_SUNS: usize = 4;

/// A range of lights that the same patches project.
#[derive(Debug, Clone, Copy)]
pub struct LightGroup {
    pub first_light: u32,
    pub light_count: u32,
    pub patch_count: u32,
}

impl LightGroup {
    /// Number of pairs of light and patch.
    pub fn pairs(&self) -> u64 {
        u64::from(self.light_count) * u64::from(self.patch_count)
    }
}

/// The lights that a projector uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Source {
    Narrow,
    Wide,
    /// Narrow and wide ones.
    All,
    /// The environment's cells.
    Environment,
}

/// The lights' buffer, and which of them are narrow.
pub struct DeviceLights {
    pub buffer: Buffer,
    /// Number of suns and lamps of the scene; sun-like cells of the environment follow them.
    pub scene_count: u32,
    /// Per light: whether its images on planar receivers are triangles.
    are_narrow: Vec<bool>,
    narrow: Vec<Range<u32>>,
    wide: Vec<Range<u32>>,
    all: Range<u32>,
    method: Method,
}

impl DeviceLights {
    /// Allocates for all lights of `scene`.
    ///
    /// # Errors
    /// [`Error::Device`] if device memory is insufficient.
    pub fn new(context: &Arc<Context>, scene: &Scene, method: Method) -> Result<Self> {
        let is_light = |kind: &LightKind| !matches!(kind, LightKind::Environment { .. });
        let count = (scene.lights.iter())
            .filter(|light| is_light(&light.kind))
            .count();
        let bytes = (count + MAX_ENVIRONMENT_SUNS) * size_of::<Light>();
        Ok(Self {
            buffer: Buffer::new(context, "lights", bytes as u64)?,
            scene_count: count as u32,
            are_narrow: Vec::new(),
            narrow: Vec::new(),
            wide: Vec::new(),
            all: 0..0,
            method,
        })
    }

    /// Writes the lights. Each light is classified once; the environment's suns are classified again for a new
    /// environment.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn update(
        &mut self,
        staging: &mut Staging,
        lights: &[Light],
        is_another_environment: bool,
        is_narrow: impl Fn(&Light) -> bool,
    ) -> Result<()> {
        if is_another_environment {
            self.are_narrow.truncate(self.scene_count as usize);
        }
        let method = self.method;
        let known = self.are_narrow.len();
        (self.are_narrow).extend(lights[known..].iter().map(|light| match method {
            Method::Footprint => is_narrow(light),
            Method::Beams => true,
            Method::Pinhole | Method::Points => false,
        }));
        self.narrow = self.ranges(true);
        self.wide = self.ranges(false);
        self.all = 0..self.count();
        staging.write(&self.buffer, 0, lights)
    }

    fn ranges(&self, narrow: bool) -> Vec<Range<u32>> {
        let mut first = 0;
        (self.are_narrow.chunk_by(|a, b| a == b))
            .map(|run| {
                let range = first..first + run.len() as u32;
                first = range.end;
                (run[0], range)
            })
            .filter_map(|(is_narrow, range)| (is_narrow == narrow).then_some(range))
            .collect()
    }

    /// Number of suns, lamps, and sun-like cells of the environment.
    pub fn count(&self) -> u32 {
        self.are_narrow.len() as u32
    }

    /// The lights of a source, with `patch_count` patches. Empty for the environment.
    pub fn groups(
        &self,
        source: Source,
        patch_count: u32,
    ) -> impl Iterator<Item = LightGroup> + '_ {
        let ranges = match source {
            Source::Narrow => &self.narrow[..],
            Source::Wide => &self.wide,
            Source::All => std::slice::from_ref(&self.all),
            Source::Environment => &[],
        };
        ranges.iter().map(move |range| LightGroup {
            first_light: range.start,
            light_count: range.end - range.start,
            patch_count,
        })
    }
}

/// The present state of an environment.
#[derive(Clone, Copy)]
pub struct EnvironmentLight<'a> {
    pub map: &'a Arc<EnvironmentMap>,
    pub scale: f32,
    /// rad, 0 to 2π.
    pub rotation: f32,
}

impl<'a> EnvironmentLight<'a> {
    /// The environment of a scene, if it has one.
    ///
    /// # Errors
    /// [`Error::Usage`] where there is more than one.
    pub fn of(scene: &'a Scene) -> Result<Option<Self>> {
        let mut all = scene.lights.iter().filter_map(|light| match &light.kind {
            LightKind::Environment {
                map,
                scale,
                rotation,
            } => Some(Self {
                map,
                scale: *scale as f32,
                rotation: rotation.rem_euclid(TAU) as f32,
            }),
            _ => None,
        });
        match (all.next(), all.next()) {
            (_, Some(_)) => Err(Error::Usage {
                reason: "the scene has more than one environment".into(),
                remedy: "keep one light of kind environment".into(),
            }),
            (environment, None) => Ok(environment),
        }
    }
}

/// The suns and lamps of a scene, with positions relative to `origin`.
pub fn pack(scene: &Scene, origin: DVec3) -> Vec<Light> {
    let packed = |kind: &LightKind| match kind {
        LightKind::Sun {
            direction,
            irradiance,
            angular_radius,
        } => {
            let [axis1, axis2] = disc_axes(*direction, *angular_radius);
            Some(Light {
                place: direction.as_vec3(),
                size: *angular_radius as f32,
                power: irradiance.as_vec3(),
                axis1,
                axis2,
                ..Default::default()
            })
        }
        LightKind::Lamp {
            position,
            radius,
            radiant_flux,
        } => Some(Light {
            place: (*position - origin).as_vec3(),
            size: *radius as f32,
            // Radiant intensity into the whole sphere, W/sr.
            power: (*radiant_flux / (4.0 * PI)).as_vec3(),
            is_lamp: 1,
            ..Default::default()
        }),
        LightKind::Environment { .. } => None,
    };
    (scene.lights.iter())
        .filter_map(|light| packed(&light.kind))
        .collect()
}

/// A root of the covariance of the directions of a sun's disc. The variance of a disc of radius a is a²/4 on each axis.
pub fn disc_axes(direction: DVec3, angular_radius: f64) -> [Vec3; 2] {
    let (a, b) = direction.any_orthonormal_pair();
    [a, b].map(|axis| (0.5 * angular_radius * axis).as_vec3())
}

/// Maximum variance of a narrow light's image over the variance of a texel. On the ring at 256², where a sun of 0.27°
/// has 0.12, triangles and kernels had L1 2.3 and 3.1 % with 4 k patches, 0.6 and 1.1 % with 64 k; at 512², where it
/// has 0.5, 1.3 and 0.9 %; on `bumps` at 128², where it has 0.25, 3.2 and 0.8 %.
const NARROW: f64 = 0.15;
/// Number of triangles that are sampled.
const SAMPLED: usize = 4096;

/// Whether `light` is narrow on average, over the rays from the centroids of the casters' triangles that meet
/// receivers.
pub fn is_narrow(
    scene: &Scene,
    store: &TriangleStore,
    receivers: &[PlanarReceiver],
    light: &Light,
) -> bool {
    let triangles: Vec<(&MaterialKind, u32)> = (scene.specular_objects())
        .flat_map(|(index, object)| {
            let material = &scene.materials[object.material].kind;
            store
                .indices(index)
                .iter()
                .map(move |&triangle| (material, triangle))
        })
        .collect();
    let (mut sum, mut weights) = (0.0, 0.0);
    let step = triangles.len().div_ceil(SAMPLED).max(1);
    for &(material, index) in triangles.iter().step_by(step) {
        let (triangle, normals) = (
            &store.triangles[index as usize],
            &store.normals[index as usize],
        );
        let x = triangle.position + (triangle.edge1 + triangle.edge2) / 3.0;
        let normal = (normals.n0 + normals.n1 + normals.n2)
            .as_dvec3()
            .normalize_or_zero();
        let (toward, variance) = directions(light, x);
        let cosine = normal.dot(toward);
        for direction in outgoing_directions(material, normal, toward) {
            for receiver in receivers {
                if let Some(distance) = distance_to(receiver, x, direction.as_vec3()) {
                    let texels = f64::from(receiver.width) * f64::from(receiver.height);
                    let texel = f64::from(receiver.edge_u.cross(receiver.edge_v).length()) / texels;
                    let weight = f64::from(triangle.area()) * cosine.abs();
                    sum += weight * 12.0 * variance * distance * distance / texel;
                    weights += weight;
                }
            }
        }
    }
    sum <= NARROW * weights
}

/// Unit direction toward the light from x, and the variance of the light's directions on each axis.
pub fn directions(light: &Light, x: Vec3) -> (DVec3, f64) {
    if light.is_lamp == 0 {
        let both = light.axis1.length_squared() + light.axis2.length_squared();
        (light.place.as_dvec3(), 0.5 * f64::from(both))
    } else {
        let to_light = (light.place - x).as_dvec3();
        let radius = f64::from(light.size) / to_light.length();
        (to_light.normalize_or_zero(), 0.25 * radius * radius)
    }
}

/// Directions in which a surface with this normal reflects and refracts light that comes from `toward`.
pub fn outgoing_directions(
    material: &MaterialKind,
    normal: DVec3,
    toward: DVec3,
) -> impl Iterator<Item = DVec3> {
    let cosine = normal.dot(toward);
    let (facing, refracted) = match material {
        MaterialKind::Dielectric { ior } if cosine < 0.0 => {
            (-normal, refract(-toward, -normal, *ior))
        }
        MaterialKind::Dielectric { ior } => (normal, refract(-toward, normal, 1.0 / ior)),
        _ => (normal, None),
    };
    let reflected = (facing.dot(toward) > 0.0).then(|| reflect(-toward, facing));
    reflected.into_iter().chain(refracted)
}

/// Distance from x along `direction` to the receiver's front, m.
fn distance_to(receiver: &PlanarReceiver, x: Vec3, direction: Vec3) -> Option<f64> {
    let along = direction.dot(receiver.normal);
    let distance = (receiver.origin - x).dot(receiver.normal) / along;
    let from_corner = x + distance * direction - receiver.origin;
    let inside = [receiver.edge_u, receiver.edge_v]
        .iter()
        .all(|edge| (0.0..=edge.length_squared()).contains(&from_corner.dot(*edge)));
    (along < 0.0 && distance > 0.0 && inside).then_some(f64::from(distance))
}
