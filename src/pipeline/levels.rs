//! The levels of a refined mesh, made on demand for viewers.

use super::error::Error;
use super::part::Part;
use super::result::Generated;
use crate::files::view::{Fill, Region, ViewPart, gather, part};
use crate::ground::comm::Communicator;
use crate::ground::mesh::stream::{Counts, MeshStream};
use crate::ground::mesh::{Order, TetId};
use crate::ground::projector::Projector;
use crate::parallel::distribution::DistMesh;
use crate::parallel::refine::numbering::fine_totals;
use crate::parallel::refine::subset::subset;
use crate::parallel::refine::{self, Keep, RefinedMesh, refine_as_is, snap};

/// The maximum number of tets that are refined for a cut: below a second on two cores.
const CUT_WORK: f64 = 3e7;

/// Tets that meet the cutter, for each coarse tet that does and its squared subdivisions: 0.92 to
/// 1.04 for four planes and 0.97 to 1.11 for 18 boxes through `crankshaft` and `tee`. If there are
/// more, the cut is made again.
const CUT_DENSITY: f64 = 1.05;

/// Levels with more tets than this do not store coordinates inside coarse tets.
const STORED: u64 = 20_000_000;

/// The farthest that the lattice of a curved coarse tet is expected outside the straight tet,
/// relative to its longest edge.
const BULGE: f64 = 0.25;

/// One rank's part of a refined mesh without its fine vertices, from which any level is made.
///
/// Levels have their vertices on the geometry. They are not checked: a level that is not one of the
/// run can have inverted tets, which are part of it.
#[derive(Clone, Debug)]
pub struct Levels {
    coarse: DistMesh,
    pieces: u32,
    projector: Projector,
    settings: refine::Settings,
    links: Vec<[u32; 2]>,
}

/// The tets at a cut, on rank 0.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Cut {
    /// The tets of each rank; empty on other ranks.
    pub parts: Vec<ViewPart>,
    /// Subdivisions of each coarse edge.
    pub pieces: u32,
}

impl Generated {
    /// *Local.* The levels of the mesh, on demand. `None` if the parts were meshed separately.
    pub fn levels_on_demand(&self) -> Option<Levels> {
        let (Part::Refined(part), Some(refinement)) = (&self.part, &self.refinement) else { return None };
        Some(Levels {
            coarse: part.coarse().clone(),
            pieces: part.pieces(),
            projector: refinement.projector.clone(),
            settings: refinement.settings.clone(),
            links: part.links().iter().map(|link| [link.image.0, link.of.0]).collect(),
        })
    }
}

impl Levels {
    /// Subdivisions of each coarse edge of the mesh itself.
    pub fn pieces(&self) -> u32 {
        self.pieces
    }

    /// The order of the elements.
    pub fn order(&self) -> Order {
        self.settings.order
    }

    /// Pairs of patches, a periodic copy and its master, by index.
    pub fn periodic(&self) -> &[[u32; 2]] {
        &self.links
    }

    /// Counts of the whole mesh at a level.
    ///
    /// # Panics
    /// If no lattice has so many subdivisions.
    pub fn totals(&self, pieces: u32) -> Counts {
        fine_totals(&self.coarse.totals, pieces, self.settings.order)
    }

    /// *Local.* This rank's part of a level.
    ///
    /// # Errors
    /// If there is not enough memory, or no lattice has so many subdivisions.
    pub fn level(&self, pieces: u32) -> Result<RefinedMesh, Error> {
        self.refined(self.coarse.clone(), pieces)
    }

    fn refined(&self, coarse: DistMesh, pieces: u32) -> Result<RefinedMesh, Error> {
        let tets = coarse.tets.len() as u64 * u64::from(pieces).pow(3);
        // Straight edges are listed by the ids of the nodes of the mesh itself.
        let straight = if pieces == self.pieces { self.settings.straight.clone() } else { Vec::new() };
        let keep = if tets > STORED { Keep::Boundary } else { Keep::All };
        let settings = refine::Settings { keep, straight, ..self.settings.clone() };
        Ok(refine_as_is(coarse, &self.projector, pieces, &settings)?)
    }

    /// **Collective.** The tets of a level that meet a plane or the surface of a box, inside a
    /// window, on rank 0. The level has at most the requested subdivisions, and fewer if there were
    /// more than `most` such tets. `None` on all ranks if even the coarse mesh has more.
    ///
    /// # Errors
    /// The same on all ranks: not enough memory, or a rank failed.
    pub fn cut(
        &self,
        comm: &dyn Communicator,
        pieces: u32,
        region: Region,
        most: u64,
    ) -> Result<Option<Cut>, Error> {
        let (tets, meeting) = self.near(&region);
        let counts = comm.all_reduce_sum_u64([tets.len() as u64, meeting])?;
        let [count, meeting] = counts.map(|count| count.max(1) as f64);
        let fit = f64::min((most as f64 / (CUT_DENSITY * meeting)).sqrt(), (CUT_WORK / count).cbrt());
        let mut pieces = pieces.min(self.pieces).min(fit as u32).max(1);
        let coarse = subset(&self.coarse, &tets);
        loop {
            let refined = comm.agree(self.refined(coarse.clone(), pieces))?;
            // Reading on shows how many fewer subdivisions are needed.
            let near = part(&refined, Fill::Near { region, most: 4 * most });
            let [found] = comm.all_reduce_sum_u64([near.tets.len() as u64])?;
            if found <= most {
                return Ok(Some(Cut { parts: gather(comm, vec![near])?, pieces }));
            }
            if pieces == 1 {
                return Ok(None);
            }
            let fewer = f64::from(pieces) * (most as f64 / found as f64).sqrt();
            pieces = (fewer as u32).clamp(1, pieces - 1);
        }
    }

    /// The coarse tets that can have fine tets at a cut, ascending, and the number of those
    /// that meet it if they are straight.
    fn near(&self, region: &Region) -> (Vec<u32>, u64) {
        let mesh = &self.coarse;
        let (mut near, mut meeting) = (Vec::new(), 0);
        for tet in 0..mesh.tets.len() as u32 {
            let corners = mesh.tets[tet as usize].map(|v| mesh.points[v.index()].coords.into());
            let meets = region.meets(&corners);
            let flat = snap::is_flat(mesh, &self.projector, &self.settings.displacements, TetId(tet));
            if meets || (!flat && region.may_meet(&corners, BULGE * longest_edge(&corners))) {
                near.push(tet);
            }
            meeting += u64::from(meets);
        }
        (near, meeting)
    }
}

fn longest_edge(corners: &[[f64; 3]; 4]) -> f64 {
    let length = |p: &[f64; 3], q: &[f64; 3]| (0..3).map(|k| (p[k] - q[k]).powi(2)).sum::<f64>().sqrt();
    let pairs = crate::ground::mesh::TET_EDGES.into_iter();
    pairs.map(|[i, j]| length(&corners[i], &corners[j])).fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::view::Cutter;
    use crate::ground::comm::thread;
    use crate::pipeline::{Geometry, Mesher};

    /// Tets by id, with the coordinates of their corners.
    fn tets_of(parts: &[ViewPart]) -> Vec<(u64, [[f64; 3]; 4])> {
        let of_part = |part: &ViewPart| -> Vec<_> {
            let corners = part.tets.iter().map(|tet| tet.map(|v| part.points[v as usize]));
            part.tet_ids.iter().copied().zip(corners).collect()
        };
        let mut tets: Vec<_> = parts.iter().flat_map(of_part).collect();
        tets.sort_by_key(|(id, _)| *id);
        tets
    }

    #[test]
    fn a_cut_has_the_tets_of_the_level_that_meet_the_plane_or_the_box() {
        let window = Region {
            cutter: Cutter::Plane { normal: [0.6, 0.0, 0.8], offset: 0.4 },
            low: [-0.5, -2.0, -2.0],
            high: [2.0; 3],
        };
        let beside = Region { cutter: Cutter::Plane { normal: [0.6, 0.0, 0.8], offset: 9.0 }, ..window };
        let around = Cutter::Box { low: [-0.2, -0.3, 0.1], high: [0.55, 2.0, 0.7] };
        for region in [window, Region { cutter: around, ..window }] {
            check_cuts(region, beside);
        }
    }

    /// Compares the tets of a cut through half a ball with those of the whole level.
    fn check_cuts(region: Region, beside: Region) {
        let text = "algebraic3d solid s = sphere (0, 0, 0; 1) and plane (0, 0, 0; 0, 0, -1); tlo s;";
        let results = thread::run(3, |comm| {
            let geometry = Geometry::from_text(text).unwrap();
            let made = Mesher::new().max_size(0.7).pieces(6).generate_on(comm, Some(&geometry)).unwrap();
            let levels = made.levels_on_demand().unwrap();
            let whole = gather(comm, vec![part(&levels.level(6).unwrap(), Fill::Full)]).unwrap();
            let cut = levels.cut(comm, 6, region, 100_000).unwrap().unwrap();
            let few = levels.cut(comm, 6, region, 700).unwrap().unwrap();
            let none = levels.cut(comm, 6, region, 3).unwrap();
            let beside = levels.cut(comm, 6, beside, 3).unwrap().unwrap();
            (levels.totals(6), whole, cut, few, none, beside)
        });
        let (totals, whole, cut, few, none, beside) = results.unwrap().swap_remove(0);
        let whole = tets_of(&whole);
        assert_eq!(whole.len() as u64, totals.tets);
        let meeting: Vec<_> = whole.into_iter().filter(|(_, corners)| region.meets(corners)).collect();
        assert!(meeting.len() > 1000, "{}", meeting.len());
        assert_eq!((tets_of(&cut.parts), cut.pieces), (meeting, 6));
        let found: usize = few.parts.iter().map(|part| part.tets.len()).sum();
        assert!(few.pieces < 6 && (100..=700).contains(&found), "{found} tets, {} subdivisions", few.pieces);
        assert_eq!(none, None);
        assert!(beside.parts.iter().all(|part| part.tets.is_empty()));
    }
}
