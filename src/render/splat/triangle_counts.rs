//! What a frame of triangles made, as the host reads it.

use crate::error::Result;
use crate::gpu::Buffer;
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::constants::{ARGUMENT_WORDS, SECOND_UNITS_WORD, UNITS_WORD};
use crate::render::gpu_types::{FacetPatches, ReceiverShare};
use crate::render::lights::Source;
use crate::render::splat::triangles::Triangles;

/// What a frame made.
pub struct Counts {
    pub patches: u32,
    /// Patches that lit a receiver, counted once for each light.
    pub lit_patches: u32,
}

impl Triangles {
    /// Number of batches that the numbered triangles fill, at least 1.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn batches_in_use(&self) -> Result<u32> {
        let splats = units(&self.splat_totals)?[0];
        Ok(splats.div_ceil(self.batch).clamp(1, self.batches))
    }

    /// Whether the last blocking frame recorded all batches that are in use. The next one records one less where these were too many.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn has_all_batches(&mut self) -> Result<bool> {
        if self.batches == 1 {
            return Ok(true);
        }
        let used = self.batches_in_use()?;
        let recorded = self.expected_batches.unwrap_or(used);
        self.expected_batches = Some(used.max(recorded - u32::from(used + 1 < recorded)));
        Ok(used <= recorded)
    }

    /// The largest cautious estimate of the relative L1 error of a planar receiver in the last frame, with that of chains, and whether more
    /// patches than `patch_budget` would lower it to what is aimed for.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn error(&self) -> Result<(f32, bool)> {
        let shares = self.receiver_shares()?;
        let error = shares.iter().map(|share| share.error).fold(0.0, f32::max);
        Ok((error, shares.iter().any(|share| share.is_limited != 0)))
    }

    /// Numbers of the last frame.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn counts(&self) -> Result<Counts> {
        let [patches, _] = units(&self.patch_totals)?;
        let [_, lit_patches] = units(&self.splat_totals)?;
        Ok(Counts {
            patches,
            lit_patches,
        })
    }

    /// Flux of the facets onto each planar receiver in the last frame, as far as their corners are lit, W.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn receiver_fluxes(&self) -> Result<Vec<f32>> {
        let shares = self.receiver_shares()?;
        Ok(shares.iter().map(|share| share.flux).collect())
    }

    fn receiver_shares(&self) -> Result<Vec<ReceiverShare>> {
        let count = self.shares.bytes() as usize / size_of::<ReceiverShare>();
        self.shares.read(count)
    }

    /// Number of pairs of facet and light that sent no light to a planar receiver in the last frame, and of all pairs.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn dark_facets(&self, scene: &DeviceScene) -> Result<(usize, usize)> {
        let lights = (scene.group(Source::Suns)).map_or(0, |group| group.light_count);
        let [_, facet_count] = scene.facets.facets();
        let pairs = (facet_count * lights) as usize;
        let patches = self.facet_patches.read::<FacetPatches>(pairs)?;
        let dark = patches.iter().filter(|of| of.targets == 0).count();
        Ok((dark, pairs))
    }
}

/// The totals of both sums, of those that scan.comp wrote.
fn units(totals: &Buffer) -> Result<[u32; 2]> {
    let words = totals.read::<u32>(ARGUMENT_WORDS as usize)?;
    Ok([UNITS_WORD, SECOND_UNITS_WORD].map(|word| words[word as usize]))
}
