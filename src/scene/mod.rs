//! Scenes as plain data: what a scene file says, checked, in SI units and radians.
//!
//! Right-handed, y up. Positions are `f64` so that a scene far from the origin keeps its shape;
//! the renderer moves the origin into the scene before it goes to `f32`.

mod animation;
mod asset;
mod atlas;
mod environment;
mod file;
mod geometry;
mod glass;
mod keyframes;
mod light;
pub mod load;
mod materials;
pub(crate) mod memory;
mod mesh;
mod mtl;
mod obj;
mod obj_text;
mod object;
mod overlap;
mod skin;
mod surface;
mod texture;

pub use animation::Animation;
pub use atlas::{Atlas, NoLayout, Piece, Texel};
pub(crate) use geometry::bounds;
pub use geometry::{Geometry, Mesh, Rect, Similarity, Sine, Waves};
pub use glass::{D_LINE, Dispersion, GLASSES, Sellmeier};
pub use light::{EnvironmentMap, Light, LightKind, MAX_RADIANCE};
pub use load::{Loaded, load};
pub(crate) use mesh::same_vertices;
pub use object::{MAX_LIGHT_MAP_SIDE, Object, Unwrapping, light_map_side};
pub(crate) use skin::is_closed;
pub use surface::{AlbedoMap, Dielectric, Material, MaterialKind};
pub use texture::{Texture, TextureLevel};
#[cfg(feature = "cli")]
pub(crate) use texture::{covered, read as read_texture};

use glam::{DMat3, DVec3};
use std::borrow::Cow;
use std::sync::Arc;

/// Everything the renderer needs to know, at one time; [`Animation`] has it at every time.
#[derive(Debug, Clone)]
pub struct Scene {
    pub camera: Camera,
    pub lights: Vec<Light>,
    pub materials: Vec<Material>,
    pub objects: Vec<Object>,
    /// Maximum number of specular surfaces that light meets on its way to a receiver, ≥ 1.
    pub max_interfaces: u32,
    /// Shared by the scenes of all times.
    pub textures: Vec<Arc<Texture>>,
}

/// Exposures that a camera may have, EV.
pub const EXPOSURES_EV: std::ops::RangeInclusive<f64> = -64.0..=64.0;
/// [`Scene::max_interfaces`] where a scene does not say.
pub const DEFAULT_MAX_INTERFACES: u32 = 16;

/// Pinhole camera.
#[derive(Debug, Clone)]
pub struct Camera {
    /// m
    pub position: DVec3,
    /// Point in the middle of the picture, m.
    pub target: DVec3,
    /// Vertical field of view, rad.
    pub fov: f64,
    /// One of [`EXPOSURES_EV`]: the picture is multiplied by 2^exposure_ev before tone mapping.
    pub exposure_ev: f64,
}

impl Scene {
    /// Index of the object called `name`.
    pub fn object_index(&self, name: &str) -> Option<usize> {
        self.objects.iter().position(|object| object.name == name)
    }

    /// The scene `scale` times as large, then moved by `shift` (m). Lamps get `scale`² times their
    /// flux, so that irradiance stays.
    pub fn transformed(mut self, scale: f64, shift: DVec3) -> Self {
        let by = Similarity {
            scale,
            rotation: DMat3::IDENTITY,
            shift,
        };
        self.camera.position = by.place(self.camera.position);
        self.camera.target = by.place(self.camera.target);
        for light in &mut self.lights {
            if let LightKind::Lamp {
                position,
                radius,
                radiant_flux,
            } = &mut light.kind
            {
                *position = by.place(*position);
                *radius *= scale;
                *radiant_flux *= scale * scale;
            }
        }
        for object in &mut self.objects {
            object.geometry = object.geometry.moved(&by);
        }
        self
    }

    /// Mirrors and what lets light through, as (index, object).
    pub fn specular_objects(&self) -> impl Iterator<Item = (usize, &Object)> {
        (self.objects.iter().enumerate())
            .filter(|(_, object)| self.materials[object.material].kind.is_specular())
    }

    /// The meshes that carry a light map, as (index, mesh, texels).
    pub fn mesh_receivers(&self) -> impl Iterator<Item = (usize, Cow<'_, Mesh>, [u32; 2])> {
        (self.objects.iter().enumerate()).filter_map(|(index, object)| {
            let texels = object.light_map?;
            Some((index, object.geometry.as_mesh()?, texels))
        })
    }

    /// Indices and texels of all objects that carry a light map, in their order.
    pub fn light_maps(&self) -> Vec<(usize, [u32; 2])> {
        (self.objects.iter().enumerate())
            .filter_map(|(index, object)| match object.geometry {
                Geometry::Waves(_) => None,
                _ => Some((index, object.light_map?)),
            })
            .collect()
    }

    /// The rects that carry a light map, as (index, rect, texels).
    pub fn planar_receivers(&self) -> impl Iterator<Item = (usize, &Rect, [u32; 2])> {
        self.objects
            .iter()
            .enumerate()
            .filter_map(
                |(index, object)| match (&object.geometry, object.light_map) {
                    (Geometry::Rect(rect), Some(texels)) => Some((index, rect, texels)),
                    _ => None,
                },
            )
    }
}
