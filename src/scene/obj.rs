//! Wavefront OBJ meshes, read by tobj from a text that has been looked at line by line before:
//! tobj's errors name no line, and it misreads some files and panics on others.

use super::asset::AssetRoot;
use super::mesh::{Soup, first_of_equals, keep, places, unit};
use super::obj_text::Plain;
use super::{MaterialKind, Mesh, memory, mtl};
use crate::error::Result;
use crate::input::{self, at_line, refused};
use glam::{DVec2, DVec3};
use std::collections::{BTreeMap, HashSet};
use std::io::Read;
use std::path::{Path, PathBuf};

/// Bytes of a file.
const MAX_BYTES: u64 = 2 << 30;
/// Triangles of a file.
const MAX_TRIANGLES: u64 = 10_000_000;

const NAME_A_MATERIAL: &str = "give the object a `material` of the scene file, which then holds for the whole mesh, \
     or correct the MTL file";

/// The triangles of one material.
pub struct Part {
    /// Name and kind by the MTL files; none if these were not asked for.
    pub material: Option<(String, MaterialKind)>,
    /// One for each file, all with the same triangles.
    pub meshes: Vec<Mesh>,
    /// Texture coordinates of the triangles' corners, by the first file; empty where it has none.
    pub uvs: Vec<[DVec2; 3]>,
}

/// What one file holds.
struct Content {
    parts: Vec<FilePart>,
    /// Of its faces.
    topology: blake3::Hash,
}

/// A [`Part`] of one file.
struct FilePart {
    material: Option<(String, MaterialKind)>,
    mesh: Mesh,
    /// Of the mesh's triangles, as they are counted in the file where corners are not merged.
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
        let name = |part: &FilePart| part.material.as_ref().map(|(name, _)| name.clone());
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
    check_size(path, &content, to_follow.unwrap_or(0))?;
    // Old files have comments in other encodings; all that matters is ASCII.
    let text = String::from_utf8_lossy(&content);
    let plain = Plain::of(path, text.trim_start_matches('\u{feff}'))?;
    let mut library = String::new();
    if use_mtl {
        for (name, &line) in &plain.libraries {
            let mtl = (root.resolve(path, name))
                .map_err(|reason| at_line(path, line, &reason, NAME_A_MATERIAL))?;
            library += &mtl::plain(&mtl, warnings)?;
        }
    }
    let has_normals = plain.bare_corners == 0;
    let (models, materials) = parse(&plain.text, &library, has_normals)
        .map_err(|e| refused(path, &e.to_string(), "export the mesh again as OBJ"))?;
    if use_mtl {
        let known: HashSet<&str> = materials.iter().map(|m| m.name.as_str()).collect();
        if let Some((name, &line)) = plain
            .materials
            .iter()
            .find(|(name, _)| !known.contains(*name))
        {
            let reason = format!("no MTL file of this mesh has the material `{name}`");
            return Err(at_line(path, line, &reason, NAME_A_MATERIAL));
        }
    }

    let mut soup = Soup::default();
    // Number of the first triangle of each group, and its material.
    let mut groups: Vec<(usize, Option<usize>)> = Vec::new();
    for model in &models {
        groups.push((soup.triangles.len(), model.mesh.material_id));
        add(&mut soup, &model.mesh, has_normals, merge).map_err(|reason| {
            let reason = format!("group `{}`: {reason}", model.name);
            refused(
                path,
                &reason,
                "cut the polygon into triangles before export",
            )
        })?;
    }
    let of_triangle = |number: usize| {
        let after = groups.partition_point(|(first, _)| *first <= number);
        groups[after - 1].1
    };
    let mut materials_of: Vec<Option<usize>> = (0..soup.triangles.len()).map(of_triangle).collect();
    // What corners have in common in one frame of an animation they may not have in the next.
    let places = soup.places();
    let duplicates = match merge {
        true => soup.drop_duplicates(&places, &mut materials_of),
        false => 0,
    };
    // Triangles, and their corners as counted in the file.
    type Triangles = (Vec<[u32; 3]>, Vec<[u32; 3]>);
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

    let zero_normals = soup
        .normals
        .iter()
        .filter(|normal| unit(**normal).is_none())
        .count();
    let smooth = if zero_normals > 0 {
        soup.smooth_normals(&places)
    } else {
        Vec::new()
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
                Some((name, kind))
            }
            None if use_mtl => {
                let reason = "it has faces without a material, before any `usemtl`";
                return Err(refused(path, reason, NAME_A_MATERIAL));
            }
            None => None,
        };
        let (mesh, count) = soup.mesh(&triangles, &places, &smooth, merge);
        behind += count;
        let uv = |corner: u32| plain.corner_uvs[corner as usize];
        let uvs = match plain.has_uvs {
            true => (sources.iter()).map(|corners| corners.map(uv)).collect(),
            false => Vec::new(),
        };
        parts.push(FilePart {
            material,
            mesh,
            corners: triangles,
            uvs,
        });
    }

    let ignored = format!(
        "lines are not supported and left out, the first is {}",
        plain.first_ignored
    );
    let flat = "corners are at edges too sharp to smooth, and keep the normal of their face";
    for (count, what) in [
        (plain.ignored, ignored.as_str()),
        (
            if has_normals { 0 } else { plain.bare_corners },
            "corners have no normal, so all normals were computed: at each vertex the mean of its faces', weighted by \
             the angle of the corner, across all edges",
        ),
        (soup.without_area, "triangles without area were left out"),
        (
            duplicates,
            "triangles were left out, as others have the same three corners: their light would count twice",
        ),
        (
            if has_normals { zero_normals } else { 0 },
            "normals of length zero were computed from the faces",
        ),
        (
            behind,
            match has_normals {
                true => {
                    "corners had a normal behind their face; the winding decides which side is the front"
                }
                false => flat,
            },
        ),
    ] {
        if count > 0 {
            warnings.push(format!("{}: {count} {what}", path.display()));
        }
    }
    Ok(Content {
        parts,
        topology: plain.topology(),
    })
}

/// Before any memory is taken for what the file holds.
fn check_size(path: &Path, content: &[u8], frames_to_follow: u64) -> Result<()> {
    let triangles: u64 = (content.split(|byte| *byte == b'\n'))
        .map(|line| {
            let mut words = (line.split(u8::is_ascii_whitespace)).filter(|word| !word.is_empty());
            match words.next() {
                Some(b"f") => (words.count() as u64).saturating_sub(2),
                _ => 0,
            }
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

/// Without `has_normals` only positions and faces are right in what comes back.
fn parse(
    text: &str,
    library: &str,
    has_normals: bool,
) -> Result<(Vec<tobj::Model>, Vec<tobj::Material>), tobj::LoadError> {
    // Where some corners have no normal, a single index would pair the normals with the wrong
    // positions.
    let options = tobj::LoadOptions {
        single_index: has_normals,
        ..Default::default()
    };
    let mut text = "mtllib library\n".as_bytes().chain(text.as_bytes());
    let (models, materials) = tobj::load_obj_buf(&mut text, &options, |_| {
        tobj::load_mtl_buf(&mut library.as_bytes())
    })?;
    Ok((models, materials?))
}

/// Adds a group; corners get the normal zero where the file has none. Where not `merge`, every
/// corner has a position of its own.
fn add(soup: &mut Soup, group: &tobj::Mesh, has_normals: bool, merge: bool) -> Result<(), String> {
    let base = soup.positions.len() as u32;
    let vectors = |values: &[f64]| -> Vec<DVec3> {
        let all = values.chunks_exact(3).map(DVec3::from_slice);
        match merge {
            true => all.collect(),
            false => {
                let all: Vec<DVec3> = all.collect();
                group.indices.iter().map(|i| all[*i as usize]).collect()
            }
        }
    };
    soup.positions.extend(vectors(&group.positions));
    if has_normals {
        soup.normals.extend(vectors(&group.normals));
    }
    soup.normals.resize(soup.positions.len(), DVec3::ZERO);
    let indices = (0u32..).zip(&group.indices);
    let mut corners = indices.map(|(count, index)| base + if merge { *index } else { count });
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
