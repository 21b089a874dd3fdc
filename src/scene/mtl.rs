//! Material libraries (MTL) of OBJ meshes: `newmtl`, `Kd`, `Ks`, `Ni` and `illum`, read by tobj.

use super::glass::IOR;
use super::{Dielectric, MaterialKind};
use crate::error::Result;
use crate::input::{self, at_line};
use glam::DVec3;
use std::path::Path;

/// Bytes of a file.
const MAX_BYTES: u64 = 16 << 20;

/// The statements of an MTL file that matter, one a line, for tobj, which panics on colours of
/// less than three numbers. `warnings` gets what is left out and would be seen.
pub fn plain(path: &Path, warnings: &mut Vec<String>) -> Result<String> {
    let content = input::read(path, MAX_BYTES)?;
    let text = String::from_utf8_lossy(&content);
    let mut plain = String::new();
    for (index, line) in text.trim_start_matches('\u{feff}').lines().enumerate() {
        let line = line.trim();
        let mut words = line.split_whitespace();
        let keyword = words.next().unwrap_or("#");
        let rest: Vec<&str> = words.collect();
        let opaque = || rest.first().and_then(|d| d.parse().ok()) == Some(1.0);
        let well_formed = match keyword {
            "Kd" | "Ks" => rest.len() == 3 && rest.iter().all(|c| c.parse::<f64>().is_ok()),
            "Ni" => rest.len() == 1 && rest[0].parse::<f64>().is_ok(),
            "newmtl" => !rest.is_empty(),
            "illum" => rest.len() == 1 && rest[0].parse::<u8>().is_ok(),
            _ => {
                if keyword.starts_with("map_") || keyword == "d" && !opaque() {
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
        plain += &format!("{keyword} {}\n", rest.join(" "));
    }
    Ok(plain)
}

/// What an MTL material is here: a mirror with reflectance Ks where its illumination model
/// reflects (3, 5, 8), a dielectric with index Ni where it is glass (4, 6, 7, 9), otherwise diffuse
/// with albedo Kd.
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
        _ => colour("Kd", material.diffuse).map(|albedo| MaterialKind::Diffuse { albedo }),
    }
}
