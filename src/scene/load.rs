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
use super::file::{CameraEntry, LightEntry, MaterialEntry, ObjectEntry, RectEntry, Source, Triple};
use super::{Camera, Geometry, Light, LightKind, Material, MaterialKind, Object, Rect, Scene};
use super::{environment, mesh, obj};
use crate::error::{Error, Result};
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
/// Texels of a light map's side.
const MAX_LIGHT_MAP_SIDE: u32 = 16384;

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
/// [`Error::Input`] that names file, line and column.
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
        source,
        root: AssetRoot::of(path)?,
        names: HashSet::new(),
        warnings: Vec::new(),
        materials: Vec::new(),
        objects: Vec::new(),
    };
    let camera = loader.camera(&entry.camera)?;
    let lights = (entry.light.iter())
        .map(|light| loader.light(light))
        .collect::<Result<Vec<_>>>()?;
    for material in &entry.material {
        loader.material(material)?;
    }
    for object in &entry.object {
        loader.object(object)?;
    }
    if loader.objects.is_empty() {
        let remedy = "add an `[[object]]` with a `mesh` or a `rect`";
        return Err(refused(path, "the scene has no object", remedy));
    }
    if lights.is_empty() {
        let warning = format!(
            "{}: there is no `[[light]]`, so the picture is black",
            path.display()
        );
        loader.warnings.push(warning);
    }
    let Loader {
        materials,
        objects,
        warnings,
        ..
    } = loader;
    Ok(Loaded {
        scene: Scene {
            camera,
            lights,
            materials,
            objects,
        },
        warnings,
    })
}

/// A scene in the making.
struct Loader<'a> {
    source: Source<'a>,
    root: AssetRoot,
    /// (kind of thing, name) of everything so far.
    names: HashSet<(&'static str, String)>,
    warnings: Vec<String>,
    materials: Vec<Material>,
    objects: Vec<Object>,
}

/// A key that the format knows but the kind of its owner does not, and where it is used.
type ForeignKey<'a> = (&'a str, Option<Range<usize>>);

impl Loader<'_> {
    fn camera(&self, entry: &CameraEntry) -> Result<Camera> {
        let position = self.triple("camera: position", &entry.position, METRES)?;
        let target = self.triple("camera: target", &entry.target, METRES)?;
        let Some(view) = mesh::unit(target - position) else {
            let reason = "camera: position and target are the same point";
            return Err(self
                .source
                .error(entry.target.span(), reason, "move one of them"));
        };
        if view.cross(DVec3::Y).length() < 1e-6 {
            let reason = "camera: it looks straight along the y axis, so that up is undefined";
            let remedy = "move position or target a little sideways";
            return Err(self.source.error(entry.target.span(), reason, remedy));
        }
        let fov = self.number("camera: fov_degrees", &entry.fov_degrees, 0.001..=179.999)?;
        let exposure_ev = match &entry.exposure_ev {
            Some(ev) => self.number("camera: exposure_ev", ev, -64.0..=64.0)?,
            None => 0.0,
        };
        Ok(Camera {
            position,
            target,
            fov: fov.to_radians(),
            exposure_ev,
        })
    }

    fn light(&mut self, entry: &LightEntry) -> Result<Light> {
        let owner = self.register("light", entry.name.get_ref(), &entry.name)?;
        let what = |key: &str| format!("{owner}: {key}");
        let missing = |key: &str| self.missing(&entry.name, &owner, key);
        let kind = match entry.kind.get_ref().as_str() {
            "sun" => {
                self.refuse_keys(
                    &[
                        foreign("file", &entry.file),
                        foreign("scale", &entry.scale),
                        foreign("rotation_degrees", &entry.rotation_degrees),
                    ],
                    &owner,
                    "sun",
                )?;
                let direction = entry
                    .direction
                    .as_ref()
                    .ok_or_else(|| missing("direction"))?;
                let irradiance = entry
                    .irradiance
                    .as_ref()
                    .ok_or_else(|| missing("irradiance"))?;
                let radius = (entry.angular_radius_degrees.as_ref())
                    .ok_or_else(|| missing("angular_radius_degrees"))?;
                let toward = self.triple(&what("direction"), direction, METRES)?;
                LightKind::Sun {
                    direction: mesh::unit(toward).ok_or_else(|| {
                        let reason = format!("{owner}: direction has no length");
                        let remedy = "name a vector from the scene toward the light";
                        self.source.error(direction.span(), &reason, remedy)
                    })?,
                    irradiance: self.triple(&what("irradiance"), irradiance, 0.0..=1e9)?,
                    angular_radius: self
                        .number(&what("angular_radius_degrees"), radius, 0.0..=89.999)?
                        .to_radians(),
                }
            }
            "environment" => {
                self.refuse_keys(
                    &[
                        foreign("direction", &entry.direction),
                        foreign("irradiance", &entry.irradiance),
                        foreign("angular_radius_degrees", &entry.angular_radius_degrees),
                    ],
                    &owner,
                    "environment",
                )?;
                let file = entry.file.as_ref().ok_or_else(|| missing("file"))?;
                let scale = match &entry.scale {
                    Some(scale) => self.number(&what("scale"), scale, 0.0..=1e9)?,
                    None => 1.0,
                };
                let rotation = match &entry.rotation_degrees {
                    Some(angle) => self.number(&what("rotation_degrees"), angle, -1e6..=1e6)?,
                    None => 0.0,
                };
                let path = self.resolve(file, &owner)?;
                LightKind::Environment {
                    map: Arc::new(environment::read(&path, &mut self.warnings)?),
                    scale,
                    rotation: rotation.to_radians(),
                }
            }
            other => {
                let reason = format!("{owner}: there is no kind `{other}`");
                let remedy = "use `sun` or `environment`";
                return Err(self.source.error(entry.kind.span(), &reason, remedy));
            }
        };
        Ok(Light {
            name: entry.name.get_ref().clone(),
            kind,
        })
    }

    fn material(&mut self, entry: &MaterialEntry) -> Result<()> {
        let owner = self.register("material", entry.name.get_ref(), &entry.name)?;
        let missing = |key: &str| self.missing(&entry.name, &owner, key);
        let kind = match entry.kind.get_ref().as_str() {
            "mirror" => {
                let others = [foreign("albedo", &entry.albedo), foreign("ior", &entry.ior)];
                self.refuse_keys(&others, &owner, "mirror")?;
                let colour = entry
                    .reflectance
                    .as_ref()
                    .ok_or_else(|| missing("reflectance"))?;
                let what = format!("{owner}: reflectance");
                MaterialKind::Mirror {
                    reflectance: self.triple(&what, colour, 0.0..=1.0)?,
                }
            }
            "diffuse" => {
                let others = [
                    foreign("reflectance", &entry.reflectance),
                    foreign("ior", &entry.ior),
                ];
                self.refuse_keys(&others, &owner, "diffuse")?;
                let colour = entry.albedo.as_ref().ok_or_else(|| missing("albedo"))?;
                let what = format!("{owner}: albedo");
                MaterialKind::Diffuse {
                    albedo: self.triple(&what, colour, 0.0..=1.0)?,
                }
            }
            other => {
                let reason = match other {
                    "dielectric" => {
                        format!(
                            "{owner}: the kind `dielectric` is not supported yet in this version"
                        )
                    }
                    _ => format!("{owner}: there is no kind `{other}`"),
                };
                let remedy = "use `mirror` or `diffuse`";
                return Err(self.source.error(entry.kind.span(), &reason, remedy));
            }
        };
        self.materials.push(Material {
            name: entry.name.get_ref().clone(),
            kind,
        });
        Ok(())
    }

    fn object(&mut self, entry: &ObjectEntry) -> Result<()> {
        let owner = self.register("object", entry.name.get_ref(), &entry.name)?;
        if let Some(waves) = &entry.waves {
            let reason = format!("{owner}: `waves` is not supported yet in this version");
            let remedy = "use a `mesh` or a `rect`";
            return Err(self.source.error(waves.span(), &reason, remedy));
        }
        let material = match &entry.material {
            Some(name) => Some(self.material_index(name, &owner)?),
            None => None,
        };
        let light_map = match &entry.lightmap {
            Some(texels) => Some(self.light_map(texels, &owner, entry, material)?),
            None => None,
        };
        match (&entry.rect, &entry.mesh) {
            (Some(rect), None) => {
                let geometry = Geometry::Rect(self.rect(rect, &owner)?);
                let material =
                    material.ok_or_else(|| self.missing(&entry.name, &owner, "material"))?;
                self.objects.push(Object {
                    name: entry.name.get_ref().clone(),
                    material,
                    geometry,
                    light_map,
                    blocks_light: entry.blocks_light,
                });
                Ok(())
            }
            (None, Some(file)) => self.mesh(entry, file, material, &owner),
            (rect, _) => {
                let both = rect.is_some();
                let reason = if both {
                    "both a `mesh` and a `rect`"
                } else {
                    "no `mesh` or `rect`"
                };
                let reason = format!("{owner}: there is {reason}");
                let remedy = "an object is one of the two";
                Err(self.source.error(entry.name.span(), &reason, remedy))
            }
        }
    }

    /// Adds the parts of a mesh; `material` holds for all of it.
    fn mesh(
        &mut self,
        entry: &ObjectEntry,
        file: &Spanned<String>,
        material: Option<usize>,
        owner: &str,
    ) -> Result<()> {
        let path = self.resolve(file, owner)?;
        for part in obj::read(&path, &self.root, material.is_none(), &mut self.warnings)? {
            let object = entry.name.get_ref();
            let (name, material) = match (part.material, material) {
                (Some((name, kind)), _) => {
                    let name = format!("{object}/{name}");
                    self.register("object", &name, &entry.name)?;
                    self.register("material", &name, &entry.name)?;
                    self.materials.push(Material {
                        name: name.clone(),
                        kind,
                    });
                    (name, self.materials.len() - 1)
                }
                (None, Some(material)) => (object.clone(), material),
                (None, None) => unreachable!("without `material` the MTL file has been read"),
            };
            self.objects.push(Object {
                name,
                material,
                geometry: Geometry::Mesh(part.mesh),
                light_map: None,
                blocks_light: entry.blocks_light,
            });
        }
        Ok(())
    }

    fn rect(&self, entry: &Spanned<RectEntry>, owner: &str) -> Result<Rect> {
        let rect = entry.get_ref();
        let origin = self.triple(&format!("{owner}: origin"), &rect.origin, METRES)?;
        let edge = |key: &str, edge: &Triple| {
            let vector = self.triple(&format!("{owner}: {key}"), edge, METRES)?;
            let unit = mesh::unit(vector).ok_or_else(|| {
                let reason = format!("{owner}: {key} has no length");
                self.source
                    .error(edge.span(), &reason, "give the rect a width and a height")
            })?;
            Ok((vector, unit))
        };
        let (edge_u, along_u) = edge("edge_u", &rect.edge_u)?;
        let (edge_v, along_v) = edge("edge_v", &rect.edge_v)?;
        if along_u.dot(along_v).abs() > 1e-6 {
            let reason = format!("{owner}: edge_u and edge_v are not perpendicular");
            let remedy = "turn one of them, or use a mesh";
            return Err(self.source.error(entry.span(), &reason, remedy));
        }
        Ok(Rect {
            origin,
            edge_u,
            edge_v,
        })
    }

    fn light_map(
        &self,
        texels: &Spanned<[i64; 2]>,
        owner: &str,
        entry: &ObjectEntry,
        material: Option<usize>,
    ) -> Result<[u32; 2]> {
        let error = |reason: &str, remedy: &str| {
            let reason = format!("{owner}: {reason}");
            Err(self.source.error(texels.span(), &reason, remedy))
        };
        if entry.rect.is_none() {
            return error("only a rect can have a light map", "remove `lightmap`");
        }
        let diffuse =
            |material: usize| matches!(self.materials[material].kind, MaterialKind::Diffuse { .. });
        if !material.is_none_or(diffuse) {
            let remedy = "remove `lightmap`, or use a diffuse material";
            return error("a mirror receives no light and has no light map", remedy);
        }
        let side = |texels: i64| {
            u32::try_from(texels)
                .ok()
                .filter(|side| (1..=MAX_LIGHT_MAP_SIDE).contains(side))
        };
        match texels.get_ref().map(side) {
            [Some(width), Some(height)] => Ok([width, height]),
            _ => error(
                &format!(
                    "lightmap = {:?}: each side is within 1 and {MAX_LIGHT_MAP_SIDE} texels",
                    texels.get_ref()
                ),
                "change the light map's size",
            ),
        }
    }

    fn material_index(&self, name: &Spanned<String>, owner: &str) -> Result<usize> {
        let wanted = name.get_ref();
        let index = self
            .materials
            .iter()
            .position(|material| material.name == *wanted);
        index.ok_or_else(|| {
            let reason = format!("{owner}: there is no material `{wanted}`");
            let remedy = "add a `[[material]]` of that name, or correct the name";
            self.source.error(name.span(), &reason, remedy)
        })
    }

    /// Path of a file that the scene names.
    fn resolve(&self, file: &Spanned<String>, owner: &str) -> Result<PathBuf> {
        self.root
            .resolve(self.source.path, file.get_ref())
            .map_err(|reason| {
                let reason = format!("{owner}: {reason}");
                let remedy = "name a file under the asset root, relative to the scene file";
                self.source.error(file.span(), &reason, remedy)
            })
    }

    /// Takes a name, and gives what messages call its owner.
    fn register(&mut self, what: &'static str, name: &str, at: &Spanned<String>) -> Result<String> {
        let owner = format!("{what} \"{}\"", name.escape_debug());
        let error = |reason: &str| {
            let reason = format!("{owner}: {reason}");
            let remedy = "give it a name of its own, without control characters";
            Err(self.source.error(at.span(), &reason, remedy))
        };
        if name.trim().is_empty() || name.chars().any(char::is_control) {
            return error("this is not a name");
        }
        if !self.names.insert((what, name.to_owned())) {
            return error("the name is used twice");
        }
        Ok(owner)
    }

    fn missing(&self, at: &Spanned<String>, owner: &str, key: &str) -> Error {
        let reason = format!("{owner}: the key `{key}` is missing");
        self.source
            .error(at.span(), &reason, &format!("add `{key} = ...` to it"))
    }

    fn refuse_keys(&self, keys: &[ForeignKey], owner: &str, kind: &str) -> Result<()> {
        for (key, span) in keys {
            if let Some(span) = span {
                let reason = format!("{owner}: the kind `{kind}` has no key `{key}`");
                return Err(self.source.error(span.clone(), &reason, "remove the key"));
            }
        }
        Ok(())
    }

    fn number(&self, what: &str, value: &Spanned<f64>, range: RangeInclusive<f64>) -> Result<f64> {
        self.check(what, &[*value.get_ref()], value.span(), range)?;
        Ok(*value.get_ref())
    }

    fn triple(&self, what: &str, value: &Triple, range: RangeInclusive<f64>) -> Result<DVec3> {
        self.check(what, value.get_ref(), value.span(), range)?;
        Ok(DVec3::from(*value.get_ref()))
    }

    fn check(
        &self,
        what: &str,
        values: &[f64],
        span: Range<usize>,
        range: RangeInclusive<f64>,
    ) -> Result<()> {
        // No range contains NaN.
        match values.iter().find(|value| !range.contains(value)) {
            None => Ok(()),
            Some(value) => {
                let (low, high) = (range.start(), range.end());
                let reason = format!("{what}: {value} is not within {low} and {high}");
                Err(self.source.error(span, &reason, "correct the number"))
            }
        }
    }
}

fn foreign<'a, T>(key: &'a str, value: &Option<Spanned<T>>) -> ForeignKey<'a> {
    (key, value.as_ref().map(Spanned::span))
}
