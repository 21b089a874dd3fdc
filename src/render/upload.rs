//! upload: the scene as buffers and images on the device.
//!
//! The origin moves to the middle of the scene, so that f32 resolves it wherever it lies, and
//! the triangles go into the order of the leaves of a bounding volume hierarchy.

use super::Settings;
use super::bvh::Bvh;
use super::layout::{self, CONDUCTOR, DIELECTRIC, DIFFUSE, MIRROR, NO_RECEIVER};
use super::parts::{Part, parts};
use crate::error::{Error, Result};
use crate::gpu::{Buffer, Context, Image, Pipeline, Resource, Sampling, Shader};
use crate::scene::{EnvironmentMap, Geometry, LightKind, MaterialKind, Mesh, Object, Scene};
use glam::{DVec3, UVec2, Vec3};
use obvhs::triangle::Triangle as BvhTriangle;
use std::borrow::Cow;
use std::f64::consts::{PI, TAU};
use std::sync::Arc;

/// A receiver's part of the light-map atlas.
#[derive(Debug, Clone, Copy)]
pub struct Tile {
    /// Index into [`Scene::objects`].
    pub object: usize,
    pub origin: [u32; 2],
    pub size: [u32; 2],
    /// One of its rect's two triangles.
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
    pub reflectors: Buffer,
    pub environment: Image,
    pub sun_count: u32,
    pub has_environment: bool,
    /// Of the environment, rad, 0 to 2π.
    pub rotation: f32,
    pub reflector_count: u32,
    /// m²
    pub reflector_area: f32,
    /// Ways that light takes at a patch: 2 where some is refracted, otherwise 1.
    pub lobes: u32,
    pub patch_count: u32,
    pub tiles: Vec<Tile>,
    /// Size of the light-map atlas, texels.
    pub atlas: [u32; 2],
    /// Whether anything can block the light on its way by the mirrors to the receivers.
    pub trace: bool,
    /// Where the device's origin lies in the scene, m.
    pub origin: DVec3,
    /// What was left out and why, for the user.
    pub notes: Vec<String>,
}

impl DeviceScene {
    /// Uploads `scene`.
    ///
    /// # Errors
    /// [`Error::Usage`] where there is nothing to light or the light maps do not fit,
    /// [`Error::Device`] where the device's memory does not suffice.
    pub fn new(context: &Arc<Context>, scene: &Scene, settings: &Settings) -> Result<Self> {
        let mut notes = Vec::new();
        let meshes: Vec<Cow<Mesh>> = (scene.objects.iter())
            .map(|object| object.geometry.mesh())
            .collect();
        let origin = middle(&meshes);

        let soup = Soup::new(scene, &meshes, origin)?;
        let (tiles, atlas) = pack_tiles(scene, &soup, context.max_image_side())?;
        let receivers = receivers(scene, &tiles, origin);
        let objects: Vec<_> = scene
            .objects
            .iter()
            .enumerate()
            .map(|(index, object)| {
                object_of(scene, object, tiles.iter().position(|t| t.object == index))
            })
            .collect();

        let mut suns = Vec::new();
        let mut environment = None;
        for light in &scene.lights {
            match &light.kind {
                LightKind::Sun {
                    direction,
                    irradiance,
                    angular_radius,
                } => suns.push(layout::Light {
                    place: direction.as_vec3(),
                    size: *angular_radius as f32,
                    power: irradiance.as_vec3(),
                    is_lamp: 0,
                }),
                LightKind::Lamp {
                    position,
                    radius,
                    radiant_flux,
                } => suns.push(layout::Light {
                    place: (*position - origin).as_vec3(),
                    size: *radius as f32,
                    // Into all of the sphere of directions, W/sr.
                    power: (*radiant_flux / (4.0 * PI)).as_vec3(),
                    is_lamp: 1,
                }),
                LightKind::Environment {
                    map,
                    scale,
                    rotation,
                } => {
                    if environment
                        .replace((
                            mip_chain(map, *scale as f32),
                            rotation.rem_euclid(TAU) as f32,
                        ))
                        .is_some()
                    {
                        return Err(Error::Usage {
                            reason: "the scene has more than one environment".into(),
                            remedy: "keep one light of kind environment".into(),
                        });
                    }
                }
            }
        }

        let all_lit = environment.is_some() && settings.method == super::Method::Pinhole;
        let reflectors = reflectors(scene, &soup, &suns, all_lit, settings.samples)?;
        let refracts = (scene.objects.iter()).any(|object| {
            matches!(
                scene.materials[object.material].kind,
                MaterialKind::Dielectric { .. }
            )
        });
        let trace = can_block(scene, &meshes);
        if !trace {
            notes.push(
                "no rays are traced for the caustic: nothing in the scene can block its light"
                    .into(),
            );
        }
        let rotation = environment.as_ref().map_or(0.0, |(_, rotation)| *rotation);
        let has_environment = environment.is_some();
        let levels = environment.map_or_else(|| vec![(1, 1, vec![[0.0; 3]])], |(levels, _)| levels);
        Ok(Self {
            triangles: Buffer::with_data(context, "triangles", &soup.triangles)?,
            normals: Buffer::with_data(context, "normals", &soup.normals)?,
            nodes: Buffer::with_data(context, "nodes", &soup.nodes)?,
            objects: Buffer::with_data(context, "objects", &objects)?,
            suns: Buffer::with_data(context, "suns", &suns)?,
            receivers: Buffer::with_data(context, "receivers", &receivers)?,
            reflectors: Buffer::with_data(context, "reflectors", &reflectors.list)?,
            environment: Image::with_levels(
                context,
                "environment",
                &levels,
                Sampling::Equirectangular,
            )?,
            sun_count: suns.len() as u32,
            has_environment,
            rotation,
            reflector_count: reflectors.list.len() as u32,
            reflector_area: reflectors.area as f32,
            lobes: if refracts { 2 } else { 1 },
            patch_count: reflectors.patch_count,
            tiles,
            atlas,
            trace,
            origin,
            notes,
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
            ("reflectors", Resource::Buffer(&self.reflectors)),
            ("environment", Resource::Image(&self.environment)),
        ];
        Pipeline::compute(context, shader, &[own, &shared].concat())
    }

    /// Receivers, counted once for every way that light takes to them.
    pub fn targets(&self) -> u32 {
        self.lobes * self.tiles.len() as u32
    }

    /// Parts of all receivers' tiles, with `rays` rays a texel, each with the receiver's index.
    pub fn receiver_parts(&self, rays: u64) -> Vec<(usize, Part)> {
        let of_tile = |(receiver, tile): (usize, &Tile)| {
            parts(tile.size, rays).map(move |part| (receiver, part))
        };
        self.tiles.iter().enumerate().flat_map(of_tile).collect()
    }
}

/// Middle of the bounding box.
fn middle(meshes: &[Cow<Mesh>]) -> DVec3 {
    let positions = || meshes.iter().flat_map(|mesh| &mesh.positions);
    let lower = positions().fold(DVec3::INFINITY, |a, b| a.min(*b));
    let upper = positions().fold(DVec3::NEG_INFINITY, |a, b| a.max(*b));
    0.5 * (lower + upper)
}

/// What a link of the hierarchy can name.
const MOST_TRIANGLES: usize = 1 << 28;

/// All triangles of the scene in the order of the hierarchy's leaves.
struct Soup {
    triangles: Vec<layout::Triangle>,
    normals: Vec<layout::Normals>,
    /// A grid and its nodes, as the shaders' buffer has them.
    nodes: Vec<u8>,
    /// By triangle: its number in the order of the objects and their meshes.
    order: Vec<u32>,
}

impl Soup {
    fn new(scene: &Scene, meshes: &[Cow<Mesh>], origin: DVec3) -> Result<Self> {
        let count: usize = meshes.iter().map(|mesh| mesh.triangles.len()).sum();
        if count >= MOST_TRIANGLES {
            return Err(Error::Usage {
                reason: format!("the scene has {count} triangles"),
                remedy: format!("use coarser meshes, of {MOST_TRIANGLES} triangles at most"),
            });
        }
        let mut triangles = Vec::with_capacity(count);
        let mut normals = Vec::new();
        let mut boxes = Vec::new();
        for (index, (mesh, object)) in meshes.iter().zip(&scene.objects).enumerate() {
            for corners in &mesh.triangles {
                let [p0, p1, p2] = corners.map(|c| mesh.positions[c as usize] - origin);
                let [n0, n1, n2] = corners.map(|c| mesh.normals[c as usize].as_vec3());
                triangles.push(layout::Triangle {
                    position: p0.as_vec3(),
                    object: index as u32,
                    edge1: (p1 - p0).as_vec3(),
                    blocks: u32::from(object.blocks_light),
                    edge2: (p2 - p0).as_vec3(),
                    twin: 0, // known when they are in order
                });
                normals.push(layout::Normals {
                    n0,
                    n1,
                    n2,
                    ..Default::default()
                });
                let corner = |p: DVec3| p.as_vec3().into();
                boxes.push(BvhTriangle {
                    v0: corner(p0),
                    v1: corner(p1),
                    v2: corner(p2),
                });
            }
        }
        let bvh = Bvh::new(&boxes);
        let order = |i: &u32| *i as usize;
        let mut soup = Self {
            triangles: bvh.order.iter().map(|i| triangles[order(i)]).collect(),
            normals: bvh.order.iter().map(|i| normals[order(i)]).collect(),
            nodes: [
                bytemuck::bytes_of(&bvh.grid),
                bytemuck::cast_slice(&bvh.nodes),
            ]
            .concat(),
            order: bvh.order,
        };
        let mut of_rect = vec![None; scene.objects.len()];
        for index in 0..soup.triangles.len() {
            soup.triangles[index].twin = index as u32;
            let object = soup.triangles[index].object as usize;
            if let Geometry::Rect(_) = scene.objects[object].geometry
                && let Some(other) = of_rect[object].replace(index)
            {
                soup.triangles[index].twin = other as u32;
                soup.triangles[other].twin = index as u32;
            }
        }
        Ok(soup)
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
    for (object, _, size) in scene.receivers() {
        let padded = padded(size);
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
        let triangle = (soup.triangles.iter()).position(|t| t.object as usize == object);
        tiles.push(Tile {
            object,
            origin: [x, y],
            size,
            triangle: triangle.expect("a rect has triangles") as u32,
        });
        y += padded[1];
        width = width.max(x + padded[0]);
        height = height.max(y);
    }
    if tiles.is_empty() {
        return Err(Error::Usage {
            reason: "no object of the scene has a light map".into(),
            remedy: "give a diffuse rect the key `lightmap = [256, 256]`".into(),
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

fn receivers(scene: &Scene, tiles: &[Tile], origin: DVec3) -> Vec<layout::Receiver> {
    scene
        .receivers()
        .zip(tiles)
        .map(|((_, rect, _), tile)| layout::Receiver {
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

fn object_of(scene: &Scene, object: &Object, receiver: Option<usize>) -> layout::Object {
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
    layout::Object {
        color: color.as_vec3(),
        kind,
        index: index.as_vec3(),
        extinction: extinction.as_vec3(),
        receiver: receiver.map_or(NO_RECEIVER, |index| index as i32),
        ..Default::default()
    }
}

/// The specular triangles that face a light.
struct Reflectors {
    list: Vec<layout::Reflector>,
    /// Of all.
    patch_count: u32,
    /// m²
    area: f64,
}

/// The specular triangles that face a light, cut into about `samples` patches, one a triangle at
/// least.
///
/// All triangles of an object are cut alike, as its mesh was made: where patch sizes jump, the
/// footprints' sum is uneven. Only a triangle of more than [`LARGE`] times the object's mean area
/// is cut more finely.
///
/// # Errors
/// [`Error::Usage`] where there are more pairs of patch and sun than 32 bits count.
fn reflectors(
    scene: &Scene,
    soup: &Soup,
    suns: &[layout::Light],
    all_lit: bool,
    samples: u32,
) -> Result<Reflectors> {
    /// Leaves room to round up.
    const MOST_PAIRS: u64 = 1 << 31;
    const LARGE: f64 = 4.0;
    let mut lit = Vec::new();
    let mut objects = vec![(0.0, 0.0); scene.objects.len()]; // area, triangles
    for (index, (triangle, normals)) in soup.triangles.iter().zip(&soup.normals).enumerate() {
        let object = triangle.object as usize;
        let material = &scene.materials[scene.objects[object].material].kind;
        let two_sided = matches!(material, MaterialKind::Dielectric { .. });
        if material.is_specular()
            && (all_lit || two_sided || suns.iter().any(|sun| faces(triangle, normals, sun)))
        {
            let area = 0.5 * f64::from(triangle.edge1.cross(triangle.edge2).length());
            lit.push((index as u32, object, area));
            objects[object].0 += area;
            objects[object].1 += 1.0;
        }
    }
    // In the order of the meshes, which unlike that of the hierarchy does not change with rounding:
    // a scene of another size is cut into the same patches.
    lit.sort_by_key(|(index, ..)| soup.order[*index as usize]);
    let total: f64 = lit.iter().map(|(_, _, area)| area).sum();
    let (mut patch_count, mut area_so_far) = (0u64, 0.0);
    let mut reflectors = Vec::with_capacity(lit.len());
    for (triangle, object, area) in lit {
        let mean = objects[object].0 / objects[object].1;
        let patches = f64::from(samples) * mean / total;
        let finer = (area / (LARGE * mean)).sqrt().max(1.0);
        let subdivision = (patches.sqrt().round().max(1.0) * finer).round() as u32;
        area_so_far += area;
        reflectors.push(layout::Reflector {
            triangle,
            first_patch: patch_count as u32,
            subdivision,
            // Casts saturate: the last one ends at 2^32 - 1.
            share_end: (area_so_far / total * 2f64.powi(32)) as u32,
        });
        patch_count += u64::from(subdivision) * u64::from(subdivision);
        let pairs = patch_count.saturating_mul(suns.len().max(1) as u64);
        if pairs > MOST_PAIRS {
            return Err(Error::Usage {
                reason: format!(
                    "{samples} samples make more than {MOST_PAIRS} patches, counted once a sun"
                ),
                remedy: "ask for fewer samples".into(),
            });
        }
    }
    Ok(Reflectors {
        list: reflectors,
        patch_count: patch_count as u32,
        area: total,
    })
}

/// Whether any part of a sun or lamp may shine on the triangle's front. n·(p − x), of a normal n and
/// the way from x to the lamp's middle p, is a mean over pairs of corners, so that one of these is
/// positive where any of the triangle's is.
fn faces(triangle: &layout::Triangle, normals: &layout::Normals, light: &layout::Light) -> bool {
    let geometric = triangle.edge1.cross(triangle.edge2).normalize_or_zero();
    let (lowest, ways) = if light.is_lamp == 0 {
        (-light.size.sin(), [light.place; 3])
    } else {
        let way = light.place - triangle.position;
        (
            -light.size,
            [way, way - triangle.edge1, way - triangle.edge2],
        )
    };
    let above = |normal: &Vec3| ways.iter().any(|way| normal.dot(*way) > lowest);
    above(&geometric) && [normals.n0, normals.n1, normals.n2].iter().any(above)
}

/// Whether light can be blocked on its way to a mirror or from there to a receiver. It cannot
/// where the only thing that casts shadows is the only mirror, and every face of it sees all others
/// from behind: flat or convex, or if it lets light through, flat. Both legs then lie before the face,
/// wherever the light is.
fn can_block(scene: &Scene, meshes: &[Cow<Mesh>]) -> bool {
    /// Pairs of faces and vertices worth comparing.
    const MOST_PAIRS: usize = 200_000_000;
    let mut blocking = scene
        .objects
        .iter()
        .zip(meshes)
        .filter(|(object, _)| object.blocks_light);
    let Some((object, mesh)) = blocking.next() else {
        return false;
    };
    let is_specular = |object: &Object| scene.materials[object.material].kind.is_specular();
    let mirrors = scene.objects.iter().filter(|o| is_specular(o)).count();
    if !is_specular(object) || mirrors > 1 {
        return true;
    }
    let material = &scene.materials[object.material].kind;
    let two_sided = matches!(material, MaterialKind::Dielectric { .. });
    if blocking.next().is_some() || mesh.positions.len() * mesh.triangles.len() > MOST_PAIRS {
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
fn mip_chain(map: &EnvironmentMap, scale: f32) -> Vec<(u32, u32, Vec<[f32; 3]>)> {
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
