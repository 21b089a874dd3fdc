//! receivers: the surfaces that keep light maps, planar ones and meshes.

pub mod dilate;
pub mod light_maps;
pub mod mesh;
