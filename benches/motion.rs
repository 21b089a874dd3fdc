//! What a frame costs in which everything moves, beside one in which nothing does. Run by `make
//! bench`; it only measures and demands no speed.
//!
//! Frames of both kinds take turns, so that what else the machine does falls on both. `evaluate` is
//! `Animation::at` or what a program has in its place, here in Rust: the scene of that time.

#[path = "../tests/common/mod.rs"]
mod common;

use common::{Device, footprint, load, run::Run, with_texels};
use glam::{DMat3, DVec3};
use nephroid::gpu::keep_freed_memory;
use nephroid::measure::Spread;
use nephroid::scene::{Geometry, LightKind, Scene, Similarity};
use std::time::Instant;

const FRAMES: usize = 120;
const WARM_UP: usize = 5;
/// s
const FRAME: f64 = 1.0 / 24.0;

fn main() {
    keep_freed_memory();
    let device = Device::unwatched();
    println!("scene  patches  still ms  evaluate ms  update ms  moving ms  moving / still");
    for (name, receiver) in [
        ("ring.toml", "floor"),
        ("pool.toml", "floor"),
        ("table.toml", "table"),
    ] {
        let scene = with_texels(load(name), receiver, [256, 256]);
        let settings = footprint(16_384);
        let mut still = device.renderer(&scene, &settings);
        let mut moving = device.renderer(&scene, &settings);
        let [mut stills, mut evaluations, mut updates, mut movings] = [(); 4].map(|()| Vec::new());
        for frame in 0..WARM_UP + FRAMES {
            let start = Instant::now();
            still.invalidate();
            still.caustic().unwrap();
            let still = start.elapsed().as_secs_f64();

            let start = Instant::now();
            let scene = moved(&scene, frame as f64 * FRAME);
            let evaluated = start.elapsed().as_secs_f64();
            moving.update(&scene).unwrap();
            let updated = start.elapsed().as_secs_f64();
            moving.caustic().unwrap();
            let all = start.elapsed().as_secs_f64();
            if frame >= WARM_UP {
                stills.push(still);
                evaluations.push(evaluated);
                updates.push(updated - evaluated);
                movings.push(all);
            }
        }
        let median = |times: &[f64]| 1e3 * Spread::of(times).median;
        println!(
            "{:<5} {:>8} {:>9.2} {:>12.2} {:>10.2} {:>10.2} {:>15.2}",
            name.trim_end_matches(".toml"),
            moving.samples().unwrap(),
            median(&stills),
            median(&evaluations),
            median(&updates),
            median(&movings),
            median(&movings) / median(&stills),
        );
    }
    println!();
    for (name, value) in Run::on(device.0.info()).rows() {
        println!("{:<11}{value}", name.to_lowercase());
    }
}

/// Everything in another place: objects turn about the y axis, and so do suns and skies; waves travel.
fn moved(scene: &Scene, time: f64) -> Scene {
    /// rad/s
    const SPEED: f64 = 0.2;
    let mut scene = scene.clone();
    let rotation = DMat3::from_rotation_y(SPEED * time);
    let turn = Similarity {
        scale: 1.0,
        rotation,
        shift: DVec3::ZERO,
    };
    for object in &mut scene.objects {
        if let Geometry::Waves(waves) = &mut object.geometry {
            waves.time = time;
        }
        object.geometry = object.geometry.moved(&turn);
    }
    for light in &mut scene.lights {
        match &mut light.kind {
            LightKind::Sun { direction, .. } => *direction = rotation * *direction,
            LightKind::Environment { rotation, .. } => *rotation += SPEED * time,
            LightKind::Lamp { .. } => {}
        }
    }
    scene
}
