//! A caustic that runs over the edge between two light maps does not show it.

use crate::common::{
    Device, assert_error, assert_physical, footprint, load, options, scaled, solve,
};
use nephroid::image_file::RgbImage;

/// Half the texels of the scene file; on both maps they meet in the edge and are 5 mm wide.
const FLOOR: [u32; 2] = [110, 440];
const WALL: [u32; 2] = [440, 50];

/// Σ|A − B| and ΣB over the texels of lines `from..to` away from the edge: columns of the floor
/// (the wall stands at its column 0), rows of the wall from the bottom.
fn errors(maps: &[RgbImage; 2], truth: &[RgbImage; 2], from: u32, to: u32) -> f64 {
    let (mut difference, mut total) = (0.0, 0.0);
    let mut add = |map: usize, column: u32, row: u32| {
        let index = (row * maps[map].width + column) as usize;
        for c in 0..3 {
            let [a, b] = [&maps[map], &truth[map]].map(|m| f64::from(m.pixels[index][c]));
            difference += (a - b).abs();
            total += b;
        }
    };
    for line in from..to {
        (0..FLOOR[1]).for_each(|row| add(0, line, row));
        (0..WALL[0]).for_each(|column| add(1, column, WALL[1] - 1 - line));
    }
    difference / total
}

/// The error in the two lines of texels at the edge, over that in the ten lines behind them. A
/// seam, such as footprints that end at the edge of a map, makes the first larger; noise and blur
/// that are everywhere are in both.
fn seam(maps: &[RgbImage; 2], truth: &[RgbImage; 2]) -> f64 {
    let [at_edge, further] = [errors(maps, truth, 0, 2), errors(maps, truth, 2, 12)];
    println!("corner, L1 at the edge {at_edge:.5}, further in {further:.5}");
    at_edge / further
}

#[test]
fn corner_shows_no_seam() {
    let device = Device::open();
    let scene = crate::common::with_texels(load("corner.toml"), "floor", FLOOR);
    let scene = crate::common::with_texels(scene, "wall", WALL);
    let truth = [("floor", FLOOR), ("wall", WALL)]
        .map(|(name, texels)| solve(&scene, name, texels, &options(0.014)).image());
    let maps = device.caustics(&scene, &["floor", "wall"], &footprint(16_384));
    maps.iter().for_each(assert_physical);
    let maps: [RgbImage; 2] = maps.try_into().unwrap();

    // Twin: the edge's texels a tenth too dark.
    let mut dim = maps.clone();
    let mut darken = |map: usize, index: u32| {
        dim[map].pixels[index as usize] = dim[map].pixels[index as usize].map(|v| 0.9 * v);
    };
    (0..FLOOR[1]).for_each(|row| darken(0, row * FLOOR[0]));
    (0..WALL[0]).for_each(|column| darken(1, (WALL[1] - 1) * WALL[0] + column));
    let ratio = seam(&maps, &truth);
    assert_error("corner, error at the edge", 1.5, ratio, seam(&dim, &truth));

    let total = |maps: &[RgbImage; 2], factor: f64| -> f64 {
        // All texels are squares of 5 mm.
        factor
            * maps
                .iter()
                .flat_map(|m| &m.pixels)
                .map(|rgb| f64::from(rgb[0]))
                .sum::<f64>()
    };
    let energy = |factor| (total(&maps, factor) / total(&truth, 1.0) - 1.0).abs();
    assert_error("corner, energy over both", 0.01, energy(1.0), energy(1.03));
}

/// The cusp on the wall lies between two columns of texels. Parallelograms that stand for a texel and the sun's disc are wider than a
/// texel and overlap there: each of both columns had the whole light of what they share. Where texels are high, kernels stand for the
/// cusp: their values at the centres of texels missed 6 % of the light.
#[test]
fn cusp_between_two_columns_has_its_light_once() {
    let device = Device::open();
    let settings = nephroid::render::Settings {
        error: Some(0.02),
        ..footprint(16_384)
    };
    let sum = |map: &RgbImage| -> f64 {
        (map.pixels.as_flattened().iter())
            .map(|&v| f64::from(v))
            .sum()
    };
    for wall in [[128, 15], [128, 78]] {
        let scene = crate::common::only_receiver(load("corner.toml"), "wall", wall);
        let reference = solve(&scene, "wall", wall, &options(0.004));
        let exact = sum(&reference.image());
        let error = |map: &RgbImage| (sum(map) / exact - 1.0).abs();
        let map = device.caustic(&scene, "wall", &settings);
        assert_error(
            &format!("corner, energy of the wall, {wall:?} texels"),
            0.005,
            error(&map),
            error(&scaled(&map, 1.02)),
        );
        // Patches much narrower than a texel; kernels in their place left 4.8 % of the light in a column beside its own.
        let error = |map: &RgbImage| nephroid::measure::l1_without_noise(map, &reference).unwrap();
        let map = device.caustic(&scene, "wall", &footprint(65_536));
        assert_error(
            &format!("corner, L1 of the wall, {wall:?} texels"),
            0.01,
            error(&map),
            error(&scaled(&map, 1.02)),
        );
    }
}
