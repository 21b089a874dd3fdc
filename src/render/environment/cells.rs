//! Environment cells: rectangles of azimuth and sine of elevation with a mean radiance, which act as lights.
//!
//! The cells tile the sphere, so that constant radiance stays constant. Splits minimise the displacement of light and
//! therefore follow the edges of windows first.

use crate::render::environment::cell::EnvironmentCell;
use crate::render::environment::mips::mip_chain;
use crate::scene::EnvironmentMap;
use glam::{DVec2, DVec3};
use std::borrow::Cow;
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::{PI, TAU};

/// Maximum number of rows of the image whose pixels are split.
const MAX_ROWS: u32 = 1024;
/// Minimum number of rows: pixels of smaller images are subdivided.
const MIN_ROWS: u32 = 64;
/// Share of the light of a constant rect that counts as displaced, in addition to the light that differs from the mean:
/// visibility and refraction are evaluated once for the whole cell. 0.25 to 2.5 gave the same results.
const EVEN_SHARE: f64 = 0.7;
/// Share of the sum over all pixels that differences of sums may have by rounding alone: where an image is black.
const ROUNDING: f64 = 1e-12;
/// Extent of a cell, rad, above which its error is raised: very wide cells have no meaningful centre.
const MAX_EXTENT: f64 = 1.6;

/// A rectangle of pixels of the image.
#[derive(Debug, Clone, Copy)]
pub struct CellRect {
    left: usize,
    top: usize,
    right: usize,
    bottom: usize,
    /// Sum over the colours, W/m².
    pub flux: f64,
    /// Variance of the directions, both axes together.
    pub variance: f64,
    /// Light times its displacement, W/m² rad.
    pub error: f64,
}

impl CellRect {
    fn sides(&self) -> [usize; 4] {
        [self.left, self.top, self.right, self.bottom]
    }

    fn can_be_split(&self) -> bool {
        self.error > 0.0 && (self.right - self.left > 1 || self.bottom - self.top > 1)
    }
}

impl PartialEq for CellRect {
    fn eq(&self, other: &Self) -> bool {
        self.cmp(other) == Ordering::Equal
    }
}
impl Eq for CellRect {}
impl PartialOrd for CellRect {
    fn partial_cmp(&self, other: &Self) -> Option<Ordering> {
        Some(self.cmp(other))
    }
}
impl Ord for CellRect {
    /// Rects of equal error are ordered by position, so that the result is deterministic.
    fn cmp(&self, other: &Self) -> Ordering {
        let place = |rect: &CellRect| (rect.top, rect.left);
        (self.error.total_cmp(&other.error)).then_with(|| place(other).cmp(&place(self)))
    }
}

/// Subdivisions of an environment into rects.
pub struct Subdivision<'a> {
    map: Cow<'a, EnvironmentMap>,
    width: usize,
    height: usize,
    /// Per number of rects asked for.
    pub rects: Vec<Vec<CellRect>>,
}

/// Sums over all pixels above and left of a corner: solid angle, flux, flux × radiance.
struct Sums {
    width: usize,
    height: usize,
    corners: Vec<[f64; 3]>,
}

impl Sums {
    fn new(map: &EnvironmentMap) -> Self {
        let (width, height) = (map.width as usize, map.height as usize);
        let mut corners = vec![[0.0; 3]; (width + 1) * (height + 1)];
        for y in 0..height {
            let solid_angle = solid_angle(map, y as u32);
            let mut row = [0.0; 3];
            for x in 0..width {
                let radiance = sum(map.radiance[y * width + x]);
                row[0] += solid_angle;
                row[1] += radiance * solid_angle;
                row[2] += radiance * radiance * solid_angle;
                let corner = (y + 1) * (width + 1) + x + 1;
                let above = corners[corner - width - 1];
                corners[corner] = [0, 1, 2].map(|k| above[k] + row[k]);
            }
        }
        Self {
            width,
            height,
            corners,
        }
    }

    fn rect(&self, [left, top, right, bottom]: [usize; 4]) -> CellRect {
        let at = |x: usize, y: usize| self.corners[y * (self.width + 1) + x];
        let [a, b, c, d] = [
            at(left, top),
            at(right, top),
            at(left, bottom),
            at(right, bottom),
        ];
        let [solid_angle, flux, square] = [0, 1, 2].map(|k| match d[k] - b[k] - c[k] + a[k] {
            sum if sum > ROUNDING * self.corners[self.corners.len() - 1][k] => sum,
            _ => 0.0,
        });
        let up = (bottom - top) as f64 * PI / self.height as f64;
        let across = (right - left) as f64 * TAU / self.width as f64;
        let level = solid_angle / up;
        let variance = (level * level + up * up) / 12.0;
        // At least the sum of |radiance - mean| (Cauchy & Schwarz).
        let uneven = (square * solid_angle - flux * flux).max(0.0).sqrt();
        let too_wide = (across.max(up) / MAX_EXTENT).max(1.0).powi(4);
        CellRect {
            left,
            top,
            right,
            bottom,
            flux,
            variance,
            error: (uneven + EVEN_SHARE * flux * too_wide) * variance.sqrt(),
        }
    }

    /// The halves of about equal flux, across the longer side.
    fn halves(&self, rect: &CellRect) -> [CellRect; 2] {
        let [left, top, right, bottom] = rect.sides();
        let middle = PI * (top + bottom) as f64 / (2 * self.height) as f64;
        let across = middle.sin() * TAU * (right - left) as f64 / self.width as f64;
        let up = PI * (bottom - top) as f64 / self.height as f64;
        let is_upright = bottom - top == 1 || right - left > 1 && across > up;
        let split = |at: usize| match is_upright {
            true => [[left, top, at, bottom], [at, top, right, bottom]],
            false => [[left, top, right, at], [left, at, right, bottom]],
        };
        let places = match is_upright {
            true => left + 1..right,
            false => top + 1..bottom,
        };
        places
            .map(|at| split(at).map(|half| self.rect(half)))
            .min_by(|a, b| {
                let difference = |[a, b]: &[CellRect; 2]| (a.flux - b.flux).abs();
                difference(a).total_cmp(&difference(b))
            })
            .expect("more than one pixel")
    }

    /// The split with the smallest error.
    fn split(&self, rect: &CellRect) -> [CellRect; 2] {
        let [left, top, right, bottom] = rect.sides();
        let upright = (left + 1..right).map(|x| [[left, top, x, bottom], [x, top, right, bottom]]);
        let level = (top + 1..bottom).map(|y| [[left, top, right, y], [left, y, right, bottom]]);
        upright
            .chain(level)
            .map(|halves| halves.map(|half| self.rect(half)))
            .min_by(|a, b| {
                let error = |[a, b]: &[CellRect; 2]| a.error + b.error;
                error(a).total_cmp(&error(b))
            })
            .expect("more than one pixel")
    }
}

/// Divides `map` into cells of about equal flux, at most `counts` (increasing or decreasing), in the order of their rows.
pub fn divide_by_flux<const N: usize>(
    map: &EnvironmentMap,
    counts: [usize; N],
) -> [Vec<EnvironmentCell>; N] {
    let map = enlarged(map);
    let (width, height, radiance) = reduced(&map);
    let sums = Sums::new(&EnvironmentMap {
        width,
        height,
        radiance,
    });
    let by_flux = |rect: CellRect| CellRect {
        error: rect.flux,
        ..rect
    };
    let whole = by_flux(sums.rect([0, 0, sums.width, sums.height]));
    let halves = |rect: &CellRect| sums.halves(rect).map(by_flux);
    let rects = counts.map(|count| divided(whole, &[count], halves).remove(0));
    let subdivision = Subdivision {
        map,
        width: sums.width,
        height: sums.height,
        rects: rects.into(),
    };
    let cells_of = |of: usize| (subdivision.rects[of].iter()).map(|rect| subdivision.cell(rect));
    std::array::from_fn(|of| cells_of(of).collect())
}

/// Divides a rect into `counts` (increasing) or as many as can be split, the one with the largest error first; of each, those that
/// have light, in the order of their rows.
fn divided(
    whole: CellRect,
    counts: &[usize],
    split: impl Fn(&CellRect) -> [CellRect; 2],
) -> Vec<Vec<CellRect>> {
    let (mut heap, mut unsplittable) = (BinaryHeap::from([whole]), Vec::new());
    (counts.iter())
        .map(|&count| {
            while heap.len() + unsplittable.len() < count {
                match heap.pop() {
                    Some(worst) if worst.can_be_split() => heap.extend(split(&worst)),
                    Some(worst) => unsplittable.push(worst),
                    None => break,
                }
            }
            let mut rects: Vec<CellRect> = heap.iter().chain(&unsplittable).copied().collect();
            rects.retain(|rect| rect.flux > 0.0);
            rects.sort_by_key(|rect| (rect.top, rect.left));
            rects
        })
        .collect()
}

/// The finest mip level of `map` that is split.
fn reduced(map: &EnvironmentMap) -> (u32, u32, Vec<[f32; 3]>) {
    (mip_chain(map, 1.0).into_iter())
        .find(|(_, height, _)| *height <= MAX_ROWS)
        .expect("the last level has one row")
}

/// Subdivides `map` into `counts` rects (increasing), or as many as there are pixels.
pub fn subdivide<'a>(map: &'a EnvironmentMap, counts: &[usize]) -> Subdivision<'a> {
    let map = enlarged(map);
    let (width, height, radiance) = reduced(&map);
    let sums = Sums::new(&EnvironmentMap {
        width,
        height,
        radiance,
    });
    let whole = sums.rect([0, 0, sums.width, sums.height]);
    let rects = divided(whole, counts, |rect| sums.split(rect));
    Subdivision {
        map,
        width: sums.width,
        height: sums.height,
        rects,
    }
}

impl Subdivision<'_> {
    /// The cell with the mean and variance of the light in a rect. For constant radiance the cell equals the rect.
    pub fn cell(&self, rect: &CellRect) -> EnvironmentCell {
        let map = &*self.map;
        // Pixels of the full image whose centres are inside.
        let first = |edge: usize, coarse: usize, fine: u32| {
            ((edge * fine as usize) as f64 / coarse as f64 - 0.5).ceil() as u32
        };
        let columns = |edge| first(edge, self.width, map.width);
        let rows = |edge| first(edge, self.height, map.height);
        let mut irradiance = DVec3::ZERO;
        let (mut flux, mut mean, mut square) = (0.0, DVec2::ZERO, DVec2::ZERO);
        for y in rows(rect.top)..rows(rect.bottom) {
            let solid_angle = solid_angle(map, y);
            let edge = |row: u32| (f64::from(row) * PI / f64::from(map.height)).cos();
            let (low, high) = (edge(y + 1), edge(y));
            let size = DVec2::new(TAU / f64::from(map.width), high - low);
            for x in columns(rect.left)..columns(rect.right) {
                let rgb = map.radiance[(y * map.width + x) as usize];
                let place = DVec2::new((f64::from(x) + 0.5) * size.x, 0.5 * (low + high));
                let weight = sum(rgb) * solid_angle;
                irradiance += DVec3::from_array(rgb.map(f64::from)) * solid_angle;
                flux += weight;
                mean += weight * place;
                square += weight * (place * place + size * size / 12.0);
            }
        }
        mean /= flux;
        let half = (3.0 * (square / flux - mean * mean)).max(DVec2::ZERO);
        EnvironmentCell {
            azimuth: mean.x,
            half_azimuth: half.x.sqrt(),
            sine: mean.y,
            half_sine: half.y.sqrt(),
            irradiance,
        }
    }
}

/// Total flux density of all directions, each on a plane that faces it, W/m², all channels together.
pub fn flux(map: &EnvironmentMap) -> f64 {
    let rows = map.radiance.chunks(map.width as usize).enumerate();
    let of_row = |(y, row): (usize, &[[f32; 3]])| -> f64 {
        solid_angle(map, y as u32) * row.iter().map(|&rgb| sum(rgb)).sum::<f64>()
    };
    rows.map(of_row).sum()
}

/// The map, or a small map with every pixel repeated.
fn enlarged(map: &EnvironmentMap) -> Cow<'_, EnvironmentMap> {
    let times = |side: u32, least: u32| least.div_ceil(side);
    let (across, up) = (times(map.width, 2 * MIN_ROWS), times(map.height, MIN_ROWS));
    if across == 1 && up == 1 {
        return Cow::Borrowed(map);
    }
    let (width, height) = (map.width * across, map.height * up);
    let pixel = |i: u32| map.radiance[(i / width / up * map.width + i % width / across) as usize];
    Cow::Owned(EnvironmentMap {
        width,
        height,
        radiance: (0..width * height).map(pixel).collect(),
    })
}

fn sum(rgb: [f32; 3]) -> f64 {
    rgb.iter().map(|&c| f64::from(c)).sum()
}

/// Solid angle of a pixel, sr.
fn solid_angle(map: &EnvironmentMap, row: u32) -> f64 {
    let edge = |row: u32| (f64::from(row) * PI / f64::from(map.height)).cos();
    (edge(row) - edge(row + 1)) * TAU / f64::from(map.width)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::gpu_types::constants::CELL_SPREAD;
    use glam::Vec3;

    fn map(height: u32, radiance: impl Fn(u32, u32) -> f32) -> EnvironmentMap {
        let width = 2 * height;
        EnvironmentMap {
            width,
            height,
            radiance: (0..width * height)
                .map(|i| [radiance(i % width, i / width), 0.0, 1.0])
                .collect(),
        }
    }

    /// The cells have all the light for every number of rects, and for images with fewer or more rows than are split.
    #[test]
    fn cells_keep_the_light() {
        for height in [1, 256, 2048] {
            let map = map(height, |x, y| {
                if x < 9 && y < 80 {
                    500.0
                } else {
                    1.0 + x as f32
                }
            });
            let mut expected = DVec3::ZERO;
            for (y, row) in map.radiance.chunks(map.width as usize).enumerate() {
                let pixels = row.iter().map(|rgb| DVec3::from_array(rgb.map(f64::from)));
                expected += pixels.sum::<DVec3>() * solid_angle(&map, y as u32);
            }
            assert!((expected.z / (4.0 * PI) - 1.0).abs() < 1e-12);
            let subdivision = subdivide(&map, &[2, 16, 300]);
            for rects in &subdivision.rects {
                let cells = rects.iter().map(|rect| subdivision.cell(rect));
                let sum: DVec3 = cells.map(|cell| cell.irradiance).sum();
                assert!((sum / expected - 1.0).abs().max_element() < 1e-6, "{sum}");
            }
        }
    }

    /// A window in a wall of constant radiance is a cell of its own, and each cell covers its rect to the edge.
    #[test]
    fn a_window_is_cut_out() {
        let (columns, rows) = (100..140, 30..64);
        let map = map(128, |x, y| {
            match columns.contains(&x) && rows.contains(&y) {
                true => 50.0,
                false => 1.0,
            }
        });
        let subdivision = subdivide(&map, &[24]);
        let mut covered = 0.0;
        for rect in &subdivision.rects[0] {
            let inside =
                |x: usize, y: usize| columns.contains(&(x as u32)) && rows.contains(&(y as u32));
            let is_window = inside(rect.left, rect.top);
            assert_eq!(inside(rect.right - 1, rect.bottom - 1), is_window);
            let cell = subdivision.cell(rect);
            let expected = (rect.right - rect.left) as f64 * PI / 256.0;
            assert!((cell.half_azimuth / expected - 1.0).abs() < 1e-6);
            covered += 4.0 * cell.half_azimuth * cell.half_sine;
        }
        assert!((covered / (4.0 * PI) - 1.0).abs() < 1e-3, "{covered}");
    }

    /// Where an image is black there is no cell, and every cell has a direction.
    #[test]
    fn black_areas_have_no_cells() {
        let windows = [[10..50, 20..70], [90..97, 30..31], [130..250, 100..117]];
        let map = map(128, |x, y| {
            let is_inside = |[columns, rows]: &[std::ops::Range<u32>; 2]| {
                columns.contains(&x) && rows.contains(&y)
            };
            match windows.iter().position(is_inside) {
                Some(window) => 0.3 + 17.7 * window as f32,
                None => 0.0,
            }
        });
        let map = EnvironmentMap {
            radiance: map.radiance.iter().map(|&[r, ..]| [r; 3]).collect(),
            ..map
        };
        let subdivision = subdivide(&map, &[64, 300]);
        let of_rects = |rects: &Vec<CellRect>| -> Vec<_> {
            rects.iter().map(|rect| subdivision.cell(rect)).collect()
        };
        let cells = subdivision.rects.iter().map(of_rects);
        for cells in cells.chain(divide_by_flux(&map, [64, 256])) {
            let sum: f64 = cells.iter().map(|cell| cell.irradiance.element_sum()).sum();
            assert!((sum / flux(&map) - 1.0).abs() < 1e-9);
            for cell in &cells {
                assert!(cell.irradiance.min_element() > 0.0 && cell.azimuth.is_finite());
            }
        }
    }

    /// A disc in the environment, nearly the largest that acts as a sun, becomes a light with the covariance of the disc.
    #[test]
    fn a_disc_has_its_covariance() {
        let radius = 0.05;
        let toward = DVec3::new(0.6, 0.64, -0.48);
        let map = map(1024, |x, y| {
            let azimuth = (f64::from(x) + 0.5) * TAU / 2048.0;
            let (sine, cosine) = ((f64::from(y) + 0.5) * PI / 1024.0).sin_cos();
            let s = DVec3::new(sine * azimuth.sin(), cosine, -sine * azimuth.cos());
            f32::from(s.dot(toward) > f64::cos(radius))
        });
        let disc = EnvironmentMap {
            radiance: map.radiance.iter().map(|&[r, ..]| [r; 3]).collect(),
            ..map
        };
        let subdivision = subdivide(&disc, &[1]);
        let cell = subdivision.cell(&subdivision.rects[0][0]);
        let light = cell.sun(2.0, 0.3);
        let kernel = cell.light(2.0, 0.3);
        for (light, spread) in [(&light, 1.0), (&kernel, CELL_SPREAD.into())] {
            let expected = spread * 0.25 * radius * radius;
            for axis in [light.axis1, light.axis2] {
                let variance = f64::from(axis.length_squared());
                assert!((variance / expected - 1.0).abs() < 0.03, "{variance}");
            }
        }
        let (sine, cosine) = f32::sin_cos(0.3);
        let [x, y, z] = toward.as_vec3().to_array();
        // Turning adds to the azimuth atan2(x, -z).
        let turned = Vec3::new(x * cosine - z * sine, y, x * sine + z * cosine);
        assert!(light.place.distance(turned) < 1e-3);
    }
}
