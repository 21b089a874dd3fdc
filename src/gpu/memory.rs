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
        // SAFETY: whoever records it waits until the device has done with it, a host by its promise in
        // `Context::from_raw`; null handles are allowed.
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

    /// A buffer with `data` in it. Waits for the device.
    ///
    /// # Errors
    /// As [`Buffer::new`].
    pub fn with_data<T: Pod>(context: &Arc<Context>, name: &str, data: &[T]) -> Result<Self> {
        let buffer = Self::new(context, name, size_of_val(data) as u64)?;
        let mut staging = Staging::new(context, 1);
        staging.write(&buffer, 0, data)?;
        let mut recorder = Recorder::new(context)?;
        staging.record(&mut recorder);
        recorder.barrier(Access::TRANSFER_WRITE, Access::ANY_READ);
        recorder.submit()?;
        Ok(buffer)
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
        let region = vk::BufferCopy::default().size(bytes);
        recorder.copy_buffer(self.handle, host.handle, region);
        recorder.barrier(Access::TRANSFER_WRITE, Access::HOST_READ);
        recorder.submit()?;
        Ok(bytemuck::pod_collect_to_vec(
            &host.mapped()[..bytes as usize],
        ))
    }
}

/// A copy that the next recording does.
enum Copy {
    ToBuffer {
        from: vk::Buffer,
        to: vk::Buffer,
        region: vk::BufferCopy,
    },
    ToImage {
        from: vk::Buffer,
        to: vk::Image,
        region: vk::BufferImageCopy,
    },
    /// Later copies overwrite what earlier ones wrote.
    Barrier,
}

/// Host memory by way of which buffers and images are filled. It has a slot for each frame in flight, since the
/// device may still read what earlier frames wrote.
pub struct Staging {
    context: Arc<Context>,
    /// By slot, buffers of which the last one is being filled.
    slots: Vec<Vec<Buffer>>,
    current: usize,
    /// Bytes in use of the current slot's last buffer.
    used: u64,
    /// Whether the current slot's copies have been recorded, so that the next write takes the next slot.
    is_recorded: bool,
    /// Recordings since the last copy.
    idle: usize,
    copies: Vec<Copy>,
    /// Images without a layout.
    new_images: Vec<(vk::Image, vk::ImageSubresourceRange)>,
}

impl Staging {
    /// Bytes of the smallest buffer.
    const LEAST: u64 = 1 << 16;
    /// Of offsets: a texel.
    const ALIGNMENT: u64 = TEXEL_BYTES;

    /// For at most `frames` frames in flight.
    pub fn new(context: &Arc<Context>, frames: u32) -> Self {
        Self {
            context: context.clone(),
            slots: (0..frames.max(1)).map(|_| Vec::new()).collect(),
            current: 0,
            used: 0,
            is_recorded: false,
            idle: 0,
            copies: Vec::new(),
            new_images: Vec::new(),
        }
    }

    /// Begins writes that may overwrite earlier ones, which were not recorded yet.
    pub fn begin(&mut self) {
        if !self.copies.is_empty() {
            self.copies.push(Copy::Barrier);
        }
    }

    /// Writes `data` to a buffer from element `first` on.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    ///
    /// # Panics
    /// Where the write reaches beyond the buffer.
    pub fn write<T: Pod>(&mut self, to: &Buffer, first: usize, data: &[T]) -> Result<()> {
        let bytes: &[u8] = bytemuck::cast_slice(data);
        let offset = (first * size_of::<T>()) as u64;
        assert!(offset + bytes.len() as u64 <= to.bytes);
        if bytes.is_empty() {
            return Ok(());
        }
        let (from, start) = self.place(bytes.len() as u64)?;
        self.fill(start, bytes);
        self.copies.push(Copy::ToBuffer {
            from,
            to: to.handle,
            region: vk::BufferCopy {
                src_offset: start,
                dst_offset: offset,
                size: bytes.len() as u64,
            },
        });
        Ok(())
    }

    /// Writes a mip level of an image, RGB.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    ///
    /// # Panics
    /// Where the level has another number of texels.
    pub fn write_level(&mut self, to: &Image, level: u32, rgb: &[[f32; 3]]) -> Result<()> {
        let [width, height] = [to.width, to.height].map(|side| (side >> level).max(1));
        assert_eq!(rgb.len() as u64, u64::from(width) * u64::from(height));
        let (from, start) = self.place(rgb.len() as u64 * TEXEL_BYTES)?;
        let texels: Vec<[f32; 4]> = rgb.iter().map(|&[r, g, b]| [r, g, b, 0.0]).collect();
        self.fill(start, bytemuck::cast_slice(&texels));
        self.copies.push(Copy::ToImage {
            from,
            to: to.handle,
            region: image_copy(level, [0, 0], [width, height]).buffer_offset(start),
        });
        Ok(())
    }

    /// Has the next recording bring a new image into its layout.
    pub fn prepare(&mut self, image: &Image) {
        self.new_images.push((image.handle, image.range()));
    }

    /// Where so many bytes go.
    fn place(&mut self, bytes: u64) -> Result<(vk::Buffer, u64)> {
        if std::mem::take(&mut self.is_recorded) {
            self.current = (self.current + 1) % self.slots.len();
            let slot = &mut self.slots[self.current];
            // The last one is the largest, and soon large enough for all.
            slot.drain(..slot.len().saturating_sub(1));
            self.used = 0;
        }
        let slot = &mut self.slots[self.current];
        let start = self.used.next_multiple_of(Self::ALIGNMENT);
        if slot.last().is_none_or(|last| start + bytes > last.bytes()) {
            let last = slot.last().map_or(0, Buffer::bytes);
            let size = bytes.max(2 * last).max(Self::LEAST);
            let location = MemoryLocation::CpuToGpu;
            slot.push(Buffer::allocate(&self.context, "staging", size, location)?);
            self.used = bytes;
            return Ok((slot[slot.len() - 1].handle, 0));
        }
        self.used = start + bytes;
        Ok((slot[slot.len() - 1].handle, start))
    }

    fn fill(&mut self, start: u64, bytes: &[u8]) {
        let buffer = self.slots[self.current].last_mut().expect("just placed");
        buffer.mapped()[start as usize..][..bytes.len()].copy_from_slice(bytes);
    }

    /// Records the copies. The caller has them wait for whoever used the targets before, and makes them visible.
    pub fn record(&mut self, recorder: &mut Recorder) {
        self.idle = if self.copies.is_empty() {
            self.idle + 1
        } else {
            0
        };
        if self.idle == self.slots.len() {
            // What stands still needs none of the memory.
            self.slots.iter_mut().for_each(Vec::clear);
        }
        for (image, range) in self.new_images.drain(..) {
            recorder.begin_general(image, range);
        }
        for copy in self.copies.drain(..) {
            match copy {
                Copy::ToBuffer { from, to, region } => recorder.copy_buffer(from, to, region),
                Copy::ToImage { from, to, region } => recorder.copy_to_image(from, to, region),
                Copy::Barrier => {
                    recorder.barrier(Access::TRANSFER_WRITE, Access::TRANSFER_WRITE);
                }
            }
        }
        self.is_recorded = true;
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
    levels: u32,
    owned: Arc<Owned>,
}

/// Four f32 a texel.
const FORMAT: vk::Format = vk::Format::R32G32B32A32_SFLOAT;
const TEXEL_BYTES: u64 = 16;
/// Bytes of an image that one submission copies to the host, or one row.
const BAND_BYTES: u64 = 64 << 20;

impl Image {
    pub const FORMAT: vk::Format = FORMAT;

    /// An image with undefined content and `levels` mip levels. [`Staging::prepare`] brings it into its layout.
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
        Ok(Self {
            handle,
            view: owned.view,
            sampler: owned.sampler,
            width,
            height,
            levels,
            owned: Arc::new(owned),
        })
    }

    fn range(&self) -> vk::ImageSubresourceRange {
        vk::ImageSubresourceRange::default()
            .aspect_mask(vk::ImageAspectFlags::COLOR)
            .level_count(self.levels)
            .layer_count(1)
    }

    /// For hosts that sample it.
    pub fn raw(&self) -> (vk::Image, vk::ImageView) {
        (self.handle, self.view)
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

fn image_copy(level: u32, [x, y]: [u32; 2], [width, height]: [u32; 2]) -> vk::BufferImageCopy {
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
