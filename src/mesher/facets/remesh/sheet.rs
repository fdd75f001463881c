//! The triangles during remeshing, with any number of them at an edge.

use super::changes::Changes;
use super::polyline::Polyline;
use super::{Constraints, Sizes};
use crate::Point;
use crate::ground::kernel::simplex::area_vector;
use crate::ground::projector::facets::FacetProjector;
use crate::ground::size::SizeField;
use crate::mesher::facets::FacetModel;
use csg::{CornerId, CurveId, PatchId};
use rayon::prelude::*;

/// No curve, no triangle, no vertex.
pub(super) const NONE: u32 = u32::MAX;

/// The geometric entity that a vertex is classified on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Kind {
    Corner(CornerId),
    /// On a curve, at this arc length from its start.
    Curve(CurveId, f64),
    Patch(PatchId),
}

/// A triangle; removed if its first vertex is [`NONE`].
#[derive(Clone, Copy, Debug)]
pub(super) struct Triangle {
    pub v: [u32; 3],
    pub patch: PatchId,
    /// The curve of the side opposite each vertex, or [`NONE`].
    pub curve: [u32; 3],
}

impl Triangle {
    pub fn lives(&self) -> bool {
        self.v[0] != NONE
    }

    /// The index of a vertex in the triangle.
    pub fn corner(&self, v: u32) -> Option<usize> {
        self.v.iter().position(|&w| w == v)
    }

    /// The side between two vertices.
    pub fn side(&self, a: u32, b: u32) -> Option<usize> {
        let (i, j) = (self.corner(a)?, self.corner(b)?);
        (i != j).then_some(3 - i - j)
    }
}

/// The mesh during remeshing.
pub(super) struct Sheet<'a> {
    pub model: &'a FacetModel,
    pub size: Sizes<'a>,
    pub points: Vec<Point>,
    pub kinds: Vec<Kind>,
    /// The wanted size at each vertex.
    pub sizes: Vec<f64>,
    /// The triangles at each vertex; none at removed vertices.
    pub around: Vec<Vec<u32>>,
    pub triangles: Vec<Triangle>,
    pub polylines: Vec<Polyline>,
    /// What must stay.
    pub constraints: &'a Constraints,
    /// Whether each curve is straight.
    pub straight: Vec<bool>,
    /// What has changed.
    pub changes: Changes,
}

/// How many triangles a thread takes at once when all are visited.
const GATHERED: usize = 4096;

/// A triangle follows its patch if the angle between its normal and that of the facets at its
/// centroid is at most 60° (cosine) ...
const FITTING_COSINE: f64 = 0.5;
/// ... and its centroid is at most this fraction of its longest side, or of the wanted size, away
/// from them. The faces of an icosahedron are 0.2 of their sides away from the sphere.
const FITTING_DISTANCE: f64 = 0.21;

impl<'a> Sheet<'a> {
    pub fn new(model: &'a FacetModel, size: Sizes<'a>, constraints: &'a Constraints) -> Self {
        let mesh = crate::mesher::facets::keep(model);
        let mut kinds = vec![Kind::Corner(CornerId(0)); mesh.points.len()];
        let mut triangles: Vec<Triangle> = mesh
            .triangles
            .iter()
            .map(|t| Triangle { v: t.vertices.map(|v| v.0), patch: t.patch, curve: [NONE; 3] })
            .collect();
        let mut around = vec![Vec::new(); mesh.points.len()];
        for (t, triangle) in triangles.iter().enumerate() {
            for v in triangle.v {
                kinds[v as usize] = Kind::Patch(triangle.patch);
                around[v as usize].push(t as u32);
            }
        }
        let polylines: Vec<Polyline> = model.curves.iter().map(|c| Polyline::new(model, c)).collect();
        for (c, curve) in model.curves.iter().enumerate() {
            for (i, &v) in curve.vertices.iter().enumerate().rev() {
                kinds[v as usize] = Kind::Curve(CurveId::new(c), polylines[c].place(i));
            }
            for w in curve.vertices.windows(2) {
                for &t in &around[w[0] as usize] {
                    let triangle = &mut triangles[t as usize];
                    if let Some(side) = triangle.side(w[0], w[1]) {
                        triangle.curve[side] = c as u32;
                    }
                }
            }
        }
        for (i, &v) in model.corners.iter().enumerate() {
            kinds[v as usize] = Kind::Corner(CornerId::new(i));
        }
        let is_straight = |c: usize| match constraints.pieces.get(c) {
            Some(piece) => piece.of.is_none() || piece.is_straight,
            None => model.projector.is_straight_curve(CurveId::new(c)),
        };
        let straight = (0..polylines.len()).map(is_straight).collect();
        let sizes = mesh.points.par_iter().map(|p| size.size_at(p)).collect();
        let changes = Changes::new(mesh.points.len());
        let points = mesh.points;
        Self {
            model,
            size,
            points,
            kinds,
            sizes,
            around,
            triangles,
            polylines,
            constraints,
            straight,
            changes,
        }
    }

    /// Re-evaluates the sizes at all vertices.
    pub fn update_sizes(&mut self) {
        let sizes: Vec<f64> = self.points.par_iter().map(|p| self.size.size_at(p)).collect();
        for (v, size) in sizes.into_iter().enumerate() {
            if size != self.sizes[v] {
                self.sizes[v] = size;
                self.changes.change(v as u32);
            }
        }
    }

    pub fn living(&self) -> impl Iterator<Item = u32> + '_ {
        (0..self.triangles.len() as u32).filter(|&t| self.triangles[t as usize].lives())
    }

    /// What `add` finds at each triangle, in their order.
    pub fn gather<T: Clone + Send>(&self, add: impl Fn(&Triangle, &mut Vec<T>) + Sync) -> Vec<T> {
        let blocks = self.triangles.par_chunks(GATHERED).map(|block| {
            let mut found = Vec::new();
            block.iter().filter(|t| t.lives()).for_each(|t| add(t, &mut found));
            found
        });
        blocks.collect::<Vec<_>>().concat()
    }

    pub fn at(&self, t: u32) -> &Triangle {
        &self.triangles[t as usize]
    }

    pub fn corners(&self, v: [u32; 3]) -> [Point; 3] {
        v.map(|v| self.points[v as usize])
    }

    /// The corners of a triangle, as they would be if one of them were at `place`.
    pub fn corners_with(&self, t: u32, moved: u32, place: &Point) -> [Point; 3] {
        self.at(t).v.map(|v| if v == moved { *place } else { self.points[v as usize] })
    }

    /// The length of an edge, in units of the mean wanted size at its ends.
    pub fn length(&self, a: u32, b: u32) -> f64 {
        let [a, b] = [a, b].map(|v| v as usize);
        2.0 * (self.points[b] - self.points[a]).norm() / (self.sizes[a] + self.sizes[b])
    }

    /// The triangles at an edge.
    pub fn at_edge(&self, a: u32, b: u32) -> impl Iterator<Item = u32> + '_ {
        self.around[a as usize].iter().copied().filter(move |&t| self.at(t).v.contains(&b))
    }

    /// The two triangles at an edge inside a patch; `None` for other edges.
    pub fn pair(&self, a: u32, b: u32) -> Option<[u32; 2]> {
        let mut at = self.at_edge(a, b);
        let pair = [at.next()?, at.next()?];
        let side = self.at(pair[0]).side(a, b)?;
        (at.next().is_none()
            && self.at(pair[0]).curve[side] == NONE
            && self.at(pair[0]).patch == self.at(pair[1]).patch)
            .then_some(pair)
    }

    /// The neighbours of a vertex, ascending.
    pub fn neighbours(&self, v: u32, out: &mut Vec<u32>) {
        out.clear();
        for &t in &self.around[v as usize] {
            out.extend(self.at(t).v.into_iter().filter(|&w| w != v));
        }
        out.sort_unstable();
        out.dedup();
    }

    /// Whether a triangle follows its patch; see [`FITTING_COSINE`] and [`FITTING_DISTANCE`].
    ///
    /// On merged faces it may follow those instead: collapses lead from triangles on a rounded edge
    /// to triangles across it.
    pub fn fits(&self, patch: PatchId, p: &[Point; 3], size: f64) -> bool {
        let merged = self.model.merged.as_ref();
        follows(&self.model.projector, patch, p, size)
            || merged.is_some_and(|merged| follows(&merged.projector, patch, p, size))
    }

    /// The triangles that do not follow their patches; those that have not changed since the last
    /// call are not tested again.
    pub fn misfits(&mut self) -> Vec<u32> {
        let changed: Vec<u32> =
            self.living().filter(|&t| self.changes.fit(t, self.at(t).v).is_none()).collect();
        let fits: Vec<bool> = changed.par_iter().map(|&t| self.fits_at(t)).collect();
        changed.into_iter().zip(fits).for_each(|(t, fits)| self.changes.set_fit(t, fits));
        self.living().filter(|&t| self.changes.fit(t, self.at(t).v) == Some(false)).collect()
    }

    /// Notes that the triangles around a vertex change.
    pub fn change_around(&mut self, v: u32) {
        for &t in &self.around[v as usize] {
            self.triangles[t as usize].v.iter().for_each(|&w| self.changes.change(w));
        }
    }

    /// Whether a triangle of the mesh follows its patch.
    pub fn fits_at(&self, t: u32) -> bool {
        let triangle = self.at(t);
        self.fits(triangle.patch, &self.corners(triangle.v), self.mean_size(triangle.v))
    }

    /// The mean of the sizes wanted at some vertices.
    pub fn mean_size(&self, v: [u32; 3]) -> f64 {
        v.iter().map(|&v| self.sizes[v as usize]).sum::<f64>() / 3.0
    }

    /// The quality of a triangle, at most 1: its shape, less 1 if two sides on one smooth curve
    /// would make it flatten in refinement.
    pub fn value(&self, v: [u32; 3], curve: [u32; 3]) -> f64 {
        self.value_of(&self.corners(v), curve)
    }

    /// The quality of a triangle with these corners.
    pub fn value_of(&self, p: &[Point; 3], curve: [u32; 3]) -> f64 {
        shape(p) - if self.flattens(curve) { 1.0 } else { 0.0 }
    }

    pub fn value_at(&self, t: u32) -> f64 {
        let triangle = self.at(t);
        self.value(triangle.v, triangle.curve)
    }

    /// Whether two sides are on one curve that is not straight.
    pub fn flattens(&self, curve: [u32; 3]) -> bool {
        (0..3).any(|k| {
            let [c, d] = [curve[k], curve[(k + 1) % 3]];
            c != NONE && d != NONE && !self.straight[c as usize] && self.constraints.are_of_one_curve(c, d)
        })
    }

    /// Adds a vertex without triangles; returns its number.
    pub fn add_vertex(&mut self, point: Point, kind: Kind, size: f64) -> u32 {
        self.points.push(point);
        self.kinds.push(kind);
        self.sizes.push(size);
        self.around.push(Vec::new());
        self.changes.add_vertex();
        self.points.len() as u32 - 1
    }

    /// Adds a triangle.
    pub fn add_triangle(&mut self, triangle: Triangle) {
        let t = self.triangles.len() as u32;
        triangle.v.iter().for_each(|&v| self.around[v as usize].push(t));
        self.triangles.push(triangle);
    }

    /// Removes a triangle.
    pub fn remove_triangle(&mut self, t: u32) {
        for v in self.at(t).v {
            self.around[v as usize].retain(|&s| s != t);
        }
        self.triangles[t as usize].v = [NONE; 3];
    }

    /// The arc-length position of a vertex on a curve. A corner at both ends of a loop is at 0.
    pub fn place_on(&self, v: u32, curve: u32) -> f64 {
        match self.kinds[v as usize] {
            Kind::Curve(_, place) => place,
            Kind::Corner(corner) => match self.polylines[curve as usize].ends {
                Some([start, _]) if start == corner => 0.0,
                _ => self.polylines[curve as usize].length(),
            },
            Kind::Patch(_) => unreachable!("a vertex on a patch is on no curve"),
        }
    }
}

/// The time of the last change.
pub(super) fn now(sheet: &Sheet) -> u64 {
    sheet.changes.now()
}

/// Whether a triangle follows the facets of a patch.
fn follows(projector: &FacetProjector, patch: PatchId, p: &[Point; 3], size: f64) -> bool {
    let area = area_vector(&p[0], &p[1], &p[2]);
    let norm = area.norm();
    if norm <= 0.0 {
        return false;
    }
    if let Some(normal) = projector.flat_normal(patch) {
        return area.dot(&normal) > FITTING_COSINE * norm;
    }
    let middle = Point::from((p[0].coords + p[1].coords + p[2].coords) / 3.0);
    let foot = projector.foot(patch, &middle);
    let longest = longest_squared(p).sqrt();
    area.dot(&foot.normal) >= FITTING_COSINE * norm
        && (middle - foot.point).norm() <= FITTING_DISTANCE * longest.min(size)
}

/// 4√3·area/Σl²: 1 for the regular triangle, 0 for one without area.
pub(super) fn shape(p: &[Point; 3]) -> f64 {
    let squares = (p[1] - p[0]).norm_squared() + (p[2] - p[1]).norm_squared() + (p[0] - p[2]).norm_squared();
    let double_area = area_vector(&p[0], &p[1], &p[2]).norm();
    if squares > 0.0 { 2.0 * 3.0_f64.sqrt() * double_area / squares } else { 0.0 }
}

fn longest_squared(p: &[Point; 3]) -> f64 {
    (p[1] - p[0]).norm_squared().max((p[2] - p[1]).norm_squared()).max((p[0] - p[2]).norm_squared())
}
