//! The one public error type: every failure a user can cause or meet.
//!
//! Policy: bad input, a missing device and a full disk are [`Error`]s; a mistake of the
//! programmer is an assertion; what may be absent is an `Option`.

use std::path::PathBuf;

/// What went wrong, where, why, and what to do about it.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// The command line asks for something that makes no sense.
    #[error("{reason}\n  remedy: {remedy}")]
    Usage { reason: String, remedy: String },

    /// A scene file, mesh, material library or image cannot be used.
    #[error("{}{}: {reason}\n  remedy: {remedy}", file.display(), at(place))]
    Input {
        file: PathBuf,
        /// Line and column, key or element, where there is one.
        place: Option<String>,
        reason: String,
        remedy: String,
    },

    /// A file cannot be written.
    #[error("{}: cannot be written: {reason}\n  remedy: {remedy}", file.display())]
    Output {
        file: PathBuf,
        reason: String,
        remedy: String,
    },

    /// No Vulkan loader, driver, layer or device that can do the work.
    #[error("no suitable Vulkan device: {reason}\n  remedy: {remedy}")]
    NoDevice { reason: String, remedy: String },

    /// The device was lost or ran out of memory, or a Vulkan call failed.
    #[error("{action} failed on the device: {reason}\n  remedy: {remedy}")]
    Device {
        action: String,
        reason: String,
        remedy: String,
    },

    /// The Vulkan device or command buffer of a host application cannot be used.
    #[error("{reason}\n  remedy: {remedy}")]
    Host { reason: String, remedy: String },

    /// The validation layers, asked for with `--validate`, complained.
    #[error("{} validation message(s), the first: {first}", count)]
    Validation { count: usize, first: String },

    /// Some frames of a sequence could not be made; the others were.
    #[error("{} of {count} frames failed ({}); the first: {first}", failed.len(), listed(failed))]
    Frames {
        /// Their numbers.
        failed: Vec<u32>,
        count: usize,
        first: Box<Error>,
    },

    /// Stopped by Ctrl-C. What was finished before is kept, and no file is left half-written.
    #[error("stopped by Ctrl-C or a signal")]
    Cancelled,
}

fn at(place: &Option<String>) -> String {
    place
        .as_ref()
        .map_or(String::new(), |place| format!(", {place}"))
}

/// The first ten.
fn listed(numbers: &[u32]) -> String {
    const MOST: usize = 10;
    let shown: Vec<String> = (numbers.iter().take(MOST)).map(u32::to_string).collect();
    let rest = if numbers.len() > MOST { ", …" } else { "" };
    shown.join(", ") + rest
}

impl Error {
    /// Exit code of the command line: 1 validation message, 2 usage or unwritable output, 3 bad
    /// scene or asset, 4 no suitable device, 5 device lost or out of memory, 6 some frames failed, 130 stopped by Ctrl-C.
    pub fn exit_code(&self) -> u8 {
        match self {
            Self::Validation { .. } => 1,
            Self::Usage { .. } | Self::Output { .. } => 2,
            Self::Input { .. } => 3,
            Self::NoDevice { .. } | Self::Host { .. } => 4,
            Self::Device { .. } => 5,
            Self::Frames { .. } => 6,
            Self::Cancelled => 130,
        }
    }
}

/// Result with this crate's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;
