//! The interface of a shader, read from its SPIR-V.

use spirq::prelude::*;
use spirq::ty::{DescriptorType, Type};
use std::collections::BTreeMap;

/// Macro of `glsl/shared/texel_buffers.glsl`.
pub const WITHOUT_TEXEL_BUFFERS: &str = "WITHOUT_TEXEL_BUFFERS";

/// Size and members with their offsets, of structs by their names.
pub type Layouts = BTreeMap<String, (usize, Vec<(String, usize)>)>;

/// What a shader and the program must agree on.
pub struct Interface {
    /// Index, name and kind, in the order of the indices.
    pub bindings: Vec<(u32, String, &'static str)>,
    pub push_bytes: usize,
    /// Workgroup size of a compute shader, else zeros.
    pub local_size: [u32; 3],
    /// Ids of the specialisation constants, in their order.
    pub constants: Vec<u32>,
    /// Structs of buffers and push constants.
    pub layouts: Layouts,
    /// Locations and types of what other stages write and read.
    #[allow(dead_code, reason = "the build has no use for them")]
    pub varyings: [BTreeMap<u32, String>; 2],
}

impl Interface {
    /// # Errors
    /// Where the words are no SPIR-V, or of a kind that nephroid does not use.
    pub fn of(words: &[u32]) -> Result<Self, String> {
        const MAGIC: u32 = 0x0723_0203;
        let junk = || "what the compiler wrote is no SPIR-V: install another glslc".to_owned();
        if words.first() != Some(&MAGIC) {
            return Err(junk());
        }
        let reflected = ReflectConfig::new()
            .spv(words.to_vec())
            .ref_all_rscs(false)
            .combine_img_samplers(true)
            .reflect();
        let entry = reflected
            .ok()
            .and_then(|entries| entries.into_iter().next())
            .ok_or_else(junk)?;

        let mut interface = Self {
            bindings: Vec::new(),
            push_bytes: 0,
            local_size: local_size(&entry)?,
            constants: Vec::new(),
            layouts: Layouts::new(),
            varyings: Default::default(),
        };
        for variable in &entry.vars {
            match variable {
                Variable::Descriptor {
                    name,
                    desc_bind,
                    desc_ty,
                    ty,
                    ..
                } => {
                    if desc_bind.set() != 0 {
                        return Err("a pipeline has one descriptor set, number 0".into());
                    }
                    let kind = match desc_ty {
                        DescriptorType::StorageBuffer(_) => "StorageBuffer",
                        DescriptorType::StorageImage(_) => "StorageImage",
                        DescriptorType::CombinedImageSampler() => "SampledImage",
                        DescriptorType::UniformTexelBuffer() => "TexelBuffer",
                        other => {
                            return Err(format!("no support for the descriptor type {other:?}"));
                        }
                    };
                    let last_member = match ty {
                        Type::Struct(block) => block.members.last().and_then(|m| m.name.clone()),
                        _ => None,
                    };
                    let name = name.clone().filter(|name| !name.is_empty()).or(last_member);
                    let index = desc_bind.bind();
                    let name = name.ok_or_else(|| format!("binding {index} has no name"))?;
                    interface.bindings.push((index, name, kind));
                    note_structs(ty, &mut interface.layouts);
                }
                Variable::PushConstant { ty, .. } => {
                    interface.push_bytes = ty.nbyte().ok_or("push constants have a size")?;
                    note_structs(ty, &mut interface.layouts);
                }
                Variable::SpecConstant { spec_id, .. } => interface.constants.push(*spec_id),
                Variable::Input { location, ty, .. } => {
                    interface.varyings[0].insert(location.loc(), ty.to_string());
                }
                Variable::Output { location, ty, .. } => {
                    interface.varyings[1].insert(location.loc(), ty.to_string());
                }
            }
        }
        interface.bindings.sort();
        interface.constants.sort();
        Ok(interface)
    }
}

/// Workgroup size; zeros where there is none.
///
/// # Errors
/// Where it is no number.
fn local_size(entry: &EntryPoint) -> Result<[u32; 3], String> {
    use spirq::spirv::ExecutionMode::{LocalSize, LocalSizeId};
    let mode_of = |of| entry.exec_modes.iter().find(|mode| mode.exec_mode == of);
    let Some(mode) = mode_of(LocalSize).or(mode_of(LocalSizeId)) else {
        return Ok([0; 3]);
    };
    let mut size = [0; 3];
    for (side, operand) in size.iter_mut().zip(&mode.operands) {
        *side = match operand.value {
            ConstantValue::U32(side) => side,
            ref other => return Err(format!("workgroup size {other:?}")),
        };
    }
    Ok(size)
}

/// Collects the structs inside a buffer block or push-constant block.
fn note_structs(ty: &Type, layouts: &mut Layouts) {
    match ty {
        Type::Struct(block) => {
            let fields: Vec<_> = block
                .members
                .iter()
                .map(|m| (m.name.clone().unwrap_or_default(), m.offset.unwrap_or(0)))
                .collect();
            for member in &block.members {
                note_structs(&member.ty, layouts);
            }
            if let (Some(name), Some(size)) = (&block.name, ty.nbyte()) {
                layouts.insert(name.clone(), (size, fields));
            }
        }
        Type::Array(array) => {
            note_structs(&array.element_ty, layouts);
            if let (Type::Struct(element), Some(stride)) = (&*array.element_ty, array.stride)
                && let Some(layout) = element.name.as_ref().and_then(|name| layouts.get_mut(name))
            {
                // Arrays know the padded size.
                layout.0 = stride;
            }
        }
        _ => {}
    }
}
