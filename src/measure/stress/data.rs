//! All sweeps as plain data.

use super::SweepReport;
use super::targets::TargetPoint;
use serde::{Deserialize, Serialize};

/// Version of [`Report`]'s JSON, raised when a field changes its meaning or goes.
pub const SCHEMA: u32 = 1;

/// All sweeps on one device.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Report {
    /// [`SCHEMA`].
    pub schema: u32,
    /// Version of this crate.
    pub nephroid: String,
    /// That it was built from, where known.
    pub commit: Option<String>,
    /// ISO 8601.
    pub date: String,
    /// Name of the Vulkan device.
    pub device: String,
    /// Name and version of its driver.
    pub driver: String,
    /// Model name of the CPU.
    pub cpu: String,
    /// Few values, coarse maps, rough truths.
    pub quick: bool,
    /// Those that are finished.
    pub sweeps: Vec<SweepReport>,
    /// Error targets on scenes of all kinds; empty if they were not measured.
    #[serde(default)]
    pub targets: Vec<TargetPoint>,
}
