//! Albedo maps: from files to what the views of the renderer and of the reference show.

use crate::common::folder::{Folder, SCENE};
use crate::common::{Device, assert_error, footprint, options, see};
use glam::{DVec2, DVec3};
use nephroid::image_file::RgbImage;
use nephroid::scene::{Geometry, LightKind, MaterialKind, Scene, Texture};
use std::f64::consts::PI;
use std::sync::Arc;

/// Red, green over blue, white; rows from the top.
const TEXELS: [[u8; 3]; 4] = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]];

/// Scale, texture coordinates on the floor, and the linear colour there: at the middles of texels, and between them.
const PLACES: [([f64; 2], [f64; 2], [f64; 3]); 7] = [
    ([1.0, 1.0], [0.25, 0.75], [1.0, 0.0, 0.0]),
    ([1.0, 1.0], [0.75, 0.75], [0.0, 1.0, 0.0]),
    ([1.0, 1.0], [0.25, 0.25], [0.0, 0.0, 1.0]),
    ([1.0, 1.0], [0.75, 0.25], [1.0, 1.0, 1.0]),
    ([1.0, 1.0], [0.5, 0.75], [0.5, 0.5, 0.0]),
    ([2.0, 1.0], [0.625, 0.75], [1.0, 0.0, 0.0]),
    ([-1.0, 4.0], [0.25, 0.8125], [1.0, 1.0, 1.0]),
];

fn png(width: u32, height: u32, texels: &[[u8; 3]]) -> Vec<u8> {
    let buffer = image::RgbImage::from_raw(width, height, texels.as_flattened().to_vec()).unwrap();
    let mut content = std::io::Cursor::new(Vec::new());
    buffer
        .write_to(&mut content, image::ImageFormat::Png)
        .unwrap();
    content.into_inner()
}

/// [`SCENE`] with a map on the floor.
fn folder() -> Folder {
    let folder = Folder::new();
    folder.write("wood.png", png(2, 2, &TEXELS));
    let map = "albedo = [0.5, 0.5, 0.5]\nalbedo_map = \"wood.png\"";
    folder.write("scene.toml", SCENE.replace("albedo = [0.5, 0.5, 0.5]", map));
    folder
}

#[test]
fn maps_are_read_once_and_scaled() {
    let folder = folder();
    let loaded = folder.load().unwrap();
    let map = loaded.scene.materials[1].albedo_map.unwrap();
    assert_eq!((map.texture, map.uv_scale), (0, DVec2::ONE));
    let level = &loaded.scene.textures[0].levels[0];
    assert_eq!(level.texels[2], [0, 0, 255, 255]);
    assert!(loaded.warnings.is_empty(), "{:?}", loaded.warnings);

    // Two materials share the image; without `albedo` it is white.
    let more = "\n[[material]]\nname = \"more\"\nkind = \"diffuse\"\nalbedo_map = \"wood.png\"\nuv_scale = [2, -3.5]\n";
    let text = std::fs::read_to_string(folder.path("scene.toml")).unwrap() + more;
    folder.write("scene.toml", text);
    let scene = folder.load().unwrap().scene;
    assert_eq!(scene.textures.len(), 1);
    assert_eq!(
        scene.materials[2].albedo_map.unwrap().uv_scale,
        DVec2::new(2.0, -3.5)
    );
    let white = MaterialKind::Diffuse { albedo: DVec3::ONE };
    assert_eq!(scene.materials[2].kind, white);
    // Of the rect: along its edges, in the order of its triangles.
    let uvs = scene.objects[1].texture_coordinates().unwrap();
    let mesh = scene.objects[1].geometry.mesh();
    let Geometry::Rect(rect) = &scene.objects[1].geometry else {
        panic!();
    };
    for (triangle, uvs) in uvs.iter().enumerate() {
        for (corner, uv) in mesh.corners(triangle).iter().zip(uvs) {
            let expected = rect.origin + uv.x * rect.edge_u + uv.y * rect.edge_v;
            assert!(corner.distance(expected) < 1e-12);
        }
    }
}

#[test]
fn bad_maps_are_refused_with_place_and_remedy() {
    let refused = |from: &str, to: &str, parts: &[&str]| {
        let message = folder().error_after("scene.toml", from, to);
        for part in parts {
            assert!(message.contains(part), "{message}");
        }
    };
    let key = "albedo_map = \"wood.png\"";
    refused(
        key,
        "albedo_map = \"none.png\"",
        &["scene.toml, line", "`none.png` cannot be read"],
    );
    refused(
        key,
        "albedo_map = \"../wood.png\"",
        &["leads out of the asset root"],
    );
    refused(
        key,
        "albedo_map = \"sky.hdr\"",
        &["sky.hdr: it is neither a PNG nor a JPEG"],
    );
    refused(
        key,
        "uv_scale = [1, 1]",
        &["`uv_scale` is given without an `albedo_map`"],
    );
    for bad in ["nan", "1e7"] {
        let scale = format!("{key}\nuv_scale = [1, {bad}]");
        refused(
            key,
            &scale,
            &["material \"plaster\": uv_scale: ", "is not within"],
        );
    }
    let on_a_mirror = "reflectance = [0.9, 0.9, 0.9]\nalbedo_map = \"wood.png\"";
    let parts = ["the kind `mirror` has no key `albedo_map`"];
    refused("reflectance = [0.9, 0.9, 0.9]", on_a_mirror, &parts);

    let broken = folder();
    let whole = png(2, 2, &TEXELS);
    broken.write("wood.png", &whole[..50]);
    assert!(broken.error().contains("wood.png: cannot be decoded"));
    broken.write("wood.png", "");
    assert!(broken.error().contains("wood.png: it is neither"));
}

const WITH_UVS: &str = "mtllib part.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvn 0 0 1\n\
    vt 0 0\nvt 2 0\nvt 2 1\nvt 0 1\nusemtl chalk\nf 1/1/1 2/2/1 3/3/1 4/4/1\n";

/// The part is diffuse with the floor's material.
fn diffuse_part(obj: &str) -> Folder {
    let folder = folder();
    let text = std::fs::read_to_string(folder.path("scene.toml")).unwrap();
    folder.write(
        "scene.toml",
        text.replace("material = \"steel\"", "material = \"plaster\""),
    );
    folder.write("part.obj", obj);
    folder
}

#[test]
fn meshes_need_texture_coordinates_for_a_map() {
    let scene = diffuse_part(WITH_UVS).load().unwrap().scene;
    let uvs = scene.objects[0].texture_coordinates().unwrap();
    assert_eq!(
        uvs[0],
        [[0.0, 0.0], [2.0, 0.0], [2.0, 1.0]].map(DVec2::from)
    );

    let without = WITH_UVS.replace("1/1/1 2/2/1 3/3/1 4/4/1", "1//1 2//1 3//1 4//1");
    let message = diffuse_part(&without).error();
    let expected = "object \"part\": the mesh has no texture coordinates (vt), which the `albedo_map` of material `plaster` needs";
    assert!(
        message.contains("scene.toml, line") && message.contains(expected),
        "{message}"
    );
    for bad in ["vt nan 1", "vt 0", "vt inf 0", "vt 1e9 0"] {
        let message = diffuse_part(&WITH_UVS.replace("vt 2 1", bad)).error();
        assert!(
            message.contains("corners have no texture coordinates"),
            "{bad}: {message}"
        );
    }
    // One corner of four, of two of six corners of triangles.
    let some = WITH_UVS.replace("3/3/1", "3//1");
    let message = diffuse_part(&some).error();
    assert!(message.contains("2 of 6 corners"), "{message}");
    // Without a map they do not matter.
    let folder = Folder::new();
    folder.write("part.obj", &without);
    assert!(folder.load().unwrap().scene.objects[0].uvs.is_none());
}

/// The part has its materials by the MTL file.
fn mtl_part(obj: &str, mtl: &str) -> Folder {
    let folder = Folder::new();
    folder.write("wood.png", png(2, 2, &TEXELS));
    folder.write("my wood.png", png(2, 2, &TEXELS));
    folder.write(
        "scene.toml",
        SCENE.replace(
            "mesh = \"part.obj\"\nmaterial = \"steel\"",
            "mesh = \"part.obj\"",
        ),
    );
    folder.write("part.obj", obj);
    folder.write("part.mtl", mtl);
    folder
}

#[test]
fn maps_of_mtl_files() {
    for (statement, scale) in [
        ("map_Kd wood.png", [1.0, 1.0]),
        ("map_Kd my wood.png", [1.0, 1.0]),
        ("map_Kd -s 2 3 1 wood.png", [2.0, 3.0]),
        ("map_Kd -blendu on -s 4 wood.png", [4.0, 1.0]),
        ("map_Kd -texres 512 .\\wood.png", [1.0, 1.0]),
    ] {
        let mtl = format!("newmtl chalk\nKd 0.5 0.4 0.3\n{statement}\n");
        let loaded = mtl_part(WITH_UVS, &mtl).load().unwrap();
        let material = loaded.scene.materials.last().unwrap();
        assert_eq!(material.name, "part/chalk");
        let map = material
            .albedo_map
            .unwrap_or_else(|| panic!("{statement}: {:?}", loaded.warnings));
        assert_eq!(map.uv_scale, DVec2::from(scale), "{statement}");
        assert!(loaded.scene.objects[0].uvs.is_some());
    }
    // A map alone is not darkened.
    let loaded = mtl_part(WITH_UVS, "newmtl chalk\nmap_Kd wood.png\n")
        .load()
        .unwrap();
    let kind = &loaded.scene.materials.last().unwrap().kind;
    assert_eq!(*kind, MaterialKind::Diffuse { albedo: DVec3::ONE });

    // What cannot be used is left out with a warning, as it was before maps were read.
    let no_uvs = WITH_UVS.replace("1/1/1 2/2/1 3/3/1 4/4/1", "1//1 2//1 3//1 4//1");
    for (obj, statement, reason) in [
        (
            WITH_UVS,
            "map_Kd none.png",
            "part.mtl: line 3: `none.png` cannot be read",
        ),
        (WITH_UVS, "map_Kd", "`map_Kd` names no file"),
        (
            WITH_UVS,
            "map_Kd -clamp on wood.png",
            "the option `-clamp` of `map_Kd` is not supported",
        ),
        (WITH_UVS, "map_Kd -s nan wood.png", "`-s` is"),
        (WITH_UVS, "map_Kd sky.hdr", "neither a PNG nor a JPEG"),
        (WITH_UVS, "map_Ks wood.png", "`map_Ks` is not supported"),
        (
            no_uvs.as_str(),
            "map_Kd wood.png",
            "the mesh has no texture coordinates (vt)",
        ),
    ] {
        let mtl = format!("newmtl chalk\nKd 0.5 0.4 0.3\n{statement}\n");
        let loaded = mtl_part(obj, &mtl).load().unwrap();
        let all = loaded.warnings.join("\n");
        assert!(
            all.contains(reason) && all.contains("left out"),
            "{statement}: {all}"
        );
        assert!(loaded.scene.materials.last().unwrap().albedo_map.is_none());
    }
}

/// Radiance of the floor at (u, v) under a sun that is a point, albedo/π E cosθ.
#[test]
fn the_view_shows_the_colours_where_they_belong() {
    let folder = folder();
    let mut scene = folder.load().unwrap().scene;
    scene.lights.truncate(1);
    if let LightKind::Sun { angular_radius, .. } = &mut scene.lights[0].kind {
        *angular_radius = 0.0;
    }
    scene.objects.remove(0);
    let lit = 0.5 / PI * 0.6;
    for (scale, uv, colour) in PLACES {
        scene.materials[1].albedo_map.as_mut().unwrap().uv_scale = DVec2::from(scale);
        let [u, v] = uv;
        scene.camera.target = DVec3::new(-1.0 + 2.0 * u, 0.0, 1.0 - 2.0 * v);
        scene.camera.position = scene.camera.target + DVec3::new(0.2, 1.0, 0.3);
        scene.camera.fov = 1e-6;
        for found in see(&scene, [3, 2], &options(0.5)).radiance {
            let error = DVec3::from(found).distance(lit * DVec3::from(colour));
            assert!(error < 1e-5 * lit, "{scale:?} {uv:?}: {found:?}");
        }
    }
}

/// Light by way of a mirror is coloured like direct light.
#[test]
fn caustics_are_coloured_too() {
    let folder = folder();
    // A ceiling that reflects a sun from below onto the floor.
    let text = std::fs::read_to_string(folder.path("scene.toml")).unwrap()
        + "\n[[object]]\nname = \"ceiling\"\nmaterial = \"steel\"\nblocks_light = false\n\
           rect = { origin = [-0.7, 2.0, -3.367], edge_u = [0.4, 0.0, 0.0], edge_v = [0.0, 0.0, 0.4] }\n";
    // Its front looks down where edge_u × edge_v does.
    let text = text.replace(
        "direction = [0.0, 3.0, -4.0]",
        "direction = [0.0, -3.0, -4.0]",
    );
    folder.write("scene.toml", text);
    let mut scene = folder.load().unwrap().scene;
    scene.lights.truncate(1);
    scene.objects.remove(0);
    scene.objects[0].blocks_light = false;
    scene.camera.position = DVec3::new(-0.5, 1.0, -0.4);
    scene.camera.target = DVec3::new(-0.5, 0.0, -0.5);
    scene.camera.fov = 0.08;
    let seen = see(&scene, [6, 4], &options(0.05));
    // In the upper left of the floor: u, v = 0.25, 0.75: red.
    let red = 0.5 / PI * 0.9 * 0.6;
    let n = seen.radiance.len() as f64;
    let mean = seen.radiance.iter().map(|rgb| rgb[0]).sum::<f64>() / n;
    let variance: f64 = seen.standard_error.iter().map(|rgb| rgb[0].powi(2)).sum();
    let sigma = variance.sqrt() / n;
    // Texels are 1 m wide, and red falls off linearly from the middle of this one: its mean loss within ±h is
    // h/2.
    let half_height = (0.5 * scene.camera.fov).tan() * 1.005;
    let fall = |half: f64| 1.0 - 0.5 * half;
    let exact = red * fall(half_height) * fall(1.5 * half_height);
    assert!(
        (mean - exact).abs() < 4.0 * sigma + 0.001 * exact,
        "{mean} {exact} {sigma}"
    );
    assert!((mean - 1.02 * exact).abs() > 4.0 * sigma + 0.001 * exact);
    assert!(
        seen.radiance
            .iter()
            .all(|rgb| rgb[1] < 0.1 * red && rgb[2] < 0.1 * red)
    );
}

/// The middle pixel of the renderer's view.
fn drawn(device: &Device, scene: &Scene) -> DVec3 {
    let size = [5, 3];
    let mut renderer = device.renderer(scene, &footprint(64));
    renderer.view(&scene.camera, size, 1).unwrap();
    let RgbImage { pixels, .. } = renderer.read_view().unwrap();
    DVec3::from(pixels[7].map(f64::from))
}

/// `scene` without its environment and without shadows, under a sun whose light arrives at every point of the floor alike.
/// It lights the back of the mirror, which is black.
fn under_a_point_of_a_sun(mut scene: Scene) -> Scene {
    scene.lights.truncate(1);
    scene.objects[0].blocks_light = false;
    if let LightKind::Sun { angular_radius, .. } = &mut scene.lights[0].kind {
        *angular_radius = 0.0;
    }
    scene
}

fn look_at(scene: &mut Scene, target: DVec3, offset: DVec3, fov: f64) {
    scene.camera.target = target;
    scene.camera.position = target + offset;
    scene.camera.fov = fov;
}

fn relative(found: DVec3, exact: DVec3) -> f64 {
    found.distance(exact) / exact.length()
}

/// As [`the_view_shows_the_colours_where_they_belong`], drawn by the device: rects and meshes, `uv_scale`, and the floor
/// by way of a mirror.
#[test]
fn the_device_draws_the_colours_where_they_belong() {
    let device = Device::open();
    let rect = under_a_point_of_a_sun(folder().load().unwrap().scene);
    let mut mesh = rect.clone();
    mesh.objects[1].uvs = Some(Arc::new(
        mesh.objects[1].texture_coordinates().unwrap().into_owned(),
    ));
    mesh.objects[1].geometry =
        Geometry::Mesh(Arc::new(mesh.objects[1].geometry.mesh().into_owned()));
    let mut unmapped = mesh.clone();
    unmapped.objects[1].light_map = None;
    // A receiver has to be there.
    let mut below = rect.objects[1].clone();
    if let Geometry::Rect(rect) = &mut below.geometry {
        rect.origin.y = -1.0;
    }
    unmapped.objects.push(below);
    let lit = 0.5 / PI * 0.6;
    for (name, scene) in [("rect", rect), ("mesh", mesh), ("unmapped mesh", unmapped)] {
        let (mut worst, mut perturbed) = (0.0_f64, f64::INFINITY);
        for (scale, uv, colour) in PLACES {
            let mut scene = scene.clone();
            scene.materials[1].albedo_map.as_mut().unwrap().uv_scale = DVec2::from(scale);
            let [u, v] = uv;
            let target = DVec3::new(-1.0 + 2.0 * u, 0.0, 1.0 - 2.0 * v);
            look_at(&mut scene, target, DVec3::new(0.2, 1.0, 0.3), 1e-3);
            let found = drawn(&device, &scene);
            let exact = lit * DVec3::from(colour);
            worst = worst.max(relative(found, exact));
            // Channels the other way about.
            let turned = DVec3::new(exact.y, exact.z, exact.x);
            if turned != exact {
                perturbed = perturbed.min(relative(found, turned));
            }
        }
        assert_error(&format!("texels, {name}"), 0.01, worst, perturbed);
    }
}

/// A texture whose squares are far smaller than pixels shows its linear mean, whether it is seen directly or in a mirror.
#[test]
fn far_squares_become_their_linear_mean() {
    let device = Device::open();
    let mut scene = under_a_point_of_a_sun(folder().load().unwrap().scene);
    let side = 64;
    let texels = (0..side * side)
        .map(|i| match (i / side + i) % 2 {
            0 => [255, 188, 0, 255],
            _ => [0, 0, 0, 255],
        })
        .collect();
    scene.textures[0] = Arc::new(Texture::new(side, side, texels));
    scene.materials[1].albedo_map.as_mut().unwrap().uv_scale = DVec2::splat(64.0);
    // sRGB 188 is 0.5029 linear.
    let mean = 0.5 / PI * 0.6 * DVec3::new(0.5, 0.5 * 0.5029, 0.0);
    // Where values were averaged as they are encoded, 127.5 of 255 would be 0.2122.
    let encoded = 0.5 / PI * 0.6 * DVec3::new(0.2122, 0.1124, 0.0);
    look_at(
        &mut scene,
        DVec3::new(-0.3, 0.0, 0.4),
        DVec3::new(-0.5, 2.0, 2.0),
        0.4,
    );
    let found = drawn(&device, &scene);
    assert_error(
        "mean",
        0.01,
        relative(found, mean),
        relative(found, encoded),
    );

    // By way of the mirror, of reflectance 0.9, in the plane z = 0: the camera's image behind it looks at the floor.
    let target = DVec3::new(0.5, 0.5, 0.0);
    look_at(&mut scene, target, DVec3::new(0.0, 0.9, 0.9), 0.2);
    let found = drawn(&device, &scene);
    let (mean, encoded) = (0.9 * mean, 0.9 * encoded);
    assert_error(
        "mean in a mirror",
        0.01,
        relative(found, mean),
        relative(found, encoded),
    );
}
