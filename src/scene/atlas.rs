//! Light maps of meshes: which texel holds which part of which triangle.
//!
//! A mesh is laid out by its own texture coordinates where these can carry a light map: all within
//! [0, 1]², no triangle without area there, and no two charts or two layers of one in a texel. What
//! cannot be used is unwrapped by the crate `uvunwrap`: charts within a cone of normals, flattened by
//! least squares conformal maps (Lévy, Petitjean, Ray, Maillot 2002) and packed with [`PADDING`]
//! texels around each. Its result is held to the same rules.
//!
//! A texel stands for the part of the mesh that lies in it. Texels of which a chart covers less than
//! [`LEAST_COVER`] are left out, as an average over a sliver says nothing.

use super::{Mesh, Object, memory};
use crate::error::Error;
use glam::{DVec2, DVec3};
use std::collections::HashMap;
use uvunwrap::{Density, MeshInput, Options};

/// Texels that an unwrapped chart keeps from others and from the edge of the light map: two are
/// filled around each for look-ups between texels, see [`Atlas::around`].
const PADDING: u32 = 2;
/// Smallest share of a texel that a chart must cover.
const LEAST_COVER: f64 = 0.01;
/// Cover of a texel beyond which layers lie upon each other.
const MOST_COVER: f64 = 1.0 + 1e-3;
/// How far outside of [0, 1] texture coordinates are taken for rounding.
const ROUNDING: f64 = 1e-6;
/// Share of the mesh's area that may be lost in triangles too thin to be unwrapped.
const MOST_LOST: f64 = 1e-3;
/// Rings of texels around the charts that [`Atlas::around`] fills.
const RINGS: i64 = 2;

/// The layout of a light map.
#[derive(Debug, Clone)]
pub struct Atlas {
    size: [u32; 2],
    /// Texture coordinates of every triangle's corners.
    corners: Vec<[DVec2; 3]>,
    /// Texel by texel from the top row.
    pieces: Vec<Piece>,
    /// Where each texel's begin, and the end of all.
    starts: Vec<u32>,
}

/// The part of a triangle that lies in a quarter of a texel.
#[derive(Debug, Clone, Copy)]
pub struct Piece {
    pub triangle: u32,
    /// column + 2 row within the texel, from its top left.
    pub quarter: u32,
    /// Weights of the triangle's second and third corner at the piece's centroid.
    pub weights: DVec2,
    /// Share of the triangle's area.
    pub share: f64,
}

/// What lies in a texel.
#[derive(Debug, Clone, Copy, Default)]
pub struct Texel {
    /// Centroid, m.
    pub position: DVec3,
    /// Mean of the triangles' unit normals over the area: not longer than 1.
    pub normal: DVec3,
    /// m²; 0 outside of the charts.
    pub area: f64,
}

impl NoLayout {
    /// As an error of who asked for the light map.
    pub fn into_error(self) -> Error {
        Error::Usage {
            reason: format!("object `{}`: {}", self.object, self.reason),
            remedy: self.remedy,
        }
    }
}

/// Texture coordinates that cannot carry a light map.
#[derive(Debug)]
struct Flaw {
    triangle: usize,
    what: &'static str,
}

/// Why a mesh has no light map, and what to do.
#[derive(Debug)]
pub struct NoLayout {
    /// Name of the object.
    pub object: String,
    pub reason: String,
    pub remedy: String,
}

impl Atlas {
    /// The layout of `object`'s light map on `size` texels, and a warning where the mesh's own texture
    /// coordinates were not used.
    ///
    /// # Errors
    /// Where the mesh cannot be unwrapped, the map is too small for it, or memory is for the map.
    ///
    /// # Panics
    /// Where the object has no mesh.
    pub fn of(object: &Object, size: [u32; 2]) -> Result<(Self, Option<String>), NoLayout> {
        let Some((mesh, _)) = object.geometry.placement() else {
            panic!("only the light maps of meshes have a layout");
        };
        let (rest, own) = match &object.unwrapping {
            Some(unwrapping) => (&unwrapping.rest, unwrapping.own.as_slice()),
            None => (mesh, [].as_slice()),
        };
        let problem = |(reason, remedy)| NoLayout {
            object: object.name.clone(),
            reason,
            remedy,
        };
        let texels = size.map(u64::from).iter().product::<u64>();
        memory::check(&format!("{texels} texels"), texels * memory::TEXEL)
            .map_err(|reason| problem((reason, "lower the size".into())))?;
        let mut warning = None;
        if !own.is_empty() {
            match Self::new(rest, own.to_vec(), size) {
                Ok(atlas) => return Ok((atlas, None)),
                Err(flaw) => {
                    warning = Some(format!(
                        "object `{}`: {}, so its own texture coordinates are not used for the light map: \
                         it is unwrapped",
                        object.name,
                        flaw.describe(rest)
                    ));
                }
            }
        }
        let corners = unwrap(rest, size).map_err(problem)?;
        let atlas = Self::new(rest, corners, size).map_err(|flaw| problem((
            format!(
                "the mesh is not unwrapped well enough: {}",
                flaw.describe(rest)
            ),
            "raise the size of `lightmap`, or give the mesh texture coordinates (vt) of its own".into(),
        )))?;
        Ok((atlas, warning))
    }

    fn new(mesh: &Mesh, mut corners: Vec<[DVec2; 3]>, size: [u32; 2]) -> Result<Self, Flaw> {
        for (triangle, uvs) in corners.iter_mut().enumerate() {
            for uv in uvs {
                let inside = uv.is_finite()
                    && uv.min_element() >= -ROUNDING
                    && uv.max_element() <= 1.0 + ROUNDING;
                if !inside {
                    let what = "lies outside of 0 to 1";
                    return Err(Flaw { triangle, what });
                }
                *uv = uv.clamp(DVec2::ZERO, DVec2::ONE);
            }
        }
        let area = |triangle: usize| mesh.vector_area(triangle).length();
        let whole: f64 = (0..corners.len()).map(area).sum();
        let flat = |uvs: &[DVec2; 3]| twice_area(uvs).abs() <= 1e-12 * span(uvs).powi(2);
        let lost: Vec<usize> = (0..corners.len()).filter(|&t| flat(&corners[t])).collect();
        let lost_area: f64 = lost.iter().map(|&t| area(t)).sum();
        if lost_area > MOST_LOST * whole {
            let triangle = *(lost.iter())
                .max_by(|a, b| area(**a).total_cmp(&area(**b)))
                .expect("some area is lost");
            let what = "has no area";
            return Err(Flaw { triangle, what });
        }

        let charts = charts(mesh, &corners);
        let mut turns = HashMap::new();
        for (triangle, uvs) in corners.iter().enumerate().filter(|(_, uvs)| !flat(uvs)) {
            let turn = twice_area(uvs) > 0.0;
            if *turns.entry(charts[triangle]).or_insert(turn) != turn {
                let what = "is turned over against the rest of its chart";
                return Err(Flaw { triangle, what });
            }
        }
        let mut found = Vec::new();
        for (triangle, uvs) in corners.iter().enumerate().filter(|(_, uvs)| !flat(uvs)) {
            cut(triangle as u32, uvs, size, &mut found);
        }
        // Stable, so that the pieces of a texel follow in the order of the triangles.
        found.sort_by_key(|(texel, ..)| *texel);

        let mut atlas = Self {
            size,
            corners,
            pieces: Vec::with_capacity(found.len()),
            starts: vec![0],
        };
        let mut rest = found.as_slice();
        for texel in 0..size[0] * size[1] {
            let count = rest.partition_point(|(of, ..)| *of == texel);
            let (here, after) = rest.split_at(count);
            rest = after;
            // How much each chart covers; few, so a list does.
            let mut covers: Vec<(u32, f64)> = Vec::new();
            for (_, cover, piece) in here {
                let chart = charts[piece.triangle as usize];
                match covers.iter_mut().find(|(of, _)| *of == chart) {
                    Some((_, sum)) => *sum += cover,
                    None => covers.push((chart, *cover)),
                }
            }
            let triangle = |chart| {
                let piece = here.iter().map(|(_, _, piece)| piece);
                let of_chart = |piece: &&Piece| charts[piece.triangle as usize] == chart;
                piece.rev().find(of_chart).map_or(0, |p| p.triangle) as usize
            };
            covers.retain(|(_, cover)| *cover >= LEAST_COVER);
            if let [_, (chart, _), ..] = covers[..] {
                let what = "shares a texel with another chart";
                return Err(Flaw {
                    triangle: triangle(chart),
                    what,
                });
            }
            if let [(chart, cover)] = covers[..] {
                if cover > MOST_COVER {
                    let what = "overlaps another triangle";
                    return Err(Flaw {
                        triangle: triangle(chart),
                        what,
                    });
                }
                let own = (here.iter()).filter(|(_, _, p)| charts[p.triangle as usize] == chart);
                atlas.pieces.extend(own.map(|(_, _, piece)| piece));
            }
            atlas.starts.push(atlas.pieces.len() as u32);
        }
        Ok(atlas)
    }

    /// Texels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    /// Texture coordinates of a triangle's corners; v up.
    pub fn corners(&self, triangle: usize) -> [DVec2; 3] {
        self.corners[triangle]
    }

    /// What lies in a texel, counted row by row from the top.
    pub fn pieces(&self, texel: usize) -> &[Piece] {
        &self.pieces[self.starts[texel] as usize..self.starts[texel + 1] as usize]
    }

    /// The texel that holds the point of a triangle with these weights of its second and third corner,
    /// if any does.
    pub fn texel_at(&self, triangle: u32, weights: DVec2) -> Option<usize> {
        let [a, b, c] = self.corners[triangle as usize];
        let place = self.in_texels(a + weights.x * (b - a) + weights.y * (c - a));
        let [column, row] = [(place.x, self.size[0]), (place.y, self.size[1])]
            .map(|(at, side)| (at as usize).min(side as usize - 1));
        let texel = row * self.size[0] as usize + column;
        let holds = self.pieces(texel).iter().any(|p| p.triangle == triangle);
        holds.then_some(texel)
    }

    /// Position in texels from the top left corner.
    fn in_texels(&self, uv: DVec2) -> DVec2 {
        DVec2::new(uv.x, 1.0 - uv.y) * DVec2::from(self.size.map(f64::from))
    }

    /// The weights of a triangle's second and third corner at a place in texels from the top left
    /// corner, which may lie outside of the triangle.
    pub fn weights_at(&self, triangle: u32, place: DVec2) -> DVec2 {
        let [a, b, c] = self.corners[triangle as usize].map(|uv| self.in_texels(uv));
        let (e, f, d) = (b - a, c - a, place - a);
        DVec2::new(d.perp_dot(f), e.perp_dot(d)) / e.perp_dot(f)
    }

    /// Area of the triangle in texels.
    pub fn texels_of(&self, triangle: u32) -> f64 {
        let size = DVec2::from(self.size.map(f64::from));
        0.5 * twice_area(&self.corners[triangle as usize]).abs() * size.x * size.y
    }

    /// What lies in every texel where the mesh, of the same topology, is like `mesh`.
    pub fn texels(&self, mesh: &Mesh) -> Vec<Texel> {
        let vector_areas: Vec<DVec3> = (0..self.corners.len())
            .map(|triangle| mesh.vector_area(triangle))
            .collect();
        (0..self.starts.len() - 1)
            .map(|texel| {
                let (mut sum, mut normal, mut area) = (DVec3::ZERO, DVec3::ZERO, 0.0);
                for piece in self.pieces(texel) {
                    let vector = piece.share * vector_areas[piece.triangle as usize];
                    sum += vector.length() * mesh.point(piece.triangle as usize, piece.weights);
                    normal += vector;
                    area += vector.length();
                }
                match area > 0.0 {
                    true => Texel {
                        position: sum / area,
                        normal: normal / area,
                        area,
                    },
                    false => Texel::default(),
                }
            })
            .collect()
    }

    /// Centroid of what lies in a texel of a chart, in texels from the top left corner.
    pub fn centroid(&self, mesh: &Mesh, texel: usize) -> DVec2 {
        let (mut sum, mut area) = (DVec2::ZERO, 0.0);
        for piece in self.pieces(texel) {
            let [a, b, c] = self.corners[piece.triangle as usize];
            let uv = a + piece.weights.x * (b - a) + piece.weights.y * (c - a);
            let of_piece = piece.share * mesh.vector_area(piece.triangle as usize).length();
            sum += of_piece * self.in_texels(uv);
            area += of_piece;
        }
        sum / area
    }

    /// Texels next to the charts, and for each the nearest one in a chart.
    pub fn around(&self) -> Vec<(usize, usize)> {
        let [width, height] = self.size.map(i64::from);
        let in_chart = |x: i64, y: i64| {
            let inside = (0..width).contains(&x) && (0..height).contains(&y);
            inside && !self.pieces((y * width + x) as usize).is_empty()
        };
        let mut steps: Vec<(i64, i64)> = (-RINGS..=RINGS)
            .flat_map(|y| (-RINGS..=RINGS).map(move |x| (x, y)))
            .collect();
        steps.sort_by_key(|(x, y)| x * x + y * y);
        (0..width * height)
            .filter(|&texel| !in_chart(texel % width, texel / width))
            .filter_map(|texel| {
                let (x, y) = (texel % width, texel / width);
                let (dx, dy) = steps.iter().find(|(dx, dy)| in_chart(x + dx, y + dy))?;
                Some((texel as usize, ((y + dy) * width + x + dx) as usize))
            })
            .collect()
    }
}

impl Flaw {
    fn describe(&self, mesh: &Mesh) -> String {
        format!(
            "triangle {} of {} {} on the map",
            self.triangle + 1,
            mesh.triangles.len(),
            self.what
        )
    }
}

fn twice_area([a, b, c]: &[DVec2; 3]) -> f64 {
    (*b - *a).perp_dot(*c - *a)
}

fn span([a, b, c]: &[DVec2; 3]) -> f64 {
    a.distance(*b).max(b.distance(*c)).max(c.distance(*a))
}

/// A number for every triangle, equal for those that corners of the same place on mesh and map
/// connect.
fn charts(mesh: &Mesh, corners: &[[DVec2; 3]]) -> Vec<u32> {
    let mut parents: Vec<u32> = (0..corners.len() as u32).collect();
    fn root(parents: &mut [u32], mut of: u32) -> u32 {
        while parents[of as usize] != of {
            parents[of as usize] = parents[parents[of as usize] as usize];
            of = parents[of as usize];
        }
        of
    }
    let mut known: HashMap<[u64; 5], u32> = HashMap::new();
    for (triangle, (indices, uvs)) in mesh.triangles.iter().zip(corners).enumerate() {
        for (index, uv) in indices.iter().zip(uvs) {
            let p = mesh.positions[*index as usize];
            // The sum makes −0 into 0.
            let key = [p.x, p.y, p.z, uv.x, uv.y].map(|x| (x + 0.0).to_bits());
            let other = *known.entry(key).or_insert(triangle as u32);
            let (a, b) = (
                root(&mut parents, other),
                root(&mut parents, triangle as u32),
            );
            parents[a.max(b) as usize] = a.min(b);
        }
    }
    (0..corners.len() as u32)
        .map(|triangle| root(&mut parents, triangle))
        .collect()
}

/// Cuts a triangle at the edges of quarters of texels: adds (texel, share of the texel, piece).
fn cut(triangle: u32, uvs: &[DVec2; 3], size: [u32; 2], found: &mut Vec<(u32, f64, Piece)>) {
    let quarters = size.map(|side| 2 * side);
    let scale = DVec2::from(quarters.map(f64::from));
    let corners = uvs.map(|uv| DVec2::new(uv.x, 1.0 - uv.y) * scale);
    let [a, b, c] = corners;
    let (e, f) = (b - a, c - a);
    let doubled = e.perp_dot(f);
    let range = |axis: usize, of: &[DVec2]| {
        let (low, high) = of
            .iter()
            .fold((f64::INFINITY, 0.0f64), |(low, high), corner| {
                (low.min(corner[axis]), high.max(corner[axis]))
            });
        low.floor() as u32..(high.ceil() as u32).min(quarters[axis])
    };
    for row in range(1, &corners) {
        let strip = clipped(
            &clipped(&corners, 1, row.into(), 1.0),
            1,
            f64::from(row + 1),
            -1.0,
        );
        for column in range(0, &strip) {
            let left = clipped(&strip, 0, column.into(), 1.0);
            let part = clipped(&left, 0, f64::from(column + 1), -1.0);
            let (twice, centroid) = moments(&part);
            if twice == 0.0 {
                continue;
            }
            let share = (twice / doubled).abs();
            let d = centroid - a;
            let weights = DVec2::new(d.perp_dot(f), e.perp_dot(d)) / doubled;
            let piece = Piece {
                triangle,
                quarter: column % 2 + 2 * (row % 2),
                weights: weights.clamp(DVec2::ZERO, DVec2::ONE),
                share,
            };
            // Four quarters make a texel.
            found.push((row / 2 * size[0] + column / 2, 0.125 * twice.abs(), piece));
        }
    }
}

/// The part of a convex polygon where side · (coordinate − border) ≥ 0 (Sutherland & Hodgman 1974).
fn clipped(polygon: &[DVec2], axis: usize, border: f64, side: f64) -> Vec<DVec2> {
    let mut kept = Vec::with_capacity(polygon.len() + 1);
    for (index, &end) in polygon.iter().enumerate() {
        let start = polygon[(index + polygon.len() - 1) % polygon.len()];
        let [from, to] = [start, end].map(|corner| side * (corner[axis] - border));
        if (from < 0.0) != (to < 0.0) {
            let mut crossing = start + (end - start) * (from / (from - to));
            crossing[axis] = border;
            kept.push(crossing);
        }
        if to >= 0.0 {
            kept.push(end);
        }
    }
    kept
}

/// Twice the signed area, and the centroid.
fn moments(polygon: &[DVec2]) -> (f64, DVec2) {
    let Some(&first) = polygon.first() else {
        return (0.0, DVec2::ZERO);
    };
    let (mut doubled, mut sum) = (0.0, DVec2::ZERO);
    for pair in polygon.windows(2) {
        let (e, f) = (pair[0] - first, pair[1] - first);
        doubled += e.perp_dot(f);
        sum += e.perp_dot(f) * (e + f) / 3.0;
    }
    match doubled != 0.0 {
        true => (doubled, first + sum / doubled),
        false => (0.0, first),
    }
}

/// Texture coordinates that `uvunwrap` finds for a light map of this size: on a square, the largest
/// that fits.
///
/// # Errors
/// Reason and remedy.
fn unwrap(mesh: &Mesh, size: [u32; 2]) -> Result<Vec<[DVec2; 3]>, (String, String)> {
    let too_small = |why: String| {
        (
            format!(
                "a light map of {}×{} texels is too small for the mesh's charts: {why}",
                size[0], size[1]
            ),
            format!(
                "raise the size of `lightmap`, to [{0}, {0}] for a start, or simplify the mesh",
                2 * size[0].max(size[1])
            ),
        )
    };
    let page = size[0].min(size[1]);
    if page <= 2 * PADDING {
        return Err(too_small(format!(
            "{PADDING} texels around each are padding"
        )));
    }
    // Around the middle and of size 1, as 32 bits hold that best.
    let [low, high] = mesh.bounds();
    let scale = 1.0 / (high - low).max_element();
    let positions: Vec<[f32; 3]> = (mesh.positions.iter())
        .map(|p| ((*p - 0.5 * (low + high)) * scale).as_vec3().to_array())
        .collect();
    let indices = mesh.triangles.as_flattened();
    let options = Options {
        density: Density::Auto { page_size: page },
        padding: PADDING,
        ..Options::default()
    };
    let atlas =
        uvunwrap::generate(&[MeshInput::new(&positions, indices)], &options).map_err(|error| {
            match error {
                uvunwrap::Error::ChartTooLarge { .. } => too_small(error.to_string()),
                error => (
                    format!("the mesh cannot be unwrapped: {error}"),
                    "give it texture coordinates (vt) of its own".into(),
                ),
            }
        })?;
    if atlas.page_count > 1 {
        let (charts, pages) = (atlas.chart_count, atlas.page_count);
        return Err(too_small(format!(
            "{charts} charts would need {pages} of it"
        )));
    }
    let found = &atlas.meshes[0];
    // The page is square or lower, and (0, 0) its first row, which stays at v = 0.
    let page =
        DVec2::new(atlas.width.into(), atlas.height.into()) / DVec2::from(size.map(f64::from));
    let uv = |vertex: &u32| {
        let [u, v] = found.vertices[*vertex as usize].uv.map(f64::from);
        DVec2::new(u, v) * page
    };
    let triangles = found.indices.as_chunks().0;
    Ok(triangles
        .iter()
        .map(|[a, b, c]| [uv(a), uv(b), uv(c)])
        .collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::Rect;

    fn square() -> Mesh {
        Rect {
            origin: DVec3::new(1.0, 2.0, 3.0),
            edge_u: 2.0 * DVec3::X,
            edge_v: 3.0 * DVec3::Y,
        }
        .to_mesh()
    }

    fn square_uvs() -> Vec<[DVec2; 3]> {
        let [a, b, c, d] = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]].map(DVec2::from);
        vec![[a, b, c], [a, c, d]]
    }

    #[test]
    fn the_texels_of_a_square_are_those_of_a_rect() {
        let mesh = square();
        let atlas = Atlas::new(&mesh, square_uvs(), [4, 3]).unwrap();
        let texels = atlas.texels(&mesh);
        for (index, texel) in texels.iter().enumerate() {
            let (column, row) = (index % 4, index / 4);
            let middle = DVec3::new(
                1.25 + 0.5 * column as f64,
                2.0 + 3.0 - 0.5 - row as f64,
                3.0,
            );
            assert!((texel.area - 0.5).abs() < 1e-12, "{texel:?}");
            assert!(
                texel.position.distance(middle) < 1e-12,
                "{texel:?} {middle}"
            );
            assert!(texel.normal.distance(DVec3::Z) < 1e-12, "{texel:?}");
            for piece in atlas.pieces(index) {
                assert_eq!(atlas.texel_at(piece.triangle, piece.weights), Some(index));
            }
        }
        assert!(atlas.around().is_empty());
    }

    #[test]
    fn what_cannot_carry_a_light_map_is_named() {
        let mesh = square();
        let flaw = |change: fn(&mut Vec<[DVec2; 3]>)| {
            let mut uvs = square_uvs();
            change(&mut uvs);
            let flaw = Atlas::new(&mesh, uvs, [16, 16]).unwrap_err();
            (flaw.triangle, flaw.what)
        };
        assert_eq!(flaw(|uvs| uvs[1][2].y = 1.1), (1, "lies outside of 0 to 1"));
        assert_eq!(
            flaw(|uvs| uvs[0][1].x = f64::NAN),
            (0, "lies outside of 0 to 1")
        );
        assert_eq!(flaw(|uvs| uvs[1] = [DVec2::ZERO; 3]), (1, "has no area"));
        assert_eq!(
            flaw(|uvs| uvs[1][2] = DVec2::new(1.0, 0.0)),
            (1, "is turned over against the rest of its chart")
        );
        // Apart, upon each other.
        assert_eq!(
            flaw(|uvs| {
                let shift = DVec2::splat(0.01);
                uvs[1] = uvs[0].map(|uv| (0.9 * uv) + shift);
            }),
            (1, "shares a texel with another chart")
        );
    }

    /// A chart that winds up upon itself.
    #[test]
    fn layers_of_one_chart_are_seen() {
        let (mut mesh, mut uvs) = (Mesh::default(), Vec::new());
        let turns = 12;
        for i in 0..=turns {
            let angle = i as f64;
            let (sine, cosine) = angle.sin_cos();
            for radius in [0.1, 0.4] {
                mesh.positions.push(DVec3::new(angle, radius, 0.0));
                mesh.normals.push(DVec3::Z);
                uvs.push(DVec2::new(0.5 + radius * cosine, 0.5 + radius * sine));
            }
        }
        for i in 0..turns {
            let [a, b, c, d] = [2 * i, 2 * i + 1, 2 * i + 3, 2 * i + 2];
            mesh.triangles.extend([[a, b, c], [a, c, d]]);
        }
        let corners = |mesh: &Mesh| -> Vec<[DVec2; 3]> {
            (mesh.triangles.iter())
                .map(|t| t.map(|i| uvs[i as usize]))
                .collect()
        };
        let flaw = Atlas::new(&mesh, corners(&mesh), [32, 32]).unwrap_err();
        assert_eq!(flaw.what, "overlaps another triangle");
        // One turn is not upon itself.
        mesh.triangles.truncate(2 * 5);
        Atlas::new(&mesh, corners(&mesh), [32, 32]).unwrap();
    }

    #[test]
    fn a_map_that_is_too_small_is_refused() {
        let (reason, remedy) = unwrap(&square(), [4, 4]).unwrap_err();
        assert!(reason.contains("too small"), "{reason}");
        assert!(remedy.contains("[8, 8]"), "{remedy}");
        let uvs = unwrap(&square(), [16, 16]).unwrap();
        Atlas::new(&square(), uvs, [16, 16]).unwrap();
    }
}
