//! The device of a host application.

use super::device::{Device, Opened, SuitableDevice, describe, suitable};
use super::instance::Instance;
use super::requirements::Requirements;
use crate::error::{Error, Result};
use ash::vk;
use gpu_allocator::vulkan::Allocator;
use std::sync::{Arc, Mutex};

/// A device that a host application has opened. [`super::Context::requirements`] says what it must have.
pub struct External {
    pub entry: ash::Entry,
    pub instance: ash::Instance,
    pub physical_device: vk::PhysicalDevice,
    pub device: ash::Device,
    /// The family of the queue that runs what is recorded.
    pub queue_family: u32,
    /// The API version that the instance was made for.
    pub api_version: u32,
    /// The features that the device was made with.
    pub features: vk::PhysicalDeviceVulkan13Features<'static>,
    /// Allocator for all memory; `None`: the context creates its own.
    pub allocator: Option<Arc<Mutex<Allocator>>>,
}

/// The devices that a host can use, best first, at least one: the one whose index or part of the name is `wanted`, or all that
/// can do the work.
///
/// # Errors
/// [`Error::NoDevice`] where there is none.
///
/// # Safety
/// `instance` is a valid instance for Vulkan 1.3, made from `entry`.
pub unsafe fn suitable_devices(
    entry: &ash::Entry,
    instance: &ash::Instance,
    wanted: Option<&str>,
) -> Result<Vec<SuitableDevice>> {
    let instance = Instance::of_host(entry.clone(), instance.clone());
    suitable(&instance, wanted)
}

/// The device of a host, if it has what [`super::Context::requirements`] names.
///
/// # Errors
/// [`Error::Host`] with what it lacks.
#[allow(clippy::type_complexity)] // used once
pub fn adopt(external: External) -> Result<(Instance, Opened, Option<Arc<Mutex<Allocator>>>)> {
    let External {
        entry,
        instance,
        physical_device,
        device,
        queue_family,
        api_version,
        features,
        allocator,
    } = external;
    let lacks = |reason: String| {
        Err(Error::Host {
            reason,
            remedy: "make instance and device with what Context::requirements names".into(),
        })
    };
    let required = Requirements::default();
    if api_version < required.api_version {
        return lacks(format!(
            "the instance is made for Vulkan {}.{}, and 1.3 is needed",
            vk::api_version_major(api_version),
            vk::api_version_minor(api_version)
        ));
    }
    let instance = Instance::of_host(entry, instance);
    let info = describe(&instance, physical_device);
    if let Some(reason) = &info.unsuitable {
        return lacks(format!("the device {} is unsuitable: {reason}", info.name));
    }
    if let Some(name) = Requirements::missing_feature(&features) {
        return lacks(format!("the device was made without the feature {name}"));
    }
    // SAFETY: a valid physical device, as the host promises.
    let families = unsafe { instance.get_physical_device_queue_family_properties(physical_device) };
    match families.get(queue_family as usize) {
        Some(family) if family.queue_flags.contains(required.queue_flags) => {}
        Some(_) => {
            return lacks(format!(
                "queue family {queue_family} does not do both graphics and compute"
            ));
        }
        None => {
            return lacks(format!(
                "there is no queue family {queue_family}: the device has {}",
                families.len()
            ));
        }
    }
    let device = Device {
        functions: device,
        is_ours: false,
    };
    let opened = Opened::new(&instance, physical_device, device, info, queue_family);
    Ok((instance, opened, allocator))
}
