//! `chart.svg`: all scenes side by side under one legend.

use super::figure::{
    Axis, ERROR_TITLE, Entry, FLOOR_TITLE, FRONT_TITLE, Front, Legend, Marker, Style, TIME_TITLE,
    heading, peer_groups, peer_place, place,
};
use super::{Chart, SceneChart};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::text_anchor::{HPos, Pos, VPos};
use std::ops::Range;

const PANEL: (u32, u32) = (560, 430);
const LINE: i32 = 20;
const MARGIN: i32 = 16;
const GREY: RGBColor = RGBColor(110, 110, 110);
const PALE: RGBColor = RGBColor(214, 214, 214);

type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;
/// Drawing into memory does not fail.
type Drawn = Result<(), DrawingAreaErrorKind<std::io::Error>>;

pub(super) fn drawing(chart: &Chart) -> String {
    let mut svg = String::new();
    draw(chart, &mut svg).expect("drawn in memory");
    svg
}

fn draw(chart: &Chart, svg: &mut String) -> Drawn {
    let columns = chart.scenes.len().min(2) as u32;
    let rows = (chart.scenes.len() as u32).div_ceil(columns);
    let width = columns * PANEL.0;
    let legend = Legend::of(chart);
    let items = place_legend(&legend, width as i32);
    let legend_lines = items.last().map_or(0, |(_, (_, line))| line + 1);
    let head = MARGIN + LINE * (3 + legend_lines) + MARGIN / 2;

    let root =
        SVGBackend::with_string(svg, (width, head as u32 + rows * PANEL.1)).into_drawing_area();
    root.fill(&WHITE)?;
    let (header, body) = root.split_vertically(head);
    draw_header(chart, &header)?;
    for (item, (x, line)) in &items {
        let at = (*x, MARGIN + LINE * (3 + line) + LINE / 2);
        draw_legend_item(&header, item, at)?;
    }
    let panels = body.split_evenly((rows as usize, columns as usize));
    for (scene, panel) in chart.scenes.iter().zip(&panels) {
        draw_scene(chart, scene, &legend, panel)?;
    }
    root.present()
}

fn text(size: i32, colour: &RGBColor) -> TextStyle<'_> {
    ("sans-serif", size).into_font().color(colour)
}

fn draw_header(chart: &Chart, area: &Area) -> Drawn {
    let title = "Caustics: speed against accuracy";
    let style = ("sans-serif", 18, FontStyle::Bold).into_font();
    area.draw(&Text::new(title, (MARGIN, MARGIN), style))?;
    let commit = (chart.commit.as_ref()).map_or(String::new(), |c| format!(" ({c})"));
    let facts = [
        format!("{} · {} · {}", chart.device, chart.driver, chart.cpu),
        format!("nephroid {}{commit} · {}", chart.nephroid, chart.date),
    ];
    for (line, fact) in facts.into_iter().enumerate() {
        let at = (MARGIN, MARGIN + 6 + LINE * (line as i32 + 1));
        area.draw(&Text::new(fact, at, text(12, &GREY)))?;
    }
    Ok(())
}

enum Item<'a> {
    Name(&'a Entry),
    Front,
    Floor,
}

impl Item<'_> {
    fn title(&self) -> &str {
        match self {
            Self::Name(entry) => &entry.name,
            Self::Front => FRONT_TITLE,
            Self::Floor => FLOOR_TITLE,
        }
    }
}

/// Column, px, and line of each item, from the left and wrapped.
fn place_legend(legend: &Legend, width: i32) -> Vec<(Item<'_>, (i32, i32))> {
    let (mut x, mut line) = (MARGIN, 0);
    (legend.0.iter().map(Item::Name))
        .chain([Item::Front, Item::Floor])
        .map(|item| {
            // The font is the reader's; 7 px a character is generous at 13 px.
            let needed = 54 + 7 * item.title().chars().count() as i32;
            if x > MARGIN && x + needed > width {
                (x, line) = (MARGIN, line + 1);
            }
            let at = (x, line);
            x += needed;
            (item, at)
        })
        .collect()
}

fn draw_legend_item(area: &Area, item: &Item, (x, y): (i32, i32)) -> Drawn {
    let line = vec![(x, y), (x + 28, y)];
    match item {
        Item::Name(entry) => {
            area.draw(&PathElement::new(line, colour(entry.style).stroke_width(2)))?;
            let fill = if entry.hollow {
                Fill::Hollow
            } else {
                Fill::Full
            };
            draw_marker(area, (x + 14, y), entry.style, fill)?;
        }
        Item::Front => area.draw(&PathElement::new(line, PALE.stroke_width(7)))?,
        Item::Floor => draw_dashes(area, x..x + 28, y)?,
    }
    let left = text(13, &BLACK).pos(Pos::new(HPos::Left, VPos::Center));
    area.draw(&Text::new(item.title().to_owned(), (x + 35, y), left))
}

fn draw_dashes(area: &Area, columns: Range<i32>, y: i32) -> Drawn {
    for x in columns.clone().step_by(10) {
        let dash = vec![(x, y), ((x + 6).min(columns.end), y)];
        area.draw(&PathElement::new(dash, GREY.stroke_width(1)))?;
    }
    Ok(())
}

fn draw_scene(chart: &Chart, scene: &SceneChart, legend: &Legend, panel: &Area) -> Drawn {
    let [time, error] = [Axis::time(scene), Axis::error(scene)];
    let coordinates = |axis: &Axis| {
        (axis.range.clone().log_scale())
            .with_key_points(axis.ticks.clone())
            .with_light_points(axis.minor.clone())
    };
    let mut plot = ChartBuilder::on(panel)
        .margin(MARGIN)
        .caption(heading(scene), ("sans-serif", 15, FontStyle::Bold))
        .x_label_area_size(44)
        .y_label_area_size(58)
        .build_cartesian_2d(coordinates(&time), coordinates(&error))?;
    plot.configure_mesh()
        .bold_line_style(RGBColor(222, 222, 222))
        .light_line_style(RGBColor(242, 242, 242))
        .axis_style(GREY)
        .label_style(text(12, &BLACK))
        .axis_desc_style(text(13, &BLACK))
        .x_desc(TIME_TITLE)
        .y_desc(ERROR_TITLE)
        .x_label_formatter(&f64::to_string)
        .y_label_formatter(&f64::to_string)
        .draw()?;

    let (left, top) = panel.get_base_pixel();
    let at = |[x, y]: [f64; 2]| {
        let (x, y) = plot.backend_coord(&(x, y));
        (x - left, y - top)
    };
    let path = |points, style| panel.draw(&PathElement::new(points, style));

    let mut steps: Vec<[f64; 2]> = Vec::new();
    for [x, y] in Front::of(chart, scene).line {
        // Until something better is ready, the last is the best.
        steps.extend(steps.last().map(|last| [x, last[1]]));
        steps.push([x, y]);
    }
    path(steps.into_iter().map(at).collect(), PALE.stroke_width(7))?;
    if scene.reference_error > 0.0 {
        let [start, end] =
            [time.range.start, time.range.end].map(|x| at([x, 100.0 * scene.reference_error]));
        draw_dashes(panel, start.0..end.0, start.1)?;
    }

    for series in &scene.series {
        let style = legend.style(&series.label);
        let line = (series.points.iter()).map(|p| at(place(p))).collect();
        path(line, colour(style).stroke_width(2))?;
        for point in &series.points {
            let y = place(point)[1];
            let (low, height) = at([1e3 * point.wall.p05, y]);
            let (high, _) = at([1e3 * point.wall.p95, y]);
            let bar = colour(style).stroke_width(1);
            path(vec![(low, height), (high, height)], bar)?;
            for x in [low, high] {
                path(vec![(x, height - 3), (x, height + 3)], bar)?;
            }
            let fill = if point.above_floor {
                Fill::Full
            } else {
                Fill::Faint
            };
            draw_marker(panel, at(place(point)), style, fill)?;
        }
    }
    for (name, indices) in peer_groups(chart, scene) {
        let style = legend.style(&name);
        let points: Vec<_> = (indices.iter())
            .map(|&i| at(peer_place(&scene.peers[i])))
            .collect();
        path(points.clone(), colour(style).stroke_width(1))?;
        let local = chart.is_local(&scene.peers[indices[0]]);
        let fill = if local { Fill::Full } else { Fill::Hollow };
        for point in points {
            draw_marker(panel, point, style, fill)?;
        }
    }
    Ok(())
}

fn colour(style: Style) -> RGBColor {
    let [r, g, b] = style.colour;
    RGBColor(r, g, b)
}

#[derive(Clone, Copy)]
enum Fill {
    Full,
    /// Half-way to white: within the reference's own error.
    Faint,
    /// White: measured elsewhere.
    Hollow,
}

/// A marker about 10 px across, with an outline in full colour.
fn draw_marker(area: &Area, centre: (i32, i32), style: Style, fill: Fill) -> Drawn {
    let full = colour(style);
    let inside = match fill {
        Fill::Full => full,
        Fill::Faint => {
            let [r, g, b] = style.colour.map(|c| c / 2 + 127);
            RGBColor(r, g, b)
        }
        Fill::Hollow => WHITE,
    };
    if style.marker == Marker::Circle {
        area.draw(&Circle::new(centre, 5, inside.filled()))?;
        return area.draw(&Circle::new(centre, 5, full.stroke_width(2)));
    }
    let mut corners: Vec<(i32, i32)> = (corners(style.marker).iter())
        .map(|(x, y)| (centre.0 + x, centre.1 + y))
        .collect();
    area.draw(&Polygon::new(corners.clone(), inside.filled()))?;
    corners.push(corners[0]);
    area.draw(&PathElement::new(corners, full.stroke_width(2)))
}

/// Corners around (0, 0), px, y down.
fn corners(marker: Marker) -> &'static [(i32, i32)] {
    match marker {
        Marker::Circle => &[],
        Marker::Square => &[(-4, -4), (4, -4), (4, 4), (-4, 4)],
        Marker::Diamond => &[(0, -6), (6, 0), (0, 6), (-6, 0)],
        Marker::TriangleUp => &[(0, -6), (6, 5), (-6, 5)],
        Marker::TriangleDown => &[(0, 6), (6, -5), (-6, -5)],
        #[rustfmt::skip]
        Marker::Cross => &[
            (-2, -6), (2, -6), (2, -2), (6, -2), (6, 2), (2, 2),
            (2, 6), (-2, 6), (-2, 2), (-6, 2), (-6, -2), (-2, -2),
        ],
    }
}
