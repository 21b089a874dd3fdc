//! The kinds of projectors: footprints and pinhole images of environment cells on planar receivers, and mesh footprints.

use crate::error::Result;
use crate::gpu::{Buffer, Context, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::constants::{FOOTPRINT_SLOTS, MESH_FOOTPRINT_SLOTS};
use crate::render::gpu_types::{Footprint, MeshFootprint, PinholeImage};
use crate::render::lights::Source;
use crate::render::splat::kernel_profiles::{CLUSTER_SPREAD, IMAGE_SPREAD, SPREAD};
use crate::render::splat::projector::{Description, Projector, passes};
use crate::render::splat::resolve::Levels;
use std::sync::Arc;

/// Kernels that represent the images of environment cells by patch clusters on planar receivers.
///
/// # Errors
/// As [`Projector::new`].
pub fn footprints(
    context: &Arc<Context>,
    scene: &DeviceScene,
    patches: &Buffer,
    levels: &Levels,
) -> Result<Projector> {
    let description = Description {
        shader: &shaders::ENVIRONMENT_FOOTPRINT_COMP,
        splats: "footprints",
        splat_bytes: size_of::<Footprint>(),
        slots: FOOTPRINT_SLOTS * scene.planar_targets(),
        draw: [&shaders::FOOTPRINT_VERT, &shaders::FOOTPRINT_FRAG],
        spread: CLUSTER_SPREAD,
        levels: Some(levels),
        passes: passes!("environment footprints"),
    };
    Projector::new(context, scene, Source::Environment, patches, &description)
}

/// The images of environment cells, with sharp or blurred edges, by patch clusters on planar receivers.
///
/// # Errors
/// As [`Projector::new`].
pub fn pinhole_images(
    context: &Arc<Context>,
    scene: &DeviceScene,
    patches: &Buffer,
    levels: &Levels,
) -> Result<Projector> {
    let description = Description {
        shader: &shaders::PINHOLE_IMAGE_COMP,
        splats: "pinhole_images",
        splat_bytes: size_of::<PinholeImage>(),
        // Dielectrics project from both sides.
        slots: scene.casters.lobes * scene.planar_targets(),
        draw: [&shaders::PINHOLE_IMAGE_VERT, &shaders::PINHOLE_IMAGE_FRAG],
        spread: IMAGE_SPREAD,
        levels: Some(levels),
        passes: passes!("pinhole images"),
    };
    Projector::new(context, scene, Source::Environment, patches, &description)
}

/// Kernels that represent the images of lights by patches on mesh receivers. A kernel finds its texels by their positions in
/// space.
///
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
    let description = Description {
        shader,
        splats: "mesh_footprints",
        splat_bytes: size_of::<MeshFootprint>(),
        slots: MESH_FOOTPRINT_SLOTS * scene.casters.lobes * scene.receivers.mesh_count(),
        draw: [&shaders::MESH_FOOTPRINT_VERT, &shaders::MESH_FOOTPRINT_FRAG],
        spread,
        levels: None,
        passes,
    };
    Projector::new(context, scene, source, patches, &description)
}
