//! What `render`, `bake` and `devices` say and return, above all where the input is bad.

use crate::common::folder::{Folder, SCENE};
use crate::common::{json, nephroid, refuses, scene_path as scene};
use assert_cmd::Command;
use nephroid::image_file::read_rgb;
use predicates::prelude::*;
use predicates::str::contains;
use serde_json::Value;
use std::path::Path;

/// `render` or `bake` of a scene in a few milliseconds.
fn run(command: &str, scene: &Path, output: &Path) -> Command {
    let mut run = nephroid();
    run.arg(command).arg(scene).arg("-o").arg(output);
    run.args(["--lightmap", "32", "--samples", "512"]);
    if command == "render" {
        run.args(["--size", "32x18"]);
    }
    run
}

/// Both commands, with an output of a fitting kind.
const COMMANDS: [(&str, &str); 2] = [("render", "view.png"), ("bake", "map.exr")];

/// File names in a folder.
fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let name = |entry: std::io::Result<std::fs::DirEntry>| entry.unwrap().file_name();
    let mut names: Vec<String> = (entries.map(name))
        .map(|name| name.into_string().unwrap())
        .collect();
    names.sort();
    names
}

#[test]
fn bad_scenes_exit_with_3_and_write_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let bad = folder.path().join("bad.toml");
    let good = std::fs::read_to_string(scene("mirror.toml")).unwrap();
    let after = |from: &str, to: &str| {
        assert!(good.contains(from));
        good.replacen(from, to, 1)
    };
    let mesh = |file: &str| {
        after(
            "rect = { origin = [-0.4, 0.2, 0.0], edge_u = [0.8, 0.0, 0.0], edge_v = [0.0, 0.6, 0.0] }",
            &format!("mesh = \"{file}\""),
        )
    };
    let cases = [
        (String::new(), "version"),
        (after("version = 1", "version = 2"), "version"),
        (after("exposure_ev", "exposure"), "line 10"),
        (after("[0.3, 0.8, 0.6]", "[0.3, nan, 0.6]"), "direction"),
        (mesh("none.obj"), "none.obj"),
        (mesh("../outside.obj"), "leads out of the asset root"),
        ("not a scene at all".into(), "line 1"),
    ];
    for (command, output) in COMMANDS {
        let output = folder.path().join(output);
        for (content, part) in &cases {
            std::fs::write(&bad, content).unwrap();
            refuses(&mut run(command, &bad, &output), 3, &[part, "remedy"]);
        }
        std::fs::remove_file(&bad).unwrap();
        refuses(&mut run(command, &bad, &output), 3, &["bad.toml", "remedy"]);
    }
    assert_eq!(names(folder.path()), Vec::<String>::new());
    // The scene that they were made from is good.
    std::fs::write(&bad, good).unwrap();
    run("bake", &bad, &folder.path().join("map.exr"))
        .assert()
        .success();
}

#[test]
fn bad_options_exit_with_2_and_write_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mirror = scene("mirror.toml");
    for (command, output) in COMMANDS {
        let output = folder.path().join(output);
        let base = || {
            let mut base = nephroid();
            base.arg(command).arg(&mirror).arg("-o").arg(&output);
            base
        };
        for (option, part) in [
            ("--samples=0", "--samples"),
            ("--samples=-5", "--samples"),
            ("--samples=9999999999", "--samples"),
            ("--environment-cells=7", "--environment-cells"),
            ("--environment-images=0", "--environment-images"),
            ("--lightmap=0", "8192"),
            ("--lightmap=100000", "8192"),
            ("--epsilon=-1", "--epsilon"),
            ("--epsilon=nan", "--epsilon"),
            ("--method=photons", "footprint"),
            ("--area=round", "product"),
        ] {
            refuses(base().arg(option), 2, &[part]);
        }
        refuses(
            (nephroid().arg(command).arg(scene("ball.toml")))
                .arg("--samples=1000000000")
                .arg("-o")
                .arg(&output),
            2,
            &["images of environment cells", "GiB", "remedy"],
        );
        let missing = folder
            .path()
            .join("missing")
            .join(output.file_name().unwrap());
        refuses(
            &mut run(command, &mirror, &missing),
            2,
            &["missing", "remedy"],
        );
        let wrong = folder.path().join("picture.jpg");
        refuses(
            &mut run(command, &mirror, &wrong),
            2,
            &["picture.jpg", ".exr"],
        );
    }
    let view = folder.path().join("view.png");
    for size in ["0x10", "10", "99999x10"] {
        let mut render = nephroid();
        render.arg("render").arg(&mirror).arg("-o").arg(&view);
        refuses(
            render.arg(format!("--size={size}")),
            2,
            &["--size", "16384"],
        );
    }
    let map = folder.path().join("map.exr");
    let parts = ["`roof`", "floor, wall_x, wall_z"];
    refuses(
        run("bake", &scene("ring.toml"), &map).args(["--receiver", "roof"]),
        2,
        &parts,
    );
    refuses(
        &mut run("bake", &scene("ring.toml"), &map),
        2,
        &["3 receivers", parts[1]],
    );
    assert_eq!(names(folder.path()), Vec::<String>::new());
}

/// Points the Vulkan loader to no driver.
fn without_driver(command: &mut Command) -> &mut Command {
    let none = "/nonexistent/driver.json";
    command
        .env("VK_DRIVER_FILES", none)
        .env("VK_ICD_FILENAMES", none)
}

/// Puts a file that is no library before the Vulkan loader.
#[cfg(target_os = "linux")]
fn without_loader<'a>(command: &'a mut Command, folder: &Path) -> &'a mut Command {
    for name in ["libvulkan.so.1", "libvulkan.so"] {
        std::fs::write(folder.join(name), "no library").unwrap();
    }
    command.env("LD_LIBRARY_PATH", folder)
}

#[cfg(target_os = "linux")]
#[test]
fn missing_devices_exit_with_4_and_write_nothing() {
    let [folder, loader] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let mirror = scene("mirror.toml");
    for (command, output) in COMMANDS {
        let output = folder.path().join(output);
        let base = || run(command, &mirror, &output);
        let unknown = ["`nephroid devices`", "\"toaster\""];
        refuses(base().args(["--device", "toaster"]), 4, &unknown);
        refuses(base().args(["--device", "99"]), 4, &unknown[..1]);
        let install = [
            "no suitable Vulkan device",
            "remedy",
            "install a Vulkan driver",
        ];
        refuses(without_driver(&mut base()), 4, &install);
        refuses(without_loader(&mut base(), loader.path()), 4, &install);
        refuses(
            without_loader(&mut base(), loader.path()),
            4,
            &["loader cannot be loaded"],
        );
    }
    refuses(without_driver(nephroid().arg("devices")), 4, &["remedy"]);
    refuses(
        without_loader(nephroid().arg("devices"), loader.path()),
        4,
        &["remedy"],
    );
    assert_eq!(names(folder.path()), Vec::<String>::new());
}

#[test]
fn devices_are_listed_and_can_be_chosen() {
    let devices = json(nephroid().arg("devices"));
    let first = &devices[0];
    for field in ["name", "kind", "driver", "api_version"] {
        assert!(!first[field].as_str().unwrap().is_empty(), "{field}");
    }
    assert!(first["unsuitable"].is_null());
    let name = first["name"].as_str().unwrap();
    nephroid()
        .arg("devices")
        .assert()
        .success()
        .stdout(contains(name));

    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("map.exr");
    for device in ["0", name, &name[..4].to_uppercase()] {
        let mut bake = run("bake", &scene("mirror.toml"), &map);
        let report = json(bake.args(["--device", device]));
        assert_eq!(report["device"]["name"], *name);
    }
}

#[test]
fn bake_writes_a_map_and_reports_on_it() {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("map.exr");
    let mirror = scene("mirror.toml");
    let report = json(&mut run("bake", &mirror, &map));
    assert_eq!(report["file"], map.to_str().unwrap());
    assert_eq!(report["device"]["unsuitable"], Value::Null);
    let caustic = &report["caustic"];
    assert_eq!(caustic["method"], "footprint");
    // Two triangles, each cut into 16² patches, all of which reach the floor.
    assert_eq!(
        (&caustic["samples"], &caustic["lit"]),
        (&512.into(), &512.into())
    );
    assert!(report["frame"]["median"].as_f64().unwrap() > 0.0);
    assert!(report["frame"]["p95"].as_f64().unwrap() > 0.0);
    assert!(report.get("passes").is_none());

    // 0.9 E₀ A n·s of flux; and a sun on the open floor.
    let s = glam::DVec3::new(0.3, 0.8, 0.6).normalize();
    let mean = |path: &Path| {
        let image = read_rgb(path).unwrap();
        assert_eq!((image.width, image.height), (32, 32));
        image
            .pixels
            .iter()
            .map(|rgb| f64::from(rgb[0]))
            .sum::<f64>()
            / 1024.0
    };
    let exact = 0.9 * s.z * 0.48 / (1.6 * 1.6);
    assert!((mean(&map) / exact - 1.0).abs() < 0.001, "{}", mean(&map));
    let [caustic, direct, total] = ["caustic", "direct", "total"].map(|component| {
        let mut bake = run("bake", &mirror, &map);
        bake.args(["--component", component]).assert().success();
        mean(&map)
    });
    assert!(
        (total - caustic - direct).abs() < 1e-5,
        "{total} {caustic} {direct}"
    );
    assert!(direct > 0.6 * s.y && direct < s.y, "{direct}");
    assert_eq!(names(folder.path()), ["map.exr"]);
}

#[test]
fn profile_has_a_row_for_every_pass() {
    let folder = tempfile::tempdir().unwrap();
    for (command, output) in COMMANDS {
        let output = folder.path().join(output);
        let mut profile = run(command, &scene("mirror.toml"), &output);
        let report = json(profile.arg("--profile"));
        let passes: Vec<&str> = (report["passes"].as_array().unwrap().iter())
            .map(|pass| pass["name"].as_str().unwrap())
            .collect();
        for stage in ["facet flux", "project triangles", "splat triangles"] {
            assert!(passes.contains(&stage), "{passes:?}");
        }
        assert_eq!(passes.contains(&"draw surfaces"), command == "render");
        let shares = report["passes"].as_array().unwrap().iter();
        let sum: f64 = shares.map(|pass| pass["share"].as_f64().unwrap()).sum();
        assert!((sum - 1.0).abs() < 1e-6, "{sum}");

        let mut profile = run(command, &scene("mirror.toml"), &output);
        let text = profile
            .arg("--profile")
            .assert()
            .success()
            .get_output()
            .stdout
            .clone();
        let text = String::from_utf8(text).unwrap();
        for row in passes.into_iter().chain(["whole frame"]) {
            assert!(
                text.lines().any(|line| line.starts_with(row)),
                "{row}: {text}"
            );
        }
    }
}

#[test]
fn render_writes_pictures_of_the_size_asked_for() {
    let folder = tempfile::tempdir().unwrap();
    let [png, exr] = ["view.png", "view.exr"].map(|name| folder.path().join(name));
    for output in [&png, &exr] {
        run("render", &scene("mirror.toml"), output)
            .assert()
            .success()
            .stderr("");
    }
    let picture = image::open(&png).unwrap().into_rgb8();
    assert_eq!(picture.dimensions(), (32, 18));
    let radiance = read_rgb(&exr).unwrap();
    assert_eq!((radiance.width, radiance.height), (32, 18));
    // The picture is the radiance, tone-mapped: brighter where that is brighter.
    let brightest = |values: Vec<f32>| values.iter().copied().fold(0.0, f32::max);
    assert!(brightest(picture.iter().map(|byte| f32::from(*byte)).collect()) > 100.0);
    assert!(brightest(radiance.pixels.as_flattened().to_vec()) > 0.1);
    assert_eq!(names(folder.path()), ["view.exr", "view.png"]);
}

#[test]
fn all_methods_run_clean_under_validation() {
    let folder = tempfile::tempdir().unwrap();
    for (command, output) in COMMANDS {
        let output = folder.path().join(output);
        for method in ["footprint", "pinhole", "points", "beams"] {
            let mut run = run(command, &scene("mirror.toml"), &output);
            run.args(["--validate", "--method", method]);
            run.assert().success().stderr(contains("validation").not());
        }
    }
}

/// The layers' best practices, which lavapipe's users need not follow, are always violated: a
/// setting of the layers, not of ours, makes them speak.
fn with_complaints(command: &mut Command) -> &mut Command {
    let enables = "VK_VALIDATION_FEATURE_ENABLE_BEST_PRACTICES_EXT";
    command.env("VK_LAYER_ENABLES", enables)
}

#[test]
fn validation_messages_exit_with_1_and_write_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let mirror = scene("mirror.toml");
    for (command, output) in COMMANDS {
        let output = folder.path().join(output);
        let validated = || {
            let mut validated = run(command, &mirror, &output);
            validated.arg("--validate");
            validated
        };
        let parts = ["validation message(s), the first: ", "BestPractices"];
        refuses(with_complaints(&mut validated()), 1, &parts);
        assert_eq!(names(folder.path()), Vec::<String>::new());
        // A command that fails on something else says both.
        let mut too_many = nephroid();
        too_many.arg(command).arg(&mirror).arg("-o").arg(&output);
        too_many.args(["--validate", "--samples=1000000000"]);
        let parts = ["validation: ", "BestPractices", "more than fit"];
        refuses(with_complaints(&mut too_many), 2, &parts);
        assert_eq!(names(folder.path()), Vec::<String>::new());
        // Without the layers, or in their silence, nothing is said.
        with_complaints(&mut run(command, &mirror, &output))
            .assert()
            .success();
        validated()
            .assert()
            .success()
            .stderr(contains("validation").not());
        std::fs::remove_file(&output).unwrap();
    }
}

/// The driver's cache is kept, and rubbish in its place is ignored and replaced.
#[cfg(target_os = "linux")]
#[test]
fn a_damaged_pipeline_cache_is_ignored() {
    let [folder, cache] = [(); 2].map(|()| tempfile::tempdir().unwrap());
    let map = folder.path().join("map.exr");
    let bake = || {
        let mut bake = run("bake", &scene("mirror.toml"), &map);
        bake.env("XDG_CACHE_HOME", cache.path())
            .assert()
            .success()
            .stderr("");
        read_rgb(&map).unwrap().pixels
    };
    let first = bake();
    let kept = cache.path().join("nephroid");
    let files = names(&kept);
    assert_eq!(files.len(), 1, "{files:?}");
    let file = kept.join(&files[0]);
    let whole = std::fs::read(&file).unwrap();
    let damaged = [
        b"rubbish".to_vec(),
        Vec::new(),
        whole[..whole.len() / 2].to_vec(),
    ];
    for content in damaged {
        std::fs::write(&file, &content).unwrap();
        assert_eq!(bake(), first);
        assert_ne!(std::fs::read(&file).unwrap(), content, "it is replaced");
    }
    // A cache that cannot be written costs time only.
    std::fs::remove_dir_all(&kept).unwrap();
    std::fs::write(&kept, "in the way").unwrap();
    assert_eq!(bake(), first);
}

/// The sum of all entries is what came in, in each channel. Text has a line on what is cut off.
#[test]
fn bake_says_where_the_light_ends() {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("map.exr");
    let bake = || {
        let mut bake = run("bake", &scene("tumbler.toml"), &map);
        bake.args(["--receiver", "floor"]);
        bake
    };
    let balance = json(&mut bake())["caustic"]["flux_balance"].take();
    fn sum(value: &serde_json::Value) -> [f64; 3] {
        let parts: Vec<&serde_json::Value> = match value {
            serde_json::Value::Object(parts) => parts.values().collect(),
            serde_json::Value::Array(parts) if parts[0].is_array() => parts.iter().collect(),
            flux => return [0, 1, 2].map(|channel| flux[channel].as_f64().unwrap()),
        };
        (parts.into_iter().map(sum)).fold([0.0; 3], |a, b| [0, 1, 2].map(|c| a[c] + b[c]))
    }
    assert_eq!(balance["landed"].as_array().unwrap().len(), 16);
    // The flux that came in is among the parts.
    let (all, incoming) = (sum(&balance), sum(&balance["incoming"]));
    for channel in 0..3 {
        assert!(
            (all[channel] / incoming[channel] - 2.0).abs() < 1e-3,
            "{all:?}"
        );
    }
    let output = bake().assert().success().get_output().stdout.clone();
    let text = String::from_utf8(output).unwrap();
    assert!(
        text.contains("cut off") && text.contains("faint lobes"),
        "{text}"
    );
}

/// Work without effect has no share of the light, chains that are cut off have some, and the rest is not known.
#[test]
fn explain_says_what_is_left_out() {
    let folder = tempfile::tempdir().unwrap();
    let map = folder.path().join("map.exr");
    let left_out = |name: &str| {
        let mut bake = run("bake", &scene(name), &map);
        bake.args(["--receiver", "floor", "--explain"]);
        let report = json(&mut bake);
        let list = report["caustic"]["left_out"].as_array().unwrap();
        let entry = |of: &serde_json::Value| {
            let what = of["what"].as_str().unwrap().to_owned();
            assert!(!of["why"].as_str().unwrap().is_empty());
            (what, of["share"].as_f64())
        };
        list.iter().map(entry).collect::<Vec<_>>()
    };
    let share_of = |list: &[(String, Option<f64>)], part: &str| {
        let found: Vec<_> = list
            .iter()
            .filter(|(what, _)| what.contains(part))
            .collect();
        assert_eq!(found.len(), 1, "{part} {list:?}");
        found[0].1
    };
    // Half of the ring faces away from the sun.
    let ring = left_out("ring.toml");
    assert_eq!(share_of(&ring, "pairs of facet and light"), Some(0.0));
    assert_eq!(share_of(&ring, "caustics of \"sky\""), None);
    let tumbler = left_out("tumbler.toml");
    let faint = share_of(&tumbler, "faint lobes").unwrap();
    assert!((1e-4..0.01).contains(&faint), "{faint}");
    // A flat mirror has no chains, and nothing stands in its way.
    let mirror = left_out("mirror.toml");
    assert_eq!(share_of(&mirror, "chains of several"), Some(0.0));
}

/// `render` or `bake` of frames of the pool, with an output of a fitting kind.
fn frames(command: &str, folder: &Path, range: &str) -> Command {
    let output = COMMANDS
        .iter()
        .find(|(name, _)| *name == command)
        .unwrap()
        .1;
    let mut frames = run(command, &scene("pool.toml"), &folder.join(output));
    frames.args(["--frames", range]);
    if command == "bake" {
        frames.args(["--receiver", "floor"]);
    }
    frames
}

#[test]
fn frames_are_numbered_and_those_of_their_times() {
    let folder = tempfile::tempdir().unwrap();
    for (command, names_of_frames) in [
        ("render", ["view.0003.png", "view.0004.png"]),
        ("bake", ["map.0003.exr", "map.0004.exr"]),
    ] {
        let mut sequence = frames(command, folder.path(), "3-4");
        let report = json(sequence.args(["--fps", "10", "--profile", "--validate"]));
        let of_frames = report["frames"].as_array().unwrap();
        let times: Vec<f64> = (of_frames.iter())
            .map(|frame| frame["time"].as_f64().unwrap())
            .collect();
        assert_eq!(times, [0.3, 0.4]);
        assert!(report["update"]["median"].as_f64().unwrap() > 0.0);
        assert!(report["passes"].as_array().unwrap().len() > 3);
        assert_eq!(names(folder.path()), names_of_frames);
        // A still of the time is the same to the bit.
        let [first, second] = names_of_frames.map(|name| folder.path().join(name));
        let mut still = frames(command, folder.path(), "0-0");
        still.assert().success();
        let zeroth = first.with_file_name(names_of_frames[0].replace("0003", "0000"));
        let content = |path: &Path| std::fs::read(path).unwrap();
        assert!(content(&zeroth) != content(&first));
        let mut still = run(command, &scene("pool.toml"), &zeroth);
        if command == "bake" {
            still.args(["--receiver", "floor"]);
        }
        still.args(["--time", "0.4"]).assert().success();
        assert!(content(&zeroth) == content(&second));
        for file in [first, second, zeroth] {
            std::fs::remove_file(file).unwrap();
        }
    }
}

/// A mirror that is flat at first and then folds meets its own light, which it had no room for.
#[test]
fn a_mirror_that_folds_on_the_way_is_that_of_its_time() {
    let folder = Folder::new();
    for (frame, depth) in ["0", "-0.5"].iter().enumerate() {
        let obj = format!(
            "v 0 0 0\nv 0.5 0 {depth}\nv 1 0 0\nv 1 1 0\nv 0.5 1 {depth}\nv 0 1 0\nf 1 2 5 6\nf 2 3 4 5\n"
        );
        folder.write(&format!("folding/{frame}.obj"), obj);
    }
    let frames = "frames = { folder = \"folding\", fps = 1 }";
    folder.write("scene.toml", SCENE.replace("mesh = \"part.obj\"", frames));
    let bake = |output: &str, options: &[&str]| {
        let mut bake = run("bake", &folder.path("scene.toml"), &folder.path(output));
        bake.args(options).assert().success();
    };
    bake("map.exr", &["--frames", "0-1", "--fps", "1"]);
    bake("still.exr", &["--time", "1"]);
    let [frame, still] =
        ["map.0001.exr", "still.exr"].map(|name| read_rgb(&folder.path(name)).unwrap());
    assert!(frame.pixels == still.pixels);
}

#[test]
fn frames_that_fail_leave_the_others() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::create_dir(folder.path().join("map.0001.exr")).unwrap();
    let parts = [
        "1 of 3 frames failed (1); the first: ",
        "map.0001.exr",
        "it is a folder",
    ];
    refuses(&mut frames("bake", folder.path(), "0-2"), 6, &parts);
    assert_eq!(
        names(folder.path()),
        ["map.0000.exr", "map.0001.exr", "map.0002.exr"]
    );
}

#[test]
fn bad_times_exit_with_2_and_write_nothing() {
    let folder = tempfile::tempdir().unwrap();
    for (command, output) in COMMANDS {
        for (options, part) in [
            (&["--frames", "4-3"][..], "0-119"),
            (&["--frames", "4"], "0-119"),
            (&["--frames", "0-1000000"], "99999"),
            (&["--frames", "0-1", "--time", "1"], "cannot be used with"),
            (&["--fps", "10"], "--frames"),
            (&["--frames", "0-1", "--fps", "0"], "frames a second"),
            (&["--time", "nan"], "seconds"),
        ] {
            let mut bad = run(command, &scene("pool.toml"), &folder.path().join(output));
            refuses(bad.args(options), 2, &[part]);
        }
    }
    assert_eq!(names(folder.path()), Vec::<String>::new());
}

/// Ctrl-C keeps the frames that are finished, whole, and exits with 130.
#[cfg(unix)]
#[test]
fn ctrl_c_ends_a_sequence_between_frames() {
    use std::process::{Command, Stdio};
    use std::time::Duration;
    let folder = tempfile::tempdir().unwrap();
    let mut child = crate::common::program()
        .args(["bake", "--receiver", "floor", "--frames", "0-99999", "-o"])
        .arg(folder.path().join("map.exr"))
        .arg(scene("pool.toml"))
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let first = folder.path().join("map.0000.exr");
    for _ in 0..600 {
        if first.exists() {
            break;
        }
        std::thread::sleep(Duration::from_millis(100));
    }
    let pid = child.id().to_string();
    Command::new("kill").args(["-INT", &pid]).status().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let frames = names(folder.path());
    assert!(!frames.is_empty());
    for (index, name) in frames.iter().enumerate() {
        assert_eq!(*name, format!("map.{index:04}.exr"));
        read_rgb(&folder.path().join(name)).unwrap();
    }
}
