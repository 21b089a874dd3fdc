//! The scene's triangles and their hierarchy on the device.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Staging};
use crate::render::geometry::occlusion::{MAX_PAIRS_IN_A_FRAME, can_occlude};
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::{Normals, Triangle};
use crate::scene::{Atlas, Mesh, Scene};
use std::borrow::Cow;
use std::sync::Arc;

/// Maximum number of pairs of face and vertex to compare, once, to prove that nothing can occlude light.
const MAX_PAIRS: usize = 200_000_000;

pub struct DeviceGeometry {
    pub store: TriangleStore,
    pub triangles: Buffer,
    pub normals: Buffer,
    pub nodes: Buffer,
    /// Whether anything can occlude light on its way to the casters, or from there to the receivers.
    pub can_occlude: bool,
    /// Whether the device has the geometry.
    is_written: bool,
}

impl DeviceGeometry {
    /// `atlases` are the atlases of the mesh receivers, indexed by object.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] where there are more triangles than a buffer holds, [`crate::Error::Device`] if device
    /// memory is insufficient.
    pub fn new(context: &Arc<Context>, scene: &Scene, atlases: &[Option<Atlas>]) -> Result<Self> {
        let meshes = meshes(scene);
        let store = TriangleStore::new(scene, &meshes, atlases, context.max_storage_bytes())?;
        let buffer = |name, element: usize| {
            Buffer::new(context, name, (store.triangles.len() * element) as u64)
        };
        Ok(Self {
            triangles: buffer("triangles", size_of::<Triangle>())?,
            normals: buffer("normals", size_of::<Normals>())?,
            nodes: Buffer::new(context, "nodes", store.max_node_bytes())?,
            can_occlude: can_occlude(scene, &meshes, MAX_PAIRS),
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
        moved: &[usize],
    ) -> Result<bool> {
        if moved.is_empty() {
            return Ok(false);
        }
        let store = &mut self.store;
        let is_rebuilt = if self.is_written {
            for &object in moved {
                store.set_mesh(object, &scene.objects[object].geometry.mesh());
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
            let indices = || moved.iter().flat_map(|&object| store.indices(object));
            let first = indices().min().map_or(0, |first| *first as usize);
            first..indices().max().map_or(0, |last| *last as usize + 1)
        };
        staging.write(
            &self.triangles,
            range.start,
            &store.triangles[range.clone()],
        )?;
        staging.write(&self.normals, range.start, &store.normals[range])?;
        staging.write(&self.nodes, 0, &store.nodes())?;
        self.is_written = true;
        Ok(is_rebuilt)
    }
}

fn meshes(scene: &Scene) -> Vec<Cow<'_, Mesh>> {
    (scene.objects.iter())
        .map(|object| object.geometry.mesh())
        .collect()
}
