//! Laws of geometrical optics in f64. Angles in radians, directions are unit vectors.

use glam::DVec3;

/// Direction into which a mirror sends light that travels along `direction`:
///
/// ```text
/// r = d − 2 (d·n) n
/// ```
///
/// `normal` is a unit vector; its sign does not matter. The angle of reflection equals the angle
/// of incidence and r lies in the plane of d and n (Pharr, Jakob, Humphreys, *Physically Based
/// Rendering*, 4th ed., section 9.1.2, with d = −ω_o).
pub fn reflect(direction: DVec3, normal: DVec3) -> DVec3 {
    direction - 2.0 * direction.dot(normal) * normal
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn unit_vector() -> impl Strategy<Value = DVec3> {
        (-1.0..1.0, 0.0..std::f64::consts::TAU).prop_map(|(z, azimuth): (f64, f64)| {
            let r = (1.0 - z * z).sqrt();
            DVec3::new(r * azimuth.cos(), r * azimuth.sin(), z)
        })
    }

    proptest! {
        #[test]
        fn reflection_keeps_angle_plane_and_length(d in unit_vector(), n in unit_vector()) {
            let r = reflect(d, n);
            prop_assert!((r.length() - 1.0).abs() < 1e-12);
            prop_assert!((r.dot(n) + d.dot(n)).abs() < 1e-12);
            prop_assert!(r.dot(d.cross(n)).abs() < 1e-12);
            prop_assert!(reflect(r, n).distance(d) < 1e-12);
            prop_assert!(reflect(d, -n).distance(r) < 1e-12);
        }

        #[test]
        fn mirror_turned_by_an_angle_turns_the_ray_by_twice_that(angle in -0.7..0.7) {
            let n = DVec3::new(f64::sin(angle), f64::cos(angle), 0.0);
            let twice = DVec3::new(f64::sin(2.0 * angle), f64::cos(2.0 * angle), 0.0);
            prop_assert!(reflect(DVec3::NEG_Y, n).distance(twice) < 1e-12);
        }
    }
}
