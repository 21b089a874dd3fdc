//! One file per subcommand. Results go to stdout, progress and the log to stderr.

mod bake;
mod chart;
mod compare;
mod completions;
mod devices;
mod files;
mod gpu_options;
mod job;
mod light_map_size;
mod reference;
mod render;
mod report;
mod session;
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

use clap::{CommandFactory, Parser, Subcommand};
use nephroid::{Error, Result};

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
            Command::Completions(arguments) => completions::run(&arguments, Self::command()),
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn command_line_is_consistent() {
        Cli::command().debug_assert();
    }
}
