//! The window's Vulkan host: instance, surface, device, queue and allocator.

use ash::{ext, khr, vk};
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{
    Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc,
};
use nephroid::gpu::{
    Context, DeviceInfo, External, Messages, SuitableDevice, reason_of, suitable_devices,
};
use nephroid::{Error, Result};
use raw_window_handle::{HasDisplayHandle, HasWindowHandle};
use std::collections::BTreeMap;
#[cfg(feature = "dev")]
use std::collections::HashMap;
use std::ffi::{CStr, c_char};
use std::mem::ManuallyDrop;
use std::sync::{Arc, Mutex};
use winit::window::Window;

const LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";

/// How to open the device.
pub struct HostOptions {
    /// Index or part of the name.
    pub device: Option<String>,
    pub validate: bool,
    /// Where the validation layers write.
    pub messages: Arc<Messages>,
}

/// Instance, device and queue. Everything made from them is destroyed before they are dropped.
pub struct Host {
    /// Freed before the device.
    allocator: ManuallyDrop<Arc<Mutex<Allocator>>>,
    pub device: ash::Device,
    pub queue: vk::Queue,
    pub queue_family: u32,
    pub physical: vk::PhysicalDevice,
    pub info: DeviceInfo,
    pub surfaces: khr::surface::Instance,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    instance: ash::Instance,
    entry: ash::Entry,
    /// The layers write here until the instance is gone.
    _messages: Arc<Messages>,
    /// Words that replaced those of the build, by the shaders' names.
    #[cfg(feature = "dev")]
    pub newest_shaders: HashMap<&'static str, Vec<u32>>,
}

/// What went wrong with the window or its display.
pub fn no_window(reason: impl Into<String>, remedy: &str) -> Error {
    Error::Window {
        reason: reason.into(),
        remedy: remedy.into(),
    }
}

/// What winit says of the system, without the place in winit's source.
pub fn plain(error: &impl std::fmt::Display) -> String {
    let text = error.to_string();
    let reason = (text.split_once(".rs:")).and_then(|(_, rest)| rest.split_once(": "));
    reason.map_or(text.clone(), |(_, reason)| reason.to_owned())
}

/// Turns a failed Vulkan call into an error that names what was being done.
pub fn failed(action: &str) -> impl FnOnce(vk::Result) -> Error + '_ {
    move |result| {
        Error::Device {
        action: action.to_owned(),
        reason: reason_of(result),
        remedy: "use a smaller window or smaller light maps, update the driver, or choose another device".into(),
    }
    }
}

impl Host {
    /// A device that can show pictures in `window`, and the window's surface.
    ///
    /// # Errors
    /// [`Error::NoDevice`] where the loader, the layers or a suitable device is missing, [`Error::Window`] where no device can
    /// show a window, [`Error::Device`] where a call fails.
    pub fn new(window: &Window, options: &HostOptions) -> Result<(Self, vk::SurfaceKHR)> {
        // SAFETY: loading the system's Vulkan loader runs its initialisers, which we must trust.
        let entry = unsafe { ash::Entry::load() }.map_err(|error| Error::NoDevice {
            reason: format!("the Vulkan loader cannot be loaded: {error}"),
            remedy: "install a Vulkan loader and driver".into(),
        })?;
        let instance = instance(&entry, window, options)?;
        let messenger = match options.validate {
            false => None,
            true => {
                let utils = ext::debug_utils::Instance::new(&entry, &instance);
                // SAFETY: the extension is enabled, and `_messages` outlives the messenger.
                let made = unsafe {
                    utils.create_debug_utils_messenger(&options.messages.messenger_info(), None)
                };
                let messenger = made.map_err(failed("listening to the validation layers"))?;
                Some((utils, messenger))
            }
        };
        let surfaces = khr::surface::Instance::new(&entry, &instance);
        let surface = surface(&entry, &instance, window)?;
        let chosen = choose(&entry, &instance, &surfaces, surface, options)?;
        let device = device(&instance, &chosen, options.validate)?;
        // SAFETY: the device has one queue of this family.
        let queue = unsafe { device.get_device_queue(chosen.queue_family, 0) };
        let allocator = Allocator::new(&AllocatorCreateDesc {
            instance: instance.clone(),
            device: device.clone(),
            physical_device: chosen.physical,
            debug_settings: Default::default(),
            buffer_device_address: false,
            allocation_sizes: Default::default(),
        })
        .map_err(|error| allocation_failed("the allocator", &error))?;
        let host = Self {
            allocator: ManuallyDrop::new(Arc::new(Mutex::new(allocator))),
            device,
            queue,
            queue_family: chosen.queue_family,
            physical: chosen.physical,
            info: chosen.info,
            surfaces,
            messenger,
            instance,
            entry,
            _messages: options.messages.clone(),
            #[cfg(feature = "dev")]
            newest_shaders: HashMap::new(),
        };
        Ok((host, surface))
    }

    /// Makes another surface for the window, whose last one was lost.
    ///
    /// # Errors
    /// [`Error::Window`] where there is none.
    pub fn surface(&self, window: &Window) -> Result<vk::SurfaceKHR> {
        surface(&self.entry, &self.instance, window)
    }

    pub fn swapchains(&self) -> khr::swapchain::Device {
        khr::swapchain::Device::new(&self.instance, &self.device)
    }

    pub fn allocator(&self) -> &Arc<Mutex<Allocator>> {
        &self.allocator
    }

    /// The library on this device.
    ///
    /// # Errors
    /// As [`Context::from_raw`].
    pub fn context(&self) -> Result<Arc<Context>> {
        let made_with = Context::requirements();
        let external = External {
            entry: self.entry.clone(),
            instance: self.instance.clone(),
            physical_device: self.physical,
            device: self.device.clone(),
            queue_family: self.queue_family,
            api_version: made_with.api_version,
            features: made_with.features,
            allocator: Some(Arc::clone(&self.allocator)),
        };
        // SAFETY: the handles belong together and were made with these features. Whoever holds the context drops it before
        // the host, when the device is idle.
        unsafe { Context::from_raw(external) }
    }

    /// Memory of a buffer or an image, bound by the caller.
    ///
    /// # Errors
    /// [`Error::Device`] where there is not enough.
    pub fn allocate(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
    ) -> Result<Allocation> {
        let mut allocator = self.allocator.lock().expect("no panic while held");
        let wanted = AllocationCreateDesc {
            name,
            requirements,
            location,
            linear: location != MemoryLocation::GpuOnly,
            allocation_scheme: AllocationScheme::GpuAllocatorManaged,
        };
        (allocator.allocate(&wanted)).map_err(|error| allocation_failed(name, &error))
    }

    /// A buffer that the host can read or write. The caller passes it to [`Self::free_buffer`].
    ///
    /// # Errors
    /// [`Error::Device`] where there is not enough memory.
    pub fn buffer(
        &self,
        name: &str,
        bytes: u64,
        usage: vk::BufferUsageFlags,
        location: MemoryLocation,
    ) -> Result<(vk::Buffer, Allocation)> {
        let info = vk::BufferCreateInfo::default().size(bytes).usage(usage);
        // SAFETY: a create-info that is valid for the call; the buffer is bound once, to memory made for it.
        unsafe {
            let buffer =
                (self.device.create_buffer(&info, None)).map_err(failed("making a buffer"))?;
            let requirements = self.device.get_buffer_memory_requirements(buffer);
            let memory = self.allocate(name, requirements, location)?;
            (self.device)
                .bind_buffer_memory(buffer, memory.memory(), memory.offset())
                .map_err(failed("binding a buffer"))?;
            Ok((buffer, memory))
        }
    }

    pub fn free(&self, allocation: Allocation) {
        let mut allocator = self.allocator.lock().expect("no panic while held");
        // Memory that is not known is a mistake of ours.
        allocator
            .free(allocation)
            .expect("memory of this allocator");
    }

    /// Destroys a buffer, which no frame in flight uses, and frees its memory.
    pub fn free_buffer(&self, (buffer, memory): (vk::Buffer, Allocation)) {
        // SAFETY: no frame in flight uses it.
        unsafe { self.device.destroy_buffer(buffer, None) };
        self.free(memory);
    }

    /// Device memory by the names of its allocations, bytes, and all that is reserved.
    pub fn memory(&self) -> (BTreeMap<String, u64>, u64) {
        let allocator = self.allocator.lock().expect("no panic while held");
        let report = allocator.generate_report();
        let mut names = BTreeMap::new();
        for allocation in &report.allocations {
            let name = match allocation.name.as_str() {
                "" => "panels",
                name => name,
            };
            *names.entry(name.to_owned()).or_insert(0) += allocation.size;
        }
        (names, report.total_capacity_bytes)
    }

    /// Waits until the device has nothing to do. A lost device has nothing to do.
    pub fn wait_idle(&self) {
        // SAFETY: one thread uses the queue.
        let _ = unsafe { self.device.device_wait_idle() };
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        // SAFETY: nothing made from them is left; the reverse of their creation.
        unsafe {
            ManuallyDrop::drop(&mut self.allocator);
            self.device.destroy_device(None);
            if let Some((utils, messenger)) = &self.messenger {
                utils.destroy_debug_utils_messenger(*messenger, None);
            }
            self.instance.destroy_instance(None);
        }
    }
}

fn allocation_failed(name: &str, error: &impl std::fmt::Display) -> Error {
    Error::Device {
        action: format!("allocating {name}"),
        reason: error.to_string(),
        remedy: "use a smaller window or smaller light maps".into(),
    }
}

const OTHER_DEVICE: &str = "choose another device with --device, or install a driver that can show windows, such as that of your GPU or lavapipe";

fn instance(entry: &ash::Entry, window: &Window, options: &HostOptions) -> Result<ash::Instance> {
    let display = (window.display_handle()).map_err(|error| {
        no_window(
            format!("the display cannot be used: {error}"),
            "check the display",
        )
    })?;
    let mut extensions: Vec<*const c_char> =
        ash_window::enumerate_required_extensions(display.as_raw())
            .map_err(|error| {
                no_window(
                    format!("Vulkan cannot show this kind of window: {error}"),
                    OTHER_DEVICE,
                )
            })?
            .to_vec();
    let mut layers = Vec::new();
    if options.validate {
        // SAFETY: a plain query.
        let available = unsafe { entry.enumerate_instance_layer_properties() }
            .map_err(failed("listing the layers"))?;
        let is_layer = |layer: &vk::LayerProperties| layer.layer_name_as_c_str() == Ok(LAYER);
        if !available.iter().any(is_layer) {
            return Err(Error::NoDevice {
                reason: "the validation layer VK_LAYER_KHRONOS_validation is not installed".into(),
                remedy: "install it (Debian and Ubuntu: apt-get install vulkan-validationlayers) or run without --validate".into(),
            });
        }
        layers.push(LAYER.as_ptr());
        extensions.push(ext::debug_utils::NAME.as_ptr());
    }
    let application = vk::ApplicationInfo::default()
        .application_name(c"nephroid view")
        .api_version(Context::requirements().api_version);
    let enabled = [
        vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION,
        vk::ValidationFeatureEnableEXT::GPU_ASSISTED,
        vk::ValidationFeatureEnableEXT::GPU_ASSISTED_RESERVE_BINDING_SLOT,
    ];
    let mut checks = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
    let mut info = vk::InstanceCreateInfo::default()
        .application_info(&application)
        .enabled_layer_names(&layers)
        .enabled_extension_names(&extensions);
    if options.validate {
        info = info.push_next(&mut checks);
    }
    // SAFETY: everything the create-info points to lives until the call returns.
    unsafe { entry.create_instance(&info, None) }.map_err(|error| match error {
        vk::Result::ERROR_EXTENSION_NOT_PRESENT => no_window(
            "no Vulkan driver can show a window on this display",
            OTHER_DEVICE,
        ),
        error => Error::NoDevice {
            reason: format!("no Vulkan instance: {error}"),
            remedy: "install a Vulkan driver for your GPU, or the software renderer lavapipe"
                .into(),
        },
    })
}

fn surface(
    entry: &ash::Entry,
    instance: &ash::Instance,
    window: &Window,
) -> Result<vk::SurfaceKHR> {
    let handles =
        (window.display_handle()).and_then(|display| Ok((display, window.window_handle()?)));
    let (display, handle) = handles
        .map_err(|error| no_window(format!("the window is gone: {error}"), "start again"))?;
    // SAFETY: the window outlives its surface, and the instance has the extensions for it.
    unsafe { ash_window::create_surface(entry, instance, display.as_raw(), handle.as_raw(), None) }
        .map_err(|error| no_window(format!("the window has no surface: {error}"), OTHER_DEVICE))
}

/// The first suitable device that can present to the surface.
fn choose(
    entry: &ash::Entry,
    instance: &ash::Instance,
    surfaces: &khr::surface::Instance,
    surface: vk::SurfaceKHR,
    options: &HostOptions,
) -> Result<SuitableDevice> {
    // SAFETY: the instance is made from the entry for Vulkan 1.3.
    let devices = unsafe { suitable_devices(entry, instance, options.device.as_deref()) }?;
    let can_present = |device: &&SuitableDevice| {
        // SAFETY: device and surface are of this instance.
        unsafe {
            let supported = surfaces.get_physical_device_surface_support(
                device.physical,
                device.queue_family,
                surface,
            );
            let extensions = instance.enumerate_device_extension_properties(device.physical);
            let has_swapchain = extensions.is_ok_and(|extensions| {
                let names = |e: &vk::ExtensionProperties| {
                    e.extension_name_as_c_str() == Ok(khr::swapchain::NAME)
                };
                extensions.iter().any(names)
            });
            supported == Ok(true) && has_swapchain
        }
    };
    devices.iter().find(can_present).cloned().ok_or_else(|| {
        let names: Vec<_> = devices
            .iter()
            .map(|device| device.info.name.as_str())
            .collect();
        no_window(
            format!(
                "{} cannot show pictures in a window on this display",
                names.join(", ")
            ),
            OTHER_DEVICE,
        )
    })
}

fn device(
    instance: &ash::Instance,
    chosen: &SuitableDevice,
    validate: bool,
) -> Result<ash::Device> {
    let needed = Context::requirements();
    // SAFETY: a valid physical device.
    let supported = unsafe { instance.get_physical_device_features(chosen.physical) };
    let mut features = vk::PhysicalDeviceFeatures::default();
    if validate {
        // GPU-assisted validation writes its findings from every stage.
        features.fragment_stores_and_atomics = supported.fragment_stores_and_atomics;
        features.vertex_pipeline_stores_and_atomics = supported.vertex_pipeline_stores_and_atomics;
    }
    let mut v13 = needed.features;
    let queues = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(chosen.queue_family)
        .queue_priorities(&[1.0])];
    let mut extensions: Vec<_> = needed.extensions.iter().map(|name| name.as_ptr()).collect();
    extensions.push(khr::swapchain::NAME.as_ptr());
    let info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&extensions)
        .enabled_features(&features)
        .push_next(&mut v13);
    // SAFETY: features, extension and queue were checked.
    unsafe { instance.create_device(chosen.physical, &info, None) }
        .map_err(failed("opening the device"))
}

#[cfg(test)]
mod tests {
    #[test]
    fn errors_name_no_source_file() {
        let text = "os error at /root/winit/src/linux/mod.rs:788: Failed to open connection";
        assert_eq!(super::plain(&text), "Failed to open connection");
        assert_eq!(super::plain(&"not supported"), "not supported");
    }
}
