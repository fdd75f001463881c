//! Orientation of tets: the file's convention, arbitrary vertex order, or truly inverted tets.

use super::assemble::FaceTable;
use crate::Point;
use crate::ground::kernel::predicates::{Sign, orient3d};
use crate::ground::mesh::{TET_FACES, VertexId};
use rayon::prelude::*;

fn sign(points: &[Point], tet: &[VertexId; 4]) -> Sign {
    let [a, b, c, d] = tet.map(|v| &points[v.index()]);
    orient3d(a, b, c, d)
}

/// Lists the tets that are not positively oriented.
pub(super) fn not_positive(points: &[Point], tets: &[[VertexId; 4]]) -> Vec<u32> {
    let bad = tets.par_iter().enumerate().filter(|(_, tet)| sign(points, tet) != Sign::Positive);
    bad.map(|(t, _)| t as u32).collect()
}

/// Reverses tets whose orientation is only a matter of vertex order, and returns their number. See
/// the module's documentation.
pub(super) fn orient(points: &[Point], tets: &mut [[VertexId; 4]], table: &mut FaceTable) -> usize {
    let signs: Vec<Sign> = tets.par_iter().map(|tet| sign(points, tet)).collect();
    let count = |wanted: Sign| signs.iter().filter(|&&s| s == wanted).count();
    let (positive, negative) = (count(Sign::Positive), count(Sign::Negative));
    let convention = if negative > positive { Sign::Negative } else { Sign::Positive };
    let mut turned = 0;
    if convention == Sign::Negative {
        (0..tets.len()).for_each(|t| reverse(tets, table, t));
        turned = tets.len();
    }
    if negative.min(positive) == 0 {
        return turned;
    }
    let differing: Vec<usize> = (0..tets.len()).filter(|&t| signs[t] == convention.flipped()).collect();
    let before = disagreements(tets, table);
    differing.iter().for_each(|&t| reverse(tets, table, t));
    if disagreements(tets, table) < before {
        return if convention == Sign::Negative { turned - differing.len() } else { differing.len() };
    }
    differing.iter().for_each(|&t| reverse(tets, table, t));
    turned
}

/// Swaps two vertices, and the faces opposite them.
fn reverse(tets: &mut [[VertexId; 4]], table: &mut FaceTable, t: usize) {
    tets[t].swap(0, 1);
    table.faces.tet_faces[t].swap(0, 1);
}

/// Counts the faces whose two tets lie on the same side according to the order of vertices.
fn disagreements(tets: &[[VertexId; 4]], table: &FaceTable) -> usize {
    let mut seen: Vec<Option<bool>> = vec![None; table.faces.faces.len()];
    let mut count = 0;
    for (tet, faces) in tets.iter().zip(&table.faces.tet_faces) {
        for (corners, face) in TET_FACES.iter().zip(faces) {
            let side = is_even(corners.map(|k| tet[k]));
            count += usize::from(seen[face.index()].replace(side) == Some(side));
        }
    }
    count
}

/// Whether three distinct vertices are an even permutation of their ascending order.
pub(super) fn is_even([a, b, c]: [VertexId; 3]) -> bool {
    [a > b, b > c, a > c].iter().filter(|&&inversion| inversion).count() % 2 == 0
}
