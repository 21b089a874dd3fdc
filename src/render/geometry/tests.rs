//! Tests of meshes in motion on a device.

use crate::gpu::{Context, ContextOptions, Recorder};
use crate::render::device_scene::{Change, DeviceScene};
use crate::render::frame::upload;
use crate::render::gpu_types::{Normals, Triangle};
use crate::render::patches::subdivision::Kind;
use crate::render::settings::Settings;
use crate::scene::{Geometry, Mesh, Scene, Similarity};
use glam::{DMat3, DVec3, Vec3};
use std::path::Path;
use std::sync::Arc;

fn similarity(scale: f64, angle: f64, shift: DVec3) -> Similarity {
    Similarity {
        scale,
        rotation: DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), angle),
        shift,
    }
}

/// That the device has the vertices of all meshes where the host has them, and merged triangles with their midpoints, too.
fn assert_in_place(device: &mut DeviceScene, recorder: &mut Recorder, scene: &Scene, what: &str) {
    upload(recorder, device).unwrap();
    recorder.submit().unwrap();
    let geometry = &device.geometry;
    let count = geometry.store.len() + geometry.merging.triangles.len();
    let triangles = geometry.triangles.read::<Triangle>(count).unwrap();
    let normals = geometry.normals.read::<Normals>(count).unwrap();
    let near = |found: Vec3, expected: DVec3| {
        let distance = found.as_dvec3().distance(expected);
        assert!(
            distance < 1e-6 * device.bodies.size(),
            "{what}: {distance} m"
        );
    };
    let assert_at = |place: u32, mesh: &Mesh, vertices: [u32; 3]| {
        let (triangle, normals) = (&triangles[place as usize], &normals[place as usize]);
        let a = triangle.position;
        let corners = [a, a + triangle.edge1, a + triangle.edge2];
        let of_corners = [normals.n0, normals.n1, normals.n2];
        for ((corner, normal), vertex) in corners.into_iter().zip(of_corners).zip(vertices) {
            near(
                corner,
                mesh.positions[vertex as usize] - geometry.store.origin,
            );
            let expected = mesh.normals[vertex as usize];
            assert!(normal.as_dvec3().distance(expected) < 1e-6, "{what}");
        }
    };
    for (index, object) in scene.objects.iter().enumerate() {
        let mesh = object.geometry.mesh();
        for (&vertices, &place) in mesh.triangles.iter().zip(geometry.store.indices(index)) {
            assert_at(place, &mesh, vertices);
            let on_host = geometry.store.triangle(place);
            near(on_host.position, triangles[place as usize].position.into());
        }
        for (piece, place) in (1..geometry.merging.set_count())
            .flat_map(|set| geometry.merging.pieces(index, set).into_iter().flatten())
        {
            if let Kind::Merged { midpoints, .. } = piece.kind {
                assert_at(place, &mesh, piece.corners);
                assert_at(triangles[place as usize].twin, &mesh, midpoints);
            }
        }
    }
}

/// A mesh that is placed, placed again, back at rest, deformed, and placed once more, whose triangles are merged; and beside
/// it a board that lies far away at rest.
#[test]
fn placed_meshes_are_where_the_host_has_them() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/pool.toml");
    let mut scene = crate::scene::load(&file).unwrap().scene;
    let [water, floor] = ["water", "floor"].map(|name| scene.object_index(name).unwrap());
    let mesh = Arc::new(scene.objects[water].geometry.mesh().into_owned());
    scene.objects[water].geometry = Geometry::Mesh(mesh.clone());
    let mut board = scene.objects[floor].clone();
    let far = similarity(1.0, 0.0, DVec3::new(0.0, 0.0, 1e7));
    let board_mesh = Arc::new(board.geometry.mesh().placed(&far));
    let back = |angle: f64| Geometry::Placed {
        mesh: board_mesh.clone(),
        by: similarity(0.5, angle, DVec3::ZERO).after(&similarity(1.0, 0.0, -far.shift)),
    };
    (board.light_map, board.geometry) = (None, back(0.0));
    scene.objects.push(board);
    let board = scene.objects.len() - 1;
    let context = Context::new(&ContextOptions::default()).unwrap();
    let settings = Settings {
        error: Some(0.02),
        ..Settings::default()
    };
    let mut recorder = Recorder::new(&context).unwrap();
    let mut device = DeviceScene::new(&context, &scene, &settings).unwrap();
    assert!(device.geometry.merging.has(water));
    assert_in_place(&mut device, &mut recorder, &scene, "at first");
    let placed = |scale, angle, shift| Geometry::Placed {
        mesh: mesh.clone(),
        by: similarity(scale, angle, shift),
    };
    let mut deformed = mesh.as_ref().clone();
    for position in &mut deformed.positions {
        position.y += 0.01 * position.x.sin();
    }
    for (what, of_water, of_board) in [
        ("placed", placed(1.0, 0.1, DVec3::X), back(0.0)),
        ("placed again", placed(0.8, 0.3, DVec3::ZERO), back(0.2)),
        ("at rest", Geometry::Mesh(mesh.clone()), back(0.2)),
        ("deformed", Geometry::Mesh(Arc::new(deformed)), back(0.2)),
        ("placed after all", placed(1.0, 0.2, DVec3::Y), back(0.4)),
    ] {
        scene.objects[water].geometry = of_water;
        scene.objects[board].geometry = of_board;
        device.update(&context, &scene).unwrap();
        assert_in_place(&mut device, &mut recorder, &scene, what);
    }
    // Nothing is placed by a frame that changes nothing.
    assert_eq!(device.update(&context, &scene).unwrap(), Change::Nothing);
    assert!(!device.geometry.is_moved && device.geometry.to_place.is_empty());
}

/// Triangles that move apart make the hierarchy costly, of which the next frame learns, and the one after builds it again.
#[test]
fn a_costly_hierarchy_is_rebuilt() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/ring.toml");
    let mut scene = crate::scene::load(&file).unwrap().scene;
    let Some((mesh, _)) = scene.objects[0].geometry.placement() else {
        panic!("a mesh");
    };
    let mesh = mesh.clone();
    let context = Context::new(&ContextOptions::default()).unwrap();
    let mut recorder = Recorder::new(&context).unwrap();
    let mut device = DeviceScene::new(&context, &scene, &Settings::default()).unwrap();
    assert_in_place(&mut device, &mut recorder, &scene, "at first");
    let mut scattered = mesh.as_ref().clone();
    let count = mesh.positions.len();
    for (number, position) in scattered.positions.iter_mut().enumerate() {
        *position = mesh.positions[number * 7919 % count];
    }
    let scattered = Arc::new(scattered);
    let placed = |angle| Geometry::Placed {
        mesh: scattered.clone(),
        by: similarity(1.0, angle, DVec3::ZERO),
    };
    scene.objects[0].geometry = placed(0.1);
    device.update(&context, &scene).unwrap();
    assert_in_place(&mut device, &mut recorder, &scene, "scattered");
    let before = device.geometry.store.indices(0).to_vec();
    assert_eq!(device.update(&context, &scene).unwrap(), Change::Nothing);
    upload(&mut recorder, &mut device).unwrap();
    recorder.submit().unwrap();
    assert!(device.geometry.hierarchy.is_costly());
    assert_eq!(device.update(&context, &scene).unwrap(), Change::Content);
    assert_ne!(device.geometry.store.indices(0), before);
    assert_in_place(&mut device, &mut recorder, &scene, "rebuilt");
    scene.objects[0].geometry = placed(0.2);
    device.update(&context, &scene).unwrap();
    assert_in_place(&mut device, &mut recorder, &scene, "placed after that");
    assert!(!device.geometry.hierarchy.is_costly());
}

/// The first frame, and one that places another mesh.
#[test]
fn the_next_frame_does_what_was_not_submitted() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/glass_ball.toml");
    let mut scene = crate::scene::load(&file).unwrap().scene;
    let ball = scene.object_index("ball").unwrap();
    let still = scene.objects[ball].geometry.clone();
    let mut other = scene.objects[ball].clone();
    (other.light_map, other.geometry) = (None, Geometry::Mesh(Arc::new(still.mesh().into_owned())));
    scene.objects.push(other);
    let other = scene.objects.len() - 1;
    let context = Context::new(&ContextOptions::default()).unwrap();
    let mut device = DeviceScene::new(&context, &scene, &Settings::default()).unwrap();
    let mut recorder = Recorder::new(&context).unwrap();
    let refuse = |device: &mut DeviceScene| {
        upload(&mut Recorder::new(&context).unwrap(), device).unwrap();
        device.forget_last();
    };
    refuse(&mut device);
    refuse(&mut device);
    assert_in_place(&mut device, &mut recorder, &scene, "at first");
    let before = scene.clone();
    let up = similarity(1.0, 0.3, DVec3::Y);
    scene.objects[other].geometry = scene.objects[other].geometry.moved(&up);
    device.update(&context, &scene).unwrap();
    refuse(&mut device);
    assert_in_place(&mut device, &mut recorder, &scene, "another one");
    // Copies to what an update replaces before they are recorded.
    let mut device = DeviceScene::new(&context, &before, &Settings::default()).unwrap();
    device.update(&context, &scene).unwrap();
    assert_eq!(device.geometry.replaced.len(), 1);
    device.geometry.replaced.clear();
    assert_in_place(&mut device, &mut recorder, &scene, "both at once");
}
