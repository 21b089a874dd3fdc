//! Light from everywhere by footprints: against the reference, a sun, and itself.

use crate::common::{
    Device, assert_error, flux, footprint, l1, load, only_receiver, options, rect, scaled, solve,
    toward_sun,
};
use glam::DVec3;
use nephroid::render::Settings;
use nephroid::scene::{Dielectric, EnvironmentMap, LightKind, MaterialKind, Scene};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

fn under(mut scene: Scene, light: LightKind) -> Scene {
    scene.lights.truncate(1);
    scene.lights[0].kind = light;
    scene
}

fn ring() -> Scene {
    only_receiver(load("ring.toml"), "floor", [64, 64])
}

/// A disc of the irradiance 1 W/m², elsewhere nothing.
fn disc(toward: DVec3, radius: f64) -> LightKind {
    let (width, height) = (2048, 1024);
    let mut radiance = Vec::new();
    let mut sum = 0.0;
    for i in 0..width * height {
        let azimuth = (f64::from(i % width) + 0.5) * TAU / f64::from(width);
        let (sine, cosine) = ((f64::from(i / width) + 0.5) * PI / f64::from(height)).sin_cos();
        let s = DVec3::new(sine * azimuth.sin(), cosine, -sine * azimuth.cos());
        let inside = f64::from(s.dot(toward) > radius.cos());
        sum += inside * sine * TAU * PI / f64::from(width * height);
        radiance.push([inside as f32; 3]);
    }
    for rgb in &mut radiance {
        *rgb = rgb.map(|c| c / sum as f32);
    }
    LightKind::Environment {
        map: Arc::new(EnvironmentMap {
            width,
            height,
            radiance,
        }),
        scale: 1.0,
        rotation: 0.0,
        casts_caustics: true,
    }
}

/// Two windows.
#[test]
fn windows_on_the_ring() {
    let scene = under(ring(), load("table.toml").lights[0].kind.clone());
    let truth = crate::common::truth(&scene, "floor", [64, 64], &options(0.02)).image();
    let device = Device::open();
    let [coarse, fine] =
        [4096, 65_536].map(|samples| device.caustic(&scene, "floor", &footprint(samples)));
    let bright = l1(&scaled(&fine, 1.07), &truth);
    let [coarse, fine] = [coarse, fine].map(|map| l1(&map, &truth));
    println!("4096 samples: {coarse}");
    assert!(fine < 0.7 * coarse, "{fine} {coarse}");
    assert_error("two windows", 0.05, fine, bright);
}

/// Many images of few samples are few of many, and the number of environment cells counts.
#[test]
fn images_and_cells_are_settings() {
    let scene = under(ring(), load("table.toml").lights[0].kind.clone());
    let device = Device::open();
    let map = |samples, environment_images, environment_cells| {
        let settings = Settings {
            environment_images,
            environment_cells,
            ..footprint(samples)
        };
        device.caustic(&scene, "floor", &settings)
    };
    let usual = map(4096, 4, 4096);
    assert!(usual.pixels == map(1024, 16, 4096).pixels);
    assert!(usual.pixels == map(4096, 4, 1024).pixels);
    let truth = crate::common::truth(&scene, "floor", [64, 64], &options(0.02)).image();
    let [usual, more, few] =
        [usual, map(4096, 16, 4096), map(4096, 4, 8)].map(|map| l1(&map, &truth));
    println!("L1 {usual}, with more images {more}, with 8 cells {few}");
    assert!(more < 0.9 * usual && few > 1.5 * usual);
}

/// A disc of the sky is a sun.
#[test]
fn a_sun_of_the_sky_is_a_sun() {
    let radius = 2f64.to_radians();
    let mut sun = ring();
    let toward = toward_sun(&sun);
    sun.lights[0].kind = LightKind::Sun {
        direction: toward,
        irradiance: DVec3::ONE,
        angular_radius: radius,
    };
    let device = Device::open();
    let truth = device.caustic(&sun, "floor", &footprint(65_536));
    let map = |toward: DVec3| {
        let sky = under(ring(), disc(toward.normalize(), radius));
        device.caustic(&sky, "floor", &footprint(65_536))
    };
    assert_error(
        "sun in a black sky",
        0.05,
        l1(&map(toward), &truth),
        l1(&map(toward + DVec3::new(0.05, 0.0, 0.0)), &truth),
    );
}

/// Water lets the sky through: flat water transmits to a large floor below it all that it does not reflect.
#[test]
fn glass_lets_the_sky_through() {
    let mut scene = only_receiver(load("ball.toml"), "floor", [32, 32]);
    scene.materials[0].kind = MaterialKind::Dielectric(Dielectric::new(1.33));
    let truth = solve(&scene, "floor", [32, 32], &options(0.02));
    let device = Device::open();
    let floor = rect(&scene, "floor");
    let share = |scene: &Scene| {
        let found = flux(&device.caustic(scene, "floor", &footprint(16_384)), &floor)[0];
        found / flux(&truth.image(), &floor)[0]
    };
    let found = share(&scene);
    println!("share of the reference's light: {found}");
    assert!((found - 1.0).abs() < 0.05, "{found}");
    scene.materials[0].kind = MaterialKind::Dielectric(Dielectric::new(1.8));
    assert!((share(&scene) - 1.0).abs() > 0.05);
}
