//! Equirectangular radiance images: Radiance `.hdr` and OpenEXR `.exr`.

use super::EnvironmentMap;
use super::asset::{self, refused};
use crate::error::{Error, Result};
use image::codecs::{hdr::HdrDecoder, openexr::OpenExrDecoder};
use image::{DynamicImage, ImageDecoder, ImageResult};
use std::io::Cursor;
use std::path::Path;

/// Pixels of a side.
const MAX_SIDE: u32 = 16384;
/// Bytes of a file, and of its pixels.
const MAX_BYTES: u64 = 2 << 30;

/// Reads an environment; adds to `warnings` what is odd but usable.
///
/// # Errors
/// [`Error::Input`] if the file is no such image, too large, cut short, or has a pixel that is
/// not a radiance.
pub fn read(path: &Path, warnings: &mut Vec<String>) -> Result<EnvironmentMap> {
    let extension = path.extension().map(|e| e.to_ascii_lowercase());
    let undecodable = |e: image::ImageError| {
        let reason = format!("cannot be decoded: {e}");
        refused(
            path,
            &reason,
            "export the image again as .hdr or .exr with RGB channels",
        )
    };
    let content = || asset::read(path, MAX_BYTES).map(Cursor::new);
    let (image, exposure) = match extension.as_deref().and_then(|e| e.to_str()) {
        Some("hdr") => {
            let decoder = HdrDecoder::new(content()?).map_err(undecodable)?;
            let exposure = decoder.metadata().exposure.unwrap_or(1.0);
            (decode(path, decoder)?, exposure)
        }
        Some("exr") => {
            let decoder = OpenExrDecoder::new(content()?).map_err(undecodable)?;
            (decode(path, decoder)?, 1.0)
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
    let image = image.map_err(undecodable)?.into_rgb32f();
    let (width, height) = image.dimensions();
    if width != 2 * height {
        warnings.push(format!(
            "{}: {width} x {height} pixels, but an equirectangular image is twice as wide as high",
            path.display()
        ));
    }
    let mut radiance = Vec::with_capacity(width as usize * height as usize);
    for (column, row, pixel) in image.enumerate_pixels() {
        // A Radiance file's EXPOSURE is what its pixels were multiplied by.
        let rgb = pixel.0.map(|value| value / exposure);
        if !rgb.iter().all(|value| value.is_finite() && *value >= 0.0) {
            return Err(Error::Input {
                file: path.to_owned(),
                place: Some(format!(
                    "column {column}, row {row} from the top left pixel (0, 0)"
                )),
                reason: format!("{rgb:?} is not a radiance, which is finite and not negative"),
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
fn decode(path: &Path, decoder: impl ImageDecoder) -> Result<ImageResult<DynamicImage>> {
    let (width, height) = decoder.dimensions();
    if width.max(height) > MAX_SIDE || decoder.total_bytes() > MAX_BYTES {
        let reason = format!(
            "{width} x {height} pixels are too many: at most {MAX_SIDE} a side and {} GiB",
            MAX_BYTES >> 30
        );
        return Err(refused(path, &reason, "scale the image down"));
    }
    if width == 0 || height == 0 {
        return Err(refused(path, "the image has no pixels", "export it again"));
    }
    Ok(DynamicImage::from_decoder(decoder))
}
