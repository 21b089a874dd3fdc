//! methods: other ways to compute the caustic, for comparison with footprints.

pub mod pinhole;
pub mod points;
