//! The error targets in `stress.html` and `targets.csv`.

use super::super::chart::csv::{rows_to_csv, text};
use super::super::chart::figure::{Axis, Style, figure, rounded};
use super::super::chart::html::{
    colour, configuration, curve, escape, floor, layout, log_axis, marker, row, symbol,
};
use super::targets::{Summary, TARGETS, TargetPoint};
use plotly::Plot;
use plotly::common::Mode;
use serde::Serialize;

/// One row a point.
pub fn write_table(points: &[TargetPoint]) -> String {
    #[derive(Serialize)]
    struct Row<'a> {
        #[serde(serialize_with = "text")]
        scene: &'a str,
        #[serde(serialize_with = "text")]
        receiver: &'a str,
        width: u32,
        height: u32,
        target: f64,
        estimate: f64,
        l1: f64,
        reference_error: f64,
        energy_ratio: f64,
        patches: u32,
    }
    rows_to_csv(points.iter().map(|point| Row {
        scene: &point.scene,
        receiver: &point.receiver,
        width: point.texels[0],
        height: point.texels[1],
        target: point.target,
        estimate: point.estimate,
        l1: point.l1,
        reference_error: point.reference_error,
        energy_ratio: point.energy_ratio,
        patches: point.patches,
    }))
}

/// What is said of the points of one of the [`TARGETS`]; `None` without any.
pub fn target_sentence(points: &[TargetPoint], target: f64) -> Option<String> {
    Summary::of(of_target(points, target)).map(|summary| sentence(&summary))
}

fn sentence(summary: &Summary) -> String {
    let percent = |share: f64| figure(100.0 * share);
    format!(
        "{} receiver{}: error within the target in {} %, {} of the target on average; estimate within a factor of 2 of the error in {} %",
        summary.points,
        if summary.points == 1 { "" } else { "s" },
        percent(summary.kept),
        figure(summary.mean_use),
        percent(summary.estimated)
    )
}

fn of_target(points: &[TargetPoint], target: f64) -> impl Iterator<Item = &TargetPoint> {
    points.iter().filter(move |point| point.target == target)
}

/// Empty without points.
pub fn section(points: &[TargetPoint]) -> String {
    if points.is_empty() {
        return String::new();
    }
    let lines: String = (TARGETS.iter())
        .filter_map(|&target| {
            let sentence = target_sentence(points, target)?;
            Some(format!(
                "<li><b>{} %</b>: {sentence}.</li>\n",
                rounded(100.0 * target)
            ))
        })
        .collect();
    let rows: String = (points.iter())
        .map(|point| {
            let percent = |value: f64| figure(100.0 * value);
            let [width, height] = point.texels;
            row([
                point.scene.clone(),
                point.receiver.clone(),
                format!("{width} × {height}"),
                percent(point.target),
                percent(point.estimate),
                percent(point.l1),
                percent(point.reference_error),
                format!("{:.5}", point.energy_ratio),
                point.patches.to_string(),
            ])
        })
        .collect();
    format!(
        "<section>\n<h2 id=\"targets\">Error targets</h2>\n<p>The shipped scenes and random ones, with the option <code>--error</code>: \
         what was asked for, what the renderer estimates of itself, and L1 against the reference, without its noise. \
         Receivers whose reference is too uncertain, or that the renderer cannot aim at, are left out.</p>\n\
         <ul class=\"words\">\n{lines}</ul>\n<div class=\"plots\">\n<div class=\"plot\">{}</div>\n</div>\n<details>\n\
         <summary>All figures</summary>\n<table>\n<thead><tr><th>Scene</th><th>Receiver</th><th>Light map</th><th>Target, %</th>\
         <th>Estimate, %</th><th>L1, %</th><th>Reference, %</th><th>Energy ratio</th><th>Patches</th></tr></thead>\n{rows}</table>\n\
         </details>\n</section>\n",
        plot(points).to_inline_html(Some("targets-plot"))
    )
}

/// True over estimated errors, with the line where they are equal.
fn plot(points: &[TargetPoint]) -> Plot {
    const LEAST: f64 = 0.01;
    let place =
        |point: &TargetPoint| [point.estimate, point.l1].map(|error| (100.0 * error).max(LEAST));
    let axis = Axis::of(points.iter().flat_map(place));
    let mut plot = Plot::new();
    let ends = vec![axis.range.start, axis.range.end];
    plot.add_trace(floor("equal", ends.clone(), ends));
    for (number, &target) in TARGETS.iter().enumerate() {
        let style = Style::number(number);
        let of_target: Vec<&TargetPoint> = of_target(points, target).collect();
        let places: Vec<[f64; 2]> = of_target.iter().map(|point| place(point)).collect();
        let texts = (of_target.iter())
            .map(|point| {
                format!(
                    "<b>{}</b>, {}<br>{} patches",
                    escape(&point.scene),
                    escape(&point.receiver),
                    point.patches
                )
            })
            .collect();
        plot.add_trace(
            curve(
                &format!("{} %", rounded(100.0 * target)),
                &places,
                style,
                texts,
            )
            .mode(Mode::Markers)
            .marker(marker(symbol(style.marker), style).color(colour(style))),
        );
    }
    plot.set_layout(layout(
        log_axis(&axis, "estimated error, %"),
        log_axis(&axis, "L1, %"),
    ));
    plot.set_configuration(configuration("targets"));
    plot
}
