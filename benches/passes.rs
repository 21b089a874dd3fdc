//! What each pass of `footprint` costs, beside `points` of equal error in the same run, on the floor
//! of `ring.toml`. Run by `make bench`; it only measures and demands no speed.
//!
//! Passes are submitted one by one, and timed from the start of recording to the end of waiting, so
//! their sum is more than the whole caustic, which is one submission. No device time is in the
//! table: software devices under-report it.

#[path = "../tests/common/mod.rs"]
mod common;

use common::{Device, footprint, l1, load, method, only_receiver, options, run::Run, solve};
use criterion::{Criterion, SamplingMode};
use nephroid::gpu::keep_freed_memory;
use nephroid::image_file::RgbImage;
use nephroid::measure::Spread;
use nephroid::render::{Method, Renderer};
use nephroid::scene::Scene;
use std::time::{Duration, Instant};

const RECEIVER: &str = "floor";
const TEXELS: [u32; 2] = [256, 256];
const PATCHES: [u32; 2] = [4096, 16_384];
/// Expected L1 error of the reference, which is in the errors of both methods.
const REFERENCE_ERROR: f64 = 0.005;
/// Points that are tried at least and at most.
const POINTS: [u32; 2] = [1 << 14, 1 << 27];
/// Between the numbers of points at which bisection stops: 3 % in error, since a caustic of points
/// improves about as their number to the 0.6.
const BRACKET: f64 = 1.05;

const SAMPLES: usize = 20;
/// Frames of points take seconds; criterion takes no fewer samples.
const SAMPLES_OF_POINTS: usize = 10;
const WARM_UP: Duration = Duration::from_millis(500);
const MEASURING: Duration = Duration::from_secs(2);

struct Bench {
    device: Device,
    scene: Scene,
    truth: RgbImage,
    criterion: Criterion,
}

fn main() {
    keep_freed_memory();
    let device = Device::unwatched();
    let scene = only_receiver(load("ring.toml"), RECEIVER, TEXELS);
    eprintln!("computing the reference, which takes about a minute");
    let reference = solve(&scene, RECEIVER, TEXELS, &options(REFERENCE_ERROR));
    let mut bench = Bench {
        device,
        scene,
        truth: reference.image(),
        criterion: Criterion::default().without_plots().configure_from_args(),
    };
    let tables = PATCHES.map(|patches| bench.table(patches));
    bench.criterion.final_summary();

    println!();
    for (name, value) in Run::on(bench.device.0.info()).rows() {
        println!("{:<11}{value}", name.to_lowercase());
    }
    let [width, height] = TEXELS;
    println!("scene      ring.toml, {RECEIVER}, {width}x{height} texels");
    let error = 100.0 * reference.relative_error;
    println!("reference  L1 {error:.2} % (expected, within the errors below)");
    tables.iter().for_each(|table| println!("\n{table}"));
}

impl Bench {
    fn table(&mut self, patches: u32) -> String {
        let mut renderer = self.device.renderer(&self.scene, &footprint(patches));
        let error = self.error(&mut renderer);
        let lit = renderer.lit_patches().unwrap().unwrap_or_default();
        let mut text = format!(
            "footprint: {} patches, {lit} lit, L1 {:.2} %\n",
            renderer.samples().unwrap(),
            100.0 * error
        );
        eprintln!("looking for the points of L1 {:.2} %", 100.0 * error);
        let points = self.points_of_error(error);
        text += &match &points {
            Some((renderer, error)) => {
                let samples = renderer.samples().unwrap();
                format!("points:    {samples}, L1 {:.2} %\n", 100.0 * error)
            }
            None => format!("points:    not as good with {}\n", POINTS[1]),
        };

        let group = format!("ring {patches}");
        let passes = pass_names(&mut renderer);
        let mut rows: Vec<(&str, Option<Spread>)> = (passes.into_iter())
            .map(|pass| {
                let time = |frames| time_pass(&mut renderer, pass, frames);
                let spread = measure(&mut self.criterion, &group, pass, SAMPLES, time);
                (pass, spread)
            })
            .collect();
        renderer.wait_each_pass(false);
        let time = |frames| time_caustic(&mut renderer, frames);
        let whole = measure(&mut self.criterion, &group, "footprint", SAMPLES, time);
        rows.push(("footprint", whole));
        let points = points.and_then(|(mut renderer, _)| {
            let time = |frames| time_caustic(&mut renderer, frames);
            let samples = SAMPLES_OF_POINTS;
            measure(&mut self.criterion, &group, "points", samples, time)
        });
        rows.push(("points", points));

        text += "pass            median ms   p95 ms   of points\n";
        let ratio = |spread: Spread| Some(spread.median / points?.median);
        for (name, spread) in rows {
            let Some(spread) = spread else { continue };
            let ratio = ratio(spread).map_or("-".into(), |ratio| format!("{ratio:.5}"));
            let [median, p95] = [spread.median, spread.p95].map(|seconds| 1e3 * seconds);
            text += &format!("{name:<14} {median:>10.3} {p95:>8.3} {ratio:>11}\n");
        }
        if let Some(ratio) = whole.and_then(ratio) {
            let times = 1.0 / ratio;
            text += &format!("points take {times:.1} times as long as footprints\n");
        }
        text
    }

    /// L1 of the caustic.
    fn error(&self, renderer: &mut Renderer) -> f64 {
        renderer.caustic().unwrap();
        let receiver = self.scene.object_index(RECEIVER).unwrap();
        l1(&renderer.read_caustic(receiver).unwrap(), &self.truth)
    }

    /// The fewest points that are as good as `wanted`, up to [`BRACKET`], and how good they are.
    fn points_of_error(&self, wanted: f64) -> Option<(Renderer, f64)> {
        let attempt = |samples: u32| {
            let settings = method(Method::Points, samples);
            let mut renderer = self.device.renderer(&self.scene, &settings);
            let error = self.error(&mut renderer);
            eprintln!("{samples} points: L1 {:.2} %", 100.0 * error);
            (renderer, error)
        };
        let [mut few, most] = POINTS;
        let mut many = few;
        let mut found = attempt(many);
        while found.1 > wanted {
            if many == most {
                return None;
            }
            few = many;
            many *= 2;
            found = attempt(many);
        }
        while f64::from(many) > BRACKET * f64::from(few) {
            let middle = (f64::from(few) * f64::from(many)).sqrt() as u32;
            let candidate = attempt(middle);
            if candidate.1 > wanted {
                few = middle;
            } else {
                many = middle;
                found = candidate;
            }
        }
        Some(found)
    }
}

/// The caustic, computed again.
fn frame(renderer: &mut Renderer) {
    renderer.invalidate();
    renderer.caustic().unwrap();
}

/// Names of the caustic's passes, each once, and has them timed one by one from now on.
fn pass_names(renderer: &mut Renderer) -> Vec<&'static str> {
    renderer.wait_each_pass(true);
    renderer.take_times();
    frame(renderer);
    let mut names = Vec::new();
    for pass in renderer.take_times() {
        if !names.contains(&pass.name) {
            names.push(pass.name);
        }
    }
    assert!(!names.is_empty(), "a frame was not computed again");
    names
}

/// Wall time of one pass over some frames.
fn time_pass(renderer: &mut Renderer, pass: &str, frames: u64) -> Duration {
    let mut seconds = 0.0;
    for _ in 0..frames {
        frame(renderer);
        seconds += (renderer.take_times().iter())
            .filter(|time| time.name == pass)
            .filter_map(|time| time.wall)
            .sum::<f64>();
    }
    Duration::from_secs_f64(seconds)
}

/// Wall time of the caustic over some frames.
fn time_caustic(renderer: &mut Renderer, frames: u64) -> Duration {
    let start = Instant::now();
    for _ in 0..frames {
        frame(renderer);
    }
    start.elapsed()
}

/// Time of a frame as criterion measures it; `None` where its filter leaves this one out.
fn measure(
    criterion: &mut Criterion,
    group: &str,
    name: &str,
    sample_size: usize,
    mut time: impl FnMut(u64) -> Duration,
) -> Option<Spread> {
    let mut seconds = Vec::new();
    let mut group = criterion.benchmark_group(group);
    group
        .sample_size(sample_size)
        .warm_up_time(WARM_UP)
        .measurement_time(MEASURING)
        .sampling_mode(SamplingMode::Flat)
        .bench_function(name, |bencher| {
            bencher.iter_custom(|frames| {
                let elapsed = time(frames);
                seconds.push(elapsed.as_secs_f64() / frames as f64);
                elapsed
            });
        });
    group.finish();
    // Those before are criterion's warm-up.
    let measured = &seconds[seconds.len().saturating_sub(sample_size)..];
    (!measured.is_empty()).then(|| Spread::of(measured))
}
