//! Faults of nodes: tables, copies, owners.

use super::faults::{FaultKind, Faults};
use super::read::{Element, ElmerMesh, ElmerPart, SharedNode};

/// A table by id has at most this many entries a node. Elmer's own tables have one for each id
/// between the least and the largest.
const MOST_PER_NODE: usize = 32;

/// Finds a node of a part by its id.
pub(super) struct NodeTable {
    /// Ids, ascending, with their indices in `.nodes`.
    sorted: Vec<(u32, u32)>,
    /// Indices by id from the first id on, `u32::MAX` for gaps; empty if the ids are too sparse.
    by_id: Vec<u32>,
    /// By index in `.nodes`: whether one of the part's own elements uses the node, not only halo
    /// elements.
    held: Vec<bool>,
}

impl NodeTable {
    fn new(part: &ElmerPart) -> Self {
        let mut sorted: Vec<(u32, u32)> = part.nodes.iter().map(|node| node.id).zip(0..).collect();
        sorted.sort_unstable();
        let mut by_id = Vec::new();
        if let (Some(&(first, _)), Some(&(last, _))) = (sorted.first(), sorted.last())
            && ((last - first) as usize) < MOST_PER_NODE * sorted.len()
        {
            by_id.resize((last - first) as usize + 1, u32::MAX);
            // Of a duplicate node the first counts.
            sorted.iter().rev().for_each(|(id, place)| by_id[(id - first) as usize] = *place);
        }
        Self { sorted, by_id, held: vec![false; part.nodes.len()] }
    }

    /// Whether one of the part's own elements uses the node at this index in `.nodes`.
    pub fn contains(&self, place: usize) -> bool {
        self.held[place]
    }

    /// Ids, ascending, with their indices in `.nodes`.
    pub fn sorted(&self) -> &[(u32, u32)] {
        &self.sorted
    }

    /// The index of a node in `.nodes`.
    #[inline]
    pub fn find(&self, id: u32) -> Option<usize> {
        let first = self.sorted.first()?.0;
        if !self.by_id.is_empty() {
            let place = *self.by_id.get(id.checked_sub(first)? as usize)?;
            return (place != u32::MAX).then_some(place as usize);
        }
        let place = self.sorted.binary_search_by_key(&id, |(known, _)| *known).ok()?;
        Some(self.sorted[place].1 as usize)
    }
}

/// Checks each part's `.nodes`, and the node ids of its elements and boundary elements.
pub(super) fn check_nodes(mesh: &ElmerMesh, faults: &mut Faults) -> Vec<NodeTable> {
    mesh.parts.iter().map(|part| check_nodes_of(part, faults)).collect()
}

/// Like [`check_nodes`], for one part.
pub(super) fn check_nodes_of(part: &ElmerPart, faults: &mut Faults) -> NodeTable {
    let mut table = NodeTable::new(part);
    for pair in table.sorted.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        let what = || format!("node {} is also on line {}", pair[1].0, pair[0].1 + 1);
        faults.add(FaultKind::NodeTwice, part.file("nodes"), pair[1].1 as usize + 1, what);
    }
    for (k, node) in part.nodes.iter().enumerate() {
        if !node.point.iter().all(|x| x.is_finite()) {
            let what = || format!("node {} is at {}", node.id, node.point);
            faults.add(FaultKind::NotFinite, part.file("nodes"), k + 1, what);
        }
    }
    table.held = check_uses(part, &table, faults);
    table
}

/// Checks the nodes used by elements and boundary elements; returns which nodes own elements use.
fn check_uses(part: &ElmerPart, table: &NodeTable, faults: &mut Faults) -> Vec<bool> {
    let mut held = vec![false; part.nodes.len()];
    for (k, element) in part.elements.iter().enumerate() {
        check_element(part, table, element, || part.elements.line(k), &mut held, faults);
    }
    let mut used = if part.halo.is_empty() { Vec::new() } else { held.clone() };
    for (k, (element, _)) in part.halo.iter().enumerate() {
        check_element(part, table, element, || part.halo.line(k), &mut used, faults);
    }
    let used = if part.halo.is_empty() { &held } else { &used };
    for (k, element) in part.boundary.iter().enumerate() {
        if element.boundary == 0 {
            let what = || format!("boundary element {} has number 0", element.id);
            faults.add(FaultKind::ZeroNumber, part.file("boundary"), part.boundary.line(k), what);
        }
        for id in element.all_nodes().filter(|&id| table.find(id).is_none()) {
            let what = || format!("boundary element {} uses node {id}", element.id);
            faults.add(FaultKind::NoSuchNode, part.file("boundary"), part.boundary.line(k), what);
        }
    }
    for (k, node) in part.nodes.iter().enumerate().filter(|(k, _)| !used[*k]) {
        let what = || format!("node {} belongs to no element of this part", node.id);
        faults.add(FaultKind::UnusedNode, part.file("nodes"), k + 1, what);
    }
    held
}

/// Checks the body and the nodes of an element, and marks the nodes as used.
fn check_element(
    part: &ElmerPart,
    table: &NodeTable,
    element: &Element,
    line: impl Fn() -> usize,
    used: &mut [bool],
    faults: &mut Faults,
) {
    if element.body == 0 {
        let what = || format!("element {} is in body 0", element.id);
        faults.add(FaultKind::ZeroNumber, part.file("elements"), line(), what);
    }
    for id in element.all_nodes() {
        match table.find(id) {
            Some(index) => used[index] = true,
            None => {
                let what = || format!("element {} uses node {id}", element.id);
                faults.add(FaultKind::NoSuchNode, part.file("elements"), line(), what);
            }
        }
    }
}

/// A `.shared` table by node.
struct SharedTable<'a> {
    sorted: Vec<(u32, u32)>,
    lines: &'a [SharedNode],
}

impl<'a> SharedTable<'a> {
    fn new(lines: &'a [SharedNode]) -> Self {
        let mut sorted: Vec<(u32, u32)> = lines.iter().map(|line| line.id).zip(0..).collect();
        sorted.sort_unstable();
        Self { sorted, lines }
    }

    /// The lines of a node: exactly one in a correct file.
    fn find(&self, id: u32) -> impl Iterator<Item = (usize, &'a SharedNode)> {
        let start = self.sorted.partition_point(|(known, _)| *known < id);
        let end = start + self.sorted[start..].partition_point(|(known, _)| *known == id);
        self.sorted[start..end].iter().map(|(_, k)| (*k as usize, &self.lines[*k as usize]))
    }
}

/// Checks the copies of nodes and their entries in `.shared` against the parts that have them.
pub(super) fn check_shared(mesh: &ElmerMesh, nodes: &[NodeTable], faults: &mut Faults) {
    let mut copies: Vec<(u32, u32, u32)> = Vec::new();
    for (p, part) in (0..).zip(&mesh.parts) {
        copies.extend(part.nodes.iter().zip(0..).map(|(node, k)| (node.id, p, k)));
    }
    copies.sort_unstable();
    // A duplicate node in one part is another fault.
    copies.dedup_by_key(|copy| (copy.0, copy.1));
    let tables: Vec<SharedTable> = mesh.parts.iter().map(|part| SharedTable::new(&part.shared)).collect();
    for copies in copies.chunk_by(|a, b| a.0 == b.0).filter(|copies| copies.len() > 1) {
        check_copies(mesh, &tables, copies, faults);
        check_owner(mesh, &tables, nodes, copies, faults);
    }
    for (p, part) in (0..).zip(&mesh.parts) {
        for (k, line) in part.shared.iter().enumerate() {
            let start = copies.partition_point(|copy| copy.0 < line.id);
            let holders = copies[start..].iter().take_while(|copy| copy.0 == line.id);
            let (mut here, mut others) = (false, false);
            holders.for_each(|copy| if copy.1 == p { here = true } else { others = true });
            if !(here && others) {
                let what = || format!("node {} is not shared with another part", line.id);
                faults.add(FaultKind::NeedlesslyShared, part.file("shared"), k + 1, what);
            }
        }
    }
}

/// Checks the copies (id, part, index) of one node.
fn check_copies(mesh: &ElmerMesh, tables: &[SharedTable], copies: &[(u32, u32, u32)], faults: &mut Faults) {
    let holders: Vec<u32> = copies.iter().map(|copy| copy.1 + 1).collect();
    let bits = |copy: &(u32, u32, u32)| {
        mesh.parts[copy.1 as usize].nodes[copy.2 as usize].point.coords.data.0[0].map(f64::to_bits)
    };
    let mut owner = None;
    for copy in copies {
        let (id, part) = (copy.0, &mesh.parts[copy.1 as usize]);
        if bits(copy) != bits(&copies[0]) {
            let what = || format!("node {id} is elsewhere in part {}", holders[0]);
            faults.add(FaultKind::CopiesDiffer, part.file("nodes"), copy.2 as usize + 1, what);
        }
        let mut lines = 0;
        for (k, line) in tables[copy.1 as usize].find(id) {
            lines += 1;
            let mut listed = line.parts.clone();
            listed.sort_unstable();
            if listed != holders || lines > 1 {
                let what = || {
                    format!("node {id} is listed twice or in parts {listed:?}, but is in parts {holders:?}")
                };
                faults.add(FaultKind::WrongHolders, part.file("shared"), k + 1, what);
            }
            let owner = *owner.get_or_insert(line.parts[0]);
            if line.parts[0] != owner {
                let what = || format!("node {id} has owner {} here and {owner} elsewhere", line.parts[0]);
                faults.add(FaultKind::OwnersDiffer, part.file("shared"), k + 1, what);
            }
        }
        if lines == 0 {
            let what = || format!("node {id} is in parts {holders:?}");
            faults.add(FaultKind::NotShared, part.file("shared"), 0, what);
        }
    }
}

/// Checks that the owner has the node in one of its own elements.
fn check_owner(
    mesh: &ElmerMesh,
    tables: &[SharedTable],
    nodes: &[NodeTable],
    copies: &[(u32, u32, u32)],
    faults: &mut Faults,
) {
    for &(id, part, place) in copies.iter().filter(|copy| !nodes[copy.1 as usize].contains(copy.2 as usize)) {
        for (k, line) in tables[part as usize].find(id).filter(|(_, line)| line.parts[0] == part + 1) {
            let what = || format!("node {id} (line {} of .nodes), owner {}", place + 1, line.parts[0]);
            faults.add(FaultKind::OwnerWatches, mesh.parts[part as usize].file("shared"), k + 1, what);
        }
    }
}
