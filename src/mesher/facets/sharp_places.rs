//! Places where the facets themselves are sharper than tets should be.

use super::FacetModel;
use crate::ground::mesh::BoundaryTriangle;
use crate::ground::projector::facets::edges::Edges;
use crate::{Point, Vector};
use std::collections::{BTreeMap, HashSet};
use std::f64::consts::TAU;

/// Angles below this (degrees) are reported: some tet there is as sharp.
const SHARP: f64 = 10.0;

/// The most places listed.
const LISTED: usize = 20;

/// Where two facets of a body, or two curves of a patch, enclose a small angle.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct SharpPlace {
    /// The midpoint of the edge between the facets, or the point where the curves meet.
    pub point: [f64; 3],
    /// The angle inside the body, or on the patch, in degrees.
    pub angle: f64,
    /// Whether it is between two facets at an edge; else between two curves of a patch.
    pub is_edge: bool,
}

/// The places where facets are sharper than 10°.
#[derive(Clone, Debug, Default, PartialEq, serde::Serialize)]
pub struct SharpPlaces {
    /// Their number.
    pub count: u64,
    /// The sharpest of them, at most 20, in ascending order of angle.
    pub sharpest: Vec<SharpPlace>,
}

impl SharpPlaces {
    /// Finds the sharp places of a model.
    pub fn of(model: &FacetModel) -> Self {
        let mut places = wedges(model);
        places.extend(patch_corners(model));
        places.retain(|place| place.angle < SHARP);
        let count = places.len() as u64;
        places.sort_by(|a, b| a.angle.total_cmp(&b.angle));
        places.truncate(LISTED);
        Self { count, sharpest: places }
    }
}

/// The least angle of a body at each edge.
fn wedges(model: &FacetModel) -> Vec<SharpPlace> {
    let triangles: Vec<[u32; 3]> = model.triangles.iter().map(|t| t.vertices.map(|v| v.0)).collect();
    let edges = Edges::new(&triangles);
    let point = |v: u32| model.points[v as usize];
    let mut places = Vec::new();
    for edge in 0..edges.len() {
        let uses = edges.uses(edge);
        if uses.iter().any(|u| model.is_merged(u.triangle)) {
            continue;
        }
        let [a, b] = uses[0].ends.map(point);
        let Some(axis) = (b - a).try_normalize(0.0) else { continue };
        let across = |t: u32, side: u8| {
            let apex = point(triangles[t as usize][usize::from(side)]) - a;
            apex - axis * apex.dot(&axis)
        };
        let first = across(uses[0].triangle, uses[0].side);
        let second = axis.cross(&first);
        // The facets counterclockwise around the edge, each with the body behind it.
        let mut around: Vec<(f64, bool)> = uses
            .iter()
            .map(|u| {
                let out = across(u.triangle, u.side);
                let angle = out.dot(&second).atan2(out.dot(&first)).rem_euclid(TAU);
                let patch = model.patch(model.triangles[u.triangle as usize].patch);
                // The normal of a facet along the edge is counterclockwise: its outside is next.
                let next = if u.along { patch.outside } else { patch.inside };
                (angle, next.is_some())
            })
            .collect();
        around.sort_by(|a, b| a.0.total_cmp(&b.0));
        let end = around[0].0 + TAU;
        let next = around.iter().skip(1).map(|a| a.0).chain([end]);
        let angles = around.iter().zip(next).filter(|((_, is_body), _)| *is_body).map(|((a, _), b)| b - a);
        let angle = angles.fold(f64::INFINITY, f64::min).to_degrees();
        places.push(SharpPlace { point: nalgebra::center(&a, &b).into(), angle, is_edge: true });
    }
    places
}

/// The angle of each patch at some vertices, as the sum of those of its triangles there (radians).
pub(super) fn angles(
    points: &[Point],
    triangles: impl Iterator<Item = ([u32; 3], u32)>,
    is_wanted: impl Fn(u32) -> bool,
) -> BTreeMap<(u32, u32), f64> {
    let mut sums = BTreeMap::new();
    for (vertices, patch) in triangles {
        let corners: [Point; 3] = vertices.map(|v| points[v as usize]);
        for k in (0..3).filter(|&k| is_wanted(vertices[k])) {
            let [u, v]: [Vector; 2] = [1, 2].map(|m| corners[(k + m) % 3] - corners[k]);
            *sums.entry((vertices[k], patch)).or_default() += u.cross(&v).norm().atan2(u.dot(&v));
        }
    }
    sums
}

/// The angle of each patch at each point of curves, but not where only merged faces are.
fn patch_corners(model: &FacetModel) -> Vec<SharpPlace> {
    let mut on_curve = vec![false; model.points.len()];
    model.curves.iter().flat_map(|c| &c.vertices).for_each(|&v| on_curve[v as usize] = true);
    let corners = |t: &BoundaryTriangle| (t.vertices.map(|v| v.0), t.patch.0);
    let mut sums = angles(&model.points, model.triangles.iter().map(corners), |v| on_curve[v as usize]);
    let main = (0u32..).zip(&model.triangles).filter(|(i, _)| !model.is_merged(*i)).map(|(_, t)| corners(t));
    let of_main: HashSet<(u32, u32)> = main.flat_map(|(v, patch)| v.map(|v| (v, patch))).collect();
    sums.retain(|at, _| of_main.contains(at));
    let place = |((v, _), sum): ((u32, u32), f64)| SharpPlace {
        point: model.points[v as usize].into(),
        angle: sum.to_degrees(),
        is_edge: false,
    };
    sums.into_iter().map(place).collect()
}

#[cfg(test)]
mod tests {
    use super::super::samples::Soup;
    use super::super::{FacetModel, Settings};
    use super::*;

    /// A prism along y over a triangle with this angle (degrees) at the origin.
    fn prism(angle: f64) -> FacetModel {
        let (sine, cosine) = angle.to_radians().sin_cos();
        let at = |y: f64| [[0.0, 0.0], [1.0, 0.0], [cosine, sine]].map(|[x, z]| Point::new(x, y, z));
        let ([a, b, c], [d, e, f]) = (at(0.0), at(1.0));
        let mut soup = Soup::default();
        soup.add([a, b, c]);
        soup.add([d, f, e]);
        [[a, d, e, b], [b, e, f, c], [c, f, d, a]].into_iter().for_each(|side| soup.quad(side));
        FacetModel::new(&[soup.facets], &Settings::default()).unwrap()
    }

    #[test]
    fn sharp_edges_and_corners_of_patches_are_found_with_their_angles() {
        let SharpPlaces { count, sharpest } = SharpPlaces::of(&prism(3.0));
        assert_eq!((count, sharpest.len()), (3, 3));
        assert!(sharpest.iter().all(|place| (place.angle - 3.0).abs() < 1e-9), "{sharpest:?}");
        let edges: Vec<[f64; 3]> = sharpest.iter().filter(|p| p.is_edge).map(|p| p.point).collect();
        assert_eq!(edges, [[0.0, 0.5, 0.0]]);
        assert_eq!(SharpPlaces::of(&prism(12.0)), SharpPlaces::default());
    }

    #[test]
    fn a_narrow_gap_between_bodies_is_not_sharp() {
        let mut soup = Soup::default();
        // A groove of 3° in a block: its edge has 357° inside.
        let profile =
            [[-1.0, 0.0], [1.0, 0.0], [1.0, 2.0], [0.026, 2.0], [0.0, 1.0], [-0.026, 2.0], [-1.0, 2.0]];
        let at = |k: usize, y: f64| Point::new(profile[k][0], y, profile[k][1]);
        for k in 0..7 {
            soup.quad([at(k, 0.0), at(k, 1.0), at((k + 1) % 7, 1.0), at((k + 1) % 7, 0.0)]);
        }
        for [a, b, c] in [[0, 1, 4], [1, 2, 4], [2, 3, 4], [4, 5, 6], [4, 6, 0]] {
            soup.add([at(a, 0.0), at(b, 0.0), at(c, 0.0)]);
            soup.add([at(c, 1.0), at(b, 1.0), at(a, 1.0)]);
        }
        let model = FacetModel::new(&[soup.facets], &Settings::default()).unwrap();
        assert_eq!(SharpPlaces::of(&model), SharpPlaces::default());
    }
}
