//! Rounds of independent batches until the error is small enough.

use crate::error::Result;
use crate::reference::gather::Gathering;
use crate::reference::sequence::{SEQUENCE_LENGTH, split_mix};
use crate::reference::trace::LightTracing;
use crate::reference::{Map, Options, Problem};
use rayon::prelude::*;

/// Independent batches of every round; their spread gives the standard error.
pub const REPLICATES: u32 = 16;

/// A round has at most this many times the samples of all before it, so that a poor first guess
/// of what is needed costs little.
const MAX_GROWTH: f64 = 4.0;

/// And at least this many, so that the last round is not followed by ever smaller ones.
const MIN_GROWTH: f64 = 0.25;

/// Memory for the maps of batches that are computed at the same time, bytes.
const MAP_MEMORY: usize = 1 << 30;

/// How far a computation is.
#[derive(Debug, Clone, Copy)]
pub struct Progress {
    /// 0..=1, a guess.
    pub fraction: f64,
    pub samples: u64,
    /// After the last complete round; infinite before the first.
    pub relative_error: f64,
}

/// Result of [`solve`].
pub struct Solution {
    pub irradiance: Map,
    pub standard_error: Map,
    pub relative_error: f64,
    pub samples: u64,
}

/// A way to estimate a part of the irradiance. Sizes are sequences or points a texel.
enum Method<'a> {
    LightTracing(LightTracing<'a>),
    Gathering(Gathering<'a>),
}

impl Method<'_> {
    fn batch(&self, size: u32, seed: u32) -> Result<Map> {
        match self {
            Self::LightTracing(method) => method.batch(size, seed),
            Self::Gathering(method) => method.batch(size, seed),
        }
    }

    /// A size not below `wanted` that suits the points: a power of two where it is one sequence's
    /// length.
    fn good_size(&self, wanted: f64) -> u32 {
        match self {
            Self::LightTracing(_) => wanted.ceil() as u32,
            Self::Gathering(_) => (wanted.ceil() as u32)
                .next_power_of_two()
                .min(SEQUENCE_LENGTH),
        }
    }

    fn samples(&self, size: u32) -> u64 {
        match self {
            Self::LightTracing(method) => method.samples(size),
            Self::Gathering(method) => method.samples(size),
        }
    }
}

/// Rounds of one method, each weighted by its size.
struct Part<'a> {
    method: Method<'a>,
    /// Σ size · mean over the batches
    weighted: Map,
    /// Σ size² · variance of that mean
    variance: Map,
    /// Σ size, per batch
    size: u32,
}

impl<'a> Part<'a> {
    fn new(method: Method<'a>, empty: Map) -> Self {
        Self {
            method,
            weighted: empty.clone(),
            variance: empty,
            size: 0,
        }
    }

    fn mean(&self, texel: usize, channel: usize) -> f64 {
        self.weighted[texel][channel] / f64::from(self.size)
    }

    /// Of the mean.
    fn variance(&self, texel: usize, channel: usize) -> f64 {
        self.variance[texel][channel] / f64::from(self.size).powi(2)
    }

    /// Adds one round. Batches are added in order, so that the sum does not depend on threads.
    fn run(&mut self, size: u32, seeds: &mut Seeds, done: &mut dyn FnMut(u64)) -> Result<()> {
        let map_bytes = size_of::<[f64; 3]>() * self.weighted.len();
        let at_once = rayon::current_num_threads()
            .min(MAP_MEMORY / map_bytes)
            .max(1);
        let mut sum = vec![[0.0; 3]; self.weighted.len()];
        let mut squares = sum.clone();
        let seeds: Vec<u32> = (0..REPLICATES)
            .map(|_| seeds.next(self.method.samples(size)))
            .collect();
        for seeds in seeds.chunks(at_once) {
            let batches: Vec<Result<Map>> = (seeds.par_iter())
                .map(|&seed| self.method.batch(size, seed))
                .collect();
            for batch in batches {
                let batch = batch?;
                for ((sum, square), value) in sum.iter_mut().zip(&mut squares).zip(&batch) {
                    for channel in 0..3 {
                        sum[channel] += value[channel];
                        square[channel] += value[channel] * value[channel];
                    }
                }
            }
            done(self.method.samples(size) * seeds.len() as u64);
        }
        let (n, weight) = (f64::from(REPLICATES), f64::from(size));
        for texel in 0..sum.len() {
            for channel in 0..3 {
                let mean = sum[texel][channel] / n;
                let spread = (squares[texel][channel] / n - mean * mean).max(0.0);
                self.weighted[texel][channel] += weight * mean;
                self.variance[texel][channel] += weight * weight * spread / (n - 1.0);
            }
        }
        self.size += size;
        Ok(())
    }
}

/// Seeds that no two sequences of a run share.
struct Seeds {
    next: u32,
}

impl Seeds {
    fn new(seed: u32) -> Self {
        Self {
            next: split_mix(seed.into()) as u32,
        }
    }

    /// A seed for a batch that needs at most as many as it has samples over 2^16, rounded up.
    fn next(&mut self, samples: u64) -> u32 {
        let seed = self.next;
        self.next = seed.wrapping_add(samples.div_ceil(1 << 16) as u32);
        seed
    }
}

/// √(2/π), the expected |x| of a normal x with unit variance.
const MEAN_ABSOLUTE: f64 = std::f64::consts::FRAC_2_SQRT_PI * std::f64::consts::FRAC_1_SQRT_2;

/// Expected L1 error of the parts together, relative to the sum of them all.
fn relative_error(parts: &[&Part], total: f64, texels: usize) -> f64 {
    let mut sigma = 0.0;
    for texel in 0..texels {
        for channel in 0..3 {
            let variance: f64 = parts.iter().map(|p| p.variance(texel, channel)).sum();
            sigma += variance.sqrt();
        }
    }
    if total > 0.0 {
        MEAN_ABSOLUTE * sigma / total
    } else {
        0.0
    }
}

/// Runs rounds of the method with the larger error until the sum of all is good enough.
pub fn solve(
    problem: &Problem,
    options: &Options,
    progress: &mut dyn FnMut(&Progress),
) -> Result<Solution> {
    let empty = problem.receiver.empty_map();
    let texels = empty.len();
    let methods = [
        LightTracing::new(problem).map(Method::LightTracing),
        Gathering::new(problem).map(Method::Gathering),
    ];
    let mut parts: Vec<Part> = (methods.into_iter().flatten())
        .map(|method| Part::new(method, empty.clone()))
        .collect();
    let mut seeds = Seeds::new(options.seed);
    let (mut samples, mut error, mut fraction) = (0, f64::INFINITY, 0.0);
    let mut size = 1;
    // First every part once, then the worst.
    for round in 0.. {
        let worst = if round < parts.len() {
            round
        } else {
            let sum = |p: &Part| {
                (0..texels)
                    .map(|t| (0..3).map(|c| p.mean(t, c)).sum::<f64>())
                    .sum::<f64>()
            };
            let total: f64 = parts.iter().map(sum).sum();
            error = relative_error(&parts.iter().collect::<Vec<_>>(), total, texels);
            let errors: Vec<f64> = (parts.iter())
                .map(|p| relative_error(&[p], total, texels))
                .collect();
            let worst = (0..parts.len()).max_by(|&a, &b| errors[a].total_cmp(&errors[b]));
            let Some(worst) = worst.filter(|_| error > options.error) else {
                break;
            };
            let part = &parts[worst];
            let needed = (error / options.error).powi(2) - 1.0;
            let wanted = f64::from(part.size) * needed.clamp(MIN_GROWTH, MAX_GROWTH);
            let per_size = part.method.samples(1) * u64::from(REPLICATES);
            let affordable = options.max_samples.saturating_sub(samples) / per_size;
            if affordable == 0 {
                break;
            }
            fraction = 1.0 / (1.0 + needed);
            size = (part.method.good_size(wanted))
                .clamp(1, affordable.min(u64::from(u32::MAX)) as u32);
            worst
        };
        let before = samples;
        let ahead = parts[worst].method.samples(size) * u64::from(REPLICATES);
        let after = if round < parts.len() {
            0.0
        } else {
            1.0f64.min(fraction * (1.0 + ahead as f64 / before.max(1) as f64))
        };
        parts[worst].run(size, &mut seeds, &mut |done| {
            samples += done;
            let share = (samples - before) as f64 / ahead as f64;
            progress(&Progress {
                fraction: fraction + share * (after - fraction).max(0.0),
                samples,
                relative_error: error,
            });
        })?;
    }
    let mut irradiance = empty.clone();
    let mut standard_error = empty;
    for texel in 0..texels {
        for channel in 0..3 {
            irradiance[texel][channel] = parts.iter().map(|p| p.mean(texel, channel)).sum();
            let variance: f64 = parts.iter().map(|p| p.variance(texel, channel)).sum();
            standard_error[texel][channel] = variance.sqrt();
        }
    }
    Ok(Solution {
        irradiance,
        standard_error,
        relative_error: if error.is_finite() { error } else { 0.0 },
        samples,
    })
}
