//! What the scene loader takes and refuses: each bad input is one change to a good scene, and its
//! error names the file, the place and the reason. Meshes, environments and motion have tests of their
//! own.

use crate::common::folder::{Folder, OBJ, SCENE, hdr, mesh};
use crate::common::{scene_path, shipped};
use glam::DVec3;
use nephroid::scene::{LightKind, load};
use std::fs;
use std::path::Path;
use tempfile::TempDir;

#[test]
fn the_good_scene_loads_in_si_units() {
    let loaded = Folder::new().load().unwrap_or_else(|e| panic!("{e}"));
    assert_eq!(loaded.warnings, Vec::<String>::new());
    let scene = &loaded.scene;
    assert_eq!(scene.camera.fov, 40f64.to_radians());
    let LightKind::Sun {
        direction,
        angular_radius,
        ..
    } = scene.lights[0].kind
    else {
        panic!("the first light is the sun");
    };
    assert!((direction - DVec3::new(0.0, 0.6, -0.8)).length() < 1e-15);
    assert_eq!(angular_radius, 0.2665f64.to_radians());
    let LightKind::Environment {
        map,
        scale,
        rotation,
        casts_caustics: _,
    } = &scene.lights[1].kind
    else {
        panic!("the second light is the sky");
    };
    assert_eq!((map.width, map.height, map.radiance.len()), (2, 1, 2));
    assert_eq!((*scale, *rotation), (1.0, 90f64.to_radians()));
    assert_eq!(scene.objects[0].name, "part");
    assert_eq!(mesh(&loaded).triangles, [[0, 1, 2], [0, 2, 3]]);
    assert_eq!(scene.objects[1].light_map, Some([32, 16]));
    assert!(scene.objects.iter().all(|object| object.blocks_light));
}

#[test]
fn shipped_scenes_load_without_a_warning() {
    let names = shipped();
    for name in &names {
        let loaded = load(&scene_path(name)).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(loaded.warnings, Vec::<String>::new());
        assert!(loaded.scene.planar_receivers().count() > 0);
    }
    assert_eq!(names.len(), 25);
}

const LAMP: &str = "\
kind = \"lamp\"
position = [0.5, 0.5, 0.4]
radius = 0.1
flux = [3.0, 2.0, 1.0]
";

/// [`SCENE`] with a lamp before the square `part` in place of the sun.
fn lamp_scene() -> Folder {
    let folder = Folder::new();
    let start = SCENE.find("kind = \"sun\"").unwrap();
    let end = SCENE.find("\n[[light]]\nname = \"sky\"").unwrap();
    let scene = [&SCENE[..start], LAMP, &SCENE[end..]].concat();
    folder.write("scene.toml", scene);
    folder
}

#[test]
fn a_lamp_loads() {
    let loaded = lamp_scene().load().unwrap_or_else(|e| panic!("{e}"));
    let LightKind::Lamp {
        position,
        radius,
        radiant_flux,
    } = loaded.scene.lights[0].kind
    else {
        panic!("the first light is the lamp");
    };
    assert_eq!(position, DVec3::new(0.5, 0.5, 0.4));
    assert_eq!((radius, radiant_flux), (0.1, DVec3::new(3.0, 2.0, 1.0)));
    assert_eq!(loaded.warnings, Vec::<String>::new());
}

#[test]
fn bad_lamps_are_refused_with_their_place() {
    // (from, to, place, reason)
    #[rustfmt::skip]
    let cases = [
        ("radius = 0.1", "", "line 9, column 8", "light \"sun\": the key `radius` is missing"),
        ("radius = 0.1", "radius = 0", "line 12, column 10", "radius: 0 is not within"),
        ("radius = 0.1", "radius = -0.1", "line 12, column 10", "radius: -0.1 is not within"),
        ("radius = 0.1", "radius = nan", "line 12, column 10", "radius: NaN is not within"),
        ("radius = 0.1", "radius = 0.1\nirradiance = [1, 1, 1]", "line 13, column 14", "`lamp` has no key `irradiance`"),
        ("radius = 0.1", "radius = 0.1\nscale = 2", "line 13, column 9", "`lamp` has no key `scale`"),
        ("flux = [3.0", "flux = [-3.0", "line 13, column 8", "flux: -3 is not within"),
        ("flux = [3.0", "flux = [inf", "line 13, column 8", "flux: inf is not within"),
        ("flux = [3.0", "flux = [1e30", "line 13, column 8", "its radiance is 2.5"),
        ("[0.5, 0.5, 0.4]", "[0.5, 0.5]", "line 11, column 12", "array of length 3"),
        ("[0.5, 0.5, 0.4]", "[0.5, nan, 0.4]", "line 11, column 12", "position: NaN is not within"),
        // The square's corners are outside of the lamp, too.
        ("[0.5, 0.5, 0.4]", "[0.5, 0.5, 0.09]", "line 11, column 12", "object \"part\" reaches into the lamp, to 0.09 m from the middle"),
        ("[0.5, 0.5, 0.4]", "[0.5, 0.05, 0.4]", "line 11, column 12", "object \"floor\" reaches into the lamp"),
        ("[0.5, 0.5, 0.4]", "[2.05, 1.5, 2.5]", "line 11, column 12", "the camera reaches into the lamp"),
    ];
    for (from, to, place, reason) in cases {
        let error = lamp_scene().error_after("scene.toml", from, to);
        let start = format!("scene.toml, {place}: ");
        assert!(error.starts_with(&start), "{from} to {to}: {error}");
        assert!(error.contains(reason), "{from} to {to}: {error}");
    }
}

#[test]
fn bad_scene_files_are_refused_with_their_place() {
    // (from, to, place, reason)
    #[rustfmt::skip]
    let cases = [
        ("version = 1", "", "line 1, column 1", "`version` is missing"),
        ("version = 1", "version = 2", "line 1, column 11", "version 2 is not supported"),
        ("version = 1", "version = \"1\"", "line 1, column 11", "version \"1\" is not supported"),
        ("version = 1", "version = 1\nversion = 1", "line 2, column 1", "duplicate key"),
        ("version = 1", "version = 1\nscale = 2", "line 2, column 1", "unknown field `scale`"),
        ("fov_degrees = 40", "fov_degree = 40", "line 6, column 1", "unknown field `fov_degree`"),
        ("fov_degrees = 40", "", "line 3, column 1", "camera: the key `fov_degrees` is missing"),
        ("fov_degrees = 40", "fov_degrees = 180", "line 6, column 15", "180 is not within"),
        ("fov_degrees = 40", "fov_degrees = 0", "line 6, column 15", "0 is not within"),
        ("fov_degrees = 40", "fov_degrees = nan", "line 6, column 15", "NaN is not within"),
        ("fov_degrees = 40", "fov_degrees = \"wide\"", "line 6, column 15", "invalid type"),
        ("fov_degrees = 40", "fov_degrees =", "line 6, column 14", "must be quoted"),
        ("fov_degrees = 40", "fov_degrees = 40\nexposure_ev = inf", "line 7, column 15", "inf is not"),
        ("[2, 1.5, 2.5]", "[2, 1.5]", "line 4, column 12", "array of length 3"),
        ("[2, 1.5, 2.5]", "[2, 1e10, 2.5]", "line 4, column 12", "position: 10000000000 is not"),
        ("[2, 1.5, 2.5]", "[0, 0, 0]", "line 3, column 1", "the same point"),
        ("[2, 1.5, 2.5]", "[0, 9, 0]", "line 3, column 1", "straight along the y axis"),
        ("direction = [0.0, 3.0, -4.0]", "", "line 9, column 8", "light \"sun\": the key `direction`"),
        ("[0.0, 3.0, -4.0]", "[0, 0, 0]", "line 11, column 13", "direction has no length"),
        ("[0.0, 3.0, -4.0]", "[0, -inf, 0]", "line 11, column 13", "-inf is not within"),
        ("irradiance = [1.0", "irradiance = [-1.0", "line 12, column 14", "-1 is not within"),
        ("= 0.2665", "= 90", "line 13, column 26", "90 is not within"),
        ("= 0.2665", "= -0.1", "line 13, column 26", "-0.1 is not within"),
        ("= 0.2665", "= 0.2665\nscale = 1", "line 14, column 9", "`sun` has no key `scale`"),
        ("kind = \"sun\"", "kind = \"bulb\"", "line 10, column 8", "no kind `bulb`"),
        ("kind = \"sun\"", "kind = \"lamp\"", "line 11, column 13", "`lamp` has no key `direction`"),
        ("= 0.2665", "= 0.2665\nradius = 1", "line 14, column 10", "`sun` has no key `radius`"),
        ("name = \"sky\"", "name = \"sun\"", "line 16, column 8", "light \"sun\": the name is used twice"),
        ("name = \"sky\"", "name = \"\"", "line 16, column 8", "the name is empty"),
        ("rotation_degrees = 90.0", "scale = -1.0", "line 19, column 9", "scale: -1 is not within"),
        ("rotation_degrees = 90.0", "direction = [0, 1, 0]", "line 19, column 13", "no key `direction`"),
        ("rotation_degrees = 90.0", "flux = [0, 1, 0]", "line 19, column 8", "no key `flux`"),
        ("\"sky.hdr\"", "\"nosuch.hdr\"", "line 18, column 8", "light \"sky\": `nosuch.hdr` cannot be read"),
        ("\"sky.hdr\"", "\".\"", "line 18, column 8", "`.` is not a file"),
        ("\"sky.hdr\"", "\"\"", "line 18, column 8", "not a relative path"),
        ("\"sky.hdr\"", "\"/etc/hosts\"", "line 18, column 8", "`/etc/hosts` is not a relative path"),
        ("\"sky.hdr\"", "\"../../sky.hdr\"", "line 18, column 8", "leads out of the asset root"),
        ("kind = \"mirror\"", "kind = \"dielectric\"\nior = 1.3", "line 25, column 15", "`dielectric` has no key `reflectance`"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"dielectric\"", "line 22, column 8", "the key `ior` is missing"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"dielectric\"\nior = 0", "line 24, column 7", "ior: 0 is not within"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"dielectric\"\nior = -1.5", "line 24, column 7", "ior: -1.5 is not within 0.1 and 10"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"dielectric\"\nior = nan", "line 24, column 7", "ior: NaN is not within"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"dielectric\"\nior = inf", "line 24, column 7", "ior: inf is not within"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"dielectric\"\nior = [1.5, 1.6]", "line 24, column 7", "a list of other than three numbers"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"dielectric\"\nior = { cauchy = [0.9, 0.004] }", "line 24, column 7", "ior is 0.9"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"dielectric\"\nior = { cauchy = [1.5] }", "line 24, column 7", "neither cauchy with 2 or 3 coefficients"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"dielectric\"\nior = { sellmeier = [[1.0, 0.2]] }", "line 24, column 7", "ior is NaN"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"dielectric\"\nior = \"glass\"", "line 24, column 7", "there is no medium `glass`"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"dielectric\"\nior = 1.5\ndispersion = true", "line 25, column 14", "one number, which has no dispersion"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"dielectric\"\nior = \"BK7\"\ndispersion = true\nthin = true", "line 25, column 14", "a sheet turns no light"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"dielectric\"\nior = 1.5\nabsorption = [0, -1, 0]", "line 25, column 14", "absorption: -1 is not within"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"dielectric\"\nior = 1.5\nabsorption = [0, nan, 0]", "line 25, column 14", "absorption: NaN is not within"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"dielectric\"\nior = 1.5\npriority = 1001", "line 25, column 12", "priority is 1001"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"conductor\"\nmetal = \"tin\"", "line 24, column 9", "no metal `tin`"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"conductor\"", "line 22, column 8", "the key `index` is missing"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"conductor\"\nmetal = \"gold\"\nindex = [1, 1, 1]", "line 25, column 9", "beside `metal`"),
        ("kind = \"mirror\"", "kind = \"glossy\"", "line 23, column 8", "no kind `glossy`"),
        ("reflectance = [0.9", "reflectance = [1.1", "line 24, column 15", "1.1 is not within 0 and 1"),
        ("reflectance = [0.9", "albedo = [0.9", "line 24, column 10", "`mirror` has no key `albedo`"),
        ("albedo = [0.5", "albedo = [-0.5", "line 29, column 10", "-0.5 is not within 0 and 1"),
        ("name = \"plaster\"", "name = \"steel\"", "line 27, column 8", "material \"steel\": the name is used twice"),
        ("material = \"steel\"", "material = \"steal\"", "line 34, column 12", "object \"part\": there is no material `steal`"),
        ("material = \"steel\"", "lightmap = [8, 8]", "line 34, column 12", "none of the mesh's materials is diffuse"),
        ("mesh = \"part.obj\"", "", "line 32, column 8", "no `mesh`, `frames`, `rect` or `waves`"),
        ("mesh = \"part.obj\"", "waves = { height = 0.1 }", "line 33, column 11", "unknown field `height`"),
        ("mesh = \"part.obj\"", "waves = { origin = [0, 0, 0], edge_u = [1, 0, 0], edge_v = [0, 0, -1] }", "line 32, column 8", "the key `quads` is missing"),
        ("mesh = \"part.obj\"", "waves = { origin = [0, 0, 0], edge_u = [1, 0, 0], edge_v = [0, 0, -1], quads = [8, 0] }", "line 33, column 80", "1 to 4096 quads a side, not 0"),
        ("mesh = \"part.obj\"", "waves = { origin = [0, 0, 0], edge_u = [1, 0, 0], edge_v = [0, 0, -1], quads = [8, 8], sines = [{ amplitude = 1, wave_vector = [2, 0] }] }", "line 33, column 9", "too steep: their slope reaches 2.000"),
        ("mesh = \"part.obj\"", "waves = { origin = [0, 0, 0], edge_u = [1, 0, 0], edge_v = [0, 0, -1], quads = [8, 8], sines = [{ amplitude = nan, wave_vector = [2, 0] }] }", "line 33, column 111", "amplitude: NaN is not within"),
        ("mesh = \"part.obj\"", "waves = { origin = [0, 0, 0], edge_u = [1, 0, 0], edge_v = [0, 0, -1], quads = [8, 8], sines = [{ amplitude = 1 }] }", "line 33, column 97", "the key `wave_vector` is missing"),
        ("rect = {", "mesh = \"part.obj\"\nrect = {", "line 37, column 8", "more than one of `mesh`, `frames`, `rect` and `waves`"),
        ("name = \"floor\"", "name = \"part\"", "line 37, column 8", "object \"part\": the name is used twice"),
        ("edge_u = [2.0, 0.0, 0.0]", "edge_u = [0, 0, 0]", "line 38, column 8", "an edge of the rect has no length"),
        ("edge_u = [2.0, 0.0, 0.0]", "edge_u = [2, 0, 1e-5]", "line 38, column 8", "not perpendicular"),
        ("edge_u = [2.0, 0.0, 0.0], ", "", "line 37, column 8", "`edge_u` is missing"),
        ("edge_u = [2.0, 0.0, 0.0]", "edge_w = [2, 0, 0]", "line 38, column 37", "unknown field `edge_w`"),
        ("material = \"plaster\"", "material = \"steel\"", "line 40, column 12", "a specular surface keeps no light"),
        ("material = \"plaster\"\n", "", "line 37, column 8", "`material` is missing"),
        ("[32, 16]", "[0, 16]", "line 40, column 12", "1 to 8192 texels a side, not 0"),
        ("[32, 16]", "[32, 8193]", "line 40, column 12", "1 to 8192 texels a side, not 8193"),
        ("[32, 16]", "[-1, 16]", "line 40, column 12", "1 to 8192 texels a side, not -1"),
        ("[32, 16]", "32", "line 40, column 12", "invalid type"),
    ];
    for (from, to, place, reason) in cases {
        let message = Folder::new().error_after("scene.toml", from, to);
        let start = format!("scene.toml, {place}: ");
        assert!(
            message.starts_with(&start) && message.contains(reason),
            "{to:?}: {message}"
        );
    }
}

#[test]
fn almost_perpendicular_edges_pass() {
    let folder = Folder::new();
    let scene = SCENE.replace("edge_u = [2.0, 0.0, 0.0]", "edge_u = [2, 0, 1e-6]");
    folder.write("scene.toml", scene);
    folder.load().unwrap_or_else(|e| panic!("{e}"));
}

#[test]
fn a_scene_needs_an_object_and_should_have_a_light() {
    let folder = Folder::new();
    let first_light = SCENE.find("[[light]]").unwrap();
    let first_material = SCENE.find("[[material]]").unwrap();
    let first_object = SCENE.find("[[object]]").unwrap();
    folder.write("scene.toml", &SCENE[..first_object]);
    assert!(
        folder
            .error()
            .starts_with("scene.toml: the scene has no object")
    );
    let dark = format!("{}{}", &SCENE[..first_light], &SCENE[first_material..]);
    folder.write("scene.toml", dark);
    let warnings = folder.load().unwrap().warnings;
    assert!(
        warnings.len() == 1 && warnings[0].contains("the picture is black"),
        "{warnings:?}"
    );
}

#[test]
fn files_that_are_no_scene_are_refused() {
    let folder = Folder::new();
    folder.write("scene.toml", "");
    assert!(
        folder
            .error()
            .starts_with("scene.toml, line 1, column 1: the file is empty")
    );
    folder.write("scene.toml", b"version = 1\n# \xff");
    assert!(folder.error().starts_with("scene.toml: not UTF-8 text"));
    folder.write("scene.toml", vec![b'#'; (16 << 20) + 1]);
    assert!(
        folder
            .error()
            .starts_with("scene.toml: the file is larger than 16 MiB")
    );
    folder.write(
        "scene.toml",
        format!("version = 1\nx = {}", "[".repeat(100_000)),
    );
    assert!(folder.error().starts_with("scene.toml, line 2, "));
    fs::remove_file(folder.path("scene.toml")).unwrap();
    assert!(folder.error().starts_with("scene.toml: cannot be read: "));
    fs::create_dir(folder.path("scene.toml")).unwrap();
    assert!(folder.error().starts_with("scene.toml: it is a folder"));
}

#[test]
fn a_scene_in_an_asset_root_may_use_all_of_it_and_nothing_else() {
    let folder = Folder::new();
    let scene = SCENE
        .replace("sky.hdr", "../environments/sky.hdr")
        .replace("part.obj", "../../part.obj");
    folder.write("assets/scenes/scene.toml", &scene);
    folder.write("assets/environments/sky.hdr", hdr(2, 1, &[[1.0; 3]; 2]));
    let path = folder.path("assets/scenes/scene.toml");
    let message = load(&path).unwrap_err().to_string();
    assert!(
        message.contains("`../../part.obj` leads out of the asset root"),
        "{message}"
    );
    folder.write("assets/meshes/part.obj", OBJ);
    fs::write(&path, scene.replace("../../part.obj", "../meshes/part.obj")).unwrap();
    load(&path).unwrap_or_else(|e| panic!("{e}"));
}

#[cfg(unix)]
#[test]
fn links_may_not_leave_the_asset_root() {
    let folder = Folder::new();
    let outside = TempDir::new().unwrap();
    fs::write(outside.path().join("part.obj"), OBJ).unwrap();
    let link = |target: &Path| {
        fs::remove_file(folder.path("part.obj")).unwrap();
        std::os::unix::fs::symlink(target, folder.path("part.obj")).unwrap();
    };
    folder.write("inside.obj", OBJ);
    link(&folder.path("inside.obj"));
    folder.load().unwrap_or_else(|e| panic!("{e}"));
    link(&outside.path().join("part.obj"));
    let message = folder.error();
    assert!(
        message.starts_with("scene.toml, line 33, column 8: object \"part\": `part.obj` leads out")
    );
}
