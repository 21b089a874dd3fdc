//! `nephroid compare`: errors of an image or a sequence.

use super::files::{STANDARD_ERROR, exposure_of, has_extension};
use super::terminal::{log_some, print, print_json};
use clap::Args;
use nephroid::image_file::{read_comment, read_layer, read_rgb};
use nephroid::measure::{
    Comparison, Flip, PIXELS_PER_DEGREE, SequenceComparison, SequenceMeter, TargetComparison,
    compare, compare_with_target, flip, l1_without_noise_of, read_target,
};
use nephroid::{Error, Result};
use serde::Serialize;
use std::ffi::OsString;
use std::path::{Path, PathBuf};

/// Compare an EXR image with a reference, or two folders of frames
///
/// L1 = Σ|A − B| / ΣB, L2 = √(Σ(A − B)² / ΣB²) and energy ratio = ΣA / ΣB, over all pixels and the
/// channels R, G, B. In folders, frames with equal names are compared in the order of their
/// names. Flicker = mean |ΔA − ΔB| / mean B, where Δ is the change from one frame to the next.
///
/// The files of `reference` hold the standard error of every value. Against them, L1 is also printed without the reference's noise, which
/// adds to it.
///
/// For views also FLIP, 0 to 1: the difference that a viewer sees who flips between both pictures, tone-mapped as `render`
/// does with the scene's exposure, on a display of 67 pixels a degree. Views are files that `render` and `reference
/// --view` write; they name the exposure.
///
/// With --normalise, the second image is a target, the picture that a light map should show, and only the distribution of light is
/// compared: both are scaled to the mean 1. The finer of both is averaged to the size of the other.
#[derive(Args)]
pub struct Arguments {
    /// Image, or folder of frames, to compare with the reference
    a: PathBuf,
    /// Reference image of the same size, or folder of reference frames
    b: PathBuf,
    /// Compare with a target picture of any size: EXR, or PNG and JPEG in sRGB
    #[arg(long)]
    normalise: bool,
    /// Exposure for FLIP, in stops, in place of the one that the reference's file names; FLIP is then computed for any
    /// images
    #[arg(long, value_name = "EV", allow_negative_numbers = true, value_parser = exposure)]
    exposure: Option<f64>,
    /// Print as JSON; values that are undefined for a black reference are null
    #[arg(long)]
    json: bool,
}

fn exposure(text: &str) -> Result<f64, String> {
    let value = text
        .parse()
        .ok()
        .filter(|ev: &f64| ev.abs() <= MAX_EXPOSURE);
    value.ok_or(format!("give stops, -{MAX_EXPOSURE} to {MAX_EXPOSURE}"))
}

/// Largest exposure, stops: the limit of a scene's camera.
const MAX_EXPOSURE: f64 = 64.0;

/// Errors of an image; for a view, with FLIP.
#[derive(Serialize)]
struct Report {
    #[serde(flatten)]
    comparison: Comparison,
    /// L1 without the noise of the reference, where its file says how much noise it has.
    #[serde(skip_serializing_if = "Option::is_none")]
    l1_without_noise: Option<f64>,
    #[serde(skip_serializing_if = "Option::is_none")]
    flip: Option<Flip>,
}

/// Errors against a target.
#[derive(Serialize)]
struct TargetReport {
    #[serde(flatten)]
    comparison: TargetComparison,
    flip: Flip,
}

/// Errors of a sequence; for views, with FLIP.
#[derive(Serialize)]
struct SequenceReport {
    #[serde(flatten)]
    comparison: SequenceComparison,
    #[serde(skip_serializing_if = "Option::is_none")]
    flip: Option<SequenceFlip>,
}

/// FLIP of a sequence of views.
#[derive(Serialize)]
struct SequenceFlip {
    /// Mean over all frames.
    mean: f64,
    /// The frame with the largest mean, by the name of its file.
    worst_frame: String,
    frames: Vec<Flip>,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    let (a, b) = (arguments.a.as_path(), arguments.b.as_path());
    if arguments.normalise {
        let report = with_target(a, b, arguments.exposure)?;
        match arguments.json {
            true => print_json(&report),
            false => print(&describe_target(&report)),
        }
    } else if a.is_dir() && b.is_dir() {
        let report = sequence(a, b, arguments.exposure)?;
        match arguments.json {
            true => print_json(&report),
            false => print(&describe_sequence(&report)),
        }
    } else {
        let [image_a, image_b] = [read_rgb(a)?, read_rgb(b)?];
        let report = Report {
            comparison: compare(&image_a, &image_b)?,
            l1_without_noise: (read_layer(b, STANDARD_ERROR)?)
                .and_then(|error| l1_without_noise_of(&image_a, &image_b, &error.pixels)),
            flip: (exposure_for(arguments.exposure, [a, b]))
                .map(|exposure| flip(&image_a, &image_b, exposure))
                .transpose()?,
        };
        match arguments.json {
            true => print_json(&report),
            false => print(&describe(&report)),
        }
    }
}

/// Value at which the mean of both pictures is shown: middle grey.
const MIDDLE_GREY: f64 = 0.18;

fn with_target(a: &Path, b: &Path, exposure: Option<f64>) -> Result<TargetReport> {
    let mut warnings = Vec::new();
    let (map, target) = (read_rgb(a)?, read_target(b, &mut warnings)?);
    log_some("warning", &warnings);
    let (comparison, [map, target]) = compare_with_target(&map, &target)?;
    let flip = flip(&map, &target, exposure.unwrap_or(MIDDLE_GREY.log2()))?;
    Ok(TargetReport { comparison, flip })
}

/// The exposure asked for, or that of the reference if both files are views.
fn exposure_for(asked: Option<f64>, files: [&Path; 2]) -> Option<f64> {
    let [a, b] = files.map(|file| exposure_of(&read_comment(file)?));
    asked.or(a.and(b))
}

fn sequence(a: &Path, b: &Path, exposure: Option<f64>) -> Result<SequenceReport> {
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
    let mut flips = Vec::new();
    for name in &names {
        let files = [a.join(name), b.join(name)];
        let [image_a, image_b] = [read_rgb(&files[0])?, read_rgb(&files[1])?];
        if let Some(exposure) = exposure_for(exposure, [&files[0], &files[1]]) {
            // Where they cannot be compared, the meter says why.
            flips.extend(flip(&image_a, &image_b, exposure).ok());
        }
        meter.push(image_a, image_b)?;
    }
    Ok(SequenceReport {
        comparison: meter.finish(),
        flip: (flips.len() == names.len()).then(|| {
            let worst = (0..flips.len())
                .max_by(|&i, &j| flips[i].mean.total_cmp(&flips[j].mean))
                .expect("a folder has frames");
            SequenceFlip {
                mean: flips.iter().map(|flip| flip.mean).sum::<f64>() / flips.len() as f64,
                worst_frame: names[worst].to_string_lossy().into_owned(),
                frames: flips,
            }
        }),
    })
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
        if has_extension(&path, "exr") {
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

fn describe(report: &Report) -> String {
    let Report {
        comparison,
        l1_without_noise,
        flip,
    } = report;
    let worst = &comparison.worst;
    let without_noise = l1_without_noise.map_or(String::new(), |l1| {
        format!(
            "\n  of it       {} without the reference's noise",
            percent(Some(l1))
        )
    });
    format!(
        "{}{without_noise}\nworst pixel   ({}, {}): {:?}, reference {:?}{}",
        errors(comparison.l1, comparison.l2, comparison.energy_ratio),
        worst.column,
        worst.row,
        worst.a,
        worst.b,
        flip.as_ref().map_or(String::new(), describe_flip)
    )
}

fn describe_target(report: &TargetReport) -> String {
    let TargetReport { comparison, flip } = report;
    let [width, height] = comparison.size;
    let correlation = (comparison.correlation).map_or("undefined".into(), |c| format!("{c:.6}"));
    let worst = &comparison.worst;
    format!(
        "size          {width} x {height}\ncorrelation   {correlation}\nL1            {}\nRMS           {}\
         \nscale         {:.6} of the map for 1 of the target\
         \nworst pixel   ({}, {}): {:?} of the mean, target {:?}{}",
        percent(Some(comparison.l1)),
        percent(Some(comparison.rms)),
        comparison.scale,
        worst.column,
        worst.row,
        worst.a,
        worst.b,
        describe_flip(flip)
    )
}

fn describe_flip(flip: &Flip) -> String {
    let (pixel, region) = (&flip.worst_pixel, &flip.worst_region);
    let share = region.share_of_l1.map_or(String::new(), |share| {
        format!(", {:.1} % of all differences", 100.0 * share)
    });
    format!(
        "\nFLIP          {:.4} (exposure {} EV, {PIXELS_PER_DEGREE:.0} pixels a degree)\
         \n  worst pixel   ({}, {}): {:.4}\
         \n  worst region  columns {} to {}, rows {} to {}: {:.4}{share}",
        flip.mean,
        flip.exposure_ev,
        pixel.column,
        pixel.row,
        pixel.flip,
        region.columns[0],
        region.columns[1],
        region.rows[0],
        region.rows[1],
        region.flip,
    )
}

fn describe_sequence(report: &SequenceReport) -> String {
    let SequenceReport { comparison, flip } = report;
    let flip = flip.as_ref().map_or(String::new(), |flip| {
        format!(
            "\nFLIP          {:.4} (worst frame {})",
            flip.mean, flip.worst_frame
        )
    });
    format!(
        "frames        {}\n{}\nflicker       {}{flip}",
        comparison.frames.len(),
        errors(comparison.l1, comparison.l2, comparison.energy_ratio),
        percent(comparison.flicker)
    )
}
