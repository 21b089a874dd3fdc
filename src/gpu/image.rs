//! Images that own their memory and free it when dropped.

use super::memory::{Keeper, Owned, allocate};
use super::{Access, Buffer, Context, Recorder, device_error};
use crate::error::{Error, Result};
use ash::vk;
use gpu_allocator::MemoryLocation;
use std::sync::Arc;

/// How a sampled image is filtered and continued beyond its edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sampling {
    /// Bilinear, clamped.
    Clamp,
    /// Trilinear, repeated in u, clamped in v: an equirectangular environment.
    Equirectangular,
    /// Unfiltered, clamped.
    Nearest,
}

/// What a texel is.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Texel {
    /// RGBA in f32: light.
    Light,
    /// RGBA in sRGB bytes, sampled as linear values: colours of surfaces.
    Colour,
    /// One u32, sampled without filtering.
    Number,
    /// Depth in f32, sampled without filtering.
    Depth,
}

impl Texel {
    fn format(self) -> vk::Format {
        match self {
            Self::Light => Image::FORMAT,
            Self::Colour => Image::COLOUR_FORMAT,
            Self::Number => Image::NUMBER_FORMAT,
            Self::Depth => Image::DEPTH_FORMAT,
        }
    }

    fn usage(self) -> vk::ImageUsageFlags {
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

/// A 2-D image in layout GENERAL, which every use shares: attachment, storage, sampled.
pub struct Image {
    pub(super) handle: vk::Image,
    /// All mip levels.
    pub(super) view: vk::ImageView,
    pub(super) sampler: vk::Sampler,
    pub width: u32,
    pub height: u32,
    levels: u32,
    aspect: vk::ImageAspectFlags,
    pub(super) texel: Texel,
    owned: Arc<Owned>,
}

/// Four f32 a texel.
const FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
pub(super) const TEXEL_BYTES: u64 = 16;
/// Bytes of an image that one submission copies to the host, or one row.
const BAND_BYTES: u64 = 64 << 20;

impl Image {
    pub const FORMAT: vk::Format = FORMAT;
    pub const COLOUR_FORMAT: vk::Format = vk::Format::R8G8B8A8_SRGB;
    pub const NUMBER_FORMAT: vk::Format = vk::Format::R32_UINT;
    pub const DEPTH_FORMAT: vk::Format = vk::Format::D32_SFLOAT;

    /// An RGBA32F image with undefined content and `levels` mip levels. [`super::Staging::prepare`] brings it into its layout.
    ///
    /// # Errors
    /// [`Error::Device`] where memory or the device's limit on sides is exceeded.
    ///
    /// # Panics
    /// Where a side is 0.
    pub fn new(
        context: &Arc<Context>,
        name: &str,
        size: [u32; 2],
        levels: u32,
        sampling: Sampling,
    ) -> Result<Self> {
        Self::of_texels(context, name, size, levels, sampling, Texel::Light)
    }

    /// The same with texels of another kind.
    ///
    /// # Errors, Panics
    /// As [`Image::new`].
    pub fn of_texels(
        context: &Arc<Context>,
        name: &str,
        [width, height]: [u32; 2],
        levels: u32,
        sampling: Sampling,
        texel: Texel,
    ) -> Result<Self> {
        assert!(width > 0 && height > 0, "{name} has no texels");
        let most = context.max_image_side();
        if width.max(height) > most {
            return Err(Error::Device {
                action: format!("making the image of {name}"),
                reason: format!(
                    "it has {width}×{height} texels and the device allows {most} a side"
                ),
                remedy: "ask for a smaller picture, light map or environment, or choose \
                         another device"
                    .into(),
            });
        }
        let mut usage = texel.usage();
        if levels == 1 && texel == Texel::Light {
            usage |= vk::ImageUsageFlags::COLOR_ATTACHMENT;
        }
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(texel.format())
            .extent(vk::Extent3D {
                width,
                height,
                depth: 1,
            })
            .mip_levels(levels)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(usage);
        let aspect = match texel {
            Texel::Depth => vk::ImageAspectFlags::DEPTH,
            _ => vk::ImageAspectFlags::COLOR,
        };
        let device = &context.device;
        // SAFETY: a valid device; `owned` destroys the image.
        let handle =
            unsafe { device.create_image(&info, None) }.map_err(device_error("making an image"))?;
        context.set_name(handle, name);
        let mut owned = Owned::new(context);
        owned.image = handle;
        let (filter, mipmap, repeat) = match sampling {
            Sampling::Clamp => (
                vk::Filter::LINEAR,
                vk::SamplerMipmapMode::NEAREST,
                vk::SamplerAddressMode::CLAMP_TO_EDGE,
            ),
            Sampling::Equirectangular => (
                vk::Filter::LINEAR,
                vk::SamplerMipmapMode::LINEAR,
                vk::SamplerAddressMode::REPEAT,
            ),
            Sampling::Nearest => (
                vk::Filter::NEAREST,
                vk::SamplerMipmapMode::NEAREST,
                vk::SamplerAddressMode::CLAMP_TO_EDGE,
            ),
        };
        let view = vk::ImageViewCreateInfo::default()
            .image(handle)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(texel.format())
            .subresource_range(range(aspect, levels));
        let sampler = vk::SamplerCreateInfo::default()
            .mag_filter(filter)
            .min_filter(filter)
            .mipmap_mode(mipmap)
            .address_mode_u(repeat)
            .address_mode_v(vk::SamplerAddressMode::CLAMP_TO_EDGE)
            .max_lod(vk::LOD_CLAMP_NONE);
        // SAFETY: an image of this device, bound once to memory made for it.
        unsafe {
            let requirements = device.get_image_memory_requirements(handle);
            let allocation = allocate(context, name, requirements, MemoryLocation::GpuOnly, false)?;
            let (memory, offset) = (allocation.memory(), allocation.offset());
            owned.allocation = Some(allocation);
            device
                .bind_image_memory(handle, memory, offset)
                .map_err(device_error("binding an image"))?;
            owned.view = device
                .create_image_view(&view, None)
                .map_err(device_error("making a view"))?;
            owned.sampler = device
                .create_sampler(&sampler, None)
                .map_err(device_error("making a sampler"))?;
        }
        Ok(Self {
            handle,
            view: owned.view,
            sampler: owned.sampler,
            width,
            height,
            levels,
            aspect,
            texel,
            owned: Arc::new(owned),
        })
    }

    pub(super) fn range(&self) -> vk::ImageSubresourceRange {
        range(self.aspect, self.levels)
    }

    /// For hosts that sample it.
    pub fn raw(&self) -> (vk::Image, vk::ImageView) {
        (self.handle, self.view)
    }

    /// Bytes of device memory.
    pub fn bytes(&self) -> u64 {
        self.owned.allocation.as_ref().map_or(0, |own| own.size())
    }

    pub(super) fn keeper(&self) -> Keeper {
        self.owned.clone()
    }

    /// Copies a rectangle of level 0 to the host, RGBA, rows from the top. Waits for the device.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    ///
    /// # Panics
    /// Where the rectangle is empty or reaches beyond the image.
    pub fn read(&self, offset: [u32; 2], extent: [u32; 2]) -> Result<Vec<[f32; 4]>> {
        let size = [self.width, self.height];
        let inside = |axis: usize| {
            extent[axis] > 0
                && (offset[axis].checked_add(extent[axis])).is_some_and(|end| end <= size[axis])
        };
        assert!(
            inside(0) && inside(1),
            "{extent:?} texels at {offset:?} are read from an image of {size:?}"
        );
        let row_bytes = u64::from(extent[0]) * TEXEL_BYTES;
        // No submission runs long, and the host's part of the memory stays small.
        let rows = ((BAND_BYTES / row_bytes) as u32).clamp(1, extent[1]);
        let context = &self.owned.context;
        let mut host = Buffer::readback(context, row_bytes * u64::from(rows))?;
        let mut recorder = Recorder::new(context)?;
        let mut texels = Vec::with_capacity(extent[0] as usize * extent[1] as usize);
        for first in (0..extent[1]).step_by(rows as usize) {
            let band = [extent[0], rows.min(extent[1] - first)];
            recorder.barrier(Access::ANY_WRITE, Access::TRANSFER_READ);
            let region = image_copy(0, [offset[0], offset[1] + first], band);
            recorder.copy_from_image(self.handle, host.handle, region);
            recorder.barrier(Access::TRANSFER_WRITE, Access::HOST_READ);
            recorder.submit()?;
            let bytes = row_bytes as usize * band[1] as usize;
            texels.extend(bytemuck::pod_collect_to_vec::<u8, [f32; 4]>(
                &host.mapped()[..bytes],
            ));
        }
        Ok(texels)
    }
}

fn range(aspect: vk::ImageAspectFlags, levels: u32) -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange::default()
        .aspect_mask(aspect)
        .level_count(levels)
        .layer_count(1)
}

pub(super) fn image_copy(
    level: u32,
    [x, y]: [u32; 2],
    [width, height]: [u32; 2],
) -> vk::BufferImageCopy {
    vk::BufferImageCopy::default()
        .image_subresource(
            vk::ImageSubresourceLayers::default()
                .aspect_mask(vk::ImageAspectFlags::COLOR)
                .mip_level(level)
                .layer_count(1),
        )
        .image_offset(vk::Offset3D {
            x: x as i32,
            y: y as i32,
            z: 0,
        })
        .image_extent(vk::Extent3D {
            width,
            height,
            depth: 1,
        })
}
