//! Everything that lives as long as the open device: queue, memory allocator, messages.

use super::device::{self, Device, DeviceInfo, Opened};
use super::instance::Instance;
use super::validation::Messages;
use crate::error::{Error, Result};
use ash::{ext, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use std::sync::{Arc, Mutex};

/// How to open a device.
#[derive(Debug, Clone, Default)]
pub struct ContextOptions {
    /// Index or part of the name of the device; else the first of [`super::list_devices`].
    pub device: Option<String>,
    /// Turn on the validation layers: core, synchronization, GPU-assisted.
    pub validate: bool,
}

/// The open device. Everything made from it keeps it alive.
pub struct Context {
    // Dropped in this order.
    pub(super) allocator: Mutex<Allocator>,
    pub(super) device: Device,
    instance: Instance,
    /// Locked by whoever submits: Vulkan lets one thread at a time use a queue.
    pub(super) queue: Mutex<vk::Queue>,
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
        let Opened {
            device,
            physical,
            info,
            queue_family,
            timestamp_bits,
            properties,
        } = device::open(&instance, options)?;
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.clone(),
            device: device.clone(),
            physical_device: physical,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        })
        .map_err(|e| Error::Device {
            action: "setting up the memory allocator".into(),
            reason: e.to_string(),
            remedy: "choose another device".into(),
        })?;
        // SAFETY: `device::open` made one queue of this family.
        let queue = unsafe { device.get_device_queue(queue_family, 0) };
        let debug =
            (instance.debug_utils).then(|| ext::debug_utils::Device::new(&instance, &device));
        Ok(Arc::new(Self {
            allocator: Mutex::new(allocator),
            device,
            instance,
            queue: Mutex::new(queue),
            queue_family,
            debug,
            timestamp_bits,
            properties,
            info,
        }))
    }

    /// The device in use.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// What the validation layers complained about so far; empty where they are off.
    pub fn validation_messages(&self) -> Vec<String> {
        self.instance.messages.all()
    }

    /// Where the validation layers' messages go, to be read even after the context is gone.
    pub fn messages(&self) -> Arc<Messages> {
        self.instance.messages.clone()
    }

    /// Largest storage buffer that a shader can see, bytes.
    pub fn max_storage_bytes(&self) -> u64 {
        u64::from(self.properties.limits.max_storage_buffer_range)
    }

    /// Largest side of an image, texels. Light maps and pictures are drawn into, for which some
    /// devices (SwiftShader) allow less than for sampling.
    pub fn max_image_side(&self) -> u32 {
        let limits = &self.properties.limits;
        (limits.max_image_dimension2_d)
            .min(limits.max_framebuffer_width)
            .min(limits.max_framebuffer_height)
    }

    pub(super) fn cache_uuid(&self) -> [u8; vk::UUID_SIZE] {
        self.properties.pipeline_cache_uuid
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
        // SAFETY: every resource holds an Arc of the context, so nobody else uses the device.
        let _ = unsafe { self.device.device_wait_idle() };
    }
}
