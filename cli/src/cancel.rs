//! Ctrl-C, SIGTERM and SIGHUP: the first signal stops a command cleanly, the second exits at once.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, LazyLock};

static CANCELLED: LazyLock<Arc<AtomicBool>> = LazyLock::new(Arc::default);

/// Exit status of an interrupted process, as shells report it.
pub const STATUS: u8 = 130;

/// Installs a handler for each signal whose action is the default one.
///
/// Signals that are ignored from the start remain ignored, as `nohup` and background jobs of
/// scripts want, and handlers of an embedding program are kept.
pub fn listen() {
    imp::listen(&CANCELLED);
}

/// Whether a signal was received.
pub fn is_cancelled() -> bool {
    CANCELLED.load(Ordering::Relaxed)
}

#[cfg(unix)]
mod imp {
    use signal_hook::consts::{SIGHUP, SIGINT, SIGTERM};
    use signal_hook::flag;
    use std::mem::MaybeUninit;
    use std::sync::Arc;
    use std::sync::atomic::AtomicBool;

    pub fn listen(cancelled: &Arc<AtomicBool>) {
        for signal in [SIGINT, SIGTERM, SIGHUP] {
            if !has_default_action(signal) {
                continue;
            }
            // Actions run in this order. Registering fails for signals that cannot be caught only.
            let _ = flag::register_conditional_shutdown(signal, super::STATUS.into(), cancelled.clone());
            let _ = flag::register(signal, cancelled.clone());
        }
    }

    /// Whether a signal is neither ignored nor handled.
    #[allow(unsafe_code)]
    fn has_default_action(signal: libc::c_int) -> bool {
        let mut action = MaybeUninit::<libc::sigaction>::zeroed();
        // SAFETY: without a new action the call only writes the present one, and all its fields may
        // be zero if the call fails.
        let action = unsafe {
            libc::sigaction(signal, std::ptr::null(), action.as_mut_ptr());
            action.assume_init()
        };
        action.sa_sigaction == libc::SIG_DFL
    }
}

#[cfg(not(unix))]
mod imp {
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};

    pub fn listen(cancelled: &Arc<AtomicBool>) {
        let cancelled = cancelled.clone();
        // Fails if a handler is installed already; that one is kept.
        let _ = ctrlc::try_set_handler(move || {
            if cancelled.swap(true, Ordering::Relaxed) {
                std::process::exit(super::STATUS.into());
            }
        });
    }
}
