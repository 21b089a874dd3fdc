//! The bounding volume hierarchy that trace.glsl traverses.
//!
//! The tree is built top-down by the surface area heuristic over bins (Wald 2007). The bins are by centroid and by
//! surface area. This takes nearly linear time for every arrangement of triangles; bottom-up builders are quadratic where
//! thousands coincide. The device gets the links between nodes, and fits the boxes to the triangles of each frame
//! (hierarchy.rs). A node holds the bounding boxes of its two children with 16 bits per side, rounded outward, so that a
//! step reads 32 bytes. Small nodes matter on software devices, which load each word separately.

use crate::render::geometry::bvh_build::{Aabb, TreeNode, build, compact, cost, union};
use crate::render::gpu_types::constants::COUNT_SHIFT;
use crate::render::gpu_types::{self, Node};
use glam::Vec3;

#[derive(Clone)]
pub struct Bvh {
    /// Order of the triangles in the leaves.
    pub order: Vec<u32>,
    /// Every node with its left subtree behind it, and then the right one.
    tree: Vec<TreeNode>,
}

impl Bvh {
    /// A hierarchy over at least one triangle.
    pub fn new(triangles: &[gpu_types::Triangle]) -> Self {
        let boxes: Vec<Aabb> = triangles.iter().map(Aabb::of).collect();
        let mut order: Vec<u32> = (0..triangles.len() as u32).collect();
        let mut sparse = vec![TreeNode::default(); 2 * triangles.len() - 1];
        build(&boxes, &mut order, 0, &mut sparse, [0, 1]);
        let tree = compact(&sparse);
        Self { order, tree }
    }

    /// Sum of half the surface areas of the inner nodes, m²; infinite where there are none.
    pub fn cost(&self) -> f64 {
        match self.tree.len() {
            1 => f64::INFINITY,
            _ => cost(&self.tree),
        }
    }

    /// Refits the boxes to moved triangles, given in the order of the leaves.
    pub fn refit(&mut self, triangles: &[gpu_types::Triangle]) {
        for index in (0..self.tree.len()).rev() {
            let node = self.tree[index];
            self.tree[index].aabb = match node.is_leaf {
                true => union(triangles[node.triangles()].iter().map(Aabb::of)),
                false => union([node.left, node.right].map(|i| self.tree[i as usize].aabb)),
            };
        }
    }

    /// The nodes of the device, the root first, without their boxes.
    pub fn nodes(&self) -> Links {
        let tree = &self.tree;
        // The inner nodes, or a root that is the only leaf.
        let packed: Vec<u32> = (0..tree.len() as u32)
            .filter(|&index| tree.len() == 1 || !tree[index as usize].is_leaf)
            .collect();
        let mut places = vec![0; tree.len()];
        for (place, &index) in (0..).zip(&packed) {
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
        // A root that is the only leaf is its own two children, at little cost.
        let children = |index: u32| match &tree[index as usize] {
            node if node.is_leaf => [index; 2],
            node => [node.left, node.right],
        };
        let nodes = packed.iter().map(|&index| {
            let [left_link, right_link] = children(index).map(link);
            Node {
                left_link,
                right_link,
                ..Default::default()
            }
        });
        // Children are behind their parents.
        let mut heights = vec![0; packed.len()];
        for (place, &index) in packed.iter().enumerate().rev() {
            let inner = children(index)
                .into_iter()
                .filter(|&child| !tree[child as usize].is_leaf);
            let of_children = inner.map(|child| heights[places[child as usize] as usize] + 1);
            heights[place] = of_children.max().unwrap_or(0);
        }
        let mut order: Vec<u32> = (0..packed.len() as u32).collect();
        order.sort_by_key(|&place| heights[place as usize]);
        let levels = order.chunk_by(|&a, &b| heights[a as usize] == heights[b as usize]);
        Links {
            nodes: nodes.collect(),
            levels: levels.map(<[u32]>::len).collect(),
            order,
        }
    }
}

/// The nodes of the device.
pub struct Links {
    pub nodes: Vec<Node>,
    /// Indices of the nodes, so that children are in lower levels than their parents.
    pub order: Vec<u32>,
    /// Number of nodes of each level.
    pub levels: Vec<usize>,
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
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::geometry::bvh_build::MAX_DEPTH;

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
        let nodes = Bvh::new(triangles).nodes().nodes;
        let mut open = vec![(0u32, 1)];
        let mut deepest = 0;
        while let Some((link, level)) = open.pop() {
            deepest = deepest.max(level);
            if link >> COUNT_SHIFT == 0 {
                let node = nodes[link as usize];
                open.extend([(node.left_link, level + 1), (node.right_link, level + 1)]);
            }
        }
        assert!((14..=MAX_DEPTH).contains(&deepest), "{deepest}");
    }
}
