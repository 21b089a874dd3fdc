//! Compiled pipelines by what they are compiled from.

use super::shader::{Binding, Shader};
use crate::error::Result;
use ash::vk;
use std::collections::HashMap;
use std::sync::{Arc, Mutex};

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
    /// Triangles over the light, as opaque as their alpha, where they are at least as near as the depth that was written.
    Overlay,
}

/// Specialisation constants, by their ids.
pub type Constants = [bool; CONSTANTS];

/// Number of specialisation constants.
pub const CONSTANTS: usize = 13;

/// A pipeline and its layout. The context owns it and hands out the same one for the same shaders, so that a buffer
/// that grows rebuilds a descriptor set only.
pub struct Pipeline {
    pub source: Source,
    /// Null until it is compiled.
    pub compiled: Mutex<vk::Pipeline>,
    pub layout: vk::PipelineLayout,
    pub set_layout: vk::DescriptorSetLayout,
    pub stages: vk::ShaderStageFlags,
    pub bind_point: vk::PipelineBindPoint,
    pub push_bytes: u32,
    /// Threads of a workgroup; zeros for graphics.
    pub local_size: [u32; 3],
    pub bindings: Vec<&'static Binding>,
}

impl Pipeline {
    /// # Safety
    /// It is of this device, which no longer uses it, and nor does anybody else.
    pub(super) unsafe fn destroy(&self, device: &ash::Device) {
        // SAFETY: the caller's promise; null handles are allowed.
        unsafe {
            device.destroy_pipeline(*self.compiled.lock().expect("no panic while held"), None);
            device.destroy_pipeline_layout(self.layout, None);
            device.destroy_descriptor_set_layout(self.set_layout, None);
        }
    }
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
    /// Constants that no shader has do not count: scenes that differ in them have the same pipeline.
    pub(super) fn key(&self) -> Key {
        let fragment = self
            .fragment
            .map(|(shader, topology)| (shader.name, topology));
        let mut constants = Constants::default();
        for &id in self.shaders().flat_map(|shader| shader.constants) {
            constants[id as usize] = self.constants[id as usize];
        }
        (self.first.name, fragment, constants)
    }

    pub fn shaders(&self) -> impl Iterator<Item = &'static Shader> {
        std::iter::once(self.first).chain(self.fragment.map(|(shader, _)| shader))
    }
}

pub type Key = (&'static str, Option<(&'static str, Topology)>, Constants);

/// All pipelines of a context.
#[derive(Default)]
pub struct Pipelines {
    pub(super) made: HashMap<Key, Arc<Pipeline>>,
    /// Those that were made since [`Context::compile_pipelines`].
    pub(super) new: Vec<Arc<Pipeline>>,
    /// Shaders that replaced those of the build, by their names.
    #[cfg(feature = "dev")]
    pub(super) newest: HashMap<&'static str, &'static Shader>,
    /// Pipelines of replaced shaders, which renderers may still have.
    #[cfg(feature = "dev")]
    pub(super) replaced: Vec<Arc<Pipeline>>,
}

impl Pipelines {
    pub fn count(&self) -> usize {
        self.made.len()
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
        if let Some(known) = self.made.get(&source.key()) {
            return Ok(known.clone());
        }
        let pipeline = Arc::new(make()?);
        self.made.insert(source.key(), pipeline.clone());
        self.new.push(pipeline.clone());
        Ok(pipeline)
    }

    /// Only while the device exists and uses none.
    pub fn destroy(&mut self, device: &ash::Device) {
        let pipelines = self.made.drain().map(|(_, pipeline)| pipeline);
        #[cfg(feature = "dev")]
        let pipelines = pipelines.chain(self.replaced.drain(..));
        for pipeline in pipelines {
            // SAFETY: whoever used it kept the context.
            unsafe { pipeline.destroy(device) };
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::shaders::{ALL, MESH_FRAG, MESH_VERT, TRACE_CORNERS_COMP};
    use super::*;

    #[test]
    fn constants_of_other_shaders_make_no_other_pipeline() {
        let [vertex, fragment] = [&MESH_VERT, &MESH_FRAG];
        for (first, fragment) in [
            (&TRACE_CORNERS_COMP, None),
            (vertex, Some((fragment, Topology::Triangles))),
        ] {
            let key = |constants| {
                let source = Source {
                    first,
                    fragment,
                    constants,
                };
                source.key()
            };
            let usual = key(Constants::default());
            let mut other = 0;
            for id in 0..CONSTANTS {
                let mut constants = Constants::default();
                constants[id] = true;
                let is_own = first.constants.contains(&(id as u32));
                assert_eq!(key(constants) != usual, is_own, "{} {id}", first.name);
                other += usize::from(is_own);
            }
            assert!((1..CONSTANTS).contains(&other), "{}", first.name);
        }
    }

    #[test]
    fn all_constants_have_a_place() {
        let mut ids = ALL.iter().flat_map(|shader| shader.constants);
        assert!(ids.all(|id| (*id as usize) < CONSTANTS));
    }
}
