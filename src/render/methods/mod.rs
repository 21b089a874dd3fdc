pub mod pinhole;
pub mod points;
