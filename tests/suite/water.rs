//! Refraction against closed forms, and waves against the reference.

use crate::common::{
    Device, assert_error, assert_physical, floor, flux, footprint, l1, load, method, object_mut,
    only_receiver, options, rect, solve,
};
use glam::{DVec2, DVec3};
use nephroid::image_file::RgbImage;
use nephroid::optics::fresnel_dielectric;
use nephroid::render::Method;
use nephroid::scene::{
    Dielectric, EnvironmentMap, Geometry, Light, LightKind, Material, MaterialKind, Object, Rect,
    Scene, Sine, Waves,
};
use std::f64::consts::PI;
use std::sync::Arc;

const IOR: f64 = 1.333;

/// Water of 2 m × 2 m at the height 0 between a floor and a ceiling that blocks nothing, each of
/// `half` m to every side, 0.5 m away.
fn water(sines: Vec<Sine>, quads: [u32; 2], half: f64, toward_sun: DVec3) -> Scene {
    let plaster = |name, geometry, blocks_light| Object {
        light_map: Some([32, 32]),
        blocks_light,
        ..Object::new(name, 1, geometry)
    };
    let Geometry::Rect(still) = floor(1.0, 0.0) else {
        unreachable!()
    };
    let ceiling = Geometry::Rect(Rect {
        origin: DVec3::new(-half, 0.5, -half),
        edge_u: 2.0 * half * DVec3::X,
        edge_v: 2.0 * half * DVec3::Z,
    });
    let waves = Geometry::Waves(Waves {
        rect: still,
        quads,
        sines,
        time: 0.0,
    });
    Scene {
        camera: load("mirror.toml").camera,
        lights: vec![Light {
            name: "sun".into(),
            kind: LightKind::Sun {
                direction: toward_sun.normalize(),
                irradiance: DVec3::ONE,
                angular_radius: 0.004,
            },
        }],
        materials: vec![
            Material::new("water", MaterialKind::Dielectric(Dielectric::new(IOR))),
            Material::new(
                "plaster",
                MaterialKind::Diffuse {
                    albedo: DVec3::splat(0.5),
                },
            ),
        ],
        objects: vec![
            Object::new("water", 0, waves),
            plaster("floor", floor(half, -0.5), true),
            plaster("ceiling", ceiling, false),
        ],
        max_interfaces: 1,
        textures: Vec::new(),
    }
}

/// Mean irradiance of the inner quarter.
fn inside(map: &RgbImage) -> f64 {
    let [width, height] = [map.width as usize, map.height as usize];
    let (mut sum, mut count) = (0.0, 0);
    for row in height / 4..height - height / 4 {
        for column in width / 4..width - width / 4 {
            sum += f64::from(map.pixels[row * width + column][0]);
            count += 1;
        }
    }
    sum / f64::from(count)
}

/// A level surface lights the floor with T E☉ cosθ and the ceiling with F E☉ cosθ, from above and
/// from below, for every method that has suns, and for the reference.
#[test]
fn flat_water_splits_the_light_by_fresnel() {
    let device = Device::open();
    for (degrees, below) in [(20.0f64, false), (45.0, false), (20.0, true), (40.0, true)] {
        let (sine, cosine) = degrees.to_radians().sin_cos();
        let side = if below { -1.0 } else { 1.0 };
        let mut scene = water(
            Vec::new(),
            [16, 16],
            0.25,
            DVec3::new(sine, side * cosine, 0.0),
        );
        // The light from below must pass the floor.
        object_mut(&mut scene, "floor").blocks_light = false;
        let ratio = if below { IOR } else { 1.0 / IOR };
        let share = fresnel_dielectric(cosine, ratio);
        let (through, back) = match below {
            false => ("floor", "ceiling"),
            true => ("ceiling", "floor"),
        };
        let expected = [(through, 1.0 - share), (back, share)];
        let names = expected.map(|(receiver, _)| receiver);
        let maps = [Method::Footprint, Method::Beams, Method::Points].map(|of| {
            let samples = if of == Method::Points { 1 << 20 } else { 4096 };
            device.caustics(&scene, &names, &method(of, samples))
        });
        for (index, (receiver, share)) in expected.into_iter().enumerate() {
            let maps = maps.each_ref().map(|of_method| &of_method[index]);
            let by_reference = solve(&scene, receiver, [32, 32], &options(0.01)).image();
            for (map, name) in maps.into_iter().chain([&by_reference]).zip([
                "footprint",
                "beams",
                "points",
                "reference",
            ]) {
                assert_physical(map);
                let error = |asked: f64| (inside(map) - asked * cosine).abs() / cosine;
                let what = format!("{name}, {receiver}, {degrees}°, from below: {below}");
                assert_error(&what, 0.002, error(share), error(share + 0.005));
            }
        }
    }
}

/// Total reflection: beyond asin(1/n) nothing leaves the water.
#[test]
fn light_from_below_is_kept_beyond_the_critical_angle() {
    let device = Device::open();
    let toward = DVec3::new(f64::sin(0.9), -f64::cos(0.9), 0.0);
    let mut scene = water(Vec::new(), [16, 16], 0.25, toward);
    object_mut(&mut scene, "floor").blocks_light = false;
    assert!(f64::sin(0.9) * IOR > 1.0);
    let out = device.caustic(&scene, "ceiling", &footprint(4096));
    assert!(out.pixels.iter().all(|&rgb| rgb == [0.0; 3]));
    let kept = inside(&device.caustic(&scene, "floor", &footprint(4096)));
    assert!((kept / f64::cos(0.9) - 1.0).abs() < 0.002, "{kept}");
}

/// Under η = a cos kx and a vertical sun, 1/E below a crest falls linearly with depth, to zero in the
/// focus at 1/(a k² (1 − 1/n)).
#[test]
fn waves_focus_where_they_should() {
    let device = Device::open();
    let (amplitude, wave_number) = (0.004, 20.0);
    let focus_at = |ior: f64| 1.0 / (amplitude * wave_number * wave_number * (1.0 - 1.0 / ior));
    let crest = Sine {
        amplitude,
        wave_vector: DVec2::new(wave_number, 0.0),
        // The rectangle's origin is at x = −1, the crest at x = 0.
        phase: std::f64::consts::FRAC_PI_2 - wave_number,
        speed: 0.0,
    };
    let through = 1.0 - fresnel_dielectric(1.0, 1.0 / IOR);
    let focus = |ior: f64| {
        let inverse_at = |depth: f64| {
            let mut scene = water(vec![crest], [256, 8], 0.004, DVec3::Y);
            scene.materials[0].kind = MaterialKind::Dielectric(Dielectric::new(ior));
            object_mut(&mut scene, "floor").geometry = floor(0.004, -depth);
            if let LightKind::Sun { angular_radius, .. } = &mut scene.lights[0].kind {
                *angular_radius = 0.0;
            }
            let scene = only_receiver(scene, "floor", [8, 8]);
            through / inside(&device.caustic(&scene, "floor", &footprint(1 << 20)))
        };
        let [near, far] = [0.4, 0.7].map(|share| share * focus_at(IOR));
        let [at_near, at_far] = [near, far].map(inverse_at);
        near + (far - near) * at_near / (at_near - at_far)
    };
    let error = |found: f64| (found / focus_at(IOR) - 1.0).abs();
    assert_error(
        "depth of the focus",
        0.02,
        error(focus(IOR)),
        error(focus(1.36)),
    );
}

/// A glass ball: its far side is in the way of what its near side refracts, so that only what it
/// reflects reaches the floor, and that is what the reference finds.
#[test]
fn a_glass_ball_keeps_what_enters_it() {
    let mut scene = only_receiver(load("ball.toml"), "floor", [32, 32]);
    scene.materials[0].kind = MaterialKind::Dielectric(Dielectric::new(1.5));
    scene.lights[0].kind = LightKind::Sun {
        direction: DVec3::new(0.3, -0.4, 0.2).normalize(),
        irradiance: DVec3::ONE,
        angular_radius: 0.01,
    };
    let truth = solve(&scene, "floor", [32, 32], &options(0.01)).image();
    let device = Device::open();
    let map = device.caustic(&scene, "floor", &footprint(65_536));
    scene.materials[0].kind = MaterialKind::Dielectric(Dielectric::new(1.55));
    let perturbed = device.caustic(&scene, "floor", &footprint(65_536));
    assert_error("glass ball", 0.04, l1(&map, &truth), l1(&perturbed, &truth));
}

/// An environment alone casts no caustic by beams or points: the map is black, not what was in memory.
#[test]
fn water_without_a_sun_is_dark() {
    let mut scene = only_receiver(load("ball.toml"), "floor", [32, 32]);
    scene.materials[0].kind = MaterialKind::Dielectric(Dielectric::new(1.5));
    let device = Device::open();
    for of in [Method::Beams, Method::Points] {
        let map = device.caustic(&scene, "floor", &method(of, 4096));
        assert!(map.pixels.iter().all(|&rgb| rgb == [0.0; 3]));
    }
}

/// Through still water comes π L (1 − F̄) of an even sky, F̄ = 2 ∫ F c dc over the cosine c.
#[test]
fn still_water_lets_an_even_sky_through() {
    let sky = |radiance: f32| LightKind::Environment {
        map: Arc::new(EnvironmentMap {
            width: 4,
            height: 2,
            radiance: [[[radiance; 3]; 4], [[0.0; 3]; 4]].concat(),
        }),
        scale: 1.0,
        rotation: 0.0,
        casts_caustics: true,
    };
    // All that is refracted to the floor, within 48.6°, comes by the water.
    let mut scene = water(Vec::new(), [16, 16], 0.2, DVec3::Y);
    let steps = 10_000;
    let reflected: f64 = (0..steps)
        .map(|i| (f64::from(i) + 0.5) / f64::from(steps))
        .map(|c| 2.0 * fresnel_dielectric(c, 1.0 / IOR) * c / f64::from(steps))
        .sum();
    let exact = PI * (1.0 - reflected);
    let device = Device::open();
    let mut error = |radiance| {
        scene.lights[0].kind = sky(radiance);
        let map = device.caustic(&scene, "floor", &footprint(16_384));
        assert_physical(&map);
        let off: f64 = (map.pixels.iter())
            .map(|rgb| (f64::from(rgb[0]) / exact - 1.0).abs())
            .sum();
        off / map.pixels.len() as f64
    };
    assert_error("sky through still water", 0.01, error(1.0), error(1.03));
}

/// Waves move: after a time they are where their phases say.
#[test]
fn waves_travel_with_their_speed() {
    let sine = Sine {
        amplitude: 0.01,
        wave_vector: DVec2::new(3.0, -2.0),
        phase: 0.4,
        speed: 2.5,
    };
    let later = Waves {
        rect: rect(&load("pool.toml"), "floor"),
        quads: [4, 4],
        sines: vec![sine],
        time: 0.8,
    };
    let shifted = Waves {
        sines: vec![Sine {
            phase: sine.phase - sine.speed * later.time,
            ..sine
        }],
        time: 0.0,
        ..later.clone()
    };
    let still = Waves {
        time: 0.0,
        ..later.clone()
    };
    let distance = |a: &Waves, b: &Waves| -> f64 {
        (a.to_mesh().positions.iter().zip(&b.to_mesh().positions))
            .map(|(a, b)| a.distance(*b))
            .fold(0.0, f64::max)
    };
    assert!(distance(&later, &shifted) < 1e-12);
    assert!(distance(&later, &still) > 0.005);
}

/// The pool's floor, where the caustic has folds, with one patch a triangle.
#[test]
fn pool_agrees_with_the_reference() {
    let texels = [128, 128];
    let mut scene = only_receiver(load("pool.toml"), "floor", texels);
    if let Geometry::Waves(waves) = &mut object_mut(&mut scene, "water").geometry {
        waves.quads = [64; 2];
    }
    let truth = solve(&scene, "floor", texels, &options(0.012)).image();
    let device = Device::open();
    let map = device.caustic(&scene, "floor", &footprint(8192));
    assert_physical(&map);
    let mut other = scene.clone();
    other.materials[0].kind = MaterialKind::Dielectric(Dielectric::new(1.36));
    let perturbed = device.caustic(&other, "floor", &footprint(8192));
    assert_error("pool", 0.035, l1(&map, &truth), l1(&perturbed, &truth));
    let of = |map: &RgbImage| flux(map, &rect(&scene, "floor"))[0];
    let energy = (of(&map) / of(&truth) - 1.0).abs();
    assert!(energy < 0.003, "{energy}");
}
