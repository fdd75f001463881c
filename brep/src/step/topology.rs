//! Solids, shells, faces, loops, edges and vertices.
//!
//! Source: ISO 10303-42, topology, and ISO 10303-511 (advanced faces).

use super::assembly::PlacedSolid;
use super::geometry::{curve, point, surface};
use super::record::Node;
use crate::model::{Corner, EdgeCurve};
use crate::nearest::nearest_on_curve;
use crate::shapes::{Edges, Face, Shapes, reversed};
use crate::{BrepError, Curve, Placement, Point};
use std::collections::HashMap;

/// Reads one solid.
struct Reader<'s> {
    shapes: &'s mut Shapes,
    body: usize,
    placement: Placement,
    /// Radians of the unit of angles.
    angle: f64,
    corners: HashMap<u64, usize>,
    /// Curves; `None` for edges without length.
    curves: HashMap<u64, Option<(usize, bool)>>,
    /// Curves of loops of points, by their ends.
    lines: HashMap<[usize; 2], usize>,
}

impl Shapes {
    /// Adds the shapes of a solid.
    ///
    /// # Errors
    /// [`BrepError::Syntax`] with the record and line.
    pub(super) fn add(&mut self, placed: &PlacedSolid) -> Result<(), BrepError> {
        let mut reader = Reader::new(self, placed);
        reader.add_body(placed);
        let fields = placed.solid.any(&super::assembly::SOLIDS).expect("a solid");
        // The shell comes after the label, which records of several parts have elsewhere.
        let at = usize::from(placed.solid.kind() == fields.name());
        if let Some(solid) = placed.solid.get("MANIFOLD_SOLID_BREP") {
            reader.shell(solid.refers(at)?, true)?;
        } else {
            reader.shell(fields.refers(at)?, true)?;
        }
        if let Some(hollow) = placed.solid.get("BREP_WITH_VOIDS") {
            let voids = if at == 1 { 2 } else { 0 };
            hollow.refers_all(voids)?.into_iter().try_for_each(|shell| reader.shell(shell, true))?;
        }
        Ok(())
    }

    /// Adds the faces of a shell, each as that of a body of its own; returns their number.
    ///
    /// # Errors
    /// [`BrepError::Syntax`] with the record and line.
    pub(super) fn add_faces(&mut self, placed: &PlacedSolid) -> Result<usize, BrepError> {
        let mut reader = Reader::new(self, placed);
        let (faces, is_outward) = faces_of(placed.solid, true)?;
        for face in &faces {
            reader.add_body(placed);
            reader.face(*face, is_outward)?;
        }
        Ok(faces.len())
    }
}

/// The faces of a shell, and whether they point out of it as their records say.
fn faces_of(shell: Node, is_outward: bool) -> Result<(Vec<Node>, bool), BrepError> {
    let oriented = shell.get("ORIENTED_CLOSED_SHELL").or_else(|| shell.get("ORIENTED_OPEN_SHELL"));
    let (shell, is_outward) = match oriented {
        Some(oriented) => (oriented.refers(2)?, is_outward == oriented.flag(3)?),
        None => (shell, is_outward),
    };
    let Some(fields) = shell.any(&["CLOSED_SHELL", "OPEN_SHELL", "CONNECTED_FACE_SET"]) else {
        return Err(shell.error(format!("{} is no closed shell", shell.kind())));
    };
    Ok((fields.refers_all(1)?, is_outward))
}

impl<'s> Reader<'s> {
    fn new(shapes: &'s mut Shapes, placed: &PlacedSolid) -> Self {
        Self {
            shapes,
            body: 0,
            placement: placed.placement,
            angle: placed.units.angle,
            corners: HashMap::new(),
            curves: HashMap::new(),
            lines: HashMap::new(),
        }
    }

    /// Adds a body, to which all that is read from now on belongs.
    fn add_body(&mut self, placed: &PlacedSolid) {
        self.body = self.shapes.accuracy.len();
        self.shapes.accuracy.push(placed.units.accuracy * placed.placement.scale());
    }

    fn shell(&mut self, shell: Node, is_outward: bool) -> Result<(), BrepError> {
        let (faces, is_outward) = faces_of(shell, is_outward)?;
        faces.into_iter().try_for_each(|face| self.face(face, is_outward))
    }

    fn face(&mut self, face: Node, is_outward: bool) -> Result<(), BrepError> {
        let (face, is_outward) = match face.get("ORIENTED_FACE") {
            Some(oriented) => (oriented.refers(2)?, is_outward == oriented.flag(3)?),
            None => (face, is_outward),
        };
        let Some(fields) = face.any(&["ADVANCED_FACE", "FACE_SURFACE"]) else {
            return Err(face.error(format!("{} is no face that can be read", face.kind())));
        };
        let own = surface(fields.refers(2)?, self.angle)?.placed(&self.placement);
        let is_along = fields.flag(3)?;
        let mut loops = Vec::new();
        for bound in fields.refers_all(1)? {
            let Some(bounds) = bound.any(&["FACE_OUTER_BOUND", "FACE_BOUND"]) else {
                return Err(bound.error(format!("{} is no bound of a face", bound.kind())));
            };
            let edges = self.edges(bounds.refers(1)?)?;
            // Loops are counterclockwise around the normal of the face.
            let is_kept = bounds.flag(2)? == is_along;
            if !edges.is_empty() {
                loops.push(if is_kept { edges } else { reversed(edges) });
            }
        }
        let own = match loops.first().and_then(|edges| edges.first()) {
            Some(edge) => own.measured_from(&self.shapes.corners[self.shapes.curves[edge.0].ends[0]].point),
            None => own,
        };
        let is_mirrored = self.placement.is_mirrored();
        if is_mirrored {
            loops = loops.into_iter().map(reversed).collect();
        }
        self.shapes.faces.push(Face {
            id: face.id,
            surface: own,
            loops,
            inner: Vec::new(),
            body: self.body,
            is_behind: (is_along == is_outward) != is_mirrored,
            name: face.label(),
        });
        Ok(())
    }

    /// The edges of a loop with length.
    fn edges(&mut self, bound: Node) -> Result<Edges, BrepError> {
        if let Some(fields) = bound.get("EDGE_LOOP") {
            let mut edges = Vec::new();
            for used in fields.refers_all(1)? {
                let mut edge = used;
                let mut is_forward = true;
                for _ in 0..4 {
                    let Some(oriented) = edge.get("ORIENTED_EDGE") else { break };
                    is_forward ^= !oriented.flag(4)?;
                    edge = oriented.refers(3)?;
                }
                if let Some((curve, is_along)) = self.curve(edge)? {
                    edges.push((curve, is_forward == is_along));
                }
            }
            return Ok(edges);
        }
        if let Some(fields) = bound.get("POLY_LOOP") {
            let nodes = fields.refers_all(1)?;
            let corners = nodes.into_iter().map(|node| self.point(node)).collect::<Result<Vec<_>, _>>()?;
            let next = corners.iter().cycle().skip(1);
            let pairs = corners.iter().zip(next).filter(|(a, b)| a != b);
            return Ok(pairs.map(|(&a, &b)| self.line([a, b])).collect());
        }
        if bound.is("VERTEX_LOOP") {
            return Ok(Vec::new());
        }
        Err(bound.error(format!("{} is no loop that can be read", bound.kind())))
    }

    /// The corner of a point.
    fn point(&mut self, node: Node) -> Result<usize, BrepError> {
        if let Some(&corner) = self.corners.get(&node.id) {
            return Ok(corner);
        }
        let point = self.placement.point(&Point::from(point(node)?));
        self.shapes.corners.push(Corner { point, tolerance: self.shapes.accuracy[self.body] });
        self.shapes.body_of_corner.push(self.body);
        self.corners.insert(node.id, self.shapes.corners.len() - 1);
        Ok(self.shapes.corners.len() - 1)
    }

    fn vertex(&mut self, node: Node) -> Result<usize, BrepError> {
        self.point(node.fields("VERTEX_POINT")?.refers(1)?)
    }

    /// A straight edge.
    fn line(&mut self, [a, b]: [usize; 2]) -> (usize, bool) {
        if let Some(&curve) = self.lines.get(&[a.min(b), a.max(b)]) {
            return (curve, self.shapes.curves[curve].ends == [a, b]);
        }
        let [start, end] = [a, b].map(|corner| self.shapes.corners[corner].point.coords);
        let curve = Curve::Line { start, direction: end - start };
        let added = self.add(curve, [0.0, 1.0], [a, b]);
        self.lines.insert([a.min(b), a.max(b)], added);
        (added, true)
    }

    fn add(&mut self, curve: Curve<3>, range: [f64; 2], ends: [usize; 2]) -> usize {
        let tolerance = self.shapes.accuracy[self.body];
        self.shapes.curves.push(EdgeCurve { curve, range, ends, tolerance });
        self.shapes.body_of_curve.push(self.body);
        self.shapes.curves.len() - 1
    }

    /// The curve of an edge, and whether the edge runs along it; `None` if it has no length.
    fn curve(&mut self, edge: Node) -> Result<Option<(usize, bool)>, BrepError> {
        if let Some(&known) = self.curves.get(&edge.id) {
            return Ok(known);
        }
        let fields = edge.fields("EDGE_CURVE")?;
        let ends = [self.vertex(fields.refers(1)?)?, self.vertex(fields.refers(2)?)?];
        let of = fields.refers(3)?;
        if ends[0] == ends[1] && of.is("LINE") {
            // Some programs write no direction of it.
            self.curves.insert(edge.id, None);
            return Ok(None);
        }
        let own = curve(of)?.placed(&self.placement);
        let is_along = fields.flag(4)?;
        let made = match self.range(edge, &own, ends, is_along)? {
            None => None,
            Some((range, is_along)) => {
                let sorted = if is_along { ends } else { [ends[1], ends[0]] };
                let curve = self.add(own, range, sorted);
                for (end, t) in sorted.into_iter().zip(range) {
                    let on = Point::from(self.shapes.curves[curve].curve.point(t));
                    let corner = &mut self.shapes.corners[end];
                    corner.tolerance = corner.tolerance.max((on - corner.point).norm());
                }
                Some((curve, is_along))
            }
        };
        self.curves.insert(edge.id, made);
        Ok(made)
    }

    /// The ascending range of an edge on its curve, and whether the edge runs along the curve;
    /// `None` if it has no length.
    fn range(
        &mut self,
        edge: Node,
        curve: &Curve<3>,
        ends: [usize; 2],
        is_along: bool,
    ) -> Result<Option<([f64; 2], bool)>, BrepError> {
        let points = ends.map(|end| self.shapes.corners[end].point);
        let feet = points.map(|p| nearest_on_curve(curve, &p));
        for (foot, p) in feet.iter().zip(&points) {
            let off = (foot.point - p).norm();
            let extent = (points[1] - points[0]).norm();
            if off > (FARTHEST * extent.max(size(curve))).max(self.shapes.accuracy[self.body]) {
                let [x, y, z] = [p.x, p.y, p.z];
                let what = format!("its vertex ({x}, {y}, {z}) is {off:.3e} away from its curve");
                self.shapes.away.push((off, edge.error(what)));
            }
        }
        let [first, last] = feet.map(|foot| foot.parameter);
        if ends[0] == ends[1] {
            return self.closed_range(edge, curve, first).map(|range| range.map(|r| (r, is_along)));
        }
        // Along its curve an edge ascends; a periodic curve is followed across its ends.
        let [low, mut high] = if is_along { [first, last] } else { [last, first] };
        match curve.period() {
            Some(period) => {
                let rounding = 1e-12 * period;
                while high <= low + rounding {
                    high += period;
                }
                Ok(Some(([low, high], is_along)))
            }
            // The vertices of an open curve determine the direction.
            None if low < high => Ok(Some(([low, high], is_along))),
            None if low > high => Ok(Some(([high, low], !is_along))),
            None => Ok(None),
        }
    }

    /// The range of an edge with one vertex.
    fn closed_range(&self, edge: Node, curve: &Curve<3>, at: f64) -> Result<Option<[f64; 2]>, BrepError> {
        if let Some(period) = curve.period() {
            return Ok(Some([at, at + period]));
        }
        let Some([low, high]) = curve.domain() else { return Ok(None) };
        let gap = (curve.point(high) - curve.point(low)).norm();
        if gap <= FARTHEST * size(curve) {
            return Ok(Some([low, high]));
        }
        Err(edge.error("both ends are one vertex, but its curve is not closed"))
    }
}

/// Vertices further from their curve than this (fraction of its size), and than the accuracy of the
/// file, belong to it only if the whole model is far larger.
const FARTHEST: f64 = 5e-2;

/// The size of a bounded curve; 0 of an unbounded one.
fn size(curve: &Curve<3>) -> f64 {
    let Some([low, high]) = curve.domain() else { return 0.0 };
    let start = curve.point(low);
    (1..8).map(|k| (curve.point(low + (high - low) * f64::from(k) / 8.0) - start).norm()).fold(0.0, f64::max)
}
