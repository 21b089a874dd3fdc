//! Compiles every shader in `glsl/` and its folders to optimised SPIR-V and writes a typed table of
//! them, with the bindings, push-constant size, workgroup size and struct layouts read from the
//! SPIR-V.
//!
//! The compiler is `glslc` (from `$GLSLC`, `$VULKAN_SDK/bin` or `PATH`), or the `shaderc` crate
//! with the feature `bundled-shaderc`.

#[cfg(not(feature = "bundled-shaderc"))]
#[path = "build/glslc.rs"]
mod glslc;
#[path = "build/spirv.rs"]
mod spirv;

#[cfg(not(feature = "bundled-shaderc"))]
use glslc::Compiler;
use spirv::{Interface, Layouts, WITHOUT_TEXEL_BUFFERS};
use std::collections::BTreeMap;
use std::fmt::Write;
use std::num::NonZero;
use std::path::{Path, PathBuf};
use std::process::exit;

fn main() {
    println!("cargo::rerun-if-changed=glsl");
    println!("cargo::rerun-if-env-changed=GLSLC");
    println!("cargo::rerun-if-env-changed=VULKAN_SDK");

    note_commit();

    if let Err(message) = compile_all().and_then(|()| share_all_constants()) {
        for line in message.lines() {
            println!("cargo::error={line}");
        }
        exit(1);
    }
}

/// The viewer's shaders, which are files and not in the table.
const VIEWER: &str = "glsl/viewer";

/// Appends the shaders of a folder and of the folders in it to `found`.
///
/// # Errors
/// Where a folder cannot be read.
fn find_shaders(folder: &Path, found: &mut Vec<PathBuf>) -> std::io::Result<()> {
    for entry in std::fs::read_dir(folder)? {
        let path = entry?.path();
        let is_stage =
            |e: &std::ffi::OsStr| ["comp", "vert", "frag"].iter().any(|stage| e == *stage);
        if path.is_dir() && path != Path::new(VIEWER) {
            find_shaders(&path, found)?;
        } else if path.extension().is_some_and(is_stage) {
            found.push(path);
        }
    }
    Ok(())
}

/// Writes the table of all shaders.
///
/// # Errors
/// What the compiler says, or what is wrong with it or the sources.
fn compile_all() -> Result<(), String> {
    let mut sources = Vec::new();
    find_shaders(Path::new("glsl"), &mut sources).map_err(|error| {
        format!("the folder glsl with the shaders' sources cannot be read: {error}")
    })?;
    // The order of the table does not depend on the folders.
    sources.sort_by(|a, b| a.file_name().cmp(&b.file_name()));
    if sources.is_empty() {
        return Err("the folder glsl has no shaders".into());
    }

    let compiler = Compiler::find()?;
    compile_files(
        &compiler,
        Path::new("examples/embed_ash"),
        &["floor.vert", "floor.frag"],
    )?;
    if std::env::var_os("CARGO_FEATURE_VIEWER").is_some() {
        compile_files(
            &compiler,
            Path::new(VIEWER),
            &[
                "present.vert",
                "present.frag",
                "stretch.frag",
                "heat_map.frag",
                "differences.comp",
            ],
        )?;
    }
    let mut table = String::from("use super::{Binding, BindingKind, Shader, StructLayout};\n");
    let mut layouts = BTreeMap::new();
    let mut messages = String::new();
    for compiled in compile_in_parallel(&compiler, &sources) {
        match compiled {
            Ok(shader) => describe(shader, &mut table, &mut layouts),
            Err(message) => {
                messages += message.trim_end();
                messages.push('\n');
            }
        }
    }
    if !messages.is_empty() {
        return Err(messages);
    }
    let names: Vec<String> = (sources.iter())
        .map(|source| format!("&{}", constant(source)))
        .collect();
    writeln!(
        table,
        "pub static ALL: &[&Shader] = &[{}];",
        names.join(", ")
    )
    .unwrap();
    writeln!(
        table,
        "/// Structs of the shaders' buffers as the SPIR-V lays them out."
    )
    .unwrap();
    writeln!(table, "pub static STRUCTS: &[StructLayout] = &[").unwrap();
    for (name, (size, fields)) in layouts {
        writeln!(
            table,
            "    StructLayout {{ name: {name:?}, size: {size}, fields: &{fields:?} }},"
        )
        .unwrap();
    }
    writeln!(table, "];").unwrap();
    let file = out_dir().join("shaders.rs");
    std::fs::write(&file, table).map_err(|error| format!("{}: {error}", file.display()))
}

/// Makes Rust constants of those of the renderer's shaders and of the viewer's.
///
/// # Errors
/// As [`share_constants`].
fn share_all_constants() -> Result<(), String> {
    share_constants("glsl/shared/constants.glsl", "constants.rs")?;
    match std::env::var_os("CARGO_FEATURE_VIEWER") {
        Some(_) => share_constants("glsl/viewer/constants.glsl", "viewer_constants.rs"),
        None => Ok(()),
    }
}

/// Makes Rust constants of those in the file `from`: `const uint NAME = 8;` or
/// `const uint NAME[2] = uint[](8, 9);`, of uint, int or float, a line each. Comments above them
/// become their documentation.
///
/// # Errors
/// Where a line is something else.
fn share_constants(from: &str, to: &str) -> Result<(), String> {
    let source = std::fs::read_to_string(from).map_err(|error| format!("{from}: {error}"))?;
    let mut constants = String::new();
    let mut comment = String::new();
    for (index, line) in source.lines().enumerate() {
        let constant = || {
            let (declared, value) = line.strip_prefix("const ")?.split_once(" = ")?;
            let (kind, name) = declared.split_once(' ')?;
            let (value, _) = value.split_once(';')?;
            let (rust_kind, value) = match kind {
                "uint" => ("u32", value.trim_end_matches('u')),
                "int" => ("i32", value),
                "float" => ("f32", value),
                _ => return None,
            };
            let Some((name, count)) = name.split_once('[') else {
                return Some(format!("pub const {name}: {rust_kind} = {value};\n"));
            };
            let count = count.strip_suffix(']')?;
            let values = value.strip_prefix(kind)?.strip_prefix("[](")?;
            let values = values.strip_suffix(')')?;
            Some(format!(
                "pub const {name}: [{rust_kind}; {count}] = [{values}];\n"
            ))
        };
        if line.is_empty() {
            comment.clear();
        } else if let Some(text) = line.strip_prefix("//") {
            writeln!(comment, "///{text}").unwrap();
        } else if let Some(constant) = constant() {
            constants += &std::mem::take(&mut comment);
            constants += &constant;
        } else {
            return Err(format!("{from}, line {}: no constant: {line}", index + 1));
        }
    }
    let file = out_dir().join(to);
    std::fs::write(&file, constants).map_err(|error| format!("{}: {error}", file.display()))
}

/// Shaders of a host, as files: of `examples/embed_ash`, which is not in every copy of the source, and of the viewer.
///
/// # Errors
/// As [`compile_all`].
fn compile_files(compiler: &Compiler, folder: &Path, names: &[&str]) -> Result<(), String> {
    for name in names {
        let source = folder.join(name);
        if source.exists() {
            println!("cargo::rerun-if-changed={}", source.display());
            let words = compile(compiler, &source, None)?;
            let bytes: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
            let file = out_dir().join(format!("{name}.spv"));
            std::fs::write(&file, bytes).map_err(|error| format!("{}: {error}", file.display()))?;
        }
    }
    Ok(())
}

/// The SPIR-V of a shader. `macro_` is defined while compiling.
///
/// # Errors
/// What the compiler says.
fn compile(compiler: &Compiler, source: &Path, macro_: Option<&str>) -> Result<Vec<u32>, String> {
    let mut name = source.file_name().expect("a file").to_owned();
    name.push(".spv");
    let output = out_dir().join(name);
    let words = compiler.compile(source, Path::new("glsl/shared"), macro_, &output)?;
    Ok(without_source_text(&words))
}

/// The words of a shader without its GLSL, which is two thirds of them. Names, and the files and lines that validation messages state, stay.
fn without_source_text(words: &[u32]) -> Vec<u32> {
    const HEADER: usize = 5;
    const OP_SOURCE_CONTINUED: u32 = 2;
    const OP_SOURCE: u32 = 3;
    // Language, version and file come before the text.
    const OP_SOURCE_WORDS: usize = 4;
    let (header, mut rest) = words.split_at(HEADER.min(words.len()));
    let mut kept = header.to_vec();
    while let Some(first) = rest.first() {
        let (opcode, count) = (first & 0xffff, (first >> 16) as usize);
        let (instruction, next) = rest.split_at(count.clamp(1, rest.len()));
        match opcode {
            OP_SOURCE_CONTINUED => {}
            OP_SOURCE if count > OP_SOURCE_WORDS => {
                kept.push((OP_SOURCE_WORDS as u32) << 16 | OP_SOURCE);
                kept.extend(&instruction[1..OP_SOURCE_WORDS]);
            }
            _ => kept.extend(instruction),
        }
        rest = next;
    }
    kept
}

fn out_dir() -> PathBuf {
    std::env::var_os("OUT_DIR")
        .expect("cargo sets OUT_DIR")
        .into()
}

/// Sets `NEPHROID_COMMIT` where this folder is a git checkout of its own.
fn note_commit() {
    let git = |arguments: &[&str]| -> Option<String> {
        let run = std::process::Command::new("git").args(arguments).output();
        let output = run.ok().filter(|output| output.status.success())?;
        Some(String::from_utf8(output.stdout).ok()?.trim().to_owned())
    };
    let root = git(&["rev-parse", "--show-toplevel"]).map(PathBuf::from);
    let here = std::env::current_dir().ok();
    if root.is_none() || root.and_then(|root| root.canonicalize().ok()) != here {
        return;
    }
    // The log of HEAD grows with every commit and checkout.
    if let Some(log) = git(&["rev-parse", "--git-path", "logs/HEAD"]) {
        println!("cargo::rerun-if-changed={log}");
    }
    if let Some(commit) = git(&["rev-parse", "--short=12", "HEAD"]) {
        println!("cargo::rustc-env=NEPHROID_COMMIT={commit}");
    }
}

/// The crate shaderc.
#[cfg(feature = "bundled-shaderc")]
struct Compiler(shaderc::Compiler);

#[cfg(feature = "bundled-shaderc")]
impl Compiler {
    fn find() -> Result<Self, String> {
        shaderc::Compiler::new()
            .map(Self)
            .map_err(|e| e.to_string())
    }

    /// As that of glslc. Nothing is written.
    fn compile(
        &self,
        source: &Path,
        shared: &Path,
        macro_: Option<&str>,
        _output: &Path,
    ) -> Result<Vec<u32>, String> {
        use shaderc::{
            CompileOptions, EnvVersion, OptimizationLevel, ResolvedInclude, ShaderKind, TargetEnv,
        };
        let kind = match source.extension().and_then(|e| e.to_str()) {
            Some("comp") => ShaderKind::Compute,
            Some("vert") => ShaderKind::Vertex,
            _ => ShaderKind::Fragment,
        };
        let text =
            std::fs::read_to_string(source).map_err(|e| format!("{}: {e}", source.display()))?;
        let mut options = CompileOptions::new().map_err(|e| e.to_string())?;
        options.set_target_env(TargetEnv::Vulkan, EnvVersion::Vulkan1_3 as u32);
        options.set_optimization_level(OptimizationLevel::Performance);
        options.set_generate_debug_info();
        options.set_warnings_as_errors();
        if let Some(name) = macro_ {
            options.add_macro_definition(name, None);
        }
        options.set_include_callback(|name, _, _, _| {
            // As glslc: beside the shader, or else in the shared folder.
            let beside = source.with_file_name(name);
            let path = match beside.exists() {
                true => beside,
                false => shared.join(name),
            };
            Ok(ResolvedInclude {
                resolved_name: path.display().to_string(),
                content: std::fs::read_to_string(&path)
                    .map_err(|e| format!("{}: {e}", path.display()))?,
            })
        });
        let name = source.display().to_string();
        (self.0)
            .compile_into_spirv(&text, kind, &name, "main", Some(&options))
            .map(|artifact| artifact.as_binary().to_vec())
            .map_err(|e| e.to_string())
    }
}

/// Name of a shader's static.
fn constant(source: &Path) -> String {
    let file = source.file_name().expect("a file").to_string_lossy();
    file.replace('.', "_").to_uppercase()
}

/// A shader of the table.
struct Compiled<'a> {
    source: &'a Path,
    words: Vec<u32>,
    /// Those without texel buffers, where `words` read some.
    in_storage: Vec<u32>,
    interface: Interface,
}

impl<'a> Compiled<'a> {
    /// # Errors
    /// What the compiler says, or as [`Interface::of`].
    fn new(compiler: &Compiler, source: &'a Path) -> Result<Self, String> {
        let words = compile(compiler, source, None)?;
        let interface =
            Interface::of(&words).map_err(|error| format!("{}: {error}", source.display()))?;
        let mut kinds = interface.bindings.iter().map(|(_, _, kind)| *kind);
        let in_storage = match kinds.any(|kind| kind == "TexelBuffer") {
            true => compile(compiler, source, Some(WITHOUT_TEXEL_BUFFERS))?,
            false => Vec::new(),
        };
        Ok(Self {
            source,
            words,
            in_storage,
            interface,
        })
    }
}

/// The shaders of these sources, in their order, or what is wrong with each.
fn compile_in_parallel<'a>(
    compiler: &Compiler,
    sources: &'a [PathBuf],
) -> Vec<Result<Compiled<'a>, String>> {
    let threads = std::thread::available_parallelism().map_or(1, NonZero::get);
    std::thread::scope(|scope| {
        let compile = |part: &'a [PathBuf]| {
            let compiled = part.iter().map(|source| Compiled::new(compiler, source));
            compiled.collect::<Vec<_>>()
        };
        let parts = sources.chunks(sources.len().div_ceil(threads));
        let started: Vec<_> = (parts.map(|part| scope.spawn(move || compile(part)))).collect();
        let parts = started.into_iter();
        let compiled = parts.flat_map(|part| part.join().expect("no panic"));
        compiled.collect()
    })
}

/// Appends the table entry of one shader.
fn describe(shader: Compiled, table: &mut String, layouts: &mut Layouts) {
    let Compiled {
        source,
        words,
        in_storage,
        interface,
    } = shader;
    let Interface {
        bindings,
        push_bytes,
        local_size,
        constants,
        layouts: structs,
        ..
    } = interface;
    let file = source.file_name().expect("a file").to_string_lossy();
    layouts.extend(structs);
    let constant = constant(source);
    writeln!(table, "/// `{}`", source.display()).unwrap();
    writeln!(
        table,
        "pub static {constant}: Shader = Shader {{ name: {file:?}, words: &{words:?}, words_in_storage: &{in_storage:?}, bindings: &["
    )
    .unwrap();
    for (index, name, kind) in bindings {
        writeln!(
            table,
            "    Binding {{ index: {index}, name: {name:?}, kind: BindingKind::{kind} }},"
        )
        .unwrap();
    }
    writeln!(
        table,
        "], push_bytes: {push_bytes}, local_size: {local_size:?}, constants: &{constants:?} }};"
    )
    .unwrap();
}
