//! The renderer against closed forms: paraboloid, flat mirror, ball.

mod common;

use common::{
    Device, assert_error, assert_physical, brighter, dish_irradiance, flux, footprint, load,
    method, middles, ratio_error, rect, texel_mean, toward_sun,
};
use glam::DVec3;
use nephroid::image_file::RgbImage;
use nephroid::render::{Method, Settings};
use nephroid::scene::{Geometry, MaterialKind, Scene};
use std::f64::consts::PI;

/// Σ|E − truth| / Σ truth in red.
fn error_of(map: &RgbImage, truth: &[f64]) -> f64 {
    let difference = |(rgb, truth): (&[f32; 3], &f64)| (f64::from(rgb[0]) - truth).abs();
    let sum: f64 = map.pixels.iter().zip(truth).map(difference).sum();
    sum / truth.iter().sum::<f64>()
}

/// Design, section 9 (c), texel averages over the whole screen with the edge of its disc.
#[test]
fn dish_lights_a_screen_before_its_focus() {
    let device = Device::open();
    let scene = load("dish.toml");
    let truth: Vec<f64> = (middles(&scene, "screen", [256, 256]).iter())
        .map(|p| texel_mean(*p, 0.6 / 256.0, |r| dish_irradiance(1.0, 0.5, 0.5, r)))
        .collect();
    let error = |scene: &Scene| {
        let map = device.caustic(scene, "screen", &footprint(16_384));
        assert_physical(&map);
        error_of(&map, &truth)
    };
    let mut lower = scene.clone();
    if let Geometry::Rect(screen) = &mut common::object_mut(&mut lower, "screen").geometry {
        screen.origin.y = 0.49;
    }
    for perturbed in [brighter(scene.clone(), 1.05), lower] {
        assert_error("dish, L1", 0.02, error(&scene), error(&perturbed));
    }
}

/// All the light of the dish within a few texels: π (D/2)² E₀.
#[test]
fn dish_in_its_focus_stays_finite_and_keeps_the_energy() {
    let device = Device::open();
    let mut scene = load("dish.toml");
    if let Geometry::Rect(screen) = &mut common::object_mut(&mut scene, "screen").geometry {
        screen.origin.y = 1.0;
    }
    let exact = [PI * 0.25; 3];
    let screen = rect(&scene, "screen");
    let energy = |scene: &Scene| {
        let map = device.caustic(scene, "screen", &footprint(16_384));
        assert_physical(&map);
        ratio_error(flux(&map, &screen), exact)
    };
    let perturbed = energy(&brighter(scene.clone(), 1.05));
    assert_error("dish at its focus, energy", 0.01, energy(&scene), perturbed);
}

const COPPER: [f64; 3] = [0.9, 0.8, 0.7];

/// Design, section 9 (d), the mirror's outline, shifted along the reflected light: error of the
/// worst texel inside, and of the flux.
fn errors_of_image(device: &Device, scene: &Scene, samples: u32) -> [f64; 2] {
    let map = device.caustic(scene, "floor", &footprint(samples));
    assert_physical(&map);
    let s = toward_sun(scene);
    // Where the sun's disc (8 mm at most), a texel (6 mm) and the kernel's reach over a patch
    // (0.8 m / 91, blurred by 4 of its deviations) leave the light even.
    let margin = 0.04;
    let exact = COPPER.map(|reflectance| reflectance * s.y);
    let (mut worst, mut inside) = (0.0, 0);
    for (p, rgb) in middles(scene, "floor", [256, 256]).iter().zip(&map.pixels) {
        // Back along the reflected light to the mirror in the plane z = 0.
        let (x, y) = (p.x + p.z * s.x / s.z, p.z * s.y / s.z);
        if x.abs() < 0.4 - margin && (y - 0.5).abs() < 0.3 - margin {
            worst = ratio_error(rgb.map(f64::from), exact).max(worst);
            inside += 1;
        }
    }
    assert!(inside > 5000, "{inside}");
    let exact = COPPER.map(|reflectance| reflectance * s.z * 0.8 * 0.6);
    [worst, ratio_error(flux(&map, &rect(scene, "floor")), exact)]
}

/// At the default sampling and a finer one.
#[test]
fn flat_mirror_casts_its_exact_image() {
    let device = Device::open();
    let scene = load("mirror.toml");
    let mut tinted = scene.clone();
    if let MaterialKind::Mirror { reflectance } = &mut tinted.materials[0].kind {
        reflectance.y *= 1.002;
    }
    for samples in [16_384, 262_144] {
        let [worst, energy] = errors_of_image(&device, &scene, samples);
        let [perturbed_worst, perturbed_energy] = errors_of_image(&device, &tinted, samples);
        assert_error("mirror, worst texel", 0.001, worst, perturbed_worst);
        assert_error("mirror, energy", 0.001, energy, perturbed_energy);
        let [shifted, _] = errors_of_image(&device, &shifted_by_far(scene.clone()), samples);
        assert_error("mirror, worst texel, shifted", 0.001, worst, shifted);
    }
}

/// The image moved by more than the margin that the test leaves at its edge.
fn shifted_by_far(mut scene: Scene) -> Scene {
    if let Geometry::Rect(mirror) = &mut common::object_mut(&mut scene, "mirror").geometry {
        mirror.origin.x += 0.08;
    }
    scene
}

/// Design, section 9 (e), over the map, and over rings around the ball.
#[test]
fn ball_in_constant_radiance_by_pinhole() {
    let device = Device::open();
    let scene = load("ball.toml");
    let places = middles(&scene, "floor", [64, 64]);
    let exact = |r: f64| PI * 0.25 / (1.0 + r * r).powf(1.5);
    let truth: Vec<f64> = (places.iter())
        .map(|p| texel_mean(*p, 4.0 / 64.0, exact))
        .collect();
    let settings = Settings {
        epsilon: 0.0,
        // One patch a triangle: 5120.
        ..method(Method::Pinhole, 1)
    };
    let errors = |scene: &Scene| {
        let map = device.caustic(scene, "floor", &settings);
        assert_physical(&map);
        let (mut found, mut exact) = ([0.0; 6], [0.0; 6]);
        for ((rgb, truth), p) in map.pixels.iter().zip(&truth).zip(&places) {
            let ring = (p.x.hypot(p.z) / 0.4) as usize;
            if ring < 6 {
                found[ring] += f64::from(rgb[0]);
                exact[ring] += truth;
            }
        }
        let worst = (found.iter().zip(&exact))
            .map(|(f, e)| (f / e - 1.0).abs())
            .fold(0.0, f64::max);
        [error_of(&map, &truth), worst]
    };
    let [whole, rings] = errors(&scene);
    let [whole_twin, rings_twin] = errors(&brighter(scene.clone(), 1.02));
    assert_error("ball, pinhole, L1", 0.01, whole, whole_twin);
    assert_error("ball, pinhole, worst ring", 0.01, rings, rings_twin);
    let mut higher = scene;
    if let Geometry::Mesh(ball) = &mut common::object_mut(&mut higher, "ball").geometry {
        ball.positions
            .iter_mut()
            .for_each(|p| *p += 0.02 * DVec3::Y);
    }
    let [moved, _] = errors(&higher);
    assert_error("ball, pinhole, L1, ball higher", 0.01, whole, moved);
}

/// d² + ε instead of d² takes light away, the more the larger ε is.
#[test]
fn epsilon_lowers_the_energy() {
    let device = Device::open();
    let scene = common::only_receiver(load("ball.toml"), "floor", [32, 32]);
    let floor = rect(&scene, "floor");
    let energy = |epsilon| {
        let settings = Settings {
            epsilon,
            ..method(Method::Pinhole, 1)
        };
        flux(&device.caustic(&scene, "floor", &settings), &floor)[0]
    };
    let [none, one, many] = [0.0, 1.0, 100.0].map(energy);
    println!("energy with epsilon 0, 1, 100: {none} {one} {many}");
    assert!(one < 0.9999 * none && one > 0.98 * none);
    assert!(many < 0.99 * one);
}
