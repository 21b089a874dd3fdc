//! Albedo maps that repeat without a seam: wood, tiles, marble and paper.

use super::noise::{hash, noise, smooth, turbulence};
use glam::{DVec2, DVec3};
use image::codecs::jpeg::JpegEncoder;
use image::{ExtendedColorType, ImageEncoder};
use nephroid::srgb::encode;

/// Every texture: path under `assets/`, content.
pub fn all() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("textures/wood.jpg", jpeg(1024, 80, wood)),
        ("textures/tiles.jpg", jpeg(512, 88, tiles)),
        ("textures/marble.jpg", jpeg(1024, 84, marble)),
        ("textures/paper.jpg", jpeg(512, 84, paper)),
    ]
}

/// Square image of linear colours by (u, v) in [0, 1)², v upward; pixels are averages over four points.
fn jpeg(side: u32, quality: u8, colour: impl Fn(DVec2) -> DVec3) -> Vec<u8> {
    let pixel = |i: u32| {
        let corner = DVec2::new(f64::from(i % side), f64::from(side - 1 - i / side));
        let points = [(0.25, 0.25), (0.75, 0.25), (0.25, 0.75), (0.75, 0.75)].map(DVec2::from);
        let sum: DVec3 = (points.iter())
            .map(|point| colour((corner + *point) / f64::from(side)))
            .sum();
        (sum / 4.0).to_array().map(encode)
    };
    let pixels: Vec<u8> = (0..side * side).flat_map(pixel).collect();
    let mut content = Vec::new();
    JpegEncoder::new_with_quality(&mut content, quality)
        .write_image(&pixels, side, side, ExtendedColorType::Rgb8)
        .expect("memory takes any image");
    content
}

/// Oiled planks along u, six across v, with joints that are not in line.
fn wood(uv: DVec2) -> DVec3 {
    const PLANKS: f64 = 6.0;
    let plank = (uv.y * PLANKS).floor();
    let across = uv.y * PLANKS - plank;
    let joint = hash(plank as i64, 1);
    // Each plank of two boards.
    let along = (uv.x - joint).rem_euclid(1.0) * 2.0;
    let board = along.floor();
    let along = along - board;
    let number = (2.0 * plank + board) as i64;
    let own = |salt| hash(number, salt);
    // Growth rings: a slanted cut through wavy cylinders. Coordinates repeat with u, and are the board's own across.
    let place = DVec2::new(uv.x, own(2) + across / PLANKS);
    let bend = 0.35 * noise(place * DVec2::new(3.0, 6.0), [3, 6], number)
        + 0.8 * (own(3) - 0.5) * (along - 0.5);
    let distance = (across - 0.2 - 0.6 * own(4) + bend).abs();
    let ring = 7.0 * distance + 0.6 * noise(place * DVec2::new(4.0, 24.0), [4, 24], number + 17);
    let late = (ring - ring.floor()).powi(3);
    // Fibres and pores: much longer than wide.
    let fibre = noise(uv * DVec2::new(8.0, 192.0), [8, 192], number + 31)
        + 0.6 * noise(uv * DVec2::new(24.0, 384.0), [24, 384], number + 47);
    let pores = smooth(0.55, 0.9, noise(uv * DVec2::new(40.0, 320.0), [40, 320], 5));
    let light = DVec3::new(0.60, 0.36, 0.17).lerp(DVec3::new(0.66, 0.42, 0.22), own(5));
    let dark = DVec3::new(0.34, 0.165, 0.065);
    let share = 0.55 * late * (1.0 - 0.5 * own(6)) + 0.16 * (fibre + 0.3) + 0.35 * pores;
    let tone = 0.82 + 0.36 * own(7);
    let colour = tone * light.lerp(dark, share.clamp(0.0, 1.0));
    // Gaps between planks and at joints: a quarter of the width of a plank is 1/24 of v.
    let edge = across.min(1.0 - across) / PLANKS;
    let end = along.min(1.0 - along) / 2.0;
    let open = smooth(0.0004, 0.0022, edge.min(end));
    colour * (0.12 + 0.88 * open)
}

/// Four by four glazed tiles with light joints.
fn tiles(uv: DVec2) -> DVec3 {
    const TILES: f64 = 4.0;
    let tile = (uv * TILES).floor();
    let within = uv * TILES - tile;
    let number = (tile.x + TILES * tile.y) as i64;
    let cloud = turbulence(uv * 8.0, [8, 8], 4, 3);
    let glaze = DVec3::new(0.42, 0.66, 0.70).lerp(DVec3::new(0.50, 0.74, 0.74), hash(number, 11));
    let glaze = glaze * (0.94 + 0.10 * hash(number, 12)) * (0.97 + 0.06 * cloud);
    let joint = DVec3::splat(0.62) * (0.92 + 0.12 * noise(uv * 96.0, [96, 96], 7));
    // Round corners.
    let from_edge = (within - 0.5).abs() - DVec2::splat(0.5 - 0.055);
    let distance = from_edge.max(DVec2::ZERO).length() - 0.030;
    let is_tile = 1.0 - smooth(-0.006, 0.006, distance);
    // The glaze is thinner at the edge of a tile.
    let rim = smooth(-0.05, 0.0, distance);
    joint.lerp(glaze * (1.0 - 0.12 * rim), is_tile)
}

/// White marble with grey veins that fold.
fn marble(uv: DVec2) -> DVec3 {
    let warp = DVec2::new(
        turbulence(uv * 4.0, [4, 4], 5, 21),
        turbulence(uv * 4.0, [4, 4], 5, 22),
    );
    let place = uv + 0.16 * warp;
    let vein = |scale: f64, seed| {
        let value = noise(place * scale, [scale as i64; 2], seed);
        1.0 - value.abs()
    };
    let broad = vein(3.0, 23).powi(9);
    let fine = vein(7.0, 24).powi(22);
    let cloud = 0.5 + 0.5 * turbulence(uv * 3.0, [3, 3], 5, 25);
    let white = DVec3::new(0.80, 0.79, 0.77);
    let grey = DVec3::new(0.36, 0.37, 0.39);
    let warm = DVec3::new(0.60, 0.54, 0.46);
    let stone = white.lerp(grey, (0.22 * cloud + 0.40 * broad).min(1.0));
    stone.lerp(warm, (0.45 * fine).min(1.0)) * (0.98 + 0.03 * noise(uv * 256.0, [256, 256], 26))
}

/// Handmade paper: a warm white with clouds and fibres.
fn paper(uv: DVec2) -> DVec3 {
    let cloud = turbulence(uv * 6.0, [6, 6], 5, 41);
    let grain = noise(uv * 128.0, [128, 128], 42) + 0.6 * noise(uv * 256.0, [256, 256], 43);
    let turn = DVec2::new(uv.x + 2.0 * uv.y, uv.y - 2.0 * uv.x);
    let fibre = |place: DVec2, seed| {
        let bent = place + 0.02 * DVec2::splat(turbulence(uv * 6.0, [6, 6], 2, seed));
        (1.0 - noise(bent * DVec2::new(6.0, 48.0), [6, 48], seed).abs()).powi(24)
    };
    let fibres = fibre(uv, 44) + fibre(turn, 45);
    DVec3::new(0.76, 0.735, 0.69) * (1.0 + 0.03 * cloud + 0.035 * grain - 0.05 * fibres)
}
