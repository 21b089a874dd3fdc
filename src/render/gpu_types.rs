//! Rust mirrors of `glsl/shared/gpu_types.glsl`, field by field. A test compares names and offsets with the SPIR-V. The
//! GLSL file documents meanings and units.

use bytemuck::{Pod, Zeroable};
use glam::{UVec2, UVec3, UVec4, Vec2, Vec3, Vec4};

/// Declares `#[repr(C)]` structs and the list of their offsets.
macro_rules! mirrors {
    ($($(#[$doc:meta])* $name:ident { $($field:ident: $type:ty,)* })*) => {
        $(
            $(#[$doc])*
            #[repr(C)]
            #[derive(Debug, Clone, Copy, Default, Pod, Zeroable)]
            pub struct $name { $(pub $field: $type,)* }
        )*

        /// Expected layout of every mirror in the SPIR-V.
        #[cfg(test)]
        const MIRRORS: &[crate::gpu::StructLayout] = &[$(crate::gpu::StructLayout {
            name: stringify!($name),
            size: size_of::<$name>(),
            fields: &[$((stringify!($field), std::mem::offset_of!($name, $field)),)*],
        },)*];
    };
}

mirrors! {
    Triangle { position: Vec3, object: u32, edge1: Vec3, flags: u32, edge2: Vec3, twin: u32, }
    Normals { n0: Vec3, uv0: u32, n1: Vec3, uv1: u32, n2: Vec3, uv2: u32, }
    Grid { lower: Vec3, unused0: f32, scale: Vec3, unused1: f32, }
    Node { left: UVec3, left_link: u32, right: UVec3, right_link: u32, }
    NodeBox { lower: Vec3, unused: f32, upper: Vec3, cost: f32, }
    Object { color: Vec3, kind: u32, index: Vec3, receiver: i32, extinction: Vec3, shape: u32, }
    Light {
        place: Vec3, size: f32, power: Vec3, is_lamp: u32,
        axis1: Vec3, half_azimuth: f32, axis2: Vec3, half_sine: f32,
    }
    PlanarReceiver {
        origin: Vec3, tile_x: u32,
        edge_u: Vec3, tile_y: u32,
        edge_v: Vec3, width: u32,
        normal: Vec3, height: u32,
    }
    DiffuseSurface {
        origin: Vec3, kind: u32, edge_u: Vec3, tile_x: u32, edge_v: Vec3, tile_y: u32, normal: Vec3, width: u32,
        height: u32, environment_scale: u32, first_block: u32, triangle: u32,
        light_x: u32, light_y: u32, light_width: u32, light_height: u32,
    }
    TexturedTriangle { uv0: Vec2, uv1: Vec2, uv2: Vec2, first_level: u32, level_count: u32, }
    TextureLevel { origin: UVec2, size: UVec2, }
    TrianglePoints { first: u32, second: u32, third: u32, division: u32, }
    SurfacePoint { triangle: u32, weights: u32, radius: f32, }
    DirectCell { mean: Vec3, unused0: f32, power: Vec3, unused1: f32, direction: Vec3, unused2: f32, }
    MeshReceiver {
        tile_x: u32, tile_y: u32, width: u32, height: u32,
        first_texel: u32, first_node: u32, levels: u32, unused: u32,
    }
    AtlasTexel { position: Vec3, area: f32, normal: Vec3, source: u32, }
    AtlasSamples { triangles: UVec4, weights: UVec4, }
    AtlasNode {
        centre: Vec3, radius: f32, diagonal: Vec3, max_trace: f32,
        off_diagonal: Vec3, sine: f32, axis: Vec3, unused: f32,
    }
    LitTriangle { triangle: u32, first_patch: u32, subdivision: u32, share_end: u32, }
    Patch {
        position: Vec3, triangle: u32,
        normal: Vec3, area: f32,
        edge1: Vec3, object: u32,
        edge2: Vec3, unused0: f32,
        normal_du: Vec3, unused1: f32,
        normal_dv: Vec3, unused2: f32,
    }
    ClusterStart { position: Vec3, triangle: u32, normal: Vec3, unused: f32, }
    Footprint {
        centre: Vec2, slant: Vec2, conic: Vec3, flatness: f32, peak: Vec3, bulge_x: f32,
        clip: Vec3, bulge_y: f32, lower: Vec2, upper: Vec2,
    }
    ChainFootprint {
        conic: Vec3, flatness: f32, irradiance: Vec3, kernel: f32, sides: Vec4, centre: Vec2, lower: Vec2, upper: Vec2,
        share: f32, slant: u32,
    }
    PinholeImage {
        foot: Vec2, lower: Vec2, upper: Vec2, size: Vec2,
        ahead: Vec3, sharp_azimuth: f32, east: Vec3, sharp_sine: f32, up: Vec3, shear_range: u32,
        cosine: Vec3, sine: f32, radiance: Vec3, eta: f32, normal: Vec3, half_azimuth: f32,
    }
    MeshFootprint {
        centre: Vec3, flatness: f32, u: Vec3, travelled: f32, v: Vec3, low: u32, direction: Vec3, high: u32,
        conic: Vec3, tolerance: f32, peak: Vec3, base: i32, occluder: Vec3, stride: i32,
        occluder_normal: Vec3, growth: f32,
    }
    Facet {
        triangle: u32, place: u32, corner0: u32, corner1: u32,
        corner2: u32, exposed: f32, along: u32, unused: u32,
    }
    FacetCorner { triangle: u32, s: f32, t: f32, }
    FacetPatches { division: u32, targets: u32, }
    FacetImage { flux: f32, deviation_longest: u32, height_blur: u32, outline: u32, }
    ReceiverShare { flux: f32, patch_share: f32, error: f32, is_limited: u32, pieces: u32, }
    TriangleSplat {
        blur: Vec4, corners01: Vec4, corner2: Vec2, density12: Vec2,
        irradiance: Vec3, points: f32, lower: Vec2, upper: Vec2, origin: Vec2, slant: Vec2,
    }
    ChainLattice {
        origin: Vec3, first: u32, edge_u: Vec3, columns: u32, edge_v: Vec3, object: u32, direction: Vec3, light: u32,
        rows: u32, refinements: u32, group_size: u32, middle: f32, shift: Vec2, unused: Vec2,
    }
    PilotRay { flux: f32, receiver: u32, interfaces: u32, dispersed: f32, }
    LatticePilot {
        chains: u32, near_landings: u32, near_chains: u32, landings: u32,
        incoherent: Vec2, flux: f32, dispersed: f32, parts: f32, unused: f32,
    }
    LatticePlan { halvings: u32, bands: u32, light_halvings: u32, less_near_chains: u32, less_elsewhere: u32, }
    ChainPath {
        position: Vec3, triangle: u32, direction: Vec3, first_flux: f32, flux: Vec3, counts: u32,
        cell_place: Vec4, cell_direction: Vec4, light_place: Vec4, light_direction: Vec4,
        media: UVec2, start_or_spectrum: UVec2,
    }
    ChainHit { distance: f32, triangle: u32, barycentric: Vec2, media: UVec2, footprints: u32, lobes: u32, }
    PointSplat { irradiance: Vec3, texel: u32, }
    Profile { flatness: f32, support: f32, mean: f32, unused: f32, }

    PlacePush {
        column0: Vec3, first: u32, column1: Vec3, count: u32, column2: Vec3, inverse_scale: f32, shift: Vec3, unused: f32,
    }
    RefitPush { first_level: u32, end_level: u32, level_count: u32, }
    PackPush { node_count: u32, }
    SamplePush { first_patch: u32, patch_count: u32, lit_triangle_count: u32, }
    ProjectPush {
        first_pair: u32, pair_count: u32, patch_count: u32,
        receiver_count: u32, lobes: u32, spread: f32,
        flat_spread: f32, can_occlude: u32,
    }
    FacetPush {
        facet_count: u32, corner_count: u32, light_count: u32,
        receiver_count: u32, lobes: u32, can_occlude: u32, division: u32,
        error: f32, patch_share: f32, patch_budget: u32, is_lattice: u32, first_splat: u32,
        has_chains: u32, merging_error: f32, first_facet: u32, first_corner: u32,
    }
    ChainPush {
        is_first: u32, lattice_count: u32, pilot_count: u32, receiver_count: u32, mesh_count: u32,
        max_interfaces: u32, ray_capacity: u32, path_capacity: u32, splat_capacity: u32,
        mesh_splat_capacity: u32, first_mesh_splat: u32, mesh_splat_batch: u32,
        spread: f32, spectral_middle: f32, flux_scale: f32, error: f32,
    }
    TotalPush { pair_count: u32, receiver_count: u32, }
    NumberPush { count: u32, is_limited: u32, }
    ScanPush { count: u32, is_limited: u32, batches: u32, batch_size: u32, }
    CompactPush { pair_count: u32, slots: u32, }
    LevelsPush { receiver_count: u32, rows: u32, }
    DilatePush { receiver: u32, first_row: u32, tile: UVec2, }
    /// Push constants of all vertex shaders that draw into the light maps.
    DrawPush { atlas_size: Vec2, }
    ResolvePush { level: i32, first_row: i32, }
    PointsPush {
        first_point: u32, batch_points: u32, points: u32,
        lit_triangle_count: u32, receiver_count: u32, mesh_receiver_count: u32, lobes: u32, can_occlude: u32,
        max_interfaces: u32, area: f32, spectral_middle: f32,
    }
    PinholePush {
        first: UVec2, receiver: u32, first_patch: u32,
        batch_patches: u32, light_count: u32, epsilon: f32, spread: f32,
        rotation: f32, has_environment: u32, can_occlude: u32, is_mesh: u32,
    }
    ClassifyPush { first: u32, block_count: u32, light_count: u32, }
    ListedPush { first: u32, light_count: u32, }
    ShadowEdgesPush { first: u32, light_count: u32, is_in_motion: u32, }
    PenumbraPush { first: u32, light_count: u32, is_rest: u32, }
    PlanPush { per_group: u32, }
    DirectEnvironmentPush { first: UVec2, surface: u32, part: u32, }
    OpenGroupsPush { count: u32, }
    DirectPush { first: UVec2, surface: u32, receiver: u32, light_count: u32, }
    CopyPush { first: u32, end: u32, }
    DirectPointsPush { first: u32, end: u32, light_count: u32, }
    EnvironmentPointsPush { first: u32, end: u32, first_cell: u32, cell_step: u32, end_cell: u32, }
    CameraPush {
        eye: Vec3, near: f32, right: Vec3, first: u32, up: Vec3, light_count: u32, forward: Vec3, rotation: f32,
        size: Vec2, tile: Vec2,
    }
    OverlayPush {
        eye: Vec3, near: f32, right: Vec3, facet_count: u32, up: Vec3, light_count: u32, forward: Vec3, corner_count: u32,
        size: Vec2, receiver_count: u32, lobes: u32, white: f32, shown: u32, first: u32, is_sun: u32, every: u32, first_facet: u32,
    }
    ViewPush {
        eye: Vec3, light_count: u32, right: Vec3, rotation: f32, up: Vec3, side: u32, forward: Vec3, capacity: u32,
        size: Vec2, tile: UVec2, first: UVec2, end: UVec2,
    }
}

impl Triangle {
    /// m²
    pub fn area(&self) -> f32 {
        0.5 * self.edge1.cross(self.edge2).length()
    }
}

/// Constants of `glsl/shared/constants.glsl`, made by build.rs.
pub mod constants {
    include!(concat!(env!("OUT_DIR"), "/constants.rs"));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::{StructLayout, shaders::STRUCTS};

    fn differences(mirrors: &[StructLayout]) -> Vec<String> {
        let glsl = |name| STRUCTS.iter().find(|glsl| glsl.name == name);
        mirrors
            .iter()
            .filter_map(|here| match glsl(here.name) {
                None => Some(format!("{} is in no shader", here.name)),
                Some(glsl) => (glsl != here).then(|| format!("{glsl:?}, here {here:?}")),
            })
            .collect()
    }

    /// Structs in texel buffers only, which the SPIR-V does not name: `texel_buffers.glsl` makes them of words in order.
    const IN_TEXELS: &[&str] = &[
        "Triangle",
        "Normals",
        "Grid",
        "Node",
        "Object",
        "Light",
        "PlanarReceiver",
        "Facet",
        "ClusterStart",
        "DiffuseSurface",
        "DirectCell",
        "ChainPath",
        "TexturedTriangle",
        "TextureLevel",
    ];

    /// These have the fields of the GLSL structs in their order. Plain-old-data structs have no padding.
    #[test]
    fn structs_in_texels_have_the_fields_of_glsl() {
        let glsl = include_str!("../../glsl/shared/gpu_types.glsl");
        for mirror in MIRRORS {
            if !IN_TEXELS.contains(&mirror.name) {
                continue;
            }
            let start = format!("struct {} {{\n", mirror.name);
            let (_, rest) = glsl.split_once(&start).expect(mirror.name);
            let (body, _) = rest.split_once("};").expect(mirror.name);
            let fields: Vec<_> = (body.lines())
                .flat_map(|line| line.split("//").next().unwrap_or("").split(';'))
                .filter_map(|field| field.split_whitespace().last())
                .collect();
            let names: Vec<_> = mirror.fields.iter().map(|(name, _)| *name).collect();
            assert_eq!(names, fields, "{}", mirror.name);
            assert_eq!(mirror.size % 16, 0, "{}", mirror.name);
        }
    }

    #[test]
    fn mirrors_match_the_spirv() {
        let in_blocks: Vec<_> = (MIRRORS.iter())
            .filter(|mirror| !IN_TEXELS.contains(&mirror.name))
            .copied()
            .collect();
        assert_eq!(differences(&in_blocks), Vec::<String>::new());
        // A shifted field, a wrong size and an unknown struct are detected.
        for (name, size, fields) in [
            (
                "LitTriangle",
                16,
                &[
                    ("triangle", 0),
                    ("first_patch", 8),
                    ("subdivision", 4),
                    ("share_end", 12),
                ][..],
            ),
            ("CompactPush", 8, &[("pair_count", 0), ("slots", 0)]),
            ("Nothing", 4, &[]),
        ] {
            assert_eq!(
                differences(&[StructLayout { name, size, fields }]).len(),
                1,
                "{name}"
            );
        }
    }
}
