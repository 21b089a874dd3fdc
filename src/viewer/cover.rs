//! Passes that draw one triangle over an image.

use super::bindings::{WindowShader, window_shader};
use super::host::{Host, failed};
use ash::vk;
use nephroid::Result;

pub static VERTEX: WindowShader = window_shader!("present.vert");

/// Has draws cover a target of `size` pixels.
pub fn set_viewport(device: &ash::Device, commands: vk::CommandBuffer, size: [u32; 2]) {
    let [width, height] = size.map(|side| side as f32);
    let viewport = vk::Viewport {
        width,
        height,
        max_depth: 1.0,
        ..Default::default()
    };
    // SAFETY: the command buffer is recording.
    unsafe {
        device.cmd_set_viewport(commands, 0, &[viewport]);
        device.cmd_set_scissor(commands, 0, &[whole(size)]);
    }
}

/// All of a target.
pub fn whole([width, height]: [u32; 2]) -> vk::Rect2D {
    strip([0, width], height)
}

/// Columns of a target from the first up to the second.
pub fn strip([from, to]: [u32; 2], height: u32) -> vk::Rect2D {
    vk::Rect2D {
        offset: vk::Offset2D {
            x: from as i32,
            y: 0,
        },
        extent: vk::Extent2D {
            width: to - from,
            height,
        },
    }
}

/// A pipeline that covers targets of `format`. `constants` are those of the shaders, by their ids.
///
/// # Errors
/// [`nephroid::Error::Device`] where the device fails.
pub fn pipeline(
    host: &Host,
    layout: vk::PipelineLayout,
    format: vk::Format,
    fragment: &WindowShader,
    constants: &[bool],
) -> Result<vk::Pipeline> {
    let device = &host.device;
    let values: Vec<_> = constants
        .iter()
        .map(|&is_so| vk::Bool32::from(is_so))
        .collect();
    let entries: Vec<_> = (0..values.len() as u32)
        .map(|id| {
            vk::SpecializationMapEntry::default()
                .constant_id(id)
                .offset(id * size_of::<vk::Bool32>() as u32)
                .size(size_of::<vk::Bool32>())
        })
        .collect();
    let constants = vk::SpecializationInfo::default()
        .map_entries(&entries)
        .data(bytemuck::cast_slice(&values));
    let modules = [VERTEX.module(host)?, fragment.module(host)?];
    let stages = [vk::ShaderStageFlags::VERTEX, vk::ShaderStageFlags::FRAGMENT];
    let stages = [0, 1].map(|i| {
        vk::PipelineShaderStageCreateInfo::default()
            .stage(stages[i])
            .module(modules[i])
            .specialization_info(&constants)
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
