//! Where surfaces are.

use glam::{DMat3, DVec2, DVec3};
use rayon::prelude::*;
use std::borrow::Cow;
use std::sync::Arc;

#[derive(Debug, Clone, PartialEq)]
pub enum Geometry {
    /// Shared by the scenes of all times at which it does not move.
    Mesh(Arc<Mesh>),
    /// A mesh that is scaled, turned and moved as a whole. A renderer that has the mesh only needs `by` in a frame.
    Placed {
        mesh: Arc<Mesh>,
        by: Similarity,
    },
    Rect(Rect),
    Waves(Waves),
}

impl Geometry {
    /// As triangles.
    pub fn mesh(&self) -> Cow<'_, Mesh> {
        match self {
            Self::Mesh(mesh) => Cow::Borrowed(mesh),
            Self::Placed { mesh, by } => Cow::Owned(mesh.placed(by)),
            Self::Rect(rect) => Cow::Owned(rect.to_mesh()),
            Self::Waves(waves) => Cow::Owned(waves.to_mesh()),
        }
    }

    /// Number of triangles of [`Self::mesh`].
    pub fn triangle_count(&self) -> usize {
        match self {
            Self::Mesh(mesh) | Self::Placed { mesh, .. } => mesh.triangles.len(),
            Self::Rect(_) => 2,
            Self::Waves(waves) => {
                2 * waves
                    .quads
                    .map(|side| side as usize)
                    .iter()
                    .product::<usize>()
            }
        }
    }

    /// The mesh where it lies, unless this is a rect or waves.
    pub fn as_mesh(&self) -> Option<Cow<'_, Mesh>> {
        self.placement().map(|_| self.mesh())
    }

    /// The mesh and how it is placed, unless this is a rect or waves.
    pub fn placement(&self) -> Option<(&Arc<Mesh>, Similarity)> {
        match self {
            Self::Mesh(mesh) => Some((mesh, Similarity::IDENTITY)),
            Self::Placed { mesh, by } => Some((mesh, *by)),
            Self::Rect(_) | Self::Waves(_) => None,
        }
    }

    /// Lower and upper corner of the bounding box, m.
    pub fn bounds(&self) -> [DVec3; 2] {
        match self {
            Self::Placed { mesh, by } => bounds(mesh.positions.iter().map(|p| by.place(*p))),
            _ => self.mesh().bounds(),
        }
    }

    /// Middle of the bounding box, m.
    pub fn middle(&self) -> DVec3 {
        let [low, high] = self.bounds();
        0.5 * (low + high)
    }

    /// Scaled, turned and moved. Meshes are shared, not copied.
    pub fn moved(&self, by: &Similarity) -> Self {
        let rect = |rect: Rect| Rect {
            origin: by.place(rect.origin),
            edge_u: by.scale * (by.rotation * rect.edge_u),
            edge_v: by.scale * (by.rotation * rect.edge_v),
        };
        match self {
            Self::Mesh(mesh) => Self::Placed {
                mesh: mesh.clone(),
                by: *by,
            },
            Self::Placed { mesh, by: before } => Self::Placed {
                mesh: mesh.clone(),
                by: by.after(before),
            },
            Self::Rect(still) => Self::Rect(rect(*still)),
            Self::Waves(still) => {
                let mut waves = still.clone();
                waves.rect = rect(still.rect);
                for sine in &mut waves.sines {
                    sine.amplitude *= by.scale;
                    sine.wave_vector /= by.scale;
                }
                Self::Waves(waves)
            }
        }
    }
}

/// p ↦ scale · rotation p + shift
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Similarity {
    /// > 0
    pub scale: f64,
    pub rotation: DMat3,
    /// m
    pub shift: DVec3,
}

impl Similarity {
    pub const IDENTITY: Self = Self {
        scale: 1.0,
        rotation: DMat3::IDENTITY,
        shift: DVec3::ZERO,
    };

    pub(crate) fn place(&self, p: DVec3) -> DVec3 {
        self.scale * (self.rotation * p) + self.shift
    }

    /// This one, after `first`.
    pub(crate) fn after(&self, first: &Self) -> Self {
        Self {
            scale: self.scale * first.scale,
            rotation: self.rotation * first.rotation,
            shift: self.place(first.shift),
        }
    }
}

/// Triangles with a unit normal at every vertex, which is interpolated and normalised between
/// them. The front face is the one seen counter-clockwise; vertex normals point to its side.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// m
    pub positions: Vec<DVec3>,
    /// Unit vectors, as many as positions.
    pub normals: Vec<DVec3>,
    /// Indices of corners, counter-clockwise from the front.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Lower and upper corner of the bounding box, m.
    pub fn bounds(&self) -> [DVec3; 2] {
        bounds(self.positions.iter().copied())
    }

    /// Scaled, turned and moved.
    pub fn placed(&self, by: &Similarity) -> Self {
        Self {
            positions: self.positions.iter().map(|p| by.place(*p)).collect(),
            normals: self.normals.iter().map(|n| by.rotation * *n).collect(),
            triangles: self.triangles.clone(),
        }
    }

    /// Distance from `point` to the nearest point of the triangles, m; infinite if there are none.
    pub fn distance_to(&self, point: DVec3) -> f64 {
        let distance = |corners: &[u32; 3]| {
            origin_to_triangle(corners.map(|corner| self.positions[corner as usize] - point))
        };
        (self.triangles.iter())
            .map(distance)
            .fold(f64::INFINITY, f64::min)
    }

    /// The triangle's corners, m.
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|corner| self.positions[corner as usize])
    }

    /// The triangle's normal times its area, m².
    pub fn vector_area(&self, triangle: usize) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        0.5 * (b - a).cross(c - a)
    }

    /// The point of the triangle with these weights of its second and third corner, m.
    pub fn point(&self, triangle: usize, weights: DVec2) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        a + weights.x * (b - a) + weights.y * (c - a)
    }
}

/// Lower and upper corner of the box around points.
pub(crate) fn bounds(points: impl Iterator<Item = DVec3>) -> [DVec3; 2] {
    points.fold([DVec3::INFINITY, DVec3::NEG_INFINITY], |[low, high], p| {
        [low.min(p), high.max(p)]
    })
}

/// Distance from the origin to the nearest point of the triangle.
fn origin_to_triangle([a, b, c]: [DVec3; 3]) -> f64 {
    let edges = [[a, b], [b, c], [c, a]];
    if let Some(normal) = (b - a).cross(c - a).try_normalize()
        && edges.iter().all(|[p, q]| normal.dot(p.cross(*q)) >= 0.0)
    {
        return normal.dot(a).abs();
    }
    let to_edge = |[p, q]: [DVec3; 2]| {
        let edge = q - p;
        // An edge without length is its corner.
        let place = -p.dot(edge) / edge.length_squared().max(f64::MIN_POSITIVE);
        (p + place.clamp(0.0, 1.0) * edge).length()
    };
    edges.map(to_edge).into_iter().fold(f64::INFINITY, f64::min)
}

/// Rectangle origin + u·edge_u + v·edge_v, u, v ∈ [0, 1]; front face toward edge_u × edge_v.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rect {
    pub origin: DVec3,
    /// Perpendicular to `edge_v`.
    pub edge_u: DVec3,
    pub edge_v: DVec3,
}

impl Rect {
    /// Unit normal of the front face.
    pub fn normal(&self) -> DVec3 {
        self.edge_u.cross(self.edge_v).normalize()
    }

    /// m²
    pub fn area(&self) -> f64 {
        self.edge_u.cross(self.edge_v).length()
    }

    /// The two triangles.
    pub fn to_mesh(&self) -> Mesh {
        let (o, u, v) = (self.origin, self.edge_u, self.edge_v);
        Mesh {
            positions: vec![o, o + u, o + u + v, o + v],
            normals: vec![self.normal(); 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        }
    }
}

/// Vertices that one thread computes at once.
const PART: usize = 4096;

/// A rectangle whose height along its normal is a sum of sines.
#[derive(Debug, Clone, PartialEq)]
pub struct Waves {
    /// At rest.
    pub rect: Rect,
    /// Number of quads along edge_u and edge_v, two triangles each; both less than 2¹⁶ − 1.
    pub quads: [u32; 2],
    pub sines: Vec<Sine>,
    /// s
    pub time: f64,
}

/// A wave of height amplitude · sin(k·p + phase − speed · time), p the place on the rectangle from
/// its origin, in m along edge_u and edge_v.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sine {
    /// m
    pub amplitude: f64,
    /// k, rad/m.
    pub wave_vector: DVec2,
    /// rad
    pub phase: f64,
    /// rad/s
    pub speed: f64,
}

impl Waves {
    /// Its triangles at [`Waves::time`], with the exact normals at the vertices.
    pub fn to_mesh(&self) -> Mesh {
        let Rect {
            origin,
            edge_u,
            edge_v,
        } = self.rect;
        let (along_u, along_v, up) = (edge_u.normalize(), edge_v.normalize(), self.rect.normal());
        let extent = DVec2::new(edge_u.length(), edge_v.length());
        let [columns, rows] = self.quads;
        let vertex = |index: u32| {
            let [column, row] = [index % (columns + 1), index / (columns + 1)];
            let share = DVec2::new(
                f64::from(column) / f64::from(columns),
                f64::from(row) / f64::from(rows),
            );
            let p = share * extent;
            let (mut height, mut slope) = (0.0, DVec2::ZERO);
            for wave in &self.sines {
                let angle = wave.wave_vector.dot(p) + wave.phase - wave.speed * self.time;
                let (sine, cosine) = angle.sin_cos();
                height += wave.amplitude * sine;
                slope += wave.amplitude * cosine * wave.wave_vector;
            }
            (
                origin + share.x * edge_u + share.y * edge_v + height * up,
                (up - slope.x * along_u - slope.y * along_v).normalize(),
            )
        };
        let vertices = (0..(columns + 1) * (rows + 1)).into_par_iter();
        let (positions, normals) = vertices.with_min_len(PART).map(vertex).unzip();
        let mut triangles = Vec::with_capacity(2 * columns as usize * rows as usize);
        for row in 0..rows {
            for column in 0..columns {
                let a = row * (columns + 1) + column;
                let [b, c, d] = [a + 1, a + columns + 2, a + columns + 1];
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        Mesh {
            positions,
            normals,
            triangles,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_to_a_triangle() {
        let mesh = Mesh {
            positions: vec![DVec3::ZERO, 4.0 * DVec3::X, 3.0 * DVec3::Z],
            normals: vec![DVec3::NEG_Y; 3],
            triangles: vec![[0, 1, 2]],
        };
        for (x, y, z, distance) in [
            (1.0, 2.0, 1.0, 2.0),   // over the inside
            (1.0, -2.0, 1.0, 2.0),  // under it
            (2.0, 0.0, -3.0, 3.0),  // beside an edge
            (4.0, 0.0, 3.0, 2.4),   // beside the longest edge
            (7.0, 4.0, 0.0, 5.0),   // past a corner
            (-3.0, 0.0, -4.0, 5.0), // past another
            (1.0, 0.0, 1.0, 0.0),
        ] {
            let found = mesh.distance_to(DVec3::new(x, y, z));
            assert!((found - distance).abs() < 1e-15, "{x} {y} {z}: {found}");
        }
        let line = Mesh {
            triangles: vec![[0, 1, 1]],
            ..mesh
        };
        assert_eq!(line.distance_to(DVec3::new(7.0, 4.0, 0.0)), 5.0);
        assert_eq!(Mesh::default().distance_to(DVec3::ZERO), f64::INFINITY);
    }
}
