//! Points that the recovery left inside, deleted where they are not needed.

use super::constraints::Constraints;
use super::sector::{GOOD_ENOUGH, Sector};
use super::small::{self, Effort};
use super::tetrahedra::{NONE, Tetrahedra};
use crate::kernel::quality::mean_ratio;

/// How often all points are tried: one that is gone may let others go.
const ROUNDS: usize = 2;

/// How many tets may be put in search of a ball's filling, all its cavities together.
const TRIES: usize = 500;

/// How many points are tried at most, which bounds the time to some ten seconds: thousands stay inside only where a hundred edges nearly meet, and a
/// mesh with some points too many is valid.
const MOST_TRIED: usize = 2000;

/// Cavities with more vertices are left alone: the search would end without an answer nearly always.
const MOST_VERTICES: usize = 24;

/// Balls of more tets are tried as they are only: those that can be filled mostly can be so without more tets, and the larger ones take
/// the time.
const MOST_TO_GROW: usize = 14;

/// Deletes those points inside whose ball can be filled without them, with no worse a tet unless it is good enough.
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

/// Fills the ball of a point without it, or the ball with one tet or all tets beside it: what stands around a point that is needed there
/// is often not needed itself (a cavity that grows, as in Marot, Verhetsel, Remacle 2020).
pub(super) fn delete_one(mesh: &mut Tetrahedra, constraints: &Constraints, q: u32) -> bool {
    let mut ball = Vec::new();
    mesh.star(q, &mut ball);
    let mut behind: Vec<u32> = cavity(mesh, ball.clone())
        .walls
        .iter()
        .filter(|&&wall| !mesh.is_locked(wall) && mesh.across(wall) != NONE)
        .map(|&wall| mesh.across(wall) >> 2)
        .collect();
    behind.sort_unstable();
    behind.dedup();
    let with = |more: &[u32]| [&ball[..], more].concat();
    let mut choices = vec![with(&[])];
    if ball.len() <= MOST_TO_GROW {
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

/// Some tets of one body and what is around them.
pub(super) fn cavity(mesh: &Tetrahedra, tets: Vec<u32>) -> Sector {
    let outer =
        |h: &u32| mesh.is_locked(*h) || mesh.across(*h) == NONE || !tets.contains(&(mesh.across(*h) >> 2));
    let walls = tets.iter().flat_map(|&t| 4 * t..4 * t + 4).filter(outer).collect();
    Sector::inside(mesh, mesh.bodies[tets[0] as usize], tets, walls)
}

/// Puts other tets into a cavity; false where they do not fit.
pub(super) fn refill(
    mesh: &mut Tetrahedra,
    constraints: &Constraints,
    sector: &Sector,
    tets: &[[u32; 4]],
) -> bool {
    let tets: Vec<([u32; 4], u32)> = tets.iter().map(|&tet| (tet, sector.body)).collect();
    mesh.rebuild(&sector.tets, &tets, &|face| constraints.facet(face).is_some(), &mut Vec::new())
}
