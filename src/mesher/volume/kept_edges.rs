//! Kept edges: edges inside bodies requested by the caller.
//!
//! They are recovered like those of the surface, in the mesh that is already carved: by flips, or
//! else by temporary points on the edge. Such a point p between its neighbours u and w is removed
//! again: three new points are placed around the edge, so that the edge u–w and three tets around
//! it fill the middle of the star of p; a search (`small`) fills the rest.
//!
//! ```text
//!        u                u           Side view; x are two of the three points.
//!      ╱ │ ╲            ╱ │ ╲
//!     v──p──v'   ─►    v─x│x─v'
//!      ╲ │ ╱            ╲ │ ╱
//!        w                w
//! ```
//!
//! If the search fails, the point stays and the kept edge is a chain of mesh edges.

use super::constraints::Constraints;
use super::crossing::{Crossing, trace};
use super::recover::{DEEPEST, Recovery};
use super::small::{self, Effort};
use super::steiner::middle_first;
use super::tetrahedra::Tetrahedra;
use super::{ClosedSurface, Report, VolumeError};
use crate::mesher::half_face::NONE;
use crate::{Point, Vector};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// The most temporary points on an edge, to guarantee termination. Not tuned.
const MOST_ON_EDGE: usize = 64;

/// The budget of auxiliary flips for each kept edge.
const BUDGET_EDGES: usize = 4;

/// The most tets tried in the search for a filling around an edge.
const TRIES: usize = 300;

/// Stars with more vertices are skipped.
const MOST_VERTICES: usize = 40;

/// Distances of the three points from the edge, as fractions of the distance to the star's surface.
const OFF: [f64; 3] = [0.5, 0.2, 0.02];

/// Number of rotations of the three points that are tried, within the angle between them.
const TURNS: usize = 4;

/// Why an edge cannot be a kept edge.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum KeptEdgeFault {
    /// It has an index that does not exist, or the same point twice.
    NoEdge,
    /// It leaves the bodies at one of its ends.
    Outside,
    /// It meets the surface or another kept edge at this point.
    Meets(Point),
    /// Neither flips nor points on it recovered it.
    NotRecovered,
}

impl std::fmt::Display for KeptEdgeFault {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::NoEdge => f.write_str("does not have two different points that exist"),
            Self::Outside => f.write_str("leaves the bodies at one of its ends"),
            Self::Meets(p) => {
                write!(f, "meets the surface or another kept edge at ({}, {}, {})", p.x, p.y, p.z)
            }
            Self::NotRecovered => f.write_str("could not be recovered"),
        }
    }
}

/// Recovers the kept edges of a surface; `kept` are the vertices of its kept points.
///
/// Returns the mesh edges that the kept edges consist of, each with the index of its kept edge.
///
/// # Errors
/// [`VolumeError::KeptEdge`] for the first edge that cannot be recovered.
pub(super) fn keep(
    surface: &ClosedSurface,
    mesh: &mut Tetrahedra,
    constraints: &mut Constraints,
    kept: &[u32],
    scale: f64,
    report: &mut Report,
) -> Result<Vec<([u32; 2], u32)>, VolumeError> {
    let on_surface = surface.points.len();
    let vertex =
        |i: u32| if (i as usize) < on_surface { Some(i) } else { kept.get(i as usize - on_surface).copied() };
    let refused = |mesh: &Tetrahedra, index: usize, fault: KeptEdgeFault| {
        let ends =
            surface.kept_edges[index].map(|i| vertex(i).map_or(Point::origin(), |v| mesh.point(v) / scale));
        let fault =
            if let KeptEdgeFault::Meets(place) = fault { KeptEdgeFault::Meets(place / scale) } else { fault };
        VolumeError::KeptEdge { index, ends, fault }
    };
    let mut wanted = Vec::with_capacity(surface.kept_edges.len());
    for (index, edge) in surface.kept_edges.iter().enumerate() {
        match edge.map(vertex) {
            [Some(a), Some(b)] if a != b => wanted.push([a, b]),
            _ => return Err(refused(mesh, index, KeptEdgeFault::NoEdge)),
        }
    }
    keep_edges(mesh, constraints, &wanted, report).map_err(|(index, fault)| refused(mesh, index, fault))?;
    let number: BTreeMap<[u32; 2], u32> =
        wanted.iter().map(|&[a, b]| [a.min(b), a.max(b)]).zip(0..).collect();
    let pieces = constraints.kept_edges().into_iter();
    Ok(pieces.map(|[a, b]| ([a, b], number[&constraints.line_of(a, b)])).collect())
}

/// Recovers edges between vertices of the mesh. The mesh must be carved and its facets locked.
///
/// # Errors
/// The index and the fault of the first edge that cannot be recovered.
fn keep_edges(
    mesh: &mut Tetrahedra,
    constraints: &mut Constraints,
    wanted: &[[u32; 2]],
    report: &mut Report,
) -> Result<(), (usize, KeptEdgeFault)> {
    for &[a, b] in wanted {
        constraints.keep_edge(a, b);
    }
    let mut recovery = Recovery::new(mesh, constraints, 0);
    let mut split = Vec::new();
    let most = if recovery.mesh.fits_exact() { MOST_ON_EDGE } else { 0 };
    for (i, &[a, b]) in wanted.iter().enumerate() {
        recovery.raise_budget(BUDGET_EDGES);
        recovery.most_steiner = recovery.steiner.len() + most;
        split.extend(recovery.keep_edge(a, b).map_err(|fault| (i, fault))?);
    }
    let mut left = split;
    for depth in 0..=DEEPEST {
        recovery.raise_budget(BUDGET_EDGES * left.len());
        left.retain(|p| match recovery.remove_kept_point(*p, depth) {
            Some(added) => {
                report.steiner_inside += added;
                false
            }
            None => true,
        });
    }
    report.on_kept_edges = left.len();
    if let Some(p) = left.into_iter().find(|&p| !mesh.round_in_place(p)) {
        let line = constraints.line_of(p, p);
        let index = wanted.iter().position(|&[a, b]| line == [a.min(b), a.max(b)]).expect("a kept edge");
        return Err((index, KeptEdgeFault::NotRecovered));
    }
    mesh.forget_exact();
    mesh.keep_edges(constraints.kept_edges());
    Ok(())
}

impl Recovery<'_> {
    /// Recovers edge (a, b); returns the points put on it.
    fn keep_edge(&mut self, a: u32, b: u32) -> Result<Vec<u32>, KeptEdgeFault> {
        let mut pieces = vec![[a, b]];
        let mut points = Vec::new();
        while let Some([u, v]) = pieces.pop() {
            let found = self.checked_crossings(u, v)?;
            if found.is_empty() || (0..=DEEPEST).any(|depth| self.recover_edge(u, v, depth)) {
                continue;
            }
            let p = self.split_kept_edge(u, v).ok_or(KeptEdgeFault::NotRecovered)?;
            self.constraints.forget_edge(u, v);
            for end in [u, v] {
                self.constraints.keep_edge(end, p);
                pieces.push([end, p]);
            }
            points.push(p);
        }
        Ok(points)
    }

    /// The crossings of an edge with the mesh; a fault if it crosses something that must stay.
    fn checked_crossings(&mut self, a: u32, b: u32) -> Result<Vec<Crossing>, KeptEdgeFault> {
        let mut found = Vec::new();
        if !trace(self.mesh, a, b, &mut self.star, &mut found) {
            return Err(KeptEdgeFault::Outside);
        }
        for &crossing in &found {
            let stays = match crossing {
                Crossing::Face(half_face) => self.mesh.is_locked(half_face),
                Crossing::Edge(_, [u, v]) => self.constraints.has_edge(u, v),
                Crossing::Vertex(_) => true,
            };
            if stays {
                return Err(KeptEdgeFault::Meets(self.crossing_point(a, b, crossing)));
            }
        }
        Ok(found)
    }

    /// Puts a point on a missing edge where it crosses the mesh.
    fn split_kept_edge(&mut self, a: u32, b: u32) -> Option<u32> {
        let found = self.checked_crossings(a, b).ok()?;
        let edge = self.constraints.line_of(a, b);
        middle_first(&found).find_map(|crossing| self.split_exactly(edge, [a, b], crossing, &found))
    }

    /// Removes a point from the kept edge that it splits; returns the number of points placed
    /// around the edge instead.
    fn remove_kept_point(&mut self, p: u32, depth: u32) -> Option<usize> {
        let [u, w] = self.constraints.kept_neighbours(p)[..] else { return None };
        self.shrink_star(p, depth);
        let points = self.mesh.points.len();
        self.mesh.star(p, &mut self.star);
        let skin: Vec<[u32; 3]> = self.star.iter().map(|&t| opposite(self.mesh, t, p)).collect();
        let tets = around(self.mesh, &skin, [u, w]).or_else(|| surround(self.mesh, &skin, [u, p, w]))?;
        let body = self.mesh.bodies[self.star[0] as usize];
        self.mesh.replace(&self.star, &tets, body, &mut self.flips.made);
        self.mesh.at_vertex[p as usize] = NONE;
        for end in [u, w] {
            self.constraints.forget_edge(end, p);
        }
        self.constraints.keep_edge(u, w);
        Some(self.mesh.points.len() - points)
    }

    /// Removes edges at a point where flips allow it, except kept ones: a smaller star is easier to
    /// fill.
    fn shrink_star(&mut self, p: u32, depth: u32) {
        for v in self.mesh.neighbours(p, &mut self.star) {
            self.take_budget();
            if let Some(tet) = self.mesh.tet_at_edge(p, v, &mut self.star) {
                self.remove_edge(tet, [p, v], [NONE; 2], depth);
            }
        }
    }
}

/// The face of a tet opposite to a vertex, oriented outward.
fn opposite(mesh: &Tetrahedra, tet: u32, vertex: u32) -> [u32; 3] {
    mesh.face(4 * tet + mesh.index_of(tet, vertex).expect("a vertex of the tet") as u32)
}

/// The tets around edge (u, w) if the star's surface is only a ring of vertices around it.
fn around(mesh: &Tetrahedra, skin: &[[u32; 3]], [u, w]: [u32; 2]) -> Option<Vec<[u32; 4]>> {
    let [above, below] = [u, w].map(|v| skin.iter().filter(|face| face.contains(&v)).count());
    if above + below != skin.len() || above != below {
        return None;
    }
    let tets: Vec<[u32; 4]> =
        skin.iter().filter(|face| face.contains(&u)).map(|&[a, b, c]| [w, a, b, c]).collect();
    tets.iter().all(|&tet| mesh.is_positive(tet)).then_some(tets)
}

/// Tets that fill the star of p, with the edge (u, w) and three new points around it.
fn surround(mesh: &mut Tetrahedra, skin: &[[u32; 3]], [u, p, w]: [u32; 3]) -> Option<Vec<[u32; 4]>> {
    let [from, middle, to] = [u, p, w].map(|v| *mesh.point(v));
    let along = (to - from).normalize();
    let first = along.cross(&Vector::ith(along.iamin(), 1.0)).normalize();
    let second = along.cross(&first);
    // Distance to the star's surface, without the faces at the ends.
    let away = |face: &[u32; 3]| {
        let [a, b, c] = face.map(|v| mesh.point(v));
        crate::ground::kernel::simplex::squared_distance(&middle, [a, b, c]).sqrt()
    };
    let reach =
        skin.iter().filter(|f| !f.contains(&u) && !f.contains(&w)).map(away).fold(f64::INFINITY, f64::min);
    let reach = if reach.is_finite() { reach } else { (middle - from).norm().min((to - middle).norm()) };
    let points = mesh.points.len();
    for off in OFF {
        for turn in 0..TURNS {
            let ring = [0, 1, 2].map(|k| {
                let angle = TAU / 3.0 * (f64::from(k) + turn as f64 / TURNS as f64);
                let place = middle + (first * angle.cos() + second * angle.sin()) * (off * reach);
                mesh.add_point(place)
            });
            if let Some(tets) = fill_around(mesh, skin, [u, w], ring) {
                return Some(tets);
            }
            mesh.forget_points(points);
        }
    }
    None
}

/// Three tets around an edge, and the result of a search for the rest of the star.
fn fill_around(
    mesh: &Tetrahedra,
    skin: &[[u32; 3]],
    [u, w]: [u32; 2],
    ring: [u32; 3],
) -> Option<Vec<[u32; 4]>> {
    let mut tets: Vec<[u32; 4]> = (0..3).map(|k| [u, w, ring[k], ring[(k + 1) % 3]]).collect();
    if !tets.iter().all(|&tet| mesh.is_positive(tet)) {
        return None;
    }
    // Faces of the three tets, oriented outward for the remaining cavity.
    let mut rest = skin.to_vec();
    for &[u, w, x, y] in &tets {
        rest.extend([[u, x, y], [w, y, x]]);
    }
    let mut effort = Effort { vertices: MOST_VERTICES, tries: TRIES };
    tets.extend(small::fill(mesh, &rest, &[], 0.0, &mut effort)?);
    Some(tets)
}

#[cfg(test)]
mod tests {
    use super::super::crossing::edges_of_tet;
    use super::super::samples::check_fills;
    use super::super::samples::{INSIDE, Soup};
    use super::super::samples::{twist_limit, twisted_prisms};
    use super::super::{Settings, VolumeMesh, mesh};
    use super::*;
    use crate::ground::kernel::random::Random;
    use crate::ground::size::UniformSize;
    use proptest::prelude::*;
    use std::collections::BTreeSet;

    const EMPTY: Settings = Settings { fill: false, growth: 0.3, max_tets: 1 << 20 };

    fn cube(n: usize) -> ClosedSurface {
        let mut soup = Soup::default();
        soup.brick([0.; 3], [1.; 3], n, INSIDE);
        soup.surface().unwrap()
    }

    fn edges_of(mesh: &VolumeMesh) -> BTreeSet<[u32; 2]> {
        mesh.tets.iter().flat_map(|&tet| edges_of_tet(tet)).map(|[a, b]| [a.min(b), a.max(b)]).collect()
    }

    /// Meshes with and without points inside; checks that all kept edges exist, and that at most
    /// `cut` of them are split.
    fn check_kept(surface: &ClosedSurface, size: f64, cut: usize) {
        for settings in [EMPTY, Settings::default()] {
            let (mesh, report) = mesh(surface, &UniformSize(size), &settings).unwrap();
            check_fills(surface, &mesh);
            assert!(report.on_kept_edges <= cut, "{report:?}");
            let given = surface.points().iter().chain(surface.kept_points());
            assert!(given.eq(mesh.points.iter().take(surface.points().len() + surface.kept_points().len())));
            let edges = edges_of(&mesh);
            let mut length = vec![0.0; surface.kept_edges().len()];
            for &([a, b], edge) in &mesh.kept_edges {
                assert!(edges.contains(&[a.min(b), a.max(b)]), "edge {a} {b}");
                length[edge as usize] += (mesh.points[a as usize] - mesh.points[b as usize]).norm();
            }
            let (mut whole, mut wanted) = (0, BTreeSet::new());
            for (i, &[a, b]) in surface.kept_edges().iter().enumerate().rev() {
                if wanted.insert([a.min(b), a.max(b)]) {
                    whole += usize::from(edges.contains(&[a.min(b), a.max(b)]));
                    let expected = (mesh.points[a as usize] - mesh.points[b as usize]).norm();
                    assert!((length[i] - expected).abs() < 1e-12, "edge {i}");
                }
            }
            assert!(whole + report.on_kept_edges >= wanted.len());
        }
    }

    fn random_point(random: &mut Random) -> Point {
        Point::from([0; 3].map(|_| 0.05 + 0.9 * random.unit()))
    }

    #[test]
    fn a_star_of_edges_to_the_surface_and_to_points_inside_is_kept() {
        let surface = cube(3);
        let on_surface = surface.points().len() as u32;
        let mut random = Random::new(3);
        let mut points = vec![Point::new(0.43, 0.52, 0.48)];
        points.extend((0..12).map(|_| random_point(&mut random)));
        let ends = (0..on_surface).step_by(3).chain(on_surface + 1..on_surface + 13);
        let edges = ends.map(|end| [on_surface, end]).collect();
        check_kept(&surface.with_kept_points(points).with_kept_edges(edges), 0.2, 1);
    }

    #[test]
    fn a_chain_from_wall_to_wall_and_edges_as_close_as_needles_are_kept() {
        let surface = cube(2);
        let n = surface.points().len() as u32;
        let near = |p: &Point| surface.points().iter().position(|q| (p - q).norm() < 1e-9).unwrap() as u32;
        let [from, to] = [Point::new(0.0, 0.5, 0.5), Point::new(1.0, 1.0, 1.0)].map(|p| near(&p));
        let chain = [[0.2, 0.6, 0.3], [0.5, 0.3, 0.7], [0.8, 0.9, 0.6]].map(Point::from);
        let mut points = chain.to_vec();
        let mut edges = vec![[from, n], [n, n + 1], [n + 1, n + 2], [n + 2, to]];
        for i in 0..6 {
            let beside = 1e-5 * f64::from(i * i);
            points.extend([
                Point::new(0.11, 0.1 + beside, 0.13),
                Point::new(0.9, 0.12 + beside, 0.18 + beside),
            ]);
            edges.push([n + 3 + 2 * i as u32, n + 4 + 2 * i as u32]);
        }
        check_kept(&surface.with_kept_points(points).with_kept_edges(edges), 0.3, 1);
    }

    #[test]
    fn long_edges_in_bent_prisms_are_kept() {
        for sides in [3, 7] {
            let surface = twisted_prisms(sides, -0.9 * twist_limit(sides), 3.0, 1).surface().unwrap();
            let n = surface.points().len() as u32;
            let points = [[0.02, 0.01, 0.1], [0.01, 0.03, 2.9]].map(Point::from).to_vec();
            let edges = vec![[n, n + 1], [0, n], [n + 1, n - 1]];
            check_kept(&surface.with_kept_points(points).with_kept_edges(edges), 0.5, 1);
        }
    }

    #[test]
    fn edges_that_intersect_something_or_are_degenerate_are_rejected_with_their_position() {
        let surface = cube(1);
        let n = surface.points().len() as u32;
        let corner = |p: [f64; 3]| surface.points().iter().position(|q| *q == Point::from(p)).unwrap() as u32;
        let (o, x, top) = (corner([0.; 3]), corner([1., 0., 0.]), corner([1.; 3]));
        let points = [[0.25; 3], [0.75; 3], [0.25, 0.25, 0.75], [0.75, 0.75, 0.25]].map(Point::from).to_vec();
        let middle = KeptEdgeFault::Meets(Point::new(0.5, 0.5, 0.5));
        for (edges, fault) in [
            (vec![[o, x], [n, n]], Some(KeptEdgeFault::NoEdge)),
            (vec![[o, x], [n, n + 4]], Some(KeptEdgeFault::NoEdge)),
            (vec![[n, n + 1], [n + 2, n + 3]], Some(middle)),
            (vec![[n, n + 1], [o, top]], Some(KeptEdgeFault::Meets(Point::new(0.25, 0.25, 0.25)))),
            // A duplicate, an edge of the surface, a common end.
            (vec![[n, n + 1], [n + 1, n], [o, x], [n + 1, top]], None),
        ] {
            let wanted = surface.clone().with_kept_points(points.clone()).with_kept_edges(edges);
            match (mesh(&wanted, &UniformSize(1.0), &EMPTY), fault) {
                (Err(VolumeError::KeptEdge { index: 1, fault, .. }), Some(expected)) => {
                    assert_eq!(fault, expected)
                }
                (Ok(_), None) => {}
                (other, _) => panic!("{fault:?}: {:?}", other.map(|m| m.1)),
            }
        }
    }

    #[test]
    fn edges_through_a_void_are_rejected() {
        // A cube with a cavity: an edge through the cavity, and one between points that are inside
        // the body.
        let mut soup = Soup::default();
        soup.brick([0.; 3], [3.; 3], 1, INSIDE);
        soup.brick([1.; 3], [2.; 3], 1, [None, INSIDE[0]]);
        let surface = soup.surface().unwrap();
        let corner = |p: [f64; 3]| surface.points().iter().position(|q| *q == Point::from(p)).unwrap() as u32;
        let n = surface.points().len() as u32;
        let points = [[0.5, 1.4, 1.3], [2.6, 1.6, 1.7]].map(Point::from).to_vec();
        for (edge, outside) in [([corner([1.; 3]), corner([2.; 3])], true), ([n, n + 1], false)] {
            let wanted = surface.clone().with_kept_points(points.clone()).with_kept_edges(vec![edge]);
            let Err(VolumeError::KeptEdge { index: 0, fault, .. }) = mesh(&wanted, &UniformSize(1.0), &EMPTY)
            else {
                panic!("{edge:?} was kept")
            };
            assert_eq!(fault == KeptEdgeFault::Outside, outside, "{fault:?}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 12, rng_seed: proptest::test_runner::RngSeed::Fixed(11), ..ProptestConfig::default() })]
        #[test]
        fn edges_between_random_points_are_kept(seed in any::<u64>(), points in 2..12u32, edges in 1..12u32) {
            let surface = cube(2);
            let n = surface.points().len() as u32;
            let mut random = Random::new(seed);
            let inside = (0..points).map(|_| random_point(&mut random)).collect();
            // One end is inside, so no edge lies in a side of the cube.
            let ends = (0..edges).map(|_| [n + (random.bits() % u64::from(points)) as u32, (random.bits() % u64::from(n + points)) as u32]);
            let ends = ends.filter(|[a, b]| a != b).collect();
            check_kept(&surface.with_kept_points(inside).with_kept_edges(ends), 0.4, 8);
        }
    }
}
