//! Scenes drawn at random, so that figures do not depend on scenes that we have seen while building.

use super::scenes::{horizontal, scene, sun};
use crate::reference::split_mix;
use crate::scene::{Light, LightKind, Mesh, Scene};
use glam::DVec3;
use std::f64::consts::{FRAC_PI_2, PI, TAU};

/// Half a side of the floor, m.
const FLOOR: f64 = 2.5;

/// A mirror of random shape, triangles and reflectance that stands or hovers over a floor, under one to three suns and
/// lamps. The same number gives the same scene.
pub fn random_scene(number: u32) -> Scene {
    let mut random = Random {
        seed: u64::from(number),
        drawn: 0,
    };
    let mesh = mesh(&mut random);
    let lights = (0..random.below(3) + 1)
        .map(|_| light(&mut random))
        .collect();
    let mut scene = scene(mesh, lights, horizontal(FLOOR, 0.0));
    for object in &mut scene.objects {
        object.blocks_light = true;
    }
    scene
}

/// Numbers that depend on the seed and on how many were drawn.
struct Random {
    seed: u64,
    drawn: u64,
}

impl Random {
    /// In [0, 1).
    fn unit(&mut self) -> f64 {
        self.drawn += 1;
        (split_mix(self.seed << 32 | self.drawn) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Even in its logarithm.
    fn scale(&mut self, low: f64, high: f64) -> f64 {
        low * (high / low).powf(self.unit())
    }

    fn below(&mut self, count: u32) -> u32 {
        (self.unit() * f64::from(count)) as u32
    }

    fn direction(&mut self) -> DVec3 {
        let height = self.between(-1.0, 1.0);
        let (sine, cosine) = self.between(0.0, TAU).sin_cos();
        let level = (1.0 - height * height).sqrt();
        DVec3::new(level * cosine, height, level * sine)
    }
}

/// A sun or lamp above the floor, of random size, from a point of light to 2.5°.
fn light(random: &mut Random) -> Light {
    let elevation = random.between(20.0, 80.0).to_radians();
    let azimuth = random.between(0.0, TAU);
    let direction = DVec3::new(
        elevation.cos() * azimuth.cos(),
        elevation.sin(),
        elevation.cos() * azimuth.sin(),
    );
    let brightness = random.between(0.3, 1.0);
    let degrees = match random.below(4) {
        0 => 0.0,
        _ => random.scale(0.1, 2.5),
    };
    if random.below(2) == 0 {
        return sun(direction, brightness, degrees);
    }
    let distance = random.between(3.0, 6.0);
    Light {
        name: "lamp".into(),
        kind: LightKind::Lamp {
            position: distance * direction,
            radius: distance * degrees.max(0.1).to_radians().sin(),
            radiant_flux: DVec3::splat(4.0 * PI * distance * distance * brightness),
        },
    }
}

/// Coordinates in [0, 1]² → place.
type Surface = fn(f64, f64) -> DVec3;

/// Closed surfaces that face outward, and one open one that faces up.
const SURFACES: [Surface; 4] = [ball, torus, pipe, sheet];

fn ball(u: f64, v: f64) -> DVec3 {
    let (sine, cosine) = (PI * v).sin_cos();
    0.5 * DVec3::new(sine * (TAU * u).sin(), -cosine, sine * (TAU * u).cos())
}

fn torus(u: f64, v: f64) -> DVec3 {
    let (around, tube) = (TAU * u, TAU * v - FRAC_PI_2);
    let radius = 0.45 + 0.17 * tube.cos();
    DVec3::new(
        radius * around.sin(),
        0.17 * tube.sin(),
        radius * around.cos(),
    )
}

/// A half pipe that lies on its side, open above.
fn pipe(u: f64, v: f64) -> DVec3 {
    let angle = PI * (v - 0.5);
    DVec3::new(1.2 * u - 0.6, -0.45 * angle.cos(), -0.45 * angle.sin())
}

fn sheet(u: f64, v: f64) -> DVec3 {
    DVec3::new(u - 0.5, 0.0, 0.5 - v)
}

/// A surface with random waves on a grid whose vertices are moved about, so that triangles are uneven and some are
/// slivers; smooth or facetted, turned at random, 0.3 m to 1.2 m large.
fn mesh(random: &mut Random) -> Mesh {
    let surface = SURFACES[random.below(SURFACES.len() as u32) as usize];
    let [columns, rows] = [0; 2].map(|_| random.scale(8.0, 90.0) as usize);
    let is_smooth = random.below(3) > 0;
    let unevenness = random.between(0.0, 0.8);
    let waves: Vec<(DVec3, f64, DVec3)> = (0..4)
        .map(|_| {
            let number = random.scale(2.0, 12.0);
            let slope = random.between(0.0, 0.15);
            (
                number * random.direction(),
                random.between(0.0, TAU),
                slope / number * random.direction(),
            )
        })
        .collect();
    let axis = random.direction();
    let turn = glam::DQuat::from_axis_angle(axis, random.between(0.0, 0.6));
    let size = random.scale(0.3, 1.2);

    let mut positions = Vec::new();
    for row in 0..=rows {
        for column in 0..=columns {
            // The border stays where it is, so that closed surfaces stay closed.
            let mut place = |index: usize, count: usize| {
                let inside = 0 < index && index < count;
                let aside = unevenness * (random.unit() - 0.5);
                (index as f64 + if inside { aside } else { 0.0 }) / count as f64
            };
            let (u, v) = (place(column, columns), place(row, rows));
            positions.push(surface(u, v));
        }
    }
    // The two ends of a row of a closed surface have places of their own. Its pole is where all u are one.
    for row in 0..=rows {
        let start = row * (columns + 1);
        let ends = [start, start + columns].map(|i| positions[i]);
        if ends[0].distance(ends[1]) < 0.1 {
            positions[start + columns] = positions[start];
        }
    }
    for position in &mut positions {
        let waves = waves
            .iter()
            .map(|(wave, phase, along)| *along * (wave.dot(*position) + phase).sin());
        *position = turn * (size * (*position + waves.sum::<DVec3>()));
    }
    let lowest = positions.iter().fold(f64::INFINITY, |y, p| y.min(p.y));
    let height = random.scale(0.005, 0.6);
    for position in &mut positions {
        position.y += height - lowest;
    }
    let index = |row: usize, column: usize| (row * (columns + 1) + column) as u32;
    let mut triangles = Vec::new();
    for row in 0..rows {
        for column in 0..columns {
            let [a, b, c, d] = [
                index(row, column),
                index(row, column + 1),
                index(row + 1, column + 1),
                index(row + 1, column),
            ];
            triangles.extend(match random.below(2) {
                0 => [[a, b, c], [a, c, d]],
                _ => [[b, c, d], [b, d, a]],
            });
        }
    }
    Mesh::of_triangles(&positions, &triangles, is_smooth)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Geometry;

    /// Closed surfaces face outward: their volume is positive.
    #[test]
    fn surfaces_face_the_light() {
        for (surface, is_closed) in SURFACES.into_iter().zip([true, true, false, false]) {
            let at = |i: usize, j: usize| surface(i as f64 / 32.0, j as f64 / 32.0);
            let (mut volume, mut upward) = (0.0, 0.0);
            for i in 0..32 {
                for j in 0..32 {
                    let [a, b, c, d] = [at(i, j), at(i + 1, j), at(i + 1, j + 1), at(i, j + 1)];
                    for [p, q, r] in [[a, b, c], [a, c, d]] {
                        volume += p.dot(q.cross(r)) / 6.0;
                        upward += (q - p).cross(r - p).y / 2.0;
                    }
                }
            }
            assert!(
                if is_closed {
                    volume > 0.1
                } else {
                    upward > 0.5
                },
                "{volume} {upward}"
            );
        }
    }

    #[test]
    fn scenes_are_their_own_and_sound() {
        for number in 0..40 {
            let mesh_of = |number| match &random_scene(number).objects[0].geometry {
                Geometry::Mesh(mesh) => mesh.clone(),
                _ => panic!("a mesh"),
            };
            let mesh = mesh_of(number);
            assert_eq!(mesh, mesh_of(number));
            assert_ne!(mesh, mesh_of(number + 1));
            assert!(mesh.triangles.len() >= 64, "{number}");
            assert!(mesh.bounds()[0].y > 0.004, "{number}");
            for (triangle, corners) in mesh.triangles.iter().enumerate() {
                let face = mesh.vector_area(triangle).normalize();
                assert!(
                    corners
                        .iter()
                        .all(|&c| mesh.normals[c as usize].dot(face) > 0.0)
                );
            }
        }
    }
}
