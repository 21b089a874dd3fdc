//! Everything that lives as long as the open device: queue, memory allocator, pipelines, messages.

use super::device::{self, ContextOptions, Device, DeviceInfo, Opened};
use super::host::{self, External};
use super::instance::Instance;
use super::modules::Modules;
use super::pipeline_cache::PipelineCache;
use super::pipelines::Pipelines;
use super::requirements::Requirements;
use super::texel;
use super::validation::Messages;
use crate::error::{Error, Result};
use ash::{ext, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use std::sync::{Arc, Mutex};

/// The open device. Everything made from it keeps it alive.
pub struct Context {
    // Dropped in this order.
    pub(super) pipelines: Mutex<Pipelines>,
    pub(super) pipeline_cache: PipelineCache,
    pub(super) modules: Modules,
    pub(super) allocator: Arc<Mutex<Allocator>>,
    pub(super) device: Device,
    instance: Instance,
    /// Locked by whoever submits: Vulkan lets one thread at a time use a queue. None on a host's device, which
    /// submits itself.
    pub(super) queue: Option<Mutex<vk::Queue>>,
    pub(super) queue_family: u32,
    pub(super) debug: Option<ext::debug_utils::Device>,
    /// Valid bits of a timestamp; 0 where the queue has none.
    pub(super) timestamp_bits: u32,
    pub(super) properties: vk::PhysicalDeviceProperties,
    info: DeviceInfo,
}

impl Context {
    /// Opens the device that `options` ask for.
    ///
    /// # Errors
    /// [`Error::NoDevice`] where the loader, the layers or a suitable device is missing,
    /// [`Error::Device`] where a call fails.
    pub fn new(options: &ContextOptions) -> Result<Arc<Self>> {
        let instance = Instance::new(options.validate)?;
        let opened = device::open(&instance, options)?;
        // SAFETY: `device::open` made one queue of this family.
        let queue = unsafe { opened.device.get_device_queue(opened.queue_family, 0) };
        Self::with_parts(instance, opened, Some(Mutex::new(queue)), None)
    }

    /// Uses the device of a host application, which records with [`crate::render::Renderer::record`] and submits
    /// itself.
    ///
    /// # Errors
    /// [`Error::Host`] where the device lacks what [`Context::requirements`] names.
    ///
    /// # Safety
    /// The handles are valid and belong together, `features` and `api_version` are those that instance and device were created
    /// with, and instance and device outlive the context and everything that was made with it. The context and what
    /// was made with it are dropped only when the device does no more work of theirs.
    pub unsafe fn from_raw(external: External) -> Result<Arc<Self>> {
        let (instance, opened, allocator) = host::adopt(external)?;
        Self::with_parts(instance, opened, None, allocator)
    }

    /// Requirements on a device, as data for hosts that create their own.
    pub fn requirements() -> Requirements {
        Requirements::default()
    }

    fn with_parts(
        instance: Instance,
        opened: Opened,
        queue: Option<Mutex<vk::Queue>>,
        allocator: Option<Arc<Mutex<Allocator>>>,
    ) -> Result<Arc<Self>> {
        let Opened {
            device,
            physical,
            info,
            queue_family,
            timestamp_bits,
            properties,
        } = opened;
        let allocator = match allocator {
            Some(of_host) => of_host,
            None => Allocator::new(&AllocatorCreateDesc {
                instance: instance.clone(),
                device: device.clone(),
                physical_device: physical,
                debug_settings: Default::default(),
                buffer_device_address: false,
                allocation_sizes: Default::default(),
            })
            .map(|allocator| Arc::new(Mutex::new(allocator)))
            .map_err(|e| Error::Device {
                action: "setting up the memory allocator".into(),
                reason: e.to_string(),
                remedy: "choose another device".into(),
            })?,
        };
        let debug =
            (instance.debug_utils).then(|| ext::debug_utils::Device::new(&instance, &device));
        let uuid = queue.is_some().then_some(properties.pipeline_cache_uuid);
        let mut modules = Modules::new(&device, device::has_texel_buffers(&properties.limits))?;
        let pipeline_cache =
            PipelineCache::new(&device, uuid).inspect_err(|_| modules.destroy(&device))?;
        Ok(Arc::new(Self {
            pipelines: Mutex::default(),
            modules,
            pipeline_cache,
            allocator,
            device,
            instance,
            queue,
            queue_family,
            debug,
            timestamp_bits,
            properties,
            info,
        }))
    }

    /// Whether the device is that of a host, who submits what is recorded.
    pub fn is_of_host(&self) -> bool {
        self.queue.is_none()
    }

    /// The device in use.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// Where the validation layers' messages go, to be read even after the context is gone.
    pub fn messages(&self) -> Arc<Messages> {
        self.instance.messages.clone()
    }

    /// Number of pipelines made so far. Bindings are apart from them: where a buffer grows, none is made.
    pub fn pipeline_count(&self) -> usize {
        self.pipelines
            .lock()
            .map_or(0, |pipelines| pipelines.count())
    }

    /// Largest buffer that a shader can see, as a storage buffer and as a texel buffer, bytes.
    pub fn max_storage_bytes(&self) -> u64 {
        let limits = &self.properties.limits;
        let storage = u64::from(limits.max_storage_buffer_range);
        match self.has_texel_buffers() {
            true => storage.min(u64::from(limits.max_texel_buffer_elements) * texel::BUFFER_BYTES),
            false => storage,
        }
    }

    /// Whether shaders read texel buffers, since the device has large ones, and not the storage buffers of `WITHOUT_TEXEL_BUFFERS`.
    pub fn has_texel_buffers(&self) -> bool {
        device::has_texel_buffers(&self.properties.limits)
    }

    /// Largest side of an image, texels. Light maps and pictures are drawn into, for which some
    /// devices (SwiftShader) allow less than for sampling.
    pub fn max_image_side(&self) -> u32 {
        let limits = &self.properties.limits;
        (limits.max_image_dimension2_d)
            .min(limits.max_framebuffer_width)
            .min(limits.max_framebuffer_height)
    }

    /// Names a Vulkan object for the layers and for debuggers.
    pub(super) fn set_name<H: vk::Handle>(&self, handle: H, name: &str) {
        if let Some(debug) = &self.debug {
            let name = std::ffi::CString::new(name).unwrap_or_default();
            let info = vk::DebugUtilsObjectNameInfoEXT::default()
                .object_handle(handle)
                .object_name(&name);
            // SAFETY: a live object of this device. A name that cannot be set is no failure.
            let _ = unsafe { debug.set_debug_utils_object_name(&info) };
        }
    }
}

impl Drop for Context {
    fn drop(&mut self) {
        if self.queue.is_some() {
            // SAFETY: every resource holds an Arc of the context, so nobody else uses the device.
            let _ = unsafe { self.device.device_wait_idle() };
        }
        if let Ok(pipelines) = self.pipelines.get_mut() {
            pipelines.destroy(&self.device);
        }
        self.modules.destroy(&self.device);
        self.pipeline_cache.destroy(&self.device);
    }
}
