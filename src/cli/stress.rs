//! `nephroid stress`: error where methods fail.

use super::files::make_folder;
use super::signals::cancelled;
use super::terminal::{log, print, progress_bar};
use clap::Args;
use nephroid::gpu::{Context, ContextOptions};
use nephroid::measure::machine;
use nephroid::measure::stress::{
    CONTENDERS, Report, SCHEMA, Sweep, run as measure, sweeps, verdicts, write,
};
use nephroid::{Error, Result};
use std::path::{Path, PathBuf};

/// Sweep through the situations where methods fail
///
/// Writes stress.html, stress.csv and stress.json: error, energy and overshoot of every method over
/// the swept parameter, and text that says where each breaks down. Ctrl-C keeps the finished sweeps.
#[derive(Args)]
pub struct Arguments {
    /// Folder to write to; created if it does not exist
    #[arg(short, long)]
    output: PathBuf,
    /// Names of the sweeps to run; default: all
    #[arg(long, value_name = "NAME", num_args = 1..)]
    only: Vec<String>,
    /// Quick check with few values, coarse maps and rough references
    #[arg(long)]
    quick: bool,
    /// Index or part of the name of the Vulkan device
    #[arg(long)]
    device: Option<String>,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let sweeps = chosen(&arguments.only, arguments.quick)?;
    let folder = arguments.output.as_path();
    make_folder(folder, &["stress.html"])?;
    let context = Context::new(&ContextOptions {
        device: arguments.device.clone(),
        validate: false,
    })?;
    let mut report = Report {
        schema: SCHEMA,
        nephroid: env!("CARGO_PKG_VERSION").into(),
        date: machine::date(),
        device: context.info().name.clone(),
        driver: context.info().driver.clone(),
        commit: machine::commit(),
        cpu: machine::cpu(),
        quick: arguments.quick,
        sweeps: Vec::new(),
    };
    let cancel = cancelled();
    let bar = progress_bar(
        (sweeps.iter())
            .map(|sweep| sweep.steps(CONTENDERS.len()))
            .sum(),
    );
    for sweep in &sweeps {
        bar.set_message(sweep.name);
        let measured = measure(&context, sweep, &CONTENDERS, &mut || bar.inc(1), cancel);
        if let (Err(_), finished @ 1..) = (&measured, report.sweeps.len()) {
            bar.finish_and_clear();
            log(
                "note",
                &format!(
                    "{}: has the {finished} of {} sweeps that are finished",
                    folder.join("stress.html").display(),
                    sweeps.len()
                ),
            );
        }
        report.sweeps.push(measured?);
        // After each one, so that nothing that happens later loses it.
        write(&report, folder)?;
    }
    bar.finish_and_clear();
    summarise(&report, folder)
}

fn chosen(names: &[String], quick: bool) -> Result<Vec<Sweep>> {
    let all = sweeps();
    if let Some(unknown) = (names.iter()).find(|name| !all.iter().any(|sweep| sweep.name == **name))
    {
        let known: Vec<&str> = all.iter().map(|sweep| sweep.name).collect();
        return Err(Error::Usage {
            reason: format!("there is no sweep called `{unknown}`"),
            remedy: format!("choose from: {}", known.join(", ")),
        });
    }
    let wanted = |sweep: &Sweep| names.is_empty() || names.iter().any(|name| name == sweep.name);
    let chosen = all.into_iter().filter(wanted);
    Ok(match quick {
        true => chosen.map(Sweep::quick).collect(),
        false => chosen.collect(),
    })
}

fn summarise(report: &Report, folder: &Path) -> Result<()> {
    print(&folder.join("stress.html").display().to_string())?;
    print(&format!("device  {} ({})", report.device, report.driver))?;
    for verdict in verdicts(report) {
        let name = &verdict.sweep.name;
        for broken in &verdict.breaks {
            print(&format!(
                "{:<10} {name:<14} {}",
                verdict.method,
                broken.sentence()
            ))?;
        }
    }
    Ok(())
}
