//! The receivers and their light maps, which are tiles of one image.

use crate::error::{Error, Result};
use crate::gpu::{Buffer, Context, Staging};
use crate::render::dispatch::{GroupRect, group_count};
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::{
    AtlasNode, AtlasSamples, AtlasTexel, MeshReceiver, PlanarReceiver, constants,
};
use crate::render::receivers::mesh::{MeshReceiverData, mesh_receiver_data, node_count};
use crate::render::receivers::tile::Tile;
use crate::scene::{Atlas, Scene};
use glam::DVec3;
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
    /// Contents of the buffer `planar`.
    pub planar_now: Vec<PlanarReceiver>,
}

impl DeviceReceivers {
    /// `atlases` come from [`crate::render::receivers::mesh::atlases`].
    ///
    /// # Errors
    /// [`Error::Usage`] where there is nothing to light or the light maps do not fit, [`Error::Device`] if device
    /// memory is insufficient.
    pub fn new(context: &Arc<Context>, scene: &Scene, atlases: Vec<Option<Atlas>>) -> Result<Self> {
        let (tiles, image_size) = pack(scene, context.max_image_side())?;
        let planar_count = scene.receivers().count();
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
            planar_now: Vec::new(),
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
        self.planar_now = planar(scene, &self.tiles, store.origin);
        staging.write(&self.planar, 0, &self.planar_now)?;
        if !meshes_moved || self.mesh_count() == 0 {
            return Ok(());
        }
        let MeshReceiverData {
            receivers,
            texels,
            samples,
            nodes,
        } = mesh_receiver_data(scene, self.mesh_tiles(), &self.atlases, store)?;
        staging.write(&self.mesh, 0, &receivers)?;
        staging.write(&self.atlas_texels, 0, &texels)?;
        staging.write(&self.atlas_samples, 0, &samples)?;
        staging.write(&self.atlas_nodes, 0, &nodes)
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

/// Packs the receivers' light maps in columns.
fn pack(scene: &Scene, max_side: u32) -> Result<(Vec<Tile>, [u32; 2])> {
    let mut tiles: Vec<Tile> = Vec::new();
    let (mut x, mut y, mut width, mut height) = (0, 0, 0, 0);
    let planar = scene
        .receivers()
        .map(|(object, _, size)| (object, size, padded(size)));
    let meshes = scene
        .curved_receivers()
        .map(|(object, _, size)| (object, size, size));
    for (object, size, padded) in planar.chain(meshes) {
        if padded.iter().any(|side| *side > max_side) {
            return Err(Error::Usage {
                reason: format!(
                    "a light map of {}×{} texels is too large for the device",
                    size[0], size[1]
                ),
                remedy: format!("ask for at most {} texels a side", max_side / 3 * 2 - 2),
            });
        }
        if y + padded[1] > max_side {
            (x, y) = (width, 0);
        }
        tiles.push(Tile {
            object,
            origin: [x, y],
            size,
        });
        y += padded[1];
        width = width.max(x + padded[0]);
        height = height.max(y);
    }
    if tiles.is_empty() {
        return Err(Error::Usage {
            reason: "no object of the scene has a light map".into(),
            remedy: "give a diffuse rect or mesh the key `lightmap = [256, 256]`".into(),
        });
    }
    if width > max_side {
        return Err(Error::Usage {
            reason: format!("all light maps together do not fit into {max_side}×{max_side} texels"),
            remedy: "ask for smaller light maps".into(),
        });
    }
    Ok((tiles, [width, height]))
}

fn planar(scene: &Scene, tiles: &[Tile], origin: DVec3) -> Vec<PlanarReceiver> {
    scene
        .receivers()
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
