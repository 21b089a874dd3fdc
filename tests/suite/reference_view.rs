//! The reference's view against closed forms, then against itself. Every check is seen to fail on a
//! perturbed twin.

use crate::common::{
    assert_errors_are_honest, load, only_receiver, options, see, toward_sun, with_sun_of,
};
use glam::DVec3;
use nephroid::Error;
use nephroid::optics::fresnel_dielectric;
use nephroid::reference::{Options, View, view};
use nephroid::scene::{
    Camera, DEFAULT_MAX_INTERFACES, Dielectric, EnvironmentMap, Geometry, Light, LightKind,
    Material, MaterialKind, Mesh, Object, Rect, Scene,
};
use std::f64::consts::PI;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

const SIZE: [u32; 2] = [12, 8];

fn camera(position: [f64; 3], target: [f64; 3], fov_degrees: f64) -> Camera {
    Camera {
        position: position.into(),
        target: target.into(),
        fov: fov_degrees.to_radians(),
        exposure_ev: 0.0,
    }
}

/// A scene of one-material objects, none of which blocks light or has a light map.
fn scene(camera: Camera, lights: Vec<LightKind>, objects: Vec<(MaterialKind, Geometry)>) -> Scene {
    let mut scene = Scene {
        camera,
        lights: Vec::new(),
        materials: Vec::new(),
        objects: Vec::new(),
        max_interfaces: DEFAULT_MAX_INTERFACES,
        textures: Vec::new(),
    };
    for kind in lights {
        let name = format!("light {}", scene.lights.len());
        scene.lights.push(Light { name, kind });
    }
    for (kind, geometry) in objects {
        let material = scene.materials.len();
        let name = format!("material {material}");
        scene.materials.push(Material::new(name, kind));
        scene.objects.push(Object {
            blocks_light: false,
            ..Object::new(format!("object {material}"), material, geometry)
        });
    }
    scene
}

/// A horizontal square of 200 m around (0, height, 0) that faces up or down.
fn square(height: f64, up: bool) -> Geometry {
    let (x, z) = (200.0 * DVec3::X, 200.0 * DVec3::Z);
    let origin = DVec3::new(-100.0, height, -100.0);
    let (edge_u, edge_v) = if up { (z, x) } else { (x, z) };
    Geometry::Rect(Rect {
        origin,
        edge_u,
        edge_v,
    })
}

fn diffuse(albedo: f64) -> MaterialKind {
    MaterialKind::Diffuse {
        albedo: DVec3::splat(albedo),
    }
}

fn sun(direction: [f64; 3], irradiance: f64, degrees: f64) -> LightKind {
    LightKind::Sun {
        direction: DVec3::from(direction).normalize(),
        irradiance: DVec3::splat(irradiance),
        angular_radius: f64::to_radians(degrees),
    }
}

/// Of this radiance from above and from below.
fn sky(above: f32, below: f32) -> LightKind {
    let (width, height) = (16, 8);
    let row = |row: u32| [if row < height / 2 { above } else { below }; 3];
    LightKind::Environment {
        map: Arc::new(EnvironmentMap {
            width,
            height,
            radiance: (0..width * height).map(|i| row(i / width)).collect(),
        }),
        scale: 1.0,
        rotation: 0.0,
        casts_caustics: true,
    }
}

/// Largest |L/L* − 1| in red.
fn worst(view: &View, exact: f64) -> f64 {
    (view.radiance.iter())
        .map(|rgb| (rgb[0] / exact - 1.0).abs())
        .fold(0.0, f64::max)
}

/// Mean over the pixels of ((L − L*)/σ)², and (mean L − L*) over its standard error, in red.
fn deviations(view: &View, exact: f64) -> (f64, f64) {
    let n = view.radiance.len() as f64;
    let (mut squares, mut sum, mut variance) = (0.0, 0.0, 0.0);
    for (rgb, sigma) in view.radiance.iter().zip(&view.standard_error) {
        assert!(sigma[0] > 0.0, "no noise");
        squares += ((rgb[0] - exact) / sigma[0]).powi(2) / n;
        sum += rgb[0] - exact;
        variance += sigma[0].powi(2);
    }
    (squares, sum / variance.sqrt())
}

/// σ is from 15 degrees of freedom: mean ν/(ν − 2) = 1.15. With 96 pixels it is within 0.7 and 1.7.
fn assert_within_errors(name: &str, view: &View, exact: f64, least_relative_error: f64) {
    let (squares, mean) = deviations(view, exact);
    assert!((0.7..1.7).contains(&squares), "{name}: {squares}");
    assert!(mean.abs() < 4.0, "{name}: {mean} standard errors");
    assert!(
        view.relative_error <= least_relative_error,
        "{name}: {}",
        view.relative_error
    );
    // A percent more is seen.
    let (_, twin) = deviations(view, 1.01 * exact);
    assert!(
        twin.abs() > 4.0,
        "{name}: a twin passes with {twin} standard errors"
    );
}

#[test]
fn plane_under_a_sun() {
    let exact = 0.6 / PI * 3.0 * DVec3::new(0.3, 0.8, 0.5).normalize().y;
    let at = |irradiance| {
        let floor = (diffuse(0.6), square(0.0, true));
        let camera = camera([0.0, 2.0, 3.0], [0.0, 0.0, 0.0], 40.0);
        let sun = sun([0.3, 0.8, 0.5], irradiance, 0.0);
        worst(
            &see(&scene(camera, vec![sun], vec![floor]), SIZE, &options(0.5)),
            exact,
        )
    };
    assert!(at(3.0) < 1e-12, "{}", at(3.0));
    assert!(at(3.00001) > 1e-12);
}

/// A wide sun gives the irradiance of a point in its middle, with noise, where all of it is above the horizon.
#[test]
fn plane_under_a_wide_sun_and_a_lamp() {
    let floor = || vec![(diffuse(0.5), square(0.0, true))];
    let looking_down = || camera([0.0, 1.0, 1e-3], [0.0, 0.0, 0.0], 0.01);
    let wide = sun([0.0, 0.8, 0.6], 2.0, 30.0);
    let seen = see(
        &scene(looking_down(), vec![wide], floor()),
        SIZE,
        &options(0.004),
    );
    assert_within_errors("wide sun", &seen, 0.5 / PI * 2.0 * 0.8, 0.004);

    // Φ cosθ/(4π d²), for a sphere as for a point; from (0.3, 0.4, 0) to the origin.
    let lamp = LightKind::Lamp {
        position: DVec3::new(0.3, 0.4, 0.0),
        radius: 0.2,
        radiant_flux: DVec3::splat(7.0),
    };
    let seen = see(
        &scene(looking_down(), vec![lamp], floor()),
        SIZE,
        &options(0.004),
    );
    let irradiance = 7.0 * 0.8 / (4.0 * PI * 0.25);
    assert_within_errors("lamp", &seen, 0.5 / PI * irradiance, 0.004);
}

#[test]
fn lamps_and_suns_themselves() {
    let lamp = |flux| LightKind::Lamp {
        position: DVec3::ZERO,
        radius: 0.5,
        radiant_flux: DVec3::splat(flux),
    };
    let looking = || camera([0.0, 0.0, 4.0], [0.0, 0.0, 0.0], 3.0);
    // The lamp hides the sun behind it, and a wall at its back, and is hidden by one before it.
    let behind = sun([0.0, 0.0, -1.0], 1.0, 10.0);
    let wall = |z: f64| {
        let rect = Rect {
            origin: DVec3::new(-9.0, -9.0, z),
            edge_u: 18.0 * DVec3::X,
            edge_v: 18.0 * DVec3::Y,
        };
        (diffuse(0.5), Geometry::Rect(rect))
    };
    let radiance = 7.0 / (4.0 * PI * PI * 0.25);
    for (objects, exact) in [
        (vec![], radiance),
        (vec![wall(-1.0)], radiance),
        (vec![wall(1.0)], 0.0),
    ] {
        let seen = see(
            &scene(looking(), vec![lamp(7.0), behind.clone()], objects),
            SIZE,
            &options(0.1),
        );
        assert!(
            seen.radiance
                .iter()
                .all(|rgb| (rgb[0] - exact).abs() <= 1e-12 * radiance)
        );
    }
    // Without the lamp the sun: E/(π sin²α), and black beside it.
    let exact = 1.0 / (PI * 10f64.to_radians().sin().powi(2));
    for (target, exact) in [([0.0, 0.0, 0.0], exact), ([1.0, 0.0, 0.0], 0.0)] {
        let mut at = looking();
        at.target = target.into();
        let seen = see(
            &scene(at, vec![behind.clone()], vec![]),
            SIZE,
            &options(0.1),
        );
        assert!(
            seen.radiance
                .iter()
                .all(|rgb| (rgb[0] - exact).abs() <= 1e-12 * exact)
        );
    }
}

/// Under an even sky a white convex body is as bright as the sky.
#[test]
fn furnace() {
    let ball = load("globe.toml");
    let ball = &ball.objects[ball.object_index("globe").unwrap()];
    let ball = ball.geometry.as_mesh().unwrap();
    // With the normals of its facets, so that no light is lost at the horizon of interpolated ones.
    let mut facets = Mesh::default();
    for triangle in 0..ball.triangles.len() {
        let first = facets.positions.len() as u32;
        facets.positions.extend(ball.corners(triangle));
        facets
            .normals
            .extend([ball.vector_area(triangle).normalize(); 3]);
        facets.triangles.push([first, first + 1, first + 2]);
    }
    let [low, high] = facets.bounds();
    let middle = 0.5 * (low + high);
    let body = |albedo| {
        let at = Camera {
            position: middle + DVec3::new(0.5, 0.3, 3.0),
            target: middle,
            ..camera([0.0; 3], [0.0; 3], 10.0)
        };
        let mesh = Geometry::Mesh(Arc::new(facets.clone()));
        let mut scene = scene(at, vec![sky(1.0, 1.0)], vec![(diffuse(albedo), mesh)]);
        scene.objects[0].blocks_light = true;
        see(&scene, [24, 16], &options(0.005))
    };
    let judge = |view: &View| {
        // Pixels of the background have no noise.
        let (mut squares, mut sum, mut variance, mut count) = (0.0, 0.0, 0.0, 0.0);
        for (rgb, sigma) in view.radiance.iter().zip(&view.standard_error) {
            if sigma[0] == 0.0 {
                assert_eq!(rgb[0], 1.0);
                continue;
            }
            squares += ((rgb[0] - 1.0) / sigma[0]).powi(2);
            sum += rgb[0] - 1.0;
            variance += sigma[0].powi(2);
            count += 1.0;
        }
        assert!(count > 60.0, "{count} pixels of the body");
        (squares / count, sum / f64::sqrt(variance))
    };
    let (squares, mean) = judge(&body(1.0));
    assert!((0.7..1.7).contains(&squares), "{squares}");
    assert!(mean.abs() < 4.0, "{mean} standard errors");
    let (_, twin) = judge(&body(0.99));
    assert!(twin < -4.0, "{twin}");
}

/// Half an even sky over a floor that a wall without light hides half of: L/2 · albedo where they meet.
#[test]
fn a_wall_hides_half_of_the_sky() {
    let wall = Rect {
        origin: DVec3::new(-1e4, 0.0, 0.0),
        edge_u: 2e4 * DVec3::X,
        edge_v: 1e4 * DVec3::Y,
    };
    let objects = vec![
        (diffuse(0.5), square(0.0, true)),
        (diffuse(0.0), Geometry::Rect(wall)),
    ];
    // Sees the floor within 0.3 mm of the wall.
    let camera = camera([0.0, 1.0, 1.0], [0.0, 0.0, 1e-4], 0.003);
    let mut scene = scene(camera, vec![sky(2.0, 0.0)], objects);
    scene.objects[1].blocks_light = true;
    let seen = see(&scene, SIZE, &options(0.004));
    let upper_half = |exact: f64| deviations(&seen, exact);
    // The map's bilinear horizon: half a row above it the radiance falls to half.
    let horizon = horizon_loss();
    let exact = 0.5 * 0.5 * 2.0 * (1.0 - horizon);
    let (squares, mean) = upper_half(exact);
    assert!((0.7..1.7).contains(&squares), "{squares}");
    assert!(mean.abs() < 4.0, "{mean} standard errors");
    assert!(upper_half(1.01 * exact).1.abs() > 4.0);
}

/// Share of the irradiance from above that the map of [`sky`] lacks, as its upper half ends half a row above
/// the horizon and falls linearly to 0 half a row below: ∫ 2 cosθ sinθ (1 − L) dθ over that.
fn horizon_loss() -> f64 {
    let row = PI / 8.0;
    let steps = 10_000;
    (0..steps)
        .map(|i| {
            let above = (f64::from(i) + 0.5) / f64::from(steps) * 0.5 * row;
            let missing = 0.5 - above / row;
            2.0 * above.sin() * above.cos() * missing * 0.5 * row / f64::from(steps)
        })
        .sum()
}

/// A mirror that faces the camera and reflects the sun behind it.
#[test]
fn mirror_shows_the_background() {
    let mirror = |reflectance: f64| {
        let kind = MaterialKind::Mirror {
            reflectance: DVec3::new(reflectance, 0.5, 0.25),
        };
        let rect = Geometry::Rect(Rect {
            origin: DVec3::new(-9.0, -9.0, 0.0),
            edge_u: 18.0 * DVec3::X,
            edge_v: 18.0 * DVec3::Y,
        });
        let camera = camera([1.0, 0.5, 3.0], [0.0, 0.0, 0.0], 2.0);
        // A ray along (−1, −0.5, −3) goes on along (−1, −0.5, 3).
        let sun = sun([-1.0, -0.5, 3.0], 1.0, 5.0);
        see(
            &scene(camera, vec![sun], vec![(kind, rect)]),
            SIZE,
            &options(0.1),
        )
    };
    let radiance = 1.0 / (PI * 5f64.to_radians().sin().powi(2));
    assert!(worst(&mirror(0.8), 0.8 * radiance) < 1e-12);
    assert!(worst(&mirror(0.80001), 0.8 * radiance) > 1e-12);
    let [_, green, blue] = mirror(0.8).radiance[0];
    assert!((green / radiance - 0.5).abs() < 1e-12 && (blue / radiance - 0.25).abs() < 1e-12);
}

/// A plate of glass lets (1 − F)/(1 + F) through, the sum over all reflections inside.
#[test]
fn plate_of_glass() {
    let glass = || MaterialKind::Dielectric(Dielectric::new(1.5));
    let plate = vec![(glass(), square(0.0, true)), (glass(), square(-0.1, false))];
    let cosine = 0.35f64;
    let eye = [0.0, cosine, (1.0 - cosine * cosine).sqrt()];
    let camera = camera(eye, [0.0; 3], 1e-4);
    let lit_from_below = scene(camera.clone(), vec![sky(0.0, 1.0)], plate.clone());
    let seen = see(&lit_from_below, SIZE, &options(0.001));
    let f = fresnel_dielectric(cosine, 1.0 / 1.5);
    assert!(f > 0.15, "{f}");
    // After the first two surfaces one path is followed.
    assert_within_errors("plate", &seen, (1.0 - f) / (1.0 + f), 0.001);

    // Light from both sides: all of it arrives, and each path carries the whole.
    let furnace = see(
        &scene(camera, vec![sky(1.0, 1.0)], plate),
        SIZE,
        &options(0.01),
    );
    // 12 surfaces leave less than F^10 behind.
    assert!(
        worst(&furnace, 1.0) < f.powi(10),
        "{}",
        worst(&furnace, 1.0)
    );
}

/// A floor under still water, whose surface casts no shadow: direct light E, the caustic (1 − F) E through
/// the surface, and (1 − F′)/n² of the radiance back to the camera.
#[test]
fn floor_under_water() {
    let water = MaterialKind::Dielectric(Dielectric::new(1.33));
    let s = DVec3::new(0.6, 0.8, 0.0);
    let cosine = 0.7f64;
    let eye = [0.0, cosine, (1.0 - cosine * cosine).sqrt()];
    let with = |light_map| {
        let objects = vec![
            (water.clone(), square(0.0, true)),
            (diffuse(0.5), square(-0.2, true)),
        ];
        let camera = camera(eye, [0.0; 3], 1.0);
        let mut scene = scene(camera, vec![sun(s.to_array(), 2.0, 0.0)], objects);
        // Of both only a small part is needed.
        for object in &mut scene.objects {
            let Geometry::Rect(rect) = &mut object.geometry else {
                panic!();
            };
            for part in [&mut rect.origin.x, &mut rect.origin.z] {
                *part *= 0.005;
            }
            rect.edge_u *= 0.005;
            rect.edge_v *= 0.005;
        }
        scene.objects[1].light_map = light_map;
        scene
    };
    // As seen along the middle of the picture; over it, F′ varies.
    let back = |cosine: f64| (1.0 - fresnel_dielectric(cosine, 1.0 / 1.33)) / (1.33 * 1.33);
    let as_in_the_middle = |mut view: View| {
        let pixels = (view.radiance.iter_mut()).zip(&mut view.standard_error);
        for ((radiance, sigma), pixel) in pixels.zip(0..) {
            let factor = back(cosine) / back(-direction(&with(None).camera, pixel).y);
            *radiance = radiance.map(|value| factor * value);
            *sigma = sigma.map(|value| factor * value);
        }
        view
    };
    let direct = 0.5 / PI * 2.0 * s.y * back(cosine);
    let without = as_in_the_middle(see(&with(None), SIZE, &options(0.1)));
    assert!(
        worst(&without, direct) < 1e-4,
        "{}",
        worst(&without, direct)
    );
    assert!(worst(&without, 1.001 * direct) > 1e-4);

    let seen = as_in_the_middle(see(&with(Some([64, 64])), SIZE, &options(0.008)));
    let through = 1.0 - fresnel_dielectric(s.y, 1.0 / 1.33);
    assert_within_errors("floor under water", &seen, direct * (1.0 + through), 0.008);
}

/// Of the ray through the middle of a pixel, unit.
fn direction(camera: &Camera, pixel: u32) -> DVec3 {
    let forward = (camera.target - camera.position).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let half = (0.5 * camera.fov).tan();
    let [width, height] = SIZE.map(f64::from);
    let x = 2.0 * (f64::from(pixel % SIZE[0]) + 0.5) / width - 1.0;
    let y = 1.0 - 2.0 * (f64::from(pixel / SIZE[0]) + 0.5) / height;
    (forward + half * (x * width / height * right + y * right.cross(forward))).normalize()
}

/// The part of the floor that both the sun and the mirror light, in the camera and in the mirror.
#[test]
fn caustic_of_a_flat_mirror() {
    let mut scene = with_sun_of(load("mirror.toml"), 0.0);
    let s = toward_sun(&scene);
    // Back along the reflected light from the middle of the mirror to the floor.
    let middle = DVec3::new(0.0, 0.5, 0.0);
    let toward = DVec3::new(-s.x, -s.y, s.z);
    let lit = middle + 0.5 / s.y * toward;
    scene.camera = camera(
        (lit + DVec3::new(0.2, 0.6, 0.9)).to_array(),
        lit.to_array(),
        3.0,
    );
    let exact = 0.75 / PI * s.y * (1.0 + 0.9);
    let seen = see(&scene, SIZE, &options(0.008));
    assert_within_errors("caustic", &seen, exact, 0.008);
    // In a mirror behind it.
    scene.camera.position.y = -scene.camera.position.y;
    let mut above = scene.clone();
    let ceiling = square(0.0, true).moved(&nephroid::scene::Similarity {
        scale: 1e-2,
        rotation: glam::DMat3::from_rotation_x(PI),
        shift: DVec3::new(lit.x, 2.0, lit.z),
    });
    above.objects.push(Object {
        blocks_light: false,
        ..Object::new("ceiling", 0, ceiling)
    });
    // Its image at y = 4 is looked at from below the ceiling and above the floor.
    above.camera = camera(
        (lit + DVec3::new(0.2, 1.0, 0.9)).to_array(),
        (lit + DVec3::new(0.0, 4.0, 0.0)).to_array(),
        1.0,
    );
    // The ceiling casts no caustic onto what the sun sends down.
    let seen = see(&above, SIZE, &options(0.008));
    assert_within_errors("caustic in a mirror", &seen, 0.9 * exact, 0.008);

    // What has no light map has no caustic.
    let without = see(
        &only_receiver(above.clone(), "none", [8, 8]),
        SIZE,
        &options(0.1),
    );
    assert!(worst(&without, 0.9 * 0.75 / PI * s.y) < 1e-12);
}

/// (L₁ − L₂)² / (σ₁² + σ₂²) has mean 1 over pixels, if the standard errors are honest.
#[test]
fn error_bars_are_what_two_seeds_differ_by() {
    for (name, error) in [("ring.toml", 0.03), ("table.toml", 0.03)] {
        let scene = load(name);
        let run = |seed| {
            let options = Options {
                seed,
                ..options(error)
            };
            see(&scene, [48, 27], &options)
        };
        let (one, two) = (run(1), run(2));
        let solutions = [&one, &two].map(|of| [&of.radiance[..], &of.standard_error[..]]);
        assert_errors_are_honest(name, solutions);
    }
}

#[test]
fn the_same_seed_gives_the_same_bits_on_one_thread_and_on_several() {
    let scene = load("ball.toml");
    let run = |threads| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads);
        (pool.build().unwrap()).install(|| see(&scene, [16, 9], &options(0.1)))
    };
    let (one, three) = (run(1), run(3));
    assert_eq!(one.radiance, three.radiance);
    assert_eq!(one.standard_error, three.standard_error);
    assert_eq!(one.samples, three.samples);
}

#[test]
fn asking_for_nonsense_is_refused_and_cancelling_stops() {
    let scene = load("mirror.toml");
    let run = |size, error, cancel| {
        let cancel = AtomicBool::new(cancel);
        view(&scene, size, &options(error), &mut |_| {}, &cancel)
    };
    assert!(run([4, 4], 0.5, false).is_ok());
    assert!(matches!(run([4, 4], 0.5, true), Err(Error::Cancelled)));
    for (size, error) in [
        ([0, 8], 0.1),
        ([8, 0], 0.1),
        ([100_000, 8], 0.1),
        ([u32::MAX; 2], 0.1),
        ([8, 8], 0.0),
        ([8, 8], f64::NAN),
    ] {
        assert!(
            matches!(run(size, error, false), Err(Error::Usage { .. })),
            "{size:?}"
        );
    }
}

#[test]
fn a_scene_without_light_is_dark_and_ends() {
    let mut dark = load("mirror.toml");
    dark.lights.clear();
    let seen = see(&dark, SIZE, &options(0.001));
    assert!(seen.radiance.iter().all(|rgb| *rgb == [0.0; 3]));
    assert_eq!(seen.relative_error, 0.0);
}
