//! Where a scene may read files.

use crate::error::Result;
use crate::input::unreadable;
use std::collections::BTreeSet;
use std::path::{Component, Path, PathBuf};
use std::sync::Mutex;

/// The folder that a scene's files may come from: the nearest folder above the scene file that is
/// named `assets`, otherwise the scene file's own.
pub struct AssetRoot {
    folder: PathBuf,
    /// Resolved so far.
    files: Mutex<BTreeSet<PathBuf>>,
}

impl AssetRoot {
    /// `scene` must exist.
    pub fn of(scene: &Path) -> Result<Self> {
        let scene = scene.canonicalize().map_err(|e| unreadable(scene, &e))?;
        let root = (scene.ancestors().skip(1))
            .find(|folder| folder.file_name().is_some_and(|name| name == "assets"))
            .or(scene.parent());
        Ok(Self {
            folder: root.unwrap_or(&scene).to_owned(),
            files: Mutex::default(),
        })
    }

    /// The files that the scene names, as resolved.
    pub fn files(self) -> Vec<PathBuf> {
        let files = self.files.into_inner().expect("no panic while held");
        files.into_iter().collect()
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
        let mut files = self.files.lock().expect("no panic while held");
        files.insert(path.clone());
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
        let outside = || {
            format!(
                "`{name}` leads out of the asset root {}",
                self.folder.display()
            )
        };
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
            if !written.starts_with(&self.folder) {
                return Err(outside());
            }
        }
        let path = from.with_file_name(relative);
        let real = path.canonicalize().map_err(cannot)?;
        if !real.starts_with(&self.folder) {
            return Err(outside());
        }
        // For messages, without `scenes/../`, unless a link leads elsewhere.
        let short = shortened(&path);
        match short.canonicalize() {
            Ok(same) if same == real => Ok(short),
            _ => Ok(path),
        }
    }
}

/// The path without folders that `..` leaves at once.
fn shortened(path: &Path) -> PathBuf {
    let mut short = PathBuf::new();
    for component in path.components() {
        match component {
            Component::ParentDir
                if matches!(short.components().next_back(), Some(Component::Normal(_))) =>
            {
                short.pop();
            }
            component => short.push(component),
        }
    }
    short
}
