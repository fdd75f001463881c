//! Version, shell completions and manual pages.

use crate::common::{succeed, tetmill};
use std::collections::BTreeSet;
use std::path::Path;
use std::process::{Command, Stdio};

/// The standard output of a successful run.
fn printed(arguments: &[&str]) -> String {
    String::from_utf8(succeed(tetmill().args(arguments)).stdout).expect("text")
}

/// The commands listed by the help.
fn commands() -> BTreeSet<String> {
    let help = printed(&["--help"]);
    let listed = help.lines().skip_while(|line| *line != "Commands:").skip(1);
    let commands =
        listed.take_while(|line| !line.is_empty()).filter_map(|line| line.split_whitespace().next());
    commands.filter(|command| *command != "help").map(str::to_owned).collect()
}

#[test]
fn the_version_has_the_commit_and_the_features() {
    let version = concat!("tetmill ", env!("CARGO_PKG_VERSION"));
    assert_eq!(printed(&["-V"]).trim_end(), version);
    let long = printed(&["--version"]);
    let (first, features) = long.trim_end().split_once('\n').expect("two lines");
    let yes_or_no = |yes| if yes { "yes" } else { "no" };
    let (metis, mpi) = (yes_or_no(cfg!(feature = "metis")), yes_or_no(cfg!(feature = "mpi")));
    assert_eq!(features, format!("features: metis {metis}, mpi {mpi}"));
    let rest = first.strip_prefix(version).expect("the version comes first");
    if rest.is_empty() {
        return;
    }
    let commit = rest.strip_prefix(" (commit ").and_then(|rest| rest.strip_suffix(')')).expect(rest);
    assert!(commit.len() >= 9 && commit.chars().all(|c| c.is_ascii_hexdigit()), "{commit}");
}

#[test]
fn a_build_in_a_checkout_knows_its_commit() {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    let git = |arguments: &[&str]| Command::new("git").arg("-C").arg(package).args(arguments).output();
    let is_checkout =
        package.join("../.git").exists() && git(&["rev-parse", "HEAD"]).is_ok_and(|o| o.status.success());
    if !is_checkout {
        eprintln!("SKIPPED: no checkout, or no git");
        return;
    }
    let version = printed(&["--version"]);
    let commit = version.split(['(', ')']).nth(1).and_then(|text| text.strip_prefix("commit "));
    // The commit may be older than the checkout.
    succeed(Command::new("git").arg("-C").arg(package).args(["cat-file", "-e", commit.expect(&version)]));
}

#[test]
fn completion_scripts_know_all_commands() {
    for shell in ["bash", "elvish", "fish", "powershell", "zsh"] {
        let script = printed(&["completions", shell]);
        for command in commands() {
            assert!(script.contains(&command), "{shell} does not complete `{command}`");
        }
    }
    assert_eq!(tetmill().args(["completions", "no-shell"]).output().unwrap().status.code(), Some(2));
}

#[test]
fn bash_accepts_its_completion_script() {
    let dir = tempfile::tempdir().unwrap();
    let script = dir.path().join("tetmill.bash");
    std::fs::write(&script, printed(&["completions", "bash"])).unwrap();
    match Command::new("bash").arg("-n").arg(&script).output() {
        Ok(output) => assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr)),
        Err(_) => eprintln!("SKIPPED: there is no bash"),
    }
}

#[test]
fn each_command_has_a_manual_page() {
    let dir = tempfile::tempdir().unwrap();
    let folder = dir.path().join("share/man1");
    succeed(tetmill().arg("man").arg(&folder));
    let entries =
        std::fs::read_dir(&folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap());
    let mut expected: BTreeSet<String> = commands().iter().map(|name| format!("tetmill-{name}.1")).collect();
    expected.insert("tetmill.1".into());
    assert_eq!(entries.collect::<BTreeSet<_>>(), expected);
    for name in expected {
        let page = std::fs::read_to_string(folder.join(&name)).unwrap();
        let title = format!(".TH {} 1 ", name.trim_end_matches(".1"));
        assert!(page.contains(&title) && page.contains(".SH SYNOPSIS"), "{name}:\n{page}");
    }
    let page = std::fs::read_to_string(folder.join("tetmill.1")).unwrap();
    assert_eq!(page, printed(&["man"]));
}

#[test]
fn a_folder_for_pages_that_cannot_be_made_is_reported() {
    let dir = tempfile::tempdir().unwrap();
    let file = dir.path().join("file");
    std::fs::write(&file, "").unwrap();
    let output = tetmill().arg("man").arg(file.join("man1")).output().unwrap();
    assert_eq!(output.status.code(), Some(4));
    assert!(String::from_utf8_lossy(&output.stderr).contains("man1"));
}

#[test]
fn a_reader_that_stops_early_is_no_error() {
    let mut command = tetmill();
    let mut child = command.args(["completions", "zsh"]).stdout(Stdio::piped()).spawn().unwrap();
    drop(child.stdout.take());
    assert!(child.wait().unwrap().success());
}

#[test]
fn the_citation_has_the_version_of_the_program() {
    let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../CITATION.cff");
    let citation = std::fs::read_to_string(file).unwrap();
    assert!(citation.contains(&format!("\nversion: {}\n", env!("CARGO_PKG_VERSION"))), "{citation}");
}
