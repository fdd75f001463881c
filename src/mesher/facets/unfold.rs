//! Triangles that folded or became narrow when their vertices moved from facets onto exact faces.
//!
//! The facets of a face end at chords of its edges. A vertex of the face may be nearer to such a
//! chord than the edge is; if the vertices of the edge then move onto the edge, that vertex is
//! beyond it or close to it, and the triangle between them lies upside down or is narrow.

use crate::ground::kernel::simplex::area_vector;
use crate::ground::mesh::Class;
use crate::ground::projector::BrepProjector;
use crate::mesher::surface::SurfaceMesh;
use crate::{Point, Vector};
use csg::{PatchId, ProjectionFailed};
use rayon::prelude::*;
use std::collections::BTreeMap;

/// A triangle whose normal turned by more than 60° has folded, or nearly so.
const TURNED: f64 = 0.5;
/// Triangles that are less high than this fraction of their longest side are narrow ...
const NARROW: f64 = 0.3;
/// ... and became so by the move if they are less high than this fraction of what they were before.
const LOWER: f64 = 0.8;
/// The most rounds over the vertices of such triangles.
const ROUNDS: usize = 8;
/// Parts of the way to the middle of its neighbours that a vertex is moved.
const PARTS: [f64; 4] = [1.0, 0.5, 0.25, 0.1];

/// Moves vertices on patches away from edges that came too close to them or are beyond them.
/// `before` are the vertices on the facets.
///
/// # Errors
/// [`ProjectionFailed`] if a search on an exact face does not converge.
pub fn unfold(
    surface: &mut SurfaceMesh,
    before: &[Point],
    exact: &BrepProjector,
) -> Result<(), ProjectionFailed> {
    let flat = |t: usize, points: &[Point]| {
        let corners = surface.triangles[t].vertices.map(|v| points[v.index()]);
        (area_vector(&corners[0], &corners[1], &corners[2]), height(&corners))
    };
    let has_turned = |&t: &usize| {
        let ((m, was), (n, is)) = (flat(t, before), flat(t, &surface.points));
        is < NARROW && is < LOWER * was || m.dot(&n) < TURNED * m.norm() * n.norm()
    };
    let turned: Vec<usize> = (0..surface.triangles.len()).into_par_iter().filter(has_turned).collect();
    if turned.is_empty() {
        return Ok(());
    }
    // The vertices that may move, with the triangles around them.
    let corners = turned.into_iter().flat_map(|t| surface.triangles[t].vertices);
    let on_patch = |v: usize| match surface.classes[v] {
        Class::Patch(patch) => Some((v, patch)),
        _ => None,
    };
    let patches: BTreeMap<usize, PatchId> = corners.filter_map(|v| on_patch(v.index())).collect();
    let mut around: BTreeMap<usize, Vec<[usize; 3]>> = BTreeMap::new();
    for triangle in &surface.triangles {
        let corners = triangle.vertices.map(|v| v.index());
        for v in corners.into_iter().filter(|v| patches.contains_key(v)) {
            around.entry(v).or_default().push(corners);
        }
    }
    for _ in 0..ROUNDS {
        let mut moved = false;
        for (&v, triangles) in &around {
            let star = Star { v, triangles, patch: patches[&v], points: &surface.points, exact };
            if let Some(place) = star.better_place()? {
                surface.points[v] = place;
                moved = true;
            }
        }
        if !moved {
            break;
        }
    }
    Ok(())
}

/// The height of a triangle above its longest side, in units of that.
fn height([a, b, c]: &[Point; 3]) -> f64 {
    let longest = (b - a).norm_squared().max((c - b).norm_squared()).max((a - c).norm_squared());
    area_vector(a, b, c).norm() / longest
}

/// A vertex on a patch with the triangles around it.
struct Star<'a> {
    v: usize,
    triangles: &'a [[usize; 3]],
    patch: PatchId,
    points: &'a [Point],
    exact: &'a BrepProjector,
}

impl Star<'_> {
    /// A place of the vertex where the worst triangle around it is better; `None` if none is
    /// upside down or narrow.
    fn better_place(&self) -> Result<Option<Point>, ProjectionFailed> {
        let here = self.points[self.v];
        let worst = self.worst(&here);
        if worst > NARROW {
            return Ok(None);
        }
        let beside = self.triangles.iter().flatten().filter(|&&w| w != self.v);
        let (sum, count) = beside
            .fold((Vector::zeros(), 0.0), |(sum, count), &w| (sum + (self.points[w] - here), count + 1.0));
        let mut best: Option<(f64, Point)> = None;
        for part in PARTS {
            let place = self.exact.project_patch(self.patch, &(here + sum * (part / count)))?;
            let value = self.worst(&place);
            if value > best.map_or(worst, |best| best.0) {
                best = Some((value, place));
            }
        }
        Ok(best.map(|best| best.1))
    }

    /// The height of the worst triangle around the vertex at a place, negative where it is upside
    /// down.
    fn worst(&self, at: &Point) -> f64 {
        let value = |corners: &[usize; 3]| {
            let corners = corners.map(|w| if w == self.v { *at } else { self.points[w] });
            let [a, b, c] = &corners;
            let middle = Point::from((a.coords + b.coords + c.coords) / 3.0);
            let normal = self.exact.normal(self.patch, &middle)?;
            Some(height(&corners).copysign(area_vector(a, b, c).dot(&normal)))
        };
        self.triangles.iter().filter_map(value).fold(f64::INFINITY, f64::min)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::mesh::{BoundaryTriangle, VertexId};
    use brep::{Curve, Model, On, Settings, Tessellation};
    use csg::{CornerId, CurveId};

    #[test]
    fn a_vertex_inside_of_a_hole_moves_out_of_it() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/geometries/brep/box_with_hole.brep");
        let mut model = Model::read(&std::fs::read(path).unwrap()).unwrap();
        let tessellation = Tessellation::of(&mut model, &Settings::default()).unwrap();
        let (_, exact) = crate::mesher::facets::of_brep(&model, &tessellation);
        let hole = |patch: usize| {
            let edges = model.patches[patch].loops.iter().flatten().filter_map(|fin| match fin.on {
                On::Curve(edge) => Some(&model.curves[edge].curve),
                On::Corner(_) => None,
            });
            edges
                .filter_map(|curve| {
                    if let Curve::Ellipse { center, axes } = curve { Some((*center, *axes)) } else { None }
                })
                .next()
        };
        let is_plane = |&patch: &usize| exact.is_flat_patch(PatchId::new(patch));
        let planes = (0..model.patches.len()).filter(is_plane);
        let (patch, (center, [x, y])) =
            planes.filter_map(|patch| Some((patch, hole(patch)?))).next().unwrap();
        let patch = PatchId::new(patch);
        let is_turned = x.cross(&y).dot(&exact.normal(patch, &center.into()).unwrap()) < 0.0;
        let y = if is_turned { -y } else { y };

        // Around the vertex: those of the circle at -30°, 0° and 30°, and others further out. That
        // at 0° was on the chord between its neighbours.
        let polar = |r: f64, degrees: f64| {
            let angle = degrees.to_radians();
            Point::from(center + x * (r * angle.cos()) + y * (r * angle.sin()))
        };
        let chord = 30_f64.to_radians().cos();
        let inner = [polar(0.9, 0.0), polar(1.0, -30.0), polar(1.0, 0.0), polar(1.0, 30.0)];
        let outer = [polar(1.6, -30.0), polar(1.6, 0.0), polar(1.6, 30.0)];
        let points = [&inner[..], &outer[..]].concat();
        let mut before = points.clone();
        before[2] = polar(chord, 0.0);
        let ring = [1, 4, 5, 6, 3, 2];
        let triangle =
            |k: usize| BoundaryTriangle { vertices: [0, ring[k], ring[(k + 1) % 6]].map(VertexId), patch };
        let mut surface = SurfaceMesh {
            points: points.clone(),
            classes: [
                vec![Class::Patch(patch)],
                vec![Class::Curve(CurveId(0)); 3],
                vec![Class::Corner(CornerId(0)); 3],
            ]
            .concat(),
            triangles: (0..6).map(triangle).collect(),
            ..SurfaceMesh::default()
        };
        unfold(&mut surface, &points, &exact).unwrap();
        assert_eq!(surface.points, points, "a mesh that does not fold by its moves is left alone");
        unfold(&mut surface, &before, &exact).unwrap();
        assert_eq!(surface.points[1..], points[1..]);
        let from_center = (surface.points[0] - center).coords.norm() / x.norm();
        assert!((1.1..1.5).contains(&from_center), "{from_center}");
        assert!(exact.patch_distance(patch, &surface.points[0]) <= exact.tolerance());
    }
}
