//! Where a scene may read files, and how much.

use super::memory;
use crate::error::{Error, Result};
use std::fs::File;
use std::io::Read;
use std::path::{Component, Path, PathBuf};

/// The folder that a scene's files may come from: the nearest folder above the scene file that is
/// named `assets`, otherwise the scene file's own.
pub struct AssetRoot(PathBuf);

impl AssetRoot {
    /// `scene` must exist.
    pub fn of(scene: &Path) -> Result<Self> {
        let scene = scene.canonicalize().map_err(|e| unreadable(scene, &e))?;
        let root = (scene.ancestors().skip(1))
            .find(|folder| folder.file_name().is_some_and(|name| name == "assets"))
            .or(scene.parent());
        Ok(Self(root.unwrap_or(&scene).to_owned()))
    }

    /// Path of the file that `from`, a file of this scene, calls `name`.
    ///
    /// # Errors
    /// The reason why there is no such path: absolute, outside the root (through a symbolic link,
    /// too), missing, or not a file.
    pub fn resolve(&self, from: &Path, name: &str) -> Result<PathBuf, String> {
        let path = self.inside(from, name)?;
        if !path.is_file() {
            return Err(format!("`{name}` is not a file"));
        }
        Ok(path)
    }

    /// Paths of the files in the folder that `from` calls `name` whose names end in `.extension`,
    /// in the order of their names.
    ///
    /// # Errors
    /// The reason, as for [`AssetRoot::resolve`]; or that there is no such file.
    pub fn resolve_folder(
        &self,
        from: &Path,
        name: &str,
        extension: &str,
    ) -> Result<Vec<PathBuf>, String> {
        let folder = self.inside(from, name)?;
        let cannot = |e| format!("`{name}` cannot be read: {e}");
        let mut names = Vec::new();
        for entry in folder.read_dir().map_err(cannot)? {
            let file = Path::new(name).join(entry.map_err(cannot)?.file_name());
            if (file.extension()).is_some_and(|found| found.eq_ignore_ascii_case(extension)) {
                let file = file.to_str().ok_or("a file's name is not Unicode")?;
                names.push(file.to_owned());
            }
        }
        if names.is_empty() {
            return Err(format!("`{name}` holds no .{extension} file"));
        }
        names.sort();
        names.iter().map(|file| self.resolve(from, file)).collect()
    }

    /// Path of what `from` calls `name`, which exists under the root.
    fn inside(&self, from: &Path, name: &str) -> Result<PathBuf, String> {
        let relative = Path::new(name);
        let descends = |c| {
            matches!(
                c,
                Component::Normal(_) | Component::ParentDir | Component::CurDir
            )
        };
        if name.is_empty() || !relative.components().all(descends) {
            return Err(format!("`{name}` is not a relative path"));
        }
        let outside = || format!("`{name}` leads out of the asset root {}", self.0.display());
        let cannot = |e| format!("`{name}` cannot be read: {e}");
        let mut written = from.canonicalize().map_err(cannot)?;
        written.pop();
        // The path as written is judged first, so that the answer does not tell what lies outside.
        for component in relative.components() {
            match component {
                Component::ParentDir => {
                    written.pop();
                }
                component => written.push(component),
            }
            if !written.starts_with(&self.0) {
                return Err(outside());
            }
        }
        let path = from.with_file_name(relative);
        let real = path.canonicalize().map_err(cannot)?;
        if !real.starts_with(&self.0) {
            return Err(outside());
        }
        Ok(path)
    }
}

/// The bytes of a file of at most `limit` bytes.
pub fn read(path: &Path, limit: u64) -> Result<Vec<u8>> {
    // Opening a pipe would wait for its writer.
    let metadata = path.metadata().map_err(|e| unreadable(path, &e))?;
    if !metadata.is_file() {
        let what = if metadata.is_dir() {
            "a folder"
        } else {
            "not a regular file"
        };
        return Err(refused(path, &format!("it is {what}"), "name a file"));
    }
    (memory::check("its content", metadata.len().min(limit)))
        .map_err(|reason| refused(path, &reason, memory::REMEDY))?;
    let mut content = Vec::new();
    File::open(path)
        .and_then(|file| file.take(limit + 1).read_to_end(&mut content))
        .map_err(|e| unreadable(path, &e))?;
    if content.len() as u64 > limit {
        let reason = format!("the file is larger than {} MiB", limit >> 20);
        return Err(refused(path, &reason, "use a smaller file"));
    }
    Ok(content)
}

/// An error of a whole file.
pub fn refused(path: &Path, reason: &str, remedy: &str) -> Error {
    Error::Input {
        file: path.to_owned(),
        place: None,
        reason: reason.into(),
        remedy: remedy.into(),
    }
}

/// An error on a line of a file.
pub fn at_line(path: &Path, line: usize, reason: &str, remedy: &str) -> Error {
    Error::Input {
        file: path.to_owned(),
        place: Some(format!("line {line}")),
        reason: reason.into(),
        remedy: remedy.into(),
    }
}

fn unreadable(path: &Path, error: &std::io::Error) -> Error {
    let reason = format!("cannot be read: {error}");
    refused(
        path,
        &reason,
        "check the path and your right to read the file",
    )
}
