//! Checks Elmer files: finds every fault of a mesh, with file and line.
//!
//! The checks cover what Elmer and its users rely on: consistent tables of ids, shared nodes listed
//! by all their parts, positive tets that fill the body without gap or overlap, and a boundary that
//! covers each outer face once, with the right parent. Halo elements must equal those of their
//! owners; which halo elements should exist is not checked, because there are many kinds of halos.
//! That the outer surface is closed needs no check: it is the boundary of a set of tets.

use super::read::{ElmerMesh, ElmerPart, Layout, layouts, read_layout};
use super::{faults_curved, faults_faces, faults_halo, faults_nodes, periodic};
use crate::files::input::ReadError;
use std::collections::BTreeMap;
use std::fmt;
use std::path::{Path, PathBuf};

/// Kinds of faults.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum FaultKind {
    /// `partitioning.N` does not hold N parts.
    PartCount,
    /// A count in a header differs from the file.
    Count,
    /// A part has no elements.
    EmptyPart,
    /// A body or boundary number is 0.
    ZeroNumber,
    /// A node is listed twice in a part.
    NodeTwice,
    /// A coordinate is not a finite number.
    NotFinite,
    /// Copies of a node differ in their coordinates.
    CopiesDiffer,
    /// A node belongs to no element of its part.
    UnusedNode,
    /// An element or boundary element uses a node that its part lacks.
    NoSuchNode,
    /// A node of several parts is missing in the `.shared` of one of them.
    NotShared,
    /// The parts listed in `.shared` are not those that have the node.
    WrongHolders,
    /// Parts list different owners of a node.
    OwnersDiffer,
    /// A node in `.shared` is in no other part.
    NeedlesslyShared,
    /// The first part listed for a node has it in halo elements only.
    OwnerWatches,
    /// Two elements have the same id.
    ElementTwice,
    /// A halo element differs from the element of its owner, or the owner has none with this id.
    WrongHalo,
    /// Two elements have the same nodes.
    SameElement,
    /// An element is not positively oriented.
    Inverted,
    /// The Jacobian determinant of a ten-node element is not proved positive.
    NotValid,
    /// Elements or boundary elements have different nodes on the same edge.
    EdgeNodesDiffer,
    /// More than two elements have a face in common.
    CrowdedFace,
    /// Two elements lie on the same side of their common face.
    Overlap,
    /// A face without boundary element: an outer face, or one between parts with halos in both.
    NoBoundary,
    /// A boundary element is no face of an element of its part.
    NoFace,
    /// A boundary element is in its part twice.
    BoundaryTwice,
    /// An interface boundary element is in both parts, without halos: loads on it count twice.
    BoundaryInTwoParts,
    /// An interface boundary element is in the part of the lower body only, without halos: its
    /// normal is opposite to those of the same boundary inside a part.
    NormalTurned,
    /// Two parts give an interface face different boundary numbers.
    NumbersDiffer,
    /// A parent is missing, or is not beside the boundary element.
    WrongParent,
    /// A parent is missing, or is not beside the boundary element.
    Inward,
    /// A node of a periodic face is not where the motion puts it.
    NotPeriodic,
    /// A part has a node of a periodic face but not a face there with its copy: Elmer's `Periodic
    /// BC` fails there.
    PeriodicSplit,
}

impl fmt::Display for FaultKind {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        f.write_str(match self {
            Self::PartCount => "folder named for another number of parts",
            Self::Count => "wrong count in a header",
            Self::EmptyPart => "part without elements",
            Self::ZeroNumber => "body or boundary number 0",
            Self::NodeTwice => "node twice in a part",
            Self::NotFinite => "coordinate that is not a number",
            Self::CopiesDiffer => "node with different coordinates in different parts",
            Self::UnusedNode => "node of no element",
            Self::NoSuchNode => "node that the part lacks",
            Self::NotShared => "shared node missing in .shared",
            Self::WrongHolders => "wrong holders in .shared",
            Self::OwnersDiffer => "node with different owners in different parts",
            Self::NeedlesslyShared => "node in .shared that is in one part only",
            Self::OwnerWatches => "owner that has the node in halo elements only",
            Self::ElementTwice => "element id twice",
            Self::WrongHalo => "halo element that its owner does not have so",
            Self::SameElement => "two elements with the same nodes",
            Self::Inverted => "element inverted or flat",
            Self::NotValid => "element of second order that is not valid",
            Self::EdgeNodesDiffer => "edge with different nodes in different elements",
            Self::CrowdedFace => "face of more than two elements",
            Self::Overlap => "two elements on the same side of a face",
            Self::NoBoundary => "face without its boundary element",
            Self::NoFace => "boundary element that is not a face",
            Self::BoundaryTwice => "boundary element twice",
            Self::BoundaryInTwoParts => "boundary element in two parts, so that loads count twice",
            Self::NormalTurned => {
                "boundary element only in the part of the lower body, so that its normal is turned"
            }
            Self::NumbersDiffer => "different boundary numbers on the two sides",
            Self::WrongParent => "wrong or missing parent",
            Self::Inward => "boundary element with inward normal",
            Self::NotPeriodic => "periodic nodes that do not match",
            Self::PeriodicSplit => {
                "node of a periodic face in a part that has no face with its partner there"
            }
        })
    }
}

/// One fault.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Fault {
    /// Its kind.
    pub kind: FaultKind,
    /// The file that has it, or the folder.
    pub file: PathBuf,
    /// The line, from 1; 0 if the fault has none.
    pub line: u64,
    /// The entities, by id.
    pub what: String,
}

impl fmt::Display for Fault {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        write!(f, "{}", self.file.display())?;
        if self.line > 0 {
            write!(f, ":{}", self.line)?;
        }
        write!(f, ": {}", self.what)
    }
}

/// The faults of a mesh: the number of each kind, and the first few.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Faults {
    /// Number of each kind.
    pub counts: BTreeMap<FaultKind, u64>,
    /// At most [`Self::SHOWN`] of each kind, in the order of the files.
    pub first: Vec<Fault>,
}

impl Faults {
    /// Number of faults of a kind that are kept.
    pub const SHOWN: u64 = 10;

    /// Whether there are no faults.
    pub fn is_empty(&self) -> bool {
        self.counts.is_empty()
    }

    /// Number of faults of a kind.
    pub fn count(&self, kind: FaultKind) -> u64 {
        self.counts.get(&kind).copied().unwrap_or(0)
    }

    /// Adds a fault; `what` is called only if the fault is kept.
    pub(super) fn add(&mut self, kind: FaultKind, file: PathBuf, line: usize, what: impl FnOnce() -> String) {
        let count = self.counts.entry(kind).or_default();
        *count += 1;
        if *count <= Self::SHOWN {
            self.first.push(Fault { kind, file, line: line as u64, what: what() });
        }
    }
}

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter) -> fmt::Result {
        for (kind, count) in &self.counts {
            writeln!(f, "{kind}: {count}")?;
            for fault in self.first.iter().filter(|fault| fault.kind == *kind) {
                writeln!(f, "  {fault}")?;
            }
            if *count > Self::SHOWN {
                writeln!(f, "  … and {} more", count - Self::SHOWN)?;
            }
        }
        Ok(())
    }
}

/// Reads and checks each mesh in a folder (see [`layouts`]).
pub fn check_elmer(dir: &Path) -> Result<Vec<(Layout, Faults)>, ReadError> {
    let judge = |layout: Layout| {
        let mesh = read_layout(&layout)?;
        let mut found = faults(&mesh);
        periodic::check_pairs(&mesh, &mut found)?;
        Ok((layout, found))
    };
    layouts(dir)?.into_iter().map(judge).collect()
}

/// Finds all faults of a mesh.
pub fn faults(mesh: &ElmerMesh) -> Faults {
    let mut faults = Faults::default();
    check_counts(mesh, &mut faults);
    let tables = faults_nodes::check_nodes(mesh, &mut faults);
    faults_nodes::check_shared(mesh, &tables, &mut faults);
    faults_halo::check_halo(mesh, &mut faults);
    faults_faces::check_elements_and_boundary(mesh, &tables, &mut faults);
    faults_curved::check_curved(mesh, &tables, &mut faults);
    faults
}

fn check_counts(mesh: &ElmerMesh, faults: &mut Faults) {
    if let Layout::Partitioned { folder, parts } = &mesh.layout {
        let name = folder.file_name().map(|n| n.to_string_lossy().into_owned()).unwrap_or_default();
        if name.strip_prefix("partitioning.").is_some_and(|n| n != parts.to_string()) {
            faults.add(FaultKind::PartCount, folder.clone(), 0, || format!("contains {parts} parts"));
        }
    }
    mesh.parts.iter().for_each(|part| check_header(part, faults));
}

/// Compares the counts in the header with the files of a part.
pub(super) fn check_header(part: &ElmerPart, faults: &mut Faults) {
    let header = &part.header;
    let elements = part.elements.len() + part.halo.len();
    let mut types: BTreeMap<u32, usize> =
        part.left_out.iter().map(|(&code, &count)| (code, count as usize)).collect();
    part.boundary.iter().for_each(|element| *types.entry(element.code()).or_default() += 1);
    let boundary = types.values().sum();
    let all = part.elements.iter().chain(part.halo.iter().map(|(element, _)| element));
    all.for_each(|element| *types.entry(element.code()).or_default() += 1);
    let types: Vec<_> = types.into_iter().filter(|(_, count)| *count > 0).collect();
    let mut stated: Vec<_> = header.types.iter().map(|&(code, n)| (code, n as usize)).collect();
    stated.retain(|(_, count)| *count > 0);
    stated.sort_unstable();
    let mut count = |line: usize, what: &str, stated: u32, found: usize| {
        if stated as usize != found {
            let text = || format!("says {stated} {what}, the file has {found}");
            faults.add(FaultKind::Count, part.file("header"), line, text);
        }
    };
    count(1, "nodes", header.nodes, part.nodes.len());
    count(1, "elements", header.elements, elements);
    count(1, "boundary elements", header.boundary, boundary);
    if let Some(shared) = header.shared {
        count(3 + header.types.len(), "shared nodes", shared, part.shared.len());
    }
    if stated != types {
        let text = || format!("says {stated:?} of the types, the files have {types:?}");
        faults.add(FaultKind::Count, part.file("header"), 2, text);
    }
    if part.elements.is_empty() {
        faults.add(FaultKind::EmptyPart, part.file("elements"), 0, || "no elements".into());
    }
}
