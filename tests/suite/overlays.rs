//! Overlays: each lies where what it shows is, and nothing of one remains.

use crate::common::{Device, footprint, method, with_texels};
use glam::DVec3;
use nephroid::image_file::RgbImage;
use nephroid::render::{Method, Overlay, Renderer};
use nephroid::scene::{self, EnvironmentMap, Light, LightKind, Scene};
use std::sync::Arc;

const SIZE: [u32; 2] = [240, 180];

/// A mirror in the plane x = 0, with 0.2 < z < 0.8, and a floor in the plane z = 0 before it, that gets all of its light.
fn corner() -> Scene {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("scene.toml");
    let text = "version = 1\n[camera]\nposition = [-1.6, 0, 2.2]\ntarget = [-0.3, 0, 0.2]\nfov_degrees = 50\n\
         [[light]]\nname = \"sun\"\nkind = \"sun\"\ndirection = [-0.5, 0, 1]\nirradiance = [1, 1, 1]\n\
         angular_radius_degrees = 0.27\n\
         [[material]]\nname = \"white\"\nkind = \"diffuse\"\nalbedo = [0.6, 0.6, 0.6]\n\
         [[material]]\nname = \"metal\"\nkind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]\n\
         [[object]]\nname = \"floor\"\nmaterial = \"white\"\nlightmap = [64, 64]\n\
         rect = { origin = [-1, -0.6, 0], edge_u = [1, 0, 0], edge_v = [0, 1.2, 0] }\n\
         [[object]]\nname = \"mirror\"\nmaterial = \"metal\"\n\
         rect = { origin = [0, -0.4, 0.2], edge_u = [0, 0, 0.6], edge_v = [0, 0.8, 0] }\n";
    std::fs::write(&file, text).unwrap();
    scene::load(&file).unwrap().scene
}

fn view(renderer: &mut Renderer, scene: &Scene, overlays: &[Overlay]) -> RgbImage {
    renderer.set_overlays(overlays);
    renderer.view(&scene.camera, SIZE, 1).unwrap();
    renderer.read_view().unwrap()
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Seen {
    Mirror,
    Floor,
    Sky,
    /// An edge is near.
    Edge,
}

/// What a pixel shows.
fn seen(scene: &Scene, pixel: usize) -> Seen {
    let camera = &scene.camera;
    let forward = (camera.target - camera.position).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let [width, height] = SIZE.map(f64::from);
    let half = (0.5 * camera.fov).tan();
    let [column, row] = [pixel % SIZE[0] as usize, pixel / SIZE[0] as usize].map(|at| at as f64);
    let x = (2.0 * (column + 0.5) / width - 1.0) * half * width / height;
    let y = (1.0 - 2.0 * (row + 0.5) / height) * half;
    let ray = forward + x * right + y * up;
    // Distance of a value from the ends of a range, as a share of three pixels or so.
    let inside = |value: f64, low: f64, high: f64| (value - low).min(high - value) / 0.06;
    let on_mirror = camera.position - camera.position.x / ray.x * ray;
    let on_floor = camera.position - camera.position.z / ray.z * ray;
    let mirror = inside(on_mirror.y, -0.4, 0.4).min(inside(on_mirror.z, 0.2, 0.8));
    let mirror = if ray.x > 0.0 { mirror } else { -2.0 };
    let floor = inside(on_floor.x, -1.0, 0.0).min(inside(on_floor.y, -0.6, 0.6));
    let floor = if ray.z < 0.0 { floor } else { -2.0 };
    match (mirror, floor) {
        (mirror, _) if mirror > 1.0 => Seen::Mirror,
        (mirror, _) if mirror > -1.0 => Seen::Edge,
        (_, floor) if floor > 1.0 => Seen::Floor,
        (_, floor) if floor > -1.0 => Seen::Edge,
        _ => Seen::Sky,
    }
}

/// What the pixels show that differ, and their number, for each.
fn changed(scene: &Scene, a: &RgbImage, b: &RgbImage) -> [usize; 3] {
    let differs = |pixel: &usize| a.pixels[*pixel] != b.pixels[*pixel];
    let count = |of| {
        let pixels = (0..a.pixels.len()).filter(differs);
        pixels.filter(|pixel| seen(scene, *pixel) == of).count()
    };
    [Seen::Mirror, Seen::Floor, Seen::Sky].map(count)
}

/// Each overlay changes the pixels of what it is of, and no others; without overlays, the picture has the same bits.
#[test]
fn overlays_lie_where_they_belong() {
    let device = Device::open();
    // Texels and patches of several pixels.
    let plain_scene = with_texels(corner(), "floor", [8, 8]);
    let mut under_sky = plain_scene.clone();
    under_sky.lights.push(Light {
        name: "sky".into(),
        kind: LightKind::Environment {
            map: Arc::new(EnvironmentMap {
                width: 16,
                height: 8,
                radiance: (0..128).map(|i| [0.1 + 0.01 * i as f32; 3]).collect(),
            }),
            scale: 1.0,
            rotation: 0.0,
            casts_caustics: true,
        },
    });
    for (scene, overlays) in [
        (&plain_scene, &Overlay::ALL[..4]),
        (&under_sky, &Overlay::ALL[2..]),
    ] {
        let mut renderer = device.renderer(scene, &footprint(200));
        let plain = view(&mut renderer, scene, &[]);
        for overlay in overlays {
            let image = view(&mut renderer, scene, &[*overlay]);
            let [mirror, floor, sky] = changed(scene, &plain, &image);
            let name = overlay.name();
            let expected = match overlay {
                Overlay::Patches => [true, false, false],
                Overlay::Cells => [false, false, true],
                _ => [false, true, false],
            };
            for (count, expected) in [mirror, floor, sky].into_iter().zip(expected) {
                assert_eq!(count > 20, expected, "{name}: {mirror} {floor} {sky}");
                assert!(count == 0 || expected, "{name}: {mirror} {floor} {sky}");
            }
        }
        let all = view(&mut renderer, scene, &Overlay::ALL);
        assert!(
            changed(scene, &plain, &all)[..2]
                .iter()
                .all(|count| *count > 20)
        );
        assert!(view(&mut renderer, scene, &[]).pixels == plain.pixels);
    }
}

/// The exposure of a picture leaves the colours of overlays as they are.
#[test]
fn exposure_leaves_colors() {
    let device = Device::open();
    let mut scene = corner();
    let mut renderer = device.renderer(&scene, &footprint(20));
    let one = view(&mut renderer, &scene, &[Overlay::Patches]);
    let most = |image: &RgbImage| {
        image
            .pixels
            .as_flattened()
            .iter()
            .copied()
            .fold(0.0, f32::max)
    };
    scene.camera.exposure_ev = -3.0;
    let dark = view(&mut renderer, &scene, &[Overlay::Patches]);
    let ratio = most(&dark) / most(&one);
    assert!((ratio - 8.0).abs() < 0.5, "{ratio}");
}

/// Every point that lands is one splat of one texel, and texels with light have splats.
#[test]
fn density_counts_splats() {
    let device = Device::open();
    let scene = corner();
    let floor = scene.object_index("floor").unwrap();
    let counts = |renderer: &mut Renderer| {
        view(renderer, &scene, &[Overlay::Density]);
        let density = renderer.read_density(floor).unwrap();
        let caustic = renderer.read_caustic(floor).unwrap();
        let sum: f32 = density.pixels.iter().map(|rgb| rgb[0]).sum();
        for (count, light) in density.pixels.iter().zip(&caustic.pixels) {
            assert!(count[0] > 0.0 || light[0] == 0.0, "{count:?} {light:?}");
            assert_eq!(count[0].fract(), 0.0);
        }
        assert!(density.pixels.iter().any(|rgb| rgb[0] == 0.0));
        sum
    };
    let mut points = device.renderer(&scene, &method(Method::Points, 3000));
    assert_eq!(counts(&mut points), points.samples().unwrap() as f32);
    for of in [Method::Footprint, Method::Beams] {
        let mut renderer = device.renderer(&scene, &method(of, 1000));
        let sum = counts(&mut renderer);
        let least = renderer.lit_patches().unwrap().unwrap_or(2) as f32;
        assert!(sum >= least, "{sum} {least}");
        // A frame that keeps its caustic has the same splats.
        assert_eq!(counts(&mut renderer), sum);
        renderer.invalidate();
        assert_eq!(counts(&mut renderer), sum);
    }
}

/// Every method takes all overlays, with meshes and chains of light, too.
#[test]
fn methods_take_all_overlays() {
    let device = Device::open();
    for (name, of) in [
        ("mesh_cage.toml", Method::Footprint),
        ("mirror.toml", Method::Pinhole),
        ("two_mirrors.toml", Method::Footprint),
    ] {
        let mut scene = crate::common::load_with_chains(name);
        for object in &mut scene.objects {
            object.light_map = object.light_map.map(|_| [64, 64]);
        }
        let mut renderer = device.renderer(&scene, &method(of, 2000));
        let plain = view(&mut renderer, &scene, &[]);
        let all = view(&mut renderer, &scene, &Overlay::ALL);
        assert!(plain.pixels != all.pixels, "{name}");
        assert!(view(&mut renderer, &scene, &[]).pixels == plain.pixels);
    }
}
