//! The triangle store: all triangles of the scene as the device has them, in the order of the leaves of a bounding
//! volume hierarchy. Positions are relative to an origin in the centre of the scene, so that f32 suffices wherever the
//! scene lies.
//!
//! A mesh that moves as a whole stays here as it is at rest, with its placement. Triangles of a mesh that deforms are
//! overwritten.

use crate::error::{Error, Result};
use crate::render::geometry::bvh::{Bvh, Links};
use crate::render::geometry::placement::Placement;
use crate::render::geometry::rays::Rays;
use crate::render::gpu_types::constants::{
    COUNT_SHIFT, IS_MESH_RECEIVER, OCCLUDES, OCCLUDES_ENVIRONMENT,
};
use crate::render::gpu_types::{Normals, Triangle};
use crate::scene::{Atlas, Geometry, MaterialKind, Mesh, Object, Scene, bounds};
use glam::{DVec2, DVec3, Vec3};
use rayon::prelude::*;
use std::borrow::Cow;
use std::ops::Range;

/// Triangles of a mesh that one thread writes at once.
const PART: usize = 16_384;
/// Maximum index in a link of the hierarchy.
const MAX_TRIANGLES: usize = (1 << COUNT_SHIFT) - 1;

pub struct TriangleStore {
    /// Those of objects with a placement are at rest.
    triangles: Vec<Triangle>,
    normals: Vec<Normals>,
    /// By object.
    placements: Vec<Option<Placement>>,
    bvh: Bvh,
    /// Whether the triangles lie where they were when the hierarchy was built.
    is_as_built: bool,
    /// Index into `triangles` of each triangle of the scene, object by object.
    indices: Vec<u32>,
    /// The triangles of the scene, object by object, in the order of `triangles`.
    numbers: Vec<u32>,
    /// Range of each object in `indices` and in `numbers`.
    ranges: Vec<Range<usize>>,
    /// Per object: whether it is a rect, whose two triangles are each other's twin.
    is_rect: Vec<bool>,
    /// Position of the device's origin in the scene, m.
    pub origin: DVec3,
}

impl TriangleStore {
    /// `atlases` are the atlases of the mesh receivers, indexed by object. `max_bytes` is the maximum size of a buffer
    /// on the device.
    pub fn new(
        scene: &Scene,
        meshes: &[Cow<Mesh>],
        atlases: &[Option<Atlas>],
        max_bytes: u64,
    ) -> Result<Self> {
        let count: usize = meshes.iter().map(|mesh| mesh.triangles.len()).sum();
        // Checked before the hierarchy is built, which takes a while.
        let limit = MAX_TRIANGLES.min(max_bytes as usize / size_of::<Triangle>());
        if count > limit {
            return Err(Error::Usage {
                reason: format!(
                    "the scene has {count} triangles, and a buffer on this device holds {limit}"
                ),
                remedy: "use coarser meshes, or choose another device".into(),
            });
        }
        let [lower, upper] = bounds(meshes.iter().flat_map(|mesh| mesh.bounds()));
        let origin = 0.5 * (lower + upper);
        let mut triangles = Vec::with_capacity(count);
        let mut normals = Vec::with_capacity(count);
        let mut ranges = Vec::new();
        for (index, (mesh, object)) in meshes.iter().zip(&scene.objects).enumerate() {
            let first = triangles.len();
            let atlas = atlases[index].as_ref();
            let flags = occlusion(scene, object);
            let is_mesh = atlas.map_or(0, |_| IS_MESH_RECEIVER);
            for (number, corners) in mesh.triangles.iter().enumerate() {
                let [position, edge1, edge2] = geometry_of(mesh, corners, origin);
                triangles.push(Triangle {
                    position,
                    edge1,
                    edge2,
                    object: index as u32,
                    flags: flags | is_mesh,
                    ..Default::default()
                });
                let [uv0, uv1, uv2] =
                    atlas.map_or([0; 3], |atlas| atlas.corners(number).map(packed));
                let [n0, n1, n2] = normals_of(mesh, corners);
                normals.push(Normals {
                    n0,
                    n1,
                    n2,
                    uv0,
                    uv1,
                    uv2,
                });
            }
            ranges.push(first..triangles.len());
        }
        let mut store = Self {
            bvh: Bvh::new(&triangles),
            is_as_built: true,
            placements: vec![None; scene.objects.len()],
            triangles,
            normals,
            indices: Vec::new(),
            numbers: Vec::new(),
            ranges,
            is_rect: (scene.objects.iter())
                .map(|object| matches!(object.geometry, Geometry::Rect(_)))
                .collect(),
            origin,
        };
        store.arrange();
        Ok(store)
    }

    /// A store of one object.
    #[cfg(test)]
    pub fn of_triangles(triangles: Vec<Triangle>) -> Self {
        let count = triangles.len();
        let mut store = Self {
            bvh: Bvh::new(&triangles),
            is_as_built: true,
            placements: vec![None],
            normals: vec![Normals::default(); count],
            triangles,
            indices: Vec::new(),
            numbers: Vec::new(),
            ranges: std::iter::once(0..count).collect(),
            is_rect: vec![false],
            origin: DVec3::ZERO,
        };
        store.arrange();
        store
    }

    /// Reorders the triangles from the scene's order to the hierarchy's.
    fn arrange(&mut self) {
        let order = &self.bvh.order;
        self.triangles = picked(&self.triangles, order);
        self.normals = picked(&self.normals, order);
        self.indices = vec![0; order.len()];
        self.numbers = vec![0; order.len()];
        let mut next: Vec<usize> = self.ranges.iter().map(|range| range.start).collect();
        for (place, &number) in order.iter().enumerate() {
            self.indices[number as usize] = place as u32;
            let next = &mut next[self.triangles[place].object as usize];
            self.numbers[*next] = number;
            *next += 1;
        }
        for (range, is_rect) in self.ranges.iter().zip(&self.is_rect) {
            let places = &self.indices[range.clone()];
            for (index, &place) in places.iter().enumerate() {
                let twin = if *is_rect { places[1 - index] } else { place };
                self.triangles[place as usize].twin = twin;
            }
        }
    }

    /// See [`Bvh::nodes`].
    pub fn nodes(&self) -> Links {
        self.bvh.nodes()
    }

    /// See [`Bvh::cost`].
    pub fn cost(&self) -> f64 {
        self.bvh.cost()
    }

    /// Number of triangles.
    pub fn len(&self) -> usize {
        self.triangles.len()
    }

    /// The triangles and normals as they are stored: those of objects with a placement are at rest.
    pub fn all_stored(&self, range: Range<usize>) -> (&[Triangle], &[Normals]) {
        (&self.triangles[range.clone()], &self.normals[range])
    }

    /// The same of one triangle.
    pub fn stored(&self, place: u32) -> (Triangle, Normals) {
        (self.triangles[place as usize], self.normals[place as usize])
    }

    /// A triangle where it lies.
    pub fn triangle(&self, place: u32) -> Triangle {
        let triangle = self.triangles[place as usize];
        match &self.placements[triangle.object as usize] {
            Some(placement) => placement.triangle(&triangle),
            None => triangle,
        }
    }

    /// The normals of a triangle where it lies.
    pub fn normals(&self, place: u32) -> Normals {
        let normals = self.normals[place as usize];
        match &self.placements[self.triangles[place as usize].object as usize] {
            Some(placement) => placement.normals(&normals),
            None => normals,
        }
    }

    /// Where an object lies, if its triangles are stored at rest.
    pub fn placement(&self, object: usize) -> Option<&Placement> {
        self.placements[object].as_ref()
    }

    /// Places among all triangles of an object's triangles, in the order of its mesh.
    pub fn indices(&self, object: usize) -> &[u32] {
        &self.indices[self.ranges[object].clone()]
    }

    /// Places an object whose triangles are stored at rest.
    pub fn place(&mut self, object: usize, placement: Placement) {
        self.placements[object] = Some(placement);
        self.is_as_built = false;
    }

    /// Stores an object's vertices where they lie: those of `mesh`, of the same topology.
    pub fn set_mesh(&mut self, object: usize, mesh: &Mesh) {
        self.placements[object] = None;
        self.store(object, mesh, self.origin);
    }

    /// Stores an object's vertices relative to `origin`, m.
    pub fn store(&mut self, object: usize, mesh: &Mesh, origin: DVec3) {
        self.is_as_built = false;
        let range = self.ranges[object].clone();
        let indices = &self.indices;
        let place = |number: u32| indices[number as usize] as usize;
        // The memory that every part writes. Writing in the order of memory takes three quarters of the time.
        let (mut triangles, mut normals) = (&mut self.triangles[..], &mut self.normals[..]);
        let mut taken = 0;
        let parts = self.numbers[range.clone()].chunks(PART).map(|numbers| {
            let end = numbers.last().map_or(taken, |&last| place(last) + 1);
            let first = std::mem::replace(&mut taken, end);
            let own =
                (triangles.split_off_mut(..end - first)).zip(normals.split_off_mut(..end - first));
            (numbers, first, own.expect("ends increase"))
        });
        let parts: Vec<_> = parts.collect();
        parts
            .into_par_iter()
            .for_each(|(numbers, first, (triangles, normals))| {
                for &number in numbers {
                    let corners = &mesh.triangles[number as usize - range.start];
                    let index = place(number) - first;
                    let (triangle, normals) = (&mut triangles[index], &mut normals[index]);
                    [triangle.position, triangle.edge1, triangle.edge2] =
                        geometry_of(mesh, corners, origin);
                    [normals.n0, normals.n1, normals.n2] = normals_of(mesh, corners);
                }
            });
    }

    /// Builds the hierarchy again, which changes the indices of all triangles.
    pub fn rebuild(&mut self) {
        self.triangles = picked(&self.triangles, &self.indices);
        self.normals = picked(&self.normals, &self.indices);
        self.bvh = Bvh::new(&self.placed());
        self.is_as_built = true;
        self.arrange();
    }

    /// All triangles where they lie.
    fn placed(&self) -> Cow<'_, [Triangle]> {
        match self.placements.iter().all(Option::is_none) {
            true => Cow::Borrowed(&self.triangles),
            false => (0..self.triangles.len() as u32)
                .map(|place| self.triangle(place))
                .collect(),
        }
    }

    /// The triangles and their hierarchy for rays on the host.
    pub fn rays(&self) -> Rays<'_> {
        let triangles = self.placed();
        let bvh = match self.is_as_built {
            true => Cow::Borrowed(&self.bvh),
            false => {
                let mut bvh = self.bvh.clone();
                bvh.refit(&triangles);
                Cow::Owned(bvh)
            }
        };
        Rays::new(triangles, bvh)
    }
}

/// Which shadows an object casts, for [`Triangle`].
pub fn occlusion(scene: &Scene, object: &Object) -> u32 {
    let is_clear = matches!(
        scene.materials[object.material].kind,
        MaterialKind::Dielectric(_)
    );
    let all_cast = scene.lights.iter().all(|light| light.kind.casts_caustics());
    match object.blocks_light {
        true if is_clear && !all_cast => OCCLUDES,
        true => OCCLUDES | OCCLUDES_ENVIRONMENT,
        false => 0,
    }
}

/// Two numbers from 0 to 1 in 16 bits each, as `packUnorm2x16` of GLSL.
pub fn packed(pair: DVec2) -> u32 {
    let [x, y] = pair
        .to_array()
        .map(|x| (x.clamp(0.0, 1.0) * 65535.0).round() as u32);
    x | y << 16
}

/// A corner of a triangle, relative to `origin`, and the edges from there.
fn geometry_of(mesh: &Mesh, corners: &[u32; 3], origin: DVec3) -> [Vec3; 3] {
    let [p0, p1, p2] = corners.map(|c| mesh.positions[c as usize] - origin);
    [p0, p1 - p0, p2 - p0].map(|v| v.as_vec3())
}

fn normals_of(mesh: &Mesh, corners: &[u32; 3]) -> [Vec3; 3] {
    corners.map(|c| mesh.normals[c as usize].as_vec3())
}

/// The elements at these places.
fn picked<T: Copy>(of: &[T], places: &[u32]) -> Vec<T> {
    places.iter().map(|&place| of[place as usize]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn a_buffer_too_small_for_the_triangles_is_named() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/mirror.toml");
        let scene = crate::scene::load(&file).unwrap().scene;
        let meshes: Vec<Cow<Mesh>> = (scene.objects.iter())
            .map(|object| object.geometry.mesh())
            .collect();
        let no_atlases: Vec<Option<Atlas>> = scene.objects.iter().map(|_| None).collect();
        let within = |triangles: usize| {
            let bytes = triangles * size_of::<Triangle>();
            TriangleStore::new(&scene, &meshes, &no_atlases, bytes as u64).map(|_| ())
        };
        let error = within(3).unwrap_err().to_string();
        assert!(
            error.starts_with("the scene has 4 triangles, and a buffer on this device holds 3"),
            "{error}"
        );
        within(4).unwrap();
    }

    /// Of a mesh that several threads write, among those of other objects.
    #[test]
    fn moved_triangles_are_where_the_mesh_is() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/pool.toml");
        let scene = crate::scene::load(&file).unwrap().scene;
        let meshes: Vec<Cow<Mesh>> = (scene.objects.iter())
            .map(|object| object.geometry.mesh())
            .collect();
        let no_atlases: Vec<Option<Atlas>> = scene.objects.iter().map(|_| None).collect();
        let mut store = TriangleStore::new(&scene, &meshes, &no_atlases, u64::MAX).unwrap();
        let water = scene.object_index("water").unwrap();
        assert!(store.indices(water).len() > PART);
        let mut moved = meshes[water].clone().into_owned();
        for (position, normal) in moved.positions.iter_mut().zip(&mut moved.normals) {
            *position += DVec3::new(0.01, position.x.sin(), 0.02);
            *normal = DVec3::new(normal.z, normal.x, normal.y);
        }
        store.set_mesh(water, &moved);
        for (object, still) in meshes.iter().enumerate() {
            let mesh = if object == water { &moved } else { still };
            for (corners, &place) in mesh.triangles.iter().zip(store.indices(object)) {
                let (triangle, normals) = (store.triangle(place), store.normals(place));
                let geometry = [triangle.position, triangle.edge1, triangle.edge2];
                assert_eq!(geometry, geometry_of(mesh, corners, store.origin));
                assert_eq!(
                    [normals.n0, normals.n1, normals.n2],
                    normals_of(mesh, corners)
                );
            }
        }
    }

    /// Prints the time to load meshes of millions of triangles and to build their hierarchy: `cargo test --release
    /// --lib millions -- --ignored --nocapture`. The figures are in docs/measurements.md.
    #[test]
    #[ignore = "measures for a minute and asserts nothing"]
    fn time_of_millions() {
        use std::fmt::Write;
        let folder = tempfile::tempdir().unwrap();
        let scene = folder.path().join("scene.toml");
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/mirror.toml");
        let text = std::fs::read_to_string(file).unwrap();
        let start = text.find("[[object]]").unwrap();
        let object = "[[object]]\nname = \"m\"\nmesh = \"m.obj\"\nmaterial = \"floor\"\n";
        let material =
            "\n[[material]]\nname = \"floor\"\nkind = \"mirror\"\nreflectance = [1, 1, 1]\n";
        std::fs::write(
            &scene,
            [
                &text[..text.find("[[material]]").unwrap()],
                material,
                object,
            ]
            .concat(),
        )
        .unwrap();
        assert!(start > 0);
        let random = |i: u32| {
            f64::from(
                i.wrapping_mul(2_654_435_761)
                    .rotate_left(13)
                    .wrapping_mul(40_503),
            ) / 2f64.powi(32)
        };
        type Corners<'a> = &'a dyn Fn(u32) -> [[f64; 3]; 3];
        for count in [1_000_000u32, 5_000_000] {
            let side = f64::from(count).sqrt() as u32;
            let grid = |i: u32| {
                let i = (u64::from(i) * 7_368_787 % u64::from(count)) as u32;
                let (x, z) = (f64::from(i % side), f64::from(i / side));
                let at = |x: f64, z: f64| [x, (0.01 * x).sin() + (0.02 * z).cos(), z];
                [at(x, z), at(x, z + 1.0), at(x + 1.0, z)]
            };
            let coincident = |i: u32| {
                let size = |k: u32| 1.0 + 1e-6 * f64::from(k);
                [
                    [0.0; 3],
                    [0.0, 0.0, size(i % 3000)],
                    [size(i / 3000), 0.0, 0.0],
                ]
            };
            let slivers = |i: u32| {
                let (x, z) = (random(i), random(i + 77_777));
                [
                    [x, 0.0, z],
                    [x + 0.5, random(i + 99), z + 1e-5],
                    [x, 0.0, z + 1e-5],
                ]
            };
            let kinds: [(&str, Corners); 3] = [
                ("shuffled grid", &grid),
                ("coincident", &coincident),
                ("slivers", &slivers),
            ];
            for (name, corners) in kinds {
                let mut text = String::new();
                for i in 0..count {
                    for [x, y, z] in corners(i) {
                        writeln!(text, "v {x:.6} {y:.6} {z:.6}").unwrap();
                    }
                    text += "f -3 -2 -1\n";
                }
                std::fs::write(folder.path().join("m.obj"), text).unwrap();
                let start = std::time::Instant::now();
                let scene = crate::scene::load(&scene)
                    .unwrap_or_else(|e| panic!("{e}"))
                    .scene;
                let loaded = start.elapsed();
                let meshes: Vec<Cow<Mesh>> = (scene.objects.iter())
                    .map(|object| object.geometry.mesh())
                    .collect();
                let start = std::time::Instant::now();
                let store = TriangleStore::new(&scene, &meshes, &[None], u64::MAX).unwrap();
                let built = start.elapsed();
                let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
                let peak = status
                    .lines()
                    .find(|line| line.starts_with("VmHWM"))
                    .unwrap_or("");
                let triangles = store.len();
                println!(
                    "{name}, {triangles} triangles: load {loaded:.2?}, hierarchy {built:.2?}, {peak}"
                );
            }
        }
    }
}
