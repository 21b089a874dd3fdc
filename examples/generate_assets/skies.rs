//! Environments that light scenes from all sides and stand behind them: a sky without its sun, and a room.

use super::equirectangular;
use super::noise::{smooth, turbulence};
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Every environment: path under `assets/`, content.
pub fn all() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("environments/sky.hdr", equirectangular(256, 4, sky)),
        ("environments/room.hdr", equirectangular(256, 4, room)),
    ]
}

/// Azimuth of the image's middle, where the sun is in the sky that it lights, and the lamp in the room.
const MIDDLE: f64 = PI;

/// Azimuth from the image's middle, −π to π.
fn from_middle(azimuth: f64) -> f64 {
    (azimuth - MIDDLE + PI).rem_euclid(TAU) - PI
}

/// A summer sky of about a fifth of the sun's light on level ground, where that is 1 W/m²: haze at the horizon, brighter toward the
/// sun in the image's middle, fair-weather clouds, and meadows below. The sun itself is a light of its own.
fn sky(azimuth: f64, elevation: f64) -> DVec3 {
    let height = elevation.sin();
    let off = from_middle(azimuth);
    // Cosine of the angle to a sun 35 degrees up.
    let sun = 35f64.to_radians();
    let cosine = elevation.cos() * off.cos() * sun.cos() + height * sun.sin();
    let zenith = DVec3::new(0.030, 0.066, 0.150);
    let horizon = DVec3::new(0.135, 0.165, 0.190);
    let haze = (1.0 - height.max(0.0)).powi(4);
    let glow = DVec3::new(0.22, 0.19, 0.14) * ((0.5 + 0.5 * cosine).powi(8));
    let mut colour = zenith.lerp(horizon, haze) + glow * (0.35 + 0.65 * haze);
    if height > 0.0 {
        // Clouds in a layer: nearer the horizon they are farther away and smaller.
        let out = DVec2::from_angle(azimuth) * elevation.cos() / (height + 0.18);
        let place = 1.6 * out + DVec2::splat(40.0);
        let cover = turbulence(place, [1024, 1024], 5, 71) + 0.10;
        let cloud = smooth(0.0, 0.45, cover) * smooth(0.02, 0.20, height);
        let bright = DVec3::new(0.27, 0.265, 0.26) * (0.75 + 0.5 * (0.5 + 0.5 * cosine).powi(3));
        let shade = smooth(0.25, 0.8, cover);
        colour = colour.lerp(bright * (1.0 - 0.45 * shade), 0.85 * cloud);
        return colour;
    }
    // Meadows, paler with distance, and a line of trees.
    let trees = 0.030 + 0.016 * turbulence(DVec2::new(24.0 * azimuth / TAU, 0.5), [24, 4], 4, 81);
    let near = DVec3::new(0.082, 0.090, 0.044)
        * (1.0
            + 0.15
                * turbulence(
                    DVec2::new(16.0 * azimuth / TAU, 6.0 * height),
                    [16, 64],
                    4,
                    83,
                ));
    let far = DVec3::new(0.105, 0.120, 0.092);
    let ground = near.lerp(far, (1.0 + height).powi(6));
    let wood = DVec3::new(0.040, 0.054, 0.036);
    ground.lerp(wood, 1.0 - smooth(0.6 * trees, 1.2 * trees, -height))
}

/// A room with warm walls, a white ceiling, a wooden floor and two wide windows, whose light is soft: mean radiance about 0.1.
fn room(azimuth: f64, elevation: f64) -> DVec3 {
    // A box around the viewer: half width and depth, height of the ceiling above and of the floor below, m.
    let direction = DVec3::new(
        elevation.cos() * azimuth.sin(),
        elevation.sin(),
        -elevation.cos() * azimuth.cos(),
    );
    let half = DVec3::new(2.6, 1.5, 2.2);
    let low = 1.1;
    let up = if direction.y > 0.0 { half.y } else { low };
    let reach = DVec3::new(half.x, up, half.z) / direction.abs().max(DVec3::splat(1e-9));
    let way = reach.min_element();
    let point = way * direction;
    // Nearer a corner, less light.
    let corner = |from: f64| 0.55 + 0.45 * smooth(0.0, 1.1, from);
    let gaps = DVec3::new(half.x, half.y, half.z) - point.abs();
    if way == reach.y {
        let shade = corner(gaps.x) * corner(gaps.z);
        let board = 0.9 + 0.1 * turbulence(DVec2::new(point.x, 6.0 * point.z), [64, 64], 3, 91);
        return match direction.y > 0.0 {
            true => DVec3::new(0.17, 0.165, 0.155) * shade,
            false => DVec3::new(0.060, 0.040, 0.026) * shade * board,
        };
    }
    let (across, is_window_wall) = match way == reach.x {
        true => (point.z, direction.x < 0.0),
        false => (point.x, false),
    };
    let shade = corner(if way == reach.x { gaps.z } else { gaps.x })
        * corner(half.y - point.y)
        * corner(point.y + low);
    let wall = DVec3::new(0.105, 0.092, 0.076) * shade;
    if !is_window_wall {
        return wall;
    }
    // Windows of two by three panes, with a bright sky behind that fades downward.
    let window = |middle: f64| {
        let at = DVec2::new((across - middle) / 0.62, (point.y - 0.25) / 0.85);
        let edge = 1.0 - at.abs().max_element();
        // Bars between the panes.
        let up = (1.5 * (at.y + 1.0)).fract();
        let bar = at.x.abs().min(up.min(1.0 - up));
        smooth(0.0, 0.03, edge) * smooth(0.03, 0.06, bar)
    };
    let open = window(-1.0) + window(1.0);
    let outside = DVec3::new(1.35, 1.55, 1.85) * (0.55 + 0.45 * smooth(-0.6, 1.1, point.y));
    wall.lerp(outside, open.min(1.0))
}
