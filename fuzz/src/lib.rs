//! What every fuzz target does with an input. The test `tests/fuzz_regressions.rs` of nephroid does the same
//! with the inputs in `fuzz/regressions`.

use nephroid::image_file::read_rgb;
use nephroid::measure::chart::read_peers;
use nephroid::reference::{cache_entry_bytes, read_cache_entry};
use nephroid::scene::{LightKind, MAX_RADIANCE, load};
use nephroid::{Error, Result};
use std::fs;
use std::path::PathBuf;
use tempfile::TempDir;

/// A folder with sound files, one of which is replaced by the input.
pub struct Inputs(TempDir);

/// What a scene needs to be one, with room for lights and objects.
const CAMERA: &str = "version = 1
camera = { position = [2, 1.5, 2.5], target = [0, 0, 0], fov_degrees = 40 }
";
const CHALK: &str = "
[[material]]
name = \"chalk\"
kind = \"diffuse\"
albedo = [0.5, 0.5, 0.5]
";
const FLOOR: &str = "
[[object]]
name = \"floor\"
rect = { origin = [-1, 0, 1], edge_u = [2, 0, 0], edge_v = [0, 0, -2] }
material = \"chalk\"
";

/// A tetrahedron with the materials of [`MTL`].
const OBJ: &str = "mtllib cup.mtl
v 0 0 0
v 1 0 0
v 0 1 0
v 0 0 1
usemtl steel
f 1 3 2
f 1 4 3
usemtl enamel
f 1 2 4
f 2 3 4
";
const MTL: &str = "newmtl steel\nKs 0.8 0.8 0.7\nillum 3\nnewmtl enamel\nKd 0.8 0.8 0.8\n";

/// Two pixels of radiance 1.
const HDR: &[u8] =
    b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\x80\x80\x80\x81\x80\x80\x80\x81";

/// Files that the shipped scenes name.
const MESHES: [&str; 9] = [
    "ball",
    "bowl",
    "bumps",
    "cup",
    "dish",
    "half_cylinder",
    "post",
    "pot",
    "ring",
];
const ENVIRONMENTS: [&str; 3] = ["constant", "studio", "sunny"];

impl Inputs {
    /// # Panics
    /// Where the folder for temporary files cannot be written.
    #[allow(clippy::new_without_default)]
    pub fn new() -> Self {
        let folder = Self(TempDir::new().expect("a folder for temporary files"));
        for name in MESHES {
            folder.write(&format!("assets/meshes/{name}.obj"), OBJ);
        }
        folder.write("assets/meshes/cup.mtl", MTL);
        for name in ENVIRONMENTS {
            folder.write(&format!("assets/environments/{name}.hdr"), HDR);
        }
        for frame in ["0.obj", "1.obj"] {
            folder.write(&format!("assets/frames/{frame}"), OBJ);
        }

        let mesh = |keys: &str| format!("{CAMERA}{CHALK}[[object]]\nname = \"part\"\n{keys}");
        let shape = "mesh = \"part.obj\"";
        folder.write("obj/cup.mtl", MTL);
        folder.write("obj/frames/cup.mtl", MTL);
        folder.write(
            "obj/0.toml",
            mesh(&format!("{shape}\nmaterial = \"chalk\"")),
        );
        folder.write("obj/1.toml", mesh(shape));
        folder.write("obj/2.toml", mesh(&format!("{shape}\nlightmap = [16, 16]")));
        folder.write("obj/3.toml", mesh("frames = { folder = \"frames\" }"));

        folder.write("mtl/scene.toml", mesh(shape));
        folder.write("mtl/part.obj", OBJ);
        for extension in ["hdr", "exr"] {
            let sky = format!(
                "[[light]]\nname = \"sky\"\nkind = \"environment\"\nfile = \"sky.{extension}\"\n"
            );
            folder.write(
                &format!("{extension}/scene.toml"),
                format!("{CAMERA}{sky}{CHALK}{FLOOR}"),
            );
        }
        folder
    }

    /// A target by its name, for the test.
    pub fn run(&self, target: &str, input: &[u8]) {
        match target {
            "scene" => self.scene(input),
            "obj" => self.obj(input),
            "mtl" => self.mtl(input),
            "hdr" => self.hdr(input),
            "exr" => self.exr(input),
            "peers" => self.peers(input),
            "cache" => self.cache(input),
            other => panic!("there is no target {other}"),
        }
    }

    pub fn scene(&self, input: &[u8]) {
        self.write("assets/scenes/scene.toml", input);
        self.load("assets/scenes/scene.toml");
    }

    /// The length of the input decides how a scene uses the mesh, so that any OBJ file is an input.
    pub fn obj(&self, input: &[u8]) {
        let scene = input.len() % 4;
        let files = match scene {
            3 => ["obj/frames/0.obj", "obj/frames/1.obj"].as_slice(),
            _ => &["obj/part.obj"],
        };
        for file in files {
            self.write(file, input);
        }
        self.load(&format!("obj/{scene}.toml"));
    }

    pub fn mtl(&self, input: &[u8]) {
        self.write("mtl/cup.mtl", input);
        self.load("mtl/scene.toml");
    }

    pub fn hdr(&self, input: &[u8]) {
        self.write("hdr/sky.hdr", input);
        self.load("hdr/scene.toml");
    }

    /// As an environment, and as an image to be compared.
    pub fn exr(&self, input: &[u8]) {
        let file = self.write("exr/sky.exr", input);
        self.load("exr/scene.toml");
        if let Some(image) = accepted(read_rgb(&file)) {
            assert_eq!(image.pixels.len(), (image.width * image.height) as usize);
            assert_eq!(image.first_not_finite(), None);
        }
    }

    pub fn peers(&self, input: &[u8]) {
        let file = self.write("peers.json", input);
        for peer in accepted(read_peers(&file)).into_iter().flatten() {
            assert!(peer.seconds > 0.0 && peer.error > 0.0);
        }
    }

    /// The input starts with the sides of the light map, a byte each, and one whose lowest bit asks for
    /// a correct length and whose second bit for a correct checksum of the rest, which is the file.
    pub fn cache(&self, input: &[u8]) {
        let Some((&[width, height, repair], file)) = input.split_first_chunk() else {
            return;
        };
        // Up to 16 texels, or up to the largest light map.
        let side = |byte: u8| match byte {
            0..128 => 1 + u32::from(byte % 16),
            _ => 1 << (byte % 14),
        };
        let texels = [side(width), side(height)];
        let length = cache_entry_bytes(texels);
        let mut file = file.to_vec();
        if repair & 1 != 0 && length < 1 << 16 {
            file.resize(length as usize, 0);
        }
        let key = [7; 32];
        if let (true, Some((checksum, data))) =
            (repair & 2 != 0, file.split_first_chunk_mut::<32>())
        {
            *checksum = *blake3::keyed_hash(&key, data).as_bytes();
        }
        let sound = file.len() as u64 == length
            && *blake3::keyed_hash(&key, &file[32..]).as_bytes() == file[..32];
        let file = self.write("entry.bin", file);
        match read_cache_entry(&file, key, texels) {
            Ok(reference) => {
                assert!(sound);
                let reference = reference.expect("the file exists");
                let count = (texels[0] * texels[1]) as usize;
                assert_eq!(reference.irradiance.len(), count);
                assert_eq!(reference.standard_error.len(), count);
            }
            Err(reason) => assert!(!sound && !reason.is_empty()),
        }
    }

    fn write(&self, name: &str, content: impl AsRef<[u8]>) -> PathBuf {
        let path = self.0.path().join(name);
        if fs::write(&path, &content).is_err() {
            let folder = path.parent().expect("a file in a folder");
            fs::create_dir_all(folder).expect("a folder");
            fs::write(&path, content).expect("a temporary file");
        }
        path
    }

    /// Loads a scene. What loads is sound, and stays so when time passes.
    fn load(&self, scene: &str) {
        let Some(loaded) = accepted(load(&self.0.path().join(scene))) else {
            return;
        };
        for scene in [loaded.scene, loaded.animation.at(0.7)] {
            for light in &scene.lights {
                if let LightKind::Environment { map, .. } = &light.kind {
                    assert_eq!(map.radiance.len(), (map.width * map.height) as usize);
                    let mut values = map.radiance.as_flattened().iter();
                    assert!(values.all(|value| (0.0..=MAX_RADIANCE).contains(value)));
                }
            }
            for object in &scene.objects {
                assert!(object.material < scene.materials.len());
                if let Some(mesh) = object.geometry.as_mesh() {
                    assert_eq!(mesh.positions.len(), mesh.normals.len());
                    assert!(mesh.positions.iter().all(|position| position.is_finite()));
                    assert!(mesh.normals.iter().all(|n| (n.length() - 1.0).abs() < 1e-9));
                    let mut corners = mesh.triangles.as_flattened().iter();
                    assert!(corners.all(|corner| (*corner as usize) < mesh.positions.len()));
                }
            }
        }
    }
}

/// What was read, or nothing where the file is refused, as an error of the input and with a remedy.
fn accepted<T>(result: Result<T>) -> Option<T> {
    result
        .map_err(|error| {
            assert!(matches!(error, Error::Input { .. }), "{error}");
            assert!(error.to_string().contains("remedy: "), "{error}");
        })
        .ok()
}
