//! Constants of the footprint's kernel κ = ((1 − t)/(1 − βt))⁴, t = dᵀΣ⁻¹d / a², with the flatness β.

use crate::render::gpu_types::Profile;
use crate::render::gpu_types::constants::SHARPEST;
use std::sync::LazyLock;

/// Variance of the kernel over the variance of the triangular patch, 12 k² with k = 0.47.
///
/// The centroids of a mesh's triangles form an affine image of a honeycomb. At k = 0.493 the first zero of the spectrum
/// of (1 − r²/a²)⁴ falls on the nearest frequencies of the honeycomb, so that the kernels add up to an even sum. A
/// slightly smaller k blurs less and ripples more: on the ring, k = 0.43, 0.45, 0.47, 0.49 gave L1 3.8, 3.2, 3.0, 3.0 %
/// at 4 k footprints and 2.3, 2.1, 2.0, 2.1 % under a sun of 2.5°.
pub const SPREAD: f32 = 12.0 * 0.47 * 0.47;

/// The same for flat patches, k = 0.65. Kernels of flat patches may be wide, because they blur only the caster's
/// silhouette, and with the sharpness [`SHARPEST`] their sum is even to 0.08 %.
pub const FLAT_SPREAD: f32 = 12.0 * 0.65 * 0.65;

/// The same for patch clusters, which form no honeycomb. The width of the environment cells also evens out the sum: 1.8
/// to 2.65 gave the same L1 on the ring under two windows, 5.3 to 5.5 %.
pub const CLUSTER_SPREAD: f32 = 1.8;

/// The same for the edges of pinhole images, which need less blur: 1.0, 1.4, 1.8 gave an L1 of 5.7, 4.8, 5.2 % on
/// `table`.
pub const IMAGE_SPREAD: f32 = 1.4;

/// Entries of the table that kernel_for() of kernel_fit.glsl reads.
const PROFILES: usize = 64;
/// Exponent of the flattest kernel. A disc has p = 0, but its kernel has no smooth edge.
const FLATTEST: f64 = 0.05;

/// The table of kernels: the flatness β, the squared support radius a² that gives unit covariance, and the mean M₀ =
/// ∫₀¹ κ dt. An entry has the kurtosis of the kernel (1 − t)^p; p goes from 0 to [`SHARPEST`] in even steps of √p.
pub fn profiles() -> &'static [Profile] {
    // Takes tens of milliseconds.
    static TABLE: LazyLock<Vec<Profile>> = LazyLock::new(|| {
        let place = |i| i as f64 / (PROFILES - 1) as f64;
        (0..PROFILES)
            .map(|i| profile((f64::from(SHARPEST) * place(i) * place(i)).max(FLATTEST)))
            .collect()
    });
    &TABLE
}

fn profile(p: f64) -> Profile {
    // With t = r²/a² the kernel's integral over the plane is π a² M₀ and its variance on an axis is a²/2 · M₁/M₀. Its
    // kurtosis is proportional to M₂M₀/M₁², which is 2(p + 2)/(p + 3) for (1 − t)^p.
    let kurtosis = 2.0 * (p + 2.0) / (p + 3.0);
    let (mut low, mut high) = (-1.0, 1.0 - 1e-6);
    for _ in 0..40 {
        let middle = 0.5 * (low + high);
        let [m0, m1, m2] = moments(middle);
        if m2 * m0 / (m1 * m1) > kurtosis {
            low = middle;
        } else {
            high = middle;
        }
    }
    let flatness = low;
    let [m0, m1, _] = moments(flatness);
    Profile {
        flatness: flatness as f32,
        support: (2.0 * m0 / m1) as f32,
        mean: m0 as f32,
        unused: 0.0,
    }
}

/// ∫₀¹ tⁱ ((1 − t)/(1 − βt))⁴ dt, i = 0, 1, 2, by the midpoint rule, good to 1e-6 here.
fn moments(flatness: f64) -> [f64; 3] {
    const STEPS: usize = 4000;
    let mut sums = [0.0; 3];
    for step in 0..STEPS {
        let t = (step as f64 + 0.5) / STEPS as f64;
        let value = ((1.0 - t) / (1.0 - flatness * t)).powi(4) / STEPS as f64;
        sums = [
            sums[0] + value,
            sums[1] + t * value,
            sums[2] + t * t * value,
        ];
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::*;

    /// (1 − t)⁴ has beta functions for moments: M₀ = 1/5, a² = 12.
    #[test]
    fn the_kernel_of_exponent_4_is_a_power() {
        let power = profile(4.0);
        assert!(power.flatness.abs() < 1e-4, "{power:?}");
        assert!((power.mean - 0.2).abs() < 1e-4, "{power:?}");
        assert!((power.support - 12.0).abs() < 1e-2, "{power:?}");
    }

    /// A disc of radius R has the variance R²/4 on an axis: a² falls toward 4.
    #[test]
    fn the_flattest_kernel_is_nearly_a_disc() {
        let first = profiles()[0];
        assert!(first.support > 4.0 && first.support < 5.0, "{first:?}");
        assert!(first.mean > 0.8 && first.mean < 1.0, "{first:?}");
    }

    /// Between the table's entries the interpolated kernel keeps its integral.
    #[test]
    fn the_table_is_fine_enough() {
        for pair in profiles().windows(2) {
            let mix = |f: fn(&Profile) -> f32| f64::from(0.5 * (f(&pair[0]) + f(&pair[1])));
            let [m0, m1, _] = moments(mix(|p| p.flatness));
            assert!((mix(|p| p.mean) / m0 - 1.0).abs() < 2e-3, "{pair:?}");
            assert!(
                (mix(|p| p.support) / (2.0 * m0 / m1) - 1.0).abs() < 2e-3,
                "{pair:?}"
            );
        }
    }
}
