//! Numbers of panels.

use egui::{DragValue, Id, Ui};
use glam::DVec3;
use nephroid::glam;

/// Three numbers with a unit.
pub fn triple(ui: &mut Ui, name: &str, value: &mut DVec3, speed: f64, unit: &str) {
    ui.horizontal(|ui| {
        ui.label(name);
        for part in value.as_mut() {
            ui.add(DragValue::new(part).speed(speed).max_decimals(4));
        }
        ui.label(unit.trim());
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
pub fn settled(
    ui: &mut Ui,
    name: &str,
    value: &mut u32,
    range: std::ops::RangeInclusive<u32>,
    unit: &str,
) {
    ui.horizontal(|ui| {
        settled_value(ui, Id::new(name), value, range, unit);
        ui.label(name);
    });
}

/// As [`settled`], without a name. `id` is of the number.
pub fn settled_value(
    ui: &mut Ui,
    id: Id,
    value: &mut u32,
    range: std::ops::RangeInclusive<u32>,
    unit: &str,
) {
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
