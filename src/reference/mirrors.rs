//! The specular surfaces as one list of triangles, points on them, and what they do to light.

use crate::optics::{fresnel_conductor, fresnel_dielectric, reflect, refract};
use crate::scene::{Dielectric, MaterialKind, Scene};
use glam::{DVec2, DVec3};

/// What a specular surface does to light.
#[derive(Clone, Copy)]
pub enum Surface {
    /// RGB, 0..=1
    Mirror(DVec3),
    /// Complex index of refraction, RGB.
    Conductor { index: DVec3, extinction: DVec3 },
    /// The interface of two media, whose indices of refraction [`Sides`](super::media::Sides) has.
    Interface,
    /// Two interfaces at one place, around a medium of this index of refraction.
    Sheet(f64),
}

/// Light that leaves a specular surface.
pub struct Leaving {
    /// Unit vector away from the surface.
    pub direction: DVec3,
    /// Of the light that arrives, RGB, 0..=1.
    pub share: DVec3,
    /// Squared index of refraction where the light goes over that where it comes from: radiance
    /// changes by this (*Physically Based Rendering*, 4th ed., section 9.5.2).
    pub compression: f64,
}

impl Surface {
    /// `None` for a diffuse material.
    pub fn of(material: &MaterialKind) -> Option<Self> {
        match *material {
            MaterialKind::Mirror { reflectance } => Some(Self::Mirror(reflectance)),
            MaterialKind::Conductor { index, extinction } => {
                Some(Self::Conductor { index, extinction })
            }
            MaterialKind::Dielectric(Dielectric {
                ior, thin: true, ..
            }) => Some(Self::Sheet(ior)),
            MaterialKind::Dielectric(_) => Some(Self::Interface),
            MaterialKind::Diffuse { .. } => None,
        }
    }

    /// Whether light from behind does anything but vanish.
    pub fn has_two_sides(&self) -> bool {
        matches!(self, Self::Interface | Self::Sheet(_))
    }

    /// [`Self::leaving`]. Where the interpolated normal would reflect light into the flat triangle, as at the outline of a
    /// coarse mesh, the geometric normal replaces it.
    pub fn leaving_with_fallback(
        &self,
        ior: [f64; 2],
        toward: DVec3,
        shading: DVec3,
        geometric: DVec3,
    ) -> [Option<Leaving>; 2] {
        let side = geometric.dot(toward).signum();
        let reflected = reflect(-toward, shading);
        let is_valid = side * geometric.dot(reflected) > 0.0 && side * shading.dot(toward) > 0.0;
        let normal = if is_valid { shading } else { geometric };
        self.leaving(ior, toward, normal, geometric)
    }

    /// Where light from the unit direction `toward` goes, by reflection and by refraction, at a
    /// point with the unit normal `shading` of a triangle with the normal `geometric`. `ior` are the indices of refraction
    /// before and behind the surface, as the light travels.
    pub fn leaving(
        &self,
        ior: [f64; 2],
        toward: DVec3,
        shading: DVec3,
        geometric: DVec3,
    ) -> [Option<Leaving>; 2] {
        let front = geometric.dot(toward) > 0.0;
        if !front && !self.has_two_sides() {
            return [None, None];
        }
        let side = if front { 1.0 } else { -1.0 };
        let (shading, geometric) = (side * shading, side * geometric);
        let cosine = shading.dot(toward);
        if cosine <= 0.0 {
            return [None, None];
        }
        let reflected = reflect(-toward, shading);
        let reflected = |share| Leaving {
            direction: reflected,
            share,
            compression: 1.0,
        };
        let (reflected, refracted) = match *self {
            Self::Mirror(reflectance) => (reflected(reflectance), None),
            Self::Conductor { index, extinction } => {
                let share = |channel: usize| {
                    let [real, imaginary] = [index, extinction].map(|of| of[channel] / ior[0]);
                    fresnel_conductor(cosine, real, imaginary)
                };
                (reflected(DVec3::new(share(0), share(1), share(2))), None)
            }
            // With all reflections between the two interfaces, 2R/(1 + R) is reflected.
            Self::Sheet(between) => {
                let once = fresnel_dielectric(cosine, ior[0] / between);
                let share = 2.0 * once / (1.0 + once);
                let passing = Leaving {
                    direction: -toward,
                    share: DVec3::splat(1.0 - share),
                    compression: 1.0,
                };
                (reflected(DVec3::splat(share)), Some(passing))
            }
            Self::Interface => {
                let ratio = ior[0] / ior[1];
                let share = fresnel_dielectric(cosine, ratio);
                let refracted = refract(-toward, shading, ratio).map(|direction| Leaving {
                    direction,
                    share: DVec3::splat(1.0 - share),
                    compression: 1.0 / (ratio * ratio),
                });
                (reflected(DVec3::splat(share)), refracted)
            }
        };
        // Nothing leaves into the flat triangle.
        let before = |leaving: &Leaving| geometric.dot(leaving.direction) > 0.0;
        let behind = |leaving: &Leaving| geometric.dot(leaving.direction) < 0.0;
        [Some(reflected).filter(before), refracted.filter(behind)]
    }
}

/// A triangle of a specular surface. Points on it are a + s·edge_1 + t·edge_2.
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
    pub surface: Surface,
    /// In the scene.
    pub object: u32,
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

/// Normal between unit vertex normals at the weights of the second and third corner, unit; the `geometric` one where
/// there is none.
pub fn shading_normal(normals: [DVec3; 3], geometric: DVec3, weights: DVec2) -> DVec3 {
    let [n0, n1, n2] = normals;
    let normal = (1.0 - weights.x - weights.y) * n0 + weights.x * n1 + weights.y * n2;
    normal.normalize_or(geometric)
}

impl MirrorTriangle {
    /// Shading normal, unit, at the weights of the second and third corner.
    pub fn shading(&self, weights: DVec2) -> DVec3 {
        shading_normal(self.normals, self.geometric_normal, weights)
    }

    /// Point uniform in area for (u, v) uniform in [0, 1)²; neighbours stay neighbours.
    pub fn point(&self, u: f64, v: f64) -> MirrorPoint {
        let root = u.sqrt();
        let (s, t) = (root * (1.0 - v), root * v);
        MirrorPoint {
            position: self.a + s * self.edge_1 + t * self.edge_2,
            normal: self.shading(DVec2::new(s, t)),
        }
    }
}

/// The corners of all triangles that cast shadows, in the order of the objects.
pub fn triangles_that_block(scene: &Scene) -> Vec<[DVec3; 3]> {
    let mut triangles = Vec::new();
    for object in scene.objects.iter().filter(|object| object.blocks_light) {
        let mesh = object.geometry.mesh();
        triangles.extend((0..mesh.triangles.len()).map(|triangle| mesh.corners(triangle)));
    }
    triangles
}

/// The same with the triangles of interfaces shrunk to points, which block nothing: the other triangles keep their numbers.
pub fn opaque_triangles_that_block(scene: &Scene) -> Vec<[DVec3; 3]> {
    let mut triangles = triangles_that_block(scene);
    let mut first = 0;
    for object in scene.objects.iter().filter(|object| object.blocks_light) {
        let count = object.geometry.triangle_count();
        let kind = &scene.materials[object.material].kind;
        if matches!(kind, MaterialKind::Dielectric(_)) {
            for triangle in &mut triangles[first..first + count] {
                *triangle = [triangle[0]; 3];
            }
        }
        first += count;
    }
    triangles
}

/// All triangles with a specular material and an area above zero.
pub fn mirror_triangles(scene: &Scene) -> Vec<MirrorTriangle> {
    let mut triangles = Vec::new();
    let mut blockers = 0;
    for (number, object) in (0..).zip(&scene.objects) {
        let mesh = object.geometry.mesh();
        let first_blocker = object.blocks_light.then_some(blockers);
        if object.blocks_light {
            blockers += mesh.triangles.len() as u32;
        }
        let Some(surface) = Surface::of(&scene.materials[object.material].kind) else {
            continue;
        };
        for (index, corners) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = mesh.corners(index);
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
                    surface,
                    object: number,
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

    /// Sum of the weights before that of an index.
    pub fn before(&self, index: usize) -> f64 {
        match index {
            0 => 0.0,
            _ => self.cumulative[index - 1],
        }
    }

    pub fn weight(&self, index: usize) -> f64 {
        self.cumulative[index] - self.before(index)
    }

    /// With which [`Self::pick`] picks an index.
    pub fn probability(&self, index: usize) -> f64 {
        self.weight(index) / self.total()
    }

    /// The index at `u` in [0, 1), and where inside its share `u` lies, in [0, 1).
    pub fn pick(&self, u: f64) -> (usize, f64) {
        let target = u * self.total();
        let cell = (u * self.guide.len() as f64) as usize;
        let mut index = self.guide[cell.min(self.guide.len() - 1)] as usize;
        while index + 1 < self.cumulative.len() && self.cumulative[index] <= target {
            index += 1;
        }
        let start = self.before(index);
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
