//! splat: projectors write the splats of patches and lights, compaction lists them, and one draw adds them to the light
//! maps.

pub mod kernel_profiles;
pub mod kinds;
pub mod list;
pub mod prefix_sums;
pub mod projector;
pub mod quads;
pub mod resolve;
mod triangle_counts;
pub mod triangles;
