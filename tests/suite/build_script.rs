//! The build script without a shader compiler, and with one that does not work: one error for each cause.

use std::path::{Path, PathBuf};
use std::process::Command;

/// The newest build script of this package, beside its output.
fn build_script() -> PathBuf {
    let builds = Path::new(env!("OUT_DIR")).ancestors().nth(2).unwrap();
    let scripts = (builds.read_dir().unwrap())
        .map(|entry| entry.unwrap().path())
        .filter(|folder| (folder.file_name().unwrap().to_string_lossy()).starts_with("nephroid-"))
        .map(|folder| folder.join("build-script-build"))
        .filter(|script| script.exists());
    let age = |script: &PathBuf| script.metadata().unwrap().modified().unwrap();
    scripts.max_by_key(age).expect("a built build script")
}

/// Errors of the script in this folder with this shader compiler.
fn errors(folder: &Path, glslc: &str) -> Vec<String> {
    let out = tempfile::tempdir().unwrap();
    let output = Command::new(build_script())
        .current_dir(folder)
        .env("OUT_DIR", out.path())
        .env("GLSLC", glslc)
        .env_remove("VULKAN_SDK")
        .output()
        .unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr);
    assert!(!stderr.contains("panicked"), "{stderr}");
    let printed = String::from_utf8(output.stdout).unwrap();
    let found: Vec<String> = (printed.lines())
        .filter_map(|line| line.strip_prefix("cargo::error="))
        .map(str::to_owned)
        .collect();
    assert_eq!(output.status.success(), found.is_empty(), "{printed}");
    found
}

#[test]
#[cfg(not(feature = "bundled-shaderc"))]
fn a_shader_compiler_that_does_not_work_is_one_error() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR"));
    let empty = tempfile::tempdir().unwrap();
    for (folder, glslc, part) in [
        (here, "/nonexistent/glslc", "does not start"),
        (here, "/bin/false", "the shader compiler /bin/false"),
        (here, "", "the variable GLSLC is empty"),
        (empty.path(), "glslc", "the folder glsl"),
    ] {
        let found = errors(folder, glslc);
        assert_eq!(found.len(), 1, "{found:?}");
        assert!(found[0].contains(part), "{found:?}");
    }
    // That nothing is wrong with one that works, the build of this test has shown. One that writes nothing of use.
    let found = errors(here, "/bin/true");
    assert!(!found.is_empty());
    assert!(
        found.iter().all(|error| error.contains("wrote nothing")),
        "{found:?}"
    );
}
