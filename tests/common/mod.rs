//! What several tests share: scenes, references, closed forms, devices that watch themselves.

#![allow(dead_code)] // every test uses a part of it

pub mod accuracy;
pub mod closed_forms;
mod device;
pub mod folder;
pub mod glass;
pub mod run;

pub use device::Device;

use assert_cmd::Command;
use glam::{DMat3, DVec2, DVec3};
use nephroid::image_file::RgbImage;
use nephroid::measure;
use nephroid::reference::{FluxReference, Options, Reference, View, caustic, flux_balance, view};
use nephroid::render::{Method, Settings};
use nephroid::scene::{
    self, Atlas, Geometry, LightKind, MaterialKind, Mesh, Object, Rect, Scene, Similarity, Texel,
    Unwrapping,
};
use predicates::prelude::*;
use predicates::str::contains;
use std::collections::HashMap;
use std::f64::consts::TAU;
use std::io::{BufWriter, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::sync::{Arc, LazyLock, Mutex, OnceLock};

pub fn scene_path(name: &str) -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("assets/scenes")
        .join(name)
}

/// The names of all shipped scenes, in order.
pub fn shipped() -> Vec<String> {
    let mut names: Vec<_> = (scene_path("").read_dir().unwrap())
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    names
}

/// A shipped scene with light of single surfaces alone, as all methods have it.
pub fn load(name: &str) -> Scene {
    Scene {
        max_interfaces: 1,
        ..load_with_chains(name)
    }
}

/// A shipped scene as it is.
pub fn load_with_chains(name: &str) -> Scene {
    scene::load(&scene_path(name)).unwrap().scene
}

/// The command line.
pub fn nephroid() -> Command {
    let mut command = Command::cargo_bin("nephroid").unwrap();
    command.env(SHADER_CACHE, shader_cache());
    command
}

/// Where Mesa keeps compiled shaders: in the same place for commands whose cache is elsewhere, which would compile all of them again.
const SHADER_CACHE: &str = "MESA_SHADER_CACHE_DIR";

fn shader_cache() -> PathBuf {
    std::env::var_os(SHADER_CACHE)
        .map(PathBuf::from)
        .or_else(dirs::cache_dir)
        .unwrap()
}

/// What a command that succeeds prints with `--json`.
pub fn json(command: &mut Command) -> serde_json::Value {
    let output = command
        .arg("--json")
        .assert()
        .success()
        .get_output()
        .stdout
        .clone();
    serde_json::from_slice(&output).unwrap()
}

/// Fails with an exit code, a message that holds every part, and nothing on stdout.
pub fn refuses(command: &mut Command, code: i32, parts: &[&str]) {
    let mut assert = command.assert().code(code).stdout("");
    for part in ["error: "].iter().chain(parts) {
        assert = assert.stderr(contains(*part));
    }
    assert.stderr(contains("panicked").not());
}

pub fn object_mut<'a>(scene: &'a mut Scene, name: &str) -> &'a mut Object {
    let index = scene.object_index(name).unwrap();
    &mut scene.objects[index]
}

pub fn rect(scene: &Scene, name: &str) -> Rect {
    match scene.objects[scene.object_index(name).unwrap()].geometry {
        Geometry::Rect(rect) => rect,
        _ => panic!("{name} is not a rect"),
    }
}

/// The scene with another light map on one receiver.
pub fn with_texels(mut scene: Scene, receiver: &str, texels: [u32; 2]) -> Scene {
    object_mut(&mut scene, receiver).light_map = Some(texels);
    scene
}

/// Gives all light maps of the scene this size.
pub fn set_light_maps(scene: &mut Scene, texels: [u32; 2]) {
    let maps = (scene.objects.iter_mut()).filter_map(|object| object.light_map.as_mut());
    maps.for_each(|light_map| *light_map = texels);
}

/// The scene with `receiver` as the only one that has a light map.
pub fn only_receiver(mut scene: Scene, receiver: &str, texels: [u32; 2]) -> Scene {
    for object in &mut scene.objects {
        object.light_map = (object.name == receiver).then_some(texels);
    }
    scene
}

/// The scene with every sun's irradiance, lamp's flux and environment's radiance times `factor`.
pub fn brighter(mut scene: Scene, factor: f64) -> Scene {
    for light in &mut scene.lights {
        match &mut light.kind {
            LightKind::Sun { irradiance, .. } => *irradiance *= factor,
            LightKind::Lamp { radiant_flux, .. } => *radiant_flux *= factor,
            LightKind::Environment { scale, .. } => *scale *= factor,
        }
    }
    scene
}

/// The scene with a receiver one texel further along its edge_u.
pub fn shifted_by_a_texel(mut scene: Scene, receiver: &str) -> Scene {
    let object = object_mut(&mut scene, receiver);
    let width = object.light_map.unwrap()[0];
    if let Geometry::Rect(rect) = &mut object.geometry {
        rect.origin += rect.edge_u / f64::from(width);
    }
    scene
}

/// The scene with an object turned about the y axis, rad, and moved, m.
pub fn moved(mut scene: Scene, object: &str, angle: f64, shift: DVec3) -> Scene {
    let by = Similarity {
        scale: 1.0,
        rotation: DMat3::from_rotation_y(angle),
        shift,
    };
    let object = object_mut(&mut scene, object);
    object.geometry = object.geometry.moved(&by);
    scene
}

/// The scene under a sun of this angular radius, degrees.
pub fn with_sun_of(mut scene: Scene, degrees: f64) -> Scene {
    if let LightKind::Sun { angular_radius, .. } = &mut scene.lights[0].kind {
        *angular_radius = degrees.to_radians();
    }
    scene
}

/// Unit vector toward the first light, a sun.
pub fn toward_sun(scene: &Scene) -> DVec3 {
    match scene.lights[0].kind {
        LightKind::Sun { direction, .. } => direction,
        _ => panic!("the first light is no sun"),
    }
}

pub fn solve(scene: &Scene, receiver: &str, texels: [u32; 2], options: &Options) -> Reference {
    let receiver = scene.object_index(receiver).unwrap();
    let cancel = AtomicBool::new(false);
    caustic(scene, receiver, texels, options, &mut |_| {}, &cancel).unwrap()
}

/// The reference's view.
pub fn see(scene: &Scene, size: [u32; 2], options: &Options) -> View {
    view(scene, size, options, &mut |_| {}, &AtomicBool::new(false)).unwrap()
}

/// The reference's balance of flux.
pub fn balance(scene: &Scene, seed: u32) -> FluxReference {
    let found = flux_balance(scene, seed, &AtomicBool::new(false));
    found.unwrap().expect("light comes in")
}

/// [`solve`] to this error, once in a process: tests that need the same truth share it.
pub fn truth(scene: &Scene, receiver: &str, texels: [u32; 2], options: &Options) -> Arc<Reference> {
    type Truths = HashMap<blake3::Hash, Arc<OnceLock<Arc<Reference>>>>;
    static TRUTHS: LazyLock<Mutex<Truths>> = LazyLock::new(Mutex::default);
    let mut hasher = BufWriter::new(blake3::Hasher::new());
    write!(hasher, "{scene:?} {receiver:?} {texels:?} {options:?}").unwrap();
    let key = hasher.into_inner().unwrap().finalize();
    let cell = (TRUTHS.lock().unwrap().entry(key).or_default()).clone();
    // Solved without the lock: others may solve other scenes at the same time.
    cell.get_or_init(|| Arc::new(solve(scene, receiver, texels, options)))
        .clone()
}

pub fn options(error: f64) -> Options {
    Options {
        error,
        ..Options::default()
    }
}

pub fn footprint(samples: u32) -> Settings {
    method(Method::Footprint, samples)
}

pub fn method(method: Method, samples: u32) -> Settings {
    Settings {
        method,
        samples,
        ..Settings::default()
    }
}

/// Settings of `footprint` with this error to aim for.
pub fn aiming_for(error: f32) -> Settings {
    Settings {
        error: Some(error),
        ..Settings::default()
    }
}

/// The error of what is tested stays within the bound, and the error of its perturbed twin, found
/// in the same way, does not. Prints both, for `--nocapture`.
pub fn assert_error(what: &str, bound: f64, error: f64, perturbed: f64) {
    println!("{what}: {error:.6}, bound {bound}, perturbed {perturbed:.6}");
    assert!(error <= bound, "{what}: {error} > {bound}");
    assert!(
        perturbed > bound,
        "{what}: the perturbed {perturbed} passes"
    );
}

/// [`assert_error`] with three standard errors of the reference, of which the error has one `noise`, to spare on either side of
/// the bound: with other random numbers of the reference the test says the same.
pub fn assert_error_beyond_noise(what: &str, bound: f64, noise: f64, error: f64, perturbed: f64) {
    println!("{what}: noise {noise:.6}");
    assert_error(what, bound, error + 3.0 * noise, perturbed - 3.0 * noise);
}

/// Largest standard error that [`l1`] to a reference has by its noise: |A − B| changes no more than B, and the channels of a texel
/// change together.
pub fn l1_noise(reference: &Reference) -> f64 {
    let squares = (reference.standard_error.iter()).map(|sigma| sigma.iter().sum::<f64>().powi(2));
    squares.sum::<f64>().sqrt() / reference.irradiance.as_flattened().iter().sum::<f64>()
}

/// Standard error of the flux in a reference's map with these areas of texels, m², RGB, W. A ray that lands in one texel misses
/// the others, so that it is a little less.
pub fn flux_noise(reference: &Reference, areas: impl Iterator<Item = f64>) -> [f64; 3] {
    let mut squares = [0.0; 3];
    for (sigma, area) in reference.standard_error.iter().zip(areas) {
        (0..3).for_each(|c| squares[c] += (area * sigma[c]).powi(2));
    }
    squares.map(f64::sqrt)
}

/// (A − B)² / (σ_A² + σ_B²) has the mean 1 over two solutions, values and standard errors, if the standard errors are honest.
pub fn assert_errors_are_honest(name: &str, solutions: [[&[[f64; 3]]; 2]; 2]) {
    let [[one, sigma_one], [two, sigma_two]] = solutions;
    let chi_squared = |scale: f64| -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for i in 0..one.len() {
            let variance = sigma_one[i][0].powi(2) + sigma_two[i][0].powi(2);
            // Well-lit values, whose replicates are close to normal.
            if one[i][0] > 0.01 && variance > 0.0 {
                let difference = one[i][0] - two[i][0];
                sum += difference * difference / (scale * scale * variance);
                count += 1.0;
            }
        }
        assert!(count > 200.0, "{name}: {count}");
        sum / count
    };
    // 15 or more degrees of freedom in σ: mean ν/(ν − 2) ≤ 1.15 rather than 1.
    let honest = 0.85..1.3;
    let found = chi_squared(1.0);
    assert!(honest.contains(&found), "{name}: {found}");
    for (scale, what) in [(0.8, "small"), (1.25, "large")] {
        let passes = honest.contains(&chi_squared(scale));
        assert!(!passes, "{name}: too {what} a bar passes");
    }
}

/// Σ|A − B| / ΣB
pub fn l1(a: &RgbImage, b: &RgbImage) -> f64 {
    measure::compare(a, b).unwrap().l1.unwrap()
}

pub fn scaled(image: &RgbImage, factor: f32) -> RgbImage {
    tinted(image, [factor; 3])
}

pub fn tinted(image: &RgbImage, factor: [f32; 3]) -> RgbImage {
    RgbImage {
        pixels: (image.pixels.iter())
            .map(|rgb| [0, 1, 2].map(|c| factor[c] * rgb[c]))
            .collect(),
        ..*image
    }
}

/// Flux in a receiver's map, RGB, W.
pub fn flux(map: &RgbImage, rect: &Rect) -> [f64; 3] {
    let texel = rect.area() / map.pixels.len() as f64;
    let mut sum = [0.0; 3];
    for rgb in &map.pixels {
        (0..3).for_each(|c| sum[c] += texel * f64::from(rgb[c]));
    }
    sum
}

/// Largest |A/B − 1| of the channels.
pub fn ratio_error(a: [f64; 3], b: [f64; 3]) -> f64 {
    (0..3)
        .map(|c| (a[c] / b[c] - 1.0).abs())
        .fold(0.0, f64::max)
}

pub fn bits(image: &RgbImage) -> Vec<u32> {
    let values = image.pixels.as_flattened();
    values.iter().map(|value| value.to_bits()).collect()
}

/// No NaN, no infinity, nothing below zero.
pub fn assert_physical(image: &RgbImage) {
    let physical = |rgb: &[f32; 3]| rgb.iter().all(|v| v.is_finite() && *v >= 0.0);
    let bad = image.pixels.iter().position(|rgb| !physical(rgb));
    assert_eq!(bad, None, "index of the first bad texel");
}

/// The middles of a receiver's texels, in the order of the map.
pub fn middles(scene: &Scene, receiver: &str, [width, height]: [u32; 2]) -> Vec<DVec3> {
    let rect = rect(scene, receiver);
    (0..width * height)
        .map(|i| {
            let u = (f64::from(i % width) + 0.5) / f64::from(width);
            let v = 1.0 - (f64::from(i / width) + 0.5) / f64::from(height);
            rect.origin + u * rect.edge_u + v * rect.edge_v
        })
        .collect()
}

/// Mean of a function of the distance to the y axis over a square texel around `middle`.
pub fn texel_mean(middle: DVec3, side: f64, value: impl Fn(f64) -> f64) -> f64 {
    let steps = 8;
    let offset = |i: i32| side * ((f64::from(i) + 0.5) / f64::from(steps) - 0.5);
    let sum: f64 = (0..steps * steps)
        .map(|i| value((middle.x + offset(i % steps)).hypot(middle.z + offset(i / steps))))
        .sum();
    sum / f64::from(steps * steps)
}

/// The inside of a cylinder around the y axis, from y = 0 to `height`.
pub fn hollow_cylinder(radius: f64, height: f64, facets: u32) -> Mesh {
    let mut mesh = Mesh::default();
    for i in 0..=facets {
        let (sine, cosine) = (TAU * f64::from(i) / f64::from(facets)).sin_cos();
        let inward = -DVec3::new(cosine, 0.0, sine);
        for y in [0.0, height] {
            mesh.positions.push(y * DVec3::Y - radius * inward);
            mesh.normals.push(inward);
        }
        if i < facets {
            let [a, b, c, d] = [0, 1, 2, 3].map(|corner| 2 * i + corner);
            mesh.triangles.extend([[a, c, d], [a, d, b]]);
        }
    }
    mesh
}

/// A diffuse mesh with a light map of `texels`, laid out by its `own` coordinates or, without them, unwrapped.
pub fn mesh_receiver(
    name: &str,
    material: usize,
    mesh: Mesh,
    own: Vec<[DVec2; 3]>,
    texels: [u32; 2],
) -> Object {
    let mesh = Arc::new(mesh);
    Object {
        light_map: Some(texels),
        unwrapping: Some(Arc::new(Unwrapping {
            rest: mesh.clone(),
            own,
        })),
        ..Object::new(name, material, Geometry::Mesh(mesh))
    }
}

pub fn floor(half: f64, y: f64) -> Geometry {
    Geometry::Rect(Rect {
        origin: DVec3::new(-half, y, half),
        edge_u: 2.0 * half * DVec3::X,
        edge_v: -2.0 * half * DVec3::Z,
    })
}

pub const RING_HEIGHT: f64 = 0.4;

/// A ring mirror of radius 1 m over a floor, and a point of light in the direction of +x.
pub fn ring(elevation: f64, blocks_light: bool) -> Scene {
    let mut scene = load("mirror.toml");
    scene.lights[0].kind = LightKind::Sun {
        direction: DVec3::new(elevation.cos(), elevation.sin(), 0.0),
        irradiance: DVec3::ONE,
        angular_radius: 0.0,
    };
    scene.materials[0].kind = MaterialKind::Mirror {
        reflectance: DVec3::ONE,
    };
    scene.objects[0].geometry = Geometry::Mesh(hollow_cylinder(1.0, RING_HEIGHT, 1024).into());
    scene.objects[1].geometry = floor(1.0, 0.0);
    for object in &mut scene.objects {
        object.blocks_light = blocks_light;
    }
    scene
}

/// The program, which listens to Ctrl-C: a shell has what it starts in the background ignore it, and children
/// inherit that.
#[cfg(unix)]
pub fn program() -> std::process::Command {
    use std::os::unix::process::CommandExt;
    let mut command = std::process::Command::new(assert_cmd::cargo::cargo_bin("nephroid"));
    command.env(SHADER_CACHE, shader_cache());
    // SAFETY: only a call that may be made between fork and exec.
    unsafe {
        command.pre_exec(|| {
            libc::signal(libc::SIGINT, libc::SIG_DFL);
            libc::signal(libc::SIGHUP, libc::SIG_DFL);
            Ok(())
        });
    }
    command
}

/// The texels of the light map of a mesh, and the layout that they are from.
pub fn texels(scene: &Scene, name: &str) -> (Atlas, Vec<Texel>) {
    let object = &scene.objects[scene.object_index(name).unwrap()];
    let (atlas, _) = Atlas::of(object, object.light_map.unwrap()).unwrap();
    let texels = atlas.texels(&object.geometry.mesh());
    (atlas, texels)
}
