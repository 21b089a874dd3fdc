//! Buffers and images that own their memory and free it when dropped.

use super::{Access, Context, Recorder, device_error};
use crate::error::{Error, Result};
use ash::vk;
use bytemuck::Pod;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use std::sync::Arc;

fn allocate(
    context: &Context,
    name: &str,
    requirements: vk::MemoryRequirements,
    location: MemoryLocation,
    linear: bool,
) -> Result<Allocation> {
    let description = AllocationCreateDesc {
        name,
        requirements,
        location,
        linear,
        allocation_scheme: AllocationScheme::GpuAllocatorManaged,
    };
    let mut allocator = context.allocator.lock().expect("no panic while held");
    allocator
        .allocate(&description)
        .map_err(|error| Error::Device {
            action: format!(
                "allocating {} MB for {name}",
                requirements.size.div_ceil(1_000_000)
            ),
            reason: error.to_string(),
            remedy: match name {
                "view" => "ask for a smaller picture".into(),
                _ => "ask for fewer samples or smaller light maps".into(),
            },
        })
}

/// Vulkan objects with the memory under them. Held by the [`Buffer`] or [`Image`] and by the
/// pipelines that it is bound to; the last of them frees it.
struct Owned {
    context: Arc<Context>,
    buffer: vk::Buffer,
    image: vk::Image,
    view: vk::ImageView,
    sampler: vk::Sampler,
    allocation: Option<Allocation>,
}

impl Owned {
    fn new(context: &Arc<Context>) -> Self {
        Self {
            context: context.clone(),
            buffer: vk::Buffer::null(),
            image: vk::Image::null(),
            view: vk::ImageView::null(),
            sampler: vk::Sampler::null(),
            allocation: None,
        }
    }
}

impl Drop for Owned {
    fn drop(&mut self) {
        let device = &self.context.device;
        // SAFETY: submissions are waited for, so the device uses none any more; null handles are
        // allowed.
        unsafe {
            device.destroy_buffer(self.buffer, None);
            device.destroy_sampler(self.sampler, None);
            device.destroy_image_view(self.view, None);
            device.destroy_image(self.image, None);
        }
        if let (Some(allocation), Ok(mut allocator)) =
            (self.allocation.take(), self.context.allocator.lock())
        {
            // A block that cannot be freed is lost until the allocator goes; Drop must not panic.
            let _ = allocator.free(allocation);
        }
    }
}

/// Keeps a buffer or image alive.
pub type Keeper = Arc<dyn Send + Sync>;

/// A storage, transfer and indirect buffer.
pub struct Buffer {
    pub(super) handle: vk::Buffer,
    bytes: u64,
    owned: Arc<Owned>,
}

impl Buffer {
    /// A buffer on the device, of at least 16 bytes.
    ///
    /// # Errors
    /// [`Error::Device`] where memory or the device's limit on storage buffers is exceeded.
    pub fn new(context: &Arc<Context>, name: &str, bytes: u64) -> Result<Self> {
        Self::allocate(context, name, bytes, MemoryLocation::GpuOnly)
    }

    /// A buffer with `data` in it.
    ///
    /// # Errors
    /// As [`Buffer::new`].
    pub fn with_data<T: Pod>(context: &Arc<Context>, name: &str, data: &[T]) -> Result<Self> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let buffer = Self::new(context, name, bytes.len() as u64)?;
        if bytes.is_empty() {
            return Ok(buffer);
        }
        let write = Write {
            to: &buffer,
            offset: 0,
            data: bytes,
        };
        Staging::new(context)?.write(&mut Recorder::new(context)?, &[write])?;
        Ok(buffer)
    }

    /// A buffer that the host has filled, to copy from.
    pub(super) fn staging(context: &Arc<Context>, bytes: &[u8]) -> Result<Self> {
        let mut staging = Self::allocate(
            context,
            "staging",
            bytes.len() as u64,
            MemoryLocation::CpuToGpu,
        )?;
        staging.mapped()[..bytes.len()].copy_from_slice(bytes);
        Ok(staging)
    }

    /// A buffer that the host can read after the device has written it.
    pub(super) fn readback(context: &Arc<Context>, bytes: u64) -> Result<Self> {
        Self::allocate(context, "readback", bytes, MemoryLocation::GpuToCpu)
    }

    fn allocate(
        context: &Arc<Context>,
        name: &str,
        bytes: u64,
        location: MemoryLocation,
    ) -> Result<Self> {
        let bytes = bytes.max(16);
        if location == MemoryLocation::GpuOnly && bytes > context.max_storage_bytes() {
            return Err(Error::Device {
                action: format!("making the buffer of {name}"),
                reason: format!(
                    "it needs {bytes} bytes and the device allows {} for one buffer",
                    context.max_storage_bytes()
                ),
                remedy: "use a coarser mesh or fewer samples".into(),
            });
        }
        let info = vk::BufferCreateInfo::default().size(bytes).usage(
            vk::BufferUsageFlags::STORAGE_BUFFER
                | vk::BufferUsageFlags::INDIRECT_BUFFER
                | vk::BufferUsageFlags::INDEX_BUFFER
                | vk::BufferUsageFlags::TRANSFER_SRC
                | vk::BufferUsageFlags::TRANSFER_DST,
        );
        // SAFETY: a valid device; `owned` destroys the buffer.
        let handle = unsafe { context.device.create_buffer(&info, None) }
            .map_err(device_error("making a buffer"))?;
        context.set_name(handle, name);
        let mut owned = Owned::new(context);
        owned.buffer = handle;
        // SAFETY: a buffer of this device, bound once to memory made for it.
        unsafe {
            let requirements = context.device.get_buffer_memory_requirements(handle);
            let allocation = allocate(context, name, requirements, location, true)?;
            let (memory, offset) = (allocation.memory(), allocation.offset());
            owned.allocation = Some(allocation);
            context
                .device
                .bind_buffer_memory(handle, memory, offset)
                .map_err(device_error("binding a buffer"))?;
        }
        Ok(Self {
            handle,
            bytes,
            owned: Arc::new(owned),
        })
    }

    /// Size in bytes.
    pub fn bytes(&self) -> u64 {
        self.bytes
    }

    pub(super) fn mapped(&mut self) -> &mut [u8] {
        let owned = Arc::get_mut(&mut self.owned).expect("mapped buffers are never bound");
        let allocation = owned.allocation.as_mut();
        (allocation.expect("allocated in `allocate`"))
            .mapped_slice_mut()
            .expect("only host-visible buffers are mapped")
    }

    pub(super) fn keeper(&self) -> Keeper {
        self.owned.clone()
    }

    /// Copies the buffer's first `count` elements to the host. Waits for the device.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    ///
    /// # Panics
    /// Where the buffer holds fewer.
    pub fn read<T: Pod>(&self, count: usize) -> Result<Vec<T>> {
        let bytes = (count as u64)
            .checked_mul(size_of::<T>() as u64)
            .filter(|bytes| *bytes <= self.bytes)
            .unwrap_or_else(|| {
                let element = size_of::<T>();
                let bytes = self.bytes;
                panic!("{count} elements of {element} bytes are read from a buffer of {bytes}")
            });
        let context = &self.owned.context;
        let mut host = Self::readback(context, bytes)?;
        let mut recorder = Recorder::new(context)?;
        recorder.barrier(Access::ANY_WRITE, Access::TRANSFER_READ);
        recorder.copy_buffer(self, &host, [0, 0], bytes);
        recorder.barrier(Access::TRANSFER_WRITE, Access::HOST_READ);
        recorder.submit()?;
        Ok(bytemuck::pod_collect_to_vec(
            &host.mapped()[..bytes as usize],
        ))
    }
}

/// Bytes for a place in a buffer.
pub struct Write<'a> {
    pub to: &'a Buffer,
    /// bytes
    pub offset: u64,
    pub data: &'a [u8],
}

impl<'a> Write<'a> {
    /// `data` from element `first` of the buffer on.
    pub fn new<T: Pod>(to: &'a Buffer, first: usize, data: &'a [T]) -> Self {
        Self {
            to,
            offset: (first * size_of::<T>()) as u64,
            data: bytemuck::cast_slice(data),
        }
    }
}

/// Host memory by way of which buffers are written, again and again.
pub struct Staging {
    context: Arc<Context>,
    buffer: Buffer,
}

impl Staging {
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn new(context: &Arc<Context>) -> Result<Self> {
        Ok(Self {
            context: context.clone(),
            buffer: Buffer::staging(context, &[])?,
        })
    }

    /// Does all of `writes` in one submission of `recorder`, and waits for it.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    ///
    /// # Panics
    /// Where a write reaches beyond its buffer.
    pub fn write(&mut self, recorder: &mut Recorder, writes: &[Write]) -> Result<()> {
        let bytes = writes.iter().map(|write| write.data.len() as u64).sum();
        if bytes > self.buffer.bytes {
            self.buffer =
                Buffer::allocate(&self.context, "staging", bytes, MemoryLocation::CpuToGpu)?;
        }
        let mut start = 0;
        for write in writes {
            let end = start + write.data.len();
            assert!(write.offset + (end - start) as u64 <= write.to.bytes);
            self.buffer.mapped()[start..end].copy_from_slice(write.data);
            start = end;
        }
        recorder.pass("upload", |r| {
            let mut start = 0;
            for write in writes.iter().filter(|write| !write.data.is_empty()) {
                let bytes = write.data.len() as u64;
                r.copy_buffer(&self.buffer, write.to, [start, write.offset], bytes);
                start += bytes;
            }
            // Earlier readers have been waited for.
            r.barrier(Access::TRANSFER_WRITE, Access::ANY_READ);
        })?;
        recorder.submit()
    }
}

/// How a sampled image is filtered and continued beyond its edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Sampling {
    /// Bilinear, clamped.
    Clamp,
    /// Trilinear, repeated in u, clamped in v: an equirectangular environment.
    Equirectangular,
}

/// A 2-D RGBA32F image in layout GENERAL, which every use shares: attachment, storage, sampled.
pub struct Image {
    pub(super) handle: vk::Image,
    /// All mip levels.
    pub(super) view: vk::ImageView,
    pub(super) sampler: vk::Sampler,
    pub width: u32,
    pub height: u32,
    owned: Arc<Owned>,
}

/// Four f32 a texel.
const FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
const TEXEL_BYTES: u64 = 16;
/// Bytes of an image that one submission copies to the host, or one row.
const BAND_BYTES: u64 = 64 << 20;

impl Image {
    pub const FORMAT: vk::Format = FORMAT;

    /// An image with undefined content and `levels` mip levels.
    ///
    /// # Errors
    /// [`Error::Device`] where memory or the device's limit on sides is exceeded.
    ///
    /// # Panics
    /// Where a side is 0.
    pub fn new(
        context: &Arc<Context>,
        name: &str,
        [width, height]: [u32; 2],
        levels: u32,
        sampling: Sampling,
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
        let mut usage = vk::ImageUsageFlags::STORAGE
            | vk::ImageUsageFlags::SAMPLED
            | vk::ImageUsageFlags::TRANSFER_SRC
            | vk::ImageUsageFlags::TRANSFER_DST;
        if levels == 1 {
            usage |= vk::ImageUsageFlags::COLOR_ATTACHMENT;
        }
        let info = vk::ImageCreateInfo::default()
            .image_type(vk::ImageType::TYPE_2D)
            .format(FORMAT)
            .extent(vk::Extent3D {
                width,
                height,
                depth: 1,
            })
            .mip_levels(levels)
            .array_layers(1)
            .samples(vk::SampleCountFlags::TYPE_1)
            .usage(usage);
        let device = &context.device;
        // SAFETY: a valid device; `owned` destroys the image.
        let handle =
            unsafe { device.create_image(&info, None) }.map_err(device_error("making an image"))?;
        context.set_name(handle, name);
        let mut owned = Owned::new(context);
        owned.image = handle;
        let range = vk::ImageSubresourceRange::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR)
            .level_count(levels)
            .layer_count(1);
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
        };
        let view = vk::ImageViewCreateInfo::default()
            .image(handle)
            .view_type(vk::ImageViewType::TYPE_2D)
            .format(FORMAT)
            .subresource_range(range);
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
        let mut recorder = Recorder::new(context)?;
        recorder.begin_general(handle, range);
        recorder.submit()?;
        Ok(Self {
            handle,
            view: owned.view,
            sampler: owned.sampler,
            width,
            height,
            owned: Arc::new(owned),
        })
    }

    /// An image with the mip levels `levels`, RGB each, filled.
    ///
    /// # Errors, Panics
    /// As [`Image::new`]; where a level has not as many texels as it should.
    pub fn with_levels(
        context: &Arc<Context>,
        name: &str,
        levels: &[(u32, u32, Vec<[f32; 3]>)],
        sampling: Sampling,
    ) -> Result<Self> {
        let (width, height, _) = levels[0];
        let image = Self::new(
            context,
            name,
            [width, height],
            levels.len() as u32,
            sampling,
        )?;
        image.write_levels(&mut Recorder::new(context)?, levels)?;
        Ok(image)
    }

    /// Fills the mip levels with `levels`, RGB each, and waits for it.
    ///
    /// # Errors, Panics
    /// As [`Image::with_levels`].
    pub fn write_levels(
        &self,
        recorder: &mut Recorder,
        levels: &[(u32, u32, Vec<[f32; 3]>)],
    ) -> Result<()> {
        let context = &self.owned.context;
        let mut staging = Vec::new();
        for (level, (width, height, pixels)) in levels.iter().enumerate() {
            let side = |side: u32| (side >> level).max(1);
            assert_eq!([*width, *height], [side(self.width), side(self.height)]);
            assert_eq!(pixels.len() as u64, u64::from(*width) * u64::from(*height));
            let texels: Vec<[f32; 4]> = pixels.iter().map(|&[r, g, b]| [r, g, b, 0.0]).collect();
            let buffer = Buffer::staging(context, bytemuck::cast_slice(&texels))?;
            recorder.copy_to_image(&buffer, self, level as u32, [*width, *height]);
            staging.push(buffer);
        }
        recorder.barrier(Access::TRANSFER_WRITE, Access::ANY_READ);
        recorder.submit()
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
            recorder.copy_from_image(self, [offset[0], offset[1] + first], band, &host);
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
