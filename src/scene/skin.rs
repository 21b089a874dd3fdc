//! Meshes that should bound a body and do not: open, turned inside out, or with faces that do not
//! agree about which side is the front; and bodies that overlap, neither of which displaces the other.

use super::mesh::places;
use super::overlap::crossing;
use super::{Dielectric, LightKind, MaterialKind, Mesh, Object, Scene};
use glam::DVec3;
use rayon::slice::ParallelSliceMut;
use std::borrow::Cow;

/// What is odd about the meshes of specular objects, a sentence each.
pub fn complaints(scene: &Scene) -> Vec<String> {
    let complaint = |object: &Object| {
        let mesh = &object.geometry.as_mesh()?;
        let kind = &scene.materials[object.material].kind;
        let reason = match kind {
            MaterialKind::Diffuse { .. } => None,
            MaterialKind::Dielectric(_) => Skin::of(mesh).flaw_of_dielectric(),
            _ => Skin::of(mesh)
                .is_inside_out()
                .then(|| flaw_of_mirror(scene, mesh))
                .flatten(),
        };
        reason.map(|reason| format!("object \"{}\": {reason}", object.name.escape_debug()))
    };
    let flaws = scene.objects.iter().filter_map(complaint);
    flaws.chain(overlaps(scene)).collect()
}

/// Bodies of different media and equal priority whose surfaces cross. A body that lies wholly within another one, as a bubble
/// does, displaces it. Two bodies of one medium are one.
fn overlaps(scene: &Scene) -> Vec<String> {
    let bodies: Vec<(&Object, &Dielectric, Cow<Mesh>)> = (scene.objects.iter())
        .filter_map(|object| match &scene.materials[object.material].kind {
            MaterialKind::Dielectric(medium) if !medium.thin => {
                Some((object, medium, object.geometry.as_mesh()?))
            }
            _ => None,
        })
        .collect();
    let mut complaints = Vec::new();
    for (index, (object, medium, mesh)) in bodies.iter().enumerate() {
        for (other, of_other, other_mesh) in &bodies[index + 1..] {
            if medium.priority != of_other.priority || medium == of_other {
                continue;
            }
            let place = crossing(mesh, other_mesh);
            complaints.extend(place.map(|place| {
                format!(
                    "object \"{}\": it crosses object \"{}\" at {}, and both have the priority {}: which of \
                     both is where they overlap depends on the way of the light; give what is to displace the \
                     other one the higher `priority`",
                    other.name.escape_debug(),
                    object.name.escape_debug(),
                    at(place),
                    medium.priority
                )
            }));
        }
    }
    complaints
}

/// Whether a mesh bounds a body, with its fronts outside.
pub fn is_closed(mesh: &Mesh) -> bool {
    let skin = Skin::of(mesh);
    skin.is_whole() && skin.volume > 0.0
}

/// What a mesh encloses. Corners at one place are one corner.
struct Skin {
    /// Edges of one face, and the middle of one of them.
    open: usize,
    opening: DVec3,
    /// Edges at which the front changes sides, and the middle of one of them.
    twisted: usize,
    twist: DVec3,
    /// m³; meaningful where it is closed.
    volume: f64,
    /// Whether all faces look to one side, as those of water do.
    is_sheet: bool,
}

impl Skin {
    fn of(mesh: &Mesh) -> Self {
        let place = places(&mesh.positions);
        // Sides of faces, by the edge; each edge of a closed skin is passed as often either way.
        let mut sides: Vec<([u32; 2], i8, [u32; 2])> = (mesh.triangles.iter())
            .flat_map(|[a, b, c]| [[*a, *b], [*b, *c], [*c, *a]])
            .map(|corners| {
                let [a, b] = corners.map(|corner| place[corner as usize]);
                ([a.min(b), a.max(b)], if a < b { 1 } else { -1 }, corners)
            })
            .collect();
        sides.par_sort_unstable();
        let middle =
            |[a, b]: [u32; 2]| 0.5 * (mesh.positions[a as usize] + mesh.positions[b as usize]);
        let mut skin = Self {
            open: 0,
            opening: DVec3::ZERO,
            twisted: 0,
            twist: DVec3::ZERO,
            volume: 0.0,
            is_sheet: true,
        };
        for edge in sides.chunk_by(|a, b| a.0 == b.0) {
            let balance: i32 = edge.iter().map(|side| i32::from(side.1)).sum();
            let at = middle(edge[0].2);
            match (balance, edge.len() % 2) {
                (0, _) => {}
                (_, 1) => (skin.open, skin.opening) = (skin.open + 1, at),
                _ => (skin.twisted, skin.twist) = (skin.twisted + 1, at),
            }
        }
        let origin = mesh.positions[0];
        let faces = || {
            (mesh.triangles.iter())
                .map(|corners| corners.map(|corner| mesh.positions[corner as usize] - origin))
        };
        let vector_area = |[a, b, c]: [DVec3; 3]| 0.5 * (b - a).cross(c - a);
        let front: DVec3 = faces().map(vector_area).sum();
        skin.is_sheet = faces().all(|face| vector_area(face).dot(front) > 0.0);
        skin.volume = faces().map(|[a, b, c]| a.dot(b.cross(c)) / 6.0).sum();
        skin
    }

    /// Whether it has no opening, and one side is its front.
    fn is_whole(&self) -> bool {
        self.open == 0 && self.twisted == 0
    }

    fn is_inside_out(&self) -> bool {
        self.is_whole() && self.volume < 0.0
    }

    /// Light that goes into a body has to come out again, and by the right index of refraction.
    fn flaw_of_dielectric(&self) -> Option<String> {
        if self.twisted > 0 {
            return Some(format!(
                "front and back are mixed up at {} edges, one at {}: there light is refracted as if \
                 it came from inside; turn all faces to the outside",
                self.twisted,
                at(self.twist)
            ));
        }
        if self.open > 0 && !self.is_sheet {
            return Some(format!(
                "its mesh is open at {} edges, one at {}: light goes in and out there without being \
                 refracted; close it",
                self.open,
                at(self.opening)
            ));
        }
        self.is_inside_out().then(|| {
            "its faces look inward, so that `ior` holds outside of it; turn the faces round, or \
             give 1/`ior` for a bubble"
                .into()
        })
    }
}

/// A closed mirror with its front inside is black, but for what is inside.
fn flaw_of_mirror(scene: &Scene, mesh: &Mesh) -> Option<String> {
    let [lower, upper] = mesh.bounds();
    let inside = |p: DVec3| p.cmpge(lower).all() && p.cmple(upper).all();
    let lit_inside = (scene.lights.iter()).any(|light| match light.kind {
        LightKind::Lamp { position, .. } => inside(position),
        _ => false,
    });
    let reason = "its faces look inward, and the backs of mirrors absorb: it is black and reflects no \
                  light; turn the faces round";
    (!lit_inside && !inside(scene.camera.position)).then(|| reason.into())
}

fn at(p: DVec3) -> String {
    // A micrometre is finer than anyone looks.
    let [x, y, z] = p.to_array().map(|x| (x * 1e6).round() / 1e6 + 0.0);
    format!("[{x}, {y}, {z}]")
}
