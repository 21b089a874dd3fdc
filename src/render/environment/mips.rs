//! The mip levels of an environment: averages over solid angle.

use crate::scene::EnvironmentMap;
use glam::UVec2;

/// The environment and its mip levels, averages over solid angle, down to one texel.
pub fn mip_chain(map: &EnvironmentMap, scale: f32) -> Vec<(u32, u32, Vec<[f32; 3]>)> {
    let scaled: Vec<_> = map
        .radiance
        .iter()
        .map(|rgb| rgb.map(|x| x * scale))
        .collect();
    let mut levels = vec![(map.width, map.height, scaled)];
    while let Some((width, height, pixels)) = levels.last()
        && UVec2::new(*width, *height).max_element() > 1
    {
        let half = halve(*width, *height, pixels);
        levels.push(half);
    }
    levels
}

fn halve(width: u32, height: u32, pixels: &[[f32; 3]]) -> (u32, u32, Vec<[f32; 3]>) {
    let (w, h) = ((width / 2).max(1), (height / 2).max(1));
    // Solid angle of a texel of row y, up to a constant factor.
    let weight = |y: u32| {
        let edge = |row: u32| (f64::from(row) / f64::from(height) * std::f64::consts::PI).cos();
        edge(y) - edge(y + 1)
    };
    let mut half = Vec::with_capacity((w * h) as usize);
    for y in 0..h {
        for x in 0..w {
            let mut sum = [0.0; 3];
            let mut weights = 0.0;
            for row in y * height / h..(y + 1) * height / h {
                for column in x * width / w..(x + 1) * width / w {
                    let pixel = pixels[(row * width + column) as usize];
                    (0..3).for_each(|c| sum[c] += weight(row) * f64::from(pixel[c]));
                    weights += weight(row);
                }
            }
            half.push(sum.map(|s| (s / weights) as f32));
        }
    }
    (w, h, half)
}
