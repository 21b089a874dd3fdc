//! Rays on the host, for messages only.

use crate::render::geometry::bvh::Bvh;
use crate::render::gpu_types::Triangle;
use crate::render::gpu_types::constants::OCCLUDES;
use glam::Vec3;
use std::borrow::Cow;

/// Triangles and their hierarchy.
pub struct Rays<'a> {
    triangles: Cow<'a, [Triangle]>,
    bvh: Cow<'a, Bvh>,
}

impl<'a> Rays<'a> {
    /// The triangles are in the order of the leaves.
    pub fn new(triangles: Cow<'a, [Triangle]>, bvh: Cow<'a, Bvh>) -> Self {
        Self { triangles, bvh }
    }

    /// Whether an object that casts shadows crosses the ray before `length`, m.
    pub fn is_occluded(&self, origin: Vec3, direction: Vec3, length: f32) -> bool {
        let mut farthest = length;
        self.bvh
            .walk(origin, direction, &mut farthest, |place, farthest| {
                let triangle = &self.triangles[place];
                if triangle.flags & OCCLUDES != 0 && meets(triangle, origin, direction) < *farthest
                {
                    *farthest = -1.0; // ends the traversal
                }
            });
        farthest < 0.0
    }

    /// The nearest triangle along a ray that casts shadows or is `wanted`.
    pub fn nearest(
        &self,
        origin: Vec3,
        direction: Vec3,
        wanted: impl Fn(&Triangle) -> bool,
    ) -> Option<&Triangle> {
        let (mut farthest, mut nearest) = (f32::INFINITY, None);
        self.bvh
            .walk(origin, direction, &mut farthest, |place, farthest| {
                let triangle = &self.triangles[place];
                let distance = meets(triangle, origin, direction);
                if distance < *farthest && (triangle.flags & OCCLUDES != 0 || wanted(triangle)) {
                    (*farthest, nearest) = (distance, Some(triangle));
                }
            });
        nearest
    }
}

/// Distance at which a ray crosses the triangle, m; infinite where it does not (Möller & Trumbore 1997).
fn meets(triangle: &Triangle, origin: Vec3, direction: Vec3) -> f32 {
    let p = direction.cross(triangle.edge2);
    let determinant = triangle.edge1.dot(p);
    let from_corner = origin - triangle.position;
    let q = from_corner.cross(triangle.edge1);
    let (u, v) = (
        from_corner.dot(p) / determinant,
        direction.dot(q) / determinant,
    );
    let distance = triangle.edge2.dot(q) / determinant;
    // A triangle seen edge on gives NaN, which fails every comparison.
    match u >= 0.0 && v >= 0.0 && u + v <= 1.0 && distance > 0.0 {
        true => distance,
        false => f32::INFINITY,
    }
}
