//! How far an image, or a sequence of images, is from the truth.

mod compare;

pub use compare::{Comparison, SequenceComparison, SequenceMeter, Texel, compare};
