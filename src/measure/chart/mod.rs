//! Speed against accuracy: what was measured on one device, and the report of it.
//!
//! A [`Chart`] is plain data. [`write()`] turns it into four files that say the same:
//!
//! | file | for |
//! |---|---|
//! | `chart.html` | reading: one page without network, hover for settings, click to hide |
//! | `chart.svg` | a paper or a README |
//! | `chart.csv` | a spreadsheet: one row a point, SI units |
//! | `chart.json` | programs: the [`Chart`] without its pictures |
//!
//! Times and errors of other renderers are read by [`read_peers`].

pub(super) mod csv;
mod data;
pub(super) mod figure;
mod header;
pub(super) mod html;
mod peers;
mod strip;
mod svg;

pub use data::{Chart, DeviceKind, Peer, Point, SCHEMA, SceneChart, Series, pareto};
pub(super) use figure::figure;
pub use peers::read_peers;
pub use strip::{Picture, Strip, Thumbnail};

use crate::error::Result;
use crate::output::write_atomically;
use std::path::Path;

/// Writes `chart.html`, `chart.svg`, `chart.csv` and `chart.json` into the folder `folder`, each
/// whole or not at all.
///
/// # Errors
/// [`crate::Error::Usage`] if `chart` has nothing that can be drawn or a value that is not finite, and
/// [`crate::Error::Output`] where the folder is missing or cannot be written.
pub fn write(chart: &Chart, folder: &Path) -> Result<()> {
    chart.check()?;
    // All four are made before one is written, so that they do not contradict each other.
    let json = serde_json::to_string_pretty(chart).expect("plain data") + "\n";
    let files = [
        ("chart.html", html::page(chart)),
        ("chart.svg", svg::drawing(chart)),
        ("chart.csv", csv::table(chart)),
        ("chart.json", json),
    ];
    for (name, content) in files {
        write_atomically(&folder.join(name), content.as_bytes())?;
    }
    Ok(())
}
