//! The sRGB transfer function (IEC 61966-2-1).

/// The nearest byte of a linear value, which is clamped to 0..=1.
pub fn encode(linear: f64) -> u8 {
    let x = linear.clamp(0.0, 1.0);
    let value = if x <= 0.003_130_8 {
        12.92 * x
    } else {
        1.055 * x.powf(1.0 / 2.4) - 0.055
    };
    (255.0 * value).round() as u8
}

/// The linear value of a byte, 0..=1.
pub fn decode(byte: u8) -> f64 {
    let value = f64::from(byte) / 255.0;
    if value <= 0.04045 {
        value / 12.92
    } else {
        ((value + 0.055) / 1.055).powf(2.4)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn encoding_inverts_decoding() {
        for byte in 0..=255u8 {
            assert_eq!(encode(decode(byte)), byte);
        }
    }
}
