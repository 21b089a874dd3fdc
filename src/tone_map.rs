//! Converts linear radiance to pixels on a display.
//!
//! The operator is the Khronos *PBR Neutral Tone Mapper* (specification 1.0, 2024): linear and
//! hue-preserving up to 0.8 less a small offset, above that compressed toward white.

use crate::image_file::RgbImage;
use crate::srgb::encode;
use rayon::prelude::*;

/// sRGB bytes of `image`, multiplied by 2^`exposure_ev`, 1 being the display's white.
pub fn to_srgb(image: &RgbImage, exposure_ev: f64) -> Vec<u8> {
    let factor = exposure_ev.exp2() as f32;
    (image.pixels.par_iter())
        .flat_map_iter(|pixel| neutral(pixel.map(|x| x * factor)).map(|x| encode(x.into())))
        .collect()
}

/// The tone mapper of the specification, symbols as there.
fn neutral(color: [f32; 3]) -> [f32; 3] {
    const F90: f32 = 0.04;
    const K_S: f32 = 0.8 - F90;
    const K_D: f32 = 0.15;
    let x = color.into_iter().fold(f32::INFINITY, f32::min);
    let offset = if x < 2.0 * F90 {
        x - x * x / (4.0 * F90)
    } else {
        F90
    };
    let color = color.map(|c| c - offset);
    let p = color.into_iter().fold(f32::NEG_INFINITY, f32::max);
    if p <= K_S {
        return color;
    }
    let p_n = 1.0 - (1.0 - K_S).powi(2) / (p + 1.0 - 2.0 * K_S);
    let g = 1.0 / (K_D * (p - p_n) + 1.0);
    color
        .map(|c| p_n * (1.0 - g) + c * p_n / p * g)
        .map(|c| c.min(1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn middle_grey_stays_and_light_becomes_white() {
        let image = |value| RgbImage {
            width: 1,
            height: 1,
            pixels: vec![[value; 3]],
        };
        assert_eq!(to_srgb(&image(0.0), 0.0), [0; 3]);
        // 0.22 less the offset 0.04 is 0.18, which sRGB encodes as 118.
        assert_eq!(to_srgb(&image(0.22), 0.0), [118; 3]);
        assert_eq!(to_srgb(&image(0.11), 1.0), [118; 3]);
        assert!(to_srgb(&image(1e30), 0.0).iter().all(|b| *b >= 254));
    }

    #[test]
    fn hue_is_kept_below_the_shoulder_and_fades_above() {
        let [r, g, b] = neutral([0.5, 0.25, 0.1]);
        assert!((r - g - 0.25).abs() < 1e-6 && (g - b - 0.15).abs() < 1e-6);
        let [r, g, b] = neutral([50.0, 25.0, 10.0]);
        assert!(r <= 1.0 && g > 0.8 && b > 0.8 && r >= g && g >= b);
    }
}
