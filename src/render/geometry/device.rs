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
    pub replaced: Option<RestingMeshes>,
    /// Objects that the next frame places.
    pub to_place: Vec<usize>,
    /// Whether the next frame refits the hierarchy.
    pub is_moved: bool,
    /// By object: whether its mesh may be another one in every frame.
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
            replaced: None,
            to_place: Vec::new(),
            is_moved: false,
            deforms: vec![false; scene.objects.len()],
            is_written: false,
        })
    }

    /// The meshes of the objects that moved whose vertices the host has to write. The device places the others: they are scaled,
    /// turned and moved as a whole, and their mesh is the same as before.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if device memory is insufficient.
    pub fn to_write<'a>(
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
                Some((known, _)) => {
                    self.deforms[object] = !Arc::ptr_eq(known, mesh) && known != mesh;
                }
                None if self.deforms[object] => {}
                None => added.push(object),
            }
        }
        let is_new = !added.is_empty() && self.add_resting(context, scene, &added)?;
        for object in 0..scene.objects.len() {
            if !self.is_placed(scene, object) {
                continue;
            }
            let is_at_rest = self.store.placement(object).is_some();
            let resting = self.resting.as_ref().expect("has the object");
            if !is_at_rest {
                let (mesh, middle) = resting.mesh(object).expect("at rest");
                self.store.store(object, mesh, middle);
                self.merging.store(object, mesh, middle);
            }
            if !is_at_rest || is_new {
                resting.write(staging, &self.store, &self.merging, object)?;
            }
        }
        let of_host = (moved.iter().copied()).filter(|&object| !self.is_placed(scene, object));
        Ok(of_host
            .map(|object| (object, scene.objects[object].geometry.mesh()))
            .collect())
    }

    /// Whether the device places an object. A mesh at its place is written, so that it is the same whether it moved before or not.
    fn is_placed(&self, scene: &Scene, object: usize) -> bool {
        let geometry = &scene.objects[object].geometry;
        matches!(geometry, Geometry::Placed { .. }) && self.at_rest(object).is_some()
    }

    /// The mesh of an object that the device has at rest, and the point that its triangles are relative to.
    fn at_rest(&self, object: usize) -> Option<(&Arc<Mesh>, DVec3)> {
        let resting = self.resting.as_ref().filter(|_| !self.deforms[object]);
        resting.and_then(|resting| resting.mesh(object))
    }

    /// Has room on the device for some more objects at rest; whether there is so much.
    fn add_resting(
        &mut self,
        context: &Arc<Context>,
        scene: &Scene,
        added: &[usize],
    ) -> Result<bool> {
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
            return Ok(false);
        };
        if let Some(replaced) = self.resting.replace(resting) {
            self.replaced.get_or_insert(replaced);
        }
        Ok(true)
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
            if !self.can_occlude && !written.is_empty() {
                self.can_occlude = can_occlude(scene, &meshes(scene), MAX_PAIRS_IN_A_FRAME);
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
            // Their triangles at rest may be in the range.
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
        if is_rebuilt && let Some(resting) = &self.resting {
            for &object in &self.to_place {
                resting.write(staging, store, &self.merging, object)?;
            }
        }
        self.is_moved = true;
        self.is_written = true;
        Ok(is_rebuilt)
    }

    /// Has the next frame place all objects at rest and refit the hierarchy.
    pub fn invalidate(&mut self) {
        let is_placed = |&object: &usize| self.store.placement(object).is_some();
        self.to_place = (0..self.deforms.len()).filter(is_placed).collect();
        self.is_moved = true;
    }

    /// Places the triangles of the objects that moved as a whole.
    pub fn record_place(&mut self, recorder: &mut Recorder) {
        for object in self.to_place.drain(..) {
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::ContextOptions;
    use crate::render::device_scene::{Change, DeviceScene};
    use crate::render::frame::upload;
    use crate::render::patches::subdivision::Kind;
    use crate::render::settings::Settings;
    use crate::scene::Similarity;
    use glam::{DMat3, Vec3};
    use std::path::Path;

    fn similarity(scale: f64, angle: f64, shift: DVec3) -> Similarity {
        Similarity {
            scale,
            rotation: DMat3::from_axis_angle(DVec3::new(1.0, 2.0, -0.5).normalize(), angle),
            shift,
        }
    }

    /// That the device has the vertices of all meshes where the host has them, and merged triangles with their midpoints, too.
    fn assert_in_place(
        device: &mut DeviceScene,
        recorder: &mut Recorder,
        scene: &Scene,
        what: &str,
    ) {
        upload(recorder, device).unwrap();
        recorder.submit().unwrap();
        let geometry = &device.geometry;
        let count = geometry.store.len() + geometry.merging.triangles.len();
        let triangles = geometry.triangles.read::<Triangle>(count).unwrap();
        let normals = geometry.normals.read::<Normals>(count).unwrap();
        let near = |found: Vec3, expected: DVec3| {
            let distance = found.as_dvec3().distance(expected);
            assert!(
                distance < 1e-6 * device.bodies.size(),
                "{what}: {distance} m"
            );
        };
        let assert_at = |place: u32, mesh: &Mesh, vertices: [u32; 3]| {
            let (triangle, normals) = (&triangles[place as usize], &normals[place as usize]);
            let a = triangle.position;
            let corners = [a, a + triangle.edge1, a + triangle.edge2];
            let of_corners = [normals.n0, normals.n1, normals.n2];
            for ((corner, normal), vertex) in corners.into_iter().zip(of_corners).zip(vertices) {
                near(
                    corner,
                    mesh.positions[vertex as usize] - geometry.store.origin,
                );
                let expected = mesh.normals[vertex as usize];
                assert!(normal.as_dvec3().distance(expected) < 1e-6, "{what}");
            }
        };
        for (index, object) in scene.objects.iter().enumerate() {
            let mesh = object.geometry.mesh();
            for (&vertices, &place) in mesh.triangles.iter().zip(geometry.store.indices(index)) {
                assert_at(place, &mesh, vertices);
                let on_host = geometry.store.triangle(place);
                near(on_host.position, triangles[place as usize].position.into());
            }
            for (piece, place) in (1..geometry.merging.set_count())
                .flat_map(|set| geometry.merging.pieces(index, set).into_iter().flatten())
            {
                if let Kind::Merged { midpoints, .. } = piece.kind {
                    assert_at(place, &mesh, piece.corners);
                    assert_at(triangles[place as usize].twin, &mesh, midpoints);
                }
            }
        }
    }

    /// A mesh that is placed, placed again, back at rest, deformed, and placed once more, whose triangles are merged; and beside
    /// it a board that lies far away at rest.
    #[test]
    fn placed_meshes_are_where_the_host_has_them() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/pool.toml");
        let mut scene = crate::scene::load(&file).unwrap().scene;
        let [water, floor] = ["water", "floor"].map(|name| scene.object_index(name).unwrap());
        let mesh = Arc::new(scene.objects[water].geometry.mesh().into_owned());
        scene.objects[water].geometry = Geometry::Mesh(mesh.clone());
        let mut board = scene.objects[floor].clone();
        let far = similarity(1.0, 0.0, DVec3::new(0.0, 0.0, 1e7));
        let board_mesh = Arc::new(board.geometry.mesh().placed(&far));
        let back = |angle: f64| Geometry::Placed {
            mesh: board_mesh.clone(),
            by: similarity(0.5, angle, DVec3::ZERO).after(&similarity(1.0, 0.0, -far.shift)),
        };
        (board.light_map, board.geometry) = (None, back(0.0));
        scene.objects.push(board);
        let board = scene.objects.len() - 1;
        let context = Context::new(&ContextOptions::default()).unwrap();
        let settings = Settings {
            error: Some(0.02),
            ..Settings::default()
        };
        let mut recorder = Recorder::new(&context).unwrap();
        let mut device = DeviceScene::new(&context, &scene, &settings).unwrap();
        assert!(device.geometry.merging.has(water));
        assert_in_place(&mut device, &mut recorder, &scene, "at first");
        let placed = |scale, angle, shift| Geometry::Placed {
            mesh: mesh.clone(),
            by: similarity(scale, angle, shift),
        };
        let mut deformed = mesh.as_ref().clone();
        for position in &mut deformed.positions {
            position.y += 0.01 * position.x.sin();
        }
        for (what, of_water, of_board) in [
            ("placed", placed(1.0, 0.1, DVec3::X), back(0.0)),
            ("placed again", placed(0.8, 0.3, DVec3::ZERO), back(0.2)),
            ("at rest", Geometry::Mesh(mesh.clone()), back(0.2)),
            ("deformed", Geometry::Mesh(Arc::new(deformed)), back(0.2)),
            ("placed after all", placed(1.0, 0.2, DVec3::Y), back(0.4)),
        ] {
            scene.objects[water].geometry = of_water;
            scene.objects[board].geometry = of_board;
            device.update(&context, &scene).unwrap();
            assert_in_place(&mut device, &mut recorder, &scene, what);
        }
        // Nothing is placed by a frame that changes nothing.
        assert_eq!(device.update(&context, &scene).unwrap(), Change::Nothing);
        assert!(!device.geometry.is_moved && device.geometry.to_place.is_empty());
    }

    /// Triangles that move apart make the hierarchy costly, of which the next frame learns, and the one after builds it again.
    #[test]
    fn a_costly_hierarchy_is_rebuilt() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/ring.toml");
        let mut scene = crate::scene::load(&file).unwrap().scene;
        let Some((mesh, _)) = scene.objects[0].geometry.placement() else {
            panic!("a mesh");
        };
        let mesh = mesh.clone();
        let context = Context::new(&ContextOptions::default()).unwrap();
        let mut recorder = Recorder::new(&context).unwrap();
        let mut device = DeviceScene::new(&context, &scene, &Settings::default()).unwrap();
        assert_in_place(&mut device, &mut recorder, &scene, "at first");
        let mut scattered = mesh.as_ref().clone();
        let count = mesh.positions.len();
        for (number, position) in scattered.positions.iter_mut().enumerate() {
            *position = mesh.positions[number * 7919 % count];
        }
        let scattered = Arc::new(scattered);
        let placed = |angle| Geometry::Placed {
            mesh: scattered.clone(),
            by: similarity(1.0, angle, DVec3::ZERO),
        };
        scene.objects[0].geometry = placed(0.1);
        device.update(&context, &scene).unwrap();
        assert_in_place(&mut device, &mut recorder, &scene, "scattered");
        let before = device.geometry.store.indices(0).to_vec();
        assert_eq!(device.update(&context, &scene).unwrap(), Change::Nothing);
        upload(&mut recorder, &mut device).unwrap();
        recorder.submit().unwrap();
        assert!(device.geometry.hierarchy.is_costly());
        assert_eq!(device.update(&context, &scene).unwrap(), Change::Content);
        assert_ne!(device.geometry.store.indices(0), before);
        assert_in_place(&mut device, &mut recorder, &scene, "rebuilt");
        scene.objects[0].geometry = placed(0.2);
        device.update(&context, &scene).unwrap();
        assert_in_place(&mut device, &mut recorder, &scene, "placed after that");
        assert!(!device.geometry.hierarchy.is_costly());
    }
}
