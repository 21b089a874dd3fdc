//! The size of a light map, as an argument.

use nephroid::scene::{MAX_LIGHT_MAP_SIDE, light_map_side};
use std::str::FromStr;

/// Size of a light map: `256`, its width with the height in the scene file's proportion, or
/// `256x128`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightMapSize {
    Width(u32),
    Both([u32; 2]),
}

impl FromStr for LightMapSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let side = |text: &str| {
            let parsed = text.parse().map_err(|_| "a side is no whole number".into());
            parsed
                .and_then(light_map_side)
                .map_err(|reason: String| format!("{reason}; give the width, or WIDTHxHEIGHT"))
        };
        match text.split_once('x') {
            None => Ok(Self::Width(side(text)?)),
            Some((width, height)) => Ok(Self::Both([side(width)?, side(height)?])),
        }
    }
}

impl LightMapSize {
    /// Width and height, given those of the scene file.
    pub fn texels(self, [width, height]: [u32; 2]) -> [u32; 2] {
        match self {
            Self::Both(texels) => texels,
            Self::Width(wanted) => {
                let scaled = f64::from(wanted) * f64::from(height) / f64::from(width);
                [wanted, (scaled.round() as u32).clamp(1, MAX_LIGHT_MAP_SIDE)]
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_map_sizes() {
        let parse = str::parse::<LightMapSize>;
        assert_eq!(parse("64").unwrap().texels([256, 128]), [64, 32]);
        assert_eq!(parse("64x16").unwrap().texels([256, 128]), [64, 16]);
        assert_eq!(parse("1").unwrap().texels([4096, 1]), [1, 1]);
        for bad in [
            "", "0", "64x0", "100000", "-3", "3.5", "64x", "x64", "64x16x2", "nan",
        ] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }
}
