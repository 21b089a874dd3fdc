//! What the page and the drawing share: colours, markers, axes, the Pareto front, and figures in
//! words.

use super::{Chart, Peer, Point, SceneChart, pareto};
use std::ops::Range;

/// For any colour vision, sRGB: Okabe and Ito's palette (*Color Universal Design*, 2008) without its
/// yellow, which is too light on white, then two of Tol's *muted* (*Colour Schemes*, 2021).
const COLOURS: [[u8; 3]; 9] = [
    [0x00, 0x72, 0xb2],
    [0xd5, 0x5e, 0x00],
    [0x00, 0x9e, 0x73],
    [0xcc, 0x79, 0xa7],
    [0x56, 0xb4, 0xe9],
    [0xe6, 0x9f, 0x00],
    [0x00, 0x00, 0x00],
    [0x88, 0x22, 0x55],
    [0x99, 0x99, 0x33],
];

/// Shape of a point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::measure) enum Marker {
    Circle,
    Square,
    Diamond,
    TriangleUp,
    TriangleDown,
    Cross,
}

// With the colours, a look repeats after 18 names.
const MARKERS: [Marker; 6] = [
    Marker::Circle,
    Marker::Square,
    Marker::Diamond,
    Marker::TriangleUp,
    Marker::TriangleDown,
    Marker::Cross,
];

/// How a name looks, in all scenes alike.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in crate::measure) struct Style {
    pub colour: [u8; 3],
    pub marker: Marker,
}

impl Style {
    /// The look of the `index`-th name.
    pub fn number(index: usize) -> Self {
        Self {
            colour: COLOURS[index % COLOURS.len()],
            marker: MARKERS[index % MARKERS.len()],
        }
    }
}

/// Names in the legend, methods first.
pub(super) struct Legend(pub Vec<Entry>);

/// One name in the legend.
pub(super) struct Entry {
    pub name: String,
    pub style: Style,
    /// Measured on other hardware.
    pub hollow: bool,
}

impl Legend {
    pub fn of(chart: &Chart) -> Self {
        let methods = (chart.scenes.iter())
            .flat_map(|scene| &scene.series)
            .map(|series| (series.label.clone(), false));
        let peers = (chart.scenes.iter())
            .flat_map(|scene| &scene.peers)
            .map(|peer| (peer_label(chart, peer), !chart.is_local(peer)));
        let mut entries: Vec<Entry> = Vec::new();
        for (name, hollow) in methods.chain(peers) {
            if entries.iter().any(|entry| entry.name == name) {
                continue;
            }
            entries.push(Entry {
                name,
                style: Style::number(entries.len()),
                hollow,
            });
        }
        Self(entries)
    }

    pub fn style(&self, name: &str) -> Style {
        let entry = self.0.iter().find(|entry| entry.name == name);
        entry.expect("made from the same chart").style
    }
}

/// A peer's name in the legend.
pub(super) fn peer_label(chart: &Chart, peer: &Peer) -> String {
    let place = if chart.is_local(peer) {
        ""
    } else {
        ", other hardware"
    };
    format!("{}{place}", peer.title())
}

/// A scene's peers by legend name, in order of first appearance; indices into `scene.peers`.
pub(super) fn peer_groups(chart: &Chart, scene: &SceneChart) -> Vec<(String, Vec<usize>)> {
    let mut groups: Vec<(String, Vec<usize>)> = Vec::new();
    for (index, peer) in scene.peers.iter().enumerate() {
        let name = peer_label(chart, peer);
        match groups.iter_mut().find(|(known, _)| *known == name) {
            Some((_, indices)) => indices.push(index),
            None => groups.push((name, vec![index])),
        }
    }
    groups
}

/// Which points of a scene are on the Pareto front, of all that were measured on this machine.
pub(super) struct Front {
    /// For each series, for each point.
    pub points: Vec<Vec<bool>>,
    pub peers: Vec<bool>,
    /// Time in ms and error in %, by rising time.
    pub line: Vec<[f64; 2]>,
}

impl Front {
    /// Of a checked chart.
    pub fn of(chart: &Chart, scene: &SceneChart) -> Self {
        let peers: Vec<usize> = (0..scene.peers.len())
            .filter(|&i| chart.is_local(&scene.peers[i]))
            .collect();
        let all: Vec<[f64; 2]> = (scene.series.iter())
            .flat_map(|series| &series.points)
            .map(place)
            .chain(peers.iter().map(|&i| peer_place(&scene.peers[i])))
            .collect();
        let front = pareto(&all);
        let mut on_front = vec![false; all.len()];
        front.iter().for_each(|&i| on_front[i] = true);
        let mut rest = on_front.into_iter();
        let points = (scene.series.iter())
            .map(|series| rest.by_ref().take(series.points.len()).collect())
            .collect();
        let mut peers_on_front = vec![false; scene.peers.len()];
        for (&i, on_front) in peers.iter().zip(rest) {
            peers_on_front[i] = on_front;
        }
        Self {
            points,
            peers: peers_on_front,
            line: front.into_iter().map(|i| all[i]).collect(),
        }
    }
}

/// Time in ms and error in %.
pub(super) fn place(point: &Point) -> [f64; 2] {
    [1e3 * point.wall.median, 100.0 * point.l1]
}

/// Time in ms and error in %.
pub(super) fn peer_place(peer: &Peer) -> [f64; 2] {
    [1e3 * peer.seconds, 100.0 * peer.error]
}

/// A logarithmic axis that shows all values with a margin.
#[derive(Debug, Clone)]
pub(in crate::measure) struct Axis {
    pub range: Range<f64>,
    /// Numbered values.
    pub ticks: Vec<f64>,
    /// Values with a thin line.
    pub minor: Vec<f64>,
}

impl Axis {
    pub fn of(values: impl Iterator<Item = f64>) -> Self {
        let (low, high) = values.fold((f64::INFINITY, 0.0f64), |(low, high), value| {
            (low.min(value), high.max(value))
        });
        // At least half a decade, so that one tick is always inside.
        let widen = (0.5 - (high / low).log10()).max(0.0) / 2.0;
        let margin = 0.06 * (high / low).log10() + 0.06 + widen;
        let range = low / 10f64.powf(margin)..high * 10f64.powf(margin);
        let decades = (range.end / range.start).log10();
        let numbered: &[u32] = match decades {
            ..2.1 => &[1, 2, 5],
            ..4.1 => &[1, 3],
            _ => &[1],
        };
        let exponents = range.start.log10().floor() as i32..=range.end.log10().floor() as i32;
        let (mut ticks, mut minor) = (Vec::new(), Vec::new());
        for (exponent, digit) in exponents.flat_map(|e| (1..10).map(move |d| (e, d))) {
            // Parsed, 3e-1 is 0.3; multiplied, it is not.
            let value: f64 = format!("{digit}e{exponent}").parse().expect("a number");
            if !range.contains(&value) {
                continue;
            }
            if numbered.contains(&digit) {
                ticks.push(value);
            } else {
                minor.push(value);
            }
        }
        Self {
            range,
            ticks,
            minor,
        }
    }

    /// Time, ms, with its spread.
    pub fn time(scene: &SceneChart) -> Self {
        let own = (scene.series.iter())
            .flat_map(|series| &series.points)
            .flat_map(|point| [1e3 * point.wall.p05, 1e3 * point.wall.p95]);
        Self::of(own.chain(scene.peers.iter().map(|peer| peer_place(peer)[0])))
    }

    /// L1 error, %, with the reference's own.
    pub fn error(scene: &SceneChart) -> Self {
        let own = (scene.series.iter())
            .flat_map(|series| &series.points)
            .map(|point| place(point)[1]);
        let floor = Some(100.0 * scene.reference_error).filter(|&error| error > 0.0);
        let peers = scene.peers.iter().map(|peer| peer_place(peer)[1]);
        Self::of(own.chain(peers).chain(floor))
    }
}

/// A scene's heading.
pub(super) fn heading(scene: &SceneChart) -> String {
    let [width, height] = scene.light_map;
    format!("{}: {}, {width} × {height}", scene.scene, scene.receiver)
}

pub(super) const TIME_TITLE: &str = "wall time of one update, ms";
pub(super) const ERROR_TITLE: &str = "L1 error, %";
pub(super) const FRONT_TITLE: &str = "Pareto front";
pub(super) const FLOOR_TITLE: &str = "the reference's own error";

/// `value` to three significant digits.
pub(in crate::measure) fn rounded(value: f64) -> f64 {
    format!("{value:.2e}").parse().expect("a number")
}

/// `value` to three significant digits, with zeros at the end and without an exponent.
pub(in crate::measure) fn figure(value: f64) -> String {
    // Rounded first: 9.996 has as many digits before the point as 10.
    let value = rounded(value);
    if value == 0.0 {
        return "0".into();
    }
    let exponent = value.abs().log10().floor() as i32;
    format!("{value:.*}", (2 - exponent).max(0) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn three_significant_digits() {
        for (value, text) in [
            (0.0, "0"),
            (0.012345, "0.0123"),
            (9.996, "10.0"),
            (99.4, "99.4"),
            (123.4, "123"),
            (1234.0, "1230"),
            (-2.0, "-2.00"),
        ] {
            assert_eq!(figure(value), text);
        }
    }

    #[test]
    fn axes_hold_all_values_and_have_a_number() {
        for values in [
            [1.0, 1.0],
            [0.3, 900.0],
            [2.1, 2.9],
            [1e-5, 1e6],
            [7.0, 8.0],
        ] {
            let axis = Axis::of(values.into_iter());
            assert!(values.iter().all(|value| axis.range.contains(value)));
            assert!(!axis.ticks.is_empty() && axis.ticks.len() < 14, "{axis:?}");
            assert!(axis.ticks.iter().all(|tick| axis.range.contains(tick)));
        }
    }
}
