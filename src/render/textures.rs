//! Textures of diffuse surfaces on the device: all levels of all textures in one image, so that devices with few descriptors
//! have them, too.

use crate::error::Result;
use crate::gpu::{Buffer, Colour, Context, Image, Sampling, Staging, Texel};
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::{TextureLevel, TexturedTriangle};
use crate::render::receivers::light_maps::pack_tiles;
use crate::scene::{self, Scene};
use crate::srgb::decode;
use glam::{DVec2, UVec2};
use half::f16;
use std::sync::{Arc, LazyLock};

/// Texels around a level, which repeat those on its other side, so that filtering finds them.
const BORDER: u32 = 1;

pub struct DeviceTextures {
    /// Linear colours of all levels, with their borders.
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
    /// [`crate::Error::Usage`] where the textures do not fit into an image, [`crate::Error::Device`] if device memory is
    /// insufficient.
    pub fn new(context: &Arc<Context>, staging: &mut Staging, scene: &Scene) -> Result<Self> {
        let is_present = (scene.objects.iter()).any(|object| map_of(scene, object).is_some());
        let textures = if is_present { &scene.textures[..] } else { &[] };
        let levels: Vec<_> = textures.iter().flat_map(|of| &of.levels).collect();
        let sizes: Vec<_> = (levels.iter())
            .map(|level| [level.width, level.height].map(|side| side + 2 * BORDER))
            .collect();
        let (origins, size) = pack_tiles(&sizes, context.max_image_side(), "albedo maps")?;
        let (sampling, texel) = (Sampling::Clamp, Texel::Colour);
        let image = Image::of_texels(context, "textures", size, 1, sampling, texel)?;
        staging.prepare(&image);
        let mut table = Vec::new();
        for ((level, origin), size) in levels.iter().zip(origins).zip(sizes) {
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
                .map(|of| of.geometry.triangle_count())
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
        let mut triangles = vec![TexturedTriangle::default(); store.len()];
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
    let has_coordinates = object.uvs.is_some() || object.geometry.placement().is_none();
    (material.albedo_map).filter(|_| !material.kind.is_specular() && has_coordinates)
}

/// Texture coordinates in repeats of the image. Whole repeats are taken off, since f32 has few digits.
fn in_repeats(corners: &[DVec2; 3], uv_scale: DVec2) -> [DVec2; 3] {
    let corners = corners.map(|uv| uv * uv_scale);
    let whole = corners[0].floor();
    corners.map(|uv| uv - whole)
}

/// Linear values of sRGB bytes. Their steps are at least twelve times as wide as those of f16.
static LINEAR: LazyLock<[f16; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| f16::from_f64(decode(byte as u8))));

/// Colours of a level and its border, row by row.
fn with_border(level: &scene::TextureLevel) -> Vec<Colour> {
    let [width, height] = [level.width, level.height].map(|side| side as usize);
    let around = |side: usize| [side - 1].into_iter().chain(0..side).chain([0]);
    around(height)
        .flat_map(|row| around(width).map(move |column| row * width + column))
        .map(|texel| level.texels[texel].map(|byte| LINEAR[usize::from(byte)]))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn colours_are_close() {
        for byte in 0..=255u8 {
            let step = decode(byte.saturating_add(1)) - decode(byte.saturating_sub(1));
            let linear = f64::from(LINEAR[usize::from(byte)]);
            assert!(
                (linear - decode(byte)).abs() < step / 24.0,
                "{byte} {linear}"
            );
        }
    }

    #[test]
    fn borders_repeat_the_other_side() {
        let texels = (0..6).map(|byte| [byte; 4]).collect();
        let level = scene::TextureLevel {
            width: 3,
            height: 2,
            texels,
        };
        let found: Vec<_> = with_border(&level).iter().map(|rgba| rgba[0]).collect();
        let expected = [5, 3, 4, 5, 3, 2, 0, 1, 2, 0, 5, 3, 4, 5, 3, 2, 0, 1, 2, 0];
        assert_eq!(found, expected.map(|byte: usize| LINEAR[byte]));
    }

    #[test]
    fn whole_repeats_are_taken_off() {
        let corners = [[1000.25, -3.5], [1001.0, -3.0], [999.0, -4.0]].map(DVec2::from);
        let expected = [[0.5, 0.5], [2.0, 1.0], [-2.0, 0.0]].map(DVec2::from);
        assert_eq!(in_repeats(&corners, DVec2::new(2.0, 1.0)), expected);
    }
}
