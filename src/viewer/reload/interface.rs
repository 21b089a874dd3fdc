//! Whether a shader that was compiled again fits the program, which binds buffers and draws for the one of its build.

#[path = "../../../build/spirv.rs"]
mod spirv;

use spirv::Interface;
pub use spirv::WITHOUT_TEXEL_BUFFERS;
use std::collections::BTreeSet;

/// # Errors
/// What in the `new` words does not fit where the `old` ones do. `allowed` are the capabilities of the device that shaders use.
pub fn check(old: &[u32], new: &[u32], allowed: &BTreeSet<u32>) -> Result<(), String> {
    let (old, new, used) = (Interface::of(old)?, Interface::of(new)?, capabilities(new));
    let bindings = &mut new.bindings.iter();
    if let Some((index, name, kind)) = bindings.find(|binding| !old.bindings.contains(binding)) {
        return Err(format!(
            "the program has no {kind} `{name}` at binding {index}"
        ));
    }
    if ![0, old.push_bytes].contains(&new.push_bytes) {
        return Err(format!(
            "its push constants have {} bytes, and those of the program {}",
            new.push_bytes, old.push_bytes
        ));
    }
    if new.local_size != old.local_size {
        return Err(format!(
            "its workgroups have {:?} threads, and those of the program {:?}",
            new.local_size, old.local_size
        ));
    }
    let constants = &mut new.constants.iter();
    if let Some(id) = constants.find(|id| !old.constants.contains(id)) {
        return Err(format!("the program sets no specialisation constant {id}"));
    }
    let layouts = &mut new.layouts.iter();
    if let Some((name, _)) = layouts.find(|(name, layout)| old.layouts.get(*name) != Some(layout)) {
        return Err(format!("the program lays out `{name}` in another way"));
    }
    let [inputs, outputs] = new.varyings;
    let input = inputs
        .iter()
        .find(|(at, ty)| old.varyings[0].get(at) != Some(ty));
    if let Some((location, ty)) = input {
        return Err(format!("nothing writes its input {location} of type {ty}"));
    }
    if outputs != old.varyings[1] {
        return Err("its outputs are not those of the program".into());
    }
    match used.difference(allowed).next() {
        Some(capability) => Err(format!(
            "it needs the capability {capability} of SPIR-V, which no shader of the program does"
        )),
        None => Ok(()),
    }
}

/// Words of a module before its first instruction.
const HEADER_WORDS: usize = 5;

/// What a module requires of the device.
pub fn capabilities(words: &[u32]) -> BTreeSet<u32> {
    const CAPABILITY: u32 = 17;
    // They are the first instructions.
    let instructions = words
        .get(HEADER_WORDS..)
        .unwrap_or_default()
        .chunks_exact(2);
    (instructions.map_while(|pair| (pair[0] == 2 << 16 | CAPABILITY).then_some(pair[1]))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use nephroid::gpu::shaders;

    #[test]
    fn shaders_fit_in_their_own_place_only() {
        let all = || shaders::ALL.iter().map(|shader| shader.words);
        let allowed = all().flat_map(capabilities).collect();
        for words in all() {
            assert_eq!(check(words, words, &allowed), Ok(()));
            assert!(check(words, words, &BTreeSet::new()).is_err());
        }
        let other = |shader: &nephroid::gpu::Shader| {
            check(shaders::SHADE_COMP.words, shader.words, &allowed)
        };
        let names: Vec<_> = (shaders::ALL.iter().copied())
            .filter(|shader| other(shader).is_ok())
            .map(|shader| shader.name)
            .collect();
        assert!(names.len() < 4, "{names:?}");
        assert!(check(shaders::SHADE_COMP.words, &[1, 2, 3], &allowed).is_err());
    }

    #[test]
    fn another_specialisation_constant_is_refused() {
        const DECORATE: u32 = 71;
        const SPEC_ID: u32 = 1;
        let old = shaders::MESH_FRAG.words;
        let allowed = capabilities(old);
        let mut new = old.to_vec();
        let mut at = HEADER_WORDS;
        while new[at] != 4 << 16 | DECORATE || new[at + 2] != SPEC_ID {
            at += (new[at] >> 16) as usize;
        }
        new[at + 3] = 99;
        let refused = check(old, &new, &allowed).unwrap_err();
        assert!(refused.contains("specialisation constant 99"), "{refused}");
    }
}
