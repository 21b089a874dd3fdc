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
//! [`flux_balance`] counts the light by where it ends, over the whole scene (`flux.rs`).
//!
//! Both methods draw rounds of [`REPLICATES`] independently scrambled batches of Sobol points, and the
//! spread of the batches gives the standard error (Owen, *Monte Carlo theory, methods and
//! examples*, chapter 17).

mod cache;
mod chains;
mod coarser;
mod estimate;
mod flux;
mod gather;
mod lights;
mod media;
mod mirrors;
mod problem;
mod receiver;
mod rounds;
mod sequence;
mod trace;
mod view;
mod visibility;

use crate::error::{Error, Result};
use crate::image_file::RgbImage;
use crate::scene::{Scene, light_map_side, memory};
use gather::Gathering;
use lights::Emitter;
use problem::{Chains, Problem, receiver_of};
use rounds::{Method, check_error};
use std::sync::atomic::AtomicBool;
use trace::LightTracing;
use visibility::Blockers;

pub use cache::{Cached, cache_entry_bytes, cached_caustic, cached_view, read_cache_entry};
pub use estimate::{Map, REPLICATES, to_f32};
pub use flux::{FluxReference, flux_balance};
pub use rounds::{Options, Progress};
pub(crate) use sequence::split_mix;
pub use view::{MAX_VIEW_SIDE, View, view};
pub use visibility::Triangle;

/// Of the results: raised when the same input gives other numbers, or more of them, so that what [`cached_caustic`]
/// kept before is not taken for them.
const VERSION: u32 = 6;

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
    /// Its standard error, W. It is much less than those of the texels, whose errors depend on each other, would give.
    pub received_flux_error: [f64; 3],
}

impl Reference {
    /// The irradiance as an image of `width` × `height` texels, W/m².
    pub fn image(&self) -> RgbImage {
        RgbImage {
            width: self.width,
            height: self.height,
            pixels: to_f32(&self.irradiance),
        }
    }
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
    Ok(Reference {
        width,
        height,
        received_flux: problem.receiver.flux(&solution.mean),
        received_flux_error: solution.flux_error,
        irradiance: solution.mean,
        standard_error: solution.standard_error,
        relative_error: solution.relative_error,
        samples: solution.samples,
    })
}

/// Bytes of a texel at most, measured on scenes with and without an environment.
const TEXEL_BYTES: u64 = 240;

fn check(texels: [u32; 2], options: &Options) -> Result<()> {
    for side in texels {
        if let Err(reason) = light_map_side(side.into()) {
            return Err(Error::Usage {
                reason,
                remedy: "ask for another size".into(),
            });
        }
    }
    let count = texels.map(u64::from).iter().product::<u64>();
    memory::check(&format!("{count} texels"), count * TEXEL_BYTES).map_err(|reason| {
        Error::Usage {
            reason,
            remedy: "ask for fewer texels".into(),
        }
    })?;
    check_error(options)
}
