//! What the camera sees without caustics: lamps, suns, environments, and their direct light on diffuse surfaces.

use super::paths::{DiffusePoint, End, Paths};
use crate::error::Result;
use crate::reference::estimate::{Estimate, Moments, REPLICATES};
use crate::reference::lights::{Directions, Emitter, Environment};
use crate::reference::rounds::{Method, moments_of_values, power_of_two};
use crate::reference::sequence::Choices;
use crate::reference::sequence::{sobol_4d, split_mix};
use crate::reference::visibility::Blockers;
use crate::scene::{Geometry, Scene};
use glam::DVec3;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;
use std::sync::atomic::AtomicBool;

/// Most texels of the distributions that all rects together have for their light from environments.
const MOST_TEXELS: usize = 1 << 23;

/// Camera paths, and at their diffuse ends rays to every light.
pub struct Direct<'a> {
    paths: &'a Paths,
    /// With what blocks each.
    emitters: Vec<(&'a Emitter, Option<&'a Blockers>)>,
    cancel: &'a AtomicBool,
    /// For every light and object: directions onto it where it is a rect and the light an environment.
    onto: Vec<Vec<Option<Arc<Directions>>>>,
}

impl<'a> Direct<'a> {
    /// `blockers` are for lights of each of the two kinds in `emitters`.
    pub fn new(
        scene: &Scene,
        paths: &'a Paths,
        emitters: [&'a [Emitter]; 2],
        blockers: [Option<&'a Blockers>; 2],
        cancel: &'a AtomicBool,
    ) -> Self {
        let emitters: Vec<_> = (emitters.into_iter().zip(blockers))
            .flat_map(|(emitters, blockers)| {
                emitters.iter().map(move |emitter| (emitter, blockers))
            })
            .collect();
        let onto = emitters.iter().map(|(emitter, _)| match emitter {
            Emitter::Environment(environment) => directions_onto(environment, scene),
            Emitter::Sun(_) | Emitter::Lamp(_) => vec![None; scene.objects.len()],
        });
        Self {
            onto: onto.collect(),
            paths,
            emitters,
            cancel,
        }
    }

    fn pixel(&self, pixel: usize, samples: u32, seed: u32) -> Moments {
        let mut moments = Moments::default();
        let pixel_seed = split_mix(u64::from(seed) << 32 | pixel as u64);
        for replicate in 0..REPLICATES {
            // Independent sequences for the place in the pixel and for each light.
            let seed = split_mix(pixel_seed ^ u64::from(replicate));
            let sequence = |number: usize| split_mix(seed.wrapping_add(number as u64)) as u32;
            let mut sum = DVec3::ZERO;
            for index in 0..samples {
                let [u, v, ..] = sobol_4d(index, sequence(0));
                let mut choices = Choices::new(split_mix(seed ^ u64::from(index) << 32));
                (self.paths).follow(pixel, [u, v], &mut choices, &mut |end, weight| {
                    let drawn = |light: usize| sobol_4d(index, sequence(1 + light));
                    sum += weight * self.radiance(&end, drawn);
                });
            }
            moments.add((sum / f64::from(samples)).to_array());
        }
        moments
    }

    /// An estimate of the radiance that leaves `end` toward the path, W/m²/sr. `drawn` has four numbers for
    /// each light.
    fn radiance(&self, end: &End, drawn: impl Fn(usize) -> [f64; 4]) -> DVec3 {
        match end {
            End::Lamp(radiance) => *radiance,
            End::Background(toward) => (self.emitters.iter())
                .map(|(light, _)| light.background(*toward))
                .sum(),
            End::Diffuse(point) => {
                let irradiance: DVec3 = (self.emitters.iter().enumerate())
                    .map(|(light, (emitter, blockers))| match emitter {
                        Emitter::Environment(environment) => {
                            let onto = self.onto[light][point.object].as_deref();
                            by_environment(environment, onto, *blockers, point, drawn(light))
                        }
                        Emitter::Sun(_) | Emitter::Lamp(_) => {
                            by_disc(emitter, *blockers, point, drawn(light))
                        }
                    })
                    .sum();
                point.albedo / PI * irradiance
            }
        }
    }
}

/// The cosine to the interpolated normal for light from the direction `toward` it that is before the
/// flat triangle and not blocked, otherwise 0.
fn cosine(blockers: Option<&Blockers>, point: &DiffusePoint, toward: DVec3, distance: f64) -> f64 {
    let cosine = point.shading.dot(toward);
    let arrives = cosine > 0.0
        && point.geometric.dot(toward) > 0.0
        && !blockers.is_some_and(|blockers| {
            blockers.block(point.position, toward, distance, point.blocker)
        });
    if arrives { cosine } else { 0.0 }
}

/// W/m²
fn by_disc(
    light: &Emitter,
    blockers: Option<&Blockers>,
    point: &DiffusePoint,
    [u, v, ..]: [f64; 4],
) -> DVec3 {
    let drawn = light.draw(point.position, u, v);
    cosine(blockers, point, drawn.direction, drawn.distance) * drawn.bright
}

/// By one direction of `onto`, or by one of the environment's own and one with the density cosine/π,
/// weighted by the balance heuristic (Veach, Guibas, *Optimally combining sampling techniques for Monte
/// Carlo rendering*, SIGGRAPH 1995). W/m².
fn by_environment(
    environment: &Environment,
    onto: Option<&Directions>,
    blockers: Option<&Blockers>,
    point: &DiffusePoint,
    [u0, u1, u2, u3]: [f64; 4],
) -> DVec3 {
    let estimate = |toward: DVec3, density: &dyn Fn(DVec3) -> f64| match cosine(
        blockers,
        point,
        toward,
        f64::INFINITY,
    ) {
        0.0 => DVec3::ZERO,
        cosine => cosine / density(toward) * environment.radiance(toward),
    };
    if let Some(onto) = onto {
        return estimate(onto.pick(u0, u1), &|toward| onto.density(toward));
    }
    let directions = environment.directions();
    let both = |toward: DVec3| directions.density(toward) + point.shading.dot(toward).max(0.0) / PI;
    let (tangent, bitangent) = point.shading.any_orthonormal_pair();
    let (y, x) = (TAU * u3).sin_cos();
    let across = u2.sqrt() * (x * tangent + y * bitangent);
    let by_cosine = across + (1.0 - u2).sqrt() * point.shading;
    estimate(directions.pick(u0, u1), &both) + estimate(by_cosine, &both)
}

/// For every object that is a diffuse rect, directions of light onto it; rects that face the same way share them.
fn directions_onto(environment: &Environment, scene: &Scene) -> Vec<Option<Arc<Directions>>> {
    let mut known: Vec<(DVec3, Option<Arc<Directions>>)> = Vec::new();
    (scene.objects.iter())
        .map(|object| {
            let Geometry::Rect(rect) = &object.geometry else {
                return None;
            };
            if scene.materials[object.material].kind.is_specular() {
                return None;
            }
            let normal = rect.normal();
            if let Some((_, directions)) = known.iter().find(|(of, _)| *of == normal) {
                return directions.clone();
            }
            if (known.len() + 1) * environment.texels() > MOST_TEXELS {
                return None;
            }
            let directions = environment.onto(normal).map(Arc::new);
            known.push((normal, directions.clone()));
            directions
        })
        .collect()
}

impl Method for Direct<'_> {
    /// Radiance from replicates of `samples` camera paths a pixel.
    fn round(&self, samples: u32, seed: u32, done: &mut dyn FnMut(u64)) -> Result<Estimate> {
        let rays = u64::from(samples) * u64::from(REPLICATES);
        let pixel = |pixel| self.pixel(pixel, samples, seed);
        let moments = moments_of_values(self.paths.pixels(), rays, self.cancel, pixel, done)?;
        Ok(Estimate::from_moments(&moments))
    }

    fn samples(&self, samples: u32) -> u64 {
        self.paths.pixels() as u64 * u64::from(samples) * u64::from(REPLICATES)
    }

    fn good_size(&self, wanted: f64) -> u32 {
        power_of_two(wanted, 1)
    }
}
