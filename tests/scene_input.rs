//! What the scene loader takes and refuses: each bad input is one change to a good scene, and its
//! error names the file, the place and the reason.

use glam::DVec3;
use nephroid::scene::{Geometry, LightKind, Loaded, MaterialKind, Mesh, load};
use proptest::prelude::*;
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

const SCENE: &str = r#"version = 1

[camera]
position = [2, 1.5, 2.5]
target = [0.0, 0.0, 0.0]
fov_degrees = 40

[[light]]
name = "sun"
kind = "sun"
direction = [0.0, 3.0, -4.0]
irradiance = [1.0, 1.0, 1.0]
angular_radius_degrees = 0.2665

[[light]]
name = "sky"
kind = "environment"
file = "sky.hdr"
rotation_degrees = 90.0

[[material]]
name = "steel"
kind = "mirror"
reflectance = [0.9, 0.9, 0.9]

[[material]]
name = "plaster"
kind = "diffuse"
albedo = [0.5, 0.5, 0.5]

[[object]]
name = "part"
mesh = "part.obj"
material = "steel"

[[object]]
name = "floor"
rect = { origin = [-1.0, 0.0, 1.0], edge_u = [2.0, 0.0, 0.0], edge_v = [0.0, 0.0, -2.0] }
material = "plaster"
lightmap = [32, 16]
"#;

/// A square in the plane z = 0 that faces +z.
const OBJ: &str = "\
mtllib part.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vn 0 0 1
usemtl chrome
f 1//1 2//1 3//1 4//1
";

const MTL: &str =
    "newmtl chrome\nKd 0 0 0\nKs 0.9 0.8 0.7\nillum 3\nnewmtl chalk\nKd 0.5 0.4 0.3\n";

/// A folder with the scene above and its files.
struct Folder(TempDir);

impl Folder {
    fn new() -> Self {
        let folder = Self(TempDir::new().unwrap());
        folder.write("scene.toml", SCENE);
        folder.write("part.obj", OBJ);
        folder.write("part.mtl", MTL);
        folder.write("sky.hdr", hdr(2, 1, &[[1.0; 3]; 2]));
        folder
    }

    fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::create_dir_all(self.path(name).parent().unwrap()).unwrap();
        fs::write(self.path(name), content).unwrap();
    }

    fn load(&self) -> nephroid::Result<Loaded> {
        load(&self.path("scene.toml"))
    }

    /// The message of the error, without the folder, after changing `from` to `to` in a file.
    fn error_after(&self, file: &str, from: &str, to: &str) -> String {
        let before = fs::read_to_string(self.path(file)).unwrap();
        assert!(before.contains(from), "{file} has no {from:?}");
        self.write(file, before.replacen(from, to, 1));
        self.error()
    }

    fn error(&self) -> String {
        let error = self.load().expect_err("this must not load");
        assert_eq!(error.exit_code(), 3);
        let message = error.to_string();
        assert!(message.contains("remedy: "), "{message}");
        message.replace(&format!("{}/", self.0.path().display()), "")
    }
}

fn hdr(width: usize, height: usize, pixels: &[[f32; 3]]) -> Vec<u8> {
    let pixels: Vec<_> = pixels.iter().map(|rgb| image::Rgb(*rgb)).collect();
    let mut content = Vec::new();
    let encoder = image::codecs::hdr::HdrEncoder::new(&mut content);
    encoder.encode(&pixels, width, height).unwrap();
    content
}

fn write_exr(path: &Path, pixel: impl Fn(usize, usize) -> (f32, f32, f32) + Sync) {
    exr::prelude::write_rgb_file(path, 4, 2, pixel).unwrap();
}

fn mesh(loaded: &Loaded) -> &Mesh {
    match &loaded.scene.objects[0].geometry {
        Geometry::Mesh(mesh) => mesh,
        _ => panic!("the first object is a mesh"),
    }
}

/// Loads the scene with another `part.obj`.
fn load_obj(obj: &str) -> Loaded {
    let folder = Folder::new();
    folder.write("part.obj", obj);
    folder.load().unwrap_or_else(|e| panic!("{e}"))
}

fn area(mesh: &Mesh) -> f64 {
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        (b - a).cross(c - a).length() / 2.0
    };
    mesh.triangles.iter().map(area).sum()
}

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
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes");
    let mut count = 0;
    for entry in folder.read_dir().unwrap() {
        let loaded = load(&entry.unwrap().path()).unwrap_or_else(|e| panic!("{e}"));
        assert_eq!(loaded.warnings, Vec::<String>::new());
        assert!(loaded.scene.receivers().count() > 0);
        count += 1;
    }
    assert_eq!(count, 9);
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
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"conductor\"\nmetal = \"tin\"", "line 24, column 9", "no metal `tin`"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"conductor\"", "line 22, column 8", "the key `index` is missing"),
        ("kind = \"mirror\"\nreflectance = [0.9, 0.9, 0.9]", "kind = \"conductor\"\nmetal = \"gold\"\nindex = [1, 1, 1]", "line 25, column 9", "beside `metal`"),
        ("kind = \"mirror\"", "kind = \"glossy\"", "line 23, column 8", "no kind `glossy`"),
        ("reflectance = [0.9", "reflectance = [1.1", "line 24, column 15", "1.1 is not within 0 and 1"),
        ("reflectance = [0.9", "albedo = [0.9", "line 24, column 10", "`mirror` has no key `albedo`"),
        ("albedo = [0.5", "albedo = [-0.5", "line 29, column 10", "-0.5 is not within 0 and 1"),
        ("name = \"plaster\"", "name = \"steel\"", "line 27, column 8", "material \"steel\": the name is used twice"),
        ("material = \"steel\"", "material = \"steal\"", "line 34, column 12", "object \"part\": there is no material `steal`"),
        ("material = \"steel\"", "lightmap = [8, 8]", "line 34, column 12", "only a rect can have a light map"),
        ("mesh = \"part.obj\"", "", "line 32, column 8", "no `mesh`, `frames`, `rect` or `waves`"),
        ("mesh = \"part.obj\"", "waves = { height = 0.1 }", "line 33, column 11", "unknown field `height`"),
        ("mesh = \"part.obj\"", "waves = { origin = [0, 0, 0], edge_u = [1, 0, 0], edge_v = [0, 0, -1] }", "line 32, column 8", "the key `quads` is missing"),
        ("mesh = \"part.obj\"", "waves = { origin = [0, 0, 0], edge_u = [1, 0, 0], edge_v = [0, 0, -1], quads = [8, 0] }", "line 33, column 80", "1 to 4096 quads a side, not 0"),
        ("mesh = \"part.obj\"", "waves = { origin = [0, 0, 0], edge_u = [1, 0, 0], edge_v = [0, 0, -1], quads = [8, 8], sines = [{ amplitude = 1, wave_vector = [2, 0] }] }", "line 33, column 9", "too steep: their slope reaches 2.000"),
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
    let fan = format!("v 0 0 0\nf{}\n", " 1".repeat(10_000_003));
    folder.write("part.obj", fan);
    let message = folder.error();
    assert!(
        message.starts_with("part.obj, line 2: the mesh has more than 10000000"),
        "{message}"
    );
}

#[test]
fn materials_come_from_the_mtl_file_where_the_scene_names_none() {
    let folder = Folder::new();
    folder.write(
        "scene.toml",
        SCENE.replace("material = \"steel\"", "blocks_light = false"),
    );
    let obj =
        format!("{OBJ}g a\nusemtl chalk\nf 1 2 3\ng b\nf 2 3 4\ng c\nusemtl chrome\nf 1 3 4\n");
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

#[test]
fn environments_are_read_from_both_formats() {
    let folder = Folder::new();
    write_exr(&folder.path("sky.exr"), |x, y| (x as f32, y as f32, 0.5));
    folder.write("scene.toml", SCENE.replace("sky.hdr", "sky.exr"));
    let loaded = folder.load().unwrap_or_else(|e| panic!("{e}"));
    let LightKind::Environment { map, .. } = &loaded.scene.lights[1].kind else {
        panic!("the second light is the sky");
    };
    assert_eq!((map.width, map.height), (4, 2));
    assert_eq!(map.radiance[6], [2.0, 1.0, 0.5]);

    // EXPOSURE is what the pixels were multiplied by.
    let content = hdr(2, 1, &[[1.0; 3]; 2]);
    let header = b"#?RADIANCE\n".len();
    let exposed = [&content[..header], b"EXPOSURE=4\n", &content[header..]].concat();
    folder.write("sky.hdr", exposed);
    folder.write("scene.toml", SCENE);
    let loaded = folder.load().unwrap_or_else(|e| panic!("{e}"));
    let LightKind::Environment { map, .. } = &loaded.scene.lights[1].kind else {
        panic!("the second light is the sky");
    };
    assert_eq!(map.radiance, [[0.25; 3]; 2]);
}

#[test]
fn bad_environments_are_refused() {
    let folder = Folder::new();
    folder.write("sky.hdr", "not an image");
    assert!(folder.error().starts_with("sky.hdr: cannot be decoded: "));
    let whole = hdr(16, 8, &[[1.0, 0.5, 0.25]; 128]);
    folder.write("sky.hdr", &whole[..whole.len() - 20]);
    assert!(folder.error().starts_with("sky.hdr: cannot be decoded: "));
    let claim = "#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 30000 +X 30000\n";
    folder.write("sky.hdr", claim);
    let message = folder.error();
    assert!(
        message.starts_with("sky.hdr: 30000 x 30000 pixels are too many"),
        "{message}"
    );
    folder.write("sky.hdr", claim.replace("30000", "16384"));
    let message = folder.error();
    assert!(
        message.starts_with("sky.hdr: 16384 x 16384 pixels are too many"),
        "{message}"
    );
    folder.write("sky.hdr", claim.replace("30000", "0"));
    assert!(folder.error().starts_with("sky.hdr: "));
    folder.write("sky.hdr", "");
    assert!(folder.error().starts_with("sky.hdr: cannot be decoded: "));

    folder.write("scene.toml", SCENE.replace("sky.hdr", "sky.png"));
    folder.write("sky.png", &whole);
    assert!(
        folder
            .error()
            .starts_with("sky.png: an environment is an .hdr or .exr image")
    );

    folder.write("scene.toml", SCENE.replace("sky.hdr", "sky.exr"));
    for bad in [f32::NAN, f32::INFINITY, -1.0] {
        let one_bad = |x, y| (1.0, if (x, y) == (3, 1) { bad } else { 1.0 }, 1.0);
        write_exr(&folder.path("sky.exr"), one_bad);
        let message = folder.error();
        assert!(
            message.starts_with("sky.exr, column 3, row 1 "),
            "{message}"
        );
        assert!(message.contains("is not a radiance"), "{message}");
    }
    write_exr(&folder.path("sky.exr"), |_, _| (1.0, 1.0, 1.0));
    folder.load().unwrap_or_else(|e| panic!("{e}"));
    let whole = fs::read(folder.path("sky.exr")).unwrap();
    folder.write("sky.exr", &whole[..whole.len() - 8]);
    assert!(folder.error().starts_with("sky.exr: cannot be decoded: "));
}

#[test]
fn radiance_beyond_what_can_be_added_up_is_refused() {
    let folder = Folder::new();
    folder.write("scene.toml", SCENE.replace("sky.hdr", "sky.exr"));
    write_exr(&folder.path("sky.exr"), |_, _| (1.0, 9e29, 1.0));
    folder.load().unwrap_or_else(|e| panic!("{e}"));
    let scaled = SCENE.replace("sky.hdr\"", "sky.exr\"\nscale = 2.0");
    folder.write("scene.toml", scaled);
    let message = folder.error();
    for part in [
        "scene.toml, line 19, column 9",
        "9e29 times scale 2",
        "lower the scale",
    ] {
        assert!(message.contains(part), "{message}");
    }
}

#[test]
fn an_environment_of_another_shape_is_taken_with_a_warning() {
    let folder = Folder::new();
    folder.write("sky.hdr", hdr(2, 2, &[[1.0; 3]; 4]));
    let warnings = folder.load().unwrap().warnings;
    assert!(
        warnings.len() == 1 && warnings[0].contains("2 x 2 pixels"),
        "{warnings:?}"
    );
}

/// Replaces, removes or doubles a few ranges of bytes.
fn mutated(content: Vec<u8>) -> impl Strategy<Value = Vec<u8>> {
    let snippets = [
        "nan",
        "-inf",
        "1e308",
        "0",
        "-1",
        "99999999999999999999",
        "\"",
        "[",
        "]",
        "{",
        "#",
        "\n",
        "/",
        "..",
        "[[object]]\n",
        "\u{feff}",
        "é",
        "\t",
    ];
    let bytes = prop_oneof![
        prop::sample::select(snippets.to_vec()).prop_map(|snippet| snippet.as_bytes().to_vec()),
        prop::collection::vec(any::<u8>(), 0..3),
    ];
    let edit = (any::<prop::sample::Index>(), 0..12usize, bytes);
    prop::collection::vec(edit, 1..4).prop_map(move |edits| {
        let mut content = content.clone();
        for (at, removed, bytes) in edits {
            let start = at.index(content.len() + 1);
            let end = (start + removed).min(content.len());
            content.splice(start..end, bytes);
        }
        content
    })
}

/// Loads the scene with one file exchanged: whatever comes of it, it is no panic.
fn load_with(file: &str, content: &[u8]) {
    let folder = Folder::new();
    let mut scene = SCENE.to_owned();
    if file == "part.mtl" || file == "part.obj" {
        scene = scene.replace("material = \"steel\"", "");
    }
    if file == "sky.exr" {
        scene = scene.replace("sky.hdr", "sky.exr");
    }
    folder.write("scene.toml", scene);
    folder.write(file, content);
    if let Ok(loaded) = folder.load() {
        for object in &loaded.scene.objects {
            if let Geometry::Mesh(mesh) = &object.geometry {
                assert!(mesh.positions.iter().all(|position| position.is_finite()));
                assert!(
                    mesh.normals
                        .iter()
                        .all(|normal| (normal.length() - 1.0).abs() < 1e-9)
                );
                let corners = mesh.triangles.iter().flatten();
                assert!(
                    corners
                        .copied()
                        .all(|i| (i as usize) < mesh.positions.len())
                );
            }
        }
    }
}

fn exr_bytes() -> Vec<u8> {
    let folder = TempDir::new().unwrap();
    let path = folder.path().join("sky.exr");
    write_exr(&path, |x, y| (x as f32, y as f32, 1.0));
    fs::read(path).unwrap()
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 400, failure_persistence: None, ..Default::default() })]

    #[test]
    fn mutated_scenes_never_panic(content in mutated(SCENE.into())) {
        load_with("scene.toml", &content);
    }

    #[test]
    fn mutated_meshes_never_panic(content in mutated(OBJ.into())) {
        load_with("part.obj", &content);
    }

    #[test]
    fn mutated_material_libraries_never_panic(content in mutated(MTL.into())) {
        load_with("part.mtl", &content);
    }

    #[test]
    fn mutated_hdr_images_never_panic(content in mutated(hdr(16, 8, &[[1.0, 0.5, 0.25]; 128]))) {
        load_with("sky.hdr", &content);
    }

    #[test]
    fn mutated_exr_images_never_panic(content in mutated(exr_bytes())) {
        load_with("sky.exr", &content);
    }
}

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
        let Geometry::Mesh(mesh) = &scene.objects[0].geometry else {
            panic!("the first object is a mesh");
        };
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

/// What stands still is shared, not copied.
#[test]
fn still_meshes_are_shared() {
    let folder = Folder::new();
    let moving =
        "mesh = \"part.obj\"\nmotion = { keyframes = [{ time = 1 }, { time = 2, scale = 2 }] }\n";
    folder.write("scene.toml", SCENE.replace("mesh = \"part.obj\"\n", moving));
    let animation = folder.load().unwrap().animation;
    let mesh = |time| match &animation.at(time).objects[0].geometry {
        Geometry::Mesh(mesh) => mesh.clone(),
        _ => panic!("the first object is a mesh"),
    };
    assert!(std::sync::Arc::ptr_eq(&mesh(0.0), &mesh(1.0)));
    assert!(!std::sync::Arc::ptr_eq(&mesh(0.0), &mesh(1.5)));
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
