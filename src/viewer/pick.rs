//! Finds the object under a point of the picture, and the place of a scene point in the picture.

use super::orbit::axes;
use glam::{DVec2, DVec3};
use nephroid::glam;
use nephroid::reference::Triangle;
use nephroid::scene::{Camera, LightKind, MaterialKind, Scene};

/// The picture's plane: places in it are in shares of its width and height, from the upper left corner.
#[derive(Clone, Copy)]
pub struct Projection {
    position: DVec3,
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// Tangents of half the fields of view.
    half: DVec2,
}

impl Projection {
    /// `aspect` is the picture's width over its height.
    pub fn new(camera: &Camera, aspect: f64) -> Self {
        let [right, up, forward] = axes(camera);
        let half = (0.5 * camera.fov).tan();
        Self {
            position: camera.position,
            right,
            up,
            forward,
            half: DVec2::new(half * aspect, half),
        }
    }

    /// Unit vector from the camera through a place.
    pub fn direction(&self, place: DVec2) -> DVec3 {
        let x = (2.0 * place.x - 1.0) * self.half.x;
        let y = (1.0 - 2.0 * place.y) * self.half.y;
        (self.forward + x * self.right + y * self.up).normalize()
    }

    /// The place of a direction; `None` behind the camera.
    pub fn place_of_direction(&self, direction: DVec3) -> Option<DVec2> {
        let depth = direction.dot(self.forward);
        (depth > 1e-6).then(|| {
            let x = direction.dot(self.right) / (depth * self.half.x);
            let y = direction.dot(self.up) / (depth * self.half.y);
            DVec2::new(0.5 + 0.5 * x, 0.5 - 0.5 * y)
        })
    }

    /// The place of a point; `None` behind the camera.
    pub fn place(&self, point: DVec3) -> Option<DVec2> {
        self.place_of_direction(point - self.position)
    }

    /// Unit vector from the camera to a point.
    pub fn direction_to(&self, point: DVec3) -> DVec3 {
        (point - self.position).normalize_or(self.forward)
    }

    /// Along the line of sight, of a unit vector.
    pub fn depth_of_direction(&self, direction: DVec3) -> f64 {
        direction.dot(self.forward)
    }

    /// m
    pub fn depth(&self, point: DVec3) -> f64 {
        (point - self.position).dot(self.forward)
    }
}

/// The nearest object on a ray whose visible face the ray meets, and the distance in m.
pub fn object_at(scene: &Scene, origin: DVec3, direction: DVec3) -> Option<(usize, f64)> {
    let mut nearest: Option<(usize, f64)> = None;
    for (index, object) in scene.objects.iter().enumerate() {
        let mesh = object.geometry.mesh();
        // The back faces of opaque surfaces are not drawn.
        let is_two_sided = matches!(
            scene.materials[object.material].kind,
            MaterialKind::Dielectric(_)
        );
        for triangle in 0..mesh.triangles.len() {
            let [a, b, c] = mesh.corners(triangle);
            if !is_two_sided && (b - a).cross(c - a).dot(direction) >= 0.0 {
                continue;
            }
            if let Some((hit, _)) = Triangle::new([a, b, c]).crossing(origin, direction)
                && hit >= 0.0
                && nearest.is_none_or(|(_, distance)| hit < distance)
            {
                nearest = Some((index, hit));
            }
        }
    }
    nearest
}

/// Where a light is drawn: a lamp at its middle, a sun in its direction.
pub fn light_place(projection: &Projection, light: &LightKind) -> Option<DVec2> {
    match light {
        LightKind::Sun { direction, .. } => projection.place_of_direction(*direction),
        LightKind::Lamp { position, .. } => projection.place(*position),
        LightKind::Environment { .. } => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn camera() -> Camera {
        Camera {
            position: DVec3::new(1.0, 2.0, 5.0),
            target: DVec3::new(0.0, 0.5, 0.0),
            fov: 0.7,
            exposure_ev: 0.0,
        }
    }

    #[test]
    fn places_and_directions_are_inverse() {
        let projection = Projection::new(&camera(), 1.5);
        for place in [
            DVec2::new(0.5, 0.5),
            DVec2::new(0.1, 0.8),
            DVec2::new(0.95, 0.0),
        ] {
            let direction = projection.direction(place);
            let back = projection.place_of_direction(direction).unwrap();
            assert!(back.distance(place) < 1e-12, "{place} {back}");
        }
        assert!(
            projection
                .place(camera().position - 3.0 * projection.forward)
                .is_none()
        );
    }

    #[test]
    fn the_middle_of_a_picture_shows_what_the_camera_looks_at() {
        let path =
            std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/mirror.toml");
        let scene = nephroid::scene::load(&path).unwrap().scene;
        let projection = Projection::new(&scene.camera, 1.5);
        let direction = projection.direction(DVec2::splat(0.5));
        assert!(object_at(&scene, scene.camera.position, direction).is_some());
        assert!(object_at(&scene, scene.camera.position, -direction).is_none());
    }
}
