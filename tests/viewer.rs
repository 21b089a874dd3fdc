//! The window, driven by scripts on a display of its own (Xvfb), under the validation layers.

mod common;

use assert_cmd::Command;
use common::{nephroid, refuses, scene_path, shipped};
use std::fmt::Write;
use std::io::{BufRead, BufReader};
use std::path::Path;
use std::process::{Child, Stdio};
use tempfile::TempDir;

/// A display without a screen that is ended with the test.
struct Display {
    server: Child,
    name: String,
}

impl Display {
    fn new() -> Self {
        let mut server = std::process::Command::new("Xvfb")
            .args([
                "-displayfd",
                "1",
                "-screen",
                "0",
                "1600x1000x24",
                "-nolisten",
                "tcp",
            ])
            .stdout(Stdio::piped())
            .stderr(Stdio::null())
            .spawn()
            .expect("Xvfb is installed: .ci/setup test");
        let mut number = String::new();
        let stdout = server.stdout.take().expect("piped");
        BufReader::new(stdout)
            .read_line(&mut number)
            .expect("Xvfb names its display");
        assert!(!number.trim().is_empty(), "Xvfb did not start");
        Self {
            server,
            name: format!(":{}", number.trim()),
        }
    }

    /// `nephroid view` on this display, with a script.
    fn view(&self, folder: &Path, scene: &Path, script: &str, arguments: &[&str]) -> Command {
        let file = folder.join("script");
        std::fs::write(&file, script).unwrap();
        let mut command = nephroid();
        command
            .arg("view")
            .arg(scene)
            .arg("--script")
            .arg(file)
            .args(arguments)
            .current_dir(folder);
        command
            .env("DISPLAY", &self.name)
            .env_remove("WAYLAND_DISPLAY");
        command
    }

    /// The report of a script that runs to its end.
    fn report(
        &self,
        folder: &Path,
        scene: &Path,
        script: &str,
        arguments: &[&str],
    ) -> serde_json::Value {
        let output = self
            .view(folder, scene, script, arguments)
            .arg("--json")
            .assert()
            .success();
        serde_json::from_slice(&output.get_output().stdout).unwrap()
    }
}

impl Drop for Display {
    fn drop(&mut self) {
        let _ = self.server.kill();
        let _ = self.server.wait();
    }
}

fn folder() -> TempDir {
    tempfile::tempdir().unwrap()
}

fn section<'a>(report: &'a serde_json::Value, name: &str) -> &'a serde_json::Value {
    let sections = report["sections"].as_array().unwrap();
    sections
        .iter()
        .find(|section| section["name"] == name)
        .unwrap()
}

fn json(file: &Path) -> serde_json::Value {
    serde_json::from_str(&std::fs::read_to_string(file).unwrap()).unwrap()
}

/// L1 of two files, by `nephroid compare`.
fn l1_by_compare(folder: &Path, a: &str, b: &str) -> f64 {
    let mut compare = nephroid();
    compare
        .current_dir(folder)
        .args(["compare", a, b, "--json"]);
    let output = compare.assert().success().get_output().stdout.clone();
    let report: serde_json::Value = serde_json::from_slice(&output).unwrap();
    report["l1"].as_f64().unwrap()
}

/// A small scene in a file of its own, whose sun has this irradiance.
fn small_scene(irradiance: f64) -> String {
    format!(
        "version = 1\n[camera]\nposition = [0, 1.5, 2.5]\ntarget = [0, 0.2, 0]\nfov_degrees = 45\n\
         [[light]]\nname = \"sun\"\nkind = \"sun\"\ndirection = [0.3, 1, 0.4]\n\
         irradiance = [{irradiance}, {irradiance}, {irradiance}] # of the test\nangular_radius_degrees = 0.27\n\
         [[material]]\nname = \"white\"\nkind = \"diffuse\"\nalbedo = [0.6, 0.6, 0.6]\n\
         [[material]]\nname = \"mirror\"\nkind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]\n\
         [[object]]\nname = \"floor\"\nmaterial = \"white\"\nlightmap = [64, 64]\n\
         rect = {{ origin = [-1, 0, 1], edge_u = [2, 0, 0], edge_v = [0, 0, -2] }}\n\
         [[object]]\nname = \"wall\"\nmaterial = \"mirror\"\n\
         rect = {{ origin = [-0.5, 0, -0.6], edge_u = [1, 0, 0], edge_v = [0, 1, 0] }}\n"
    )
}

/// Every shipped scene is opened and shown, most of them without the layers, under which a first frame takes seconds.
#[test]
fn all_scenes_are_shown() {
    let names = shipped();
    assert!(names.len() > 20, "{names:?}");
    let mut script = String::from(
        "set light-maps 0.1\nset refine off\nset samples 500\nset images 1\nset cells 64\n",
    );
    for name in &names {
        let path = scene_path(name);
        let path = path.display();
        writeln!(script, "open {path}\nframes 1\nexpect no error").unwrap();
    }
    let folder = folder();
    let report = Display::new().report(
        folder.path(),
        &scene_path("mirror.toml"),
        &script,
        &["--size", "64x36"],
    );
    let pictures = section(&report, "all")["pictures"].as_u64().unwrap();
    assert!(pictures as usize >= names.len(), "{report}");
}

/// One scene of each kind, and every method on one of them, under the layers.
#[test]
fn scenes_and_methods_are_shown() {
    const SCENES: [&str; 6] = ["bumps", "globe", "lamp", "mesh_cage", "pool", "two_mirrors"];
    let mut script = String::from(
        "set light-maps 0.25\nset refine off\nset samples 500\nset images 1\nset cells 64\n",
    );
    for method in ["points", "beams", "pinhole", "footprint"] {
        writeln!(script, "set method {method}\nframes 2\nexpect no error").unwrap();
    }
    for scene in SCENES {
        let file = scene_path(&format!("{scene}.toml"));
        let file = file.display();
        writeln!(script, "open {file}\nframes 1\nexpect no error").unwrap();
    }
    let folder = folder();
    let report = Display::new().report(
        folder.path(),
        &scene_path("ring.toml"),
        &script,
        &["--size", "160x90", "--validate"],
    );
    let all = section(&report, "all");
    assert!(
        all["pictures"].as_u64().unwrap() as usize > SCENES.len(),
        "{report}"
    );
}

/// What the window shows is what `render` writes.
#[test]
fn a_screenshot_is_the_rendered_picture() {
    let folder = folder();
    let scene = scene_path("ring.toml");
    let script = "set refine off\nset antialias 2\nframes 2\nscreenshot shot.png\nexpect wrote\n";
    Display::new().report(
        folder.path(),
        &scene,
        script,
        &["--size", "320x180", "--validate"],
    );
    let rendered = folder.path().join("rendered.png");
    let mut render = nephroid();
    render
        .arg("render")
        .arg(&scene)
        .args(["--size", "320x180", "--antialias", "2", "-o"])
        .arg(&rendered);
    render.assert().success();
    let pixels = |path: &Path| image::open(path).unwrap().into_rgb8();
    let [shown, rendered] = [folder.path().join("shot.png"), rendered].map(|path| pixels(&path));
    assert_eq!(shown.dimensions(), rendered.dimensions());
    let difference = |(a, b): (&u8, &u8)| a.abs_diff(*b);
    let most = shown
        .as_raw()
        .iter()
        .zip(rendered.as_raw())
        .map(difference)
        .max()
        .unwrap();
    assert!(most <= 1, "a channel differs by {most}");
    // A picture of one colour would be equal, too.
    assert!(shown.as_raw().iter().any(|b| *b > 150) && shown.as_raw().iter().any(|b| *b < 60));
    let sidecar = json(&folder.path().join("shot.json"));
    assert_eq!(sidecar["settings"]["method"], "footprint");
    assert!(folder.path().join("shot.exr").exists());
}

/// Lights, camera and objects are dragged, windows opened, and the window takes all sizes.
#[test]
fn dragging_and_resizing() {
    let folder = folder();
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, small_scene(1.0)).unwrap();
    let mut script =
        String::from("set refine off\nset panels off\nframes 2\nscreenshot before.png\n");
    // The sun, the camera in three ways, and an object by its handles.
    script += "modifiers ctrl\ndrag left 100 60 160 70 5\nmodifiers none\nscreenshot sun.png\n\
         drag left 40 100 90 110 5\ndrag right 40 100 50 110 3\ndrag middle 40 100 50 110 3\nscroll 0 2\nframes 3\n\
         key V\nframes 1\nselect object wall\nframes 1\ndrag left 160 90 200 90 4\n\
         key P\nframes 12\nkey P\nkey Tab\nframes 2\ndown Questionmark\nframes 2\nup Questionmark\nkey Tab\n";
    // 200 sizes without a pattern.
    let mut number = 12345u32;
    let mut random = |range: u32| {
        number = number.wrapping_mul(1_664_525).wrapping_add(1_013_904_223);
        (number >> 16) % range
    };
    for _ in 0..200 {
        writeln!(
            script,
            "size {} {}\nframes 1",
            1 + random(400),
            1 + random(300)
        )
        .unwrap();
    }
    script += "size 320 180\nframes 2\nexpect no error\nkey R\nframes 2\nscreenshot after.png\nsave saved.toml\nexpect no error\n";
    let display = Display::new();
    let report = display.report(
        folder.path(),
        &scene,
        &script,
        &["--size", "320x180", "--validate"],
    );
    assert!(
        section(&report, "all")["frames"].as_u64().unwrap() > 200,
        "{report}"
    );
    let file = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert_ne!(file("before.png"), file("sun.png"));
    // After a reset, all is as it was.
    assert_eq!(file("before.png"), file("after.png"));
    assert_eq!(file("saved.toml"), file("scene.toml"));
}

/// A scene that is broken while it is shown stays as it was, until it is mended.
#[test]
fn scenes_are_read_again() {
    let folder = folder();
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), text).unwrap();
    write("scene.toml", &small_scene(1.0));
    write("brighter.toml", &small_scene(2.0));
    write(
        "broken.toml",
        &small_scene(2.0).replace("[[light]]", "[light"),
    );
    let script = "set refine off\nframes 2\nscreenshot before.png\n\
         copy broken.toml scene.toml\nwait 0.8\nexpect scene.toml, line\nframes 1\nscreenshot broken.png\n\
         copy brighter.toml scene.toml\nwait 0.8\nexpect the scene was read again\nexpect no error\nframes 1\n\
         screenshot after.png\nset exposure 1.5\nframes 1\nsave saved.toml\nexpect no error\n";
    let scene = folder.path().join("scene.toml");
    Display::new().report(
        folder.path(),
        &scene,
        script,
        &["--size", "200x120", "--validate"],
    );
    let file = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert_eq!(file("before.png"), file("broken.png"));
    assert_ne!(file("before.png"), file("after.png"));
    let saved = String::from_utf8(file("saved.toml")).unwrap();
    assert!(
        saved.contains("exposure_ev = 1.5") && saved.contains("# of the test"),
        "{saved}"
    );
}

/// Shaders are compiled again when their sources change; what does not fit leaves the last ones in place.
#[test]
#[cfg(feature = "dev")]
fn shaders_are_compiled_again() {
    let folder = folder();
    let glsl = Path::new(env!("CARGO_MANIFEST_DIR")).join("glsl");
    for room in glsl.read_dir().unwrap().map(|entry| entry.unwrap()) {
        let copies = folder.path().join("glsl").join(room.file_name());
        std::fs::create_dir_all(&copies).unwrap();
        for file in room.path().read_dir().unwrap().map(|entry| entry.unwrap()) {
            std::fs::copy(file.path(), copies.join(file.file_name())).unwrap();
        }
    }
    let mut script = String::from(
        "set refine off\nframes 2\nscreenshot first.png\nframes 1\nkey Escape\nframes 1\n",
    );
    // Saves a source with another text in place of one, and expects a message that has the third.
    let mut save = |name: &str, [text, other]: [&str; 2], message: &str, picture: &str| {
        let source = std::fs::read_to_string(glsl.join(name)).unwrap();
        assert!(source.contains(text), "{name}");
        let changed = folder.path().join(picture).with_extension("txt");
        std::fs::write(&changed, source.replace(text, other)).unwrap();
        let changed = changed.display();
        writeln!(
            script,
            "copy {changed} glsl/{name}\nawait {message}\nframes 2\nscreenshot {picture}.png\nframes 1"
        )
        .unwrap();
        script += match message.starts_with("compiled again") {
            true => "expect no error\nkey Escape\nframes 1\n",
            false => "expect glsl/\n",
        };
    };
    let (file, text) = ("view/background.frag", "result = vec4(");
    save(
        file,
        [text, "result = vec4((,"],
        "background.frag:20: error",
        "broken",
    );
    save(
        file,
        [text, text],
        "compiled again: background.frag",
        "mended",
    );
    save(
        file,
        [text, "result = vec4(0.2 + "],
        "compiled again: background.frag",
        "bright",
    );
    save(
        file,
        ["binding = 1", "binding = 9"],
        "the program has no SampledImage `environment` at binding 9",
        "misfit",
    );
    save(
        file,
        [text, text],
        "compiled again: background.frag",
        "back",
    );
    // The window's own shaders, a file that others include, and constants.
    let (file, text) = ("viewer/pictures.glsl", "1.055 * pow");
    save(file, [text, "0.5 * pow"], "compiled again: ", "dark");
    save(file, [text, text], "compiled again: ", "undone");
    let (file, text) = ("shared/background.glsl", "vec3 background(");
    save(
        file,
        [text, "vec3 background()"],
        "background.glsl:",
        "include",
    );
    save(file, [text, text], "compiled again: ", "included");
    save(
        "shared/constants.glsl",
        ["= ", "=  "],
        "constants.glsl:",
        "constants",
    );
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, small_scene(1.0)).unwrap();
    let arguments = ["--size", "200x120", "--validate", "--shaders", "glsl"];
    Display::new().report(folder.path(), &scene, &script, &arguments);
    let file = |name: &str| std::fs::read(folder.path().join(format!("{name}.png"))).unwrap();
    for same in [
        "broken",
        "mended",
        "back",
        "undone",
        "include",
        "included",
        "constants",
    ] {
        assert!(file("first") == file(same), "{same}");
    }
    assert!(file("bright") == file("misfit"));
    assert!(file("first") != file("bright") && file("first") != file("dark"));
}

/// Memory stays, and a window where nothing moves costs nothing.
#[test]
fn long_runs_are_steady() {
    let folder = folder();
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, small_scene(1.0)).unwrap();
    let mut script = String::from(
        "set panels off\nset refine off\nset samples 500\nmodifiers ctrl\ndrag left 30 30 60 40 60\n",
    );
    const FRAMES: u64 = 200;
    let names: Vec<_> = (0..5).map(|part| format!("part {part}")).collect();
    for name in &names {
        writeln!(
            script,
            "measure {name}\ndrag left 30 30 80 50 {half}\ndrag left 80 50 30 30 {half}",
            half = FRAMES / 2
        )
        .unwrap();
    }
    script += "settle\nwait 3\n";
    let report = Display::new().report(folder.path(), &scene, &script, &["--size", "96x64"]);
    for name in &names {
        let frames = section(&report, name)["frames"].as_u64().unwrap();
        assert!(frames >= FRAMES, "{report}");
    }
    // What leaks grows in every part. What grows in some of them is no leak: allocators and lavapipe keep as much as was ever needed at
    // once (12 MB for the bins of a frame where the light gives most patches), which depends on what else the machine does.
    let memory = |name: &String| section(&report, name)["memory"].as_i64().unwrap();
    let grown = (names.windows(2)).map(|pair| memory(&pair[1]) - memory(&pair[0]));
    let leaked = (1 << 20) * FRAMES as i64 / 2000;
    assert!(grown.clone().min().unwrap() < leaked, "{report}");
    const KEPT: i64 = 32 << 20;
    assert!(grown.sum::<i64>() < KEPT, "{report}");
    let idle = &report["idle"][0];
    assert!(idle["cores"].as_f64().unwrap() < 0.02, "{report}");
    assert_eq!(idle["frames"].as_u64(), Some(0), "{report}");
}

/// Where pictures cannot come as often as asked, they have fewer pixels while something moves, and maps of direct light fewer texels,
/// and all again at rest, on screenshots, and where no rate is asked for.
#[test]
fn slow_pictures_have_fewer_pixels_in_motion() {
    let folder = folder();
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, small_scene(1.0)).unwrap();
    let script = "set panels off\nframes 4\nscreenshot first.png\n\
                  measure all pixels\ndrag left 30 30 130 40 30\n\
                  set frame-rate 1000\nmeasure fewer pixels\ndrag left 130 40 30 30 60\nscreenshot moved.png\n\
                  modifiers ctrl\ndrag left 30 30 60 60 10\nmodifiers none\n\
                  settle\nscreenshot settled.png\nset frame-rate 0\nsettle\nscreenshot still.png\n\
                  measure kept pixels\ndrag left 30 30 130 40 10\nexpect no error\n";
    let arguments = ["--size", "400x240", "--validate"];
    let report = Display::new().report(folder.path(), &scene, script, &arguments);
    let scale = |name| section(&report, name)["scale"].as_f64().unwrap();
    assert_eq!([scale("all pixels"), scale("kept pixels")], [1.0; 2]);
    assert!(scale("fewer pixels") < 0.75, "{report}");
    let file = |name: &str| std::fs::read(folder.path().join(format!("{name}.exr"))).unwrap();
    assert!(file("settled") == file("still"));
    let moved = nephroid::image_file::read_rgb(&folder.path().join("moved.exr")).unwrap();
    assert_eq!([moved.width, moved.height], [400, 240]);
}

/// A draft comes first and a picture of all pixels at once after it on a CPU, unless pictures do not refine.
#[test]
fn the_first_picture_is_a_draft() {
    let folder = folder();
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, small_scene(1.0)).unwrap();
    let script = "measure rest\nframes 2\nmeasure coarse\nset refine off\nframes 2\nopen scene.toml\nframes 2\n\
                  measure again\nset refine on\nframes 2\nopen scene.toml\nframes 1\nexpect no error\n";
    let arguments = ["--size", "400x240", "--validate"];
    let report = Display::new().report(folder.path(), &scene, script, &arguments);
    let pictures = |name| section(&report, name)["pictures"].as_u64().unwrap();
    let of_draft = u64::from(report["device"]["kind"] == "cpu");
    // One of other settings comes in between.
    let [first, again] = [1 + of_draft, 2 + of_draft];
    let sections = ["all", "rest", "coarse", "again"];
    assert_eq!(sections.map(pictures), [first, 0, 2, again], "{report}");
}

/// Overlays are switched by script and by key, and nothing of them remains. The export has what frames consist of.
#[test]
fn overlays_are_switched() {
    let folder = folder();
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, small_scene(1.0)).unwrap();
    let mut script = String::from(
        "set refine off\nset panels off\nset light-maps 0.25\nset profiler on\nframes 4\nscreenshot before.png\n",
    );
    const OVERLAYS: [&str; 5] = ["patches", "footprints", "density", "texels", "cells"];
    for overlay in OVERLAYS {
        writeln!(
            script,
            "set overlay-{overlay} on\nframes 1\nscreenshot {overlay}.png\nset overlay-{overlay} off\nframes 1"
        )
        .unwrap();
    }
    // All by the key, with a change of exposure, and back to none.
    script += "key O\nframes 1\nscreenshot key.png\nset exposure 1\nframes 1\nset exposure 0\n";
    for _ in OVERLAYS {
        script += "key O\nframes 1\n";
    }
    script += "screenshot after.png\nexport profile.json\nexpect no error\n";
    Display::new().report(
        folder.path(),
        &scene,
        &script,
        &["--size", "200x120", "--validate"],
    );
    let file = |name: &str| std::fs::read(folder.path().join(format!("{name}.png"))).unwrap();
    let before = file("before");
    for overlay in OVERLAYS {
        // There is no environment.
        assert_eq!(before != file(overlay), overlay != "cells", "{overlay}");
    }
    assert!(file("key") == file("patches"));
    assert!(file("after") == before);
    assert_eq!(
        json(&folder.path().join("density.json"))["overlays"][0],
        "density"
    );

    let mut table = csv::Reader::from_path(folder.path().join("profile.csv")).unwrap();
    let heads = table.headers().unwrap().clone();
    let column = |name: &str| heads.iter().position(|head| head == name).unwrap();
    let columns = ["patches", "splats", "estimated_error"].map(column);
    let rows: Vec<_> = table.records().map(|record| record.unwrap()).collect();
    let counted = rows.iter().filter_map(|row| {
        let values = columns.map(|column| row[column].parse::<f64>().ok());
        Some([values[0]?, values[1]?, values[2]?])
    });
    let counted: Vec<_> = counted.collect();
    assert!(counted.len() > 5, "{rows:?}");
    for [patches, splats, error] in counted {
        assert!(patches > 1.0 && splats > 1.0, "{patches} {splats}");
        assert!(error > 0.0 && error < 0.05, "{error}");
    }
    let trace = json(&folder.path().join("profile.json"));
    let memory = &trace["otherData"]["memory_bytes"];
    assert!(
        memory["by_name"]["light map"].as_u64().unwrap() > 0,
        "{memory}"
    );
}

/// A surface that is lost is made again; when the device is lost, the edits are kept in a file of their own.
#[test]
#[cfg(feature = "dev")]
fn losses_are_survived_or_reported() {
    let folder = folder();
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, small_scene(1.0)).unwrap();
    let display = Display::new();
    let script = "set refine off\nset panels off\nframes 2\nscreenshot before.png\nlose surface\nframes 2\n\
         screenshot after.png\nlose surface\nsize 240 130\nframes 2\nsize 200 120\nframes 2\nscreenshot last.png\n\
         expect no error\n";
    let arguments = ["--size", "200x120", "--validate"];
    display.report(folder.path(), &scene, script, &arguments);
    let file = |name: &str| std::fs::read(folder.path().join(name)).unwrap();
    assert!(file("before.png") == file("after.png") && file("before.png") == file("last.png"));

    let lost = "set refine off\nframes 2\nset exposure 1.5\nframes 1\nlose device\nframes 2\n";
    refuses(
        &mut display.view(folder.path(), &scene, lost, &arguments),
        5,
        &[
            "submitting a frame failed on the device: the device was lost",
            "remedy",
            "the edited scene is in",
            "scene.recovered.toml",
        ],
    );
    let recovered = String::from_utf8(file("scene.recovered.toml")).unwrap();
    assert!(recovered.contains("exposure_ev = 1.5"), "{recovered}");
    assert_eq!(file("scene.toml"), small_scene(1.0).into_bytes());
    // Without edits there is nothing to keep.
    std::fs::remove_file(folder.path().join("scene.recovered.toml")).unwrap();
    let script = lost.replace("set exposure 1.5\n", "");
    refuses(
        &mut display.view(folder.path(), &scene, &script, &arguments),
        5,
        &["the device was lost"],
    );
    assert!(!folder.path().join("scene.recovered.toml").exists());
}

/// A comparison takes whatever happens in the window, and ends without a trace.
#[test]
fn two_sides_are_compared() {
    let script = "set light-maps 0.25\nset refine off\nset panels off\nframes 2\nscreenshot before.png\n\
         set compare-method points\nset compare-samples 20000\nset compare on\nframes 3\nscreenshot split.png\n\
         drag left 160 90 80 90 3\nscreenshot dragged.png\nset divider 0\nframes 1\n\
         set compare-method beams\nframes 2\nset compare-error 0.1\nset compare-method footprint\nframes 2\n\
         key H\nframes 3\nscreenshot heat.png\nset heat-map-relative on\nset heat-map-scale 0.1\nframes 2\n\
         size 200 150\nframes 2\nsize 320 180\nframes 2\nset panels on\nframes 2\nset panels off\n\
         play\nframes 4\npause\nset divider 0.5\nkey H\nkey X\nframes 2\nset refine on\nsettle\nset refine off\n\
         set resolution 0.5\nframes 2\nscreenshot half.png\nset resolution 1\nset light-maps 0.5\nframes 2\n\
         key P\nframes 3\nkey P\nexpect no error\nkey X\nkey B\nset light-maps 0.25\ntime 0\nkey V\nframes 2\n\
         screenshot after.png\nexpect no error\n";
    let folder = folder();
    let scene = scene_path("ring.toml");
    let size = ["--size", "320x180", "--validate"];
    Display::new().report(folder.path(), &scene, script, &size);
    let pixels = |name: &str| {
        let picture = image::open(folder.path().join(name)).unwrap();
        picture.into_rgb8()
    };
    let [before, split, dragged, heat] =
        ["before.png", "split.png", "dragged.png", "heat.png"].map(pixels);
    // A is shown as it is alone, and B begins at the divider.
    let differing = |picture: &image::RgbImage, columns: std::ops::Range<u32>| {
        let pixels = columns.flat_map(|x| (0..180).map(move |y| (x, y)));
        let differs = |(x, y): &(u32, u32)| before.get_pixel(*x, *y) != picture.get_pixel(*x, *y);
        pixels.filter(differs).count()
    };
    assert_eq!(differing(&split, 0..159), 0);
    assert!(differing(&split, 161..320) > 1000);
    assert_eq!(differing(&dragged, 0..79), 0);
    assert!(differing(&dragged, 81..159) > 0);
    // The wall has no caustic, and so no difference.
    assert_eq!(heat.get_pixel(20, 10).0, [0, 0, 4]);
    assert!(heat.pixels().any(|pixel| pixel.0[0] > 200));
    assert!(before == pixels("after.png"), "the comparison left a trace");
    assert!(folder.path().join("split.b.exr").exists());
    assert!(!folder.path().join("after.b.exr").exists());
    let sidecar = json(&folder.path().join("split.json"));
    let comparison = &sidecar["comparison"];
    assert_eq!(comparison["b"]["method"], "points");
    assert_eq!(comparison["shown"]["split"]["divider"], 0.5);
    assert!(json(&folder.path().join("after.json"))["comparison"].is_null());
}

/// The figures in the window are those of `bake` and `compare`.
#[test]
fn differences_are_measured() {
    let folder = folder();
    let scene = scene_path("ring.toml");
    let script = "set refine off\nset compare on\nframes 3\nexpect picture: L1 0.0000 %\nexpect floor: L1 0.0000 %\n\
         set compare-method points\nset compare-samples 65536\nframes 3\nscreenshot shot.png\nexpect wrote\n";
    let size = ["--size", "320x180", "--validate"];
    Display::new().report(folder.path(), &scene, script, &size);
    let sidecar = json(&folder.path().join("shot.json"));
    let differences = &sidecar["comparison"]["differences"];
    let l1_of = |name: &str| {
        let mut differences = differences.as_array().unwrap().iter();
        let difference = differences.find(|difference| difference["of"] == name);
        difference.unwrap()["l1"].as_f64().unwrap()
    };
    let points = ["--method", "points", "--samples", "65536"];
    for (file, arguments) in [("a.exr", &[][..]), ("b.exr", &points)] {
        let mut bake = nephroid();
        bake.arg("bake")
            .arg(&scene)
            .args(["--receiver", "floor", "-o"]);
        bake.arg(folder.path().join(file)).args(arguments);
        bake.assert().success();
    }
    // The images are equal to the bit. The device adds up squares of 64 texels in 32-bit floats.
    for (shown, compared) in [
        (
            l1_of("floor"),
            l1_by_compare(folder.path(), "a.exr", "b.exr"),
        ),
        (
            l1_of("picture"),
            l1_by_compare(folder.path(), "shot.exr", "shot.b.exr"),
        ),
    ] {
        assert!(compared > 0.01, "{compared}");
        let off = (shown / compared - 1.0).abs();
        assert!(off < 1e-5, "{shown} in the window, {compared} by compare");
    }
}

/// A side may be the reference, which is refined while the scene stays as it is.
#[test]
fn a_side_is_the_reference() {
    let folder = folder();
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, small_scene(1.0)).unwrap();
    let script = "set refine off\nset panels off\nset compare-reference on\nset compare on\nframes 2\n\
         expect reference\nwait 10\nframes 3\nexpect floor: reference ±\nscreenshot shot.png\n\
         modifiers ctrl\ndrag left 100 60 130 60 2\nmodifiers none\nwait 10\nframes 3\nexpect floor: reference ±\n\
         drag left 160 90 150 90 2\nsize 200 150\nframes 2\nkey X\nframes 2\nset heat-map on\nframes 3\nkey 1\nframes 2\n\
         set compare-reference off\nset compare off\nframes 2\nexpect no error\n";
    let size = ["--size", "320x180", "--validate"];
    Display::new().report(folder.path(), &scene, script, &size);
    let sidecar = json(&folder.path().join("shot.json"));
    let comparison = &sidecar["comparison"];
    assert_eq!(comparison["b"]["method"], "reference");
    let [picture, floor] = [0, 1].map(|i| comparison["differences"][i]["l1"].as_f64().unwrap());
    let error = comparison["reference_errors"][0]["error"].as_f64().unwrap();
    let file = |name: &str| folder.path().join(name);
    let mut bake = nephroid();
    bake.arg("bake").arg(&scene).arg("-o").arg(file("a.exr"));
    bake.assert().success();
    let mut reference = nephroid();
    reference
        .arg("reference")
        .arg(&scene)
        .args(["--error", "0.005", "--no-cache", "-o"]);
    reference.arg(file("b.exr")).assert().success();
    let compared = l1_by_compare(folder.path(), "a.exr", "b.exr");
    // Two references differ by no more than their errors, which are expectations.
    let off = (floor - compared).abs();
    assert!(
        off < 1.5 * (error + 0.005),
        "{floor} in the window, {compared} by compare, reference ± {error}"
    );
    assert!(error < 0.05 && picture < floor, "{comparison}");
}

/// A side B that cannot be rendered leaves A, and one that leaves out light says so.
#[test]
fn what_b_cannot_do_is_said() {
    let other = scene_path("two_mirrors.toml");
    let script = format!(
        "set refine off\nset light-maps 0.25\nset compare-method beams\nset compare-samples 4000000000\n\
         set compare on\nframes 2\nexpect B cannot be rendered\nkey Escape\n\
         set compare-samples 1000\nset compare on\nframes 3\nexpect no error\n\
         set compare-samples 4000000000\nframes 2\nexpect remedy\nkey Escape\n\
         open {}\nframes 2\nexpect B: light that meets several mirrors\nexpect no error\n",
        other.display()
    );
    let folder = folder();
    let size = ["--size", "160x90", "--validate"];
    Display::new().report(folder.path(), &scene_path("ring.toml"), &script, &size);
}

/// Comparing again and again takes no more memory.
#[test]
fn comparisons_leave_nothing() {
    let folder = folder();
    let scene = folder.path().join("scene.toml");
    std::fs::write(&scene, small_scene(1.0)).unwrap();
    let mut script = String::from("set panels off\nset refine off\nset compare-method beams\n");
    let mut repeat = |name: &str, times: usize| {
        writeln!(script, "measure {name}").unwrap();
        for _ in 0..times {
            script += "set compare on\nset heat-map on\nframes 3\nset heat-map off\n";
            script += "drag left 30 30 40 40 2\nsize 200 150\nframes 1\nsize 160 90\nset compare off\nframes 2\n";
        }
    };
    repeat("first", 10);
    repeat("second", 10);
    let report = Display::new().report(folder.path(), &scene, &script, &["--size", "160x90"]);
    let memory = |name: &str| section(&report, name)["memory"].as_i64().unwrap();
    let grown = memory("second") - memory("first");
    assert!(grown < 4 << 20, "{grown} bytes more: {report}");
}

#[test]
fn what_cannot_be_shown_is_refused() {
    let folder = folder();
    let scene = scene_path("mirror.toml");
    let display = Display::new();
    let mut no_display = nephroid();
    no_display
        .arg("view")
        .arg(&scene)
        .env_remove("DISPLAY")
        .env_remove("WAYLAND_DISPLAY");
    refuses(&mut no_display, 4, &["there is no display", "remedy"]);
    refuses(
        &mut display.view(folder.path(), Path::new("none.toml"), "", &[]),
        3,
        &["none.toml"],
    );
    refuses(
        &mut display.view(folder.path(), &scene, "frames 1\njump\n", &[]),
        3,
        &["line 2", "jump"],
    );
    refuses(
        &mut display.view(folder.path(), &scene, "frames 1\nexpect nonsense\n", &[]),
        3,
        &["line 2", "nonsense"],
    );
    refuses(
        &mut display.view(folder.path(), &scene, "", &["--device", "no such"]),
        4,
        &["no such"],
    );
    refuses(
        &mut display.view(
            folder.path(),
            &scene,
            "",
            &["--method", "points", "--error", "0.1"],
        ),
        2,
        &["points"],
    );
}
