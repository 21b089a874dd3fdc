//! Shaders that are replaced while the program runs, for a program that watches their sources (feature `dev`).

use super::pipelines::{Key, Pipeline, Pipelines, Source};
use super::{Context, Shader, shaders};
use crate::error::Result;
use std::sync::Arc;

/// Shaders with their pipelines, which a context takes over with [`Context::replace_shaders`].
pub struct NewShaders {
    context: Arc<Context>,
    shaders: Vec<&'static Shader>,
    /// Those that the context has and that use the shaders.
    pipelines: Vec<(Key, Arc<Pipeline>)>,
}

impl Context {
    /// Compiles the pipelines of other words for some shaders. Any thread can do so while others record frames.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the driver refuses.
    ///
    /// # Safety
    /// The words are SPIR-V for this device, with bindings, push constants, workgroup size and structs of the shader
    /// whose words they replace, and with what stages of a pipeline hand over.
    pub unsafe fn compile_shaders(
        self: &Arc<Self>,
        replaced: Vec<(&'static Shader, Vec<u32>)>,
    ) -> Result<NewShaders> {
        let shaders = replaced.into_iter().map(|(shader, words)| {
            // Pipelines name shaders that live as long as the program. A developer replaces few of them.
            let words: &'static [u32] = words.leak();
            let shader: &'static Shader = Box::leak(Box::new(Shader {
                words,
                words_in_storage: &[],
                ..*shader
            }));
            shader
        });
        let mut new = NewShaders {
            context: self.clone(),
            shaders: shaders.collect(),
            pipelines: Vec::new(),
        };
        let sources: Vec<Source> = {
            let pipelines = self.pipelines.lock().expect("no panic while held");
            let keys = pipelines.made.keys().filter(|key| new.changes(key));
            keys.map(|key| new.newest(&pipelines.newest(&source(key))))
                .collect()
        };
        for source in sources {
            let pipeline = Arc::new(Pipeline::new(self, &source)?);
            new.pipelines.push((source.key(), pipeline.clone()));
            pipeline.handle(self)?;
        }
        Ok(new)
    }

    /// Uses these shaders for renderers that are made from now on. Those that exist keep their pipelines, which are
    /// destroyed with the context, or when shaders are replaced again and no renderer has them any more.
    pub fn replace_shaders(&self, mut new: NewShaders) {
        let mut guard = self.pipelines.lock().expect("no panic while held");
        let pipelines = &mut *guard;
        pipelines.free_replaced(&self.device);
        // Others may have been made meanwhile.
        let old = pipelines.made.extract_if(|key, _| new.changes(key));
        pipelines.replaced.extend(old.map(|(_, pipeline)| pipeline));
        pipelines.made.extend(new.pipelines.drain(..));
        let named = new.shaders.iter().map(|shader| (shader.name, *shader));
        pipelines.newest.extend(named);
    }
}

impl NewShaders {
    fn changes(&self, (first, fragment, _): &Key) -> bool {
        let names = [Some(*first), fragment.map(|(name, _)| name)];
        (self.shaders.iter()).any(|shader| names.contains(&Some(shader.name)))
    }

    fn newest(&self, source: &Source) -> Source {
        let find = |shader: &'static Shader| {
            let mut shaders = self.shaders.iter();
            (shaders.find(|new| new.name == shader.name)).map_or(shader, |new| *new)
        };
        source.with(find)
    }
}

impl Drop for NewShaders {
    fn drop(&mut self) {
        for (_, pipeline) in self.pipelines.drain(..) {
            // SAFETY: nobody took it over, and the context is alive.
            unsafe { pipeline.destroy(&self.context.device) };
        }
    }
}

impl Pipelines {
    /// The source with the shaders that replaced its own.
    pub fn newest(&self, source: &Source) -> Source {
        source.with(|shader| self.newest.get(shader.name).copied().unwrap_or(shader))
    }

    /// Destroys pipelines that were replaced and that nobody has any more.
    fn free_replaced(&mut self, device: &ash::Device) {
        let unused = |pipeline: &mut Arc<Pipeline>| Arc::strong_count(pipeline) == 1;
        for pipeline in self.replaced.extract_if(.., unused) {
            // SAFETY: what is bound to a pipeline has it, and lives as long as the frames that use it.
            unsafe { pipeline.destroy(device) };
        }
    }
}

impl Source {
    fn with(&self, shader: impl Fn(&'static Shader) -> &'static Shader) -> Self {
        Self {
            first: shader(self.first),
            fragment: (self.fragment).map(|(fragment, topology)| (shader(fragment), topology)),
            constants: self.constants,
        }
    }
}

/// What a pipeline was compiled from, as the build has it.
fn source(&(first, fragment, constants): &Key) -> Source {
    let shader = |name| {
        let mut all = shaders::ALL.iter().copied();
        all.find(|shader| shader.name == name)
            .expect("pipelines are made from shaders of the table")
    };
    Source {
        first: shader(first),
        fragment: fragment.map(|(name, topology)| (shader(name), topology)),
        constants,
    }
}
