//! Every method of the renderer over its settings, measured for a [`Chart`](super::chart::Chart).
//!
//! Light maps of one size share a plot, as an error says little about another size: coarse texels
//! are easier to get right. Only the light map of the receiver in question is rendered.

use super::aim::Aim;
use super::chart::{Picture, Point, SceneChart, Series, Strip, Thumbnail, figure};
use super::{Spread, compare, with_light_map};
use crate::error::{Error, Result};
use crate::gpu::Context;
use crate::image_file::RgbImage;
use crate::reference::Reference;
use crate::render::{Area, Method, Renderer, Settings};
use crate::scene::{LightKind, Scene};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Instant;

/// A setting with slower frames is measured once, s.
const ONCE: f64 = 0.5;
/// A first frame this many times slower than the coarser setting before, whose samples are
/// [`Plan::step`] times fewer, has waited for the driver's compiler.
const COMPILED: f64 = 8.0;
/// Nothing finer is measured than a setting with slower frames, s.
const SLOW: f64 = 1.0;
/// The same for `points`, the baseline, on [`Plan::main_side`] as long as it is not yet at [`EQUAL`],
/// so that it comes as far as what it is compared with.
const SLOW_POINTS: f64 = 4.0;
/// And for `pinhole`, which has four curves, and whose frames grow with texels times patches.
const SLOW_PINHOLE: f64 = 0.25;
/// Frames of other settings.
const FRAMES: [f64; 2] = [3.0, 50.0];
/// Times at which methods are shown side by side, s.
const STRIP_TIMES: [f64; 3] = [0.002, 0.008, 0.03];
/// Larger side of a thumbnail, texels.
const THUMBNAIL: u32 = 128;
/// What every curve should fall below, relative.
const GOOD: f64 = 0.01;
/// A finer setting of a curve has more than this share of the error before where samples help no more.
const STUCK: f64 = 0.7;
/// Methods are compared by their times to this error, relative.
const EQUAL: f64 = 0.025;

/// Which settings are measured, and how long.
#[derive(Debug, Clone)]
pub struct Plan {
    /// Larger sides of the light maps, texels, rising; each divides the next.
    pub sides: Vec<u32>,
    /// The light map that gets all samples; others get those that suit their texels.
    pub main_side: u32,
    /// Samples are 256, 256 · `step`, and so on.
    pub step: u32,
    /// Up to these, of patches and of points.
    pub most_patches: u32,
    pub most_points: u32,
    /// Of `pinhole`, which visits every patch at every texel.
    pub most_pinhole_patches: u32,
    /// Errors, relative, and times of a frame, ms, to ask `footprint` for on the main light map.
    pub errors: Vec<f32>,
    pub budgets: Vec<u32>,
    /// About how long to repeat the frames of one setting, s.
    pub seconds: f64,
    /// Relative error to ask of the reference, on the largest light map. Halving the side about
    /// halves it.
    pub reference_error: f64,
}

impl Plan {
    /// The whole chart. The smallest light maps are there for `pinhole`.
    pub fn full() -> Self {
        Self {
            sides: vec![64, 128, 256, 512, 1024],
            main_side: 256,
            step: 4,
            most_patches: 1 << 20,
            most_points: 1 << 22,
            most_pinhole_patches: 4096,
            errors: vec![0.05, 0.03, 0.02, 0.01, 0.005],
            budgets: vec![5, 16, 33, 100],
            seconds: 0.15,
            reference_error: 0.015,
        }
    }

    /// A few settings on small light maps.
    pub fn quick() -> Self {
        Self {
            sides: vec![64],
            main_side: 64,
            step: 16,
            most_patches: 4096,
            most_points: 1 << 16,
            most_pinhole_patches: 256,
            errors: vec![0.05, 0.01],
            budgets: vec![5, 33],
            seconds: 0.1,
            reference_error: 0.005,
        }
    }

    /// Texels of the reference: the largest light map.
    pub fn reference_texels(&self, scene: &Scene, receiver: usize) -> [u32; 2] {
        let largest = self.sides_for(scene, receiver).max();
        self.texels(scene, receiver, largest.unwrap_or(self.main_side))
    }

    /// Those of [`Plan::sides`] that a scene is worth: finer texels than half its own show
    /// nothing more and take the reference long.
    fn sides_for(&self, scene: &Scene, receiver: usize) -> impl Iterator<Item = u32> {
        let [width, height] = scene.objects[receiver].light_map.expect("a receiver");
        let most = self.main_side.max(2 * width.max(height));
        self.sides.iter().copied().filter(move |&side| side <= most)
    }

    /// About in the proportion of the scene file, and divisible down to the smallest light map.
    fn texels(&self, scene: &Scene, receiver: usize, side: u32) -> [u32; 2] {
        let smallest = self.sides[0];
        let asked = scene.objects[receiver].light_map.expect("a receiver");
        let scale = f64::from(smallest) / f64::from(asked[0].max(asked[1]));
        asked.map(|texels| {
            let coarse = (f64::from(texels) * scale).round().max(1.0) as u32;
            coarse * (side / smallest)
        })
    }

    /// What to ask for on a curve.
    fn aims(&self, curve: &Curve, side: u32, texels: [u32; 2]) -> Vec<Aim> {
        match curve.varied {
            Varied::Samples => {
                let ladder = self.ladder(curve.settings.method, side, texels);
                ladder.into_iter().map(Aim::Samples).collect()
            }
            Varied::Error => self.errors.iter().copied().map(Aim::Error).collect(),
            Varied::Budget => self
                .budgets
                .iter()
                .copied()
                .map(Aim::Milliseconds)
                .collect(),
        }
    }

    /// Samples to ask a method for.
    fn ladder(&self, method: Method, side: u32, [width, height]: [u32; 2]) -> Vec<u32> {
        let texels = u64::from(width) * u64::from(height);
        let (most, suit) = match method {
            Method::Pinhole => (self.most_pinhole_patches, 0..=u64::MAX),
            Method::Points => (self.most_points, texels..=64 * texels),
            _ => (self.most_patches, texels / 16..=16 * texels),
        };
        std::iter::successors(Some(256u32), |samples| samples.checked_mul(self.step))
            .take_while(|&samples| samples <= most)
            .filter(|&samples| side == self.main_side || suit.contains(&samples.into()))
            .collect()
    }
}

/// What is measured, against what.
pub struct Subject<'a> {
    /// As the chart shall call the scene.
    pub name: &'a str,
    pub scene: &'a Scene,
    /// Index of the object whose light map is judged.
    pub receiver: usize,
    /// Of [`Plan::reference_texels`].
    pub reference: &'a Reference,
}

/// How far a sweep is.
pub struct Step<'a> {
    /// 0..=1
    pub fraction: f64,
    /// What is about to be measured.
    pub curve: &'a str,
    pub aim: Aim,
    pub texels: [u32; 2],
}

/// What the settings of a curve differ in.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Varied {
    Samples,
    Error,
    Budget,
}

/// A method with everything set but what is varied.
struct Curve {
    label: &'static str,
    settings: Settings,
    varied: Varied,
    /// Why more samples may not bring it below [`GOOD`].
    floor: &'static str,
    /// Frames that take longer end the curve, s.
    slow_frame: f64,
    /// The same on [`Plan::main_side`], until the error is at [`EQUAL`], s.
    slow_to_equal: f64,
    /// Whether one light map, [`Plan::main_side`], says all.
    main_only: bool,
    /// Settings whose frames were slower than [`Curve::slow_frame`].
    slow: Vec<Slow>,
}

struct Slow {
    /// [`Aim::work`]
    work: f64,
    texels: u64,
    /// Of a frame, s.
    time: f64,
}

fn curves(method: Method) -> Vec<Curve> {
    let curve = |label, floor| Curve {
        label,
        settings: Settings {
            method,
            ..Settings::default()
        },
        varied: Varied::Samples,
        floor,
        slow_frame: SLOW,
        slow_to_equal: SLOW,
        main_only: false,
        slow: Vec::new(),
    };
    match method {
        Method::Footprint => {
            let floor = "under lights wider than a texel no footprint is narrower than that, so edges are blurred by as \
                         much; then the mesh is too coarse";
            let varied = |label, varied, floor| Curve {
                varied,
                main_only: true,
                ..curve(label, floor)
            };
            vec![
                curve("footprint", floor),
                varied("footprint, --error", Varied::Error, floor),
                varied(
                    "footprint, --budget-ms",
                    Varied::Budget,
                    "longer frames are not asked for",
                ),
            ]
        }
        Method::Points => vec![Curve {
            slow_to_equal: SLOW_POINTS,
            ..curve(
                "points",
                "noise, which falls with the number of points alone",
            )
        }],
        Method::Beams => [("beams", Area::True), ("beams, product", Area::Product)]
            .into_iter()
            .map(|(label, area)| {
                let mut curve = curve(label, beams_reason(area));
                curve.settings.area = area;
                curve.main_only = area == Area::Product;
                curve
            })
            .collect(),
        Method::Pinhole => [
            ("pinhole", 1.0, true),
            ("pinhole, ε = 0", 0.0, true),
            ("pinhole, no filter", 1.0, false),
            ("pinhole, ε = 0, no filter", 0.0, false),
        ]
        .into_iter()
        .map(|(label, epsilon, filter)| {
            let mut curve = curve(label, pinhole_reason(epsilon, filter));
            curve.settings.epsilon = epsilon;
            curve.settings.filter = filter;
            curve.slow_frame = SLOW_PINHOLE;
            curve.slow_to_equal = SLOW_PINHOLE;
            curve
        })
        .collect(),
    }
}

fn beams_reason(area: Area) -> &'static str {
    match area {
        Area::True => "a sun is a point to it: the edges of its disc are missing",
        Area::Product => {
            "the product of two lengths is not an area where the image is sheared; and a sun is a \
             point to it"
        }
    }
}

fn pinhole_reason(epsilon: f32, filter: bool) -> &'static str {
    match (epsilon > 0.0, filter) {
        (true, true) => {
            "the paper's ε takes light away near the mirror, and light is taken at the texels' \
             middles"
        }
        (false, true) => "light is taken at the texels' middles, and patches are points",
        (true, false) => {
            "without the filter a patch shows the sun as if it were flat, in a few texels or in \
             none; the paper's ε takes light away near the mirror"
        }
        (false, false) => {
            "without the filter a patch shows the sun as if it were flat, in a few texels or in \
             none"
        }
    }
}

impl Curve {
    /// Frames that take longer, after `last`, end the curve, s.
    fn limit(&self, is_main: bool, last: Option<&Point>) -> f64 {
        match is_main && last.is_none_or(|last| last.l1 > EQUAL) {
            true => self.slow_to_equal,
            false => self.slow_frame,
        }
    }

    /// Whether a setting at most as fine had slower frames than `limit`, s.
    fn is_too_slow(&self, aim: Aim, texels: u64, limit: f64) -> bool {
        (self.slow.iter())
            .any(|slow| aim.work() >= slow.work && texels >= slow.texels && slow.time > limit)
    }
}

/// Measures every method on one receiver, a chart for every size of the light map.
///
/// # Errors
/// [`Error::Usage`] where the receiver is dark or no method can do the scene, [`Error::Device`]
/// where the device fails, [`Error::Cancelled`] soon after `cancel` becomes true.
pub fn sweep(
    context: &Arc<Context>,
    subject: &Subject,
    plan: &Plan,
    progress: &mut dyn FnMut(&Step),
    cancel: &AtomicBool,
) -> Result<Vec<SceneChart>> {
    let Subject {
        name,
        scene,
        receiver,
        reference,
    } = *subject;
    let receiver_name = &scene.objects[receiver].name;
    let useless = |reason: String| Error::Usage {
        reason: format!("scene {name}: {reason}"),
        remedy: "leave the scene out, or choose another receiver".into(),
    };
    // In the 32 bits of the maps that are compared.
    let is_lit = |&value: &f64| value >= 3.0 * f64::from(f32::MIN_POSITIVE);
    if !reference.irradiance.as_flattened().iter().any(is_lit) {
        return Err(useless(format!(
            "no mirror sends light to `{receiver_name}`"
        )));
    }
    let mut curves: Vec<Curve> = Method::ALL.into_iter().flat_map(curves).collect();
    let mut left_out = Vec::new();
    curves.retain(|curve| {
        let nothing = missing_light(scene, curve.settings.method) == Some(Missing::All);
        left_out.extend(nothing.then_some(curve.label));
        !nothing
    });
    let settings = |plan: &Plan, curves: &[Curve], side| -> Vec<(usize, Aim)> {
        let texels = plan.texels(scene, receiver, side);
        (curves.iter().enumerate())
            .filter(|(_, curve)| side == plan.main_side || !curve.main_only)
            .flat_map(|(index, curve)| {
                let ladder = plan.aims(curve, side, texels);
                ladder.into_iter().map(move |aim| (index, aim))
            })
            .collect()
    };
    let total: usize = (plan.sides_for(scene, receiver))
        .map(|side| settings(plan, &curves, side).len())
        .sum();
    let (mut done, mut charts) = (0, Vec::new());
    for side in plan.sides_for(scene, receiver) {
        let texels = plan.texels(scene, receiver, side);
        let is_main = side == plan.main_side;
        let truth = Truth::new(reference, texels);
        let scene = with_light_map(scene, receiver, texels);
        let mut measured: Vec<Vec<Measured>> = curves.iter().map(|_| Vec::new()).collect();
        for (index, aim) in settings(plan, &curves, side) {
            let curve = &mut curves[index];
            progress(&Step {
                fraction: done as f64 / total as f64,
                curve: curve.label,
                aim,
                texels,
            });
            done += 1;
            let area = u64::from(texels[0]) * u64::from(texels[1]);
            let last = measured[index].last().map(|last| &last.point);
            if curve.is_too_slow(aim, area, curve.limit(is_main, last)) {
                continue;
            }
            let settings = aim.apply(&curve.settings);
            let mut renderer = Renderer::new(context, &scene, &settings)?;
            let too_many = 4 * plan.most_pinhole_patches;
            if settings.method == Method::Pinhole && renderer.samples()? > too_many {
                // There is at least one patch a triangle, and frames would take minutes.
                continue;
            }
            let made = renderer.samples()?;
            if matches!(aim, Aim::Samples(asked) if made > asked)
                && last.is_some_and(|last| last.samples == u64::from(made))
            {
                // There is at least one patch a triangle, however few are asked for.
                continue;
            }
            if !aim.settle(&mut renderer)? {
                continue;
            }
            let before = last.map(|last| last.wall.median);
            let timing = time_frames(&mut renderer, before, plan.seconds, cancel)?;
            let time = timing.wall.median;
            if time > curve.slow_frame {
                curve.slow.push(Slow {
                    work: aim.work(),
                    texels: area,
                    time,
                });
            }
            let map = renderer.read_caustic(receiver)?;
            let estimated = match aim {
                Aim::Samples(_) => None,
                _ => renderer.estimated_error()?,
            };
            let point = truth.judge(
                &map,
                &settings,
                (aim, estimated),
                renderer.samples()?,
                timing,
            )?;
            measured[index].push(Measured {
                point,
                thumbnail: thumbnail(&map),
            });
        }
        let strips = strips(&curves, &measured, &truth);
        let verdicts = verdicts(&curves, &measured, is_main, &truth, &scene, &left_out);
        let series: Vec<Series> = (curves.iter().zip(measured))
            .filter(|(_, measured)| !measured.is_empty())
            .map(|(curve, measured)| Series {
                label: curve.label.into(),
                points: measured.into_iter().map(|m| m.point).collect(),
            })
            .collect();
        if !series.is_empty() {
            charts.push(SceneChart {
                scene: name.into(),
                receiver: receiver_name.clone(),
                light_map: texels,
                reference_error: truth.error,
                series,
                peers: Vec::new(),
                strips,
                verdicts,
            });
        }
    }
    if charts.is_empty() {
        return Err(useless("no method can render its caustic".into()));
    }
    Ok(charts)
}

/// The light whose caustic a method leaves out.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Missing {
    All,
    Environment,
}

fn missing_light(scene: &Scene, method: Method) -> Option<Missing> {
    let is_environment = |kind: &LightKind| matches!(kind, LightKind::Environment { .. });
    let casting: Vec<_> = (scene.lights.iter())
        .filter(|light| light.kind.casts_caustics())
        .collect();
    let environments = (casting.iter())
        .filter(|light| is_environment(&light.kind))
        .count();
    match (method, casting.len() - environments, environments) {
        (Method::Pinhole | Method::Footprint, ..) | (_, _, 0) => None,
        (_, 0, _) => Some(Missing::All),
        _ => Some(Missing::Environment),
    }
}

/// A point of a curve, with its light map for a strip.
struct Measured {
    point: Point,
    thumbnail: RgbImage,
}

/// The reference at one size of the light map.
struct Truth {
    map: RgbImage,
    /// Relative.
    error: f64,
}

impl Truth {
    fn new(reference: &Reference, [width, height]: [u32; 2]) -> Self {
        let coarse = reference.coarser(reference.width / width);
        assert_eq!([coarse.width, coarse.height], [width, height]);
        Self {
            map: coarse.image(),
            error: coarse.relative_error,
        }
    }

    fn judge(
        &self,
        map: &RgbImage,
        settings: &Settings,
        (aim, estimated): (Aim, Option<f32>),
        samples: u32,
        timing: Timing,
    ) -> Result<Point> {
        let comparison = compare(map, &self.map)?;
        let lit = "the reference is not black";
        let l1 = comparison.l1.expect(lit);
        let frames = match timing.frames {
            1 => "one frame, as it is slow".into(),
            frames => format!("median of {frames} frames"),
        };
        Ok(Point {
            samples: samples.into(),
            light_map: [map.width, map.height],
            settings: match settings.method {
                Method::Pinhole => format!(
                    "ε = {} squared patch diameters, filter {}",
                    settings.epsilon,
                    if settings.filter { "on" } else { "off" }
                ),
                _ => match estimated {
                    None => format!("{aim} asked for"),
                    Some(error) => format!(
                        "{aim} asked for, error {} % estimated",
                        figure(100.0 * f64::from(error))
                    ),
                },
            },
            l1,
            l2: comparison.l2.expect(lit),
            energy_ratio: comparison.energy_ratio.expect(lit),
            wall: timing.wall,
            gpu: timing.gpu,
            above_floor: l1 > 2.0 * self.error,
            note: Some(frames),
        })
    }
}

struct Timing {
    wall: Spread,
    gpu: Option<Spread>,
    frames: usize,
}

/// Repeats the caustic until its time is known, which was `before`, s, with fewer samples.
fn time_frames(
    renderer: &mut Renderer,
    before: Option<f64>,
    seconds: f64,
    cancel: &AtomicBool,
) -> Result<Timing> {
    let frame = |renderer: &mut Renderer| -> Result<(f64, Option<f64>)> {
        if cancel.load(Ordering::Relaxed) {
            return Err(Error::Cancelled);
        }
        renderer.invalidate();
        let start = Instant::now();
        renderer.caustic()?;
        let wall = start.elapsed().as_secs_f64();
        Ok((
            wall,
            renderer.take_times().iter().map(|pass| pass.gpu).sum(),
        ))
    };
    // This frame also pays for what drivers put off, and for learning what the work costs.
    let (mut first, mut gpu) = frame(renderer)?;
    if first > ONCE && before.is_none_or(|before| first > COMPILED * before) {
        (first, gpu) = frame(renderer)?;
    }
    let frames = match first > ONCE {
        true => vec![(first, gpu)],
        false => {
            let count = (seconds / first).clamp(FRAMES[0], FRAMES[1]) as usize;
            (0..count)
                .map(|_| frame(renderer))
                .collect::<Result<Vec<_>>>()?
        }
    };
    let walls: Vec<f64> = frames.iter().map(|(wall, _)| *wall).collect();
    let gpus: Option<Vec<f64>> = frames.iter().map(|(_, gpu)| *gpu).collect();
    Ok(Timing {
        wall: Spread::of(&walls),
        gpu: gpus
            .filter(|times| times.iter().all(|&time| time > 0.0))
            .map(|times| Spread::of(&times)),
        frames: frames.len(),
    })
}

/// The map in at most [`THUMBNAIL`] texels a side, averaged.
fn thumbnail(map: &RgbImage) -> RgbImage {
    let factor = map.width.max(map.height).div_ceil(THUMBNAIL);
    let [width, height] = [map.width, map.height].map(|side| side.div_ceil(factor));
    let mut sums = vec![([0.0f32; 3], 0.0f32); width as usize * height as usize];
    for (index, rgb) in map.pixels.iter().enumerate() {
        let [column, row] = [index as u32 % map.width, index as u32 / map.width];
        let (sum, count) = &mut sums[(row / factor * width + column / factor) as usize];
        (0..3).for_each(|channel| sum[channel] += rgb[channel]);
        *count += 1.0;
    }
    RgbImage {
        width,
        height,
        pixels: (sums.into_iter())
            .map(|(sum, count)| sum.map(|value| value / count))
            .collect(),
    }
}

/// What the methods achieve in about equal time, at the times that some method comes close to.
fn strips(curves: &[Curve], measured: &[Vec<Measured>], truth: &Truth) -> Vec<Strip> {
    let truth = thumbnail(&truth.map);
    let white = white(&truth);
    let error_scale = 0.1 * white;
    let times = STRIP_TIMES.into_iter();
    times
        .filter_map(|seconds| {
            let distance = |m: &Measured| (m.point.wall.median / seconds).ln().abs();
            let nearest: Vec<(&Curve, &Measured)> = (curves.iter().zip(measured))
                .filter(|(curve, _)| curve.varied == Varied::Samples)
                .filter_map(|(curve, measured)| {
                    let nearest =
                        (measured.iter()).min_by(|a, b| distance(a).total_cmp(&distance(b)))?;
                    Some((curve, nearest))
                })
                .collect();
            let close = (nearest.iter()).any(|(_, m)| distance(m) < std::f64::consts::LN_2);
            close.then(|| Strip {
                seconds,
                error_scale,
                thumbnails: (nearest.into_iter())
                    .map(|(curve, measured)| Thumbnail {
                        label: curve.label.into(),
                        seconds: measured.point.wall.median,
                        l1: measured.point.l1,
                        light_map: Picture::of_light_map(&measured.thumbnail, -white.log2()),
                        error: Picture::of_error(&measured.thumbnail, &truth, error_scale),
                    })
                    .collect(),
            })
        })
        .collect()
}

/// Irradiance that only one lit texel in a hundred exceeds, W/m².
fn white(map: &RgbImage) -> f64 {
    let mut values: Vec<f32> = (map.pixels.iter())
        .map(|rgb| rgb.iter().sum::<f32>() / 3.0)
        .filter(|&value| value > 0.0)
        .collect();
    values.sort_by(f32::total_cmp);
    f64::from(values[(values.len() - 1) * 99 / 100])
}

/// Seconds to an error of `goal`, between measurements of (seconds, error) that become finer.
fn time_to(goal: f64, measured: &[[f64; 2]]) -> Option<f64> {
    let reached = measured.iter().position(|&[_, error]| error <= goal)?;
    let [[slow, fine], [fast, coarse]] =
        [reached, reached.saturating_sub(1)].map(|index| measured[index].map(f64::ln));
    let share = if fine < coarse {
        (coarse - goal.ln()) / (coarse - fine)
    } else {
        1.0 // the first one is good enough
    };
    Some((fast + share * (slow - fast)).exp())
}

/// How long the curves take to an error of [`EQUAL`], beside the first.
fn at_equal_error(curves: &[Curve], measured: &[Vec<Measured>]) -> Option<String> {
    let of = |measured: &[Measured]| -> Vec<[f64; 2]> {
        let points = measured.iter().map(|m| &m.point);
        points.map(|point| [point.wall.median, point.l1]).collect()
    };
    let base = time_to(EQUAL, &of(measured.first()?))?;
    let times = (curves.iter().zip(measured)).filter_map(|(curve, measured)| {
        let measured = of(measured);
        let &[longest, _] = measured.last()?;
        let (not, seconds) = match time_to(EQUAL, &measured) {
            Some(seconds) => ("", seconds),
            None => ("not in ", longest),
        };
        let [ms, ratio] = [1e3 * seconds, seconds / base].map(figure);
        Some(format!("{} {not}{ms} ms ({ratio} ×)", curve.label))
    });
    Some(format!(
        "Time to an L1 of {} %, and its ratio to the first: {}.",
        100.0 * EQUAL,
        times.collect::<Vec<_>>().join("; ")
    ))
}

/// What the curves say, in words, and which there are not.
fn verdicts(
    curves: &[Curve],
    measured: &[Vec<Measured>],
    is_main: bool,
    truth: &Truth,
    scene: &Scene,
    dark: &[&str],
) -> Vec<String> {
    let mut verdicts: Vec<String> = at_equal_error(curves, measured).into_iter().collect();
    let mut slow = Vec::new();
    for (curve, measured) in curves.iter().zip(measured) {
        let lacks_light = missing_light(scene, curve.settings.method).is_some();
        match verdict(curve, measured, is_main, truth, lacks_light) {
            Some(verdict) => verdicts.push(verdict),
            None if !curve.main_only => slow.push(curve.label),
            None => {}
        }
    }
    let why_slow = "a frame takes too long";
    for (labels, why) in [
        (slow.as_slice(), why_slow),
        (dark, "they leave out the light of environments"),
    ] {
        if !labels.is_empty() {
            verdicts.push(format!("Left out, as {why}: {}.", labels.join("; ")));
        }
    }
    verdicts
}

/// Whether a curve falls below [`GOOD`], and if not, why; `None` without points.
fn verdict(
    curve: &Curve,
    measured: &[Measured],
    is_main: bool,
    truth: &Truth,
    lacks_light: bool,
) -> Option<String> {
    let label = curve.label;
    let percent = |value: f64| format!("{} %", figure(100.0 * value));
    let goal = 100.0 * GOOD;
    let best = (measured.iter().map(|m| &m.point)).min_by(|a, b| a.l1.total_cmp(&b.l1));
    let best = best?;
    let best_is = format!(
        "{} with {} samples in {} ms",
        percent(best.l1),
        best.samples,
        figure(1e3 * best.wall.median)
    );
    if best.l1 < GOOD {
        return Some(format!("{label} falls below {goal} %: {best_is}."));
    }
    // Four times the samples that win less than this say that samples are not what it lacks. Nor can they mend
    // what is no area.
    let stuck = match measured {
        _ if curve.settings.area == Area::Product => true,
        [.., coarse, fine] => fine.point.l1 > STUCK * coarse.point.l1,
        _ => curve.settings.method != Method::Points,
    };
    let reason = if !best.above_floor {
        format!("the reference is good to {} only", percent(truth.error))
    } else if lacks_light {
        "it leaves out the light of environments".into()
    } else if stuck {
        curve.floor.into()
    } else {
        "it needs more samples".into()
    };
    let limit = curve.limit(is_main, Some(best));
    let slow = match curve.slow.iter().any(|slow| slow.time > limit) {
        true => format!("; finer settings take more than {limit} s a frame"),
        false => String::new(),
    };
    Some(format!(
        "{label} does not fall below {goal} %, only to {best_is}: {reason}{slow}."
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_maps_divide_and_keep_their_proportion() {
        let scenes = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes");
        let scene = crate::scene::load(&scenes.join("corner.toml"))
            .unwrap()
            .scene;
        let plan = Plan::full();
        let wall = scene.object_index("wall").unwrap();
        let [width, height] = plan.reference_texels(&scene, wall);
        assert_eq!((width, height), (1024, 7 * 16));
        for side in plan.sides_for(&scene, wall) {
            let factor = 1024 / side;
            let texels = plan.texels(&scene, wall, side);
            assert_eq!(texels, [width / factor, height / factor]);
        }
    }

    #[test]
    fn ladders() {
        let plan = Plan::full();
        let ladder = |method, side| plan.ladder(method, side, [side, side]);
        assert_eq!(ladder(Method::Pinhole, 64), [256, 1024, 4096]);
        assert_eq!(
            ladder(Method::Footprint, 64),
            [256, 1024, 4096, 16384, 65536]
        );
        assert_eq!(
            ladder(Method::Footprint, 256),
            [256, 1024, 4096, 16384, 65536, 262144, 1048576]
        );
        assert_eq!(ladder(Method::Points, 1024), [1 << 20, 1 << 22]);
        assert_eq!(
            Plan::quick().ladder(Method::Footprint, 64, [64, 64]),
            [256, 4096]
        );
    }

    #[test]
    fn finer_than_slow_is_too_slow() {
        let mut curve = curves(Method::Points).remove(0);
        curve.slow.push(Slow {
            work: 1000.0,
            texels: 64,
            time: 2.0,
        });
        let is_too_slow =
            |samples, texels, limit| curve.is_too_slow(Aim::Samples(samples), texels, limit);
        assert!(is_too_slow(1000, 64, 1.0) && is_too_slow(4000, 256, 1.0));
        assert!(!is_too_slow(999, 256, 1.0) && !is_too_slow(4000, 63, 1.0));
        assert!(!is_too_slow(1000, 64, 4.0));
    }

    #[test]
    fn times_are_interpolated() {
        let near =
            |time: Option<f64>, expected: f64| (time.unwrap() / expected - 1.0).abs() < 1e-12;
        // Ten times the time, a hundredth of the error.
        let measured = [[1.0, 1.0], [10.0, 0.01], [100.0, 0.02]];
        assert!(near(time_to(1.0, &measured), 1.0));
        assert!(near(time_to(0.1, &measured), 10f64.sqrt()));
        assert!(near(time_to(0.01, &measured), 10.0));
        assert!(near(time_to(5.0, &measured), 1.0));
        assert_eq!(time_to(0.001, &measured), None);
        assert_eq!(time_to(0.1, &[]), None);
    }

    #[test]
    fn thumbnails_are_averages() {
        let map = RgbImage {
            width: 256,
            height: 3,
            pixels: (0..768).map(|i| [i as f32, 1.0, 0.0]).collect(),
        };
        let small = thumbnail(&map);
        assert_eq!((small.width, small.height), (128, 2));
        assert_eq!(
            small.pixels[0],
            [(0.0 + 1.0 + 256.0 + 257.0) / 4.0, 1.0, 0.0]
        );
        // The last row has half as many.
        assert_eq!(small.pixels[255], [(766.0 + 767.0) / 2.0, 1.0, 0.0]);
    }
}
