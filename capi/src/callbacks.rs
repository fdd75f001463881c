//! Functions of the caller that a run calls.

use crate::fault::{Fault, c_string};
use std::ffi::{c_char, c_int, c_void};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, PoisonError};
use tetmill::Point;
use tetmill::progress::{Observer, Stage};

/// The largest element size (length) at a place; `user` is the pointer that was set with it.
///
/// Called very often, by several threads at the same time. 0 and infinity are no limit. A negative
/// value or NaN ends the run with TETMILL_STATUS_INPUT. Must return: no exception, no longjmp.
pub type SizeCallback = Option<unsafe extern "C" fn(xyz: *const f64, user: *mut c_void) -> f64>;

/// Reports the progress of a stage, from 0 to 1; returns 0 to continue, another value to cancel.
///
/// Called by several threads at the same time; `stage` is valid during the call. Must return: no
/// exception, no longjmp.
pub type ProgressCallback =
    Option<unsafe extern "C" fn(stage: *const c_char, fraction: f64, user: *mut c_void) -> c_int>;

/// Asks whether to cancel the run: 0 to continue, another value to cancel.
///
/// Called often, by several threads at the same time. Must return: no exception, no longjmp.
pub type CancelCallback = Option<unsafe extern "C" fn(user: *mut c_void) -> c_int>;

/// A callback with the caller's pointer.
#[derive(Clone, Copy, Debug)]
pub struct Callback<F> {
    function: F,
    user: *mut c_void,
}

// SAFETY: the header requires callbacks to accept calls from any thread with this pointer, at the
// same time; the library itself does not look at what it points to.
unsafe impl<F> Send for Callback<F> {}
// SAFETY: the same.
unsafe impl<F> Sync for Callback<F> {}

impl<F> Callback<F> {
    /// `None` if there is no function.
    pub fn new(function: Option<F>, user: *mut c_void) -> Option<Self> {
        function.map(|function| Self { function, user })
    }
}

pub type Size = Callback<unsafe extern "C" fn(*const f64, *mut c_void) -> f64>;
impl Size {
    fn at(&self, xyz: [f64; 3]) -> f64 {
        // SAFETY: a function of the caller with the pointer that it expects.
        unsafe { (self.function)(xyz.as_ptr(), self.user) }
    }
}

pub type OnProgress = Callback<unsafe extern "C" fn(*const c_char, f64, *mut c_void) -> c_int>;
pub type IsCancelled = Callback<unsafe extern "C" fn(*mut c_void) -> c_int>;

/// The first wrong value of a size function.
#[derive(Debug, Default)]
pub struct Refusal {
    is_there: AtomicBool,
    text: Mutex<Option<String>>,
}

impl Refusal {
    fn add(&self, text: String) {
        let mut first = self.text.lock().unwrap_or_else(PoisonError::into_inner);
        first.get_or_insert(text);
        self.is_there.store(true, Ordering::Release);
    }

    /// An error if there was a wrong value.
    pub fn check(&self) -> Result<(), Fault> {
        let first = self.text.lock().unwrap_or_else(PoisonError::into_inner);
        first.as_ref().map_or(Ok(()), |text| Err(Fault::input(text.clone())))
    }
}

/// A size function for the library, which refuses wrong values.
pub fn size_function(size: Size, refusal: Arc<Refusal>) -> impl Fn(Point) -> f64 + Send + Sync + 'static {
    move |point| {
        let xyz = [point.x, point.y, point.z];
        let value = size.at(xyz);
        if value.is_nan() || value < 0.0 {
            let [x, y, z] = xyz;
            refusal.add(format!(
                "the size function returned {value} at ({x}, {y}, {z}): possible are positive numbers; 0 is no limit"
            ));
            return 0.0;
        }
        value
    }
}

/// Passes the progress to the callbacks, and cancels if they want it or a size is wrong.
pub struct Watch {
    pub progress: Option<OnProgress>,
    pub cancel: Option<IsCancelled>,
    pub refusal: Arc<Refusal>,
    pub cancelled: AtomicBool,
}

impl Watch {
    fn report(&self, stage: Stage, fraction: f64) {
        let Some(OnProgress { function, user }) = self.progress else { return };
        let name = c_string(stage.name());
        // SAFETY: a function of the caller with the pointer that it expects; the name lives on.
        if unsafe { function(name.as_ptr(), fraction, user) } != 0 {
            self.cancelled.store(true, Ordering::Relaxed);
        }
    }
}

impl Observer for Watch {
    fn begin(&self, stage: Stage) {
        self.report(stage, 0.0);
    }

    fn advance(&self, stage: Stage, fraction: f64) {
        self.report(stage, fraction);
    }

    fn end(&self, stage: Stage, _: f64) {
        self.report(stage, 1.0);
    }

    fn is_cancelled(&self) -> bool {
        if self.refusal.is_there.load(Ordering::Acquire) || self.cancelled.load(Ordering::Relaxed) {
            return true;
        }
        let Some(IsCancelled { function, user }) = self.cancel else { return false };
        // SAFETY: a function of the caller with the pointer that it expects.
        let cancelled = unsafe { function(user) } != 0;
        // Once true, it stays true.
        self.cancelled.fetch_or(cancelled, Ordering::Relaxed) || cancelled
    }
}
