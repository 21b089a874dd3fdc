//! Opens a Vulkan device that both wgpu and nephroid can use.

use crate::Result;
use nephroid::ash::{self, vk};
use nephroid::gpu::{Context, External, list_devices};
use wgpu::hal::{api::Vulkan, vulkan};

/// wgpu's half of the device.
pub struct Host {
    pub device: wgpu::Device,
    pub queue: wgpu::Queue,
    /// The same device, for commands that wgpu does not have.
    pub vulkan: ash::Device,
}

/// Opens the device that nephroid chooses by default, under the validation layers if `validate` is set.
pub fn open(validate: bool) -> Result<(Host, External)> {
    let chosen = (list_devices()?.into_iter())
        .find(|device| device.unsuitable.is_none())
        .ok_or("no Vulkan device is suitable for nephroid")?;
    let adapters = instance(validate)?.enumerate_adapters(wgpu::Backends::VULKAN);
    let adapter = (pollster::block_on(adapters).into_iter())
        .find(|adapter| adapter.get_info().name == chosen.name)
        .ok_or_else(|| format!("wgpu does not know the device {}", chosen.name))?;
    open_adapter(&adapter)
}

/// Without validation, `wgpu::Instance::new` suffices. With validation, it forwards the layers' messages only if the
/// flag `DEBUG` is set, and that flag also makes wgpu-hal name WGSL as the shaders' source language, which older layers
/// report as an error. This function enables the extension for messages without that flag.
fn instance(validate: bool) -> Result<wgpu::Instance> {
    let mut flags = wgpu::InstanceFlags::empty();
    flags.set(wgpu::InstanceFlags::VALIDATION, validate); // synchronization validation included
    let descriptor = wgpu::hal::InstanceDescriptor {
        name: "embed_wgpu",
        flags,
        memory_budget_thresholds: Default::default(),
        backend_options: Default::default(),
        telemetry: None,
        display: None,
    };
    let add_messages: Box<vulkan::CreateInstanceCallback> = Box::new(move |arguments| {
        if validate {
            arguments.extensions.push(ash::ext::debug_utils::NAME);
        }
    });
    // SAFETY: the Vulkan loader provides the extension, and the callback removes nothing.
    unsafe {
        let instance = vulkan::Instance::init_with_callback(&descriptor, Some(add_messages))?;
        // wgpu-hal continues silently if the layer is missing.
        let layers = (instance.shared_instance().entry()).enumerate_instance_layer_properties()?;
        let mut names = layers.iter().map(|layer| layer.layer_name_as_c_str());
        if validate && !names.any(|name| name == Ok(c"VK_LAYER_KHRONOS_validation")) {
            return Err("the Khronos validation layer is missing".into());
        }
        Ok(wgpu::Instance::from_hal::<Vulkan>(instance))
    }
}

/// Creates the device directly, with the extensions and features of both wgpu-hal and nephroid. wgpu-hal's
/// `open_with_callback` does not suffice: after the callback, it adds a struct that leaves maintenance4 disabled.
fn open_adapter(adapter: &wgpu::Adapter) -> Result<(Host, External)> {
    // SAFETY: no handle of the adapter is destroyed here.
    let hal = unsafe { adapter.as_hal::<Vulkan>() }.ok_or("the adapter is not of Vulkan")?;
    let shared = hal.shared_instance();
    let instance = shared.raw_instance();
    let physical_device = hal.raw_physical_device();

    let needed = Context::requirements();
    // SAFETY: a valid physical device.
    let families = unsafe { instance.get_physical_device_queue_family_properties(physical_device) };
    let queue_family = (families.iter())
        .position(|family| family.queue_flags.contains(needed.queue_flags))
        .ok_or("no queue does both graphics and compute")? as u32;

    let descriptor = wgpu::DeviceDescriptor {
        label: Some("shared with nephroid"),
        // The light map is sampled with interpolation. nephroid requires that of a device, so it is supported.
        required_features: wgpu::Features::FLOAT32_FILTERABLE,
        ..Default::default()
    };
    let mut extensions = hal.required_device_extensions(descriptor.required_features);
    for extension in needed.extensions {
        if !extensions.contains(extension) {
            extensions.push(extension);
        }
    }
    let mut of_wgpu = hal.physical_device_features(&extensions, descriptor.required_features);
    let names: Vec<_> = extensions.iter().map(|name| name.as_ptr()).collect();
    let queues = [vk::DeviceQueueCreateInfo::default()
        .queue_family_index(queue_family)
        .queue_priorities(&[1.0])];
    let info = vk::DeviceCreateInfo::default()
        .queue_create_infos(&queues)
        .enabled_extension_names(&names);
    let info = of_wgpu.add_to_device_create(info);

    // The chain has wgpu-hal's structs for single features. Vulkan forbids the struct for all features of 1.3 beside
    // them, so each of nephroid's features is enabled on its own.
    let mut dynamic_rendering = vk::PhysicalDeviceDynamicRenderingFeatures::default();
    let mut synchronization2 = vk::PhysicalDeviceSynchronization2Features::default();
    let mut maintenance4 = vk::PhysicalDeviceMaintenance4Features::default();
    // SAFETY: `of_wgpu` and the three structs outlive `info`. `open` chose a device that supports the features.
    let device = unsafe {
        let info = enable(info, &mut dynamic_rendering, |f| f.dynamic_rendering = 1);
        let info = enable(info, &mut synchronization2, |f| f.synchronization2 = 1);
        let info = enable(info, &mut maintenance4, |f| f.maintenance4 = 1);
        instance.create_device(physical_device, &info, None)?
    };

    let external = External {
        entry: shared.entry().clone(),
        instance: instance.clone(),
        physical_device,
        device: device.clone(),
        queue_family,
        // wgpu-hal creates its instance for the loader's version, but at most for 1.3.
        api_version: shared.instance_api_version().min(vk::API_VERSION_1_3),
        // The features enabled above. If nephroid requires another one, it rejects the device.
        features: vk::PhysicalDeviceVulkan13Features::default()
            .dynamic_rendering(true)
            .synchronization2(true)
            .maintenance4(true),
        allocator: None,
    };
    // SAFETY: the device comes from this adapter and has everything that wgpu-hal asks for. From here on, wgpu owns it.
    let (wgpu_device, queue) = unsafe {
        let open = hal.device_from_raw(
            device.clone(),
            None,
            &extensions,
            descriptor.required_features,
            &descriptor.required_limits,
            &descriptor.memory_hints,
            queue_family,
            0,
        )?;
        adapter.create_device_from_hal(open, &descriptor)?
    };
    let host = Host {
        device: wgpu_device,
        queue,
        vulkan: device,
    };
    Ok((host, external))
}

/// Enables a feature in the chain of `info`: in the struct of type `T` if the chain has one, otherwise in `own`, which
/// is then added. A chain must not have two structs of one type.
///
/// # Safety
/// The structs in the chain are valid, and nothing else refers to them.
unsafe fn enable<'a, T: vk::TaggedStructure + vk::ExtendsDeviceCreateInfo>(
    info: vk::DeviceCreateInfo<'a>,
    own: &'a mut T,
    switch_on: impl Fn(&mut T),
) -> vk::DeviceCreateInfo<'a> {
    let mut next = info.p_next.cast_mut().cast::<vk::BaseOutStructure>();
    // SAFETY: each struct of a chain begins with its type and a pointer to the next struct.
    unsafe {
        while let Some(&mut vk::BaseOutStructure { s_type, p_next, .. }) = next.as_mut() {
            if s_type == T::STRUCTURE_TYPE {
                switch_on(&mut *next.cast::<T>());
                return info;
            }
            next = p_next;
        }
    }
    switch_on(own);
    info.push_next(own)
}
