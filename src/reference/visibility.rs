//! Whether something blocks the light between two points, exactly, in f64.

use glam::{DVec2, DVec3, Vec3};
use obvhs::BvhBuildParams;
use obvhs::aabb::Aabb;
use obvhs::cwbvh::{CwBvh, builder::build_cwbvh};
use obvhs::ray::{Ray, RayHit};

/// Hits nearer than this to either end of a leg do not count, in units of the diagonal of the
/// box around all blockers. It only has to exceed the rounding error of a point on a triangle
/// (about 1e-15), so that the neighbours of the triangle a ray leaves from block it where they
/// really stand in its way, and not at the common edge.
const TOLERANCE: f64 = 1e-10;

/// Side of the cube in which the tree stores its boxes.
const TREE_SIZE: f64 = 128.0;
/// By which the boxes are wider than what they hold, in units of the tree. It exceeds the distance of 1e-4 below which the tree takes
/// boxes to end behind a ray's origin, and the errors of its 32-bit coordinates (1e-5) and of their products (4e-5), so that no box
/// is lost that a ray just touches. What lies in the boxes is met or missed in f64.
const TREE_MARGIN: f64 = 2e-4;

/// Triangles that block light, both faces.
pub struct Blockers {
    /// In the order of the tree's leaves.
    triangles: Vec<Numbered>,
    tree: CwBvh,
    /// Of the box around all triangles and the margin, m.
    low: DVec3,
    high: DVec3,
    /// Units of the tree in 1 m.
    scale: f64,
    tolerance: f64,
}

struct Numbered {
    number: u32,
    triangle: Triangle,
}

/// Distances between which a ray's hits count, m.
type Range = [f64; 2];

impl Blockers {
    /// `None` if there is nothing to block light.
    pub fn new(corners: &[[DVec3; 3]]) -> Option<Self> {
        if corners.is_empty() {
            return None;
        }
        let corner = |pick: fn(DVec3, DVec3) -> DVec3| {
            (corners.iter().flatten().copied()).fold(corners[0][0], pick)
        };
        let (low, high) = (corner(DVec3::min), corner(DVec3::max));
        // Where all corners coincide, any finite scale serves.
        let scale = TREE_SIZE / (high - low).max_element().max(f64::MIN_POSITIVE.sqrt());
        let in_tree = |place: DVec3| ((place - low) * scale).as_vec3();
        let margin = Vec3::splat(TREE_MARGIN as f32);
        // As arrays, since the tree may use another version of glam than this crate.
        let boxes: Vec<Aabb> = (corners.iter())
            .map(|&[a, b, c]| Aabb {
                min: (in_tree(a.min(b).min(c)) - margin).to_array().into(),
                max: (in_tree(a.max(b).max(c)) + margin).to_array().into(),
            })
            .collect();
        let mut time = std::time::Duration::ZERO;
        let tree = build_cwbvh(&boxes, BvhBuildParams::medium_build(), &mut time);
        let triangles = (tree.primitive_indices.iter())
            .map(|&number| Numbered {
                number,
                triangle: Triangle::new(corners[number as usize]),
            })
            .collect();
        let margin = DVec3::splat(TREE_MARGIN / scale);
        Some(Self {
            triangles,
            tree,
            low: low - margin,
            high: high + margin,
            scale,
            tolerance: TOLERANCE * low.distance(high),
        })
    }

    /// m
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// The part of a ray within the range that lies in the box around all triangles, in units of the tree, and the distance in m at
    /// which it begins; `None` where there is none. The part is as short as the box, however far away the ray begins,
    /// so that 32 bits are enough for it. Slab test (Kay, Kajiya, *Ray tracing complex scenes*, SIGGRAPH 1986).
    #[inline]
    fn enter(&self, origin: DVec3, direction: DVec3, range: Range) -> Option<(Ray, f64)> {
        let inverse = finite_reciprocal(direction);
        let (to_low, to_high) = (
            (self.low - origin) * inverse,
            (self.high - origin) * inverse,
        );
        let begin = to_low.min(to_high).max_element().max(range[0]);
        let end = to_low.max(to_high).min_element().min(range[1]);
        if begin > end {
            return None;
        }
        let start = (origin + begin * direction - self.low) * self.scale - TREE_MARGIN;
        let length = self.in_tree(end - begin);
        // The tree takes −0 for a positive number, but its reciprocal for a negative one; −0 + 0 = 0.
        let direction = direction.as_vec3() + Vec3::ZERO;
        let [start, direction] = [start.as_vec3(), direction].map(|v| v.to_array().into());
        Some((Ray::new(start, direction, 0.0, length), begin))
    }

    /// A distance in units of the tree, no shorter than it is.
    fn in_tree(&self, distance: f64) -> f32 {
        (distance * self.scale + TREE_MARGIN) as f32
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
        let Some((ray, _)) = self.enter(origin, direction, range) else {
            return false;
        };
        let blocks = |leaf: usize| {
            let Numbered { number, triangle } = &self.triangles[leaf];
            Some(*number) != origin_triangle && triangle.meets(origin, direction, range)
        };
        // Any distance within the ray's ends the search.
        let distance = |_: &Ray, leaf| if blocks(leaf) { 0.0 } else { f32::INFINITY };
        !self.tree.ray_traverse_miss(ray, distance)
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
        let (ray, begin) = self.enter(origin, direction, [self.tolerance, length])?;
        let mut nearest = None;
        let mut reach = length;
        let distance = |_: &Ray, leaf: usize| {
            let Numbered { number, triangle } = &self.triangles[leaf];
            if Some(*number) == origin_triangle {
                return f32::INFINITY;
            }
            match triangle.crossing(origin, direction) {
                Some((distance, weights)) if distance >= self.tolerance && distance < reach => {
                    reach = distance;
                    nearest = Some((*number, distance, weights));
                    self.in_tree(distance - begin)
                }
                _ => f32::INFINITY,
            }
        };
        self.tree.ray_traverse(ray, &mut RayHit::none(), distance);
        nearest
    }

    /// Calls `meets` with all triangles that the ray crosses: number, distance in m, and the weights of the second and
    /// third corner there.
    pub fn all_along(
        &self,
        origin: DVec3,
        direction: DVec3,
        mut meets: impl FnMut(u32, f64, DVec2),
    ) {
        let Some((ray, _)) = self.enter(origin, direction, [0.0, f64::INFINITY]) else {
            return;
        };
        self.tree.ray_traverse_anyhit(ray, |_, leaf| {
            let Numbered { number, triangle } = &self.triangles[leaf];
            match triangle.crossing(origin, direction) {
                Some((distance, weights)) if distance >= 0.0 => meets(*number, distance, weights),
                _ => {}
            }
        });
    }
}

/// 1/d, but finite, so that a ray along the plane of a box's face gives no 0·∞ = NaN.
fn finite_reciprocal(direction: DVec3) -> DVec3 {
    const LARGE: f64 = 1e200;
    direction
        .recip()
        .clamp(DVec3::splat(-LARGE), DVec3::splat(LARGE))
}

/// A triangle that rays cross.
pub struct Triangle {
    a: DVec3,
    edge_1: DVec3,
    edge_2: DVec3,
}

impl Triangle {
    /// Of three corners, m.
    pub fn new([a, b, c]: [DVec3; 3]) -> Self {
        let (edge_1, edge_2) = (b - a, c - a);
        Self { a, edge_1, edge_2 }
    }

    fn meets(&self, origin: DVec3, direction: DVec3, range: Range) -> bool {
        (self.crossing(origin, direction)).is_some_and(|(t, _)| t >= range[0] && t <= range[1])
    }

    /// Distance along the line and the weights of the second and third corner, after Möller, Trumbore,
    /// *Fast, minimum storage ray/triangle intersection*, 1997.
    #[inline]
    pub fn crossing(&self, origin: DVec3, direction: DVec3) -> Option<(f64, DVec2)> {
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
                // Inwards; of the second, 32 bits make 0. Either sign of 0 occurs.
                for small in [0.0, 1e-60] {
                    let start = DVec3::new(x, 0.0, z);
                    let up = DVec3::new(-small * x, 1.0, -small * z);
                    assert!(
                        blockers.block(start, up, f64::INFINITY, None),
                        "{start} {up}"
                    );
                    let far = start - 1e7 * DVec3::Y;
                    assert!(blockers.block(far, up, f64::INFINITY, None), "{far} {up}");
                }
            }
        }
    }

    /// Small things on a wide floor, met from near and from far, along the axes, too.
    #[test]
    fn nothing_small_is_lost_beside_something_wide() {
        use crate::reference::sequence::sobol_4d;
        let small = |i: u32| {
            let [x, y, z, size] = sobol_4d(i, 3);
            let middle = DVec3::new(x, y, z);
            let extent = 1e-4 * size;
            [DVec3::X, DVec3::Y, DVec3::Z].map(|axis| middle + extent * axis)
        };
        let wide = square(0.0).map(|triangle| triangle.map(|corner| 1e3 * corner));
        let corners: Vec<_> = (0..200).map(small).chain(wide).collect();
        let blockers = Blockers::new(&corners).unwrap();
        for (number, &[a, b, c]) in corners.iter().enumerate().take(200) {
            let place = 0.2 * a + 0.3 * b + 0.5 * c;
            for direction in [
                DVec3::X,
                DVec3::NEG_Y,
                DVec3::NEG_Z,
                DVec3::new(0.6, -0.0, 0.8),
            ] {
                for distance in [1e-6, 1.0, 1e4] {
                    let origin = place - distance * direction;
                    let mut found = Vec::new();
                    blockers.all_along(origin, direction, |triangle, _, _| found.push(triangle));
                    let by_loop = |(i, &corners): (usize, &[DVec3; 3])| {
                        let (at, _) = Triangle::new(corners).crossing(origin, direction)?;
                        (at >= 0.0).then_some((i as u32, at))
                    };
                    let mut all: Vec<(u32, f64)> =
                        corners.iter().enumerate().filter_map(by_loop).collect();
                    found.sort_unstable();
                    assert!(found.iter().eq(all.iter().map(|(number, _)| number)));
                    assert!(found.contains(&(number as u32)) || distance > 1e3);
                    all.retain(|&(_, at)| at >= blockers.tolerance);
                    let nearest = all.into_iter().min_by(|a, b| a.1.total_cmp(&b.1));
                    let by_tree = blockers.nearest(origin, direction, f64::INFINITY, None);
                    assert_eq!(by_tree.map(|(triangle, at, _)| (triangle, at)), nearest);
                }
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
            let by_loop =
                (blockers.triangles.iter()).any(|t| t.triangle.meets(origin, direction, range));
            assert_eq!(blockers.block(origin, direction, 0.4, None), by_loop);
            let nearest = (blockers.triangles.iter())
                .filter_map(|t| t.triangle.crossing(origin, direction))
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
