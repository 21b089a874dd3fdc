//! The rectangle that collects light, and its texels.

use crate::reference::Map;
use crate::scene::Rect;
use glam::DVec3;

/// A rect with a light map: last row at v = 0, column 0 at u = 0.
pub struct Receiver {
    rect: Rect,
    normal: DVec3,
    /// edge/|edge|², so that a dot product gives u or v.
    scaled_edges: [DVec3; 2],
    size: [u32; 2],
}

impl Receiver {
    pub fn new(rect: Rect, size: [u32; 2]) -> Self {
        Self {
            rect,
            normal: rect.normal(),
            scaled_edges: [rect.edge_u, rect.edge_v].map(|edge| edge / edge.length_squared()),
            size,
        }
    }

    /// Unit normal of the side that receives light.
    pub fn normal(&self) -> DVec3 {
        self.normal
    }

    /// m²
    pub fn area(&self) -> f64 {
        self.rect.area()
    }

    /// Width and height, texels.
    pub fn size(&self) -> [u32; 2] {
        self.size
    }

    pub fn texels(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    /// m²
    pub fn texel_area(&self) -> f64 {
        self.area() / self.texels() as f64
    }

    pub fn empty_map(&self) -> Map {
        vec![[0.0; 3]; self.texels()]
    }

    /// The texel whose front the ray meets, and the distance to it in m.
    #[inline]
    pub fn hit(&self, origin: DVec3, direction: DVec3) -> Option<(usize, f64)> {
        let approach = self.normal.dot(direction);
        if approach >= 0.0 {
            return None;
        }
        let distance = self.normal.dot(self.rect.origin - origin) / approach;
        if distance < 0.0 {
            return None;
        }
        let place = origin + distance * direction - self.rect.origin;
        let u = place.dot(self.scaled_edges[0]);
        let v = place.dot(self.scaled_edges[1]);
        if !(0.0..1.0).contains(&u) || !(0.0..1.0).contains(&v) {
            return None;
        }
        let [width, height] = self.size;
        let column = ((u * f64::from(width)) as usize).min(width as usize - 1);
        let row_up = ((v * f64::from(height)) as usize).min(height as usize - 1);
        let row = height as usize - 1 - row_up;
        Some((row * width as usize + column, distance))
    }

    /// The point at (s, t) in [0, 1)² of a texel.
    pub fn point(&self, texel: usize, s: f64, t: f64) -> DVec3 {
        let [width, height] = self.size.map(|n| n as usize);
        let (column, row_up) = (texel % width, height - 1 - texel / width);
        let u = (column as f64 + s) / width as f64;
        let v = (row_up as f64 + t) / height as f64;
        self.rect.origin + u * self.rect.edge_u + v * self.rect.edge_v
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rays_meet_the_texels_that_points_lie_in_and_only_from_the_front() {
        let rect = Rect {
            origin: DVec3::new(-1.0, 0.5, 1.0),
            edge_u: DVec3::new(2.0, 0.0, 0.0),
            edge_v: DVec3::new(0.0, 0.0, -3.0),
        };
        let receiver = Receiver::new(rect, [4, 3]);
        for texel in 0..12 {
            let point = receiver.point(texel, 0.3, 0.8);
            let direction = DVec3::new(0.1, -1.0, 0.2).normalize();
            let (hit, distance) = receiver.hit(point - 2.0 * direction, direction).unwrap();
            assert_eq!(hit, texel);
            assert!((distance - 2.0).abs() < 1e-12);
            assert!(receiver.hit(point + direction, -direction).is_none());
            assert!(receiver.hit(point + direction, direction).is_none());
        }
        // Last row at v = 0, column 0 at u = 0.
        let (texel, _) = receiver
            .hit(rect.origin + DVec3::new(0.1, 1.0, -0.1), DVec3::NEG_Y)
            .unwrap();
        assert_eq!(texel, 8);
        let beside = rect.origin + DVec3::new(-0.1, 1.0, -0.1);
        assert!(receiver.hit(beside, DVec3::NEG_Y).is_none());
    }
}
