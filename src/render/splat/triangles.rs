//! Triangles: a patch projected along its corners' outgoing rays onto a planar receiver, as a triangle of constant
//! irradiance. Most renderings of water use this method. It is accurate for lights that blur much less than a texel.

use crate::error::Result;
use crate::gpu::{Buffer, Context, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::TriangleSplat;
use crate::render::lights::Source;
use crate::render::splat::kernel_profiles::SPREAD;
use crate::render::splat::projector::{Description, Projector, passes};
use std::sync::Arc;

/// # Errors
/// As [`Projector::new`].
pub fn triangles(
    context: &Arc<Context>,
    scene: &DeviceScene,
    patches: &Buffer,
) -> Result<Projector> {
    let description = Description {
        shader: &shaders::TRIANGLE_COMP,
        splats: "triangle_splats",
        splat_bytes: size_of::<TriangleSplat>(),
        slots: scene.planar_targets(),
        draw: [&shaders::TRIANGLE_VERT, &shaders::TRIANGLE_FRAG],
        draw_reads: &[],
        receiver_count: scene.receivers.planar_count,
        spread: SPREAD,
        levels: None,
        passes: passes!("triangles"),
    };
    Projector::new(context, scene, Source::Narrow, patches, &description)
}
