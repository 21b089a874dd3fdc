//! The bounding volume hierarchy that trace.glsl walks.
//!
//! Built by obvhs, then packed: a node holds its two children's boxes in 16 bits a side, rounded
//! outward, so that a step reads 32 bytes. Software devices gather every word by itself.

use super::layout::{Grid, Node};
use glam::{UVec3, Vec3};
use obvhs::bvh2::{builder::build_bvh2_from_tris, node::Bvh2Node};
use obvhs::{BvhBuildParams, triangle::Triangle};
use std::time::Duration;

/// A packed hierarchy.
pub struct Bvh {
    pub grid: Grid,
    /// The root first; at least one.
    pub nodes: Vec<Node>,
    /// Leaves count triangles in this order.
    pub order: Vec<u32>,
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

impl Bvh {
    /// A hierarchy over at least one triangle.
    pub fn new(triangles: &[Triangle]) -> Self {
        let mut params = BvhBuildParams::medium_build();
        // Small leaves: rays that walk side by side wait for the one with the most triangles.
        params.collapse_traversal_cost = 1.0;
        let built = build_bvh2_from_tris(triangles, params, &mut Duration::default());
        let (nodes, order) = if depth(&built.nodes) <= MAX_DEPTH {
            (built.nodes, built.primitive_indices)
        } else {
            balanced(triangles)
        };
        let grid = grid(&nodes[0]);
        Self {
            nodes: pack(&nodes, &grid),
            grid,
            order,
        }
    }
}

/// Halves along the longest side, for thousands of triangles in one place, of which the builder
/// makes a list.
fn balanced(triangles: &[Triangle]) -> (Vec<Bvh2Node>, Vec<u32>) {
    let bounds = |indices: &[u32]| {
        let boxes = indices.iter().map(|&i| triangles[i as usize].aabb());
        boxes.reduce(|a, b| a.union(&b)).expect("no range is empty")
    };
    let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
    let mut nodes = vec![Bvh2Node::default()];
    let mut open = vec![(0, 0..order.len())];
    while let Some((node, range)) = open.pop() {
        let indices = &mut order[range.clone()];
        let aabb = bounds(indices);
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
    (nodes, order)
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

    /// 5000 triangles in one place, which the builder would hang in a chain.
    #[test]
    fn the_stack_holds_degenerate_scenes() {
        let [v0, v1, v2] = [Vec3::ZERO, Vec3::X, Vec3::Y].map(Into::into);
        let bvh = Bvh::new(&vec![Triangle { v0, v1, v2 }; 5000]);
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

    /// Every triangle is in one leaf, and every box on the way to it holds it.
    #[test]
    fn packed_boxes_hold_their_triangles() {
        let corner = |i: u32| {
            let x = f32::from((i.wrapping_mul(40503) >> 3) as u16) / 1000.0;
            Vec3::new(x, (x * 7.0).sin(), (x * 3.0).cos()).into()
        };
        for count in [1, 2, 9, 1000] {
            let triangles: Vec<_> = (0..count)
                .map(|i| Triangle {
                    v0: corner(3 * i),
                    v1: corner(3 * i + 1),
                    v2: corner(3 * i + 2),
                })
                .collect();
            let bvh = Bvh::new(&triangles);
            let mut seen = vec![false; count as usize];
            let mut open = vec![(0u32, UVec3::splat(0xffff_0000))];
            while let Some((link, bounds)) = open.pop() {
                let (leaf, first) = (link >> COUNT_SHIFT, link & ((1 << COUNT_SHIFT) - 1));
                for place in first..first + leaf {
                    let index = bvh.order[place as usize] as usize;
                    seen[index] = true;
                    for vertex in [
                        triangles[index].v0,
                        triangles[index].v1,
                        triangles[index].v2,
                    ] {
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
            assert!(seen.iter().all(|seen| *seen), "{count}");
        }
    }
}
