//! Ground truth for the camera's view, in f64: the mean radiance of every pixel's box, unbiased but for the
//! texels of caustics (below), with a standard error.
//!
//! Paths start at the camera and go through at most 12 specular surfaces, by reflection at mirrors and
//! metals and by reflection and refraction at interfaces, with the shares of Fresnel's equations. They end
//!
//! - outside of the scene: they see the environment and the discs of suns, but no sun that is a point;
//! - in a lamp: its radiance. Lamps hide what is behind them and cast no shadow;
//! - on the front of a diffuse surface: albedo/π times its irradiance, which is direct light and, on receivers, the
//!   caustics;
//! - on the back of a diffuse surface, a mirror or a metal: black.
//!
//! Direct light comes from suns, lamps and the environment in a straight line past what blocks light,
//! transparent surfaces with `blocks_light` included; only light of an environment that casts no caustics
//! passes straight through these. Its cosine is that of the interpolated normal; directions that the flat triangle hides do not count. The caustics are those of [`super::caustic`]: the
//! light by specular surfaces, on the flat triangles of objects with a light map, and on those
//! only, as in the renderer. Where the camera sees them directly, they are exact; where it sees them by way
//! of a mirror or an interface, they are means over texels half as wide as the pixels that see the receiver
//! so from nearest, on at most 4096 texels a side, of meshes 2048.
//!
//! Where an interpolated normal would reflect a path of the camera into the flat triangle, the triangle's
//! own normal takes its place, as in the renderer.

mod caustics;
mod direct;
mod paths;

use super::estimate::Map;
use super::lights::Emitter;
use super::mirrors::{mirror_triangles, opaque_triangles_that_block, triangles_that_block};
use super::problem::{Chains, Problem, check_cancelled, receiver_of};
use super::rounds::{self, Method, Options, Progress, check_error};
use super::sequence::Choices;
use super::visibility::Blockers;
use crate::error::{Error, Result};
use crate::scene::{Geometry, MAX_LIGHT_MAP_SIDE, Scene, memory};
use direct::Direct;
use paths::{End, Paths};
use rayon::prelude::*;
use std::sync::atomic::AtomicBool;

/// Most pixels on a side of a view, as of a picture that `render` makes.
pub const MAX_VIEW_SIDE: u32 = 16_384;

/// Bytes of a pixel while a view is computed, with as many for each of its methods.
const PIXEL_BYTES: u64 = 200;

/// Texels across a pixel that sees the receiver from nearest.
const TEXELS_PER_PIXEL: f64 = 2.0;
/// Texels on a side of a rect's light map, and of a mesh's, at most.
const MOST_TEXELS: f64 = 4096.0;
const MOST_TEXELS_OF_MESH: f64 = 2048.0;
/// And at least, where no mirror shows the receiver.
const LEAST_TEXELS: f64 = 64.0;

/// The camera's view.
#[derive(Debug, Clone)]
pub struct View {
    pub width: u32,
    pub height: u32,
    /// Means over the pixels' boxes, RGB, W/m²/sr; from the top row.
    pub radiance: Map,
    /// Standard error of every value of `radiance`, W/m²/sr.
    pub standard_error: Map,
    /// Expected L1 error, Σ|L − truth| / ΣL over all pixels and channels, as
    /// [`Reference::relative_error`](super::Reference::relative_error).
    pub relative_error: f64,
    /// Camera paths, rays of light and pairs of points that were tried.
    pub samples: u64,
}

/// Computes the view of `scene.camera` on `size` (width, height) pixels.
///
/// Calls `progress` now and then, stops soon after `cancel` becomes true.
///
/// # Errors
/// [`Error::Usage`] if the size or the options make no sense or there is not enough memory,
/// [`Error::Cancelled`].
pub fn view(
    scene: &Scene,
    size: [u32; 2],
    options: &Options,
    progress: &mut dyn FnMut(&Progress),
    cancel: &AtomicBool,
) -> Result<View> {
    check(size, options)?;
    let pixels = u64::from(size[0]) * u64::from(size[1]);
    // Two methods a receiver, and direct light.
    let methods = 1 + 2 * scene.light_maps().len() as u64;
    let what = format!("a view of {} x {} pixels", size[0], size[1]);
    memory::check(&what, pixels * PIXEL_BYTES * (1 + methods))
        .map_err(|reason| usage(reason, "free some memory, or ask for fewer pixels"))?;
    let mirrors = mirror_triangles(scene);
    let (casting, others): (Vec<_>, Vec<_>) =
        (scene.lights.iter()).partition(|light| light.kind.casts_caustics());
    let mut emitters: Vec<Emitter> = casting.into_iter().filter_map(Emitter::new).collect();
    let casting = emitters.len();
    let blockers = Blockers::new(&triangles_that_block(scene));
    let opaque = match others.is_empty() {
        true => None,
        false => Blockers::new(&opaque_triangles_that_block(scene)),
    };
    emitters.extend(others.into_iter().filter_map(Emitter::new));
    let chains = Chains::new(scene, &mirrors);
    let paths = Paths::new(scene, size);
    let problems: Vec<(usize, Problem)> = texels_for(scene, &paths, cancel)?
        .into_iter()
        .map(|(object, texels)| {
            let problem = Problem {
                receiver: receiver_of(scene, object, texels)?,
                mirrors: &mirrors,
                emitters: &emitters[..casting],
                blockers: blockers.as_ref(),
                chains: &chains,
                cancel,
            };
            Ok((object, problem))
        })
        .collect::<Result<_>>()?;
    let mut methods: Vec<Box<dyn Method + '_>> = vec![Box::new(Direct::new(
        scene,
        &paths,
        [&emitters[..casting], &emitters[casting..]],
        [blockers.as_ref(), opaque.as_ref()],
        cancel,
    ))];
    for (object, problem) in &problems {
        methods.extend(caustics::methods(problem, *object, &paths)?);
    }
    let solution = rounds::solve(methods, paths.pixels(), options, progress)?;
    Ok(View {
        width: size[0],
        height: size[1],
        radiance: solution.mean,
        standard_error: solution.standard_error,
        relative_error: solution.relative_error,
        samples: solution.samples,
    })
}

fn usage(reason: String, remedy: &str) -> Error {
    Error::Usage {
        reason,
        remedy: remedy.into(),
    }
}

pub(super) fn check(size: [u32; 2], options: &Options) -> Result<()> {
    if size.iter().any(|side| !(1..=MAX_VIEW_SIDE).contains(side)) {
        let reason = format!(
            "a view has 1 to {MAX_VIEW_SIDE} pixels a side, not {} x {}",
            size[0], size[1]
        );
        return Err(usage(reason, "ask for another size"));
    }
    check_error(options)
}

/// The receivers and the texels of their light maps for the view.
fn texels_for(scene: &Scene, paths: &Paths, cancel: &AtomicBool) -> Result<Vec<(usize, [u32; 2])>> {
    let nearest = nearest(scene.objects.len(), paths, cancel)?;
    let mut texels = Vec::new();
    for (object, _) in scene.light_maps() {
        let texel = nearest[object] * paths.pixel_height() / TEXELS_PER_PIXEL;
        let side =
            |length: f64, most: f64| (length / texel).clamp(LEAST_TEXELS, most).ceil() as u32;
        match &scene.objects[object].geometry {
            Geometry::Rect(rect) => {
                let sides = [rect.edge_u, rect.edge_v].map(|edge| side(edge.length(), MOST_TEXELS));
                texels.push((object, sides));
            }
            geometry @ (Geometry::Mesh(_) | Geometry::Placed { .. }) => {
                let mesh = geometry.mesh();
                let area: f64 = (0..mesh.triangles.len())
                    .map(|t| mesh.vector_area(t).length())
                    .sum();
                // Charts fill some half of a light map.
                let wanted = side((2.0 * area).sqrt(), MOST_TEXELS_OF_MESH);
                texels.push((object, mesh_texels(scene, object, wanted)));
            }
            Geometry::Waves(_) => unreachable!("waves have no light map"),
        }
    }
    Ok(texels)
}

/// The scene's light map, some power of two times as fine, with at least `wanted` texels on a side if they
/// are allowed: so that what could be laid out for the scene can be here.
fn mesh_texels(scene: &Scene, object: usize, wanted: u32) -> [u32; 2] {
    let mut texels = scene.objects[object].light_map.expect("a receiver has one");
    while texels.iter().max() < Some(&wanted)
        && texels.iter().all(|side| 2 * side <= MAX_LIGHT_MAP_SIDE)
    {
        texels = texels.map(|side| 2 * side);
    }
    texels
}

/// Shortest path from the camera by way of a specular surface to each object, m; infinite where the middles
/// of pixels do not show it.
fn nearest(objects: usize, paths: &Paths, cancel: &AtomicBool) -> Result<Vec<f64>> {
    let far = || vec![f64::INFINITY; objects];
    let least = |a: Vec<f64>, b: Vec<f64>| a.into_iter().zip(b).map(|(a, b)| a.min(b)).collect();
    (0..paths.pixels())
        .into_par_iter()
        .with_min_len(1024)
        .try_fold(far, |mut nearest, pixel| {
            check_cancelled(cancel)?;
            let mut choices = Choices::new(pixel as u64);
            paths.follow(pixel, [0.5; 2], &mut choices, &mut |end, _| {
                if let End::Diffuse(point) = end
                    && point.bounces > 0
                {
                    let nearest = &mut nearest[point.object];
                    *nearest = nearest.min(point.length);
                }
            });
            Ok(nearest)
        })
        .try_reduce(far, |a, b| Ok(least(a, b)))
}
