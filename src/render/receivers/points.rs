//! Points of diffuse meshes, where their direct light is computed: on a lattice in each triangle that is longer than the
//! points' spacing, as mesh colors (Yuksel, Keyser, House 2010), but with fewer rows in thin triangles, whose points lie no closer
//! across than along; at the vertices of the others. Meshes with light maps have
//! points for the light of the environment, whose shadows are soft: far fewer than texels.
//!
//! Every lattice has all its points, so that looking up is simple; but light is computed once for the points that lattices share.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Staging};
use crate::render::geometry::triangle_store::{TriangleStore, packed};
use crate::render::gpu_types::{SurfacePoint, TrianglePoints};
use crate::scene::{Geometry, LightKind, MaterialKind, Mesh, Scene};
use glam::{DVec2, UVec2};
use std::borrow::Cow;
use std::collections::HashMap;
use std::ops::Range;
use std::sync::Arc;

/// Points of a mesh without a light map to aim for, where its triangles are few.
const POINTS_OF_MESH: f64 = 32_768.0;
/// The same for a mesh with a light map.
const POINTS_OF_MAPPED_MESH: f64 = 8192.0;
/// Intervals along an edge.
const MAX_INTERVALS: u32 = 64;

/// The lattice of a triangle, of which row 0 is the longest edge.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Lattice {
    /// Number of the corner opposite the longest edge.
    apex: usize,
    /// Intervals from the longest edge to the apex; 0 where the points are the triangle's corners.
    rows: u32,
    /// Intervals that a row has more than the next one.
    step: u32,
}

impl Lattice {
    /// The one of a triangle of the mesh whose points are about `spacing` apart, m.
    fn new(mesh: &Mesh, triangle: usize, spacing: f64) -> Self {
        let (apex, longest) = longest_edge(mesh, triangle);
        let height = 2.0 * mesh.vector_area(triangle).length() / longest.max(f64::MIN_POSITIVE);
        let intervals = |length: f64| {
            let intervals = (length / spacing).round();
            intervals.clamp(1.0, MAX_INTERVALS.into()) as u32
        };
        let (along, rows) = (intervals(longest), intervals(height));
        let step = (along + rows / 2) / rows;
        match (rows, step) {
            (1, 1) => Self {
                apex,
                rows: 0,
                step,
            },
            _ => Self { apex, rows, step },
        }
    }

    /// Intervals along a row.
    fn intervals(&self, row: u32) -> u32 {
        self.step * (self.rows - row)
    }

    /// Rows and columns of the points, row by row; none where the points are the corners.
    fn places(self) -> impl Iterator<Item = [u32; 2]> {
        let rows = if self.rows > 0 {
            0..self.rows + 1
        } else {
            0..0
        };
        rows.flat_map(move |row| (0..=self.intervals(row)).map(move |column| [row, column]))
    }

    /// Weights of the second and third corner at a place.
    fn weights(&self, [row, column]: [u32; 2]) -> DVec2 {
        let height = f64::from(row) / f64::from(self.rows);
        let along = f64::from(column) / f64::from(self.intervals(row).max(1));
        let mut weights = [0.0; 3];
        weights[self.apex] = height;
        weights[(self.apex + 1) % 3] = (1.0 - along) * (1.0 - height);
        weights[(self.apex + 2) % 3] = along * (1.0 - height);
        DVec2::new(weights[1], weights[2])
    }
}

pub struct MeshPoints {
    /// Meshes without light maps, then those with light maps.
    objects: Vec<usize>,
    unmapped_objects: usize,
    /// For each triangle of the scene, if there are any points.
    pub of_triangles: Buffer,
    pub points: Buffer,
    /// Direct light at the points of meshes without light maps, W/m².
    pub light: Buffer,
    /// That of the environment, at traced points of meshes without light maps and all points of the others.
    pub environment: Buffer,
    /// Numbers of the points whose light is computed.
    pub traced: Buffer,
    /// Pairs of points, of which the first has the light of the second.
    pub copies: Buffer,
    /// Points of meshes without light maps, and of the others.
    pub ranges: [PointRanges; 2],
    lists: PointLists,
    /// In the order of `objects` and of their triangles.
    lattices: Vec<Lattice>,
}

/// Parts of [`MeshPoints::traced`] and [`MeshPoints::copies`].
#[derive(Debug, Default, Clone, PartialEq)]
pub struct PointRanges {
    pub traced: Range<u32>,
    pub copies: Range<u32>,
}

#[derive(Debug, Default)]
struct PointLists {
    traced: Vec<u32>,
    copies: Vec<UVec2>,
}

impl PointLists {
    /// Adds the points of a mesh, of which the first has the number `first`. Returns the number after the last.
    fn add(&mut self, mesh: &Mesh, lattices: &[Lattice], first: u32) -> u32 {
        let mut next = first + mesh.positions.len() as u32;
        self.traced.extend(first..next);
        // By vertices, intervals, and place: points on edges of lattices that match.
        let mut on_edges: HashMap<([u32; 2], u32, u32), u32> = HashMap::new();
        for (corners, lattice) in mesh.triangles.iter().zip(lattices) {
            let [apex, begin, end] = [0, 1, 2].map(|i| corners[(lattice.apex + i) % 3]);
            let rows = lattice.rows;
            for [row, column] in lattice.places() {
                let last = lattice.intervals(row);
                // The edge that it lies on, with its intervals.
                let edge = match (row, column) {
                    (0, _) => Some((begin, end, last, column)),
                    (_, 0) => Some((begin, apex, rows, row)),
                    _ if column == last => Some((end, apex, rows, row)),
                    _ => None,
                };
                let source = match edge {
                    Some((corner, _, _, 0)) => first + corner,
                    Some((_, corner, n, place)) if place == n => first + corner,
                    Some((u, v, n, place)) => {
                        let key = match u < v {
                            true => ([u, v], n, place),
                            false => ([v, u], n, n - place),
                        };
                        *on_edges.entry(key).or_insert(next)
                    }
                    None => next,
                };
                match source == next {
                    true => self.traced.push(next),
                    false => self.copies.push(UVec2::new(next, source)),
                }
                next += 1;
            }
        }
        next
    }

    fn lengths(&self) -> [u32; 2] {
        [self.traced.len() as u32, self.copies.len() as u32]
    }
}

impl MeshPoints {
    /// # Errors
    /// [`crate::Error::Device`] if device memory is insufficient.
    pub fn new(context: &Arc<Context>, scene: &Scene, store: &TriangleStore) -> Result<Self> {
        let meshes = |is_mapped: bool| {
            (0..scene.objects.len()).filter(move |&index| {
                let object = &scene.objects[index];
                let kind = &scene.materials[object.material].kind;
                matches!(kind, MaterialKind::Diffuse { .. })
                    && object.light_map.is_some() == is_mapped
                    && !matches!(object.geometry, Geometry::Rect(_))
            })
        };
        let has_environment =
            (scene.lights.iter()).any(|light| matches!(light.kind, LightKind::Environment { .. }));
        let mut objects: Vec<usize> = meshes(false).collect();
        let unmapped_objects = objects.len();
        objects.extend(meshes(true).filter(|_| has_environment));
        let (mut lists, mut lattices, mut count) = (PointLists::default(), Vec::new(), 0);
        let (unmapped, mapped) = objects.split_at(unmapped_objects);
        let kinds = [(unmapped, POINTS_OF_MESH), (mapped, POINTS_OF_MAPPED_MESH)];
        let ranges = kinds.map(|(objects, points)| {
            let [traced, copies] = lists.lengths();
            for &object in objects {
                let mesh = scene.objects[object].geometry.mesh();
                let of_mesh = divide(&mesh, points);
                count = lists.add(&mesh, &of_mesh, count);
                lattices.extend(of_mesh);
            }
            let ends = lists.lengths();
            PointRanges {
                traced: traced..ends[0],
                copies: copies..ends[1],
            }
        });
        let count = count as usize;
        let buffer = |name, count: usize, element: usize| {
            Buffer::new(context, name, (count * element) as u64)
        };
        let triangles = match objects.is_empty() {
            true => 0,
            false => store.len(),
        };
        Ok(Self {
            objects,
            unmapped_objects,
            of_triangles: buffer(
                "points of triangles",
                triangles,
                size_of::<TrianglePoints>(),
            )?,
            points: buffer("surface points", count, size_of::<SurfacePoint>())?,
            light: buffer("light of points", count, 16)?,
            environment: buffer(
                "environment light of points",
                if has_environment { count } else { 0 },
                16,
            )?,
            traced: buffer("traced points", lists.traced.len(), size_of::<u32>())?,
            copies: buffer("copied points", lists.copies.len(), size_of::<UVec2>())?,
            ranges,
            lists,
            lattices,
        })
    }

    /// Whether there are no points.
    pub fn is_empty(&self) -> bool {
        self.objects.is_empty()
    }

    /// The meshes whose direct light is at points.
    pub fn unmapped_objects(&self) -> &[usize] {
        &self.objects[..self.unmapped_objects]
    }

    /// Writes the points and where each triangle has its own.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn write(&self, staging: &mut Staging, scene: &Scene, store: &TriangleStore) -> Result<()> {
        if self.is_empty() {
            return Ok(());
        }
        let mut points = Vec::with_capacity(self.lists.traced.len() + self.lists.copies.len());
        let mut of_triangles = vec![TrianglePoints::default(); store.len()];
        let mut lattices = self.lattices.iter();
        for &object in &self.objects {
            let mesh: Cow<Mesh> = scene.objects[object].geometry.mesh();
            let first = points.len() as u32;
            points.resize(points.len() + mesh.positions.len(), SurfacePoint::default());
            for (number, &place) in store.indices(object).iter().enumerate() {
                let corners = mesh.triangles[number];
                let lattice = *lattices.next().expect("as many as triangles");
                let (_, longest) = longest_edge(&mesh, number);
                let radius = (0.5 * longest / f64::from(lattice.intervals(0).max(1))) as f32;
                let point = |weights: DVec2| SurfacePoint {
                    triangle: place,
                    weights: packed(weights),
                    radius,
                };
                // A vertex is a point of the last of its triangles.
                for (corner, weights) in corners.iter().zip([DVec2::ZERO, DVec2::X, DVec2::Y]) {
                    points[(first + corner) as usize] = point(weights);
                }
                let [a, b, c] = corners.map(|corner| first + corner);
                of_triangles[place as usize] = match lattice.rows {
                    0 => TrianglePoints {
                        first: a,
                        step_: b,
                        apex: c,
                        rows: 0,
                    },
                    rows => TrianglePoints {
                        first: points.len() as u32,
                        step_: lattice.step,
                        apex: lattice.apex as u32,
                        rows,
                    },
                };
                points.extend((lattice.places()).map(|place| point(lattice.weights(place))));
            }
        }
        staging.write(&self.of_triangles, 0, &of_triangles)?;
        staging.write(&self.traced, 0, &self.lists.traced)?;
        staging.write(&self.copies, 0, &self.lists.copies)?;
        staging.write(&self.points, 0, &points)
    }

    pub fn bytes(&self) -> u64 {
        let buffers = [
            &self.of_triangles,
            &self.points,
            &self.light,
            &self.environment,
            &self.traced,
            &self.copies,
        ];
        buffers.map(Buffer::bytes).iter().sum()
    }
}

/// Number of the corner opposite the longest edge of a triangle, and the length of that edge, m.
fn longest_edge(mesh: &Mesh, triangle: usize) -> (usize, f64) {
    let corners = mesh.corners(triangle);
    let edges = [0, 1, 2].map(|apex| {
        let [begin, end] = [1, 2].map(|i| corners[(apex + i) % 3]);
        (apex, begin.distance(end))
    });
    let longest = edges
        .into_iter()
        .reduce(|a, b| if b.1 > a.1 { b } else { a });
    longest.expect("three edges")
}

/// The lattices of all triangles, where the mesh has about `points` points.
fn divide(mesh: &Mesh, points: f64) -> Vec<Lattice> {
    let triangles = 0..mesh.triangles.len();
    let area: f64 = (triangles.clone())
        .map(|triangle| mesh.vector_area(triangle).length())
        .sum();
    let spacing = (area / points).sqrt().max(f64::MIN_POSITIVE);
    triangles
        .map(|triangle| Lattice::new(mesh, triangle, spacing))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// A square of two triangles: √(1/32768) = 1/181 m, and its diagonal of √2 m has more intervals than the most.
    #[test]
    fn coarse_meshes_get_lattices() {
        let square = |quads: u32| {
            let side = quads + 1;
            let place = |i: u32| DVec3::new((i % side).into(), (i / side).into(), 0.0);
            Mesh {
                positions: (0..side * side)
                    .map(|i| place(i) / f64::from(quads))
                    .collect(),
                normals: vec![DVec3::Z; (side * side) as usize],
                triangles: (0..quads * quads)
                    .flat_map(|i| {
                        let a = i / quads * side + i % quads;
                        [[a, a + 1, a + side + 1], [a, a + side + 1, a + side]]
                    })
                    .collect(),
            }
        };
        let are_all = |quads, rows, step| {
            let lattices = divide(&square(quads), POINTS_OF_MESH);
            (lattices.iter()).all(|lattice| [lattice.rows, lattice.step] == [rows, step])
        };
        assert!(are_all(1, 64, 1));
        // A quad's diagonal is √2/16 m, 16 intervals of 1/181 m, and the corners lie 8 above it.
        assert!(are_all(16, 8, 2));
        // √2/300 m is shorter than one.
        assert!(are_all(300, 0, 1));
        // Four vertices, and two lattices of six points: the middles of the edges, of which one is shared, are traced.
        let mesh = square(1);
        let lattices = [1, 2].map(|apex| Lattice {
            apex,
            rows: 2,
            step: 1,
        });
        let mut lists = PointLists::default();
        assert_eq!(lists.add(&mesh, &lattices, 10), 26);
        let (traced, copies) = (lists.traced, lists.copies);
        assert_eq!(traced, [10, 11, 12, 13, 15, 17, 18, 23, 24]);
        let sources: Vec<[u32; 2]> = copies.iter().map(|copy| copy.to_array()).collect();
        assert_eq!(
            sources,
            [
                [14, 13],
                [16, 10],
                [19, 11],
                [20, 10],
                [21, 15],
                [22, 13],
                [25, 12]
            ]
        );
    }

    /// A strip of 1 m by 1/32 m has points 1/64 m apart, and so have its neighbours on the edges that they share.
    #[test]
    fn thin_triangles_have_few_rows() {
        let mesh = Mesh {
            positions: vec![DVec3::ZERO, DVec3::X, DVec3::new(1.0, 1.0 / 32.0, 0.0)],
            normals: vec![DVec3::Z; 3],
            triangles: vec![[0, 1, 2]],
        };
        let lattice = Lattice::new(&mesh, 0, 1.0 / 64.0);
        assert_eq!(
            [lattice.apex as u32, lattice.rows, lattice.step],
            [1, 2, 32]
        );
        let corners = mesh.corners(0);
        let points: Vec<DVec3> = (lattice.places())
            .map(|place| {
                let w = lattice.weights(place);
                (1.0 - w.x - w.y) * corners[0] + w.x * corners[1] + w.y * corners[2]
            })
            .collect();
        assert_eq!(points.len(), 65 + 33 + 1);
        assert!(points[0].distance(corners[2]) < 1e-12 && points[64].distance(corners[0]) < 1e-12);
        assert!(points[98].distance(corners[1]) < 1e-12);
        // Row 1 lies half-way between the longest edge and the apex.
        for (below, above) in (0..65).step_by(2).zip(65..98) {
            let middle = 0.5 * (points[below] + corners[1]);
            assert!(points[above].distance(middle) < 1e-12);
        }
    }
}
