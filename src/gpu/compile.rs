//! Compiled pipelines from SPIR-V.

use super::host_memory::DRIVER_STACK;
use super::pipelines::{CONSTANTS, Constants, Pipeline, Source, Topology};
use super::texel::Texel;
use super::{Context, Shader, device_error};
use crate::error::Result;
use ash::vk;
use std::cmp::Reverse;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::thread;

impl Context {
    /// Compiles the pipelines that were made since the last call, on all processors. One that a frame needs before is
    /// compiled when the frame is recorded.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the driver refuses.
    pub fn compile_pipelines(&self) -> Result<()> {
        let mut new = {
            let mut pipelines = self.pipelines.lock().expect("no panic while held");
            std::mem::take(&mut pipelines.new)
        };
        if new.is_empty() {
            return Ok(());
        }
        // The longest ones first, so that all processors end at about the same time.
        let words = |pipeline: &Arc<Pipeline>| -> usize {
            let shaders = pipeline.source.shaders();
            shaders.map(|shader| shader.words.len()).sum()
        };
        new.sort_by_key(|pipeline| Reverse(words(pipeline)));
        let next = AtomicUsize::new(0);
        let compile = || {
            while let Some(pipeline) = new.get(next.fetch_add(1, Ordering::Relaxed)) {
                pipeline.handle(self)?;
            }
            Ok(())
        };
        let processors = thread::available_parallelism().map_or(1, |number| number.get());
        thread::scope(|scope| {
            // Where no thread can be started, the others compile its share.
            let threads: Vec<_> = (1..processors.min(new.len()))
                .map_while(|_| {
                    thread::Builder::new()
                        .stack_size(DRIVER_STACK)
                        .spawn_scoped(scope, compile)
                        .ok()
                })
                .collect();
            let results = threads
                .into_iter()
                .map(|thread| thread.join().expect("no panic in a driver's thread"));
            results.fold(compile(), |all, one| all.and(one))
        })
    }
}

impl Pipeline {
    /// Compiles it where nobody has done so yet.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the driver refuses.
    pub(super) fn handle(&self, context: &Context) -> Result<vk::Pipeline> {
        let mut compiled = self.compiled.lock().expect("no panic while held");
        if *compiled == vk::Pipeline::null() {
            *compiled = compile(context, &self.source, self.layout)?;
            context.set_name(*compiled, self.source.first.name);
        }
        Ok(*compiled)
    }
}

fn specialization_entries() -> [vk::SpecializationMapEntry; CONSTANTS] {
    let size = size_of::<vk::Bool32>();
    std::array::from_fn(|id| {
        vk::SpecializationMapEntry::default()
            .constant_id(id as u32)
            .offset((id * size) as u32)
            .size(size)
    })
}

/// The pipeline of a source.
///
/// # Errors
/// [`crate::Error::Device`] where the driver refuses.
fn compile(context: &Context, source: &Source, layout: vk::PipelineLayout) -> Result<vk::Pipeline> {
    match source.fragment {
        None => compile_compute(context, source.first, source.constants, layout),
        Some((fragment, topology)) => {
            let shaders = [source.first, fragment];
            compile_graphics(context, shaders, topology, source.constants, layout)
        }
    }
}

/// A shader need not have all of the `constants`.
fn compile_compute(
    context: &Context,
    shader: &'static Shader,
    constants: Constants,
    layout: vk::PipelineLayout,
) -> Result<vk::Pipeline> {
    let module = context.modules.get(&context.device, shader)?;
    let values = constants.map(vk::Bool32::from);
    let entries = specialization_entries();
    let constants = vk::SpecializationInfo::default()
        .map_entries(&entries)
        .data(bytemuck::cast_slice(&values));
    let stage = vk::PipelineShaderStageCreateInfo::default()
        .stage(vk::ShaderStageFlags::COMPUTE)
        .module(module)
        .specialization_info(&constants)
        .name(c"main");
    let info = vk::ComputePipelineCreateInfo::default()
        .stage(stage)
        .layout(layout);
    // SAFETY: module, layout and cache are of this device.
    let made = unsafe {
        (context.device).create_compute_pipelines(context.pipeline_cache.handle(), &[info], None)
    };
    compiled(made, shader)
}

/// A pipeline that adds its fragments to one RGBA32F image, or writes to images with a depth, as `topology` says,
/// without vertex buffers. The shaders need not have all of the `constants`.
fn compile_graphics(
    context: &Context,
    [vertex, fragment]: [&'static Shader; 2],
    topology: Topology,
    constants: Constants,
    layout: vk::PipelineLayout,
) -> Result<vk::Pipeline> {
    let modules = [
        context.modules.get(&context.device, vertex)?,
        context.modules.get(&context.device, fragment)?,
    ];
    let values = constants.map(vk::Bool32::from);
    let entries = specialization_entries();
    let constants = vk::SpecializationInfo::default()
        .map_entries(&entries)
        .data(bytemuck::cast_slice(&values));
    let stage_flags = [vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT];
    let stage_infos = [0, 1].map(|i| {
        vk::PipelineShaderStageCreateInfo::default()
            .stage(stage_flags[i])
            .module(modules[i])
            .specialization_info(&constants)
            .name(c"main")
    });
    let has_depth = !matches!(topology, Topology::Triangles | Topology::Points);
    let is_overlay = topology == Topology::Overlay;
    let vertex_input = vk::PipelineVertexInputStateCreateInfo::default();
    let assembly = vk::PipelineInputAssemblyStateCreateInfo::default().topology(match topology {
        Topology::Points => vk::PrimitiveTopology::POINT_LIST,
        _ => vk::PrimitiveTopology::TRIANGLE_LIST,
    });
    let viewport = vk::PipelineViewportStateCreateInfo::default()
        .viewport_count(1)
        .scissor_count(1);
    let raster = vk::PipelineRasterizationStateCreateInfo::default()
        .polygon_mode(vk::PolygonMode::FILL)
        .cull_mode(match topology {
            Topology::Surfaces => vk::CullModeFlags::BACK,
            _ => vk::CullModeFlags::NONE,
        })
        .front_face(vk::FrontFace::COUNTER_CLOCKWISE)
        .line_width(1.0);
    let multisample = vk::PipelineMultisampleStateCreateInfo::default()
        .rasterization_samples(vk::SampleCountFlags::TYPE_1);
    let add = [vk::PipelineColorBlendAttachmentState::default()
        .blend_enable(!has_depth || is_overlay)
        .src_color_blend_factor(match is_overlay {
            true => vk::BlendFactor::SRC_ALPHA,
            false => vk::BlendFactor::ONE,
        })
        .dst_color_blend_factor(match is_overlay {
            true => vk::BlendFactor::ONE_MINUS_SRC_ALPHA,
            false => vk::BlendFactor::ONE,
        })
        .color_blend_op(vk::BlendOp::ADD)
        .src_alpha_blend_factor(match is_overlay {
            true => vk::BlendFactor::ZERO,
            false => vk::BlendFactor::ONE,
        })
        .dst_alpha_blend_factor(vk::BlendFactor::ONE)
        .alpha_blend_op(vk::BlendOp::ADD)
        .color_write_mask(match topology {
            Topology::Depths => vk::ColorComponentFlags::empty(),
            _ => vk::ColorComponentFlags::RGBA,
        })];
    let blend = vk::PipelineColorBlendStateCreateInfo::default().attachments(&add);
    let dynamic = vk::PipelineDynamicStateCreateInfo::default()
        .dynamic_states(&[vk::DynamicState::VIEWPORT, vk::DynamicState::SCISSOR]);
    let formats = [match topology {
        Topology::Numbers => Texel::Number.format(),
        _ => Texel::Light.format(),
    }];
    let mut rendering =
        vk::PipelineRenderingCreateInfo::default().color_attachment_formats(&formats);
    let mut depth = vk::PipelineDepthStencilStateCreateInfo::default();
    if has_depth {
        rendering = rendering.depth_attachment_format(Texel::Depth.format());
        depth = (depth.depth_test_enable(true))
            .depth_write_enable(!is_overlay && topology != Topology::Surfaces)
            .depth_compare_op(match topology {
                Topology::Surfaces => vk::CompareOp::EQUAL,
                Topology::Overlay => vk::CompareOp::GREATER_OR_EQUAL,
                _ => vk::CompareOp::GREATER,
            });
    }
    let info = vk::GraphicsPipelineCreateInfo::default()
        .stages(&stage_infos)
        .vertex_input_state(&vertex_input)
        .input_assembly_state(&assembly)
        .viewport_state(&viewport)
        .rasterization_state(&raster)
        .multisample_state(&multisample)
        .depth_stencil_state(&depth)
        .color_blend_state(&blend)
        .dynamic_state(&dynamic)
        .layout(layout)
        .push_next(&mut rendering);
    // SAFETY: modules, layout and cache are of this device.
    let made = unsafe {
        (context.device).create_graphics_pipelines(context.pipeline_cache.handle(), &[info], None)
    };
    compiled(made, vertex)
}

fn compiled(
    made: Result<Vec<vk::Pipeline>, (Vec<vk::Pipeline>, vk::Result)>,
    shader: &Shader,
) -> Result<vk::Pipeline> {
    made.map(|handles| handles[0])
        .map_err(|(_, error)| device_error(&format!("compiling {}", shader.name))(error))
}
