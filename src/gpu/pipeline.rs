//! Pipelines whose layout is read from the SPIR-V, with resources bound by name.

use super::memory::Keeper;
use super::shader::{Binding, BindingKind};
use super::{Buffer, Context, Image, Shader, device_error, pipeline_cache};
use crate::error::Result;
use ash::vk;
use std::sync::Arc;

/// What a binding's name stands for.
#[derive(Clone, Copy)]
pub enum Resource<'a> {
    Buffer(&'a Buffer),
    Image(&'a Image),
}

/// Resources by the names that the shaders use.
pub type Bindings<'a> = [(&'static str, Resource<'a>)];

/// What the rasteriser makes of the vertices.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Topology {
    Triangles,
    Points,
}

/// A compute or graphics pipeline with its one descriptor set. It keeps alive what is bound to it.
pub struct Pipeline {
    context: Arc<Context>,
    pub(super) handle: vk::Pipeline,
    pub(super) layout: vk::PipelineLayout,
    pub(super) set: vk::DescriptorSet,
    pub(super) stages: vk::ShaderStageFlags,
    pub(super) bind_point: vk::PipelineBindPoint,
    pub(super) push_bytes: u32,
    /// Threads of a workgroup; zeros for graphics.
    pub(super) local_size: [u32; 3],
    pub(super) name: &'static str,
    set_layout: vk::DescriptorSetLayout,
    pool: vk::DescriptorPool,
    bindings: Vec<&'static Binding>,
    bound: Vec<Keeper>,
}

impl Pipeline {
    /// A compute pipeline with its resources. `constant` is the specialisation constant 0, of shaders that have one.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the driver refuses.
    ///
    /// # Panics
    /// Where a binding of the shader is not among `resources`: a programmer's mistake.
    pub fn compute(
        context: &Arc<Context>,
        shader: &'static Shader,
        constant: bool,
        resources: &Bindings,
    ) -> Result<Self> {
        let stages = vk::ShaderStageFlags::COMPUTE;
        let mut pipeline =
            Self::without_handle(context, &[shader], stages, vk::PipelineBindPoint::COMPUTE)?;
        let module = Module::new(context, shader)?;
        let value = vk::Bool32::from(constant).to_ne_bytes();
        let entries = [vk::SpecializationMapEntry::default().size(value.len())];
        let constants = vk::SpecializationInfo::default()
            .map_entries(&entries)
            .data(&value);
        let stage = vk::PipelineShaderStageCreateInfo::default()
            .stage(stages)
            .module(module.handle)
            .specialization_info(&constants)
            .name(c"main");
        let info = vk::ComputePipelineCreateInfo::default()
            .stage(stage)
            .layout(pipeline.layout);
        pipeline.handle = pipeline_cache::with(context, |cache| {
            // SAFETY: module and layout are of this device.
            unsafe {
                context
                    .device
                    .create_compute_pipelines(cache, &[info], None)
            }
            .map(|handles| handles[0])
            .map_err(|(_, error)| device_error(&format!("compiling {}", pipeline.name))(error))
        })?;
        context.set_name(pipeline.handle, shader.name);
        pipeline.bind(resources);
        Ok(pipeline)
    }

    /// A pipeline that adds its fragments to one RGBA32F image, without vertex buffers.
    ///
    /// # Errors, Panics
    /// As [`Pipeline::compute`].
    pub fn graphics(
        context: &Arc<Context>,
        vertex: &'static Shader,
        fragment: &'static Shader,
        topology: Topology,
        resources: &Bindings,
    ) -> Result<Self> {
        let stages = vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT;
        let mut pipeline = Self::without_handle(
            context,
            &[vertex, fragment],
            stages,
            vk::PipelineBindPoint::GRAPHICS,
        )?;
        let modules = [
            Module::new(context, vertex)?,
            Module::new(context, fragment)?,
        ];
        let stage_flags = [vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT];
        let stage_infos = [0, 1].map(|i| {
            vk::PipelineShaderStageCreateInfo::default()
                .stage(stage_flags[i])
                .module(modules[i].handle)
                .name(c"main")
        });
        let vertex_input = vk::PipelineVertexInputStateCreateInfo::default();
        let assembly =
            vk::PipelineInputAssemblyStateCreateInfo::default().topology(match topology {
                Topology::Triangles => vk::PrimitiveTopology::TRIANGLE_LIST,
                Topology::Points => vk::PrimitiveTopology::POINT_LIST,
            });
        let viewport = vk::PipelineViewportStateCreateInfo::default()
            .viewport_count(1)
            .scissor_count(1);
        let raster = vk::PipelineRasterizationStateCreateInfo::default()
            .polygon_mode(vk::PolygonMode::FILL)
            .cull_mode(vk::CullModeFlags::NONE)
            .line_width(1.0);
        let multisample = vk::PipelineMultisampleStateCreateInfo::default()
            .rasterization_samples(vk::SampleCountFlags::TYPE_1);
        let add = [vk::PipelineColorBlendAttachmentState::default()
            .blend_enable(true)
            .src_color_blend_factor(vk::BlendFactor::ONE)
            .dst_color_blend_factor(vk::BlendFactor::ONE)
            .color_blend_op(vk::BlendOp::ADD)
            .src_alpha_blend_factor(vk::BlendFactor::ONE)
            .dst_alpha_blend_factor(vk::BlendFactor::ONE)
            .alpha_blend_op(vk::BlendOp::ADD)
            .color_write_mask(vk::ColorComponentFlags::RGBA)];
        let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&add);
        let dynamic = vk::PipelineDynamicStateCreateInfo::default()
            .dynamic_states(&[vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR]);
        let formats = [Image::FORMAT];
        let mut rendering =
            vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
        let info = vk::GraphicsPipelineCreateInfo::default()
            .stages(&stage_infos)
            .vertex_input_state(&vertex_input)
            .input_assembly_state(&assembly)
            .viewport_state(&viewport)
            .rasterization_state(&raster)
            .multisample_state(&multisample)
            .color_blend_state(&blend)
            .dynamic_state(&dynamic)
            .layout(pipeline.layout)
            .push_next(&mut rendering);
        pipeline.handle = pipeline_cache::with(context, |cache| {
            // SAFETY: modules and layout are of this device.
            unsafe {
                context
                    .device
                    .create_graphics_pipelines(cache, &[info], None)
            }
            .map(|handles| handles[0])
            .map_err(|(_, error)| device_error(&format!("compiling {}", pipeline.name))(error))
        })?;
        context.set_name(pipeline.handle, vertex.name);
        pipeline.bind(resources);
        Ok(pipeline)
    }

    fn without_handle(
        context: &Arc<Context>,
        shaders: &[&'static Shader],
        stages: vk::ShaderStageFlags,
        bind_point: vk::PipelineBindPoint,
    ) -> Result<Self> {
        let mut bindings: Vec<&'static Binding> = Vec::new();
        for binding in shaders.iter().flat_map(|shader| shader.bindings) {
            match bindings.iter().find(|b| b.index == binding.index) {
                Some(known) => assert_eq!(known.name, binding.name, "{}", shaders[0].name),
                None => bindings.push(binding),
            }
        }
        let descriptor = |kind| match kind {
            BindingKind::StorageBuffer => vk::DescriptorType::STORAGE_BUFFER,
            BindingKind::StorageImage => vk::DescriptorType::STORAGE_IMAGE,
            BindingKind::SampledImage => vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
        };
        let layout_bindings: Vec<_> = bindings
            .iter()
            .map(|binding| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding.index)
                    .descriptor_type(descriptor(binding.kind))
                    .descriptor_count(1)
                    .stage_flags(stages)
            })
            .collect();
        let push_bytes = shaders
            .iter()
            .map(|shader| shader.push_bytes)
            .max()
            .unwrap_or(0);
        let device = &context.device;
        let mut pipeline = Self {
            context: context.clone(),
            handle: vk::Pipeline::null(),
            layout: vk::PipelineLayout::null(),
            set: vk::DescriptorSet::null(),
            stages,
            bind_point,
            push_bytes,
            local_size: shaders[0].local_size,
            name: shaders[0].name,
            set_layout: vk::DescriptorSetLayout::null(),
            pool: vk::DescriptorPool::null(),
            bindings,
            bound: Vec::new(),
        };
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&layout_bindings);
        let failed = || device_error("laying out a pipeline");
        // SAFETY: a valid device; everything is destroyed in Drop.
        unsafe {
            pipeline.set_layout = device
                .create_descriptor_set_layout(&info, None)
                .map_err(failed())?;
            let set_layouts = [pipeline.set_layout];
            let ranges = [vk::PushConstantRange {
                stage_flags: stages,
                offset: 0,
                size: push_bytes,
            }];
            let ranges = if push_bytes > 0 { &ranges[..] } else { &[] };
            let info = vk::PipelineLayoutCreateInfo::default()
                .set_layouts(&set_layouts)
                .push_constant_ranges(ranges);
            pipeline.layout = device
                .create_pipeline_layout(&info, None)
                .map_err(failed())?;
            let sizes: Vec<_> = pipeline
                .bindings
                .iter()
                .map(|b| vk::DescriptorPoolSize {
                    ty: descriptor(b.kind),
                    descriptor_count: 1,
                })
                .collect();
            if !sizes.is_empty() {
                let info = vk::DescriptorPoolCreateInfo::default()
                    .max_sets(1)
                    .pool_sizes(&sizes);
                pipeline.pool = device
                    .create_descriptor_pool(&info, None)
                    .map_err(failed())?;
                let info = vk::DescriptorSetAllocateInfo::default()
                    .descriptor_pool(pipeline.pool)
                    .set_layouts(&set_layouts);
                pipeline.set = device.allocate_descriptor_sets(&info).map_err(failed())?[0];
            }
        }
        Ok(pipeline)
    }

    /// Writes the descriptor set.
    fn bind(&mut self, resources: &Bindings) {
        let mut bound = Vec::new();
        for binding in &self.bindings {
            let (_, resource) = resources
                .iter()
                .find(|(name, _)| *name == binding.name)
                .unwrap_or_else(|| panic!("{} wants {}", self.name, binding.name));
            bound.push(match resource {
                Resource::Buffer(buffer) => buffer.keeper(),
                Resource::Image(image) => image.keeper(),
            });
            let write = vk::WriteDescriptorSet::default()
                .dst_set(self.set)
                .dst_binding(binding.index);
            let (buffers, images);
            let write = match (binding.kind, resource) {
                (BindingKind::StorageBuffer, Resource::Buffer(buffer)) => {
                    buffers = [vk::DescriptorBufferInfo::default()
                        .buffer(buffer.handle)
                        .range(vk::WHOLE_SIZE)];
                    write
                        .descriptor_type(vk::DescriptorType::STORAGE_BUFFER)
                        .buffer_info(&buffers)
                }
                (BindingKind::StorageImage, Resource::Image(image)) => {
                    images = [vk::DescriptorImageInfo::default()
                        .image_view(image.view)
                        .image_layout(vk::ImageLayout::GENERAL)];
                    write
                        .descriptor_type(vk::DescriptorType::STORAGE_IMAGE)
                        .image_info(&images)
                }
                (BindingKind::SampledImage, Resource::Image(image)) => {
                    images = [vk::DescriptorImageInfo::default()
                        .image_view(image.view)
                        .sampler(image.sampler)
                        .image_layout(vk::ImageLayout::GENERAL)];
                    write
                        .descriptor_type(vk::DescriptorType::COMBINED_IMAGE_SAMPLER)
                        .image_info(&images)
                }
                _ => panic!("{}: {} is a {:?}", self.name, binding.name, binding.kind),
            };
            // SAFETY: set and resources are of this device and not in use.
            unsafe { self.context.device.update_descriptor_sets(&[write], &[]) };
        }
        self.bound = bound;
    }
}

impl Drop for Pipeline {
    fn drop(&mut self) {
        let device = &self.context.device;
        // SAFETY: submissions are waited for; null handles are allowed.
        unsafe {
            device.destroy_pipeline(self.handle, None);
            device.destroy_descriptor_pool(self.pool, None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

/// A shader module, needed only while its pipeline is made.
struct Module<'a> {
    context: &'a Context,
    handle: vk::ShaderModule,
}

impl<'a> Module<'a> {
    fn new(context: &'a Context, shader: &Shader) -> Result<Self> {
        let info = vk::ShaderModuleCreateInfo::default().code(shader.words);
        // SAFETY: SPIR-V from the compiler; destroyed in Drop.
        let handle = unsafe { context.device.create_shader_module(&info, None) }
            .map_err(device_error("loading a shader"))?;
        Ok(Self { context, handle })
    }
}

impl Drop for Module<'_> {
    fn drop(&mut self) {
        // SAFETY: pipelines do not need their modules once made.
        unsafe { self.context.device.destroy_shader_module(self.handle, None) };
    }
}
