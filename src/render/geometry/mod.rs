pub mod bvh;
pub mod triangle_store;
