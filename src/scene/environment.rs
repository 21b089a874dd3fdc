//! Equirectangular radiance images: Radiance `.hdr` and OpenEXR `.exr`.

use super::{EnvironmentMap, MAX_RADIANCE, memory};
use crate::error::{Error, Result};
use crate::image_file::{RgbImage, decode_exr};
use crate::input::{self, refused};
use image::codecs::hdr::HdrDecoder;
use image::{DynamicImage, ImageDecoder};
use std::io::Cursor;
use std::path::Path;

/// Most pixels across and down.
const MAX_SIZE: [u32; 2] = [8192, 4096];
/// Bytes of a file: four 32-bit channels of so many pixels take half of it.
const MAX_BYTES: u64 = 1 << 30;

/// Reads an environment; adds to `warnings` what is odd but usable.
///
/// # Errors
/// [`Error::Input`] if the file is no such image, too large, cut short, or has a pixel that is
/// not a radiance.
pub fn read(path: &Path, warnings: &mut Vec<String>) -> Result<EnvironmentMap> {
    let extension = path.extension().map(|e| e.to_ascii_lowercase());
    let (image, factor) = match extension.as_deref().and_then(|e| e.to_str()) {
        Some("hdr") => {
            let content = input::read(path, MAX_BYTES)?;
            let decoder =
                HdrDecoder::new(Cursor::new(content)).map_err(|e| undecodable(path, e))?;
            // What the file says its pixels were multiplied by.
            let header = decoder.metadata();
            let exposure = header.exposure.unwrap_or(1.0);
            let (r, g, b) = header.color_correction.unwrap_or((1.0, 1.0, 1.0));
            let factor = [r, g, b].map(|c| c * exposure);
            if !factor.iter().all(|c| c.is_normal() && *c > 0.0) {
                let reason = format!(
                    "EXPOSURE and COLORCORR in its header make {factor:?}, not numbers above 0"
                );
                return Err(refused(
                    path,
                    &reason,
                    "correct the header, or export the image again",
                ));
            }
            (decode_hdr(path, decoder)?, factor)
        }
        Some("exr") => {
            let content = input::read(path, MAX_BYTES)?;
            (
                decode_exr(path, content, MAX_SIZE, memory::PIXEL)?,
                [1.0; 3],
            )
        }
        _ => {
            let reason = "an environment is an .hdr or .exr image";
            return Err(refused(
                path,
                reason,
                "convert it to one of these, keeping it linear",
            ));
        }
    };
    let RgbImage { width, height, .. } = image;
    if width != 2 * height {
        warnings.push(format!(
            "{}: {width} x {height} pixels, but an equirectangular image is twice as wide as high",
            path.display()
        ));
    }
    let mut radiance = Vec::with_capacity(width as usize * height as usize);
    for (index, pixel) in (0u32..).zip(&image.pixels) {
        let (column, row) = (index % width, index / width);
        let rgb = std::array::from_fn(|i| pixel[i] / factor[i]);
        // No range contains NaN.
        if !rgb.iter().all(|value| (0.0..=MAX_RADIANCE).contains(value)) {
            return Err(Error::Input {
                file: path.to_owned(),
                place: Some(format!(
                    "column {column}, row {row} from the top left pixel (0, 0)"
                )),
                reason: format!("{rgb:?} is not a radiance within 0 and {MAX_RADIANCE:e} W/m²/sr"),
                remedy: "repair that pixel, or clamp the image when you export it".into(),
            });
        }
        radiance.push(rgb);
    }
    Ok(EnvironmentMap {
        width,
        height,
        radiance,
    })
}

/// Pixels of an image whose size has been judged before any memory is taken for it.
fn decode_hdr(path: &Path, decoder: HdrDecoder<Cursor<Vec<u8>>>) -> Result<RgbImage> {
    let (width, height) = decoder.dimensions();
    let [most_across, most_down] = MAX_SIZE;
    if width > most_across || height > most_down {
        let reason =
            format!("{width} x {height} pixels are too many: at most {most_across} x {most_down}");
        return Err(refused(path, &reason, "scale the image down"));
    }
    let bytes = u64::from(width) * u64::from(height) * memory::PIXEL;
    memory::check(&format!("{width} x {height} pixels"), bytes)
        .map_err(|reason| refused(path, &reason, memory::REMEDY))?;
    if width == 0 || height == 0 {
        return Err(refused(path, "the image has no pixels", "export it again"));
    }
    let image = DynamicImage::from_decoder(decoder).map_err(|e| undecodable(path, e))?;
    Ok(RgbImage {
        width,
        height,
        pixels: image.into_rgb32f().pixels().map(|pixel| pixel.0).collect(),
    })
}

fn undecodable(path: &Path, error: image::ImageError) -> Error {
    let reason = format!("cannot be decoded: {error}");
    refused(
        path,
        &reason,
        "export the image again as .hdr or .exr with RGB channels",
    )
}
