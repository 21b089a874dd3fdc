//! Draws the renderer's picture to the window: exposure, tone mapping and sRGB.

use super::host::{Host, failed};
use ash::vk;
use nephroid::Result;
use nephroid::render::MapImage;

const VERTEX: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/present.vert.spv"));
const FRAGMENT: &[u8] = include_bytes!(concat!(env!("OUT_DIR"), "/present.frag.spv"));

/// The layout of `glsl/viewer/present.frag`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Push {
    size: [f32; 2],
    exposure: f32,
    encodes: u32,
}

/// The pipeline, and descriptor sets for the pictures of the frames in flight. The host destroys it with [`Present::destroy`].
pub struct Present {
    sampler: vk::Sampler,
    set_layout: vk::DescriptorSetLayout,
    layout: vk::PipelineLayout,
    pipeline: vk::Pipeline,
    pool: vk::DescriptorPool,
    /// One for each frame in flight, with the picture that it shows.
    sets: Vec<(vk::DescriptorSet, vk::ImageView)>,
    encodes: bool,
}

impl Present {
    /// For targets of `format`, in frames of which `frames` are in flight. `encodes`: the target does not encode sRGB.
    ///
    /// # Errors
    /// [`nephroid::Error::Device`] where the device fails.
    pub fn new(host: &Host, format: vk::Format, encodes: bool, frames: usize) -> Result<Self> {
        let device = &host.device;
        // SAFETY: create-infos that are valid for their calls; destroyed by the host.
        unsafe {
            let info = vk::SamplerCreateInfo::default()
                .mag_filter(vk::Filter::LINEAR)
                .min_filter(vk::Filter::LINEAR)
                .address_mode_u(vk::SamplerAddressMode::CLAMP_TO_EDGE)
                .address_mode_v(vk::SamplerAddressMode::CLAMP_TO_EDGE);
            let sampler =
                (device.create_sampler(&info, None)).map_err(failed("making a sampler"))?;
            let bindings = [vk::DescriptorSetLayoutBinding::default()
                .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
                .descriptor_count(1)
                .stage_flags(vk::ShaderStageFlags::FRAGMENT)];
            let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&bindings);
            let set_layout = (device.create_descriptor_set_layout(&info, None))
                .map_err(failed("making a descriptor layout"))?;
            let sizes = [vk::DescriptorPoolSize {
                ty: vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
                descriptor_count: frames as u32,
            }];
            let info = vk::DescriptorPoolCreateInfo::default()
                .max_sets(frames as u32)
                .pool_sizes(&sizes);
            let pool = (device.create_descriptor_pool(&info, None))
                .map_err(failed("making a descriptor pool"))?;
            let set_layouts = vec![set_layout; frames];
            let info = vk::DescriptorSetAllocateInfo::default()
                .descriptor_pool(pool)
                .set_layouts(&set_layouts);
            let sets = (device.allocate_descriptor_sets(&info))
                .map_err(failed("allocating descriptor sets"))?;
            let ranges = [vk::PushConstantRange {
                stage_flags: vk::ShaderStageFlags::FRAGMENT,
                offset: 0,
                size: size_of::<Push>() as u32,
            }];
            let info = vk::PipelineLayoutCreateInfo::default()
                .set_layouts(&set_layouts[..1])
                .push_constant_ranges(&ranges);
            let layout = (device.create_pipeline_layout(&info, None))
                .map_err(failed("making a pipeline layout"))?;
            Ok(Self {
                sampler,
                set_layout,
                layout,
                pipeline: pipeline(device, layout, format)?,
                pool,
                sets: sets
                    .into_iter()
                    .map(|set| (set, vk::ImageView::null()))
                    .collect(),
                encodes,
            })
        }
    }

    /// Records the picture, within rendering to a target of `size` pixels. The slot's last frame has ended.
    pub fn record(
        &mut self,
        host: &Host,
        commands: vk::CommandBuffer,
        slot: usize,
        picture: MapImage,
        size: [u32; 2],
        exposure_ev: f64,
    ) {
        let device = &host.device;
        let (set, shown) = &mut self.sets[slot];
        let [width, height] = size.map(|side| side as f32);
        let push = Push {
            size: [width, height],
            exposure: exposure_ev.exp2() as f32,
            encodes: self.encodes.into(),
        };
        // SAFETY: the command buffer is recording, and the set is not in use.
        unsafe {
            if *shown != picture.view {
                let images = [vk::DescriptorImageInfo {
                    sampler: self.sampler,
                    image_view: picture.view,
                    image_layout: picture.layout,
                }];
                let write = vk::WriteDescriptorSet::default()
                    .dst_set(*set)
                    .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
                    .image_info(&images);
                device.update_descriptor_sets(&[write], &[]);
                *shown = picture.view;
            }
            let viewport = vk::Viewport {
                width,
                height,
                max_depth: 1.0,
                ..Default::default()
            };
            device.cmd_set_viewport(commands, 0, &[viewport]);
            device.cmd_set_scissor(commands, 0, &[whole(size)]);
            let point = vk::PipelineBindPoint::GRAPHICS;
            device.cmd_bind_pipeline(commands, point, self.pipeline);
            device.cmd_bind_descriptor_sets(commands, point, self.layout, 0, &[*set], &[]);
            let stages = vk::ShaderStageFlags::FRAGMENT;
            device.cmd_push_constants(commands, self.layout, stages, 0, bytemuck::bytes_of(&push));
            device.cmd_draw(commands, 3, 1, 0, 0);
        }
    }

    /// Forgets which pictures are bound: a new renderer may have other images behind equal handles.
    pub fn forget_pictures(&mut self) {
        for (_, shown) in &mut self.sets {
            *shown = vk::ImageView::null();
        }
    }

    /// The device must be idle.
    pub fn destroy(&self, host: &Host) {
        let device = &host.device;
        // SAFETY: the device is idle.
        unsafe {
            device.destroy_pipeline(self.pipeline, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_pool(self.pool, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
            device.destroy_sampler(self.sampler, None);
        }
    }
}

/// All of a target.
pub fn whole([width, height]: [u32; 2]) -> vk::Rect2D {
    vk::Rect2D {
        offset: Default::default(),
        extent: vk::Extent2D { width, height },
    }
}

unsafe fn pipeline(
    device: &ash::Device,
    layout: vk::PipelineLayout,
    format: vk::Format,
) -> Result<vk::Pipeline> {
    let module = |bytes: &[u8]| -> Result<vk::ShaderModule> {
        let words =
            ash::util::read_spv(&mut std::io::Cursor::new(bytes)).expect("SPIR-V of the compiler");
        let info = vk::ShaderModuleCreateInfo::default().code(&words);
        // SAFETY: SPIR-V of the compiler.
        unsafe { device.create_shader_module(&info, None) }.map_err(failed("loading a shader"))
    };
    let modules = [module(VERTEX)?, module(FRAGMENT)?];
    let stages = [vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT];
    let stages = [0, 1].map(|i| {
        vk::PipelineShaderStageCreateInfo::default()
            .stage(stages[i])
            .module(modules[i])
            .name(c"main")
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
    let formats = [format];
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
        Ok(made.map_err(|(_, error)| failed("compiling the window's pipeline")(error))?[0])
    }
}
