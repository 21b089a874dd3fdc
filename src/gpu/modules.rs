//! Shader modules.

use super::device_error;
use super::shader::{Shader, shaders};
use crate::error::Result;
use ash::vk;
use std::sync::Mutex;

/// The modules of a device. Those of the build are all made when it is opened, in the order of [`shaders::ALL`]: the validation
/// layers number modules as they are made and write the numbers into their code. Only in one order does the driver meet the same
/// code in every run, and find it compiled in its cache.
pub struct Modules {
    made: Mutex<Vec<(&'static Shader, vk::ShaderModule)>>,
    has_texel_buffers: bool,
}

impl Modules {
    /// # Errors
    /// [`crate::Error::Device`] where the driver refuses.
    pub fn new(device: &ash::Device, has_texel_buffers: bool) -> Result<Self> {
        let mut modules = Self {
            made: Mutex::default(),
            has_texel_buffers,
        };
        for &shader in shaders::ALL {
            if let Err(error) = modules.get(device, shader) {
                modules.destroy(device);
                return Err(error);
            }
        }
        Ok(modules)
    }

    /// The module of this shader; a shader that is not of the build gets a new one, once.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the driver refuses.
    pub fn get(&self, device: &ash::Device, shader: &'static Shader) -> Result<vk::ShaderModule> {
        let mut made = self.made.lock().expect("no panic while held");
        let mut known = made.iter();
        if let Some((_, module)) = known.find(|(of, _)| std::ptr::eq(*of, shader)) {
            return Ok(*module);
        }
        let words = shader.words_for(self.has_texel_buffers);
        let info = vk::ShaderModuleCreateInfo::default().code(words);
        // SAFETY: SPIR-V from the compiler; destroyed in `destroy`.
        let module = unsafe { device.create_shader_module(&info, None) }
            .map_err(device_error("loading a shader"))?;
        made.push((shader, module));
        Ok(module)
    }

    /// Only while the device exists.
    pub fn destroy(&mut self, device: &ash::Device) {
        if let Ok(made) = self.made.get_mut() {
            for (_, module) in made.drain(..) {
                // SAFETY: a live module of this device; pipelines do not need theirs once they are made.
                unsafe { device.destroy_shader_module(module, None) };
            }
        }
    }
}
