//! The medium that light is in: nested and overlapping dielectrics by priority, after Schmidt and Budge, *Simple nested
//! dielectrics in ray traced images*, Journal of Graphics Tools 7(2), 2002.

use crate::scene::{D_LINE, Dielectric, MaterialKind, Scene};
use crate::spectrum;
use glam::DVec3;

/// Maximum number of bodies that contain a place.
const MAX_NESTED: usize = 16;

/// The media of a scene. Objects of equal dielectrics are one medium, so that a body may consist of several.
pub struct Dielectrics {
    media: Vec<Dielectric>,
    /// By object; `None` where it is no body.
    of_objects: Vec<Option<u32>>,
}

impl Dielectrics {
    pub fn of(scene: &Scene) -> Self {
        let kinds = scene
            .objects
            .iter()
            .map(|object| &scene.materials[object.material].kind);
        Self::of_kinds(kinds)
    }

    fn of_kinds<'a>(kinds: impl Iterator<Item = &'a MaterialKind>) -> Self {
        let mut media: Vec<Dielectric> = Vec::new();
        let of_objects = kinds
            .map(|kind| match kind {
                MaterialKind::Dielectric(dielectric) if !dielectric.thin => {
                    let known = media.iter().position(|medium| medium == dielectric);
                    Some(known.unwrap_or_else(|| {
                        media.push(*dielectric);
                        media.len() - 1
                    }) as u32)
                }
                _ => None,
            })
            .collect();
        Self { media, of_objects }
    }

    fn get(&self, medium: u32) -> &Dielectric {
        &self.media[medium as usize]
    }

    /// A wavelength for light, µm, and the factor on the light's colour once a medium has dispersed it; for light that nothing
    /// disperses the d line and white. `u` is uniform in [0, 1).
    pub fn wavelength(&self, u: impl FnOnce() -> f64) -> (f64, DVec3) {
        let disperses = self.media.iter().any(|medium| medium.dispersion.is_some());
        match disperses {
            true => spectrum::draw(u()),
            false => (D_LINE, DVec3::ONE),
        }
    }
}

/// The media of the bodies that contain a place, in the order in which light entered them; a medium as often as bodies of it.
#[derive(Clone, Copy)]
pub struct Media {
    bodies: [u32; MAX_NESTED],
    count: usize,
    /// Of the light, in vacuum, µm.
    wavelength: f64,
}

/// The media on both sides of a surface.
pub struct Sides {
    /// Before and behind the surface, as the light travels.
    pub media: [Media; 2],
    /// Their indices of refraction.
    pub ior: [f64; 2],
    /// Whether they differ. Light passes straight through the surface of a body that another one displaces.
    pub is_interface: bool,
    /// Whether what happens to light depends on its wavelength.
    disperses: bool,
}

impl Sides {
    /// Factor on the colour of light that has this tint for the first surface that disperses it, and keeps the tint until then.
    pub fn take_tint(&self, tint: &mut DVec3) -> DVec3 {
        match self.disperses {
            true => std::mem::replace(tint, DVec3::ONE),
            false => DVec3::ONE,
        }
    }
}

impl Media {
    /// Air.
    pub fn air(wavelength: f64) -> Self {
        Self {
            bodies: [0; MAX_NESTED],
            count: 0,
            wavelength,
        }
    }

    fn bodies(&self) -> &[u32] {
        &self.bodies[..self.count]
    }

    fn enter(&self, medium: u32) -> Self {
        let mut media = *self;
        if self.count < MAX_NESTED {
            media.bodies[media.count] = medium;
            media.count += 1;
        }
        media
    }

    /// Leaves the body of this medium that was entered last, if there is one.
    fn leave(&self, medium: u32) -> Option<Self> {
        let last = self.bodies().iter().rposition(|other| *other == medium)?;
        let mut media = *self;
        media.bodies[last..self.count].rotate_left(1);
        media.count -= 1;
        Some(media)
    }

    /// What fills the place; `None` is air.
    fn filling(&self, dielectrics: &Dielectrics) -> Option<u32> {
        // Of equal ones, the last.
        let priority = |medium: &u32| dielectrics.get(*medium).priority;
        self.bodies().iter().copied().max_by_key(priority)
    }

    fn ior(&self, dielectrics: &Dielectrics) -> f64 {
        (self.filling(dielectrics)).map_or(1.0, |medium| {
            dielectrics.get(medium).ior_at(self.wavelength)
        })
    }

    /// Transmittance of `length`, m: exp(−σ length); 1 for an infinite length, since a sun is in no medium.
    pub fn transmittance(&self, dielectrics: &Dielectrics, length: f64) -> DVec3 {
        let filling = self.filling(dielectrics);
        match filling.map(|medium| dielectrics.get(medium)) {
            Some(dielectric) if dielectric.absorption != DVec3::ZERO && length.is_finite() => {
                (-length * dielectric.absorption).exp()
            }
            _ => DVec3::ONE,
        }
    }

    /// The media on both sides of the surface of `object`, which light meets on its front or its back. Light that meets the back
    /// of a body was in it.
    pub fn sides(&self, dielectrics: &Dielectrics, object: u32, front: bool) -> Sides {
        let medium = dielectrics.of_objects[object as usize];
        let media = match medium {
            None => [*self, *self],
            Some(medium) if front => [*self, self.enter(medium)],
            Some(medium) => match self.leave(medium) {
                Some(outside) => [*self, outside],
                None => [self.enter(medium), *self],
            },
        };
        let [from, to] = media.map(|media| media.filling(dielectrics));
        let disperses = |medium: u32| dielectrics.get(medium).dispersion.is_some();
        Sides {
            disperses: [from, to].into_iter().flatten().any(disperses),
            ior: media.map(|media| media.ior(dielectrics)),
            is_interface: medium.is_none() || from != to,
            media,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dielectrics(all: &[(f64, i32)]) -> Dielectrics {
        let of = |&(ior, priority): &(f64, i32)| {
            MaterialKind::Dielectric(Dielectric {
                priority,
                ..Dielectric::new(ior)
            })
        };
        let kinds: Vec<_> = all.iter().map(of).collect();
        Dielectrics::of_kinds(kinds.iter())
    }

    /// Water reaches into the wall of its glass: the wall is glass, and the water's surface in it is no interface.
    #[test]
    fn glass_displaces_water_of_lower_priority() {
        let all = dielectrics(&[(1.5, 1), (1.33, 0)]);
        let [air, in_glass] = Media::air(D_LINE).sides(&all, 0, true).media;
        assert_eq!(air.ior(&all), 1.0);
        let water = in_glass.sides(&all, 1, true);
        assert!(!water.is_interface);
        let out = water.media[1].sides(&all, 0, false);
        assert!(out.is_interface);
        assert_eq!(out.ior, [1.5, 1.33]);
        let up = out.media[1].sides(&all, 1, false);
        assert!(up.is_interface);
        assert_eq!(up.ior, [1.33, 1.0]);
    }

    /// A bubble is a body of air within a body of the same priority.
    #[test]
    fn the_body_entered_last_displaces_its_equals() {
        let all = dielectrics(&[(1.5, 0), (1.0, 0)]);
        let glass = Media::air(D_LINE).sides(&all, 0, true).media[1];
        let bubble = glass.sides(&all, 1, true);
        assert!(bubble.is_interface);
        assert_eq!(bubble.ior, [1.5, 1.0]);
        assert_eq!(bubble.media[1].sides(&all, 1, false).ior, [1.0, 1.5]);
    }

    /// Two bodies of one glass that overlap are one, as are the two sides of a plate.
    #[test]
    fn bodies_of_one_medium_are_one() {
        let all = dielectrics(&[(1.5, 0), (1.5, 0)]);
        let first = Media::air(D_LINE).sides(&all, 0, true).media[1];
        let both = first.sides(&all, 1, true);
        assert!(!both.is_interface);
        let second = both.media[1].sides(&all, 0, false);
        assert!(!second.is_interface);
        assert_eq!(second.media[1].sides(&all, 1, false).ior, [1.5, 1.0]);
        assert_eq!(first.sides(&all, 1, false).ior, [1.5, 1.0]);
    }

    /// Light that starts within a body meets its back first.
    #[test]
    fn light_on_the_back_was_inside() {
        let all = dielectrics(&[(1.5, 0)]);
        let sides = Media::air(D_LINE).sides(&all, 0, false);
        assert_eq!(sides.ior, [1.5, 1.0]);
        assert!(sides.is_interface);
    }
}
