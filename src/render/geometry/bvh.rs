//! The bounding volume hierarchy that trace.glsl traverses.
//!
//! The tree is built top-down by the surface area heuristic over bins (Wald 2007). The bins are by centroid and by
//! surface area. This takes nearly linear time for every arrangement of triangles; bottom-up builders are quadratic where
//! thousands coincide. Then the tree is packed: a node holds the bounding boxes of its two children with 16 bits per
//! side, rounded outward, so that a step reads 32 bytes. Small nodes matter on software devices, which load each word
//! separately.

use crate::render::geometry::bvh_build::{Aabb, TreeNode, build, compact, cost, union};
use crate::render::gpu_types::constants::COUNT_SHIFT;
use crate::render::gpu_types::{self, Grid, Node};
use glam::{UVec3, Vec3};
use rayon::prelude::*;

/// A packed hierarchy.
pub struct Bvh {
    pub grid: Grid,
    /// The root first; at least one.
    pub nodes: Vec<Node>,
    /// Order of the triangles in the leaves.
    pub order: Vec<u32>,
    /// Every node with its left subtree behind it, and then the right one.
    tree: Vec<TreeNode>,
    /// Indices in `tree` of `nodes`.
    packed: Vec<u32>,
    /// Cost of the tree when it was built.
    cost: f64,
}

/// Maximum grid coordinate.
const LAST: f32 = 65535.0;
/// Margin around the scene, grid steps. For a ray that starts 250 scene sizes away, rounding moves the start by one
/// step. Boxes are therefore one step larger than their triangles, and the margin leaves space for that.
const MARGIN: f32 = 4.0;

/// A tree is rebuilt when its cost has grown by this factor, and refitted until then. Over 120 frames of `pool` and of
/// a turning `ring`, updates took 5.2 and 1.1 ms with refitting, 16.7 and 3.4 ms with a rebuild in every frame; rays
/// took the same time in both cases.
const GROWN: f64 = 2.0;

/// Nodes that one thread refits or packs at once.
const PART: usize = 16_384;

impl Bvh {
    /// A hierarchy over at least one triangle.
    pub fn new(triangles: &[gpu_types::Triangle]) -> Self {
        let boxes: Vec<Aabb> = triangles.iter().map(Aabb::of).collect();
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        let mut sparse = vec![TreeNode::default(); 2 * triangles.len() - 1];
        build(&boxes, &mut order, 0, &mut sparse, [0, 1]);
        let tree = compact(&sparse);
        let packed = packed(&tree);
        let mut bvh = Self {
            nodes: linked(&tree, &packed),
            packed,
            grid: Grid::default(),
            order,
            cost: cost(&tree),
            tree,
        };
        bvh.pack_boxes();
        bvh
    }

    /// Refits the boxes to moved triangles, given in the order of the leaves. Returns false where the tree has become
    /// too costly and must be rebuilt.
    pub fn refit(&mut self, triangles: &[gpu_types::Triangle]) -> bool {
        if refit(&mut self.tree, 0, triangles) > GROWN * self.cost {
            return false;
        }
        self.pack_boxes();
        true
    }

    /// Takes the boxes of the tree over to the grid and the nodes.
    fn pack_boxes(&mut self) {
        let (tree, grid) = (&self.tree, grid(&self.tree[0].aabb));
        let bounds = |index: u32| quantise(&grid, &tree[index as usize].aabb);
        let nodes = self.nodes.par_iter_mut().zip(&self.packed);
        nodes.with_min_len(PART).for_each(|(node, &of)| {
            let [left, right] = children(tree, of);
            (node.left, node.right) = (bounds(left), bounds(right));
        });
        self.grid = grid;
    }
}

impl Bvh {
    /// Calls `visit` with the indices, in the order of the leaves, of the triangles whose boxes a ray may meet before
    /// `farthest`. `visit` may lower `farthest`.
    pub fn walk(
        &self,
        origin: Vec3,
        direction: Vec3,
        farthest: &mut f32,
        mut visit: impl FnMut(usize, &mut f32),
    ) {
        let inverse = direction.recip();
        let mut open = vec![0u32];
        while let Some(index) = open.pop() {
            let node = &self.tree[index as usize];
            if !node.aabb.meets(origin, inverse, *farthest) {
                continue;
            }
            match node.is_leaf {
                true => node
                    .triangles()
                    .for_each(|triangle| visit(triangle, farthest)),
                false => open.extend([node.left, node.right]),
            }
        }
    }

    /// Length of the scene's diagonal, m.
    pub fn size(&self) -> f32 {
        self.tree[0].aabb.lower.distance(self.tree[0].aabb.upper)
    }
}

/// The scene's bounds as a grid of 2¹⁶ steps per side, with a margin for boxes rounded outward.
fn grid(root: &Aabb) -> Grid {
    let (lower, upper) = (root.lower, root.upper);
    // A flat scene gets a small height, which avoids a division by zero.
    let smallest = (upper - lower).max_element() / LAST;
    let step = (upper - lower).max(Vec3::splat(smallest)) / (LAST - 2.0 * MARGIN);
    Grid {
        lower: lower - MARGIN * step,
        scale: step.recip(),
        ..Default::default()
    }
}

/// Refits the boxes of a subtree, whose root has the index `first` among all nodes; its cost.
fn refit(nodes: &mut [TreeNode], first: u32, triangles: &[gpu_types::Triangle]) -> f64 {
    if nodes.len() <= PART {
        for index in (0..nodes.len()).rev() {
            let node = nodes[index];
            nodes[index].aabb = match node.is_leaf {
                true => union(triangles[node.triangles()].iter().map(Aabb::of)),
                false => union([node.left, node.right].map(|i| nodes[(i - first) as usize].aabb)),
            };
        }
        return cost(nodes);
    }
    let TreeNode { left, right, .. } = nodes[0];
    let (root, children) = nodes.split_at_mut(1);
    let (on_left, on_right) = children.split_at_mut((right - left) as usize);
    let (left_cost, right_cost) = rayon::join(
        || refit(on_left, left, triangles),
        || refit(on_right, right, triangles),
    );
    root[0].aabb = on_left[0].aabb.union(on_right[0].aabb);
    f64::from(root[0].aabb.half_area()) + left_cost + right_cost
}

/// The children of an inner node. A root that is the only leaf is its own two, at little cost.
fn children(tree: &[TreeNode], index: u32) -> [u32; 2] {
    let node = &tree[index as usize];
    match node.is_leaf {
        true => [index; 2],
        false => [node.left, node.right],
    }
}

/// Indices in the tree of the nodes that are packed: the inner ones, or a root that is the only leaf.
fn packed(tree: &[TreeNode]) -> Vec<u32> {
    let is_packed = |index: &u32| tree.len() == 1 || !tree[*index as usize].is_leaf;
    (0..tree.len() as u32).filter(is_packed).collect()
}

/// Nodes with links to both children and without their boxes.
fn linked(tree: &[TreeNode], packed: &[u32]) -> Vec<Node> {
    let mut places = vec![0; tree.len()];
    for (place, &index) in (0..).zip(packed) {
        places[index as usize] = place;
    }
    let link = |index: u32| {
        let node = &tree[index as usize];
        if node.is_leaf {
            assert!(node.right < 16 && node.left >> COUNT_SHIFT == 0);
            node.left | node.right << COUNT_SHIFT
        } else {
            places[index as usize]
        }
    };
    let nodes = packed.iter().map(|&index| {
        let [left_link, right_link] = children(tree, index).map(link);
        Node {
            left_link,
            right_link,
            ..Default::default()
        }
    });
    nodes.collect()
}

/// A bounding box in grid coordinates, lower | upper << 16 per axis, at least one step larger than rounding requires.
fn quantise(grid: &Grid, aabb: &Aabb) -> UVec3 {
    // Conversion rounds toward zero.
    let low = (aabb.lower - grid.lower) * grid.scale - 1.0;
    let high = (aabb.upper - grid.lower) * grid.scale + 2.0;
    low.as_uvec3() | high.as_uvec3() << 16u32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::geometry::bvh_build::MAX_DEPTH;
    use glam::Vec3Swizzles;

    /// Triangles that coincide, that contain each other, and along a line of growing distances.
    #[test]
    fn the_stack_holds_degenerate_scenes() {
        let triangle = |at: f32, size: f32| gpu_types::Triangle {
            position: at * Vec3::X,
            edge1: size * Vec3::X,
            edge2: size * Vec3::Y,
            ..Default::default()
        };
        let all =
            |make: &dyn Fn(u32) -> gpu_types::Triangle| (0..100_000).map(make).collect::<Vec<_>>();
        assert_depth(&all(&|_| triangle(0.0, 1.0)));
        assert_depth(&all(&|i| triangle(0.0, 1.001f32.powi((i % 50_000) as i32))));
        assert_depth(&all(&|i| {
            triangle(1.003f32.powi((i % 25_000) as i32), 1e-3)
        }));
        assert_depth(&all(&|i| triangle((i as f32).recip(), 1e-9)));
    }

    fn assert_depth(triangles: &[gpu_types::Triangle]) {
        let bvh = Bvh::new(triangles);
        let mut open = vec![(0u32, 1)];
        let mut deepest = 0;
        while let Some((link, level)) = open.pop() {
            deepest = deepest.max(level);
            if link >> COUNT_SHIFT == 0 {
                let node = bvh.nodes[link as usize];
                open.extend([(node.left_link, level + 1), (node.right_link, level + 1)]);
            }
        }
        assert!((14..=MAX_DEPTH).contains(&deepest), "{deepest}");
    }

    /// Every triangle is in one leaf, and every box on the path to the leaf contains the triangle, also after all
    /// triangles have moved.
    #[test]
    fn packed_boxes_hold_their_triangles() {
        let corner = |i: u32| {
            let x = f32::from((i.wrapping_mul(40503) >> 3) as u16) / 1000.0;
            Vec3::new(x, (x * 7.0).sin(), (x * 3.0).cos())
        };
        for count in [1, 2, 9, 1000, 60_000] {
            let triangles: Vec<_> = (0..count)
                .map(|i| gpu_types::Triangle {
                    position: corner(3 * i),
                    edge1: corner(3 * i + 1) - corner(3 * i),
                    edge2: corner(3 * i + 2) - corner(3 * i),
                    ..Default::default()
                })
                .collect();
            let mut bvh = Bvh::new(&triangles);
            assert_eq!(bvh.tree.len() > PART, count == 60_000, "by several threads");
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

    /// A tree over triangles that have moved apart must be rebuilt.
    #[test]
    fn a_tree_of_scattered_triangles_is_given_up() {
        let at = |i: u32, scattered: bool| gpu_types::Triangle {
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
    fn assert_holds(bvh: &Bvh, triangles: &[gpu_types::Triangle]) {
        let mut seen = vec![false; triangles.len()];
        let mut open = vec![(0u32, UVec3::splat(0xffff_0000))];
        while let Some((link, bounds)) = open.pop() {
            let (leaf, first) = (link >> COUNT_SHIFT, link & ((1 << COUNT_SHIFT) - 1));
            for place in first..first + leaf {
                seen[place as usize] = true;
                let triangle = &triangles[place as usize];
                let a = triangle.position;
                for vertex in [a, a + triangle.edge1, a + triangle.edge2] {
                    let at = (vertex - bvh.grid.lower) * bvh.grid.scale;
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
