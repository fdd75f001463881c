//! Meshes for the browser viewer: what it draws, bounded in size.
//!
//! A **view part** is one part of a mesh as flat arrays: tets with their neighbours, patches and
//! quality, from which a viewer draws boundaries, interfaces and cuts without further data. If a
//! part is too large, it is read **hollow**: only tets with a face on the skin of the part are
//! stored, so its size grows with the surface. For a cut, only the tets **near** a plane are
//! stored. [`gather()`] sends all parts to rank 0, and [`message`](message()) packs them for the
//! page.

mod faces;
mod gather;
mod message;
mod overlap;
mod part;
mod region;
mod streams;
mod window;

pub use gather::gather;
pub use message::{About, message};
pub use part::{of_mesh, part};
pub use region::{Cutter, Region};
pub use streams::streams;
pub use window::fitting;

use crate::ground::mesh::{GlobalId, Rank};

/// A face without a tet on its other side in this part.
pub const OUTSIDE: i32 = -1;

/// A face whose other tet is not stored, because the part is hollow.
pub const UNKNOWN: i32 = -2;

/// A face that is on no patch.
pub const NO_PATCH: i32 = -1;

/// One part of a mesh.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ViewPart {
    /// Coordinates of the vertices that stored tets have.
    pub points: Vec<[f64; 3]>,
    /// Their global ids.
    pub ids: Vec<GlobalId>,
    /// Tets by index of `points`, positively oriented.
    pub tets: Vec<[u32; 4]>,
    /// For second order, the nodes on their edges by index of `points`, in the order of
    /// [`TET_EDGES`](crate::mesh::TET_EDGES); otherwise empty.
    pub nodes: Vec<[u32; 6]>,
    /// Their global ids.
    pub tet_ids: Vec<GlobalId>,
    /// The index of the body of each tet.
    pub bodies: Vec<u32>,
    /// The tets behind the faces opposite the corners, or [`OUTSIDE`] or [`UNKNOWN`].
    pub neighbours: Vec<[i32; 4]>,
    /// The indices of the patches of these faces, or [`NO_PATCH`].
    pub patches: Vec<[i32; 4]>,
    /// For ghosts the part that each tet belongs to; otherwise empty.
    pub owners: Vec<Rank>,
    /// The smallest dihedral angle of each tet (degrees) and its mean ratio.
    pub quality: Vec<[f32; 2]>,
}

/// Which tets of a part are stored.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Fill {
    /// All.
    Full,
    /// Those with a face on the skin of the part or on a patch.
    Hollow,
    /// Those that meet a plane or the surface of a box, inside a window.
    Near {
        /// What they meet, and the window.
        region: Region,
        /// The maximum number of tets.
        most: u64,
    },
    /// The ghosts of a stream with a halo, without the tets of the part.
    Ghosts,
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::plain::PlainPart;
    use crate::files::testing::{cube, slabs, together};
    use crate::parallel::halo::{By, WithHalo, halo};

    fn faces_of(part: &ViewPart, is: impl Fn(i32, i32) -> bool) -> usize {
        let both = part.neighbours.iter().flatten().zip(part.patches.iter().flatten());
        both.filter(|(neighbour, patch)| is(**neighbour, **patch)).count()
    }

    #[test]
    fn neighbours_are_mutual_and_the_outside_is_on_patches() {
        let part = of_mesh(&cube(4), Fill::Full);
        assert_eq!(part.tets.len(), 384);
        for (tet, neighbours) in part.neighbours.iter().enumerate() {
            for other in neighbours.iter().filter(|other| **other >= 0) {
                assert!(part.neighbours[*other as usize].contains(&(tet as i32)));
            }
        }
        assert_eq!(faces_of(&part, |neighbour, _| neighbour == OUTSIDE), 192);
        assert_eq!(faces_of(&part, |neighbour, patch| neighbour == OUTSIDE && patch == NO_PATCH), 0);
        assert!(part.quality.iter().all(|[angle, ratio]| *angle > 44.9 && *ratio > 0.5));
    }

    #[test]
    fn a_hollow_part_has_the_same_skin_with_fewer_tets() {
        let [full, hollow] = [Fill::Full, Fill::Hollow].map(|fill| of_mesh(&cube(8), fill));
        assert!(hollow.tets.len() < full.tets.len());
        let outer = |part: &ViewPart| faces_of(part, |neighbour, _| neighbour == OUTSIDE);
        assert_eq!(outer(&hollow), outer(&full));
        assert!(faces_of(&hollow, |neighbour, _| neighbour == UNKNOWN) > 0);
        assert_eq!(faces_of(&full, |neighbour, _| neighbour == UNKNOWN), 0);
    }

    #[test]
    fn near_a_plane_are_the_tets_that_meet_it() {
        let mesh = cube(4);
        let cutter = Cutter::Plane { normal: [1.0, 0.0, 0.0], offset: 0.4 };
        let region = Region { cutter, low: [0.0; 3], high: [4.0; 3] };
        let full = of_mesh(&mesh, Fill::Full);
        let x = |part: &ViewPart, tet: [u32; 4]| tet.map(|v| part.points[v as usize][0]);
        let meets = |x: [f64; 4]| x.iter().any(|x| *x <= 0.4) && x.iter().any(|x| *x >= 0.4);
        let expected = full.tets.iter().filter(|tet| meets(x(&full, **tet))).count();
        let near = of_mesh(&mesh, Fill::Near { region, most: 1000 });
        assert_eq!((near.tets.len(), near.tets.iter().all(|tet| meets(x(&near, *tet)))), (expected, true));
        // One layer of cells inside: its four edges, and the interface of the bodies from both
        // sides.
        assert_eq!(faces_of(&near, |_, patch| patch != NO_PATCH), 2 * (16 + 2 * 4));
        assert!(faces_of(&near, |neighbour, patch| neighbour == UNKNOWN && patch == NO_PATCH) > 0);
        let half = Region { high: [4.0, 0.4, 4.0], ..region };
        assert!(of_mesh(&mesh, Fill::Near { region: half, most: 1000 }).tets.len() < expected);
        assert!(of_mesh(&mesh, Fill::Near { region, most: 5 }).tets.len() > 5, "too many, and said so");
    }

    #[test]
    fn near_a_box_are_the_tets_at_its_surface() {
        // Cells have edges of 1/3: the surface meets 4³ − 2³ of them.
        let near = |low: f64, high: f64| {
            let cutter = Cutter::Box { low: [low / 3.0; 3], high: [high / 3.0; 3] };
            let region = Region { cutter, low: [0.0; 3], high: [2.0; 3] };
            of_mesh(&cube(6), Fill::Near { region, most: 1000 })
        };
        assert_eq!(near(1.2, 4.8).tets.len(), 6 * (64 - 8));
        assert_eq!(faces_of(&near(1.2, 4.8), |neighbour, _| neighbour == OUTSIDE), 0);
        assert_eq!(near(1.8, 4.2).tets.len(), 276, "some tets of cells at edges are outside");
    }

    #[test]
    fn ghosts_are_the_tets_around_a_part() {
        let mesh = cube(4);
        let results = together(3, |comm| {
            let stream = PlainPart::part(&mesh, &slabs(&mesh, 3), 3, comm.rank());
            let ghosts = halo(comm, &stream, By::Vertices).unwrap();
            (part(&stream, Fill::Full), part(&WithHalo::new(&stream, &ghosts), Fill::Ghosts))
        });
        for (rank, (own, ghosts)) in results.iter().enumerate() {
            assert!(!ghosts.tets.is_empty() && ghosts.owners.len() == ghosts.tets.len());
            for (tet, owner) in ghosts.tets.iter().zip(&ghosts.owners) {
                assert_ne!(*owner, rank as u32);
                assert!(tet.iter().any(|v| own.ids.contains(&ghosts.ids[*v as usize])), "touches the part");
            }
            let owned = |(id, owner): (&u64, &u32)| results[*owner as usize].0.tet_ids.contains(id);
            assert!(ghosts.tet_ids.iter().zip(&ghosts.owners).all(owned));
        }
    }

    #[test]
    fn rank_0_gets_all_parts() {
        let mesh = cube(2);
        let results = together(3, |comm| {
            let stream = PlainPart::part(&mesh, &slabs(&mesh, 3), 3, comm.rank());
            let own = part(&stream, Fill::Full);
            let all = gather(comm, vec![own.clone()]).unwrap();
            (own, all)
        });
        let own: Vec<ViewPart> = results.iter().map(|(own, _)| own.clone()).collect();
        assert_eq!(results[0].1, own);
        assert!(results[1].1.is_empty());
        let between = |part: &ViewPart| faces_of(part, |n, patch| n == OUTSIDE && patch == NO_PATCH);
        assert!(own.iter().map(between).sum::<usize>() > 0);
    }
}
