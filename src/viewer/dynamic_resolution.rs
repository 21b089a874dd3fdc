//! Dynamic resolution: while something moves, the resolution of pictures follows the time that frames take.

use super::stats::Times;
use std::f32::consts::FRAC_1_SQRT_2;

/// Scales of the width and the height: half as many pixels from step to step.
const SCALES: [f32; 3] = [1.0, FRAC_1_SQRT_2, 0.5];
/// Frames whose median decides.
const FRAMES: usize = 3;
/// Frames after a change that still show the time of the step before: those in flight.
const SKIPPED: u32 = 2;
/// Time at a step, over that at the step before, above which fewer pixels do not pay: something else takes the time.
const WORTHWHILE: f64 = 0.85;

/// How often the sides of the maps of direct light are halved in pictures of this scale: once more at each step. Where lights or
/// objects move, these maps take more time than the pixels.
pub fn halvings(scale: f32) -> u32 {
    (scale.log2() / FRAC_1_SQRT_2.log2()).round() as u32
}

/// Chooses among [`SCALES`].
#[derive(Debug, Default)]
pub struct DynamicResolution {
    step: usize,
    /// Times of frames at this step, ms.
    times: Vec<f64>,
    /// Frames to skip.
    skipped: u32,
    /// Median times at the steps that this one is to be compared with, ms.
    medians: [Option<f64>; SCALES.len()],
    /// Whether the step stays until something is at rest.
    is_held: bool,
}

impl DynamicResolution {
    /// On a CPU, the first pictures of a motion have fewer pixels, too: they would take long.
    pub fn new(is_cpu: bool) -> Self {
        Self {
            step: usize::from(is_cpu),
            ..Self::default()
        }
    }

    /// Scale of the width and the height of the next picture.
    pub fn scale(&self) -> f32 {
        SCALES[self.step]
    }

    /// Nothing moves any more. What moves next may take its time elsewhere.
    pub fn rest(&mut self) {
        self.is_held = false;
        self.go_to(self.step);
    }

    /// Adds the time in ms of a picture that followed the last one at once, to show `rate` pictures a second.
    pub fn add(&mut self, time: f64, rate: f64) {
        if self.is_held {
            return;
        }
        if self.skipped > 0 {
            self.skipped -= 1;
            return;
        }
        self.times.push(time);
        if self.times.len() < FRAMES {
            return;
        }
        let Some(Times { median, .. }) = Times::of(std::mem::take(&mut self.times)) else {
            return;
        };
        let share = 1e-3 * median * rate; // of the time that there is
        if share > 1.0 {
            self.slow(median);
            return;
        }
        // If frames become slow now, the scene has changed: times of before say nothing.
        self.medians = Default::default();
        if 4.0 * share < 1.0 && self.step > 0 {
            // Twice the pixels take twice the time, and maps of direct light with twice as many texels along a side four times.
            self.go_to(self.step - 1);
        }
    }

    /// Frames at this step take too long, `median` ms.
    fn slow(&mut self, median: f64) {
        let step = self.step;
        let with_more = step.checked_sub(1).and_then(|more| self.medians[more]);
        let with_fewer = self.medians.get(step + 1).copied().flatten();
        let medians = std::mem::take(&mut self.medians);
        let next = match (with_more, with_fewer) {
            // Fewer pixels were in vain.
            (Some(with_more), None) if median > WORTHWHILE * with_more => step - 1,
            (_, None) => (step + 1).min(SCALES.len() - 1),
            // Back from there. Perhaps even more pixels cost nothing, either.
            (_, Some(with_fewer)) => {
                let is_in_vain = with_fewer > WORTHWHILE * median;
                // Twice as many pixels take at least twice the difference more.
                let expected = median + 2.0 * (median - with_fewer);
                let is_last = step == 0 || with_more.is_some() || median <= WORTHWHILE * expected;
                self.is_held = is_last || !is_in_vain;
                match (is_in_vain, is_last) {
                    (true, true) => step,
                    (true, false) => step - 1,
                    (false, _) => step + 1,
                }
            }
        };
        if next != step {
            self.go_to(next);
            self.medians = medians;
            self.medians[step] = Some(median);
        }
    }

    fn go_to(&mut self, step: usize) {
        self.step = step;
        self.times.clear();
        self.skipped = SKIPPED;
        self.medians = Default::default();
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The scale after frames that take `fixed` and, in proportion to their pixels, `of_pixels`, s.
    fn after(resolution: &mut DynamicResolution, fixed: f64, of_pixels: f64, rate: f64) -> f32 {
        // Those in flight have the scale that was chosen two frames ago.
        let mut scales = [resolution.scale(); SKIPPED as usize];
        for _ in 0..40 {
            let pixels = f64::from(scales[0] * scales[0]);
            scales = [scales[1], resolution.scale()];
            resolution.add(1e3 * (fixed + of_pixels * pixels), rate);
        }
        resolution.scale()
    }

    #[test]
    fn slow_pictures_get_fewer_pixels_until_they_are_fast_enough() {
        let mut resolution = DynamicResolution::default();
        assert_eq!(after(&mut resolution, 0.01, 0.04, 15.0), 1.0);
        assert_eq!(after(&mut resolution, 0.01, 0.09, 15.0), SCALES[1]);
        assert_eq!(after(&mut resolution, 0.02, 0.6, 15.0), SCALES[2]);
        assert_eq!(after(&mut resolution, 0.001, 0.01, 15.0), 1.0);
    }

    /// Maps of direct light have half as many texels along a side at each step.
    #[test]
    fn maps_that_take_four_times_as_long_at_the_next_step_do_not_make_it_flip() {
        let mut resolution = DynamicResolution::default();
        let scales: Vec<f32> = (0..60)
            .map(|_| {
                let scale = resolution.scale();
                resolution.add(2.0 + 120.0 * f64::from(scale).powi(4), 15.0);
                scale
            })
            .collect();
        assert!(scales[30..].iter().all(|scale| *scale == SCALES[1]));
    }

    #[test]
    fn slow_pictures_on_a_cpu_begin_with_fewer_pixels_and_stay_there_where_that_helps() {
        let mut resolution = DynamicResolution::new(true);
        assert_eq!(after(&mut resolution, 0.02, 0.6, 15.0), SCALES[2]);
        let mut resolution = DynamicResolution::new(true);
        assert_eq!(after(&mut resolution, 0.0, 0.1, 15.0), SCALES[1]);
        let mut resolution = DynamicResolution::new(true);
        assert_eq!(after(&mut resolution, 0.001, 0.01, 15.0), 1.0);
        // The first step costs nothing, the second one does.
        let mut resolution = DynamicResolution::new(true);
        let scales: Vec<f32> = (0..40)
            .map(|_| {
                let scale = resolution.scale();
                resolution.add(if scale == 1.0 { 200.0 } else { 100.0 }, 15.0);
                scale
            })
            .collect();
        assert!(scales[30..].iter().all(|scale| *scale == SCALES[1]));
    }

    /// Half of the pixels of the first step would save 11 %, and all pixels take 1.45 times as long.
    #[test]
    fn all_pixels_are_not_tried_where_they_would_take_much_longer() {
        let mut resolution = DynamicResolution::new(true);
        for _ in 0..60 {
            let scale = resolution.scale();
            assert!(scale < 1.0);
            resolution.add(170.0 + 120.0 * f64::from(scale.powi(4)), 15.0);
        }
        assert_eq!(resolution.scale(), SCALES[1]);
    }

    #[test]
    fn pixels_stay_where_they_do_not_take_the_time() {
        let mut resolution = DynamicResolution::default();
        assert_eq!(after(&mut resolution, 0.3, 0.02, 15.0), 1.0);
        // A CPU begins with fewer.
        let mut on_cpu = DynamicResolution::new(true);
        assert_eq!(on_cpu.scale(), SCALES[1]);
        assert_eq!(after(&mut on_cpu, 0.3, 0.02, 15.0), 1.0);
        // What moves next has a step again once the last motion has ended.
        resolution.rest();
        assert_eq!(after(&mut resolution, 0.01, 0.1, 15.0), SCALES[1]);
    }
}
