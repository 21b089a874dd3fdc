//! What a host says and gets in a frame.

use crate::gpu::Image;
use crate::render::device_scene::DeviceScene;
use crate::scene::Scene;
use ash::vk;

/// The contents of a frame.
#[derive(Clone, Copy)]
pub struct Frame<'a> {
    /// The present scene. Positions, sizes, directions and colours may differ from the last frame; the structure may
    /// not.
    pub scene: &'a Scene,
    /// Whether to compute the direct light of all lights into [`Output::direct_map`].
    pub direct: bool,
}

/// The results of a recorded frame. The handles stay valid until the renderer is dropped.
#[derive(Debug, Clone, Copy)]
pub struct Output<'a> {
    /// Caustic irradiance of all receivers, W/m² in linear RGB, one tile each; alpha is undefined.
    pub light_map: MapImage,
    /// Direct irradiance in the same tiles; undefined if the frame did not ask for it.
    pub direct_map: MapImage,
    /// The stages and accesses that the host must wait for and make visible before it reads the maps.
    pub last_stage: vk::PipelineStageFlags2,
    pub last_access: vk::AccessFlags2,
    pub receivers: &'a [ReceiverTile],
}

/// An image that the host may sample. Its format is `R32G32B32A32_SFLOAT`.
#[derive(Debug, Clone, Copy)]
pub struct MapImage {
    pub image: vk::Image,
    pub view: vk::ImageView,
    /// The renderer leaves the image in this layout and expects it in this layout.
    pub layout: vk::ImageLayout,
    /// Texels.
    pub size: [u32; 2],
}

/// A receiver's tile of the maps.
#[derive(Debug, Clone, Copy)]
pub struct ReceiverTile {
    /// Index into [`Scene::objects`].
    pub object: usize,
    /// Top left texel, and size in texels.
    pub origin: [u32; 2],
    pub size: [u32; 2],
    /// Transform to the coordinates of the map, `uv * scale + offset`. uv are a rectangle's coordinates (u along
    /// `edge_u`, v along `edge_v`, 0 to 1) or a mesh's texture coordinates (v upward).
    pub scale: [f32; 2],
    pub offset: [f32; 2],
}

impl MapImage {
    /// The handles of `image`.
    pub(super) fn of(image: &Image) -> Self {
        let (handle, view) = image.raw();
        Self {
            image: handle,
            view,
            layout: vk::ImageLayout::GENERAL,
            size: [image.width, image.height],
        }
    }
}

/// The tiles of all receivers.
pub fn tiles(scene: &DeviceScene) -> Vec<ReceiverTile> {
    let all = scene.receivers.image_size;
    (scene.receivers.tiles.iter())
        .map(|tile| {
            let [mut scale, mut offset] = [[0.0; 2]; 2];
            for axis in 0..2 {
                scale[axis] = tile.size[axis] as f32 / all[axis] as f32;
                offset[axis] = tile.origin[axis] as f32 / all[axis] as f32;
            }
            // v points up, and the rows of the map start at the top.
            offset[1] += scale[1];
            scale[1] = -scale[1];
            ReceiverTile {
                object: tile.object,
                origin: tile.origin,
                size: tile.size,
                scale,
                offset,
            }
        })
        .collect()
}
