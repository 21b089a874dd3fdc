//! The balance of the flux of chains, read from the sums that their passes count.

use crate::error::Result;
use crate::flux_balance::{CutOff, Flux, FluxBalance};
use crate::gpu::{Buffer, Context};
use crate::render::gpu_types::constants::*;
use std::sync::Arc;

/// Words of the sums: two for each channel of each entry.
const WORDS: usize = 6 * FLUX_ENTRIES as usize;
/// Units of the sums in a flux of 1: sums have room for 2^15 times as much, which weak lobes and bands of the spectrum need.
const UNITS: f64 = (1u64 << 48) as f64;
/// Range of fluxes, W, within which no factor between W and units overflows.
const FLUXES: [f64; 2] = [1e-20, 1e30];

/// Memory for the sums.
///
/// # Errors
/// [`crate::Error::Device`] if device memory is insufficient.
pub fn sums(context: &Arc<Context>) -> Result<Buffer> {
    Buffer::new(context, "sums of flux", 4 * WORDS as u64)
}

/// Units in 1 W where the rays of all lattices have at most this flux, W: a power of two.
pub fn scale(flux: f64) -> f32 {
    let power = flux.clamp(FLUXES[0], FLUXES[1]).log2().ceil();
    (UNITS * (-power).exp2()) as f32
}

/// Reads the balance, with light of up to `max_interfaces` mirrors and interfaces.
///
/// # Errors
/// [`crate::Error::Device`] where the device fails.
pub fn read(sums: &Buffer, scale: f32, max_interfaces: u32) -> Result<FluxBalance> {
    let words: Vec<u32> = sums.read(WORDS)?;
    let entry = |entry: u32| -> Flux {
        [0, 1, 2].map(|channel| {
            let at = 6 * entry as usize + 2 * channel;
            let units = u64::from(words[at + 1]) << 32 | u64::from(words[at]);
            units.cast_signed() as f64 / f64::from(scale)
        })
    };
    let landed = max_interfaces.min(LANDED_ENTRIES);
    Ok(FluxBalance {
        incoming: entry(FLUX_INCOMING),
        landed: (0..landed).map(|n| entry(FLUX_LANDED + n)).collect(),
        on_other_surfaces: entry(FLUX_ON_OTHER_SURFACES),
        absorbed_by_media: entry(FLUX_IN_MEDIA),
        absorbed_by_mirrors: entry(FLUX_IN_MIRRORS),
        left_scene: entry(FLUX_LEFT_SCENE),
        cut_off: CutOff {
            faint: entry(FLUX_CUT_FAINT),
            weak: entry(FLUX_CUT_WEAK),
            interfaces: entry(FLUX_CUT_INTERFACES),
            room: entry(FLUX_CUT_ROOM),
            normals: entry(FLUX_CUT_NORMALS),
        },
        sampling: entry(FLUX_SAMPLING),
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn entries_fill_the_sums() {
        assert_eq!(FLUX_ENTRIES, FLUX_LANDED + LANDED_ENTRIES);
    }

    #[test]
    fn scale_is_a_power_of_two_that_fits_every_flux() {
        for flux in [0.0, 1e-30, 0.7, 1.0, 3e5, 1e38] {
            let scale = f64::from(scale(flux));
            assert_eq!(scale.log2().fract(), 0.0);
            assert!(scale.is_finite() && scale > 0.0);
        }
        assert!(f64::from(scale(0.7)) * 0.7 <= UNITS);
    }
}
