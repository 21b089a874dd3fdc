//! The receivers and their light maps, which are tiles of one image.

use crate::error::{Error, Result};
use crate::gpu::{Buffer, Context, Staging};
use crate::render::dispatch::{GroupRect, group_count};
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::{
    AtlasNode, AtlasSamples, AtlasTexel, MeshReceiver, PlanarReceiver, constants,
};
use crate::render::receivers::mesh::{mesh_receiver_data, node_count};
use crate::render::receivers::tile::Tile;
use crate::scene::{Atlas, Scene};
use glam::DVec3;
use guillotiere::SimpleAtlasAllocator;
use std::cmp::Reverse;
use std::sync::Arc;

pub struct DeviceReceivers {
    /// Tiles of the planar receivers, then of the mesh receivers.
    pub tiles: Vec<Tile>,
    pub planar_count: u32,
    /// Size of the light-map image, texels.
    pub image_size: [u32; 2],
    /// Atlases of the mesh receivers, indexed by object.
    pub atlases: Vec<Option<Atlas>>,
    pub planar: Buffer,
    pub mesh: Buffer,
    pub atlas_texels: Buffer,
    pub atlas_samples: Buffer,
    pub atlas_nodes: Buffer,
}

impl DeviceReceivers {
    /// `atlases` come from [`crate::render::receivers::mesh::atlases`].
    ///
    /// # Errors
    /// [`Error::Usage`] where there is nothing to light or the light maps do not fit, [`Error::Device`] if device
    /// memory is insufficient.
    pub fn new(context: &Arc<Context>, scene: &Scene, atlases: Vec<Option<Atlas>>) -> Result<Self> {
        let (tiles, image_size) = pack(scene, context.max_image_side())?;
        let planar_count = scene.planar_receivers().count();
        let meshes = &tiles[planar_count..];
        let texels: u64 = (meshes.iter()).map(|tile| texel_count(tile.size)).sum();
        let nodes: u64 = meshes.iter().map(|tile| node_count(tile.size)).sum();
        let buffer =
            |name, count: u64, element: usize| Buffer::new(context, name, count * element as u64);
        Ok(Self {
            planar: buffer(
                "planar receivers",
                planar_count as u64,
                size_of::<PlanarReceiver>(),
            )?,
            mesh: buffer(
                "mesh receivers",
                meshes.len() as u64,
                size_of::<MeshReceiver>(),
            )?,
            atlas_texels: buffer("atlas texels", texels, size_of::<AtlasTexel>())?,
            atlas_samples: buffer("atlas samples", texels, size_of::<AtlasSamples>())?,
            atlas_nodes: buffer("atlas nodes", nodes, size_of::<AtlasNode>())?,
            tiles,
            planar_count: planar_count as u32,
            image_size,
            atlases,
        })
    }

    /// Writes the planar receivers, and the mesh receivers where `meshes_moved`.
    ///
    /// # Errors
    /// [`Error::Usage`] where the light maps of meshes have too many texels, [`Error::Device`] where the device fails.
    pub fn update(
        &mut self,
        staging: &mut Staging,
        scene: &Scene,
        store: &TriangleStore,
        meshes_moved: bool,
    ) -> Result<()> {
        staging.write(&self.planar, 0, &planar(scene, &self.tiles, store.origin))?;
        if !meshes_moved || self.mesh_count() == 0 {
            return Ok(());
        }
        let data = mesh_receiver_data(scene, self.mesh_tiles(), &self.atlases, store)?;
        staging.write(&self.mesh, 0, &data.receivers)?;
        staging.write(&self.atlas_texels, 0, &data.texels)?;
        staging.write(&self.atlas_samples, 0, &data.samples)?;
        staging.write(&self.atlas_nodes, 0, &data.nodes)
    }

    pub fn mesh_count(&self) -> u32 {
        self.tiles.len() as u32 - self.planar_count
    }

    pub fn mesh_tiles(&self) -> &[Tile] {
        &self.tiles[self.planar_count as usize..]
    }

    /// The receiver of a tile: the index among the receivers of its kind, and whether it is a mesh.
    pub fn of_tile(&self, tile: usize) -> (u32, bool) {
        match tile.checked_sub(self.planar_count as usize) {
            Some(mesh) => (mesh as u32, true),
            None => (tile as u32, false),
        }
    }

    /// The same for an object, if it is a receiver.
    pub fn of_object(&self, object: usize) -> Option<(u32, bool)> {
        let tile = self.tiles.iter().position(|tile| tile.object == object)?;
        Some(self.of_tile(tile))
    }

    /// Size that contains every light map, texels.
    pub fn largest_light_map(&self) -> [u32; 2] {
        [0, 1].map(|axis| (self.tiles.iter().map(|tile| tile.size[axis]).max()).unwrap_or(1))
    }

    /// Number of texels of the largest light map.
    pub fn max_texels(&self) -> u64 {
        (self.tiles.iter().map(|tile| texel_count(tile.size)).max()).unwrap_or(1)
    }

    /// Number of workgroups that cover all receivers' light maps.
    pub fn group_count(&self) -> u64 {
        self.tiles.iter().map(|tile| group_count(tile.size)).sum()
    }

    /// The tile that contains workgroup `first` of all receivers, and the rectangle of the tile that starts there and
    /// has at most `max_groups` workgroups.
    pub fn group_rect(&self, mut first: u64, max_groups: u64) -> (usize, GroupRect) {
        for (index, tile) in self.tiles.iter().enumerate() {
            let count = group_count(tile.size);
            if first < count {
                return (index, GroupRect::of(tile.size, first, max_groups));
            }
            first -= count;
        }
        panic!("workgroup {first} after the last tile");
    }
}

fn texel_count([width, height]: [u32; 2]) -> u64 {
    u64::from(width) * u64::from(height)
}

/// The coarsest level of any light map.
pub const MAX_LEVEL: u32 = constants::MAX_LEVEL as u32;

/// The coarsest level of a light map of this size; same function as in planar_receiver.glsl.
fn coarsest_level(size: [u32; 2]) -> u32 {
    (size[0].min(size[1]) / constants::MIN_COARSE_SIDE)
        .max(1)
        .ilog2()
        .min(MAX_LEVEL)
}

/// Size of a light map with the coarser levels beside it, one below the other. Together they are no higher than the
/// light map.
fn padded(size: [u32; 2]) -> [u32; 2] {
    match coarsest_level(size) {
        0 => size,
        _ => [size[0] + size[0].div_ceil(2) + 2, size[1]],
    }
}

/// Packs the receivers' light maps into one image of at most `max_side` texels a side. Planar receivers come first.
fn pack(scene: &Scene, max_side: u32) -> Result<(Vec<Tile>, [u32; 2])> {
    let planar = scene
        .planar_receivers()
        .map(|(object, _, size)| (object, size, padded(size)));
    let meshes = scene
        .mesh_receivers()
        .map(|(object, _, size)| (object, size, size));
    let maps: Vec<(usize, [u32; 2], [u32; 2])> = planar.chain(meshes).collect();
    if maps.is_empty() {
        return Err(Error::Usage {
            reason: "no object of the scene has a light map".into(),
            remedy: "give a diffuse rect or mesh the key `lightmap = [256, 256]`".into(),
        });
    }
    if let Some((_, [width, height], _)) =
        (maps.iter()).find(|(_, _, padded)| padded.iter().any(|&side| side > max_side))
    {
        return Err(Error::Usage {
            reason: format!("a light map of {width}×{height} texels is too large for the device"),
            remedy: format!("ask for at most {} texels a side", max_side / 3 * 2 - 2),
        });
    }
    let sizes: Vec<[u32; 2]> = maps.iter().map(|&(_, _, padded)| padded).collect();
    let (origins, end) = pack_tiles(&sizes, max_side, "light maps")?;
    let tiles = (maps.iter().zip(&origins))
        .map(|(&(object, size, _), &origin)| Tile {
            object,
            origin,
            size,
        })
        .collect();
    Ok((tiles, end))
}

/// Origins of tiles of these sizes in one image of at most `max_side` texels a side, and the size of the image.
/// `what` names the tiles.
///
/// # Errors
/// [`Error::Usage`] where they do not fit.
pub fn pack_tiles(
    sizes: &[[u32; 2]],
    max_side: u32,
    what: &str,
) -> Result<(Vec<[u32; 2]>, [u32; 2])> {
    let area: u64 = sizes.iter().map(|&size| texel_count(size)).sum();
    let widest = sizes.iter().flatten().copied().max().unwrap_or(1);
    let mut side = widest.max(area.isqrt().min(max_side.into()) as u32);
    let origins = loop {
        match packed(sizes, side) {
            Some(origins) => break origins,
            None if side == max_side => {
                return Err(Error::Usage {
                    reason: format!(
                        "all {what} together do not fit into {max_side}×{max_side} texels"
                    ),
                    remedy: format!("ask for smaller {what}"),
                });
            }
            None => side = (side + side.div_ceil(8)).min(max_side),
        }
    };
    let end = |axis: usize| {
        let ends = (origins.iter().zip(sizes)).map(|(origin, size)| origin[axis] + size[axis]);
        ends.max().unwrap_or(1)
    };
    let size = [end(0), end(1)];
    Ok((origins, size))
}

/// Origins of rectangles of these sizes, none of which overlap, in a square, if they fit. The tallest one is placed
/// first.
fn packed(sizes: &[[u32; 2]], side: u32) -> Option<Vec<[u32; 2]>> {
    let signed = |[width, height]: [u32; 2]| guillotiere::size2(width as i32, height as i32);
    let mut square = SimpleAtlasAllocator::new(signed([side; 2]));
    let mut order: Vec<usize> = (0..sizes.len()).collect();
    order.sort_by_key(|&index| Reverse(sizes[index][1]));
    let mut origins = vec![[0; 2]; sizes.len()];
    for index in order {
        let place = square.allocate(signed(sizes[index]))?;
        origins[index] = [place.min.x as u32, place.min.y as u32];
    }
    Some(origins)
}

fn planar(scene: &Scene, tiles: &[Tile], origin: DVec3) -> Vec<PlanarReceiver> {
    scene
        .planar_receivers()
        .zip(tiles)
        .map(|((_, rect, _), tile)| PlanarReceiver {
            origin: (rect.origin - origin).as_vec3(),
            tile_x: tile.origin[0],
            edge_u: rect.edge_u.as_vec3(),
            tile_y: tile.origin[1],
            edge_v: rect.edge_v.as_vec3(),
            width: tile.size[0],
            normal: rect.normal().as_vec3(),
            height: tile.size[1],
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Light maps of mixed sizes do not overlap, lie in the square, and fill most of it.
    #[test]
    fn rectangles_are_packed() {
        let sizes: Vec<[u32; 2]> = (0..60_u32)
            .map(|i| [17 + i * i * 37 % 400, 9 + i * 91 % 250])
            .collect();
        let area: u64 = sizes.iter().map(|&size| texel_count(size)).sum();
        assert!(packed(&sizes, area.isqrt() as u32 - 1).is_none());
        let side = (1.2 * (area as f64).sqrt()) as u32;
        let origins = packed(&sizes, side).unwrap();
        let mut seen = vec![false; (side * side) as usize];
        for ([x, y], [width, height]) in origins.into_iter().zip(sizes) {
            for row in y..y + height {
                for texel in &mut seen[(row * side + x) as usize..][..width as usize] {
                    assert!(!std::mem::replace(texel, true));
                }
            }
            assert!(x + width <= side && y + height <= side);
        }
    }
}
