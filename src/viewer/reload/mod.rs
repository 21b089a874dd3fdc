//! Shaders are compiled again when their sources change: with the feature `dev`.
//!
//! ```text
//! files that changed ─► compiler, interface, pipelines (a thread) ─► renderers are made again
//! ```

mod compile;
mod interface;
mod sources;

use super::differences::Differences;
use super::display::{Display, FRAMES_IN_FLIGHT};
use super::present::Present;
use super::session::Session;
use super::sides;
use super::state::Severity;
use super::watch::Watch;
use compile::{Compiled, compile};
use nephroid::Result;
use nephroid::gpu::Context;
use sources::files;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{JoinHandle, spawn};

/// Names in a note, at most.
const MAX_NAMES: usize = 4;

/// The sources of the shaders that were built in.
pub fn built_from() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("glsl")
}

/// The sources of all shaders. Their compilation ends when they are dropped.
pub struct Shaders {
    folder: PathBuf,
    watch: Watch,
    /// Since all shaders on the device were compiled.
    changed: BTreeSet<PathBuf>,
    /// Whether that is to be compiled.
    is_stale: bool,
    compilation: Option<JoinHandle<Result<Compiled, String>>>,
    cancel: Arc<AtomicBool>,
    /// The message that the window shows, unless it was dismissed.
    error: Option<String>,
}

impl Shaders {
    /// Looks at the sources in a folder from now on.
    pub fn new(folder: &Path) -> Self {
        Self {
            folder: folder.to_owned(),
            watch: Watch::new(files(folder).into_iter()),
            changed: BTreeSet::new(),
            is_stale: false,
            compilation: None,
            cancel: Arc::default(),
            error: None,
        }
    }

    /// Compiles what changed on a thread; the outcome once it is there.
    fn follow(&mut self, context: &Arc<Context>) -> Option<Result<Compiled, String>> {
        let changed = self.watch.changed();
        if !changed.is_empty() {
            self.changed.extend(changed);
            self.watch.add(files(&self.folder).into_iter());
            self.is_stale = true;
            self.cancel.store(true, Ordering::Relaxed);
        }
        let finished = (self.compilation).take_if(|thread| thread.is_finished());
        let outcome = finished.map(|thread| {
            let failed = || Err("the shader compiler's thread has failed".to_owned());
            thread.join().unwrap_or_else(|_| failed())
        });
        if self.is_stale {
            // The outcome is of sources that are no more.
            if self.compilation.is_none() {
                self.is_stale = false;
                self.start(context.clone());
            }
            return None;
        }
        if let Some(Ok(_)) = outcome {
            self.changed.clear();
        }
        outcome
    }

    fn start(&mut self, context: Arc<Context>) {
        self.cancel = Arc::default();
        let (folder, changed, cancel) = (
            self.folder.clone(),
            self.changed.clone(),
            self.cancel.clone(),
        );
        self.compilation = Some(spawn(move || compile(&context, &folder, &changed, &cancel)));
    }
}

impl Drop for Shaders {
    fn drop(&mut self) {
        self.cancel.store(true, Ordering::Relaxed);
        if let Some(thread) = self.compilation.take() {
            // It uses the device.
            let _ = thread.join();
        }
    }
}

impl Session {
    /// Replaces shaders whose sources changed, or says why not.
    ///
    /// # Errors
    /// [`nephroid::Error::Device`] where the device fails.
    pub fn reload_shaders(&mut self) -> Result<()> {
        let Some(outcome) = self.shaders.follow(&self.display.context) else {
            return Ok(());
        };
        if let Some(last) = self.shaders.error.take() {
            self.state.messages.retain(|(_, text)| *text != last);
        }
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
            Err(message) => {
                self.state.tell(Severity::Error, message.clone());
                self.shaders.error = Some(message);
            }
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
