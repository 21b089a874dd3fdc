//! Replays a script.

use super::overlay_panel;
use super::report::Recorder;
use super::script::{Command, Hands, Script, failed};
use super::state::{Request, Selected, Severity, State};
use super::technique::{Aim, Technique};
use egui::Event;
use nephroid::Result;
use nephroid::render::{Method, Overlay};
use std::time::{Duration, Instant};
use winit::dpi::PhysicalSize;
use winit::window::Window;

/// A window manager may refuse a size.
const RESIZE_TIMEOUT: Duration = Duration::from_secs(1);

/// How long a script waits for a message.
const MESSAGE_TIMEOUT: Duration = Duration::from_secs(60);

/// What the window does next.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Step {
    Draw,
    Wait(Instant),
    End,
}

pub struct Player {
    script: Script,
    next: usize,
    hands: Hands,
    frames: u32,
    pub settles: bool,
    waits: Option<Instant>,
    resizes: Option<(PhysicalSize<u32>, Instant)>,
    /// Text of a message, and the line that waits for it.
    awaits: Option<(String, usize, Instant)>,
    /// For the next frame.
    pub events: Vec<Event>,
}

impl Player {
    pub fn new(script: Script) -> Self {
        Self {
            script,
            next: 0,
            hands: Hands::default(),
            frames: 0,
            settles: false,
            waits: None,
            resizes: None,
            awaits: None,
            events: Vec::new(),
        }
    }

    /// Goes on until the window has something to do. `is_settled`: as of the session.
    ///
    /// # Errors
    /// [`nephroid::Error::Input`] with the line that cannot be done, or whose expectation is not met.
    pub fn step(
        &mut self,
        window: &Window,
        state: &mut State,
        recorder: &mut Recorder,
        is_settled: bool,
    ) -> Result<Step> {
        loop {
            if self.frames > 0 {
                self.frames -= 1;
                return Ok(Step::Draw);
            }
            if self.settles && !is_settled {
                return Ok(Step::Draw);
            }
            self.settles = false;
            if let Some(until) = self.waits {
                if Instant::now() < until {
                    return Ok(Step::Wait(until));
                }
                self.waits = None;
                recorder.end_wait();
            }
            if let Some((size, deadline)) = self.resizes {
                if window.inner_size() != size && Instant::now() < deadline {
                    return Ok(Step::Wait(Instant::now() + Duration::from_millis(5)));
                }
                self.resizes = None;
            }
            if let Some((text, line, deadline)) = &self.awaits {
                let told = expect(state, text);
                if told.is_err() && Instant::now() < *deadline {
                    return Ok(Step::Wait(Instant::now() + Duration::from_millis(5)));
                }
                told.map_err(|reason| failed(&self.script.path, *line, &reason))?;
                self.awaits = None;
            }
            let Some((line, command)) = self.script.commands.get(self.next).cloned() else {
                return Ok(Step::End);
            };
            self.next += 1;
            if let Some(event) = self.hands.event(&command) {
                self.events.push(event);
                continue;
            }
            if let Command::Await(text) = command {
                self.awaits = Some((text, line, Instant::now() + MESSAGE_TIMEOUT));
                continue;
            }
            self.run(command, window, state, recorder)
                .map_err(|reason| failed(&self.script.path, line, &reason))?;
        }
    }

    fn run(
        &mut self,
        command: Command,
        window: &Window,
        state: &mut State,
        recorder: &mut Recorder,
    ) -> Result<(), String> {
        match command {
            Command::Size([width, height]) => {
                let size = PhysicalSize::new(width, height);
                // A size that is set at once is reported at once.
                let _ = window.request_inner_size(size);
                self.resizes = Some((size, Instant::now() + RESIZE_TIMEOUT));
            }
            Command::Frames(frames) => self.frames = frames,
            // The first frame finds out whether there is anything to settle.
            Command::Settle => (self.settles, self.frames) = (true, 1),
            Command::Wait(time) => {
                recorder.begin_wait();
                self.waits = Some(Instant::now() + time);
            }
            Command::Set(name, value) => set(state, &name, &value)?,
            Command::Select(what) => state.selected = Some(find(state, &what)?),
            Command::Time(seconds) => {
                state.playback.time = seconds.clamp(0.0, state.playback.length)
            }
            Command::Play(plays) => state.playback.plays = plays && state.playback.moves(),
            Command::Open(path) => state.requests.push(Request::Open(path)),
            Command::Copy(from, to) => {
                let copied = std::fs::copy(&from, &to);
                copied.map_err(|error| format!("{} cannot be copied: {error}", from.display()))?;
            }
            Command::Screenshot(path) => state.requests.push(Request::Screenshot(path)),
            Command::Save(path) => state.requests.push(Request::Save(path)),
            Command::Export(path) => state.requests.push(Request::ExportProfile(path)),
            #[cfg(feature = "dev")]
            Command::Lose(loss) => state.requests.push(Request::Lose(loss)),
            Command::Measure(name) => recorder.measure(&name),
            Command::Expect(text) => expect(state, &text)?,
            Command::ExpectNoError => {
                if let Some((_, message)) =
                    state.messages.iter().find(|(s, _)| *s != Severity::Note)
                {
                    return Err(format!("the window shows an error: {message}"));
                }
            }
            Command::Quit => {
                self.next = self.script.commands.len();
            }
            Command::Await(_)
            | Command::Move(_)
            | Command::Button(..)
            | Command::Scroll(_)
            | Command::Modifiers(_)
            | Command::Key(..)
            | Command::Text(_) => {}
        }
        Ok(())
    }
}

/// # Errors
/// Where no message has the text.
fn expect(state: &State, text: &str) -> Result<(), String> {
    let differences = state.compare.lines(&state.document.base);
    let messages = state.messages.iter().map(|(_, message)| message);
    let lines: Vec<_> = messages.chain(&differences).collect();
    match lines.iter().any(|line| line.contains(text)) {
        true => Ok(()),
        false => Err(format!("no message has `{text}`; there is: {lines:?}")),
    }
}

fn number(value: &str) -> Result<f64, String> {
    let number = value.parse::<f64>().ok().filter(|x| x.is_finite());
    number.ok_or_else(|| format!("`{value}` is no number"))
}

fn count(value: &str) -> Result<u32, String> {
    (value.parse::<u32>()).map_err(|_| format!("`{value}` is no whole number"))
}

fn switch(value: &str) -> Result<bool, String> {
    match value {
        "on" => Ok(true),
        "off" => Ok(false),
        _ => Err(format!("`{value}` is neither on nor off")),
    }
}

/// Sets what a panel sets of a side; whether there is such a value.
fn set_technique(technique: &mut Technique, name: &str, value: &str) -> Result<bool, String> {
    match name {
        "method" => {
            let method = Method::ALL
                .into_iter()
                .find(|method| method.name() == value);
            technique.method = method.ok_or_else(|| format!("there is no method `{value}`"))?;
        }
        "reference" => technique.is_reference = switch(value)?,
        "error" => technique.aim = Aim::Error((number(value)? as f32).clamp(1e-4, 1.0)),
        "budget" => technique.aim = Aim::Budget((number(value)? as f32).clamp(0.1, 1e5)),
        "samples" => technique.aim = Aim::Samples(count(value)?.max(1)),
        "cells" => technique.environment_cells = count(value)?.max(8),
        "images" => technique.environment_images = count(value)?.max(1),
        _ => return Ok(false),
    }
    Ok(true)
}

/// Sets what a panel sets.
fn set(state: &mut State, name: &str, value: &str) -> Result<(), String> {
    let (side, of_side) = match name.strip_prefix("compare-") {
        Some(name) => (1, name),
        None => (0, name),
    };
    if set_technique(&mut state.compare.techniques[side], of_side, value)? {
        return Ok(());
    }
    if let Some(name) = name.strip_prefix("overlay-") {
        let overlay = Overlay::ALL
            .into_iter()
            .find(|overlay| overlay.name() == name);
        let overlay = overlay.ok_or_else(|| format!("there is no overlay `{name}`"))?;
        overlay_panel::set(&mut state.overlays, overlay, switch(value)?);
        return Ok(());
    }
    let quality = &mut state.quality;
    match name {
        "compare" => state.compare.is_on = switch(value)?,
        "divider" => state.compare.divider = number(value)?.clamp(0.0, 1.0) as f32,
        "heat-map" => state.compare.heat_map.is_on = switch(value)?,
        "heat-map-relative" => state.compare.heat_map.is_relative = switch(value)?,
        "heat-map-scale" => {
            state.compare.heat_map.scale = match value {
                "auto" => None,
                _ => Some(number(value)?.clamp(1e-9, 1e9)),
            }
        }
        "antialias" => quality.antialias = count(value)?.clamp(1, 16),
        "resolution" => quality.resolution = number(value)?.clamp(0.1, 1.0) as f32,
        "frame-rate" => quality.frame_rate = number(value)?.clamp(0.0, 1000.0) as f32,
        "light-maps" => quality.light_map_scale = number(value)?.clamp(0.01, 16.0),
        "refine" => quality.refines = switch(value)?,
        "exposure" => state.document.history.now.set_exposure(number(value)?),
        "panels" => state.windows.panels = switch(value)?,
        "profiler" => state.windows.profiler = switch(value)?,
        "loop" => state.playback.loops = switch(value)?,
        _ => return Err(format!("there is no setting `{name}`")),
    }
    Ok(())
}

/// `object NAME` or `light NAME`.
fn find(state: &State, what: &str) -> Result<Selected, String> {
    let scene = &state.document.base;
    let found = match what.split_once(' ') {
        Some(("object", name)) => scene.object_index(name).map(Selected::Object),
        Some(("light", name)) => scene
            .lights
            .iter()
            .position(|light| light.name == name)
            .map(Selected::Light),
        _ => return Err("select `object NAME` or `light NAME`".into()),
    };
    found.ok_or_else(|| format!("the scene has no {what}"))
}
