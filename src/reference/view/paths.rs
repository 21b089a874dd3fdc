//! Paths from the camera through mirrors and interfaces to where they end.

use crate::reference::chains::choose;
use crate::reference::lights::Lamp;
use crate::reference::media::{Dielectrics, Media};
use crate::reference::mirrors::{Leaving, Surface, shading_normal};
use crate::reference::sequence::Choices;
use crate::reference::visibility::Blockers;
use crate::scene::{MaterialKind, Scene, Texture};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::sync::Arc;

/// Specular surfaces that a path meets, at most; what lies behind more is dark.
const MAX_BOUNCES: u32 = 12;

/// Interfaces at which a path follows both the reflected and the refracted ray. At those behind, it follows one,
/// chosen with a probability of its share.
const MAX_SPLITS: u32 = 2;

/// Everything that the camera sees.
pub struct Paths {
    eye: DVec3,
    /// Half the picture's width and height at distance 1, and the way to its middle.
    right: DVec3,
    up: DVec3,
    forward: DVec3,
    /// Pixels.
    size: [u32; 2],
    triangles: Vec<Triangle>,
    /// `None` in an empty scene.
    surfaces: Option<Blockers>,
    looks: Vec<Look>,
    /// Of each object, in `triangles`.
    first_triangles: Vec<u32>,
    lamps: Vec<Lamp>,
    dielectrics: Dielectrics,
}

struct Triangle {
    corners: [DVec3; 3],
    /// Unit vertex normals.
    normals: [DVec3; 3],
    /// Unit normal of the flat triangle, on its front.
    geometric: DVec3,
    object: u32,
    /// Among the object's.
    number: u32,
    /// Among those that block light.
    blocker: Option<u32>,
    /// Texture coordinates of the corners, times their scale; 0 without a texture.
    uvs: [DVec2; 3],
}

/// What an object does to light.
enum Look {
    Diffuse {
        /// RGB
        albedo: DVec3,
        /// Its colours are factors on `albedo`.
        texture: Option<Arc<Texture>>,
    },
    Specular(Surface),
}

/// Where a path ends.
pub enum End {
    Diffuse(DiffusePoint),
    /// In a lamp of this radiance, RGB, W/m²/sr.
    Lamp(DVec3),
    /// Outside of the scene, in this direction.
    Background(DVec3),
}

/// A point on the front of a diffuse surface.
pub struct DiffusePoint {
    pub object: usize,
    /// Among the object's.
    pub triangle: u32,
    /// Of the triangle's second and third corner.
    pub weights: DVec2,
    /// m
    pub position: DVec3,
    /// Interpolated between the corners, unit.
    pub shading: DVec3,
    /// Of the flat triangle, unit.
    pub geometric: DVec3,
    /// The triangle among those that block light.
    pub blocker: Option<u32>,
    /// RGB
    pub albedo: DVec3,
    /// Of the path, m.
    pub length: f64,
    /// Specular surfaces on the path.
    pub bounces: u32,
}

/// A ray on its way.
struct Ray {
    origin: DVec3,
    direction: DVec3,
    /// The triangle that it leaves from.
    from: Option<u32>,
    /// Radiance at the camera over that at the ray's end.
    weight: DVec3,
    bounces: u32,
    splits: u32,
    /// m
    length: f64,
    /// Factor on the weight from the first surface on that disperses light, which makes it light of one wavelength.
    tint: DVec3,
    media: Media,
}

impl Paths {
    pub fn new(scene: &Scene, size: [u32; 2]) -> Self {
        let camera = &scene.camera;
        let forward = (camera.target - camera.position).normalize();
        let right = forward.cross(DVec3::Y).normalize();
        let half_height = (0.5 * camera.fov).tan();
        let aspect = f64::from(size[0]) / f64::from(size[1]);
        let (mut triangles, mut looks, mut blockers) = (Vec::new(), Vec::new(), 0);
        let mut first_triangles = Vec::new();
        for (object, index) in scene.objects.iter().zip(0..) {
            let mesh = object.geometry.mesh();
            let material = &scene.materials[object.material];
            let map = material.albedo_map;
            let uvs = map.and_then(|_| object.texture_coordinates());
            first_triangles.push(triangles.len() as u32);
            for (indices, number) in mesh.triangles.iter().zip(0..) {
                let corners = mesh.corners(number as usize);
                let [a, b, c] = corners;
                triangles.push(Triangle {
                    corners,
                    normals: indices.map(|corner| mesh.normals[corner as usize]),
                    geometric: (b - a).cross(c - a).normalize_or_zero(),
                    object: index,
                    number,
                    blocker: object.blocks_light.then_some(blockers + number),
                    uvs: match (&uvs, map) {
                        (Some(uvs), Some(map)) => uvs[number as usize].map(|uv| map.uv_scale * uv),
                        _ => [DVec2::ZERO; 3],
                    },
                });
            }
            if object.blocks_light {
                blockers += mesh.triangles.len() as u32;
            }
            let kind = &material.kind;
            looks.push(match (kind, Surface::of(kind)) {
                (_, Some(surface)) => Look::Specular(surface),
                (MaterialKind::Diffuse { albedo }, None) => Look::Diffuse {
                    albedo: *albedo,
                    texture: map.map(|map| scene.textures[map.texture].clone()),
                },
                (_, None) => unreachable!("what is not diffuse is specular"),
            });
        }
        let corners: Vec<_> = triangles.iter().map(|triangle| triangle.corners).collect();
        Self {
            eye: camera.position,
            right: half_height * aspect * right,
            up: half_height * right.cross(forward),
            forward,
            size,
            triangles,
            surfaces: Blockers::new(&corners),
            looks,
            first_triangles,
            lamps: scene.lights.iter().filter_map(Lamp::new).collect(),
            dielectrics: Dielectrics::of(scene),
        }
    }

    /// In the picture.
    pub fn pixels(&self) -> usize {
        self.size[0] as usize * self.size[1] as usize
    }

    /// Height of a pixel in the middle of the picture at distance 1.
    pub fn pixel_height(&self) -> f64 {
        2.0 * self.up.length() / f64::from(self.size[1])
    }

    /// The pixel that shows a point directly, if any does, and its radiance for each unit of radiant
    /// exitance that arrives on an area of 1 m² there, sr⁻¹ m⁻²: cosθ_y/(π d² cos³θ A), θ_y the angle to
    /// `normal`, θ the angle to the middle of the picture, d the distance, and A the pixel's area in the
    /// plane at distance 1.
    pub fn pixel_of(&self, position: DVec3, normal: DVec3) -> Option<(usize, f64)> {
        let way = position - self.eye;
        let (distance, depth) = (way.length(), way.dot(self.forward));
        let facing = -normal.dot(way) / (normal.length() * distance);
        if depth <= 0.0 || facing <= 0.0 {
            return None;
        }
        let across = |half: DVec3| 0.5 + 0.5 * way.dot(half) / (depth * half.length_squared());
        let [x, y] = [across(self.right), 1.0 - across(self.up)];
        if !(0.0..1.0).contains(&x) || !(0.0..1.0).contains(&y) {
            return None;
        }
        let hidden = (self.surfaces.as_ref())
            .is_some_and(|surfaces| surfaces.block(position, -way / distance, distance, None))
            || (self.lamps.iter())
                .filter_map(|lamp| lamp.meets(self.eye, way / distance))
                .any(|to_lamp| to_lamp < distance);
        if hidden {
            return None;
        }
        let [columns, rows] = self.size.map(f64::from);
        let pixel = (y * rows) as usize * self.size[0] as usize + (x * columns) as usize;
        let area = 4.0 * self.right.length() * self.up.length() / (columns * rows);
        let cosine = depth / distance;
        Some((
            pixel,
            facing / (PI * distance.powi(2) * cosine.powi(3) * area),
        ))
    }

    /// Albedo, RGB, of an object's triangle number `triangle` at these weights of its second and third corner; 0 where it
    /// is not diffuse. A texture is bilinear between its texels, without mipmaps: the mean over a pixel is that of its paths.
    pub fn albedo(&self, object: usize, triangle: u32, weights: DVec2) -> DVec3 {
        match &self.looks[object] {
            Look::Diffuse { albedo, texture } => texture.as_ref().map_or(*albedo, |texture| {
                let index = self.first_triangles[object] + triangle;
                let [a, b, c] = self.triangles[index as usize].uvs;
                *albedo * texture.colour_at(a + weights.x * (b - a) + weights.y * (c - a))
            }),
            Look::Specular(_) => DVec3::ZERO,
        }
    }

    /// Follows the path through the point (u, v) in [0, 1)² of a pixel, from its top left corner. Calls
    /// `ends` with every end and the radiance at the camera over that at the end.
    pub fn follow(
        &self,
        pixel: usize,
        [u, v]: [f64; 2],
        choices: &mut Choices,
        ends: &mut dyn FnMut(End, DVec3),
    ) {
        let width = self.size[0] as usize;
        let x = ((pixel % width) as f64 + u) / f64::from(self.size[0]);
        let y = ((pixel / width) as f64 + v) / f64::from(self.size[1]);
        let direction = self.forward + (2.0 * x - 1.0) * self.right + (1.0 - 2.0 * y) * self.up;
        let (wavelength, tint) = self.dielectrics.wavelength(|| choices.next());
        let ray = Ray {
            origin: self.eye,
            direction: direction.normalize(),
            from: None,
            weight: DVec3::ONE,
            bounces: 0,
            splits: 0,
            length: 0.0,
            tint,
            media: Media::air(wavelength),
        };
        self.follow_ray(ray, choices, ends);
    }

    fn follow_ray(&self, mut ray: Ray, choices: &mut Choices, ends: &mut dyn FnMut(End, DVec3)) {
        loop {
            let hit = (self.surfaces.as_ref()).and_then(|surfaces| {
                surfaces.nearest(ray.origin, ray.direction, f64::INFINITY, ray.from)
            });
            let distance = hit.map_or(f64::INFINITY, |(_, distance, _)| distance);
            let transmittance = |media: &Media| media.transmittance(&self.dielectrics, distance);
            if let Some(radiance) = self.lamp_before(&ray, distance) {
                return ends(End::Lamp(radiance), ray.weight);
            }
            let Some((index, _, weights)) = hit else {
                return ends(End::Background(ray.direction), ray.weight);
            };
            let triangle = &self.triangles[index as usize];
            let position = triangle.point(weights);
            let surface = match &self.looks[triangle.object as usize] {
                Look::Specular(surface) => surface,
                Look::Diffuse { .. } => {
                    if triangle.geometric.dot(ray.direction) < 0.0 {
                        let object = triangle.object as usize;
                        let point = DiffusePoint {
                            object,
                            triangle: triangle.number,
                            weights,
                            position,
                            shading: triangle.shading(weights),
                            geometric: triangle.geometric,
                            blocker: triangle.blocker,
                            albedo: self.albedo(object, triangle.number, weights),
                            length: ray.length + distance,
                            bounces: ray.bounces,
                        };
                        ends(End::Diffuse(point), ray.weight * transmittance(&ray.media));
                    }
                    return;
                }
            };
            let front = triangle.geometric.dot(ray.direction) < 0.0;
            let sides = (ray.media).sides(&self.dielectrics, triangle.object, front);
            let mut weight = ray.weight * transmittance(&sides.media[0]);
            if !sides.is_interface {
                ray = Ray {
                    origin: position,
                    from: Some(index),
                    weight,
                    length: ray.length + distance,
                    media: sides.media[1],
                    ..ray
                };
                continue;
            }
            if ray.bounces == MAX_BOUNCES {
                return;
            }
            weight *= sides.take_tint(&mut ray.tint);
            let tint = ray.tint;
            let next = |leaving: &Leaving, probability: f64, splits: u32, side: usize| Ray {
                origin: position,
                direction: leaving.direction,
                from: Some(index),
                // Backward: the light comes from where `leaving` leads.
                weight: weight * leaving.share / (leaving.compression * probability),
                bounces: ray.bounces + 1,
                splits: ray.splits + splits,
                length: ray.length + distance,
                tint,
                media: sides.media[side],
            };
            let normal = triangle.shading(weights);
            let geometric = triangle.geometric;
            let lobes = surface.leaving_with_fallback(sides.ior, -ray.direction, normal, geometric);
            ray = match lobes {
                [Some(reflected), Some(refracted)] if ray.splits < MAX_SPLITS => {
                    self.follow_ray(next(&reflected, 1.0, 1, 0), choices, ends);
                    next(&refracted, 1.0, 1, 1)
                }
                lobes => match choose(lobes, choices) {
                    Some((lobe, probability, side)) => next(&lobe, probability, 0, side),
                    None => return,
                },
            };
            if ray.weight == DVec3::ZERO {
                return;
            }
        }
    }

    /// Radiance of the nearest lamp, if it hides what is at `distance`.
    fn lamp_before(&self, ray: &Ray, distance: f64) -> Option<DVec3> {
        (self.lamps.iter())
            .filter_map(|lamp| Some((lamp.meets(ray.origin, ray.direction)?, lamp.radiance())))
            .filter(|&(to_lamp, _)| to_lamp < distance)
            .min_by(|a, b| a.0.total_cmp(&b.0))
            .map(|(_, radiance)| radiance)
    }
}

impl Triangle {
    fn point(&self, weights: DVec2) -> DVec3 {
        let [a, b, c] = self.corners;
        a + weights.x * (b - a) + weights.y * (c - a)
    }

    fn shading(&self, weights: DVec2) -> DVec3 {
        shading_normal(self.normals, self.geometric, weights)
    }
}
