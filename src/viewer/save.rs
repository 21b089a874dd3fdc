//! Writes the user's edits into the text of a scene file, whose comments and order stay.

use super::document::Document;
use super::edits::Placement;
use super::toml_writer::{Writer, rounded, set, triple};
use glam::{DQuat, DVec3};
use nephroid::output::write_atomically;
use nephroid::scene::{Dielectric, Geometry, LightKind, MaterialKind, Rect};
use nephroid::{Error, Result, glam, input};
use std::path::{Path, PathBuf};
use toml_edit::{Array, DocumentMut, InlineTable, Item, TableLike, Value};

/// Writes the scene with its edits to `path`, in the folder of the scene: its files are found from there. What could not be
/// saved, a sentence each.
///
/// # Errors
/// [`Error::Usage`] for another folder, [`Error::Input`] where the scene file is broken by now, [`Error::Output`] where the
/// file cannot be written.
pub fn save(document: &Document, path: &Path) -> Result<Vec<String>> {
    let folder = |path: &Path| {
        let parent = path
            .parent()
            .filter(|parent| !parent.as_os_str().is_empty());
        parent.unwrap_or(Path::new(".")).canonicalize().ok()
    };
    if folder(path) != folder(&document.path) {
        return Err(Error::Usage {
            reason: format!(
                "{} is not in the folder of {}",
                path.display(),
                document.path.display()
            ),
            remedy: "save in the scene's folder, from which its meshes and images are found".into(),
        });
    }
    let broken = |reason: String| Error::Input {
        file: document.path.clone(),
        place: None,
        reason,
        remedy: "mend the scene file before saving".into(),
    };
    let text = input::read_text(&document.path)?;
    let (text, notes) = edited(document, &text).map_err(broken)?;
    write_atomically(path, text.as_bytes())?;
    Ok(notes)
}

/// Where the edits go when the program has to end.
pub fn recovery_path(scene: &Path) -> PathBuf {
    with_name(scene, "recovered")
}

/// `ring.toml` as `ring.WORD.toml`.
pub fn with_name(scene: &Path, word: &str) -> PathBuf {
    let mut name = scene.file_stem().unwrap_or_default().to_owned();
    name.push(format!(".{word}.toml"));
    scene.with_file_name(name)
}

/// The text with the edits, and what is left out.
///
/// # Errors
/// What is wrong with the text.
fn edited(document: &Document, text: &str) -> Result<(String, Vec<String>), String> {
    let mut file: DocumentMut = text
        .parse()
        .map_err(|error: toml_edit::TomlError| error.to_string())?;
    let mut notes = Vec::new();
    let edits = &document.history.now;
    let base = &document.base;
    if let Some(camera) = file.get_mut("camera").and_then(Item::as_table_like_mut) {
        let mut writer = Writer {
            owner: "camera".into(),
            table: camera,
            notes: &mut notes,
        };
        if let Some(view) = &edits.camera {
            writer.triple("position", base.camera.position, view.position);
            writer.triple("target", base.camera.target, view.target);
            writer.number(
                "fov_degrees",
                base.camera.fov.to_degrees(),
                view.fov.to_degrees(),
            );
        }
        if let Some(exposure_ev) = edits.exposure_ev {
            writer.number("exposure_ev", base.camera.exposure_ev, exposure_ev);
        }
    }
    for (index, kind) in &edits.lights {
        let name = &base.lights[*index].name;
        if let Some(table) = named(&mut file, "light", name) {
            light(
                Writer {
                    owner: format!("light {name}"),
                    table,
                    notes: &mut notes,
                },
                &base.lights[*index].kind,
                kind,
            );
        }
    }
    for (index, kind) in &edits.materials {
        let name = &base.materials[*index].name;
        match named(&mut file, "material", name) {
            Some(table) => {
                let writer = Writer {
                    owner: format!("material {name}"),
                    table,
                    notes: &mut notes,
                };
                material(writer, &base.materials[*index].kind, kind);
            }
            None => notes.push(format!(
                "material {name} is not saved: it is of an MTL file"
            )),
        }
    }
    for (index, texels) in &edits.light_maps {
        let name = &base.objects[*index].name;
        match named(&mut file, "object", name) {
            Some(table) => {
                let sides = texels.iter().map(|side| i64::from(*side));
                set(table, "lightmap", Value::Array(sides.collect()));
            }
            None => notes.push(format!(
                "the light map of {name} is not saved: the object is of an MTL file"
            )),
        }
    }
    for (index, placement) in &edits.objects {
        let object = &base.objects[*index];
        match named(&mut file, "object", &object.name) {
            Some(table) => place(
                table,
                &object.name,
                &object.geometry,
                document.pivot(*index),
                placement,
                &mut notes,
            ),
            None => notes.push(format!(
                "{} is not moved in the file: it is of an MTL file",
                object.name
            )),
        }
    }
    Ok((file.to_string(), notes))
}

/// The table of an array whose `name` is this.
fn named<'a>(file: &'a mut DocumentMut, array: &str, name: &str) -> Option<&'a mut dyn TableLike> {
    let is_named = |table: &dyn TableLike| table.get("name").and_then(Item::as_str) == Some(name);
    match file.get_mut(array)? {
        Item::ArrayOfTables(tables) => {
            let index = tables.iter().position(|table| is_named(table))?;
            Some(tables.get_mut(index)?)
        }
        Item::Value(Value::Array(values)) => (values.iter_mut())
            .filter_map(Value::as_inline_table_mut)
            .find(|table| is_named(*table))
            .map(|table| table as &mut dyn TableLike),
        _ => None,
    }
}

fn light(mut writer: Writer, before: &LightKind, now: &LightKind) {
    match (before, now) {
        (
            LightKind::Sun {
                direction: d0,
                irradiance: e0,
                angular_radius: r0,
            },
            LightKind::Sun {
                direction,
                irradiance,
                angular_radius,
            },
        ) => {
            writer.triple("direction", *d0, *direction);
            writer.triple("irradiance", *e0, *irradiance);
            writer.number(
                "angular_radius_degrees",
                r0.to_degrees(),
                angular_radius.to_degrees(),
            );
        }
        (
            LightKind::Lamp {
                position: p0,
                radius: r0,
                radiant_flux: f0,
            },
            LightKind::Lamp {
                position,
                radius,
                radiant_flux,
            },
        ) => {
            writer.triple("position", *p0, *position);
            writer.number("radius", *r0, *radius);
            writer.triple("flux", *f0, *radiant_flux);
        }
        (
            LightKind::Environment {
                scale: s0,
                rotation: r0,
                ..
            },
            LightKind::Environment {
                scale, rotation, ..
            },
        ) => {
            writer.number("scale", *s0, *scale);
            writer.number("rotation_degrees", r0.to_degrees(), rotation.to_degrees());
        }
        // Edits keep the kind of a light.
        _ => {}
    }
}

fn material(mut writer: Writer, before: &MaterialKind, now: &MaterialKind) {
    match (before, now) {
        (MaterialKind::Mirror { reflectance: r0 }, MaterialKind::Mirror { reflectance }) => {
            writer.triple("reflectance", *r0, *reflectance);
        }
        (MaterialKind::Diffuse { albedo: a0 }, MaterialKind::Diffuse { albedo }) => {
            writer.triple("albedo", *a0, *albedo);
        }
        (
            MaterialKind::Dielectric(Dielectric {
                ior: i0,
                absorption: s0,
                ..
            }),
            MaterialKind::Dielectric(Dielectric {
                ior, absorption, ..
            }),
        ) => {
            writer.number("ior", *i0, *ior);
            writer.triple("absorption", *s0, *absorption);
        }
        // Metals are edited by no panel, and edits keep the kind of a material.
        _ => {}
    }
}

/// Writes where an object is: into the corners of a rect, or as a motion that stands still.
fn place(
    table: &mut dyn TableLike,
    name: &str,
    geometry: &Geometry,
    pivot: DVec3,
    placement: &Placement,
    notes: &mut Vec<String>,
) {
    let turned = |v: DVec3| placement.rotation * v;
    let at = |p: DVec3| pivot + placement.shift + turned(p - pivot);
    if table.contains_key("motion") {
        if placement.rotation != DQuat::IDENTITY {
            notes.push(format!(
                "the rotation of {name} is not saved: the object has a motion"
            ));
        }
        if !shift_motion(table, placement.shift) {
            notes.push(format!(
                "the place of {name} is not saved: its motion has no keyframes"
            ));
        }
        return;
    }
    let (key, rect) = match geometry {
        Geometry::Rect(rect) => ("rect", rect),
        Geometry::Waves(waves) => ("waves", &waves.rect),
        Geometry::Mesh(_) | Geometry::Placed { .. } => {
            set(
                table,
                "motion",
                Value::InlineTable(standing_motion(pivot, placement)),
            );
            return;
        }
    };
    let Rect {
        origin,
        edge_u,
        edge_v,
    } = *rect;
    if let Some(corners) = table.get_mut(key).and_then(Item::as_table_like_mut) {
        for (key, value) in [
            ("origin", at(origin)),
            ("edge_u", turned(edge_u)),
            ("edge_v", turned(edge_v)),
        ] {
            set(corners, key, triple(value));
        }
    }
}

fn standing_motion(pivot: DVec3, placement: &Placement) -> InlineTable {
    let (axis, angle) = placement.rotation.to_axis_angle();
    let mut frame = InlineTable::new();
    frame.insert("time", 0.0.into());
    frame.insert("translation", triple(placement.shift));
    frame.insert("angle_degrees", rounded(angle.to_degrees()).into());
    let mut motion = InlineTable::new();
    motion.insert("pivot", triple(pivot));
    motion.insert("axis", triple(axis));
    motion.insert(
        "keyframes",
        Value::Array(Array::from_iter([Value::InlineTable(frame)])),
    );
    motion
}

/// Adds to the translation of every keyframe.
fn shift_motion(object: &mut dyn TableLike, shift: DVec3) -> bool {
    let Some(motion) = object.get_mut("motion").and_then(Item::as_table_like_mut) else {
        return false;
    };
    let moved = |table: &mut dyn TableLike| {
        let number = |value: &Value| value.as_float().or(value.as_integer().map(|n| n as f64));
        let old: Vec<f64> = (table.get("translation").and_then(Item::as_array))
            .map(|list| list.iter().filter_map(number).collect())
            .unwrap_or_default();
        let old = <[f64; 3]>::try_from(old).map_or(DVec3::ZERO, DVec3::from);
        set(table, "translation", triple(old + shift));
    };
    match motion.get_mut("keyframes") {
        Some(Item::Value(Value::Array(list))) => {
            list.iter_mut()
                .filter_map(Value::as_inline_table_mut)
                .for_each(|frame| moved(frame));
            true
        }
        Some(Item::ArrayOfTables(list)) => {
            list.iter_mut().for_each(|frame| moved(frame));
            true
        }
        _ => false,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use nephroid::scene;

    /// A copy of a shipped scene beside the assets that it names.
    fn open(name: &str) -> Document {
        let path = Path::new(env!("CARGO_MANIFEST_DIR"))
            .join("assets/scenes")
            .join(name);
        Document::open(&path).unwrap().0
    }

    #[test]
    fn saving_nothing_keeps_every_byte() {
        for name in ["ring.toml", "pool.toml", "lamp.toml", "coffee.toml"] {
            let document = open(name);
            let text = std::fs::read_to_string(&document.path).unwrap();
            assert_eq!(edited(&document, &text).unwrap(), (text, Vec::new()));
        }
    }

    #[test]
    fn a_saved_scene_is_the_edited_scene() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("scene.toml");
        let text = "version = 1 # first\n[camera]\nposition = [0, 1, 3]\ntarget = [0, 0, 0]\nfov_degrees = 40 # wide\n\
             [[light]]\nname = \"sun\"\nkind = \"sun\"\ndirection = [0, 2, 1] # up\nirradiance = [1, 1, 1]\n\
             angular_radius_degrees = 0.0\n\
             [[material]]\nname = \"white\"\nkind = \"diffuse\"\nalbedo = [0.5, 0.5, 0.5]\n\
             [[material]]\nname = \"metal\"\nkind = \"mirror\"\nreflectance = [1, 1, 1]\n\
             [[object]]\nname = \"floor\" # below\nmaterial = \"white\"\nlightmap = [8, 8]\n\
             rect = { origin = [-1, 0, 1], edge_u = [2, 0, 0], edge_v = [0, 0, -2] }\n\
             [[object]]\nname = \"part\"\nmaterial = \"metal\"\nmesh = \"part.obj\"\n";
        std::fs::write(&file, text).unwrap();
        std::fs::write(
            folder.path().join("part.obj"),
            "v 0 1 0\nv 1 1 0\nv 0 2 0\nf 1 2 3\n",
        )
        .unwrap();
        let mut document = Document::open(&file).unwrap().0;
        let edits = &mut document.history.now;
        edits.exposure_ev = Some(1.5);
        let direction = DVec3::new(1.0, 1.0, 0.0).normalize();
        edits.lights.insert(
            0,
            LightKind::Sun {
                direction,
                irradiance: DVec3::ONE,
                angular_radius: 0.0,
            },
        );
        edits.materials.insert(
            1,
            MaterialKind::Mirror {
                reflectance: DVec3::splat(0.25),
            },
        );
        edits.light_maps.insert(0, [16, 4]);
        let placement = Placement {
            shift: DVec3::new(0.1, 0.2, 0.3),
            rotation: DQuat::from_rotation_z(0.4),
        };
        edits.objects.extend([(0, placement), (1, placement)]);
        let saved = folder.path().join("saved.toml");
        assert_eq!(save(&document, &saved).unwrap(), Vec::<String>::new());
        let content = std::fs::read_to_string(&saved).unwrap();
        for kept in [
            "version = 1 # first",
            "fov_degrees = 40 # wide",
            "# up",
            "name = \"floor\" # below",
        ] {
            assert!(content.contains(kept), "{kept}: {content}");
        }
        let expected = document.scene(0.0, 1.0).clone();
        let found = scene::load(&saved).unwrap().scene;
        assert_eq!(found.camera.exposure_ev, 1.5);
        let LightKind::Sun {
            direction: found_direction,
            ..
        } = found.lights[0].kind
        else {
            panic!("no sun")
        };
        assert!(found_direction.distance(direction) < 1e-8);
        assert_eq!(found.materials[1].kind, expected.materials[1].kind);
        for (a, b) in expected.objects.iter().zip(&found.objects) {
            assert_eq!(a.light_map, b.light_map);
            for (p, q) in a
                .geometry
                .mesh()
                .positions
                .iter()
                .zip(&b.geometry.mesh().positions)
            {
                assert!(p.distance(*q) < 1e-7, "{}: {p} {q}", a.name);
            }
        }
    }

    /// Lights in one line are saved as well.
    #[test]
    fn inline_tables_are_edited() {
        let text = "light = [{ name = \"lamp\", kind = \"sun\", direction = [0, 2, 1], irradiance = [1, 1, 1], \
                    angular_radius_degrees = 0.0 }] # above\n\
                    [camera]\nposition = [0, 1, 3]\ntarget = [0, 0, 0]\nfov_degrees = 40\n";
        let mut file: DocumentMut = text.parse().unwrap();
        assert!(named(&mut file, "light", "sun").is_none());
        let table = named(&mut file, "light", "lamp").unwrap();
        set(table, "angular_radius_degrees", Value::from(0.5));
        let expected = text.replace(
            "angular_radius_degrees = 0.0",
            "angular_radius_degrees = 0.5",
        );
        assert_eq!(file.to_string(), expected);
    }

    #[test]
    fn another_folder_is_refused() {
        let folder = tempfile::tempdir().unwrap();
        let error = save(&open("ring.toml"), &folder.path().join("a.toml")).unwrap_err();
        assert!(
            error.to_string().contains("is not in the folder"),
            "{error}"
        );
    }
}
