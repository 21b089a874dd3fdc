//! Light that meets two or more specular surfaces: closed forms, and the reference.

use crate::common::glass::{self, block};
use crate::common::{
    Device, assert_error, assert_error_beyond_noise, footprint, l1, l1_noise, load_with_chains,
    only_receiver, options, solve, with_sun_of, with_texels,
};
use glam::DVec3;
use nephroid::image_file::RgbImage;
use nephroid::optics::fresnel_dielectric;
use nephroid::render::Settings;
use nephroid::scene::{Dielectric, Geometry, LightKind, MaterialKind, Rect, Scene};

const TEXELS: [u32; 2] = [32, 32];

/// Bodies over a floor of 1 m² at the height 0, in the sun.
fn scene(toward: DVec3, bodies: Vec<(Dielectric, Geometry)>) -> Scene {
    let floor = Rect {
        origin: DVec3::new(-0.5, 0.0, 0.5),
        edge_u: DVec3::X,
        edge_v: DVec3::NEG_Z,
    };
    let bodies = (bodies.into_iter())
        .map(|(dielectric, geometry)| (MaterialKind::Dielectric(dielectric), geometry))
        .collect();
    let scene = glass::scene(toward, floor, bodies);
    with_sun_of(scene, f64::to_degrees(0.002))
}

fn by_device(scene: &Scene) -> RgbImage {
    Device::open().caustic(scene, "floor", &footprint(16_384))
}

fn by_reference(scene: &Scene) -> RgbImage {
    solve(scene, "floor", TEXELS, &options(0.03)).image()
}

/// Mean over the texels in the middle half of the floor, RGB, W/m².
fn middle(map: &RgbImage) -> DVec3 {
    let [low, high] = [TEXELS[0] as usize / 4, 3 * TEXELS[0] as usize / 4];
    let texels = (low..high).flat_map(|y| (low..high).map(move |x| y * TEXELS[0] as usize + x));
    let sum: DVec3 = (texels.map(|texel| DVec3::from(map.pixels[texel].map(f64::from)))).sum();
    sum / ((high - low) * (high - low)) as f64
}

/// Light from the centre of a glass ball meets its surface head on, and what is reflected comes back through the centre: the ball changes
/// nothing. Almost all of that light meets one surface and leaves the body there.
#[test]
fn a_ball_around_a_lamp_changes_nothing() {
    let mut scene = only_receiver(load_with_chains("glass_ball.toml"), "floor", TEXELS);
    let ball = scene.object_index("ball").unwrap();
    let [low, high] = scene.objects[ball].geometry.mesh().bounds();
    scene.lights.truncate(1);
    scene.lights[0].kind = LightKind::Lamp {
        position: 0.5 * (low + high),
        radius: 1e-3,
        radiant_flux: DVec3::ONE,
    };
    let device = Device::open();
    let map = device.caustic(&scene, "floor", &footprint(16_384));
    scene.objects.remove(ball);
    let without = device.direct(&scene, "floor");
    let ratio = middle(&map) / middle(&without);
    assert!((ratio - 1.0).abs().max_element() < 0.01, "{ratio}");
    assert!(l1(&map, &without) < 0.03, "{}", l1(&map, &without));
}

/// A sheet reflects 2R/(1 + R). The light that it transmits keeps its direction.
#[test]
fn sheet_without_thickness() {
    let toward = DVec3::new(0.8, 0.6, 0.0);
    let sheet = Dielectric {
        thin: true,
        ..Dielectric::new(1.5)
    };
    let square = |y: f64| {
        Geometry::Rect(Rect {
            origin: DVec3::new(-1.0, y, 1.0),
            edge_u: 2.0 * DVec3::X,
            edge_v: 2.0 * DVec3::NEG_Z,
        })
    };
    // Two sheets are four interfaces: T = (1 − F)/(1 + 3F).
    let scene = scene(toward, vec![(sheet, square(0.2)), (sheet, square(0.1))]);
    let f = fresnel_dielectric(0.6, 1.0 / 1.5);
    let exact = 0.6 * (1.0 - f) / (1.0 + 3.0 * f);
    for (what, map, tolerance) in [
        ("device", by_device(&scene), 0.005),
        ("reference", by_reference(&scene), 0.003),
    ] {
        let error = (middle(&map).x / exact - 1.0).abs();
        assert!(error < tolerance, "{what}: {error}");
    }
}

/// A small mirror in the light of a large flat one throws what it throws in the mirror image of the sun. If all directions of the sun that
/// leave a place of the large mirror went the way of their middle, they would blur it as if the sun were twice as wide.
#[test]
fn a_small_mirror_in_the_image_of_a_wide_sun() {
    let rect = |origin: [f64; 3], edge_u: DVec3, edge_v: DVec3| Rect {
        origin: origin.into(),
        edge_u,
        edge_v,
    };
    let large = rect([-0.35, 0.0, 0.35], 0.7 * DVec3::X, 0.7 * DVec3::NEG_Z);
    let small = rect([1.85, 2.0, -0.15], 0.3 * DVec3::X, 0.3 * DVec3::Z);
    let map = |height: f64, mirrors: &[Rect], degrees: f64| {
        let mirrors = mirrors.iter().map(|&mirror| {
            let kind = MaterialKind::Mirror {
                reflectance: DVec3::ONE,
            };
            (kind, Geometry::Rect(mirror))
        });
        let floor = rect([3.5, 0.0, 0.5], DVec3::X, DVec3::NEG_Z);
        let scene = glass::scene(DVec3::new(-1.0, height, 0.0), floor, mirrors.collect());
        let settings = Settings {
            error: Some(0.02),
            ..Settings::default()
        };
        Device::open().caustic(&with_sun_of(scene, degrees), "floor", &settings)
    };
    let by_both = map(1.0, &[large, small], 1.2);
    let [by_one, blurred] = [1.2, 2.4].map(|degrees| map(-1.0, &[small], degrees));
    assert_error(
        "a mirror in the image of the sun",
        0.05,
        l1(&by_both, &by_one),
        l1(&blurred, &by_one),
    );
}

/// Water overlaps the lower half of a plate of glass. Where the glass has the higher priority, the plate keeps its thickness;
/// otherwise it loses the overlap, and more light is absorbed by the water.
#[test]
fn glass_displaces_what_overlaps_it() {
    let toward = DVec3::new(0.5, 0.8, 0.2);
    let colour = |ior: f64, priority: i32, absorption: DVec3| Dielectric {
        priority,
        absorption,
        ..Dielectric::new(ior)
    };
    let with = |of_glass: i32| {
        let glass = block(DVec3::new(-1.0, 0.2, -1.0), DVec3::new(1.0, 0.3, 1.0));
        let water = block(DVec3::new(-1.1, 0.05, -1.1), DVec3::new(1.1, 0.25, 1.1));
        let bodies = vec![
            (colour(1.5, of_glass, DVec3::new(5.0, 0.0, 0.0)), glass),
            (colour(1.33, 0, DVec3::new(0.0, 3.0, 0.0)), water),
        ];
        scene(toward, bodies)
    };
    // Without light that is reflected twice inside, a few thousandths.
    let expected = |glass: f64, water: f64| {
        let cosine = toward.normalize().y;
        let cosine_in = |ior: f64| (1.0 - (1.0 - cosine * cosine) / (ior * ior)).sqrt();
        let passed = (1.0 - fresnel_dielectric(cosine, 1.0 / 1.5))
            * (1.0 - fresnel_dielectric(cosine_in(1.5), 1.5 / 1.33))
            * (1.0 - fresnel_dielectric(cosine_in(1.33), 1.33));
        let left = DVec3::new(
            -5.0 * glass / cosine_in(1.5),
            -3.0 * water / cosine_in(1.33),
            0.0,
        );
        cosine * passed * left.exp()
    };
    for (priority, glass, water) in [(1, 0.1, 0.15), (-1, 0.05, 0.2)] {
        let scene = with(priority);
        for (what, map) in [
            ("device", by_device(&scene)),
            ("reference", by_reference(&scene)),
        ] {
            let error = (middle(&map) / expected(glass, water) - DVec3::ONE)
                .abs()
                .max_element();
            assert!(error < 0.01, "{what}, priority {priority}: {error}");
        }
    }
}

/// Light that meets a curved mirror and then a flat one lights the receiver as the curved mirror alone lights the receiver's mirror
/// image.
#[test]
fn curved_mirror_then_flat_mirror() {
    let wide = with_texels(load_with_chains("two_mirrors.toml"), "floor", [64, 64]);
    // The flat mirror meets all light from the half ring. The sun shines over it onto the half ring.
    let plane = 0.5;
    let mut both = wide.clone();
    let index = both.object_index("mirror").unwrap();
    both.objects[index].geometry = Geometry::Rect(Rect {
        origin: DVec3::new(plane, -1.0, 3.0),
        edge_u: 6.0 * DVec3::NEG_Z,
        edge_v: 1.6 * DVec3::Y,
    });
    let floor = both.object_index("floor").unwrap();
    let receiver = Rect {
        origin: DVec3::new(plane + 0.01, 0.0, 1.0),
        edge_u: DVec3::X,
        edge_v: 2.0 * DVec3::NEG_Z,
    };
    both.objects[floor].geometry = Geometry::Rect(receiver);
    let mirrored = {
        let mut scene = both.clone();
        let reflect = |p: DVec3| DVec3::new(2.0 * plane - p.x, p.y, p.z);
        scene.objects[floor].geometry = Geometry::Rect(Rect {
            origin: reflect(receiver.origin + receiver.edge_u),
            edge_u: receiver.edge_u,
            edge_v: receiver.edge_v,
        });
        scene.objects.remove(index);
        scene.max_interfaces = 1;
        scene
    };
    let alone = Scene {
        max_interfaces: 1,
        ..both.clone()
    };
    let device = Device::open();
    let map = |scene: &Scene| device.caustic(scene, "floor", &footprint(65_536));
    let (all, first) = (map(&both), map(&alone));
    let expected = map(&mirrored);
    let reflectance = [0.95, 0.93, 0.88];
    let [width, height] = [64, 64];
    let (mut off, mut sum) = (0.0, 0.0);
    for y in 0..height {
        for x in 0..width {
            let here = y * width + x;
            let there = y * width + (width - 1 - x);
            for (channel, reflectance) in reflectance.into_iter().enumerate() {
                let second = f64::from(all.pixels[here][channel] - first.pixels[here][channel]);
                let exact = reflectance * f64::from(expected.pixels[there][channel]);
                off += (second - exact).abs();
                sum += exact;
            }
        }
    }
    assert!(sum > 1.0, "nothing arrives: {sum}");
    assert!(off / sum < 0.05, "{}", off / sum);
}

/// Light that walks between two parallel mirrors in steps of 50 mm ends after `max_interfaces`, in bounded time: none of it
/// arrives behind mirrors that are longer than it gets. Behind shorter ones all of it does.
#[test]
fn light_between_parallel_mirrors_ends() {
    let corridor = |length: f64, max_interfaces: u32| {
        let mirror = |y: f64, from: f64, upward: f64| {
            let rect = Rect {
                origin: DVec3::new(from, y, 0.1 * upward),
                edge_u: (length - from) * DVec3::X,
                edge_v: -0.2 * upward * DVec3::Z,
            };
            let polished = MaterialKind::Mirror {
                reflectance: DVec3::ONE,
            };
            (polished, Geometry::Rect(rect))
        };
        let end = Rect {
            origin: DVec3::new(length + 0.05, -0.1, -0.15),
            edge_u: 0.3 * DVec3::Z,
            edge_v: 0.3 * DVec3::Y,
        };
        let mirrors = vec![mirror(0.0, 0.0, 1.0), mirror(0.1, 0.02, -1.0)];
        Scene {
            max_interfaces,
            ..glass::scene(DVec3::new(-0.5, 1.0, 0.0), end, mirrors)
        }
    };
    let start = std::time::Instant::now();
    let flux = |map: &RgbImage| {
        let sum: f64 = map.pixels.iter().map(|rgb| f64::from(rgb[0])).sum();
        sum * 0.09 / map.pixels.len() as f64
    };
    // Light over 70 mm of the lower mirror comes in under the edge of the upper one.
    let entering = 0.07 * 0.2 * DVec3::new(-0.5, 1.0, 0.0).normalize().y;
    for (length, interfaces, arrives) in [(1.0, 64, true), (1.0, 16, false), (10.0, 64, false)] {
        let scene = corridor(length, interfaces);
        for (what, map) in [
            ("device", by_device(&scene)),
            ("reference", by_reference(&scene)),
        ] {
            let share = flux(&map) / entering;
            let expected = if arrives { 1.0 } else { 0.0 };
            // Rows of rays at the edges of the strip of light count whole or not at all.
            assert!(
                (share - expected).abs() < 0.05,
                "{what}, {length} m, {interfaces}: {share}"
            );
        }
    }
    assert!(start.elapsed().as_secs() < 120, "{:?}", start.elapsed());
}

/// The scenes with glass and mirrors. The focus of the ball is narrower than a texel of a map of 48²: kernels at the middles of texels
/// would make an error of 5.9 % of it, whatever the number of samples.
#[test]
fn against_the_reference() {
    for (name, receiver, side, noise, bound) in [
        ("glass_ball.toml", "floor", 48, 0.01, 0.03),
        ("tumbler.toml", "floor", 48, 0.03, 0.11),
        ("two_mirrors.toml", "floor", 48, 0.02, 0.04),
        ("lens.toml", "paper", 64, 0.02, 0.04),
        ("engineered.toml", "screen", 64, 0.02, 0.04),
    ] {
        let scene = only_receiver(load_with_chains(name), receiver, [side, side]);
        let truth = solve(&scene, receiver, [side, side], &options(noise));
        let truth_map = truth.image();
        let device = Device::open();
        let settings = Settings {
            error: Some(0.02),
            ..footprint(16_384)
        };
        let map = device.caustic(&scene, receiver, &settings);
        let one = Scene {
            max_interfaces: 1,
            ..scene.clone()
        };
        let without = device.caustic(&one, receiver, &settings);
        let (error, perturbed) = (l1(&map, &truth_map), l1(&without, &truth_map));
        assert_error_beyond_noise(name, bound, l1_noise(&truth), error, perturbed);
        let flux: f64 = map.pixels.iter().flatten().map(|&e| f64::from(e)).sum();
        let exact: f64 = truth_map
            .pixels
            .iter()
            .flatten()
            .map(|&e| f64::from(e))
            .sum();
        assert!(
            (flux / exact - 1.0).abs() < 0.02,
            "{name}: energy {}",
            flux / exact
        );
    }
}

/// Light that passes the edge of the rect that its path meets lands on the receiver behind that edge, whether or not the rect has a light
/// map: the spectrum of `prism` crosses from the table to the wall.
#[test]
fn light_passes_the_edges_of_all_rects() {
    let device = Device::open();
    let flux = |scene: &Scene| -> f64 {
        let map = device.caustic(scene, "table", &footprint(16_384));
        (map.pixels.as_flattened().iter())
            .map(|&value| f64::from(value))
            .sum()
    };
    let both = with_texels(load_with_chains("prism.toml"), "table", [64, 64]);
    let alone = only_receiver(both.clone(), "table", [64, 64]);
    let error = (flux(&alone) / flux(&both) - 1.0).abs();
    // Without such light, 1.6 % were missing.
    assert!(
        error < 0.002,
        "flux of the table without a light map of the wall: {error}"
    );
}
