//! Keyframes of a scene file: checked, and made into tables that are read like those without.
//!
//! A key that a keyframe has, all of them have, and the table beside them does not, so that none
//! is given twice and none has to be guessed.

use super::animation::{Keyframes, Motion, Pose};
use super::file::{
    CameraEntry, CameraKeys, KeyframeList, LightEntry, LightKeys, METRES, MotionEntry, PoseKeys,
    Section,
};
use super::mesh;
use super::{Camera, Light, LightKind};
use crate::error::Result;
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::ops::RangeInclusive;
use toml::Spanned;

/// Times, s.
const SECONDS: RangeInclusive<f64> = -1e6..=1e6;
/// Scale of an object in its keyframes.
const SCALE: RangeInclusive<f64> = 1e-3..=1e3;
/// Angles that turn, degrees.
const DEGREES: RangeInclusive<f64> = -1e6..=1e6;
/// Angle between directions that counts as half a turn, short of it, rad.
const OPPOSITE: f64 = 1e-6;

/// One of a list of keyframes.
struct Keyframe<'k, 's, K> {
    /// s
    time: f64,
    keys: &'k K,
    section: Section<'s>,
    list: &'k [Spanned<K>],
}

/// The keyframes of `owner`, whose times have been checked.
fn keyframes<'k, 's, K>(
    owner: &Section<'s>,
    list: &'k KeyframeList<K>,
    time: fn(&K) -> &Option<Spanned<f64>>,
) -> Result<Vec<Keyframe<'k, 's, K>>> {
    let mut found: Vec<Keyframe<K>> = Vec::new();
    for keys in list.get_ref() {
        let section = Section {
            span: keys.span(),
            ..owner.clone()
        };
        let keys = keys.get_ref();
        let seconds = section.number("time", time(keys), SECONDS)?;
        if let Some(before) = found.last().map(|last| last.time)
            && seconds <= before
        {
            let reason = format!("the keyframe at {seconds} s stands after that at {before} s");
            let remedy = "put the keyframes in the order of their times, one for each";
            return Err(section.error(section.at(time(keys)), &reason, remedy));
        }
        found.push(Keyframe {
            time: seconds,
            keys,
            section,
            list: list.get_ref(),
        });
    }
    if found.is_empty() {
        let remedy = "add keyframes, or remove the key";
        return Err(owner.error(list.span(), "there are no keyframes", remedy));
    }
    Ok(found)
}

impl<K> Keyframe<'_, '_, K> {
    /// Puts the keyframe's value of a key into its table.
    fn enter<T: Clone>(
        &self,
        key: &str,
        table: &mut Option<Spanned<T>>,
        get: fn(&K) -> &Option<Spanned<T>>,
    ) -> Result<()> {
        if self.list.iter().all(|keys| get(keys.get_ref()).is_none()) {
            return Ok(());
        }
        if let Some(constant) = table {
            let reason = format!("the key `{key}` is given beside keyframes that have it");
            let remedy = "remove it there or from the keyframes";
            return Err(self.section.error(constant.span(), &reason, remedy));
        }
        *table = Some(self.section.required(key, get(self.keys))?.clone());
        Ok(())
    }
}

/// The camera at all times; `read` reads one table.
pub fn camera(
    section: &Section,
    entry: &CameraEntry,
    read: impl Fn(&Section, &CameraEntry) -> Result<Camera>,
) -> Result<Keyframes<Camera>> {
    let Some(list) = &entry.keyframes else {
        return Ok(Keyframes::constant(read(section, entry)?));
    };
    let mut cameras: Vec<(f64, Camera)> = Vec::new();
    for keyframe in keyframes(section, list, |keys: &CameraKeys| &keys.time)? {
        let mut table = entry.clone();
        keyframe.enter("position", &mut table.position, |keys| &keys.position)?;
        keyframe.enter("target", &mut table.target, |keys| &keys.target)?;
        keyframe.enter("fov_degrees", &mut table.fov_degrees, |keys| {
            &keys.fov_degrees
        })?;
        keyframe.enter("exposure_ev", &mut table.exposure_ev, |keys| {
            &keys.exposure_ev
        })?;
        let camera = read(&keyframe.section, &table)?;
        if let Some((before, last)) = cameras.last()
            && passes_vertical(last.target - last.position, camera.target - camera.position)
        {
            let reason = format!(
                "between {before} s and {} s it looks straight along the y axis, so that up is undefined",
                keyframe.time
            );
            let remedy = "move position or target a little sideways, or add a keyframe between";
            let place = keyframe.section.span.clone();
            return Err(keyframe.section.error(place, &reason, remedy));
        }
        cameras.push((keyframe.time, camera));
    }
    Ok(Keyframes::new(cameras))
}

/// Whether a view that goes from `a` to `b` in a straight line is vertical, or nothing, on its way.
fn passes_vertical(a: DVec3, b: DVec3) -> bool {
    let across = |view: DVec3| DVec2::new(view.x, view.z);
    let (start, way) = (across(a), across(b - a));
    let nearest = match way.length_squared() {
        0.0 => start,
        squared => start - (start.dot(way) / squared).clamp(-1.0, 0.0) * way,
    };
    nearest.length() < 1e-6 * a.length().max(b.length())
}

/// A light at all times; `read` reads one table.
pub fn light(
    section: &Section,
    entry: &LightEntry,
    mut read: impl FnMut(&Section, &LightEntry) -> Result<Light>,
) -> Result<Keyframes<Light>> {
    let Some(list) = &entry.keyframes else {
        return Ok(Keyframes::constant(read(section, entry)?));
    };
    let mut lights: Vec<(f64, Light)> = Vec::new();
    for keyframe in keyframes(section, list, |keys: &LightKeys| &keys.time)? {
        let mut table = entry.clone();
        keyframe.enter("direction", &mut table.direction, |keys| &keys.direction)?;
        keyframe.enter("irradiance", &mut table.irradiance, |keys| &keys.irradiance)?;
        keyframe.enter("position", &mut table.position, |keys| &keys.position)?;
        keyframe.enter("flux", &mut table.flux, |keys| &keys.flux)?;
        keyframe.enter("scale", &mut table.scale, |keys| &keys.scale)?;
        let rotation = &mut table.rotation_degrees;
        keyframe.enter("rotation_degrees", rotation, |keys| &keys.rotation_degrees)?;
        let light = read(&keyframe.section, &table)?;
        if let Some((before, last)) = lights.last()
            && let LightKind::Sun { direction: a, .. } = last.kind
            && let LightKind::Sun { direction: b, .. } = light.kind
            && a.angle_between(b) > PI - OPPOSITE
        {
            let reason = format!(
                "its directions at {before} s and {} s are opposite, so that many ways lead there",
                keyframe.time
            );
            let remedy = "add a keyframe between them";
            let place = keyframe.section.span.clone();
            return Err(keyframe.section.error(place, &reason, remedy));
        }
        lights.push((keyframe.time, light));
    }
    Ok(Keyframes::new(lights))
}

/// How an object moves.
pub fn motion(section: &Section, entry: &Spanned<MotionEntry>) -> Result<Motion> {
    let section = Section {
        span: entry.span(),
        ..section.clone()
    };
    let entry = entry.get_ref();
    let list = section.required("keyframes", &entry.keyframes)?;
    let frames = keyframes(&section, list, |keys: &PoseKeys| &keys.time)?;
    let turns = frames
        .iter()
        .any(|frame| frame.keys.angle_degrees.is_some());
    let axis = match &entry.axis {
        None if !turns => DVec3::Y,
        axis => {
            let vector = section.triple("axis", axis, METRES)?;
            mesh::unit(vector).ok_or_else(|| {
                let remedy = "name a vector to turn about, such as [0.0, 1.0, 0.0]";
                section.error(section.at(axis), "axis has no length", remedy)
            })?
        }
    };
    let mut poses = Vec::new();
    for Keyframe {
        time,
        keys,
        section,
        ..
    } in frames
    {
        let angle = section.number_or(0.0, "angle_degrees", &keys.angle_degrees, DEGREES)?;
        let pose = Pose {
            translation: section.triple_or(
                DVec3::ZERO,
                "translation",
                &keys.translation,
                METRES,
            )?,
            angle: angle.to_radians(),
            scale: section.number_or(1.0, "scale", &keys.scale, SCALE)?,
        };
        poses.push((time, pose));
    }
    Ok(Motion {
        pivot: section.triple_or(DVec3::ZERO, "pivot", &entry.pivot, METRES)?,
        axis,
        poses: Keyframes::new(poses),
    })
}
