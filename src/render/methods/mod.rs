//! methods: what footprints are compared with.

pub mod pinhole;
pub mod points;
