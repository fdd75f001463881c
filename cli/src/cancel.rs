//! Ctrl-C and SIGTERM: the first signal stops a command cleanly, the second exits at once.

use std::process;
use std::sync::atomic::{AtomicBool, Ordering};

static CANCELLED: AtomicBool = AtomicBool::new(false);

/// Exit status of an interrupted process, as shells report it.
pub const STATUS: u8 = 130;

/// Installs the signal handler, unless the embedding program has one.
pub fn listen() {
    let handler = || {
        if CANCELLED.swap(true, Ordering::Relaxed) {
            process::exit(STATUS.into());
        }
    };
    // Fails if a handler is installed already; that one is kept.
    let _ = ctrlc::try_set_handler(handler);
}

/// Whether a signal was received.
pub fn is_cancelled() -> bool {
    CANCELLED.load(Ordering::Relaxed)
}
