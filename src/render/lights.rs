//! lights: suns, lamps and sun-like cells of the environment, packed for the device.

use crate::error::{Error, Result};
use crate::gpu::{Buffer, Context, Staging};
use crate::optics::{reflect, refract};
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::Light;
use crate::render::light_parts::{MAX_RINGS, part_count, rings, split};
use crate::render::settings::{Method, Settings};
use crate::scene::{EnvironmentMap, LightKind, MaterialKind, Scene};
use glam::{DVec3, Vec3};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Maximum number of environment cells that act as suns.
pub const MAX_ENVIRONMENT_SUNS: usize = 4;

/// Lights that the same patches project.
#[derive(Debug, Clone, Copy)]
pub struct LightGroup {
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
    /// Suns, lamps and sun-like cells of the environment.
    Suns,
    /// The environment's other cells.
    Environment,
}

/// The lights' buffers.
pub struct DeviceLights {
    /// Suns and lamps of the scene, then sun-like cells of the environment.
    pub buffer: Buffer,
    /// The same with the parts of wide suns and lamps in their place, which `footprint` projects.
    pub parts: Buffer,
    /// Number of suns and lamps of the scene.
    pub scene_count: u32,
    /// Number of suns and lamps and of sun-like cells.
    pub count: u32,
    /// Number of parts, and of sun-like cells.
    pub part_count: u32,
    /// The suns and lamps of the scene.
    pub scene: Vec<Light>,
    /// Number of rings of parts of each of them. The lattices of chains are made for them.
    pub rings: Vec<u32>,
}

impl DeviceLights {
    /// Allocates for all lights of `scene`.
    ///
    /// # Errors
    /// [`Error::Device`] if device memory is insufficient.
    pub fn new(context: &Arc<Context>, scene: &Scene) -> Result<Self> {
        let is_light = |kind: &LightKind| !matches!(kind, LightKind::Environment { .. });
        let count = (scene.lights.iter())
            .filter(|light| is_light(&light.kind))
            .count();
        let buffer = |name, lights: usize| {
            let bytes = (lights + MAX_ENVIRONMENT_SUNS) * size_of::<Light>();
            Buffer::new(context, name, bytes as u64)
        };
        Ok(Self {
            buffer: buffer("lights", count)?,
            parts: buffer("parts of lights", count * part_count(MAX_RINGS) as usize)?,
            scene_count: count as u32,
            count: count as u32,
            part_count: count as u32,
            scene: Vec::new(),
            rings: vec![0; count],
        })
    }

    /// Number of rings of parts that each of the suns and lamps `lights` is to be divided into. Each part has so many images of facets.
    pub fn divided(
        &self,
        scene: &Scene,
        store: &TriangleStore,
        lights: &[Light],
        images: u64,
        settings: &Settings,
    ) -> Vec<u32> {
        match settings.method {
            Method::Footprint => rings(scene, store, lights, &self.rings, images),
            _ => self.rings.clone(),
        }
    }

    /// Writes the scene's suns and lamps, which the environment's sun-like cells follow.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn update(&mut self, staging: &mut Staging, lights: &[Light]) -> Result<()> {
        let (scene, suns) = lights.split_at(self.scene_count as usize);
        let mut parts: Vec<Light> = (scene.iter().zip(&self.rings))
            .flat_map(|(light, &rings)| split(light, rings))
            .collect();
        parts.extend(suns);
        self.count = lights.len() as u32;
        self.part_count = parts.len() as u32;
        self.scene = scene.to_vec();
        staging.write(&self.parts, 0, &parts)?;
        staging.write(&self.buffer, 0, lights)
    }
}

/// The present state of an environment.
#[derive(Clone, Copy)]
pub struct EnvironmentLight<'a> {
    pub map: &'a Arc<EnvironmentMap>,
    pub scale: f32,
    /// rad, 0 to 2π.
    pub rotation: f32,
    pub casts_caustics: bool,
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
                casts_caustics,
            } => Some(Self {
                map,
                scale: *scale as f32,
                rotation: rotation.rem_euclid(TAU) as f32,
                casts_caustics: *casts_caustics,
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
fn disc_axes(direction: DVec3, angular_radius: f64) -> [Vec3; 2] {
    let (a, b) = direction.any_orthonormal_pair();
    [a, b].map(|axis| (0.5 * angular_radius * axis).as_vec3())
}

/// Unit direction toward the light from x.
pub fn direction_toward(light: &Light, x: Vec3) -> DVec3 {
    match light.is_lamp {
        0 => light.place.as_dvec3(),
        _ => (light.place - x).as_dvec3().normalize_or_zero(),
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
        MaterialKind::Dielectric(medium) if cosine < 0.0 => {
            (-normal, refract(-toward, -normal, medium.ior))
        }
        MaterialKind::Dielectric(medium) => (normal, refract(-toward, normal, 1.0 / medium.ior)),
        _ => (normal, None),
    };
    let reflected = (facing.dot(toward) > 0.0).then(|| reflect(-toward, facing));
    reflected.into_iter().chain(refracted)
}
