//! The shaders that build.rs compiled, with what it read from their SPIR-V.

/// One compiled shader.
pub struct Shader {
    /// Name of its file in the folders of `glsl/`.
    pub name: &'static str,
    pub words: &'static [u32],
    /// The words that read storage buffers in place of texel buffers; empty where `words` read none.
    pub words_in_storage: &'static [u32],
    /// Bindings of descriptor set 0.
    pub bindings: &'static [Binding],
    pub push_bytes: u32,
    /// Workgroup size of a compute shader, else zeros.
    pub local_size: [u32; 3],
    /// Ids of its specialisation constants.
    pub constants: &'static [u32],
}

impl Shader {
    /// The words for a device with or without large texel buffers.
    pub(super) fn words_for(&self, has_texel_buffers: bool) -> &'static [u32] {
        match has_texel_buffers || self.words_in_storage.is_empty() {
            true => self.words,
            false => self.words_in_storage,
        }
    }
}

/// One binding of a shader.
pub struct Binding {
    pub index: u32,
    /// Name of the image, or of the last member of the buffer, its array.
    pub name: &'static str,
    pub kind: BindingKind,
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum BindingKind {
    StorageBuffer,
    StorageImage,
    SampledImage,
    /// A buffer that shaders fetch four words at a time from.
    TexelBuffer,
}

impl BindingKind {
    /// The kind on a device with or without large texel buffers.
    pub(super) fn on(self, has_texel_buffers: bool) -> Self {
        match self {
            Self::TexelBuffer if !has_texel_buffers => Self::StorageBuffer,
            kind => kind,
        }
    }
}

/// A struct in a buffer, in bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct StructLayout {
    pub name: &'static str,
    /// Array stride, or size where the struct stands alone.
    pub size: usize,
    pub fields: &'static [(&'static str, usize)],
}

/// One static a shader, [`shaders::ALL`] of them, and [`shaders::STRUCTS`].
#[allow(clippy::unreadable_literal)]
pub mod shaders {
    include!(concat!(env!("OUT_DIR"), "/shaders.rs"));
}
