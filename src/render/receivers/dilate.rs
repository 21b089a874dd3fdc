//! dilate: extends the light maps of meshes around their charts.

use crate::error::Result;
use crate::gpu::{BoundPipeline, Context, Image, Recorder, Resource, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::DilatePush;
use crate::render::receivers::tile::Tile;
use std::ops::Range;
use std::sync::Arc;

/// Fills the texels around the charts of an image that has the layout of the light maps.
pub struct Dilate {
    pipeline: BoundPipeline,
}

impl Dilate {
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn new(context: &Arc<Context>, scene: &DeviceScene, light_map: &Image) -> Result<Self> {
        let own = [("light_map", Resource::Image(light_map))];
        let pipeline = scene.compute(context, &shaders::DILATE_COMP, &own)?;
        Ok(Self { pipeline })
    }

    /// Records the dilation of some rows of a mesh receiver's tile of the image.
    pub fn record(&self, recorder: &mut Recorder, receiver: u32, tile: &Tile, rows: Range<u32>) {
        let push = DilatePush {
            receiver,
            first_row: rows.start,
            tile: tile.origin.into(),
        };
        recorder.dispatch(
            &self.pipeline,
            &push,
            [tile.size[0], rows.end - rows.start, 1],
        );
    }
}
