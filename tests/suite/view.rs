//! The camera's view: radiance that is known in closed form at single pixels.

use crate::common::{
    Device, assert_error, assert_physical, brighter, footprint, load, object_mut, toward_sun,
};
use glam::DVec3;
use nephroid::image_file::RgbImage;
use nephroid::render::Renderer;
use nephroid::scene::{Camera, LightKind, MaterialKind, Scene};
use std::f64::consts::PI;

const SIZE: [u32; 2] = [160, 90];

/// Rounding error of the position in a bilinear look-up, in texels, at the 8 bits (`subTexelPrecisionBits`) that GPUs and lavapipe
/// report.
const ROUNDING: f64 = 1.0 / 512.0;

fn view(device: &Device, scene: &Scene) -> (Renderer, RgbImage) {
    let mut renderer = device.renderer(scene, &footprint(16_384));
    renderer.view(&scene.camera, SIZE, 1).unwrap();
    let image = renderer.read_view().unwrap();
    assert_physical(&image);
    (renderer, image)
}

/// Irradiance of a surface that faces up, from the sun alone.
fn open_irradiance(scene: &Scene) -> DVec3 {
    match scene.lights[0].kind {
        LightKind::Sun { irradiance, .. } => irradiance * toward_sun(scene).y,
        _ => panic!("the first light is no sun"),
    }
}

/// The pixel that shows `point`, if it is in view, and the point of the plane y = 0 or z = 0 (`plane` is its normal)
/// that its middle shows.
fn look(camera: &Camera, point: DVec3, plane: DVec3) -> Option<(usize, DVec3)> {
    let forward = (camera.target - camera.position).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let up = right.cross(forward);
    let [width, height] = SIZE.map(f64::from);
    let half = (0.5 * camera.fov).tan();
    let d = point - camera.position;
    let x = d.dot(right) / d.dot(forward) / (half * width / height);
    let y = d.dot(up) / d.dot(forward) / half;
    let column = (0.5 * (x + 1.0) * width).floor();
    let row = (0.5 * (1.0 - y) * height).floor();
    if !((0.0..width).contains(&column) && (0.0..height).contains(&row)) {
        return None;
    }
    let x = (2.0 * (column + 0.5) / width - 1.0) * half * width / height;
    let y = (1.0 - 2.0 * (row + 0.5) / height) * half;
    let ray = forward + x * right + y * up;
    let shown = camera.position - camera.position.dot(plane) / ray.dot(plane) * ray;
    Some(((row * width + column) as usize, shown))
}

fn color(scene: &Scene, object: &str) -> DVec3 {
    let object = &scene.objects[scene.object_index(object).unwrap()];
    match scene.materials[object.material].kind {
        MaterialKind::Mirror { reflectance } => reflectance,
        MaterialKind::Diffuse { albedo } => albedo,
        _ => panic!("neither a mirror nor diffuse"),
    }
}

/// Largest |L/L* − 1| over pixels and channels.
fn worst(image: &RgbImage, exact: &[(usize, DVec3)]) -> f64 {
    let error = |(pixel, exact): &(usize, DVec3)| {
        crate::common::ratio_error(image.pixels[*pixel].map(f64::from), exact.to_array())
    };
    exact.iter().map(error).fold(0.0, f64::max)
}

/// `ring.toml` without its sky and textures, seen with much of the open floor.
fn plain_ring() -> Scene {
    let mut scene = load("ring.toml");
    scene.lights.truncate(1);
    for material in &mut scene.materials {
        material.albedo_map = None;
    }
    scene.camera.position = DVec3::new(-1.2, 1.8, 2.55);
    scene.camera.target = DVec3::new(0.36, 0.17, -0.15);
    scene.camera.fov = 38f64.to_radians();
    scene
}

/// Where neither the ring nor its shadow nor its light reach: albedo/π E cosθ. And in the caustic
/// inside of the ring: as much more as the light map says.
#[test]
fn floor_of_the_ring() {
    let device = Device::open();
    let scene = plain_ring();
    let s = toward_sun(&scene);
    let (renderer, image) = view(&device, &scene);
    let albedo = color(&scene, "floor");
    // What the ring reflects from its outside, or shades, ends 0.4 m cot(elevation) from it.
    let open: Vec<_> = (0..30 * 30)
        .map(|i| [i % 30, i / 30].map(|i| f64::from(i) * 0.12 - 1.74))
        .filter(|[x, z]| {
            x.hypot(*z) > 1.65 && x * scene.camera.position.x + z * scene.camera.position.z > 0.0
        })
        .filter_map(|[x, z]| look(&scene.camera, DVec3::new(x, 0.0, z), DVec3::Y))
        .map(|(pixel, _)| (pixel, albedo / PI * open_irradiance(&scene)))
        .collect();
    assert!(open.len() > 20, "{} pixels", open.len());
    let (_, bright) = view(&device, &brighter(scene.clone(), 1.02));
    let [error, perturbed] = [&image, &bright].map(|image| worst(image, &open));
    assert_error("view, open floor", 0.01, error, perturbed);

    // All of the inside that the sun reaches, where there is a caustic.
    let floor = scene.object_index("floor").unwrap();
    let map = renderer.read_caustic(floor).unwrap();
    let mut lit = Vec::new();
    for i in 0..40 * 40 {
        let [x, z] = [i % 40, i / 40].map(|i| (f64::from(i) + 0.5) / 40.0 * 1.6 - 0.8);
        let Some((pixel, shown)) = look(&scene.camera, DVec3::new(x, 0.0, z), DVec3::Y) else {
            continue;
        };
        // The sun comes in over the rim 0.4 m high; the camera looks over it, too.
        let clears_rim = |toward: DVec3| {
            let flat = DVec3::new(toward.x, 0.0, toward.z);
            let (along, across) = (shown.dot(flat.normalize()), shown.length_squared());
            let to_wall = -along + (1.0 - across + along * along).sqrt();
            shown.length() < 1.0 && to_wall * toward.y / flat.length() > 0.45
        };
        if !clears_rim(s) || !clears_rim(scene.camera.position - shown) {
            continue;
        }
        // 512 texels on 3.6 m; the view shows the cubic B-spline over 4 x 4 of their middles, no longer the bilinear
        // function over 2 x 2, whose edges a close camera saw.
        let [x, y] = [shown.x, shown.z].map(|x| 256.0 + x / 3.6 * 512.0 - 0.5);
        let texel = |column: f64, row: f64| {
            let rgb = map.pixels[row as usize * 512 + column as usize];
            DVec3::from(rgb.map(f64::from))
        };
        let weights = |f: f64| {
            [
                (1.0 - f).powi(3) / 6.0,
                2.0 / 3.0 - f * f + 0.5 * f.powi(3),
                (1.0 + 3.0 * f + 3.0 * f * f - 3.0 * f.powi(3)) / 6.0,
                f.powi(3) / 6.0,
            ]
        };
        let (mut caustic, mut darkest, mut brightest) = (DVec3::ZERO, DVec3::MAX, DVec3::ZERO);
        for (i, across) in weights(x.fract()).into_iter().enumerate() {
            for (j, down) in weights(y.fract()).into_iter().enumerate() {
                let (column, row) = (x.floor() + i as f64 - 1.0, y.floor() + j as f64 - 1.0);
                let texel = texel(column, row);
                caustic += across * down * texel;
                (darkest, brightest) = (darkest.min(texel), brightest.max(texel));
            }
        }
        if caustic.x > 0.2 {
            let rounding = 2.0 * ROUNDING * (brightest - darkest);
            let exact = open_irradiance(&scene) + caustic;
            lit.push((pixel, albedo / PI * exact, albedo / PI * rounding));
        }
    }
    assert!(lit.len() > 30, "{} pixels", lit.len());
    // The error beyond the rounding.
    let worst = |image: &RgbImage| {
        let beyond = |&(pixel, exact, rounding): &(usize, DVec3, DVec3)| {
            let shown = DVec3::from(image.pixels[pixel].map(f64::from));
            (((shown - exact).abs() - rounding) / exact).max_element()
        };
        lit.iter().map(beyond).fold(0.0, f64::max)
    };
    let [error, perturbed] = [&image, &bright].map(worst);
    assert_error("view, floor in the caustic", 0.01, error, perturbed);
}

/// A flat mirror shows the floor before it, reflectance times as bright: open, and where the
/// mirror's own light falls.
#[test]
fn flat_mirror_shows_the_floor() {
    let device = Device::open();
    let scene = load("mirror.toml");
    let s = toward_sun(&scene);
    let reflectance = color(&scene, "mirror");
    let seen = |x: f64, y: f64, in_image: bool| {
        let (pixel, on_mirror) = look(&scene.camera, DVec3::new(x, y, 0.0), DVec3::Z).unwrap();
        let mut ray = on_mirror - scene.camera.position;
        ray.z = -ray.z;
        let on_floor = on_mirror - on_mirror.y / ray.y * ray;
        // Back along the reflected light to the mirror.
        let x = on_floor.x + on_floor.z * s.x / s.z;
        let y = on_floor.z * s.y / s.z;
        let inside = x.abs() < 0.36 && (y - 0.5).abs() < 0.26;
        let outside = x.abs() > 0.44 || (y - 0.5).abs() > 0.34;
        assert!(if in_image { inside } else { outside }, "{on_floor}");
        let direct = DVec3::splat(s.y);
        let caustic = if in_image {
            reflectance * s.y
        } else {
            DVec3::ZERO
        };
        (
            pixel,
            reflectance * color(&scene, "floor") / PI * (direct + caustic),
        )
    };
    let exact = [
        seen(0.1, 0.22, true),
        seen(0.2, 0.24, true),
        seen(0.0, 0.45, false),
    ];
    let (_, image) = view(&device, &scene);
    let mut dull = scene.clone();
    dull.materials.push(dull.materials[0].clone());
    let material = dull.materials.len() - 1;
    if let MaterialKind::Mirror { reflectance } = &mut dull.materials[material].kind {
        *reflectance *= 0.97;
    }
    object_mut(&mut dull, "mirror").material = material;
    let (_, dull) = view(&device, &dull);
    let [error, perturbed] = [&image, &dull].map(|image| worst(image, &exact));
    // The floor's light in the image is even to 2 % at so few footprints, half of what is seen.
    assert_error("view, floor in the mirror", 0.01, error, perturbed);
}

#[test]
fn nothing_is_black() {
    let device = Device::open();
    let mut scene = plain_ring();
    scene.camera.target = scene.camera.position + DVec3::new(0.3, 1.0, 1.0);
    let (_, image) = view(&device, &scene);
    assert!(image.pixels.iter().all(|rgb| *rgb == [0.0; 3]));
    // The camera that looks at the scene sees no black.
    let (_, image) = view(&device, &plain_ring());
    assert!(image.pixels.iter().any(|rgb| *rgb != [0.0; 3]));
    // Nor does one that looks into the sun: its radiance is E / (π sin²α).
    let s = toward_sun(&scene);
    scene.camera.target = scene.camera.position + s;
    scene.camera.fov = 0.25_f64.to_radians();
    let (_, image) = view(&device, &scene);
    let middle = (45 * 160 + 80) as usize;
    let exact = DVec3::new(1.0, 0.93, 0.82) * (1.0 / (PI * 0.2665_f64.to_radians().sin().powi(2)));
    let error = |factor| worst(&image, &[(middle, factor * exact)]);
    assert_error("view, the sun itself", 0.01, error(1.0), error(1.02));
}
