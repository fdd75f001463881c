//! Tests of replaced files, failures and kills.

use super::stage::{Outdated, Stage};
use super::*;
use crate::files::testing::together;
use crate::ground::comm::CommError;

fn is_part(name: &str) -> bool {
    name.starts_with("part.")
}

/// Writes as a single rank.
fn alone(dir: &Path, write: impl Fn(&Path) -> Result<(), WriteError> + Sync) -> Result<(), WriteError> {
    together(1, |comm| write_together(comm, dir, 10, is_part, &write)).remove(0)
}

/// Writes DIR/mesh.names and DIR/partitioning.1/part.1.nodes.
fn write_mesh(dir: &Path, text: &str) -> Result<(), WriteError> {
    alone(dir, |stage| {
        write_text(&stage.join("mesh.names"), text.as_bytes())?;
        fs::create_dir(stage.join("partitioning.1")).unwrap();
        write_text(&stage.join("partitioning.1/part.1.nodes"), text.as_bytes())?;
        Ok(())
    })
}

fn names(dir: &Path) -> Vec<String> {
    entries(dir).unwrap().into_iter().map(|p| p.to_str().unwrap().to_string()).collect()
}

#[test]
fn new_files_replace_old_ones_and_leave_all_others_alone() {
    let dir = tempfile::tempdir().unwrap();
    let target = dir.path().join("a/mesh");
    write_mesh(&target, "old").unwrap();
    fs::write(target.join("case.sif"), "mine").unwrap();
    fs::write(target.join("partitioning.1/results.1"), "mine").unwrap();
    fs::write(target.join("partitioning.1/part.2.nodes"), "of a mesh that is no more").unwrap();
    write_mesh(&target, "new").unwrap();
    assert_eq!(names(&target), ["case.sif", "mesh.names", "partitioning.1"]);
    assert_eq!(names(&target.join("partitioning.1")), ["part.1.nodes", "results.1"]);
    assert_eq!(fs::read_to_string(target.join("mesh.names")).unwrap(), "new");
    assert_eq!(fs::read_to_string(target.join("partitioning.1/part.1.nodes")).unwrap(), "new");
}

#[test]
fn a_failure_leaves_the_old_files_and_nothing_new() {
    let dir = tempfile::tempdir().unwrap();
    let target = dir.path().join("mesh");
    let fail = |target: &Path| {
        alone(target, |stage| {
            write_text(&stage.join("mesh.names"), b"half")?;
            Output::create(&stage.join("no/such/folder")).map(drop)
        })
    };
    let error = fail(&target).unwrap_err().to_string();
    assert!(error.contains("no/such/folder"), "{error}");
    assert!(!target.exists(), "a target that was not there is not left behind");

    write_mesh(&target, "old").unwrap();
    fail(&target).unwrap_err();
    assert_eq!(names(&target), ["mesh.names", "partitioning.1"]);
    assert_eq!(fs::read_to_string(target.join("mesh.names")).unwrap(), "old");
}

#[test]
fn a_failure_on_one_rank_is_an_error_on_all_and_leaves_nothing() {
    let dir = tempfile::tempdir().unwrap();
    let target = dir.path().join("mesh");
    let errors = together(3, |comm| {
        let write = |stage: &Path| match comm.rank() {
            1 => Err(WriteError::EmptyPart(2)),
            rank => write_text(&stage.join(format!("part.{rank}")), b"half"),
        };
        write_together(comm, &target, 10, is_part, write).unwrap_err()
    });
    assert!(matches!(errors[1], WriteError::EmptyPart(2)));
    for error in [&errors[0], &errors[2]] {
        assert!(matches!(error, WriteError::Comm(CommError::Elsewhere { rank: 1, .. })), "{error}");
    }
    assert!(!target.exists());
}

#[test]
fn a_rank_that_panics_leaves_nothing_new_on_any() {
    let dir = tempfile::tempdir().unwrap();
    let target = dir.path().join("mesh");
    let outcome = crate::ground::comm::thread::run(3, |comm| {
        let write = |stage: &Path| {
            assert_ne!(comm.rank(), 2, "a broken invariant");
            write_text(&stage.join(format!("part.{}", comm.rank())), b"half")
        };
        let error = write_together(comm, &target, 10, is_part, write).unwrap_err();
        assert!(matches!(error, WriteError::Comm(_)), "{error}");
    });
    assert!(outcome.is_err());
    assert!(!target.exists());
}

#[test]
fn a_panic_leaves_nothing_new() {
    let dir = tempfile::tempdir().unwrap();
    let target = dir.path().join("mesh");
    let outcome = std::panic::catch_unwind(|| {
        alone(&target, |stage| {
            write_text(&stage.join("mesh.names"), b"half")?;
            panic!("a broken invariant")
        })
    });
    assert!(outcome.is_err());
    assert!(!target.exists());
}

#[test]
fn a_folder_in_the_way_of_a_file_is_refused_and_stays() {
    let dir = tempfile::tempdir().unwrap();
    fs::create_dir_all(dir.path().join("mesh.names/precious")).unwrap();
    let error = write_mesh(dir.path(), "new").unwrap_err();
    assert!(matches!(error, WriteError::InTheWay(_)), "{error}");
    assert_eq!(names(dir.path()), ["mesh.names"]);
    assert!(dir.path().join("mesh.names/precious").exists());
}

#[test]
fn an_entry_that_cannot_be_moved_brings_the_earlier_ones_back() {
    let dir = tempfile::tempdir().unwrap();
    fs::write(dir.path().join("a"), "old").unwrap();
    // The folder b cannot be moved, for example because it is a mount point; here it appears too
    // late.
    let staging = Staging::begin(dir.path(), 0).unwrap();
    fs::write(staging.new_entries().join("a"), "new").unwrap();
    fs::create_dir(staging.new_entries().join("b")).unwrap();
    let old = staging.new_entries().with_file_name("old");
    fs::create_dir_all(old.join("b/full")).unwrap();
    fs::create_dir_all(dir.path().join("b/mine")).unwrap();
    staging.commit(|_| false).unwrap_err();
    assert_eq!(fs::read_to_string(dir.path().join("a")).unwrap(), "old");
    assert!(dir.path().join("b").exists());
}

/// Leaves a stage as a killed process does: without a lock holder.
fn abandoned(dir: &Path, name: &str, entries: &[(&str, &str)]) -> PathBuf {
    let stage = dir.join(name);
    for (entry, text) in entries {
        let path = stage.join(entry);
        fs::create_dir_all(path.parent().unwrap()).unwrap();
        fs::write(path, text).unwrap();
    }
    stage
}

#[test]
fn what_a_killed_process_left_goes_and_what_a_living_one_writes_stays() {
    let dir = tempfile::tempdir().unwrap();
    abandoned(dir.path(), ".tetmill-1-0.partial", &[("new/f.vtu", "half"), ("lock", "")]);
    // Killed before the lock was created, and during removal of the stage.
    fs::create_dir(dir.path().join(".tetmill-2-0.partial")).unwrap();
    abandoned(dir.path(), ".tetmill-3-0.partial", &[("old/f", "replaced"), ("done", "[]")]);
    let living = Stage::new_in(dir.path()).unwrap();
    let own = living.new_entries().parent().unwrap().file_name().unwrap().to_str().unwrap().to_string();
    write_file(&dir.path().join("f"), 0, |file| file.write(b"new")).unwrap();
    assert_eq!(names(dir.path()), [own, "f".to_string()]);
    drop(living);
    remove_abandoned(dir.path());
    assert_eq!(names(dir.path()), ["f"]);
}

#[test]
fn old_files_that_a_killed_process_moved_aside_come_back_or_stay() {
    let dir = tempfile::tempdir().unwrap();
    let old = [("old/mesh.names", "the last copy")];
    abandoned(dir.path(), ".tetmill-1-0.partial", &old);
    remove_abandoned(dir.path());
    assert_eq!(names(dir.path()), ["mesh.names"]);
    assert_eq!(fs::read_to_string(dir.path().join("mesh.names")).unwrap(), "the last copy");
    let stage = abandoned(dir.path(), ".tetmill-2-0.partial", &old);
    remove_abandoned(dir.path());
    assert!(stage.join("old/mesh.names").exists(), "another file has its place");
}

#[test]
fn a_commit_that_was_begun_is_completed() {
    let dir = tempfile::tempdir().unwrap();
    write_mesh(dir.path(), "old").unwrap();
    fs::write(dir.path().join("partitioning.1/results.1"), "mine").unwrap();
    fs::write(dir.path().join("partitioning.1/part.2.nodes"), "of a mesh that is no more").unwrap();
    // Killed between the two entries: mesh.names is in its place, the old folder is moved aside,
    // the new one is not there yet.
    fs::write(dir.path().join("mesh.names"), "new").unwrap();
    let stage = abandoned(
        dir.path(),
        ".tetmill-1-0.partial",
        &[("old/mesh.names", "old"), ("new/partitioning.1/part.1.nodes", "new")],
    );
    fs::rename(dir.path().join("partitioning.1"), stage.join("old/partitioning.1")).unwrap();
    let outdated = Outdated::from([("partitioning.1".into(), "part.2.nodes".into())]);
    fs::write(stage.join("commit"), serde_json::to_vec(&outdated).unwrap()).unwrap();
    remove_abandoned(dir.path());
    assert_eq!(names(dir.path()), ["mesh.names", "partitioning.1"]);
    assert_eq!(names(&dir.path().join("partitioning.1")), ["part.1.nodes", "results.1"]);
    assert_eq!(fs::read_to_string(dir.path().join("mesh.names")).unwrap(), "new");
    assert_eq!(fs::read_to_string(dir.path().join("partitioning.1/part.1.nodes")).unwrap(), "new");
}

#[cfg(unix)]
#[test]
fn links_stay_and_their_targets_are_replaced() {
    use std::os::unix::fs::symlink;
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    fs::create_dir_all(at("disk/parts")).unwrap();
    fs::create_dir(at("mesh")).unwrap();
    fs::write(at("disk/names"), "old").unwrap();
    fs::write(at("disk/parts/results.1"), "mine").unwrap();
    symlink("../disk/names", at("mesh/mesh.names")).unwrap();
    symlink("../disk/parts", at("mesh/partitioning.1")).unwrap();
    symlink("mesh", at("link")).unwrap();
    write_mesh(&at("link"), "new").unwrap();
    for link in ["link", "mesh/mesh.names", "mesh/partitioning.1"] {
        assert!(at(link).is_symlink(), "{link}");
    }
    assert_eq!(fs::read_to_string(at("disk/names")).unwrap(), "new");
    assert_eq!(names(&at("disk/parts")), ["part.1.nodes", "results.1"]);
    assert_eq!(names(&at("disk")), ["names", "parts"]);
    assert_eq!(names(&at("mesh")), ["mesh.names", "partitioning.1"]);

    symlink("disk/later", at("dangling")).unwrap();
    write_file(&at("dangling"), 0, |file| file.write(b"new")).unwrap();
    assert!(at("dangling").is_symlink());
    assert_eq!(fs::read_to_string(at("disk/later")).unwrap(), "new");
}

#[cfg(unix)]
#[test]
fn pipes_and_devices_are_written_through_and_not_replaced() {
    use std::os::unix::fs::FileTypeExt;
    assert_eq!(write_file(Path::new("/dev/null"), 3, |file| file.write(b"new")).unwrap(), 3);
    assert!(fs::metadata("/dev/null").unwrap().file_type().is_char_device());

    let dir = tempfile::tempdir().unwrap();
    let pipe = dir.path().join("mesh.names");
    assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
    let read = std::thread::scope(|scope| {
        let reader = scope.spawn(|| fs::read_to_string(&pipe).unwrap());
        write_file(&pipe, 3, |file| file.write(b"new")).unwrap();
        reader.join().unwrap()
    });
    assert_eq!(read, "new");
    let error = write_mesh(dir.path(), "new").unwrap_err();
    assert!(matches!(error, WriteError::NoRegularFile(_)), "{error}");
    assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo());
    assert_eq!(names(dir.path()), ["mesh.names"]);
}

#[test]
fn a_disk_that_is_too_small_is_refused_with_the_numbers() {
    let dir = tempfile::tempdir().unwrap();
    let error = write_file(&dir.path().join("f.vtu"), u64::MAX, |_| Ok(())).unwrap_err();
    assert!(matches!(error, WriteError::NoSpace { needed: u64::MAX, .. }), "{error}");
    assert!(names(dir.path()).is_empty());
}

#[test]
fn a_file_replaces_the_one_before_it() {
    let dir = tempfile::tempdir().unwrap();
    let path = dir.path().join("f.vtu");
    for text in ["old", "new"] {
        write_file(&path, 3, |file| file.write(text.as_bytes())).unwrap();
    }
    assert_eq!(fs::read_to_string(&path).unwrap(), "new");
    assert_eq!(names(dir.path()), ["f.vtu"]);
}
