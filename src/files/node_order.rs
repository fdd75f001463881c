//! The orders in which formats list the nodes on the edges of ten-node tets and six-node triangles,
//! after the corners.
//!
//! Each order has, for each place in the file, the place in [`TET_EDGES`] or [`TRIANGLE_EDGES`].
//!
//! [`TET_EDGES`]: crate::ground::mesh::TET_EDGES
//! [`TRIANGLE_EDGES`]: crate::ground::mesh::TRIANGLE_EDGES

use crate::ground::mesh::Order;

/// VTK, Elmer, Abaqus, CalculiX, Exodus: edges 01 12 02 03 13 23.
pub const VTK: [usize; 6] = [0, 3, 1, 2, 4, 5];

/// VTK's numbers for triangles and tets of an order.
pub fn vtk_types(order: Order) -> [u8; 2] {
    match order {
        Order::First => [5, 10],
        Order::Second => [22, 24],
    }
}

/// Gmsh: the last two of VTK swapped.
pub const GMSH: [usize; 6] = [0, 3, 1, 2, 5, 4];

/// NETGEN, of its own corners, which are ours with the first two swapped: edges 01 02 03 12 13 23.
pub const NETGEN: [usize; 6] = [0, 3, 4, 1, 2, 5];

/// The edges in lexicographic order: NETGEN's order of the corners in the file.
pub const LEXICOGRAPHIC: [usize; 6] = [0, 1, 2, 3, 4, 5];

/// NETGEN's triangles: node k is on the edge opposite corner k.
pub const NETGEN_TRIANGLE: [usize; 3] = [1, 2, 0];

/// Nodes in the order of a format; empty for first order.
pub fn arranged<'a, const N: usize>(
    nodes: &'a [u32],
    order: &'a [usize; N],
) -> impl Iterator<Item = u32> + 'a {
    order.iter().filter_map(|&edge| nodes.get(edge).copied())
}
