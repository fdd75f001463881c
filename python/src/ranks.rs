//! The ranks of a mesh: threads of this process, or processes of an MPI job.
//!
//! Messages between processes go through mpi4py, so the package works with the MPI library that the
//! user's mpi4py was built for, and needs none itself.

use crate::error::Failure;
use crate::watch::{Call, Event, Stop, watched};
use pyo3::prelude::*;
use pyo3::types::{PyByteArray, PyBytes, PyTuple};
use std::ops::Deref;
use std::panic::{AssertUnwindSafe, catch_unwind, resume_unwind};
use std::sync::mpsc::{Sender, channel};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};
use tetmill::comm::{CommError, Communicator, Group, Rank};
use tetmill::progress::{Observer, Progress};

/// The ranks of a mesh.
pub type Ranks = Group<Processes>;

/// The processes of a communicator of mpi4py, as an object of the class `Processes` of the Python
/// half. Its operations do not raise: they end the job instead.
pub struct Processes {
    object: Py<PyAny>,
    rank: Rank,
    size: u32,
    /// During a run, the thread that called the library, which calls MPI for it.
    caller: Mutex<Option<Sender<Event>>>,
}

impl Processes {
    /// Takes an object of the class `Processes`.
    pub fn new(object: &Bound<'_, PyAny>) -> PyResult<Self> {
        let number = |name: &str| object.getattr(name)?.extract();
        let (rank, size) = (number("rank")?, number("size")?);
        Ok(Self { rank, size, object: object.clone().unbind(), caller: Mutex::default() })
    }

    /// Calls an operation of the Python half, and reads its result.
    ///
    /// # Panics
    /// If it raises.
    fn call<T>(
        &self,
        operation: &'static str,
        arguments: impl for<'py> FnOnce(Python<'py>) -> PyResult<Bound<'py, PyTuple>>,
        read: impl for<'py> FnOnce(Bound<'py, PyAny>) -> PyResult<T>,
    ) -> T {
        let given = Python::attach(|py| arguments(py).map(Bound::unbind));
        let result = given.and_then(|given| self.perform(operation, given));
        let value = result.and_then(|result| Python::attach(|py| read(result.into_bound(py))));
        value.unwrap_or_else(|error| panic!("mpi4py, {operation}: {error}"))
    }

    fn perform(&self, method: &'static str, arguments: Py<PyTuple>) -> PyResult<Py<PyAny>> {
        let caller = self.caller().clone();
        let Some(caller) = caller else {
            return Python::attach(|py| self.object.call_method1(py, method, arguments));
        };
        let (reply, result) = channel();
        let object = Python::attach(|py| self.object.clone_ref(py));
        let sent = caller.send(Event::Call(Call { object, method, arguments, reply }));
        sent.expect("the calling thread listens until the run has ended");
        result.recv().expect("the calling thread replies")
    }

    fn caller(&self) -> MutexGuard<'_, Option<Sender<Event>>> {
        self.caller.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Ends all processes of the job.
    fn end_job(&self) {
        self.call("end_job", |py| Ok(PyTuple::empty(py)), |_| Ok(()));
    }
}

/// A message from Python.
fn message(object: Bound<'_, PyAny>) -> PyResult<Vec<u8>> {
    Ok(object.cast::<PyByteArray>()?.to_vec())
}

/// Messages from Python, by rank.
fn messages(object: Bound<'_, PyAny>) -> PyResult<Vec<Vec<u8>>> {
    object.try_iter()?.map(|item| message(item?)).collect()
}

impl Communicator for Processes {
    fn rank(&self) -> Rank {
        self.rank
    }

    fn size(&self) -> u32 {
        self.size
    }

    fn barrier(&self) -> Result<(), CommError> {
        self.call("barrier", |py| Ok(PyTuple::empty(py)), |_| Ok(()));
        Ok(())
    }

    fn broadcast_bytes(&self, root: Rank, bytes: &mut Vec<u8>) -> Result<(), CommError> {
        *bytes = self.call("broadcast", |py| (root, PyBytes::new(py, bytes)).into_pyobject(py), message);
        Ok(())
    }

    fn gather_bytes(&self, root: Rank, bytes: &[u8]) -> Result<Vec<Vec<u8>>, CommError> {
        Ok(self.call("gather", |py| (root, PyBytes::new(py, bytes)).into_pyobject(py), messages))
    }

    fn all_gather_bytes(&self, bytes: &[u8]) -> Result<Vec<Vec<u8>>, CommError> {
        Ok(self.call("all_gather", |py| (PyBytes::new(py, bytes),).into_pyobject(py), messages))
    }

    fn all_gather_equal_bytes(&self, bytes: &[u8]) -> Result<Vec<u8>, CommError> {
        Ok(self.call("all_gather_equal", |py| (PyBytes::new(py, bytes),).into_pyobject(py), message))
    }

    fn scatter_bytes(&self, root: Rank, messages: Option<Vec<Vec<u8>>>) -> Result<Vec<u8>, CommError> {
        if self.rank == root {
            let given = messages.as_ref().expect("the root of a scatter gives the messages");
            assert_eq!(given.len(), self.size as usize, "rank {root} scatters one message to each rank");
        }
        let own = self.call(
            "scatter",
            |py| {
                let bytes = |message: &Vec<u8>| PyBytes::new(py, message);
                let given: Option<Vec<_>> = messages.as_ref().map(|given| given.iter().map(bytes).collect());
                (root, given).into_pyobject(py)
            },
            message,
        );
        Ok(own)
    }

    fn exchange_bytes(&self, messages: Vec<(Rank, Vec<u8>)>) -> Result<Vec<(Rank, Vec<u8>)>, CommError> {
        for (to, _) in &messages {
            assert!(*to < self.size, "rank {} names rank {to} of {}", self.rank, self.size);
        }
        let received = self.call(
            "exchange",
            |py| {
                let letter = |(to, bytes): &(Rank, Vec<u8>)| (*to, PyBytes::new(py, bytes));
                (messages.iter().map(letter).collect::<Vec<_>>(),).into_pyobject(py)
            },
            |received| {
                let letter = |item: Bound<'_, PyAny>| {
                    let (from, bytes): (Rank, Bound<'_, PyAny>) = item.extract()?;
                    Ok((from, message(bytes)?))
                };
                received.try_iter()?.map(|item| letter(item?)).collect()
            },
        );
        Ok(received)
    }
}

impl Deref for Processes {
    type Target = dyn Communicator;

    fn deref(&self) -> &Self::Target {
        self
    }
}

/// **Collective.** The conformance suite of communicators, for the tests.
#[pyfunction]
pub fn test_processes(py: Python<'_>, processes: &Bound<'_, PyAny>) -> PyResult<()> {
    let processes = Processes::new(processes)?;
    py.detach(|| tetmill::internals::conformance::conformance(&processes));
    Ok(())
}

/// **Collective** over the processes. Returns `mine` if no process has a failure, so that none
/// waits for one that has returned.
pub fn agree<T: Send>(py: Python<'_>, ranks: &Ranks, mine: Result<T, Failure>) -> PyResult<T> {
    let agreed = match ranks.processes() {
        Some(processes) => py.detach(|| processes.agree(mine)),
        None => mine,
    };
    agreed.map_err(|failure| failure.raise(py))
}

/// **Collective** over the processes. Runs `body` on each rank; returns the results of this
/// process's ranks, by rank, and the notes of rank 0. A panic ends all processes, which would wait
/// without end.
pub fn on_ranks<T: Send>(
    py: Python<'_>,
    ranks: &Ranks,
    progress: Option<&Py<PyAny>>,
    stop: &Arc<Stop>,
    body: impl Fn(&dyn Communicator, &Progress) -> Result<T, Failure> + Sync,
) -> PyResult<(Vec<T>, Vec<String>)> {
    watched(py, progress, stop, |watcher| {
        if let Some(processes) = ranks.processes() {
            *processes.caller() = Some(watcher.calls());
        }
        let run = || {
            ranks.run(|comm| {
                let others = watcher.others();
                let observer: &dyn Observer = if comm.rank() == 0 { watcher } else { &others };
                body(comm, &Progress::new(observer))
            })
        };
        let result = catch_unwind(AssertUnwindSafe(run)).unwrap_or_else(|panic| {
            if let Some(processes) = ranks.processes() {
                processes.end_job();
            }
            resume_unwind(panic)
        });
        if let Some(processes) = ranks.processes() {
            *processes.caller() = None;
        }
        result
    })
}
