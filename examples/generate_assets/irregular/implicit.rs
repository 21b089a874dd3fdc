//! Meshes of implicit surfaces: a field that is negative inside, polygonised by surface nets
//! (Gibson 1998).

use super::{Polygons, random};
use glam::DVec3;

/// About the distance to an ellipsoid.
pub fn ellipsoid(at: DVec3, centre: [f64; 3], radii: [f64; 3]) -> f64 {
    let (from_centre, radii) = (at - DVec3::from(centre), DVec3::from(radii));
    let scaled = from_centre / radii;
    let length = scaled.length();
    length * (length - 1.0) / (scaled / radii).length().max(1e-9)
}

/// About the distance to the hull of two spheres.
pub fn limb(at: DVec3, ends: [[f64; 3]; 2], radii: [f64; 2]) -> f64 {
    let [from, to] = ends.map(DVec3::from);
    let along = ((at - from).dot(to - from) / (to - from).length_squared()).clamp(0.0, 1.0);
    at.distance(from.lerp(to, along)) - (radii[0] + along * (radii[1] - radii[0]))
}

/// Union with fillets of about the radius `blend`.
pub fn union(blend: f64, distances: &[f64]) -> f64 {
    let sum: f64 = distances.iter().map(|d| (-d / blend).exp()).sum();
    -blend * sum.ln()
}

/// `distance` less what is inside `tool`.
pub fn carve(blend: f64, distance: f64, tool: f64) -> f64 {
    -union(blend, &[-distance, tool])
}

/// Quads around the region where `field` is negative. `place` gives the places of the grid's nodes, which need not be
/// even.
pub fn surface_nets(
    nodes: [usize; 3],
    place: impl Fn(DVec3) -> DVec3,
    field: impl Fn(DVec3) -> f64,
) -> Polygons {
    let stride = [1, nodes[0], nodes[0] * nodes[1]];
    let coordinates = |index: usize| [0, 1, 2].map(|axis| index / stride[axis] % nodes[axis]);
    let count = stride[2] * nodes[2];
    let places: Vec<DVec3> = (0..count)
        .map(|index| place(DVec3::from(coordinates(index).map(|n| n as f64))))
        .collect();
    let values: Vec<f64> = places.iter().map(|&at| field(at)).collect();
    let crosses = |a: usize, b: usize| (values[a] < 0.0) != (values[b] < 0.0);

    // A vertex in every cell that the surface crosses, in the mean of where it crosses the edges.
    // The cell has the index of its lowest node.
    let mut positions = Vec::new();
    let mut vertices = vec![usize::MAX; count];
    for (cell, vertex) in vertices.iter_mut().enumerate() {
        let at = coordinates(cell);
        if (0..3).any(|axis| at[axis] + 1 == nodes[axis]) {
            continue;
        }
        let (mut sum, mut crossings) = (DVec3::ZERO, 0.0);
        for axis in 0..3 {
            let (u, v) = (stride[(axis + 1) % 3], stride[(axis + 2) % 3]);
            for a in [cell, cell + u, cell + v, cell + u + v] {
                let b = a + stride[axis];
                if crosses(a, b) {
                    sum += places[a].lerp(places[b], values[a] / (values[a] - values[b]));
                    crossings += 1.0;
                }
            }
        }
        if crossings > 0.0 {
            *vertex = positions.len();
            positions.push(sum / crossings);
        }
    }

    // A quad for every edge that the surface crosses, of the four cells around the edge.
    let mut faces = Vec::new();
    for (a, value) in values.iter().enumerate() {
        let at = coordinates(a);
        for axis in 0..3 {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            if at[axis] + 1 == nodes[axis] || !crosses(a, a + stride[axis]) {
                continue;
            }
            assert!(at[u] > 0 && at[v] > 0, "the surface leaves the grid");
            let (u, v) = (stride[u], stride[v]);
            let mut quad = [a - u - v, a - v, a, a - u].map(|cell| vertices[cell]);
            assert!(!quad.contains(&usize::MAX), "the surface leaves the grid");
            if *value >= 0.0 {
                quad.reverse();
            }
            faces.push(quad.to_vec());
        }
    }
    Polygons { positions, faces }
}

/// Moves vertices to the middle of their neighbours and back onto the surface.
pub fn relax(mesh: &mut Polygons, rounds: usize, field: impl Fn(DVec3) -> f64) {
    for _ in 0..rounds {
        let mut sums = vec![(DVec3::ZERO, 0.0); mesh.positions.len()];
        for face in &mesh.faces {
            for i in 0..face.len() {
                let (a, b) = (face[i], face[(i + 1) % face.len()]);
                sums[a].0 += mesh.positions[b];
                sums[a].1 += 1.0;
            }
        }
        for (position, (sum, count)) in mesh.positions.iter_mut().zip(sums) {
            *position = project(position.lerp(sum / count, 0.5), &field);
        }
    }
}

/// Moves vertices at random along the surface, up to `distance` along each axis.
pub fn jitter(mesh: &mut Polygons, distance: f64, field: impl Fn(DVec3) -> f64) {
    for (vertex, position) in mesh.positions.iter_mut().enumerate() {
        let offset = [0, 1, 2].map(|axis| 2.0 * random([vertex as i64, axis, 0]) - 1.0);
        *position = project(*position + distance * DVec3::from(offset), &field);
    }
}

/// A point of the surface near `at`.
fn project(mut at: DVec3, field: &impl Fn(DVec3) -> f64) -> DVec3 {
    for _ in 0..3 {
        let slope = gradient(at, field);
        at -= field(at) / slope.length_squared() * slope;
    }
    at
}

pub fn gradient(at: DVec3, field: &impl Fn(DVec3) -> f64) -> DVec3 {
    const STEP: f64 = 1e-4;
    let along = |axis: DVec3| field(at + STEP * axis) - field(at - STEP * axis);
    DVec3::from(DVec3::AXES.map(along)) / (2.0 * STEP)
}
