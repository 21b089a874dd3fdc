//! Bounding boxes of objects, and which of them are solid: closed dielectric meshes without a receiver or a lamp inside.

use crate::scene::{Geometry, Light, LightKind, MaterialKind, Mesh, Object, Scene, is_closed};
use glam::DVec3;
use std::borrow::Cow;

/// Smallest overlap over the size of the body; less is contact.
const CONTACT: f64 = 1e-6;

pub struct Bodies {
    /// Bounding box of each object, m, where it is needed.
    pub bounds: Vec<[DVec3; 2]>,
    /// Whether an object is a closed dielectric mesh.
    is_closed: Vec<bool>,
    needs_bounds: Vec<bool>,
}

impl Bodies {
    /// `has_chains`: the bounds of all casters are needed.
    pub fn new(scene: &Scene, has_chains: bool) -> Self {
        let closed = |object: &Object| {
            let kind = &scene.materials[object.material].kind;
            match &object.geometry {
                Geometry::Mesh(mesh) => {
                    matches!(kind, MaterialKind::Dielectric(_)) && is_closed(mesh)
                }
                Geometry::Rect(_) | Geometry::Waves(_) => false,
            }
        };
        let is_closed: Vec<bool> = scene.objects.iter().map(closed).collect();
        let is_caster =
            |object: &Object| has_chains && scene.materials[object.material].kind.is_specular();
        Self {
            bounds: vec![[DVec3::ZERO; 2]; scene.objects.len()],
            needs_bounds: (scene.objects.iter().zip(&is_closed))
                .map(|(object, closed)| *closed || object.light_map.is_some() || is_caster(object))
                .collect(),
            is_closed,
        }
    }

    /// Updates the bounds of the objects that moved.
    pub fn update(&mut self, moved: &[(usize, Cow<Mesh>)]) {
        for &(index, ref mesh) in moved {
            if self.needs_bounds[index] {
                self.bounds[index] = mesh.bounds();
            }
        }
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
