//! Notices that the files of a scene changed on disk.

use std::path::{Path, PathBuf};
use std::time::SystemTime;

/// What is compared: a file that is replaced within the clock's resolution has another size most of the time.
type Stamp = Option<(SystemTime, u64)>;

/// Files with their state when they were last looked at.
#[derive(Default)]
pub struct Watch(Vec<(PathBuf, Stamp)>);

impl Watch {
    /// Looks at these files from now on.
    pub fn new(files: impl Iterator<Item = PathBuf>) -> Self {
        Self(files.map(|file| (file.clone(), stamp(&file))).collect())
    }

    /// Looks at these files, too.
    #[cfg(feature = "dev")]
    pub fn add(&mut self, files: impl Iterator<Item = PathBuf>) {
        for file in files {
            if !self.0.iter().any(|(known, _)| *known == file) {
                self.0.push((file.clone(), stamp(&file)));
            }
        }
    }

    /// Whether any file changed since the last call.
    pub fn has_changed(&mut self) -> bool {
        !self.changed().is_empty()
    }

    /// The files that changed since the last call.
    pub fn changed(&mut self) -> Vec<PathBuf> {
        let mut changed = Vec::new();
        for (file, last) in &mut self.0 {
            let now = stamp(file);
            // A file that is gone is about to be replaced.
            if now.is_some() && now != *last {
                changed.push(file.clone());
            }
            *last = now.or(*last);
        }
        changed
    }
}

fn stamp(file: &Path) -> Stamp {
    let metadata = file.metadata().ok()?;
    Some((metadata.modified().ok()?, metadata.len()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_is_replaced_has_changed_once() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("scene.toml");
        std::fs::write(&file, "a").unwrap();
        let mut watch = Watch::new([file.clone()].into_iter());
        assert!(!watch.has_changed());
        std::fs::write(&file, "ab").unwrap();
        assert!(watch.has_changed());
        assert!(!watch.has_changed());
        std::fs::remove_file(&file).unwrap();
        assert!(!watch.has_changed());
        std::fs::write(&file, "abc").unwrap();
        assert!(watch.has_changed());
    }
}
