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
use crate::optics::reflect;
use crate::reference::lights::{Emitter, Environment};
use crate::reference::mirrors::Distribution;
use crate::reference::sequence::{SEQUENCE_LENGTH, sobol_4d, split_mix};
use crate::reference::{Map, Problem};
use glam::DVec3;

/// The distance c over the square root of the receiver's area.
const NEAR: f64 = 0.1;

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
    triangles: Distribution,
}

impl<'a> Gathering<'a> {
    /// `None` if there is no environment or no mirror.
    pub fn new(problem: &'a Problem) -> Option<Self> {
        let environments: Vec<&Environment> = (problem.emitters.iter())
            .filter_map(|emitter| match emitter {
                Emitter::Environment(environment) => Some(environment),
                Emitter::Sun(_) => None,
            })
            .collect();
        let triangles = Distribution::new(problem.mirrors.iter().map(|t| t.area))?;
        (!environments.is_empty()).then_some(Self {
            problem,
            environments,
            triangles,
        })
    }

    /// Pairs of points that [`Self::batch`] looks at.
    pub fn samples(&self, points: u32) -> u64 {
        self.problem.receiver.texels() as u64 * u64::from(points.min(SEQUENCE_LENGTH))
    }

    /// Irradiance from `points` pairs of points a texel, W/m².
    pub fn batch(&self, points: u32, seed: u32) -> Result<Map> {
        let receiver = &self.problem.receiver;
        let points = points.min(SEQUENCE_LENGTH);
        let mut map = receiver.empty_map();
        for (texel, irradiance) in map.iter_mut().enumerate() {
            if texel % 256 == 0 {
                self.problem.check_cancelled()?;
            }
            let seed = split_mix(u64::from(seed) << 32 | texel as u64) as u32;
            let sum: DVec3 = (0..points)
                .map(|index| self.pair(texel, sobol_4d(index, seed)))
                .sum();
            *irradiance = (sum / f64::from(points)).to_array();
        }
        Ok(map)
    }

    /// L F V cosθ_x cosθ_y / (d² + c²) over the density of x, W/m².
    fn pair(&self, texel: usize, [u0, u1, u2, u3]: [f64; 4]) -> DVec3 {
        let receiver = &self.problem.receiver;
        let y = receiver.point(texel, u0, u1);
        let (triangle, u2) = self.triangles.pick(u2);
        let triangle = &self.problem.mirrors[triangle];
        let x = triangle.point(u2, u3);
        let to_receiver = y - x.position;
        let distance_squared = to_receiver.length_squared();
        let distance = distance_squared.sqrt();
        let out = to_receiver / distance;
        let (cosine_x, cosine_y) = (x.normal.dot(out), -receiver.normal().dot(out));
        let light = reflect(-out, x.normal);
        if !(cosine_x > 0.0 && cosine_y > 0.0)
            || triangle.geometric_normal.dot(out) <= 0.0
            || triangle.geometric_normal.dot(light) <= 0.0
        {
            return DVec3::ZERO;
        }
        let blocked = |direction, length| {
            (self.problem).blocked(x.position, direction, length, triangle.blocker)
        };
        if blocked(out, distance) || blocked(light, f64::INFINITY) {
            return DVec3::ZERO;
        }
        let radiance: DVec3 = (self.environments.iter())
            .map(|environment| environment.dim_radiance(light))
            .sum();
        let bounded = cosine_x * cosine_y / (distance_squared + near_squared(self.problem));
        radiance * triangle.reflectance * bounded * self.triangles.total()
    }
}
