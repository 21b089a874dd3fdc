//! Footprints: kernels that represent the images of wide lights by patches on planar receivers.

use crate::error::Result;
use crate::gpu::{Buffer, Context, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::Footprint;
use crate::render::lights::Source;
use crate::render::splat::kernel_profiles::{CLUSTER_SPREAD, SPREAD};
use crate::render::splat::projector::{Description, Projector, passes};
use crate::render::splat::resolve::Levels;
use std::sync::Arc;

/// Footprints of a patch on a receiver for one lobe: the footprint and its fold.
const SLOTS: u32 = 2;

/// # Errors
/// As [`Projector::new`].
pub fn footprints(
    context: &Arc<Context>,
    scene: &DeviceScene,
    source: Source,
    patches: &Buffer,
    levels: &Levels,
) -> Result<Projector> {
    let (shader, spread, passes) = match source {
        Source::Environment => (
            &shaders::ENVIRONMENT_FOOTPRINT_COMP,
            CLUSTER_SPREAD,
            passes!("environment footprints"),
        ),
        _ => (&shaders::FOOTPRINT_COMP, SPREAD, passes!("footprints")),
    };
    let description = Description {
        shader,
        splats: "footprints",
        splat_bytes: size_of::<Footprint>(),
        slots: SLOTS * scene.planar_targets(),
        draw: [&shaders::FOOTPRINT_VERT, &shaders::FOOTPRINT_FRAG],
        draw_reads: &[],
        receiver_count: scene.receivers.planar_count,
        spread,
        levels: Some(levels),
        passes,
    };
    Projector::new(context, scene, source, patches, &description)
}
