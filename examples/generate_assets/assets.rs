//! The meshes, textures and environments that the shipped scenes use, as bytes. Lengths in metres.

// By path, since `tests/suite/assets.rs` includes this file from another folder.
#[path = "engineered/mod.rs"]
mod engineered;
#[path = "irregular/mod.rs"]
mod irregular;
#[path = "noise.rs"]
mod noise;
#[path = "obj.rs"]
mod obj;
#[path = "skies.rs"]
mod skies;
#[path = "table_glass.rs"]
mod table_glass;
#[path = "textures.rs"]
mod textures;

use glam::{DVec2, DVec3};
use obj::Obj;
use std::collections::HashMap;
use std::f64::consts::{FRAC_PI_2, FRAC_PI_4, PI, TAU};

/// Every generated file: path under `assets/`, content.
pub fn all() -> Vec<(&'static str, Vec<u8>)> {
    let mut files: Vec<(&'static str, Vec<u8>)> = vec![
        ("meshes/ring.obj", ring().into()),
        ("meshes/half_cylinder.obj", half_cylinder().into()),
        ("meshes/half_sleeve.obj", half_sleeve().into()),
        ("meshes/dish.obj", dish().into()),
        ("meshes/ball.obj", ball().into()),
        ("meshes/bumps.obj", bumps().into()),
        ("meshes/post.obj", post().into()),
        ("meshes/bowl.obj", bowl().into()),
        ("meshes/pot.obj", pot().into()),
        ("meshes/cup.obj", cup().into()),
        ("meshes/cup.mtl", CUP_MTL.into()),
        ("meshes/tumbler.obj", tumbler().into()),
        ("meshes/drink.obj", drink().into()),
        ("meshes/prism.obj", prism().into()),
        ("environments/constant.hdr", constant_environment()),
        ("environments/studio.hdr", studio()),
        ("environments/sunny.hdr", sunny()),
    ];
    files.extend(irregular::all());
    files.extend(engineered::all());
    files.extend(table_glass::all());
    files.extend(textures::all());
    files.extend(skies::all());
    files
}

/// Upright hollow cylinder around the y axis, standing on y = 0: inside wall of radius 1, outside
/// wall of radius 1.03, a flat rim between them at the height 0.4, no bottom.
///
/// The quads are about as long as wide once a low sun has imaged them on the floor: the concave
/// inside gathers them along the circle, the convex outside spreads them.
fn ring() -> String {
    const INSIDE: (f64, [usize; 2]) = (1.0, [192, 16]);
    const OUTSIDE: (f64, [usize; 2]) = (1.03, [128, 8]);
    const HEIGHT: f64 = 0.4;
    let mut obj = Obj::new("ring: inside radius 1 m, outside 1.03 m, height 0.4 m");
    for ((radius, quads), side) in [(INSIDE, -1.0), (OUTSIDE, 1.0)] {
        obj.grid(quads, |i, j| {
            // The front faces toward `side`, so the outside runs the other way round.
            let out = around(-side * TAU * i as f64 / quads[0] as f64);
            let height = HEIGHT * j as f64 / quads[1] as f64;
            (radius * out + height * DVec3::Y, side * out)
        });
    }
    obj.grid([INSIDE.1[0], 1], |i, j| {
        let radius = [INSIDE.0, OUTSIDE.0][j];
        let out = around(TAU * i as f64 / INSIDE.1[0] as f64);
        (radius * out + HEIGHT * DVec3::Y, DVec3::Y)
    });
    obj.text
}

/// Height of the underside of the tumbler and the drink over y = 0, m: what it stands on does not touch it.
const GAP: f64 = 0.001;

/// Straight-walled drinking glass around the y axis: outside radius 0.4, inside 0.36, height 0.9, bottom 0.1 thick.
fn tumbler() -> String {
    let mut obj =
        Obj::new("tumbler: radius 0.4 m outside, 0.36 m inside, height 0.9 m, bottom 0.1 m thick");
    wall(&mut obj, 0.4, [GAP, 0.9], 1.0);
    wall(&mut obj, 0.36, [0.1, 0.9], -1.0);
    annulus(&mut obj, [0.0, 0.4], GAP, -1.0, 4);
    annulus(&mut obj, [0.0, 0.36], 0.1, 1.0, 4);
    annulus(&mut obj, [0.36, 0.4], 0.9, 1.0, 1);
    obj.text
}

/// What is in the tumbler. It reaches into the middle of the glass, which displaces it.
fn drink() -> String {
    const SURFACE: f64 = 0.62;
    let mut obj = Obj::new("what fills the tumbler up to 0.62 m: reaches into its wall and bottom");
    wall(&mut obj, 0.38, [0.05, SURFACE], 1.0);
    annulus(&mut obj, [0.0, 0.38], 0.05, -1.0, 4);
    annulus(&mut obj, [0.0, 0.38], SURFACE, 1.0, 4);
    obj.text
}

/// Quads around the y axis, for [`wall`] and [`annulus`].
const AROUND: usize = 192;

/// Upright prism around the y axis on an equilateral triangle, one edge toward +z.
fn prism() -> String {
    const SIDE: f64 = 0.06;
    const HEIGHT: f64 = 0.16;
    let mut obj = Obj::new("upright prism: equilateral triangle of side 0.06 m, height 0.16 m");
    let corner = |i: usize| SIDE / 3.0f64.sqrt() * around(FRAC_PI_2 - TAU * (i % 3) as f64 / 3.0);
    for side in 0..3 {
        let out = (corner(side) + corner(side + 1)).normalize();
        obj.grid([1, 1], |i, j| {
            (corner(side + i) + [GAP, HEIGHT][j] * DVec3::Y, out)
        });
    }
    for (height, order) in [(GAP, [0, 2, 1]), (HEIGHT, [0, 1, 2])] {
        let normal = if height == GAP { -DVec3::Y } else { DVec3::Y };
        let face = order.map(|i| obj.corner(corner(i) + height * DVec3::Y, normal));
        obj.face(&face);
    }
    obj.text
}

/// Wall of an upright cylinder around the y axis; the front faces outward, or inward where `side` is −1.
fn wall(obj: &mut Obj, radius: f64, [low, high]: [f64; 2], side: f64) {
    const ROWS: usize = 6;
    obj.grid([AROUND, ROWS], |i, j| {
        let out = around(-side * TAU * (i % AROUND) as f64 / AROUND as f64);
        let height = low + (high - low) * j as f64 / ROWS as f64;
        (radius * out + height * DVec3::Y, side * out)
    });
}

/// Flat ring or disc around the y axis; the front faces up, or down where `side` is −1.
fn annulus(obj: &mut Obj, [inner, outer]: [f64; 2], height: f64, side: f64, rows: usize) {
    obj.grid([AROUND, rows], |i, j| {
        let out = around(side * TAU * (i % AROUND) as f64 / AROUND as f64);
        let radius = inner + (outer - inner) * j as f64 / rows as f64;
        (radius * out + height * DVec3::Y, side * DVec3::Y)
    });
}

/// Inside of the half x > 0 of an upright cylinder around the y axis: radius 1, height 0.4.
fn half_cylinder() -> String {
    let mut obj = Obj::new("inside of half a cylinder, x > 0: radius 1 m, height 0.4 m");
    obj.grid([128, 12], |i, j| {
        let out = around(PI * i as f64 / 128.0 - FRAC_PI_2);
        (out + 0.4 * j as f64 / 12.0 * DVec3::Y, -out)
    });
    obj.text
}

/// Outside of the half x > 0 of an upright cylinder around the y axis, just around [`half_cylinder`], and its rim.
fn half_sleeve() -> String {
    const RADIUS: f64 = 1.004;
    let mut obj = Obj::new("outside of half a cylinder, x > 0: radius 1.004 m, height 0.4 m");
    let out = |i: usize| around(PI * i as f64 / 64.0 - FRAC_PI_2);
    obj.grid([64, 1], |i, j| {
        let out = out(64 - i);
        (RADIUS * out + 0.4 * j as f64 * DVec3::Y, out)
    });
    obj.grid([64, 1], |i, j| {
        ([0.999, RADIUS][j] * out(i) + 0.4 * DVec3::Y, DVec3::Y)
    });
    // The two ends.
    for (end, side) in [(0, 1.0), (64, -1.0)] {
        obj.grid([1, 1], |i, j| {
            let across = [0.999, RADIUS][if side > 0.0 { 1 - i } else { i }];
            let height = 0.4 * j as f64;
            (across * out(end) + height * DVec3::Y, -DVec3::X)
        });
    }
    obj.text
}

/// Paraboloid y = r²/4f, f = 1, up to r = 0.5, facing up: the concentric map of the square
/// (Shirley and Chiu 1997) keeps its quads about as long as wide.
fn dish() -> String {
    const FOCAL_LENGTH: f64 = 1.0;
    const APERTURE: f64 = 0.5;
    const SIDE: usize = 48;
    let mut obj = Obj::new("paraboloid: focal length 1 m, aperture radius 0.5 m");
    obj.disc(SIDE, |square| {
        let at = APERTURE * concentric(square);
        let (x, z) = (at.x, -at.y);
        let height = at.length_squared() / (4.0 * FOCAL_LENGTH);
        let slope = 1.0 / (2.0 * FOCAL_LENGTH);
        let normal = DVec3::new(-slope * x, 1.0, -slope * z).normalize();
        (DVec3::new(x, height, z), normal)
    });
    obj.text
}

/// Maps the square [−1, 1]² to the unit disc, keeping areas in proportion.
fn concentric(square: DVec2) -> DVec2 {
    let DVec2 { x: a, y: b } = square;
    if a == 0.0 && b == 0.0 {
        DVec2::ZERO
    } else if a.abs() > b.abs() {
        a * DVec2::from_angle(FRAC_PI_4 * b / a)
    } else {
        b * DVec2::from_angle(FRAC_PI_2 - FRAC_PI_4 * a / b)
    }
}

/// Sphere of radius 0.5 around (0, 1, 0) as an icosahedron divided four times. Its corners lie
/// slightly outside the sphere, so that the mesh's area is the sphere's 4πR² and it reflects as
/// much light; the normals are the sphere's.
fn ball() -> String {
    const RADIUS: f64 = 0.5;
    let (directions, triangles) = icosphere(4);
    let area: f64 = (triangles.iter())
        .map(|corners| {
            let [a, b, c] = corners.map(|corner| directions[corner]);
            (b - a).cross(c - a).length() / 2.0
        })
        .sum();
    let radius = RADIUS * (4.0 * PI / area).sqrt();
    let mut obj = Obj::new("sphere around (0, 1, 0), 5120 triangles with the area of radius 0.5 m");
    for corners in triangles {
        let corners = corners.map(|corner| {
            let direction = directions[corner];
            obj.corner(DVec3::Y + radius * direction, direction)
        });
        obj.face(&corners);
    }
    obj.text
}

/// Unit vectors and triangles, counter-clockwise from outside: an icosahedron, each triangle
/// divided into four `levels` times.
fn icosphere(levels: u32) -> (Vec<DVec3>, Vec<[usize; 3]>) {
    // Two poles, and two rings of five at the latitudes ±atan(1/2).
    let latitude = 0.5f64.atan();
    let mut directions = vec![DVec3::Y];
    for i in 0..5 {
        directions.push(latitude.cos() * around(TAU * i as f64 / 5.0) + latitude.sin() * DVec3::Y);
    }
    for i in 0..5 {
        let out = around(TAU * (i as f64 + 0.5) / 5.0);
        directions.push(latitude.cos() * out - latitude.sin() * DVec3::Y);
    }
    directions.push(-DVec3::Y);
    let mut triangles = Vec::new();
    for i in 0..5 {
        let (upper, upper_next) = (1 + i, 1 + (i + 1) % 5);
        let (lower, lower_next) = (6 + i, 6 + (i + 1) % 5);
        triangles.push([0, upper_next, upper]);
        triangles.push([upper, upper_next, lower]);
        triangles.push([lower, upper_next, lower_next]);
        triangles.push([lower, lower_next, 11]);
    }
    for _ in 0..levels {
        let mut middles = HashMap::new();
        let mut middle = |a: usize, b: usize| {
            *middles.entry((a.min(b), a.max(b))).or_insert_with(|| {
                directions.push((directions[a] + directions[b]).normalize());
                directions.len() - 1
            })
        };
        triangles = (triangles.iter())
            .flat_map(|&[a, b, c]| {
                let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
                [[a, ab, ca], [b, bc, ab], [c, ca, bc], [ab, bc, ca]]
            })
            .collect();
    }
    (directions, triangles)
}

/// Plate of 1 m², facing up, whose height is a sum of sines: focal lengths from 0.3 m on, so that
/// its caustic has folds 0.8 m above.
fn bumps() -> String {
    const SIDE: usize = 48;
    // Amplitude in m; wave vector along x and z in rad/m; phase in rad.
    const WAVES: [(f64, DVec2, f64); 5] = [
        (0.003, DVec2::new(11.0, 3.0), 0.3),
        (0.002, DVec2::new(-5.0, 14.0), 1.7),
        (0.0015, DVec2::new(17.0, 9.0), 4.1),
        (0.001, DVec2::new(8.0, -19.0), 2.6),
        (0.001, DVec2::new(-21.0, 12.0), 5.5),
    ];
    let mut obj = Obj::new("bumpy plate: 1 m by 1 m, bumps of a few mm");
    obj.grid([SIDE, SIDE], |i, j| {
        let at = DVec2::new(i as f64, -(j as f64)) / SIDE as f64 + DVec2::new(-0.5, 0.5);
        let (mut height, mut slope) = (0.0, DVec2::ZERO);
        for (amplitude, wave, phase) in WAVES {
            let argument = wave.dot(at) + phase;
            height += amplitude * argument.sin();
            slope += amplitude * argument.cos() * wave;
        }
        let normal = DVec3::new(-slope.x, 1.0, -slope.y).normalize();
        (DVec3::new(at.x, height, at.y), normal)
    });
    obj.text
}

/// Upright round post with a flat top, radius 0.06, height 0.3, standing on y = 0 in the caustic
/// of the ring under the sun of `blocker.toml`.
fn post() -> String {
    const SEGMENTS: usize = 48;
    const FOOT: DVec3 = DVec3::new(0.52, 0.0, -0.3);
    let angle = |i: usize| TAU * i as f64 / SEGMENTS as f64;
    let place = |out: DVec3, height: f64| FOOT + 0.06 * out + height * DVec3::Y;
    let mut obj = Obj::new("post: radius 0.06 m, height 0.3 m");
    obj.grid([SEGMENTS, 3], |i, j| {
        let out = around(-angle(i));
        (place(out, 0.1 * j as f64), out)
    });
    let top: Vec<_> = (0..SEGMENTS)
        .map(|i| obj.corner(place(around(-angle(i)), 0.3), DVec3::Y))
        .collect();
    obj.face(&top);
    obj.text
}

/// Bowl on its side, resting with its rim on y = 0 and open toward +z: a cap of a sphere, 40° to every
/// side of its axis, 2 mm thick.
fn bowl() -> String {
    const RADII: [f64; 2] = [0.18, 0.182];
    const SIDE: usize = 40;
    let widest = 40f64.to_radians();
    let middle = RADII[1] * widest.sin() * DVec3::Y;
    let out = |square: DVec2| {
        let disc = concentric(square);
        let (sine, cosine) = (widest * disc.length()).sin_cos();
        (disc.normalize_or_zero() * sine).extend(-cosine)
    };
    let mut obj = Obj::new("bowl: inside radius 0.18 m, outside 0.182 m, opening 0.23 m wide");
    for (radius, side) in [(RADII[0], -1.0), (RADII[1], 1.0)] {
        obj.disc(SIDE, |square| {
            // The front faces toward `side`, so the outside runs the other way round.
            let out = out(DVec2::new(-side * square.x, square.y));
            (middle + radius * out, side * out)
        });
    }
    // Counter-clockwise around the square.
    let border = |i: usize| {
        let along = 2.0 * (i % SIDE) as f64 / SIDE as f64 - 1.0;
        let turn = DVec2::from_angle(FRAC_PI_2 * (i / SIDE) as f64);
        out(turn.rotate(DVec2::new(1.0, along)))
    };
    obj.grid([4 * SIDE, 1], |i, j| {
        let out = border(i % (4 * SIDE));
        let across = (DVec3::Z - out.z * out).normalize();
        (middle + RADII[1 - j] * out, across)
    });
    obj.text
}

/// Pot of sheet metal on y = 0 around the y axis, 0.13 m high: upright at the foot and opening toward the
/// lip, so that its outside is hollow from bottom to top and gathers light around the foot.
fn pot() -> String {
    const SEGMENTS: usize = 64;
    const OUTSIDE: [DVec2; 4] = [
        DVec2::new(0.055, 0.0),
        DVec2::new(0.055, 0.06),
        DVec2::new(0.057, 0.09),
        DVec2::new(0.085, 0.13),
    ];
    const THICKNESS: DVec2 = DVec2::new(0.002, 0.0);
    let inside = OUTSIDE.map(|point| point - THICKNESS);
    let bottom = DVec2::new(0.0, 0.002);
    let mut obj = Obj::new("pot: 0.11 m wide at the foot, 0.17 m at the lip, 0.13 m high");
    obj.lathe(OUTSIDE, [SEGMENTS, 20]);
    obj.lathe(line(OUTSIDE[3], inside[3]), [SEGMENTS, 1]);
    obj.lathe(reversed(inside), [SEGMENTS / 2, 8]);
    obj.lathe(line(inside[0] + bottom, bottom), [SEGMENTS / 2, 1]);
    obj.text
}

const CUP_MTL: &str = "\
# of cup.obj; made by examples/generate_assets
newmtl steel
Ks 0.78 0.76 0.72
illum 3
newmtl enamel
Kd 0.82 0.81 0.78
";

/// Enamelled cup with a steel lining, on y = 0 around the y axis, 0.078 m high. The lining is a cylinder
/// of radius 0.036 from y = 0.05 up. Between it and the outside there is room for the corners of a
/// square around the lining at y = 0.057.
fn cup() -> String {
    const SEGMENTS: usize = 96;
    const LINING: f64 = 0.036;
    const RIM: [f64; 2] = [0.0385, 0.078];
    let rim = DVec2::from(RIM);
    let lip = DVec2::new(LINING, 0.0765);
    let mut obj = Obj::new("cup: 0.115 m wide, 0.078 m high, lining of radius 0.036 m");
    obj.text += "mtllib cup.mtl\nusemtl steel\n";
    obj.lathe(line(lip, DVec2::new(LINING, 0.05)), [3 * SEGMENTS / 2, 6]);
    obj.text += "usemtl enamel\n";
    let belly = [(0.030, 0.0), (0.068, 0.008), (0.062, 0.066)].map(DVec2::from);
    obj.lathe([belly[0], belly[1], belly[2], rim], [SEGMENTS, 18]);
    // From the slope of the outside over the top down into the lining.
    let over = rim + 0.06 * (rim - belly[2]);
    obj.lathe([rim, over, DVec2::new(LINING, 0.0795), lip], [SEGMENTS, 4]);
    // The handle: a tube along an arc.
    const TUBE: f64 = 0.0045;
    let middle = DVec3::new(0.052, 0.041, 0.0);
    obj.grid([12, 20], |i, j| {
        let along = DVec2::from_angle(PI * (j as f64 / 20.0 - 0.5)) * DVec2::new(0.026, 0.022);
        // Outward from the arc, an ellipse.
        let out = DVec2::new(along.x / 0.026 * 0.022, along.y / 0.022 * 0.026).normalize();
        let (sine, cosine) = (TAU * i as f64 / 12.0).sin_cos();
        let normal = (cosine * out).extend(-sine);
        (middle + along.extend(0.0) + TUBE * normal, normal)
    });
    obj.text
}

/// A straight line as a Bézier curve.
fn line(from: DVec2, to: DVec2) -> [DVec2; 4] {
    [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0].map(|t| from.lerp(to, t))
}

fn reversed([a, b, c, d]: [DVec2; 4]) -> [DVec2; 4] {
    [d, c, b, a]
}

/// Radiance 1 W/m²/sr from everywhere.
fn constant_environment() -> Vec<u8> {
    equirectangular(16, 8, |_, _| DVec3::ONE)
}

/// A room: grey walls, a brighter ceiling, a dark floor, and two windows of other colours.
fn studio() -> Vec<u8> {
    const WALL: DVec3 = DVec3::new(0.30, 0.29, 0.27);
    const CEILING: DVec3 = DVec3::new(0.55, 0.54, 0.52);
    const FLOOR: DVec3 = DVec3::new(0.10, 0.08, 0.06);
    // Azimuths and elevations, degrees, and radiance.
    const WINDOWS: [([f64; 2], [f64; 2], DVec3); 2] = [
        ([255.0, 280.0], [18.0, 52.0], DVec3::new(24.0, 28.0, 34.0)),
        ([335.0, 355.0], [20.0, 50.0], DVec3::new(30.0, 25.0, 18.0)),
    ];
    equirectangular(512, 8, |azimuth, elevation| {
        let within = |[low, high]: [f64; 2], x: f64| (low..high).contains(&x.to_degrees());
        let window = (WINDOWS.iter())
            .find(|(across, up, _)| within(*across, azimuth) && within(*up, elevation));
        match window {
            Some((_, _, radiance)) => *radiance,
            None if elevation.to_degrees() > 60.0 => CEILING,
            None if elevation < 0.0 => FLOOR,
            None => WALL,
        }
    })
}

/// A clear sky over dark ground, and the sun in it: a disc of angular radius 0.2665° that gives
/// 1 W/m² on a plane that faces it, as much as the sky gives on the ground.
fn sunny() -> Vec<u8> {
    const RADIUS: f64 = 0.2665;
    const SKY: DVec3 = DVec3::new(0.20, 0.32, 0.50);
    const GROUND: DVec3 = DVec3::new(0.05, 0.045, 0.04);
    let toward = DVec3::new(-0.7, 0.55, 0.4).normalize();
    let sine = RADIUS.to_radians().sin();
    let sun = DVec3::new(1.0, 0.93, 0.82) / (PI * sine * sine);
    equirectangular(1024, 8, |azimuth, elevation| {
        let level = elevation.cos();
        let direction = DVec3::new(
            level * azimuth.sin(),
            elevation.sin(),
            -level * azimuth.cos(),
        );
        if direction.cross(toward).length() < sine && direction.dot(toward) > 0.0 {
            sun
        } else if elevation < 0.0 {
            GROUND
        } else {
            // Brighter toward the horizon.
            SKY * (1.0 + (1.0 - elevation.sin()).powi(3))
        }
    })
}

/// Radiance by azimuth (0 to 2π) and elevation, rad, as an image of Radiance RGBE, `height` pixels
/// high and twice as wide; pixels are averages over the square of `points`.
fn equirectangular(height: u32, points: u32, radiance: impl Fn(f64, f64) -> DVec3) -> Vec<u8> {
    let width = 2 * height;
    let step = PI / f64::from(height * points);
    let pixel = |i: u32| {
        let (column, row) = (i % width, i / width);
        let mut sum = DVec3::ZERO;
        for point in 0..points * points {
            let x = column * points + point % points;
            let y = row * points + point / points;
            let at = |place: u32| (f64::from(place) + 0.5) * step;
            sum += radiance(at(x), FRAC_PI_2 - at(y));
        }
        image::Rgb((sum / f64::from(points * points)).as_vec3().to_array())
    };
    let pixels: Vec<_> = (0..width * height).map(pixel).collect();
    let mut content = Vec::new();
    image::codecs::hdr::HdrEncoder::new(&mut content)
        .encode(&pixels, width as usize, height as usize)
        .expect("memory takes any image");
    content
}

/// Unit vector in the xz plane, from +x toward +z.
fn around(angle: f64) -> DVec3 {
    DVec3::new(angle.cos(), 0.0, angle.sin())
}
