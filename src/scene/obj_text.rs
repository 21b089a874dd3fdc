//! The text of an OBJ file, looked at line by line before tobj reads it: tobj's errors name no line,
//! it takes NaN, makes triangles of points and polylines, loses track of normals where some corners
//! have none, and overflows on wild indices. Texture coordinates are kept apart from it.

use crate::error::Result;
use crate::input::at_line;
use glam::DVec2;
use std::collections::BTreeMap;
use std::path::Path;

/// Largest coordinate, m.
const MAX_COORDINATE: f64 = 1e9;

/// What matters of an OBJ file, checked: numbers finite, indices in range.
#[derive(Default)]
pub struct Plain<'a> {
    /// `v`, `vn`, `f` without texture coordinates, `o`, `g` and `usemtl`, one a line.
    pub text: String,
    positions: i64,
    normals: i64,
    textures: Vec<DVec2>,
    /// Texture coordinates of every face's corners, in the order of the file; NaN where there are none
    /// to be used.
    pub corner_uvs: Vec<DVec2>,
    /// Whether any corner has some.
    pub has_uvs: bool,
    pub corners: usize,
    /// Corners without a normal.
    pub bare_corners: usize,
    /// Names of MTL files, and the line that names them first.
    pub libraries: BTreeMap<&'a str, usize>,
    /// Names of materials, and the line that uses them first.
    pub materials: BTreeMap<&'a str, usize>,
    /// Lines left out that would have had an effect.
    pub ignored: usize,
    pub first_ignored: String,
}

impl<'a> Plain<'a> {
    /// # Errors
    /// [`Error::Input`](crate::Error::Input) with the line.
    pub fn of(path: &Path, text: &'a str) -> Result<Self> {
        let mut plain = Self::default();
        for (index, line) in text.lines().enumerate() {
            plain.add(index + 1, line.trim()).map_err(|reason| {
                at_line(
                    path,
                    index + 1,
                    &reason,
                    "correct the line, or export the mesh again",
                )
            })?;
        }
        Ok(plain)
    }

    /// A digest of the faces: the positions of their corners, by number, and their materials.
    pub fn topology(&self) -> blake3::Hash {
        let mut hasher = blake3::Hasher::new();
        for line in self.text.lines() {
            let mut words = line.split(' ');
            match words.next() {
                Some("f") => {
                    for word in words {
                        let position = word.split('/').next().unwrap_or(word);
                        hasher.update(position.as_bytes()).update(b" ");
                    }
                }
                Some("usemtl") => {
                    hasher.update(line.as_bytes());
                }
                _ => continue,
            }
            hasher.update(b"\n");
        }
        hasher.finalize()
    }

    fn add(&mut self, number: usize, line: &'a str) -> Result<(), String> {
        let (keyword, rest) = line.split_once(char::is_whitespace).unwrap_or((line, ""));
        let rest = rest.trim_start();
        match keyword {
            "v" => {
                self.positions += 1;
                // Four numbers are homogeneous coordinates; of six the last are a colour.
                let words = words(rest, &[3, 4, 6])?;
                self.keep(keyword, &words[..if words.len() == 4 { 4 } else { 3 }]);
            }
            "vn" => {
                self.normals += 1;
                self.keep(keyword, &words(rest, &[3])?);
            }
            "vt" => {
                // What is wrong with them matters only to a light map.
                let mut numbers = rest
                    .split_whitespace()
                    .map(|word| word.parse().unwrap_or(f64::NAN));
                let uv = [numbers.next(), numbers.next()].map(|x| x.unwrap_or(f64::NAN));
                self.textures.push(uv.into());
            }
            "f" => {
                let count = rest.split_whitespace().count();
                if count < 3 {
                    return Err(format!("a face has {count} corners, not three or more"));
                }
                let corners = (rest.split_whitespace())
                    .map(|word| corner(word, self.positions, self.normals))
                    .collect::<Result<Vec<_>, _>>()?;
                self.corners += corners.len();
                self.bare_corners += corners
                    .iter()
                    .filter(|corner| !corner.contains('/'))
                    .count();
                self.keep(keyword, &corners);
                for word in rest.split_whitespace() {
                    let uv = self.uv_of(word);
                    self.has_uvs |= uv.is_some();
                    self.corner_uvs.push(uv.unwrap_or(DVec2::NAN));
                }
            }
            "usemtl" | "mtllib" if rest.is_empty() => {
                return Err(format!("`{keyword}` names nothing"));
            }
            "usemtl" => {
                self.materials.entry(rest).or_insert(number);
                self.keep(keyword, &[rest]);
            }
            "mtllib" => {
                self.libraries.entry(rest).or_insert(number);
            }
            "o" | "g" => self.keep(keyword, &[rest]),
            "" | "vp" | "s" | "l" | "p" | "mg" | "lod" | "usemap" | "maplib" => {}
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

    /// Texture coordinates of a corner `v/vt/vn`, if it names any that exist.
    fn uv_of(&self, word: &str) -> Option<DVec2> {
        let index: i64 = word.split('/').nth(1)?.parse().ok()?;
        let place = if index < 0 {
            self.textures.len() as i64 + index
        } else {
            index - 1
        };
        self.textures.get(usize::try_from(place).ok()?).copied()
    }

    fn keep(&mut self, keyword: &str, words: &[impl AsRef<str>]) {
        self.text += keyword;
        for word in words {
            self.text.push(' ');
            self.text += word.as_ref();
        }
        self.text.push('\n');
    }
}

/// The words of a position or normal, checked: so many numbers x, y, z and, if there are four,
/// w, by which they are divided.
fn words<'a>(rest: &'a str, counts: &[usize]) -> Result<Vec<&'a str>, String> {
    let words: Vec<&str> = rest.split_whitespace().collect();
    let numbers = (words.iter())
        .map(|word| {
            word.parse()
                .map_err(|_| format!("`{word}` is not a number"))
        })
        .collect::<Result<Vec<f64>, _>>()?;
    if !counts.contains(&numbers.len()) {
        return Err(format!("there are {} numbers, not three", numbers.len()));
    }
    let w = if numbers.len() == 4 { numbers[3] } else { 1.0 };
    let in_range = |x: &&f64| (*x / w).abs() <= MAX_COORDINATE;
    match numbers[..3].iter().find(|x| !in_range(x)) {
        Some(x) => Err(format!("{} is not within ±{MAX_COORDINATE:e}", x / w)),
        None => Ok(words),
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
