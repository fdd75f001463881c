//! Version, manual pages and shell completions.

use super::{show, write_whole};
use crate::failure::{Failure, Status};
use crate::options::{Cli, Completions, Man};
use clap::CommandFactory;
use std::sync::LazyLock;

/// The text of `tetmill --version`: version, git commit if known, and optional features of the
/// build.
pub fn long_version() -> &'static str {
    static TEXT: LazyLock<String> = LazyLock::new(|| {
        let commit = match env!("TETMILL_COMMIT") {
            "" => String::new(),
            commit => format!(" (commit {commit})"),
        };
        let [metis, mpi] = [cfg!(feature = "metis"), cfg!(feature = "mpi")].map(yes_or_no);
        format!("{}{commit}\nfeatures: metis {metis}, mpi {mpi}", env!("CARGO_PKG_VERSION"))
    });
    &TEXT
}

fn yes_or_no(yes: bool) -> &'static str {
    if yes { "yes" } else { "no" }
}

/// `tetmill completions`
pub fn run_completions(options: &Completions) -> Result<(), Failure> {
    // Into memory first: clap panics if a reader such as `head` closes the pipe.
    let mut script = Vec::new();
    clap_complete::generate(options.shell, &mut Cli::command(), "tetmill", &mut script);
    show(format_args!("{}", String::from_utf8_lossy(&script)))
}

/// `tetmill man`
pub fn run_man(options: &Man) -> Result<(), Failure> {
    // The pages must not depend on the commit or the features.
    let mut program = Cli::command().long_version(None::<&str>).disable_help_subcommand(true);
    // Gives the commands their full names, such as tetmill-generate.
    program.build();
    let Some(directory) = &options.directory else {
        return show(format_args!("{}", page(program).1));
    };
    std::fs::create_dir_all(directory).map_err(|error| {
        Failure::new(Status::Resources, format!("cannot make the folder {}: {error}", directory.display()))
    })?;
    let commands: Vec<_> = program.get_subcommands().cloned().collect();
    for command in commands.into_iter().chain([program]) {
        let (name, text) = page(command);
        write_whole(&directory.join(name), &text)?;
    }
    Ok(())
}

/// The file name and text of a manual page.
fn page(command: clap::Command) -> (String, String) {
    let man = clap_mangen::Man::new(command)
        .source(concat!("tetmill ", env!("CARGO_PKG_VERSION")))
        .manual("tetmill manual");
    let mut text = Vec::new();
    man.render(&mut text).expect("writing to memory");
    (man.get_filename(), String::from_utf8_lossy(&text).into_owned())
}
