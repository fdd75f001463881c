//! The allocator of the program. If memory runs out, it ends the program with the documented
//! status.
//!
//! By default Rust aborts, and the process ends with status 134. The allocator may not panic, so
//! nothing is unwound: an unfinished staging folder remains, and the next run removes it.

use std::alloc::{GlobalAlloc, Layout, System};
use std::io::Write;
use std::ptr;
use std::sync::atomic::{AtomicBool, AtomicPtr, Ordering};
use std::time::Duration;
use tetmill::comm::mpi;
use tetmill::memory::allocation_may_fail;
use tetmill_cli::OUT_OF_MEMORY;

/// Memory set aside for MPI, which allocates while it ends a job. Larger than the threshold above
/// which `malloc` returns freed memory to the system, so that it counts towards a limit no more.
const RESERVE: Layout = match Layout::from_size_align(4 << 20, 16) {
    Ok(layout) => layout,
    Err(_) => panic!("16 is a power of two"),
};

/// Time for the thread that ends the program; other threads that fail wait for that long.
const PATIENCE: Duration = Duration::from_secs(2);

/// Makes `malloc` of glibc return large freed blocks to the system. By default it raises the size
/// of what it returns with each of them, up to 32 MiB, and keeps a fifth of the memory of a large
/// mesh between blocks in use.
pub fn return_what_is_freed() {
    #[cfg(all(target_os = "linux", target_env = "gnu"))]
    {
        /// Smaller blocks (bytes) are kept for the next.
        const LARGE: libc::c_int = 1 << 20;
        // SAFETY: no other thread runs yet.
        unsafe {
            libc::mallopt(libc::M_MMAP_THRESHOLD, LARGE);
            libc::mallopt(libc::M_TRIM_THRESHOLD, LARGE);
        }
    }
}

/// The system's allocator, except that a failed allocation ends the program.
pub struct Allocator {
    reserve: AtomicPtr<u8>,
    ending: AtomicBool,
}

impl Allocator {
    /// Creates the allocator, without a reserve.
    pub const fn new() -> Self {
        Self { reserve: AtomicPtr::new(ptr::null_mut()), ending: AtomicBool::new(false) }
    }

    /// Sets memory aside for the end. Without it, MPI may be unable to end the job.
    pub fn set_aside(&self) {
        // SAFETY: the layout has a size.
        self.reserve.store(unsafe { System.alloc(RESERVE) }, Ordering::Relaxed);
    }

    /// Returns what the system allocated, or ends the program if that is nothing.
    fn checked(&self, memory: *mut u8, bytes: usize) -> *mut u8 {
        if memory.is_null() && !allocation_may_fail() {
            self.end(bytes);
        }
        memory
    }

    #[cold]
    fn end(&self, bytes: usize) -> ! {
        if self.ending.swap(true, Ordering::Relaxed) {
            std::thread::sleep(PATIENCE);
            exit();
        }
        let reserve = self.reserve.swap(ptr::null_mut(), Ordering::Relaxed);
        if !reserve.is_null() {
            // SAFETY: allocated by `set_aside`, with this layout.
            unsafe { System.dealloc(reserve, RESERVE) };
        }
        report(bytes);
        mpi::end_job(OUT_OF_MEMORY.into());
        exit()
    }
}

// SAFETY: all memory comes from and returns to `System`, with the caller's layouts; nothing here
// unwinds.
unsafe impl GlobalAlloc for Allocator {
    unsafe fn alloc(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promise.
        self.checked(unsafe { System.alloc(layout) }, layout.size())
    }

    unsafe fn alloc_zeroed(&self, layout: Layout) -> *mut u8 {
        // SAFETY: the caller's promise.
        self.checked(unsafe { System.alloc_zeroed(layout) }, layout.size())
    }

    unsafe fn realloc(&self, memory: *mut u8, layout: Layout, bytes: usize) -> *mut u8 {
        // SAFETY: the caller's promise.
        self.checked(unsafe { System.realloc(memory, layout, bytes) }, bytes)
    }

    unsafe fn dealloc(&self, memory: *mut u8, layout: Layout) {
        // SAFETY: the caller's promise.
        unsafe { System.dealloc(memory, layout) }
    }
}

/// Prints the message from a buffer on the stack.
fn report(bytes: usize) {
    let mut text = [0; 256];
    let mut rest = &mut text[..];
    // A longer message would be cut off.
    let _ = writeln!(
        rest,
        "tetmill: out of memory: {bytes} bytes could not be allocated; take fewer levels or tets, or more machines, \
         or raise the limit of the process (`ulimit`) if it has one"
    );
    let unused = rest.len();
    let text = &text[..text.len() - unused];
    // Without the lock of the standard library, which the failed thread may hold.
    #[cfg(unix)]
    // SAFETY: the text is initialised memory of this length.
    let _ = unsafe { libc::write(libc::STDERR_FILENO, text.as_ptr().cast(), text.len()) };
    #[cfg(not(unix))]
    let _ = std::io::stderr().write_all(text);
}

/// Ends the process without exit handlers, which may allocate or wait for a stopped thread.
fn exit() -> ! {
    #[cfg(unix)]
    // SAFETY: ends the process.
    unsafe {
        libc::_exit(OUT_OF_MEMORY.into())
    }
    #[cfg(not(unix))]
    std::process::exit(OUT_OF_MEMORY.into())
}
