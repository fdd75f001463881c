//! Ten-node children of a coarse tet: their nodes, and the proof that they are valid.
//!
//! The nodes of the children of n subdivisions are the points of the lattice of 2n: corners are the
//! points with even coordinates, and the node on an edge is half way between its ends.

use super::cut::middle;
use super::diagonal;
use super::lattice::{Lattice, OCTAHEDRON, UPRIGHT, UPSIDE_DOWN};
use super::rows::Rows;
use super::snap::Coordinates;
use crate::Point;
use crate::ground::kernel::jacobian::{self, Nodes};
use crate::ground::kernel::predicates::{Sign, orient3d};
use crate::ground::kernel::simplex::TET_EDGES;

/// Ten nodes of a child as steps from the first point of its cell in the lattice of nodes.
pub(super) type Steps = [[u8; 3]; 10];

/// The nodes of the child with these corner codes.
pub(super) const fn steps(corners: [u8; 4]) -> Steps {
    let mut steps = [[0; 3]; 10];
    let mut node = 0;
    while node < 10 {
        let [p, q] = if node < 4 { [node, node] } else { TET_EDGES[node - 4] };
        let mut axis = 0;
        while axis < 3 {
            steps[node][axis] = (corners[p] >> axis & 1) + (corners[q] >> axis & 1);
            axis += 1;
        }
        node += 1;
    }
    steps
}

/// Copies the corners of the children out of the lattice of nodes.
pub(super) fn take_corners(nodes: &[Vec<f64>; 3], rows: &Rows, cells: &Rows, corners: &mut [Vec<f64>; 3]) {
    let n = cells.lattice().n();
    for (nodes, corners) in nodes.iter().zip(corners) {
        corners.clear();
        for d in 0..=n {
            for c in 0..=n - d {
                let row = &nodes[rows.start(2 * c, 2 * d)..][..=2 * (n - c - d) as usize];
                corners.extend(row.iter().step_by(2));
            }
        }
    }
}

/// Adds the children that are not proved valid to `bad`, after trying the other diagonals of their
/// octahedron unless `nested`.
pub(super) fn prove(
    axes: &[Vec<f64>; 3],
    rows: &Rows,
    cells: Lattice,
    nested: bool,
    diagonals: &mut [u8],
    bad: &mut Vec<(u32, Coordinates)>,
) {
    for (c, d, count) in cells.rows() {
        let nodes = |cell: u32, corners: [u8; 4]| nodes_at(axes, rows, [cell, c, d], &steps(corners));
        let mut check = |child: u32, nodes: &Nodes| {
            if !is_proved(nodes) {
                bad.push((child, middle(&corners(nodes))));
            }
        };
        let first = cells.child_row(c, d);
        for cell in 0..count {
            check(first + cell, &nodes(cell, UPRIGHT));
        }
        for cell in 0..count - 1 {
            let octahedron = cells.octahedron_row(c, d) + cell;
            let mut diagonal = diagonal::get(diagonals, octahedron);
            let is_valid = |diagonal: u8| {
                OCTAHEDRON[usize::from(diagonal)].iter().all(|corners| is_proved(&nodes(cell, *corners)))
            };
            if !nested
                && !is_valid(diagonal)
                && let Some(other) = (0..3).find(|&other| other != diagonal && is_valid(other))
            {
                diagonal::replace(diagonals, octahedron, other);
                diagonal = other;
            }
            let first = cells.octahedron_child([cell, c, d]);
            for (child, corners) in (first..).zip(OCTAHEDRON[usize::from(diagonal)]) {
                check(child, &nodes(cell, corners));
            }
        }
        let first = first + count + 4 * (count - 1);
        for cell in 0..count.saturating_sub(2) {
            check(first + cell, &nodes(cell, UPSIDE_DOWN));
        }
    }
}

/// The nodes of a child in a cell.
fn nodes_at(axes: &[Vec<f64>; 3], rows: &Rows, [b, c, d]: [u32; 3], steps: &Steps) -> Nodes {
    steps.map(|step| {
        let [b, c, d] = [2 * b + u32::from(step[0]), 2 * c + u32::from(step[1]), 2 * d + u32::from(step[2])];
        let at = rows.start(c, d) + b as usize;
        [axes[0][at], axes[1][at], axes[2][at]]
    })
}

fn corners(nodes: &Nodes) -> [Point; 4] {
    [0, 1, 2, 3].map(|corner| Point::from(nodes[corner]))
}

/// Whether the corners are positively oriented and the determinant is proved positive everywhere.
fn is_proved(nodes: &Nodes) -> bool {
    if jacobian::is_straight(nodes) {
        return true;
    }
    let [p, q, r, s] = corners(nodes);
    orient3d(&p, &q, &r, &s) == Sign::Positive && jacobian::range(nodes).is_positive()
}
