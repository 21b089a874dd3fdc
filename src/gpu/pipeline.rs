//! Pipelines whose layout is read from the SPIR-V, and resources bound to them by name.

use super::command::{Numbered, PipelineUse};
use super::memory::{Keeper, next_number};
use super::pipelines::{Constants, Pipeline, Source, Topology};
use super::shader::{Binding, BindingKind};
use super::texel;
use super::{Buffer, Context, Image, Shader, device_error};
use crate::error::Result;
use ash::vk;
use std::sync::{Arc, Mutex};

/// What a binding's name stands for.
#[derive(Clone, Copy)]
pub enum Resource<'a> {
    Buffer(&'a Buffer),
    Image(&'a Image),
}

/// Resources by the names that the shaders use.
pub type Bindings<'a> = [(&'static str, Resource<'a>)];

/// A pipeline with its one descriptor set. It keeps alive what is bound to it.
pub struct BoundPipeline {
    context: Arc<Context>,
    pipeline: Arc<Pipeline>,
    pub(super) name: &'static str,
    set: vk::DescriptorSet,
    /// As that of [`Owned`](super::memory::Owned).
    number: u64,
    pool: vk::DescriptorPool,
    /// Views of the texel buffers.
    views: Vec<vk::BufferView>,
    _bound: Vec<Keeper>,
}

impl BoundPipeline {
    /// A compute pipeline with its resources. `constants` are the specialisation constants by
    /// their ids; a shader need not have them.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the driver refuses.
    ///
    /// # Panics
    /// Where a binding of the shader is not among `resources`: a programmer's mistake.
    pub fn compute(
        context: &Arc<Context>,
        shader: &'static Shader,
        constants: Constants,
        resources: &Bindings,
    ) -> Result<Self> {
        let source = Source {
            first: shader,
            fragment: None,
            constants,
        };
        Self::new(context, &source, resources)
    }

    /// A pipeline that draws into the images of its topology, without vertex buffers.
    ///
    /// # Errors, Panics
    /// As [`BoundPipeline::compute`].
    pub fn graphics(
        context: &Arc<Context>,
        [vertex, fragment]: [&'static Shader; 2],
        topology: Topology,
        constants: Constants,
        resources: &Bindings,
    ) -> Result<Self> {
        let source = Source {
            first: vertex,
            fragment: Some((fragment, topology)),
            constants,
        };
        Self::new(context, &source, resources)
    }

    fn new(context: &Arc<Context>, source: &Source, resources: &Bindings) -> Result<Self> {
        let mut pipelines = context.pipelines.lock().expect("no panic while held");
        #[cfg(feature = "dev")]
        let source = &pipelines.newest(source);
        let pipeline = pipelines.get(source, || Pipeline::new(context, source))?;
        drop(pipelines);
        let name = source.first.name;
        let (pool, set) = pipeline.descriptor_set(context)?;
        let mut bound = Self {
            context: context.clone(),
            pipeline,
            name,
            set,
            number: next_number(),
            pool,
            views: Vec::new(),
            _bound: Vec::new(),
        };
        bound._bound = bound.bind(resources)?;
        Ok(bound)
    }

    /// Threads of a workgroup.
    pub(super) fn local_size(&self) -> [u32; 3] {
        self.pipeline.local_size
    }

    /// For a command that uses it with these push constants.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where it is not compiled yet, and the driver refuses.
    ///
    /// # Panics
    /// Where the shaders have push constants of another size.
    pub(super) fn with(&self, push: &[u8]) -> Result<PipelineUse> {
        let pipeline = &self.pipeline;
        assert_eq!(
            push.len(),
            pipeline.push_bytes as usize,
            "push constants match the shader"
        );
        Ok(PipelineUse {
            pipeline: pipeline.handle(&self.context)?,
            layout: pipeline.layout,
            stages: pipeline.stages,
            bind_point: pipeline.bind_point,
            set: Numbered {
                handle: self.set,
                number: self.number,
            },
        })
    }

    /// Writes the descriptor set.
    fn bind(&mut self, resources: &Bindings) -> Result<Vec<Keeper>> {
        let mut bound = Vec::new();
        for binding in &self.pipeline.bindings {
            let (_, resource) = resources
                .iter()
                .find(|(name, _)| *name == binding.name)
                .unwrap_or_else(|| panic!("{} wants {}", self.name, binding.name));
            bound.push(match resource {
                Resource::Buffer(buffer) => buffer.keeper(),
                Resource::Image(image) => image.keeper(),
            });
            let kind = binding.kind.on(self.context.has_texel_buffers());
            let write = vk::WriteDescriptorSet::default()
                .dst_set(self.set)
                .dst_binding(binding.index)
                .descriptor_type(descriptor_type(kind));
            let (buffers, images, views);
            let write = match (kind, resource) {
                (BindingKind::StorageBuffer, Resource::Buffer(buffer)) => {
                    buffers = [vk::DescriptorBufferInfo::default()
                        .buffer(buffer.handle)
                        .range(vk::WHOLE_SIZE)];
                    write.buffer_info(&buffers)
                }
                (BindingKind::TexelBuffer, Resource::Buffer(buffer)) => {
                    let info = vk::BufferViewCreateInfo::default()
                        .buffer(buffer.handle)
                        .format(texel::BUFFER_FORMAT)
                        .range(buffer.bytes / texel::BUFFER_BYTES * texel::BUFFER_BYTES);
                    // SAFETY: a buffer of this device, kept alive; destroyed in Drop.
                    let view = unsafe { self.context.device.create_buffer_view(&info, None) }
                        .map_err(device_error("viewing a buffer"))?;
                    self.views.push(view);
                    views = [view];
                    write.texel_buffer_view(&views)
                }
                (BindingKind::StorageImage, Resource::Image(image)) => {
                    images = [vk::DescriptorImageInfo::default()
                        .image_view(image.view)
                        .image_layout(vk::ImageLayout::GENERAL)];
                    write.image_info(&images)
                }
                (BindingKind::SampledImage, Resource::Image(image)) => {
                    images = [vk::DescriptorImageInfo::default()
                        .image_view(image.view)
                        .sampler(image.sampler)
                        .image_layout(vk::ImageLayout::GENERAL)];
                    write.image_info(&images)
                }
                _ => panic!("{}: {} is a {:?}", self.name, binding.name, binding.kind),
            };
            // SAFETY: set and resources are of this device and not in use.
            unsafe { self.context.device.update_descriptor_sets(&[write], &[]) };
        }
        Ok(bound)
    }
}

impl Drop for BoundPipeline {
    fn drop(&mut self) {
        // SAFETY: no submission under way uses it; null handles are allowed.
        unsafe {
            (self.context.device).destroy_descriptor_pool(self.pool, None);
            for &view in &self.views {
                self.context.device.destroy_buffer_view(view, None);
            }
        }
    }
}

fn descriptor_type(kind: BindingKind) -> vk::DescriptorType {
    match kind {
        BindingKind::StorageBuffer => vk::DescriptorType::STORAGE_BUFFER,
        BindingKind::StorageImage => vk::DescriptorType::STORAGE_IMAGE,
        BindingKind::SampledImage => vk::DescriptorType::COMBINED_IMAGE_SAMPLER,
        BindingKind::TexelBuffer => vk::DescriptorType::UNIFORM_TEXEL_BUFFER,
    }
}

/// What was made of a pipeline so far, for errors half-way.
struct Unfinished<'a> {
    device: &'a ash::Device,
    set_layout: vk::DescriptorSetLayout,
    layout: vk::PipelineLayout,
}

impl Drop for Unfinished<'_> {
    fn drop(&mut self) {
        // SAFETY: nobody else knows these; null handles are allowed.
        unsafe {
            self.device.destroy_pipeline_layout(self.layout, None);
            self.device
                .destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
}

impl Pipeline {
    pub(super) fn new(context: &Arc<Context>, source: &Source) -> Result<Self> {
        let name = source.first.name;
        let (stages, bind_point) = match source.fragment {
            None => (
                vk::ShaderStageFlags::COMPUTE,
                vk::PipelineBindPoint::COMPUTE,
            ),
            Some(_) => (
                vk::ShaderStageFlags::VERTEX | vk::ShaderStageFlags::FRAGMENT,
                vk::PipelineBindPoint::GRAPHICS,
            ),
        };
        let mut bindings: Vec<&'static Binding> = Vec::new();
        for binding in source.shaders().flat_map(|shader| shader.bindings) {
            match bindings.iter().find(|b| b.index == binding.index) {
                Some(known) => assert_eq!(known.name, binding.name, "{name}"),
                None => bindings.push(binding),
            }
        }
        let layout_bindings: Vec<_> = (bindings.iter())
            .map(|binding| {
                vk::DescriptorSetLayoutBinding::default()
                    .binding(binding.index)
                    .descriptor_type(descriptor_type(
                        binding.kind.on(context.has_texel_buffers()),
                    ))
                    .descriptor_count(1)
                    .stage_flags(stages)
            })
            .collect();
        let push_bytes = (source.shaders().map(|shader| shader.push_bytes).max()).unwrap_or(0);
        let device: &ash::Device = &context.device;
        let mut made = Unfinished {
            device,
            set_layout: vk::DescriptorSetLayout::null(),
            layout: vk::PipelineLayout::null(),
        };
        let info = vk::DescriptorSetLayoutCreateInfo::default().bindings(&layout_bindings);
        let failed = || device_error("laying out a pipeline");
        // SAFETY: a valid device.
        made.set_layout =
            unsafe { device.create_descriptor_set_layout(&info, None) }.map_err(failed())?;
        let set_layouts = [made.set_layout];
        let ranges = [vk::PushConstantRange {
            stage_flags: stages,
            offset: 0,
            size: push_bytes,
        }];
        let info = vk::PipelineLayoutCreateInfo::default()
            .set_layouts(&set_layouts)
            .push_constant_ranges(if push_bytes > 0 { &ranges[..] } else { &[] });
        // SAFETY: as above.
        made.layout = unsafe { device.create_pipeline_layout(&info, None) }.map_err(failed())?;
        let Unfinished {
            set_layout, layout, ..
        } = *std::mem::ManuallyDrop::new(made);
        Ok(Self {
            source: *source,
            compiled: Mutex::default(),
            layout,
            set_layout,
            stages,
            bind_point,
            push_bytes,
            local_size: source.first.local_size,
            bindings,
        })
    }

    /// A pool with the one set; nulls where the shaders have no bindings.
    fn descriptor_set(&self, context: &Context) -> Result<(vk::DescriptorPool, vk::DescriptorSet)> {
        let device: &ash::Device = &context.device;
        if self.bindings.is_empty() {
            return Ok(Default::default());
        }
        let sizes: Vec<_> = (self.bindings.iter())
            .map(|binding| vk::DescriptorPoolSize {
                ty: descriptor_type(binding.kind.on(context.has_texel_buffers())),
                descriptor_count: 1,
            })
            .collect();
        let failed = || device_error("making a descriptor set");
        let info = vk::DescriptorPoolCreateInfo::default()
            .max_sets(1)
            .pool_sizes(&sizes);
        // SAFETY: a valid device.
        let pool = unsafe { device.create_descriptor_pool(&info, None) }.map_err(failed())?;
        let layouts = [self.set_layout];
        let info = vk::DescriptorSetAllocateInfo::default()
            .descriptor_pool(pool)
            .set_layouts(&layouts);
        // SAFETY: the pool has room for the one set.
        match unsafe { device.allocate_descriptor_sets(&info) } {
            Ok(sets) => Ok((pool, sets[0])),
            Err(error) => {
                // SAFETY: nothing uses the pool.
                unsafe { device.destroy_descriptor_pool(pool, None) };
                Err(failed()(error))
            }
        }
    }
}
