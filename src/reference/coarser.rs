//! One fine solution serves coarser light maps, too: averages of texel averages are exact.

use super::estimate::MEAN_ABSOLUTE;
use super::{Map, Reference};

impl Reference {
    /// The mean of every `factor` × `factor` texels, with its standard error as if errors of
    /// different texels were independent. They are a little less than that, as a ray that meets
    /// one texel misses the others, so the standard error is on the safe side.
    ///
    /// # Panics
    /// If the factor does not divide width and height.
    pub fn coarser(&self, factor: u32) -> Self {
        let [width, height] = [self.width, self.height].map(|side| {
            assert_eq!(side % factor, 0, "whole texels");
            side / factor
        });
        let count = f64::from(factor * factor);
        let irradiance = self.sums(&self.irradiance, factor, |value| value / count);
        let squares: Map = (self.standard_error.iter())
            .map(|rgb| rgb.map(|sigma| sigma * sigma))
            .collect();
        let standard_error = self.sums(&squares, factor, |sum| sum.sqrt() / count);
        let sum = |map: &Map| map.as_flattened().iter().sum::<f64>();
        let total = sum(&irradiance);
        let relative_error = match total > 0.0 {
            true => MEAN_ABSOLUTE * sum(&standard_error) / total,
            false => 0.0,
        };
        Self {
            width,
            height,
            irradiance,
            standard_error,
            relative_error,
            ..*self
        }
    }

    /// `finish` of the sum of every `factor` × `factor` values.
    fn sums(&self, map: &Map, factor: u32, finish: impl Fn(f64) -> f64) -> Map {
        let (width, factor) = (self.width as usize, factor as usize);
        let mut sums = vec![[0.0; 3]; map.len() / (factor * factor)];
        for (index, rgb) in map.iter().enumerate() {
            let (column, row) = (index % width / factor, index / width / factor);
            let sum = &mut sums[row * (width / factor) + column];
            (0..3).for_each(|channel| sum[channel] += rgb[channel]);
        }
        sums.into_iter().map(|rgb| rgb.map(&finish)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_and_their_errors() {
        let fine = Reference {
            width: 4,
            height: 2,
            irradiance: (0..8).map(|i| [f64::from(i), 1.0, 0.0]).collect(),
            standard_error: vec![[2.0, 0.5, 0.0]; 8],
            relative_error: 1.0,
            samples: 7,
            received_flux: [3.0; 3],
            received_flux_error: [0.1; 3],
        };
        let coarse = fine.coarser(2);
        assert_eq!((coarse.width, coarse.height), (2, 1));
        assert_eq!(coarse.irradiance, [[2.5, 1.0, 0.0], [4.5, 1.0, 0.0]]);
        assert_eq!(coarse.standard_error, [[1.0, 0.25, 0.0]; 2]);
        let expected = MEAN_ABSOLUTE * 2.5 / 9.0;
        assert!((coarse.relative_error - expected).abs() < 1e-15);
        assert_eq!(coarse.received_flux, fine.received_flux);
        let same = fine.coarser(1);
        assert_eq!(same.irradiance, fine.irradiance);
        assert_eq!(same.standard_error, fine.standard_error);
    }
}
