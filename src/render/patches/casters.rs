//! The casters' lit triangles on the device, with their numbers of patches.

use crate::error::Result;
use crate::gpu::{Buffer, Context, Staging};
use crate::render::geometry::triangle_store::TriangleStore;
use crate::render::gpu_types::{Light, LitTriangle, Patch};
use crate::render::patches::tessellation::{MAX_PAIRS, Tessellation};
use crate::scene::{MaterialKind, Scene};
use std::sync::Arc;

pub struct DeviceCasters {
    pub lit: Buffer,
    pub lit_count: u32,
    /// Total area of the lit triangles, m².
    pub area: f32,
    /// Lobes per patch: 2 where a caster refracts, otherwise 1.
    pub lobes: u32,
    pub patch_count: u32,
    /// Capacity of the stages' buffers, patches.
    pub patch_capacity: u32,
    /// Fixed by the first update.
    tessellation: Option<Tessellation>,
    /// Whether light comes from all directions.
    all_lit: bool,
}

impl DeviceCasters {
    /// Allocates for all triangles of the casters. `all_lit`: light comes from all directions.
    ///
    /// # Errors
    /// [`crate::Error::Device`] if device memory is insufficient.
    pub fn new(
        context: &Arc<Context>,
        scene: &Scene,
        store: &TriangleStore,
        all_lit: bool,
    ) -> Result<Self> {
        let triangles: usize = (scene.specular_objects())
            .map(|(object, _)| store.indices(object).len())
            .sum();
        let bytes = triangles * size_of::<LitTriangle>();
        let refracts = (scene.objects.iter()).any(|object| {
            let kind = &scene.materials[object.material].kind;
            matches!(kind, MaterialKind::Dielectric(_))
        });
        Ok(Self {
            lit: Buffer::new(context, "lit triangles", bytes as u64)?,
            lit_count: 0,
            area: 0.0,
            lobes: if refracts { 2 } else { 1 },
            patch_count: 0,
            patch_capacity: 0,
            tessellation: None,
            all_lit,
        })
    }

    /// Finds the triangles that are lit now. The first call also fixes the subdivision, so that the lit triangles have
    /// about `samples` patches. Returns whether the number of patches exceeds the capacity of the stages' buffers,
    /// which is then raised.
    ///
    /// # Errors
    /// [`crate::Error::Usage`] where there are too many patches, [`crate::Error::Device`] where the device fails.
    pub fn update(
        &mut self,
        context: &Context,
        staging: &mut Staging,
        scene: &Scene,
        store: &TriangleStore,
        lights: &[Light],
        samples: u32,
    ) -> Result<bool> {
        let is_first = self.tessellation.is_none();
        let all_lit = self.all_lit;
        let tessellation = (self.tessellation)
            .get_or_insert_with(|| Tessellation::new(scene, store, lights, all_lit, samples));
        let lit = tessellation.lit(store, lights)?;
        staging.write(&self.lit, 0, &lit.lit_triangles)?;
        self.lit_count = lit.lit_triangles.len() as u32;
        self.area = lit.area as f32;
        self.patch_count = lit.patch_count;
        if lit.patch_count <= self.patch_capacity {
            return Ok(false);
        }
        // A capacity for all patches that can ever be lit, if the device allows it, grows only once.
        let all = tessellation.all_patches();
        let fits = all * size_of::<Patch>() as u64 <= context.max_storage_bytes()
            && all.saturating_mul(lights.len() as u64) <= MAX_PAIRS;
        self.patch_capacity = match fits && !is_first {
            true => all as u32,
            false => lit.patch_count,
        };
        Ok(true)
    }

    /// Empties the list, for patches that exceed the capacity of the stages' buffers.
    pub fn clear(&mut self) {
        (self.patch_count, self.lit_count) = (0, 0);
    }

    /// A note where the number of patches differs much from the number asked for, with the reason.
    pub fn note(&self, samples: u32) -> Option<String> {
        const CLOSE: f64 = 1.5;
        let (patches, triangles) = (self.patch_count, self.lit_count);
        let (made, asked) = (f64::from(patches), f64::from(samples));
        if triangles == 0 || (asked / CLOSE..=asked * CLOSE).contains(&made) {
            return None;
        }
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
}
