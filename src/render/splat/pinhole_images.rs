//! Pinhole images: the image of an environment cell, with sharp or blurred edges, by a patch cluster on a planar
//! receiver.

use crate::error::Result;
use crate::gpu::{Buffer, Context, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::PinholeImage;
use crate::render::lights::Source;
use crate::render::splat::kernel_profiles::IMAGE_SPREAD;
use crate::render::splat::projector::{Description, Projector, passes};
use crate::render::splat::resolve::Levels;
use std::sync::Arc;

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
        draw_reads: &[],
        receiver_count: scene.receivers.planar_count,
        spread: IMAGE_SPREAD,
        levels: Some(levels),
        passes: passes!("pinhole images"),
    };
    Projector::new(context, scene, Source::Environment, patches, &description)
}
