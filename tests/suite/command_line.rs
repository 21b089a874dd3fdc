//! What the command line says and returns, above all where the input is bad.

use crate::common::{json, nephroid, refuses, scene_path as scene};
use assert_cmd::Command;
use nephroid::image_file::{RgbImage, write_exr, write_png};
use predicates::prelude::*;
use predicates::str::contains;
use std::path::{Path, PathBuf};

fn reference(scene: &Path, output: &Path) -> Command {
    let mut command = nephroid();
    command.args(["reference", "--no-cache"]);
    command.arg(scene).arg("-o").arg(output);
    command
}

#[test]
fn reference_writes_a_map_that_compares_with_itself() {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("map.exr");
    let mut command = reference(&scene("mirror.toml"), &map);
    command.args(["--lightmap", "16", "--error", "0.1"]);
    let summary = json(&mut command);
    assert_eq!(
        (&summary["width"], &summary["height"]),
        (&16.into(), &16.into())
    );
    assert!(summary["relative_error"].as_f64().unwrap() <= 0.1);
    assert!(summary["received_flux"][0].as_f64().unwrap() > 0.1);

    let mut command = nephroid();
    let comparison = json(command.arg("compare").args([&map, &map]));
    assert_eq!(comparison["l1"], 0.0);
    assert_eq!(comparison["energy_ratio"], 1.0);
    let left: Vec<_> = std::fs::read_dir(folder.path()).unwrap().collect();
    assert_eq!(left.len(), 1, "no temporary file is left");
}

#[test]
fn references_of_frames_are_numbered() {
    let folder = tempfile::tempdir().unwrap();
    let mut frames = reference(&scene("pool.toml"), &folder.path().join("map.exr"));
    frames.args([
        "--receiver",
        "floor",
        "--lightmap",
        "8",
        "--error",
        "0.2",
        "--frames",
        "0-1",
    ]);
    let report = json(&mut frames);
    assert_eq!(report["frames"].as_array().unwrap().len(), 2);
    let [first, second] = ["map.0000.exr", "map.0001.exr"].map(|name| folder.path().join(name));
    assert_ne!(json(&mut compare(&first, &second))["l1"], 0.0);
    let mut still = reference(&scene("pool.toml"), &first);
    still.args(["--receiver", "floor", "--lightmap", "8", "--error", "0.2"]);
    json(still.args(["--time", &(1.0f64 / 24.0).to_string()]));
    assert_eq!(json(&mut compare(&first, &second))["l1"], 0.0);
}

/// A small view of `mirror.toml`.
fn reference_view(output: &Path) -> Command {
    let mut command = reference(&scene("mirror.toml"), output);
    command.args(["--view", "--error", "0.2"]);
    command
}

#[test]
fn views_have_standard_errors_and_are_compared_by_flip() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = ["a.exr", "b.exr"].map(|name| folder.path().join(name));
    let summary = json(reference_view(&a).args(["--size", "24x16"]));
    assert_eq!([&summary["width"], &summary["height"]], [24, 16]);
    assert!(summary["relative_error"].as_f64().unwrap() <= 0.2);
    assert!(summary["exposure_ev"].is_number() && summary["receiver"].is_null());
    let text = reference_view(&b)
        .args(["--size", "24x16", "--seed", "1"])
        .assert();
    text.success()
        .stdout(contains("b.exr: view 24x16").and(contains("flux").not()));
    let file = exr::prelude::read_all_flat_layers_from_file(&a).unwrap();
    let names: Vec<String> = (file.layer_data[0].channel_data.list.iter())
        .map(|channel| channel.name.to_string())
        .collect();
    assert_eq!(names, ["B", "G", "R", "error.B", "error.G", "error.R"]);

    let report = json(&mut compare(&a, &b));
    let mean = report["flip"]["mean"].as_f64().unwrap();
    assert!(mean > 0.0 && mean < 0.5, "{mean}");
    let exposure = &report["flip"]["exposure_ev"];
    assert_eq!(exposure, &summary["exposure_ev"]);
    assert_eq!(json(&mut compare(&a, &a))["flip"]["mean"], 0.0);
    let asked = json(compare(&a, &b).args(["--exposure", "-5"]));
    assert_eq!(asked["flip"]["exposure_ev"], -5.0);
    assert!(asked["flip"]["mean"].as_f64().unwrap() < mean);
    let text = compare(&a, &b).assert().success();
    text.stdout(contains("FLIP").and(contains("worst region  columns ")));

    // Frames of views are compared by FLIP, too; light maps are not, unless an exposure is given.
    let frames = folder.path().join("frames");
    std::fs::create_dir(&frames).unwrap();
    let mut command = reference_view(&frames.join("v.exr"));
    json(command.args(["--size", "8x8", "--frames", "0-1"]));
    let report = json(&mut compare(&frames, &frames));
    assert_eq!(report["flip"]["worst_frame"], "v.0001.exr");
    // The extension may be in capitals.
    for frame in std::fs::read_dir(&frames).unwrap() {
        let frame = frame.unwrap().path();
        std::fs::rename(&frame, frame.with_extension("EXR")).unwrap();
    }
    let report = json(&mut compare(&frames, &frames));
    assert_eq!(report["flip"]["worst_frame"], "v.0001.EXR");
    let map = grey(folder.path(), "map.exr", 2, 1.0);
    assert!(json(&mut compare(&map, &map))["flip"].is_null());
    let text = compare(&map, &map).assert().success();
    text.stdout(contains("FLIP").not());
    assert!(json(compare(&map, &map).args(["--exposure", "0"]))["flip"].is_object());
    refuses(
        compare(&map, &map).args(["--exposure", "nan"]),
        2,
        &["--exposure", "give stops"],
    );
}

#[test]
fn bad_input_of_views() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("view.exr");
    for size in ["0x0", "0x10", "100000x10", "10x100000", "10", "axb", "-1x4"] {
        let size = format!("--size={size}");
        let parts = ["--size", "give WIDTHxHEIGHT in 1 to 16384 pixels"];
        refuses(reference_view(&file).arg(size), 2, &parts);
    }
    for other in ["--receiver=floor", "--lightmap=8"] {
        let parts = [
            "--view",
            other.split('=').next().unwrap(),
            "cannot be used with",
        ];
        refuses(reference_view(&file).arg(other), 2, &parts);
    }
    let mut command = reference(&scene("mirror.toml"), &file);
    refuses(command.args(["--size", "8x8"]), 2, &["--view", "required"]);
    assert!(!file.exists());
}

#[test]
fn too_few_samples_are_said_on_stderr() {
    let folder = tempfile::tempdir().unwrap();
    let mut command = reference(&scene("mirror.toml"), &folder.path().join("map.exr"));
    command.args(["--lightmap", "64", "--max-samples", "1"]);
    command
        .assert()
        .success()
        .stderr(contains("warning: stopped after"));
}

#[test]
fn bad_input_of_reference() {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("map.exr");
    let ring = scene("ring.toml");
    refuses(
        &mut reference(Path::new("none.toml"), &map),
        3,
        &["none.toml", "remedy"],
    );
    let names = ["`roof`", "floor, wall_x, wall_z"];
    refuses(
        reference(&ring, &map).args(["--receiver", "roof"]),
        2,
        &names,
    );
    // An object, but not one that receives.
    refuses(
        reference(&ring, &map).args(["--receiver", "ring"]),
        2,
        &["floor, wall_x, wall_z"],
    );
    refuses(
        &mut reference(&ring, &map),
        2,
        &["3 receivers", "floor, wall_x, wall_z"],
    );
    for size in ["0", "100000", "16x0", "many", "-1"] {
        let size = format!("--lightmap={size}");
        refuses(
            reference(&ring, &map).arg(size),
            2,
            &["--lightmap", "WIDTHxHEIGHT"],
        );
    }
    for error in ["0", "-1", "nan", "2"] {
        let error = format!("--error={error}");
        let command = &mut reference(&ring, &map);
        refuses(
            command.args(["--receiver", "floor"]).arg(error),
            2,
            &["error"],
        );
    }
    refuses(
        reference(&ring, &map).arg("--max-samples=0"),
        2,
        &["--max-samples", "0 is not in 1.."],
    );
    assert!(!map.exists());
}

#[test]
fn unwritable_output_is_found_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let mirror = scene("mirror.toml");
    let missing = folder.path().join("missing/map.exr");
    refuses(
        &mut reference(&mirror, &missing),
        2,
        &["missing/map.exr", "remedy"],
    );
    let is_folder = folder.path().join("folder.exr");
    std::fs::create_dir(&is_folder).unwrap();
    refuses(
        &mut reference(&mirror, &is_folder),
        2,
        &["folder.exr", "it is a folder"],
    );
    refuses(
        &mut reference(&mirror, &folder.path().join("map.png")),
        2,
        &["map.png", ".exr"],
    );
    // The name is checked before the work, which would take hours at this error.
    let long = folder.path().join(format!("{}.exr", "a".repeat(300)));
    refuses(
        reference(&mirror, &long).args(["--error", "1e-9"]),
        2,
        &["File name too long", "choose a shorter name"],
    );
}

/// What a scene is read from stays, by whatever path the output names it.
#[test]
fn a_picture_does_not_replace_a_file_of_its_scene() {
    let folder = tempfile::tempdir().unwrap();
    let at = |name: &str| folder.path().join(name);
    let file = at("scene.exr");
    std::fs::copy(scene("mirror.toml"), &file).unwrap();
    std::fs::create_dir(at("inner")).unwrap();
    for output in ["scene.exr", "inner/../scene.exr"] {
        let parts = ["is a file of the scene", "remedy: write to another file"];
        refuses(&mut reference(&file, &at(output)), 2, &parts);
    }
    let kept = std::fs::read(&file).unwrap();
    assert_eq!(kept, std::fs::read(scene("mirror.toml")).unwrap());
}

fn grey(folder: &Path, name: &str, width: u32, value: f32) -> PathBuf {
    let path = folder.join(name);
    let image = RgbImage {
        width,
        height: 2,
        pixels: vec![[value; 3]; 2 * width as usize],
    };
    write_exr(&path, &image, &[], "test").unwrap();
    path
}

fn compare(a: &Path, b: &Path) -> Command {
    let mut command = nephroid();
    command.arg("compare").args([a, b]);
    command
}

#[test]
fn bad_input_of_compare() {
    let folder = tempfile::tempdir().unwrap();
    let small = grey(folder.path(), "small.exr", 2, 1.0);
    let large = grey(folder.path(), "large.exr", 3, 1.0);
    refuses(&mut compare(&small, &large), 2, &["2x2 and 3x2", "remedy"]);
    refuses(
        &mut compare(&small, Path::new("none.exr")),
        3,
        &["none.exr", "remedy"],
    );
    let nan = grey(folder.path(), "nan.exr", 2, f32::NAN);
    refuses(&mut compare(&small, &nan), 3, &["nan.exr", "pixel (0, 0)"]);
    let truncated = folder.path().join("truncated.exr");
    let whole = std::fs::read(&small).unwrap();
    std::fs::write(&truncated, &whole[..whole.len() - 9]).unwrap();
    refuses(&mut compare(&truncated, &small), 3, &["truncated.exr"]);
    let text = folder.path().join("text.exr");
    std::fs::write(&text, "no image").unwrap();
    refuses(&mut compare(&text, &small), 3, &["text.exr", "EXR"]);
    refuses(&mut compare(folder.path(), &small), 3, &["remedy"]);
}

/// A target is a picture in sRGB of twice the map's size, or an EXR file.
#[test]
fn compare_with_a_target_counts_the_distribution_only() {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("map.exr");
    let image = RgbImage {
        width: 2,
        height: 1,
        pixels: vec![[3.0; 3], [30.0; 3]],
    };
    write_exr(&map, &image, &[], "test").unwrap();
    let target = folder.path().join("target.png");
    // Of sRGB, 89 is a tenth of 255 to 0.1 %.
    let row = |dark: u8| [[dark; 6], [255; 6]].concat();
    write_png(&target, 4, 2, &[row(89), row(89)].concat()).unwrap();
    let normalised = |target: &Path| {
        let mut command = compare(&map, target);
        command.arg("--normalise");
        command
    };
    let report = json(&mut normalised(&target));
    assert_eq!(report["size"], serde_json::json!([2, 1]));
    let figure = |report: &serde_json::Value, name: &str| report[name].as_f64().unwrap();
    assert!(figure(&report, "l1") < 0.003, "{report}");
    assert!(figure(&report, "correlation") > 0.999, "{report}");
    assert!((figure(&report, "scale") - 30.0).abs() < 0.1, "{report}");
    assert!(report["flip"]["mean"].as_f64().unwrap() < 0.01, "{report}");
    write_png(&target, 4, 2, &[row(120), row(120)].concat()).unwrap();
    assert!(figure(&json(&mut normalised(&target)), "l1") > 0.1);
    assert_eq!(figure(&json(&mut normalised(&map)), "l1"), 0.0);
    let text = normalised(&target).assert().success();
    text.stdout(contains("correlation   1.000000").and(contains("of the map for 1 of the target")));

    write_png(&target, 4, 1, &row(89)).unwrap();
    refuses(
        &mut normalised(&target),
        2,
        &["2 x 1 texels and the target 4 x 1 pixels", "crop"],
    );
    write_png(&target, 2, 1, &[0; 6]).unwrap();
    refuses(&mut normalised(&target), 2, &["the target holds no light"]);
    std::fs::write(&target, "no image").unwrap();
    refuses(
        &mut normalised(&target),
        3,
        &["target.png", "neither a PNG nor a JPEG"],
    );
    refuses(&mut normalised(folder.path()), 3, &["it is a folder"]);
}

#[test]
fn black_reference_gives_null_and_never_nan() {
    let folder = tempfile::tempdir().unwrap();
    let white = grey(folder.path(), "white.exr", 2, 1.0);
    let black = grey(folder.path(), "black.exr", 2, 0.0);
    let mut command = compare(&white, &black);
    let command = command.arg("--json").assert().success();
    command.stdout(contains("\"l1\": null").and(contains("NaN").not()));
    let text = compare(&white, &black).assert().success();
    text.stdout(contains("L1            undefined").and(contains("NaN").not()));
}

#[test]
fn folders_are_sequences() {
    let folder = tempfile::tempdir().unwrap();
    let [a, b] = ["a", "b"].map(|name| folder.path().join(name));
    for (sequence, values) in [(&a, [1.0, 3.0]), (&b, [1.0, 2.0])] {
        std::fs::create_dir(sequence).unwrap();
        refuses(&mut compare(sequence, sequence), 3, &["no .exr file"]);
        for (frame, value) in values.into_iter().enumerate() {
            grey(sequence, &format!("{frame}.exr"), 2, value);
        }
    }
    let comparison = json(&mut compare(&a, &b));
    assert_eq!(comparison["frames"].as_array().unwrap().len(), 2);
    assert_eq!(comparison["l1"], 1.0 / 3.0);
    assert_eq!(comparison["flicker"], 1.0 / 1.5);
    grey(&a, "2.exr", 2, 1.0);
    refuses(&mut compare(&a, &b), 2, &["do not hold the same frames"]);
}

#[test]
fn usage_errors_exit_with_2() {
    nephroid().assert().code(2);
    nephroid()
        .arg("paint")
        .assert()
        .code(2)
        .stderr(contains("paint"));
    nephroid()
        .arg("--help")
        .assert()
        .success()
        .stdout(contains("reference"));
}

/// Ctrl-C leaves neither the map nor a temporary file, and exits with 130.
#[cfg(unix)]
#[test]
fn ctrl_c_leaves_nothing_behind() {
    use std::process::{Command, Stdio};
    use std::time::Duration;
    let folder = tempfile::tempdir().unwrap();
    let mut child = crate::common::program()
        .args([
            "reference",
            "--receiver",
            "floor",
            "--error",
            "0.0001",
            "-o",
        ])
        .arg(folder.path().join("map.exr"))
        .arg(scene("ring.toml"))
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    std::thread::sleep(Duration::from_secs(1));
    let pid = child.id().to_string();
    Command::new("kill").args(["-INT", &pid]).status().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
