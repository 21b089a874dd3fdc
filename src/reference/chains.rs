//! Chains: light on its way from one specular surface to the next.
//!
//! The first surface sends both the reflected and the refracted ray on. Each later surface sends one of the two on, chosen with
//! a probability of its share, so that a chain costs one ray for each of its surfaces.

use crate::reference::media::{Media, Sides};
use crate::reference::mirrors::{Leaving, MirrorTriangle};
use crate::reference::problem::Problem;
use crate::reference::receiver::ReceiverHit;
use crate::reference::sequence::Choices;
use glam::DVec3;

/// Light that left a specular surface.
pub struct Ray {
    /// m
    pub origin: DVec3,
    /// Unit.
    pub direction: DVec3,
    /// The triangle that it leaves from, among those that block light.
    pub from: Option<u32>,
    /// RGB, W.
    pub flux: DVec3,
    /// Factor on the flux from the first surface on that disperses light, which makes it light of one wavelength.
    pub tint: DVec3,
    pub media: Media,
    /// Specular surfaces so far.
    pub interfaces: u32,
}

/// A point on the receiver's front where light lands.
pub struct Landing {
    /// Its distance is from the last specular surface.
    pub hit: ReceiverHit,
    /// m
    pub position: DVec3,
    /// Specular surfaces on the way.
    pub interfaces: u32,
}

impl Problem<'_> {
    /// Calls `lands` with every point where light lands on the receiver, and its flux, W.
    pub fn follow(
        &self,
        mut ray: Ray,
        choices: &mut Choices,
        lands: &mut impl FnMut(&Landing, DVec3),
    ) {
        let dielectrics = &self.chains.dielectrics;
        let tolerance = self.blockers.map_or(0.0, |blockers| blockers.tolerance());
        loop {
            let mut hits = Vec::new();
            (self.receiver).hits(ray.origin, ray.direction, |hit| hits.push(hit));
            // Nothing turns the light after its last interface: only what stands before the receiver matters.
            let is_last = ray.interfaces >= self.chains.max_interfaces;
            if is_last && hits.is_empty() {
                return;
            }
            let reach = match is_last {
                true => hits.iter().map(|hit| hit.distance).fold(0.0, f64::max),
                false => f64::INFINITY,
            };
            let nearest = (self.blockers)
                .and_then(|blockers| blockers.nearest(ray.origin, ray.direction, reach, ray.from));
            let way = nearest.map_or(f64::INFINITY, |(_, distance, _)| distance);
            for hit in hits {
                if hit.distance <= way + tolerance {
                    let landing = Landing {
                        position: ray.origin + hit.distance * ray.direction,
                        hit,
                        interfaces: ray.interfaces,
                    };
                    let transmitted = ray.media.transmittance(dielectrics, landing.hit.distance);
                    lands(&landing, ray.flux * transmitted);
                }
            }
            let Some((blocker, distance, weights)) = nearest else {
                return;
            };
            let mirror = (self.chains.mirror_of_blocker.get(blocker as usize))
                .copied()
                .flatten();
            let Some(mirror) = mirror.filter(|_| ray.from.is_some()) else {
                return;
            };
            let mirror = &self.mirrors[mirror as usize];
            let front = mirror.geometric_normal.dot(ray.direction) < 0.0;
            let sides = ray.media.sides(dielectrics, mirror.object, front);
            let origin = ray.origin + distance * ray.direction;
            let mut flux = ray.flux * sides.media[0].transmittance(dielectrics, distance);
            if !sides.is_interface {
                ray = Ray {
                    origin,
                    from: Some(blocker),
                    media: sides.media[1],
                    flux,
                    ..ray
                };
                continue;
            }
            if is_last {
                return;
            }
            flux *= sides.take_tint(&mut ray.tint);
            let leaving = (mirror.surface).leaving_with_fallback(
                sides.ior,
                -ray.direction,
                mirror.shading(weights),
                mirror.geometric_normal,
            );
            let Some((leaving, probability, side)) = choose(leaving, choices) else {
                return;
            };
            ray = Ray {
                origin,
                direction: leaving.direction,
                from: Some(blocker),
                flux: flux * leaving.share / probability,
                tint: ray.tint,
                media: sides.media[side],
                interfaces: ray.interfaces + 1,
            };
            if ray.flux == DVec3::ZERO {
                return;
            }
        }
    }

    /// The media at a surface that is the first on the way of light of this wavelength, µm, from the direction `toward`.
    pub fn first_sides(&self, mirror: &MirrorTriangle, toward: DVec3, wavelength: f64) -> Sides {
        let front = mirror.geometric_normal.dot(toward) > 0.0;
        Media::air(wavelength).sides(&self.chains.dielectrics, mirror.object, front)
    }
}

/// The ray to follow, its probability, and the side of the surface on which it travels: 0 before, 1 behind.
pub fn choose(
    leaving: [Option<Leaving>; 2],
    choices: &mut Choices,
) -> Option<(Leaving, f64, usize)> {
    match leaving {
        [None, None] => None,
        [Some(reflected), None] => Some((reflected, 1.0, 0)),
        [None, Some(refracted)] => Some((refracted, 1.0, 1)),
        [Some(reflected), Some(refracted)] => {
            let [a, b] = [&reflected, &refracted].map(|leaving| leaving.share.element_sum());
            let probability = a / (a + b);
            match choices.next() < probability {
                true => Some((reflected, probability, 0)),
                false => Some((refracted, 1.0 - probability, 1)),
            }
        }
    }
}
