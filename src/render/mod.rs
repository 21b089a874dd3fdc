//! The renderer and its interface for hosts. `frame.rs` lists every pass and barrier.
//!
//! ```text
//! scene ─► geometry, lights, receivers ─► patches ─► splat ─► view
//! ```
//! Each folder is a stage and depends only on the stages before it. [`Renderer::record`] records a frame into a command
//! buffer of a host. The blocking calls, for programs without Vulkan of their own, record the same passes and submit
//! them.

mod barriers;
mod blocking;
mod bodies;
mod budget;
mod caustic;
mod chains;
mod device_scene;
mod diagnostics;
mod direct_detail;
mod dispatch;
mod environment;
mod frame;
mod frame_counts;
mod geometry;
/// For tests of single passes.
#[doc(hidden)]
pub mod gpu_types;
mod host;
mod left_out;
mod light_parts;
mod lights;
mod looking_inside;
mod materials;
mod methods;
mod notes;
mod patches;
mod receivers;
mod scene_changes;
mod settings;
mod spectrum;
mod splat;
mod stages;
mod textures;
mod view;

pub use budget::FrameBudget;
pub use frame_counts::FrameCounts;
pub use host::{Frame, MapImage, MapTile, Output, ReceiverTile, ViewFrame};
pub use left_out::LeftOut;
pub use settings::{Area, DEFAULT_ERROR, EXPECTED_ERROR, Method, Settings};
pub use view::overlay::Overlay;

use crate::error::{Error, Result};
use crate::gpu::{Context, Image, PassTime, Recorder, Retired, Sampling, Submissions, Watcher};
use crate::render::caustic::Caustic;
use crate::render::device_scene::{Change, DeviceScene};
use crate::render::frame_counts::Counter;
pub use crate::render::gpu_types::constants::MAX_RAYS;
pub use crate::render::patches::facets::MAX_BUDGET as MAX_PATCHES;
use crate::render::receivers::dilate::Dilate;
use crate::render::view::camera::View;
use crate::render::view::direct::Direct;
use crate::render::view::overlay::Overlays;
use crate::scene::{Camera, Scene};
use ash::vk;
use std::any::Any;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Device memory of a view, bytes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
pub struct ViewMemory {
    /// Maps of direct light on all diffuse surfaces, bytes.
    pub maps: u64,
    /// Albedo maps and texture coordinates, bytes.
    pub textures: u64,
    /// The picture and the visible triangles at its samples, bytes.
    pub picture: u64,
}

/// A scene on a device, ready to be rendered repeatedly.
pub struct Renderer {
    context: Arc<Context>,
    settings: Settings,
    scene: DeviceScene,
    light_map: Image,
    tiles: Vec<ReceiverTile>,
    caustic: Caustic,
    direct: Direct,
    /// For the light map and the direct map, if there are mesh receivers.
    dilate: Option<[Dilate; 2]>,
    view: Option<View>,
    /// The overlays to show, and their stages.
    shown: Vec<Overlay>,
    overlays: Option<Overlays>,
    recorder: Recorder,
    /// While frames are counted, with the counts of the last one that has ended.
    counter: Option<Counter>,
    counts: Option<FrameCounts>,
    /// Stages that were replaced.
    retired: Retired<Box<dyn Any + Send + Sync>>,
    /// Whether a caustic was recorded, so that its counts are defined.
    has_caustic: bool,
    /// Whether the light maps show the current scene. If so, no caustic is computed.
    is_current: bool,
    /// Whether the direct maps show the current scene.
    is_direct_current: bool,
    /// Whether the direct map of the environment shows the current scene. It is kept where only suns, lamps or materials change.
    is_environment_current: bool,
    /// Whether points of meshes have the light of the current environment, which does not depend on the size of the maps.
    are_points_current: bool,
    direct_halvings: u32,
    budget: Option<FrameBudget>,
    /// What a frame lacked, for which the next caustic begins with larger buffers.
    grows: Option<stages::Reached>,
    /// Time of the last update; reset when a caustic has been rendered.
    update_time: Duration,
}

impl Renderer {
    /// Allocates the resources of `scene` and creates the passes of `settings.method`. On the device of a host, nothing
    /// is submitted.
    ///
    /// # Errors
    /// [`Error::Usage`] if the scene has nothing to render, [`Error::Device`] if the device fails.
    pub fn new(context: &Arc<Context>, scene: &Scene, settings: &Settings) -> Result<Self> {
        let budget = settings.budget.map(FrameBudget::new);
        let settings = Settings {
            error: budget
                .as_ref()
                .map_or(settings.error, |budget| Some(budget.error())),
            ..settings.clone()
        };
        let mut device = DeviceScene::new(context, scene, &settings)?;
        let size = device.receivers.image_size;
        let light_map = Image::new(context, "light map", size, 1, Sampling::Clamp)?;
        device.staging.prepare(&light_map);
        let caustic = stages::caustic(context, &mut device, &light_map, &settings)?;
        let budget = budget.filter(|_| caustic.has_error_target());
        let direct = Direct::new(context, &mut device)?;
        let dilate = match device.receivers.mesh_count() {
            0 => None,
            _ => Some([
                Dilate::new(context, &device, &light_map)?,
                Dilate::new(context, &device, &direct.map)?,
            ]),
        };
        context.compile_pipelines()?;
        let recorder = match context.is_of_host() {
            true => Recorder::for_host(context, settings.frames_in_flight),
            false => Recorder::new(context)?,
        };
        Ok(Self {
            // What an update replaces before a frame is recorded was used by the frame before.
            retired: Retired::new(settings.frames_in_flight + 1),
            context: context.clone(),
            settings,
            tiles: host::tiles(&device),
            scene: device,
            light_map,
            caustic,
            direct,
            dilate,
            view: None,
            shown: Vec::new(),
            overlays: None,
            recorder,
            counter: None,
            counts: None,
            has_caustic: false,
            is_current: false,
            is_direct_current: false,
            is_environment_current: false,
            are_points_current: false,
            direct_halvings: 0,
            budget,
            grows: None,
            update_time: Duration::ZERO,
        })
    }

    /// Records a frame into a command buffer of the host. It submits nothing, waits for nothing and reads nothing back. The
    /// frame first copies the changes of the scene; an unchanged scene costs no copy.
    ///
    /// # Errors
    /// The errors of [`Renderer::update`], before anything is recorded. [`Error::Host`] if the context is not that of a host
    /// or the command buffer is null. [`Error::Device`] if the work exceeds the device's limits; the host must then not
    /// submit the command buffer.
    ///
    /// # Safety
    /// `commands` is a primary command buffer in the recording state, outside a render pass and without an active query, and comes from
    /// a pool of the context's queue family. What is bound to it is undefined afterwards. It is submitted once, to the same queue as
    /// the command buffers of earlier frames and after them. At most [`Settings::frames_in_flight`] frames are in flight: the host
    /// has waited for the frame that many frames before this one.
    pub unsafe fn record(
        &mut self,
        commands: vk::CommandBuffer,
        frame: &Frame,
    ) -> Result<Output<'_>> {
        if !self.context.is_of_host() || commands == vk::CommandBuffer::null() {
            return Err(Error::Host {
                reason: "a frame cannot be recorded without a device and a command buffer of the host".into(),
                remedy: "make the context with Context::from_raw, and pass a command buffer that is recording".into(),
            });
        }
        self.retired.begin_frame().for_each(drop);
        // SAFETY: the caller's promise.
        let recorded = unsafe { self.record_frame(commands, frame) };
        recorded.inspect_err(|_| self.retired.forget_last())?;
        let (last_stage, last_access) = frame::LIGHT_MAP_WRITE.masks();
        Ok(Output {
            light_map: MapImage::of(&self.light_map),
            direct_map: MapImage::of(&self.direct.map),
            view: frame
                .view
                .and(self.view.as_ref())
                .map(|view| MapImage::of(&view.image)),
            last_stage,
            last_access,
            receivers: &self.tiles,
        })
    }

    /// # Safety
    /// That of [`Renderer::record`].
    unsafe fn record_frame(&mut self, commands: vk::CommandBuffer, frame: &Frame) -> Result<()> {
        self.update(frame.scene)?;
        if frame.direct || frame.view.is_some() {
            self.fit_direct_maps()?;
        }
        if let Some(view) = frame.view {
            self.prepare_view(view.size, view.antialias)?;
            self.prepare_overlays()?;
        }
        self.recorder.read_host_times()?;
        self.read_counts();
        // SAFETY: the caller's promise.
        unsafe { self.recorder.begin_host(commands) };
        let recorded = self.record_caustic().and_then(|()| {
            if frame.direct || frame.view.is_some() {
                self.record_direct()?;
            }
            if frame.view.is_some() {
                self.record_view(&frame.scene.camera)?;
            }
            self.record_counts()
        });
        // What the host must not submit leaves the light maps as they were.
        (self.recorder.end_host().and(recorded)).inspect_err(|_| {
            self.recorder.forget_last();
            self.counter.iter_mut().for_each(Counter::forget_last);
            self.scene.forget_last();
            self.invalidate();
        })
    }

    /// Number of parts of the last recorded frame that executed the commands of the frame before, in place of being recorded: the
    /// caustic, the environment's direct light on rects, that at points of meshes, other direct light, and the view.
    pub fn reused_parts(&self) -> u32 {
        self.recorder.reused_parts()
    }

    /// Keeps stages that were replaced until no frame in flight uses them.
    fn keep(&mut self, stages: impl Any + Send + Sync) {
        self.retired.keep(Box::new(stages));
    }

    /// Finds what changed in `scene` since the last frame. The next [`Renderer::caustic`], [`Renderer::view`] or
    /// [`Renderer::record`] uses the changed scene. Only changes are copied, and no pipeline is compiled again.
    ///
    /// The subdivision of each triangle is fixed when the renderer is made, which avoids flicker. The number of patches
    /// depends on the number of lit triangles.
    ///
    /// # Errors
    /// [`Error::Usage`] if `scene` has other objects, shapes, kinds of material or lights, light maps of other sizes, too many
    /// patches, or a mirror that was convex and alone and is not convex any more, so that its light may meet it again: make a new
    /// renderer for it. [`Error::Device`] if the device fails. After an error, the maps
    /// are undefined until an update succeeds.
    pub fn update(&mut self, scene: &Scene) -> Result<()> {
        let start = Instant::now();
        let capacity = self.scene.casters.patch_capacity;
        // Where an update fails, the caustic is not current.
        let was_current = std::mem::take(&mut self.is_current);
        let keeps_environment = self.scene.keeps_environment(scene);
        let change = self.scene.update(&self.context, scene)?;
        for replaced in std::mem::take(&mut self.scene.geometry.replaced) {
            self.keep(replaced);
        }
        self.is_current = was_current && change == Change::Nothing;
        self.is_direct_current &= change == Change::Nothing;
        self.is_environment_current &= keeps_environment;
        self.are_points_current &= keeps_environment;
        if change == Change::Stages {
            let stages = self.bind_stages().inspect_err(|_| {
                // The stages keep their old capacity, which these patches exceed.
                self.scene.casters.patch_capacity = capacity;
                self.scene.casters.clear();
                self.scene.is_stale = true;
            })?;
            self.drop_overlays();
            let replaced = std::mem::replace(&mut self.caustic, stages);
            let lattices = self.scene.replaced.take();
            self.keep((replaced, lattices));
        }
        self.context.compile_pipelines()?;
        self.update_time = start.elapsed();
        Ok(())
    }

    /// Number of patches or points of the last [`Renderer::caustic`], including the environment's patch clusters. Patches
    /// that follow the flux are counted only after the first caustic.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn samples(&self) -> Result<u32> {
        self.caustic.sample_count(&self.scene, self.has_caustic)
    }

    /// Number of patches that lit a receiver in the last [`Renderer::caustic`], counted once for each light. `None` for
    /// methods other than `footprint`, under an environment, or if a receiver is a mesh.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn lit_patches(&self) -> Result<Option<u32>> {
        match self.settings.method {
            Method::Footprint => self.caustic.lit_patches(),
            _ => Ok(None),
        }
    }

    /// Estimated relative L1 error of the last [`Renderer::caustic`], on the receiver where it is largest: the expected one, which is
    /// below the error aimed for, as patches are chosen with caution ([`EXPECTED_ERROR`]). `None` without an error to aim for, under
    /// an environment, or if a receiver is a mesh.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn estimated_error(&self) -> Result<Option<f32>> {
        match self.settings.method {
            Method::Footprint if self.has_caustic => self.caustic.estimated_error(),
            _ => Ok(None),
        }
    }

    /// Whether light may meet several mirrors or interfaces on its way to a receiver.
    pub fn may_chain(&self) -> bool {
        self.scene.lattices.may_chain
    }

    /// Makes the next frame compute its caustic and its direct light even if the scene is unchanged, for measurements.
    pub fn invalidate(&mut self) {
        self.is_current = false;
        self.forget_direct();
    }

    /// Has the next frame compute its direct light even if the scene is unchanged.
    fn forget_direct(&mut self) {
        self.is_direct_current = false;
        self.is_environment_current = false;
        self.are_points_current = false;
    }

    /// Makes the next frame place the meshes that moved as a whole and refit the hierarchy again, for measurements.
    pub fn invalidate_geometry(&mut self) {
        self.scene.geometry.invalidate();
    }

    /// Submits every pass separately from now on, so that [`Renderer::take_times`] returns wall times.
    pub fn wait_each_pass(&mut self, wait: bool) {
        self.recorder.wait_each_pass(wait);
    }

    /// Starts or stops timing the passes of a host's frames. [`Renderer::take_times`] then returns the times of the latest frame
    /// that is no longer in flight. Timestamps between passes cost time on some devices.
    pub fn time_passes(&mut self, on: bool) {
        let frames = if on {
            self.settings.frames_in_flight.max(1)
        } else {
            0
        };
        self.recorder.time_frames(frames);
    }

    /// Returns the times of the passes of the last frame.
    pub fn take_times(&mut self) -> Vec<PassTime> {
        self.recorder.take_times()
    }

    /// Number of submissions of the last frame, and the time of the longest. A submission that would run long on this device is
    /// split.
    pub fn submissions(&self) -> Submissions {
        self.recorder.submissions()
    }

    /// Calls `watcher` after every submission from now on, so that the caller can show the progress of long work and cancel it.
    pub fn watch(&mut self, watcher: Option<Watcher>) {
        self.recorder.watch(watcher);
    }

    /// The stages, bound to the scene's current buffers.
    fn bind_stages(&mut self) -> Result<Caustic> {
        let (context, light_map) = (&self.context, &self.light_map);
        stages::caustic(context, &mut self.scene, light_map, &self.settings)
    }

    fn record_caustic(&mut self) -> Result<()> {
        frame::upload(&mut self.recorder, &mut self.scene)?;
        if self.is_current {
            return Ok(());
        }
        let dilate = self.dilate.as_ref().map(|[of_caustic, _]| of_caustic);
        self.has_caustic = true;
        let (scene, stages, light_map) = (&self.scene, &self.caustic, &self.light_map);
        self.recorder.reusable("caustic", |r| {
            frame::caustic(r, scene, stages, light_map, dilate)
        })?;
        self.is_current = true;
        Ok(())
    }

    fn record_direct(&mut self) -> Result<()> {
        if self.is_direct_current {
            return Ok(());
        }
        let dilate = self.dilate.as_ref().map(|[_, of_direct]| of_direct);
        let (scene, direct) = (&self.scene, &self.direct);
        if scene.environment.is_present && !self.is_environment_current {
            self.recorder.reusable("environment light", |r| {
                view::frame::environment_light(r, scene, direct)
            })?;
        }
        let has_points = scene.environment.is_present && !scene.surfaces.points.is_empty();
        if has_points && !self.are_points_current {
            self.recorder.reusable("environment points", |r| {
                view::frame::environment_points(r, scene, direct)
            })?;
        }
        self.recorder.reusable("direct light", |r| {
            view::frame::direct_light(r, scene, direct, dilate)
        })?;
        self.is_environment_current = true;
        self.are_points_current = true;
        self.is_direct_current = true;
        Ok(())
    }

    /// Creates the images of a view of `size` pixels with `side`² samples per pixel, unless they exist.
    fn prepare_view(&mut self, size: [u32; 2], side: u32) -> Result<()> {
        let is_same = |view: &View| view.size() == size && view.side == side;
        if !self.view.as_ref().is_some_and(is_same) {
            let maps = [&self.light_map, &self.direct.map];
            let view = View::new(&self.context, &mut self.scene, maps, size, side)?;
            self.context.compile_pipelines()?;
            if let Some(replaced) = self.view.replace(view) {
                self.keep(replaced);
            }
        }
        Ok(())
    }

    fn record_view(&mut self, camera: &Camera) -> Result<()> {
        let view = self.view.as_ref().expect("prepared");
        let scene = &self.scene;
        self.recorder
            .reusable("view", |r| view::frame::view(r, scene, view, camera))?;
        self.record_overlays(camera)
    }

    /// Device memory of the direct maps, the textures and the last view.
    pub fn view_memory(&self) -> ViewMemory {
        ViewMemory {
            maps: self.direct.bytes() + self.scene.surfaces.bytes(),
            textures: self.scene.textures.bytes(),
            picture: self.view.as_ref().map_or(0, View::bytes),
        }
    }

    /// Sets the relative L1 error that the next frame aims for, 0 < `error` ≤ 1. It has no effect if [`Settings::error`] is
    /// `None`.
    pub fn set_error(&mut self, error: f32) {
        if self.settings.error.is_some() {
            self.is_current &= self.settings.error == Some(error);
            self.settings.error = Some(error);
            self.caustic.set_error(error);
            self.scene.set_error(error);
        }
    }

    /// The state of [`Settings::budget`]. `None` without a budget, or if no sun or lamp lights a planar receiver.
    pub fn budget(&self) -> Option<&FrameBudget> {
        self.budget.as_ref()
    }
}
