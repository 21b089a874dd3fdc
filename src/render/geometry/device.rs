//! The scene's triangles and their hierarchy on the device.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Staging};
use crate::render::geometry::occlusion::{MAX_PAIRS_IN_A_FRAME, can_occlude};
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::{Grid, Node, Normals, Triangle};
use crate::render::patches::merging::Merging;
use crate::scene::{Atlas, Mesh, Scene};
use std::borrow::Cow;
use std::sync::Arc;

/// Maximum number of pairs of face and vertex to compare, once, to prove that nothing can occlude light.
const MAX_PAIRS: usize = 200_000_000;

pub struct DeviceGeometry {
    pub store: TriangleStore,
    /// Its triangles are behind those of `store`.
    pub merging: Merging,
    pub triangles: Buffer,
    pub normals: Buffer,
    pub nodes: Buffer,
    /// Whether anything can occlude light on its way to the casters, or from there to the receivers.
    pub can_occlude: bool,
    /// Whether the device has the geometry.
    is_written: bool,
}

impl DeviceGeometry {
    /// `atlases` are the atlases of the mesh receivers, indexed by object. Triangles of casters are merged down to `least_pieces`, if
    /// at all.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] where there are more triangles than a buffer holds, [`crate::Error::Device`] if device
    /// memory is insufficient.
    pub fn new(
        context: &Arc<Context>,
        scene: &Scene,
        atlases: &[Option<Atlas>],
        least_pieces: Option<usize>,
    ) -> Result<Self> {
        let meshes = meshes(scene);
        let max_bytes = context.max_storage_bytes();
        let store = TriangleStore::new(scene, &meshes, atlases, max_bytes)?;
        let count = store.triangles.len();
        let merging = least_pieces
            .map(|least| Merging::new(scene, &meshes, store.origin, count, least))
            .filter(|merging| {
                ((count + merging.triangles.len()) * size_of::<Triangle>()) as u64 <= max_bytes
            })
            .unwrap_or_default();
        let buffer = |name, element: usize| {
            let count = count + merging.triangles.len();
            Buffer::new(context, name, (count * element) as u64)
        };
        Ok(Self {
            triangles: buffer("triangles", size_of::<Triangle>())?,
            normals: buffer("normals", size_of::<Normals>())?,
            nodes: Buffer::new(context, "nodes", store.max_node_bytes())?,
            can_occlude: can_occlude(scene, &meshes, MAX_PAIRS),
            merging,
            store,
            is_written: false,
        })
    }

    /// Writes the triangles of the objects that moved, and refits the hierarchy. Returns whether the hierarchy was
    /// rebuilt, which changes the indices of all triangles.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn update(
        &mut self,
        staging: &mut Staging,
        scene: &Scene,
        moved: &[(usize, Cow<Mesh>)],
    ) -> Result<bool> {
        if moved.is_empty() {
            return Ok(false);
        }
        let store = &mut self.store;
        let is_rebuilt = if self.is_written {
            for (object, mesh) in moved {
                store.set_mesh(*object, mesh);
                self.merging.set_mesh(*object, mesh);
            }
            if !self.can_occlude {
                self.can_occlude = can_occlude(scene, &meshes(scene), MAX_PAIRS_IN_A_FRAME);
            }
            store.refit_or_rebuild()
        } else {
            false
        };
        // The smallest range that contains the triangles of the moved objects.
        let range = if is_rebuilt || !self.is_written {
            0..store.triangles.len()
        } else {
            let indices = || moved.iter().flat_map(|(object, _)| store.indices(*object));
            let first = indices().min().map_or(0, |first| *first as usize);
            first..indices().max().map_or(0, |last| *last as usize + 1)
        };
        staging.write(
            &self.triangles,
            range.start,
            &store.triangles[range.clone()],
        )?;
        staging.write(&self.normals, range.start, &store.normals[range])?;
        let (grid, nodes) = store.hierarchy();
        const { assert!(size_of::<Grid>() == size_of::<Node>()) };
        staging.write(&self.nodes, 0, std::slice::from_ref(grid))?;
        staging.write(&self.nodes, 1, nodes)?;
        if !self.is_written || moved.iter().any(|(object, _)| self.merging.has(*object)) {
            let first = store.triangles.len();
            staging.write(&self.triangles, first, &self.merging.triangles)?;
            staging.write(&self.normals, first, &self.merging.normals)?;
        }
        self.is_written = true;
        Ok(is_rebuilt)
    }
}

impl DeviceGeometry {
    /// A triangle of the device's list.
    pub fn triangle(&self, index: u32) -> &Triangle {
        let of_scene = &self.store.triangles;
        let merged = (index as usize).checked_sub(of_scene.len());
        merged.map_or_else(
            || &of_scene[index as usize],
            |place| &self.merging.triangles[place],
        )
    }
}

fn meshes(scene: &Scene) -> Vec<Cow<'_, Mesh>> {
    (scene.objects.iter())
        .map(|object| object.geometry.mesh())
        .collect()
}
