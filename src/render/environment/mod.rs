//! environment: light from all directions, as cells that patch clusters project.

pub mod cell;
pub mod cells;
pub mod device;
pub mod direct_cells;
pub mod mips;
pub mod pairs;
