//! Frames of what moves: the same as if each were rendered alone, and without flicker.

use crate::common::{
    Device, assert_error, brighter, footprint, l1, load, method, moved, object_mut, only_receiver,
    options, scaled, solve,
};
use glam::DVec3;
use nephroid::Error;
use nephroid::image_file::RgbImage;
use nephroid::measure::SequenceMeter;
use nephroid::render::{Method, Renderer, Settings};
use nephroid::scene::{EnvironmentMap, Geometry, LightKind, Mesh, Scene};
use std::sync::Arc;
use std::time::Instant;

/// The ring's floor at a low resolution.
fn ring() -> Scene {
    only_receiver(load("ring.toml"), "floor", [48, 48])
}

/// Waves of 32² quads over the pool's floor.
fn pool() -> Scene {
    let mut scene = only_receiver(load("pool.toml"), "floor", [48, 48]);
    if let Geometry::Waves(waves) = &mut object_mut(&mut scene, "water").geometry {
        waves.quads = [32, 32];
    }
    scene
}

fn at_time(mut scene: Scene, seconds: f64) -> Scene {
    if let Geometry::Waves(waves) = &mut object_mut(&mut scene, "water").geometry {
        waves.time = seconds;
    }
    scene
}

fn with_sun(mut scene: Scene, toward: DVec3) -> Scene {
    if let LightKind::Sun { direction, .. } = &mut scene.lights[0].kind {
        *direction = toward.normalize();
    }
    scene
}

fn floor_of(renderer: &mut Renderer, scene: &Scene) -> RgbImage {
    renderer.caustic().unwrap();
    let floor = scene.object_index("floor").unwrap();
    renderer.read_caustic(floor).unwrap()
}

/// Renders `scenes`, which all fill the same box and so have the same origin on the device, one after
/// the other by updates, and compares each with a renderer of its own,
/// bit by bit: light map, direct light and view.
fn assert_as_if_alone(scenes: &[Scene], settings: &Settings) {
    let device = Device::open();
    let mut renderer = device.renderer(&scenes[0], settings);
    let mut last: Option<RgbImage> = None;
    let render = |renderer: &mut Renderer, scene: &Scene| {
        let floor = scene.object_index("floor").unwrap();
        let map = floor_of(renderer, scene);
        renderer.direct().unwrap();
        let direct = renderer.read_direct(floor).unwrap();
        renderer.view(&scene.camera, [32, 18], 1).unwrap();
        vec![map, direct, renderer.read_view().unwrap()]
    };
    for (index, scene) in scenes.iter().enumerate() {
        renderer.update(scene).unwrap();
        let images = render(&mut renderer, scene);
        let alone = render(&mut device.renderer(scene, settings), scene);
        for (what, (image, alone)) in ["caustic", "direct", "view"]
            .iter()
            .zip(images.iter().zip(&alone))
        {
            let differ = (image.pixels.iter().zip(&alone.pixels))
                .filter(|(a, b)| a != b)
                .count();
            assert_eq!(differ, 0, "frame {index}, {what}");
        }
        let map = images.into_iter().next().unwrap();
        if let Some(last) = last.replace(map.clone()) {
            assert!(last.pixels != map.pixels, "frame {index} shows nothing new");
        }
    }
}

/// What stands still is rendered once; after a change of anything that it depends on, again.
#[test]
fn a_still_scene_is_rendered_once() {
    let device = Device::open();
    let scene = ring();
    let mut renderer = device.renderer(&scene, &footprint(4096));
    let mut is_rendered = |scene: &Scene| {
        renderer.update(scene).unwrap();
        let map = floor_of(&mut renderer, scene);
        let passes = renderer.take_times();
        (
            passes.iter().any(|pass| pass.name == "splat triangles"),
            map.pixels,
        )
    };
    let (first, map) = is_rendered(&scene);
    let (again, same) = is_rendered(&scene);
    assert!(first && !again && map == same);
    let brighter = brighter(scene.clone(), 2.0);
    let (of_light, double) = is_rendered(&brighter);
    assert!(of_light && double != map);
    let (of_camera, _) = is_rendered(&{
        let mut scene = brighter.clone();
        scene.camera.position.y += 0.1;
        scene
    });
    assert!(!of_camera);
    let (of_motion, _) = is_rendered(&moved(brighter, "ring", 0.1, DVec3::ZERO));
    assert!(of_motion);
    let start = Instant::now();
    for _ in 0..50 {
        renderer.caustic().unwrap();
    }
    println!(
        "a still frame takes {:.3} ms",
        20.0 * start.elapsed().as_secs_f64()
    );
    renderer.invalidate();
    renderer.take_times();
    renderer.caustic().unwrap();
    let passes = renderer.take_times();
    assert!(passes.iter().any(|pass| pass.name == "splat triangles"));
}

#[test]
fn a_moved_ring_is_as_if_made_there() {
    let scenes = [0.0, 0.3, 2.0].map(|angle| moved(ring(), "ring", angle, 0.1 * angle * DVec3::X));
    assert_as_if_alone(&scenes, &footprint(4096));
}

#[test]
fn a_moved_sun_is_as_if_made_there() {
    let suns = [[-0.7, 0.55, 0.4], [-0.68, 0.55, 0.42], [-0.66, 0.56, 0.44]];
    let scenes = suns.map(|toward| with_sun(ring(), toward.into()));
    assert_as_if_alone(&scenes, &footprint(4096));
}

#[test]
fn travelled_waves_are_as_if_made_there() {
    let scenes = [0.0, 0.1, 0.7].map(|seconds| at_time(pool(), seconds));
    for of in [Method::Footprint, Method::Beams, Method::Points] {
        assert_as_if_alone(&scenes, &method(of, 4096));
    }
}

/// Brighter, and turned.
#[test]
fn a_changed_environment_is_as_if_made_so() {
    let map = Arc::new(EnvironmentMap {
        width: 4,
        height: 2,
        radiance: (0..8).map(|texel| [texel as f32, 1.0, 0.5]).collect(),
    });
    let scenes = [(1.0, 0.0), (2.5, 0.0), (2.5, 1.0)].map(|(scale, rotation)| {
        let mut scene = only_receiver(load("ball.toml"), "floor", [16, 16]);
        scene.lights[0].kind = LightKind::Environment {
            map: map.clone(),
            scale,
            rotation,
            casts_caustics: true,
        };
        scene
    });
    for settings in [method(Method::Pinhole, 1), footprint(256)] {
        assert_as_if_alone(&scenes, &settings);
    }
}

/// Another image of the same size.
#[test]
fn another_environment_is_as_if_made_so() {
    let scenes = [0, 3, 5].map(|bright| {
        let mut scene = only_receiver(load("ball.toml"), "floor", [16, 16]);
        scene.lights[0].kind = LightKind::Environment {
            map: Arc::new(EnvironmentMap {
                width: 4,
                height: 2,
                radiance: (0..8)
                    .map(|texel| if texel == bright { [50.0; 3] } else { [1.0; 3] })
                    .collect(),
            }),
            scale: 1.0,
            rotation: 0.0,
            casts_caustics: true,
        };
        scene
    });
    for settings in [method(Method::Pinhole, 1), footprint(256)] {
        assert_as_if_alone(&scenes, &settings);
    }
    // Nor is any pipeline made for it.
    let device = Device::unwatched();
    let mut renderer = device.renderer(&scenes[0], &footprint(256));
    renderer.caustic().unwrap();
    let before = device.0.pipeline_count();
    renderer.update(&scenes[1]).unwrap();
    renderer.caustic().unwrap();
    assert_eq!(device.0.pipeline_count(), before);
}

/// A mirror that looks away at first reflects nothing; turned to the sun it reflects all that a mirror
/// made there does, and then nothing again. Its patches need buffers that are made on the way.
#[test]
fn a_mirror_turns_to_the_light_and_away() {
    let mirror = || only_receiver(load("mirror.toml"), "floor", [32, 32]);
    let away = moved(mirror(), "mirror", std::f64::consts::PI, DVec3::ZERO);
    for of in [
        Method::Footprint,
        Method::Beams,
        Method::Points,
        Method::Pinhole,
    ] {
        let settings = method(of, 512);
        let device = Device::open();
        let mut renderer = device.renderer(&away, &settings);
        let dark = |renderer: &mut Renderer| {
            let map = floor_of(renderer, &away);
            assert!(map.pixels.iter().all(|&rgb| rgb == [0.0; 3]), "{of:?}");
        };
        dark(&mut renderer);
        assert_eq!(renderer.samples().unwrap(), 0);
        renderer.update(&mirror()).unwrap();
        let alone = device.caustic(&mirror(), "floor", &settings);
        assert!(
            floor_of(&mut renderer, &mirror()).pixels == alone.pixels,
            "{of:?}"
        );
        renderer.update(&away).unwrap();
        dark(&mut renderer);
    }
}

/// Tiles of a mirror that fly apart, of which half shrink: the hierarchy over them is built anew, which changes the indices of all
/// triangles, but not into how many facets each is divided.
#[test]
fn tiles_that_fly_apart_are_as_if_made_there() {
    const SIDE: usize = 20;
    // Column, row and size of each, and between two in m.
    let tiles = |places: fn(usize) -> (usize, f64), steps: [f64; 2]| {
        let mut scene = ring();
        // Without the walls, whose boxes would hide that those of the tiles grow.
        (scene.objects).retain(|object| ["ring", "floor"].contains(&object.name.as_str()));
        let along = DVec3::new(0.4, 0.0, 0.7).normalize();
        let mut positions = Vec::new();
        for (place, size) in (0..SIDE * SIDE).map(places) {
            let [column, row] = [place % SIDE, place / SIDE].map(|number| number as f64);
            let corner = steps[0] * (column - 10.0) * along + (0.1 + steps[1] * row) * DVec3::Y;
            positions.extend([corner, corner + size * along, corner + size * DVec3::Y]);
        }
        scene.objects[0].geometry = Geometry::Mesh(Arc::new(Mesh {
            normals: vec![along.cross(DVec3::Y); positions.len()],
            triangles: (0..positions.len() as u32 / 3)
                .map(|tile| [0, 1, 2].map(|corner| 3 * tile + corner))
                .collect(),
            positions,
        }));
        scene
    };
    let before = tiles(|tile| (tile, 0.02), [0.02, 0.02]);
    let after = tiles(
        |tile| (173 * tile % (SIDE * SIDE), [0.02, 0.01][tile % 2]),
        [0.09, 0.04],
    );
    let device = Device::open();
    // A renderer for `after` alone has fewer facets for the one number of samples, and more for the other.
    for samples in [4096, 16_384] {
        let settings = footprint(samples);
        let mut renderer = device.renderer(&before, &settings);
        renderer.caustic().unwrap();
        renderer.update(&after).unwrap();
        let map = floor_of(&mut renderer, &after);
        let alone = device.caustic(&after, "floor", &settings);
        assert_error(
            &format!("tiles that fly apart, {samples} samples"),
            0.005,
            l1(&map, &alone),
            l1(&scaled(&map, 1.01), &alone),
        );
    }
}

/// Without a light that meets it again, a convex mirror has no room for such light. It may move and be scaled, but has to stay
/// convex.
#[test]
fn a_mirror_that_becomes_concave_is_refused() {
    // A box without its bottom; `depth`: by which its top is pulled in at the middle.
    let dented = |depth: f64| {
        let mut scene = ring();
        scene.max_interfaces = 2;
        let (x, y) = ([-0.3, 0.3, 0.3, -0.3], [0.2, 0.2, -0.2, -0.2]);
        let ring = |height: f64| (0..4).map(move |i| DVec3::new(x[i], height, y[i]));
        let top = DVec3::new(0.0, 0.5 - depth, 0.0);
        let positions: Vec<_> = ring(0.1).chain(ring(0.5)).chain([top]).collect();
        let sides = (0..4).flat_map(|i| {
            let next = (i + 1) % 4;
            [
                [i, next, 4 + i],
                [next, 4 + next, 4 + i],
                [4 + i, 4 + next, 8],
            ]
        });
        scene.objects[0].geometry = Geometry::Mesh(Arc::new(Mesh {
            normals: (positions.iter())
                .map(|p| (p - DVec3::Y * 0.2).normalize())
                .collect(),
            positions,
            triangles: sides.collect(),
        }));
        scene
    };
    let convex = dented(0.0);
    let device = Device::open();
    let mut renderer = device.renderer(&convex, &footprint(256));
    assert!(!renderer.may_chain());
    renderer
        .update(&moved(convex.clone(), "ring", 0.7, 0.2 * DVec3::X))
        .unwrap();
    renderer.update(&dented(-0.1)).unwrap();
    let before = floor_of(&mut renderer, &dented(-0.1));
    let error = renderer.update(&dented(0.3)).unwrap_err();
    assert!(matches!(error, Error::Usage { .. }), "{error}");
    assert!(
        error
            .to_string()
            .contains("light may now meet object `ring` several times"),
        "{error}"
    );
    assert!(floor_of(&mut renderer, &dented(-0.1)).pixels == before.pixels);
    assert!(device.renderer(&dented(0.3), &footprint(256)).may_chain());
    let once = |mut scene: Scene| {
        scene.max_interfaces = 1;
        scene
    };
    let mut renderer = device.renderer(&once(convex), &footprint(256));
    renderer.update(&once(dented(0.3))).unwrap();
}

#[test]
fn another_scene_is_refused_and_the_last_one_stays() {
    let device = Device::open();
    let scene = ring();
    let mut renderer = device.renderer(&scene, &footprint(512));
    let before = floor_of(&mut renderer, &scene);
    let changed = |change: fn(&mut Scene)| {
        let mut scene = ring();
        change(&mut scene);
        scene
    };
    for (other, part) in [
        (pool(), "it had"),
        (
            changed(|s| s.max_interfaces += 1),
            "its max_interfaces differs",
        ),
        (changed(|s| s.lights.clear()), "it had 2 lights and has 0"),
        (
            changed(|s| s.objects[0].material = 1),
            "the kind of material of object `ring` differs",
        ),
        (
            changed(|s| object_mut(s, "floor").light_map = Some([8, 8])),
            "the size of the light map of object `floor` differs",
        ),
        (
            changed(|s| object_mut(s, "floor").blocks_light = false),
            "the shadow of object `floor` differs",
        ),
        (
            changed(|s| s.objects[0].geometry = load("ball.toml").objects[0].geometry.clone()),
            "the topology of object `ring` differs",
        ),
    ] {
        let error = renderer.update(&other).unwrap_err();
        assert!(matches!(error, Error::Usage { .. }), "{error}");
        let message = error.to_string();
        assert!(
            message.contains(part) && message.contains("remedy"),
            "{message}"
        );
    }
    assert!(floor_of(&mut renderer, &scene).pixels == before.pixels);
}

/// Mean |ΔE − ΔE*| over mean E* of a turning ring, of which the second half is what flickers when
/// patches jump: there each frame has patches of its own.
#[test]
fn a_turning_ring_does_not_flicker() {
    let device = Device::open();
    let settings = footprint(16_384);
    let scenes: Vec<Scene> = (0..3)
        .map(|frame| moved(ring(), "ring", 0.013 * f64::from(frame), DVec3::ZERO))
        .collect();
    let mut renderer = device.renderer(&scenes[0], &settings);
    let [mut steady, mut jumping] = [(); 2].map(|()| SequenceMeter::default());
    for (frame, scene) in scenes.iter().enumerate() {
        let truth = solve(scene, "floor", [48, 48], &options(0.0015)).image();
        renderer.update(scene).unwrap();
        steady
            .push(floor_of(&mut renderer, scene), truth.clone())
            .unwrap();
        let other = footprint(16_384 >> (4 * (frame % 2)));
        jumping
            .push(device.caustic(scene, "floor", &other), truth)
            .unwrap();
    }
    let [steady, jumping] = [steady, jumping].map(|meter| meter.finish().flicker.unwrap());
    // Half a per cent a frame is asked for; with that, even the jumping ones would pass.
    assert_error("flicker of a turning ring", 0.0035, steady, jumping);
}

/// A ring that turns about its own axis under two windows stays the same, so whatever changes flickers.
#[test]
fn a_turning_ring_does_not_flicker_under_windows() {
    let device = Device::open();
    let mut still = ring();
    still.lights = load("table.toml").lights;
    let samples = 16_384;
    let mut renderer = device.renderer(&still, &footprint(samples));
    let first = floor_of(&mut renderer, &still);
    let [mut steady, mut jumping] = [(); 2].map(|()| SequenceMeter::default());
    for frame in 0..5 {
        let scene = moved(still.clone(), "ring", 0.013 * f64::from(frame), DVec3::ZERO);
        renderer.update(&scene).unwrap();
        let map = floor_of(&mut renderer, &scene);
        steady.push(map, first.clone()).unwrap();
        let other = footprint(samples >> (4 * (frame % 2)));
        let map = device.caustic(&scene, "floor", &other);
        jumping.push(map, first.clone()).unwrap();
    }
    let [steady, jumping] = [steady, jumping].map(|meter| meter.finish().flicker.unwrap());
    assert_error("flicker under windows", 0.01, steady, jumping);
}
