//! Polyhedra as Boolean trees over the planes of their faces.
//!
//! A binary space partition by the planes of the faces ends in cells that are entirely inside or
//! outside. The tree of the partition is a formula for the polyhedron (Thibault, Naylor 1987,
//! section 4; Paterson, Yao 1990 bound its size). It uses no other planes. A plane that cuts faces
//! also cuts the interior, but both of its sides are inside there, as at the interface of any two
//! solids in contact.

use std::collections::BTreeMap;

use super::primitive::{Shape, direction};
use crate::geometry::Span;
use crate::language::ast::PolyFace;
use crate::language::diagnostic::{Report, Reported};
use crate::primitive::Plane;
use crate::{Point, Solid, Surface, SurfaceId, Vector};

/// Largest number of faces: the partition takes quadratic time, and so does evaluation at many
/// points.
const MOST_FACES: usize = 10_000;
/// Largest distance of a point on a plane, as a fraction of the polyhedron's size. Coordinates with
/// ten digits (of a rotated cube) are off by 10⁻¹⁰, edges are longer than 10⁻⁸.
const ON_PLANE: f64 = 1e-9;
/// Largest nesting of cuts with faces on both sides, and of unions within intersections. A comb
/// with hundreds of teeth needs a dozen.
const DEEPEST_CUT: usize = 150;
/// Number of faces tried for a cut.
const CANDIDATES: usize = 24;

/// A convex piece of a face, its plane, and whether the outside is on the plane's negative side.
#[derive(Clone, Debug)]
struct Piece {
    points: Vec<Point>,
    plane: usize,
    flipped: bool,
}

/// The solid of a polyhedron; point numbers of the faces start at 1.
pub(super) fn shape(
    points: &[Point],
    faces: &[PolyFace],
    span: Span,
    report: &mut Report,
) -> Result<Shape, Reported> {
    if faces.len() > MOST_FACES {
        let message = format!("this `polyhedron` has {} faces, the limit is {MOST_FACES}", faces.len());
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
        let message = "the faces of `polyhedron` enclose no volume, or are oriented inward";
        let help = "list the points of each face counterclockwise as seen from outside";
        return Err(report.meaning(span, message, help));
    }
    let Some(inside) = builder.partition(pieces.clone(), 0) else {
        return Err(report.unsupported(span, "this `polyhedron` has too many nested concavities", ""));
    };
    if let Some(bad) = pieces.iter().position(|piece| !builder.separates(&inside, piece)) {
        let message = "faces of `polyhedron` cross, or one has the wrong orientation";
        let help = "faces may meet only at common edges and points";
        return Err(report.meaning(faces[face_of_surface[bad]].span, message, help));
    }
    Ok(Shape { surfaces, inside, faces: face_of_surface, joints: Vec::new() })
}

/// The triangles of a face: one, or two for four points. Repeated points are dropped.
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

/// Checks that each edge is traversed equally often in both directions.
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
    let help = "each edge needs two faces that traverse it in opposite directions";
    Err(report.meaning(faces[face].span, message, help))
}

/// Checks that each face has an area. One half of a quadrilateral with three collinear points may
/// have none.
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
            Err(report.meaning(faces[face].span, "the points of this face of `polyhedron` are collinear", ""))
        }
        None => Ok(()),
    }
}

fn signed_volume(points: &[Point], triangle: [u32; 3]) -> f64 {
    let [a, b, c] = triangle.map(|i| points[i as usize - 1] - points[0]);
    a.dot(&b.cross(&c)) / 6.0
}

/// The plane through three points, with the normal on the side where they are counterclockwise;
/// `None` if collinear.
fn plane_of(corners: &[Point; 3], tolerance: f64) -> Option<Plane> {
    let [a, b, c] = *corners;
    let normal = (b - a).cross(&(c - a));
    let longest = (b - a).norm().max((c - b).norm()).max((a - c).norm());
    if normal.norm() <= tolerance * longest {
        return None;
    }
    Some(Plane { point: a, normal: direction(&normal)? })
}

/// The distinct planes of the faces.
struct Builder {
    /// Each plane with the surface that represents it.
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

    /// The piece of a face on the surface with index `surface`.
    fn piece(&mut self, corners: &[Point; 3], plane: Plane, surface: usize) -> Piece {
        let known = (0..self.planes.len()).find(|&known| self.contains(known, corners));
        let known = known.unwrap_or_else(|| {
            self.planes.push((plane.clone(), surface));
            self.planes.len() - 1
        });
        let flipped = self.planes[known].0.normal.dot(&plane.normal) < 0.0;
        Piece { points: corners.to_vec(), plane: known, flipped }
    }

    /// The half-space on the inner side of a piece.
    fn half(&self, piece: &Piece) -> Solid {
        let surface = SurfaceId::new(self.planes[piece.plane].1);
        Solid::Half { surface, positive: piece.flipped }
    }

    /// The Boolean tree of the inside within a cell, from the pieces in the cell (at least one).
    ///
    /// `None` if the nesting is too deep.
    fn partition(&self, mut pieces: Vec<Piece>, depth: usize) -> Option<Solid> {
        // Cuts with faces on one side only, outermost first, and whether the rest is intersected
        // with the half-space (or united with it).
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

    /// The first sampled piece whose plane has all others on one side, else one that cuts few
    /// pieces and is balanced.
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

    /// Whether the piece has points behind the plane, and in front of it.
    fn sides(&self, plane: usize, piece: &Piece) -> [bool; 2] {
        if piece.plane == plane {
            return [false, false];
        }
        let any = |sign: f64| piece.points.iter().any(|p| sign * self.distance(plane, p) > self.tolerance);
        [any(-1.0), any(1.0)]
    }

    /// Splits the pieces into those on the inner and on the outer side of one; drops those in its
    /// plane.
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

    /// The part of a piece on one side of a plane (Sutherland, Hodgman 1974); `sign` selects the
    /// side.
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

    /// Whether the tree is inside behind the piece and outside in front of it, at a point on no
    /// other plane.
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
        // All samples are on other planes: undecided.
        let Some(point) = WEIGHTS.iter().map(sample).find(clear) else {
            return true;
        };
        let inner = piece.flipped;
        self.evaluate(solid, &point, piece.plane, inner) && !self.evaluate(solid, &point, piece.plane, !inner)
    }

    /// The value of the tree at a point, which counts as on the given side of `plane`.
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

/// The intersection (`meet`) or union of two trees, flattened if the second is of the same kind.
fn join(meet: bool, first: Solid, second: Solid) -> Solid {
    let mut members = vec![first];
    match (second, meet) {
        (Solid::And(more), true) | (Solid::Or(more), false) => members.extend(more),
        (other, _) => members.push(other),
    }
    if meet { Solid::And(members) } else { Solid::Or(members) }
}
