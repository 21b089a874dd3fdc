//! The environment on the device: its image and, for footprints, its cells and patch clusters.

use crate::error::Result;
use crate::gpu::{Context, Image, Sampling, Staging};
use crate::render::environment::direct_cells::DirectCells;
use crate::render::environment::mips::mip_chain;
use crate::render::environment::pairs::CellPatchPairs;
use crate::render::geometry::device::DeviceGeometry;
use crate::render::gpu_types::Light;
use crate::render::lights::{EnvironmentLight, LightGroup};
use crate::render::settings::{Method, Settings};
use crate::scene::Scene;
use std::sync::Arc;

pub struct DeviceEnvironment {
    pub image: Image,
    pub is_present: bool,
    pub casts_caustics: bool,
    /// rad, 0 to 2π.
    pub rotation: f32,
    /// Pairs of cell and patch cluster, for footprints.
    pub pairs: Option<CellPatchPairs>,
    /// Cells for direct light.
    pub direct_cells: DirectCells,
}

/// The changes that other parts of the scene depend on.
pub struct Changed {
    /// Cells of the environment that are bright and small, and act as suns.
    pub suns: Vec<Light>,
    /// Whether the map was replaced.
    pub is_another: bool,
}

impl DeviceEnvironment {
    /// Allocates the image of the scene's environment, or an image of one texel where there is none.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if device memory is insufficient.
    pub fn new(context: &Arc<Context>, staging: &mut Staging, scene: &Scene) -> Result<Self> {
        let light = EnvironmentLight::of(scene)?;
        let size = light.map_or([1, 1], |light| [light.map.width, light.map.height]);
        let levels = size[0].max(size[1]).ilog2() + 1;
        let sampling = Sampling::Equirectangular;
        let image = Image::new(context, "environment", size, levels, sampling)?;
        staging.prepare(&image);
        if light.is_none() {
            staging.write_level(&image, 0, &[[0.0; 3]])?;
        }
        Ok(Self {
            image,
            is_present: light.is_some(),
            casts_caustics: light.is_some_and(|light| light.casts_caustics),
            rotation: 0.0,
            pairs: None,
            direct_cells: DirectCells::new(context)?,
        })
    }

    /// Writes the differences from the environment `before`, if the device has one. `lights` are the suns and lamps of
    /// the scene.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] if host memory is insufficient for its pairs, [`crate::Error::Device`] where the device fails.
    #[allow(clippy::too_many_arguments)] // one call
    pub fn update(
        &mut self,
        context: &Arc<Context>,
        staging: &mut Staging,
        scene: &Scene,
        geometry: &DeviceGeometry,
        [before, now]: [Option<EnvironmentLight>; 2],
        lights: &[Light],
        has_moved: bool,
        settings: &Settings,
    ) -> Result<Changed> {
        let mut changed = Changed {
            suns: Vec::new(),
            is_another: false,
        };
        let Some(light) = now else {
            return Ok(changed);
        };
        self.rotation = light.rotation;
        changed.is_another = before.is_none_or(|before| !Arc::ptr_eq(before.map, light.map));
        if changed.is_another || before.is_some_and(|before| before.scale != light.scale) {
            for (level, (_, _, rgb)) in mip_chain(light.map, light.scale).iter().enumerate() {
                staging.write_level(&self.image, level as u32, rgb)?;
            }
        }
        let has_changed = before
            .is_none_or(|before| before.scale != light.scale || before.rotation != light.rotation);
        if changed.is_another || has_changed {
            self.direct_cells
                .update(staging, &light, changed.is_another)?;
        }
        let lights_by_clusters = light.casts_caustics
            && settings.method == Method::Footprint
            && scene
                .objects
                .iter()
                .any(|object| object.light_map.is_some())
            && scene.specular_objects().next().is_some();
        if changed.is_another && lights_by_clusters {
            self.pairs = Some(CellPatchPairs::new(
                context, staging, scene, geometry, &light, lights, settings,
            )?);
        } else if let Some(pairs) = &self.pairs {
            pairs.update(staging, &geometry.store, &light, has_moved)?;
        }
        changed.suns = (self.pairs.iter().flat_map(|pairs| pairs.suns_of(&light))).collect();
        Ok(changed)
    }

    /// The pairs of cell and patch cluster, presented as one light with that many patches.
    pub fn group(&self) -> Option<LightGroup> {
        self.pairs.as_ref().map(|pairs| LightGroup {
            light_count: 1,
            patch_count: pairs.pair_count,
        })
    }
}
