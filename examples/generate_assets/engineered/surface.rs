//! The height field that refracts parallel light into a picture.
//!
//! Light comes along the axis through the flat face, leaves the glass at the height h(x) toward a wall at the distance D, and
//! lands at
//!
//! ```text
//! y(x) = x + (D − h) t⊥/t∥,   t the direction refracted at the normal (−∇h, 1)
//! ```
//!
//! The wall has the irradiance g if every cell of the plate, of area a, gets the image that g makes as bright: with A the
//! area of the image, r = ln(g(y) A / a) is zero. To first order ln A/a = D (n − 1) ∇²h, so that solving
//!
//! ```text
//! ∇²δ = −r / (D (n − 1)),   ∂δ/∂n = 0 at the edge,
//! ```
//!
//! and adding a part of δ to h, again and again, makes it so: a Newton iteration on the Monge–Ampère equation with the Poisson
//! equation in place of its derivative (compare Y. Yue, K. Iwasaki, B.-Y. Chen, Y. Dobashi, T. Nishita, *Poisson-based
//! continuous surface generation for goal-based caustics*, ACM Trans. Graph. 33(3), 2014; Y. Schwartzburg, R. Testuz,
//! A. Tagliasacchi, M. Pauly, *High-contrast computational caustic design*, ACM Trans. Graph. 33(4), 2014). The edge
//! of the plate throws its light on the edge of the picture, at every distance.

use glam::{DVec2, DVec3};
use std::f64::consts::PI;

/// What is to be solved. Lengths in metres.
pub struct Plate {
    /// Cells on a side.
    pub cells: usize,
    /// Of the plate and the picture.
    pub side: f64,
    /// To the wall, from h = 0.
    pub distance: f64,
    /// Index of refraction.
    pub ior: f64,
}

/// Share of δ that is added to h: all of it overshoots where light is gathered, as the images there are small.
const STEP: f64 = 0.4;
const STEPS: usize = 60;

/// Heights and their gradients at the (cells + 1)² corners of cells, rows from y = −side/2 up, x from −side/2.
pub struct Surface {
    pub heights: Vec<f64>,
    pub gradients: Vec<DVec2>,
}

impl Plate {
    /// The surface for a picture: irradiance relative to its mean by place, from −1 to 1 along x and y.
    pub fn solve(&self, picture: impl Fn(DVec2) -> f64) -> Surface {
        let n = self.cells;
        let cosines = Cosines::new(n);
        // In the middles of cells.
        let mut heights = vec![0.0; n * n];
        for _ in 0..STEPS {
            let images = self.images(&self.gradients(&heights), &self.at_corners(&heights));
            let mut right: Vec<f64> = (0..n * n)
                .map(|cell| {
                    let corners = self.corners(cell).map(|corner| images[corner]);
                    let middle = corners.iter().sum::<DVec2>() / 4.0;
                    let diagonals = [corners[2] - corners[0], corners[3] - corners[1]];
                    let area = 0.5 * diagonals[0].perp_dot(diagonals[1]);
                    let spread = area / self.cell().powi(2);
                    // Where images fold, the smallest spread that unfolds them.
                    (picture(2.0 * middle / self.side) * spread.max(0.01)).ln()
                })
                .collect();
            let mean = right.iter().sum::<f64>() / (n * n) as f64;
            right.iter_mut().for_each(|r| *r -= mean);
            let factor = -STEP / (self.distance * (self.ior - 1.0));
            let step = cosines.solve_poisson(&right, self.cell());
            heights
                .iter_mut()
                .zip(&step)
                .for_each(|(height, step)| *height += factor * step);
        }
        Surface {
            heights: self.at_corners(&heights),
            gradients: self.gradients(&heights),
        }
    }

    fn cell(&self) -> f64 {
        self.side / self.cells as f64
    }

    /// Where a corner of cells is.
    pub fn place(&self, corner: usize) -> DVec2 {
        let columns = self.cells + 1;
        let at = DVec2::new((corner % columns) as f64, (corner / columns) as f64);
        self.cell() * at - DVec2::splat(self.side / 2.0)
    }

    /// The corners of a cell, counter-clockwise.
    fn corners(&self, cell: usize) -> [usize; 4] {
        let columns = self.cells + 1;
        let first = cell / self.cells * columns + cell % self.cells;
        [first, first + 1, first + columns + 1, first + columns]
    }

    /// The four values around a corner, from those in the middles of cells, which continue mirrored beyond the edge: [y][x].
    fn around(&self, heights: &[f64], corner: usize) -> [[f64; 2]; 2] {
        let columns = self.cells + 1;
        let (i, j) = (corner % columns, corner / columns);
        let inside = |i: usize| [i.max(1) - 1, i.min(self.cells - 1)];
        inside(j).map(|j| inside(i).map(|i| heights[j * self.cells + i]))
    }

    fn at_corners(&self, heights: &[f64]) -> Vec<f64> {
        let mean = |corner| {
            self.around(heights, corner)
                .as_flattened()
                .iter()
                .sum::<f64>()
                / 4.0
        };
        (0..(self.cells + 1).pow(2)).map(mean).collect()
    }

    fn gradients(&self, heights: &[f64]) -> Vec<DVec2> {
        let gradient = |corner| {
            let [[a, b], [c, d]] = self.around(heights, corner);
            DVec2::new(b + d - a - c, c + d - a - b) / (2.0 * self.cell())
        };
        (0..(self.cells + 1).pow(2)).map(gradient).collect()
    }

    /// Where the light of the corners lands on the wall.
    fn images(&self, gradients: &[DVec2], heights: &[f64]) -> Vec<DVec2> {
        (gradients.iter().zip(heights).enumerate())
            .map(|(corner, (gradient, height))| {
                let normal = (-*gradient).extend(1.0).normalize();
                let sine_squared = self.ior * self.ior * (1.0 - normal.z * normal.z);
                let along = (1.0 - sine_squared).max(0.0).sqrt() - self.ior * normal.z;
                let sent = self.ior * DVec3::Z + along * normal;
                self.place(corner) + (self.distance - height) / sent.z * sent.truncate()
            })
            .collect()
    }
}

/// Cosines by frequency and place, for the discrete cosine transform, which diagonalises the Laplacian between mirrored edges.
struct Cosines {
    n: usize,
    table: Vec<f64>,
}

impl Cosines {
    fn new(n: usize) -> Self {
        let table = (0..n * n)
            .map(|i| (PI * (i / n) as f64 * ((i % n) as f64 + 0.5) / n as f64).cos())
            .collect();
        Self { n, table }
    }

    /// δ with ∇²δ = `right`, of mean 0, in cells of a width.
    fn solve_poisson(&self, right: &[f64], width: f64) -> Vec<f64> {
        let n = self.n;
        let forward = |values: &[f64]| self.transform(values, |k, x| self.table[k * n + x]);
        let back = |values: &[f64]| self.transform(values, |x, k| self.table[k * n + x]);
        let mut waves = forward(&forward(right));
        for (i, wave) in waves.iter_mut().enumerate() {
            let (k, l) = (i % n, i / n);
            let curvature = |k: usize| 2.0 - 2.0 * (PI * k as f64 / n as f64).cos();
            // Sums of squares of cosines.
            let norm = |k: usize| if k == 0 { n as f64 } else { n as f64 / 2.0 };
            *wave = match i {
                0 => 0.0,
                _ => -*wave * width * width / ((curvature(k) + curvature(l)) * norm(k) * norm(l)),
            };
        }
        back(&back(&waves))
    }

    /// Multiplies the rows with a matrix, and transposes.
    fn transform(&self, values: &[f64], matrix: impl Fn(usize, usize) -> f64) -> Vec<f64> {
        let n = self.n;
        let mut out = vec![0.0; n * n];
        for to in 0..n {
            let weights: Vec<f64> = (0..n).map(|from| matrix(to, from)).collect();
            for (row, values) in values.chunks_exact(n).enumerate() {
                out[to * n + row] = values.iter().zip(&weights).map(|(a, b)| a * b).sum();
            }
        }
        out
    }
}
