//! What a stranger's shell, files and signals bring.

use crate::common::{json, nephroid, scene_path};
use nephroid::image_file::{RgbImage, read_rgb, write_exr};
use std::ffi::OsStr;
use std::os::unix::ffi::OsStrExt;
use std::os::unix::fs::PermissionsExt;
use std::path::Path;
use std::process::{Command, Output, Stdio};
use std::time::Duration;

/// Runs a line in a shell, in a folder, with `$nephroid` and `$scenes`.
fn shell(folder: &Path, line: &str) -> Output {
    Command::new("sh")
        .args(["-c", line])
        .current_dir(folder)
        .env("nephroid", assert_cmd::cargo::cargo_bin("nephroid"))
        .env("scenes", scene_path(""))
        .output()
        .unwrap()
}

/// Its exit code, and stderr, where nothing can be that a terminal obeys.
fn refused(folder: &Path, line: &str) -> (i32, String) {
    let output = shell(folder, line);
    let message = String::from_utf8(output.stderr).unwrap();
    let is_plain = |c: char| c == '\n' || !c.is_control();
    assert!(message.chars().all(is_plain), "{line}: {message:?}");
    assert!(!message.contains("panicked"), "{line}: {message}");
    (output.status.code().unwrap(), message)
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = (folder.read_dir().unwrap())
        .map(|entry| entry.unwrap().file_name().to_string_lossy().into_owned())
        .collect();
    names.sort();
    names
}

fn grey(path: &Path) {
    let image = RgbImage {
        width: 4,
        height: 4,
        pixels: vec![[1.0; 3]; 16],
    };
    write_exr(path, &image, &[], "").unwrap();
}

/// A signal at any moment leaves whole files or none, and its exit code.
#[test]
fn signals_leave_nothing_half_written() {
    let commands = [
        "bake ring.toml --receiver floor --method pinhole --samples 100000 -o map.exr",
        "render ring.toml -o view.png",
        "bake ring.toml --receiver floor --lightmap 1024 --frames 0-9999 -o map.exr",
        "reference ring.toml --receiver floor --no-cache --error 0.0001 -o map.exr",
        "chart ring.toml -o chart",
        "stress -o stress",
    ];
    for (round, line) in commands.iter().cycle().take(18).enumerate() {
        let folder = tempfile::tempdir().unwrap();
        let mut words = line.split(' ');
        let mut command = crate::common::program();
        command.arg(words.next().unwrap());
        command.args(words.map(|word| match word.ends_with(".toml") {
            true => scene_path(word).into_os_string(),
            false => word.into(),
        }));
        let mut child = (command.current_dir(folder.path()).stdout(Stdio::null()))
            .env("XDG_CACHE_HOME", folder.path().join("cache"))
            .stderr(Stdio::piped())
            .spawn()
            .unwrap();
        // From before the scene is loaded to the middle of the work.
        std::thread::sleep(Duration::from_millis(60 + (round as u64 * 7919) % 1700));
        let (signal, code) = [
            (libc::SIGINT, 130),
            (libc::SIGTERM, 143),
            (libc::SIGHUP, 143),
        ][round % 3];
        // SAFETY: no memory is involved.
        assert_eq!(unsafe { libc::kill(child.id() as i32, signal) }, 0);
        let start = std::time::Instant::now();
        let status = child.wait().unwrap();
        assert!(start.elapsed() < Duration::from_secs(5), "{line}");
        assert_eq!(status.code(), Some(code), "{line}: {status}");
        let mut folders = vec![folder.path().to_owned()];
        while let Some(folder) = folders.pop() {
            for entry in folder.read_dir().unwrap() {
                let path = entry.unwrap().path();
                let name = path.file_name().unwrap().to_string_lossy().into_owned();
                assert!(!name.starts_with(".tmp"), "{line}: {}", path.display());
                if path.is_dir() {
                    folders.push(path);
                } else if name.ends_with(".exr") {
                    read_rgb(&path).unwrap();
                }
            }
        }
    }
}

#[test]
fn what_cannot_be_read_or_written_is_refused_at_once() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    grey(&folder.join("a.exr"));
    assert!(shell(folder, "mkfifo pipe.exr").status.success());
    for (line, code, part) in [
        (
            "$nephroid compare --json a.exr a.exr > /dev/full",
            2,
            "stdout: cannot be written: No space left",
        ),
        (
            "$nephroid devices > /dev/full",
            2,
            "stdout: cannot be written: No space left",
        ),
        (
            "$nephroid compare a.exr pipe.exr",
            3,
            "pipe.exr: it is not a regular file",
        ),
        (
            "$nephroid compare /dev/zero a.exr",
            3,
            "/dev/zero: it is not a regular file",
        ),
        (
            "$nephroid chart $scenes/ring.toml -o c --peers /dev/zero",
            3,
            "/dev/zero: it is not a regular file",
        ),
        (
            "$nephroid chart $scenes/ring.toml -o c --peers pipe.exr",
            3,
            "pipe.exr: it is not a regular file",
        ),
        (
            "truncate -s 3G big.toml; $nephroid bake big.toml -o a.exr",
            3,
            "the file is larger than 16 MiB",
        ),
        (
            "$nephroid bake $scenes/mirror.toml -o /dev/stdout",
            2,
            "/dev/stdout is no .exr file",
        ),
    ] {
        let (found, message) = refused(folder, line);
        assert_eq!(found, code, "{line}: {message}");
        assert!(message.contains(part), "{line}: {message}");
    }
    // A reader that stops listening is no error.
    assert!(
        shell(folder, "$nephroid compare a.exr a.exr | true")
            .status
            .success()
    );
}

#[test]
fn names_cannot_steer_a_terminal() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let peers = r#"{"schema": 1, "peers": [{"name": "\u001b]0;x\u0007", "version": "1", "hardware": "h",
        "scene": "ring", "seconds": 0, "error": 1}]}"#;
    std::fs::write(folder.join("peers.json"), peers).unwrap();
    let (code, message) = refused(
        folder,
        "$nephroid chart $scenes/ring.toml -o c --peers peers.json",
    );
    assert_eq!(code, 3);
    assert!(message.contains("\\u{1b}]0;x\\u{7}"), "{message}");

    let text = std::fs::read_to_string(scene_path("mirror.toml")).unwrap();
    std::fs::write(
        folder.join("scene.toml"),
        text.replacen("mirror\"", "\\u001b[2J\"", 1),
    )
    .unwrap();
    let (code, message) = refused(folder, "$nephroid bake scene.toml -o a.exr");
    assert_eq!(code, 3, "{message}");
}

#[test]
fn output_names_of_any_bytes_are_reported() {
    let folder = tempfile::tempdir().unwrap();
    let name = |bytes: &[u8]| folder.path().join(OsStr::from_bytes(bytes));
    let bake = |output: &Path, more: &[&str]| {
        let mut command = nephroid();
        (command.arg("bake").arg(scene_path("mirror.toml")).arg("-o")).arg(output);
        json(
            command
                .args(["--lightmap", "8", "--samples", "2"])
                .args(more),
        )
    };
    let report = bake(&name(b"\xff.exr"), &[]);
    assert!(report["file"].as_str().unwrap().ends_with("\u{fffd}.exr"));
    assert!(report["submissions"]["count"].as_u64().unwrap() >= 1);
    read_rgb(&name(b"\xff.exr")).unwrap();
    bake(&name(b"\xfe.exr"), &["--frames", "0-1"]);
    read_rgb(&name(b"\xfe.0001.exr")).unwrap();
}

#[test]
fn modes_follow_the_umask_and_stacks_do_not_follow_the_limit() {
    let folder = tempfile::tempdir().unwrap();
    let folder = folder.path();
    let bake = "$nephroid bake $scenes/mirror.toml --lightmap 8 --samples 2 -o";
    for (line, file, mode) in [
        (format!("umask 077; {bake} a.exr"), "a.exr", 0o600),
        (format!("umask 022; {bake} b.exr"), "b.exr", 0o644),
        (
            format!("chmod 640 b.exr; umask 077; {bake} b.exr"),
            "b.exr",
            0o640,
        ),
        (format!("ulimit -s 64; {bake} c.exr"), "c.exr", 0o644),
    ] {
        let output = shell(folder, &line);
        assert!(output.status.success(), "{line}: {output:?}");
        let found = folder.join(file).metadata().unwrap().permissions().mode() & 0o777;
        assert_eq!(found, mode, "{line}");
    }
    assert_eq!(names(folder), ["a.exr", "b.exr", "c.exr"]);
}

/// A doubled export would be twice as bright.
#[test]
fn duplicates_are_left_out_and_counted() {
    let flux = |doubled: bool| {
        let folder = crate::common::folder::Folder::new();
        let obj = crate::common::folder::OBJ;
        let faces: String = obj
            .lines()
            .filter(|line| line.starts_with("f "))
            .map(|l| format!("{l}\n"))
            .collect();
        if doubled {
            folder.write("part.obj", [obj, "\n", &faces].concat());
        }
        let loaded = folder.load().unwrap();
        let told = loaded
            .warnings
            .iter()
            .any(|w| w.contains("2 triangles were left out, as others have the same"));
        assert_eq!(told, doubled, "{:?}", loaded.warnings);
        let object = &loaded.scene.objects[loaded.scene.object_index("part").unwrap()];
        object.geometry.mesh().triangles.len()
    };
    assert_eq!(flux(true), flux(false));
}

/// Where two triangles that look up meet one that looks down, the mean of their normals lies behind it.
#[test]
fn computed_normals_are_named_with_their_rule() {
    let folder = crate::common::folder::Folder::new();
    folder.write(
        "part.obj",
        "v 0 0 0\nv 1 0 0\nv 0.5 1 0.04\nv 0.5 1 -0.04\nv 1.5 1 0\nf 1 2 3\nf 2 5 3\nf 2 1 4\n",
    );
    let warnings = folder.load().unwrap().warnings;
    let said = |part: &str| warnings.iter().any(|warning| warning.contains(part));
    assert!(
        said("the file has no normals, so all normals were computed"),
        "{warnings:?}"
    );
    assert!(said("weighted by the angle of the corner"), "{warnings:?}");
}

/// Of twelve unlit mirrors, eight are named and the others are counted.
#[test]
fn notes_of_a_kind_are_capped() {
    let folder = tempfile::tempdir().unwrap();
    let scene = std::fs::read_to_string(scene_path("mirror.toml")).unwrap();
    let (before, mirror) = scene.split_at(scene.find("[[object]]").unwrap());
    // Light of chains could reach any of them.
    let before = before.replacen("version = 1", "version = 1\nmax_interfaces = 1", 1);
    let mut text = format!("{before}{mirror}");
    for index in 0..12 {
        // Its front looks down, away from the sun.
        text += &format!(
            "\n[[object]]\nname = \"idle{index}\"\nmaterial = \"copper\"\n\
             rect = {{ origin = [{index}.0, 5.0, 0.0], edge_u = [0.5, 0.0, 0.0], edge_v = [0.0, 0.0, 0.5] }}\n"
        );
    }
    std::fs::write(folder.path().join("scene.toml"), text).unwrap();
    let line = "$nephroid bake scene.toml --receiver floor --lightmap 16 --samples 16 -o a.exr";
    let (code, message) = refused(folder.path(), line);
    assert_eq!(code, 0, "{message}");
    assert_eq!(message.matches("\"idle").count(), 8, "{message}");
    assert!(message.contains("4 more like these"), "{message}");
}

#[test]
fn samples_that_cannot_be_met_are_named() {
    let folder = tempfile::tempdir().unwrap();
    let line = "$nephroid bake $scenes/pool.toml --receiver floor --lightmap 16 --method pinhole --samples 100 -o a.exr";
    let (code, message) = refused(folder.path(), line);
    assert_eq!(code, 0, "{message}");
    let expected = "note: 32768 patches are made, not 100: there is one for every triangle";
    assert!(message.contains(expected), "{message}");
}

#[test]
fn completions_and_the_man_page_are_printed() {
    for kind in ["bash", "elvish", "fish", "powershell", "zsh", "man"] {
        let output = nephroid().args(["completions", kind]).output().unwrap();
        assert!(output.status.success());
        let text = String::from_utf8(output.stdout).unwrap();
        for command in [
            "bake",
            "render",
            "reference",
            "compare",
            "chart",
            "stress",
            "devices",
        ] {
            assert!(text.to_lowercase().contains(command), "{kind}: {command}");
        }
        assert_eq!(text.contains(".SH BAKE"), kind == "man");
    }
}
