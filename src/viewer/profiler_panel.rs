//! The profiler's window: passes over the last frames, stacked, and what memory is used for.

use super::profiler::Profiler;
use super::state::{Request, State};
use super::stats::Times;
use egui::{
    Color32, Context, Grid, Rect, RichText, ScrollArea, Sense, Stroke, Ui, Vec2, Window, pos2,
};

/// Frames that the graph shows.
const SHOWN: usize = 180;
const HEIGHT: f32 = 120.0;

pub fn show(context: &Context, state: &mut State) {
    let mut is_open = state.windows.profiler;
    Window::new("Profiler")
        .open(&mut is_open)
        .default_width(420.0)
        .show(context, |ui| {
            let profiler = &state.profiler;
            graph(ui, profiler);
            ui.horizontal(|ui| {
                line(ui, "frame, wall", profiler.intervals());
                line(ui, "host", profiler.host_times());
            });
            counts(ui, profiler);
            ScrollArea::vertical().max_height(260.0).show(ui, |ui| {
                passes(ui, profiler);
                ui.separator();
                memory(ui, profiler);
            });
            if ui
                .button("Export")
                .on_hover_text("Chrome trace (.json) and table (.csv), beside the scene")
                .clicked()
            {
                let path = state.document.path.with_extension("profile.json");
                state.requests.push(Request::ExportProfile(path));
            }
        });
    state.windows.profiler = is_open;
}

/// A color for a pass, by its place among all.
fn color(index: usize) -> Color32 {
    // The golden ratio spreads hues evenly, however many there are.
    let hue = (index as f32 * 0.618_034).fract();
    egui::ecolor::Hsva::new(hue, 0.65, 0.9, 1.0).into()
}

fn graph(ui: &mut Ui, profiler: &Profiler) {
    let (rect, _) = ui.allocate_exact_size(Vec2::new(ui.available_width(), HEIGHT), Sense::hover());
    let painter = ui.painter().with_clip_rect(rect);
    painter.rect_filled(rect, 2.0, Color32::from_black_alpha(120));
    let names = profiler.pass_names();
    let first = profiler.frames.len().saturating_sub(SHOWN);
    let frames: Vec<_> = profiler.frames.iter().skip(first).collect();
    let longest = |frame: &&super::profiler::FrameTimes| {
        let device: f64 = frame.passes.iter().map(|(_, ms)| ms).sum();
        frame.interval.unwrap_or(0.0).max(device)
    };
    let top = frames.iter().map(longest).fold(1.0, f64::max);
    let width = rect.width() / SHOWN as f32;
    let height = |ms: f64| (ms / top) as f32 * (HEIGHT - 14.0);
    for (index, frame) in frames.iter().enumerate() {
        let left = rect.left() + index as f32 * width;
        let mut bottom = rect.bottom();
        for (name, ms) in &frame.passes {
            let place = names.iter().position(|other| other == name).unwrap_or(0);
            let high = bottom - height(*ms);
            let bar = Rect::from_min_max(pos2(left, high), pos2(left + width, bottom));
            painter.rect_filled(bar, 0.0, color(place));
            bottom = high;
        }
        if let Some(interval) = frame.interval {
            let y = rect.bottom() - height(interval);
            painter.hline(left..=left + width, y, Stroke::new(1.5, Color32::WHITE));
        }
    }
    painter.text(
        rect.left_top() + Vec2::splat(3.0),
        egui::Align2::LEFT_TOP,
        format!("{top:.1} ms; white: wall time of a frame"),
        egui::FontId::proportional(10.0),
        Color32::LIGHT_GRAY,
    );
}

fn line(ui: &mut Ui, name: &str, times: Option<Times>) {
    if let Some(times) = times {
        ui.label(format!(
            "{name}: median {:.2} ms, p99 {:.2} ms",
            times.median, times.p99
        ));
    }
}

/// What the last frame consists of, for each side.
fn counts(ui: &mut Ui, profiler: &Profiler) {
    for (counts, side) in profiler.counts().iter().zip(["", "B: "]) {
        let mut text = format!("{side}{} patches", counts.patches);
        if counts.traced_corners > 0 {
            text += &format!(", rays from {} corners", counts.traced_corners);
        }
        if let Some(splats) = counts.splats {
            text += &format!(", {splats} splats");
        }
        if let Some(error) = counts.error {
            text += &format!(", estimated error {:.2} %", 100.0 * error);
        }
        ui.label(text).on_hover_text(
            "Patches or points; places on casters from which rays test visibility, without rays of chains and direct light; triangles and kernels added to the light maps; L1 of light of a single surface",
        );
    }
}

fn passes(ui: &mut Ui, profiler: &Profiler) {
    Grid::new("passes")
        .striped(true)
        .num_columns(3)
        .show(ui, |ui| {
            for head in ["pass (device time)", "median, ms", "p99, ms"] {
                ui.label(RichText::new(head).strong());
            }
            ui.end_row();
            for (index, name) in profiler.pass_names().into_iter().enumerate() {
                if let Some(times) = profiler.pass_times(name) {
                    ui.label(RichText::new(name).color(color(index)));
                    ui.label(format!("{:.3}", times.median));
                    ui.label(format!("{:.3}", times.p99));
                    ui.end_row();
                }
            }
        });
}

fn memory(ui: &mut Ui, profiler: &Profiler) {
    let mebibytes = |bytes: u64| bytes as f64 / f64::from(1 << 20);
    ui.label(format!(
        "device memory reserved: {:.1} MiB",
        mebibytes(profiler.reserved)
    ));
    let mut names: Vec<_> = profiler.memory.iter().collect();
    names.sort_by_key(|(_, bytes)| std::cmp::Reverse(**bytes));
    Grid::new("memory")
        .striped(true)
        .num_columns(2)
        .show(ui, |ui| {
            for (name, bytes) in names {
                ui.label(name);
                ui.label(format!("{:.2} MiB", mebibytes(*bytes)));
                ui.end_row();
            }
        });
}
