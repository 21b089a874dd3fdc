//! The scene's triangles and their hierarchy on the device.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Recorder, Staging};
use crate::render::geometry::hierarchy::Hierarchy;
use crate::render::geometry::occlusion::{MAX_PAIRS_IN_A_FRAME, can_occlude};
use crate::render::geometry::resting::RestingMeshes;
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::{Normals, Triangle};
use crate::render::patches::merging::Merging;
use crate::scene::{Atlas, Geometry, Mesh, Scene};
use glam::DVec3;
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
    pub hierarchy: Hierarchy,
    /// Of the objects that move as a whole, if there are any.
    pub resting: Option<RestingMeshes>,
    /// What `resting` was before, while a frame may use it.
    pub replaced: Vec<RestingMeshes>,
    /// Objects that the next frame places.
    pub to_place: Vec<usize>,
    /// Whether the next frame refits the hierarchy.
    pub is_moved: bool,
    /// By object: whether its mesh has become another one while it was placed. From then on, the host writes it.
    deforms: Vec<bool>,
    /// Whether anything can occlude light on its way to the casters, or from there to the receivers.
    pub can_occlude: bool,
    /// Whether the device has the geometry.
    is_written: bool,
}

impl DeviceGeometry {
    /// `atlases` are the atlases of the mesh receivers, indexed by object. Triangles of casters are merged down to `least_pieces`, if
    /// at all. At most `frames` frames are in flight.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] where there are more triangles than a buffer holds, [`crate::Error::Device`] if device
    /// memory is insufficient.
    pub fn new(
        context: &Arc<Context>,
        scene: &Scene,
        atlases: &[Option<Atlas>],
        least_pieces: Option<usize>,
        frames: u32,
    ) -> Result<Self> {
        let meshes = meshes(scene);
        let max_bytes = context.max_storage_bytes();
        let store = TriangleStore::new(scene, &meshes, atlases, max_bytes)?;
        let count = store.len();
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
        let triangles = buffer("triangles", size_of::<Triangle>())?;
        let nodes = Buffer::new(context, "nodes", Hierarchy::node_bytes(count))?;
        Ok(Self {
            hierarchy: Hierarchy::new(context, &store, [&triangles, &nodes], frames)?,
            triangles,
            normals: buffer("normals", size_of::<Normals>())?,
            nodes,
            can_occlude: can_occlude(scene, &meshes, MAX_PAIRS),
            merging,
            store,
            resting: None,
            replaced: Vec::new(),
            to_place: Vec::new(),
            is_moved: false,
            deforms: vec![false; scene.objects.len()],
            is_written: false,
        })
    }

    /// Has the device keep meshes at rest that are scaled, turned and moved as a whole, and the same as before. Returns the others among
    /// the objects that moved, whose vertices the host has to write.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if device memory is insufficient.
    pub fn prepare<'a>(
        &mut self,
        context: &Arc<Context>,
        staging: &mut Staging,
        scene: &'a Scene,
        moved: &[usize],
    ) -> Result<Vec<(usize, Cow<'a, Mesh>)>> {
        let mut added = Vec::new();
        for &object in moved {
            let Geometry::Placed { mesh, .. } = &scene.objects[object].geometry else {
                continue;
            };
            match self.at_rest(object) {
                Some((known, _)) if Arc::ptr_eq(known, mesh) => {}
                Some((known, _)) if known == mesh => {
                    if let Some(resting) = &mut self.resting {
                        resting.rename(object, mesh);
                    }
                }
                Some(_) => self.deforms[object] = true,
                None if self.deforms[object] => {}
                None => added.push(object),
            }
        }
        if !added.is_empty() {
            self.add_resting(context, scene, &added)?;
        }
        for object in 0..scene.objects.len() {
            if !self.is_placed(scene, object) {
                continue;
            }
            let resting = self.resting.as_mut().expect("has the object");
            if self.store.placement(object).is_none() {
                let (mesh, middle) = resting.mesh(object).expect("at rest");
                self.store.store(object, mesh, middle);
                self.merging.store(object, mesh, middle);
                resting.invalidate(object);
            }
            resting.write(staging, &self.store, &self.merging, object)?;
        }
        let of_host = (moved.iter().copied()).filter(|&object| !self.is_placed(scene, object));
        let written: Vec<_> = of_host
            .map(|object| (object, scene.objects[object].geometry.mesh()))
            .collect();
        // Placing keeps a mesh convex.
        let has_other_shapes = !written.is_empty() || !added.is_empty();
        if self.is_written && !self.can_occlude && has_other_shapes {
            self.can_occlude = can_occlude(scene, &meshes(scene), MAX_PAIRS_IN_A_FRAME);
        }
        Ok(written)
    }

    /// Whether the device places an object. A [`Geometry::Mesh`] is written by the host, so that its triangles are the same whether it was
    /// placed before or not.
    fn is_placed(&self, scene: &Scene, object: usize) -> bool {
        let geometry = &scene.objects[object].geometry;
        matches!(geometry, Geometry::Placed { .. }) && self.at_rest(object).is_some()
    }

    /// The mesh of an object that the device has at rest, and the point that its triangles are relative to.
    fn at_rest(&self, object: usize) -> Option<(&Arc<Mesh>, DVec3)> {
        let resting = self.resting.as_ref().filter(|_| !self.deforms[object]);
        resting.and_then(|resting| resting.mesh(object))
    }

    /// Makes room on the device for some more objects at rest. If it does not allow for buffers of this size, the host writes them.
    fn add_resting(
        &mut self,
        context: &Arc<Context>,
        scene: &Scene,
        added: &[usize],
    ) -> Result<()> {
        let mesh = |object: usize| match &scene.objects[object].geometry {
            Geometry::Placed { mesh, .. } if added.contains(&object) => Some(mesh),
            _ => self.at_rest(object).map(|(mesh, _)| mesh),
        };
        let meshes = (0..scene.objects.len())
            .map(|object| mesh(object).cloned())
            .collect();
        let targets = [&self.triangles, &self.normals];
        let Some(resting) =
            RestingMeshes::new(context, &self.store, &self.merging, meshes, targets)?
        else {
            added.iter().for_each(|&object| self.deforms[object] = true);
            return Ok(());
        };
        if let Some(replaced) = self.resting.replace(resting) {
            self.replaced.push(replaced);
        }
        Ok(())
    }

    /// Writes the `written` meshes among those that moved, and has the next frame place the others. Returns whether the hierarchy was
    /// rebuilt, which changes the indices of all triangles.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn update(
        &mut self,
        staging: &mut Staging,
        scene: &Scene,
        moved: &[usize],
        written: &[(usize, Cow<Mesh>)],
    ) -> Result<bool> {
        let is_rebuilt = self.is_written && self.hierarchy.is_costly();
        if moved.is_empty() && !is_rebuilt {
            return Ok(false);
        }
        for &object in moved {
            let Geometry::Placed { by, .. } = &scene.objects[object].geometry else {
                continue;
            };
            if self.at_rest(object).is_none() {
                continue;
            }
            let resting = self.resting.as_ref().expect("has the object");
            let placement = resting.placement(object, by, self.store.origin);
            self.store.place(object, placement);
            if !self.to_place.contains(&object) {
                self.to_place.push(object);
            }
        }
        let store = &mut self.store;
        if self.is_written {
            for (object, mesh) in written {
                store.set_mesh(*object, mesh);
                self.merging.store(*object, mesh, store.origin);
            }
        }
        if is_rebuilt {
            store.rebuild();
        }
        // The smallest range that contains the triangles of the objects to write.
        let range = if is_rebuilt || !self.is_written {
            0..store.len()
        } else {
            let indices = || {
                written
                    .iter()
                    .flat_map(|(object, _)| store.indices(*object))
            };
            let first = indices().min().map_or(0, |first| *first as usize);
            first..indices().max().map_or(0, |last| *last as usize + 1)
        };
        if !range.is_empty() {
            // The range may overwrite placed triangles with those at rest.
            let is_placed = |&object: &usize| store.placement(object).is_some();
            self.to_place = (0..scene.objects.len()).filter(is_placed).collect();
        }
        let (triangles, normals) = store.all_stored(range.clone());
        staging.write(&self.triangles, range.start, triangles)?;
        staging.write(&self.normals, range.start, normals)?;
        if !self.is_written || written.iter().any(|(object, _)| self.merging.has(*object)) {
            let first = store.len();
            staging.write(&self.triangles, first, &self.merging.triangles)?;
            staging.write(&self.normals, first, &self.merging.normals)?;
        }
        if is_rebuilt || !self.is_written {
            self.hierarchy.write(staging, store, &self.nodes)?;
        }
        if is_rebuilt && let Some(resting) = &mut self.resting {
            // Some may have been written in this update already.
            staging.begin();
            for &object in &self.to_place {
                resting.invalidate(object);
                resting.write(staging, store, &self.merging, object)?;
            }
        }
        self.is_moved = true;
        self.is_written = true;
        Ok(is_rebuilt)
    }

    /// The host does not submit the last frame.
    pub fn forget_last(&mut self) {
        self.hierarchy.forget_last();
        self.invalidate();
    }

    /// Has the next frame place all objects at rest and refit the hierarchy.
    pub fn invalidate(&mut self) {
        let is_placed = |&object: &usize| self.store.placement(object).is_some();
        self.to_place = (0..self.deforms.len()).filter(is_placed).collect();
        self.is_moved = true;
    }

    /// Places the triangles of the objects that moved as a whole.
    pub fn record_place(&self, recorder: &mut Recorder) {
        for &object in &self.to_place {
            // An object without a placement was written since.
            if let (Some(resting), Some(placement)) = (&self.resting, self.store.placement(object))
            {
                resting.record(recorder, object, placement);
            }
        }
    }

    /// A triangle of the device's list, where it lies.
    pub fn triangle(&self, index: u32) -> Triangle {
        let merged = (index as usize).checked_sub(self.store.len());
        let Some(merged) = merged.map(|place| self.merging.triangles[place]) else {
            return self.store.triangle(index);
        };
        match self.store.placement(merged.object as usize) {
            Some(placement) => placement.triangle(&merged),
            None => merged,
        }
    }
}

fn meshes(scene: &Scene) -> Vec<Cow<'_, Mesh>> {
    (scene.objects.iter())
        .map(|object| object.geometry.mesh())
        .collect()
}
