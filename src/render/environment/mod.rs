//! environment: light from everywhere, as cells that are imaged by patch clusters.

pub mod cells;
pub mod device;
pub mod mips;
pub mod pairs;
