//! The text of a scene file: its TOML schema, and errors that name line and column.

use crate::error::{Error, Result};
use serde::Deserialize;
use std::ops::Range;
use std::path::Path;
use toml::{Spanned, Value};

/// Version of the format that this program reads.
pub const VERSION: i64 = 1;

/// `[x, y, z]` or `[red, green, blue]`.
pub type Triple = Spanned<[f64; 3]>;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SceneEntry {
    #[allow(dead_code, reason = "read by `parse` before the rest")]
    version: Value,
    pub camera: CameraEntry,
    #[serde(default)]
    pub light: Vec<LightEntry>,
    #[serde(default)]
    pub material: Vec<MaterialEntry>,
    #[serde(default)]
    pub object: Vec<ObjectEntry>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CameraEntry {
    pub position: Triple,
    pub target: Triple,
    pub fov_degrees: Spanned<f64>,
    pub exposure_ev: Option<Spanned<f64>>,
}

/// A light; which keys it needs depends on `kind`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LightEntry {
    pub name: Spanned<String>,
    pub kind: Spanned<String>,
    pub direction: Option<Triple>,
    pub irradiance: Option<Triple>,
    pub angular_radius_degrees: Option<Spanned<f64>>,
    pub file: Option<Spanned<String>>,
    pub scale: Option<Spanned<f64>>,
    pub rotation_degrees: Option<Spanned<f64>>,
}

/// A material; which keys it needs depends on `kind`.
#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct MaterialEntry {
    pub name: Spanned<String>,
    pub kind: Spanned<String>,
    pub reflectance: Option<Triple>,
    pub albedo: Option<Triple>,
    pub ior: Option<Spanned<Value>>,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectEntry {
    pub name: Spanned<String>,
    pub mesh: Option<Spanned<String>>,
    pub rect: Option<Spanned<RectEntry>>,
    pub waves: Option<Spanned<Value>>,
    pub material: Option<Spanned<String>>,
    pub lightmap: Option<Spanned<[i64; 2]>>,
    #[serde(default = "yes")]
    pub blocks_light: bool,
}

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RectEntry {
    pub origin: Triple,
    pub edge_u: Triple,
    pub edge_v: Triple,
}

fn yes() -> bool {
    true
}

/// A scene file's path and text, for errors that say where.
pub struct Source<'a> {
    pub path: &'a Path,
    pub text: &'a str,
}

impl Source<'_> {
    /// The entries as written; what they mean is not checked yet.
    pub fn parse(&self) -> Result<SceneEntry> {
        /// The version alone comes first: another version may have other keys.
        #[derive(Deserialize)]
        struct Head {
            version: Option<Spanned<Value>>,
        }
        let head: Head = toml::from_str(self.text).map_err(|e| self.syntax_error(&e))?;
        let version = head.version.ok_or_else(|| {
            let reason = if self.text.trim().is_empty() {
                "the file is empty"
            } else {
                "the key `version` is missing"
            };
            self.error(0..0, reason, "start the scene file with `version = 1`")
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
