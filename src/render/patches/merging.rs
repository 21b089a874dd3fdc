//! Merging: four triangles of a smooth caster as one facet, where the mesh is regular and the error to aim for allows it.
//!
//! The larger triangles are those of subdivision.rs. Their surface is the quadratic one through corners and midpoints (facet.glsl).

use crate::render::gpu_types::constants::MERGED;
use crate::render::gpu_types::{Normals, Triangle};
use crate::render::patches::subdivision::{Kind, Piece, levels as levels_of};
use crate::scene::{Mesh, Scene};
use glam::DVec3;
use std::borrow::Cow;

/// Expected relative L1 error over the relative error of the normals' change, where the mesh is straight between the vertices and the
/// merged triangle curved, and where the mesh has more vertices: fitted to grids of 64² to 708² quads. `src/method.md` has the
/// figures.
const ERROR_OF_STRAIGHT: f64 = 0.65;
const ERROR_OF_CURVED: f64 = 2.0;
/// Merged triangles of which the error is measured, about.
const MEASURED: usize = 4096;

/// The pieces of a caster at a level of merging.
struct Level {
    pieces: Vec<Piece>,
    /// Place of the first merged triangle in [`Merging::triangles`].
    first: usize,
    /// See [`Merging::error`].
    error: f64,
}

/// Merged triangles of all casters.
#[derive(Default)]
pub struct Merging {
    /// By caster: its object, and levels from fine to coarse.
    casters: Vec<(usize, Vec<Level>)>,
    /// As the device has them after those of the scene: first the merged triangles, then the triangles of their midpoints, to which
    /// `twin` leads. Those of objects with a placement are at rest.
    pub triangles: Vec<Triangle>,
    pub normals: Vec<Normals>,
    /// Number of triangles of the scene.
    scene_count: usize,
}

impl Merging {
    /// Merges the triangles of the casters of `scene` as long as `least` pieces and more are left. `scene_count` is the number
    /// of the scene's triangles, and `origin` the position of the device's origin, m.
    pub fn new(
        scene: &Scene,
        meshes: &[Cow<Mesh>],
        origin: DVec3,
        scene_count: usize,
        least: usize,
    ) -> Self {
        let mut merging = Self {
            scene_count,
            ..Self::default()
        };
        let mut count = 0;
        for (object, _) in scene.specular_objects() {
            let mesh = &meshes[object];
            let mut levels: Vec<Level> = Vec::new();
            for pieces in levels_of(mesh, least) {
                let first = count;
                count += pieces.iter().filter(|piece| piece.kind.is_merged()).count();
                levels.push(Level {
                    pieces,
                    first,
                    error: 0.0,
                });
            }
            if !levels.is_empty() {
                merging.casters.push((object, levels));
            }
        }
        merging.triangles = vec![Triangle::default(); 2 * count];
        merging.normals = vec![Normals::default(); 2 * count];
        for (object, _) in scene.specular_objects() {
            merging.store(object, &meshes[object], origin);
        }
        merging
    }

    /// Whether triangles of `object` are merged.
    pub fn has(&self, object: usize) -> bool {
        self.casters.iter().any(|(of, _)| *of == object)
    }

    /// Number of sets of pieces, from that of all unmerged triangles to the coarsest.
    pub fn set_count(&self) -> usize {
        let levels = self.casters.iter().map(|(_, levels)| levels.len());
        1 + levels.max().unwrap_or(0)
    }

    /// Expected relative L1 error of the light of a set of pieces, against that of the meshes.
    pub fn error(&self, set: usize) -> f64 {
        let of_casters = (self.casters.iter()).filter_map(|(_, levels)| at(levels, set));
        of_casters.map(|level| level.error).fold(0.0, f64::max)
    }

    /// The pieces of an object in a set, with the place of each merged triangle in the device's list of triangles; `None` where they are
    /// the triangles of its mesh.
    pub fn pieces(&self, object: usize, set: usize) -> Option<impl Iterator<Item = (Piece, u32)>> {
        let (_, levels) = self.casters.iter().find(|(of, _)| *of == object)?;
        let level = at(levels, set)?;
        let mut index = (self.scene_count + level.first) as u32;
        Some(level.pieces.iter().map(move |&piece| {
            let place = index;
            index += u32::from(piece.kind.is_merged());
            (piece, place)
        }))
    }

    /// Places in [`Self::triangles`] of the merged triangles of an object, and of their midpoints.
    pub fn places(&self, object: usize) -> impl Iterator<Item = usize> {
        let half = self.triangles.len() / 2;
        let of_object = self.casters.iter().filter(move |(of, _)| *of == object);
        of_object
            .flat_map(|(_, levels)| levels)
            .flat_map(move |level| {
                let merged = level
                    .pieces
                    .iter()
                    .filter(|piece| piece.kind.is_merged())
                    .count();
                let places = level.first..level.first + merged;
                places.clone().chain(places.start + half..places.end + half)
            })
    }

    /// Stores the vertices of `mesh`, which has the topology of the object's first one, relative to `origin`, m.
    pub fn store(&mut self, object: usize, mesh: &Mesh, origin: DVec3) {
        let count = self.triangles.len() / 2;
        let position = |vertex: u32| (mesh.positions[vertex as usize] - origin).as_vec3();
        let normal = |vertex: u32| mesh.normals[vertex as usize].as_vec3();
        for (_, levels) in (self.casters.iter_mut()).filter(|(of, _)| *of == object) {
            let mut finest = 0.0;
            for level in levels {
                let mut place = level.first;
                for piece in &level.pieces {
                    let Kind::Merged { midpoints, .. } = piece.kind else {
                        continue;
                    };
                    let [p0, p1, p2] = piece.corners.map(position);
                    let [n0, n1, n2] = piece.corners.map(normal);
                    self.triangles[place] = Triangle {
                        position: p0,
                        edge1: p1 - p0,
                        edge2: p2 - p0,
                        object: object as u32,
                        flags: MERGED,
                        twin: (self.scene_count + count + place) as u32,
                    };
                    let with = |n0, n1, n2| Normals {
                        n0,
                        n1,
                        n2,
                        ..Normals::default()
                    };
                    self.normals[place] = with(n0, n1, n2);
                    let [m0, m1, m2] = midpoints.map(position);
                    self.triangles[count + place] = Triangle {
                        position: m0,
                        edge1: m1 - m0,
                        edge2: m2 - m0,
                        ..Triangle::default()
                    };
                    let [n0, n1, n2] = midpoints.map(normal);
                    self.normals[count + place] = with(n0, n1, n2);
                    place += 1;
                }
                // That of the mesh itself remains.
                let own = error_of(&level.pieces, mesh);
                level.error = f64::hypot(own, finest);
                if finest == 0.0 {
                    finest = own;
                }
            }
        }
    }
}

/// The level of a caster in a set: its coarsest where others have more.
fn at(levels: &[Level], set: usize) -> Option<&Level> {
    levels.get(set.checked_sub(1)?.min(levels.len() - 1))
}

/// Expected relative L1 error where merged triangles have the quadratic through corners and midpoints for their normals. Where light is
/// focused, irradiance is inversely proportional to the change of normals along the surface: its error is that of this change, which
/// is at scales that the light's blur does not hide.
fn error_of(pieces: &[Piece], mesh: &Mesh) -> f64 {
    let normal = |vertex: u32| mesh.normals[vertex as usize];
    let position = |vertex: u32| mesh.positions[vertex as usize];
    let across = |change: DVec3, normal: DVec3| (change - change.dot(normal) * normal).length();
    let (mut wrong, mut whole) = (0.0, 0.0);
    let step = (pieces.len() / MEASURED).max(1);
    for piece in pieces.iter().step_by(step) {
        let Kind::Merged {
            midpoints,
            quarters,
            ..
        } = piece.kind
        else {
            continue;
        };
        let [p0, p1, p2] = piece.corners.map(position);
        let area = (p1 - p0).cross(p2 - p0).length();
        for (side, midpoint) in midpoints.into_iter().enumerate() {
            let [a, b] = [piece.corners[side], piece.corners[(side + 1) % 3]].map(normal);
            let middle = normal(midpoint);
            whole += area * across(b - a, middle);
            wrong += area
                * match quarters {
                    // The mesh has straight lines where the quadratic has a curve.
                    None => ERROR_OF_STRAIGHT * across(middle - 0.5 * (a + b), middle) / 4.0,
                    Some(vertices) => {
                        let quarter = |place: usize, near: DVec3, far: DVec3| {
                            let expected = 0.375 * near + 0.75 * middle - 0.125 * far;
                            let at = normal(vertices[2 * side + place]);
                            across(at - expected, at)
                        };
                        0.5 * ERROR_OF_CURVED * (quarter(0, a, b) + quarter(1, b, a))
                    }
                };
        }
    }
    match whole > 0.0 {
        true => wrong / whole,
        false => 0.0,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::render::patches::subdivision::tests::waves;

    /// The error falls with the size of the triangles, is none where the surface is flat, and large where it is rough.
    #[test]
    fn smooth_meshes_have_small_errors() {
        let error = |mesh: &Mesh| error_of(&levels_of(mesh, 8)[0], mesh);
        let [coarse, fine] = [16, 32].map(|quads| error(&waves([quads, quads], 1.0)));
        assert!((0.45..0.55).contains(&(fine / coarse)), "{coarse} {fine}");
        let short = error(&waves([16, 16], 4.0));
        assert!(short > 2.0 * coarse, "{coarse} {short}");
        let mut flat = waves([16, 16], 1.0);
        flat.normals.fill(DVec3::Y);
        assert_eq!(error(&flat), 0.0);
        let mut rough = waves([16, 16], 1.0);
        for (number, normal) in rough.normals.iter_mut().enumerate() {
            let random = |factor: f64| ((number as f64 * factor).sin() * 4e4).fract();
            *normal = DVec3::new(0.2 * random(12.9), 1.0, 0.2 * random(78.2)).normalize();
        }
        assert!(error(&rough) > 0.05, "{}", error(&rough));
    }
}
