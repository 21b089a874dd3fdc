//! Whether the scene needs any shadow rays.

use crate::scene::{MaterialKind, Mesh, Scene};
use std::borrow::Cow;

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
    let size = mesh
        .positions
        .iter()
        .map(|p| p.distance(mesh.positions[0]))
        .fold(0.0, f64::max);
    mesh.triangles.iter().all(|corners| {
        let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        mesh.positions.iter().all(|p| {
            let height = normal.dot(*p - a);
            let height = if is_flat { height.abs() } else { height };
            height <= 1e-9 * size
        })
    })
}
