//! Compiles shaders again with the compiler of the build.

#[path = "../../../build/glslc.rs"]
mod glslc;

use super::interface::{WITHOUT_TEXEL_BUFFERS, capabilities, check};
use super::sources::{affected, shared};
use crate::viewer::bindings::WindowShader;
use crate::viewer::{differences, present};
use nephroid::gpu::{Context, NewShaders, Shader, shaders};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

/// Constants that the program was built with, too.
const CONSTANTS: [(&str, &str); 2] = [
    (
        "shared/constants.glsl",
        include_str!("../../../glsl/shared/constants.glsl"),
    ),
    (
        "viewer/constants.glsl",
        include_str!("../../../glsl/viewer/constants.glsl"),
    ),
];
const REMEDY: &str = "build nephroid again and start it again, or undo the change";
/// Lines of a message, at most.
const MAX_LINES: usize = 12;

/// Shaders that can replace those in use.
pub struct Compiled {
    pub of_renderer: NewShaders,
    pub of_window: Vec<(&'static str, Vec<u32>)>,
    pub names: Vec<&'static str>,
}

/// Where a shader is used, with its words there.
enum Place {
    Renderer(&'static Shader),
    Window(&'static WindowShader),
}

/// Compiles all shaders that depend on the changed files.
///
/// # Errors
/// What the compiler says, or why a shader cannot replace the one in use.
pub fn compile(
    context: &Arc<Context>,
    folder: &Path,
    changed: &BTreeSet<PathBuf>,
    cancel: &AtomicBool,
) -> Result<Compiled, String> {
    for (name, built) in CONSTANTS {
        let file = folder.join(name);
        let text = std::fs::read_to_string(&file)
            .map_err(|error| format!("{}: {error}", file.display()))?;
        if let Some(line) = first_difference(&text, built) {
            return Err(format!(
                "{}:{line}: the program was built with other constants; {REMEDY}",
                file.display()
            ));
        }
    }
    let compiler = glslc::Compiler::find()?;
    let outputs = tempfile::tempdir().map_err(|error| format!("no temporary folder: {error}"))?;
    let has_texel_buffers = context.has_texel_buffers();
    let macro_ = (!has_texel_buffers).then_some(WITHOUT_TEXEL_BUFFERS);
    let words_of = |shader: &Shader| match has_texel_buffers || shader.words_in_storage.is_empty() {
        true => shader.words,
        false => shader.words_in_storage,
    };
    let allowed = (shaders::ALL.iter())
        .flat_map(|shader| capabilities(words_of(shader)))
        .collect();
    // Shaders that the build did not have are used by nobody.
    let sources = (affected(folder, changed).into_iter())
        .filter_map(|source| Some((place(&source)?, source)));
    let compile = |(place, source): (Place, PathBuf)| {
        if cancel.load(Ordering::Relaxed) {
            return Err("cancelled".to_owned());
        }
        let output = outputs.path().join(source.file_name().expect("a file"));
        let macro_ = macro_.filter(|_| matches!(place, Place::Renderer(_)));
        let words = compiler.compile(&source, &shared(folder), macro_, &output)?;
        let fits = match &place {
            Place::Renderer(shader) => check(words_of(shader), &words, &allowed),
            Place::Window(shader) => check(&shader.words(), &words, &allowed),
        };
        fits.map_err(|reason| format!("{}: {reason}; {REMEDY}", source.display()))?;
        Ok((place, words))
    };
    let sources: Vec<_> = sources.collect();
    let compiled: Vec<_> = sources.into_par_iter().map(compile).collect();

    let (mut of_renderer, mut of_window) = (Vec::new(), Vec::new());
    let mut names = Vec::new();
    let mut messages = Vec::new();
    for result in compiled {
        match result {
            Ok((Place::Renderer(shader), words)) => {
                names.push(shader.name);
                of_renderer.push((shader, words));
            }
            Ok((Place::Window(shader), words)) => {
                names.push(shader.name);
                of_window.push((shader.name, words));
            }
            Err(message) => messages.extend(message.lines().map(str::to_owned)),
        }
    }
    if !messages.is_empty() {
        messages.truncate(MAX_LINES);
        return Err(messages.join("\n"));
    }
    // SAFETY: the words were checked against those of the build.
    let of_renderer = unsafe { context.compile_shaders(of_renderer) };
    Ok(Compiled {
        of_renderer: of_renderer.map_err(|error| error.to_string())?,
        of_window,
        names,
    })
}

fn place(source: &Path) -> Option<Place> {
    let name = source.file_name()?.to_str()?;
    let of_renderer = shaders::ALL.iter().find(|shader| shader.name == name);
    let mut of_window = present::SHADERS.into_iter().chain([&differences::SHADER]);
    (of_renderer.map(|shader| Place::Renderer(shader))).or_else(|| {
        of_window
            .find(|shader| shader.name == name)
            .map(Place::Window)
    })
}

/// The number of the first line in which two texts differ.
fn first_difference(a: &str, b: &str) -> Option<usize> {
    let (mut a, mut b) = (a.lines(), b.lines());
    (1..).find_map(|number| match (a.next(), b.next()) {
        (None, None) => Some(None),
        (a, b) => (a != b).then_some(Some(number)),
    })?
}
