pub mod clusters;
pub mod kd_tree;
pub mod sample;
pub mod tessellation;
