//! Tetrahedralisation of small polyhedra without interior points, by backtracking.
//!
//! Used if flips fail, and to delete Steiner points (small polyhedron reconnection: Liu, Chen, Sun
//! 2009; cavity retriangulation: Marot, Verhetsel, Remacle 2020). The search puts a tet on one open
//! face after another, first on the one with the fewest choices, and backtracks if a face has none.
//!
//! No intersection tests are needed for correctness: if all faces are matched with opposite
//! orientations and all tets are positive by exact sign, then each interior point is in exactly one
//! tet and each exterior point in none, because the winding numbers of the tets add up to that of
//! the boundary.

use super::tetrahedra::Tetrahedra;
use crate::Point;
use crate::ground::kernel::predicates::Sign;
use crate::ground::kernel::quality::mean_ratio;
use crate::ground::kernel::simplex::{from_lowest, volume6};
use std::collections::HashMap;

/// Limits of a search.
#[derive(Clone, Copy, Debug)]
pub(super) struct Effort {
    /// Polyhedra with more vertices are skipped.
    pub vertices: usize,
    /// The most tets tried; the search subtracts those it used.
    pub tries: usize,
}

/// Relative excess of volume allowed during the search, for rounding.
const VOLUME_SLACK: f64 = 1e-9;

/// Tets of mean ratio `least` or more that fill a closed surface, or `None` if the search finds
/// none.
///
/// The faces of `skin` are oriented outward. The tets use the vertices of `skin` and any of the
/// `free` vertices. Most polyhedra that can be filled need only a few more tries than they have
/// faces.
pub(super) fn fill(
    mesh: &Tetrahedra,
    skin: &[[u32; 3]],
    free: &[u32],
    least: f64,
    effort: &mut Effort,
) -> Option<Vec<[u32; 4]>> {
    let mut vertices: Vec<u32> = skin.iter().flatten().chain(free).copied().collect();
    vertices.sort_unstable();
    vertices.dedup();
    if vertices.len() > effort.vertices {
        return None;
    }
    let corners = Corners { mesh, vertices: &vertices };
    let number = |v: u32| vertices.binary_search(&v).expect("a vertex of the skin") as u8;
    let skin: Vec<Face> = skin.iter().map(|f| from_lowest(f.map(number))).collect();
    let volume = |&f: &Face| {
        let [a, b, c] = f.map(|i| corners.point(i));
        volume6(corners.point(0), a, b, c)
    };
    let room = skin.iter().map(volume).sum::<f64>() * (1.0 + VOLUME_SLACK);
    let mut search = Search {
        corners,
        skin: &skin,
        least,
        known: HashMap::new(),
        open: skin.clone(),
        tets: Vec::new(),
        room,
        tries: &mut effort.tries,
    };
    search.run().then(|| search.tets.iter().map(|tet| tet.map(|i| vertices[i as usize])).collect())
}

/// Local vertex numbers of a face, rotated so that the lowest is first.
type Face = [u8; 3];

/// Whether the segment between two corners crosses the boundary, so that it cannot be an edge.
fn is_outside(corners: Corners, skin: &[Face], [u, v]: [u8; 2]) -> bool {
    skin.iter().filter(|f| !f.contains(&u) && !f.contains(&v)).any(|&[a, b, c]| {
        let (one, other) = (corners.side([a, b, c, u]), corners.side([a, b, c, v]));
        one != Sign::Zero && one == other.flipped() && {
            let turns = [corners.side([u, v, a, b]), corners.side([u, v, b, c]), corners.side([u, v, c, a])];
            turns[0] != Sign::Zero && turns.iter().all(|&t| t == turns[0])
        }
    })
}

/// A tet that may be put on an open face.
#[derive(Clone, Copy, Debug)]
struct Choice {
    apex: u8,
    quality: f64,
    volume: f64,
}

/// The vertices of the polyhedron by local number.
#[derive(Clone, Copy)]
struct Corners<'a> {
    mesh: &'a Tetrahedra,
    vertices: &'a [u32],
}

impl<'a> Corners<'a> {
    fn point(self, i: u8) -> &'a Point {
        self.mesh.point(self.vertices[i as usize])
    }

    fn side(self, tet: [u8; 4]) -> Sign {
        let [a, b, c, d] = tet.map(|i| self.vertices[i as usize]);
        self.mesh.side([a, b, c], d)
    }
}

struct Search<'a> {
    corners: Corners<'a>,
    skin: &'a [Face],
    least: f64,
    /// Candidate tets of each face that was open, regardless of other tets. Never iterated.
    known: HashMap<Face, Vec<Choice>>,
    /// The boundary faces of the unfilled part, outward.
    open: Vec<Face>,
    tets: Vec<[u8; 4]>,
    /// Six times the unfilled volume.
    room: f64,
    tries: &'a mut usize,
}

impl Search<'_> {
    /// Fills the open part; on failure the state is restored.
    fn run(&mut self) -> bool {
        let Some((face, choices)) = self.tightest() else { return true };
        for choice in choices {
            if *self.tries == 0 {
                return false;
            }
            *self.tries -= 1;
            let (open, room) = (self.open.clone(), self.room);
            self.put(face, choice);
            if self.run() {
                return true;
            }
            (self.open, self.room) = (open, room);
            self.tets.pop();
        }
        false
    }

    /// The open face with the fewest choices, and its choices, the best first; `None` if no face is
    /// open.
    fn tightest(&mut self) -> Option<(Face, Vec<Choice>)> {
        let mut best: Option<(Face, Vec<Choice>)> = None;
        for i in 0..self.open.len() {
            let face = self.open[i];
            self.find_choices(face);
            let fits = |choice: &&Choice| {
                let [a, b, c] = face;
                let v = choice.apex;
                // The new faces must not duplicate open ones.
                let doubled =
                    [[a, b, v], [b, c, v], [c, a, v]].iter().any(|&f| self.open.contains(&from_lowest(f)));
                choice.volume <= self.room && !doubled
            };
            let choices: Vec<Choice> = self.known[&face].iter().filter(fits).copied().collect();
            if best.as_ref().is_none_or(|(_, other)| choices.len() < other.len()) {
                let few = choices.len() < 2;
                best = Some((face, choices));
                if few {
                    break;
                }
            }
        }
        best
    }

    /// Computes all candidate tets of a face, the best first.
    fn find_choices(&mut self, face: Face) {
        if self.known.contains_key(&face) {
            return;
        }
        let [a, b, c] = face;
        let mut choices = Vec::new();
        for v in (0..self.corners.vertices.len() as u8).filter(|v| !face.contains(v)) {
            if self.corners.side([v, a, b, c]) != Sign::Positive {
                continue;
            }
            let [p, x, y, z] = [v, a, b, c].map(|i| self.corners.point(i));
            let quality = mean_ratio(p, x, y, z).max(0.0);
            let leaves = || face.iter().any(|&i| is_outside(self.corners, self.skin, [i, v]));
            if quality >= self.least && !leaves() {
                choices.push(Choice { apex: v, quality, volume: volume6(p, x, y, z) });
            }
        }
        choices.sort_by(|one, other| other.quality.total_cmp(&one.quality).then(one.apex.cmp(&other.apex)));
        self.known.insert(face, choices);
    }

    /// Puts a tet on an open face.
    fn put(&mut self, face: Face, Choice { apex, volume, .. }: Choice) {
        let [a, b, c] = face;
        self.tets.push([apex, a, b, c]);
        self.room -= volume;
        self.open.retain(|&f| f != face);
        // An open face opposite to a new one is closed; the other faces of the tet become open.
        for [u, v] in [[a, b], [b, c], [c, a]] {
            match self.open.iter().position(|&f| f == from_lowest([v, u, apex])) {
                Some(i) => drop(self.open.swap_remove(i)),
                None => self.open.push(from_lowest([u, v, apex])),
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::f64::consts::TAU;

    /// A triangular prism with rotated top: for a negative turn the polyhedron of Schönhardt
    /// (1928).
    fn prism(turn: f64) -> (Vec<Point>, Vec<[u32; 3]>) {
        let at = |i: u32, z: f64| {
            let angle = TAU / 3.0 * f64::from(i) + turn * z;
            Point::new(angle.cos(), angle.sin(), z)
        };
        let points = (0..6).map(|i| at(i % 3, f64::from(i / 3))).collect();
        let mut skin = vec![[0, 2, 1], [3, 4, 5]];
        for i in 0..3 {
            let (a, b, c, d) = (i, (i + 1) % 3, 3 + (i + 1) % 3, 3 + i);
            skin.extend([[a, b, d], [b, c, d]]);
        }
        (points, skin)
    }

    fn effort(tries: usize) -> Effort {
        Effort { vertices: 24, tries }
    }

    fn volume(points: &[Point], tets: &[[u32; 4]]) -> f64 {
        let six = |t: &[u32; 4]| {
            let [a, b, c, d] = t.map(|v| &points[v as usize]);
            volume6(a, b, c, d)
        };
        tets.iter().map(six).sum()
    }

    #[test]
    fn a_prism_bent_out_is_filled_with_three_tets_and_one_bent_in_with_none() {
        let (points, skin) = prism(0.3);
        let tets = fill(&Tetrahedra::new(points.clone()), &skin, &[], 0.0, &mut effort(1000)).unwrap();
        assert!(tets.len() == 3 || tets.len() == 4, "{tets:?}");
        let (points, skin) = prism(-0.3);
        assert_eq!(fill(&Tetrahedra::new(points.clone()), &skin, &[], 0.0, &mut effort(1000)), None);
    }

    #[test]
    fn a_prism_bent_in_is_filled_from_a_free_point_and_one_bent_out_too() {
        for (turn, least) in [(-0.3, 1), (0.3, 0)] {
            let (mut points, skin) = prism(turn);
            points.push(Point::new(0.0, 0.0, 0.5));
            let tets = fill(&Tetrahedra::new(points.clone()), &skin, &[6], 0.0, &mut effort(1000)).unwrap();
            assert!(tets.iter().filter(|tet| tet.contains(&6)).count() >= least, "{tets:?}");
            let whole: f64 = skin.iter().map(|&[a, b, c]| volume(&points, &[[6, a, b, c]])).sum();
            assert!((volume(&points, &tets) - whole).abs() < 1e-12 * whole);
        }
    }

    #[test]
    fn an_icosahedron_is_filled_without_gap_in_the_tries_allowed() {
        let g = 0.5 * (1.0 + 5f64.sqrt());
        let mut points = Vec::new();
        for [x, y] in [[1.0, g], [-1.0, g], [1.0, -g], [-1.0, -g]] {
            points.extend([[0.0, x, y], [x, y, 0.0], [y, 0.0, x]].map(Point::from));
        }
        let mut skin = Vec::new();
        for a in 0..12u32 {
            for b in a + 1..12 {
                for c in b + 1..12 {
                    let [p, q, r] = [a, b, c].map(|v| points[v as usize]);
                    if [q - p, r - q, p - r].iter().all(|s| s.norm() < 2.1) {
                        let outward = volume6(&Point::origin(), &p, &q, &r) > 0.0;
                        skin.push(if outward { [a, b, c] } else { [a, c, b] });
                    }
                }
            }
        }
        assert_eq!(skin.len(), 20);
        let tets = fill(&Tetrahedra::new(points.clone()), &skin, &[], 0.01, &mut effort(1000)).unwrap();
        let whole: f64 = skin
            .iter()
            .map(|&[a, b, c]| {
                let [p, q, r] = [a, b, c].map(|v| points[v as usize]);
                volume6(&Point::origin(), &p, &q, &r)
            })
            .sum();
        assert!((volume(&points, &tets) - whole).abs() < 1e-12 * whole);
        assert_eq!(fill(&Tetrahedra::new(points.clone()), &skin, &[], 0.01, &mut effort(5)), None);
    }
}
