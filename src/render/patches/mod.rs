//! patches: the division of the casters' triangles into the paper's sample points.

pub mod casters;
pub mod clusters;
pub mod facets;
pub mod kd_tree;
pub mod merging;
pub mod sample;
pub mod subdivision;
pub mod tessellation;
