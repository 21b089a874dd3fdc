//! How a side of the picture computes its caustic.

use nephroid::render::{DEFAULT_ERROR, FrameBudget, Method, Settings};
use std::time::Duration;

/// Relative L1 errors to aim for.
pub const ERRORS: std::ops::RangeInclusive<f32> = 1e-3..=0.5;

/// What decides the number of patches.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Aim {
    /// Relative L1 error.
    Error(f32),
    /// Time of a frame, ms.
    Budget(f32),
    /// Number of patches or points.
    Samples(u32),
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Technique {
    /// Whether the caustic is that of the reference on the CPU, and the rest is not used.
    pub is_reference: bool,
    pub method: Method,
    pub aim: Aim,
    pub environment_cells: u32,
    pub environment_images: u32,
}

impl Default for Technique {
    fn default() -> Self {
        let settings = Settings::default();
        Self {
            is_reference: false,
            method: settings.method,
            aim: Aim::Error(DEFAULT_ERROR),
            environment_cells: settings.environment_cells,
            environment_images: settings.environment_images,
        }
    }
}

impl Technique {
    /// The settings of a renderer. Beside a reference, its caustic is replaced and should cost little.
    pub fn settings(&self) -> Settings {
        if self.is_reference {
            return Settings {
                method: Method::Footprint,
                samples: 1,
                error: None,
                environment_cells: 8,
                environment_images: 1,
                ..Settings::default()
            };
        }
        Settings {
            method: self.method,
            samples: match self.aim {
                Aim::Samples(samples) => samples,
                _ => Settings::default().samples,
            },
            error: self.error(),
            environment_cells: self.environment_cells,
            environment_images: self.environment_images,
            ..Settings::default()
        }
    }

    /// The error to aim for in the first frame; only `footprint` aims for one.
    pub fn error(&self) -> Option<f32> {
        match self.aim {
            _ if self.is_reference || self.method != Method::Footprint => None,
            Aim::Error(error) => Some(error),
            Aim::Budget(ms) => Some(self.budget(ms).error()),
            Aim::Samples(_) => None,
        }
    }

    /// A budget for frames of this many ms.
    pub fn budget(&self, ms: f32) -> FrameBudget {
        FrameBudget::new(Duration::from_secs_f64(1e-3 * f64::from(ms)))
    }

    /// Whether a renderer made for `other` can be used.
    pub fn same_renderer(&self, other: &Self) -> bool {
        let key = |technique: &Self| {
            let settings = technique.settings();
            let samples = settings.error.is_none().then_some(settings.samples);
            (
                technique.is_reference,
                settings.method,
                samples,
                settings.environment_cells,
                settings.environment_images,
            )
        };
        key(self) == key(other)
    }

    /// Method and aim in a few words.
    pub fn label(&self) -> String {
        if self.is_reference {
            return "reference".into();
        }
        let aim = match (self.error(), self.aim) {
            (Some(_), Aim::Budget(ms)) => format!("{ms:.0} ms"),
            (Some(error), _) => format!("{:.3} %", 100.0 * error),
            _ => format!("{} samples", self.settings().samples),
        };
        format!("{}, {aim}", self.method.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_structure_needs_another_renderer() {
        let technique = Technique::default();
        let other = |change: &dyn Fn(&mut Technique)| {
            let mut other = technique;
            change(&mut other);
            technique.same_renderer(&other)
        };
        assert!(other(&|t| t.aim = Aim::Error(0.1)));
        assert!(other(&|t| t.aim = Aim::Budget(16.0)));
        assert!(!other(&|t| t.aim = Aim::Samples(1000)));
        assert!(!other(&|t| t.method = Method::Points));
        assert!(!other(&|t| t.is_reference = true));
    }

    #[test]
    fn labels_name_what_counts() {
        let mut technique = Technique::default();
        assert_eq!(technique.label(), "footprint, 2.000 %");
        technique.method = Method::Points;
        assert_eq!(technique.label(), "points, 16384 samples");
    }
}
