//! The surface that collects light, and its texels.

use super::visibility::Blockers;
use crate::reference::estimate::Map;
use crate::scene::{Atlas, Mesh, Rect};
use glam::{DVec2, DVec3};
use std::sync::Arc;

/// Something with a light map: last row at v = 0, column 0 at u = 0.
pub enum Receiver {
    Planar(PlanarReceiver),
    Mesh(MeshReceiver),
}

/// Where a ray meets a receiver's front.
#[derive(Debug)]
pub struct ReceiverHit {
    pub texel: usize,
    /// m
    pub distance: f64,
    /// Of any length.
    pub normal: DVec3,
    /// Of the receiver, as by [`crate::scene::Geometry::mesh`].
    pub triangle: u32,
    /// Of the triangle's second and third corner.
    pub weights: DVec2,
}

/// A point of a receiver.
pub struct ReceiverPoint {
    /// m
    pub position: DVec3,
    /// Unit, on the side that receives light.
    pub normal: DVec3,
    /// Area for which a point drawn evenly in the texel's square stands, over that of the texel.
    pub weight: f64,
}

impl Receiver {
    /// m²
    pub fn area(&self) -> f64 {
        match self {
            Self::Planar(planar) => planar.rect.area(),
            Self::Mesh(mesh) => mesh.area,
        }
    }

    /// Width and height, texels.
    pub fn size(&self) -> [u32; 2] {
        match self {
            Self::Planar(planar) => planar.size,
            Self::Mesh(mesh) => mesh.atlas.size(),
        }
    }

    pub fn texels(&self) -> usize {
        let [width, height] = self.size();
        width as usize * height as usize
    }

    /// Of what lies in the texel, m².
    pub fn texel_area(&self, texel: usize) -> f64 {
        match self {
            Self::Planar(planar) => planar.rect.area() / self.texels() as f64,
            Self::Mesh(mesh) => mesh.areas[texel],
        }
    }

    /// That a map of irradiance, W/m², stands for, W.
    pub fn flux(&self, map: &Map) -> [f64; 3] {
        (map.iter().enumerate())
            .map(|(texel, &irradiance)| self.texel_area(texel) * DVec3::from(irradiance))
            .sum::<DVec3>()
            .to_array()
    }

    pub fn empty_map(&self) -> Map {
        vec![[0.0; 3]; self.texels()]
    }

    /// Calls `meets` with every place on the receiver's front where the ray meets it.
    #[inline]
    pub fn hits(&self, origin: DVec3, direction: DVec3, mut meets: impl FnMut(ReceiverHit)) {
        match self {
            Self::Planar(planar) => {
                if let Some(hit) = planar.hit(origin, direction) {
                    meets(hit);
                }
            }
            Self::Mesh(mesh) => mesh.hits(origin, direction, meets),
        }
    }

    /// The texel of a point of the receiver, which lies on its triangle number `triangle` with these weights
    /// of the second and third corner. `None` where the light map has none for it.
    pub fn texel_at(&self, position: DVec3, triangle: u32, weights: DVec2) -> Option<usize> {
        match self {
            Self::Planar(planar) => Some(planar.texel_at(position)),
            Self::Mesh(mesh) => mesh.atlas.texel_at(triangle, weights),
        }
    }

    /// The point at (s, t) in [0, 1)² of a texel, if something lies there.
    pub fn point(&self, texel: usize, s: f64, t: f64) -> Option<ReceiverPoint> {
        match self {
            Self::Planar(planar) => Some(ReceiverPoint {
                position: planar.point(texel, s, t),
                normal: planar.normal,
                weight: 1.0,
            }),
            Self::Mesh(mesh) => mesh.point(texel, s, t),
        }
    }
}

/// A mesh with a light map.
pub struct MeshReceiver {
    mesh: Arc<Mesh>,
    atlas: Atlas,
    triangles: Blockers,
    /// Of the texels, m².
    areas: Vec<f64>,
    /// Their sum, m².
    area: f64,
}

impl MeshReceiver {
    /// `None` for a mesh without triangles.
    pub fn new(mesh: &Arc<Mesh>, atlas: Atlas) -> Option<Self> {
        let corners: Vec<_> = (0..mesh.triangles.len()).map(|t| mesh.corners(t)).collect();
        let areas: Vec<f64> = atlas.texels(mesh).iter().map(|texel| texel.area).collect();
        Some(Self {
            area: areas.iter().sum(),
            areas,
            triangles: Blockers::new(&corners)?,
            mesh: mesh.clone(),
            atlas,
        })
    }

    fn hits(&self, origin: DVec3, direction: DVec3, mut meets: impl FnMut(ReceiverHit)) {
        let on_front = |triangle: u32, distance, weights| {
            let normal = self.mesh.vector_area(triangle as usize);
            let faces = normal.dot(direction) < 0.0;
            if let Some(texel) = self.atlas.texel_at(triangle, weights).filter(|_| faces) {
                meets(ReceiverHit {
                    texel,
                    distance,
                    normal,
                    triangle,
                    weights,
                });
            }
        };
        self.triangles.all_along(origin, direction, on_front);
    }

    fn point(&self, texel: usize, s: f64, t: f64) -> Option<ReceiverPoint> {
        let width = self.atlas.size()[0] as usize;
        let corner = DVec2::new((texel % width) as f64, (texel / width) as f64);
        // Both from the texel's lower left corner, as on a rect.
        let place = corner + DVec2::new(s, 1.0 - t);
        (self.atlas.pieces(texel).iter()).find_map(|piece| {
            let weights = self.atlas.weights_at(piece.triangle, place);
            if weights.min_element() < 0.0 || weights.element_sum() > 1.0 {
                return None;
            }
            let triangle = piece.triangle as usize;
            let vector_area = self.mesh.vector_area(triangle);
            let area = vector_area.length();
            Some(ReceiverPoint {
                position: self.mesh.point(triangle, weights),
                normal: vector_area / area,
                weight: area / self.atlas.texels_of(piece.triangle) / self.areas[texel],
            })
        })
    }
}

/// A rect with a light map.
pub struct PlanarReceiver {
    rect: Rect,
    normal: DVec3,
    /// edge/|edge|², so that a dot product gives u or v.
    scaled_edges: [DVec3; 2],
    size: [u32; 2],
}

impl PlanarReceiver {
    pub fn new(rect: Rect, size: [u32; 2]) -> Self {
        Self {
            rect,
            normal: rect.normal(),
            scaled_edges: [rect.edge_u, rect.edge_v].map(|edge| edge / edge.length_squared()),
            size,
        }
    }

    #[inline]
    fn hit(&self, origin: DVec3, direction: DVec3) -> Option<ReceiverHit> {
        let approach = self.normal.dot(direction);
        if approach >= 0.0 {
            return None;
        }
        let distance = self.normal.dot(self.rect.origin - origin) / approach;
        if distance < 0.0 {
            return None;
        }
        let [u, v] = self.coordinates(origin + distance * direction);
        if !(0.0..1.0).contains(&u) || !(0.0..1.0).contains(&v) {
            return None;
        }
        // The triangles are (0, 0), (1, 0), (1, 1) and (0, 0), (1, 1), (0, 1).
        let (triangle, weights) = match v <= u {
            true => (0, DVec2::new(u - v, v)),
            false => (1, DVec2::new(u, v - u)),
        };
        Some(ReceiverHit {
            texel: self.texel(u, v),
            distance,
            normal: self.normal,
            triangle,
            weights,
        })
    }

    /// u and v.
    #[inline]
    fn coordinates(&self, position: DVec3) -> [f64; 2] {
        let place = position - self.rect.origin;
        self.scaled_edges.map(|edge| place.dot(edge))
    }

    /// Of u and v; the nearest one where they are not within [0, 1).
    #[inline]
    fn texel(&self, u: f64, v: f64) -> usize {
        let [width, height] = self.size;
        let column = ((u * f64::from(width)) as usize).min(width as usize - 1);
        let row_up = ((v * f64::from(height)) as usize).min(height as usize - 1);
        let row = height as usize - 1 - row_up;
        row * width as usize + column
    }

    fn texel_at(&self, position: DVec3) -> usize {
        let [u, v] = self.coordinates(position);
        self.texel(u, v)
    }

    /// The point at (s, t) in [0, 1)² of a texel.
    fn point(&self, texel: usize, s: f64, t: f64) -> DVec3 {
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
        let receiver = PlanarReceiver::new(rect, [4, 3]);
        for texel in 0..12 {
            let point = receiver.point(texel, 0.3, 0.8);
            let direction = DVec3::new(0.1, -1.0, 0.2).normalize();
            let hit = receiver.hit(point - 2.0 * direction, direction).unwrap();
            assert_eq!(hit.texel, texel);
            assert!((hit.distance - 2.0).abs() < 1e-12);
            let found = rect.to_mesh().point(hit.triangle as usize, hit.weights);
            assert!(found.distance(point) < 1e-12);
            assert!(receiver.hit(point + direction, -direction).is_none());
            assert!(receiver.hit(point + direction, direction).is_none());
        }
        // Last row at v = 0, column 0 at u = 0.
        let hit = receiver
            .hit(rect.origin + DVec3::new(0.1, 1.0, -0.1), DVec3::NEG_Y)
            .unwrap();
        assert_eq!(hit.texel, 8);
        let beside = rect.origin + DVec3::new(-0.1, 1.0, -0.1);
        assert!(receiver.hit(beside, DVec3::NEG_Y).is_none());
    }
}
