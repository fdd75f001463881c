//! Estimates how much disk and memory writing takes, before a mesh is made.

use crate::options::{Format, RunOptions};
use std::path::Path;
use tetmill::files::hdf5;
use tetmill::mesh::Order;
use tetmill::run::Disk;

/// Estimates the disk space of the formats, in bytes for each vertex, tet and boundary triangle,
/// and the memory of their writers.
pub(super) fn disk_for(run: &RunOptions, order: Order, folder: &Path) -> Disk {
    let has_short_ids = |format: &Format| {
        matches!(format, Format::Elmer | Format::Msh | Format::Medit | Format::Vol | Format::Inp)
    };
    let sum = |sum: [u64; 3], more: [u64; 3]| [0, 1, 2].map(|k| sum[k] + more[k]);
    let adjacency = if run.adjacency { adjacency_bytes(order) } else { [0; 3] };
    Disk {
        folder: std::path::absolute(folder).unwrap_or_else(|_| folder.to_path_buf()),
        bytes: run.format.iter().map(|format| bytes(*format, order)).fold(adjacency, sum),
        // These formats have 32-bit ids.
        most: run.format.iter().any(has_short_ids).then_some(i32::MAX as u64),
        memory_of_tet: if run.adjacency { hdf5::ADJACENCY_MEMORY } else { 0 },
    }
}

/// Bytes of the adjacency of HDF5. With the formulas of Euler there are as many edges as corners,
/// tets and half of the triangles, and two faces for each tet and a half for each triangle.
fn adjacency_bytes(order: Order) -> [u64; 3] {
    match order {
        // An edge takes 48 bytes, a face 88, a tet 160, a vertex 16.
        Order::First => [64, 384, 68],
        // The vertices include a node on each edge.
        Order::Second => [40, 360, 56],
    }
}

/// Bytes of a format. Those of text depend on the digits of numbers: they are right within 10 % for
/// meshes of 10⁵ to 10⁶ tets, and too small for larger ones.
fn bytes(format: Format, order: Order) -> [u64; 3] {
    let [first, second] = match format {
        Format::Elmer => [[62, 36, 44], [62, 80, 66]],
        Format::Vtu => [[32, 39, 43], [32, 63, 98]],
        Format::Msh => [[50, 40, 32], [57, 84, 55]],
        Format::Msh4 | Format::Msh4Parts => [[32, 40, 32], [32, 88, 56]],
        Format::Medit => [[42, 29, 21], [54, 70, 43]],
        Format::Vol => [[40, 30, 29], [52, 72, 51]],
        Format::Inp => [[64, 34, 10], [62, 84, 10]],
        // Local numbers, and of second order no nodes on edges in the list of tets.
        Format::Mfem => [[60, 25, 20], [56, 26, 20]],
        // It has the nodes of the tets twice, for VTK and for PETSc.
        Format::Hdf5 => [[32, 89, 48], [32, 185, 72]],
        // The boundary alone.
        Format::Geomview => [[0, 0, 56], [0, 0, 56]],
        Format::None => [[0; 3]; 2],
    };
    match order {
        Order::First => first,
        Order::Second => second,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::commands::write::write_formats;
    use crate::options::{Cli, Command};
    use clap::{Parser, ValueEnum};
    use std::fs;
    use tetmill::Geometry;
    use tetmill::comm::{Communicator, thread};
    use tetmill::mesh::{Counts, MeshStream, Names};
    use tetmill::progress::{Progress, Silent, Work};
    use tetmill::run::{CoarseSettings, GenerateSettings, Wanted, generate};

    fn options(format: Format, more: &[&str]) -> RunOptions {
        let name = format.to_possible_value().unwrap();
        let arguments = ["tetmill", "generate", "x.geo", "-f", name.get_name()];
        match Cli::parse_from(arguments.iter().chain(more)).command {
            Command::Generate(options) => options.run,
            other => panic!("{other:?}"),
        }
    }

    /// The bytes of a folder on disk; hard links count once.
    fn size(folder: &Path) -> u64 {
        let entries = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap());
        let sizes = entries.map(|entry| match entry.metadata().unwrap() {
            found if found.is_dir() => size(&entry.path()),
            found => found.len(),
        });
        sizes.sum()
    }

    /// The ratio of the estimate to the files.
    fn ratio(
        comm: &dyn Communicator,
        part: &dyn MeshStream,
        names: &Names,
        run: &RunOptions,
        folder: &Path,
    ) -> f64 {
        let paths = [folder, &folder.join("ball")];
        let progress = Progress::new(&Silent);
        write_formats(comm, part, names, run, paths, &progress, Work::unwatched()).unwrap();
        let Counts { vertices, tets, boundary } = part.totals();
        let [vertex, tet, triangle] = disk_for(run, part.order(), folder).bytes;
        (vertex * vertices + tet * tets + triangle * boundary) as f64 / size(folder) as f64
    }

    #[test]
    fn estimates_are_within_a_tenth_of_the_files_of_each_format_and_order() {
        let dir = tempfile::tempdir().unwrap();
        // Round, so that coordinates have all digits, and with an interface between bodies.
        let text = "algebraic3d solid all = sphere (0, 0, 0; 1); solid core = sphere (0.1, 0, 0; 0.5); \
                    solid shell = all and not core; tlo core; tlo shell;";
        let ball = Geometry::from_text(text).unwrap();
        let formats = Format::value_variants().iter().filter(|format| **format != Format::None);
        let mut runs: Vec<RunOptions> = formats.map(|format| options(*format, &[])).collect();
        runs.push(options(Format::Hdf5, &["--adjacency"]));
        for order in [Order::First, Order::Second] {
            thread::run(3, |comm: &dyn Communicator| {
                let coarse = CoarseSettings { order, ..CoarseSettings::default() };
                let settings =
                    GenerateSettings { wanted: Wanted::Elements(100_000), coarse, ..Default::default() };
                let geometry = (comm.rank() == 0).then_some(&ball);
                let mesh = generate(comm, geometry, &settings, &Progress::new(&Silent)).unwrap();
                for run in &runs {
                    let folder = dir.path().join(format!("{order:?}.{:?}.{}", run.format, run.adjacency));
                    let ratio = ratio(comm, mesh.part.stream(), &mesh.names, run, &folder);
                    // Faces between parts are drawn, but are no boundary triangles.
                    let drawn = run.format.contains(&Format::Geomview);
                    let band = if drawn { 0.5..1.1 } else { 0.9..1.1 };
                    assert!(band.contains(&ratio), "{:?} {order:?}: {ratio:.3}", run.format);
                }
            })
            .unwrap();
        }
    }
}
