//! Which lights blur so much less than texels that their width does not count.
//!
//! Under these a patch's image is a triangle, exact but for the blur; under others it is a kernel, exact in
//! its blur but for the triangle. Kernels reach beyond their patches and triangles do not, so that where
//! the two meet their sum is uneven: a light has the one or the other everywhere, and keeps it when things
//! move.

use crate::optics::{reflect, refract};
use crate::render::geometry::triangle_store::Soup;
use crate::render::gpu_types::{Light, Receiver};
use crate::render::patches::tessellation::area;
use crate::scene::{MaterialKind, Scene};
use glam::{DVec3, Vec3};

/// Variance of the light's image over that of a texel, up to which a light is narrow. On the ring at
/// 256², where it is 0.12 for a sun of 0.27°, triangles and kernels had L1 2.3 and 3.1 % with 4 k patches,
/// 0.6 and 1.1 % with 64 k; at 512², where it is 0.5, 1.3 and 0.9 %. On `bumps` at 128², where it is 0.25,
/// 3.2 and 0.8 %.
const MOST: f64 = 0.15;
/// Triangles that are looked at.
const LOOKED_AT: usize = 4096;

/// Whether `light` is narrow on the whole, where its light by the middles of the specular triangles meets
/// receivers.
pub fn is_narrow(scene: &Scene, soup: &Soup, receivers: &[Receiver], light: &Light) -> bool {
    let places: Vec<(&MaterialKind, u32)> = (scene.specular_objects())
        .flat_map(|(index, object)| {
            let material = &scene.materials[object.material].kind;
            soup.places(index)
                .iter()
                .map(move |&place| (material, place))
        })
        .collect();
    let (mut sum, mut weights) = (0.0, 0.0);
    for &(material, place) in places
        .iter()
        .step_by(places.len().div_ceil(LOOKED_AT).max(1))
    {
        let (triangle, normals) = (
            &soup.triangles[place as usize],
            &soup.normals[place as usize],
        );
        let x = triangle.position + (triangle.edge1 + triangle.edge2) / 3.0;
        let normal = (normals.n0 + normals.n1 + normals.n2)
            .as_dvec3()
            .normalize_or_zero();
        let (toward, variance) = directions(light, x);
        let cosine = normal.dot(toward);
        for way in ways(material, normal, toward) {
            for receiver in receivers {
                if let Some(distance) = distance_to(receiver, x, way.as_vec3()) {
                    let texels = f64::from(receiver.width) * f64::from(receiver.height);
                    let texel = f64::from(receiver.edge_u.cross(receiver.edge_v).length()) / texels;
                    let weight = f64::from(area(triangle)) * cosine.abs();
                    sum += weight * 12.0 * variance * distance * distance / texel;
                    weights += weight;
                }
            }
        }
    }
    sum <= MOST * weights
}

/// Unit direction toward the light from x, and the variance of its directions on an axis.
pub fn directions(light: &Light, x: Vec3) -> (DVec3, f64) {
    if light.is_lamp == 0 {
        let both = light.axis1.length_squared() + light.axis2.length_squared();
        (light.place.as_dvec3(), 0.5 * f64::from(both))
    } else {
        let way = (light.place - x).as_dvec3();
        let radius = f64::from(light.size) / way.length();
        (way.normalize_or_zero(), 0.25 * radius * radius)
    }
}

/// Where a surface with this normal sends light that comes from `toward`.
pub fn ways(material: &MaterialKind, normal: DVec3, toward: DVec3) -> impl Iterator<Item = DVec3> {
    let cosine = normal.dot(toward);
    let (facing, refracted) = match material {
        MaterialKind::Dielectric { ior } if cosine < 0.0 => {
            (-normal, refract(-toward, -normal, *ior))
        }
        MaterialKind::Dielectric { ior } => (normal, refract(-toward, normal, 1.0 / ior)),
        _ => (normal, None),
    };
    let reflected = (facing.dot(toward) > 0.0).then(|| reflect(-toward, facing));
    reflected.into_iter().chain(refracted)
}

/// From x to where a ray along `way` meets the receiver's front, m.
fn distance_to(receiver: &Receiver, x: Vec3, way: Vec3) -> Option<f64> {
    let along = way.dot(receiver.normal);
    let distance = (receiver.origin - x).dot(receiver.normal) / along;
    let from_corner = x + distance * way - receiver.origin;
    let inside = [receiver.edge_u, receiver.edge_v]
        .iter()
        .all(|edge| (0.0..=edge.length_squared()).contains(&from_corner.dot(*edge)));
    (along < 0.0 && distance > 0.0 && inside).then_some(f64::from(distance))
}
