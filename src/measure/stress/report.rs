//! `stress.html`, `stress.csv` and `stress.json`.

use super::super::chart::csv::{rows_to_csv, text};
use super::super::chart::figure::{Axis, Style, figure};
use super::super::chart::html::{
    colour, configuration, curve, document, error_key, escape, facts, floor, img, layout, log_axis,
    marker, row, symbol,
};
use super::target_report::{self, write_table};
use super::{CONTENDERS, End, LIMITS, Limit, Point, Report, SweepReport, Verdict, verdicts};
use crate::error::Result;
use crate::output::write_atomically;
use plotly::Plot;
use serde::Serialize;
use std::path::Path;

/// Writes `stress.html`, `stress.csv` and `stress.json` into `folder`, and `targets.csv` if targets were measured, each whole
/// or not at all.
///
/// # Errors
/// [`Error::Output`](crate::Error::Output) where the folder is missing or cannot be written.
pub fn write(report: &Report, folder: &Path) -> Result<()> {
    let json = serde_json::to_string_pretty(report).expect("plain data") + "\n";
    let files = [
        ("stress.html", page(report)),
        ("stress.csv", table(report)),
        ("stress.json", json),
    ];
    for (name, content) in files {
        write_atomically(&folder.join(name), content.as_bytes())?;
    }
    match report.targets.as_slice() {
        [] => Ok(()),
        points => write_atomically(&folder.join("targets.csv"), write_table(points).as_bytes()),
    }
}

/// One row a point, relative measures; what a row does not have is left empty.
fn table(report: &Report) -> String {
    #[derive(Serialize)]
    struct Row<'a> {
        #[serde(serialize_with = "text")]
        sweep: &'a str,
        #[serde(serialize_with = "text")]
        axis: &'a str,
        value: f64,
        #[serde(serialize_with = "text")]
        method: &'a str,
        samples: u32,
        light_map: u32,
        l1: Option<f64>,
        energy_ratio: Option<f64>,
        overshoot: Option<f64>,
        bad_texels: usize,
        flicker: Option<f64>,
        drift: Option<f64>,
        truth_error: f64,
    }
    let mut rows = Vec::new();
    for sweep in &report.sweeps {
        for series in &sweep.series {
            for point in &series.points {
                let index = sweep.values.iter().position(|v| *v == point.value);
                rows.push(Row {
                    sweep: &sweep.name,
                    axis: &sweep.axis,
                    value: point.value,
                    method: &series.method,
                    samples: point.samples,
                    light_map: point.light_map,
                    l1: point.l1,
                    energy_ratio: point.energy_ratio,
                    overshoot: point.overshoot,
                    bad_texels: point.bad_texels,
                    flicker: point.flicker,
                    drift: point.drift,
                    truth_error: index.map_or(0.0, |i| sweep.truth_error[i]),
                });
            }
        }
    }
    rows_to_csv(rows)
}

const STYLE: &str = "
.plots { display: grid; grid-template-columns: repeat(auto-fill, minmax(330px, 1fr)); gap: .4rem; }
.plots .plot { height: 330px; min-width: 0; }
.words li { max-width: 46rem; margin-bottom: .35rem; }
";

fn page(report: &Report) -> String {
    let header = facts(&[
        ("Device", &report.device),
        ("Driver", &report.driver),
        ("CPU", &report.cpu),
        ("nephroid", &report.nephroid),
        ("Commit", report.commit.as_deref().unwrap_or("unknown")),
        ("Date", &report.date),
        (
            "Extent",
            match report.quick {
                true => "quick: few values, coarse maps, rough truths",
                false => "full",
            },
        ),
        ("Schema", &report.schema.to_string()),
    ]);
    let settings: Vec<String> = (CONTENDERS.iter())
        .map(|contender| format!("{} {}", contender.method.name(), contender.samples))
        .collect();
    let introduction = format!(
        "<p>Each section sweeps one parameter through a place where methods fail, at fixed settings. \
         Patches or points asked for: {}. A triangle is at least one patch. Hover over a point for its figures; click a name to hide its curve.</p>\n\
         <p>L1 = Σ|E − E*| / ΣE*. Energy error = |ΣE / ΣE* − 1|. Overshoot = max (E − E*) / max E* over \
         all texels. Flicker = mean |ΔE − ΔE*| / mean E*, Δ from frame to frame. Drift = L1 against the \
         method's own map of the same scene elsewhere. Values of zero are drawn at {} %.</p>\n",
        settings.join(", "),
        figure(100.0 * LEAST),
    );
    let verdicts = verdicts(report);
    let sections: String = (report.sweeps.iter())
        .map(|sweep| section(sweep, &verdicts))
        .collect();
    let body = format!(
        "{header}\n{introduction}{}{}{sections}",
        words(&verdicts),
        target_report::section(&report.targets)
    );
    document("Caustics under stress", STYLE, &body)
}

/// Where each method breaks down, and why.
fn words(verdicts: &[Verdict]) -> String {
    let limits: Vec<String> = (LIMITS.iter())
        .map(|limit| match limit.bound {
            0.0 => format!("no {}", limit.name),
            bound => format!("{} {} %", limit.name, figure(100.0 * bound)),
        })
        .collect();
    let mut text = format!(
        "<section class=\"words\">\n<h2>Where the methods break down</h2>\n<p>Limits: {}.</p>\n",
        limits.join(", ")
    );
    let mut methods: Vec<&str> = verdicts.iter().map(|verdict| verdict.method).collect();
    methods.dedup();
    for method in methods {
        let (broken, sound): (Vec<&Verdict>, Vec<&Verdict>) = (verdicts.iter())
            .filter(|verdict| verdict.method == method)
            .partition(|verdict| !verdict.breaks.is_empty());
        text += &format!("<h3>{}</h3>\n<ul>\n", escape(method));
        for verdict in broken {
            text += &format!(
                "<li><b>{}</b>: {}.</li>\n",
                escape(&verdict.sweep.title),
                escape(&explained(verdict))
            );
        }
        if !sound.is_empty() {
            let titles: Vec<String> = (sound.iter())
                .map(|verdict| escape(&verdict.sweep.title))
                .collect();
            text += &format!("<li>Holds: {}.</li>\n", titles.join("; "));
        }
        text += "</ul>\n";
    }
    text + "</section>\n"
}

fn explained(verdict: &Verdict) -> String {
    let breaks: Vec<String> = verdict.breaks.iter().map(|b| b.sentence()).collect();
    let reason = verdict.reason().unwrap_or("The reason is not known");
    format!("{}. {reason}", breaks.join("; "))
}

fn section(sweep: &SweepReport, verdicts: &[Verdict]) -> String {
    let plots: String = (LIMITS.iter().enumerate())
        .filter_map(|(index, limit)| {
            let id = format!("{}-{index}", sweep.name);
            let plot = plot(sweep, limit)?.to_inline_html(Some(&id));
            Some(format!("<div class=\"plot\">{plot}</div>\n"))
        })
        .collect();
    let lines: String = (verdicts.iter())
        .filter(|verdict| verdict.sweep.name == sweep.name)
        .map(|verdict| {
            let breaks = match verdict.breaks.is_empty() {
                true => "holds".into(),
                false => explained(verdict),
            };
            format!(
                "<li><b>{}</b>: {}. {}.</li>\n",
                escape(verdict.method),
                escape(&verdict.course),
                escape(&breaks)
            )
        })
        .collect();
    let ends: String = (sweep.ends.iter())
        .map(|end| pictures(&sweep.axis, end))
        .collect();
    let worst = sweep.truth_error.iter().fold(0.0f64, |a, b| a.max(*b));
    format!(
        "<section>\n<h2 id=\"{name}\">{title}</h2>\n<p>{setup} The truth is good to {worst} %.</p>\n\
         <div class=\"plots\">\n{plots}</div>\n<ul class=\"words\">\n{lines}</ul>\n{ends}{figures}</section>\n",
        name = escape(&sweep.name),
        title = escape(&sweep.title),
        setup = escape(&sweep.setup),
        worst = figure(100.0 * worst),
        figures = figures(sweep),
    )
}

/// What is less, and so has no place on a logarithmic axis, is drawn here.
const LEAST: f64 = 1e-6;

/// A measure of all methods; `None` where there is none, or nothing but zeros.
fn plot(sweep: &SweepReport, limit: &Limit) -> Option<Plot> {
    let place = |point: &Point| Some([point.value, 100.0 * (limit.of)(point)?.max(LEAST)]);
    let places: Vec<Vec<[f64; 2]>> = (sweep.series.iter())
        .map(|series| series.points.iter().filter_map(place).collect())
        .collect();
    let all: Vec<[f64; 2]> = places.iter().flatten().copied().collect();
    if all.iter().all(|[_, y]| *y <= 100.0 * LEAST) {
        return None;
    }
    let mut plot = Plot::new();
    let bound = 100.0 * limit.bound.max(LEAST);
    let ends = [sweep.values.first()?, sweep.values.last()?].map(|v| *v);
    plot.add_trace(floor("limit", ends.to_vec(), vec![bound; 2]));
    for (number, (series, places)) in sweep.series.iter().zip(&places).enumerate() {
        let style = Style::number(number);
        let texts = (series.points.iter())
            .filter(|point| (limit.of)(point).is_some())
            .map(|point| hover(sweep, &series.method, point))
            .collect();
        plot.add_trace(
            curve(&series.method, places, style, texts)
                .marker(marker(symbol(style.marker), style).color(colour(style))),
        );
    }
    let x = Axis::of(sweep.values.iter().copied());
    let y = Axis::of(all.iter().map(|[_, y]| *y).chain([bound]));
    // From left to right as the story goes.
    let mut x_axis = log_axis(&x, &escape(&sweep.axis));
    if ends[0] > ends[1] {
        x_axis = x_axis.range(vec![x.range.end.log10(), x.range.start.log10()]);
    }
    let title = format!("{}, %", limit.name);
    plot.set_layout(layout(x_axis, log_axis(&y, &title)));
    plot.set_configuration(configuration(&format!("{}_{}", sweep.name, limit.name)));
    Some(plot)
}

fn percent(value: Option<f64>) -> String {
    value.map_or("–".into(), |value| figure(100.0 * value))
}

fn hover(sweep: &SweepReport, method: &str, point: &Point) -> String {
    let mut lines = vec![
        format!("<b>{}</b>", escape(method)),
        format!("{}: {}", escape(&sweep.axis), point.value),
        format!("{} samples, light map {}²", point.samples, point.light_map),
    ];
    for limit in &LIMITS {
        lines.extend((limit.of)(point).map(|v| format!("{} {} %", limit.name, figure(100.0 * v))));
    }
    lines.join("<br>")
}

fn pictures(axis: &str, end: &End) -> String {
    let mut figures = format!(
        "<figure>{}<figcaption>truth</figcaption></figure>\n",
        img(&end.truth, "light map of the truth")
    );
    for (method, map, error) in &end.maps {
        let method = escape(method);
        figures += &format!(
            "<figure>{}{}<figcaption>{method}</figcaption></figure>\n",
            img(map, &format!("light map of {method}")),
            img(error, &format!("error of {method}")),
        );
    }
    format!(
        "<div class=\"strips\">\n<h3>{} {}</h3>\n{}<div class=\"strip\">\n{figures}</div>\n</div>\n",
        escape(axis),
        end.value,
        error_key(end.error_scale),
    )
}

/// All figures, for paper and for those who do not hover.
fn figures(sweep: &SweepReport) -> String {
    let mut rows = String::new();
    for series in &sweep.series {
        for point in &series.points {
            rows += &row([
                series.method.clone(),
                point.value.to_string(),
                point.samples.to_string(),
                format!("{0} × {0}", point.light_map),
                percent(point.l1),
                (point.energy_ratio).map_or("–".into(), |ratio| format!("{ratio:.5}")),
                percent(point.overshoot),
                point.bad_texels.to_string(),
                percent(point.flicker),
                percent(point.drift),
            ]);
        }
    }
    format!(
        "<details>\n<summary>All figures</summary>\n<table>\n<thead><tr><th>Method</th><th>{}</th>\
         <th>Samples</th><th>Light map</th><th>L1, %</th><th>Energy ratio</th><th>Overshoot, %</th>\
         <th>Bad texels</th><th>Flicker, %</th><th>Drift, %</th></tr></thead>\n{rows}</table>\n\
         </details>\n",
        escape(&sweep.axis)
    )
}
