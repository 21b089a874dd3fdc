//! Where the direct light of diffuse surfaces is: rects have tiles of the direct map, finer than their light maps so that
//! edges of shadows are sharp; meshes with light maps have tiles with the same texels, and the light of the environment at
//! points; other meshes have all their direct light at points.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Staging};
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::DiffuseSurface;
use crate::render::gpu_types::constants::{
    ATLAS, BLOCK, DIRECT_CELLS_SIDE, GROUP_SIDE, LIGHTS_PER_WORD, NO_SURFACE, PLANE, POINTS,
};
use crate::render::receivers::light_maps::{DeviceReceivers, pack_tiles};
use crate::render::receivers::points::MeshPoints;
use crate::render::receivers::tile::Tile;
use crate::scene::{Geometry, LightKind, MaterialKind, Rect, Scene};
use std::sync::Arc;

/// Texels on the longer side of a rect's tile, at most, unless its light map has more.
const MAX_SIDE: u32 = 1024;
/// The same for a rect without a light map.
const MAX_SIDE_UNMAPPED: u32 = 512;
/// Texels of a texel of the light map along a side, where only the environment shines: its shadows are soft.
const MAX_SCALE_UNDER_ENVIRONMENT: u32 = 2;
/// Texels of all rects, unless their light maps have more.
const MAX_TEXELS: u64 = 1 << 21;
/// Texels on the longer side of a tile of the direct map of the environment.
const MAX_ENVIRONMENT_SIDE: u32 = 256;

/// A tile of the direct map.
#[derive(Clone)]
pub struct SurfaceTile {
    pub tile: Tile,
    /// Index among the mesh receivers; `None` for a rect.
    pub mesh_receiver: Option<u32>,
    /// Texels along a side of a texel of the direct map of the environment.
    pub environment_scale: u32,
    first_block: u32,
}

impl SurfaceTile {
    pub fn is_rect(&self) -> bool {
        self.mesh_receiver.is_none()
    }

    /// Blocks across and down.
    pub fn blocks(&self) -> [u32; 2] {
        self.tile.size.map(|side| side.div_ceil(BLOCK))
    }

    /// Number of its blocks in the list of all: tiles of meshes have none.
    fn block_count(&self) -> u32 {
        match self.is_rect() {
            true => self.blocks().iter().product(),
            false => 0,
        }
    }

    /// Threads of the rays of one part of the direct map of the environment: every other block of every other row of blocks. A
    /// workgroup has the upper or the lower half of [`GROUP_SIDE`] blocks.
    pub fn environment_threads(&self) -> [u32; 2] {
        let blocks = (self.environment_size()).map(|side| side.div_ceil(2 * DIRECT_CELLS_SIDE));
        [
            blocks[0].next_multiple_of(GROUP_SIDE),
            2 * blocks[1] * GROUP_SIDE,
        ]
    }

    /// The tile with fewer texels, though no fewer than its tile of the direct map of the environment.
    fn halved(&self, halvings: Halvings) -> Self {
        let most = self.environment_scale.ilog2();
        let [lights, environment] = [halvings.lights, halvings.environment].map(|of| of.min(most));
        let size = self.tile.size.map(|side| side.div_ceil(1 << lights));
        Self {
            tile: Tile { size, ..self.tile },
            environment_scale: self.environment_scale >> lights << environment,
            ..*self
        }
    }

    /// Size of the tile of the direct map of the environment, texels.
    pub fn environment_size(&self) -> [u32; 2] {
        self.tile
            .size
            .map(|side| side.div_ceil(self.environment_scale))
    }
}

/// Numbers the blocks of all tiles and returns how many there are.
fn number_blocks(tiles: &mut [SurfaceTile]) -> u32 {
    tiles.iter_mut().fold(0, |first_block, tile| {
        tile.first_block = first_block;
        first_block + tile.block_count()
    })
}

/// How often the sides of tiles are halved, for light of suns and lamps and for that of the environment.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Halvings {
    pub lights: u32,
    pub environment: u32,
}

pub struct DeviceSurfaces {
    /// As coarse as [`Self::halvings`] says, where the tiles of [`Self::finest`] begin.
    pub tiles: Vec<SurfaceTile>,
    finest: Vec<SurfaceTile>,
    pub halvings: Halvings,
    /// Size of the direct map, texels.
    pub image_size: [u32; 2],
    /// One for each object.
    pub surfaces: Buffer,
    pub blocks: Buffer,
    pub block_count: u32,
    /// The object of each block.
    pub block_surfaces: Buffer,
    /// Triangles of the diffuse objects: of rects, of meshes with light maps, of other meshes.
    pub drawn: Buffer,
    /// Number of each.
    pub drawn_counts: [u32; 3],
    /// For each triangle the number of the triangles that it joins smoothly, and those these join: they share vertices.
    pub smooth_groups: Buffer,
    pub points: MeshPoints,
}

impl DeviceSurfaces {
    /// # Errors
    /// [`crate::Error::Usage`] where the tiles do not fit into an image, [`crate::Error::Device`] if device memory is
    /// insufficient.
    pub fn new(
        context: &Arc<Context>,
        scene: &Scene,
        receivers: &DeviceReceivers,
        store: &TriangleStore,
    ) -> Result<Self> {
        let mut tiles = Vec::new();
        for (object, size) in rect_sizes(scene) {
            let environment_scale =
                (size[0].max(size[1]).div_ceil(MAX_ENVIRONMENT_SIDE)).next_power_of_two();
            tiles.push(SurfaceTile {
                tile: Tile {
                    object,
                    origin: [0, 0],
                    size,
                },
                mesh_receiver: None,
                environment_scale,
                first_block: 0,
            });
        }
        for (index, tile) in (0..).zip(receivers.mesh_tiles()) {
            tiles.push(SurfaceTile {
                tile: *tile,
                mesh_receiver: Some(index),
                environment_scale: 1,
                first_block: 0,
            });
        }
        let sizes: Vec<[u32; 2]> = tiles.iter().map(|tile| tile.tile.size).collect();
        let (origins, image_size) = pack_tiles(&sizes, context.max_image_side(), "light maps")?;
        for (tile, origin) in tiles.iter_mut().zip(origins) {
            tile.tile.origin = origin;
        }
        let block_count = number_blocks(&mut tiles);
        let lights = (scene.lights.iter())
            .filter(|light| !matches!(light.kind, LightKind::Environment { .. }))
            .count() as u64;
        let words = u64::from(block_count) * lights.div_ceil(LIGHTS_PER_WORD.into());
        let bytes = (scene.objects.len() * size_of::<DiffuseSurface>()) as u64;
        Ok(Self {
            finest: tiles.clone(),
            tiles,
            halvings: Halvings::default(),
            image_size,
            surfaces: Buffer::new(context, "surfaces", bytes)?,
            blocks: Buffer::new(context, "blocks", 4 * words)?,
            block_count,
            block_surfaces: Buffer::new(context, "block surfaces", 4 * u64::from(block_count))?,
            drawn: Buffer::new(context, "drawn triangles", 4 * store.len() as u64)?,
            drawn_counts: [0; 3],
            smooth_groups: Buffer::new(context, "smooth groups", 4 * store.len() as u64)?,
            points: MeshPoints::new(context, scene, store)?,
        })
    }

    /// Makes the tiles as coarse as this, to be written. Returns whether that changes the size of a tile or the rays of texels, and the
    /// size of a tile of the environment.
    pub fn set_halvings(&mut self, halvings: Halvings) -> (bool, bool) {
        let was_in_motion = self.is_in_motion();
        self.halvings = halvings;
        let last = std::mem::take(&mut self.tiles);
        self.tiles = (self.finest.iter())
            .map(|finest| finest.halved(halvings))
            .collect();
        self.block_count = number_blocks(&mut self.tiles);
        let changes = |size: fn(&SurfaceTile) -> [u32; 2]| {
            let sizes = self.tiles.iter().map(size);
            !sizes.eq(last.iter().map(size))
        };
        (
            changes(|tile| tile.tile.size) || self.is_in_motion() != was_in_motion,
            changes(SurfaceTile::environment_size),
        )
    }

    /// Whether the tiles are coarse, since something moves: texels have fewer rays.
    pub fn is_in_motion(&self) -> bool {
        self.halvings.lights > 0
    }

    /// Writes the surfaces with their tiles.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn write(
        &self,
        staging: &mut Staging,
        scene: &Scene,
        receivers: &DeviceReceivers,
        store: &TriangleStore,
    ) -> Result<()> {
        staging.begin();
        self.write_tiles(staging, scene, receivers, store)?;
        self.write_blocks(staging)
    }

    /// Writes the object of each block.
    fn write_blocks(&self, staging: &mut Staging) -> Result<()> {
        let of_blocks: Vec<u32> = (self.tiles.iter())
            .flat_map(|tile| {
                std::iter::repeat_n(tile.tile.object as u32, tile.block_count() as usize)
            })
            .collect();
        staging.write(&self.block_surfaces, 0, &of_blocks)
    }

    /// Writes the surfaces, and returns what it wrote.
    fn write_tiles(
        &self,
        staging: &mut Staging,
        scene: &Scene,
        receivers: &DeviceReceivers,
        store: &TriangleStore,
    ) -> Result<Vec<DiffuseSurface>> {
        let mut surfaces = vec![DiffuseSurface::default(); scene.objects.len()];
        for surface in &mut surfaces {
            surface.kind = NO_SURFACE;
        }
        for tile in &self.tiles {
            let object = tile.tile.object;
            let [[tile_x, tile_y], [width, height]] = [tile.tile.origin, tile.tile.size];
            let light_tile = receivers.tiles.iter().find(|light| light.object == object);
            let [[light_x, light_y], [light_width, light_height]] =
                light_tile.map_or([[0; 2]; 2], |light| [light.origin, light.size]);
            surfaces[object] = DiffuseSurface {
                kind: ATLAS,
                tile_x,
                tile_y,
                width,
                height,
                light_x,
                light_y,
                light_width,
                light_height,
                environment_scale: tile.environment_scale,
                first_block: tile.first_block,
                triangle: store.indices(object)[0],
                ..Default::default()
            };
            if let Geometry::Rect(rect) = &scene.objects[object].geometry {
                surfaces[object] = DiffuseSurface {
                    kind: PLANE,
                    origin: (rect.origin - store.origin).as_vec3(),
                    edge_u: rect.edge_u.as_vec3(),
                    edge_v: rect.edge_v.as_vec3(),
                    normal: rect.normal().as_vec3(),
                    ..surfaces[object]
                };
            }
        }
        for &object in self.points.unmapped_objects() {
            surfaces[object].kind = POINTS;
        }
        staging.write(&self.surfaces, 0, &surfaces)?;
        Ok(surfaces)
    }

    /// Writes the surfaces, and the points of meshes where `indices_changed` or one of these meshes is among `moved`.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn update(
        &mut self,
        staging: &mut Staging,
        scene: &Scene,
        receivers: &DeviceReceivers,
        store: &TriangleStore,
        moved: &[usize],
        indices_changed: bool,
    ) -> Result<()> {
        let surfaces = self.write_tiles(staging, scene, receivers, store)?;
        if indices_changed {
            let kinds = [PLANE, ATLAS, POINTS];
            let of_kind = kinds.map(|kind| {
                let is_of = |object: &usize| surfaces[*object].kind == kind;
                let objects = (0..surfaces.len()).filter(is_of);
                objects
                    .flat_map(|object| store.indices(object).iter().copied())
                    .collect()
            });
            self.drawn_counts = of_kind
                .each_ref()
                .map(|indices: &Vec<u32>| indices.len() as u32);
            staging.write(&self.drawn, 0, &of_kind.concat())?;
            staging.write(&self.smooth_groups, 0, &smooth_groups(scene, store))?;
            self.write_blocks(staging)?;
        }
        // A mesh that is scaled changes the extent that its points stand for, which only the light of suns and lamps depends on.
        let points_moved =
            (self.points.unmapped_objects().iter()).any(|object| moved.contains(object));
        match indices_changed || points_moved {
            true => self.points.write(staging, scene, store),
            false => Ok(()),
        }
    }

    /// Bytes of the points' light and places.
    pub fn bytes(&self) -> u64 {
        self.surfaces.bytes()
            + self.blocks.bytes()
            + self.block_surfaces.bytes()
            + self.drawn.bytes()
            + self.smooth_groups.bytes()
            + self.points.bytes()
    }
}

/// The group of each triangle: vertices that triangles share have one normal.
fn smooth_groups(scene: &Scene, store: &TriangleStore) -> Vec<u32> {
    let mut groups = vec![0; store.len()];
    let mut first = 0;
    for (index, object) in scene.objects.iter().enumerate() {
        let mesh = object.geometry.mesh();
        let mut parents: Vec<u32> = (0..mesh.positions.len() as u32).collect();
        fn root(parents: &mut [u32], mut vertex: u32) -> u32 {
            while parents[vertex as usize] != vertex {
                let parent = parents[vertex as usize];
                parents[vertex as usize] = parents[parent as usize];
                vertex = parent;
            }
            vertex
        }
        for &[a, b, c] in &mesh.triangles {
            let a = root(&mut parents, a);
            for other in [b, c] {
                let other = root(&mut parents, other);
                parents[other as usize] = a;
            }
        }
        for (corners, &place) in mesh.triangles.iter().zip(store.indices(index)) {
            groups[place as usize] = first + root(&mut parents, corners[0]);
        }
        first += mesh.positions.len() as u32;
    }
    groups
}

fn is_diffuse(scene: &Scene, object: usize) -> bool {
    let material = scene.objects[object].material;
    matches!(scene.materials[material].kind, MaterialKind::Diffuse { .. })
}

/// For every diffuse rect: object, and size of the tile. A texel of a light map has a whole number of texels of the tile.
fn rect_sizes(scene: &Scene) -> Vec<(usize, [u32; 2])> {
    let has_lights =
        (scene.lights.iter()).any(|light| !matches!(light.kind, LightKind::Environment { .. }));
    // Object, texels along a side of a texel of the light map (0: no light map), size.
    let mut found = Vec::new();
    for (index, object) in scene.objects.iter().enumerate() {
        let Geometry::Rect(rect) = &object.geometry else {
            continue;
        };
        if !is_diffuse(scene, index) {
            continue;
        }
        found.push(match object.light_map {
            Some(size) => {
                let most = match has_lights {
                    true => MAX_SIDE,
                    false => MAX_SCALE_UNDER_ENVIRONMENT * size[0].max(size[1]),
                };
                let scale = 1 << (most.min(MAX_SIDE) / size[0].max(size[1])).max(1).ilog2();
                (index, scale, size.map(|side| scale * side))
            }
            None => (index, 0, size_of_unmapped(rect, has_lights)),
        });
    }
    // The largest ones are halved until all are small enough.
    let texels = |size: [u32; 2]| u64::from(size[0]) * u64::from(size[1]);
    while found.iter().map(|&(_, _, size)| texels(size)).sum::<u64>() > MAX_TEXELS {
        let can_shrink = |&&mut (_, scale, size): &&mut (usize, u32, [u32; 2])| {
            scale > 1 || scale == 0 && size[0].min(size[1]) >= 64
        };
        let largest = (found.iter_mut())
            .filter(|tile| can_shrink(tile))
            .max_by_key(|(_, _, size)| texels(*size));
        let Some((_, scale, size)) = largest else {
            break;
        };
        *scale /= 2;
        *size = size.map(|side| side / 2);
    }
    (found.into_iter())
        .map(|(object, _, size)| (object, size))
        .collect()
}

fn size_of_unmapped(rect: &Rect, has_lights: bool) -> [u32; 2] {
    let most = match has_lights {
        true => MAX_SIDE_UNMAPPED,
        false => MAX_ENVIRONMENT_SIDE,
    };
    let sides = [rect.edge_u, rect.edge_v].map(|edge| edge.length());
    let longest = sides[0].max(sides[1]);
    sides.map(|side| ((side / longest * f64::from(most)).round() as u32).max(4))
}
