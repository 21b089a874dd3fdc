//! The same scene gives the same bits, every time.

use crate::common::{
    Device, bits, brighter, load, load_with_chains, method, set_light_maps, shipped,
};
use nephroid::render::{Method, Settings};
use nephroid::scene::Scene;

/// Bits of every light map and of the view, twice in the same renderer.
fn render(scene: &Scene, settings: &Settings) -> Vec<Vec<u32>> {
    let device = Device::open();
    let mut renderer = device.renderer(scene, settings);
    let mut frame = || {
        renderer.invalidate();
        renderer.view(&scene.camera, [32, 18], 1).unwrap();
        let mut images = vec![bits(&renderer.read_view().unwrap())];
        for (receiver, _) in scene.light_maps() {
            images.push(bits(&renderer.read_caustic(receiver).unwrap()));
        }
        images
    };
    let (one, two) = (frame(), frame());
    assert!(one == two, "two frames of a renderer differ");
    assert!(one[1].iter().any(|bits| *bits != 0), "the receiver is dark");
    one
}

fn same_bits(name: &str, method_: Method, samples: u32) {
    let mut scene = load(name);
    set_light_maps(&mut scene, [32, 32]);
    let settings = method(method_, samples);
    let one = render(&scene, &settings);
    assert!(one == render(&scene, &settings), "two devices differ");
    let changed = brighter(scene, 1.000_01);
    assert!(one != render(&changed, &settings), "a change is not seen");
}

#[test]
fn footprint() {
    same_bits("ring.toml", Method::Footprint, 16_384);
}

#[test]
fn beams() {
    same_bits("ring.toml", Method::Beams, 16_384);
}

#[test]
fn points() {
    same_bits("ring.toml", Method::Points, 200_000);
}

#[test]
fn pinhole() {
    same_bits("ball.toml", Method::Pinhole, 1);
}

#[test]
fn footprint_on_a_mesh() {
    same_bits("globe.toml", Method::Footprint, 16_384);
}

#[test]
fn footprint_of_a_lamp() {
    same_bits("lamp.toml", Method::Footprint, 16_384);
}

/// A frame that takes longer may be several submissions, s.
const LONG: f64 = 0.05;

/// At the default error to aim for, with small light maps. The first frame reads how much there is to draw, and every frame with
/// landings of chains on meshes reads their number. Work that takes long is divided, so that the device stays usable meanwhile.
#[test]
fn a_caustic_is_one_submission() {
    let device = Device::unwatched();
    let settings = Settings {
        error: Some(0.02),
        ..Settings::default()
    };
    let mut single = 0;
    for name in shipped() {
        let mut scene = load_with_chains(&name);
        set_light_maps(&mut scene, [32, 32]);
        let mut renderer = device.renderer(&scene, &settings);
        let has_mesh_receiver = (scene.light_maps().iter())
            .any(|(receiver, _)| scene.objects[*receiver].geometry.placement().is_some());
        let most = 1 + u32::from(has_mesh_receiver && renderer.may_chain());
        let mut frame = || {
            renderer.invalidate();
            renderer.caustic().unwrap();
            let submissions = renderer.submissions();
            (submissions.count, submissions.longest)
        };
        let is_right =
            |(count, longest): (u32, f64)| count <= most || f64::from(count) * longest > LONG;
        let mut frames = vec![frame(), frame()];
        while !is_right(frames[frames.len() - 1]) && frames.len() < 6 {
            frames.push(frame());
        }
        println!("{name}: {frames:?}");
        let last = frames[frames.len() - 1];
        assert!(is_right(last), "{name}: {frames:?}");
        single += u32::from(last.0 == 1);
    }
    assert!(single >= 10, "{single}");
}
