//! Light maps keep their bits when code moves.
//!
//! `tests/suite/pinned_maps.txt` has a hash of the light maps of every shipped scene by every method, and the
//! device and driver that made them: bits depend on both. With the same driver, CPUs of AMD and Intel gave the same bits.
//! Where a commit changes them on purpose it says why
//! and writes the file again: `NEPHROID_PIN=1 cargo test --release --test suite pinned`.

use crate::common::{Device, load_with_chains, method, shipped};
use nephroid::render::{Method, Renderer};
use nephroid::scene::Scene;
use std::fmt::Write;

const FILE: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/suite/pinned_maps.txt");

/// (method, samples, width of the light maps)
const METHODS: [(Method, u32, u32); 4] = [
    (Method::Footprint, 4096, 64),
    (Method::Beams, 4096, 64),
    (Method::Points, 65_536, 64),
    (Method::Pinhole, 1, 4),
];

/// Charts of meshes need this width.
const LEAST_OF_MESHES: u32 = 16;

/// The scene with small light maps.
fn small(mut scene: Scene, width: u32) -> Scene {
    for object in &mut scene.objects {
        let width = match object.geometry.placement() {
            Some(_) => width.max(LEAST_OF_MESHES),
            None => width,
        };
        if let Some([w, h]) = &mut object.light_map {
            (*w, *h) = (width, (width * *h / *w).max(1));
        }
    }
    scene
}

fn hash(renderer: &mut Renderer, scene: &Scene) -> String {
    renderer.caustic().unwrap();
    let mut hasher = blake3::Hasher::new();
    for (receiver, _) in scene.light_maps() {
        let map = renderer.read_caustic(receiver).unwrap();
        hasher.update(bytemuck::cast_slice(map.pixels.as_flattened()));
    }
    hasher.finalize().to_hex()[..16].to_owned()
}

#[test]
fn light_maps_keep_their_bits() {
    let device = Device::unwatched();
    let info = device.0.info();
    let machine = format!("{} | {}", info.name, info.driver);
    let pinned = std::fs::read_to_string(FILE).unwrap_or_default();
    let is_written = std::env::var_os("NEPHROID_PIN").is_some();
    if !is_written && pinned.lines().next() != Some(&machine) {
        println!(
            "not compared: this is {machine}, pinned is {:?}",
            pinned.lines().next()
        );
        return;
    }
    let mut found = machine + "\n";
    for file in shipped() {
        let name = file.trim_end_matches(".toml");
        let loaded = load_with_chains(&file);
        for (kind, samples, width) in METHODS {
            let scene = small(loaded.clone(), width);
            let is_mesh = scene.mesh_receivers().next().is_some();
            if kind == Method::Beams && is_mesh {
                continue;
            }
            let mut renderer = device.renderer(&scene, &method(kind, samples));
            let hash = hash(&mut renderer, &scene);
            writeln!(found, "{name} {kind:?} {hash}").unwrap();
        }
    }
    if is_written {
        std::fs::write(FILE, found).unwrap();
        return;
    }
    let changed: Vec<&str> = (found.lines())
        .filter(|line| !pinned.lines().any(|other| other == *line))
        .collect();
    assert!(changed.is_empty(), "changed:\n{}", changed.join("\n"));
    assert_eq!(found.lines().count(), pinned.lines().count());
}
