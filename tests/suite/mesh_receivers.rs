//! Receivers that are meshes: light maps laid out by texture coordinates or unwrapped, against the
//! reference, at seams, behind thin walls, and what cannot be laid out.

use crate::common::{
    Device, assert_error, assert_error_beyond_noise, assert_physical, brighter, flux_noise,
    footprint, l1, l1_noise, load, mesh_receiver, method, object_mut, options, refuses, scaled,
    solve, texels,
};
use glam::{DMat3, DVec2, DVec3};
use nephroid::image_file::RgbImage;
use nephroid::render::{Method, Renderer};
use nephroid::scene::{
    Geometry, LightKind, Mesh, Object, Rect, Scene, Similarity, Texel, Unwrapping,
};
use std::f64::consts::{PI, SQRT_2, TAU};
use std::fs;
use std::sync::Arc;

const MAP: [u32; 2] = [256, 256];

/// The half cylinder of `corner.toml` under a low sun, and `receiver`.
fn scene(receiver: Object) -> Scene {
    let mut scene = load("corner.toml");
    scene
        .objects
        .retain(|object| object.name == "half_cylinder");
    if let LightKind::Sun { direction, .. } = &mut scene.lights[0].kind {
        *direction = DVec3::new(-0.9, 0.35, 0.1).normalize();
    }
    scene.objects.push(receiver);
    scene
}

/// A diffuse mesh called `receiver`.
fn receiver(mesh: Mesh, own: Vec<[DVec2; 3]>, texels: [u32; 2]) -> Object {
    mesh_receiver("receiver", 1, mesh, own, texels)
}

/// A grid of quads and its texture coordinates, within a margin.
fn grid(cells: [u32; 2], point: impl Fn(f64, f64) -> (DVec3, DVec3)) -> (Mesh, Vec<[DVec2; 3]>) {
    const MARGIN: f64 = 0.01;
    let [columns, rows] = cells;
    let (mut mesh, mut uvs, mut corners) = (Mesh::default(), Vec::new(), Vec::new());
    for j in 0..=rows {
        for i in 0..=columns {
            let uv = DVec2::new(
                f64::from(i) / f64::from(columns),
                f64::from(j) / f64::from(rows),
            );
            let (position, normal) = point(uv.x, uv.y);
            mesh.positions.push(position);
            mesh.normals.push(normal);
            uvs.push(DVec2::splat(MARGIN) + (1.0 - 2.0 * MARGIN) * uv);
        }
    }
    for j in 0..rows {
        for i in 0..columns {
            let a = j * (columns + 1) + i;
            let [b, c, d] = [a + 1, a + columns + 2, a + columns + 1];
            for triangle in [[a, b, c], [a, c, d]] {
                let [p, q, r] = triangle.map(|corner| mesh.positions[corner as usize]);
                if (q - p).cross(r - p).length() > 1e-12 {
                    mesh.triangles.push(triangle);
                    corners.push(triangle.map(|corner| uvs[corner as usize]));
                }
            }
        }
    }
    (mesh, corners)
}

/// With the sun half a degree further.
fn turned(scene: &Scene) -> Scene {
    let mut scene = scene.clone();
    if let LightKind::Sun { direction, .. } = &mut scene.lights[0].kind {
        *direction = DMat3::from_rotation_y(0.01) * *direction;
    }
    scene
}

const MIDDLE: DVec3 = DVec3::new(0.45, 0.2, 0.0);
const RADIUS: f64 = 0.2;

/// A globe of 9800 triangles, of which the seam looks at the mirror.
fn globe() -> (Mesh, Vec<[DVec2; 3]>) {
    grid([100, 50], |u, v| {
        // Whole turns are exactly one place.
        let (longitude, latitude) = (TAU * (u % 1.0), PI * (v - 0.5));
        let normal = DVec3::new(
            latitude.cos() * longitude.cos(),
            latitude.sin(),
            -latitude.cos() * longitude.sin(),
        );
        (MIDDLE + RADIUS * normal, normal)
    })
}

/// A sheet of 10 368 triangles with bumps and dents, in the light of the mirror.
fn sheet() -> Mesh {
    let at = |u: f64, v: f64| {
        let (y, z) = (0.4 * v, 0.8 * (0.5 - u));
        let x = 0.45 + 0.03 * (15.0 * z + 2.0).sin() * (11.0 * y).cos() + 0.2 * z * z;
        DVec3::new(x, y, z)
    };
    let (mesh, _) = grid([72, 72], |u, v| {
        const STEP: f64 = 1e-5;
        let along_u = at(u + STEP, v) - at(u - STEP, v);
        let along_v = at(u, v + STEP) - at(u, v - STEP);
        (at(u, v), along_u.cross(along_v).normalize())
    });
    mesh
}

/// W, in red.
fn flux(map: &RgbImage, texels: &[Texel]) -> f64 {
    (map.pixels.iter().zip(texels))
        .map(|(rgb, texel)| f64::from(rgb[0]) * texel.area)
        .sum()
}

/// L1 over texels, though not all have the same area, and flux.
#[test]
fn caustics_on_meshes_are_those_of_the_reference() {
    let device = Device::open();
    let (globe, own) = globe();
    let size = [128, 128];
    for (what, object) in [
        ("globe, unwrapped", receiver(globe.clone(), vec![], size)),
        ("globe, its own coordinates", receiver(globe, own, size)),
        ("sheet, unwrapped", receiver(sheet(), vec![], size)),
    ] {
        let scene = scene(object);
        let reference = solve(&scene, "receiver", size, &options(0.01));
        let truth = reference.image();
        let map = device.caustic(&scene, "receiver", &footprint(16_384));
        assert_physical(&map);
        let perturbed = device.caustic(&turned(&scene), "receiver", &footprint(16_384));
        assert_error_beyond_noise(
            &format!("{what}, L1"),
            0.04,
            l1_noise(&reference),
            l1(&map, &truth),
            l1(&perturbed, &truth),
        );

        let (_, texels) = texels(&scene, "receiver");
        let exact = flux(&truth, &texels);
        let energy = |map| (flux(map, &texels) / exact - 1.0).abs();
        let noise = flux_noise(&reference, texels.iter().map(|texel| texel.area))[0] / exact;
        assert_error_beyond_noise(
            &format!("{what}, energy"),
            0.005,
            noise,
            energy(&map),
            energy(&scaled(&map, 1.01)),
        );
    }
}

/// Two windows, mirrored on a globe.
#[test]
fn an_environment_lights_meshes() {
    let device = Device::open();
    let map = [64, 64];
    let mut scene = scene(receiver(globe().0, vec![], map));
    scene.lights = load("table.toml").lights;
    let truth = solve(&scene, "receiver", map, &options(0.02)).image();
    let caustic = |scene: &Scene, samples| device.caustic(scene, "receiver", &footprint(samples));
    let found = caustic(&scene, 16_384);
    assert_physical(&found);
    let (_, texels) = texels(&scene, "receiver");
    let exact = flux(&truth, &texels);
    let energy = |map: &RgbImage| (flux(map, &texels) / exact - 1.0).abs();
    let bright = energy(&scaled(&found, 1.05));
    assert_error("energy", 0.02, energy(&found), bright);
    let mut turned = scene.clone();
    if let LightKind::Environment { rotation, .. } = &mut turned.lights[0].kind {
        *rotation += 0.1;
    }
    let l1_of = |scene, samples| l1(&caustic(scene, samples), &truth);
    let (coarse, fine) = (l1_of(&scene, 4096), l1_of(&scene, 65_536));
    assert_error("L1", 0.08, fine, l1_of(&turned, 65_536));
    assert!(fine < 0.7 * coarse, "{fine} of {coarse}");
}

/// The other methods bring the same flux.
#[test]
fn points_and_pinhole_light_meshes_too() {
    let device = Device::open();
    // A sun wide enough that nothing is finer than a texel, as the gather looks at single points.
    let scene = crate::common::with_sun_of(scene(receiver(globe().0, vec![], [64, 64])), 2.5);
    let (_, texels) = texels(&scene, "receiver");
    let reference = solve(&scene, "receiver", [64, 64], &options(0.01));
    let truth = reference.image();
    let exact = flux(&truth, &texels);
    for (method_, samples, bound) in [
        (Method::Points, 800_000, 0.01),
        (Method::Pinhole, 4096, 0.02),
    ] {
        let settings = method(method_, samples);
        let map = device.caustic(&scene, "receiver", &settings);
        let error = |map: &RgbImage| (flux(map, &texels) / exact - 1.0).abs();
        assert_error(
            &format!("{method_:?}, energy"),
            bound,
            error(&map),
            error(&scaled(&map, 1.05)),
        );
        if method_ == Method::Points {
            let turned = device.caustic(&turned(&scene), "receiver", &settings);
            // The points have their own noise, about as large as the reference's.
            let noise = SQRT_2 * l1_noise(&reference);
            let (error, perturbed) = (l1(&map, &truth), l1(&turned, &truth));
            assert_error_beyond_noise("Points, L1", 0.04, noise, error, perturbed);
        }
    }
    let error = Renderer::new(&device.0, &scene, &method(Method::Beams, 64))
        .err()
        .expect("beams light rects only");
    let message = error.to_string();
    assert!(
        message.contains("`receiver` is a mesh") && message.contains("another method"),
        "{message}"
    );
}

/// A square as a mesh receives what the rect does, by every method and by the reference, of which
/// gathering is only used under a sky.
#[test]
fn a_flat_mesh_receives_what_a_rect_does() {
    let device = Device::open();
    for (file, name) in [("mirror.toml", "floor"), ("ball.toml", "floor")] {
        let mut flat = load(file);
        // On a mesh every footprint is a kernel, on a rect those of lights that are wide.
        if let LightKind::Sun { angular_radius, .. } = &mut flat.lights[0].kind {
            *angular_radius = 3f64.to_radians();
        }
        let texels = [24, 16];
        object_mut(&mut flat, name).light_map = Some(texels);
        let mut as_mesh = flat.clone();
        let object = object_mut(&mut as_mesh, name);
        let Geometry::Rect(rect) = object.geometry else {
            panic!("{name} is a rect");
        };
        let [a, b, c, d] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(DVec2::from);
        object.geometry = Geometry::Mesh(Arc::new(rect.to_mesh()));
        object.unwrapping = Some(Arc::new(Unwrapping {
            rest: Arc::new(rect.to_mesh()),
            own: vec![[a, b, c], [a, c, d]],
        }));
        let same = |what: &str, bound: f64, map: &dyn Fn(&Scene) -> RgbImage| {
            let (expected, found) = (map(&flat), map(&as_mesh));
            let shifted = map(&crate::common::shifted_by_a_texel(flat.clone(), name));
            let (error, perturbed) = (l1(&found, &expected), l1(&shifted, &expected));
            assert_error(&format!("{file}, {what}"), bound, error, perturbed);
        };
        same("reference", 0.01, &|scene| {
            solve(scene, name, texels, &options(0.005)).image()
        });
        if file == "mirror.toml" {
            same("direct", 0.005, &|scene| device.direct(scene, name));
        } else {
            // Rays go to different cells of the sky: against the view factor of the ball, the rect has 0.9 % and the mesh 1.5 %.
            let [expected, found] = [&flat, &as_mesh].map(|scene| device.direct(scene, name));
            let moved = crate::common::moved(flat.clone(), "ball", 0.0, 0.5 * DVec3::X);
            let moved = device.direct(&moved, name);
            let (error, perturbed) = (l1(&found, &expected), l1(&moved, &expected));
            assert_error(&format!("{file}, direct"), 0.02, error, perturbed);
            let settings = method(Method::Pinhole, 2048);
            same("pinhole", 0.002, &|scene| {
                device.caustic(scene, name, &settings)
            });
            continue;
        }
        for (method_, samples, bound) in [
            // Kernels of even patches on the mesh, triangles on the rect.
            (Method::Footprint, 4096, 0.02),
            (Method::Pinhole, 2048, 0.002),
            (Method::Points, 200_000, 0.002),
        ] {
            let settings = method(method_, samples);
            same(&format!("{method_:?}"), bound, &|scene| {
                device.caustic(scene, name, &settings)
            });
        }
    }
}

/// The step of irradiance over the seam is no larger than those beside it.
#[test]
fn no_seam_shows() {
    let device = Device::open();
    let (mesh, own) = globe();
    let scene = scene(receiver(mesh, own, MAP));
    let map = device.caustic(&scene, "receiver", &footprint(16_384));
    let (atlas, texels) = texels(&scene, "receiver");
    let [width, height] = atlas.size().map(|side| side as usize);
    let in_chart = |texel: usize| !atlas.pieces(texel).is_empty();
    let value = |texel: usize| f64::from(map.pixels[texel][0]);
    // Irradiance over the distance of the texels' centroids.
    let slope = |a: usize, b: usize| {
        (value(a) - value(b)).abs() / texels[a].position.distance(texels[b].position)
    };
    let (mut over, mut beside, mut rows) = (0.0, 0.0, 0);
    for row in 0..height {
        let columns: Vec<usize> = (row * width..(row + 1) * width)
            .filter(|&t| in_chart(t))
            .collect();
        let [Some(&first), Some(&last)] = [columns.first(), columns.last()] else {
            continue;
        };
        if value(first) < 0.5 {
            continue;
        }
        over += slope(first, last);
        let next = [(1, 2), (2, 3)].map(|(i, j)| slope(columns[i], columns[j]));
        let before = [(1, 2), (2, 3)].map(|(i, j)| {
            let end = columns.len() - 1;
            slope(columns[end - i], columns[end - j])
        });
        beside += next.into_iter().chain(before).sum::<f64>() / 4.0;
        rows += 1;
    }
    assert!(rows > 30, "{rows} rows of the seam are lit");
    // A tenth less light on one side would show.
    let mut dimmer = 0.0;
    for row in 0..height {
        let columns: Vec<usize> = (row * width..(row + 1) * width)
            .filter(|&t| in_chart(t))
            .collect();
        if let [Some(&first), Some(&last)] = [columns.first(), columns.last()]
            && value(first) >= 0.5
        {
            let distance = texels[first].position.distance(texels[last].position);
            dimmer += (0.9 * value(first) - value(last)).abs() / distance;
        }
    }
    assert_error(
        "step over the seam to those beside it",
        1.5,
        over / beside,
        dimmer / beside,
    );
}

/// A box of `thickness` m along x.
fn wall(x: f64, thickness: f64) -> Mesh {
    let mut mesh = Mesh::default();
    let (low, high) = (
        DVec3::new(x, 0.01, -0.4),
        DVec3::new(x + thickness, 0.45, 0.4),
    );
    let size = high - low;
    let [ex, ey, ez] = [size.x * DVec3::X, size.y * DVec3::Y, size.z * DVec3::Z];
    for (origin, edge_u, edge_v) in [
        (low + ex, -ez, ey),
        (low, ez, ey),
        (low + ey, ez, ex),
        (low, ex, ez),
        (low, ey, ex),
        (low + ez, ex, ey),
    ] {
        // The first one starts at the other end.
        let origin = if edge_u.z < 0.0 { origin + ez } else { origin };
        let face = Rect {
            origin,
            edge_u,
            edge_v,
        }
        .to_mesh();
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(face.positions);
        mesh.normals.extend(face.normals);
        let corners = face.triangles.iter();
        mesh.triangles
            .extend(corners.map(|t| t.map(|corner| corner + first)));
    }
    mesh
}

/// Nothing shines through a wall of 1 mm, neither onto its far side nor onto a screen behind it, with
/// footprints as wide as a hundred walls, too.
#[test]
fn no_light_leaks_through_a_thin_wall() {
    let device = Device::open();
    let x = 0.45;
    let mut scene = scene(receiver(wall(x, 1e-3), vec![], MAP));
    let screen = Rect {
        origin: DVec3::new(x - 0.02, 0.05, 0.3),
        edge_u: -0.6 * DVec3::Z,
        edge_v: 0.3 * DVec3::Y,
    };
    assert!(screen.normal().distance(DVec3::X) < 1e-12);
    scene.objects.push(Object {
        name: "screen".into(),
        ..receiver(screen.to_mesh(), vec![], [64, 64])
    });
    let ((_, of_wall), (_, of_screen)) = (texels(&scene, "receiver"), texels(&scene, "screen"));
    for samples in [1, 4096, 16_384] {
        let maps = device.caustics(&scene, &["receiver", "screen"], &footprint(samples));
        let side = |sign: f64| -> f64 {
            (maps[0].pixels.iter().zip(&of_wall))
                .filter(|(_, texel)| sign * texel.normal.x > 0.5)
                .map(|(rgb, texel)| f64::from(rgb[0]) * texel.area)
                .sum()
        };
        let near = side(1.0);
        assert!(near > 0.01, "{near} W");
        for (what, far) in [
            ("far side", side(-1.0)),
            ("screen", flux(&maps[1], &of_screen)),
        ] {
            println!(
                "{samples} samples, {what}: {:e} of the near side",
                far / near
            );
            assert!(
                far <= 0.001 * near,
                "{samples} samples, {what}: {far} of {near}"
            );
        }
    }
    // Without the wall, the screen is lit.
    let open = Scene {
        objects: (scene.objects.iter())
            .filter(|object| object.name != "receiver")
            .cloned()
            .collect(),
        ..scene
    };
    let map = device.caustic(&open, "screen", &footprint(4096));
    assert!(flux(&map, &of_screen) > 0.01);
}

/// A sun brings a sphere π R² E☉.
#[test]
fn direct_light_on_a_globe() {
    let device = Device::open();
    let mut scene = scene(receiver(globe().0, vec![], MAP));
    scene.objects.remove(0);
    let (_, texels) = texels(&scene, "receiver");
    let exact = PI * RADIUS * RADIUS;
    let error = |map: &RgbImage| (flux(map, &texels) / exact - 1.0).abs();
    let map = device.direct(&scene, "receiver");
    let bright = device.direct(&brighter(scene, 1.02), "receiver");
    assert_error(
        "direct flux on a sphere",
        0.005,
        error(&map),
        error(&bright),
    );
}

/// What moves keeps its layout, and gets the same bits as a new renderer.
#[test]
fn a_mesh_that_moves_takes_its_light_map_along() {
    let device = Device::open();
    let before = scene(receiver(globe().0, vec![], [128, 128]));
    let mut after = before.clone();
    let by = Similarity {
        scale: 0.9,
        rotation: DMat3::from_rotation_y(0.3),
        shift: DVec3::new(0.02, 0.0, 0.15),
    };
    let object = object_mut(&mut after, "receiver");
    object.geometry = object.geometry.moved(&by);
    for method_ in [Method::Footprint, Method::Points] {
        let settings = method(method_, 4096);
        let mut renderer = device.renderer(&before, &settings);
        let map = |renderer: &mut Renderer| {
            renderer.caustic().unwrap();
            renderer.read_caustic(1).unwrap()
        };
        let first = map(&mut renderer);
        renderer.update(&after).unwrap();
        let moved = map(&mut renderer);
        assert!(moved.pixels != first.pixels);
        if method_ == Method::Footprint {
            // The origin is that of the first scene, so a new renderer rounds otherwise; points fall elsewhere.
            let new = device.caustic(&after, "receiver", &settings);
            assert_error("a moved mesh, L1", 1e-3, l1(&moved, &new), l1(&first, &new));
        }
        renderer.update(&before).unwrap();
        assert!(map(&mut renderer).pixels == first.pixels, "{method_:?}");
    }
}

/// A scene file with a square mesh, of these texture coordinates, on the ground under a mirror.
fn folder(texture: &str, faces: &str, lightmap: &str) -> tempfile::TempDir {
    let folder = tempfile::TempDir::new().unwrap();
    let mesh = format!("v 0 0 0\nv 1 0 0\nv 1 0 -1\nv 0 0 -1\n{texture}{faces}");
    fs::write(folder.path().join("square.obj"), mesh).unwrap();
    let scene = format!(
        "version = 1
[camera]
position = [2, 1.5, 2.5]
target = [0.0, 0.0, 0.0]
fov_degrees = 40
[[light]]
name = \"sun\"
kind = \"sun\"
direction = [0.0, 1.0, 0.0]
irradiance = [1.0, 1.0, 1.0]
angular_radius_degrees = 0.3
[[material]]
name = \"steel\"
kind = \"mirror\"
reflectance = [0.9, 0.9, 0.9]
[[material]]
name = \"plaster\"
kind = \"diffuse\"
albedo = [0.5, 0.5, 0.5]
[[object]]
name = \"mirror\"
rect = {{ origin = [0.2, 0.5, -1.2], edge_u = [0.6, 0.0, 0.0], edge_v = [0.0, 0.5, -0.5] }}
material = \"steel\"
[[object]]
name = \"tile\"
mesh = \"square.obj\"
material = \"plaster\"
lightmap = {lightmap}
"
    );
    fs::write(folder.path().join("scene.toml"), scene).unwrap();
    folder
}

const SQUARE: &str = "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n";

#[test]
fn texture_coordinates_that_cannot_be_used_are_named_and_replaced() {
    let own = "f 1/1 2/2 3/3\nf 1/1 3/3 4/4\n";
    for (what, texture, faces, reason) in [
        ("good", SQUARE, own, ""),
        ("none", "", "f 1 2 3\nf 1 3 4\n", ""),
        (
            "outside",
            "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 2\n",
            own,
            "triangle 2 of 2 lies outside of 0 to 1",
        ),
        (
            "not all",
            SQUARE,
            "f 1/1 2/2 3/3\nf 1 3 4\n",
            "triangle 2 of 2 lies outside of 0 to 1",
        ),
        (
            "no number",
            "vt x 0\nvt 1 0\nvt 1 1\nvt 0 1\n",
            own,
            "triangle 1 of 2 lies outside",
        ),
        (
            "no such",
            SQUARE,
            "f 1/1 2/2 3/9\nf 1/1 3/3 4/4\n",
            "triangle 1 of 2 lies outside",
        ),
        (
            "degenerate",
            SQUARE,
            "f 1/1 2/2 3/3\nf 1/1 3/1 4/1\n",
            "triangle 2 of 2 has no area",
        ),
        (
            "folded",
            SQUARE,
            "f 1/1 2/2 3/3\nf 1/1 3/3 4/2\n",
            "triangle 2 of 2 is turned over",
        ),
        (
            "upon each other",
            "vt 0 0\nvt 1 0\nvt 1 1\nvt 0.1 0\nvt 1 0.1\nvt 1 0.9\n",
            "f 1/1 2/2 3/3\nf 1/4 3/5 4/6\n",
            "triangle 2 of 2 shares a texel with another chart",
        ),
    ] {
        let folder = folder(texture, faces, "[32, 32]");
        let loaded = nephroid::scene::load(&folder.path().join("scene.toml")).unwrap();
        match reason {
            "" => assert!(loaded.warnings.is_empty(), "{what}: {:?}", loaded.warnings),
            reason => {
                let [warning] = loaded.warnings.as_slice() else {
                    panic!("{what}: {:?}", loaded.warnings);
                };
                assert!(warning.contains("object `tile`"), "{what}: {warning}");
                assert!(warning.contains(reason), "{what}: {warning}");
            }
        }
        // All of the square is on the map in any case.
        let (_, texels) = texels(&loaded.scene, "tile");
        let area: f64 = texels.iter().map(|texel| texel.area).sum();
        assert!((area - 1.0).abs() < 0.01, "{what}: {area} m²");
    }
}

#[test]
fn light_maps_that_cannot_be_are_refused() {
    let small = folder("", "f 1 2 3 4\n", "[4, 4]");
    let mut command = crate::common::nephroid();
    command.arg("bake").arg(small.path().join("scene.toml"));
    command.args(["-o", "out.exr"]);
    refuses(
        &mut command,
        3,
        &["object \"tile\"", "4×4 texels is too small", "[8, 8]"],
    );
    // By the command line's size.
    let enough = folder("", "f 1 2 3 4\n", "[32, 32]");
    for command_name in ["bake", "reference"] {
        let mut command = crate::common::nephroid();
        command
            .arg(command_name)
            .arg(enough.path().join("scene.toml"));
        command
            .args(["--lightmap", "4", "-o"])
            .arg(enough.path().join("out.exr"));
        if command_name == "reference" {
            command.arg("--no-cache");
        }
        refuses(&mut command, 2, &["object `tile`", "too small", "remedy"]);
    }
}
