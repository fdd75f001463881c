//! What the faces and edges of a model have beside them, and how large they are.

use crate::ground::kernel::nearest::in_segment;
use crate::ground::kernel::tree::{Tree, bounds};
use crate::mesher::facets::BluntEnd;
use crate::mesher::facets::exact::Shape;
use crate::{Point, Vector};
use brep::{Fin, Model, On, Tessellation};
use rayon::prelude::*;
use std::collections::HashMap;

/// A tip that was cut off a face.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(in crate::mesher::facets) struct TipCut {
    /// The tip as a face of its own.
    pub tip: usize,
    /// The face that it was cut off, which it does not join again.
    pub of: usize,
    /// The edge between them.
    pub edge: usize,
}

/// Adjacencies and measures of a model.
pub(in crate::mesher::facets) struct Layout<'a> {
    pub model: &'a Model,
    pub tessellation: &'a Tessellation,
    /// The edges that are curves: all but smooth seams.
    pub curves: Vec<usize>,
    /// Whether each corner of the file is one in shape.
    pub is_corner: Vec<bool>,
    /// The faces at each edge that is a curve, one for each use.
    pub faces_of: Vec<Vec<usize>>,
    /// The edges around each face that are curves, each once.
    pub around: Vec<Vec<usize>>,
    /// The length of each edge.
    pub lengths: Vec<f64>,
    /// The width of each face at its widest place; infinite without edges.
    pub widths: Vec<f64>,
    /// The corners of the triangles of each face.
    pub triangles: Vec<Vec<[Point; 3]>>,
    /// The width of each face at points of its triangles; infinite without edges.
    pub local_widths: Vec<Vec<(Point, f64)>>,
    /// Tips that were cut off.
    pub cuts: Vec<TipCut>,
    /// Ends of faces whose curvature has no influence on sizes.
    pub blunt: Vec<BluntEnd>,
    /// For pieces of divided faces, the faces along the side where they should be merged.
    pub along: HashMap<usize, Vec<usize>>,
    /// The triangles at each segment of a curve.
    beside: HashMap<[u32; 2], Vec<usize>>,
}

fn key(a: u32, b: u32) -> [u32; 2] {
    [a.min(b), a.max(b)]
}

impl<'a> Layout<'a> {
    pub fn new(model: &'a Model, tessellation: &'a Tessellation, shape: &Shape) -> Self {
        let curves = shape.curves.clone();
        let mut is_corner = vec![false; model.corners.len()];
        shape.corners.iter().for_each(|&corner| is_corner[corner as usize] = true);
        let mut is_curve = vec![false; model.curves.len()];
        curves.iter().for_each(|&c| is_curve[c] = true);
        let mut faces_of = vec![Vec::new(); model.curves.len()];
        let mut around = vec![Vec::new(); model.patches.len()];
        for (face, patch) in model.patches.iter().enumerate() {
            for fin in patch.loops.iter().flatten() {
                let On::Curve(c) = fin.on else { continue };
                if is_curve[c] {
                    faces_of[c].push(face);
                    around[face].push(c);
                }
            }
            around[face].sort_unstable();
            around[face].dedup();
        }
        let point = |v: u32| tessellation.points[v as usize];
        let length = |line: &Vec<(u32, f64)>| {
            line.windows(2).map(|w| (point(w[1].0) - point(w[0].0)).norm()).sum::<f64>()
        };
        let lengths = tessellation.lines.iter().map(length).collect();
        let mut beside: HashMap<[u32; 2], Vec<usize>> = HashMap::new();
        for line in curves.iter().map(|&c| &tessellation.lines[c]) {
            for w in line.windows(2) {
                beside.insert(key(w[0].0, w[1].0), Vec::new());
            }
        }
        for (t, triangle) in tessellation.triangles.iter().enumerate() {
            let [a, b, c] = triangle.vertices;
            for (v, w) in [(a, b), (b, c), (c, a)] {
                if let Some(at) = beside.get_mut(&key(v, w)) {
                    at.push(t);
                }
            }
        }
        let mut triangles = vec![Vec::new(); model.patches.len()];
        for t in &tessellation.triangles {
            triangles[t.patch as usize].push(t.vertices.map(|v| tessellation.points[v as usize]));
        }
        let mut out = Self {
            model,
            tessellation,
            curves,
            is_corner,
            faces_of,
            around,
            lengths,
            widths: Vec::new(),
            triangles,
            local_widths: Vec::new(),
            cuts: Vec::new(),
            blunt: Vec::new(),
            along: HashMap::new(),
            beside,
        };
        out.local_widths = out.measured_widths();
        let widest = |of_face: &Vec<(Point, f64)>| of_face.iter().map(|at| at.1).fold(0.0, f64::max);
        out.widths = out.local_widths.iter().map(widest).collect();
        out
    }

    /// The width of each face at the centroids and the middles of the sides of its triangles: twice
    /// the distance from the edges of the face.
    fn measured_widths(&self) -> Vec<Vec<(Point, f64)>> {
        let points = |[a, b, c]: &[Point; 3]| {
            let centroid = Point::from((a.coords + b.coords + c.coords) / 3.0);
            [centroid, nalgebra::center(a, b), nalgebra::center(b, c), nalgebra::center(c, a)]
        };
        let widths = |face: usize| {
            let points = self.triangles[face].iter().flat_map(points);
            let segments: Vec<[Point; 2]> = self.segments(&self.around[face]).map(|s| self.ends(s)).collect();
            if segments.is_empty() {
                return points.map(|p| (p, f64::INFINITY)).collect();
            }
            let tree = Tree::new(&segments.iter().map(bounds).collect::<Vec<_>>());
            let squared = |p: Point| {
                tree.nearest(&p, |i| in_segment(&p, &segments[i as usize][0], &segments[i as usize][1]).1)
                    .map_or(0.0, |(_, squared)| squared)
            };
            points.map(|p| (p, 2.0 * squared(p).sqrt())).collect()
        };
        (0..self.model.patches.len()).into_par_iter().map(widths).collect()
    }

    /// The edge of a side of a face that is a curve, and the other face there.
    pub fn beyond(&self, face: usize, side: &Fin) -> Option<(usize, usize)> {
        let On::Curve(edge) = side.on else { return None };
        match self.faces_of[edge][..] {
            [a, b] if a != b => Some((edge, if a == face { b } else { a })),
            _ => None,
        }
    }

    /// The points of a side that is an edge, with their parameters, in the direction of its loop.
    ///
    /// # Panics
    /// If it is a corner.
    pub fn line(&self, side: &Fin) -> Vec<(Point, f64)> {
        let On::Curve(edge) = side.on else { panic!("the side is an edge") };
        let on = |&(v, t): &(u32, f64)| (self.tessellation.points[v as usize], t);
        let mut line: Vec<_> = self.tessellation.lines[edge].iter().map(on).collect();
        if !side.is_forward {
            line.reverse();
        }
        line
    }

    /// The cut of a face that is a tip.
    pub fn cut_of(&self, face: usize) -> Option<&TipCut> {
        self.cuts.iter().find(|cut| cut.tip == face)
    }

    /// The segments of edges, as vertices.
    pub fn segments(&self, edges: &[usize]) -> impl Iterator<Item = [u32; 2]> {
        let lines = edges.iter().map(|&edge| &self.tessellation.lines[edge]);
        lines.flat_map(|line| line.windows(2).map(|w| [w[0].0, w[1].0]))
    }

    pub fn ends(&self, segment: [u32; 2]) -> [Point; 2] {
        segment.map(|v| self.tessellation.points[v as usize])
    }

    /// The faces at a segment of a curve, each with the unit direction from the segment into its
    /// triangle there.
    pub fn faces_beside(&self, [a, b]: [u32; 2]) -> impl Iterator<Item = (usize, Vector)> {
        let [p, q] = self.ends([a, b]);
        let along = (q - p).try_normalize(0.0).unwrap_or_else(Vector::zeros);
        let at = self.beside.get(&key(a, b)).map_or(&[][..], Vec::as_slice);
        at.iter().filter_map(move |&t| {
            let triangle = &self.tessellation.triangles[t];
            let apex = triangle.vertices.into_iter().find(|v| *v != a && *v != b)?;
            let way = self.tessellation.points[apex as usize] - p;
            let across = (way - along * along.dot(&way)).try_normalize(0.0)?;
            Some((triangle.patch as usize, across))
        })
    }

    /// The bodies beside a face, the lower one first, and none last.
    pub fn bodies(&self, face: usize) -> [usize; 2] {
        let [a, b] = self.model.patches[face].bodies.map(|body| body.unwrap_or(usize::MAX));
        [a.min(b), a.max(b)]
    }

    /// The name of a face in the file.
    pub fn name(&self, face: usize) -> Option<&str> {
        self.model.patch_names.get(face)?.as_deref()
    }

    /// The unit tangent of an edge at its start or end, along the edge.
    pub fn tangent(&self, edge: usize, is_end: bool) -> Vector {
        let curve = &self.model.curves[edge];
        let exact = curve.curve.jet(curve.range[usize::from(is_end)])[1].try_normalize(0.0);
        exact.unwrap_or_else(|| {
            let line = &self.tessellation.lines[edge];
            let at = if is_end { line.len() - 2 } else { 0 };
            let [p, q] = self.ends([line[at].0, line[at + 1].0]);
            (q - p).try_normalize(0.0).unwrap_or_else(Vector::zeros)
        })
    }
}
