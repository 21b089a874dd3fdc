//! The command line: parse, run, exit code.

mod cli;
#[cfg(feature = "viewer")]
mod viewer;

use clap::Parser;
use nephroid::gpu::{DRIVER_STACK, keep_freed_memory, set_stack_of_threads};
use std::process::ExitCode;
use std::thread::Builder;

fn main() -> ExitCode {
    keep_freed_memory();
    // Whatever `ulimit -s` says: drivers start threads, too.
    set_stack_of_threads(DRIVER_STACK);
    let run = Builder::new().stack_size(DRIVER_STACK).spawn(run);
    run.expect("a thread can be started")
        .join()
        .expect("the thread does not panic")
}

fn run() -> ExitCode {
    let arguments = cli::Cli::parse();
    cli::signals::listen();
    match arguments.run() {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            cli::terminal::log("error", &cli::message(&error));
            ExitCode::from(cli::exit_code(&error))
        }
    }
}
