//! The scenes of the sweeps: one caster, one receiver, white suns of 1 W/m² altogether.

use crate::scene::{
    Camera, DEFAULT_MAX_INTERFACES, Geometry, Light, LightKind, Material, MaterialKind, Mesh,
    Object, Rect, Scene,
};
use glam::{DMat3, DVec2, DVec3};
use std::f64::consts::{FRAC_PI_4, PI, TAU};

/// Name of the object that receives the light.
pub const RECEIVER: &str = "receiver";
/// Angular radius of the sun as seen from the Earth, degrees.
const SUN: f64 = 0.2665;

/// Nothing casts shadows, so that only the method is put to the test and not its visibility.
pub(super) fn scene(reflector: Mesh, lights: Vec<Light>, receiver: Rect) -> Scene {
    let object = |name, material, geometry| Object {
        blocks_light: false,
        ..Object::new(name, material, geometry)
    };
    Scene {
        camera: Camera {
            position: DVec3::new(2.0, 2.0, 3.0),
            target: DVec3::ZERO,
            fov: FRAC_PI_4,
            exposure_ev: 0.0,
        },
        lights,
        materials: vec![
            Material::new(
                "mirror",
                MaterialKind::Mirror {
                    reflectance: DVec3::ONE,
                },
            ),
            Material::new(
                "paper",
                MaterialKind::Diffuse {
                    albedo: DVec3::splat(0.8),
                },
            ),
        ],
        objects: vec![
            object("caster", 0, Geometry::Mesh(reflector.into())),
            Object {
                light_map: Some([64, 64]),
                ..object(RECEIVER, 1, Geometry::Rect(receiver))
            },
        ],
        max_interfaces: DEFAULT_MAX_INTERFACES,
        textures: Vec::new(),
    }
}

/// A sun of `irradiance` W/m² and `radius` degrees.
pub(super) fn sun(direction: DVec3, irradiance: f64, radius: f64) -> Light {
    Light {
        name: "sun".into(),
        kind: LightKind::Sun {
            direction: direction.normalize(),
            irradiance: DVec3::splat(irradiance),
            angular_radius: radius.to_radians(),
        },
    }
}

pub(super) fn horizontal(half: f64, y: f64) -> Rect {
    Rect {
        origin: DVec3::new(-half, y, half),
        edge_u: 2.0 * half * DVec3::X,
        edge_v: -2.0 * half * DVec3::Z,
    }
}

/// A screen above the caster that faces down; light from above passes through.
fn ceiling(half: f64, y: f64) -> Rect {
    Rect {
        origin: DVec3::new(-half, y, -half),
        edge_u: 2.0 * half * DVec3::X,
        edge_v: 2.0 * half * DVec3::Z,
    }
}

/// Quads over [−1, 1]² at (x, −z), two triangles each, facing +y.
fn grid(cells: usize, vertex: impl Fn(DVec2) -> (DVec3, DVec3)) -> Mesh {
    let side = |i: usize| 2.0 * i as f64 / cells as f64 - 1.0;
    let mut mesh = Mesh::default();
    for j in 0..=cells {
        for i in 0..=cells {
            let (position, normal) = vertex(DVec2::new(side(i), side(j)));
            mesh.positions.push(position);
            mesh.normals.push(normal);
        }
    }
    let index = |i: usize, j: usize| (j * (cells + 1) + i) as u32;
    for j in 0..cells {
        for i in 0..cells {
            let [a, b, c, d] = [
                index(i, j),
                index(i + 1, j),
                index(i + 1, j + 1),
                index(i, j + 1),
            ];
            // Diagonals toward the middle: on a disc the others make slivers at the rim.
            mesh.triangles
                .extend(match (i < cells / 2) == (j < cells / 2) {
                    true => [[a, b, c], [a, c, d]],
                    false => [[b, c, d], [b, d, a]],
                });
        }
    }
    mesh
}

/// The square [−1, 1]² on the unit disc (Shirley and Chiu, *A low distortion map between disk and
/// square*, 1997).
fn concentric(p: DVec2) -> DVec2 {
    let (radius, angle) = if p.x.abs() > p.y.abs() {
        (p.x, FRAC_PI_4 * p.y / p.x)
    } else if p.y != 0.0 {
        (p.y, FRAC_PI_4 * (2.0 - p.x / p.y))
    } else {
        return DVec2::ZERO;
    };
    radius * DVec2::from_angle(angle)
}

/// Focal length of the dish, m,
pub const FOCAL_LENGTH: f64 = 1.0;
/// and the radius of its aperture.
pub const APERTURE: f64 = 0.5;
/// Half a side of the dish's screen, m.
pub const SCREEN: f64 = 0.3;

/// Light along the axis of a paraboloid, a screen across it at `z` m from the vertex.
pub fn dish(z: f64) -> Scene {
    let mesh = grid(32, |square| {
        let at = APERTURE * concentric(square);
        let slope = -at / (2.0 * FOCAL_LENGTH);
        let height = at.length_squared() / (4.0 * FOCAL_LENGTH);
        (
            DVec3::new(at.x, height, -at.y),
            DVec3::new(slope.x, 1.0, -slope.y).normalize(),
        )
    });
    scene(mesh, vec![sun(DVec3::Y, 1.0, 0.0)], ceiling(SCREEN, z))
}

/// A plate of 1 m × 1 m with `waves` sine waves along each side whose slope is at most `slope`
/// along each, on `cells` × `cells` quads.
fn wavy(cells: usize, waves: f64, slope: f64) -> Mesh {
    let k = TAU * waves;
    // Not in step with the mesh, whatever the number of waves.
    let wave = |x: f64, phase: f64| (slope / k * (k * x + phase).sin(), (k * x + phase).cos());
    grid(cells, |square| {
        let at = square / 2.0;
        let ((hx, cx), (hy, cy)) = (wave(at.x, 0.7), wave(at.y, 1.9));
        (
            DVec3::new(at.x, hx + hy, -at.y),
            DVec3::new(-slope * cx, 1.0, slope * cy).normalize(),
        )
    })
}

/// `waves` bumps a side on a mirror, 1 m below a screen.
pub fn bumps(waves: f64) -> Scene {
    let screen = ceiling(0.75, 1.0);
    scene(wavy(48, waves, 0.1), vec![sun(DVec3::Y, 1.0, SUN)], screen)
}

/// A wavy mirror of 1 m whose crests are `gap` m below a screen.
pub fn face(gap: f64) -> Scene {
    let (waves, slope) = (4.0, 0.025);
    let crest = 2.0 * slope / (TAU * waves);
    let screen = ceiling(0.6, crest + gap);
    scene(
        wavy(32, waves, slope),
        vec![sun(DVec3::Y, 1.0, SUN)],
        screen,
    )
}

/// The wavy mirror near its first focus, turned by `degrees` about a horizontal axis.
pub fn turned(degrees: f64) -> Scene {
    let mut mesh = wavy(32, 4.0, 0.025);
    let turn = DMat3::from_rotation_z(degrees.to_radians());
    for vector in mesh.positions.iter_mut().chain(&mut mesh.normals) {
        *vector = turn * *vector;
    }
    scene(
        mesh,
        vec![sun(DVec3::Y, 1.0, SUN)],
        ceiling(0.6, FOCAL_LENGTH),
    )
}

/// A cap of a mirror sphere of `curvature` 1/m, convex, apex at the origin: 1 m across, and the
/// whole half sphere where that is less.
fn cap(curvature: f64) -> Mesh {
    let widest = (0.5 * curvature).min(1.0).asin();
    grid(32, |square| {
        let disc = concentric(square);
        let angle = widest * disc.length();
        let (sine, cosine) = angle.sin_cos();
        let out = disc.normalize_or_zero() * sine;
        let normal = DVec3::new(out.x, cosine, -out.y);
        let depth = 2.0 * (angle / 2.0).sin().powi(2);
        (DVec3::new(out.x, -depth, -out.y) / curvature, normal)
    })
}

/// A cap of a sphere, 1 m below a screen.
pub fn curved(curvature: f64) -> Scene {
    let screen = ceiling(1.0, 1.0);
    scene(cap(curvature), vec![sun(DVec3::Y, 1.0, SUN)], screen)
}

/// A slightly convex mirror under a sun at `elevation` degrees above it, and a screen across the
/// light that its centre reflects, 1 m away.
pub fn grazing(elevation: f64) -> Scene {
    let (sine, cosine) = elevation.to_radians().sin_cos();
    let across = DVec3::new(-sine, cosine, 0.0);
    let along = DVec3::new(cosine, sine, 0.0);
    let half = 0.8;
    let screen = Rect {
        origin: along - half * across + half * DVec3::Z,
        edge_u: 2.0 * half * across,
        edge_v: -2.0 * half * DVec3::Z,
    };
    let light = sun(DVec3::new(-cosine, sine, 0.0), 1.0, SUN);
    scene(cap(0.25), vec![light], screen)
}

const RING_HEIGHT: f64 = 0.4;
/// Of the light on the ring.
const ELEVATION: f64 = 35.0;

fn ring_light() -> DVec3 {
    let (sine, cosine) = ELEVATION.to_radians().sin_cos();
    DVec3::new(cosine, sine, 0.0)
}

/// The inside of a cylinder of radius 1 m around the y axis, standing on y = 0, of `segments`
/// columns of `rows` rectangles.
fn cylinder(segments: usize, rows: usize, smooth: bool) -> Mesh {
    let inward = |i: f64| {
        let (sine, cosine) = (TAU * i / segments as f64).sin_cos();
        -DVec3::new(cosine, 0.0, sine)
    };
    let mut mesh = Mesh::default();
    for i in 0..segments {
        let first = mesh.positions.len() as u32;
        for step in [0.0, 1.0] {
            let normal = inward(i as f64 + if smooth { step } else { 0.5 });
            for row in 0..=rows {
                let y = RING_HEIGHT * row as f64 / rows as f64;
                mesh.positions.push(y * DVec3::Y - inward(i as f64 + step));
                mesh.normals.push(normal);
            }
        }
        for row in 0..rows as u32 {
            let a = first + row;
            let c = a + rows as u32 + 1;
            mesh.triangles.extend([[a, c, c + 1], [a, c + 1, a + 1]]);
        }
    }
    mesh
}

/// A ring mirror that casts the nephroid on a floor `gap` m below it, under one sun of `radius`
/// degrees.
fn ring_scene(mesh: Mesh, gap: f64, radius: f64) -> Scene {
    let light = sun(ring_light(), 1.0, radius);
    scene(mesh, vec![light], horizontal(1.0, -gap))
}

/// Quads about as long as wide.
fn fine_cylinder() -> Mesh {
    cylinder(128, 8, true)
}

/// A finely meshed ring on the floor.
pub fn ring() -> Scene {
    ring_under(SUN)
}

/// The ring under a sun of `radius` degrees.
pub fn ring_under(radius: f64) -> Scene {
    ring_scene(fine_cylinder(), 0.0, radius)
}

/// The ring over the floor, at `gap` of its height.
pub fn edge(gap: f64) -> Scene {
    ring_scene(fine_cylinder(), gap * RING_HEIGHT, SUN)
}

/// A ring of `segments` on the floor, each two triangles as high as the ring.
pub fn mesh(segments: f64, smooth: bool) -> Scene {
    ring_scene(cylinder(segments as usize, 1, smooth), 0.0, SUN)
}

/// The ring under `count` suns within 20° of the one, which they equal in sum.
pub fn suns(count: f64) -> Scene {
    let mut scene = ring();
    let direction = ring_light();
    let (a, b) = direction.any_orthonormal_pair();
    scene.lights = (0..count as u32)
        .map(|i| {
            // Vogel's spiral (1979): even on a disc.
            let radius = 20f64.to_radians().tan() * (f64::from(i) / count).sqrt();
            let angle = f64::from(i) * PI * (3.0 - 5f64.sqrt());
            let aside = radius * (angle.cos() * a + angle.sin() * b);
            sun(direction + aside, 1.0 / count, SUN)
        })
        .collect();
    scene
}

/// The ring with shadows, so that rays are traced, `scale` times as large and then moved.
pub fn transformed(scale: f64, shift: DVec3) -> Scene {
    let mut scene = ring_scene(fine_cylinder(), 0.0, SUN);
    for object in &mut scene.objects {
        object.blocks_light = true;
    }
    scene.transformed(scale, shift)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Corners counter-clockwise from the front, normals on its side and of unit length.
    #[test]
    fn meshes_are_sound() {
        let scenes = [
            dish(1.0),
            bumps(31.0),
            face(0.01),
            turned(0.2),
            curved(1e-6),
            curved(1e3),
            grazing(0.1),
            mesh(8.0, true),
            mesh(9.0, false),
            suns(64.0),
            transformed(1e3, 1e4 * DVec3::X),
        ];
        for scene in scenes {
            let mesh = scene.objects[0].geometry.as_mesh().expect("a mesh");
            for corners in &mesh.triangles {
                let [a, b, c] = corners.map(|i| mesh.positions[i as usize]);
                let face = (b - a).cross(c - a).normalize();
                for normal in corners.map(|i| mesh.normals[i as usize]) {
                    assert!((normal.length() - 1.0).abs() < 1e-9);
                    assert!(face.dot(normal) > 0.5, "{face} {normal}");
                }
            }
            let total: DVec3 = (scene.lights.iter())
                .map(|light| match light.kind {
                    LightKind::Sun { irradiance, .. } => irradiance,
                    _ => panic!("all are suns"),
                })
                .sum();
            assert!((total - DVec3::ONE).length() < 1e-9);
        }
    }
}
