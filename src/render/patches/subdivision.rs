//! Subdivision: the larger triangles of which the triangles of a regular mesh are the quarters.
//!
//! A triangle and its three neighbours are the quarters of a larger triangle if the mesh was subdivided, as grids and spheres
//! are: the corners of the one in the middle are the midpoints of the larger one's sides. Which triangles are in the middle follows
//! from one of them (Taubin 2002, *Detecting and reconstructing subdivision connectivity*). Scans have no such triangles.

use crate::scene::{Mesh, same_vertices};

/// Most levels: a merged triangle is at most 4⁶ triangles.
const MAX_LEVELS: usize = 6;

const NONE: u32 = u32::MAX;

/// A part of a caster's surface that is divided into facets.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Piece {
    /// Vertices of the mesh.
    pub corners: [u32; 3],
    pub kind: Kind,
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Kind {
    /// A triangle of the mesh, by number.
    Triangle(u32),
    Merged {
        /// Vertices in the middle of the sides 01, 12 and 20.
        midpoints: [u32; 3],
        /// Those between a corner and a midpoint, in this order around the triangle, if the quarters are merged themselves.
        quarters: Option<[u32; 6]>,
        /// Triangles of the mesh along an edge.
        along: u32,
    },
}

impl Kind {
    /// Triangles of the mesh along an edge.
    pub fn along(&self) -> u32 {
        match self {
            Self::Triangle(_) => 1,
            Self::Merged { along, .. } => *along,
        }
    }

    pub fn is_merged(&self) -> bool {
        matches!(self, Self::Merged { .. })
    }
}

/// The pieces of a mesh at each level with at least `least` of them, from fine to coarse.
pub fn levels(mesh: &Mesh, least: usize) -> Vec<Vec<Piece>> {
    let mut levels = Vec::new();
    // Each merged triangle replaces four.
    if mesh.triangles.len() < 4 * least.max(1) {
        return levels;
    }
    let same = same_vertices(mesh);
    let mut pieces: Vec<Piece> = (mesh.triangles.iter().enumerate())
        .map(|(number, corners)| Piece {
            corners: corners.map(|corner| same[corner as usize]),
            kind: Kind::Triangle(number as u32),
        })
        .collect();
    while levels.len() < MAX_LEVELS {
        let merged = merged(&pieces);
        let mut is_covered = vec![false; pieces.len()];
        for (_, quarters) in &merged {
            quarters
                .iter()
                .for_each(|&quarter| is_covered[quarter] = true);
        }
        let rest = (pieces.iter().zip(&is_covered)).filter(|(_, is_covered)| !**is_covered);
        let next: Vec<Piece> = (merged.iter().map(|(piece, _)| *piece))
            .chain(rest.map(|(piece, _)| *piece))
            .collect();
        // Where more than a third cannot be merged, another set is not worth it.
        if next.len() < least || next.len() > pieces.len() / 2 {
            break;
        }
        levels.push(next.clone());
        pieces = next;
    }
    levels
}

/// Merged triangles, with the places of their quarters in `pieces`.
fn merged(pieces: &[Piece]) -> Vec<(Piece, [usize; 4])> {
    let neighbours = neighbours(pieces);
    let roles = roles(pieces, &neighbours);
    let merge = |(middle, role): (usize, &Role)| {
        let sides = neighbours[middle];
        if *role != Role::Middle || sides.contains(&NONE) {
            return None;
        }
        // The quarters at the corners of the larger triangle, across the sides 01, 12 and 20 of the one in the middle.
        let across = sides.map(|side| (side / 3) as usize);
        let [p, q, r] =
            sides.map(|side| (pieces[side as usize / 3]).corners[(side as usize + 2) % 3]);
        let midpoints = pieces[middle].corners;
        let corners = [r, p, q];
        let of_corners = [across[2], across[0], across[1]];
        let piece = Piece {
            corners,
            kind: Kind::Merged {
                midpoints,
                quarters: quarters(pieces, corners, midpoints, of_corners),
                along: 2 * pieces[middle].kind.along(),
            },
        };
        Some((piece, [middle, across[0], across[1], across[2]]))
    };
    roles.iter().enumerate().filter_map(merge).collect()
}

/// The vertices between corners and midpoints, if the quarters at the corners are merged.
fn quarters(
    pieces: &[Piece],
    corners: [u32; 3],
    midpoints: [u32; 3],
    of_corners: [usize; 3],
) -> Option<[u32; 6]> {
    // Of side 01, 12 or 20 the half at its first or second corner.
    let between = |half: usize| {
        let (side, second) = (half / 2, half % 2);
        let corner = (side + second) % 3;
        let piece = &pieces[of_corners[corner]];
        let Kind::Merged {
            midpoints: inner, ..
        } = piece.kind
        else {
            return None;
        };
        let ends = [corners[corner], midpoints[side]];
        let of_side = (0..3).find(|&k| {
            let own = [piece.corners[k], piece.corners[(k + 1) % 3]];
            own == ends || own == [ends[1], ends[0]]
        })?;
        Some(inner[of_side])
    };
    let mut found = [0; 6];
    for (half, vertex) in found.iter_mut().enumerate() {
        *vertex = between(half)?;
    }
    Some(found)
}

/// For the sides 01, 12 and 20 of each piece: three times the neighbour's place, plus the number of its side; [`NONE`] at borders.
fn neighbours(pieces: &[Piece]) -> Vec<[u32; 3]> {
    let mut sides: Vec<([u32; 2], u32)> = (pieces.iter().enumerate())
        .flat_map(|(place, piece)| {
            let [a, b, c] = piece.corners;
            [[a, b], [b, c], [c, a]].into_iter().zip(3 * place as u32..)
        })
        .collect();
    sides.sort_unstable_by_key(|&([a, b], side)| (a.min(b), a.max(b), side));
    let mut neighbours = vec![[NONE; 3]; pieces.len()];
    for joint in
        sides.chunk_by(|([a, b], _), ([c, d], _)| a.min(b) == c.min(d) && a.max(b) == c.max(d))
    {
        // Two that have it in opposite directions.
        if let [(first, side), (second, other)] = joint
            && first[0] == second[1]
            && first[0] != first[1]
        {
            neighbours[*side as usize / 3][*side as usize % 3] = *other;
            neighbours[*other as usize / 3][*other as usize % 3] = *side;
        }
    }
    neighbours
}

/// What a piece is of a larger triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Role {
    Unknown,
    Middle,
    /// The quarter at a corner, with the number of that corner among its own.
    Corner(u8),
}

/// The roles of pieces. Each part of the mesh that hangs together has one of the four choices for its first piece from which most are merged;
/// all are unknown where every choice leads to contradictions.
fn roles(pieces: &[Piece], neighbours: &[[u32; 3]]) -> Vec<Role> {
    let mut roles = vec![Role::Unknown; pieces.len()];
    let mut is_done = vec![false; pieces.len()];
    for first in 0..pieces.len() {
        if is_done[first] {
            continue;
        }
        let choices = [
            Role::Middle,
            Role::Corner(0),
            Role::Corner(1),
            Role::Corner(2),
        ];
        let mut best = (0, Role::Unknown);
        for choice in choices {
            if let Ok(parts) = spread(pieces, neighbours, &mut roles, (first, choice)) {
                let is_whole = |&&part: &&usize| {
                    roles[part] == Role::Middle && !neighbours[part].contains(&NONE)
                };
                let count = parts.iter().filter(is_whole).count();
                if count > best.0 {
                    best = (count, choice);
                }
                parts.iter().for_each(|&part| roles[part] = Role::Unknown);
            }
        }
        if best.0 > 0 {
            // Without contradictions, as before.
            let _ = spread(pieces, neighbours, &mut roles, (first, best.1));
        }
        reached(neighbours, first, &mut is_done);
    }
    roles
}

/// Marks all pieces that hang together with `first`.
fn reached(neighbours: &[[u32; 3]], first: usize, is_done: &mut [bool]) {
    let mut waiting = vec![first];
    is_done[first] = true;
    while let Some(piece) = waiting.pop() {
        for side in neighbours[piece].into_iter().filter(|&side| side != NONE) {
            let next = side as usize / 3;
            if !std::mem::replace(&mut is_done[next], true) {
                waiting.push(next);
            }
        }
    }
}

/// Gives a piece a role, and all others those that follow. Returns their places. Where there is a contradiction, roles are as before.
fn spread(
    pieces: &[Piece],
    neighbours: &[[u32; 3]],
    roles: &mut [Role],
    (first, role): (usize, Role),
) -> Result<Vec<usize>, ()> {
    let mut found = vec![first];
    roles[first] = role;
    let mut next = 0;
    while next < found.len() {
        let piece = found[next];
        next += 1;
        for (side, &other) in neighbours[piece].iter().enumerate() {
            if other == NONE {
                continue;
            }
            let (across, of_side) = (other as usize / 3, other as usize % 3);
            let follows = match roles[piece] {
                Role::Corner(corner) if side == (usize::from(corner) + 1) % 3 => Role::Middle,
                // The neighbour at the same corner of larger triangles.
                Role::Corner(corner) => {
                    let vertex = pieces[piece].corners[usize::from(corner)];
                    let own = (pieces[across].corners.iter()).position(|&of| of == vertex);
                    Role::Corner(own.unwrap_or(0) as u8)
                }
                _ => Role::Corner(((of_side + 2) % 3) as u8),
            };
            if roles[across] == Role::Unknown {
                roles[across] = follows;
                found.push(across);
            } else if roles[across] != follows {
                found.iter().for_each(|&part| roles[part] = Role::Unknown);
                return Err(());
            }
        }
    }
    Ok(found)
}

#[cfg(test)]
pub mod tests {
    use super::*;
    use crate::scene::{Rect, Sine, Waves};
    use glam::{DVec2, DVec3};
    use std::collections::HashMap;

    /// Waves of `quads`, 1 m wide, one of them `short` times shorter than otherwise.
    pub fn waves(quads: [u32; 2], short: f64) -> Mesh {
        let sine = |amplitude: f64, vector: [f64; 2]| Sine {
            amplitude,
            wave_vector: DVec2::from_array(vector),
            phase: 0.4,
            speed: 1.0,
        };
        Waves {
            rect: Rect {
                origin: DVec3::ZERO,
                edge_u: DVec3::X,
                edge_v: DVec3::NEG_Z,
            },
            quads,
            sines: vec![sine(0.01, [6.0, 3.0]), sine(0.002, [-9.0 * short, 4.0])],
            time: 0.0,
        }
        .to_mesh()
    }

    /// Each level covers the mesh once: its triangles have the area of all, and merged ones have the vertices of the mesh in the
    /// middle of their sides and between.
    fn assert_covers(mesh: &Mesh, pieces: &[Piece]) {
        let flat = |vertex: u32| mesh.positions[vertex as usize] * DVec3::new(1.0, 0.0, 1.0);
        let mut area = 0.0;
        for piece in pieces {
            let corners = piece.corners.map(flat);
            let [a, b, c] = corners;
            area += 0.5 * (b - a).cross(c - a).y;
            let Kind::Merged {
                midpoints,
                quarters,
                ..
            } = piece.kind
            else {
                continue;
            };
            for side in 0..3 {
                let [from, to] = [corners[side], corners[(side + 1) % 3]];
                let is_at = |vertex, share| flat(vertex).distance(from.lerp(to, share)) < 1e-12;
                assert!(is_at(midpoints[side], 0.5));
                if let Some(quarters) = quarters {
                    assert!(is_at(quarters[2 * side], 0.25) && is_at(quarters[2 * side + 1], 0.75));
                }
            }
        }
        assert!((area - 1.0).abs() < 1e-12, "{area}");
    }

    fn merged(pieces: &[Piece]) -> usize {
        pieces.iter().filter(|piece| piece.kind.is_merged()).count()
    }

    #[test]
    fn a_grid_is_merged_down_to_the_fewest_pieces() {
        let mesh = waves([16, 16], 1.0);
        let counts = |least| -> Vec<[usize; 2]> {
            let levels = levels(&mesh, least);
            levels.iter().for_each(|level| assert_covers(&mesh, level));
            (levels.iter())
                .map(|level| [level.len(), merged(level)])
                .collect()
        };
        assert_eq!(counts(8), [[128, 128], [32, 32], [8, 8]]);
        assert_eq!(counts(30), [[128, 128], [32, 32]]);
        assert!(counts(129).is_empty());
        let coarsest = &levels(&mesh, 8)[2];
        assert!(coarsest.iter().all(|piece| piece.kind.along() == 8));
    }

    /// A row and a column of an odd grid are left.
    #[test]
    fn what_does_not_fit_stays() {
        let mesh = waves([17, 15], 1.0);
        let levels = levels(&mesh, 8);
        levels.iter().for_each(|level| assert_covers(&mesh, level));
        let first = &levels[0];
        assert_eq!(merged(first), 8 * 7 * 2);
        assert_eq!(first.len(), merged(first) + 2 * (17 * 15 - 16 * 14));
    }

    /// Triangles that alternate are no quarters of larger ones, and neither are those of a mesh without shared vertices.
    #[test]
    fn irregular_meshes_stay() {
        let smooth = waves([16, 16], 1.0);
        let mut turned = smooth.clone();
        for (quad, triangles) in turned.triangles.chunks_exact_mut(2).enumerate() {
            let ([a, b, c], [_, _, d]) = (triangles[0], triangles[1]);
            if (quad / 16 + quad % 16) % 2 == 1 {
                triangles.copy_from_slice(&[[a, b, d], [b, c, d]]);
            }
        }
        assert!(levels(&turned, 8).is_empty());
        let split = Mesh {
            positions: (smooth.triangles.iter().flatten())
                .map(|corner| smooth.positions[*corner as usize])
                .collect(),
            normals: (0..3 * smooth.triangles.len())
                .map(|corner| DVec3::new(1e-6 * corner as f64, 1.0, 0.0).normalize())
                .collect(),
            triangles: (0..smooth.triangles.len() as u32)
                .map(|number| [3 * number, 3 * number + 1, 3 * number + 2])
                .collect(),
        };
        assert!(levels(&split, 8).is_empty());
    }

    /// A subdivided octahedron, whose eight faces are found again.
    #[test]
    fn subdivision_is_undone() {
        let mut mesh = Mesh {
            positions: [DVec3::X, DVec3::Y, DVec3::Z]
                .map(|axis| [axis, -axis])
                .concat(),
            normals: Vec::new(),
            triangles: Vec::new(),
        };
        for side in 0..8 {
            let [x, y, z] = [side & 1, side >> 1 & 1, side >> 2 & 1];
            let (a, b, c) = (x, 2 + y, 4 + z);
            (mesh.triangles).push(if (x + y + z) % 2 == 0 {
                [a, b, c]
            } else {
                [a, c, b]
            });
        }
        let faces = mesh.triangles.clone();
        for _ in 0..2 {
            let mut known = HashMap::new();
            let mut triangles = Vec::new();
            for &[a, b, c] in &mesh.triangles {
                let [ab, bc, ca] = [[a, b], [b, c], [c, a]].map(|[from, to]| {
                    *known
                        .entry([from.min(to), from.max(to)])
                        .or_insert_with(|| {
                            let middle =
                                mesh.positions[from as usize] + mesh.positions[to as usize];
                            mesh.positions.push(middle.normalize());
                            mesh.positions.len() as u32 - 1
                        })
                });
                triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [bc, ca, ab]]);
            }
            mesh.triangles = triangles;
        }
        mesh.normals = mesh.positions.clone();
        let levels = levels(&mesh, 8);
        let sorted = |triangles: &mut dyn Iterator<Item = [u32; 3]>| {
            let mut sorted: Vec<_> = triangles
                .map(|mut corners| {
                    corners.sort_unstable();
                    corners
                })
                .collect();
            sorted.sort_unstable();
            sorted
        };
        assert_eq!(levels.len(), 2);
        let found = sorted(&mut levels[1].iter().map(|piece| piece.corners));
        assert_eq!(found, sorted(&mut faces.into_iter()));
    }
}
