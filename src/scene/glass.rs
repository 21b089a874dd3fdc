//! Transparent media: by name, and how their index of refraction depends on the wavelength.

use crate::spectrum::WAVELENGTHS;
use std::ops::RangeInclusive;

/// Indices of refraction that a dielectric can have.
pub const IOR: RangeInclusive<f64> = 0.1..=10.0;

/// Maximum number of terms of [`Sellmeier`].
pub const SELLMEIER_TERMS: usize = 4;

/// Sellmeier's equation, λ in µm:
///
/// ```text
/// n² = 1 + Σ bᵢ λ²/(λ² − cᵢ)
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sellmeier {
    /// (bᵢ, cᵢ), cᵢ in µm²; (0, 0) beyond the last.
    pub terms: [[f64; 2]; SELLMEIER_TERMS],
}

/// The d line of helium, µm, at which a medium's index is stated.
pub const D_LINE: f64 = 0.587_561_8;

impl Sellmeier {
    /// A sum of at most `SELLMEIER_TERMS` terms; further ones are ignored.
    pub const fn new(given: &[[f64; 2]]) -> Self {
        let mut terms = [[0.0; 2]; SELLMEIER_TERMS];
        let mut i = 0;
        while i < given.len() && i < SELLMEIER_TERMS {
            terms[i] = given[i];
            i += 1;
        }
        Self { terms }
    }

    /// Index of refraction at a vacuum wavelength in µm.
    pub fn index(&self, wavelength: f64) -> f64 {
        let square = wavelength * wavelength;
        let sum = |[b, c]: &[f64; 2]| b * square / (square - c);
        (1.0 + self.terms.iter().map(sum).sum::<f64>()).sqrt()
    }
}

/// How an index of refraction depends on the vacuum wavelength.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Dispersion {
    /// n = A + B/λ² + C/λ⁴, λ in µm (Cauchy).
    Cauchy([f64; 3]),
    Sellmeier(Sellmeier),
}

impl Dispersion {
    /// Cauchy's equation through the indices at 650, 550 and 450 nm.
    pub fn through([red, green, blue]: [f64; 3]) -> Self {
        let [r, g, b] = [0.65, 0.55, 0.45].map(|wavelength: f64| wavelength.powi(-2));
        // Newton's divided differences.
        let first = (green - red) / (g - r);
        let second = ((blue - green) / (b - g) - first) / (b - r);
        Self::Cauchy([
            red - first * r + second * r * g,
            first - second * (r + g),
            second,
        ])
    }

    /// Index of refraction at a vacuum wavelength in µm.
    pub fn index(&self, wavelength: f64) -> f64 {
        match self {
            Self::Cauchy([a, b, c]) => {
                let inverse = wavelength.powi(-2);
                a + inverse * (b + inverse * c)
            }
            Self::Sellmeier(sellmeier) => sellmeier.index(wavelength),
        }
    }

    /// Smallest and largest index of visible light; NaN where there is none.
    pub fn range(&self) -> [f64; 2] {
        const STEPS: u32 = 300;
        let [low, high] = WAVELENGTHS;
        let at = |i| self.index(low + (high - low) * f64::from(i) / f64::from(STEPS));
        // min and max pass over NaN.
        (0..=STEPS)
            .map(at)
            .fold([f64::INFINITY, f64::NEG_INFINITY], |range, index| {
                match index.is_nan() || range[0].is_nan() {
                    true => [f64::NAN; 2],
                    false => [range[0].min(index), range[1].max(index)],
                }
            })
    }
}

/// Media by name. Coefficients: BK7 and SF10 from SCHOTT's data sheets; fused silica, Malitson 1965; water at 20 °C, Daimon
/// and Masumura 2007; diamond, Peter 1923; sapphire's ordinary ray, Malitson and Dodge 1972; PMMA, Szczurowski 2013
/// (collected by refractiveindex.info, Polyanskiy 2024).
pub const GLASSES: [(&str, Sellmeier); 7] = [
    (
        "BK7",
        Sellmeier::new(&[
            [1.039_612_12, 0.006_000_698_67],
            [0.231_792_344, 0.020_017_914_4],
            [1.010_469_45, 103.560_653],
        ]),
    ),
    (
        "SF10",
        Sellmeier::new(&[
            [1.621_539_02, 0.012_224_145_7],
            [0.256_287_842, 0.059_573_677_5],
            [1.644_475_52, 147.468_793],
        ]),
    ),
    (
        "fused silica",
        Sellmeier::new(&[
            [0.696_166_3, 0.004_679_148],
            [0.407_942_6, 0.013_512_063],
            [0.897_479_4, 97.934_003],
        ]),
    ),
    (
        "water",
        Sellmeier::new(&[
            [0.568_402_756_5, 0.005_101_829_712],
            [0.172_617_739_1, 0.018_211_539_36],
            [0.020_861_895_78, 0.026_207_222_93],
            [0.113_074_868_8, 10.697_927_21],
        ]),
    ),
    (
        "diamond",
        Sellmeier::new(&[[0.330_6, 0.030_625], [4.335_6, 0.011_236]]),
    ),
    (
        "sapphire",
        Sellmeier::new(&[
            [1.431_349_3, 0.005_279_926],
            [0.650_547_13, 0.014_238_265],
            [5.341_402_1, 325.017_834],
        ]),
    ),
    ("PMMA", Sellmeier::new(&[[1.181_9, 0.011_313]])),
];

#[cfg(test)]
mod tests {
    use super::*;

    /// The indices at the d line that the sources print.
    #[test]
    fn indices_at_the_d_line() {
        let printed = [1.5168, 1.72825, 1.45846, 1.33336, 2.4175, 1.76823, 1.4906];
        for ((name, sellmeier), printed) in GLASSES.iter().zip(printed) {
            let index = sellmeier.index(D_LINE);
            assert!((index - printed).abs() < 5e-4, "{name}: {index}");
        }
    }

    #[test]
    fn cauchy_goes_through_three_indices() {
        let given = [1.51, 1.52, 1.54];
        let dispersion = Dispersion::through(given);
        for (wavelength, index) in [0.65, 0.55, 0.45].into_iter().zip(given) {
            assert!((dispersion.index(wavelength) - index).abs() < 1e-12);
        }
    }

    /// BK7's Abbe number, (n_d − 1)/(n_F − n_C), is 64.17 by SCHOTT's data sheet.
    #[test]
    fn abbe_number_of_bk7() {
        let (_, bk7) = GLASSES[0];
        let abbe = (bk7.index(D_LINE) - 1.0) / (bk7.index(0.486_132_7) - bk7.index(0.656_272_5));
        assert!((abbe - 64.17).abs() < 0.01, "{abbe}");
    }
}
