//! The settings of a renderer: method, resolution and options.

use std::time::Duration;

/// The method that computes the caustic.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Every patch projects the lights onto the receivers as splats, which are added up.
    Footprint,
    /// Every texel gathers light over all patches (Wand & Straßer 2003).
    Pinhole,
    /// Low-discrepancy points are traced to one texel each.
    Points,
    /// Patches are drawn as triangles between their corners' outgoing rays.
    Beams,
}

impl Method {
    pub const ALL: [Self; 4] = [Self::Footprint, Self::Pinhole, Self::Points, Self::Beams];

    /// The name in reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Footprint => "footprint",
            Self::Pinhole => "pinhole",
            Self::Points => "points",
            Self::Beams => "beams",
        }
    }
}

/// The area of the image of a patch, for `beams`.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Area {
    /// The true area: the length of the sides' cross product.
    True,
    /// The product of the lengths of the derivatives by texel, `length(dFdx(x)) * length(dFdy(x))`. This approximation
    /// is widespread, but correct only where the derivatives are perpendicular.
    Product,
}

impl Area {
    pub const ALL: [Self; 2] = [Self::True, Self::Product];

    /// The name in reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::True => "true",
            Self::Product => "product",
        }
    }
}

/// Relative L1 error that programs with an error to aim for have by default.
pub const DEFAULT_ERROR: f32 = 0.02;

/// What is expected of the error where the cautious estimate, by which patches are chosen, is 1: the median of true error over that
/// estimate at targets of 5, 2 and 1 % on the receivers of shipped scenes and of 20 random ones (`src/method.md`).
pub const EXPECTED_ERROR: f32 = 0.6;

/// Method, resolution and options.
#[derive(Debug, Clone)]
pub struct Settings {
    pub method: Method,
    /// Number of patches to aim for on the casters' lit triangles (at least one per triangle), or number of points.
    pub samples: u32,
    /// `footprint`: relative L1 error to aim for on planar receivers under suns and lamps. It replaces `samples` there: the
    /// device chooses the number of patches in every frame. `None`: `samples` applies there, too. [`super::Renderer::caustic`]
    /// enlarges the buffers if more patches are needed; frames of a host do not.
    pub error: Option<f32>,
    /// `footprint`: time that [`super::Renderer::update`] and [`super::Renderer::caustic`] may take together. It replaces
    /// `error`: a [`super::FrameBudget`] chooses the error again after every frame. Frames of a host are not timed: the
    /// host sets `error` and calls [`super::Renderer::set_error`] before every frame.
    pub budget: Option<Duration>,
    /// `footprint`: maximum number of environment cells (at least 8).
    pub environment_cells: u32,
    /// `footprint`: pairs of environment cell and patch cluster per sample. The number is scaled by the environment's
    /// share of all light in the first frame.
    pub environment_images: u32,
    /// `pinhole`: ε of the form factor's d² + ε, in squared patch diameters.
    pub epsilon: f32,
    /// `pinhole`: whether the light is blurred by the curvature of the patch.
    pub filter: bool,
    /// `beams`: the area of the image of a patch.
    pub area: Area,
    /// Maximum number of a host's frames in flight, which are recorded but not yet waited for.
    pub frames_in_flight: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            method: Method::Footprint,
            samples: 16_384,
            error: None,
            budget: None,
            environment_cells: 4096,
            environment_images: 4,
            epsilon: 1.0,
            filter: true,
            area: Area::True,
            frames_in_flight: 1,
        }
    }
}
