//! `nephroid chart`: speed against accuracy.

use super::files::{load_scene, make_folder};
use super::shipped;
use super::signals::cancelled;
use super::terminal::{escaped, log, log_some, print, progress_bar};
use clap::Args;
use indicatif::ProgressBar;
use nephroid::gpu::{Context, ContextOptions};
use nephroid::measure::chart::{Chart, Peer, SceneChart, read_peers, write};
use nephroid::measure::sweep::{Plan, Step, Subject, sweep};
use nephroid::reference::{Cached, Options, cached_caustic};
use nephroid::scene::Scene;
use nephroid::{Error, Result};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Chart the speed of every method against its accuracy
///
/// Writes chart.html, chart.svg, chart.csv and chart.json after every scene. Errors are relative to
/// references from the CPU, which are kept in the user's cache folder.
#[derive(Args)]
pub struct Arguments {
    /// Scene files; default: the scenes of nephroid that are made for measurements
    #[arg(value_name = "SCENE")]
    scenes: Vec<PathBuf>,
    /// Folder to write to; created if it does not exist
    #[arg(short, long, value_name = "DIR")]
    output: PathBuf,
    /// Measurements of other renderers (.json), shown with the light map of 256 texels
    #[arg(long, value_name = "FILE")]
    peers: Option<PathBuf>,
    /// Receiver to chart; default: the first of each scene
    #[arg(long, value_name = "NAME")]
    receiver: Option<String>,
    /// Index or part of the name of the Vulkan device
    #[arg(long)]
    device: Option<String>,
    /// Measure only a few settings, on small light maps
    #[arg(long)]
    quick: bool,
}

/// Scenes that are charted by default; each is difficult for another reason. `table`, `coffee` and `pool_sky` are pictures: they
/// would add minutes without telling more than `ring`, `lamp`, `ball` and `pool`. The receiver of `globe` is not a rect.
const CHARTED: [&str; 14] = [
    "ball",
    "blocker",
    "bumps",
    "corner",
    "dish",
    "lamp",
    "mesh_animal",
    "mesh_cage",
    "mesh_part",
    "mesh_rock",
    "mesh_scan",
    "mirror",
    "pool",
    "ring",
];

struct ChartedScene {
    name: String,
    scene: Scene,
    receiver: usize,
}

pub fn run(arguments: &Arguments) -> Result<()> {
    // All input is checked before the minutes of work.
    let peers = match &arguments.peers {
        Some(file) => read_peers(file)?,
        None => Vec::new(),
    };
    let scenes = load_scenes(arguments)?;
    for peer in &peers {
        if !scenes.iter().any(|scene| scene.name == peer.scene) {
            log(
                "warning",
                &format!("{}: no scene `{}` here", peer.name, peer.scene),
            );
        }
    }
    let files = ["html", "svg", "csv", "json"].map(|kind| format!("chart.{kind}"));
    make_folder(&arguments.output, &files)?;
    let context = Context::new(&ContextOptions {
        device: arguments.device.clone(),
        validate: false,
    })?;

    let plan = match arguments.quick {
        true => Plan::quick(),
        false => Plan::full(),
    };
    let mut chart = Chart::new(context.info());
    let cancel = cancelled();
    let bar = progress_bar(BAR as u64 * scenes.len() as u64);
    let mut result = Ok(());
    for (index, scene) in scenes.iter().enumerate() {
        let measured = measure(&context, scene, &plan, &bar, index, cancel);
        match measured {
            Ok(mut charts) => {
                add_peers(&mut charts, &peers, &plan);
                chart.scenes.extend(charts);
                write(&chart, &arguments.output)?;
            }
            Err(error) => {
                result = Err(error);
                break;
            }
        }
    }
    bar.finish_and_clear();
    for scene in &chart.scenes {
        let [width, height] = scene.light_map;
        print(&format!(
            "{}: {}, {width} x {height}",
            scene.scene, scene.receiver
        ))?;
        for verdict in &scene.verdicts {
            print(&format!("  {verdict}"))?;
        }
    }
    let page = arguments.output.join("chart.html");
    if !chart.scenes.is_empty() {
        print(&page.display().to_string())?;
    }
    if result.is_err() && !chart.scenes.is_empty() {
        log("note", &format!("{} has the scenes before", page.display()));
    }
    result
}

/// Steps of the progress bar per scene, and the share of them that the reference takes.
const BAR: f64 = 1000.0;
const REFERENCE_SHARE: f64 = 0.4;

fn measure(
    context: &Arc<Context>,
    charted: &ChartedScene,
    plan: &Plan,
    bar: &ProgressBar,
    index: usize,
    cancel: &AtomicBool,
) -> Result<Vec<SceneChart>> {
    let ChartedScene {
        name,
        scene,
        receiver,
    } = charted;
    let show = |fraction: f64, message: String| {
        bar.set_position((BAR * (index as f64 + fraction)) as u64);
        bar.set_message(escaped(&format!("{name}: {message}")));
    };
    let options = Options {
        error: plan.reference_error,
        ..Options::default()
    };
    show(0.0, "reference".into());
    let Cached {
        reference,
        warnings,
        ..
    } = cached_caustic(
        scene,
        *receiver,
        plan.reference_texels(scene, *receiver),
        &options,
        &mut |progress| show(REFERENCE_SHARE * progress.fraction, "reference".into()),
        cancel,
    )?;
    log_some("warning", &warnings);
    let subject = Subject {
        name,
        scene,
        receiver: *receiver,
        reference: &reference,
    };
    let mut progress = |step: &Step| {
        let fraction = REFERENCE_SHARE + (1.0 - REFERENCE_SHARE) * step.fraction;
        let [width, height] = step.texels;
        show(
            fraction,
            format!("{}, {}, {width} x {height}", step.curve, step.aim),
        );
    };
    sweep(context, &subject, plan, &mut progress, cancel)
}

/// The scenes asked for, or [`CHARTED`].
fn load_scenes(arguments: &Arguments) -> Result<Vec<ChartedScene>> {
    let files = match arguments.scenes.as_slice() {
        [] => shipped::named(&CHARTED)?,
        scenes => scenes.to_vec(),
    };
    let mut scenes: Vec<ChartedScene> = Vec::new();
    for file in &files {
        let scene = load_scene(file)?.scene;
        let stem = file.file_stem().unwrap_or(file.as_os_str());
        let name = stem.to_string_lossy().into_owned();
        if scenes.iter().any(|other| other.name == name) {
            return Err(Error::Usage {
                reason: format!("two scenes are called {name}"),
                remedy: "name each scene once, and give files different names".into(),
            });
        }
        let receiver = find_receiver(file, &scene, arguments.receiver.as_deref())?;
        scenes.push(ChartedScene {
            name,
            scene,
            receiver,
        });
    }
    Ok(scenes)
}

fn find_receiver(file: &Path, scene: &Scene, name: Option<&str>) -> Result<usize> {
    let receivers: Vec<usize> = scene.planar_receivers().map(|(index, ..)| index).collect();
    let name_of = |&index: &usize| scene.objects[index].name.as_str();
    let found = match name {
        None => receivers.first(),
        Some(name) => receivers.iter().find(|index| name_of(index) == name),
    };
    found.copied().ok_or_else(|| Error::Usage {
        reason: match name {
            Some(name) => format!("{} has no planar receiver called `{name}`", file.display()),
            None => format!("{} has no planar receiver", file.display()),
        },
        remedy: match receivers.is_empty() {
            true => "give a diffuse rect of the scene a `lightmap = [256, 256]`".into(),
            false => {
                let names: Vec<&str> = receivers.iter().map(name_of).collect();
                format!("choose one with --receiver: {}", names.join(", "))
            }
        },
    })
}

/// Adds other renderers' measurements to the charts whose light map has the main size.
fn add_peers(charts: &mut [SceneChart], peers: &[Peer], plan: &Plan) {
    for chart in charts {
        if chart.light_map.into_iter().max() == Some(plan.main_side) {
            let own = peers.iter().filter(|peer| peer.scene == chart.scene);
            chart.peers = own.cloned().collect();
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_shipped_scene_is_charted_or_named_here() {
        let mut known = shipped::named(&CHARTED).unwrap();
        for file in &known {
            let scene = load_scene(file).unwrap().scene;
            assert!(find_receiver(file, &scene, None).is_ok());
        }
        known.extend(
            shipped::named(&[
                "coffee",
                "engineered",
                "glass_ball",
                "globe",
                "lens",
                "pool_sky",
                "prism",
                "table",
                "tumbler",
                "two_mirrors",
                "wine",
            ])
            .unwrap(),
        );
        known.sort();
        assert_eq!(known, shipped::all().unwrap());
    }
}
