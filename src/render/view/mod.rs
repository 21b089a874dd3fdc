//! view: direct light in maps, and the camera's picture.

pub mod camera;
pub mod direct;
pub mod frame;
pub mod overlay;
pub mod overlay_frame;
pub mod work_list;
