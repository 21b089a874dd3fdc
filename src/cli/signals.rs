//! Ctrl-C, SIGTERM and SIGHUP: a command stops by itself where it has something to keep, and is
//! stopped soon after where it does not.

use super::terminal::log;
use nephroid::gpu::{Progress, Watcher};
use nephroid::output::remove_temporary_files;
use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
use signal_hook::iterator::Signals;
use signal_hook::low_level;
use std::ops::ControlFlow;
use std::sync::atomic::{AtomicBool, AtomicI32, Ordering};
use std::thread;
use std::time::{Duration, Instant};

/// Becomes true at the first signal.
static CANCELLED: AtomicBool = AtomicBool::new(false);
/// The exit code for the signal that came.
static CODE: AtomicI32 = AtomicI32::new(130);

/// Logged when the program ends by a signal.
pub const STOPPED: &str = "stopped by Ctrl-C or a signal";

/// How long a command may take to stop by itself.
const GRACE: Duration = Duration::from_secs(1);

/// True once the user wants the program to stop.
pub fn cancelled() -> &'static AtomicBool {
    &CANCELLED
}

/// The exit code of a program that was stopped: 130 by Ctrl-C, 143 by SIGTERM and SIGHUP.
pub fn exit_code() -> u8 {
    CODE.load(Ordering::Relaxed) as u8
}

/// Listens from now on. Files are replaced whole and temporary ones removed, so that a stop leaves nothing
/// half-written.
pub fn listen() {
    let ends_at_once = |what: String, error| log("warning", &format!("{what} at once: {error}"));
    let mut signals = match Signals::new([] as [i32; 0]) {
        Ok(signals) => signals,
        Err(error) => return ends_at_once("signals end the program".into(), error),
    };
    for signal in [SIGINT, SIGTERM, SIGHUP] {
        if is_ignored(signal) {
            continue; // as under nohup
        }
        if let Err(error) = signals.add_signal(signal) {
            ends_at_once(format!("signal {signal} ends the program"), error);
        }
    }
    thread::spawn(move || {
        let Some(signal) = signals.forever().next() else {
            return;
        };
        let exit_code = match signal {
            SIGINT => 130,
            _ => 143,
        };
        CODE.store(exit_code, Ordering::Relaxed);
        CANCELLED.store(true, Ordering::Relaxed);
        thread::sleep(GRACE);
        remove_temporary_files();
        log("error", STOPPED);
        // Without the libraries' own handlers, which may wait for work that still runs.
        low_level::exit(exit_code);
    });
}

fn is_ignored(signal: i32) -> bool {
    // SAFETY: a query into memory of the right type, which is valid when it succeeds.
    unsafe {
        let mut action = std::mem::MaybeUninit::<libc::sigaction>::uninit();
        libc::sigaction(signal, std::ptr::null(), action.as_mut_ptr()) == 0
            && action.assume_init().sa_sigaction == libc::SIG_IGN
    }
}

/// Work that takes longer than this is shown.
const QUIET: Duration = Duration::from_secs(2);

/// Stops the renderer's work when the user wants to, and shows it if `shown` and it takes long.
pub fn watcher(shown: bool) -> Watcher {
    const STEPS: f64 = 1000.0;
    let start = Instant::now();
    let mut bar = None;
    Box::new(move |Progress { work, done }| {
        if shown && start.elapsed() > QUIET {
            let bar = bar.get_or_insert_with(|| super::terminal::progress_bar(STEPS as u64));
            bar.set_position((STEPS * done) as u64);
            bar.set_message(work);
        }
        match cancelled().load(Ordering::Relaxed) {
            true => ControlFlow::Break(()),
            false => ControlFlow::Continue(()),
        }
    })
}
