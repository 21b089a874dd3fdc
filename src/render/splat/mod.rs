//! splat: projectors write what patches throw, compaction lists it, and one draw adds it to the light maps.

pub mod footprints;
pub mod kernel_profiles;
pub mod list;
pub mod mesh_footprints;
pub mod pinhole_images;
pub mod projector;
pub mod resolve;
pub mod triangles;
