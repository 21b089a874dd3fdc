//! The ring's caustic against the reference: what the methods promise.

use crate::common::{
    Device, assert_error, assert_error_beyond_noise, assert_physical, footprint, l1, l1_noise,
    load, method, only_receiver, options, scaled, shifted_by_a_texel, truth, with_sun_of,
    with_texels,
};
use nephroid::image_file::RgbImage;
use nephroid::reference::Reference;
use nephroid::render::{Method, Settings};
use nephroid::scene::Scene;
use std::sync::{Arc, OnceLock};

const TEXELS: [u32; 2] = [128, 128];
/// A light far away.
struct Disc {
    /// Angular radius.
    degrees: f64,
    /// Expected L1 error of its reference.
    noise: f64,
}

const SUN: Disc = Disc {
    degrees: 0.2665,
    noise: 0.006,
};
/// As wide as a lamp. The bounds under it leave room for more noise, and its reference takes longer.
const LAMP: Disc = Disc {
    degrees: 2.5,
    noise: 0.008,
};

fn scene(light: &Disc) -> Scene {
    with_sun_of(
        with_texels(load("ring.toml"), "floor", TEXELS),
        light.degrees,
    )
}

fn solved(light: &Disc) -> Arc<Reference> {
    truth(&scene(light), "floor", TEXELS, &options(light.noise))
}

/// The reference, and the standard error of an L1 to it.
fn reference(light: &Disc) -> (RgbImage, f64) {
    let reference = solved(light);
    (reference.image(), l1_noise(&reference))
}

/// L1 of the footprints of about `samples` patches, seen to be worse where the light is 5 % too
/// bright and where the floor is off by a texel.
fn footprints_are_within(light: &Disc, samples: u32, bound: f64) {
    let device = Device::open();
    let scene = scene(light);
    let (truth, noise) = reference(light);
    let mut renderer = device.renderer(&scene, &footprint(samples));
    renderer.caustic().unwrap();
    let lit = renderer.lit_patches().unwrap().expect("one batch");
    // Three receivers share them.
    assert!(
        (samples / 4..=2 * samples).contains(&lit),
        "{lit} footprints"
    );
    let map = renderer
        .read_caustic(scene.object_index("floor").unwrap())
        .unwrap();
    assert_physical(&map);
    let shifted = shifted_by_a_texel(scene, "floor");
    let shifted = device.caustic(&shifted, "floor", &footprint(samples));
    for perturbed in [scaled(&map, 1.05), shifted] {
        let [error, perturbed] = [&map, &perturbed].map(|map| l1(map, &truth));
        let what = format!("ring, {}°, {lit} footprints, L1", light.degrees);
        assert_error_beyond_noise(&what, bound, noise, error, perturbed);
    }
}

#[test]
fn footprints_under_the_sun() {
    footprints_are_within(&SUN, 4096, 0.022);
    footprints_are_within(&SUN, 16_384, 0.0135);
    footprints_are_within(&SUN, 65_536, 0.0115);
}

#[test]
fn footprints_under_a_lamp() {
    footprints_are_within(&LAMP, 4096, 0.0265);
    footprints_are_within(&LAMP, 65_536, 0.0138);
}

/// The sun's blur, 0.53° on the way, is less than a texel here: beams do without it.
#[test]
fn beams_under_the_sun() {
    let device = Device::open();
    let scene = scene(&SUN);
    let (truth, noise) = reference(&SUN);
    let map = |scene: &Scene, samples| {
        let map = device.caustic(scene, "floor", &method(Method::Beams, samples));
        assert_physical(&map);
        map
    };
    for (samples, bound) in [(4096, 0.0163), (16_384, 0.0081), (65_536, 0.0073)] {
        let found = map(&scene, samples);
        let shifted = map(&shifted_by_a_texel(scene.clone(), "floor"), samples);
        for perturbed in [scaled(&found, 1.05), shifted] {
            let what = format!("ring, {samples} beams, L1");
            let [found, perturbed] = [&found, &perturbed].map(|map| l1(map, &truth));
            assert_error_beyond_noise(&what, bound, noise, found, perturbed);
        }
    }
}

fn points(samples: u32) -> &'static RgbImage {
    static COARSE: OnceLock<RgbImage> = OnceLock::new();
    static FINE: OnceLock<RgbImage> = OnceLock::new();
    let cell = if samples < 4_000_000 { &COARSE } else { &FINE };
    cell.get_or_init(|| {
        Device::open().caustic(&scene(&SUN), "floor", &method(Method::Points, samples))
    })
}

#[test]
fn points_converge() {
    let (truth, _) = reference(&SUN);
    let few = l1(points(250_000), &truth);
    let many = l1(points(4_000_000), &truth);
    let bright = l1(&scaled(points(4_000_000), 1.05), &truth);
    // Random points would be √16 = 4 times as good.
    assert_error(
        "ring, 16 times as many points, L1 over L1",
        0.25,
        many / few,
        bright / few,
    );
}

/// The paper's filter: without it each patch shows a sharp disc of the sun.
#[test]
fn pinhole_without_its_filter_is_noisier() {
    let device = Device::open();
    let scene = only_receiver(scene(&LAMP), "floor", [64, 64]);
    let truth = solved(&LAMP).coarser(2).image();
    let error = |filter| {
        let settings = Settings {
            filter,
            epsilon: 0.0,
            ..method(Method::Pinhole, 4096)
        };
        let map = device.caustic(&scene, "floor", &settings);
        assert_physical(&map);
        l1(&map, &truth)
    };
    let (with, without) = (error(true), error(false));
    assert_error("ring, pinhole, L1 with the filter", 0.2, with, without);
}
