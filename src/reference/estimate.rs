//! Estimates of a light map, with their errors.

use std::f64::consts::{FRAC_1_SQRT_2, FRAC_2_SQRT_PI};

/// Independent replicates of every round; their spread gives the standard error.
pub const REPLICATES: u32 = 16;

/// √(2/π), the expected |x| of a normal x with unit variance.
pub const MEAN_ABSOLUTE: f64 = FRAC_2_SQRT_PI * FRAC_1_SQRT_2;

/// Texels from the top row, RGB.
pub type Map = Vec<[f64; 3]>;

/// The map in the precision of image files.
pub fn to_f32(map: &Map) -> Vec<[f32; 3]> {
    map.iter()
        .map(|rgb| rgb.map(|value| value as f32))
        .collect()
}

/// An unbiased estimate of the irradiance, or of a part of it.
pub struct Estimate {
    /// W/m²
    pub mean: Map,
    /// Of the mean, (W/m²)².
    pub variance: Map,
    /// Of the flux that a light map collects, W². It does not follow from those of the texels, whose errors depend on each other.
    /// 0 for other estimates.
    pub flux_variance: [f64; 3],
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

    /// Of [`REPLICATES`] values.
    fn mean(&self) -> [f64; 3] {
        self.sum.map(|sum| sum / f64::from(REPLICATES))
    }

    /// Of the mean of [`REPLICATES`] independent values.
    pub fn variance(&self) -> [f64; 3] {
        let n = f64::from(REPLICATES);
        let mean = self.mean();
        [0, 1, 2].map(|c| (self.squares[c] / n - mean[c] * mean[c]).max(0.0) / (n - 1.0))
    }
}

impl Estimate {
    /// Of `values` values that are 0.
    pub fn zero(values: usize) -> Self {
        Self {
            mean: vec![[0.0; 3]; values],
            variance: vec![[0.0; 3]; values],
            flux_variance: [0.0; 3],
        }
    }

    /// Mean of [`REPLICATES`] independent replicates, and its variance.
    pub fn from_moments(moments: &[Moments]) -> Self {
        Self {
            mean: moments.iter().map(Moments::mean).collect(),
            variance: moments.iter().map(Moments::variance).collect(),
            flux_variance: [0.0; 3],
        }
    }

    /// Adds factor · other, with independent errors.
    pub fn add_scaled(&mut self, other: &Self, factor: f64) {
        let add = |map: &mut [[f64; 3]], other: &[[f64; 3]], factor: f64| {
            let values = map.as_flattened_mut().iter_mut();
            for (value, other) in values.zip(other.as_flattened()) {
                *value += factor * other;
            }
        };
        add(
            std::slice::from_mut(&mut self.flux_variance),
            &[other.flux_variance],
            factor * factor,
        );
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
