//! What shines.

use glam::DVec3;
use std::sync::Arc;

/// Most radiance of a light, W/m²/sr: fifty million times the sun's, and the square of a sum of many such
/// is still an f32 value.
pub const MAX_RADIANCE: f32 = 1e15;

/// What shines.
#[derive(Debug, Clone)]
pub struct Light {
    pub name: String,
    pub kind: LightKind,
}

#[derive(Debug, Clone, PartialEq)]
pub enum LightKind {
    /// A distant disc of constant radiance.
    Sun {
        /// Unit vector toward the light's centre.
        direction: DVec3,
        /// RGB irradiance on a plane that faces the light, W/m².
        irradiance: DVec3,
        /// rad; 0 is a point at infinity.
        angular_radius: f64,
    },
    /// A sphere of the same radiance Φ/(4π²R²) everywhere and in all directions. A plane that faces it
    /// at the distance d from its middle gets Φ/(4πd²). It casts no shadow.
    Lamp {
        /// Centre, m.
        position: DVec3,
        /// R, m; > 0.
        radius: f64,
        /// Φ, RGB, W.
        radiant_flux: DVec3,
    },
    /// Radiance from every direction.
    Environment {
        map: Arc<EnvironmentMap>,
        /// Factor on the map's radiance, which stays within [`MAX_RADIANCE`].
        scale: f64,
        /// Rotation about +y, rad: a direction at azimuth u of the map appears at u + rotation.
        rotation: f64,
        /// Whether specular surfaces send its light on to receivers. If not, it lights diffuse surfaces directly, the
        /// camera sees it in mirrors and through interfaces, and interfaces do not block it: it passes straight through.
        casts_caustics: bool,
    },
}

impl LightKind {
    /// Whether specular surfaces send its light on to receivers.
    pub fn casts_caustics(&self) -> bool {
        match self {
            Self::Environment { casts_caustics, .. } => *casts_caustics,
            Self::Sun { .. } | Self::Lamp { .. } => true,
        }
    }
}

/// Equirectangular radiance image, W/m²/sr, rows from the zenith down:
/// u = atan2(d.x, −d.z)/2π mod 1, v = acos(d.y)/π from the top row.
#[derive(Debug, Clone, PartialEq)]
pub struct EnvironmentMap {
    pub width: u32,
    pub height: u32,
    /// `width * height` RGB values, all finite and ≥ 0.
    pub radiance: Vec<[f32; 3]>,
}
