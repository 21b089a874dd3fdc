//! The host: instance, device, queue, allocator, command buffers and a pipeline, all its own.

use ash::{ext, vk};
use glam::{DMat3, DVec3, Mat4};
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::{
    Allocation, AllocationCreateDesc, AllocationScheme, Allocator, AllocatorCreateDesc,
};
use nephroid::gpu::{Context, External, Messages};
use nephroid::render::{Frame, MapImage, Output, Renderer, Settings};
use nephroid::scene::{Geometry, Rect, Scene, Similarity};
use std::error::Error;
use std::ffi::CStr;
use std::path::Path;
use std::sync::{Arc, Mutex};
use std::time::Instant;

const FRAMES_IN_FLIGHT: usize = 2;
const FORMAT: vk::Format = vk::Format::R8G8B8A8_SRGB;

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

/// Renders `frames` frames and reads the last one back.
pub fn render(size: [u32; 2], frames: u32, validate: bool) -> Result<Rendered> {
    let still = scene()?;
    let messages = Messages::default();
    let (picture, light_map, record_seconds) = {
        let host = Host::new(validate.then_some(&messages))?;
        // SAFETY: the handles are the host's, made with what the requirements name, and the renderer goes before them.
        let context = unsafe { Context::from_raw(host.external()) }?;
        let settings = Settings {
            frames_in_flight: FRAMES_IN_FLIGHT as u32,
            ..Settings::default()
        };
        let mut renderer = Renderer::new(&context, &scene_at(&still, 0), &settings)?;
        host.run(&mut renderer, &still, size, frames)?
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

/// The floor in perspective, in a pipeline that samples the light map.
struct FloorView {
    color: vk::Image,
    color_view: vk::ImageView,
    sampler: vk::Sampler,
    set_layout: vk::DescriptorSetLayout,
    layout: vk::PipelineLayout,
    pipeline: vk::Pipeline,
    descriptors: vk::DescriptorPool,
    /// Written at the first frame: the maps stay the same.
    set: Option<vk::DescriptorSet>,
    size: [u32; 2],
    /// Of picture and light map.
    read_back: Vec<(vk::Buffer, Allocation)>,
    memory: Vec<Allocation>,
}

#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Push {
    clip_from_world: Mat4,
    origin_edges: [[f32; 4]; 3],
    scale_offset: [f32; 4],
}

impl FloorView {
    unsafe fn new(host: &Host, size: [u32; 2]) -> Result<Self> {
        let device = &host.device;
        // SAFETY: create-infos that are valid for their calls.
        unsafe {
            let info = vk::ImageCreateInfo::default()
                .image_type(vk::ImageType::TYPE_2D)
                .format(FORMAT)
                .extent(extent(size))
                .mip_levels(1)
                .array_layers(1)
                .samples(vk::SampleCountFlags::TYPE_1)
                .usage(vk::ImageUsageFlags::COLOR_ATTACHMENT | vk::ImageUsageFlags::TRANSFER_SRC);
            let color = device.create_image(&info, None)?;
            let requirements = device.get_image_memory_requirements(color);
            let memory = host.allocate("picture", requirements, MemoryLocation::GpuOnly)?;
            device.bind_image_memory(color, memory.memory(), memory.offset())?;
            let info = vk::ImageViewCreateInfo::default()
                .image(color)
                .view_type(vk::ImageViewType::TYPE_2D)
                .format(FORMAT)
                .subresource_range(color_range());
            let color_view = device.create_image_view(&info, None)?;
            let info = vk::SamplerCreateInfo::default()
                .mag_filter(vk::Filter::LINEAR)
                .min_filter(vk::Filter::LINEAR)
                .address_mode_u(vk::SamplerAddressMode::CLAMP_TO_EDGE)
                .address_mode_v(vk::SamplerAddressMode::CLAMP_TO_EDGE);
            let sampler = device.create_sampler(&info, None)?;

            let bindings = [0, 1].map(|binding| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding)
                    .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
                    .descriptor_count(1)
                    .stage_flags(vk::ShaderStageFlags::FRAGMENT)
            });
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
            let set_layout = device.create_descriptor_set_layout(&info, None)?;
            let sizes = [vk::DescriptorPoolSize {
                ty: vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
                descriptor_count: 2,
            }];
            let info = vk::DescriptorPoolCreateInfo::default()
                .max_sets(1)
                .pool_sizes(&sizes);
            let descriptors = device.create_descriptor_pool(&info, None)?;
            let set_layouts = [set_layout];
            let ranges = [vk::PushConstantRange {
                stage_flags: vk::ShaderStageFlags::VERTEX,
                offset: 0,
                size: size_of::<Push>() as u32,
            }];
            let info = vk::PipelineLayoutCreateInfo::default()
                .set_layouts(&set_layouts)
                .push_constant_ranges(&ranges);
            let layout = device.create_pipeline_layout(&info, None)?;
            Ok(Self {
                color,
                color_view,
                sampler,
                set_layout,
                layout,
                pipeline: pipeline(device, layout)?,
                descriptors,
                set: None,
                size,
                read_back: Vec::new(),
                memory: vec![memory],
            })
        }
    }

    unsafe fn descriptor_set(
        &mut self,
        host: &Host,
        maps: [MapImage; 2],
    ) -> Result<vk::DescriptorSet> {
        if let Some(set) = self.set {
            return Ok(set);
        }
        let device = &host.device;
        let layouts = [self.set_layout];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(self.descriptors)
            .set_layouts(&layouts);
        // SAFETY: the pool has room, and the images live as long as the renderer.
        let set = unsafe { device.allocate_descriptor_sets(&info) }?[0];
        for (binding, map) in maps.iter().enumerate() {
            let images = [vk::DescriptorImageInfo {
                sampler: self.sampler,
                image_view: map.view,
                image_layout: map.layout,
            }];
            let write = vk::WriteDescriptorSet::default()
                .dst_set(set)
                .dst_binding(binding as u32)
                .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
                .image_info(&images);
            // SAFETY: as above.
            unsafe { device.update_descriptor_sets(&[write], &[]) };
        }
        self.set = Some(set);
        Ok(set)
    }

    unsafe fn draw(
        &mut self,
        host: &Host,
        commands: vk::CommandBuffer,
        output: &Output,
        scene: &Scene,
        (floor, rect): (usize, &Rect),
    ) -> Result<()> {
        let device = &host.device;
        // SAFETY: a recording command buffer; all it refers to lives until the queue is idle.
        unsafe {
            let set = self.descriptor_set(host, [output.light_map, output.direct_map])?;
            // The floor's pixels wait for the maps, and the picture's for those of the frame before.
            let maps = [vk::MemoryBarrier2::default()
                .src_stage_mask(output.last_stage)
                .src_access_mask(output.last_access)
                .dst_stage_mask(vk::PipelineStageFlags2::FRAGMENT_SHADER)
                .dst_access_mask(vk::AccessFlags2::SHADER_READ)];
            let attachment = [vk::ImageMemoryBarrier2::default()
                .src_stage_mask(vk::PipelineStageFlags2::ALL_COMMANDS)
                .src_access_mask(vk::AccessFlags2::MEMORY_WRITE)
                .dst_stage_mask(vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT)
                .dst_access_mask(vk::AccessFlags2::COLOR_ATTACHMENT_WRITE)
                .new_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
                .image(self.color)
                .subresource_range(color_range())];
            let dependency = vk::DependencyInfo::default()
                .memory_barriers(&maps)
                .image_memory_barriers(&attachment);
            device.cmd_pipeline_barrier2(commands, &dependency);

            let area = vk::Rect2D {
                offset: Default::default(),
                extent: vk::Extent2D {
                    width: self.size[0],
                    height: self.size[1],
                },
            };
            let attachments = [vk::RenderingAttachmentInfo::default()
                .image_view(self.color_view)
                .image_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
                .load_op(vk::AttachmentLoadOp::CLEAR)
                .store_op(vk::AttachmentStoreOp::STORE)];
            let info = vk::RenderingInfo::default()
                .render_area(area)
                .layer_count(1)
                .color_attachments(&attachments);
            device.cmd_begin_rendering(commands, &info);
            let [width, height] = self.size.map(|side| side as f32);
            let viewport = vk::Viewport {
                width,
                height,
                max_depth: 1.0,
                ..Default::default()
            };
            device.cmd_set_viewport(commands, 0, &[viewport]);
            device.cmd_set_scissor(commands, 0, &[area]);
            device.cmd_bind_pipeline(commands, vk::PipelineBindPoint::GRAPHICS, self.pipeline);
            let point = vk::PipelineBindPoint::GRAPHICS;
            device.cmd_bind_descriptor_sets(commands, point, self.layout, 0, &[set], &[]);
            let push = push(output, scene, (floor, rect), width / height);
            let stages = vk::ShaderStageFlags::VERTEX;
            device.cmd_push_constants(commands, self.layout, stages, 0, bytemuck::bytes_of(&push));
            device.cmd_draw(commands, 6, 1, 0, 0);
            device.cmd_end_rendering(commands);
            Ok(())
        }
    }

    unsafe fn copy_to_host(
        &mut self,
        host: &Host,
        commands: vk::CommandBuffer,
        output: &Output,
    ) -> Result<()> {
        let device = &host.device;
        // SAFETY: as in `draw`.
        unsafe {
            let barrier = [vk::ImageMemoryBarrier2::default()
                .src_stage_mask(vk::PipelineStageFlags2::COLOR_ATTACHMENT_OUTPUT)
                .src_access_mask(vk::AccessFlags2::COLOR_ATTACHMENT_WRITE)
                .dst_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
                .dst_access_mask(vk::AccessFlags2::TRANSFER_READ)
                .old_layout(vk::ImageLayout::COLOR_ATTACHMENT_OPTIMAL)
                .new_layout(vk::ImageLayout::TRANSFER_SRC_OPTIMAL)
                .image(self.color)
                .subresource_range(color_range())];
            let map = [vk::MemoryBarrier2::default()
                .src_stage_mask(output.last_stage)
                .src_access_mask(output.last_access)
                .dst_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
                .dst_access_mask(vk::AccessFlags2::TRANSFER_READ)];
            let dependency = vk::DependencyInfo::default()
                .image_memory_barriers(&barrier)
                .memory_barriers(&map);
            device.cmd_pipeline_barrier2(commands, &dependency);
            let light_map = output.light_map;
            for (image, layout, size, texel) in [
                (
                    self.color,
                    vk::ImageLayout::TRANSFER_SRC_OPTIMAL,
                    self.size,
                    4,
                ),
                (light_map.image, light_map.layout, light_map.size, 16),
            ] {
                let bytes = u64::from(size[0]) * u64::from(size[1]) * texel;
                let info = vk::BufferCreateInfo::default()
                    .size(bytes)
                    .usage(vk::BufferUsageFlags::TRANSFER_DST);
                let buffer = device.create_buffer(&info, None)?;
                let requirements = device.get_buffer_memory_requirements(buffer);
                let memory = host.allocate("read back", requirements, MemoryLocation::GpuToCpu)?;
                device.bind_buffer_memory(buffer, memory.memory(), memory.offset())?;
                let region = [vk::BufferImageCopy::default()
                    .image_subresource(
                        vk::ImageSubresourceLayers::default()
                            .aspect_mask(vk::ImageAspectFlags::COLOR)
                            .layer_count(1),
                    )
                    .image_extent(extent(size))];
                device.cmd_copy_image_to_buffer(commands, image, layout, buffer, &region);
                self.read_back.push((buffer, memory));
            }
            let to_host = [vk::MemoryBarrier2::default()
                .src_stage_mask(vk::PipelineStageFlags2::ALL_TRANSFER)
                .src_access_mask(vk::AccessFlags2::TRANSFER_WRITE)
                .dst_stage_mask(vk::PipelineStageFlags2::HOST)
                .dst_access_mask(vk::AccessFlags2::HOST_READ)];
            let dependency = vk::DependencyInfo::default().memory_barriers(&to_host);
            device.cmd_pipeline_barrier2(commands, &dependency);
            Ok(())
        }
    }

    /// What was copied, once the queue is idle.
    fn read(&self, size: [u32; 2], texels: usize) -> Result<(Vec<u8>, Vec<[f32; 4]>)> {
        let [(_, picture), (_, light_map)] = &self.read_back[..] else {
            return Err("nothing was copied to the host".into());
        };
        let mapped = |memory: &Allocation, bytes: usize| -> Result<Vec<u8>> {
            Ok(memory.mapped_slice().ok_or("host memory is mapped")?[..bytes].to_vec())
        };
        let picture = mapped(picture, 4 * size[0] as usize * size[1] as usize)?;
        let light_map = bytemuck::pod_collect_to_vec(&mapped(light_map, 16 * texels)?);
        Ok((picture, light_map))
    }

    unsafe fn destroy(self, host: &Host) -> Result<()> {
        let device = &host.device;
        // SAFETY: the queue is idle.
        unsafe {
            for (buffer, memory) in self.read_back {
                device.destroy_buffer(buffer, None);
                host.free(memory)?;
            }
            device.destroy_pipeline(self.pipeline, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_pool(self.descriptors, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
            device.destroy_sampler(self.sampler, None);
            device.destroy_image_view(self.color_view, None);
            device.destroy_image(self.color, None);
        }
        self.memory
            .into_iter()
            .try_for_each(|memory| host.free(memory))
    }
}

/// The camera of the scene, and where the floor and its light are.
fn push(output: &Output, scene: &Scene, (floor, rect): (usize, &Rect), aspect: f32) -> Push {
    let camera = &scene.camera;
    let forward = (camera.target - camera.position).normalize();
    let right = forward.cross(DVec3::Y).normalize();
    let down = forward.cross(right); // y is down in Vulkan
    let scale = 1.0 / (0.5 * camera.fov).tan();
    // Depth from near to far in 0..1, by the w of the position, which is the distance along `forward`.
    let (near, far) = (0.1, 100.0);
    let rows = [
        right * scale / f64::from(aspect),
        down * scale,
        forward * far / (far - near),
        forward,
    ];
    let shift = [0.0, 0.0, -near * far / (far - near), 0.0];
    let row = |i: usize| {
        rows[i]
            .extend(shift[i] - rows[i].dot(camera.position))
            .as_vec4()
    };
    let clip_from_world = Mat4::from_cols(row(0), row(1), row(2), row(3)).transpose();
    let tile = (output.receivers.iter().find(|tile| tile.object == floor)).expect("a receiver");
    let albedo = [0.62, 0.47, 0.33];
    let edges = [rect.origin, rect.edge_u, rect.edge_v].map(|v| v.as_vec3());
    Push {
        clip_from_world,
        origin_edges: [0, 1, 2].map(|i| edges[i].extend(albedo[i]).to_array()),
        scale_offset: [tile.scale[0], tile.scale[1], tile.offset[0], tile.offset[1]],
    }
}

fn extent([width, height]: [u32; 2]) -> vk::Extent3D {
    vk::Extent3D {
        width,
        height,
        depth: 1,
    }
}

fn color_range() -> vk::ImageSubresourceRange {
    vk::ImageSubresourceRange::default()
        .aspect_mask(vk::ImageAspectFlags::COLOR)
        .level_count(1)
        .layer_count(1)
}

unsafe fn pipeline(device: &ash::Device, layout: vk::PipelineLayout) -> Result<vk::Pipeline> {
    const VERTEX: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/floor.vert.spv"));
    const FRAGMENT: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/floor.frag.spv"));
    const MAIN: &CStr = c"main";
    let module = |bytes: &[u8]| -> Result<vk::ShaderModule> {
        let words = ash::util::read_spv(&mut std::io::Cursor::new(bytes))?;
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: SPIR-V of the compiler.
        Ok(unsafe { device.create_shader_module(&info, None) }?)
    };
    let modules = [module(VERTEX)?, module(FRAGMENT)?];
    let stages = [vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT];
    let stages = [0, 1].map(|i| {
        vk::PipelineShaderStageCreateInfo::default()
            .stage(stages[i])
            .module(modules[i])
            .name(MAIN)
    });
    let vertex_input = vk::PipelineVertexInputStateCreateInfo::default();
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default()
        .topology(vk::PrimitiveTopology::TRIANGLE_LIST);
    let viewport = vk::PipelineViewportStateCreateInfo::default()
        .viewport_count(1)
        .scissor_count(1);
    let raster = vk::PipelineRasterizationStateCreateInfo::default().line_width(1.0);
    let multisample = vk::PipelineMultisampleStateCreateInfo::default()
        .rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let attachments = [vk::PipelineColorBlendAttachmentState::default()
        .color_write_mask(vk::ColorComponentFlags::RGBA)];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&attachments);
    let dynamic = vk::PipelineDynamicStateCreateInfo::default()
        .dynamic_states(&[vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR]);
    let formats = [FORMAT];
    let mut rendering =
        vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
    let info = vk::GraphicsPipelineCreateInfo::default()
        .stages(&stages)
        .vertex_input_state(&vertex_input)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&multisample)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(layout)
        .push_next(&mut rendering);
    // SAFETY: modules and layout are of this device; modules are not needed afterwards.
    unsafe {
        let made = device.create_graphics_pipelines(vk::PipelineCache::null(), &[info], None);
        modules
            .iter()
            .for_each(|module| device.destroy_shader_module(*module, None));
        Ok(made.map_err(|(_, error)| error)?[0])
    }
}
