//! Frame times, pass by pass.

use crate::gpu::PassTime;
use serde::{Deserialize, Serialize};

/// What one pass costs, over many frames.
#[derive(Debug, Clone, Serialize)]
pub struct PassProfile {
    pub name: &'static str,
    /// Wall time from the start of recording to the end of waiting, s.
    pub wall: Spread,
    /// Between the device's timestamps, s; `None` where the device has none. Software devices
    /// under-report it.
    pub gpu: Option<Spread>,
    /// Of the sum of all passes' median wall times.
    pub share: f64,
}

/// Median, 5th and 95th percentile of repeated measurements.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Spread {
    pub median: f64,
    pub p05: f64,
    pub p95: f64,
}

impl Spread {
    /// Of at least one sample.
    ///
    /// # Panics
    /// Without samples.
    pub fn of(samples: &[f64]) -> Self {
        let mut sorted = samples.to_vec();
        sorted.sort_by(f64::total_cmp);
        Self {
            median: quantile(&sorted, 0.5),
            p05: quantile(&sorted, 0.05),
            p95: quantile(&sorted, 0.95),
        }
    }
}

/// The sample of nearest rank, `q` from 0 to 1; `sorted` rises and is not empty.
fn quantile(sorted: &[f64], q: f64) -> f64 {
    sorted[(q * (sorted.len() - 1) as f64).round() as usize]
}

/// Summarises frames of the same passes. Passes of one name within a frame, as batches are, count
/// together.
pub fn profile(frames: &[Vec<PassTime>]) -> Vec<PassProfile> {
    let mut names: Vec<&'static str> = Vec::new();
    for pass in frames.iter().flatten() {
        if !names.contains(&pass.name) {
            names.push(pass.name);
        }
    }
    let sums = |name: &str, time: fn(&PassTime) -> Option<f64>| -> Option<Vec<f64>> {
        frames
            .iter()
            .map(|frame| {
                frame
                    .iter()
                    .filter(|pass| pass.name == name)
                    .map(time)
                    .sum::<Option<f64>>()
            })
            .collect()
    };
    let mut rows: Vec<_> = names
        .into_iter()
        .filter_map(|name| {
            let wall = Spread::of(&sums(name, |pass| pass.wall)?);
            let gpu = sums(name, |pass| pass.gpu).map(|times| Spread::of(&times));
            Some(PassProfile {
                name,
                wall,
                gpu,
                share: 0.0,
            })
        })
        .collect();
    let total: f64 = rows.iter().map(|row| row.wall.median).sum();
    for row in &mut rows {
        row.share = row.wall.median / total;
    }
    rows
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn batches_count_together() {
        let pass = |name, wall| PassTime {
            name,
            gpu: None,
            wall: Some(wall),
        };
        let frame = |splat| {
            vec![
                pass("project", 1.0),
                pass("splat", splat),
                pass("splat", 1.0),
            ]
        };
        let rows = profile(&[frame(1.0), frame(2.0), frame(9.0)]);
        assert_eq!(rows.len(), 2);
        let wall = rows[1].wall;
        assert_eq!((wall.p05, wall.median, wall.p95), (2.0, 3.0, 10.0));
        assert_eq!(rows[0].share, 0.25);
        assert!(rows[0].gpu.is_none());
    }

    #[test]
    fn percentiles() {
        let samples: Vec<f64> = (0..=100).rev().map(f64::from).collect();
        let spread = Spread::of(&samples);
        assert_eq!((spread.p05, spread.median, spread.p95), (5.0, 50.0, 95.0));
    }
}
