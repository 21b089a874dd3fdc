//! `nephroid compare`: errors of an image or a sequence.

use super::terminal::{print, print_json};
use clap::Args;
use nephroid::image_file::read_rgb;
use nephroid::measure::{Comparison, SequenceComparison, SequenceMeter, compare};
use nephroid::{Error, Result};
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Compare an EXR image with a reference, or two folders of frames
///
/// L1 = Σ|A − B| / ΣB, L2 = √(Σ(A − B)² / ΣB²) and energy ratio = ΣA / ΣB, over all pixels and the
/// channels R, G, B. In folders, frames with equal names are compared in the order of their
/// names. Flicker = mean |ΔA − ΔB| / mean B, where Δ is the change from one frame to the next.
#[derive(Args)]
pub struct Arguments {
    /// Image, or folder of frames, to compare with the reference
    a: PathBuf,
    /// Reference image of the same size, or folder of reference frames
    b: PathBuf,
    /// Print as JSON; values that are undefined for a black reference are null
    #[arg(long)]
    json: bool,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let (a, b) = (arguments.a.as_path(), arguments.b.as_path());
    if a.is_dir() && b.is_dir() {
        let comparison = sequence(a, b)?;
        match arguments.json {
            true => print_json(&comparison),
            false => print(&describe_sequence(&comparison)),
        }
    } else {
        let comparison = compare(&read_rgb(a)?, &read_rgb(b)?)?;
        match arguments.json {
            true => print_json(&comparison),
            false => print(&describe(&comparison)),
        }
    }
}

fn sequence(a: &Path, b: &Path) -> Result<SequenceComparison> {
    let names = frames(a)?;
    if names != frames(b)? {
        return Err(Error::Usage {
            reason: format!(
                "{} and {} do not hold the same frames",
                a.display(),
                b.display()
            ),
            remedy: "give corresponding .exr files the same names".into(),
        });
    }
    let mut meter = SequenceMeter::default();
    for name in &names {
        meter.push(read_rgb(&a.join(name))?, read_rgb(&b.join(name))?)?;
    }
    Ok(meter.finish())
}

/// Sorted names of the EXR files in a folder.
fn frames(folder: &Path) -> Result<Vec<OsString>> {
    let input = |reason: String| Error::Input {
        file: folder.to_owned(),
        place: None,
        reason,
        remedy: "name a folder with .exr files".into(),
    };
    let mut names = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(|e| input(e.to_string()))? {
        let path = entry.map_err(|e| input(e.to_string()))?.path();
        if path.extension().is_some_and(|extension| extension == "exr") {
            names.extend(path.file_name().map(OsString::from));
        }
    }
    if names.is_empty() {
        return Err(input("it holds no .exr file".into()));
    }
    names.sort();
    Ok(names)
}

fn percent(value: Option<f64>) -> String {
    value.map_or("undefined".into(), |value| {
        format!("{:.4} %", 100.0 * value)
    })
}

fn errors(l1: Option<f64>, l2: Option<f64>, energy_ratio: Option<f64>) -> String {
    let energy_ratio = energy_ratio.map_or("undefined".into(), |ratio| format!("{ratio:.6}"));
    format!(
        "L1            {}\nL2            {}\nenergy ratio  {energy_ratio}",
        percent(l1),
        percent(l2)
    )
}

fn describe(comparison: &Comparison) -> String {
    let worst = &comparison.worst;
    format!(
        "{}\nworst pixel   ({}, {}): {:?}, reference {:?}",
        errors(comparison.l1, comparison.l2, comparison.energy_ratio),
        worst.column,
        worst.row,
        worst.a,
        worst.b
    )
}

fn describe_sequence(comparison: &SequenceComparison) -> String {
    format!(
        "frames        {}\n{}\nflicker       {}",
        comparison.frames.len(),
        errors(comparison.l1, comparison.l2, comparison.energy_ratio),
        percent(comparison.flicker)
    )
}
