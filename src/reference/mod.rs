//! Ground truth on the CPU, in f64: the irradiance of a receiver from light that met exactly one
//! specular surface, here a mirror,
//!
//! ```text
//! E(y) = ∫_S L(ω(x,y)) F(x) V cosθ_x cosθ_y / |x−y|² dA          [W/m²]
//! ```
//!
//! averaged over every texel, unbiased, with a standard error; and, where the scene asks for more than one interface, from light
//! that met more of them (`chains.rs`). Independent of the renderer, which solves the same problem:
//!
//! - Surfaces are their flat triangles. An element dA of a mirror receives E max(n·s, 0) dA from a
//!   light in direction s, n the interpolated and normalised vertex normal, and reflects about n.
//!   It reflects nothing where the light or the reflected ray is behind the flat triangle.
//! - A mirror's back absorbs; a receiver counts what arrives on its front. A transparent surface
//!   reflects and refracts on both sides (`mirrors.rs`).
//! - The light map of a mesh holds the flux on what lies in each texel, over the area of that. Which
//!   that is, is the scene's (`scene/atlas.rs`).
//! - Every triangle of an object that blocks light blocks both legs, from both sides; a mirror's
//!   own other triangles too. So a coarse concave mirror with smooth normals loses what leaves
//!   it at a grazing angle into the neighbouring facet.
//!
//! | part of the light | method | file |
//! |---|---|---|
//! | suns; lamps; bright parts of environments; mirrors nearby; all that met several surfaces | light tracing | `trace.rs`, `chains.rs` |
//! | dim parts of environments | gathering | `gather.rs` |
//!
//! Both draw rounds of [`REPLICATES`] independently scrambled batches of Sobol points, and the
//! spread of the batches gives the standard error (Owen, *Monte Carlo theory, methods and
//! examples*, chapter 17).

mod cache;
mod chains;
mod coarser;
mod estimate;
mod gather;
mod lights;
mod media;
mod mirrors;
mod receiver;
mod rounds;
mod sequence;
mod trace;
mod view;
mod visibility;

use crate::error::{Error, Result};
use crate::scene::{Atlas, Geometry, NoLayout, Scene, light_map_side};
use chains::Chains;
use gather::Gathering;
use glam::DVec3;
use lights::Emitter;
use mirrors::MirrorTriangle;
use receiver::{CurvedReceiver, FlatReceiver, Receiver};
use rounds::Method;
use std::sync::atomic::{AtomicBool, Ordering};
use trace::LightTracing;
use visibility::Blockers;

pub use cache::{Cached, cached_caustic, cached_view, read_cache_entry};
pub use estimate::REPLICATES;
pub use rounds::Progress;
pub(crate) use sequence::split_mix;
pub use view::{MAX_VIEW_SIDE, View, view};

/// Of the results: raised when the same input gives other numbers, so that what [`cached_caustic`]
/// kept before is not taken for them.
const VERSION: u32 = 4;

/// Texels from the top row, RGB.
pub type Map = Vec<[f64; 3]>;

/// When to stop, and with which random numbers.
#[derive(Debug, Clone, Copy)]
pub struct Options {
    /// Relative error to reach, see [`Reference::relative_error`].
    pub error: f64,
    /// Rays and pairs of points after which to stop in any case.
    pub max_samples: u64,
    /// The same seed gives the same bits on any number of cores.
    pub seed: u32,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            error: 0.005,
            max_samples: 4_000_000_000,
            seed: 0,
        }
    }
}

/// Irradiance of a receiver.
#[derive(Debug, Clone)]
pub struct Reference {
    pub width: u32,
    pub height: u32,
    /// Texel averages, RGB, W/m²; last row at v = 0, column 0 at u = 0.
    pub irradiance: Map,
    /// Standard error of every value of `irradiance`, W/m².
    pub standard_error: Map,
    /// Expected L1 error, Σ|E − truth| / ΣE over all texels and channels, if errors are normal:
    /// √(2/π) Σσ / ΣE. 0 where no light arrives.
    pub relative_error: f64,
    /// Rays and pairs of points that were tried.
    pub samples: u64,
    /// Flux that the receiver collects, RGB, W.
    pub received_flux: [f64; 3],
}

/// What is to be solved, in the form that both methods use.
struct Problem<'a> {
    receiver: Receiver,
    mirrors: &'a [MirrorTriangle],
    emitters: &'a [Emitter],
    /// `None` if nothing blocks light, so nothing is traced.
    blockers: Option<&'a Blockers>,
    chains: &'a Chains,
    cancel: &'a AtomicBool,
}

impl Problem<'_> {
    fn blocked(&self, from: DVec3, along: DVec3, length: f64, origin: Option<u32>) -> bool {
        (self.blockers).is_some_and(|blockers| blockers.block(from, along, length, origin))
    }

    fn check_cancelled(&self) -> Result<()> {
        check_cancelled(self.cancel)
    }
}

fn check_cancelled(cancel: &AtomicBool) -> Result<()> {
    if cancel.load(Ordering::Relaxed) {
        return Err(Error::Cancelled);
    }
    Ok(())
}

/// Computes the irradiance of the receiver `scene.objects[receiver]` on `texels` (width, height)
/// from light that met specular surfaces, at most [`Scene::max_interfaces`].
///
/// Calls `progress` now and then, stops soon after `cancel` becomes true.
///
/// # Errors
/// [`Error::Usage`] if the object is not a receiver or the options make no sense,
/// [`Error::Cancelled`].
pub fn caustic(
    scene: &Scene,
    receiver: usize,
    texels: [u32; 2],
    options: &Options,
    progress: &mut dyn FnMut(&Progress),
    cancel: &AtomicBool,
) -> Result<Reference> {
    check(texels, options)?;
    let mirrors = mirrors::mirror_triangles(scene);
    let emitters: Vec<Emitter> = (scene.lights.iter())
        .filter(|light| light.kind.casts_caustics())
        .filter_map(Emitter::new)
        .collect();
    let blockers = Blockers::new(&mirrors::triangles_that_block(scene));
    let problem = Problem {
        receiver: receiver_of(scene, receiver, texels)?,
        mirrors: &mirrors,
        emitters: &emitters,
        blockers: blockers.as_ref(),
        chains: &Chains::new(scene, &mirrors),
        cancel,
    };
    let mut methods: Vec<Box<dyn Method + '_>> = Vec::new();
    methods.extend(LightTracing::new(&problem)?.map(|m| Box::new(m) as _));
    methods.extend(Gathering::new(&problem).map(|m| Box::new(m) as _));
    let solution = rounds::solve(methods, problem.receiver.texels(), options, progress)?;
    let [width, height] = texels;
    let received = (solution.mean.iter().enumerate())
        .map(|(texel, &e)| problem.receiver.texel_area(texel) * DVec3::from(e))
        .sum::<DVec3>();
    Ok(Reference {
        width,
        height,
        received_flux: received.to_array(),
        irradiance: solution.mean,
        standard_error: solution.standard_error,
        relative_error: solution.relative_error,
        samples: solution.samples,
    })
}

fn receiver_of(scene: &Scene, receiver: usize, texels: [u32; 2]) -> Result<Receiver> {
    let not_one = || Error::Usage {
        reason: format!("object {receiver} of the scene is not a receiver"),
        remedy: "choose a rect or a mesh with a light map".into(),
    };
    let object = (scene.objects.get(receiver))
        .filter(|object| object.light_map.is_some())
        .ok_or_else(not_one)?;
    match &object.geometry {
        Geometry::Rect(rect) => Ok(Receiver::Flat(FlatReceiver::new(*rect, texels))),
        Geometry::Mesh(mesh) => {
            let (atlas, _) = Atlas::of(object, texels).map_err(NoLayout::into_error)?;
            let curved = CurvedReceiver::new(mesh, atlas).ok_or_else(not_one)?;
            Ok(Receiver::Curved(curved))
        }
        Geometry::Waves(_) => Err(not_one()),
    }
}

fn check(texels: [u32; 2], options: &Options) -> Result<()> {
    for side in texels {
        if let Err(reason) = light_map_side(side.into()) {
            return Err(Error::Usage {
                reason,
                remedy: "ask for another size".into(),
            });
        }
    }
    check_error(options)
}

fn check_error(options: &Options) -> Result<()> {
    if options.error > 0.0 && options.error < 1.0 {
        return Ok(());
    }
    Err(Error::Usage {
        reason: format!("a relative error of {}", options.error),
        remedy: "ask for an error between 0 and 1, such as 0.005".into(),
    })
}
