//! What the loader takes and refuses of environments.

use crate::common::folder::{Folder, SCENE, hdr, write_exr};
use nephroid::scene::LightKind;
use std::fs;

#[test]
fn environments_are_read_from_both_formats() {
    let folder = Folder::new();
    write_exr(&folder.path("sky.exr"), |x, y| (x as f32, y as f32, 0.5));
    folder.write("scene.toml", SCENE.replace("sky.hdr", "sky.exr"));
    let loaded = folder.load().unwrap_or_else(|e| panic!("{e}"));
    let LightKind::Environment { map, .. } = &loaded.scene.lights[1].kind else {
        panic!("the second light is the sky");
    };
    assert_eq!((map.width, map.height), (4, 2));
    assert_eq!(map.radiance[6], [2.0, 1.0, 0.5]);

    // EXPOSURE is what the pixels were multiplied by.
    let content = hdr(2, 1, &[[1.0; 3]; 2]);
    let header = b"#?RADIANCE\n".len();
    let exposed = [&content[..header], b"EXPOSURE=4\n", &content[header..]].concat();
    folder.write("sky.hdr", exposed);
    folder.write("scene.toml", SCENE);
    let loaded = folder.load().unwrap_or_else(|e| panic!("{e}"));
    let LightKind::Environment { map, .. } = &loaded.scene.lights[1].kind else {
        panic!("the second light is the sky");
    };
    assert_eq!(map.radiance, [[0.25; 3]; 2]);

    for bad in [
        "EXPOSURE=0\n",
        "EXPOSURE=-2\n",
        "EXPOSURE=nan\n",
        "COLORCORR=1 0 1\n",
    ] {
        let exposed = [&content[..header], bad.as_bytes(), &content[header..]].concat();
        folder.write("sky.hdr", exposed);
        let message = folder.error();
        assert!(
            message.starts_with("sky.hdr: EXPOSURE and COLORCORR"),
            "{message}"
        );
    }
}

#[test]
fn an_environment_casts_caustics_unless_its_file_says_not() {
    let folder = Folder::new();
    let scene = |key: &str| SCENE.replace("rotation_degrees = 90.0", key);
    for (key, casts) in [
        ("", true),
        ("caustics = true", true),
        ("caustics = false", false),
    ] {
        folder.write("scene.toml", scene(key));
        let loaded = folder.load().unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(loaded.scene.lights[1].kind.casts_caustics(), casts, "{key}");
        assert!(loaded.scene.lights[0].kind.casts_caustics());
    }
    folder.write("scene.toml", scene("caustics = 0"));
    let message = folder.error();
    assert!(message.contains("expected a boolean"), "{message}");
    let sun = SCENE.replace(
        "direction = [0.0, 3.0, -4.0]",
        "direction = [0.0, 3.0, -4.0]\ncaustics = false",
    );
    folder.write("scene.toml", sun);
    let message = folder.error();
    assert!(
        message.contains("the kind `sun` has no key `caustics`"),
        "{message}"
    );
}

/// Radiance RGBE of 1 W/m²/sr, run-length encoded.
fn white(width: usize, height: usize) -> Vec<u8> {
    let mut content =
        format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {height} +X {width}\n").into_bytes();
    for _ in 0..height {
        content.extend([2, 2, (width >> 8) as u8, width as u8]);
        for value in [128, 128, 128, 129] {
            let mut rest = width;
            while rest > 0 {
                let run = rest.min(127);
                content.extend([128 + run as u8, value]);
                rest -= run;
            }
        }
    }
    content
}

#[test]
fn the_largest_environment_loads() {
    let folder = Folder::new();
    folder.write("sky.hdr", white(8192, 4096));
    let loaded = folder.load().unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(loaded.warnings, Vec::<String>::new());
    let LightKind::Environment { map, .. } = &loaded.scene.lights[1].kind else {
        panic!("the second light is the sky");
    };
    assert_eq!((map.width, map.height), (8192, 4096));
    assert!(map.radiance.iter().all(|rgb| *rgb == [1.0; 3]));
}

#[test]
fn bad_environments_are_refused() {
    let folder = Folder::new();
    folder.write("sky.hdr", "not an image");
    assert!(folder.error().starts_with("sky.hdr: cannot be decoded: "));
    let whole = hdr(16, 8, &[[1.0, 0.5, 0.25]; 128]);
    folder.write("sky.hdr", &whole[..whole.len() - 20]);
    assert!(folder.error().starts_with("sky.hdr: cannot be decoded: "));
    let claim = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 30000 +X 30000\n";
    folder.write("sky.hdr", claim);
    for size in [
        ["30000", "30000"],
        ["4097", "8192"],
        ["4096", "8193"],
        ["8192", "16384"],
    ] {
        let [height, width] = size;
        folder.write(
            "sky.hdr",
            claim.replacen("30000", height, 1).replace("30000", width),
        );
        let message = folder.error();
        let start = format!("sky.hdr: {width} x {height} pixels are too many: at most 8192 x 4096");
        assert!(message.starts_with(&start), "{message}");
    }
    folder.write("sky.hdr", claim.replace("30000", "0"));
    assert!(folder.error().starts_with("sky.hdr: "));
    folder.write("sky.hdr", "");
    assert!(folder.error().starts_with("sky.hdr: cannot be decoded: "));

    folder.write("scene.toml", SCENE.replace("sky.hdr", "sky.png"));
    folder.write("sky.png", &whole);
    assert!(
        folder
            .error()
            .starts_with("sky.png: an environment is an .hdr or .exr image")
    );

    folder.write("scene.toml", SCENE.replace("sky.hdr", "sky.exr"));
    for bad in [f32::NAN, f32::INFINITY, -1.0, 1e30] {
        let one_bad = |x, y| (1.0, if (x, y) == (3, 1) { bad } else { 1.0 }, 1.0);
        write_exr(&folder.path("sky.exr"), one_bad);
        let message = folder.error();
        assert!(
            message.starts_with("sky.exr, column 3, row 1 "),
            "{message}"
        );
        assert!(message.contains("is not a radiance"), "{message}");
    }
    write_exr(&folder.path("sky.exr"), |_, _| (1.0, 1.0, 1.0));
    folder.load().unwrap_or_else(|e| panic!("{e}"));
    let whole = fs::read(folder.path("sky.exr")).unwrap();
    folder.write("sky.exr", &whole[..whole.len() - 8]);
    assert!(folder.error().starts_with("sky.exr: cannot be decoded: "));
}

#[test]
fn radiance_beyond_what_can_be_added_up_is_refused() {
    let folder = Folder::new();
    folder.write("scene.toml", SCENE.replace("sky.hdr", "sky.exr"));
    write_exr(&folder.path("sky.exr"), |_, _| (1.0, 9e14, 1.0));
    folder.load().unwrap_or_else(|e| panic!("{e}"));
    let scaled = SCENE.replace("sky.hdr\"", "sky.exr\"\nscale = 2.0");
    folder.write("scene.toml", scaled);
    let message = folder.error();
    for part in [
        "scene.toml, line 19, column 9",
        "9e14 times scale 2",
        "lower the scale",
    ] {
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn an_environment_of_another_shape_is_taken_with_a_warning() {
    let folder = Folder::new();
    folder.write("sky.hdr", hdr(2, 2, &[[1.0; 3]; 4]));
    let warnings = folder.load().unwrap().warnings;
    assert!(
        warnings.len() == 1 && warnings[0].contains("2 x 2 pixels"),
        "{warnings:?}"
    );
}
