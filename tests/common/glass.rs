//! Scenes of glass with closed forms: plates, prisms, drops and lenses.

use super::closed_forms::{Asked, Case, Figure, Form, Solver, Twin, Unit};
use super::{flux, footprint, load, middles, object_mut, ratio_error, rect, toward_sun};
use glam::{DVec2, DVec3};
use nephroid::image_file::RgbImage;
use nephroid::optics::fresnel_dielectric;
use nephroid::scene::{
    Dielectric, Geometry, Light, LightKind, Material, MaterialKind, Mesh, Object, Rect, Scene,
};
use std::f64::consts::{FRAC_1_SQRT_2, PI};
use std::sync::Arc;

const RECEIVER: &str = "floor";

/// A box with flat faces, closed, the fronts outside.
pub fn block(low: DVec3, high: DVec3) -> Geometry {
    let mut mesh = Mesh::default();
    for axis in 0..3 {
        for side in [0.0, 1.0] {
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let corner = |s: f64, t: f64| {
                let mut share = DVec3::ZERO;
                (share[axis], share[u], share[v]) = (side, s, t);
                low + share * (high - low)
            };
            let corners =
                [(0.0, 0.0), (1.0, 0.0), (1.0, 1.0), (0.0, 1.0)].map(|(s, t)| corner(s, t));
            add_polygon(&mut mesh, &corners, side > 0.0);
        }
    }
    Geometry::Mesh(Arc::new(mesh))
}

/// A flat convex face with its front where its corners run counter-clockwise, or on the other side.
fn add_polygon(mesh: &mut Mesh, corners: &[DVec3], is_front: bool) {
    let side = if is_front { 1.0 } else { -1.0 };
    let normal = side
        * (corners[1] - corners[0])
            .cross(corners[2] - corners[1])
            .normalize();
    let first = mesh.positions.len() as u32;
    mesh.positions.extend(corners);
    mesh.normals.extend(vec![normal; corners.len()]);
    for i in 1..corners.len() as u32 - 1 {
        let [b, c] = if is_front { [i, i + 1] } else { [i + 1, i] };
        mesh.triangles.push([first, first + b, first + c]);
    }
}

/// A triangle in the plane z = 0, counter-clockwise, as a column from z = −`half` to `half`.
fn column(corners: [DVec2; 3], half: f64) -> Geometry {
    let mut mesh = Mesh::default();
    let at = |z: f64| corners.map(|corner| corner.extend(z));
    add_polygon(&mut mesh, &at(half), true);
    add_polygon(&mut mesh, &at(-half), false);
    for i in 0..3 {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        let side =
            [(a, -half), (b, -half), (b, half), (a, half)].map(|(corner, z)| corner.extend(z));
        add_polygon(&mut mesh, &side, true);
    }
    Geometry::Mesh(Arc::new(mesh))
}

/// Body of revolution: see [`Mesh::revolved`]. Its profile runs from the axis at the bottom to the axis at the top.
fn turned(profile: &[Vec<[DVec2; 2]>]) -> Geometry {
    Geometry::Mesh(Arc::new(Mesh::revolved(profile, 96)))
}

/// A straight part of a profile; the outside is at the right of its way up.
fn straight(from: DVec2, to: DVec2) -> Vec<[DVec2; 2]> {
    let normal = -(to - from).perp().normalize();
    vec![[from, normal], [to, normal]]
}

/// Steps of a curve of a profile.
const STEPS: u32 = 48;

/// By an angle from `from` to `to`.
fn curved(from: f64, to: f64, point: impl Fn(f64) -> [DVec2; 2]) -> Vec<[DVec2; 2]> {
    (0..=STEPS)
        .map(|i| point(from + (to - from) * f64::from(i) / f64::from(STEPS)))
        .collect()
}

/// Sine and cosine as (radius, height); on the axis exactly.
fn turn(angle: f64) -> DVec2 {
    match angle.sin().abs() < 1e-12 {
        true => DVec2::new(0.0, angle.cos().signum()),
        false => DVec2::new(angle.sin(), angle.cos()),
    }
}

/// Bodies and a receiver in a white point of light.
pub fn scene(toward: DVec3, receiver: Rect, bodies: Vec<(MaterialKind, Geometry)>) -> Scene {
    let paper = MaterialKind::Diffuse {
        albedo: DVec3::splat(0.5),
    };
    let mut materials = vec![Material::new("paper", paper)];
    let mut objects = vec![Object {
        light_map: Some([32, 32]),
        ..Object::new(RECEIVER, 0, Geometry::Rect(receiver))
    }];
    for (kind, geometry) in bodies {
        let name = format!("body {}", materials.len());
        objects.push(Object::new(name.clone(), materials.len(), geometry));
        materials.push(Material::new(name, kind));
    }
    Scene {
        camera: load("mirror.toml").camera,
        lights: vec![Light {
            name: "sun".into(),
            kind: LightKind::Sun {
                direction: toward.normalize(),
                irradiance: DVec3::ONE,
                angular_radius: 0.0,
            },
        }],
        materials,
        objects,
        max_interfaces: 16,
        textures: Vec::new(),
    }
}

/// A square of the half side `half` around the origin, facing up.
fn square(half: f64) -> Rect {
    Rect {
        origin: DVec3::new(-half, 0.0, half),
        edge_u: 2.0 * half * DVec3::X,
        edge_v: 2.0 * half * DVec3::NEG_Z,
    }
}

fn glass(ior: f64) -> MaterialKind {
    MaterialKind::Dielectric(Dielectric::new(ior))
}

/// The scene with another index of refraction, here by 2 %, of its first body.
fn denser(mut scene: Scene) -> Scene {
    if let MaterialKind::Dielectric(dielectric) = &mut scene.materials[1].kind {
        dielectric.ior *= 1.02;
    }
    scene
}

/// Mean place of the light of a map, by the coordinates u and v of the receiver, m from its centre.
fn centroid(scene: &Scene, map: &RgbImage) -> DVec2 {
    let rect = rect(scene, RECEIVER);
    let centre = rect.origin + 0.5 * (rect.edge_u + rect.edge_v);
    let (mut sum, mut total) = (DVec3::ZERO, 0.0);
    for (place, rgb) in middles(scene, RECEIVER, [map.width, map.height])
        .iter()
        .zip(&map.pixels)
    {
        sum += f64::from(rgb[0]) * (*place - centre);
        total += f64::from(rgb[0]);
    }
    let mean = sum / total;
    DVec2::new(
        mean.dot(rect.edge_u.normalize()),
        mean.dot(rect.edge_v.normalize()),
    )
}

pub static PLATE: Form = Form {
    title: "Plane plate",
    formula: "Thickness t, absorption σ, angles θ and θ′ outside and inside, F Fresnel's reflectance of a face:
T = (1 − F)² a / (1 − F² a²),   a = e^(−σt/cos θ′);   (1 − F)/(1 + F) without absorption
light is shifted across its way by t sin θ (1 − cos θ/√(n² − sin² θ)), after 2k reflections by 2k t sin θ′ more along the plate",
    source: "M. Born and E. Wolf, *Principles of Optics*, 7th ed., sections 1.5.2 and 7.6: a geometric series of reflections \
             inside; Snell's law",
};

const PLATE_SIGMA: DVec3 = DVec3::new(0.0, 2.0, 9.0);
const PLATE_THICKNESS: f64 = 0.1;

/// A plate under slanting light, much wider than the floor, so that its sides light none of it.
fn plate() -> Scene {
    let glass = MaterialKind::Dielectric(Dielectric {
        absorption: PLATE_SIGMA,
        ..Dielectric::new(1.5)
    });
    let [low, high] = [
        DVec3::new(-2.0, 0.05, -2.0),
        DVec3::new(2.0, 0.05 + PLATE_THICKNESS, 2.0),
    ];
    scene(
        DVec3::new(0.5, 0.8, 0.2),
        square(0.25),
        vec![(glass, block(low, high))],
    )
}

static PLATE_TRANSMITTANCE: Figure = Figure {
    name: "transmittance, worst channel",
    unit: Unit::Relative,
    error: |scene, map| {
        let cosine = toward_sun(scene).y;
        let inside = (1.0 - (1.0 - cosine * cosine) / 2.25).sqrt();
        let f = fresnel_dielectric(cosine, 1.0 / 1.5);
        let a = (-PLATE_SIGMA * PLATE_THICKNESS / inside).exp();
        let exact = cosine * (1.0 - f).powi(2) * a / (DVec3::ONE - (f * a).powf(2.0));
        let area = rect(scene, RECEIVER).area();
        ratio_error(flux(map, &rect(scene, RECEIVER)), (area * exact).to_array())
    },
};

/// A plate that is 2 % thicker.
fn thicker(mut scene: Scene) -> Scene {
    if let Geometry::Mesh(mesh) = &mut object_mut(&mut scene, "body 1").geometry {
        let positions = &mut Arc::make_mut(mesh).positions;
        let [low, high] = (positions.iter()).fold([f64::INFINITY, 0.0f64], |[low, high], p| {
            [low.min(p.y), high.max(p.y)]
        });
        (positions.iter_mut()).for_each(|p| p.y = low + 1.02 * (p.y - low).min(high - low));
    }
    scene
}

const SHIFT_THICKNESS: f64 = 0.2;

/// A square mirror sends level light down at 45° through a plate. The level light itself passes the plate from side to side.
fn plate_under_mirror() -> Scene {
    let down = DVec3::new(-FRAC_1_SQRT_2, -FRAC_1_SQRT_2, 0.0);
    let normal = (down + DVec3::X).normalize();
    let along = normal.cross(DVec3::Z);
    let half = 0.2;
    let centre = -1.2 * down;
    let mirror = Rect {
        origin: centre - half * (DVec3::Z + along),
        edge_u: 2.0 * half * DVec3::Z,
        edge_v: 2.0 * half * along,
    };
    let mirror = match mirror.normal().dot(normal) > 0.0 {
        true => mirror,
        false => Rect {
            edge_u: mirror.edge_v,
            edge_v: mirror.edge_u,
            ..mirror
        },
    };
    let [low, high] = [
        DVec3::new(-1.5, 0.1, -0.5),
        DVec3::new(1.5, 0.1 + SHIFT_THICKNESS, 0.5),
    ];
    let polished = MaterialKind::Mirror {
        reflectance: DVec3::ONE,
    };
    let bodies = vec![
        (glass(1.5), block(low, high)),
        (polished, Geometry::Rect(mirror)),
    ];
    scene(DVec3::X, square(0.7), bodies)
}

/// Over the shift of the light that passes directly.
static PLATE_SHIFT: Figure = Figure {
    name: "shift of the light",
    unit: Unit::Relative,
    error: |scene, map| {
        let (n, sine, cosine) = (1.5f64, FRAC_1_SQRT_2, FRAC_1_SQRT_2);
        let root = (n * n - sine * sine).sqrt();
        let across = SHIFT_THICKNESS * sine * (1.0 - cosine / root);
        // Along the floor; the light comes from +x.
        let direct = across / cosine;
        // Further images, F² as bright each, 2 t tan θ′ apart.
        let f = fresnel_dielectric(cosine, 1.0 / n);
        let step = 2.0 * SHIFT_THICKNESS * sine / root;
        let later = step * f * f / (1.0 - f * f);
        let exact = direct - later;
        (centroid(scene, map).x - exact).abs() / direct
    },
};

pub static PRISM: Form = Form {
    title: "Prism at minimum deviation",
    formula: "Index n, apex angle A, light that crosses the prism at right angles to the plane that halves A:
D = 2 asin(n sin(A/2)) − A",
    source: "M. Born and E. Wolf, *Principles of Optics*, 7th ed., section 4.7.2",
};

const PRISM_IOR: f64 = 1.5168;
const PRISM_DISTANCE: f64 = 2.0;

fn prism_deviation() -> f64 {
    2.0 * (PRISM_IOR / 2.0).asin() - PI / 3.0
}

/// An equilateral prism, its apex upward. Light rises to it, is level inside, and falls on a screen across its way.
fn prism() -> Scene {
    let height = 3f64.sqrt() / 2.0;
    let corners = [(-0.5, 0.0), (0.5, 0.0), (0.0, height)].map(DVec2::from);
    let (sine, cosine) = (prism_deviation() / 2.0).sin_cos();
    let sent = DVec3::new(cosine, -sine, 0.0);
    let centre = DVec3::new(0.25, height / 2.0, 0.0) + PRISM_DISTANCE * sent;
    let up = DVec3::new(sine, cosine, 0.0);
    let half = 0.6;
    let screen = Rect {
        origin: centre - half * up - half * DVec3::Z,
        edge_u: 2.0 * half * DVec3::Z,
        edge_v: 2.0 * half * up,
    };
    debug_assert!(screen.normal().dot(sent) < 0.0);
    // Keeps the rising light from the base.
    let cover = Rect {
        origin: DVec3::new(-0.5, -0.001, 0.4),
        edge_u: DVec3::X,
        edge_v: 0.8 * DVec3::NEG_Z,
    };
    let paper = MaterialKind::Diffuse {
        albedo: DVec3::ZERO,
    };
    scene(
        -DVec3::new(cosine, sine, 0.0),
        screen,
        vec![
            (glass(PRISM_IOR), column(corners, 0.4)),
            (paper, Geometry::Rect(cover)),
        ],
    )
}

static PRISM_DEVIATION: Figure = Figure {
    name: "deviation",
    unit: Unit::Relative,
    error: |scene, map| {
        let off = centroid(scene, map).y.atan2(PRISM_DISTANCE);
        (off / prism_deviation()).abs()
    },
};

pub static BALL_LENS: Form = Form {
    title: "Ball lens",
    formula:
        "Index n, radius R, light near the axis: the focus is n R / (2 (n − 1)) from the centre.
An aperture of radius h ≪ R gives a disc of radius h s/f on a screen at s before the focus",
    source: "E. Hecht, *Optics*, 5th ed., section 6.1: the thick lens of equal radii whose faces are 2R apart",
};

const BALL_APERTURE: f64 = 0.1;
const BALL_FOCUS: f64 = 1.5;
const BALL_BEFORE_FOCUS: f64 = 0.25;

/// The middle of a ball of radius 1, cut out along its axis, over a screen before its focus.
fn ball_lens() -> Scene {
    let centre = DVec2::new(0.0, BALL_FOCUS - BALL_BEFORE_FOCUS);
    let widest = BALL_APERTURE.asin();
    let on_ball = |angle: f64| [centre + turn(angle), turn(angle)];
    let (below, above) = (
        curved(PI, PI - widest, on_ball),
        curved(widest, 0.0, on_ball),
    );
    let side = straight(below[STEPS as usize][0], above[0][0]);
    let lens = turned(&[below, side, above]);
    scene(DVec3::Y, square(0.03), vec![(glass(1.5), lens)])
}

/// The distance of the focus from the centre, by the size of the disc.
static BALL_FOCAL_LENGTH: Figure = Figure {
    name: "distance of the focus",
    unit: Unit::Relative,
    error: |scene, map| {
        let (mut sum, mut total) = (0.0, 0.0);
        for (place, rgb) in middles(scene, RECEIVER, [map.width, map.height])
            .iter()
            .zip(&map.pixels)
        {
            sum += f64::from(rgb[0]) * (place.x * place.x + place.z * place.z);
            total += f64::from(rgb[0]);
        }
        // A disc's mean square of the distance from its centre is half the square of its radius; a texel adds a sixth of its
        // side's.
        let side = 0.06 / f64::from(map.width);
        let radius = (2.0 * (sum / total - side * side / 6.0)).sqrt();
        let before = radius / BALL_APERTURE * BALL_FOCUS;
        (before - BALL_BEFORE_FOCUS).abs() / BALL_FOCUS
    },
};

pub static STIGMATIC: Form = Form {
    title: "Stigmatic lenses",
    formula: "Index n, focal length f, φ from the axis, as seen from the focus; light along the axis goes to the focus by
a hyperboloid behind a plane:   r = f (n − 1)/(n cos φ − 1)
an ellipsoid before a sphere around the focus:   r = f (n − 1)/(n − cos φ)
flux ∫ E₀ (1 − F₁)(1 − F₂) 2πρ dρ,   ρ = r sin φ",
    source: "R. Descartes, *La Dioptrique* (1637), discourse 8; derived from equal optical lengths",
};

const LENS_IOR: f64 = 1.5;
/// Largest angle φ, rad.
const LENS_ANGLE: f64 = 0.35;
/// Radius of the sphere of the elliptic lens.
const INNER: f64 = 0.3;

/// Radius and height over the focus of a point of the refracting face, f = 1.
fn on_lens(is_hyperbolic: bool, angle: f64) -> DVec2 {
    let n = LENS_IOR;
    let radius = match is_hyperbolic {
        true => (n - 1.0) / (n * angle.cos() - 1.0),
        false => (n - 1.0) / (n - angle.cos()),
    };
    radius * turn(angle)
}

/// Outward.
fn lens_normal(is_hyperbolic: bool, angle: f64) -> DVec2 {
    let n = LENS_IOR;
    match is_hyperbolic {
        true => (turn(angle) - n * DVec2::Y).normalize(),
        false => (n * turn(angle) - DVec2::Y).normalize(),
    }
}

fn hyperbolic_lens() -> Scene {
    let face = curved(0.0, LENS_ANGLE, |angle| {
        [on_lens(true, angle), lens_normal(true, angle)]
    });
    let rim = face[STEPS as usize][0];
    let top = DVec2::new(rim.x, 1.3);
    let profile = [
        face,
        straight(rim, top),
        straight(top, DVec2::new(0.0, top.y)),
    ];
    scene(
        DVec3::Y,
        square(SPOT),
        vec![(glass(LENS_IOR), turned(&profile))],
    )
}

fn elliptic_lens() -> Scene {
    let inner = curved(0.0, LENS_ANGLE, |angle| [INNER * turn(angle), -turn(angle)]);
    let face = curved(LENS_ANGLE, 0.0, |angle| {
        [on_lens(false, angle), lens_normal(false, angle)]
    });
    let side = straight(inner[STEPS as usize][0], face[0][0]);
    scene(
        DVec3::Y,
        square(SPOT),
        vec![(glass(LENS_IOR), turned(&[inner, side, face]))],
    )
}

/// Half a side of the screen in the focus: 3 % of the lenses' radius.
const SPOT: f64 = 0.01;

/// All the light is within a 1/100 of the lens's radius around the focus.
fn stigmatic_error(scene: &Scene, map: &RgbImage, is_hyperbolic: bool) -> f64 {
    let rim = on_lens(is_hyperbolic, LENS_ANGLE).x;
    let texel = rect(scene, RECEIVER).area() / map.pixels.len() as f64;
    let found: f64 = (middles(scene, RECEIVER, [map.width, map.height]).iter())
        .zip(&map.pixels)
        .filter(|(place, _)| place.x.hypot(place.z) < 0.01 * rim)
        .map(|(_, rgb)| texel * f64::from(rgb[0]))
        .sum();
    let n = LENS_IOR;
    let normal = fresnel_dielectric(1.0, n);
    let steps = 1000;
    let radius = |i: i32| on_lens(is_hyperbolic, LENS_ANGLE * f64::from(i) / f64::from(steps)).x;
    let exact: f64 = (0..steps)
        .map(|i| {
            let angle = LENS_ANGLE * (f64::from(i) + 0.5) / f64::from(steps);
            let cosine = lens_normal(is_hyperbolic, angle).y.abs();
            let ratio = if is_hyperbolic { n } else { 1.0 / n };
            let passed = (1.0 - fresnel_dielectric(cosine, ratio)) * (1.0 - normal);
            PI * (radius(i + 1).powi(2) - radius(i).powi(2)) * passed
        })
        .sum();
    (found / exact - 1.0).abs()
}

static HYPERBOLIC_FOCUS: Figure = Figure {
    name: "flux within 1 % of the lens's radius",
    unit: Unit::Relative,
    error: |scene, map| stigmatic_error(scene, map, true),
};

static ELLIPTIC_FOCUS: Figure = Figure {
    name: HYPERBOLIC_FOCUS.name,
    unit: Unit::Relative,
    error: |scene, map| stigmatic_error(scene, map, false),
};

pub static RAINBOW: Form = Form {
    title: "Primary rainbow",
    formula: "A drop of index n, one reflection inside, far away: light is brightest at the least deviation
D = π + 2i − 4r,   cos² i = (n² − 1)/3,   sin r = sin i / n;   137.92° for n = 1.3330",
    source: "R. Descartes, *Les Météores* (1637), discourse 8; M. Born and E. Wolf, *Principles of Optics*, 7th ed., \
             section 4.7.3",
};

const DROP_IOR: f64 = 1.333;
const DROP_RADIUS: f64 = 0.01;
const RAINBOW_HEIGHT: f64 = 10.0;

/// As an angle from the sun's direction, rad: π less the deviation.
fn rainbow_angle() -> f64 {
    let incidence = ((DROP_IOR * DROP_IOR - 1.0) / 3.0).sqrt().acos();
    let inside = (incidence.sin() / DROP_IOR).asin();
    4.0 * inside - 2.0 * incidence
}

/// A drop under light from above, and a piece of screen a thousand radii above it, which faces down and lets light pass.
fn drop_of_water() -> Scene {
    let on_drop = |angle: f64| [DROP_RADIUS * turn(angle), turn(angle)];
    let drop = turned(&[curved(PI, 0.0, on_drop)]);
    let at = RAINBOW_HEIGHT * rainbow_angle().tan();
    let half = 0.5;
    let screen = Rect {
        origin: DVec3::new(at - half, RAINBOW_HEIGHT, -half),
        edge_u: 2.0 * half * DVec3::X,
        edge_v: 2.0 * half * DVec3::Z,
    };
    let mut scene = scene(DVec3::Y, screen, vec![(glass(DROP_IOR), drop)]);
    scene.objects[0].blocks_light = false;
    scene
}

/// Where the light of the bow ends: half of the brightest ring's, on its dark side. The deviation's error over itself.
static RAINBOW_EDGE: Figure = Figure {
    name: "deviation",
    unit: Unit::Relative,
    error: |scene, map| {
        const RINGS: usize = 64;
        let centre = RAINBOW_HEIGHT * rainbow_angle().tan();
        let first = centre - 0.4;
        let width = 0.8 / RINGS as f64;
        let (mut sums, mut counts) = ([0.0; RINGS], [0.0; RINGS]);
        for (place, rgb) in middles(scene, RECEIVER, [map.width, map.height])
            .iter()
            .zip(&map.pixels)
        {
            let ring = (place.x.hypot(place.z) - first) / width;
            if (0.0..RINGS as f64).contains(&ring) {
                sums[ring as usize] += f64::from(rgb[0]);
                counts[ring as usize] += 1.0;
            }
        }
        let rings: Vec<f64> = sums
            .iter()
            .zip(counts)
            .map(|(sum, count): (&f64, f64)| sum / count.max(1.0))
            .collect();
        let brightest = (0..RINGS)
            .max_by(|&a, &b| rings[a].total_cmp(&rings[b]))
            .expect("rings");
        let half = 0.5 * rings[brightest];
        let beyond = (brightest..RINGS).find(|&ring| rings[ring] < half);
        let Some(beyond) = beyond.filter(|&ring| ring > 0) else {
            return f64::INFINITY;
        };
        let share = (rings[beyond - 1] - half) / (rings[beyond - 1] - rings[beyond]);
        let edge = first + (beyond as f64 - 0.5 + share) * width;
        let deviation = PI - rainbow_angle();
        let found = PI - (edge / RAINBOW_HEIGHT).atan();
        (found / deviation - 1.0).abs()
    },
};

const fn case(
    form: &'static Form,
    scene_text: &'static str,
    scene: fn() -> Scene,
    texels: u32,
    solver: Solver,
    asked: &'static [Asked],
) -> Case {
    Case {
        form,
        scene_text,
        scene,
        receiver: RECEIVER,
        texels: [texels, texels],
        solver,
        asked,
    }
}

const fn asked(figure: &'static Figure, bound: f64, twins: &'static [Twin]) -> [Asked; 1] {
    [Asked {
        figure,
        bound,
        twins,
    }]
}

static PLATE_BY_DEVICE: [Asked; 1] = asked(&PLATE_TRANSMITTANCE, 0.005, &[Twin::Of(thicker)]);
static PLATE_BY_REFERENCE: [Asked; 1] = asked(&PLATE_TRANSMITTANCE, 0.003, &[Twin::Of(thicker)]);
/// A texel is a third of the shift wide; its edges are blurred evenly.
static SHIFT_ASKED: [Asked; 1] = asked(&PLATE_SHIFT, 0.01, &[Twin::Of(denser)]);
static PRISM_ASKED: [Asked; 1] = asked(&PRISM_DEVIATION, 0.003, &[Twin::Of(denser)]);
/// Of that, 0.14 % are spherical aberration at this aperture.
static BALL_ASKED: [Asked; 1] = asked(&BALL_FOCAL_LENGTH, 0.005, &[Twin::Of(denser)]);
static HYPERBOLIC_ASKED: [Asked; 1] = asked(&HYPERBOLIC_FOCUS, 0.01, &[Twin::Of(denser)]);
static ELLIPTIC_ASKED: [Asked; 1] = asked(&ELLIPTIC_FOCUS, 0.01, &[Twin::Of(denser)]);
/// 0.1 % of the deviation are 0.14°.
static RAINBOW_ASKED: [Asked; 1] = asked(&RAINBOW_EDGE, 0.001, &[Twin::Of(denser)]);

const SAME: &str = "the same";

pub static CASES: &[Case] = &[
    case(
        &PLATE,
        "plate 0.1 m thick, light at 34°",
        plate,
        32,
        Solver::Renderer(|| footprint(16_384)),
        &PLATE_BY_DEVICE,
    ),
    case(
        &PLATE,
        SAME,
        plate,
        32,
        Solver::Reference(0.05),
        &PLATE_BY_REFERENCE,
    ),
    case(
        &PLATE,
        "plate 0.2 m thick, light at 45° from a mirror",
        plate_under_mirror,
        64,
        Solver::Renderer(|| footprint(16_384)),
        &SHIFT_ASKED,
    ),
    case(
        &PLATE,
        "the same plate and mirror",
        plate_under_mirror,
        64,
        Solver::Reference(0.03),
        &SHIFT_ASKED,
    ),
    case(
        &PRISM,
        "prism of 60°, n = 1.5168",
        prism,
        64,
        Solver::Renderer(|| footprint(16_384)),
        &PRISM_ASKED,
    ),
    case(
        &PRISM,
        SAME,
        prism,
        64,
        Solver::Reference(0.03),
        &PRISM_ASKED,
    ),
    case(
        &BALL_LENS,
        "n = 1.5, h = R/10",
        ball_lens,
        64,
        Solver::Renderer(|| footprint(16_384)),
        &BALL_ASKED,
    ),
    case(
        &BALL_LENS,
        SAME,
        ball_lens,
        64,
        Solver::Reference(0.03),
        &BALL_ASKED,
    ),
    case(
        &STIGMATIC,
        "hyperboloid, n = 1.5, φ up to 20°",
        hyperbolic_lens,
        64,
        Solver::Renderer(|| footprint(16_384)),
        &HYPERBOLIC_ASKED,
    ),
    case(
        &STIGMATIC,
        "the same hyperboloid",
        hyperbolic_lens,
        64,
        Solver::Reference(0.05),
        &HYPERBOLIC_ASKED,
    ),
    case(
        &STIGMATIC,
        "ellipsoid, n = 1.5, φ up to 20°",
        elliptic_lens,
        64,
        Solver::Renderer(|| footprint(16_384)),
        &ELLIPTIC_ASKED,
    ),
    case(
        &STIGMATIC,
        "the same ellipsoid",
        elliptic_lens,
        64,
        Solver::Reference(0.05),
        &ELLIPTIC_ASKED,
    ),
    case(
        &RAINBOW,
        "drop, a screen 1000 radii away",
        drop_of_water,
        128,
        Solver::Renderer(|| footprint(262_144)),
        &RAINBOW_ASKED,
    ),
];
