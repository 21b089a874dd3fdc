//! What a measurement was made on.

use nephroid::gpu::DeviceInfo;
use nephroid::measure::machine;
use std::process::Command;

/// Beside every table of measurements.
#[derive(Debug, Clone, PartialEq)]
pub struct Run {
    /// UTC, ISO 8601, with the time.
    pub date: String,
    /// Of the source tree; with `-dirty` where something but the documents differs from it.
    pub commit: String,
    pub device: String,
    pub driver: String,
    /// Model name.
    pub cpu: String,
}

impl Run {
    /// Of now and here.
    pub fn on(device: &DeviceInfo) -> Self {
        let changed = output("git", &["status", "--porcelain", "--", ".", ":!docs"]);
        let dirty = if changed.is_some() { "-dirty" } else { "" };
        Self {
            date: machine::date(),
            commit: output("git", &["rev-parse", "--short=10", "HEAD"])
                .map_or("unknown".into(), |commit| commit + dirty),
            device: device.name.clone(),
            driver: device.driver.clone(),
            cpu: machine::cpu(),
        }
    }

    /// Names and values.
    pub fn rows(&self) -> [(&'static str, &str); 5] {
        [
            ("Date", &self.date),
            ("Commit", &self.commit),
            ("Device", &self.device),
            ("Driver", &self.driver),
            ("CPU", &self.cpu),
        ]
    }
}

/// What a program prints, trimmed; `None` where it fails or prints nothing.
fn output(program: &str, arguments: &[&str]) -> Option<String> {
    let output = Command::new(program).args(arguments).output().ok()?;
    let text = String::from_utf8(output.stdout).ok()?.trim().to_owned();
    (output.status.success() && !text.is_empty()).then_some(text)
}
