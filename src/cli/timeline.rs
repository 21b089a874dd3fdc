//! The times that a command renders, and the file of each.

use super::terminal::progress_bar;
use clap::Args;
use nephroid::{Error, Result};
use std::path::{Path, PathBuf};
use std::str::FromStr;
use std::sync::atomic::{AtomicBool, Ordering};

/// Times, s; those of keyframes have the same limit.
const MAX_SECONDS: f64 = 1e6;
const MAX_FRAME: u32 = 99_999;

#[derive(Args)]
pub struct Timeline {
    /// Time in the scene, in s
    #[arg(long, default_value_t = 0.0, allow_negative_numbers = true,
          value_parser = seconds, conflicts_with = "frames")]
    time: f64,
    /// First and last frame of a sequence, such as 0-119. Frame 0 is at time 0. NAME.exr becomes
    /// NAME.0000.exr and so on
    #[arg(long, value_name = "A-B")]
    frames: Option<Frames>,
    /// Frames per second
    #[arg(long, default_value_t = 24.0, value_parser = rate, requires = "frames")]
    fps: f64,
}

fn seconds(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|t: &f64| t.abs() <= MAX_SECONDS);
    value.ok_or(format!("give seconds, at most {MAX_SECONDS}"))
}

fn rate(text: &str) -> Result<f64, String> {
    let value = text.parse().ok().filter(|n| (1e-3..=1e6).contains(n));
    value.ok_or("give frames a second, 0.001 to 1000000".into())
}

/// First and last frame.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Frames(u32, u32);

impl FromStr for Frames {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let number = |text: &str| text.parse().ok().filter(|n| *n <= MAX_FRAME);
        (text.split_once('-'))
            .and_then(|(first, last)| Some(Self(number(first)?, number(last)?)))
            .filter(|Self(first, last)| first <= last)
            .ok_or(format!(
                "give the first and the last frame as in 0-119, at most {MAX_FRAME}"
            ))
    }
}

/// A picture to be made.
pub struct Shot {
    /// Number in the sequence; 0 for a still.
    pub frame: u32,
    /// s
    pub time: f64,
    pub file: PathBuf,
}

impl Timeline {
    /// Whether a sequence of numbered frames was asked for.
    pub fn is_sequence(&self) -> bool {
        self.frames.is_some()
    }

    /// The pictures to make, at least one, in the order of time.
    pub fn shots(&self, output: &Path) -> Vec<Shot> {
        let Some(Frames(first, last)) = self.frames else {
            return vec![Shot {
                frame: 0,
                time: self.time,
                file: output.to_owned(),
            }];
        };
        (first..=last)
            .map(|frame| Shot {
                frame,
                time: f64::from(frame) / self.fps,
                file: numbered(output, &format!("{frame:04}")),
            })
            .collect()
    }
}

/// `name.exr` as `name.NUMBER.exr`, whatever the bytes of the name.
pub fn numbered(output: &Path, number: &str) -> PathBuf {
    let mut name = output.file_stem().unwrap_or_default().to_owned();
    name.push(".");
    name.push(number);
    name.push(".");
    name.push(output.extension().unwrap_or_default());
    output.with_file_name(name)
}

/// Makes the frames of a sequence one after the other. A frame that fails does not stop the others.
///
/// # Errors
/// [`Error::Frames`] if some frames failed, and the first error if all failed. [`Error::Cancelled`] and
/// [`Error::Validation`] end the sequence at once.
pub fn each_frame<T>(
    shots: &[Shot],
    cancel: &AtomicBool,
    mut make: impl FnMut(&Shot) -> Result<T>,
) -> Result<Vec<T>> {
    let bar = progress_bar(shots.len() as u64);
    let mut made = Vec::new();
    let mut failed = Vec::new();
    let mut first = None;
    for shot in shots {
        if cancel.load(Ordering::Relaxed) {
            return Err(Error::Cancelled);
        }
        match make(shot) {
            Ok(frame) => made.push(frame),
            Err(error @ (Error::Cancelled | Error::Validation { .. })) => return Err(error),
            Err(error) => {
                failed.push(shot.frame);
                first.get_or_insert(error);
            }
        }
        bar.inc(1);
    }
    bar.finish_and_clear();
    match first {
        None => Ok(made),
        Some(first) if made.is_empty() => Err(first),
        Some(first) => Err(Error::Frames {
            failed,
            count: shots.len(),
            first: Box::new(first),
        }),
    }
}

#[cfg(test)]
mod tests {
    use super::super::exit_code;
    use super::*;

    #[test]
    fn ranges_of_frames() {
        let parse = str::parse::<Frames>;
        assert_eq!(parse("0-119"), Ok(Frames(0, 119)));
        assert_eq!(parse("7-7"), Ok(Frames(7, 7)));
        for bad in [
            "", "5", "3-1", "-3", "1-", "a-b", "0-100000", "1-2-3", "0 - 4",
        ] {
            assert!(parse(bad).is_err(), "{bad}");
        }
    }

    #[test]
    fn names_of_frames() {
        let name = |output: &str| numbered(Path::new(output), "0012");
        assert_eq!(name("out/view.png"), Path::new("out/view.0012.png"));
        assert_eq!(name("a.b.exr"), Path::new("a.b.0012.exr"));
        #[cfg(unix)]
        {
            use std::ffi::OsStr;
            use std::os::unix::ffi::OsStrExt;
            let path = |bytes: &[u8]| PathBuf::from(OsStr::from_bytes(bytes));
            assert_eq!(numbered(&path(b"\xff.exr"), "0012"), path(b"\xff.0012.exr"));
        }
    }

    #[test]
    fn frames_that_fail_do_not_stop_the_others() {
        let timeline = Timeline {
            time: 0.0,
            frames: Some(Frames(3, 6)),
            fps: 2.0,
        };
        let shots = timeline.shots(Path::new("map.exr"));
        let run = |bad: &[u32]| {
            let make = |shot: &Shot| match bad.contains(&shot.frame) {
                false => Ok(shot.time),
                true => Err(Error::Usage {
                    reason: format!("bad {}", shot.frame),
                    remedy: "none".into(),
                }),
            };
            each_frame(&shots, &AtomicBool::new(false), make)
        };
        assert_eq!(run(&[]).unwrap(), [1.5, 2.0, 2.5, 3.0]);
        let some = run(&[4, 6]).unwrap_err();
        assert_eq!(exit_code(&some), 6);
        assert!(
            some.to_string()
                .starts_with("2 of 4 frames failed (4, 6); the first: bad 4")
        );
        assert_eq!(exit_code(&run(&[3, 4, 5, 6]).unwrap_err()), 2);
        let cancelled = each_frame(&shots, &AtomicBool::new(true), |_| Ok(()));
        assert_eq!(exit_code(&cancelled.unwrap_err()), 130);
    }
}
