//! Folders of geometries, and of files that are not part of the repository.

use std::path::{Path, PathBuf};

/// The root of the workspace, for any of its packages.
fn root() -> &'static Path {
    let package = Path::new(env!("CARGO_MANIFEST_DIR"));
    if package.join("geometries").is_dir() {
        package
    } else {
        package.parent().expect("a member is in the root")
    }
}

/// The geometries of this repository, by name.
pub fn own_geometries() -> Vec<PathBuf> {
    geometries_in(&root().join("geometries"))
}

/// A geometry of this repository.
pub fn own(name: &str) -> PathBuf {
    root().join("geometries").join(name).with_extension("geo")
}

/// All `.geo` files of a folder, by name.
pub fn geometries_in(folder: &Path) -> Vec<PathBuf> {
    let entries = std::fs::read_dir(folder).expect("the folder can be read");
    let mut files: Vec<PathBuf> = entries
        .map(|entry| entry.expect("the folder can be read").path())
        .filter(|path| path.extension().is_some_and(|e| e == "geo"))
        .collect();
    files.sort();
    files
}

/// A path in the folder with NETGEN's tutorials and the independent checker.
///
/// The folder is beside the repository or given by `TETMILL_SHARED`. If it is missing, a message
/// says that the test is skipped.
pub fn shared(what: &str) -> Option<PathBuf> {
    let beside = root().join("../shared");
    let folder = std::env::var_os("TETMILL_SHARED").map_or(beside, PathBuf::from);
    let wanted = folder.join(what);
    if wanted.exists() {
        return Some(wanted);
    }
    eprintln!("SKIPPED: there is no {}", wanted.display());
    None
}
