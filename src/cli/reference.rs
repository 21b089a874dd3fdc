//! `nephroid reference`: ground truth on the CPU.

use super::files::{MapFiles, STANDARD_ERROR, lossy, radiance_comment};
use super::light_map_size::LightMapSize;
use super::render::picture_size;
use super::signals::cancelled;
use super::terminal::{log, log_some, print, print_json, progress_bar};
use super::timeline::{Timeline, each_frame};
use clap::Args;
use indicatif::ProgressBar;
use nephroid::Result;
use nephroid::image_file::{Layer, RgbImage, write_exr};
use nephroid::reference::{
    Cached, FluxReference, Options, Progress, View, cached_caustic, cached_view, caustic,
    flux_balance, to_f32, view,
};
use nephroid::scene::Scene;
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Instant;

/// Compute a receiver's caustic irradiance, or with --view the camera's view, on the CPU as ground truth
///
/// Writes 32-bit float EXR: channels R, G, B, and their standard error as error.R, error.G, error.B. A light
/// map is the light that met specular surfaces, at most the scene's `max_interfaces`, in W/m²; its last row is
/// at v = 0, column 0 at u = 0. A view is the mean radiance of every pixel's box in W/m²/sr: direct light, caustics on receivers,
/// and paths of the camera through up to 12 mirrors and interfaces.
#[derive(Args)]
pub struct Arguments {
    #[command(flatten)]
    map: MapFiles,
    #[command(flatten)]
    timeline: Timeline,
    /// Compute the camera's view in place of a light map
    #[arg(long, conflicts_with_all = ["receiver", "lightmap"])]
    view: bool,
    /// Size of the view in pixels, WIDTHxHEIGHT
    #[arg(long, default_value = "1280x720", requires = "view", value_parser = picture_size)]
    size: [u32; 2],
    /// Relative L1 error to reach: Σ|error| / ΣE as expected from the standard errors
    #[arg(long, default_value_t = Options::default().error)]
    error: f64,
    /// Size of the light map in texels: the width, with the height in the scene file's proportion, or
    /// WIDTHxHEIGHT
    #[arg(long)]
    lightmap: Option<LightMapSize>,
    /// Stop after about this many rays, at least one round of about a quarter of a million per light, even if the error is larger than
    /// requested
    #[arg(long, default_value_t = Options::default().max_samples, value_parser = clap::value_parser!(u64).range(1..))]
    max_samples: u64,
    /// Seed of the random points; the same seed gives the same bits
    #[arg(long, default_value_t = Options::default().seed)]
    seed: u32,
    /// Neither read the reference from the cache nor store it there
    #[arg(long)]
    no_cache: bool,
    /// Print the summary as JSON
    #[arg(long)]
    json: bool,
}

/// The quantity to compute.
#[derive(Clone, Copy)]
enum Subject {
    /// The light map of the object with this index.
    LightMap {
        receiver: usize,
        texels: [u32; 2],
    },
    View {
        size: [u32; 2],
    },
}

/// The summary that is printed at the end.
#[derive(Default, Serialize)]
struct Summary {
    #[serde(serialize_with = "lossy")]
    file: PathBuf,
    /// For a light map: name of the receiver.
    #[serde(skip_serializing_if = "Option::is_none")]
    receiver: Option<String>,
    width: u32,
    height: u32,
    relative_error: f64,
    samples: u64,
    /// Whether it comes from the cache of an earlier run.
    from_cache: bool,
    /// For a light map: flux in red, green and blue, W.
    #[serde(skip_serializing_if = "Option::is_none")]
    received_flux: Option<[f64; 3]>,
    /// For a light map: its standard error, W.
    #[serde(skip_serializing_if = "Option::is_none")]
    received_flux_error: Option<[f64; 3]>,
    /// For a light map, with `--json`: where the light that met mirrors and interfaces ended, W.
    #[serde(skip_serializing_if = "Option::is_none")]
    flux_balance: Option<FluxReference>,
    /// For a view: exposure, EV.
    #[serde(skip_serializing_if = "Option::is_none")]
    exposure_ev: Option<f64>,
    seconds: f64,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let files = &arguments.map.files;
    let shots = files.shots(&arguments.timeline, &["exr"])?;
    let animation = files.load(&shots)?.animation;
    let scene = animation.at(shots[0].time);
    let subject = arguments.subject(&scene)?;
    let cancel = cancelled();
    if arguments.timeline.is_sequence() {
        let frames = each_frame(&shots, cancel, |shot| {
            let scene = animation.at(shot.time);
            make(arguments, &scene, subject, &shot.file, &mut |_| {}, cancel)
        })?;
        return match arguments.json {
            true => print_json(&serde_json::json!({ "frames": frames })),
            false => frames.iter().try_for_each(Summary::print),
        };
    }
    let bar = progress_bar(BAR as u64);
    let mut progress = |progress: &Progress| show(&bar, progress);
    let file = &shots[0].file;
    let made = make(arguments, &scene, subject, file, &mut progress, cancel);
    bar.finish_and_clear();
    let summary = made?;
    match arguments.json {
        true => print_json(&summary),
        false => summary.print(),
    }
}

impl Arguments {
    fn subject(&self, scene: &Scene) -> Result<Subject> {
        if self.view {
            return Ok(Subject::View { size: self.size });
        }
        let (receiver, texels) = self.map.find_receiver(scene)?;
        let texels = (self.lightmap).map_or(texels, |size| size.texels(texels));
        Ok(Subject::LightMap { receiver, texels })
    }
}

/// A light map or a view, ready to be written.
struct Made {
    image: RgbImage,
    standard_error: Vec<[f32; 3]>,
    /// Comment of the file: quantity and unit of the values.
    comment: String,
    summary: Summary,
    warnings: Vec<String>,
}

/// Solves one frame and writes it.
fn make(
    arguments: &Arguments,
    scene: &Scene,
    subject: Subject,
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
    let Made {
        image,
        standard_error,
        comment,
        summary,
        warnings,
    } = match (subject, arguments.no_cache) {
        (Subject::LightMap { receiver, texels }, is_new) => {
            let name = scene.objects[receiver].name.clone();
            light_map(
                name,
                match is_new {
                    true => fresh(caustic(
                        scene, receiver, texels, &options, progress, cancel,
                    )?),
                    false => cached_caustic(scene, receiver, texels, &options, progress, cancel)?,
                },
            )
        }
        (Subject::View { size }, is_new) => {
            let exposure_ev = scene.camera.exposure_ev;
            picture(
                exposure_ev,
                match is_new {
                    true => fresh(view(scene, size, &options, progress, cancel)?),
                    false => cached_view(scene, size, &options, progress, cancel)?,
                },
            )
        }
    };
    log_some("warning", &warnings);
    if summary.relative_error > options.error {
        let percent = 100.0 * summary.relative_error;
        log(
            "warning",
            &format!(
                "stopped after {} rays with a relative error of {percent:.3} %; raise --max-samples",
                summary.samples
            ),
        );
    }
    let error = Layer {
        name: STANDARD_ERROR,
        pixels: &standard_error,
    };
    let comment = format!(
        "{comment}; relative L1 error {:.3e}; seed {}",
        summary.relative_error, options.seed
    );
    write_exr(file, &image, &[error], &comment)?;
    let counts_flux = arguments.json && matches!(subject, Subject::LightMap { .. });
    Ok(Summary {
        file: file.to_owned(),
        flux_balance: match counts_flux {
            true => flux_balance(scene, options.seed, cancel)?,
            false => None,
        },
        seconds: start.elapsed().as_secs_f64(),
        ..summary
    })
}

fn fresh<T>(reference: T) -> Cached<T> {
    Cached {
        reference,
        from_cache: false,
        warnings: Vec::new(),
    }
}

fn light_map(receiver: String, cached: Cached) -> Made {
    let reference = cached.reference;
    Made {
        image: reference.image(),
        standard_error: to_f32(&reference.standard_error),
        comment: "caustic irradiance, W/m^2; error.*: standard error, W/m^2".into(),
        summary: Summary {
            receiver: Some(receiver),
            width: reference.width,
            height: reference.height,
            relative_error: reference.relative_error,
            samples: reference.samples,
            from_cache: cached.from_cache,
            received_flux: Some(reference.received_flux),
            received_flux_error: Some(reference.received_flux_error),
            ..Summary::default()
        },
        warnings: cached.warnings,
    }
}

fn picture(exposure_ev: f64, cached: Cached<View>) -> Made {
    let view = cached.reference;
    Made {
        image: RgbImage {
            width: view.width,
            height: view.height,
            pixels: to_f32(&view.radiance),
        },
        standard_error: to_f32(&view.standard_error),
        comment: format!(
            "{}; error.*: standard error, W/m^2/sr",
            radiance_comment(exposure_ev)
        ),
        summary: Summary {
            width: view.width,
            height: view.height,
            relative_error: view.relative_error,
            samples: view.samples,
            from_cache: cached.from_cache,
            exposure_ev: Some(exposure_ev),
            ..Summary::default()
        },
        warnings: cached.warnings,
    }
}

impl Summary {
    /// Prints it as text.
    fn print(&self) -> Result<()> {
        let how = match self.from_cache {
            true => ", of an earlier run".into(),
            false => format!(" in {:.1} s", self.seconds),
        };
        let what = self.receiver.as_deref().unwrap_or("view");
        let fluxes = self.received_flux.zip(self.received_flux_error);
        let flux = fluxes.map_or(String::new(), |([r, g, b], error)| {
            let error = error.into_iter().fold(0.0, f64::max);
            format!("\nflux   {r:.6} {g:.6} {b:.6} W, standard error {error:.6} W")
        });
        print(&format!(
            "{}: {what} {}x{}\nerror  {:.3} % (L1, expected){flux}\nrays   {:.1} million{how}",
            self.file.display(),
            self.width,
            self.height,
            100.0 * self.relative_error,
            self.samples as f64 / 1e6,
        ))
    }
}

/// Steps of the progress bar.
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
