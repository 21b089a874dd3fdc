//! Irregular meshes as modellers, scanners and CAD programs export them: closed, about 1 m large.
//! The other shipped meshes are regular grids, which hide the errors that uneven triangles cause.

mod animal;
mod cage;
mod implicit;
mod part;
mod rock;
mod scan;

use super::obj::Obj;
use glam::DVec3;
use std::collections::HashMap;

/// Path under `assets/`, content.
pub fn all() -> Vec<(&'static str, Vec<u8>)> {
    vec![
        ("meshes/mesh_rock.obj", rock::rock().into()),
        ("meshes/mesh_cage.obj", cage::cage().into()),
        ("meshes/mesh_scan.obj", scan::scan().into()),
        ("meshes/mesh_part.obj", part::part().into()),
        ("meshes/mesh_animal.obj", animal::animal().into()),
    ]
}

/// Height of the lowest points, so that no mesh reaches through a floor at 0, m.
const BOTTOM: f64 = 0.01;

/// Polygons with common vertices, counter-clockwise from outside.
struct Polygons {
    positions: Vec<DVec3>,
    faces: Vec<Vec<usize>>,
}

impl Polygons {
    fn without_normals(&self, comment: &str) -> String {
        let mut obj = Obj::new(comment);
        for face in &self.faces {
            let corners: Vec<_> = (face.iter())
                .map(|&vertex| obj.corner_without_normal(self.positions[vertex]))
                .collect();
            obj.face(&corners);
        }
        obj.text
    }

    /// `normals` has one for every corner of every face.
    fn with_normals(&self, comment: &str, normals: &[Vec<DVec3>]) -> String {
        let mut obj = Obj::new(comment);
        for (face, normals) in self.faces.iter().zip(normals) {
            let corners: Vec<_> = (face.iter().zip(normals))
                .map(|(&vertex, &normal)| obj.corner(self.positions[vertex], rounded(normal)))
                .collect();
            obj.face(&corners);
        }
        obj.text
    }

    /// Moves the lowest point to the height [`BOTTOM`], and rounds all positions, so that later decisions do not depend
    /// on the mathematical library.
    fn put_down(&mut self) {
        let lowest = (self.positions.iter()).fold(f64::INFINITY, |y, at| y.min(at.y));
        for position in &mut self.positions {
            *position = rounded(*position + (BOTTOM - lowest) * DVec3::Y);
        }
    }

    /// Cuts quads along the diagonal of their first and third corners (0) or along the other one (1). `choose` gets the
    /// angle between the two halves for each diagonal, rad, and returns a diagonal, or None to keep the quad.
    fn cut_quads(&mut self, mut choose: impl FnMut([f64; 2]) -> Option<usize>) {
        let cut = |face: &Vec<usize>| {
            let [a, b, c, d] = face[..] else {
                return vec![face.clone()];
            };
            let halves = [
                [vec![a, b, c], vec![a, c, d]],
                [vec![b, c, d], vec![b, d, a]],
            ];
            let bends = (halves.each_ref())
                .map(|[one, other]| self.vector_area(one).angle_between(self.vector_area(other)));
            match choose(bends) {
                Some(diagonal) => halves[diagonal].to_vec(),
                None => vec![face.clone()],
            }
        };
        self.faces = self.faces.iter().flat_map(cut).collect();
    }

    /// A normal for every corner of every face: the mean, weighted by area, of the faces around the vertex up to the
    /// next edges where normals differ by more than `crease`, rad.
    fn normals(&self, crease: f64) -> Vec<Vec<DVec3>> {
        let areas: Vec<_> = (self.faces.iter())
            .map(|face| self.vector_area(face))
            .collect();
        // By the edge's ends, in the face's order.
        let mut faces_by_edge = HashMap::new();
        for (face, corners) in self.faces.iter().enumerate() {
            for (&from, &to) in corners.iter().zip(corners.iter().cycle().skip(1)) {
                faces_by_edge.insert((from, to), face);
            }
        }
        let normal = |face: usize, vertex: usize| {
            let mut fan = vec![face];
            let mut next = 0;
            while let Some(&face) = fan.get(next) {
                next += 1;
                for &corner in self.faces[face].iter() {
                    for edge in [(vertex, corner), (corner, vertex)] {
                        let Some(&neighbour) = faces_by_edge.get(&edge) else {
                            continue;
                        };
                        let is_smooth = areas[face].angle_between(areas[neighbour]) < crease;
                        if is_smooth && !fan.contains(&neighbour) {
                            fan.push(neighbour);
                        }
                    }
                }
            }
            let sum: DVec3 = fan.iter().map(|&face| areas[face]).sum();
            sum.normalize()
        };
        (self.faces.iter().enumerate())
            .map(|(face, corners)| corners.iter().map(|&vertex| normal(face, vertex)).collect())
            .collect()
    }

    fn vector_area(&self, face: &[usize]) -> DVec3 {
        let origin = self.positions[face[0]];
        let edge = |vertex: usize| self.positions[vertex] - origin;
        (face[1..].windows(2))
            .map(|pair| edge(pair[0]).cross(edge(pair[1])) / 2.0)
            .sum()
    }
}

/// Four decimals, which are 0.1 mm.
fn rounded(value: DVec3) -> DVec3 {
    (value * 1e4).round() / 1e4
}

/// Uniform in 0..1, a hash of the integers in the manner of PCG3D (Jarzynski and Olano 2020).
fn random(at: [i64; 3]) -> f64 {
    let [mut x, mut y, mut z] = at.map(|n| {
        (n as u32)
            .wrapping_mul(1_664_525)
            .wrapping_add(1_013_904_223)
    });
    for _ in 0..2 {
        (x, y, z) = (x ^ x >> 16, y ^ y >> 16, z ^ z >> 16);
        x = x.wrapping_add(y.wrapping_mul(z));
        y = y.wrapping_add(z.wrapping_mul(x));
        z = z.wrapping_add(x.wrapping_mul(y));
    }
    f64::from(x) / (f64::from(u32::MAX) + 1.0)
}

/// Smooth, in −1..1, with features of size 1.
fn noise(at: DVec3) -> f64 {
    let cell = at.floor();
    let within = at - cell;
    let weight = within * within * (3.0 - 2.0 * within);
    let mut sum = 0.0;
    for corner in 0..8u8 {
        let bit = |axis: u8| f64::from(corner >> axis & 1);
        let corner = DVec3::new(bit(0), bit(1), bit(2));
        let weights = (1.0 - corner) + (2.0 * corner - 1.0) * weight;
        let value = random((cell + corner).to_array().map(|n| n as i64));
        sum += weights.element_product() * (2.0 * value - 1.0);
    }
    sum
}
