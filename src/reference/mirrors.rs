//! The mirrors as one list of triangles, and points on them.

use crate::scene::{Geometry, MaterialKind, Mesh, Scene};
use glam::DVec3;
use std::borrow::Cow;

/// A triangle of a mirror. Points on it are a + s·edge_1 + t·edge_2.
pub struct MirrorTriangle {
    /// m
    pub a: DVec3,
    pub edge_1: DVec3,
    pub edge_2: DVec3,
    /// Unit vertex normals; between them the shading normal is interpolated and normalised.
    pub normals: [DVec3; 3],
    /// Unit normal of the flat triangle, on its front.
    pub geometric_normal: DVec3,
    /// m²
    pub area: f64,
    /// RGB, 0..=1
    pub reflectance: DVec3,
    /// The same triangle in [`triangles_that_block`], if it blocks light.
    pub blocker: Option<u32>,
}

/// A point on a mirror.
pub struct MirrorPoint {
    /// m
    pub position: DVec3,
    /// Shading normal, unit.
    pub normal: DVec3,
}

impl MirrorTriangle {
    /// Point uniform in area for (u, v) uniform in [0, 1)²; neighbours stay neighbours.
    pub fn point(&self, u: f64, v: f64) -> MirrorPoint {
        let root = u.sqrt();
        let (s, t) = (root * (1.0 - v), root * v);
        let [n0, n1, n2] = self.normals;
        MirrorPoint {
            position: self.a + s * self.edge_1 + t * self.edge_2,
            normal: ((1.0 - s - t) * n0 + s * n1 + t * n2).normalize_or(self.geometric_normal),
        }
    }
}

fn mesh(geometry: &Geometry) -> Cow<'_, Mesh> {
    match geometry {
        Geometry::Mesh(mesh) => Cow::Borrowed(mesh),
        Geometry::Rect(rect) => Cow::Owned(rect.to_mesh()),
    }
}

/// The corners of all triangles that cast shadows, in the order of the objects.
pub fn triangles_that_block(scene: &Scene) -> Vec<[DVec3; 3]> {
    let mut triangles = Vec::new();
    for object in scene.objects.iter().filter(|object| object.blocks_light) {
        let mesh = mesh(&object.geometry);
        triangles.extend(
            mesh.triangles
                .iter()
                .map(|corners| corners.map(|corner| mesh.positions[corner as usize])),
        );
    }
    triangles
}

/// All triangles with a mirror material and an area above zero.
pub fn mirror_triangles(scene: &Scene) -> Vec<MirrorTriangle> {
    let mut triangles = Vec::new();
    let mut blockers = 0;
    for object in &scene.objects {
        let mesh = mesh(&object.geometry);
        let first_blocker = object.blocks_light.then_some(blockers);
        if object.blocks_light {
            blockers += mesh.triangles.len() as u32;
        }
        let MaterialKind::Mirror { reflectance } = scene.materials[object.material].kind else {
            continue;
        };
        for (index, corners) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
            let vector_area = 0.5 * (b - a).cross(c - a);
            let area = vector_area.length();
            if area > 0.0 {
                triangles.push(MirrorTriangle {
                    a,
                    edge_1: b - a,
                    edge_2: c - a,
                    normals: corners.map(|corner| mesh.normals[corner as usize]),
                    geometric_normal: vector_area / area,
                    area,
                    reflectance,
                    blocker: first_blocker.map(|first| first + index as u32),
                });
            }
        }
    }
    triangles
}

/// Picks an index in proportion to its weight, in constant time.
pub struct Distribution {
    /// Sums of the weights up to and including each index.
    cumulative: Vec<f64>,
    /// Where to start looking: the index that holds i/n of the total weight.
    guide: Vec<u32>,
}

impl Distribution {
    /// `None` if all weights are zero.
    pub fn new(weights: impl IntoIterator<Item = f64>) -> Option<Self> {
        let mut total = 0.0;
        let cumulative: Vec<f64> = weights
            .into_iter()
            .map(|weight| {
                total += weight;
                total
            })
            .collect();
        if total <= 0.0 {
            return None;
        }
        let cells = cumulative.len();
        let guide = (0..cells)
            .map(|i| {
                let share = total * i as f64 / cells as f64;
                cumulative.partition_point(|&sum| sum <= share) as u32
            })
            .collect();
        Some(Self { cumulative, guide })
    }

    /// Sum of the weights.
    pub fn total(&self) -> f64 {
        self.cumulative[self.cumulative.len() - 1]
    }

    /// With which [`Self::pick`] picks an index.
    pub fn probability(&self, index: usize) -> f64 {
        let below = if index == 0 {
            0.0
        } else {
            self.cumulative[index - 1]
        };
        (self.cumulative[index] - below) / self.total()
    }

    /// The index at `u` in [0, 1), and where inside its share `u` lies, in [0, 1).
    pub fn pick(&self, u: f64) -> (usize, f64) {
        let target = u * self.total();
        let cell = (u * self.guide.len() as f64) as usize;
        let mut index = self.guide[cell.min(self.guide.len() - 1)] as usize;
        while index + 1 < self.cumulative.len() && self.cumulative[index] <= target {
            index += 1;
        }
        let start = if index == 0 {
            0.0
        } else {
            self.cumulative[index - 1]
        };
        let share = (target - start) / (self.cumulative[index] - start);
        (index, share.clamp(0.0, 1.0 - f64::EPSILON))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn picks_in_proportion_and_never_what_weighs_nothing() {
        let distribution = Distribution::new([0.0, 1.0, 0.0, 3.0, 0.0]).unwrap();
        let mut counts = [0; 5];
        for i in 0..1000 {
            counts[distribution.pick((i as f64 + 0.5) / 1000.0).0] += 1;
        }
        assert_eq!(counts, [0, 250, 0, 750, 0]);
        assert!(Distribution::new([0.0, 0.0]).is_none());
        assert!(Distribution::new([]).is_none());
    }

    #[test]
    fn remainder_runs_from_0_to_1_inside_each_share() {
        let distribution = Distribution::new([1.0, 3.0]).unwrap();
        let (index, share) = distribution.pick(0.25 + 0.75 * 0.5);
        assert_eq!(index, 1);
        assert!((share - 0.5).abs() < 1e-12);
    }
}
