//! How the media of a scene disperse light: a coordinate of wavelengths in which their indices of refraction are linear, and the
//! colours along it.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Staging};
use crate::render::gpu_types::constants::SPECTRAL_STEPS;
use crate::scene::{Dielectric, Dispersion, Scene};
use crate::spectrum::{MIDDLE, WAVELENGTHS, weight_below};
use glam::{DVec3, Vec4};
use std::sync::Arc;

/// The coordinate s is 0 at the longest wavelength and 1 at the shortest, in proportion to the index of refraction of the scene's
/// first medium that disperses light. Indices of other media are taken to be linear in it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Coordinate {
    curve: Dispersion,
}

impl Coordinate {
    /// `None` where nothing disperses light.
    pub fn of(scene: &Scene) -> Option<Self> {
        let curve = (scene.materials.iter()).find_map(|material| material.kind.dispersion())?;
        const STEPS: u32 = 100;
        let [shortest, longest] = WAVELENGTHS;
        let at = |i: u32| shortest + (longest - shortest) * f64::from(i) / f64::from(STEPS);
        let falls = (0..STEPS).all(|i| curve.index(at(i)) > curve.index(at(i + 1)));
        Some(match falls {
            true => Self { curve },
            // Anomalous: by Cauchy's first term.
            false => Self {
                curve: Dispersion::Cauchy([1.0, 1.0, 0.0]),
            },
        })
    }

    /// The coordinate of a wavelength in µm.
    fn at(self, wavelength: f64) -> f64 {
        let [shortest, longest] = WAVELENGTHS.map(|end| self.curve.index(end));
        (self.curve.index(wavelength) - longest) / (shortest - longest)
    }

    /// The coordinate of light before it is dispersed.
    pub fn middle(self) -> f64 {
        self.at(MIDDLE)
    }

    /// The wavelength at a coordinate, µm.
    fn wavelength(self, coordinate: f64) -> f64 {
        let [mut low, mut high] = WAVELENGTHS;
        for _ in 0..50 {
            let middle = 0.5 * (low + high);
            match self.at(middle) > coordinate {
                true => low = middle,
                false => high = middle,
            }
        }
        0.5 * (low + high)
    }

    /// The colour of the light from 0 to s = i/[`SPECTRAL_STEPS`], linear sRGB.
    fn colours_below(self) -> impl Iterator<Item = DVec3> {
        (0..=SPECTRAL_STEPS).map(move |i| {
            let coordinate = f64::from(i) / f64::from(SPECTRAL_STEPS);
            weight_below(WAVELENGTHS[1]) - weight_below(self.wavelength(coordinate))
        })
    }

    /// The mean of s of each colour channel, beyond [`Self::middle`].
    pub fn channels(self) -> DVec3 {
        let below: Vec<DVec3> = self.colours_below().collect();
        let steps = below.windows(2).zip(0..);
        let means: DVec3 = steps
            .map(|(pair, i)| {
                (pair[1] - pair[0]) * ((f64::from(i) + 0.5) / f64::from(SPECTRAL_STEPS))
            })
            .sum();
        means - self.middle()
    }

    /// [`Self::colours_below`]. The fourth element of the first three is that of [`Self::channels`].
    fn weights_below(self) -> Vec<Vec4> {
        let mut weights: Vec<Vec4> = (self.colours_below())
            .map(|colour| colour.as_vec3().extend(0.0))
            .collect();
        let channels = self.channels();
        for channel in 0..3 {
            weights[channel].w = channels[channel] as f32;
        }
        weights
    }
}

/// Index of refraction of undispersed light, and its change over the spectrum.
pub fn index_and_change(medium: &Dielectric) -> [f64; 2] {
    let [shortest, longest] = WAVELENGTHS.map(|end| medium.ior_at(end));
    [medium.ior_at(MIDDLE), shortest - longest]
}

/// The spectrum as the shaders read it.
pub struct DeviceSpectrum {
    /// [`SPECTRAL_STEPS`] + 1 colours.
    pub weights_below: Buffer,
    /// The coordinate for which `weights_below` holds.
    pub coordinate: Option<Coordinate>,
    /// [`Coordinate::channels`]; 0 where nothing disperses light.
    pub channels: DVec3,
    is_stale: bool,
}

impl DeviceSpectrum {
    /// # Errors
    /// [`crate::Error::Device`] if device memory is insufficient.
    pub fn new(context: &Arc<Context>, scene: &Scene) -> Result<Self> {
        let bytes = u64::from(SPECTRAL_STEPS + 1) * size_of::<Vec4>() as u64;
        Ok(Self {
            weights_below: Buffer::new(context, "colours of wavelengths", bytes)?,
            coordinate: Coordinate::of(scene),
            channels: DVec3::ZERO,
            is_stale: true,
        })
    }

    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn update(&mut self, staging: &mut Staging, scene: &Scene) -> Result<()> {
        let coordinate = Coordinate::of(scene);
        let changed = self.is_stale || coordinate != self.coordinate;
        if let Some(coordinate) = coordinate.filter(|_| changed) {
            self.channels = coordinate.channels();
            staging.write(&self.weights_below, 0, &coordinate.weights_below())?;
        }
        self.coordinate = coordinate;
        self.is_stale = false;
        Ok(())
    }

    /// The coordinate of light before it is dispersed.
    pub fn middle(&self) -> f32 {
        self.coordinate
            .map_or(0.0, |coordinate| coordinate.middle() as f32)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::GLASSES;
    use glam::Vec3;

    #[test]
    fn the_coordinate_runs_from_red_to_violet() {
        let curve = Dispersion::Sellmeier(GLASSES[1].1);
        let coordinate = Coordinate { curve };
        assert!((coordinate.wavelength(0.0) - 0.7).abs() < 1e-9);
        assert!((coordinate.wavelength(1.0) - 0.4).abs() < 1e-9);
        assert!((coordinate.at(coordinate.wavelength(0.3)) - 0.3).abs() < 1e-9);
        let weights = coordinate.weights_below();
        assert_eq!(weights[0].truncate(), Vec3::ZERO);
        // Red light is bent least.
        assert!(weights[0].w < weights[1].w && weights[1].w < weights[2].w);
        let all = weights[SPECTRAL_STEPS as usize];
        assert!((all.truncate() - 1.0).abs().max_element() < 1e-5);
    }
}
