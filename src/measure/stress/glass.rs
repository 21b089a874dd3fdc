//! The scenes of the sweeps through glass: one body, one receiver, a white sun of 1 W/m².

use super::scenes::{horizontal, scene, sun};
use crate::scene::{Dielectric, Geometry, MaterialKind, Mesh, Scene};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;

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
fn on_floor(mesh: Mesh, ior: f64) -> Scene {
    let light = sun(DVec3::new(-1.0, 1.0, 0.15), 1.0, SUN);
    let mut scene = scene(mesh, vec![light], horizontal(FLOOR, 0.0));
    scene.materials[0].kind = MaterialKind::Dielectric(Dielectric::new(ior));
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
    on_floor(Mesh::revolved(&[profile.collect()], SEGMENTS), ior)
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
    on_floor(Mesh::revolved(&parts, SEGMENTS), IOR)
}

/// Whether the scene has a body of glass, whose light only some methods have.
pub fn has_glass(scene: &Scene) -> bool {
    scene.objects.iter().any(|object| {
        matches!(
            scene.materials[object.material].kind,
            MaterialKind::Dielectric(_)
        ) && matches!(object.geometry, Geometry::Mesh(_))
    })
}
