//! Medians and percentiles of times.

use serde::Serialize;

/// A frame that takes more than this multiple of the median was dropped.
const DROPPED: f64 = 2.0;

/// Times of frames, ms.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Times {
    pub median: f64,
    pub p95: f64,
    pub p99: f64,
    pub longest: f64,
    /// Number of frames that took more than twice the median.
    pub dropped: usize,
}

impl Times {
    /// `None` without times.
    pub fn of(mut values: Vec<f64>) -> Option<Self> {
        values.sort_by(f64::total_cmp);
        let longest = *values.last()?;
        let median = percentile(&values, 0.5);
        Some(Self {
            median,
            p95: percentile(&values, 0.95),
            p99: percentile(&values, 0.99),
            longest,
            dropped: values
                .iter()
                .filter(|value| **value > DROPPED * median)
                .count(),
        })
    }
}

/// The smallest of the sorted values that this share of them does not exceed.
fn percentile(sorted: &[f64], share: f64) -> f64 {
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted[rank.clamp(1, sorted.len()) - 1]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn percentiles_are_values_that_occurred() {
        let times = Times::of((1..=100).map(f64::from).collect()).unwrap();
        assert_eq!(
            [times.median, times.p95, times.p99, times.longest],
            [50.0, 95.0, 99.0, 100.0]
        );
        assert_eq!(Times::of(vec![1.0, 1.0, 5.0]).unwrap().dropped, 1);
        assert_eq!(Times::of(Vec::new()), None);
    }
}
