//! The scenes that come with nephroid, in its source tree.

use nephroid::{Error, Result};
use std::path::{Path, PathBuf};

/// Folder of the scenes.
pub const FOLDER: &str = "assets/scenes";

/// All of them, in the order of their names.
///
/// # Errors
/// [`Error::Usage`] outside of the source tree.
pub fn all() -> Result<Vec<PathBuf>> {
    let entries = Path::new(FOLDER).read_dir().map_err(|_| missing())?;
    let mut files: Vec<PathBuf> = entries
        .filter_map(|entry| Some(entry.ok()?.path()))
        .filter(|file| {
            file.extension()
                .is_some_and(|extension| extension == "toml")
        })
        .collect();
    files.sort();
    Ok(files)
}

/// The files of the scenes with these names.
///
/// # Errors
/// [`Error::Usage`] outside of the source tree.
pub fn named(names: &[&str]) -> Result<Vec<PathBuf>> {
    if !Path::new(FOLDER).is_dir() {
        return Err(missing());
    }
    let file = |name: &&str| Path::new(FOLDER).join(name).with_extension("toml");
    Ok(names.iter().map(file).collect())
}

fn missing() -> Error {
    Error::Usage {
        reason: format!("there are no scenes in {FOLDER}"),
        remedy: "name scene files, or run in nephroid's source tree".into(),
    }
}
