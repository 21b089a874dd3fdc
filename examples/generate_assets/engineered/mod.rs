//! A clear plate, flat in front and shaped behind, that throws a picture on a wall in parallel light.

mod picture;
mod surface;

use super::obj::{Obj, rounded};
use glam::{DVec2, DVec3};
use image::{ExtendedColorType, ImageEncoder, codecs::png::PngEncoder};
use nephroid::srgb::encode;
use surface::{Plate, Surface};

/// The plate of `engineered.toml`, m. The glass is BK7, its index that of the d line.
const PLATE: Plate = Plate {
    cells: 125,
    side: 0.4,
    distance: 0.8,
    ior: 1.5168,
};
/// Height of the flat face over the middle of the shaped one, and least thickness, m.
const FLAT: f64 = 0.03;
const LEAST_THICKNESS: f64 = 0.005;

/// The plate and the picture: path under `assets/`, content.
pub fn all() -> Vec<(&'static str, Vec<u8>)> {
    let picture = picture::irradiance();
    let surface = PLATE.solve(|at| picture::value(&picture, at));
    vec![
        ("meshes/engineered.obj", obj(&surface).into()),
        ("meshes/board.obj", board().into()),
        ("targets/engineered.png", png(&picture)),
    ]
}

/// The picture in sRGB, its brightest pixel white.
fn png(picture: &[f64]) -> Vec<u8> {
    let white = picture.iter().copied().fold(0.0, f64::max);
    let pixels: Vec<u8> = picture.iter().map(|value| encode(value / white)).collect();
    let side = picture::SIDE as u32;
    let mut content = Vec::new();
    PngEncoder::new(&mut content)
        .write_image(&pixels, side, side, ExtendedColorType::L8)
        .expect("memory takes any image");
    content
}

/// The plate in its own frame: x to the right and y up in the picture, light comes along −z. A micrometre is fine enough for
/// heights, and 5e-6 for slopes, which move light on the wall by 2 µm.
fn obj(surface: &Surface) -> String {
    let columns = PLATE.cells + 1;
    let deepest = (surface.heights.iter().copied()).fold(f64::INFINITY, f64::min);
    assert!(FLAT + deepest > LEAST_THICKNESS, "{deepest}");
    let mut text = String::from(
        "# clear plate, flat in front and shaped behind: throws targets/engineered.png on a wall 0.8 m behind; made by \
         examples/generate_assets\n",
    );
    let vertex = |at: DVec2, z: f64| {
        let [x, y] = at.to_array().map(|x| rounded(x, 4));
        format!("v {x} {y} {}\n", rounded(z, 6))
    };
    for corner in 0..columns * columns {
        let slope = -surface.gradients[corner];
        text += &vertex(PLATE.place(corner), -surface.heights[corner]);
        let [x, y] = slope.to_array().map(|x| rounded(x, 5));
        text += &format!("vn {x} {y} -1\n");
        if corner >= columns && corner % columns > 0 {
            // Counted back from the newest corner, counter-clockwise from behind.
            let quad = [columns + 2, 2, 1, columns + 1];
            text += &face(&quad.map(|back| [-(back as i64); 2]));
        }
    }
    let half = PLATE.side / 2.0;
    let flat = columns * columns + 1;
    for (x, y) in [(-half, -half), (half, -half), (half, half), (-half, half)] {
        text += &vertex(DVec2::new(x, y), FLAT);
    }
    text += "vn 0 0 1\nvn 0 -1 0\nvn 1 0 0\nvn 0 1 0\nvn -1 0 0\n";
    let corner = |position: usize, normal: usize| [position as i64, (flat + normal) as i64];
    text += &face(&[0, 1, 2, 3].map(|i| corner(flat + i, 0)));
    // Each side is two fans, around its two flat corners.
    for side in 0..4 {
        let [from, to] = [flat + side, flat + (side + 1) % 4];
        let shaped = |along: usize| match side {
            0 => 1 + along,
            1 => columns * (along + 1),
            2 => columns * columns - along,
            _ => 1 + columns * (PLATE.cells - along),
        };
        let middle = PLATE.cells / 2;
        for i in 0..PLATE.cells {
            let around = if i < middle { from } else { to };
            text += &face(&[around, shaped(i), shaped(i + 1)].map(|c| corner(c, side + 1)));
        }
        text += &face(&[from, shaped(middle), to].map(|c| corner(c, side + 1)));
    }
    text
}

/// A board with a hole as large as the plate, 1 mm before its flat face.
fn board() -> String {
    const OUTSIDE: [DVec2; 2] = [DVec2::new(-0.45, -0.32), DVec2::new(0.45, 0.32)];
    const LAYERS: [f64; 2] = [FLAT + 0.001, FLAT + 0.016];
    let mut obj = Obj::new("board with a square hole");
    let hole = [-0.5, 0.5].map(|half| DVec2::splat(half * PLATE.side));
    // Counter-clockwise, seen from the light.
    let ring = |[low, high]: [DVec2; 2]| {
        [
            low,
            DVec2::new(high.x, low.y),
            high,
            DVec2::new(low.x, high.y),
        ]
    };
    let [inner, outer] = [ring(hole), ring(OUTSIDE)];
    for side in 0..4 {
        let next = (side + 1) % 4;
        let out = -(outer[next] - outer[side]).perp().normalize().extend(0.0);
        let [behind, before] = LAYERS;
        for (corners, normal) in [
            (
                [
                    (outer, side, before),
                    (outer, next, before),
                    (inner, next, before),
                    (inner, side, before),
                ],
                DVec3::Z,
            ),
            (
                [
                    (outer, next, behind),
                    (outer, side, behind),
                    (inner, side, behind),
                    (inner, next, behind),
                ],
                -DVec3::Z,
            ),
            (
                [
                    (outer, side, behind),
                    (outer, next, behind),
                    (outer, next, before),
                    (outer, side, before),
                ],
                out,
            ),
            (
                [
                    (inner, next, behind),
                    (inner, side, behind),
                    (inner, side, before),
                    (inner, next, before),
                ],
                -out,
            ),
        ] {
            let corners =
                corners.map(|(ring, at, layer)| obj.corner(ring[at].extend(layer), normal));
            obj.face(&corners);
        }
    }
    obj.text
}

/// Of [position, normal].
fn face(corners: &[[i64; 2]]) -> String {
    let corners: Vec<String> = (corners.iter())
        .map(|[position, normal]| format!("{position}//{normal}"))
        .collect();
    format!("f {}\n", corners.join(" "))
}
