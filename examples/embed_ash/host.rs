//! The host: instance, device, queue, allocator and command buffers, all its own.

#[path = "floor.rs"]
mod floor;

use ash::{ext, vk};
use floor::FloorView;
use glam::{DMat3, DVec3};
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{
    Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc,
};
use nephroid::gpu::{Context, External, Messages};
use nephroid::render::{Frame, Renderer, Settings};
use nephroid::scene::{Geometry, Scene, Similarity};
use std::error::Error;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Instant;

const FRAMES_IN_FLIGHT: usize = 2;

type Result<T> = std::result::Result<T, Box<dyn Error>>;

/// What [`render`] made.
#[allow(dead_code)] // a test uses all of it
pub struct Rendered {
    /// The last frame, sRGB and alpha.
    pub picture: Vec<u8>,
    /// All of the last light map, RGBA.
    pub light_map: Vec<[f32; 4]>,
    /// What the validation layers said.
    pub messages: Vec<String>,
    /// Time that recording a caustic took, s: median and longest, without the first frame.
    pub record_seconds: [f64; 2],
}

/// The scene of frame number `frame`: its ring spins like a coin that was spun on a table.
pub fn scene_at(still: &Scene, frame: u32) -> Scene {
    let mut scene = still.clone();
    let ring = scene.object_index("ring").expect("the scene has a ring");
    let angle = f64::from(frame) * 3f64.to_radians();
    let rotation = DMat3::from_rotation_y(angle) * DMat3::from_rotation_x(0.3);
    let spin = Similarity {
        scale: 1.0,
        rotation,
        shift: DVec3::new(0.0, 0.25, 0.0),
    };
    scene.objects[ring].geometry = scene.objects[ring].geometry.moved(&spin);
    scene
}

/// The ring's scene, of which only the floor keeps light.
pub fn scene() -> Result<Scene> {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/ring.toml");
    let mut scene = nephroid::scene::load(&file)?.scene;
    for object in &mut scene.objects {
        object.light_map = (object.name == "floor").then_some([256, 256]);
    }
    Ok(scene)
}

/// Renders `frames` frames of a scene and reads the last one back.
pub fn render(
    still: &Scene,
    settings: &Settings,
    size: [u32; 2],
    frames: u32,
    validate: bool,
) -> Result<Rendered> {
    let messages = Messages::default();
    let (picture, light_map, record_seconds) = {
        let host = Host::new(validate.then_some(&messages))?;
        // SAFETY: the handles are the host's, made with what the requirements name, and the renderer goes before them.
        let context = unsafe { Context::from_raw(host.external()) }?;
        let settings = Settings {
            frames_in_flight: FRAMES_IN_FLIGHT as u32,
            ..settings.clone()
        };
        let mut renderer = Renderer::new(&context, &scene_at(still, 0), &settings)?;
        host.run(&mut renderer, still, size, frames)?
    };
    Ok(Rendered {
        picture,
        light_map,
        messages: messages.take(),
        record_seconds,
    })
}

/// Lends a device of a host, as often as it is asked for.
#[allow(dead_code)] // for a test
pub fn with_external(use_it: impl FnOnce(&dyn Fn() -> External)) {
    let host = Host::new(None).expect("a host");
    use_it(&|| host.external());
}

/// Lends a device of a host with a command buffer that is recording.
#[allow(dead_code)] // for a test
pub fn with_commands(use_it: impl FnOnce(External, vk::CommandBuffer)) {
    let host = Host::new(None).expect("a host");
    // SAFETY: the pool goes when nobody records any more; nothing was submitted.
    unsafe {
        let info = vk::CommandPoolCreateInfo::default().queue_family_index(host.queue_family);
        let pool = host
            .device
            .create_command_pool(&info, None)
            .expect("a pool");
        let info = vk::CommandBufferAllocateInfo::default()
            .command_pool(pool)
            .command_buffer_count(1);
        let buffers = host
            .device
            .allocate_command_buffers(&info)
            .expect("a buffer");
        let begin = vk::CommandBufferBeginInfo::default();
        host.device
            .begin_command_buffer(buffers[0], &begin)
            .expect("begun");
        use_it(host.external(), buffers[0]);
        host.device.destroy_command_pool(pool, None);
    }
}

struct Host {
    // Dropped by hand, in this order.
    allocator: Option<Arc<Mutex<Allocator>>>,
    device: ash::Device,
    queue: vk::Queue,
    queue_family: u32,
    physical: vk::PhysicalDevice,
    messenger: Option<(ext::debug_utils::Instance, vk::DebugUtilsMessengerEXT)>,
    instance: ash::Instance,
    entry: ash::Entry,
}

impl Host {
    /// With the validation layers where their messages are wanted; `messages` outlives the host.
    fn new(messages: Option<&Messages>) -> Result<Self> {
        let needed = Context::requirements();
        // SAFETY: all create-infos are valid for the calls that they are passed to.
        unsafe {
            let entry = ash::Entry::load()?;
            let application = vk::ApplicationInfo::default().api_version(needed.api_version);
            let layers = [c"VK_LAYER_KHRONOS_validation".as_ptr()];
            let extensions = [ext::debug_utils::NAME.as_ptr()];
            let enabled = [
                vk::ValidationFeatureEnableEXT::SYNCHRONIZATION_VALIDATION,
                vk::ValidationFeatureEnableEXT::GPU_ASSISTED,
                vk::ValidationFeatureEnableEXT::GPU_ASSISTED_RESERVE_BINDING_SLOT,
            ];
            let mut checks =
                vk::ValidationFeaturesEXT::default().enabled_validation_features(&enabled);
            let mut info = vk::InstanceCreateInfo::default().application_info(&application);
            if messages.is_some() {
                info = info
                    .enabled_layer_names(&layers)
                    .enabled_extension_names(&extensions)
                    .push_next(&mut checks);
            }
            let instance = entry.create_instance(&info, None)?;
            let messenger = match messages {
                None => None,
                Some(messages) => {
                    let utils = ext::debug_utils::Instance::new(&entry, &instance);
                    let info = messages.messenger_info();
                    let messenger = utils.create_debug_utils_messenger(&info, None)?;
                    Some((utils, messenger))
                }
            };
            let (physical, queue_family) = choose(&instance, needed.queue_flags)?;
            let supported = instance.get_physical_device_features(physical);
            // For GPU-assisted validation.
            let features = vk::PhysicalDeviceFeatures::default()
                .fragment_stores_and_atomics(supported.fragment_stores_and_atomics != 0)
                .vertex_pipeline_stores_and_atomics(
                    supported.vertex_pipeline_stores_and_atomics != 0,
                );
            let mut v13 = needed.features;
            let queues = [vk::DeviceQueueCreateInfo::default()
                .queue_family_index(queue_family)
                .queue_priorities(&[1.0])];
            let extensions: Vec<_> = needed.extensions.iter().map(|name| name.as_ptr()).collect();
            let info = vk::DeviceCreateInfo::default()
                .queue_create_infos(&queues)
                .enabled_extension_names(&extensions)
                .enabled_features(&features)
                .push_next(&mut v13);
            let device = instance.create_device(physical, &info, None)?;
            let allocator = Allocator::new(&AllocatorCreateDesc {
                instance: instance.clone(),
                device: device.clone(),
                physical_device: physical,
                debug_settings: Default::default(),
                buffer_device_address: false,
                allocation_sizes: Default::default(),
            })?;
            Ok(Self {
                allocator: Some(Arc::new(Mutex::new(allocator))),
                queue: device.get_device_queue(queue_family, 0),
                device,
                queue_family,
                physical,
                messenger,
                instance,
                entry,
            })
        }
    }

    /// What nephroid is told.
    fn external(&self) -> External {
        let made_with = Context::requirements();
        External {
            entry: self.entry.clone(),
            instance: self.instance.clone(),
            physical_device: self.physical,
            device: self.device.clone(),
            queue_family: self.queue_family,
            api_version: made_with.api_version,
            features: made_with.features,
            allocator: self.allocator.clone(),
        }
    }

    fn allocate(
        &self,
        name: &str,
        requirements: vk::MemoryRequirements,
        location: MemoryLocation,
    ) -> Result<Allocation> {
        let allocator = self.allocator.as_ref().expect("until it is dropped");
        Ok(allocator
            .lock()
            .expect("no panic while held")
            .allocate(&AllocationCreateDesc {
                name,
                requirements,
                location,
                linear: location != MemoryLocation::GpuOnly,
                allocation_scheme: AllocationScheme::GpuAllocatorManaged,
            })?)
    }

    fn free(&self, allocation: Allocation) -> Result<()> {
        let allocator = self.allocator.as_ref().expect("until it is dropped");
        Ok(allocator
            .lock()
            .expect("no panic while held")
            .free(allocation)?)
    }

    /// Renders the frames; the last picture and light map, and the time that recording took.
    #[allow(clippy::type_complexity)]
    fn run(
        &self,
        renderer: &mut Renderer,
        still: &Scene,
        size: [u32; 2],
        frames: u32,
    ) -> Result<(Vec<u8>, Vec<[f32; 4]>, [f64; 2])> {
        let device = &self.device;
        let floor = still.object_index("floor").expect("the scene has a floor");
        let Geometry::Rect(rect) = &still.objects[floor].geometry else {
            return Err("the floor is no rectangle".into());
        };
        // SAFETY: everything is of this device, and is destroyed once the queue is idle.
        unsafe {
            let pool_info = vk::CommandPoolCreateInfo::default()
                .queue_family_index(self.queue_family)
                .flags(vk::CommandPoolCreateFlags::RESET_COMMAND_BUFFER);
            let pool = device.create_command_pool(&pool_info, None)?;
            let info = vk::CommandBufferAllocateInfo::default()
                .command_pool(pool)
                .command_buffer_count(FRAMES_IN_FLIGHT as u32);
            let buffers = device.allocate_command_buffers(&info)?;
            let signalled = vk::FenceCreateInfo::default().flags(vk::FenceCreateFlags::SIGNALED);
            let fences = [
                device.create_fence(&signalled, None)?,
                device.create_fence(&signalled, None)?,
            ];
            let mut view = FloorView::new(self, size)?;
            // What blocks direct light moves in every frame, and needs no more texels than the caustic.
            renderer.set_direct_halvings(2);
            let mut seconds = Vec::new();
            let mut map_size = [0; 2];
            for frame in 0..frames {
                let slot = frame as usize % FRAMES_IN_FLIGHT;
                let (commands, fence) = (buffers[slot], fences[slot]);
                // The frame that used this slot before is through, which is what `record` asks for.
                device.wait_for_fences(&[fence], true, u64::MAX)?;
                device.reset_fences(&[fence])?;
                let once = vk::CommandBufferBeginInfo::default()
                    .flags(vk::CommandBufferUsageFlags::ONE_TIME_SUBMIT);
                device.begin_command_buffer(commands, &once)?;

                let scene = scene_at(still, frame);
                let start = Instant::now();
                let wanted = Frame {
                    scene: &scene,
                    direct: true,
                    view: None,
                };
                let output = renderer.record(commands, &wanted)?;
                seconds.push(start.elapsed().as_secs_f64());
                map_size = output.light_map.size;
                view.draw(self, commands, &output, still, (floor, rect))?;
                if frame + 1 == frames {
                    view.copy_to_host(self, commands, &output)?;
                }

                device.end_command_buffer(commands)?;
                let infos = [vk::CommandBufferSubmitInfo::default().command_buffer(commands)];
                let submit = [vk::SubmitInfo2::default().command_buffer_infos(&infos)];
                device.queue_submit2(self.queue, &submit, fence)?;
            }
            device.device_wait_idle()?;
            let texels = map_size[0] as usize * map_size[1] as usize;
            let (picture, light_map) = view.read(size, texels)?;
            view.destroy(self)?;
            fences
                .iter()
                .for_each(|fence| device.destroy_fence(*fence, None));
            device.destroy_command_pool(pool, None);
            let mut later = seconds.split_off(1.min(seconds.len() - 1));
            later.sort_by(f64::total_cmp);
            Ok((
                picture,
                light_map,
                [later[later.len() / 2], later[later.len() - 1]],
            ))
        }
    }
}

impl Drop for Host {
    fn drop(&mut self) {
        self.allocator = None;
        // SAFETY: nothing made from them is left.
        unsafe {
            self.device.destroy_device(None);
            if let Some((utils, messenger)) = &self.messenger {
                utils.destroy_debug_utils_messenger(*messenger, None);
            }
            self.instance.destroy_instance(None);
        }
    }
}

/// The first device with such a queue.
unsafe fn choose(
    instance: &ash::Instance,
    flags: vk::QueueFlags,
) -> Result<(vk::PhysicalDevice, u32)> {
    // SAFETY: a valid instance and its devices.
    unsafe {
        for physical in instance.enumerate_physical_devices()? {
            let families = instance.get_physical_device_queue_family_properties(physical);
            if let Some(family) = (families.iter()).position(|f| f.queue_flags.contains(flags)) {
                return Ok((physical, family as u32));
            }
        }
    }
    Err("no Vulkan device has a queue for graphics and compute".into())
}
