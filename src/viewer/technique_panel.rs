//! The settings of a technique.

use super::technique::{Aim, ERRORS, Technique};
use super::widgets::{settled, slide};
use egui::{ComboBox, Ui};
use nephroid::render::{DEFAULT_ERROR, Method};

pub fn technique(ui: &mut Ui, technique: &mut Technique) {
    ui.checkbox(&mut technique.is_reference, "reference on the CPU")
        .on_hover_text("A thread of low priority refines it while the scene stays the same");
    if technique.is_reference {
        return;
    }
    ComboBox::from_label("method")
        .selected_text(technique.method.name())
        .show_ui(ui, |ui| {
            for method in Method::ALL {
                ui.selectable_value(&mut technique.method, method, method.name());
            }
        });
    let (error, budget, samples) = (
        Aim::Error(DEFAULT_ERROR),
        Aim::Budget(50.0),
        Aim::Samples(16_384),
    );
    let is_kind = |aim: Aim| std::mem::discriminant(&aim) == std::mem::discriminant(&technique.aim);
    let kinds = [
        (error, "error"),
        (budget, "frame time"),
        (samples, "samples"),
    ]
    .map(|(aim, name)| (aim, name, is_kind(aim)));
    ui.horizontal(|ui| {
        ui.label("aim for");
        for (aim, name, is_kind) in kinds {
            if ui.radio(is_kind, name).clicked() && !is_kind {
                technique.aim = aim;
            }
        }
    });
    match &mut technique.aim {
        Aim::Error(error) => {
            let mut percent = 100.0 * f64::from(*error);
            let range = 100.0 * f64::from(*ERRORS.start())..=100.0 * f64::from(*ERRORS.end());
            if slide(ui, &mut percent, range, |s| {
                s.logarithmic(true).suffix(" %").text("L1 error")
            }) {
                *error = (percent / 100.0) as f32;
            }
        }
        Aim::Budget(ms) => {
            let mut shown = f64::from(*ms);
            if slide(ui, &mut shown, 1.0..=1000.0, |s| {
                s.logarithmic(true).suffix(" ms").text("frame budget")
            }) {
                *ms = shown as f32;
            }
        }
        Aim::Samples(samples) => settled(ui, "samples", samples, 1..=4_000_000, ""),
    }
    if technique.method == Method::Footprint {
        settled(
            ui,
            "environment cells",
            &mut technique.environment_cells,
            8..=100_000,
            "",
        );
        settled(
            ui,
            "environment images",
            &mut technique.environment_images,
            1..=64,
            " per sample",
        );
    } else if !matches!(technique.aim, Aim::Samples(_)) {
        ui.label("Only footprint aims for an error or a time.");
    }
}
