pub mod camera;
pub mod direct;
