//! Transparent media by name.

use std::ops::RangeInclusive;

/// Indices of refraction that a dielectric can have.
pub const IOR: RangeInclusive<f64> = 0.1..=10.0;

/// Sellmeier's equation, λ in µm:
///
/// ```text
/// n² = 1 + Σ bᵢ λ²/(λ² − cᵢ)
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sellmeier {
    /// (bᵢ, cᵢ), cᵢ in µm².
    pub terms: &'static [[f64; 2]],
}

/// The d line of helium, µm, at which a medium's index is stated.
pub const D_LINE: f64 = 0.587_561_8;

impl Sellmeier {
    /// Index of refraction at a vacuum wavelength in µm.
    pub fn index(&self, wavelength: f64) -> f64 {
        let square = wavelength * wavelength;
        let sum = |[b, c]: &[f64; 2]| b * square / (square - c);
        (1.0 + self.terms.iter().map(sum).sum::<f64>()).sqrt()
    }
}

/// Media by name. Coefficients: BK7 and SF10 from SCHOTT's data sheets; fused silica, Malitson 1965; water at 20 °C, Daimon
/// and Masumura 2007; diamond, Peter 1923; sapphire's ordinary ray, Malitson and Dodge 1972; PMMA, Szczurowski 2013
/// (collected by refractiveindex.info, Polyanskiy 2024).
pub const GLASSES: [(&str, Sellmeier); 7] = [
    (
        "BK7",
        Sellmeier {
            terms: &[
                [1.039_612_12, 0.006_000_698_67],
                [0.231_792_344, 0.020_017_914_4],
                [1.010_469_45, 103.560_653],
            ],
        },
    ),
    (
        "SF10",
        Sellmeier {
            terms: &[
                [1.621_539_02, 0.012_224_145_7],
                [0.256_287_842, 0.059_573_677_5],
                [1.644_475_52, 147.468_793],
            ],
        },
    ),
    (
        "fused silica",
        Sellmeier {
            terms: &[
                [0.696_166_3, 0.004_679_148],
                [0.407_942_6, 0.013_512_063],
                [0.897_479_4, 97.934_003],
            ],
        },
    ),
    (
        "water",
        Sellmeier {
            terms: &[
                [0.568_402_756_5, 0.005_101_829_712],
                [0.172_617_739_1, 0.018_211_539_36],
                [0.020_861_895_78, 0.026_207_222_93],
                [0.113_074_868_8, 10.697_927_21],
            ],
        },
    ),
    (
        "diamond",
        Sellmeier {
            terms: &[[0.330_6, 0.030_625], [4.335_6, 0.011_236]],
        },
    ),
    (
        "sapphire",
        Sellmeier {
            terms: &[
                [1.431_349_3, 0.005_279_926],
                [0.650_547_13, 0.014_238_265],
                [5.341_402_1, 325.017_834],
            ],
        },
    ),
    (
        "PMMA",
        Sellmeier {
            terms: &[[1.181_9, 0.011_313]],
        },
    ),
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
}
