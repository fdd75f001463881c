//! Meshes for the browser viewer: what it draws, bounded in size.
//!
//! A **view part** is one part of a mesh as flat arrays: tets with their neighbours, patches and
//! quality, from which a viewer draws boundaries, interfaces and cuts without further data. If a
//! part is too large, it is read **hollow**: only tets with a face on the skin of the part are
//! stored, so its size grows with the surface. [`gather`] sends all parts to rank 0, and
//! [`message`](message()) packs them for the page.
//!
//! *Not* in a view part: the nodes on edges of second order, and ghosts. Edges are drawn straight.

mod faces;
mod message;

pub use message::{About, message};

use crate::Point;
use crate::ground::comm::{CommError, Communicator};
use crate::ground::kernel::quality::mean_ratio;
use crate::ground::kernel::simplex::dihedral_angles;
use crate::ground::mesh::stream::{LocalBlock, MeshStream};
use crate::ground::mesh::{GlobalId, Mesh, TET_FACES};

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
    /// Their global ids.
    pub tet_ids: Vec<GlobalId>,
    /// The index of the body of each tet.
    pub bodies: Vec<u32>,
    /// The tets behind the faces opposite the corners, or [`OUTSIDE`] or [`UNKNOWN`].
    pub neighbours: Vec<[i32; 4]>,
    /// The indices of the patches of these faces, or [`NO_PATCH`].
    pub patches: Vec<[i32; 4]>,
    /// The smallest dihedral angle of each tet (degrees) and its mean ratio.
    pub quality: Vec<[f32; 2]>,
}

/// Which tets of a part are stored.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Fill {
    /// All.
    Full,
    /// Those with a face on the skin of the part or on a patch.
    Hollow,
}

/// *Local.* Reads a part.
pub fn part(stream: &dyn MeshStream, fill: Fill) -> ViewPart {
    let vertices = stream.counts().vertices as usize;
    let mut on_skin = vec![false; vertices];
    let mut all_ids = vec![0; vertices];
    for index in 0..stream.vertex_blocks() {
        let block = stream.vertex_block(index);
        let local = block.local.start as usize..block.local.end as usize;
        on_skin[local.clone()].fill(block.on_boundary || !block.holders.is_empty());
        all_ids[local].iter_mut().zip(block.ids()).for_each(|(to, id)| *to = id);
    }
    let on_skin = |vertices: &[u32]| vertices.iter().all(|&v| on_skin[v as usize]);
    let keep = |tet: &[u32; 4]| TET_FACES.iter().any(|face| on_skin(&face.map(|k| tet[k])));
    let mut found = ViewPart::default();
    let mut new_index = vec![u32::MAX; vertices];
    // Corners by local index of the stream: its faces are matched by them.
    let mut corners = Vec::new();
    let (mut block, mut points) = (LocalBlock::default(), Vec::new());
    for index in 0..stream.tet_blocks() {
        stream.local_block(index, &mut block);
        points.clear();
        let body = block.tets.body.expect("a tet block has a body").0;
        for (place, tet) in block.tets.tets.iter().enumerate() {
            let local = tet.map(|k| block.vertices[k as usize]);
            if fill == Fill::Hollow && !keep(&local) {
                continue;
            }
            // Most blocks of a hollow part have no such tet.
            if points.is_empty() {
                stream.block_points(&block, &mut points);
            }
            for (k, vertex) in tet.iter().zip(local) {
                let new = &mut new_index[vertex as usize];
                if *new == u32::MAX {
                    *new = found.points.len() as u32;
                    found.points.push(points[*k as usize]);
                    found.ids.push(all_ids[vertex as usize]);
                }
            }
            corners.push(local);
            found.tets.push(local.map(|vertex| new_index[vertex as usize]));
            found.tet_ids.push(block.tets.first_id + place as u64);
            found.bodies.push(body);
            found.quality.push(quality_of(tet.map(|k| points[k as usize])));
        }
    }
    let boundary = faces::on_patches(stream);
    (found.neighbours, found.patches) = faces::of_tets(&corners, &boundary, |face| {
        if fill == Fill::Full || on_skin(face) { OUTSIDE } else { UNKNOWN }
    });
    found
}

/// *Local.* Reads a mesh in one part.
pub fn of_mesh(mesh: &Mesh, fill: Fill) -> ViewPart {
    part(&super::plain::PlainPart::whole(mesh), fill)
}

/// The smallest dihedral angle in degrees, and the mean ratio, which is negative for an inverted
/// tet.
fn quality_of(tet: [[f64; 3]; 4]) -> [f32; 2] {
    let p = tet.map(Point::from);
    let angle = dihedral_angles(&p).into_iter().fold(f64::INFINITY, f64::min);
    [angle as f32, mean_ratio(&p[0], &p[1], &p[2], &p[3]) as f32]
}

/// **Collective.** The parts of all ranks on rank 0, by rank; the others get an empty list.
///
/// # Errors
/// If the ranks cannot communicate.
pub fn gather(comm: &dyn Communicator, part: &ViewPart) -> Result<Vec<ViewPart>, CommError> {
    let points = comm.gather(0, &part.points)?;
    let rest = comm
        .gather(0, &part.ids)?
        .into_iter()
        .zip(comm.gather(0, &part.tets)?)
        .zip(comm.gather(0, &part.tet_ids)?)
        .zip(comm.gather(0, &part.bodies)?)
        .zip(comm.gather(0, &part.neighbours)?)
        .zip(comm.gather(0, &part.patches)?)
        .zip(comm.gather(0, &part.quality)?);
    let join = |(points, ((((((ids, tets), tet_ids), bodies), neighbours), patches), quality))| ViewPart {
        points,
        ids,
        tets,
        tet_ids,
        bodies,
        neighbours,
        patches,
        quality,
    };
    Ok(points.into_iter().zip(rest).map(join).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::files::plain::PlainPart;
    use crate::files::testing::{cube, slabs, together};

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
    fn rank_0_gets_all_parts() {
        let mesh = cube(2);
        let results = together(3, |comm| {
            let stream = PlainPart::part(&mesh, &slabs(&mesh, 3), 3, comm.rank());
            let own = part(&stream, Fill::Full);
            let all = gather(comm, &own).unwrap();
            (own, all)
        });
        let own: Vec<ViewPart> = results.iter().map(|(own, _)| own.clone()).collect();
        assert_eq!(results[0].1, own);
        assert!(results[1].1.is_empty());
        let between = |part: &ViewPart| faces_of(part, |n, patch| n == OUTSIDE && patch == NO_PATCH);
        assert!(own.iter().map(between).sum::<usize>() > 0);
    }
}
