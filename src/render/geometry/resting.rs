//! Meshes that move as a whole: the device has their triangles at rest, and places them where a frame has them.

use crate::error::Result;
use crate::gpu::{BoundPipeline, Buffer, Constants, Context, Recorder, Resource, Staging, shaders};
use crate::render::dispatch::threads;
use crate::render::geometry::placement::Placement;
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::{Normals, Triangle};
use crate::render::patches::merging::Merging;
use crate::scene::{Mesh, Similarity};
use glam::DVec3;
use std::ops::Range;
use std::sync::Arc;

/// The triangles at rest of the objects that move as a whole.
pub struct RestingMeshes {
    place: BoundPipeline,
    triangles: Buffer,
    normals: Buffer,
    /// By object.
    meshes: Vec<Option<RestingMesh>>,
}

struct RestingMesh {
    mesh: Arc<Mesh>,
    /// The point of the mesh that its triangles are relative to, m: its middle, so that f32 suffices wherever it lies at rest.
    middle: DVec3,
    /// In `triangles`.
    range: Range<u32>,
    /// Whether the device has them.
    is_written: bool,
}

impl RestingMeshes {
    /// Allocates for the `meshes` of some objects, by object. `targets` are all triangles and normals of the scene. `None` where the device does not allow for so large buffers.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if device memory is insufficient.
    pub fn new(
        context: &Arc<Context>,
        store: &TriangleStore,
        merging: &Merging,
        meshes: Vec<Option<Arc<Mesh>>>,
        [triangles, normals]: [&Buffer; 2],
    ) -> Result<Option<Self>> {
        let mut count = 0;
        let mut resting = Vec::new();
        for (object, mesh) in meshes.into_iter().enumerate() {
            resting.push(mesh.map(|mesh| {
                let first = count;
                count += store.indices(object).len() + merging.places(object).count();
                let [low, high] = mesh.bounds();
                RestingMesh {
                    middle: 0.5 * (low + high),
                    mesh,
                    range: first as u32..count as u32,
                    is_written: false,
                }
            }));
        }
        let bytes = |element: usize| (count * element) as u64;
        const { assert!(size_of::<Triangle>() == size_of::<Normals>()) };
        if bytes(size_of::<Triangle>()) > context.max_storage_bytes() {
            return Ok(None);
        }
        let resting_triangles =
            Buffer::new(context, "triangles at rest", bytes(size_of::<Triangle>()))?;
        let resting_normals = Buffer::new(context, "normals at rest", bytes(size_of::<Normals>()))?;
        let resources = [
            ("resting_triangles", Resource::Buffer(&resting_triangles)),
            ("resting_normals", Resource::Buffer(&resting_normals)),
            ("triangles", Resource::Buffer(triangles)),
            ("normals", Resource::Buffer(normals)),
        ];
        let shader = &shaders::PLACE_TRIANGLES_COMP;
        Ok(Some(Self {
            place: BoundPipeline::compute(context, shader, Constants::default(), &resources)?,
            triangles: resting_triangles,
            normals: resting_normals,
            meshes: resting,
        }))
    }

    /// The object's mesh, and the point that its triangles are relative to, m.
    pub fn mesh(&self, object: usize) -> Option<(&Arc<Mesh>, DVec3)> {
        let resting = self.meshes[object].as_ref()?;
        Some((&resting.mesh, resting.middle))
    }

    /// Takes an equal mesh for that of an object, so that it is known by its address.
    pub fn rename(&mut self, object: usize, mesh: &Arc<Mesh>) {
        if let Some(resting) = &mut self.meshes[object] {
            resting.mesh = mesh.clone();
        }
    }

    /// The triangles of an object have changed or moved to other places.
    pub fn invalidate(&mut self, object: usize) {
        if let Some(resting) = &mut self.meshes[object] {
            resting.is_written = false;
        }
    }

    /// Writes the triangles of an object, which `store` and `merging` have at rest, unless the device has them.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn write(
        &mut self,
        staging: &mut Staging,
        store: &TriangleStore,
        merging: &Merging,
        object: usize,
    ) -> Result<()> {
        let Some(resting) = (self.meshes[object].as_mut()).filter(|resting| !resting.is_written)
        else {
            return Ok(());
        };
        let mut places = store.indices(object).to_vec();
        places.sort_unstable();
        let own = places.iter().map(|&place| (place, store.stored(place)));
        let merged = merging.places(object).map(|index| {
            let place = (store.len() + index) as u32;
            (place, (merging.triangles[index], merging.normals[index]))
        });
        let (triangles, normals): (Vec<Triangle>, Vec<Normals>) = (own.chain(merged))
            .map(|(twin, (triangle, normals))| (Triangle { twin, ..triangle }, normals))
            .unzip();
        let first = resting.range.start as usize;
        staging.write(&self.triangles, first, &triangles)?;
        staging.write(&self.normals, first, &normals)?;
        resting.is_written = true;
        Ok(())
    }

    /// Where `by` places an object.
    pub fn placement(&self, object: usize, by: &Similarity, origin: DVec3) -> Placement {
        let (_, middle) = self.mesh(object).expect("at rest");
        Placement::new(by, middle, origin)
    }

    /// Places the triangles of an object.
    pub fn record(&self, recorder: &mut Recorder, object: usize, placement: &Placement) {
        let Some(resting) = &self.meshes[object] else {
            return;
        };
        let push = placement.push(&resting.range);
        recorder.dispatch(&self.place, &push, threads(push.count));
    }
}
