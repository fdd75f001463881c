//! Runs of the library: with progress, exceptions of callbacks, and Ctrl-C.

use crate::command;
use crate::error::Failure;
use pyo3::exceptions::PyKeyboardInterrupt;
use pyo3::prelude::*;
use pyo3::types::PyTuple;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, Sender, channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread;
use std::time::{Duration, Instant};
use tetmill::comm::thread::POOL_STACK;
use tetmill::progress::{Observer, Stage};

/// Interval at which Python looks for signals such as Ctrl-C.
const PERIOD: Duration = Duration::from_millis(100);

/// Stops a run with the exception of a callback.
#[derive(Default)]
pub struct Stop {
    stopped: AtomicBool,
    exception: Mutex<Option<PyErr>>,
}

impl Stop {
    /// Stops the run. The first exception is kept.
    pub fn raise(&self, exception: PyErr) {
        let mut first = self.exception.lock().unwrap_or_else(PoisonError::into_inner);
        first.get_or_insert(exception);
        self.stopped.store(true, Ordering::Relaxed);
    }

    /// Whether the run was stopped.
    pub fn is_set(&self) -> bool {
        self.stopped.load(Ordering::Relaxed)
    }

    fn take(&self) -> Option<PyErr> {
        self.exception.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

/// A message from the run to the thread that called it.
pub enum Event {
    Progress(Stage, f64),
    Note(String),
    Call(Call),
}

/// A method to be called in the thread that called the library, which is the only one that may call
/// MPI if MPI was initialised for one thread (`MPI_THREAD_FUNNELED`, as PETSc does).
pub struct Call {
    pub object: Py<PyAny>,
    pub method: &'static str,
    pub arguments: Py<PyTuple>,
    pub reply: Sender<PyResult<Py<PyAny>>>,
}

impl Call {
    fn perform(self, py: Python<'_>, stop: &Stop) {
        let result = self.object.call_method1(py, self.method, self.arguments);
        // Ctrl-C does not end an operation in the middle: see the class `Processes`.
        match self.object.call_method0(py, "take_interrupt").and_then(|taken| taken.is_truthy(py)) {
            Ok(true) => stop.raise(PyKeyboardInterrupt::new_err(())),
            Ok(false) => {}
            Err(exception) => stop.raise(exception),
        }
        // The run waits for the reply.
        let _ = self.reply.send(result);
    }
}

/// Receives the progress of a run on rank 0.
pub struct Watcher {
    events: Sender<Event>,
    has_progress: bool,
    stop: Arc<Stop>,
}

impl Watcher {
    fn send(&self, event: Event) {
        // The calling thread listens until the run has ended.
        let _ = self.events.send(event);
    }

    fn progress(&self, stage: Stage, fraction: f64) {
        if self.has_progress {
            self.send(Event::Progress(stage, fraction));
        }
    }

    /// Where methods are sent that the calling thread is to call.
    pub fn calls(&self) -> Sender<Event> {
        self.events.clone()
    }

    /// The observer of ranks other than 0.
    pub fn others(&self) -> Others<'_> {
        Others(&self.stop)
    }
}

impl Observer for Watcher {
    fn begin(&self, stage: Stage) {
        self.progress(stage, 0.0);
    }

    fn advance(&self, stage: Stage, fraction: f64) {
        // The end reports 1.
        if fraction < 1.0 {
            self.progress(stage, fraction);
        }
    }

    fn end(&self, stage: Stage, _: f64) {
        self.progress(stage, 1.0);
    }

    fn note(&self, text: &str) {
        self.send(Event::Note(text.to_owned()));
    }

    fn is_cancelled(&self) -> bool {
        self.stop.is_set()
    }
}

/// The observer of ranks other than 0, which can only be cancelled.
pub struct Others<'a>(&'a Stop);

impl Observer for Others<'_> {
    fn is_cancelled(&self) -> bool {
        self.0.is_set()
    }
}

/// Runs `work` in a thread of its own, without the interpreter's lock, and returns its result and
/// its notes.
///
/// Meanwhile the calling thread passes the progress to the callback and looks for signals: Python
/// handles Ctrl-C in its main thread only.
pub fn watched<T: Send>(
    py: Python<'_>,
    progress: Option<&Py<PyAny>>,
    stop: &Arc<Stop>,
    work: impl FnOnce(&Watcher) -> Result<T, Failure> + Send,
) -> PyResult<(T, Vec<String>)> {
    command::ready()?;
    let (result, notes) = py.detach(|| {
        let (events, received) = channel();
        let watcher = Watcher { events, has_progress: progress.is_some(), stop: Arc::clone(stop) };
        thread::scope(|scope| {
            // The watcher is dropped with the closure, which ends the loop of `listen`: no other
            // sender outlives it.
            let run = move || work(&watcher);
            let builder = thread::Builder::new().name("tetmill".into()).stack_size(POOL_STACK);
            let worker = builder.spawn_scoped(scope, run)?;
            let notes = listen(&received, progress, stop);
            Ok::<_, std::io::Error>((worker.join(), notes))
        })
    })?;
    // An exception counts more than what the run made of being cancelled.
    if let Some(exception) = stop.take() {
        return Err(exception);
    }
    match result {
        Ok(Ok(value)) => Ok((value, notes)),
        Ok(Err(failure)) => Err(failure.raise(py)),
        Err(panic) => std::panic::resume_unwind(panic),
    }
}

/// Passes events on until the run has ended; returns its notes.
fn listen(received: &Receiver<Event>, progress: Option<&Py<PyAny>>, stop: &Stop) -> Vec<String> {
    let mut notes = Vec::new();
    let mut looked = Instant::now();
    let mut last = (Stage::Read, 0.0);
    loop {
        match received.recv_timeout(PERIOD.saturating_sub(looked.elapsed())) {
            Ok(Event::Note(note)) => notes.push(note),
            Ok(Event::Call(call)) => Python::attach(|py| call.perform(py, stop)),
            // Reports of several threads may overtake each other.
            Ok(Event::Progress(stage, fraction))
                if stage == last.0 && 0.0 < fraction && fraction < last.1 => {}
            Ok(Event::Progress(stage, fraction)) => {
                last = (stage, fraction);
                if let Some(callback) = progress.filter(|_| !stop.is_set()) {
                    let called = Python::attach(|py| callback.call1(py, (stage.name(), fraction)).map(drop));
                    called.unwrap_or_else(|exception| stop.raise(exception));
                }
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => return notes,
        }
        if looked.elapsed() >= PERIOD {
            Python::attach(|py| py.check_signals()).unwrap_or_else(|exception| stop.raise(exception));
            looked = Instant::now();
        }
    }
}
