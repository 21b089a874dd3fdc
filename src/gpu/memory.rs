//! Buffers that own their memory and free it when dropped.

use super::{Context, device_error};
use crate::error::{Error, Result};
use ash::vk;
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{Allocation, AllocationCreateDesc, AllocationScheme};
use std::sync::Arc;
use std::sync::atomic::{AtomicU64, Ordering};

pub(super) fn allocate(
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
                "view" | "view depth" | "view samples" | "view samples' depth" => {
                    "ask for a smaller picture".into()
                }
                _ => "ask for fewer samples or smaller light maps".into(),
            },
        })
}

/// Vulkan objects with the memory under them. Held by the [`Buffer`] or [`super::Image`] and by the
/// pipelines that it is bound to; the last of them frees it.
pub(super) struct Owned {
    pub(super) context: Arc<Context>,
    /// No other object of the program has it.
    pub(super) number: u64,
    pub(super) buffer: vk::Buffer,
    pub(super) image: vk::Image,
    pub(super) view: vk::ImageView,
    pub(super) sampler: vk::Sampler,
    pub(super) allocation: Option<Allocation>,
}

impl Owned {
    pub fn new(context: &Arc<Context>) -> Self {
        Self {
            context: context.clone(),
            number: next_number(),
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

/// A number for an object, which none has had before.
pub(super) fn next_number() -> u64 {
    static LAST: AtomicU64 = AtomicU64::new(0);
    LAST.fetch_add(1, Ordering::Relaxed)
}

/// Keeps a buffer or image alive.
pub type Keeper = Arc<dyn Send + Sync>;

/// A buffer for storage, texels, indices, indirect commands and transfers.
pub struct Buffer {
    pub(super) handle: vk::Buffer,
    pub(super) bytes: u64,
    pub(super) owned: Arc<Owned>,
}

impl Buffer {
    /// A buffer on the device, of at least 16 bytes.
    ///
    /// # Errors
    /// [`Error::Device`] where memory or the device's limit on storage buffers is exceeded.
    pub fn new(context: &Arc<Context>, name: &str, bytes: u64) -> Result<Self> {
        Self::allocate(context, name, bytes, MemoryLocation::GpuOnly)
    }

    /// A buffer that the host can read after the device has written it.
    pub(super) fn readback(context: &Arc<Context>, bytes: u64) -> Result<Self> {
        Self::allocate(context, "readback", bytes, MemoryLocation::GpuToCpu)
    }

    pub(super) fn allocate(
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
                remedy: "use coarser meshes, smaller light maps or fewer samples".into(),
            });
        }
        let info = vk::BufferCreateInfo::default().size(bytes).usage(
            vk::BufferUsageFlags::STORAGE_BUFFER
                | vk::BufferUsageFlags::UNIFORM_TEXEL_BUFFER
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
}
