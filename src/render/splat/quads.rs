//! Quads: splats are drawn as two triangles each.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Image, Staging};
use crate::render::gpu_types::DrawPush;
use glam::Vec2;
use std::sync::Arc;

/// Corners of the two triangles of a quad; see quad.glsl.
const CORNERS: [u32; 6] = [0, 1, 2, 2, 1, 3];

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
        .flat_map(|quad| CORNERS.map(|corner| 4 * quad + corner))
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
