//! update: what has changed from one frame to the next goes to the device.
//!
//! Objects are compared one by one, meshes by their address first, so that what stands still costs a
//! comparison. The triangles of what moved are put into their places again, and the hierarchy is
//! fitted to them (`bvh.rs`). Which triangles face a light is found out anew; how finely they are cut
//! is not (`reflectors.rs`).

use crate::error::{Error, Result};
use crate::gpu::{Context, Recorder, Write};
use crate::render::device_scene::{
    DeviceScene, Lights, can_block, lights, mip_chain, objects, receivers,
};
use crate::render::gpu_types::Patch;
use crate::render::lights::is_narrow;
use crate::render::patches::tessellation;
use crate::render::receivers::mesh::{Surfaces, surfaces};
use crate::scene::{Geometry, LightKind, Mesh, Object, Scene};
use std::borrow::Cow;
use std::mem::discriminant;
use std::sync::Arc;

/// Pairs of faces and vertices that a frame has the time to compare, about 1 ms.
const MOST_PAIRS: usize = 1_000_000;

impl DeviceScene {
    /// Brings the device up to `scene`, which differs from the last in where things are and how
    /// bright, not in what there is. Returns whether the stages must be made again: for more patches than
    /// [`DeviceScene::patch_room`] was, which has grown then, or for another environment.
    ///
    /// # Errors
    /// As [`crate::render::Renderer::update`].
    pub fn update(
        &mut self,
        context: &Arc<Context>,
        recorder: &mut Recorder,
        scene: &Scene,
    ) -> Result<bool> {
        check_same_structure(&self.scene, scene)?;
        let Lights {
            mut suns,
            environment,
        } = lights(scene, self.soup.origin)?;
        // Until this one is through.
        let stale = std::mem::replace(&mut self.stale, true);
        let moved: Vec<usize> = (0..scene.objects.len())
            .filter(|&i| stale || !same_geometry(&self.scene.objects[i], &scene.objects[i]))
            .collect();
        for &index in &moved {
            let mesh = scene.objects[index].geometry.mesh();
            self.soup.put(index, &mesh);
        }
        let rebuilt = !moved.is_empty() && self.soup.settle();
        if rebuilt {
            for tile in &mut self.tiles {
                tile.triangle = self.soup.places(tile.object)[0];
            }
        }
        // The range of triangles that the moved ones span.
        let range = if rebuilt {
            0..self.soup.triangles.len()
        } else {
            let places = || moved.iter().flat_map(|&index| self.soup.places(index));
            let first = places().min().map_or(0, |first| *first as usize);
            first..places().max().map_or(0, |last| *last as usize + 1)
        };
        if !self.trace && !moved.is_empty() {
            let meshes: Vec<Cow<Mesh>> = (scene.objects.iter())
                .map(|object| object.geometry.mesh())
                .collect();
            self.trace = can_block(scene, &meshes, MOST_PAIRS);
        }
        let mut another_sky = false;
        if let Some(sky) = &environment {
            self.rotation = sky.rotation;
            let last = lights(&self.scene, self.soup.origin)?.environment;
            let last = last.filter(|_| !stale);
            another_sky = (last.as_ref()).is_none_or(|last| !Arc::ptr_eq(last.map, sky.map));
            if another_sky || last.is_some_and(|last| last.scale != sky.scale) {
                let levels = mip_chain(sky.map, sky.scale);
                self.environment.write_levels(recorder, &levels)?;
            }
            match &self.pairs {
                Some(pairs) if another_sky => {
                    self.pairs = Some(pairs.for_sky(context, scene, &self.soup, sky, &suns)?);
                }
                Some(pairs) => {
                    let patches = match stale || !moved.is_empty() {
                        true => pairs.patches_of(&self.soup),
                        false => Vec::new(),
                    };
                    self.staging.write(
                        recorder,
                        &[
                            Write::new(&pairs.lights, 0, &pairs.lights_of(sky)),
                            Write::new(&pairs.patches, 0, &patches),
                        ],
                    )?;
                }
                None => {}
            }
            suns.extend(self.pairs.iter().flat_map(|pairs| pairs.suns_of(sky)));
        }
        if another_sky {
            // What is like a sun in it.
            self.triangles_of.truncate(self.sun_count as usize);
            let receivers = receivers(scene, &self.tiles, self.soup.origin);
            let others = &suns[self.sun_count as usize..];
            (self.triangles_of)
                .extend((others.iter()).map(|l| is_narrow(scene, &self.soup, &receivers, l)));
        }
        let lit = self.specular.lit(&self.soup, &suns)?;
        let nodes = if moved.is_empty() {
            Vec::new()
        } else {
            self.soup.nodes()
        };
        let curved_moved = (self.curved_tiles().iter()).any(|tile| moved.contains(&tile.object));
        let Surfaces {
            texels,
            samples,
            nodes: atlas_nodes,
            ..
        } = match curved_moved || rebuilt && self.curved_count() > 0 {
            true => surfaces(scene, self.curved_tiles(), &self.atlases, &self.soup)?,
            false => Surfaces::default(),
        };
        let triangles = &self.soup.triangles[range.clone()];
        let normals = &self.soup.normals[range.clone()];
        self.staging.write(
            recorder,
            &[
                Write::new(&self.triangles, range.start, triangles),
                Write::new(&self.normals, range.start, normals),
                Write::new(&self.nodes, 0, &nodes),
                Write::new(&self.objects, 0, &objects(scene, &self.tiles)),
                Write::new(&self.suns, 0, &suns),
                Write::new(
                    &self.receivers,
                    0,
                    &receivers(scene, &self.tiles, self.soup.origin),
                ),
                Write::new(&self.atlas_texels, 0, &texels),
                Write::new(&self.atlas_samples, 0, &samples),
                Write::new(&self.atlas_nodes, 0, &atlas_nodes),
                Write::new(&self.reflectors, 0, &lit.reflectors),
            ],
        )?;
        self.reflector_count = lit.reflectors.len() as u32;
        self.reflector_area = lit.area as f32;
        self.patch_count = lit.patch_count;
        self.scene = scene.clone();
        self.stale = false;
        if lit.patch_count <= self.patch_room {
            return Ok(another_sky && self.pairs.is_some());
        }
        // Room for all that can ever be lit, if the device allows it, grows only once.
        let all = self.specular.all_patches();
        let fits = all * size_of::<Patch>() as u64 <= context.max_storage_bytes()
            && all.saturating_mul(u64::from(self.light_count())) <= tessellation::MOST_PAIRS;
        self.patch_room = if fits { all as u32 } else { lit.patch_count };
        Ok(true)
    }
}

fn same_geometry(a: &Object, b: &Object) -> bool {
    match (&a.geometry, &b.geometry) {
        (Geometry::Mesh(a), Geometry::Mesh(b)) => Arc::ptr_eq(a, b) || a == b,
        (a, b) => a == b,
    }
}

/// That only places, sizes, directions and colours differ.
fn check_same_structure(a: &Scene, b: &Scene) -> Result<()> {
    let another = |what: String| {
        Err(Error::Usage {
            reason: format!("the scene is another than before: {what}"),
            remedy: "make a new renderer for it".into(),
        })
    };
    for (what, before, now) in [
        ("objects", a.objects.len(), b.objects.len()),
        ("lights", a.lights.len(), b.lights.len()),
    ] {
        if before != now {
            return another(format!("it had {before} {what} and has {now}"));
        }
    }
    for (light, other) in a.lights.iter().zip(&b.lights) {
        let same = match (&light.kind, &other.kind) {
            (LightKind::Environment { map: a, .. }, LightKind::Environment { map: b, .. }) => {
                [a.width, a.height] == [b.width, b.height]
            }
            (a, b) => discriminant(a) == discriminant(b),
        };
        if !same {
            return another(format!("light `{}` is of another kind or size", other.name));
        }
    }
    for (object, other) in a.objects.iter().zip(&b.objects) {
        let kind =
            |scene: &Scene, object: &Object| discriminant(&scene.materials[object.material].kind);
        let what = if kind(a, object) != kind(b, other) {
            "the kind of material"
        } else if !same_topology(&object.geometry, &other.geometry) {
            "the topology"
        } else if object.light_map != other.light_map {
            "the size of the light map"
        } else if object.blocks_light != other.blocks_light {
            "the shadow"
        } else {
            continue;
        };
        return another(format!("{what} of object `{}` differs", other.name));
    }
    Ok(())
}

fn same_topology(a: &Geometry, b: &Geometry) -> bool {
    match (a, b) {
        (Geometry::Mesh(a), Geometry::Mesh(b)) => Arc::ptr_eq(a, b) || a.triangles == b.triangles,
        (Geometry::Waves(a), Geometry::Waves(b)) => a.quads == b.quads,
        (a, b) => discriminant(a) == discriminant(b),
    }
}
