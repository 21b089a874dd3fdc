//! The renderer: a list of passes and the barriers between them.
//!
//! ```text
//! scene ─► upload ─► sample ─► project ─► splat ─► resolve ─► shade ─► read back
//! ```
//! A mirror is cut into patches (sample). Each patch images each light onto each receiver: a
//! footprint (project). The footprints are added to the receivers' light maps (splat), wide
//! ones to coarse levels (resolve), which the view shows (shade). `pinhole` gathers over the
//! patches instead, as the paper does; `beams` draws each patch as a triangle of even irradiance;
//! `points` replaces patches and footprints by points and single texels.

mod beams;
mod bvh;
mod curved;
mod direct;
mod idle;
mod kernel;
mod layout;
mod light_images;
mod listed;
mod merged;
mod narrow;
mod pairs;
mod parts;
mod pinhole;
mod points;
mod project;
mod reflectors;
mod resolve;
mod sample;
mod shade;
mod sky;
mod soup;
mod splat;
mod split;
mod surface;
mod update;
mod upload;

use crate::error::{Error, Result};
use crate::gpu::{
    Access, Buffer, Context, Image, PassTime, Recorder, Sampling, Submissions, Watcher,
};
use crate::image_file::RgbImage;
use crate::scene::{Camera, Scene};
use beams::Beams;
use curved::{Dilate, Splats};
use direct::Direct;
use light_images::LightImages;
use listed::{Batch, Listed};
use pairs::Class;
use parts::{Part, bands, first_groups, group_count};
use pinhole::Pinhole;
use points::Points;
use project::Project;
use resolve::Resolve;
use sample::Sample;
use shade::Shade;
use splat::Splat;
use std::ops::Range;
use std::sync::Arc;
use upload::{COARSEST, DeviceScene};

/// How the caustic is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Patches are imaged to footprints, which are added up.
    Footprint,
    /// Every texel gathers over all patches (Wand & Straßer 2003).
    Pinhole,
    /// Low-discrepancy points, one texel each.
    Points,
    /// Patches are drawn as triangles between their corners' mirrored rays.
    Beams,
}

impl Method {
    pub const ALL: [Self; 4] = [Self::Footprint, Self::Pinhole, Self::Points, Self::Beams];

    /// In reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Footprint => "footprint",
            Self::Pinhole => "pinhole",
            Self::Points => "points",
            Self::Beams => "beams",
        }
    }
}

/// How `beams` compares the area of a patch with that of its image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Area {
    /// The area: the length of the sides' cross product.
    True,
    /// The product of the lengths of the derivatives by texel, `length(dFdx(x)) * length(dFdy(x))`,
    /// as is widespread. Right only where they are at right angles.
    Product,
}

impl Area {
    pub const ALL: [Self; 2] = [Self::True, Self::Product];

    /// In reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::True => "true",
            Self::Product => "product",
        }
    }
}

/// What to compute and how finely.
#[derive(Debug, Clone)]
pub struct Settings {
    pub method: Method,
    /// Patches asked for on the mirrors' lit faces (at least one a triangle is made), or points.
    pub samples: u32,
    /// `footprint`: parts that an environment is cut into, at most; 8 or more are.
    pub sky_parts: u32,
    /// `footprint`: images of a part of an environment in a patch, about so many for every sample, times the
    /// environment's share of all light in the first frame.
    pub sky_images: u32,
    /// `pinhole`: ε of the form factor's d² + ε, in squared patch diameters.
    pub epsilon: f32,
    /// `pinhole`: blur the light by the patch's curvature.
    pub filter: bool,
    /// `beams`: what is taken for the area.
    pub area: Area,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            method: Method::Footprint,
            samples: 16_384,
            sky_parts: 4096,
            sky_images: 4,
            epsilon: 1.0,
            filter: true,
            area: Area::True,
        }
    }
}

/// A scene on a device, ready to be rendered again and again.
pub struct Renderer {
    context: Arc<Context>,
    settings: Settings,
    scene: DeviceScene,
    light_map: Image,
    direct_map: Image,
    caustic: Caustic,
    direct: Direct,
    /// For the light map and the direct map, where there are curved receivers.
    dilate: Option<[Dilate; 2]>,
    shade: Option<Shade>,
    recorder: Recorder,
}

/// The stages of a method.
#[allow(clippy::large_enum_variant)] // a renderer has one
enum Caustic {
    Footprint {
        sample: Sample,
        narrow: Option<Beams>,
        wide: Option<Wide>,
        curved: Option<Splats>,
    },
    Pinhole {
        sample: Sample,
        pinhole: Pinhole,
    },
    Points(Points),
    Beams {
        sample: Sample,
        beams: Beams,
    },
}

/// Footprints on rects of lights that are not narrow.
struct Wide {
    project: Project,
    images: Option<LightImages>,
    splat: Splat,
    resolve: Resolve,
}

impl Wide {
    fn new(
        context: &Arc<Context>,
        device: &DeviceScene,
        patches: &Buffer,
        light_map: &Image,
    ) -> Result<Self> {
        let project = Project::new(context, device, patches)?;
        let images = (device.pairs.as_ref())
            .map(|pairs| LightImages::new(context, device, pairs, &project.listed.coarse))
            .transpose()?;
        let splat = Splat::new(context, &project.listed)?;
        let resolve = Resolve::new(context, device, &project.listed, light_map)?;
        Ok(Self {
            project,
            images,
            splat,
            resolve,
        })
    }
}

impl Caustic {
    /// The lists of what patches throw.
    fn lists(&self) -> Vec<&Listed> {
        match self {
            Caustic::Footprint {
                narrow,
                wide,
                curved,
                ..
            } => {
                let images = wide.iter().filter_map(|wide| wide.images.as_ref());
                (narrow.iter().map(|beams| &beams.listed))
                    .chain(wide.iter().map(|wide| &wide.project.listed))
                    .chain(images.map(|images| &images.listed))
                    .chain(curved.iter().map(|splats| &splats.listed))
                    .collect()
            }
            Caustic::Beams { beams, .. } => vec![&beams.listed],
            Caustic::Pinhole { .. } | Caustic::Points(_) => Vec::new(),
        }
    }

    fn new(
        context: &Arc<Context>,
        device: &DeviceScene,
        light_map: &Image,
        settings: &Settings,
    ) -> Result<Self> {
        Ok(match settings.method {
            Method::Footprint => {
                let sample = Sample::new(context, device)?;
                let flat = device.flat_count > 0;
                let narrow = (flat && !device.lights(true).is_empty())
                    .then(|| Beams::new(context, device, &sample.patches, Area::True))
                    .transpose()?;
                let wide = (flat && (!device.lights(false).is_empty() || device.pairs.is_some()))
                    .then(|| Wide::new(context, device, &sample.patches, light_map))
                    .transpose()?;
                let curved = (device.curved_count() > 0)
                    .then(|| Splats::new(context, device, &sample.patches))
                    .transpose()?;
                Caustic::Footprint {
                    sample,
                    narrow,
                    wide,
                    curved,
                }
            }
            Method::Pinhole => {
                let sample = Sample::new(context, device)?;
                let pinhole = Pinhole::new(context, device, &sample.patches, light_map, settings)?;
                Caustic::Pinhole { sample, pinhole }
            }
            Method::Points => Caustic::Points(Points::new(context, device, settings.samples)?),
            Method::Beams => {
                let sample = Sample::new(context, device)?;
                if let Some(tile) = device.curved_tiles().first() {
                    return Err(Error::Usage {
                        reason: format!(
                            "the method beams lights rects only, and object `{}` is a mesh with a light map",
                            device.scene.objects[tile.object].name
                        ),
                        remedy: "choose another method, or remove the object's `lightmap`".into(),
                    });
                }
                let beams = Beams::new(context, device, &sample.patches, settings.area)?;
                Caustic::Beams { sample, beams }
            }
        })
    }
}

impl Renderer {
    /// Uploads `scene` and compiles the passes of `settings.method`.
    ///
    /// # Errors
    /// [`Error::Usage`] where the scene has nothing to render, [`Error::Device`] where the device
    /// fails.
    pub fn new(context: &Arc<Context>, scene: &Scene, settings: &Settings) -> Result<Self> {
        let device = DeviceScene::new(context, scene, settings)?;
        let light_map = Image::new(context, "light map", device.atlas, 1, Sampling::Clamp)?;
        let direct_map = Image::new(context, "direct map", device.atlas, 1, Sampling::Clamp)?;
        let caustic = Caustic::new(context, &device, &light_map, settings)?;
        let direct = Direct::new(context, &device, &direct_map)?;
        let dilate = match device.curved_count() {
            0 => None,
            _ => Some([
                Dilate::new(context, &device, &light_map)?,
                Dilate::new(context, &device, &direct_map)?,
            ]),
        };
        let recorder = Recorder::new(context)?;
        Ok(Self {
            context: context.clone(),
            settings: settings.clone(),
            scene: device,
            light_map,
            direct_map,
            caustic,
            direct,
            dilate,
            shade: None,
            recorder,
        })
    }

    /// Moves what has moved in `scene` since the last frame, and waits for it. The next
    /// [`Renderer::caustic`] or [`Renderer::view`] shows it. Only what changed is uploaded, and no
    /// pipeline is made again but where more patches are lit than ever before.
    ///
    /// Each triangle stays cut as it was when the renderer was made, so that nothing flickers; the
    /// number of patches follows how many of them are lit.
    ///
    /// # Errors
    /// [`Error::Usage`] where `scene` has other objects, shapes, kinds of material or lights, or
    /// light maps of other sizes, or too many patches; [`Error::Device`] where the device fails. What
    /// is shown before another update succeeds is then undefined.
    pub fn update(&mut self, scene: &Scene) -> Result<()> {
        let Self {
            context,
            settings,
            scene: device,
            light_map,
            recorder,
            ..
        } = self;
        let room = device.patch_room;
        if device.update(context, recorder, scene)? {
            self.caustic =
                Caustic::new(context, device, light_map, settings).inspect_err(|_| {
                    // The stages still have the old room, which these patches would not fit into.
                    device.patch_room = room;
                    (device.patch_count, device.reflector_count) = (0, 0);
                })?;
        }
        Ok(())
    }

    /// What is left out and why, for the user.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if !self.scene.trace {
            let note =
                "no rays are traced for the caustic: nothing in the scene can block its light";
            notes.push(note.into());
        }
        let lights = matches!(self.settings.method, Method::Footprint | Method::Pinhole);
        if self.scene.has_environment && !lights {
            let note = "the environment throws no caustic, and water lets none of it through: the \
                 methods footprint and pinhole do that";
            notes.push(note.into());
        } else if self.scene.scene.specular_objects().next().is_none() {
            let note = "no caustic: nothing in the scene reflects or refracts light";
            notes.push(note.into());
        }
        notes.extend(
            self.scene
                .patch_note(self.settings.method, self.settings.samples),
        );
        notes.extend(idle::sentences(
            &self.scene,
            &self.scene.lights_now(),
            lights,
        ));
        notes
    }

    /// Patches (or points) in use, those for the environment included.
    pub fn samples(&self) -> u32 {
        match &self.caustic {
            Caustic::Points(points) if self.scene.reflector_count > 0 => points.count,
            Caustic::Points(_) => 0,
            _ => {
                let merged = self
                    .scene
                    .pairs
                    .as_ref()
                    .map_or(0, |pairs| pairs.patch_count);
                self.scene.patch_count + merged
            }
        }
    }

    /// Patches that threw light on a receiver in the last [`Renderer::caustic`], each counted once
    /// a sun; `None` for other methods, under an environment, or where a receiver is a mesh.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn lit_patches(&self) -> Result<Option<u32>> {
        let Caustic::Footprint {
            narrow,
            wide,
            curved: None,
            ..
        } = &self.caustic
        else {
            return Ok(None);
        };
        if self.scene.pairs.is_some() {
            return Ok(None);
        }
        (narrow.iter().map(|beams| &beams.listed))
            .chain(wide.iter().map(|wide| &wide.project.listed))
            .map(|listed| Ok(listed.arguments.read::<u32>(7)?[6]))
            .sum::<Result<u32>>()
            .map(Some)
    }

    /// Submits every pass on its own from now on, so that [`Renderer::take_times`] has wall times.
    pub fn wait_each_pass(&mut self, wait: bool) {
        self.recorder.wait_each_pass(wait);
    }

    /// Times of the passes of the last frame.
    pub fn take_times(&mut self) -> Vec<PassTime> {
        self.recorder.take_times()
    }

    /// Submissions of the last frame: one that would run long on this device is split.
    pub fn submissions(&self) -> Submissions {
        self.recorder.submissions()
    }

    /// Calls `watcher` after every submission from now on, so that long work can be shown and stopped.
    pub fn watch(&mut self, watcher: Option<Watcher>) {
        self.recorder.watch(watcher);
    }

    /// Renders the caustic into the light maps and waits for it.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails, [`Error::Cancelled`] where the watcher says so.
    pub fn caustic(&mut self) -> Result<()> {
        self.recorder.begin_frame();
        self.record_caustic()?;
        self.recorder.submit()
    }

    fn record_caustic(&mut self) -> Result<()> {
        let Self {
            scene,
            light_map,
            recorder,
            ..
        } = self;
        let draws = match &self.caustic {
            Caustic::Footprint {
                narrow,
                wide,
                curved,
                ..
            } => {
                let any = |classes: Vec<Class>| classes.iter().any(|class| class.pairs() > 0);
                let sky = any(scene.sky_pairs().into_iter().collect());
                narrow.is_some() && any(scene.lights(true))
                    || wide.is_some() && (sky || any(scene.lights(false)))
                    || curved.is_some() && (sky || any(vec![scene.all_lights()]))
            }
            _ if scene.reflector_count == 0 => false,
            Caustic::Points(points) => points.count > 0,
            Caustic::Beams { .. } => scene.all_lights().pairs() > 0,
            Caustic::Pinhole { .. } => false,
        };
        recorder.pass("clear", |r| {
            r.barrier(
                Access::ANY_WRITE,
                Access::TRANSFER_WRITE
                    .and(Access::BLEND)
                    .and(Access::COMPUTE),
            );
            for listed in self.caustic.lists() {
                r.zero(&listed.arguments);
                r.zero(&listed.coarse);
            }
            r.barrier(Access::TRANSFER_WRITE, Access::BLEND.and(Access::COMPUTE));
        })?;
        let bands = bands([light_map.width, light_map.height], BAND);
        // The first batch that is drawn clears a small light map itself.
        let mut clear = draws && bands.len() == 1;
        if !clear {
            record_clear(recorder, light_map, bands)?;
        }
        let gathers = matches!(self.caustic, Caustic::Pinhole { .. }) && scene.reflector_count > 0;
        if !draws && !gathers {
            return Ok(());
        }
        match &self.caustic {
            Caustic::Footprint {
                sample,
                narrow,
                wide,
                curved,
            } => {
                record_sample(recorder, scene, sample)?;
                if let Some(beams) = narrow {
                    record_beams(recorder, scene, beams, light_map, &mut clear)?;
                }
                let sky = || scene.sky_pairs().map(|class| (class, true));
                if let Some(Wide {
                    project,
                    images,
                    splat,
                    ..
                }) = wide
                {
                    // Before footprints: their list also says which levels there are.
                    for (images, class) in images.iter().zip(scene.sky_pairs()) {
                        record_pairs(
                            recorder,
                            scene,
                            ("light images", &images.listed, class),
                            &mut clear,
                            |r, batch| images.record_project(r, scene, batch),
                            |r, clear| images.record_draw(r, light_map, clear),
                        )?;
                    }
                    let suns = (scene.lights(false).into_iter()).map(|class| (class, false));
                    for (class, is_sky) in suns.chain(sky()) {
                        record_pairs(
                            recorder,
                            scene,
                            (kernels(is_sky), &project.listed, class),
                            &mut clear,
                            |r, batch| project.record(r, scene, (batch, is_sky)),
                            |r, clear| splat.record(r, &project.listed, light_map, clear),
                        )?;
                    }
                }
                if let Some(splats) = curved {
                    for (class, is_sky) in std::iter::once((scene.all_lights(), false)).chain(sky())
                    {
                        record_pairs(
                            recorder,
                            scene,
                            (kernels_on_meshes(is_sky), &splats.listed, class),
                            &mut clear,
                            |r, batch| splats.record_project(r, scene, (batch, is_sky)),
                            |r, clear| splats.record_draw(r, light_map, clear),
                        )?;
                    }
                }
                if let Some(Wide {
                    project, resolve, ..
                }) = wide
                {
                    record_resolve(recorder, scene, resolve, &project.listed)?;
                }
            }
            Caustic::Pinhole { sample, pinhole } => {
                record_sample(recorder, scene, sample)?;
                let batch = Pinhole::batch(scene);
                let groups = scene.receiver_groups();
                let total = groups * u64::from(scene.patch_count.div_ceil(batch));
                let first = first_groups(Pinhole::rays(scene));
                recorder.in_shares("gather", total, first, |r, done, most| {
                    let first_patch = (done / groups) as u32 * batch;
                    let patches = (first_patch, batch.min(scene.patch_count - first_patch));
                    let (tile, part) = scene.receiver_part(done % groups, most);
                    r.pass("gather", |r| {
                        pinhole.record(r, scene, patches, (tile, part));
                        r.barrier(Access::COMPUTE, Access::COMPUTE);
                    })?;
                    Ok(part.count())
                })?;
            }
            Caustic::Points(points) => {
                let total = points.count.into();
                recorder.in_shares("points", total, FIRST_POINTS, |r, done, most| {
                    let batch = (done as u32, most.min(points.batch.into()) as u32);
                    r.pass("trace points", |r| {
                        points.record_trace(r, scene, batch);
                        r.barrier(Access::COMPUTE_WRITE, Access::VERTEX_READ);
                    })?;
                    r.pass("splat points", |r| {
                        points.record_draw(r, scene, batch, light_map, clear);
                        r.barrier(
                            Access::BLEND.and(Access::VERTEX_READ),
                            Access::BLEND.and(Access::COMPUTE),
                        );
                    })?;
                    clear = false;
                    Ok(batch.1.into())
                })?;
            }
            Caustic::Beams { sample, beams } => {
                record_sample(recorder, scene, sample)?;
                record_beams(recorder, scene, beams, light_map, &mut clear)?;
            }
        }
        // Footprints fall on the texels around the charts by themselves.
        if let Some([dilate, _]) =
            (self.dilate.as_ref()).filter(|_| !matches!(self.caustic, Caustic::Footprint { .. }))
        {
            dilate.record(recorder, scene, Access::BLEND.and(Access::COMPUTE_WRITE))?;
        }
        Ok(())
    }

    /// Renders one frame: caustic, direct light, and `camera`'s view of `size` pixels with
    /// `side`² samples each, as linear radiance.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn view(&mut self, camera: &Camera, size: [u32; 2], side: u32) -> Result<()> {
        if self
            .shade
            .as_ref()
            .is_none_or(|s| [s.view.width, s.view.height] != size)
        {
            self.shade = Some(Shade::new(
                &self.context,
                &self.scene,
                &self.light_map,
                &self.direct_map,
                size,
            )?);
        }
        self.recorder.begin_frame();
        self.record_caustic()?;
        if self.scene.has_environment {
            self.record_direct(false)?;
        }
        let Self {
            scene,
            recorder,
            shade,
            ..
        } = self;
        let shade = shade.as_ref().expect("made above");
        let size = shade.size();
        let first = first_groups(Shade::rays(scene, side));
        recorder.in_shares("shade", group_count(size), first, |r, done, most| {
            let part = Part::of(size, done, most);
            r.pass("shade", |r| {
                r.barrier(Access::BLEND.and(Access::COMPUTE_WRITE), Access::COMPUTE);
                shade.record(r, scene, camera, side, part);
            })?;
            Ok(part.count())
        })?;
        recorder.submit()
    }

    fn record_direct(&mut self, with_suns: bool) -> Result<()> {
        let Self {
            scene,
            direct,
            dilate,
            recorder,
            ..
        } = self;
        let first = first_groups(Direct::rays(scene, with_suns));
        recorder.in_shares("direct", scene.receiver_groups(), first, |r, done, most| {
            let (tile, part) = scene.receiver_part(done, most);
            r.pass("direct", |r| {
                r.barrier(
                    Access::ANY_WRITE.and(Access::COMPUTE_READ),
                    Access::COMPUTE_WRITE,
                );
                direct.record(r, scene, (tile, part), with_suns);
            })?;
            Ok(part.count())
        })?;
        if let Some([_, dilate]) = dilate {
            dilate.record(recorder, scene, Access::COMPUTE_WRITE)?;
        }
        Ok(())
    }

    /// Renders the direct light of all lights into the direct maps and waits for it.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    pub fn direct(&mut self) -> Result<()> {
        self.recorder.begin_frame();
        self.record_direct(true)?;
        self.recorder.submit()
    }

    /// Linear radiance of the last [`Renderer::view`], W/m²/sr.
    ///
    /// # Errors
    /// [`Error::Device`] where the device fails.
    ///
    /// # Panics
    /// Where there was no view.
    pub fn read_view(&self) -> Result<RgbImage> {
        let view = &self.shade.as_ref().expect("a view was rendered").view;
        read(view, [0, 0], [view.width, view.height])
    }

    /// Caustic irradiance of the receiver `object`, W/m², after [`Renderer::caustic`].
    ///
    /// # Errors
    /// [`Error::Usage`] where the object has no light map, [`Error::Device`] where the device fails.
    pub fn read_caustic(&self, object: usize) -> Result<RgbImage> {
        self.read_tile(&self.light_map, object)
    }

    /// Direct irradiance of the receiver `object`, W/m², after [`Renderer::direct`].
    ///
    /// # Errors
    /// As [`Renderer::read_caustic`].
    pub fn read_direct(&self, object: usize) -> Result<RgbImage> {
        self.read_tile(&self.direct_map, object)
    }

    /// Texels of a mesh's light map outside of its charts are 0.
    fn read_tile(&self, map: &Image, object: usize) -> Result<RgbImage> {
        let tile = self
            .scene
            .tiles
            .iter()
            .find(|t| t.object == object)
            .ok_or_else(|| Error::Usage {
                reason: format!("object {object} has no light map"),
                remedy: "name a diffuse rect or mesh with the key lightmap".into(),
            })?;
        let mut image = read(map, tile.origin, tile.size)?;
        if let Some(atlas) = &self.scene.atlases[object] {
            for (texel, pixel) in image.pixels.iter_mut().enumerate() {
                if atlas.pieces(texel).is_empty() {
                    *pixel = [0.0; 3];
                }
            }
        }
        Ok(image)
    }
}

/// Patches and points of a first submission, on a device of which nothing is known.
const FIRST_PATCHES: u64 = 1 << 16;
const FIRST_POINTS: u64 = 1 << 12;

/// The patches of all reflectors.
fn record_sample(recorder: &mut Recorder, scene: &DeviceScene, sample: &Sample) -> Result<()> {
    let total = scene.patch_count.into();
    recorder.in_shares("sample", total, FIRST_PATCHES, |r, done, most| {
        let patches = most.min(sample::BATCH.into()) as u32;
        r.pass("sample", |r| {
            sample.record(r, scene, done as u32, patches);
            r.barrier(Access::COMPUTE_WRITE, Access::COMPUTE_READ);
        })?;
        Ok(patches.into())
    })
}

/// Texels of the light maps that are cleared by one submission: 40 ms on two CPU cores.
const BAND: u32 = 1 << 22;

/// Fills the light maps with zeros, each of `bands` in a submission of its own where there are several.
fn record_clear(
    recorder: &mut Recorder,
    light_map: &Image,
    bands: impl ExactSizeIterator<Item = Range<u32>>,
) -> Result<()> {
    let is_split = bands.len() > 1;
    for rows in bands {
        recorder.pass("clear", |r| {
            r.clear(light_map, rows);
            r.barrier(Access::BLEND, Access::BLEND.and(Access::COMPUTE));
        })?;
        if is_split {
            recorder.submit()?;
        }
    }
    Ok(())
}

/// Adds the coarser levels to the finer ones, in steps of so many rows that each may be a submission of its own.
fn record_resolve(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    resolve: &Resolve,
    listed: &Listed,
) -> Result<()> {
    let [_, height] = scene.largest_light_map();
    let is_split = height + 2 > listed.rows;
    for level in (0..COARSEST).rev() {
        // With one texel more all around than the level has.
        let rows = ((height - 1) >> level) + 3;
        for first_row in (0..rows).step_by(listed.rows as usize) {
            recorder.pass("resolve", |r| resolve.record(r, listed, level, first_row))?;
            if is_split {
                recorder.submit()?;
            }
        }
    }
    Ok(())
}

/// Names of the work on kernels: what a pair costs differs between suns and the sky.
fn kernels(is_sky: bool) -> &'static str {
    if is_sky {
        "kernels of the sky"
    } else {
        "kernels"
    }
}

fn kernels_on_meshes(is_sky: bool) -> &'static str {
    if is_sky {
        "kernels of the sky on meshes"
    } else {
        "kernels on meshes"
    }
}

/// Patches as triangles.
fn record_beams(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    beams: &Beams,
    light_map: &Image,
    clear: &mut bool,
) -> Result<()> {
    for class in scene.lights(true) {
        record_pairs(
            recorder,
            scene,
            ("triangles", &beams.listed, class),
            clear,
            |r, batch| beams.record_map(r, scene, batch),
            |r, clear| beams.record_draw(r, light_map, clear),
        )?;
    }
    Ok(())
}

/// What the pairs of a class throw, listed in their order and added to the light map, in as many batches as
/// there is room and time for. Only the first batch of a frame has to `clear` the light map.
fn record_pairs(
    recorder: &mut Recorder,
    scene: &DeviceScene,
    (work, listed, class): (&'static str, &Listed, Class),
    clear: &mut bool,
    project: impl Fn(&mut Recorder, Batch),
    splat: impl Fn(&mut Recorder, bool),
) -> Result<()> {
    let reads = Access::VERTEX_READ
        .and(Access::INDEX_READ)
        .and(Access::INDIRECT_READ);
    recorder.in_shares(work, class.pairs(), scene.first_pairs(), |r, done, most| {
        let batch = Batch {
            class,
            first_pair: done as u32,
            pair_count: most.min(listed.batch.into()) as u32,
        };
        r.pass("project", |r| {
            project(r, batch);
            r.barrier(Access::COMPUTE_WRITE, Access::COMPUTE_READ);
        })?;
        r.pass("compact", |r| {
            listed.record(r, batch.pair_count);
            r.barrier(Access::COMPUTE_WRITE, reads);
        })?;
        r.pass("splat", |r| {
            splat(r, *clear);
            // The next batch overwrites what this one reads, and adds to its texels.
            r.barrier(
                Access::BLEND.and(reads).and(Access::FRAGMENT_READ),
                Access::BLEND.and(Access::COMPUTE),
            );
        })?;
        *clear = false;
        Ok(batch.pair_count.into())
    })
}

fn read(image: &Image, origin: [u32; 2], size: [u32; 2]) -> Result<RgbImage> {
    let pixels = image
        .read(origin, size)?
        .iter()
        .map(|&[r, g, b, _]| [r, g, b])
        .collect();
    Ok(RgbImage {
        width: size[0],
        height: size[1],
        pixels,
    })
}
