//! Pictures beside the curves: what each method achieves in about equal time.

use crate::image_file::RgbImage;
use crate::tone_map::to_srgb;
use serde::{Deserialize, Serialize};

/// Light maps and their errors at about equal time.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Strip {
    /// Time that was aimed at, s.
    pub seconds: f64,
    /// Error at which the colours saturate, W/m²; see [`Picture::of_error`].
    pub error_scale: f64,
    pub thumbnails: Vec<Thumbnail>,
}

/// One method in a [`Strip`].
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Thumbnail {
    /// As [`super::Series::label`].
    pub label: String,
    /// Median wall time of one update, s.
    pub seconds: f64,
    /// L1 error, relative.
    pub l1: f64,
    /// Not part of the JSON.
    #[serde(skip)]
    pub light_map: Picture,
    /// Signed, in diverging colours. Not part of the JSON.
    #[serde(skip)]
    pub error: Picture,
}

/// Rows from the top of 8-bit sRGB values, three a pixel.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Picture {
    pub(super) width: u32,
    pub(super) height: u32,
    pub(super) rgb: Vec<u8>,
}

/// ColorBrewer's RdBu from blue to red, sRGB: the same lightness on both sides of white, and told
/// apart with any colour vision.
pub(super) const DIVERGING: [[u8; 3]; 5] = [
    [0x05, 0x30, 0x61],
    [0x43, 0x93, 0xc3],
    [0xf7, 0xf7, 0xf7],
    [0xd6, 0x60, 0x4d],
    [0x67, 0x00, 0x1f],
];

impl Picture {
    /// A light map as a display shows it, 2^−`exposure_ev` W/m² being white.
    pub fn of_light_map(map: &RgbImage, exposure_ev: f64) -> Self {
        Self {
            width: map.width,
            height: map.height,
            rgb: to_srgb(map, exposure_ev),
        }
    }

    /// A − B, averaged over the channels, from blue where A is darker by `scale` W/m² or more,
    /// over white, to red where it is brighter.
    ///
    /// # Panics
    /// If the sizes differ.
    pub fn of_error(a: &RgbImage, b: &RgbImage, scale: f64) -> Self {
        assert_eq!((a.width, a.height), (b.width, b.height), "one size");
        let rgb = (a.pixels.iter().zip(&b.pixels))
            .flat_map(|(a, b)| {
                let difference: f32 = (0..3).map(|c| a[c] - b[c]).sum::<f32>() / 3.0;
                diverging(f64::from(difference) / scale)
            })
            .collect();
        Self {
            width: a.width,
            height: a.height,
            rgb,
        }
    }
}

/// Colour of `x` from −1 to 1.
fn diverging(x: f64) -> [u8; 3] {
    let last = DIVERGING.len() - 1;
    let position = (x.clamp(-1.0, 1.0) + 1.0) / 2.0 * last as f64;
    let index = (position as usize).min(last - 1);
    let t = position - index as f64;
    std::array::from_fn(|c| {
        let [low, high] = [DIVERGING[index][c], DIVERGING[index + 1][c]].map(f64::from);
        (low + t * (high - low)).round() as u8
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn errors_have_a_sign() {
        let map = |value| RgbImage {
            width: 1,
            height: 1,
            pixels: vec![[value; 3]],
        };
        let colour = |a, b| Picture::of_error(&map(a), &map(b), 0.5).rgb;
        assert_eq!(colour(1.0, 1.0), DIVERGING[2]);
        assert_eq!(colour(1.5, 1.0), DIVERGING[4]);
        assert_eq!(colour(0.75, 1.0), DIVERGING[1]);
        assert_eq!(colour(0.0, 9.0), DIVERGING[0]);
    }
}
