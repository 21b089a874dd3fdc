//! The hierarchy on the device, which fits it to the triangles of each frame.

use crate::error::Result;
use crate::gpu::{
    Access, BoundPipeline, Buffer, Constants, Context, Readback, Recorder, Resource, Staging,
    shaders,
};
use crate::render::barriers::next;
use crate::render::dispatch::threads;
use crate::render::geometry::bvh::Links;
use crate::render::geometry::bvh_build::MAX_DEPTH;
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::constants::{MAX_ROW, REFIT_GROUP};
use crate::render::gpu_types::{Grid, Node, NodeBox, PackPush, RefitPush};
use std::collections::VecDeque;
use std::ops::Range;
use std::sync::Arc;

/// A hierarchy is rebuilt when its cost has grown by this factor, and refitted until then. Over 120 frames of `pool` and of
/// a turning `ring`, updates took 5.2 and 1.1 ms with refitting by the host, 16.7 and 3.4 ms with a rebuild in every frame; rays
/// took the same time in both cases.
const GROWN: f64 = 2.0;
/// Nodes of a level that one workgroup refits beside all levels above.
const NARROW: usize = 2048;
/// Words of the root's box up to its cost.
const WORDS: usize = 8;

pub struct Hierarchy {
    refit: BoundPipeline,
    pack: BoundPipeline,
    boxes: Buffer,
    order: Buffer,
    node_count: u32,
    /// Levels that a dispatch refits, and its number of workgroups.
    dispatches: Vec<(Range<u32>, u32)>,
    level_count: u32,
    /// When it was built.
    built_cost: f64,
    /// Of the last frame that has ended, since it was built.
    cost: f64,
    /// Of the frames in flight, where they refit it: the number of rebuilds before, and the cost.
    costs: VecDeque<Option<(u32, Readback)>>,
    unused: Vec<Readback>,
    rebuilds: u32,
}

impl Hierarchy {
    /// Bytes of the nodes of a hierarchy over so many triangles: it has a grid, and one node fewer than triangles at most.
    pub fn node_bytes(triangles: usize) -> u64 {
        const { assert!(size_of::<Grid>() == size_of::<Node>()) };
        (size_of::<Grid>() + triangles * size_of::<Node>()) as u64
    }

    /// Passes that refit the hierarchy over `store`, on the device `triangles`, to the `nodes` that rays traverse. At most `frames`
    /// frames are in flight.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if device memory is insufficient.
    pub fn new(
        context: &Arc<Context>,
        store: &TriangleStore,
        [triangles, nodes]: [&Buffer; 2],
        frames: u32,
    ) -> Result<Self> {
        let bytes = (store.len() * size_of::<NodeBox>()) as u64;
        let boxes = Buffer::new(context, "boxes of nodes", bytes)?;
        let order = Buffer::new(
            context,
            "order of nodes",
            4 * (store.len() as u64 + u64::from(MAX_DEPTH)),
        )?;
        let resources = [
            ("refit_order", Resource::Buffer(&order)),
            ("triangles", Resource::Buffer(triangles)),
            ("nodes", Resource::Buffer(nodes)),
            ("node_boxes", Resource::Buffer(&boxes)),
        ];
        let pipeline =
            |shader| BoundPipeline::compute(context, shader, Constants::default(), &resources);
        Ok(Self {
            refit: pipeline(&shaders::REFIT_COMP)?,
            pack: pipeline(&shaders::PACK_NODES_COMP)?,
            boxes,
            order,
            node_count: 0,
            dispatches: Vec::new(),
            level_count: 0,
            built_cost: f64::INFINITY,
            cost: 0.0,
            costs: (0..frames.max(1)).map(|_| None).collect(),
            unused: (0..frames.max(1))
                .map(|_| Readback::new(context, WORDS))
                .collect::<Result<_>>()?,
            rebuilds: 0,
        })
    }

    /// Writes the links of a hierarchy that was built.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn write(
        &mut self,
        staging: &mut Staging,
        store: &TriangleStore,
        nodes: &Buffer,
    ) -> Result<()> {
        let Links {
            nodes: links,
            order,
            levels,
        } = store.nodes();
        let ends = levels.iter().scan(0, |end, &count| {
            *end += count as u32;
            Some(*end)
        });
        staging.write(nodes, 1, &links)?;
        staging.write(&self.order, 0, &ends.chain(order).collect::<Vec<u32>>())?;
        let narrow = levels
            .iter()
            .rev()
            .take_while(|&&count| count <= NARROW)
            .count();
        let wide = levels.len() - narrow;
        self.dispatches = (levels[..wide].iter().zip(0..))
            .map(|(&count, level)| {
                (
                    level..level + 1,
                    (count as u32).div_ceil(REFIT_GROUP).min(MAX_ROW),
                )
            })
            .collect();
        self.dispatches.push((wide as u32..levels.len() as u32, 1));
        self.level_count = levels.len() as u32;
        self.node_count = links.len() as u32;
        self.built_cost = store.cost();
        self.cost = 0.0;
        self.rebuilds += 1;
        Ok(())
    }

    /// Whether it should be rebuilt, as the last frame has found that has ended.
    pub fn is_costly(&self) -> bool {
        self.cost > GROWN * self.built_cost
    }

    /// Begins a frame, and reads the cost of the one that has ended for it.
    pub fn begin_frame(&mut self) {
        if let Some((rebuilds, mut readback)) = self.costs.pop_front().flatten() {
            if rebuilds == self.rebuilds {
                self.cost = f32::from_bits(readback.words(WORDS)[WORDS - 1]).into();
            }
            self.unused.push(readback);
        }
        self.costs.push_back(None);
    }

    /// The host does not submit the last frame.
    pub fn forget_last(&mut self) {
        // It does not count as one: those before it may still be in flight.
        let last = self.costs.pop_back().flatten();
        self.unused.extend(last.map(|(_, readback)| readback));
        self.costs.push_front(None);
    }

    /// Fits the boxes to the triangles.
    pub fn record_refit(&self, recorder: &mut Recorder) {
        for (levels, groups) in &self.dispatches {
            let push = RefitPush {
                first_level: levels.start,
                end_level: levels.end,
                level_count: self.level_count,
            };
            recorder.dispatch_groups(&self.refit, &push, [*groups, 1, 1]);
            next(recorder);
        }
        let push = PackPush {
            node_count: self.node_count,
        };
        recorder.dispatch(&self.pack, &push, threads(self.node_count));
    }

    /// Copies the cost to the host.
    pub fn record_cost(&mut self, recorder: &mut Recorder) {
        let readback = self.unused.pop().expect("one for each frame in flight");
        recorder.copy_words(&self.boxes, &readback, 0, WORDS);
        recorder.barrier(Access::TRANSFER_WRITE, Access::HOST_READ);
        if let Some(last) = self.costs.back_mut() {
            *last = Some((self.rebuilds, readback));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::ContextOptions;
    use crate::render::gpu_types::Triangle;
    use crate::render::gpu_types::constants::COUNT_SHIFT;
    use glam::{UVec3, Vec3, Vec3Swizzles};

    /// A hierarchy over triangles on a device.
    struct Refitted {
        context: Arc<Context>,
        store: TriangleStore,
        triangles: Buffer,
        nodes: Buffer,
        hierarchy: Hierarchy,
    }

    impl Refitted {
        fn new(context: &Arc<Context>, triangles: Vec<Triangle>) -> Self {
            let store = TriangleStore::of_triangles(triangles);
            let bytes = (store.len() * size_of::<Triangle>()) as u64;
            let triangles = Buffer::new(context, "triangles", bytes).unwrap();
            let node_bytes = Hierarchy::node_bytes(store.len());
            let nodes = Buffer::new(context, "nodes", node_bytes).unwrap();
            let hierarchy = Hierarchy::new(context, &store, [&triangles, &nodes], 1).unwrap();
            let mut refitted = Self {
                context: context.clone(),
                store,
                triangles,
                nodes,
                hierarchy,
            };
            let mut staging = Staging::new(context, 1);
            let Self {
                store,
                nodes,
                hierarchy,
                ..
            } = &mut refitted;
            hierarchy.write(&mut staging, store, nodes).unwrap();
            let mut recorder = Recorder::new(context).unwrap();
            staging.record(&mut recorder);
            recorder.submit().unwrap();
            refitted
        }

        /// The triangles in the order of the leaves.
        fn triangles(&self) -> Vec<Triangle> {
            self.store.all_stored(0..self.store.len()).0.to_vec()
        }

        fn refit(&mut self, triangles: &[Triangle]) {
            let mut staging = Staging::new(&self.context, 1);
            staging.write(&self.triangles, 0, triangles).unwrap();
            let mut recorder = Recorder::new(&self.context).unwrap();
            staging.record(&mut recorder);
            recorder.barrier(Access::TRANSFER_WRITE, Access::COMPUTE);
            self.hierarchy.begin_frame();
            self.hierarchy.record_refit(&mut recorder);
            recorder.barrier(Access::COMPUTE_WRITE, Access::ANY_READ);
            self.hierarchy.record_cost(&mut recorder);
            recorder.submit().unwrap();
            self.hierarchy.begin_frame();
        }

        /// `triangles` are in the order of the leaves.
        fn assert_holds(&self, triangles: &[Triangle]) {
            let count = 1 + self.hierarchy.node_count as usize;
            let nodes = self.nodes.read::<Node>(count).unwrap();
            let grid: Grid = bytemuck::cast(nodes[0]);
            let mut seen = vec![false; triangles.len()];
            let mut open = vec![(0u32, UVec3::splat(0xffff_0000))];
            while let Some((link, bounds)) = open.pop() {
                let (leaf, first) = (link >> COUNT_SHIFT, link & ((1 << COUNT_SHIFT) - 1));
                for place in first..first + leaf {
                    seen[place as usize] = true;
                    let triangle = &triangles[place as usize];
                    let a = triangle.position;
                    for vertex in [a, a + triangle.edge1, a + triangle.edge2] {
                        let at = (vertex - grid.lower) * grid.scale;
                        let low = (bounds & 0xffffu32).as_vec3();
                        let high = (bounds >> 16u32).as_vec3();
                        assert!(
                            at.cmpge(low).all() && at.cmple(high).all(),
                            "{at} {low} {high}"
                        );
                    }
                }
                if leaf == 0 {
                    let node = nodes[1 + link as usize];
                    open.extend([(node.left_link, node.left), (node.right_link, node.right)]);
                }
            }
            assert!(seen.iter().all(|seen| *seen), "{}", seen.len());
        }
    }

    /// Every triangle is in one leaf, and every box on the path to the leaf contains the triangle, also after all
    /// triangles have moved. The cost is that of the tree on the host.
    #[test]
    fn packed_boxes_hold_their_triangles() {
        let context = Context::new(&ContextOptions::default()).unwrap();
        let corner = |i: u32| {
            let x = f32::from((i.wrapping_mul(40503) >> 3) as u16) / 1000.0;
            Vec3::new(x, (x * 7.0).sin(), (x * 3.0).cos())
        };
        for count in [1, 2, 9, 1000, 60_000] {
            let triangles: Vec<_> = (0..count)
                .map(|i| Triangle {
                    position: corner(3 * i),
                    edge1: corner(3 * i + 1) - corner(3 * i),
                    edge2: corner(3 * i + 2) - corner(3 * i),
                    ..Default::default()
                })
                .collect();
            let mut refitted = Refitted::new(&context, triangles);
            let mut triangles = refitted.triangles();
            refitted.refit(&triangles);
            refitted.assert_holds(&triangles);
            if count > 1 {
                let (cost, built) = (refitted.hierarchy.cost, refitted.hierarchy.built_cost);
                assert!((cost / built - 1.0).abs() < 1e-5, "{cost} {built}");
            }
            for _ in 0..3 {
                for triangle in &mut triangles {
                    triangle.position = triangle.position.yzx() + Vec3::Z;
                    triangle.edge1 = triangle.edge1.yzx();
                    triangle.edge2 = triangle.edge2.yzx();
                }
                refitted.refit(&triangles);
                refitted.assert_holds(&triangles);
                assert!(!refitted.hierarchy.is_costly(), "turned by a third");
            }
        }
    }

    /// A hierarchy over triangles that have moved apart must be rebuilt.
    #[test]
    fn a_hierarchy_of_scattered_triangles_is_given_up() {
        let context = Context::new(&ContextOptions::default()).unwrap();
        let at = |i: u32| Triangle {
            position: Vec3::X * i as f32,
            edge1: Vec3::Y,
            edge2: Vec3::Z,
            ..Default::default()
        };
        let mut refitted = Refitted::new(&context, (0..1000).map(at).collect());
        let row = refitted.triangles();
        refitted.refit(&row);
        assert!(!refitted.hierarchy.is_costly());
        let scattered: Vec<_> = (row.iter())
            .map(|triangle| at(triangle.position.x as u32 * 389 % 1000))
            .collect();
        refitted.refit(&scattered);
        assert!(refitted.hierarchy.is_costly());
    }
}
