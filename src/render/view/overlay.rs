//! Overlays: what a frame computed with, drawn over the camera's picture from the frame's own buffers.

use crate::error::Result;
use crate::gpu::{
    BoundPipeline, Buffer, Context, Image, Recorder, Resource, Sampling, Shader, Topology,
    Vertices, shaders,
};
use crate::render::caustic::Caustic;
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::constants::{CELL_PARTS, SHOWS_DENSITY, SHOWS_TEXELS};
use crate::render::gpu_types::{CameraPush, OverlayPush};
use crate::render::patches::sample::Sample;
use crate::render::splat::quads::draw_push;
use crate::render::view::camera::View;
use crate::scene::Camera;
use std::sync::Arc;

/// Maximum number of pairs of patch and light whose kernels are outlined: kernels overlap, so that more would cover all.
const MAX_OUTLINES: u64 = 1 << 11;

/// Something that a frame computed with, to be drawn over the camera's picture.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Overlay {
    /// Outlines of the patches on the casters.
    Patches,
    /// Outlines of the splats on the planar receivers: of triangles without their blur, and of kernels where they have half of
    /// their largest value. Of many kernels, some are outlined.
    Footprints,
    /// Number of splats that each texel of the light maps gets, as colours.
    Density,
    /// Texels of the light maps, and those of coarser levels where these have splats.
    Texels,
    /// Environment cells on the sky.
    Cells,
}

impl Overlay {
    pub const ALL: [Self; 5] = [
        Self::Patches,
        Self::Footprints,
        Self::Density,
        Self::Texels,
        Self::Cells,
    ];

    /// The name in reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Patches => "patches",
            Self::Footprints => "footprints",
            Self::Density => "density",
            Self::Texels => "texels",
            Self::Cells => "cells",
        }
    }

    /// What it shows, for lists of overlays.
    pub fn about(self) -> &'static str {
        match self {
            Self::Patches => {
                "Outlines on the casters: lit patches, orange where shadows cross them, grey without light; green: patches of even size and patch clusters"
            }
            Self::Footprints => {
                "Outlines of the splats on planar receivers: triangles, and kernels in pink"
            }
            Self::Density => {
                "Splats per texel: blue 1, teal 8, green 64, orange 512, white 4096 and more"
            }
            Self::Texels => {
                "Texels of the light maps, and in other colours those of coarser levels with splats"
            }
            Self::Cells => "Environment cells, orange those that act as suns",
        }
    }
}

/// The pipelines of the overlays that are shown, bound to the buffers of a caustic.
pub struct Overlays {
    pub shown: Vec<Overlay>,
    /// Splats per texel, in the places of the light maps, for density and texels.
    pub counts: Option<Image>,
    /// For every kind of splats of the caustic, in the order of [`kinds`].
    count: Vec<BoundPipeline>,
    /// The same; `None` where there is no outline.
    outlines: Vec<Option<BoundPipeline>>,
    receivers: Option<BoundPipeline>,
    /// Patches of facets, patches of even size, and patch clusters.
    patches: [Option<BoundPipeline>; 3],
    patch_capacity: u32,
    /// Cells, and those that act as suns.
    cells: [Option<BoundPipeline>; 2],
}

/// A kind of splats: name of their buffer, and the shaders that draw them into the light maps, count and outline them.
struct Kind<'a> {
    name: &'static str,
    splats: &'a Buffer,
    vertex: &'static Shader,
    topology: Topology,
    count: &'static Shader,
    outline: Option<[&'static Shader; 2]>,
}

/// The kinds of splats of a caustic, in the order in which overlay_frame.rs draws them.
fn kinds(caustic: &Caustic) -> Vec<Kind<'_>> {
    let footprint = [
        &shaders::OVERLAY_FOOTPRINT_VERT,
        &shaders::OVERLAY_FOOTPRINT_FRAG,
    ];
    let kind = |name, splats, vertex, outline| Kind {
        name,
        splats,
        vertex,
        topology: Topology::Triangles,
        count: &shaders::OVERLAY_COUNT_FRAG,
        outline,
    };
    match caustic {
        Caustic::Gather { .. } => Vec::new(),
        Caustic::Points(points) => vec![Kind {
            topology: Topology::Points,
            ..kind("splats", &points.splats, &shaders::POINTS_VERT, None)
        }],
        Caustic::Splat {
            triangles,
            chains,
            projectors,
            ..
        } => {
            let outline = [
                &shaders::OVERLAY_TRIANGLE_VERT,
                &shaders::OVERLAY_TRIANGLE_FRAG,
            ];
            let triangles = triangles.as_ref().map(|triangles| {
                let vertex = &shaders::TRIANGLE_VERT;
                kind(
                    "triangle_splats",
                    &triangles.triangle_splats,
                    vertex,
                    Some(outline),
                )
            });
            let chains = chains.as_ref().map(|chains| {
                let outline = [
                    &shaders::OVERLAY_CHAIN_FOOTPRINT_VERT,
                    &shaders::OVERLAY_FOOTPRINT_FRAG,
                ];
                let vertex = &shaders::CHAIN_FOOTPRINT_VERT;
                Kind {
                    count: &shaders::OVERLAY_CHAIN_COUNT_FRAG,
                    ..kind("footprints", &chains.footprints, vertex, Some(outline))
                }
            });
            let projectors = projectors.iter().map(|projector| {
                let outline = (projector.splats == "footprints").then_some(footprint);
                kind(
                    projector.splats,
                    &projector.list.splats,
                    projector.vertex,
                    outline,
                )
            });
            (triangles.into_iter().chain(chains))
                .chain(projectors)
                .collect()
        }
    }
}

/// Whether the frames of a caustic have something that `overlay` shows.
pub fn has_content(overlay: Overlay, scene: &DeviceScene, caustic: &Caustic) -> bool {
    match overlay {
        Overlay::Patches => !matches!(caustic, Caustic::Points(_)),
        Overlay::Footprints => kinds(caustic).iter().any(|kind| kind.outline.is_some()),
        Overlay::Density => !kinds(caustic).is_empty(),
        Overlay::Texels => true,
        Overlay::Cells => scene.environment.pairs.is_some(),
    }
}

fn draw(
    context: &Arc<Context>,
    scene: &DeviceScene,
    shaders: [&'static Shader; 2],
    own: &[(&'static str, Resource)],
) -> Result<BoundPipeline> {
    scene.graphics(context, shaders, Topology::Overlay, own)
}

impl Overlays {
    /// The overlays `shown` of a caustic.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails or its memory is insufficient.
    pub fn new(
        context: &Arc<Context>,
        scene: &mut DeviceScene,
        caustic: &Caustic,
        shown: &[Overlay],
    ) -> Result<Self> {
        let shows = |overlay| shown.contains(&overlay);
        let kinds = kinds(caustic);
        let counts = match shows(Overlay::Density) || shows(Overlay::Texels) {
            false => None,
            true => {
                let size = scene.receivers.image_size;
                let image = Image::new(context, "splat counts", size, 1, Sampling::Nearest)?;
                scene.staging.prepare(&image);
                Some(image)
            }
        };
        let mut count = Vec::new();
        let mut receivers = None;
        if let Some(image) = &counts {
            for kind in &kinds {
                let drawing = [kind.vertex, kind.count];
                let own = [(kind.name, Resource::Buffer(kind.splats))];
                count.push(scene.graphics(context, drawing, kind.topology, &own)?);
            }
            let shaders = [
                &shaders::OVERLAY_RECEIVER_VERT,
                &shaders::OVERLAY_RECEIVER_FRAG,
            ];
            let own = [("splat_counts", Resource::Image(image))];
            receivers = Some(draw(context, scene, shaders, &own)?);
        }
        let mut outlines = Vec::new();
        if shows(Overlay::Footprints) {
            for kind in &kinds {
                let own = [(kind.name, Resource::Buffer(kind.splats))];
                outlines.push(match kind.outline {
                    Some(shaders) => Some(draw(context, scene, shaders, &own)?),
                    None => None,
                });
            }
        }
        let (mut patches, mut patch_capacity) = ([None, None, None], 0);
        if shows(Overlay::Patches) {
            let even = |patches: &Buffer| {
                let shaders = [
                    &shaders::OVERLAY_EVEN_PATCH_VERT,
                    &shaders::OVERLAY_PATCH_FRAG,
                ];
                draw(
                    context,
                    scene,
                    shaders,
                    &[("patches", Resource::Buffer(patches))],
                )
            };
            let (triangles, sample) = match caustic {
                Caustic::Splat {
                    triangles, sample, ..
                } => (triangles.as_ref(), sample.as_ref()),
                Caustic::Gather { sample, .. } => (None, Some(sample)),
                Caustic::Points(_) => (None, None),
            };
            if let Some(of) = triangles {
                let own = [
                    ("facets", &scene.facets.facets),
                    ("facet_patches", &of.facet_patches),
                    ("patch_sums", &of.patch_block_sums),
                    ("patch_numbers", &of.patch_numbers),
                    ("totals", &of.patch_totals),
                    ("patch_splats", &of.patch_splats),
                ]
                .map(|(name, buffer)| (name, Resource::Buffer(buffer)));
                let shaders = [&shaders::OVERLAY_PATCH_VERT, &shaders::OVERLAY_PATCH_FRAG];
                patches[0] = Some(draw(context, scene, shaders, &own)?);
                patch_capacity = of.patch_capacity;
            }
            if let Some(Sample { patches: of, .. }) = sample {
                patches[1] = Some(even(of)?);
            }
            if let (Caustic::Splat { .. }, Some(pairs)) = (caustic, &scene.environment.pairs) {
                patches[2] = Some(even(&pairs.patches)?);
            }
        }
        let mut cells = [None, None];
        if let (true, Some(pairs)) = (shows(Overlay::Cells), &scene.environment.pairs) {
            let shaders = [&shaders::OVERLAY_CELL_VERT, &shaders::OVERLAY_CELL_FRAG];
            let own = [("lights", Resource::Buffer(&pairs.lights))];
            cells = [
                Some(draw(context, scene, shaders, &own)?),
                Some(draw(context, scene, shaders, &[])?),
            ];
        }
        Ok(Self {
            shown: shown.to_vec(),
            counts,
            count,
            outlines,
            receivers,
            patches,
            patch_capacity,
            cells,
        })
    }

    /// Whether splats are outlined.
    pub fn has_outlines(&self) -> bool {
        self.outlines.iter().any(Option::is_some)
    }

    /// Counts the splats of a batch of a kind.
    pub fn record_count(
        &self,
        recorder: &mut Recorder,
        counts: &Image,
        kind: usize,
        vertices: Vertices,
    ) {
        let push = draw_push(counts);
        recorder.draw_vertices(&self.count[kind], counts, false, &push, vertices);
    }

    /// Draws what surfaces with light maps show.
    pub fn record_receivers(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        view: &View,
        camera: &Camera,
    ) {
        if let Some(pipeline) = &self.receivers {
            let push = self.push(scene, view, camera);
            let all = Vertices::Count(3 * scene.geometry.store.len() as u32);
            recorder.draw_over([&view.image, view.depth()], &[(pipeline, push, all)]);
        }
    }

    /// Outlines the splats of a batch of a kind, of which there are `pairs` pairs of patch and light.
    pub fn record_outlines(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        view: &View,
        camera: &Camera,
        (kind, pairs, vertices): (usize, u64, Vertices),
    ) {
        if let Some(pipeline) = &self.outlines[kind] {
            let push = OverlayPush {
                every: (pairs / MAX_OUTLINES).max(1) as u32,
                ..self.push(scene, view, camera)
            };
            recorder.draw_over([&view.image, view.depth()], &[(pipeline, push, vertices)]);
        }
    }

    /// Draws patches and cells.
    pub fn record_patches(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        view: &View,
        camera: &Camera,
    ) {
        let push = self.push(scene, view, camera);
        let pairs = scene.environment.pairs.as_ref();
        let patch_counts = [
            self.patch_capacity,
            scene.casters.patch_count,
            pairs.map_or(0, |pairs| pairs.patch_count),
        ];
        let first = scene.lights.scene_count;
        let suns = OverlayPush {
            first,
            is_sun: 1,
            ..push
        };
        let of_cells = [
            (push, pairs.map_or(0, |pairs| pairs.cell_count())),
            (suns, scene.lights.count - first),
        ];
        let patches = (self.patches.iter().zip(patch_counts))
            .map(|(pipeline, count)| (pipeline, (push, 3 * count)));
        let cells = (self.cells.iter().zip(of_cells)).map(|(pipeline, (push, count))| {
            (pipeline, (push, 6 * CELL_PARTS * CELL_PARTS * count))
        });
        let draws: Vec<_> = (cells.chain(patches))
            .filter_map(|(pipeline, (push, count))| {
                Some((pipeline.as_ref()?, push, Vertices::Count(count)))
            })
            .collect();
        if !draws.is_empty() {
            recorder.draw_over([&view.image, view.depth()], &draws);
        }
    }

    fn push(&self, scene: &DeviceScene, view: &View, camera: &Camera) -> OverlayPush {
        let CameraPush {
            eye,
            near,
            right,
            up,
            forward,
            size,
            ..
        } = view.camera_push(scene, camera);
        let bit = |overlay, bit| {
            if self.shown.contains(&overlay) {
                bit
            } else {
                0
            }
        };
        let [first_facet, facet_count] = scene.facets.facets();
        let [_, corner_count] = scene.facets.corners();
        OverlayPush {
            eye,
            near,
            right,
            facet_count,
            up,
            light_count: scene.lights.part_count,
            forward,
            corner_count,
            size,
            receiver_count: scene.receivers.planar_count,
            lobes: scene.casters.lobes,
            // Colours are those of a picture of exposure 0.
            white: (-camera.exposure_ev).exp2() as f32,
            shown: bit(Overlay::Density, SHOWS_DENSITY) | bit(Overlay::Texels, SHOWS_TEXELS),
            first: 0,
            is_sun: 0,
            every: 1,
            first_facet,
        }
    }
}
