//! What `render` and `bake` share: options of the renderer, profiling, reports.

use super::{LightMapSize, load_scene, print, print_json};
use clap::Args;
use indicatif::ProgressBar;
use nephroid::gpu::{Context, ContextOptions, DeviceInfo, Messages};
use nephroid::measure::{PassProfile, Spread, profile};
use nephroid::render::{Area, Method, Renderer, Settings};
use nephroid::scene::Scene;
use nephroid::{Error, Result};
use serde::Serialize;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::Instant;

/// Frames that `--profile` times, and those before that it does not.
const FRAMES: usize = 50;
const WARM_UP: usize = 5;

#[derive(Args)]
pub struct GpuOptions {
    /// How the caustic is computed
    #[arg(long, value_enum, default_value_t = Settings::default().method)]
    method: Method,
    /// Patches asked for on the lit side of the mirrors (at least one a triangle), or points
    #[arg(long, default_value_t = Settings::default().samples,
          value_parser = clap::value_parser!(u32).range(1..=1_000_000_000))]
    samples: u32,
    /// Texels of the light maps: their width, with the height in the scene file's proportion, or
    /// WIDTHxHEIGHT
    #[arg(long)]
    lightmap: Option<LightMapSize>,
    /// pinhole: ε of the form factor's d² + ε, in squared patch diameters
    #[arg(long, default_value_t = Settings::default().epsilon, value_parser = not_negative)]
    epsilon: f32,
    /// pinhole: do not blur the light by the mirror's curvature
    #[arg(long)]
    no_filter: bool,
    /// beams: what is taken for the area that a patch lights
    #[arg(long, value_enum, default_value_t = Settings::default().area)]
    area: Area,
    /// Index or part of the name of the Vulkan device
    #[arg(long)]
    device: Option<String>,
    /// Run under the Vulkan validation layers; any message is an error
    #[arg(long)]
    validate: bool,
    /// Time every pass over 50 frames after a warm-up
    #[arg(long)]
    profile: bool,
    /// Print the result as JSON
    #[arg(long)]
    pub json: bool,
}

fn not_negative(text: &str) -> Result<f32, String> {
    let value = text
        .parse()
        .ok()
        .filter(|x: &f32| x.is_finite() && *x >= 0.0);
    value.ok_or("give a number that is not negative".into())
}

/// A scene on a device. End it with [`Session::finish`] before anything is written.
pub struct Session {
    // Dropped in this order, so that complaints about dropping are heard.
    pub renderer: Renderer,
    pub context: Arc<Context>,
    complaints: Complaints,
    pub scene: Scene,
}

impl Session {
    /// Gives the device back.
    ///
    /// # Errors
    /// [`Error::Validation`] where the validation layers said anything from first to last.
    pub fn finish(self) -> Result<()> {
        drop(self.renderer);
        drop(self.context);
        let messages = self.complaints.0.take();
        match messages.first() {
            None => Ok(()),
            Some(first) => Err(Error::Validation {
                count: messages.len(),
                first: first.clone(),
            }),
        }
    }
}

/// What the validation layers say. A command that fails on something else still prints it.
struct Complaints(Arc<Messages>);

impl Drop for Complaints {
    fn drop(&mut self) {
        for message in self.0.take() {
            eprintln!("validation: {message}");
        }
    }
}

/// What every report of a rendering says.
#[derive(Serialize)]
pub struct Report {
    pub file: PathBuf,
    pub device: DeviceInfo,
    /// `None` without a caustic.
    pub caustic: Option<CausticReport>,
    /// Wall time of a frame without profiling, s.
    pub frame: Spread,
    #[serde(skip_serializing_if = "Option::is_none")]
    pub passes: Option<Vec<PassProfile>>,
}

#[derive(Serialize)]
pub struct CausticReport {
    pub method: Method,
    /// Patches or points.
    pub samples: u32,
    /// Patches that throw light on a receiver, counted once a sun.
    pub lit: Option<u32>,
}

impl GpuOptions {
    /// Loads the scene, opens the device, uploads.
    pub fn open(&self, path: &Path) -> Result<Session> {
        let mut scene = load_scene(path)?;
        if let Some(size) = self.lightmap {
            for texels in scene
                .objects
                .iter_mut()
                .filter_map(|o| o.light_map.as_mut())
            {
                *texels = size.texels(*texels);
            }
        }
        let options = ContextOptions {
            device: self.device.clone(),
            validate: self.validate,
        };
        let context = Context::new(&options)?;
        let complaints = Complaints(context.messages());
        let settings = Settings {
            method: self.method,
            samples: self.samples,
            epsilon: self.epsilon,
            filter: !self.no_filter,
            area: self.area,
        };
        let renderer = Renderer::new(&context, &scene, &settings)?;
        Ok(Session {
            renderer,
            context,
            complaints,
            scene,
        })
    }

    /// Renders `frame` once, or as often as `--profile` asks for, and reports on it.
    pub fn run(
        &self,
        session: &mut Session,
        file: &Path,
        has_caustic: bool,
        mut frame: impl FnMut(&mut Renderer, &Scene) -> Result<()>,
    ) -> Result<Report> {
        let Session {
            context,
            scene,
            renderer,
            ..
        } = session;
        if has_caustic {
            for note in renderer.notes() {
                eprintln!("note: {note}");
            }
        }
        // The first frame pays for what drivers put off, so it is not the one that is timed.
        frame(renderer, scene)?;
        let mut times = Vec::new();
        let mut passes = None;
        if self.profile {
            let bar = ProgressBar::new((WARM_UP + 2 * FRAMES) as u64);
            for _ in 0..WARM_UP {
                frame(renderer, scene)?;
                bar.inc(1);
            }
            for _ in 0..FRAMES {
                let start = Instant::now();
                frame(renderer, scene)?;
                times.push(start.elapsed().as_secs_f64());
                bar.inc(1);
            }
            renderer.wait_each_pass(true);
            renderer.take_times();
            let mut frames = Vec::new();
            for _ in 0..FRAMES {
                frame(renderer, scene)?;
                frames.push(renderer.take_times());
                bar.inc(1);
            }
            renderer.wait_each_pass(false);
            bar.finish_and_clear();
            passes = Some(profile(&frames));
        } else {
            let start = Instant::now();
            frame(renderer, scene)?;
            times.push(start.elapsed().as_secs_f64());
        }
        let caustic = if has_caustic {
            Some(CausticReport {
                method: self.method,
                samples: renderer.samples(),
                lit: renderer.lit_patches()?,
            })
        } else {
            None
        };
        Ok(Report {
            file: file.to_owned(),
            device: context.info().clone(),
            caustic,
            frame: Spread::of(&times),
            passes,
        })
    }
}

impl Report {
    /// Prints the report, as JSON or for a person.
    pub fn print(&self, json: bool) {
        if json {
            return print_json(self);
        }
        let device = &self.device;
        print(&self.file.display().to_string());
        print(&format!("device  {} ({})", device.name, device.driver));
        if let Some(caustic) = &self.caustic {
            let method = format!("{:?}", caustic.method).to_lowercase();
            let unit = if caustic.method == Method::Points {
                "points"
            } else {
                "patches"
            };
            let lit = caustic
                .lit
                .map_or(String::new(), |count| format!(", {count} lit"));
            print(&format!(
                "method  {method}, {} {unit}{lit}",
                caustic.samples
            ));
        }
        print(&format!("frame   {:.2} ms", 1e3 * self.frame.median));
        let Some(passes) = &self.passes else { return };
        print("\npass            median ms   p95 ms   share   device ms");
        let row = |name: &str, wall: &Spread, share: f64, gpu: Option<f64>| {
            let gpu = gpu.map_or("-".into(), |seconds| format!("{:.3}", 1e3 * seconds));
            print(&format!(
                "{name:<14} {:>10.3} {:>8.3} {:>6.1}% {gpu:>11}",
                1e3 * wall.median,
                1e3 * wall.p95,
                100.0 * share
            ));
        };
        for pass in passes {
            row(
                pass.name,
                &pass.wall,
                pass.share,
                pass.gpu.map(|spread| spread.median),
            );
        }
        row("whole frame", &self.frame, 1.0, None);
        print("passes: submitted one by one, wall time; whole frame: in one submission");
    }
}
