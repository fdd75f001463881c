//! Output destinations: pipes, devices, links, clashing paths, and files left by killed runs.

use crate::common::{own, read_json, succeed, tetmill};
use std::ffi::OsStr;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

const QUICK: [&str; 2] = ["--preset", "very-coarse"];

/// `tetmill COMMAND lens.geo` in a folder, with a coarse mesh.
fn on_lens(command: &str, folder: &Path) -> Command {
    let mut run = tetmill();
    run.current_dir(folder).arg(command).arg(own("lens")).args(QUICK);
    run
}

/// Runs a command that must fail before any work; returns its standard error.
#[track_caller]
fn refused(run: &mut Command) -> String {
    let output = run.output().unwrap();
    let stderr = String::from_utf8_lossy(&output.stderr).into_owned();
    assert_eq!(output.status.code(), Some(2), "{run:?}\n{stderr}");
    assert!(!stderr.contains("panicked") && !stderr.contains(" s\n"), "a stage was run: {stderr}");
    stderr
}

fn names(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).unwrap();
    let mut names: Vec<String> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

#[test]
fn a_report_on_the_standard_output_is_alone_there() {
    let dir = tempfile::tempdir().unwrap();
    for path in ["-", "/dev/stdout"] {
        if cfg!(not(unix)) && path != "-" {
            continue;
        }
        let output = succeed(on_lens("generate", dir.path()).args(["-f", "none", "--report", path]));
        let report: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        assert!(report["mesh"]["tets"].as_u64().unwrap() > 0);
        assert!(String::from_utf8_lossy(&output.stderr).contains("every tet positive"), "{path}");
    }
    assert!(names(dir.path()).is_empty());
}

#[test]
fn a_mesh_a_picture_and_pieces_go_to_the_standard_output() {
    let dir = tempfile::tempdir().unwrap();
    for (format, start) in [("msh", "$MeshFormat"), ("vol", "mesh3d"), ("off", "OFF")] {
        let output = succeed(on_lens("mesh", dir.path()).args(["-f", format, "-o", "-"]));
        assert!(output.stdout.starts_with(start.as_bytes()), "{format}");
        assert!(String::from_utf8_lossy(&output.stderr).contains("tets"), "{format}");
    }
    let output = succeed(on_lens("generate", dir.path()).args(["-f", "none", "--picture", "-"]));
    assert!(output.stdout.starts_with(b"\x89PNG"));
    let output = succeed(on_lens("decompose", dir.path()).args(["-n", "2", "-o", "-"]));
    assert!(output.stdout.starts_with(b"algebraic3d") || output.stdout.starts_with(b"#"));
    assert!(names(dir.path()).is_empty());
    assert!(refused(on_lens("mesh", dir.path()).args(["-o", "-"])).contains("--format"));
    assert!(refused(on_lens("mesh", dir.path()).args(["-f", "vtu", "-o", "-"])).contains("two files"));
    assert!(refused(on_lens("generate", dir.path()).args(["-o", "-"])).contains("is no folder"));
}

#[cfg(unix)]
#[test]
fn pipes_are_written_through_and_stay() {
    use std::os::unix::fs::FileTypeExt;
    let dir = tempfile::tempdir().unwrap();
    let through = |run: &mut Command, name: &str| {
        let pipe = dir.path().join(name);
        succeed(Command::new("mkfifo").arg(&pipe));
        let reader = Command::new("cat").arg(&pipe).stdout(Stdio::piped()).spawn().unwrap();
        succeed(run);
        assert!(fs::metadata(&pipe).unwrap().file_type().is_fifo(), "{name} was replaced");
        reader.wait_with_output().unwrap().stdout
    };
    let report = through(on_lens("generate", dir.path()).args(["-f", "none", "--report", "r"]), "r");
    assert!(serde_json::from_slice::<serde_json::Value>(&report).unwrap()["mesh"].is_object());
    let picture = through(on_lens("generate", dir.path()).args(["-f", "none", "--picture", "p"]), "p");
    assert!(picture.starts_with(b"\x89PNG"));
    let mesh = through(on_lens("mesh", dir.path()).args(["-f", "mesh", "-o", "m"]), "m");
    assert!(mesh.starts_with(b"MeshVersionFormatted") && mesh.ends_with(b"End\n"));
    let pieces = through(on_lens("decompose", dir.path()).args(["-n", "2", "-o", "d"]), "d");
    assert!(String::from_utf8(pieces).unwrap().contains("tlo"));
    succeed(on_lens("mesh", dir.path()).args(["-o", "m.msh"]));
    let mut quality = tetmill();
    let histograms =
        through(quality.current_dir(dir.path()).args(["quality", "m.msh", "--picture", "q"]), "q");
    assert!(histograms.starts_with(b"<svg"));
    assert_eq!(names(dir.path()), ["d", "m", "m.msh", "p", "q", "r"]);
    // Files that are replaced together cannot be streams.
    for (arguments, name) in
        [(["mesh", "-o", "x.vtu"], "x.boundary.vtu"), (["generate", "-o", "."], "mesh.names")]
    {
        succeed(Command::new("mkfifo").arg(dir.path().join(name)));
        let stderr = refused(on_lens(arguments[0], dir.path()).args(&arguments[1..]));
        assert!(stderr.contains(name) && stderr.contains("a pipe"), "{stderr}");
    }
}

#[cfg(unix)]
#[test]
fn links_stay_and_their_targets_are_written() {
    use std::os::unix::fs::symlink;
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    fs::create_dir(at("far")).unwrap();
    fs::write(at("far/report"), "old").unwrap();
    for (target, link) in
        [("far/report", "r.json"), ("far/picture", "p.png"), ("far/mesh", "m.vtu"), ("far", "folder")]
    {
        symlink(target, at(link)).unwrap();
    }
    let arguments = ["--report", "r.json", "--picture", "p.png", "-q", "-o"];
    succeed(on_lens("mesh", dir.path()).args(arguments).arg("m.vtu"));
    assert!(read_json(&at("far/report"))["mesh"].is_object());
    assert!(fs::read(at("far/picture")).unwrap().starts_with(b"\x89PNG"));
    assert!(fs::read(at("far/mesh")).unwrap().starts_with(b"<?xml"));
    assert!(at("m.boundary.vtu").is_file());
    succeed(on_lens("generate", dir.path()).args(arguments).arg("folder"));
    assert!(at("far/partitioning.1/part.1.nodes").is_file());
    for link in ["r.json", "p.png", "m.vtu", "folder"] {
        assert!(at(link).is_symlink(), "{link}");
    }
}

#[test]
fn a_path_for_two_things_is_refused_before_any_work() {
    let dir = tempfile::tempdir().unwrap();
    let at = |name: &str| dir.path().join(name);
    fs::copy(own("lens"), at("part.geo")).unwrap();
    fs::copy(own("lens"), at("part.off")).unwrap();
    fs::write(at("sizes"), "0\n").unwrap();
    fs::write(at("planes"), "0 0 0 1 0 0\n").unwrap();
    fs::hard_link(at("part.geo"), at("same.geo")).unwrap();
    let cases = [
        ("mesh part.geo -o o.vtu --report o.vtu", ["-o o.vtu", "--report o.vtu"]),
        ("mesh part.geo -o o.vtu --report ./o.vtu", ["-o o.vtu", "--report ./o.vtu"]),
        ("mesh part.geo -o o.vtu --picture o.boundary.vtu", ["-o o.boundary.vtu", "--picture"]),
        ("mesh part.geo -f msh -o - --report -", ["-o -", "--report -"]),
        ("generate part.geo --report x --picture x", ["--report x", "--picture x"]),
        ("generate part.geo -o x --report x", ["--report x", "-o x"]),
        ("generate part.geo --report part.geo", ["--report part.geo", "input part.geo"]),
        ("generate part.geo --picture same.geo", ["--picture same.geo", "input part.geo"]),
        ("generate part.geo --mesh-size-file sizes --report sizes", ["--report sizes", "input sizes"]),
        ("generate part.geo --planes-from planes --report planes", ["--report planes", "input planes"]),
        ("generate part.off -o . -f geomview", ["./part.off", "input part.off"]),
        ("generate part.geo -f vtu -o y --report y/part.vtu", ["--report y/part.vtu", "y/part.vtu"]),
        ("decompose part.geo -n 2 -o part.geo", ["-o part.geo", "input part.geo"]),
        ("mesh part.off -o part.off", ["-o part.off", "input part.off"]),
        ("quality part.geo --picture part.geo", ["--picture part.geo", "input part.geo"]),
    ];
    let before = names(dir.path());
    for (arguments, both) in cases {
        let stderr = refused(tetmill().current_dir(dir.path()).args(arguments.split(' ')));
        assert!(both.iter().all(|one| stderr.contains(one)), "{arguments}: {stderr}");
    }
    assert_eq!(names(dir.path()), before);
    assert_eq!(fs::read(at("part.geo")).unwrap(), fs::read(own("lens")).unwrap());
}

#[test]
fn two_gmsh_files_of_one_name_and_text_of_other_formats_are_refused() {
    let dir = tempfile::tempdir().unwrap();
    let said = refused(on_lens("generate", dir.path()).args(["-f", "msh,msh4"]));
    assert!(said.contains("write the same file"), "{said}");
    let said = refused(on_lens("generate", dir.path()).args(["-f", "msh", "--ascii"]));
    assert!(said.contains("add msh4 or msh4-parts"), "{said}");
    assert!(names(dir.path()).is_empty());
}

#[test]
fn an_elmer_mesh_is_not_replaced_by_what_is_made_of_it() {
    let dir = tempfile::tempdir().unwrap();
    let run = |arguments: &str| {
        let mut run = tetmill();
        run.current_dir(dir.path()).args(arguments.split(' '));
        run
    };
    succeed(on_lens("generate", dir.path()).args(["-q", "-n", "2", "-o", "m"]));
    let stderr = refused(&mut run("repartition m -n 2 -o m"));
    assert!(stderr.contains("m/partitioning.2 would overwrite the input m/partitioning.2"), "{stderr}");
    // Each number of parts has its own folder.
    succeed(&mut run("repartition m -n 3 -o m -q"));
    assert_eq!(names(&dir.path().join("m")), ["mesh.names", "partitioning.2", "partitioning.3"]);
}

/// Staging folders left by killed runs.
fn stages(folder: &Path) -> Vec<String> {
    let names = if folder.exists() { names(folder) } else { Vec::new() };
    names.into_iter().filter(|name| name.starts_with(".tetmill-")).collect()
}

/// Kills a run (SIGKILL) once its staging folder exists; repeats if the run finished first.
fn kill_while_it_writes(folder: &Path, run: &mut Command) {
    for _ in 0..20 {
        let mut child = run.spawn().unwrap();
        while stages(folder).is_empty() && child.try_wait().unwrap().is_none() {
            std::thread::yield_now();
        }
        child.kill().unwrap();
        child.wait().unwrap();
        if !stages(folder).is_empty() {
            return;
        }
    }
    panic!("the run was never killed while it wrote");
}

#[test]
fn what_a_killed_run_left_is_removed_by_the_next_one() {
    let dir = tempfile::tempdir().unwrap();
    let out = dir.path().join("out");
    // Enough tets that writing takes a while.
    let (fine, coarse) = (["--levels", "3"], ["--maxh", "0.2"]);
    for (command, formats, output, finer) in [
        ("generate", "elmer", out.as_os_str(), fine),
        ("generate", "vtu", out.as_os_str(), fine),
        ("mesh", "msh", out.join("m.msh").as_os_str(), coarse),
    ] {
        let arguments = [OsStr::new("-q"), "-f".as_ref(), formats.as_ref(), "-o".as_ref(), output];
        kill_while_it_writes(&out, on_lens(command, dir.path()).args(arguments).args(finer));
        succeed(on_lens(command, dir.path()).args(arguments));
        assert!(stages(&out).is_empty(), "{command} {formats}: {:?}", names(&out));
    }
    succeed(tetmill().arg("check").arg(&out));
    // A run that fails later has removed it too, because the disk may be full.
    fs::create_dir(out.join(".tetmill-1-0.partial")).unwrap();
    let output =
        on_lens("generate", dir.path()).args(["--mesh-size-file", "gone", "-o"]).arg(&out).output().unwrap();
    assert_eq!(output.status.code(), Some(2));
    assert!(stages(&out).is_empty());
}

/// An interrupted command exits with its own status and one message, and leaves no files.
#[cfg(unix)]
#[test]
fn an_interrupted_command_leaves_nothing_half_written() {
    use std::io::Read;
    let dir = tempfile::tempdir().unwrap();
    let mut command = tetmill();
    // Long enough to be interrupted before it ends.
    command.arg("generate").arg(own("crankshaft")).args(["-n", "2", "--levels", "5", "-f", "none", "-o"]);
    command.arg(dir.path().join("out")).stderr(Stdio::piped()).stdout(Stdio::piped());
    let mut child = command.spawn().expect("the program starts");
    std::thread::sleep(std::time::Duration::from_secs(3));
    let sent = Command::new("kill").args(["-INT", &child.id().to_string()]).status();
    assert!(sent.expect("kill is a command").success(), "the command ended by itself");
    let status = child.wait().expect("it ends");
    let mut stderr = String::new();
    child.stderr.take().expect("piped").read_to_string(&mut stderr).unwrap();
    assert_eq!(status.code(), Some(130), "{stderr}");
    assert_eq!(stderr.matches("cancelled").count(), 1, "{stderr}");
    assert_eq!(std::fs::read_dir(dir.path()).unwrap().count(), 0, "{stderr}");
}

#[test]
fn files_of_a_run_with_more_parts_are_removed_and_those_of_users_are_kept() {
    let dir = tempfile::tempdir().unwrap();
    for (format, of, foreign) in [
        ("mfem", ["lens.000000", "lens.000001"], ["lens.000008", "lens.000004", "lens.vtu"]),
        ("msh4-parts", ["lens_1.msh", "lens_2.msh"], ["lens_8.msh", "lens_5.msh", "lens.vtu"]),
    ] {
        let out = dir.path().join(format);
        let run = |parts: &str| {
            let mut run = on_lens("generate", dir.path());
            succeed(run.args(["-q", "-f", format, "-n", parts, "-o"]).arg(&out));
            names(&out)
        };
        assert_eq!(run("4").len(), 4);
        // A file of another mesh behind a gap, and files of other programs.
        let start = if format == "mfem" { "MFEM mesh v1.2" } else { "$MeshFormat" };
        for (name, text) in foreign.iter().zip([start, "a user's own", "a user's own"]) {
            fs::write(out.join(name), text).unwrap();
        }
        let mut expected: Vec<&str> = of.into_iter().chain(foreign).collect();
        expected.sort_unstable();
        assert_eq!(run("2"), expected, "{format}");
    }
}

#[test]
fn a_file_of_a_run_with_more_parts_is_kept_if_it_is_an_input() {
    let dir = tempfile::tempdir().unwrap();
    let third = dir.path().join("lens_3.msh");
    succeed(on_lens("mesh", dir.path()).arg("-q").arg("-o").arg(&third));
    let mut run = tetmill();
    run.args(["generate", "-f", "msh4-parts", "-n", "2", "-o"]).arg(dir.path()).arg(own("lens"));
    let stderr = refused(run.arg("--mesh-size-file").arg(&third));
    assert!(stderr.contains("would overwrite the input") && third.exists(), "{stderr}");
}
