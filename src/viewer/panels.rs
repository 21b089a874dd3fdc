//! The panels: settings, lights, materials and objects, the time line, and windows over the picture.

use super::compare_panel;
use super::controls;
use super::dialogs;
use super::edits::{Placement, same_light};
use super::handles::sky_dial;
use super::overlay_panel::overlays;
use super::profiler_panel;
use super::state::{Selected, State};
use super::technique_panel::technique;
use super::widgets::{color, settled_value, slide, slide_angle, triple};
use egui::{Id, Panel, RichText, ScrollArea, Ui};
use glam::DQuat;
use nephroid::glam;
use nephroid::scene::{Dielectric, LightKind, MAX_LIGHT_MAP_SIDE, MaterialKind, Scene};

const WIDTH: f32 = 300.0;

/// All of a frame's interface.
pub fn show(ui: &mut Ui, state: &mut State) {
    let context = ui.ctx().clone();
    let screen = context.viewport_rect();
    controls::keys(&context, state);
    if state.windows.panels {
        Panel::bottom("time line").show(ui, |ui| time_line(ui, state));
        Panel::right("settings").default_size(WIDTH).show(ui, |ui| {
            ScrollArea::vertical()
                .auto_shrink(false)
                .show(ui, |ui| settings(ui, state));
        });
    }
    controls::picture(ui, state, screen);
    dialogs::show(&context, state);
    profiler_panel::show(&context, state);
    // A drag of any kind is one step of the history.
    if !context.input(|input| input.pointer.any_down()) {
        state.document.history.settle();
    }
}

fn settings(ui: &mut Ui, state: &mut State) {
    ui.label(RichText::new(&state.device.name).small());
    ui.horizontal(|ui| {
        let history = &mut state.document.history;
        if ui
            .add_enabled(history.can_undo(), egui::Button::new("Undo"))
            .clicked()
        {
            history.undo();
        }
        if ui
            .add_enabled(history.can_redo(), egui::Button::new("Redo"))
            .clicked()
        {
            history.redo();
        }
        if ui.button("Save…").clicked() {
            state.save.is_open = true;
        }
        if ui.button("Reset").clicked() {
            state.reset();
        }
        ui.toggle_value(&mut state.windows.profiler, "Profiler");
        ui.toggle_value(&mut state.windows.help, "?");
    });
    ui.collapsing("Method", |ui| method(ui, state))
        .header_response
        .on_hover_text("How the caustic is computed");
    ui.collapsing("Overlays", |ui| overlays(ui, &mut state.overlays))
        .header_response
        .on_hover_text("What the frame computed with, over the picture");
    ui.collapsing("Compare", |ui| compare_panel::settings(ui, state))
        .header_response
        .on_hover_text("Two techniques side by side, and their difference");
    let scene = state.scene();
    ui.collapsing("Camera", |ui| camera(ui, state, &scene));
    egui::CollapsingHeader::new("Lights")
        .default_open(true)
        .show(ui, |ui| lights(ui, state, &scene));
    ui.collapsing("Materials", |ui| materials(ui, state, &scene));
    egui::CollapsingHeader::new("Objects")
        .default_open(true)
        .show(ui, |ui| objects(ui, state, &scene));
}

fn method(ui: &mut Ui, state: &mut State) {
    technique(ui, &mut state.compare.techniques[0]);
    let quality = &mut state.quality;
    ui.horizontal(|ui| {
        ui.label("light maps");
        for (factor, name) in [(0.25, "¼"), (0.5, "½"), (1.0, "1"), (2.0, "2")] {
            ui.radio_value(&mut quality.light_map_scale, factor, name);
        }
        ui.label("×");
    });
    ui.horizontal(|ui| {
        ui.label("antialias");
        for side in [1, 2, 3, 4] {
            ui.radio_value(&mut quality.antialias, side, format!("{side}²"));
        }
    });
    let mut resolution = f64::from(quality.resolution);
    if slide(ui, &mut resolution, 0.25..=1.0, |s| {
        s.text("resolution, of the window's")
    }) {
        quality.resolution = resolution as f32;
    }
    ui.checkbox(&mut quality.refines, "refine a still picture");
    let mut rate = f64::from(quality.frame_rate);
    if quality.refines
        && slide(ui, &mut rate, 0.0..=60.0, |s| {
            s.text("pictures/s in motion")
        })
    {
        quality.frame_rate = rate as f32;
    }
}

fn camera(ui: &mut Ui, state: &mut State, scene: &Scene) {
    let mut exposure_ev = scene.camera.exposure_ev;
    if slide(ui, &mut exposure_ev, -10.0..=10.0, |s| {
        s.suffix(" EV").text("exposure")
    }) {
        state.document.history.now.set_exposure(exposure_ev);
    }
    let mut fov = scene.camera.fov;
    if slide_angle(ui, &mut fov, 5.0..=120.0, "vertical field of view") {
        state.move_camera(|camera| camera.fov = fov);
    }
    ui.horizontal(|ui| {
        if ui
            .button("Use for the scene")
            .on_hover_text("The saved scene has this camera")
            .clicked()
        {
            state.document.history.now.camera = Some(state.camera());
        }
        if ui.button("Scene's camera").clicked() {
            state.camera = None;
        }
    });
}

/// An entry of a list, which a click selects. Whether it is selected.
fn entry(ui: &mut Ui, state: &mut State, this: Selected, name: &str) -> bool {
    let label = ui.selectable_label(state.selected == Some(this), name);
    if label.clicked() {
        state.selected = Some(this);
    }
    state.selected == Some(this)
}

fn lights(ui: &mut Ui, state: &mut State, scene: &Scene) {
    for (index, light) in scene.lights.iter().enumerate() {
        if !entry(ui, state, Selected::Light(index), &light.name) {
            continue;
        }
        let mut kind = light.kind.clone();
        ui.indent(("light", index), |ui| match &mut kind {
            LightKind::Sun {
                direction,
                irradiance,
                angular_radius,
            } => {
                if let Some(chosen) = sky_dial(ui, *direction) {
                    *direction = chosen;
                }
                let elevation = direction.y.clamp(-1.0, 1.0).asin().to_degrees();
                ui.label(format!("elevation {elevation:.1}°"));
                triple(ui, "irradiance", irradiance, 0.0, 0.01, "W/m²");
                slide_angle(ui, angular_radius, 0.0..=10.0, "angular radius");
            }
            LightKind::Lamp {
                position,
                radius,
                radiant_flux,
            } => {
                triple(ui, "position", position, -1e9, 0.01, "m");
                slide(ui, radius, 1e-4..=10.0, |s| {
                    s.logarithmic(true).suffix(" m").text("radius")
                });
                triple(ui, "flux", radiant_flux, 0.0, 0.1, "W");
            }
            LightKind::Environment {
                scale, rotation, ..
            } => {
                slide(ui, scale, 0.0..=100.0, |s| {
                    s.logarithmic(true).text("scale")
                });
                slide_angle(ui, rotation, -180.0..=180.0, "rotation");
            }
        });
        if !same_light(&kind, &light.kind) {
            state.document.history.now.lights.insert(index, kind);
        }
    }
}

fn materials(ui: &mut Ui, state: &mut State, scene: &Scene) {
    for (index, material) in scene.materials.iter().enumerate() {
        let mut kind = material.kind.clone();
        ui.collapsing(&material.name, |ui| match &mut kind {
            MaterialKind::Mirror { reflectance } => color(ui, "reflectance", reflectance),
            MaterialKind::Diffuse { albedo } => color(ui, "albedo", albedo),
            MaterialKind::Dielectric(Dielectric {
                ior,
                absorption,
                thin,
                dispersion,
                ..
            }) => {
                if dispersion.is_some() {
                    ui.label("index of refraction: varies with the wavelength");
                } else {
                    slide(ui, ior, 1.0..=3.0, |s| s.text("index of refraction"));
                }
                if !*thin {
                    triple(ui, "absorption", absorption, 0.0, 0.1, "1/m");
                }
            }
            MaterialKind::Conductor { index, extinction } => {
                ui.label(format!("index {index:.3}, extinction {extinction:.3}"));
            }
        });
        if kind != material.kind {
            state.document.history.now.materials.insert(index, kind);
        }
    }
}

fn objects(ui: &mut Ui, state: &mut State, scene: &Scene) {
    for (index, object) in scene.objects.iter().enumerate() {
        if !entry(ui, state, Selected::Object(index), &object.name) {
            continue;
        }
        ui.indent(("object", index), |ui| {
            ui.label(format!(
                "material {}",
                scene.materials[object.material].name
            ));
            let edits = &mut state.document.history.now;
            let mut placement = edits
                .objects
                .get(&index)
                .copied()
                .unwrap_or(Placement::REST);
            let before = placement;
            triple(ui, "moved by", &mut placement.shift, -1e9, 0.01, "m");
            let (axis, angle) = placement.rotation.to_axis_angle();
            ui.horizontal(|ui| {
                ui.label(format!(
                    "turned by {:.1}° about [{:.2}, {:.2}, {:.2}]",
                    angle.to_degrees(),
                    axis.x,
                    axis.y,
                    axis.z
                ));
                if ui.small_button("not").clicked() {
                    placement.rotation = DQuat::IDENTITY;
                }
            });
            if placement != before {
                edits.objects.insert(index, placement);
            }
            if let Some([width, height]) = object.light_map {
                let mut sides = [width, height];
                ui.horizontal(|ui| {
                    ui.label("light map");
                    for (side, name) in sides.iter_mut().zip(["width", "height"]) {
                        settled_value(
                            ui,
                            Id::new((name, index)),
                            side,
                            1..=MAX_LIGHT_MAP_SIDE,
                            " texels",
                        );
                    }
                });
                if sides != [width, height] {
                    edits.light_maps.insert(index, sides);
                }
            }
        });
    }
}

fn time_line(ui: &mut Ui, state: &mut State) {
    ui.horizontal(|ui| {
        let playback = &mut state.playback;
        if !playback.moves() {
            ui.label("the scene stands still");
        } else {
            if ui
                .button(if playback.plays { "Pause" } else { "Play" })
                .clicked()
            {
                playback.toggle();
            }
            if ui.button("|<").clicked() {
                playback.time = 0.0;
            }
            if ui.button("<").clicked() {
                playback.step(-1.0);
            }
            if ui.button(">").clicked() {
                playback.step(1.0);
            }
            ui.checkbox(&mut playback.loops, "loop");
            ui.spacing_mut().slider_width = (ui.available_width() - 260.0).max(80.0);
            let length = playback.length;
            slide(ui, &mut playback.time, 0.0..=length, |s| {
                s.suffix(" s").fixed_decimals(2)
            });
        }
        if let Some(times) = state.profiler.recent(30) {
            ui.label(format!(
                "{:.1} ms  {:.1} frames/s",
                times.median,
                1e3 / times.median
            ));
        }
    });
}
