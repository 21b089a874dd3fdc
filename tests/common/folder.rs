//! A scene without fault in a folder of its own, to be spoiled: its files, and what loading it says.

use nephroid::Error;
use nephroid::scene::{Geometry, Loaded, Mesh, load};
use std::fs;
use std::path::{Path, PathBuf};
use tempfile::TempDir;

/// A scene without fault.
pub const SCENE: &str = r#"version = 1

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
pub const OBJ: &str = "\
mtllib part.mtl
v 0 0 0
v 1 0 0
v 1 1 0
v 0 1 0
vn 0 0 1
usemtl chrome
f 1//1 2//1 3//1 4//1
";

/// The materials of [`OBJ`].
pub const MTL: &str =
    "newmtl chrome\nKd 0 0 0\nKs 0.9 0.8 0.7\nillum 3\nnewmtl chalk\nKd 0.5 0.4 0.3\n";

/// A folder with the scene above and its files.
pub struct Folder(pub TempDir);

impl Folder {
    pub fn new() -> Self {
        let folder = Self(TempDir::new().unwrap());
        folder.write("scene.toml", SCENE);
        folder.write("part.obj", OBJ);
        folder.write("part.mtl", MTL);
        folder.write("sky.hdr", hdr(2, 1, &[[1.0; 3]; 2]));
        folder
    }

    pub fn path(&self, name: &str) -> PathBuf {
        self.0.path().join(name)
    }

    pub fn write(&self, name: &str, content: impl AsRef<[u8]>) {
        fs::create_dir_all(self.path(name).parent().unwrap()).unwrap();
        fs::write(self.path(name), content).unwrap();
    }

    pub fn load(&self) -> nephroid::Result<Loaded> {
        load(&self.path("scene.toml"))
    }

    /// The message of the error, without the folder, after changing `from` to `to` in a file.
    pub fn error_after(&self, file: &str, from: &str, to: &str) -> String {
        let before = fs::read_to_string(self.path(file)).unwrap();
        assert!(before.contains(from), "{file} has no {from:?}");
        self.write(file, before.replacen(from, to, 1));
        self.error()
    }

    pub fn error(&self) -> String {
        let error = self.load().expect_err("this must not load");
        assert!(matches!(error, Error::Input { .. }), "{error}");
        let message = error.to_string();
        assert!(message.contains("remedy: "), "{message}");
        message.replace(&format!("{}/", self.0.path().display()), "")
    }
}

pub fn hdr(width: usize, height: usize, pixels: &[[f32; 3]]) -> Vec<u8> {
    let pixels: Vec<_> = pixels.iter().map(|rgb| image::Rgb(*rgb)).collect();
    let mut content = Vec::new();
    let encoder = image::codecs::hdr::HdrEncoder::new(&mut content);
    encoder.encode(&pixels, width, height).unwrap();
    content
}

pub fn write_exr(path: &Path, pixel: impl Fn(usize, usize) -> (f32, f32, f32) + Sync) {
    exr::prelude::write_rgb_file(path, 4, 2, pixel).unwrap();
}

pub fn mesh(loaded: &Loaded) -> &Mesh {
    match &loaded.scene.objects[0].geometry {
        Geometry::Mesh(mesh) => mesh,
        _ => panic!("the first object is a mesh"),
    }
}

/// Loads the scene with another `part.obj`.
pub fn load_obj(obj: &str) -> Loaded {
    let folder = Folder::new();
    folder.write("part.obj", obj);
    folder.load().unwrap_or_else(|e| panic!("{e}"))
}

pub fn area(mesh: &Mesh) -> f64 {
    let area = |t: &[u32; 3]| {
        let [a, b, c] = t.map(|i| mesh.positions[i as usize]);
        (b - a).cross(c - a).length() / 2.0
    };
    mesh.triangles.iter().map(area).sum()
}
