//! Actions of the pointer in the picture, and of the keys.

use super::compare_panel::{drag_divider, is_on_divider, paint};
use super::edits::Placement;
use super::handles::{Change, Drag, Handles, in_picture, light_marks, light_under, paint_light};
use super::orbit;
use super::overlay_panel::next;
use super::pick::{Projection, object_at};
use super::state::{Request, Selected, State};
use egui::{
    Context, CursorIcon, Id, Key, Modifiers, PointerButton, Rect, Response, Sense, Ui, Vec2,
};
use glam::{DQuat, DVec3};
use nephroid::glam;
use nephroid::render::Method;
use nephroid::scene::{LightKind, Scene};

/// Angle that a drag over the height of the window turns the camera or a sun by, rad.
const TURN: f64 = 3.0;
/// Distance to the target after a notch of the wheel.
const ZOOM: f64 = 0.9;
/// Speed of flying, distances to the target a second.
const FLY: f64 = 0.8;
/// Change of exposure by a key, EV.
const EXPOSURE_STEP: f64 = 0.25;

/// Keys and what they do, as the window lists them.
pub const KEYS: &[(&str, &str)] = &[
    ("left drag", "orbit"),
    ("Ctrl + left drag", "turn the sun"),
    ("middle drag, Shift + left drag", "pan"),
    ("right drag", "look around"),
    ("wheel", "zoom"),
    ("W A S D, Q E", "fly; down and up"),
    ("click", "select an object or a light"),
    ("drag a handle", "move or turn what is selected"),
    ("drag a sun's mark", "move the sun over the sky"),
    ("Esc", "select nothing, dismiss messages"),
    ("F", "look at what is selected"),
    ("Space", "play or pause"),
    (", and .", "a step back or forward"),
    ("Home", "to the start"),
    ("L", "loop"),
    ("1 2 3 4", "footprint, pinhole, points, beams"),
    ("[ and ]", "exposure"),
    ("Ctrl+Z, Ctrl+Y", "undo, redo"),
    ("V", "the scene's camera"),
    ("R", "reset everything"),
    ("Ctrl+S", "save the scene"),
    ("C", "screenshot: PNG, EXR and settings"),
    ("B", "compare two sides, A and B"),
    ("H", "heat map of their difference"),
    ("X", "swap A and B"),
    ("O", "next overlay, then none"),
    ("P", "profiler"),
    ("Tab", "panels"),
    ("?", "this list"),
    ("Ctrl+Q", "quit"),
];

/// The keys that are pressed once.
pub fn keys(context: &Context, state: &mut State) {
    if context.text_edit_focused() {
        return;
    }
    let pressed = |modifiers: Modifiers, key: Key| {
        context.input_mut(|input| input.consume_key(modifiers, key))
    };
    let history = &mut state.document.history;
    if pressed(Modifiers::COMMAND | Modifiers::SHIFT, Key::Z) || pressed(Modifiers::COMMAND, Key::Y)
    {
        history.redo();
    }
    if pressed(Modifiers::COMMAND, Key::Z) {
        history.undo();
    }
    if pressed(Modifiers::COMMAND, Key::S) {
        state.save.is_open = true;
    }
    if pressed(Modifiers::COMMAND, Key::Q) {
        state.requests.push(Request::Quit);
    }
    if pressed(Modifiers::NONE, Key::C) {
        let name =
            super::save::with_name(&state.document.path, &format!("{:04}", state.screenshots));
        state.screenshots += 1;
        let file = name.file_name().unwrap_or_default();
        state.requests.push(Request::Screenshot(file.into()));
    }
    for (key, method) in [Key::Num1, Key::Num2, Key::Num3, Key::Num4]
        .into_iter()
        .zip(Method::ALL)
    {
        if pressed(Modifiers::NONE, key) {
            let technique = &mut state.compare.techniques[0];
            (technique.method, technique.is_reference) = (method, false);
        }
    }
    for (key, step) in [
        (Key::OpenBracket, -EXPOSURE_STEP),
        (Key::CloseBracket, EXPOSURE_STEP),
    ] {
        if pressed(Modifiers::NONE, key) {
            let exposure_ev = state.camera().exposure_ev + step;
            state.document.history.now.set_exposure(exposure_ev);
        }
    }
    for (key, steps) in [(Key::Comma, -1.0), (Key::Period, 1.0)] {
        if pressed(Modifiers::NONE, key) {
            state.playback.step(steps);
        }
    }
    type Action = fn(&mut State);
    let actions: [(Key, Action); 14] = [
        (Key::Space, |state| state.playback.toggle()),
        (Key::Home, |state| state.playback.time = 0.0),
        (Key::L, |state| state.playback.loops = !state.playback.loops),
        (Key::V, |state| state.camera = None),
        (Key::R, State::reset),
        (Key::B, |state| state.compare.is_on = !state.compare.is_on),
        (Key::H, |state| state.compare.toggle_heat_map()),
        (Key::X, |state| state.compare.techniques.swap(0, 1)),
        (Key::O, |state| next(&mut state.overlays)),
        (Key::P, |state| {
            state.windows.profiler = !state.windows.profiler
        }),
        (Key::Tab, |state| {
            state.windows.panels = !state.windows.panels
        }),
        (Key::Escape, |state| {
            state.selected = None;
            state.windows.help = false;
            state.messages.clear();
        }),
        (Key::F, focus),
        (Key::Questionmark, |state| {
            state.windows.help = !state.windows.help
        }),
    ];
    for (key, action) in actions {
        if pressed(Modifiers::NONE, key) {
            action(state);
        }
    }
    // Keyboards on which the question mark needs Shift.
    if pressed(Modifiers::SHIFT, Key::Slash) || pressed(Modifiers::SHIFT, Key::Questionmark) {
        state.windows.help = !state.windows.help;
    }
}

/// Keys that move the camera as long as they are held.
fn fly(context: &Context, state: &mut State) {
    if context.text_edit_focused() {
        return;
    }
    let (held, seconds) = context.input(|input| {
        let axis = |less: Key, more: Key| {
            f64::from(u8::from(input.key_down(more))) - f64::from(u8::from(input.key_down(less)))
        };
        let held = DVec3::new(
            axis(Key::A, Key::D),
            axis(Key::Q, Key::E),
            axis(Key::S, Key::W),
        );
        let is_plain = !input.modifiers.any();
        (
            if is_plain { held } else { DVec3::ZERO },
            input.stable_dt.min(0.1),
        )
    });
    if held != DVec3::ZERO {
        state.move_camera(|camera| {
            let speed = FLY * camera.position.distance(camera.target);
            orbit::fly(camera, f64::from(seconds) * speed * held);
        });
        context.request_repaint();
    }
}

/// Looks at what is selected.
fn focus(state: &mut State) {
    let selected = state.selected;
    let scene = state.scene();
    let target = match selected {
        Some(Selected::Object(index)) => scene.objects[index].geometry.middle(),
        Some(Selected::Light(index)) => match scene.lights[index].kind {
            LightKind::Lamp { position, .. } => position,
            _ => return,
        },
        None => return,
    };
    state.move_camera(|camera| {
        camera.position += target - camera.target;
        camera.target = target;
    });
}

/// The part of the window that no panel covers. `screen` is all of it, which the picture fills.
pub fn picture(ui: &mut Ui, state: &mut State, screen: Rect) {
    let area = ui.available_rect_before_wrap();
    let response = ui.interact(area, Id::new("picture"), Sense::click_and_drag());
    fly(ui.ctx(), state);
    let scene = state.scene();
    let projection = Projection::new(
        &scene.camera,
        f64::from(screen.width() / screen.height().max(1.0)),
    );
    let handles = handles(state, &scene, projection, screen);
    let marks = light_marks(&scene, &projection, screen);

    drag(
        ui,
        &response,
        state,
        &scene,
        projection,
        handles.as_ref(),
        &marks,
        screen,
    );
    if response.clicked_by(PointerButton::Primary)
        && let Some(pointer) = response.interact_pointer_pos()
    {
        let direction = projection.direction(in_picture(screen, pointer));
        let object = || {
            object_at(&scene, scene.camera.position, direction)
                .map(|(index, _)| Selected::Object(index))
        };
        state.selected = light_under(&marks, pointer)
            .map(Selected::Light)
            .or_else(object);
    }
    if response.hovered() {
        let notches = ui.input(|input| input.smooth_scroll_delta().y) / 50.0;
        if notches != 0.0 {
            state.move_camera(|camera| orbit::zoom(camera, ZOOM.powf(notches.into())));
        }
    }

    let is_on_divider = match state.drag {
        Some(drag) => drag == Drag::Divider,
        None => (response.hover_pos())
            .is_some_and(|pointer| is_on_divider(&state.compare, screen, pointer)),
    };
    if is_on_divider {
        ui.ctx().set_cursor_icon(CursorIcon::ResizeHorizontal);
    }
    let painter = ui.painter().with_clip_rect(area);
    paint(&painter, &state.compare, screen, area);
    if let Some(handles) = handles {
        let hovered = match state.drag {
            Some(Drag::Handle(handle)) => Some(handle),
            _ => response
                .hover_pos()
                .and_then(|pointer| handles.under(pointer)),
        };
        handles.paint(&painter, hovered);
    }
    for (index, at) in marks {
        paint_light(&painter, at, state.selected == Some(Selected::Light(index)));
    }
}

fn handles(state: &State, scene: &Scene, projection: Projection, screen: Rect) -> Option<Handles> {
    let (middle, turns) = match state.selected? {
        Selected::Object(index) => (scene.objects[index].geometry.middle(), true),
        Selected::Light(index) => match scene.lights[index].kind {
            LightKind::Lamp { position, .. } => (position, false),
            _ => return None,
        },
    };
    Handles::new(projection, screen, scene.camera.fov, middle, turns)
}

#[allow(clippy::too_many_arguments)] // one call
fn drag(
    ui: &Ui,
    response: &Response,
    state: &mut State,
    scene: &Scene,
    projection: Projection,
    handles: Option<&Handles>,
    marks: &[(usize, egui::Pos2)],
    screen: Rect,
) {
    if response.drag_started() {
        let origin = ui.input(|input| input.pointer.press_origin());
        let modifiers = ui.input(|input| input.modifiers);
        let on_handle = origin.and_then(|origin| handles.and_then(|handles| handles.under(origin)));
        let on_sun = origin
            .and_then(|origin| light_under(marks, origin))
            .filter(|index| is_sun(scene, *index));
        let by = |button| response.dragged_by(button);
        state.drag = if by(PointerButton::Middle) || (by(PointerButton::Primary) && modifiers.shift)
        {
            Some(Drag::Pan)
        } else if by(PointerButton::Secondary) {
            Some(Drag::Look)
        } else if modifiers.command {
            sun_to_turn(state.selected, scene).map(Drag::TurnSun)
        } else if let Some(handle) = on_handle {
            Some(Drag::Handle(handle))
        } else if let Some(sun) = on_sun {
            state.selected = Some(Selected::Light(sun));
            Some(Drag::PlaceSun(sun))
        } else if origin.is_some_and(|origin| is_on_divider(&state.compare, screen, origin)) {
            Some(Drag::Divider)
        } else {
            Some(Drag::Orbit)
        };
    }
    if response.dragged()
        && let Some(drag) = state.drag
    {
        let delta = response.drag_delta();
        let pointer = response.interact_pointer_pos().unwrap_or(screen.center());
        if drag == Drag::Divider {
            drag_divider(&mut state.compare, screen, response.rect, pointer);
        } else if delta != Vec2::ZERO {
            apply(
                drag,
                state,
                scene,
                projection,
                handles,
                [pointer - delta, pointer],
                screen,
            );
        }
    }
    if response.drag_stopped() {
        state.drag = None;
    }
}

fn apply(
    drag: Drag,
    state: &mut State,
    scene: &Scene,
    projection: Projection,
    handles: Option<&Handles>,
    [from, to]: [egui::Pos2; 2],
    screen: Rect,
) {
    let share = (to - from) / screen.height().max(1.0);
    let (x, y) = (f64::from(share.x), f64::from(share.y));
    match drag {
        Drag::Orbit => state.move_camera(|camera| orbit::orbit(camera, -TURN * x, -TURN * y)),
        Drag::Pan => state.move_camera(|camera| orbit::pan(camera, -x, y)),
        Drag::Look => state.move_camera(|camera| orbit::look(camera, TURN * x, TURN * y)),
        Drag::TurnSun(index) => {
            if let LightKind::Sun { direction, .. } = scene.lights[index].kind {
                set_sun(
                    state,
                    scene,
                    index,
                    turned_sun(direction, -TURN * x, -TURN * y),
                );
            }
        }
        Drag::PlaceSun(index) => {
            set_sun(
                state,
                scene,
                index,
                projection.direction(in_picture(screen, to)),
            );
        }
        // It moves nothing of the scene.
        Drag::Divider => {}
        Drag::Handle(handle) => {
            if let Some(change) = handles.and_then(|handles| handles.drag(handle, from, to)) {
                change_selected(state, scene, change);
            }
        }
    }
}

fn is_sun(scene: &Scene, index: usize) -> bool {
    matches!(scene.lights[index].kind, LightKind::Sun { .. })
}

/// The sun that is selected, or else the first one.
fn sun_to_turn(selected: Option<Selected>, scene: &Scene) -> Option<usize> {
    match selected {
        Some(Selected::Light(index)) if is_sun(scene, index) => Some(index),
        _ => (0..scene.lights.len()).find(|index| is_sun(scene, *index)),
    }
}

/// The direction turned about the vertical and raised, rad, between the horizon and the zenith.
fn turned_sun(direction: DVec3, azimuth: f64, up: f64) -> DVec3 {
    let turned = DQuat::from_rotation_y(azimuth) * direction;
    let around = DVec3::new(turned.x, 0.0, turned.z).normalize_or(DVec3::X);
    let height = (turned.y.clamp(-1.0, 1.0).asin() + up).clamp(-1.5, 1.5);
    height.cos() * around + height.sin() * DVec3::Y
}

/// Moves a sun.
fn set_sun(state: &mut State, scene: &Scene, index: usize, toward: DVec3) {
    let mut kind = scene.lights[index].kind.clone();
    if let LightKind::Sun { direction, .. } = &mut kind {
        *direction = toward.normalize();
        state.document.history.now.lights.insert(index, kind);
    }
}

fn change_selected(state: &mut State, scene: &Scene, change: Change) {
    let edits = &mut state.document.history.now;
    match state.selected {
        Some(Selected::Object(index)) => {
            let placement = edits.objects.entry(index).or_insert(Placement::REST);
            match change {
                Change::Shift(by) => placement.shift += by,
                Change::Turn(by) => placement.rotation = (by * placement.rotation).normalize(),
            }
        }
        Some(Selected::Light(index)) => {
            let mut kind = scene.lights[index].kind.clone();
            if let (LightKind::Lamp { position, .. }, Change::Shift(by)) = (&mut kind, change) {
                *position += by;
                edits.lights.insert(index, kind);
            }
        }
        None => {}
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn suns_turn_between_nadir_and_zenith() {
        let mut direction = DVec3::new(-0.7, 0.55, 0.4).normalize();
        let start = direction;
        for _ in 0..100 {
            direction = turned_sun(direction, 0.1, 0.1);
            assert!((direction.length() - 1.0).abs() < 1e-9);
        }
        assert!(direction.y > 0.99);
        assert!(turned_sun(start, 0.0, 0.0).distance(start) < 1e-12);
    }
}
