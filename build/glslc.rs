//! The program glslc, which compiles the shaders: while nephroid is built, and in a build with the feature `dev` while it runs.

use std::path::{Path, PathBuf};
use std::process::Command;

const REMEDY: &str = "install glslc (Debian: apt-get install glslc; elsewhere the Vulkan SDK), or build with \
     --features bundled-shaderc";

/// A glslc that runs.
pub struct Compiler(PathBuf);

impl Compiler {
    /// That of `$GLSLC`, of `$VULKAN_SDK`, or of `PATH`, if it runs.
    ///
    /// # Errors
    /// Why it does not, and a remedy.
    pub fn find() -> Result<Self, String> {
        let sdk = std::env::var_os("VULKAN_SDK").map(|sdk| Path::new(&sdk).join("bin/glslc"));
        let (program, from) = match (std::env::var_os("GLSLC"), sdk.filter(|path| path.exists())) {
            (Some(program), _) if program.is_empty() => {
                return Err(format!(
                    "the variable GLSLC is empty: unset it or name the shader compiler, or {REMEDY}"
                ));
            }
            (Some(program), _) => (program.into(), "named by the variable GLSLC"),
            (None, Some(program)) => (program, "of the Vulkan SDK"),
            (None, None) => ("glslc".into(), "looked for in PATH"),
        };
        let name = format!("the shader compiler {}, {from},", program.display());
        let run = Command::new(&program).arg("--version").output();
        let output = run.map_err(|error| format!("{name} does not start: {error}; {REMEDY}"))?;
        if !output.status.success() {
            return Err(format!("{name} fails: {}; {REMEDY}", output.status));
        }
        Ok(Self(program))
    }

    /// Words of a shader, which are written to `output` on the way. Files that it includes are beside it or in `shared`;
    /// `macro_` is defined while compiling.
    ///
    /// # Errors
    /// What the compiler says.
    pub fn compile(
        &self,
        source: &Path,
        shared: &Path,
        macro_: Option<&str>,
        output: &Path,
    ) -> Result<Vec<u32>, String> {
        // What an earlier run left is not taken for the compiler's.
        let _ = std::fs::remove_file(output);
        let run = Command::new(&self.0)
            .args(["--target-env=vulkan1.3", "-O", "-g", "-Werror", "-I"])
            .arg(shared)
            .arg("-o")
            .arg(output)
            .args(macro_.map(|name| format!("-D{name}")))
            .arg(source)
            .output()
            .map_err(|error| format!("{} does not start: {error}", self.0.display()))?;
        if !run.status.success() {
            let messages = String::from_utf8_lossy(&run.stderr);
            let source = source.display();
            return Err(format!(
                "{source}: {}: {}\n{messages}",
                self.0.display(),
                run.status
            ));
        }
        let bytes = std::fs::read(output).map_err(|error| {
            format!(
                "{}: {} wrote nothing: {error}",
                source.display(),
                self.0.display()
            )
        })?;
        Ok(bytes
            .chunks_exact(4)
            .map(|b| u32::from_le_bytes([b[0], b[1], b[2], b[3]]))
            .collect())
    }
}
