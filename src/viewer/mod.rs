//! `nephroid view`: a window on a scene.
//!
//! The window is a host of the library, like any other: it makes the device, calls
//! [`nephroid::render::Renderer::record`], and shows the picture. It computes no light itself.
//!
//! ```text
//! input, script ─► panels ─► state ─► display ─► renderer, then present
//! ```

mod app;
mod bindings;
mod capture;
mod compare;
mod compare_panel;
mod controls;
mod cover;
mod dialogs;
mod differences;
mod display;
mod document;
mod dynamic_resolution;
mod edits;
mod handles;
mod host;
#[cfg(feature = "dev")]
mod loss;
mod orbit;
mod overlay_panel;
mod panels;
mod pick;
mod playback;
mod player;
mod present;
mod profiler;
mod profiler_panel;
mod quality;
mod reference;
#[cfg(feature = "dev")]
mod reload;
mod report;
mod save;
mod screenshot;
mod script;
mod session;
#[cfg(feature = "dev")]
mod shader_swap;
mod side;
mod sides;
mod slot;
mod state;
mod stats;
mod stretch;
mod swapchain;
mod target;
mod technique;
mod technique_panel;
mod toml_writer;
mod upload;
mod watch;
mod widgets;

pub use app::Options;
#[cfg(feature = "dev")]
pub use reload::built_from;
pub use report::Report;
pub use script::Script;
pub use technique::{Aim, Technique};

use nephroid::Result;
use std::time::Instant;
use winit::event_loop::EventLoop;

/// Opens the window and shows the scene until it is closed or the script ends; `start` is when the program was started.
///
/// # Errors
/// [`nephroid::Error::Input`] where the scene cannot be used, [`nephroid::Error::Window`] where there is no display,
/// [`nephroid::Error::NoDevice`] where there is no device, [`nephroid::Error::Device`] where it is lost.
pub fn run(options: Options, start: Instant) -> Result<Option<Report>> {
    let mut app = app::App::new(options, start)?;
    let mut builder = EventLoop::builder();
    // The program runs on a thread of its own, whose stack is large enough for drivers.
    #[cfg(target_os = "linux")]
    winit::platform::x11::EventLoopBuilderExtX11::with_any_thread(&mut builder, true);
    #[cfg(windows)]
    winit::platform::windows::EventLoopBuilderExtWindows::with_any_thread(&mut builder, true);
    let event_loop = builder.build().map_err(|error| {
        host::no_window(
            format!("there is no display: {}", host::plain(&error)),
            "run in a graphical session (on Linux with DISPLAY or WAYLAND_DISPLAY set), or use `nephroid render`",
        )
    })?;
    let ended = event_loop.run_app(&mut app);
    let report = app.finish()?;
    ended.map_err(|error| {
        host::no_window(
            format!("the display is gone: {}", host::plain(&error)),
            "start again",
        )
    })?;
    Ok(report)
}
