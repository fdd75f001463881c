//! Periodic patches of a file: which patch is a copy of which, and by what motion.
//!
//! Files pair vertices. A patch is the periodic copy of another if the pairs map each of its
//! triangles to a triangle of the other, and both have as many triangles. The motion is the rigid
//! motion that fits the pairs best. Pairs that do not fit are dropped with a note: refinement
//! preserves links and `check` verifies them, so they must be exact.

use super::raw::PeriodicPairs;
use crate::Point;
use crate::files::input::counted;
use crate::ground::kernel::tree;
use crate::ground::mesh::periodic::{Link, same_place};
use crate::ground::mesh::{Mesh, VertexId, sorted_face};
use csg::PatchId;
use nalgebra::{Isometry3, Matrix3, Rotation3, Translation3, UnitQuaternion};
use std::collections::{BTreeMap, BTreeSet, HashMap};

/// Rotations below this angle are rounding errors of the fit of a translation, in radians.
const NO_ROTATION: f64 = 1e-12;

/// Iteration limit of a singular value decomposition of a 3 × 3 matrix, which needs a few.
const MOST_SWEEPS: usize = 100;

/// Finds the links of a mesh.
pub(super) fn links(mesh: &Mesh, given: &[PeriodicPairs], notes: &mut Vec<String>) -> Vec<Link> {
    if given.is_empty() {
        return Vec::new();
    }
    let bounds = tree::bounds(&mesh.points);
    let distance = same_place(&bounds);
    let patch_of: HashMap<[VertexId; 3], PatchId> =
        mesh.triangles.iter().map(|t| (sorted_face(t.vertices), t.patch)).collect();
    let mut sizes: BTreeMap<PatchId, usize> = BTreeMap::new();
    mesh.triangles.iter().for_each(|t| *sizes.entry(t.patch).or_default() += 1);
    // Number in the file and motion of each identification.
    let mut kinds: Vec<(i64, Isometry3<f64>)> = Vec::new();
    let mut links: Vec<Link> = Vec::new();
    let mut left_out = 0;
    for PeriodicPairs { identification, pairs } in given {
        let Some(originals) = originals(pairs) else {
            notes.push("periodic vertices that are not paired one to one left out".into());
            continue;
        };
        let patch_pairs = patch_pairs(mesh, &originals, &patch_of);
        left_out += usize::from(patch_pairs.is_empty());
        for (image, of) in patch_pairs {
            let Some(of) = of.filter(|of| sizes[of] == sizes[&image] && *of != image) else {
                left_out += 1;
                continue;
            };
            let pairs = vertex_pairs(mesh, image, &originals);
            // Use one motion for all patches that it fits, because they may share vertices.
            let fits = |motion: &Isometry3<f64>| largest_gap(&pairs, motion) <= distance;
            let known = kinds.iter().position(|(number, motion)| number == identification && fits(motion));
            let motion = known.map_or_else(|| fitted(&pairs), |kind| kinds[kind].1);
            if !fits(&motion) {
                notes.push(format!(
                    "the periodic boundary around ({}, {}, {}) is not a rigid motion of another (off by {:e}): it is not periodic here",
                    pairs[0][0].x, pairs[0][0].y, pairs[0][0].z, largest_gap(&pairs, &motion)
                ));
                continue;
            }
            let kind = known.unwrap_or_else(|| {
                kinds.push((*identification, motion));
                kinds.len() - 1
            });
            links.push(Link { identification: kind as u32 + 1, of, image, motion });
        }
    }
    if left_out > 0 {
        notes.push(format!(
            "{} whose triangles are not those of another: not periodic here",
            counted(left_out, "periodic surface")
        ));
    }
    links.sort_by_key(|link| (link.identification, link.of, link.image));
    links.dedup();
    links
}

/// Maps copies to masters; `None` if the pairs are not one to one.
fn originals(pairs: &[[u32; 2]]) -> Option<BTreeMap<VertexId, VertexId>> {
    let (mut originals, mut images) = (BTreeMap::new(), BTreeMap::new());
    for [image, of] in pairs.iter().map(|pair| pair.map(VertexId)) {
        let is_other = |before: Option<VertexId>, now| before.is_some_and(|before| before != now);
        if is_other(originals.insert(image, of), of) || is_other(images.insert(of, image), image) {
            return None;
        }
    }
    Some(originals)
}

/// Finds the patches with triangles that are copies of others, with the master patch if all
/// triangles have the same one.
fn patch_pairs(
    mesh: &Mesh,
    originals: &BTreeMap<VertexId, VertexId>,
    patch_of: &HashMap<[VertexId; 3], PatchId>,
) -> BTreeMap<PatchId, Option<PatchId>> {
    let mut found: BTreeMap<PatchId, BTreeSet<Option<PatchId>>> = BTreeMap::new();
    for triangle in &mesh.triangles {
        let [a, b, c] = triangle.vertices.map(|v| originals.get(&v).copied());
        let of = match (a, b, c) {
            (Some(a), Some(b), Some(c)) => patch_of.get(&sorted_face([a, b, c])).copied(),
            _ => None,
        };
        found.entry(triangle.patch).or_default().insert(of);
    }
    // Patches that only touch a copy have no such triangle.
    let is_image = |of: &BTreeSet<Option<PatchId>>| of.iter().any(Option::is_some);
    let one =
        |of: BTreeSet<Option<PatchId>>| if of.len() == 1 { of.into_iter().flatten().next() } else { None };
    found.into_iter().filter(|(_, of)| is_image(of)).map(|(image, of)| (image, one(of))).collect()
}

/// The vertices of a patch, each paired with its master.
fn vertex_pairs(mesh: &Mesh, image: PatchId, originals: &BTreeMap<VertexId, VertexId>) -> Vec<[Point; 2]> {
    let on_image: BTreeSet<VertexId> =
        mesh.triangles.iter().filter(|t| t.patch == image).flat_map(|t| t.vertices).collect();
    on_image.iter().map(|v| [*v, originals[v]].map(|v| mesh.points[v.index()])).collect()
}

/// The largest distance between the first point of a pair and the moved second; infinite without
/// pairs, NaN counts as large.
fn largest_gap(pairs: &[[Point; 2]], motion: &Isometry3<f64>) -> f64 {
    let gap = |[image, of]: &[Point; 2]| (motion * of - image).norm();
    pairs.iter().map(gap).max_by(f64::total_cmp).unwrap_or(f64::INFINITY)
}

/// Fits the rigid motion from the second to the first points of the pairs (Kabsch 1976).
fn fitted(pairs: &[[Point; 2]]) -> Isometry3<f64> {
    let count = pairs.len() as f64;
    let middle =
        |k: usize| pairs.iter().fold(nalgebra::Vector3::zeros(), |sum, pair| sum + pair[k].coords / count);
    let (to, from) = (middle(0), middle(1));
    let mut covariance = Matrix3::zeros();
    for [image, of] in pairs {
        covariance += (image.coords - to) * (of.coords - from).transpose();
    }
    // The decomposition fails if squares of coordinates overflow; then no motion fits.
    let svd = covariance.try_svd(true, true, f64::EPSILON, MOST_SWEEPS);
    let Some((u, v)) = svd.and_then(|svd| svd.u.zip(svd.v_t)) else { return Isometry3::identity() };
    // The vertices of a plane patch leave the normal direction open: choose it such that the motion
    // is no reflection.
    let mut turn = Matrix3::identity();
    turn[(2, 2)] = (u * v).determinant().signum();
    let rotation = UnitQuaternion::from_rotation_matrix(&Rotation3::from_matrix_unchecked(u * turn * v));
    let rotation = if rotation.angle() < NO_ROTATION { UnitQuaternion::identity() } else { rotation };
    Isometry3::from_parts(Translation3::from(to - rotation * from), rotation)
}
