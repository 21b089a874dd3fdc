//! What the loader takes, repairs and refuses of meshes and their materials.

use crate::common::folder::{Folder, OBJ, SCENE, area, load_obj, mesh};
use crate::common::{Device, footprint, refuses};
use glam::DVec3;
use nephroid::scene::MaterialKind;

#[test]
fn bad_meshes_are_refused_with_their_line() {
    #[rustfmt::skip]
    let cases = [
        ("v 0 0 0", "v 0 0", "line 2", "there are 2 numbers, not three"),
        ("v 0 0 0", "v 0 0 zero", "line 2", "`zero` is not a number"),
        ("v 0 0 0", "v 0 nan 0", "line 2", "NaN is not within"),
        ("v 0 0 0", "v 0 0 -inf", "line 2", "-inf is not within"),
        ("v 0 0 0", "v 0 0 2e9", "line 2", "2000000000 is not within"),
        ("v 0 0 0", "v 1 1 1 0", "line 2", "inf is not within"),
        ("vn 0 0 1", "vn 0 0 nan", "line 6", "NaN is not within"),
        ("vn 0 0 1", "vn 0 0", "line 6", "there are 2 numbers, not three"),
        ("f 1//1 2//1 3//1 4//1", "f 1//1 2//1 3//1 5//1", "line 8", "uses position 5, but 4 are"),
        ("f 1//1 2//1 3//1 4//1", "f 1//1 2//1 0//1", "line 8", "uses position 0, but 4 are"),
        ("f 1//1 2//1 3//1 4//1", "f 1//1 2//1 -5//1", "line 8", "uses position -5, but 4 are"),
        ("f 1//1 2//1 3//1 4//1", "f 1//1 2//1 3//-2", "line 8", "uses normal -2, but 1 are"),
        ("f 1//1 2//1 3//1 4//1", "f 1//1 2//1", "line 8", "a face has 2 corners"),
        ("f 1//1 2//1 3//1 4//1", "f 1", "line 8", "a face has 1 corners"),
        ("f 1//1 2//1 3//1 4//1", "f", "line 8", "a face has 0 corners"),
        ("f 1//1 2//1 3//1 4//1", "f 1 2 three", "line 8", "`three` is not a corner"),
        ("f 1//1 2//1 3//1 4//1", "f 1/1/1/1 2 3", "line 8", "`1/1/1/1` is not a corner"),
        ("f 1//1 2//1 3//1 4//1", "f 1 2 99999999999999999999", "line 8", "is not a corner"),
        ("usemtl chrome", "usemtl", "line 7", "`usemtl` names nothing"),
    ];
    for (from, to, place, reason) in cases {
        let message = Folder::new().error_after("part.obj", from, to);
        let start = format!("part.obj, {place}: ");
        assert!(
            message.starts_with(&start) && message.contains(reason),
            "{to:?}: {message}"
        );
    }
    let empty = Folder::new().error_after("part.obj", "f 1//1 2//1 3//1 4//1", "");
    assert!(
        empty.starts_with("part.obj: the mesh has no faces"),
        "{empty}"
    );
    let flat = Folder::new().error_after("part.obj", "f 1//1 2//1 3//1 4//1", "f 1 2 2");
    assert!(flat.starts_with("part.obj: no face has an area"), "{flat}");
}

#[test]
fn ten_million_triangles_are_the_limit() {
    let folder = Folder::new();
    folder.write("part.obj", fan(10_000_001));
    let message = folder.error();
    assert!(
        message.starts_with("part.obj: 10000001 triangles are more than 10000000"),
        "{message}"
    );
}

/// A polygon of so many triangles, all without area.
fn fan(triangles: usize) -> String {
    format!("v 0 0 0\nf{}\n", " 1".repeat(triangles + 2))
}

/// The memory is judged before it is taken: where it does not suffice, the program would be ended.
#[cfg(target_os = "linux")]
#[test]
fn a_mesh_that_memory_does_not_suffice_for_is_refused() {
    let folder = Folder::new();
    folder.write("part.obj", fan(3_000_000));
    let with_limit = |kib: &str| reference_within(kib, &folder);
    refuses(
        &mut with_limit("1048576"),
        3,
        &[
            "part.obj: 3000000 triangles would take some 3.4 GiB of memory, and 0.",
            "GiB are available",
            "remedy: free some memory, or use a coarser mesh",
        ],
    );
    refuses(&mut with_limit("unlimited"), 3, &["no face has an area"]);
    assert!(!folder.path("map.exr").exists());
}

/// The same holds for light maps, those of meshes included, which are laid out first.
#[cfg(target_os = "linux")]
#[test]
fn a_light_map_that_memory_does_not_suffice_for_is_refused() {
    let folder = Folder::new();
    let plaster = "mesh = \"part.obj\"\nmaterial = \"plaster\"\nlightmap = [16, 16]";
    let scene = SCENE.replace("mesh = \"part.obj\"\nmaterial = \"steel\"", plaster);
    folder.write("scene.toml", &scene);
    for (receiver, gigabytes) in [("floor", "7.5"), ("part", "15.0")] {
        refuses(
            (reference_within("1048576", &folder)).args([
                "--lightmap",
                "8192",
                "--receiver",
                receiver,
            ]),
            2,
            &[
                &format!("texels would take some {gigabytes} GiB of memory, and 0."),
                "GiB are available",
                "remedy: ",
            ],
        );
    }
    folder.write("scene.toml", scene.replace("[16, 16]", "[8192, 8192]"));
    refuses(
        &mut reference_within("1048576", &folder),
        3,
        &[
            "scene.toml, line",
            "texels would take some 37.5 GiB of memory",
            "lower the size",
        ],
    );
    assert!(!folder.path("map.exr").exists());
}

/// `nephroid reference` of the folder's scene with so much memory.
#[cfg(target_os = "linux")]
fn reference_within(kib: &str, folder: &Folder) -> assert_cmd::Command {
    let mut shell = assert_cmd::Command::new("sh");
    shell
        .args(["-c", "ulimit -v $0 && exec \"$@\"", kib])
        .arg(assert_cmd::cargo::cargo_bin("nephroid"))
        .args(["reference", "-o"])
        .args([folder.path("map.exr"), folder.path("scene.toml")]);
    shell
}

/// Comments behind numbers are left out; names keep their spaces and number signs.
#[test]
fn comments_and_names_are_read_as_written() {
    let folder = Folder::new();
    folder.write("scene.toml", SCENE.replace("material = \"steel\"", ""));
    let obj = "mtllib part.mtl\nv 0 0 0 # first\nv 1 0 0#second\nv 0 1 0\nvn 0 0 1 # front\n\
               usemtl pale  grey #1\nf 1//1 2//1 3//1 # 4//1\n";
    folder.write("part.obj", obj);
    let mtl = "newmtl pale  grey #1\nKd 0.5 0.4 0.3 # grey\nd 1.0 # opaque\nTr 0.0\nKe 0 0 0\n";
    folder.write("part.mtl", mtl);
    let loaded = folder.load().unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(loaded.scene.objects[0].name, "part/pale  grey #1");
    assert_eq!(mesh(&loaded).triangles.len(), 1);
    assert_eq!(loaded.warnings, [""; 0]);
    folder.write(
        "part.mtl",
        mtl.replace("Tr 0.0", "Tr 0.5")
            .replace("Ke 0 0 0", "Ke 1 0 0"),
    );
    let warnings = folder.load().unwrap().warnings.join(", ");
    for left_out in [
        "line 4: `Tr` is not supported",
        "line 5: `Ke` is not supported",
    ] {
        assert!(warnings.contains(left_out), "{warnings}");
    }
}

/// A tetrahedron around a point near [0.2, 1.2, 0.2], its faces counter-clockwise from outside.
const TETRAHEDRON: &str = "\
v 0 1 0
v 1 1 0
v 0 2 0
v 0 1 1
f 1 3 2
f 1 2 4
f 1 4 3
f 2 3 4
";

fn inside_out(obj: &str) -> String {
    obj.replace("f 1 3 2", "f 1 2 3")
        .replace("f 1 2 4", "f 1 4 2")
        .replace("f 1 4 3", "f 1 3 4")
        .replace("f 2 3 4", "f 2 4 3")
}

#[test]
fn bodies_that_are_open_or_inside_out_are_named() {
    let glass = SCENE.replace(
        "kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]",
        "kind = \"dielectric\"\nior = 1.5",
    );
    let inside = SCENE.replace("position = [2, 1.5, 2.5]", "position = [0.2, 1.2, 0.2]");
    let without = |face: &str| TETRAHEDRON.replace(face, "");
    // Only corners that are at one place, not shared.
    let split = TETRAHEDRON.replace("f 2 3 4", "v 1 1 0\nv 0 2 0\nv 0 1 1\nf 5 6 7");
    let one_turned = TETRAHEDRON.replace("f 2 3 4", "f 2 4 3");
    for (scene, obj, expected) in [
        (&glass, TETRAHEDRON.into(), None),
        (&glass, split, None),
        // All that is open is water, of which every face looks to one side.
        (&glass, OBJ.into(), None),
        (
            &glass,
            without("f 1 3 2\n"),
            Some("its mesh is open at 3 edges, one at [0"),
        ),
        (
            &glass,
            one_turned,
            Some("front and back are mixed up at 3 edges, one at ["),
        ),
        (
            &glass,
            inside_out(TETRAHEDRON),
            Some("its faces look inward, so that `ior`"),
        ),
        (&SCENE.into(), TETRAHEDRON.into(), None),
        (&SCENE.into(), without("f 1 3 2\n"), None),
        (
            &SCENE.into(),
            inside_out(TETRAHEDRON),
            Some("its faces look inward, and the backs of"),
        ),
        (&inside, inside_out(TETRAHEDRON), None),
    ] {
        let folder = Folder::new();
        folder.write("scene.toml", scene);
        folder.write("part.obj", &obj);
        let warnings = folder.load().unwrap_or_else(|e| panic!("{e}")).warnings;
        match expected {
            None => assert_eq!(warnings, Vec::<String>::new(), "{obj}"),
            Some(reason) => {
                let [warning] = warnings.as_slice() else {
                    panic!("{reason}: {warnings:?}");
                };
                assert!(
                    warning.contains("scene.toml: object \"part\": "),
                    "{warning}"
                );
                assert!(warning.contains(reason), "{warning}");
            }
        }
    }
}

/// Two tetrahedra of glass and water: apart, nested, in contact and crossing each other.
#[test]
fn bodies_that_overlap_without_priority_are_named() {
    let glass = SCENE.replace(
        "kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]",
        "kind = \"dielectric\"\nior = 1.5",
    );
    let medium =
        |keys: &str| format!("\n[[material]]\nname = \"water\"\nkind = \"dielectric\"\n{keys}\n");
    let water = medium("ior = 1.33");
    let other = |scale: f64, x: f64| {
        format!(
            "\n[[object]]\nname = \"other\"\nmesh = \"part.obj\"\nmaterial = \"water\"\n[object.motion]\n\
             pivot = [0.2, 1.2, 0.2]\nkeyframes = [{{ time = 0.0, scale = {scale}, translation = [{x}, 0.0, 0.0] }}]\n"
        )
    };
    let warnings = |scene: String| {
        let folder = Folder::new();
        folder.write("scene.toml", scene);
        folder.write("part.obj", TETRAHEDRON);
        folder.load().unwrap_or_else(|e| panic!("{e}")).warnings
    };
    for (medium, scale, x) in [
        (&water, 1.0, 2.0),
        // A bubble, and one body in its shell.
        (&water, 0.5, 0.0),
        (&water, 1.5, 0.0),
        // Corner to corner, and the same faces twice.
        (&water, 1.0, 1.0),
        (&water, 1.0, 0.0),
        (&medium("ior = 1.33\npriority = 1"), 1.0, 0.3),
        // One medium.
        (&medium("ior = 1.5"), 1.0, 0.3),
        (&medium("ior = 1.33\nthin = true"), 1.0, 0.3),
    ] {
        let scene = [&glass, medium.as_str(), &other(scale, x)].concat();
        assert_eq!(
            warnings(scene),
            Vec::<String>::new(),
            "{medium} {scale} {x}"
        );
    }
    for (scale, x) in [(1.0, 0.3), (0.5, 0.3), (1.0, 1e-3)] {
        let found = warnings([&glass, water.as_str(), &other(scale, x)].concat());
        let [warning] = found.as_slice() else {
            panic!("{scale} {x}: {found:?}");
        };
        let expected = "scene.toml: object \"other\": it crosses object \"part\" at [";
        assert!(warning.contains(expected), "{warning}");
        assert!(warning.contains("the higher `priority`"), "{warning}");
    }
}

#[test]
fn mirrors_that_face_away_are_named() {
    // The square looks toward +z; the floor reaches to both of its sides.
    let floor = "origin = [-1.0, 0.0, 1.0]";
    let sky = &SCENE
        [SCENE.find("[[light]]\nname = \"sky\"").unwrap()..SCENE.find("[[material]]").unwrap()];
    let sunny = SCENE.replace(sky, "");
    let lit = sunny.replace("[0.0, 3.0, -4.0]", "[0.0, 3.0, 4.0]");
    let grazed = sunny.replace("[0.0, 3.0, -4.0]", "[0.0, 1.0, -0.001]");
    let behind = lit.replace(floor, "origin = [-1.0, 0.0, -1.0]");
    let lamp = |z: f64| {
        let start = sunny.find("kind = \"sun\"").unwrap();
        let end = sunny.find("[[material]]").unwrap();
        let lamp = format!(
            "kind = \"lamp\"\nradius = 0.01\nflux = [1, 1, 1]\nposition = [0.5, 0.5, {z}]\n\n"
        );
        [&sunny[..start], &lamp, &sunny[end..]].concat()
    };
    let glass = sunny.replace(
        "kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]",
        "kind = \"dielectric\"\nior = 1.5",
    );
    let shadow = "\n[[object]]\nname = \"roof\"\nmaterial = \"plaster\"\n\
        rect = { origin = [-5.0, 1.5, 5.0], edge_u = [10.0, 0.0, 0.0], edge_v = [0.0, 0.0, -10.0] }\n";
    let shadowed = [&lit, shadow].concat();
    let device = Device::open();
    for (scene, expected) in [
        (&SCENE.to_owned(), None),
        (
            &shadowed,
            Some("other objects, or itself, keep all light from its faces that look toward one"),
        ),
        (&sunny, Some("all of its faces look away from every light")),
        (&lit, None),
        (&grazed, None),
        (&lamp(0.4), None),
        (
            &lamp(-0.4),
            Some("all of its faces look away from every light"),
        ),
        (
            &behind,
            Some(
                "the light that it sends on reaches no receiver: it misses them all, meets their backs, or is blocked",
            ),
        ),
        (&glass, None),
    ] {
        let folder = Folder::new();
        folder.write("scene.toml", scene);
        let scene_ = folder.load().unwrap_or_else(|e| panic!("{e}")).scene;
        let mut notes = device.renderer(&scene_, &footprint(64)).notes();
        notes.retain(|note| note.contains("casts no caustic"));
        let expected: Vec<String> = (expected.iter())
            .map(|reason| format!("object \"part\" casts no caustic: {reason}"))
            .collect();
        assert_eq!(notes, expected, "{scene}");
    }
}

#[test]
fn materials_come_from_the_mtl_file_where_the_scene_names_none() {
    let folder = Folder::new();
    folder.write(
        "scene.toml",
        SCENE.replace("material = \"steel\"", "blocks_light = false"),
    );
    let obj =
        format!("{OBJ}g a\nusemtl chalk\nf 1 2 4\ng b\nf 2 3 4\ng c\nusemtl chrome\nf 1 4 3\n");
    folder.write("part.obj", obj);
    let loaded = folder.load().unwrap_or_else(|e| panic!("{e}"));
    let scene = &loaded.scene;
    let names: Vec<_> = scene
        .objects
        .iter()
        .map(|object| object.name.as_str())
        .collect();
    assert_eq!(names, ["part/chrome", "part/chalk", "floor"]);
    assert!(!scene.objects[0].blocks_light && !scene.objects[1].blocks_light);
    assert_eq!(mesh(&loaded).triangles.len(), 3);
    let material = |object: usize| &scene.materials[scene.objects[object].material];
    assert_eq!(material(1).name, "part/chalk");
    assert!(
        matches!(material(0).kind, MaterialKind::Mirror { reflectance }
        if reflectance == DVec3::new(0.9, 0.8, 0.7))
    );
    assert!(matches!(material(1).kind, MaterialKind::Diffuse { albedo }
        if albedo == DVec3::new(0.5, 0.4, 0.3)));
}

#[test]
fn bad_material_libraries_are_refused() {
    #[rustfmt::skip]
    let cases = [
        ("part.obj", "mtllib part.mtl", "mtllib nosuch.mtl", "part.obj, line 1: `nosuch.mtl` cannot be read"),
        ("part.obj", "mtllib part.mtl", "mtllib ../part.mtl", "part.obj, line 1: `../part.mtl` leads out"),
        ("part.obj", "mtllib part.mtl", "", "part.obj, line 7: no MTL file of this mesh has the material `chrome`"),
        ("part.obj", "usemtl chrome", "usemtl brass", "part.obj, line 7: no MTL file of this mesh has the material `brass`"),
        ("part.obj", "usemtl chrome", "", "part.obj: it has faces without a material"),
        ("part.mtl", "Ks 0.9 0.8 0.7", "Ks 0.9", "part.mtl, line 3: `Ks 0.9` is malformed"),
        ("part.mtl", "Ks 0.9 0.8 0.7", "Ks a b c", "part.mtl, line 3: `Ks a b c` is malformed"),
        ("part.mtl", "newmtl chrome", "newmtl", "part.mtl, line 1: `newmtl` is malformed"),
        ("part.mtl", "illum 3", "illum -1", "part.mtl, line 4: `illum -1` is malformed"),
        ("part.mtl", "Ks 0.9 0.8 0.7", "", "part.obj: material `chrome`: it has no `Ks`"),
        ("part.mtl", "Ks 0.9 0.8 0.7", "Ks 0.9 0.8 nan", "part.obj: material `chrome`: `Ks` is [0.9, 0.8, NaN]"),
        ("part.mtl", "Ks 0.9 0.8 0.7", "Ks 0.9 0.8 1.5", "not within 0 and 1"),
        ("part.mtl", "illum 3", "illum 7", "part.obj: material `chrome`: it has no `Ni`"),
        ("part.mtl", "illum 3", "illum 7\nNi 0", "`Ni` is 0, not within 0.1 and 10"),
        ("part.mtl", "illum 3", "illum 7\nNi nan", "`Ni` is NaN, not within 0.1 and 10"),
    ];
    for (file, from, to, reason) in cases {
        let folder = Folder::new();
        folder.write("scene.toml", SCENE.replace("material = \"steel\"", ""));
        folder.load().unwrap_or_else(|e| panic!("{e}"));
        let message = folder.error_after(file, from, to);
        assert!(message.contains(reason), "{to:?}: {message}");
        if !message.starts_with("part.mtl") {
            assert!(
                message.contains("give the object a `material`"),
                "{message}"
            );
        }
        // The scene's own material makes do without the library.
        if file == "part.mtl" || to.starts_with("mtllib") {
            folder.write("scene.toml", SCENE);
            folder.load().unwrap_or_else(|e| panic!("{e}"));
        }
    }
}

#[test]
fn polygons_are_cut_into_triangles_without_filling_dents() {
    // An arrow head with the dent at corner 4 and at each corner the start of the polygon once: a
    // fan around corner 1 or 3 would cover the dent.
    let corners = ["0 0 0", "1 -1 0", "0 2 0", "-1 -1 0"];
    for start in 0..4 {
        let mut obj = String::new();
        for i in 0..4 {
            obj += &format!("v {}\n", corners[(start + i) % 4]);
        }
        let loaded = load_obj(&(obj + "f 1 2 3 4\n"));
        assert!((area(mesh(&loaded)) - 2.0).abs() < 1e-12);
        assert!(
            mesh(&loaded)
                .normals
                .iter()
                .all(|normal| *normal == DVec3::Z)
        );
    }
    let octagon: String = (0..8)
        .map(|i| {
            let angle = std::f64::consts::FRAC_PI_4 * f64::from(i);
            format!("v {} {} 7\n", angle.cos(), angle.sin())
        })
        .collect();
    let loaded = load_obj(&(octagon + "f 1 2 3 4 5 6 7 8\n"));
    assert_eq!(mesh(&loaded).triangles.len(), 6);
    assert!((area(mesh(&loaded)) - 8f64.sqrt()).abs() < 1e-12);
    let comb = "v 0 0 0\nv 5 0 0\nv 5 3 0\nv 4 1 0\nv 3 3 0\nv 2 1 0\nv 1 3 0\nf 1 2 3 4 5 6 7\n";
    let message = Folder::new().error_after("part.obj", OBJ, comb);
    assert!(message.contains("too dented"), "{message}");
}

#[test]
fn negative_indices_count_from_the_end() {
    let loaded =
        load_obj("v 9 9 9\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nf -3//-1 -2//-1 -1//-1\nv 7 7 7\n");
    assert_eq!(mesh(&loaded).positions, [DVec3::ZERO, DVec3::X, DVec3::Y]);
}

#[test]
fn corners_are_merged_across_groups_and_texture_seams() {
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 1\nvn 0 0 1\nvn 0 0 2\n\
        g one\nf 1/1/1 2/1/1 3/1/1\ng two\nf 1/2/2 3/2/2 4/2/1\nl 1 2 3 4\np 1\n";
    let loaded = load_obj(obj);
    assert_eq!(mesh(&loaded).positions.len(), 4);
    assert_eq!(mesh(&loaded).triangles.len(), 2);
    assert_eq!(loaded.warnings, Vec::<String>::new());
}

#[test]
fn missing_normals_are_smooth_and_weighted_by_angle() {
    // A corner of a cube: the face in the xy plane is cut in two, and must not count double.
    let obj = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 1 0 -1\nv 0 0 -1\nv 0 1 -1\n\
        f 1 2 3\nf 1 3 4\ng other\nf 1 6 5 2\nf 1 4 7 6\n";
    let loaded = load_obj(obj);
    assert_eq!(loaded.warnings, Vec::<String>::new());
    let mesh = mesh(&loaded);
    assert_eq!(mesh.positions.len(), 7);
    let corner = mesh
        .positions
        .iter()
        .position(|p| *p == DVec3::ZERO)
        .unwrap();
    let expected = DVec3::new(-1.0, -1.0, 1.0).normalize();
    assert!(
        (mesh.normals[corner] - expected).length() < 1e-12,
        "{}",
        mesh.normals[corner]
    );
    let by_area_of_triangles = DVec3::new(-1.0, -1.0, 2.0).normalize();
    assert!((mesh.normals[corner] - by_area_of_triangles).length() > 0.1);
}

#[test]
fn repairs_are_counted_in_warnings() {
    let warning = |from: &str, to: &str, expected: &str| {
        assert!(OBJ.contains(from));
        let loaded = load_obj(&OBJ.replace(from, to));
        let [warning] = loaded.warnings.as_slice() else {
            panic!("{to:?}: {:?}", loaded.warnings);
        };
        assert!(
            warning.contains(expected) && warning.contains("part.obj: "),
            "{warning}"
        );
        assert_eq!(mesh(&loaded).triangles.len(), 2);
        assert!(
            mesh(&loaded)
                .normals
                .iter()
                .all(|normal| *normal == DVec3::Z)
        );
    };
    let face = "f 1//1 2//1 3//1 4//1";
    warning(
        face,
        &format!("{face}\nf 1//1 2//1 2//1"),
        "1 triangles without area were left out",
    );
    warning("vn 0 0 1", "vn 0 0 0", "4 normals of length zero");
    warning(
        "vn 0 0 1",
        "vn 0 0 -1",
        "6 corners had a normal behind their face",
    );
    warning(
        "vn 0 0 1",
        "vn 3 0 -1",
        "6 corners had a normal behind their face",
    );
    warning(face, "f 1//1 2 3//1 4", "2 corners have no normal");
    warning(
        face,
        &format!("{face}\nsurf 1 2\nend"),
        "2 lines are not supported and left out, the first is `surf` on line 9",
    );
}
