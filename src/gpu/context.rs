//! Instance, device, queue and memory allocator.

use super::device_error;
use super::validation::Messages;
use crate::error::{Error, Result};
use ash::{ext, vk};
use gpu_allocator::vulkan::{Allocator, AllocatorCreateDesc};
use std::ffi::{CStr, c_char};
use std::mem::ManuallyDrop;
use std::sync::{Arc, Mutex};

/// How to open a device.
#[derive(Debug, Clone, Default)]
pub struct ContextOptions {
    /// Index or part of the name of the device; else the first of [`list_devices`].
    pub device: Option<String>,
    /// Turn on the validation layers: core, synchronization, GPU-assisted.
    pub validate: bool,
}

/// A device as `nephroid devices` lists it.
#[derive(Debug, Clone, serde::Serialize)]
pub struct DeviceInfo {
    pub name: String,
    /// discrete, integrated, virtual, cpu or other
    pub kind: &'static str,
    pub driver: String,
    pub api_version: String,
    /// Why nephroid cannot use it.
    pub unsuitable: Option<String>,
}

/// The open device. Everything made from it keeps it alive.
pub struct Context {
    pub(super) device: ash::Device,
    pub(super) queue: vk::Queue,
    pub(super) queue_family: u32,
    pub(super) allocator: ManuallyDrop<Mutex<Allocator>>,
    pub(super) debug: Option<ext::debug_utils::Device>,
    /// Nanoseconds a timestamp tick; 0 where the queue has no timestamps.
    pub(super) timestamp_period: f32,
    pub(super) properties: vk::PhysicalDeviceProperties,
    info: DeviceInfo,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    messages: Box<Messages>,
    instance: ash::Instance,
    _entry: ash::Entry,
}

impl Context {
    /// Opens the device that `options` ask for.
    ///
    /// # Errors
    /// [`Error::NoDevice`] where the loader, the layers or a suitable device is missing,
    /// [`Error::Device`] where a call fails.
    pub fn new(options: &ContextOptions) -> Result<Arc<Self>> {
        let entry = load_entry()?;
        let messages = Box::<Messages>::default();
        let (instance, debug_utils) = create_instance(&entry, options.validate, &messages)?;
        let opened = open_device(&instance, options);
        let (physical, info, queue_family, device) = match opened {
            Ok(opened) => opened,
            Err(error) => {
                // SAFETY: nothing was made from the instance.
                unsafe { instance.destroy_instance(None) };
                return Err(error);
            }
        };
        let messenger = match (&debug_utils, options.validate) {
            (true, true) => {
                let functions = ext::debug_utils::Instance::new(&entry, &instance);
                // SAFETY: the extension is enabled; `messages` is boxed and outlives the messenger.
                let handle = unsafe {
                    functions.create_debug_utils_messenger(&messages.messenger_info(), None)
                };
                Some((
                    functions,
                    handle.map_err(device_error("listening to the layers"))?,
                ))
            }
            _ => None,
        };
        // SAFETY: valid handles of this instance.
        let (queue, properties, families) = unsafe {
            (
                device.get_device_queue(queue_family, 0),
                instance.get_physical_device_properties(physical),
                instance.get_physical_device_queue_family_properties(physical),
            )
        };
        let has_timestamps = families[queue_family as usize].timestamp_valid_bits > 0;
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
            remedy: "name another --device".into(),
        })?;
        Ok(Arc::new(Self {
            debug: debug_utils.then(|| ext::debug_utils::Device::new(&instance, &device)),
            timestamp_period: if has_timestamps {
                properties.limits.timestamp_period
            } else {
                0.0
            },
            allocator: ManuallyDrop::new(Mutex::new(allocator)),
            device,
            queue,
            queue_family,
            properties,
            info,
            messenger,
            messages,
            instance,
            _entry: entry,
        }))
    }

    /// The device in use.
    pub fn info(&self) -> &DeviceInfo {
        &self.info
    }

    /// What the validation layers complained about so far; empty where they are off.
    pub fn validation_messages(&self) -> Vec<String> {
        self.messages.all()
    }

    /// Largest storage buffer that a shader can see, bytes.
    pub fn max_storage_bytes(&self) -> u64 {
        u64::from(self.properties.limits.max_storage_buffer_range)
    }

    /// Largest side of an image, texels.
    pub fn max_image_side(&self) -> u32 {
        self.properties.limits.max_image_dimension2_d
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
        // SAFETY: every resource holds an Arc of the context, so none is left; the order is the
        // reverse of creation.
        unsafe {
            let _ = self.device.device_wait_idle();
            ManuallyDrop::drop(&mut self.allocator);
            self.device.destroy_device(None);
            if let Some((functions, messenger)) = self.messenger.take() {
                functions.destroy_debug_utils_messenger(messenger, None);
            }
            self.instance.destroy_instance(None);
        }
    }
}

/// Every Vulkan device, best first: discrete, integrated, virtual, other, CPU.
///
/// # Errors
/// [`Error::NoDevice`] where there is no loader or no driver.
pub fn list_devices() -> Result<Vec<DeviceInfo>> {
    let entry = load_entry()?;
    let messages = Messages::default();
    let (instance, _) = create_instance(&entry, false, &messages)?;
    let devices = ranked_devices(&instance).map(|list| {
        list.into_iter()
            .map(|device| describe(&instance, device))
            .collect()
    });
    // SAFETY: nothing else was made from the instance.
    unsafe { instance.destroy_instance(None) };
    devices
}

fn no_device(reason: impl Into<String>, remedy: &str) -> Error {
    Error::NoDevice {
        reason: reason.into(),
        remedy: remedy.into(),
    }
}

const INSTALL_DRIVER: &str = "install a Vulkan driver for your GPU, or the software renderer lavapipe \
     (Debian and Ubuntu: apt-get install libvulkan1 mesa-vulkan-drivers); `nephroid devices` lists what is found";

fn load_entry() -> Result<ash::Entry> {
    // SAFETY: loading the system's Vulkan loader runs its initialisers, which we must trust.
    unsafe { ash::Entry::load() }.map_err(|error| {
        no_device(
            format!("the Vulkan loader cannot be loaded: {error}"),
            INSTALL_DRIVER,
        )
    })
}

fn create_instance(
    entry: &ash::Entry,
    validate: bool,
    messages: &Messages,
) -> Result<(ash::Instance, bool)> {
    const LAYER: &CStr = c"VK_LAYER_KHRONOS_validation";
    // SAFETY: plain queries.
    let version = unsafe { entry.try_enumerate_instance_version() }
        .map_err(device_error("asking for the instance version"))?
        .unwrap_or(vk::API_VERSION_1_0);
    if version < vk::API_VERSION_1_3 {
        return Err(no_device(
            "the Vulkan loader is older than 1.3",
            "update the Vulkan loader",
        ));
    }
    let mut layers: Vec<*const c_char> = Vec::new();
    if validate {
        // SAFETY: a plain query.
        let available = unsafe { entry.enumerate_instance_layer_properties() }
            .map_err(device_error("listing the layers"))?;
        if !available
            .iter()
            .any(|l| l.layer_name_as_c_str() == Ok(LAYER))
        {
            return Err(no_device(
                "the validation layer VK_LAYER_KHRONOS_validation is not installed",
                "install it (Debian and Ubuntu: apt-get install vulkan-validationlayers) or leave out --validate",
            ));
        }
        layers.push(LAYER.as_ptr());
    }
    // SAFETY: a plain query.
    let extensions = unsafe { entry.enumerate_instance_extension_properties(None) }
        .map_err(device_error("listing the instance extensions"))?;
    let debug_utils = validate
        || extensions
            .iter()
            .any(|e| e.extension_name_as_c_str() == Ok(ext::debug_utils::NAME));
    let mut names = Vec::new();
    if debug_utils {
        names.push(ext::debug_utils::NAME.as_ptr());
    }

    let application = vk::ApplicationInfo::default()
        .application_name(c"nephroid")
        .api_version(vk::API_VERSION_1_3);
    let enabled = [
        vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION,
        vk::ValidationFeatureEnableEXT::GPU_ASSISTED,
        vk::ValidationFeatureEnableEXT::GPU_ASSISTED_RESERVE_BINDING_SLOT,
    ];
    let mut features = vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
    let mut messenger = messages.messenger_info();
    let mut info = vk::InstanceCreateInfo::default()
        .application_info(&application)
        .enabled_layer_names(&layers)
        .enabled_extension_names(&names);
    if validate {
        info = info.push_next(&mut features).push_next(&mut messenger);
    }
    // SAFETY: everything the create-info points to lives until the call returns.
    let instance = unsafe { entry.create_instance(&info, None) }
        .map_err(|error| no_device(format!("no Vulkan instance: {error}"), INSTALL_DRIVER))?;
    Ok((instance, debug_utils))
}

fn kind_of(kind: vk::PhysicalDeviceType) -> (&'static str, u32) {
    match kind {
        vk::PhysicalDeviceType::DISCRETE_GPU => ("discrete", 0),
        vk::PhysicalDeviceType::INTEGRATED_GPU => ("integrated", 1),
        vk::PhysicalDeviceType::VIRTUAL_GPU => ("virtual", 2),
        vk::PhysicalDeviceType::CPU => ("cpu", 4),
        _ => ("other", 3),
    }
}

fn ranked_devices(instance: &ash::Instance) -> Result<Vec<vk::PhysicalDevice>> {
    // SAFETY: a valid instance.
    let mut devices = unsafe { instance.enumerate_physical_devices() }
        .map_err(|error| no_device(format!("no driver answers: {error}"), INSTALL_DRIVER))?;
    if devices.is_empty() {
        return Err(no_device("no driver offers a device", INSTALL_DRIVER));
    }
    // SAFETY: a valid physical device.
    devices.sort_by_key(|d| {
        kind_of(unsafe { instance.get_physical_device_properties(*d) }.device_type).1
    });
    Ok(devices)
}

fn describe(instance: &ash::Instance, device: vk::PhysicalDevice) -> DeviceInfo {
    let mut driver = vk::PhysicalDeviceDriverProperties::default();
    // SAFETY: a valid physical device.
    let basic = unsafe { instance.get_physical_device_properties(device) };
    let driver_text = if basic.api_version >= vk::API_VERSION_1_2 {
        let mut properties = vk::PhysicalDeviceProperties2::default().push_next(&mut driver);
        // SAFETY: the driver knows Vulkan 1.2 and with it the chained struct.
        unsafe { instance.get_physical_device_properties2(device, &mut properties) };
        let text = |s: Result<&CStr, _>| {
            s.map(|s| s.to_string_lossy().into_owned())
                .unwrap_or_default()
        };
        format!(
            "{} {}",
            text(driver.driver_name_as_c_str()),
            text(driver.driver_info_as_c_str())
        )
    } else {
        format!("version {:#x}", basic.driver_version)
    };
    let version = basic.api_version;
    DeviceInfo {
        name: basic
            .device_name_as_c_str()
            .map(|s| s.to_string_lossy().into_owned())
            .unwrap_or_default(),
        kind: kind_of(basic.device_type).0,
        driver: driver_text.trim().to_owned(),
        api_version: format!(
            "{}.{}.{}",
            vk::api_version_major(version),
            vk::api_version_minor(version),
            vk::api_version_patch(version)
        ),
        unsuitable: unsuitable(instance, device, version),
    }
}

/// What a device lacks for the default path, if anything.
fn unsuitable(
    instance: &ash::Instance,
    device: vk::PhysicalDevice,
    version: u32,
) -> Option<String> {
    if version < vk::API_VERSION_1_3 {
        return Some("it knows only Vulkan older than 1.3".into());
    }
    let mut v13 = vk::PhysicalDeviceVulkan13Features::default();
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut v13);
    // SAFETY: the driver knows Vulkan 1.3 and with it the chained struct.
    unsafe { instance.get_physical_device_features2(device, &mut features) };
    for (present, name) in [
        (v13.dynamic_rendering, "dynamicRendering"),
        (v13.synchronization2, "synchronization2"),
        (v13.maintenance4, "maintenance4"),
    ] {
        if present == vk::FALSE {
            return Some(format!("it lacks the feature {name}"));
        }
    }
    // SAFETY: a valid physical device.
    let format = unsafe {
        instance.get_physical_device_format_properties(device, vk::Format::R32G32B32A32_SFLOAT)
    };
    let needed =
        vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND | vk::FormatFeatureFlags::STORAGE_IMAGE;
    if !format.optimal_tiling_features.contains(needed) {
        return Some("it cannot blend into RGBA32F images, which light maps are".into());
    }
    queue_family(instance, device)
        .is_none()
        .then(|| "it has no queue for graphics and compute".into())
}

fn queue_family(instance: &ash::Instance, device: vk::PhysicalDevice) -> Option<u32> {
    let needed = vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE;
    // SAFETY: a valid physical device.
    unsafe { instance.get_physical_device_queue_family_properties(device) }
        .iter()
        .position(|family| family.queue_flags.contains(needed))
        .map(|index| index as u32)
}

type Opened = (vk::PhysicalDevice, DeviceInfo, u32, ash::Device);

fn open_device(instance: &ash::Instance, options: &ContextOptions) -> Result<Opened> {
    let devices: Vec<_> = ranked_devices(instance)?
        .into_iter()
        .map(|device| (device, describe(instance, device)))
        .collect();
    let found = || {
        devices
            .iter()
            .map(|(_, info)| info.name.as_str())
            .collect::<Vec<_>>()
            .join(", ")
    };
    let (physical, info) = match &options.device {
        Some(wanted) => {
            let by_index = wanted
                .parse::<usize>()
                .ok()
                .and_then(|index| devices.get(index));
            let lower = wanted.to_lowercase();
            by_index
                .or_else(|| {
                    devices
                        .iter()
                        .find(|(_, info)| info.name.to_lowercase().contains(&lower))
                })
                .ok_or_else(|| {
                    no_device(
                        format!("none is called {wanted:?}; there is: {}", found()),
                        "give --device an index or a part of a name that `nephroid devices` lists",
                    )
                })?
        }
        None => devices
            .iter()
            .find(|(_, info)| info.unsuitable.is_none())
            .ok_or_else(|| {
                let (_, info) = &devices[0];
                no_device(
                    format!(
                        "{}: {}",
                        info.name,
                        info.unsuitable.as_deref().unwrap_or_default()
                    ),
                    INSTALL_DRIVER,
                )
            })?,
    };
    if let Some(reason) = &info.unsuitable {
        return Err(no_device(
            format!("{}: {reason}", info.name),
            "name another --device or update the driver",
        ));
    }
    let family = queue_family(instance, *physical).expect("checked by `unsuitable`");

    // SAFETY: a valid physical device.
    let supported = unsafe { instance.get_physical_device_features(*physical) };
    let mut features = vk::PhysicalDeviceFeatures::default();
    if options.validate {
        // GPU-assisted validation writes its findings from every stage.
        features.fragment_stores_and_atomics = supported.fragment_stores_and_atomics;
        features.vertex_pipeline_stores_and_atomics = supported.vertex_pipeline_stores_and_atomics;
    }
    let mut v13 = vk::PhysicalDeviceVulkan13Features::default()
        .dynamic_rendering(true)
        .synchronization2(true)
        .maintenance4(true);
    let queues = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(family)
        .queue_priorities(&[1.0])];
    let create = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_features(&features)
        .push_next(&mut v13);
    // SAFETY: features and queue were checked above.
    let device = unsafe { instance.create_device(*physical, &create, None) }.map_err(|error| {
        no_device(
            format!("{} cannot be opened: {error}", info.name),
            "name another --device",
        )
    })?;
    Ok((*physical, info.clone(), family, device))
}
