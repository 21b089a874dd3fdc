//! direct: light that reaches diffuse surfaces without meeting a caster.

use crate::error::Result;
use crate::gpu::{BoundPipeline, Buffer, Context, Image, Recorder, Resource, Sampling, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::dispatch::GroupRect;
use crate::render::environment::direct_cells::POINT_CELLS;
use crate::render::gpu_types::constants::{
    BLOCK, DIRECT_CELL_GROUPS, DIRECT_CELLS, DIRECT_CELLS_STEP, LIGHT_RAYS_SIDE, SPLAT_GROUP,
};
use crate::render::gpu_types::{
    ClassifyPush, CopyPush, DirectEnvironmentPush, DirectPointsPush, DirectPush,
    EnvironmentPointsPush, ListedPush, OpenGroupsPush, PenumbraPush, ShadowEdgesPush,
};
use crate::render::receivers::surfaces::SurfaceTile;
use crate::render::view::work_list::{Items, WorkList};
use std::ops::Range;
use std::sync::Arc;

/// Points of meshes with light maps have rays to one of so many of the [`DIRECT_CELLS`], and their neighbours to others.
const MAPPED_CELL_STEP: u32 = 2;

pub struct Direct {
    open_groups: BoundPipeline,
    environment_rays: BoundPipeline,
    smooth_environment: BoundPipeline,
    sharp_environment: BoundPipeline,
    classify: BoundPipeline,
    list_blocks: BoundPipeline,
    direct: BoundPipeline,
    mixed_blocks: BoundPipeline,
    shadow_edges: BoundPipeline,
    /// For the first rays of texels, and for the rest.
    penumbra: [BoundPipeline; 2],
    atlas: BoundPipeline,
    environment_points: BoundPipeline,
    points: BoundPipeline,
    /// Of light, and of light of the environment.
    copy_points: [BoundPipeline; 2],
    /// Irradiance of all rects and of the meshes with light maps, W/m².
    pub map: Image,
    /// Irradiance from the environment, by the rays of each texel, and smooth; of one texel without an environment.
    pub environment: [Image; 2],
    /// Irradiance of each object, if it is a rect, from each group of environment cells without shadows, W/m².
    open_light: Buffer,
    /// Texels of the direct map of the environment that need rays of their own.
    pub sharp_texels: WorkList,
    /// Blocks that a light lights in part.
    pub blocks: WorkList,
    /// Texels of these beside an edge of a shadow, and those of them that a light reaches in part.
    pub texels: [WorkList; 2],
}

impl Direct {
    /// # Errors
    /// [`crate::Error::Device`] where the device fails.
    pub fn new(context: &Arc<Context>, scene: &mut DeviceScene) -> Result<Self> {
        let size = scene.surfaces.image_size;
        let environment_size = match scene.environment.is_present {
            true => size,
            false => [1, 1],
        };
        let mut image = |name, size| {
            let image = Image::new(context, name, size, 1, Sampling::Clamp)?;
            scene.staging.prepare(&image);
            Ok::<_, crate::Error>(image)
        };
        let map = image("direct map", size)?;
        let environment = [
            image("environment rays", environment_size)?,
            image("environment direct map", environment_size)?,
        ];
        let [rays, smooth] = [0, 1].map(|i| {
            (
                ["environment_rays", "environment_direct_map"][i],
                Resource::Image(&environment[i]),
            )
        });
        let groups = scene.scene.objects.len() as u64 * u64::from(DIRECT_CELL_GROUPS);
        let open_light = Buffer::new(context, "open groups", 16 * groups)?;
        let environment_texels: u64 = (scene.surfaces.tiles.iter())
            .filter(|tile| scene.environment.is_present && tile.is_rect())
            .map(|tile| {
                tile.environment_size()
                    .map(u64::from)
                    .iter()
                    .product::<u64>()
            })
            .sum();
        let sharp_texels = WorkList::new(context, scene, environment_texels, 8, SPLAT_GROUP)?;
        let blocks = WorkList::new(context, scene, scene.surfaces.block_count.into(), 8, 1)?;
        let lit_texels = match scene.lights.scene_count {
            0 => 0,
            _ => u64::from(scene.surfaces.block_count) * u64::from(BLOCK * BLOCK),
        };
        let list = || WorkList::new(context, scene, lit_texels, 8, SPLAT_GROUP);
        let texels = [list()?, list()?];
        let own = [
            rays,
            smooth,
            ("known_rays", Resource::Image(&environment[0])),
            ("open_groups", Resource::Buffer(&open_light)),
            ("direct_map", Resource::Image(&map)),
            ("rest_counts", Resource::Buffer(&texels[1].counts)),
            ("rest", Resource::Buffer(&texels[1].items)),
        ];
        let of_texels = texels.each_ref().map(|list| {
            [
                ("texel_counts", Resource::Buffer(&list.counts)),
                ("texels", Resource::Buffer(&list.items)),
            ]
        });
        let [texel_list, block_list] = [&sharp_texels, &blocks]
            .map(|list| [&own[..], &of_texels[0], &list.resources("items")].concat());
        let rest_list = [&own[..], &of_texels[1]].concat();
        let bind = |shader| scene.compute(context, shader, &block_list);
        // Where shaders name the light of points, these have that of the environment.
        let of_environment = [(
            "point_light",
            Resource::Buffer(&scene.surfaces.points.environment),
        )];
        let environment_list = [&of_environment[..], &block_list].concat();
        let bind_environment = |shader| scene.compute(context, shader, &environment_list);
        let bind_texels = |shader| scene.compute(context, shader, &texel_list);
        Ok(Self {
            open_groups: bind(&shaders::OPEN_GROUPS_COMP)?,
            environment_rays: bind(&shaders::ENVIRONMENT_RAYS_COMP)?,
            smooth_environment: bind_texels(&shaders::SMOOTH_ENVIRONMENT_COMP)?,
            sharp_environment: bind_texels(&shaders::SHARP_ENVIRONMENT_COMP)?,
            classify: bind(&shaders::CLASSIFY_COMP)?,
            list_blocks: bind(&shaders::LIST_BLOCKS_COMP)?,
            direct: bind(&shaders::DIRECT_COMP)?,
            mixed_blocks: bind(&shaders::MIXED_BLOCKS_COMP)?,
            shadow_edges: bind(&shaders::SHADOW_EDGES_COMP)?,
            penumbra: [
                bind(&shaders::PENUMBRA_COMP)?,
                scene.compute(context, &shaders::PENUMBRA_COMP, &rest_list)?,
            ],
            atlas: bind_environment(&shaders::DIRECT_ATLAS_COMP)?,
            environment_points: bind(&shaders::ENVIRONMENT_POINTS_COMP)?,
            points: bind(&shaders::DIRECT_POINTS_COMP)?,
            copy_points: [
                bind(&shaders::COPY_POINTS_COMP)?,
                bind_environment(&shaders::COPY_POINTS_COMP)?,
            ],
            map,
            environment,
            open_light,
            sharp_texels,
            blocks,
            texels,
        })
    }

    /// Maximum number of rays of a texel or point to suns and lamps.
    pub fn rays(scene: &DeviceScene) -> u64 {
        let of_light = u64::from(LIGHT_RAYS_SIDE * LIGHT_RAYS_SIDE) + 4;
        of_light * u64::from(scene.lights.scene_count)
    }

    /// Number of rays of a texel of the direct map of the environment, and of one that needs rays of its own.
    pub fn environment_rays() -> [u64; 2] {
        [DIRECT_CELL_GROUPS, DIRECT_CELLS / DIRECT_CELLS_STEP].map(u64::from)
    }

    /// Maximum number of rays of a point to the environment.
    pub fn point_rays() -> u64 {
        POINT_CELLS.max(DIRECT_CELLS / MAPPED_CELL_STEP).into()
    }

    /// Records the irradiance from groups of environment cells without shadows.
    pub fn record_open_groups(&self, recorder: &mut Recorder, scene: &DeviceScene) {
        let count = scene.scene.objects.len() as u32 * DIRECT_CELL_GROUPS;
        recorder.dispatch(&self.open_groups, &OpenGroupsPush { count }, [count, 1, 1]);
    }

    /// Records the rays of a part of a rectangle of a tile of the direct map of the environment.
    pub fn record_environment_rays(
        &self,
        recorder: &mut Recorder,
        tile: &SurfaceTile,
        part: u32,
        rect: GroupRect,
    ) {
        recorder.dispatch(
            &self.environment_rays,
            &direct_environment_push(tile, part, rect),
            rect.threads(),
        );
    }

    /// Records the smooth copy of the rectangle.
    pub fn record_smooth_environment(
        &self,
        recorder: &mut Recorder,
        tile: &SurfaceTile,
        rect: GroupRect,
    ) {
        recorder.dispatch(
            &self.smooth_environment,
            &direct_environment_push(tile, 0, rect),
            rect.threads(),
        );
    }

    /// Records texels of the direct map of the environment with rays of their own.
    pub fn record_sharp_environment(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        items: Items,
    ) {
        self.record_listed(
            recorder,
            &self.sharp_environment,
            &self.sharp_texels,
            scene,
            items,
        );
    }

    /// Records the classes of blocks.
    pub fn record_classify(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        blocks: Range<u32>,
    ) {
        self.record_blocks(recorder, &self.classify, scene, blocks);
    }

    /// Records the list of blocks that a light lights in part.
    pub fn record_list_blocks(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        blocks: Range<u32>,
    ) {
        self.record_blocks(recorder, &self.list_blocks, scene, blocks);
    }

    fn record_blocks(
        &self,
        recorder: &mut Recorder,
        pipeline: &BoundPipeline,
        scene: &DeviceScene,
        blocks: Range<u32>,
    ) {
        let push = ClassifyPush {
            first: blocks.start,
            block_count: blocks.end,
            light_count: scene.lights.scene_count,
        };
        recorder.dispatch(pipeline, &push, [blocks.end - blocks.start, 1, 1]);
    }

    /// Records the first rays of the listed texels, or the rest for those that a light reaches in part.
    pub fn record_penumbra(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        is_rest: bool,
        items: Items,
    ) {
        let push = |first| PenumbraPush {
            first,
            light_count: scene.lights.scene_count,
            is_rest: is_rest.into(),
        };
        let index = usize::from(is_rest);
        self.texels[index].record(recorder, &self.penumbra[index], push, (0, items));
    }

    /// Records one ray for each texel of the listed blocks.
    pub fn record_mixed_blocks(&self, recorder: &mut Recorder, scene: &DeviceScene, items: Items) {
        self.record_listed(recorder, &self.mixed_blocks, &self.blocks, scene, items);
    }

    /// Records the list of texels of these blocks that need rays, or more of them in motion.
    pub fn record_shadow_edges(&self, recorder: &mut Recorder, scene: &DeviceScene, items: Items) {
        let push = |first| ShadowEdgesPush {
            first,
            light_count: scene.lights.scene_count,
            is_in_motion: scene.surfaces.is_in_motion().into(),
        };
        (self.blocks).record(recorder, &self.shadow_edges, push, (0, items));
    }

    fn record_listed(
        &self,
        recorder: &mut Recorder,
        pipeline: &BoundPipeline,
        list: &WorkList,
        scene: &DeviceScene,
        items: Items,
    ) {
        let push = |first| ListedPush {
            first,
            light_count: scene.lights.scene_count,
        };
        list.record(recorder, pipeline, push, (0, items));
    }

    /// Records the irradiance of a rectangle of texels.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        tile: &SurfaceTile,
        rect: GroupRect,
    ) {
        let push = DirectPush {
            first: rect.first,
            surface: tile.tile.object as u32,
            receiver: tile.mesh_receiver.unwrap_or(0),
            light_count: scene.lights.scene_count,
        };
        let pipeline = match tile.is_rect() {
            true => &self.direct,
            false => &self.atlas,
        };
        recorder.dispatch(pipeline, &push, rect.threads());
    }

    /// Records the irradiance of some points from the environment, W/m². `is_mapped`: of meshes with light maps.
    pub fn record_environment_points(
        &self,
        recorder: &mut Recorder,
        is_mapped: bool,
        points: Range<u32>,
    ) {
        let (cells, cell_step) = match is_mapped {
            true => (0..DIRECT_CELLS, MAPPED_CELL_STEP),
            false => (DIRECT_CELLS..DIRECT_CELLS + POINT_CELLS, 1),
        };
        let push = EnvironmentPointsPush {
            first: points.start,
            end: points.end,
            first_cell: cells.start,
            cell_step,
            end_cell: cells.end,
        };
        let threads = [points.end - points.start, 1, 1];
        recorder.dispatch(&self.environment_points, &push, threads);
    }

    /// Records the irradiance of some points of meshes without light maps from all lights, W/m².
    pub fn record_points(&self, recorder: &mut Recorder, scene: &DeviceScene, points: Range<u32>) {
        let push = DirectPointsPush {
            first: points.start,
            end: points.end,
            light_count: scene.lights.scene_count,
        };
        recorder.dispatch(&self.points, &push, [points.end - points.start, 1, 1]);
    }

    /// Records copies of points: of all light, or of that of the environment.
    pub fn record_copies(&self, recorder: &mut Recorder, is_environment: bool, copies: Range<u32>) {
        let push = CopyPush {
            first: copies.start,
            end: copies.end,
        };
        let pipeline = &self.copy_points[usize::from(is_environment)];
        recorder.dispatch(pipeline, &push, [copies.end - copies.start, 1, 1]);
    }

    /// Bytes of the maps.
    pub fn bytes(&self) -> u64 {
        let lists = self.sharp_texels.bytes() + self.blocks.bytes();
        let texels = self.texels.iter().map(WorkList::bytes).sum::<u64>();
        let images = self.environment.iter().map(Image::bytes).sum::<u64>();
        self.map.bytes() + images + self.open_light.bytes() + lists + texels
    }
}

fn direct_environment_push(
    tile: &SurfaceTile,
    part: u32,
    rect: GroupRect,
) -> DirectEnvironmentPush {
    DirectEnvironmentPush {
        first: rect.first,
        surface: tile.tile.object as u32,
        part,
    }
}
