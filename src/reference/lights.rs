//! Directions toward the lights, drawn in proportion to the radiance that comes from there.

use crate::reference::mirrors::{Distribution, MirrorTriangle};
use crate::scene::{EnvironmentMap, Light, LightKind};
use glam::DVec3;
use std::f64::consts::{PI, TAU};

/// Radiance above this many times the mean counts as bright: it is left to light tracing, the
/// rest to gathering.
const BRIGHT: f64 = 8.0;

/// Share of the directions that light tracing draws from the dim radiance, of which it only has
/// to find what [`super::gather`] leaves to it, the light from mirrors nearby.
const DIM_SHARE: f64 = 0.25;

/// A light that directions can be drawn from.
pub enum Emitter {
    Sun(Sun),
    Lamp(Lamp),
    Environment(Environment),
}

/// A direction drawn from an [`Emitter`], and the radiance from there over the probability density
/// per steradian with which it is drawn: what an estimate of ∫ L … dω multiplies. RGB, W/m².
pub struct Direction {
    /// Unit vector toward the light.
    pub direction: DVec3,
    /// To the light, m.
    pub distance: f64,
    /// Of the light that only light tracing finds.
    pub bright: DVec3,
    /// Of the light that gathering finds too.
    pub dim: DVec3,
}

/// A disc of constant radiance L = E/(π sin²α).
pub struct Sun {
    /// Unit vector toward the middle of the disc, and two across.
    direction: DVec3,
    across: [DVec3; 2],
    /// RGB on a plane that faces the light, W/m².
    irradiance: DVec3,
    sine_of_radius: f64,
}

/// A sphere of constant radiance L = Φ/(4π²R²).
pub struct Lamp {
    /// Of its middle, m.
    position: DVec3,
    /// m
    radius: f64,
    /// RGB, W/m²/sr.
    radiance: DVec3,
}

/// An equirectangular map of radiance, split into a bright and a dim part.
pub struct Environment {
    /// RGB, W/m²/sr, with the light's scale.
    bright: Vec<DVec3>,
    dim: Vec<DVec3>,
    /// In proportion to the bright part and a share of the dim part.
    directions: Directions,
}

/// A distribution of directions, bilinear between the texels of an equirectangular map.
pub struct Directions {
    size: [usize; 2],
    /// rad
    rotation: f64,
    /// How much of the draws each texel gets; their mean is 1.
    density: Vec<f64>,
    row: Distribution,
    /// For each row; `None` where the row is black.
    column: Vec<Option<Distribution>>,
}

/// Four texels and their weights.
type Taps = [(usize, f64); 4];

impl Emitter {
    /// `None` for a light without power.
    pub fn new(light: &Light) -> Option<Self> {
        match &light.kind {
            LightKind::Sun {
                direction,
                irradiance,
                angular_radius,
            } => (irradiance.max_element() > 0.0).then(|| {
                let (tangent, bitangent) = direction.any_orthonormal_pair();
                Self::Sun(Sun {
                    direction: *direction,
                    across: [tangent, bitangent],
                    irradiance: *irradiance,
                    sine_of_radius: angular_radius.sin(),
                })
            }),
            LightKind::Lamp { radiant_flux, .. } => Lamp::new(light)
                .filter(|_| radiant_flux.max_element() > 0.0)
                .map(Self::Lamp),
            LightKind::Environment {
                map,
                scale,
                rotation,
                casts_caustics: _,
            } => Environment::new(map, *scale, *rotation).map(Self::Environment),
        }
    }

    /// Draws a direction from `place` with two numbers that are uniform in [0, 1).
    pub fn draw(&self, place: DVec3, u: f64, v: f64) -> Direction {
        match self {
            Self::Sun(sun) => sun.draw(u, v),
            Self::Lamp(lamp) => lamp.draw(place, u, v),
            Self::Environment(environment) => environment.draw(u, v),
        }
    }

    /// Radiance that comes from far away out of the unit direction `toward` the light, W/m²/sr. Suns that
    /// are points are not seen, and lamps are not far away.
    pub fn background(&self, toward: DVec3) -> DVec3 {
        match self {
            Self::Sun(sun) => sun.radiance_from(toward),
            Self::Lamp(_) => DVec3::ZERO,
            Self::Environment(environment) => environment.radiance(toward),
        }
    }

    /// About the flux that the triangle receives from this light, and never zero where it
    /// receives any; W.
    pub fn flux_onto(&self, triangle: &MirrorTriangle) -> f64 {
        match self {
            Self::Sun(sun) => {
                let cosine = |normal: DVec3| {
                    let cosine = normal.dot(sun.direction);
                    let both = triangle.surface.has_two_sides();
                    (if both { cosine.abs() } else { cosine }) + sun.sine_of_radius
                };
                let facing = triangle.normals.map(cosine).into_iter().fold(0.0, f64::max);
                if cosine(triangle.geometric_normal) <= 0.0 {
                    return 0.0;
                }
                sun.irradiance.element_sum() / 3.0 * triangle.area * facing
            }
            Self::Lamp(lamp) => lamp.flux_onto(triangle),
            // Half the irradiance of the whole sphere, halved again for the mean cosine.
            Self::Environment(environment) => {
                environment.directions.row.total() * triangle.area / 4.0
            }
        }
    }
}

impl Sun {
    /// Uniform in the projection of the disc onto a plane that faces it, which is the measure in
    /// which constant radiance gives constant irradiance.
    fn draw(&self, u: f64, v: f64) -> Direction {
        let sine = self.sine_of_radius * u.sqrt();
        let cosine = (1.0 - sine * sine).sqrt();
        let (y, x) = (TAU * v).sin_cos();
        let across = sine * (x * self.across[0] + y * self.across[1]);
        Direction {
            direction: cosine * self.direction + across,
            distance: f64::INFINITY,
            // dω = dA/cosine: the radiance E/(π sin²α) over the density cosine/(π sin²α).
            bright: self.irradiance / cosine,
            dim: DVec3::ZERO,
        }
    }

    fn radiance_from(&self, toward: DVec3) -> DVec3 {
        // The length of the cross product keeps the digits of a small angle.
        let inside = self.sine_of_radius > 0.0
            && self.direction.dot(toward) > 0.0
            && self.direction.cross(toward).length() <= self.sine_of_radius;
        match inside {
            true => self.irradiance / (PI * self.sine_of_radius.powi(2)),
            false => DVec3::ZERO,
        }
    }
}

impl Lamp {
    /// As the scene describes it; `None` for another light.
    pub fn new(light: &Light) -> Option<Self> {
        match light.kind {
            LightKind::Lamp {
                position,
                radius,
                radiant_flux,
            } => Some(Self {
                position,
                radius,
                radiance: radiant_flux / (4.0 * PI * PI * radius * radius),
            }),
            _ => None,
        }
    }

    /// RGB, W/m²/sr.
    pub fn radiance(&self) -> DVec3 {
        self.radiance
    }

    /// Distance, m, at which a ray from outside meets the sphere.
    pub fn meets(&self, origin: DVec3, direction: DVec3) -> Option<f64> {
        let way = self.position - origin;
        let along = way.dot(direction);
        let square = self.radius.powi(2) - (way - along * direction).length_squared();
        (along > 0.0 && square >= 0.0).then(|| along - square.sqrt())
    }

    /// Uniform in the solid angle of the sphere as seen from `place`, which its radiance fills evenly.
    fn draw(&self, place: DVec3, u: f64, v: f64) -> Direction {
        let way = self.position - place;
        let distance = way.length();
        // 1 − cosine of the angular radius, and of the angle from the middle, without cancellation.
        let squared_sine = (self.radius / distance).powi(2).min(1.0);
        let extent = squared_sine / (1.0 + (1.0 - squared_sine).sqrt());
        let short = u * extent;
        let (cosine, sine) = (1.0 - short, (short * (2.0 - short)).sqrt());
        let toward = way / distance;
        let (tangent, bitangent) = toward.any_orthonormal_pair();
        let (y, x) = (TAU * v).sin_cos();
        // Half the chord that the ray cuts out of the sphere.
        let half = (self.radius.powi(2) - (distance * sine).powi(2)).max(0.0);
        Direction {
            direction: cosine * toward + sine * (x * tangent + y * bitangent),
            distance: distance * cosine - half.sqrt(),
            bright: TAU * extent * self.radiance,
            dim: DVec3::ZERO,
        }
    }

    /// As [`Emitter::flux_onto`]. The shading normal times the way to the lamp's middle is a mean over
    /// pairs of corners, so where all of these are dark the whole triangle is.
    fn flux_onto(&self, triangle: &MirrorTriangle) -> f64 {
        let corners = [DVec3::ZERO, triangle.edge_1, triangle.edge_2];
        let ways = corners.map(|corner| self.position - triangle.a - corner);
        let height = |normal: DVec3| {
            let heights = ways.map(|way| {
                let height = normal.dot(way);
                let both = triangle.surface.has_two_sides();
                (if both { height.abs() } else { height }) + self.radius
            });
            heights.into_iter().fold(0.0, f64::max)
        };
        if height(triangle.geometric_normal) <= 0.0 {
            return 0.0;
        }
        let facing = triangle.normals.map(height).into_iter().fold(0.0, f64::max);
        let middle: DVec3 = ways.into_iter().sum::<DVec3>() / 3.0;
        let distance = middle.length().max(self.radius);
        // E = L π sin²α cosθ, cosθ the height over the distance.
        let solid_angle = PI * (self.radius / distance).powi(2);
        self.radiance.element_sum() / 3.0 * solid_angle * triangle.area * facing / distance
    }
}

impl Environment {
    fn new(map: &EnvironmentMap, scale: f64, rotation: f64) -> Option<Self> {
        let size = [map.width as usize, map.height as usize];
        let radiance: Vec<DVec3> = (map.radiance.iter())
            .map(|&[r, g, b]| scale * DVec3::new(r.into(), g.into(), b.into()))
            .collect();
        let total: DVec3 = (radiance.iter().enumerate())
            .map(|(i, &radiance)| radiance * solid_angle(size, i / size[0]))
            .sum();
        let limit = BRIGHT * total / (4.0 * PI);
        let dim: Vec<DVec3> = radiance.iter().map(|l| l.min(limit)).collect();
        let bright: Vec<DVec3> = (radiance.iter().zip(&dim)).map(|(l, d)| *l - *d).collect();
        // One third of the sum: the mean over the channels, W.
        let weights = (bright.iter().zip(&dim).enumerate())
            .map(|(i, (bright, dim))| {
                (*bright + DIM_SHARE * *dim).element_sum() / 3.0 * solid_angle(size, i / size[0])
            })
            .collect();
        Some(Self {
            bright,
            dim,
            directions: Directions::new(size, rotation, weights)?,
        })
    }

    fn draw(&self, u: f64, v: f64) -> Direction {
        let (direction, steradians, taps) = self.directions.draw(u, v);
        Direction {
            direction,
            distance: f64::INFINITY,
            bright: steradians * interpolate(&self.bright, &taps),
            dim: steradians * interpolate(&self.dim, &taps),
        }
    }

    /// Directions in proportion to about the radiance times the cosine to the unit vector `normal`, with
    /// which no light from before it is missed; `None` where there is none.
    pub fn onto(&self, normal: DVec3) -> Option<Directions> {
        let Directions { size, rotation, .. } = self.directions;
        // Bilinear interpolation carries a texel's radiance to the middle of the next.
        let slack = 2.0 * PI / size[1].min(size[0]) as f64;
        let weights = (self.bright.iter().zip(&self.dim).enumerate())
            .map(|(i, (bright, dim))| {
                let x = ((i % size[0]) as f64 + 0.5) / size[0] as f64;
                let y = ((i / size[0]) as f64 + 0.5) / size[1] as f64;
                let cosine = direction_at(x, y, rotation).dot(normal) + slack;
                let flux = (*bright + *dim).element_sum() * solid_angle(size, i / size[0]);
                flux * cosine.max(0.0)
            })
            .collect();
        Directions::new(size, rotation, weights)
    }

    /// Texels.
    pub fn texels(&self) -> usize {
        self.dim.len()
    }

    /// The directions of [`Emitter::draw`].
    pub fn directions(&self) -> &Directions {
        &self.directions
    }

    /// Dim part of the radiance from `direction` (unit vector toward the light), W/m²/sr.
    pub fn dim_radiance(&self, direction: DVec3) -> DVec3 {
        interpolate(&self.dim, &self.directions.taps_of(direction))
    }

    /// Radiance from `direction` (unit vector toward the light), W/m²/sr.
    pub fn radiance(&self, direction: DVec3) -> DVec3 {
        let taps = self.directions.taps_of(direction);
        interpolate(&self.dim, &taps) + interpolate(&self.bright, &taps)
    }
}

impl Directions {
    /// In proportion to `weights` of the texels; `None` where all are zero.
    fn new(size: [usize; 2], rotation: f64, weights: Vec<f64>) -> Option<Self> {
        let mut density = weights;
        let row = Distribution::new(density.chunks(size[0]).map(|row| row.iter().sum()))?;
        let column = (density.chunks(size[0]))
            .map(|row| Distribution::new(row.iter().copied()))
            .collect();
        let mean = row.total() / density.len() as f64;
        density.iter_mut().for_each(|density| *density /= mean);
        Some(Self {
            size,
            rotation,
            density,
            row,
            column,
        })
    }

    /// Picks a texel, then a point under its tent: the density is the bilinear interpolation of the texels'
    /// probabilities. At the top and bottom row the tent is folded back, which is what clamping there gives.
    /// Returns the direction, one over its probability density in steradians, and the texels around it.
    fn draw(&self, u: f64, v: f64) -> (DVec3, f64, Taps) {
        let (row, v) = self.row.pick(v);
        let (column, u) = self.column[row].as_ref().map_or((0, u), |c| c.pick(u));
        let x = (column as f64 + 0.5 + tent(u)) / self.size[0] as f64;
        let y = (row as f64 + 0.5 + tent(v)) / self.size[1] as f64;
        let y = if y > 1.0 { 2.0 - y } else { y.abs() };
        let taps = self.taps(x, y);
        let density = interpolate_density(&self.density, &taps);
        let steradians = TAU * PI * (PI * y).sin() / density;
        (direction_at(x, y, self.rotation), steradians, taps)
    }

    /// Draws a direction with two numbers that are uniform in [0, 1).
    pub fn pick(&self, u: f64, v: f64) -> DVec3 {
        self.draw(u, v).0
    }

    /// With which a direction is drawn, per steradian.
    pub fn density(&self, direction: DVec3) -> f64 {
        let sine = direction.x.hypot(direction.z);
        interpolate_density(&self.density, &self.taps_of(direction)) / (TAU * PI * sine)
    }

    fn taps_of(&self, direction: DVec3) -> Taps {
        let azimuth = direction.x.atan2(-direction.z) - self.rotation;
        let y = direction.y.clamp(-1.0, 1.0).acos() / PI;
        self.taps(azimuth / TAU, y)
    }

    /// The four texels around (x, y) in [0, 1]², and their weights. x wraps, y clamps.
    fn taps(&self, x: f64, y: f64) -> Taps {
        let [width, height] = self.size;
        let (x, y) = (x * width as f64 - 0.5, y * height as f64 - 0.5);
        let (fx, fy) = (x - x.floor(), y - y.floor());
        let column = |i: f64| i.rem_euclid(width as f64) as usize % width;
        let row = |i: f64| i.clamp(0.0, height as f64 - 1.0) as usize * width;
        let (left, right) = (column(x.floor()), column(x.floor() + 1.0));
        let (top, bottom) = (row(y.floor()), row(y.floor() + 1.0));
        [
            (top + left, (1.0 - fx) * (1.0 - fy)),
            (top + right, fx * (1.0 - fy)),
            (bottom + left, (1.0 - fx) * fy),
            (bottom + right, fx * fy),
        ]
    }
}

/// Of a texel in a row of an equirectangular map of `size`, sr.
fn solid_angle(size: [usize; 2], row: usize) -> f64 {
    let sine = (PI * (row as f64 + 0.5) / size[1] as f64).sin();
    sine * TAU * PI / (size[0] * size[1]) as f64
}

/// The direction at (x, y) in [0, 1]² of an equirectangular map.
fn direction_at(x: f64, y: f64, rotation: f64) -> DVec3 {
    let ((sine, cosine), azimuth) = ((PI * y).sin_cos(), TAU * x + rotation);
    DVec3::new(sine * azimuth.sin(), cosine, -sine * azimuth.cos())
}

fn interpolate_density(values: &[f64], taps: &Taps) -> f64 {
    taps.iter().map(|&(i, weight)| weight * values[i]).sum()
}

fn interpolate(values: &[DVec3], taps: &Taps) -> DVec3 {
    taps.iter().map(|&(i, weight)| weight * values[i]).sum()
}

/// Inverse of the distribution function of 1 − |x| on [−1, 1].
fn tent(u: f64) -> f64 {
    if u < 0.5 {
        (2.0 * u).sqrt() - 1.0
    } else {
        1.0 - (2.0 * (1.0 - u)).sqrt()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::sequence::{SEQUENCE_LENGTH, sobol_4d};
    use std::sync::Arc;

    fn mean(emitter: &Emitter, value: impl Fn(&Direction) -> f64) -> f64 {
        let total: f64 = (0..SEQUENCE_LENGTH)
            .map(|i| {
                let [u, v, ..] = sobol_4d(i, 5);
                value(&emitter.draw(DVec3::ZERO, u, v))
            })
            .sum();
        total / f64::from(SEQUENCE_LENGTH)
    }

    #[test]
    fn wide_sun_gives_its_irradiance_on_the_plane_that_faces_it() {
        let direction = DVec3::new(-0.8, 0.55, 0.1).normalize();
        let light = Light {
            name: "sun".into(),
            kind: LightKind::Sun {
                direction,
                irradiance: DVec3::new(1.0, 2.0, 3.0),
                angular_radius: 0.8,
            },
        };
        let sun = Emitter::new(&light).unwrap();
        let facing = mean(&sun, |d| d.bright.z * d.direction.dot(direction));
        assert!((facing - 3.0).abs() < 1e-9, "{facing}");
        // A disc of constant radiance is constant over its solid angle.
        let solid_angle = TAU * (1.0 - f64::cos(0.8));
        let radiance = 3.0 / (PI * f64::sin(0.8).powi(2));
        let scalar = mean(&sun, |d| d.bright.z);
        assert!((scalar / (radiance * solid_angle) - 1.0).abs() < 1e-4);
        assert!(
            mean(&sun, |d| f64::from(
                d.direction.dot(direction) < f64::cos(0.8)
            )) < 1e-9
        );
    }

    fn environment(radiance: impl Fn(u32, u32) -> [f32; 3], rotation: f64) -> Emitter {
        let (width, height) = (16, 8);
        let map = EnvironmentMap {
            width,
            height,
            radiance: (0..width * height)
                .map(|i| radiance(i % width, i / width))
                .collect(),
        };
        let light = Light {
            name: "sky".into(),
            kind: LightKind::Environment {
                map: Arc::new(map),
                scale: 2.0,
                rotation,
                casts_caustics: true,
            },
        };
        Emitter::new(&light).unwrap()
    }

    #[test]
    fn constant_environment_has_the_solid_angle_of_the_sphere() {
        let sky = environment(|_, _| [1.0, 0.5, 0.0], 0.3);
        let flux = mean(&sky, |d| d.bright.x + d.dim.x);
        assert!((flux / (8.0 * PI) - 1.0).abs() < 1e-3, "{flux}");
        // π L on any plane: Σ over the hemisphere of the cosine.
        let up = mean(&sky, |d| d.dim.y * d.direction.y.max(0.0));
        assert!((up / PI - 1.0).abs() < 1e-3, "{up}");
    }

    #[test]
    fn one_bright_texel_appears_where_the_convention_says_and_turns_with_the_map() {
        // Column 4 of 16, between u = 1/4 (+x) and 5/16; the row above the horizon.
        let lamp = |x, y| [if (x, y) == (4, 3) { 1000.0 } else { 0.01 }; 3];
        for rotation in [0.0, 1.0] {
            let sky = environment(lamp, rotation);
            let axis = |i: usize| mean(&sky, |d| d.bright.x * d.direction[i]);
            let toward = DVec3::new(axis(0), axis(1), axis(2)).normalize();
            let azimuth: f64 = TAU * 4.5 / 16.0 + rotation;
            let horizontal = DVec3::new(azimuth.sin(), 0.0, -azimuth.cos());
            assert!(toward.dot(horizontal) > 0.97, "{toward}");
            assert!((0.1..0.3).contains(&toward.y), "{toward}");
            assert!(toward.reject_from(horizontal).with_y(0.0).length() < 0.01);
            let Emitter::Environment(map) = &sky else {
                unreachable!()
            };
            assert!(map.dim_radiance(toward).x > 5.0 * map.dim_radiance(-toward).x);
        }
    }

    #[test]
    fn drawing_and_looking_up_agree() {
        let sky = environment(|x, y| [(1 + x) as f32, (1 + y) as f32, 1.0], 0.7);
        let Emitter::Environment(map) = &sky else {
            unreachable!()
        };
        // Σ dim/density over draws = ∫ dim dω, by a grid of directions as well.
        let by_draws = mean(&sky, |d| d.dim.x * (1.5 + d.direction.z));
        let (rows, columns) = (400, 800);
        let mut by_grid = 0.0;
        for row in 0..rows {
            let y: f64 = 1.0 - 2.0 * (row as f64 + 0.5) / rows as f64;
            for column in 0..columns {
                let azimuth = TAU * (column as f64 + 0.5) / columns as f64;
                let sine = (1.0 - y * y).sqrt();
                let d = DVec3::new(sine * azimuth.sin(), y, -sine * azimuth.cos());
                by_grid += map.dim_radiance(d).x * (1.5 + d.z);
            }
        }
        by_grid *= 4.0 * PI / f64::from(rows * columns);
        assert!(
            (by_draws / by_grid - 1.0).abs() < 2e-3,
            "{by_draws} {by_grid}"
        );
    }
}
