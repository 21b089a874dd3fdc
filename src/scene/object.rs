//! Surfaces with what they are made of, and what their light maps are laid out from.

use super::geometry::{Geometry, Mesh};
use glam::DVec2;
use std::borrow::Cow;
use std::sync::Arc;

/// Most texels on a side of a light map: 8192² RGB values in f64 take 1.6 GB.
pub const MAX_LIGHT_MAP_SIDE: u32 = 8192;

/// A number of texels that a side of a light map can have.
///
/// # Errors
/// The reason why not.
pub fn light_map_side(texels: i64) -> Result<u32, String> {
    (u32::try_from(texels).ok())
        .filter(|side| (1..=MAX_LIGHT_MAP_SIDE).contains(side))
        .ok_or_else(|| {
            format!("a light map has 1 to {MAX_LIGHT_MAP_SIDE} texels a side, not {texels}")
        })
}

/// What the light map of a mesh is laid out from: the same at all times.
#[derive(Debug, Clone, PartialEq)]
pub struct Unwrapping {
    /// At rest.
    pub rest: Arc<Mesh>,
    /// Texture coordinates of the corners of its triangles, by the file; empty where it has none.
    pub own: Vec<[DVec2; 3]>,
}

/// A surface with one material.
#[derive(Debug, Clone)]
pub struct Object {
    pub name: String,
    /// Index into [`super::Scene::materials`].
    pub material: usize,
    pub geometry: Geometry,
    /// Texels (width, height) of the light map; only diffuse rects and meshes have one.
    pub light_map: Option<[u32; 2]>,
    /// What a mesh's light map is laid out from; without, from the mesh as it is now.
    pub unwrapping: Option<Arc<Unwrapping>>,
    /// Texture coordinates of the corners of a mesh's triangles, by its file, where its material has an albedo map; all finite.
    pub uvs: Option<Arc<Vec<[DVec2; 3]>>>,
    /// Whether the surface casts shadows. The camera and mirrors see it in any case.
    pub blocks_light: bool,
}

impl Object {
    /// An object that casts shadows, without a light map and texture coordinates.
    pub fn new(name: impl Into<String>, material: usize, geometry: Geometry) -> Self {
        Self {
            name: name.into(),
            material,
            geometry,
            light_map: None,
            unwrapping: None,
            uvs: None,
            blocks_light: true,
        }
    }

    /// Texture coordinates of the corners of all triangles of [`Geometry::mesh`], in their order. Those of a rect and of waves are
    /// 0 to 1 along edge_u and edge_v. `None` for a mesh whose file has none, or whose material needs none.
    pub fn texture_coordinates(&self) -> Option<Cow<'_, [[DVec2; 3]]>> {
        match &self.geometry {
            Geometry::Mesh(_) | Geometry::Placed { .. } => {
                self.uvs.as_ref().map(|uvs| Cow::Borrowed(uvs.as_slice()))
            }
            Geometry::Rect(_) => Some(Cow::Owned(grid_coordinates([1, 1]))),
            Geometry::Waves(waves) => Some(Cow::Owned(grid_coordinates(waves.quads))),
        }
    }
}

/// Texture coordinates of the corners of a grid's triangles, as [`Rect::to_mesh`](super::Rect::to_mesh) and [`Waves::to_mesh`](super::Waves::to_mesh) order them.
fn grid_coordinates([columns, rows]: [u32; 2]) -> Vec<[DVec2; 3]> {
    let mut all = Vec::with_capacity(2 * columns as usize * rows as usize);
    for row in 0..rows {
        for column in 0..columns {
            let at = |right: u32, up: u32| {
                DVec2::new(
                    f64::from(column + right) / f64::from(columns),
                    f64::from(row + up) / f64::from(rows),
                )
            };
            let [a, b, c, d] = [at(0, 0), at(1, 0), at(1, 1), at(0, 1)];
            all.extend([[a, b, c], [a, c, d]]);
        }
    }
    all
}
