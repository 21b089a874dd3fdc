//! Textures of diffuse surfaces on the device: all levels of all textures in one buffer, so that devices with few descriptors
//! have them, too.

use crate::error::{Error, Result};
use crate::gpu::{Buffer, Context, Staging};
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::constants::ROOT_BITS;
use crate::render::gpu_types::{TextureLevel, TexturedTriangle};
use crate::scene::{self, Scene};
use crate::srgb::decode;
use glam::{DVec2, UVec2};
use std::sync::{Arc, LazyLock};

pub struct DeviceTextures {
    /// See [`packed`].
    pub texels: Buffer,
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
        let texel_count: u64 = levels.iter().map(|of| of.texels.len() as u64).sum();
        let bytes = 4 * texel_count.max(1);
        if bytes > context.max_storage_bytes() {
            return Err(Error::Usage {
                reason: format!(
                    "the albedo maps with their mipmaps take {bytes} bytes, and the device allows {}",
                    context.max_storage_bytes()
                ),
                remedy: "scale the images down, or choose another device".into(),
            });
        }
        let texels = Buffer::new(context, "textures", bytes)?;
        let mut table = Vec::new();
        let mut first = 0;
        for level in levels {
            let packed: Vec<u32> = level.texels.iter().map(|&texel| packed(texel)).collect();
            staging.write(&texels, first as usize, &packed)?;
            table.push(TextureLevel {
                first,
                size: UVec2::new(level.width, level.height),
                ..Default::default()
            });
            first += packed.len() as u32;
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
            texels,
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
        self.texels.bytes() + self.levels.bytes() + self.triangles.bytes()
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

/// Roots of the linear values of sRGB bytes, 0..=1.
static ROOTS: LazyLock<[f64; 256]> =
    LazyLock::new(|| std::array::from_fn(|byte| decode(byte as u8).sqrt()));

/// The roots of the linear red, green and blue, in 11, 11 and 10 bits: finer than the bytes, and fast to decode.
fn packed([red, green, blue, _]: [u8; 4]) -> u32 {
    let root = |byte: u8, bits: u32| {
        let most = f64::from((1 << bits) - 1);
        (most * ROOTS[usize::from(byte)]).round() as u32
    };
    root(red, ROOT_BITS)
        | root(green, ROOT_BITS) << ROOT_BITS
        | root(blue, u32::BITS - 2 * ROOT_BITS) << (2 * ROOT_BITS)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Linear values are less than a third of a step of the sRGB bytes off.
    #[test]
    fn packed_colours_are_close() {
        for byte in 0..=255u8 {
            let texel = packed([byte, byte, byte, 255]);
            let step = decode(byte.saturating_add(1)) - decode(byte.saturating_sub(1));
            for (bits, most) in [(texel & 0x7ff, 2047.0), (texel >> 22, 1023.0)] {
                let linear = (f64::from(bits) / most).powi(2);
                assert!(
                    (linear - decode(byte)).abs() < step / 3.0,
                    "{byte} {linear}"
                );
            }
        }
        assert_eq!(packed([255; 4]), u32::MAX);
    }

    #[test]
    fn whole_repeats_are_taken_off() {
        let corners = [[1000.25, -3.5], [1001.0, -3.0], [999.0, -4.0]].map(DVec2::from);
        let expected = [[0.5, 0.5], [2.0, 1.0], [-2.0, 0.0]].map(DVec2::from);
        assert_eq!(in_repeats(&corners, DVec2::new(2.0, 1.0)), expected);
    }
}
