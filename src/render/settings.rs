//! What to compute and how finely.

/// How the caustic is computed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Method {
    /// Patches are imaged to footprints, which are added up.
    Footprint,
    /// Every texel gathers over all patches (Wand & Straßer 2003).
    Pinhole,
    /// Low-discrepancy points, one texel each.
    Points,
    /// Patches are drawn as triangles between their corners' mirrored rays.
    Beams,
}

impl Method {
    pub const ALL: [Self; 4] = [Self::Footprint, Self::Pinhole, Self::Points, Self::Beams];

    /// In reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::Footprint => "footprint",
            Self::Pinhole => "pinhole",
            Self::Points => "points",
            Self::Beams => "beams",
        }
    }
}

/// How `beams` compares the area of a patch with that of its image.
#[derive(Debug, Clone, Copy, PartialEq, Eq, serde::Serialize)]
#[serde(rename_all = "lowercase")]
pub enum Area {
    /// The area: the length of the sides' cross product.
    True,
    /// The product of the lengths of the derivatives by texel, `length(dFdx(x)) * length(dFdy(x))`,
    /// as is widespread. Right only where they are at right angles.
    Product,
}

impl Area {
    pub const ALL: [Self; 2] = [Self::True, Self::Product];

    /// In reports and on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Self::True => "true",
            Self::Product => "product",
        }
    }
}

/// What to compute and how finely.
#[derive(Debug, Clone)]
pub struct Settings {
    pub method: Method,
    /// Patches asked for on the mirrors' lit faces (at least one a triangle is made), or points.
    pub samples: u32,
    /// `footprint`: parts that an environment is cut into, at most; 8 or more are.
    pub sky_parts: u32,
    /// `footprint`: images of a part of an environment in a patch, about so many for every sample, times the
    /// environment's share of all light in the first frame.
    pub sky_images: u32,
    /// `pinhole`: ε of the form factor's d² + ε, in squared patch diameters.
    pub epsilon: f32,
    /// `pinhole`: blur the light by the patch's curvature.
    pub filter: bool,
    /// `beams`: what is taken for the area.
    pub area: Area,
    /// Frames that a host may have in flight: recorded and not yet waited for.
    pub frames_in_flight: u32,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            method: Method::Footprint,
            samples: 16_384,
            sky_parts: 4096,
            sky_images: 4,
            epsilon: 1.0,
            filter: true,
            area: Area::True,
            frames_in_flight: 1,
        }
    }
}
