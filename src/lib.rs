//! nephroid renders caustics in real time.

pub mod error;
pub mod gpu;
pub mod image_file;
pub mod measure;
pub mod optics;
pub mod reference;
pub mod render;
pub mod scene;
pub mod tone_map;

pub use error::{Error, Result};
