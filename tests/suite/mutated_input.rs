//! Whatever becomes of a scene's files, loading them is no panic, and what loads is sound.

use crate::common::folder::{Folder, MTL, OBJ, SCENE, hdr, write_exr};
use proptest::prelude::*;
use std::fs;
use tempfile::TempDir;

/// Replaces, removes or doubles a few ranges of bytes.
fn mutated(content: Vec<u8>) -> impl Strategy<Value = Vec<u8>> {
    let snippets = [
        "nan",
        "-inf",
        "1e308",
        "0",
        "-1",
        "99999999999999999999",
        "\"",
        "[",
        "]",
        "{",
        "#",
        "\n",
        "/",
        "..",
        "[[object]]\n",
        "\u{feff}",
        "é",
        "\t",
    ];
    let bytes = prop_oneof![
        prop::sample::select(snippets.to_vec()).prop_map(|snippet| snippet.as_bytes().to_vec()),
        prop::collection::vec(any::<u8>(), 0..3),
    ];
    let edit = (any::<prop::sample::Index>(), 0..12usize, bytes);
    prop::collection::vec(edit, 1..4).prop_map(move |edits| {
        let mut content = content.clone();
        for (at, removed, bytes) in edits {
            let start = at.index(content.len() + 1);
            let end = (start + removed).min(content.len());
            content.splice(start..end, bytes);
        }
        content
    })
}

/// Loads the scene with one file exchanged: whatever comes of it, it is no panic.
fn load_with(file: &str, content: &[u8]) {
    let folder = Folder::new();
    let mut scene = SCENE.to_owned();
    if file == "part.mtl" || file == "part.obj" {
        scene = scene.replace("material = \"steel\"", "");
    }
    if file == "sky.exr" {
        scene = scene.replace("sky.hdr", "sky.exr");
    }
    folder.write("scene.toml", scene);
    folder.write(file, content);
    if let Ok(loaded) = folder.load() {
        for object in &loaded.scene.objects {
            if let Some(mesh) = object.geometry.as_mesh() {
                assert!(mesh.positions.iter().all(|position| position.is_finite()));
                assert!(
                    mesh.normals
                        .iter()
                        .all(|normal| (normal.length() - 1.0).abs() < 1e-9)
                );
                let corners = mesh.triangles.iter().flatten();
                assert!(
                    corners
                        .copied()
                        .all(|i| (i as usize) < mesh.positions.len())
                );
            }
        }
    }
}

fn exr_bytes() -> Vec<u8> {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("sky.exr");
    write_exr(&path, |x, y| (x as f32, y as f32, 1.0));
    fs::read(path).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..Default::default() })]

    #[test]
    fn mutated_scenes_never_panic(content in mutated(SCENE.into())) {
        load_with("scene.toml", &content);
    }

    #[test]
    fn mutated_meshes_never_panic(content in mutated(OBJ.into())) {
        load_with("part.obj", &content);
    }

    #[test]
    fn mutated_material_libraries_never_panic(content in mutated(MTL.into())) {
        load_with("part.mtl", &content);
    }

    #[test]
    fn mutated_hdr_images_never_panic(content in mutated(hdr(16, 8, &[[1.0, 0.5, 0.25]; 128]))) {
        load_with("sky.hdr", &content);
    }

    #[test]
    fn mutated_exr_images_never_panic(content in mutated(exr_bytes())) {
        load_with("sky.exr", &content);
    }
}
