//! Mesh footprints: kernels that represent the images of lights by patches on mesh receivers. A kernel finds its texels
//! by their positions in space.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Resource, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::MeshFootprint;
use crate::render::gpu_types::constants::MESH_FOOTPRINT_SLOTS;
use crate::render::lights::Source;
use crate::render::splat::kernel_profiles::{CLUSTER_SPREAD, SPREAD};
use crate::render::splat::projector::{Description, Projector, passes};
use std::sync::Arc;

/// # Errors
/// As [`Projector::new`].
pub fn mesh_footprints(
    context: &Arc<Context>,
    scene: &DeviceScene,
    source: Source,
    patches: &Buffer,
) -> Result<Projector> {
    let (shader, spread, passes) = match source {
        Source::Environment => (
            &shaders::ENVIRONMENT_MESH_FOOTPRINT_COMP,
            CLUSTER_SPREAD,
            passes!("environment mesh footprints"),
        ),
        Source::Suns => (
            &shaders::MESH_FOOTPRINT_COMP,
            SPREAD,
            passes!("mesh footprints"),
        ),
    };
    let texels = &scene.receivers.atlas_texels;
    let description = Description {
        shader,
        splats: "mesh_footprints",
        splat_bytes: size_of::<MeshFootprint>(),
        slots: MESH_FOOTPRINT_SLOTS * scene.casters.lobes * scene.receivers.mesh_count(),
        draw: [&shaders::MESH_FOOTPRINT_VERT, &shaders::MESH_FOOTPRINT_FRAG],
        draw_reads: &[("atlas_texels", Resource::Buffer(texels))],
        receiver_count: scene.receivers.mesh_count(),
        spread,
        levels: None,
        passes,
    };
    Projector::new(context, scene, source, patches, &description)
}
