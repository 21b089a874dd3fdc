//! One file per subcommand. Results go to stdout, progress and the log to stderr.

mod bake;
mod chart;
mod compare;
mod completions;
mod devices;
mod files;
mod gpu_options;
mod reference;
mod render;
mod shipped;
pub mod signals;
mod stress;
pub mod terminal;
mod timeline;
#[cfg(feature = "viewer")]
mod view;
#[cfg(not(feature = "viewer"))]
#[path = "no_view.rs"]
mod view;

use clap::{Parser, Subcommand};
use nephroid::scene::{self, Loaded, MAX_LIGHT_MAP_SIDE, light_map_side};
use nephroid::{Error, Result};
use std::path::Path;
use std::str::FromStr;
use terminal::log_some;

/// Caustics in real time
#[derive(Parser)]
#[command(version, arg_required_else_help = true)]
pub struct Cli {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    View(view::Arguments),
    Render(render::Arguments),
    Bake(bake::Arguments),
    Reference(reference::Arguments),
    Compare(compare::Arguments),
    Stress(stress::Arguments),
    Chart(chart::Arguments),
    Devices(devices::Arguments),
    Completions(completions::Arguments),
}

impl Cli {
    /// Runs the command.
    pub fn run(self) -> Result<()> {
        match self.command {
            Command::View(arguments) => view::run(&arguments),
            Command::Render(arguments) => render::run(&arguments),
            Command::Bake(arguments) => bake::run(&arguments),
            Command::Reference(arguments) => reference::run(&arguments),
            Command::Compare(arguments) => compare::run(&arguments),
            Command::Stress(arguments) => stress::run(&arguments),
            Command::Chart(arguments) => chart::run(&arguments),
            Command::Devices(arguments) => devices::run(&arguments),
            Command::Completions(arguments) => completions::run(&arguments),
        }
    }
}

/// Text of an error in the log. It may name commands, which the library does not know.
pub fn message(error: &Error) -> String {
    match error {
        Error::NoDevice { .. } => format!("{error}; `nephroid devices` lists what is found"),
        Error::Cancelled => signals::STOPPED.into(),
        _ => error.to_string(),
    }
}

/// Exit code of a command that failed. After a signal it depends on the signal.
pub fn exit_code(error: &Error) -> u8 {
    match error {
        Error::Validation { .. } => 1,
        Error::Usage { .. } | Error::Output { .. } => 2,
        Error::Input { .. } => 3,
        Error::NoDevice { .. } | Error::Host { .. } | Error::Window { .. } => 4,
        Error::Device { .. } => 5,
        Error::Frames { .. } => 6,
        Error::Cancelled => signals::exit_code(),
    }
}

/// Size of a light map: `256`, its width with the height in the scene file's proportion, or
/// `256x128`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum LightMapSize {
    Width(u32),
    Both([u32; 2]),
}

impl FromStr for LightMapSize {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let side = |text: &str| {
            let parsed = text.parse().map_err(|_| "a side is no whole number".into());
            parsed
                .and_then(light_map_side)
                .map_err(|reason: String| format!("{reason}; give the width, or WIDTHxHEIGHT"))
        };
        match text.split_once('x') {
            None => Ok(Self::Width(side(text)?)),
            Some((width, height)) => Ok(Self::Both([side(width)?, side(height)?])),
        }
    }
}

impl LightMapSize {
    /// Width and height, given those of the scene file.
    pub fn texels(self, [width, height]: [u32; 2]) -> [u32; 2] {
        match self {
            Self::Both(texels) => texels,
            Self::Width(wanted) => {
                let scaled = f64::from(wanted) * f64::from(height) / f64::from(width);
                [wanted, (scaled.round() as u32).clamp(1, MAX_LIGHT_MAP_SIDE)]
            }
        }
    }
}

/// Loads a scene; warnings go to the log.
pub fn load_scene(path: &Path) -> Result<Loaded> {
    let loaded = scene::load(path)?;
    log_some("warning", &loaded.warnings);
    Ok(loaded)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_map_sizes() {
        let parse = str::parse::<LightMapSize>;
        assert_eq!(parse("64").unwrap().texels([256, 128]), [64, 32]);
        assert_eq!(parse("64x16").unwrap().texels([256, 128]), [64, 16]);
        assert_eq!(parse("1").unwrap().texels([4096, 1]), [1, 1]);
        for bad in [
            "", "0", "64x0", "100000", "-3", "3.5", "64x", "x64", "64x16x2", "nan",
        ] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn command_line_is_consistent() {
        use clap::CommandFactory;
        Cli::command().debug_assert();
    }
}
