//! The window's event loop: input, panels, and a frame where something changed.

use super::display::Display;
use super::document::Document;
use super::host::{HostOptions, no_window, plain};
use super::player::{Player, Step};
#[cfg(feature = "dev")]
use super::reload::Shaders;
use super::report::{Recorder, Report};
use super::save::{recovery_path, save};
use super::script::Script;
use super::session::Session;
use super::state::{Severity, State};
use super::technique::Technique;
use crate::cli::signals::cancelled;
use crate::cli::terminal::log;
use nephroid::gpu::Messages;
use nephroid::{Error, Result};
use std::path::PathBuf;
use std::sync::Arc;
use std::sync::atomic::Ordering;
use std::time::{Duration, Instant};
use winit::application::ApplicationHandler;
use winit::dpi::PhysicalSize;
use winit::event::WindowEvent;
use winit::event_loop::{ActiveEventLoop, ControlFlow};
use winit::window::{Window, WindowId};

/// How often files and signals are looked at.
const POLL: Duration = Duration::from_millis(500);

/// What the window shows first, and how.
pub struct Options {
    pub scene: PathBuf,
    /// Pixels.
    pub size: [u32; 2],
    pub technique: Technique,
    pub device: Option<String>,
    pub validate: bool,
    pub script: Option<Script>,
    /// Folder for every picture.
    pub record: Option<PathBuf>,
    /// Folder of the shaders' sources.
    #[cfg(feature = "dev")]
    pub shaders: PathBuf,
}

pub struct App {
    options: Options,
    document: Option<Document>,
    warnings: Vec<String>,
    messages: Arc<Messages>,
    open: Option<Session>,
    player: Option<Player>,
    /// The script asked for a frame that is not drawn yet.
    script_frame: bool,
    recorder: Option<Recorder>,
    report: Option<Report>,
    error: Option<Error>,
    next_poll: Instant,
}

impl App {
    /// Reads the scene, so that nothing opens for one that cannot be used.
    ///
    /// # Errors
    /// [`Error::Input`] where the scene cannot be used.
    pub fn new(mut options: Options, start: Instant) -> Result<Self> {
        let (document, warnings) = Document::open(&options.scene)?;
        let player = options.script.take().map(Player::new);
        Ok(Self {
            options,
            document: Some(document),
            warnings,
            messages: Arc::default(),
            open: None,
            player,
            script_frame: false,
            recorder: Some(Recorder::new(start)),
            report: None,
            error: None,
            next_poll: Instant::now(),
        })
    }

    /// What happened, after the event loop has ended.
    ///
    /// # Errors
    /// What ended it, or [`Error::Validation`] where the validation layers said anything.
    pub fn finish(mut self) -> Result<Option<Report>> {
        self.open = None;
        let messages = self.messages.take();
        for message in &messages {
            log("validation", message);
        }
        if let Some(error) = self.error {
            return Err(error);
        }
        match messages.first() {
            None => Ok(self.report),
            Some(first) => Err(Error::Validation {
                count: messages.len(),
                first: first.clone(),
            }),
        }
    }

    fn open(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        let Some(document) = self.document.take() else {
            return Ok(());
        };
        let [width, height] = self.options.size;
        let name = document
            .path
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
        let attributes = Window::default_attributes()
            .with_title(format!("{name} – nephroid"))
            .with_inner_size(PhysicalSize::new(width, height));
        let window = event_loop.create_window(attributes).map_err(|error| {
            no_window(
                format!("no window can be opened: {}", plain(&error)),
                "run in a graphical session, or use `nephroid render`",
            )
        })?;
        let window = Arc::new(window);
        let options = HostOptions {
            device: self.options.device.clone(),
            validate: self.options.validate,
            messages: self.messages.clone(),
        };
        let display = Display::new(&window, &options)?;
        let technique = self.options.technique;
        let mut state = State::new(document, technique, display.device().clone());
        for warning in &self.warnings {
            state.tell(Severity::Note, warning);
        }
        let is_scripted = self.player.is_some();
        self.open = Some(Session::new(
            window,
            display,
            state,
            is_scripted,
            self.options.record.is_none(),
            #[cfg(feature = "dev")]
            Shaders::new(&self.options.shaders),
        )?);
        Ok(())
    }

    /// Ends the loop with an error. Edits are kept in a file beside the scene.
    fn fail(&mut self, event_loop: &ActiveEventLoop, error: Error) {
        if let Some(open) = &mut self.open
            && matches!(error, Error::Device { .. } | Error::Window { .. })
            && open.state.document.history.is_edited()
        {
            let path = recovery_path(&open.state.document.path);
            match save(&open.state.document, &path) {
                Ok(_) => log(
                    "note",
                    &format!("the edited scene is in {}", path.display()),
                ),
                Err(error) => log("error", &error.to_string()),
            }
        }
        self.error.get_or_insert(error);
        event_loop.exit();
    }

    fn end(&mut self, event_loop: &ActiveEventLoop) {
        if let (Some(open), Some(recorder)) = (&self.open, self.recorder.take()) {
            open.display.finish();
            let scene = open.state.document.path.display().to_string();
            self.report = Some(recorder.finish(scene, open.state.device.clone()));
        }
        event_loop.exit();
    }

    /// Decides what comes next, once all events are handled.
    fn next(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        if cancelled().load(Ordering::Relaxed) {
            return Err(Error::Cancelled);
        }
        let (Some(open), Some(recorder)) = (&mut self.open, &mut self.recorder) else {
            return Ok(());
        };
        let now = Instant::now();
        if now >= self.next_poll {
            self.next_poll = now + POLL;
            open.reload_changes();
            #[cfg(feature = "dev")]
            open.reload_shaders()?;
            open.needs_frame |= open.has_news();
        }
        let mut until = self.next_poll;
        let mut draws = open.needs_frame;
        if let Some(player) = &mut self.player {
            if !self.script_frame && !open.is_drafting() {
                match player.step(&open.window, &mut open.state, recorder, open.is_settled)? {
                    Step::Draw => self.script_frame = true,
                    Step::Wait(time) => until = until.min(time),
                    Step::End => {
                        self.end(event_loop);
                        return Ok(());
                    }
                }
            }
            draws |= self.script_frame;
        } else {
            draws |= open.state.playback.plays;
            if let Some(time) = open.repaint_at.into_iter().chain(open.refines_at()).min() {
                draws |= time <= now;
                until = until.min(time);
            }
        }
        if draws {
            open.window.request_redraw();
            event_loop.set_control_flow(ControlFlow::Wait);
        } else {
            // The next frame comes after a pause.
            open.pause();
            event_loop.set_control_flow(ControlFlow::WaitUntil(until));
        }
        Ok(())
    }

    fn redraw(&mut self, event_loop: &ActiveEventLoop) -> Result<()> {
        let (Some(open), Some(recorder)) = (&mut self.open, &mut self.recorder) else {
            return Ok(());
        };
        if self.player.is_some() && !self.script_frame && !open.needs_frame {
            return Ok(());
        }
        let frame = open.frame(
            self.player.as_mut().filter(|_| self.script_frame),
            self.options.record.as_deref(),
        )?;
        self.script_frame = false;
        if let Some((times, scale)) = frame {
            if scale.is_some() && !recorder.has_picture() {
                open.display.finish();
            }
            recorder.add(times.interval, times.host, scale);
        }
        if open.quits() {
            self.end(event_loop);
        }
        Ok(())
    }
}

impl ApplicationHandler for App {
    fn resumed(&mut self, event_loop: &ActiveEventLoop) {
        if let Err(error) = self.open(event_loop) {
            self.fail(event_loop, error);
        }
    }

    fn window_event(&mut self, event_loop: &ActiveEventLoop, _: WindowId, event: WindowEvent) {
        let is_scripted = self.player.is_some();
        let Some(open) = &mut self.open else { return };
        let result = match &event {
            WindowEvent::RedrawRequested => self.redraw(event_loop),
            WindowEvent::CloseRequested | WindowEvent::Destroyed => {
                self.end(event_loop);
                Ok(())
            }
            other => {
                if let WindowEvent::Resized(_) | WindowEvent::ScaleFactorChanged { .. } = other {
                    open.display.invalidate();
                    open.needs_frame = true;
                }
                // The pointer and the keyboard are the script's.
                let is_input = matches!(
                    other,
                    WindowEvent::CursorMoved { .. }
                        | WindowEvent::CursorEntered { .. }
                        | WindowEvent::CursorLeft { .. }
                        | WindowEvent::MouseInput { .. }
                        | WindowEvent::MouseWheel { .. }
                        | WindowEvent::KeyboardInput { .. }
                        | WindowEvent::ModifiersChanged(_)
                        | WindowEvent::Focused(_)
                );
                if !(is_scripted && is_input) {
                    open.needs_frame |= open.input.on_window_event(&open.window, other).repaint;
                }
                Ok(())
            }
        };
        if let Err(error) = result {
            self.fail(event_loop, error);
        }
    }

    fn about_to_wait(&mut self, event_loop: &ActiveEventLoop) {
        if let Err(error) = self.next(event_loop) {
            self.fail(event_loop, error);
        }
    }
}
