//! An environment cell: a rectangle of azimuth and sine of elevation, and the lights it stands for.

use crate::render::gpu_types::{self, constants::CELL_SPREAD};
use glam::DVec3;

/// An environment cell, before the rotation of the environment.
pub struct EnvironmentCell {
    /// Azimuth of the cell's centre, rad.
    pub azimuth: f64,
    pub half_azimuth: f64,
    /// Sine of the elevation of the cell's centre.
    pub sine: f64,
    pub half_sine: f64,
    /// Irradiance of a plane that faces the cell, W/m² at scale 1.
    pub irradiance: DVec3,
}

impl EnvironmentCell {
    /// The cell as a light whose kernel overlaps its neighbours. `rotation` in rad.
    pub fn light(&self, scale: f32, rotation: f32) -> gpu_types::Light {
        self.spread_light(scale, rotation, CELL_SPREAD.into())
    }

    /// The cell as a light of its own variance, for a cell that acts as a sun.
    pub fn sun(&self, scale: f32, rotation: f32) -> gpu_types::Light {
        self.spread_light(scale, rotation, 1.0)
    }

    fn spread_light(&self, scale: f32, rotation: f32, spread: f64) -> gpu_types::Light {
        let azimuth = self.azimuth + f64::from(rotation);
        let cosine = (1.0 - self.sine * self.sine).max(0.0).sqrt();
        // The azimuth is atan2(x, -z).
        let (x, z) = (azimuth.sin(), -azimuth.cos());
        let east = DVec3::new(-z, 0.0, x);
        let up = DVec3::new(-self.sine * x, cosine, -self.sine * z);
        let [across, along] = self.deviations().map(|deviation| deviation * spread.sqrt());
        gpu_types::Light {
            place: self.direction(rotation).as_vec3(),
            // The radius of the disc with this variance.
            size: (2.0 * (across * across + along * along)).sqrt() as f32,
            power: scale * self.irradiance.as_vec3(),
            is_lamp: 0,
            axis1: (across * east).as_vec3(),
            half_azimuth: self.half_azimuth as f32,
            axis2: (along * up).as_vec3(),
            half_sine: self.half_sine as f32,
        }
    }

    /// Unit vector toward the cell's centre. `rotation` in rad.
    pub fn direction(&self, rotation: f32) -> DVec3 {
        let azimuth = self.azimuth + f64::from(rotation);
        let cosine = (1.0 - self.sine * self.sine).max(0.0).sqrt();
        DVec3::new(cosine * azimuth.sin(), self.sine, -cosine * azimuth.cos())
    }

    /// The cell as a source of direct light. The shadow ray goes to `place`, from −1 to 1 across and up.
    pub fn direct_cell(&self, scale: f32, rotation: f32, place: [f64; 2]) -> gpu_types::DirectCell {
        let toward = |azimuth: f64, sine: f64, cosine: f64| {
            let azimuth = azimuth + f64::from(rotation);
            DVec3::new(cosine * azimuth.sin(), sine, -cosine * azimuth.cos()).as_vec3()
        };
        let cosine = |sine: f64| (1.0 - sine * sine).max(0.0).sqrt();
        // Mean over the cell as a rect of constant radiance: sin a / a across, and Simpson's rule up.
        let across = match self.half_azimuth {
            0.0 => 1.0,
            half => half.sin() / half,
        };
        let [low, high] = [-1.0, 1.0].map(|side| self.sine + side * self.half_sine);
        let up = (cosine(low) + 4.0 * cosine(self.sine) + cosine(high)) / 6.0;
        let sine = self.sine + place[1] * self.half_sine;
        gpu_types::DirectCell {
            mean: toward(self.azimuth, self.sine, across * up),
            power: scale * self.irradiance.as_vec3(),
            direction: toward(
                self.azimuth + place[0] * self.half_azimuth,
                sine.clamp(-1.0, 1.0),
                cosine(sine),
            ),
            ..Default::default()
        }
    }

    /// Standard deviations of its directions, rad: horizontal and vertical.
    fn deviations(&self) -> [f64; 2] {
        let elevation = |sine: f64| sine.clamp(-1.0, 1.0).asin();
        let [low, high] = [-1.0, 1.0].map(|side| elevation(self.sine + side * self.half_sine));
        let cosine = (1.0 - self.sine * self.sine).max(0.0).sqrt();
        [self.half_azimuth * cosine, 0.5 * (high - low)].map(|half| half / 3f64.sqrt())
    }
}
