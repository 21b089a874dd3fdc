//! An environment as cells: parts of the sky that are imaged like suns, each a rectangle of azimuth and sine
//! of elevation with a mean radiance.
//!
//! They tile the sky, so that what is even stays even, and are cut where that leaves the least light out of
//! its place: along the edges of windows first.

use crate::render::environment::mips::mip_chain;
use crate::render::gpu_types;
use crate::scene::EnvironmentMap;
use glam::{DVec2, DVec3};
use std::borrow::Cow;
use std::cmp::Ordering;
use std::collections::BinaryHeap;
use std::f64::consts::{PI, TAU};

/// Rows of the image at which the sky is cut, at most.
const MAX_ROWS: u32 = 1024;
/// And at least: pixels of a smaller image are cut, too.
const MIN_ROWS: u32 = 64;
/// How much of the light of an even part counts as out of place, beside what differs from its mean: what is
/// seen of a cell is seen of all of it, and light bends alike from all of it. 0.25 to 2.5 gave the same.
const EVEN_SHARE: f64 = 0.7;
/// Cells wider than this, rad, count as worse than they are: a quarter of the sky has no middle.
const MAX_EXTENT: f64 = 1.6;
/// Variance of a cell's kernel over the cell's, where it has one, so that neighbours add up evenly: as of a
/// patch's.
const SPREAD: f64 = 1.3;

/// A part of the sky, before it is turned by the rotation of the environment.
pub struct EnvironmentCell {
    /// Of its middle, rad.
    azimuth: f64,
    half_azimuth: f64,
    /// Of the elevation of its middle.
    sine: f64,
    half_sine: f64,
    /// On a plane that faces it, W/m² at scale 1.
    irradiance: DVec3,
}

impl EnvironmentCell {
    /// The light that it is. `rotation` in rad.
    pub fn light(&self, scale: f32, rotation: f32) -> gpu_types::Light {
        self.spread_light(scale, rotation, SPREAD)
    }

    /// The light that it is where it need not run into others.
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
            place: DVec3::new(cosine * x, self.sine, cosine * z).as_vec3(),
            // As if it were a disc of this variance.
            size: (2.0 * (across * across + along * along)).sqrt() as f32,
            power: scale * self.irradiance.as_vec3(),
            is_lamp: 0,
            axis1: (across * east).as_vec3(),
            half_azimuth: self.half_azimuth as f32,
            axis2: (along * up).as_vec3(),
            half_sine: self.half_sine as f32,
        }
    }

    /// Of its directions, rad: level and upward.
    fn deviations(&self) -> [f64; 2] {
        let elevation = |sine: f64| sine.clamp(-1.0, 1.0).asin();
        let [low, high] = [-1.0, 1.0].map(|side| elevation(self.sine + side * self.half_sine));
        let cosine = (1.0 - self.sine * self.sine).max(0.0).sqrt();
        [self.half_azimuth * cosine, 0.5 * (high - low)].map(|half| half / 3f64.sqrt())
    }
}

/// A rectangle of pixels of the image at which the sky is cut.
#[derive(Debug, Clone, Copy)]
pub struct CellRect {
    left: usize,
    top: usize,
    right: usize,
    bottom: usize,
    /// Sum over the colours, W/m².
    pub flux: f64,
    /// Of the directions, both axes together.
    pub variance: f64,
    /// Light times how far it is out of place, W/m² rad.
    pub error: f64,
}

impl CellRect {
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
    /// Equal errors by place, so that divisions do not depend on chance.
    fn cmp(&self, other: &Self) -> Ordering {
        let place = |rect: &CellRect| (rect.top, rect.left);
        (self.error.total_cmp(&other.error)).then_with(|| place(other).cmp(&place(self)))
    }
}

/// Divisions of an environment.
pub struct Subdivision<'a> {
    map: Cow<'a, EnvironmentMap>,
    width: usize,
    height: usize,
    /// By count.
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
        let [solid_angle, flux, square] = [0, 1, 2].map(|k| (d[k] - b[k] - c[k] + a[k]).max(0.0));
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

    /// The two parts of the least error.
    fn split(&self, rect: &CellRect) -> [CellRect; 2] {
        let &CellRect {
            left,
            top,
            right,
            bottom,
            ..
        } = rect;
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

/// Divisions of `map` into `counts` parts, rising, or as many as there are pixels.
pub fn subdivide<'a>(map: &'a EnvironmentMap, counts: &[usize]) -> Subdivision<'a> {
    let map = enlarged(map);
    let (width, height, radiance) = (mip_chain(&map, 1.0).into_iter())
        .find(|(_, height, _)| *height <= MAX_ROWS)
        .expect("the last level has one row");
    let sums = Sums::new(&EnvironmentMap {
        width,
        height,
        radiance,
    });
    let (mut heap, mut unsplittable) = (BinaryHeap::new(), Vec::new());
    heap.push(sums.rect([0, 0, sums.width, sums.height]));
    let rects = (counts.iter())
        .map(|&count| {
            while heap.len() + unsplittable.len() < count {
                match heap.pop() {
                    Some(worst) if worst.can_be_split() => heap.extend(sums.split(&worst)),
                    Some(worst) => unsplittable.push(worst),
                    None => break,
                }
            }
            let mut rects: Vec<CellRect> = heap.iter().chain(&unsplittable).copied().collect();
            rects.retain(|rect| rect.flux > 0.0);
            rects.sort_by_key(|rect| (rect.top, rect.left));
            rects
        })
        .collect();
    Subdivision {
        map,
        width: sums.width,
        height: sums.height,
        rects,
    }
}

impl Subdivision<'_> {
    /// The rectangle with the mean and variance of the light in a part, which for an even part is the part.
    pub fn cell(&self, rect: &CellRect) -> EnvironmentCell {
        let map = &*self.map;
        // Pixels of the image itself whose middles are within.
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

/// Of all its light, on planes that face it, W/m², all channels together.
pub fn flux(map: &EnvironmentMap) -> f64 {
    let rows = map.radiance.chunks(map.width as usize).enumerate();
    let of_row = |(y, row): (usize, &[[f32; 3]])| -> f64 {
        solid_angle(map, y as u32) * row.iter().map(|&rgb| sum(rgb)).sum::<f64>()
    };
    rows.map(of_row).sum()
}

/// The map itself, or with every pixel many times.
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

/// Of a pixel, sr.
fn solid_angle(map: &EnvironmentMap, row: u32) -> f64 {
    let edge = |row: u32| (f64::from(row) * PI / f64::from(map.height)).cos();
    (edge(row) - edge(row + 1)) * TAU / f64::from(map.width)
}

#[cfg(test)]
mod tests {
    use super::*;
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

    /// Whatever the division, also one at fewer or more rows than the image has, the cells have all the light.
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

    /// A window in an even wall is a cell of its own, and each cell covers its part to the edge.
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

    /// A disc of the sky is a light of its covariance.
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
        for (light, spread) in [(&light, 1.0), (&kernel, SPREAD)] {
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
