//! Errors of an image A against a reference B. All sums run over texels and the channels R, G, B.
//!
//! | | | |
//! |---|---|---|
//! | L1 | Σ\|A − B\| / ΣB | share of the light that is in the wrong place, twice counted |
//! | L2 | √(Σ(A − B)² / ΣB²) | relative root mean square |
//! | energy ratio | ΣA / ΣB | 1 if no light is lost or invented |
//! | flicker | mean \|ΔA − ΔB\| / mean B | Δ the change from one frame to the next |

use crate::error::{Error, Result};
use crate::image_file::RgbImage;
use serde::Serialize;

/// Errors of one image; `None` where they would divide by a black reference.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Comparison {
    pub l1: Option<f64>,
    pub l2: Option<f64>,
    pub energy_ratio: Option<f64>,
    /// Where |A − B|, summed over the channels, is largest.
    pub worst: Texel,
}

/// A texel and its values in both images.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Texel {
    pub column: u32,
    /// From the top.
    pub row: u32,
    pub a: [f32; 3],
    pub b: [f32; 3],
}

/// Errors of a sequence: [`Comparison`]'s sums over all frames.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct SequenceComparison {
    pub frames: Vec<Comparison>,
    pub l1: Option<f64>,
    pub l2: Option<f64>,
    pub energy_ratio: Option<f64>,
    /// `None` for a single frame or a black reference.
    pub flicker: Option<f64>,
}

/// Compares `a` with the reference `b`.
///
/// # Errors
/// [`Error::Usage`] if their sizes differ, they have no texels, or a value is not finite.
pub fn compare(a: &RgbImage, b: &RgbImage) -> Result<Comparison> {
    check(a, b)?;
    let sums = Sums::of(a, b);
    Ok(Comparison {
        l1: sums.l1(),
        l2: sums.l2(),
        energy_ratio: sums.energy_ratio(),
        worst: worst(a, b),
    })
}

/// Compares the frames of a sequence one after the other, keeping only the last.
#[derive(Debug, Default)]
pub struct SequenceMeter {
    sums: Sums,
    frames: Vec<Comparison>,
    last: Option<(RgbImage, RgbImage)>,
    /// Σ|ΔA − ΔB| over all values and pairs of frames, and how many values that are.
    change: f64,
    changes: f64,
    values: f64,
}

impl SequenceMeter {
    /// Adds the next frame.
    ///
    /// # Errors
    /// [`Error::Usage`] as [`compare`], or if the size differs from the last frame's.
    pub fn push(&mut self, a: RgbImage, b: RgbImage) -> Result<()> {
        let comparison = compare(&a, &b)?;
        if let Some((last_a, last_b)) = &self.last {
            check(&b, last_b)?;
            for (a, b) in values(&a, last_a).zip(values(&b, last_b)) {
                self.change += ((a.0 - a.1) - (b.0 - b.1)).abs();
                self.changes += 1.0;
            }
        }
        self.sums.add(&Sums::of(&a, &b));
        self.values += 3.0 * a.pixels.len() as f64;
        self.frames.push(comparison);
        self.last = Some((a, b));
        Ok(())
    }

    /// The errors of all frames so far.
    pub fn finish(self) -> SequenceComparison {
        SequenceComparison {
            l1: self.sums.l1(),
            l2: self.sums.l2(),
            energy_ratio: self.sums.energy_ratio(),
            flicker: ratio(self.change / self.changes, self.sums.b / self.values),
            frames: self.frames,
        }
    }
}

/// Sums over values of A and B.
#[derive(Debug, Default)]
struct Sums {
    a: f64,
    b: f64,
    b_squared: f64,
    difference: f64,
    difference_squared: f64,
}

impl Sums {
    fn of(a: &RgbImage, b: &RgbImage) -> Self {
        let mut sums = Self::default();
        for (a, b) in values(a, b) {
            sums.a += a;
            sums.b += b;
            sums.b_squared += b * b;
            sums.difference += (a - b).abs();
            sums.difference_squared += (a - b) * (a - b);
        }
        sums
    }

    fn add(&mut self, other: &Self) {
        self.a += other.a;
        self.b += other.b;
        self.b_squared += other.b_squared;
        self.difference += other.difference;
        self.difference_squared += other.difference_squared;
    }

    fn l1(&self) -> Option<f64> {
        ratio(self.difference, self.b)
    }

    fn l2(&self) -> Option<f64> {
        ratio(self.difference_squared, self.b_squared).map(f64::sqrt)
    }

    fn energy_ratio(&self) -> Option<f64> {
        ratio(self.a, self.b)
    }
}

fn ratio(numerator: f64, denominator: f64) -> Option<f64> {
    (denominator > 0.0)
        .then(|| numerator / denominator)
        .filter(|r| r.is_finite())
}

/// Corresponding values of two images of the same size.
fn values(a: &RgbImage, b: &RgbImage) -> impl Iterator<Item = (f64, f64)> {
    (a.pixels.as_flattened().iter())
        .zip(b.pixels.as_flattened())
        .map(|(&a, &b)| (a.into(), b.into()))
}

/// Index of the largest of `count` values, the first of equals.
pub(super) fn first_largest(count: usize, value: impl Fn(usize) -> f32) -> usize {
    (0..count)
        .reduce(|worst, i| if value(i) > value(worst) { i } else { worst })
        .unwrap_or(0)
}

pub(super) fn worst(a: &RgbImage, b: &RgbImage) -> Texel {
    let difference = |i: usize| -> f32 {
        (0..3)
            .map(|c| (a.pixels[i][c] - b.pixels[i][c]).abs())
            .sum()
    };
    let index = first_largest(a.pixels.len(), difference);
    Texel {
        column: index as u32 % a.width,
        row: index as u32 / a.width,
        a: a.pixels[index],
        b: b.pixels[index],
    }
}

pub(super) fn check(a: &RgbImage, b: &RgbImage) -> Result<()> {
    let usage = |reason: String, remedy: &str| {
        Err(Error::Usage {
            reason,
            remedy: remedy.into(),
        })
    };
    if (a.width, a.height) != (b.width, b.height) {
        return usage(
            format!(
                "the images differ in size: {}x{} and {}x{}",
                a.width, a.height, b.width, b.height
            ),
            "compare images of the same size",
        );
    }
    if a.pixels.is_empty() {
        return usage("the images are empty".into(), "compare images with pixels");
    }
    for (name, image) in [("first", a), ("second", b)] {
        if let Some([x, y]) = image.first_not_finite() {
            return usage(
                format!("pixel ({x}, {y}) of the {name} image is not finite"),
                "compare images without NaN and infinity",
            );
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use approx::assert_relative_eq;

    fn image(values: &[f32]) -> RgbImage {
        RgbImage {
            width: values.len() as u32,
            height: 1,
            pixels: values.iter().map(|&v| [v, 2.0 * v, 0.0]).collect(),
        }
    }

    #[test]
    fn numbers_worked_out_by_hand() {
        let comparison = compare(&image(&[1.0, 3.0]), &image(&[1.0, 2.0])).unwrap();
        // B: 1 2, 2 4; A − B: 0 0, 1 2
        assert_relative_eq!(comparison.l1.unwrap(), 3.0 / 9.0);
        assert_relative_eq!(comparison.l2.unwrap(), (5.0f64 / 25.0).sqrt());
        assert_relative_eq!(comparison.energy_ratio.unwrap(), 12.0 / 9.0);
        let worst = comparison.worst;
        assert_eq!((worst.column, worst.row), (1, 0));
        assert_eq!((worst.a, worst.b), ([3.0, 6.0, 0.0], [2.0, 4.0, 0.0]));
    }

    #[test]
    fn equal_images_have_no_error_and_others_do() {
        let b = image(&[0.5, 0.25, 4.0]);
        let same = compare(&b, &b).unwrap();
        assert_eq!(
            (same.l1, same.l2, same.energy_ratio),
            (Some(0.0), Some(0.0), Some(1.0))
        );
        let mut other = b.clone();
        other.pixels[1][2] = 1e-6;
        assert!(compare(&other, &b).unwrap().l1.unwrap() > 0.0);
    }

    #[test]
    fn light_in_the_wrong_place_keeps_the_energy_and_counts_twice() {
        let moved = compare(&image(&[0.0, 1.0]), &image(&[1.0, 0.0])).unwrap();
        assert_eq!((moved.l1, moved.energy_ratio), (Some(2.0), Some(1.0)));
    }

    #[test]
    fn black_reference_has_no_relative_error() {
        let comparison = compare(&image(&[1.0]), &image(&[0.0])).unwrap();
        assert_eq!(
            (comparison.l1, comparison.l2, comparison.energy_ratio),
            (None, None, None)
        );
        let json = serde_json::to_string(&comparison).unwrap();
        assert!(
            json.contains("\"l1\":null") && !json.contains("NaN"),
            "{json}"
        );
    }

    #[test]
    fn unequal_sizes_and_values_that_are_not_finite_are_refused() {
        let message = compare(&image(&[1.0]), &image(&[1.0, 2.0]))
            .unwrap_err()
            .to_string();
        assert!(message.contains("1x1 and 2x1"), "{message}");
        let message = compare(&image(&[1.0, 0.5]), &image(&[1.0, f32::NAN]))
            .unwrap_err()
            .to_string();
        assert!(message.contains("pixel (1, 0) of the second"), "{message}");
    }

    #[test]
    fn flicker_sees_what_changes_and_not_what_is_wrong_all_the_time() {
        let truth = [[1.0, 1.0], [1.5, 1.0], [2.0, 1.0]];
        let measure = |frames: [[f32; 2]; 3]| {
            let mut meter = SequenceMeter::default();
            for (a, b) in frames.iter().zip(&truth) {
                meter.push(image(a), image(b)).unwrap();
            }
            meter.finish()
        };
        assert_eq!(measure(truth).flicker, Some(0.0));
        let offset = measure(truth.map(|f| f.map(|v| v + 0.25)));
        assert_eq!(offset.flicker, Some(0.0));
        assert!(offset.l1.unwrap() > 0.1);
        let mut jump = truth;
        jump[1][1] += 0.5;
        // |ΔA − ΔB|: 0.5 and 1.0 in R and G at one texel, twice; 12 changes. ΣB = 22.5 over 18.
        assert_relative_eq!(measure(jump).flicker.unwrap(), (3.0 / 12.0) / (22.5 / 18.0));
        assert_eq!(measure(truth).frames.len(), 3);
    }

    #[test]
    fn one_frame_has_no_flicker() {
        let mut meter = SequenceMeter::default();
        meter.push(image(&[1.0]), image(&[1.0])).unwrap();
        assert_eq!(meter.finish().flicker, None);
    }
}
