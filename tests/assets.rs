//! The checked-in assets are what the generator makes.

#[path = "../examples/generate_assets/assets.rs"]
mod assets;

use std::collections::BTreeSet;
use std::path::Path;

#[test]
fn checked_in_assets_are_the_generated_ones() {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets");
    let generated = assets::all();
    for (path, content) in &generated {
        let checked_in = std::fs::read(root.join(path)).unwrap();
        assert!(
            checked_in == *content,
            "{path} differs: run `cargo run --example generate_assets`"
        );
    }
    let expected: BTreeSet<_> = generated.iter().map(|(path, _)| root.join(path)).collect();
    for folder in ["meshes", "environments"] {
        for entry in root.join(folder).read_dir().unwrap() {
            let path = entry.unwrap().path();
            assert!(
                expected.contains(&path),
                "{} is not generated",
                path.display()
            );
        }
    }
}

#[test]
fn all_assets_together_stay_small() {
    let bytes: usize = assets::all().iter().map(|(_, content)| content.len()).sum();
    assert!(bytes < 2_000_000, "{bytes} bytes");
}
