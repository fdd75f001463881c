//! The command `tetmill`: from solid geometry to partitioned tetrahedral meshes, in parallel.

fn main() -> std::process::ExitCode {
    tetmill_cli::run(std::env::args_os())
}
