//! Parents of vertices and tets between two successive levels of refinement.
//!
//! Two meshes refined from the same part with n and 2n subdivisions per edge are successive levels.
//! Each vertex of the finer level is a vertex of the coarser one, the midpoint of one of its edges,
//! or the centre of an octahedron, i.e. the midpoint of the diagonal that the coarser level chose
//! there. So each vertex has two **parents** (equal for a vertex of both levels), and linear
//! interpolation takes the mean of their values. Parents are in the same part, so no messages are
//! needed.
//!
//! Each tet of the finer level lies in one tet of the coarser level only if all octahedra of a
//! coarse tet are cut along the same diagonal (`nested` of [`Settings`](super::Settings)). Its
//! lattice is then an affine copy of the triangulation of Freudenthal (1942) and Kuhn (1960), which
//! is nested under halving.

use super::RefinedMesh;
use super::lattice::{Lattice, OCTAHEDRON, UPRIGHT, UPSIDE_DOWN};
use crate::ground::mesh::stream::MeshStream;
use crate::ground::mesh::{Order, Rank, TetId};
use rayon::prelude::*;

/// Why two meshes are not levels of one refinement.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum LevelError {
    /// The finer mesh does not have twice the subdivisions per edge.
    #[error(
        "a level with {fine} pieces per coarse edge cannot follow one with {coarse}: it needs twice as many"
    )]
    Pieces {
        /// Subdivisions per edge of the finer mesh.
        fine: u32,
        /// Subdivisions per edge of the coarser mesh.
        coarse: u32,
    },
    /// Meshes of second order: their nodes on edges have no linear interpolation.
    #[error("levels of elements of second order have no parents: use those of first order")]
    Order,
    /// The meshes are refined from different coarse parts.
    #[error("the meshes on rank {rank} are refined from different parts")]
    Parts {
        /// The rank.
        rank: Rank,
    },
}

fn expect_levels(fine: &RefinedMesh, coarse: &RefinedMesh) -> Result<(), LevelError> {
    if fine.order() != Order::First || coarse.order() != Order::First {
        return Err(LevelError::Order);
    }
    if fine.pieces() != 2 * coarse.pieces() {
        return Err(LevelError::Pieces { fine: fine.pieces(), coarse: coarse.pieces() });
    }
    let (one, other) = (fine.coarse(), coarse.coarse());
    if one.tets != other.tets || one.tet_ids != other.tet_ids {
        return Err(LevelError::Parts { rank: fine.rank() });
    }
    Ok(())
}

/// The corner codes of the ends of a diagonal: the two that all four children share.
fn ends(diagonal: u8) -> [u8; 2] {
    let children = &OCTAHEDRON[usize::from(diagonal)];
    [children[0][0], children[0][1]]
}

/// *Local.* The parents of each vertex in the next coarser level, by local index.
///
/// # Errors
/// [`LevelError`] if the meshes are not successive levels of one refinement.
pub fn of_vertices(fine: &RefinedMesh, coarse: &RefinedMesh) -> Result<Vec<[u32; 2]>, LevelError> {
    expect_levels(fine, coarse)?;
    let mut parents = vec![[u32::MAX; 2]; fine.numbering().vertices() as usize];
    let (mut fine_ids, mut coarse_ids) = (Vec::new(), Vec::new());
    let lattice = coarse.numbering().lattice();
    for tet in (0..fine.coarse().tets.len()).map(TetId::new) {
        fine.numbering().lattice_ids(fine.coarse(), tet, &mut fine_ids);
        coarse.numbering().lattice_ids(coarse.coarse(), tet, &mut coarse_ids);
        let diagonals = coarse.diagonals(tet);
        let places = parent_places(lattice, |octahedron| diagonals.get(octahedron));
        for (vertex, place) in fine_ids.iter().zip(places) {
            parents[*vertex as usize] = place.map(|index| coarse_ids[index as usize]);
        }
    }
    Ok(parents)
}

/// For each point of the finer lattice, in order, its parents in the coarser lattice.
fn parent_places(lattice: Lattice, diagonal: impl Fn(u32) -> u8) -> impl Iterator<Item = [u32; 2]> {
    let n = 2 * lattice.n();
    let points = (0..=n).flat_map(move |d| (0..=n - d).map(move |c| (c, d)));
    let points = points.flat_map(move |(c, d)| (0..=n - d - c).map(move |b| [b, c, d]));
    points.map(move |point| {
        // A midpoint of two coarse lattice points: subtract and add half the odd coordinates.
        let low = point.map(|x| x / 2);
        match point.map(|x| x % 2) {
            [0, 0, 0] => [lattice.index(low); 2],
            [1, 1, 1] => {
                let octahedron = lattice.octahedron_row(low[1], low[2]) + low[0];
                ends(diagonal(octahedron)).map(|code| lattice.index(with_code(low, code)))
            }
            // One odd coordinate: the edge in that direction. Two: the edge between the two
            // directions.
            [1, 1, 0] => [with_code(low, 1), with_code(low, 2)].map(|p| lattice.index(p)),
            [1, 0, 1] => [with_code(low, 1), with_code(low, 4)].map(|p| lattice.index(p)),
            [0, 1, 1] => [with_code(low, 2), with_code(low, 4)].map(|p| lattice.index(p)),
            odd => {
                let high = [0, 1, 2].map(|k| low[k] + odd[k]);
                [low, high].map(|p| lattice.index(p))
            }
        }
    })
}

/// The corner of a cell with a corner code.
fn with_code(cell: [u32; 3], code: u8) -> [u32; 3] {
    [0, 1, 2].map(|axis| cell[axis] + u32::from(code >> axis & 1))
}

/// *Local.* The tet of the next coarser level that contains each tet, both by index in the part.
/// Each coarser tet has eight children.
///
/// Both levels must have been refined with `nested` (not checked). Otherwise tets of the finer
/// level may overlap several of the coarser one.
///
/// # Errors
/// [`LevelError`] if the meshes are not successive levels of one refinement.
pub fn of_tets(fine: &RefinedMesh, coarse: &RefinedMesh) -> Result<Vec<u64>, LevelError> {
    expect_levels(fine, coarse)?;
    let [of_fine, of_coarse] = [fine, coarse].map(|level| u64::from(level.numbering().lattice().children()));
    let of_tet = |tet: usize| {
        let diagonal = coarse.diagonals(TetId::new(tet));
        let diagonal = if of_coarse > 1 { diagonal.get(0) } else { fine.diagonals(TetId::new(tet)).get(0) };
        let first = tet as u64 * of_coarse;
        let places = tet_places(coarse.numbering().lattice(), diagonal);
        debug_assert_eq!(places.len() as u64, of_fine);
        places.into_iter().map(move |place| first + u64::from(place)).collect::<Vec<_>>()
    };
    Ok((0..fine.coarse().tets.len()).into_par_iter().map(of_tet).collect::<Vec<_>>().concat())
}

/// For each child of the finer lattice, in order, the child of the coarser lattice that contains
/// it.
fn tet_places(lattice: Lattice, diagonal: u8) -> Vec<u32> {
    let finer = Lattice::new(2 * lattice.n());
    let mut places = Vec::with_capacity(finer.children() as usize);
    for (c, d, cells) in finer.rows() {
        let mut put = |b: u32, corners: &[u8; 4]| {
            // Four times the centroid of the child, in units of the finer lattice.
            let mut sum = [0; 3];
            for code in corners {
                let corner = with_code([b, c, d], *code);
                (0..3).for_each(|axis| sum[axis] += corner[axis]);
            }
            places.push(child_at(lattice, diagonal, sum));
        };
        (0..cells).for_each(|b| put(b, &UPRIGHT));
        for b in 0..cells - 1 {
            OCTAHEDRON[usize::from(diagonal)].iter().for_each(|child| put(b, child));
        }
        (0..cells.saturating_sub(2)).for_each(|b| put(b, &UPSIDE_DOWN));
    }
    places
}

/// The child that contains a point in its interior, given in eighths of the lattice unit.
fn child_at(lattice: Lattice, diagonal: u8, eighths: [u32; 3]) -> u32 {
    let [b, c, d] = eighths.map(|x| x / 8);
    let within = eighths.map(|x| i64::from(x % 8));
    let (first, cells) = (lattice.child_row(c, d), lattice.n() - c - d);
    let sum: i64 = within.iter().sum();
    if sum < 8 {
        return first + b;
    }
    if sum > 16 {
        return first + cells + 4 * (cells - 1) + b;
    }
    let children = &OCTAHEDRON[usize::from(diagonal)];
    let child = children.iter().position(|child| contains(child, within));
    let child = child.expect("the children of an octahedron fill it") as u32;
    lattice.octahedron_child([b, c, d]) + child
}

/// Whether a point of the unit cell, given in eighths, is strictly inside a child.
fn contains(child: &[u8; 4], point: [i64; 3]) -> bool {
    let corners = child.map(|code| [0, 1, 2].map(|axis| 8 * i64::from(code >> axis & 1)));
    (0..4).all(|replaced| {
        let mut tet = corners;
        tet[replaced] = point;
        volume6(tet) > 0
    })
}

fn volume6([a, b, c, d]: [[i64; 3]; 4]) -> i64 {
    let minus = |p: [i64; 3]| [p[0] - a[0], p[1] - a[1], p[2] - a[2]];
    let [u, v, w] = [minus(b), minus(c), minus(d)];
    u[0] * (v[1] * w[2] - v[2] * w[1])
        + u[1] * (v[2] * w[0] - v[0] * w[2])
        + u[2] * (v[0] * w[1] - v[1] * w[0])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::parallel::refine::fixtures::{ball, cube, whole};
    use crate::parallel::refine::{Settings, refine};
    use std::collections::BTreeSet;

    #[test]
    fn an_inner_vertex_of_a_flat_mesh_is_in_the_middle_of_its_parents() {
        let fixture = cube(1, false);
        let level = |n| refine(whole(&fixture.mesh), &fixture.projector, n, &Settings::default()).unwrap();
        for n in [1, 2, 3, 4] {
            let (coarse, fine) = (level(n), level(2 * n));
            let parents = of_vertices(&fine, &coarse).unwrap();
            for (vertex, [p, q]) in parents.into_iter().enumerate() {
                let [p, q] = [p, q].map(|v| coarse.points()[v as usize]);
                for axis in 0..3 {
                    let middle = 0.5 * (p[axis] + q[axis]);
                    assert!((fine.points()[vertex][axis] - middle).abs() < 1e-14, "n = {n}, vertex {vertex}");
                }
            }
        }
    }

    #[test]
    fn parents_are_ends_of_an_edge_of_the_level_before() {
        let fixture = ball(1.0);
        let level = |n| refine(whole(&fixture.mesh), &fixture.projector, n, &Settings::default()).unwrap();
        let (coarse, fine) = (level(4), level(8));
        let mut edges = BTreeSet::new();
        let mut block = crate::ground::mesh::stream::TetBlock::default();
        for index in 0..coarse.tet_blocks() {
            coarse.tet_block(index, &mut block);
            for tet in &block.tets {
                for [i, j] in crate::ground::mesh::TET_EDGES {
                    edges.insert([tet[i].min(tet[j]), tet[i].max(tet[j])]);
                }
            }
        }
        let parents = of_vertices(&fine, &coarse).unwrap();
        let between: BTreeSet<[u32; 2]> =
            parents.iter().filter(|[p, q]| p != q).map(|&[p, q]| [p.min(q), p.max(q)]).collect();
        assert_eq!(between, edges, "each edge has one new vertex");
        assert_eq!(parents.iter().filter(|[p, q]| p == q).count(), coarse.points().len());
    }

    #[test]
    fn nested_tets_lie_in_their_parents_eight_in_each() {
        let fixture = cube(1, false);
        let settings = Settings { nested: true, ..Settings::default() };
        let level = |n| refine(whole(&fixture.mesh), &fixture.projector, n, &settings).unwrap();
        for n in [1, 2, 3, 4] {
            let (coarse, fine) = (level(n), level(2 * n));
            let tets = |level: &RefinedMesh| crate::ground::mesh::Arrays::of(level);
            let (coarse_tets, fine_tets) = (tets(&coarse), tets(&fine));
            let parents = of_tets(&fine, &coarse).unwrap();
            let mut children = vec![0; coarse_tets.tets.len()];
            for (tet, parent) in parents.into_iter().enumerate() {
                children[parent as usize] += 1;
                let parent = coarse_tets.corners(parent as usize).map(crate::Point::from);
                let child = fine_tets.corners(tet).map(crate::Point::from);
                let middle = crate::Point::from(child.iter().map(|p| p.coords).sum::<crate::Vector>() / 4.0);
                for replaced in 0..4 {
                    let mut sub = parent;
                    sub[replaced] = middle;
                    let [a, b, c, d] = &sub;
                    assert!(crate::ground::kernel::simplex::volume6(a, b, c, d) > 0.0, "n = {n}, tet {tet}");
                }
            }
            assert!(children.iter().all(|&count| count == 8));
        }
    }

    #[test]
    fn meshes_that_are_no_levels_are_refused() {
        let fixture = cube(1, false);
        let level = |n| refine(whole(&fixture.mesh), &fixture.projector, n, &Settings::default()).unwrap();
        assert_eq!(of_vertices(&level(3), &level(1)), Err(LevelError::Pieces { fine: 3, coarse: 1 }));
    }
}
