//! The one public error type: every failure that a user or a host application can cause or meet.
//!
//! Policy: bad input, a missing device and a full disk are [`Error`]s; a mistake of the
//! programmer is an assertion; what may be absent is an `Option`.

use std::path::PathBuf;

/// What went wrong, where, why, and what to do about it.
#[derive(Debug, thiserror::Error)]
pub enum Error {
    /// A request that makes no sense, or that needs more memory than there is.
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

    /// No display, or no window or surface on it.
    #[error("{reason}\n  remedy: {remedy}")]
    Window { reason: String, remedy: String },

    /// The validation layers complained.
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

    /// Stopped because the caller asked for it. What was finished before is kept, and no file is left half-written.
    #[error("stopped before the end")]
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

/// Result with this crate's [`Error`].
pub type Result<T, E = Error> = std::result::Result<T, E>;
