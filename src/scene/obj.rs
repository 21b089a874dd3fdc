//! Wavefront OBJ meshes with their materials.

use super::asset::AssetRoot;
use super::mesh::{Soup, first_of_equals, keep, places, unit};
use super::mtl::{self, Map};
use super::obj_text::{Contents, Corner, NONE, statement};
use super::{MaterialKind, Mesh, memory};
use crate::error::Result;
use crate::input::{self, at_line, refused};
use glam::DVec2;
use std::collections::{BTreeMap, HashSet};
use std::path::{Path, PathBuf};

/// Bytes of a file.
const MAX_BYTES: u64 = 2 << 30;
/// Triangles of a file.
const MAX_TRIANGLES: u64 = 10_000_000;

const NAME_A_MATERIAL: &str = "give the object a `material` of the scene file, which then holds for the whole mesh, \
     or correct the MTL file";

/// A material by the MTL files.
#[derive(Clone)]
pub struct MaterialOfPart {
    pub name: String,
    pub kind: MaterialKind,
    pub map: Option<Map>,
}

/// The triangles of one material.
pub struct Part {
    /// None if the MTL files were not asked for.
    pub material: Option<MaterialOfPart>,
    /// One for each file, all with the same triangles.
    pub meshes: Vec<Mesh>,
    /// Texture coordinates of the triangles' corners, by the first file; empty where it has none.
    pub uvs: Vec<[DVec2; 3]>,
}

/// What one file holds.
struct Content {
    parts: Vec<FilePart>,
    /// Hash of its faces.
    topology: u64,
}

/// A [`Part`] of one file.
struct FilePart {
    material: Option<MaterialOfPart>,
    mesh: Mesh,
    /// Corners of the mesh's triangles, as they are counted in the file where corners are not merged.
    corners: Vec<[u32; 3]>,
    uvs: Vec<[DVec2; 3]>,
}

/// Reads the OBJ files of at least one frame of a mesh, all of one topology: the faces have the same
/// positions by number, the same materials, and are cut into the same triangles. Normals may be
/// numbered otherwise. What corners have in common by chance in one frame does not matter.
///
/// # Errors
/// As [`read`], and where a file's topology is not that of the first.
pub fn read_frames(
    paths: &[PathBuf],
    root: &AssetRoot,
    use_mtl: bool,
    warnings: &mut Vec<String>,
) -> Result<Vec<Part>> {
    let bytes = |path: &PathBuf| path.metadata().map_or(0, |metadata| metadata.len());
    if paths.iter().map(bytes).sum::<u64>() > MAX_BYTES {
        let folder = paths[0].parent().unwrap_or(&paths[0]);
        let reason = format!(
            "its meshes together are larger than {} MiB",
            MAX_BYTES >> 20
        );
        return Err(refused(folder, &reason, "use fewer or coarser meshes"));
    }
    let mut frames = paths.iter().enumerate().map(|(index, path)| {
        let to_follow = Some((paths.len() - 1 - index) as u64);
        let content = read_file(path, root, use_mtl, to_follow, warnings)?;
        Ok((path, content))
    });
    let (first_path, first) = frames.next().expect("a folder with a mesh")?;
    let mut parts: Vec<Part> = (first.parts.iter())
        .map(|part| Part {
            material: part.material.clone(),
            meshes: vec![part.mesh.clone()],
            uvs: part.uvs.clone(),
        })
        .collect();
    for frame in frames {
        let (path, next) = frame?;
        let name = |part: &FilePart| part.material.as_ref().map(|of| of.name.clone());
        let same_part =
            |(a, b): (&FilePart, &FilePart)| a.corners == b.corners && name(a) == name(b);
        let same = next.topology == first.topology
            && next.parts.len() == first.parts.len()
            && next.parts.iter().zip(&first.parts).all(same_part);
        if !same {
            let reason = format!("its topology is not that of {}", first_path.display());
            let remedy = "export all frames with the same faces and materials in the same order, \
                          cut into triangles that all have an area";
            return Err(refused(path, &reason, remedy));
        }
        for (part, next) in parts.iter_mut().zip(next.parts) {
            part.meshes.push(next.mesh);
        }
    }
    let duplicates: usize = parts.iter_mut().map(drop_lasting_duplicates).sum();
    if duplicates > 0 {
        warnings.push(format!(
            "{}: {duplicates} triangles were left out, as in all frames others have the same three corners: their light \
             would count twice",
            first_path.display()
        ));
    }
    Ok(parts)
}

/// Leaves out the triangles of an animated mesh that are duplicates in every frame, and returns their number.
fn drop_lasting_duplicates(part: &mut Part) -> usize {
    let count = part.meshes[0].triangles.len();
    let mut is_kept = vec![false; count];
    for mesh in &part.meshes {
        let places = places(&mesh.positions);
        let triangles = mesh.triangles.iter();
        let first = first_of_equals(triangles.map(|c| c.map(|corner| places[corner as usize])));
        (is_kept.iter_mut().zip(first)).for_each(|(kept, first)| *kept |= first);
    }
    for mesh in &mut part.meshes {
        keep(&mut mesh.triangles, &is_kept);
    }
    if !part.uvs.is_empty() {
        keep(&mut part.uvs, &is_kept);
    }
    count - part.meshes[0].triangles.len()
}

/// Reads an OBJ file. With `use_mtl` its MTL files are read, too, and there is a part for each
/// material used; otherwise the whole file is one part. Groups do not matter. `warnings` gets
/// what was repaired or left out.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input), with the line where there is one.
pub fn read(
    path: &Path,
    root: &AssetRoot,
    use_mtl: bool,
    warnings: &mut Vec<String>,
) -> Result<Vec<Part>> {
    let content = read_file(path, root, use_mtl, None, warnings)?;
    let part = |part: FilePart| Part {
        material: part.material,
        meshes: vec![part.mesh],
        uvs: part.uvs,
    };
    Ok(content.parts.into_iter().map(part).collect())
}

/// `to_follow`: of an animated mesh, the frames after this one. Otherwise corners with equal position
/// and normal become one.
fn read_file(
    path: &Path,
    root: &AssetRoot,
    use_mtl: bool,
    to_follow: Option<u64>,
    warnings: &mut Vec<String>,
) -> Result<Content> {
    let merge = to_follow.is_none();
    let content = input::read(path, MAX_BYTES)?;
    // Old files have comments in other encodings; all that matters is ASCII.
    let text = String::from_utf8_lossy(&content);
    check_size(path, &text, to_follow.unwrap_or(0))?;
    let mut contents = Contents::of(path, text.trim_start_matches('\u{feff}'))?;
    let (materials, maps) = match use_mtl {
        true => read_materials(path, root, &contents, warnings)?,
        false => Default::default(),
    };
    // For each material that the OBJ file uses, its index in the MTL files; the last one of several with that name.
    let numbers: Vec<Option<usize>> = (contents.materials.iter())
        .map(|(name, _)| {
            materials
                .iter()
                .rposition(|material| material.name == *name)
        })
        .collect();
    if use_mtl && let Some(unknown) = numbers.iter().position(Option::is_none) {
        let (name, line) = contents.materials[unknown];
        let reason = format!("no MTL file of this mesh has the material `{name}`");
        return Err(at_line(path, line, &reason, NAME_A_MATERIAL));
    }

    let bare_corners = contents.bare_corners();
    let has_normals = bare_corners == 0;
    if !has_normals {
        contents.normals.clear();
    }
    let mut soup = Soup::new(&contents.positions, &contents.normals);
    let mut materials_of = Vec::with_capacity(contents.faces.len());
    for (face, corners) in contents.polygons() {
        let added = soup.add_polygon(corners).map_err(|reason| {
            let remedy = "cut the polygon into triangles before export";
            at_line(path, face.line as usize, &reason, remedy)
        })?;
        let material = numbers.get(face.material as usize).copied().flatten();
        materials_of.extend(std::iter::repeat_n(material, added));
    }
    // Corners that coincide in one frame of an animation may part in the next.
    let duplicates = match merge {
        true => soup.drop_duplicates(&mut materials_of),
        false => 0,
    };
    // Triangles, and their corners as counted in the file.
    type Triangles = (Vec<[Corner; 3]>, Vec<[u32; 3]>);
    let mut by_material: BTreeMap<Option<usize>, Triangles> = BTreeMap::new();
    for (number, material) in materials_of.into_iter().enumerate() {
        let (triangles, sources) = by_material.entry(material).or_default();
        triangles.push(soup.triangles[number]);
        sources.push(soup.sources[number]);
    }
    if by_material.is_empty() {
        let any = soup.without_area > 0;
        let reason = if any {
            "no face has an area"
        } else {
            "the mesh has no faces"
        };
        return Err(refused(path, reason, "export the mesh with its polygons"));
    }

    let zero_normals = match has_normals {
        true => zero_normals(&contents),
        false => 0,
    };
    let smooth = match has_normals && zero_normals == 0 {
        true => Vec::new(),
        false => soup.smooth_normals(),
    };
    let mut parts = Vec::new();
    let mut behind = 0;
    for (id, (triangles, sources)) in by_material {
        let material = match id {
            Some(id) => {
                let name = materials[id].name.clone();
                let kind = mtl::kind(&materials[id]).map_err(|reason| {
                    let reason = format!("material `{name}`: {reason}");
                    refused(path, &reason, NAME_A_MATERIAL)
                })?;
                let map = mtl::map_of(&materials[id], &kind, &maps);
                Some(MaterialOfPart { name, kind, map })
            }
            None if use_mtl => {
                let reason = "it has faces without a material, before any `usemtl`";
                return Err(refused(path, reason, NAME_A_MATERIAL));
            }
            None => None,
        };
        let (mesh, count) = soup.mesh(&triangles, &smooth, merge);
        behind += count;
        let uv = |corner: Corner| {
            let uv = contents.textures.get(corner.texture as usize);
            uv.copied().unwrap_or(DVec2::NAN)
        };
        let any = triangles
            .as_flattened()
            .iter()
            .any(|corner| corner.texture != NONE);
        let uvs = match any {
            true => (triangles.iter()).map(|corners| corners.map(uv)).collect(),
            false => Vec::new(),
        };
        parts.push(FilePart {
            material,
            mesh,
            corners: sources,
            uvs,
        });
    }

    let ignored = format!(
        "lines are not supported and left out, the first is {}",
        contents.first_ignored
    );
    const COMPUTED: &str = "so all normals were computed: at each vertex the mean of its faces', weighted by the angle of \
         the corner, across all edges";
    let no_normals = bare_corners == contents.corners.len();
    let mixed = format!("corners have no normal, {COMPUTED}");
    let sharp = format!(
        "corners have the normal of their face, at edges too sharp for a mean; the file has no normals, {COMPUTED}"
    );
    for (count, what) in [
        (contents.ignored, ignored.as_str()),
        (if no_normals { 0 } else { bare_corners }, mixed.as_str()),
        (soup.without_area, "triangles without area were left out"),
        (
            duplicates,
            "triangles were left out, as others have the same three corners: their light would count twice",
        ),
        (
            zero_normals,
            "normals of length zero were computed from the faces",
        ),
        (
            behind,
            match no_normals {
                true => sharp.as_str(),
                false => {
                    "corners had a normal behind their face; the winding decides which side is the front"
                }
            },
        ),
    ] {
        if count > 0 {
            warnings.push(format!("{}: {count} {what}", path.display()));
        }
    }
    Ok(Content {
        parts,
        topology: contents.topology(),
    })
}

/// Before any memory is taken for what the file holds.
fn check_size(path: &Path, text: &str, frames_to_follow: u64) -> Result<()> {
    let triangles: u64 = (text.lines())
        .map(|line| match statement(line) {
            ("f", corners) => (corners.split_whitespace().count() as u64).saturating_sub(2),
            _ => 0,
        })
        .sum();
    if triangles > MAX_TRIANGLES {
        let reason = format!("{triangles} triangles are more than {MAX_TRIANGLES}");
        return Err(refused(path, &reason, "use a coarser mesh"));
    }
    let each = memory::TRIANGLE + frames_to_follow * memory::TRIANGLE_OF_FRAME;
    let what = match frames_to_follow {
        0 => format!("{triangles} triangles"),
        _ => format!("{triangles} triangles and as many in {frames_to_follow} frames to follow"),
    };
    memory::check(&what, triangles * each)
        .map_err(|reason| refused(path, &reason, "free some memory, or use a coarser mesh"))
}

/// The materials of all MTL files that the mesh names, and their maps.
fn read_materials(
    path: &Path,
    root: &AssetRoot,
    contents: &Contents,
    warnings: &mut Vec<String>,
) -> Result<(Vec<tobj::Material>, Vec<Map>)> {
    let mut library = String::new();
    let mut maps = Vec::new();
    for (name, &line) in &contents.libraries {
        let mtl = (root.resolve(path, name))
            .map_err(|reason| at_line(path, line, &reason, NAME_A_MATERIAL))?;
        library += &mtl::plain(&mtl, root, &mut maps, warnings)?;
    }
    let (materials, _) = tobj::load_mtl_buf(&mut library.as_bytes())
        .map_err(|e| refused(path, &e.to_string(), "export the materials again"))?;
    Ok((materials, maps))
}

/// Corners, each counted once by position, whose normal has no length.
fn zero_normals(contents: &Contents) -> usize {
    let is_zero = |corner: &&Corner| unit(contents.normals[corner.normal as usize]).is_none();
    let zero = contents.corners.iter().filter(is_zero);
    let pairs: HashSet<[u32; 2]> = zero
        .map(|corner| [corner.position, corner.normal])
        .collect();
    pairs.len()
}
