//! Files that users give: read whole, within a limit.

use crate::error::{Error, Result};
use crate::scene::memory;
use std::fs::File;
use std::io::Read;
use std::path::Path;

/// The bytes of a regular file of at most `limit` bytes.
///
/// # Errors
/// [`Error::Input`]
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
    let too_large = || {
        let reason = format!("the file is larger than {} MiB", limit >> 20);
        Err(refused(path, &reason, "use a smaller file"))
    };
    if metadata.len() > limit {
        return too_large();
    }
    (memory::check("its content", metadata.len()))
        .map_err(|reason| refused(path, &reason, memory::REMEDY))?;
    let mut content = Vec::new();
    File::open(path)
        .and_then(|file| file.take(limit + 1).read_to_end(&mut content))
        .map_err(|e| unreadable(path, &e))?;
    if content.len() as u64 > limit {
        // It has grown.
        return too_large();
    }
    Ok(content)
}

/// The text of a regular file of at most 16 MiB.
///
/// # Errors
/// [`Error::Input`], also where it is not UTF-8.
pub fn read_text(path: &Path) -> Result<String> {
    String::from_utf8(read(path, 16 << 20)?)
        .map_err(|e| refused(path, &format!("not UTF-8 text: {e}"), "name a text file"))
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

/// An error of the system's.
pub fn unreadable(path: &Path, error: &std::io::Error) -> Error {
    let reason = format!("cannot be read: {error}");
    refused(
        path,
        &reason,
        "check the path and your right to read the file",
    )
}
