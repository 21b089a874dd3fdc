//! `nephroid reference`: ground truth on the CPU.

use super::files::MapFiles;
use super::{LightMapSize, cancel_on_ctrl_c, load_scene, print, print_json, progress_bar};
use clap::Args;
use indicatif::ProgressBar;
use nephroid::Result;
use nephroid::image_file::{Layer, RgbImage, write_exr};
use nephroid::reference::{Map, Options, Progress, cached_caustic, caustic};
use serde::Serialize;
use std::path::Path;
use std::time::Instant;

/// Compute a receiver's caustic irradiance on the CPU, as ground truth
///
/// Writes the light that met exactly one specular surface as 32-bit float EXR in W/m²: channels R, G, B,
/// and their standard error as error.R, error.G, error.B. Last row at v = 0, column 0 at u = 0.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    map: MapFiles,
    /// Relative L1 error to reach, Σ|error| / ΣE as expected from the standard errors
    #[arg(long, default_value_t = Options::default().error)]
    error: f64,
    /// Texels of the light map: its width, with the height in the scene file's proportion, or
    /// WIDTHxHEIGHT
    #[arg(long)]
    lightmap: Option<LightMapSize>,
    /// Stop after this many rays, even if the error is larger than asked for
    #[arg(long, default_value_t = Options::default().max_samples)]
    max_samples: u64,
    /// The same seed gives the same bits
    #[arg(long, default_value_t = Options::default().seed)]
    seed: u32,
    /// Compute it even if the same was computed before, and do not keep it
    #[arg(long)]
    no_cache: bool,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
}

/// What is printed at the end.
#[derive(Serialize)]
struct Summary<'a> {
    file: &'a Path,
    receiver: &'a str,
    width: u32,
    height: u32,
    relative_error: f64,
    samples: u64,
    /// Whether an earlier run had computed it.
    from_cache: bool,
    /// W
    received_flux: [f64; 3],
    seconds: f64,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let files = &arguments.map.files;
    files.check_output(&["exr"])?;
    let output = files.output.as_path();
    let scene = load_scene(&files.scene)?;
    let (receiver, texels) = arguments.map.find_receiver(&scene)?;
    let texels = arguments
        .lightmap
        .map_or(texels, |size| size.texels(texels));
    let options = Options {
        error: arguments.error,
        max_samples: arguments.max_samples,
        seed: arguments.seed,
    };
    let start = Instant::now();
    let bar = progress_bar(BAR as u64);
    let mut progress = |progress: &Progress| show(&bar, progress);
    let cancel = cancel_on_ctrl_c();
    let solve = match arguments.no_cache {
        true => caustic,
        false => cached_caustic,
    };
    let result = solve(&scene, receiver, texels, &options, &mut progress, cancel);
    bar.finish_and_clear();
    let reference = result?;
    if reference.relative_error > options.error {
        eprintln!(
            "warning: stopped after {} rays with a relative error of {:.3} %; raise --max-samples",
            reference.samples,
            100.0 * reference.relative_error
        );
    }
    let image = RgbImage {
        width: reference.width,
        height: reference.height,
        pixels: to_f32(&reference.irradiance),
    };
    let error = Layer {
        name: "error",
        pixels: &to_f32(&reference.standard_error),
    };
    let comment = format!(
        "caustic irradiance, W/m^2; error.*: standard error, W/m^2; relative L1 error {:.3e}; seed {}",
        reference.relative_error, options.seed
    );
    write_exr(output, &image, &[error], &comment)?;
    report(
        arguments.json,
        &Summary {
            file: output,
            receiver: &scene.objects[receiver].name,
            width: reference.width,
            height: reference.height,
            relative_error: reference.relative_error,
            samples: reference.samples,
            from_cache: reference.from_cache,
            received_flux: reference.received_flux,
            seconds: start.elapsed().as_secs_f64(),
        },
    );
    Ok(())
}

fn report(json: bool, summary: &Summary) {
    if json {
        return print_json(summary);
    }
    let [r, g, b] = summary.received_flux;
    let how = match summary.from_cache {
        true => ", of an earlier run".into(),
        false => format!(" in {:.1} s", summary.seconds),
    };
    print(&format!(
        "{}: {} {}x{}\nerror  {:.3} % (L1, expected)\nflux   {r:.6} {g:.6} {b:.6} W\nrays   {:.1} million{}",
        summary.file.display(),
        summary.receiver,
        summary.width,
        summary.height,
        100.0 * summary.relative_error,
        summary.samples as f64 / 1e6,
        how,
    ));
}

fn to_f32(map: &Map) -> Vec<[f32; 3]> {
    map.iter()
        .map(|rgb| rgb.map(|value| value as f32))
        .collect()
}

/// Steps of the bar.
const BAR: f64 = 1000.0;

fn show(bar: &ProgressBar, progress: &Progress) {
    bar.set_position((BAR * progress.fraction) as u64);
    let million = progress.samples as f64 / 1e6;
    if progress.relative_error.is_finite() {
        let percent = 100.0 * progress.relative_error;
        bar.set_message(format!("{million:.0} million rays, error {percent:.2} %"));
    } else {
        bar.set_message(format!("{million:.0} million rays"));
    }
}
