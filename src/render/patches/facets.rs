//! Facets: the casters' triangles, coarse ones divided, with their corners. How finely is decided once, so that a moving scene
//! uploads none.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Staging};
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::constants::FACET_DIVISION_SHIFT;
use crate::render::gpu_types::{Facet, FacetCorner, Triangle};
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

pub struct DeviceFacets {
    pub facets: Buffer,
    pub corners: Buffer,
    pub facet_count: u32,
    pub corner_count: u32,
    /// Number of facets of triangles with sides at which the surface ends or bends.
    pub outline_count: u32,
    /// By triangle of the casters, in the scene's order.
    divisions: Vec<Division>,
}

/// How a triangle is divided.
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
        store: &TriangleStore,
        settings: &Settings,
    ) -> Result<Self> {
        let divisions = divisions(scene, store, settings);
        let (facets, corners) = facets(scene, store, &divisions);
        let device = Self {
            facets: Buffer::new(context, "facets", size_of_val(&*facets) as u64)?,
            corners: Buffer::new(context, "facet corners", size_of_val(&*corners) as u64)?,
            facet_count: facets.len() as u32,
            corner_count: corners.len() as u32,
            outline_count: facets.iter().filter(|facet| facet.exposed > 0.0).count() as u32,
            divisions,
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
        store: &TriangleStore,
    ) -> Result<()> {
        let (facets, corners) = facets(scene, store, &self.divisions);
        staging.write(&self.facets, 0, &facets)?;
        staging.write(&self.corners, 0, &corners)
    }
}

fn divisions(scene: &Scene, store: &TriangleStore, settings: &Settings) -> Vec<Division> {
    let triangles = |object| {
        let places = store.indices(object).iter();
        places.map(|&place| &store.triangles[place as usize])
    };
    let area: f64 = (scene.specular_objects())
        .flat_map(|(object, _)| triangles(object))
        .map(|triangle| f64::from(triangle.area()))
        .sum();
    // The method beams has patches of one size.
    let min_facets = match settings.method {
        Method::Beams => 0.0,
        _ => (FACETS_PER_SAMPLE * f64::from(settings.samples)).min(MAX_FACETS),
    };
    let division = |(triangle, exposed): (&Triangle, [bool; 3])| {
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
    (scene.specular_objects())
        .flat_map(|(index, object)| {
            triangles(index)
                .zip(exposed_edges(&object.geometry.mesh()))
                .map(division)
        })
        .collect()
}

fn facets(
    scene: &Scene,
    store: &TriangleStore,
    divisions: &[Division],
) -> (Vec<Facet>, Vec<FacetCorner>) {
    let (mut facets, mut corners) = (Vec::new(), Vec::new());
    let mut divisions = divisions.iter();
    for (index, object) in scene.specular_objects() {
        let mesh = object.geometry.mesh();
        // The corner of each vertex of the mesh, where facets share it.
        let mut of_vertex = vec![u32::MAX; mesh.positions.len()];
        let triangles = mesh.triangles.iter().zip(store.indices(index));
        for ((vertices, &triangle), division) in triangles.zip(&mut divisions) {
            let &Division { size, exposed } = division;
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
                        ..Default::default()
                    });
                    part += 1;
                }
            }
        }
    }
    (facets, corners)
}

/// For the sides 01, 12 and 20 of each triangle, whether the surface ends or bends there: no other triangle has the side with the
/// same normals.
fn exposed_edges(mesh: &Mesh) -> Vec<[bool; 3]> {
    let same = same_vertices(mesh);
    let sides = |corners: &[u32; 3]| {
        let [a, b, c] = corners.map(|corner| same[corner as usize]);
        [[a, b], [b, c], [c, a]]
    };
    // Where the sides from each vertex lead to, in order: a list of lists. A set of sides would take ten times as long.
    let mut starts = vec![0; mesh.positions.len() + 1];
    let directed = || mesh.triangles.iter().flat_map(sides);
    directed().for_each(|[from, _]| starts[from as usize + 1] += 1);
    for vertex in 1..starts.len() {
        starts[vertex] += starts[vertex - 1];
    }
    let mut next = starts.clone();
    let mut ends = vec![0; starts[mesh.positions.len()]];
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
    (mesh.triangles.iter())
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
        assert_eq!(exposed_edges(&mesh), expected);
        // So it does where normals are interpolated: the diagonal is hidden if both triangles have the same there.
        let normals = vec![x, y, z, z, x, y, z];
        let smooth = Mesh { normals, ..mesh };
        assert_eq!(exposed_edges(&smooth), expected);
    }
}
