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

/// Bytes of a format. Text formats are estimated by short lines.
fn bytes(format: Format, order: Order) -> [u64; 3] {
    let [vertex, tet, triangle] = match format {
        Format::Elmer => [60, 40, 40],
        Format::Vtu => [32, 44, 30],
        Format::Msh => [65, 60, 50],
        Format::Msh4 | Format::Msh4Parts => [32, 40, 32],
        Format::Medit => [60, 40, 30],
        Format::Vol => [58, 40, 42],
        Format::Inp => [65, 40, 25],
        Format::Mfem => [50, 24, 18],
        Format::Hdf5 => [32, 89, 48],
        Format::Geomview => [0, 0, 30],
        Format::None => [0; 3],
    };
    let [more_of_tet, more_of_triangle] = match (order, format) {
        (Order::First, _) | (_, Format::Geomview | Format::None) => [0, 0],
        // It has the nodes of the tets twice, for VTK and for PETSc.
        (Order::Second, Format::Hdf5) => [96, 24],
        // Six and three more nodes, of some seven digits or eight bytes.
        (Order::Second, _) => [42, 21],
    };
    [vertex, tet + more_of_tet, triangle + more_of_triangle]
}
