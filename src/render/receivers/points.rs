//! Points of diffuse meshes without light maps, where their direct light is computed: on a lattice in each triangle that is
//! longer than the points' spacing, as mesh colors (Yuksel, Keyser, House 2010); at the vertices of the others.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Staging};
use crate::render::geometry::triangle_store::{TriangleStore, packed};
use crate::render::gpu_types::{SurfacePoint, TrianglePoints};
use crate::scene::{Geometry, MaterialKind, Mesh, Scene};
use glam::DVec2;
use std::borrow::Cow;
use std::sync::Arc;

/// Points of a mesh to aim for, where its triangles are few.
const POINTS_OF_MESH: f64 = 16_384.0;
/// Intervals along an edge.
const MAX_DIVISION: u32 = 64;

pub struct MeshPoints {
    pub objects: Vec<usize>,
    /// For each triangle of the scene, if there are any points.
    pub of_triangles: Buffer,
    pub points: Buffer,
    pub light: Buffer,
    pub count: u32,
    /// In the order of `objects` and of their triangles.
    divisions: Vec<u32>,
}

impl MeshPoints {
    /// # Errors
    /// [`crate::Error::Device`] if device memory is insufficient.
    pub fn new(context: &Arc<Context>, scene: &Scene, store: &TriangleStore) -> Result<Self> {
        let objects: Vec<usize> = (0..scene.objects.len())
            .filter(|&index| {
                let object = &scene.objects[index];
                let kind = &scene.materials[object.material].kind;
                matches!(kind, MaterialKind::Diffuse { .. })
                    && object.light_map.is_none()
                    && !matches!(object.geometry, Geometry::Rect(_))
            })
            .collect();
        let divisions: Vec<u32> = (objects.iter())
            .flat_map(|&object| divisions(&scene.objects[object].geometry.mesh()))
            .collect();
        let on_lattices: usize = (divisions.iter())
            .filter(|&&n| n > 1)
            .map(|&n| lattice_points(n))
            .sum();
        let vertices: usize = (objects.iter())
            .map(|&object| scene.objects[object].geometry.mesh().positions.len())
            .sum();
        let count = on_lattices + vertices;
        let buffer = |name, count: usize, element: usize| {
            Buffer::new(context, name, (count * element) as u64)
        };
        let triangles = match objects.is_empty() {
            true => 0,
            false => store.triangles.len(),
        };
        Ok(Self {
            objects,
            of_triangles: buffer(
                "points of triangles",
                triangles,
                size_of::<TrianglePoints>(),
            )?,
            points: buffer("surface points", count, size_of::<SurfacePoint>())?,
            light: buffer("light of points", count, 16)?,
            count: count as u32,
            divisions,
        })
    }

    /// Writes the points and where each triangle has its own.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn write(&self, staging: &mut Staging, scene: &Scene, store: &TriangleStore) -> Result<()> {
        if self.objects.is_empty() {
            return Ok(());
        }
        let mut points = Vec::with_capacity(self.count as usize);
        let mut of_triangles = vec![TrianglePoints::default(); store.triangles.len()];
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
                if n > 1 {
                    for row in 0..=n {
                        points.extend((0..=n - row).map(|column| {
                            point(DVec2::new(column.into(), row.into()) / f64::from(n))
                        }));
                    }
                }
            }
        }
        staging.write(&self.of_triangles, 0, &of_triangles)?;
        staging.write(&self.points, 0, &points)
    }

    pub fn bytes(&self) -> u64 {
        self.of_triangles.bytes() + self.points.bytes() + self.light.bytes()
    }
}

fn lattice_points(n: u32) -> usize {
    ((n + 1) * (n + 2) / 2) as usize
}

fn longest_edge(mesh: &Mesh, triangle: usize) -> f64 {
    let [a, b, c] = mesh.corners(triangle);
    (a.distance(b)).max(b.distance(c)).max(c.distance(a))
}

/// Intervals along the edges of each triangle.
fn divisions(mesh: &Mesh) -> Vec<u32> {
    let triangles = 0..mesh.triangles.len();
    let area: f64 = (triangles.clone())
        .map(|triangle| mesh.vector_area(triangle).length())
        .sum();
    let spacing = (area / POINTS_OF_MESH).sqrt().max(f64::MIN_POSITIVE);
    triangles
        .map(|triangle| {
            let intervals = (longest_edge(mesh, triangle) / spacing).ceil();
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
        assert_eq!(divisions(&square(1)), [64, 64]);
        // A quad's diagonal is √2/16 m: 11 intervals of 1/128 m, and a part of one.
        assert!(divisions(&square(16)).iter().all(|n| *n == 12));
        // √2/300 m is shorter than one.
        assert!(divisions(&square(300)).iter().all(|n| *n == 1));
        assert_eq!(lattice_points(2), 6);
    }
}
