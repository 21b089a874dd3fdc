//! Estimates of a light map, with their errors.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_2_SQRT_PI};

/// Independent replicates of every round; their spread gives the standard error.
pub const REPLICATES: u32 = 16;

/// √(2/π), the expected |x| of a normal x with unit variance.
pub const MEAN_ABSOLUTE: f64 = FRAC_2_SQRT_PI * FRAC_1_SQRT_2;

/// Texels from the top row, RGB.
pub type Map = Vec<[f64; 3]>;

/// An unbiased estimate of the irradiance, or of a part of it.
pub struct Estimate {
    /// W/m²
    pub mean: Map,
    /// Of the mean, (W/m²)².
    pub variance: Map,
}

/// Sum and sum of squares over replicates.
#[derive(Clone, Copy, Default)]
pub struct Moments {
    sum: [f64; 3],
    squares: [f64; 3],
}

impl Moments {
    pub fn add(&mut self, value: [f64; 3]) {
        for (channel, value) in value.into_iter().enumerate() {
            self.sum[channel] += value;
            self.squares[channel] += value * value;
        }
    }
}

impl Estimate {
    /// Mean of [`REPLICATES`] independent replicates, and its variance.
    pub fn from_moments(moments: &[Moments]) -> Self {
        let n = f64::from(REPLICATES);
        let mean = |m: &Moments| m.sum.map(|sum| sum / n);
        let variance = |m: &Moments| {
            std::array::from_fn(|channel| {
                let mean = m.sum[channel] / n;
                (m.squares[channel] / n - mean * mean).max(0.0) / (n - 1.0)
            })
        };
        Self {
            mean: moments.iter().map(mean).collect(),
            variance: moments.iter().map(variance).collect(),
        }
    }

    /// Adds factor · other, with independent errors.
    pub fn add_scaled(&mut self, other: &Self, factor: f64) {
        let add = |map: &mut Map, other: &Map, factor: f64| {
            let values = map.as_flattened_mut().iter_mut();
            for (value, other) in values.zip(other.as_flattened()) {
                *value += factor * other;
            }
        };
        add(&mut self.mean, &other.mean, factor);
        add(&mut self.variance, &other.variance, factor * factor);
    }

    /// ΣE
    pub fn total(&self) -> f64 {
        self.mean.as_flattened().iter().sum()
    }

    /// Expected Σ|error|, if errors are normal.
    pub fn absolute_error(&self) -> f64 {
        let sigma: f64 = (self.variance.as_flattened().iter())
            .map(|v| v.sqrt())
            .sum();
        MEAN_ABSOLUTE * sigma
    }
}
