//! The report at the end of a run: frame times, by the sections that a script names.

use super::stats::Times;
use nephroid::gpu::DeviceInfo;
use serde::Serialize;
use std::time::{Duration, Instant};
use sysinfo::{Pid, ProcessRefreshKind, ProcessesToUpdate, System};

/// Frames from one `measure` of a script to the next.
#[derive(Debug, Default)]
struct Section {
    name: String,
    frames: u32,
    /// With a new picture.
    pictures: u32,
    /// ms
    intervals: Vec<f64>,
    host: Vec<f64>,
    /// The smallest of the pictures' scales by dynamic resolution.
    scale: Option<f32>,
    /// Memory of the process at its end, bytes.
    memory: u64,
}

/// A wait of a script.
#[derive(Debug, Serialize)]
struct Idle {
    seconds: f64,
    /// Time of the processor over wall time: 1 is one core.
    cores: f64,
    frames: u32,
}

/// Collects what [`Report`] says.
pub struct Recorder {
    start: Instant,
    first_picture: Option<Duration>,
    sections: Vec<Section>,
    idle: Vec<Idle>,
    /// When the wait in progress began, the processor's time then, and the number of frames.
    waits: Option<(Instant, Duration, u32)>,
    frames: u32,
}

#[derive(Debug, Serialize)]
pub struct Report {
    pub scene: String,
    pub device: DeviceInfo,
    /// Time from the start of the program to the first picture in the window, s.
    pub first_picture: Option<f64>,
    sections: Vec<SectionReport>,
    idle: Vec<Idle>,
}

#[derive(Debug, Serialize)]
struct SectionReport {
    name: String,
    frames: u32,
    pictures: u32,
    frame_ms: Option<Times>,
    host_ms: Option<Times>,
    /// The smallest of the pictures' scales by dynamic resolution.
    scale: Option<f32>,
    memory: u64,
}

impl Recorder {
    /// The report of a program that was started at `start`.
    pub fn new(start: Instant) -> Self {
        Self {
            start,
            first_picture: None,
            sections: vec![Section {
                name: "all".into(),
                ..Section::default()
            }],
            idle: Vec::new(),
            waits: None,
            frames: 0,
        }
    }

    /// Begins a section.
    pub fn measure(&mut self, name: &str) {
        self.end_section();
        self.sections.push(Section {
            name: name.into(),
            ..Section::default()
        });
    }

    fn end_section(&mut self) {
        if let Some(section) = self.sections.last_mut() {
            section.memory = process().map_or(0, |(memory, _)| memory);
        }
    }

    /// Whether there was a picture.
    pub fn has_picture(&self) -> bool {
        self.first_picture.is_some()
    }

    /// Adds a frame; times in ms. `scale`: of a new picture by dynamic resolution.
    pub fn add(&mut self, interval: Option<f64>, host: f64, scale: Option<f32>) {
        let has_picture = scale.is_some();
        self.frames += 1;
        if has_picture && self.first_picture.is_none() {
            self.first_picture = Some(self.start.elapsed());
        }
        if let Some(section) = self.sections.last_mut() {
            section.frames += 1;
            section.pictures += u32::from(has_picture);
            section.intervals.extend(interval);
            section.host.push(host);
            section.scale = section.scale.into_iter().chain(scale).reduce(f32::min);
        }
    }

    pub fn begin_wait(&mut self) {
        let processor = process().map_or(Duration::ZERO, |(_, processor)| processor);
        self.waits = Some((Instant::now(), processor, self.frames));
    }

    pub fn end_wait(&mut self) {
        if let Some((start, before, frames)) = self.waits.take() {
            let processor = process().map_or(before, |(_, processor)| processor);
            let seconds = start.elapsed().as_secs_f64();
            self.idle.push(Idle {
                seconds,
                cores: processor.saturating_sub(before).as_secs_f64() / seconds.max(1e-3),
                frames: self.frames - frames,
            });
        }
    }

    pub fn finish(mut self, scene: String, device: DeviceInfo) -> Report {
        self.end_section();
        let sections = self
            .sections
            .into_iter()
            .filter(|section| section.frames > 0)
            .map(|section| SectionReport {
                name: section.name,
                frames: section.frames,
                pictures: section.pictures,
                frame_ms: Times::of(section.intervals),
                host_ms: Times::of(section.host),
                scale: section.scale,
                memory: section.memory,
            });
        Report {
            scene,
            device,
            first_picture: self.first_picture.map(|time| time.as_secs_f64()),
            sections: sections.collect(),
            idle: self.idle,
        }
    }
}

impl Report {
    pub fn text(&self) -> String {
        let mut text = format!(
            "{}\ndevice  {} ({})",
            self.scene, self.device.name, self.device.driver
        );
        if let Some(seconds) = self.first_picture {
            text += &format!("\nfirst picture  {seconds:.2} s");
        }
        for section in &self.sections {
            text += &format!(
                "\n{}  {} frames, {} pictures",
                section.name, section.frames, section.pictures
            );
            if let Some(times) = section.frame_ms {
                text += &format!(
                    "\n  frame  median {:.1} ms ({:.1} frames/s), p95 {:.1}, p99 {:.1}, longest {:.1}, {} dropped",
                    times.median,
                    1e3 / times.median,
                    times.p95,
                    times.p99,
                    times.longest,
                    times.dropped
                );
            }
            if let Some(scale) = section.scale.filter(|scale| *scale < 1.0) {
                text += &format!("\n  dynamic resolution  down to {scale:.2}");
            }
            if let Some(times) = section.host_ms {
                text += &format!(
                    "\n  host   median {:.2} ms, p99 {:.2}",
                    times.median, times.p99
                );
            }
        }
        for idle in &self.idle {
            text += &format!(
                "\nidle  {:.1} s, {:.1} % of a core, {} frames",
                idle.seconds,
                100.0 * idle.cores,
                idle.frames
            );
        }
        text
    }
}

/// Memory of this process, bytes, and its processor time.
fn process() -> Option<(u64, Duration)> {
    let pid = Pid::from_u32(std::process::id());
    let mut system = System::new().ok()?;
    let wanted = ProcessRefreshKind::nothing().with_memory().with_cpu();
    system.refresh_processes_specifics(ProcessesToUpdate::Some(&[pid]), false, wanted);
    let process = system.process(pid)?;
    Some((
        process.memory(),
        Duration::from_millis(process.accumulated_cpu_time()),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn this_process_uses_memory() {
        let (memory, _) = process().unwrap();
        assert!(memory > 1 << 16);
    }
}
