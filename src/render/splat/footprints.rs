//! Footprints: kernels that represent the images of environment cells by patch clusters on planar receivers.

use crate::error::Result;
use crate::gpu::{Buffer, Context, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::Footprint;
use crate::render::gpu_types::constants::FOOTPRINT_SLOTS;
use crate::render::lights::Source;
use crate::render::splat::kernel_profiles::CLUSTER_SPREAD;
use crate::render::splat::projector::{Description, Projector, passes};
use crate::render::splat::resolve::Levels;
use std::sync::Arc;

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
        draw_reads: &[],
        receiver_count: scene.receivers.planar_count,
        spread: CLUSTER_SPREAD,
        levels: Some(levels),
        passes: passes!("environment footprints"),
    };
    Projector::new(context, scene, Source::Environment, patches, &description)
}
