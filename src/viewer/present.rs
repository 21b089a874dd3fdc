//! Draws pictures to the window: exposure, tone mapping and sRGB, or the heat map of two sides.

use super::bindings::{Bindings, Layout, WindowShader, window_shader};
use super::compare::Shown;
use super::cover::{pipeline, set_viewport, strip};
use super::host::Host;
use super::stretch::Stretch;
use ash::vk;
use nephroid::Result;
use nephroid::render::MapImage;

static PRESENT: WindowShader = window_shader!("present.frag");
static HEAT_MAP: WindowShader = window_shader!("heat_map.frag");
#[cfg(feature = "dev")]
pub static SHADERS: [&WindowShader; 4] = [
    &super::cover::VERTEX,
    &PRESENT,
    &HEAT_MAP,
    &super::stretch::STRETCH,
];

/// Width of the line between two sides, pixels.
const DIVIDER_WIDTH: u32 = 2;

/// The layout of `glsl/viewer/pictures.glsl`.
#[repr(C)]
#[derive(Clone, Copy, bytemuck::Pod, bytemuck::Zeroable)]
struct Push {
    exposure: f32,
    scale: f32,
    is_relative: u32,
}

/// The pipelines, and descriptor sets for the pictures of the frames in flight. The host destroys it with [`Present::destroy`].
pub struct Present {
    /// A set for each frame in flight.
    bindings: Bindings,
    /// Size of the pictures that each set has, pixels.
    sizes: Vec<[u32; 2]>,
    /// Made when they are first shown, as the next two are.
    sides: [Option<vk::Pipeline>; 2],
    heat_map: Option<vk::Pipeline>,
    /// For pictures of another size than the window's.
    stretch: Option<Stretch>,
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
            filter: vk::Filter::NEAREST,
            push_bytes: size_of::<Push>(),
        };
        let bindings = Bindings::new(host, layout, frames)?;
        Ok(Self {
            sizes: vec![[0; 2]; frames],
            bindings,
            sides: [None; 2],
            heat_map: None,
            stretch: None,
            format,
            encodes,
        })
    }

    fn pipeline(&self, host: &Host, shader: &WindowShader, shows_b: bool) -> Result<vk::Pipeline> {
        let constants = [shows_b, self.encodes];
        pipeline(host, self.bindings.layout, self.format, shader, &constants)
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
        self.sizes[slot] = pictures[0].size;
        if matches!(shown, Shown::HeatMap { .. }) {
            if self.heat_map.is_none() {
                self.heat_map = Some(self.pipeline(host, &HEAT_MAP, false)?);
            }
            return Ok(());
        }
        let sides = 1 + usize::from(matches!(shown, Shown::Split { .. }));
        for side in 0..sides {
            if self.sides[side].is_none() {
                self.sides[side] = Some(self.pipeline(host, &PRESENT, side == 1)?);
            }
        }
        Ok(())
    }

    /// Records what was bound in its own size, outside of rendering, if [`Present::record`] is to show it in another one.
    ///
    /// # Errors
    /// [`nephroid::Error::Device`] where the device fails.
    pub fn prepare(
        &mut self,
        host: &Host,
        commands: vk::CommandBuffer,
        slot: usize,
        size: [u32; 2],
        exposure_ev: f64,
        shown: Shown,
    ) -> Result<()> {
        let of_picture = self.sizes[slot];
        if of_picture == size {
            return Ok(());
        }
        let mut stretch = match self.stretch.take() {
            Some(stretch) => stretch,
            None => Stretch::new(host, self.format)?,
        };
        let drawn = stretch.target(host, of_picture).map(|target| {
            target.draw(host, commands, || {
                self.record_pixels(host, commands, slot, exposure_ev, shown);
            });
        });
        self.stretch = Some(stretch);
        drawn
    }

    /// Records what was bound, within rendering to a target of `size` pixels, after [`Present::prepare`] if it has another size.
    pub fn record(
        &self,
        host: &Host,
        commands: vk::CommandBuffer,
        slot: usize,
        size: [u32; 2],
        exposure_ev: f64,
        shown: Shown,
    ) {
        let of_picture = self.sizes[slot];
        match &self.stretch {
            Some(stretch) if of_picture != size => {
                set_viewport(&host.device, commands, size);
                stretch.record(host, commands, size);
            }
            _ => self.record_pixels(host, commands, slot, exposure_ev, shown),
        }
        if let Shown::Split { divider } = shown {
            let scale = f64::from(size[0]) / f64::from(of_picture[0]);
            let middle = f64::from(columns_of_a(of_picture, divider)) * scale;
            let (middle, half) = (middle.round() as u32, DIVIDER_WIDTH / 2);
            let line = [middle.saturating_sub(half), (middle + half).min(size[0])];
            clear(&host.device, commands, strip(line, size[1]));
        }
    }

    /// Records what was bound in its own size, within rendering.
    fn record_pixels(
        &self,
        host: &Host,
        commands: vk::CommandBuffer,
        slot: usize,
        exposure_ev: f64,
        shown: Shown,
    ) {
        let device = &host.device;
        let size = self.sizes[slot];
        let point = vk::PipelineBindPoint::GRAPHICS;
        let (scale, is_relative) = match shown {
            Shown::HeatMap { scale, is_relative } => (scale, is_relative),
            _ => (1.0, false),
        };
        let draw = |pipeline: Option<vk::Pipeline>, columns: [u32; 2]| {
            let pipeline = pipeline.expect("made when it was bound");
            let push = Push {
                exposure: exposure_ev.exp2() as f32,
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
        let set = self.bindings.sets[slot];
        set_viewport(device, commands, size);
        // SAFETY: the command buffer is recording.
        unsafe {
            device.cmd_bind_descriptor_sets(commands, point, self.bindings.layout, 0, &[set], &[]);
        }
        match shown {
            Shown::One => draw(self.sides[0], [0, size[0]]),
            Shown::HeatMap { .. } => draw(self.heat_map, [0, size[0]]),
            Shown::Split { divider } => {
                let middle = columns_of_a(size, divider);
                for (side, columns) in self.sides.into_iter().zip([[0, middle], [middle, size[0]]])
                {
                    if columns[0] < columns[1] {
                        draw(side, columns);
                    }
                }
            }
        }
    }

    /// The device must be idle.
    pub fn destroy(&mut self, host: &Host) {
        for pipeline in self.sides.iter().chain([&self.heat_map]).flatten() {
            // SAFETY: the device is idle.
            unsafe { host.device.destroy_pipeline(*pipeline, None) };
        }
        if let Some(stretch) = &mut self.stretch {
            stretch.destroy(host);
        }
        self.bindings.destroy(host);
    }
}

/// Columns of a picture of `size` that show A, left of the divider.
fn columns_of_a(size: [u32; 2], divider: f32) -> u32 {
    ((divider * size[0] as f32).round() as u32).min(size[0])
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
