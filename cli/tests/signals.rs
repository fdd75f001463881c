//! SIGTERM ends a run, also if other signals are ignored, as under `nohup` and in background jobs.

use crate::common::{own, tetmill};
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

/// A run that writes for long, of a shell that ignores some signals.
fn start(ignored: &str, out: &Path) -> Child {
    let script = format!("trap '' {ignored}; exec \"$@\"");
    let shell = if ignored.is_empty() { "exec \"$@\"" } else { &script };
    let mut command = Command::new("sh");
    command.args(["-c", shell, "sh"]).arg(tetmill().get_program()).arg("generate").arg(own("dome"));
    command.args(["-n", "2", "-e", "3e6", "-f", "vtu", "-q", "-t", "2", "-o"]).arg(out);
    command.stderr(Stdio::null()).spawn().expect("there is a shell")
}

fn send(signal: &str, run: &Child) {
    let done = Command::new("kill").args([&format!("-{signal}"), &run.id().to_string()]).status();
    assert!(done.expect("there is kill").success());
}

/// Waits until files are in the staging folder.
fn wait_for_files(out: &Path, run: &mut Child) {
    let start = Instant::now();
    let has_files = |folder: &Path| fs::read_dir(folder).is_ok_and(|mut files| files.next().is_some());
    loop {
        let staging = fs::read_dir(out).into_iter().flatten().flatten();
        if staging.map(|entry| entry.path()).any(|path| path.is_dir() && has_files(&path)) {
            return;
        }
        assert_eq!(run.try_wait().unwrap(), None, "the run has ended");
        assert!(start.elapsed() < Duration::from_secs(120));
        sleep(Duration::from_millis(5));
    }
}

#[test]
fn sigterm_ends_a_run_without_traces_whatever_is_ignored() {
    // Tests can run in the background or under `nohup` themselves, where others have no effect.
    for ignored in ["", "INT", "INT HUP"] {
        let folder = tempfile::tempdir().unwrap();
        let out = folder.path().join("out");
        fs::create_dir(&out).unwrap();
        let mut run = start(ignored, &out);
        wait_for_files(&out, &mut run);
        for signal in ignored.split_whitespace() {
            send(signal, &run);
        }
        sleep(Duration::from_millis(50));
        assert_eq!(run.try_wait().unwrap(), None, "{ignored}: ignored");
        send("TERM", &run);
        assert_eq!(run.wait().unwrap().code(), Some(130), "{ignored}");
        let left: Vec<_> = fs::read_dir(&out).unwrap().map(|entry| entry.unwrap().file_name()).collect();
        assert!(left.is_empty(), "{left:?}");
    }
}
