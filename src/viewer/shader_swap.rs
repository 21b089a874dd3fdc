//! Replaces the shaders of an open window by those that were compiled again: with the feature `dev`.

use super::differences::Differences;
use super::display::{Display, FRAMES_IN_FLIGHT};
use super::present::Present;
use super::reload::Compiled;
use super::session::Session;
use super::sides;
use super::state::Severity;
use nephroid::Result;

/// Names in a note, at most.
const MAX_NAMES: usize = 4;

impl Session {
    /// Replaces shaders whose sources changed, or says why not.
    ///
    /// # Errors
    /// [`nephroid::Error::Device`] where the device fails.
    pub fn reload_shaders(&mut self) -> Result<()> {
        let Some(outcome) = self.shaders.follow(&self.display.context) else {
            return Ok(());
        };
        (self.state.messages).retain(|(severity, _)| *severity != Severity::ShaderError);
        self.needs_frame = true;
        match outcome {
            Ok(compiled) => {
                let note = match compiled.names.as_slice() {
                    [] => return Ok(()),
                    few if few.len() <= MAX_NAMES => few.join(", "),
                    many => format!("{} shaders", many.len()),
                };
                self.display.replace_shaders(compiled)?;
                let scene = self.state.scene();
                sides::renew(&mut self.display, &mut self.state, &scene);
                self.render_again();
                self.state
                    .tell(Severity::Note, format!("compiled again: {note}"));
            }
            Err(message) => self.state.tell(Severity::ShaderError, message),
        }
        Ok(())
    }
}

impl Display {
    /// Uses these shaders for the passes of the window, and for renderers that are made from now on.
    fn replace_shaders(&mut self, compiled: Compiled) -> Result<()> {
        self.context.replace_shaders(compiled.of_renderer);
        if compiled.of_window.is_empty() {
            return Ok(());
        }
        self.host.wait_idle();
        self.host.newest_shaders.extend(compiled.of_window);
        let encodes = !self.swapchain.encodes_srgb();
        let format = self.swapchain.format.format;
        let present = Present::new(&self.host, format, encodes, FRAMES_IN_FLIGHT)?;
        std::mem::replace(&mut self.present, present).destroy(&self.host);
        if let Some(mut old) = self.differences.take() {
            old.destroy(&self.host);
            self.differences = Some(Differences::new(&self.host, FRAMES_IN_FLIGHT)?);
        }
        Ok(())
    }
}
