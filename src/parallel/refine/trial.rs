//! Refinement test of a coarse mesh: refines its curved tets, a chunk at a time, and reports bad
//! children.

use super::snap;
use super::subset::extract;
use super::tet::inverted;
use super::{EdgeDisplacements, RefineError, RefinedMesh, Settings, refine_unchecked};
use crate::ground::kernel::jacobian;
use crate::ground::mesh::stream::{MeshStream, TetBlock};
use crate::ground::mesh::{GlobalId, TetId};
use crate::ground::projector::Projector;
use crate::parallel::check::shape::{BATCH, Batch, Extremes, Shapes};
use crate::parallel::distribution::DistMesh;
use rayon::prelude::*;

/// The number of tets refined at a time; bounds the memory of a refinement test.
pub(super) const CHUNK: usize = 8192;

/// Lower bounds for the quality of children.
#[derive(Clone, Copy, Debug)]
pub struct Least {
    /// The smallest acceptable mean ratio.
    pub mean_ratio: f64,
    /// The smallest acceptable dihedral angle, degrees.
    pub dihedral: f64,
    /// The smallest acceptable scaled Jacobian of children of second order.
    pub scaled_jacobian: f64,
}

/// The dihedral angle of the regular tet, degrees.
const REGULAR: f64 = 70.528_779_365_509_31;

impl Least {
    /// Every valid child is acceptable.
    pub const VALID: Self = Self { mean_ratio: 0.0, dihedral: 0.0, scaled_jacobian: 0.0 };

    /// By how much the worst children exceed the bounds: the smallest of the surplus in mean ratio,
    /// in dihedral angle (divided by the angle of the regular tet), and in scaled Jacobian.
    pub(super) fn excess(&self, worst: &Extremes) -> f64 {
        let dihedral = worst.smallest.clamp(-1.0, 1.0).acos().to_degrees();
        let straight = f64::min(worst.mean_ratio - self.mean_ratio, (dihedral - self.dihedral) / REGULAR);
        straight.min(worst.scaled_jacobian - self.scaled_jacobian)
    }
}

/// The result of [`trial`].
#[derive(Clone, Debug, Default)]
pub struct Trial {
    /// Coarse tets whose children are positive, but one below the bounds; ascending.
    pub poor: Vec<GlobalId>,
    /// Others with a child below the angle that is wanted; the smallest angle first.
    pub improvable: Vec<GlobalId>,
    /// The smallest mean ratio of the children of all tets refined; 0 if there are none.
    pub mean_ratio: f64,
    /// The smallest dihedral angle of the children of poor tets, degrees; 0 if there are none.
    pub smallest_dihedral: f64,
    /// Coarse tets with children that are not positive, ascending.
    pub inverted: Vec<GlobalId>,
    /// The error that describes the first of the inverted tets.
    pub error: Option<RefineError>,
}

/// *Local, on the whole mesh.* Refines the coarse tets curved by projection or displacements with
/// `pieces` subdivisions per edge, and finds those with a child below `least`, and those with a
/// dihedral angle below `wanted` (degrees).
///
/// # Errors
/// [`RefineError::Projection`] and [`RefineError::OutOfMemory`], as [`refine()`](super::refine()).
pub fn trial(
    mesh: &DistMesh,
    projector: &Projector,
    pieces: u32,
    settings: &Settings,
    least: Least,
    wanted: f64,
) -> Result<Trial, RefineError> {
    let wanted = Least { dihedral: wanted, ..Least::VALID };
    let mut found = Trial::default();
    let (mut worst_of_all, mut worst_of_poor) = (None, Extremes::NONE);
    let mut improvable: Vec<(f64, GlobalId)> = Vec::new();
    for chunk in curved(mesh, projector, &settings.displacements).chunks(CHUNK) {
        let (refined, bad) = refine_unchecked(extract(mesh, chunk), projector, pieces, settings)?;
        let id = |at: usize| mesh.tet_ids[chunk[at] as usize];
        found.inverted.extend(bad.iter().map(|bad| bad.tet));
        let worst: Vec<Extremes> =
            (0..chunk.len()).into_par_iter().map(|at| worst_children(&refined, at)).collect();
        let valid = (0..chunk.len()).filter(|&at| found.inverted.binary_search(&id(at)).is_err());
        let is_below = |least: Least, at: usize| least.excess(&worst[at]) < 0.0;
        let (poor, others): (Vec<usize>, Vec<usize>) = valid.partition(|&at| is_below(least, at));
        let others = others.into_iter().filter(|&at| is_below(wanted, at));
        improvable.extend(others.map(|at| (worst[at].smallest, id(at))));
        worst_of_all = worst.iter().copied().chain(worst_of_all).reduce(Extremes::with);
        worst_of_poor = poor.iter().fold(worst_of_poor, |all, &at| all.with(worst[at]));
        found.poor.extend(poor.into_iter().map(id));
        if found.error.is_none() && !bad.is_empty() {
            found.error = Some(inverted(&bad, settings.described));
        }
    }
    improvable.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
    found.improvable = improvable.into_iter().map(|(_, id)| id).collect();
    found.mean_ratio = worst_of_all.map_or(0.0, |worst| worst.mean_ratio);
    if !found.poor.is_empty() {
        found.smallest_dihedral = worst_of_poor.smallest.acos().to_degrees();
    }
    Ok(found)
}

/// The tets whose lattices are not affine, ascending.
pub(super) fn curved(mesh: &DistMesh, projector: &Projector, displacements: &EdgeDisplacements) -> Vec<u32> {
    let is_curved = |tet: &u32| !snap::is_flat(mesh, projector, displacements, TetId(*tet));
    (0..mesh.tets.len() as u32).filter(is_curved).collect()
}

/// The worst shapes of the children of a coarse tet.
pub(super) fn worst_children(refined: &RefinedMesh, tet: usize) -> Extremes {
    let (mut block, mut batch, mut shapes) = (TetBlock::default(), Batch::default(), Shapes::default());
    refined.tet_block(tet, &mut block);
    let points = refined.points();
    let mut worst = Extremes::NONE;
    for tets in block.tets.chunks(BATCH) {
        batch.clear();
        tets.iter().for_each(|tet| batch.push(0, tet.map(|v| points[v as usize])));
        batch.volumes(&mut shapes);
        worst = worst.with(batch.shapes(&mut shapes).extremes);
    }
    for (corners, edges) in block.tets.iter().zip(&block.edge_nodes) {
        let nodes = jacobian::nodes(*corners, *edges, |v| points[v as usize]);
        if !jacobian::is_straight(&nodes) {
            worst.scaled_jacobian = worst.scaled_jacobian.min(jacobian::range(&nodes).scaled());
        }
    }
    worst
}
