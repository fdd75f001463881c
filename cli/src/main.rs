//! The command `tetmill`: from solid geometry to partitioned tetrahedral meshes, in parallel.

mod allocator;

#[global_allocator]
static ALLOCATOR: allocator::Allocator = allocator::Allocator::new();

fn main() -> std::process::ExitCode {
    allocator::return_what_is_freed();
    ALLOCATOR.set_aside();
    report_full_files();
    tetmill_cli::run(std::env::args_os())
}

/// Makes a write beyond the limit on file sizes (`ulimit -f`) an error with a message; by default
/// the signal SIGXFSZ ends the process.
fn report_full_files() {
    #[cfg(unix)]
    // SAFETY: no other thread runs yet, and the disposition has no handler.
    unsafe {
        libc::signal(libc::SIGXFSZ, libc::SIG_IGN);
    }
}
