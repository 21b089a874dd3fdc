//! Handles on what is selected: arrows that move it, circles that turn it, and the marks of lights.

use super::pick::{Projection, light_place};
use egui::{Color32, Painter, Pos2, Rect, Stroke, Vec2};
use glam::{DQuat, DVec2, DVec3};
use nephroid::glam;
use nephroid::scene::{LightKind, Scene};
use std::f64::consts::TAU;

/// Length of an arrow, as a share of the picture's height.
const LENGTH: f64 = 0.13;
/// Radius of a circle over the length of an arrow.
const CIRCLE: f64 = 0.75;
const SEGMENTS: usize = 64;
/// Pixels between the pointer and what it takes hold of, at most.
const REACH: f32 = 8.0;
const AXES: [DVec3; 3] = [DVec3::X, DVec3::Y, DVec3::Z];
const COLORS: [Color32; 3] = [
    Color32::from_rgb(235, 80, 80),
    Color32::from_rgb(90, 200, 90),
    Color32::from_rgb(90, 140, 250),
];
pub const LIGHT_COLOR: Color32 = Color32::from_rgb(255, 205, 80);

/// A part of the handles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Handle {
    /// Along an axis.
    Move(usize),
    /// Along the picture.
    MoveFreely,
    /// About an axis.
    Turn(usize),
}

/// What a drag in the picture does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Drag {
    Orbit,
    Pan,
    Look,
    /// Turns the sun by the pointer's motion.
    TurnSun(usize),
    /// The sun is where the pointer is.
    PlaceSun(usize),
    Handle(Handle),
    /// Between the two sides of a comparison.
    Divider,
}

/// What a drag of a handle does.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Change {
    Shift(DVec3),
    Turn(DQuat),
}

/// Handles about a point of the scene, as they are in the picture.
pub struct Handles {
    projection: Projection,
    screen: Rect,
    middle: DVec3,
    /// Length of an arrow, m.
    length: f64,
    turns: bool,
}

impl Handles {
    /// Handles at `middle`; `None` behind the camera. `turns`: with circles.
    pub fn new(
        projection: Projection,
        screen: Rect,
        fov: f64,
        middle: DVec3,
        turns: bool,
    ) -> Option<Self> {
        let depth = projection.depth(middle);
        let length = LENGTH * 2.0 * depth * (0.5 * fov).tan();
        (depth > 0.0).then_some(Self {
            projection,
            screen,
            middle,
            length,
            turns,
        })
    }

    fn at(&self, point: DVec3) -> Option<Pos2> {
        self.projection
            .place(point)
            .map(|place| on_screen(self.screen, place))
    }

    /// The arrow's ends.
    fn arrow(&self, axis: usize) -> Option<[Pos2; 2]> {
        Some([
            self.at(self.middle)?,
            self.at(self.middle + self.length * AXES[axis])?,
        ])
    }

    fn circle(&self, axis: usize) -> Vec<Pos2> {
        let (u, v) = (AXES[(axis + 1) % 3], AXES[(axis + 2) % 3]);
        let point = |index: usize| {
            let angle = TAU * index as f64 / SEGMENTS as f64;
            self.at(self.middle + CIRCLE * self.length * (angle.cos() * u + angle.sin() * v))
        };
        (0..=SEGMENTS).filter_map(point).collect()
    }

    /// What the pointer would take hold of.
    pub fn under(&self, pointer: Pos2) -> Option<Handle> {
        let middle = self.at(self.middle)?;
        if middle.distance(pointer) <= REACH {
            return Some(Handle::MoveFreely);
        }
        let arrows = (0..3).filter_map(|axis| {
            let [a, b] = self.arrow(axis)?;
            Some((distance_to_segment(pointer, a, b), Handle::Move(axis)))
        });
        let circles = (0..3).filter(|_| self.turns).flat_map(|axis| {
            let points = self.circle(axis);
            let segments: Vec<_> = points.windows(2).map(|pair| [pair[0], pair[1]]).collect();
            segments
                .into_iter()
                .map(move |[a, b]| (distance_to_segment(pointer, a, b), Handle::Turn(axis)))
        });
        let nearest = arrows
            .chain(circles)
            .min_by(|(a, _), (b, _)| a.total_cmp(b));
        nearest
            .filter(|(distance, _)| *distance <= REACH)
            .map(|(_, handle)| handle)
    }

    /// What a drag from one place to another does.
    pub fn drag(&self, handle: Handle, from: Pos2, to: Pos2) -> Option<Change> {
        match handle {
            Handle::Move(axis) => {
                let [start, tip] = self.arrow(axis)?;
                let along = tip - start;
                // An arrow that points at the viewer has no length to move along.
                if along.length() < 2.0 {
                    return None;
                }
                let share = (to - from).dot(along) / along.length_sq();
                Some(Change::Shift(f64::from(share) * self.length * AXES[axis]))
            }
            Handle::MoveFreely => {
                let depth = self.projection.depth(self.middle);
                let at = |p: Pos2| {
                    let direction = self.projection.direction(in_picture(self.screen, p));
                    direction * (depth / self.projection.depth_of_direction(direction))
                };
                Some(Change::Shift(at(to) - at(from)))
            }
            Handle::Turn(axis) => {
                let middle = self.at(self.middle)?;
                let angle = |p: Pos2| f64::from((p - middle).angle());
                // Angles on the screen are clockwise.
                let away = self.projection.direction_to(self.middle).dot(AXES[axis]) > 0.0;
                let turned = angle(to) - angle(from);
                Some(Change::Turn(DQuat::from_axis_angle(
                    AXES[axis],
                    if away { turned } else { -turned },
                )))
            }
        }
    }

    pub fn paint(&self, painter: &Painter, hovered: Option<Handle>) {
        let stroke = |axis: usize, handle: Handle| {
            let width = if hovered == Some(handle) { 4.0 } else { 2.0 };
            Stroke::new(width, COLORS[axis])
        };
        for axis in 0..3 {
            if self.turns {
                painter.line(self.circle(axis), stroke(axis, Handle::Turn(axis)));
            }
            if let Some([start, tip]) = self.arrow(axis) {
                painter.arrow(start, tip - start, stroke(axis, Handle::Move(axis)));
            }
        }
        if let Some(middle) = self.at(self.middle) {
            let radius = if hovered == Some(Handle::MoveFreely) {
                7.0
            } else {
                5.0
            };
            painter.circle_filled(middle, radius, Color32::WHITE);
        }
    }
}

/// Converts shares of the picture to points of the screen.
pub fn on_screen(screen: Rect, place: DVec2) -> Pos2 {
    screen.min + Vec2::new(place.x as f32, place.y as f32) * screen.size()
}

/// Converts points of the screen to shares of the picture.
pub fn in_picture(screen: Rect, point: Pos2) -> DVec2 {
    let share = (point - screen.min) / screen.size();
    DVec2::new(share.x.into(), share.y.into())
}

fn distance_to_segment(p: Pos2, a: Pos2, b: Pos2) -> f32 {
    let along = b - a;
    let share = ((p - a).dot(along) / along.length_sq().max(1e-6)).clamp(0.0, 1.0);
    p.distance(a + share * along)
}

/// Where the marks of lights are.
pub fn light_marks(scene: &Scene, projection: &Projection, screen: Rect) -> Vec<(usize, Pos2)> {
    let place = |(index, kind): (usize, &LightKind)| {
        let point = on_screen(screen, light_place(projection, kind)?);
        screen.contains(point).then_some((index, point))
    };
    scene
        .lights
        .iter()
        .map(|light| &light.kind)
        .enumerate()
        .filter_map(place)
        .collect()
}

/// The light whose mark is under the pointer.
pub fn light_under(marks: &[(usize, Pos2)], pointer: Pos2) -> Option<usize> {
    let nearest = marks
        .iter()
        .min_by(|(_, a), (_, b)| a.distance(pointer).total_cmp(&b.distance(pointer)));
    nearest
        .filter(|(_, at)| at.distance(pointer) <= 2.0 * REACH)
        .map(|(index, _)| *index)
}

/// Draws a light: a disc with rays.
pub fn paint_light(painter: &Painter, at: Pos2, is_selected: bool) {
    let width = if is_selected { 3.0 } else { 1.5 };
    painter.circle_stroke(at, 7.0, Stroke::new(width, LIGHT_COLOR));
    for ray in 0..8 {
        let direction = Vec2::angled(ray as f32 * std::f32::consts::TAU / 8.0);
        painter.line_segment(
            [at + 9.0 * direction, at + 13.0 * direction],
            Stroke::new(width, LIGHT_COLOR),
        );
    }
}

/// A disc as seen from the zenith: the sky, with a sun. The direction that the pointer chooses.
pub fn sky_dial(ui: &mut egui::Ui, direction: DVec3) -> Option<DVec3> {
    let size = Vec2::splat(120.0);
    let (rect, response) = ui.allocate_exact_size(size, egui::Sense::click_and_drag());
    let radius = 0.5 * size.x - 2.0;
    let painter = ui.painter();
    painter.circle_filled(rect.center(), radius, Color32::from_rgb(40, 60, 90));
    for share in [1.0 / 3.0, 2.0 / 3.0] {
        painter.circle_stroke(
            rect.center(),
            share * radius,
            Stroke::new(0.5, Color32::GRAY),
        );
    }
    // Equal angles from the zenith are equally far apart. Below the horizon the mark stays on the rim.
    let zenith = direction.y.clamp(-1.0, 1.0).acos() / std::f64::consts::FRAC_PI_2;
    let flat = DVec2::new(direction.x, direction.z).normalize_or_zero() * zenith.min(1.0);
    let mark = rect.center() + radius * Vec2::new(flat.x as f32, flat.y as f32);
    paint_light(painter, mark, true);
    let pointer = response
        .interact_pointer_pos()
        .filter(|_| response.dragged() || response.clicked())?;
    let offset = (pointer - rect.center()) / radius;
    let flat = DVec2::new(offset.x.into(), offset.y.into()).clamp_length_max(0.99);
    let angle = flat.length() * std::f64::consts::FRAC_PI_2;
    let around = flat.normalize_or_zero();
    Some(DVec3::new(
        angle.sin() * around.x,
        angle.cos(),
        angle.sin() * around.y,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use egui::pos2;
    use nephroid::scene::Camera;

    fn handles() -> Handles {
        let camera = Camera {
            position: DVec3::new(0.0, 0.0, 5.0),
            target: DVec3::ZERO,
            fov: 0.8,
            exposure_ev: 0.0,
        };
        let screen = Rect::from_min_size(Pos2::ZERO, Vec2::new(800.0, 600.0));
        Handles::new(
            Projection::new(&camera, 4.0 / 3.0),
            screen,
            camera.fov,
            DVec3::ZERO,
            true,
        )
        .unwrap()
    }

    #[test]
    fn arrows_follow_the_pointer() {
        let handles = handles();
        let [start, tip] = handles.arrow(0).unwrap();
        assert_eq!(handles.under(start.lerp(tip, 0.9)), Some(Handle::Move(0)));
        assert_eq!(handles.under(start), Some(Handle::MoveFreely));
        assert_eq!(handles.under(pos2(5.0, 5.0)), None);
        let Some(Change::Shift(shift)) = handles.drag(Handle::Move(0), start, tip) else {
            panic!()
        };
        assert!(shift.distance(handles.length * DVec3::X) < 1e-6, "{shift}");
        let Some(Change::Shift(shift)) = handles.drag(Handle::MoveFreely, start, tip) else {
            panic!()
        };
        assert!(shift.distance(handles.length * DVec3::X) < 1e-3, "{shift}");
        assert_eq!(handles.drag(Handle::Move(2), start, tip), None);
    }

    /// The z axis points at the viewer: from the right to the top is counter-clockwise.
    #[test]
    fn circles_turn_with_the_pointer() {
        let handles = handles();
        let middle = handles.at(DVec3::ZERO).unwrap();
        let (right, top) = (middle + Vec2::new(50.0, 0.0), middle - Vec2::new(0.0, 50.0));
        let Some(Change::Turn(turn)) = handles.drag(Handle::Turn(2), right, top) else {
            panic!()
        };
        assert!((turn * DVec3::X).distance(DVec3::Y) < 1e-6, "{turn}");
    }
}
