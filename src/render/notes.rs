//! Notes for users on what a renderer leaves out or does not estimate.

use super::caustic::Caustic;
use super::diagnostics;
use super::view::overlay::has_content;
use super::{Method, Renderer};

impl Renderer {
    /// Notes for the user: light that is left out, errors that are not estimated and overlays that are empty, each with the reason.
    pub fn notes(&self) -> Vec<String> {
        let mut notes = Vec::new();
        if !self.scene.geometry.can_occlude {
            let note =
                "no rays are traced for the caustic: nothing in the scene can block its light";
            notes.push(note.into());
        }
        let environment_counts =
            matches!(self.settings.method, Method::Footprint | Method::Pinhole);
        if self.scene.environment.casts_caustics && !environment_counts {
            let note = "the environment casts no caustic, and its light does not pass through water: the \
                 methods footprint and pinhole compute both";
            notes.push(note.into());
        } else if self.scene.scene.specular_objects().next().is_none() {
            let note = "no caustic: nothing in the scene reflects or refracts light";
            notes.push(note.into());
        }
        if self.may_chain() {
            match self.settings.method {
                Method::Pinhole | Method::Beams => notes.push(
                    "light that meets several mirrors or interfaces is left out: the methods footprint and points \
                     follow it"
                        .into(),
                ),
                _ => {}
            }
        }
        if self.settings.budget.is_some() && self.budget.is_none() {
            let note = "the time is not held: only suns and lamps on planar receivers take less time at a larger error";
            notes.push(note.into());
        }
        if self.caustic.has_even_patches() {
            notes.extend(self.scene.casters.note(self.settings.samples));
        }
        if let (Some(_), Caustic::Splat { projectors, .. }) = (self.settings.error, &self.caustic)
            && !projectors.is_empty()
        {
            let parts = [
                (self.scene.receivers.mesh_count() > 0, "light on meshes"),
                (
                    self.scene.environment.pairs.is_some(),
                    "light of the environment",
                ),
            ];
            let parts: Vec<&str> = (parts.into_iter())
                .filter_map(|(is_there, part)| is_there.then_some(part))
                .collect();
            notes.push(format!(
                "no error is estimated: the error to aim for is that of suns and lamps on planar receivers, and {} samples are taken for {}",
                self.settings.samples,
                parts.join(" and "),
            ));
        }
        for &overlay in &self.shown {
            if !has_content(overlay, &self.scene, &self.caustic) {
                notes.push(format!(
                    "the overlay `{}` is empty: this scene has nothing that it shows with the method {}",
                    overlay.name(),
                    self.settings.method.name(),
                ));
            }
        }
        // Light may continue from its first surface to any other.
        if !self.may_chain() {
            notes.extend(diagnostics::sentences(&self.scene, environment_counts));
        }
        notes
    }
}
