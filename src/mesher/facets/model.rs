//! Construction of bodies, patches, curves and corners from triangles.

use super::features::{self, Found};
use super::join::{self, Joined};
use super::regions::Regions;
use super::{FacetError, SurfacePart, regions};
use crate::Point;
use crate::ground::kernel::tree;
use crate::ground::mesh::{BoundaryTriangle, Touching, VertexId};
use crate::ground::projector::facets::FacetProjector;
use crate::ground::projector::facets::edges::Edges;
use crate::ground::projector::facets::normals;
use csg::{Aabb, BodyId, CornerId, PatchId};

/// A triangulated surface as read from a file: closed, its triangles in any order.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Facets {
    /// The points; equal ones are merged.
    pub points: Vec<Point>,
    /// The triangles, as indices of points.
    pub triangles: Vec<[u32; 3]>,
    /// The group of each triangle (the solid of an STL file); missing ones are 0. Patches end at
    /// changes of group.
    pub groups: Vec<u32>,
    /// Points that mark solid regions and holes, for files with unoriented triangles. If `None`,
    /// orientation decides.
    pub marks: Option<Marks>,
}

/// Marks of regions by a point in each (TetGen's `.poly`). Bounded regions without a mark are
/// bodies.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Marks {
    /// Points in regions that are not bodies.
    pub holes: Vec<Point>,
    /// Points in bodies, with the bodies' numbers.
    pub regions: Vec<(Point, i64)>,
}

/// Thresholds for finding patches, curves and corners.
#[derive(Clone, Debug, PartialEq)]
pub struct Settings {
    /// Facets that turn by more than this (radians) are in different patches. Coarse exports have
    /// at least 12 facets per circle, 30° each; chamfers turn by 45°.
    pub feature_angle: f64,
    /// Edges above this angle (radians) are sharp too, unless there is a similar edge nearby, as on
    /// a round surface. It has no effect if it is at least `feature_angle`.
    pub least_angle: f64,
    /// Curves have a corner if they turn by more than this (radians).
    pub corner_angle: f64,
    /// A vertex without sharp edges is a corner if its angle defect or excess is more than this
    /// (radians). The vertices of an icosahedron have 60°; the tip of a cone of 60° half-angle has
    /// 48°, of 45° half-angle 105°.
    pub tip_angle: f64,
    /// Chains of sharp edges that end inside a patch are ignored up to this length (fraction of the
    /// bounding-box diagonal).
    pub shortest_end: f64,
}

impl Default for Settings {
    fn default() -> Self {
        Self {
            feature_angle: 40_f64.to_radians(),
            least_angle: 14_f64.to_radians(),
            corner_angle: 40_f64.to_radians(),
            tip_angle: 65_f64.to_radians(),
            shortest_end: 0.05,
        }
    }
}

/// A body bounded by facets.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FacetBody {
    /// The index of the surface that it belongs to; the smallest one if it is inside several.
    pub file: u32,
    /// The number assigned by its file.
    pub number: Option<i64>,
}

/// A patch: facets connected over edges that are not sharp.
#[derive(Clone, Debug, PartialEq)]
pub struct FacetPatch {
    /// The body that its normals point away from.
    pub inside: Option<BodyId>,
    /// The body that its normals point into.
    pub outside: Option<BodyId>,
    /// The surfaces that contain it, each with its group there; several if they share facets.
    pub labels: Vec<(u32, u32)>,
    /// The largest distance of its edges from it, or of their ends from them, that the file states
    /// (length); 0 for triangles.
    pub inaccuracy: f64,
}

/// A curve: a chain of edges between corners, or a closed one.
#[derive(Clone, Debug, PartialEq)]
pub struct FacetCurve {
    /// Its first and last corner; `None` if it is closed without a corner.
    pub ends: Option<[CornerId; 2]>,
    /// Its points as indices of the model's points; a closed curve ends with its first point.
    pub vertices: Vec<u32>,
    /// Whether each step is so short that its direction has no influence; empty if none is.
    pub small: Vec<bool>,
}

impl FacetCurve {
    /// Whether the step from point `i` to the next has no influence on sizes and turns.
    pub fn is_small(&self, i: usize) -> bool {
        self.small.get(i).copied().unwrap_or(false)
    }
}

/// Facets and the bodies, patches, curves and corners found in them.
#[derive(Clone, Debug, PartialEq)]
pub struct FacetModel {
    /// The points used by facets, each position once.
    pub points: Vec<Point>,
    /// The facets on their patches, with normals from the patch's `inside` to its `outside`.
    pub triangles: Vec<BoundaryTriangle>,
    /// The points that are corners.
    pub corners: Vec<u32>,
    /// The curves.
    pub curves: Vec<FacetCurve>,
    /// The patches.
    pub patches: Vec<FacetPatch>,
    /// The bodies.
    pub bodies: Vec<FacetBody>,
    /// The bounding box of all points.
    pub bounds: Aabb,
    /// Projection to patches and curves.
    pub projector: FacetProjector,
    /// The facets of faces that were merged into others, if there are any.
    pub merged: Option<Merged>,
    /// Where patches have no influence on sizes.
    pub blunt: Vec<BluntEnd>,
    /// Bodies whose facets may intersect.
    pub touching: Touching,
    /// Estimated rounding error of the coordinates, from their digits (length).
    pub rounding: f64,
}

/// Facets that belong to a patch but have no influence on its shape and size.
#[derive(Clone, Debug, PartialEq)]
pub struct Merged {
    /// Whether each facet is one of them.
    pub is_merged: Vec<bool>,
    /// Projection to patches with these facets too.
    pub projector: FacetProjector,
}

/// The end of a patch around a corner where its curvature and the distance of its curves have no
/// influence on sizes: its radius vanishes there with its width, or its sides are several curves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BluntEnd {
    /// The index of the patch; in models of which no patches were grouped, of the face.
    pub patch: usize,
    /// The corner.
    pub corner: Point,
    /// How far it reaches from the corner.
    pub length: f64,
}

impl BluntEnd {
    /// Whether a facet of the patch is in this end.
    pub fn has(&self, [a, b, c]: &[Point; 3]) -> bool {
        self.reaches(&Point::from((a.coords + b.coords + c.coords) / 3.0))
    }

    /// Whether it reaches as far as a point.
    pub fn reaches(&self, point: &Point) -> bool {
        (point - self.corner).norm() <= self.length
    }
}

impl FacetModel {
    /// Whether a facet has no influence on the shape and size of its patch.
    pub(crate) fn is_merged(&self, facet: u32) -> bool {
        self.merged.as_ref().is_some_and(|merged| merged.is_merged[facet as usize])
    }

    /// Finds bodies, patches, curves and corners of one or several surfaces.
    ///
    /// Each bounded region with a winding number other than zero is a body. In one file, a surface
    /// inside another makes a void if its normals point into the void, else a body inside a body.
    /// Surfaces with inconsistent orientation are reoriented.
    ///
    /// # Errors
    /// With positions, if known:
    /// - [`FacetError::Open`] if edges have only one facet,
    /// - [`FacetError::Overlap`] if facets at a common edge overlap,
    /// - [`FacetError::NotOrientable`] if facets cannot be oriented consistently,
    /// - [`FacetError::NoRay`] if regions cannot be determined because surfaces touch,
    /// - [`FacetError::NoBody`] and [`FacetError::Empty`] if there are no bodies or no facets,
    /// - [`FacetError::NotFinite`], [`FacetError::NoSuchPoint`] and [`FacetError::TooLarge`] for
    ///   invalid numbers.
    ///
    /// Facets that intersect are not an error here; the volume mesher reports them.
    pub fn new(files: &[Facets], settings: &Settings) -> Result<Self, FacetError> {
        let mut joined = join::join(files)?;
        let mut regions = regions::find(&mut joined, files)?;
        if regions.files.is_empty() {
            return Err(FacetError::NoBody);
        }
        drop_unbounding(&mut joined, &mut regions.sides);
        // Normals point out of `inside`: a body rather than none, and of two bodies the lower one.
        for (triangle, sides) in joined.triangles.iter_mut().zip(&mut regions.sides) {
            if sides[0].map_or(u32::MAX, |b| b) > sides[1].map_or(u32::MAX, |b| b) {
                triangle.swap(0, 1);
                sides.swap(0, 1);
            }
        }
        let edges = Edges::new(&joined.triangles);
        let keys = keys(&joined, &regions.sides);
        let bounds = tree::bounds(&joined.points);
        let rounding = normals::rounding(&joined.points);
        let (normals, _) = normals::trusted(&joined.points, &joined.triangles, &edges, rounding);
        let found = features::find(
            &features::Input {
                points: &joined.points,
                triangles: &joined.triangles,
                edges: &edges,
                normals: &normals,
                keys: &keys,
                rounding,
                diagonal: bounds.diagonal(),
            },
            settings,
        );
        Ok(assemble(joined, &regions, found))
    }

    /// The patch with this id.
    pub fn patch(&self, patch: PatchId) -> &FacetPatch {
        &self.patches[patch.index()]
    }

    /// The bodies behind and in front of a patch.
    pub fn bodies_beside(&self, patch: PatchId) -> [Option<BodyId>; 2] {
        let patch = self.patch(patch);
        [patch.inside, patch.outside]
    }

    /// The patches adjacent to each curve, ascending; a patch on both of its sides is listed twice.
    pub fn patches_of_curves(&self) -> Vec<Vec<PatchId>> {
        // One step suffices: a curve ends where its adjacent patches change.
        let first_step = |(c, curve): (usize, &FacetCurve)| {
            let [a, b] = [curve.vertices[0], curve.vertices[1]];
            ([a.min(b), a.max(b)], c)
        };
        let mut steps: Vec<([u32; 2], usize)> = self.curves.iter().enumerate().map(first_step).collect();
        steps.sort_unstable();
        let mut patches = vec![Vec::new(); self.curves.len()];
        for triangle in &self.triangles {
            let [a, b, c] = triangle.vertices.map(|v| v.0);
            for [a, b] in [[a, b], [b, c], [c, a]] {
                if let Ok(i) = steps.binary_search_by_key(&[a.min(b), a.max(b)], |s| s.0) {
                    patches[steps[i].1].push(triangle.patch);
                }
            }
        }
        patches.iter_mut().for_each(|patches| patches.sort_unstable());
        patches
    }
}

/// Removes triangles without a body on either side.
fn drop_unbounding(joined: &mut Joined, sides: &mut Vec<[Option<u32>; 2]>) {
    let keep: Vec<bool> = sides.iter().map(|s| *s != [None; 2]).collect();
    let mut of = keep.iter();
    joined.triangles.retain(|_| *of.next().unwrap_or(&true));
    of = keep.iter();
    joined.layers.retain(|_| *of.next().unwrap_or(&true));
    of = keep.iter();
    sides.retain(|_| *of.next().unwrap_or(&true));
}

/// Assigns a number to each combination of regions and groups; patches do not mix them.
fn keys(joined: &Joined, sides: &[[Option<u32>; 2]]) -> Vec<u32> {
    let key = |t: usize| {
        let labels: Vec<(u32, u32)> = joined.layers[t].iter().map(|l| (l.file, l.group)).collect();
        (sides[t], labels)
    };
    let all: Vec<_> = (0..sides.len()).map(key).collect();
    let mut different = all.clone();
    different.sort_unstable();
    different.dedup();
    all.iter().map(|k| different.binary_search(k).unwrap_or(0) as u32).collect()
}

fn assemble(joined: Joined, regions: &Regions, found: Found) -> FacetModel {
    let mut patches: Vec<Option<FacetPatch>> = vec![None; found.patches];
    for (t, &patch) in found.patch_of.iter().enumerate() {
        patches[patch as usize].get_or_insert_with(|| {
            let [inside, outside] = regions.sides[t].map(|b| b.map(BodyId));
            let mut labels: Vec<(u32, u32)> = joined.layers[t].iter().map(|l| (l.file, l.group)).collect();
            labels.dedup();
            FacetPatch { inside, outside, labels, inaccuracy: 0.0 }
        });
    }
    let corner = |v: u32| found.corners.binary_search(&v).ok().map(CornerId::new);
    let curves: Vec<FacetCurve> = found
        .chains
        .into_iter()
        .map(|chain| {
            let [first, last] = [chain.vertices[0], chain.vertices[chain.vertices.len() - 1]];
            let ends = corner(first).zip(corner(last)).map(|(a, b)| [a, b]);
            FacetCurve { ends, vertices: chain.vertices, small: Vec::new() }
        })
        .collect();
    let triangle =
        |(v, &p): (&[u32; 3], &u32)| BoundaryTriangle { vertices: v.map(VertexId), patch: PatchId(p) };
    let surface = SurfacePart {
        triangles: joined.triangles.iter().zip(&found.patch_of).map(triangle).collect(),
        points: joined.points,
        corners: found.corners,
        curves,
        patches: patches.into_iter().flatten().collect(),
    };
    FacetModel { bodies: bodies_of(regions), ..surface.into() }
}

fn bodies_of(regions: &Regions) -> Vec<FacetBody> {
    let Regions { files, numbers, .. } = regions;
    files.iter().zip(numbers).map(|(&file, &number)| FacetBody { file, number }).collect()
}
