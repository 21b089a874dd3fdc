//! The caustics of one receiver as the camera sees them.
//!
//! Both parts of the irradiance (see [`crate::reference`]) are estimated again at what the camera sees of
//! the receiver. Light tracing adds what lands on the receiver to the pixel that shows the place directly.
//! It also fills a light map for every replicate, which paths by way of mirrors and interfaces look up.
//! Gathering starts from the points where paths end. The spread of replicates, each of light and paths,
//! gives a standard error that knows how neighbouring texels and paths hang together.

use super::paths::{DiffusePoint, End, Paths};
use crate::error::Result;
use crate::reference::estimate::{Estimate, Map, Moments, REPLICATES};
use crate::reference::gather::Gathering;
use crate::reference::problem::Problem;
use crate::reference::receiver::ReceiverPoint;
use crate::reference::rounds::{Method, moments_of_values, power_of_two};
use crate::reference::sequence::{Choices, sobol_4d, split_mix};
use crate::reference::trace::LightTracing;
use glam::DVec3;
use std::f64::consts::PI;

/// Paths through a pixel in a replicate that look up a light map: as many as rays of light over pixels,
/// but no fewer than this,
const LEAST_LOOKUPS: u32 = 4;
/// and no more, as the light's noise is far larger by then.
const MOST_LOOKUPS: u32 = 32;

/// Pixels of a replicate between two checks for cancellation.
const CHUNK: usize = 2048;

/// The receiver, and the camera that looks at it.
#[derive(Clone, Copy)]
struct Seen<'a> {
    problem: &'a Problem<'a>,
    /// In the scene.
    object: usize,
    paths: &'a Paths,
}

/// The part that light tracing finds.
pub struct SeenTracing<'a> {
    seen: Seen<'a>,
    tracing: LightTracing<'a>,
}

/// The part that is gathered.
pub struct SeenGathering<'a> {
    seen: Seen<'a>,
    gathering: Gathering<'a>,
}

/// The methods for the caustics on the receiver of `problem`, the scene's object number `object`.
///
/// # Errors
/// [`crate::Error::Cancelled`]
pub fn methods<'a>(
    problem: &'a Problem<'a>,
    object: usize,
    paths: &'a Paths,
) -> Result<Vec<Box<dyn Method + 'a>>> {
    let seen = Seen {
        problem,
        object,
        paths,
    };
    let tracing = LightTracing::new(problem)?.map(|tracing| SeenTracing { seen, tracing });
    let gathering = Gathering::new(problem).map(|gathering| SeenGathering { seen, gathering });
    let mut methods: Vec<Box<dyn Method + 'a>> = Vec::new();
    methods.extend(tracing.map(|method| Box::new(method) as _));
    methods.extend(gathering.map(|method| Box::new(method) as _));
    Ok(methods)
}

impl Seen<'_> {
    /// Mean over `samples` camera paths through a pixel, by way of at least `least_bounces` specular
    /// surfaces, of the radiance that the receiver sends to the camera, W/m²/sr, given its irradiance, W/m²,
    /// at a point in a texel with two numbers that are uniform in [0, 1).
    fn pixel(
        &self,
        pixel: usize,
        samples: u32,
        least_bounces: u32,
        seed: u64,
        irradiance: impl Fn(&DiffusePoint, usize, f64, f64) -> DVec3,
    ) -> DVec3 {
        let mut sum = DVec3::ZERO;
        for index in 0..samples {
            let [u, v, s, t] = sobol_4d(index, seed as u32);
            let mut choices = Choices::new(split_mix(seed ^ u64::from(index) << 32));
            (self.paths).follow(pixel, [u, v], &mut choices, &mut |end, weight| {
                let End::Diffuse(point) = end else {
                    return;
                };
                if point.object != self.object || point.bounces < least_bounces {
                    return;
                }
                let receiver = &self.problem.receiver;
                let texel = receiver.texel_at(point.position, point.triangle, point.weights);
                if let Some(texel) = texel {
                    sum += weight * point.albedo / PI * irradiance(&point, texel, s, t);
                }
            });
        }
        sum / f64::from(samples)
    }
}

impl SeenTracing<'_> {
    /// The radiance of the pixels by one replicate, with `lookups` paths a pixel.
    fn picture(&self, sequences: u32, lookups: u32, seed: u32) -> Result<Map> {
        let Seen {
            problem,
            object,
            paths,
        } = self.seen;
        let mut picture: Map = vec![[0.0; 3]; paths.pixels()];
        let add = |pixel: &mut [f64; 3], radiance: DVec3| {
            (0..3).for_each(|channel| pixel[channel] += radiance[channel]);
        };
        let map = self.tracing.replicate(sequences, seed, |landing, flux| {
            if let Some((pixel, factor)) = paths.pixel_of(landing.position, landing.hit.normal) {
                let albedo = paths.albedo(object, landing.hit.triangle, landing.hit.weights);
                add(&mut picture[pixel], factor * albedo * flux);
            }
        })?;
        for (pixel, value) in picture.iter_mut().enumerate() {
            if pixel % CHUNK == 0 {
                problem.check_cancelled()?;
            }
            // Unlike the seeds of light tracing, which are counted on from `seed`.
            let seed = split_mix(split_mix(u64::from(seed)) ^ pixel as u64);
            let look_up = |_: &DiffusePoint, texel: usize, _, _| DVec3::from(map[texel]);
            add(value, self.seen.pixel(pixel, lookups, 1, seed, look_up));
        }
        Ok(picture)
    }
}

impl Method for SeenTracing<'_> {
    fn round(&self, sequences: u32, seed: u32, done: &mut dyn FnMut(u64)) -> Result<Estimate> {
        let pixels = self.seen.paths.pixels();
        let wanted = self.tracing.rays(sequences) as f64 / pixels as f64;
        let lookups = power_of_two(wanted, LEAST_LOOKUPS).min(MOST_LOOKUPS);
        let replicate = |seed| self.picture(sequences, lookups, seed);
        let no_flux = |_: &Map| [0.0; 3];
        (self.tracing).replicates(sequences, seed, pixels, replicate, no_flux, done)
    }

    /// Rays of light.
    fn samples(&self, sequences: u32) -> u64 {
        self.tracing.samples(sequences)
    }

    fn good_size(&self, wanted: f64) -> u32 {
        self.tracing.good_size(wanted)
    }
}

impl Method for SeenGathering<'_> {
    fn round(&self, samples: u32, seed: u32, done: &mut dyn FnMut(u64)) -> Result<Estimate> {
        let irradiance = |point: &DiffusePoint, texel: usize, u, v| {
            let point = ReceiverPoint {
                position: point.position,
                normal: point.geometric,
                weight: 1.0,
            };
            self.gathering.irradiance_at(&point, texel, u, v)
        };
        let pixel = |pixel: usize| {
            let pixel_seed = split_mix(u64::from(seed) << 32 | pixel as u64);
            let mut moments = Moments::default();
            for replicate in 0..REPLICATES {
                let seed = split_mix(pixel_seed ^ u64::from(replicate));
                let radiance = self.seen.pixel(pixel, samples, 0, seed, irradiance);
                moments.add(radiance.to_array());
            }
            moments
        };
        let (pixels, cancel) = (self.seen.paths.pixels(), self.seen.problem.cancel);
        let pairs = u64::from(samples) * u64::from(REPLICATES);
        let moments = moments_of_values(pixels, pairs, cancel, pixel, done)?;
        Ok(Estimate::from_moments(&moments))
    }

    fn samples(&self, samples: u32) -> u64 {
        self.seen.paths.pixels() as u64 * u64::from(samples) * u64::from(REPLICATES)
    }

    fn good_size(&self, wanted: f64) -> u32 {
        power_of_two(wanted, 1)
    }
}
