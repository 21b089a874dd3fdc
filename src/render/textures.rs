//! Textures of diffuse surfaces on the device: all levels of all textures in one image, so that devices with few descriptors
//! have them, too. Every level has a border of one texel, which repeats the opposite side.

use crate::error::{Error, Result};
use crate::gpu::{Buffer, Context, Image, Sampling, Staging, Texel};
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::{TextureLevel, TexturedTriangle};
use crate::render::receivers::light_maps::pack_tiles;
use crate::scene::{self, Scene};
use glam::{DVec2, UVec2};
use std::sync::Arc;

/// Texels around a level.
const BORDER: u32 = 1;

pub struct DeviceTextures {
    pub image: Image,
    /// Mipmap levels of all textures, one texture after the other.
    pub levels: Buffer,
    /// One for each triangle.
    pub triangles: Buffer,
    /// Whether a surface has a texture. Without one, the resources are as small as can be.
    pub is_present: bool,
    /// Index of the first level of each texture.
    first_levels: Vec<u32>,
}

impl DeviceTextures {
    /// Allocates and stages the textures of `scene`.
    ///
    /// # Errors
    /// [`Error::Usage`] where the textures do not fit into an image, [`Error::Device`] if device memory is insufficient.
    pub fn new(context: &Arc<Context>, staging: &mut Staging, scene: &Scene) -> Result<Self> {
        let is_present = (scene.objects.iter()).any(|object| map_of(scene, object).is_some());
        let textures = if is_present { &scene.textures[..] } else { &[] };
        let levels: Vec<_> = textures.iter().flat_map(|of| &of.levels).collect();
        let padded = |level: &&scene::TextureLevel| {
            [level.width, level.height].map(|side| side + 2 * BORDER)
        };
        let sizes: Vec<[u32; 2]> = levels.iter().map(padded).collect();
        let most = context.max_image_side();
        if let Some(large) = sizes.iter().find(|size| size[0].max(size[1]) > most) {
            let [width, height] = large.map(|side| side - 2 * BORDER);
            return Err(Error::Usage {
                reason: format!(
                    "an albedo map has {width}×{height} pixels, and the device allows {} a side",
                    most - 2 * BORDER
                ),
                remedy: "scale the image down, or choose another device".into(),
            });
        }
        let (origins, size) = pack_tiles(&sizes, most, "albedo maps with their mipmaps")?;
        let size = size.map(|side| side.max(1));
        let image = Image::of_texels(context, "textures", size, 1, Sampling::Clamp, Texel::Colour)?;
        staging.prepare(&image);
        let mut table = Vec::new();
        for ((level, &origin), &size) in levels.iter().zip(&origins).zip(&sizes) {
            staging.write_colours(&image, origin, size, &with_border(level))?;
            table.push(TextureLevel {
                origin: UVec2::from(origin) + BORDER,
                size: UVec2::new(level.width, level.height),
            });
        }
        let mut first_levels = Vec::new();
        let mut count = 0;
        for texture in textures {
            first_levels.push(count);
            count += texture.levels.len() as u32;
        }
        let buffer = |name, count: usize, bytes: usize| {
            Buffer::new(context, name, (count.max(1) * bytes) as u64)
        };
        let triangle_count = match is_present {
            true => (scene.objects.iter())
                .map(|of| of.geometry.mesh().triangles.len())
                .sum(),
            false => 0,
        };
        let made = Self {
            levels: buffer("texture levels", table.len(), size_of::<TextureLevel>())?,
            triangles: buffer(
                "textured triangles",
                triangle_count,
                size_of::<TexturedTriangle>(),
            )?,
            image,
            is_present,
            first_levels,
        };
        staging.write(&made.levels, 0, &table)?;
        Ok(made)
    }

    /// Writes the texture coordinates of all triangles, in the order of `store`.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn update(
        &self,
        staging: &mut Staging,
        scene: &Scene,
        store: &TriangleStore,
    ) -> Result<()> {
        if !self.is_present {
            return Ok(());
        }
        let mut triangles = vec![TexturedTriangle::default(); store.triangles.len()];
        for (index, object) in scene.objects.iter().enumerate() {
            let (Some(map), Some(coordinates)) =
                (map_of(scene, object), object.texture_coordinates())
            else {
                continue;
            };
            for (corners, &place) in coordinates.iter().zip(store.indices(index)) {
                let [uv0, uv1, uv2] = in_repeats(corners, map.uv_scale);
                triangles[place as usize] = TexturedTriangle {
                    uv0: uv0.as_vec2(),
                    uv1: uv1.as_vec2(),
                    uv2: uv2.as_vec2(),
                    first_level: self.first_levels[map.texture],
                    level_count: scene.textures[map.texture].levels.len() as u32,
                };
            }
        }
        staging.write(&self.triangles, 0, &triangles)
    }

    /// Bytes of device memory.
    pub fn bytes(&self) -> u64 {
        self.image.bytes() + self.levels.bytes() + self.triangles.bytes()
    }
}

/// The albedo map of an object that has one and texture coordinates.
pub fn map_of(scene: &Scene, object: &scene::Object) -> Option<scene::AlbedoMap> {
    let material = &scene.materials[object.material];
    // Without making those of a rect, since frames ask, too.
    let has_coordinates =
        object.uvs.is_some() || !matches!(object.geometry, scene::Geometry::Mesh(_));
    (material.albedo_map).filter(|_| !material.kind.is_specular() && has_coordinates)
}

/// Texture coordinates in repeats of the image. Whole repeats are taken off, since f32 has few digits.
fn in_repeats(corners: &[DVec2; 3], uv_scale: DVec2) -> [DVec2; 3] {
    let corners = corners.map(|uv| uv * uv_scale);
    let whole = corners[0].floor();
    corners.map(|uv| uv - whole)
}

/// The texels of a level and of its border.
fn with_border(level: &scene::TextureLevel) -> Vec<[u8; 4]> {
    let [width, height] = [level.width, level.height].map(|side| side as usize);
    let repeated = |at: usize, side: usize| (at + side - BORDER as usize) % side;
    let columns: Vec<usize> = (0..width + 2).map(|at| repeated(at, width)).collect();
    (0..height + 2)
        .flat_map(|at| {
            let row = &level.texels[repeated(at, height) * width..][..width];
            columns.iter().map(|&column| row[column])
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn borders_repeat_the_opposite_sides() {
        let texel = |value: u8| [value, 0, 0, 255];
        let level = scene::TextureLevel {
            width: 3,
            height: 1,
            texels: [1, 2, 3].map(texel).to_vec(),
        };
        let row = [3, 1, 2, 3, 1].map(texel);
        assert_eq!(with_border(&level), [row, row, row].concat());
    }

    #[test]
    fn whole_repeats_are_taken_off() {
        let corners = [[1000.25, -3.5], [1001.0, -3.0], [999.0, -4.0]].map(DVec2::from);
        let expected = [[0.5, 0.5], [2.0, 1.0], [-2.0, 0.0]].map(DVec2::from);
        assert_eq!(in_repeats(&corners, DVec2::new(2.0, 1.0)), expected);
    }
}
