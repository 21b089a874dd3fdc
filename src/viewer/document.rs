//! The scene that is open: its file, its animation, and the user's edits.

use super::edits::{Edits, History, pivots};
use glam::DVec3;
use nephroid::scene::{self, Animation, Scene};
use nephroid::{Result, glam};
use std::path::{Path, PathBuf};

pub struct Document {
    pub path: PathBuf,
    animation: Animation,
    /// The scene at time 0, without edits.
    pub base: Scene,
    pivots: Vec<DVec3>,
    /// Meshes and images that the scene names.
    pub files: Vec<PathBuf>,
    pub history: History,
    /// The last scene, with the time and edits that it is of.
    cached: Option<(f64, f64, Edits, Scene)>,
}

impl Document {
    /// Reads a scene; also what was odd about it.
    ///
    /// # Errors
    /// [`nephroid::Error::Input`] where the scene cannot be used.
    pub fn open(path: &Path) -> Result<(Self, Vec<String>)> {
        let loaded = scene::load(path)?;
        let document = Self {
            path: path.to_owned(),
            animation: loaded.animation,
            pivots: pivots(&loaded.scene),
            base: loaded.scene,
            files: loaded.files,
            history: History::default(),
            cached: None,
        };
        Ok((document, loaded.warnings))
    }

    /// The scene as its file is now, with the edits that still make sense, and what is odd about it.
    ///
    /// # Errors
    /// [`nephroid::Error::Input`] where the scene cannot be used.
    pub fn reloaded(&self) -> Result<(Self, Vec<String>)> {
        let (mut new, warnings) = Self::open(&self.path)?;
        new.history = self.history.clone();
        new.history.carry_over(&self.base, &new.base);
        Ok((new, warnings))
    }

    /// Time after which nothing changes; `None` where there is none.
    pub fn end(&self) -> Option<f64> {
        self.animation.end()
    }

    /// Where an object turns, m.
    pub fn pivot(&self, object: usize) -> DVec3 {
        self.pivots[object]
    }

    /// The scene at a time with the user's edits. Light maps are `light_map_scale` times as wide and high as the scene says, and
    /// those that the user has set stay.
    pub fn scene(&mut self, time: f64, light_map_scale: f64) -> &Scene {
        let edits = &self.history.now;
        let is_current = (self.cached.as_ref()).is_some_and(|(t, scale, of, _)| {
            *t == time && *scale == light_map_scale && of == edits
        });
        if !is_current {
            let mut scene = self.animation.at(time);
            for texels in scene
                .objects
                .iter_mut()
                .filter_map(|object| object.light_map.as_mut())
            {
                *texels = texels.map(|side| scaled(side, light_map_scale));
            }
            edits.apply(&mut scene, &self.pivots);
            self.cached = Some((time, light_map_scale, edits.clone(), scene));
        }
        &self.cached.as_ref().expect("made above").3
    }
}

fn scaled(side: u32, factor: f64) -> u32 {
    let scaled = f64::from(side) * factor;
    (scaled.round() as u32).clamp(1, scene::MAX_LIGHT_MAP_SIDE)
}
