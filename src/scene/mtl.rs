//! Material libraries (MTL) of OBJ meshes: `newmtl`, `Kd`, `Ks`, `Ni`, `illum` and `map_Kd`, read by tobj.

use super::asset::AssetRoot;
use super::glass::IOR;
use super::obj_text::statement;
use super::{Dielectric, MaterialKind};
use crate::error::Result;
use crate::input::{self, at_line};
use glam::{DVec2, DVec3};
use std::path::{Path, PathBuf};

/// Bytes of a file.
const MAX_BYTES: u64 = 16 << 20;

/// An image on a material.
#[derive(Debug, Clone, PartialEq)]
pub struct Map {
    pub file: PathBuf,
    /// Scale by the option `-s`.
    pub uv_scale: DVec2,
}

/// The statements of an MTL file that matter, one a line, for tobj, which panics on colours of less than
/// three numbers. A `map_Kd` has the index of its map in `maps`, to which it is added. `warnings` gets what
/// is left out and would be seen.
pub fn plain(
    path: &Path,
    root: &AssetRoot,
    maps: &mut Vec<Map>,
    warnings: &mut Vec<String>,
) -> Result<String> {
    let content = input::read(path, MAX_BYTES)?;
    let text = String::from_utf8_lossy(&content);
    let mut plain = String::new();
    for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let line = line.trim();
        let (keyword, text) = statement(line);
        let rest: Vec<&str> = text.split_whitespace().collect();
        let all = |value: f64| rest.iter().all(|word| word.parse() == Ok(value));
        let well_formed = match keyword {
            "Kd" | "Ks" => rest.len() == 3 && rest.iter().all(|c| c.parse::<f64>().is_ok()),
            "Ni" => rest.len() == 1 && rest[0].parse::<f64>().is_ok(),
            "newmtl" => !rest.is_empty(),
            "illum" => rest.len() == 1 && rest[0].parse::<u8>().is_ok(),
            "map_Kd" => {
                match map(path, root, line, &rest) {
                    Ok(map) => {
                        plain += &format!("map_Kd {}\n", maps.len());
                        maps.push(map);
                    }
                    Err(reason) => {
                        let (path, line) = (path.display(), index + 1);
                        warnings.push(format!(
                            "{path}: line {line}: {reason}; the map is left out"
                        ));
                    }
                }
                continue;
            }
            _ => {
                let is_plain = match keyword {
                    "d" => all(1.0),
                    "Tr" | "Ke" => all(0.0),
                    _ => !keyword.starts_with("map_"),
                };
                if !is_plain {
                    let (path, line) = (path.display(), index + 1);
                    warnings.push(format!(
                        "{path}: line {line}: `{keyword}` is not supported and left out"
                    ));
                }
                continue;
            }
        };
        if !well_formed {
            let reason = format!("`{line}` is malformed");
            return Err(at_line(
                path,
                index + 1,
                &reason,
                "export the materials again",
            ));
        }
        plain += &format!("{keyword} {text}\n");
    }
    Ok(plain)
}

/// `line` is a whole statement `map_Kd`, and `rest` its words behind that.
///
/// # Errors
/// The reason.
fn map(path: &Path, root: &AssetRoot, line: &str, rest: &[&str]) -> Result<Map, String> {
    let mut uv_scale = DVec2::ONE;
    let mut words = rest.iter().copied().peekable();
    // One to three numbers behind an option.
    let numbers = |words: &mut std::iter::Peekable<_>, most: usize| {
        let mut numbers: Vec<f64> = Vec::new();
        while let Some(number) = (words.peek())
            .filter(|_| numbers.len() < most)
            .and_then(|word: &&str| word.parse().ok())
        {
            numbers.push(number);
            words.next();
        }
        numbers
    };
    while let Some(option) = words.peek().copied().filter(|word| word.starts_with('-')) {
        words.next();
        match option {
            "-s" => match numbers(&mut words, 3)[..] {
                [] => return Err("`-s` has no number".into()),
                [u] => uv_scale.x = u,
                [u, v, ..] => uv_scale = DVec2::new(u, v),
            },
            // Which change nothing here.
            "-blendu" | "-blendv" | "-cc" => {
                words.next();
            }
            "-texres" => {
                numbers(&mut words, 1);
            }
            other => return Err(format!("the option `{other}` of `map_Kd` is not supported")),
        }
    }
    if !uv_scale.is_finite() || uv_scale.abs().max_element() > 1e6 {
        return Err(format!("`-s` is {uv_scale}, not within ±1e6"));
    }
    let first = words.next().ok_or("`map_Kd` names no file")?;
    // A name may have spaces: all from its first word on.
    let name = &line[first.as_ptr() as usize - line.as_ptr() as usize..];
    // Exporters on Windows write its separator.
    let file = root.resolve(path, &name.replace('\\', "/"))?;
    Ok(Map { file, uv_scale })
}

/// What an MTL material is here: a mirror with reflectance Ks where its illumination model
/// reflects (3, 5, 8), a dielectric with index Ni where it is glass (4, 6, 7, 9), otherwise diffuse
/// with albedo Kd, which is white where it has only a map.
///
/// # Errors
/// The reason, for colours and indices that are missing or out of range.
pub fn kind(material: &tobj::Material) -> Result<MaterialKind, String> {
    let colour = |key: &str, value: Option<[f64; 3]>| {
        let value = value.ok_or(format!("it has no `{key}`"))?;
        if value.iter().all(|c| (0.0..=1.0).contains(c)) {
            Ok(DVec3::from(value))
        } else {
            Err(format!("`{key}` is {value:?}, not within 0 and 1"))
        }
    };
    match material.illumination_model {
        Some(3 | 5 | 8) => {
            colour("Ks", material.specular).map(|reflectance| MaterialKind::Mirror { reflectance })
        }
        Some(4 | 6 | 7 | 9) => match material.optical_density {
            Some(ior) if IOR.contains(&ior) => Ok(MaterialKind::Dielectric(Dielectric::new(ior))),
            Some(ior) => Err(format!("`Ni` is {ior}, not within 0.1 and 10")),
            None => Err("it has no `Ni`".into()),
        },
        _ if material.diffuse.is_none() && material.diffuse_texture.is_some() => {
            Ok(MaterialKind::Diffuse { albedo: DVec3::ONE })
        }
        _ => colour("Kd", material.diffuse).map(|albedo| MaterialKind::Diffuse { albedo }),
    }
}

/// The map of a diffuse material that [`kind`] has read, among those of [`plain`].
pub fn map_of(material: &tobj::Material, kind: &MaterialKind, maps: &[Map]) -> Option<Map> {
    let index: usize = material.diffuse_texture.as_ref()?.parse().ok()?;
    (!kind.is_specular()).then(|| maps.get(index).cloned())?
}
