//! Polyhedra as Boolean trees over the planes of their faces.
//!
//! A binary space partition by the planes of the faces ends in cells that are all inside or all outside; the
//! tree of the partition is a formula for the polyhedron (Thibault, Naylor 1987, section 4; Paterson, Yao 1990
//! bound its size). No other planes come in. A plane that cuts faces also cuts the inside, but both
//! sides of it are inside there, which is how any two solids that touch look.

use std::collections::BTreeMap;

use super::primitive::{Shape, direction};
use crate::geometry::Span;
use crate::language::ast::PolyFace;
use crate::language::diagnostic::{Report, Reported};
use crate::primitive::Plane;
use crate::{Point, Solid, Surface, SurfaceId, Vector};

/// Most faces: the partition takes quadratic time, and so does whoever evaluates the tree at many points.
const MOST_FACES: usize = 10_000;
/// How far a point may be from a plane and still count as on it, as a fraction of the polyhedron's size.
/// Coordinates typed with ten digits (a rotated cube) deviate by 10⁻¹⁰, edges are longer than 10⁻⁸.
const ON_PLANE: f64 = 1e-9;
/// Deepest nesting of cuts that have faces on both sides, and of unions within intersections; a comb of hundreds of
/// teeth has a dozen.
const DEEPEST_CUT: usize = 150;
/// How many faces are tried for a cut.
const CANDIDATES: usize = 24;

/// A convex piece of a face, its plane and whether the outside is on the plane's negative side.
#[derive(Clone, Debug)]
struct Piece {
    points: Vec<Point>,
    plane: usize,
    flipped: bool,
}

/// The polyhedron with these faces, whose point numbers count from 1.
pub(super) fn shape(
    points: &[Point],
    faces: &[PolyFace],
    span: Span,
    report: &mut Report,
) -> Result<Shape, Reported> {
    if faces.len() > MOST_FACES {
        let message = format!("a `polyhedron` of {} faces; {MOST_FACES} can be meshed", faces.len());
        return Err(report.unsupported(span, message, ""));
    }
    let mut triangles = Vec::new();
    for (index, face) in faces.iter().enumerate() {
        for triangle in face_triangles(face, points.len(), report)? {
            triangles.push((triangle, index));
        }
    }
    closed(&triangles, faces, report)?;
    let size = points.iter().flat_map(|p| points.first().map(|q| (p - q).norm())).fold(0.0, f64::max);
    let mut builder = Builder { planes: Vec::new(), tolerance: ON_PLANE * size };
    let mut pieces = Vec::new();
    let mut surfaces = Vec::new();
    let mut face_of_surface = Vec::new();
    for &(triangle, face) in &triangles {
        let corners = triangle.map(|i| points[i as usize - 1]);
        let Some(plane) = plane_of(&corners, builder.tolerance) else {
            continue;
        };
        pieces.push(builder.piece(&corners, plane.clone(), surfaces.len()));
        surfaces.push(Surface::Plane(plane));
        face_of_surface.push(face);
    }
    every_face_has_area(faces, &face_of_surface, report)?;
    let volume: f64 = triangles.iter().map(|(t, _)| signed_volume(points, *t)).sum();
    if volume <= 0.0 {
        let message = "the faces of `polyhedron` enclose no volume from outside";
        let help = "list the points of each face counter-clockwise as seen from outside";
        return Err(report.meaning(span, message, help));
    }
    let Some(inside) = builder.partition(pieces.clone(), 0) else {
        return Err(report.unsupported(span, "a `polyhedron` with too many dents one in another", ""));
    };
    if let Some(bad) = pieces.iter().position(|piece| !builder.separates(&inside, piece)) {
        let message = "faces of `polyhedron` cross, or one is inside out";
        let help = "its faces may meet at common edges and points only";
        return Err(report.meaning(faces[face_of_surface[bad]].span, message, help));
    }
    Ok(Shape { surfaces, inside, faces: face_of_surface, joints: Vec::new() })
}

/// The triangles of a face: one, or two for four points; repeated points are dropped.
fn face_triangles(face: &PolyFace, count: usize, report: &mut Report) -> Result<Vec<[u32; 3]>, Reported> {
    let mut distinct: Vec<u32> = Vec::new();
    for number in &face.points {
        if number.value.fract() != 0.0 || !(1.0..=count as f64).contains(&number.value) {
            let message = format!("there is no point {} in this `polyhedron`", number.value);
            let help = format!("its points have the numbers 1 to {count}");
            return Err(report.meaning(number.span, message, &help));
        }
        if !distinct.contains(&(number.value as u32)) {
            distinct.push(number.value as u32);
        }
    }
    match distinct[..] {
        [a, b, c] => Ok(vec![[a, b, c]]),
        [a, b, c, d] => Ok(vec![[a, b, c], [a, c, d]]),
        _ => {
            let message = "a face of a `polyhedron` needs three different points";
            Err(report.meaning(face.span, message, ""))
        }
    }
}

/// Each edge is run as often in one direction as in the other.
fn closed(triangles: &[([u32; 3], usize)], faces: &[PolyFace], report: &mut Report) -> Result<(), Reported> {
    let mut balance: BTreeMap<[u32; 2], (i64, usize)> = BTreeMap::new();
    for &([a, b, c], face) in triangles {
        for [from, to] in [[a, b], [b, c], [c, a]] {
            let entry = balance.entry([from.min(to), from.max(to)]).or_insert((0, face));
            entry.0 += if from < to { 1 } else { -1 };
        }
    }
    let Some(([from, to], &(_, face))) = balance.iter().find(|(_, (sum, _))| *sum != 0).map(|(k, v)| (*k, v))
    else {
        return Ok(());
    };
    let message =
        format!("the faces of `polyhedron` do not close at the edge from point {from} to point {to}");
    let help = "each edge has two faces, which run along it in opposite directions";
    Err(report.meaning(faces[face].span, message, help))
}

/// A quadrilateral may have three points on a line, then one of its halves has no area; a face must have some.
fn every_face_has_area(
    faces: &[PolyFace],
    face_of_surface: &[usize],
    report: &mut Report,
) -> Result<(), Reported> {
    let mut has_area = vec![false; faces.len()];
    for &face in face_of_surface {
        has_area[face] = true;
    }
    match has_area.iter().position(|has| !has) {
        Some(face) => {
            Err(report.meaning(faces[face].span, "the points of this face of `polyhedron` are on a line", ""))
        }
        None => Ok(()),
    }
}

fn signed_volume(points: &[Point], triangle: [u32; 3]) -> f64 {
    let [a, b, c] = triangle.map(|i| points[i as usize - 1] - points[0]);
    a.dot(&b.cross(&c)) / 6.0
}

/// The plane through three points, its normal where they run counter-clockwise; none if they are on a line.
fn plane_of(corners: &[Point; 3], tolerance: f64) -> Option<Plane> {
    let [a, b, c] = *corners;
    let normal = (b - a).cross(&(c - a));
    let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    if normal.norm() <= tolerance * longest {
        return None;
    }
    Some(Plane { point: a, normal: direction(&normal)? })
}

/// The planes of the faces, equal ones made one.
struct Builder {
    /// Each with the surface that stands for it.
    planes: Vec<(Plane, usize)>,
    /// A length.
    tolerance: f64,
}

impl Builder {
    fn distance(&self, plane: usize, point: &Point) -> f64 {
        let (plane, _) = &self.planes[plane];
        plane.normal.dot(&(point - plane.point))
    }

    fn contains(&self, plane: usize, points: &[Point]) -> bool {
        points.iter().all(|point| self.distance(plane, point).abs() <= self.tolerance)
    }

    /// A face that belongs to the surface with index `surface`.
    fn piece(&mut self, corners: &[Point; 3], plane: Plane, surface: usize) -> Piece {
        let known = (0..self.planes.len()).find(|&known| self.contains(known, corners));
        let known = known.unwrap_or_else(|| {
            self.planes.push((plane.clone(), surface));
            self.planes.len() - 1
        });
        let flipped = self.planes[known].0.normal.dot(&plane.normal) < 0.0;
        Piece { points: corners.to_vec(), plane: known, flipped }
    }

    /// The inner side of a piece's plane.
    fn half(&self, piece: &Piece) -> Solid {
        let surface = SurfaceId::new(self.planes[piece.plane].1);
        Solid::Half { surface, positive: piece.flipped }
    }

    /// The inside of the pieces, given that at least one bounds the cell they are in; `None` if it is too deep.
    fn partition(&self, mut pieces: Vec<Piece>, depth: usize) -> Option<Solid> {
        // Cuts with faces on one side only, outermost first: whether all else is met with the half-space or
        // joined to it.
        let mut shells: Vec<(bool, Solid)> = Vec::new();
        let mut solid = loop {
            let turns = shells.windows(2).filter(|pair| pair[0].0 != pair[1].0).count();
            if depth + turns > DEEPEST_CUT {
                return None;
            }
            let cut = self.best_cut(&pieces)?;
            let half = self.half(&pieces[cut]);
            let (inner, outer) = self.split(pieces, cut);
            match (inner.is_empty(), outer.is_empty()) {
                (true, true) => break half,
                (false, true) => {
                    shells.push((true, half));
                    pieces = inner;
                }
                (true, false) => {
                    shells.push((false, half));
                    pieces = outer;
                }
                (false, false) => {
                    let inner = self.partition(inner, depth + turns + 1)?;
                    let outer = self.partition(outer, depth + turns + 1)?;
                    let beyond = complement_of_half(&half);
                    break join(false, join(true, half, inner), join(true, beyond, outer));
                }
            }
        };
        while let Some((meets, half)) = shells.pop() {
            solid = join(meets, half, solid);
        }
        Some(solid)
    }

    /// Among some of the pieces the first whose plane has all others on one side, or else one that cuts few and
    /// balances.
    fn best_cut(&self, pieces: &[Piece]) -> Option<usize> {
        let stride = pieces.len().div_ceil(CANDIDATES).max(1);
        let mut best: Option<(usize, usize)> = None;
        for candidate in (0..pieces.len()).step_by(stride) {
            let (mut inner, mut outer, mut cut) = (0_usize, 0_usize, 0_usize);
            for piece in pieces {
                let [behind, before] = self.sides(pieces[candidate].plane, piece);
                inner += usize::from(behind);
                outer += usize::from(before);
                cut += usize::from(behind && before);
            }
            if inner == 0 || outer == 0 {
                return Some(candidate);
            }
            let cost = 8 * cut + inner.abs_diff(outer);
            if best.is_none_or(|(least, _)| cost < least) {
                best = Some((cost, candidate));
            }
        }
        best.map(|(_, candidate)| candidate)
    }

    /// Whether the piece has points behind the plane, and before it.
    fn sides(&self, plane: usize, piece: &Piece) -> [bool; 2] {
        if piece.plane == plane {
            return [false, false];
        }
        let any = |sign: f64| piece.points.iter().any(|p| sign * self.distance(plane, p) > self.tolerance);
        [any(-1.0), any(1.0)]
    }

    /// The pieces on the inner and on the outer side of one of them; those in its plane are done.
    fn split(&self, pieces: Vec<Piece>, cut: usize) -> (Vec<Piece>, Vec<Piece>) {
        let Piece { plane, flipped, .. } = pieces[cut];
        let (mut behind, mut before) = (Vec::new(), Vec::new());
        for piece in pieces {
            match self.sides(plane, &piece) {
                [true, true] => {
                    behind.push(self.clipped(&piece, plane, -1.0));
                    before.push(self.clipped(&piece, plane, 1.0));
                }
                [true, false] => behind.push(piece),
                [false, true] => before.push(piece),
                [false, false] => {}
            }
        }
        if flipped { (before, behind) } else { (behind, before) }
    }

    /// What of the piece is on the side of the plane with this sign (Sutherland, Hodgman 1974).
    fn clipped(&self, piece: &Piece, plane: usize, sign: f64) -> Piece {
        let mut points = Vec::new();
        for (i, p) in piece.points.iter().enumerate() {
            let q = &piece.points[(i + 1) % piece.points.len()];
            let (dp, dq) = (sign * self.distance(plane, p), sign * self.distance(plane, q));
            if dp >= -self.tolerance {
                points.push(*p);
            }
            if (dp > self.tolerance && dq < -self.tolerance) || (dp < -self.tolerance && dq > self.tolerance)
            {
                points.push(p + (q - p) * (dp / (dp - dq)));
            }
        }
        Piece { points, ..*piece }
    }

    /// Whether the tree is inside behind the piece and outside before it, at a point that is on no other plane.
    fn separates(&self, solid: &Solid, piece: &Piece) -> bool {
        const WEIGHTS: [[f64; 3]; 4] =
            [[0.34, 0.35, 0.31], [0.21, 0.58, 0.21], [0.55, 0.17, 0.28], [0.13, 0.29, 0.58]];
        let clear = |point: &Point| {
            (0..self.planes.len())
                .all(|plane| plane == piece.plane || self.distance(plane, point).abs() > self.tolerance)
        };
        let sample = |weights: &[f64; 3]| {
            let sum: Vector = piece.points.iter().zip(weights).map(|(p, w)| p.coords * *w).sum();
            Point::from(sum)
        };
        // On other planes at all samples: nothing can be told.
        let Some(point) = WEIGHTS.iter().map(sample).find(clear) else {
            return true;
        };
        let inner = piece.flipped;
        self.evaluate(solid, &point, piece.plane, inner) && !self.evaluate(solid, &point, piece.plane, !inner)
    }

    /// The tree at a point, taken to be on the positive side of `plane` or on its negative side.
    fn evaluate(&self, solid: &Solid, point: &Point, plane: usize, positive_side: bool) -> bool {
        match solid {
            Solid::Half { surface, positive } => {
                let index = self.planes.partition_point(|(_, first)| *first < surface.index());
                let side = if index == plane { positive_side } else { self.distance(index, point) > 0.0 };
                side == *positive
            }
            Solid::And(members) => members.iter().all(|m| self.evaluate(m, point, plane, positive_side)),
            Solid::Or(members) => members.iter().any(|m| self.evaluate(m, point, plane, positive_side)),
            Solid::Not(member) => !self.evaluate(member, point, plane, positive_side),
        }
    }
}

fn complement_of_half(half: &Solid) -> Solid {
    match half {
        Solid::Half { surface, positive } => Solid::Half { surface: *surface, positive: !positive },
        other => Solid::Not(Box::new(other.clone())),
    }
}

/// The intersection (`meet`) or union of two, in one list where the second is of the same kind.
fn join(meet: bool, first: Solid, second: Solid) -> Solid {
    let mut members = vec![first];
    match (second, meet) {
        (Solid::And(more), true) | (Solid::Or(more), false) => members.extend(more),
        (other, _) => members.push(other),
    }
    if meet { Solid::And(members) } else { Solid::Or(members) }
}
