//! The bounding volume hierarchy that trace.glsl walks.
//!
//! Built by obvhs, then packed: a node holds its two children's boxes in 16 bits a side, rounded
//! outward, so that a step reads 32 bytes. Software devices gather every word by itself.

use super::layout::{self, Grid, Node};
use glam::{UVec3, Vec3};
use obvhs::aabb::Aabb;
use obvhs::bvh2::{Bvh2, builder::build_bvh2_from_tris, node::Bvh2Node};
use obvhs::{BvhBuildParams, triangle::Triangle};
use std::time::Duration;

/// A packed hierarchy.
pub struct Bvh {
    pub grid: Grid,
    /// The root first; at least one.
    pub nodes: Vec<Node>,
    /// Leaves count triangles in this order.
    pub order: Vec<u32>,
    tree: Bvh2,
    /// Of the tree as it was built.
    cost: f32,
}

/// Deepest hierarchy that `STACK` of trace.glsl can walk.
const MAX_DEPTH: usize = 48;
/// Bits of a link below the number of triangles.
const COUNT_SHIFT: u32 = 28;
/// Last value of the grid's coordinates.
const LAST: f32 = 65535.0;
/// Steps around the scene. The rounding of a ray's start 250 times the scene's size away is one
/// step, so boxes are a step larger than their triangles, and this leaves them their room.
const MARGIN: f32 = 4.0;

/// A tree whose boxes have grown to so many times their area is built anew. Until then it is refitted:
/// over 120 frames of `pool` and of a turning `ring`, updates took 5.2 and 1.1 ms with the tree
/// refitted, 16.7 and 3.4 ms with a new one for each frame, and rays took the same time in both.
const GROWN: f32 = 2.0;

impl Bvh {
    /// A hierarchy over at least one triangle.
    pub fn new(triangles: &[layout::Triangle]) -> Self {
        let triangles: Vec<Triangle> = triangles.iter().map(corners).collect();
        let mut params = BvhBuildParams::medium_build();
        // Small leaves: rays that walk side by side wait for the one with the most triangles.
        params.collapse_traversal_cost = 1.0;
        let mut tree = build_bvh2_from_tris(&triangles, params, &mut Duration::default());
        if depth(&tree.nodes) > MAX_DEPTH {
            tree = balanced(&triangles);
        }
        let grid = grid(&tree.nodes[0]);
        Self {
            nodes: pack(&tree.nodes, &grid),
            grid,
            order: std::mem::take(&mut tree.primitive_indices),
            cost: cost(&tree.nodes),
            tree,
        }
    }

    /// Fits the boxes to the triangles, given in the order of the leaves, that have moved. Returns
    /// whether the tree still suits them; otherwise build another.
    pub fn refit(&mut self, triangles: &[layout::Triangle]) -> bool {
        for node in self.tree.nodes.iter_mut().filter(|node| node.is_leaf()) {
            let first = node.first_index as usize;
            let leaf = &triangles[first..first + node.prim_count as usize];
            node.set_aabb(bounds(leaf.iter().map(|triangle| corners(triangle).aabb())));
        }
        self.tree.refit_all();
        if cost(&self.tree.nodes) > GROWN * self.cost {
            return false;
        }
        self.grid = grid(&self.tree.nodes[0]);
        self.nodes = pack(&self.tree.nodes, &self.grid);
        true
    }
}

fn corners(triangle: &layout::Triangle) -> Triangle {
    Triangle {
        v0: triangle.position.into(),
        v1: (triangle.position + triangle.edge1).into(),
        v2: (triangle.position + triangle.edge2).into(),
    }
}

/// Of at least one box.
fn bounds(boxes: impl Iterator<Item = Aabb>) -> Aabb {
    boxes.reduce(|a, b| a.union(&b)).expect("no range is empty")
}

/// Expected steps of a ray, up to a constant factor: the area of all boxes with children.
fn cost(nodes: &[Bvh2Node]) -> f32 {
    let inner = nodes.iter().filter(|node| !node.is_leaf());
    inner.map(|node| node.aabb().half_area()).sum()
}

/// Halves along the longest side, for thousands of triangles in one place, of which the builder
/// makes a list.
fn balanced(triangles: &[Triangle]) -> Bvh2 {
    let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
    let mut nodes = vec![Bvh2Node::default()];
    let mut open = vec![(0, 0..order.len())];
    while let Some((node, range)) = open.pop() {
        let indices = &mut order[range.clone()];
        let aabb = bounds(indices.iter().map(|&i| triangles[i as usize].aabb()));
        if indices.len() <= 4 {
            nodes[node] = Bvh2Node::new(aabb, indices.len() as u32, range.start as u32);
            continue;
        }
        let axis = aabb.largest_axis();
        let place = |&i: &u32| triangles[i as usize].aabb().center()[axis];
        let half = indices.len() / 2;
        indices.select_nth_unstable_by(half, |a, b| place(a).total_cmp(&place(b)));
        let child = nodes.len();
        nodes[node] = Bvh2Node::new(aabb, 0, child as u32);
        nodes.resize(child + 2, Bvh2Node::default());
        open.push((child, range.start..range.start + half));
        open.push((child + 1, range.start + half..range.end));
    }
    Bvh2 {
        nodes,
        primitive_indices: order,
        children_are_ordered_after_parents: true,
        ..Default::default()
    }
}

/// The scene's bounds as a grid of 2¹⁶ steps a side, with room for boxes rounded outward.
fn grid(root: &Bvh2Node) -> Grid {
    let (lower, upper) = (Vec3::from(root.aabb().min), Vec3::from(root.aabb().max));
    // A flat scene still needs some height to divide by.
    let smallest = (upper - lower).max_element() / LAST;
    let step = (upper - lower).max(Vec3::splat(smallest)) / (LAST - 2.0 * MARGIN);
    Grid {
        lower: lower - MARGIN * step,
        scale: step.recip(),
        ..Default::default()
    }
}

/// Inner nodes in their order, each with both children.
fn pack(nodes: &[Bvh2Node], grid: &Grid) -> Vec<Node> {
    let mut packed_index = vec![0; nodes.len()];
    let mut inner = 0;
    for (index, node) in nodes.iter().enumerate() {
        packed_index[index] = inner;
        inner += u32::from(!node.is_leaf());
    }
    let link = |index: usize| {
        let node = &nodes[index];
        if node.is_leaf() {
            assert!(node.prim_count < 16 && node.first_index >> COUNT_SHIFT == 0);
            node.first_index | node.prim_count << COUNT_SHIFT
        } else {
            packed_index[index]
        }
    };
    let bounds = |index: usize| {
        let aabb = nodes[index].aabb();
        quantise(grid, Vec3::from(aabb.min), Vec3::from(aabb.max))
    };
    if nodes[0].is_leaf() {
        // The root needs two children: the only leaf twice costs little.
        return vec![Node {
            left: bounds(0),
            left_link: link(0),
            right: bounds(0),
            right_link: link(0),
        }];
    }
    (nodes.iter())
        .filter(|node| !node.is_leaf())
        .map(|node| {
            let child = node.first_index as usize;
            Node {
                left: bounds(child),
                left_link: link(child),
                right: bounds(child + 1),
                right_link: link(child + 1),
            }
        })
        .collect()
}

/// A box in grid steps, lower | upper << 16 by axis, a step larger than rounding needs.
fn quantise(grid: &Grid, lower: Vec3, upper: Vec3) -> UVec3 {
    let low = ((lower - grid.lower) * grid.scale - 1.0).floor();
    let high = ((upper - grid.lower) * grid.scale + 1.0).ceil();
    low.as_uvec3() | high.as_uvec3() << 16u32
}

/// Levels of a hierarchy.
fn depth(nodes: &[Bvh2Node]) -> usize {
    let mut deepest = 0;
    let mut open = vec![(0u32, 1usize)];
    while let Some((index, level)) = open.pop() {
        deepest = deepest.max(level);
        let node = &nodes[index as usize];
        if !node.is_leaf() {
            open.extend([0, 1].map(|child| (node.first_index + child, level + 1)));
        }
    }
    deepest
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3Swizzles;

    /// 5000 triangles in one place, which the builder would hang in a chain.
    #[test]
    fn the_stack_holds_degenerate_scenes() {
        let triangle = layout::Triangle {
            edge1: Vec3::X,
            edge2: Vec3::Y,
            ..Default::default()
        };
        let bvh = Bvh::new(&vec![triangle; 5000]);
        let mut open = vec![(0u32, 1)];
        let mut deepest = 0;
        while let Some((link, level)) = open.pop() {
            deepest = deepest.max(level);
            if link >> COUNT_SHIFT == 0 {
                let node = bvh.nodes[link as usize];
                open.extend([(node.left_link, level + 1), (node.right_link, level + 1)]);
            }
        }
        assert!((11..=MAX_DEPTH).contains(&deepest), "{deepest}");
    }

    /// Every triangle is in one leaf, and every box on the way to it holds it; also after they have
    /// all moved.
    #[test]
    fn packed_boxes_hold_their_triangles() {
        let corner = |i: u32| {
            let x = f32::from((i.wrapping_mul(40503) >> 3) as u16) / 1000.0;
            Vec3::new(x, (x * 7.0).sin(), (x * 3.0).cos())
        };
        for count in [1, 2, 9, 1000] {
            let triangles: Vec<_> = (0..count)
                .map(|i| layout::Triangle {
                    position: corner(3 * i),
                    edge1: corner(3 * i + 1) - corner(3 * i),
                    edge2: corner(3 * i + 2) - corner(3 * i),
                    ..Default::default()
                })
                .collect();
            let mut bvh = Bvh::new(&triangles);
            let mut sorted: Vec<_> = bvh.order.iter().map(|i| triangles[*i as usize]).collect();
            assert_holds(&bvh, &sorted);
            for triangle in &mut sorted {
                triangle.position = triangle.position.yzx() + Vec3::Z;
                triangle.edge1 = triangle.edge1.yzx();
                triangle.edge2 = triangle.edge2.yzx();
            }
            assert!(bvh.refit(&sorted), "turned by a third");
            assert_holds(&bvh, &sorted);
        }
    }

    /// A tree over what has come apart is no good any more.
    #[test]
    fn a_tree_of_scattered_triangles_is_given_up() {
        let at = |i: u32, scattered: bool| layout::Triangle {
            position: Vec3::X
                * if scattered {
                    (i * 389 % 1000) as f32
                } else {
                    i as f32
                },
            edge1: Vec3::Y,
            edge2: Vec3::Z,
            ..Default::default()
        };
        let row: Vec<_> = (0..1000).map(|i| at(i, false)).collect();
        let mut bvh = Bvh::new(&row);
        let scattered: Vec<_> = bvh.order.iter().map(|i| at(*i, true)).collect();
        assert!(!bvh.refit(&scattered));
    }

    /// `triangles` in the order of the leaves.
    fn assert_holds(bvh: &Bvh, triangles: &[layout::Triangle]) {
        let mut seen = vec![false; triangles.len()];
        let mut open = vec![(0u32, UVec3::splat(0xffff_0000))];
        while let Some((link, bounds)) = open.pop() {
            let (leaf, first) = (link >> COUNT_SHIFT, link & ((1 << COUNT_SHIFT) - 1));
            for place in first..first + leaf {
                seen[place as usize] = true;
                let Triangle { v0, v1, v2 } = corners(&triangles[place as usize]);
                for vertex in [v0, v1, v2] {
                    let at = (Vec3::from(vertex) - bvh.grid.lower) * bvh.grid.scale;
                    let low = (bounds & 0xffffu32).as_vec3();
                    let high = (bounds >> 16u32).as_vec3();
                    assert!(
                        at.cmpge(low).all() && at.cmple(high).all(),
                        "{at} {low} {high}"
                    );
                }
            }
            if leaf == 0 {
                let node = bvh.nodes[link as usize];
                open.extend([(node.left_link, node.left), (node.right_link, node.right)]);
            }
        }
        assert!(seen.iter().all(|seen| *seen), "{}", seen.len());
    }
}
