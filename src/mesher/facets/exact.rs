//! Facets with given patches, curves and corners: those of a boundary representation.

use super::small::Grouping;
use super::{BluntEnd, FacetBody, FacetCurve, FacetModel, FacetPatch, Merged};
use crate::Vector;
use crate::ground::kernel::tree;
use crate::ground::mesh::{BoundaryTriangle, Touching, VertexId};
use crate::ground::projector::BrepProjector;
use crate::ground::projector::facets::edges::Edges;
use crate::ground::projector::facets::{FacetProjector, NO_PATCH, PatchFacets, Source};
use brep::{Curve, Model, On, Tessellation};
use csg::{BodyId, CornerId, PatchId};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::sync::Arc;

/// The normals on both sides of a seam differ by at most this angle (radians), else it is an edge.
const SMOOTH: f64 = 0.02;

/// Curves of a patch meet in a corner unless their tangents differ by at most this angle (radians).
const STRAIGHT: f64 = 0.05;

/// Relative rounding of coordinates.
const ROUNDING: f64 = 1e-15;

/// What the faces, edges and corners of a file are in shape.
pub(super) struct Shape {
    /// Whether the normals of each face are against those of its surface.
    is_reversed: Vec<bool>,
    /// The triangles, their normals out of `inside`.
    triangles: Vec<[u32; 3]>,
    /// The unit normals at their corners.
    normals: Vec<[Vector; 3]>,
    /// The edges of the triangles.
    edges: Edges,
    /// The facets of each face.
    facets: Vec<Arc<PatchFacets>>,
    /// The edges that are curves.
    pub curves: Vec<usize>,
    /// The vertices that are corners, ascending.
    pub corners: Vec<u32>,
}

impl Shape {
    pub fn new(model: &Model, tessellation: &Tessellation) -> Self {
        // Normals point out of a body rather than out of none, and of two bodies of the lower one.
        let of = |patch: &brep::Patch| {
            let [behind, front] = patch.bodies.map(|body| body.unwrap_or(usize::MAX));
            behind > front
        };
        let is_reversed: Vec<bool> = model.patches.iter().map(of).collect();
        let curves = curves_in_use(model, tessellation);
        let normals = corner_normals(model, tessellation, &is_reversed);
        let oriented = |t: &brep::Triangle| {
            let [a, b, c] = t.vertices;
            if is_reversed[t.patch as usize] { [b, a, c] } else { [a, b, c] }
        };
        let triangles: Vec<[u32; 3]> = tessellation.triangles.iter().map(oriented).collect();
        let corners = corners(model, &curves, &triangles, &normals);
        let edges = Edges::new(&triangles);
        let source = Source {
            points: tessellation.points.clone(),
            triangles,
            patch_of: tessellation.triangles.iter().map(|t| t.patch).collect(),
            patches: model.patches.len() as u32,
            ..Source::default()
        };
        let facets = FacetProjector::facets_of(&source, &normals, &edges);
        Self { is_reversed, triangles: source.triangles, normals, edges, facets, curves, corners }
    }

    /// Each face a patch, and each edge a curve.
    pub fn ungrouped(&self, model: &Model) -> Grouping {
        Grouping {
            patches: (0..model.patches.len()).map(|face| vec![face]).collect(),
            curves: self.curves.iter().map(|&edge| vec![(edge, true)]).collect(),
            is_short: vec![false; model.curves.len()],
            corners: self.corners.clone(),
        }
    }
}

/// How far the edges of a face are off it, or their ends off them.
fn inaccuracy(model: &Model, face: usize) -> f64 {
    let sides = model.patches[face].loops.iter().flatten();
    let of_side = |on: On| match on {
        On::Curve(edge) => {
            let edge = &model.curves[edge];
            edge.ends.iter().map(|&end| model.corners[end].tolerance).fold(edge.tolerance, f64::max)
        }
        On::Corner(corner) => model.corners[corner].tolerance,
    };
    sides.map(|side| of_side(side.on)).fold(0.0, f64::max)
}

/// Takes the tessellation of a model as facets, and its faces and edges as patches and curves.
///
/// Seams of smooth surfaces are no curves, and a closed edge has a corner only where it has one in
/// its shape: both come from the parametrisation alone.
pub fn of_brep(model: &Model, tessellation: &Tessellation) -> (FacetModel, BrepProjector) {
    let shape = Shape::new(model, tessellation);
    let grouping = shape.ungrouped(model);
    let facets = grouped(model, tessellation, &shape, &grouping, &[]);
    (facets, exact(model, tessellation, &shape, &grouping))
}

/// The exact faces and edges of a model, in the groups that are patches and curves.
pub(super) fn exact(
    model: &Model,
    tessellation: &Tessellation,
    shape: &Shape,
    grouping: &Grouping,
) -> BrepProjector {
    let Grouping { patches, curves, is_short, .. } = grouping;
    BrepProjector::new(model, tessellation, &shape.is_reversed, patches, curves, is_short)
}

/// Takes the tessellation of a model as facets with groups of faces and edges as patches and
/// curves, and ends of faces without influence on sizes.
///
/// Facets of faces that joined a main face belong to its patch, but have no influence on its shape
/// and size: points are projected to the facets of the main face alone.
pub(super) fn grouped(
    model: &Model,
    tessellation: &Tessellation,
    shape: &Shape,
    grouping: &Grouping,
    blunt: &[BluntEnd],
) -> FacetModel {
    let Shape { is_reversed, triangles, normals, edges, facets, .. } = shape;
    let faces_of = &grouping.patches;
    let mut patch_of_face = vec![0; model.patches.len()];
    let mut is_main = vec![false; model.patches.len()];
    for (patch, faces) in grouping.patches.iter().enumerate() {
        faces.iter().for_each(|&face| patch_of_face[face] = patch as u32);
        is_main[faces[0]] = true;
    }
    let faces = || tessellation.triangles.iter().map(|t| t.patch as usize);
    let corners = grouping.corners.clone();
    let facet_curves: Vec<FacetCurve> =
        grouping.curves.iter().map(|edges| facet_curve(model, tessellation, edges, grouping)).collect();
    let ends: BTreeSet<CornerId> = facet_curves.iter().filter_map(|c| c.ends).flatten().collect();
    let is_tip = |i: &usize| !ends.contains(&CornerId::new(*i));
    let tips: Vec<u32> = (0..corners.len()).filter(is_tip).map(|i| corners[i]).collect();
    let patch = |faces: &Vec<usize>| {
        let [behind, front] = model.patches[faces[0]].bodies;
        let [inside, outside] = if is_reversed[faces[0]] { [front, behind] } else { [behind, front] };
        let body = |b: Option<usize>| b.map(BodyId::new);
        let inaccuracy = faces.iter().map(|&face| inaccuracy(model, face)).fold(0.0, f64::max);
        FacetPatch { inside: body(inside), outside: body(outside), labels: vec![(0, 0)], inaccuracy }
    };
    let patches: Vec<FacetPatch> = grouping.patches.iter().map(patch).collect();
    let shaping = |face: usize| if is_main[face] { patch_of_face[face] } else { NO_PATCH };
    let source = Source {
        points: tessellation.points.clone(),
        triangles: triangles.clone(),
        patch_of: faces().map(shaping).collect(),
        patches: patches.len() as u32,
        curves: facet_curves.iter().map(|c| c.vertices.clone()).collect(),
        tips,
    };
    let has_merged = grouping.patches.iter().any(|faces| faces.len() > 1);
    let merged = has_merged.then(|| {
        let patch_of = faces().map(|face| patch_of_face[face]).collect();
        let source = Source { patch_of, ..source.clone() };
        Merged {
            is_merged: faces().map(|face| !is_main[face]).collect(),
            projector: FacetProjector::with_normals(source, normals, edges, |patch| {
                let is_single = faces_of[patch].len() == 1;
                is_single.then(|| facets[faces_of[patch][0]].clone())
            }),
        }
    });
    let bounds = tree::bounds(&tessellation.points);
    FacetModel {
        points: tessellation.points.clone(),
        triangles: triangles
            .iter()
            .zip(faces())
            .map(|(v, face)| BoundaryTriangle {
                vertices: v.map(VertexId),
                patch: PatchId(patch_of_face[face]),
            })
            .collect(),
        corners,
        curves: facet_curves,
        patches,
        bodies: vec![FacetBody { file: 0, number: None }; model.bodies],
        rounding: ROUNDING * bounds.min.coords.amax().max(bounds.max.coords.amax()),
        bounds,
        // Those of the main face: no others are of the patch here.
        projector: FacetProjector::with_normals(source, normals, edges, |patch| {
            Some(facets[faces_of[patch][0]].clone())
        }),
        merged,
        touching: Touching::default(),
        blunt: blunt
            .iter()
            .map(|end| BluntEnd { patch: patch_of_face[end.patch] as usize, ..*end })
            .collect(),
    }
}

/// The unit normals at the corners of all triangles, outward; those of the triangles at poles.
/// Their order is that of the oriented triangles.
fn corner_normals(model: &Model, tessellation: &Tessellation, is_reversed: &[bool]) -> Vec<[Vector; 3]> {
    let at = |patch: u32, [u, v]: [f64; 2]| model.patches[patch as usize].surface.jet(u, v, 1).normal();
    // Six triangles have each vertex inside of a patch, nearly always with the same parameters.
    let mut uses = vec![None; tessellation.points.len()];
    for t in &tessellation.triangles {
        for (&v, parameters) in t.vertices.iter().zip(t.parameters) {
            uses[v as usize].get_or_insert((t.patch, parameters));
        }
    }
    let normals: Vec<Option<Vector>> =
        uses.par_iter().map(|used| used.and_then(|(patch, parameters)| at(patch, parameters))).collect();
    let of = |t: &brep::Triangle| {
        let sign = if is_reversed[t.patch as usize] { -1.0 } else { 1.0 };
        let [a, b, c] = t.vertices.map(|v| tessellation.points[v as usize]);
        let flat = (b - a).cross(&(c - a)).try_normalize(0.0).unwrap_or_else(Vector::z);
        let [p, q, r] = [0, 1, 2].map(|k| {
            let (v, own) = (t.vertices[k] as usize, (t.patch, t.parameters[k]));
            let normal = if uses[v] == Some(own) { normals[v] } else { at(own.0, own.1) };
            // At poles rounding decides.
            normal.filter(|n| n.dot(&flat) > 0.5).unwrap_or(flat) * sign
        });
        if is_reversed[t.patch as usize] { [q, p, r] } else { [p, q, r] }
    };
    tessellation.triangles.par_iter().map(of).collect()
}

/// The edges that are curves: all but smooth seams.
fn curves_in_use(model: &Model, tessellation: &Tessellation) -> Vec<usize> {
    let mut uses: Vec<Vec<(usize, &brep::Fin)>> = vec![Vec::new(); model.curves.len()];
    for (p, patch) in model.patches.iter().enumerate() {
        for fin in patch.loops.iter().flatten() {
            if let On::Curve(curve) = fin.on {
                uses[curve].push((p, fin));
            }
        }
    }
    let is_seam = |c: usize| match uses[c][..] {
        [(p, one), (q, other)] if p == q => {
            let normal = |fin: &brep::Fin, t: f64| {
                let [u, v] = fin.curve.as_ref()?.point(fin.parameter(t, model.curves[c].range)).into();
                model.patches[p].surface.jet(u, v, 1).normal()
            };
            let is_smooth = |t: f64| match (normal(one, t), normal(other, t)) {
                (Some(m), Some(n)) => m.angle(&n) < SMOOTH,
                _ => true,
            };
            tessellation.lines[c].iter().all(|&(_, t)| is_smooth(t))
        }
        _ => false,
    };
    (0..model.curves.len()).filter(|&c| !is_seam(c)).collect()
}

/// The vertices that are corners, ascending.
fn corners(model: &Model, curves: &[usize], triangles: &[[u32; 3]], normals: &[[Vector; 3]]) -> Vec<u32> {
    let mut ends: Vec<Vec<usize>> = vec![Vec::new(); model.corners.len()];
    for &c in curves {
        model.curves[c].ends.iter().for_each(|&end| ends[end].push(c));
    }
    let is_round = |c: usize| {
        let edge = &model.curves[c];
        let [first, last] = edge.range.map(|t| edge.curve.jet(t)[1]);
        matches!(edge.curve, Curve::Ellipse { .. }) || first.angle(&last) < STRAIGHT
    };
    let mut around: Vec<Vec<Vector>> = vec![Vec::new(); model.corners.len()];
    for (t, n) in triangles.iter().zip(normals) {
        for (v, normal) in t.iter().zip(n).filter(|(v, _)| (**v as usize) < model.corners.len()) {
            around[*v as usize].push(*normal);
        }
    }
    // The tip of a cone is a corner; the pole of a sphere is not.
    let is_tip = |corner: usize| {
        let all = &around[corner];
        let mean = all.iter().sum::<Vector>().try_normalize(0.0);
        mean.is_none_or(|mean| all.iter().any(|n| n.angle(&mean) > TIP))
    };
    let is_corner = |corner: &usize| match ends[*corner][..] {
        [] => !around[*corner].is_empty() && is_tip(*corner),
        [a, b] if a == b => !is_round(a) || has_degenerate_side(model, *corner),
        _ => true,
    };
    (0..model.corners.len()).filter(is_corner).map(|corner| corner as u32).collect()
}

/// Normals of triangles at the pole of a sphere differ by less from their mean (radians); those at
/// the tip of a cone by half of its outer angle.
const TIP: f64 = 0.35;

fn has_degenerate_side(model: &Model, corner: usize) -> bool {
    let fins = model.patches.iter().flat_map(|patch| patch.loops.iter().flatten());
    fins.into_iter().any(|fin| fin.on == On::Corner(corner))
}

/// The curve of a chain of edges.
fn facet_curve(
    model: &Model,
    tessellation: &Tessellation,
    edges: &[(usize, bool)],
    grouping: &Grouping,
) -> FacetCurve {
    let (mut vertices, mut small) = (Vec::new(), Vec::new());
    for &(edge, is_forward) in edges {
        let mut line: Vec<u32> = tessellation.lines[edge].iter().map(|&(v, _)| v).collect();
        if !is_forward {
            line.reverse();
        }
        small.extend(vec![edges.len() > 1 && grouping.is_short[edge]; line.len() - 1]);
        // Each edge starts where the last one ends.
        vertices.pop();
        vertices.extend(line);
    }
    // A curve of short edges alone follows them, as one without any.
    if small.iter().all(|step| *step == small[0]) {
        small.clear();
    }
    let corner = |(edge, is_end): (usize, bool)| {
        let end = model.curves[edge].ends[usize::from(is_end)] as u32;
        grouping.corners.binary_search(&end).ok().map(CornerId::new)
    };
    let (first, last) = (edges[0], edges[edges.len() - 1]);
    let ends = corner((first.0, !first.1)).zip(corner(last)).map(|(a, b)| [a, b]);
    FacetCurve { ends, vertices, small }
}
