//! Merged triangles of smooth casters.

use crate::common::{Device, aiming_for, bits, l1, load, only_receiver};
use nephroid::measure;
use nephroid::scene::{Geometry, Scene};
use std::sync::Arc;

const TEXELS: [u32; 2] = [128, 128];

/// Waves that are finer than large errors need: 32 768 triangles, some of whose light goes past the floor.
fn pool() -> Scene {
    only_receiver(load("pool.toml"), "floor", TEXELS)
}

/// With merged triangles, the map keeps its error and the light. The estimate is of that error.
#[test]
fn large_errors_merge_triangles() {
    let (device, scene) = (Device::open(), pool());
    let floor = scene.object_index("floor").unwrap();
    let find = |error| {
        let mut renderer = device.renderer(&scene, &aiming_for(error));
        renderer.caustic().unwrap();
        let estimate = renderer.estimated_error().unwrap().unwrap();
        let patches = renderer.samples().unwrap();
        (renderer.read_caustic(floor).unwrap(), estimate, patches)
    };
    let (truth, _, all) = find(0.002);
    let (map, estimate, merged) = find(0.05);
    assert!(all > 24_000 && merged < all / 3, "{all} and {merged}");
    let error = l1(&map, &truth);
    assert!((0.002..0.03).contains(&error), "{error}");
    let ratio = f64::from(estimate) / error;
    assert!((0.5..2.5).contains(&ratio), "{estimate} for {error}");
    let energy = measure::compare(&map, &truth)
        .unwrap()
        .energy_ratio
        .unwrap();
    assert!((energy - 1.0).abs() < 0.002, "{energy}");
}

/// The error to aim for may change from frame to frame, and waves travel: nothing of earlier frames remains.
#[test]
fn frames_merge_for_themselves() {
    let device = Device::open();
    let mut scene = pool();
    let floor = scene.object_index("floor").unwrap();
    let alone = |scene: &Scene, error| {
        let mut renderer = device.renderer(scene, &aiming_for(error));
        renderer.caustic().unwrap();
        bits(&renderer.read_caustic(floor).unwrap())
    };
    let mut renderer = device.renderer(&scene, &aiming_for(0.05));
    let mut maps = Vec::new();
    for (frame, error) in [0.05, 0.01, 0.05].into_iter().enumerate() {
        for object in &mut scene.objects {
            if let Geometry::Waves(waves) = &mut object.geometry {
                waves.time = 0.3 * frame as f64;
            }
        }
        renderer.update(&scene).unwrap();
        renderer.set_error(error);
        renderer.caustic().unwrap();
        let map = bits(&renderer.read_caustic(floor).unwrap());
        assert!(map == alone(&scene, error), "frame {frame}");
        maps.push(map);
    }
    assert!(maps[0] != maps[2]);
}

/// A surface that becomes rough has all of its triangles again.
#[test]
fn rough_surfaces_are_not_merged() {
    let device = Device::open();
    let mut scene = pool();
    let water = scene.object_index("water").unwrap();
    let mut mesh = scene.objects[water].geometry.mesh().into_owned();
    scene.objects[water].geometry = Geometry::Mesh(Arc::new(mesh.clone()));
    let mut renderer = device.renderer(&scene, &aiming_for(0.05));
    let mut patches = |scene: &Scene| {
        renderer.update(scene).unwrap();
        renderer.caustic().unwrap();
        renderer.samples().unwrap()
    };
    let smooth = patches(&scene);
    for (number, normal) in mesh.normals.iter_mut().enumerate() {
        normal.x += 0.05 * ((number as f64 * 12.9).sin() * 4e4).fract();
        *normal = normal.normalize();
    }
    scene.objects[water].geometry = Geometry::Mesh(Arc::new(mesh));
    let rough = patches(&scene);
    assert!(smooth < 10_000 && rough > 24_000, "{smooth} and {rough}");
}
