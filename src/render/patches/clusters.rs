//! Patch clusters for light from all directions: few patches, each merged from many subtriangles of a caster.
//!
//! The assignment of subtriangles to clusters is fixed; their positions and normals are updated in every frame.

use crate::math::covariance_root;
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::constants::CLUSTER_STARTS;
use crate::render::gpu_types::{ClusterStart, Normals, Patch, Triangle};
use crate::render::patches::kd_tree::{Cells, Moments, Point, split};
use crate::scene::Scene;
use glam::{DMat2, DMat3, DVec2, DVec3, Vec2, Vec3};
use rayon::prelude::*;
use std::ops::Range;

/// Subtriangles per patch of the finest level. With 4 the borders of the clusters are rough: the L1 of the ring was 4.4
/// and 4.1 % with 16 k and 64 k samples, and 4.0 and 2.9 % with 16.
const SUBTRIANGLES_PER_PATCH: f64 = 16.0;
/// Lower bound on the length of a cluster's mean normal.
const MIN_MEAN_NORMAL: f64 = 1e-3;
/// Midpoints of a triangle's sides, as coefficients of its edges from the first corner. For functions that are linear
/// over the triangle, the moments over the midpoints equal the triangle's moments up to the second.
const MIDPOINTS: [[f64; 2]; 3] = [[0.5, 0.0], [0.0, 0.5], [0.5, 0.5]];

/// A triangle of the regular subdivision of a caster's triangle.
struct Subtriangle {
    object: u32,
    /// Index among its object's triangles.
    index: u32,
    /// Midpoints of its sides, as coefficients of the triangle's edges from the first corner.
    midpoints: [DVec2; 3],
    /// Its area over the triangle's area.
    share: f64,
}

/// Clusters of all casters' surfaces, in levels from coarse to fine.
pub struct PatchClusters {
    subtriangles: Vec<Subtriangle>,
    cells: Cells,
}

/// The patches in use.
pub struct Selection {
    levels: Vec<usize>,
    /// Per level and cluster: the subtriangle nearest to the cluster's centroid.
    centres: Vec<Vec<u32>>,
    /// Per level and cluster: the subtriangles where rays start.
    starts: Vec<Vec<[u32; CLUSTER_STARTS as usize]>>,
}

impl PatchClusters {
    /// Clusters the casters' surfaces into levels of `counts` patches, increasing. `distance`, m, is the typical
    /// distance that light travels to the receivers.
    pub fn new(scene: &Scene, store: &TriangleStore, counts: &[usize], distance: f64) -> Self {
        let objects = || scene.specular_objects().map(|(index, _)| index);
        let area = |place: u32| f64::from(store.triangle(place).area());
        let total: f64 = objects()
            .flat_map(|object| store.indices(object))
            .map(|&place| area(place))
            .sum();
        let finest = counts
            .last()
            .map_or(0.0, |&count| SUBTRIANGLES_PER_PATCH * count as f64);
        let mut subtriangles = Vec::new();
        let mut roots = Vec::new();
        for object in objects() {
            let first = subtriangles.len();
            for (index, &place) in store.indices(object).iter().enumerate() {
                let share = area(place) / total;
                let n = (finest * share).sqrt().ceil().max(1.0) as u32;
                subdivide(object as u32, index as u32, n, &mut subtriangles);
            }
            roots.push(first..subtriangles.len());
        }
        let sums = sums_of_subtriangles(&subtriangles, store);
        let cells = split(&points(&sums, distance), &roots, counts);
        Self {
            subtriangles,
            cells,
        }
    }

    /// Per level: mean variance of the positions at which light of a patch's points arrives, m².
    pub fn variances(&self, store: &TriangleStore, distance: f64) -> Vec<f64> {
        let sums = sums_of_subtriangles(&self.subtriangles, store);
        let total: f64 = sums.iter().map(|sums| sums.area).sum();
        let points = points(&sums, distance);
        let cells = &self.cells;
        let variance = |level: &Vec<Range<usize>>| -> f64 {
            let moments =
                (level.iter()).map(|cell| Moments::of(cells.points(cell).map(|i| &points[i])));
            moments.map(|m| m.weight * m.trace()).sum::<f64>() / total
        };
        cells.levels.iter().map(variance).collect()
    }

    /// Number of patches in a level.
    pub fn count(&self, level: usize) -> usize {
        self.cells.levels[level].len()
    }

    /// Selects the patches of some levels, increasing, concatenated in this order, and returns them.
    pub fn select(&self, store: &TriangleStore, levels: Vec<usize>) -> (Selection, Vec<Patch>) {
        let sums = sums_of_subtriangles(&self.subtriangles, store);
        let all = self.sums_of(&sums, &levels);
        let centre = |cell: &Range<usize>, all: &Sums| {
            let centre = all.x / all.area;
            let far = |&i: &usize| (sums[i].x / sums[i].area).distance_squared(centre);
            let nearest = (self.cells.points(cell)).min_by(|a, b| far(a).total_cmp(&far(b)));
            nearest.expect("no cell is empty") as u32
        };
        let centres = (levels.par_iter().zip(&all))
            .map(|(&level, all)| {
                let of_level = self.cells.levels[level].iter().zip(all);
                of_level.map(|(cell, all)| centre(cell, all)).collect()
            })
            .collect();
        let starts = (levels.par_iter())
            .map(|&level| {
                let cells = self.cells.levels[level].iter();
                cells.map(|cell| self.starts_in(cell, &sums)).collect()
            })
            .collect();
        let selection = Selection {
            levels,
            centres,
            starts,
        };
        let patches = self.patches_from(&all, store, &selection);
        (selection, patches)
    }

    /// Subtriangles that each stand for an equal share of a cluster's surface.
    fn starts_in(&self, cell: &Range<usize>, sums: &[Sums]) -> [u32; CLUSTER_STARTS as usize] {
        let total: f64 = self.cells.points(cell).map(|i| sums[i].area).sum();
        let mut points = self.cells.points(cell);
        let (mut point, mut passed) = (points.next().expect("no cell is empty"), 0.0);
        std::array::from_fn(|k| {
            let wanted = total * (k as f64 + 0.5) / f64::from(CLUSTER_STARTS);
            while passed + sums[point].area < wanted
                && let Some(next) = points.next()
            {
                passed += sums[point].area;
                point = next;
            }
            point as u32
        })
    }

    /// The places where rays of the selected patches start, [`CLUSTER_STARTS`] each.
    pub fn starts(&self, store: &TriangleStore, selection: &Selection) -> Vec<ClusterStart> {
        let starts = selection.starts.iter().flatten().flatten();
        starts
            .map(|&index| {
                let subtriangle = &self.subtriangles[index as usize];
                let (triangle, _, normals) = subtriangle.triangle(store);
                let [s, t] = subtriangle.centroid().to_array();
                let Normals { n0, n1, n2, .. } = normals;
                ClusterStart {
                    position: subtriangle.middle(store),
                    triangle,
                    normal: (n0 + s * (n1 - n0) + t * (n2 - n0)).normalize_or_zero(),
                    unused: 0.0,
                }
            })
            .collect()
    }

    /// The selected patches for the present shape of the surfaces.
    pub fn patches(&self, store: &TriangleStore, selection: &Selection) -> Vec<Patch> {
        let sums = sums_of_subtriangles(&self.subtriangles, store);
        let all = self.sums_of(&sums, &selection.levels);
        self.patches_from(&all, store, selection)
    }

    fn patches_from(
        &self,
        all: &[Vec<Sums>],
        store: &TriangleStore,
        selection: &Selection,
    ) -> Vec<Patch> {
        let clusters =
            (all.iter().zip(&selection.centres)).flat_map(|(all, at)| all.iter().zip(at));
        (clusters.collect::<Vec<_>>().into_par_iter())
            .map(|(all, &centre)| all.patch(&self.subtriangles[centre as usize], store))
            .collect()
    }

    /// Per level, the sums over the subtriangles of each cluster.
    fn sums_of(&self, sums: &[Sums], levels: &[usize]) -> Vec<Vec<Sums>> {
        let cells = |level: usize| &self.cells.levels[level];
        let mut found: Vec<Vec<Sums>> = Vec::new();
        for (k, &level) in levels.iter().enumerate().rev() {
            found.push(match found.last() {
                // A finer level's clusters subdivide these clusters.
                Some(finer) => aggregate(cells(level), cells(levels[k + 1]), finer),
                None => (cells(level).par_iter())
                    .map(|cell| Sums::of(self.cells.points(cell).map(|i| &sums[i])))
                    .collect(),
            });
        }
        found.reverse();
        found
    }
}

fn sums_of_subtriangles(subtriangles: &[Subtriangle], store: &TriangleStore) -> Vec<Sums> {
    subtriangles
        .par_iter()
        .map(|subtriangle| subtriangle.sums(store))
        .collect()
}

/// The sums of `cells` from the sums of the finer cells inside them.
fn aggregate(cells: &[Range<usize>], finer: &[Range<usize>], sums: &[Sums]) -> Vec<Sums> {
    (cells.iter())
        .map(|cell| {
            let first = finer.partition_point(|child| child.start < cell.start);
            let end = finer.partition_point(|child| child.start < cell.end);
            Sums::of(&sums[first..end])
        })
        .collect()
}

/// Position of each subtriangle and deflection of its light.
fn points(sums: &[Sums], distance: f64) -> Vec<Point<6>> {
    (sums.iter())
        .map(|sums| {
            let (x, n) = match sums.area > 0.0 {
                true => (sums.x / sums.area, sums.n / sums.area),
                false => (DVec3::ZERO, DVec3::ZERO),
            };
            // Reflected light turns by twice the change of the normal.
            let deflection = 2.0 * distance * n;
            Point {
                place: [x.x, x.y, x.z, deflection.x, deflection.y, deflection.z],
                weight: sums.area,
            }
        })
        .collect()
}

/// Divides a triangle into n² subtriangles.
fn subdivide(object: u32, index: u32, n: u32, subtriangles: &mut Vec<Subtriangle>) {
    let size = 1.0 / f64::from(n);
    for row in 0..n {
        for column in 0..n - row {
            let mut add = |corner: DVec2, size: f64| {
                subtriangles.push(Subtriangle {
                    object,
                    index,
                    midpoints: MIDPOINTS
                        .map(|midpoint| corner + size * DVec2::from_array(midpoint)),
                    share: size * size,
                });
            };
            let corner = DVec2::new(f64::from(column), f64::from(row)) * size;
            add(corner, size);
            if column + row + 1 < n {
                add(corner + size, -size);
            }
        }
    }
}

impl Subtriangle {
    fn triangle(&self, store: &TriangleStore) -> (u32, Triangle, Normals) {
        let place = store.indices(self.object as usize)[self.index as usize];
        (place, store.triangle(place), store.normals(place))
    }

    /// Its centroid, as coefficients of the triangle's edges.
    fn centroid(&self) -> Vec2 {
        (self.midpoints.iter().sum::<DVec2>() / 3.0).as_vec2()
    }

    fn middle(&self, store: &TriangleStore) -> Vec3 {
        let (_, triangle, _) = self.triangle(store);
        let [s, t] = self.centroid().to_array();
        triangle.position + s * triangle.edge1 + t * triangle.edge2
    }

    fn sums(&self, store: &TriangleStore) -> Sums {
        let (_, triangle, normals) = self.triangle(store);
        let [corner, edge1, edge2] =
            [triangle.position, triangle.edge1, triangle.edge2].map(|v| v.as_dvec3());
        let [n0, n1, n2] = [normals.n0, normals.n1, normals.n2].map(|n| n.as_dvec3());
        let vector_area = 0.5 * self.share * edge1.cross(edge2);
        let area = vector_area.length();
        let mut sums = Sums {
            area,
            vector_area,
            ..Sums::ZERO
        };
        for st in self.midpoints {
            let x = corner + st.x * edge1 + st.y * edge2;
            let n = (n0 + st.x * (n1 - n0) + st.y * (n2 - n0)).normalize_or_zero();
            let weight = area / 3.0;
            sums.x += weight * x;
            sums.n += weight * n;
            sums.xx += weight * outer(x, x);
            sums.nx += weight * outer(n, x);
        }
        sums
    }
}

/// Integrals of the position x and the interpolated normal n over a surface.
#[derive(Clone)]
struct Sums {
    area: f64,
    vector_area: DVec3,
    x: DVec3,
    n: DVec3,
    xx: DMat3,
    nx: DMat3,
}

/// a bᵀ
fn outer(a: DVec3, b: DVec3) -> DMat3 {
    DMat3::from_cols(a * b.x, a * b.y, a * b.z)
}

impl Sums {
    const ZERO: Self = Self {
        area: 0.0,
        vector_area: DVec3::ZERO,
        x: DVec3::ZERO,
        n: DVec3::ZERO,
        xx: DMat3::ZERO,
        nx: DMat3::ZERO,
    };

    fn of<'a>(finer: impl IntoIterator<Item = &'a Self>) -> Self {
        let mut all = Self::ZERO;
        finer.into_iter().for_each(|child| all.add(child));
        all
    }

    fn add(&mut self, other: &Self) {
        self.area += other.area;
        self.vector_area += other.vector_area;
        self.x += other.x;
        self.n += other.n;
        self.xx += other.xx;
        self.nx += other.nx;
    }

    /// The triangle with the same mean and covariance of x, and with normals that are the best linear fit to the
    /// surface's. Its area is the length of the vector area, so that it receives the same flux.
    fn patch(&self, nearest: &Subtriangle, store: &TriangleStore) -> Patch {
        let (place, triangle, _) = nearest.triangle(store);
        let x = self.x / self.area;
        let facing = self.vector_area.try_normalize().unwrap_or(DVec3::Y);
        // Where normals cancel out, the patch still has a front.
        let n = match self.n / self.area {
            n if n.length() > MIN_MEAN_NORMAL => n,
            _ => MIN_MEAN_NORMAL * facing,
        };
        let across = {
            let (a, b) = facing.any_orthonormal_pair();
            [a, b]
        };
        let covariance = self.xx * (1.0 / self.area) - outer(x, x);
        let crossed = self.nx * (1.0 / self.area) - outer(n, x);
        let entry = |a: DVec3, b: DVec3| a.dot(covariance * b);
        let planar = DMat2::from_cols(
            DVec2::new(entry(across[0], across[0]), entry(across[0], across[1])),
            DVec2::new(entry(across[0], across[1]), entry(across[1], across[1])),
        );
        let axes = covariance_root(planar);
        let min_deviation = 1e-6 * axes[0].length();
        let mut sides = [DVec3::ZERO; 2];
        let mut normal_changes = [DVec3::ZERO; 2];
        for (k, axis) in axes.into_iter().enumerate() {
            let deviation = axis.length();
            if deviation <= min_deviation {
                continue;
            }
            let unit = (axis.x * across[0] + axis.y * across[1]) / deviation;
            sides[k] = deviation * unit;
            normal_changes[k] = crossed * unit / deviation;
        }
        // Edges of a triangle whose covariance has these axes, corners counter-clockwise.
        let edges = |v: [DVec3; 2]| {
            let (a, b) = (6f64.sqrt() * v[0], 18f64.sqrt() * v[1]);
            [a + b, b - a].map(|edge| edge.as_vec3())
        };
        if sides[0].cross(sides[1]).dot(facing) < 0.0 {
            (sides[1], normal_changes[1]) = (-sides[1], -normal_changes[1]);
        }
        let [edge1, edge2] = edges(sides);
        let [normal_du, normal_dv] = edges(normal_changes);
        Patch {
            position: nearest.middle(store),
            triangle: place,
            normal: n.as_vec3(),
            area: (n.length() * self.area) as f32,
            edge1,
            object: triangle.object,
            edge2,
            unused0: 0.0,
            normal_du,
            unused1: 0.0,
            normal_dv,
            unused2: 0.0,
        }
    }
}
