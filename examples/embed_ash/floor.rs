//! The floor of the host's picture, in a pipeline of its own that samples the light map.

use super::{Host, Result};
use ash::vk;
use glam::{DVec3, Mat4};
use gpu_allocator::MemoryLocation;
use gpu_allocator::vulkan::Allocation;
use nephroid::render::{MapImage, Output};
use nephroid::scene::{Rect, Scene};
use std::ffi::CStr;

const FORMAT: vk::Format = vk::Format::R8G8B8A8_SRGB;

/// The floor in perspective, in a pipeline that samples the light map.
pub struct FloorView {
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
    pub unsafe fn new(host: &Host, size: [u32; 2]) -> Result<Self> {
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

    pub unsafe fn draw(
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
            let point = vk::PipelineBindPoint::GRAPHICS;
            device.cmd_bind_pipeline(commands, point, self.pipeline);
            device.cmd_bind_descriptor_sets(commands, point, self.layout, 0, &[set], &[]);
            let push = push(output, scene, (floor, rect), width / height);
            let stages = vk::ShaderStageFlags::VERTEX;
            device.cmd_push_constants(commands, self.layout, stages, 0, bytemuck::bytes_of(&push));
            device.cmd_draw(commands, 6, 1, 0, 0);
            device.cmd_end_rendering(commands);
            Ok(())
        }
    }

    pub unsafe fn copy_to_host(
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
    pub fn read(&self, size: [u32; 2], texels: usize) -> Result<(Vec<u8>, Vec<[f32; 4]>)> {
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

    pub unsafe fn destroy(self, host: &Host) -> Result<()> {
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
    let (light, direct) = (&tile.light, &tile.direct);
    let [x, y] = direct
        .offset
        .map(|offset| (offset * 65535.0).round() as u32);
    let of_direct = [
        direct.scale[0],
        direct.scale[1],
        f32::from_bits(x | y << 16),
    ];
    let edges = [rect.origin, rect.edge_u, rect.edge_v].map(|v| v.as_vec3());
    Push {
        clip_from_world,
        origin_edges: [0, 1, 2].map(|i| edges[i].extend(of_direct[i]).to_array()),
        scale_offset: [
            light.scale[0],
            light.scale[1],
            light.offset[0],
            light.offset[1],
        ],
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
