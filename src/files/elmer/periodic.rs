//! `mesh.periodic`: pairs of nodes on periodic faces. It is not an Elmer file: Elmer pairs the
//! nodes by projection (`Periodic BC`). Other programs can read the pairs from here.
//!
//! ```text
//! # node, its master, identification
//! # motion 1 1 0 0 1 0 1 0 0 0 0 1 0        identification, three rows of the matrix
//! 87 3 1
//! ```

use super::faults::{FaultKind, Faults};
use super::read::ElmerMesh;
use crate::Point;
use crate::files::WriteError;
use crate::files::input::ReadError;
use crate::files::number::Numbering;
use crate::files::pairs::pairs;
use crate::ground::comm::Communicator;
use crate::ground::mesh::stream::MeshStream;
use nalgebra::Matrix3x4;
use std::collections::{BTreeMap, BTreeSet};
use std::path::Path;

/// Name of the file. It is written to the folder of the parts, whose node numbers it uses.
pub(super) const NAME: &str = "mesh.periodic";
/// Prefix of a line with a motion.
const MOTION: &str = "# motion ";

/// **Collective.** Returns the text of the file on rank 0 if faces are periodic.
pub(super) fn periodic_text(
    comm: &dyn Communicator,
    part: &dyn MeshStream,
    numbering: &Numbering,
) -> Result<Option<String>, WriteError> {
    if part.links().is_empty() {
        return Ok(None);
    }
    let pairs = pairs(comm, part, numbering, |_, link| link.identification.into())?;
    if part.rank() != 0 {
        return Ok(None);
    }
    let mut text = String::from("# node, its master, identification\n");
    let mut last = 0;
    for link in part.links() {
        // Patches of one identification are adjacent and have the same motion.
        if std::mem::replace(&mut last, link.identification) != link.identification {
            text += &format!("{MOTION}{}", link.identification);
            let matrix = link.motion.to_homogeneous();
            (0..3).for_each(|row| matrix.row(row).iter().for_each(|x| text += &format!(" {x}")));
            text += "\n";
        }
    }
    for [image, of, identification] in pairs {
        text += &format!("{image} {of} {identification}\n");
    }
    Ok(Some(text))
}

/// Pairs of nodes by identification, the periodic copy first, then its master.
pub(crate) type PairsOfNodes = BTreeMap<u32, Vec<[u32; 2]>>;

/// Reads the pairs of the mesh in `folder`, if it has any; for a serial mesh also from
/// `partitioning.1`.
///
/// # Errors
/// If the file cannot be read, or a line is malformed.
pub(crate) fn pairs_of(folder: &Path) -> Result<PairsOfNodes, ReadError> {
    let mut pairs = PairsOfNodes::new();
    let places = [folder.join(NAME), folder.join("partitioning.1").join(NAME)];
    let Some(path) = places.into_iter().find(|path| path.exists()) else { return Ok(pairs) };
    let text = std::fs::read_to_string(&path).map_err(ReadError::io(&path))?;
    for (index, line) in text.lines().enumerate().filter(|(_, line)| !line.starts_with('#')) {
        let [image, of, number] = numbers(&path, index, line)?[..] else { return Err(broken(&path, index)) };
        pairs.entry(number).or_default().push([image, of]);
    }
    Ok(pairs)
}

/// Checks that both nodes of each pair exist and that the motion maps the master to its copy.
///
/// # Errors
/// If the file cannot be read, or a line is malformed.
pub(super) fn check_pairs(mesh: &ElmerMesh, faults: &mut Faults) -> Result<(), ReadError> {
    /// Tolerance of a copy's position, as a fraction of the bounding-box diagonal.
    const SAME_PLACE: f64 = 4e-12;
    /// Far from the origin: tolerance as a fraction of the largest coordinate, 16 ulps.
    const ROUNDING: f64 = 16.0 * f64::EPSILON;
    let path = mesh.layout.folder().join(NAME);
    if !path.exists() {
        return Ok(());
    }
    let text = std::fs::read_to_string(&path).map_err(ReadError::io(&path))?;
    let points: BTreeMap<u32, Point> =
        mesh.parts.iter().flat_map(|part| part.nodes.iter().map(|node| (node.id, node.point))).collect();
    let low = points.values().fold(Point::from([f64::INFINITY; 3]), |low, p| low.inf(p));
    let high = points.values().fold(Point::from([f64::NEG_INFINITY; 3]), |high, p| high.sup(p));
    let largest = low.coords.amax().max(high.coords.amax());
    let tolerance = f64::max(SAME_PLACE * (high - low).norm(), ROUNDING * largest);
    let mut motions: BTreeMap<u32, Matrix3x4<f64>> = BTreeMap::new();
    let mut pairs = PairsOfNodes::new();
    for (index, line) in text.lines().enumerate() {
        if let Some(rest) = line.strip_prefix(MOTION) {
            let (number, matrix) = rest.split_once(' ').unwrap_or((rest, ""));
            let entries: Vec<f64> = numbers(&path, index, matrix)?;
            let [number] = numbers(&path, index, number)?[..] else { return Err(broken(&path, index)) };
            if entries.len() != 12 {
                return Err(broken(&path, index));
            }
            motions.insert(number, Matrix3x4::from_row_slice(&entries));
        } else if !line.starts_with('#') {
            let [image, of, number] = numbers(&path, index, line)?[..] else {
                return Err(broken(&path, index));
            };
            let motion = motions.get(&number).ok_or_else(|| broken(&path, index))?;
            pairs.entry(number).or_default().push([image, of]);
            let (Some(there), Some(here)) = (points.get(&image), points.get(&of)) else {
                let what = || format!("one of the paired nodes {image} and {of} is not in the mesh");
                faults.add(FaultKind::NoSuchNode, path.clone(), index + 1, what);
                continue;
            };
            let off = (motion * here.to_homogeneous() - there.coords).norm();
            if off.is_nan() || off > tolerance {
                let what = || format!("node {image} is {off:e} off the moved position of its partner {of}");
                faults.add(FaultKind::NotPeriodic, path.clone(), index + 1, what);
            }
        }
    }
    if mesh.parts.len() > 1 {
        pairs.values().for_each(|pairs| check_together(mesh, pairs, faults));
    }
    Ok(())
}

/// Checks that each part with a node of a periodic face also has a face there and its periodic
/// copy.
///
/// Elmer eliminates the nodes of a periodic boundary part by part, using the part's own boundary
/// elements.
fn check_together(mesh: &ElmerMesh, pairs: &[[u32; 2]], faults: &mut Faults) {
    let image_of: BTreeMap<u32, u32> = pairs.iter().map(|&[image, of]| (of, image)).collect();
    let paired: BTreeSet<u32> = pairs.iter().flatten().copied().collect();
    for part in &mesh.parts {
        let sorted = |mut face: [u32; 3]| {
            face.sort_unstable();
            face
        };
        let faces: BTreeSet<[u32; 3]> = part.boundary.iter().map(|element| sorted(element.nodes)).collect();
        let mut bounded: BTreeSet<u32> = BTreeSet::new();
        for face in &faces {
            let [Some(&a), Some(&b), Some(&c)] = face.map(|node| image_of.get(&node)) else { continue };
            if faces.contains(&sorted([a, b, c])) {
                bounded.extend(face.iter().chain(&[a, b, c]));
            }
        }
        let mut seen: BTreeSet<u32> = BTreeSet::new();
        for (k, element) in part.elements.iter().enumerate() {
            for node in element.nodes.into_iter().filter(|node| paired.contains(node)) {
                if !bounded.contains(&node) && seen.insert(node) {
                    let what = || format!("node {node} of element {}", element.id);
                    faults.add(FaultKind::PeriodicSplit, part.file("elements"), part.elements.line(k), what);
                }
            }
        }
    }
}

/// Parses the numbers of a line.
fn numbers<T: std::str::FromStr>(path: &Path, index: usize, line: &str) -> Result<Vec<T>, ReadError> {
    line.split_whitespace().map(|word| word.parse().map_err(|_| broken(path, index))).collect()
}

fn broken(path: &Path, index: usize) -> ReadError {
    let message = "neither two nodes and an identification nor the motion of one";
    ReadError::line(path, index as u64 + 1, message)
}
