//! The comparison of two sides in the window: its settings, the divider and the scale of the heat map.

use super::compare::{Compare, HeatMap, Shown};
use super::differences::constants::HEAT_COLORS;
use super::state::State;
use super::technique_panel::technique;
use super::widgets::slide;
use egui::{
    Align2, Color32, FontId, Mesh, Painter, Pos2, Rect, Shape, Stroke, Ui, Vec2, pos2, vec2,
};

/// Points between the pointer and the divider that it takes hold of, at most.
const REACH: f32 = 8.0;
const GRIP_RADIUS: f32 = 7.0;
/// Points between the divider's ends, or the scale, and the edges of the picture.
const MARGIN: f32 = 12.0;
const SCALE_SIZE: Vec2 = vec2(260.0, 12.0);
const BACKGROUND: Color32 = Color32::from_black_alpha(170);

pub fn settings(ui: &mut Ui, state: &mut State) {
    let compare = &mut state.compare;
    ui.horizontal(|ui| {
        ui.checkbox(&mut compare.is_on, "A and B");
        if ui
            .button("Swap")
            .on_hover_text("A becomes B, and B becomes A")
            .clicked()
        {
            compare.techniques.swap(0, 1);
        }
    });
    ui.label("B, right of the divider:");
    ui.push_id("B", |ui| technique(ui, &mut compare.techniques[1]));
    if !compare.is_on {
        return;
    }
    let mut divider = f64::from(compare.divider);
    if slide(ui, &mut divider, 0.0..=1.0, |s| s.text("divider")) {
        compare.divider = divider as f32;
    }
    ui.checkbox(&mut compare.heat_map.is_on, "heat map of |A − B|");
    if compare.heat_map.is_on {
        heat_map(ui, compare);
    }
    let lines = compare.lines(&state.document.base);
    ui.label(if lines.is_empty() {
        "measuring…"
    } else {
        "A against B:"
    })
    .on_hover_text(
        "L1 = Σ|A − B| / ΣB, as `compare` has it: of the pictures and of the light maps",
    );
    for line in lines {
        ui.label(line);
    }
}

fn heat_map(ui: &mut Ui, compare: &mut Compare) {
    let automatic = compare.scale();
    let heat_map = &mut compare.heat_map;
    ui.horizontal(|ui| {
        ui.radio_value(&mut heat_map.is_relative, false, "W/m²/sr");
        ui.radio_value(&mut heat_map.is_relative, true, "relative to B");
    });
    let mut is_automatic = heat_map.scale.is_none();
    if ui.checkbox(&mut is_automatic, "automatic scale").changed() {
        heat_map.scale = (!is_automatic).then_some(automatic);
    }
    if let Some(scale) = &mut heat_map.scale {
        let factor = if heat_map.is_relative { 100.0 } else { 1.0 };
        let mut shown = factor * *scale;
        let unit = if heat_map.is_relative {
            " %"
        } else {
            " W/m²/sr"
        };
        if slide(ui, &mut shown, 1e-4 * factor..=10.0 * factor, |s| {
            s.logarithmic(true).suffix(unit).text("scale")
        }) {
            *scale = shown / factor;
        }
    }
}

/// Whether the pointer is where it takes hold of the divider.
pub fn is_on_divider(compare: &Compare, screen: Rect, pointer: Pos2) -> bool {
    place(compare, screen).is_some_and(|x| (pointer.x - x).abs() <= REACH)
}

/// The divider follows the pointer within `area`, the part of the screen that no panel covers.
pub fn drag_divider(compare: &mut Compare, screen: Rect, area: Rect, pointer: Pos2) {
    let x = pointer.x.clamp(area.left(), area.right().max(area.left()));
    compare.divider = ((x - screen.left()) / screen.width().max(1.0)).clamp(0.0, 1.0);
}

/// Where the divider is, if it is shown.
fn place(compare: &Compare, screen: Rect) -> Option<f32> {
    match compare.shown() {
        Shown::Split { divider } => Some(screen.left() + divider * screen.width()),
        _ => None,
    }
}

/// What is over the pictures: names of the sides, and the divider's grip or the heat map's scale.
pub fn paint(painter: &Painter, compare: &Compare, screen: Rect, area: Rect) {
    if let Some(x) = place(compare, screen) {
        let [a, b] = &compare.techniques;
        let bottom = area.bottom() - MARGIN;
        let label = |x: f32, align, name: &str| {
            write(painter, pos2(x, bottom), align, name);
        };
        label(
            x - MARGIN,
            Align2::RIGHT_BOTTOM,
            &format!("A  {}", a.label()),
        );
        label(
            x + MARGIN,
            Align2::LEFT_BOTTOM,
            &format!("B  {}", b.label()),
        );
        let grip = pos2(x, area.center().y);
        painter.circle(
            grip,
            GRIP_RADIUS,
            Color32::WHITE,
            Stroke::new(1.5, Color32::BLACK),
        );
    }
    if let Shown::HeatMap { scale, .. } = compare.shown() {
        let corner = area.left_bottom() + vec2(MARGIN, -MARGIN - SCALE_SIZE.y);
        paint_scale(
            painter,
            Rect::from_min_size(corner, SCALE_SIZE),
            &compare.heat_map,
            scale,
        );
    }
}

/// The colours of the heat map with their values.
fn paint_scale(painter: &Painter, bar: Rect, heat_map: &HeatMap, scale: f64) {
    let above = vec2(0.0, -4.0);
    let (most, unit) = match heat_map.is_relative {
        true => (100.0 * scale, "%"),
        false => (scale, "W/m²/sr"),
    };
    let name = if heat_map.is_relative {
        "|A − B| / B"
    } else {
        "|A − B|"
    };
    let frame = Rect::from_min_max(bar.left_top() + 6.0 * above, bar.right_bottom());
    painter.rect_filled(frame.expand(8.0), 4.0, BACKGROUND);
    let text = |at: Pos2, align, text: &str| {
        painter.text(
            at + above,
            align,
            text,
            FontId::proportional(13.0),
            Color32::WHITE,
        );
    };
    text(bar.left_top(), Align2::LEFT_BOTTOM, "0");
    text(bar.center_top(), Align2::CENTER_BOTTOM, name);
    text(
        bar.right_top(),
        Align2::RIGHT_BOTTOM,
        &format!("≥ {} {unit}", rounded(most)),
    );
    let mut mesh = Mesh::default();
    for (index, color) in (0u32..).zip(HEAT_COLORS) {
        let [_, r, g, b] = color.to_be_bytes();
        let x = bar.left() + bar.width() * index as f32 / (HEAT_COLORS.len() - 1) as f32;
        mesh.colored_vertex(pos2(x, bar.top()), Color32::from_rgb(r, g, b));
        mesh.colored_vertex(pos2(x, bar.bottom()), Color32::from_rgb(r, g, b));
        if index > 0 {
            let first = 2 * (index - 1);
            mesh.add_triangle(first, first + 1, first + 2);
            mesh.add_triangle(first + 1, first + 3, first + 2);
        }
    }
    painter.add(Shape::mesh(mesh));
}

/// Four digits of a number, so that 7 % is not 7.000000000000001 %.
fn rounded(number: f64) -> f64 {
    format!("{number:.3e}").parse().unwrap_or(number)
}

fn write(painter: &Painter, at: Pos2, align: Align2, text: &str) {
    let galley = painter.layout_no_wrap(text.into(), FontId::proportional(13.0), Color32::WHITE);
    let rect = align.anchor_size(at, galley.size());
    painter.rect_filled(rect.expand(4.0), 4.0, BACKGROUND);
    painter.galley(rect.min, galley, Color32::WHITE);
}
