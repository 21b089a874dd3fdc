//! Moves the camera: orbit, pan, zoom and fly.

use glam::{DQuat, DVec3};
use nephroid::glam;
use nephroid::scene::Camera;

/// Angle between the line of sight and the vertical, at least, rad.
const MIN_POLAR: f64 = 0.02;

/// Unit vectors of a camera: to the right, up in the picture, and forward.
pub fn axes(camera: &Camera) -> [DVec3; 3] {
    let forward = (camera.target - camera.position)
        .try_normalize()
        .unwrap_or(DVec3::NEG_Z);
    let right = forward.cross(DVec3::Y).try_normalize().unwrap_or(DVec3::X);
    [right, right.cross(forward), forward]
}

/// Turns `offset` about the vertical and then toward it, not beyond the vertical.
fn turned(offset: DVec3, azimuth: f64, polar: f64) -> DVec3 {
    let offset = DQuat::from_rotation_y(azimuth) * offset;
    let length = offset.length();
    let horizontal = DVec3::new(offset.x, 0.0, offset.z)
        .try_normalize()
        .unwrap_or(DVec3::Z);
    let now = (offset.y / length).clamp(-1.0, 1.0).acos();
    let next = (now + polar).clamp(MIN_POLAR, std::f64::consts::PI - MIN_POLAR);
    length * (next.sin() * horizontal + next.cos() * DVec3::Y)
}

/// Turns the camera about its target, rad.
pub fn orbit(camera: &mut Camera, azimuth: f64, polar: f64) {
    camera.position = camera.target + turned(camera.position - camera.target, azimuth, polar);
}

/// Turns the camera about itself, rad.
pub fn look(camera: &mut Camera, azimuth: f64, polar: f64) {
    camera.target = camera.position + turned(camera.target - camera.position, azimuth, -polar);
}

/// Moves camera and target along the picture, as shares of its height.
pub fn pan(camera: &mut Camera, right: f64, up: f64) {
    let height = 2.0 * (0.5 * camera.fov).tan() * camera.position.distance(camera.target);
    let [to_right, to_top, _] = axes(camera);
    let shift = height * (right * to_right + up * to_top);
    camera.position += shift;
    camera.target += shift;
}

/// Moves the camera toward its target, so that the distance is `factor` times as large.
pub fn zoom(camera: &mut Camera, factor: f64) {
    let offset = camera.position - camera.target;
    let length = (offset.length() * factor).clamp(1e-4, 1e7);
    camera.position = camera.target + length * offset.normalize_or(DVec3::Z);
}

/// Moves camera and target by metres along the camera's axes.
pub fn fly(camera: &mut Camera, by: DVec3) {
    let [right, up, forward] = axes(camera);
    let shift = by.x * right + by.y * up + by.z * forward;
    camera.position += shift;
    camera.target += shift;
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera {
            position: DVec3::new(0.0, 1.0, 3.0),
            target: DVec3::new(0.0, 0.5, 0.0),
            fov: 0.7,
            exposure_ev: 0.0,
        }
    }

    #[test]
    fn orbits_keep_the_distance_and_stay_upright() {
        let mut orbited = camera();
        let distance = orbited.position.distance(orbited.target);
        for _ in 0..100 {
            orbit(&mut orbited, 0.3, -0.2);
        }
        assert!((orbited.position.distance(orbited.target) / distance - 1.0).abs() < 1e-9);
        assert!(orbited.position.y > orbited.target.y);
        let [right, up, forward] = axes(&orbited);
        assert!(right.dot(up).abs() < 1e-9 && up.dot(forward).abs() < 1e-9 && up.y > 0.0);
    }

    #[test]
    fn looking_around_keeps_the_place() {
        let mut looking = camera();
        look(&mut looking, 0.5, 0.1);
        assert_eq!(looking.position, camera().position);
        assert!(looking.target.distance(camera().target) > 0.5);
    }

    #[test]
    fn zooming_out_and_in_again() {
        let mut zoomed = camera();
        zoom(&mut zoomed, 4.0);
        zoom(&mut zoomed, 0.25);
        assert!(zoomed.position.distance(camera().position) < 1e-9);
        pan(&mut zoomed, 0.5, 0.0);
        assert!(zoomed.target.y == camera().target.y && zoomed.target.x != 0.0);
    }
}
