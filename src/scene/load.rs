//! Scene files: TOML, format version 1.
//!
//! Right-handed, y up; metres, W/m², W/m²/sr, and degrees, which become radians. Unknown keys are
//! errors. `assets/scenes` has examples.
//!
//! | table | keys |
//! |---|---|
//! | | `version = 1`, `max_interfaces` (16): specular surfaces on the way of light to a receiver |
//! | `[camera]` | `position`, `target`, `fov_degrees` (vertical), `exposure_ev` (0) |
//! | `[[light]]` of `kind = "sun"` | `name`, `direction` (toward the light, any length), `irradiance` (on a plane facing it), `angular_radius_degrees` (0: a point) |
//! | `[[light]]` of `kind = "lamp"` | `name`, `position`, `radius`, `flux` (W; of a sphere that shines evenly) |
//! | `[[light]]` of `kind = "environment"` | `name`, `file` (.hdr or .exr, equirectangular), `scale` (1), `rotation_degrees` (0), `caustics` (true: specular surfaces send its light on) |
//! | `[[material]]` of `kind = "mirror"` | `name`, `reflectance` |
//! | `[[material]]` of `kind = "conductor"` | `name`, `metal` (one of [`METALS`]), or `index` and `extinction` |
//! | `[[material]]` of `kind = "dielectric"` | `name`, `ior` (of what is behind the front, relative to air: a number, one of [`GLASSES`](super::GLASSES), three numbers for 650, 550 and 450 nm, `{ cauchy = [A, B, C] }`, or `{ sellmeier = [[b, c], …] }`, with λ in µm), `dispersion` (whether the index depends on the wavelength; true for the last three, else false), `absorption` (0, 1/m), `priority` (0: where bodies overlap, the highest is there), `thin` (false: a sheet without thickness) |
//! | `[[material]]` of `kind = "diffuse"` | `name`, `albedo` (white where there is a map), `albedo_map` (.png or .jpg in sRGB, whose colours are factors on `albedo`), `uv_scale` (\[1, 1\]: how often the map repeats within a unit of texture coordinates) |
//! | `[[object]]` | `name`, `mesh` (.obj), `frames = { folder, fps }` (.obj files, 24 a second), `rect = { origin, edge_u, edge_v }` or `waves = { origin, edge_u, edge_v, quads, sines }`, `material`, `lightmap = [width, height]` or `"auto"` (of a diffuse rect or mesh), `blocks_light` (true), `motion = { pivot, axis, keyframes }` |
//!
//! The camera and lights may have `keyframes`, a list of tables with `time` (s) and of the camera's
//! keys any, of a sun's `direction` and `irradiance`, of a lamp's `position` and `flux`, of
//! an environment's `scale` and `rotation_degrees`. A key that a keyframe has, all have, and the table beside them does not. An
//! object's keyframes have `time`, `translation` (0), `angle_degrees` (0) and `scale` (1): it is
//! scaled and turned about `pivot` (0) and `axis`, then moved. Times rise. Between keyframes values
//! are linear, directions on a great circle; before the first and after the last they are held.
//!
//! The files of `frames` follow each other in the order of their names, the first at time 0, have
//! one topology, and are mixed linearly.
//!
//! Each of `sines` has `amplitude` (m), `wave_vector` (rad/m along edge_u and edge_v),
//! `phase_degrees` (0) and `speed` (0, rad/s); see [`Sine`].
//!
//! In brackets what holds where a key is left out. A mesh without `material` is cut up by the
//! materials of its MTL file: each becomes a material and an object named `object/material`.
//!
//! An albedo map lies on the texture coordinates of a mesh (`vt`), and on a rect or waves once along `edge_u` and
//! `edge_v`, its lower left corner at `origin`. It repeats. Of MTL files, `map_Kd` with its option `-s` is read; a map that cannot be
//! used is left out with a warning.
//!
//! File names are relative to the scene file (MTL files: to the OBJ file) and may not leave the
//! asset root: the nearest folder above the scene file named `assets`, otherwise the scene file's
//! own folder.

use super::animation::{MeshFrames, Motion, MovingObject};
use super::asset::AssetRoot;
use super::atlas::Atlas;
use super::file::{
    CameraEntry, FramesEntry, LightEntry, LightMapEntry, METRES, MaterialEntry, ObjectEntry,
    Section, SineEntry, Source, Triple, WavesEntry,
};
pub use super::materials::METALS;
use super::materials::{self, Textures};
use super::{
    AlbedoMap, Animation, Camera, DEFAULT_MAX_INTERFACES, EXPOSURES_EV, EnvironmentMap, Geometry,
    Light, LightKind, MAX_RADIANCE, Material, Object, Rect, Scene, Sine, Unwrapping, Waves,
};
use super::{environment, keyframes, light_map_side, memory, mesh, obj, skin};
use crate::error::Result;
use crate::input::{self, refused};
use glam::{DVec2, DVec3};
use std::collections::{HashMap, HashSet};
use std::f64::consts::{FRAC_PI_2, PI};
use std::ops::{Range, RangeInclusive};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toml::Spanned;

/// Longer side of a light map of the size "auto" before its size is chosen, texels.
const NOMINAL_SIDE: u32 = 256;
/// Quads of waves along a side, and in all.
const MAX_QUADS: i64 = 4096;
const MAX_ALL_QUADS: i64 = 1 << 22;
/// Sines of waves.
const MAX_SINES: usize = 1000;
/// Maximum slope of a sum of sines: beyond it, a wave's crest would hide its back at 45°.
const MAX_SLOPE: f64 = 1.0;
/// Largest [`Scene::max_interfaces`].
const MAX_INTERFACES: u32 = 64;
/// Meshes a second.
const FPS: RangeInclusive<f64> = 1e-3..=1e4;
const DEFAULT_FPS: f64 = 24.0;
/// Radius of a lamp, m.
const LAMP_RADIUS: RangeInclusive<f64> = 1e-6..=1e9;

/// A scene that is fit to be rendered.
#[derive(Debug)]
pub struct Loaded {
    /// At time 0.
    pub scene: Scene,
    /// At every time.
    pub animation: Animation,
    /// What was odd and has been repaired or left out, a sentence each.
    pub warnings: Vec<String>,
    /// The meshes, material libraries and images that the scene file names.
    pub files: Vec<PathBuf>,
}

/// Reads a scene file and the files that it names.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) that names file, line and column.
pub fn load(path: &Path) -> Result<Loaded> {
    let text = input::read_text(path)?;
    let source = Source { path, text: &text };
    let entry = source.parse()?;
    let mut loader = Loader {
        source: &source,
        root: AssetRoot::of(path)?,
        names: HashSet::new(),
        materials: Vec::new(),
        objects: Vec::new(),
        auto_light_maps: Vec::new(),
        environments: HashMap::new(),
        textures: Textures::default(),
        warnings: Vec::new(),
    };
    let section = Section {
        source: &source,
        owner: "camera".into(),
        span: entry.camera.span(),
    };
    let camera = keyframes::camera(&section, entry.camera.get_ref(), camera)?;
    let max_interfaces = match &entry.max_interfaces {
        None => DEFAULT_MAX_INTERFACES,
        Some(number) => interfaces(number.get_ref()).ok_or_else(|| {
            let reason = format!("max_interfaces is {}", number.get_ref());
            let remedy = format!("use a number from 1 to {MAX_INTERFACES}");
            source.error(number.span(), &reason, &remedy)
        })?,
    };
    let mut lights = Vec::new();
    for light in &entry.light {
        let section = loader.section("light", &light.name)?;
        let read = |section: &Section, table: &LightEntry| loader.light(section, table);
        lights.push(keyframes::light(&section, light, read)?);
    }
    for material in &entry.material {
        loader.material(material)?;
    }
    for object in &entry.object {
        loader.object(object)?;
    }
    let animation = Animation {
        camera,
        lights,
        materials: std::mem::take(&mut loader.materials),
        objects: std::mem::take(&mut loader.objects),
        auto_light_maps: std::mem::take(&mut loader.auto_light_maps),
        max_interfaces,
        textures: std::mem::take(&mut loader.textures).all,
    };
    let scene = animation.at(0.0);
    for (entry, light) in entry.light.iter().zip(&scene.lights) {
        loader.check_lamp_is_free(entry, light, &scene)?;
    }
    let mut warnings = loader.warnings;
    let flaws = skin::complaints(&scene).into_iter();
    warnings.extend(flaws.map(|flaw| format!("{}: {flaw}", path.display())));
    if scene.objects.is_empty() {
        let remedy = "add an `[[object]]` with a `mesh` or a `rect`";
        return Err(refused(path, "the scene has no object", remedy));
    }
    if scene.lights.is_empty() {
        warnings.push(format!(
            "{}: without a `[[light]]` the picture is black",
            path.display()
        ));
    }
    Ok(Loaded {
        scene,
        animation,
        warnings,
        files: loader.root.files(),
    })
}

/// A scene in the making.
struct Loader<'a> {
    source: &'a Source<'a>,
    root: AssetRoot,
    /// (kind of thing, name) of everything so far.
    names: HashSet<(&'static str, String)>,
    materials: Vec<Material>,
    objects: Vec<MovingObject>,
    auto_light_maps: Vec<usize>,
    /// Read so far: keyframes of a light share its image.
    environments: HashMap<PathBuf, Arc<EnvironmentMap>>,
    textures: Textures,
    warnings: Vec<String>,
}

impl<'a> Loader<'a> {
    fn light(&mut self, section: &Section, entry: &LightEntry) -> Result<Light> {
        let no_sun = |kind| {
            section.refuse(kind, "direction", &entry.direction)?;
            section.refuse(kind, "irradiance", &entry.irradiance)?;
            let radius = &entry.angular_radius_degrees;
            section.refuse(kind, "angular_radius_degrees", radius)
        };
        let no_lamp = |kind| {
            section.refuse(kind, "position", &entry.position)?;
            section.refuse(kind, "radius", &entry.radius)?;
            section.refuse(kind, "flux", &entry.flux)
        };
        let no_environment = |kind| {
            section.refuse(kind, "file", &entry.file)?;
            section.refuse(kind, "scale", &entry.scale)?;
            section.refuse(kind, "rotation_degrees", &entry.rotation_degrees)?;
            section.refuse(kind, "caustics", &entry.caustics)
        };
        let kind = match entry.kind.get_ref().as_str() {
            kind @ "sun" => {
                no_lamp(kind)?;
                no_environment(kind)?;
                let direction = section.triple("direction", &entry.direction, METRES)?;
                let radius = &entry.angular_radius_degrees;
                let radius = section.number("angular_radius_degrees", radius, 0.0..=89.999)?;
                LightKind::Sun {
                    direction: mesh::unit(direction).ok_or_else(|| {
                        let remedy = "name a vector from the scene toward the light";
                        let place = section.at(&entry.direction);
                        section.error(place, "direction has no length", remedy)
                    })?,
                    irradiance: section.triple("irradiance", &entry.irradiance, 0.0..=1e9)?,
                    angular_radius: radius.to_radians(),
                }
            }
            kind @ "lamp" => {
                no_sun(kind)?;
                no_environment(kind)?;
                let position = section.triple("position", &entry.position, METRES)?;
                let radius = section.number("radius", &entry.radius, LAMP_RADIUS)?;
                let radiant_flux = section.triple("flux", &entry.flux, 0.0..=1e30)?;
                let radiance = radiant_flux.max_element() / (2.0 * PI * radius).powi(2);
                if radiance > f64::from(MAX_RADIANCE) {
                    let reason =
                        format!("its radiance is {radiance:e}, more than {MAX_RADIANCE:e} W/m²/sr");
                    let remedy = "lower the flux, or raise the radius";
                    return Err(section.error(section.at(&entry.flux), &reason, remedy));
                }
                LightKind::Lamp {
                    position,
                    radius,
                    radiant_flux,
                }
            }
            kind @ "environment" => {
                no_sun(kind)?;
                no_lamp(kind)?;
                let scale = section.number_or(1.0, "scale", &entry.scale, 0.0..=1e9)?;
                let angle = &entry.rotation_degrees;
                let rotation = section.number_or(0.0, "rotation_degrees", angle, -1e6..=1e6)?;
                let path = self.resolve(section, section.required("file", &entry.file)?)?;
                let map = self.environment(path)?;
                let brightest =
                    (map.radiance.as_flattened().iter()).fold(0.0, |a: f32, b| a.max(*b));
                if f64::from(brightest) * scale > f64::from(MAX_RADIANCE) {
                    let reason = format!(
                        "the image's brightest value {brightest:e} times scale {scale} is more than {MAX_RADIANCE:e} W/m²/sr"
                    );
                    let remedy = "lower the scale, or darken the image";
                    return Err(section.error(section.at(&entry.scale), &reason, remedy));
                }
                LightKind::Environment {
                    map,
                    scale,
                    rotation: rotation.to_radians(),
                    casts_caustics: entry.caustics.as_ref().is_none_or(|value| *value.get_ref()),
                }
            }
            other => {
                let reason = format!("there is no kind `{other}`");
                let remedy = "use `sun`, `lamp` or `environment`";
                return Err(section.error(entry.kind.span(), &reason, remedy));
            }
        };
        Ok(Light {
            name: entry.name.get_ref().clone(),
            kind,
        })
    }

    fn environment(&mut self, path: PathBuf) -> Result<Arc<EnvironmentMap>> {
        if let Some(map) = self.environments.get(&path) {
            return Ok(map.clone());
        }
        let map = Arc::new(environment::read(&path, &mut self.warnings)?);
        self.environments.insert(path, map.clone());
        Ok(map)
    }

    /// Nothing reaches into a lamp: there it would be in the dark, or the whole picture would shine.
    fn check_lamp_is_free(&self, entry: &LightEntry, light: &Light, scene: &Scene) -> Result<()> {
        let LightKind::Lamp {
            position, radius, ..
        } = light.kind
        else {
            return Ok(());
        };
        let distances = (scene.objects.iter())
            .map(|object| {
                let owner = format!("object \"{}\"", object.name.escape_debug());
                (owner, object.geometry.mesh().distance_to(position))
            })
            .chain([(
                "the camera".into(),
                scene.camera.position.distance(position),
            )]);
        for (owner, distance) in distances {
            if distance <= radius {
                let section = self.owner("light", &light.name, entry.name.span());
                let reason = format!(
                    "{owner} reaches into the lamp, to {distance} m from the middle of a radius of {radius} m"
                );
                let remedy = "move one of them, or lower the radius";
                return Err(section.error(section.at(&entry.position), &reason, remedy));
            }
        }
        Ok(())
    }

    fn material(&mut self, entry: &MaterialEntry) -> Result<()> {
        let section = self.section("material", &entry.name)?;
        let albedo_map = self.albedo_map(&section, entry)?;
        let kind = materials::kind(&section, entry, albedo_map.is_some())?;
        self.materials.push(Material {
            name: entry.name.get_ref().clone(),
            kind,
            albedo_map,
        });
        Ok(())
    }

    fn albedo_map(
        &mut self,
        section: &Section,
        entry: &MaterialEntry,
    ) -> Result<Option<AlbedoMap>> {
        let Some(file) = &entry.albedo_map else {
            return match &entry.uv_scale {
                None => Ok(None),
                Some(scale) => {
                    let reason = "the key `uv_scale` is given without an `albedo_map`";
                    Err(section.error(scale.span(), reason, "add the map, or remove the key"))
                }
            };
        };
        let uv_scale = materials::uv_scale(section, entry)?;
        let path = self.resolve(section, file)?;
        let texture = self.textures.read(path, &mut self.warnings)?;
        Ok(Some(AlbedoMap { texture, uv_scale }))
    }

    /// The texture coordinates of a mesh, where its material has an albedo map.
    ///
    /// # Errors
    /// The reason why they cannot be used.
    fn uvs_for_map(
        &self,
        material: usize,
        uvs: &[[DVec2; 3]],
    ) -> Result<Option<Arc<Vec<[DVec2; 3]>>>, String> {
        (self.materials[material].albedo_map)
            .map(|_| materials::uvs_for_map(uvs))
            .transpose()
    }

    fn object(&mut self, entry: &ObjectEntry) -> Result<()> {
        let first = self.objects.len();
        self.shape(entry)?;
        if let Some(LightMapEntry::Auto) = entry.lightmap.as_ref().map(Spanned::get_ref) {
            let has_map = |&index: &usize| self.objects[index].object.light_map.is_some();
            self.auto_light_maps
                .extend((first..self.objects.len()).filter(has_map));
        }
        Ok(())
    }

    fn shape(&mut self, entry: &ObjectEntry) -> Result<()> {
        let section = self.section("object", &entry.name)?;
        let material = (entry.material.as_ref())
            .map(|name| self.material_index(&section, name))
            .transpose()?;
        let mut light_map = (entry.lightmap.as_ref())
            .map(|texels| self.light_map(&section, entry, texels, material))
            .transpose()?;
        let is_auto = (entry.lightmap.as_ref())
            .is_some_and(|texels| matches!(texels.get_ref(), LightMapEntry::Auto));
        let motion = (entry.motion.as_ref())
            .map(|motion| keyframes::motion(&section, motion))
            .transpose()?;
        let geometry = match (&entry.mesh, &entry.frames, &entry.rect, &entry.waves) {
            (Some(file), None, None, None) => {
                let path = self.resolve(&section, file)?;
                return self.meshes(entry, &[path], None, material, light_map, motion);
            }
            (None, Some(frames), None, None) => {
                let paths = self.frame_paths(&section, frames)?;
                let fps = &frames.get_ref().fps;
                let fps = section.number_or(DEFAULT_FPS, "fps", fps, FPS)?;
                return self.meshes(entry, &paths, Some(fps), material, light_map, motion);
            }
            (None, None, Some(entry), None) => {
                let keys = entry.get_ref();
                let edges = [&keys.origin, &keys.edge_u, &keys.edge_v];
                let rect = rect(&section, entry.span(), edges)?;
                if is_auto {
                    light_map = Some(nominal_size(&rect));
                }
                Geometry::Rect(rect)
            }
            (None, None, None, Some(entry)) => {
                let waves = waves(&section, entry)?;
                self.warn_of_coarse_waves(&section.owner, &waves);
                Geometry::Waves(waves)
            }
            shapes => {
                let reason = match shapes {
                    (None, None, None, None) => "it has no `mesh`, `frames`, `rect` or `waves`",
                    _ => "it has more than one of `mesh`, `frames`, `rect` and `waves`",
                };
                return Err(section.error(section.span.clone(), reason, "give it one of them"));
            }
        };
        self.objects.push(MovingObject {
            object: Object {
                light_map,
                blocks_light: entry.blocks_light.unwrap_or(true),
                ..Object::new(
                    entry.name.get_ref(),
                    *section.required("material", &material)?,
                    geometry,
                )
            },
            frames: None,
            motion,
        });
        Ok(())
    }

    /// Warns of sines that have fewer than four quads in a wavelength.
    fn warn_of_coarse_waves(&mut self, owner: &str, waves: &Waves) {
        let extent = DVec2::new(waves.rect.edge_u.length(), waves.rect.edge_v.length());
        let quad = extent / DVec2::from(waves.quads.map(f64::from));
        let coarse = |sine: &&Sine| (sine.wave_vector * quad).abs().max_element() > FRAC_PI_2;
        let count = waves.sines.iter().filter(coarse).count();
        if count > 0 {
            self.warnings.push(format!(
                "{}: {owner}: {count} of its sines have fewer than four quads in a wavelength",
                self.source.path.display()
            ));
        }
    }

    /// Adds the parts of a mesh, or of one that has several frames, `fps` a second; `material`
    /// holds for all of it.
    fn meshes(
        &mut self,
        entry: &ObjectEntry,
        paths: &[PathBuf],
        fps: Option<f64>,
        material: Option<usize>,
        light_map: Option<[u32; 2]>,
        motion: Option<Motion>,
    ) -> Result<()> {
        let first = self.objects.len();
        let use_mtl = material.is_none();
        let parts = match fps {
            None => obj::read(&paths[0], &self.root, use_mtl, &mut self.warnings)?,
            Some(_) => obj::read_frames(paths, &self.root, use_mtl, &mut self.warnings)?,
        };
        for part in parts {
            let mut name = entry.name.get_ref().clone();
            let material = match part.material {
                Some(obj::MaterialOfPart {
                    name: of_part,
                    kind,
                    map,
                }) => {
                    name = format!("{name}/{of_part}");
                    let spanned = Spanned::new(entry.name.span(), name.clone());
                    self.section("object", &spanned)?;
                    self.section("material", &spanned)?;
                    let albedo_map =
                        map.and_then(|map| self.textures.of_mtl(map, &mut self.warnings));
                    self.materials.push(Material {
                        name: name.clone(),
                        kind,
                        albedo_map,
                    });
                    self.materials.len() - 1
                }
                None => material.expect("without `material`, parts have their own"),
            };
            let uvs = match self.uvs_for_map(material, &part.uvs) {
                Ok(uvs) => uvs,
                // Of an MTL file.
                Err(reason) if use_mtl => {
                    let file = self.source.path.display();
                    self.warnings.push(format!(
                        "{file}: object \"{}\": {reason}; its map is left out",
                        name.escape_debug()
                    ));
                    self.materials[material].albedo_map = None;
                    None
                }
                Err(reason) => {
                    let section = self.owner("object", &name, entry.name.span());
                    let of = &self.materials[material].name;
                    let reason =
                        format!("{reason}, which the `albedo_map` of material `{of}` needs");
                    let remedy =
                        "export the mesh with texture coordinates, or use a material without a map";
                    return Err(section.error(section.at(&entry.material), &reason, remedy));
                }
            };
            let meshes: Vec<_> = part.meshes.into_iter().map(Arc::new).collect();
            // Of the parts of a mesh that has several materials, the diffuse ones.
            let light_map = light_map.filter(|_| !self.materials[material].kind.is_specular());
            let unwrapping = light_map.map(|_| {
                Arc::new(Unwrapping {
                    rest: meshes[0].clone(),
                    own: part.uvs,
                })
            });
            self.objects.push(MovingObject {
                object: Object {
                    name,
                    material,
                    geometry: Geometry::Mesh(meshes[0].clone()),
                    light_map,
                    unwrapping,
                    uvs,
                    blocks_light: entry.blocks_light.unwrap_or(true),
                },
                frames: fps.map(|fps| MeshFrames { fps, meshes }),
                motion: motion.clone(),
            });
        }
        if let Some(texels) = &entry.lightmap {
            self.check_layouts(entry, texels.span(), first)?;
        }
        Ok(())
    }

    /// The light maps of the meshes from object number `first` on can be laid out.
    fn check_layouts(
        &mut self,
        entry: &ObjectEntry,
        place: Range<usize>,
        first: usize,
    ) -> Result<()> {
        let section = self.owner("object", entry.name.get_ref(), entry.name.span());
        let mut any = false;
        for moving in &self.objects[first..] {
            let Some(size) = moving.object.light_map else {
                continue;
            };
            any = true;
            let (_, warning) = Atlas::of(&moving.object, size)
                .map_err(|e| section.error(place.clone(), &e.reason, &e.remedy))?;
            let file = self.source.path.display();
            self.warnings
                .extend(warning.map(|warning| format!("{file}: {warning}")));
        }
        if !any {
            let reason = "none of the mesh's materials is diffuse, so it keeps no light";
            return Err(section.error(place, reason, "remove `lightmap`"));
        }
        Ok(())
    }

    /// The OBJ files of a folder in the order of their names.
    fn frame_paths(
        &self,
        section: &Section,
        frames: &Spanned<FramesEntry>,
    ) -> Result<Vec<PathBuf>> {
        let section = Section {
            span: frames.span(),
            ..section.clone()
        };
        let folder = section.required("folder", &frames.get_ref().folder)?;
        (self
            .root
            .resolve_folder(self.source.path, folder.get_ref(), "obj"))
        .map_err(|reason| {
            let remedy =
                "name a folder of .obj files under the asset root, relative to the scene file";
            section.error(folder.span(), &reason, remedy)
        })
    }

    fn light_map(
        &self,
        section: &Section,
        entry: &ObjectEntry,
        texels: &Spanned<LightMapEntry>,
        material: Option<usize>,
    ) -> Result<[u32; 2]> {
        let error = |reason: &str, remedy: &str| Err(section.error(texels.span(), reason, remedy));
        if entry.waves.is_some() {
            let remedy = "remove `lightmap`, or export the waves as a mesh";
            return error("waves have no light map, only rects and meshes do", remedy);
        }
        if material.is_some_and(|m| self.materials[m].kind.is_specular()) {
            let remedy = "remove `lightmap`, or use a diffuse material";
            return error(
                "a specular surface keeps no light, so it has no light map",
                remedy,
            );
        }
        let LightMapEntry::Texels(sides) = texels.get_ref() else {
            return Ok([NOMINAL_SIDE; 2]);
        };
        match sides.map(light_map_side) {
            [Ok(width), Ok(height)] => Ok([width, height]),
            [Err(reason), _] | [_, Err(reason)] => error(&reason, "correct the size"),
        }
    }

    fn material_index(&self, section: &Section, name: &Spanned<String>) -> Result<usize> {
        let wanted = name.get_ref();
        (self
            .materials
            .iter()
            .position(|material| material.name == *wanted))
        .ok_or_else(|| {
            let reason = format!("there is no material `{wanted}`");
            let remedy = "add a `[[material]]` of that name, or correct the name";
            section.error(name.span(), &reason, remedy)
        })
    }

    /// Path of a file that the scene names.
    fn resolve(&self, section: &Section, file: &Spanned<String>) -> Result<PathBuf> {
        (self.root.resolve(self.source.path, file.get_ref())).map_err(|reason| {
            let remedy = "name a file under the asset root, relative to the scene file";
            section.error(file.span(), &reason, remedy)
        })
    }

    /// The keys of a thing of this name, which stands at `span`.
    fn owner(&self, thing: &str, name: &str, span: Range<usize>) -> Section<'a> {
        Section {
            source: self.source,
            owner: format!("{thing} \"{}\"", name.escape_debug()),
            span,
        }
    }

    /// Takes a name of its own for a thing.
    fn section(&mut self, thing: &'static str, name: &Spanned<String>) -> Result<Section<'a>> {
        let (span, name) = (name.span(), name.get_ref());
        let section = self.owner(thing, name, span);
        let error =
            |reason| Err(section.error(section.span.clone(), reason, "give it another name"));
        if name.trim().is_empty() || name.chars().any(char::is_control) {
            return error("the name is empty or has control characters");
        }
        if !self.names.insert((thing, name.clone())) {
            return error("the name is used twice");
        }
        Ok(section)
    }
}

fn camera(section: &Section, entry: &CameraEntry) -> Result<Camera> {
    let position = section.triple("position", &entry.position, METRES)?;
    let target = section.triple("target", &entry.target, METRES)?;
    let Some(view) = mesh::unit(target - position) else {
        let reason = "position and target are the same point";
        return Err(section.error(section.span.clone(), reason, "move one of them"));
    };
    if view.cross(DVec3::Y).length() < 1e-6 {
        let reason = "it looks straight along the y axis, so that up is undefined";
        let remedy = "move position or target a little sideways";
        return Err(section.error(section.span.clone(), reason, remedy));
    }
    let fov = section.number("fov_degrees", &entry.fov_degrees, 0.001..=179.999)?;
    let exposure_ev = section.number_or(0.0, "exposure_ev", &entry.exposure_ev, EXPOSURES_EV)?;
    Ok(Camera {
        position,
        target,
        fov: fov.to_radians(),
        exposure_ev,
    })
}

/// A number of interfaces that light may meet.
fn interfaces(number: &i64) -> Option<u32> {
    (u32::try_from(*number).ok()).filter(|number| (1..=MAX_INTERFACES).contains(number))
}

fn waves(section: &Section, entry: &Spanned<WavesEntry>) -> Result<Waves> {
    let keys = entry.get_ref();
    let edges = [&keys.origin, &keys.edge_u, &keys.edge_v];
    let rect = rect(section, entry.span(), edges)?;
    let quads = section.required("quads", &keys.quads)?;
    if let Some(count) = (quads.get_ref().iter()).find(|count| !(1..=MAX_QUADS).contains(*count)) {
        let reason = format!("quads: waves have 1 to {MAX_QUADS} quads a side, not {count}");
        return Err(section.error(quads.span(), &reason, "correct the number"));
    }
    let [columns, rows] = *quads.get_ref();
    if columns * rows > MAX_ALL_QUADS {
        let reason = format!("quads: {columns} × {rows} are more than {MAX_ALL_QUADS}");
        return Err(section.error(quads.span(), &reason, "lower one of the numbers"));
    }
    let triangles = 2 * (columns * rows) as u64;
    memory::check(
        &format!("{triangles} triangles"),
        triangles * memory::TRIANGLE,
    )
    .map_err(|reason| section.error(quads.span(), &reason, "lower the numbers"))?;
    if keys.sines.len() > MAX_SINES {
        let reason = format!("sines: {} are more than {MAX_SINES}", keys.sines.len());
        return Err(section.error(entry.span(), &reason, "leave the smallest ones out"));
    }
    let sines: Result<Vec<Sine>> = keys.sines.iter().map(|s| sine(section, s)).collect();
    let sines = sines?;
    let slope: f64 = (sines.iter())
        .map(|sine| sine.amplitude.abs() * sine.wave_vector.length())
        .sum();
    if slope > MAX_SLOPE {
        let reason = format!("the waves are too steep: their slope reaches {slope:.3}");
        let remedy = format!("keep the sum of amplitude × |wave_vector| at {MAX_SLOPE} or below");
        return Err(section.error(entry.span(), &reason, &remedy));
    }
    Ok(Waves {
        rect,
        quads: quads.get_ref().map(|count| count as u32),
        sines,
        time: 0.0,
    })
}

fn sine(section: &Section, entry: &Spanned<SineEntry>) -> Result<Sine> {
    let keys = entry.get_ref();
    let section = Section {
        span: entry.span(),
        ..section.clone()
    };
    let vector = section.required("wave_vector", &keys.wave_vector)?;
    section.check("wave_vector", vector.get_ref(), vector.span(), -1e6..=1e6)?;
    let phase = section.number_or(0.0, "phase_degrees", &keys.phase_degrees, -1e6..=1e6)?;
    Ok(Sine {
        amplitude: section.number("amplitude", &keys.amplitude, -1e6..=1e6)?,
        wave_vector: DVec2::from(*vector.get_ref()),
        phase: phase.to_radians(),
        speed: section.number_or(0.0, "speed", &keys.speed, -1e6..=1e6)?,
    })
}

fn rect(
    section: &Section,
    span: Range<usize>,
    [origin, edge_u, edge_v]: [&Option<Triple>; 3],
) -> Result<Rect> {
    let origin = section.triple("origin", origin, METRES)?;
    let edge_u = section.triple("edge_u", edge_u, METRES)?;
    let edge_v = section.triple("edge_v", edge_v, METRES)?;
    let error = |reason: &str, remedy: &str| Err(section.error(span.clone(), reason, remedy));
    let (Some(along_u), Some(along_v)) = (mesh::unit(edge_u), mesh::unit(edge_v)) else {
        return error(
            "an edge of the rect has no length",
            "give it a width and a height",
        );
    };
    if along_u.dot(along_v).abs() > 1e-6 {
        return error(
            "edge_u and edge_v are not perpendicular",
            "turn one of them, or use a mesh",
        );
    }
    Ok(Rect {
        origin,
        edge_u,
        edge_v,
    })
}

/// The size of a light map before one is chosen: square texels.
fn nominal_size(rect: &Rect) -> [u32; 2] {
    let edges = [rect.edge_u, rect.edge_v].map(DVec3::length);
    let longer = edges[0].max(edges[1]);
    edges.map(|edge| ((f64::from(NOMINAL_SIDE) * edge / longer).round() as u32).max(1))
}
