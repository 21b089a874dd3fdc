//! Light that reaches the receivers without a mirror, against closed forms.

mod common;

use common::{Device, assert_error, brighter, load, middles, only_receiver, toward_sun};
use glam::DVec3;
use nephroid::image_file::RgbImage;
use nephroid::scene::{LightKind, MaterialKind, Scene};
use std::f64::consts::PI;

/// The scene without its mirrors.
fn without_mirrors(mut scene: Scene) -> Scene {
    let Scene {
        objects, materials, ..
    } = &mut scene;
    objects.retain(|object| {
        let kind = &materials[object.material].kind;
        matches!(kind, MaterialKind::Diffuse { .. })
    });
    scene
}

/// Largest |E/E* − 1| in red.
fn worst(map: &RgbImage, exact: f64) -> f64 {
    (map.pixels.iter())
        .map(|rgb| (f64::from(rgb[0]) / exact - 1.0).abs())
        .fold(0.0, f64::max)
}

#[test]
fn open_floor_under_a_sun() {
    let device = Device::open();
    let scene = without_mirrors(load("mirror.toml"));
    let exact = toward_sun(&scene).y;
    let error = |scene: &Scene| worst(&device.direct(scene, "floor"), exact);
    let perturbed = error(&brighter(scene.clone(), 1.002));
    assert_error("sun on a floor", 0.001, error(&scene), perturbed);
}

#[test]
fn open_floor_under_an_even_sky() {
    let device = Device::open();
    let scene = without_mirrors(load("ball.toml"));
    let error = |scene: &Scene| worst(&device.direct(scene, "floor"), PI);
    let perturbed = error(&brighter(scene.clone(), 1.01));
    assert_error("sky over a floor", 0.005, error(&scene), perturbed);
}

#[test]
fn several_suns_and_a_sky_add_up() {
    let device = Device::open();
    let mut scene = without_mirrors(load("ball.toml"));
    let sun = |direction: DVec3| {
        let mut light = load("mirror.toml").lights.remove(0);
        if let LightKind::Sun { direction: d, .. } = &mut light.kind {
            *d = direction.normalize();
        }
        light
    };
    let [one, two, below] = [[0.3, 0.8, 0.6], [-1.0, 0.5, 0.0], [0.0, -1.0, 0.3]];
    let lights = [one, two, below].map(|d| sun(DVec3::from(d)));
    scene.lights.extend(lights);
    let exact = PI + DVec3::from(one).normalize().y + DVec3::from(two).normalize().y;
    let error = worst(&device.direct(&scene, "floor"), exact);
    scene.lights.remove(2);
    let perturbed = worst(&device.direct(&scene, "floor"), exact);
    assert_error("two suns and a sky on a floor", 0.005, error, perturbed);
}

/// What a sun sees of the floor is lit in full, what the ring hides is black.
#[test]
fn shadow_of_the_ring() {
    let device = Device::open();
    let texels = [96, 96];
    let scene = only_receiver(load("ring.toml"), "floor", texels);
    let s = toward_sun(&scene);
    let map = device.direct(&scene, "floor");
    let flat = DVec3::new(s.x, 0.0, s.z).normalize();
    let along = |p: &DVec3| p.dot(flat);
    let across = |p: &DVec3| p.dot(flat.cross(DVec3::Y));
    let length = 0.4 * (1.0 - s.y * s.y).sqrt() / s.y;
    let (mut lit, mut dark) = (0, 0);
    for (p, rgb) in middles(&scene, "floor", texels).iter().zip(&map.pixels) {
        // Outside of the ring on its far side, at most as far off as its shadow is long.
        let behind = -along(p) - (1.03f64.powi(2) - across(p).powi(2)).max(0.0).sqrt();
        let value = f64::from(rgb[0]);
        if across(p).abs() < 0.9 && behind > 0.05 && behind < length - 0.05 {
            assert_eq!(value, 0.0, "{p}");
            dark += 1;
        } else if across(p).abs() > 1.1 || along(p) > 1.1 {
            assert!((value / s.y - 1.0).abs() < 0.001, "{p}: {value}");
            lit += 1;
        }
    }
    assert!(dark > 200 && lit > 1000, "{dark} {lit}");
    // Without the ring nothing is dark.
    let open = device.direct(&without_mirrors(scene), "floor");
    assert!(open.pixels.iter().all(|rgb| rgb[0] > 0.5));
}
