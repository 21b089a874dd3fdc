//! Noise that repeats, and smooth steps.

use glam::DVec2;
use std::f64::consts::TAU;
use std::sync::LazyLock;

static GRADIENTS: LazyLock<[DVec2; 32]> =
    LazyLock::new(|| std::array::from_fn(|i| DVec2::from_angle(TAU * i as f64 / 32.0)));

/// Uniform in [0, 1).
pub fn hash(number: i64, salt: i64) -> f64 {
    // The finaliser of SplitMix64 (Steele, Lea, Flood 2014).
    let mut z = (number as u64)
        .wrapping_mul(0x9e37_79b9_7f4a_7c15)
        .wrapping_add((salt as u64).wrapping_mul(0xd1b5_4a32_d192_ed03));
    z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
    (((z ^ (z >> 31)) >> 11) as f64) / (1u64 << 53) as f64
}

/// Gradient noise (Perlin, *Improving noise*, 2002) about −1 to 1, which repeats after `period` in each direction.
pub fn noise(place: DVec2, period: [i64; 2], seed: i64) -> f64 {
    let cell = place.floor();
    let within = place - cell;
    let gradients = &*GRADIENTS;
    let corner = |dx: i64, dy: i64| {
        let x = (cell.x as i64 + dx).rem_euclid(period[0]);
        let y = (cell.y as i64 + dy).rem_euclid(period[1]);
        let gradient = gradients[(32.0 * hash(x + 65_536 * y, seed)) as usize];
        gradient.dot(within - DVec2::new(dx as f64, dy as f64))
    };
    let fade = within * within * within * (within * (within * 6.0 - 15.0) + 10.0);
    let mix = |a: f64, b: f64, share: f64| a + share * (b - a);
    let lower = mix(corner(0, 0), corner(1, 0), fade.x);
    let upper = mix(corner(0, 1), corner(1, 1), fade.x);
    1.5 * mix(lower, upper, fade.y)
}

/// A sum of octaves of noise, about −1 to 1.
pub fn turbulence(place: DVec2, period: [i64; 2], octaves: u32, seed: i64) -> f64 {
    (0..octaves)
        .map(|octave| {
            let scale = f64::from(1u32 << octave);
            let period = period.map(|side| side << octave);
            noise(scale * place, period, seed + i64::from(octave)) / scale
        })
        .sum::<f64>()
        / 1.5
}

/// 0 below `low`, 1 above `high`, a cubic between.
pub fn smooth(low: f64, high: f64, x: f64) -> f64 {
    let t = ((x - low) / (high - low)).clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}
