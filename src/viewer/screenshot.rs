//! Writes pictures of the window: PNG as shown, EXR of the radiance, and what they are of.

use super::capture::Captured;
use super::state::State;
use nephroid::Result;
use nephroid::image_file::{write_exr, write_png};
use nephroid::output::write_atomically;
use serde_json::json;
use std::path::Path;

/// Writes `path` with the extensions `.png`, `.exr` and `.json`.
///
/// # Errors
/// [`nephroid::Error::Output`] where a file cannot be written.
pub fn write(path: &Path, captured: &Captured, state: &mut State) -> Result<()> {
    let [width, height] = captured.size;
    let camera = state.camera();
    write_png(&path.with_extension("png"), width, height, &captured.rgb)?;
    // As `render` writes it, so that `compare` finds the exposure.
    let comment = format!("radiance, W/m^2/sr; exposure_ev {}", camera.exposure_ev);
    write_exr(
        &path.with_extension("exr"),
        &captured.radiance,
        &[],
        &comment,
    )?;
    let (antialias, factor) = state.quality.stage(state.stage);
    let settings = state.quality.settings();
    let sidecar = json!({
        "scene": state.document.path.to_string_lossy(),
        "is_edited": state.document.history.is_edited(),
        "time": state.playback.time,
        "camera": {
            "position": camera.position.to_array(),
            "target": camera.target.to_array(),
            "fov_degrees": camera.fov.to_degrees(),
            "exposure_ev": camera.exposure_ev,
        },
        "size": captured.size,
        "settings": {
            "method": settings.method,
            "error": settings.error.map(|error| error * factor),
            "samples": settings.samples,
            "environment_cells": settings.environment_cells,
            "environment_images": settings.environment_images,
            "antialias": antialias,
            "light_map_scale": state.quality.light_map_scale,
        },
        "device": state.device,
        "version": env!("CARGO_PKG_VERSION"),
        "commit": option_env!("NEPHROID_COMMIT"),
    });
    let text = serde_json::to_string_pretty(&sidecar).expect("the keys are strings");
    write_atomically(&path.with_extension("json"), text.as_bytes())
}
