//! Gathering: points in a texel, points on the mirrors, and the light seen from one in the other.
//!
//! Smooth light over wide mirrors is found with far fewer points than by light tracing, but the
//! factor 1/d² of the irradiance integral is unbounded where a mirror touches the receiver. So
//! every pair of points at distance d is shared between both methods:
//!
//! ```text
//! gathering   d²/(d² + c²)        light tracing   c²/(d² + c²)
//! ```
//!
//! and what is gathered is bounded, without bias. Only the dim part of an environment is
//! gathered, since a bright spot fills a small part of the mirrors.

use crate::error::Result;
use crate::reference::estimate::{Estimate, Moments, REPLICATES};
use crate::reference::lights::{Emitter, Environment};
use crate::reference::mirrors::{Distribution, MirrorTriangle};
use crate::reference::problem::Problem;
use crate::reference::receiver::ReceiverPoint;
use crate::reference::rounds::{Method, moments_of_values, power_of_two};
use crate::reference::sequence::{sobol_4d, split_mix};
use glam::DVec3;
use rayon::prelude::*;

/// The distance c over the square root of the receiver's area.
const NEAR: f64 = 0.03;

/// Most patches that a texel chooses from; a patch is a run of triangles.
const MAX_PATCHES: usize = 1024;

/// Share of the points that falls on the patches in proportion to their areas alone, so that
/// none is missed whose middle looks dark.
const BY_AREA: f64 = 0.2;

/// Blocks of texels along a side that choose patches alike: about as wide as [`NEAR`], within which
/// the light of a patch changes little.
const BLOCKS: u32 = 64;

/// Fewest pairs of points of a replicate at a texel.
const LEAST_PAIRS: u32 = 8;

/// Share of a pair of points at the square root of `distance_squared` (m²) that is gathered.
pub fn gathered_share(problem: &Problem, distance_squared: f64) -> f64 {
    distance_squared / (distance_squared + near_squared(problem))
}

fn near_squared(problem: &Problem) -> f64 {
    NEAR * NEAR * problem.receiver.area()
}

/// Everything that gathering needs to know.
pub struct Gathering<'a> {
    problem: &'a Problem<'a>,
    environments: Vec<&'a Environment>,
    patches: Vec<Patch<'a>>,
    /// m²
    area: f64,
    /// How each block of `block`² texels chooses patches, row by row.
    choices: Vec<Distribution>,
    block: u32,
}

/// Neighbouring triangles.
struct Patch<'a> {
    triangles: &'a [MirrorTriangle],
    by_area: Distribution,
}

impl<'a> Gathering<'a> {
    /// `None` if there is no environment or no mirror.
    pub fn new(problem: &'a Problem) -> Option<Self> {
        let environments: Vec<&Environment> = (problem.emitters.iter())
            .filter_map(|emitter| match emitter {
                Emitter::Environment(environment) => Some(environment),
                Emitter::Sun(_) | Emitter::Lamp(_) => None,
            })
            .collect();
        let run = problem.mirrors.len().div_ceil(MAX_PATCHES).max(1);
        let patches: Vec<Patch> = (problem.mirrors.chunks(run))
            .filter_map(|triangles| {
                let by_area = Distribution::new(triangles.iter().map(|t| t.area))?;
                Some(Patch { triangles, by_area })
            })
            .collect();
        let area = patches.iter().map(|patch| patch.by_area.total()).sum();
        if environments.is_empty() || patches.is_empty() {
            return None;
        }
        let [width, height] = problem.receiver.size();
        let block = width.max(height).div_ceil(BLOCKS);
        let mut gathering = Self {
            problem,
            environments,
            patches,
            area,
            choices: Vec::new(),
            block,
        };
        let columns = width.div_ceil(block);
        gathering.choices = (0..columns * height.div_ceil(block))
            .into_par_iter()
            .map(|index| {
                let middle = |block_index: u32, side: u32| {
                    (block_index * block + block / 2).min(side - 1) as usize
                };
                let row = middle(index / columns, height);
                gathering.choice(row * width as usize + middle(index % columns, width))
            })
            .collect();
        Some(gathering)
    }

    /// The choice of a texel's block.
    fn choice_of(&self, texel: usize) -> &Distribution {
        let [width, block] = [self.problem.receiver.size()[0], self.block].map(|n| n as usize);
        let (column, row) = (texel % width / block, texel / width / block);
        &self.choices[row * width.div_ceil(block) + column]
    }

    fn texel(&self, texel: usize, points: u32, seed: u32) -> Moments {
        let mut moments = Moments::default();
        let choice = self.choice_of(texel);
        let texel_seed = split_mix(u64::from(seed) << 32 | texel as u64);
        for replicate in 0..REPLICATES {
            let seed = split_mix(texel_seed ^ u64::from(replicate)) as u32;
            let sum: DVec3 = (0..points)
                .map(|index| self.pair(texel, choice, sobol_4d(index, seed)))
                .sum();
            moments.add((sum / f64::from(points)).to_array());
        }
        moments
    }

    /// How to choose patches near a texel: by the irradiance that its middle would get from the
    /// patch, if all of it were like its middle.
    fn choice(&self, texel: usize) -> Distribution {
        let y = self.problem.receiver.point(texel, 0.5, 0.5);
        let mut weights: Vec<f64> = (self.patches.iter())
            .map(|patch| {
                let Some(y) = &y else {
                    return 0.0;
                };
                let middle = &patch.triangles[patch.triangles.len() / 2];
                // u = 4/9, v = 1/2 is the centroid.
                let paths = self
                    .transport(y, middle, 4.0 / 9.0, 0.5)
                    .into_iter()
                    .flatten();
                let light: f64 = paths.map(|light| light.irradiance.element_sum()).sum();
                light * patch.by_area.total()
            })
            .collect();
        let total: f64 = weights.iter().sum();
        let base = if total > 0.0 {
            BY_AREA * total / (1.0 - BY_AREA)
        } else {
            1.0
        };
        for (weight, patch) in weights.iter_mut().zip(&self.patches) {
            *weight += base * patch.by_area.total() / self.area;
        }
        Distribution::new(weights).expect("every patch has an area")
    }

    /// An estimate of the gathered irradiance at a random point of a texel, W/m².
    fn pair(&self, texel: usize, choice: &Distribution, [u0, u1, u2, u3]: [f64; 4]) -> DVec3 {
        (self.problem.receiver.point(texel, u0, u1)).map_or(DVec3::ZERO, |y| {
            y.weight * self.irradiance(&y, choice, u2, u3)
        })
    }

    /// An estimate of the gathered irradiance at a point in a texel, W/m², with two numbers that are uniform in
    /// [0, 1).
    pub fn irradiance_at(&self, y: &ReceiverPoint, texel: usize, u: f64, v: f64) -> DVec3 {
        self.irradiance(y, self.choice_of(texel), u, v)
    }

    /// The gathered share of L F V cosθ_x cosθ_y / d² over the density of x, W/m².
    fn irradiance(&self, y: &ReceiverPoint, choice: &Distribution, u: f64, v: f64) -> DVec3 {
        let (patch, u) = choice.pick(u);
        let probability = choice.probability(patch);
        let patch = &self.patches[patch];
        let (triangle, u) = patch.by_area.pick(u);
        let triangle = &patch.triangles[triangle];
        let paths = self.transport(y, triangle, u, v).into_iter().flatten();
        let irradiance: DVec3 = paths
            .filter(|light| {
                let blocked = |direction, length| {
                    (self.problem).blocked(light.from, direction, length, triangle.blocker)
                };
                !blocked(light.out, light.distance) && !blocked(light.toward, f64::INFINITY)
            })
            .map(|light| light.irradiance)
            .sum();
        irradiance * patch.by_area.total() / probability
    }

    /// Light by reflection and by refraction at a point of a mirror to `y`, if nothing blocks it.
    /// It comes from where light from `y` would go.
    fn transport(
        &self,
        y: &ReceiverPoint,
        triangle: &MirrorTriangle,
        u: f64,
        v: f64,
    ) -> [Option<Transport>; 2] {
        let x = triangle.point(u, v);
        let to_receiver = y.position - x.position;
        let distance_squared = to_receiver.length_squared();
        let distance = distance_squared.sqrt();
        let out = to_receiver / distance;
        let (cosine_x, cosine_y) = (x.normal.dot(out).abs(), -y.normal.dot(out));
        if cosine_y <= 0.0 {
            return [None, None];
        }
        let bounded = cosine_x * cosine_y / (distance_squared + near_squared(self.problem));
        let dielectrics = &self.problem.chains.dielectrics;
        // The lower bits of a coordinate are as random as the upper ones.
        let (wavelength, mut tint) = dielectrics.wavelength(|| (v * 65_536.0).fract());
        let sides = self.problem.first_sides(triangle, out, wavelength);
        let transmitted =
            sides.media[0].transmittance(dielectrics, distance) * sides.take_tint(&mut tint);
        let sources =
            (triangle.surface).leaving(sides.ior, out, x.normal, triangle.geometric_normal);
        sources.map(|source| {
            let source = source?;
            let toward = source.direction;
            let radiance: DVec3 = (self.environments.iter())
                .map(|environment| environment.dim_radiance(toward))
                .sum();
            Some(Transport {
                from: x.position,
                out,
                distance,
                toward,
                // Backward: the light comes from where `source` leads.
                irradiance: transmitted * radiance * source.share / source.compression * bounded,
            })
        })
    }
}

impl Method for Gathering<'_> {
    fn samples(&self, points: u32) -> u64 {
        self.problem.receiver.texels() as u64 * u64::from(points) * u64::from(REPLICATES)
    }

    /// Irradiance from replicates of `points` pairs of points a texel, at most
    /// [`super::sequence::SEQUENCE_LENGTH`].
    fn round(&self, points: u32, seed: u32, done: &mut dyn FnMut(u64)) -> Result<Estimate> {
        let texels = self.problem.receiver.texels();
        let samples = u64::from(points) * u64::from(REPLICATES);
        let texel = |texel| self.texel(texel, points, seed);
        let moments = moments_of_values(texels, samples, self.problem.cancel, texel, done)?;
        let mut estimate = Estimate::from_moments(&moments);
        // Every texel has random numbers of its own.
        for (texel, variance) in estimate.variance.iter().enumerate() {
            let area = self.problem.receiver.texel_area(texel);
            (0..3).for_each(|c| estimate.flux_variance[c] += area * area * variance[c]);
        }
        Ok(estimate)
    }

    fn good_size(&self, wanted: f64) -> u32 {
        power_of_two(wanted, LEAST_PAIRS)
    }
}

/// Light by way of a point of a mirror.
struct Transport {
    from: DVec3,
    /// Unit vector from the mirror to the receiver, and the distance in m.
    out: DVec3,
    distance: f64,
    /// Unit vector toward the light.
    toward: DVec3,
    /// Per area of the mirror, W/m⁴.
    irradiance: DVec3,
}
