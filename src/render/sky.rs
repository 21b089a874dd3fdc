//! An environment as cells: parts of the sky that are imaged like suns, each with a covariance of its
//! own.
//!
//! Radiance beyond [`BRIGHT`] times the mean is divided by itself, at the image's own resolution, so that
//! no cell smears a window over the wall around it.

use super::layout;
use super::split::{Cells, Moments, Point, split};
use super::upload::mip_chain;
use crate::scene::EnvironmentMap;
use glam::{DMat2, DVec2, DVec3, Vec3};
use std::f64::consts::{PI, TAU};
use std::ops::Range;

/// Radiance above so many times the mean is bright (4 to 64 times gave the same).
const BRIGHT: f64 = 8.0;
/// Rows of the image in which the rest is divided.
const DIM_ROWS: u32 = 128;
/// Variance of a cell's kernel over the cell's, so that neighbours add up evenly: as of a patch's.
const SPREAD: f64 = 1.3;

/// A part of the sky, before it is turned by the rotation of the environment.
pub struct SkyCell {
    /// Unit, toward its middle.
    direction: DVec3,
    /// Root of the covariance of its directions, rad.
    axes: [DVec3; 2],
    /// On a plane that faces it, W/m² at scale 1.
    irradiance: DVec3,
}

impl SkyCell {
    /// The light that it is. `rotation` in rad.
    pub fn light(&self, scale: f32, rotation: f32) -> layout::Light {
        let turned = |v: DVec3| {
            let (sine, cosine) = f64::from(rotation).sin_cos();
            // The azimuth is atan2(x, -z).
            DVec3::new(cosine * v.x - sine * v.z, v.y, sine * v.x + cosine * v.z).as_vec3()
        };
        layout::Light {
            place: turned(self.direction),
            // As if it were a disc of this variance.
            size: (2.0 * self.variance()).sqrt() as f32,
            power: scale * self.irradiance.as_vec3(),
            is_lamp: 0,
            axis1: turned(self.axes[0]),
            unused0: 0.0,
            axis2: turned(self.axes[1]),
            unused1: 0.0,
        }
    }

    /// The cell where it need not run into others.
    pub fn alone(self) -> Self {
        Self {
            axes: self.axes.map(|axis| axis / SPREAD.sqrt()),
            ..self
        }
    }

    /// Sum over the colours, W/m².
    pub fn flux(&self) -> f64 {
        self.irradiance.element_sum()
    }

    /// Variance of the directions, both axes together.
    pub fn variance(&self) -> f64 {
        self.axes.iter().map(|axis| axis.length_squared()).sum()
    }
}

/// A piece of the sky that is not divided further.
struct Texel {
    irradiance: DVec3,
    /// Of its directions, on each axis.
    variance: f64,
}

/// Divisions of `map` into `counts` cells, rising.
pub fn sky_cells(map: &EnvironmentMap, counts: &[usize]) -> Vec<Vec<SkyCell>> {
    let rows = map.radiance.chunks(map.width as usize).enumerate();
    let mean: f64 = rows
        .map(|(row, pixels)| {
            let sum: f64 = pixels.iter().flatten().map(|&c| f64::from(c)).sum();
            sum * solid_angle(map, row as u32) / (4.0 * PI)
        })
        .sum();
    if mean <= 0.0 {
        return counts.iter().map(|_| Vec::new()).collect();
    }
    let threshold = BRIGHT * mean;
    // Share of a pixel's radiance that is not bright.
    let dim_share = |rgb: [f32; 3]| {
        let sum: f64 = rgb.iter().map(|&c| f64::from(c)).sum();
        (threshold / sum.max(f64::MIN_POSITIVE)).min(1.0)
    };
    let mut places = Vec::new();
    let mut texels = Vec::new();
    let mut add = |map: &EnvironmentMap, share: &dyn Fn([f32; 3]) -> f64| {
        for row in 0..map.height {
            let solid_angle = solid_angle(map, row);
            let (sine, cosine) = ((f64::from(row) + 0.5) * PI / f64::from(map.height)).sin_cos();
            for column in 0..map.width {
                let rgb = map.radiance[(row * map.width + column) as usize];
                let share = share(rgb);
                let radiance = DVec3::from_array(rgb.map(f64::from));
                let irradiance = radiance * (share * solid_angle);
                if irradiance.element_sum() <= 0.0 {
                    continue;
                }
                let azimuth = (f64::from(column) + 0.5) * TAU / f64::from(map.width);
                places.push(Point {
                    place: [sine * azimuth.sin(), cosine, -sine * azimuth.cos()],
                    weight: irradiance.element_sum(),
                });
                texels.push(Texel {
                    irradiance,
                    variance: solid_angle / 12.0,
                });
            }
        }
        texels.len()
    };
    let bright = add(map, &|rgb| 1.0 - dim_share(rgb));
    // Averages over solid angle of what is not bright.
    let dim = EnvironmentMap {
        width: map.width,
        height: map.height,
        radiance: (map.radiance.iter())
            .map(|&rgb| rgb.map(|c| (f64::from(c) * dim_share(rgb)) as f32))
            .collect(),
    };
    let (width, height, radiance) = (mip_chain(&dim, 1.0).into_iter())
        .find(|(_, height, _)| *height <= DIM_ROWS)
        .expect("the last level has one row");
    let all = add(
        &EnvironmentMap {
            width,
            height,
            radiance,
        },
        &|_| 1.0,
    );
    let cells = split(&places, &[0..bright, bright..all], counts);
    (cells.divisions.iter())
        .map(|division| {
            (division.iter())
                .map(|range| sky_cell(&places, &texels, &cells, range))
                .collect()
        })
        .collect()
}

/// Of a pixel, sr.
fn solid_angle(map: &EnvironmentMap, row: u32) -> f64 {
    let edge = |row: u32| (f64::from(row) * PI / f64::from(map.height)).cos();
    (edge(row) - edge(row + 1)) * TAU / f64::from(map.width)
}

fn sky_cell(places: &[Point<3>], texels: &[Texel], cells: &Cells, range: &Range<usize>) -> SkyCell {
    let members = || cells.points(range);
    let moments = Moments::of(members().map(|i| &places[i]));
    let mean = DVec3::from_array(moments.mean);
    // All directions alike have no middle; any will do.
    let direction = mean.try_normalize().unwrap_or(DVec3::Y);
    let (a, b) = direction.any_orthonormal_pair();
    let mut covariance = DMat2::ZERO;
    let (mut irradiance, mut variance) = (DVec3::ZERO, 0.0);
    for i in members() {
        let off = DVec3::from_array(places[i].place) - mean;
        let off = DVec2::new(off.dot(a), off.dot(b));
        covariance += DMat2::from_cols(off * off.x, off * off.y) * places[i].weight;
        irradiance += texels[i].irradiance;
        variance += texels[i].variance * places[i].weight;
    }
    let covariance =
        (covariance + DMat2::from_diagonal(DVec2::splat(variance))) * (SPREAD / moments.weight);
    let axes = root(covariance).map(|v| v.x * a + v.y * b);
    SkyCell {
        direction,
        axes,
        irradiance,
    }
}

/// Two vectors along the principal axes whose outer products add up to the symmetric matrix `m`.
pub fn root(m: DMat2) -> [DVec2; 2] {
    let (xx, xy, yy) = (m.x_axis.x, m.x_axis.y, m.y_axis.y);
    let (middle, half) = (0.5 * (xx + yy), 0.5 * (xx - yy));
    let apart = half.hypot(xy);
    let angle = 0.5 * xy.atan2(half);
    let axis = DVec2::from_angle(angle);
    [
        axis * (middle + apart).max(0.0).sqrt(),
        axis.perp() * (middle - apart).max(0.0).sqrt(),
    ]
}

/// The root of the covariance of the directions of a sun's disc: of radius a, a²/4 on each axis.
pub fn disc_axes(direction: DVec3, angular_radius: f64) -> [Vec3; 2] {
    let (a, b) = direction.any_orthonormal_pair();
    [a, b].map(|axis| (0.5 * angular_radius * axis).as_vec3())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(width: u32, height: u32, radiance: impl Fn(u32, u32) -> f32) -> EnvironmentMap {
        EnvironmentMap {
            width,
            height,
            radiance: (0..width * height)
                .map(|i| [radiance(i % width, i / width), 0.0, 1.0])
                .collect(),
        }
    }

    /// Whatever the division, the cells have all the light, and its mean direction.
    #[test]
    fn cells_keep_the_light() {
        let map = map(512, 256, |x, y| {
            if x < 9 && y < 80 {
                500.0
            } else {
                1.0 + x as f32
            }
        });
        let mut expected = DVec3::ZERO;
        for (i, rgb) in map.radiance.iter().enumerate() {
            let row = (i / 512) as f64;
            let edge = |row: f64| (row / 256.0 * PI).cos();
            let solid_angle = (edge(row) - edge(row + 1.0)) * TAU / 512.0;
            expected += DVec3::from_array(rgb.map(f64::from)) * solid_angle;
        }
        assert!((expected.z / (4.0 * PI) - 1.0).abs() < 1e-12);
        for cells in sky_cells(&map, &[2, 16, 300]) {
            let sum: DVec3 = cells.iter().map(|cell| cell.irradiance).sum();
            assert!((sum / expected - 1.0).abs().max_element() < 1e-6, "{sum}");
        }
    }

    /// A disc of the sky is one cell of its covariance.
    #[test]
    fn a_disc_has_its_covariance() {
        let radius = 0.2;
        let toward = DVec3::new(0.6, 0.64, -0.48);
        let (width, height) = (1024, 512);
        let map = EnvironmentMap {
            width,
            height,
            radiance: (0..width * height)
                .map(|i| {
                    let azimuth = (f64::from(i % width) + 0.5) * TAU / f64::from(width);
                    let (sine, cosine) =
                        ((f64::from(i / width) + 0.5) * PI / f64::from(height)).sin_cos();
                    let s = DVec3::new(sine * azimuth.sin(), cosine, -sine * azimuth.cos());
                    [f32::from(s.dot(toward) > f64::cos(radius)); 3]
                })
                .collect(),
        };
        let cell = &sky_cells(&map, &[1])[0][0];
        assert!(cell.direction.distance(toward) < 1e-3);
        // In directions, not angles, it is a little smaller than radius²/4.
        let expected = SPREAD * 0.25 * radius * radius;
        for axis in cell.axes {
            assert!((axis.length_squared() / expected - 1.0).abs() < 0.03);
        }
        let light = cell.light(2.0, 0.3);
        let (sine, cosine) = f32::sin_cos(0.3);
        let [x, y, z] = toward.as_vec3().to_array();
        // Turning adds to the azimuth atan2(x, -z).
        let turned = Vec3::new(x * cosine - z * sine, y, x * sine + z * cosine);
        assert!(light.place.distance(turned) < 1e-3);
    }
}
