//! Deletion of Steiner points that were moved inside and are not needed.

use super::constraints::Constraints;
use super::sector::{GOOD_ENOUGH, Sector};
use super::small::{self, Effort};
use super::tetrahedra::Tetrahedra;
use crate::ground::kernel::quality::mean_ratio;
use crate::mesher::half_face::NONE;

/// Passes over all points: a deleted point may enable others to be deleted.
const ROUNDS: usize = 2;

/// The most tets tried in the search for fillings of one point's cavities, all together.
const TRIES: usize = 500;

/// The most points tried, which limits the time to about ten seconds. Thousands of points stay only
/// if some hundred edges nearly intersect, and the mesh is valid with them.
const MOST_TRIED: usize = 2000;

/// Cavities with more vertices are skipped: the search would nearly always end without a result.
const MOST_VERTICES: usize = 24;

/// Stars with more tets are not enlarged. Most stars that can be filled can be so without more
/// tets, and large cavities dominate the time.
const MOST_TO_GROW: usize = 14;

/// Deletes points inside whose star can be filled without them.
///
/// The new tets are no worse than the old ones, or at least [`GOOD_ENOUGH`].
pub(super) fn delete(mesh: &mut Tetrahedra, constraints: &Constraints, inside: &mut Vec<u32>) {
    let mut tried = 0;
    for _ in 0..ROUNDS {
        let before = inside.len();
        inside.retain(|&q| {
            tried += 1;
            tried > MOST_TRIED || !delete_one(mesh, constraints, q)
        });
        if inside.len() == before {
            break;
        }
    }
}

/// Deletes a point if its star can be filled without it; also tries the star enlarged by one or all
/// adjacent tets.
///
/// Enlarging helps because vertices around a necessary point are often not necessary themselves
/// (growing cavities: Marot, Verhetsel, Remacle 2020).
pub(super) fn delete_one(mesh: &mut Tetrahedra, constraints: &Constraints, q: u32) -> bool {
    let mut star = Vec::new();
    mesh.star(q, &mut star);
    let mut behind: Vec<u32> = cavity(mesh, star.clone())
        .walls
        .iter()
        .filter(|&&wall| !mesh.is_locked(wall) && mesh.across(wall) != NONE)
        .map(|&wall| mesh.across(wall) >> 2)
        .collect();
    behind.sort_unstable();
    behind.dedup();
    let with = |more: &[u32]| [&star[..], more].concat();
    let mut choices = vec![with(&[])];
    if star.len() <= MOST_TO_GROW {
        choices.extend(behind.iter().map(|&t| with(&[t])));
        choices.push(with(&behind));
    }
    let mut effort = Effort { vertices: MOST_VERTICES, tries: TRIES };
    let filled = choices.into_iter().find_map(|tets| {
        let old = cavity(mesh, tets);
        let least = old.tets.iter().map(|&t| {
            let [a, b, c, d] = mesh.corners(t);
            mean_ratio(a, b, c, d).max(0.0)
        });
        let least = least.fold(GOOD_ENOUGH, f64::min);
        let new = old
            .keeps_vertices(mesh, |v| v == q)
            .then(|| small::fill(mesh, &old.skin, &[], least, &mut effort))?;
        Some((old, new?))
    });
    let done = filled.is_some_and(|(old, new)| refill(mesh, constraints, &old, &new));
    if done {
        mesh.at_vertex[q as usize] = NONE;
    }
    done
}

/// The cavity of some tets of one body, with its boundary.
pub(super) fn cavity(mesh: &Tetrahedra, tets: Vec<u32>) -> Sector {
    let outer =
        |h: &u32| mesh.is_locked(*h) || mesh.across(*h) == NONE || !tets.contains(&(mesh.across(*h) >> 2));
    let walls = tets.iter().flat_map(|&t| 4 * t..4 * t + 4).filter(outer).collect();
    Sector::inside(mesh, mesh.bodies[tets[0] as usize], tets, walls)
}

/// Replaces the tets of a cavity; false if the new tets do not fit.
pub(super) fn refill(
    mesh: &mut Tetrahedra,
    constraints: &Constraints,
    sector: &Sector,
    tets: &[[u32; 4]],
) -> bool {
    let tets: Vec<([u32; 4], u32)> = tets.iter().map(|&tet| (tet, sector.body)).collect();
    mesh.rebuild(&sector.tets, &tets, &|face| constraints.facet(face).is_some(), &mut Vec::new())
}
