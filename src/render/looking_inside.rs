//! What a renderer shows of its work: overlays of pictures, and counts of frames.

use crate::error::Result;
use crate::render::Renderer;
use crate::render::frame_counts::{Counter, FrameCounts};
use crate::render::view::overlay::{Overlay, Overlays};
use crate::render::view::overlay_frame;
use crate::scene::Camera;

impl Renderer {
    /// Draws these overlays over the next pictures, whether recorded or blocking. They are part of the picture, in colours that
    /// its exposure leaves as they are, and cost nothing while there are none. Where a method has no patches, splats or cells,
    /// their overlay is empty.
    pub fn set_overlays(&mut self, overlays: &[Overlay]) {
        self.shown = (Overlay::ALL.into_iter())
            .filter(|overlay| overlays.contains(overlay))
            .collect();
    }

    /// Makes the stages of the overlays that are to be shown, and drops those that are not. Returns whether there are new ones.
    pub(super) fn prepare_overlays(&mut self) -> Result<bool> {
        let shown = self.overlays.as_ref().map_or(&[][..], |own| &own.shown);
        if shown == self.shown {
            return Ok(false);
        }
        self.drop_overlays();
        if !self.shown.is_empty() {
            let (scene, caustic) = (&mut self.scene, &self.caustic);
            let made = Overlays::new(&self.context, scene, caustic, &self.shown)?;
            self.context.compile_pipelines()?;
            self.overlays = Some(made);
        }
        Ok(!self.shown.is_empty())
    }

    /// The overlays are bound to buffers of a caustic that is replaced, or are no longer shown.
    pub(super) fn drop_overlays(&mut self) {
        if let Some(replaced) = self.overlays.take() {
            self.keep(replaced);
        }
    }

    /// Starts or stops counting what a host's frames consist of, at the end of each frame.
    pub fn count_frames(&mut self, on: bool) {
        let frames = self.settings.frames_in_flight.max(1) as usize;
        match (&mut self.counter, on) {
            (Some(counter), _) => counter.is_on = on,
            (none, true) => *none = Some(Counter::new(frames)),
            (None, false) => {}
        }
    }

    /// The counts of the latest frame that is no longer in flight, if it was counted and not taken yet.
    pub fn take_counts(&mut self) -> Option<FrameCounts> {
        self.counts.take()
    }

    /// Reads the counts of the host's frame before those in flight, which has ended.
    pub(super) fn read_counts(&mut self) {
        let Some(counter) = &mut self.counter else {
            return;
        };
        self.counts = counter.begin();
        if !counter.is_on && counter.is_idle() {
            self.counter = None;
        }
    }

    pub(super) fn record_counts(&mut self) -> Result<()> {
        let (scene, caustic) = (&self.scene, &self.caustic);
        match &mut self.counter {
            Some(counter) if counter.is_on => {
                counter.record(&self.context, &mut self.recorder, scene, caustic)
            }
            _ => Ok(()),
        }
    }

    pub(super) fn record_overlays(&mut self, camera: &Camera) -> Result<()> {
        let (Some(overlays), Some(view)) = (&self.overlays, &self.view) else {
            return Ok(());
        };
        let (recorder, scene, caustic) = (&mut self.recorder, &self.scene, &self.caustic);
        overlay_frame::overlays(recorder, scene, caustic, overlays, view, camera)
    }
}
