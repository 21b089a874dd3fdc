//! Dialogs over the picture: messages, the list of keys, and the question where to save.

use super::controls::KEYS;
use super::save::with_name;
use super::state::{Request, Severity, State};
use egui::{Align2, Color32, Context, Grid, Id, RichText, Window};

pub fn show(context: &Context, state: &mut State) {
    messages(context, state);
    help(context, state);
    save_dialog(context, state);
}

/// The pointer goes through them to the picture.
fn messages(context: &Context, state: &State) {
    if state.messages.is_empty() {
        return;
    }
    let area = egui::Area::new(Id::new("messages")).anchor(Align2::LEFT_TOP, [8.0, 8.0]);
    area.interactable(false).show(context, |ui| {
        egui::Frame::popup(ui.style()).show(ui, |ui| {
            ui.set_max_width(560.0);
            for (severity, text) in &state.messages {
                let color = match severity {
                    Severity::Note => ui.visuals().text_color(),
                    _ => Color32::from_rgb(255, 120, 100),
                };
                ui.label(RichText::new(text).color(color));
            }
            ui.label(RichText::new("Esc dismisses").small().weak());
        });
    });
}

fn help(context: &Context, state: &mut State) {
    Window::new("Keys")
        .open(&mut state.windows.help)
        .resizable(false)
        .show(context, |ui| {
            Grid::new("keys").striped(true).show(ui, |ui| {
                for (keys, what) in KEYS {
                    ui.label(RichText::new(*keys).strong());
                    ui.label(*what);
                    ui.end_row();
                }
            });
        });
}

fn save_dialog(context: &Context, state: &mut State) {
    if !state.save.is_open {
        return;
    }
    if state.save.name.is_empty() {
        let name = with_name(&state.document.path, "edited");
        state.save.name = name
            .file_name()
            .unwrap_or_default()
            .to_string_lossy()
            .into_owned();
    }
    let mut is_open = true;
    Window::new("Save scene")
        .open(&mut is_open)
        .resizable(false)
        .show(context, |ui| {
            ui.label("In the folder of the scene:");
            if ui.text_edit_singleline(&mut state.save.name).changed() {
                state.save.confirms = None;
            }
            let path = state.document.path.with_file_name(&state.save.name);
            let is_confirmed = state.save.confirms.as_deref() == Some(state.save.name.as_str());
            let label = if is_confirmed { "Overwrite" } else { "Save" };
            if is_confirmed {
                ui.label(format!("{} exists.", path.display()));
            }
            if ui.button(label).clicked() {
                if path.exists() && !is_confirmed {
                    state.save.confirms = Some(state.save.name.clone());
                } else {
                    state.requests.push(Request::Save(path));
                    state.save.is_open = false;
                    state.save.confirms = None;
                }
            }
        });
    state.save.is_open &= is_open;
}
