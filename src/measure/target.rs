//! A light map against the picture that it should show, as a designer of lenses asks: only the distribution of the light counts,
//! since a picture has no unit.

use super::compare::{Texel, check, worst};
use crate::error::{Error, Result};
use crate::image_file::{RgbImage, decode_exr, finite};
use crate::input;
use crate::scene::{covered, memory, read_texture};
use serde::Serialize;
use std::path::Path;

/// Bytes of a file: 16 384² pixels of 32-bit R, G, B.
const MAX_BYTES: u64 = 4 << 30;
/// Most pixels on a side.
const MAX_SIDE: u32 = 16_384;

/// How far the distribution of light in a map is from a target's. Both are scaled to the mean 1 first.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TargetComparison {
    /// Width and height at which both were compared: of each side the smaller one. The finer image was averaged.
    pub size: [u32; 2],
    /// Mean of the map over the mean of the target: what the target's unit stands for in the map's.
    pub scale: f64,
    /// Pearson's coefficient over all values; `None` where one of both is even.
    pub correlation: Option<f64>,
    /// Σ|A − B| / ΣB: twice the share of the light that is in the wrong place.
    pub l1: f64,
    /// √(mean (A − B)²) / mean B
    pub rms: f64,
    /// Where |A − B|, summed over the channels, is largest.
    pub worst: Texel,
}

/// Reads a picture: EXR, linear, or PNG and JPEG in sRGB, by the content. Adds to `warnings` what is odd but usable.
///
/// # Errors
/// [`Error::Input`] if the file is no such image, too large, cut short, or has a value that is not finite.
pub fn read_target(path: &Path, warnings: &mut Vec<String>) -> Result<RgbImage> {
    const EXR_MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];
    let content = input::read(path, MAX_BYTES)?;
    if content.starts_with(&EXR_MAGIC) {
        return finite(
            path,
            decode_exr(path, content, [MAX_SIDE; 2], memory::PIXEL)?,
        );
    }
    drop(content);
    let texture = read_texture(path, warnings)?;
    let level = &texture.levels[0];
    Ok(RgbImage {
        width: level.width,
        height: level.height,
        pixels: (level.texels.iter())
            .map(|[r, g, b, _]| [*r, *g, *b].map(|byte| crate::srgb::decode(byte) as f32))
            .collect(),
    })
}

/// Compares a map with its target, and returns both as they were compared: of one size, of the mean 1.
///
/// # Errors
/// [`Error::Usage`] if they are not of one shape, or one of them has no light or a value that is not finite or negative.
pub fn compare_with_target(
    map: &RgbImage,
    target: &RgbImage,
) -> Result<(TargetComparison, [RgbImage; 2])> {
    let size = common_size(map, target)?;
    let images = [map, target].map(|image| averaged(image, size));
    check(&images[0], &images[1])?;
    let means = [mean(&images[0]), mean(&images[1])];
    for (mean, name) in means.into_iter().zip(["map", "target"]) {
        if mean <= 0.0 {
            return Err(Error::Usage {
                reason: format!("the {name} holds no light: its mean is {mean}"),
                remedy: "compare images that are not black".into(),
            });
        }
    }
    let [a, b] = images;
    let a = scaled(a, means[0]);
    let b = scaled(b, means[1]);
    let pairs = || {
        (a.pixels.as_flattened().iter())
            .zip(b.pixels.as_flattened())
            .map(|(&a, &b)| [f64::from(a), f64::from(b)])
    };
    let count = pairs().count() as f64;
    let of = |term: fn([f64; 2]) -> f64| pairs().map(term).sum::<f64>() / count;
    // The means are 1.
    let covariance = of(|[a, b]| (a - 1.0) * (b - 1.0));
    let variances = of(|[a, _]| (a - 1.0).powi(2)) * of(|[_, b]| (b - 1.0).powi(2));
    let comparison = TargetComparison {
        size,
        scale: means[0] / means[1],
        // Rounding of even images leaves a variance of 1e-14.
        correlation: (variances > 1e-20).then(|| covariance / variances.sqrt()),
        l1: of(|[a, b]| (a - b).abs()),
        rms: of(|[a, b]| (a - b).powi(2)).sqrt(),
        worst: worst(&a, &b),
    };
    Ok((comparison, [a, b]))
}

/// The smaller width and height of two images of one shape.
fn common_size(map: &RgbImage, target: &RgbImage) -> Result<[u32; 2]> {
    let [a, b] = [map, target].map(|image| [image.width, image.height].map(f64::from));
    // Half a pixel of the shortest side: pictures of other resolutions are rounded to whole pixels. Tiny images have to fit better.
    let shape = |[width, height]: [f64; 2]| width / height;
    let tolerance = (0.5 / a[0].min(a[1]).min(b[0]).min(b[1])).min(0.02);
    if (shape(a) / shape(b) - 1.0).abs() > tolerance {
        return Err(Error::Usage {
            reason: format!(
                "the map has {} x {} texels and the target {} x {} pixels: they are not of one shape",
                map.width, map.height, target.width, target.height
            ),
            remedy: "crop the target to the receiver, or give the receiver the target's shape"
                .into(),
        });
    }
    Ok([map.width.min(target.width), map.height.min(target.height)])
}

/// The image in fewer pixels, each the mean over what it covers.
fn averaged(image: &RgbImage, [width, height]: [u32; 2]) -> RgbImage {
    if [image.width, image.height] == [width, height] {
        return image.clone();
    }
    let columns: Vec<_> = (0..width).map(|i| covered(i, width, image.width)).collect();
    let mut pixels = Vec::with_capacity(width as usize * height as usize);
    for row in 0..height {
        let rows = covered(row, height, image.height);
        for columns in &columns {
            let mut sum = [0.0; 3];
            for (row, of_row) in &rows {
                for (column, of_column) in columns {
                    let pixel =
                        image.pixels[*row as usize * image.width as usize + *column as usize];
                    (0..3).for_each(|c| sum[c] += of_row * of_column * f64::from(pixel[c]));
                }
            }
            pixels.push(sum.map(|value| value as f32));
        }
    }
    RgbImage {
        width,
        height,
        pixels,
    }
}

fn mean(image: &RgbImage) -> f64 {
    let values = image.pixels.as_flattened();
    values.iter().map(|value| f64::from(*value)).sum::<f64>() / values.len() as f64
}

fn scaled(image: RgbImage, mean: f64) -> RgbImage {
    let value = |value: f32| (f64::from(value) / mean) as f32;
    RgbImage {
        pixels: image.pixels.iter().map(|rgb| rgb.map(value)).collect(),
        ..image
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(width: u32, values: &[f32]) -> RgbImage {
        RgbImage {
            width,
            height: values.len() as u32 / width,
            pixels: values.iter().map(|&value| [value; 3]).collect(),
        }
    }

    #[test]
    fn only_the_distribution_counts() {
        let target = image(2, &[0.0, 0.1, 0.2, 0.5]);
        let map = image(2, &[0.0, 3.0, 6.0, 15.0]);
        let (same, [a, b]) = compare_with_target(&map, &target).unwrap();
        assert!((same.correlation.unwrap() - 1.0).abs() < 1e-6);
        assert!(same.l1 < 1e-6 && same.rms < 1e-6, "{same:?}");
        assert!((same.scale - 30.0).abs() < 1e-5, "{}", same.scale);
        assert!((mean(&a) - 1.0).abs() < 1e-6 && (mean(&b) - 1.0).abs() < 1e-6);
    }

    #[test]
    fn numbers_worked_out_by_hand() {
        // Of the mean 1: [0, 2] and [0.5, 1.5].
        let (found, _) =
            compare_with_target(&image(2, &[0.0, 4.0]), &image(2, &[1.0, 3.0])).unwrap();
        assert_eq!((found.l1, found.rms), (0.5, 0.5));
        assert_eq!(found.correlation, Some(1.0));
        let (turned, _) =
            compare_with_target(&image(2, &[4.0, 0.0]), &image(2, &[1.0, 3.0])).unwrap();
        assert_eq!(turned.correlation, Some(-1.0));
        assert_eq!(turned.l1, 1.5);
        let (even, _) =
            compare_with_target(&image(2, &[1.0, 1.0]), &image(2, &[1.0, 3.0])).unwrap();
        assert_eq!(even.correlation, None);
    }

    #[test]
    fn the_finer_image_is_averaged() {
        let fine = image(
            4,
            &[
                1.0, 3.0, 0.0, 4.0, 1.0, 3.0, 0.0, 4.0, 5.0, 5.0, 7.0, 9.0, 5.0, 5.0, 7.0, 9.0,
            ],
        );
        let coarse = image(2, &[2.0, 2.0, 5.0, 8.0]);
        for (map, target) in [(&fine, &coarse), (&coarse, &fine)] {
            let (found, _) = compare_with_target(map, target).unwrap();
            assert_eq!((found.size, found.l1), ([2, 2], 0.0));
        }
        // Three pixels to two: one and a half each.
        let (found, [a, _]) = compare_with_target(
            &image(3, &[1.0, 2.0, 3.0, 1.0, 2.0, 3.0, 1.0, 2.0, 3.0]),
            &coarse,
        )
        .unwrap();
        assert_eq!(found.size, [2, 2]);
        assert!(
            (a.pixels[0][0] / a.pixels[1][0] - 4.0 / 8.0).abs() < 1e-6,
            "{:?}",
            a.pixels
        );
    }

    #[test]
    fn other_shapes_and_black_images_are_refused() {
        let square = image(2, &[1.0; 4]);
        let refuse = |map: &RgbImage, target: &RgbImage| {
            compare_with_target(map, target).unwrap_err().to_string()
        };
        let wide = refuse(&square, &image(4, &[1.0; 8]));
        assert!(
            wide.contains("2 x 2 texels and the target 4 x 2 pixels"),
            "{wide}"
        );
        let black = refuse(&square, &image(2, &[0.0; 4]));
        assert!(black.contains("the target holds no light"), "{black}");
        let black = refuse(&image(2, &[0.0; 4]), &square);
        assert!(black.contains("the map holds no light"), "{black}");
        // 301 × 200 is 150 × 100 as well as it can be.
        let rounded = [image(301, &[1.0; 60_200]), image(150, &[1.0; 15_000])];
        assert!(compare_with_target(&rounded[0], &rounded[1]).is_ok());
    }
}
