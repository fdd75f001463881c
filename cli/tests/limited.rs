//! Runs the program with a time limit.

use std::path::Path;
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// Result of a run.
pub struct Ended {
    /// The exit status, `None` after the time limit or a signal.
    pub status: Option<i32>,
    pub seconds: f64,
    /// Everything that was written to standard error.
    pub messages: String,
}

impl Ended {
    /// The first line of the messages that is not a note.
    pub fn reason(&self) -> String {
        self.messages.lines().find(|line| line.starts_with("tetmill:")).unwrap_or_default().to_owned()
    }
}

/// Starts the program with arguments, and stops it after a while. Messages are kept in `log`.
pub fn run(arguments: impl FnOnce(&mut Command), log: &Path, patience: Duration) -> Ended {
    let mut command = Command::new(env!("CARGO_BIN_EXE_tetmill"));
    arguments(&mut command);
    command.stdout(Stdio::null()).stderr(std::fs::File::create(log).expect("the folder can be written to"));
    let mut child = command.spawn().expect("the program starts");
    let began = Instant::now();
    let status = loop {
        match child.try_wait().expect("the program can be waited for") {
            Some(status) => break status.code(),
            None if began.elapsed() > patience => {
                child.kill().expect("the program can be stopped");
                child.wait().expect("the program can be waited for");
                break None;
            }
            None => std::thread::sleep(Duration::from_millis(3)),
        }
    };
    let seconds = began.elapsed().as_secs_f64();
    Ended { status, seconds, messages: std::fs::read_to_string(log).expect("the log was written") }
}
