//! The time of the scene: play, pause, step, scrub and loop.

/// Length of a step, s.
pub const STEP: f64 = 1.0 / 24.0;
/// Longest time that a frame advances, s: after a pause of the program the scene does not jump.
const MAX_ADVANCE: f64 = 0.25;
/// Length of the time line of a scene whose waves travel without an end, s.
const ENDLESS: f64 = 10.0;

/// The time that is shown.
#[derive(Debug, Clone)]
pub struct Playback {
    /// s
    pub time: f64,
    pub plays: bool,
    pub loops: bool,
    /// Length of the time line, s; 0 for a scene that stands still.
    pub length: f64,
    /// Whether the scene changes after `length`.
    is_endless: bool,
}

impl Playback {
    /// Playback of an animation that ends at `end`; `None` if it does not end.
    pub fn new(end: Option<f64>) -> Self {
        Self {
            time: 0.0,
            plays: false,
            loops: true,
            length: end.unwrap_or(ENDLESS),
            is_endless: end.is_none(),
        }
    }

    /// Whether there is anything to play.
    pub fn moves(&self) -> bool {
        self.length > 0.0
    }

    /// Goes on by the seconds that have passed.
    pub fn advance(&mut self, seconds: f64) {
        if !self.plays || !self.moves() {
            return;
        }
        self.time += seconds.clamp(0.0, MAX_ADVANCE);
        if self.time > self.length {
            match (self.loops, self.is_endless) {
                (true, _) => self.time %= self.length,
                (false, true) => self.length = self.time,
                (false, false) => {
                    self.time = self.length;
                    self.plays = false;
                }
            }
        }
    }

    /// Goes a number of steps forward or back, and stops there.
    pub fn step(&mut self, steps: f64) {
        self.plays = false;
        self.time = (self.time + steps * STEP).clamp(0.0, self.length);
    }

    /// Plays from the start where the end is reached.
    pub fn toggle(&mut self) {
        self.plays = !self.plays && self.moves();
        if self.plays && !self.loops && self.time >= self.length && !self.is_endless {
            self.time = 0.0;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn time_ends_or_starts_again() {
        let mut playback = Playback::new(Some(1.0));
        playback.toggle();
        for _ in 0..5 {
            playback.advance(0.22);
        }
        assert!((playback.time - 0.1).abs() < 1e-12 && playback.plays);
        playback.loops = false;
        for _ in 0..9 {
            playback.advance(0.22);
        }
        assert_eq!((playback.time, playback.plays), (1.0, false));
        playback.toggle();
        assert_eq!(playback.time, 0.0);
        playback.advance(100.0);
        assert_eq!(playback.time, 0.25);
    }

    #[test]
    fn a_still_scene_does_not_play() {
        let mut playback = Playback::new(Some(0.0));
        playback.toggle();
        assert!(!playback.plays);
    }

    #[test]
    fn waves_go_on() {
        let mut playback = Playback::new(None);
        playback.loops = false;
        playback.time = playback.length;
        playback.toggle();
        playback.advance(0.2);
        assert!(playback.time > 10.0 && playback.plays);
    }
}
