//! Lamps: spheres of light at a finite distance, against the reference, against suns, and against
//! closed forms of their direct light. What flat and round mirrors reflect of them is in
//! `closed_forms.rs`.

use crate::common::{
    Device, assert_error, assert_error_beyond_noise, assert_physical, brighter, floor, footprint,
    l1, l1_noise, load, method, middles, object_mut, only_receiver, options, rect, scaled, solve,
    toward_sun, with_texels,
};
use glam::DVec3;
use nephroid::image_file::RgbImage;
use nephroid::render::Method;
use nephroid::scene::{Geometry, LightKind, MaterialKind, Object, Rect, Scene};
use std::f64::consts::PI;

/// Width of the opening of the bowl, m.
const BOWL: f64 = 0.23;

/// `lamp.toml` without its box, the lamp `sizes` times the bowl's width from the bottom of the bowl,
/// and so much stronger that the bowl gets as much light.
fn bowl(sizes: f64, texels: u32) -> Scene {
    let mut scene = only_receiver(load("lamp.toml"), "table", [texels; 2]);
    (scene.objects).retain(|object| ["bowl", "table"].contains(&object.name.as_str()));
    let bottom = DVec3::new(0.0, 0.117, -0.18);
    if let LightKind::Lamp {
        position,
        radiant_flux,
        ..
    } = &mut scene.lights[0].kind
    {
        *position = bottom + sizes * BOWL * (*position - bottom).normalize();
        *radiant_flux *= sizes * sizes;
    }
    scene
}

/// Of the first light, a lamp: (position, radius, flux in red).
fn lamp(scene: &Scene) -> (DVec3, f64, f64) {
    match scene.lights[0].kind {
        LightKind::Lamp {
            position,
            radius,
            radiant_flux,
        } => (position, radius, radiant_flux.x),
        _ => panic!("the first light is no lamp"),
    }
}

fn with_lamp(mut scene: Scene, position: DVec3, radius: f64, watts: f64) -> Scene {
    scene.lights[0].kind = LightKind::Lamp {
        position,
        radius,
        radiant_flux: DVec3::splat(watts),
    };
    scene
}

#[test]
fn footprints_of_the_bowl_with_the_lamp_near_and_far() {
    let device = Device::open();
    for sizes in [1.0, 2.0, 5.0, 20.0] {
        let scene = bowl(sizes, 128);
        let reference = solve(&scene, "table", [128; 2], &options(0.016));
        let (truth, noise) = (reference.image(), l1_noise(&reference));
        let map = |scene: &Scene| {
            let map = device.caustic(scene, "table", &footprint(16_384));
            assert_physical(&map);
            map
        };
        let what = format!("bowl, lamp at {sizes} times its width, L1");
        let found = map(&scene);
        for perturbed in [scaled(&found, 1.05), map(&bowl(0.9 * sizes, 128))] {
            let [found, perturbed] = [&found, &perturbed].map(|map| l1(map, &truth));
            assert_error_beyond_noise(&what, 0.03, noise, found, perturbed);
        }
    }
}

/// Points, too, converge to the reference where the lamp is as near as the bowl is wide.
#[test]
fn points_of_the_bowl() {
    let device = Device::open();
    let scene = bowl(1.0, 64);
    let truth = solve(&scene, "table", [64; 2], &options(0.01)).image();
    let map = device.caustic(&scene, "table", &method(Method::Points, 2_000_000));
    let [error, bright] = [1.0, 1.05].map(|factor| l1(&scaled(&map, factor), &truth));
    assert_error("bowl, points, L1", 0.03, error, bright);
}

/// A lamp far away is a sun of its irradiance and angular radius.
#[test]
fn a_distant_lamp_is_a_sun() {
    const DISTANCE: f64 = 1e5;
    let device = Device::open();
    let sun = only_receiver(load("ring.toml"), "floor", [128; 2]);
    let LightKind::Sun {
        direction,
        irradiance,
        angular_radius,
    } = sun.lights[0].kind
    else {
        panic!("the ring has a sun")
    };
    let lamp = |distance: f64| {
        let mut scene = sun.clone();
        scene.lights[0].kind = LightKind::Lamp {
            position: distance * direction,
            radius: distance * angular_radius.sin(),
            radiant_flux: 4.0 * PI * distance * distance * irradiance,
        };
        scene
    };
    for method_ in [Method::Footprint, Method::Beams, Method::Points] {
        let map = |scene: &Scene| device.caustic(scene, "floor", &method(method_, 65_536));
        let truth = map(&sun);
        let [far, near] = [DISTANCE, 30.0].map(|distance| l1(&map(&lamp(distance)), &truth));
        assert_error(&format!("distant lamp, {method_:?}"), 0.001, far, near);
    }
    let coarse = |scene: &Scene| with_texels(scene.clone(), "floor", [32; 2]);
    let gather = |scene| device.caustic(&coarse(&scene), "floor", &method(Method::Pinhole, 1024));
    let truth = gather(sun.clone());
    let [far, near] = [DISTANCE, 30.0].map(|distance| l1(&gather(lamp(distance)), &truth));
    assert_error("distant lamp, pinhole", 0.001, far, near);
    let direct = |scene| device.direct(&coarse(&scene), "floor");
    let truth = direct(sun.clone());
    let [far, near] = [DISTANCE, 30.0].map(|distance| l1(&direct(lamp(distance)), &truth));
    assert_error("distant lamp, direct", 0.001, far, near);
    // The same rays of the reference would be other points, so its noise counts.
    let solve = |scene: &Scene| solve(scene, "floor", [16; 2], &options(0.002)).image();
    let truth = solve(&sun);
    let [far, near] = [DISTANCE, 30.0].map(|distance| l1(&solve(&lamp(distance)), &truth));
    assert_error("distant lamp, reference", 0.004, far, near);
}

/// E does not depend on where a scene is and how large, with a lamp's flux as its area.
#[test]
fn place_and_size_do_not_matter() {
    let device = Device::open();
    let scene = bowl(1.3, 128);
    let map = |scene: &Scene| device.caustic(scene, "table", &footprint(16_384));
    let here = map(&scene);
    for (what, scale, shift) in [
        ("moved by 2 km", 1.0, 1e3 * DVec3::new(1.0, -1.0, 0.7)),
        ("a thousand times", 1e3, DVec3::ZERO),
        ("a thousandth", 1e-3, DVec3::ZERO),
    ] {
        let there = scene.clone().transformed(scale, shift);
        let perturbed = map(&brighter(there.clone(), 1.005));
        let what = format!("bowl, {what}, L1");
        assert_error(&what, 0.002, l1(&map(&there), &here), l1(&perturbed, &here));
    }
}

/// A floor of 2 m and a lamp over it, with nothing else.
fn open_floor(position: DVec3, radius: f64, texels: u32) -> Scene {
    let mut scene = load("mirror.toml");
    scene.objects.remove(0);
    scene.objects[0].geometry = floor(1.0, 0.0);
    scene.objects[0].light_map = Some([texels; 2]);
    with_lamp(scene, position, radius, 10.0)
}

/// Largest |E/E* − 1| over the texels of the floor that `counts`, E* = Φ cosθ / 4πd².
fn worst(scene: &Scene, map: &RgbImage, counts: impl Fn(DVec3) -> bool) -> f64 {
    let (position, _, watts) = lamp(scene);
    let errors: Vec<f64> = (middles(scene, "floor", [map.width, map.height]).iter())
        .zip(&map.pixels)
        .filter(|(p, _)| counts(**p))
        .map(|(p, rgb)| {
            let way = position - *p;
            let exact = watts * way.normalize().y / (4.0 * PI * way.length_squared());
            (f64::from(rgb[0]) / exact - 1.0).abs()
        })
        .collect();
    assert!(errors.len() > 200, "{} texels", errors.len());
    errors.into_iter().fold(0.0, f64::max)
}

/// Exact for wide lamps, too, as long as the floor sees all of them.
#[test]
fn open_floor_under_a_lamp() {
    let device = Device::open();
    for (height, radius) in [(0.8, 0.01), (0.8, 0.2), (0.5, 0.3)] {
        let scene = open_floor(DVec3::new(0.2, height, -0.1), radius, 64);
        let error = |scene: &Scene| {
            let map = device.direct(scene, "floor");
            assert_physical(&map);
            worst(&open_floor(lamp(scene).0, radius, 64), &map, |_| true)
        };
        let perturbed = error(&brighter(scene.clone(), 1.01));
        let what = format!("lamp of {radius} m at {height} m over a floor");
        assert_error(&what, 0.003, error(&scene), perturbed);
    }
}

fn plate(y: f64, half: f64, material: usize) -> Object {
    Object::new("plate", material, floor(half, y))
}

/// A plate below the lamp casts its shadow, from the lamp's place; one above the lamp casts none.
#[test]
fn shadow_under_a_lamp() {
    let device = Device::open();
    let (height, radius) = (1.0, 0.02);
    let mut scene = open_floor(height * DVec3::Y, radius, 64);
    scene
        .objects
        .push(plate(0.5, 0.2, scene.objects[0].material));
    let map = device.direct(&scene, "floor");
    // Twice as wide as the plate, half a shadow of 0.02 m, and texels of 0.03 m.
    let span = |p: DVec3| p.x.abs().max(p.z.abs());
    let dark = |p: DVec3| span(p) < 0.4 - 0.06;
    let lit = |p: DVec3| span(p) > 0.4 + 0.06;
    let (mut hidden, mut count) = (0, 0);
    for (p, rgb) in middles(&scene, "floor", [64; 2]).iter().zip(&map.pixels) {
        count += u32::from(dark(*p));
        hidden += u32::from(dark(*p) && *rgb == [0.0; 3]);
    }
    assert!(
        count > 200 && hidden == count,
        "{hidden} of {count} are dark"
    );
    assert!(worst(&scene, &map, lit) < 0.01);
    // Above the lamp it changes nothing, however near.
    for above in [1.0001 * radius, 0.5, 1e3] {
        *object_mut(&mut scene, "plate") = plate(height + above, 0.2, scene.objects[0].material);
        let open = device.direct(&scene, "floor");
        assert!(worst(&scene, &open, |_| true) < 0.01, "{above}");
    }
}

/// Light of a lamp by way of a mirror is stopped by what stands before the lamp and not by what is
/// behind it, and a floor stops what comes from below.
#[test]
fn only_what_is_before_the_lamp_blocks() {
    let device = Device::open();
    let position = DVec3::new(0.3, 2.0, 0.6);
    let scene = with_texels(load("mirror.toml"), "floor", [32; 2]);
    let scene = with_lamp(scene, position, 0.05, 10.0);
    let fluxes = |scene: &Scene| {
        let sum = |map: RgbImage| map.pixels.iter().map(|rgb| f64::from(rgb[0])).sum::<f64>();
        let by_renderer = [
            Method::Footprint,
            Method::Beams,
            Method::Points,
            Method::Pinhole,
        ];
        let mut sums: Vec<f64> = (by_renderer.iter())
            .map(|of| sum(device.caustic(scene, "floor", &method(*of, 2048))))
            .collect();
        sums.push(sum(solve(scene, "floor", [32; 2], &options(0.1)).image()));
        sums
    };
    let open = fluxes(&scene);
    assert!(open.iter().all(|flux| *flux > 1.0), "{open:?}");
    let with_plate = |y: f64| {
        let mut scene = scene.clone();
        scene.objects.push(plate(y, 3.0, 1));
        fluxes(&scene)
    };
    // Only the device's origin moves with the plate.
    for (with_plate, open) in with_plate(position.y + 0.051).iter().zip(&open) {
        assert!(
            (with_plate / open - 1.0).abs() < 1e-6,
            "{with_plate} {open}"
        );
    }
    assert_eq!(with_plate(position.y - 0.051), [0.0; 5]);

    // The lamp below the floor, and a mirror that casts no shadow.
    let below = position * DVec3::new(1.0, -1.0, 1.0);
    let mut scene = with_lamp(scene, below, 0.05, 10.0);
    object_mut(&mut scene, "mirror").blocks_light = false;
    if let Geometry::Rect(mirror) = &mut object_mut(&mut scene, "mirror").geometry {
        // Turned so that it reflects light from below down.
        mirror.edge_v = DVec3::new(0.0, 0.4, 0.45);
    }
    assert_eq!(fluxes(&scene), [0.0; 5]);
    object_mut(&mut scene, "floor").blocks_light = false;
    let open = fluxes(&scene);
    assert!(open.iter().all(|flux| *flux > 0.1), "{open:?}");
}

/// The camera sees a disc of the radiance Φ/4π²R², before what is behind it and behind what is
/// before it, and so does a mirror.
#[test]
fn a_lamp_is_seen() {
    let device = Device::open();
    let (radius, watts) = (0.1, 3.0);
    let radiance = watts / (4.0 * PI * PI * radius * radius);
    let position = DVec3::new(0.0, 1.5, 0.4);
    let mut scene = with_lamp(load("mirror.toml"), position, radius, watts);
    scene.camera.position = DVec3::new(0.0, 1.0, 2.0);
    let look = |scene: &Scene, target: DVec3, degrees: f64| {
        let mut camera = scene.camera.clone();
        (camera.target, camera.fov) = (target, f64::to_radians(degrees));
        let mut renderer = device.renderer(scene, &footprint(4096));
        renderer.view(&camera, [64; 2], 1).unwrap();
        renderer.read_view().unwrap()
    };
    let middle = |view: &RgbImage| f64::from(view.pixels[32 * 64 + 32][0]);
    let error = |found: f64| (found / radiance - 1.0).abs();

    let view = look(&scene, position, 20.0);
    assert_error(
        "view of a lamp",
        1e-5,
        error(middle(&view)),
        error(1.001 * middle(&view)),
    );
    // As many pixels as its disc has: of the tangent cone, in units of a pixel.
    let bright = view
        .pixels
        .iter()
        .filter(|rgb| error(f64::from(rgb[0])) < 1e-5);
    let distance = position.distance(scene.camera.position);
    let across = radius / (distance * distance - radius * radius).sqrt();
    let pixels = PI * (across / 10f64.to_radians().tan() * 32.0).powi(2);
    let count = bright.count() as f64;
    assert!(
        (count / pixels - 1.0).abs() < 0.03,
        "{count} pixels, {pixels}"
    );

    // The mirror in the plane z = 0 shows it at −z.
    if let MaterialKind::Mirror { reflectance } = &mut scene.materials[0].kind {
        *reflectance = DVec3::ONE;
    }
    scene.camera.position = DVec3::new(0.0, 0.1, 2.0);
    let low = with_lamp(scene.clone(), DVec3::new(0.0, 0.9, 0.4), radius, watts);
    let mirrored = middle(&look(&low, DVec3::new(0.0, 0.9, -0.4), 20.0));
    assert_error(
        "lamp in a mirror",
        1e-5,
        error(mirrored),
        error(1.001 * mirrored),
    );

    // A screen before it hides it, one behind it does not.
    scene.camera.position = DVec3::new(0.0, 1.0, 2.0);
    for (z, hides) in [(0.6, true), (0.2, false)] {
        let mut scene = scene.clone();
        let mut screen = plate(0.0, 3.0, 1);
        screen.geometry = Geometry::Rect(Rect {
            origin: DVec3::new(-3.0, 0.9, z),
            edge_u: 6.0 * DVec3::X,
            edge_v: 3.0 * DVec3::Y,
        });
        scene.objects.push(screen);
        let seen = middle(&look(&scene, position, 20.0));
        assert_eq!(error(seen) > 0.5, hides, "screen at {z}: {seen}");
    }
}

/// What the formulas of the lamp rest on, by a sum over its surface: Φ/4πd² on a plane that faces it,
/// times the cosine on one that does not.
#[test]
fn a_sphere_of_even_radiance_gives_what_a_point_gives() {
    let (radius, distance, watts) = (0.3f64, 0.5, 7.0);
    let radiance = watts / (4.0 * PI * PI * radius * radius);
    for tilt in [0.0f64, 0.7] {
        let normal = DVec3::new(tilt.sin(), tilt.cos(), 0.0);
        let steps = 1000;
        let mut irradiance = 0.0;
        for i in 0..steps {
            let cosine = 1.0 - 2.0 * (f64::from(i) + 0.5) / f64::from(steps);
            let sine = (1.0 - cosine * cosine).sqrt();
            for j in 0..steps {
                let (y, x) = (2.0 * PI * (f64::from(j) + 0.5) / f64::from(steps)).sin_cos();
                let out = DVec3::new(sine * x, cosine, sine * y);
                let way = distance * DVec3::Y + radius * out;
                let squared = way.length_squared();
                let toward = way / squared.sqrt();
                let seen = out.dot(-toward).max(0.0) * normal.dot(toward).max(0.0) / squared;
                irradiance += radiance * seen;
            }
        }
        irradiance *= 4.0 * PI * radius * radius / f64::from(steps * steps);
        let exact = watts * tilt.cos() / (4.0 * PI * distance * distance);
        let error = (irradiance / exact - 1.0).abs();
        let perturbed = (irradiance / (1.001 * exact) - 1.0).abs();
        assert_error("sphere", 2e-4, error, perturbed);
    }
}

/// The shipped scene is what its comments say.
#[test]
fn the_bowl_is_as_wide_as_said() {
    let scene = load("lamp.toml");
    let Geometry::Mesh(bowl) = &scene.objects[0].geometry else {
        panic!("the bowl is a mesh")
    };
    let widest = bowl
        .positions
        .iter()
        .fold(0.0, |a: f64, p| a.max(p.x.abs()));
    assert!((2.0 * widest / BOWL - 1.0).abs() < 0.03, "{widest}");
    let nearest = bowl.distance_to(lamp(&scene).0);
    assert!((0.7..1.3).contains(&(nearest / BOWL)), "{nearest}");
    assert!(bowl.positions.iter().all(|p| p.y > -1e-6));
    let table = rect(&scene, "table");
    assert!(table.normal() == DVec3::Y && toward_sun(&load("ring.toml")).y > 0.0);
}
