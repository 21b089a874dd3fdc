//! The input and output of a host's frame.

use crate::gpu::Image;
use crate::render::device_scene::DeviceScene;
use crate::render::receivers::tile::Tile;
use crate::scene::Scene;
use ash::vk;

/// The contents of a frame.
#[derive(Clone, Copy)]
pub struct Frame<'a> {
    /// The scene at the time of the frame. Positions, sizes, directions and colours may differ from the last frame; the
    /// structure may not.
    pub scene: &'a Scene,
    /// Whether to compute the direct light of all lights into [`Output::direct_map`]. An unchanged scene keeps its map.
    pub direct: bool,
    /// The picture of the scene's camera to compute into [`Output::view`]. It implies `direct`.
    pub view: Option<ViewFrame>,
}

/// Size and sampling of a picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ViewFrame {
    /// Width and height, pixels. A frame of another size than the last one allocates.
    pub size: [u32; 2],
    /// Square root of the number of samples per pixel, 1 or more.
    pub antialias: u32,
}

/// The results of a recorded frame. The handles stay valid until the renderer is dropped.
#[derive(Debug, Clone, Copy)]
pub struct Output<'a> {
    /// Caustic irradiance of all receivers, W/m² in linear RGB, one tile each; alpha is undefined.
    pub light_map: MapImage,
    /// Direct irradiance, W/m², in tiles of its own: [`ReceiverTile::direct`]. Undefined if no frame asked for it.
    pub direct_map: MapImage,
    /// Linear radiance of the picture, W/m²/sr, if the frame asked for it.
    pub view: Option<MapImage>,
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
    /// Width and height, texels.
    pub size: [u32; 2],
}

/// A receiver's tiles of the maps.
#[derive(Debug, Clone, Copy)]
pub struct ReceiverTile {
    /// Index into [`Scene::objects`].
    pub object: usize,
    /// Its tile of the light map.
    pub light: MapTile,
    /// Its tile of the direct map.
    pub direct: MapTile,
}

/// A tile of a map.
#[derive(Debug, Clone, Copy)]
pub struct MapTile {
    /// Top left texel, and width and height, texels.
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
    let surfaces = &scene.surfaces;
    (scene.receivers.tiles.iter())
        .map(|tile| {
            let direct = (surfaces.tiles.iter()).find(|direct| direct.tile.object == tile.object);
            let direct = &direct.expect("receivers are diffuse").tile;
            ReceiverTile {
                object: tile.object,
                light: MapTile::of(tile, scene.receivers.image_size),
                direct: MapTile::of(direct, surfaces.image_size),
            }
        })
        .collect()
}

impl MapTile {
    /// A tile of an image of `all` texels.
    fn of(tile: &Tile, all: [u32; 2]) -> Self {
        let [mut scale, mut offset] = [[0.0; 2]; 2];
        for axis in 0..2 {
            scale[axis] = tile.size[axis] as f32 / all[axis] as f32;
            offset[axis] = tile.origin[axis] as f32 / all[axis] as f32;
        }
        // v points up, and the rows of the map start at the top.
        offset[1] += scale[1];
        scale[1] = -scale[1];
        Self {
            origin: tile.origin,
            size: tile.size,
            scale,
            offset,
        }
    }
}
