//! The stages that compute a caustic.

use crate::render::chains::Chains;
use crate::render::methods::pinhole::Pinhole;
use crate::render::methods::points::Points;
use crate::render::patches::sample::Sample;
use crate::render::splat::projector::Projector;
use crate::render::splat::resolve::Resolve;
use crate::render::splat::triangles::Triangles;

/// The stages of a method.
pub enum Caustic {
    Splat {
        /// For the projectors.
        sample: Option<Sample>,
        triangles: Option<Box<Triangles>>,
        chains: Option<Box<Chains>>,
        projectors: Vec<Projector>,
        resolve: Option<Resolve>,
    },
    Gather {
        sample: Sample,
        pinhole: Pinhole,
    },
    Points(Points),
}
