//! The resolution of pictures while something moves, by the time that frames take.

use std::f32::consts::FRAC_1_SQRT_2;

/// Pixels of a picture over those at rest, on a side: half as many pixels from step to step.
const SCALES: [f32; 3] = [1.0, FRAC_1_SQRT_2, 0.5];
/// Frames whose median decides.
const FRAMES: usize = 3;
/// Frames after a change that still show the time of the step before: those in flight.
const SKIPPED: u32 = 2;
/// Time at a step, over that at the step before, above which fewer pixels do not pay: something else takes the time.
const WORTHWHILE: f64 = 0.85;

/// Chooses among [`SCALES`].
#[derive(Debug, Default)]
pub struct MovingResolution {
    step: usize,
    /// Times of frames at this step, s.
    times: Vec<f64>,
    /// Frames to skip.
    skipped: u32,
    /// Median time at the step before, s, if this one has fewer pixels.
    before: Option<f64>,
    /// Whether the step stays until something is at rest.
    is_held: bool,
}

impl MovingResolution {
    /// Pixels of the next picture over those at rest, on a side.
    pub fn scale(&self) -> f32 {
        SCALES[self.step]
    }

    /// Nothing moves any more. What moves next may take its time elsewhere.
    pub fn rest(&mut self) {
        self.is_held = false;
        self.go_to(self.step);
    }

    /// Adds the time in s of a picture that followed the last one at once, to show `rate` pictures a second.
    pub fn add(&mut self, time: f64, rate: f64) {
        if self.skipped > 0 {
            self.skipped -= 1;
            return;
        }
        self.times.push(time);
        if self.times.len() < FRAMES {
            return;
        }
        self.times.sort_by(f64::total_cmp);
        let median = self.times[FRAMES / 2];
        self.times.clear();
        let is_in_vain = self
            .before
            .take()
            .is_some_and(|before| median > WORTHWHILE * before);
        if is_in_vain && median * rate > 1.0 {
            self.go_to(self.step - 1);
            self.is_held = true;
        } else if self.is_held {
        } else if median * rate > 1.0 && self.step + 1 < SCALES.len() {
            self.go_to(self.step + 1);
            self.before = Some(median);
        } else if 2.0 * median * rate < 1.0 && self.step > 0 {
            // Twice the pixels take twice the time at most.
            self.go_to(self.step - 1);
        }
    }

    fn go_to(&mut self, step: usize) {
        self.step = step;
        self.times.clear();
        self.skipped = SKIPPED;
        self.before = None;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The scale after frames that take `fixed` and, in proportion to their pixels, `of_pixels`, s.
    fn after(moving: &mut MovingResolution, fixed: f64, of_pixels: f64, rate: f64) -> f32 {
        // Those in flight have the scale that was chosen two frames ago.
        let mut scales = [moving.scale(); SKIPPED as usize];
        for _ in 0..40 {
            let pixels = f64::from(scales[0] * scales[0]);
            scales = [scales[1], moving.scale()];
            moving.add(fixed + of_pixels * pixels, rate);
        }
        moving.scale()
    }

    #[test]
    fn slow_pictures_get_fewer_pixels_until_they_are_fast_enough() {
        let mut moving = MovingResolution::default();
        assert_eq!(after(&mut moving, 0.01, 0.04, 15.0), 1.0);
        assert_eq!(after(&mut moving, 0.01, 0.09, 15.0), SCALES[1]);
        assert_eq!(after(&mut moving, 0.02, 0.6, 15.0), SCALES[2]);
        assert_eq!(after(&mut moving, 0.001, 0.01, 15.0), 1.0);
    }

    #[test]
    fn pixels_stay_where_they_do_not_take_the_time() {
        let mut moving = MovingResolution::default();
        assert_eq!(after(&mut moving, 0.3, 0.02, 15.0), 1.0);
        // What moves next has a step again once the last motion has ended.
        moving.rest();
        assert_eq!(after(&mut moving, 0.01, 0.1, 15.0), SCALES[1]);
    }
}
