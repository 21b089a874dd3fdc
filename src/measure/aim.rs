//! What a measured setting asks of the renderer: samples, an error, or a time.

use crate::error::Result;
use crate::render::{Renderer, Settings};
use std::fmt::{self, Display, Formatter};
use std::time::Duration;

/// What a setting asks for.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Aim {
    /// Number of patches or of points.
    Samples(u32),
    /// Relative L1 error.
    Error(f32),
    /// Time of a frame, ms.
    Milliseconds(u32),
}

impl Aim {
    /// `settings` with it.
    pub fn apply(self, settings: &Settings) -> Settings {
        let mut settings = settings.clone();
        match self {
            Self::Samples(samples) => settings.samples = samples,
            Self::Error(error) => settings.error = Some(error),
            Self::Milliseconds(time) => settings.budget = Some(Duration::from_millis(time.into())),
        }
        settings
    }

    /// A measure of the work, to compare aims of one kind.
    pub fn work(self) -> f64 {
        match self {
            Self::Samples(samples) => samples.into(),
            Self::Error(error) => 1.0 / f64::from(error),
            Self::Milliseconds(time) => time.into(),
        }
    }

    /// Renders until the budget is met, if there is one. Returns whether the renderer can aim for this at all.
    ///
    /// # Errors
    /// As [`Renderer::caustic`].
    pub fn settle(self, renderer: &mut Renderer) -> Result<bool> {
        if let Self::Samples(_) = self {
            return Ok(true);
        }
        renderer.caustic()?;
        renderer.settle()?;
        Ok(renderer.estimated_error()?.is_some())
    }
}

impl Display for Aim {
    fn fmt(&self, formatter: &mut Formatter) -> fmt::Result {
        match self {
            Self::Samples(samples) => write!(formatter, "{samples} samples"),
            Self::Error(error) => write!(formatter, "error {} %", (1e4 * error).round() / 100.0),
            Self::Milliseconds(time) => write!(formatter, "{time} ms"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn aims_are_named_and_ordered() {
        let aims = [Aim::Samples(256), Aim::Error(0.02), Aim::Milliseconds(16)];
        assert_eq!(
            aims.map(|aim| aim.to_string()),
            ["256 samples", "error 2 %", "16 ms"]
        );
        assert!(Aim::Error(0.01).work() > Aim::Error(0.02).work());
        assert!(Aim::Milliseconds(33).work() > Aim::Milliseconds(16).work());
    }

    #[test]
    fn only_what_is_asked_for_is_set() {
        let base = Settings::default();
        let of = |aim: Aim| aim.apply(&base);
        assert_eq!(of(Aim::Samples(7)).samples, 7);
        assert_eq!(of(Aim::Samples(7)).error, None);
        assert_eq!(of(Aim::Error(0.05)).error, Some(0.05));
        assert_eq!(
            of(Aim::Milliseconds(5)).budget,
            Some(Duration::from_millis(5))
        );
    }
}
