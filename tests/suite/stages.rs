//! Single passes on hand-made input, against numbers that follow from the geometry on paper.
//!
//! The receiver is a floor of 8 m with 64² texels of 1/8 m. The patch stands upright in the plane x = 0, which is the
//! column 32, and faces +x. Light from (1, 1, 0)/√2 leaves along (1, −1, 0)/√2: a point at the height y of the patch
//! lights x = y. The image is thus the patch itself, laid on the floor, 8 texels a metre.

use crate::common::Device;
use approx::assert_relative_eq;
use bytemuck::Zeroable;
use glam::{Vec2, Vec3, Vec4, Vec4Swizzles, vec2, vec3, vec4};
use nephroid::gpu::{BoundPipeline, Buffer, Recorder, Resource, Shader, shaders};
use nephroid::render::gpu_types::constants::{
    ARGUMENT_WORDS, AS_TRIANGLE, BATCH_DRAW_WORD, CLIPPED_SHIFT, CLUSTER_STARTS, DIELECTRIC,
    FACET_DIVISION_SHIFT, MIRROR, PARTS_SHIFT, PIECES_SHIFT, SECOND_UNITS_WORD, UNITS_WORD,
};
use nephroid::render::gpu_types::{
    ClusterStart, CompactPush, Facet, FacetImage, FacetPatches, FacetPush, Footprint, Light,
    Normals, NumberPush, Object, Patch, PinholeImage, PlanarReceiver, Profile, ProjectPush,
    ScanPush, Triangle, TriangleSplat,
};
use std::f32::consts::{FRAC_1_SQRT_2, PI};

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

/// Runs `shader` in one thread on buffers with this content, by name, and returns the buffers.
fn run<P: bytemuck::Pod>(
    device: &Device,
    shader: &'static Shader,
    content: &[(&'static str, Vec<u8>)],
    push: &P,
) -> Vec<(&'static str, Buffer)> {
    let context = &device.0;
    let buffers: Vec<_> = (content.iter())
        .filter(|(name, _)| (shader.bindings.iter()).any(|binding| binding.name == *name))
        .map(|(name, bytes)| (*name, Buffer::with_data(context, name, bytes).unwrap()))
        .collect();
    let resources: Vec<_> = (buffers.iter())
        .map(|(name, buffer)| (*name, Resource::Buffer(buffer)))
        .collect();
    let pipeline = BoundPipeline::compute(context, shader, Default::default(), &resources).unwrap();
    let mut recorder = Recorder::new(context).unwrap();
    recorder.dispatch(&pipeline, push, [1, 1, 1]);
    recorder.submit().unwrap();
    buffers
}

fn read<T: bytemuck::Pod>(buffers: &[(&'static str, Buffer)], name: &str, count: usize) -> Vec<T> {
    let (_, buffer) = (buffers.iter().find(|(of, _)| *of == name)).unwrap();
    buffer.read::<T>(count).unwrap()
}

fn bytes<T: bytemuck::Pod>(values: &[T]) -> Vec<u8> {
    bytemuck::cast_slice(values).to_vec()
}

/// What the shaders read of the scene: a sun, the floor and a caster of this kind.
fn scene(light: &Light, object: &Object) -> Vec<(&'static str, Vec<u8>)> {
    // The bell (1 − t)⁴ for every sharpness.
    let bell = Profile {
        flatness: 0.0,
        support: 12.0,
        mean: 0.2,
        unused: 0.0,
    };
    vec![
        ("nodes", vec![0; 64]),
        ("objects", bytes(&[*object])),
        ("lights", bytes(&[*light])),
        ("planar_receivers", bytes(&[floor()])),
        ("profiles", bytes(&[bell; 2])),
        ("coarse", vec![0; 4]),
    ]
}

/// The used slots of one pair of cluster and environment cell, projected by `shader` with nothing in the way.
fn project<T: bytemuck::Pod>(
    shader: &'static Shader,
    splats: &'static str,
    (patch, light, object): (&Patch, &Light, &Object),
) -> Vec<T> {
    let device = Device::open();
    let mut content = scene(light, object);
    let triangle = Triangle {
        edge1: patch.edge1,
        edge2: patch.edge2,
        ..Triangle::zeroed()
    };
    let start = ClusterStart {
        position: patch.position,
        normal: patch.normal,
        ..ClusterStart::zeroed()
    };
    content.extend([
        ("triangles", bytes(&[triangle])),
        ("patches", bytes(&[*patch])),
        ("pairs", vec![0; 8]),
        ("starts", bytes(&[start; CLUSTER_STARTS as usize])),
        ("counts", vec![0xff; 4 * 64]),
        ("group_counts", vec![0xff; 8]),
        (splats, vec![0; 8 * size_of::<T>()]),
    ]);
    let push = ProjectPush {
        pair_count: 1,
        patch_count: 1,
        receiver_count: 1,
        lobes: 1,
        spread: EDGE_SPREAD,
        flat_spread: SPREAD,
        ..ProjectPush::zeroed()
    };
    let buffers = run(&device, shader, &content, &push);
    let count = read::<u32>(&buffers, "counts", 1)[0];
    let of_group = read::<u32>(&buffers, "group_counts", 2);
    assert_eq!(of_group, [count, count.min(1)]);
    match count {
        0 => Vec::new(),
        _ => read(&buffers, splats, count as usize),
    }
}

fn footprints(patch: &Patch) -> Vec<Footprint> {
    let input = (patch, &sun(), &mirror());
    project(&shaders::ENVIRONMENT_FOOTPRINT_COMP, "footprints", input)
}

/// The facet that is the patch, with what the passes from facets to triangles read.
fn facet(patch: &Patch, object: &Object) -> Vec<(&'static str, Vec<u8>)> {
    let triangle = Triangle {
        position: patch.position - (patch.edge1 + patch.edge2) / 3.0,
        edge1: patch.edge1,
        edge2: patch.edge2,
        ..Triangle::zeroed()
    };
    let normals = Normals {
        n0: patch.normal,
        n1: patch.normal,
        n2: patch.normal,
        ..Normals::zeroed()
    };
    let whole = Facet {
        place: 1 << FACET_DIVISION_SHIFT,
        corner1: 1,
        corner2: 2,
        ..Facet::zeroed()
    };
    let mut content = scene(&sun(), object);
    content.extend([
        ("triangles", bytes(&[triangle])),
        ("normals", bytes(&[normals])),
        ("facets", bytes(&[whole])),
    ]);
    content
}

fn facet_push(lobes: u32) -> FacetPush {
    FacetPush {
        facet_count: 1,
        corner_count: 3,
        light_count: 1,
        receiver_count: 1,
        lobes,
        ..FacetPush::zeroed()
    }
}

/// The flux of the facet on the floor, W, and the mask of its lobes.
fn facet_flux(patch: &Patch, object: &Object, lobes: u32) -> (f32, u32) {
    let mut content = facet(patch, object);
    content.extend([
        ("facet_patches", vec![0; 8]),
        ("facet_images", vec![0; size_of::<FacetImage>()]),
        ("visibility", vec![0; 12]),
    ]);
    let push = facet_push(lobes);
    let (device, shader) = (Device::open(), &shaders::FACET_FLUX_COMP);
    let buffers = run(&device, shader, &content, &push);
    let patches = read::<FacetPatches>(&buffers, "facet_patches", 1)[0];
    let image = read::<FacetImage>(&buffers, "facet_images", 1)[0];
    // The targets that rays from the corners are needed for.
    assert_eq!(read::<u32>(&buffers, "visibility", 3), [patches.targets; 3]);
    (image.flux, patches.targets)
}

/// The totals of both sums, as scan.comp writes them.
fn totals(units: [u32; 2]) -> [u32; ARGUMENT_WORDS as usize] {
    let mut words = [0; ARGUMENT_WORDS as usize];
    words[UNITS_WORD as usize] = units[0];
    words[SECOND_UNITS_WORD as usize] = units[1];
    words
}

/// The triangle of the facet on the floor; `flags` as in patch_splats.glsl.
fn triangle_splat(patch: &Patch, flags: u32) -> TriangleSplat {
    let only = FacetPatches {
        division: 1,
        targets: 1,
    };
    let totals = bytes(&totals([1, 1]));
    let mut content = facet(patch, &mirror());
    content.extend([
        ("facet_patches", bytes(&[only])),
        ("facet_images", bytes(&[FacetImage::zeroed()])),
        ("patch_sums", vec![0; 8]),
        ("patch_numbers", vec![0; 8]),
        ("totals", totals.clone()),
        ("splat_numbers", vec![0; 8]),
        (
            "patch_splats",
            bytes(&[1u32 | 1 << PARTS_SHIFT | 1 << PIECES_SHIFT | flags]),
        ),
        ("splat_sums", vec![0; 8]),
        ("splat_totals", totals),
        ("triangle_splats", vec![0; size_of::<TriangleSplat>()]),
    ]);
    let (device, shader) = (Device::open(), &shaders::PROJECT_TRIANGLES_COMP);
    let buffers = run(&device, shader, &content, &facet_push(1));
    read(&buffers, "triangle_splats", 1)[0]
}

fn assert_close2(found: Vec2, expected: Vec2) {
    assert!(found.abs_diff_eq(expected, 2e-4), "{found} {expected}");
}

fn assert_close4(found: Vec4, expected: Vec4) {
    assert!(found.abs_diff_eq(expected, 2e-5), "{found} {expected}");
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

/// The image has the corners (46⅔, 30⅔), (50⅔, 30⅔) and (46⅔, 34⅔). Without a disc, the blur is a texel.
#[test]
fn a_flat_facet_is_a_triangle() {
    let splat = triangle_splat(&upright(2.0), 0);
    assert_eq!(splat.lower, vec2(46.0, 30.0));
    // The triangle around it has an area of 18 texels, the rectangle 25.
    assert_eq!(splat.upper, Vec2::splat(AS_TRIANGLE));
    assert_close4(splat.blur, vec4(1.0, 0.0, 0.0, 1.0));
    let [first, second] = [splat.corners01.xy(), splat.corners01.zw()];
    let place = |corner: Vec2| splat.lower + corner - 2.0 / 3.0;
    assert_close2(place(first), vec2(46.0, 30.0));
    assert_close2(place(second), vec2(50.0, 30.0));
    assert_close2(place(splat.corner2), vec2(46.0, 34.0));
    assert_close2(splat.density12, Vec2::ONE);
    assert_eq!(splat.points, 0.0);
    assert_close3(splat.irradiance, flux() / (8.0 * TEXEL_AREA));
}

/// The floor cuts the facet: its upper corner is ⅓ m above, the others are ⅙ m below. What remains is the facet scaled
/// by ⅔ toward that corner; the cut is found to 1/64 of a side.
#[test]
fn a_facet_is_clipped_at_the_receiver() {
    let splat = triangle_splat(&upright(0.0), 1 << CLIPPED_SHIFT);
    let corners = [splat.corners01.xy(), splat.corners01.zw(), splat.corner2];
    let place = |corner: Vec2| splat.lower + corner;
    let centre = corners.into_iter().map(place).sum::<Vec2>() / 3.0;
    let expected = vec2(32.0 + 8.0 / 9.0, 32.0 - 8.0 / 18.0);
    assert!(
        centre.abs_diff_eq(expected, 8.0 / 64.0),
        "{centre} {expected}"
    );
    let [a, b] = [corners[1] - corners[0], corners[2] - corners[0]];
    let area = 0.5 * a.perp_dot(b).abs();
    assert_relative_eq!(area, 8.0 * 4.0 / 9.0, max_relative = 4.0 / 64.0);
    // The irradiance stays that of the whole facet's image.
    assert_close3(splat.irradiance, flux() / (8.0 * TEXEL_AREA));
    // Wholly below.
    assert_eq!(facet_flux(&upright(-0.5), &mirror(), 1), (0.0, 0));
}

#[test]
fn a_close_cluster_has_a_footprint() {
    let found = footprints(&upright(1.0));
    let [footprint] = found[..] else {
        panic!("{found:?}")
    };
    let (conic, peak) = bell(1.0, flux());
    assert_close2(footprint.centre, vec2(32.0 + 8.0, 32.0));
    assert_close3(footprint.conic, conic);
    assert_close3(footprint.peak, peak);
}

/// Nearer to the floor the patch's plane, the column 32, cuts the footprint 4 texels from its centre: ℓ = (¼, 0).
#[test]
fn a_footprint_is_folded_at_the_plane_of_its_patch() {
    let found = footprints(&upright(0.5));
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

/// From glass into air at 45°, beyond the critical angle of 41.8°, all light is reflected; from air into glass,
/// Fresnel's law divides it, and both parts land on the floor.
#[test]
fn total_reflection_refracts_nothing() {
    let glass = |index: f32| Object {
        kind: DIELECTRIC,
        index: vec3(index, 0.0, 0.0),
        ..Object::zeroed()
    };
    let mean = IRRADIANCE.element_sum() / 3.0 * AREA * FRAC_1_SQRT_2;
    let (found, lobes) = facet_flux(&upright(2.0), &glass(1.0 / 1.5), 2);
    assert_relative_eq!(found, mean, max_relative = 1e-5);
    assert_eq!(lobes, 0b01);
    let (found, lobes) = facet_flux(&upright(1.0), &glass(1.5), 2);
    assert_relative_eq!(found, mean, max_relative = 1e-5);
    assert_eq!(lobes, 0b11);
}

/// 1300 numbers are 21 blocks; 2 · 650 + 1 units of the first sum are two batches of 1000. Other totals limit their number.
#[test]
fn numbers_become_prefix_sums() {
    const COUNT: u32 = 1300;
    const CAPACITY: u32 = 5000;
    let device = Device::open();
    let context = &device.0;
    let numbers: Vec<[u32; 2]> = (0..COUNT).map(|i| [i % 3, u32::from(i % 3 > 0)]).collect();
    let buffer =
        |name, words: usize| Buffer::with_data(context, name, &vec![u32::MAX; words]).unwrap();
    let mut numbers_and_more = numbers.clone();
    numbers_and_more.resize(CAPACITY as usize, [7, 7]);
    let numbers_buffer = Buffer::with_data(context, "numbers", &numbers_and_more).unwrap();
    let units = Buffer::with_data(context, "units", &totals([COUNT, 0])).unwrap();
    let words = ARGUMENT_WORDS as usize;
    let (sums, totals) = (buffer("sums", 2 * 79), buffer("totals", 3 * words));
    let resources = [
        ("numbers", Resource::Buffer(&numbers_buffer)),
        ("block_sums", Resource::Buffer(&sums)),
        ("totals", Resource::Buffer(&totals)),
        ("unit_totals", Resource::Buffer(&units)),
    ];
    let [number, scan] = [&shaders::NUMBER_COMP, &shaders::SCAN_COMP].map(|shader| {
        BoundPipeline::compute(context, shader, Default::default(), &resources).unwrap()
    });
    let mut recorder = Recorder::new(context).unwrap();
    let push = NumberPush {
        count: CAPACITY,
        is_limited: 1,
    };
    recorder.dispatch(&number, &push, [128, 1, 1]);
    recorder.submit().unwrap();
    let push = ScanPush {
        count: CAPACITY,
        is_limited: 1,
        batches: 2,
        batch_size: 1000,
    };
    recorder.dispatch(&scan, &push, [1, 1, 1]);
    recorder.submit().unwrap();
    let found = numbers_buffer.read::<[u32; 2]>(COUNT as usize).unwrap();
    let sums = sums.read::<[u32; 2]>(21).unwrap();
    let mut expected = [0, 0];
    for (i, number) in numbers.iter().enumerate() {
        let sum = [0, 1].map(|k| sums[i / 64][k] + found[i][k]);
        assert_eq!(sum, expected, "{i}");
        expected = [0, 1].map(|k| expected[k] + number[k]);
    }
    let [units, lit] = expected;
    assert_eq!([units, lit], [1299, 866]);
    let totals = totals.read::<u32>(3 * words).unwrap();
    assert_eq!(
        totals[..8],
        [units.div_ceil(64), 1, 1, lit.div_ceil(64), 1, 1, units, lit]
    );
    // Threads and indices of both batches.
    let [first, second] = [1, 2].map(|batch| &totals[batch * words..]);
    assert_eq!(first[..3], [1000_u32.div_ceil(64), 1, 1]);
    assert_eq!(second[..3], [299_u32.div_ceil(64), 1, 1]);
    let [first, second] = [first, second].map(|words| &words[BATCH_DRAW_WORD as usize..]);
    assert_eq!(first[..2], [6 * 1000, 1]);
    assert_eq!(second[..2], [6 * 299, 1]);
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
        project(&shaders::PINHOLE_IMAGE_COMP, "pinhole_images", input)
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
    // The azimuth is the angle between both, of which the cell has half_azimuth to either side.
    assert_close3(image.east, vec3(0.0, -1.0 / 16.0, 0.0));
    assert_eq!(image.half_azimuth, half_azimuth);
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
    let kernels = |height: f32, cell: &Light| -> usize {
        let input = (&upright(height), cell, &mirror());
        let shader = &shaders::ENVIRONMENT_FOOTPRINT_COMP;
        project::<Footprint>(shader, "footprints", input).len()
    };
    // The kernel of a narrow cell stays before the patch's plane, 16 texels from its centre. That of the wide one does not, and
    // is folded.
    let narrow = Light {
        half_azimuth: 0.1 * half_azimuth,
        half_sine: 0.1 * half_sine,
        ..cell
    };
    assert_eq!([2.0, 1.0].map(|height| kernels(height, &narrow)), [0, 1]);
    assert_eq!(kernels(1.0, &cell), 2);
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
    let pipeline =
        BoundPipeline::compute(context, compact, Default::default(), &resources).unwrap();
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
