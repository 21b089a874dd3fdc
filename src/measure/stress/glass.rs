//! The scenes of the sweeps through glass: one body, one receiver, a white sun of 1 W/m².

use super::scenes::{horizontal, scene, sun};
use crate::scene::{Dielectric, Dispersion, GLASSES, MaterialKind, Mesh, Scene};
use crate::spectrum::MIDDLE;
use glam::{DVec2, DVec3};
use std::f64::consts::{PI, TAU};

/// Radius of the ball, m.
const RADIUS: f64 = 0.5;
const IOR: f64 = 1.5;
/// Half a side of the floor, m.
const FLOOR: f64 = 1.0;
/// Angular radius of the sun as seen from the Earth, degrees.
const SUN: f64 = 0.2665;
/// Around a body.
const SEGMENTS: u32 = 96;

/// A straight part of a profile.
fn straight(from: DVec2, to: DVec2, rows: u32) -> Vec<[DVec2; 2]> {
    let normal = -(to - from).perp().normalize();
    (0..=rows)
        .map(|row| [from.lerp(to, f64::from(row) / f64::from(rows)), normal])
        .collect()
}

/// A body over the floor, in light from 45°.
fn on_floor(mesh: Mesh, medium: Dielectric) -> Scene {
    let light = sun(DVec3::new(-1.0, 1.0, 0.15), 1.0, SUN);
    let mut scene = scene(mesh, vec![light], horizontal(FLOOR, 0.0));
    scene.materials[0].kind = MaterialKind::Dielectric(medium);
    for object in &mut scene.objects {
        object.blocks_light = true;
    }
    scene
}

/// A ball of glass at `gap` radii over the floor.
fn ball_at(gap: f64, ior: f64) -> Scene {
    const ROWS: u32 = 48;
    let height = RADIUS * (1.0 + gap);
    let profile = (0..=ROWS).map(|row| {
        let (sine, cosine) = (PI * (1.0 - f64::from(row) / f64::from(ROWS))).sin_cos();
        // On the axis exactly.
        let out = DVec2::new(if row % ROWS == 0 { 0.0 } else { sine }, cosine);
        [RADIUS * out + height * DVec2::Y, out]
    });
    on_floor(
        Mesh::revolved(&[profile.collect()], SEGMENTS),
        Dielectric::new(ior),
    )
}

/// A ball of glass that comes down to the floor.
pub fn ball(gap: f64) -> Scene {
    ball_at(gap, IOR)
}

/// A ball whose index of refraction is more than that of air by `excess`.
pub fn faint_ball(excess: f64) -> Scene {
    ball_at(0.2, 1.0 + excess)
}

/// A ball of which light meets at most so many surfaces.
pub fn ball_of(interfaces: f64) -> Scene {
    Scene {
        max_interfaces: interfaces as u32,
        ..ball(0.2)
    }
}

/// An upright tube of glass whose wall is so thick, in outer radii.
pub fn tube(wall: f64) -> Scene {
    const LOW: f64 = 0.01;
    const HIGH: f64 = 0.6;
    let outer = 0.4;
    let inner = outer * (1.0 - wall);
    let corners = [(inner, LOW), (outer, LOW), (outer, HIGH), (inner, HIGH)].map(DVec2::from);
    let parts: Vec<_> = (0..4)
        .map(|i| {
            straight(
                corners[i],
                corners[(i + 1) % 4],
                if i % 2 == 0 { 1 } else { 6 },
            )
        })
        .collect();
    on_floor(Mesh::revolved(&parts, SEGMENTS), Dielectric::new(IOR))
}

/// A prism of three equal sides over the floor, under a sun at 15°, which light meets at so many degrees to the normal of a face.
fn prism_at(incidence: f64, medium: Dielectric) -> Scene {
    const SIDE: f64 = 0.3;
    const HALF: f64 = 0.3;
    const HEIGHT: f64 = 0.35;
    const ELEVATION: f64 = 15.0;
    // The normal of the first face lies so far below the sun, and that of the second one is 120° from it.
    let normal = (180.0 - ELEVATION - incidence).to_radians();
    let mut mesh = Mesh::default();
    let mut face = |corners: &[DVec3], normal: DVec3| {
        let first = mesh.positions.len() as u32;
        mesh.positions.extend(corners);
        mesh.normals.extend(vec![normal; corners.len()]);
        for i in 1..corners.len() as u32 - 1 {
            mesh.triangles.push([first, first + i, first + i + 1]);
        }
    };
    let middle = DVec2::new(-0.3, HEIGHT);
    let corner = |number: u32| {
        let angle = normal + PI / 3.0 + f64::from(number) * TAU / 3.0;
        middle + SIDE / 3f64.sqrt() * DVec2::from_angle(angle)
    };
    let corners = [0, 1, 2].map(corner);
    face(&corners.map(|at| at.extend(HALF)), DVec3::Z);
    let [a, b, c] = corners.map(|at| at.extend(-HALF));
    face(&[a, c, b], DVec3::NEG_Z);
    for i in 0..3 {
        let (a, b) = (corners[i], corners[(i + 1) % 3]);
        let out = (0.5 * (a + b) - middle).normalize();
        let at = [(a, HALF), (a, -HALF), (b, -HALF), (b, HALF)];
        face(&at.map(|(at, z)| at.extend(z)), out.extend(0.0));
    }
    let mut scene = on_floor(mesh, medium);
    let elevation = ELEVATION.to_radians();
    let toward = DVec3::new(-elevation.cos(), elevation.sin(), 0.0);
    scene.lights = vec![sun(toward, 1.0, SUN)];
    scene
}

/// A prism that light meets at so many degrees to the normal of a face. Below 27.92° all of it is reflected at the next one.
pub fn prism(incidence: f64) -> Scene {
    prism_at(incidence, Dielectric::new(IOR))
}

/// A prism that disperses light so much more than SF10 does, with the same index at 550 nm.
pub fn dispersing_prism(factor: f64) -> Scene {
    let glass = Dispersion::Sellmeier(GLASSES[1].1);
    let index =
        |wavelength| glass.index(MIDDLE) + factor * (glass.index(wavelength) - glass.index(MIDDLE));
    prism_at(
        55.0,
        Dielectric {
            dispersion: Some(Dispersion::through([0.65, MIDDLE, 0.45].map(index))),
            ..Dielectric::new(glass.index(MIDDLE))
        },
    )
}

/// Whether the scene has a body of glass, whose light only some methods have.
pub fn has_glass(scene: &Scene) -> bool {
    scene.objects.iter().any(|object| {
        matches!(
            scene.materials[object.material].kind,
            MaterialKind::Dielectric(_)
        ) && object.geometry.placement().is_some()
    })
}
