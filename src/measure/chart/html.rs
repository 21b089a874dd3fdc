//! `chart.html`: one page that needs no network. Plots are plotly's, whose script is in the page.

use super::super::Spread;
use super::figure::{
    Axis, ERROR_TITLE, FLOOR_TITLE, FRONT_TITLE, Front, Legend, Marker, Style, TIME_TITLE, figure,
    heading, peer_groups, peer_label, peer_place, place, rounded,
};
use super::strip::DIVERGING;
use super::{Chart, DeviceKind, Peer, Picture, Point, SceneChart, Strip};
use crate::image_file::encode_png;
use plotly::color::Rgb;
use plotly::common::{
    self, Anchor, DashType, ErrorData, ErrorType, Font, HoverInfo, Line, LineShape, MarkerSymbol,
    Mode, Orientation, Title,
};
use plotly::configuration::{ImageButtonFormats, ToImageButtonOptions};
use plotly::layout::{self, AxisType, HoverMode, Margin, TicksDirection};
use plotly::{Configuration, Layout, Plot, Scatter};

const BLACK: &str = "#111";
const WHITE: &str = "#fff";
const GREY: &str = "#6e6e6e";
const PALE: &str = "#d6d6d6";
const GRID: &str = "#e6e6e6";

pub(super) fn page(chart: &Chart) -> String {
    let legend = Legend::of(chart);
    let sections: String = (chart.scenes.iter().enumerate())
        .map(|(index, scene)| section(chart, scene, &legend, index))
        .collect();
    let introduction = "<p>Lower left is better. Times are medians, bars from the 5th to the 95th percentile. Hover over a
point for its settings; click a name in the legend to hide its curve, twice to show it alone. Faint
points are within the reference's own error, so a bound; hollow ones were measured on other
hardware, so their times do not compare.</p>";
    let body = format!("{}\n{introduction}\n{sections}", header(chart));
    document("Caustics: speed against accuracy", "", &body)
}

/// A page of its own, with plotly.js in it, for the parts that the functions below make. `style`
/// is CSS besides the common one.
pub(in crate::measure) fn document(title: &str, style: &str, body: &str) -> String {
    format!(
        r#"<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="default-src 'none'; script-src 'unsafe-inline'; style-src 'unsafe-inline'; img-src data: blob:">
<meta name="viewport" content="width=device-width">
<title>{title}</title>
<style>
{common}{style}</style>
{library}
</head>
<body>
<h1>{title}</h1>
{body}<script>
{script}</script>
</body>
</html>
"#,
        common = include_str!("chart.css"),
        library = library(),
        script = include_str!("chart.js"),
    )
}

/// The script element with plotly.js, which comes with the plotly crate. The one after it is
/// MathJax, 2 MB, which no label needs.
fn library() -> String {
    let mut scripts = Plot::offline_js_sources();
    let end = "</script>";
    if let Some(at) = scripts.find(end) {
        scripts.truncate(at + end.len());
    }
    scripts
}

/// Text as HTML, also within quotes. By number, as plotly knows few names.
pub(in crate::measure) fn escape(text: &str) -> String {
    (text.replace('&', "&amp;").replace('<', "&lt;"))
        .replace('>', "&gt;")
        .replace('"', "&#34;")
}

fn header(chart: &Chart) -> String {
    let kind = match chart.kind {
        DeviceKind::Software => "software: shaders run on the CPU, so no GPU's times",
        DeviceKind::Hardware => "hardware",
    };
    let commit = chart.commit.as_deref().unwrap_or("unknown");
    facts(&[
        ("Device", chart.device.as_str()),
        ("Kind", kind),
        ("Driver", &chart.driver),
        ("CPU", &chart.cpu),
        ("nephroid", &chart.nephroid),
        ("Commit", commit),
        ("Date", &chart.date),
        ("Schema", &chart.schema.to_string()),
    ])
}

/// Names and values as a list.
pub(in crate::measure) fn facts(rows: &[(&str, &str)]) -> String {
    let rows: String = (rows.iter())
        .map(|(name, value)| format!("<dt>{name}</dt><dd>{}</dd>\n", escape(value)))
        .collect();
    format!("<dl>\n{rows}</dl>")
}

fn section(chart: &Chart, scene: &SceneChart, legend: &Legend, index: usize) -> String {
    let id = format!("plot-{index}");
    let floor = match scene.reference_error {
        0.0 => "in closed form".into(),
        error => format!("good to {} %", rounded(100.0 * error)),
    };
    let strips: String = scene.strips.iter().map(strip).collect();
    format!(
        "<section>\n<h2>{heading}</h2>\n<div>Reference {floor}.</div>\n\
         <div class=\"plot\">{plot}</div>\n{verdicts}{peers}{strips}{table}</section>\n",
        heading = escape(&heading(scene)),
        plot = plot(chart, scene, legend).to_inline_html(Some(&id)),
        verdicts = verdicts(scene),
        peers = peers_elsewhere(chart, scene),
        table = table(chart, scene),
    )
}

fn plot(chart: &Chart, scene: &SceneChart, legend: &Legend) -> Plot {
    let [time, error] = [Axis::time(scene), Axis::error(scene)];
    let front = Front::of(chart, scene);
    let mut plot = Plot::new();

    let (x, y) = front.line.iter().map(|[x, y]| (*x, *y)).unzip();
    plot.add_trace(
        Scatter::new(x, y)
            .name(FRONT_TITLE)
            .mode(Mode::Lines)
            .line(Line::new().shape(LineShape::Hv).width(7.0).color(PALE))
            .hover_info(HoverInfo::Skip),
    );
    if scene.reference_error > 0.0 {
        let y = 100.0 * scene.reference_error;
        let ends = vec![time.range.start, time.range.end];
        plot.add_trace(floor(FLOOR_TITLE, ends, vec![y, y]));
    }
    for (series, on_front) in scene.series.iter().zip(&front.points) {
        let style = legend.style(&series.label);
        let points = &series.points;
        let spread = |part: fn(&Spread) -> f64| -> Vec<f64> {
            points.iter().map(|p| 1e3 * part(&p.wall)).collect()
        };
        let bars = ErrorData::new(ErrorType::Data)
            .symmetric(false)
            .array(spread(|time| time.p95 - time.median))
            .array_minus(spread(|time| time.median - time.p05))
            .color(colour(style))
            .thickness(1.2)
            .width(3);
        let fills: Vec<Rgb> = (points.iter())
            .map(|point| match point.above_floor {
                true => colour(style),
                false => faint(style),
            })
            .collect();
        let texts = (points.iter().zip(on_front))
            .map(|(point, &on_front)| hover(&series.label, point, on_front))
            .collect();
        let places: Vec<_> = points.iter().map(place).collect();
        plot.add_trace(
            curve(&series.label, &places, style, texts)
                .marker(marker(symbol(style.marker), style).color_array(fills))
                .error_x(bars),
        );
    }
    for (name, indices) in peer_groups(chart, scene) {
        let style = legend.style(&name);
        let peers: Vec<&Peer> = indices.iter().map(|&i| &scene.peers[i]).collect();
        let places: Vec<_> = peers.iter().map(|peer| peer_place(peer)).collect();
        let texts = (peers.iter().zip(&indices))
            .map(|(peer, &i)| hover_peer(chart, peer, front.peers[i]))
            .collect();
        let symbol = match chart.is_local(peers[0]) {
            true => symbol(style.marker),
            false => open_symbol(style.marker),
        };
        plot.add_trace(
            curve(&name, &places, style, texts).marker(marker(symbol, style).color(colour(style))),
        );
    }
    plot.set_layout(layout(
        log_axis(&time, TIME_TITLE),
        log_axis(&error, ERROR_TITLE),
    ));
    plot.set_configuration(configuration(&scene.scene));
    plot
}

/// `file` names the picture that a reader may save.
pub(in crate::measure) fn configuration(file: &str) -> Configuration {
    Configuration::new()
        .responsive(true)
        .display_logo(false)
        .typeset_math(false)
        .to_image_button_options(
            ToImageButtonOptions::new()
                .format(ImageButtonFormats::Svg)
                .filename(file),
        )
}

/// A dashed grey line.
pub(in crate::measure) fn floor(name: &str, x: Vec<f64>, y: Vec<f64>) -> Box<Scatter<f64, f64>> {
    Scatter::new(x, y)
        .name(name)
        .mode(Mode::Lines)
        .line(Line::new().dash(DashType::Dash).width(1.5).color(GREY))
        .hover_info(HoverInfo::Skip)
}

pub(in crate::measure) fn curve(
    name: &str,
    places: &[[f64; 2]],
    style: Style,
    hover: Vec<String>,
) -> Box<Scatter<f64, f64>> {
    let (x, y) = places.iter().map(|[x, y]| (*x, *y)).unzip();
    Scatter::new(x, y)
        .name(escape(name))
        .mode(Mode::LinesMarkers)
        .line(Line::new().width(2.0).color(colour(style)))
        .hover_info(HoverInfo::Text)
        .hover_text_array(hover)
}

/// A logarithmic axis.
pub(in crate::measure) fn log_axis(axis: &Axis, title: &str) -> layout::Axis {
    plain_axis(title)
        .type_(AxisType::Log)
        .range(vec![axis.range.start.log10(), axis.range.end.log10()])
        .tick_values(axis.ticks.clone())
        .tick_text(axis.ticks.iter().map(f64::to_string).collect::<Vec<_>>())
}

/// A linear axis that plotly numbers.
pub(in crate::measure) fn plain_axis(title: &str) -> layout::Axis {
    layout::Axis::new()
        .title(Title::with_text(title))
        .ticks(TicksDirection::Outside)
        .show_line(true)
        .mirror(true)
        .line_color(GREY)
        .grid_color(GRID)
        .zero_line(false)
}

pub(in crate::measure) fn layout(x: layout::Axis, y: layout::Axis) -> Layout {
    Layout::new()
        .x_axis(x)
        .y_axis(y)
        .hover_mode(HoverMode::Closest)
        .hover_label(
            common::Label::new()
                .background_color(WHITE)
                .font(Font::new().color(BLACK).size(13)),
        )
        .legend(
            layout::Legend::new()
                .orientation(Orientation::Horizontal)
                .x(0.0)
                .y(1.02)
                .x_anchor(Anchor::Left)
                .y_anchor(Anchor::Bottom),
        )
        .font(Font::new().family("system-ui, sans-serif").size(13))
        .margin(Margin::new().left(70).right(20).top(30).bottom(55))
        .paper_background_color(WHITE)
        .plot_background_color(WHITE)
        .auto_size(true)
}

pub(in crate::measure) fn colour(style: Style) -> Rgb {
    let [r, g, b] = style.colour;
    Rgb::new(r, g, b)
}

fn faint(style: Style) -> Rgb {
    let [r, g, b] = style.colour.map(|c| c / 2 + 127);
    Rgb::new(r, g, b)
}

pub(in crate::measure) fn marker(symbol: MarkerSymbol, style: Style) -> common::Marker {
    common::Marker::new()
        .symbol(symbol)
        .size(10)
        .line(Line::new().width(1.5).color(colour(style)))
}

pub(in crate::measure) fn symbol(marker: Marker) -> MarkerSymbol {
    match marker {
        Marker::Circle => MarkerSymbol::Circle,
        Marker::Square => MarkerSymbol::Square,
        Marker::Diamond => MarkerSymbol::Diamond,
        Marker::TriangleUp => MarkerSymbol::TriangleUp,
        Marker::TriangleDown => MarkerSymbol::TriangleDown,
        Marker::Cross => MarkerSymbol::Cross,
    }
}

fn open_symbol(marker: Marker) -> MarkerSymbol {
    match marker {
        Marker::Circle => MarkerSymbol::CircleOpen,
        Marker::Square => MarkerSymbol::SquareOpen,
        Marker::Diamond => MarkerSymbol::DiamondOpen,
        Marker::TriangleUp => MarkerSymbol::TriangleUpOpen,
        Marker::TriangleDown => MarkerSymbol::TriangleDownOpen,
        Marker::Cross => MarkerSymbol::CrossOpen,
    }
}

/// Median and percentiles, ms.
fn milliseconds(time: &Spread) -> String {
    let [median, p05, p95] = [time.median, time.p05, time.p95].map(|t| figure(1e3 * t));
    format!("{median} ({p05}–{p95})")
}

fn hover(label: &str, point: &Point, on_front: bool) -> String {
    let [width, height] = point.light_map;
    let mut lines = vec![
        format!("<b>{}</b>", escape(label)),
        escape(&point.settings),
        format!("{} samples, light map {width} × {height}", point.samples),
        format!(
            "L1 {} %, L2 {} %, energy ratio {:.4}",
            figure(100.0 * point.l1),
            figure(100.0 * point.l2),
            point.energy_ratio
        ),
        format!("wall {} ms", milliseconds(&point.wall)),
    ];
    lines.extend((point.gpu.as_ref()).map(|time| format!("GPU {} ms", milliseconds(time))));
    if !point.above_floor {
        lines.push("within the reference's own error: a bound".into());
    }
    if on_front {
        lines.push("on the Pareto front".into());
    }
    lines.extend(point.note.as_deref().map(escape));
    lines.join("<br>")
}

fn hover_peer(chart: &Chart, peer: &Peer, on_front: bool) -> String {
    let mut lines = vec![
        format!("<b>{}</b>", escape(&peer_label(chart, peer))),
        escape(&peer.hardware),
        format!("L1 {} %", figure(100.0 * peer.error)),
        format!("wall {} ms", figure(1e3 * peer.seconds)),
    ];
    if on_front {
        lines.push("on the Pareto front".into());
    }
    lines.extend(peer.note.as_deref().map(escape));
    lines.join("<br>")
}

fn verdicts(scene: &SceneChart) -> String {
    let items: String = (scene.verdicts.iter())
        .map(|verdict| format!("<li>{}</li>\n", escape(verdict)))
        .collect();
    match items.is_empty() {
        true => items,
        false => format!("<ul class=\"verdicts\">\n{items}</ul>\n"),
    }
}

fn peers_elsewhere(chart: &Chart, scene: &SceneChart) -> String {
    let items: String = (scene.peers.iter())
        .filter(|peer| !chart.is_local(peer))
        .map(|peer| {
            format!(
                "<li>{} on {}: {} ms, L1 {} %</li>\n",
                escape(&peer.title()),
                escape(&peer.hardware),
                figure(1e3 * peer.seconds),
                figure(100.0 * peer.error)
            )
        })
        .collect();
    if items.is_empty() {
        return items;
    }
    format!("<h3>Measured on other hardware</h3>\n<ul>\n{items}</ul>\n")
}

fn strip(strip: &Strip) -> String {
    let figures: String = (strip.thumbnails.iter())
        .map(|thumbnail| {
            let label = escape(&thumbnail.label);
            format!(
                "<figure>{}{}<figcaption>{label}<br>{} ms, L1 {} %</figcaption></figure>\n",
                img(&thumbnail.light_map, &format!("light map of {label}")),
                img(&thumbnail.error, &format!("error of {label}")),
                figure(1e3 * thumbnail.seconds),
                figure(100.0 * thumbnail.l1),
            )
        })
        .collect();
    format!(
        "<div class=\"strips\">\n<h3>In about {} ms</h3>\n{}\
         <div class=\"strip\">\n{figures}</div>\n</div>\n",
        rounded(1e3 * strip.seconds),
        error_key(strip.error_scale),
    )
}

/// What the colours of error maps mean that saturate at `scale`, W/m².
pub(in crate::measure) fn error_key(scale: f64) -> String {
    let stops: Vec<String> = (DIVERGING.iter())
        .map(|[r, g, b]| format!("rgb({r},{g},{b})"))
        .collect();
    let scale = rounded(scale);
    format!(
        "<div class=\"scale\">Error: −{scale} \
         <i style=\"background: linear-gradient(to right, {})\"></i> +{scale} W/m²</div>\n",
        stops.join(", "),
    )
}

pub(in crate::measure) fn img(picture: &Picture, alt: &str) -> String {
    let Picture { width, height, rgb } = picture;
    match encode_png(*width, *height, rgb) {
        Ok(png) if !rgb.is_empty() => format!(
            "<img src=\"data:image/png;base64,{}\" width=\"{width}\" height=\"{height}\" \
             alt=\"{alt}\">",
            base64(&png)
        ),
        // Charts read from JSON have no pictures.
        _ => String::new(),
    }
}

/// RFC 4648, section 4.
fn base64(bytes: &[u8]) -> String {
    const DIGITS: &[u8; 64] = b"ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    (bytes.chunks(3))
        .flat_map(|chunk| {
            let group = (0..3).fold(0, |group, i| {
                group << 8 | u32::from(*chunk.get(i).unwrap_or(&0))
            });
            (0..4).map(move |i| match i <= chunk.len() {
                true => char::from(DIGITS[(group >> (18 - 6 * i) & 63) as usize]),
                false => '=',
            })
        })
        .collect()
}

/// A row of a table.
pub(in crate::measure) fn row<const N: usize>(cells: [String; N]) -> String {
    let cells: String = (cells.iter())
        .map(|cell| format!("<td>{}</td>", escape(cell)))
        .collect();
    format!("<tr>{cells}</tr>\n")
}

/// All figures of a scene, for paper and for those who do not hover.
fn table(chart: &Chart, scene: &SceneChart) -> String {
    let front = Front::of(chart, scene);
    let mark = |on_front: bool| {
        if on_front {
            "✓".into()
        } else {
            String::new()
        }
    };
    let mut rows = String::new();
    for (series, on_front) in scene.series.iter().zip(&front.points) {
        for (point, &on_front) in series.points.iter().zip(on_front) {
            let bound = if point.above_floor { "" } else { "≤ " };
            let settings = match &point.note {
                Some(note) => format!("{}; {note}", point.settings),
                None => point.settings.clone(),
            };
            rows += &row([
                series.label.clone(),
                point.samples.to_string(),
                format!("{} × {}", point.light_map[0], point.light_map[1]),
                milliseconds(&point.wall),
                point.gpu.as_ref().map_or(String::new(), milliseconds),
                format!("{bound}{}", figure(100.0 * point.l1)),
                figure(100.0 * point.l2),
                format!("{:.4}", point.energy_ratio),
                mark(on_front),
                settings,
            ]);
        }
    }
    for (peer, &on_front) in scene.peers.iter().zip(&front.peers) {
        rows += &row([
            peer_label(chart, peer),
            String::new(),
            String::new(),
            figure(1e3 * peer.seconds),
            String::new(),
            figure(100.0 * peer.error),
            String::new(),
            String::new(),
            mark(on_front),
            peer.note.clone().unwrap_or_default(),
        ]);
    }
    format!(
        "<details>\n<summary>All figures</summary>\n<table>\n<thead><tr><th>Method</th><th>Samples</th>\
         <th>Light map</th><th>Wall, ms (5–95 %)</th><th>GPU, ms</th><th>L1, %</th><th>L2, %</th>\
         <th>Energy ratio</th><th>Front</th><th>Settings</th></tr></thead>\n{rows}</table>\n</details>\n"
    )
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn base64_of_the_rfc() {
        for (text, code) in [
            ("", ""),
            ("f", "Zg=="),
            ("fo", "Zm8="),
            ("foo", "Zm9v"),
            ("foob", "Zm9vYg=="),
            ("fooba", "Zm9vYmE="),
            ("foobar", "Zm9vYmFy"),
        ] {
            assert_eq!(base64(text.as_bytes()), code);
        }
    }

    #[test]
    fn the_library_is_one_script() {
        let library = library();
        assert_eq!(library.matches("</script>").count(), 1);
        assert!(library.contains("plotly.js v"));
        assert!(library.len() < Plot::offline_js_sources().len() - 2_000_000);
    }
}
