//! A scanned figure.

use super::implicit::{ellipsoid, gradient, jitter, limb, relax, surface_nets, union};
use super::{noise, random};
use glam::DVec3;

/// Figure of a rabbit that looks along +z, 1.1 m high, as scanners deliver it: fine bumps, noise, irregular triangles
/// of about 1 cm, no normals.
pub fn scan() -> String {
    const CELL: f64 = 0.00905;
    let place = |node| DVec3::new(-0.41, -0.03, -0.5) + CELL * node;
    let mut mesh = surface_nets([92, 126, 102], place, rabbit);
    jitter(&mut mesh, 0.3 * CELL, rabbit);
    relax(&mut mesh, 2, rabbit);
    for (vertex, position) in mesh.positions.iter_mut().enumerate() {
        let out = gradient(*position, &rabbit).normalize();
        let bumps = 0.004 * noise(*position / 0.06) + 0.0012 * noise(*position / 0.025);
        let scanner_noise = 0.0003 * (random([vertex as i64, 0, 1]) - 0.5);
        *position += (bumps + scanner_noise) * out;
    }
    mesh.put_down();
    let mut quads = 0;
    mesh.cut_quads(|[first, second]| {
        quads += 1;
        // At random in favour of either diagonal, so that edges do not follow the shape alone.
        let preference = 4f64.powf(2.0 * random([quads, 0, 2]) - 1.0);
        Some(usize::from(second < preference * first))
    });
    mesh.without_normals("scan of a rabbit: 1.1 m high")
}

fn rabbit(at: DVec3) -> f64 {
    let mirrored = DVec3::new(at.x.abs(), at.y, at.z);
    union(
        0.02,
        &[
            ellipsoid(at, [0.0, 0.32, -0.08], [0.25, 0.31, 0.32]),
            ellipsoid(mirrored, [0.2, 0.2, -0.1], [0.13, 0.19, 0.24]),
            limb(
                mirrored,
                [[0.13, 0.3, 0.15], [0.11, 0.05, 0.24]],
                [0.09, 0.05],
            ),
            ellipsoid(at, [0.0, 0.66, 0.16], [0.17, 0.16, 0.21]),
            limb(
                mirrored,
                [[0.07, 0.78, 0.1], [0.13, 1.02, -0.04]],
                [0.055, 0.045],
            ),
            ellipsoid(at, [0.0, 0.2, -0.4], [0.08, 0.08, 0.08]),
        ],
    )
}
