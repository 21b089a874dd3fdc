//! The stages of a method, bound to a scene.

use crate::error::{Error, Result};
use crate::gpu::{Context, Image};
use crate::render::caustic::Caustic;
use crate::render::chains::Chains;
use crate::render::device_scene::DeviceScene;
use crate::render::lights::Source;
use crate::render::methods::pinhole::Pinhole;
use crate::render::methods::points::Points;
use crate::render::patches::sample::Sample;
use crate::render::settings::{EXPECTED_ERROR, Method, Settings};
use crate::render::splat::kinds::{footprints, mesh_footprints, pinhole_images};
use crate::render::splat::resolve::{Levels, Resolve};
use crate::render::splat::triangles::Triangles;
use std::sync::Arc;

/// # Errors
/// [`Error::Usage`] where the method cannot light a receiver, [`Error::Device`] where the device fails.
pub fn caustic(
    context: &Arc<Context>,
    scene: &mut DeviceScene,
    light_map: &Image,
    settings: &Settings,
) -> Result<Caustic> {
    if settings.method == Method::Points {
        let points = Points::new(context, scene, settings.samples)?;
        return Ok(Caustic::Points(points));
    }
    match settings.method {
        Method::Footprint => by_footprints(context, scene, light_map, settings),
        Method::Beams => {
            if let Some(tile) = scene.receivers.mesh_tiles().first() {
                return Err(Error::Usage {
                    reason: format!(
                        "the method beams lights rects only, and object `{}` is a mesh with a light map",
                        scene.scene.objects[tile.object].name
                    ),
                    remedy: "choose another method, or remove the object's `lightmap`".into(),
                });
            }
            let levels = Levels::new(context, scene)?;
            let triangles = match scene.group(Source::Suns) {
                Some(_) => Some(Box::new(Triangles::new(
                    context, scene, &levels, None, settings,
                )?)),
                None => None,
            };
            Ok(Caustic::Splat {
                sample: None,
                triangles,
                chains: None,
                projectors: Vec::new(),
                resolve: Some(Resolve::new(context, scene, levels, light_map)?),
            })
        }
        _ => {
            let sample = Sample::new(context, scene)?;
            let pinhole = Pinhole::new(context, scene, &sample.patches, light_map, settings)?;
            Ok(Caustic::Gather { sample, pinhole })
        }
    }
}

/// On planar receivers, images of facets for suns and lamps; for an environment, pinhole images where patch clusters act as
/// pinholes, and footprints elsewhere. On mesh receivers, footprints.
fn by_footprints(
    context: &Arc<Context>,
    scene: &mut DeviceScene,
    light_map: &Image,
    settings: &Settings,
) -> Result<Caustic> {
    let has_suns = scene.group(Source::Suns).is_some();
    let (planar, meshes) = (scene.receivers.planar_count, scene.receivers.mesh_count());
    let sample = match meshes > 0 && has_suns {
        true => Some(Sample::new(context, scene)?),
        false => None,
    };
    let (mut triangles, mut chains, mut projectors, mut resolve) = (None, None, Vec::new(), None);
    let levels = Levels::new(context, scene)?;
    if scene.lattices.is_needed {
        chains = Some(Box::new(Chains::new(
            context,
            scene,
            &levels,
            settings.error,
            false,
        )?));
    }
    if planar > 0 {
        if has_suns {
            let errors = chains.as_ref().map(|chains| &chains.errors);
            triangles = Some(Box::new(Triangles::new(
                context, scene, &levels, errors, settings,
            )?));
        }
        if let Some(pairs) = &scene.environment.pairs {
            projectors.push(pinhole_images(context, scene, &pairs.patches, &levels)?);
            projectors.push(footprints(context, scene, &pairs.patches, &levels)?);
        }
        resolve = Some(Resolve::new(context, scene, levels, light_map)?);
    }
    if meshes > 0 {
        if let Some(sample) = &sample {
            projectors.push(mesh_footprints(
                context,
                scene,
                Source::Suns,
                &sample.patches,
            )?);
        }
        if let Some(pairs) = &scene.environment.pairs {
            projectors.push(mesh_footprints(
                context,
                scene,
                Source::Environment,
                &pairs.patches,
            )?);
        }
    }
    Ok(Caustic::Splat {
        sample,
        triangles,
        chains,
        projectors,
        resolve,
    })
}

/// What a frame with an error to aim for reached.
pub struct Reached {
    /// Cautious estimate of the relative L1 error of suns and lamps on the planar receiver where it is largest; `None` if they light
    /// none.
    pub error: Option<f32>,
    /// Whether more patches than the buffers have room for would lower it to what is aimed for.
    pub needs_patches: bool,
    /// How often the rays of chains would have to be doubled for that.
    pub lacking_halvings: u32,
}

impl Caustic {
    /// Whether patches are of even size, whatever their flux.
    pub fn has_even_patches(&self) -> bool {
        match self {
            Self::Splat { sample, .. } => sample.is_some(),
            Self::Gather { .. } => true,
            Self::Points(_) => false,
        }
    }

    /// Number of patches or points, including the environment's patch clusters. `is_recorded`: whether a frame has counted
    /// the patches that follow the flux.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn sample_count(&self, scene: &DeviceScene, is_recorded: bool) -> Result<u32> {
        let of_flux = match self {
            Self::Splat {
                triangles: Some(triangles),
                ..
            } if is_recorded => triangles.counts()?.patches,
            _ => 0,
        };
        Ok(of_flux + self.known_patches(scene))
    }

    /// The same without those that the device counts.
    pub fn known_patches(&self, scene: &DeviceScene) -> u32 {
        let casters = &scene.casters;
        match self {
            Self::Points(points) if casters.lit_count > 0 => points.count,
            Self::Points(_) => 0,
            Self::Gather { .. } => casters.patch_count,
            Self::Splat { sample, .. } => {
                let even = sample.as_ref().map_or(0, |_| casters.patch_count);
                let clusters = scene.environment.pairs.as_ref();
                even + clusters.map_or(0, |pairs| pairs.patch_count)
            }
        }
    }

    /// The largest expected relative L1 error of a receiver's light map in the last frame; `None` where splats of other kinds, whose error is not estimated, light receivers, too.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn estimated_error(&self) -> Result<Option<f32>> {
        match self {
            Self::Splat { projectors, .. } if projectors.is_empty() => {
                let cautious = self.reached()?.and_then(|reached| reached.error);
                Ok(cautious.map(|error| EXPECTED_ERROR * error))
            }
            _ => Ok(None),
        }
    }

    fn triangles(&self) -> Option<&Triangles> {
        match self {
            Self::Splat { triangles, .. } => triangles.as_deref(),
            _ => None,
        }
    }

    /// Flux onto each planar receiver by a single surface, W, in the last frame; `None` where facets do not carry it.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn receiver_fluxes(&self) -> Result<Option<Vec<f32>>> {
        self.triangles().map(Triangles::receiver_fluxes).transpose()
    }

    /// Number of pairs of facet and light that sent no light to a planar receiver in the last frame, and of all pairs; `None` where
    /// there are no facets.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn dark_facets(&self, scene: &DeviceScene) -> Result<Option<(usize, usize)>> {
        (self.triangles())
            .map(|triangles| triangles.dark_facets(scene))
            .transpose()
    }

    /// Whether it follows chains.
    pub fn has_chains(&self) -> bool {
        matches!(
            self,
            Self::Splat {
                chains: Some(_),
                ..
            }
        )
    }

    /// Whether some part of it aims for an error.
    pub fn has_error_target(&self) -> bool {
        (self.triangles()).is_some_and(Triangles::has_error_target)
    }

    /// What the last frame reached. `None` without an error to aim for.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn reached(&self) -> Result<Option<Reached>> {
        let Self::Splat {
            triangles, chains, ..
        } = self
        else {
            return Ok(None);
        };
        let (mut error, mut needs_patches, mut lacking_halvings) = (None, false, 0);
        if let Some(triangles) = triangles.as_deref().filter(|of| of.has_error_target()) {
            let reached = triangles.error()?;
            (error, needs_patches) = (Some(reached.0), reached.1);
        }
        if let Some(chains) = chains {
            lacking_halvings = chains.lacking_halvings()?;
        }
        Ok(
            (error.is_some() || lacking_halvings > 0).then_some(Reached {
                error,
                needs_patches,
                lacking_halvings,
            }),
        )
    }

    /// Whether the last blocking frame recorded all that was to be drawn.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn is_complete(&mut self) -> Result<bool> {
        match self {
            Self::Splat {
                triangles: Some(triangles),
                ..
            } => triangles.has_all_batches(),
            _ => Ok(true),
        }
    }

    /// Sets the error to aim for.
    pub fn set_error(&mut self, error: f32) {
        if let Self::Splat {
            triangles, chains, ..
        } = self
        {
            if let Some(triangles) = triangles {
                triangles.set_error(error);
            }
            if let Some(chains) = chains {
                chains.set_error(error);
            }
        }
    }

    /// Number of patches that lit a receiver in the last frame, counted once for each light; `None` where other splats are
    /// not of patches.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn lit_patches(&self) -> Result<Option<u32>> {
        let Self::Splat {
            triangles,
            projectors,
            ..
        } = self
        else {
            return Ok(None);
        };
        if !projectors.is_empty() {
            return Ok(None);
        }
        Ok(Some(match triangles {
            Some(triangles) => triangles.counts()?.lit_patches,
            None => 0,
        }))
    }
}
