//! Wavefront OBJ meshes, read by tobj from a text that has been looked at line by line before:
//! tobj's errors name no line, and it misreads some files and panics on others.

use super::asset::{self, AssetRoot, refused};
use super::mesh::{SmoothNormals, Soup, unit};
use super::{MaterialKind, Mesh, mtl};
use crate::error::{Error, Result};
use glam::DVec3;
use std::collections::BTreeMap;
use std::path::Path;

/// Triangles of a file.
const MAX_TRIANGLES: usize = 10_000_000;
/// Bytes of a file.
const MAX_BYTES: u64 = 1 << 30;
/// Largest coordinate, m.
const MAX_COORDINATE: f64 = 1e9;

const NAME_A_MATERIAL: &str = "give the object a `material` of the scene file, which then holds for the whole mesh, \
     or correct the MTL file";

/// The triangles of one material.
pub struct Part {
    /// Name and kind by the MTL files; none if these were not asked for.
    pub material: Option<(String, MaterialKind)>,
    pub mesh: Mesh,
}

/// Reads an OBJ file. With `use_mtl` its MTL files are read, too, and there is a part for each
/// material used; otherwise the whole file is one part. Groups do not matter. `warnings` gets
/// what was repaired or left out.
///
/// # Errors
/// [`Error::Input`], with the line where there is one.
pub fn read(
    path: &Path,
    root: &AssetRoot,
    use_mtl: bool,
    warnings: &mut Vec<String>,
) -> Result<Vec<Part>> {
    let content = asset::read(path, MAX_BYTES)?;
    // Old files have comments in other encodings; all that matters is ASCII.
    let text = String::from_utf8_lossy(&content);
    let plain = Plain::of(path, text.trim_start_matches('\u{feff}'))?;
    let mut library = String::new();
    if use_mtl {
        for &(line, name) in &plain.libraries {
            let mtl = (root.resolve(path, name))
                .map_err(|reason| at_line(path, line, &reason, NAME_A_MATERIAL))?;
            library += &mtl::plain(&mtl, warnings)?;
        }
    }
    // Where corners have no normal, tobj needs separate indices to keep the positions' right.
    let has_normals = plain.bare_corners == 0;
    let options = tobj::LoadOptions {
        single_index: has_normals,
        ..Default::default()
    };
    let (models, materials) = tobj::load_obj_buf(&mut plain.text.as_bytes(), &options, |_| {
        tobj::load_mtl_buf(&mut library.as_bytes())
    })
    .and_then(|(models, materials)| Ok((models, materials?)))
    .map_err(|e| refused(path, &e.to_string(), "export the mesh again as OBJ"))?;
    if use_mtl {
        for &(line, name) in &plain.materials {
            if !materials.iter().any(|material| material.name == name) {
                let reason =
                    format!("the material `{name}` is in no MTL file that the mesh names before");
                return Err(at_line(path, line, &reason, NAME_A_MATERIAL));
            }
        }
    }

    let mut soup = Soup::default();
    let mut by_material: BTreeMap<Option<usize>, Vec<[u32; 3]>> = BTreeMap::new();
    for model in &models {
        let first = soup.triangles.len();
        add(&mut soup, &model.mesh, has_normals).map_err(|reason| {
            refused(
                path,
                &format!("group `{}`: {reason}", model.name),
                "triangulate the mesh before export",
            )
        })?;
        let triangles = &soup.triangles[first..];
        by_material
            .entry(model.mesh.material_id)
            .or_default()
            .extend(triangles);
    }
    if soup.triangles.is_empty() {
        let reason = if soup.without_area > 0 {
            "no face has an area"
        } else {
            "the mesh has no faces"
        };
        return Err(refused(path, reason, "export the mesh with its polygons"));
    }

    let zero_normals = soup
        .normals
        .iter()
        .filter(|normal| unit(**normal).is_none())
        .count();
    let smooth = if zero_normals > 0 {
        soup.smooth_normals()
    } else {
        SmoothNormals::default()
    };
    let mut parts = Vec::new();
    let mut behind = 0;
    for (material, triangles) in by_material {
        if triangles.is_empty() {
            continue;
        }
        let material = match material {
            Some(id) => {
                let name = materials[id].name.clone();
                let kind = mtl::kind(&materials[id]).map_err(|reason| {
                    refused(
                        path,
                        &format!("material `{name}`: {reason}"),
                        NAME_A_MATERIAL,
                    )
                })?;
                Some((name, kind))
            }
            None if use_mtl => {
                let reason = "there are faces without a material, that is before any `usemtl`";
                return Err(refused(path, reason, NAME_A_MATERIAL));
            }
            None => None,
        };
        let (mesh, count) = soup.mesh(&triangles, &smooth);
        behind += count;
        parts.push(Part { material, mesh });
    }

    let mut warn = |count: usize, what: &str| {
        if count > 0 {
            warnings.push(format!("{}: {count} {what}", path.display()));
        }
    };
    warn(
        plain.ignored,
        &format!(
            "lines left out that are not supported, the first is {}",
            plain.first_ignored
        ),
    );
    if plain.bare_corners < plain.corners {
        warn(
            plain.bare_corners,
            "corners have no normal: all normals were computed from the faces",
        );
    }
    warn(soup.without_area, "triangles without area were left out");
    if has_normals {
        warn(
            zero_normals,
            "normals of length zero were computed from the faces",
        );
    }
    warn(
        behind,
        "corners had a normal behind their face: the winding decides which side is the front",
    );
    Ok(parts)
}

/// Adds a group; corners get the normal zero where the file has none.
fn add(soup: &mut Soup, group: &tobj::Mesh, has_normals: bool) -> Result<(), String> {
    let base = soup.positions.len() as u32;
    soup.positions
        .extend(group.positions.chunks_exact(3).map(DVec3::from_slice));
    if has_normals {
        soup.normals
            .extend(group.normals.chunks_exact(3).map(DVec3::from_slice));
    }
    soup.normals.resize(soup.positions.len(), DVec3::ZERO);
    let mut corners = group.indices.iter().map(|index| base + index);
    if group.face_arities.is_empty() {
        // tobj's way to say that all are triangles.
        while let (Some(a), Some(b), Some(c)) = (corners.next(), corners.next(), corners.next()) {
            soup.add_polygon(&[a, b, c])?;
        }
    }
    for &arity in &group.face_arities {
        let polygon: Vec<u32> = corners.by_ref().take(arity as usize).collect();
        soup.add_polygon(&polygon)?;
    }
    Ok(())
}

/// What matters of an OBJ file, checked: numbers finite, indices in range.
#[derive(Default)]
struct Plain<'a> {
    /// `v`, `vn`, `f` without texture coordinates, `o`, `g`, `usemtl`, one a line.
    text: String,
    corners: usize,
    /// Corners without a normal.
    bare_corners: usize,
    /// Line and name.
    libraries: Vec<(usize, &'a str)>,
    /// Line of the first use, and name.
    materials: Vec<(usize, &'a str)>,
    /// Lines left out that would have had an effect.
    ignored: usize,
    first_ignored: String,
}

impl<'a> Plain<'a> {
    fn of(path: &Path, text: &'a str) -> Result<Self> {
        let mut plain = Self {
            text: "mtllib all\n".into(),
            ..Self::default()
        };
        let (mut positions, mut normals, mut triangles) = (0, 0, 0);
        for (index, line) in text.lines().enumerate() {
            let line = line.trim();
            let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
            let rest = rest.trim_start();
            let refuse = |reason: String| {
                Err(at_line(
                    path,
                    index + 1,
                    &reason,
                    "correct the line, or export the mesh again",
                ))
            };
            match keyword {
                "v" => {
                    positions += 1;
                    // Four numbers are homogeneous, six have a colour.
                    let words: Vec<&str> = rest.split_whitespace().collect();
                    let used = if words.len() == 4 { 4 } else { 3 };
                    if !matches!(words.len(), 3 | 4 | 6) {
                        return refuse(format!(
                            "a position has {} numbers, not three",
                            words.len()
                        ));
                    }
                    if let Err(reason) = coordinates(&words[..used]) {
                        return refuse(reason);
                    }
                    plain.push(keyword, words[..used].iter());
                }
                "vn" => {
                    normals += 1;
                    let words: Vec<&str> = rest.split_whitespace().collect();
                    if words.len() != 3 {
                        return refuse(format!("a normal has {} numbers, not three", words.len()));
                    }
                    if let Err(reason) = coordinates(&words) {
                        return refuse(reason);
                    }
                    plain.push(keyword, words.iter());
                }
                "f" => {
                    let corners: Result<Vec<_>, _> = rest
                        .split_whitespace()
                        .map(|word| corner(word, positions, normals))
                        .collect();
                    let corners = match corners {
                        Ok(corners) if corners.len() >= 3 => corners,
                        Ok(corners) => {
                            return refuse(format!(
                                "a face has {} corners, not three or more",
                                corners.len()
                            ));
                        }
                        Err(reason) => return refuse(reason),
                    };
                    triangles += corners.len() - 2;
                    if triangles > MAX_TRIANGLES {
                        return refuse(format!("the mesh has more than {MAX_TRIANGLES} triangles"));
                    }
                    plain.corners += corners.len();
                    plain.bare_corners += corners
                        .iter()
                        .filter(|corner| !corner.contains('/'))
                        .count();
                    plain.push(keyword, corners.iter());
                }
                "o" | "g" => plain.push(keyword, [rest].iter()),
                "usemtl" => {
                    if rest.is_empty() {
                        return refuse("`usemtl` names no material".into());
                    }
                    if !plain.materials.iter().any(|(_, name)| *name == rest) {
                        plain.materials.push((index + 1, rest));
                    }
                    plain.push(keyword, [rest].iter());
                }
                "mtllib" => plain.libraries.push((index + 1, rest)),
                "" | "vt" | "vp" | "s" | "l" | "p" | "mg" | "lod" | "usemap" | "maplib" => {}
                _ if keyword.starts_with('#') => {}
                _ => {
                    plain.ignored += 1;
                    if plain.ignored == 1 {
                        plain.first_ignored = format!("`{keyword}` on line {}", index + 1);
                    }
                }
            }
        }
        Ok(plain)
    }

    fn push(&mut self, keyword: &str, words: impl Iterator<Item = impl AsRef<str>>) {
        self.text += keyword;
        for word in words {
            self.text.push(' ');
            self.text += word.as_ref();
        }
        self.text.push('\n');
    }
}

/// Checks x, y, z and, if there, w, by which they are divided.
fn coordinates(words: &[&str]) -> Result<(), String> {
    let number = |word: &&str| {
        word.parse::<f64>()
            .map_err(|_| format!("`{word}` is not a number"))
    };
    let numbers = words.iter().map(number).collect::<Result<Vec<_>, _>>()?;
    let w = numbers.get(3).copied().unwrap_or(1.0);
    let in_range = |x: &&f64| (*x / w).abs() <= MAX_COORDINATE;
    match numbers[..3].iter().find(|x| !in_range(x)) {
        Some(x) => Err(format!("{} is not within ±{MAX_COORDINATE:e}", x / w)),
        None => Ok(()),
    }
}

/// A corner `v/vt/vn` as `v` or `v//vn`; negative indices count back from the last.
fn corner(word: &str, positions: i64, normals: i64) -> Result<String, String> {
    let fields: Vec<&str> = word.split('/').collect();
    let check = |index: &str, what: &str, count: i64| match index.parse::<i64>() {
        Ok(i) if (1..=count).contains(&i) || (-count..=-1).contains(&i) => Ok(()),
        Ok(i) => Err(format!(
            "a face uses {what} {i}, but {count} are defined above it"
        )),
        Err(_) => Err(format!("`{word}` is not a corner of a face")),
    };
    check(fields[0], "position", positions)?;
    match fields[..] {
        [v] | [v, _] | [v, _, ""] => Ok(v.into()),
        [v, _, vn] => check(vn, "normal", normals).map(|()| format!("{v}//{vn}")),
        _ => Err(format!("`{word}` is not a corner of a face")),
    }
}

/// An error on a line of a file.
pub fn at_line(path: &Path, line: usize, reason: &str, remedy: &str) -> Error {
    Error::Input {
        file: path.to_owned(),
        place: Some(format!("line {line}")),
        reason: reason.into(),
        remedy: remedy.into(),
    }
}
