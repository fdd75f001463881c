//! Finds the corners, curves and patches of a geometry.
//!
//! A surface is **relevant** in a cell if membership in some body (or cutout) depends on it there.
//! [`Features::find`] proceeds as follows:
//!
//! 1. `bounds`: finds a box around all bodies by pruning a huge cube.
//! 2. `octree`: splits the box into cells, each with the relevant part of each body. A cell is
//!    split until interval arithmetic proves for any two of its surfaces that they do not meet in
//!    the cell, or meet in a curve that is monotone there.
//! 3. `seed`, `trace`: traces the intersection curves of all such pairs from seeds in the cells.
//! 4. `cross`: finds the points on a curve where a third surface crosses or touches it; `arcs`:
//!    cuts the curve there into arcs.
//! 5. `neighborhood`: finds the regions (bodies or the exterior) around a point of each arc, sector
//!    by sector. An arc belongs to a feature unless it lies inside one smooth sheet or off all
//!    sheets.
//! 6. `assemble`: joins arcs to curves and corners, and sheets to patches; `extent`: computes their
//!    bounding box; `number`: assigns boundary numbers and names.
//! 7. `periodic`: matches periodic copies.
//! 8. `check`: verifies consistency; `contact`: decides whether points of tangency matter; `touch`:
//!    finds the corners inside patches; `cusp`: rejects curves that leave a corner too much alike.
//!
//! NETGEN follows edges from special points. We trace all pairs and classify afterwards: no
//! decision depends on a tolerance during tracing; special positions (three surfaces through one
//! curve, four through one point, a plane through a seam between tangent surfaces) need no special
//! case; and a missed curve leaves an open end, which is detected.
//!
//! Pairs of surfaces swept by the same motion are compared in the moving plane (`swept`). Pairs
//! separated by a plane of the file are not compared.
//!
//! Tangent pairs of surfaces are a special case (`seam`): a line or an ellipse of tangency is
//! computed from the parameters of the surfaces. The apex of a cone is a corner (`apex`). Seeds of
//! curves are found by exclusion (`seed`): parts of cells are split until each is covered by a
//! trace or proved to contain no curve.
//!
//! Boundaries that touch with the exterior between them share a corner or a curve of contact. The
//! following are rejected with their coordinates: tangent boundaries with a body between them,
//! which has no angle there, along a curve or at a point; tangent boundaries between which the
//! exterior opens too slowly; curves of equal curvature that leave a corner in one direction;
//! bodies that overlap or are unbounded. Except for the last, [`find_and_cut_cusps`] takes a small
//! ball or tube out of the bodies, after which they have features.
//!
//! Three or more surfaces in contact of high order at one point are rejected too, but the error may
//! name another reason.

use crate::{Aabb, BodyId, CornerId, CurveId, Geometry, PatchId, Point, SurfaceId};
use neighborhood::Tolerances;
use octree::Octree;

mod apex;
mod arcs;
mod assemble;
mod bounds;
mod check;
mod contact;
mod cross;
mod cusp;
mod cut_cusps;
mod error;
mod extent;
mod neighborhood;
mod number;
mod octree;
mod periodic;
mod ruled;
mod seam;
mod seed;
mod singular;
mod swept;
mod touch;
mod trace;

pub use check::Inconsistency;
pub use cut_cusps::{Cusp, CutCusp, find_and_cut_cusps};
pub use error::{FeatureError, Named, Pair, Place};
pub use periodic::{CurveCopy, Master, Masters, PeriodicMatch};
pub(crate) use seam::find_seams;
pub use singular::Singular;
use trace::curve_curvature;

/// A point where curves end, or an isolated vertex (`point`, the apex of a cone).
#[derive(Clone, Debug)]
pub struct Corner {
    /// The coordinates.
    pub point: Point,
    /// The surfaces through it, ascending.
    pub surfaces: Vec<SurfaceId>,
}

/// A **fin**: the use of a curve by the boundary of one adjacent patch.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fin {
    /// The patch.
    pub patch: PatchId,
    /// Whether the patch lies to the left of the curve, seen along the curve with the patch's
    /// normal up (see [`Patch::flipped`]). Then the curve is traversed forward on the patch's
    /// boundary.
    pub forward: bool,
}

/// A smooth piece of the intersection of two surfaces at which patches meet.
#[derive(Clone, Debug)]
pub struct Curve {
    /// The two surfaces, ascending.
    pub surfaces: [SurfaceId; 2],
    /// The corners at its start and end (possibly the same); `None` for a smooth closed curve.
    pub ends: Option<[CornerId; 2]>,
    /// Points on the curve from start to end, accurate to rounding. The curve turns by less than a
    /// quarter radian between consecutive points. A closed curve repeats its first point at the
    /// end.
    pub trace: Vec<Point>,
    /// The adjacent patches: at most one fin per patch and direction.
    pub fins: Vec<Fin>,
}

/// The pieces of one surface that separate the same two regions and belong to the same cutout, if
/// any.
#[derive(Clone, Debug)]
pub struct Patch {
    /// The surface.
    pub surface: SurfaceId,
    /// Whether the normal is opposite to the surface's gradient. The normal points from `inside` to
    /// `outside`.
    pub flipped: bool,
    /// The body behind the normal; for an outer patch, the body it bounds.
    pub inside: Option<BodyId>,
    /// The body in front of the normal, `None` for the exterior.
    pub outside: Option<BodyId>,
    /// Index in [`Geometry::cutouts`] of the cutout it belongs to.
    pub cutout: Option<u32>,
    /// The curves of its boundary, and whether each is traversed in its own direction with the
    /// patch on the left. Empty for a whole closed surface (sphere, torus, ellipsoid).
    pub boundary: Vec<(CurveId, bool)>,
    /// The corners in its interior, on none of its curves: points where other boundaries touch it.
    pub corners: Vec<CornerId>,
    /// An interior point of each component without boundary curves, to start the advancing front.
    pub seeds: Vec<Point>,
    /// Boundary-condition number, from 1. Unique per patch unless the file assigns one number to
    /// several.
    pub bc: u32,
    /// Boundary name, if the file gives one.
    pub name: Option<String>,
}

/// The geometric entities of a geometry.
#[derive(Clone, Debug)]
pub struct Features {
    /// The corners.
    pub corners: Vec<Corner>,
    /// The curves.
    pub curves: Vec<Curve>,
    /// The patches.
    pub patches: Vec<Patch>,
    /// The bounding box of the bodies.
    pub bounds: Aabb,
    /// Matched periodic entities, one item per identification of the geometry.
    pub identified: Vec<PeriodicMatch>,
}

impl Curve {
    /// The length of the polyline through the trace; its relative error is second order in the
    /// angle between chords. [`Projector::curve_length`](crate::Projector::curve_length) is exact.
    pub fn length(&self) -> f64 {
        self.trace.windows(2).map(|ends| (ends[1] - ends[0]).norm()).sum()
    }
}

impl Features {
    /// Finds the features of a geometry.
    ///
    /// # Errors
    /// [`FeatureError`], with coordinates, if the geometry cannot be meshed.
    pub fn find(geometry: &Geometry) -> Result<Self, FeatureError> {
        let root = bounds::bounding_cell(geometry)?;
        let [min, max] = [root.map(|side| side.lo), root.map(|side| side.hi)].map(Point::from);
        let first = || Named::body(geometry, BodyId(0));
        Aabb { min, max }
            .refuse_out_of_range()
            .map_err(|range| FeatureError::OutOfRange { first: first(), range })?;
        let diagonal = root.iter().map(|side| side.width().powi(2)).sum::<f64>().sqrt();
        let largest = root.iter().map(crate::Interval::magnitude).fold(0.0, f64::max);
        let tolerances = Tolerances::new(diagonal, largest);
        let tree = Octree::new(geometry, root, &tolerances)?;
        find_in(geometry, &tree, &tolerances)
            .map_err(|error| contact::explain(geometry, &tree, error, &tolerances))
    }

    /// The curve with index `id`.
    pub fn curve(&self, id: CurveId) -> &Curve {
        &self.curves[id.index()]
    }
    /// The patch with index `id`.
    pub fn patch(&self, id: PatchId) -> &Patch {
        &self.patches[id.index()]
    }
    /// The corner with index `id`.
    pub fn corner(&self, id: CornerId) -> &Corner {
        &self.corners[id.index()]
    }
}

/// Finds the features with a given octree.
fn find_in(geometry: &Geometry, tree: &Octree, tolerances: &Tolerances) -> Result<Features, FeatureError> {
    let traces = seed::trace_all(geometry, tree, tolerances);
    let (arcs, nodes) = arcs::feature_arcs(geometry, tree, &traces, tolerances)?;
    let touching = contact::check(geometry, tree, tolerances)?;
    let inner = touch::find(geometry, tree, &arcs, &nodes, &touching, tolerances)?;
    let arcs = assemble::join(geometry, arcs, &nodes, &inner, tolerances)?;
    let mut features = assemble::entities(geometry, tree, &arcs, &nodes, &inner, tolerances)?;
    number::number(geometry, &mut features.patches);
    features.identified = periodic::identify(geometry, &features, tolerances)?;
    features.check()?;
    cusp::check(geometry, &features)?;
    Ok(features)
}

#[cfg(test)]
mod random_tests;
#[cfg(test)]
mod tangent_tests;
#[cfg(test)]
mod tests;
