//! Stress: sweeps through the places where methods fail.
//!
//! A [`Sweep`] is a family of scenes over one parameter. [`run`] renders it with every method at
//! fixed settings and measures each map against the truth:
//!
//! | measure | definition |
//! |---|---|
//! | L1 | Σ\|E − E*\| / ΣE* |
//! | energy ratio | ΣE / ΣE* |
//! | overshoot | max (E − E*) / max E* over all texels |
//! | bad texels | those with a value that is NaN, infinite, or negative where the truth never is |
//! | flicker | mean \|ΔE − ΔE*\| / mean E*, Δ the change from one frame to the next; of sequences |
//! | drift | L1 against the method's own map of the same scene elsewhere; where nothing should change |
//!
//! [`write()`] makes the report, with the [`verdicts`] in words.

mod data;
pub mod glass;
pub mod random;
mod report;
pub mod scenes;
mod sweeps;
mod target_report;
pub mod targets;
mod truth;
mod verdict;

pub use data::{Report, SCHEMA};
pub use report::write;
pub use sweeps::{Sweep, Swept, Truth, sweeps};
pub use target_report::target_sentence;
pub use verdict::{LIMITS, Limit, Verdict, verdicts};

use super::chart::Picture;
use super::{SequenceMeter, compare};
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::image_file::RgbImage;
use crate::render::{Method, Renderer, Settings};
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use truth::TruthMaps;

/// A method at the settings of all sweeps.
pub struct Contender {
    pub method: Method,
    /// Patches or points, see [`Settings::samples`].
    pub samples: u32,
    /// Scenes that need more pairs of patch, texel and sun are left out.
    most_pairs: f64,
}

/// The methods, ours first.
pub const CONTENDERS: [Contender; 4] = [
    contender(Method::Footprint, 16_384, f64::INFINITY),
    contender(Method::Beams, 16_384, f64::INFINITY),
    contender(Method::Points, 1_000_000, f64::INFINITY),
    contender(Method::Pinhole, 1024, 8e7),
];

const fn contender(method: Method, samples: u32, most_pairs: f64) -> Contender {
    Contender {
        method,
        samples,
        most_pairs,
    }
}

/// A pair whose visibility is traced costs about this many without.
const TRACED: f64 = 30.0;

impl Contender {
    fn settings(&self, effort: f64) -> Settings {
        Settings {
            method: self.method,
            samples: (f64::from(self.samples) * effort).round().max(1.0) as u32,
            ..Settings::default()
        }
    }

    /// Whether it follows light from surface to surface, and the work is worth the while.
    fn can(&self, scene: &Scene, texels: u32, effort: f64) -> bool {
        let has_chains = matches!(self.method, Method::Footprint | Method::Points);
        if !has_chains && glass::has_glass(scene) {
            return false;
        }
        let triangles = (scene.objects.iter())
            .filter_map(|object| object.geometry.placement())
            .map(|(mesh, _)| mesh.triangles.len())
            .sum::<usize>() as f64;
        let patches = triangles.max(effort * f64::from(self.samples));
        let traced = scene.objects.iter().any(|object| object.blocks_light);
        let cost = if traced { TRACED } else { 1.0 };
        cost * patches * f64::from(texels).powi(2) * scene.lights.len() as f64 <= self.most_pairs
    }
}

/// What [`run`] found.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SweepReport {
    pub name: String,
    pub title: String,
    /// The scene and how it is measured.
    pub setup: String,
    /// What is swept, with its unit.
    pub axis: String,
    /// By value, the L1 error that the truth itself is expected to have, relative; 0 for a closed
    /// form.
    pub truth_error: Vec<f64>,
    pub values: Vec<f64>,
    pub series: Vec<Series>,
    /// Not part of the JSON.
    #[serde(skip)]
    pub ends: Vec<End>,
}

/// A method's curve.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Series {
    pub method: String,
    pub points: Vec<Point>,
}

/// A method at one value. What cannot be measured is `None`: of a map with a bad texel, of a black
/// truth, of a single frame.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Point {
    pub value: f64,
    /// Patches or points in use.
    pub samples: u32,
    /// Texels on a side of the light map.
    pub light_map: u32,
    pub l1: Option<f64>,
    pub energy_ratio: Option<f64>,
    pub overshoot: Option<f64>,
    pub bad_texels: usize,
    pub flicker: Option<f64>,
    pub drift: Option<f64>,
}

/// Pictures at the first or the last value.
#[derive(Debug, Clone, PartialEq)]
pub struct End {
    pub value: f64,
    pub truth: Picture,
    /// Error at which the colours saturate, W/m².
    pub error_scale: f64,
    /// Method, map and error map.
    pub maps: Vec<(String, Picture, Picture)>,
}

/// Measures methods at all values. Calls `step` after every truth and every method.
///
/// # Errors
/// [`Error::Cancelled`] soon after `cancel` becomes true, [`Error::Device`] where the device fails.
pub fn run(
    context: &Arc<Context>,
    sweep: &Sweep,
    contenders: &[Contender],
    step: &mut dyn FnMut(),
    cancel: &AtomicBool,
) -> Result<SweepReport> {
    let mut report = SweepReport {
        name: sweep.name.into(),
        title: sweep.title.into(),
        setup: sweep.setup.into(),
        axis: sweep.axis.into(),
        truth_error: Vec::new(),
        values: sweep.values.clone(),
        series: Vec::new(),
        ends: Vec::new(),
    };
    for contender in contenders {
        report.series.push(Series {
            method: contender.method.name().into(),
            points: Vec::new(),
        });
    }
    let mut bases: Vec<Option<RgbImage>> = vec![None; contenders.len()];
    let mut truths = TruthMaps::default();
    for (index, &value) in sweep.values.iter().enumerate() {
        let truth = truths.at(sweep, value, cancel)?;
        report.truth_error.push(truth.error);
        step();
        let is_end = index == 0 || index + 1 == sweep.values.len();
        let mut end = is_end.then(|| End::of(value, &truth.maps[0]));
        for (number, contender) in contenders.iter().enumerate() {
            if cancel.load(Ordering::Relaxed) {
                return Err(Error::Cancelled);
            }
            let frames = maps(context, sweep, contender, value)?;
            step();
            let Some((samples, frames)) = frames else {
                continue;
            };
            let base = &mut bases[number];
            if let (None, Some(value)) = (&base, sweep.base) {
                *base = maps(context, sweep, contender, value)?.map(|(_, mut maps)| maps.remove(0));
            }
            if let Some(end) = &mut end {
                end.add(contender.method.name().into(), &frames[0], &truth.maps[0]);
            }
            let measures = measure(frames, &truth.maps, base.as_ref())?;
            report.series[number].points.push(Point {
                value,
                samples,
                light_map: sweep.texels_at(value),
                ..measures
            });
        }
        report.ends.extend(end);
    }
    Ok(report)
}

/// Samples in use and a map a frame; `None` where that would take too long.
fn maps(
    context: &Arc<Context>,
    sweep: &Sweep,
    contender: &Contender,
    value: f64,
) -> Result<Option<(u32, Vec<RgbImage>)>> {
    let effort = sweep.effort_at(value);
    let mut samples = 0;
    let mut maps = Vec::new();
    for frame in 0..sweep.frames {
        let scene = sweep.scene_at(value, frame);
        if !contender.can(&scene, sweep.texels_at(value), effort) {
            return Ok(None);
        }
        let mut renderer = Renderer::new(context, &scene, &contender.settings(effort))?;
        renderer.caustic()?;
        maps.push(renderer.read_caustic(sweep.receiver(&scene))?);
        samples = renderer.samples()?;
    }
    Ok(Some((samples, maps)))
}

/// The measures of a sequence of maps, each as fine as the truth or finer. `base` is what the
/// first should be equal to. Value and settings are left for the caller.
pub fn measure(
    frames: Vec<RgbImage>,
    truths: &[RgbImage],
    base: Option<&RgbImage>,
) -> Result<Point> {
    // Pure spectral colours lie outside of sRGB.
    let values = truths.iter().flat_map(|truth| truth.pixels.as_flattened());
    let least = match values.copied().any(|value| value < 0.0) {
        true => f32::NEG_INFINITY,
        false => 0.0,
    };
    let mut point = Point {
        value: 0.0,
        samples: 0,
        light_map: 0,
        l1: None,
        energy_ratio: None,
        overshoot: None,
        bad_texels: frames.iter().map(|map| bad_texels(map, least)).sum(),
        flicker: None,
        drift: None,
    };
    if (frames.iter()).any(|map| map.first_not_finite().is_some()) {
        return Ok(point);
    }
    if let Some(base) = base {
        point.drift = compare(&frames[0], base)?.l1;
    }
    let mut meter = SequenceMeter::default();
    for (map, truth) in frames.into_iter().zip(truths) {
        let map = pooled(map, truth.width);
        let here = overshoot(&map, truth);
        point.overshoot = here.map(|here| here.max(point.overshoot.unwrap_or(0.0)));
        meter.push(map, truth.clone())?;
    }
    let comparison = meter.finish();
    point.l1 = comparison.l1;
    point.energy_ratio = comparison.energy_ratio;
    point.flicker = comparison.flicker;
    Ok(point)
}

fn bad_texels(map: &RgbImage, least: f32) -> usize {
    let bad = |rgb: &&[f32; 3]| !rgb.iter().all(|v| v.is_finite() && *v >= least);
    map.pixels.iter().filter(bad).count()
}

fn overshoot(map: &RgbImage, truth: &RgbImage) -> Option<f64> {
    let truth = truth.pixels.as_flattened();
    let brightest = truth.iter().fold(0.0f32, |a, b| a.max(*b));
    let over = (map.pixels.as_flattened().iter().zip(truth))
        .map(|(e, truth)| f64::from(*e) - f64::from(*truth))
        .fold(0.0, f64::max);
    (brightest > 0.0).then(|| over / f64::from(brightest))
}

/// Means of squares of texels, so many that `width` are left.
fn pooled(map: RgbImage, width: u32) -> RgbImage {
    let factor = map.width / width;
    assert_eq!(map.width, width * factor, "whole squares");
    if factor == 1 {
        return map;
    }
    let height = map.height / factor;
    let mean = |column: u32, row: u32| {
        let mut sum = [0.0f64; 3];
        for y in row * factor..(row + 1) * factor {
            let start = (y * map.width + column * factor) as usize;
            for rgb in &map.pixels[start..start + factor as usize] {
                (0..3).for_each(|c| sum[c] += f64::from(rgb[c]));
            }
        }
        sum.map(|sum| (sum / f64::from(factor * factor)) as f32)
    };
    RgbImage {
        width,
        height,
        pixels: (0..width * height)
            .map(|i| mean(i % width, i / width))
            .collect(),
    }
}

/// Irradiance that all but this share of the lit texels stay below is white in pictures,
const WHITE: f64 = 0.02;
/// and this share of white saturates the colours of error maps.
const ERROR_SCALE: f64 = 0.2;

impl End {
    fn of(value: f64, truth: &RgbImage) -> Self {
        let white = white(truth);
        Self {
            value,
            truth: Picture::of_light_map(truth, -white.log2()),
            error_scale: ERROR_SCALE * white,
            maps: Vec::new(),
        }
    }

    fn add(&mut self, method: String, map: &RgbImage, truth: &RgbImage) {
        let map = pooled(map.clone(), truth.width);
        let exposure = -(self.error_scale / ERROR_SCALE).log2();
        let picture = Picture::of_light_map(&map, exposure);
        let error = Picture::of_error(&map, truth, self.error_scale);
        self.maps.push((method, picture, error));
    }
}

fn white(truth: &RgbImage) -> f64 {
    let mut lit: Vec<f32> = (truth.pixels.iter())
        .map(|rgb| rgb[0])
        .filter(|v| *v > 0.0)
        .collect();
    lit.sort_by(f32::total_cmp);
    let index = ((1.0 - WHITE) * lit.len() as f64) as usize;
    lit.get(index).map_or(1.0, |&v| f64::from(v))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn map(values: &[f32], width: u32) -> RgbImage {
        RgbImage {
            width,
            height: values.len() as u32 / width,
            pixels: values.iter().map(|&v| [v; 3]).collect(),
        }
    }

    #[test]
    fn numbers_worked_out_by_hand() {
        let truth = map(&[1.0, 2.0, 1.0, 0.0], 2);
        let other = map(&[1.5, 1.0, 1.0, 0.25], 2);
        let point = measure(
            vec![other.clone()],
            std::slice::from_ref(&truth),
            Some(&other),
        )
        .unwrap();
        assert_eq!(point.l1, Some(1.75 / 4.0));
        assert_eq!(point.energy_ratio, Some(3.75 / 4.0));
        assert_eq!(point.overshoot, Some(0.25));
        assert_eq!((point.bad_texels, point.drift), (0, Some(0.0)));
        assert_eq!(point.flicker, None);
        let still = measure(
            vec![other.clone(); 2],
            &[truth.clone(), truth.clone()],
            None,
        );
        assert_eq!(still.unwrap().flicker, Some(0.0));
        let jump = measure(vec![truth.clone(), other], &[truth.clone(), truth], None);
        assert_eq!(jump.unwrap().flicker, Some(1.75 / 4.0));
    }

    #[test]
    fn bad_texels_are_counted_and_spoil_the_rest() {
        let truth = map(&[1.0; 4], 2);
        for bad in [f32::NAN, f32::INFINITY] {
            let map = map(&[1.0, bad, bad, 1.0], 2);
            let point = measure(vec![map], std::slice::from_ref(&truth), None).unwrap();
            assert_eq!((point.bad_texels, point.l1), (2, None));
        }
        let negative = map(&[1.0, -1e-30, 1.0, 1.0], 2);
        let point = measure(vec![negative.clone()], &[truth], None).unwrap();
        assert_eq!(point.bad_texels, 1);
        assert!(point.l1.is_some());
        // Of a spectrum.
        let point = measure(vec![negative.clone()], &[negative], None).unwrap();
        assert_eq!(point.bad_texels, 0);
    }

    #[test]
    fn fine_maps_are_averaged() {
        let fine: Vec<f32> = (0..16).map(|i| i as f32).collect();
        let coarse = pooled(map(&fine, 4), 2);
        let values: Vec<f32> = coarse.pixels.iter().map(|rgb| rgb[0]).collect();
        assert_eq!(values, [2.5, 4.5, 10.5, 12.5]);
    }
}
