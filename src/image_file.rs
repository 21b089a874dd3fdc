//! Images on disk: linear 32-bit float EXR and tone-mapped PNG, written whole or not at all.

use crate::error::{Error, Result};
use std::io::Write;
use std::path::Path;

/// Rows from the top, RGB, linear. A light map's last row is v = 0.
#[derive(Debug, Clone)]
pub struct RgbImage {
    pub width: u32,
    pub height: u32,
    /// `width * height` values.
    pub pixels: Vec<[f32; 3]>,
}

/// Writes `content` to a temporary file beside `path`, then renames it, so that `path` is either
/// the old file or the whole new one.
///
/// # Errors
/// [`Error::Output`] where the folder is missing or cannot be written.
pub fn write_atomically(path: &Path, content: &[u8]) -> Result<()> {
    let folder = match path.parent() {
        Some(parent) if !parent.as_os_str().is_empty() => parent,
        _ => Path::new("."),
    };
    let output = |reason: String| Error::Output {
        file: path.to_owned(),
        reason,
        remedy: "name a file in an existing folder that you may write to".into(),
    };
    if path.is_dir() {
        return Err(output("it is a folder".into()));
    }
    let mut file = tempfile::NamedTempFile::new_in(folder).map_err(|e| output(e.to_string()))?;
    file.write_all(content).map_err(|e| output(e.to_string()))?;
    #[cfg(unix)]
    {
        // NamedTempFile is private to the user; the result is an ordinary file.
        use std::os::unix::fs::PermissionsExt;
        let ordinary = std::fs::Permissions::from_mode(0o644);
        (file.as_file().set_permissions(ordinary)).map_err(|e| output(e.to_string()))?;
    }
    file.persist(path).map_err(|e| output(e.to_string()))?;
    Ok(())
}
