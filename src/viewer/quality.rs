//! The settings of the renderer that the window offers.

use nephroid::render::{FrameBudget, Method, Settings};
use std::time::Duration;

/// Relative L1 errors to aim for.
pub const ERRORS: std::ops::RangeInclusive<f32> = 1e-3..=0.5;
/// Stages in which a still picture becomes finer.
pub const STAGES: u32 = 3;

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

#[derive(Debug, Clone, PartialEq)]
pub struct Quality {
    pub method: Method,
    pub aim: Aim,
    pub environment_cells: u32,
    pub environment_images: u32,
    /// Square root of the number of samples per pixel while something moves.
    pub antialias: u32,
    /// Whether a still picture becomes finer.
    pub refines: bool,
    /// Pixels of the picture per pixel of the window, on a side.
    pub resolution: f32,
    /// Factor on the sides of light maps.
    pub light_map_scale: f64,
}

impl Default for Quality {
    fn default() -> Self {
        let settings = Settings::default();
        Self {
            method: settings.method,
            aim: Aim::Error(0.02),
            environment_cells: settings.environment_cells,
            environment_images: settings.environment_images,
            antialias: 1,
            refines: true,
            resolution: 1.0,
            light_map_scale: 1.0,
        }
    }
}

impl Quality {
    /// The settings of a renderer.
    pub fn settings(&self) -> Settings {
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
            _ if self.method != Method::Footprint => None,
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
        let key = |quality: &Self| {
            let settings = quality.settings();
            let samples = settings.error.is_none().then_some(settings.samples);
            (
                settings.method,
                samples,
                settings.environment_cells,
                settings.environment_images,
            )
        };
        key(self) == key(other)
    }

    /// Square root of the number of samples per pixel at a stage of refinement, and a factor on the error to aim for.
    pub fn stage(&self, stage: u32) -> (u32, f32) {
        match stage {
            0 => (self.antialias, 1.0),
            1 => (self.antialias.max(2), 1.0),
            2 => (self.antialias.max(2), 0.5),
            _ => (self.antialias.max(4), 0.25),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_structure_needs_another_renderer() {
        let quality = Quality::default();
        let other = |change: &dyn Fn(&mut Quality)| {
            let mut other = quality.clone();
            change(&mut other);
            quality.same_renderer(&other)
        };
        assert!(other(&|q| q.aim = Aim::Error(0.1)));
        assert!(other(&|q| q.aim = Aim::Budget(16.0)));
        assert!(other(&|q| q.resolution = 0.5));
        assert!(!other(&|q| q.aim = Aim::Samples(1000)));
        assert!(!other(&|q| q.method = Method::Points));
    }

    #[test]
    fn stages_never_get_coarser() {
        for antialias in 1..=4 {
            let quality = Quality {
                antialias,
                ..Quality::default()
            };
            for stage in 0..STAGES {
                let [(side, factor), (next_side, next_factor)] =
                    [stage, stage + 1].map(|s| quality.stage(s));
                assert!(next_side >= side && next_factor <= factor);
            }
        }
    }
}
