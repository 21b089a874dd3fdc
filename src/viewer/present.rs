//! Draws pictures to the window: exposure, tone mapping and sRGB, or the heat map of two sides.

use super::bindings::{Bindings, Layout, WindowShader, window_shader};
use super::compare::Shown;
use super::host::{Host, failed};
use ash::vk;
use nephroid::Result;
use nephroid::render::MapImage;

static VERTEX: WindowShader = window_shader!("present.vert");
static PRESENT: WindowShader = window_shader!("present.frag");
static HEAT_MAP: WindowShader = window_shader!("heat_map.frag");
#[cfg(feature = "dev")]
pub static SHADERS: [&WindowShader; 3] = [&VERTEX, &PRESENT, &HEAT_MAP];

/// Width of the line between two sides, pixels.
const DIVIDER_WIDTH: u32 = 2;

/// The layout of `glsl/viewer/pictures.glsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Push {
    size: [f32; 2],
    exposure: f32,
    encodes: u32,
    side: u32,
    scale: f32,
    is_relative: u32,
}

/// The pipelines, and descriptor sets for the pictures of the frames in flight. The host destroys it with [`Present::destroy`].
pub struct Present {
    /// A set for each frame in flight.
    bindings: Bindings,
    pipeline: vk::Pipeline,
    /// Made when it is first shown.
    heat_map: Option<vk::Pipeline>,
    format: vk::Format,
    encodes: bool,
}

impl Present {
    /// For targets of `format`, in frames of which `frames` are in flight. `encodes`: the target does not encode sRGB.
    ///
    /// # Errors
    /// [`nephroid::Error::Device`] where the device fails.
    pub fn new(host: &Host, format: vk::Format, encodes: bool, frames: usize) -> Result<Self> {
        let layout = Layout {
            stage: vk::ShaderStageFlags::FRAGMENT,
            images: 2,
            has_buffer: false,
            filter: vk::Filter::LINEAR,
            push_bytes: size_of::<Push>(),
        };
        let bindings = Bindings::new(host, layout, frames)?;
        Ok(Self {
            pipeline: pipeline(host, bindings.layout, format, &PRESENT)?,
            bindings,
            heat_map: None,
            format,
            encodes,
        })
    }

    /// Binds the pictures of both sides for what is recorded next; one side is bound twice. The slot's last frame has ended.
    ///
    /// # Errors
    /// [`nephroid::Error::Device`] where the device fails.
    pub fn bind(
        &mut self,
        host: &Host,
        slot: usize,
        pictures: [MapImage; 2],
        shown: Shown,
    ) -> Result<()> {
        self.bindings.write(host, slot, &pictures, None);
        if matches!(shown, Shown::HeatMap { .. }) && self.heat_map.is_none() {
            let layout = self.bindings.layout;
            self.heat_map = Some(pipeline(host, layout, self.format, &HEAT_MAP)?);
        }
        Ok(())
    }

    /// Records what was bound, within rendering to a target of `size` pixels.
    pub fn record(
        &self,
        host: &Host,
        commands: vk::CommandBuffer,
        slot: usize,
        size: [u32; 2],
        exposure_ev: f64,
        shown: Shown,
    ) {
        let device = &host.device;
        let [width, height] = size.map(|side| side as f32);
        let point = vk::PipelineBindPoint::GRAPHICS;
        let (scale, is_relative) = match shown {
            Shown::HeatMap { scale, is_relative } => (scale, is_relative),
            _ => (1.0, false),
        };
        let draw = |pipeline, side, columns: [u32; 2]| {
            let push = Push {
                size: [width, height],
                exposure: exposure_ev.exp2() as f32,
                encodes: self.encodes.into(),
                side,
                scale: scale as f32,
                is_relative: is_relative.into(),
            };
            let stages = vk::ShaderStageFlags::FRAGMENT;
            // SAFETY: the command buffer is recording, and the slot's set is bound to pictures.
            unsafe {
                device.cmd_bind_pipeline(commands, point, pipeline);
                device.cmd_set_scissor(commands, 0, &[strip(columns, size[1])]);
                let bytes = bytemuck::bytes_of(&push);
                device.cmd_push_constants(commands, self.bindings.layout, stages, 0, bytes);
                device.cmd_draw(commands, 3, 1, 0, 0);
            }
        };
        let viewport = vk::Viewport {
            width,
            height,
            max_depth: 1.0,
            ..Default::default()
        };
        let set = self.bindings.sets[slot];
        // SAFETY: the command buffer is recording.
        unsafe {
            device.cmd_set_viewport(commands, 0, &[viewport]);
            device.cmd_bind_descriptor_sets(commands, point, self.bindings.layout, 0, &[set], &[]);
        }
        match shown {
            Shown::One => draw(self.pipeline, 0, [0, size[0]]),
            Shown::HeatMap { .. } => {
                let heat_map = self.heat_map.expect("it was made when it was bound");
                draw(heat_map, 0, [0, size[0]]);
            }
            Shown::Split { divider } => {
                let middle = ((divider * width).round() as u32).min(size[0]);
                for (side, columns) in [(0, [0, middle]), (1, [middle, size[0]])] {
                    if columns[0] < columns[1] {
                        draw(self.pipeline, side, columns);
                    }
                }
                let half = DIVIDER_WIDTH / 2;
                let line = [middle.saturating_sub(half), (middle + half).min(size[0])];
                clear(device, commands, strip(line, size[1]));
            }
        }
    }

    /// The device must be idle.
    pub fn destroy(&self, host: &Host) {
        for pipeline in [self.pipeline, self.heat_map.unwrap_or_default()] {
            // SAFETY: the device is idle.
            unsafe { host.device.destroy_pipeline(pipeline, None) };
        }
        self.bindings.destroy(host);
    }
}

/// All of a target.
pub fn whole([width, height]: [u32; 2]) -> vk::Rect2D {
    strip([0, width], height)
}

/// Columns of a target from the first up to the second.
fn strip([from, to]: [u32; 2], height: u32) -> vk::Rect2D {
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

/// Fills a part of the target with the colour of the divider.
fn clear(device: &ash::Device, commands: vk::CommandBuffer, rect: vk::Rect2D) {
    let attachment = [vk::ClearAttachment {
        aspect_mask: vk::ImageAspectFlags::COLOR,
        color_attachment: 0,
        clear_value: vk::ClearValue {
            color: vk::ClearColorValue { float32: [1.0; 4] },
        },
    }];
    let rects = [vk::ClearRect {
        rect,
        base_array_layer: 0,
        layer_count: 1,
    }];
    // SAFETY: within rendering, and inside the target.
    unsafe { device.cmd_clear_attachments(commands, &attachment, &rects) };
}

fn pipeline(
    host: &Host,
    layout: vk::PipelineLayout,
    format: vk::Format,
    fragment: &WindowShader,
) -> Result<vk::Pipeline> {
    let device = &host.device;
    let modules = [VERTEX.module(host)?, fragment.module(host)?];
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
