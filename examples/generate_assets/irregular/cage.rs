//! A head for subdivision.

use super::implicit::{carve, ellipsoid, limb, relax, surface_nets, union};
use glam::DVec3;

/// Head of a monkey that looks along +z, 1.2 m wide with its ears: a cage for subdivision, finer at the face, without
/// normals. Quads where they are nearly flat, triangles elsewhere.
pub fn cage() -> String {
    const NODES: [usize; 3] = [20, 15, 14];
    /// Largest bend of a quad, rad.
    const BEND: f64 = 0.4;
    let place = |node: DVec3| {
        let last = DVec3::from(NODES.map(|n| n as f64)) - 1.0;
        let DVec3 { x, y, z } = 2.0 * node / last - 1.0;
        DVec3::new(
            0.72 * x,
            0.5 + 0.4 * y + 0.2 * y.powi(3),
            0.6 * z + 0.15 * (1.0 - z * z),
        )
    };
    let mut mesh = surface_nets(NODES, place, head);
    relax(&mut mesh, 4, head);
    mesh.put_down();
    mesh.cut_quads(|[first, second]| {
        let is_bent = first.max(second) > BEND;
        is_bent.then_some(usize::from(second < first))
    });
    mesh.without_normals("cage of a head: 1.2 m wide")
}

fn head(at: DVec3) -> f64 {
    let at = DVec3::new(at.x.abs(), at.y, at.z);
    let ear = carve(
        0.02,
        ellipsoid(at, [0.44, 0.58, -0.08], [0.2, 0.2, 0.08]),
        ellipsoid(at, [0.47, 0.58, 0.03], [0.13, 0.13, 0.07]),
    );
    let skull = union(
        0.03,
        &[
            ellipsoid(at, [0.0, 0.62, -0.06], [0.36, 0.34, 0.38]),
            ellipsoid(at, [0.14, 0.42, 0.12], [0.16, 0.14, 0.2]),
            ellipsoid(at, [0.0, 0.28, 0.2], [0.22, 0.17, 0.22]),
        ],
    );
    let skull = carve(
        0.02,
        skull,
        ellipsoid(at, [0.15, 0.56, 0.36], [0.1, 0.1, 0.14]),
    );
    union(
        0.03,
        &[
            skull,
            ear,
            limb(at, [[0.03, 0.67, 0.29], [0.24, 0.69, 0.21]], [0.06, 0.05]),
            ellipsoid(at, [0.0, 0.44, 0.34], [0.07, 0.06, 0.09]),
        ],
    )
}
