//! Light that nearly grazes the receiver, where perspective draws the image of the sun's disc out to one side.

use crate::common::{Device, assert_error, l1, load, object_mut, shifted_by_a_texel, with_texels};
use glam::DVec3;
use nephroid::image_file::RgbImage;
use nephroid::measure::stress::random::random_scene;
use nephroid::measure::stress::scenes::RECEIVER;
use nephroid::render::Settings;
use nephroid::scene::{Geometry, LightKind, MaterialKind, Mesh, Rect, Scene};
use std::f64::consts::PI;
use std::sync::Arc;

const TEXELS: [u32; 2] = [80, 160];
/// Parts of a side of a texel and of the mirror for the integral.
const PARTS: usize = 4;

/// An upright mirror of 6 cm, 0.3 m above a floor, under a sun of 5° that stands 10° above the horizon.
fn scene() -> Scene {
    let mut scene = load("mirror.toml");
    let elevation = 10f64.to_radians();
    scene.lights[0].kind = LightKind::Sun {
        direction: DVec3::new(0.0, elevation.sin(), elevation.cos()),
        irradiance: DVec3::ONE,
        angular_radius: 2.5f64.to_radians(),
    };
    object_mut(&mut scene, "mirror").geometry = Geometry::Rect(Rect {
        origin: DVec3::new(-0.03, 0.27, 0.0),
        edge_u: 0.06 * DVec3::X,
        edge_v: 0.06 * DVec3::Y,
    });
    let floor = object_mut(&mut scene, "floor");
    floor.light_map = Some(TEXELS);
    floor.geometry = Geometry::Rect(Rect {
        origin: DVec3::new(-0.5, 0.0, 3.0),
        edge_u: DVec3::X,
        edge_v: -2.0 * DVec3::Z,
    });
    scene
}

/// Middles of the parts of a unit square.
fn parts() -> impl Iterator<Item = [f64; 2]> {
    let middle = |i: usize| (i as f64 + 0.5) / PARTS as f64;
    (0..PARTS * PARTS).map(move |i| [middle(i % PARTS), middle(i / PARTS)])
}

/// Direction and angular radius of the scene's sun.
fn sun(scene: &Scene) -> (DVec3, f64) {
    match scene.lights[0].kind {
        LightKind::Sun {
            direction,
            angular_radius,
            ..
        } => (direction, angular_radius),
        _ => panic!("a sun"),
    }
}

/// Radiance of a sun that irradiates a plane that faces it by 1 W/m².
fn radiance(angular_radius: f64) -> f64 {
    1.0 / (PI * angular_radius.sin().powi(2))
}

fn reflectance(scene: &Scene) -> DVec3 {
    match scene.materials[0].kind {
        MaterialKind::Mirror { reflectance } => reflectance,
        _ => panic!("a mirror"),
    }
}

/// E = ∫ F L cos θ cos θ′ / d² over the points of the mirror that show the sun, of radiance L = E☉ / (π sin² α).
fn exact(scene: &Scene) -> RgbImage {
    exact_for(scene, &crate::common::rect(scene, "mirror"), DVec3::Z)
}

/// The same for a mirror with the interpolated normal n everywhere, which shows light only if it comes and goes before its plane.
fn exact_for(scene: &Scene, mirror: &Rect, n: DVec3) -> RgbImage {
    let floor = crate::common::rect(scene, "floor");
    let plane = mirror.edge_u.cross(mirror.edge_v).normalize();
    let (direction, angular_radius) = sun(scene);
    let radiance = radiance(angular_radius);
    let at = |place: &Rect, [u, v]: [f64; 2]| place.origin + u * place.edge_u + v * place.edge_v;
    let irradiance = |y: DVec3| -> f64 {
        let of = |part| {
            let x = at(mirror, part);
            let outgoing = (y - x).normalize();
            let incoming = 2.0 * n.dot(outgoing) * n - outgoing;
            let is_before = incoming.dot(plane) > 0.0 && outgoing.dot(plane) > 0.0;
            let shows = is_before && incoming.dot(direction) > angular_radius.cos();
            let cosines = -outgoing.y * n.dot(outgoing);
            if shows {
                radiance * cosines / y.distance_squared(x)
            } else {
                0.0
            }
        };
        parts().map(of).sum::<f64>() / (PARTS * PARTS) as f64 * mirror.area()
    };
    let [width, height] = TEXELS;
    let texel = |index: u32| {
        let sum: f64 = parts()
            .map(|[u, v]| {
                let u = (f64::from(index % width) + u) / f64::from(width);
                let v = 1.0 - (f64::from(index / width) + v) / f64::from(height);
                irradiance(at(&floor, [u, v]))
            })
            .sum();
        (reflectance(scene) * (sum / (PARTS * PARTS) as f64))
            .as_vec3()
            .to_array()
    };
    RgbImage {
        width,
        height,
        pixels: (0..width * height).map(texel).collect(),
    }
}

fn sum(map: &RgbImage) -> f64 {
    map.pixels.iter().map(|rgb| f64::from(rgb[0])).sum()
}

/// Without perspective, both tests have an L1 of 0.2.
fn assert_in_perspective(scene: Scene, truth: &RgbImage) {
    let device = Device::open();
    let caustic = |scene: &Scene| device.caustic(scene, "floor", &Settings::default());
    let map = caustic(&scene);
    let energy = sum(&map) / sum(truth) - 1.0;
    assert!(energy.abs() < 0.01, "energy {energy}");
    let moved = caustic(&shifted_by_a_texel(scene, "floor"));
    assert_error("L1", 0.1, l1(&map, truth), l1(&moved, truth));
}

#[test]
fn the_disc_is_drawn_in_perspective() {
    assert_in_perspective(scene(), &exact(&scene()));
}

/// A second mirror, 1 m before the first, turns the light back, and the floor is mirrored, too, so that it gets the same light.
fn scene_with_chain() -> Scene {
    let mut scene = scene();
    scene.max_interfaces = 2;
    let mut second = object_mut(&mut scene, "mirror").clone();
    second.name = "second mirror".into();
    second.geometry = Geometry::Rect(Rect {
        origin: DVec3::new(0.5, 0.0, 1.0),
        edge_u: DVec3::NEG_X,
        edge_v: 0.38 * DVec3::Y,
    });
    scene.objects.push(second);
    object_mut(&mut scene, "floor").geometry = Geometry::Rect(Rect {
        origin: DVec3::new(0.5, 0.0, -1.0),
        edge_u: DVec3::NEG_X,
        edge_v: 2.0 * DVec3::Z,
    });
    scene
}

#[test]
fn landings_of_chains_are_drawn_in_perspective() {
    let mut truth = exact(&scene());
    for pixel in &mut truth.pixels {
        for (channel, reflectance) in pixel.iter_mut().zip(reflectance(&scene()).to_array()) {
            *channel *= reflectance as f32;
        }
    }
    assert_in_perspective(scene_with_chain(), &truth);
}

/// Flux that a mirror with the interpolated normal n reflects, in red, W: F A ∫ L n·ω dω over the part of the disc whose light comes and
/// goes before the mirror's plane.
fn reflected(scene: &Scene, mirror: &Rect, n: DVec3) -> f64 {
    const RINGS: u32 = 400;
    let (direction, angular_radius) = sun(scene);
    let plane = mirror.edge_u.cross(mirror.edge_v).normalize();
    let (u, v) = direction.any_orthonormal_pair();
    let mut sum = 0.0;
    // Rings of equal solid angle, in equal parts.
    for i in 0..RINGS * RINGS {
        let [ring, part] = [i / RINGS, i % RINGS].map(|k| (f64::from(k) + 0.5) / f64::from(RINGS));
        let cosine = 1.0 - ring * (1.0 - angular_radius.cos());
        let sine = (1.0 - cosine * cosine).sqrt();
        let (y, x) = (2.0 * PI * part).sin_cos();
        let s = cosine * direction + sine * (x * u + y * v);
        let outgoing = 2.0 * n.dot(s) * n - s;
        if s.dot(plane) > 0.0 && outgoing.dot(plane) > 0.0 {
            sum += n.dot(s);
        }
    }
    let solid_angle = 2.0 * PI * (1.0 - angular_radius.cos());
    let radiance = radiance(angular_radius);
    let mean = sum / f64::from(RINGS * RINGS);
    reflectance(scene).x * mirror.area() * radiance * solid_angle * mean
}

/// The plane of a mirror whose interpolated normal is tilted cuts the sun's disc, or its mirror image. Without the cut, the mirror shows
/// the whole disc or nothing of it: an L1 of 0.3 to 1.
#[test]
fn the_plane_of_a_facet_cuts_the_disc() {
    let device = Device::open();
    let mirror = Rect {
        origin: DVec3::new(-0.03, 0.27, 0.0),
        edge_u: 0.06 * DVec3::X,
        edge_v: 0.06 * DVec3::Y,
    };
    let in_plane = |degrees: f64| {
        let angle = degrees.to_radians();
        DVec3::new(0.0, angle.cos(), angle.sin())
    };
    // Degrees of the normal above the horizon, and those of the sun before the plane: what it sends on descends at about 30°, or
    // straight down along the plane.
    for (tilt, before) in [(30.0, -1.0), (30.0, 1.0), (-30.0, 61.0), (-30.0, 59.0)] {
        let n = in_plane(90.0 - tilt);
        let mut scene = scene();
        if let LightKind::Sun { direction, .. } = &mut scene.lights[0].kind {
            *direction = in_plane(before);
        }
        let corner = |u, v| mirror.origin + u * mirror.edge_u + v * mirror.edge_v;
        object_mut(&mut scene, "mirror").geometry = Geometry::Mesh(Arc::new(Mesh {
            positions: vec![
                corner(0., 0.),
                corner(1., 0.),
                corner(1., 1.),
                corner(0., 1.),
            ],
            normals: vec![n; 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        }));
        object_mut(&mut scene, "floor").geometry = Geometry::Rect(Rect {
            origin: DVec3::new(-0.5, 0.0, 1.2),
            edge_u: DVec3::X,
            edge_v: -1.5 * DVec3::Z,
        });
        let truth = exact_for(&scene, &mirror, n);
        let settings = Settings {
            error: Some(0.02),
            ..Settings::default()
        };
        let map = device.caustic(&scene, "floor", &settings);
        let texel = 1.5 / f64::from(TEXELS[0] * TEXELS[1]);
        let energy = sum(&map) * texel / reflected(&scene, &mirror, n) - 1.0;
        println!("{tilt}° {before}°: energy {energy:.5}");
        assert!(energy.abs() < 0.002, "{tilt}° {before}°: energy {energy}");
        // The image is that of a part of a disc, for which a parallelogram of the same moments stands.
        let moved = device.caustic(&shifted_by_a_texel(scene, "floor"), "floor", &settings);
        assert_error("L1", 0.25, l1(&map, &truth), l1(&moved, &truth));
    }
}

/// Where a plane leaves almost nothing of a disc, and that part lands at a small angle, its image is thousands of times as long as it is
/// wide. It is a small part of the light, and must not make the rest useless.
#[test]
fn streaks_of_light_are_finite() {
    let device = Device::open();
    let one_surface = Scene {
        max_interfaces: 1,
        ..random_scene(8)
    };
    let scene = with_texels(one_surface, RECEIVER, [128, 128]);
    for error in [0.0145, 0.014, 0.0135, 0.013] {
        let settings = Settings {
            error: Some(error),
            ..Settings::default()
        };
        let map = device.caustic(&scene, RECEIVER, &settings);
        assert_eq!(map.first_not_finite(), None, "error {error}");
        assert!(map.pixels.iter().any(|rgb| rgb[0] > 0.0), "no light");
    }
}
