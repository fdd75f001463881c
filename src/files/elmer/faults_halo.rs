//! Faults of halo elements.

use super::faults::{FaultKind, Faults};
use super::read::{Element, ElmerMesh};

/// Each halo element must exist in its owner's part, with the same body and the same nodes in the
/// same order.
pub(super) fn check_halo(mesh: &ElmerMesh, faults: &mut Faults) {
    if mesh.parts.iter().all(|part| part.halo.is_empty()) {
        return;
    }
    let tables: Vec<Vec<&Element>> = mesh.parts.iter().map(|part| by_id(&part.elements)).collect();
    for (part, number) in mesh.parts.iter().zip(1..) {
        let mut seen: Vec<u32> = part.halo.iter().map(|(element, _)| element.id).collect();
        seen.sort_unstable();
        for (k, (element, owner)) in part.halo.iter().enumerate() {
            let id = element.id;
            let known = (*owner as usize).checked_sub(1).and_then(|owner| tables.get(owner));
            let original = known.and_then(|table| {
                table.binary_search_by_key(&id, |element| element.id).ok().map(|place| table[place])
            });
            let twice = seen.partition_point(|&s| s <= id) - seen.partition_point(|&s| s < id) > 1;
            let wrong = match original {
                _ if *owner == number => "names this part as its owner".to_string(),
                _ if twice => "is listed twice here".to_string(),
                None => format!("is not in part {owner}"),
                Some(original) if original != element => format!("has another body or nodes in part {owner}"),
                Some(_) => continue,
            };
            let what = || format!("halo element {id} {wrong}");
            faults.add(FaultKind::WrongHalo, part.file("elements"), part.halo.line(k), what);
        }
    }
}

fn by_id(elements: &[Element]) -> Vec<&Element> {
    let mut sorted: Vec<&Element> = elements.iter().collect();
    sorted.sort_by_key(|element| element.id);
    sorted
}
