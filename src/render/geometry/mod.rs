//! geometry: the triangles of the scene in a bounding volume hierarchy.

pub mod bvh;
pub mod bvh_build;
pub mod device;
pub mod hierarchy;
pub mod occlusion;
pub mod placement;
pub mod rays;
pub mod resting;
pub mod triangle_store;

#[cfg(test)]
mod tests;
