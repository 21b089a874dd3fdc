//! Numbers of panels.

use egui::{DragValue, Id, Slider, SliderClamping, Ui};
use glam::DVec3;
use nephroid::glam;
use std::ops::RangeInclusive;

/// Largest number of a scene file's coordinates.
const MAX_NUMBER: f64 = 1e9;

/// A slider that leaves the value as it is, to the last bit, until it is moved.
pub fn slide(
    ui: &mut Ui,
    value: &mut f64,
    range: RangeInclusive<f64>,
    style: impl for<'a> FnOnce(Slider<'a>) -> Slider<'a>,
) -> bool {
    let mut shown = *value;
    let slider = Slider::new(&mut shown, range).clamping(SliderClamping::Edits);
    let is_moved = ui.add(style(slider)).changed();
    if is_moved {
        *value = shown;
    }
    is_moved
}

/// The same for an angle in rad, which is shown in degrees.
pub fn slide_angle(ui: &mut Ui, angle: &mut f64, degrees: RangeInclusive<f64>, name: &str) -> bool {
    let mut shown = angle.to_degrees();
    let is_moved = slide(ui, &mut shown, degrees, |slider| {
        slider.suffix("°").text(name)
    });
    if is_moved {
        *angle = shown.to_radians();
    }
    is_moved
}

/// Three numbers with a unit, `least` or more.
pub fn triple(ui: &mut Ui, name: &str, value: &mut DVec3, least: f64, speed: f64, unit: &str) {
    ui.horizontal(|ui| {
        ui.label(name);
        for part in value.as_mut() {
            let number = DragValue::new(part).speed(speed).max_decimals(4);
            ui.add(number.range(least..=MAX_NUMBER));
        }
        ui.label(unit);
    });
}

/// Three numbers from 0 to 1.
pub fn color(ui: &mut Ui, name: &str, value: &mut DVec3) {
    ui.horizontal(|ui| {
        ui.label(name);
        for part in value.as_mut() {
            ui.add(
                DragValue::new(part)
                    .speed(0.005)
                    .range(0.0..=1.0)
                    .max_decimals(3),
            );
        }
        ui.label("RGB");
    });
}

/// A number whose change is costly: it counts when the drag or the typing ends.
pub fn settled(ui: &mut Ui, name: &str, value: &mut u32, range: RangeInclusive<u32>, unit: &str) {
    let id = ui.make_persistent_id(name);
    ui.horizontal(|ui| {
        settled_value(ui, id, value, range, unit);
        ui.label(name);
    });
}

/// As [`settled`], without a name. `id` is of the number.
pub fn settled_value(ui: &mut Ui, id: Id, value: &mut u32, range: RangeInclusive<u32>, unit: &str) {
    let mut shown = ui.data(|data| data.get_temp(id)).unwrap_or(*value);
    let speed = f64::from(shown / 100).max(1.0);
    let response = ui.add(
        DragValue::new(&mut shown)
            .range(range)
            .speed(speed)
            .suffix(unit),
    );
    if response.dragged() || response.has_focus() {
        ui.data_mut(|data| data.insert_temp(id, shown));
        return;
    }
    if ui.data(|data| data.get_temp::<u32>(id)).is_some() {
        ui.data_mut(|data| data.remove::<u32>(id));
        *value = shown;
    }
}
