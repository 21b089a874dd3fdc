//! Shows pictures of another size than the window's. They are tone mapped in their own size, and then scaled with bilinear
//! filtering: tone mapping fewer pixels, and filtering colours of eight bits, takes half of the time.

use super::bindings::{Bindings, Layout, WindowShader, window_shader};
use super::cover::pipeline;
use super::host::Host;
use super::target::Target;
use ash::vk;
use nephroid::Result;

pub static STRETCH: WindowShader = window_shader!("stretch.frag");

/// The host destroys it with [`Stretch::destroy`].
pub struct Stretch {
    bindings: Bindings,
    pipeline: vk::Pipeline,
    target: Option<Target>,
    format: vk::Format,
}

impl Stretch {
    /// For targets of `format`.
    ///
    /// # Errors
    /// [`nephroid::Error::Device`] where the device fails.
    pub fn new(host: &Host, format: vk::Format) -> Result<Self> {
        let layout = Layout {
            stage: vk::ShaderStageFlags::FRAGMENT,
            images: 1,
            has_buffer: false,
            filter: vk::Filter::LINEAR,
            push_bytes: size_of::<[f32; 2]>(),
        };
        let bindings = Bindings::new(host, layout, 1)?;
        let pipeline = pipeline(host, bindings.layout, format, &STRETCH, &[])
            .inspect_err(|_| bindings.destroy(host))?;
        Ok(Self {
            bindings,
            pipeline,
            target: None,
            format,
        })
    }

    /// Where pictures of `size` pixels are drawn.
    ///
    /// # Errors
    /// [`nephroid::Error::Device`] where there is not enough memory.
    pub fn target(&mut self, host: &Host, size: [u32; 2]) -> Result<&Target> {
        let last = self.target.as_ref().map(|target| target.image.size);
        if last != Some(size) {
            // Frames in flight may show the old one.
            host.wait_idle();
            if let Some(mut old) = self.target.take() {
                old.destroy(host);
            }
            let target = Target::new(host, "scaled picture", self.format, size, false)?;
            self.bindings.write(host, 0, &[target.image], None);
            self.target = Some(target);
        }
        Ok(self.target.as_ref().expect("made above"))
    }

    /// Records the picture of the target, within rendering to an image of `size` pixels.
    pub fn record(&self, host: &Host, commands: vk::CommandBuffer, size: [u32; 2]) {
        let device = &host.device;
        let point = vk::PipelineBindPoint::GRAPHICS;
        let layout = self.bindings.layout;
        let bytes = size.map(|side| side as f32);
        let bytes = bytemuck::bytes_of(&bytes);
        // SAFETY: the command buffer is recording, and the set is bound to the target.
        unsafe {
            device.cmd_bind_descriptor_sets(commands, point, layout, 0, &self.bindings.sets, &[]);
            device.cmd_bind_pipeline(commands, point, self.pipeline);
            device.cmd_push_constants(commands, layout, vk::ShaderStageFlags::FRAGMENT, 0, bytes);
            device.cmd_draw(commands, 3, 1, 0, 0);
        }
    }

    /// The device must be idle.
    pub fn destroy(&mut self, host: &Host) {
        if let Some(mut target) = self.target.take() {
            target.destroy(host);
        }
        // SAFETY: the device is idle.
        unsafe { host.device.destroy_pipeline(self.pipeline, None) };
        self.bindings.destroy(host);
    }
}
