//! Images on disk: linear 32-bit float EXR and tone-mapped PNG, written whole or not at all.

use crate::error::{Error, Result};
use std::io::Write;
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

/// A new empty file beside `path` that vanishes unless it is made to replace `path`.
fn temporary_file(path: &Path) -> Result<tempfile::NamedTempFile> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    if path.is_dir() {
        return Err(cannot_write(path, "it is a folder"));
    }
    // The error's own text would name the temporary file.
    tempfile::NamedTempFile::new_in(folder).map_err(|e| cannot_write(path, e.kind()))
}

fn cannot_write(path: &Path, reason: impl ToString) -> Error {
    Error::Output {
        file: path.to_owned(),
        reason: reason.to_string(),
        remedy: "name a file in an existing folder that you may write to".into(),
    }
}

/// Finds out before a long computation whether [`write_atomically`] will work.
///
/// # Errors
/// [`Error::Output`] where the folder is missing or cannot be written.
pub fn check_writable(path: &Path) -> Result<()> {
    temporary_file(path).map(drop)
}

/// Writes `content` to a temporary file beside `path`, then renames it, so that `path` is either
/// the old file or the whole new one.
///
/// # Errors
/// [`Error::Output`] where the folder is missing or cannot be written.
pub fn write_atomically(path: &Path, content: &[u8]) -> Result<()> {
    let mut file = temporary_file(path)?;
    file.write_all(content).map_err(|e| cannot_write(path, e))?;
    #[cfg(unix)]
    {
        // NamedTempFile is private to the user; the result is an ordinary file.
        use std::os::unix::fs::PermissionsExt;
        let ordinary = std::fs::Permissions::from_mode(0o644);
        (file.as_file().set_permissions(ordinary)).map_err(|e| cannot_write(path, e))?;
    }
    file.persist(path).map_err(|e| cannot_write(path, e))?;
    Ok(())
}

/// Most pixels on a side of an image that is read.
const MAX_SIDE: u32 = 16_384;

/// Reads the R, G, B channels of an EXR file, in whatever precision it has them.
///
/// # Errors
/// [`Error::Input`] if the file is missing, truncated, not an EXR, too large, or has a value that
/// is not finite; the message names the pixel.
pub fn read_rgb(path: &Path) -> Result<RgbImage> {
    let input = |place: Option<String>, reason: String, remedy: &str| Error::Input {
        file: path.to_owned(),
        place,
        reason,
        remedy: remedy.into(),
    };
    let unreadable = |reason: String| input(None, reason, "name a readable EXR file");
    let mut reader = image::ImageReader::open(path)
        .and_then(image::ImageReader::with_guessed_format)
        .map_err(|e| unreadable(e.to_string()))?;
    if reader.format() != Some(image::ImageFormat::OpenExr) {
        return Err(unreadable("it is not an EXR image".into()));
    }
    let mut limits = image::Limits::default();
    limits.max_image_width = Some(MAX_SIDE);
    limits.max_image_height = Some(MAX_SIDE);
    // The default of 512 MiB holds less than 8192² pixels.
    limits.max_alloc = Some(8 << 30);
    reader.limits(limits);
    let decoded = reader.decode().map_err(|e| unreadable(e.to_string()))?;
    let decoded = decoded.into_rgb32f();
    let (width, height) = decoded.dimensions();
    let pixels: Vec<[f32; 3]> = decoded.pixels().map(|pixel| pixel.0).collect();
    let image = RgbImage {
        width,
        height,
        pixels,
    };
    if let Some([x, y]) = image.first_not_finite() {
        return Err(input(
            Some(format!("pixel ({x}, {y})")),
            "a value is not finite".into(),
            "write the image again without NaN and infinity",
        ));
    }
    Ok(image)
}

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
    let mut file = std::io::Cursor::new(Vec::new());
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

    #[test]
    fn unwritable_places_are_found_before_the_work() {
        let folder = tempfile::tempdir().unwrap();
        assert!(check_writable(&folder.path().join("map.exr")).is_ok());
        assert!(!folder.path().join("map.exr").exists());
        assert!(check_writable(&folder.path().join("missing/map.exr")).is_err());
        assert!(check_writable(folder.path()).is_err());
    }
}
