//! Assigns tets to bodies by flood fill between locked faces, and removes the tets outside.

use super::constraints::Constraints;
use super::tetrahedra::{NO_BODY, Tetrahedra};
use crate::mesher::half_face::NONE;
use csg::BodyId;
use rayon::prelude::*;

/// Label of tets outside all bodies until they are removed.
const OUTSIDE: u32 = NO_BODY - 1;

/// Two triangles on the boundary of one region that assign different bodies to it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Disagreement {
    /// The triangle visited second.
    pub triangle: u32,
    /// The region that this triangle assigns, and the one assigned before by another triangle.
    pub regions: [Option<BodyId>; 2],
}

/// Assigns each tet its body and removes the tets outside all bodies.
///
/// All facets must be locked faces; `far` is a vertex outside all bodies.
///
/// # Errors
/// A [`Disagreement`] if two triangles assign different regions to one connected set of tets.
pub(super) fn carve(
    mesh: &mut Tetrahedra,
    constraints: &Constraints,
    regions: &[[Option<BodyId>; 2]],
    far: u32,
) -> Result<(), Disagreement> {
    let locked = mesh.half_faces().filter(|&half_face| mesh.is_locked(half_face));
    let assign = |half_face| (half_face >> 2, triangle_and_region(mesh, constraints, regions, half_face));
    let assigned: Vec<_> = locked.map(assign).collect();
    let mut open = Vec::new();
    flood(mesh, mesh.at_vertex[far as usize], OUTSIDE, &mut open);
    for (t, (triangle, region)) in assigned {
        let (label, known) = (label(region), mesh.bodies[t as usize]);
        if known == NO_BODY {
            flood(mesh, t, label, &mut open);
        } else if known != label {
            let regions = [region, (known != OUTSIDE).then_some(BodyId(known))];
            return Err(Disagreement { triangle, regions });
        }
    }
    remove_outside(mesh);
    Ok(())
}

fn label(region: Option<BodyId>) -> u32 {
    region.map_or(OUTSIDE, |body| body.0)
}

/// The triangle of a locked half-face, and the region that it assigns to the half-face's tet.
fn triangle_and_region(
    mesh: &Tetrahedra,
    constraints: &Constraints,
    regions: &[[Option<BodyId>; 2]],
    half_face: u32,
) -> (u32, Option<BodyId>) {
    let face = mesh.face(half_face);
    let facet = constraints.facet(face).expect("a locked face is a facet");
    let facet = &constraints.facets[facet as usize];
    let [behind, front] = regions[facet.triangle as usize];
    (facet.triangle, if is_even(face, facet.vertices) { behind } else { front })
}

/// Whether two permutations of the same three vertices have the same orientation.
pub(super) fn is_even([a, b, _]: [u32; 3], other: [u32; 3]) -> bool {
    let at = |v: u32| other.iter().position(|&w| w == v);
    match (at(a), at(b)) {
        (Some(i), Some(j)) => (i + 1) % 3 == j,
        _ => panic!("{other:?} has other vertices than {a} and {b}"),
    }
}

fn flood(mesh: &mut Tetrahedra, from: u32, label: u32, open: &mut Vec<u32>) {
    mesh.bodies[from as usize] = label;
    open.push(from);
    while let Some(t) = open.pop() {
        for half_face in 4 * t..4 * t + 4 {
            let other = mesh.across(half_face);
            if other != NONE && !mesh.is_locked(half_face) && mesh.bodies[(other >> 2) as usize] == NO_BODY {
                mesh.bodies[(other >> 2) as usize] = label;
                open.push(other >> 2);
            }
        }
    }
}

/// Removes the tets outside; faces next to them become boundary faces of the mesh.
fn remove_outside(mesh: &mut Tetrahedra) {
    for t in 0..mesh.tets.len() as u32 {
        if mesh.is_alive(t) && mesh.bodies[t as usize] == OUTSIDE {
            for half_face in 4 * t..4 * t + 4 {
                let other = mesh.across(half_face);
                if other != NONE {
                    mesh.across[(other >> 2) as usize][(other & 3) as usize] = NONE;
                }
            }
            mesh.remove_tet(t);
        }
    }
    mesh.at_vertex.fill(NONE);
    for t in 0..mesh.tets.len() as u32 {
        if mesh.is_alive(t) {
            for v in mesh.tets[t as usize] {
                mesh.at_vertex[v as usize] = t;
            }
        }
    }
}
