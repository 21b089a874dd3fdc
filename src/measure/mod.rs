//! How far an image, or a sequence of images, is from the truth, and what it cost.

mod aim;
pub mod chart;
mod compare;
pub mod machine;
mod profile;
pub mod stress;
pub mod sweep;

pub use aim::Aim;
pub use compare::{Comparison, SequenceComparison, SequenceMeter, Texel, compare};
pub use profile::{PassProfile, Spread, profile};
