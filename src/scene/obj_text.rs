//! The text of an OBJ file as numbers, checked line by line, so that errors name the line.
//!
//! tobj reads the MTL files only: of meshes it takes NaN, makes triangles of points and polylines, loses track of
//! normals where some corners have none, overflows on wild indices, and names no line.

use crate::error::Result;
use crate::input::at_line;
use glam::{DVec2, DVec3};
use std::collections::BTreeMap;
use std::hash::{DefaultHasher, Hash, Hasher};
use std::path::Path;

/// Largest coordinate, m.
const MAX_COORDINATE: f64 = 1e9;

/// In the place of an index.
pub const NONE: u32 = u32::MAX;

/// A corner of a face: indices from 0, or [`NONE`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Corner {
    pub position: u32,
    pub normal: u32,
    pub texture: u32,
}

/// A polygon.
#[derive(Debug, Clone, Copy)]
pub struct Face {
    /// Its corners end here; they begin where those of the face before end.
    pub end: u32,
    /// Index into [`Contents::materials`], or [`NONE`].
    pub material: u32,
    /// In the file.
    pub line: u32,
}

/// What matters of an OBJ file, checked: numbers finite, indices in range.
#[derive(Default)]
pub struct Contents<'a> {
    /// m
    pub positions: Vec<DVec3>,
    /// Normals of any length.
    pub normals: Vec<DVec3>,
    /// NaN where they are malformed, which matters only to light maps.
    pub textures: Vec<DVec2>,
    pub corners: Vec<Corner>,
    pub faces: Vec<Face>,
    /// Names of MTL files, and the line that names them first.
    pub libraries: BTreeMap<&'a str, usize>,
    /// Names of materials in the order of their first use, and the line of that.
    pub materials: Vec<(&'a str, usize)>,
    /// Lines left out that would have had an effect.
    pub ignored: usize,
    pub first_ignored: String,
    /// The material in use.
    material: Option<u32>,
}

/// The keyword of a line of an OBJ or MTL file and what follows it, without the comment behind numbers. Names may have a `#`.
pub fn statement(line: &str) -> (&str, &str) {
    let line = line.trim();
    let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
    match keyword {
        "v" | "vn" | "vt" | "f" | "Kd" | "Ks" | "Ni" | "illum" | "d" | "Tr" | "Ke" => {
            (keyword, rest.split('#').next().unwrap_or_default().trim())
        }
        _ => (keyword, rest.trim_start()),
    }
}

impl<'a> Contents<'a> {
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) with the line.
    pub fn of(path: &Path, text: &'a str) -> Result<Self> {
        let mut contents = Self::default();
        for (index, line) in text.lines().enumerate() {
            contents.add(index + 1, line).map_err(|reason| {
                at_line(
                    path,
                    index + 1,
                    &reason,
                    "correct the line, or export the mesh again",
                )
            })?;
        }
        Ok(contents)
    }

    /// Each face with its corners.
    pub fn polygons(&self) -> impl Iterator<Item = (&Face, &[Corner])> {
        let mut start = 0;
        self.faces.iter().map(move |face| {
            let corners = &self.corners[start..face.end as usize];
            start = face.end as usize;
            (face, corners)
        })
    }

    /// Corners without a normal.
    pub fn bare_corners(&self) -> usize {
        self.corners
            .iter()
            .filter(|corner| corner.normal == NONE)
            .count()
    }

    /// A digest of the faces: the positions of their corners, by number, and their materials.
    pub fn topology(&self) -> u64 {
        let mut hasher = DefaultHasher::new();
        for (face, corners) in self.polygons() {
            let name = (self.materials.get(face.material as usize)).map_or("", |(name, _)| name);
            name.hash(&mut hasher);
            corners.len().hash(&mut hasher);
            for corner in corners {
                corner.position.hash(&mut hasher);
            }
        }
        hasher.finish()
    }

    fn add(&mut self, number: usize, line: &'a str) -> Result<(), String> {
        let (keyword, rest) = statement(line);
        match keyword {
            // Four numbers are homogeneous coordinates; of six the last are a colour.
            "v" => self.positions.push(vector(rest, &[3, 4, 6])?),
            "vn" => self.normals.push(vector(rest, &[3])?),
            "vt" => {
                let mut numbers = rest
                    .split_whitespace()
                    .map(|word| word.parse().unwrap_or(f64::NAN));
                let uv = [numbers.next(), numbers.next()].map(|x| x.unwrap_or(f64::NAN));
                self.textures.push(uv.into());
            }
            "f" => {
                let first = self.corners.len();
                for word in rest.split_whitespace() {
                    let corner = self.corner(word)?;
                    self.corners.push(corner);
                }
                let count = self.corners.len() - first;
                if count < 3 {
                    return Err(format!("a face has {count} corners, not three or more"));
                }
                self.faces.push(Face {
                    end: self.corners.len() as u32,
                    material: self.material.unwrap_or(NONE),
                    line: number as u32,
                });
            }
            "usemtl" | "mtllib" if rest.is_empty() => {
                return Err(format!("`{keyword}` names nothing"));
            }
            "usemtl" => {
                let known = self.materials.iter().position(|(name, _)| *name == rest);
                let index = known.unwrap_or_else(|| {
                    self.materials.push((rest, number));
                    self.materials.len() - 1
                });
                self.material = Some(index as u32);
            }
            "mtllib" => {
                self.libraries.entry(rest).or_insert(number);
            }
            "" | "o" | "g" | "vp" | "s" | "l" | "p" | "mg" | "lod" | "usemap" | "maplib" => {}
            _ if keyword.starts_with('#') => {}
            _ => {
                self.ignored += 1;
                if self.ignored == 1 {
                    self.first_ignored = format!("`{keyword}` on line {number}");
                }
            }
        }
        Ok(())
    }

    /// A corner `v`, `v/vt`, `v//vn` or `v/vt/vn`; negative indices count back from the last.
    fn corner(&self, word: &str) -> Result<Corner, String> {
        let malformed = || format!("`{word}` is not a corner of a face");
        let index = |text: &str, what: &str, count: usize| -> Result<u32, String> {
            let number: i64 = text.parse().map_err(|_| malformed())?;
            placed(number, count).ok_or_else(|| {
                format!("a face uses {what} {number}, but {count} are defined above it")
            })
        };
        let mut fields = word.split('/');
        let position = index(
            fields.next().unwrap_or(""),
            "position",
            self.positions.len(),
        )?;
        // What is wrong with texture coordinates matters only to a light map.
        let texture = (fields.next())
            .and_then(|text| placed(text.parse().ok()?, self.textures.len()))
            .unwrap_or(NONE);
        let normal = match fields.next() {
            None | Some("") => NONE,
            Some(text) => index(text, "normal", self.normals.len())?,
        };
        match fields.next() {
            None => Ok(Corner {
                position,
                normal,
                texture,
            }),
            Some(_) => Err(malformed()),
        }
    }
}

/// The index from 0 of number `number`, from 1 or from the end, of `count`.
fn placed(number: i64, count: usize) -> Option<u32> {
    let count = count as i64;
    let index = if number < 0 {
        count + number
    } else {
        number - 1
    };
    (0..count).contains(&index).then_some(index as u32)
}

/// A position or normal, checked: so many numbers x, y, z and, if there are four, w, by which they are divided.
fn vector(rest: &str, counts: &[usize]) -> Result<DVec3, String> {
    let mut numbers = [0.0; 6];
    let mut count = 0;
    for word in rest.split_whitespace() {
        let number: f64 = (word.parse()).map_err(|_| format!("`{word}` is not a number"))?;
        if let Some(place) = numbers.get_mut(count) {
            *place = number;
        }
        count += 1;
    }
    if !counts.contains(&count) {
        return Err(format!("there are {count} numbers, not three"));
    }
    let [x, y, z, w, ..] = numbers;
    let vector = DVec3::new(x, y, z) / if count == 4 { w } else { 1.0 };
    // NaN is not within anything.
    let is_out = |x: &f64| !(-MAX_COORDINATE..=MAX_COORDINATE).contains(x);
    match vector.to_array().into_iter().find(is_out) {
        Some(x) => Err(format!("{x} is not within ±{MAX_COORDINATE:e}")),
        None => Ok(vector),
    }
}
