//! Status codes, and the last error of each thread.

use std::any::Any;
use std::cell::RefCell;
use std::ffi::{CString, c_char};
use std::fmt::Display;
use std::panic::{AssertUnwindSafe, catch_unwind};
use tetmill::Error;
use tetmill::comm::CommError;
use tetmill::error::{ErrorKind, HasKind, RequestError};

/// What a function returns. Codes from 2 on are the exit statuses of the command.
#[repr(C)]
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Status {
    /// The call succeeded.
    Ok = 0,
    /// The call is wrong: a null pointer, an index out of range, an unknown option.
    Usage = 1,
    /// The input or the request is invalid. Other input or other settings help.
    Input = 2,
    /// No valid mesh could be made.
    NoMesh = 3,
    /// Memory, disk space, or the range of ids is insufficient.
    Resources = 4,
    /// A rank failed, or ranks cannot communicate.
    Rank = 5,
    /// A bug of the library. The handles of the call must not be used again, only freed.
    Internal = 6,
    /// A callback cancelled the run.
    Cancelled = 130,
}

impl From<ErrorKind> for Status {
    fn from(kind: ErrorKind) -> Self {
        match kind {
            ErrorKind::Input => Self::Input,
            ErrorKind::NoMesh => Self::NoMesh,
            ErrorKind::Resources => Self::Resources,
            ErrorKind::Rank => Self::Rank,
            ErrorKind::Cancelled => Self::Cancelled,
        }
    }
}

/// Why a call fails.
#[derive(Debug)]
pub struct Fault {
    status: Status,
    text: String,
    /// Whether another rank has the original error.
    is_elsewhere: bool,
}

impl Fault {
    /// A wrong call.
    pub fn usage(text: impl Into<String>) -> Self {
        Self { status: Status::Usage, text: text.into(), is_elsewhere: false }
    }

    /// An invalid request.
    pub fn input(text: impl Into<String>) -> Self {
        Self { status: Status::Input, text: text.into(), is_elsewhere: false }
    }

    /// An error of the library.
    pub fn of(error: &impl HasKind) -> Self {
        Self { status: error.kind().into(), text: error.to_string(), is_elsewhere: error.is_elsewhere() }
    }

    fn of_panic(panic: &(dyn Any + Send)) -> Self {
        let reason = panic.downcast_ref::<String>().map(String::as_str);
        let reason = reason.or(panic.downcast_ref::<&str>().copied()).unwrap_or("no message");
        Self {
            status: Status::Internal,
            text: format!("a bug of tetmill, please report it: {reason}"),
            is_elsewhere: false,
        }
    }
}

impl Display for Fault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str(&self.text)
    }
}

/// So that ranks can agree on it.
impl HasKind for Fault {
    fn kind(&self) -> ErrorKind {
        match self.status {
            Status::Ok | Status::Usage | Status::Input => ErrorKind::Input,
            Status::NoMesh => ErrorKind::NoMesh,
            Status::Resources => ErrorKind::Resources,
            Status::Rank | Status::Internal => ErrorKind::Rank,
            Status::Cancelled => ErrorKind::Cancelled,
        }
    }

    fn is_elsewhere(&self) -> bool {
        self.is_elsewhere
    }
}

impl From<CommError> for Fault {
    fn from(error: CommError) -> Self {
        Self::of(&error)
    }
}

/// Names the option of this interface where it differs from the name in the library.
impl From<Error> for Fault {
    fn from(error: Error) -> Self {
        let hint = match &error {
            Error::Request(RequestError::Option { name, .. }) => match *name {
                "max_size" => "; the option is maxh",
                "min_size" => "; the options are minh and maxh",
                "coarse_tets" => "; the option is coarse",
                _ => "",
            },
            _ => "",
        };
        let mut fault = Self::of(&error);
        fault.text += hint;
        fault
    }
}

thread_local! {
    static LAST: RefCell<(Status, CString)> = RefCell::new((Status::Ok, CString::default()));
}

/// A C string; NUL characters inside become blanks.
pub fn c_string(text: &str) -> CString {
    CString::new(text.replace('\0', " ")).expect("NUL characters were replaced")
}

/// Runs the body of a call: keeps its error, or the panic, as the last error of the thread.
pub fn guard(body: impl FnOnce() -> Result<(), Fault>) -> Status {
    let result = catch_unwind(AssertUnwindSafe(body));
    match result.unwrap_or_else(|panic| Err(Fault::of_panic(&*panic))) {
        Ok(()) => Status::Ok,
        Err(fault) => {
            LAST.with_borrow_mut(|last| *last = (fault.status, c_string(&fault.text)));
            fault.status
        }
    }
}

/// The text of the last error of this thread, one sentence or several lines; empty if there was
/// none.
///
/// Valid until the next call of this thread that fails. Calls that succeed do not change it.
#[unsafe(no_mangle)]
pub extern "C" fn tetmill_last_error() -> *const c_char {
    LAST.with_borrow(|last| last.1.as_ptr())
}

/// The code of the last error of this thread; TETMILL_STATUS_OK if there was none.
#[unsafe(no_mangle)]
pub extern "C" fn tetmill_last_status() -> Status {
    LAST.with_borrow(|last| last.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::CStr;

    #[test]
    fn a_panic_becomes_an_internal_error_with_its_message() {
        let quiet = std::panic::take_hook();
        std::panic::set_hook(Box::new(|_| ()));
        let status = guard(|| panic!("edge {} has no tet", 7));
        std::panic::set_hook(quiet);
        assert_eq!((status, tetmill_last_status()), (Status::Internal, Status::Internal));
        // SAFETY: a C string of this thread, which no later call has changed.
        let text = unsafe { CStr::from_ptr(tetmill_last_error()) };
        assert!(text.to_str().unwrap().ends_with("edge 7 has no tet"), "{text:?}");
    }

    #[test]
    fn each_thread_has_its_own_last_error() {
        assert_eq!(guard(|| Err(Fault::usage("here"))), Status::Usage);
        let other = std::thread::spawn(|| tetmill_last_status()).join().unwrap();
        assert_eq!((other, tetmill_last_status()), (Status::Ok, Status::Usage));
        assert_eq!(guard(|| Ok(())), Status::Ok);
        assert_eq!(tetmill_last_status(), Status::Usage);
    }
}
