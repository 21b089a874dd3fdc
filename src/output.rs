//! Files on disk, written whole or not at all.
//!
//! A regular file is written beside its place and then renamed. What can be opened but not replaced, as a FIFO,
//! is written to. Symbolic links are followed. A file that exists keeps its mode and owner; a new one gets its mode
//! from the umask.

use crate::error::{Error, Result};
use std::fs::{File, Metadata, OpenOptions};
use std::io::{ErrorKind, Write};
use std::path::{Path, PathBuf};
use std::sync::Mutex;
use tempfile::TempPath;

/// Files that a signal has to remove. Locked while one is made or renamed.
static TEMPORARY: Mutex<Vec<PathBuf>> = Mutex::new(Vec::new());

/// Removes all temporary files, and lets no new one be made: for a program that ends at once.
pub fn remove_temporary_files() {
    let files = TEMPORARY.lock();
    for file in files.iter().flat_map(|files| files.iter()) {
        let _ = std::fs::remove_file(file);
    }
    std::mem::forget(files);
}

/// Finds out before a long computation whether [`write_atomically`] will work.
///
/// # Errors
/// [`Error::Output`] where the folder is missing or cannot be written, or the name is too long.
pub fn check_writable(path: &Path) -> Result<()> {
    match Target::of(path)? {
        Target::Special(_) => Ok(()),
        Target::Regular { file, .. } => Temporary::beside(path, &file).map(drop),
    }
}

/// Writes `content` to a temporary file beside `path`, then renames it, so that `path` is either
/// the old file or the whole new one.
///
/// # Errors
/// [`Error::Output`] where the folder is missing or cannot be written, or the disk is full.
pub fn write_atomically(path: &Path, content: &[u8]) -> Result<()> {
    let failed = |error| cannot_write(path, &error);
    match Target::of(path)? {
        Target::Special(special) => (OpenOptions::new().write(true).open(special))
            .and_then(|mut file| file.write_all(content))
            .map_err(failed),
        Target::Regular { file, old } => {
            let mut temporary = Temporary::beside(path, &file)?;
            temporary.file.write_all(content).map_err(failed)?;
            if let Some(old) = old {
                keep_owner_and_mode(&temporary.file, &old).map_err(failed)?;
            }
            temporary.rename(&file).map_err(failed)
        }
    }
}

/// Where a path leads.
enum Target {
    /// A regular file, and what is there now.
    Regular {
        file: PathBuf,
        old: Option<Metadata>,
    },
    /// A FIFO or a device.
    Special(PathBuf),
}

impl Target {
    fn of(path: &Path) -> Result<Self> {
        let file = followed(path).map_err(|e| cannot_write(path, &e))?;
        let old = match file.metadata() {
            Ok(metadata) => metadata,
            Err(error) if error.kind() == ErrorKind::NotFound => {
                return Ok(Self::Regular { file, old: None });
            }
            Err(error) => return Err(cannot_write(path, &error)),
        };
        if old.is_dir() {
            let error = std::io::Error::from(ErrorKind::IsADirectory);
            return Err(cannot_write(path, &error));
        }
        if !old.is_file() {
            return Ok(Self::Special(file));
        }
        // A file that may not be written is not replaced, either.
        let opened = OpenOptions::new().write(true).open(&file);
        opened.map_err(|e| cannot_write(path, &e))?;
        Ok(Self::Regular {
            file,
            old: Some(old),
        })
    }
}

/// The path behind symbolic links, of which the last may lead to nothing.
fn followed(path: &Path) -> std::io::Result<PathBuf> {
    const MOST_LINKS: usize = 40; // as Linux
    let mut path = path.to_owned();
    for _ in 0..MOST_LINKS {
        match path.symlink_metadata() {
            Ok(metadata) if metadata.is_symlink() => {}
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(error),
            _ => return Ok(path),
        }
        let link = path.read_link()?;
        path = match path.parent() {
            Some(folder) => folder.join(link),
            None => link,
        };
    }
    Err(std::io::Error::other("too many symbolic links"))
}

/// A file that vanishes unless it is renamed.
struct Temporary {
    file: File,
    path: Option<TempPath>,
}

impl Temporary {
    /// A temporary file beside `file`; messages call it `name`.
    fn beside(name: &Path, file: &Path) -> Result<Self> {
        let folder = match file.parent() {
            Some(parent) if !parent.as_os_str().is_empty() => parent,
            _ => Path::new("."),
        };
        let mut builder = tempfile::Builder::new();
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            builder.permissions(std::fs::Permissions::from_mode(0o666)); // less the umask
        }
        let mut files = TEMPORARY.lock().expect("no panic while held");
        // The error's own text would name the temporary file.
        let made = (builder.tempfile_in(folder)).map_err(|e| cannot_write(name, &plain(&e)))?;
        files.push(made.path().to_owned());
        let (file, path) = made.into_parts();
        Ok(Self {
            file,
            path: Some(path),
        })
    }

    fn rename(mut self, to: &Path) -> std::io::Result<()> {
        let mut files = TEMPORARY.lock().expect("no panic while held");
        let path = self.path.take().expect("renamed once");
        files.retain(|file| *file != *path);
        path.persist(to).map_err(|e| plain(&e.error))
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if let (Some(path), Ok(mut files)) = (self.path.take(), TEMPORARY.lock()) {
            files.retain(|file| *file != *path);
        }
    }
}

/// The error without the path that the crate tempfile adds.
fn plain(error: &std::io::Error) -> std::io::Error {
    match error.raw_os_error() {
        Some(code) => std::io::Error::from_raw_os_error(code),
        None => error.kind().into(),
    }
}

#[cfg(unix)]
fn keep_owner_and_mode(file: &File, old: &Metadata) -> std::io::Result<()> {
    use std::os::unix::fs::{MetadataExt, fchown};
    let new = file.metadata()?;
    if (new.uid(), new.gid()) != (old.uid(), old.gid()) {
        // Only root may; for others the file is theirs from now on, as with other tools that replace files.
        let _ = fchown(file, Some(old.uid()), Some(old.gid()));
    }
    file.set_permissions(old.permissions())
}

#[cfg(not(unix))]
fn keep_owner_and_mode(_: &File, _: &Metadata) -> std::io::Result<()> {
    Ok(())
}

/// The reason is the system's, and the remedy suits it.
pub fn cannot_write(path: &Path, error: &std::io::Error) -> Error {
    let remedy = match error.kind() {
        ErrorKind::StorageFull | ErrorKind::QuotaExceeded => {
            "free some space there, or write to another disk"
        }
        ErrorKind::InvalidFilename => "choose a shorter name",
        ErrorKind::NotFound => "make the folder first, or name another one",
        ErrorKind::IsADirectory => "name a file in it",
        ErrorKind::BrokenPipe => "keep what reads it running",
        _ => "name a file in an existing folder that you may write to",
    };
    if error.kind() == ErrorKind::IsADirectory {
        return Error::Output {
            file: path.to_owned(),
            reason: "it is a folder".into(),
            remedy: remedy.into(),
        };
    }
    // Without the code, as in "No space left on device (os error 28)".
    let reason = error.to_string();
    let reason = reason.split(" (os error").next().unwrap_or_default();
    Error::Output {
        file: path.to_owned(),
        reason: reason.into(),
        remedy: remedy.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn unwritable_places_are_found_before_the_work() {
        let folder = tempfile::tempdir().unwrap();
        assert!(check_writable(&folder.path().join("map.exr")).is_ok());
        assert!(!folder.path().join("map.exr").exists());
        assert!(check_writable(&folder.path().join("missing/map.exr")).is_err());
        assert!(check_writable(folder.path()).is_err());
        let long = folder.path().join("x".repeat(300));
        let message = check_writable(&long).unwrap_err().to_string();
        assert!(message.contains("choose a shorter name"), "{message}");
    }

    #[test]
    #[cfg(unix)]
    fn modes_links_and_pipes_are_kept() {
        use std::os::unix::fs::{FileTypeExt, PermissionsExt, symlink};
        let folder = tempfile::tempdir().unwrap();
        let at = |name: &str| folder.path().join(name);
        let mode = |name: &str| at(name).metadata().unwrap().permissions().mode() & 0o777;

        std::fs::write(at("secret"), "old").unwrap();
        std::fs::set_permissions(at("secret"), std::fs::Permissions::from_mode(0o600)).unwrap();
        symlink("secret", at("link")).unwrap();
        write_atomically(&at("link"), b"new").unwrap();
        assert_eq!(std::fs::read(at("secret")).unwrap(), b"new");
        assert_eq!(mode("secret"), 0o600);
        assert!(at("link").is_symlink());

        symlink("later", at("dangling")).unwrap();
        write_atomically(&at("dangling"), b"1").unwrap();
        assert_eq!(std::fs::read(at("later")).unwrap(), b"1");
        symlink("loop", at("loop")).unwrap();
        assert!(write_atomically(&at("loop"), b"1").is_err());

        let status = std::process::Command::new("mkfifo")
            .arg(at("pipe"))
            .status();
        assert!(status.unwrap().success());
        check_writable(&at("pipe")).unwrap();
        let reader = std::thread::spawn({
            let pipe = at("pipe");
            move || std::fs::read(pipe).unwrap()
        });
        write_atomically(&at("pipe"), b"through").unwrap();
        assert_eq!(reader.join().unwrap(), b"through");
        assert!(at("pipe").metadata().unwrap().file_type().is_fifo());
        let left: Vec<_> = (folder.path().read_dir().unwrap())
            .map(|entry| entry.unwrap().file_name().into_string().unwrap())
            .filter(|name| name.starts_with('.'))
            .collect();
        assert!(left.is_empty(), "{left:?}");
    }

    #[test]
    #[cfg(target_os = "linux")]
    fn a_full_disk_is_named() {
        let message = write_atomically(Path::new("/dev/full"), b"x")
            .unwrap_err()
            .to_string();
        assert!(
            message.contains("/dev/full: cannot be written: No space left"),
            "{message}"
        );
        assert!(message.contains("free some space"), "{message}");
    }
}
