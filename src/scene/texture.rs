//! Images of surface colours: PNG and JPEG, sRGB, with mipmaps for the renderer.

use super::memory;
use crate::error::Result;
use crate::input::{self, refused};
use crate::srgb::{decode, encode};
use glam::{DVec2, DVec3};
use image::codecs::jpeg::JpegDecoder;
use image::codecs::png::PngDecoder;
use image::{DynamicImage, ExtendedColorType, ImageDecoder};
use rayon::prelude::*;
use std::io::Cursor;
use std::path::Path;
use std::sync::LazyLock;

/// Most pixels on a side.
const MAX_SIDE: u32 = 8192;
/// Bytes of a file: four 16-bit channels of so many pixels, uncompressed.
const MAX_BYTES: u64 = 512 << 20;
/// Bytes of a pixel at most: decoded with 16-bit channels, converted, and with its mipmaps.
const PIXEL_BYTES: u64 = 8 + 8 + 6;

/// An image whose colours are a surface's, with mipmaps. It repeats in both directions.
#[derive(Debug, Clone, PartialEq)]
pub struct Texture {
    /// The image first, then each half as wide and high (rounded down, at least 1) as the one before, down
    /// to 1 × 1.
    pub levels: Vec<TextureLevel>,
}

/// A mipmap: means of linear values over what a texel covers.
#[derive(Debug, Clone, PartialEq)]
pub struct TextureLevel {
    pub width: u32,
    pub height: u32,
    /// `width * height` RGBA values in rows from the top, encoded by the sRGB transfer function, as
    /// `VK_FORMAT_R8G8B8A8_SRGB` has them. Alpha is 255.
    pub texels: Vec<[u8; 4]>,
}

impl Texture {
    /// The image with its mipmaps. `texels` are `width * height` sRGB values, rows from the top.
    ///
    /// # Panics
    /// Where there are none, or another number of them.
    pub fn new(width: u32, height: u32, texels: Vec<[u8; 4]>) -> Self {
        assert!(width > 0 && height > 0);
        assert_eq!(texels.len(), width as usize * height as usize);
        let mut levels = vec![TextureLevel {
            width,
            height,
            texels,
        }];
        while let Some(next) = levels.last().and_then(TextureLevel::half) {
            levels.push(next);
        }
        Self { levels }
    }

    /// Linear colour at the texture coordinates (u, v), RGB, 0..=1: bilinear between the texels of the
    /// image, which repeats. v = 0 is at the lower edge of the last row, u = 0 at the left edge.
    pub fn colour_at(&self, uv: DVec2) -> DVec3 {
        let level = &self.levels[0];
        let size = [level.width, level.height].map(f64::from);
        let place = |at: f64, side: f64| (at - at.floor()) * side - 0.5;
        let (x, y) = (place(uv.x, size[0]), place(-uv.y, size[1]));
        let texel = |column: f64, row: f64| {
            let column = column.rem_euclid(size[0]) as usize % level.width as usize;
            let row = row.rem_euclid(size[1]) as usize % level.height as usize;
            let [r, g, b, _] = level.texels[row * level.width as usize + column];
            DVec3::from([r, g, b].map(|byte| DECODED[byte as usize]))
        };
        let (left, top) = (x.floor(), y.floor());
        let along = |row| texel(left, row).lerp(texel(left + 1.0, row), x - left);
        along(top).lerp(along(top + 1.0), y - top)
    }
}

impl TextureLevel {
    /// The next level; `None` after a single texel.
    fn half(&self) -> Option<Self> {
        if (self.width, self.height) == (1, 1) {
            return None;
        }
        let [width, height] = [self.width, self.height].map(|side| (side / 2).max(1));
        let columns: Vec<_> = (0..width).map(|i| covered(i, width, self.width)).collect();
        let texels = (0..height)
            .into_par_iter()
            .flat_map_iter(|row| {
                let rows = covered(row, height, self.height);
                columns.iter().map(move |columns| self.mean(columns, &rows))
            })
            .collect();
        Some(Self {
            width,
            height,
            texels,
        })
    }

    /// Mean of texels by their weights, which sum up to 1 in each direction.
    fn mean(&self, columns: &[(u32, f64)], rows: &[(u32, f64)]) -> [u8; 4] {
        let mut sum = [0.0; 3];
        for (row, of_row) in rows {
            for (column, of_column) in columns {
                let index = *row as usize * self.width as usize + *column as usize;
                for (sum, byte) in sum.iter_mut().zip(self.texels[index]) {
                    *sum += of_row * of_column * DECODED[byte as usize];
                }
            }
        }
        let [r, g, b] = sum.map(encode);
        [r, g, b, 255]
    }
}

/// The texels of `side` that texel `index` of `coarse` covers, and the share of it that each makes up.
pub fn covered(index: u32, coarse: u32, side: u32) -> Vec<(u32, f64)> {
    let width = f64::from(side) / f64::from(coarse);
    let (start, end) = (f64::from(index) * width, f64::from(index + 1) * width);
    (start.floor() as u32..(end.ceil() as u32).min(side))
        .map(|i| {
            let overlap = f64::from(i + 1).min(end) - f64::from(i).max(start);
            (i, overlap / width)
        })
        .filter(|(_, share)| *share > 1e-9)
        .collect()
}

/// Linear values of sRGB bytes.
static DECODED: LazyLock<[f64; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| decode(byte as u8)));

/// Reads a PNG or JPEG file, by its content, whatever its name says. Values of 16 bits are rounded to 8;
/// grey becomes RGB. Adds to `warnings` what is odd but usable.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) if the file is no such image, too large, cut short, or in CMYK.
pub fn read(path: &Path, warnings: &mut Vec<String>) -> Result<Texture> {
    let content = input::read(path, MAX_BYTES)?;
    if content.starts_with(b"\x89PNG\r\n\x1a\n") {
        let decoder = PngDecoder::new(Cursor::new(content)).map_err(|e| undecodable(path, &e))?;
        decoded(path, decoder, warnings)
    } else if content.starts_with(&[0xff, 0xd8]) {
        check_jpeg(&content).map_err(|(reason, remedy)| refused(path, &reason, remedy))?;
        let decoder = JpegDecoder::new(Cursor::new(content)).map_err(|e| undecodable(path, &e))?;
        decoded(path, decoder, warnings)
    } else {
        let reason = "it is neither a PNG nor a JPEG image";
        Err(refused(path, reason, "convert it to one of these, in sRGB"))
    }
}

const EXPORT: &str = "export the image again as an RGB image in PNG or JPEG";

fn undecodable(path: &Path, error: &image::ImageError) -> crate::Error {
    refused(path, &format!("cannot be decoded: {error}"), EXPORT)
}

/// Its size is judged before any memory is taken for it.
fn decoded(
    path: &Path,
    mut decoder: impl ImageDecoder,
    warnings: &mut Vec<String>,
) -> Result<Texture> {
    let (width, height) = decoder.dimensions();
    let pixels = format!("{width} x {height} pixels");
    if width > MAX_SIDE || height > MAX_SIDE {
        let reason = format!("{pixels} are too many: at most {MAX_SIDE} x {MAX_SIDE}");
        return Err(refused(path, &reason, "scale the image down"));
    }
    if width == 0 || height == 0 {
        return Err(refused(path, "the image has no pixels", EXPORT));
    }
    memory::check(&pixels, u64::from(width) * u64::from(height) * PIXEL_BYTES)
        .map_err(|reason| refused(path, &reason, memory::REMEDY))?;
    if decoder.original_color_type() == ExtendedColorType::Cmyk8 {
        return Err(refused(path, CMYK, EXPORT));
    }
    let mut limits = image::Limits::no_limits();
    (limits.max_image_width, limits.max_image_height) = (Some(MAX_SIDE), Some(MAX_SIDE));
    decoder
        .set_limits(limits)
        .map_err(|e| undecodable(path, &e))?;
    let image = DynamicImage::from_decoder(decoder).map_err(|e| undecodable(path, &e))?;
    let image = image.into_rgba8();
    let mut texels: Vec<[u8; 4]> = image.pixels().map(|pixel| pixel.0).collect();
    if texels.iter().any(|texel| texel[3] < 255) {
        let path = path.display();
        warnings.push(format!(
            "{path}: the image is transparent in places, which is left out: its colours count"
        ));
    }
    texels.iter_mut().for_each(|texel| texel[3] = 255);
    Ok(Texture::new(width, height, texels))
}

const CMYK: &str = "the image has four inks (CMYK), whose colours depend on the paper";

/// Whether a JPEG file has one or three channels and is whole: the decoder fills up what is missing with grey.
///
/// Walks through the segments (ITU-T T.81, annex B): 0xFF, a code, and where it is not a restart or the end,
/// a length.
fn check_jpeg(content: &[u8]) -> Result<(), (String, &'static str)> {
    const END: u8 = 0xd9;
    let cut_short = || {
        (
            "the file is cut short".to_owned(),
            "copy or export the image again",
        )
    };
    let mut at = 2;
    loop {
        // The data of a scan, in which 0xFF is followed by 0 or a restart, and fill bytes.
        let is_data = |pair: &[u8]| pair[0] != 0xff || matches!(pair[1], 0 | 0xff | 0xd0..=0xd7);
        let rest = content.get(at..).unwrap_or_default();
        let skipped = rest.windows(2).position(|pair| !is_data(pair));
        at += skipped.ok_or_else(cut_short)?;
        let code = content[at + 1];
        if code == END {
            return Ok(());
        }
        let length = content.get(at + 2..at + 4).ok_or_else(cut_short)?;
        let length = usize::from(u16::from_be_bytes([length[0], length[1]]));
        let is_frame = matches!(code, 0xc0..=0xcf) && !matches!(code, 0xc4 | 0xc8 | 0xcc);
        if is_frame {
            // Length, precision, height, width, channels.
            match content.get(at + 9).ok_or_else(cut_short)? {
                1 | 3 => {}
                4 => return Err((CMYK.to_owned(), EXPORT)),
                other => return Err((format!("a JPEG image of {other} channels"), EXPORT)),
            }
        }
        at += 2 + length.max(2);
        if at > content.len() {
            return Err(cut_short());
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error::Error;
    use image::ImageEncoder;
    use image::codecs::jpeg::JpegEncoder;
    use image::codecs::png::PngEncoder;

    fn file(content: &[u8], name: &str) -> (tempfile::TempDir, std::path::PathBuf) {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join(name);
        std::fs::write(&path, content).unwrap();
        (folder, path)
    }

    fn read_bytes(content: &[u8]) -> Result<(Texture, Vec<String>)> {
        let (_folder, path) = file(content, "texture");
        let mut warnings = Vec::new();
        read(&path, &mut warnings).map(|texture| (texture, warnings))
    }

    fn png(width: u32, height: u32, kind: ExtendedColorType, data: &[u8]) -> Vec<u8> {
        let mut content = Vec::new();
        let encoder = PngEncoder::new(&mut content);
        encoder.write_image(data, width, height, kind).unwrap();
        content
    }

    fn reason(content: &[u8]) -> String {
        match read_bytes(content) {
            Err(error @ Error::Input { .. }) => error.to_string(),
            Err(error) => panic!("{error}"),
            Ok(_) => panic!("it was read"),
        }
    }

    #[test]
    fn channels_and_depths_of_png() {
        let rgb = png(2, 1, ExtendedColorType::Rgb8, &[255, 0, 7, 1, 2, 3]);
        let (texture, warnings) = read_bytes(&rgb).unwrap();
        assert_eq!(texture.levels[0].texels, [[255, 0, 7, 255], [1, 2, 3, 255]]);
        assert!(warnings.is_empty());
        let grey = png(2, 1, ExtendedColorType::L8, &[9, 200]);
        let (texture, _) = read_bytes(&grey).unwrap();
        assert_eq!(
            texture.levels[0].texels,
            [[9, 9, 9, 255], [200, 200, 200, 255]]
        );
        // 16 bits are rounded to 8: 257 · 100 is 100.
        let data: Vec<u8> = [25_700u16, 65_535, 0].map(u16::to_ne_bytes).concat();
        let deep = png(1, 1, ExtendedColorType::Rgb16, &data);
        let (texture, _) = read_bytes(&deep).unwrap();
        assert_eq!(texture.levels[0].texels, [[100, 255, 0, 255]]);
        let glass = png(1, 1, ExtendedColorType::Rgba8, &[10, 20, 30, 40]);
        let (texture, warnings) = read_bytes(&glass).unwrap();
        assert_eq!(texture.levels[0].texels, [[10, 20, 30, 255]]);
        assert!(warnings[0].contains("transparent"), "{warnings:?}");
    }

    fn jpeg(kind: ExtendedColorType, channels: usize) -> Vec<u8> {
        let mut content = Vec::new();
        let data: Vec<u8> = (0..32 * 32 * channels).map(|i| (i % 251) as u8).collect();
        let encoder = JpegEncoder::new_with_quality(&mut content, 90);
        encoder.write_image(&data, 32, 32, kind).unwrap();
        content
    }

    #[test]
    fn jpeg_is_read_whole_or_refused() {
        for content in [
            jpeg(ExtendedColorType::Rgb8, 3),
            jpeg(ExtendedColorType::L8, 1),
        ] {
            let (texture, _) = read_bytes(&content).unwrap();
            assert_eq!((texture.levels[0].width, texture.levels.len()), (32, 6));
            for length in 2..content.len() {
                let reason = reason(&content[..length]);
                assert!(reason.contains("cut short"), "{length}: {reason}");
            }
            // Four channels by the frame's header.
            let frame = content
                .windows(2)
                .position(|w| matches!(w, [0xff, 0xc0]))
                .unwrap();
            let mut inks = content.clone();
            inks[frame + 9] = 4;
            assert!(reason(&inks).contains("CMYK"));
        }
    }

    #[test]
    fn every_truncated_png_is_refused_and_none_panics() {
        let data: Vec<u8> = (0..40 * 30 * 3).map(|i| (i * 7 % 256) as u8).collect();
        let whole = png(40, 30, ExtendedColorType::Rgb8, &data);
        // Without the end that says that it is the end, all pixels are there.
        for length in 0..whole.len() - 16 {
            assert!(
                read_bytes(&whole[..length]).is_err(),
                "{length} of {}",
                whole.len()
            );
        }
    }

    #[test]
    fn what_a_header_claims_is_judged_before_memory_is_taken() {
        let mut content = png(1, 1, ExtendedColorType::Rgb8, &[0; 3]);
        // Width and height of the first chunk, with its checksum.
        for side in [30_000u32, 4_000_000] {
            content[16..20].copy_from_slice(&side.to_be_bytes());
            content[20..24].copy_from_slice(&side.to_be_bytes());
            let checksum = crc32fast::hash(&content[12..29]);
            content[29..33].copy_from_slice(&checksum.to_be_bytes());
            let reason = reason(&content);
            let expected = format!("{side} x {side} pixels are too many: at most 8192 x 8192");
            assert!(reason.contains(&expected), "{reason}");
        }
        assert!(reason(b"GIF89a").contains("neither a PNG nor a JPEG"));
        assert!(reason(b"").contains("neither a PNG nor a JPEG"));
    }

    #[test]
    fn mipmaps_are_means_of_linear_values() {
        let texture = Texture::new(
            2,
            2,
            [[0; 4], [255; 4], [255; 4], [0; 4]]
                .map(|[r, g, b, _]| [r, g, b, 255])
                .into(),
        );
        assert_eq!(texture.levels.len(), 2);
        // Half of the light is 188 of 255.
        assert_eq!(texture.levels[1].texels, [[188, 188, 188, 255]]);
        // 5 × 3, 2 × 1, 1 × 1: every texel counts once.
        let one = |lit: usize| {
            let mut texels = vec![[0, 0, 0, 255]; 15];
            texels[lit] = [255; 4];
            Texture::new(5, 3, texels)
        };
        for lit in 0..15 {
            let sizes: Vec<_> = (one(lit).levels.iter())
                .map(|l| (l.width, l.height))
                .collect();
            assert_eq!(sizes, [(5, 3), (2, 1), (1, 1)]);
            let sum: f64 = (one(lit).levels[1].texels.iter())
                .map(|texel| DECODED[texel[0] as usize])
                .sum();
            // Two texels of 7.5 each; bytes round.
            assert!((sum - 1.0 / 7.5).abs() < 0.004, "{lit}: {sum}");
        }
    }

    #[test]
    fn colours_are_bilinear_and_repeat() {
        // Top row black and white, bottom row red and white.
        let texels = vec![[0, 0, 0, 255], [255; 4], [255, 0, 0, 255], [255; 4]];
        let texture = Texture::new(2, 2, texels);
        let near = |u: f64, v: f64, expected: [f64; 3]| {
            let found = texture.colour_at(DVec2::new(u, v));
            assert!(found.distance(expected.into()) < 1e-12, "{u} {v}: {found}");
        };
        // Middles of texels; v goes up.
        near(0.25, 0.75, [0.0; 3]);
        near(0.25, 0.25, [1.0, 0.0, 0.0]);
        near(0.75, 0.25, [1.0; 3]);
        near(0.5, 0.75, [0.5; 3]);
        near(0.25, 0.5, [0.5, 0.0, 0.0]);
        // Across the edges to the other side.
        near(0.0, 0.75, [0.5; 3]);
        near(0.25, 0.0, [0.5, 0.0, 0.0]);
        for [u, v] in [[1.25, 0.75], [-0.75, -2.25], [7.25, 3.75]] {
            near(u, v, [0.0; 3]);
        }
    }
}
