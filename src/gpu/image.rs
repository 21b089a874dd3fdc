//! Images that own their memory and free it when dropped.

use super::memory::{Keeper, Owned, allocate};
use super::texel::Texel;
use super::{Context, device_error};
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
    pub(super) owned: Arc<Owned>,
}

impl Image {
    pub const FORMAT: vk::Format = Texel::Light.format();

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
                remedy: "ask for a smaller picture, light map, environment or albedo map, or \
                         choose another device"
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
