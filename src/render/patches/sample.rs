//! sample: divides the casters' lit triangles into patches, the paper's sample points.

use crate::error::Result;
use crate::gpu::{BoundPipeline, Buffer, Context, Recorder, Resource, shaders};
use crate::render::device_scene::DeviceScene;
use crate::render::gpu_types::constants::{MAX_ROW, SPLAT_GROUP};
use crate::render::gpu_types::{Patch, SamplePush};
use std::sync::Arc;

/// Patches of a dispatch.
pub const BATCH: u32 = MAX_ROW * SPLAT_GROUP;

pub struct Sample {
    pipeline: BoundPipeline,
    pub patches: Buffer,
}

impl Sample {
    pub fn new(context: &Arc<Context>, scene: &DeviceScene) -> Result<Self> {
        let bytes = u64::from(scene.casters.patch_capacity) * size_of::<Patch>() as u64;
        let patches = Buffer::new(context, "patches", bytes)?;
        let own = [("patches", Resource::Buffer(&patches))];
        let pipeline = scene.compute(context, &shaders::SAMPLE_COMP, &own)?;
        Ok(Self { pipeline, patches })
    }

    /// Writes `patches` patches from index `first_patch` on.
    pub fn record(
        &self,
        recorder: &mut Recorder,
        scene: &DeviceScene,
        first_patch: u32,
        patches: u32,
    ) {
        let push = SamplePush {
            first_patch,
            patch_count: scene.casters.patch_count,
            lit_triangle_count: scene.casters.lit_count,
        };
        recorder.dispatch(&self.pipeline, &push, [patches, 1, 1]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::gpu::ContextOptions;
    use crate::render::gpu_types::Triangle;
    use crate::render::settings::{Method, Settings};
    use std::path::Path;

    /// The patches of a finely divided triangle are its n² cells, each once.
    #[test]
    fn patches_tile_their_triangle() {
        const N: u32 = 600;
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("assets/scenes/mirror.toml");
        let scene = crate::scene::load(&file).unwrap().scene;
        let context = Context::new(&ContextOptions::default()).unwrap();
        let settings = Settings {
            method: Method::Pinhole,
            samples: 2 * N * N,
            ..Settings::default()
        };
        let mut device = DeviceScene::new(&context, &scene, &settings).unwrap();
        assert_eq!(device.casters.patch_count, 2 * N * N);
        let sample = Sample::new(&context, &device).unwrap();
        let mut recorder = Recorder::new(&context).unwrap();
        crate::render::frame::upload(&mut recorder, &mut device).unwrap();
        sample.record(&mut recorder, &device, 0, device.casters.patch_count);
        recorder.submit().unwrap();

        let triangles = device.geometry.triangles.read::<Triangle>(4).unwrap();
        let patches = sample.patches.read::<Patch>(2 * (N * N) as usize).unwrap();
        let n = N as usize;
        for patches in patches.chunks(n * n) {
            let triangle = triangles[patches[0].triangle as usize];
            let mut seen = vec![false; 2 * n * n];
            for patch in patches {
                assert_eq!(patch.triangle, patches[0].triangle);
                let from_corner = patch.position - triangle.position;
                let along =
                    |edge: glam::Vec3| N as f32 * from_corner.dot(edge) / edge.length_squared();
                // The edges from a rect's first corner are not both perpendicular.
                let (a, b) = (triangle.edge1, triangle.edge2);
                let overlap = [a.dot(b) / a.length_squared(), a.dot(b) / b.length_squared()];
                let (s, t) = (along(a), along(b));
                let share = 1.0 - overlap[0] * overlap[1];
                let (s, t) = ((s - overlap[0] * t) / share, (t - overlap[1] * s) / share);
                let turned = s.fract() + t.fract() > 1.0;
                assert!(s + t < N as f32, "{s} {t}");
                let cell = 2 * (t as usize * n + s as usize) + usize::from(turned);
                assert!(!std::mem::replace(&mut seen[cell], true), "twice: {s} {t}");
            }
        }
    }
}
