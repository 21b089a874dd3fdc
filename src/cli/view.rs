//! `nephroid view`: a window on a scene.

use super::files::make_folder;
use super::gpu_options::{budget, method_parser, relative_error};
use super::render::picture_size;
use super::terminal::{print, print_json};
use crate::viewer::{self, Aim, Options, Script, Technique};
use clap::Args;
use nephroid::render::{Method, Settings};
use nephroid::{Error, Result};
use std::path::PathBuf;
use std::time::{Duration, Instant};

/// Open a window on a scene: move the camera, lights and objects, and see what a frame costs
///
/// `?` lists the keys. docs/viewer.md describes the panels and the scripts.
#[derive(Args)]
pub struct Arguments {
    /// Scene file (.toml)
    scene: PathBuf,
    /// Size of the window in pixels, WIDTHxHEIGHT
    #[arg(long, default_value = "1280x720", value_parser = picture_size)]
    size: [u32; 2],
    /// Method that computes the caustic
    #[arg(long, value_parser = method_parser(), default_value = Settings::default().method.name())]
    method: Method,
    /// footprint: relative L1 error to aim for on planar receivers under suns and lamps [default: 0.02]
    #[arg(long, value_parser = relative_error, conflicts_with_all = ["samples", "budget_ms"])]
    error: Option<f32>,
    /// Number of patches to aim for, or of points
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1_000_000_000), conflicts_with = "budget_ms")]
    samples: Option<u32>,
    /// footprint: time that a frame may take, in ms
    #[arg(long, value_name = "MS", value_parser = budget)]
    budget_ms: Option<Duration>,
    /// Index or part of the name of the Vulkan device
    #[arg(long)]
    device: Option<String>,
    /// Run under the Vulkan validation layers; any message is an error
    #[arg(long)]
    validate: bool,
    /// Replay the inputs of a file and report the times of frames
    #[arg(long, value_name = "FILE")]
    script: Option<PathBuf>,
    /// Write every picture to a folder
    #[arg(long, value_name = "DIR")]
    record: Option<PathBuf>,
    /// Print the report as JSON
    #[arg(long)]
    json: bool,
    /// Folder of the shaders' sources, which are compiled again when they change [default: that of the build]
    #[cfg(feature = "dev")]
    #[arg(long, value_name = "DIR", default_value_os_t = viewer::built_from(), hide_default_value = true)]
    shaders: PathBuf,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let start = Instant::now();
    let has_aim = arguments.error.is_some() || arguments.budget_ms.is_some();
    if has_aim && arguments.method != Method::Footprint {
        return Err(Error::Usage {
            reason: format!(
                "{} cannot aim for an error or a time",
                arguments.method.name()
            ),
            remedy: "give --samples, or leave out --method".into(),
        });
    }
    if let Some(folder) = &arguments.record {
        make_folder(folder, &["frame.00000.png"])?;
    }
    let default = Technique::default();
    let aim = match (arguments.error, arguments.samples, arguments.budget_ms) {
        (Some(error), ..) => Aim::Error(error),
        (_, Some(samples), _) => Aim::Samples(samples),
        (.., Some(time)) => Aim::Budget(1e3 * time.as_secs_f32()),
        _ => default.aim,
    };
    let has_script = arguments.script.is_some();
    let options = Options {
        scene: arguments.scene.clone(),
        size: arguments.size,
        technique: Technique {
            method: arguments.method,
            aim,
            ..default
        },
        device: arguments.device.clone(),
        validate: arguments.validate,
        script: arguments.script.as_deref().map(Script::read).transpose()?,
        record: arguments.record.clone(),
        #[cfg(feature = "dev")]
        shaders: arguments.shaders.clone(),
    };
    match viewer::run(options, start)? {
        Some(report) if arguments.json => print_json(&report),
        Some(report) if has_script => print(&report.text()),
        _ => Ok(()),
    }
}
