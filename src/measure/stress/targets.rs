//! What an error target promises, against what is reached: [`Settings::error`], the estimate of it, and the truth, over
//! many receivers.

use super::super::{compare, l1_without_noise, with_light_map};
use super::random::random_scene;
use super::scenes::RECEIVER;
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::reference::{Options, cached_caustic};
use crate::render::{Renderer, Settings};
use crate::scene::Scene;
use serde::{Deserialize, Serialize};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Relative L1 errors to aim for.
pub const TARGETS: [f64; 3] = [0.05, 0.02, 0.01];

/// Number of random scenes.
pub const RANDOM_SCENES: u32 = 20;

/// Points whose reference is less certain than this multiple of the target say nothing and are left out.
const MOST_NOISE: f64 = 1.5;

/// How an estimate may differ from the true error, as a factor.
const FACTOR: f64 = 2.0;

/// The random scenes.
pub fn random_subjects() -> Vec<Subject> {
    let subject = |number| {
        let scene = random_scene(number);
        Subject {
            name: format!("random {number}"),
            receiver: scene
                .object_index(RECEIVER)
                .expect("all scenes have a receiver"),
            scene,
        }
    };
    (0..RANDOM_SCENES).map(subject).collect()
}

/// The planar receivers of a scene.
pub fn subjects(name: &str, scene: &Scene) -> Vec<Subject> {
    let receivers = scene.planar_receivers();
    receivers
        .map(|(receiver, ..)| Subject {
            name: name.into(),
            scene: scene.clone(),
            receiver,
        })
        .collect()
}

/// A receiver that is measured.
pub struct Subject {
    /// Of the scene.
    pub name: String,
    pub scene: Scene,
    /// Index of an object with a planar light map.
    pub receiver: usize,
}

/// How finely it is measured.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Precision {
    /// Texels on the larger side of a light map.
    pub texels: u32,
    /// Relative L1 error to ask of the reference.
    pub reference_error: f64,
    /// Rays after which a reference has to do.
    pub most_rays: u64,
}

impl Precision {
    pub const FULL: Self = Self {
        texels: 128,
        reference_error: 0.006,
        most_rays: 120_000_000,
    };
    pub const QUICK: Self = Self {
        texels: 64,
        reference_error: 0.015,
        most_rays: 5_000_000,
    };
}

/// One target on one receiver.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TargetPoint {
    pub scene: String,
    pub receiver: String,
    pub texels: [u32; 2],
    /// The relative L1 error that was asked for.
    pub target: f64,
    /// What the renderer says of its own error.
    pub estimate: f64,
    /// Against the reference, without the reference's noise.
    pub l1: f64,
    /// The expected error of the reference, relative L1.
    pub reference_error: f64,
    pub energy_ratio: f64,
    pub patches: u32,
}

/// All targets on one receiver; none where the renderer cannot aim for an error there, no light arrives, or the reference is
/// too uncertain.
///
/// # Errors
/// [`Error::Cancelled`] soon after `cancel` becomes true, [`Error::Device`] where the device fails, and what
/// [`cached_caustic`] refuses.
pub fn measure(
    context: &Arc<Context>,
    subject: &Subject,
    precision: Precision,
    cancel: &AtomicBool,
) -> Result<Vec<TargetPoint>> {
    let object = &subject.scene.objects[subject.receiver];
    let asked = object.light_map.expect("a receiver");
    let scale = f64::from(precision.texels) / f64::from(asked[0].max(asked[1]));
    let texels = asked.map(|side| (f64::from(side) * scale).round().max(1.0) as u32);
    let scene = with_light_map(&subject.scene, subject.receiver, texels);
    let of = |target: f64| {
        let settings = Settings {
            error: Some(target as f32),
            ..Settings::default()
        };
        Renderer::new(context, &scene, &settings)
    };
    let mut renderer = of(TARGETS[0])?;
    renderer.caustic()?;
    if renderer.estimated_error()?.is_none_or(|error| error <= 0.0) {
        return Ok(Vec::new());
    }
    let options = Options {
        error: precision.reference_error,
        max_samples: precision.most_rays,
        ..Options::default()
    };
    let receiver = subject.receiver;
    let reference =
        cached_caustic(&scene, receiver, texels, &options, &mut |_| {}, cancel)?.reference;
    let truth = reference.image();
    let mut points = Vec::new();
    for target in TARGETS {
        if cancel.load(Ordering::Relaxed) {
            return Err(Error::Cancelled);
        }
        // Of its own renderer, whose buffers suit the target.
        let mut renderer = of(target)?;
        renderer.caustic()?;
        let map = renderer.read_caustic(receiver)?;
        let (Some(l1), Some(energy_ratio), Some(estimate)) = (
            l1_without_noise(&map, &reference),
            compare(&map, &truth)?.energy_ratio,
            renderer.estimated_error()?,
        ) else {
            continue;
        };
        let noise = reference.relative_error;
        if noise > MOST_NOISE * target {
            continue;
        }
        points.push(TargetPoint {
            scene: subject.name.clone(),
            receiver: object.name.clone(),
            texels,
            target,
            estimate: estimate.into(),
            l1,
            reference_error: noise,
            energy_ratio,
            patches: renderer.samples()?,
        });
    }
    Ok(points)
}

/// What the points of one target, or of all, say together.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Summary {
    pub points: usize,
    /// Share of the points whose error is at most the target.
    pub kept: f64,
    /// Mean of error / target.
    pub mean_use: f64,
    /// Share of the points whose estimate is within a factor of 2 of the error.
    pub estimated: f64,
}

impl Summary {
    /// `None` without points.
    pub fn of<'a>(points: impl Iterator<Item = &'a TargetPoint>) -> Option<Self> {
        let points: Vec<&TargetPoint> = points.collect();
        let count = points.len() as f64;
        let share = |holds: &dyn Fn(&TargetPoint) -> bool| {
            points.iter().filter(|point| holds(point)).count() as f64 / count
        };
        let is_close = |point: &TargetPoint| {
            let ratio = point.estimate / point.l1.max(f64::MIN_POSITIVE);
            (1.0 / FACTOR..=FACTOR).contains(&ratio)
        };
        (!points.is_empty()).then(|| Self {
            points: points.len(),
            kept: share(&|point| point.l1 <= point.target),
            mean_use: points.iter().map(|p| p.l1 / p.target).sum::<f64>() / count,
            estimated: share(&is_close),
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn summaries_are_shares() {
        let point = |target, estimate, l1| TargetPoint {
            scene: "a".into(),
            receiver: "floor".into(),
            texels: [64, 64],
            target,
            estimate,
            l1,
            reference_error: 0.0,
            energy_ratio: 1.0,
            patches: 1,
        };
        let points = [
            point(0.02, 0.02, 0.01),
            point(0.02, 0.02, 0.03),
            point(0.02, 0.01, 0.02),
            point(0.02, 0.02, 0.002),
        ];
        let summary = Summary::of(points.iter()).unwrap();
        assert_eq!(
            (summary.points, summary.kept, summary.estimated),
            (4, 0.75, 0.75)
        );
        assert!((summary.mean_use - 0.775).abs() < 1e-12);
        assert_eq!(Summary::of(points[..0].iter()), None);
    }
}
