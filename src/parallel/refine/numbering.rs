//! Local and global ids of fine vertices, computed from the ids of the coarse entities that contain
//! them.
//!
//! ```text
//!     local and global alike:
//!     | coarse vertices | n−1 for each edge | C(n−1,2) for each face | C(n−1,3) for each tet |
//! ```
//! n is the number of subdivisions per edge; for second order, whose nodes include the middles of
//! the edges of all tets, it is twice that: nodes have the ids of the vertices of the next level.
//!
//! Points in an edge or face are numbered by the ascending global ids of its vertices, points in a
//! tet by the order of its vertices. So all ranks that share an entity agree without messages.

use super::lattice::{Lattice, for_each_face_child};
use super::rows::Rows;
use super::{RefineError, possible_pieces};
use crate::ground::kernel::simplex::from_lowest;
use crate::ground::mesh::stream::Counts;
use crate::ground::mesh::{
    Class, EDGE_BETWEEN, EdgeId, FaceId, GlobalId, Order, Rank, TET_EDGES, TET_FACES, TRIANGLE_EDGES, TetId,
};
use crate::parallel::distribution::{DistMesh, Totals};
use std::ops::Range;
use std::sync::Arc;

/// One dimension of coarse entities, and the number of fine vertices interior to each.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
struct Kind {
    /// The number of coarse entities in this part.
    count: u32,
    /// The number of fine vertices interior to each.
    size: u32,
    /// Local id of the first vertex of the first entity in this part.
    local: u32,
    /// Global id of the first vertex of the first entity of the whole mesh.
    global: GlobalId,
}

/// The numbering of the fine vertices of one part.
#[derive(Clone, Debug)]
pub struct Numbering {
    /// The lattice of the tets.
    cells: Arc<Rows>,
    /// The lattice of the vertices: finer for second order.
    lattice: Arc<Rows>,
    /// By dimension: vertices, edges, faces, tets.
    kinds: [Kind; 4],
    /// The number of local vertices.
    vertices: u32,
    /// Counts of the whole fine mesh.
    totals: Counts,
}

/// A coarse entity, by dimension and local id.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Entity {
    /// 0 for a vertex, 1 for an edge, 2 for a face, 3 for a tet.
    pub dimension: usize,
    /// Local id.
    pub id: u32,
}

impl Entity {
    /// The geometric entity it is classified on.
    pub fn class(self, mesh: &DistMesh) -> Class {
        let id = self.id as usize;
        match self.dimension {
            0 => mesh.vertex_classes[id],
            1 => mesh.edge_classes[id],
            2 => mesh.face_classes[id],
            _ => Class::Body(mesh.tet_bodies[id]),
        }
    }

    /// Its global id among the entities of its dimension.
    pub fn global_id(self, mesh: &DistMesh) -> GlobalId {
        let ids = match self.dimension {
            0 => &mesh.vertex_ids,
            1 => &mesh.edge_ids,
            2 => &mesh.face_ids,
            _ => &mesh.tet_ids,
        };
        ids[self.id as usize]
    }

    /// The ranks that share it; empty if only this rank has it.
    pub fn holders(self, mesh: &DistMesh) -> &[Rank] {
        let shared = match self.dimension {
            0 => &mesh.shared_vertices,
            1 => &mesh.shared_edges,
            2 => &mesh.shared_faces,
            _ => return &[],
        };
        shared.holders_of(self.id).unwrap_or_default()
    }
}

/// Counts of the whole fine mesh, from those of the coarse mesh, with `n` subdivisions per edge.
///
/// # Panics
/// If no lattice has so many.
pub fn fine_totals(coarse: &Totals, n: u32, order: Order) -> Counts {
    let [cells, lattice] = [n, n * order.degree()].map(Lattice::new);
    let counts = [coarse.vertices, coarse.edges, coarse.faces, coarse.tets];
    Counts {
        vertices: counts
            .into_iter()
            .zip(lattice.points_inside())
            .map(|(count, size)| count * u64::from(size))
            .sum(),
        tets: coarse.tets * u64::from(cells.children()),
        boundary: coarse.boundary * u64::from(cells.face_children()),
    }
}

impl Numbering {
    /// Numbers the fine vertices for `n` subdivisions per edge.
    ///
    /// # Errors
    /// [`RefineError::Pieces`] if n is out of range, [`RefineError::TooManyVertices`] if local ids
    /// exceed `u32`.
    pub fn new(mesh: &DistMesh, n: u32, order: Order) -> Result<Self, RefineError> {
        let cells = Lattice::new(possible_pieces(n, order)?);
        let lattice = Lattice::new(n * order.degree());
        let sizes = lattice.points_inside();
        let counts = [mesh.points.len(), mesh.edges.len(), mesh.faces.len(), mesh.tets.len()];
        let all = [mesh.totals.vertices, mesh.totals.edges, mesh.totals.faces, mesh.totals.tets];
        let needed: u128 = counts.iter().zip(sizes).map(|(&c, s)| c as u128 * u128::from(s)).sum();
        if needed > u128::from(u32::MAX) {
            return Err(RefineError::TooManyVertices { rank: mesh.rank, needed });
        }
        let (mut local, mut global) = (0, 0);
        let kinds = [0, 1, 2, 3].map(|dimension| {
            let kind = Kind { count: counts[dimension] as u32, size: sizes[dimension], local, global };
            local += kind.count * kind.size;
            global += all[dimension] * u64::from(kind.size);
            kind
        });
        let [cells, lattice] = [cells, lattice].map(|lattice| Arc::new(Rows::new(lattice)));
        Ok(Self { cells, lattice, kinds, vertices: local, totals: fine_totals(&mesh.totals, n, order) })
    }

    /// The lattice of the tets.
    pub fn cells(&self) -> Lattice {
        self.cells.lattice()
    }

    /// The rows of points of the lattice of the tets.
    pub(super) fn cell_rows(&self) -> &Rows {
        &self.cells
    }

    /// The order of the elements.
    pub fn order(&self) -> Order {
        if self.cells() == self.lattice() { Order::First } else { Order::Second }
    }

    /// The lattice of the vertices.
    pub fn lattice(&self) -> Lattice {
        self.lattice.lattice()
    }

    /// The rows of points of the lattice of the vertices.
    pub(super) fn rows(&self) -> &Rows {
        &self.lattice
    }

    /// The number of fine vertices of this part.
    pub fn vertices(&self) -> u32 {
        self.vertices
    }

    /// Counts of the whole fine mesh.
    pub fn totals(&self) -> Counts {
        self.totals
    }

    /// Local ids of the first vertex interior to an edge, a face, a tet: the starts of their
    /// ranges.
    pub fn bases(&self) -> [usize; 3] {
        [1, 2, 3].map(|dimension| self.kinds[dimension].local as usize)
    }

    /// The number of blocks: one for each coarse entity that has interior fine vertices.
    pub fn blocks(&self) -> usize {
        self.kinds.iter().filter(|k| k.size > 0).map(|k| k.count as usize).sum()
    }

    /// The coarse entity of a block.
    pub fn block(&self, mut index: usize) -> Entity {
        for (dimension, kind) in self.kinds.iter().enumerate().filter(|(_, k)| k.size > 0) {
            match index.checked_sub(kind.count as usize) {
                Some(rest) => index = rest,
                None => return Entity { dimension, id: index as u32 },
            }
        }
        panic!("vertex block out of range: there are {}", self.blocks());
    }

    /// Local ids of the vertices interior to a coarse entity.
    pub fn inside(&self, entity: Entity) -> Range<u32> {
        let kind = self.kinds[entity.dimension];
        let first = kind.local + entity.id * kind.size;
        first..first + kind.size
    }

    /// Global id of the first vertex interior to the coarse entity with this dimension and global
    /// id.
    pub fn first_id(&self, dimension: usize, id: GlobalId) -> GlobalId {
        let kind = self.kinds[dimension];
        kind.global + id * u64::from(kind.size)
    }

    /// Global id of the first vertex interior to a coarse entity of this part.
    pub fn first_id_in(&self, mesh: &DistMesh, entity: Entity) -> GlobalId {
        self.first_id(entity.dimension, entity.global_id(mesh))
    }

    /// The coarse entity that contains a fine vertex, and the vertex's index among its interior
    /// vertices.
    #[inline]
    pub fn locate(&self, local: u32) -> (Entity, u32) {
        // Dimensions without interior vertices start at the end of the local ids, so no vertex
        // reaches them.
        let [_, edge, face, tet] = &self.kinds;
        let dimension = usize::from(local >= edge.local)
            + usize::from(local >= face.local)
            + usize::from(local >= tet.local);
        let kind = self.kinds[dimension];
        let offset = local - kind.local;
        (Entity { dimension, id: offset / kind.size }, offset % kind.size)
    }

    /// The coarse entity of this part that contains the fine vertex with this global id, and the
    /// vertex's index among its interior vertices.
    pub fn find(&self, mesh: &DistMesh, id: GlobalId) -> Option<(Entity, u32)> {
        let ids = [&mesh.vertex_ids, &mesh.edge_ids, &mesh.face_ids, &mesh.tet_ids];
        let has = |dimension: &usize| self.kinds[*dimension].size > 0 && self.kinds[*dimension].global <= id;
        let dimension = (0..4).rev().find(has)?;
        let Kind { size, global, .. } = self.kinds[dimension];
        let (of, within) = ((id - global) / u64::from(size), (id - global) % u64::from(size));
        let local = ids[dimension].binary_search(&of).ok()?;
        Some((Entity { dimension, id: local as u32 }, within as u32))
    }

    /// Local ids of all lattice points of a face, by j + (n + 1)·k.
    pub fn ids_of_face(&self, mesh: &DistMesh, face: u32) -> Option<Vec<u32>> {
        let has = |faces: &[FaceId; 4]| faces.iter().position(|f| f.0 == face);
        let (tet, place) =
            mesh.tet_faces.iter().enumerate().find_map(|(tet, faces)| Some((tet, has(faces)?)))?;
        let vertices = mesh.tets[tet];
        let corners = ascending(TET_FACES[place], |corner| vertices[corner].0);
        Some(self.face_ids(mesh, TetId::new(tet), corners))
    }

    /// Local ids of all lattice points of a tet, in the order of [`Lattice`].
    pub fn lattice_ids(&self, mesh: &DistMesh, tet: TetId, ids: &mut Vec<u32>) {
        let (rows, lattice) = (self.rows(), self.lattice());
        let n = lattice.n();
        let corners = mesh.tets[tet.index()];
        ids.clear();
        ids.resize(lattice.points() as usize, 0);
        for (corner, at) in [[0, 0, 0], [n, 0, 0], [0, n, 0], [0, 0, n]].into_iter().enumerate() {
            ids[rows.index(at)] = corners[corner].0;
        }
        if n == 1 {
            return;
        }
        for (edge, id) in TET_EDGES.into_iter().zip(mesh.tet_edges[tet.index()]) {
            let edge = ascending(edge, |corner| corners[corner].0);
            let inside = self.inside(Entity { dimension: 1, id: id.0 });
            for (vertex, k) in inside.zip(1..) {
                ids[rows.on_edge(edge, k)] = vertex;
            }
        }
        for (face, id) in TET_FACES.into_iter().zip(mesh.tet_faces[tet.index()]) {
            let face = ascending(face, |corner| corners[corner].0);
            let inside = self.inside(Entity { dimension: 2, id: id.0 });
            for (vertex, (j, k)) in inside.zip(lattice.face_interior()) {
                ids[rows.on_face(face, j, k)] = vertex;
            }
        }
        let mut next = self.inside(Entity { dimension: 3, id: tet.0 }).start;
        for (first, count) in lattice.interior_rows() {
            for (id, vertex) in ids[first as usize..][..count as usize].iter_mut().zip(next..) {
                *id = vertex;
            }
            next += count;
        }
    }

    /// Local ids of all lattice points of a face of a tet, by j + (n + 1)·k. `corners` are the
    /// local numbers of the face's vertices in the tet, by ascending vertex.
    pub fn face_ids(&self, mesh: &DistMesh, tet: TetId, corners: [usize; 3]) -> Vec<u32> {
        let n = self.lattice().n();
        let vertices = mesh.tets[tet.index()];
        let at = |j: u32, k: u32| (j + (n + 1) * k) as usize;
        let mut ids = vec![u32::MAX; at(n, n) + 1];
        for (corner, (j, k)) in corners.into_iter().zip([(0, 0), (n, 0), (0, n)]) {
            ids[at(j, k)] = vertices[corner].0;
        }
        if n == 1 {
            return ids;
        }
        // Both corners of each pair ascend, so the edge has the direction of its numbering.
        for pair in [[0, 1], [0, 2], [1, 2]] {
            let edge = edge_between(mesh, tet, pair.map(|p| corners[p]));
            for (vertex, k) in self.inside(Entity { dimension: 1, id: edge.0 }).zip(1..) {
                let place = match pair {
                    [0, 1] => at(k, 0),
                    [0, _] => at(0, k),
                    _ => at(n - k, k),
                };
                ids[place] = vertex;
            }
        }
        let opposite = 6 - corners.iter().sum::<usize>();
        let face = mesh.tet_faces[tet.index()][opposite];
        let inside = self.inside(Entity { dimension: 2, id: face.0 });
        for (vertex, (j, k)) in inside.zip(self.lattice().face_interior()) {
            ids[at(j, k)] = vertex;
        }
        ids
    }

    /// Calls `each` with the fine triangles of the face opposite corner `face`, by local ids,
    /// oriented outward from the tet, and with the nodes on their edges in the order of
    /// [`TRIANGLE_EDGES`](crate::ground::mesh::TRIANGLE_EDGES); for first order with the corners
    /// again, which mean nothing.
    pub fn for_each_triangle(
        &self,
        mesh: &DistMesh,
        tet: TetId,
        face: usize,
        mut each: impl FnMut([u32; 3], [u32; 3]),
    ) {
        let (n, degree) = (self.lattice().n(), self.order().degree());
        let vertices = mesh.tets[tet.index()];
        let corners = ascending(TET_FACES[face], |corner| vertices[corner].0);
        let is_outward = from_lowest(corners) == from_lowest(TET_FACES[face]);
        let ids = self.face_ids(mesh, tet, corners);
        for_each_face_child(self.cells().n(), |j, k, upright| {
            let [p, q, r] = if upright {
                [[j, k], [j + 1, k], [j, k + 1]]
            } else {
                [[j + 1, k], [j + 1, k + 1], [j, k + 1]]
            };
            let corners = if is_outward { [p, q, r] } else { [p, r, q] };
            let at = |[j, k]: [u32; 2]| ids[(j + (n + 1) * k) as usize];
            let middle = |[p, q]: [usize; 2]| {
                let [p, q] = [corners[p], corners[q]];
                at([0, 1].map(|x| (p[x] + q[x]) * degree / 2))
            };
            each(corners.map(|corner| at(corner.map(|x| x * degree))), TRIANGLE_EDGES.map(middle));
        });
    }

    /// The subdivisions of the coarse edges that are classified on curves and patches: local ids
    /// and class.
    pub fn classified_edges<'a>(
        &'a self,
        mesh: &'a DistMesh,
    ) -> impl Iterator<Item = ([u32; 2], Class)> + 'a {
        let edges = (0..).zip(&mesh.edges).zip(&mesh.edge_classes);
        edges.filter(|(_, class)| !matches!(class, Class::Body(_))).flat_map(|((id, ends), class)| {
            let inside = self.inside(Entity { dimension: 1, id });
            // Of second order every second vertex is the node on an edge.
            let step = self.order().degree() as usize;
            let starts = std::iter::once(ends[0].0).chain(inside.clone()).step_by(step);
            let ends = inside.chain([ends[1].0]).skip(step - 1).step_by(step);
            starts.zip(ends).map(|(from, to)| ([from, to], *class))
        })
    }
}

/// The edge of a tet between two of its corners.
fn edge_between(mesh: &DistMesh, tet: TetId, [p, q]: [usize; 2]) -> EdgeId {
    mesh.tet_edges[tet.index()][EDGE_BETWEEN[p][q]]
}

/// Corners of a tet by ascending key.
pub fn ascending<const N: usize>(mut corners: [usize; N], key: impl Fn(usize) -> u32) -> [usize; N] {
    corners.sort_unstable_by_key(|&corner| key(corner));
    corners
}
