//! How fine the maps of direct light are.

use super::{Renderer, host};
use crate::error::Result;
use crate::render::receivers::surfaces::Halvings;

impl Renderer {
    /// Has direct light that is computed from the next frame on halve the sides of its maps so often, for pictures in motion, whose
    /// time it would dominate. Maps with at most 256 texels along a side are not halved; those of the environment are no finer than
    /// those of suns and lamps. Edges of shadows are found with fewer rays. Light maps of caustics keep their texels. Maps that show the
    /// scene in more detail are kept; coarser ones are computed again.
    pub fn set_direct_halvings(&mut self, halvings: u32) {
        self.direct_halvings = halvings;
    }

    /// Brings the tiles of the direct maps to the size that [`Renderer::set_direct_halvings`] asks for, before a frame that has them.
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
        let scene = &mut self.scene;
        let surfaces = &mut scene.surfaces;
        let (lights_change, environment_changes) = surfaces.set_halvings(halvings);
        self.is_environment_current &= !environment_changes;
        if !lights_change && !environment_changes {
            return Ok(());
        }
        self.is_direct_current = false;
        let (of, receivers, store) = (&scene.scene, &scene.receivers, &scene.geometry.store);
        // What is not written now, the next update writes.
        let written = surfaces.write(&mut scene.staging, of, receivers, store);
        scene.is_stale |= written.is_err();
        self.tiles = host::tiles(&self.scene);
        written
    }
}
