//! Points of other renderers, from a file that the user writes.

use super::{Peer, SCHEMA};
use crate::error::{Error, Result};
use crate::input;
use serde::Deserialize;
use std::ops::RangeInclusive;
use std::path::Path;

/// Seconds and errors that have a place on the axes.
const RANGE: RangeInclusive<f64> = 1e-9..=1e9;

#[derive(Deserialize)]
#[serde(deny_unknown_fields)]
struct PeerFile {
    schema: u32,
    peers: Vec<Peer>,
}

/// Reads points of other renderers:
///
/// ```json
/// {
///   "schema": 1,
///   "peers": [
///     {
///       "name": "photon mapper",
///       "version": "1.0",
///       "hardware": "Example GPU 1000",
///       "scene": "ring",
///       "seconds": 0.25,
///       "error": 0.03,
///       "note": "100 k photons"
///     }
///   ]
/// }
/// ```
///
/// `seconds` is wall time, `error` the relative L1 error against the same reference; `note` may be
/// left out. `hardware` is the device or CPU as a chart's header spells it: points from elsewhere
/// are drawn hollow.
///
/// # Errors
/// [`Error::Input`] with line and column if the file is not of this form, and with the entry if a
/// name is empty or a number is below 1e-9 or above 1e9.
pub fn read_peers(path: &Path) -> Result<Vec<Peer>> {
    let refuse = |place: Option<String>, reason: String, remedy: &str| Error::Input {
        file: path.to_owned(),
        place,
        reason,
        remedy: remedy.into(),
    };
    let text = input::read_text(path)?;
    let file: PeerFile = serde_json::from_str(&text).map_err(|e| {
        let place = format!("line {}, column {}", e.line(), e.column());
        // serde_json repeats the place at the end.
        let reason = e.to_string();
        let reason = reason.split(" at line ").next().unwrap_or_default();
        refuse(
            Some(place),
            reason.to_owned(),
            "write {\"schema\": 1, \"peers\": [{\"name\", \"version\", \"hardware\", \"scene\", \
             \"seconds\", \"error\", and perhaps \"note\"}]}",
        )
    })?;
    if file.schema != SCHEMA {
        return Err(refuse(
            Some("schema".into()),
            format!("version {} is not known", file.schema),
            &format!("write the file for schema {SCHEMA}"),
        ));
    }
    for (index, peer) in file.peers.iter().enumerate() {
        let place = |key: &str| Some(format!("entry {} ({}), {key}", index + 1, peer.name));
        for (key, text) in [
            ("name", &peer.name),
            ("hardware", &peer.hardware),
            ("scene", &peer.scene),
        ] {
            if text.trim().is_empty() {
                return Err(refuse(place(key), "it is empty".into(), "fill it in"));
            }
        }
        for (key, value) in [("seconds", peer.seconds), ("error", peer.error)] {
            if !RANGE.contains(&value) {
                return Err(refuse(
                    place(key),
                    format!(
                        "{value:e} is not from {:e} to {:e}",
                        RANGE.start(),
                        RANGE.end()
                    ),
                    "give seconds, and the error over the light: logarithmic axes have no place for others",
                ));
            }
        }
    }
    Ok(file.peers)
}
