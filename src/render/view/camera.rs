//! The camera's view. The graphics pipeline draws diffuse surfaces with the light in their maps, and finds the visible triangle
//! of every sample. Pixels that show mirrors or interfaces, or several surfaces, are listed, and computed by rays.

use crate::error::Result;
use crate::gpu::{
    BoundPipeline, Buffer, Context, Image, Recorder, Resource, Sampling, Texel, Topology, Vertices,
    shaders,
};
use crate::render::device_scene::DeviceScene;
use crate::render::dispatch::GroupRect;
use crate::render::gpu_types::constants::{ID_ONE_SAMPLE, ID_SHOWS_LIGHTS, SPLAT_GROUP};
use crate::render::gpu_types::{CameraPush, Light, ViewPush};
use crate::render::view::work_list::{Items, WorkList};
use crate::scene::Camera;
use glam::{DVec3, UVec2, Vec2, Vec3};
use std::sync::Arc;

/// Number of samples of the largest tile of a picture, per pixel of the picture.
const SAMPLES_PER_PIXEL: u32 = 4;
/// Maximum number of pixels of a tile: a dispatch may list all of them.
const MAX_TILE: u64 = 1 << 22;
/// Nothing closer to the camera is seen, as a share of the scene's size.
const NEAR: f32 = 1e-5;

pub struct View {
    visible: BoundPipeline,
    nearest: BoundPipeline,
    /// Rects, meshes with light maps, other meshes.
    surfaces: [BoundPipeline; 3],
    background: BoundPipeline,
    /// Without and with suns and lamps in the picture.
    list_pixels: [BoundPipeline; 2],
    contrast: BoundPipeline,
    shade: BoundPipeline,
    /// Linear radiance, W/m²/sr.
    pub image: Image,
    /// Depth at the pixels' centres; `None` where these are the samples.
    depth: Option<Image>,
    /// Triangles at the samples of a tile of the picture, and their depth.
    samples: [Image; 2],
    /// Luminance of the pixels of a tile that show one mirror or interface, without the detail of textures.
    pub untextured: Buffer,
    /// Pixels of a tile that show one mirror or interface, and those that show several surfaces.
    pub pixels: WorkList,
    /// Width and height of the largest tile, pixels.
    tile: [u32; 2],
    /// Square root of the number of samples per pixel.
    pub side: u32,
}

/// A tile of the picture: first pixel, and size in pixels.
pub type ViewTile = (UVec2, [u32; 2]);

impl View {
    /// A view of `size` pixels with `side`² samples each.
    ///
    /// # Errors
    /// [`crate::Error::Device`] where the device fails or its memory is insufficient.
    pub fn new(
        context: &Arc<Context>,
        scene: &mut DeviceScene,
        [light_map, direct_map]: [&Image; 2],
        size: [u32; 2],
        side: u32,
    ) -> Result<Self> {
        let image = Image::new(context, "view", size, 1, Sampling::Clamp)?;
        let tile = tile_size(size, side, context.max_image_side());
        let of_texels =
            |name, size, texel| Image::of_texels(context, name, size, 1, Sampling::Nearest, texel);
        let samples_are_centres = side == 1 && tile == size;
        let depth = (!samples_are_centres)
            .then(|| of_texels("view depth", size, Texel::Depth))
            .transpose()?;
        let sides = tile.map(|pixels| side * pixels);
        let samples = [
            of_texels("view samples", sides, Texel::Number)?,
            of_texels("view samples' depth", sides, Texel::Depth)?,
        ];
        let capacity = u64::from(tile[0]) * u64::from(tile[1]);
        let untextured = Buffer::new(context, "untextured", 4 * capacity)?;
        // A pixel of the first list may be in the second one, too.
        let pixels = WorkList::new(context, scene, 2 * capacity, 4, SPLAT_GROUP)?;
        let [counts, items] = pixels.resources("pixels");
        let own = [
            ("light_map", Resource::Image(light_map)),
            ("direct_map", Resource::Image(direct_map)),
            ("visible", Resource::Image(&samples[0])),
            ("visible_depth", Resource::Image(&samples[1])),
            ("view", Resource::Image(&image)),
            ("untextured", Resource::Buffer(&untextured)),
            counts,
            items,
        ];
        let compute = |shader| scene.compute(context, shader, &own);
        let list = |shows_lights| {
            let mut constants = scene.constants();
            constants[ID_SHOWS_LIGHTS as usize] = shows_lights;
            constants[ID_ONE_SAMPLE as usize] = side == 1;
            scene.compute_with(constants, context, &shaders::LIST_PIXELS_COMP, &own)
        };
        let draw = |shaders, topology| scene.graphics(context, shaders, topology, &own);
        let of_surfaces = |shaders| draw(shaders, Topology::Surfaces);
        let made = Self {
            visible: draw(
                [&shaders::VISIBLE_VERT, &shaders::VISIBLE_FRAG],
                Topology::Numbers,
            )?,
            nearest: draw(
                [&shaders::NEAREST_VERT, &shaders::NEAREST_FRAG],
                Topology::Depths,
            )?,
            surfaces: [
                of_surfaces([&shaders::RECT_VERT, &shaders::RECT_FRAG])?,
                of_surfaces([&shaders::MESH_VERT, &shaders::MESH_FRAG])?,
                of_surfaces([&shaders::POINT_MESH_VERT, &shaders::POINT_MESH_FRAG])?,
            ],
            background: of_surfaces([&shaders::BACKGROUND_VERT, &shaders::BACKGROUND_FRAG])?,
            list_pixels: [list(false)?, list(true)?],
            contrast: compute(&shaders::CONTRAST_COMP)?,
            shade: compute(match scene.casters.lobes {
                1 => &shaders::SHADE_MIRRORS_COMP,
                _ => &shaders::SHADE_COMP,
            })?,
            image,
            depth,
            samples,
            untextured,
            pixels,
            tile,
            side,
        };
        made.images().for_each(|image| scene.staging.prepare(image));
        Ok(made)
    }

    /// Pixels.
    pub fn size(&self) -> [u32; 2] {
        [self.image.width, self.image.height]
    }

    /// Bytes of device memory.
    pub fn bytes(&self) -> u64 {
        let of_images: u64 = self.images().map(Image::bytes).sum();
        of_images + self.untextured.bytes() + self.pixels.bytes()
    }

    fn images(&self) -> impl Iterator<Item = &Image> {
        (self.samples.iter())
            .chain([&self.image])
            .chain(&self.depth)
    }

    /// Depth at the pixels' centres.
    pub fn depth(&self) -> &Image {
        self.depth.as_ref().unwrap_or(&self.samples[1])
    }

    /// The tiles of the picture, which are rendered one after the other in the same memory.
    pub fn tiles(&self) -> impl Iterator<Item = ViewTile> + use<> {
        let ([width, height], [across, down]) = (self.size(), self.tile);
        let columns = width.div_ceil(across);
        (0..columns * height.div_ceil(down)).map(move |tile| {
            let [x, y] = [tile % columns * across, tile / columns * down];
            (
                UVec2::new(x, y),
                [across.min(width - x), down.min(height - y)],
            )
        })
    }

    /// Maximum number of rays of a pixel of list 0 or 1.
    pub fn rays(&self, scene: &DeviceScene, list: u32) -> u64 {
        // With dielectrics, a sample splits into as many rays as the stack holds, plus one.
        let splits = if scene.casters.lobes > 1 { 7 } else { 1 };
        let samples = if list == 0 { 1 } else { self.side * self.side };
        4 * splits * u64::from(samples)
    }

    /// Records diffuse surfaces and the background of a tile, as seen at the pixels' centres, after [`View::record_visible`].
    pub fn record_surfaces(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        camera: &Camera,
        (first, [width, height]): ViewTile,
    ) {
        let push = self.camera_push(scene, camera);
        let all = Vertices::Count(3 * scene.geometry.store.len() as u32);
        let counts = scene.surfaces.drawn_counts;
        let drawn = |kind: usize| {
            let first = counts[..kind].iter().sum();
            (
                &self.surfaces[kind],
                CameraPush { first, ..push },
                Vertices::Count(3 * counts[kind]),
            )
        };
        let draws = [
            (&self.nearest, push, all),
            drawn(0),
            drawn(1),
            drawn(2),
            (&self.background, push, Vertices::Count(3)),
        ];
        let [across, down] = self.size().map(|pixels| pixels as f32);
        let is_depth_known = self.depth.is_none();
        recorder.draw_with_depth(
            [&self.image, self.depth()],
            is_depth_known,
            [first.x, first.y, width, height],
            [0.0, 0.0, across, down],
            &draws[usize::from(is_depth_known)..],
        );
    }

    /// Records the visible triangles at the samples of a tile.
    pub fn record_visible(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        camera: &Camera,
        (first, size): ViewTile,
    ) {
        let push = self.camera_push(scene, camera);
        let [x, y] = (-(self.side as f32) * first.as_vec2()).to_array();
        let [across, down] = self.size().map(|pixels| (self.side * pixels) as f32);
        let [width, height] = size.map(|pixels| self.side * pixels);
        let all = Vertices::Count(3 * scene.geometry.store.len() as u32);
        recorder.draw_with_depth(
            self.samples.each_ref(),
            false,
            [0, 0, width, height],
            [x, y, across, down],
            &[(&self.visible, push, all)],
        );
    }

    /// Records the lists of pixels of a rectangle of a tile.
    pub fn record_list(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        camera: &Camera,
        tile: ViewTile,
        rect: GroupRect,
    ) {
        let push = ViewPush {
            first: tile.0 + rect.first,
            ..self.view_push(scene, camera, tile)
        };
        let shows_lights = self.may_show_lights(scene, camera);
        let pipeline = &self.list_pixels[usize::from(shows_lights)];
        recorder.dispatch(pipeline, &push, rect.threads());
    }

    /// Records the radiance of pixels of list 0 or 1.
    pub fn record_shade(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        camera: &Camera,
        tile: ViewTile,
        of_list: (u32, Items),
    ) {
        self.record_listed(recorder, &self.shade, scene, camera, tile, of_list);
    }

    fn record_listed(
        &self,
        recorder: &mut Recorder,
        pipeline: &BoundPipeline,
        scene: &DeviceScene,
        camera: &Camera,
        tile: ViewTile,
        (list, items): (u32, Items),
    ) {
        let push = self.view_push(scene, camera, tile);
        let push = |first| ViewPush {
            first: UVec2::new(first, list),
            ..push
        };
        (self.pixels).record(recorder, pipeline, push, (list, items));
    }

    /// Records the comparison of listed pixels with their neighbours.
    pub fn record_contrast(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        camera: &Camera,
        tile: ViewTile,
        items: Items,
    ) {
        self.record_listed(recorder, &self.contrast, scene, camera, tile, (0, items));
    }

    pub fn camera_push(&self, scene: &DeviceScene, camera: &Camera) -> CameraPush {
        let ViewPush {
            eye,
            light_count,
            right,
            rotation,
            up,
            forward,
            size,
            ..
        } = self.view_push(scene, camera, Default::default());
        CameraPush {
            eye,
            near: NEAR * (scene.bodies.size() as f32).max(f32::MIN_POSITIVE),
            right,
            first: 0,
            up,
            light_count,
            forward,
            rotation,
            size,
            tile: Vec2::ZERO,
        }
    }

    fn view_push(&self, scene: &DeviceScene, camera: &Camera, (tile, size): ViewTile) -> ViewPush {
        let forward = (camera.target - camera.position).normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let up = right.cross(forward);
        let half_height = (0.5 * camera.fov).tan();
        let [width, height] = self.size();
        let aspect = f64::from(width) / f64::from(height);
        ViewPush {
            eye: (camera.position - scene.geometry.store.origin).as_vec3(),
            light_count: scene.lights.scene_count,
            right: (half_height * aspect * right).as_vec3(),
            rotation: scene.environment.rotation,
            up: (half_height * up).as_vec3(),
            side: self.side,
            forward: forward.as_vec3(),
            capacity: 2 * self.tile[0] * self.tile[1],
            size: UVec2::new(width, height).as_vec2(),
            tile,
            first: tile,
            end: tile + UVec2::from(size),
        }
    }

    /// Whether a sun or lamp may be in the picture: whether the cone around it meets the cone around the picture.
    fn may_show_lights(&self, scene: &DeviceScene, camera: &Camera) -> bool {
        let ViewPush {
            eye,
            right,
            up,
            forward,
            ..
        } = self.view_push(scene, camera, Default::default());
        let half_diagonal = (right + up).length().atan();
        (scene.lights.scene.iter()).any(|light: &Light| {
            let (direction, radius) = match light.is_lamp {
                0 => (light.place, light.size),
                _ => {
                    let toward: Vec3 = light.place - eye;
                    let sine = light.size / toward.length().max(light.size);
                    (toward.normalize_or_zero(), sine.asin())
                }
            };
            forward.dot(direction).clamp(-1.0, 1.0).acos() < 1.01 * (half_diagonal + radius) + 1e-3
        })
    }
}

/// Width and height of the largest tile of a picture, pixels. It has at most [`SAMPLES_PER_PIXEL`] samples for each pixel of the
/// picture, its samples fit into an image, and its pixels fit into the list.
fn tile_size([width, height]: [u32; 2], side: u32, max_side: u32) -> [u32; 2] {
    let most = max_side / side;
    let across = width.min(most);
    let samples = u64::from(width) * u64::from(height) * u64::from(SAMPLES_PER_PIXEL);
    let of_row = u64::from(across) * u64::from(side) * u64::from(side);
    let rows = (samples / of_row).min((MAX_TILE / u64::from(across)).max(1));
    let down = height.min(most).min(rows.max(1) as u32);
    // Workgroups have eight rows.
    match down > 8 && down < height {
        true => [across, down / 8 * 8],
        false => [across, down],
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_have_bounded_memory() {
        assert_eq!(tile_size([1280, 720], 1, 16_384), [1280, 720]);
        assert_eq!(tile_size([1280, 720], 2, 16_384), [1280, 720]);
        // 16 samples a pixel: a quarter of the picture, 180 rows, in whole workgroups.
        assert_eq!(tile_size([1280, 720], 4, 16_384), [1280, 176]);
        assert_eq!(tile_size([16_384, 3], 2, 16_384), [8192, 3]);
        // 256 samples a pixel: 1024 pixels across an image, and rows of these.
        assert_eq!(tile_size([4096, 4096], 16, 16_384), [1024, 256]);
        assert_eq!(tile_size([1, 1], 16, 16_384), [1, 1]);
    }
}
