//! Writes pictures of the window: PNG as shown, EXR of the radiance of each side, and what they are of.

use super::capture::Captured;
use super::compare::Difference;
use super::state::State;
use super::technique::Technique;
use nephroid::Result;
use nephroid::image_file::{write_exr, write_png};
use nephroid::output::write_atomically;
use serde_json::json;
use std::path::Path;

/// Writes `path` with the extensions `.png`, `.exr` and `.json`, and `.b.exr` if there is a side B.
///
/// # Errors
/// [`nephroid::Error::Output`] where a file cannot be written.
pub fn write(path: &Path, captured: &Captured, state: &mut State) -> Result<()> {
    let [width, height] = captured.size;
    let camera = state.camera();
    write_png(&path.with_extension("png"), width, height, &captured.rgb)?;
    // As `render` writes it, so that `compare` finds the exposure.
    let comment = format!("radiance, W/m^2/sr; exposure_ev {}", camera.exposure_ev);
    for (radiance, extension) in captured.radiance.iter().zip(["exr", "b.exr"]) {
        write_exr(&path.with_extension(extension), radiance, &[], &comment)?;
    }
    let (antialias, factor) = state.quality.stage(state.stage);
    let settings = |technique: &Technique| {
        let settings = technique.settings();
        let method = match technique.is_reference {
            true => "reference",
            false => settings.method.name(),
        };
        json!({
            "method": method,
            "error": settings.error.map(|error| error * factor),
            "samples": settings.samples,
            "environment_cells": settings.environment_cells,
            "environment_images": settings.environment_images,
            "antialias": antialias,
            "light_map_scale": state.quality.light_map_scale,
        })
    };
    let compare = &state.compare;
    let comparison = compare.is_on.then(|| {
        let difference = |difference: &Difference| {
            json!({
                "of": difference.name(&state.document.base),
                "l1": difference.l1,
                "energy_ratio": difference.energy_ratio,
            })
        };
        let reference = |(receiver, error): &(usize, f64)| {
            json!({ "of": state.document.base.objects[*receiver].name, "error": error })
        };
        json!({
            "b": settings(&compare.techniques[1]),
            "reference_errors": compare.reference.iter().map(reference).collect::<Vec<_>>(),
            "shown": compare.shown(),
            "differences": compare.differences.iter().map(difference).collect::<Vec<_>>(),
        })
    });
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
        "settings": settings(&compare.techniques[0]),
        "overlays": state.overlays,
        "comparison": comparison,
        "device": state.device,
        "version": env!("CARGO_PKG_VERSION"),
        "commit": option_env!("NEPHROID_COMMIT"),
    });
    let text = serde_json::to_string_pretty(&sidecar).expect("the keys are strings");
    write_atomically(&path.with_extension("json"), text.as_bytes())
}
