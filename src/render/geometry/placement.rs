//! Where a mesh lies that moves as a whole.

use crate::render::gpu_types::{Normals, PlacePush, Triangle};
use crate::scene::Similarity;
use glam::{DVec3, Mat3, Vec3};
use std::ops::Range;

/// Where an object lies, seen from its triangles at rest: x ↦ linear · x + shift.
#[derive(Debug, Clone, Copy)]
pub struct Placement {
    /// The rotation times the scale.
    linear: Mat3,
    /// m
    shift: Vec3,
    scale: f32,
}

impl Placement {
    /// That of vertices relative to `middle`, where `by` places their mesh; `origin` is that of the device. Both in m.
    pub fn new(by: &Similarity, middle: DVec3, origin: DVec3) -> Self {
        Self {
            linear: (by.scale * by.rotation).as_mat3(),
            shift: (by.place(middle) - origin).as_vec3(),
            scale: by.scale as f32,
        }
    }

    pub fn triangle(&self, resting: &Triangle) -> Triangle {
        Triangle {
            position: self.linear * resting.position + self.shift,
            edge1: self.linear * resting.edge1,
            edge2: self.linear * resting.edge2,
            ..*resting
        }
    }

    pub fn normals(&self, resting: &Normals) -> Normals {
        let [n0, n1, n2] =
            [resting.n0, resting.n1, resting.n2].map(|n| self.scale.recip() * (self.linear * n));
        Normals {
            n0,
            n1,
            n2,
            ..*resting
        }
    }

    /// For the resting triangles `range`.
    pub fn push(&self, range: &Range<u32>) -> PlacePush {
        PlacePush {
            column0: self.linear.x_axis,
            first: range.start,
            column1: self.linear.y_axis,
            count: range.len() as u32,
            column2: self.linear.z_axis,
            inverse_scale: self.scale.recip(),
            shift: self.shift,
            unused: 0.0,
        }
    }
}
