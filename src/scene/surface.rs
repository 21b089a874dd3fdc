//! What surfaces do to light.

use super::glass::Dispersion;
use glam::{DVec2, DVec3};

/// What a surface does to light.
#[derive(Debug, Clone)]
pub struct Material {
    pub name: String,
    pub kind: MaterialKind,
    /// Of a diffuse material: its colours at every point are factors on its albedo. Objects have
    /// [`super::Object::texture_coordinates`] where their material has one.
    pub albedo_map: Option<AlbedoMap>,
}

impl Material {
    /// A material without an albedo map.
    pub fn new(name: impl Into<String>, kind: MaterialKind) -> Self {
        Self {
            name: name.into(),
            kind,
            albedo_map: None,
        }
    }
}

/// A texture as a surface has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlbedoMap {
    /// Index into [`super::Scene::textures`].
    pub texture: usize,
    /// Factor on the texture coordinates u and v: repeats of the image within a unit of each.
    pub uv_scale: DVec2,
}

#[derive(Debug, Clone, PartialEq)]
pub enum MaterialKind {
    /// Ideal specular reflection on the front face; the back face absorbs.
    Mirror {
        /// RGB, 0..=1.
        reflectance: DVec3,
    },
    /// A metal: specular reflection by Fresnel's equations on the front face; the back face absorbs.
    Conductor {
        /// Real part of the index of refraction, RGB, and imaginary part, the extinction.
        index: DVec3,
        extinction: DVec3,
    },
    /// The smooth surface of something transparent: it reflects and refracts by Fresnel's equations,
    /// from both sides.
    Dielectric(Dielectric),
    /// Lambertian BRDF albedo/π on the front face; the back face absorbs.
    Diffuse {
        /// RGB, 0..=1.
        albedo: DVec3,
    },
}

impl MaterialKind {
    /// Whether it casts a caustic.
    pub fn is_specular(&self) -> bool {
        !matches!(self, Self::Diffuse { .. })
    }

    /// How its index of refraction depends on the wavelength, where it disperses light. A sheet does not.
    pub fn dispersion(&self) -> Option<Dispersion> {
        match self {
            Self::Dielectric(medium) if !medium.thin => medium.dispersion,
            _ => None,
        }
    }
}

/// The medium behind the front face of a surface. Before it is what surrounds it: another dielectric, or air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dielectric {
    /// Index of refraction, relative to air, at the [`super::D_LINE`].
    pub ior: f64,
    /// How it depends on the wavelength, where the medium disperses light.
    pub dispersion: Option<Dispersion>,
    /// σ, RGB, 1/m: of light that travels d metres, exp(−σ d) is left.
    pub absorption: DVec3,
    /// Where dielectrics overlap, the one with the highest priority fills the place, and among equal ones the one that
    /// light entered last.
    pub priority: i32,
    /// A sheet without thickness: two parallel interfaces at the same place. What passes keeps its direction.
    pub thin: bool,
}

impl Dielectric {
    /// Clear, of the priority 0.
    pub fn new(ior: f64) -> Self {
        Self {
            ior,
            dispersion: None,
            absorption: DVec3::ZERO,
            priority: 0,
            thin: false,
        }
    }

    /// Index of refraction at a vacuum wavelength in µm.
    pub fn ior_at(&self, wavelength: f64) -> f64 {
        (self.dispersion).map_or(self.ior, |dispersion| dispersion.index(wavelength))
    }
}
