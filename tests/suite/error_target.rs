//! The error that is aimed for, estimated and found, on meshes that are irregular.

use crate::common::{
    Device, aiming_for, assert_error, load, load_with_chains, method, moved, nephroid,
    only_receiver, options, scaled, scene_path,
};
use approx::relative_eq;
use assert_cmd::assert::Assert;
use glam::DVec3;
use nephroid::image_file::RgbImage;
use nephroid::measure::l1_without_noise;
use nephroid::measure::stress::random::random_scene;
use nephroid::reference::Reference;
use nephroid::render::{EXPECTED_ERROR, MAX_PATCHES, Method, Settings};
use nephroid::scene::Scene;
use predicates::prelude::*;
use predicates::str::contains;
use std::ops::RangeInclusive;
use std::path::Path;
use std::sync::Arc;
use std::time::Duration;

const TEXELS: [u32; 2] = [96, 96];
/// Expected L1 error of the references.
const NOISE: f64 = 0.01;
const SCENES: [&str; 4] = ["mesh_cage", "mesh_rock", "mesh_animal", "mesh_part"];

fn scene(name: &str) -> Scene {
    only_receiver(load(&format!("{name}.toml")), "floor", TEXELS)
}

/// The scene with `receiver` as its floor, which alone has a light map.
fn only_floor(mut scene: Scene, receiver: &str, texels: [u32; 2]) -> Scene {
    let index = scene.object_index(receiver).unwrap();
    for object in &mut scene.objects {
        if object.name == "floor" {
            object.name = "another floor".into();
        }
    }
    scene.objects[index].name = "floor".into();
    only_receiver(scene, "floor", texels)
}

/// Estimate over error.
const ESTIMATED: RangeInclusive<f64> = 0.5..=2.0;

/// The largest estimate of a light map that keeps its target.
fn largest_estimate(target: f32) -> f64 {
    1.001 * f64::from(EXPECTED_ERROR * target)
}

/// A light map by an error target.
struct Found {
    map: RgbImage,
    truth: Arc<Reference>,
    estimated: f64,
    patches: u32,
}

impl Found {
    /// The map of the floor of `scene`, and the reference of `truth` with this `noise`.
    fn new(device: &Device, scene: &Scene, truth: &Scene, target: f32, noise: f64) -> Self {
        let floor = scene.object_index("floor").unwrap();
        let texels = scene.objects[floor].light_map.unwrap();
        let mut renderer = device.renderer(scene, &aiming_for(target));
        renderer.caustic().unwrap();
        Self {
            map: renderer.read_caustic(floor).unwrap(),
            truth: crate::common::truth(truth, "floor", texels, &options(noise)),
            estimated: renderer.estimated_error().unwrap().unwrap().into(),
            patches: renderer.samples().unwrap(),
        }
    }

    fn error(&self) -> f64 {
        l1_without_noise(&self.map, &self.truth).unwrap()
    }

    /// The error with 5 % too much light.
    fn perturbed(&self) -> f64 {
        l1_without_noise(&scaled(&self.map, 1.05), &self.truth).unwrap()
    }
}

#[test]
fn the_error_is_kept_and_estimated() {
    let device = Device::open();
    for name in SCENES {
        let scene = scene(name);
        let target = 0.02;
        let found = Found::new(&device, &scene, &scene, target, NOISE);
        let (estimated, error) = (found.estimated, found.error());
        println!("{name}: estimated {estimated}, found {error}");
        assert!(estimated <= largest_estimate(target), "{name}: {estimated}");
        assert!(
            ESTIMATED.contains(&(estimated / error)),
            "{name}: {estimated} {error}"
        );
        let what = format!("{name}, target 2 %");
        assert_error(&what, 0.025, error, found.perturbed());
    }
}

/// The rim of the ring and the facets of a ball show the sun's disc along their outlines, which parallelograms for disc and texel do
/// not: the errors were 3.8, 2.4 and about 10 %.
#[test]
fn outlines_show_the_disc() {
    let device = Device::open();
    let lit_wall = |wall| only_floor(load("ring.toml"), wall, [128, 78]);
    // Without shadows on itself.
    let mut facets = random_scene(5);
    for object in &mut facets.objects {
        object.blocks_light = false;
    }
    let facets = only_floor(facets, "receiver", TEXELS);
    // The facets miss the target: perspective and small kernels take more than the estimate says.
    for (name, scene, bound) in [
        ("wall_x", lit_wall("wall_x"), 0.015),
        ("wall_z", lit_wall("wall_z"), 0.015),
        ("facets", facets, 0.025),
    ] {
        let found = Found::new(&device, &scene, &scene, 0.02, NOISE);
        let error = found.error();
        println!("{name}: estimated {}, found {error}", found.estimated);
        let what = format!("{name}, target 2 %");
        assert_error(&what, bound, error, found.perturbed());
    }
}

/// The same with light that rough mirrors throw on themselves. Its rays are few before they are refined where it lands.
#[test]
fn the_error_of_chains_is_kept_and_estimated() {
    let device = Device::open();
    let with_chains =
        |name: &str| only_receiver(load_with_chains(&format!("{name}.toml")), "floor", TEXELS);
    let random = |number| only_floor(random_scene(number), "receiver", TEXELS);
    for (name, scene, target, noise, bound) in [
        ("mesh_part", with_chains("mesh_part"), 0.02, 0.012, 0.02),
        ("mesh_scan", with_chains("mesh_scan"), 0.02, 0.012, 0.03),
        ("random 8", random(8), 0.05, 0.015, 0.06),
        ("random 12", random(12), 0.05, 0.015, 0.06),
    ] {
        let found = Found::new(&device, &scene, &scene, target, noise);
        let (estimated, error) = (found.estimated, found.error());
        println!("{name}: estimated {estimated}, found {error}");
        assert!(
            estimated <= largest_estimate(target) && ESTIMATED.contains(&(estimated / error)),
            "{name}: {estimated} {error}"
        );
        // Without that light.
        let one = Scene {
            max_interfaces: 1,
            ..scene.clone()
        };
        let without = Found::new(&device, &one, &scene, target, noise).error();
        let what = format!("{name} with chains, target {target}");
        assert_error(&what, bound, error, without);
    }
}

/// The curvature of an image counts where a facet sends a part of its light past the receiver's plane, so that such facets are divided.
#[test]
fn light_past_the_horizon_is_divided() {
    let device = Device::open();
    let scene = only_floor(random_scene(16), "receiver", TEXELS);
    let found = Found::new(&device, &scene, &scene, 0.05, 0.015);
    println!("estimated {}, found {}", found.estimated, found.error());
    let mut renderer = device.renderer(&scene, &method(Method::Footprint, 1));
    renderer.caustic().unwrap();
    let floor = scene.object_index("floor").unwrap();
    let undivided = renderer.read_caustic(floor).unwrap();
    let undivided = l1_without_noise(&undivided, &found.truth).unwrap();
    assert_error("random 16, target 5 %", 0.05, found.error(), undivided);
}

/// Smaller targets take more patches, beyond what the first buffers hold, and leave smaller errors.
#[test]
fn a_smaller_target_takes_more_patches() {
    let device = Device::open();
    let scene = scene("mesh_animal");
    let [coarse, middle, fine] = [0.06, 0.02, 0.008].map(|target| {
        let found = Found::new(&device, &scene, &scene, target, NOISE);
        (found.estimated, found.error(), found.patches)
    });
    let all = format!("{coarse:?} {middle:?} {fine:?}");
    assert!(coarse.0 > middle.0 && middle.0 > fine.0, "{all}");
    assert!(coarse.1 > middle.1 && middle.1 > fine.1, "{all}");
    assert!(4 * coarse.2 < middle.2 && 2 * middle.2 < fine.2, "{all}");
    assert!((1 << 16..MAX_PATCHES).contains(&fine.2), "{all}");
}

/// Buffers that grow are bound to the same pipelines.
#[test]
fn growth_makes_no_pipeline() {
    let device = Device::unwatched();
    let mut renderer = device.renderer(&scene("mesh_animal"), &aiming_for(0.008));
    let before = device.0.pipeline_count();
    renderer.caustic().unwrap();
    assert!(renderer.samples().unwrap() > 1 << 16, "nothing grew");
    assert_eq!(device.0.pipeline_count(), before);
}

/// The same scene gives the same patches, whatever was shown before: nothing depends on history.
#[test]
fn a_frame_depends_on_its_scene_alone() {
    let device = Device::open();
    let scene = scene("mesh_cage");
    let turned = moved(scene.clone(), "head", 0.7, DVec3::ZERO);
    let settings = aiming_for(0.03);
    let floor = scene.object_index("floor").unwrap();
    let mut renderer = device.renderer(&scene, &settings);
    let mut map = |scene: &Scene| {
        renderer.update(scene).unwrap();
        renderer.caustic().unwrap();
        renderer.read_caustic(floor).unwrap().pixels
    };
    let (first, other, again) = (map(&scene), map(&turned), map(&scene));
    assert!(first == again && first != other);
}

/// A budget that no frame meets gives the coarsest frames, one that every frame meets ever finer ones.
#[test]
fn a_budget_decides_the_error() {
    let device = Device::open();
    let scene = scene("mesh_cage");
    let estimates = |milliseconds: u64, frames: usize| {
        let settings = Settings {
            budget: Some(Duration::from_millis(milliseconds)),
            ..Settings::default()
        };
        let mut renderer = device.renderer(&scene, &settings);
        let estimates: Vec<f32> = (0..frames)
            .map(|_| {
                renderer.caustic().unwrap();
                renderer.estimated_error().unwrap().unwrap()
            })
            .collect();
        (estimates, renderer.budget().unwrap().is_met())
    };
    let (coarse, is_met) = estimates(0, 6);
    assert!(
        is_met && coarse.is_sorted() && coarse[5] > coarse[0] && coarse[5] == coarse[4],
        "{coarse:?}"
    );
    let (finer, is_met) = estimates(1_000_000, 6);
    assert!(!is_met && finer[0] == coarse[0], "{finer:?}");
    let steps: Vec<f32> = finer.windows(2).map(|pair| pair[0] / pair[1]).collect();
    // Where the buffers are full, the step is smaller; then they grow.
    let full: Vec<f32> = (steps.iter().copied())
        .filter(|step| !relative_eq!(*step, 1.5, max_relative = 1e-3))
        .collect();
    assert!(
        full.len() == 1 && (1.2..1.49).contains(&full[0]) && steps[4] != full[0],
        "{finer:?}"
    );
}

/// An error that is set later gives the same bits as one that is set at first.
#[test]
fn the_error_can_change() {
    let device = Device::open();
    let scene = scene("mesh_rock");
    let floor = scene.object_index("floor").unwrap();
    let mut fixed = device.renderer(&scene, &aiming_for(0.02));
    fixed.caustic().unwrap();
    let mut changed = device.renderer(&scene, &aiming_for(0.035));
    changed.caustic().unwrap();
    let before = changed.read_caustic(floor).unwrap().pixels;
    changed.set_error(0.02);
    changed.caustic().unwrap();
    let after = changed.read_caustic(floor).unwrap().pixels;
    assert!(after != before && after == fixed.read_caustic(floor).unwrap().pixels);
}

/// The command `bake` with these options.
fn bake_mirror(options: &[&str], output: &Path) -> Assert {
    let mut bake = nephroid();
    bake.arg("bake").arg(scene_path("mirror.toml"));
    bake.args(["--lightmap", "32"]).args(options);
    bake.arg("-o").arg(output).assert()
}

#[test]
fn budgets_on_the_command_line() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("a.exr");
    let bake = |arguments: &[&str]| bake_mirror(arguments, &output);
    for budget in ["0", "-5", "nan", "1e-9", "inf", "five"] {
        bake(&[&format!("--budget-ms={budget}")])
            .code(2)
            .stderr(contains("give milliseconds"));
    }
    bake(&["--budget-ms=5", "--error=0.02"])
        .code(2)
        .stderr(contains("--error"));
    bake(&["--budget-ms=5", "--method=pinhole"]).code(2).stderr(
        contains("--budget-ms is an option of the method footprint, not of pinhole")
            .and(contains("remedy")),
    );
    assert!(!output.exists());
    bake(&["--budget-ms=100000", "--json"])
        .success()
        .stdout(contains("budgeted"));
    bake(&["--budget-ms=0.1"])
        .success()
        .stderr(contains("above the budget of 0.1 ms"));
    assert!(output.exists());
}

#[test]
fn impossible_targets_are_refused() {
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("a.exr");
    let bake = |arguments: &[&str]| bake_mirror(arguments, &output);
    for target in ["0", "-0.01", "nan", "1e-9", "2", "two"] {
        bake(&[&format!("--error={target}")])
            .code(2)
            .stderr(contains("relative error"));
    }
    bake(&["--error=0.02", "--samples=100"])
        .code(2)
        .stderr(contains("--samples"));
    bake(&["--error=0.02", "--method=points"]).code(2).stderr(
        contains("--error is an option of the method footprint, not of points")
            .and(contains("remedy")),
    );
    assert!(!output.exists());
    // Below what the method can do: the best that it can, and a note.
    bake(&["--error=0.0001"])
        .success()
        .stderr(contains("above the 0.01 % to aim for"));
    assert!(output.exists());
}
