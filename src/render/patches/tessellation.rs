//! Tessellation: the casters' triangles that face a light, and the number of patches for each.
//!
//! The number is fixed when the renderer is made: patches that stay attached to their surface do not flicker when the
//! surface moves.

use crate::error::{Error, Result};
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types;
use crate::scene::{MaterialKind, Scene};
use glam::Vec3;

/// Maximum number of pairs of patch and light: within 32 bits, with a margin for rounding up.
pub const MAX_PAIRS: u64 = 1 << 31;

/// All casters' triangles, object by object in the order of the meshes.
pub struct Tessellation {
    triangles: Vec<CasterTriangle>,
    samples: u32,
}

/// The triangles that are lit.
pub struct Lit {
    pub lit_triangles: Vec<gpu_types::LitTriangle>,
    pub patch_count: u32,
    /// m²
    pub area: f64,
}

struct CasterTriangle {
    object: u32,
    /// Index among its object's triangles.
    index: u32,
    /// Patches along an edge.
    subdivision: u32,
    /// Whether it is lit from every direction.
    always: bool,
}

impl Tessellation {
    /// Chooses the subdivision so that the triangles that are lit now have about `samples` patches, at least one each.
    ///
    /// All triangles of an object have the same subdivision, because the sum of the footprints is uneven where patch
    /// sizes jump. Only a triangle of more than [`LARGE`] times the object's mean area is divided more finely.
    /// `all_lit`: light comes from all directions.
    pub fn new(
        scene: &Scene,
        store: &TriangleStore,
        lights: &[gpu_types::Light],
        all_lit: bool,
        samples: u32,
    ) -> Self {
        const LARGE: f64 = 4.0;
        let mut triangles = Vec::new();
        let mut areas = Vec::new();
        // Per object, (area, number) of all triangles and of the lit ones.
        let mut all = vec![(0.0, 0.0); scene.objects.len()];
        let mut lit = all.clone();
        for (index, object) in scene.specular_objects() {
            let material = &scene.materials[object.material].kind;
            let always = all_lit || matches!(material, MaterialKind::Dielectric(_));
            for (number, &place) in store.indices(index).iter().enumerate() {
                let area = f64::from(store.triangle(place).area());
                let sums = [&mut all[index], &mut lit[index]];
                let counts = [true, always || faces_any(store, place, lights)];
                for (sum, _) in sums.into_iter().zip(counts).filter(|(_, counts)| *counts) {
                    *sum = (sum.0 + area, sum.1 + 1.0);
                }
                areas.push(area);
                triangles.push(CasterTriangle {
                    object: index as u32,
                    index: number as u32,
                    subdivision: 1,
                    always,
                });
            }
        }
        let sum = |objects: &[(f64, f64)]| objects.iter().map(|(area, _)| area).sum::<f64>();
        let total = if sum(&lit) > 0.0 {
            sum(&lit)
        } else {
            sum(&all)
        };
        for (caster, area) in triangles.iter_mut().zip(areas) {
            let object = caster.object as usize;
            let (sum, count) = if lit[object].0 > 0.0 {
                lit[object]
            } else {
                all[object]
            };
            let mean = sum / count;
            let patches = f64::from(samples) * mean / total;
            let finer = (area / (LARGE * mean)).sqrt().max(1.0);
            // A triangle without area has one patch.
            caster.subdivision = ((patches.sqrt().round().max(1.0) * finer).round() as u32).max(1);
        }
        Self { triangles, samples }
    }

    /// The triangles that face a sun or a lamp.
    ///
    /// # Errors
    /// [`Error::Usage`] where there are more pairs of patch and light than 32 bits count.
    pub fn lit(&self, store: &TriangleStore, lights: &[gpu_types::Light]) -> Result<Lit> {
        let (mut patch_count, mut sum) = (0u64, 0.0);
        let mut areas = Vec::with_capacity(self.triangles.len());
        let mut lit_triangles = Vec::with_capacity(self.triangles.len());
        for caster in &self.triangles {
            let triangle = store.indices(caster.object as usize)[caster.index as usize];
            let area = store.triangle(triangle).area();
            if area == 0.0 || !(caster.always || faces_any(store, triangle, lights)) {
                continue;
            }
            sum += f64::from(area);
            areas.push(sum);
            lit_triangles.push(gpu_types::LitTriangle {
                triangle,
                first_patch: patch_count as u32,
                subdivision: caster.subdivision,
                share_end: 0, // set below
            });
            patch_count += caster.patches();
            let pairs = patch_count.saturating_mul(lights.len().max(1) as u64);
            if pairs > MAX_PAIRS {
                let samples = self.samples;
                return Err(Error::Usage {
                    reason: format!(
                        "{samples} samples make more than {MAX_PAIRS} patches, counted once for each light"
                    ),
                    remedy: "ask for fewer samples".into(),
                });
            }
        }
        for (lit_triangle, end) in lit_triangles.iter_mut().zip(areas) {
            // Casts saturate: the last share ends at 2^32 - 1.
            lit_triangle.share_end = (end / sum * 2f64.powi(32)) as u32;
        }
        Ok(Lit {
            lit_triangles,
            patch_count: patch_count as u32,
            area: sum,
        })
    }

    /// Patches of all triangles, lit or not.
    pub fn all_patches(&self) -> u64 {
        self.triangles.iter().map(CasterTriangle::patches).sum()
    }
}

impl CasterTriangle {
    fn patches(&self) -> u64 {
        u64::from(self.subdivision) * u64::from(self.subdivision)
    }
}

/// Whether any part of any light may shine on the front of the triangle at this index.
fn faces_any(store: &TriangleStore, place: u32, lights: &[gpu_types::Light]) -> bool {
    let (triangle, normals) = (store.triangle(place), store.normals(place));
    lights.iter().any(|light| faces(&triangle, &normals, light))
}

/// Whether any part of a sun or lamp may shine on the triangle's front. Let n be a normal and p − x the vector to the
/// lamp's centre. n·(p − x) is a mean over pairs of corners, so one pair is positive where any point of the triangle
/// is.
fn faces(
    triangle: &gpu_types::Triangle,
    normals: &gpu_types::Normals,
    light: &gpu_types::Light,
) -> bool {
    let geometric = triangle.edge1.cross(triangle.edge2).normalize_or_zero();
    let (lowest, directions) = if light.is_lamp == 0 {
        (-light.size.sin(), [light.place; 3])
    } else {
        let direction = light.place - triangle.position;
        (
            -light.size,
            [
                direction,
                direction - triangle.edge1,
                direction - triangle.edge2,
            ],
        )
    };
    let above = |normal: &Vec3| {
        directions
            .iter()
            .any(|direction| normal.dot(*direction) > lowest)
    };
    above(&geometric) && [normals.n0, normals.n1, normals.n2].iter().any(above)
}
