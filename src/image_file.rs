//! Images on disk: linear 32-bit float EXR and tone-mapped PNG.

use crate::error::{Error, Result};
use crate::input::{self, refused};
use crate::output::write_atomically;
use crate::scene::memory;
use exr::block::chunk::CompressedBlock;
use exr::compression::Compression;
use exr::math::Vec2;
use exr::meta::header::Header;
use image::codecs::openexr::OpenExrDecoder;
use image::{DynamicImage, ImageDecoder};
use std::io::Cursor;
use std::path::Path;

/// Rows from the top, RGB, linear. A light map's last row is v = 0.
#[derive(Debug, Clone)]
pub struct RgbImage {
    pub width: u32,
    pub height: u32,
    /// `width * height` values.
    pub pixels: Vec<[f32; 3]>,
}

impl RgbImage {
    /// Column and row of the first pixel with a value that is NaN or infinite.
    pub fn first_not_finite(&self) -> Option<[u32; 2]> {
        let index = (self.pixels.iter()).position(|p| !p.iter().all(|v| v.is_finite()))? as u32;
        Some([index % self.width, index / self.width])
    }
}

/// Most pixels on a side of an image that is read.
const MAX_SIDE: u32 = 16_384;
/// Bytes of a file: 32-bit R, G, B and as much again beside them.
const MAX_BYTES: u64 = 8 << 30;
/// Most channels of an EXR layer, and layers of a file.
const MAX_CHANNELS: usize = 128;
const MAX_LAYERS: usize = 64;
/// Bytes of a decoded pixel, with the copy that it is converted to.
const PIXEL_BYTES: u64 = 16 + 12 + 12;

/// Reads the R, G, B channels of an EXR file, in whatever precision it has them.
///
/// # Errors
/// [`Error::Input`] if the file is missing, truncated, not an EXR, too large, or has a value that
/// is not finite; the message names the pixel.
pub fn read_rgb(path: &Path) -> Result<RgbImage> {
    let content = input::read(path, MAX_BYTES)?;
    finite(path, decode_exr(path, content, [MAX_SIDE; 2], PIXEL_BYTES)?)
}

/// Reads the channels `name.R`, `name.G` and `name.B` of an EXR file, which [`write_exr`] writes as a [`Layer`]; `None` where
/// it lacks one of them.
///
/// # Errors
/// As [`read_rgb`].
pub fn read_layer(path: &Path, name: &str) -> Result<Option<RgbImage>> {
    use exr::prelude::{ReadChannels, ReadLayers};
    let damaged = |reason: String| refused(path, &reason, "write the image again");
    let content = input::read(path, MAX_BYTES)?;
    check_exr(&content, [MAX_SIDE; 2], PIXEL_BYTES).map_err(damaged)?;
    let image = (exr::prelude::read()
        .no_deep_data()
        .largest_resolution_level())
    .all_channels()
    .first_valid_layer()
    .all_attributes()
    .from_buffered(Cursor::new(content))
    .map_err(|e| damaged(e.to_string()))?;
    let layer = image.layer_data;
    let channel = |component: &str| {
        let name = format!("{name}.{component}");
        let found =
            (layer.channel_data.list.iter()).find(|channel| channel.name.to_string() == name);
        found.map(|channel| channel.sample_data.values_as_f32())
    };
    let (Some(r), Some(g), Some(b)) = (channel("R"), channel("G"), channel("B")) else {
        return Ok(None);
    };
    let pixels = r.zip(g).zip(b).map(|((r, g), b)| [r, g, b]).collect();
    let (width, height) = (layer.size.width() as u32, layer.size.height() as u32);
    let image = RgbImage {
        width,
        height,
        pixels,
    };
    finite(path, image).map(Some)
}

/// The image of a file, if all its values are finite.
///
/// # Errors
/// [`Error::Input`] that names the pixel.
pub fn finite(path: &Path, image: RgbImage) -> Result<RgbImage> {
    if let Some([x, y]) = image.first_not_finite() {
        return Err(Error::Input {
            file: path.to_owned(),
            place: Some(format!("pixel ({x}, {y})")),
            reason: "a value is not finite".into(),
            remedy: "write the image again without NaN and infinity".into(),
        });
    }
    Ok(image)
}

/// The comment of an EXR file that [`read_rgb`] reads, if it has one.
pub fn read_comment(path: &Path) -> Option<String> {
    let meta_data = exr::meta::MetaData::read_from_file(path, false).ok()?;
    let comment = meta_data
        .headers
        .first()?
        .own_attributes
        .comments
        .as_ref()?;
    Some(comment.to_string())
}

/// The R, G, B channels of an EXR file of at most `most` pixels a side, of which each will take `pixel_bytes`.
/// Values may be anything.
///
/// # Errors
/// [`Error::Input`]
pub(crate) fn decode_exr(
    path: &Path,
    content: Vec<u8>,
    most: [u32; 2],
    pixel_bytes: u64,
) -> Result<RgbImage> {
    let undecodable = |reason: String| {
        let remedy = "export the image again as EXR with R, G and B channels";
        refused(path, &format!("cannot be decoded: {reason}"), remedy)
    };
    if !content.starts_with(&EXR_MAGIC) {
        return Err(refused(path, "it is not an EXR image", "name an EXR file"));
    }
    check_exr(&content, most, pixel_bytes).map_err(undecodable)?;
    let mut decoder =
        OpenExrDecoder::new(Cursor::new(content)).map_err(|e| undecodable(e.to_string()))?;
    let mut limits = image::Limits::no_limits();
    [limits.max_image_width, limits.max_image_height] = most.map(Some);
    (decoder.set_limits(limits)).map_err(|e| undecodable(e.to_string()))?;
    let image = DynamicImage::from_decoder(decoder).map_err(|e| undecodable(e.to_string()))?;
    let image = image.into_rgb32f();
    Ok(RgbImage {
        width: image.width(),
        height: image.height(),
        pixels: image.pixels().map(|pixel| pixel.0).collect(),
    })
}

const EXR_MAGIC: [u8; 4] = [0x76, 0x2f, 0x31, 0x01];

/// Judges what the headers of an EXR file claim, and whether all of its blocks are there, before memory is
/// taken for the pixels: decoders believe the headers.
fn check_exr(content: &[u8], most: [u32; 2], pixel_bytes: u64) -> Result<(), String> {
    // Sums and differences of coordinates stay within 32 bits.
    const FARTHEST: i32 = 1 << 24;
    let reader = exr::block::read(Cursor::new(content), false).map_err(|e| e.to_string())?;
    let headers = reader.headers();
    if headers.len() > MAX_LAYERS {
        return Err(format!(
            "{} layers are more than {MAX_LAYERS}",
            headers.len()
        ));
    }
    let threads = rayon::current_num_threads();
    let mut chunks = 0;
    for header in headers {
        let display = header.shared_attributes.display_window;
        for (what, size, corner) in [
            ("display", display.size, display.position),
            (
                "data",
                header.layer_size,
                header.own_attributes.layer_position,
            ),
        ] {
            let [width, height] = [size.0, size.1];
            if width > most[0] as usize || height > most[1] as usize {
                return Err(format!(
                    "its {what} window has {width} x {height} pixels, and {} x {} are allowed",
                    most[0], most[1]
                ));
            }
            if width == 0 || height == 0 {
                return Err(format!("its {what} window has no pixels"));
            }
            if [corner.0, corner.1]
                .iter()
                .any(|at| at.unsigned_abs() > FARTHEST as u32)
            {
                return Err(format!("its {what} window begins at {corner:?}"));
            }
        }
        if header.deep {
            return Err("it has deep data".into());
        }
        let channels = header.channels.list.len();
        if channels > MAX_CHANNELS {
            return Err(format!("{channels} channels are more than {MAX_CHANNELS}"));
        }
        let block = header.max_block_pixel_size();
        if block.0.max(block.1) > MAX_SIDE as usize {
            return Err(format!("its tiles have {} x {} pixels", block.0, block.1));
        }
        let block = Vec2(block.0, block.1.min(header.layer_size.1));
        let block_bytes = (block.area() * header.channels.bytes_per_pixel) as u64;
        if block_bytes > MAX_BLOCK_BYTES {
            return Err(format!(
                "a block of it has {block_bytes} bytes, and {MAX_BLOCK_BYTES} are allowed"
            ));
        }
        let blocks = header.chunk_count.min(threads + 2) as u64 * block_bytes * BLOCK_COPIES;
        for Vec2(width, height) in [display.size, header.layer_size] {
            let pixels = width as u64 * height as u64 * pixel_bytes;
            memory::check(&format!("{width} x {height} pixels"), pixels + blocks)?;
        }
        chunks += header.chunk_count;
    }
    // Each has an entry of 8 bytes in a table.
    if chunks > content.len() / 8 {
        return Err(format!("the file is too short for its {chunks} blocks"));
    }
    let headers = reader.headers().to_vec();
    for chunk in reader.all_chunks(false).map_err(|e| e.to_string())? {
        let damaged = |e: exr::error::Error| format!("a block is damaged or missing: {e}");
        let chunk = chunk.map_err(damaged)?;
        let header = &headers[chunk.layer_index];
        let dwa = matches!(
            header.compression,
            Compression::DWAA(_) | Compression::DWAB(_)
        );
        if dwa && !dwa_is_sound(header, &chunk.compressed_block).map_err(damaged)? {
            return Err("the head of a block is damaged".into());
        }
    }
    Ok(())
}

/// Whether the sizes that a block in DWA compression begins with are possible ones: the decoder takes as much
/// memory as they say. They are eleven 64-bit counters (`DataSizesSingle` of OpenEXR's
/// `internal_dwa_compressor.h`).
fn dwa_is_sound(header: &Header, block: &CompressedBlock) -> exr::error::Result<bool> {
    // What is inflated: channels without loss, run lengths before and after their decoding, and the
    // coefficients of cosines, those of frequency zero apart.
    const SIZES: [usize; 5] = [1, 6, 7, 8, 9];
    let content = match block {
        CompressedBlock::ScanLine(block) => &block.compressed_pixels_le,
        CompressedBlock::Tile(block) => &block.compressed_pixels_le,
        _ => return Ok(false),
    };
    let place = header.get_block_data_indices(block)?;
    let size = header.get_absolute_block_pixel_coordinates(place)?.size;
    // Pixels that would not become fewer bytes are stored as they are.
    if content.len() == size.area() * header.channels.bytes_per_pixel {
        return Ok(true);
    }
    // Cosines are over 8 x 8 pixels. Up to 4 bytes a value may be stored, and as much again for lengths of runs.
    let values = size.0.next_multiple_of(8) * size.1.next_multiple_of(8);
    let most = (8 * values * header.channels.list.len()) as u64;
    let counters = content.as_chunks().0;
    Ok((SIZES.iter())
        .all(|&at| (counters.get(at)).is_some_and(|size| u64::from_le_bytes(*size) <= most)))
}

/// Maximum size of a block of pixels that is decoded at once.
const MAX_BLOCK_BYTES: u64 = 512 << 20;
/// Bytes that a decoder takes for each byte of a block, at most: 2 to 3 were measured over all compressions.
const BLOCK_COPIES: u64 = 4;

/// Further values for each pixel of an EXR file, as channels `name.R`, `name.G`, `name.B`.
#[derive(Debug, Clone, Copy)]
pub struct Layer<'a> {
    pub name: &'a str,
    pub pixels: &'a [[f32; 3]],
}

/// Writes 32-bit float R, G, B without loss, and `layers` beside them, which readers that want
/// R, G, B only pass over. `comment` says what the values are, with their unit, in ASCII.
///
/// # Errors
/// [`Error::Output`]
pub fn write_exr(path: &Path, image: &RgbImage, layers: &[Layer], comment: &str) -> Result<()> {
    use exr::prelude::{
        AnyChannel, AnyChannels, Encoding, FlatSamples, Image, LayerAttributes, SmallVec,
        WritableImage,
    };
    let size = (image.width as usize, image.height as usize);
    let main = Layer {
        name: "",
        pixels: &image.pixels,
    };
    let mut channels = SmallVec::new();
    for layer in std::iter::once(&main).chain(layers) {
        assert_eq!(layer.pixels.len(), size.0 * size.1, "one value a pixel");
        for (index, component) in ["R", "G", "B"].into_iter().enumerate() {
            let name = match layer.name {
                "" => component.to_owned(),
                name => format!("{name}.{component}"),
            };
            let values = layer.pixels.iter().map(|pixel| pixel[index]).collect();
            let samples = FlatSamples::F32(values);
            channels.push(AnyChannel::new(name.as_str(), samples));
        }
    }
    let mut attributes = LayerAttributes::default();
    let software = concat!(env!("CARGO_PKG_NAME"), " ", env!("CARGO_PKG_VERSION"));
    attributes.software_name = Some(software.into());
    attributes.comments = Some(comment.into());
    let layer = exr::prelude::Layer::new(
        size,
        attributes,
        Encoding::SMALL_LOSSLESS,
        AnyChannels::sort(channels),
    );
    let mut file = Cursor::new(Vec::new());
    (Image::from_layer(layer).write().to_buffered(&mut file)).map_err(|e| Error::Output {
        file: path.to_owned(),
        reason: e.to_string(),
        remedy: "choose a smaller image".into(),
    })?;
    write_atomically(path, &file.into_inner())
}

/// Writes rows from the top of 8-bit sRGB values, three a pixel.
///
/// # Errors
/// [`Error::Output`]
pub fn write_png(path: &Path, width: u32, height: u32, rgb: &[u8]) -> Result<()> {
    let file = encode_png(width, height, rgb).map_err(|e| Error::Output {
        file: path.to_owned(),
        reason: e.to_string(),
        remedy: "choose a smaller image".into(),
    })?;
    write_atomically(path, &file)
}

/// The bytes of the file that [`write_png`] writes.
pub(crate) fn encode_png(width: u32, height: u32, rgb: &[u8]) -> image::ImageResult<Vec<u8>> {
    use image::ImageEncoder;
    let mut file = Vec::new();
    image::codecs::png::PngEncoder::new(&mut file).write_image(
        rgb,
        width,
        height,
        image::ExtendedColorType::Rgb8,
    )?;
    Ok(file)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn gradient() -> RgbImage {
        RgbImage {
            width: 5,
            height: 3,
            pixels: (0..15).map(|i| [i as f32 / 7.0, 1e-30, 3e7]).collect(),
        }
    }

    #[test]
    fn exr_keeps_every_bit_of_the_image_and_its_layers() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.exr");
        let image = gradient();
        let error: Vec<[f32; 3]> = image.pixels.iter().map(|p| p.map(|v| v * 0.01)).collect();
        let layer = Layer {
            name: "error",
            pixels: &error,
        };
        write_exr(&path, &image, &[layer], "irradiance, W/m^2").unwrap();
        let read = read_rgb(&path).unwrap();
        assert_eq!((read.width, read.height), (5, 3));
        assert_eq!(read.pixels, image.pixels);
        let layer = read_layer(&path, "error").unwrap().unwrap();
        assert_eq!((layer.width, layer.height), (5, 3));
        assert_eq!(layer.pixels, error);
        assert!(read_layer(&path, "noise").unwrap().is_none());

        let all = exr::prelude::read_first_flat_layer_from_file(&path).unwrap();
        let names: Vec<String> = (all.layer_data.channel_data.list.iter())
            .map(|channel| channel.name.to_string())
            .collect();
        assert_eq!(names, ["B", "G", "R", "error.B", "error.G", "error.R"]);
        let error_red = &all.layer_data.channel_data.list[5].sample_data;
        assert!(error_red.values_as_f32().eq(error.iter().map(|p| p[0])));
        let attributes = all.layer_data.attributes;
        assert!(
            attributes
                .software_name
                .unwrap()
                .to_string()
                .starts_with("nephroid ")
        );
        assert_eq!(
            attributes.comments.unwrap().to_string(),
            "irradiance, W/m^2"
        );
        assert_eq!(read_comment(&path).as_deref(), Some("irradiance, W/m^2"));
    }

    #[test]
    fn a_value_that_is_not_finite_is_refused_with_its_place() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.exr");
        for bad in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY] {
            let mut image = gradient();
            image.pixels[7][1] = bad;
            write_exr(&path, &image, &[], "").unwrap();
            let message = read_rgb(&path).unwrap_err().to_string();
            assert!(message.contains("pixel (2, 1)"), "{message}");
        }
    }

    #[test]
    fn every_truncated_file_is_refused_and_none_panics() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.exr");
        write_exr(&path, &gradient(), &[], "").unwrap();
        let whole = std::fs::read(&path).unwrap();
        for length in 0..whole.len() {
            std::fs::write(&path, &whole[..length]).unwrap();
            assert!(read_rgb(&path).is_err(), "{length} of {}", whole.len());
        }
    }

    /// A header may claim anything: 789 million columns, which decoders take memory for.
    #[test]
    fn what_headers_claim_is_judged_before_memory_is_taken() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("map.exr");
        write_exr(&path, &gradient(), &[], "").unwrap();
        let whole = std::fs::read(&path).unwrap();
        let window = |name: &str| {
            let key = [name.as_bytes(), b"\0box2i\0\x10\0\0\0"].concat();
            whole.windows(key.len()).position(|at| at == key).unwrap() + key.len()
        };
        let claims = |places: &[(usize, i32)], reason: &str| {
            let mut file = whole.clone();
            for &(at, value) in places {
                file[at..at + 4].copy_from_slice(&value.to_le_bytes());
            }
            std::fs::write(&path, file).unwrap();
            let message = read_rgb(&path).unwrap_err().to_string();
            assert!(message.contains(reason), "{message}");
        };
        let (data, display) = (window("dataWindow"), window("displayWindow"));
        claims(
            &[(data + 8, 789_512_208)],
            "data window has 789512209 x 3 pixels",
        );
        claims(&[(data + 8, 16_384)], "data window has 16385 x 3 pixels");
        claims(
            &[(display + 8, 16_384)],
            "display window has 16385 x 3 pixels",
        );
        // Within the limits, but the file has not so many blocks, or so large ones.
        claims(&[(data + 12, 16_000)], "chunk count");
        claims(&[(data + 8, 16_000)], "cannot be decoded");
        // As many columns as before, far away.
        claims(
            &[(data, 1 << 25), (data + 8, (1 << 25) + 4)],
            "data window begins at",
        );
    }

    #[test]
    fn missing_files_folders_and_other_formats_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        assert!(read_rgb(&folder.path().join("none.exr")).is_err());
        assert!(read_rgb(folder.path()).is_err());
        let png = folder.path().join("picture.exr");
        write_png(&png, 1, 1, &[1, 2, 3]).unwrap();
        let message = read_rgb(&png).unwrap_err().to_string();
        assert!(message.contains("not an EXR"), "{message}");
    }

    #[test]
    fn png_round_trip() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("picture.png");
        let rgb = [255, 0, 0, 0, 128, 7];
        write_png(&path, 2, 1, &rgb).unwrap();
        assert_eq!(image::open(&path).unwrap().into_rgb8().into_raw(), rgb);
    }
}
