//! Passes the git commit to the program as `TETMILL_COMMIT`, empty if unknown.
//!
//! In a checkout the commit comes from git, in a published package from the file that cargo adds to
//! it.

use std::path::Path;
use std::process::Command;

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let package = std::env::var("CARGO_MANIFEST_DIR").expect("cargo sets it");
    let package = Path::new(&package);
    let commit = packaged(package).or_else(|| checked_out(package)).unwrap_or_default();
    println!("cargo::rustc-env=TETMILL_COMMIT={commit}");
}

/// The commit in `.cargo_vcs_info.json`, which only packages have: {"git": {"sha1": "…"}, …}.
fn packaged(package: &Path) -> Option<String> {
    let info = std::fs::read_to_string(package.join(".cargo_vcs_info.json")).ok()?;
    let commit = info.split("\"sha1\"").nth(1)?.split('"').nth(1)?;
    commit.get(..9).map(str::to_owned)
}

/// The commit of the checkout that the package is part of.
fn checked_out(package: &Path) -> Option<String> {
    // Sources without history can lie inside the checkout of another project, whose commit would be
    // wrong.
    let root = package.parent()?.canonicalize().ok()?;
    if Path::new(&git(package, &["rev-parse", "--show-toplevel"])?).canonicalize().ok()? != root {
        return None;
    }
    let commit = git(package, &["rev-parse", "--short=9", "HEAD"])?;
    // A commit changes the log of HEAD and the branch, which is a file or a line of `packed-refs`.
    // Without a branch it changes HEAD.
    let branch = git(package, &["rev-parse", "--symbolic-full-name", "HEAD"])?;
    for name in ["HEAD", "logs/HEAD", "packed-refs", &branch] {
        let Some(file) = git(package, &["rev-parse", "--git-path", name]) else { continue };
        let file = package.join(file);
        // A missing file would make cargo rerun this program at every build.
        if file.is_file() {
            println!("cargo::rerun-if-changed={}", file.display());
        }
    }
    Some(commit)
}

/// The line that git prints, or nothing if git is missing or fails.
fn git(folder: &Path, arguments: &[&str]) -> Option<String> {
    let output = Command::new("git").arg("-C").arg(folder).args(arguments).output().ok()?;
    let line = String::from_utf8(output.stdout).ok()?.trim().to_owned();
    (output.status.success() && !line.is_empty()).then_some(line)
}
