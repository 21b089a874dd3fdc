//! One row a point, SI units and relative errors; what a row does not have is left empty.

use super::super::Spread;
use super::figure::Front;
use super::{Chart, Peer, Point, SceneChart, Series};
use serde::Serialize;

/// Text that a spreadsheet would take for a formula is marked as text by an apostrophe (OWASP, *CSV
/// Injection*).
pub fn text<S: serde::Serializer>(text: &str, serializer: S) -> Result<S::Ok, S::Error> {
    if text.starts_with(['=', '+', '-', '@', '\t', '\r']) {
        return serializer.serialize_str(&format!("'{text}"));
    }
    serializer.serialize_str(text)
}

/// A header and one line a row; the rows mark their text by [`text`].
pub(in crate::measure) fn rows_to_csv(rows: impl IntoIterator<Item: Serialize>) -> String {
    let mut writer = ::csv::Writer::from_writer(Vec::new());
    for row in rows {
        writer.serialize(row).expect("plain data, in memory");
    }
    String::from_utf8(writer.into_inner().expect("in memory")).expect("made of strings")
}

#[derive(Serialize)]
struct Row<'a> {
    #[serde(serialize_with = "text")]
    scene: &'a str,
    #[serde(serialize_with = "text")]
    receiver: &'a str,
    #[serde(serialize_with = "text")]
    renderer: String,
    #[serde(serialize_with = "text")]
    hardware: &'a str,
    #[serde(serialize_with = "text")]
    method: &'a str,
    #[serde(serialize_with = "text")]
    settings: &'a str,
    samples: Option<u64>,
    light_map_width: Option<u32>,
    light_map_height: Option<u32>,
    l1: f64,
    l2: Option<f64>,
    energy_ratio: Option<f64>,
    wall_median_s: f64,
    wall_p05_s: Option<f64>,
    wall_p95_s: Option<f64>,
    gpu_median_s: Option<f64>,
    gpu_p05_s: Option<f64>,
    gpu_p95_s: Option<f64>,
    reference_error: f64,
    above_floor: Option<bool>,
    pareto: bool,
    #[serde(serialize_with = "text")]
    note: &'a str,
}

pub(super) fn table(chart: &Chart) -> String {
    let mut rows = Vec::new();
    for scene in &chart.scenes {
        let front = Front::of(chart, scene);
        for (series, on_front) in scene.series.iter().zip(&front.points) {
            for (point, &on_front) in series.points.iter().zip(on_front) {
                rows.push(row(chart, scene, series, point, on_front));
            }
        }
        for (peer, &on_front) in scene.peers.iter().zip(&front.peers) {
            rows.push(peer_row(scene, peer, on_front));
        }
    }
    rows_to_csv(rows)
}

fn row<'a>(
    chart: &'a Chart,
    scene: &'a SceneChart,
    series: &'a Series,
    point: &'a Point,
    pareto: bool,
) -> Row<'a> {
    let gpu = |part: fn(Spread) -> f64| point.gpu.map(part);
    Row {
        scene: &scene.scene,
        receiver: &scene.receiver,
        renderer: format!("nephroid {}", chart.nephroid),
        hardware: &chart.device,
        method: &series.label,
        settings: &point.settings,
        samples: Some(point.samples),
        light_map_width: Some(point.light_map[0]),
        light_map_height: Some(point.light_map[1]),
        l1: point.l1,
        l2: Some(point.l2),
        energy_ratio: Some(point.energy_ratio),
        wall_median_s: point.wall.median,
        wall_p05_s: Some(point.wall.p05),
        wall_p95_s: Some(point.wall.p95),
        gpu_median_s: gpu(|time| time.median),
        gpu_p05_s: gpu(|time| time.p05),
        gpu_p95_s: gpu(|time| time.p95),
        reference_error: scene.reference_error,
        above_floor: Some(point.above_floor),
        pareto,
        note: point.note.as_deref().unwrap_or_default(),
    }
}

fn peer_row<'a>(scene: &'a SceneChart, peer: &'a Peer, pareto: bool) -> Row<'a> {
    Row {
        scene: &scene.scene,
        receiver: &scene.receiver,
        renderer: peer.title(),
        hardware: &peer.hardware,
        method: "",
        settings: "",
        samples: None,
        light_map_width: None,
        light_map_height: None,
        l1: peer.error,
        l2: None,
        energy_ratio: None,
        wall_median_s: peer.seconds,
        wall_p05_s: None,
        wall_p95_s: None,
        gpu_median_s: None,
        gpu_p05_s: None,
        gpu_p95_s: None,
        reference_error: scene.reference_error,
        above_floor: None,
        pareto,
        note: peer.note.as_deref().unwrap_or_default(),
    }
}

#[cfg(test)]
mod tests {
    use serde::Serialize;

    #[test]
    fn formulas_become_text() {
        #[derive(Serialize)]
        struct Row(#[serde(serialize_with = "super::text")] &'static str);
        let cells = ["=1+1", "@SUM(A1)", "-2", "ring", ""];
        assert_eq!(
            super::rows_to_csv(cells.map(Row)),
            "'=1+1\n'@SUM(A1)\n'-2\nring\n\"\"\n"
        );
    }
}
