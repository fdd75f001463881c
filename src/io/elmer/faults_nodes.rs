//! Faults of nodes: tables, copies, owners.

use super::faults::{FaultKind, Faults};
use super::read::{ElmerMesh, ElmerPart, SharedNode};

/// Finds a node of a part by its id.
pub(super) struct NodeTable {
    /// Ids, ascending, and where each stands in `.nodes`.
    sorted: Vec<(u32, u32)>,
}

impl NodeTable {
    fn new(part: &ElmerPart) -> Self {
        let mut sorted: Vec<(u32, u32)> = part.nodes.iter().map(|node| node.id).zip(0..).collect();
        sorted.sort_unstable();
        Self { sorted }
    }

    /// Ids, ascending, and where each stands in `.nodes`.
    pub fn sorted(&self) -> &[(u32, u32)] {
        &self.sorted
    }

    /// Where the node stands in `.nodes`.
    pub fn find(&self, id: u32) -> Option<usize> {
        let first = self.sorted.first()?.0;
        // Where ids have no gap before it, the place is known.
        let guess = self.sorted.get(id.checked_sub(first)? as usize).filter(|(known, _)| *known == id);
        let by_search = || self.sorted.binary_search_by_key(&id, |(known, _)| *known).ok();
        guess.or_else(|| by_search().map(|place| &self.sorted[place])).map(|(_, index)| *index as usize)
    }
}

/// Checks each part's `.nodes`, and that elements and boundary elements find theirs.
pub(super) fn check_nodes(mesh: &ElmerMesh, faults: &mut Faults) -> Vec<NodeTable> {
    mesh.parts.iter().map(|part| check_nodes_of(part, faults)).collect()
}

/// The same for one part.
pub(super) fn check_nodes_of(part: &ElmerPart, faults: &mut Faults) -> NodeTable {
    let table = NodeTable::new(part);
    for pair in table.sorted.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        let what = || format!("node {} stands here and on line {}", pair[1].0, pair[0].1 + 1);
        faults.add(FaultKind::NodeTwice, part.file("nodes"), pair[1].1 as usize + 1, what);
    }
    for (k, node) in part.nodes.iter().enumerate() {
        if !node.point.iter().all(|x| x.is_finite()) {
            let what = || format!("node {} is at {}", node.id, node.point);
            faults.add(FaultKind::NotFinite, part.file("nodes"), k + 1, what);
        }
    }
    check_uses(part, &table, faults);
    table
}

fn check_uses(part: &ElmerPart, table: &NodeTable, faults: &mut Faults) {
    let mut used = vec![false; part.nodes.len()];
    for (k, element) in part.elements.iter().enumerate() {
        if element.body == 0 {
            let what = || format!("element {} is in body 0", element.id);
            faults.add(FaultKind::ZeroNumber, part.file("elements"), k + 1, what);
        }
        for &id in &element.nodes {
            match table.find(id) {
                Some(index) => used[index] = true,
                None => {
                    let what = || format!("element {} uses node {id}", element.id);
                    faults.add(FaultKind::NoSuchNode, part.file("elements"), k + 1, what);
                }
            }
        }
    }
    for (k, element) in part.boundary.iter().enumerate() {
        if element.boundary == 0 {
            let what = || format!("boundary element {} has number 0", element.id);
            faults.add(FaultKind::ZeroNumber, part.file("boundary"), k + 1, what);
        }
        for &id in element.nodes.iter().filter(|&&id| table.find(id).is_none()) {
            let what = || format!("boundary element {} uses node {id}", element.id);
            faults.add(FaultKind::NoSuchNode, part.file("boundary"), k + 1, what);
        }
    }
    for (k, node) in part.nodes.iter().enumerate().filter(|(k, _)| !used[*k]) {
        let what = || format!("node {} belongs to no element of this part", node.id);
        faults.add(FaultKind::UnusedNode, part.file("nodes"), k + 1, what);
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

    /// The lines of a node: one, if all is well.
    fn find(&self, id: u32) -> impl Iterator<Item = (usize, &'a SharedNode)> {
        let start = self.sorted.partition_point(|(known, _)| *known < id);
        let end = start + self.sorted[start..].partition_point(|(known, _)| *known == id);
        self.sorted[start..end].iter().map(|(_, k)| (*k as usize, &self.lines[*k as usize]))
    }
}

/// Checks copies of nodes and what `.shared` says of them, against the parts that really hold them.
pub(super) fn check_shared(mesh: &ElmerMesh, faults: &mut Faults) {
    let mut copies: Vec<(u32, u32, u32)> = Vec::new();
    for (p, part) in (0..).zip(&mesh.parts) {
        copies.extend(part.nodes.iter().zip(0..).map(|(node, k)| (node.id, p, k)));
    }
    copies.sort_unstable();
    // A node twice in one part is another fault.
    copies.dedup_by_key(|copy| (copy.0, copy.1));
    let tables: Vec<SharedTable> = mesh.parts.iter().map(|part| SharedTable::new(&part.shared)).collect();
    for copies in copies.chunk_by(|a, b| a.0 == b.0).filter(|copies| copies.len() > 1) {
        check_copies(mesh, &tables, copies, faults);
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

/// The copies (id, part, index) of one node.
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
            let mut said = line.parts.clone();
            said.sort_unstable();
            if said != holders || lines > 1 {
                let what =
                    || format!("node {id} is said once more or to be in {said:?}, it is in {holders:?}");
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
