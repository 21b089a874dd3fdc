//! Lights that a mirror or glass sees at tens of degrees, which `footprint` projects in parts.

use crate::common::{
    Device, assert_error, bits, flux, footprint, l1, load, load_with_chains, middles, object_mut,
    only_receiver, options, ratio_error, rect, scaled, solve,
};
use glam::DVec3;
use nephroid::image_file::RgbImage;
use nephroid::render::Settings;
use nephroid::scene::{Geometry, LightKind, Rect, Scene};
use std::f64::consts::PI;

/// A ring on its floor, of one surface and with chains.
fn scenes() -> [Scene; 2] {
    [load("ring.toml"), load_with_chains("ring.toml")]
        .map(|scene| only_receiver(scene, "floor", [64; 2]))
}

fn with_light(mut scene: Scene, kind: LightKind) -> Scene {
    scene.lights.truncate(1);
    scene.lights[0].kind = kind;
    scene
}

/// As large as the ring is wide, at this distance above and beside it, m.
fn lamp(distance: f64) -> LightKind {
    LightKind::Lamp {
        position: distance * DVec3::new(-0.6, 0.8, 0.0),
        radius: 0.3,
        radiant_flux: DVec3::splat(4.0 * PI),
    }
}

fn sun(degrees: f64) -> LightKind {
    LightKind::Sun {
        direction: DVec3::new(-0.6, 0.8, 0.0),
        irradiance: DVec3::ONE,
        angular_radius: degrees.to_radians(),
    }
}

fn aimed(error: f32) -> Settings {
    Settings {
        error: Some(error),
        ..footprint(16_384)
    }
}

fn map(device: &Device, scene: &Scene) -> RgbImage {
    device.caustic(scene, "floor", &aimed(0.02))
}

/// Compares footprints at a target of 2 % with the reference.
fn assert_agrees(device: &Device, scene: &Scene, bounds: [f64; 2]) {
    let reference = solve(scene, "floor", [64; 2], &options(0.01));
    let truth = reference.image();
    let map = map(device, scene);
    let floor = rect(scene, "floor");
    let error = l1(&map, &truth);
    let ratio = ratio_error(flux(&map, &floor), flux(&truth, &floor));
    let light = &scene.lights[0].kind;
    let what = format!("{light:?}, {} interfaces", scene.max_interfaces);
    println!("{what}: L1 {error:.4}, energy {ratio:.4}");
    let [largest, largest_ratio] = bounds;
    assert!(error < largest, "{what}: L1 {error}");
    assert!(ratio < largest_ratio, "{what}: energy {ratio}");
    // The bounds see 5 % of the light.
    let bright = scaled(&map, 1.05);
    assert!(l1(&bright, &truth) > largest, "{what}");
    assert!(
        ratio_error(flux(&bright, &floor), flux(&truth, &floor)) > largest_ratio,
        "{what}"
    );
}

/// Projected as a whole, the sun had an error of 9 % and the lamp of 5 %.
#[test]
fn a_ring_agrees_with_the_reference() {
    let device = Device::open();
    for light in [sun(25.0), lamp(1.2)] {
        for scene in scenes() {
            assert_agrees(&device, &with_light(scene, light.clone()), [0.025, 0.005]);
        }
    }
}

/// The rays of chains start from the parts of a lamp. Projected as a whole, it had an error of 11 %.
#[test]
fn a_glass_ball_agrees_with_the_reference() {
    let device = Device::open();
    let scene = only_receiver(load_with_chains("glass_ball.toml"), "floor", [64; 2]);
    assert_agrees(&device, &with_light(scene, lamp(2.0)), [0.04, 0.01]);
}

/// A lamp that comes nearer is divided more finely, with the bits of a new renderer.
#[test]
fn a_lamp_that_comes_nearer_is_divided() {
    let device = Device::open();
    let [_, scene] = scenes();
    let at = |distance: f64| with_light(scene.clone(), lamp(distance));
    let mut renderer = device.renderer(&at(30.0), &aimed(0.02));
    let floor = scene.object_index("floor").unwrap();
    let mut frame = |distance: f64| {
        renderer.update(&at(distance)).unwrap();
        renderer.caustic().unwrap();
        renderer.read_caustic(floor).unwrap()
    };
    let far = frame(30.0);
    for distance in [2.0, 1.2, 30.0] {
        let moved = frame(distance);
        let new = map(&device, &at(distance));
        assert_eq!(bits(&moved), bits(&new), "at {distance} m");
    }
    assert_eq!(bits(&frame(30.0)), bits(&far));
}

/// Glass without absorption shows the sky wherever it does not show the floor, which is small here: a ball throws as much light as the sky
/// that it covers, π L R² h/d³ at a distance of d from its centre, which is h above the plane. From 64 cells of the sky, it had an
/// error of 16 %.
#[test]
fn a_glass_ball_shows_the_sky() {
    const RADIUS: f64 = 0.5;
    const HEIGHT: f64 = 0.8;
    const HALF: f64 = 0.3;
    let device = Device::open();
    let mut scene = only_receiver(load_with_chains("glass_ball.toml"), "floor", [32; 2]);
    let sky = load("ball.toml").lights[0].kind.clone();
    let LightKind::Environment {
        map: even, scale, ..
    } = &sky
    else {
        panic!("{sky:?}");
    };
    let radiance = f64::from(even.radiance[0][0]) * scale;
    let ball = scene.objects[scene.object_index("ball").unwrap()]
        .geometry
        .mesh();
    let [low, high] = ball.bounds();
    let centre = 0.5 * (low + high);
    scene = with_light(scene, sky.clone());
    object_mut(&mut scene, "floor").geometry = Geometry::Rect(Rect {
        origin: centre + DVec3::new(-HALF, -HEIGHT, HALF),
        edge_u: 2.0 * HALF * DVec3::X,
        edge_v: 2.0 * HALF * DVec3::NEG_Z,
    });
    let map = map(&device, &scene);
    let exact = RgbImage {
        width: 32,
        height: 32,
        pixels: middles(&scene, "floor", [32; 2])
            .iter()
            .map(|place| {
                let distance = place.distance(centre);
                let covered = RADIUS * RADIUS * HEIGHT / distance.powi(3);
                [(PI * radiance * covered) as f32; 3]
            })
            .collect(),
    };
    assert_error(
        "a ball under the sky",
        0.04,
        l1(&map, &exact),
        l1(&scaled(&map, 1.08), &exact),
    );
}
