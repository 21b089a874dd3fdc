//! Compiles shaders again when their sources change: with the feature `dev`.
//!
//! ```text
//! files that changed ─► compiler ─► interface ─► pipelines, on a thread ─► shader_swap.rs
//! ```

mod compile;
mod interface;
mod sources;

use super::watch::Watch;
pub use compile::Compiled;
use compile::compile;
use nephroid::gpu::{Context, DRIVER_STACK};
use sources::files;
use std::collections::BTreeSet;
use std::path::{Path, PathBuf};
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

/// How often the sources are looked at, of which there are many.
const EVERY: Duration = Duration::from_secs(2);

/// The sources of the shaders that were built in.
pub fn built_from() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("glsl")
}

/// The sources of all shaders. Their compilation ends when they are dropped.
pub struct Shaders {
    folder: PathBuf,
    watch: Watch,
    /// When the sources were last looked at.
    looked: Instant,
    /// Since all shaders on the device were compiled.
    changed: BTreeSet<PathBuf>,
    /// Whether that is to be compiled.
    is_stale: bool,
    compilation: Option<JoinHandle<Result<Compiled, String>>>,
    cancel: Arc<AtomicBool>,
}

impl Shaders {
    /// Looks at the sources in a folder from now on.
    pub fn new(folder: &Path) -> Self {
        Self {
            folder: folder.to_owned(),
            watch: Watch::new(files(folder).into_iter()),
            looked: Instant::now(),
            changed: BTreeSet::new(),
            is_stale: false,
            compilation: None,
            cancel: Arc::default(),
        }
    }

    /// Compiles what changed on a thread; the outcome once it is there.
    pub fn follow(&mut self, context: &Arc<Context>) -> Option<Result<Compiled, String>> {
        let mut changed = Vec::new();
        if self.looked.elapsed() >= EVERY {
            self.looked = Instant::now();
            changed = self.watch.changed();
        }
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
        let thread = Builder::new().stack_size(DRIVER_STACK);
        let spawned = thread.spawn(move || compile(&context, &folder, &changed, &cancel));
        self.compilation = Some(spawned.expect("the system has room for a thread"));
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
