//! receivers: the surfaces with light maps, planar receivers and mesh receivers.

pub mod dilate;
pub mod light_maps;
pub mod mesh;
pub mod points;
pub mod surfaces;
pub mod tile;
