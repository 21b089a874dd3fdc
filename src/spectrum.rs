//! Colours of light of one wavelength.
//!
//! Light of scene files has a colour, not a spectrum. A colour channel is taken to have the spectrum that the CIE 1931 standard
//! observer sees in it, so that light without dispersion keeps its colour:
//!
//! ```text
//! E_c = P_c ∫ w_c(λ) T(λ) dλ,   ∫ w_c(λ) dλ = 1
//! ```
//!
//! with w the colour matching functions in linear sRGB, each divided by its integral, and T(λ) the transport. Pure spectral
//! colours lie outside sRGB, so w has negative values, and so have light maps with a spectrum.

use glam::{DMat3, DVec3};
use std::sync::LazyLock;

/// Vacuum wavelengths that light consists of, µm. The eye sees 0.3 % of an even spectrum beyond it.
pub const WAVELENGTHS: [f64; 2] = [0.4, 0.7];
/// The wavelength of light before it is dispersed, µm.
pub const MIDDLE: f64 = 0.55;
/// Intervals of the table of integrals.
const INTERVALS: usize = 600;

/// CIE 1931 colour matching functions x, y, z at a wavelength in µm, by the fits of Wyman, Sloan and Shirley, *Simple analytic
/// approximations to the CIE XYZ color matching functions*, JCGT 2(2), 2013.
fn matching(wavelength: f64) -> DVec3 {
    let lobe = |height: f64, mean: f64, below: f64, above: f64| {
        let distance = 1e3 * wavelength - mean;
        let deviation = if distance < 0.0 { below } else { above };
        height * (-0.5 * (distance / deviation).powi(2)).exp()
    };
    DVec3::new(
        lobe(1.056, 599.8, 37.9, 31.0)
            + lobe(0.362, 442.0, 16.0, 26.7)
            + lobe(-0.065, 501.1, 20.4, 26.2),
        lobe(0.821, 568.8, 46.9, 40.5) + lobe(0.286, 530.9, 16.3, 31.1),
        lobe(1.217, 437.0, 11.8, 36.0) + lobe(0.681, 459.0, 26.0, 13.8),
    )
}

/// Matrix from CIE XYZ to linear sRGB (IEC 61966-2-1).
const RGB_OF_XYZ: DMat3 = DMat3::from_cols(
    DVec3::new(3.2406, -0.9689, 0.0557),
    DVec3::new(-1.5372, 1.8758, -0.2040),
    DVec3::new(-0.4986, 0.0415, 1.0570),
);

struct Table {
    /// Integral of the matching functions in linear sRGB.
    total: DVec3,
    /// Integrals of w from the shortest wavelength on, at equal steps.
    weights: Vec<DVec3>,
    /// The same of |w_r| + |w_g| + |w_b|, over its total.
    shares: Vec<f64>,
}

static TABLE: LazyLock<Table> = LazyLock::new(|| {
    let step = (WAVELENGTHS[1] - WAVELENGTHS[0]) / INTERVALS as f64;
    // By the midpoint rule.
    let middle = |i: usize| RGB_OF_XYZ * matching(WAVELENGTHS[0] + (i as f64 + 0.5) * step);
    let total = step * (0..INTERVALS).map(middle).sum::<DVec3>();
    let (mut weight, mut share) = (DVec3::ZERO, 0.0);
    let (mut weights, mut shares) = (vec![weight], vec![share]);
    for i in 0..INTERVALS {
        let value = step * middle(i) / total;
        weight += value;
        share += value.abs().element_sum();
        weights.push(weight);
        shares.push(share);
    }
    shares.iter_mut().for_each(|value| *value /= share);
    Table {
        total,
        weights,
        shares,
    }
});

/// w at a wavelength in µm, RGB, 1/µm.
pub fn weight(wavelength: f64) -> DVec3 {
    RGB_OF_XYZ * matching(wavelength) / TABLE.total
}

/// ∫ w dλ from the shortest wavelength to `wavelength`, µm: 0 to 1.
pub fn weight_below(wavelength: f64) -> DVec3 {
    let [low, high] = WAVELENGTHS;
    let place = ((wavelength - low) / (high - low)).clamp(0.0, 1.0) * INTERVALS as f64;
    let index = (place as usize).min(INTERVALS - 1);
    let [a, b] = [TABLE.weights[index], TABLE.weights[index + 1]];
    a.lerp(b, place - index as f64)
}

/// A wavelength, µm, for `u` uniform in [0, 1), and w over its density. Chosen in proportion to |w_r| + |w_g| + |w_b|.
pub fn draw(u: f64) -> (f64, DVec3) {
    let shares = &TABLE.shares;
    let index = (shares.partition_point(|&share| share <= u)).clamp(1, INTERVALS) - 1;
    let [a, b] = [shares[index], shares[index + 1]];
    let step = (WAVELENGTHS[1] - WAVELENGTHS[0]) / INTERVALS as f64;
    let wavelength = WAVELENGTHS[0] + (index as f64 + (u - a) / (b - a)) * step;
    let density = (b - a) / step;
    (wavelength, weight(wavelength) / density)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Peaks of the tabulated CIE 1931 functions: x 1.0622 at 599 nm, y 1.0000 at 555 nm, z 1.7826 at 446 nm. The fits are
    /// within 2 % of the largest value.
    #[test]
    fn matching_functions_have_the_tabulated_peaks() {
        for (wavelength, axis, value) in [(0.599, 0, 1.0622), (0.555, 1, 1.0), (0.446, 2, 1.7826)] {
            let fitted = matching(wavelength)[axis];
            assert!((fitted - value).abs() < 0.02 * value, "{axis}: {fitted}");
        }
    }

    #[test]
    fn the_weights_of_all_wavelengths_add_up_to_white() {
        let sum: DVec3 = (0..1000)
            .map(|i| draw((f64::from(i) + 0.5) / 1000.0).1)
            .sum();
        assert!(
            (sum / 1000.0 - DVec3::ONE).abs().max_element() < 1e-3,
            "{sum}"
        );
        assert_eq!(weight_below(WAVELENGTHS[0]), DVec3::ZERO);
        let all = weight_below(WAVELENGTHS[1]);
        assert!((all - DVec3::ONE).abs().max_element() < 1e-12);
    }
}
