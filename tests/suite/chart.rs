//! `nephroid chart`: what is measured, what is kept, and what is refused before the work.

use crate::common::{brighter, load, nephroid, options, refuses, scaled, scene_path, solve};
use assert_cmd::Command;
use nephroid::gpu::{Context, ContextOptions};
use nephroid::measure::chart::{Chart, Point, SceneChart};
use nephroid::measure::sweep::{Plan, Subject, sweep};
use nephroid::reference::Reference;
use nephroid::scene::Scene;
use predicates::prelude::*;
use predicates::str::contains;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;

/// `nephroid chart --quick`, with references kept in `cache` only.
fn chart(cache: &Path, scenes: &[PathBuf], output: &Path) -> Command {
    let mut command = nephroid();
    command.env("XDG_CACHE_HOME", cache);
    command.arg("chart").args(scenes);
    command.arg("-o").arg(output).arg("--quick");
    command
}

fn read(folder: &Path) -> Chart {
    let text = std::fs::read_to_string(folder.join("chart.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

/// The only reference in the cache.
fn kept_reference(cache: &Path) -> PathBuf {
    let entries = std::fs::read_dir(cache.join("nephroid/references")).unwrap();
    let files: Vec<PathBuf> = entries.map(|entry| entry.unwrap().path()).collect();
    assert_eq!(files.len(), 1, "{files:?}");
    files[0].clone()
}

#[test]
fn a_chart_is_measured_and_its_reference_is_kept() {
    let folder = tempfile::tempdir().unwrap();
    let cache = folder.path().join("cache");
    let output = folder.path().join("new/chart");
    let mirror = [scene_path("mirror.toml")];
    let peers = folder.path().join("peers.json");
    std::fs::write(
        &peers,
        r#"{"schema": 1, "peers": [
            {"name": "photons", "version": "1", "hardware": "elsewhere", "scene": "mirror",
             "seconds": 2.0, "error": 0.3},
            {"name": "lost", "version": "1", "hardware": "elsewhere", "scene": "none",
             "seconds": 2.0, "error": 0.3}]}"#,
    )
    .unwrap();
    chart(&cache, &mirror, &output)
        .arg("--peers")
        .arg(&peers)
        .assert()
        .success()
        .stdout(contains("footprint").and(contains("chart.html")))
        .stderr(contains("lost: no scene `none`").and(contains("note").not()));
    for kind in ["html", "svg", "csv", "json"] {
        assert!(output.join("chart").with_extension(kind).exists(), "{kind}");
    }
    let first = read(&output);
    assert!(!first.driver.is_empty() && !first.cpu.is_empty());
    let [scene] = first.scenes.as_slice() else {
        panic!("one size of the light map");
    };
    assert_eq!((scene.scene.as_str(), scene.light_map), ("mirror", [64; 2]));
    assert_eq!(scene.peers.len(), 1);
    let labels: Vec<&str> = scene.series.iter().map(|s| s.label.as_str()).collect();
    for label in [
        "footprint",
        "footprint, --error",
        "footprint, --budget-ms",
        "points",
        "pinhole",
        "pinhole, ε = 0",
        "pinhole, no filter",
    ] {
        assert!(labels.contains(&label), "{label} in {labels:?}");
    }
    assert!(scene.verdicts.len() >= labels.len());

    // The second run finds the reference, and a damaged one is made again, bit by bit the same.
    let file = kept_reference(&cache);
    let whole = std::fs::read(&file).unwrap();
    let made = std::fs::metadata(&file).unwrap().modified().unwrap();
    chart(&cache, &mirror, &output)
        .assert()
        .success()
        .stderr("");
    let again = std::fs::metadata(kept_reference(&cache)).unwrap();
    assert_eq!(again.modified().unwrap(), made, "it was made again");
    // How far a curve goes depends on how fast the machine is just then, its errors do not.
    let (before, after) = (errors(&first.scenes), errors(&read(&output).scenes));
    let both: Vec<_> = after
        .keys()
        .filter(|key| before.contains_key(key))
        .collect();
    assert!(both.len() >= labels.len(), "{before:?} {after:?}");
    for key in both {
        assert_eq!(before[key], after[key], "{key:?}");
    }

    for damaged in [
        &whole[..whole.len() / 2],
        &[whole.as_slice(), b"x"].concat(),
    ] {
        std::fs::write(&file, damaged).unwrap();
        chart(&cache, &mirror, &output)
            .assert()
            .success()
            .stderr(contains("warning: ").and(contains("made again")));
        assert!(std::fs::read(&file).unwrap() == whole);
    }
}

/// L1 of all points, by curve and samples.
fn errors(scenes: &[SceneChart]) -> BTreeMap<(String, u64), f64> {
    (scenes.iter().flat_map(|scene| &scene.series))
        .flat_map(|series| {
            let entry = |point: &Point| ((series.label.clone(), point.samples), point.l1);
            series.points.iter().map(entry)
        })
        .collect()
}

#[test]
fn the_command_reference_finds_what_it_computed() {
    let folder = tempfile::tempdir().unwrap();
    let command = |name: &str, more: &[&str]| {
        let mut command = nephroid();
        command.env("XDG_CACHE_HOME", folder.path().join("cache"));
        command.arg("reference").arg(scene_path("mirror.toml"));
        command
            .args(["--lightmap", "16", "--error", "0.1"])
            .args(more);
        command.arg("-o").arg(folder.path().join(name));
        command
    };
    let run = |name: &str, more: &[&str]| {
        let summary = crate::common::json(&mut command(name, more));
        (
            summary["from_cache"].clone(),
            std::fs::read(folder.path().join(name)).unwrap(),
        )
    };
    let (from_cache, first) = run("a.exr", &["--no-cache"]);
    assert_eq!(from_cache, false);
    assert!(!folder.path().join("cache").exists());
    assert_eq!(run("b.exr", &[]).0, false);
    assert_eq!(run("b.exr", &["--no-cache"]).0, false);
    let (from_cache, found) = run("c.exr", &[]);
    assert_eq!(from_cache, true);
    assert!(found == first);
    assert_eq!(run("d.exr", &["--seed", "1"]).0, false);

    let references = folder.path().join("cache/nephroid/references");
    for entry in references.read_dir().unwrap() {
        std::fs::write(entry.unwrap().path(), "damaged").unwrap();
    }
    let again = command("e.exr", &[]).assert().success();
    again.stderr(contains("warning: ").and(contains("the reference was made again")));
    assert_eq!(run("f.exr", &[]).0, true);
}

#[cfg(unix)]
#[test]
fn a_cache_that_cannot_be_written_is_a_warning() {
    let folder = tempfile::tempdir().unwrap();
    let cache = folder.path().join("cache");
    std::fs::write(&cache, "a file where the folder should be").unwrap();
    chart(
        &cache,
        &[scene_path("mirror.toml")],
        &folder.path().join("chart"),
    )
    .assert()
    .success()
    .stderr(contains("warning: the reference is not kept"));
}

#[test]
fn what_cannot_work_is_refused_before_the_work() {
    let folder = tempfile::tempdir().unwrap();
    let (cache, output) = (folder.path().join("cache"), folder.path().join("chart"));
    let mirror = scene_path("mirror.toml");
    let one = |scene: &Path| chart(&cache, &[scene.to_owned()], &output);
    refuses(
        &mut one(Path::new("none.toml")),
        3,
        &["none.toml", "remedy"],
    );
    refuses(
        one(&mirror).args(["--receiver", "roof"]),
        2,
        &["`roof`", "floor"],
    );
    refuses(
        &mut chart(&cache, &[mirror.clone(), mirror.clone()], &output),
        2,
        &["two scenes are called mirror"],
    );
    let peers = folder.path().join("peers.json");
    std::fs::write(&peers, "{\n  \"schema\": 1,\n  \"peers\": [7]\n}").unwrap();
    refuses(
        one(&mirror).arg("--peers").arg(&peers),
        3,
        &["peers.json, line 3"],
    );
    let slow = r#"{"schema": 1, "peers": [{"name": "a", "version": "1", "hardware": "b", "scene": "mirror",
        "seconds": 1e300, "error": 0.1}]}"#;
    std::fs::write(&peers, slow).unwrap();
    refuses(
        one(&mirror).arg("--peers").arg(&peers),
        3,
        &["entry 1 (a), seconds", "1e300 is not from 1e-9 to 1e9"],
    );
    refuses(one(&mirror).arg("--peers=none.json"), 3, &["none.json"]);
    refuses(one(&mirror).arg("--device=none"), 4, &["none"]);
    let file = folder.path().join("file");
    std::fs::write(&file, "no folder").unwrap();
    refuses(
        &mut chart(&cache, std::slice::from_ref(&mirror), &file.join("chart")),
        2,
        &["chart: cannot be written"],
    );
    let taken = folder.path().join("taken");
    std::fs::create_dir_all(taken.join("chart.csv")).unwrap();
    refuses(
        &mut chart(&cache, std::slice::from_ref(&mirror), &taken),
        2,
        &["chart.csv", "it is a folder"],
    );
    refuses(
        chart(&cache, &[], &output).current_dir(folder.path()),
        2,
        &["assets/scenes", "remedy"],
    );
    assert!(
        !cache.join("nephroid/references").exists(),
        "it began the work"
    );
    // In the 32 bits of light maps this light is none, which only the reference tells.
    let faint = folder.path().join("faint.toml");
    let text = std::fs::read_to_string(&mirror).unwrap();
    let lines = text
        .lines()
        .map(|line| match line.starts_with("irradiance") {
            true => "irradiance = [1e-50, 1e-50, 1e-50]",
            false => line,
        });
    std::fs::write(&faint, lines.collect::<Vec<_>>().join("\n")).unwrap();
    refuses(&mut one(&faint), 2, &["no mirror sends light"]);
}

/// What a sweep of the mirror's floor needs.
fn plan() -> Plan {
    Plan {
        sides: vec![64],
        main_side: 64,
        step: 16,
        most_patches: 1 << 16,
        most_points: 1 << 16,
        most_pinhole_patches: 256,
        errors: vec![0.02],
        budgets: vec![1000],
        seconds: 0.0,
        reference_error: 0.003,
    }
}

fn reference(scene: &Scene) -> Reference {
    let texels = plan().reference_texels(scene, 1);
    solve(scene, "floor", texels, &options(plan().reference_error))
}

fn measure(scene: &Scene, reference: &Reference) -> Vec<SceneChart> {
    let subject = Subject {
        name: "mirror",
        scene,
        receiver: 1,
        reference,
    };
    let cancel = AtomicBool::new(false);
    let context = Context::new(&ContextOptions::default()).unwrap();
    sweep(&context, &subject, &plan(), &mut |_| {}, &cancel).unwrap()
}

/// Lowest L1 error of a method over its settings.
fn floor_of(chart: &SceneChart, label: &str) -> f64 {
    let series = chart.series.iter().find(|series| series.label == label);
    (series.unwrap().points.iter())
        .map(|point| point.l1)
        .fold(f64::INFINITY, f64::min)
}

/// A chart that cannot show that a method is wrong would be worth nothing.
#[test]
fn five_percent_too_much_flux_is_a_floor_of_five_percent() {
    let scene = load("mirror.toml");
    let reference = reference(&scene);
    let [right, wrong] =
        [1.0, 1.05].map(|factor| measure(&brighter(scene.clone(), factor), &reference));
    assert_eq!(right.len(), 1);
    for (right, wrong) in right.iter().zip(&wrong) {
        let (good, bad) = (floor_of(right, "footprint"), floor_of(wrong, "footprint"));
        println!("{:?}: {good}, with 5 % more flux {bad}", right.light_map);
        assert!(good < 0.02, "{good}");
        assert!((0.045..0.06).contains(&bad), "{bad}");
        let verdict = |chart: &SceneChart| {
            let of = |verdict: &&String| verdict.starts_with("footprint ");
            chart.verdicts.iter().find(of).unwrap().clone()
        };
        assert!(verdict(wrong).contains("footprint does not fall below 1 %"));
        if good < 0.01 {
            assert!(verdict(right).contains("footprint falls below 1 %"));
        }
    }
}

/// A reference for coarse texels may be averaged from one for fine texels.
#[test]
fn an_averaged_reference_is_a_reference() {
    let scene = load("mirror.toml");
    let fine = reference(&scene);
    let coarse = fine.coarser(2);
    assert!(coarse.relative_error < fine.relative_error);
    let direct = solve(&scene, "floor", [32; 2], &options(0.002));
    let [coarse_map, direct_map] = [coarse.image(), direct.image()];
    // Errors of both, of which expected values are known, and a margin for chance.
    let bound = 1.5 * coarse.relative_error.hypot(direct.relative_error);
    crate::common::assert_error(
        "averaged reference",
        bound,
        crate::common::l1(&coarse_map, &direct_map),
        crate::common::l1(&scaled(&coarse_map, 1.01), &direct_map),
    );
}

/// Ctrl-C ends the program with 130 and keeps the scenes that were finished.
#[cfg(unix)]
#[test]
fn ctrl_c_keeps_finished_scenes() {
    use std::process::{Command, Stdio};
    use std::time::{Duration, Instant};
    let folder = tempfile::tempdir().unwrap();
    let output = folder.path().join("chart");
    let mut child = crate::common::program()
        .env("XDG_CACHE_HOME", folder.path().join("cache"))
        .args(["chart", "--quick", "-o"])
        .arg(&output)
        .args(["mirror.toml", "ring.toml"].map(scene_path))
        .stdout(Stdio::piped())
        .stderr(Stdio::piped())
        .spawn()
        .unwrap();
    let start = Instant::now();
    // The last of the files.
    while !output.join("chart.json").exists() {
        assert!(start.elapsed() < Duration::from_secs(300), "no chart");
        std::thread::sleep(Duration::from_millis(20));
    }
    let pid = child.id().to_string();
    Command::new("kill").args(["-INT", &pid]).status().unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let names: Vec<String> = (read(&output).scenes.iter())
        .map(|scene| scene.scene.clone())
        .collect();
    assert_eq!(names, ["mirror"]);
    let files = std::fs::read_dir(&output).unwrap().count();
    assert_eq!(files, 4, "no temporary file is left");
}
