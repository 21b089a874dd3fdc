//! The time that a frame may take, held by the error that it aims for.

use std::collections::VecDeque;
use std::time::Duration;

/// Share of the budget that is aimed for: times vary, and the median shall stay below the budget.
const AIM: f64 = 0.95;
/// Relative L1 error of the first frame. The first frames are coarse and become finer.
const FIRST_ERROR: f32 = 0.1;
/// Range of errors to aim for.
const ERRORS: [f32; 2] = [1e-4, 1.0];
/// Largest change of the error from one frame to the next, as a factor, so that no change is visible.
const CHANGE: f64 = 1.5;
/// The same after a frame beyond this multiple of the budget.
const FAST_CHANGE: f64 = 2.5;
const LATE: f64 = 1.5;
/// Frames whose median decides: a slow frame or two on a busy machine change nothing.
const FRAMES: usize = 5;

/// Power of 1 / error that the time of a frame is taken to be in proportion to. A part of the time does not depend on the
/// error, and measured powers are from 0.3 to 1.2: they delay the convergence, but do not prevent it.
const POWER: f64 = 0.7;

/// Chooses the relative L1 error to aim for, [`super::Settings::error`], so that frames take a given time.
#[derive(Debug, Clone)]
pub struct FrameBudget {
    seconds: f64,
    error: f32,
    /// Time in s and estimated error of each of the last frames.
    last: VecDeque<(f64, f64)>,
    is_met: bool,
}

impl FrameBudget {
    /// A budget of `time` per frame.
    pub fn new(time: Duration) -> Self {
        Self {
            seconds: time.as_secs_f64(),
            error: FIRST_ERROR,
            last: VecDeque::new(),
            is_met: false,
        }
    }

    /// Relative L1 error to aim for in the next frame.
    pub fn error(&self) -> f32 {
        self.error
    }

    /// Whether the last frames were within a tenth of the time that is aimed for, or nothing can bring them there.
    pub fn is_met(&self) -> bool {
        self.is_met
    }

    /// Median time of the last frames.
    pub fn time(&self) -> Duration {
        Duration::from_secs_f64(self.median(|(seconds, _)| seconds))
    }

    /// Whether enough time is left for larger buffers to pay off.
    pub(super) fn has_time_for_more(&self) -> bool {
        self.median(|(seconds, _)| seconds) < 0.7 * self.seconds
    }

    /// Adds the time of a frame and the error that was estimated for it. The estimate differs from the error aimed for if the
    /// method cannot do better or worse.
    pub fn add(&mut self, time: Duration, estimated: f32) {
        let (seconds, aim) = (time.as_secs_f64(), AIM * self.seconds);
        if estimated <= 0.0 {
            // No light arrives, so that no error takes longer than another.
            self.is_met = true;
            return;
        }
        self.last.truncate(FRAMES - 1);
        self.last.push_front((seconds, f64::from(estimated)));
        let cost = self.median(|(seconds, error)| seconds * error.powf(POWER));
        let wanted = (cost / aim).powf(1.0 / POWER) / f64::from(estimated);
        let is_at_limit = match wanted > 1.0 {
            true => estimated < 0.99 * self.error,
            false => estimated > 1.01 * self.error,
        };
        let is_close = (self.time().as_secs_f64() / aim - 1.0).abs() <= 0.1;
        self.is_met = self.last.len() == FRAMES && (is_close || is_at_limit);
        let change = match seconds > LATE * self.seconds {
            true => FAST_CHANGE,
            false => CHANGE,
        };
        let next = estimated * wanted.clamp(1.0 / change, change) as f32;
        self.error = next.clamp(ERRORS[0], ERRORS[1]);
    }

    /// Median over the last frames, 0 before the first one.
    fn median(&self, value: impl Fn((f64, f64)) -> f64) -> f64 {
        let mut values: Vec<f64> = self.last.iter().copied().map(value).collect();
        values.sort_by(f64::total_cmp);
        values.get(values.len() / 2).copied().unwrap_or(0.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const BUDGET: f64 = 0.016;

    /// Frames that take `base` + `slope` / error, in s, where the error cannot leave `range`.
    fn frame(budget: &mut FrameBudget, base: f64, slope: f64, range: [f32; 2]) -> f64 {
        let error = budget.error().clamp(range[0], range[1]);
        let seconds = base + slope / f64::from(error);
        budget.add(Duration::from_secs_f64(seconds), error);
        seconds
    }

    #[test]
    fn frames_take_the_time() {
        // Of the time at 2 %, a part does not depend on the error.
        for constant in [0.0, 0.3, 0.6] {
            let mut budget = FrameBudget::new(Duration::from_secs_f64(BUDGET));
            let (base, slope) = (constant * BUDGET, (1.0 - constant) * BUDGET * 0.02);
            let times = [(); 24].map(|()| frame(&mut budget, base, slope, ERRORS));
            for seconds in &times[14..] {
                assert!(
                    (0.9..=1.0).contains(&(seconds / BUDGET)),
                    "{constant}: {times:?}"
                );
            }
            assert!(budget.is_met());
            // Twice the work from one frame to the next.
            let times = [(); 24].map(|()| frame(&mut budget, base, 2.0 * slope, ERRORS));
            for seconds in &times[14..] {
                assert!(
                    (0.9..=1.0).contains(&(seconds / BUDGET)),
                    "{constant}: {times:?}"
                );
            }
        }
    }

    #[test]
    fn slow_frames_change_nothing() {
        let mut budget = FrameBudget::new(Duration::from_secs_f64(BUDGET));
        for _ in 0..30 {
            frame(&mut budget, 0.0, 0.02 * BUDGET, ERRORS);
        }
        let error = budget.error();
        for _ in 0..2 {
            budget.add(Duration::from_secs_f64(5.0 * BUDGET), error);
            assert!((budget.error() / error - 1.0).abs() < 0.01);
        }
    }

    /// The coarsest frame takes longer than the budget, or the finest one less.
    #[test]
    fn impossible_budgets_end_at_the_limit() {
        for (slope, range, limit) in [(1.0, [0.005, 0.05], 0.05), (1e-6, [0.005, 0.05], 0.005)] {
            let mut budget = FrameBudget::new(Duration::from_secs_f64(BUDGET));
            for _ in 0..12 {
                frame(&mut budget, 0.0, slope, range);
            }
            assert!(budget.is_met());
            assert_eq!(budget.error().clamp(range[0], range[1]), limit);
        }
    }

    #[test]
    fn darkness_takes_no_time() {
        let mut budget = FrameBudget::new(Duration::from_secs_f64(BUDGET));
        budget.add(Duration::from_secs_f64(BUDGET / 2.0), 0.0);
        assert!(budget.is_met());
        assert_eq!(budget.error(), FIRST_ERROR);
    }
}
