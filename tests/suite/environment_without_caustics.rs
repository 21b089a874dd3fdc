//! Environments that cast no caustics: light maps are as without them, and transparent surfaces do not block them.

use crate::common::{
    Device, assert_error, footprint, load, method, moved, only_receiver, options, see, solve,
};
use glam::DVec3;
use nephroid::image_file::RgbImage;
use nephroid::render::Method;
use nephroid::scene::{Dielectric, LightKind, MaterialKind, Scene};
use std::f64::consts::PI;

fn casting(mut scene: Scene, casts: bool) -> Scene {
    let environment = (scene.lights.iter_mut()).find_map(|light| match &mut light.kind {
        LightKind::Environment { casts_caustics, .. } => Some(casts_caustics),
        _ => None,
    });
    *environment.unwrap() = casts;
    scene
}

#[test]
fn light_maps_are_as_without_it() {
    let under_a_sky = only_receiver(load("ring.toml"), "floor", [32, 32]);
    assert_eq!(under_a_sky.lights.len(), 2);
    let mut alone = under_a_sky.clone();
    alone.lights.truncate(1);
    let device = Device::open();
    for (kind, samples, has_environments) in [
        (Method::Footprint, 4096, true),
        (Method::Pinhole, 64, true),
        (Method::Beams, 4096, false),
        (Method::Points, 4096, false),
    ] {
        let map = |scene: &Scene| {
            device
                .caustic(scene, "floor", &method(kind, samples))
                .pixels
        };
        let expected = map(&alone);
        assert!(map(&under_a_sky) == expected, "{kind:?}");
        if has_environments {
            assert!(
                map(&casting(under_a_sky.clone(), true)) != expected,
                "{kind:?}"
            );
        }
    }
    let truth = |scene: &Scene| solve(scene, "floor", [8, 8], &options(0.2)).irradiance;
    let expected = truth(&alone);
    assert!(truth(&under_a_sky) == expected);
    assert!(truth(&casting(under_a_sky, true)) != expected);
}

/// A glass ball over a floor in the even light of 1 W/m²/sr, which gives π W/m².
fn ball(casts: bool) -> Scene {
    let mut scene = casting(only_receiver(load("ball.toml"), "floor", [32, 32]), casts);
    scene.materials[0].kind = MaterialKind::Dielectric(Dielectric::new(1.5));
    scene
}

#[test]
fn it_passes_straight_through_glass() {
    let device = Device::open();
    let worst = |map: RgbImage| {
        (map.pixels.iter())
            .map(|rgb| (f64::from(rgb[0]) / PI - 1.0).abs())
            .fold(0.0, f64::max)
    };
    let error = |casts| worst(device.direct(&ball(casts), "floor"));
    assert_error("a floor under glass", 0.005, error(false), error(true));
    // A mirror blocks it as ever.
    let mut mirror = ball(false);
    mirror.materials[0].kind = MaterialKind::Mirror {
        reflectance: DVec3::ONE,
    };
    assert!(worst(device.direct(&mirror, "floor")) > 0.1);
}

/// So that glass or water in motion does not make its direct light be computed again. Glass that casts its caustics does, as do
/// mirrors and diffuse surfaces.
#[test]
fn glass_in_motion_keeps_its_light() {
    let device = Device::open();
    let mirror = |mut scene: Scene| {
        scene.materials[0].kind = MaterialKind::Mirror {
            reflectance: DVec3::ONE,
        };
        scene
    };
    let up = 0.1 * DVec3::Y;
    for (scene, object, is_again) in [
        (ball(false), "ball", false),
        (ball(true), "ball", true),
        (mirror(ball(false)), "ball", true),
        (ball(false), "floor", true),
    ] {
        let mut renderer = device.renderer(&scene, &footprint(256));
        renderer.direct().unwrap();
        renderer.update(&moved(scene, object, 0.0, up)).unwrap();
        renderer.take_times();
        renderer.direct().unwrap();
        let passes = renderer.take_times();
        let has = |name| passes.iter().any(|pass| pass.name == name);
        assert!(
            has("direct") && has("environment rays") == is_again,
            "{object}"
        );
    }
}

/// The same in the reference, on the floor below the ball: albedo/π · π W/m²/sr.
#[test]
fn it_passes_straight_through_glass_in_the_reference() {
    let error = |casts| {
        let mut scene = ball(casts);
        scene.camera.position = DVec3::new(0.9, 0.2, 0.0);
        scene.camera.target = DVec3::ZERO;
        scene.camera.fov = 0.02;
        // Light through the ball is not what this is about.
        scene
            .objects
            .iter_mut()
            .for_each(|object| object.light_map = None);
        let view = see(&scene, [6, 4], &options(0.01));
        let mean = view.radiance.iter().map(|rgb| rgb[0]).sum::<f64>() / 24.0;
        (mean / 0.5 - 1.0).abs()
    };
    assert_error(
        "the floor below a glass ball",
        0.01,
        error(false),
        error(true),
    );
}
