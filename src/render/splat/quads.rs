//! Quads: splats are drawn as two triangles each.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Image, Staging};
use crate::render::gpu_types::DrawPush;
use crate::render::gpu_types::constants::QUAD_CORNERS;
use glam::Vec2;
use std::sync::Arc;

/// The index buffer of `count` quads. Vertex 4 i + c is corner c of quad i.
///
/// # Errors
/// [`crate::Error::Device`] where the device fails.
pub fn indices(
    context: &Arc<Context>,
    staging: &mut Staging,
    name: &str,
    count: u32,
) -> Result<Buffer> {
    let indices: Vec<u32> = (0..count)
        .flat_map(|quad| QUAD_CORNERS.map(|corner| 4 * quad + corner))
        .collect();
    let buffer = Buffer::new(context, name, size_of_val(&*indices) as u64)?;
    staging.write(&buffer, 0, &indices)?;
    Ok(buffer)
}

/// Push constants of a draw into the light maps.
pub fn draw_push(light_map: &Image) -> DrawPush {
    DrawPush {
        atlas_size: Vec2::new(light_map.width as f32, light_map.height as f32),
    }
}
