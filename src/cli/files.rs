//! The files that a command reads and writes.

use super::terminal::log_some;
use super::timeline::{Shot, Timeline};
use clap::Args;
use nephroid::output::{cannot_write, check_writable};
use nephroid::scene::{self, Loaded, Scene};
use nephroid::{Error, Result};
use std::path::{Path, PathBuf};

#[derive(Args)]
pub struct Files {
    /// Scene file (.toml)
    pub scene: PathBuf,
    /// Image file to write
    #[arg(short, long)]
    pub output: PathBuf,
}

/// Layer of a reference's file with the standard error of each of its values.
pub const STANDARD_ERROR: &str = "error";

/// Files of a command that writes the light map of one receiver, as EXR.
#[derive(Args)]
pub struct MapFiles {
    #[command(flatten)]
    pub files: Files,
    /// Receiver; optional if the scene has only one
    #[arg(long)]
    receiver: Option<String>,
}

impl Files {
    /// The pictures to make. Checks before the work that the output has one of these extensions and that its
    /// folder is writable.
    pub fn shots(&self, timeline: &Timeline, extensions: &[&str]) -> Result<Vec<Shot>> {
        if !extensions.iter().any(|e| has_extension(&self.output, e)) {
            let kinds = extensions.join(" or .");
            return Err(Error::Usage {
                reason: format!("{} is no .{kinds} file", self.output.display()),
                remedy: format!("end the output's name with .{kinds}"),
            });
        }
        let shots = timeline.shots(&self.output);
        // The last one has the longest name.
        check_writable(&shots[shots.len() - 1].file)?;
        Ok(shots)
    }

    /// Loads the scene, if none of the pictures would replace a file that it is read from.
    pub fn load(&self, shots: &[Shot]) -> Result<Loaded> {
        let loaded = load_scene(&self.scene)?;
        let canonical = |path: &PathBuf| path.canonicalize().ok();
        let inputs: Vec<PathBuf> = (loaded.files.iter().chain([&self.scene]))
            .filter_map(canonical)
            .collect();
        match shots
            .iter()
            .find(|shot| canonical(&shot.file).is_some_and(|file| inputs.contains(&file)))
        {
            None => Ok(loaded),
            Some(shot) => Err(Error::Usage {
                reason: format!("{} is a file of the scene", shot.file.display()),
                remedy: "write to another file".into(),
            }),
        }
    }
}

impl MapFiles {
    /// Index and texels of the receiver that was asked for, or of the only one.
    pub fn find_receiver(&self, scene: &Scene) -> Result<(usize, [u32; 2])> {
        let receivers = scene.light_maps();
        let names: Vec<&str> = (receivers.iter())
            .map(|&(index, _)| scene.objects[index].name.as_str())
            .collect();
        if names.is_empty() {
            return Err(Error::Input {
                file: self.files.scene.clone(),
                place: None,
                reason: "the scene has no receiver".into(),
                remedy: "give a diffuse rect or mesh of the scene a `lightmap = [256, 256]`".into(),
            });
        }
        let usage = |reason: String| {
            let remedy = format!("choose one with --receiver: {}", names.join(", "));
            Err(Error::Usage { reason, remedy })
        };
        match &self.receiver {
            Some(name) => match names.iter().position(|candidate| candidate == name) {
                Some(position) => Ok(receivers[position]),
                None => usage(format!("the scene has no receiver called `{name}`")),
            },
            None => match receivers.as_slice() {
                [only] => Ok(*only),
                several => usage(format!("the scene has {} receivers", several.len())),
            },
        }
    }
}

/// Loads a scene; warnings go to the log.
pub fn load_scene(path: &Path) -> Result<Loaded> {
    let loaded = scene::load(path)?;
    log_some("warning", &loaded.warnings);
    Ok(loaded)
}

/// Start of the comment in the EXR file of a view.
const RADIANCE: &str = "radiance, W/m^2/sr; exposure_ev ";

/// Comment in the EXR file of a view: the unit, and the exposure of the scene's camera.
pub fn radiance_comment(exposure_ev: f64) -> String {
    format!("{RADIANCE}{exposure_ev}")
}

/// The exposure in the comment of a view's EXR file; `None` for light maps and files of other programs.
pub fn exposure_of(comment: &str) -> Option<f64> {
    let rest = comment.strip_prefix(RADIANCE)?;
    let number = rest.split(';').next()?.trim();
    number
        .parse()
        .ok()
        .filter(|exposure: &f64| exposure.is_finite())
}

/// Serialises a path; bytes that are not Unicode become replacement characters.
pub fn lossy<S: serde::Serializer>(path: &Path, serializer: S) -> Result<S::Ok, S::Error> {
    serializer.serialize_str(&path.to_string_lossy())
}

/// Whether the file's name has the extension `wanted`, in either case.
pub fn has_extension(path: &Path, wanted: &str) -> bool {
    path.extension()
        .is_some_and(|extension| extension.eq_ignore_ascii_case(wanted))
}

/// Creates a folder, and checks before the work that these files can be written there.
pub fn make_folder(folder: &Path, files: &[impl AsRef<Path>]) -> Result<()> {
    std::fs::create_dir_all(folder).map_err(|error| cannot_write(folder, &error))?;
    (files.iter()).try_for_each(|file| check_writable(&folder.join(file)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn exposures_are_found_in_views_only() {
        for exposure in [0.0, -1.9, 1.8, 1e-3, 12.25] {
            let comment = radiance_comment(exposure);
            assert_eq!(exposure_of(&comment), Some(exposure));
            assert_eq!(exposure_of(&(comment + "; seed 7")), Some(exposure));
        }
        for other in [
            "",
            "caustic irradiance, W/m^2",
            "radiance, W/m^2/sr",
            "radiance, W/m^2/sr; exposure_ev x",
            "radiance, W/m^2/sr; exposure_ev inf",
        ] {
            assert_eq!(exposure_of(other), None, "{other}");
        }
    }
}
