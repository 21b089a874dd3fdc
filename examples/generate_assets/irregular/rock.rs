//! A chipped stone.

use super::super::icosphere;
use super::{Polygons, noise, random};
use glam::DVec3;
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Stone, 1 m wide: an icosphere of 5120 triangles with hollows, as of chipped flint. Creases
/// separate the hollows; vertices there have one normal for each side.
pub fn rock() -> String {
    let chips = chips();
    let (mut directions, triangles) = icosphere(4);
    move_onto_creases(&mut directions, &triangles, &chips);
    let position = |direction: &DVec3| {
        let (distance, _) = surface(*direction, &chips);
        (distance + 0.004 * noise(6.0 * *direction)) * *direction
    };
    let mut mesh = Polygons {
        positions: directions.iter().map(position).collect(),
        faces: triangles.iter().map(|corners| corners.to_vec()).collect(),
    };
    mesh.put_down();
    let normals = mesh.normals(20f64.to_radians());
    mesh.with_normals("chipped stone: 1 m wide", &normals)
}

/// A ball that leaves a hollow in the stone.
struct Chip {
    centre: DVec3,
    radius: f64,
}

/// In directions all around, on a Fibonacci lattice.
fn chips() -> Vec<Chip> {
    const COUNT: i64 = 26;
    let golden_angle = TAU * (1.0 - 2.0 / (1.0 + 5f64.sqrt()));
    let chip = |i: i64| {
        let [side, nearest, radius] = [0, 1, 2].map(|k| random([i, k, 7]));
        let height = 1.0 - (2.0 * i as f64 + 1.0) / COUNT as f64;
        let (sine, cosine) = (golden_angle * (i as f64 + 0.5 * side)).sin_cos();
        let level = (1.0 - height * height).sqrt();
        let radius = 0.45 + 0.5 * radius;
        let out = DVec3::new(level * cosine, height, level * sine);
        // From the middle of the stone, which is wider than high.
        let nearest = (0.36 + 0.08 * nearest) * (1.0 - 0.2 * height * height);
        Chip {
            centre: (nearest + radius) * out,
            radius,
        }
    };
    (0..COUNT).map(chip).collect()
}

/// Distance from the middle to the surface, and the number of the chip whose hollow is there.
fn surface(direction: DVec3, chips: &[Chip]) -> (f64, usize) {
    const UNCHIPPED: f64 = 0.55;
    let mut first = (UNCHIPPED, usize::MAX);
    for (number, chip) in chips.iter().enumerate() {
        let along = direction.dot(chip.centre);
        let square = along * along - chip.centre.length_squared() + chip.radius * chip.radius;
        if along > 0.0 && square > 0.0 && along - square.sqrt() < first.0 {
            first = (along - square.sqrt(), number);
        }
    }
    first
}

/// Moves the nearer end of each edge that crosses a crease onto the crease, which would otherwise be as jagged as the
/// triangles.
fn move_onto_creases(directions: &mut [DVec3], triangles: &[[usize; 3]], chips: &[Chip]) {
    // By vertex, the nearest crossing: how far along the edge, at most 0.4 of it, and where.
    let mut crossings: BTreeMap<usize, (f64, DVec3)> = BTreeMap::new();
    for corners in triangles {
        for i in 0..3 {
            let (from, to) = (corners[i], corners[(i + 1) % 3]);
            let [a, b] = [from, to].map(|vertex| directions[vertex]);
            let along = |t: f64| a.lerp(b, t).normalize();
            let chip = surface(a, chips).1;
            if surface(b, chips).1 == chip {
                continue;
            }
            let (mut low, mut high) = (0.0, 1.0);
            for _ in 0..30 {
                let t = (low + high) / 2.0;
                match surface(along(t), chips).1 == chip {
                    true => low = t,
                    false => high = t,
                }
            }
            let crossing = crossings.entry(from).or_insert((0.4, a));
            if low < crossing.0 {
                *crossing = (low, along(low));
            }
        }
    }
    for (vertex, (_, place)) in crossings {
        directions[vertex] = place;
    }
}
