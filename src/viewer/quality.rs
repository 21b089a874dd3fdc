//! The quality of the picture, which both sides of a comparison share.

/// Stage of the first picture of a scene on a CPU, which comes soon and is replaced at once.
pub const DRAFT: u32 = 0;
/// Stage of pictures while something moves.
pub const MOTION: u32 = 1;
/// Last stage, up to which a still picture becomes finer.
pub const FINEST: u32 = 4;
/// Scale of the width and the height of a draft.
pub const DRAFT_SCALE: f32 = 0.5;

#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quality {
    /// Square root of the number of samples per pixel while something moves.
    pub antialias: u32,
    /// Whether a still picture becomes finer.
    pub refines: bool,
    /// Pixels of the picture per pixel of the window, on a side.
    pub resolution: f32,
    /// Pictures per second that dynamic resolution keeps; 0: off. It needs `refines`, by which a still picture gets its pixels back.
    pub frame_rate: f32,
    /// Factor on the sides of light maps.
    pub light_map_scale: f64,
}

impl Default for Quality {
    fn default() -> Self {
        Self {
            antialias: 1,
            refines: true,
            resolution: 1.0,
            frame_rate: 15.0,
            light_map_scale: 1.0,
        }
    }
}

impl Quality {
    /// Whether pictures have dynamic resolution while something moves.
    pub fn is_dynamic(&self) -> bool {
        self.refines && self.frame_rate > 0.0
    }

    /// Square root of the number of samples per pixel at a stage of refinement, and a factor on the error to aim for.
    pub fn stage(&self, stage: u32) -> (u32, f32) {
        match stage {
            DRAFT => (1, 8.0),
            MOTION => (self.antialias, 1.0),
            2 => (self.antialias.max(2), 1.0),
            3 => (self.antialias.max(2), 0.5),
            _ => (self.antialias.max(4), 0.25),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stages_never_get_coarser() {
        for antialias in 1..=4 {
            let quality = Quality {
                antialias,
                ..Quality::default()
            };
            for stage in DRAFT..FINEST {
                let [(side, factor), (next_side, next_factor)] =
                    [stage, stage + 1].map(|s| quality.stage(s));
                assert!(next_side >= side && next_factor <= factor);
            }
        }
    }
}
