//! Writes the inputs that the targets start from: `seeds FOLDER` makes `FOLDER/TARGET/NAME`.
//!
//! They are small, as executions a second count: the shipped scenes, the first faces of the shipped
//! meshes, and images, points and cache entries that are computed here.

use exr::math::RoundingMode;
use exr::prelude::{
    AnyChannel, AnyChannels, Blocks, Compression, Encoding, FlatSamples, Image, ImageAttributes,
    IntegerBounds, Layer, LayerAttributes, Levels, LineOrder, Vec2, WritableImage, f16,
};
use libfuzzer_sys as _; // defines what instrumented code calls
use nephroid::reference::cache_entry_bytes;
use std::collections::BTreeMap;
use std::fs;
use std::io::Cursor;
use std::path::{Path, PathBuf};

type Seeds = Vec<(String, Vec<u8>)>;

fn main() {
    let folder = PathBuf::from(std::env::args_os().nth(1).expect("the folder to write to"));
    let targets = [
        ("scene", scenes()),
        ("obj", meshes()),
        ("mtl", material_libraries()),
        ("hdr", hdr_images()),
        ("exr", exr_images()),
        ("peers", peers()),
        ("cache", cache_entries()),
    ];
    for (target, seeds) in targets {
        let folder = folder.join(target);
        fs::create_dir_all(&folder).expect("a folder for the seeds");
        for (name, content) in seeds {
            fs::write(folder.join(name), content).expect("a seed can be written");
        }
    }
}

/// Files of a folder in `assets` with their names.
fn assets(folder: &str, extension: &str) -> Seeds {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../assets")
        .join(folder);
    let files = fs::read_dir(folder).expect("the assets are in the repository");
    let mut seeds: Seeds = files
        .map(|file| file.expect("a file of the folder").path())
        .filter(|path| path.extension().is_some_and(|found| found == extension))
        .map(|path| {
            let name = path
                .file_name()
                .expect("a file")
                .to_string_lossy()
                .into_owned();
            (name, fs::read(path).expect("an asset can be read"))
        })
        .collect();
    seeds.sort();
    seeds
}

fn scenes() -> Seeds {
    let mut seeds = assets("scenes", "toml");
    for (_, scene) in &mut seeds {
        let text = String::from_utf8_lossy(scene);
        let lines = text
            .lines()
            .filter(|line| !line.is_empty() && !line.starts_with('#'));
        let text: String = lines.map(|line| format!("{line}\n")).collect();
        // Waves of a few triangles are as good.
        *scene = text.replace("quads = [128, 128]", "quads = [3, 4]").into();
    }
    let moving = include_str!("../../seeds/moving.toml").into();
    seeds.push(("moving.toml".into(), moving));
    seeds
}

fn meshes() -> Seeds {
    let mut seeds = assets("meshes", "obj");
    for (_, mesh) in &mut seeds {
        *mesh = first_faces(&String::from_utf8_lossy(mesh), 12).into();
    }
    let by_hand = [
        (
            "uv.obj",
            "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\nusemtl enamel\nmtllib cup.mtl\nf 1/1 2/2 3/3 4/4\n",
        ),
        (
            "all.obj",
            "\u{feff}o a\ng b c\ns off\nv 0 0 0 1\nv 1 0 0 1 1 1\nv 1 1 0\nv 0.5 .5 1e-3\nv -0 1 0 2\nvn 0 0 0\nvn 0 0 -1\nl 1 2\np 1\nf -5//1 -4//-1 3//2 4//2 5//2\nf 1 2 3\nvp 1\nfoo\n# f\n",
        ),
    ];
    seeds.extend(by_hand.map(|(name, mesh)| (name.into(), mesh.into())));
    seeds
}

/// The first faces of every material of a mesh, with the vertices that they use.
fn first_faces(mesh: &str, most: usize) -> String {
    let numbered = |keyword: &str| -> Vec<&str> {
        mesh.lines()
            .filter(|line| line.starts_with(keyword))
            .collect()
    };
    let tables = [numbered("v "), numbered("vt "), numbered("vn ")];
    let mut used: [BTreeMap<usize, usize>; 3] = Default::default();
    let (mut vertices, mut faces) = (String::new(), String::new());
    let mut count = 0;
    for line in mesh.lines() {
        let (keyword, rest) = line.split_once(' ').unwrap_or((line, ""));
        match keyword {
            "mtllib" | "usemtl" => {
                count = 0;
                faces += &format!("{line}\n");
            }
            "f" if count < most => {
                count += 1;
                faces.push('f');
                for corner in rest.split_whitespace() {
                    let indices = corner.split('/').enumerate().map(|(table, index)| {
                        let Ok(index) = index.parse::<usize>() else {
                            return String::new();
                        };
                        let next = used[table].len() + 1;
                        let new = used[table].entry(index).or_insert_with(|| {
                            vertices += &format!("{}\n", tables[table][index - 1]);
                            next
                        });
                        new.to_string()
                    });
                    let indices: Vec<String> = indices.collect();
                    faces += &format!(" {}", indices.join("/"));
                }
                faces.push('\n');
            }
            _ => {}
        }
    }
    vertices + &faces
}

fn material_libraries() -> Seeds {
    let mut seeds = assets("meshes", "mtl");
    let by_hand = [
        (
            "kinds.mtl",
            "newmtl steel\nKa 0 0 0\nKs .5 .5 .5\nNs 9\nd 1\nillum 5\nnewmtl enamel\nNi 1.5\nTf 1 1 1\nillum 7\n",
        ),
        (
            "left_out.mtl",
            "\u{feff}# c\nnewmtl enamel\nKd 1 0 0.5\nd 0.5\nmap_Kd a.png\nillum 2\n\nnewmtl steel\nKd 1e-1 0 0\nTr 0\n",
        ),
    ];
    seeds.extend(by_hand.map(|(name, library)| (name.into(), library.into())));
    seeds
}

fn hdr_images() -> Seeds {
    let mut seeds = assets("environments", "hdr");
    seeds.retain(|(_, image)| image.len() < 1024);
    for (width, height) in [(4, 2), (16, 8)] {
        let pixels: Vec<image::Rgb<f32>> = (0..width * height)
            .map(|i| image::Rgb([i as f32, 0.5, 1e-3 * i as f32]))
            .collect();
        let mut content = Vec::new();
        let encoder = image::codecs::hdr::HdrEncoder::new(&mut content);
        encoder
            .encode(&pixels, width, height)
            .expect("an image in memory");
        seeds.push((format!("{width}.hdr"), content));
    }
    let header = "#?RADIANCE\nEXPOSURE=2\nCOLORCORR=1 1.5 2\nPIXASPECT=1\nSOFTWARE=x\n# x\nFORMAT=32-bit_rle_rgbe\n\n";
    // Pixels as they are, the old run-length code with its repetition, and the new one.
    let flat = [b"-Y 1 +X 2\n".as_slice(), &[9, 8, 7, 129, 1, 2, 3, 130]].concat();
    let old = [b"-Y 1 +X 9\n".as_slice(), &[9, 8, 7, 129, 1, 1, 1, 8]].concat();
    let runs = [136, 7].repeat(4);
    let new = [b"-Y 1 +X 8\n".as_slice(), &[2, 2, 0, 8], &runs].concat();
    for (name, body) in [("flat.hdr", flat), ("old.hdr", old), ("new.hdr", new)] {
        seeds.push((name.into(), [header.as_bytes(), &body].concat()));
    }
    seeds
}

/// An image of one kind of samples, R, G, B and with them perhaps A.
fn exr_layer(
    name: &str,
    encoding: Encoding,
    size: Vec2<usize>,
    channels: &[&str],
    samples: fn(usize) -> FlatSamples,
) -> Layer<AnyChannels<FlatSamples>> {
    let channels = (channels.iter()).map(|name| AnyChannel::new(*name, samples(size.area())));
    let channels = AnyChannels::sort(channels.collect());
    Layer::new(size, LayerAttributes::named(name), encoding, channels)
}

macro_rules! exr_file {
    ($image:expr) => {{
        let mut file = Cursor::new(Vec::new());
        let image = $image;
        let written = image.write().non_parallel().to_buffered(&mut file);
        written.expect("an image in memory");
        file.into_inner()
    }};
}

fn exr_images() -> Seeds {
    // Runs of equal values, since blocks that would not become smaller are stored as they are.
    let half = |count: usize| {
        FlatSamples::F16((0..count).map(|i| f16::from_f32((i / 16) as f32)).collect())
    };
    let float =
        |count: usize| FlatSamples::F32((0..count).map(|i| 0.1 * (i / 16) as f32).collect());
    let whole = |count: usize| FlatSamples::U32((0..count as u32).map(|i| i / 16).collect());
    let scan_lines = |compression| Encoding {
        compression,
        blocks: Blocks::ScanLines,
        line_order: LineOrder::Increasing,
    };
    let tiles = |compression| Encoding {
        blocks: Blocks::Tiles(Vec2(16, 16)),
        ..scan_lines(compression)
    };
    let mut seeds = Seeds::new();
    let mut add = |name: &str, file: Vec<u8>| seeds.push((format!("{name}.exr"), file));
    let rgb = ["R", "G", "B"];
    let size = Vec2(24, 18);
    for (name, compression) in [
        ("none", Compression::Uncompressed),
        ("rle", Compression::RLE),
        ("zip1", Compression::ZIP1),
        ("zip16", Compression::ZIP16),
        ("piz", Compression::PIZ),
        ("pxr24", Compression::PXR24),
        ("b44", Compression::B44),
        ("b44a", Compression::B44A),
        ("dwaa", Compression::DWAA(None)),
        ("dwab", Compression::DWAB(None)),
    ] {
        let layer = exr_layer("", scan_lines(compression), size, &rgb, half);
        let file = exr_file!(Image::from_layer(layer));
        add(&format!("{name}_half"), file);
        let layer = exr_layer("", tiles(compression), size, &["R", "G", "B", "A"], float);
        let file = exr_file!(Image::from_layer(layer));
        add(&format!("{name}_float_tiles"), file);
    }
    let layer = exr_layer("", scan_lines(Compression::RLE), size, &rgb, whole);
    add("rle_whole", exr_file!(Image::from_layer(layer)));
    let parts = ["left", "right"];
    let layers =
        parts.map(|name| exr_layer(name, scan_lines(Compression::ZIP1), size, &rgb, float));
    let bounds = IntegerBounds::from_dimensions(size);
    let image = Image::from_layers(ImageAttributes::new(bounds), layers);
    add("parts", exr_file!(image));

    let levels: Vec<FlatSamples> = exr::meta::mip_map_levels(RoundingMode::Down, size)
        .map(|(_, size)| float(size.area()))
        .collect();
    let levels = Levels::Mip {
        rounding_mode: RoundingMode::Down,
        level_data: levels,
    };
    let channels = rgb.map(|name| AnyChannel::new(name, levels.clone()));
    let channels = AnyChannels::sort(channels.into_iter().collect());
    let encoding = tiles(Compression::ZIP16);
    let attributes = LayerAttributes::default();
    let layer = Layer::new(size, attributes, encoding, channels);
    add("mip_maps", exr_file!(Image::from_layer(layer)));

    for deep in ["deepscanline", "deeptile"] {
        add(deep, deep_exr(deep));
    }
    seeds
}

/// The header of a deep image of 2 by 2 pixels with no samples, which the crate exr does not write.
fn deep_exr(kind: &str) -> Vec<u8> {
    let mut file = 20_000_630u32.to_le_bytes().to_vec();
    file.extend((2u32 | 0x800).to_le_bytes());
    let mut attribute = |name: &str, kind: &str, value: &[u8]| {
        file.extend([name.as_bytes(), b"\0", kind.as_bytes(), b"\0"].concat());
        file.extend((value.len() as u32).to_le_bytes());
        file.extend(value);
    };
    let words = |words: &[u32]| -> Vec<u8> { words.iter().flat_map(|w| w.to_le_bytes()).collect() };
    let channel = |name: &[u8]| [name, b"\0", &words(&[2, 0, 1, 1])].concat();
    let channels = [b"B", b"G", b"R"].map(|name| channel(name)).concat();
    attribute("channels", "chlist", &[channels, vec![0]].concat());
    attribute("compression", "compression", &[2]);
    attribute("dataWindow", "box2i", &words(&[0, 0, 1, 1]));
    attribute("displayWindow", "box2i", &words(&[0, 0, 1, 1]));
    attribute("lineOrder", "lineOrder", &[0]);
    attribute("pixelAspectRatio", "float", &1f32.to_le_bytes());
    attribute("screenWindowCenter", "v2f", &words(&[0, 0]));
    attribute("screenWindowWidth", "float", &1f32.to_le_bytes());
    attribute("name", "string", b"deep");
    attribute("type", "string", kind.as_bytes());
    attribute("version", "int", &words(&[1]));
    attribute("maxSamplesPerPixel", "int", &words(&[0]));
    let chunks: u32 = if kind == "deeptile" { 1 } else { 2 };
    attribute("chunkCount", "int", &words(&[chunks]));
    if kind == "deeptile" {
        attribute("tiles", "tiledesc", &[words(&[2, 2]), vec![0]].concat());
    }
    file.push(0);
    let first = file.len() as u64 + 8 * u64::from(chunks);
    let length = 28 + 16;
    file.extend((0..u64::from(chunks)).flat_map(|i| (first + i * length).to_le_bytes()));
    for line in 0..chunks {
        file.extend(line.to_le_bytes());
        file.extend([16u64, 0, 0].map(u64::to_le_bytes).concat());
        file.extend([0; 16]);
    }
    file
}

fn peers() -> Seeds {
    let point = |name: &str, end: &str| {
        format!(
            "{{\"name\": \"{name}\", \"version\": \"1.0\", \"hardware\": \"GPU\", \"scene\": \"ring\", \
             \"seconds\": 0.25, \"error\": 3e-2{end}}}"
        )
    };
    let file =
        |points: &[String]| format!("{{\"schema\": 1, \"peers\": [{}]}}", points.join(",\n"));
    let one = point("mapper", ", \"note\": \"100 k photons\"");
    let escaped = point("\\u00e9\\n\\\"", ", \"note\": null");
    vec![
        ("none.json".into(), file(&[]).into()),
        ("one.json".into(), file(std::slice::from_ref(&one)).into()),
        ("two.json".into(), file(&[one, escaped]).into()),
    ]
}

/// In the form that the target takes: sides, what to repair, then the file.
fn cache_entries() -> Seeds {
    let entry = |width: u8, height: u8, repair: u8| -> Vec<u8> {
        let length = cache_entry_bytes([width, height].map(|side| u32::from(side) + 1));
        let values = (0..(length - 32) / 8).flat_map(|i| (i as f64 * 0.1).to_le_bytes());
        let file = [0; 32].into_iter().chain(values);
        [width, height, repair].into_iter().chain(file).collect()
    };
    vec![
        ("sound".into(), entry(1, 2, 2)),
        ("one_texel".into(), entry(0, 0, 3)),
        ("wrong_checksum".into(), entry(1, 1, 0)),
        ("largest".into(), vec![139, 139, 2, 0]),
        ("cut_short".into(), entry(3, 3, 2)[..100].into()),
    ]
}
