//! Light that reaches the receivers without a mirror, against closed forms.

use crate::common::{Device, assert_error, brighter, load, middles, only_receiver, toward_sun};
use glam::DVec3;
use nephroid::image_file::RgbImage;
use nephroid::scene::{Geometry, LightKind, MaterialKind, Rect, Scene};
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

/// A tilted receiver of this length, a 1024th of it wide, with texels so small that points on its
/// plane round to more than a small share of a texel off it. A blocker hides the first half of
/// its length, very near.
fn tilted(length: f64) -> (Scene, f64) {
    let mut scene = without_mirrors(load("mirror.toml"));
    // Any three perpendicular directions that are not the axes.
    let along = DVec3::new(2.0, 1.0, -2.0) / 3.0;
    let across = DVec3::new(1.0, 2.0, 2.0) / 3.0;
    let normal = along.cross(across);
    let width = length / 1024.0;
    let near = DVec3::new(0.3, 0.1, -0.2) * length;
    let rect = |origin, length, width| {
        Geometry::Rect(Rect {
            origin,
            edge_u: length * along,
            edge_v: width * across,
        })
    };
    scene.objects[0].geometry = rect(near, length, width);
    scene.objects[0].light_map = Some([4096, 4]);
    let mut blocker = scene.objects[0].clone();
    blocker.name = "blocker".into();
    blocker.light_map = None;
    // The receiver lies below one of its triangles.
    let shift = 1e-4 * length * normal - width * (10.0 * along + across);
    blocker.geometry = rect(near + shift, 0.5 * length, 0.5 * length);
    scene.objects.push(blocker);
    let toward = (along + 0.2 * across + 0.5 * normal).normalize();
    if let LightKind::Sun {
        direction,
        angular_radius,
        ..
    } = &mut scene.lights[0].kind
    {
        (*direction, *angular_radius) = (-toward + 2.0 * toward.dot(normal) * normal, 0.0);
    }
    (scene, toward.dot(normal))
}

/// A plane does not shade itself, and nothing shines through what is close to it.
#[test]
fn tiny_and_huge_tilted_receivers() {
    let device = Device::open();
    for length in [1e-3, 1.0, 1e3] {
        let (scene, exact) = tilted(length);
        let error = |scene: &Scene| {
            let map = device.direct(scene, "floor");
            let of = |rgb: &[f32; 3], exact: f64| (f64::from(rgb[0]) - exact).abs();
            // The blocker ends at half the length less a texel's few, and the sun is in -u.
            let dark = map.pixels.chunks(4096).flat_map(|row| &row[..1900]);
            let lit = map.pixels.chunks(4096).flat_map(|row| &row[2200..]);
            let dark = dark.map(|rgb| of(rgb, 0.0)).fold(0.0, f64::max);
            lit.map(|rgb| of(rgb, exact)).fold(dark, f64::max) / exact
        };
        let perturbed = error(&brighter(scene.clone(), 1.002));
        let what = format!("tilted receiver of {length} m");
        assert_error(&what, 0.001, error(&scene), perturbed);
        // Without its blocker the dark half is lit.
        let mut open = scene;
        open.objects.pop();
        let map = device.direct(&open, "floor");
        assert!(worst(&map, exact) < 0.001, "{}", worst(&map, exact));
    }
}

/// What a sun sees of the floor is lit in full, what the ring hides is black.
#[test]
fn shadow_of_the_ring() {
    let device = Device::open();
    let texels = [96, 96];
    let mut scene = only_receiver(load("ring.toml"), "floor", texels);
    // The sun alone.
    scene.lights.truncate(1);
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
