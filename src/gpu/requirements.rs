//! Requirements on a device.

use super::texel::Texel;
use ash::vk;
use std::ffi::CStr;

/// Requirements on a device. A host enables them when it creates its device; [`super::Context::new`] does so itself.
#[derive(Debug, Clone, Copy)]
pub struct Requirements {
    /// Minimum API version of instance and device.
    pub api_version: u32,
    /// Features that are true here must be enabled.
    pub features: vk::PhysicalDeviceVulkan13Features<'static>,
    /// Names of device extensions: none at present.
    pub extensions: &'static [&'static CStr],
    /// Capabilities that the queue's family must have.
    pub queue_flags: vk::QueueFlags,
    /// Format of the light maps. Its images must be blended into, stored to, and sampled linearly.
    pub light_map_format: vk::Format,
}

impl Requirements {
    /// The name of a required feature that `features` lacks.
    pub(super) fn missing_feature(
        features: &vk::PhysicalDeviceVulkan13Features,
    ) -> Option<&'static str> {
        [
            ("dynamicRendering", features.dynamic_rendering),
            ("synchronization2", features.synchronization2),
            ("maintenance4", features.maintenance4),
        ]
        .into_iter()
        .find_map(|(name, present)| (present == vk::FALSE).then_some(name))
    }
}

impl Default for Requirements {
    fn default() -> Self {
        Self {
            api_version: vk::API_VERSION_1_3,
            features: vk::PhysicalDeviceVulkan13Features::default()
                .dynamic_rendering(true)
                .synchronization2(true)
                .maintenance4(true),
            extensions: &[],
            queue_flags: vk::QueueFlags::GRAPHICS | vk::QueueFlags::COMPUTE,
            light_map_format: Texel::Light.format(),
        }
    }
}
