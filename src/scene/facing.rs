//! Mirrors that throw no light because of where they face.

use super::{LightKind, MaterialKind, Mesh, Scene};
use glam::DVec3;

impl Scene {
    /// Why mirrors that look away from every light or every receiver throw no caustic, a sentence
    /// each. What stands in the light's way does not count.
    pub fn idle_mirrors(&self) -> Vec<String> {
        let corners: Vec<DVec3> = (self.objects.iter())
            .filter(|object| object.light_map.is_some())
            .flat_map(|object| corners_of_box(&object.geometry.mesh()))
            .collect();
        let mut notes = Vec::new();
        for object in &self.objects {
            // Dielectrics throw light from both sides.
            if !matches!(
                self.materials[object.material].kind,
                MaterialKind::Mirror { .. } | MaterialKind::Conductor { .. }
            ) {
                continue;
            }
            let mesh = object.geometry.mesh();
            let (mut lit, mut throws) = (false, false);
            for triangle in &mesh.triangles {
                let [a, b, c] = triangle.map(|corner| mesh.positions[corner as usize]);
                let normal = (b - a).cross(c - a).normalize_or_zero();
                if self.shines_on(a, normal) {
                    lit = true;
                    throws = corners.iter().any(|corner| normal.dot(*corner - a) > 0.0);
                }
                if throws {
                    break;
                }
            }
            let away = match (lit, throws) {
                (_, true) => continue,
                (false, _) => "all of its faces look away from every light",
                (true, false) => "its faces that look toward a light look away from every receiver",
            };
            let name = object.name.escape_debug();
            notes.push(format!("object \"{name}\" throws no caustic: {away}"));
        }
        notes
    }

    /// Whether any of a light is above the plane through `point`.
    fn shines_on(&self, point: DVec3, normal: DVec3) -> bool {
        self.lights.iter().any(|light| match &light.kind {
            LightKind::Sun {
                direction,
                angular_radius,
                ..
            } => normal.dot(*direction) > -angular_radius.sin(),
            LightKind::Lamp {
                position, radius, ..
            } => normal.dot(*position - point) > -radius,
            LightKind::Environment { .. } => true,
        })
    }
}

/// Of the bounding box: whatever sees none of them sees nothing of what is inside.
fn corners_of_box(mesh: &Mesh) -> [DVec3; 8] {
    let [lower, upper] = mesh.bounds();
    std::array::from_fn(|i| {
        let pick = |axis: usize| if i >> axis & 1 == 0 { lower } else { upper }[axis];
        DVec3::new(pick(0), pick(1), pick(2))
    })
}
