//! `nephroid reference`: ground truth on the CPU.

use super::files::{MapFiles, lossy};
use super::signals::cancelled;
use super::terminal::{log, log_some, print, print_json, progress_bar};
use super::timeline::{Timeline, each_frame};
use super::{LightMapSize, load_scene};
use clap::Args;
use indicatif::ProgressBar;
use nephroid::Result;
use nephroid::image_file::{Layer, RgbImage, write_exr};
use nephroid::reference::{Cached, Map, Options, Progress, cached_caustic, caustic};
use nephroid::scene::Scene;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Compute a receiver's caustic irradiance on the CPU, as ground truth
///
/// Writes the light that met exactly one specular surface as 32-bit float EXR in W/m²: channels R, G, B,
/// and their standard error as error.R, error.G, error.B. The last row is at v = 0, column 0 at u = 0.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    map: MapFiles,
    #[command(flatten)]
    timeline: Timeline,
    /// Relative L1 error to reach: Σ|error| / ΣE as expected from the standard errors
    #[arg(long, default_value_t = Options::default().error)]
    error: f64,
    /// Size of the light map in texels: the width, with the height in the scene file's proportion, or
    /// WIDTHxHEIGHT
    #[arg(long)]
    lightmap: Option<LightMapSize>,
    /// Stop after about this many rays, at least one round of about a million, even if the error is larger than
    /// requested
    #[arg(long, default_value_t = Options::default().max_samples, value_parser = clap::value_parser!(u64).range(1..))]
    max_samples: u64,
    /// Seed of the random points; the same seed gives the same bits
    #[arg(long, default_value_t = Options::default().seed)]
    seed: u32,
    /// Neither read the reference from the cache nor keep it there
    #[arg(long)]
    no_cache: bool,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
}

/// What is printed at the end.
#[derive(Serialize)]
struct Summary {
    #[serde(serialize_with = "lossy")]
    file: PathBuf,
    receiver: String,
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
    let shots = files.shots(&arguments.timeline, &["exr"])?;
    let animation = load_scene(&files.scene)?.animation;
    let scene = animation.at(shots[0].time);
    let (receiver, texels) = arguments.map.find_receiver(&scene)?;
    let texels = (arguments.lightmap).map_or(texels, |size| size.texels(texels));
    let cancel = cancelled();
    if arguments.timeline.is_sequence() {
        let frames = each_frame(&shots, cancel, |shot| {
            let scene = animation.at(shot.time);
            make(
                arguments,
                &scene,
                (receiver, texels),
                &shot.file,
                &mut |_| {},
                cancel,
            )
        })?;
        return match arguments.json {
            true => print_json(&serde_json::json!({ "frames": frames })),
            false => frames.iter().try_for_each(Summary::print),
        };
    }
    let bar = progress_bar(BAR as u64);
    let mut progress = |progress: &Progress| show(&bar, progress);
    let file = &shots[0].file;
    let made = make(
        arguments,
        &scene,
        (receiver, texels),
        file,
        &mut progress,
        cancel,
    );
    bar.finish_and_clear();
    let summary = made?;
    match arguments.json {
        true => print_json(&summary),
        false => summary.print(),
    }
}

/// Solves one frame and writes it.
fn make(
    arguments: &Arguments,
    scene: &Scene,
    (receiver, texels): (usize, [u32; 2]),
    file: &Path,
    progress: &mut dyn FnMut(&Progress),
    cancel: &AtomicBool,
) -> Result<Summary> {
    let options = Options {
        error: arguments.error,
        max_samples: arguments.max_samples,
        seed: arguments.seed,
    };
    let start = Instant::now();
    let Cached {
        reference,
        from_cache,
        warnings,
    } = match arguments.no_cache {
        true => Cached {
            reference: caustic(scene, receiver, texels, &options, progress, cancel)?,
            from_cache: false,
            warnings: Vec::new(),
        },
        false => cached_caustic(scene, receiver, texels, &options, progress, cancel)?,
    };
    log_some("warning", &warnings);
    if reference.relative_error > options.error {
        let percent = 100.0 * reference.relative_error;
        log(
            "warning",
            &format!(
                "stopped after {} rays with a relative error of {percent:.3} %; raise --max-samples",
                reference.samples
            ),
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
    write_exr(file, &image, &[error], &comment)?;
    Ok(Summary {
        file: file.to_owned(),
        receiver: scene.objects[receiver].name.clone(),
        width: reference.width,
        height: reference.height,
        relative_error: reference.relative_error,
        samples: reference.samples,
        from_cache,
        received_flux: reference.received_flux,
        seconds: start.elapsed().as_secs_f64(),
    })
}

impl Summary {
    /// For a person.
    fn print(&self) -> Result<()> {
        let [r, g, b] = self.received_flux;
        let how = match self.from_cache {
            true => ", of an earlier run".into(),
            false => format!(" in {:.1} s", self.seconds),
        };
        print(&format!(
            "{}: {} {}x{}\nerror  {:.3} % (L1, expected)\nflux   {r:.6} {g:.6} {b:.6} W\nrays   {:.1} million{how}",
            self.file.display(),
            self.receiver,
            self.width,
            self.height,
            100.0 * self.relative_error,
            self.samples as f64 / 1e6,
        ))
    }
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
