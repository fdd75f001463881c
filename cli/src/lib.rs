//! The command `tetmill` as a library: other programs can run it with their own arguments.
//!
//! ```no_run
//! let status = tetmill_cli::run(["tetmill", "generate", "part.geo", "--levels", "2"]);
//! # let _: std::process::ExitCode = status;
//! ```
//!
//! The library `tetmill` does all meshing. This crate has the options, the printed texts and the
//! exit statuses.
#![deny(unsafe_code)]

mod cancel;
mod commands;
mod failure;
mod options;
pub mod report;
mod terminal;

use clap::Parser;
use options::{Cli, Command};
use std::ffi::OsString;
use std::process::ExitCode;

/// The exit status if memory or disk space run out.
///
/// [`run`] returns it where it can. An allocator can end a program with it if memory runs out, as
/// that of the program `tetmill` does.
pub const OUT_OF_MEMORY: u8 = failure::Status::Resources as u8;

/// Runs the command and returns its exit status, 0 on success. `tetmill help COMMAND` lists the
/// others.
///
/// The first argument is the name of the program. Results go to the standard output, messages to
/// the standard error.
pub fn run(arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> ExitCode {
    ExitCode::from(status(arguments))
}

/// [`run`] with the exit status as a number, for programs that do not end with it.
pub fn status(arguments: impl IntoIterator<Item = impl Into<OsString> + Clone>) -> u8 {
    let cli = match Cli::try_parse_from(arguments) {
        Ok(cli) => cli,
        Err(error) => {
            // A closed standard error cannot be reported anywhere.
            let _ = error.print();
            return error.exit_code() as u8;
        }
    };
    cancel::listen();
    let done = match cli.command {
        Command::Decompose(options) => commands::on_one_rank(|| commands::run_decompose(&options)),
        Command::Generate(options) => commands::run_generate(&options),
        Command::Mesh(options) => commands::on_one_rank(|| commands::run_mesh(&options)),
        Command::Repartition(options) => commands::run_repartition(&options),
        Command::View(options) => commands::run_view(&options),
        Command::Inspect(options) => commands::on_one_rank(|| commands::run_inspect(&options)),
        Command::Check(options) => commands::on_one_rank(|| commands::run_check(&options)),
        Command::Quality(options) => commands::on_one_rank(|| commands::run_quality(&options)),
        Command::Completions(options) => commands::on_one_rank(|| commands::run_completions(&options)),
        Command::Man(options) => commands::on_one_rank(|| commands::run_man(&options)),
    };
    match done {
        Ok(()) => 0,
        Err(failure) => {
            if !failure.message.is_empty() {
                eprintln!("tetmill: {failure}");
            }
            failure.status as u8
        }
    }
}
