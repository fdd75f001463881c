//! Faces that bound nothing: twisted ones, whose two edges cross each other, and plane ones without
//! edges.
//!
//! Some programs leave such a face where two others should meet along one edge, or at one vertex.
//! Without it they do.

use super::{Face, Shapes};
use crate::Point;
use crate::model::AWAY;
use crate::nearest::nearest_on_surface;
use crate::project::project_to_curve;

/// The distance of edges is measured at so many places.
const PLACES: usize = 32;

/// Edges cross if they are on both sides of each other by at least this share of their largest
/// distance.
const BOTH_SIDES: f64 = 0.05;

/// Drops plane faces whose edges had no length. Returns a note if there are any.
pub(super) fn drop_planes_without_edges(shapes: &mut Shapes) -> Option<String> {
    let is_one = |face: &Face| face.surface.is_plane() && face.loops.is_empty();
    let dropped = shapes.faces.iter().filter(|face| is_one(face)).count();
    let first = shapes.faces.iter().position(is_one)? + 1;
    shapes.faces.retain(|face| !is_one(face));
    Some(format!("{dropped} faces whose edges have no length are left out, the first of them face {first}"))
}

/// Drops twisted faces whose edges are no further apart than edges may be from their faces; the two
/// edges of each become one. Returns notes.
pub(super) fn drop_twisted(shapes: &mut Shapes, size: f64) -> Vec<String> {
    let (mut notes, mut left_out) = (Vec::new(), vec![false; shapes.faces.len()]);
    for (face, left_out) in left_out.iter_mut().enumerate() {
        let Some(twisted) = twisted(shapes, face).filter(|twisted| twisted.width <= AWAY * size) else {
            continue;
        };
        *left_out = true;
        let Twisted { kept, dropped, is_reversed, width } = twisted;
        for edge in shapes.faces.iter_mut().flat_map(|face| face.loops.iter_mut().flatten()) {
            if edge.0 == dropped {
                *edge = (kept, edge.1 != is_reversed);
            }
        }
        notes.push(format!(
            "face {} is left out, because its two edges cross; they are one edge now, off by {width:.1e} at most",
            face + 1
        ));
    }
    let mut left_out = left_out.into_iter();
    shapes.faces.retain(|_| !left_out.next().expect("one for each face"));
    notes
}

/// Two edges of a face that cross.
struct Twisted {
    kept: usize,
    dropped: usize,
    is_reversed: bool,
    /// Their largest distance.
    width: f64,
}

fn twisted(shapes: &Shapes, face: usize) -> Option<Twisted> {
    let [edges] = &shapes.faces[face].loops[..] else { return None };
    let &[(kept, _), (dropped, _)] = &edges[..] else { return None };
    let [a, b] = [&shapes.curves[kept], &shapes.curves[dropped]];
    let is_reversed = a.ends != b.ends;
    if kept == dropped || a.ends[0] == a.ends[1] || (is_reversed && a.ends != [b.ends[1], b.ends[0]]) {
        return None;
    }
    let (mut width, mut sides) = (0.0_f64, [0.0_f64; 2]);
    for k in 1..PLACES {
        let share = k as f64 / PLACES as f64;
        let at = |range: [f64; 2], share: f64| range[0] + share * (range[1] - range[0]);
        let jet = a.curve.jet(at(a.range, share));
        let point = Point::from(jet[0]);
        let start = at(b.range, if is_reversed { 1.0 - share } else { share });
        let way = project_to_curve(&b.curve, b.range, &point, start).point - point;
        let across = nearest_on_surface(&shapes.faces[face].surface, &point).normal.cross(&jet[1]);
        let off = way.dot(&across.try_normalize(0.0)?);
        width = width.max(way.norm());
        sides = [sides[0].max(-off), sides[1].max(off)];
    }
    let crosses = sides[0].min(sides[1]) > BOTH_SIDES * width;
    crosses.then_some(Twisted { kept, dropped, is_reversed, width })
}

#[cfg(test)]
mod tests {
    use crate::bspline::{Basis, SplineCurve};
    use crate::shapes::Face;
    use crate::shapes::tests::{Solids, X, Y, Z, measured};
    use crate::{Curve, EdgeCurve, Model, Surface};

    /// A unit cube with a face between an edge of its top and a curve that crosses it once or
    /// bulges to one side, up to about a quarter of `height`.
    fn cube(height: [f64; 2]) -> Result<Model, crate::BrepError> {
        let mut solids = Solids::default();
        solids.block([0.0; 3], [1.0; 3]);
        let mut shapes = solids.into_shapes();
        let roof = shapes.faces.len() - 1;
        let (edge, is_forward) = shapes.faces[roof].loops[0][0];
        let EdgeCurve { ends, tolerance, .. } = shapes.curves[edge];
        let [from, to] = ends.map(|end| shapes.corners[end].point.coords);
        let inner = [0, 1].map(|k| from + (to - from) * ((k as f64 + 1.0) / 3.0) + Y * height[k]);
        let curve = Curve::Spline(SplineCurve {
            basis: Basis::clamped(3, &[0.0, 1.0], 1).unwrap(),
            poles: vec![from, inner[0], inner[1], to],
            weights: Vec::new(),
        });
        shapes.curves.push(EdgeCurve { curve, range: [0.0, 1.0], ends, tolerance });
        shapes.body_of_curve.push(0);
        let other = shapes.curves.len() - 1;
        shapes.faces[roof].loops[0][0] = (other, is_forward);
        shapes.faces.push(Face {
            id: 7,
            surface: Surface::Plane { origin: Z, axes: [X, Y] },
            loops: vec![vec![(edge, is_forward), (other, !is_forward)]],
            inner: Vec::new(),
            body: 0,
            is_behind: true,
            name: None,
        });
        let mut model = Model { bodies: 1, ..Model::default() };
        shapes.build(&mut model).map(|()| model)
    }

    #[test]
    fn a_face_whose_edges_cross_is_left_out() {
        let model = cube([2e-3, -2e-3]).unwrap();
        assert!(model.notes[0].starts_with("face 7 is left out"), "{:?}", model.notes);
        let (model, volumes, _) = measured(model);
        assert_eq!((model.patches.len(), model.curves.len()), (6, 12));
        assert!((volumes[0] - 1.0).abs() < 1e-3, "{volumes:?}");
    }

    #[test]
    fn narrow_and_wide_faces_between_two_edges_are_kept() {
        for height in [[2e-3, 2e-3], [0.3, -0.3]] {
            let model = cube(height).unwrap();
            assert_eq!((model.patches.len(), model.notes.len()), (7, 0), "{height:?}");
        }
    }
}
