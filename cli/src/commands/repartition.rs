//! `tetmill repartition`

use super::outputs::Outputs;
use super::write::{read_back, refuse_unknown, write_formats};
use super::{on_ranks, prepared, set_threads, watched, write_report};
use crate::failure::{Failure, agree};
use crate::options::{Format, PartitionMethod, Repartition};
use crate::report::moved::MoveReport;
use crate::report::{counted, processes};
use crate::terminal::Terminal;
use std::path::{Path, PathBuf};
use std::time::Instant;
use tetmill::comm::{Communicator, mpi};
use tetmill::files::elmer;
use tetmill::progress::Stage;
use tetmill::repartition::{Geometric, Method};

/// `tetmill repartition`
pub fn run_repartition(options: &Repartition) -> Result<(), Failure> {
    // Before reading, which uses the threads.
    set_threads(options.run.threads)?;
    refuse_unknown(&options.run)?;
    if !mpi::launched() {
        let parts =
            options.parts.ok_or_else(|| Failure::input("the number of parts is missing: give it with -n"))?;
        // Before a thread is started for each part.
        let tets = elmer::stated_elements(&options.directory).map_err(Failure::input)?;
        if u64::from(parts) > tets {
            let [parts, tets] = [counted(parts.into(), "part", "parts"), counted(tets, "tet", "tets")];
            return Err(Failure::input(format!("{parts}, but only {tets}")));
        }
    }
    let start = Instant::now();
    on_ranks(None, options.parts, |comm| repartition_on(comm, options, start))
}

/// **Collective.** `tetmill repartition` on one rank.
fn repartition_on(comm: &dyn Communicator, options: &Repartition, start: Instant) -> Result<(), Failure> {
    let first = comm.rank() == 0;
    let outputs = agree(comm, prepared(comm, || outputs_of(options, comm.size())))?;
    let terminal = Terminal::new(options.run.quiet || !first);
    let progress = watched(&terminal, first);
    let method = match options.method {
        None => Method::default(),
        Some(PartitionMethod::Curve) => Method::Geometric(Geometric::Curve),
        Some(PartitionMethod::SmoothedCurve) => Method::Smoothed(Geometric::Curve),
        Some(PartitionMethod::Bisection) => Method::Geometric(Geometric::Bisection),
        Some(PartitionMethod::SmoothedBisection) => Method::Smoothed(Geometric::Bisection),
        Some(PartitionMethod::Graph) => Method::graph(),
    };
    let together = options.run.format.contains(&Format::Elmer) && !options.run.allow_split_periodic;
    let done =
        tetmill::repartition::repartition_files(comm, &options.directory, method, together, &progress)?;
    let target = &options.output;
    let stem = target.join(stem_of(&done.folder));
    let (written, halo) = progress.stage(Stage::Write, |work| {
        write_formats(comm, &done.part, &done.names, &options.run, [target, &stem], &progress, work)
    })?;
    read_back(comm, &options.run, target, &progress)?;
    let took = processes(comm)?;
    if !first {
        return Ok(());
    }
    let mut report = MoveReport::new(&done, method.to_string(), comm.size(), took);
    report.halo = halo;
    terminal.finish();
    report.stages = progress.times();
    report.seconds = start.elapsed().as_secs_f64();
    report.add_written(written);
    if !options.run.quiet {
        outputs.show(format_args!("{report}\n"))?;
    }
    write_report(options.run.report.as_deref(), &report)
}

/// The files that are read and written.
fn outputs_of(options: &Repartition, parts: u32) -> Outputs {
    let layout = elmer::only_layout(&options.directory).ok();
    let read = layout.as_ref().map_or(options.directory.as_path(), elmer::Layout::folder);
    Outputs::reading([&options.directory])
        .folder(&options.output, &options.output.join(stem_of(read)), &options.run, parts)
        .file("--report", options.run.report.as_ref())
}

/// The base name of single output files: that of the input folder, without a last `partitioning.N`.
fn stem_of(folder: &Path) -> PathBuf {
    let whole = std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf());
    let is_partition = |name: &std::ffi::OsStr| name.to_string_lossy().starts_with("partitioning.");
    let named = whole.ancestors().find_map(|above| above.file_name().filter(|name| !is_partition(name)));
    named.map_or_else(|| "mesh".into(), PathBuf::from)
}
