//! Whether something blocks the light between two points, exactly, in f64.

use glam::DVec3;
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, BvhNode};

/// Hits nearer than this to either end of a leg do not count, in units of the diagonal of the
/// box around all blockers. It only has to exceed the rounding error of a point on a triangle
/// (about 1e-15), so that the neighbours of the triangle a ray leaves from block it where they
/// really stand in its way, and not at the common edge.
const TOLERANCE: f64 = 1e-10;

/// Triangles that block light, both faces.
pub struct Blockers {
    triangles: Vec<Triangle>,
    bvh: Bvh,
    tolerance: f64,
}

struct Triangle {
    a: DVec3,
    edge_1: DVec3,
    edge_2: DVec3,
}

impl Blockers {
    /// `None` if there is nothing to block light.
    pub fn new(corners: &[[DVec3; 3]]) -> Option<Self> {
        if corners.is_empty() {
            return None;
        }
        let boxes: Vec<Aabb> = corners
            .iter()
            .map(|[a, b, c]| Aabb::new(to_parry(a.min(*b).min(*c)), to_parry(a.max(*b).max(*c))))
            .collect();
        let bvh = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
        let tolerance = TOLERANCE * bvh.root_aabb().extents().length();
        let triangles = corners
            .iter()
            .map(|&[a, b, c]| Triangle {
                a,
                edge_1: b - a,
                edge_2: c - a,
            })
            .collect();
        Some(Self {
            triangles,
            bvh,
            tolerance,
        })
    }

    /// Whether a triangle other than `origin_triangle` crosses `origin` + t·`direction` for
    /// t between 0 and `length` (m, may be infinite); `direction` is a unit vector.
    pub fn block(
        &self,
        origin: DVec3,
        direction: DVec3,
        length: f64,
        origin_triangle: Option<u32>,
    ) -> bool {
        let range = [self.tolerance, length - self.tolerance];
        let inverse = direction.recip();
        (self.bvh)
            .leaves(|node| box_meets(node, origin, inverse, range))
            .any(|leaf| {
                Some(leaf) != origin_triangle
                    && self.triangles[leaf as usize].meets(origin, direction, range)
            })
    }
}

fn to_parry(v: DVec3) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

/// Slab test (Kay, Kajiya, *Ray tracing complex scenes*, SIGGRAPH 1986). A ray within a slab's
/// face gives 0·∞ = NaN, which `min` and `max` ignore, so such boxes are visited.
fn box_meets(node: &BvhNode, origin: DVec3, inverse: DVec3, range: [f64; 2]) -> bool {
    let (low, high) = (node.mins(), node.maxs());
    let mut near = range[0];
    let mut far = range[1];
    for axis in 0..3 {
        let t0 = (low[axis] - origin[axis]) * inverse[axis];
        let t1 = (high[axis] - origin[axis]) * inverse[axis];
        near = near.max(t0.min(t1));
        // Rounding must not lose a box that the ray just touches: Ize, *Robust BVH ray
        // traversal*, JCGT 2(2), 2013.
        far = far.min(t0.max(t1) * (1.0 + 4.0 * f64::EPSILON));
    }
    near <= far
}

impl Triangle {
    /// Möller, Trumbore, *Fast, minimum storage ray/triangle intersection*, 1997.
    fn meets(&self, origin: DVec3, direction: DVec3, range: [f64; 2]) -> bool {
        let p = direction.cross(self.edge_2);
        let determinant = self.edge_1.dot(p);
        if determinant == 0.0 {
            return false;
        }
        let inverse = 1.0 / determinant;
        let from_a = origin - self.a;
        let u = from_a.dot(p) * inverse;
        if !(0.0..=1.0).contains(&u) {
            return false;
        }
        let q = from_a.cross(self.edge_1);
        let v = direction.dot(q) * inverse;
        if v < 0.0 || u + v > 1.0 {
            return false;
        }
        let t = self.edge_2.dot(q) * inverse;
        t >= range[0] && t <= range[1]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn square(y: f64) -> [[DVec3; 3]; 2] {
        let [a, b, c, d] =
            [[-1.0, -1.0], [1.0, -1.0], [1.0, 1.0], [-1.0, 1.0]].map(|[x, z]| DVec3::new(x, y, z));
        [[a, b, c], [a, c, d]]
    }

    #[test]
    fn blocks_between_the_ends_only_and_from_both_sides() {
        let blockers = Blockers::new(&square(1.0)).unwrap();
        let start = DVec3::new(0.3, 0.0, 0.2);
        assert!(blockers.block(start, DVec3::Y, f64::INFINITY, None));
        assert!(blockers.block(start, DVec3::Y, 1.5, None));
        assert!(!blockers.block(start, DVec3::Y, 0.5, None));
        assert!(
            !blockers.block(start, DVec3::Y, 1.0, None),
            "its end lies on it"
        );
        assert!(!blockers.block(start, DVec3::NEG_Y, f64::INFINITY, None));
        let above = DVec3::new(0.3, 2.0, 0.2);
        assert!(blockers.block(above, DVec3::NEG_Y, f64::INFINITY, None));
        assert!(!blockers.block(above + 2.0 * DVec3::X, DVec3::NEG_Y, f64::INFINITY, None));
    }

    #[test]
    fn the_triangle_a_ray_leaves_from_does_not_block_but_the_next_one_does() {
        let corners: Vec<_> = square(0.0).into_iter().chain(square(1.0)).collect();
        let blockers = Blockers::new(&corners).unwrap();
        let on_first = DVec3::new(0.3, 0.0, 0.2);
        assert!(!blockers.block(on_first, DVec3::Y, 0.9, Some(0)));
        assert!(blockers.block(on_first, DVec3::Y, 1.1, Some(0)));
    }

    #[test]
    fn agrees_with_a_loop_over_all_triangles() {
        use crate::reference::sequence::sobol_4d;
        let corners: Vec<[DVec3; 3]> = (0..500)
            .map(|i| {
                let point = |seed| {
                    let [x, y, z, _] = sobol_4d(i, seed);
                    DVec3::new(x, y, z)
                };
                let a = point(1);
                [a, a + 0.2 * (point(2) - 0.5), a + 0.2 * (point(3) - 0.5)]
            })
            .collect();
        let blockers = Blockers::new(&corners).unwrap();
        let mut blocked = 0;
        for i in 0..2000 {
            let [x, y, z, azimuth] = sobol_4d(i, 9);
            let origin = DVec3::new(x, y, 0.5);
            let direction = DVec3::new(azimuth.cos(), azimuth.sin(), 4.0 * z - 2.0).normalize();
            let range = [blockers.tolerance, 0.4 - blockers.tolerance];
            let by_loop = (blockers.triangles.iter()).any(|t| t.meets(origin, direction, range));
            assert_eq!(blockers.block(origin, direction, 0.4, None), by_loop);
            blocked += u32::from(by_loop);
        }
        assert!((200..1800).contains(&blocked), "{blocked}");
    }
}
