//! Objects for the shaders: material and receiver.

use crate::render::gpu_types;
use crate::render::gpu_types::constants::{
    CONDUCTOR, DIELECTRIC, DIFFUSE, MESH, MIRROR, NO_RECEIVER, SHEET,
};
use crate::render::spectrum::index_and_change;
use crate::scene::{MaterialKind, Object, Scene};
use glam::DVec3;

/// One per object. `receiver_of` gives an object's index among the receivers of its kind, and whether the receiver is a
/// mesh; `shape_of` the shape of a dielectric that is no sheet. `channels`: of the scene's
/// [`DeviceSpectrum`](crate::render::spectrum::DeviceSpectrum).
pub fn objects(
    scene: &Scene,
    receiver_of: impl Fn(usize) -> Option<(u32, bool)>,
    shape_of: impl Fn(usize) -> u32,
    channels: DVec3,
) -> Vec<gpu_types::Object> {
    (scene.objects.iter().enumerate())
        .map(|(index, object)| {
            object_of(scene, object, receiver_of(index), shape_of(index), channels)
        })
        .collect()
}

fn object_of(
    scene: &Scene,
    object: &Object,
    receiver: Option<(u32, bool)>,
    dielectric_shape: u32,
    channels: DVec3,
) -> gpu_types::Object {
    let [mut color, mut index, mut extinction] = [DVec3::ZERO; 3];
    let mut shape = match receiver {
        Some((_, true)) => MESH,
        _ => 0,
    };
    let kind = match scene.materials[object.material].kind {
        MaterialKind::Mirror { reflectance } => {
            color = reflectance;
            MIRROR
        }
        MaterialKind::Conductor {
            index: real,
            extinction: imaginary,
        } => {
            (index, extinction) = (real, imaginary);
            CONDUCTOR
        }
        MaterialKind::Dielectric(medium) => {
            shape = if medium.thin { SHEET } else { dielectric_shape };
            let [ior, change] = index_and_change(&medium);
            color = ior + change * channels;
            index = DVec3::new(ior, medium.priority.into(), change);
            extinction = medium.absorption;
            DIELECTRIC
        }
        MaterialKind::Diffuse { albedo } => {
            color = albedo;
            DIFFUSE
        }
    };
    gpu_types::Object {
        color: color.as_vec3(),
        kind,
        index: index.as_vec3(),
        extinction: extinction.as_vec3(),
        receiver: match receiver {
            Some((index, _)) => index as i32,
            None => first_of_medium(scene, object).map_or(NO_RECEIVER, |first| first as i32),
        },
        shape,
    }
}

/// The first object with the same medium as a dielectric one.
fn first_of_medium(scene: &Scene, object: &Object) -> Option<usize> {
    let kind = |object: &Object| &scene.materials[object.material].kind;
    match kind(object) {
        MaterialKind::Dielectric(_) => {
            (scene.objects.iter()).position(|other| kind(other) == kind(object))
        }
        _ => None,
    }
}
