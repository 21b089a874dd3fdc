//! How fine the maps of direct light are.

use super::{Renderer, host};
use crate::error::Result;
use crate::render::receivers::surfaces::Halvings;

impl Renderer {
    /// Has direct light that is computed from the next update on halve the sides of its maps so often, for pictures in motion, whose
    /// time it would dominate. Maps keep the texels of light maps, and those with at most 256 texels along a side are not halved.
    /// Maps that show the scene in more detail are kept; coarser ones are computed again.
    pub fn set_direct_halvings(&mut self, halvings: u32) {
        self.direct_halvings = halvings;
    }

    /// Brings the tiles of the direct maps to the size that [`Renderer::set_direct_halvings`] asks for, in an update.
    pub(super) fn fit_direct_maps(&mut self) -> Result<()> {
        let wanted = self.direct_halvings;
        let now = self.scene.surfaces.halvings;
        let of_next =
            |is_current: bool, now: u32| if is_current { now.min(wanted) } else { wanted };
        let environment = of_next(self.is_environment_current, now.environment);
        let lights = of_next(self.is_direct_current, now.lights);
        let halvings = Halvings {
            lights,
            environment,
        };
        if halvings == now {
            return Ok(());
        }
        self.is_environment_current &= environment == now.environment;
        self.is_direct_current = false;
        let scene = &mut self.scene;
        let surfaces = &mut scene.surfaces;
        let (of, receivers, store) = (&scene.scene, &scene.receivers, &scene.geometry.store);
        // What is not written now, the next update writes.
        surfaces
            .set_halvings(&mut scene.staging, of, receivers, store, halvings)
            .inspect_err(|_| scene.is_stale = true)?;
        self.tiles = host::tiles(&self.scene);
        Ok(())
    }
}
