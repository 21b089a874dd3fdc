//! What the maps of a sweep should be.

use super::scenes::{APERTURE, FOCAL_LENGTH, SCREEN};
use super::sweeps::{Sweep, Truth};
use crate::error::Result;
use crate::image_file::RgbImage;
use crate::reference::{Options, Reference, caustic};
use crate::scene::Scene;
use std::sync::atomic::AtomicBool;

/// Truth at one value: a map a frame, and the L1 error that they are expected to have.
pub struct True {
    pub maps: Vec<RgbImage>,
    pub error: f64,
}

/// Truths of one sweep. What does not depend on the value is made once.
#[derive(Default)]
pub struct TruthMaps(Option<(f64, True)>);

impl TruthMaps {
    pub fn at(&mut self, sweep: &Sweep, value: f64, cancel: &AtomicBool) -> Result<&True> {
        let wanted = match sweep.truth {
            Truth::At(fixed) => fixed,
            _ => value,
        };
        if self.0.as_ref().is_none_or(|(known, _)| *known != wanted) {
            self.0 = Some((wanted, make(sweep, wanted, cancel)?));
        }
        Ok(&self.0.as_ref().expect("made above").1)
    }
}

fn make(sweep: &Sweep, value: f64, cancel: &AtomicBool) -> Result<True> {
    let texels = sweep.truth_texels_at(value);
    if let Truth::Dish = sweep.truth
        && (value - FOCAL_LENGTH).abs() >= CLOSED_FORM * FOCAL_LENGTH
    {
        return Ok(True {
            maps: vec![dish(value, texels)],
            error: 0.0,
        });
    }
    let mut truth = True {
        maps: Vec::new(),
        error: 0.0,
    };
    for frame in 0..sweep.frames {
        let scene = match sweep.truth {
            Truth::Other(scene) => scene(value, frame),
            _ => (sweep.scene)(value, frame),
        };
        let reference = reference(&scene, sweep, texels, cancel)?;
        truth.error = reference.relative_error.max(truth.error);
        truth.maps.push(reference.image());
    }
    Ok(truth)
}

/// Rays after which a reference has to do.
const MOST_RAYS: u64 = 100_000_000;

/// The one place that asks for a reference.
fn reference(scene: &Scene, sweep: &Sweep, texels: u32, cancel: &AtomicBool) -> Result<Reference> {
    let options = Options {
        error: sweep.error,
        max_samples: MOST_RAYS,
        ..Options::default()
    };
    let receiver = sweep.receiver(scene);
    caustic(scene, receiver, [texels; 2], &options, &mut |_| {}, cancel)
}

/// The dish's closed form is taken where the screen is this far from the focus or further, in focal
/// lengths. Nearer, the lit disc is a few texels wide, and the mesh decides how the light is spread.
const CLOSED_FORM: f64 = 0.1;

/// Points a texel and side.
const FINE: u32 = 8;

/// Irradiance of the screen at `z` m, averaged over the texels: parallel light of 1 W/m² along the axis
/// of a paraboloid. A ray at radius r meets the screen at r |f − z|/(f − r²/4f), behind the focus as
/// before it, where E = (1−u)³/((1−z/f)²(1+u)), u = r²/4f².
fn dish(z: f64, texels: u32) -> RgbImage {
    let f = FOCAL_LENGTH;
    let gap = (f - z).abs();
    let edge = APERTURE * gap / (f - APERTURE * APERTURE / (4.0 * f));
    let irradiance = |on_screen: f64| {
        if on_screen > edge {
            return 0.0;
        }
        // r′ r²/4f + |f − z| r − r′ f = 0, in the form without cancellation.
        let r = 2.0 * f * on_screen / (gap + gap.hypot(on_screen));
        let u = r * r / (4.0 * f * f);
        (1.0 - u).powi(3) / ((1.0 - z / f).powi(2) * (1.0 + u))
    };
    let steps = texels * FINE;
    let place = |i: u32| SCREEN * (2.0 * (f64::from(i) + 0.5) / f64::from(steps) - 1.0);
    let mean = |column: u32, row: u32| {
        let sum: f64 = (0..FINE * FINE)
            .map(|i| {
                let (x, y) = (column * FINE + i % FINE, row * FINE + i / FINE);
                irradiance(place(x).hypot(place(y)))
            })
            .sum();
        (sum / f64::from(FINE * FINE)) as f32
    };
    RgbImage {
        width: texels,
        height: texels,
        pixels: (0..texels * texels)
            .map(|i| [mean(i % texels, i / texels); 3])
            .collect(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::PI;

    /// All light of the aperture arrives, π (D/2)² E₀, and the axis has E₀/(1−z/f)².
    #[test]
    fn the_dish_keeps_the_energy() {
        for z in [0.5, 0.9, 1.1, 1.5] {
            let map = dish(z, 256);
            let texel = (2.0 * SCREEN / 256.0).powi(2);
            let flux: f64 = map.pixels.iter().map(|rgb| texel * f64::from(rgb[0])).sum();
            let exact = PI * APERTURE * APERTURE;
            assert!((flux / exact - 1.0).abs() < 2e-3, "{z}: {flux}, {exact}");
            assert!((flux / (1.01 * exact) - 1.0).abs() > 2e-3);
            let middle = f64::from(map.pixels[128 * 256 + 128][0]);
            let exact = 1.0 / (1.0 - z).powi(2);
            assert!(
                (middle / exact - 1.0).abs() < 3e-3,
                "{z}: {middle}, {exact}"
            );
        }
    }
}
