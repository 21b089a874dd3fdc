//! The scene on the device, in parts that own their resources.
//!
//! `new` allocates and then updates, so that one code path writes the scene for the first frame and for all others.
//! Objects are compared one by one, meshes by their address first, so that static objects cost one comparison. The
//! subdivision of the casters is fixed by the first update; every update finds the triangles that face a light.

use crate::error::Result;
use crate::gpu::{BoundPipeline, Buffer, Constants, Context, Resource, Shader, Staging, Topology};
use crate::render::bodies::Bodies;
use crate::render::chains::lattice::DeviceLattices;
use crate::render::environment::device::DeviceEnvironment;
use crate::render::geometry::device::DeviceGeometry;
use crate::render::gpu_types::constants::{
    DISPERSING, ID_AREA_BY_PRODUCT, ID_BEAMS, ID_DISPERSES, ID_HAS_ATLAS, ID_HAS_ENVIRONMENT,
    ID_HAS_LAMPS, ID_HAS_MERGED, ID_HAS_POINTS, ID_HAS_TEXTURES, ID_ONLY_MIRRORS, SOLID,
};
use crate::render::gpu_types::{Object as DeviceObject, Profile};
use crate::render::lights::{DeviceLights, EnvironmentLight, LightGroup, Source, pack};
use crate::render::materials::objects;
use crate::render::patches::casters::DeviceCasters;
use crate::render::patches::facets::{DeviceFacets, FIRST_BUDGET, least_pieces};
use crate::render::receivers::light_maps::DeviceReceivers;
use crate::render::receivers::mesh::atlases;
use crate::render::receivers::surfaces::DeviceSurfaces;
use crate::render::scene_changes::{
    check_same_structure, is_same, keeps_environment, same_geometry,
};
use crate::render::settings::{Area, Method, Settings};
use crate::render::spectrum::DeviceSpectrum;
use crate::render::splat::kernel_profiles::profiles;
use crate::render::textures::DeviceTextures;
use crate::scene::{LightKind, Scene};
use std::sync::Arc;

/// What an update changed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Change {
    Nothing,
    /// The content of buffers.
    Content,
    /// The stages must be bound again, since there are more patches than their capacity, or a new environment.
    Stages,
}

pub struct DeviceScene {
    pub geometry: DeviceGeometry,
    pub lights: DeviceLights,
    pub environment: DeviceEnvironment,
    pub receivers: DeviceReceivers,
    pub surfaces: DeviceSurfaces,
    pub casters: DeviceCasters,
    pub facets: DeviceFacets,
    pub lattices: DeviceLattices,
    pub bodies: Bodies,
    pub textures: DeviceTextures,
    pub spectrum: DeviceSpectrum,
    pub staging: Staging,
    /// Patches beyond one for each pair of facet and light that buffers hold, for an error to aim for.
    pub patch_budget: u32,
    /// The scene that the device has.
    pub scene: Scene,
    objects: Buffer,
    profiles: Buffer,
    settings: Settings,
    /// Lattices that the stages are still bound to, while others have taken their place.
    pub replaced: Option<DeviceLattices>,
    /// Whether the device lacks parts of `scene`: before the first update, and after an update that failed.
    pub is_stale: bool,
}

impl DeviceScene {
    /// Allocates the resources of `scene` and stages its contents.
    ///
    /// # Errors
    /// [`Error::Usage`] where there is nothing to light, the light maps do not fit, or there is no memory for an
    /// environment's images; [`Error::Device`] if device memory is insufficient.
    pub fn new(context: &Arc<Context>, scene: &Scene, settings: &Settings) -> Result<Self> {
        let mut staging = Staging::new(context, settings.frames_in_flight);
        let atlases = atlases(scene)?;
        let least_pieces = least_pieces(settings);
        let frames = settings.frames_in_flight;
        let geometry = DeviceGeometry::new(context, scene, &atlases, least_pieces, frames)?;
        let receivers = DeviceReceivers::new(context, scene, atlases)?;
        let surfaces = DeviceSurfaces::new(context, scene, &receivers, &geometry.store)?;
        let environment = DeviceEnvironment::new(context, &mut staging, scene)?;
        let all_lit = environment.casts_caustics && settings.method == Method::Pinhole;
        let casters = DeviceCasters::new(context, scene, &geometry.store, all_lit)?;
        let facets = DeviceFacets::new(context, &mut staging, scene, &geometry, settings)?;
        let lights = DeviceLights::new(context, scene)?;
        let lattices = DeviceLattices::new(context, scene, &lights.rings, settings)?;
        let textures = DeviceTextures::new(context, &mut staging, scene)?;
        let profile_table = profiles();
        let profiles = Buffer::new(context, "profiles", size_of_val(profile_table) as u64)?;
        staging.write::<Profile>(&profiles, 0, profile_table)?;
        let object_bytes = scene.objects.len() * size_of::<DeviceObject>();
        let mut device = Self {
            lights,
            bodies: Bodies::new(scene),
            lattices,
            objects: Buffer::new(context, "objects", object_bytes as u64)?,
            geometry,
            environment,
            receivers,
            surfaces,
            casters,
            facets,
            textures,
            spectrum: DeviceSpectrum::new(context, scene)?,
            staging,
            patch_budget: FIRST_BUDGET,
            scene: scene.clone(),
            profiles,
            settings: settings.clone(),
            replaced: None,
            is_stale: true,
        };
        device.update(context, scene)?;
        device.replaced = None; // there are no stages yet
        Ok(device)
    }

    /// Stages the differences between `scene` and the last scene: positions, sizes, directions and colours may differ,
    /// the structure may not.
    ///
    /// # Errors
    /// As [`crate::render::Renderer::update`].
    pub fn update(&mut self, context: &Arc<Context>, scene: &Scene) -> Result<Change> {
        check_same_structure(&self.scene, scene)?;
        let is_costly = self.geometry.hierarchy.is_costly();
        if !self.is_stale && !is_costly && is_same(&self.scene, scene) {
            return Ok(Change::Nothing);
        }
        self.lattices.check(scene)?;
        let is_stale = std::mem::replace(&mut self.is_stale, true);
        let staging = &mut self.staging;
        staging.begin();
        let moved: Vec<usize> = (0..scene.objects.len())
            .filter(|&i| is_stale || !same_geometry(&self.scene.objects[i], &scene.objects[i]))
            .collect();
        let written = self.geometry.prepare(context, staging, scene, &moved)?;
        let is_rebuilt = self.geometry.update(staging, scene, &moved, &written)?;
        if is_rebuilt {
            self.facets.renumber(staging, scene, &self.geometry)?;
        }
        self.facets.choose(&self.geometry, self.settings.error);
        let store = &self.geometry.store;
        let meshes = self.receivers.mesh_tiles();
        let meshes_moved = is_rebuilt || meshes.iter().any(|tile| moved.contains(&tile.object));
        self.receivers.update(staging, scene, store, meshes_moved)?;
        let receivers = &self.receivers;
        (self.surfaces).update(
            staging,
            scene,
            receivers,
            store,
            &moved,
            is_stale || is_rebuilt,
        )?;
        self.bodies.update(scene, &moved, &written);
        self.spectrum.update(staging, scene)?;
        let (bodies, lattices) = (&self.bodies, &self.lattices);
        let objects = objects(
            scene,
            |object| receivers.of_object(object),
            |object| match bodies.is_solid(scene, object) {
                true => SOLID,
                false if lattices.disperses_at(scene, object) => DISPERSING,
                false => 0,
            },
            self.spectrum.channels,
        );
        if is_stale || is_rebuilt {
            self.textures.update(staging, scene, store)?;
        }
        staging.write(&self.objects, 0, &objects)?;

        let mut lights = pack(scene, store.origin);
        let images = u64::from(self.facets.most()[0]) * u64::from(receivers.planar_count);
        let rings = (self.lights).divided(scene, store, &lights, images, &self.settings);
        let is_divided_anew = rings != self.lights.rings;
        if is_divided_anew {
            let lattices = DeviceLattices::new(context, scene, &rings, &self.settings)?;
            (self.replaced).get_or_insert(std::mem::replace(&mut self.lattices, lattices));
            self.lights.rings = rings;
        }
        let before = EnvironmentLight::of(&self.scene)?.filter(|_| !is_stale);
        let changed = self.environment.update(
            context,
            staging,
            scene,
            &self.geometry,
            [before, EnvironmentLight::of(scene)?],
            &lights,
            !moved.is_empty() || is_rebuilt,
            &self.settings,
        )?;
        (self.lattices).update(
            staging,
            scene,
            store,
            bodies,
            &lights,
            &self.lights.rings,
            changed.is_another || is_divided_anew,
            &self.settings,
        )?;
        lights.extend(changed.suns);
        self.lights.update(staging, &lights)?;
        let samples = self.settings.samples;
        // On planar receivers, facets take the place of even patches.
        let has_even_patches =
            self.settings.method != Method::Footprint || self.receivers.mesh_count() > 0;
        let outgrown = has_even_patches
            && (self.casters).update(context, staging, scene, store, &lights, samples)?;
        self.scene = scene.clone();
        self.is_stale = false;
        match outgrown
            || self.replaced.is_some()
            || changed.is_another && self.environment.pairs.is_some()
        {
            true => Ok(Change::Stages),
            false => Ok(Change::Content),
        }
    }

    /// The host does not submit the last frame: the next one copies and places what it did.
    pub fn forget_last(&mut self) {
        self.staging.forget_last();
        self.geometry.forget_last();
    }

    /// Sets the error that the next frame aims for, by which triangles are merged.
    pub fn set_error(&mut self, error: f32) {
        self.settings.error = Some(error);
        self.facets.choose(&self.geometry, Some(error));
    }

    /// Whether diffuse surfaces get the same direct light of the environment in `scene` as in the one on the device.
    pub fn keeps_environment(&self, scene: &Scene) -> bool {
        !self.is_stale && keeps_environment(&self.scene, scene)
    }

    /// A compute pipeline, bound to those of the stage's `own` resources and of the scene's buffers and images that `shader`
    /// names.
    ///
    /// # Errors
    /// [`Error::Device`] where the driver refuses.
    ///
    /// # Panics
    /// If `shader` names another resource, a programming error.
    pub fn compute(
        &self,
        context: &Arc<Context>,
        shader: &'static Shader,
        own: &[(&'static str, Resource)],
    ) -> Result<BoundPipeline> {
        self.compute_with(self.constants(), context, shader, own)
    }

    /// The same with other specialisation constants.
    pub fn compute_with(
        &self,
        constants: Constants,
        context: &Arc<Context>,
        shader: &'static Shader,
        own: &[(&'static str, Resource)],
    ) -> Result<BoundPipeline> {
        BoundPipeline::compute(
            context,
            shader,
            constants,
            &[own, &self.resources()].concat(),
        )
    }

    /// What the scene has, as specialisation constants.
    pub fn constants(&self) -> Constants {
        let Settings { method, area, .. } = self.settings;
        let area_by_product = method == Method::Beams && area == Area::Product;
        let has =
            |kind: fn(&LightKind) -> bool| self.scene.lights.iter().any(|light| kind(&light.kind));
        let has_lamps = has(|kind| matches!(kind, LightKind::Lamp { .. }));
        let mut constants = Constants::default();
        for (id, value) in [
            (ID_ONLY_MIRRORS, self.casters.lobes == 1),
            (ID_AREA_BY_PRODUCT, area_by_product),
            (ID_BEAMS, method == Method::Beams),
            (ID_HAS_LAMPS, has_lamps),
            (ID_HAS_ENVIRONMENT, self.environment.is_present),
            (ID_HAS_ATLAS, self.receivers.mesh_count() > 0),
            (ID_HAS_POINTS, self.surfaces.drawn_counts[2] > 0),
            (ID_HAS_TEXTURES, self.textures.is_present),
            (ID_DISPERSES, self.spectrum.coordinate.is_some()),
            (ID_HAS_MERGED, self.geometry.merging.set_count() > 1),
        ] {
            constants[id as usize] = value;
        }
        constants
    }

    /// The scene's buffers and images, by the names that shaders have for them.
    fn resources(&self) -> [(&'static str, Resource<'_>); 29] {
        let buffer = Resource::Buffer;
        [
            ("triangles", buffer(&self.geometry.triangles)),
            ("normals", buffer(&self.geometry.normals)),
            ("nodes", buffer(&self.geometry.nodes)),
            ("objects", buffer(&self.objects)),
            ("lights", buffer(&self.lights.buffer)),
            ("planar_receivers", buffer(&self.receivers.planar)),
            ("mesh_receivers", buffer(&self.receivers.mesh)),
            ("atlas_texels", buffer(&self.receivers.atlas_texels)),
            ("atlas_samples", buffer(&self.receivers.atlas_samples)),
            ("atlas_nodes", buffer(&self.receivers.atlas_nodes)),
            ("surfaces", buffer(&self.surfaces.surfaces)),
            ("block_surfaces", buffer(&self.surfaces.block_surfaces)),
            ("drawn_triangles", buffer(&self.surfaces.drawn)),
            ("smooth_groups", buffer(&self.surfaces.smooth_groups)),
            ("blocks", buffer(&self.surfaces.blocks)),
            ("surface_points", buffer(&self.surfaces.points.points)),
            (
                "triangle_points",
                buffer(&self.surfaces.points.of_triangles),
            ),
            ("traced_points", buffer(&self.surfaces.points.traced)),
            ("copied_points", buffer(&self.surfaces.points.copies)),
            ("point_light", buffer(&self.surfaces.points.light)),
            (
                "point_environment",
                buffer(&self.surfaces.points.environment),
            ),
            (
                "direct_cells",
                buffer(&self.environment.direct_cells.buffer),
            ),
            ("lit_triangles", buffer(&self.casters.lit)),
            ("profiles", buffer(&self.profiles)),
            ("weights_below", buffer(&self.spectrum.weights_below)),
            ("environment", Resource::Image(&self.environment.image)),
            ("textured_triangles", buffer(&self.textures.triangles)),
            ("texture_levels", buffer(&self.textures.levels)),
            ("textures", Resource::Image(&self.textures.image)),
        ]
    }

    /// A graphics pipeline, bound in the same way.
    ///
    /// # Errors
    /// As [`DeviceScene::compute`].
    pub fn graphics(
        &self,
        context: &Arc<Context>,
        shaders: [&'static Shader; 2],
        topology: Topology,
        own: &[(&'static str, Resource)],
    ) -> Result<BoundPipeline> {
        let shared = self.resources();
        BoundPipeline::graphics(
            context,
            shaders,
            topology,
            self.constants(),
            &[own, &shared].concat(),
        )
    }

    /// The lights of `source` with the number of their patches, if there are any.
    pub fn group(&self, source: Source) -> Option<LightGroup> {
        match source {
            Source::Environment => self.environment.group(),
            Source::Suns => (self.lights.part_count > 0).then_some(LightGroup {
                light_count: self.lights.part_count,
                patch_count: self.casters.patch_count,
            }),
        }
    }

    /// Maximum number of pairs of patch and light for `source`.
    pub fn pair_capacity(&self, source: Source) -> u32 {
        match source {
            Source::Environment => {
                (self.environment.pairs.as_ref()).map_or(0, |pairs| pairs.pair_count)
            }
            _ => self.casters.patch_capacity * self.lights.part_count,
        }
    }

    /// Number of planar receivers times the number of lobes.
    pub fn planar_targets(&self) -> u32 {
        self.casters.lobes * self.receivers.planar_count
    }

    /// Pairs of patch and light in a first submission, before the speed of the device is known: each pair may cover a
    /// whole light map.
    pub fn first_pairs(&self) -> u64 {
        const FRAGMENTS: u64 = 1 << 22; // 20 ms on two CPU cores
        (FRAGMENTS / self.receivers.max_texels()).clamp(1, 4096)
    }
}
