//! The files of `glsl/`, and which shaders include which of them.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

const STAGES: [&str; 3] = ["comp", "vert", "frag"];

/// All sources in a folder and the folders in it.
pub fn files(folder: &Path) -> Vec<PathBuf> {
    let entries = folder.read_dir().into_iter().flatten().flatten();
    let paths = entries.map(|entry| entry.path());
    let files = paths.flat_map(|path| match path.is_dir() {
        true => files(&path),
        false => vec![path],
    });
    let is_source =
        |path: &PathBuf| is_shader(path) || path.extension().is_some_and(|e| e == "glsl");
    files.filter(is_source).collect()
}

/// Shaders that are among the changed files or include one of them.
pub fn affected(folder: &Path, changed: &BTreeSet<PathBuf>) -> Vec<PathBuf> {
    let shaders = files(folder).into_iter().filter(|path| is_shader(path));
    let is_affected = |shader: &PathBuf| {
        let mut seen = BTreeSet::new();
        collect(shader.clone(), &shared(folder), &mut seen);
        !seen.is_disjoint(changed)
    };
    shaders.filter(is_affected).collect()
}

/// Where files are that a shader's own folder does not have.
pub fn shared(folder: &Path) -> PathBuf {
    folder.join("shared")
}

fn is_shader(path: &Path) -> bool {
    (path.extension()).is_some_and(|extension| STAGES.iter().any(|stage| extension == *stage))
}

/// Adds a file and what it includes.
fn collect(file: PathBuf, shared: &Path, seen: &mut BTreeSet<PathBuf>) {
    // The compiler says why a file cannot be read.
    let text = std::fs::read_to_string(&file).unwrap_or_default();
    if !seen.insert(file.clone()) {
        return;
    }
    let included = text.lines().filter_map(|line| {
        let name = line
            .trim_start()
            .strip_prefix("#include")?
            .split('"')
            .nth(1)?;
        let beside = file.with_file_name(name);
        Some(match beside.exists() {
            true => beside,
            false => shared.join(name),
        })
    });
    included.for_each(|file| collect(file, shared, seen));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn includes_are_followed() {
        let folder = tempfile::tempdir().unwrap();
        let path = |name: &str| folder.path().join(name);
        for (name, text) in [
            ("shared/a.glsl", "#include \"b.glsl\"\n#include \"a.glsl\""),
            ("shared/b.glsl", "float b;"),
            ("view/c.glsl", "float c;"),
            ("view/far.comp", "#include \"a.glsl\""),
            (
                "view/near.frag",
                "  #include \"c.glsl\"\n#include \"missing.glsl\"",
            ),
            ("view/none.vert", "void main() {}"),
        ] {
            std::fs::create_dir_all(path(name).parent().unwrap()).unwrap();
            std::fs::write(path(name), text).unwrap();
        }
        for (changed, expected) in [
            ("shared/b.glsl", "view/far.comp"),
            ("view/c.glsl", "view/near.frag"),
            ("shared/missing.glsl", "view/near.frag"),
            ("view/none.vert", "view/none.vert"),
        ] {
            let found = affected(folder.path(), &[path(changed)].into());
            assert_eq!(found, [path(expected)], "{changed}");
        }
        assert_eq!(files(folder.path()).len(), 6);
    }
}
