//! The text of a scene file: its TOML schema, and errors that name line and column.

use crate::error::{Error, Result};
use glam::DVec3;
use serde::de::{self, Visitor};
use serde::{Deserialize, Deserializer};
use std::fmt;
use std::ops::{Range, RangeInclusive};
use std::path::Path;
use toml::{Spanned, Value};

/// Version of the format that this program reads.
pub const VERSION: i64 = 1;

/// Coordinates, m.
pub const METRES: RangeInclusive<f64> = -1e9..=1e9;

/// `[x, y, z]` or `[red, green, blue]`.
pub type Triple = Spanned<[f64; 3]>;

/// Keyframes, as written.
pub type KeyframeList<K> = Spanned<Vec<Spanned<K>>>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneEntry {
    #[allow(dead_code, reason = "judged before the rest is read")]
    version: Value,
    pub max_interfaces: Option<Spanned<i64>>,
    pub camera: Spanned<CameraEntry>,
    #[serde(default)]
    pub light: Vec<LightEntry>,
    #[serde(default)]
    pub material: Vec<MaterialEntry>,
    #[serde(default)]
    pub object: Vec<ObjectEntry>,
}

#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraEntry {
    pub position: Option<Triple>,
    pub target: Option<Triple>,
    pub fov_degrees: Option<Spanned<f64>>,
    pub exposure_ev: Option<Spanned<f64>>,
    pub keyframes: Option<KeyframeList<CameraKeys>>,
}

/// A keyframe of the camera.
#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraKeys {
    pub time: Option<Spanned<f64>>,
    pub position: Option<Triple>,
    pub target: Option<Triple>,
    pub fov_degrees: Option<Spanned<f64>>,
    pub exposure_ev: Option<Spanned<f64>>,
}

/// A light; which keys it has depends on `kind`.
#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightEntry {
    pub name: Spanned<String>,
    pub kind: Spanned<String>,
    pub direction: Option<Triple>,
    pub irradiance: Option<Triple>,
    pub angular_radius_degrees: Option<Spanned<f64>>,
    pub position: Option<Triple>,
    pub radius: Option<Spanned<f64>>,
    pub flux: Option<Triple>,
    pub file: Option<Spanned<String>>,
    pub scale: Option<Spanned<f64>>,
    pub rotation_degrees: Option<Spanned<f64>>,
    pub caustics: Option<Spanned<bool>>,
    pub keyframes: Option<KeyframeList<LightKeys>>,
}

/// A keyframe of a light; which keys it has depends on the light's `kind`.
#[derive(Clone, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightKeys {
    pub time: Option<Spanned<f64>>,
    pub direction: Option<Triple>,
    pub irradiance: Option<Triple>,
    pub position: Option<Triple>,
    pub flux: Option<Triple>,
    pub scale: Option<Spanned<f64>>,
    pub rotation_degrees: Option<Spanned<f64>>,
}

/// A material; which keys it has depends on `kind`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialEntry {
    pub name: Spanned<String>,
    pub kind: Spanned<String>,
    pub reflectance: Option<Triple>,
    pub albedo: Option<Triple>,
    /// A number, the name of a medium, three numbers, or coefficients.
    pub ior: Option<Spanned<Value>>,
    pub dispersion: Option<Spanned<bool>>,
    pub absorption: Option<Triple>,
    pub priority: Option<Spanned<i64>>,
    pub thin: Option<Spanned<bool>>,
    pub albedo_map: Option<Spanned<String>>,
    pub uv_scale: Option<Spanned<[f64; 2]>>,
    pub metal: Option<Spanned<String>>,
    pub index: Option<Triple>,
    pub extinction: Option<Triple>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectEntry {
    pub name: Spanned<String>,
    pub mesh: Option<Spanned<String>>,
    pub frames: Option<Spanned<FramesEntry>>,
    pub rect: Option<Spanned<RectEntry>>,
    pub waves: Option<Spanned<WavesEntry>>,
    pub material: Option<Spanned<String>>,
    pub lightmap: Option<Spanned<LightMapEntry>>,
    pub blocks_light: Option<bool>,
    pub motion: Option<Spanned<MotionEntry>>,
}

/// `[width, height]` or `"auto"`.
pub enum LightMapEntry {
    Texels([i64; 2]),
    Auto,
}

impl<'de> Deserialize<'de> for LightMapEntry {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> std::result::Result<Self, D::Error> {
        struct Entry;

        impl<'de> Visitor<'de> for Entry {
            type Value = LightMapEntry;

            fn expecting(&self, formatter: &mut fmt::Formatter) -> fmt::Result {
                formatter.write_str("`[width, height]` or `\"auto\"`")
            }

            fn visit_str<E: de::Error>(self, text: &str) -> std::result::Result<LightMapEntry, E> {
                match text {
                    "auto" => Ok(LightMapEntry::Auto),
                    _ => Err(E::invalid_value(de::Unexpected::Str(text), &self)),
                }
            }

            fn visit_seq<A: de::SeqAccess<'de>>(
                self,
                sides: A,
            ) -> std::result::Result<LightMapEntry, A::Error> {
                let sides = de::value::SeqAccessDeserializer::new(sides);
                Deserialize::deserialize(sides).map(LightMapEntry::Texels)
            }
        }

        deserializer.deserialize_any(Entry)
    }
}

/// A folder of meshes.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FramesEntry {
    pub folder: Option<Spanned<String>>,
    pub fps: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MotionEntry {
    pub pivot: Option<Triple>,
    pub axis: Option<Triple>,
    pub keyframes: Option<KeyframeList<PoseKeys>>,
}

/// A keyframe of an object.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PoseKeys {
    pub time: Option<Spanned<f64>>,
    pub translation: Option<Triple>,
    pub angle_degrees: Option<Spanned<f64>>,
    pub scale: Option<Spanned<f64>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RectEntry {
    pub origin: Option<Triple>,
    pub edge_u: Option<Triple>,
    pub edge_v: Option<Triple>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct WavesEntry {
    pub origin: Option<Triple>,
    pub edge_u: Option<Triple>,
    pub edge_v: Option<Triple>,
    pub quads: Option<Spanned<[i64; 2]>>,
    #[serde(default)]
    pub sines: Vec<Spanned<SineEntry>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SineEntry {
    pub amplitude: Option<Spanned<f64>>,
    pub wave_vector: Option<Spanned<[f64; 2]>>,
    pub phase_degrees: Option<Spanned<f64>>,
    pub speed: Option<Spanned<f64>>,
}

/// A scene file's path and text, for errors that say where.
pub struct Source<'a> {
    pub path: &'a Path,
    pub text: &'a str,
}

impl Source<'_> {
    /// The entries as written; what they mean is not checked yet.
    pub fn parse(&self) -> Result<SceneEntry> {
        /// Judged first: another version may have other keys.
        #[derive(Deserialize)]
        struct Head {
            version: Option<Spanned<Value>>,
        }
        let head: Head = toml::from_str(self.text).map_err(|e| self.syntax_error(&e))?;
        let version = head.version.ok_or_else(|| {
            let empty = self.text.trim().is_empty();
            let reason = if empty {
                "the file is empty"
            } else {
                "the key `version` is missing"
            };
            self.error(
                0..0,
                reason,
                &format!("start the scene file with `version = {VERSION}`"),
            )
        })?;
        if *version.get_ref() != Value::Integer(VERSION) {
            let reason = format!("version {} is not supported", version.get_ref());
            let remedy = format!("this program reads `version = {VERSION}`");
            return Err(self.error(version.span(), &reason, &remedy));
        }
        toml::from_str(self.text).map_err(|e| self.syntax_error(&e))
    }

    fn syntax_error(&self, error: &toml::de::Error) -> Error {
        let remedy = "correct the scene file there; the keys are those of scene format version 1";
        let reason = error.message().replace('\n', ", ");
        self.error(error.span().unwrap_or(0..0), &reason, remedy)
    }

    /// An error at a range of bytes of the text.
    pub fn error(&self, span: Range<usize>, reason: &str, remedy: &str) -> Error {
        let before = (self.text.get(..span.start)).unwrap_or(self.text);
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().unwrap_or("").chars().count() + 1;
        Error::Input {
            file: self.path.to_owned(),
            place: Some(format!("line {line}, column {column}")),
            reason: reason.into(),
            remedy: remedy.into(),
        }
    }
}

/// The keys of one table; all its errors start with its name.
#[derive(Clone)]
pub struct Section<'a> {
    pub source: &'a Source<'a>,
    /// As in `light "sun"`.
    pub owner: String,
    /// Where the owner stands.
    pub span: Range<usize>,
}

impl Section<'_> {
    /// An error at one of the keys.
    pub fn error(&self, span: Range<usize>, reason: &str, remedy: &str) -> Error {
        let reason = format!("{}: {reason}", self.owner);
        self.source.error(span, &reason, remedy)
    }

    /// Where a key stands, or its owner where the key is missing.
    pub fn at<T>(&self, value: &Option<Spanned<T>>) -> Range<usize> {
        value.as_ref().map_or(self.span.clone(), Spanned::span)
    }

    /// A key that has to be there.
    pub fn required<'k, T>(&self, key: &str, value: &'k Option<T>) -> Result<&'k T> {
        value.as_ref().ok_or_else(|| {
            let reason = format!("the key `{key}` is missing");
            self.error(
                self.span.clone(),
                &reason,
                &format!("add `{key} = ...` to it"),
            )
        })
    }

    /// A number within a range.
    pub fn number(
        &self,
        key: &str,
        value: &Option<Spanned<f64>>,
        range: RangeInclusive<f64>,
    ) -> Result<f64> {
        let value = self.required(key, value)?;
        self.check(key, &[*value.get_ref()], value.span(), range)?;
        Ok(*value.get_ref())
    }

    /// A number within a range, or `default` where there is none.
    pub fn number_or(
        &self,
        default: f64,
        key: &str,
        value: &Option<Spanned<f64>>,
        range: RangeInclusive<f64>,
    ) -> Result<f64> {
        if value.is_none() {
            Ok(default)
        } else {
            self.number(key, value, range)
        }
    }

    /// Three numbers within a range.
    pub fn triple(
        &self,
        key: &str,
        value: &Option<Triple>,
        range: RangeInclusive<f64>,
    ) -> Result<DVec3> {
        let value = self.required(key, value)?;
        self.check(key, value.get_ref(), value.span(), range)?;
        Ok(DVec3::from(*value.get_ref()))
    }

    /// Three numbers within a range, or `default` where there are none.
    pub fn triple_or(
        &self,
        default: DVec3,
        key: &str,
        value: &Option<Triple>,
        range: RangeInclusive<f64>,
    ) -> Result<DVec3> {
        if value.is_none() {
            Ok(default)
        } else {
            self.triple(key, value, range)
        }
    }

    pub fn check(
        &self,
        key: &str,
        values: &[f64],
        span: Range<usize>,
        range: RangeInclusive<f64>,
    ) -> Result<()> {
        // No range contains NaN.
        match values.iter().find(|value| !range.contains(value)) {
            None => Ok(()),
            Some(value) => {
                let (low, high) = (range.start(), range.end());
                let reason = format!("{key}: {value} is not within {low} and {high}");
                Err(self.error(span, &reason, "correct the number"))
            }
        }
    }

    /// Refuses a key that is there although an owner of this kind does not have it.
    pub fn refuse<T>(&self, kind: &str, key: &str, value: &Option<Spanned<T>>) -> Result<()> {
        match value {
            None => Ok(()),
            Some(value) => {
                let reason = format!("the kind `{kind}` has no key `{key}`");
                Err(self.error(value.span(), &reason, "remove the key"))
            }
        }
    }
}
