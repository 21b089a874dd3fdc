//! A coarse cow, as made for games.

use super::implicit::{ellipsoid, jitter, limb, relax, surface_nets, union};
use glam::DVec3;
use std::f64::consts::PI;

/// Cow that looks along +x, 1.3 m long: irregular triangles with one smooth normal at every vertex.
pub fn animal() -> String {
    // The cells at the legs are higher than the others.
    let place = |node: DVec3| {
        let from_belly = node.y - 4.0;
        let height = 0.36 + from_belly * if from_belly < 0.0 { 0.11 } else { 0.08 };
        DVec3::new(-0.72 + 0.08 * node.x, height, -0.4125 + 0.075 * node.z)
    };
    let mut mesh = surface_nets([19, 13, 12], place, cow);
    jitter(&mut mesh, 0.01, cow);
    relax(&mut mesh, 3, cow);
    mesh.put_down();
    mesh.cut_quads(|[first, second]| Some(usize::from(second < first)));
    let normals = mesh.normals(PI);
    mesh.with_normals("cow: 1.3 m long", &normals)
}

fn cow(at: DVec3) -> f64 {
    let ear = |side: f64| {
        let ends = [[0.44, 0.82, 0.06 * side], [0.4, 0.85, 0.2 * side]];
        limb(at, ends, [0.05, 0.055])
    };
    let leg = |x: f64, z: f64, stride: f64| {
        let [hip, knee, hoof] = [(0.0, 0.46), (stride, 0.27), (0.4 * stride, 0.06)]
            .map(|(forward, height)| [x + forward, height, z]);
        let distances = [
            limb(at, [hip, knee], [0.11, 0.07]),
            limb(at, [knee, hoof], [0.065, 0.065]),
        ];
        union(0.01, &distances)
    };
    union(
        0.025,
        &[
            limb(at, [[-0.28, 0.56, 0.0], [0.22, 0.56, 0.0]], [0.17, 0.17]),
            ellipsoid(at, [-0.05, 0.48, 0.0], [0.26, 0.16, 0.17]),
            limb(at, [[0.26, 0.62, 0.0], [0.46, 0.76, 0.0]], [0.13, 0.09]),
            limb(at, [[0.48, 0.8, 0.0], [0.64, 0.68, 0.0]], [0.09, 0.065]),
            ear(1.0),
            ear(-1.0),
            limb(at, [[-0.44, 0.66, 0.0], [-0.56, 0.6, 0.0]], [0.06, 0.06]),
            limb(at, [[-0.56, 0.6, 0.0], [-0.56, 0.36, 0.0]], [0.06, 0.055]),
            leg(0.24, 0.115, 0.05),
            leg(0.24, -0.115, -0.04),
            leg(-0.32, 0.115, -0.05),
            leg(-0.32, -0.115, 0.03),
        ],
    )
}
