//! What `render` and `bake` report, as JSON or as text.

use super::files::lossy;
use nephroid::flux_balance::FluxBalance;
use nephroid::gpu::{DeviceInfo, Submissions};
use nephroid::measure::{ChosenLightMap, PassProfile, Spread};
use nephroid::render::{LeftOut, Method, ViewMemory};
use serde::Serialize;
use std::path::PathBuf;

/// Share of the flux that is cut off above which the report says so.
const NOTEWORTHY: f64 = 1e-3;

/// Report of a rendering.
#[derive(Serialize)]
pub struct Report {
    #[serde(serialize_with = "lossy")]
    pub file: PathBuf,
    pub device: DeviceInfo,
    /// `None` without a caustic.
    pub caustic: Option<CausticReport>,
    /// Wall time of a frame without profiling, s; in a sequence, with the update before it.
    pub frame: Spread,
    /// Whether `frame` is the first frame, which includes work that drivers defer.
    pub is_first: bool,
    /// With `--profile`, for a view: wall time of a frame in which only the camera moved, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub camera: Option<Spread>,
    /// For a view: device memory, bytes.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub view_memory: Option<ViewMemory>,
    /// For a sequence: wall time of the update from one frame to the next, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub update: Option<Spread>,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub passes: Option<Vec<PassProfile>>,
    /// Largest number of submissions in a timed frame, and time of the longest submission.
    pub submissions: Submissions,
    /// For a sequence: its frames.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub frames: Option<Vec<FrameReport>>,
}

#[derive(Serialize)]
pub struct FrameReport {
    #[serde(serialize_with = "lossy")]
    pub file: PathBuf,
    /// Time in the scene, s.
    pub time: f64,
    /// Wall time of the frame and the update before it, s.
    pub seconds: f64,
    /// Wall time of the update, s.
    #[serde(skip)]
    pub update: f64,
}

#[derive(Serialize)]
pub struct CausticReport {
    pub method: Method,
    /// Number of patches or points.
    pub samples: u32,
    /// Number of patches that send light to a receiver, counted once for each sun or lamp.
    pub lit: Option<u32>,
    /// Estimated relative L1 error of the receiver where it is largest; `None` if it is not estimated.
    pub estimated_error: Option<f32>,
    /// With `--explain`: what the frame left out.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub left_out: Option<Vec<LeftOut>>,
    /// Light maps with `lightmap = "auto"`.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub chosen_light_maps: Vec<ChosenLightMap>,
    /// Whether the environment casts caustics, as its scene file says; absent without an environment.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub environment_caustics: Option<bool>,
    /// For a light map: where the light that met mirrors and interfaces ended, W. Absent without chains.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub flux_balance: Option<FluxBalance>,
    /// With `--budget-ms`: median time of update and caustic over the last frames, s.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub budgeted: Option<f64>,
}

/// Says what was cut off, unless it is at most [`NOTEWORTHY`] of the flux that came in.
fn cut_off_line(balance: &FluxBalance) -> Option<String> {
    let total = balance.share(balance.cut_off.total());
    let parts: Vec<String> = (balance.cut_off.entries().into_iter())
        .map(|(name, flux)| (name, balance.share(flux)))
        .filter(|(_, share)| *share > NOTEWORTHY)
        .map(|(name, share)| format!("{name} {:.2} %", 100.0 * share))
        .collect();
    (total > NOTEWORTHY).then(|| match parts.is_empty() {
        true => format!("cut off  {:.2} % of the flux", 100.0 * total),
        false => format!(
            "cut off  {:.2} % of the flux: {}",
            100.0 * total,
            parts.join(", ")
        ),
    })
}

impl Report {
    /// The report as text.
    pub fn text(&self) -> String {
        let device = &self.device;
        let frames = self
            .frames
            .as_ref()
            .map_or(String::new(), |frames| format!("  {} frames", frames.len()));
        let mut lines = vec![
            format!("{}{frames}", self.file.display()),
            format!("device  {} ({})", device.name, device.driver),
        ];
        if let Some(caustic) = &self.caustic {
            let method = caustic.method.name();
            let unit = if caustic.method == Method::Points {
                "points"
            } else {
                "patches"
            };
            let lit = caustic
                .lit
                .map_or(String::new(), |count| format!(", {count} lit"));
            lines.push(format!("method  {method}, {} {unit}{lit}", caustic.samples));
            if let Some(error) = caustic.estimated_error {
                lines.push(format!("estimated error  {:.1} %", 100.0 * error));
            }
            for map in &caustic.chosen_light_maps {
                let ([width, height], name) = (map.texels, map.name.escape_debug());
                let error = 100.0 * map.unresolved;
                lines.push(format!(
                    "light map  {name}, {width}×{height} texels, which leave {error:.1} % unresolved"
                ));
            }
            if caustic.environment_caustics == Some(false) {
                lines.push("environment  without caustics, as the scene file says".into());
            }
            lines.extend((caustic.flux_balance.as_ref()).and_then(cut_off_line));
            if let Some(time) = caustic.budgeted {
                lines.push(format!("caustic  {:.2} ms", 1e3 * time));
            }
        }
        for left_out in (self.caustic.iter()).flat_map(|caustic| caustic.left_out.iter().flatten())
        {
            let share = match left_out.share {
                None => "an unknown part of the light".into(),
                Some(0.0) => "no light".into(),
                Some(share) => format!("{:.2} % of the light", 100.0 * share),
            };
            let (what, why) = (&left_out.what, &left_out.why);
            lines.push(format!("left out  {what}: {why} ({share})"));
        }
        let note = match self.is_first {
            true => ", the first; --profile times later ones",
            false => "",
        };
        lines.push(format!("frame   {:.2} ms{note}", 1e3 * self.frame.median));
        if let Some(camera) = &self.camera {
            lines.push(format!(
                "camera  {:.2} ms where only the camera moves",
                1e3 * camera.median
            ));
        }
        if let Some(update) = &self.update {
            lines.push(format!("update  {:.2} ms of it", 1e3 * update.median));
        }
        if let Some(passes) = &self.passes {
            lines.extend(self.pass_lines(passes));
        }
        lines.join("\n")
    }

    fn pass_lines(&self, passes: &[PassProfile]) -> Vec<String> {
        const WHOLE: &str = "whole frame";
        let names = passes.iter().map(|pass| pass.name.len());
        let width = names.fold(WHOLE.len(), usize::max);
        let row = |name: &str, wall: &Spread, share: f64, gpu: Option<f64>| {
            let gpu = gpu.map_or("-".into(), |seconds| format!("{:.3}", 1e3 * seconds));
            format!(
                "{name:<width$} {:>8.3} {:>10.3} {:>8.3} {:>6.1}% {gpu:>11}",
                1e3 * wall.p05,
                1e3 * wall.median,
                1e3 * wall.p95,
                100.0 * share
            )
        };
        let mut lines = vec![format!(
            "\n{:<width$}   p05 ms  median ms   p95 ms   share   device ms",
            "pass"
        )];
        lines.extend(passes.iter().map(|pass| {
            let gpu = pass.gpu.map(|spread| spread.median);
            row(pass.name, &pass.wall, pass.share, gpu)
        }));
        lines.push(row(WHOLE, &self.frame, 1.0, None));
        let Submissions { count, longest } = self.submissions;
        lines.push(format!(
            "passes: submitted one by one, wall time; whole frame: {count} submission{}, the longest {:.1} ms",
            if count == 1 { "" } else { "s" },
            1e3 * longest
        ));
        lines
    }
}
