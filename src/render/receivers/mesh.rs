//! Mesh receivers for the shaders: the surface in each texel of their light maps, points where rays start, and the
//! quadtree that finds the texels that a beam of light meets.

use crate::error::{Error, Result};
use crate::render::geometry::triangle_store::{TriangleStore, packed};
use crate::render::gpu_types::constants::{LEAF, NO_TEXEL, NO_TRIANGLE};
use crate::render::gpu_types::{AtlasNode, AtlasSamples, AtlasTexel, MeshReceiver};
use crate::render::receivers::tile::Tile;
use crate::scene::{Atlas, Mesh, NoLayout, Scene};
use glam::{DMat3, DVec2, DVec3, UVec4};
use std::f64::consts::FRAC_PI_2;

/// Maximum number of texels: texels and nodes then fit in 32 bits.
const MAX_TEXELS: usize = 1 << 28;

/// Data of all mesh receivers, in the order of their tiles.
#[derive(Default)]
pub struct MeshReceiverData {
    pub receivers: Vec<MeshReceiver>,
    pub texels: Vec<AtlasTexel>,
    pub samples: Vec<AtlasSamples>,
    pub nodes: Vec<AtlasNode>,
}

/// The atlases of the mesh receivers, indexed by object.
///
/// # Errors
/// [`Error::Usage`] where a mesh cannot be laid out.
pub fn atlases(scene: &Scene) -> Result<Vec<Option<Atlas>>> {
    let mut atlases = vec![None; scene.objects.len()];
    for (index, _, size) in scene.mesh_receivers() {
        let found = Atlas::of(&scene.objects[index], size);
        atlases[index] = Some(found.map_err(NoLayout::into_error)?.0);
    }
    Ok(atlases)
}

/// # Errors
/// [`Error::Usage`] where the light maps together have too many texels.
pub fn mesh_receiver_data(
    scene: &Scene,
    tiles: &[Tile],
    atlases: &[Option<Atlas>],
    store: &TriangleStore,
) -> Result<MeshReceiverData> {
    let mut all = MeshReceiverData::default();
    for ((object, mesh, size), tile) in scene.mesh_receivers().zip(tiles) {
        let atlas = atlases[object].as_ref().expect("laid out");
        let mesh_texels = MeshTexels::new(atlas, &mesh, store.origin);
        let levels = levels(size);
        all.receivers.push(MeshReceiver {
            tile_x: tile.origin[0],
            tile_y: tile.origin[1],
            width: size[0],
            height: size[1],
            first_texel: all.texels.len() as u32,
            first_node: all.nodes.len() as u32,
            levels,
            ..Default::default()
        });
        all.nodes.extend(mesh_texels.nodes(levels));
        all.texels.extend(mesh_texels.texels);
        all.samples.extend(samples(atlas, store.indices(object)));
        if all.texels.len() > MAX_TEXELS {
            return Err(Error::Usage {
                reason: format!("the light maps of meshes have more than {MAX_TEXELS} texels"),
                remedy: "ask for smaller light maps".into(),
            });
        }
    }
    Ok(all)
}

/// Levels of the quadtree over the leaves.
fn levels(size: [u32; 2]) -> u32 {
    let sides = size.map(|side| side.div_ceil(LEAF));
    sides[0].max(sides[1]).next_power_of_two().ilog2()
}

/// Number of nodes of the quadtree of a light map.
pub fn node_count(size: [u32; 2]) -> u64 {
    (0..=levels(size)).map(|level| 1 << (2 * level)).sum()
}

/// A point on a triangle in each quarter of every texel.
fn samples(atlas: &Atlas, places: &[u32]) -> impl Iterator<Item = AtlasSamples> {
    let [width, height] = atlas.size();
    (0..(width * height) as usize).map(move |texel| {
        let (mut triangles, mut weights) = (UVec4::splat(NO_TRIANGLE), UVec4::ZERO);
        // The last piece of a quarter is used; any piece is equally good.
        for piece in atlas.pieces(texel) {
            let quarter = piece.quarter as usize;
            triangles[quarter] = places[piece.triangle as usize];
            weights[quarter] = packed(piece.weights);
        }
        AtlasSamples { triangles, weights }
    })
}

/// The texels of one receiver.
struct MeshTexels {
    size: [u32; 2],
    texels: Vec<AtlasTexel>,
    /// Covariances of the surface in the texels, as images of whole squares, m².
    covariances: Vec<DMat3>,
}

impl MeshTexels {
    fn new(atlas: &Atlas, mesh: &Mesh, origin: DVec3) -> Self {
        let found = atlas.texels(mesh);
        let width = atlas.size()[0] as usize;
        // The images of a texel's sides under the map of a triangle.
        let sides = |triangle: u32, place: DVec2| {
            let at = |place| mesh.point(triangle as usize, atlas.weights_at(triangle, place));
            let corner = at(place);
            [at(place + DVec2::X) - corner, at(place + DVec2::Y) - corner]
        };
        let middle =
            |texel: usize| DVec2::new((texel % width) as f64 + 0.5, (texel / width) as f64 + 0.5);
        let largest = |texel: usize| {
            let area = |triangle: u32| mesh.vector_area(triangle as usize).length();
            (atlas.pieces(texel).iter())
                .max_by(|a, b| {
                    let [a, b] = [a, b].map(|piece| piece.share * area(piece.triangle));
                    a.total_cmp(&b)
                })
                .map(|piece| piece.triangle)
        };
        let mut texels: Vec<AtlasTexel> = (found.iter())
            .map(|texel| AtlasTexel {
                position: (texel.position - origin).as_vec3(),
                area: texel.area as f32,
                normal: texel.normal.as_vec3(),
                source: NO_TEXEL,
            })
            .collect();
        let mut covariances: Vec<DMat3> = (0..texels.len())
            .map(|texel| {
                let Some(triangle) = largest(texel) else {
                    return DMat3::ZERO;
                };
                let [u, v] = sides(triangle, middle(texel));
                let outer = |a: DVec3| DMat3::from_cols(a.x * a, a.y * a, a.z * a);
                (outer(u) + outer(v)) * (1.0 / 12.0)
            })
            .collect();
        // The surface at the centre of `texel`, extrapolated from the centroid of the surface in `source`.
        let continued = |source: usize, texel: usize| {
            let triangle = largest(source).expect("a texel in a chart");
            let [u, v] = sides(triangle, middle(source));
            let offset = middle(texel) - atlas.centroid(mesh, source);
            (found[source].position + offset.x * u + offset.y * v - origin).as_vec3()
        };
        // Texels that a chart covers in part show the light at their centre, and texels around the charts extrapolate
        // it; otherwise bilinear look-ups would show the seams.
        for (index, texel) in texels.iter_mut().enumerate() {
            if !atlas.pieces(index).is_empty() {
                texel.position = continued(index, index);
            }
        }
        for (texel, source) in atlas.around() {
            texels[texel] = AtlasTexel {
                position: continued(source, texel),
                area: 0.0,
                normal: found[source].normal.as_vec3(),
                source: source as u32,
            };
            covariances[texel] = covariances[source];
        }
        Self {
            size: atlas.size(),
            texels,
            covariances,
        }
    }

    /// The quadtree, level by level from the leaves, each level row by row.
    fn nodes(&self, levels: u32) -> Vec<AtlasNode> {
        let side = 1usize << levels;
        let mut level: Vec<Node> = (0..side * side)
            .map(|index| self.leaf((index % side) as u32, (index / side) as u32))
            .collect();
        let mut nodes: Vec<AtlasNode> = level.iter().map(Node::on_device).collect();
        for step in 1..=levels {
            let side = 1usize << (levels - step);
            level = (0..side * side)
                .map(|index| {
                    let first = 4 * side * (index / side) + 2 * (index % side);
                    Node::around([0, 1, 2 * side, 2 * side + 1].map(|child| level[first + child]))
                })
                .collect();
            nodes.extend(level.iter().map(Node::on_device));
        }
        nodes
    }

    fn leaf(&self, x: u32, y: u32) -> Node {
        let [width, height] = self.size;
        let rows = (LEAF * y).min(height)..(LEAF * (y + 1)).min(height);
        let columns = (LEAF * x).min(width)..(LEAF * (x + 1)).min(width);
        let texels: Vec<usize> = rows
            .flat_map(|row| {
                columns
                    .clone()
                    .map(move |column| (row * width + column) as usize)
            })
            .filter(|&texel| self.texels[texel].normal != glam::Vec3::ZERO)
            .collect();
        let position = |texel: &usize| self.texels[*texel].position.as_dvec3();
        let normal = |texel: &usize| self.texels[*texel].normal.as_dvec3().normalize();
        let bound = |pick: fn(DVec3, DVec3) -> DVec3| texels.iter().map(position).reduce(pick);
        let (Some(low), Some(high)) = (bound(DVec3::min), bound(DVec3::max)) else {
            return Node::EMPTY;
        };
        let centre = 0.5 * (low + high);
        let radius = (texels.iter()).map(|t| position(t).distance(centre));
        let axis = (texels.iter().map(normal).sum::<DVec3>()).normalize_or_zero();
        let angle = (texels.iter()).map(|t| normal(t).dot(axis).clamp(-1.0, 1.0).acos());
        let trace = |t: &usize| {
            let c = self.covariances[*t];
            c.x_axis.x + c.y_axis.y + c.z_axis.z
        };
        Node {
            count: texels.len() as f64,
            low,
            high,
            centre,
            radius: radius.fold(0.0, f64::max),
            covariance: texels.iter().map(|t| self.covariances[*t]).sum(),
            max_trace: texels.iter().map(trace).fold(0.0, f64::max),
            axis,
            angle: angle.fold(0.0, f64::max),
        }
    }
}

/// A square of texels.
#[derive(Clone, Copy)]
struct Node {
    /// Number of texels.
    count: f64,
    low: DVec3,
    high: DVec3,
    centre: DVec3,
    radius: f64,
    /// Sum of the texels' covariances.
    covariance: DMat3,
    max_trace: f64,
    axis: DVec3,
    /// Maximum angle between the axis and any normal, rad.
    angle: f64,
}

impl Node {
    const EMPTY: Self = Self {
        count: 0.0,
        low: DVec3::INFINITY,
        high: DVec3::NEG_INFINITY,
        centre: DVec3::ZERO,
        radius: 0.0,
        covariance: DMat3::ZERO,
        max_trace: 0.0,
        axis: DVec3::ZERO,
        angle: 0.0,
    };

    fn around(children: [Self; 4]) -> Self {
        let filled = || children.iter().filter(|child| child.count > 0.0);
        if filled().next().is_none() {
            return Self::EMPTY;
        }
        let low = filled().map(|c| c.low).fold(DVec3::INFINITY, DVec3::min);
        let high = filled()
            .map(|c| c.high)
            .fold(DVec3::NEG_INFINITY, DVec3::max);
        let centre = 0.5 * (low + high);
        let radius = filled().map(|c| c.centre.distance(centre) + c.radius);
        let axis = (filled().map(|c| c.count * c.axis).sum::<DVec3>()).normalize_or_zero();
        let angle = filled().map(|c| c.axis.dot(axis).clamp(-1.0, 1.0).acos() + c.angle);
        Self {
            count: filled().map(|c| c.count).sum(),
            low,
            high,
            centre,
            radius: (radius.fold(0.0, f64::max)).min(0.5 * low.distance(high)),
            covariance: filled().map(|c| c.covariance).sum(),
            max_trace: filled().map(|c| c.max_trace).fold(0.0, f64::max),
            axis,
            angle: angle.fold(0.0, f64::max),
        }
    }

    fn on_device(&self) -> AtlasNode {
        if self.count == 0.0 {
            return AtlasNode {
                radius: -1.0,
                ..Default::default()
            };
        }
        // Margin for rounding to 32 bits.
        const MARGIN: f64 = 1.0 + 1e-5;
        let c = self.covariance * (1.0 / self.count);
        AtlasNode {
            centre: self.centre.as_vec3(),
            radius: (self.radius * MARGIN) as f32,
            diagonal: DVec3::new(c.x_axis.x, c.y_axis.y, c.z_axis.z).as_vec3(),
            max_trace: self.max_trace as f32,
            off_diagonal: DVec3::new(c.x_axis.y, c.x_axis.z, c.y_axis.z).as_vec3(),
            sine: match self.angle < FRAC_PI_2 && self.axis != DVec3::ZERO {
                true => (self.angle.sin() * MARGIN) as f32,
                false => 2.0,
            },
            axis: self.axis.as_vec3(),
            ..Default::default()
        }
    }
}
