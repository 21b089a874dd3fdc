//! upload: the scene as buffers and images on the device.
//!
//! The origin moves to the middle of the scene, so that f32 resolves it wherever it lies, and
//! the triangles go into the order of the leaves of a bounding volume hierarchy. What may change
//! from frame to frame is in `update.rs`.

use crate::error::{Error, Result};
use crate::gpu::{
    Buffer, Context, Image, Pipeline, Recorder, Resource, Sampling, Shader, Staging, Write,
};
use crate::render::Settings;
use crate::render::dispatch::{Part, group_count};
use crate::render::environment::cells::disc_axes;
use crate::render::environment::pairs::{self, Class, Pairs};
use crate::render::geometry::triangle_store::Soup;
use crate::render::gpu_types::{self, CONDUCTOR, DIELECTRIC, DIFFUSE, MIRROR, NO_RECEIVER};
use crate::render::lights::is_narrow;
use crate::render::patches::tessellation::Specular;
use crate::render::receivers::mesh::{Surfaces, atlases, surfaces};
use crate::scene::{Atlas, EnvironmentMap, LightKind, MaterialKind, Mesh, Object, Scene};
use glam::{DVec3, UVec2};
use std::borrow::Cow;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// Pairs of faces and vertices worth comparing to find out that nothing can block light.
const MOST_PAIRS: usize = 200_000_000;

/// A receiver's part of the light-map atlas.
#[derive(Debug, Clone, Copy)]
pub struct Tile {
    /// Index into [`Scene::objects`].
    pub object: usize,
    pub origin: [u32; 2],
    pub size: [u32; 2],
    /// One of its triangles; of a rect, either.
    pub triangle: u32,
}

/// The scene on the device.
pub struct DeviceScene {
    pub triangles: Buffer,
    pub normals: Buffer,
    pub nodes: Buffer,
    pub objects: Buffer,
    pub suns: Buffer,
    pub receivers: Buffer,
    pub curved: Buffer,
    pub atlas_texels: Buffer,
    pub atlas_samples: Buffer,
    pub atlas_nodes: Buffer,
    pub reflectors: Buffer,
    pub environment: Image,
    pub sun_count: u32,
    /// Of those whose light the mirrors throw patch by patch, the suns and what is like one in the
    /// environment: whether their footprints on rects are triangles. All of them for `beams`.
    pub triangles_of: Vec<bool>,
    pub has_environment: bool,
    /// Of the environment, rad, 0 to 2π.
    pub rotation: f32,
    pub reflector_count: u32,
    /// m²
    pub reflector_area: f32,
    /// Ways that light takes at a patch: 2 where some is refracted, otherwise 1.
    pub lobes: u32,
    pub patch_count: u32,
    /// Patches that the stages' buffers hold.
    pub patch_room: u32,
    /// Those of rects, then those of meshes.
    pub tiles: Vec<Tile>,
    /// Receivers that are rects.
    pub flat_count: u32,
    /// Size of the light-map atlas, texels.
    pub atlas: [u32; 2],
    /// Of the environment's cells and merged patches, for footprints.
    pub pairs: Option<Pairs>,
    /// Whether anything can block the light on its way by the mirrors to the receivers.
    pub trace: bool,
    /// What is on the device; see `update.rs`.
    pub scene: Scene,
    pub soup: Soup,
    /// Layouts of the curved receivers, by object.
    pub atlases: Vec<Option<Atlas>>,
    pub specular: Specular,
    pub staging: Staging,
    /// Whether the last update failed half-way.
    pub stale: bool,
}

impl DeviceScene {
    /// Uploads `scene`.
    ///
    /// [`Error::Usage`] where there is nothing to light, the light maps do not fit, or there is no memory for a sky's images,
    /// [`Error::Usage`] where there is nothing to light or the light maps do not fit,
    /// [`Error::Device`] where the device's memory does not suffice.
    pub fn new(context: &Arc<Context>, scene: &Scene, settings: &Settings) -> Result<Self> {
        let meshes: Vec<Cow<Mesh>> = (scene.objects.iter())
            .map(|object| object.geometry.mesh())
            .collect();
        let atlases = atlases(scene)?;
        let soup = Soup::new(scene, &meshes, &atlases, context.max_storage_bytes())?;
        let (tiles, atlas) = pack_tiles(scene, &soup, context.max_image_side())?;
        let receivers = receivers(scene, &tiles, soup.origin);
        let flat_count = scene.receivers().count();
        let Surfaces {
            curved,
            texels,
            samples,
            nodes,
        } = surfaces(scene, &tiles[flat_count..], &atlases, &soup)?;
        let objects = objects(scene, &tiles);
        let Lights {
            mut suns,
            environment,
        } = lights(scene, soup.origin)?;
        let sun_count = suns.len() as u32;
        let trace = can_block(scene, &meshes, MOST_PAIRS);
        let pairs = (environment.as_ref())
            .filter(|_| settings.method == crate::render::Method::Footprint)
            .filter(|_| {
                scene
                    .objects
                    .iter()
                    .any(|object| object.light_map.is_some())
            })
            .filter(|_| scene.specular_objects().next().is_some())
            .map(|sky| Pairs::new(context, scene, &soup, sky, &suns, trace, settings))
            .transpose()?;
        if let (Some(pairs), Some(sky)) = (&pairs, &environment) {
            suns.extend(pairs.suns_of(sky));
        }
        let triangles_of: Vec<bool> = (suns.iter())
            .map(|light| match settings.method {
                crate::render::Method::Footprint => is_narrow(scene, &soup, &receivers, light),
                crate::render::Method::Beams => true,
                crate::render::Method::Pinhole | crate::render::Method::Points => false,
            })
            .collect();

        let all_lit = environment.is_some() && settings.method == crate::render::Method::Pinhole;
        let specular = Specular::new(scene, &soup, &suns, all_lit, settings.samples);
        let lit = specular.lit(&soup, &suns)?;
        let refracts = (scene.objects.iter()).any(|object| {
            matches!(
                scene.materials[object.material].kind,
                MaterialKind::Dielectric { .. }
            )
        });
        let levels = match &environment {
            Some(sky) => mip_chain(sky.map, sky.scale),
            None => vec![(1, 1, vec![[0.0; 3]])],
        };
        let atlas_nodes = Buffer::with_data(context, "atlas nodes", &nodes)?;
        let nodes = Buffer::new(context, "nodes", soup.most_node_bytes())?;
        let room = specular.count() * size_of::<gpu_types::Reflector>();
        let device_reflectors = Buffer::new(context, "reflectors", room as u64)?;
        let room = (sun_count as usize + pairs::MOST_SUNS) * size_of::<gpu_types::Light>();
        let device_suns = Buffer::new(context, "suns", room as u64)?;
        let mut staging = Staging::new(context)?;
        staging.write(
            &mut Recorder::new(context)?,
            &[
                Write::new(&nodes, 0, &soup.nodes()),
                Write::new(&device_reflectors, 0, &lit.reflectors),
                Write::new(&device_suns, 0, &suns),
            ],
        )?;
        Ok(Self {
            triangles: Buffer::with_data(context, "triangles", &soup.triangles)?,
            normals: Buffer::with_data(context, "normals", &soup.normals)?,
            nodes,
            objects: Buffer::with_data(context, "objects", &objects)?,
            suns: device_suns,
            receivers: Buffer::with_data(context, "receivers", &receivers)?,
            curved: Buffer::with_data(context, "curved receivers", &curved)?,
            atlas_texels: Buffer::with_data(context, "atlas texels", &texels)?,
            atlas_samples: Buffer::with_data(context, "atlas samples", &samples)?,
            atlas_nodes,
            reflectors: device_reflectors,
            environment: Image::with_levels(
                context,
                "environment",
                &levels,
                Sampling::Equirectangular,
            )?,
            sun_count,
            triangles_of,
            has_environment: environment.is_some(),
            rotation: environment.map_or(0.0, |sky| sky.rotation),
            reflector_count: lit.reflectors.len() as u32,
            reflector_area: lit.area as f32,
            lobes: if refracts { 2 } else { 1 },
            patch_count: lit.patch_count,
            patch_room: lit.patch_count,
            tiles,
            flat_count: flat_count as u32,
            atlas,
            pairs,
            trace,
            scene: scene.clone(),
            soup,
            atlases,
            specular,
            staging,
            stale: false,
        })
    }

    /// A compute pipeline with those of the scene's buffers and images that `shader` names, and
    /// the stage's `own`.
    ///
    /// # Errors
    /// [`Error::Device`] where the driver refuses.
    ///
    /// # Panics
    /// Where `shader` does not name one of `own`: a programmer's mistake.
    pub fn compute(
        &self,
        context: &Arc<Context>,
        shader: &'static Shader,
        own: &[(&'static str, Resource)],
    ) -> Result<Pipeline> {
        for (name, _) in own {
            let named = shader.bindings.iter().any(|binding| binding.name == *name);
            assert!(named, "{} has no {name}", shader.name);
        }
        let shared = [
            ("triangles", Resource::Buffer(&self.triangles)),
            ("normals", Resource::Buffer(&self.normals)),
            ("nodes", Resource::Buffer(&self.nodes)),
            ("objects", Resource::Buffer(&self.objects)),
            ("suns", Resource::Buffer(&self.suns)),
            ("receivers", Resource::Buffer(&self.receivers)),
            ("curved", Resource::Buffer(&self.curved)),
            ("atlas_texels", Resource::Buffer(&self.atlas_texels)),
            ("atlas_samples", Resource::Buffer(&self.atlas_samples)),
            ("atlas_nodes", Resource::Buffer(&self.atlas_nodes)),
            ("reflectors", Resource::Buffer(&self.reflectors)),
            ("environment", Resource::Image(&self.environment)),
        ];
        let only_mirrors = self.lobes == 1;
        Pipeline::compute(context, shader, only_mirrors, &[own, &shared].concat())
    }

    /// Lights whose patches' light is thrown as triangles, or not so, with their patches.
    pub fn lights(&self, as_triangles: bool) -> Vec<Class> {
        let mut first_light = 0;
        (self.triangles_of.chunk_by(|a, b| a == b))
            .map(|run| {
                let class = Class {
                    first_light,
                    light_count: run.len() as u32,
                    ..self.all_lights()
                };
                first_light += class.light_count;
                (run[0], class)
            })
            .filter(|(triangles, _)| *triangles == as_triangles)
            .map(|(_, class)| class)
            .collect()
    }

    /// With their patches.
    pub fn all_lights(&self) -> Class {
        Class {
            first_light: 0,
            light_count: self.light_count(),
            patch_count: self.patch_count,
        }
    }

    /// Suns, lamps, and what is like a sun in the environment.
    pub fn light_count(&self) -> u32 {
        self.triangles_of.len() as u32
    }

    /// The list of pairs of cell and merged patch, as long as one light would have patches.
    pub fn sky_pairs(&self) -> Option<Class> {
        self.pairs.as_ref().map(|pairs| Class {
            first_light: 0,
            light_count: 1,
            patch_count: pairs.pair_count,
        })
    }

    /// Pairs of patch and light there may be: of suns and lamps, or of the environment's cells.
    pub fn pair_room(&self) -> u32 {
        let of_environment = self.pairs.as_ref().map_or(0, |pairs| pairs.pair_count);
        of_environment.max(self.patch_room * self.light_count())
    }

    /// Receivers that are rects, counted once for every way that light takes to them.
    pub fn flat_targets(&self) -> u32 {
        self.lobes * self.flat_count
    }

    /// Receivers that are meshes.
    pub fn curved_count(&self) -> u32 {
        self.tiles.len() as u32 - self.flat_count
    }

    pub fn curved_tiles(&self) -> &[Tile] {
        &self.tiles[self.flat_count as usize..]
    }

    /// See [`receiver_of`].
    pub fn receiver_of(&self, tile: usize) -> (u32, bool) {
        receiver_of(tile, self.flat_count as usize)
    }

    /// Suns and lamps as they are now.
    pub fn lights_now(&self) -> Vec<gpu_types::Light> {
        lights(&self.scene, self.soup.origin).map_or(Vec::new(), |lights| lights.suns)
    }

    /// Says so where there are much more or fewer patches than asked for, and why.
    pub fn patch_note(&self, method: crate::render::Method, samples: u32) -> Option<String> {
        const CLOSE: f64 = 1.5;
        let (made, asked) = (f64::from(self.patch_count), f64::from(samples));
        let triangles = self.reflector_count;
        if method == crate::render::Method::Points
            || triangles == 0
            || (asked / CLOSE..=asked * CLOSE).contains(&made)
        {
            return None;
        }
        let patches = self.patch_count;
        let reason = match patches == triangles {
            true => "there is one for every triangle that faces a light, and never less".into(),
            false => format!(
                "each of the {triangles} triangles that face a light is divided into n² patches, n a whole number"
            ),
        };
        Some(format!(
            "{patches} patches are made, not {samples}: {reason}"
        ))
    }

    /// Sides that all light maps fit into, texels.
    pub fn largest_light_map(&self) -> [u32; 2] {
        [0, 1].map(|axis| {
            self.tiles
                .iter()
                .map(|tile| tile.size[axis])
                .max()
                .unwrap_or(1)
        })
    }

    /// Workgroups that cover all receivers' light maps.
    pub fn receiver_groups(&self) -> u64 {
        self.tiles.iter().map(|tile| group_count(tile.size)).sum()
    }

    /// The tile, and of it the part that begins with workgroup number `first` of all receivers' and has at most
    /// `most`.
    pub fn receiver_part(&self, mut first: u64, most: u64) -> (usize, Part) {
        for (index, tile) in self.tiles.iter().enumerate() {
            let count = group_count(tile.size);
            if first < count {
                return (index, Part::of(tile.size, first, most));
            }
            first -= count;
        }
        panic!("workgroup {first} after the last tile");
    }

    /// Pairs of patch and light of a first submission, on a device of which nothing is known: each may light
    /// all of a light map.
    pub fn first_pairs(&self) -> u64 {
        const FRAGMENTS: u64 = 1 << 22; // 20 ms on two CPU cores
        let texels = |tile: &Tile| u64::from(tile.size[0]) * u64::from(tile.size[1]);
        let largest = self.tiles.iter().map(texels).max().unwrap_or(1);
        (FRAGMENTS / largest).clamp(1, 4096)
    }
}

/// The coarsest level of any light map; as in receiver.glsl.
pub const COARSEST: u32 = 5;

/// The coarsest level of a light map that footprints are splatted into; as in receiver.glsl.
fn coarsest_level(size: [u32; 2]) -> u32 {
    const FEWEST: u32 = 16;
    (size[0].min(size[1]) / FEWEST).max(1).ilog2().min(COARSEST)
}

/// Texels of a light map together with the coarser levels beside it, one below the other. They
/// are together no higher than itself.
fn padded(size: [u32; 2]) -> [u32; 2] {
    match coarsest_level(size) {
        0 => size,
        _ => [size[0] + size[0].div_ceil(2) + 2, size[1]],
    }
}

/// Places the receivers' light maps in columns.
fn pack_tiles(scene: &Scene, soup: &Soup, max_side: u32) -> Result<(Vec<Tile>, [u32; 2])> {
    let mut tiles: Vec<Tile> = Vec::new();
    let (mut x, mut y, mut width, mut height) = (0, 0, 0, 0);
    let flat = scene
        .receivers()
        .map(|(object, _, size)| (object, size, padded(size)));
    let curved = scene
        .curved_receivers()
        .map(|(object, _, size)| (object, size, size));
    for (object, size, padded) in flat.chain(curved) {
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
            triangle: soup.places(object)[0],
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

pub fn receivers(scene: &Scene, tiles: &[Tile], origin: DVec3) -> Vec<gpu_types::Receiver> {
    scene
        .receivers()
        .zip(tiles)
        .map(|((_, rect, _), tile)| gpu_types::Receiver {
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

/// The receiver of tile number `tile` where the first `flat_count` are those of rects: its index among those
/// of its kind, and whether it is a mesh.
fn receiver_of(tile: usize, flat_count: usize) -> (u32, bool) {
    match tile.checked_sub(flat_count) {
        Some(curved) => (curved as u32, true),
        None => (tile as u32, false),
    }
}

pub fn objects(scene: &Scene, tiles: &[Tile]) -> Vec<gpu_types::Object> {
    let flat_count = scene.receivers().count();
    let receiver = |object| {
        let tile = tiles.iter().position(|tile| tile.object == object)?;
        Some(receiver_of(tile, flat_count))
    };
    (scene.objects.iter().enumerate())
        .map(|(index, object)| object_of(scene, object, receiver(index)))
        .collect()
}

/// What the device knows of the lights.
pub struct Lights<'a> {
    pub suns: Vec<gpu_types::Light>,
    pub environment: Option<Sky<'a>>,
}

pub struct Sky<'a> {
    pub map: &'a Arc<EnvironmentMap>,
    pub scale: f32,
    /// rad, 0 to 2π.
    pub rotation: f32,
}

/// # Errors
/// [`Error::Usage`] where there is more than one environment.
pub fn lights(scene: &Scene, origin: DVec3) -> Result<Lights<'_>> {
    let mut suns = Vec::new();
    let mut environment = None;
    for light in &scene.lights {
        match &light.kind {
            LightKind::Sun {
                direction,
                irradiance,
                angular_radius,
            } => {
                let [axis1, axis2] = disc_axes(*direction, *angular_radius);
                suns.push(gpu_types::Light {
                    place: direction.as_vec3(),
                    size: *angular_radius as f32,
                    power: irradiance.as_vec3(),
                    axis1,
                    axis2,
                    ..Default::default()
                });
            }
            LightKind::Lamp {
                position,
                radius,
                radiant_flux,
            } => suns.push(gpu_types::Light {
                place: (*position - origin).as_vec3(),
                size: *radius as f32,
                // Into all of the sphere of directions, W/sr.
                power: (*radiant_flux / (4.0 * PI)).as_vec3(),
                is_lamp: 1,
                ..Default::default()
            }),
            LightKind::Environment {
                map,
                scale,
                rotation,
            } => {
                let sky = Sky {
                    map,
                    scale: *scale as f32,
                    rotation: rotation.rem_euclid(TAU) as f32,
                };
                if environment.replace(sky).is_some() {
                    return Err(Error::Usage {
                        reason: "the scene has more than one environment".into(),
                        remedy: "keep one light of kind environment".into(),
                    });
                }
            }
        }
    }
    Ok(Lights { suns, environment })
}

fn object_of(scene: &Scene, object: &Object, receiver: Option<(u32, bool)>) -> gpu_types::Object {
    let [mut color, mut index, mut extinction] = [DVec3::ZERO; 3];
    let kind = match scene.materials[object.material].kind {
        MaterialKind::Mirror { reflectance } => {
            color = reflectance;
            MIRROR
        }
        MaterialKind::Conductor {
            index: real,
            extinction: imaginary,
        } => {
            (index, extinction) = (real, imaginary);
            CONDUCTOR
        }
        MaterialKind::Dielectric { ior } => {
            index = DVec3::splat(ior);
            DIELECTRIC
        }
        MaterialKind::Diffuse { albedo } => {
            color = albedo;
            DIFFUSE
        }
    };
    gpu_types::Object {
        color: color.as_vec3(),
        kind,
        index: index.as_vec3(),
        extinction: extinction.as_vec3(),
        receiver: receiver.map_or(NO_RECEIVER, |(index, _)| index as i32),
        is_curved: receiver.map_or(0, |(_, is_curved)| u32::from(is_curved)),
    }
}

/// Whether light can be blocked on its way to a mirror or from there to a receiver. It cannot
/// where the only thing that casts shadows is the only mirror, and every face of it sees all others
/// from behind: flat or convex, or if it lets light through, flat. Both legs then lie before the face,
/// wherever the light is. Where that takes to compare more than `most_pairs` of faces and vertices, it
/// is taken to block.
pub fn can_block(scene: &Scene, meshes: &[Cow<Mesh>], most_pairs: usize) -> bool {
    let mut blocking = scene
        .objects
        .iter()
        .zip(meshes)
        .filter(|(object, _)| object.blocks_light);
    let Some((object, mesh)) = blocking.next() else {
        return false;
    };
    let material = &scene.materials[object.material].kind;
    if !material.is_specular() || scene.specular_objects().count() > 1 {
        return true;
    }
    let two_sided = matches!(material, MaterialKind::Dielectric { .. });
    if blocking.next().is_some() || mesh.positions.len() * mesh.triangles.len() > most_pairs {
        return true;
    }
    let size = mesh
        .positions
        .iter()
        .map(|p| p.distance(mesh.positions[0]))
        .fold(0.0, f64::max);
    mesh.triangles.iter().any(|corners| {
        let [a, b, c] = corners.map(|corner| mesh.positions[corner as usize]);
        let normal = (b - a).cross(c - a).normalize_or_zero();
        mesh.positions.iter().any(|p| {
            let height = normal.dot(*p - a);
            let height = if two_sided { height.abs() } else { height };
            height > 1e-9 * size
        })
    })
}

/// The environment and its averages over solid angle down to one texel.
pub fn mip_chain(map: &EnvironmentMap, scale: f32) -> Vec<(u32, u32, Vec<[f32; 3]>)> {
    let scaled: Vec<_> = map
        .radiance
        .iter()
        .map(|rgb| rgb.map(|x| x * scale))
        .collect();
    let mut levels = vec![(map.width, map.height, scaled)];
    while let Some((width, height, pixels)) = levels.last()
        && UVec2::new(*width, *height).max_element() > 1
    {
        let half = halve(*width, *height, pixels);
        levels.push(half);
    }
    levels
}

fn halve(width: u32, height: u32, pixels: &[[f32; 3]]) -> (u32, u32, Vec<[f32; 3]>) {
    let (w, h) = ((width / 2).max(1), (height / 2).max(1));
    // Solid angle of a texel of row y, up to a constant.
    let weight = |y: u32| {
        let edge = |row: u32| (f64::from(row) / f64::from(height) * std::f64::consts::PI).cos();
        edge(y) - edge(y + 1)
    };
    let mut half = Vec::with_capacity((w * h) as usize);
    for y in 0..h {
        for x in 0..w {
            let mut sum = [0.0; 3];
            let mut weights = 0.0;
            for row in y * height / h..(y + 1) * height / h {
                for column in x * width / w..(x + 1) * width / w {
                    let pixel = pixels[(row * width + column) as usize];
                    (0..3).for_each(|c| sum[c] += weight(row) * f64::from(pixel[c]));
                    weights += weight(row);
                }
            }
            half.push(sum.map(|s| (s / weights) as f32));
        }
    }
    (w, h, half)
}
