//! Facets: the casters' triangles, coarse ones divided, with their corners. How finely is decided once, so that a moving scene
//! uploads none.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Staging};
use crate::render::geometry::device::DeviceGeometry;
use crate::render::gpu_types::constants::FACET_DIVISION_SHIFT;
use crate::render::gpu_types::{Facet, FacetCorner, Triangle};
use crate::render::patches::subdivision::{Kind, Piece};
use crate::render::settings::{Method, Settings};
use crate::scene::{Mesh, Scene, same_vertices};
use std::collections::HashMap;
use std::sync::Arc;

/// Facets to aim for, over the number of samples: coarser casters are divided. Patches of a facet are of one size, and
/// what happens between its corners may go unseen.
const FACETS_PER_SAMPLE: f64 = 0.25;
/// Largest number of facets that casters are divided into.
const MAX_FACETS: f64 = 262_144.0;
/// Patches beyond one for each pair of facet and light, for an error to aim for: at first, and at most.
pub const FIRST_BUDGET: u32 = 1 << 16;
pub const MAX_BUDGET: u32 = 1 << 20;
/// Largest number of facets along an edge of a triangle.
const MAX_SIZE: u32 = 64;

/// Part of the error to aim for that merged triangles may have. Errors of patches are elsewhere: there, seven eighths are left.
const PART_OF_MERGING: f64 = 0.5;

pub struct DeviceFacets {
    pub facets: Buffer,
    pub corners: Buffer,
    /// From that of all triangles to that of the largest merged ones.
    sets: Vec<FacetSet>,
    /// The one that frames use.
    chosen: usize,
}

/// Facets and corners of a set of pieces of the casters; see merging.rs.
struct FacetSet {
    first_facet: u32,
    facet_count: u32,
    first_corner: u32,
    corner_count: u32,
    /// Number of facets of triangles with sides at which the surface ends or bends.
    outline_count: u32,
    /// By piece of the casters, in the scene's order.
    divisions: Vec<Division>,
}

/// How a piece is divided.
struct Division {
    /// Number of facets along an edge.
    size: u32,
    /// Share of the outline at which the surface ends or bends.
    exposed: f32,
}

impl DeviceFacets {
    /// Allocates for the casters of `scene` and stages their facets.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if device memory is insufficient.
    pub fn new(
        context: &Arc<Context>,
        staging: &mut Staging,
        scene: &Scene,
        geometry: &DeviceGeometry,
        settings: &Settings,
    ) -> Result<Self> {
        let (mut facets, mut corners, mut sets) = (Vec::new(), Vec::new(), Vec::new());
        let same: Vec<Vec<u32>> = (scene.specular_objects())
            .map(|(_, object)| same_vertices(&object.geometry.mesh()))
            .collect();
        for set in 0..geometry.merging.set_count() {
            let divisions = divisions(scene, &same, geometry, set, settings);
            let (of_set, corners_of_set) = facets_of(scene, geometry, set, &divisions);
            sets.push(FacetSet {
                first_facet: facets.len() as u32,
                facet_count: of_set.len() as u32,
                first_corner: corners.len() as u32,
                corner_count: corners_of_set.len() as u32,
                outline_count: of_set.iter().filter(|facet| facet.exposed > 0.0).count() as u32,
                divisions,
            });
            facets.extend(of_set);
            corners.extend(corners_of_set);
        }
        let device = Self {
            facets: Buffer::new(context, "facets", size_of_val(&*facets) as u64)?,
            corners: Buffer::new(context, "facet corners", size_of_val(&*corners) as u64)?,
            sets,
            chosen: 0,
        };
        staging.write(&device.facets, 0, &facets)?;
        staging.write(&device.corners, 0, &corners)?;
        Ok(device)
    }

    /// Stages the facets again: the hierarchy was rebuilt, which changes the indices of all triangles.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn renumber(
        &self,
        staging: &mut Staging,
        scene: &Scene,
        geometry: &DeviceGeometry,
    ) -> Result<()> {
        for (set, of) in self.sets.iter().enumerate() {
            let (facets, corners) = facets_of(scene, geometry, set, &of.divisions);
            staging.write(&self.facets, of.first_facet as usize, &facets)?;
            staging.write(&self.corners, of.first_corner as usize, &corners)?;
        }
        Ok(())
    }

    /// Chooses the largest pieces whose error is at most [`PART_OF_MERGING`] of the one to aim for. Without one, triangles are not
    /// merged.
    pub fn choose(&mut self, geometry: &DeviceGeometry, error: Option<f32>) {
        let limit = PART_OF_MERGING * f64::from(error.unwrap_or(0.0));
        let fits = |set: &usize| geometry.merging.error(*set) <= limit;
        self.chosen = (1..self.sets.len()).rev().find(fits).unwrap_or(0);
    }

    /// Expected relative L1 error of the chosen pieces.
    pub fn merging_error(&self, geometry: &DeviceGeometry) -> f64 {
        geometry.merging.error(self.chosen)
    }

    /// First of the chosen facets, and their number.
    pub fn facets(&self) -> [u32; 2] {
        let set = &self.sets[self.chosen];
        [set.first_facet, set.facet_count]
    }

    /// First corner of the chosen facets, and the number of corners.
    pub fn corners(&self) -> [u32; 2] {
        let set = &self.sets[self.chosen];
        [set.first_corner, set.corner_count]
    }

    /// Largest number of facets, of their corners, and of facets with an outline that a frame may have.
    pub fn most(&self) -> [u32; 3] {
        let sets = self.sets.iter();
        let counts = sets.map(|set| [set.facet_count, set.corner_count, set.outline_count]);
        counts.fold([0; 3], |most, of| [0, 1, 2].map(|i| most[i].max(of[i])))
    }
}

/// A piece of a caster: vertices of its mesh, the triangle on the device, and the number of triangles of the mesh along an edge.
struct DevicePiece {
    corners: [u32; 3],
    triangle: u32,
    along: u32,
}

/// The pieces of an object in a set.
fn pieces(mesh: &Mesh, geometry: &DeviceGeometry, object: usize, set: usize) -> Vec<DevicePiece> {
    let indices = geometry.store.indices(object);
    match geometry.merging.pieces(object, set) {
        None => (mesh.triangles.iter().zip(indices))
            .map(|(&corners, &triangle)| DevicePiece {
                corners,
                triangle,
                along: 1,
            })
            .collect(),
        Some(pieces) => pieces
            .map(|(Piece { corners, kind }, index)| DevicePiece {
                corners,
                triangle: match kind {
                    Kind::Triangle(number) => indices[number as usize],
                    Kind::Merged { .. } => index,
                },
                along: kind.along(),
            })
            .collect(),
    }
}

/// Facets of the casters for these settings, at least.
fn min_facets(settings: &Settings) -> f64 {
    match settings.method {
        // It has patches of one size.
        Method::Beams => 0.0,
        _ => (FACETS_PER_SAMPLE * f64::from(settings.samples)).min(MAX_FACETS),
    }
}

/// Fewest pieces that triangles are merged into. `None`: they are not merged.
pub fn least_pieces(settings: &Settings) -> Option<usize> {
    let is_merged = settings.method == Method::Footprint && settings.error.is_some();
    is_merged.then(|| min_facets(settings) as usize)
}

/// `same`: by caster, what [`same_vertices`] finds.
fn divisions(
    scene: &Scene,
    same: &[Vec<u32>],
    geometry: &DeviceGeometry,
    set: usize,
    settings: &Settings,
) -> Vec<Division> {
    let store = &geometry.store;
    let area: f64 = (scene.specular_objects())
        .flat_map(|(object, _)| store.indices(object))
        .map(|&place| f64::from(store.triangle(place).area()))
        .sum();
    let min_facets = min_facets(settings);
    let division = |(triangle, exposed): (Triangle, [bool; 3])| {
        let (along, up) = (triangle.edge1, triangle.edge2);
        let sides = [along.length(), up.distance(along), up.length()];
        let bends = (sides.iter().zip(exposed)).map(|(side, exposed)| match exposed {
            true => *side,
            false => 0.0,
        });
        let share = f64::from(triangle.area()) / area;
        Division {
            size: ((min_facets * share).sqrt().round() as u32).clamp(1, MAX_SIZE),
            exposed: bends.sum::<f32>() / sides.iter().sum::<f32>().max(f32::MIN_POSITIVE),
        }
    };
    (scene.specular_objects().zip(same))
        .flat_map(|((index, object), same)| {
            let mesh = object.geometry.mesh();
            let pieces = pieces(&mesh, geometry, index, set);
            let corners: Vec<[u32; 3]> = pieces.iter().map(|piece| piece.corners).collect();
            let exposed = exposed_edges(same, &corners);
            let triangles = (pieces.into_iter()).map(|piece| geometry.triangle(piece.triangle));
            triangles.zip(exposed).map(division).collect::<Vec<_>>()
        })
        .collect()
}

fn facets_of(
    scene: &Scene,
    geometry: &DeviceGeometry,
    set: usize,
    divisions: &[Division],
) -> (Vec<Facet>, Vec<FacetCorner>) {
    let (mut facets, mut corners) = (Vec::new(), Vec::new());
    let mut divisions = divisions.iter();
    for (index, object) in scene.specular_objects() {
        let mesh = object.geometry.mesh();
        // The corner of each vertex of the mesh, where facets share it.
        let mut of_vertex = vec![u32::MAX; mesh.positions.len()];
        let pieces = pieces(&mesh, geometry, index, set);
        for (piece, division) in pieces.into_iter().zip(&mut divisions) {
            let DevicePiece {
                corners: vertices,
                triangle,
                along,
            } = piece;
            let &Division { size, exposed } = division;
            let along = match along {
                1 => 0,
                _ => along.div_ceil(size).max(2),
            };
            let mut of_point = HashMap::new();
            let mut corner = |i: u32, j: u32| {
                let vertex = match (i, j) {
                    (0, 0) => Some(vertices[0]),
                    _ if i == size => Some(vertices[1]),
                    _ if j == size => Some(vertices[2]),
                    _ => None,
                };
                let place = match vertex {
                    Some(vertex) => &mut of_vertex[vertex as usize],
                    None => of_point.entry((i, j)).or_insert(u32::MAX),
                };
                if *place == u32::MAX {
                    *place = corners.len() as u32;
                    let [s, t] = [i, j].map(|k| k as f32 / size as f32);
                    corners.push(FacetCorner { triangle, s, t });
                }
                *place
            };
            let mut part = 0;
            // In the order of lattice_cell() of facet.glsl.
            for row in 0..size {
                for column in 0..2 * (size - row) - 1 {
                    let (i, j) = (column / 2, row);
                    let [corner0, corner1, corner2] = match column % 2 {
                        0 => [corner(i, j), corner(i + 1, j), corner(i, j + 1)],
                        _ => [corner(i + 1, j + 1), corner(i, j + 1), corner(i + 1, j)],
                    };
                    facets.push(Facet {
                        triangle,
                        place: part | size << FACET_DIVISION_SHIFT,
                        corner0,
                        corner1,
                        corner2,
                        exposed,
                        along,
                        ..Default::default()
                    });
                    part += 1;
                }
            }
        }
    }
    (facets, corners)
}

/// For the sides 01, 12 and 20 of each of these triangles, whether the surface ends or bends there: no other one has the side with the
/// same normals. `same` has the first vertex with the same position and normal as each.
fn exposed_edges(same: &[u32], triangles: &[[u32; 3]]) -> Vec<[bool; 3]> {
    let sides = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|corner| same[corner as usize]);
        [[a, b], [b, c], [c, a]]
    };
    // Where the sides from each vertex lead to, in order: a list of lists. A set of sides would take ten times as long.
    let mut starts = vec![0; same.len() + 1];
    let directed = || triangles.iter().flat_map(sides);
    directed().for_each(|[from, _]| starts[from as usize + 1] += 1);
    for vertex in 1..starts.len() {
        starts[vertex] += starts[vertex - 1];
    }
    let mut next = starts.clone();
    let mut ends = vec![0; starts[same.len()]];
    for [from, to] in directed() {
        ends[next[from as usize]] = to;
        next[from as usize] += 1;
    }
    for list in starts.windows(2) {
        ends[list[0]..list[1]].sort_unstable();
    }
    // The neighbour has the side in the other direction.
    let is_exposed = |[from, to]: [u32; 2]| {
        let list = starts[to as usize]..starts[to as usize + 1];
        ends[list].binary_search(&from).is_err()
    };
    (triangles.iter())
        .map(|corners| sides(corners).map(is_exposed))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::DVec3;

    /// Two triangles make a flat square, a third folds up from its side: the diagonal alone is hidden.
    #[test]
    fn a_surface_bends_and_ends_at_exposed_edges() {
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z];
        let positions = vec![DVec3::ZERO, x, x + y, y, y, x + y, y + z];
        let normals = [vec![z; 4], vec![-y; 3]].concat();
        let mesh = Mesh {
            positions,
            normals,
            triangles: vec![[0, 1, 2], [0, 2, 3], [4, 5, 6]],
        };
        let expected = [[true, true, false], [false, true, true], [true; 3]];
        assert_eq!(
            exposed_edges(&same_vertices(&mesh), &mesh.triangles),
            expected
        );
        // So it does where normals are interpolated: the diagonal is hidden if both triangles have the same there.
        let normals = vec![x, y, z, z, x, y, z];
        let smooth = Mesh { normals, ..mesh };
        assert_eq!(
            exposed_edges(&same_vertices(&smooth), &smooth.triangles),
            expected
        );
    }
}
