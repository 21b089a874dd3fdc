//! Light tracing: points on the mirrors, directions from the lights, one texel each.
//!
//! A point x on a mirror of area S and a direction ω toward the light, drawn with densities p(x)
//! per m² and p(ω) per steradian, carry the flux
//!
//! ```text
//! Φ = L(ω) |n·ω| F V / (p(x) p(ω))          [W]
//! ```
//!
//! to where the reflected ray meets the receiver, F the share that is reflected, and likewise to where
//! the refracted ray meets it. A texel's irradiance is the mean over all pairs
//! of the flux that lands in it, over its area. The 1/d² and both cosines of the irradiance
//! integral are in the density with which rays land.

use crate::error::Result;
use crate::reference::chains::{Landing, Ray};
use crate::reference::estimate::{Estimate, Map, Moments, REPLICATES};
use crate::reference::gather::gathered_share;
use crate::reference::lights::Emitter;
use crate::reference::mirrors::{Distribution, MirrorTriangle};
use crate::reference::problem::Problem;
use crate::reference::rounds::Method;
use crate::reference::sequence::{Choices, SEQUENCE_LENGTH, split_mix, stratified};
use glam::DVec3;
use rayon::prelude::*;
use std::cell::LazyCell;

/// Sequences of points that find out how much of the light from each triangle lands on the receiver. Their results do not count.
const PILOT_SEQUENCES: u32 = 4;
const PILOT_SEED: u64 = 0x70_69_6c_6f_74;
/// Groups of triangles, in their order, that the pilot tells apart: 64 rays each.
const PILOT_GROUPS: usize = 1024;
/// Rays of the mean share that are added to those of a group, so that few rays do not decide alone.
const PILOT_PRIOR: f64 = 4.0;

/// Memory for the maps of replicates that are computed at the same time, bytes.
const MAP_MEMORY: usize = 1 << 30;

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
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`]
    pub fn new(problem: &'a Problem) -> Result<Option<Self>> {
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
        let mut tracing = Self { problem, sources };
        tracing.aim()?;
        Ok((!tracing.sources.is_empty()).then_some(tracing))
    }

    /// Chooses triangles by the flux onto them times the root of the share of it that lands, as a pilot run estimates it. That is
    /// the root of the second moment, which gives the least variance, where a ray lands with all of its flux or with none (Owen,
    /// *Monte Carlo theory, methods and examples*, chapter 9).
    fn aim(&mut self) -> Result<()> {
        let seeds = (0..).map(|number| split_mix(number ^ PILOT_SEED) as u32);
        let pilots: Vec<_> = self.sequences(PILOT_SEQUENCES).zip(seeds).collect();
        let aimed: Vec<Option<Distribution>> = (pilots.into_par_iter())
            .map(|((source, strata), seed)| self.aimed(source, strata, seed))
            .collect::<Result<_>>()?;
        for (source, aimed) in self.sources.iter_mut().zip(aimed) {
            if let Some(triangles) = aimed {
                source.triangles = triangles;
            }
        }
        Ok(())
    }

    /// The triangles of one light by a pilot run; `None` if none of its rays lands.
    fn aimed(&self, source: &Source, strata: u32, seed: u32) -> Result<Option<Distribution>> {
        let triangles = &source.triangles;
        let total = triangles.total();
        let group = |triangle: usize| {
            let middle = triangles.before(triangle) + 0.5 * triangles.weight(triangle);
            ((middle / total * PILOT_GROUPS as f64) as usize).min(PILOT_GROUPS - 1)
        };
        let mut landed = vec![0.0; PILOT_GROUPS];
        self.strata(source, strata, seed, |triangle, _, flux| {
            landed[group(triangle)] += flux.element_sum();
        })?;
        let numbers = 0..self.problem.mirrors.len();
        let mut onto = vec![0.0; PILOT_GROUPS];
        for triangle in numbers.clone() {
            onto[group(triangle)] += triangles.weight(triangle);
        }
        let mean = landed.iter().sum::<f64>() / total;
        let prior = PILOT_PRIOR * total / (f64::from(strata) * f64::from(SEQUENCE_LENGTH));
        Ok(Distribution::new(numbers.map(|triangle| {
            let group = group(triangle);
            let share = (landed[group] + prior * mean) / (onto[group] + prior);
            triangles.weight(triangle) * share.sqrt()
        })))
    }

    /// Sequences for each light when about `sequences` are wanted in all.
    fn sequences<'b>(&'b self, sequences: u32) -> impl Iterator<Item = (&'b Source<'a>, u32)> {
        (self.sources.iter()).map(move |source| {
            let wanted = (source.share * f64::from(sequences)).round() as u32;
            (source, wanted.max(1))
        })
    }

    /// Rays of a replicate.
    pub fn rays(&self, sequences: u32) -> u64 {
        let each = u64::from(SEQUENCE_LENGTH);
        (self.sequences(sequences))
            .map(|(_, n)| u64::from(n) * each)
            .sum()
    }

    /// The mean of [`REPLICATES`] maps of `values` values, which `replicate` makes of a seed each, from
    /// about `sequences` sequences of points; `flux` is what a map collects. Uses as many seeds from `seed` on as there are sequences;
    /// calls `done` with numbers of rays.
    pub fn replicates(
        &self,
        sequences: u32,
        seed: u32,
        values: usize,
        replicate: impl Fn(u32) -> Result<Map> + Sync,
        flux: impl Fn(&Map) -> [f64; 3],
        done: &mut dyn FnMut(u64),
    ) -> Result<Estimate> {
        let texels = self.problem.receiver.texels();
        let at_once = (MAP_MEMORY / (size_of::<[f64; 3]>() * texels)).max(1);
        let at_once = at_once.min(rayon::current_num_threads());
        let rays = self.rays(sequences);
        let seeds: Vec<u32> = (0..REPLICATES)
            .map(|i| seed.wrapping_add(i * (rays / u64::from(SEQUENCE_LENGTH)) as u32))
            .collect();
        let mut moments = vec![Moments::default(); values];
        let mut fluxes = Moments::default();
        for seeds in seeds.chunks(at_once) {
            let replicates: Vec<Result<Map>> =
                (seeds.par_iter()).map(|&seed| replicate(seed)).collect();
            // Added in order, so that the sum does not depend on the number of threads.
            for replicate in replicates {
                let replicate = replicate?;
                fluxes.add(flux(&replicate));
                for (moments, value) in moments.iter_mut().zip(replicate) {
                    moments.add(value);
                }
            }
            done(rays * seeds.len() as u64);
        }
        Ok(Estimate {
            flux_variance: fluxes.variance(),
            ..Estimate::from_moments(&moments)
        })
    }

    /// Irradiance, W/m². Calls `lands` with all places where light lands and its flux, W.
    pub fn replicate(
        &self,
        sequences: u32,
        mut seed: u32,
        mut lands: impl FnMut(&Landing, DVec3),
    ) -> Result<Map> {
        let receiver = &self.problem.receiver;
        let mut map = receiver.empty_map();
        for (source, strata) in self.sequences(sequences) {
            self.strata(source, strata, seed, |_, landing, flux| {
                let texel = &mut map[landing.hit.texel];
                texel[0] += flux.x;
                texel[1] += flux.y;
                texel[2] += flux.z;
                lands(landing, flux);
            })?;
            seed = seed.wrapping_add(strata);
        }
        // From flux to irradiance.
        for (texel, value) in map.iter_mut().enumerate() {
            let area = receiver.texel_area(texel);
            if area > 0.0 {
                *value = value.map(|flux| flux / area);
            }
        }
        Ok(map)
    }

    /// Calls `lands` with the number of a triangle, the places where light lands by way of it, and its flux, W. Uses `strata` seeds
    /// from `seed` on.
    fn strata(
        &self,
        source: &Source,
        strata: u32,
        seed: u32,
        mut lands: impl FnMut(usize, &Landing, DVec3),
    ) -> Result<()> {
        let rays = f64::from(strata) * f64::from(SEQUENCE_LENGTH);
        for stratum in 0..strata {
            self.problem.check_cancelled()?;
            // Every sequence covers its own part of the mirrors.
            let points = stratified(seed.wrapping_add(stratum), stratum, strata);
            for ([u0, u1, u2, u3], mut choices) in points {
                let (chosen, u0) = source.triangles.pick(u0);
                let triangle = &self.problem.mirrors[chosen];
                let scale = 1.0 / rays / source.triangles.probability(chosen);
                self.rays_of(
                    source.emitter,
                    triangle,
                    [u0, u1, u2, u3],
                    &mut choices,
                    |landing, flux| lands(chosen, landing, scale * flux),
                );
            }
        }
        Ok(())
    }

    /// Calls `lands` with the places where light lands by way of a point of the triangle, and its flux, W.
    fn rays_of(
        &self,
        emitter: &Emitter,
        triangle: &MirrorTriangle,
        [u0, u1, u2, u3]: [f64; 4],
        choices: &mut Choices,
        mut lands: impl FnMut(&Landing, DVec3),
    ) {
        let problem = self.problem;
        let point = triangle.point(u0, u1);
        let light = emitter.draw(point.position, u2, u3);
        let cosine = point.normal.dot(light.direction).abs();
        let dielectrics = &problem.chains.dielectrics;
        let (wavelength, mut tint) = dielectrics.wavelength(|| choices.next());
        let sides = problem.first_sides(triangle, light.direction, wavelength);
        let leaving = (triangle.surface).leaving(
            sides.ior,
            light.direction,
            point.normal,
            triangle.geometric_normal,
        );
        // A shadow ray costs more than a single ray on its way to the receiver, which most miss, and less than a chain.
        let is_lit = LazyCell::new(|| {
            let (toward, distance) = (light.direction, light.distance);
            !problem.blocked(point.position, toward, distance, triangle.blocker)
        });
        if problem.chains.max_interfaces > 1 && !*is_lit {
            return;
        }
        let arriving = triangle.area
            * cosine
            * sides.take_tint(&mut tint)
            * sides.media[0].transmittance(dielectrics, light.distance);
        for (leaving, media) in leaving.into_iter().zip(sides.media) {
            let Some(leaving) = leaving else {
                continue;
            };
            let ray = Ray {
                origin: point.position,
                direction: leaving.direction,
                from: triangle.blocker,
                flux: arriving * leaving.share,
                tint,
                media,
                interfaces: 1,
            };
            problem.follow(ray, choices, &mut |landing: &Landing, share| {
                if !*is_lit {
                    return;
                }
                // Gathering finds light of a single surface only.
                let gathered = match landing.interfaces {
                    1 => gathered_share(problem, landing.hit.distance * landing.hit.distance),
                    _ => 0.0,
                };
                let radiance = light.bright + (1.0 - gathered) * light.dim;
                lands(landing, radiance * share);
            });
        }
    }
}

impl Method for LightTracing<'_> {
    /// Irradiance from replicates of about `sequences` sequences of points each.
    fn round(&self, sequences: u32, seed: u32, done: &mut dyn FnMut(u64)) -> Result<Estimate> {
        let receiver = &self.problem.receiver;
        let replicate = |seed| self.replicate(sequences, seed, |_, _| {});
        let flux = |map: &Map| receiver.flux(map);
        self.replicates(sequences, seed, receiver.texels(), replicate, flux, done)
    }

    fn samples(&self, sequences: u32) -> u64 {
        u64::from(REPLICATES) * self.rays(sequences)
    }

    fn good_size(&self, wanted: f64) -> u32 {
        wanted.ceil() as u32
    }
}
