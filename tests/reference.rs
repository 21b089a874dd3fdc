//! The reference against closed forms. Every check is seen to fail on a perturbed twin.

mod common;

use common::{
    RING_HEIGHT, dish_disc, dish_irradiance, image, load, middles, options, ridge_off_nephroid,
    ring, solve, texel_mean,
};
use glam::DVec3;
use nephroid::measure;
use nephroid::reference::{Options, Reference, caustic};
use nephroid::scene::{EnvironmentMap, Geometry, LightKind, Object, Rect, Scene};
use std::f64::consts::{PI, TAU};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Σ|E − truth| / Σ truth in red, where there is a truth.
fn error_where<'a>(reference: &Reference, truth: impl IntoIterator<Item = &'a Option<f64>>) -> f64 {
    let (mut error, mut total, mut texels) = (0.0, 0.0, 0);
    for (rgb, truth) in reference.irradiance.iter().zip(truth) {
        if let Some(truth) = truth {
            error += (rgb[0] - truth).abs();
            total += truth;
            texels += 1;
        }
    }
    assert!(texels > 100, "{texels} texels are too few to judge by");
    error / total
}

/// Design, section 9 (c): parallel light, a paraboloid, a screen across the axis at z < f.
#[test]
fn dish_lights_a_screen_before_its_focus() {
    let scene = load("dish.toml");
    let texels = [64, 64];
    let reference = solve(&scene, "screen", texels, &options(0.003));
    let truth = |f: f64| -> Vec<Option<f64>> {
        (middles(&scene, "screen", texels).iter())
            .map(|p| {
                let on_screen = p.x.hypot(p.z);
                let e = dish_irradiance(f, 0.5, 0.5, on_screen);
                (on_screen < dish_disc(f, 0.5, 0.5) - 0.02).then_some(e)
            })
            .collect()
    };
    let error = error_where(&reference, &truth(1.0));
    assert!(error < 0.005, "{error}");
    let perturbed = error_where(&reference, &truth(1.01));
    assert!(perturbed > 0.01, "{perturbed}");
}

/// Design, section 9 (d): a flat mirror casts its shifted outline, E = F E₀ cosθ inside.
#[test]
fn flat_mirror_casts_its_image_and_keeps_the_energy() {
    let scene = load("mirror.toml");
    let texels = [64, 64];
    let reference = solve(&scene, "floor", texels, &options(0.001));
    let s = DVec3::new(0.3, 0.8, 0.6).normalize();
    let truth = |scale: f64| -> Vec<Option<f64>> {
        (middles(&scene, "floor", texels).iter())
            .map(|p| {
                // Back along the reflected light to the mirror in the plane z = 0.
                let y = p.z * s.y / s.z;
                let x = p.x + p.z * s.x / s.z;
                // The sun's edge and a texel's diagonal blur the outline.
                let inside = x.abs() < 0.4 - 0.03 && (y - 0.5).abs() < 0.3 - 0.03;
                inside.then_some(scale * 0.9 * s.y)
            })
            .collect()
    };
    let error = error_where(&reference, &truth(1.0));
    assert!(error < 0.001, "{error}");
    let perturbed = error_where(&reference, &truth(1.002));
    assert!(perturbed > 0.001, "{perturbed}");

    let mirror_area = 0.8 * 0.6;
    for (flux, reflectance) in reference.received_flux.iter().zip([0.9, 0.8, 0.7]) {
        let exact = reflectance * s.z * mirror_area;
        assert!((flux / exact - 1.0).abs() < 1e-4, "{flux} {exact}");
    }
    // Dark where the image is not.
    let lit = (reference.irradiance.iter())
        .filter(|rgb| rgb[0] > 0.0)
        .count() as f64;
    let texel = 1.6 * 1.6 / 4096.0;
    let image = mirror_area * s.z / s.y;
    assert!((1.0..1.2).contains(&(lit * texel / image)), "{lit}");
}

/// Design, section 9 (e): a mirror ball in constant radiance, E = π L R² h / (h² + r²)^{3/2}.
#[test]
fn ball_in_constant_radiance() {
    let scene = load("ball.toml");
    let texels = [32, 32];
    let reference = solve(&scene, "floor", texels, &options(0.005));
    // Sums over rings around the ball, so that the noise of single texels does not count.
    let rings = |radius: f64| -> f64 {
        let (mut found, mut exact) = ([0.0; 6], [0.0; 6]);
        for (rgb, p) in reference
            .irradiance
            .iter()
            .zip(middles(&scene, "floor", texels))
        {
            let ring = (p.x.hypot(p.z) / 0.4) as usize;
            if ring < 6 {
                found[ring] += rgb[0];
                exact[ring] += texel_mean(p, 4.0 / 32.0, |r| {
                    PI * radius * radius / (1.0 + r * r).powf(1.5)
                });
            }
        }
        (found.iter().zip(&exact))
            .map(|(f, e)| (f / e - 1.0).abs())
            .fold(0.0, f64::max)
    };
    let error = rings(0.5);
    assert!(error < 0.003, "{error}");
    let perturbed = rings(0.502);
    assert!(perturbed > 0.005, "{perturbed}");
}

/// One bright texel of an environment is a small lamp: L Ω on a plane facing it.
#[test]
fn lamp_of_an_environment_gives_the_flux_of_a_sun() {
    let mut scene = load("mirror.toml");
    let (width, height, radiance) = (256, 128, 1000.0);
    let (column, row) = (109, 28);
    let mut map = EnvironmentMap {
        width,
        height,
        radiance: vec![[0.0; 3]; (width * height) as usize],
    };
    map.radiance[(row * width + column) as usize] = [radiance as f32; 3];
    scene.lights[0].kind = LightKind::Environment {
        map: Arc::new(map),
        scale: 1.0,
        rotation: 0.0,
    };
    let azimuth = TAU * (f64::from(column) + 0.5) / f64::from(width);
    let (sine, cosine) = (PI * (f64::from(row) + 0.5) / f64::from(height)).sin_cos();
    let toward = DVec3::new(sine * azimuth.sin(), cosine, -sine * azimuth.cos());
    let texel = TAU * PI * sine / f64::from(width * height);
    let flux = solve(&scene, "floor", [32, 32], &options(0.05)).received_flux[0];
    let exact = 0.9 * radiance * texel * toward.z * 0.8 * 0.6;
    // The lamp is a tent two texels wide, over which the cosine varies.
    assert!((flux / exact - 1.0).abs() < 2e-3, "{flux} {exact}");

    let LightKind::Environment { rotation, .. } = &mut scene.lights[0].kind else {
        unreachable!()
    };
    *rotation = 0.02;
    let turned = solve(&scene, "floor", [32, 32], &options(0.05)).received_flux[0];
    assert!((turned / exact - 1.0).abs() > 5e-3, "{turned} {exact}");
}

/// Design, section 9 (a): the envelope of parallel light in a circular mirror is the nephroid.
#[test]
fn ring_has_its_ridge_on_the_nephroid() {
    let scene = ring(0.61, false);
    let texels = [256, 256];
    let reference = solve(&scene, "floor", texels, &options(0.03));
    let map = image(&reference);
    let texels_off = ridge_off_nephroid(1.0, &map);
    assert!(texels_off < 1.0, "{texels_off}");
    let perturbed = ridge_off_nephroid(1.03, &map);
    assert!(perturbed > 1.0, "{perturbed}");
}

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
        let chi_squared = |scale: f64| -> f64 {
            let (mut sum, mut texels) = (0.0, 0.0);
            for i in 0..one.irradiance.len() {
                let variance = one.standard_error[i][0].powi(2) + two.standard_error[i][0].powi(2);
                // Well-lit texels, whose replicates are close to normal.
                if one.irradiance[i][0] > 0.01 && variance > 0.0 {
                    let difference = one.irradiance[i][0] - two.irradiance[i][0];
                    sum += difference * difference / (scale * scale * variance);
                    texels += 1.0;
                }
            }
            assert!(texels > 200.0, "{texels}");
            sum / texels
        };
        // 15 or more degrees of freedom in σ: mean ν/(ν − 2) ≤ 1.15 rather than 1.
        let honest = 0.85..1.3;
        assert!(
            honest.contains(&chi_squared(1.0)),
            "{name}: {}",
            chi_squared(1.0)
        );
        assert!(
            !honest.contains(&chi_squared(0.8)),
            "too small a bar passes"
        );
        assert!(
            !honest.contains(&chi_squared(1.25)),
            "too large a bar passes"
        );

        let difference = measure::compare(&image(&one), &image(&two))
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
        name: "plate".into(),
        material: scene.objects[1].material,
        geometry: Geometry::Rect(rect),
        light_map: None,
        blocks_light,
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

/// A ray meets the ring at azimuth φ and height h after a chord of 2 cosφ, and crosses as long a
/// chord after it. It comes in over the rim if h + 2k cosφ > H, k = tan(elevation), and reaches the
/// floor before the far side if h < 2k cosφ, so the floor inside receives
/// E cos(elevation) ∫ cosφ (min(H, 2k cosφ) − max(0, H − 2k cosφ)) dφ.
#[test]
fn a_ring_keeps_as_much_light_from_its_floor_as_its_rim_and_its_far_side_stop() {
    for elevation in [0.15, 0.3, 0.61_f64] {
        let scene = ring(elevation, true);
        let texels = [128, 128];
        let reference = solve(&scene, "floor", texels, &options(0.05));
        let steps = 100_000;
        let exact: f64 = (0..steps)
            .map(|i| {
                let cosine = (PI * ((f64::from(i) + 0.5) / f64::from(steps) - 0.5)).cos();
                let rise = 2.0 * elevation.tan() * cosine;
                let heights = RING_HEIGHT.min(rise) - (RING_HEIGHT - rise).max(0.0);
                elevation.cos() * cosine * heights.max(0.0) * PI / f64::from(steps)
            })
            .sum();
        let flux = reference.received_flux[0];
        assert!(
            (flux / exact - 1.0).abs() < 2e-3,
            "{elevation}: {flux} {exact}"
        );
        let open = solve(&ring(elevation, false), "floor", texels, &options(0.05));
        let perturbed = open.received_flux[0];
        assert!(
            (perturbed / exact - 1.0).abs() > 0.02,
            "{elevation}: {perturbed} {exact}"
        );
    }
}

#[test]
fn a_floor_blocks_light_from_below() {
    // A ring above the floor whose normals lean down, so that it throws light from below back.
    let scene = |blocks_light| {
        let mut scene = ring(0.61, blocks_light);
        if let LightKind::Sun { direction, .. } = &mut scene.lights[0].kind {
            direction.y = -direction.y;
        }
        if let Geometry::Mesh(mesh) = &mut scene.objects[0].geometry {
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
fn backs_neither_throw_nor_receive() {
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
        .map(|_| ())
        .map_err(|error| error.exit_code())
    };
    assert_eq!(run(1, [8, 8], 0.1, false), Ok(()));
    assert_eq!(run(1, [8, 8], 0.1, true), Err(130));
    for (receiver, texels, error) in [
        (0, [8, 8], 0.1),
        (7, [8, 8], 0.1),
        (1, [0, 8], 0.1),
        (1, [8, 100_000], 0.1),
        (1, [8, 8], 0.0),
        (1, [8, 8], f64::NAN),
        (1, [8, 8], -1.0),
    ] {
        assert_eq!(run(receiver, texels, error, false), Err(2));
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
