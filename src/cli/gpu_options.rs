//! Code that `render` and `bake` share: options of the renderer, stills and sequences, profiling,
//! reports.

use super::files::{Files, load_scene, lossy};
use super::light_map_size::LightMapSize;
use super::signals::{cancelled, watcher};
use super::terminal::{log, log_some, print, print_json, progress_bar};
use super::timeline::{Shot, Timeline, each_frame, numbered};
use clap::Args;
use clap::builder::{PossibleValue, PossibleValuesParser, TypedValueParser};
use nephroid::flux_balance::FluxBalance;
use nephroid::gpu::{Context, ContextOptions, DeviceInfo, Messages, PassTime, Submissions};
use nephroid::image_file::RgbImage;
use nephroid::measure::{ChosenLightMap, PassProfile, Spread, choose_light_maps, profile};
use nephroid::render::{Area, DEFAULT_ERROR, LeftOut, Method, Renderer, Settings, ViewMemory};
use nephroid::scene::{Animation, LightKind, Scene};
use nephroid::{Error, Result};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Maximum number of frames of each kind that `--profile` times, and number of frames before them that it does not time.
const FRAMES: usize = 50;
const WARM_UP: usize = 5;
/// Number of frames of each kind that are rendered even if they take longer than [`LONGEST`].
const LEAST_FRAMES: usize = 3;
/// Time after which no more frames of a kind are rendered.
const LONGEST: Duration = Duration::from_secs(10);
/// Share of the flux that is cut off above which the report says so.
const NOTEWORTHY: f64 = 1e-3;

#[derive(Args)]
pub struct GpuOptions {
    #[command(flatten)]
    pub timeline: Timeline,
    /// Method that computes the caustic
    #[arg(long, value_parser = method_parser(), default_value = Settings::default().method.name())]
    method: Method,
    /// Number of patches to aim for (at least one for each lit triangle), or of points [default: 16384]
    #[arg(long, value_parser = clap::value_parser!(u32).range(1..=1_000_000_000))]
    samples: Option<u32>,
    /// footprint: relative L1 error to aim for on planar receivers under suns and lamps [default: 0.02, without
    /// --samples]
    #[arg(long, conflicts_with = "samples", value_parser = relative_error)]
    error: Option<f32>,
    /// footprint: time that the update and the caustic of a frame may take, in ms. The error to aim for is chosen again for
    /// every frame. The first frame is repeated, at most 20 times, until the budget is met
    #[arg(long, value_name = "MS", conflicts_with_all = ["samples", "error"], value_parser = budget)]
    budget_ms: Option<Duration>,
    /// Size of the light maps in texels: the width, with the height in the scene file's proportion, or
    /// WIDTHxHEIGHT
    #[arg(long)]
    lightmap: Option<LightMapSize>,
    /// footprint: maximum number of environment cells (at least 8)
    #[arg(long, default_value_t = Settings::default().environment_cells,
          value_parser = clap::value_parser!(u32).range(8..=1_000_000))]
    environment_cells: u32,
    /// footprint: approximate number of images of environment cells for every sample, times the environment's
    /// share of all light
    #[arg(long, default_value_t = Settings::default().environment_images,
          value_parser = clap::value_parser!(u32).range(1..=1000))]
    environment_images: u32,
    /// pinhole: ε of the form factor's d² + ε, in squared patch diameters
    #[arg(long, default_value_t = Settings::default().epsilon, value_parser = not_negative)]
    epsilon: f32,
    /// pinhole: do not blur the light by the mirror's curvature
    #[arg(long)]
    no_filter: bool,
    /// beams: formula for the area that a patch lights
    #[arg(long, value_parser = area_parser(), default_value = Settings::default().area.name())]
    area: Area,
    /// Print what the caustic leaves out, why, and how much of the light that is
    #[arg(long)]
    explain: bool,
    /// Index or part of the name of the Vulkan device
    #[arg(long)]
    device: Option<String>,
    /// Run under the Vulkan validation layers; any message is an error
    #[arg(long)]
    validate: bool,
    /// Time every pass over 50 frames after a warm-up (fewer if they take longer than 10 s), or over the frames of a sequence
    #[arg(long)]
    profile: bool,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

pub(super) fn method_parser() -> impl TypedValueParser<Value = Method> {
    one_of(Method::ALL, Method::name, |method| match method {
        Method::Footprint => {
            "Every patch projects the lights onto the receivers as splats, which are added up"
        }
        Method::Pinhole => "Every texel gathers over all patches (Wand & Straßer 2003)",
        Method::Points => "Low-discrepancy points are traced to one texel each",
        Method::Beams => "Patches are drawn as triangles between their corners' outgoing rays",
    })
}

fn area_parser() -> impl TypedValueParser<Value = Area> {
    one_of(Area::ALL, Area::name, |area| match area {
        Area::True => "The true area: the length of the sides' cross product",
        Area::Product => {
            "The product of the lengths of the derivatives by texel, `length(dFdx(x)) * length(dFdy(x))`: \
             widespread, but correct only where the derivatives are perpendicular"
        }
    })
}

/// Accepts the names of `values`. The library does not know clap, so its enums do not derive `ValueEnum`.
pub(super) fn one_of<T: Copy + Send + Sync + 'static, const N: usize>(
    values: [T; N],
    name: fn(T) -> &'static str,
    help: fn(T) -> &'static str,
) -> impl TypedValueParser<Value = T> {
    let possible = values.map(|value| PossibleValue::new(name(value)).help(help(value)));
    PossibleValuesParser::new(possible).map(move |chosen| {
        let value = values.into_iter().find(|&value| name(value) == chosen);
        value.expect("clap accepts these names only")
    })
}

pub(super) fn relative_error(text: &str) -> Result<f32, String> {
    let value = text.parse().ok().filter(|x: &f32| (1e-4..=1.0).contains(x));
    value.ok_or("give a relative error from 0.0001 to 1, such as 0.02 for 2 %".into())
}

pub(super) fn budget(text: &str) -> Result<Duration, String> {
    let milliseconds = text.parse().ok().filter(|x: &f64| (0.1..=1e5).contains(x));
    let seconds = milliseconds.map(|milliseconds| Duration::from_secs_f64(1e-3 * milliseconds));
    seconds.ok_or("give milliseconds from 0.1 to 100000, such as 16".into())
}

fn not_negative(text: &str) -> Result<f32, String> {
    let value = text
        .parse()
        .ok()
        .filter(|x: &f32| x.is_finite() && *x >= 0.0);
    value.ok_or("give a number that is not negative".into())
}

/// The work of a command on a scene.
pub trait Job {
    /// Whether it computes a caustic.
    fn has_caustic(&self) -> bool;
    /// Whether its report has the balance of flux.
    fn reports_flux(&self) -> bool {
        false
    }
    /// Device memory of a view; `None` if the command renders no view.
    fn view_memory(&self, _renderer: &Renderer) -> Option<ViewMemory> {
        None
    }
    /// Renders a frame.
    fn render(&self, renderer: &mut Renderer, scene: &Scene) -> Result<()>;
    /// Reads the result of the last frame.
    fn read(&self, renderer: &Renderer) -> Result<RgbImage>;
    /// Writes the result completely or not at all.
    fn write(&self, file: &Path, scene: &Scene, image: &RgbImage) -> Result<()>;
}

/// A scene on a device.
pub struct Session {
    // Dropped in this order, so that validation messages about dropping are seen.
    pub renderer: Renderer,
    pub context: Arc<Context>,
    complaints: Complaints,
    /// The scene at the time that is rendered.
    pub scene: Scene,
    animation: Animation,
    lightmap: Option<LightMapSize>,
    /// The light maps whose sizes were chosen.
    chosen: Vec<ChosenLightMap>,
}

/// The scene at a time, with light maps of the size asked for.
fn scene_at(animation: &Animation, time: f64, lightmap: Option<LightMapSize>) -> Scene {
    let mut scene = animation.at(time);
    if let Some(size) = lightmap {
        for texels in (scene.objects.iter_mut()).filter_map(|o| o.light_map.as_mut()) {
            *texels = size.texels(*texels);
        }
    }
    scene
}

impl Session {
    /// Updates the renderer to another time.
    fn show(&mut self, time: f64) -> Result<()> {
        self.scene = scene_at(&self.animation, time, self.lightmap);
        self.renderer.update(&self.scene)
    }

    /// Closes the device.
    ///
    /// # Errors
    /// [`Error::Validation`] if there was any validation message since the device was opened.
    pub fn finish(self) -> Result<()> {
        drop(self.renderer);
        drop(self.context);
        self.complaints.check()
    }
}

/// Messages of the validation layers. A command that fails for another reason still prints them.
struct Complaints(Arc<Messages>);

impl Complaints {
    /// [`Error::Validation`] if there are any.
    fn check(&self) -> Result<()> {
        let messages = self.0.take();
        match messages.first() {
            None => Ok(()),
            Some(first) => Err(Error::Validation {
                count: messages.len(),
                first: first.clone(),
            }),
        }
    }
}

impl Drop for Complaints {
    fn drop(&mut self) {
        for message in self.0.take() {
            log("validation", &message);
        }
    }
}

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
    #[serde(skip)]
    update: f64,
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

impl GpuOptions {
    /// Loads the scene, opens the device, uploads the scene at `time`.
    pub fn open(&self, path: &Path, time: f64) -> Result<Session> {
        let has_aim = self.error.is_some() || self.budget_ms.is_some();
        if has_aim && self.method != Method::Footprint {
            let aim = if self.error.is_some() {
                "an error"
            } else {
                "a time"
            };
            return Err(Error::Usage {
                reason: format!("{} cannot aim for {aim}", self.method.name()),
                remedy: "give --samples, or leave out --method".into(),
            });
        }
        let mut animation = load_scene(path)?.animation;
        let options = ContextOptions {
            device: self.device.clone(),
            validate: self.validate,
        };
        let context = Context::new(&options)?;
        let complaints = Complaints(context.messages());
        let settings = Settings {
            method: self.method,
            samples: self.samples.unwrap_or(Settings::default().samples),
            error: self.error_target(),
            budget: self.budget_ms,
            environment_cells: self.environment_cells,
            environment_images: self.environment_images,
            epsilon: self.epsilon,
            filter: !self.no_filter,
            area: self.area,
            ..Settings::default()
        };
        let auto = animation.auto_light_maps().to_vec();
        let mut chosen = Vec::new();
        if self.lightmap.is_none() && !auto.is_empty() {
            chosen = choose_light_maps(&context, &animation.at(time), &auto, &settings)?;
            for map in &chosen {
                animation.set_light_map(map.object, map.texels);
            }
        }
        let scene = scene_at(&animation, time, self.lightmap);
        let renderer = Renderer::new(&context, &scene, &settings)?;
        Ok(Session {
            renderer,
            context,
            complaints,
            scene,
            animation,
            lightmap: self.lightmap,
            chosen,
        })
    }

    /// The error to aim for, if there is one.
    fn error_target(&self) -> Option<f32> {
        match self.samples {
            None if self.method == Method::Footprint && self.budget_ms.is_none() => {
                Some(self.error.unwrap_or(DEFAULT_ERROR))
            }
            _ => None,
        }
    }

    /// Renders, writes the pictures, and prints a report.
    pub fn execute(
        &self,
        session: Session,
        files: &Files,
        shots: &[Shot],
        job: &impl Job,
    ) -> Result<()> {
        if job.has_caustic() {
            log_some("note", &session.renderer.notes());
        }
        let report = if self.timeline.is_sequence() {
            self.sequence(session, &numbered(&files.output, "####"), shots, job)?
        } else {
            self.still(session, &files.output, job)?
        };
        let estimated = (report.caustic.as_ref()).and_then(|caustic| caustic.estimated_error);
        if let Some((asked, estimated)) = self.error_target().zip(estimated)
            && estimated > 1.01 * asked
        {
            let note = format!(
                "the estimated error of {:.2} % is above the {:.2} % to aim for: {} patches and {} rays of chains are the most, or the \
                 light's disc limits the accuracy",
                100.0 * estimated,
                100.0 * asked,
                nephroid::render::MAX_PATCHES,
                nephroid::render::MAX_RAYS,
            );
            log_some("note", &[note]);
        }
        let budgeted = report.caustic.as_ref().and_then(|caustic| caustic.budgeted);
        if let Some((budget, time)) = self.budget_ms.zip(budgeted)
            && time > 1.05 * budget.as_secs_f64()
        {
            let note = format!(
                "the caustic takes {:.1} ms, above the budget of {} ms: meshes with fewer triangles or smaller light maps take \
                 less time",
                1e3 * time,
                1e3 * budget.as_secs_f64(),
            );
            log_some("note", &[note]);
        }
        match self.json {
            true => print_json(&report),
            false => print(&report.text()),
        }
    }

    /// Renders and writes the frames one by one.
    fn sequence(
        &self,
        mut session: Session,
        pattern: &Path,
        shots: &[Shot],
        job: &impl Job,
    ) -> Result<Report> {
        session.renderer.watch(Some(watcher(false)));
        if job.has_caustic() {
            session.renderer.settle()?;
        }
        let mut profiles = Vec::new();
        let mut submissions = Submissions::default();
        let frames = each_frame(shots, cancelled(), |shot| {
            let start = Instant::now();
            session.show(shot.time)?;
            let update = start.elapsed().as_secs_f64();
            let (renderer, scene) = (&mut session.renderer, &session.scene);
            job.render(renderer, scene)?;
            let seconds = start.elapsed().as_secs_f64();
            submissions = submissions.max(renderer.submissions());
            if self.profile {
                profiles.push(times_of_passes(renderer, |r| job.render(r, scene))?);
            }
            let image = job.read(renderer)?;
            session.complaints.check()?;
            job.write(&shot.file, scene, &image)?;
            Ok(FrameReport {
                file: shot.file.clone(),
                time: shot.time,
                seconds,
                update,
            })
        })?;
        let spread = |time: fn(&FrameReport) -> f64| {
            let times: Vec<f64> = frames.iter().map(time).collect();
            Spread::of(&times)
        };
        let report = Report {
            file: pattern.to_owned(),
            device: session.context.info().clone(),
            caustic: self.caustic_report(&mut session, job)?,
            frame: spread(|frame| frame.seconds),
            is_first: false,
            camera: None,
            view_memory: job.view_memory(&session.renderer),
            update: Some(spread(|frame| frame.update)),
            passes: self.profile.then(|| profile(&profiles)),
            submissions,
            frames: Some(frames),
        };
        session.finish()?;
        Ok(report)
    }

    /// Describes the caustic of the last frame.
    fn caustic_report(
        &self,
        Session {
            renderer,
            scene,
            chosen,
            ..
        }: &mut Session,
        job: &impl Job,
    ) -> Result<Option<CausticReport>> {
        if !job.has_caustic() {
            return Ok(None);
        }
        let flux_balance = match job.reports_flux() || self.explain {
            true => renderer.flux_balance()?,
            false => None,
        };
        Ok(Some(CausticReport {
            left_out: match self.explain {
                true => Some(renderer.left_out(flux_balance.as_ref())?),
                false => None,
            },
            method: self.method,
            samples: renderer.samples()?,
            lit: renderer.lit_patches()?,
            estimated_error: renderer.estimated_error()?,
            chosen_light_maps: chosen.clone(),
            environment_caustics: (scene.lights.iter())
                .find(|light| matches!(light.kind, LightKind::Environment { .. }))
                .map(|light| light.kind.casts_caustics()),
            flux_balance,
            budgeted: (renderer.budget()).map(|budget| budget.time().as_secs_f64()),
        }))
    }

    /// Renders once, or as often as `--profile` asks for, and writes the picture if there was no validation
    /// message.
    fn still(&self, mut session: Session, file: &Path, job: &impl Job) -> Result<Report> {
        session.renderer.watch(Some(watcher(!self.profile)));
        // The first frame includes work that drivers defer; its time is reported only if it is the only one.
        let first = seconds(|| job.render(&mut session.renderer, &session.scene))?;
        if job.has_caustic() {
            session.renderer.settle()?;
            // The picture shall show the last caustic.
            if session.renderer.budget().is_some() {
                job.render(&mut session.renderer, &session.scene)?;
            }
        }
        let (renderer, scene) = (&mut session.renderer, &session.scene);
        let frame = |renderer: &mut Renderer| {
            renderer.invalidate();
            job.render(renderer, scene)
        };
        let mut times = Vec::new();
        let mut submissions = Submissions::default();
        let (mut passes, mut camera) = (None, None);
        if self.profile {
            repeat(WARM_UP, || frame(renderer))?;
            times = repeat(FRAMES, || {
                let time = seconds(|| frame(renderer))?;
                submissions = submissions.max(renderer.submissions());
                Ok(time)
            })?;
            if job.view_memory(renderer).is_some() {
                // Nothing changed: a frame costs what it costs when only the camera moves.
                let still = repeat(FRAMES, || seconds(|| job.render(renderer, scene)))?;
                camera = Some(Spread::of(&still));
            }
            passes = Some(profile(&repeat(FRAMES, || {
                times_of_passes(renderer, frame)
            })?));
        } else {
            times.push(first);
            submissions = renderer.submissions();
        }
        renderer.watch(None);
        let report = Report {
            file: file.to_owned(),
            device: session.context.info().clone(),
            caustic: self.caustic_report(&mut session, job)?,
            frame: Spread::of(&times),
            is_first: !self.profile,
            camera,
            view_memory: job.view_memory(&session.renderer),
            update: None,
            passes,
            submissions,
            frames: None,
        };
        let image = job.read(&session.renderer)?;
        let scene = session.scene.clone();
        session.finish()?;
        job.write(file, &scene, &image)?;
        Ok(report)
    }
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

/// Wall time of a frame, s.
fn seconds(frame: impl FnOnce() -> Result<()>) -> Result<f64> {
    let start = Instant::now();
    frame()?;
    Ok(start.elapsed().as_secs_f64())
}

/// The results of `most` frames, or of fewer if these take longer than [`LONGEST`].
fn repeat<T>(most: usize, mut frame: impl FnMut() -> Result<T>) -> Result<Vec<T>> {
    let bar = progress_bar(most as u64);
    let start = Instant::now();
    let mut results = Vec::new();
    while results.len() < most.min(LEAST_FRAMES)
        || results.len() < most && start.elapsed() < LONGEST
    {
        results.push(frame()?);
        bar.inc(1);
    }
    bar.finish_and_clear();
    Ok(results)
}

/// Renders a frame pass by pass.
fn times_of_passes(
    renderer: &mut Renderer,
    frame: impl FnOnce(&mut Renderer) -> Result<()>,
) -> Result<Vec<PassTime>> {
    renderer.wait_each_pass(true);
    renderer.invalidate();
    renderer.take_times();
    let rendered = frame(renderer);
    let times = renderer.take_times();
    renderer.wait_each_pass(false);
    rendered.map(|()| times)
}

impl Report {
    /// The report as text.
    fn text(&self) -> String {
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
        let row = |name: &str, wall: &Spread, share: f64, gpu: Option<f64>| {
            let gpu = gpu.map_or("-".into(), |seconds| format!("{:.3}", 1e3 * seconds));
            format!(
                "{name:<18} {:>8.3} {:>10.3} {:>8.3} {:>6.1}% {gpu:>11}",
                1e3 * wall.p05,
                1e3 * wall.median,
                1e3 * wall.p95,
                100.0 * share
            )
        };
        let mut lines =
            vec!["\npass                 p05 ms  median ms   p95 ms   share   device ms".into()];
        lines.extend(passes.iter().map(|pass| {
            let gpu = pass.gpu.map(|spread| spread.median);
            row(pass.name, &pass.wall, pass.share, gpu)
        }));
        lines.push(row("whole frame", &self.frame, 1.0, None));
        let Submissions { count, longest } = self.submissions;
        lines.push(format!(
            "passes: submitted one by one, wall time; whole frame: {count} submission{}, the longest {:.1} ms",
            if count == 1 { "" } else { "s" },
            1e3 * longest
        ));
        lines
    }
}
