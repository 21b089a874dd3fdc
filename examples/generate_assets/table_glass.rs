//! A magnifying glass, and wine in a stemmed glass: surfaces of revolution.

use super::obj::Obj;
use super::{GAP, around, line, reversed};
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// Every mesh: path under `assets/`, content.
pub fn all() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("meshes/lens.obj", lens().into()),
        ("meshes/lens_frame.obj", lens_frame().into()),
        ("meshes/wine_glass.obj", wine_glass().into()),
        ("meshes/wine.obj", wine().into()),
    ]
}

/// Radius of the lens, m.
const LENS: f64 = 0.25;

/// Biconvex lens around the origin, its axis y: faces of radius 0.72 m, 10 mm thick at the edge.
fn lens() -> String {
    const FACE: f64 = 0.72;
    const EDGE: f64 = 0.01;
    const CELLS: [usize; 2] = [64, 12];
    let mut obj = Obj::new("lens: radius 0.25 m, faces of radius 0.72 m, 10 mm thick at the edge");
    let widest = (LENS / FACE).asin();
    let depth = FACE * widest.cos();
    for side in [-1.0, 1.0] {
        obj.grid(CELLS, |i, j| {
            // From the axis to the edge; the front faces outward.
            let out = around(side * TAU * (i % CELLS[0]) as f64 / CELLS[0] as f64);
            let (sine, cosine) = (widest * j as f64 / CELLS[1] as f64).sin_cos();
            let normal = sine * out + side * cosine * DVec3::Y;
            (
                FACE * normal - side * (depth - EDGE / 2.0) * DVec3::Y,
                normal,
            )
        });
    }
    let edge = [-EDGE / 2.0, EDGE / 2.0].map(|height| DVec2::new(FACE * widest.sin(), height));
    obj.lathe(line(edge[0], edge[1]), [CELLS[0], 1]);
    obj.text
}

/// A ring that the edge of the lens reaches 4 mm into, and a handle along +x.
fn lens_frame() -> String {
    const TUBE: f64 = 0.014;
    const HANDLE: [f64; 2] = [0.26, 0.62];
    let mut obj = Obj::new("frame and handle of the lens");
    obj.grid([64, 12], |i, j| {
        let out = around(-TAU * (i % 64) as f64 / 64.0);
        let (sine, cosine) = (TAU * (j % 12) as f64 / 12.0).sin_cos();
        let normal = cosine * out + sine * DVec3::Y;
        ((LENS + TUBE - 0.004) * out + TUBE * normal, normal)
    });
    let across = |i: usize| {
        let (sine, cosine) = (TAU * (i % 16) as f64 / 16.0).sin_cos();
        DVec3::new(0.0, cosine, sine)
    };
    obj.grid([16, 1], |i, j| {
        (HANDLE[j] * DVec3::X + 0.02 * across(i), across(i))
    });
    let end: Vec<String> = (0..16)
        .map(|i| obj.corner(HANDLE[1] * DVec3::X + 0.02 * across(i), DVec3::X))
        .collect();
    obj.face(&end);
    obj.text
}

/// Quads around the wine glass.
const AROUND: usize = 80;

/// Radius and height of the bowl where it is widest, outside and inside.
const WIDEST: [DVec2; 2] = [DVec2::new(0.36, 0.70), DVec2::new(0.338, 0.70)];

fn bezier(points: [(f64, f64); 4]) -> [DVec2; 4] {
    points.map(DVec2::from)
}

/// Stemmed glass on y = 0 around the y axis, 1.07 m high.
fn wine_glass() -> String {
    let mut obj = Obj::new(
        "wine glass: bowl of radius 0.36 m, stem of 0.035 m, foot of 0.36 m, height 1.07 m",
    );
    let [outside, inside] = WIDEST.map(|p| (p.x, p.y));
    let rim = [(0.285, 1.06), (0.265, 1.06)];
    for (curve, rows) in [
        (line(DVec2::new(0.0, GAP), DVec2::new(0.345, GAP)), 3),
        (
            bezier([(0.345, GAP), (0.366, GAP), (0.366, 0.026), (0.34, 0.028)]),
            4,
        ),
        (
            bezier([(0.34, 0.028), (0.16, 0.045), (0.035, 0.05), (0.035, 0.2)]),
            10,
        ),
        (line(DVec2::new(0.035, 0.2), DVec2::new(0.035, 0.38)), 3),
        (
            bezier([(0.035, 0.38), (0.035, 0.46), (0.36, 0.42), outside]),
            14,
        ),
        (bezier([outside, (0.36, 0.86), (0.3, 0.96), rim[0]]), 7),
        (bezier([rim[0], (0.283, 1.073), (0.267, 1.073), rim[1]]), 5),
        (bezier([rim[1], (0.28, 0.96), (0.338, 0.86), inside]), 7),
        (
            bezier([inside, (0.338, 0.5), (0.13, 0.455), (0.0, 0.455)]),
            12,
        ),
    ] {
        obj.lathe(curve, [AROUND, rows]);
    }
    obj.text
}

/// What fills the bowl. It reaches into the middle of its wall, which displaces it.
fn wine() -> String {
    const SURFACE: f64 = 0.74;
    let mut obj = Obj::new("what fills the wine glass up to 0.74 m: reaches into its wall");
    let side = [DVec2::new(0.349, 0.70), DVec2::new(0.348, SURFACE)];
    let bottom = bezier([(0.349, 0.70), (0.349, 0.49), (0.14, 0.445), (0.0, 0.445)]);
    obj.lathe(reversed(bottom), [AROUND, 12]);
    obj.lathe(line(side[0], side[1]), [AROUND, 1]);
    obj.lathe(line(side[1], DVec2::new(0.0, SURFACE)), [AROUND, 3]);
    obj.text
}
