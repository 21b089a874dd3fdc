//! Scenes as plain data: what a scene file says, checked, in SI units and radians.
//!
//! Right-handed, y up. Positions are `f64` so that a scene far from the origin keeps its shape;
//! the renderer moves the origin into the scene before it goes to `f32`.

mod animation;
mod asset;
mod atlas;
mod environment;
mod file;
mod glass;
mod keyframes;
pub mod load;
mod materials;
pub(crate) mod memory;
mod mesh;
mod mtl;
mod obj;
mod obj_text;
mod overlap;
mod skin;
mod texture;

pub use animation::Animation;
pub use atlas::{Atlas, NoLayout, Piece, Texel, Unwrapping};
pub use glass::{D_LINE, Dispersion, GLASSES, Sellmeier};
pub use load::{Loaded, load};
pub(crate) use skin::is_closed;
pub use texture::{Texture, TextureLevel};
#[cfg(feature = "cli")]
pub(crate) use texture::{covered, read as read_texture};

use glam::{DMat3, DVec2, DVec3};
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

/// Most radiance of a light, W/m²/sr: fifty million times the sun's, and the square of a sum of many such
/// is still an f32 value.
pub const MAX_RADIANCE: f32 = 1e15;

/// Everything the renderer needs to know, at one time; [`Animation`] has it at every time.
#[derive(Debug, Clone)]
pub struct Scene {
    pub camera: Camera,
    pub lights: Vec<Light>,
    pub materials: Vec<Material>,
    pub objects: Vec<Object>,
    /// Maximum number of specular surfaces that light meets on its way to a receiver, ≥ 1.
    pub max_interfaces: u32,
    /// Shared by the scenes of all times.
    pub textures: Vec<Arc<Texture>>,
}

/// [`Scene::max_interfaces`] where a scene does not say.
pub const DEFAULT_MAX_INTERFACES: u32 = 16;

/// Pinhole camera.
#[derive(Debug, Clone)]
pub struct Camera {
    /// m
    pub position: DVec3,
    /// Point in the middle of the picture, m.
    pub target: DVec3,
    /// Vertical field of view, rad.
    pub fov: f64,
    /// The picture is multiplied by 2^exposure_ev before tone mapping.
    pub exposure_ev: f64,
}

/// What shines.
#[derive(Debug, Clone)]
pub struct Light {
    pub name: String,
    pub kind: LightKind,
}

#[derive(Debug, Clone, PartialEq)]
pub enum LightKind {
    /// A distant disc of constant radiance.
    Sun {
        /// Unit vector toward the light's centre.
        direction: DVec3,
        /// RGB irradiance on a plane that faces the light, W/m².
        irradiance: DVec3,
        /// rad; 0 is a point at infinity.
        angular_radius: f64,
    },
    /// A sphere of the same radiance Φ/(4π²R²) everywhere and in all directions. A plane that faces it
    /// at the distance d from its middle gets Φ/(4πd²). It casts no shadow.
    Lamp {
        /// Of its middle, m.
        position: DVec3,
        /// R, m; > 0.
        radius: f64,
        /// Φ, RGB, W.
        radiant_flux: DVec3,
    },
    /// Radiance from every direction.
    Environment {
        map: Arc<EnvironmentMap>,
        /// Factor on the map's radiance, which stays within [`MAX_RADIANCE`].
        scale: f64,
        /// Rotation about +y, rad: a direction at azimuth u of the map appears at u + rotation.
        rotation: f64,
        /// Whether specular surfaces send its light on to receivers. If not, it lights diffuse surfaces directly, the
        /// camera sees it in mirrors and through interfaces, and interfaces do not block it: it passes straight through.
        casts_caustics: bool,
    },
}

impl LightKind {
    /// Whether specular surfaces send its light on to receivers.
    pub fn casts_caustics(&self) -> bool {
        match self {
            Self::Environment { casts_caustics, .. } => *casts_caustics,
            Self::Sun { .. } | Self::Lamp { .. } => true,
        }
    }
}

/// Equirectangular radiance image, W/m²/sr, rows from the zenith down:
/// u = atan2(d.x, −d.z)/2π mod 1, v = acos(d.y)/π from the top row.
#[derive(Debug, Clone, PartialEq)]
pub struct EnvironmentMap {
    pub width: u32,
    pub height: u32,
    /// `width * height` RGB values, all finite and ≥ 0.
    pub radiance: Vec<[f32; 3]>,
}

/// What a surface does to light.
#[derive(Debug, Clone)]
pub struct Material {
    pub name: String,
    pub kind: MaterialKind,
    /// Of a diffuse material: its colours at every point are factors on its albedo. Objects have
    /// [`Object::texture_coordinates`] where their material has one.
    pub albedo_map: Option<AlbedoMap>,
}

/// A texture as a surface has it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlbedoMap {
    /// Index into [`Scene::textures`].
    pub texture: usize,
    /// Factor on the texture coordinates u and v: repeats of the image within a unit of each.
    pub uv_scale: DVec2,
}

#[derive(Debug, Clone, PartialEq)]
pub enum MaterialKind {
    /// Ideal specular reflection on the front face; the back face absorbs.
    Mirror {
        /// RGB, 0..=1.
        reflectance: DVec3,
    },
    /// A metal: specular reflection by Fresnel's equations on the front face; the back face absorbs.
    Conductor {
        /// Real part of the index of refraction, RGB, and imaginary part, the extinction.
        index: DVec3,
        extinction: DVec3,
    },
    /// The smooth surface of something transparent: it reflects and refracts by Fresnel's equations,
    /// from both sides.
    Dielectric(Dielectric),
    /// Lambertian BRDF albedo/π on the front face; the back face absorbs.
    Diffuse {
        /// RGB, 0..=1.
        albedo: DVec3,
    },
}

/// The medium behind the front face of a surface. Before it is what surrounds it: another dielectric, or air.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Dielectric {
    /// Index of refraction, relative to air, at the [`D_LINE`].
    pub ior: f64,
    /// How it depends on the wavelength, where the medium disperses light.
    pub dispersion: Option<Dispersion>,
    /// σ, RGB, 1/m: of light that travels d metres, exp(−σ d) is left.
    pub absorption: DVec3,
    /// Where dielectrics overlap, the one with the highest priority fills the place, and among equal ones the one that
    /// light entered last.
    pub priority: i32,
    /// A sheet without thickness: two parallel interfaces at the same place. What passes keeps its direction.
    pub thin: bool,
}

impl Dielectric {
    /// Clear, of the priority 0.
    pub fn new(ior: f64) -> Self {
        Self {
            ior,
            dispersion: None,
            absorption: DVec3::ZERO,
            priority: 0,
            thin: false,
        }
    }

    /// Index of refraction at a vacuum wavelength in µm.
    pub fn ior_at(&self, wavelength: f64) -> f64 {
        (self.dispersion).map_or(self.ior, |dispersion| dispersion.index(wavelength))
    }
}

/// A surface with one material.
#[derive(Debug, Clone)]
pub struct Object {
    pub name: String,
    /// Index into [`Scene::materials`].
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
    /// Texture coordinates of the corners of all triangles of [`Geometry::mesh`], in their order. Those of a rect and of waves are
    /// 0 to 1 along edge_u and edge_v. `None` for a mesh whose file has none, or whose material needs none.
    pub fn texture_coordinates(&self) -> Option<Cow<'_, [[DVec2; 3]]>> {
        match &self.geometry {
            Geometry::Mesh(_) => self.uvs.as_ref().map(|uvs| Cow::Borrowed(uvs.as_slice())),
            Geometry::Rect(_) => Some(Cow::Owned(grid_coordinates([1, 1]))),
            Geometry::Waves(waves) => Some(Cow::Owned(grid_coordinates(waves.quads))),
        }
    }
}

/// Texture coordinates of the corners of a grid's triangles, as [`Rect::to_mesh`] and [`Waves::to_mesh`] order them.
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

impl MaterialKind {
    /// Whether it throws a caustic.
    pub fn is_specular(&self) -> bool {
        !matches!(self, Self::Diffuse { .. })
    }
}

#[derive(Debug, Clone, PartialEq)]
pub enum Geometry {
    /// Shared by the scenes of all times at which it does not move.
    Mesh(Arc<Mesh>),
    Rect(Rect),
    Waves(Waves),
}

impl Geometry {
    /// As triangles.
    pub fn mesh(&self) -> Cow<'_, Mesh> {
        match self {
            Self::Mesh(mesh) => Cow::Borrowed(mesh),
            Self::Rect(rect) => Cow::Owned(rect.to_mesh()),
            Self::Waves(waves) => Cow::Owned(waves.to_mesh()),
        }
    }

    /// Scaled, turned and moved.
    pub fn moved(&self, by: &Similarity) -> Self {
        let rect = |rect: Rect| Rect {
            origin: by.place(rect.origin),
            edge_u: by.scale * (by.rotation * rect.edge_u),
            edge_v: by.scale * (by.rotation * rect.edge_v),
        };
        match self {
            Self::Mesh(mesh) => Self::Mesh(Arc::new(Mesh {
                positions: mesh.positions.iter().map(|p| by.place(*p)).collect(),
                normals: mesh.normals.iter().map(|n| by.rotation * *n).collect(),
                triangles: mesh.triangles.clone(),
            })),
            Self::Rect(still) => Self::Rect(rect(*still)),
            Self::Waves(still) => {
                let mut waves = still.clone();
                waves.rect = rect(still.rect);
                for sine in &mut waves.sines {
                    sine.amplitude *= by.scale;
                    sine.wave_vector /= by.scale;
                }
                Self::Waves(waves)
            }
        }
    }
}

/// p ↦ scale · rotation p + shift
#[derive(Debug, Clone, Copy)]
pub struct Similarity {
    /// > 0
    pub scale: f64,
    pub rotation: DMat3,
    /// m
    pub shift: DVec3,
}

impl Similarity {
    fn place(&self, p: DVec3) -> DVec3 {
        self.scale * (self.rotation * p) + self.shift
    }
}

/// Triangles with a unit normal at every vertex, which is interpolated and normalised between
/// them. The front face is the one seen counter-clockwise; vertex normals point to its side.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Mesh {
    /// m
    pub positions: Vec<DVec3>,
    /// Unit vectors, as many as positions.
    pub normals: Vec<DVec3>,
    /// Indices of corners, counter-clockwise from the front.
    pub triangles: Vec<[u32; 3]>,
}

impl Mesh {
    /// Lower and upper corner of the bounding box, m.
    pub fn bounds(&self) -> [DVec3; 2] {
        let positions = || self.positions.iter();
        [
            positions().fold(DVec3::INFINITY, |a, b| a.min(*b)),
            positions().fold(DVec3::NEG_INFINITY, |a, b| a.max(*b)),
        ]
    }

    /// From `point` to the nearest point of the triangles, m; infinite where there is none.
    pub fn distance_to(&self, point: DVec3) -> f64 {
        let distance = |corners: &[u32; 3]| {
            origin_to_triangle(corners.map(|corner| self.positions[corner as usize] - point))
        };
        (self.triangles.iter())
            .map(distance)
            .fold(f64::INFINITY, f64::min)
    }

    /// The triangle's corners, m.
    pub fn corners(&self, triangle: usize) -> [DVec3; 3] {
        self.triangles[triangle].map(|corner| self.positions[corner as usize])
    }

    /// The triangle's normal times its area, m².
    pub fn vector_area(&self, triangle: usize) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        0.5 * (b - a).cross(c - a)
    }

    /// The point of the triangle with these weights of its second and third corner, m.
    pub fn point(&self, triangle: usize, weights: DVec2) -> DVec3 {
        let [a, b, c] = self.corners(triangle);
        a + weights.x * (b - a) + weights.y * (c - a)
    }
}

/// From the origin to the nearest point of the triangle.
fn origin_to_triangle([a, b, c]: [DVec3; 3]) -> f64 {
    let edges = [[a, b], [b, c], [c, a]];
    if let Some(normal) = (b - a).cross(c - a).try_normalize()
        && edges.iter().all(|[p, q]| normal.dot(p.cross(*q)) >= 0.0)
    {
        return normal.dot(a).abs();
    }
    let to_edge = |[p, q]: [DVec3; 2]| {
        let edge = q - p;
        // An edge without length is its corner.
        let place = -p.dot(edge) / edge.length_squared().max(f64::MIN_POSITIVE);
        (p + place.clamp(0.0, 1.0) * edge).length()
    };
    edges.map(to_edge).into_iter().fold(f64::INFINITY, f64::min)
}

/// Rectangle origin + u·edge_u + v·edge_v, u, v ∈ [0, 1]; front face toward edge_u × edge_v.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Rect {
    pub origin: DVec3,
    /// Perpendicular to `edge_v`.
    pub edge_u: DVec3,
    pub edge_v: DVec3,
}

impl Rect {
    /// Unit normal of the front face.
    pub fn normal(&self) -> DVec3 {
        self.edge_u.cross(self.edge_v).normalize()
    }

    /// m²
    pub fn area(&self) -> f64 {
        self.edge_u.cross(self.edge_v).length()
    }

    /// The two triangles.
    pub fn to_mesh(&self) -> Mesh {
        let (o, u, v) = (self.origin, self.edge_u, self.edge_v);
        Mesh {
            positions: vec![o, o + u, o + u + v, o + v],
            normals: vec![self.normal(); 4],
            triangles: vec![[0, 1, 2], [0, 2, 3]],
        }
    }
}

/// A rectangle whose height along its normal is a sum of sines.
#[derive(Debug, Clone, PartialEq)]
pub struct Waves {
    /// At rest.
    pub rect: Rect,
    /// Quads along edge_u and edge_v that it is cut into, two triangles each.
    pub quads: [u32; 2],
    pub sines: Vec<Sine>,
    /// s
    pub time: f64,
}

/// A wave of height amplitude · sin(k·p + phase − speed · time), p the place on the rectangle from
/// its origin, in m along edge_u and edge_v.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sine {
    /// m
    pub amplitude: f64,
    /// k, rad/m.
    pub wave_vector: DVec2,
    /// rad
    pub phase: f64,
    /// rad/s
    pub speed: f64,
}

impl Waves {
    /// Its triangles at [`Waves::time`], with the exact normals at the vertices.
    pub fn to_mesh(&self) -> Mesh {
        let Rect {
            origin,
            edge_u,
            edge_v,
        } = self.rect;
        let (along_u, along_v, up) = (edge_u.normalize(), edge_v.normalize(), self.rect.normal());
        let extent = DVec2::new(edge_u.length(), edge_v.length());
        let [columns, rows] = self.quads;
        let mut mesh = Mesh::default();
        for row in 0..=rows {
            for column in 0..=columns {
                let share = DVec2::new(
                    f64::from(column) / f64::from(columns),
                    f64::from(row) / f64::from(rows),
                );
                let p = share * extent;
                let (mut height, mut slope) = (0.0, DVec2::ZERO);
                for sine in &self.sines {
                    let angle = sine.wave_vector.dot(p) + sine.phase - sine.speed * self.time;
                    height += sine.amplitude * angle.sin();
                    slope += sine.amplitude * angle.cos() * sine.wave_vector;
                }
                mesh.positions
                    .push(origin + share.x * edge_u + share.y * edge_v + height * up);
                mesh.normals
                    .push((up - slope.x * along_u - slope.y * along_v).normalize());
            }
        }
        for row in 0..rows {
            for column in 0..columns {
                let a = row * (columns + 1) + column;
                let [b, c, d] = [a + 1, a + columns + 2, a + columns + 1];
                mesh.triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        mesh
    }
}

impl Scene {
    /// Index of the object called `name`.
    pub fn object_index(&self, name: &str) -> Option<usize> {
        self.objects.iter().position(|object| object.name == name)
    }

    /// The scene `scale` times as large, then moved by `shift` (m). Lamps get `scale`² times their
    /// flux, so that irradiance stays.
    pub fn transformed(mut self, scale: f64, shift: DVec3) -> Self {
        let by = Similarity {
            scale,
            rotation: DMat3::IDENTITY,
            shift,
        };
        self.camera.position = by.place(self.camera.position);
        self.camera.target = by.place(self.camera.target);
        for light in &mut self.lights {
            if let LightKind::Lamp {
                position,
                radius,
                radiant_flux,
            } = &mut light.kind
            {
                *position = by.place(*position);
                *radius *= scale;
                *radiant_flux *= scale * scale;
            }
        }
        for object in &mut self.objects {
            object.geometry = object.geometry.moved(&by);
        }
        self
    }

    /// Mirrors and what lets light through, as (index, object).
    pub fn specular_objects(&self) -> impl Iterator<Item = (usize, &Object)> {
        (self.objects.iter().enumerate())
            .filter(|(_, object)| self.materials[object.material].kind.is_specular())
    }

    /// The meshes that carry a light map, as (index, mesh, texels).
    pub fn mesh_receivers(&self) -> impl Iterator<Item = (usize, &Arc<Mesh>, [u32; 2])> {
        (self.objects.iter().enumerate()).filter_map(|(index, object)| {
            match (&object.geometry, object.light_map) {
                (Geometry::Mesh(mesh), Some(texels)) => Some((index, mesh, texels)),
                _ => None,
            }
        })
    }

    /// Indices and texels of all objects that carry a light map, in their order.
    pub fn light_maps(&self) -> Vec<(usize, [u32; 2])> {
        let planar = (self.planar_receivers()).map(|(index, _, texels)| (index, texels));
        let meshes = (self.mesh_receivers()).map(|(index, _, texels)| (index, texels));
        let mut all: Vec<_> = planar.chain(meshes).collect();
        all.sort_unstable();
        all
    }

    /// The rects that carry a light map, as (index, rect, texels).
    pub fn planar_receivers(&self) -> impl Iterator<Item = (usize, &Rect, [u32; 2])> {
        self.objects
            .iter()
            .enumerate()
            .filter_map(
                |(index, object)| match (&object.geometry, object.light_map) {
                    (Geometry::Rect(rect), Some(texels)) => Some((index, rect, texels)),
                    _ => None,
                },
            )
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn distances_to_a_triangle() {
        let mesh = Mesh {
            positions: vec![DVec3::ZERO, 4.0 * DVec3::X, 3.0 * DVec3::Z],
            normals: vec![DVec3::NEG_Y; 3],
            triangles: vec![[0, 1, 2]],
        };
        for (x, y, z, distance) in [
            (1.0, 2.0, 1.0, 2.0),   // over the inside
            (1.0, -2.0, 1.0, 2.0),  // under it
            (2.0, 0.0, -3.0, 3.0),  // beside an edge
            (4.0, 0.0, 3.0, 2.4),   // beside the longest edge
            (7.0, 4.0, 0.0, 5.0),   // past a corner
            (-3.0, 0.0, -4.0, 5.0), // past another
            (1.0, 0.0, 1.0, 0.0),
        ] {
            let found = mesh.distance_to(DVec3::new(x, y, z));
            assert!((found - distance).abs() < 1e-15, "{x} {y} {z}: {found}");
        }
        let line = Mesh {
            triangles: vec![[0, 1, 1]],
            ..mesh
        };
        assert_eq!(line.distance_to(DVec3::new(7.0, 4.0, 0.0)), 5.0);
        assert_eq!(Mesh::default().distance_to(DVec3::ZERO), f64::INFINITY);
    }
}
