//! From a file's polygons to a sound [`Mesh`]: triangles with an area, and at every corner a unit
//! normal on the side of the front.

use super::Mesh;
use super::obj_text::{Corner, NONE};
use foldhash::fast::RandomState;
#[cfg(feature = "cli")]
use glam::DVec2;
use glam::DVec3;
use rayon::prelude::*;
use std::collections::HashMap;
#[cfg(feature = "cli")]
use std::f64::consts::TAU;
use std::hash::{BuildHasher, Hash};

#[cfg(feature = "cli")]
impl Mesh {
    /// Body of revolution about the y axis, of `segments` around. The outside is at the right of its profile, which consists of smooth
    /// curves of (radius, height), m, and unit normals; neighbours share their ends.
    pub fn revolved(profile: &[Vec<[DVec2; 2]>], segments: u32) -> Self {
        let mut mesh = Self::default();
        for curve in profile {
            let first = mesh.positions.len() as u32;
            for i in 0..segments {
                let (sine, cosine) = (TAU * f64::from(i) / f64::from(segments)).sin_cos();
                let place = |p: DVec2| DVec3::new(p.x * cosine, p.y, p.x * sine);
                mesh.positions
                    .extend(curve.iter().map(|point| place(point[0])));
                mesh.normals
                    .extend(curve.iter().map(|point| place(point[1])));
            }
            let rows = curve.len() as u32;
            for i in 0..segments {
                for row in 0..rows - 1 {
                    let [a, b] =
                        [i, (i + 1) % segments].map(|segment| first + segment * rows + row);
                    // On the axis, two corners are one.
                    if curve[row as usize][0].x > 0.0 {
                        mesh.triangles.push([a, a + 1, b]);
                    }
                    if curve[row as usize + 1][0].x > 0.0 {
                        mesh.triangles.push([b, a + 1, b + 1]);
                    }
                }
            }
        }
        mesh
    }

    /// Of triangles that share their vertices, each three indices of `positions`, with normals that are interpolated
    /// across triangles where `is_smooth`, and those of the triangles otherwise. Triangles without area are left out.
    pub(crate) fn of_triangles(
        positions: &[DVec3],
        triangles: &[[u32; 3]],
        is_smooth: bool,
    ) -> Self {
        let mut soup = Soup::new(positions, &[]);
        for triangle in triangles {
            let corner = |position| Corner {
                position,
                normal: NONE,
                texture: NONE,
            };
            soup.add_polygon(&triangle.map(corner)).expect("a triangle");
        }
        let smooth = match is_smooth {
            true => soup.smooth_normals(),
            false => Vec::new(),
        };
        soup.mesh(&soup.triangles, &smooth, true).0
    }
}

/// Corners of an n-gon from which a triangle fan is tried.
const FAN_STARTS: usize = 64;

/// Polygons of a file, cut into triangles.
pub struct Soup<'a> {
    /// m
    pub positions: &'a [DVec3],
    /// Normals of any length.
    pub normals: &'a [DVec3],
    pub triangles: Vec<[Corner; 3]>,
    /// As many as triangles: their corners, counted over all polygons' that were added.
    pub sources: Vec<[u32; 3]>,
    /// By position, the first index with an equal position.
    places: Vec<u32>,
    /// Corners of the polygons so far.
    polygon_corners: u32,
    /// Triangles left out because they have no area.
    pub without_area: usize,
}

impl<'a> Soup<'a> {
    pub fn new(positions: &'a [DVec3], normals: &'a [DVec3]) -> Self {
        Self {
            positions,
            normals,
            triangles: Vec::new(),
            sources: Vec::new(),
            places: places(positions),
            polygon_corners: 0,
            without_area: 0,
        }
    }

    /// Adds a polygon of at least three corners, counter-clockwise from the front. It becomes a
    /// fan around the first corner whose triangles all face the polygon's way, so a dent is not
    /// filled. Returns the number of triangles.
    ///
    /// # Errors
    /// The reason, if no corner has such a fan.
    pub fn add_polygon(&mut self, corners: &[Corner]) -> Result<usize, String> {
        let n = corners.len();
        let first = self.polygon_corners;
        self.polygon_corners += n as u32;
        // Newell's normal, twice the vector area, about a corner to keep digits far from the origin.
        let at = |i: usize| self.position(corners[i % n]) - self.position(corners[0]);
        let front: DVec3 = (0..n).map(|i| at(i).cross(at(i + 1))).sum();
        let fan = |start: usize| {
            (1..n - 1).map(move |i| [start, start + i, start + i + 1].map(|c| c % n))
        };
        let faces_front = |c: [usize; 3]| {
            (self.vector_area(c.map(|c| corners[c]))).is_none_or(|a| a.dot(front) > 0.0)
        };
        let start = (0..n.min(FAN_STARTS))
            .find(|&start| n == 3 || fan(start).all(faces_front))
            .ok_or("a polygon is too dented to be cut into a fan of triangles")?;
        let before = self.triangles.len();
        for of_polygon in fan(start) {
            let triangle = of_polygon.map(|c| corners[c]);
            if self.vector_area(triangle).is_some() {
                self.triangles.push(triangle);
                self.sources.push(of_polygon.map(|c| first + c as u32));
            } else {
                self.without_area += 1;
            }
        }
        Ok(self.triangles.len() - before)
    }

    fn position(&self, corner: Corner) -> DVec3 {
        self.positions[corner.position as usize]
    }

    /// Index of the place of a corner.
    fn place(&self, corner: Corner) -> u32 {
        self.places[corner.position as usize]
    }

    /// Leaves out triangles whose corners are those of an earlier one, in the same
    /// turning order: their light would count twice. `materials` are the triangles'. Returns how many there were.
    pub fn drop_duplicates(&mut self, materials: &mut Vec<Option<usize>>) -> usize {
        let places =
            (self.triangles.iter()).map(|corners| corners.map(|corner| self.place(corner)));
        let is_first = first_of_equals(places);
        keep(&mut self.triangles, &is_first);
        keep(&mut self.sources, &is_first);
        keep(materials, &is_first);
        is_first.len() - self.triangles.len()
    }

    /// Half the cross product of two edges, or nothing where rounding decides its direction.
    fn vector_area(&self, corners: [Corner; 3]) -> Option<DVec3> {
        let [a, b, c] = corners.map(|corner| self.position(corner));
        let doubled = (b - a).cross(c - a);
        let longest = (b - a)
            .length_squared()
            .max((c - a).length_squared())
            .max((c - b).length_squared());
        (doubled.length() > 1e-12 * longest).then_some(doubled / 2.0)
    }

    /// Normals by place: the sum of the adjoining faces' normals, weighted by the angle
    /// of the corner (Thürmer and Wüthrich 1998), so that the cut into triangles does not matter.
    /// Corners at one place share a normal, whatever their indices.
    pub fn smooth_normals(&self) -> Vec<DVec3> {
        let mut sums = vec![DVec3::ZERO; self.positions.len()];
        for &corners in &self.triangles {
            let positions = corners.map(|corner| self.position(corner));
            let face = self.face_normal(corners);
            for i in 0..3 {
                let [at, next, last] = [0, 1, 2].map(|k| positions[(i + k) % 3]);
                let angle = (next - at).angle_between(last - at);
                sums[self.place(corners[i]) as usize] += angle * face;
            }
        }
        sums
    }

    fn face_normal(&self, corners: [Corner; 3]) -> DVec3 {
        let area = self
            .vector_area(corners)
            .expect("triangles without area are left out");
        area.normalize()
    }

    /// The mesh of some of the triangles, with equal corners merged where `merge`, and the number of corners
    /// whose normal was behind their face. A normal of the file that is behind its face is turned about where it
    /// is more than 120° off, as in a mesh wound the other way round, and replaced by the face's
    /// otherwise, since the winding decides which side is the front. A computed one is replaced.
    pub fn mesh(&self, triangles: &[[Corner; 3]], smooth: &[DVec3], merge: bool) -> (Mesh, usize) {
        let mut mesh = Mesh::default();
        // The first vertex at each place; those with other normals go into a map.
        let mut first_vertices = vec![NONE; if merge { self.positions.len() } else { 0 }];
        let mut others = HashMap::with_hasher(RandomState::default());
        let mut turned = 0;
        for &corners in triangles {
            let face = self.face_normal(corners);
            let triangle = corners.map(|corner| {
                let (position, place) = (self.position(corner), self.place(corner));
                let own = (self.normals.get(corner.normal as usize)).and_then(|n| unit(*n));
                let mut normal = own
                    .or_else(|| smooth.get(place as usize).copied().and_then(unit))
                    .unwrap_or(face);
                let facing = normal.dot(face);
                if facing <= 0.0 {
                    turned += 1;
                    normal = match own.is_some() && facing < -0.5 {
                        true => -normal,
                        false => face,
                    };
                }
                let next = mesh.positions.len() as u32;
                let index = match first_vertices.get_mut(place as usize) {
                    None => next,
                    Some(first) if *first == NONE => {
                        *first = next;
                        next
                    }
                    Some(first) if bits(mesh.normals[*first as usize]) == bits(normal) => *first,
                    Some(_) => *others.entry((place, bits(normal))).or_insert(next),
                };
                if index == next {
                    mesh.positions.push(position);
                    mesh.normals.push(normal);
                }
                index
            });
            mesh.triangles.push(triangle);
        }
        (mesh, turned)
    }
}

/// Leaves out what is not marked.
pub fn keep<T>(all: &mut Vec<T>, marked: &[bool]) {
    let mut marks = marked.iter();
    all.retain(|_| *marks.next().expect("one for each"));
}

/// Whether each triangle, by the places of its corners, is the first with its corners, in the same turning
/// order. The two sides of a sheet are not equal.
pub fn first_of_equals(triangles: impl Iterator<Item = [u32; 3]>) -> Vec<bool> {
    let mut sorted: Vec<([u32; 3], u32)> = triangles
        .zip(0..)
        .map(|(places, triangle)| {
            let lowest = (0..3).min_by_key(|&i| places[i]).expect("three");
            ([0, 1, 2].map(|k| places[(lowest + k) % 3]), triangle)
        })
        .collect();
    sorted.par_sort_unstable();
    let mut is_first = vec![false; sorted.len()];
    for equal in sorted.chunk_by(|a, b| a.0 == b.0) {
        is_first[equal[0].1 as usize] = true;
    }
    is_first
}

/// By position, its place: the first index with an equal position.
pub fn places(positions: &[DVec3]) -> Vec<u32> {
    firsts(positions.len(), |index| bits(positions[index]))
}

/// By vertex of the mesh, the first with an equal position and normal.
pub fn same_vertices(mesh: &Mesh) -> Vec<u32> {
    firsts(mesh.positions.len(), |index| {
        [mesh.positions[index], mesh.normals[index]].map(bits)
    })
}

/// By index below `count`, the first index with an equal key.
fn firsts<K: Hash + Eq>(count: usize, key: impl Fn(usize) -> K + Sync) -> Vec<u32> {
    // Sorted by hash, which is twice as fast as a hash map for millions.
    let hasher = RandomState::default();
    let mut sorted: Vec<(u64, u32)> = (0..count)
        .into_par_iter()
        .map(|index| (hasher.hash_one(key(index)), index as u32))
        .collect();
    sorted.par_sort_unstable();
    let mut firsts = vec![0; count];
    let mut known: Vec<u32> = Vec::new();
    for same_hash in sorted.chunk_by(|a, b| a.0 == b.0) {
        known.clear();
        for &(_, index) in same_hash {
            let wanted = key(index as usize);
            let equal = |&&other: &&u32| key(other as usize) == wanted;
            let first = known.iter().find(equal).copied().unwrap_or_else(|| {
                known.push(index);
                index
            });
            firsts[index as usize] = first;
        }
    }
    firsts
}

/// The unit vector, unless there is no direction to speak of.
pub fn unit(vector: DVec3) -> Option<DVec3> {
    (vector.length() > 1e-9).then(|| vector.normalize())
}

/// Equal for equal vectors; the sum makes −0 into 0.
fn bits(vector: DVec3) -> [u64; 3] {
    (vector + 0.0).to_array().map(f64::to_bits)
}
