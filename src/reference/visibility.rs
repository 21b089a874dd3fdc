//! Whether something blocks the light between two points, exactly, in f64.

use glam::{DVec2, DVec3};
use parry3d_f64::bounding_volume::Aabb;
use parry3d_f64::math::Vector;
use parry3d_f64::partitioning::{Bvh, BvhBuildStrategy, BvhLeafCost, BvhNode};

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
        let corner = |pick: fn(DVec3, DVec3) -> DVec3| {
            (corners.iter().flatten().copied()).fold(corners[0][0], pick)
        };
        let tolerance = TOLERANCE * corner(DVec3::min).distance(corner(DVec3::max));
        // Wider than the triangles, so that rounding loses no box that a ray just touches.
        let margin = DVec3::splat(tolerance);
        let boxes: Vec<Aabb> = (corners.iter())
            .map(|&[a, b, c]| {
                let (low, high) = (a.min(b).min(c), a.max(b).max(c));
                Aabb::new(to_parry(low - margin), to_parry(high + margin))
            })
            .collect();
        let bvh = Bvh::from_leaves(BvhBuildStrategy::Binned, &boxes);
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

    /// m
    pub fn tolerance(&self) -> f64 {
        self.tolerance
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
        let inverse = finite_reciprocal(direction);
        (self.bvh)
            .leaves(|node| box_meets(node, origin, inverse, range))
            .any(|leaf| {
                Some(leaf) != origin_triangle
                    && self.triangles[leaf as usize].meets(origin, direction, range)
            })
    }

    /// The nearest triangle other than `origin_triangle` that the ray crosses within `length` (m, may be infinite): number,
    /// distance in m, and the weights of the second and third corner there.
    pub fn nearest(
        &self,
        origin: DVec3,
        direction: DVec3,
        length: f64,
        origin_triangle: Option<u32>,
    ) -> Option<(u32, f64, DVec2)> {
        let inverse = finite_reciprocal(direction);
        let enters = |node: &BvhNode, best| {
            box_entry(node, origin, inverse, [self.tolerance, best]).unwrap_or(f64::MAX)
        };
        let meets = |leaf: u32, best: f64| {
            if Some(leaf) == origin_triangle {
                return None;
            }
            let (distance, weights) = self.triangles[leaf as usize].crossing(origin, direction)?;
            let is_between = distance >= self.tolerance && distance < best;
            is_between.then_some(Crossing { distance, weights })
        };
        let (leaf, crossing) = self.bvh.find_best(length.min(f64::MAX), enters, meets)?;
        Some((leaf, crossing.distance, crossing.weights))
    }

    /// All triangles that the ray crosses: number, distance in m, and the weights of the second and
    /// third corner there.
    pub fn all_along(
        &self,
        origin: DVec3,
        direction: DVec3,
    ) -> impl Iterator<Item = (u32, f64, DVec2)> {
        let range = [0.0, f64::INFINITY];
        let inverse = finite_reciprocal(direction);
        (self.bvh)
            .leaves(move |node| box_meets(node, origin, inverse, range))
            .filter_map(move |leaf| {
                let (distance, weights) =
                    self.triangles[leaf as usize].crossing(origin, direction)?;
                (distance >= 0.0).then_some((leaf, distance, weights))
            })
    }
}

fn to_parry(v: DVec3) -> Vector {
    Vector::new(v.x, v.y, v.z)
}

/// 1/d, but finite, so that a ray along the plane of a box's face gives no 0·∞ = NaN.
fn finite_reciprocal(direction: DVec3) -> DVec3 {
    const LARGE: f64 = 1e200;
    direction
        .recip()
        .clamp(DVec3::splat(-LARGE), DVec3::splat(LARGE))
}

/// Where a ray crosses a triangle.
struct Crossing {
    /// m
    distance: f64,
    weights: DVec2,
}

impl BvhLeafCost for Crossing {
    fn cost(&self) -> f64 {
        self.distance
    }
}

fn box_meets(node: &BvhNode, origin: DVec3, inverse: DVec3, range: [f64; 2]) -> bool {
    box_entry(node, origin, inverse, range).is_some()
}

/// Distance at which a ray enters the box within the range. Slab test (Kay, Kajiya, *Ray tracing complex
/// scenes*, SIGGRAPH 1986).
fn box_entry(node: &BvhNode, origin: DVec3, inverse: DVec3, range: [f64; 2]) -> Option<f64> {
    // f64::min and f64::max take several instructions to treat NaN, of which there is none.
    let min = |a: f64, b: f64| if a < b { a } else { b };
    let max = |a: f64, b: f64| if a > b { a } else { b };
    let (low, high) = (node.mins(), node.maxs());
    let slab = |low: f64, high: f64, origin: f64, inverse: f64| {
        let (t0, t1) = ((low - origin) * inverse, (high - origin) * inverse);
        (min(t0, t1), max(t0, t1))
    };
    let x = slab(low.x, high.x, origin.x, inverse.x);
    let y = slab(low.y, high.y, origin.y, inverse.y);
    let z = slab(low.z, high.z, origin.z, inverse.z);
    let near = max(max(x.0, y.0), max(z.0, range[0]));
    let far = min(min(x.1, y.1), min(z.1, range[1]));
    (near <= far).then_some(near)
}

impl Triangle {
    fn meets(&self, origin: DVec3, direction: DVec3, range: [f64; 2]) -> bool {
        (self.crossing(origin, direction)).is_some_and(|(t, _)| t >= range[0] && t <= range[1])
    }

    /// Distance along the line and the weights of the second and third corner, after Möller, Trumbore,
    /// *Fast, minimum storage ray/triangle intersection*, 1997.
    #[inline]
    fn crossing(&self, origin: DVec3, direction: DVec3) -> Option<(f64, DVec2)> {
        let p = direction.cross(self.edge_2);
        let determinant = self.edge_1.dot(p);
        if determinant == 0.0 {
            return None;
        }
        let inverse = 1.0 / determinant;
        let from_a = origin - self.a;
        let u = from_a.dot(p) * inverse;
        if !(0.0..=1.0).contains(&u) {
            return None;
        }
        let q = from_a.cross(self.edge_1);
        let v = direction.dot(q) * inverse;
        if v < 0.0 || u + v > 1.0 {
            return None;
        }
        Some((self.edge_2.dot(q) * inverse, DVec2::new(u, v)))
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
    fn rays_along_axes_and_through_edges_of_boxes_are_blocked() {
        let blockers = Blockers::new(&square(1.0)).unwrap();
        for x in [-1.0, 0.0, 1.0] {
            for z in [-1.0, 0.0, 1.0] {
                let start = DVec3::new(x, 0.0, z);
                assert!(
                    blockers.block(start, DVec3::Y, f64::INFINITY, None),
                    "{start}"
                );
            }
        }
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
            let nearest = (blockers.triangles.iter())
                .filter_map(|t| t.crossing(origin, direction))
                .map(|(distance, _)| distance)
                .filter(|&distance| distance > blockers.tolerance)
                .min_by(f64::total_cmp);
            let found = blockers.nearest(origin, direction, f64::INFINITY, None);
            assert_eq!(found.map(|(_, distance, _)| distance), nearest);
            blocked += u32::from(by_loop);
        }
        assert!((200..1800).contains(&blocked), "{blocked}");
    }
}
