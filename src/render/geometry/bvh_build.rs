//! The top-down builder of the bounding volume hierarchy: surface area heuristic over bins, by centroid and by
//! surface area.

use crate::render::gpu_types;
use glam::{Vec3, Vec4};
use std::ops::Range;

/// Maximum depth that the stack of trace.glsl can traverse.
pub const MAX_DEPTH: u32 = gpu_types::constants::STACK as u32;
/// Axes of [`Aabb::split_key`].
const AXES: usize = 4;
/// Number of bins per axis.
const BINS: usize = 16;
/// Maximum number of triangles in a leaf. Rays traced together wait for the slowest.
const LEAF: usize = 8;
/// Cost of a traversal step over the cost of a triangle test.
const STEP: f32 = 1.0;
/// Minimum number of triangles for a parallel build.
const PARALLEL: usize = 4096;

/// An axis-aligned bounding box.
#[derive(Debug, Clone, Copy)]
pub struct Aabb {
    pub lower: Vec3,
    pub upper: Vec3,
}

impl Aabb {
    const EMPTY: Self = Self {
        lower: Vec3::INFINITY,
        upper: Vec3::NEG_INFINITY,
    };

    pub fn of(triangle: &gpu_types::Triangle) -> Self {
        let a = triangle.position;
        let (b, c) = (a + triangle.edge1, a + triangle.edge2);
        Self {
            lower: a.min(b).min(c),
            upper: a.max(b).max(c),
        }
    }

    pub fn union(self, other: Self) -> Self {
        Self {
            lower: self.lower.min(other.lower),
            upper: self.upper.max(other.upper),
        }
    }

    /// Half the surface area.
    pub fn half_area(&self) -> f32 {
        let size = (self.upper - self.lower).max(Vec3::ZERO);
        size.x * size.y + size.y * size.z + size.z * size.x
    }

    /// Whether a ray meets the box before `farthest`.
    pub fn meets(&self, origin: Vec3, inverse: Vec3, farthest: f32) -> bool {
        // 0 · ∞ is NaN, which min and max of glam may keep or drop: such a ray lies in a side of the box and counts as
        // a hit.
        let (a, b) = (
            (self.lower - origin) * inverse,
            (self.upper - origin) * inverse,
        );
        let pick = |x: f32, other: f32| if x.is_nan() { other } else { x };
        let near = [0, 1, 2].map(|k| pick(a[k].min(b[k]), f32::NEG_INFINITY));
        let far = [0, 1, 2].map(|k| pick(a[k].max(b[k]), f32::INFINITY));
        let near = near.into_iter().fold(0.0, f32::max);
        near <= far.into_iter().fold(farthest, f32::min)
    }

    /// The coordinates along which boxes are split: twice the centroid, and the logarithm of the surface area up to
    /// factor and offset. A split by area separates the few large triangles of a floor from the many small ones above
    /// it, which a split by centroid cannot.
    fn split_key(&self) -> Vec4 {
        // The bit pattern of a positive float is nearly linear in its logarithm.
        let log_area = self.half_area().to_bits() as f32;
        (self.lower + self.upper).extend(log_area)
    }
}

pub fn union(boxes: impl IntoIterator<Item = Aabb>) -> Aabb {
    boxes.into_iter().fold(Aabb::EMPTY, Aabb::union)
}

#[derive(Debug, Clone, Copy)]
pub struct TreeNode {
    pub aabb: Aabb,
    /// Leaf: the first triangle. Inner node: the left child.
    pub left: u32,
    /// Leaf: the number of triangles. Inner node: the right child.
    pub right: u32,
    pub is_leaf: bool,
}

impl Default for TreeNode {
    fn default() -> Self {
        Self {
            aabb: Aabb::EMPTY,
            left: 0,
            right: 0,
            is_leaf: false,
        }
    }
}

impl TreeNode {
    /// Triangles of a leaf, in the order of the leaves.
    pub fn triangles(&self) -> Range<usize> {
        self.left as usize..(self.left + self.right) as usize
    }
}

/// Builds the subtree at `depth` over the triangles `order`; the first of them is at index `first` in the order of the
/// leaves. `nodes` has the capacity for one triangle per leaf. The root is its first element and has the index `place`
/// among all nodes.
pub fn build(
    boxes: &[Aabb],
    order: &mut [u32],
    first: usize,
    nodes: &mut [TreeNode],
    [place, depth]: [u32; 2],
) {
    let count = order.len();
    let aabb = union(order.iter().map(|&i| boxes[i as usize]));
    let Some(left) = split(boxes, order, &aabb, depth) else {
        nodes[0] = TreeNode {
            aabb,
            left: first as u32,
            right: count as u32,
            is_leaf: true,
        };
        return;
    };
    // The left subtree follows, then the right one.
    let (root, children) = nodes.split_at_mut(1);
    let (left_nodes, right_nodes) = children.split_at_mut(2 * left - 1);
    let (left_order, right_order) = order.split_at_mut(left);
    let [left_place, right_place] = [place + 1, place + 2 * left as u32];
    root[0] = TreeNode {
        aabb,
        left: left_place,
        right: right_place,
        is_leaf: false,
    };
    let mut on_left = || {
        build(
            boxes,
            left_order,
            first,
            left_nodes,
            [left_place, depth + 1],
        )
    };
    let mut on_right = || {
        let places = [right_place, depth + 1];
        build(boxes, right_order, first + left, right_nodes, places);
    };
    if count > PARALLEL {
        rayon::join(on_left, on_right);
    } else {
        on_left();
        on_right();
    }
}

/// Moves the triangles of the left child to the front of `order` and returns their number; None makes a leaf.
fn split(boxes: &[Aabb], order: &mut [u32], aabb: &Aabb, depth: u32) -> Option<usize> {
    let count = order.len();
    if count == 1 {
        return None;
    }
    let key = |i: u32| boxes[i as usize].split_key();
    let (low, high) = order
        .iter()
        .map(|&i| key(i))
        .fold((Vec4::INFINITY, Vec4::NEG_INFINITY), |(low, high), key| {
            (low.min(key), high.max(key))
        });
    let extent = high - low;
    // Halving keeps the tree within the maximum depth.
    let is_deep = depth + 2 + count.next_power_of_two().ilog2() >= MAX_DEPTH;
    if !is_deep && extent.max_element() > 0.0 {
        // Rounding may give the last triangle the bin BINS.
        let scale = BINS as f32 / extent;
        let bin =
            |i: u32, axis: usize| (((key(i) - low)[axis] * scale[axis]) as usize).min(BINS - 1);
        let (cost, axis, last) = cheapest(boxes, order, extent, &bin);
        let is_cheaper = STEP * aabb.half_area() + cost < count as f32 * aabb.half_area();
        if !is_cheaper && count <= LEAF {
            return None;
        }
        if cost.is_finite() {
            let left = partition(order, |&i| bin(i, axis) <= last);
            if (1..count).contains(&left) {
                return Some(left);
            }
        }
    }
    if count <= LEAF {
        return None;
    }
    // The triangles coincide or contain each other: halves in any order are equally good.
    let axis = (extent.truncate().to_array().iter().enumerate())
        .max_by(|a, b| a.1.total_cmp(b.1))
        .map_or(0, |(axis, _)| axis);
    let half = count / 2;
    order.select_nth_unstable_by(half, |&a, &b| {
        (key(a)[axis].total_cmp(&key(b)[axis])).then(a.cmp(&b))
    });
    Some(half)
}

/// The cheapest split: its cost, the axis, and the last bin on the left.
fn cheapest(
    boxes: &[Aabb],
    order: &[u32],
    extent: Vec4,
    bin: &impl Fn(u32, usize) -> usize,
) -> (f32, usize, usize) {
    let mut best = (f32::INFINITY, 0, 0);
    let mut bins = [[(0u32, Aabb::EMPTY); BINS]; AXES];
    let axes = (0..AXES).filter(|&axis| extent[axis] > 0.0);
    for &i in order {
        for axis in axes.clone() {
            let (count, aabb) = &mut bins[axis][bin(i, axis)];
            *count += 1;
            *aabb = aabb.union(boxes[i as usize]);
        }
    }
    let grown =
        |(count, aabb): (u32, Aabb), other: &(u32, Aabb)| (count + other.0, aabb.union(other.1));
    let price = |(count, aabb): &(u32, Aabb)| match count {
        0 => f32::INFINITY,
        _ => *count as f32 * aabb.half_area(),
    };
    for axis in axes {
        let mut right = [0.0; BINS];
        let mut sum = (0, Aabb::EMPTY);
        for last in (1..BINS).rev() {
            sum = grown(sum, &bins[axis][last]);
            right[last] = price(&sum);
        }
        sum = (0, Aabb::EMPTY);
        for last in 0..BINS - 1 {
            sum = grown(sum, &bins[axis][last]);
            let cost = price(&sum) + right[last + 1];
            if cost < best.0 {
                best = (cost, axis, last);
            }
        }
    }
    best
}

/// Moves the elements for which `is_left` holds to the front, keeps both orders, and returns their number.
fn partition(order: &mut [u32], is_left: impl Fn(&u32) -> bool) -> usize {
    let mut right = Vec::with_capacity(order.len());
    let mut left = 0;
    for at in 0..order.len() {
        let index = order[at];
        if is_left(&index) {
            order[left] = index;
            left += 1;
        } else {
            right.push(index);
        }
    }
    order[left..].copy_from_slice(&right);
    left
}

/// Removes the unused nodes of leaves with several triangles; parents stay before their children.
pub fn compact(sparse: &[TreeNode]) -> Vec<TreeNode> {
    let mut places = vec![0; sparse.len()];
    let mut tree = Vec::new();
    let mut open = vec![0u32];
    while let Some(index) = open.pop() {
        let node = sparse[index as usize];
        places[index as usize] = tree.len() as u32;
        tree.push(node);
        if !node.is_leaf {
            open.extend([node.right, node.left]);
        }
    }
    for node in tree.iter_mut().filter(|node| !node.is_leaf) {
        [node.left, node.right] = [node.left, node.right].map(|child| places[child as usize]);
    }
    tree
}

/// Expected number of traversal steps of a ray, up to a constant factor: the total area of the inner boxes.
pub fn cost(tree: &[TreeNode]) -> f64 {
    let inner = tree.iter().filter(|node| !node.is_leaf);
    inner.map(|node| f64::from(node.aabb.half_area())).sum()
}
