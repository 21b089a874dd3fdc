//! geometry: the triangles of the scene in a bounding volume hierarchy.

pub mod bvh;
pub mod bvh_build;
pub mod device;
pub mod occlusion;
pub mod triangle_store;
