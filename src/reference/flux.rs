//! The balance of flux by a random walk: where the light ends that comes onto mirrors and interfaces. Independent of the renderer,
//! which counts its own rays.

use crate::error::Result;
use crate::flux_balance::{Flux, FluxBalance};
use crate::reference::chains::choose;
use crate::reference::estimate::{Estimate, Moments, REPLICATES};
use crate::reference::lights::Emitter;
use crate::reference::media::{Media, Sides};
use crate::reference::mirrors::{
    Distribution, Leaving, MirrorTriangle, Surface, mirror_triangles, triangles_that_block,
};
use crate::reference::problem::{Chains, check_cancelled};
use crate::reference::sequence::{Choices, SEQUENCE_LENGTH, split_mix, stratified};
use crate::reference::visibility::Blockers;
use crate::scene::Scene;
use glam::DVec3;
use rayon::prelude::*;
use serde::Serialize;
use std::sync::atomic::AtomicBool;

/// An estimate of the balance of flux.
#[derive(Debug, Clone, Serialize)]
pub struct FluxReference {
    pub mean: FluxBalance,
    /// Standard error of every entry of `mean`, W.
    pub standard_error: FluxBalance,
    /// Number of rays from the lights.
    pub rays: u64,
}

/// Sequences of points for each light in a replicate.
const SEQUENCES: u32 = 4;

/// Estimates where the light of the scene's lights ends that comes onto objects that reflect or refract light and cast shadows,
/// with about a million rays of every light. The same seed gives the same bits. `None` where no light reaches such an object.
///
/// Of [`FluxBalance::cut_off`], only `interfaces` and `normals` have light, and nothing is left to `sampling`. Light on a mesh
/// receiver has landed, however many surfaces it met.
///
/// # Errors
/// [`crate::Error::Cancelled`]
pub fn flux_balance(
    scene: &Scene,
    seed: u32,
    cancel: &AtomicBool,
) -> Result<Option<FluxReference>> {
    let Some(walk) = Walk::new(scene) else {
        return Ok(None);
    };
    let first = split_mix(seed.into()) as u32;
    let sequences = SEQUENCES * walk.sources.len() as u32;
    let mut replicates: Vec<FluxBalance> = (0..REPLICATES)
        .into_par_iter()
        .map(|number| {
            check_cancelled(cancel)?;
            Ok(walk.replicate(first.wrapping_add(number * sequences)))
        })
        .collect::<Result<_>>()?;
    let mut mean = walk.empty();
    let mut standard_error = mean.clone();
    let mut moments = vec![Moments::default(); fluxes_of(&mut mean).len()];
    for replicate in &mut replicates {
        for (moments, flux) in moments.iter_mut().zip(fluxes_of(replicate)) {
            moments.add(*flux);
        }
    }
    let estimate = Estimate::from_moments(&moments);
    for (flux, value) in fluxes_of(&mut mean).into_iter().zip(estimate.mean) {
        *flux = value;
    }
    for (flux, variance) in (fluxes_of(&mut standard_error).into_iter()).zip(estimate.variance) {
        *flux = variance.map(f64::sqrt);
    }
    Ok(Some(FluxReference {
        mean,
        standard_error,
        rays: u64::from(REPLICATES * sequences) * u64::from(SEQUENCE_LENGTH),
    }))
}

/// The entries that the walk fills.
fn fluxes_of(balance: &mut FluxBalance) -> Vec<&mut Flux> {
    let mut fluxes = vec![
        &mut balance.incoming,
        &mut balance.on_other_surfaces,
        &mut balance.absorbed_by_media,
        &mut balance.absorbed_by_mirrors,
        &mut balance.left_scene,
        &mut balance.cut_off.interfaces,
        &mut balance.cut_off.normals,
    ];
    fluxes.extend(&mut balance.landed);
    fluxes
}

fn add(entry: &mut Flux, flux: DVec3) {
    *entry = (DVec3::from(*entry) + flux).to_array();
}

/// A light and how to choose triangles for it.
struct Source {
    emitter: Emitter,
    triangles: Distribution,
}

/// What a walk needs to know of a scene.
struct Walk {
    /// Triangles of casters that block light.
    mirrors: Vec<MirrorTriangle>,
    sources: Vec<Source>,
    blockers: Blockers,
    chains: Chains,
    /// For each triangle that blocks light, the normal of its front, if it is of a receiver.
    receivers: Vec<Option<DVec3>>,
}

/// Light that arrives at a mirror or an interface.
struct Arrival<'a> {
    /// m
    position: DVec3,
    mirror: &'a MirrorTriangle,
    /// RGB, W.
    flux: DVec3,
    sides: Sides,
    leaving: [Option<Leaving>; 2],
}

impl Walk {
    /// `None` if no light reaches a caster that blocks light.
    fn new(scene: &Scene) -> Option<Self> {
        let mut mirrors = mirror_triangles(scene);
        mirrors.retain(|mirror| mirror.blocker.is_some());
        let lights = (scene.lights.iter()).filter(|light| light.kind.casts_caustics());
        let sources: Vec<Source> = lights
            .filter_map(Emitter::new)
            .filter_map(|emitter| {
                let flux = mirrors.iter().map(|mirror| emitter.flux_onto(mirror));
                let triangles = Distribution::new(flux)?;
                Some(Source { emitter, triangles })
            })
            .collect();
        let corners = triangles_that_block(scene);
        let blocking = scene.objects.iter().filter(|object| object.blocks_light);
        let is_of_receiver = blocking.flat_map(|object| {
            let count = object.geometry.triangle_count();
            std::iter::repeat_n(object.light_map.is_some(), count)
        });
        let receivers = (corners.iter().zip(is_of_receiver))
            .map(|(&[a, b, c], is_of_receiver)| is_of_receiver.then(|| (b - a).cross(c - a)))
            .collect();
        Some(Self {
            chains: Chains::new(scene, &mirrors),
            blockers: Blockers::new(&corners)?,
            mirrors,
            sources,
            receivers,
        })
        .filter(|walk| !walk.sources.is_empty())
    }

    fn empty(&self) -> FluxBalance {
        FluxBalance {
            landed: vec![[0.0; 3]; self.chains.max_interfaces as usize],
            ..FluxBalance::default()
        }
    }

    /// The balance by [`SEQUENCES`] sequences of points for each light, with as many seeds from `seed` on.
    fn replicate(&self, mut seed: u32) -> FluxBalance {
        let mut balance = self.empty();
        for source in &self.sources {
            for stratum in 0..SEQUENCES {
                // Every sequence covers its own part of the surfaces.
                for (point, mut choices) in stratified(seed, stratum, SEQUENCES) {
                    if let Some(arrival) = self.first(source, point, &mut choices) {
                        add(&mut balance.incoming, arrival.flux);
                        self.follow(arrival, &mut choices, &mut balance);
                    }
                }
                seed = seed.wrapping_add(1);
            }
        }
        balance
    }

    /// Light on its first surface; `None` where none comes.
    fn first(
        &self,
        source: &Source,
        [u0, u1, u2, u3]: [f64; 4],
        choices: &mut Choices,
    ) -> Option<Arrival<'_>> {
        let (chosen, u0) = source.triangles.pick(u0);
        let mirror = &self.mirrors[chosen];
        let point = mirror.point(u0, u1);
        let light = source.emitter.draw(point.position, u2, u3);
        let (toward, normal) = (light.direction, mirror.geometric_normal);
        let front = normal.dot(toward) > 0.0;
        let cosine = point.normal.dot(toward) * if front { 1.0 } else { -1.0 };
        let is_lit = cosine > 0.0
            && (front || mirror.surface.has_two_sides())
            && !(self.blockers).block(point.position, toward, light.distance, mirror.blocker);
        if !is_lit {
            return None;
        }
        let dielectrics = &self.chains.dielectrics;
        // All of the light has the colour of its wavelength, so that it adds up for every ray.
        let (wavelength, tint) = dielectrics.wavelength(|| choices.next());
        let sides = Media::air(wavelength).sides(dielectrics, mirror.object, front);
        let rays = f64::from(SEQUENCES * SEQUENCE_LENGTH) * source.triangles.probability(chosen);
        let transmitted = sides.media[0].transmittance(dielectrics, light.distance);
        Some(Arrival {
            position: point.position,
            mirror,
            flux: mirror.area * cosine / rays * (light.bright + light.dim) * tint * transmitted,
            leaving: (mirror.surface).leaving(sides.ior, toward, point.normal, normal),
            sides,
        })
    }

    /// Follows light to its end, along one ray of every surface.
    fn follow<'a>(&'a self, mut at: Arrival<'a>, choices: &mut Choices, balance: &mut FluxBalance) {
        for interfaces in 1.. {
            let sent: DVec3 = at
                .leaving
                .iter()
                .flatten()
                .map(|leaving| leaving.share)
                .sum();
            let absorbs = matches!(
                at.mirror.surface,
                Surface::Mirror(_) | Surface::Conductor { .. }
            );
            let rest = match absorbs && at.leaving[0].is_some() {
                true => &mut balance.absorbed_by_mirrors,
                false => &mut balance.cut_off.normals,
            };
            add(rest, at.flux * (DVec3::ONE - sent));
            let Some((leaving, probability, side)) = choose(at.leaving, choices) else {
                return;
            };
            let flux = at.flux * leaving.share / probability;
            let (media, from) = (at.sides.media[side], at.mirror.blocker);
            let ray = (at.position, leaving.direction);
            match self.next(ray, flux, media, from, interfaces, balance) {
                Some(next) => at = next,
                None => return,
            }
        }
    }

    /// The next surface that reflects or refracts light; `None` where the light ends before, which the balance then counts.
    fn next(
        &self,
        (mut origin, direction): (DVec3, DVec3),
        mut flux: DVec3,
        mut media: Media,
        mut from: Option<u32>,
        interfaces: u32,
        balance: &mut FluxBalance,
    ) -> Option<Arrival<'_>> {
        let dielectrics = &self.chains.dielectrics;
        loop {
            let nearest = (self.blockers).nearest(origin, direction, f64::INFINITY, from);
            let Some((blocker, distance, weights)) = nearest else {
                add(&mut balance.left_scene, flux);
                return None;
            };
            let arriving = flux * media.transmittance(dielectrics, distance);
            add(&mut balance.absorbed_by_media, flux - arriving);
            flux = arriving;
            let mirror = (self.chains.mirror_of_blocker.get(blocker as usize)).copied();
            let Some(mirror) = mirror
                .flatten()
                .map(|number| &self.mirrors[number as usize])
            else {
                let normal = self.receivers[blocker as usize];
                let end = match normal.is_some_and(|normal| normal.dot(direction) < 0.0) {
                    true => &mut balance.landed[interfaces as usize - 1],
                    false => &mut balance.on_other_surfaces,
                };
                add(end, flux);
                return None;
            };
            let front = mirror.geometric_normal.dot(direction) < 0.0;
            if !front && !mirror.surface.has_two_sides() {
                add(&mut balance.on_other_surfaces, flux);
                return None;
            }
            let sides = media.sides(dielectrics, mirror.object, front);
            origin += distance * direction;
            if !sides.is_interface {
                (media, from) = (sides.media[1], Some(blocker));
                continue;
            }
            if interfaces >= self.chains.max_interfaces {
                add(&mut balance.cut_off.interfaces, flux);
                return None;
            }
            let leaving = (mirror.surface).leaving_with_fallback(
                sides.ior,
                -direction,
                mirror.shading(weights),
                mirror.geometric_normal,
            );
            return Some(Arrival {
                position: origin,
                mirror,
                flux,
                sides,
                leaving,
            });
        }
    }
}
