//! Which device to take, what it must be able to do, and the logical device made from it.

use super::instance::{INSTALL_DRIVER, Instance, no_device};
use super::requirements::Requirements;
use super::shader::{BindingKind, Shader, shaders};
use super::texel::Texel;
use crate::error::Result;
use ash::vk;
use std::ffi::CStr;
use std::ops::Deref;

/// How to open a device.
#[derive(Debug, Clone, Default)]
pub struct ContextOptions {
    /// Index or part of the name of the device; else the first of [`list_devices`].
    pub device: Option<String>,
    /// Turn on the validation layers: core, synchronization, GPU-assisted.
    pub validate: bool,
}

/// A device, as [`list_devices`] finds it.
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

/// A logical device. One of ours destroys itself, after everything that was made from it; a host's does not.
pub struct Device {
    pub(super) functions: ash::Device,
    pub(super) is_ours: bool,
}

impl Deref for Device {
    type Target = ash::Device;

    fn deref(&self) -> &ash::Device {
        &self.functions
    }
}

impl Drop for Device {
    fn drop(&mut self) {
        if self.is_ours {
            // SAFETY: nothing made from the device is left.
            unsafe { self.functions.destroy_device(None) };
        }
    }
}

/// Every Vulkan device, best first: discrete, integrated, virtual, other, CPU.
///
/// # Errors
/// [`crate::Error::NoDevice`] where there is no loader or no driver.
pub fn list_devices() -> Result<Vec<DeviceInfo>> {
    let instance = Instance::new(false)?;
    let devices = ranked_devices(&instance)?;
    Ok(devices
        .into_iter()
        .map(|device| describe(&instance, device))
        .collect())
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

fn ranked_devices(instance: &Instance) -> Result<Vec<vk::PhysicalDevice>> {
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

pub(super) fn describe(instance: &Instance, device: vk::PhysicalDevice) -> DeviceInfo {
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
fn unsuitable(instance: &Instance, device: vk::PhysicalDevice, version: u32) -> Option<String> {
    if version < vk::API_VERSION_1_3 {
        return Some("it knows only Vulkan older than 1.3".into());
    }
    let mut v13 = vk::PhysicalDeviceVulkan13Features::default();
    let mut features = vk::PhysicalDeviceFeatures2::default().push_next(&mut v13);
    // SAFETY: the driver knows Vulkan 1.3 and with it the chained struct.
    unsafe { instance.get_physical_device_features2(device, &mut features) };
    if let Some(name) = Requirements::missing_feature(&v13) {
        return Some(format!("it lacks the feature {name}"));
    }
    // SAFETY: a valid physical device.
    let (format, properties) = unsafe {
        (
            instance.get_physical_device_format_properties(device, Texel::Light.format()),
            instance.get_physical_device_properties(device),
        )
    };
    if let Some(lack) = lacks(
        format.optimal_tiling_features,
        &properties.limits,
        shaders::ALL,
    ) {
        return Some(lack);
    }
    queue_family(instance, device)
        .is_none()
        .then(|| "it has no queue for graphics and compute".into())
}

/// Texels of a large texel buffer: 1 GiB.
const LARGE_TEXEL_BUFFER: u32 = 1 << 26;

/// Whether the device has large texel buffers. Shaders read storage buffers otherwise.
pub(super) fn has_texel_buffers(limits: &vk::PhysicalDeviceLimits) -> bool {
    limits.max_texel_buffer_elements >= LARGE_TEXEL_BUFFER
}

/// What images of [`Texel::Light`] or the limits lack of what `shaders` and their passes use.
fn lacks(
    image: vk::FormatFeatureFlags,
    limits: &vk::PhysicalDeviceLimits,
    shaders: &[&Shader],
) -> Option<String> {
    for (feature, action) in [
        (
            vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND,
            "blend into RGBA32F images, which light maps are",
        ),
        (
            vk::FormatFeatureFlags::STORAGE_IMAGE,
            "write RGBA32F images from compute shaders",
        ),
        (
            vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR,
            "interpolate in RGBA32F images",
        ),
    ] {
        if !image.contains(feature) {
            return Some(format!("it cannot {action}"));
        }
    }
    for shader in shaders {
        let has_texel_buffers = has_texel_buffers(limits);
        let kinds = || (shader.bindings.iter()).map(|b| b.kind.on(has_texel_buffers));
        let count = |kind| kinds().filter(|k| *k == kind).count() as u32;
        let mut needs = vec![
            (
                "storage buffers a stage",
                count(BindingKind::StorageBuffer),
                limits.max_per_stage_descriptor_storage_buffers,
            ),
            (
                "storage images a stage",
                count(BindingKind::StorageImage),
                limits.max_per_stage_descriptor_storage_images,
            ),
            (
                "sampled images a stage",
                count(BindingKind::SampledImage) + count(BindingKind::TexelBuffer),
                limits.max_per_stage_descriptor_sampled_images,
            ),
            (
                "bytes of push constants",
                shader.push_bytes,
                limits.max_push_constants_size,
            ),
            (
                "threads a workgroup",
                shader.local_size.iter().product(),
                limits.max_compute_work_group_invocations,
            ),
        ];
        for (size, limit) in shader
            .local_size
            .into_iter()
            .zip(limits.max_compute_work_group_size)
        {
            needs.push(("threads along one side of a workgroup", size, limit));
        }
        if let Some((what, needed, limit)) = needs.iter().find(|(_, needed, limit)| needed > limit)
        {
            return Some(format!(
                "it allows {limit} {what}, and {} needs {needed}",
                shader.name
            ));
        }
    }
    None
}

fn queue_family(instance: &Instance, device: vk::PhysicalDevice) -> Option<u32> {
    let needed = Requirements::default().queue_flags;
    // SAFETY: a valid physical device.
    unsafe { instance.get_physical_device_queue_family_properties(device) }
        .iter()
        .position(|family| family.queue_flags.contains(needed))
        .map(|index| index as u32)
}

/// A device that was opened, and what the context needs to know of it.
pub struct Opened {
    pub device: Device,
    pub physical: vk::PhysicalDevice,
    pub info: DeviceInfo,
    pub queue_family: u32,
    /// Valid bits of a timestamp; 0 if the queue has none.
    pub timestamp_bits: u32,
    pub properties: vk::PhysicalDeviceProperties,
}

/// A device that can do the work, and its queue family for graphics and compute.
#[derive(Debug, Clone)]
pub struct SuitableDevice {
    pub physical: vk::PhysicalDevice,
    pub queue_family: u32,
    pub info: DeviceInfo,
}

/// The device whose index or part of the name is `wanted`, or all that can do the work, best first: at least one.
///
/// # Errors
/// [`crate::Error::NoDevice`] where there is none or it cannot do the work.
pub(super) fn suitable(instance: &Instance, wanted: Option<&str>) -> Result<Vec<SuitableDevice>> {
    let mut devices: Vec<_> = ranked_devices(instance)?
        .into_iter()
        .map(|device| (device, describe(instance, device)))
        .collect();
    if let Some(wanted) = wanted {
        let by_index = wanted.parse().ok().filter(|index| *index < devices.len());
        let lower = wanted.to_lowercase();
        let by_name = |(_, info): &(_, DeviceInfo)| info.name.to_lowercase().contains(&lower);
        let Some(index) = by_index.or_else(|| devices.iter().position(by_name)) else {
            let found: Vec<_> = devices.iter().map(|(_, info)| info.name.as_str()).collect();
            return Err(no_device(
                format!("none is called {wanted:?}; there is: {}", found.join(", ")),
                "choose a device by its index or a part of its name",
            ));
        };
        devices = vec![devices.swap_remove(index)];
    }
    let unsuitable = |(_, info): &(_, DeviceInfo)| {
        let reason = info.unsuitable.as_deref().unwrap_or_default();
        format!("{}: {reason}", info.name)
    };
    let first = unsuitable(&devices[0]);
    devices.retain(|(_, info)| info.unsuitable.is_none());
    if devices.is_empty() {
        let remedy = match wanted {
            Some(_) => "choose another device or update the driver",
            None => INSTALL_DRIVER,
        };
        return Err(no_device(first, remedy));
    }
    let with_family = |(physical, info)| SuitableDevice {
        physical,
        queue_family: queue_family(instance, physical).expect("checked by `unsuitable`"),
        info,
    };
    Ok(devices.into_iter().map(with_family).collect())
}

/// Opens the device that `options` ask for.
///
/// # Errors
/// [`crate::Error::NoDevice`] where there is none or it cannot do the work.
pub fn open(instance: &Instance, options: &ContextOptions) -> Result<Opened> {
    let SuitableDevice {
        physical,
        queue_family: family,
        info,
    } = suitable(instance, options.device.as_deref())?.swap_remove(0);

    // SAFETY: a valid physical device.
    let supported = unsafe { instance.get_physical_device_features(physical) };
    let mut features = vk::PhysicalDeviceFeatures::default();
    if options.validate {
        // GPU-assisted validation writes its findings from every stage.
        features.fragment_stores_and_atomics = supported.fragment_stores_and_atomics;
        features.vertex_pipeline_stores_and_atomics = supported.vertex_pipeline_stores_and_atomics;
    }
    let mut v13 = Requirements::default().features;
    let queues = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(family)
        .queue_priorities(&[1.0])];
    let create = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_features(&features)
        .push_next(&mut v13);
    // SAFETY: features and queue were checked above.
    let device = unsafe { instance.create_device(physical, &create, None) }.map_err(|error| {
        no_device(
            format!("{} cannot be opened: {error}", info.name),
            "choose another device",
        )
    })?;
    let device = Device {
        functions: device,
        is_ours: true,
    };
    Ok(Opened::new(instance, physical, device, info, family))
}

impl Opened {
    pub(super) fn new(
        instance: &Instance,
        physical: vk::PhysicalDevice,
        device: Device,
        info: DeviceInfo,
        queue_family: u32,
    ) -> Self {
        // SAFETY: a valid physical device.
        let (properties, families) = unsafe {
            (
                instance.get_physical_device_properties(physical),
                instance.get_physical_device_queue_family_properties(physical),
            )
        };
        Self {
            device,
            physical,
            info,
            queue_family,
            timestamp_bits: families[queue_family as usize].timestamp_valid_bits,
            properties,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Barely enough of everything, and one too little of each.
    #[test]
    fn what_a_device_lacks_is_named() {
        let image = vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND
            | vk::FormatFeatureFlags::STORAGE_IMAGE
            | vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR;
        let most =
            |count: &dyn Fn(&Shader) -> u32| shaders::ALL.iter().map(|s| count(s)).max().unwrap();
        let count = |s: &Shader, kind| s.bindings.iter().filter(|b| b.kind == kind).count() as u32;
        let most_of = |kind| most(&|s| count(s, kind));
        let sampled =
            |s: &Shader| count(s, BindingKind::SampledImage) + count(s, BindingKind::TexelBuffer);
        let limits = vk::PhysicalDeviceLimits {
            max_per_stage_descriptor_storage_buffers: most_of(BindingKind::StorageBuffer),
            max_per_stage_descriptor_storage_images: most_of(BindingKind::StorageImage),
            max_per_stage_descriptor_sampled_images: most(&sampled),
            max_push_constants_size: most(&|s| s.push_bytes),
            max_compute_work_group_invocations: most(&|s| s.local_size.iter().product()),
            max_texel_buffer_elements: LARGE_TEXEL_BUFFER,
            max_compute_work_group_size: [0, 1, 2].map(|axis| most(&|s| s.local_size[axis])),
            ..Default::default()
        };
        // More than every device has to allow.
        assert!(limits.max_per_stage_descriptor_storage_buffers > 4);
        assert_eq!(lacks(image, &limits, shaders::ALL), None);

        for feature in [
            vk::FormatFeatureFlags::COLOR_ATTACHMENT_BLEND,
            vk::FormatFeatureFlags::STORAGE_IMAGE,
            vk::FormatFeatureFlags::SAMPLED_IMAGE_FILTER_LINEAR,
        ] {
            let lack = lacks(image & !feature, &limits, shaders::ALL);
            assert!(lack.is_some_and(|l| l.contains("RGBA32F")), "{feature:?}");
        }
        type Take = fn(&mut vk::PhysicalDeviceLimits);
        let fewer: [(&str, Take); 6] = [
            ("storage buffers", |l| {
                l.max_per_stage_descriptor_storage_buffers -= 1;
            }),
            ("storage images", |l| {
                l.max_per_stage_descriptor_storage_images -= 1;
            }),
            ("sampled images", |l| {
                l.max_per_stage_descriptor_sampled_images -= 1;
            }),
            ("push constants", |l| l.max_push_constants_size -= 4),
            ("threads a workgroup", |l| {
                l.max_compute_work_group_invocations -= 1;
            }),
            ("along one side", |l| l.max_compute_work_group_size[0] -= 1),
        ];
        for (what, take) in fewer {
            let mut limits = limits;
            take(&mut limits);
            let lack = lacks(image, &limits, shaders::ALL);
            assert!(
                lack.as_ref().is_some_and(|l| l.contains(what)),
                "{what}: {lack:?}"
            );
        }
    }
}
