//! Bounding boxes of objects, and which of them are solid: closed dielectric meshes without a receiver or a lamp inside.

use crate::scene::{Light, LightKind, MaterialKind, Mesh, Object, Scene, bounds, is_closed};
use glam::DVec3;
use std::borrow::Cow;

/// Smallest overlap over the size of the body; less is contact.
const CONTACT: f64 = 1e-6;

pub struct Bodies {
    /// Bounding box of each object, m.
    pub bounds: Vec<[DVec3; 2]>,
    /// Whether an object is a closed dielectric mesh.
    is_closed: Vec<bool>,
}

impl Bodies {
    pub fn new(scene: &Scene) -> Self {
        let closed = |object: &Object| {
            matches!(
                scene.materials[object.material].kind,
                MaterialKind::Dielectric(_)
            ) && (object.geometry.placement()).is_some_and(|(mesh, _)| is_closed(mesh))
        };
        Self {
            bounds: vec![[DVec3::ZERO; 2]; scene.objects.len()],
            is_closed: scene.objects.iter().map(closed).collect(),
        }
    }

    /// Updates the bounds of the objects that moved, of which some have these meshes.
    pub fn update(&mut self, scene: &Scene, moved: &[usize], meshes: &[(usize, Cow<Mesh>)]) {
        for &object in moved {
            let mesh = meshes.iter().find(|(of, _)| *of == object);
            self.bounds[object] = match mesh {
                Some((_, mesh)) => mesh.bounds(),
                None => scene.objects[object].geometry.bounds(),
            };
        }
    }

    /// Length of the scene's diagonal, m.
    pub fn size(&self) -> f64 {
        let [low, high] = bounds(self.bounds.iter().flatten().copied());
        low.distance(high)
    }

    /// Whether an object is a closed body with neither a receiver nor a lamp in it: light of its first surface that it refracts
    /// enters it, and lands nowhere before it meets another surface.
    pub fn is_solid(&self, scene: &Scene, index: usize) -> bool {
        let [low, high] = self.bounds[index];
        let contact = CONTACT * low.distance(high);
        let is_inside = |[other_low, other_high]: [DVec3; 2]| {
            let above = (high - contact).cmpgt(other_low);
            (above & (low + contact).cmplt(other_high)).all()
        };
        let lamp_is_inside = |light: &Light| match light.kind {
            LightKind::Lamp { position, .. } => is_inside([position; 2]),
            LightKind::Sun { .. } | LightKind::Environment { .. } => false,
        };
        self.is_closed[index]
            && !(scene.objects.iter().zip(&self.bounds))
                .any(|(other, &bounds)| other.light_map.is_some() && is_inside(bounds))
            && !scene.lights.iter().any(lamp_is_inside)
    }
}
