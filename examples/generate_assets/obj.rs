//! Writes OBJ files.

use glam::{DVec2, DVec3};
use std::collections::HashMap;
use std::f64::consts::TAU;

use super::around;

/// An OBJ file under construction. Equal positions and equal normals are written once.
pub struct Obj {
    pub text: String,
    positions: Lines,
    normals: Lines,
}

/// Lines of one keyword: the numbers of those that may be shared, and how many there are.
#[derive(Default)]
struct Lines {
    shared: HashMap<String, usize>,
    count: usize,
}

impl Obj {
    pub fn new(comment: &str) -> Self {
        Self {
            text: format!("# {comment}; made by examples/generate_assets\n"),
            positions: Lines::default(),
            normals: Lines::default(),
        }
    }

    /// From now on writes new vertices, even where equal ones were written before.
    pub fn stop_sharing(&mut self) {
        self.positions.shared.clear();
        self.normals.shared.clear();
    }

    /// The corner `position//normal` of a face.
    pub fn corner(&mut self, position: DVec3, normal: DVec3) -> String {
        let position = self.corner_without_normal(position);
        let normal = self.normals.index("vn", normal, &mut self.text);
        format!("{position}//{normal}")
    }

    /// The corner `position` of a face without normals.
    pub fn corner_without_normal(&mut self, position: DVec3) -> String {
        let index = self.positions.index("v", position, &mut self.text);
        index.to_string()
    }

    /// Corners counter-clockwise from the front.
    pub fn face(&mut self, corners: &[String]) {
        self.text += &format!("f {}\n", corners.join(" "));
    }

    /// Quads of a grid of `point(i, j)` → (position, normal), i and j up to and including
    /// `cells`; the front is where i turns to j counter-clockwise.
    pub fn grid(&mut self, cells: [usize; 2], point: impl Fn(usize, usize) -> (DVec3, DVec3)) {
        for j in 0..cells[1] {
            for i in 0..cells[0] {
                let quad = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
                let corners = quad.map(|(i, j)| {
                    let (position, normal) = point(i, j);
                    self.corner(position, normal)
                });
                // On an axis two corners are one.
                let mut corners = corners.to_vec();
                corners.dedup();
                self.face(&corners);
            }
        }
    }

    /// Surface that a cubic Bézier curve of (radius, height) sweeps about the y axis, `cells` around and
    /// along the curve. The front is to the right of the curve, drawn with the radius to the
    /// right and the height upward.
    pub fn lathe(&mut self, [a, b, c, d]: [DVec2; 4], cells: [usize; 2]) {
        self.grid(cells, |i, j| {
            let t = j as f64 / cells[1] as f64;
            let (ab, bc, cd) = (a.lerp(b, t), b.lerp(c, t), c.lerp(d, t));
            let (abc, bcd) = (ab.lerp(bc, t), bc.lerp(cd, t));
            let (at, normal) = (abc.lerp(bcd, t), -(bcd - abc).perp().normalize());
            let out = around(-TAU * (i % cells[0]) as f64 / cells[0] as f64);
            let place = |p: DVec2| p.x * out + p.y * DVec3::Y;
            (place(at), place(normal))
        });
    }

    /// Quads of a grid of `cells`² over the square [−1, 1]². `point` → (position, normal) maps the square to a round
    /// surface with [`concentric`](super::concentric).
    pub fn disc(&mut self, cells: usize, point: impl Fn(DVec2) -> (DVec3, DVec3)) {
        let side = |i: usize| 2.0 * i as f64 / cells as f64 - 1.0;
        for j in 0..cells {
            for i in 0..cells {
                let mut quad = [(i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1)];
                // Readers cut a quad into a fan from its first corner. The diagonals point to the centre: the others
                // would make slivers of three points of the rim on the square's diagonals.
                if (i < cells / 2) != (j < cells / 2) {
                    quad.rotate_left(1);
                }
                let corners = quad.map(|(i, j)| {
                    let (position, normal) = point(DVec2::new(side(i), side(j)));
                    self.corner(position, normal)
                });
                self.face(&corners);
            }
        }
    }
}

impl Lines {
    /// Number of the line with `value`, which is added to `text` where it is new.
    fn index(&mut self, keyword: &str, value: DVec3, text: &mut String) -> usize {
        let line = format!("{keyword} {}\n", value.to_array().map(number).join(" "));
        if let Some(index) = self.shared.get(&line) {
            return *index;
        }
        *text += &line;
        self.count += 1;
        self.shared.insert(line, self.count);
        self.count
    }
}

/// Seven decimals, 0.1 µm.
fn number(value: f64) -> String {
    rounded(value, 7)
}

/// Decimals without trailing zeros. Rounding also hides what differs between mathematical libraries.
pub fn rounded(value: f64, decimals: usize) -> String {
    let text = format!("{value:.decimals$}");
    let text = text.trim_end_matches('0').trim_end_matches('.');
    if text == "-0" { "0" } else { text }.into()
}
