//! Scene files: TOML, format version 1.
//!
//! Right-handed, y up; metres, W/m², W/m²/sr, and degrees, which become radians. Unknown keys are
//! errors. `assets/scenes` has examples.
//!
//! | table | keys |
//! |---|---|
//! | | `version = 1` |
//! | `[camera]` | `position`, `target`, `fov_degrees` (vertical), `exposure_ev` (0) |
//! | `[[light]]` of `kind = "sun"` | `name`, `direction` (toward the light, any length), `irradiance` (on a plane facing it), `angular_radius_degrees` (0: a point) |
//! | `[[light]]` of `kind = "environment"` | `name`, `file` (.hdr or .exr, equirectangular), `scale` (1), `rotation_degrees` (0) |
//! | `[[material]]` of `kind = "mirror"` | `name`, `reflectance` |
//! | `[[material]]` of `kind = "diffuse"` | `name`, `albedo` |
//! | `[[object]]` | `name`, `mesh` (.obj) or `rect = { origin, edge_u, edge_v }`, `material`, `lightmap = [width, height]` (a diffuse rect's), `blocks_light` (true) |
//!
//! In brackets what holds where a key is left out. A mesh without `material` is cut up by the
//! materials of its MTL file: each becomes a material and an object named `object/material`.
//!
//! File names are relative to the scene file (MTL files: to the OBJ file) and may not leave the
//! asset root: the nearest folder above the scene file named `assets`, otherwise the scene file's
//! own folder.

use super::asset::{self, AssetRoot, refused};
use super::file::{
    CameraEntry, LightEntry, MaterialEntry, ObjectEntry, RectEntry, Section, Source,
};
use super::{
    Camera, Geometry, Light, LightKind, MAX_RADIANCE, Material, MaterialKind, Object, Rect, Scene,
};
use super::{environment, light_map_side, mesh, obj};
use crate::error::Result;
use glam::DVec3;
use std::collections::HashSet;
use std::ops::{Range, RangeInclusive};
use std::path::{Path, PathBuf};
use std::sync::Arc;
use toml::Spanned;

/// Bytes of a scene file.
const MAX_BYTES: u64 = 16 << 20;
/// Coordinates, m.
const METRES: RangeInclusive<f64> = -1e9..=1e9;

/// A scene that is fit to be rendered.
#[derive(Debug)]
pub struct Loaded {
    pub scene: Scene,
    /// What was odd and has been repaired or left out, a sentence each.
    pub warnings: Vec<String>,
}

/// Reads a scene file and the files that it names.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) that names file, line and column.
pub fn load(path: &Path) -> Result<Loaded> {
    let content = asset::read(path, MAX_BYTES)?;
    let text = String::from_utf8(content).map_err(|e| {
        refused(
            path,
            &format!("not UTF-8 text: {e}"),
            "name a scene file in TOML",
        )
    })?;
    let source = Source { path, text: &text };
    let entry = source.parse()?;
    let mut loader = Loader {
        source: &source,
        root: AssetRoot::of(path)?,
        names: HashSet::new(),
        materials: Vec::new(),
        objects: Vec::new(),
        warnings: Vec::new(),
    };
    let camera = loader.camera(&entry.camera)?;
    let lights: Result<Vec<Light>> = (entry.light.iter())
        .map(|light| loader.light(light))
        .collect();
    let lights = lights?;
    for material in &entry.material {
        loader.material(material)?;
    }
    for object in &entry.object {
        loader.object(object)?;
    }
    let Loader {
        materials,
        objects,
        mut warnings,
        ..
    } = loader;
    if objects.is_empty() {
        let remedy = "add an `[[object]]` with a `mesh` or a `rect`";
        return Err(refused(path, "the scene has no object", remedy));
    }
    if lights.is_empty() {
        warnings.push(format!(
            "{}: without a `[[light]]` the picture is black",
            path.display()
        ));
    }
    let scene = Scene {
        camera,
        lights,
        materials,
        objects,
    };
    Ok(Loaded { scene, warnings })
}

/// A scene in the making.
struct Loader<'a> {
    source: &'a Source<'a>,
    root: AssetRoot,
    /// (kind of thing, name) of everything so far.
    names: HashSet<(&'static str, String)>,
    materials: Vec<Material>,
    objects: Vec<Object>,
    warnings: Vec<String>,
}

impl<'a> Loader<'a> {
    fn camera(&self, entry: &Spanned<CameraEntry>) -> Result<Camera> {
        let section = Section {
            source: self.source,
            owner: "camera".into(),
            span: entry.span(),
        };
        let entry = entry.get_ref();
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
        let exposure_ev =
            section.number_or(0.0, "exposure_ev", &entry.exposure_ev, -64.0..=64.0)?;
        Ok(Camera {
            position,
            target,
            fov: fov.to_radians(),
            exposure_ev,
        })
    }

    fn light(&mut self, entry: &LightEntry) -> Result<Light> {
        let section = self.section("light", &entry.name)?;
        let kind = match entry.kind.get_ref().as_str() {
            kind @ "sun" => {
                section.refuse(kind, "file", &entry.file)?;
                section.refuse(kind, "scale", &entry.scale)?;
                section.refuse(kind, "rotation_degrees", &entry.rotation_degrees)?;
                let direction = section.triple("direction", &entry.direction, METRES)?;
                let radius = &entry.angular_radius_degrees;
                let radius = section.number("angular_radius_degrees", radius, 0.0..=89.999)?;
                LightKind::Sun {
                    direction: mesh::unit(direction).ok_or_else(|| {
                        let remedy = "name a vector from the scene toward the light";
                        section.error(span(&entry.direction), "direction has no length", remedy)
                    })?,
                    irradiance: section.triple("irradiance", &entry.irradiance, 0.0..=1e9)?,
                    angular_radius: radius.to_radians(),
                }
            }
            kind @ "environment" => {
                section.refuse(kind, "direction", &entry.direction)?;
                section.refuse(kind, "irradiance", &entry.irradiance)?;
                section.refuse(
                    kind,
                    "angular_radius_degrees",
                    &entry.angular_radius_degrees,
                )?;
                let scale = section.number_or(1.0, "scale", &entry.scale, 0.0..=1e9)?;
                let angle = &entry.rotation_degrees;
                let rotation = section.number_or(0.0, "rotation_degrees", angle, -1e6..=1e6)?;
                let path = self.resolve(&section, section.required("file", &entry.file)?)?;
                let map = environment::read(&path, &mut self.warnings)?;
                let brightest =
                    (map.radiance.as_flattened().iter()).fold(0.0, |a: f32, b| a.max(*b));
                if f64::from(brightest) * scale > f64::from(MAX_RADIANCE) {
                    let reason = format!(
                        "the image's brightest value {brightest:e} times scale {scale} is more than {MAX_RADIANCE:e} W/m²/sr"
                    );
                    let place = entry
                        .scale
                        .as_ref()
                        .map_or(section.span.clone(), Spanned::span);
                    return Err(section.error(
                        place,
                        &reason,
                        "lower the scale, or darken the image",
                    ));
                }
                LightKind::Environment {
                    map: Arc::new(map),
                    scale,
                    rotation: rotation.to_radians(),
                }
            }
            other => {
                let reason = format!("there is no kind `{other}`");
                let remedy = "use `sun` or `environment`";
                return Err(section.error(entry.kind.span(), &reason, remedy));
            }
        };
        Ok(Light {
            name: entry.name.get_ref().clone(),
            kind,
        })
    }

    fn material(&mut self, entry: &MaterialEntry) -> Result<()> {
        let section = self.section("material", &entry.name)?;
        let kind = match entry.kind.get_ref().as_str() {
            kind @ "mirror" => {
                section.refuse(kind, "albedo", &entry.albedo)?;
                section.refuse(kind, "ior", &entry.ior)?;
                let reflectance = section.triple("reflectance", &entry.reflectance, 0.0..=1.0)?;
                MaterialKind::Mirror { reflectance }
            }
            kind @ "diffuse" => {
                section.refuse(kind, "reflectance", &entry.reflectance)?;
                section.refuse(kind, "ior", &entry.ior)?;
                let albedo = section.triple("albedo", &entry.albedo, 0.0..=1.0)?;
                MaterialKind::Diffuse { albedo }
            }
            other => {
                let reason = match other {
                    "dielectric" => {
                        format!("the kind `{other}` is not supported yet in this version")
                    }
                    _ => format!("there is no kind `{other}`"),
                };
                let remedy = "use `mirror` or `diffuse`";
                return Err(section.error(entry.kind.span(), &reason, remedy));
            }
        };
        self.materials.push(Material {
            name: entry.name.get_ref().clone(),
            kind,
        });
        Ok(())
    }

    fn object(&mut self, entry: &ObjectEntry) -> Result<()> {
        let section = self.section("object", &entry.name)?;
        if let Some(waves) = &entry.waves {
            let reason = "`waves` is not supported yet in this version";
            return Err(section.error(waves.span(), reason, "use a `mesh` or a `rect`"));
        }
        let material = (entry.material.as_ref())
            .map(|name| self.material_index(&section, name))
            .transpose()?;
        let light_map = (entry.lightmap.as_ref())
            .map(|texels| self.light_map(&section, entry, texels, material))
            .transpose()?;
        match (&entry.rect, &entry.mesh) {
            (Some(entry_rect), None) => {
                self.objects.push(Object {
                    name: entry.name.get_ref().clone(),
                    material: *section.required("material", &material)?,
                    geometry: Geometry::Rect(rect(&section, entry_rect)?),
                    light_map,
                    blocks_light: entry.blocks_light.unwrap_or(true),
                });
                Ok(())
            }
            (None, Some(file)) => self.mesh(&section, entry, file, material),
            (rect, _) => {
                let what = if rect.is_some() {
                    "both a `mesh` and a `rect`"
                } else {
                    "no `mesh` or `rect`"
                };
                let reason = format!("it has {what}");
                Err(section.error(section.span.clone(), &reason, "give it one of the two"))
            }
        }
    }

    /// Adds the parts of a mesh; `material` holds for all of it.
    fn mesh(
        &mut self,
        section: &Section,
        entry: &ObjectEntry,
        file: &Spanned<String>,
        material: Option<usize>,
    ) -> Result<()> {
        let path = self.resolve(section, file)?;
        for part in obj::read(&path, &self.root, material.is_none(), &mut self.warnings)? {
            let mut name = entry.name.get_ref().clone();
            let material = match part.material {
                Some((of_part, kind)) => {
                    name = format!("{name}/{of_part}");
                    let spanned = Spanned::new(entry.name.span(), name.clone());
                    self.section("object", &spanned)?;
                    self.section("material", &spanned)?;
                    self.materials.push(Material {
                        name: name.clone(),
                        kind,
                    });
                    self.materials.len() - 1
                }
                None => material.expect("without `material`, parts have their own"),
            };
            self.objects.push(Object {
                name,
                material,
                geometry: Geometry::Mesh(part.mesh),
                light_map: None,
                blocks_light: entry.blocks_light.unwrap_or(true),
            });
        }
        Ok(())
    }

    fn light_map(
        &self,
        section: &Section,
        entry: &ObjectEntry,
        texels: &Spanned<[i64; 2]>,
        material: Option<usize>,
    ) -> Result<[u32; 2]> {
        let error = |reason: &str, remedy: &str| Err(section.error(texels.span(), reason, remedy));
        if entry.rect.is_none() {
            return error("only a rect can have a light map", "remove `lightmap`");
        }
        if material.is_some_and(|m| matches!(self.materials[m].kind, MaterialKind::Mirror { .. })) {
            let remedy = "remove `lightmap`, or use a diffuse material";
            return error("a mirror receives no light, so it has no light map", remedy);
        }
        match texels.get_ref().map(light_map_side) {
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

    /// Takes a name of its own for a thing.
    fn section(&mut self, thing: &'static str, name: &Spanned<String>) -> Result<Section<'a>> {
        let (span, name) = (name.span(), name.get_ref());
        let owner = format!("{thing} \"{}\"", name.escape_debug());
        let section = Section {
            source: self.source,
            owner,
            span,
        };
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

fn rect(section: &Section, entry: &Spanned<RectEntry>) -> Result<Rect> {
    let keys = entry.get_ref();
    let origin = section.triple("origin", &keys.origin, METRES)?;
    let edge_u = section.triple("edge_u", &keys.edge_u, METRES)?;
    let edge_v = section.triple("edge_v", &keys.edge_v, METRES)?;
    let error = |reason: &str, remedy: &str| Err(section.error(entry.span(), reason, remedy));
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

fn span<T>(value: &Option<Spanned<T>>) -> Range<usize> {
    value.as_ref().map_or(0..0, Spanned::span)
}
