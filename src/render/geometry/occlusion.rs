//! Whether the scene needs any shadow rays.

use crate::scene::{MaterialKind, Mesh, Scene};
use glam::{DMat3, DVec3};
use std::borrow::Cow;

/// Pairs of face and vertex that are compared in a frame: 2 ms.
pub const MAX_PAIRS_IN_A_FRAME: usize = 1_000_000;
/// Tolerance of positions, over the size of their mesh.
const ROUNDING: f64 = 1e-9;

/// Whether anything can occlude light on its way to a caster or from there to a receiver. Nothing can if the only
/// object that casts shadows is the only caster, and the object lies behind the plane of each of its faces: it is flat
/// or convex, or flat if it refracts. Both segments of a light path then lie in front of the face, wherever the light
/// is. Returns true if the proof would compare more than `max_pairs` pairs of face and vertex.
pub fn can_occlude(scene: &Scene, meshes: &[Cow<Mesh>], max_pairs: usize) -> bool {
    let mut occluders = scene
        .objects
        .iter()
        .zip(meshes)
        .filter(|(object, _)| object.blocks_light);
    let Some((object, mesh)) = occluders.next() else {
        return false;
    };
    let material = &scene.materials[object.material].kind;
    if !material.is_specular() || scene.specular_objects().count() > 1 {
        return true;
    }
    let two_sided = matches!(material, MaterialKind::Dielectric(_));
    occluders.next().is_some() || !is_convex(mesh, two_sided, max_pairs)
}

/// Whether a mesh is convex, or flat if `is_flat`: every vertex lies behind the plane of each face, or in it. False if the proof
/// would compare more than `max_pairs` pairs of face and vertex.
pub fn is_convex(mesh: &Mesh, is_flat: bool, max_pairs: usize) -> bool {
    if mesh.positions.len() * mesh.triangles.len() > max_pairs {
        return false;
    }
    let first = mesh.positions[0];
    let size = mesh.positions[farthest(mesh, |p| p.distance(first))].distance(first);
    mesh.triangles.iter().all(|corners| {
        let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        mesh.positions.iter().all(|p| {
            let height = normal.dot(*p - a);
            let height = if is_flat { height.abs() } else { height };
            height <= ROUNDING * size
        })
    })
}

/// Whether one affine map without reflection takes the vertices of `mesh` to those of `image`, which keeps a mesh convex or flat.
pub fn is_affine_image(mesh: &Mesh, image: &Mesh) -> bool {
    // Four vertices that span the mesh determine the map.
    let p = &mesh.positions;
    let first = p[0];
    let second = farthest(mesh, |p| p.distance(first));
    let along = p[second] - first;
    let third = farthest(mesh, |p| along.cross(p - first).length());
    let normal = along.cross(p[third] - first);
    let fourth = farthest(mesh, |p| normal.dot(p - first).abs());
    let size = along.length();
    let is_flat = normal.dot(p[fourth] - first).abs() <= ROUNDING * size * normal.length();
    let axes = |p: &[DVec3]| {
        let (along, up) = (p[second] - p[0], p[third] - p[0]);
        let out = match is_flat {
            true => along.cross(up).normalize_or_zero(),
            false => p[fourth] - p[0],
        };
        DMat3::from_cols(along, up, out)
    };
    let (from, to) = (axes(p), axes(&image.positions));
    if from.determinant() * to.determinant() <= 0.0 {
        return false;
    }
    let map = to * from.inverse();
    let tolerance = ROUNDING * size * map.to_cols_array().map(f64::abs).iter().sum::<f64>();
    (p.iter().zip(&image.positions)).all(|(p, image_p)| {
        (image.positions[0] + map * (p - first)).distance(*image_p) <= tolerance
    })
}

/// The vertex with the largest `measure`.
fn farthest(mesh: &Mesh, measure: impl Fn(DVec3) -> f64) -> usize {
    (0..mesh.positions.len())
        .max_by(|&a, &b| measure(mesh.positions[a]).total_cmp(&measure(mesh.positions[b])))
        .expect("a mesh has vertices")
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tetrahedron, a flat square, and both moved, turned, sheared, mirrored and bent.
    #[test]
    fn affine_images_are_told_from_others() {
        let [x, y, z] = [DVec3::X, DVec3::Y, DVec3::Z];
        let solid = vec![DVec3::ZERO, x, y, z, 0.2 * (x + y + z)];
        let flat = vec![DVec3::ZERO, x, x + y, y];
        let mesh = |positions: Vec<DVec3>| Mesh {
            normals: vec![z; positions.len()],
            positions,
            triangles: vec![[0, 1, 2]],
        };
        let sheared = DMat3::from_axis_angle((x + 2.0 * y).normalize(), 1.0)
            * DMat3::from_cols(3.0 * x, y + 0.5 * x, 0.1 * z);
        for positions in [solid, flat] {
            let of = |change: &dyn Fn(DVec3) -> DVec3| {
                let image = mesh(positions.iter().map(|p| change(*p)).collect());
                is_affine_image(&mesh(positions.clone()), &image)
            };
            assert!(of(&|p| p) && of(&|p| sheared * p + 10.0 * x));
            assert!(!of(&|p| p + 1e-3 * p.x * p.y * z), "bent");
            assert!(!of(&|p| p + 1e-3 * p.x * p.y * x), "stretched");
        }
        let mirrored = mesh(vec![DVec3::ZERO, y, x, z, 0.2 * (x + y + z)]);
        assert!(!is_affine_image(
            &mesh(vec![DVec3::ZERO, x, y, z, 0.2 * (x + y + z)]),
            &mirrored
        ));
    }
}
