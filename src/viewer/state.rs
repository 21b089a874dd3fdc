//! State of the window and requests of the user, without Vulkan.

use super::compare::Compare;
use super::document::Document;
use super::edits::with_exposure_of;
use super::handles::Drag;
#[cfg(feature = "dev")]
use super::loss::Loss;
use super::playback::Playback;
use super::profiler::Profiler;
use super::quality::{MOTION, Quality};
use super::technique::Technique;
use nephroid::gpu::DeviceInfo;
use nephroid::render::Overlay;
use nephroid::scene::{Camera, Scene};
use std::collections::VecDeque;
use std::path::PathBuf;

/// Lines that the window shows, at most.
const MAX_MESSAGES: usize = 6;

/// What handles move.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Selected {
    Object(usize),
    Light(usize),
}

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Severity {
    Note,
    Error,
    /// Stays until the shaders are mended, whatever becomes of the scene.
    #[cfg(feature = "dev")]
    ShaderError,
}

/// Requests of the panels and keys to the program.
#[derive(Debug, Clone, PartialEq)]
pub enum Request {
    /// PNG, EXR and sidecar, beside each other.
    Screenshot(PathBuf),
    Save(PathBuf),
    /// Chrome trace and CSV.
    ExportProfile(PathBuf),
    Open(PathBuf),
    /// The next frame fails as if the system had taken this away.
    #[cfg(feature = "dev")]
    Lose(Loss),
    Quit,
}

/// Which windows are open.
#[derive(Debug, Clone, Copy)]
pub struct Windows {
    pub panels: bool,
    pub profiler: bool,
    pub help: bool,
}

/// A file that would be overwritten, and what to do with it.
#[derive(Debug, Clone, Default)]
pub struct SaveDialog {
    pub is_open: bool,
    pub name: String,
    /// The user was asked about overwriting this name.
    pub confirms: Option<String>,
}

pub struct State {
    pub document: Document,
    pub quality: Quality,
    pub compare: Compare,
    pub playback: Playback,
    /// The camera that the user moved; `None` follows the scene's.
    pub camera: Option<Camera>,
    pub selected: Option<Selected>,
    /// What the pointer is doing in the picture.
    pub drag: Option<Drag>,
    pub windows: Windows,
    /// What is drawn over the picture of how it was computed.
    pub overlays: Vec<Overlay>,
    pub save: SaveDialog,
    pub messages: VecDeque<(Severity, String)>,
    pub requests: Vec<Request>,
    pub profiler: Profiler,
    pub device: DeviceInfo,
    /// How far a still picture has become finer.
    pub stage: u32,
    /// Number of screenshots, for their names.
    pub screenshots: u32,
}

impl State {
    /// Shows a document by a technique.
    pub fn new(document: Document, technique: Technique, device: DeviceInfo) -> Self {
        Self {
            playback: Playback::new(document.end()),
            document,
            quality: Quality::default(),
            compare: Compare::new(technique),
            camera: None,
            selected: None,
            drag: None,
            windows: Windows {
                panels: true,
                profiler: false,
                help: false,
            },
            overlays: Vec::new(),
            save: SaveDialog::default(),
            messages: VecDeque::new(),
            requests: Vec::new(),
            profiler: Profiler::default(),
            device,
            stage: MOTION,
            screenshots: 0,
        }
    }

    /// The scene at the time that is shown, with the camera that sees it.
    pub fn scene(&mut self) -> Scene {
        let mut scene = self
            .document
            .scene(self.playback.time, self.quality.light_map_scale)
            .clone();
        if let Some(camera) = &self.camera {
            scene.camera = with_exposure_of(camera, &scene.camera);
        }
        scene
    }

    /// The camera that sees the scene.
    pub fn camera(&mut self) -> Camera {
        let scene = self
            .document
            .scene(self.playback.time, self.quality.light_map_scale);
        match &self.camera {
            Some(camera) => with_exposure_of(camera, &scene.camera),
            None => scene.camera.clone(),
        }
    }

    /// Moves the camera.
    pub fn move_camera(&mut self, by: impl FnOnce(&mut Camera)) {
        let mut camera = self.camera();
        by(&mut camera);
        self.camera = Some(camera);
    }

    /// Back to the scene as its file has it, which can be undone; the view too, which cannot.
    pub fn reset(&mut self) {
        self.camera = None;
        self.playback.time = 0.0;
        self.playback.plays = false;
        self.document.history.settle();
        self.document.history.now = Default::default();
    }

    /// Shows a line, and no line twice in a row.
    pub fn tell(&mut self, severity: Severity, text: impl Into<String>) {
        let message = (severity, text.into());
        if self.messages.back() != Some(&message) {
            self.messages.push_back(message);
        }
        while self.messages.len() > MAX_MESSAGES {
            self.messages.pop_front();
        }
    }

    /// For another document, or one that was read again.
    pub fn reloaded(&mut self) {
        let before = self.playback.clone();
        self.playback = Playback::new(self.document.end());
        self.playback.loops = before.loops;
        self.playback.plays = before.plays && self.playback.moves();
        self.playback.time = before.time.min(self.playback.length);
        let scene = &self.document.base;
        let is_there = match self.selected {
            Some(Selected::Object(index)) => index < scene.objects.len(),
            Some(Selected::Light(index)) => index < scene.lights.len(),
            None => true,
        };
        if !is_there {
            self.selected = None;
        }
    }
}
