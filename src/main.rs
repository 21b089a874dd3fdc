//! The command line: parse, run, exit code.

mod cli;
#[cfg(feature = "viewer")]
mod viewer;

use clap::Parser;
use std::process::ExitCode;

/// Bytes of every thread's stack, whatever `ulimit -s` says: drivers start threads, too.
const STACK: usize = 8 << 20;

fn main() -> ExitCode {
    nephroid::gpu::keep_freed_memory();
    nephroid::gpu::set_stack_of_threads(STACK);
    let run = std::thread::Builder::new().stack_size(STACK).spawn(run);
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
