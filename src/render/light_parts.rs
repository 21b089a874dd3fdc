//! Parts of wide suns and lamps. The image of a light's disc is linear in the directions of the light: where they spread by more
//! than some degrees, `footprint` projects the parts of the disc, each as a light of its own.

use super::gpu_types::Light;
use crate::render::geometry::triangle_store::TriangleStore;
use crate::scene::Scene;
use glam::{DVec2, DVec3};
use std::f64::consts::TAU;

/// Largest angular radius of a light that is projected as a whole, rad (4.6°), and twice that of a part. Measured on a ring under a sun of
/// 20° and under lamps of 12° and more: 1.1 to 2.6 % of error are left, with 0.105 up to 4.3 %, and 6 to 24 % with whole lights.
const WIDEST: f64 = 0.08;
/// Maximum number of rings of parts, so that a light has at most 64 parts: enough for an angular radius of 48°.
pub const MAX_RINGS: u32 = 4;
/// Maximum number of images of facets, for which there is a buffer, beside those of whole lights: fine meshes have fewer parts.
const MAX_IMAGES: u64 = 1 << 22;
/// Number of triangles of an object by which the distance of a lamp is judged.
const TRIANGLES: usize = 1024;

/// Number of parts of a light with `rings` rings; 0 rings: the light is one.
pub fn part_count(rings: u32) -> u32 {
    (4 * rings * rings).max(1)
}

/// For each of `lights`, the number of rings that its disc is divided into. `before`: the numbers of the last frame, which are kept until the
/// light is a fifth narrower, so that a moving lamp does not change them back and forth. `images`: number of images of facets for each part.
pub fn rings(
    scene: &Scene,
    store: &TriangleStore,
    lights: &[Light],
    before: &[u32],
    images: u64,
) -> Vec<u32> {
    let casters: Vec<usize> = scene.specular_objects().map(|(index, _)| index).collect();
    let seen_radius = |light: &Light| match light.is_lamp {
        0 => f64::from(light.size),
        _ => seen_radius(store, &casters, light),
    };
    let rings = (lights.iter().zip(before))
        .map(|(light, &before)| {
            let radius = seen_radius(light);
            before.min(rings_for(1.25 * radius)).max(rings_for(radius))
        })
        .collect();
    at_most(rings, MAX_IMAGES / images.max(1))
}

fn rings_for(radius: f64) -> u32 {
    match radius > WIDEST {
        true => ((radius / (2.0 * WIDEST)).ceil() as u32).min(MAX_RINGS),
        false => 0,
    }
}

/// Fewer rings, where so many parts of all lights are not to be exceeded.
fn at_most(mut rings: Vec<u32>, parts: u64) -> Vec<u32> {
    let count = |&rings: &u32| u64::from(part_count(rings));
    while rings.iter().map(count).sum::<u64>() > parts
        && let Some(most) = rings.iter_mut().max().filter(|most| **most > 0)
    {
        *most -= 1;
    }
    rings
}

/// Root mean square of the angular radius at which the casters see a lamp, by irradiance, rad.
fn seen_radius(store: &TriangleStore, casters: &[usize], lamp: &Light) -> f64 {
    let (mut sum, mut irradiance) = (0.0, 0.0);
    for &object in casters {
        let triangles = store.indices(object);
        for &index in triangles
            .iter()
            .step_by(triangles.len().div_ceil(TRIANGLES).max(1))
        {
            let triangle = store.triangle(index);
            let middle = triangle.position + (triangle.edge1 + triangle.edge2) / 3.0;
            let area = f64::from(triangle.edge1.cross(triangle.edge2).length());
            let square =
                f64::from(middle.distance_squared(lamp.place)).max(f64::from(lamp.size).powi(2));
            sum += area / (square * square);
            irradiance += area / square;
        }
    }
    match irradiance > 0.0 {
        true => (f64::from(lamp.size) * (sum / irradiance).sqrt())
            .min(1.0)
            .asin(),
        false => 0.0,
    }
}

/// A sector of a ring of a disc of radius 1.
struct Part {
    /// Of the centroid.
    angle: f64,
    distance: f64,
    /// Standard deviations along the radius and across it.
    along: f64,
    across: f64,
}

/// Sectors of the same area: of ring i, 4 (2 i + 1). `disc_pieces.glsl` has those of one and two rings.
fn parts(rings: u32) -> impl Iterator<Item = Part> {
    (0..rings).flat_map(move |ring| {
        let [within, beyond] = [ring, ring + 1].map(|edge| f64::from(edge) / f64::from(rings));
        let sectors = 4 * (2 * ring + 1);
        let width = TAU / f64::from(sectors);
        // Moments of a sector.
        let square = 0.5 * (within * within + beyond * beyond);
        let distance = 2.0 / 3.0 * (beyond.powi(3) - within.powi(3))
            / (beyond * beyond - within * within)
            * (0.5 * width).sin()
            / (0.5 * width);
        let along = 0.5 * square * (1.0 + width.sin() / width) - distance * distance;
        let across = 0.5 * square * (1.0 - width.sin() / width);
        (0..sectors).map(move |sector| Part {
            angle: (f64::from(sector) + 0.5) * width,
            distance,
            along: along.sqrt(),
            across: across.sqrt(),
        })
    })
}

/// The parts of a light.
pub fn split(light: &Light, rings: u32) -> Vec<Light> {
    if rings == 0 {
        return vec![*light];
    }
    let part = |part| match light.is_lamp {
        0 => part_of_sun(light, &part),
        _ => part_of_lamp(light, &part),
    };
    let count = part_count(rings) as f32;
    (parts(rings).map(part))
        .map(|part| Light {
            power: part.power / count,
            ..part
        })
        .collect()
}

/// A part of a sun, with the power of the whole. A plane that faces the middle of the sun gets the same light from all parts, as they are of
/// the same area where the disc is seen from afar; one that faces the part gets more by the cosine in between.
fn part_of_sun(sun: &Light, part: &Part) -> Light {
    let middle = sun.place.as_dvec3();
    let [a, b] = [sun.axis1, sun.axis2].map(|axis| axis.as_dvec3().normalize());
    let radius = f64::from(sun.size).sin();
    let radial = part.angle.cos() * a + part.angle.sin() * b;
    let tangent = radial.cross(middle).normalize();
    let sine = radius * part.distance;
    let cosine = (1.0 - sine * sine).sqrt();
    let direction: DVec3 = cosine * middle + sine * radial;
    let (along, across) = (radius * part.along / cosine, radius * part.across);
    Light {
        place: direction.as_vec3(),
        size: (2.0 * (along * across).sqrt()) as f32,
        power: sun.power / cosine as f32,
        axis1: (along * (cosine * radial - sine * middle)).as_vec3(),
        axis2: (across * tangent).as_vec3(),
        ..*sun
    }
}

/// A part of a lamp, with the power of the whole: `part_seen_from()` makes a lamp of it for each place that sees it.
fn part_of_lamp(lamp: &Light, part: &Part) -> Light {
    let centre = part.distance * DVec2::from_angle(part.angle);
    Light {
        axis1: centre
            .extend(2.0 * (part.along * part.across).sqrt())
            .as_vec3(),
        ..*lamp
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    #[test]
    fn fine_meshes_have_fewer_parts() {
        let rings = vec![4, 0, 2];
        for (parts, expected) in [
            (81, [4, 0, 2]),
            (80, [3, 0, 2]),
            (33, [2, 0, 2]),
            (32, [2, 0, 1]),
            (0, [0; 3]),
        ] {
            assert_eq!(at_most(rings.clone(), parts), expected);
        }
    }

    fn sun(angular_radius: f32) -> Light {
        let (a, b) = Vec3::Y.any_orthonormal_pair();
        Light {
            place: Vec3::Y,
            size: angular_radius,
            power: Vec3::ONE,
            axis1: 0.5 * angular_radius * a,
            axis2: 0.5 * angular_radius * b,
            ..Default::default()
        }
    }

    /// Parts of a sun send as much light as the whole onto planes of any slope that see all of it, and the mean of its directions is kept.
    #[test]
    fn parts_of_a_sun_have_its_light() {
        for rings in 1..=MAX_RINGS {
            let parts = split(&sun(0.6), rings);
            assert_eq!(parts.len() as u32, part_count(rings));
            for normal in [Vec3::Y, Vec3::new(0.6, 0.8, 0.0), Vec3::new(0.0, 0.8, -0.6)] {
                let irradiance: f32 = (parts.iter())
                    .map(|part| part.power.x * part.place.dot(normal))
                    .sum();
                assert!(
                    (irradiance - normal.y).abs() < 1e-5,
                    "{rings} {normal} {irradiance}"
                );
            }
        }
    }

    /// Total variance: that of the parts' directions, and of the directions within each, add up to that of the disc.
    #[test]
    fn parts_of_a_narrow_disc_have_its_variance() {
        for rings in 1..=MAX_RINGS {
            let parts = split(&sun(0.01), rings);
            for axis in [Vec3::X, Vec3::Z] {
                let within =
                    |part: &Light| part.axis1.dot(axis).powi(2) + part.axis2.dot(axis).powi(2);
                let variance: f32 = (parts.iter())
                    .map(|part| part.place.dot(axis).powi(2) + within(part))
                    .sum();
                let ratio = variance / parts.len() as f32 / (0.25 * 0.01 * 0.01);
                assert!((ratio - 1.0).abs() < 1e-3, "{rings} {axis} {ratio}");
            }
        }
    }
}
