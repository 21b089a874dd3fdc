//! Single passes on hand-made input, against numbers that follow from the geometry on paper.
//!
//! The receiver is a floor of 8 m with 64² texels of 1/8 m. The patch stands upright in the plane x = 0, which is the
//! column 32, and faces +x. Light from (1, 1, 0)/√2 leaves along (1, −1, 0)/√2: a point at the height y of the patch
//! lights x = y. The image is thus the patch itself, laid on the floor, 8 texels a metre.

#![cfg(feature = "cli")]

mod common;

use approx::assert_relative_eq;
use bytemuck::Zeroable;
use common::Device;
use glam::{Vec2, Vec3, vec2, vec3};
use nephroid::gpu::{BoundPipeline, Buffer, Context, Recorder, Resource, Shader, shaders};
use nephroid::render::gpu_types::constants::{DIELECTRIC, MIRROR};
use nephroid::render::gpu_types::{
    CompactPush, Footprint, Light, Object, Patch, PinholeImage, PlanarReceiver, Profile,
    ProjectPush,
};
use std::f32::consts::{FRAC_1_SQRT_2, PI};
use std::sync::Arc;

const SIDE: f32 = 8.0;
const TEXELS: u32 = 64;
const TEXEL_AREA: f32 = (SIDE / TEXELS as f32) * (SIDE / TEXELS as f32);
const COLOR: Vec3 = vec3(0.5, 0.25, 1.0);
const IRRADIANCE: Vec3 = vec3(10.0, 20.0, 30.0);
/// m², of a right triangle with sides of ½ m.
const AREA: f32 = 0.125;
/// Variance of a kernel over that of its patch, so that the patch's variance in texels is a whole number.
const SPREAD: f32 = 4.5;
/// The same for the edges of pinhole images, so small that they are not splatted into a coarser level.
const EDGE_SPREAD: f32 = 1.8;

fn floor() -> PlanarReceiver {
    PlanarReceiver {
        origin: vec3(-4.0, 0.0, 4.0),
        edge_u: SIDE * Vec3::X,
        edge_v: -SIDE * Vec3::Z,
        normal: Vec3::Y,
        width: TEXELS,
        height: TEXELS,
        ..PlanarReceiver::zeroed()
    }
}

/// The patch with its centroid at this height, m.
fn upright(height: f32) -> Patch {
    Patch {
        position: height * Vec3::Y,
        normal: Vec3::X,
        area: AREA,
        edge1: 0.5 * Vec3::Y,
        edge2: 0.5 * Vec3::Z,
        ..Patch::zeroed()
    }
}

/// A sun without extent.
fn sun() -> Light {
    Light {
        place: FRAC_1_SQRT_2 * vec3(1.0, 1.0, 0.0),
        power: IRRADIANCE,
        ..Light::zeroed()
    }
}

fn mirror() -> Object {
    Object {
        kind: MIRROR,
        color: COLOR,
        ..Object::zeroed()
    }
}

/// The used slots of one pair, projected by `shader` with nothing in the way.
fn project<T: bytemuck::Pod>(
    shader: &'static Shader,
    splats: &'static str,
    (patch, light, object): (&Patch, &Light, &Object),
    lobes: u32,
) -> Vec<T> {
    let device = Device::open();
    let context: &Arc<Context> = &device.0;
    let buffer = |name, bytes: &[u8]| Buffer::with_data(context, name, bytes).unwrap();
    // The bell (1 − t)⁴ for every sharpness.
    let bell = Profile {
        flatness: 0.0,
        support: 12.0,
        mean: 0.2,
        unused: 0.0,
    };
    let buffers = [
        ("triangles", buffer("triangles", &[0; 48])),
        ("nodes", buffer("nodes", &[0; 64])),
        ("objects", buffer("objects", bytemuck::bytes_of(object))),
        ("lights", buffer("lights", bytemuck::bytes_of(light))),
        (
            "planar_receivers",
            buffer("receivers", bytemuck::bytes_of(&floor())),
        ),
        ("patches", buffer("patches", bytemuck::bytes_of(patch))),
        (
            "profiles",
            buffer("profiles", bytemuck::bytes_of(&[bell; 2])),
        ),
        ("pairs", buffer("pairs", &[0; 8])),
        ("coarse", buffer("coarse", &[0; 4])),
        ("counts", buffer("counts", &[0xff; 4 * 64])),
        ("group_counts", buffer("group counts", &[0xff; 8])),
        (splats, buffer("splats", &vec![0; 8 * size_of::<T>()])),
    ];
    let resources: Vec<_> = (buffers.iter())
        .map(|(name, buffer)| (*name, Resource::Buffer(buffer)))
        .collect();
    let pipeline = BoundPipeline::compute(context, shader, [false; 2], &resources).unwrap();
    let push = ProjectPush {
        pair_count: 1,
        patch_count: 1,
        receiver_count: 1,
        lobes,
        spread: EDGE_SPREAD,
        flat_spread: SPREAD,
        ..ProjectPush::zeroed()
    };
    let mut recorder = Recorder::new(context).unwrap();
    recorder.dispatch(&pipeline, &push, [1, 1, 1]);
    recorder.submit().unwrap();
    let [.., (_, counts), (_, group_counts), (_, splats)] = &buffers;
    let count = counts.read::<u32>(1).unwrap()[0];
    let of_group = group_counts.read::<u32>(2).unwrap();
    assert_eq!(of_group, [count, count.min(1)]);
    if count == 0 {
        return Vec::new();
    }
    splats.read::<T>(count as usize).unwrap()
}

fn footprints(patch: &Patch, object: &Object, lobes: u32) -> Vec<Footprint> {
    let input = (patch, &sun(), object);
    project(&shaders::FOOTPRINT_COMP, "footprints", input, lobes)
}

fn assert_close2(found: Vec2, expected: Vec2) {
    assert!(found.abs_diff_eq(expected, 2e-4), "{found} {expected}");
}

fn assert_close3(found: Vec3, expected: Vec3) {
    let tolerance = 2e-5 * expected.length().max(1.0);
    assert!(found.abs_diff_eq(expected, tolerance), "{found} {expected}");
}

/// The conic and the peak, W/m², of a bell with the covariance of the patch times `scale` plus that of a texel.
///
/// The image has the sides (4, 0) and (0, 4) texels: variances 4² · 4.5/18 = 4 on each axis, covariance −2.
fn bell(scale: f32, flux: Vec3) -> (Vec3, Vec3) {
    let (variance, covariance) = (4.0 * scale + 1.0 / 12.0, -2.0 * scale);
    let determinant = variance * variance - covariance * covariance;
    let conic = vec3(variance, -covariance, variance) / (12.0 * determinant);
    let integral = PI * 12.0 * 0.2 * determinant.sqrt();
    (conic, flux / (integral * TEXEL_AREA))
}

/// E A cos 45° times the reflectance, W.
fn flux() -> Vec3 {
    IRRADIANCE * COLOR * AREA * FRAC_1_SQRT_2
}

#[test]
fn a_flat_patch_is_projected() {
    let found = footprints(&upright(2.0), &mirror(), 1);
    let [footprint] = found[..] else {
        panic!("{found:?}")
    };
    let (conic, peak) = bell(1.0, flux());
    assert_close2(footprint.centre, vec2(32.0 + 16.0, 32.0));
    assert_close3(footprint.conic, conic);
    assert_close3(footprint.peak, peak);
    // Half the width of the support: √(12 · 49/12) = 7 texels.
    assert_close2(footprint.lower, vec2(41.0, 25.0));
    assert_close2(footprint.upper, vec2(55.0, 39.0));
}

/// Nearer to the floor the patch's plane, the column 32, cuts the footprint 4 texels from its centre: ℓ = (¼, 0).
#[test]
fn a_footprint_is_folded_at_the_plane_of_its_patch() {
    let found = footprints(&upright(0.5), &mirror(), 1);
    let [footprint, fold] = found[..] else {
        panic!("{found:?}")
    };
    let (conic, peak) = bell(1.0, flux());
    assert_close2(footprint.centre, vec2(36.0, 32.0));
    // −2 C⁻¹ℓ/(ℓᵀC⁻¹ℓ) with C⁻¹ = 12 Σ: C⁻¹ℓ = (12.25, −6).
    assert_close2(fold.centre, vec2(36.0 - 8.0, 32.0 + 2.0 * 6.0 / 3.0625));
    for part in [&footprint, &fold] {
        assert_close3(part.conic, conic);
        assert_close3(part.peak, peak);
    }
    // Share of a texel on the light's side: ½ at the line, 1 half a texel farther.
    assert_close3(footprint.clip, vec3(1.0, 0.0, 4.5));
    assert_close3(fold.clip, vec3(1.0, 0.0, 0.5 - 4.0));
}

/// The floor cuts the patch: its upper corner is ⅓ m above, the others are ⅙ m below. What remains is the patch scaled
/// by ⅔ toward that corner.
#[test]
fn a_patch_is_clipped_at_the_receiver() {
    let found = footprints(&upright(0.0), &mirror(), 1);
    let [footprint, _fold] = found[..] else {
        panic!("{found:?}")
    };
    let share = 4.0 / 9.0;
    let (conic, peak) = bell(share, share * flux());
    // Its centroid is 1/9 m above the floor and 1/18 m toward the far edge.
    assert_close2(footprint.centre, vec2(32.0 + 8.0 / 9.0, 32.0 - 8.0 / 18.0));
    assert_close3(footprint.conic, conic);
    assert_close3(footprint.peak, peak);
    // Wholly below.
    assert!(footprints(&upright(-0.5), &mirror(), 1).is_empty());
}

/// From glass into air at 45°, beyond the critical angle of 41.8°, all light is reflected; from air into glass,
/// Fresnel's law divides it, and the refracted part lands behind the patch.
#[test]
fn total_reflection_refracts_nothing() {
    let glass = |index: f32| Object {
        kind: DIELECTRIC,
        index: Vec3::splat(index),
        ..Object::zeroed()
    };
    let found = footprints(&upright(2.0), &glass(1.0 / 1.5), 2);
    let [footprint] = found[..] else {
        panic!("{found:?}")
    };
    let (_, peak) = bell(1.0, IRRADIANCE * AREA * FRAC_1_SQRT_2);
    assert_close3(footprint.peak, peak);

    let found = footprints(&upright(2.0), &glass(1.5), 2);
    let [reflected, refracted] = found[..] else {
        panic!("{found:?}")
    };
    // sin θ′ = sin 45°/1.5, and Fresnel's share, the mean over both polarisations.
    let (c, s) = (FRAC_1_SQRT_2, FRAC_1_SQRT_2 / 1.5);
    let c2 = (1.0 - s * s).sqrt();
    let across = (c - 1.5 * c2) / (c + 1.5 * c2);
    let along = (1.5 * c - c2) / (1.5 * c + c2);
    let share = 0.5 * (across * across + along * along);
    assert_close3(reflected.peak, share * peak);
    // tan of the refracted ray below the horizontal: 2 m down, 2 c2/s m behind.
    assert_close2(refracted.centre, vec2(32.0 - 8.0 * 2.0 * c2 / s, 32.0));
}

/// A cell around the direction of the sun as a pinhole image: the patch is a camera 2 m above the floor.
#[test]
fn an_environment_cell_is_imaged() {
    let (half_azimuth, half_sine) = (0.2_f32, 0.1_f32);
    let cell = Light {
        half_azimuth,
        half_sine,
        ..sun()
    };
    let patch = upright(2.0);
    let images = |patch: &Patch| -> Vec<PinholeImage> {
        let input = (patch, &cell, &mirror());
        project(&shaders::PINHOLE_IMAGE_COMP, "pinhole_images", input, 1)
    };
    let found = images(&patch);
    let [image] = found[..] else {
        panic!("{found:?}")
    };
    // The point of the floor under the patch, and a texel seen from 2 m above.
    assert_close2(image.foot, vec2(32.0, 32.0));
    assert_close2(image.size, Vec2::splat(1.0 / 256.0));
    // Mirrored at x = 0, ahead stays +x, east +z turns to −z, and up to down. Each is evaluated at δ texels from the
    // foot as a·(δ, 1), the texel's direction over the height.
    assert_close3(image.ahead, vec3(1.0 / 16.0, 0.0, 0.0));
    // Vulkan grants sin and cos an error of 2⁻¹¹.
    let east = vec3(0.0, -1.0 / (16.0 * half_azimuth.tan()), 0.0);
    assert!(image.east.abs_diff_eq(east, 1e-3), "{}", image.east);
    assert_close3(image.up, vec3(0.0, 0.0, 1.0 / half_sine));
    assert_close3(image.cosine, vec3(1.0 / 16.0, 0.0, 0.0));
    assert_relative_eq!(image.sine, FRAC_1_SQRT_2 / half_sine, max_relative = 1e-5);
    // L F A/h²
    let radiance = IRRADIANCE / (4.0 * half_azimuth * half_sine);
    assert_close3(image.radiance, radiance * COLOR * AREA / 4.0);
    // The image lies around the place that the centre of the cell lights, 2 m ahead.
    let place = vec2(48.0, 32.0);
    assert!(image.lower.cmplt(place).all() && image.upper.cmpgt(place).all());

    // From 1 m above, |e₁|² + |e₂|² = ½ > 0.3 h²: the patch sends footprints.
    assert!(images(&upright(1.0)).is_empty());
    let kernels = |patch: &Patch| -> usize {
        let input = (patch, &cell, &mirror());
        let shader = &shaders::ENVIRONMENT_FOOTPRINT_COMP;
        project::<Footprint>(shader, "footprints", input, 1).len()
    };
    assert_eq!([2.0, 1.0].map(|height| kernels(&upright(height))), [0, 1]);
}

/// Pairs 0, 1, 2, 0, 1, 2 … use that many of their three slots. 1300 pairs are three workgroups.
#[test]
fn used_slots_are_listed_in_order() {
    const PAIRS: u32 = 1300;
    let device = Device::open();
    let context = &device.0;
    let counts: Vec<u32> = (0..PAIRS).map(|pair| pair % 3).collect();
    let group_counts: Vec<u32> = (counts.chunks(64))
        .flat_map(|group| {
            let lit = group.iter().filter(|count| **count > 0).count();
            [group.iter().sum(), lit as u32]
        })
        .collect();
    let (used, lit) = (433 + 2 * 433, 2 * 433); // 1300 = 3 · 433 + 1
    let buffer = |name, data: &[u32]| Buffer::with_data(context, name, data).unwrap();
    let quads = buffer("quads", &vec![u32::MAX; 6 * 3 * PAIRS as usize]);
    // The numbers of splats and lit pairs of an earlier batch.
    let arguments = buffer("arguments", &[9, 9, 9, 9, 9, 100, 10]);
    let resources = [
        ("counts", Resource::Buffer(&buffer("counts", &counts))),
        (
            "group_counts",
            Resource::Buffer(&buffer("groups", &group_counts)),
        ),
        ("quads", Resource::Buffer(&quads)),
        ("arguments", Resource::Buffer(&arguments)),
    ];
    let compact = &shaders::COMPACT_COMP;
    let pipeline = BoundPipeline::compute(context, compact, [false; 2], &resources).unwrap();
    let mut recorder = Recorder::new(context).unwrap();
    let push = CompactPush {
        pair_count: PAIRS,
        slots: 3,
    };
    recorder.dispatch(&pipeline, &push, [PAIRS.div_ceil(8), 1, 1]);
    recorder.submit().unwrap();
    assert_eq!(
        arguments.read::<u32>(7).unwrap(),
        [6 * used, 1, 0, 0, 0, 100 + used, 10 + lit]
    );
    let listed = quads.read::<u32>(6 * used as usize + 1).unwrap();
    // Pair 1 has slot 3, pair 2 has slots 6 and 7, pair 4 slot 12; each slot has four vertices.
    let firsts: Vec<u32> = listed.chunks(6).map(|quad| quad[0]).collect();
    assert_eq!(firsts[..4], [4 * 3, 4 * 6, 4 * 7, 4 * 12]);
    assert_eq!(listed[..6], [12, 13, 14, 14, 13, 15]);
    assert_eq!(firsts[used as usize - 1], 4 * (3 * 1298 + 1));
    assert_eq!(listed[6 * used as usize], u32::MAX);
}
