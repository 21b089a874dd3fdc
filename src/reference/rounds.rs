//! Rounds of independent replicates until the error is small enough.

use crate::error::{Error, Result};
use crate::reference::estimate::{Estimate, Map, Moments};
use crate::reference::problem::check_cancelled;
use crate::reference::sequence::{SEQUENCE_LENGTH, split_mix};
use rayon::prelude::*;
use std::sync::atomic::AtomicBool;

/// A round has at most this many times the samples of all before it, so that a poor first guess
/// of what is needed costs little,
const MAX_GROWTH: f64 = 4.0;
/// and at least this many, so that the last round is not followed by ever smaller ones.
const MIN_GROWTH: f64 = 0.25;

/// When to stop, and with which random numbers.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Relative error to reach, see [`Reference::relative_error`](super::Reference::relative_error).
    pub error: f64,
    /// Rays and pairs of points after which to stop in any case.
    pub max_samples: u64,
    /// The same seed gives the same bits on any number of cores.
    pub seed: u32,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            error: 0.005,
            max_samples: 4_000_000_000,
            seed: 0,
        }
    }
}

pub fn check_error(options: &Options) -> Result<()> {
    if options.error > 0.0 && options.error < 1.0 {
        return Ok(());
    }
    Err(Error::Usage {
        reason: format!("a relative error of {}", options.error),
        remedy: "ask for an error between 0 and 1, such as 0.005".into(),
    })
}

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
    pub mean: Map,
    pub standard_error: Map,
    /// Of the flux that a light map collects, W.
    pub flux_error: [f64; 3],
    pub relative_error: f64,
    pub samples: u64,
}

/// A way to estimate a part of the values. Sizes are sequences of points, or points a texel or pixel, in
/// each replicate.
pub trait Method {
    /// An estimate from independent replicates of `size`; calls `done` with numbers of samples. Rounds with
    /// seeds that lie as far apart as samples over [`SEQUENCE_LENGTH`] are independent.
    ///
    /// # Errors
    /// [`crate::Error::Cancelled`]
    fn round(&self, size: u32, seed: u32, done: &mut dyn FnMut(u64)) -> Result<Estimate>;

    /// Samples of one round.
    fn samples(&self, size: u32) -> u64;

    /// The size next to `wanted` that suits the points.
    fn good_size(&self, wanted: f64) -> u32;
}

/// Values between two reports of progress.
const CHUNK: usize = 2048;

/// The moments of `values` values, each of which `moments` finds from `samples` samples.
pub fn moments_of_values(
    values: usize,
    samples: u64,
    cancel: &AtomicBool,
    moments: impl Fn(usize) -> Moments + Sync,
    done: &mut dyn FnMut(u64),
) -> Result<Vec<Moments>> {
    let mut all = Vec::with_capacity(values);
    for first in (0..values).step_by(CHUNK) {
        let chunk = first..values.min(first + CHUNK);
        let reported = chunk.len() as u64 * samples;
        let found: Result<Vec<Moments>> = (chunk.into_par_iter())
            .map(|value| {
                check_cancelled(cancel)?;
                Ok(moments(value))
            })
            .collect();
        all.extend(found?);
        done(reported);
    }
    Ok(all)
}

/// Sobol points are stratified best in powers of two.
pub fn power_of_two(wanted: f64, least: u32) -> u32 {
    let power = wanted.log2().round().exp2();
    power.clamp(f64::from(least), f64::from(SEQUENCE_LENGTH)) as u32
}

/// The rounds of one method so far.
struct Part<'a> {
    method: Box<dyn Method + 'a>,
    /// Mean of the rounds, weighted by their sizes.
    estimate: Estimate,
    /// Sum of the sizes.
    size: u32,
}

impl Part<'_> {
    fn add(&mut self, round: &Estimate, size: u32) {
        let total = self.size + size;
        let (old, new) = (f64::from(self.size), f64::from(size));
        let mut sum = Estimate::zero(round.mean.len());
        sum.add_scaled(&self.estimate, old / f64::from(total));
        sum.add_scaled(round, new / f64::from(total));
        (self.estimate, self.size) = (sum, total);
    }
}

/// The sum of all parts, whose errors are independent.
fn sum_of(parts: &[Part], values: usize) -> Estimate {
    let mut sum = Estimate::zero(values);
    for part in parts {
        sum.add_scaled(&part.estimate, 1.0);
    }
    sum
}

/// Runs rounds of whichever method has the larger error until the sum of all, `values` in number, is good
/// enough.
pub fn solve(
    methods: Vec<Box<dyn Method + '_>>,
    values: usize,
    options: &Options,
    progress: &mut dyn FnMut(&Progress),
) -> Result<Solution> {
    let mut parts: Vec<Part> = (methods.into_iter())
        .map(|method| Part {
            method,
            estimate: Estimate::zero(values),
            size: 0,
        })
        .collect();
    let mut seed = split_mix(options.seed.into()) as u32;
    let (mut samples, mut error) = (0, f64::INFINITY);
    let solution = loop {
        let sum = sum_of(&parts, values);
        let started = parts.iter().all(|part| part.size > 0);
        if started {
            let total = sum.total();
            error = if total > 0.0 {
                sum.absolute_error() / total
            } else {
                0.0
            };
        }
        // Samples wanted over samples so far: errors fall at least with their square root.
        let growth = (error / options.error).powi(2) - 1.0;
        let worst = (parts.iter_mut()).max_by(|a, b| worth(a).total_cmp(&worth(b)));
        let Some(part) = worst.filter(|_| growth > 0.0) else {
            break sum;
        };
        let wanted = f64::from(part.size) * growth.clamp(MIN_GROWTH, MAX_GROWTH);
        let size = if part.size == 0 { 1.0 } else { wanted };
        let size = part.method.good_size(size);
        let ahead = part.method.samples(size);
        if started && samples + ahead > options.max_samples {
            break sum;
        }
        let (before, needed) = (samples, samples as f64 * (1.0 + growth));
        let round = part.method.round(size, seed, &mut |done| {
            samples += done;
            // Until every part was seen once, nothing is known about what is needed.
            let fraction = if started {
                samples as f64 / needed
            } else {
                0.0
            };
            progress(&Progress {
                fraction: fraction.min(1.0),
                samples,
                relative_error: error,
            });
        })?;
        debug_assert_eq!(samples, before + ahead);
        part.add(&round, size);
        seed = seed.wrapping_add(ahead.div_ceil(SEQUENCE_LENGTH.into()) as u32);
    };
    let standard_error = (solution.variance.iter())
        .map(|variance| variance.map(f64::sqrt))
        .collect();
    Ok(Solution {
        mean: solution.mean,
        standard_error,
        flux_error: solution.flux_variance.map(f64::sqrt),
        relative_error: if error.is_finite() { error } else { 0.0 },
        samples,
    })
}

/// How much a part deserves the next round.
fn worth(part: &Part) -> f64 {
    if part.size == 0 {
        f64::INFINITY
    } else {
        part.estimate.absolute_error()
    }
}
