//! Whether a fine mesh fits the memory and the disk, told from its coarse mesh.

use crate::comm::Communicator;
use crate::dist::DistMesh;
use crate::error::{Failure, Status, agree};
use crate::memory::{self, sized};
use crate::mesh::Rank;
use crate::mesh::stream::Counts;
use crate::progress::Progress;
use crate::refine::lattice::Lattice;
use crate::refine::numbering::fine_totals;
use crate::refine::{Keep, census};
use std::path::{Path, PathBuf};

/// What is to be written, and where. Bytes are rather too few than too many: what writers find out themselves is exact.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Disk {
    /// The folder.
    pub folder: PathBuf,
    /// Bytes for each vertex, tet and boundary triangle.
    pub bytes: [u64; 3],
    /// The most vertices or tets that all formats can number.
    pub most: Option<u64>,
}

/// *Local.* Refuses, on rank 0, what the disk cannot hold or a format cannot number.
///
/// # Errors
/// With the numbers.
pub(super) fn refuse_without_disk(
    rank: Rank,
    part: &DistMesh,
    pieces: u32,
    disk: Option<&Disk>,
) -> Result<(), Failure> {
    let Some(Disk { folder, bytes, most }) = disk.filter(|_| rank == 0) else { return Ok(()) };
    let Counts { vertices, tets, boundary } = fine_totals(&part.totals, Lattice::new(pieces));
    if let Some(most) = most.filter(|most| tets > *most || vertices > *most) {
        let message = format!(
            "{tets} tets with {vertices} vertices are more than {most}, the most that a format numbers: take another format, or fewer"
        );
        return Err(Failure::new(Status::Resources, message));
    }
    let needed: u64 = [vertices, tets, boundary].iter().zip(bytes).map(|(count, bytes)| count * bytes).sum();
    // The folder may not be there yet.
    let there = folder.ancestors().find(|folder| folder.exists()).unwrap_or(Path::new("."));
    match fs4::available_space(there) {
        Ok(available) if needed > available => Err(Failure::new(
            Status::Resources,
            format!(
                "the files take {} or more and {} has {} free: write elsewhere, take another format, or ask for fewer tets",
                sized(needed),
                there.display(),
                sized(available)
            ),
        )),
        _ => Ok(()),
    }
}

/// **Collective.** What this machine can keep of the fine mesh; refuses what it cannot even begin, before anything is refined.
///
/// # Errors
/// With the numbers, on all ranks.
pub(super) fn what_fits(
    comm: &dyn Communicator,
    part: &DistMesh,
    pieces: u32,
    memory: Option<u64>,
    progress: &Progress,
) -> Result<Keep, Failure> {
    let machine = memory::machine();
    let machines = comm.all_gather_bytes(machine.as_bytes())?;
    let on_machine = |bytes: u64| -> Result<u64, Failure> {
        let needs = comm.all_gather_one(bytes)?;
        let here = machines.iter().zip(&needs).filter(|(name, _)| **name == machine.as_bytes());
        Ok(here.map(|(_, need)| need).sum())
    };
    let [all, least] = census(part, pieces).bytes;
    let (all, least) = (on_machine(all)?, on_machine(least)?);
    let Some(available) = memory.or_else(memory::available_bytes) else { return Ok(Keep::All) };
    let refused = (least > available).then(|| {
        let message = format!(
            "the fine vertices take {}, those on boundaries and interfaces alone {}, and this machine has {} \
             left: take fewer levels or tets, or more machines",
            sized(all),
            sized(least),
            sized(available)
        );
        Failure::new(Status::Resources, message)
    });
    agree(comm, refused.map_or(Ok(()), Err))?;
    if all <= available {
        return Ok(Keep::All);
    }
    progress.note(&format!(
        "note: the fine vertices take {}, above the {} there are: those inside coarse tets are computed anew wherever they \
         are needed",
        sized(all),
        sized(available)
    ));
    Ok(Keep::Boundary)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::refine::fixtures::{cube, whole};

    #[test]
    fn what_the_disk_cannot_hold_is_refused_with_the_numbers() {
        let part = whole(&cube(1, false).mesh);
        let refusal = |bytes, most| {
            let disk = Disk { folder: std::env::temp_dir().join("not/there/yet"), bytes, most };
            refuse_without_disk(0, &part, 2, Some(&disk)).err()
        };
        assert!(refusal([1, 1, 1], None).is_none());
        let refused = refusal([0, 1 << 50, 0], None).expect("6·8 tets of 2⁵⁰ bytes are 54 PB");
        assert_eq!(refused.status, Status::Resources);
        assert!(refused.to_string().contains("take 54043.2 TB or more"), "{refused}");
        assert!(refusal([0; 3], Some(48)).is_none());
        assert!(
            refusal([0; 3], Some(47))
                .is_some_and(|refused| refused.to_string().contains("48 tets with 27 vertices"))
        );
    }
}
