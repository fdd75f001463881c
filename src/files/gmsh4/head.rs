//! The sections before the nodes: version, names, bodies and patches, and what the parts have of
//! them.

use super::Storage;
use super::numbers::{Numbers, end_of};
use super::plan::Plan;
use crate::files::WriteError;
use crate::files::gmsh::{Bounds, Groups, bounds, bounds_of_all, physical_names};
use crate::ground::comm::Communicator;

/// What one part has of the bodies and patches.
#[derive(Clone, Debug)]
struct PartEntities {
    /// The number of the part, from 1.
    number: u32,
    bodies: Vec<u32>,
    patches: Vec<u32>,
    bounds: Bounds,
}

/// **Collective.** The first sections of a file of all parts; empty on all ranks but the first.
pub(super) fn of_all(comm: &dyn Communicator, plan: &Plan, storage: Storage) -> Result<Vec<u8>, WriteError> {
    let own = bounds(plan.part);
    let whole = bounds_of_all(comm, own)?;
    let (bodies, patches) = (comm.gather(0, &plan.bodies)?, comm.gather(0, &plan.patches)?);
    let bounds = comm.gather(0, &own)?.concat();
    if comm.rank() > 0 {
        return Ok(Vec::new());
    }
    let lists = bodies.into_iter().zip(patches).zip(bounds.chunks_exact(6));
    let parts = (1..).zip(lists).map(|(number, ((bodies, patches), bounds))| PartEntities {
        number,
        bodies,
        patches,
        bounds: bounds.try_into().expect("six numbers"),
    });
    let parts: Vec<PartEntities> = parts.collect();
    let first = [plan.first_surface, plan.first_volume];
    Ok(head(plan, storage, whole, &parts, first))
}

/// **Collective.** The first sections of the file of this part. They have the bodies and patches of
/// the whole, but only this part's share of them: the length does not grow with the number of
/// parts.
pub(super) fn of_part(comm: &dyn Communicator, plan: &Plan, storage: Storage) -> Result<Vec<u8>, WriteError> {
    let own = bounds(plan.part);
    let whole = bounds_of_all(comm, own)?;
    let part = PartEntities {
        number: plan.number(),
        bodies: plan.bodies.clone(),
        patches: plan.patches.clone(),
        bounds: own,
    };
    Ok(head(plan, storage, whole, &[part], [plan.first_surface, plan.first_volume]))
}

/// `first` are the tags of the first surface and volume of these parts.
fn head(plan: &Plan, storage: Storage, whole: Bounds, parts: &[PartEntities], first: [u32; 2]) -> Vec<u8> {
    let [patches, bodies] = [&plan.names.patches, &plan.names.bodies].map(|labels| Groups::of(labels));
    let mut bytes = format!("$MeshFormat\n4.1 {} 8\n", u8::from(storage == Storage::Binary)).into_bytes();
    if storage == Storage::Binary {
        // Readers find the order of bytes from this number.
        bytes.extend(1_u32.to_le_bytes());
        bytes.push(b'\n');
    }
    bytes.extend(b"$EndMeshFormat\n");
    bytes.extend(physical_names(&patches, &bodies).bytes());
    bytes.extend(b"$Entities\n");
    let mut numbers = Numbers::new(storage, &mut bytes);
    counts(&mut numbers, patches.of.len(), bodies.of.len());
    for groups in [&patches, &bodies] {
        for (entity, tags) in (1..).zip(&groups.of) {
            end_entity(numbers.int(entity), &whole, tags);
        }
    }
    bytes.extend(end_of("Entities", storage));
    if plan.is_partitioned() {
        partitioned(plan, storage, parts, first, [&patches, &bodies], &mut bytes);
    }
    bytes
}

/// The section of what the parts have of bodies and patches, and of the volumes of their ghosts.
fn partitioned(
    plan: &Plan,
    storage: Storage,
    parts: &[PartEntities],
    first: [u32; 2],
    groups: [&Groups; 2],
    bytes: &mut Vec<u8>,
) {
    bytes.extend(b"$PartitionedEntities\n");
    let mut numbers = Numbers::new(storage, bytes);
    numbers.size(plan.part.ranks().into()).end();
    let ghosts = if plan.part.ghosts().is_some() { parts } else { &[] };
    numbers.size(ghosts.len() as u64).end();
    for part in ghosts {
        numbers.int(plan.first_ghosts + part.number - 1).int(part.number).end();
    }
    let count = |of: fn(&PartEntities) -> &[u32]| parts.iter().map(|part| of(part).len()).sum();
    counts(&mut numbers, count(|part| &part.patches), count(|part| &part.bodies));
    for (dimension, first, groups) in [(2, first[0], groups[0]), (3, first[1], groups[1])] {
        let mut tag = first;
        for part in parts {
            for &parent in if dimension == 2 { &part.patches } else { &part.bodies } {
                // One partition: its number.
                numbers.int(tag).int(dimension).int(parent + 1).size(1).int(part.number);
                end_entity(&mut numbers, &part.bounds, &groups.of[parent as usize]);
                tag += 1;
            }
        }
    }
    bytes.extend(end_of("PartitionedEntities", storage));
}

/// Appends the numbers of points, curves, surfaces and volumes.
fn counts(numbers: &mut Numbers, surfaces: usize, volumes: usize) {
    numbers.size(0).size(0).size(surfaces as u64).size(volumes as u64).end();
}

/// Ends the line of an entity: its box, its groups, and no entities that bound it.
fn end_entity(numbers: &mut Numbers, bounds: &Bounds, tags: &[u32]) {
    bounds.iter().for_each(|&x| _ = numbers.float(x));
    numbers.size(tags.len() as u64);
    tags.iter().for_each(|&tag| _ = numbers.int(tag));
    numbers.size(0).end();
}
