//! The command `tetmill`: from solid geometry to partitioned tetrahedral meshes, in parallel.

mod cli;
mod commands;

use clap::Parser;
use cli::{Cli, Command};
use std::process::ExitCode;

fn main() -> ExitCode {
    let done = match Cli::parse().command {
        Command::Decompose(options) => commands::run_decompose(&options),
        Command::Generate(options) => commands::run_generate(&options),
        Command::Mesh(options) => commands::run_mesh(&options),
        Command::Repartition(options) => commands::run_repartition(&options),
        Command::Inspect(options) => commands::run_inspect(&options),
        Command::Check(options) => commands::run_check(&options),
        Command::Quality(options) => commands::run_quality(&options),
    };
    match done {
        Ok(()) => ExitCode::SUCCESS,
        Err(failure) => {
            if !failure.message.is_empty() {
                eprintln!("tetmill: {failure}");
            }
            ExitCode::from(failure.status as u8)
        }
    }
}
