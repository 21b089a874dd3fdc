//! Constants of the footprint's kernel (1 − tⁿ)^q, t = dᵀΣ⁻¹d / a².

use super::layout::Profile;

/// Variance of the kernel over that of the triangular patch, 12 k² with k = 0.47.
///
/// Centroids of a mesh's triangles form an affine image of a honeycomb, and at k = 0.493 the first
/// zero of the spectrum of (1 − r²/a²)⁴ falls on its nearest frequencies, so that the kernels add
/// up to an even sheet. A little less blurs less and ripples a little more: on the ring, k = 0.43,
/// 0.45, 0.47, 0.49 gave L1 3.8, 3.2, 3.0, 3.0 % at 4 k footprints and 2.3, 2.1, 2.0, 2.1 % under
/// a sun of 2.5°.
pub const SPREAD: f32 = 12.0 * 0.47 * 0.47;

/// Largest exponent p of (1 − t)^p. A larger one blurs more and ripples less.
pub const SHARPEST: f32 = 4.0;

/// Entries of the table that kernel_for() of footprint.glsl reads.
const PROFILES: usize = 64;

/// Kernels (1 − tⁿ)^1.5 for p from 0 to 1.5: n, the squared support radius a² that gives unit
/// covariance, and the mean M₀ = ∫₀¹ (1 − tⁿ)^1.5 dt.
pub fn profiles() -> Vec<Profile> {
    (0..PROFILES)
        .map(|i| profile(1.5 * i as f64 / (PROFILES - 1) as f64))
        .collect()
}

fn profile(p: f64) -> Profile {
    let n = flatness(p);
    // With t = r²/a² the integral over the plane is π a² M₀ and the variance an axis is
    // a²/2 · M₁/M₀, M₁ = ∫₀¹ t (1 − tⁿ)^1.5 dt.
    let m0 = integrate(|t| (1.0 - t.powf(n)).powf(1.5));
    let m1 = integrate(|t| t * (1.0 - t.powf(n)).powf(1.5));
    Profile {
        inner: n as f32,
        support: (2.0 * m0 / m1) as f32,
        mean: m0 as f32,
        unused: 0.0,
    }
}

/// Exponent n that fits a disc of light blurred by a patch best, by the share that the disc has
/// in the covariance, as p = 8/q − 3; found by search, interpolated in logarithms.
fn flatness(p: f64) -> f64 {
    const FITTED: [(f64, f64); 7] = [
        (0.05, 10.05),
        (0.1, 6.66),
        (0.2, 4.31),
        (0.3, 3.29),
        (0.5, 2.31),
        (1.0, 1.38),
        (1.5, 1.0),
    ];
    let p = p.clamp(FITTED[0].0, FITTED[6].0);
    let i = FITTED[1..6].iter().filter(|(known, _)| *known < p).count();
    let ((p0, n0), (p1, n1)) = (FITTED[i], FITTED[i + 1]);
    let share = (p / p0).ln() / (p1 / p0).ln();
    n0 * (n1 / n0).powf(share)
}

/// ∫₀¹ by the midpoint rule, good to 1e-6 here.
fn integrate(f: impl Fn(f64) -> f64) -> f64 {
    const STEPS: usize = 20_000;
    (0..STEPS)
        .map(|i| f((i as f64 + 0.5) / STEPS as f64))
        .sum::<f64>()
        / STEPS as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    /// At n = 1 the integrals are beta functions: M₀ = 2/5, a² = 7.
    #[test]
    fn the_family_meets_the_power_kernel() {
        let last = *profiles().last().expect("64 entries");
        assert!((last.inner - 1.0).abs() < 1e-6);
        assert!((last.mean - 0.4).abs() < 1e-5);
        assert!((last.support - 7.0).abs() < 1e-4);
    }

    /// A disc of radius R has the variance R²/4 an axis: a² = 4 as n grows.
    #[test]
    fn the_flattest_kernel_is_nearly_a_disc() {
        let first = profiles()[0];
        assert!(first.support > 4.0 && first.support < 4.6, "{first:?}");
        assert!(first.mean > 0.85 && first.mean < 1.0, "{first:?}");
    }
}
