//! `nephroid stress`: error where methods fail.

use super::files::{load_scene, make_folder};
use super::shipped;
use super::signals::cancelled;
use super::terminal::{escaped, log, print, progress_bar};
use clap::Args;
use nephroid::gpu::{Context, ContextOptions};
use nephroid::measure::machine;
use nephroid::measure::stress::targets::{self, Precision, Subject, TARGETS};
use nephroid::measure::stress::{
    CONTENDERS, Report, SCHEMA, Sweep, run as measure, sweeps, target_sentence, verdicts, write,
};
use nephroid::{Error, Result};
use std::path::{Path, PathBuf};

/// Sweep through the situations where methods fail
///
/// Writes stress.html, stress.csv and stress.json: error, energy and overshoot of every method over
/// the swept parameter, and text that says where each breaks down; and error targets against what is reached, on the scenes that
/// come with nephroid and on random ones. Ctrl-C keeps what is finished.
#[derive(Args)]
pub struct Arguments {
    /// Folder to write to; created if it does not exist
    #[arg(short, long)]
    output: PathBuf,
    /// Names of the sweeps to run, and `targets` for the error targets; default: all
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
    let subjects =
        match arguments.only.is_empty() || arguments.only.iter().any(|name| name == TARGETS_NAME) {
            true => subjects()?,
            false => Vec::new(),
        };
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
        targets: Vec::new(),
    };
    let cancel = cancelled();
    let of_sweeps: u64 = (sweeps.iter())
        .map(|sweep| sweep.steps(CONTENDERS.len()))
        .sum();
    let bar = progress_bar(of_sweeps + subjects.len() as u64);
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
    let precision = match arguments.quick {
        true => Precision::QUICK,
        false => Precision::FULL,
    };
    for subject in &subjects {
        bar.set_message(format!("targets: {}", escaped(&subject.name)));
        let points = targets::measure(&context, subject, precision, cancel)?;
        report.targets.extend(points);
        write(&report, folder)?;
        bar.inc(1);
    }
    bar.finish_and_clear();
    summarise(&report, folder)
}

/// Name in `--only` for the error targets on the shipped scenes and on random ones.
const TARGETS_NAME: &str = "targets";

/// The receivers of the shipped scenes, if these are found, and of the random scenes.
fn subjects() -> Result<Vec<Subject>> {
    let mut subjects = Vec::new();
    match shipped::all() {
        Err(_) => log(
            "note",
            &format!(
                "error targets are measured on random scenes only: there are no scenes in {}",
                shipped::FOLDER
            ),
        ),
        Ok(files) => {
            for file in files {
                let name = file
                    .file_stem()
                    .unwrap_or(file.as_os_str())
                    .to_string_lossy()
                    .into_owned();
                subjects.extend(targets::subjects(&name, &load_scene(&file)?.scene));
            }
        }
    }
    subjects.extend(targets::random_subjects());
    Ok(subjects)
}

fn chosen(names: &[String], quick: bool) -> Result<Vec<Sweep>> {
    let all = sweeps();
    let mut known: Vec<&str> = all.iter().map(|sweep| sweep.name).collect();
    known.push(TARGETS_NAME);
    if let Some(unknown) = (names.iter()).find(|name| !known.contains(&name.as_str())) {
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
    for target in TARGETS {
        if let Some(sentence) = target_sentence(&report.targets, target) {
            print(&format!("--error {target:<6} {sentence}"))?;
        }
    }
    Ok(())
}
