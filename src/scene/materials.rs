//! Materials of scene files, and their albedo maps.

use super::file::{MaterialEntry, Section};
use super::glass::{IOR, SELLMEIER_TERMS};
use super::{
    AlbedoMap, D_LINE, Dielectric, Dispersion, GLASSES, MaterialKind, Sellmeier, Texture, mtl,
    texture,
};
use crate::error::Result;
use glam::{DVec2, DVec3};
use std::collections::HashMap;
use std::ops::RangeInclusive;
use std::path::PathBuf;
use std::sync::Arc;
use toml::Value;

/// Complex indices of refraction by name: (name, index, extinction), each at 650, 550 and 450 nm, from
/// refractiveindex.info (Polyanskiy 2024). That of brass was not compared with the source again.
pub const METALS: [(&str, [f64; 3], [f64; 3]); 5] = [
    (
        "aluminium",
        [1.3456, 0.96521, 0.61722],
        [7.4746, 6.3995, 5.3031],
    ),
    ("brass", [0.444, 0.527, 1.094], [3.695, 2.765, 1.829]),
    (
        "copper",
        [0.27105, 0.67693, 1.3164],
        [3.6092, 2.6248, 2.2921],
    ),
    ("gold", [0.18299, 0.42108, 1.3734], [3.4242, 2.3459, 1.7704]),
    (
        "silver",
        [0.15943, 0.14512, 0.13547],
        [3.9291, 3.19, 2.3808],
    ),
];
const PRIORITY: RangeInclusive<i64> = -1000..=1000;
/// Range of `uv_scale`.
const UV_SCALE: RangeInclusive<f64> = -1e6..=1e6;
/// Largest texture coordinate of a mesh with a texture.
const MAX_UV: f64 = 1e6;

/// What the keys of an entry say; `has_map`: it has an albedo map.
pub fn kind(section: &Section, entry: &MaterialEntry, has_map: bool) -> Result<MaterialKind> {
    let no_metal = |kind| {
        section.refuse(kind, "metal", &entry.metal)?;
        section.refuse(kind, "index", &entry.index)?;
        section.refuse(kind, "extinction", &entry.extinction)
    };
    let no_medium = |kind| {
        section.refuse(kind, "ior", &entry.ior)?;
        section.refuse(kind, "dispersion", &entry.dispersion)?;
        section.refuse(kind, "absorption", &entry.absorption)?;
        section.refuse(kind, "priority", &entry.priority)?;
        section.refuse(kind, "thin", &entry.thin)
    };
    if let kind @ ("mirror" | "conductor" | "dielectric") = entry.kind.get_ref().as_str() {
        section.refuse(kind, "albedo_map", &entry.albedo_map)?;
        section.refuse(kind, "uv_scale", &entry.uv_scale)?;
    }
    Ok(match entry.kind.get_ref().as_str() {
        kind @ "mirror" => {
            section.refuse(kind, "albedo", &entry.albedo)?;
            no_medium(kind)?;
            no_metal(kind)?;
            let reflectance = section.triple("reflectance", &entry.reflectance, 0.0..=1.0)?;
            MaterialKind::Mirror { reflectance }
        }
        kind @ "conductor" => {
            section.refuse(kind, "reflectance", &entry.reflectance)?;
            section.refuse(kind, "albedo", &entry.albedo)?;
            no_medium(kind)?;
            conductor(section, entry)?
        }
        kind @ "dielectric" => {
            section.refuse(kind, "reflectance", &entry.reflectance)?;
            section.refuse(kind, "albedo", &entry.albedo)?;
            no_metal(kind)?;
            MaterialKind::Dielectric(dielectric(section, entry)?)
        }
        kind @ "diffuse" => {
            section.refuse(kind, "reflectance", &entry.reflectance)?;
            no_medium(kind)?;
            no_metal(kind)?;
            let albedo = match has_map {
                true => section.triple_or(DVec3::ONE, "albedo", &entry.albedo, 0.0..=1.0)?,
                false => section.triple("albedo", &entry.albedo, 0.0..=1.0)?,
            };
            MaterialKind::Diffuse { albedo }
        }
        other => {
            let reason = format!("there is no kind `{other}`");
            let remedy = "use `mirror`, `conductor`, `dielectric` or `diffuse`";
            return Err(section.error(entry.kind.span(), &reason, remedy));
        }
    })
}

fn conductor(section: &Section, entry: &MaterialEntry) -> Result<MaterialKind> {
    let Some(metal) = &entry.metal else {
        return Ok(MaterialKind::Conductor {
            index: section.triple("index", &entry.index, 0.001..=100.0)?,
            extinction: section.triple("extinction", &entry.extinction, 0.0..=100.0)?,
        });
    };
    let named = METALS.iter().find(|(name, ..)| name == metal.get_ref());
    let Some(&(_, index, extinction)) = named else {
        let reason = format!("there is no metal `{}`", metal.get_ref());
        let names = METALS.map(|(name, ..)| name).join(", ");
        return Err(section.error(metal.span(), &reason, &format!("use one of {names}")));
    };
    for (key, value) in [("index", &entry.index), ("extinction", &entry.extinction)] {
        if let Some(value) = value {
            let reason = format!("the key `{key}` is given beside `metal`, which says it");
            return Err(section.error(value.span(), &reason, "remove one of them"));
        }
    }
    Ok(MaterialKind::Conductor {
        index: index.into(),
        extinction: extinction.into(),
    })
}

fn dielectric(section: &Section, entry: &MaterialEntry) -> Result<Dielectric> {
    let (ior, dispersion) = refraction(section, entry)?;
    let thin = entry.thin.as_ref().is_some_and(|thin| *thin.get_ref());
    if let (true, Some(absorption)) = (thin, &entry.absorption) {
        let reason = "the key `absorption` is given beside `thin`: a sheet has no thickness";
        return Err(section.error(absorption.span(), reason, "remove one of them"));
    }
    if let (true, Some(dispersion)) = (thin, entry.dispersion.as_ref().filter(|key| *key.get_ref()))
    {
        let reason = "the key `dispersion` is given beside `thin`: a sheet turns no light";
        return Err(section.error(dispersion.span(), reason, "remove one of them"));
    }
    let priority = entry.priority.as_ref();
    if let Some(priority) = priority.filter(|priority| !PRIORITY.contains(priority.get_ref())) {
        let reason = format!("priority is {}", priority.get_ref());
        return Err(section.error(priority.span(), &reason, "use a number from -1000 to 1000"));
    }
    Ok(Dielectric {
        ior,
        dispersion: dispersion.filter(|_| !thin),
        absorption: section.triple_or(DVec3::ZERO, "absorption", &entry.absorption, 0.0..=1e9)?,
        priority: priority.map_or(0, |priority| *priority.get_ref() as i32),
        thin,
    })
}

/// The index of refraction at the d line, and how it depends on the wavelength where that is asked for.
fn refraction(section: &Section, entry: &MaterialEntry) -> Result<(f64, Option<Dispersion>)> {
    const FORMS: &str = "give a number such as 1.5, the name of a medium such as \"BK7\", three numbers for 650, 550 and 450 nm, \
        { cauchy = [A, B, C] } or { sellmeier = [[b, c], ...] }";
    let ior = section.required("ior", &entry.ior)?;
    let asked = entry.dispersion.as_ref();
    let number =
        |value: &Value| (value.as_float()).or(value.as_integer().map(|number| number as f64));
    let numbers =
        |value: &Value| -> Option<Vec<f64>> { value.as_array()?.iter().map(number).collect() };
    let value = ior.get_ref();
    if let Some(number) = number(value) {
        section.check("ior", &[number], ior.span(), IOR)?;
        if let Some(asked) = asked.filter(|asked| *asked.get_ref()) {
            let reason = "ior is one number, which has no dispersion";
            return Err(section.error(asked.span(), reason, FORMS));
        }
        return Ok((number, None));
    }
    let (dispersion, is_default) = match value {
        Value::String(name) => {
            let named = GLASSES.iter().find(|(known, _)| known == name);
            let Some((_, sellmeier)) = named else {
                let names = GLASSES.map(|(name, _)| name).join(", ");
                let reason = format!("there is no medium `{name}`");
                return Err(section.error(ior.span(), &reason, &format!("use one of {names}")));
            };
            (Dispersion::Sellmeier(*sellmeier), false)
        }
        Value::Array(_) => match numbers(value).as_deref() {
            Some(&[red, green, blue]) => (Dispersion::through([red, green, blue]), true),
            _ => {
                return Err(section.error(
                    ior.span(),
                    "ior is a list of other than three numbers",
                    FORMS,
                ));
            }
        },
        Value::Table(table) => {
            let dispersion = match table.iter().next() {
                Some((key, value)) if key == "cauchy" && table.len() == 1 => {
                    let coefficients = numbers(value).filter(|list| (2..=3).contains(&list.len()));
                    coefficients.map(|list| {
                        Dispersion::Cauchy([list[0], list[1], list.get(2).copied().unwrap_or(0.0)])
                    })
                }
                Some((key, value)) if key == "sellmeier" && table.len() == 1 => {
                    let term = |term: &Value| numbers(term)?.try_into().ok();
                    let terms: Option<Vec<[f64; 2]>> = value
                        .as_array()
                        .and_then(|list| list.iter().map(term).collect());
                    terms
                        .filter(|terms| (1..=SELLMEIER_TERMS).contains(&terms.len()))
                        .map(|terms| Dispersion::Sellmeier(Sellmeier::new(&terms)))
                }
                _ => None,
            };
            let Some(dispersion) = dispersion else {
                let reason = format!(
                    "ior is neither cauchy with 2 or 3 coefficients nor sellmeier with 1 to {SELLMEIER_TERMS} pairs"
                );
                return Err(section.error(ior.span(), &reason, FORMS));
            };
            (dispersion, true)
        }
        value => {
            let reason = format!("ior is a {}", value.type_str());
            return Err(section.error(ior.span(), &reason, FORMS));
        }
    };
    let [least, largest] = dispersion.range();
    if !(least >= 1.0 && largest <= *IOR.end()) {
        let reason = format!("ior is {least} to {largest} for visible light");
        let remedy = "use coefficients for wavelengths in µm, with 1 to 10 from 0.4 to 0.7 µm";
        return Err(section.error(ior.span(), &reason, remedy));
    }
    let disperses = asked.map_or(is_default, |asked| *asked.get_ref());
    Ok((dispersion.index(D_LINE), disperses.then_some(dispersion)))
}

/// Factor on texture coordinates.
pub fn uv_scale(section: &Section, entry: &MaterialEntry) -> Result<DVec2> {
    let Some(scale) = &entry.uv_scale else {
        return Ok(DVec2::ONE);
    };
    let values = *scale.get_ref();
    section.check("uv_scale", &values, scale.span(), UV_SCALE)?;
    Ok(values.into())
}

/// The texture coordinates of a mesh whose material has an albedo map.
///
/// # Errors
/// The reason why they cannot be used.
pub fn uvs_for_map(uvs: &[[DVec2; 3]]) -> Result<Arc<Vec<[DVec2; 3]>>, String> {
    if uvs.is_empty() {
        return Err("the mesh has no texture coordinates (vt)".into());
    }
    // The largest element of a vector with a NaN is another one.
    let finite = |uv: &DVec2| uv.is_finite() && uv.abs().max_element() <= MAX_UV;
    match uvs.as_flattened().iter().filter(|uv| !finite(uv)).count() {
        0 => Ok(Arc::new(uvs.to_vec())),
        bad => Err(format!(
            "{bad} of {} corners have no texture coordinates (vt), or some that are not numbers within ±{MAX_UV}",
            3 * uvs.len()
        )),
    }
}

/// The textures that materials name so far.
#[derive(Default)]
pub struct Textures {
    pub all: Vec<Arc<Texture>>,
    /// Into `all`: materials share an image.
    indices: HashMap<PathBuf, usize>,
}

impl Textures {
    /// Index of the texture in a file.
    pub fn read(&mut self, path: PathBuf, warnings: &mut Vec<String>) -> Result<usize> {
        if let Some(index) = self.indices.get(&path) {
            return Ok(*index);
        }
        self.all.push(Arc::new(texture::read(&path, warnings)?));
        self.indices.insert(path, self.all.len() - 1);
        Ok(self.all.len() - 1)
    }

    /// The map of a material of an MTL file; what cannot be used is left out with a warning.
    pub fn of_mtl(&mut self, map: mtl::Map, warnings: &mut Vec<String>) -> Option<AlbedoMap> {
        match self.read(map.file, warnings) {
            Ok(texture) => Some(AlbedoMap {
                texture,
                uv_scale: map.uv_scale,
            }),
            Err(error) => {
                let reason = error.to_string();
                let reason = reason.lines().next().unwrap_or_default();
                warnings.push(format!("{reason}; the map is left out"));
                None
            }
        }
    }
}
