//! A flange from CAD.

use super::{BOTTOM, Obj};
use glam::{DVec2, DVec3};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_3, TAU};

/// A closed line: points and the normals of the wall there. Counter-clockwise around material, clockwise around
/// holes, seen from above.
type Outline = Vec<(DVec2, DVec2)>;

const LOBES: usize = 3;
/// Segments of a lobe, and of a hollow between two lobes.
const ARC_SEGMENTS: usize = 36;
/// From the axis to the centres of the lobes and of the hollows.
const LOBE: f64 = 0.38;
const HOLLOW: f64 = 0.62;
const LOBE_RADIUS: f64 = 0.12;
const BOLT_RADIUS: f64 = 0.055;
const BORE_RADIUS: f64 = 0.08;
const BOSS_RADIUS: f64 = 0.13;
const FILLET: f64 = 0.05;
const FILLET_QUADS: [usize; 2] = [80, 5];
const PLATE_HEIGHT: f64 = 0.3;
const BOSS_HEIGHT: f64 = 0.6;

/// Flange upright around the y axis, 0.9 m wide. Walls are slivers over the whole height, flat faces are
/// slivers between their borders. Every face of the part has its own vertices, with the face's normals.
pub fn part() -> String {
    let body = body();
    let bolts: Vec<Outline> = (0..LOBES).map(|i| hole(lobe(i), BOLT_RADIUS, 48)).collect();
    let bore = hole(DVec2::ZERO, BORE_RADIUS, 64);
    let boss = circle(DVec2::ZERO, BOSS_RADIUS, FILLET_QUADS[0]);
    let foot = hole(DVec2::ZERO, BOSS_RADIUS + FILLET, FILLET_QUADS[0]);

    let mut obj = Obj::new("flange: 0.9 m wide, 0.6 m high");
    for face in 0..2 * LOBES {
        wall(&mut obj, &body, face, ARC_SEGMENTS, [BOTTOM, PLATE_HEIGHT]);
    }
    // Round walls are two faces each, as in STEP files.
    for half in 0..2 {
        for bolt in &bolts {
            wall(&mut obj, bolt, half, bolt.len() / 2, [BOTTOM, PLATE_HEIGHT]);
        }
        wall(&mut obj, &bore, half, bore.len() / 2, [BOTTOM, BOSS_HEIGHT]);
        let heights = [PLATE_HEIGHT + FILLET, BOSS_HEIGHT];
        wall(&mut obj, &boss, half, boss.len() / 2, heights);
    }
    let with_bolts = |hole: &Outline| [&bolts[..], std::slice::from_ref(hole)].concat();
    flat(&mut obj, &body, with_bolts(&bore), BOTTOM, -DVec3::Y);
    flat(&mut obj, &body, with_bolts(&foot), PLATE_HEIGHT, DVec3::Y);
    flat(&mut obj, &boss, vec![bore], BOSS_HEIGHT, DVec3::Y);
    obj.stop_sharing();
    obj.grid(FILLET_QUADS, |i, j| {
        let out = boss[i % boss.len()].1;
        let angle = FRAC_PI_2 * j as f64 / FILLET_QUADS[1] as f64;
        let (sine, cosine) = angle.sin_cos();
        let radius = BOSS_RADIUS + FILLET * (1.0 - sine);
        let height = PLATE_HEIGHT + FILLET * (1.0 - cosine);
        let at = rounded(radius * out);
        (place(at, height), place(sine * out, cosine))
    });
    obj.text
}

fn lobe(i: usize) -> DVec2 {
    LOBE * DVec2::from_angle(TAU * i as f64 / LOBES as f64)
}

/// Lobes around the bolts, and hollows between the lobes that touch them smoothly.
fn body() -> Outline {
    // Angle of a lobe from its own direction to where it touches a hollow.
    let half = (HOLLOW * DVec2::from_angle(FRAC_PI_3) - LOBE * DVec2::X).to_angle();
    let part = |segment: usize| 2.0 * segment as f64 / ARC_SEGMENTS as f64 - 1.0;
    let mut outline = Outline::new();
    for i in 0..LOBES {
        let lobe_angle = TAU * i as f64 / LOBES as f64;
        let hollow_angle = lobe_angle + FRAC_PI_3;
        let hollow = HOLLOW * DVec2::from_angle(hollow_angle);
        let hollow_radius = hollow.distance(lobe(i)) - LOBE_RADIUS;
        for segment in 0..ARC_SEGMENTS {
            let out = DVec2::from_angle(lobe_angle + half * part(segment));
            outline.push((rounded(lobe(i) + LOBE_RADIUS * out), out));
        }
        for segment in 0..ARC_SEGMENTS {
            let out = DVec2::from_angle(hollow_angle - (half - FRAC_PI_3) * part(segment));
            outline.push((rounded(hollow - hollow_radius * out), out));
        }
    }
    outline
}

fn circle(centre: DVec2, radius: f64, segments: usize) -> Outline {
    (0..segments)
        .map(|i| DVec2::from_angle(TAU * i as f64 / segments as f64))
        .map(|out| (rounded(centre + radius * out), out))
        .collect()
}

fn hole(centre: DVec2, radius: f64, segments: usize) -> Outline {
    let circle = circle(centre, radius, segments).into_iter().rev();
    circle.map(|(point, out)| (point, -out)).collect()
}

/// Six decimals, so that later decisions do not depend on the mathematical library.
fn rounded(at: DVec2) -> DVec2 {
    (at * 1e6).round() / 1e6
}

/// The plane's second axis is −z, so that counter-clockwise is the same seen from above.
fn place(at: DVec2, height: f64) -> DVec3 {
    DVec3::new(at.x, height, -at.y)
}

/// One face of the upright wall on `outline`, where every face has `segments`.
fn wall(obj: &mut Obj, outline: &Outline, face: usize, segments: usize, heights: [f64; 2]) {
    obj.stop_sharing();
    for segment in face * segments..(face + 1) * segments {
        let corner = |obj: &mut Obj, i: usize, height: f64| {
            let (at, out) = outline[(segment + i) % outline.len()];
            obj.corner(place(at, height), place(out, 0.0))
        };
        let [bottom, top] = heights;
        for triangle in [
            [(0, bottom), (1, bottom), (1, top)],
            [(0, bottom), (1, top), (0, top)],
        ] {
            let corners = triangle.map(|(i, height)| corner(obj, i, height));
            obj.face(&corners);
        }
    }
}

/// Flat face within `outline` and around `holes`, its front toward `normal`, up or down.
fn flat(obj: &mut Obj, outline: &Outline, holes: Vec<Outline>, height: f64, normal: DVec3) {
    obj.stop_sharing();
    let polygon = join_holes(outline, holes);
    for triangle in clip_ears(polygon) {
        let mut corners = triangle.map(|at| obj.corner(place(at, height), normal));
        if normal.y < 0.0 {
            corners.reverse();
        }
        obj.face(&corners);
    }
}

/// One polygon: the outline, joined to each hole by a cut that is traversed in both directions, shortest cuts first.
fn join_holes(outline: &Outline, holes: Vec<Outline>) -> Vec<DVec2> {
    let points = |outline: &Outline| -> Vec<DVec2> { outline.iter().map(|(at, _)| *at).collect() };
    let mut polygon = points(outline);
    let mut holes: Vec<_> = holes.iter().map(points).collect();
    while !holes.is_empty() {
        let mut best = (f64::INFINITY, 0, 0, 0);
        for (h, hole) in holes.iter().enumerate() {
            for (i, from) in polygon.iter().enumerate() {
                for (j, to) in hole.iter().enumerate() {
                    // Lengths that differ by rounding alone are equal.
                    if from.distance(*to) < best.0 - 1e-9 {
                        best = (from.distance(*to), h, i, j);
                    }
                }
            }
        }
        let (_, h, i, j) = best;
        let mut hole = holes.remove(h);
        hole.rotate_left(j);
        hole.extend([hole[0], polygon[i]]);
        polygon.splice(i + 1..i + 1, hole);
    }
    polygon
}

/// Triangles of a counter-clockwise polygon, by cutting off ears (Meisters 1975).
fn clip_ears(mut polygon: Vec<DVec2>) -> Vec<[DVec2; 3]> {
    let doubled_area = |[a, b, c]: [DVec2; 3]| (b - a).perp_dot(c - a);
    let mut triangles = Vec::new();
    let mut i = 0;
    // Heights of ears, over the longest side. Thinner ears wait until no other ear is left.
    let mut least_height = 0.01;
    let mut misses = 0;
    while polygon.len() > 2 {
        let count = polygon.len();
        let ear = [0, 1, 2].map(|k| polygon[(i + k) % count]);
        let [a, b, c] = ear;
        let sides = [[a, b], [b, c], [c, a]];
        let longest = (sides.iter()).fold(0.0, |l, [p, q]| p.distance_squared(*q).max(l));
        let is_inside = |at: &DVec2| {
            let is_left = |[p, q]: [DVec2; 2]| doubled_area([p, q, *at]) >= 0.0;
            !ear.contains(at) && sides.into_iter().all(is_left)
        };
        if doubled_area(ear) > least_height * longest && !polygon.iter().any(is_inside) {
            triangles.push(ear);
            polygon.remove((i + 1) % count);
            misses = 0;
        } else {
            misses += 1;
        }
        if misses > count {
            least_height /= 2.0;
            misses = 0;
            assert!(least_height > 1e-5, "the polygon has no ear");
        }
        i = (i + 1) % polygon.len();
    }
    triangles
}
