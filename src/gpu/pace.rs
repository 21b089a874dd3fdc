//! How much work one submission may hold on the device in use.
//!
//! A watchdog takes the device away from a program whose submission runs for seconds, and a program
//! that waits for one cannot be stopped. What a unit of work costs (a ray, a pair of patch and light, a point)
//! differs a thousandfold between devices and scenes, so it is measured: the first submission of a kind of work is
//! small, and each further one grows to what the earlier ones allow. Once all costs are known, a
//! frame that fits is one submission.

use std::time::Duration;

/// Target for the wall time of a submission: too short for a user who presses Ctrl-C to notice, and far below the
/// limit of any watchdog.
const TARGET: f64 = 0.06; // s
/// A submission has at most so many times the units of the largest one before: later units may cost more
/// than earlier ones.
const GROWTH: u64 = 8;
/// A cost changes by this factor at most from one submission to the next.
const MOST_CHANGE: f64 = 8.0;
/// Once learnt, a cost falls by this factor at most from one submission to the next, so that the expensive parts of a
/// picture determine how much a submission holds.
const MEMORY: f64 = 0.97;
/// Submissions after which a cost may count as learnt: the first ones include work that drivers defer, such as compiling
/// shaders.
const LEARNING: u32 = 4;
/// A cost is learnt when a later submission takes at least this share of the expected time. Until then it falls to this share at most
/// from one submission to the next: compiling in the first one can make a unit appear ten thousand times as expensive as it is.
const LEARNT: f64 = 0.5;

/// One kind of work.
#[derive(Debug)]
struct Work {
    name: &'static str,
    /// s a unit; `None` before the first submission that held any.
    cost: Option<f64>,
    /// Submissions that held any.
    count: u32,
    is_learnt: bool,
    /// Units of the largest one.
    largest: u64,
    /// Units in the open submission.
    open: u64,
}

/// Costs of all kinds of work that were seen.
#[derive(Debug, Default)]
pub struct Pace {
    works: Vec<Work>,
}

/// What [`Pace::allowance`] allows.
#[derive(Debug, PartialEq, Eq)]
pub enum Allowance {
    /// So many units may be added to the open submission, at least one.
    Units(u64),
    /// The open submission is full: submit it and ask again.
    Full,
}

impl Pace {
    fn work(&mut self, name: &'static str) -> &mut Work {
        let known = self.works.iter().position(|work| work.name == name);
        let index = known.unwrap_or_else(|| {
            self.works.push(Work {
                name,
                cost: None,
                count: 0,
                is_learnt: false,
                largest: 0,
                open: 0,
            });
            self.works.len() - 1
        });
        &mut self.works[index]
    }

    /// Allowance in the open submission for `wanted` units. `first` is for a kind of work that was never
    /// measured: units that are cheap enough on the slowest device.
    pub fn allowance(&mut self, name: &'static str, wanted: u64, first: u64) -> Allowance {
        let is_empty = self.works.iter().all(|work| work.open == 0);
        let spent: Option<f64> = (self.works.iter().filter(|work| work.open > 0))
            .map(|work| Some(work.cost? * work.open as f64))
            .sum();
        let work = self.work(name);
        let (Some(cost), Some(spent)) = (work.cost, spent) else {
            // What is measured first is measured alone.
            return match is_empty {
                true => Allowance::Units(wanted.min(first).max(1)),
                false => Allowance::Full,
            };
        };
        let most = work.largest.saturating_mul(GROWTH) - work.open;
        let fitting = (((TARGET - spent).max(0.0) / cost) as u64).min(most);
        if fitting < wanted && !is_empty {
            return Allowance::Full;
        }
        Allowance::Units(fitting.min(wanted).max(1))
    }

    /// Notes that the open submission holds these units.
    pub fn spend(&mut self, name: &'static str, units: u64) {
        self.work(name).open += units;
    }

    /// Learns from the wall time of the open submission, or with `None`, where it did not run or was split,
    /// forgets it.
    pub fn close(&mut self, wall: Option<Duration>) {
        let expected: f64 = (self.works.iter())
            .map(|work| work.cost.unwrap_or(0.0) * work.open as f64)
            .sum();
        for work in self.works.iter_mut().filter(|work| work.open > 0) {
            let units = std::mem::take(&mut work.open);
            let Some(wall) = wall else { continue };
            work.largest = work.largest.max(units);
            work.count += 1;
            work.cost = Some(match work.cost {
                // Alone in its submission.
                None => wall.as_secs_f64() / units as f64,
                Some(cost) => {
                    let change = wall.as_secs_f64() / expected;
                    work.is_learnt |= work.count >= LEARNING && change >= LEARNT;
                    let least = if work.is_learnt {
                        MEMORY
                    } else if work.count < LEARNING {
                        1.0 / MOST_CHANGE
                    } else {
                        LEARNT
                    };
                    cost * change.clamp(least, MOST_CHANGE)
                }
            });
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Runs `wanted` units of work on a device that takes `cost` s for one; the submissions' units.
    fn run(pace: &mut Pace, name: &'static str, wanted: u64, first: u64, cost: f64) -> Vec<u64> {
        run_on(pace, name, wanted, first, |units| cost * units as f64)
    }

    /// The same on a device that takes `time` s for a submission.
    fn run_on(
        pace: &mut Pace,
        name: &'static str,
        wanted: u64,
        first: u64,
        mut time: impl FnMut(u64) -> f64,
    ) -> Vec<u64> {
        let (mut left, mut open, mut submissions) = (wanted, 0, Vec::new());
        let mut submit = |pace: &mut Pace, open: &mut u64| {
            submissions.push(*open);
            pace.close(Some(Duration::from_secs_f64(time(*open))));
            *open = 0;
        };
        while left > 0 {
            match pace.allowance(name, left, first) {
                Allowance::Units(units) => {
                    pace.spend(name, units);
                    (open, left) = (open + units, left - units);
                }
                Allowance::Full => submit(pace, &mut open),
            }
        }
        submit(pace, &mut open);
        submissions
    }

    #[test]
    fn submissions_grow_to_the_target_and_stay_there() {
        let mut pace = Pace::default();
        let cost = 1e-6;
        let first = run(&mut pace, "project", 1_000_000, 64, cost);
        assert_eq!(first[..4], [64, 512, 4096, 32768]);
        assert!(
            first
                .iter()
                .all(|units| *units as f64 * cost <= 1.001 * TARGET)
        );
        assert_eq!(first.iter().sum::<u64>(), 1_000_000);
        // Known now.
        assert_eq!(run(&mut pace, "project", 50_000, 64, cost), [50_000]);
    }

    #[test]
    fn compiling_is_soon_forgotten() {
        let mut compiling = 0.8;
        let time = |units| std::mem::take(&mut compiling) + 0.002 + 3e-6 * units as f64;
        let submissions = run_on(&mut Pace::default(), "landings", 1_000_000, 64, time);
        assert!(submissions[1] <= 4, "{submissions:?}"); // Nothing else is known yet.
        let fewest = (1_000_000.0 * 3e-6 / TARGET) as usize;
        assert!(submissions.len() < 2 * fewest, "{submissions:?}");
    }

    #[test]
    fn what_gets_dearer_is_split_and_what_is_unknown_runs_alone() {
        let mut pace = Pace::default();
        run(&mut pace, "shade", 40_000, 40_000, 1e-6);
        assert_eq!(run(&mut pace, "shade", 40_000, 1, 1e-5), [40_000]);
        let split = run(&mut pace, "shade", 40_000, 1, 1e-5);
        assert!(split.iter().all(|units| *units <= 8_000), "{split:?}");

        pace.spend("shade", 1);
        assert_eq!(pace.allowance("direct", 10, 5), Allowance::Full);
        pace.close(None);
        assert_eq!(pace.allowance("direct", 10, 5), Allowance::Units(5));
        // Something has to be done even where one unit is too much.
        pace.spend("direct", 1);
        pace.close(Some(Duration::from_secs(2)));
        assert_eq!(pace.allowance("direct", 10, 5), Allowance::Units(1));
    }
}
