//! What texels of images and buffers are: formats and sizes.

use ash::vk;

/// What a texel is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Texel {
    /// RGBA in f32: light.
    Light,
    /// RGBA in f16, sampled only: linear colours.
    Colour,
    /// One u32, sampled without filtering.
    Number,
    /// Depth in f32, sampled without filtering.
    Depth,
}

impl Texel {
    pub(super) const fn format(self) -> vk::Format {
        match self {
            Self::Light => vk::Format::R32G32B32A32_SFLOAT,
            Self::Colour => vk::Format::R16G16B16A16_SFLOAT,
            Self::Number => vk::Format::R32_UINT,
            Self::Depth => vk::Format::D32_SFLOAT,
        }
    }

    pub(super) fn usage(self) -> vk::ImageUsageFlags {
        use vk::ImageUsageFlags as Usage;
        match self {
            Self::Light => {
                Usage::STORAGE | Usage::SAMPLED | Usage::TRANSFER_SRC | Usage::TRANSFER_DST
            }
            Self::Colour => Usage::SAMPLED | Usage::TRANSFER_DST,
            Self::Number => Usage::COLOR_ATTACHMENT | Usage::SAMPLED,
            Self::Depth => Usage::DEPTH_STENCIL_ATTACHMENT | Usage::SAMPLED,
        }
    }
}

/// A texel of [`Texel::Colour`].
pub type Colour = [half::f16; 4];

/// Bytes of a texel of [`Texel::Light`]: four f32.
pub const LIGHT_BYTES: u64 = 16;

/// Format and size of a texel where shaders see a buffer as a texel buffer. Every device supports it.
pub const BUFFER_FORMAT: vk::Format = vk::Format::R32G32B32A32_UINT;
pub const BUFFER_BYTES: u64 = 16;
