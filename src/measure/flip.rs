//! FLIP: the difference that a viewer sees who flips between a picture and its reference.
//!
//! Andersson, Nilsson, Akenine-Möller, Oskarsson, Åström, Fairchild, *FLIP: A difference evaluator for
//! alternating images*, Proceedings of the ACM on Computer Graphics and Interactive Techniques 3(2), 2020,
//! by the crate `flip-rs`. 0 is equal and 1 as different as can be. The pictures are those that
//! [`crate::tone_map`] makes, 8-bit sRGB, at [`PIXELS_PER_DEGREE`].

use super::compare::first_largest;
use crate::error::{Error, Result};
use crate::image_file::RgbImage;
use crate::tone_map::to_srgb;
use serde::Serialize;

/// A display of 3840 pixels over 0.7 m at 0.7 m, FLIP's default.
pub const PIXELS_PER_DEGREE: f32 = flip_rs::DEFAULT_PPD;

/// Regions over a picture's height.
const REGIONS: u32 = 8;

/// FLIP of a picture, and where it is worst.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Flip {
    /// Of both pictures: they are multiplied by 2^exposure_ev before tone mapping.
    pub exposure_ev: f64,
    /// Over all pixels, 0..=1.
    pub mean: f64,
    /// The pixel with the largest value.
    pub worst_pixel: FlipPixel,
    /// The square of an eighth of the picture's height with the largest mean; those at the right and lower border
    /// may be cut off.
    pub worst_region: Region,
}

/// A pixel's FLIP.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct FlipPixel {
    pub column: u32,
    /// From the top.
    pub row: u32,
    pub flip: f64,
}

/// A part of a picture.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Region {
    /// First and last.
    pub columns: [u32; 2],
    /// First and last, from the top.
    pub rows: [u32; 2],
    /// Mean over its pixels.
    pub flip: f64,
    /// Of Σ|A − B| over the whole picture; `None` where that is 0.
    pub share_of_l1: Option<f64>,
}

/// FLIP of the radiance `a` against the reference `b`, which have the same size and finite values.
///
/// # Errors
/// [`Error::Usage`] if they do not.
pub fn flip(a: &RgbImage, b: &RgbImage, exposure_ev: f64) -> Result<Flip> {
    let failed = |error: flip_rs::FlipError| Error::Usage {
        reason: format!("the images cannot be compared by FLIP: {error}"),
        remedy: "compare images of the same size without NaN and infinity".into(),
    };
    let picture = |image: &RgbImage| {
        let bytes = to_srgb(image, exposure_ev);
        flip_rs::RgbImage::new(image.width as usize, image.height as usize, bytes).map_err(failed)
    };
    let map = flip_rs::ldr_flip(&picture(b)?, &picture(a)?, PIXELS_PER_DEGREE).map_err(failed)?;
    let values = map.pixels();
    let mean = |sum: f64, count: usize| sum / count as f64;
    let total: f64 = values.iter().map(|&v| f64::from(v)).sum();
    let worst = first_largest(values.len(), |i| values[i]);
    let worst_region = regions(a.width, a.height)
        .map(|(columns, rows)| Sums::of(a, b, values, columns, rows))
        .reduce(|worst, next| if next.flip > worst.flip { next } else { worst })
        .expect("a picture has pixels");
    let l1: f64 = (0..values.len()).map(|i| difference(a, b, i)).sum();
    Ok(Flip {
        exposure_ev,
        mean: mean(total, values.len()),
        worst_pixel: FlipPixel {
            column: worst as u32 % a.width,
            row: worst as u32 / a.width,
            flip: values[worst].into(),
        },
        worst_region: Region {
            columns: worst_region.columns,
            rows: worst_region.rows,
            flip: worst_region.flip,
            share_of_l1: (l1 > 0.0).then(|| worst_region.l1 / l1),
        },
    })
}

/// First and last columns and rows.
fn regions(width: u32, height: u32) -> impl Iterator<Item = ([u32; 2], [u32; 2])> {
    let side = height.div_ceil(REGIONS);
    let spans = move |length: u32| {
        (0..length.div_ceil(side)).map(move |i| [i * side, ((i + 1) * side).min(length) - 1])
    };
    spans(height).flat_map(move |rows| spans(width).map(move |columns| (columns, rows)))
}

/// Of a region.
struct Sums {
    columns: [u32; 2],
    rows: [u32; 2],
    /// Mean.
    flip: f64,
    /// Σ|A − B|
    l1: f64,
}

impl Sums {
    fn of(a: &RgbImage, b: &RgbImage, flip: &[f32], columns: [u32; 2], rows: [u32; 2]) -> Self {
        let (mut sum, mut l1, mut count) = (0.0, 0.0, 0.0);
        for row in rows[0]..=rows[1] {
            for column in columns[0]..=columns[1] {
                let index = row as usize * a.width as usize + column as usize;
                sum += f64::from(flip[index]);
                l1 += difference(a, b, index);
                count += 1.0;
            }
        }
        Self {
            columns,
            rows,
            flip: sum / count,
            l1,
        }
    }
}

/// |A − B| of a pixel, over its channels.
fn difference(a: &RgbImage, b: &RgbImage, index: usize) -> f64 {
    (a.pixels[index].iter().zip(b.pixels[index]))
        .map(|(&a, b)| (f64::from(a) - f64::from(b)).abs())
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(value: impl Fn(u32, u32) -> f32) -> RgbImage {
        let (width, height) = (50, 32);
        RgbImage {
            width,
            height,
            pixels: (0..width * height)
                .map(|i| [value(i % width, i / width); 3])
                .collect(),
        }
    }

    #[test]
    fn equal_pictures_have_none_and_black_and_white_have_all() {
        let [black, white] = [0.0, 1e6].map(|value| image(|_, _| value));
        let same = flip(&white, &white, 0.0).unwrap();
        assert_eq!((same.mean, same.worst_region.share_of_l1), (0.0, None));
        let all = flip(&black, &white, 0.0).unwrap();
        assert!(all.mean > 0.95 && all.mean <= 1.0, "{}", all.mean);
        assert!((all.mean - all.worst_region.flip).abs() < 0.05);
    }

    #[test]
    fn the_worst_place_is_named() {
        // Regions have 4 x 4 pixels; the right ones 2 x 4.
        let reference = image(|_, _| 0.2);
        let spot = image(|x, y| if (x, y) == (49, 17) { 0.9 } else { 0.2 });
        let found = flip(&spot, &reference, 0.0).unwrap();
        let region = &found.worst_region;
        assert_eq!((region.columns, region.rows), ([48, 49], [16, 19]));
        assert!((region.share_of_l1.unwrap() - 1.0).abs() < 1e-6);
        let pixel = &found.worst_pixel;
        assert!(
            pixel.column.abs_diff(49) <= 1 && pixel.row.abs_diff(17) <= 1,
            "{pixel:?}"
        );
    }

    #[test]
    fn the_exposure_counts() {
        let [a, b] = [0.01, 0.011].map(|value| image(|_, _| value));
        let mean = |exposure| flip(&a, &b, exposure).unwrap().mean;
        assert!(mean(4.0) > 1.5 * mean(0.0), "{} {}", mean(4.0), mean(0.0));
        assert!(
            flip(
                &a,
                &RgbImage {
                    width: 32,
                    height: 50,
                    ..b.clone()
                },
                0.0
            )
            .is_err()
        );
    }
}
