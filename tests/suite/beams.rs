//! The method beams against closed forms: flat mirror, paraboloid, and the widespread product of
//! lengths in place of the area.

use crate::common::closed_forms::dish_irradiance;
use crate::common::{
    Device, assert_error, assert_physical, brighter, flux, load, method, middles, object_mut,
    ratio_error, rect, texel_mean, toward_sun,
};
use glam::DVec3;
use nephroid::image_file::RgbImage;
use nephroid::render::{Area, Method, Settings};
use nephroid::scene::{Geometry, LightKind, MaterialKind, Scene};
use std::f64::consts::PI;

fn beams(samples: u32) -> Settings {
    method(Method::Beams, samples)
}

fn product(samples: u32) -> Settings {
    Settings {
        area: Area::Product,
        ..beams(samples)
    }
}

fn caustic(device: &Device, scene: &Scene, receiver: &str, settings: &Settings) -> RgbImage {
    let map = device.caustic(scene, receiver, settings);
    assert_physical(&map);
    map
}

const COPPER: [f64; 3] = [0.9, 0.8, 0.7];

/// The mirror's outline, shifted along the reflected light, has no soft edge: beams know no disc
/// of the sun. Errors, relative to what light from straight ahead of the floor would give, of the
/// worst texel more than `margin` inside or outside of the outline, and of the flux.
fn errors_of_image(scene: &Scene, map: &RgbImage) -> [f64; 2] {
    let s = toward_sun(scene);
    // A texel is 6.25 mm wide, 8.9 mm at most from corner to corner, 12 mm carried to the mirror.
    let margin = 0.012;
    let exact = COPPER.map(|reflectance| reflectance * s.y);
    let (mut worst, mut inside, mut outside) = (0.0, 0, 0);
    for (p, rgb) in middles(scene, "floor", [256, 256]).iter().zip(&map.pixels) {
        // Back along the reflected light to the mirror in the plane z = 0.
        let (x, y) = (p.x + p.z * s.x / s.z, p.z * s.y / s.z);
        let beyond = (x.abs() - 0.4).max((y - 0.5).abs() - 0.3);
        if beyond < -margin {
            worst = ratio_error(rgb.map(f64::from), exact).max(worst);
            inside += 1;
        } else if beyond > margin {
            worst = rgb
                .map(|v| f64::from(v) / s.y)
                .into_iter()
                .fold(worst, f64::max);
            outside += 1;
        }
    }
    assert!(inside > 7000 && outside > 20_000, "{inside} {outside}");
    let exact = COPPER.map(|reflectance| reflectance * s.z * 0.8 * 0.6);
    [worst, ratio_error(flux(map, &rect(scene, "floor")), exact)]
}

/// Of two triangles, and of many.
#[test]
fn flat_mirror_casts_its_exact_image() {
    let device = Device::open();
    let scene = load("mirror.toml");
    let mut tinted = scene.clone();
    if let MaterialKind::Mirror { reflectance } = &mut tinted.materials[0].kind {
        reflectance.y *= 1.001;
    }
    let mut shifted = scene.clone();
    if let Geometry::Rect(mirror) = &mut object_mut(&mut shifted, "mirror").geometry {
        mirror.origin.x += 0.03;
    }
    for samples in [1, 16_384] {
        let errors =
            |scene| errors_of_image(scene, &caustic(&device, scene, "floor", &beams(samples)));
        let [worst, energy] = errors(&scene);
        let [tinted_worst, tinted_energy] = errors(&tinted);
        let [shifted_worst, _] = errors(&shifted);
        println!("{samples} samples");
        assert_error("mirror, worst texel", 2e-4, worst, tinted_worst);
        assert_error("mirror, worst texel, shifted", 2e-4, worst, shifted_worst);
        assert_error("mirror, energy", 2e-4, energy, tinted_energy);
    }
}

/// The mirror sees the floor's texels through x = X + Z s_x/s_z, y = Z s_y/s_z. The derivatives
/// (1, 0) and (s_x, s_y)/s_z span the area s_y/s_z, the product of their lengths is
/// √(s_x² + s_y²)/s_z. So the product is wrong where the light comes from the side.
#[test]
fn product_of_lengths_is_too_bright_under_shear() {
    let device = Device::open();
    let error = |scene: &Scene, factor: f64, settings: &Settings| {
        let mut map = caustic(&device, scene, "floor", settings);
        (map.pixels.iter_mut()).for_each(|rgb| *rgb = rgb.map(|v| (f64::from(v) / factor) as f32));
        errors_of_image(scene, &map)[0]
    };
    let sheared = load("mirror.toml");
    let mut straight = sheared.clone();
    if let LightKind::Sun { direction, .. } = &mut straight.lights[0].kind {
        *direction = DVec3::new(0.0, 0.8, 0.6);
    }
    let factor = 0.3_f64.hypot(0.8) / 0.8;
    for samples in [1, 16_384] {
        assert_error(
            "mirror, product over area, off the closed form",
            2e-4,
            error(&sheared, factor, &product(samples)),
            error(&sheared, factor, &beams(samples)),
        );
        assert_error(
            "mirror, product without shear",
            2e-4,
            error(&straight, 1.0, &product(samples)),
            error(&sheared, 1.0, &product(samples)),
        );
    }
}

/// Design, section 9 (c), texel averages over the whole screen with the edge of its disc.
#[test]
fn dish_lights_a_screen_before_its_focus() {
    let device = Device::open();
    let scene = load("dish.toml");
    let truth: Vec<f64> = (middles(&scene, "screen", [256, 256]).iter())
        .map(|p| texel_mean(*p, 0.6 / 256.0, |r| dish_irradiance(1.0, 0.5, 0.5, r)))
        .collect();
    let error = |scene: &Scene, settings: &Settings| {
        let map = caustic(&device, scene, "screen", settings);
        let difference = |(rgb, truth): (&[f32; 3], &f64)| (f64::from(rgb[0]) - truth).abs();
        let sum: f64 = map.pixels.iter().zip(&truth).map(difference).sum();
        sum / truth.iter().sum::<f64>()
    };
    let mut lower = scene.clone();
    if let Geometry::Rect(screen) = &mut object_mut(&mut lower, "screen").geometry {
        screen.origin.y = 0.49;
    }
    let found = error(&scene, &beams(16_384));
    for perturbed in [brighter(scene.clone(), 1.02), lower] {
        let perturbed = error(&perturbed, &beams(16_384));
        assert_error("dish, L1", 0.01, found, perturbed);
    }
}

/// All triangles shrink to less than a texel, most to nothing, and none is lost: π (D/2)² E₀.
#[test]
fn dish_in_its_focus_keeps_the_energy() {
    let device = Device::open();
    let mut scene = load("dish.toml");
    if let Geometry::Rect(screen) = &mut object_mut(&mut scene, "screen").geometry {
        screen.origin.y = 1.0;
    }
    let screen = rect(&scene, "screen");
    let energy = |scene: &Scene| {
        let map = caustic(&device, scene, "screen", &beams(16_384));
        ratio_error(flux(&map, &screen), [PI * 0.25; 3])
    };
    let perturbed = energy(&brighter(scene.clone(), 1.005));
    assert_error(
        "dish at its focus, energy",
        0.002,
        energy(&scene),
        perturbed,
    );
}
