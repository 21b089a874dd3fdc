//! Whether the surfaces of two meshes cross.

use super::Mesh;
use glam::DVec3;

/// Distance over the size of the meshes at which a corner touches a face.
const CONTACT: f64 = 1e-6;
/// Pairs of triangles that are compared at most: a second. What is not found until then stays unknown.
const MAX_PAIRS: usize = 100_000_000;

/// A place where an edge of one of two meshes passes through a face of the other. Contact is none.
pub fn crossing(a: &Mesh, b: &Mesh) -> Option<DVec3> {
    let [of_a, of_b] = [a, b].map(Mesh::bounds);
    let common = [of_a[0].max(of_b[0]), of_a[1].min(of_b[1])];
    let size = (of_a[1] - of_a[0]).max(of_b[1] - of_b[0]).max_element();
    let contact = CONTACT * size;
    if !(common[1] - common[0]).cmpgt(DVec3::splat(contact)).all() {
        return None;
    }
    // Swept along x: what begins before the end of another may cross it.
    let mut faces: Vec<Face> = ([a, b].into_iter().enumerate())
        .flat_map(|(mesh, of)| (0..of.triangles.len()).map(move |i| Face::new(mesh, of.corners(i))))
        .filter(|face| face.meets(&common))
        .collect();
    faces.sort_unstable_by(|a, b| a.bounds[0].x.total_cmp(&b.bounds[0].x));
    let mut open: [Vec<usize>; 2] = Default::default();
    let mut pairs = 0;
    for (index, face) in faces.iter().enumerate() {
        let others = &mut open[1 - face.mesh];
        others.retain(|&other| faces[other].bounds[1].x >= face.bounds[0].x);
        pairs += others.len();
        if pairs > MAX_PAIRS {
            return None;
        }
        let near = (others.iter().map(|&other| &faces[other])).filter(|o| o.meets(&face.bounds));
        for other in near {
            for [through, by] in [[face, other], [other, face]] {
                let [a, b, c] = by.corners;
                let found = [[a, b], [b, c], [c, a]]
                    .into_iter()
                    .find_map(|edge| pierced(through.corners, edge, contact));
                if found.is_some() {
                    return found;
                }
            }
        }
        open[face.mesh].push(index);
    }
    None
}

struct Face {
    mesh: usize,
    corners: [DVec3; 3],
    bounds: [DVec3; 2],
}

impl Face {
    fn new(mesh: usize, corners: [DVec3; 3]) -> Self {
        let [a, b, c] = corners;
        Self {
            mesh,
            corners,
            bounds: [a.min(b).min(c), a.max(b).max(c)],
        }
    }

    fn meets(&self, [low, high]: &[DVec3; 2]) -> bool {
        self.bounds[0].cmple(*high).all() && self.bounds[1].cmpge(*low).all()
    }
}

/// Where an edge passes through a triangle, both its ends farther than `contact` from its plane.
fn pierced([a, b, c]: [DVec3; 3], [from, to]: [DVec3; 2], contact: f64) -> Option<DVec3> {
    let normal = (b - a).cross(c - a).try_normalize()?;
    let [before, behind] = [from, to].map(|end| normal.dot(end - a));
    if before * behind >= 0.0 || before.abs() <= contact || behind.abs() <= contact {
        return None;
    }
    let at = from.lerp(to, before / (before - behind));
    let inside = [[a, b], [b, c], [c, a]]
        .into_iter()
        .all(|[p, q]| normal.dot((q - p).cross(at - p)) >= 0.0);
    inside.then_some(at)
}
