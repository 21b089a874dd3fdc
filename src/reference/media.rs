//! The medium that light is in: nested and overlapping dielectrics by priority, after Schmidt and Budge, *Simple nested
//! dielectrics in ray traced images*, Journal of Graphics Tools 7(2), 2002.

use crate::scene::{Dielectric, MaterialKind, Scene};
use glam::DVec3;

/// Dielectrics around a place, at most.
const MAX_NESTED: usize = 16;

/// The dielectrics of a scene, by object.
pub struct Dielectrics(Vec<Option<Dielectric>>);

impl Dielectrics {
    pub fn of(scene: &Scene) -> Self {
        let of_object = |object: &crate::scene::Object| match scene.materials[object.material].kind
        {
            MaterialKind::Dielectric(dielectric) => Some(dielectric),
            _ => None,
        };
        Self(scene.objects.iter().map(of_object).collect())
    }

    fn get(&self, object: u32) -> Option<&Dielectric> {
        self.0[object as usize].as_ref()
    }
}

/// The dielectric objects that contain a place, in the order in which light entered them.
#[derive(Clone, Copy, Default)]
pub struct Media {
    objects: [u32; MAX_NESTED],
    count: usize,
}

/// The media on both sides of a surface.
pub struct Sides {
    /// Where light comes from, and behind the surface.
    pub media: [Media; 2],
    /// Their indices of refraction.
    pub ior: [f64; 2],
    /// Whether there is an interface. Without, light goes on as if nothing were there.
    pub is_interface: bool,
}

impl Media {
    fn objects(&self) -> &[u32] {
        &self.objects[..self.count]
    }

    fn with(&self, object: u32) -> Self {
        let mut media = *self;
        if !self.objects().contains(&object) && self.count < MAX_NESTED {
            media.objects[media.count] = object;
            media.count += 1;
        }
        media
    }

    fn without(&self, object: u32) -> Self {
        let mut media = Self::default();
        for &other in self.objects().iter().filter(|other| **other != object) {
            media = media.with(other);
        }
        media
    }

    /// The object whose medium fills the place; `None` in air.
    fn filling(&self, dielectrics: &Dielectrics) -> Option<u32> {
        // Of equal ones, the last.
        let priority = |object: &u32| dielectrics.get(*object).map(|d| d.priority);
        self.objects().iter().copied().max_by_key(priority)
    }

    fn ior(&self, dielectrics: &Dielectrics) -> f64 {
        (self.filling(dielectrics))
            .and_then(|object| dielectrics.get(object))
            .map_or(1.0, |dielectric| dielectric.ior)
    }

    /// Share of light that is left after `length`, m. All of it is left on the way from a sun, which is in no medium.
    pub fn transmittance(&self, dielectrics: &Dielectrics, length: f64) -> DVec3 {
        let filling = self
            .filling(dielectrics)
            .and_then(|object| dielectrics.get(object));
        match filling {
            Some(dielectric) if dielectric.absorption != DVec3::ZERO && length.is_finite() => {
                (-length * dielectric.absorption).exp()
            }
            _ => DVec3::ONE,
        }
    }

    /// What light meets at the surface of `object`, on its front or its back. Light on the back of a dielectric was in it.
    pub fn sides(&self, dielectrics: &Dielectrics, object: u32, front: bool) -> Sides {
        let (outside, inside) = (self.without(object), self.with(object));
        let is_body = dielectrics.get(object).is_some_and(|d| !d.thin);
        let media = match (is_body, front) {
            (false, _) => [*self, *self],
            (true, true) => [outside, inside],
            (true, false) => [inside, outside],
        };
        let [from, to] = media.map(|media| media.filling(dielectrics));
        Sides {
            ior: media.map(|media| media.ior(dielectrics)),
            is_interface: !is_body || from != to,
            media,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn dielectrics(all: &[(f64, i32)]) -> Dielectrics {
        let of = |&(ior, priority): &(f64, i32)| {
            Some(Dielectric {
                priority,
                ..Dielectric::new(ior)
            })
        };
        Dielectrics(all.iter().map(of).collect())
    }

    /// Water in a glass reaches into its wall: within the wall there is glass, and the water's surface there is none.
    #[test]
    fn glass_displaces_water_of_lower_priority() {
        let all = dielectrics(&[(1.5, 1), (1.33, 0)]);
        let [air, in_glass] = Media::default().sides(&all, 0, true).media;
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
        let glass = Media::default().sides(&all, 0, true).media[1];
        let bubble = glass.sides(&all, 1, true);
        assert!(bubble.is_interface);
        assert_eq!(bubble.ior, [1.5, 1.0]);
        assert_eq!(bubble.media[1].sides(&all, 1, false).ior, [1.0, 1.5]);
    }

    /// Light that starts within a body meets its back first.
    #[test]
    fn light_on_the_back_was_inside() {
        let all = dielectrics(&[(1.5, 0)]);
        let sides = Media::default().sides(&all, 0, false);
        assert_eq!(sides.ior, [1.5, 1.0]);
        assert!(sides.is_interface);
    }
}
