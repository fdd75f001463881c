//! Global ids for parts that were meshed independently.
//!
//! Each vertex of a skin has a name that is the same on all ranks that share it: with the method
//! `surface` its global id in the lattice of the whole mesh, with `decompose` its index in the
//! surface mesh. Its owner assigns the new id, without gaps, and sends it to the other ranks: one
//! scan, one exchange.

use super::{Filled, Skin};
use crate::ground::comm::pack::{put_ascending, put_varint, take_ascending, take_varint};
use crate::ground::comm::{CommError, Communicator};
use crate::ground::kernel::simplex::ascending;
use crate::ground::kernel::simplex::from_lowest;
use crate::ground::mesh::stream::Counts;
use crate::ground::mesh::{Class, GlobalId, Rank, TET_FACES, TetId, VertexId};
use crate::parallel::distribution::{BareMesh, ClassifiedEdge, Side, owner};
use std::collections::HashMap;

/// **Collective.** Assembles the part from a skin and the tets inside it. `boundary` is the number
/// of triangles on patches of the whole mesh.
///
/// # Errors
/// [`CommError`] if another rank fails.
pub fn number(
    comm: &dyn Communicator,
    skin: Skin,
    filled: Filled,
    boundary: u64,
) -> Result<BareMesh, CommError> {
    let names = Names::of(&skin, comm.rank());
    let vertices = (names.owned.iter().filter(|owned| **owned).count() + filled.inside.len()) as u64;
    let counts = [vertices, filled.tets.len() as u64];
    let first = comm.exclusive_scan(counts)?;
    let [vertices, tets] = comm.all_reduce_sum_u64(counts)?;

    let (mut ids, next) = names.number(first[0]);
    let received = comm.exchange_bytes(names.messages(comm.rank(), &ids))?;
    names.set_ids(&received, &mut ids);
    ids.extend((next..).take(filled.inside.len()));
    let part = BareMesh {
        rank: comm.rank(),
        ranks: comm.size(),
        totals: Counts { vertices, tets, boundary },
        tet_ids: (first[1]..).take(filled.tets.len()).collect(),
        ..BareMesh::default()
    };
    Ok(assemble(part, &skin, filled, ids))
}

/// The vertices of a skin, identified by their names.
struct Names<'a> {
    skin: &'a Skin,
    /// For each vertex, whether this rank owns it.
    owned: Vec<bool>,
}

impl<'a> Names<'a> {
    fn of(skin: &'a Skin, rank: Rank) -> Self {
        let mut owned = vec![true; skin.names.len()];
        for (v, holders) in skin.shared.iter() {
            owned[v as usize] = owner(holders, skin.names[v as usize]) == rank;
        }
        Self { skin, owned }
    }

    /// Assigns ids from `first` on to the vertices that this rank owns (the others get
    /// `GlobalId::MAX`); also returns the next free id.
    fn number(&self, mut first: GlobalId) -> (Vec<GlobalId>, GlobalId) {
        let mut number = |&owned: &bool| {
            if !owned {
                return GlobalId::MAX;
            }
            first += 1;
            first - 1
        };
        (self.owned.iter().map(&mut number).collect(), first)
    }

    /// The messages to the other holders of owned vertices: count, ascending names, ids.
    fn messages(&self, rank: Rank, ids: &[GlobalId]) -> Vec<(Rank, Vec<u8>)> {
        let mut numbered: Vec<(Rank, GlobalId, GlobalId)> = Vec::new();
        for (v, holders) in self.skin.shared.iter().map(|(v, holders)| (v as usize, holders)) {
            if self.owned[v] {
                let others = holders.iter().filter(|&&holder| holder != rank);
                numbered.extend(others.map(|&holder| (holder, self.skin.names[v], ids[v])));
            }
        }
        numbered.sort_unstable();
        let message = |numbered: &[(Rank, GlobalId, GlobalId)]| {
            let mut message = Vec::new();
            put_varint(&mut message, numbered.len() as u64);
            put_ascending(&mut message, numbered.iter().map(|t| t.1));
            numbered.iter().for_each(|t| put_varint(&mut message, t.2));
            (numbered[0].0, message)
        };
        numbered.chunk_by(|a, b| a.0 == b.0).map(message).collect()
    }

    /// Sets the ids that the owners sent.
    fn set_ids(&self, messages: &[(Rank, Vec<u8>)], ids: &mut [GlobalId]) {
        let mut by_name: Vec<(GlobalId, usize)> = self.skin.names.iter().copied().zip(0..).collect();
        by_name.sort_unstable();
        for (_, message) in messages {
            let mut message = &message[..];
            let count = take_varint(&mut message) as usize;
            let names: Vec<GlobalId> = take_ascending(&mut message, count).collect();
            for name in names {
                let at = by_name.binary_search_by_key(&name, |n| n.0).expect("a sharing rank has the vertex");
                ids[by_name[at].1] = take_varint(&mut message);
            }
        }
    }
}

/// Assembles the part, with its vertices in id order.
fn assemble(mut part: BareMesh, skin: &Skin, filled: Filled, ids: Vec<GlobalId>) -> BareMesh {
    let mut order: Vec<usize> = (0..ids.len()).collect();
    order.sort_unstable_by_key(|&v| ids[v]);
    let mut place = vec![VertexId(0); ids.len()];
    (0..).zip(&order).for_each(|(new, &old)| place[old] = VertexId(new));
    let bodies = bodies_inside(skin, &filled);

    let on_skin = skin.points.len();
    for &old in &order {
        part.vertex_ids.push(ids[old]);
        if old < on_skin {
            let p = skin.points[old];
            part.points.push([p.x, p.y, p.z]);
            part.vertex_classes.push(skin.classes[old]);
            if let Some(holders) = skin.shared.holders_of(old as u32) {
                part.shared.push(place[old].0, holders.iter().copied());
            }
        } else {
            part.points.push(filled.inside[old - on_skin]);
            part.vertex_classes.push(bodies[old - on_skin]);
        }
    }
    part.tets = filled.tets.iter().map(|tet| tet.map(|v| place[v as usize])).collect();
    part.sides = sides(skin, &filled);
    part.edges = classified_edges(skin, &place);
    part.tet_bodies = filled.bodies;
    part
}

/// The class of each interior vertex.
fn bodies_inside(skin: &Skin, filled: &Filled) -> Vec<Class> {
    let mut classes = vec![Class::Body(csg::BodyId(0)); filled.inside.len()];
    for (tet, body) in filled.tets.iter().zip(&filled.bodies) {
        for v in tet {
            if let Some(v) = (*v as usize).checked_sub(skin.points.len()) {
                classes[v] = Class::Body(*body);
            }
        }
    }
    classes
}

/// The faces of tets on patches, ascending.
fn sides(skin: &Skin, filled: &Filled) -> Vec<Side> {
    let patched = skin.triangles.iter().filter(|t| t.patch.is_some());
    let triangles: HashMap<[u32; 3], usize> =
        patched.clone().zip(0..).map(|(t, k)| (ascending(t.vertices), k)).collect();
    let patched: Vec<_> = patched.collect();
    let mut sides = Vec::with_capacity(patched.len());
    for (tet, corners) in (0..).map(TetId).zip(&filled.tets) {
        // Only tets at the surface have three vertices on triangles.
        let on_triangles = corners.iter().filter(|&&v| (v as usize) < skin.on_triangles).count();
        if on_triangles < 3 {
            continue;
        }
        for (face, outward) in (0..).zip(TET_FACES.map(|face| face.map(|k| corners[k]))) {
            let Some(&k) = triangles.get(&ascending(outward)) else { continue };
            let is_back = from_lowest(outward) == from_lowest(patched[k].vertices);
            let (patch, back) = patched[k].patch.expect("only triangles on patches are listed");
            sides.push(Side { tet, face, patch, behind: is_back == back });
        }
    }
    sides
}

/// The edges on curves and patches, ascending.
fn classified_edges(skin: &Skin, place: &[VertexId]) -> Vec<ClassifiedEdge> {
    let placed = |v: u32| place[v as usize];
    let edges = skin.edges.iter().map(|&(ends, class)| ClassifiedEdge::new(ends.map(placed), class));
    let mut edges: Vec<ClassifiedEdge> = edges.collect();
    for triangle in &skin.triangles {
        if let Some((patch, _)) = triangle.patch {
            edges.extend(ClassifiedEdge::of_triangle(triangle.vertices.map(placed), patch));
        }
    }
    ClassifiedEdge::sort(&mut edges);
    edges
}
