//! Corners, curves and patches of the bodies of a geometry.
//!
//! [`Features::find`] goes this way:
//!
//! 1. `bounds`: a box around all bodies, by pruning a huge cube.
//! 2. `octree`: cells, in each the part of each body that matters there; split until any two surfaces in a
//!    cell either cannot meet in it or meet in a curve that is monotone there, which interval arithmetic proves.
//! 3. `seed`, `trace`: from seeds in the cells, the intersection curves of all such pairs of surfaces.
//! 4. `cross`: on them, the points where a third surface crosses or touches; `arcs`: cut there, into arcs.
//! 5. `around`: at a point of each arc, the regions (bodies or the exterior) around it, sector by sector.
//!    An arc is part of a feature if it is more than a line on one smooth sheet.
//! 6. `assemble`: arcs to curves and corners, sheets to patches; `extent`: their box; `number`: boundary
//!    numbers and names.
//! 7. `periodic`: which of them are images of others.
//! 8. `check`: whether it all fits together; `contact`: whether places where surfaces are tangent matter; `touch`:
//!    whether a corner or an edge touches the inside of a patch; `cusp`: whether one ends in too sharp a cusp.
//!
//! Why trace all pairs and classify afterwards, and not follow edges from special points like NETGEN: no
//! decision depends on a tolerance while a curve is followed; surfaces in special position (three through
//! one curve, four through one point, a plane through a seam between tangent surfaces) need no case of their own; and
//! what was missed shows as an open end.
//!
//! Surfaces that one motion sweeps are compared in the moving plane (`swept`), and what planes of the file keep apart is not compared at all.
//!
//! Tangent surfaces are a case of their own (`seam`): a line or a circle along which two are tangent is found from
//! their parameters. The apex of a cone is a corner (`apex`). Curves get their seeds by exclusion (`seed`): parts of cells are split
//! until a trace covers them or no curve can be there.
//!
//! What is refused, with its place: surfaces that are tangent where both are boundaries with a wedge of no angle between
//! them, along a line (two rods side by side) or in a point (a ball on a plate, a torus cut where a plane touches it); a corner or
//! an edge that touches a face; a face that ends in a cusp whose curves bend alike; bodies that overlap or are not bounded.
//!
//! Three or more surfaces that touch in one point to a high order are refused, but not always with that reason.

use crate::{Aabb, BodyId, CornerId, CurveId, Geometry, PatchId, Point, SurfaceId};
use around::Tolerances;
use octree::Octree;

mod apex;
mod arcs;
mod around;
mod assemble;
mod bounds;
mod check;
mod contact;
mod cross;
mod cusp;
mod error;
mod extent;
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
pub use error::{FeatureError, Named, Place};
pub use periodic::{CurveImage, Identified, Origin, Origins};
pub use seam::find_seams;
pub use singular::Singular;
pub use trace::{curve_curvature, curve_tangent};

/// A point where curves end, or a vertex of its own (`point`, the apex of a cone).
#[derive(Clone, Debug)]
pub struct Corner {
    /// Where it is.
    pub point: Point,
    /// The surfaces through it, ascending.
    pub surfaces: Vec<SurfaceId>,
}

/// A patch beside a curve: which one, and on which side.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Fin {
    /// The patch.
    pub patch: PatchId,
    /// Whether the patch lies to the left for one who walks along the curve in its direction with
    /// the patch's normal up (see [`Patch::flipped`] for the normal). Its boundary then has the curve forward.
    pub forward: bool,
}

/// A smooth piece of the intersection of two surfaces where patches meet.
#[derive(Clone, Debug)]
pub struct Curve {
    /// The two surfaces, ascending.
    pub surfaces: [SurfaceId; 2],
    /// The corners at its start and end (they may be the same), `None` where it is closed and smooth.
    pub ends: Option<[CornerId; 2]>,
    /// Points on the curve from its start to its end, exact within rounding, so dense that the curve
    /// turns by less than a quarter radian between two of them. A closed one repeats its first point at its end.
    pub trace: Vec<Point>,
    /// The patches that have it on their boundary: at most one each of (patch, direction).
    pub fins: Vec<Fin>,
}

/// The pieces of one surface that separate the same two regions and belong to the same cutout, if to any.
#[derive(Clone, Debug)]
pub struct Patch {
    /// The surface.
    pub surface: SurfaceId,
    /// False: its normal is the gradient of the surface; true: the opposite.
    /// The normal points from `inside` to `outside`.
    pub flipped: bool,
    /// The body behind its normal (never `None` on both sides; for an outer patch `inside` is the body).
    pub inside: Option<BodyId>,
    /// The body in front of it, `None` for the exterior.
    pub outside: Option<BodyId>,
    /// Which of [`Geometry::cutouts`] it is, by index, if it is one.
    pub cutout: Option<u32>,
    /// Its boundary: curves, and whether each is run in its own direction with the patch on the left.
    /// Empty for a whole closed surface (sphere, torus, ellipsoid).
    pub boundary: Vec<(CurveId, bool)>,
    /// A point in the relative interior of each of its pieces that has no boundary curve, to begin a front from.
    pub seeds: Vec<Point>,
    /// Boundary-condition number, from 1; unique per patch unless the file gives one to several.
    pub bc: u32,
    /// Boundary name; none if the file gives none.
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
    /// The box of the bodies, computed.
    pub bounds: Aabb,
    /// Periodic faces, by identification of the geometry.
    pub identified: Vec<Identified>,
}

impl Curve {
    /// Its length, to second order in the angle between the points of its trace.
    pub fn length(&self) -> f64 {
        self.trace.windows(2).map(|ends| (ends[1] - ends[0]).norm()).sum()
    }
}

impl Features {
    /// Finds the features of a geometry.
    ///
    /// # Errors
    /// What cannot be meshed is refused with its place, see [`FeatureError`].
    pub fn find(geometry: &Geometry) -> Result<Self, FeatureError> {
        let root = bounds::bounding_cell(geometry)?;
        let diagonal = root.iter().map(|side| side.width().powi(2)).sum::<f64>().sqrt();
        let largest = root.iter().map(crate::Interval::magnitude).fold(0.0, f64::max);
        let tolerances = Tolerances::new(diagonal, largest);
        let tree = Octree::new(geometry, root, &tolerances)?;
        find_in(geometry, &tree, &tolerances)
            .map_err(|error| contact::explain(geometry, &tree, error, &tolerances))
    }

    /// The curve with this id.
    pub fn curve(&self, id: CurveId) -> &Curve {
        &self.curves[id.index()]
    }
    /// The patch with this id.
    pub fn patch(&self, id: PatchId) -> &Patch {
        &self.patches[id.index()]
    }
    /// The corner with this id.
    pub fn corner(&self, id: CornerId) -> &Corner {
        &self.corners[id.index()]
    }
}

/// The features in the cells of a tree.
fn find_in(geometry: &Geometry, tree: &Octree, tolerances: &Tolerances) -> Result<Features, FeatureError> {
    let traces = seed::trace_all(geometry, tree, tolerances);
    let (arcs, nodes) = arcs::feature_arcs(geometry, tree, &traces, tolerances)?;
    contact::check(geometry, tree, tolerances)?;
    touch::check(geometry, tree, &arcs, &nodes, tolerances)?;
    let arcs = assemble::join(geometry, arcs, &nodes, tolerances)?;
    let mut features = assemble::entities(geometry, tree, &arcs, &nodes, tolerances)?;
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
