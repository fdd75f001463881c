//! Classifies output paths: regular files are replaced, everything else is written through.

use std::fs::{self, Metadata};
use std::io;
use std::path::{Path, PathBuf};

/// Where the bytes of an output file go.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Destination {
    /// The standard output: the path is `-` or resolves to it, like `/dev/stdout`.
    Stdout,
    /// The standard error, like `/dev/stderr`.
    Stderr,
    /// A device, a FIFO or a socket. It is opened and written, never replaced.
    Stream(PathBuf),
    /// A regular file, or none yet. Symbolic links are followed: their targets are replaced, the
    /// links stay.
    File(PathBuf),
}

/// Limit for chains of links, as in Linux.
const MAX_LINKS: usize = 40;

impl Destination {
    /// Classifies a path.
    ///
    /// # Errors
    /// If symbolic links form a cycle.
    pub fn of(path: &Path) -> io::Result<Self> {
        if path == "-" {
            return Ok(Self::Stdout);
        }
        let mut place = path.to_path_buf();
        for _ in 0..MAX_LINKS {
            if let Some(open) = open_file(&place) {
                return Ok(open);
            }
            let Ok(to) = fs::read_link(&place) else { return Ok(Self::at(place)) };
            place = parent(&place).join(to);
        }
        Err(io::Error::other("symbolic links lead in a circle"))
    }

    fn at(place: PathBuf) -> Self {
        let is_stream = fs::metadata(&place).is_ok_and(|found| !found.is_file() && !found.is_dir());
        if is_stream { Self::Stream(place) } else { Self::File(place) }
    }
}

/// Links in `/proc` and `/dev/fd` are files that a process has open. They are written through even
/// if they are regular files, because that process would not see a new file of the same name.
fn open_file(place: &Path) -> Option<Destination> {
    let folder = fs::canonicalize(parent(place)).ok()?;
    let own = fs::canonicalize("/dev/fd").is_ok_and(|own| own == folder);
    match place.file_name()?.to_str()? {
        "1" if own => Some(Destination::Stdout),
        "2" if own => Some(Destination::Stderr),
        _ if own || folder.starts_with("/proc") => Some(Destination::Stream(place.to_path_buf())),
        _ => None,
    }
}

/// The folder of a path.
pub(super) fn parent(path: &Path) -> &Path {
    path.parent().filter(|parent| !parent.as_os_str().is_empty()).unwrap_or(Path::new("."))
}

/// Whether two outputs, or an output and an input, are the same file under any names, including
/// links, hard links and `./`. A character device such as `/dev/null` accepts any number of
/// outputs.
pub fn is_same_place(a: &Path, b: &Path) -> bool {
    let (Ok(a), Ok(b)) = (Destination::of(a), Destination::of(b)) else { return a == b };
    match (&a, &b) {
        (Destination::File(a) | Destination::Stream(a), Destination::File(b) | Destination::Stream(b)) => {
            let found = [a, b].map(|path| fs::metadata(path).ok());
            match &found {
                [Some(a), Some(b)] if is_character_device(a) && is_character_device(b) => false,
                [Some(a), Some(b)] if same_inode(a, b) => true,
                _ => canonical(a) == canonical(b),
            }
        }
        _ => a == b,
    }
}

/// The path without links; the file itself may not exist.
fn canonical(path: &Path) -> PathBuf {
    let there = |path: &Path| fs::canonicalize(path).or_else(|_| std::path::absolute(path));
    there(path)
        .ok()
        .filter(|_| path.exists())
        .or_else(|| Some(there(parent(path)).ok()?.join(path.file_name()?)))
        .unwrap_or_else(|| path.to_path_buf())
}

#[cfg(unix)]
fn is_character_device(found: &Metadata) -> bool {
    use std::os::unix::fs::FileTypeExt;
    found.file_type().is_char_device()
}

#[cfg(unix)]
pub(super) fn same_inode(a: &Metadata, b: &Metadata) -> bool {
    use std::os::unix::fs::MetadataExt;
    (a.dev(), a.ino()) == (b.dev(), b.ino())
}

#[cfg(not(unix))]
fn is_character_device(_: &Metadata) -> bool {
    false
}

/// Not available on this system: paths are compared instead.
#[cfg(not(unix))]
pub(super) fn same_inode(_: &Metadata, _: &Metadata) -> bool {
    false
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;
    use std::os::unix::fs::symlink;

    #[test]
    fn links_lead_to_files_there_or_not_yet() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        fs::write(at("file"), "").unwrap();
        symlink("file", at("link")).unwrap();
        symlink("link", at("second")).unwrap();
        symlink("nothing", at("dangling")).unwrap();
        for (name, target) in [("file", "file"), ("second", "file"), ("dangling", "nothing")] {
            assert_eq!(Destination::of(&at(name)).unwrap(), Destination::File(at(target)), "{name}");
        }
        symlink("loop", at("loop")).unwrap();
        assert!(Destination::of(&at("loop")).is_err());
    }

    #[test]
    fn devices_and_open_files_are_written_through() {
        assert_eq!(Destination::of(Path::new("-")).unwrap(), Destination::Stdout);
        assert_eq!(Destination::of(Path::new("/dev/stdout")).unwrap(), Destination::Stdout);
        assert_eq!(Destination::of(Path::new("/dev/stderr")).unwrap(), Destination::Stderr);
        let null = PathBuf::from("/dev/null");
        assert_eq!(Destination::of(&null).unwrap(), Destination::Stream(null));
    }

    #[test]
    fn one_file_under_two_names_is_one_place() {
        let dir = tempfile::tempdir().unwrap();
        let at = |name: &str| dir.path().join(name);
        fs::create_dir(at("sub")).unwrap();
        fs::write(at("file"), "").unwrap();
        fs::hard_link(at("file"), at("hard")).unwrap();
        symlink("file", at("link")).unwrap();
        symlink("sub", at("folder")).unwrap();
        for name in ["hard", "link", "sub/../file", "./file"] {
            assert!(is_same_place(&at(name), &at("file")), "{name}");
        }
        assert!(is_same_place(&at("sub/new"), &at("folder/new")), "also what is not there yet");
        assert!(!is_same_place(&at("new"), &at("file")) && !is_same_place(&at("new"), &at("newer")));
        assert!(is_same_place(Path::new("-"), Path::new("/dev/stdout")));
        assert!(!is_same_place(Path::new("/dev/null"), Path::new("/dev/null")), "it takes any number");
    }
}
