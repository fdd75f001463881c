//! Verification that the parts are valid meshes and that the ranks agree on shared entities.

use super::{BoundaryFace, DistMesh, Shared};
use crate::ground::comm::{CommError, Communicator};
use crate::ground::error::{ErrorKind, HasKind};
use crate::ground::kernel::predicates::{Sign, orient3d};
use crate::ground::mesh::{Class, GlobalId, Rank, TET_EDGES, VertexId, topology};
use csg::{BodyId, PatchId};
use std::collections::BTreeMap;
use std::fmt;

/// The faults of one rank's part, as sentences; only the first few are kept.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Faults {
    /// The first [`Faults::SHOWN`] faults.
    pub shown: Vec<String>,
    /// The number of all faults.
    pub count: usize,
}

impl Faults {
    /// The number of faults that are described.
    pub const SHOWN: usize = 10;

    /// Counts a fault; `text` is called only if the fault will be shown.
    fn add(&mut self, text: impl FnOnce() -> String) {
        if self.count < Self::SHOWN {
            self.shown.push(text());
        }
        self.count += 1;
    }

    fn verdict(self) -> Result<(), CheckError> {
        if self.count == 0 { Ok(()) } else { Err(CheckError::Faults(self)) }
    }

    fn expect(&mut self, contains: bool, text: impl FnOnce() -> String) {
        if !contains {
            self.add(text);
        }
    }
}

impl fmt::Display for Faults {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} faults in the distributed mesh: {}", self.count, self.shown.join("; "))?;
        if self.count > self.shown.len() { write!(f, "; ...") } else { Ok(()) }
    }
}

/// Why a distributed mesh is invalid.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
pub enum CheckError {
    /// The part has faults.
    #[error("{0}")]
    Faults(Faults),
    /// Another rank found faults, or communication failed.
    #[error(transparent)]
    Comm(#[from] CommError),
}

impl HasKind for CheckError {
    fn kind(&self) -> ErrorKind {
        match self {
            Self::Faults(_) => ErrorKind::NoMesh,
            Self::Comm(error) => error.kind(),
        }
    }

    fn is_elsewhere(&self) -> bool {
        matches!(self, Self::Comm(error) if error.is_elsewhere())
    }
}

impl DistMesh {
    /// **Collective.** Checks each part and the agreement on shared entities.
    ///
    /// On each rank: ids ascend; tets are positively oriented; edges and faces are exactly those of
    /// the tets; each face on a patch is in `boundary` with its tets, and those of one patch have
    /// the same body behind and in front; each face with one tet is on a patch or shared. Between
    /// ranks: all holders of an entity have the same list of holders, coordinates (bitwise), class
    /// and vertices; a face has two holders at most, and a boundary triangle between them one tet
    /// on each side; each entity is owned once and the totals are right.
    ///
    /// # Errors
    /// [`CheckError::Faults`] with its own faults on each rank that found some,
    /// [`CheckError::Comm`] naming the lowest such rank on the others.
    pub fn check(&self, comm: &dyn Communicator) -> Result<(), CheckError> {
        let mut faults = Faults::default();
        self.check_lists(comm, &mut faults);
        if faults.count == 0 {
            // These checks index freely, which is safe only if the lists are consistent.
            self.check_entities(&mut faults);
            self.check_boundary(&mut faults);
        }
        comm.agree(faults.verdict())?;
        let mut faults = Faults::default();
        self.check_against_others(comm, &mut faults)?;
        self.check_totals(comm, &mut faults)?;
        comm.agree(faults.verdict())
    }

    /// Checks lengths, ranges and order of the lists.
    fn check_lists(&self, comm: &dyn Communicator, faults: &mut Faults) {
        faults.expect((self.rank, self.ranks) == (comm.rank(), comm.size()), || {
            format!(
                "the part is for rank {} of {}, not {} of {}",
                self.rank,
                self.ranks,
                comm.rank(),
                comm.size()
            )
        });
        let lengths = [
            ("vertex", self.points.len(), self.vertex_ids.len(), self.vertex_classes.len()),
            ("edge", self.edges.len(), self.edge_ids.len(), self.edge_classes.len()),
            ("face", self.faces.len(), self.face_ids.len(), self.face_classes.len()),
            ("tet", self.tets.len(), self.tet_ids.len(), self.tet_bodies.len()),
            ("tet", self.tets.len(), self.tet_edges.len(), self.tet_faces.len()),
        ];
        for (kind, things, a, b) in lengths {
            faults
                .expect(a == things && b == things, || format!("{kind} lists of lengths {things}, {a}, {b}"));
        }
        let ids = [
            ("vertex", &self.vertex_ids, self.totals.vertices),
            ("edge", &self.edge_ids, self.totals.edges),
            ("face", &self.face_ids, self.totals.faces),
            ("tet", &self.tet_ids, self.totals.tets),
        ];
        for (kind, ids, total) in ids {
            faults.expect(ids.is_sorted_by(|a, b| a < b), || format!("global {kind} ids do not ascend"));
            let last = ids.last().copied();
            faults.expect(last.is_none_or(|id| id < total), || format!("{kind} id {last:?} of {total}"));
        }
        for (t, tet) in self.tets.iter().enumerate() {
            let exist = tet.iter().all(|v| v.index() < self.points.len());
            faults.expect(exist, || format!("tet {t} has vertices {tet:?} of {}", self.points.len()));
        }
        check_shared("vertices", &self.shared_vertices, self.points.len(), self, faults);
        check_shared("edges", &self.shared_edges, self.edges.len(), self, faults);
        check_shared("faces", &self.shared_faces, self.faces.len(), self, faults);
    }

    /// Checks the orientation, the edges and faces of the tets, and that all vertices are used.
    fn check_entities(&self, faults: &mut Faults) {
        let mut used = vec![false; self.points.len()];
        for (tet, id) in self.tets.iter().zip(&self.tet_ids) {
            let [a, b, c, d] = tet.map(|v| &self.points[v.index()]);
            let sign = orient3d(a, b, c, d);
            faults.expect(sign == Sign::Positive, || format!("the orientation of tet {id} is {sign:?}"));
            tet.iter().for_each(|v| used[v.index()] = true);
        }
        for id in self.vertex_ids.iter().zip(used).filter(|(_, used)| !used).map(|(id, _)| id) {
            faults.add(|| format!("vertex {id} belongs to no tet of rank {}", self.rank));
        }
        let edges = topology::edges(self.points.len(), &self.tets);
        faults.expect(edges.edges == self.edges, || "the edges are not those of the tets".into());
        faults.expect(edges.tet_edges == self.tet_edges, || "tet_edges does not match the tets".into());
        let faces = topology::faces(self.points.len(), &self.tets);
        faults.expect(faces.faces == self.faces, || "the faces are not those of the tets".into());
        faults.expect(faces.tet_faces == self.tet_faces, || "tet_faces does not match the tets".into());
        for (tet, (edges, body)) in self.tet_edges.iter().zip(&self.tet_bodies).enumerate() {
            for (edge, ends) in edges.iter().zip(TET_EDGES) {
                let class = self.edge_classes[edge.index()];
                let fits = match class {
                    Class::Corner(_) => false,
                    Class::Curve(_) | Class::Patch(_) => true,
                    Class::Body(on) => on == *body,
                };
                faults.expect(fits, || {
                    let ends = ends.map(|i| self.vertex_ids[self.tets[tet][i].index()]);
                    format!("edge {ends:?} of a tet in {body:?} is classified on {class:?}")
                });
            }
        }
    }

    /// Checks that faces on patches are boundary triangles with the right parents, and that the
    /// others are interior or shared.
    fn check_boundary(&self, faults: &mut Faults) {
        let sides = match topology::face_tets(self.faces.len(), &self.tet_faces) {
            Ok(sides) => sides,
            Err(face) => {
                return faults.add(|| format!("face {} has three tets", self.face_ids[face.index()]));
            }
        };
        faults.expect(self.boundary.is_sorted_by_key(|b| b.face), || {
            "the boundary is not sorted by face".into()
        });
        let mut on_patch = vec![false; self.faces.len()];
        for triangle in &self.boundary {
            let face = triangle.face.index();
            let id = self.face_ids[face];
            faults.expect(!on_patch[face], || format!("face {id} is in the boundary twice"));
            on_patch[face] = true;
            let class = self.face_classes[face];
            faults.expect(class == Class::Patch(triangle.patch), || {
                format!("boundary face {id} of {:?} is classified on {class:?}", triangle.patch)
            });
            let mut parents: Vec<u32> = triangle.parents.iter().flatten().map(|tet| tet.0).collect();
            parents.sort_unstable();
            let mut beside = sides[face].to_vec();
            beside.retain(|&tet| tet != u32::MAX);
            faults.expect(parents == beside, || {
                format!("boundary face {id} has parents {parents:?}, not {beside:?}")
            });
        }
        self.check_sides(faults);
        for (face, on_patch) in on_patch.into_iter().enumerate() {
            let (id, class) = (self.face_ids[face], self.face_classes[face]);
            let is_inside = matches!(class, Class::Body(_));
            faults.expect(on_patch != is_inside, || {
                format!("face {id} is classified on {class:?}; listed in the boundary: {on_patch}")
            });
            let has_one_tet =
                sides[face][1] == u32::MAX && self.shared_faces.holders_of(face as u32).is_none();
            faults.expect(on_patch || !has_one_tet, || {
                format!("face {id} has one tet, is not shared and on no patch")
            });
        }
    }

    /// Checks that a patch separates the same two regions everywhere, and that each of its
    /// triangles has a tet behind it.
    fn check_sides(&self, faults: &mut Faults) {
        let mut sides_of_patch: BTreeMap<PatchId, [Option<BodyId>; 2]> = BTreeMap::new();
        for triangle in &self.boundary {
            let id = self.face_ids[triangle.face.index()];
            let shared = self.shared_faces.holders_of(triangle.face.0).is_some();
            faults.expect(shared || triangle.parents[0].is_some(), || {
                format!("boundary face {id} on {:?} has no tet behind it", triangle.patch)
            });
            let known = sides_of_patch.entry(triangle.patch).or_default();
            for (known, tet) in known.iter_mut().zip(triangle.parents) {
                let Some(tet) = tet else { continue };
                let body = self.tet_bodies[tet.index()];
                let before = *known.get_or_insert(body);
                faults.expect(before == body, || {
                    format!(
                        "boundary face {id} on {:?} is next to {body:?}, other triangles of the patch to {before:?}",
                        triangle.patch
                    )
                });
            }
        }
    }

    /// Checks that all holders agree on shared entities: each pair of ranks exchanges descriptions,
    /// which must be equal.
    fn check_against_others(&self, comm: &dyn Communicator, faults: &mut Faults) -> Result<(), CommError> {
        let mut messages = vec![Vec::new(); comm.size() as usize];
        self.describe_shared(|holders, description| {
            for &holder in holders.iter().filter(|&&holder| holder != self.rank) {
                messages[holder as usize].push(description.len() as u64);
                messages[holder as usize].extend_from_slice(description);
            }
        });
        let sent: Vec<(Rank, Vec<u64>)> =
            (0..).zip(messages).filter(|(_, message)| !message.is_empty()).collect();
        let received = comm.exchange(sent.clone())?;
        let ranks =
            |messages: &[(Rank, Vec<u64>)]| messages.iter().map(|(rank, _)| *rank).collect::<Vec<_>>();
        faults.expect(ranks(&sent) == ranks(&received), || {
            let (to, from) = (ranks(&sent), ranks(&received));
            format!(
                "rank {} shares entities with ranks {to:?}, but ranks {from:?} share entities with it",
                self.rank
            )
        });
        for (from, theirs) in &received {
            let Some((_, mine)) = sent.iter().find(|(to, _)| to == from) else { continue };
            for (mine, theirs) in
                descriptions(mine).zip(descriptions(theirs)).filter(|(mine, theirs)| mine != theirs)
            {
                faults.add(|| {
                    format!(
                        "ranks {} and {from} disagree on a shared entity: {mine:?} and {theirs:?}",
                        self.rank
                    )
                });
            }
            let (mine, theirs) = (descriptions(mine).count(), descriptions(theirs).count());
            faults.expect(mine == theirs, || {
                format!(
                    "rank {} shares {mine} entities with rank {from}, which shares {theirs} with it",
                    self.rank
                )
            });
        }
        Ok(())
    }

    /// Calls `visit` with the holders of each shared entity and the data that they must agree on.
    fn describe_shared(&self, mut visit: impl FnMut(&[Rank], &[u64])) {
        let global = |v: &VertexId| self.vertex_ids[v.index()];
        for (v, holders) in self.shared_vertices.iter() {
            let point = &self.points[v as usize];
            let data = point.iter().map(|x| x.to_bits());
            let words =
                description(0, self.vertex_ids[v as usize], self.vertex_classes[v as usize], holders, data);
            visit(holders, &words);
        }
        for (e, holders) in self.shared_edges.iter() {
            let data = self.edges[e as usize].iter().map(global);
            visit(
                holders,
                &description(1, self.edge_ids[e as usize], self.edge_classes[e as usize], holders, data),
            );
        }
        for (f, holders) in self.shared_faces.iter() {
            let found = self.boundary.binary_search_by_key(&f, |triangle| triangle.face.0);
            let side = found.map_or(0, |index| self.rank_behind(&self.boundary[index], holders));
            let data = self.faces[f as usize].iter().map(global).chain([side]);
            visit(
                holders,
                &description(2, self.face_ids[f as usize], self.face_classes[f as usize], holders, data),
            );
        }
    }

    /// Which of the two holders has the tet behind a boundary triangle: the first (1) or the second
    /// (2).
    fn rank_behind(&self, triangle: &BoundaryFace, holders: &[Rank]) -> u64 {
        let first = holders.first() == Some(&self.rank);
        if triangle.parents[0].is_some() == first { 1 } else { 2 }
    }

    /// Checks that each entity is owned by one rank and that the totals are right.
    fn check_totals(&self, comm: &dyn Communicator, faults: &mut Faults) -> Result<(), CommError> {
        let is_lowest_holder = |triangle: &&BoundaryFace| self.face_holders(triangle.face)[0] == self.rank;
        let sums = comm.all_reduce_sum_u64([
            self.owned(&self.vertex_ids, &self.shared_vertices),
            self.owned(&self.edge_ids, &self.shared_edges),
            self.owned(&self.face_ids, &self.shared_faces),
            self.tets.len() as u64,
            self.boundary.iter().filter(is_lowest_holder).count() as u64,
        ])?;
        let totals = &self.totals;
        let totals = [totals.vertices, totals.edges, totals.faces, totals.tets, totals.boundary];
        faults.expect(sums == totals, || {
            format!("vertices, edges, faces, tets and boundary triangles are {sums:?}, not {totals:?}")
        });
        Ok(())
    }
}

/// The data that holders must agree on, as numbers: kind of entity, global id, class, kind-specific
/// data, holders.
fn description(
    kind: u64,
    id: GlobalId,
    class: Class,
    holders: &[Rank],
    data: impl Iterator<Item = u64>,
) -> Vec<u64> {
    let [class_kind, class_id] = class.code();
    let mut words = vec![kind, id, u64::from(class_kind), u64::from(class_id)];
    words.extend(data);
    words.extend(holders.iter().map(|&rank| u64::from(rank)));
    words
}

/// Splits a message into descriptions; each is preceded by its length.
fn descriptions(mut message: &[u64]) -> impl Iterator<Item = &[u64]> {
    std::iter::from_fn(move || {
        let (&length, rest) = message.split_first()?;
        let (words, rest) = rest.split_at((length as usize).min(rest.len()));
        message = rest;
        Some(words)
    })
}

/// Checks a table of shared entities: ids and holders ascend, and the holders include this rank and
/// another.
fn check_shared(kind: &str, shared: &Shared, entities: usize, part: &DistMesh, faults: &mut Faults) {
    let offsets = &shared.offsets;
    let fits = if shared.ids.is_empty() {
        shared.holders.is_empty()
    } else {
        offsets.len() == shared.ids.len() + 1
            && offsets[0] == 0
            && offsets.is_sorted()
            && offsets.last().is_some_and(|&end| end as usize == shared.holders.len())
            && shared.ids.is_sorted_by(|a, b| a < b)
            && shared.ids.last().is_some_and(|&id| (id as usize) < entities)
    };
    faults.expect(fits, || format!("the table of shared {kind} is not well-formed"));
    if !fits {
        return;
    }
    for (id, holders) in shared.iter() {
        let fits = holders.len() > 1
            && holders.is_sorted_by(|a, b| a < b)
            && holders.contains(&part.rank)
            && holders.iter().all(|&rank| rank < part.ranks)
            && (kind != "faces" || holders.len() == 2);
        faults.expect(fits, || format!("local entity {id} of the shared {kind} has holders {holders:?}"));
    }
}
