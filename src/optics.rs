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

/// Direction into which light that travels along `direction` is bent by a surface between two media,
/// or `None` where all of it is reflected (Snell's law; Pharr, Jakob, Humphreys, *Physically Based
/// Rendering*, 4th ed., section 9.3.2):
///
/// ```text
/// t = ratio d + (ratio cosθ_i − cosθ_t) n,   sinθ_t = ratio sinθ_i
/// ```
///
/// `normal` is a unit vector on the side that the light comes from, and `ratio` the index of
/// refraction there over that on the other side.
pub fn refract(direction: DVec3, normal: DVec3, ratio: f64) -> Option<DVec3> {
    let cosine = -direction.dot(normal);
    let square = 1.0 - ratio * ratio * (1.0 - cosine * cosine);
    (square > 0.0).then(|| ratio * direction + (ratio * cosine - square.sqrt()) * normal)
}

/// Share of unpolarised light that a surface between two transparent media reflects (Fresnel's
/// equations; *Physically Based Rendering*, section 9.3.5); the rest passes.
///
/// `cosine` is that of the angle of incidence, and `ratio` as in [`refract`].
pub fn fresnel_dielectric(cosine: f64, ratio: f64) -> f64 {
    let square = 1.0 - ratio * ratio * (1.0 - cosine * cosine);
    if square <= 0.0 {
        return 1.0;
    }
    let beyond = square.sqrt();
    let across = (ratio * cosine - beyond) / (ratio * cosine + beyond);
    let along = (cosine - ratio * beyond) / (cosine + ratio * beyond);
    0.5 * (across * across + along * along)
}

/// Share of unpolarised light that a metal in air reflects, by its complex index of refraction
/// `index` + i `extinction` (Fresnel's equations; Born and Wolf, *Principles of Optics*, 7th ed.,
/// section 14.2).
///
/// `cosine` is that of the angle of incidence.
pub fn fresnel_conductor(cosine: f64, index: f64, extinction: f64) -> f64 {
    let (cosine2, sine2) = (cosine * cosine, 1.0 - cosine * cosine);
    let (index2, extinction2) = (index * index, extinction * extinction);
    // (a + i b)² = (n + i k)² − sin²θ
    let real = index2 - extinction2 - sine2;
    let modulus = (real * real + 4.0 * index2 * extinction2).sqrt();
    let a = (0.5 * (modulus + real)).max(0.0).sqrt();
    let across = (modulus + cosine2 - 2.0 * a * cosine) / (modulus + cosine2 + 2.0 * a * cosine);
    let (even, odd) = (modulus * cosine2 + sine2 * sine2, 2.0 * a * cosine * sine2);
    let along = across * (even - odd) / (even + odd);
    0.5 * (across + along)
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

        /// sinθ_t / sinθ_i is the ratio, all three lie in a plane, and the way back is the same.
        #[test]
        fn refraction_obeys_snell(d in unit_vector(), n in unit_vector(), ratio in 0.4..2.5) {
            let n = if d.dot(n) < 0.0 { n } else { -n };
            let sine = ratio * d.cross(n).length();
            let Some(t) = refract(d, n, ratio) else {
                prop_assert!(sine > 1.0 - 1e-12);
                return Ok(());
            };
            prop_assert!((t.length() - 1.0).abs() < 1e-12);
            prop_assert!((t.cross(n).length() - sine).abs() < 1e-12);
            prop_assert!(t.dot(d.cross(n)).abs() < 1e-12 && t.dot(n) < 0.0);
            if t.dot(n) < -1e-3 {
                let back = refract(-t, -n, 1.0 / ratio).unwrap();
                prop_assert!(back.distance(-d) < 1e-9);
            }
        }

        /// The same share is reflected from either side, at the angles that belong together.
        #[test]
        fn dielectrics_reflect_alike_from_both_sides(cosine in 0.01..1.0, index in 1.01..2.5) {
            let inside = f64::sqrt(1.0 - (1.0 - cosine * cosine) / (index * index));
            let (from_air, from_glass) =
                (fresnel_dielectric(cosine, 1.0 / index), fresnel_dielectric(inside, index));
            prop_assert!((from_air - from_glass).abs() < 1e-12);
            prop_assert!((0.0..=1.0).contains(&from_air));
            // A metal that does not absorb is glass.
            prop_assert!((fresnel_conductor(cosine, index, 0.0) - from_air).abs() < 1e-9);
        }

        #[test]
        fn mirror_turned_by_an_angle_turns_the_ray_by_twice_that(angle in -0.7..0.7) {
            let n = DVec3::new(f64::sin(angle), f64::cos(angle), 0.0);
            let twice = DVec3::new(f64::sin(2.0 * angle), f64::cos(2.0 * angle), 0.0);
            prop_assert!(reflect(DVec3::NEG_Y, n).distance(twice) < 1e-12);
        }
    }

    /// ((n − 1)² + k²) / ((n + 1)² + k²) straight on, all of it at grazing incidence; nothing of one
    /// polarisation at Brewster's angle; everything beyond the critical angle.
    #[test]
    fn shares_at_special_angles() {
        let near = |a: f64, b: f64| assert!((a - b).abs() < 1e-12, "{a} {b}");
        near(fresnel_dielectric(1.0, 1.0 / 1.5), 0.04);
        near(fresnel_dielectric(0.0, 1.0 / 1.5), 1.0);
        near(
            fresnel_conductor(1.0, 0.2, 3.0),
            (0.64 + 9.0) / (1.44 + 9.0),
        );
        near(fresnel_conductor(0.0, 0.2, 3.0), 1.0);
        let brewster = f64::atan(1.5);
        let across = ((1.5f64.powi(2) - 1.0) / (1.5f64.powi(2) + 1.0)).powi(2);
        near(fresnel_dielectric(brewster.cos(), 1.0 / 1.5), 0.5 * across);
        let critical = f64::asin(1.0 / 1.5);
        near(fresnel_dielectric(f64::cos(critical + 0.01), 1.5), 1.0);
        assert!(fresnel_dielectric(f64::cos(critical - 0.01), 1.5) < 0.6);
    }
}
