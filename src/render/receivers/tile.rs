//! The tiles of the light-map image.

/// A receiver's tile of the light-map image.
#[derive(Debug, Clone, Copy)]
pub struct Tile {
    /// Index into [`crate::scene::Scene::objects`].
    pub object: usize,
    /// Its top left texel.
    pub origin: [u32; 2],
    /// Texels.
    pub size: [u32; 2],
}
