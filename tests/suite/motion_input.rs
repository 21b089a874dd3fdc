//! What the loader takes and refuses of what moves: keyframes and animated meshes.

use crate::common::folder::{Folder, OBJ, SCENE};
use glam::DVec3;
use nephroid::scene::{Geometry, LightKind, Similarity};
use std::fs;
use tempfile::TempDir;

/// Frames of a mesh that rises by 1 m in each.
fn write_frames(folder: &Folder, count: usize) {
    for frame in 0..count {
        let obj =
            format!("v 0 0 {frame}\nv 1 0 {frame}\nv 1 1 {frame}\nv 0 1 {frame}\nf 1 2 3 4\n");
        folder.write(&format!("rising/{frame:02}.obj"), obj);
    }
}

#[test]
fn everything_moves_with_time() {
    let folder = Folder::new();
    write_frames(&folder, 3);
    let scene = SCENE
        .replace(
            "position = [2, 1.5, 2.5]\n",
            "keyframes = [{ time = 0, position = [2, 0, 0] }, { time = 2, position = [2, 4, 0] }]\n",
        )
        .replace(
            "direction = [0.0, 3.0, -4.0]\n",
            "keyframes = [{ time = 1, direction = [1, 0, 0] }, { time = 3, direction = [0, 2, 0] }]\n",
        )
        .replace(
            "rotation_degrees = 90.0\n",
            "keyframes = [{ time = 0, rotation_degrees = 0 }, { time = 4, rotation_degrees = 360 }]\n",
        )
        .replace(
            "mesh = \"part.obj\"\n",
            "frames = { folder = \"rising\", fps = 1 }\n",
        )
        .replace(
            "lightmap = [32, 16]\n",
            "lightmap = [32, 16]\n[object.motion]\npivot = [0, 0, 1]\naxis = [0, 5, 0]\n\
             keyframes = [{ time = 0 }, { time = 2, angle_degrees = 180, scale = 3, translation = [0, 1, 0] }]\n",
        );
    folder.write("scene.toml", scene);
    let loaded = folder.load().unwrap_or_else(|e| panic!("{e}"));
    let close = |a: DVec3, b: DVec3| assert!(a.distance(b) < 1e-12, "{a} {b}");
    for (time, camera_y, sun, rotation, height, origin, edge_u) in [
        (
            0.0,
            0.0,
            DVec3::X,
            0.0,
            0.0,
            [-1.0, 0.0, 1.0],
            [2.0, 0.0, 0.0],
        ),
        (
            1.0,
            2.0,
            DVec3::X,
            90.0,
            1.0,
            [0.0, 0.5, 3.0],
            [0.0, 0.0, -4.0],
        ),
        (
            1.5,
            3.0,
            DVec3::new(
                f64::cos(0.125 * std::f64::consts::PI),
                f64::sin(0.125 * std::f64::consts::PI),
                0.0,
            ),
            135.0,
            1.5,
            [2.5 * 0.5f64.sqrt(), 0.75, 1.0 + 2.5 * 0.5f64.sqrt()],
            [-5.0 * 0.5f64.sqrt(), 0.0, -5.0 * 0.5f64.sqrt()],
        ),
        (
            9.0,
            4.0,
            DVec3::Y,
            360.0,
            2.0,
            [3.0, 1.0, 1.0],
            [-6.0, 0.0, 0.0],
        ),
    ] {
        let scene = loaded.animation.at(time);
        close(scene.camera.position, DVec3::new(2.0, camera_y, 0.0));
        let LightKind::Sun { direction, .. } = scene.lights[0].kind else {
            panic!("the first light is a sun");
        };
        close(direction, sun);
        let LightKind::Environment {
            rotation: found, ..
        } = scene.lights[1].kind
        else {
            panic!("the second light is an environment");
        };
        assert!((found - f64::to_radians(rotation)).abs() < 1e-12);
        let mesh = scene.objects[0].geometry.as_mesh().unwrap();
        assert!(
            mesh.positions.iter().all(|p| (p.z - height).abs() < 1e-12),
            "{time}"
        );
        let Geometry::Rect(rect) = scene.objects[1].geometry else {
            panic!("the second object is a rect");
        };
        close(rect.origin, origin.into());
        close(rect.edge_u, edge_u.into());
    }
    let start = loaded.animation.at(0.0);
    assert_eq!(loaded.scene.objects[1].geometry, start.objects[1].geometry);
}

#[test]
fn lamps_move_and_fade() {
    let folder = Folder::new();
    let lamp = "\n[[light]]\nname = \"lamp\"\nkind = \"lamp\"\nradius = 0.1\nkeyframes = [\
                {time = 0, position = [0, 9, 0], flux = [8, 4, 0]}, {time = 2, position = [4, 9, 2], flux = [0, 0, 0]}]\n";
    folder.write("scene.toml", format!("{SCENE}{lamp}"));
    let loaded = folder.load().unwrap_or_else(|e| panic!("{e}"));
    for (time, place, watts) in [
        (-1.0, [0.0, 9.0, 0.0], [8.0, 4.0, 0.0]),
        (0.5, [1.0, 9.0, 0.5], [6.0, 3.0, 0.0]),
        (9.0, [4.0, 9.0, 2.0], [0.0; 3]),
    ] {
        let scene = loaded.animation.at(time);
        let Some(LightKind::Lamp {
            position,
            radius,
            radiant_flux,
        }) = scene.lights.last().map(|light| &light.kind)
        else {
            panic!("the last light is a lamp");
        };
        assert!(position.distance(place.into()) < 1e-12, "{position}");
        assert!(
            radiant_flux.distance(watts.into()) < 1e-12,
            "{radiant_flux}"
        );
        assert_eq!(*radius, 0.1);
    }
}

/// Meshes are shared at all times, not copied: at rest, and as they are placed.
#[test]
fn meshes_are_shared() {
    let folder = Folder::new();
    let moving =
        "mesh = \"part.obj\"\nmotion = { keyframes = [{ time = 1 }, { time = 2, scale = 2 }] }\n";
    folder.write("scene.toml", SCENE.replace("mesh = \"part.obj\"\n", moving));
    let animation = folder.load().unwrap().animation;
    let mesh = |time| {
        let scene = animation.at(time);
        let (mesh, by) = scene.objects[0].geometry.placement().unwrap();
        (mesh.clone(), by)
    };
    let [
        (resting, at_rest),
        (still_resting, still_at_rest),
        (placed, by),
    ] = [0.0, 1.0, 1.5].map(mesh);
    assert!(std::sync::Arc::ptr_eq(&resting, &still_resting));
    assert_eq!([at_rest, still_at_rest], [Similarity::IDENTITY; 2]);
    assert!(std::sync::Arc::ptr_eq(&resting, &placed));
    assert_eq!(by.scale, 1.5);
}

#[test]
fn bad_keyframes() {
    let part = "mesh = \"part.obj\"";
    let motion = |motion: &str| format!("{part}\nmotion = {motion}");
    let keyframes = |list: &str| format!("keyframes = [{list}]");
    for (from, to, reason) in [
        (
            part,
            motion("{ keyframes = [{ time = 1.5 }, { time = 1.0 }] }"),
            "line 34, column 50: object \"part\": the keyframe at 1 s stands after that at 1.5 s",
        ),
        (
            part,
            motion("{ keyframes = [{ time = 1 }, { time = 1 }] }"),
            "at 1 s stands after that at 1 s",
        ),
        (part, motion("{}"), "the key `keyframes` is missing"),
        (part, motion("{ keyframes = [] }"), "there are no keyframes"),
        (
            part,
            motion("{ keyframes = [{ scale = 2 }] }"),
            "the key `time` is missing",
        ),
        (
            part,
            motion("{ keyframes = [{ time = nan }] }"),
            "time: NaN",
        ),
        (
            part,
            motion("{ keyframes = [{ time = 0, scale = 0 }] }"),
            "scale: 0 is not within",
        ),
        (
            part,
            motion("{ keyframes = [{ time = 0, translation = [0, inf, 0] }] }"),
            "translation: inf",
        ),
        (
            part,
            motion("{ keyframes = [{ time = 0, angle_degrees = 3 }] }"),
            "the key `axis` is missing",
        ),
        (
            part,
            motion("{ axis = [0, 0, 0], keyframes = [{ time = 0 }] }"),
            "axis has no length",
        ),
        (
            part,
            motion("{ keyframes = [{ time = 0, position = [0, 0, 0] }] }"),
            "unknown field `position`",
        ),
        (
            "fov_degrees = 40",
            format!(
                "fov_degrees = 40\n{}",
                keyframes("{ time = 0, fov_degrees = 30 }")
            ),
            "camera: the key `fov_degrees` is given beside keyframes that have it",
        ),
        (
            "fov_degrees = 40",
            keyframes("{ time = 0, fov_degrees = 30 }, { time = 1 }"),
            "camera: the key `fov_degrees` is missing",
        ),
        (
            "fov_degrees = 40",
            keyframes("{ time = 0 }"),
            "camera: the key `fov_degrees` is missing",
        ),
        (
            "position = [2, 1.5, 2.5]",
            keyframes("{ time = 0, position = [0, 2, 1] }, { time = 1, position = [0, 2, -3] }"),
            "between 0 s and 1 s it looks straight along the y axis",
        ),
        (
            "direction = [0.0, 3.0, -4.0]",
            keyframes("{ time = 0, direction = [1, 0, 0] }, { time = 1, direction = [-2, 0, 0] }"),
            "its directions at 0 s and 1 s are opposite",
        ),
        (
            "direction = [0.0, 3.0, -4.0]",
            keyframes("{ time = 0, direction = [0, 0, 0] }"),
            "direction has no length",
        ),
        (
            "angular_radius_degrees = 0.2665",
            format!(
                "angular_radius_degrees = 0.2665\n{}",
                keyframes("{ time = 0, scale = 2 }")
            ),
            "the kind `sun` has no key `scale`",
        ),
        (
            "rotation_degrees = 90.0",
            keyframes("{ time = 0, direction = [1, 0, 0] }"),
            "the kind `environment` has no key `direction`",
        ),
        (
            "rotation_degrees = 90.0",
            keyframes("{ time = 0, scale = 1 }, { time = 1, scale = 1e99 }"),
            "light \"sky\": scale: 1000",
        ),
    ] {
        let message = Folder::new().error_after("scene.toml", from, &to);
        assert!(message.starts_with("scene.toml, line "), "{message}");
        assert!(message.contains(reason), "{message}");
    }
}

#[test]
fn bad_animated_meshes() {
    let frames = "frames = { folder = \"rising\" }";
    let with = |change: &dyn Fn(&Folder), to: &str| {
        let folder = Folder::new();
        write_frames(&folder, 3);
        change(&folder);
        folder.error_after("scene.toml", "mesh = \"part.obj\"", to)
    };
    let nothing = |_: &Folder| {};
    for (to, reason) in [
        ("frames = { folder = \"none\" }", "`none` cannot be read"),
        (
            "frames = { folder = \"../rising\" }",
            "leads out of the asset root",
        ),
        (
            "frames = { folder = \"part.obj\" }",
            "`part.obj` cannot be read",
        ),
        (
            "frames = { folder = \".\" , fps = 0 }",
            "fps: 0 is not within",
        ),
        ("frames = { fps = 3 }", "the key `folder` is missing"),
        (
            "mesh = \"part.obj\"\nframes = { folder = \"rising\" }",
            "it has more than one of",
        ),
    ] {
        let message = with(&nothing, to);
        assert!(message.starts_with("scene.toml, line 3"), "{message}");
        assert!(message.contains(reason), "{message}");
    }
    let empty = |folder: &Folder| {
        folder.write("empty/readme.txt", "no mesh");
    };
    let message = with(&empty, "frames = { folder = \"empty\" }");
    assert!(message.contains("`empty` holds no .obj file"), "{message}");
    for (what, obj) in [
        (
            "other order",
            "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nf 2 3 4 1\n",
        ),
        ("a face less", "v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n"),
    ] {
        let other = |folder: &Folder| folder.write("rising/01.obj", obj);
        let message = with(&other, frames);
        let reason = "rising/01.obj: its topology is not that of rising/00.obj";
        assert!(message.contains(reason), "{what}: {message}");
    }
    let damaged = |folder: &Folder| folder.write("rising/02.obj", "v 0 0 nan\nf 1 2 3\n");
    let message = with(&damaged, frames);
    assert!(message.starts_with("rising/02.obj"), "{message}");
    #[cfg(unix)]
    {
        let outside = TempDir::new().unwrap();
        fs::write(outside.path().join("far.obj"), OBJ).unwrap();
        let link = |folder: &Folder| {
            let target = outside.path().join("far.obj");
            std::os::unix::fs::symlink(target, folder.path("rising/03.obj")).unwrap();
        };
        let message = with(&link, frames);
        assert!(message.contains("leads out of the asset root"), "{message}");
    }
}
