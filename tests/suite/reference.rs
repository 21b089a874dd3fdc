//! What the reference promises beside the closed forms. Every check is seen to fail on a perturbed
//! twin.

use crate::common::{assert_errors_are_honest, load, options, ring, solve};
use glam::DVec3;
use nephroid::Error;
use nephroid::measure;
use nephroid::reference::{Options, Reference, caustic};
use nephroid::scene::{Geometry, LightKind, Object, Rect, Scene};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// (E₁ − E₂)² / (σ₁² + σ₂²) has mean 1 over texels, if the standard errors are honest; and the L1
/// difference is √2 times the expected error.
#[test]
fn error_bars_are_what_two_seeds_differ_by() {
    for (name, receiver, error) in [("ring.toml", "floor", 0.04), ("ball.toml", "floor", 0.02)] {
        let scene = load(name);
        let run = |seed| {
            let options = Options {
                seed,
                ..options(error)
            };
            solve(&scene, receiver, [48, 48], &options)
        };
        let (one, two) = (run(1), run(2));
        let solutions = [&one, &two].map(|of| [&of.irradiance[..], &of.standard_error[..]]);
        assert_errors_are_honest(name, solutions);

        let difference = measure::compare(&one.image(), &two.image())
            .unwrap()
            .l1
            .unwrap();
        let expected = one.relative_error.hypot(two.relative_error);
        assert!(
            (0.85..1.15).contains(&(difference / expected)),
            "{difference} {expected}"
        );
    }
}

/// The variance of the flux over seeds is the square of its standard error, for tracing and for gathering.
#[test]
fn error_of_the_flux_is_what_seeds_differ_by() {
    const SEEDS: u32 = 12;
    for (name, error) in [("ring.toml", 0.2), ("ball.toml", 0.2)] {
        let scene = load(name);
        let solutions: Vec<Reference> = (0..SEEDS)
            .map(|seed| {
                let options = Options {
                    seed,
                    ..options(error)
                };
                solve(&scene, "floor", [12, 12], &options)
            })
            .collect();
        let count = f64::from(SEEDS);
        let mean = solutions.iter().map(|s| s.received_flux[0]).sum::<f64>() / count;
        let squares = solutions
            .iter()
            .map(|s| (s.received_flux[0] - mean).powi(2));
        let variance = squares.sum::<f64>() / (count - 1.0);
        let claimed = solutions.iter().map(|s| s.received_flux_error[0].powi(2));
        let ratio = variance / (claimed.sum::<f64>() / count);
        println!("{name}: {mean} W, variance over claimed {ratio}");
        // √(2/11) = 0.43 is the standard error of a variance.
        assert!((0.4..2.4).contains(&ratio), "{name}: {ratio}");
    }
}

#[test]
fn the_same_seed_gives_the_same_bits_on_one_thread_and_on_several() {
    let scene = load("ball.toml");
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        pool.build()
            .unwrap()
            .install(|| solve(&scene, "floor", [16, 16], &options(0.1)))
    };
    let (one, three) = (run(1), run(3));
    assert_eq!(one.irradiance, three.irradiance);
    assert_eq!(one.standard_error, three.standard_error);
    assert_eq!(one.samples, three.samples);
}

/// A mirror facing +z beside a floor, as in mirror.toml, with a plate in the way.
fn with_plate(rect: Rect, blocks_light: bool) -> f64 {
    let mut scene = load("mirror.toml");
    scene.objects.push(Object {
        blocks_light,
        ..Object::new("plate", scene.objects[1].material, Geometry::Rect(rect))
    });
    solve(&scene, "floor", [32, 32], &options(0.1)).received_flux[0]
}

#[test]
fn what_blocks_either_leg_stops_the_light() {
    let open = 0.9 * 0.6 / DVec3::new(0.3, 0.8, 0.6).length() * 0.48;
    let plate = |origin: DVec3, edge_u: DVec3, edge_v: DVec3| Rect {
        origin,
        edge_u,
        edge_v,
    };
    // Above the mirror, across the light that comes; low before it, across the light that goes.
    let above = plate(DVec3::new(-2.0, 1.0, 2.0), 5.0 * DVec3::X, -2.1 * DVec3::Z);
    let below = plate(DVec3::new(-2.0, 0.15, 2.0), 5.0 * DVec3::X, -2.1 * DVec3::Z);
    let flip = |r: Rect| plate(r.origin, r.edge_v, r.edge_u);
    for rect in [above, below, flip(above), flip(below)] {
        assert_eq!(with_plate(rect, true), 0.0);
        assert!((with_plate(rect, false) / open - 1.0).abs() < 0.01);
    }
    let beside = plate(DVec3::new(3.0, 1.0, 2.0), 5.0 * DVec3::X, -2.1 * DVec3::Z);
    assert!((with_plate(beside, true) / open - 1.0).abs() < 0.01);
}

#[test]
fn a_floor_blocks_light_from_below() {
    // A ring above the floor whose normals lean down, so that it reflects light from below back down.
    let scene = |blocks_light| {
        let mut scene = ring(0.61, blocks_light);
        if let LightKind::Sun { direction, .. } = &mut scene.lights[0].kind {
            direction.y = -direction.y;
        }
        if let Geometry::Mesh(mesh) = &mut scene.objects[0].geometry {
            let mesh = Arc::make_mut(mesh);
            mesh.positions.iter_mut().for_each(|p| p.y += 0.1);
            for normal in &mut mesh.normals {
                *normal = (*normal - DVec3::Y).normalize();
            }
        }
        scene
    };
    let flux = |scene: &Scene| solve(scene, "floor", [32, 32], &options(0.1)).received_flux[0];
    assert_eq!(flux(&scene(true)), 0.0);
    assert!(flux(&scene(false)) > 0.1);
}

#[test]
fn backs_neither_reflect_nor_receive() {
    let flux = |scene: &Scene| solve(scene, "floor", [8, 8], &options(0.1)).received_flux[0];
    let scene = load("mirror.toml");
    assert!(flux(&scene) > 0.1);
    for object in 0..2 {
        let mut turned = scene.clone();
        turned.objects[1].blocks_light = false;
        if let Geometry::Rect(rect) = &mut turned.objects[object].geometry {
            std::mem::swap(&mut rect.edge_u, &mut rect.edge_v);
        }
        assert_eq!(flux(&turned), 0.0);
    }
}

#[test]
fn asking_for_nonsense_is_refused_and_cancelling_stops() {
    let scene = load("mirror.toml");
    let run = |receiver, texels, error, cancel| {
        let cancel = AtomicBool::new(cancel);
        caustic(
            &scene,
            receiver,
            texels,
            &options(error),
            &mut |_| {},
            &cancel,
        )
    };
    assert!(run(1, [8, 8], 0.1, false).is_ok());
    assert!(matches!(run(1, [8, 8], 0.1, true), Err(Error::Cancelled)));
    for (receiver, texels, error) in [
        (0, [8, 8], 0.1),
        (7, [8, 8], 0.1),
        (1, [0, 8], 0.1),
        (1, [8, 100_000], 0.1),
        (1, [8, 8], 0.0),
        (1, [8, 8], f64::NAN),
        (1, [8, 8], -1.0),
    ] {
        let refused = run(receiver, texels, error, false);
        assert!(matches!(refused, Err(Error::Usage { .. })));
    }
}

#[test]
fn a_scene_without_light_or_mirror_is_dark_and_ends() {
    let mut dark = load("mirror.toml");
    dark.lights.clear();
    let mut dull = load("mirror.toml");
    dull.objects.remove(0);
    for scene in [dark, dull] {
        let reference = solve(&scene, "floor", [4, 4], &options(0.001));
        assert_eq!(reference.received_flux, [0.0; 3]);
        assert_eq!(reference.relative_error, 0.0);
    }
}
