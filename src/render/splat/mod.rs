pub mod draw_footprints;
pub mod footprints;
pub mod kernel_profiles;
pub mod list;
pub mod mesh_footprints;
pub mod pinhole_images;
pub mod resolve;
pub mod triangles;
