//! The noise of a reference in the error of an image, which makes it appear larger than it is.

use crate::image_file::RgbImage;
use crate::reference::{REPLICATES, Reference, to_f32};

/// From this many standard errors on, the magnitude of a difference has the mean that it has without noise, and half the bins up to
/// there for one standard error.
const LARGE: f64 = 8.0;
const BINS: usize = 512;
/// Magnitudes over their standard errors that differences are made of: 0, and [`LEAST`] · [`STEP`]^i.
const MAGNITUDES: usize = 18;
const LEAST: f64 = 0.25;
const STEP: f64 = 1.25;
const ITERATIONS: u32 = 300;

/// The relative L1 error of `image` against what `reference` would be without noise, Σ|A − B| / ΣB; `None` where the reference is black.
///
/// Noise adds to small differences and leaves large ones as they are, so that neither the L1 of the noise nor its square can be
/// subtracted: where the errors are at edges, the square leaves as much as 15 % too much at twice the noise. Instead, the distribution of
/// differences is found that, with noise added, makes the measured differences most likely (nonparametric maximum likelihood, Kiefer
/// and Wolfowitz 1956, by expectation maximisation, Laird 1978). The result is the mean magnitude of that distribution.
pub fn l1_without_noise(image: &RgbImage, reference: &Reference) -> Option<f64> {
    l1_without_noise_of(
        image,
        &reference.image(),
        &to_f32(&reference.standard_error),
    )
}

/// [`l1_without_noise`] for a reference and the standard error of each of its values, as its file holds them.
///
/// # Panics
/// If the three differ in their number of pixels.
pub fn l1_without_noise_of(
    image: &RgbImage,
    reference: &RgbImage,
    standard_error: &[[f32; 3]],
) -> Option<f64> {
    assert_eq!(image.pixels.len(), reference.pixels.len());
    assert_eq!(image.pixels.len(), standard_error.len());
    let truth = reference.pixels.as_flattened();
    let errors = standard_error.as_flattened();
    let differences = (image.pixels.as_flattened().iter().zip(truth))
        .map(|(&a, &b)| f64::from(a) - f64::from(b))
        .zip(errors.iter().copied().map(f64::from));
    let light: f64 = truth.iter().copied().map(f64::from).sum();
    (light > 0.0).then(|| sum_of_magnitudes(differences) / light)
}

/// Σ|d| of what differences, each with the standard error of its noise, are without it.
fn sum_of_magnitudes(differences: impl Iterator<Item = (f64, f64)>) -> f64 {
    let mut sum = 0.0;
    // By magnitude over standard error. Weights are standard errors, as the magnitudes are in units of them.
    let mut bins = [0.0; BINS];
    for (difference, error) in differences {
        let magnitude = difference.abs() / error;
        if magnitude < LARGE {
            bins[(magnitude / LARGE * BINS as f64) as usize] += error;
        } else {
            sum += difference.abs();
        }
    }
    let weight: f64 = bins.iter().sum();
    if weight == 0.0 {
        return sum;
    }
    let magnitudes: [f64; MAGNITUDES] = std::array::from_fn(|i| match i {
        0 => 0.0,
        _ => LEAST * STEP.powi(i as i32 - 1),
    });
    // Likelihood of what a bin holds, of either sign, for each magnitude.
    let likelihoods: Vec<[f64; MAGNITUDES]> = (0..BINS)
        .map(|bin| {
            let found = LARGE * (bin as f64 + 0.5) / BINS as f64;
            magnitudes.map(|magnitude| noise(found - magnitude) + noise(found + magnitude))
        })
        .collect();
    let mut shares = [1.0 / MAGNITUDES as f64; MAGNITUDES];
    for _ in 0..ITERATIONS {
        let mut next = [0.0; MAGNITUDES];
        for (held, likelihoods) in bins.iter().zip(&likelihoods) {
            let joint: [f64; MAGNITUDES] = std::array::from_fn(|i| shares[i] * likelihoods[i]);
            let all: f64 = joint.iter().sum();
            (0..MAGNITUDES).for_each(|i| next[i] += held / weight * joint[i] / all);
        }
        shares = next;
    }
    let mean: f64 = (shares.iter().zip(magnitudes)).map(|(s, m)| s * m).sum();
    sum + weight * mean
}

/// Density of an error over a standard error that is itself estimated from [`REPLICATES`], up to a factor: Student's t distribution.
fn noise(deviation: f64) -> f64 {
    let freedom = f64::from(REPLICATES - 1);
    (1.0 + deviation * deviation / freedom).powf(-0.5 * (freedom + 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::reference::split_mix;
    use std::f64::consts::{PI, TAU};

    /// Normally distributed numbers (Box, Muller 1958).
    fn normal(counter: &mut u64) -> f64 {
        let [u, v] = [0, 1].map(|_| {
            *counter += 1;
            ((split_mix(*counter) >> 11) as f64 + 0.5) / (1u64 << 53) as f64
        });
        (-2.0 * u.ln()).sqrt() * (TAU * v).cos()
    }

    /// Σ|d| with noise and without, found and true: over the truth.
    fn found(differences: &[f64], noise: f64) -> [f64; 3] {
        let mut counter = 0;
        let measured: Vec<(f64, f64)> = (differences.iter())
            .map(|difference| {
                let replicates: Vec<f64> = (0..REPLICATES)
                    .map(|_| noise * f64::from(REPLICATES).sqrt() * normal(&mut counter))
                    .collect();
                let n = f64::from(REPLICATES);
                let mean = replicates.iter().sum::<f64>() / n;
                let squares: f64 = replicates.iter().map(|r| (r - mean).powi(2)).sum();
                (difference + mean, (squares / (n * (n - 1.0))).sqrt())
            })
            .collect();
        let truth: f64 = differences.iter().map(|d| d.abs()).sum();
        let raw: f64 = measured.iter().map(|(d, _)| d.abs()).sum();
        let of_noise = differences.len() as f64 * (2.0 / PI).sqrt() * noise;
        let in_quadrature = (raw * raw - of_noise * of_noise).max(0.0).sqrt();
        let without = sum_of_magnitudes(measured.into_iter());
        [raw, in_quadrature, without].map(|sum| sum / truth)
    }

    #[test]
    fn noise_is_taken_off_errors_at_edges_and_everywhere() {
        const TEXELS: usize = 16_384;
        // A tenth of the texels has nearly all of the error.
        let edges: Vec<f64> = (0..TEXELS)
            .map(|i| if i % 10 == 0 { 12.0 } else { 0.1 })
            .collect();
        let [raw, in_quadrature, without] = found(&edges, 1.0);
        println!("at edges {raw} {in_quadrature} {without}");
        assert!(raw > 1.4 && in_quadrature > 1.15);
        assert!((without - 1.0).abs() < 0.05, "{without}");

        let everywhere: Vec<f64> = (0..TEXELS)
            .map(|i| (i as f64 / TEXELS as f64 - 0.5) * 4.0)
            .collect();
        let [raw, _, without] = found(&everywhere, 1.0);
        println!("everywhere {raw} {without}");
        assert!(raw > 1.2);
        assert!((without - 1.0).abs() < 0.05, "{without}");
    }

    #[test]
    fn without_noise_differences_are_as_measured() {
        assert_eq!(
            sum_of_magnitudes([(0.5, 0.0), (-0.25, 0.0)].into_iter()),
            0.75
        );
        // 0 over 0 is no number.
        assert_eq!(sum_of_magnitudes([(0.0, 0.0)].into_iter()), 0.0);
    }
}
