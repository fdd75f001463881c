//! Predicts from the coarse mesh whether a fine mesh fits memory and disk.

use super::error::Error;
use super::expected::rounded;
use super::model::Model;
use super::room_error::RoomError;
use super::settings::Disk;
use crate::ground::comm::Communicator;
use crate::ground::memory::{self, sized};
use crate::ground::mesh::stream::Counts;
use crate::ground::mesh::{Order, Rank};
use crate::ground::progress::Progress;
use crate::ground::size::SizeSettings;
use crate::parallel::distribution::DistMesh;
use crate::parallel::refine::numbering::fine_totals;
use crate::parallel::refine::{Keep, predicted_counts};
use std::path::Path;

/// *Local.* Refuses, on rank 0, a mesh that exceeds the disk or the numbers of a format.
///
/// # Errors
/// If the mesh does not fit; the error has the numbers.
pub(super) fn refuse_oversized(
    rank: Rank,
    part: &DistMesh,
    (pieces, order): (u32, Order),
    disk: Option<&Disk>,
) -> Result<(), RoomError> {
    let Some(Disk { folder, bytes, most, .. }) = disk.filter(|_| rank == 0) else { return Ok(()) };
    let Counts { vertices, tets, boundary } = fine_totals(&part.totals, pieces, order);
    if let Some(most) = most.filter(|most| tets > *most || vertices > *most) {
        return Err(RoomError::TooMany { tets, vertices, most });
    }
    let needed: u64 = [vertices, tets, boundary].iter().zip(bytes).map(|(count, bytes)| count * bytes).sum();
    // The folder may not exist yet.
    let there = folder.ancestors().find(|folder| folder.exists()).unwrap_or(Path::new("."));
    match fs4::available_space(there) {
        Ok(available) if needed > available => {
            Err(RoomError::Disk { needed, folder: there.to_path_buf(), available })
        }
        _ => Ok(()),
    }
}

/// **Collective.** Refuses a mesh whose writers take more memory than a machine has; `of_tet` is
/// what they take for a tet, in bytes; that of rank 0 counts.
///
/// # Errors
/// If it does not fit; on all ranks, with the numbers.
pub(super) fn refuse_crowded(
    comm: &dyn Communicator,
    part: &DistMesh,
    (pieces, order): (u32, Order),
    of_tet: u64,
    memory: Option<u64>,
) -> Result<(), Error> {
    let mut of_tet = vec![of_tet];
    comm.broadcast(0, &mut of_tet)?;
    if of_tet == [0] {
        return Ok(());
    }
    let counts = predicted_counts(part, pieces, order);
    let [_, least] = counts.bytes;
    let [needed] = memory::on_machine(comm, [least + of_tet[0] * counts.tets])?;
    let fits = match memory.or_else(memory::available_bytes) {
        Some(available) if needed > available => Err(RoomError::Writers { needed, available }),
        _ => Ok(()),
    };
    comm.agree(fits.map_err(Error::from))
}

/// *Local.* Refuses sizes with which not even the coarse mesh fits the memory, before anything is
/// meshed.
///
/// # Errors
/// If it does not fit; the error has the numbers.
pub(super) fn refuse_too_fine(
    model: &Model,
    sizes: &SizeSettings,
    memory: Option<u64>,
) -> Result<(), RoomError> {
    /// Memory of a coarse tet while it is made: measured are 200 to 320 bytes.
    const BYTES: f64 = 150.0;
    let Some(available) = memory.or_else(memory::available_bytes) else { return Ok(()) };
    let (tets, size) = model.least_tets(sizes);
    let needed = BYTES * tets;
    if needed <= available as f64 {
        return Ok(());
    }
    let tets = format!("{} tets", rounded(tets));
    Err(RoomError::Coarse { size, tets, needed: needed as u64, available })
}

/// **Collective.** Decides which vertices of the fine mesh this machine can store, before anything
/// is refined.
///
/// # Errors
/// If not even the boundary vertices fit; on all ranks, with the numbers.
pub(super) fn vertices_to_keep(
    comm: &dyn Communicator,
    part: &DistMesh,
    fineness: (u32, Order),
    memory: Option<u64>,
    progress: &Progress,
) -> Result<Keep, Error> {
    let (keep, [all, available]) = keep_of_level(comm, part, fineness, memory)?;
    if keep == Keep::Boundary {
        progress.note(&format!(
            "the fine mesh takes {}, above the {} there are: vertices inside coarse tets are computed anew wherever they \
             are needed",
            sized(all),
            sized(available)
        ));
    }
    Ok(keep)
}

/// **Collective.** Decides which vertices of a refinement level this machine can store; also
/// returns the bytes of all of them on this machine, and the free bytes.
///
/// # Errors
/// If not even the boundary vertices fit; on all ranks, with the numbers.
pub(super) fn keep_of_level(
    comm: &dyn Communicator,
    part: &DistMesh,
    (pieces, order): (u32, Order),
    memory: Option<u64>,
) -> Result<(Keep, [u64; 2]), Error> {
    let [all, least] = memory::on_machine(comm, predicted_counts(part, pieces, order).bytes)?;
    let Some(available) = memory.or_else(memory::available_bytes) else {
        return Ok((Keep::All, [all, u64::MAX]));
    };
    let fits = if least > available { Err(RoomError::Memory { all, least, available }) } else { Ok(()) };
    comm.agree(fits.map_err(Error::from))?;
    Ok((if all <= available { Keep::All } else { Keep::Boundary }, [all, available]))
}

#[cfg(test)]
mod tests {
    use super::super::part::Part;
    use super::*;
    use crate::ground::comm::thread;
    use crate::ground::error::{ErrorKind, HasKind};
    use crate::ground::progress::{Silent, Stage};
    use crate::parallel::refine::fixtures::{cube, whole};
    use crate::{Geometry, Mesher};
    use std::sync::Mutex;

    #[test]
    fn sizes_that_no_memory_holds_are_refused_before_anything_is_meshed() {
        let cube = "algebraic3d solid c = orthobrick (0, 0, 0; 1, 1, 1); tlo c;";
        for (geometry, size) in [
            (Geometry::from_text(cube).unwrap(), 1e-9),
            (Geometry::from_text(&cube.replace("tlo c", "tlo c -maxh=1e-5")).unwrap(), 1e-5),
        ] {
            let error = Mesher::new().max_size(size).generate(&geometry).unwrap_err();
            assert_eq!(error.kind(), ErrorKind::Resources, "{error}");
            assert!(error.to_string().contains("tets or more"), "{error}");
        }
        // Some four million tets, of 150 bytes.
        let sizes = SizeSettings { maxh: Some(0.01), ..SizeSettings::default() };
        let cube = Geometry::from_text(cube).unwrap();
        assert_eq!(refuse_too_fine(&cube.model, &sizes, Some(700_000_000)), Ok(()));
        assert!(refuse_too_fine(&cube.model, &sizes, Some(500_000_000)).is_err());
    }

    /// Six tets and 8 subdivisions: 729 vertices, 6·35 of them inside, and 6 tets of 84 octahedra.
    #[test]
    fn vertices_and_diagonals_count_toward_the_memory() {
        let part = whole(&cube(1, false).mesh);
        let kept = |memory| {
            let progress = Progress::new(&Silent);
            vertices_to_keep(&thread::alone(), &part, (8, Order::First), Some(memory), &progress)
        };
        let diagonals = 6 * 84 / 4;
        assert_eq!(kept(24 * 729 + diagonals).unwrap(), Keep::All);
        assert_eq!(kept(24 * 729 + diagonals - 1).unwrap(), Keep::Boundary);
        let least = 24 * (729 - 6 * 35) + diagonals;
        assert_eq!(kept(least).unwrap(), Keep::Boundary);
        assert_eq!(kept(least - 1).unwrap_err().kind(), ErrorKind::Resources);
    }

    /// Collects notes and stages.
    #[derive(Default)]
    struct Listener(Mutex<(Vec<String>, Vec<Stage>)>);

    impl crate::progress::Observer for Listener {
        fn begin(&self, stage: Stage) {
            self.0.lock().unwrap().1.push(stage);
        }
        fn note(&self, text: &str) {
            self.0.lock().unwrap().0.push(text.to_owned());
        }
    }

    #[test]
    fn little_memory_is_noted_or_refused_before_the_levels_and_changes_no_mesh() {
        let ball = Geometry::from_text("algebraic3d solid b = sphere (0, 0, 0; 1); tlo b;").unwrap();
        let mesher = Mesher::new().levels(3);
        let made = mesher.generate(&ball).unwrap();
        let Part::Refined(part) = &made.part else { panic!("a part that is not refined") };
        let [all, least] = predicted_counts(part.coarse(), 8, Order::First).bytes;
        let listener = Listener::default();
        let little = mesher.clone().memory((all + least) / 2).observer(&listener).generate(&ball).unwrap();
        assert_eq!(little.checksum, made.checksum);
        let (notes, _) = listener.0.into_inner().unwrap();
        assert!(notes.len() == 1 && notes[0].starts_with("the fine mesh takes "), "{notes:?}");
        let listener = Listener::default();
        let refused = mesher.memory(least - 1).observer(&listener).generate(&ball).unwrap_err();
        assert!(matches!(refused, Error::Room(RoomError::Memory { .. })), "{refused}");
        let (_, stages) = listener.0.into_inner().unwrap();
        assert!(!stages.contains(&Stage::Levels), "{stages:?}");
    }

    /// 6·8 tets of 100 bytes.
    #[test]
    fn what_the_writers_cannot_hold_is_refused_with_the_numbers() {
        let part = whole(&cube(1, false).mesh);
        let crowded = |of_tet, memory| {
            refuse_crowded(&thread::alone(), &part, (2, Order::First), of_tet, Some(memory)).err()
        };
        let [_, least] = predicted_counts(&part, 2, Order::First).bytes;
        assert!(crowded(0, 0).is_none());
        assert!(crowded(100, 4800 + least).is_none());
        let refused = crowded(100, 4800 + least - 1).expect("a byte is missing");
        assert_eq!(refused.kind(), ErrorKind::Resources);
        assert!(refused.to_string().contains("adjacency"), "{refused}");
    }

    #[test]
    fn what_the_disk_cannot_hold_is_refused_with_the_numbers() {
        let part = whole(&cube(1, false).mesh);
        let refusal = |bytes, most| {
            let disk =
                Disk { folder: std::env::temp_dir().join("not/there/yet"), bytes, most, memory_of_tet: 0 };
            refuse_oversized(0, &part, (2, Order::First), Some(&disk)).err()
        };
        assert!(refusal([1, 1, 1], None).is_none());
        let refused = refusal([0, 1 << 50, 0], None).expect("6·8 tets of 2⁵⁰ bytes are 54 PB");
        assert!(matches!(refused, RoomError::Disk { .. }));
        assert!(refused.to_string().contains("take about 54043.2 TB and"), "{refused}");
        assert!(refusal([0; 3], Some(48)).is_none());
        assert!(
            refusal([0; 3], Some(47))
                .is_some_and(|refused| refused.to_string().contains("48 tets with 27 vertices"))
        );
    }
}
