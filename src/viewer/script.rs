//! Scripts: a list of inputs, one a line, that the window replays (docs/viewer.md).

#[cfg(feature = "dev")]
use super::loss::Loss;
use egui::{
    Event, Key, Modifiers, MouseWheelUnit, PointerButton, Pos2, TouchPhase, Vec2, pos2, vec2,
};
use nephroid::{Error, Result, input};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::time::Duration;

/// Most frames of a line.
const MAX_FRAMES: u32 = 1_000_000;

/// A line of a script. Longer inputs, such as a drag, become several.
#[derive(Debug, Clone, PartialEq)]
pub enum Command {
    Move(Pos2),
    Button(PointerButton, bool),
    Scroll(Vec2),
    Modifiers(Modifiers),
    Key(Key, bool),
    Text(String),
    /// Asks for a window of so many pixels.
    Size([u32; 2]),
    /// Draws so many frames.
    Frames(u32),
    /// Draws until a still picture is as fine as it gets.
    Settle,
    /// Does nothing, unless the window needs a frame.
    Wait(Duration),
    Set(String, String),
    Select(String),
    Time(f64),
    Play(bool),
    Open(PathBuf),
    /// Copies a file, as an editor that saves.
    Copy(PathBuf, PathBuf),
    Screenshot(PathBuf),
    Save(PathBuf),
    Export(PathBuf),
    /// Times of the frames from here on have this name in the report.
    Measure(String),
    /// Fails unless a message of the window contains this.
    Expect(String),
    /// Does nothing until a message contains this.
    Await(String),
    /// Fails if the window shows an error.
    ExpectNoError,
    /// Has the next frame fail as if the system had taken this away.
    #[cfg(feature = "dev")]
    Lose(Loss),
    Quit,
}

/// Commands with the numbers of their lines.
#[derive(Debug, Clone)]
pub struct Script {
    pub path: PathBuf,
    pub commands: Vec<(usize, Command)>,
}

impl Script {
    /// Reads a script.
    ///
    /// # Errors
    /// [`Error::Input`], with the line that is no command.
    pub fn read(path: &Path) -> Result<Self> {
        let text = input::read_text(path)?;
        let mut commands = Vec::new();
        for (index, line) in text.lines().enumerate() {
            let line = line.trim();
            if line.is_empty() || line.starts_with('#') {
                continue;
            }
            let parsed = parse(line).map_err(|reason| failed(path, index + 1, &reason))?;
            commands.extend(parsed.into_iter().map(|command| (index + 1, command)));
        }
        Ok(Self {
            path: path.to_owned(),
            commands,
        })
    }
}

/// An error on a line of a script.
pub fn failed(path: &Path, line: usize, reason: &str) -> Error {
    Error::Input {
        file: path.to_owned(),
        place: Some(format!("line {line}")),
        reason: reason.into(),
        remedy: "see docs/viewer.md for what a script can say".into(),
    }
}

/// The commands of a line.
///
/// # Errors
/// The reason why it is none.
fn parse(line: &str) -> Result<Vec<Command>, String> {
    let (word, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    let rest = rest.trim();
    let words: Vec<&str> = rest.split_whitespace().collect();
    let one = |command| Ok(vec![command]);
    let usage = |form: &str| Err(format!("`{line}` is not of the form `{form}`"));
    match (word, words.as_slice()) {
        ("move", [x, y]) => one(Command::Move(pos2(number(x)?, number(y)?))),
        ("press", [name]) => one(Command::Button(button(name)?, true)),
        ("release", [name]) => one(Command::Button(button(name)?, false)),
        ("click", [name, x, y]) => {
            let button = button(name)?;
            Ok(vec![
                Command::Move(pos2(number(x)?, number(y)?)),
                Command::Frames(1),
                Command::Button(button, true),
                Command::Frames(1),
                Command::Button(button, false),
                Command::Frames(1),
            ])
        }
        ("drag", [name, x0, y0, x1, y1, frames]) => {
            let start = pos2(number(x0)?, number(y0)?);
            drag(
                button(name)?,
                start,
                pos2(number(x1)?, number(y1)?),
                count(frames)?,
            )
        }
        ("scroll", [x, y]) => one(Command::Scroll(vec2(number(x)?, number(y)?))),
        ("modifiers", names) => one(Command::Modifiers(modifiers(names)?)),
        ("key", [name]) => {
            let key = key(name)?;
            Ok(vec![
                Command::Key(key, true),
                Command::Frames(1),
                Command::Key(key, false),
            ])
        }
        ("down", [name]) => one(Command::Key(key(name)?, true)),
        ("up", [name]) => one(Command::Key(key(name)?, false)),
        ("text", [_, ..]) => one(Command::Text(rest.into())),
        ("size", [width, height]) => {
            let side = |text: &str| text.parse().ok().filter(|n| (1..=16384).contains(n));
            let size = side(width)
                .zip(side(height))
                .ok_or("a side has 1 to 16384 pixels")?;
            one(Command::Size([size.0, size.1]))
        }
        ("frames", [frames]) => one(Command::Frames(count(frames)?)),
        ("settle", []) => one(Command::Settle),
        ("wait", [seconds]) => {
            let seconds = seconds.parse().ok().filter(|s| (0.0..=3600.0).contains(s));
            one(Command::Wait(Duration::from_secs_f64(
                seconds.ok_or("wait 0 to 3600 seconds")?,
            )))
        }
        ("set", [name, value]) => one(Command::Set((*name).into(), (*value).into())),
        ("select", [_, ..]) => one(Command::Select(rest.into())),
        ("time", [seconds]) => one(Command::Time(number(seconds)?)),
        ("play", []) => one(Command::Play(true)),
        ("pause", []) => one(Command::Play(false)),
        ("open", [_, ..]) => one(Command::Open(rest.into())),
        ("copy", [from, to]) => one(Command::Copy(from.into(), to.into())),
        ("screenshot", [_, ..]) => Ok(vec![Command::Screenshot(rest.into()), Command::Frames(1)]),
        ("save", [_, ..]) => Ok(vec![Command::Save(rest.into()), Command::Frames(1)]),
        ("export", [_, ..]) => Ok(vec![Command::Export(rest.into()), Command::Frames(1)]),
        ("measure", [_, ..]) => one(Command::Measure(rest.into())),
        ("await", [_, ..]) => one(Command::Await(rest.into())),
        ("expect", ["no", "error"]) => one(Command::ExpectNoError),
        ("expect", [_, ..]) => one(Command::Expect(rest.into())),
        #[cfg(feature = "dev")]
        ("lose", ["surface"]) => one(Command::Lose(Loss::Surface)),
        #[cfg(feature = "dev")]
        ("lose", ["device"]) => one(Command::Lose(Loss::Device)),
        ("quit", []) => one(Command::Quit),
        ("drag", _) => usage("drag BUTTON X Y X Y FRAMES"),
        ("move" | "click" | "scroll" | "size" | "set" | "copy", _) => {
            Err(format!("`{word}` takes other arguments"))
        }
        _ => Err(format!("there is no command `{line}`")),
    }
}

/// A press, a move in every frame, and a release.
fn drag(
    button: PointerButton,
    start: Pos2,
    end: Pos2,
    frames: u32,
) -> Result<Vec<Command>, String> {
    let mut commands = vec![
        Command::Move(start),
        Command::Frames(1),
        Command::Button(button, true),
        Command::Frames(1),
    ];
    for frame in 1..=frames {
        commands.push(Command::Move(start.lerp(end, frame as f32 / frames as f32)));
        commands.push(Command::Frames(1));
    }
    commands.push(Command::Button(button, false));
    commands.push(Command::Frames(1));
    Ok(commands)
}

fn number<T: FromStr + Copy + Into<f64>>(text: &str) -> Result<T, String> {
    let value = text.parse().ok().filter(|&x: &T| x.into().is_finite());
    value.ok_or_else(|| format!("`{text}` is no number"))
}

fn count(text: &str) -> Result<u32, String> {
    let value = text.parse().ok().filter(|n| (1..=MAX_FRAMES).contains(n));
    value.ok_or_else(|| format!("`{text}` is no number of frames from 1 to {MAX_FRAMES}"))
}

fn button(name: &str) -> Result<PointerButton, String> {
    match name {
        "left" => Ok(PointerButton::Primary),
        "right" => Ok(PointerButton::Secondary),
        "middle" => Ok(PointerButton::Middle),
        _ => Err(format!(
            "there is no button `{name}`: use left, right or middle"
        )),
    }
}

fn key(name: &str) -> Result<Key, String> {
    Key::from_name(name).ok_or_else(|| format!("there is no key `{name}`"))
}

fn modifiers(names: &[&str]) -> Result<Modifiers, String> {
    let mut modifiers = Modifiers::NONE;
    for name in names {
        match *name {
            "ctrl" => (modifiers.ctrl, modifiers.command) = (true, true),
            "shift" => modifiers.shift = true,
            "alt" => modifiers.alt = true,
            "none" => {}
            _ => {
                return Err(format!(
                    "there is no modifier `{name}`: use ctrl, shift, alt or none"
                ));
            }
        }
    }
    Ok(modifiers)
}

/// Where the pointer and the modifiers of a script are.
#[derive(Debug, Clone, Copy, Default)]
pub struct Hands {
    pub pointer: Pos2,
    pub modifiers: Modifiers,
}

impl Hands {
    /// The event of an input; `None` for commands that are none.
    pub fn event(&mut self, command: &Command) -> Option<Event> {
        let modifiers = self.modifiers;
        Some(match command {
            Command::Move(to) => {
                self.pointer = *to;
                Event::PointerMoved(*to)
            }
            Command::Button(button, pressed) => Event::PointerButton {
                pos: self.pointer,
                button: *button,
                pressed: *pressed,
                modifiers,
            },
            Command::Scroll(delta) => Event::MouseWheel {
                unit: MouseWheelUnit::Line,
                delta: *delta,
                phase: TouchPhase::Move,
                modifiers,
            },
            Command::Key(key, pressed) => Event::Key {
                key: *key,
                physical_key: None,
                pressed: *pressed,
                repeat: false,
                modifiers,
            },
            Command::Text(text) => Event::Text(text.clone()),
            Command::Modifiers(now) => {
                self.modifiers = *now;
                Event::ModifiersChanged(*now)
            }
            _ => return None,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lines_become_commands() {
        assert_eq!(
            parse("move 10 20.5").unwrap(),
            [Command::Move(pos2(10.0, 20.5))]
        );
        assert_eq!(parse("drag left 0 0 10 0 5").unwrap().len(), 4 + 2 * 5 + 2);
        assert_eq!(parse("time 0.1").unwrap(), [Command::Time(0.1)]);
        assert_eq!(parse("expect no error").unwrap(), [Command::ExpectNoError]);
        assert_eq!(
            parse("screenshot a b.png").unwrap()[0],
            Command::Screenshot("a b.png".into())
        );
        assert_eq!(
            parse("key Space").unwrap()[0],
            Command::Key(Key::Space, true)
        );
        for bad in [
            "jump",
            "move 1",
            "move x 1",
            "move nan 1",
            "frames 0",
            "frames -1",
            "press top",
            "key Foo",
            "size 0 5",
            "wait -1",
            "modifiers hyper",
            "drag left 1 2",
            "quit now",
        ] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn a_broken_line_is_named() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("a.script");
        std::fs::write(&file, "# fine\n\nframes 3\njump\n").unwrap();
        let error = Script::read(&file).unwrap_err().to_string();
        assert!(
            error.contains("line 4") && error.contains("jump"),
            "{error}"
        );
    }
}
