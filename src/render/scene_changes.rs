//! What differs between the scenes of two frames.

use crate::error::{Error, Result};
use crate::render::geometry::triangle_store::occlusion;
use crate::render::gpu_types::constants::OCCLUDES_ENVIRONMENT;
use crate::render::textures::map_of;
use crate::scene::{Geometry, LightKind, MaterialKind, Mesh, Object, Scene};
use std::mem::discriminant;
use std::sync::Arc;

pub fn same_geometry(a: &Object, b: &Object) -> bool {
    let same_mesh = |a: &Arc<Mesh>, b: &Arc<Mesh>| Arc::ptr_eq(a, b) || a == b;
    match (&a.geometry, &b.geometry) {
        (Geometry::Mesh(a), Geometry::Mesh(b)) => same_mesh(a, b),
        (
            Geometry::Placed { mesh, by },
            Geometry::Placed {
                mesh: other,
                by: by_other,
            },
        ) => by == by_other && same_mesh(mesh, other),
        (a, b) => a == b,
    }
}

/// Whether the light maps and the view stay the same, except for the camera, given the same structure.
pub fn is_same(a: &Scene, b: &Scene) -> bool {
    let same_object = |x: &Object, y: &Object| {
        same_geometry(x, y) && a.materials[x.material].kind == b.materials[y.material].kind
    };
    (a.lights.iter().zip(&b.lights)).all(|(x, y)| same_light(&x.kind, &y.kind))
        && (a.objects.iter().zip(&b.objects)).all(|(x, y)| same_object(x, y))
}

/// Whether diffuse surfaces get the same direct light of the environment, given the same structure: surfaces that may move
/// neither show it nor cast its shadows.
pub fn keeps_environment(a: &Scene, b: &Scene) -> bool {
    let matters = |object: &Object| {
        matches!(
            a.materials[object.material].kind,
            MaterialKind::Diffuse { .. }
        ) || occlusion(a, object) & OCCLUDES_ENVIRONMENT != 0
    };
    (a.lights.iter().zip(&b.lights))
        .filter(|(light, _)| matches!(light.kind, LightKind::Environment { .. }))
        .all(|(light, other)| same_light(&light.kind, &other.kind))
        && (a.objects.iter().zip(&b.objects))
            .all(|(object, other)| same_geometry(object, other) || !matters(object))
}

/// Maps are compared by their address only, because comparing pixels would take too long.
fn same_light(a: &LightKind, b: &LightKind) -> bool {
    match (a, b) {
        (
            LightKind::Environment {
                map,
                scale,
                rotation,
                casts_caustics,
            },
            LightKind::Environment {
                map: other_map,
                scale: other_scale,
                rotation: other_rotation,
                casts_caustics: other_casts,
            },
        ) => {
            Arc::ptr_eq(map, other_map)
                && [scale, rotation] == [other_scale, other_rotation]
                && casts_caustics == other_casts
        }
        _ => a == b,
    }
}

/// Checks that only positions, sizes, directions and colours differ.
pub fn check_same_structure(a: &Scene, b: &Scene) -> Result<()> {
    let another = |what: String| {
        Err(Error::Usage {
            reason: format!("the scene is another than before: {what}"),
            remedy: "make a new renderer for it".into(),
        })
    };
    for (what, before, now) in [
        ("objects", a.objects.len(), b.objects.len()),
        ("lights", a.lights.len(), b.lights.len()),
    ] {
        if before != now {
            return another(format!("it had {before} {what} and has {now}"));
        }
    }
    if a.max_interfaces != b.max_interfaces {
        return another("its max_interfaces differs".into());
    }
    for (light, other) in a.lights.iter().zip(&b.lights) {
        let same = match (&light.kind, &other.kind) {
            (
                a @ LightKind::Environment { map, .. },
                b @ LightKind::Environment { map: other, .. },
            ) => {
                [map.width, map.height] == [other.width, other.height]
                    && a.casts_caustics() == b.casts_caustics()
            }
            (a, b) => discriminant(a) == discriminant(b),
        };
        if !same {
            return another(format!("light `{}` is of another kind or size", other.name));
        }
    }
    let same_texture = |(a, b)| Arc::ptr_eq(a, b) || a == b;
    if a.textures.len() != b.textures.len() || !a.textures.iter().zip(&b.textures).all(same_texture)
    {
        return another("its textures differ".into());
    }
    for (object, other) in a.objects.iter().zip(&b.objects) {
        let kind =
            |scene: &Scene, object: &Object| discriminant(&scene.materials[object.material].kind);
        let disperses = |scene: &Scene, object: &Object| {
            (scene.materials[object.material].kind.dispersion()).is_some()
        };
        let what = if kind(a, object) != kind(b, other) {
            "the kind of material"
        } else if disperses(a, object) != disperses(b, other) {
            "the dispersion"
        } else if !same_topology(&object.geometry, &other.geometry) {
            "the topology"
        } else if object.light_map != other.light_map {
            "the size of the light map"
        } else if map_of(a, object) != map_of(b, other) || !same_uvs(object, other) {
            "the albedo map"
        } else if object.blocks_light != other.blocks_light {
            "the shadow"
        } else {
            continue;
        };
        return another(format!("{what} of object `{}` differs", other.name));
    }
    Ok(())
}

fn same_uvs(a: &Object, b: &Object) -> bool {
    match (&a.uvs, &b.uvs) {
        (Some(a), Some(b)) => Arc::ptr_eq(a, b) || a == b,
        (a, b) => a.is_none() && b.is_none(),
    }
}

fn same_topology(a: &Geometry, b: &Geometry) -> bool {
    match (a, b) {
        (Geometry::Waves(a), Geometry::Waves(b)) => a.quads == b.quads,
        (a, b) => match (a.placement(), b.placement()) {
            (Some((a, _)), Some((b, _))) => Arc::ptr_eq(a, b) || a.triangles == b.triangles,
            _ => discriminant(a) == discriminant(b),
        },
    }
}
