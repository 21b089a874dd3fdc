//! Light that meets two or more specular surfaces: closed forms, and the reference.

mod common;

use common::{
    Device, assert_error_beyond_noise, footprint, image, l1, l1_noise, load, load_with_chains,
    only_receiver, options, solve, with_texels,
};
use glam::DVec3;
use nephroid::image_file::RgbImage;
use nephroid::optics::fresnel_dielectric;
use nephroid::render::Settings;
use nephroid::scene::{
    Dielectric, Geometry, Light, LightKind, Material, MaterialKind, Mesh, Object, Rect, Scene,
};
use std::sync::Arc;

const TEXELS: [u32; 2] = [32, 32];

/// A box with flat faces, closed, the fronts outside.
fn block(low: DVec3, high: DVec3) -> Geometry {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for side in [0.0, 1.0] {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let corner = |s: f64, t: f64| {
                let mut share = DVec3::ZERO;
                (share[axis], share[u], share[v]) = (side, s, t);
                low + share * (high - low)
            };
            let mut normal = DVec3::ZERO;
            normal[axis] = 2.0 * side - 1.0;
            let first = mesh.positions.len() as u32;
            mesh.positions.extend([
                corner(0.0, 0.0),
                corner(1.0, 0.0),
                corner(1.0, 1.0),
                corner(0.0, 1.0),
            ]);
            mesh.normals.extend([normal; 4]);
            let [a, b] = if side > 0.0 { [1, 2] } else { [2, 1] };
            let [c, d] = if side > 0.0 { [2, 3] } else { [3, 2] };
            mesh.triangles
                .extend([[first, first + a, first + b], [first, first + c, first + d]]);
        }
    }
    Geometry::Mesh(Arc::new(mesh))
}

fn object(name: &str, material: usize, geometry: Geometry) -> Object {
    Object {
        name: name.into(),
        material,
        geometry,
        light_map: None,
        unwrapping: None,
        uvs: None,
        blocks_light: true,
    }
}

/// Bodies over a floor of 1 m² at the height 0, in the sun.
fn scene(toward: DVec3, bodies: Vec<(Dielectric, Geometry)>) -> Scene {
    let mut materials = vec![Material {
        name: "floor".into(),
        kind: MaterialKind::Diffuse {
            albedo: DVec3::splat(0.5),
        },
        albedo_map: None,
    }];
    let floor = Rect {
        origin: DVec3::new(-0.5, 0.0, 0.5),
        edge_u: DVec3::X,
        edge_v: DVec3::NEG_Z,
    };
    let mut objects = vec![Object {
        light_map: Some(TEXELS),
        ..object("floor", 0, Geometry::Rect(floor))
    }];
    for (dielectric, geometry) in bodies {
        let name = format!("body {}", materials.len());
        objects.push(object(&name, materials.len(), geometry));
        materials.push(Material {
            name,
            kind: MaterialKind::Dielectric(dielectric),
            albedo_map: None,
        });
    }
    Scene {
        camera: load("mirror.toml").camera,
        lights: vec![Light {
            name: "sun".into(),
            kind: LightKind::Sun {
                direction: toward.normalize(),
                irradiance: DVec3::ONE,
                angular_radius: 0.002,
            },
        }],
        materials,
        objects,
        max_interfaces: 16,
        textures: Vec::new(),
    }
}

fn by_device(scene: &Scene) -> RgbImage {
    Device::open().caustic(scene, "floor", &footprint(16_384))
}

fn by_reference(scene: &Scene) -> RgbImage {
    image(&solve(scene, "floor", TEXELS, &options(0.03)))
}

/// Mean over the texels in the middle half of the floor, RGB, W/m².
fn middle(map: &RgbImage) -> DVec3 {
    let [low, high] = [TEXELS[0] as usize / 4, 3 * TEXELS[0] as usize / 4];
    let texels = (low..high).flat_map(|y| (low..high).map(move |x| y * TEXELS[0] as usize + x));
    let sum: DVec3 = (texels.map(|texel| DVec3::from(map.pixels[texel].map(f64::from)))).sum();
    sum / ((high - low) * (high - low)) as f64
}

/// Irradiance under a plate of glass: E cosθ (1 − F)² a/(1 − F² a²), with all reflections inside. a = e^(−σt/cosθ′) is the
/// transmittance of one crossing.
#[test]
fn absorbing_plate() {
    let (toward, thickness, sigma) = (DVec3::new(0.5, 0.8, 0.2), 0.1, DVec3::new(0.0, 2.0, 9.0));
    let glass = Dielectric {
        absorption: sigma,
        ..Dielectric::new(1.5)
    };
    // Much wider than the floor, so that its sides light none of the middle.
    let plate = block(
        DVec3::new(-2.0, 0.05, -2.0),
        DVec3::new(2.0, 0.05 + thickness, 2.0),
    );
    let scene = scene(toward, vec![(glass, plate)]);
    let cosine = toward.normalize().y;
    let inside = (1.0 - (1.0 - cosine * cosine) / 2.25).sqrt();
    let f = fresnel_dielectric(cosine, 1.0 / 1.5);
    let a = (-sigma * thickness / inside).exp();
    let exact = cosine * (1.0 - f).powi(2) * a / (DVec3::ONE - (f * a).powf(2.0));
    for (what, map, tolerance) in [
        ("device", by_device(&scene), 0.005),
        ("reference", by_reference(&scene), 0.003),
    ] {
        let error = (middle(&map) / exact - DVec3::ONE).abs().max_element();
        assert!(error < tolerance, "{what}: {error}");
    }
    // One crossing less of the medium would be seen.
    let perturbed = exact / a;
    assert!(
        (middle(&by_device(&scene)) / perturbed - DVec3::ONE)
            .abs()
            .max_element()
            > 0.05
    );
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

/// Water overlaps the lower half of a plate of glass. Where the glass has the higher priority, the plate keeps its thickness;
/// otherwise it loses the overlap, and more light is absorbed by the water.
#[test]
fn glass_displaces_what_overlaps_it() {
    let toward = DVec3::new(0.5, 0.8, 0.2);
    let colour = |ior: f64, priority: i32, absorption: DVec3| Dielectric {
        ior,
        priority,
        absorption,
        thin: false,
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

/// The scenes with glass and mirrors. The focus of the ball is narrower than a texel of a map of 48²: there the blur by a texel
/// alone is an error of 5.9 %, whatever the number of samples.
#[test]
fn against_the_reference() {
    for (name, side, bound) in [
        ("glass_ball.toml", 128, 0.06),
        ("tumbler.toml", 48, 0.11),
        ("two_mirrors.toml", 48, 0.04),
    ] {
        let scene = only_receiver(load_with_chains(name), "floor", [side, side]);
        let truth = solve(&scene, "floor", [side, side], &options(0.02));
        let truth_map = image(&truth);
        let device = Device::open();
        let settings = Settings {
            error: Some(0.02),
            ..footprint(16_384)
        };
        let map = device.caustic(&scene, "floor", &settings);
        let one = Scene {
            max_interfaces: 1,
            ..scene.clone()
        };
        let without = device.caustic(&one, "floor", &settings);
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
