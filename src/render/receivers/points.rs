//! Points of diffuse meshes, where their direct light is computed: on a lattice in each triangle that is longer than the
//! points' spacing, as mesh colors (Yuksel, Keyser, House 2010); at the vertices of the others. Meshes with light maps have
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
const POINTS_OF_MESH: f64 = 16_384.0;
/// The same for a mesh with a light map.
const POINTS_OF_MAPPED_MESH: f64 = 4096.0;
/// Intervals along an edge.
const MAX_DIVISION: u32 = 64;

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
    divisions: Vec<u32>,
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
    fn add(&mut self, mesh: &Mesh, divisions: &[u32], first: u32) -> u32 {
        let mut next = first + mesh.positions.len() as u32;
        self.traced.extend(first..next);
        // By vertices, intervals, and place: points on edges of lattices that match.
        let mut on_edges: HashMap<([u32; 2], u32, u32), u32> = HashMap::new();
        for (&[a, b, c], &n) in mesh.triangles.iter().zip(divisions) {
            for [column, row] in lattice(n) {
                let diagonal = n - column - row;
                let corners = [(diagonal, a), (column, b), (row, c)];
                let corner = corners.into_iter().find(|(share, _)| *share == n);
                let edge = match (column, row, diagonal) {
                    (_, 0, _) => Some((a, b, column)),
                    (0, _, _) => Some((a, c, row)),
                    (_, _, 0) => Some((b, c, row)),
                    _ => None,
                };
                let source = match (corner, edge) {
                    (Some((_, corner)), _) => first + corner,
                    (_, Some((u, v, place))) => {
                        let key = match u < v {
                            true => ([u, v], n, place),
                            false => ([v, u], n, n - place),
                        };
                        *on_edges.entry(key).or_insert(next)
                    }
                    _ => next,
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
        let (mut lists, mut divisions, mut count) = (PointLists::default(), Vec::new(), 0);
        let (unmapped, mapped) = objects.split_at(unmapped_objects);
        let kinds = [(unmapped, POINTS_OF_MESH), (mapped, POINTS_OF_MAPPED_MESH)];
        let ranges = kinds.map(|(objects, points)| {
            let [traced, copies] = lists.lengths();
            for &object in objects {
                let mesh = scene.objects[object].geometry.mesh();
                let of_mesh = divide(&mesh, points);
                count = lists.add(&mesh, &of_mesh, count);
                divisions.extend(of_mesh);
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
            divisions,
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
        let mut divisions = self.divisions.iter();
        for &object in &self.objects {
            let mesh: Cow<Mesh> = scene.objects[object].geometry.mesh();
            let first = points.len() as u32;
            points.resize(points.len() + mesh.positions.len(), SurfacePoint::default());
            for (number, &place) in store.indices(object).iter().enumerate() {
                let corners = mesh.triangles[number];
                let n = *divisions.next().expect("as many as triangles");
                let radius = (0.5 * longest_edge(&mesh, number) / f64::from(n)) as f32;
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
                of_triangles[place as usize] = match n {
                    1 => TrianglePoints {
                        first: a,
                        second: b,
                        third: c,
                        division: 1,
                    },
                    _ => TrianglePoints {
                        first: points.len() as u32,
                        division: n,
                        ..Default::default()
                    },
                };
                points.extend(
                    lattice(n).map(|place| point(DVec2::from(place.map(f64::from)) / f64::from(n))),
                );
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

/// Columns and rows of the points of a lattice with n intervals along an edge, row by row; none where n is 1.
fn lattice(n: u32) -> impl Iterator<Item = [u32; 2]> {
    let rows = if n > 1 { 0..n + 1 } else { 0..0 };
    rows.flat_map(move |row| (0..=n - row).map(move |column| [column, row]))
}

fn longest_edge(mesh: &Mesh, triangle: usize) -> f64 {
    let [a, b, c] = mesh.corners(triangle);
    (a.distance(b)).max(b.distance(c)).max(c.distance(a))
}

/// Intervals along the edges of each triangle, where the mesh has about `points` points.
fn divide(mesh: &Mesh, points: f64) -> Vec<u32> {
    let triangles = 0..mesh.triangles.len();
    let area: f64 = (triangles.clone())
        .map(|triangle| mesh.vector_area(triangle).length())
        .sum();
    let spacing = (area / points).sqrt().max(f64::MIN_POSITIVE);
    triangles
        .map(|triangle| {
            let intervals = (longest_edge(mesh, triangle) / spacing).round();
            intervals.clamp(1.0, MAX_DIVISION.into()) as u32
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// A square of two triangles: √(1/16384) = 1/128 m, and its diagonal of √2 m has more intervals than the most.
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
        let intervals = |quads| divide(&square(quads), POINTS_OF_MESH);
        assert_eq!(intervals(1), [64, 64]);
        // A quad's diagonal is √2/16 m: 11.3 intervals of 1/128 m.
        assert!(intervals(16).iter().all(|n| *n == 11));
        // √2/300 m is shorter than one.
        assert!(intervals(300).iter().all(|n| *n == 1));
        // Four vertices, and two lattices of six points: the middles of the edges, of which one is shared, are traced.
        let mut lists = PointLists::default();
        assert_eq!(lists.add(&square(1), &[2, 2], 10), 26);
        let (traced, copies) = (lists.traced, lists.copies);
        assert_eq!(traced, [10, 11, 12, 13, 15, 17, 18, 23, 24]);
        let sources: Vec<[u32; 2]> = copies.iter().map(|copy| copy.to_array()).collect();
        assert_eq!(
            sources,
            [
                [14, 10],
                [16, 11],
                [19, 13],
                [20, 10],
                [21, 17],
                [22, 13],
                [25, 12]
            ]
        );
    }
}
