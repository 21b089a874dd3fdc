//! Times of the last frames: kept, summarised and written to files.

use super::display::FRAMES_IN_FLIGHT;
use super::stats::Times;
use nephroid::gpu::PassTime;
use nephroid::output::write_atomically;
use nephroid::render::FrameCounts;
use nephroid::{Error, Result};
use serde_json::json;
use std::collections::{BTreeMap, VecDeque};
use std::path::Path;

/// Frames that are kept.
const MAX_FRAMES: usize = 600;

/// A frame that the window showed.
#[derive(Debug, Clone, Default)]
pub struct FrameTimes {
    /// Given by [`Profiler::add`].
    pub number: u64,
    /// When it ended, s since the window was opened.
    pub end: f64,
    /// Wall time since the last frame, ms; `None` after a pause.
    pub interval: Option<f64>,
    /// The program's own time, without waiting, ms.
    pub host: f64,
    /// Device times of the passes, ms; equal names are added up. They arrive after the frame has ended.
    pub passes: Vec<(&'static str, f64)>,
    /// What the frame consists of, for each side. They arrive with the times of the passes.
    pub counts: Vec<FrameCounts>,
}

/// What the device says of a frame that has ended.
#[derive(Default)]
pub struct Measured {
    pub passes: Vec<PassTime>,
    /// For each side.
    pub counts: Vec<FrameCounts>,
}

#[derive(Default)]
pub struct Profiler {
    pub frames: VecDeque<FrameTimes>,
    /// Device memory by the names of allocations, bytes.
    pub memory: BTreeMap<String, u64>,
    /// Device memory that is reserved, bytes.
    pub reserved: u64,
    next: u64,
    /// Numbers of frames with a picture whose passes are not known yet.
    pending: VecDeque<u64>,
}

impl Profiler {
    /// Adds a frame. `measured` is of the last frame with a picture that has ended.
    pub fn add(&mut self, mut frame: FrameTimes, has_picture: bool, measured: Measured) {
        frame.number = self.next;
        self.next += 1;
        if has_picture {
            if self.pending.len() >= FRAMES_IN_FLIGHT {
                let owner = self.pending.pop_front();
                if let Some(owner) = self
                    .frames
                    .iter_mut()
                    .find(|frame| Some(frame.number) == owner)
                {
                    owner.passes = merged(&measured.passes);
                    owner.counts = measured.counts;
                }
            }
            self.pending.push_back(frame.number);
        }
        self.frames.push_back(frame);
        while self.frames.len() > MAX_FRAMES {
            self.frames.pop_front();
        }
    }

    /// The names of all passes, in the order in which they are recorded.
    pub fn pass_names(&self) -> Vec<&'static str> {
        let mut names = Vec::new();
        for (name, _) in self.frames.iter().flat_map(|frame| &frame.passes) {
            if !names.contains(name) {
                names.push(*name);
            }
        }
        names
    }

    /// Device time of a pass over the frames that have it.
    pub fn pass_times(&self, name: &str) -> Option<Times> {
        let passes = self.frames.iter().flat_map(|frame| &frame.passes);
        Times::of(
            passes
                .filter(|(other, _)| *other == name)
                .map(|(_, ms)| *ms)
                .collect(),
        )
    }

    /// Wall time from frame to frame.
    pub fn intervals(&self) -> Option<Times> {
        Times::of(
            self.frames
                .iter()
                .filter_map(|frame| frame.interval)
                .collect(),
        )
    }

    /// The same of the last frames only.
    pub fn recent(&self, frames: usize) -> Option<Times> {
        Times::of(
            self.frames
                .iter()
                .rev()
                .take(frames)
                .filter_map(|frame| frame.interval)
                .collect(),
        )
    }

    /// Time of the program for a frame.
    pub fn host_times(&self) -> Option<Times> {
        Times::of(self.frames.iter().map(|frame| frame.host).collect())
    }

    /// The counts of the last frame that has them, for each side.
    pub fn counts(&self) -> &[FrameCounts] {
        let mut counts = self.frames.iter().rev().map(|frame| &frame.counts);
        (counts.find(|counts| !counts.is_empty())).map_or(&[], Vec::as_slice)
    }

    /// Writes `path` with the extension `.json` as a Chrome trace and with `.csv` as a table.
    ///
    /// # Errors
    /// [`Error::Output`] where a file cannot be written.
    pub fn export(&self, path: &Path) -> Result<()> {
        write_atomically(&path.with_extension("json"), self.trace().as_bytes())?;
        let table = path.with_extension("csv");
        let content = self.table().map_err(|error| Error::Output {
            file: table.clone(),
            reason: error.to_string(),
            remedy: "try again".into(),
        })?;
        write_atomically(&table, &content)
    }

    /// Events as chrome://tracing and Perfetto read them: frames in one row, their passes in another.
    fn trace(&self) -> String {
        let event = |name: &str, row: u32, start_ms: f64, ms: f64| json!({ "name": name, "ph": "X", "pid": 1, "tid": row, "ts": 1e3 * start_ms, "dur": 1e3 * ms });
        let name = |row: u32, name: &str| json!({ "name": "thread_name", "ph": "M", "pid": 1, "tid": row, "args": { "name": name } });
        let mut events = vec![
            name(1, "frames (wall)"),
            name(2, "host"),
            name(3, "passes (device)"),
        ];
        for frame in &self.frames {
            let end = 1e3 * frame.end;
            let wall = frame.interval.unwrap_or(frame.host);
            events.push(event("frame", 1, end - wall, wall));
            events.push(event("host", 2, end - frame.host, frame.host));
            // Passes follow each other on the device; where a frame began there is not known.
            let mut start = end - wall;
            for (pass, ms) in &frame.passes {
                events.push(event(pass, 3, start, *ms));
                start += ms;
            }
            for (side, counts) in frame.counts.iter().enumerate() {
                let values: serde_json::Map<_, _> = (COUNTS.iter().zip(numbers(counts)))
                    .filter_map(|(name, value)| Some(((*name).to_owned(), json!(value?))))
                    .collect();
                events.push(json!({ "name": format!("counts{}", SIDES[side]), "ph": "C", "pid": 1, "ts": 1e3 * (end - wall), "args": values }));
            }
        }
        let memory = json!({ "reserved": self.reserved, "by_name": self.memory });
        json!({ "traceEvents": events, "displayTimeUnit": "ms", "otherData": { "memory_bytes": memory } })
            .to_string()
    }

    fn table(&self) -> csv::Result<Vec<u8>> {
        let passes = self.pass_names();
        let sides = (self.frames.iter().map(|frame| frame.counts.len())).max();
        let sides = sides.unwrap_or(0).max(1);
        let mut writer = csv::Writer::from_writer(Vec::new());
        let heads = ["end_s", "interval_ms", "host_ms"].map(str::to_owned);
        writer.write_record(
            heads
                .into_iter()
                .chain(
                    (0..sides).flat_map(|side| COUNTS.map(|name| format!("{name}{}", SIDES[side]))),
                )
                .chain(passes.iter().map(|pass| format!("{pass} ms"))),
        )?;
        for frame in &self.frames {
            let interval = frame.interval.map(|ms| ms.to_string()).unwrap_or_default();
            let times = passes.iter().map(|pass| {
                let time = frame.passes.iter().find(|(name, _)| name == pass);
                time.map(|(_, ms)| ms.to_string()).unwrap_or_default()
            });
            let first = [frame.end.to_string(), interval, frame.host.to_string()];
            let counts = (0..sides).flat_map(|side| {
                let counts = frame.counts.get(side).map(numbers).unwrap_or_default();
                counts.map(|value| value.map(|value| value.to_string()).unwrap_or_default())
            });
            writer.write_record(first.into_iter().chain(counts).chain(times))?;
        }
        writer
            .into_inner()
            .map_err(|error| error.into_error().into())
    }
}

/// The numbers of [`FrameCounts`], as exported files name them.
const COUNTS: [&str; 4] = ["patches", "traced_corners", "splats", "estimated_error"];
/// What the names of a side's counts end with.
const SIDES: [&str; 2] = ["", " of B"];

fn numbers(counts: &FrameCounts) -> [Option<f64>; 4] {
    [
        Some(counts.patches.into()),
        Some(counts.traced_corners.into()),
        counts.splats.map(f64::from),
        counts.error.map(f64::from),
    ]
}

/// Passes in the order of their first occurrence, equal names as one, ms.
fn merged(passes: &[PassTime]) -> Vec<(&'static str, f64)> {
    let mut merged: Vec<(&'static str, f64)> = Vec::new();
    for pass in passes {
        let ms = 1e3 * pass.gpu.unwrap_or(0.0);
        match merged.iter_mut().find(|(name, _)| *name == pass.name) {
            Some((_, sum)) => *sum += ms,
            None => merged.push((pass.name, ms)),
        }
    }
    merged
}

#[cfg(test)]
mod tests {
    use super::*;

    fn pass(name: &'static str, seconds: f64) -> PassTime {
        PassTime {
            name,
            gpu: Some(seconds),
            wall: None,
        }
    }

    #[test]
    fn passes_go_to_the_frame_that_they_are_of() {
        let mut profiler = Profiler::default();
        for number in 0..5u32 {
            let of = number.saturating_sub(FRAMES_IN_FLIGHT as u32);
            let measured = Measured {
                passes: vec![pass("splat", f64::from(of)), pass("splat", 0.0)],
                counts: vec![FrameCounts {
                    patches: of,
                    ..FrameCounts::default()
                }],
            };
            profiler.add(
                FrameTimes {
                    host: f64::from(number),
                    ..Default::default()
                },
                true,
                measured,
            );
        }
        let known = &profiler.frames[2];
        assert_eq!(known.passes, [("splat", 2000.0)]);
        assert_eq!(known.counts[0].patches, 2);
        assert_eq!(profiler.counts()[0].patches, 2);
        assert!(profiler.frames[3].passes.is_empty());
        assert_eq!(profiler.pass_names(), ["splat"]);
    }

    #[test]
    fn exported_files_hold_all_frames() {
        let mut profiler = Profiler::default();
        for _ in 0..4 {
            profiler.add(
                FrameTimes {
                    interval: Some(2.0),
                    ..Default::default()
                },
                true,
                Measured {
                    passes: vec![pass("view", 0.001)],
                    counts: vec![FrameCounts {
                        splats: Some(7),
                        ..FrameCounts::default()
                    }],
                },
            );
        }
        let trace: serde_json::Value = serde_json::from_str(&profiler.trace()).unwrap();
        assert_eq!(
            trace["traceEvents"].as_array().unwrap().len(),
            3 + 4 * 2 + 2 * 2
        );
        let table = String::from_utf8(profiler.table().unwrap()).unwrap();
        assert!(
            table.starts_with(
                "end_s,interval_ms,host_ms,patches,traced_corners,splats,estimated_error,view ms\n"
            ),
            "{table}"
        );
        assert_eq!(table.lines().count(), 5);
    }
}
