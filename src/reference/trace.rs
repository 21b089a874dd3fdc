//! Light tracing: points on the mirrors, directions from the lights, one texel each.
//!
//! A point x on a mirror of area S and a direction ω toward the light, drawn with densities p(x)
//! per m² and p(ω) per steradian, carry the flux
//!
//! ```text
//! Φ = L(ω) max(n·ω, 0) F V / (p(x) p(ω))          [W]
//! ```
//!
//! to where the reflected ray meets the receiver. A texel's irradiance is the mean over all pairs
//! of the flux that lands in it, over its area. The 1/d² and both cosines of the irradiance
//! integral are in the density with which rays land.

use crate::error::Result;
use crate::optics::reflect;
use crate::reference::gather::gathered_share;
use crate::reference::lights::Emitter;
use crate::reference::mirrors::{Distribution, MirrorTriangle};
use crate::reference::sequence::{SEQUENCE_LENGTH, sobol_4d};
use crate::reference::{Map, Problem};
use glam::DVec3;

/// One light and how to choose triangles for it.
struct Source<'a> {
    emitter: &'a Emitter,
    triangles: Distribution,
    /// Of the sequences of points.
    share: f64,
}

/// Everything that light tracing needs to know.
pub struct LightTracing<'a> {
    problem: &'a Problem<'a>,
    sources: Vec<Source<'a>>,
}

impl<'a> LightTracing<'a> {
    /// `None` if no light reaches a mirror's front.
    pub fn new(problem: &'a Problem) -> Option<Self> {
        let mut sources: Vec<Source> = (problem.emitters.iter())
            .filter_map(|emitter| {
                let flux = problem.mirrors.iter().map(|t| emitter.flux_onto(t));
                let triangles = Distribution::new(flux)?;
                let share = triangles.total();
                Some(Source {
                    emitter,
                    triangles,
                    share,
                })
            })
            .collect();
        let total: f64 = sources.iter().map(|source| source.share).sum();
        sources.iter_mut().for_each(|source| source.share /= total);
        (!sources.is_empty()).then_some(Self { problem, sources })
    }

    /// Sequences for each light when about `sequences` are wanted in all.
    fn sequences<'b>(&'b self, sequences: u32) -> impl Iterator<Item = (&'b Source<'a>, u32)> {
        (self.sources.iter()).map(move |source| {
            let wanted = (source.share * f64::from(sequences)).round() as u32;
            (source, wanted.max(1))
        })
    }

    /// Rays that [`Self::batch`] traces.
    pub fn samples(&self, sequences: u32) -> u64 {
        self.sequences(sequences)
            .map(|(_, n)| u64::from(n) * u64::from(SEQUENCE_LENGTH))
            .sum()
    }

    /// Irradiance from about `sequences` sequences of points, W/m².
    pub fn batch(&self, sequences: u32, mut seed: u32) -> Result<Map> {
        let receiver = &self.problem.receiver;
        let mut map = receiver.empty_map();
        for (source, strata) in self.sequences(sequences) {
            let scale = 1.0 / (f64::from(strata) * f64::from(SEQUENCE_LENGTH));
            let scale = scale / receiver.texel_area();
            for stratum in 0..strata {
                self.problem.check_cancelled()?;
                // Every sequence covers its own part of the mirrors.
                self.sequence(source, seed, &mut map, scale, |u| {
                    (f64::from(stratum) + u) / f64::from(strata)
                });
                seed = seed.wrapping_add(1);
            }
        }
        Ok(map)
    }

    fn sequence(
        &self,
        source: &Source,
        seed: u32,
        map: &mut Map,
        scale: f64,
        stratify: impl Fn(f64) -> f64,
    ) {
        for index in 0..SEQUENCE_LENGTH {
            let [u0, u1, u2, u3] = sobol_4d(index, seed);
            let (triangle, u0) = source.triangles.pick(stratify(u0));
            let triangle = &self.problem.mirrors[triangle];
            if let Some((texel, flux)) = self.ray(source.emitter, triangle, [u0, u1, u2, u3]) {
                // The triangle was chosen with probability flux_onto/total.
                let choice = source.emitter.flux_onto(triangle) / source.triangles.total();
                let irradiance = scale / choice * flux;
                let texel = &mut map[texel];
                texel[0] += irradiance.x;
                texel[1] += irradiance.y;
                texel[2] += irradiance.z;
            }
        }
    }

    /// Texel that a ray lands in and its flux, W, given the triangle.
    fn ray(
        &self,
        emitter: &Emitter,
        triangle: &MirrorTriangle,
        [u0, u1, u2, u3]: [f64; 4],
    ) -> Option<(usize, DVec3)> {
        let point = triangle.point(u0, u1);
        let light = emitter.draw(u2, u3);
        let cosine = point.normal.dot(light.direction);
        if cosine <= 0.0 || triangle.geometric_normal.dot(light.direction) <= 0.0 {
            return None;
        }
        let out = reflect(-light.direction, point.normal);
        if triangle.geometric_normal.dot(out) <= 0.0 {
            return None;
        }
        let (texel, distance) = self.problem.receiver.hit(point.position, out)?;
        let blocked = |direction, length| {
            (self.problem).blocked(point.position, direction, length, triangle.blocker)
        };
        if blocked(out, distance) || blocked(light.direction, f64::INFINITY) {
            return None;
        }
        let traced = 1.0 - gathered_share(self.problem, distance * distance);
        let radiance = light.bright + traced * light.dim;
        Some((
            texel,
            radiance * triangle.reflectance * triangle.area * cosine,
        ))
    }
}
