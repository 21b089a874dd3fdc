//! Stills and sequences, with profiling: what `render` and `bake` do alike.

use super::files::Files;
use super::gpu_options::GpuOptions;
use super::report::{CausticReport, FrameReport, Report};
use super::session::Session;
use super::signals::{cancelled, watcher};
use super::terminal::{log_some, print, print_json, progress_bar};
use super::timeline::{Shot, each_frame, numbered};
use nephroid::gpu::{PassTime, Submissions};
use nephroid::image_file::RgbImage;
use nephroid::measure::{Spread, profile};
use nephroid::render::{MAX_PATCHES, MAX_RAYS, Renderer, ViewMemory};
use nephroid::scene::{LightKind, Scene};
use nephroid::{Error, Result};
use std::path::Path;
use std::time::{Duration, Instant};

/// Maximum number of frames of each kind that `--profile` times, and number of frames before them that it does not time.
const FRAMES: usize = 50;
const WARM_UP: usize = 5;
/// Number of frames of each kind that are rendered even if they take longer than [`LONGEST`].
const LEAST_FRAMES: usize = 3;
/// Time after which no more frames of a kind are rendered.
const LONGEST: Duration = Duration::from_secs(10);

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

impl GpuOptions {
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
            && estimated > asked
        {
            let note = format!(
                "the error may be above the {:.2} % to aim for, {:.2} % is estimated: {} patches and {} rays of chains are the most, or the \
                 light's disc limits the accuracy",
                100.0 * asked,
                100.0 * estimated,
                MAX_PATCHES,
                MAX_RAYS,
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
                renderer.invalidate_geometry();
                profiles.push(times_of_passes(renderer, |r| job.render(r, scene))?);
            }
            let image = result(job, renderer)?;
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
                times_of_passes(renderer, |r| job.render(r, scene))
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
        let image = result(job, &session.renderer)?;
        let scene = session.scene.clone();
        session.finish()?;
        job.write(file, &scene, &image)?;
        Ok(report)
    }
}

/// The result of the last frame.
///
/// # Errors
/// [`Error::Device`] where a value is not finite, so that no such file is written.
fn result(job: &impl Job, renderer: &Renderer) -> Result<RgbImage> {
    let image = job.read(renderer)?;
    match image.first_not_finite() {
        None => Ok(image),
        Some([x, y]) => Err(Error::Device {
            action: "rendering".into(),
            reason: format!("pixel ({x}, {y}) of the result is not finite"),
            remedy: "report this mistake of nephroid with the scene; another --error may avoid it"
                .into(),
        }),
    }
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

/// Computes a frame again, pass by pass.
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
