//! Solids that overlap: the common part is left to one of them.
//!
//! Where two solids cross, their faces are divided along the curves in which the surfaces
//! intersect. Then each face is on one side of each other solid. Faces inside of a solid that keeps
//! the common part are left out, and its own faces there become those of the other solid, too.
//!
//! Curves are followed over whole surfaces, as far as the faces' boxes overlap, and trimmed. They
//! start where triangles of both faces cross, and with more care where edges pass through faces: an
//! overlap that is thinner than the error of these triangles and inside of both faces is not found.

mod fit;
mod passes;
mod poles;
mod rejoin;
mod seeds;
mod sides;
mod start;
#[cfg(test)]
mod tests;
mod trace;

use super::{Face, Shapes, imprint, reversed};
use crate::model::{Corner, EdgeCurve};
use crate::nearest::{nearest_on_curve, nearest_on_surface};
use crate::tessellate::{Shell, Tessellation};
use crate::{BrepError, Point};
use fit::Fitted;
use rayon::prelude::*;
use seeds::Facets;
use sides::{Side, Uses};
use std::collections::{BTreeSet, HashSet};
use trace::{Branch, Pair};

/// Boxes are enlarged by this (fraction of the diagonal): triangles are inside of their surface.
const ROOM: f64 = 0.01;
/// Intersections this close to an edge on the other face are that edge (in tolerances).
const AT_EDGE: f64 = 10.0;
/// Two faces cross in at most this many branches.
const MOST_BRANCHES: usize = 100;

/// How closely solids are compared.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Care {
    /// Places within the accuracy that the file states are one, and branches start where triangles
    /// cross.
    Usual,
    /// Places as close as edges are to their faces are one: many programs state an accuracy of 0.01
    /// whatever a file holds. Branches also start where edges pass through faces.
    High,
}

/// What faces that cross are searched with.
struct Search<'a> {
    care: Care,
    facets: &'a Facets,
    tessellation: &'a Tessellation,
    size: f64,
}

/// What was cut.
#[derive(Default)]
pub(crate) struct Cuts {
    /// Pairs of bodies of which the first is cut out of the second.
    pub pairs: BTreeSet<[usize; 2]>,
    /// Bodies without faces now, because they repeat another one, each with that.
    pub repeated: Vec<[usize; 2]>,
}

/// What two faces have in common.
struct Crossing {
    faces: [usize; 2],
    /// The curves of each that lie on the surface of the other one.
    on: [Vec<usize>; 2],
    /// Other curves of both surfaces.
    added: Vec<Fitted>,
}

impl Shapes {
    /// Cuts the common part of solids that overlap out of all but the one of least `rank`. The
    /// triangles and shells are those of the model of these shapes.
    ///
    /// # Errors
    /// [`BrepError::Solid`] if it cannot be decided what is inside of what, and for a solid of
    /// which nothing is left.
    pub fn cut_overlaps(
        &mut self,
        care: Care,
        tessellation: &Tessellation,
        shells: &[Vec<Shell>],
        rank: &[usize],
    ) -> Result<Cuts, BrepError> {
        let (size, corners) = (self.size(), self.corners.len());
        let patches = self.faces.iter().map(|face| face.id as usize).max().unwrap_or(0);
        let facets = Facets::new(tessellation, patches);
        imprint::take_measured_gaps(self);
        if care == Care::High {
            self.take_accuracies();
        }
        let contacts = imprint::contacts(self, size);
        self.orient_planes(size);
        let search = Search { care, facets: &facets, tessellation, size };
        let crossings = self.crossings(&search, &contacts);
        let crossed: Vec<[usize; 2]> =
            crossings.iter().filter(|one| !one.added.is_empty()).map(|one| one.faces).collect();
        crossings.into_iter().for_each(|crossing| self.add_crossing(crossing, size));
        self.turn_spheres();
        imprint::trim(self, &crossed, size);
        imprint::divide(self, contacts, size);
        let cuts = self.assign(shells, rank)?;
        self.rejoin(corners);
        Ok(cuts)
    }

    /// Turns loops around planes that are clockwise around the normal.
    fn orient_planes(&mut self, size: f64) {
        for face in 0..self.faces.len() {
            if imprint::is_clockwise(self, face, size) {
                let loops = std::mem::take(&mut self.faces[face].loops);
                self.faces[face].loops = loops.into_iter().map(reversed).collect();
            }
        }
    }

    /// Where faces of different bodies cross that have not the same surface.
    fn crossings(&self, search: &Search, contacts: &[[usize; 2]]) -> Vec<Crossing> {
        let Search { facets, size, .. } = *search;
        let touch: HashSet<[usize; 2]> = contacts.iter().copied().collect();
        let patch = |face: usize| self.faces[face].id as usize - 1;
        let mut order: Vec<usize> = (0..self.faces.len()).collect();
        let low = |face: usize| facets.bounds[patch(face)][0].x;
        order.sort_by(|&a, &b| low(a).total_cmp(&low(b)));
        let beside = |k: usize| -> Vec<[usize; 2]> {
            let face = order[k];
            let end = facets.bounds[patch(face)][1].x + ROOM * size;
            let near = order[k + 1..].iter().copied().take_while(|&other| low(other) <= end);
            let found = near.filter(|&other| {
                self.faces[face].body != self.faces[other].body
                    && !touch.contains(&[face.min(other), face.max(other)])
                    && facets.common([patch(face), patch(other)], ROOM * size).is_some()
            });
            found.map(|other| [face.min(other), face.max(other)]).collect()
        };
        let mut pairs: Vec<[usize; 2]> = (0..order.len()).into_par_iter().flat_map_iter(beside).collect();
        pairs.sort_unstable();
        let cross = |faces: &[usize; 2]| self.crossing(search, *faces);
        pairs.par_iter().map(cross).collect()
    }

    /// What two faces have in common.
    fn crossing(&self, search: &Search, faces: [usize; 2]) -> Crossing {
        let Search { care, facets, size, .. } = *search;
        let patches = faces.map(|face| self.faces[face].id as usize - 1);
        let room = imprint::room(self, faces, size);
        let near = [0, 1].map(|k| self.near_curves(search, faces[k], patches[1 - k]));
        let on = [0, 1].map(|k| {
            let surface = &self.faces[faces[1 - k]].surface;
            let lies_on = |curve: &usize| imprint::lies_on(surface, &self.curves[*curve], room);
            near[k].iter().copied().filter(lies_on).collect()
        });
        let mut crossing = Crossing { faces, on, added: Vec::new() };
        if let Some(bounds) = facets.common(patches, ROOM * size) {
            let pair = Pair { surfaces: faces.map(|face| &self.faces[face].surface), bounds, size };
            let mut places = facets.crossings(patches);
            if care == Care::High {
                places.extend(self.passes(&near, &crossing));
            }
            let branches = self.branches(&pair, places, &crossing, room);
            crossing.added = branches.iter().filter_map(|branch| fit::curve(branch, size)).collect();
        }
        crossing
    }

    /// The curves of a face that are near a patch.
    fn near_curves(&self, search: &Search, face: usize, patch: usize) -> Vec<usize> {
        let Search { facets, tessellation, size, .. } = *search;
        let is_near = |curve: &usize| {
            let points = tessellation.lines[*curve].iter().map(|on| tessellation.points[on.0 as usize]);
            facets.is_near(patch, points, ROOM * size)
        };
        self.curves_of(face).into_iter().filter(is_near).collect()
    }

    /// The places where edges of one face of a crossing, those of each that are near the other one,
    /// pass through the surface of that, with the parameters on both.
    fn passes(&self, near: &[Vec<usize>; 2], crossing: &Crossing) -> Vec<(Point, [[f64; 2]; 2])> {
        let surfaces = crossing.faces.map(|face| &self.faces[face].surface);
        let of = |k: usize| {
            let others = near[k].iter().copied().filter(move |curve| !crossing.on[k].contains(curve));
            let passes = others.flat_map(move |curve| passes::passes(surfaces[1 - k], &self.curves[curve]));
            passes.map(move |(place, there)| {
                let own = nearest_on_surface(surfaces[k], &place).parameters;
                (place, if k == 0 { [own, there] } else { [there, own] })
            })
        };
        (0..2).flat_map(of).collect()
    }

    /// The branches through some places near two surfaces, except those that are edges.
    fn branches(
        &self,
        pair: &Pair,
        places: Vec<(Point, [[f64; 2]; 2])>,
        crossing: &Crossing,
        room: f64,
    ) -> Vec<Branch> {
        let mut branches: Vec<Branch> = Vec::new();
        for (place, parameters) in places {
            let Some(start) = pair.meet(place, parameters) else { continue };
            let is_known = !pair.contains(&start.point)
                || branches.iter().any(|branch| pair.is_on(branch, &start))
                || crossing.on.iter().flatten().any(|&curve| {
                    let edge = &self.curves[curve];
                    let foot = nearest_on_curve(&edge.curve, &start.point);
                    // The rest of a circle is an edge of the face beside this one.
                    let is_on_edge = edge.curve.period().is_some()
                        || (edge.range[0]..=edge.range[1]).contains(&foot.parameter);
                    is_on_edge
                        && ((foot.point - start.point).norm() <= AT_EDGE * room
                            || pair.gap(&nalgebra::center(&foot.point, &start.point)) <= room)
                });
            if !is_known && branches.len() < MOST_BRANCHES {
                let mut branch = pair.branch(start);
                self.move_start(pair, &mut branch, crossing.faces, room);
                branches.push(branch);
            }
        }
        branches
    }

    /// Adds the curves of a crossing to its faces.
    fn add_crossing(&mut self, crossing: Crossing, size: f64) {
        for (k, on_other) in crossing.on.into_iter().enumerate() {
            let [face, other] = [crossing.faces[k], crossing.faces[1 - k]];
            // Seams are left out when the face is divided; the other face divides it there, too.
            let once = self.curves_used_once(face);
            let is_seam = |curve: &usize| once.binary_search(curve).is_err();
            let seams: Vec<usize> = on_other.iter().copied().filter(is_seam).collect();
            self.faces[face].inner.extend(seams);
            self.faces[other].inner.extend(on_other);
        }
        let body = self.faces[crossing.faces[0]].body;
        let tolerance = fit::ACCURACY * size;
        for Fitted { curve, range, is_closed } in crossing.added {
            let mut end = |t: f64| {
                let point = Point::from(curve.point(t));
                self.add_corner(Corner { point, tolerance }, body)
            };
            let first = end(range[0]);
            let ends = [first, if is_closed { first } else { end(range[1]) }];
            self.curves.push(EdgeCurve { curve, range, ends, tolerance });
            self.body_of_curve.push(body);
            for face in crossing.faces {
                self.faces[face].inner.push(self.curves.len() - 1);
            }
        }
    }

    /// Leaves out faces inside of solids of lower rank, and gives faces inside of solids of higher
    /// rank to these, too.
    fn assign(&mut self, shells: &[Vec<Shell>], rank: &[usize]) -> Result<Cuts, BrepError> {
        let sides = self.sides(shells)?;
        let mut cuts = Cuts::default();
        let mut kept = Vec::new();
        let mut taken: Vec<BTreeSet<(usize, bool)>> = vec![BTreeSet::new(); rank.len()];
        for (face, sides) in std::mem::take(&mut self.faces).into_iter().zip(sides) {
            let body = face.body;
            let takes = |&&(other, side): &&(usize, Side)| {
                rank[other] < rank[body] && matches!(side, Side::Inside | Side::Same)
            };
            if let Some(&(other, side)) = sides.iter().find(takes) {
                cuts.pairs.insert([other, body]);
                taken[body].insert((other, side == Side::Same));
                continue;
            }
            let beside = sides.iter().filter(|(_, side)| matches!(side, Side::Inside | Side::Opposite));
            if let Some(&(other, Side::Inside)) = beside.min_by_key(|(other, _)| rank[*other]) {
                cuts.pairs.insert([body, other]);
                kept.push(Face { body: other, is_behind: !face.is_behind, ..face.clone() });
            }
            kept.push(face);
        }
        self.faces = kept;
        let left: HashSet<usize> = self.faces.iter().map(|face| face.body).collect();
        for body in (0..rank.len()).filter(|body| !left.contains(body)) {
            let mut by = taken[body].iter();
            match (by.next(), by.next()) {
                (Some(&(other, true)), None) => {
                    cuts.pairs.remove(&[other, body]);
                    cuts.repeated.push([body, other]);
                }
                (Some(&(other, _)), _) => {
                    let what = format!(
                        "nothing is left of it: it lies inside of solid {}, which keeps what both have: give that \
                         to the smaller solid, or leave one of them out",
                        other + 1
                    );
                    return Err(BrepError::solid(body, what, None));
                }
                (None, _) => {}
            }
        }
        Ok(cuts)
    }

    /// The bodies near each face, with the side of them on which it is.
    fn sides(&self, shells: &[Vec<Shell>]) -> Result<Vec<Vec<(usize, Side)>>, BrepError> {
        let uses = Uses::new(self);
        let is_near =
            |a: &usize, b: &usize| shells[*a].iter().any(|s| shells[*b].iter().any(|t| s.is_near(t)));
        let bodies = 0..shells.len();
        let pairs: Vec<[usize; 2]> = bodies
            .clone()
            .flat_map(|a| bodies.clone().filter(move |b| *b != a).map(move |b| [a, b]))
            .filter(|[a, b]| is_near(a, b))
            .collect();
        let found: Vec<_> = pairs
            .par_iter()
            .map(|&[body, other]| Ok((other, uses.sides(body, other, &shells[other])?)))
            .collect::<Result<_, BrepError>>()?;
        let mut sides = vec![Vec::new(); self.faces.len()];
        for (other, of) in found {
            of.into_iter().for_each(|(face, side)| sides[face].push((other, side)));
        }
        Ok(sides)
    }
}
