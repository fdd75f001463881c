//! Projection to the facets of a patch and to the polyline of a curve.

pub(crate) mod edges;
pub(crate) mod normals;

use crate::ground::kernel::nearest::{at, in_segment, in_triangle};
use crate::ground::kernel::tree::{Tree, bounds};
use crate::{Point, Vector};
use csg::{CurveId, PatchId};
use edges::Edges;
use rayon::prelude::*;
use std::sync::Arc;

/// Patches as facets and curves as polylines, with projection to them.
///
/// The result depends only on the point and the entity, bit by bit, on all ranks and threads.
///
/// **A patch is extended beyond its rim** by the tangent planes there. The chord of a curve that
/// bends into its patch is outside the patch. Without the extension, all fine vertices between
/// chord and curve would be projected onto the rim and coincide with vertices of the curve.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct FacetProjector {
    source: Source,
    patches: Vec<Arc<PatchFacets>>,
    curves: Vec<Polyline>,
    tolerance: f64,
}

/// The patch of triangles that nothing is projected to.
pub(crate) const NO_PATCH: u32 = u32::MAX;

/// The data of a projector, which is also what ranks exchange.
#[derive(Clone, Debug, Default, PartialEq)]
pub(crate) struct Source {
    pub points: Vec<Point>,
    pub triangles: Vec<[u32; 3]>,
    /// The patch of each triangle, or [`NO_PATCH`].
    pub patch_of: Vec<u32>,
    pub patches: u32,
    /// The vertices of each curve; a closed curve ends with its first vertex.
    pub curves: Vec<Vec<u32>>,
    /// Corners on no curve, in ascending order.
    pub tips: Vec<u32>,
}

/// The facets of one patch.
#[derive(Debug, PartialEq)]
pub(crate) struct PatchFacets {
    tree: Tree,
    facets: Vec<[Point; 3]>,
    /// Unit normals of the patch at the corners of its facets.
    normals: Vec<[Vector; 3]>,
    /// Bit k: the side opposite corner k is on the rim of the patch; bit 3 + k: corner k is on the
    /// rim.
    rim: Vec<u8>,
    /// The normal of the common plane of all facets, if there is one.
    flat: Option<Vector>,
}

/// The segments of one curve.
#[derive(Clone, Debug, Default, PartialEq)]
struct Polyline {
    tree: Tree,
    points: Vec<Point>,
    straight: bool,
}

/// The foot of a projection to a patch.
pub(crate) struct Foot {
    /// The projected point.
    pub point: Point,
    /// The unit normal of the patch there.
    pub normal: Vector,
}

/// The tolerance as a fraction of the diagonal of the facets' box, as for analytic surfaces.
///
/// The tolerance is at least [`COORDINATE_ROUNDING`] times the largest coordinate.
const ON_SURFACE: f64 = 1e-12;

/// Patches are flat and curves straight if they are so up to this fraction of the tolerance. Means
/// of their points, which are not projected, are then within half the tolerance: the points may be
/// on one side of the plane, the facets at the mean on the other.
const ON_PLANE: f64 = 0.25;

/// Four units in the last place.
const COORDINATE_ROUNDING: f64 = 4.0 * f64::EPSILON;

impl FacetProjector {
    pub(crate) fn new(source: Source) -> Self {
        let edges = Edges::new(&source.triangles);
        let rounding = normals::rounding(&source.points);
        let (all, slivers) = normals::trusted(&source.points, &source.triangles, &edges, rounding);
        let of_corners = |members: &[u32]| {
            let triangles: Vec<[u32; 3]> = members.iter().map(|&t| source.triangles[t as usize]).collect();
            let of: Vec<Vector> = members.iter().map(|&t| all[t as usize]).collect();
            let sliver: Vec<bool> = members.iter().map(|&t| slivers[t as usize]).collect();
            normals::of_corners(&source.points, &triangles, &of, &sliver, &source.tips)
        };
        let tolerance = tolerance(&source.points);
        let patches = patches(&source, &edges, tolerance, of_corners, |_| None);
        Self::of(source, patches, tolerance)
    }

    /// A projector with unit normals at the corners of all triangles, instead of those of the
    /// triangles, and their edges. Facets of patches that are `known` are not looked at.
    pub(crate) fn with_normals(
        source: Source,
        normals: &[[Vector; 3]],
        edges: &Edges,
        known: impl Fn(usize) -> Option<Arc<PatchFacets>> + Sync,
    ) -> Self {
        let tolerance = tolerance(&source.points);
        let of_corners = |members: &[u32]| members.iter().map(|&t| normals[t as usize]).collect();
        let patches = patches(&source, edges, tolerance, of_corners, known);
        Self::of(source, patches, tolerance)
    }

    /// The facets of each patch, for projectors that have the same patches.
    pub(crate) fn facets_of(
        source: &Source,
        normals: &[[Vector; 3]],
        edges: &Edges,
    ) -> Vec<Arc<PatchFacets>> {
        let of_corners = |members: &[u32]| members.iter().map(|&t| normals[t as usize]).collect();
        patches(source, edges, tolerance(&source.points), of_corners, |_| None)
    }

    fn of(source: Source, patches: Vec<Arc<PatchFacets>>, tolerance: f64) -> Self {
        let polyline = |c: &Vec<u32>| {
            Polyline::new(c.iter().map(|&v| source.points[v as usize]).collect(), ON_PLANE * tolerance)
        };
        let curves = source.curves.iter().map(polyline).collect();
        Self { source, patches, curves, tolerance }
    }

    /// The maximum distance of a projected point from facets and polylines by rounding (length).
    pub fn tolerance(&self) -> f64 {
        self.tolerance
    }

    /// The number of patches.
    pub fn patches(&self) -> usize {
        self.patches.len()
    }

    /// The number of curves.
    pub fn curves(&self) -> usize {
        self.curves.len()
    }

    /// The point of `patch`, extended by tangent planes at its rim, nearest to `point`.
    pub fn project_patch(&self, patch: PatchId, point: &Point) -> Point {
        self.foot(patch, point).point
    }

    /// The point of the polyline of `curve` nearest to `point`.
    pub fn project_curve(&self, curve: CurveId, point: &Point) -> Point {
        let curve = &self.curves[curve.index()];
        let (segment, t) = curve.nearest(point);
        let (a, b) = (curve.points[segment], curve.points[segment + 1]);
        match t {
            1.0 => b,
            _ => a + (b - a) * t,
        }
    }

    /// The distance of `point` from `patch`, extended by tangent planes at its rim.
    pub fn patch_distance(&self, patch: PatchId, point: &Point) -> f64 {
        (self.project_patch(patch, point) - point).norm()
    }

    /// The distance of `point` from the facets of `patch`, without extension.
    pub fn facet_distance(&self, patch: PatchId, point: &Point) -> f64 {
        let patch = &self.patches[patch.index()];
        let (nearest, weights) = patch.nearest(point);
        (at(&patch.facets[nearest], weights) - point).norm()
    }

    /// The distance of `point` from `curve`.
    pub fn curve_distance(&self, curve: CurveId, point: &Point) -> f64 {
        (self.project_curve(curve, point) - point).norm()
    }

    /// The squared distance of `point` from `curve`, if it is less than `limit`.
    pub(crate) fn curve_within(&self, curve: CurveId, point: &Point, limit: f64) -> Option<f64> {
        let Polyline { points, tree, .. } = &self.curves[curve.index()];
        let to = |s: u32| in_segment(point, &points[s as usize], &points[s as usize + 1]).1;
        tree.nearest_within(point, limit, to).map(|(_, squared)| squared)
    }

    /// The points of a curve.
    pub(crate) fn curve_points(&self, curve: CurveId) -> &[Point] {
        &self.curves[curve.index()].points
    }

    /// Whether all facets of a patch are in one plane up to a quarter of the
    /// [`tolerance`](Self::tolerance), so that means of its points need no projection.
    pub fn is_flat_patch(&self, patch: PatchId) -> bool {
        self.flat_normal(patch).is_some()
    }

    /// Whether a curve is straight up to a quarter of the [`tolerance`](Self::tolerance).
    pub fn is_straight_curve(&self, curve: CurveId) -> bool {
        self.curves[curve.index()].straight
    }

    /// The unit normal of a patch near a point, interpolated over the facets, outward from its
    /// `inside`.
    pub fn normal(&self, patch: PatchId, near: &Point) -> Vector {
        self.foot(patch, near).normal
    }

    /// The unit tangent of a curve near a point: that of the segment, or the mean of two at a
    /// vertex.
    pub fn tangent(&self, curve: CurveId, near: &Point) -> Option<Vector> {
        let curve = &self.curves[curve.index()];
        let (segment, t) = curve.nearest(near);
        let direction = |s: usize| (curve.points[s + 1] - curve.points[s]).try_normalize(0.0);
        let last = curve.points.len() - 2;
        let closed = curve.points[0] == curve.points[last + 1];
        let other = match t {
            0.0 if segment > 0 => Some(segment - 1),
            0.0 if closed => Some(last),
            1.0 if segment < last => Some(segment + 1),
            1.0 if closed => Some(0),
            _ => None,
        };
        let own = direction(segment)?;
        match other.and_then(direction) {
            Some(other) => (own + other).try_normalize(0.0),
            None => Some(own),
        }
    }

    /// Whether a point is a corner on no curve, such as the apex of a cone, at which patches have
    /// no normal.
    pub fn is_tip(&self, point: &Point) -> bool {
        self.source.tips.iter().any(|&v| self.source.points[v as usize] == *point)
    }

    /// The facets in pieces of one patch each, with the normals of the patch at their corners.
    pub(crate) fn facets(&self) -> impl Iterator<Item = (usize, &[[Point; 3]], &[[Vector; 3]])> {
        /// Facets of a piece, at most.
        const MOST: usize = 4096;
        self.patches.iter().enumerate().flat_map(|(patch, of)| {
            let pieces = of.facets.chunks(MOST).zip(of.normals.chunks(MOST));
            pieces.map(move |(facets, normals)| (patch, facets, normals))
        })
    }

    /// The normal of a flat patch.
    pub(crate) fn flat_normal(&self, patch: PatchId) -> Option<Vector> {
        self.patches[patch.index()].flat
    }

    pub(crate) fn foot(&self, patch: PatchId, point: &Point) -> Foot {
        self.patches[patch.index()].foot(point, self.tolerance)
    }

    /// Encodes the projector for other ranks: counts, then coordinates, then indices, all
    /// little-endian.
    pub fn encode(&self) -> Vec<u8> {
        let s = &self.source;
        let counts = [s.points.len(), s.triangles.len(), s.patches as usize, s.curves.len(), s.tips.len()];
        let mut out: Vec<u8> = counts.iter().flat_map(|&n| (n as u64).to_le_bytes()).collect();
        out.extend(s.points.iter().flat_map(|p| [p.x, p.y, p.z]).flat_map(f64::to_le_bytes));
        let lengths = s.curves.iter().map(|c| c.len() as u32);
        let indices = lengths
            .chain(s.triangles.iter().flatten().copied())
            .chain(s.patch_of.iter().copied())
            .chain(s.curves.iter().flatten().copied())
            .chain(s.tips.iter().copied());
        out.extend(indices.flat_map(u32::to_le_bytes));
        out
    }

    /// The inverse of [`encode`](Self::encode); `None` if the bytes are invalid.
    pub fn decode(bytes: &[u8]) -> Option<Self> {
        let mut reader = Reader(bytes);
        let mut counts = [0; 5];
        for count in &mut counts {
            *count = usize::try_from(u64::from_le_bytes(reader.take()?)).ok()?;
        }
        let [points, triangles, patches, curves, tips] = counts;
        if points.checked_mul(24)? > bytes.len() || triangles.checked_mul(16)? > bytes.len() {
            return None;
        }
        let mut number = || reader.take().map(f64::from_le_bytes);
        let points: Vec<Point> =
            (0..points).map(|_| Some(Point::new(number()?, number()?, number()?))).collect::<Option<_>>()?;
        let mut index = || reader.take().map(u32::from_le_bytes);
        let lengths: Vec<u32> = (0..curves).map(|_| index()).collect::<Option<_>>()?;
        let vertex = |v: Option<u32>| v.filter(|&v| (v as usize) < points.len());
        let triangles: Vec<[u32; 3]> = (0..triangles)
            .map(|_| Some([vertex(index())?, vertex(index())?, vertex(index())?]))
            .collect::<Option<_>>()?;
        let in_patch = |p: &u32| (*p as usize) < patches;
        let patch_of = triangles.iter().map(|_| index().filter(in_patch)).collect::<Option<_>>()?;
        let curve = |n: &u32| -> Option<Vec<u32>> { (0..*n).map(|_| vertex(index())).collect() };
        let curves: Vec<Vec<u32>> = lengths.iter().map(curve).collect::<Option<_>>()?;
        let tips = (0..tips).map(|_| vertex(index())).collect::<Option<_>>()?;
        let sound = reader.0.is_empty() && curves.iter().all(|c| c.len() >= 2);
        let patches = u32::try_from(patches).ok()?;
        sound.then(|| Self::new(Source { points, triangles, patch_of, patches, curves, tips }))
    }
}

/// Reads bytes from the front of a slice.
struct Reader<'a>(&'a [u8]);

impl Reader<'_> {
    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk()?;
        self.0 = rest;
        Some(*first)
    }
}

/// The tolerance of projections to facets with these points.
fn tolerance(points: &[Point]) -> f64 {
    let all = bounds(points);
    let largest = all.min.coords.amax().max(all.max.coords.amax());
    f64::max(ON_SURFACE * all.diagonal(), COORDINATE_ROUNDING * largest)
}

/// The facets of each patch with the normals at their corners; those of some are `known`.
fn patches(
    source: &Source,
    edges: &Edges,
    tolerance: f64,
    normals: impl Fn(&[u32]) -> Vec<[Vector; 3]> + Sync,
    known: impl Fn(usize) -> Option<Arc<PatchFacets>> + Sync,
) -> Vec<Arc<PatchFacets>> {
    let mut members: Vec<Vec<u32>> = vec![Vec::new(); source.patches as usize];
    for (t, &patch) in source.patch_of.iter().enumerate() {
        if patch != NO_PATCH {
            members[patch as usize].push(t as u32);
        }
    }
    let made = |members: &Vec<u32>| {
        Arc::new(PatchFacets::new(source, edges, members, normals(members), ON_PLANE * tolerance))
    };
    let patch = |(patch, members)| known(patch).unwrap_or_else(|| made(members));
    members.par_iter().enumerate().map(patch).collect()
}

impl PatchFacets {
    fn new(
        source: &Source,
        edges: &Edges,
        members: &[u32],
        normals: Vec<[Vector; 3]>,
        tolerance: f64,
    ) -> Self {
        let triangles: Vec<[u32; 3]> = members.iter().map(|&t| source.triangles[t as usize]).collect();
        let facets: Vec<[Point; 3]> =
            triangles.iter().map(|t| t.map(|v| source.points[v as usize])).collect();
        let boxes: Vec<_> = facets.iter().map(bounds).collect();
        let own = source.patch_of.get(members.first().map_or(0, |&t| t as usize)).copied();
        let mut on_rim: Vec<u32> = Vec::new();
        let mut rim: Vec<u8> = vec![0; members.len()];
        for (i, &t) in members.iter().enumerate() {
            for side in 0..3 {
                let uses = edges.uses(edges.of_side[t as usize][side] as usize);
                // A curve with the patch on both sides is not on the rim.
                if uses.iter().filter(|u| Some(source.patch_of[u.triangle as usize]) == own).count() == 1 {
                    rim[i] |= 1 << side;
                    on_rim.extend(uses[0].ends);
                }
            }
        }
        on_rim.sort_unstable();
        on_rim.dedup();
        for (bits, t) in rim.iter_mut().zip(&triangles) {
            for (k, v) in t.iter().enumerate() {
                *bits |= u8::from(on_rim.binary_search(v).is_ok()) << (3 + k);
            }
        }
        let flat = plane_normal(&facets, tolerance);
        Self { tree: Tree::new(&boxes), facets, normals, rim, flat }
    }

    /// The nearest facet, and the weights of the nearest point on it.
    fn nearest(&self, point: &Point) -> (usize, [f64; 3]) {
        let squared = |i: u32| {
            let facet = &self.facets[i as usize];
            (at(facet, in_triangle(point, facet)) - point).norm_squared()
        };
        let (nearest, _) = self.tree.nearest(point, squared).expect("a patch has facets");
        (nearest as usize, in_triangle(point, &self.facets[nearest as usize]))
    }

    fn foot(&self, point: &Point, tolerance: f64) -> Foot {
        let mut here = *point;
        for _ in 0..MOST_STEPS {
            let (nearest, weights) = self.nearest(&here);
            let facet = &self.facets[nearest];
            let foot = at(facet, weights);
            let [m, n, o] = &self.normals[nearest];
            let mean = m * weights[0] + n * weights[1] + o * weights[2];
            let mut normal = mean.try_normalize(0.0).unwrap_or(*m);
            let side = weights.iter().position(|w| *w == 0.0);
            let corner = weights.iter().position(|w| *w == 1.0);
            let beyond = match (corner, side) {
                (Some(k), _) => 8 << k,
                (None, Some(k)) => 1 << k,
                (None, None) => 0,
            };
            if self.rim[nearest] & beyond == 0 || here == foot {
                return Foot { point: foot, normal };
            }
            if let (None, Some(k)) = (corner, side) {
                // Orthogonal to the rim, so that the next iteration finds the same foot.
                let along = facet[(k + 2) % 3] - facet[(k + 1) % 3];
                let across = normal - along * (normal.dot(&along) / along.norm_squared());
                normal = across.try_normalize(0.0).unwrap_or(normal);
            }
            let off = normal.dot(&(here - foot));
            here -= normal * off;
            if off.abs() <= 0.1 * tolerance {
                return Foot { point: here, normal };
            }
        }
        Foot { point: here, normal: self.normals[self.nearest(&here).0][0] }
    }
}

/// The maximum number of iterations for a point beyond the rim.
///
/// Two are enough beyond a side; beyond a corner, each reduces the distance by the angle between
/// the normals there.
const MOST_STEPS: usize = 30;

/// The normal of the largest facet if all corners lie in its plane, up to `tolerance`.
fn plane_normal(facets: &[[Point; 3]], tolerance: f64) -> Option<Vector> {
    let area = |f: &[Point; 3]| crate::ground::kernel::simplex::area_vector(&f[0], &f[1], &f[2]);
    let largest = facets.iter().max_by(|f, g| area(f).norm_squared().total_cmp(&area(g).norm_squared()))?;
    let normal = area(largest).try_normalize(0.0)?;
    let in_plane = |p: &Point| normal.dot(&(p - largest[0])).abs() <= tolerance;
    facets.iter().flatten().all(in_plane).then_some(normal)
}

impl Polyline {
    fn new(points: Vec<Point>, tolerance: f64) -> Self {
        let boxes: Vec<_> = points.windows(2).map(bounds).collect();
        let far = points
            .iter()
            .max_by(|p, q| (*p - points[0]).norm_squared().total_cmp(&(*q - points[0]).norm_squared()));
        let line = far.map(|far| [points[0], *far]);
        let straight = line.is_some_and(|[a, b]| {
            a != b
                && points[0] != points[points.len() - 1]
                && points.iter().all(|p| in_segment(p, &a, &b).1 <= tolerance * tolerance)
        });
        Self { tree: Tree::new(&boxes), points, straight }
    }

    /// The nearest segment, and the parameter of the nearest point on it, from 0 to 1.
    fn nearest(&self, point: &Point) -> (usize, f64) {
        let on = |i: u32| in_segment(point, &self.points[i as usize], &self.points[i as usize + 1]);
        let (segment, _) = self.tree.nearest(point, |i| on(i).1).expect("a curve has segments");
        (segment as usize, on(segment).0)
    }
}
