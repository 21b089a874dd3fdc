//! How far an image, or a sequence of images, is from the truth, and what it cost.

mod aim;
pub mod chart;
mod compare;
mod flip;
mod light_map_sizes;
pub mod machine;
mod noise;
mod profile;
pub mod stress;
pub mod sweep;
mod target;

pub use aim::Aim;
pub use compare::{Comparison, SequenceComparison, SequenceMeter, Texel, compare};
pub use flip::{Flip, FlipPixel, PIXELS_PER_DEGREE, Region, flip};
pub use light_map_sizes::{ChosenLightMap, choose_light_maps};
pub use noise::{l1_without_noise, l1_without_noise_of};
pub use profile::{PassProfile, Spread, profile};
pub use target::{TargetComparison, compare_with_target, read_target};

use crate::scene::Scene;

/// The scene with one light map only.
fn with_light_map(scene: &Scene, receiver: usize, texels: [u32; 2]) -> Scene {
    let mut scene = scene.clone();
    for (index, object) in scene.objects.iter_mut().enumerate() {
        object.light_map = (index == receiver).then_some(texels);
    }
    scene
}
