//! Compiled pipelines by what they are compiled from.

use super::shader::{Binding, Shader};
use crate::error::Result;
use ash::vk;
use std::collections::HashMap;
use std::sync::Arc;

/// What the rasteriser makes of the vertices.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Topology {
    Triangles,
    Points,
    /// Triangles with a depth, of which the nearest one writes a number. Greater depths are nearer.
    Numbers,
    /// Triangles that write their depth where they are nearest, and no light.
    Depths,
    /// Triangles of the depth that was written, which replace light; back faces do not.
    Surfaces,
}

/// Specialisation constants, by their ids.
pub type Constants = [bool; CONSTANTS];

/// Number of specialisation constants.
pub const CONSTANTS: usize = 10;

/// A compiled pipeline and its layout. The context owns it and hands out the same one for the same shaders, so that
/// a buffer that grows rebuilds a descriptor set only.
pub struct Pipeline {
    pub handle: vk::Pipeline,
    pub layout: vk::PipelineLayout,
    pub set_layout: vk::DescriptorSetLayout,
    pub stages: vk::ShaderStageFlags,
    pub bind_point: vk::PipelineBindPoint,
    pub push_bytes: u32,
    /// Threads of a workgroup; zeros for graphics.
    pub local_size: [u32; 3],
    pub bindings: Vec<&'static Binding>,
}

/// What a pipeline is compiled from.
#[derive(Clone, Copy)]
pub struct Source {
    /// A compute shader, or a vertex shader.
    pub first: &'static Shader,
    /// A fragment shader; its topology.
    pub fragment: Option<(&'static Shader, Topology)>,
    /// Specialisation constants, by their ids.
    pub constants: Constants,
}

impl Source {
    fn key(&self) -> Key {
        let fragment = self
            .fragment
            .map(|(shader, topology)| (shader.name, topology));
        (self.first.name, fragment, self.constants)
    }

    pub fn shaders(&self) -> impl Iterator<Item = &'static Shader> {
        std::iter::once(self.first).chain(self.fragment.map(|(shader, _)| shader))
    }
}

type Key = (&'static str, Option<(&'static str, Topology)>, Constants);

/// All pipelines of a context.
#[derive(Default)]
pub struct Pipelines(HashMap<Key, Arc<Pipeline>>);

impl Pipelines {
    pub fn count(&self) -> usize {
        self.0.len()
    }

    /// The pipeline of this source, made by `make` where there is none yet.
    ///
    /// # Errors
    /// As `make`.
    pub fn get(
        &mut self,
        source: &Source,
        make: impl FnOnce() -> Result<Pipeline>,
    ) -> Result<Arc<Pipeline>> {
        if let Some(known) = self.0.get(&source.key()) {
            return Ok(known.clone());
        }
        let pipeline = Arc::new(make()?);
        self.0.insert(source.key(), pipeline.clone());
        Ok(pipeline)
    }

    /// Only while the device exists and uses none.
    pub fn destroy(&mut self, device: &ash::Device) {
        for (_, pipeline) in self.0.drain() {
            // SAFETY: whoever used it kept the context; null handles are allowed.
            unsafe {
                device.destroy_pipeline(pipeline.handle, None);
                device.destroy_pipeline_layout(pipeline.layout, None);
                device.destroy_descriptor_set_layout(pipeline.set_layout, None);
            }
        }
    }
}
