//! A window that is open: its scene, its panels, and a frame where something changed.

use super::capture::Captured;
use super::display::{Display, Draw, FRAMES_IN_FLIGHT, Panels};
use super::document::Document;
use super::dynamic_resolution::DynamicResolution;
use super::edits::Edits;
use super::panels;
use super::player::Player;
use super::profiler::{FrameTimes, Measured};
use super::quality::{DRAFT, DRAFT_SCALE, FINEST, MOTION, Quality};
use super::reference::Reference;
use super::save::save;
use super::screenshot;
use super::sides;
use super::state::{Request, Severity, State};
use super::technique::Technique;
use super::watch::Watch;
use glam::DVec3;
use nephroid::render::{Frame, Overlay, ViewFrame};
use nephroid::scene::Scene;
use nephroid::{Result, glam};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::time::{Duration, Instant};
use winit::window::Window;

/// How long nothing must change until a still picture becomes finer.
const REST: Duration = Duration::from_millis(200);
/// Scene time of a frame of a script, s, so that equal scripts show equal pictures.
const SCRIPT_STEP: f64 = 1.0 / 24.0;
/// Pictures that are rendered again for the profiler, until the times and counts of the last one are known.
const REPEATS: u32 = FRAMES_IN_FLIGHT as u32 + 1;
/// Frames between two looks at the memory.
const MEMORY_FRAMES: u32 = 30;

/// The state that a picture shows. A picture with an equal key is not rendered again.
#[derive(Clone, PartialEq)]
struct PictureKey {
    time: f64,
    edits: Edits,
    view: (DVec3, DVec3, f64),
    quality: Quality,
    techniques: Vec<Technique>,
    /// With the exposure, EV, that their colours are made for.
    overlays: Option<(Vec<Overlay>, f64)>,
    /// Before dynamic resolution.
    size: [u32; 2],
}

/// What the window shows.
#[derive(PartialEq)]
struct Shown {
    key: PictureKey,
    /// Of refinement.
    stage: u32,
    /// By dynamic resolution.
    scale: f32,
    /// Number of the reference's light maps.
    reference: u64,
}

/// Quality, technique of side A and edits.
type Good = (Quality, Technique, Edits);

/// Everything that lives as long as the window.
pub struct Session {
    /// The compilation of shaders ends before the display does.
    #[cfg(feature = "dev")]
    pub shaders: super::reload::Shaders,
    // The display's surface goes before the window.
    pub display: Display,
    pub input: egui_winit::State,
    context: egui::Context,
    pub window: Arc<Window>,
    pub state: State,
    watch: Watch,
    /// When the window was opened: the panels' time 0.
    opened: Instant,
    /// The last picture.
    shown: Option<Shown>,
    resolution: DynamicResolution,
    /// Whether the first picture of a scene is a draft: on a CPU, unless all pictures are written.
    may_draft: bool,
    /// Whether the next picture is a draft if it can be.
    wants_draft: bool,
    /// While a side is the reference, with the time, edits and light-map scale that it is of.
    reference: Option<((f64, Edits, f64), Reference)>,
    /// What can be set, of the last picture that could be made.
    last_good: Good,
    /// Whether the differences that are shown, or will be, are relative; `None` if the last pictures were not measured.
    measured: Option<bool>,
    /// When the last picture of another key was asked for.
    changed: Instant,
    /// End of the last frame, if the next one follows at once.
    pub last_end: Option<Instant>,
    last_advance: Option<Instant>,
    pub repaint_at: Option<Instant>,
    pub needs_frame: bool,
    /// The picture is as fine as it gets, and no frame has to follow at once.
    pub is_settled: bool,
    is_scripted: bool,
    frames: u32,
    /// Pictures since the last one that was new, while the profiler is open.
    repeats: u32,
    recorded: u32,
}

impl Session {
    /// Shows a document in a window. `is_scripted`: a script draws the frames that follow drafts, with all pixels unless it asks for a
    /// frame rate, so that equal scripts show equal pictures. `may_draft`: the first picture of a scene may be a draft.
    ///
    /// # Errors
    /// As [`nephroid::render::Renderer::new`].
    pub fn new(
        window: Arc<Window>,
        mut display: Display,
        mut state: State,
        is_scripted: bool,
        may_draft: bool,
        #[cfg(feature = "dev")] shaders: super::reload::Shaders,
    ) -> Result<Self> {
        if is_scripted {
            state.quality.frame_rate = 0.0;
        }
        let technique = state.compare.techniques[0];
        display.set_side(0, &state.scene(), &technique)?;
        for note in display.sides[0].notes() {
            state.tell(Severity::Note, note);
        }
        let is_cpu = display.is_cpu();
        let may_draft = may_draft && is_cpu;
        let context = egui::Context::default();
        // Animated panels would draw frames by themselves.
        context.all_styles_mut(|style| style.animation_time = 0.0);
        let scale = Some(window.scale_factor() as f32);
        let root = egui::ViewportId::ROOT;
        let theme = window.theme();
        Ok(Self {
            #[cfg(feature = "dev")]
            shaders,
            input: egui_winit::State::new(context.clone(), root, &window, scale, theme, None),
            display,
            context,
            window,
            watch: watch(&state.document),
            opened: Instant::now(),
            shown: None,
            resolution: DynamicResolution::new(is_cpu),
            may_draft,
            wants_draft: may_draft,
            reference: None,
            last_good: (state.quality, technique, Edits::default()),
            measured: None,
            changed: Instant::now(),
            last_end: None,
            last_advance: None,
            repaint_at: None,
            needs_frame: true,
            is_settled: false,
            is_scripted,
            frames: 0,
            repeats: 0,
            recorded: 0,
            state,
        })
    }

    /// The next frame comes after a pause.
    pub fn pause(&mut self) {
        (self.last_end, self.last_advance) = (None, None);
    }

    /// Whether the user asked to end the program.
    pub fn quits(&self) -> bool {
        self.state.requests.contains(&Request::Quit)
    }

    /// When a still picture becomes finer.
    pub fn refines_at(&self) -> Option<Instant> {
        let can_refine =
            self.state.quality.refines && self.state.stage < FINEST && self.shown.is_some();
        (can_refine && !self.state.playback.plays && self.state.drag.is_none())
            .then(|| self.changed + REST)
    }

    /// Reads the scene again where its files changed.
    pub fn reload_changes(&mut self) {
        if !self.watch.has_changed() {
            return;
        }
        self.needs_frame = true;
        match self.state.document.reloaded() {
            Ok((document, warnings)) => {
                (self.state.messages).retain(|(severity, _)| *severity != Severity::Error);
                if self.set_document(document, warnings) {
                    self.state.tell(Severity::Note, "the scene was read again");
                }
            }
            Err(error) => self.state.tell(Severity::Error, error.to_string()),
        }
    }

    fn open_scene(&mut self, path: &Path) {
        match Document::open(path) {
            Ok((document, warnings)) => {
                if self.set_document(document, warnings) {
                    self.wants_draft = self.may_draft;
                    self.state.camera = None;
                    self.state.playback.time = 0.0;
                    let name = path.file_name().unwrap_or_default().to_string_lossy();
                    self.window.set_title(&format!("{name} – nephroid"));
                }
            }
            Err(error) => self.state.tell(Severity::Error, error.to_string()),
        }
    }

    /// Shows another document; whether it can be rendered. If not, the last one stays.
    fn set_document(&mut self, document: Document, warnings: Vec<String>) -> bool {
        for warning in warnings {
            self.state.tell(Severity::Note, warning);
        }
        let last = std::mem::replace(&mut self.state.document, document);
        self.state.reloaded();
        let scene = self.state.scene();
        if !sides::renew(&mut self.display, &mut self.state, &scene) {
            self.state.document = last;
            self.state.reloaded();
            return false;
        }
        self.watch = watch(&self.state.document);
        self.last_good = self.good();
        self.reference = None;
        self.render_again();
        true
    }

    /// The last picture is of another renderer.
    pub fn render_again(&mut self) {
        self.state.compare.differences.clear();
        self.shown = None;
    }

    /// The input since the last frame. In place of `egui_winit::State::take_egui_input`, which asks the display server for the
    /// size of the window, and waits for all that it still has to do, such as showing the last picture.
    fn take_input(&mut self) -> egui::RawInput {
        let [width, height] = self.display.size().map(|side| side as f32);
        let pixels_per_point = egui_winit::pixels_per_point(&self.context, &self.window);
        let points = egui::vec2(width, height) / pixels_per_point;
        let input = self.input.egui_input_mut();
        input.time = Some(self.opened.elapsed().as_secs_f64());
        input.screen_rect = Some(egui::Rect::from_min_size(egui::Pos2::ZERO, points));
        let viewport = input.viewports.entry(egui::ViewportId::ROOT).or_default();
        viewport.native_pixels_per_point = Some(self.window.scale_factor() as f32);
        input.take()
    }

    /// Runs the panels on the input.
    fn run_panels(&mut self, player: Option<&mut Player>) -> Panels {
        let mut input = self.take_input();
        if let Some(player) = player {
            input.events.append(&mut player.events);
            input.focused = true;
        }
        let state = &mut self.state;
        let output = self.context.run_ui(input, |ui| panels::show(ui, state));
        self.input
            .handle_platform_output(&self.window, output.platform_output);
        let delay = output
            .viewport_output
            .get(&egui::ViewportId::ROOT)
            .map(|viewport| viewport.repaint_delay);
        self.needs_frame = delay == Some(Duration::ZERO);
        self.repaint_at = delay
            .filter(|delay| *delay < Duration::from_secs(3600))
            .map(|delay| Instant::now() + delay);
        let primitives = self
            .context
            .tessellate(output.shapes, output.pixels_per_point);
        Panels {
            primitives,
            textures: output.textures_delta,
            pixels_per_point: output.pixels_per_point,
        }
    }

    /// Does what panels, keys and scripts asked for; the file of a screenshot.
    fn handle_requests(&mut self) -> Option<PathBuf> {
        let mut screenshot = None;
        for request in std::mem::take(&mut self.state.requests) {
            match request {
                Request::Screenshot(path) => screenshot = Some(path),
                Request::Save(path) => match save(&self.state.document, &path) {
                    Ok(notes) => {
                        self.state
                            .tell(Severity::Note, format!("saved {}", path.display()));
                        notes
                            .into_iter()
                            .for_each(|note| self.state.tell(Severity::Note, note));
                    }
                    Err(error) => self.state.tell(Severity::Error, error.to_string()),
                },
                Request::ExportProfile(path) => match self.state.profiler.export(&path) {
                    Ok(()) => self
                        .state
                        .tell(Severity::Note, format!("wrote {}", path.display())),
                    Err(error) => self.state.tell(Severity::Error, error.to_string()),
                },
                Request::Open(path) => self.open_scene(&path),
                #[cfg(feature = "dev")]
                Request::Lose(loss) => self.display.loses = Some(loss),
                Request::Quit => self.state.requests.push(Request::Quit),
            }
        }
        screenshot
    }

    /// Draws a frame; what it took, and the scale of a new picture by dynamic resolution. `None` where the window shows nothing.
    pub fn frame(
        &mut self,
        player: Option<&mut Player>,
        record: Option<&Path>,
    ) -> Result<Option<(FrameTimes, Option<f32>)>> {
        let start = Instant::now();
        (self.needs_frame, self.is_settled) = (false, false);
        if !self.display.prepare(&self.window)? {
            return Ok(None);
        }
        let settles = player.as_ref().is_some_and(|player| player.settles);
        self.advance();
        let panels = self.run_panels(player);
        let screenshot = self.handle_requests();
        if sides::fit(&mut self.display, &mut self.state) {
            self.shown = None;
        }
        let window_size = self.display.size();
        let size = scaled(window_size, self.state.quality.resolution);
        let scene = self.state.scene();
        let key = self.key(&scene, size);
        let number = self.follow_reference(&scene, &key);
        let last = (self.shown.as_ref())
            .filter(|shown| shown.key == key)
            .map(|shown| (shown.stage, shown.scale));
        let is_written = screenshot.is_some() || record.is_some();
        let (stage, scale) = self.refine(last, settles, start, is_written);
        self.state.stage = stage;
        let takes_passes = self.state.windows.profiler;
        let next = Shown {
            key,
            stage,
            scale,
            reference: number,
        };
        let is_new = self.shown.as_ref() != Some(&next);
        let follows_draft = (self.shown.as_ref()).is_some_and(|shown| shown.stage == DRAFT);
        // What a picture cost and consists of is known a few pictures later.
        let wants_picture = is_new || takes_passes && self.repeats < REPEATS;
        let (antialias, factor) = self.state.quality.stage(stage);
        let mut has_picture = wants_picture;
        if wants_picture {
            self.aim(factor, scale);
            has_picture = self.update(&scene)?;
            // Sides may have been made again.
            self.aim(factor, scale);
        }
        for side in &mut self.display.sides {
            side.profile(takes_passes);
            side.set_overlays(&self.state.overlays);
        }
        let compare = &self.state.compare;
        let is_relative = compare.heat_map.is_relative;
        let is_measured = !has_picture && self.measured == Some(is_relative);
        let measures = (compare.is_on && !is_measured).then_some(is_relative);
        let draw = Draw {
            window: &self.window,
            picture: has_picture.then_some(Frame {
                scene: &scene,
                direct: false,
                view: Some(ViewFrame {
                    size: scaled(size, scale),
                    antialias,
                }),
            }),
            exposure_ev: scene.camera.exposure_ev,
            shown: compare.shown(),
            measures,
            panels,
            captures: screenshot.is_some() || (record.is_some() && has_picture && is_new),
        };
        let before = start.elapsed();
        let drawn = self.display.draw(draw)?;
        if let Some(differences) = drawn.differences {
            self.state.compare.differences = differences;
            self.needs_frame = true;
        }
        if !drawn.is_drawn {
            self.needs_frame = true;
            self.state
                .requests
                .extend(screenshot.map(Request::Screenshot));
            return Ok(None);
        }
        if has_picture {
            self.shown = Some(next);
            self.wants_draft = false;
            self.needs_frame |= stage == DRAFT;
            self.repeats = if is_new || !takes_passes {
                0
            } else {
                self.repeats + 1
            };
            self.last_good = self.good();
        }
        if has_picture || measures.is_some() || !self.state.compare.is_on {
            self.measured = measures;
        }
        self.needs_frame |= self.display.has_pending_differences();
        if let Some(captured) = &drawn.captured {
            self.write_pictures(
                captured,
                screenshot,
                record.filter(|_| has_picture && is_new),
            )?;
        }
        let end = Instant::now();
        let interval = self.last_end.map(|last| 1e3 * (end - last).as_secs_f64());
        self.last_end = Some(end);
        // The next picture waits for a draft.
        let is_timed = stage != DRAFT && !follows_draft;
        if let (true, true, true, Some(interval)) = (has_picture, is_new, is_timed, interval) {
            let time = Duration::from_secs_f64(1e-3 * interval);
            (self.display.sides.iter_mut()).for_each(|side| side.add_time(time));
            let quality = &self.state.quality;
            if last.is_none() && quality.is_dynamic() {
                (self.resolution).add(interval, quality.frame_rate.into());
            }
        }
        let times = FrameTimes {
            end: self.context.time(),
            interval,
            host: 1e3 * (before + drawn.host).as_secs_f64(),
            ..FrameTimes::default()
        };
        // Passes of both sides have equal names, and are added up.
        let mut measured = Measured::default();
        for side in self.display.sides.iter_mut().filter(|_| has_picture) {
            measured.passes.extend(side.take_times());
            measured.counts.extend(side.take_counts());
        }
        self.state
            .profiler
            .add(times.clone(), has_picture && takes_passes, measured);
        self.needs_frame |= has_picture && takes_passes && self.repeats < REPEATS;
        let is_due = self.state.profiler.reserved == 0 || self.frames.is_multiple_of(MEMORY_FRAMES);
        if takes_passes && is_due {
            (self.state.profiler.memory, self.state.profiler.reserved) = self.display.memory();
        }
        self.frames += 1;
        self.is_settled = (!self.state.quality.refines || stage >= FINEST) && !self.needs_frame;
        let dynamic_scale = if stage == DRAFT { 1.0 } else { scale };
        Ok(Some((times, has_picture.then_some(dynamic_scale))))
    }

    /// Has the next pictures of all sides aim for this factor on their errors, and have direct light for this scale.
    fn aim(&mut self, factor: f32, scale: f32) {
        let sides = self.display.sides.iter_mut();
        for (side, technique) in sides.zip(self.state.compare.sides()) {
            side.aim(technique, factor);
            side.fit(scale);
        }
    }

    /// Stage and scale of the next picture. `last`: those of the last one, if nothing has changed since.
    fn refine(
        &mut self,
        last: Option<(u32, f32)>,
        settles: bool,
        start: Instant,
        is_written: bool,
    ) -> (u32, f32) {
        let quality = self.state.quality;
        let (mut stage, mut scale) = match last {
            Some((DRAFT, _)) => (MOTION, 1.0),
            Some(last) => last,
            None => {
                self.changed = start;
                if self.wants_draft && quality.refines && !is_written {
                    return (DRAFT, DRAFT_SCALE);
                }
                (MOTION, self.resolution.scale())
            }
        };
        let is_due =
            settles || (!self.is_scripted && self.refines_at().is_some_and(|time| time <= start));
        let may_refine = last.is_some_and(|(stage, _)| stage != DRAFT) && quality.refines;
        if is_due && may_refine && stage < FINEST {
            self.resolution.rest();
            match scale < 1.0 {
                true => scale = 1.0,
                false => stage += 1,
            }
        }
        match quality.is_dynamic() && !is_written {
            true => (stage, scale),
            false => (stage, 1.0),
        }
    }

    /// Whether a draft is to be drawn, or to be replaced: scripts go on after that.
    pub fn is_drafting(&self) -> bool {
        let is_due = match &self.shown {
            Some(shown) => shown.stage == DRAFT,
            None => self.wants_draft && self.state.quality.refines,
        };
        is_due && self.needs_frame
    }

    /// Lets the scene's time go on.
    fn advance(&mut self) {
        let now = Instant::now();
        let passed = self
            .last_advance
            .replace(now)
            .map_or(0.0, |last| (now - last).as_secs_f64());
        self.state.playback.advance(if self.is_scripted {
            SCRIPT_STEP
        } else {
            passed
        });
    }

    fn key(&self, scene: &Scene, size: [u32; 2]) -> PictureKey {
        let (camera, overlays) = (&scene.camera, &self.state.overlays);
        PictureKey {
            time: self.state.playback.time,
            // The exposure is applied where the picture is drawn, and the camera is in `view`.
            edits: Edits {
                exposure_ev: None,
                camera: None,
                ..self.state.document.history.now.clone()
            },
            view: (camera.position, camera.target, camera.fov),
            quality: self.state.quality,
            techniques: self.state.compare.sides().to_vec(),
            overlays: (!overlays.is_empty()).then(|| (overlays.clone(), camera.exposure_ev)),
            size,
        }
    }

    /// Whether the reference has something to show.
    pub fn has_news(&self) -> bool {
        (self.reference.as_ref()).is_some_and(|(_, reference)| reference.has_news())
    }

    /// Refines the reference of the scene, if a side shows it; the number of its light maps.
    fn follow_reference(&mut self, scene: &Scene, key: &PictureKey) -> u64 {
        let compare = &mut self.state.compare;
        compare.reference.clear();
        if !compare.has_reference() {
            self.reference = None;
            return 0;
        }
        let of = (key.time, key.edits.clone(), key.quality.light_map_scale);
        let (last, reference) = self
            .reference
            .get_or_insert_with(|| (of.clone(), Reference::new(scene.clone())));
        if *last != of {
            *last = of;
            reference.restart(scene.clone());
        }
        let failure = reference.follow().err();
        let (number, maps) = &reference.maps;
        let errors = maps.iter().map(|map| (map.receiver, map.error));
        compare.reference.extend(errors);
        let sides = self.display.sides.iter_mut();
        for side in sides.filter(|side| side.made_for.is_reference) {
            side.set_reference(*number, maps);
        }
        let number = *number;
        if let Some(failure) = failure {
            let text = format!("there is no reference: {failure}");
            self.state.tell(Severity::Error, text);
        }
        number
    }

    fn good(&self) -> Good {
        let state = &self.state;
        let edits = state.document.history.now.clone();
        (state.quality, state.compare.techniques[0], edits)
    }

    /// Takes the scene over to the device; whether it can be rendered. If not, the last values that could be are set again.
    fn update(&mut self, scene: &Scene) -> Result<bool> {
        if sides::update(&mut self.display, &mut self.state, scene)? {
            return Ok(true);
        }
        let last = self.last_good.clone();
        // What cannot be undone is not tried again in every frame.
        self.needs_frame = last != self.good();
        let state = &mut self.state;
        let now = &mut state.document.history.now;
        (state.quality, state.compare.techniques[0], *now) = last;
        Ok(false)
    }

    fn write_pictures(
        &mut self,
        captured: &Captured,
        screenshot: Option<PathBuf>,
        record: Option<&Path>,
    ) -> Result<()> {
        if let Some(path) = screenshot {
            match screenshot::write(&path, captured, &mut self.state) {
                Ok(()) => self.state.tell(
                    Severity::Note,
                    format!("wrote {}", path.with_extension("png").display()),
                ),
                Err(error) => self.state.tell(Severity::Error, error.to_string()),
            }
            self.needs_frame = true;
        }
        if let Some(folder) = record {
            let path = folder.join(format!("frame.{:05}.png", self.recorded));
            self.recorded += 1;
            let [width, height] = captured.size;
            nephroid::image_file::write_png(&path, width, height, &captured.rgb)?;
        }
        Ok(())
    }
}

/// At least a pixel.
fn scaled(size: [u32; 2], scale: f32) -> [u32; 2] {
    size.map(|side| ((side as f32 * scale).round() as u32).max(1))
}

fn watch(document: &Document) -> Watch {
    Watch::new(std::iter::once(document.path.clone()).chain(document.files.iter().cloned()))
}
