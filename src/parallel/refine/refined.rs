//! The refined part: stored coordinates; tets, boundary and ids computed on demand.

use super::curved::steps;
use super::diagonal::TetDiagonals;
use super::lattice::{
    OCTAHEDRON, UPRIGHT, UPSIDE_DOWN, corner_place, for_each_face_child, octahedron_child_on_face,
};
use super::numbering::{Entity, Numbering, ascending};
use super::periodic::fine_images;
use super::rows::Rows;
use super::tet::{Inside, Lattices};
use crate::ground::mesh::periodic::{Link, PeriodicMap};
use crate::ground::mesh::stream::{
    BoundaryBlock, Counts, LocalBlock, MeshStream, NO_TET, SingularTags, TetBlock, VertexBlock,
};
use crate::ground::mesh::{Class, GlobalId, Order, Rank, TET_FACES, TetId};
use crate::parallel::distribution::{BoundaryFace, DistMesh};
use std::borrow::Cow;
use std::sync::Arc;

/// One rank's part of a refined mesh, made by [`refine`](super::refine()).
///
/// Tet blocks and boundary blocks correspond to the coarse tets and the coarse boundary triangles,
/// in their order. Vertex blocks are the coarse vertices, then edges, then faces, then tets.
#[derive(Clone)]
pub struct RefinedMesh {
    coarse: DistMesh,
    numbering: Numbering,
    inside: Inside,
    periodic: Arc<PeriodicMap>,
    singular: csg::Singular,
}

impl std::fmt::Debug for RefinedMesh {
    /// Prints sizes only: the coordinates can be gigabytes.
    fn fmt(&self, out: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let (rank, pieces, counts) = (self.rank(), self.pieces(), self.counts());
        out.debug_struct("RefinedMesh")
            .field("rank", &rank)
            .field("pieces", &pieces)
            .field("counts", &counts)
            .finish()
    }
}

impl RefinedMesh {
    pub(super) fn new(coarse: DistMesh, numbering: Numbering, inside: Inside) -> Self {
        Self { coarse, numbering, inside, periodic: Arc::default(), singular: csg::Singular::default() }
    }

    /// Adds the periodic pairs of the whole coarse mesh.
    pub fn with_periodic(mut self, map: PeriodicMap) -> Self {
        self.periodic = Arc::new(map);
        self
    }

    /// Adds the singular patches and corners for solvers.
    pub fn with_singular(self, singular: csg::Singular) -> Self {
        Self { singular, ..self }
    }

    /// The numbering of the fine vertices.
    pub fn numbering(&self) -> &Numbering {
        &self.numbering
    }

    /// The coarse mesh.
    pub fn coarse(&self) -> &DistMesh {
        &self.coarse
    }

    /// Subdivisions per coarse edge.
    pub fn pieces(&self) -> u32 {
        self.numbering.cells().n()
    }

    /// Bytes stored in addition to the coarse mesh.
    pub fn bytes(&self) -> u64 {
        let coordinates = size_of_val(&*self.inside.points) as u64;
        coordinates + (self.coarse.tets.len() * self.inside.diagonals.bytes_per_tet()) as u64
    }

    /// The number of fine tets of this part.
    pub fn tets(&self) -> u64 {
        self.coarse.tets.len() as u64 * u64::from(self.numbering.cells().children())
    }

    /// Appends the children of `tet` behind the fine triangles of its face opposite corner `face`,
    /// by index in the part.
    fn parents_on_face(&self, tet: TetId, face: usize, parents: &mut Vec<u64>) {
        let lattice = self.numbering.cells();
        let vertices = self.coarse.tets[tet.index()];
        let corners = ascending(TET_FACES[face], |corner| vertices[corner].0);
        let diagonals = self.inside.diagonals.of_tet(tet.0);
        let first = u64::from(tet.0) * u64::from(lattice.children());
        for_each_face_child(lattice.n(), |j, k, upright| {
            let child = if upright {
                lattice.upright_behind_face(corners, j, k)
            } else {
                let cell = lattice.octahedron_behind_face(corners, j, k);
                let diagonal = diagonals.get(lattice.octahedron_row(cell[1], cell[2]) + cell[0]);
                lattice.octahedron_child(cell) + octahedron_child_on_face(diagonal, face)
            };
            parents.push(first + u64::from(child));
        });
    }

    /// The local number of a boundary face in `tet`.
    fn face_of(&self, tet: TetId, boundary: &BoundaryFace) -> usize {
        let faces = &self.coarse.tet_faces[tet.index()];
        faces.iter().position(|f| *f == boundary.face).expect("a boundary face is a face of its parents")
    }
}

impl MeshStream for RefinedMesh {
    fn rank(&self) -> Rank {
        self.coarse.rank
    }

    fn ranks(&self) -> u32 {
        self.coarse.ranks
    }

    fn order(&self) -> Order {
        self.numbering.order()
    }

    fn counts(&self) -> Counts {
        let children = u64::from(self.numbering.cells().face_children());
        Counts {
            vertices: u64::from(self.numbering.vertices()),
            tets: self.tets(),
            boundary: self.coarse.boundary.len() as u64 * children,
        }
    }

    fn totals(&self) -> Counts {
        self.numbering.totals()
    }

    fn points(&self) -> &[[f64; 3]] {
        &self.inside.points
    }

    fn vertex_blocks(&self) -> usize {
        self.numbering.blocks()
    }

    fn vertex_block(&self, index: usize) -> VertexBlock<'_> {
        let entity = self.numbering.block(index);
        VertexBlock {
            local: self.numbering.inside(entity),
            first_id: self.numbering.first_id_in(&self.coarse, entity),
            holders: entity.holders(&self.coarse),
            on_boundary: !matches!(entity.class(&self.coarse), Class::Body(_)),
        }
    }

    fn vertex_id(&self, local: u32) -> GlobalId {
        let (entity, within) = self.numbering.locate(local);
        self.numbering.first_id_in(&self.coarse, entity) + u64::from(within)
    }

    fn tet_blocks(&self) -> usize {
        self.coarse.tets.len()
    }

    fn tet_block(&self, index: usize, block: &mut TetBlock) {
        let mut ids = Vec::new();
        self.numbering.lattice_ids(&self.coarse, TetId::new(index), &mut ids);
        self.children(index, block);
        block.tets.iter_mut().flatten().for_each(|corner| *corner = ids[*corner as usize]);
        block.edge_nodes.iter_mut().flatten().for_each(|node| *node = ids[*node as usize]);
    }

    fn local_block(&self, index: usize, block: &mut LocalBlock) {
        self.numbering.lattice_ids(&self.coarse, TetId::new(index), &mut block.vertices);
        self.children(index, &mut block.tets);
    }

    fn block_ids(&self, block: &LocalBlock, ids: &mut Vec<GlobalId>) {
        let children = u64::from(self.numbering.cells().children());
        let tet = (block.tets.first_local / children) as u32;
        let inside = self.numbering.inside(Entity { dimension: 3, id: tet });
        let first = self.numbering.first_id(3, self.coarse.tet_ids[tet as usize]);
        // Nearly all vertices are interior to the tet; locating any other id needs divisions.
        let id = |&vertex: &u32| match vertex.checked_sub(inside.start) {
            Some(within) => first + u64::from(within),
            None => self.vertex_id(vertex),
        };
        ids.clear();
        ids.extend(block.vertices.iter().map(id));
    }

    fn block_points(&self, block: &LocalBlock, points: &mut Vec<[f64; 3]>) {
        if !self.keeps_all() {
            let tet = block.tets.first_local / u64::from(self.numbering.cells().children());
            self.lattices().all(TetId(tet as u32), self.inside.flat[tet as usize], points);
            return;
        }
        points.clear();
        points.extend(block.vertices.iter().map(|&vertex| self.inside.points[vertex as usize]));
    }

    fn vertex_points(&self, index: usize) -> Cow<'_, [[f64; 3]]> {
        let entity = self.numbering.block(index);
        if entity.dimension == 3 && !self.keeps_all() {
            return self.lattices().inside(TetId(entity.id), self.inside.flat[entity.id as usize]).into();
        }
        let local = self.numbering.inside(entity);
        Cow::Borrowed(&self.inside.points[local.start as usize..local.end as usize])
    }

    fn boundary_blocks(&self) -> usize {
        self.coarse.boundary.len()
    }

    fn boundary_block(&self, index: usize, block: &mut BoundaryBlock) {
        let face = &self.coarse.boundary[index];
        let (tet, behind) = match face.parents {
            [Some(tet), _] => (tet, true),
            [None, Some(tet)] => (tet, false),
            [None, None] => panic!("boundary face {:?} has no tet in this part", face.face),
        };
        block.triangles.clear();
        block.edge_nodes.clear();
        let second = self.order() == Order::Second;
        self.numbering.for_each_triangle(&self.coarse, tet, self.face_of(tet, face), |corners, nodes| {
            let ([p, q, r], [pq, qr, rp]) = (corners, nodes);
            block.triangles.push(if behind { corners } else { [p, r, q] });
            if second {
                block.edge_nodes.push(if behind { nodes } else { [rp, qr, pq] });
            }
        });
        let mut parents = [Vec::new(), Vec::new()];
        for (parent, indices) in face.parents.iter().zip(&mut parents) {
            match *parent {
                Some(tet) => self.parents_on_face(tet, self.face_of(tet, face), indices),
                None => indices.resize(block.triangles.len(), NO_TET),
            }
        }
        let [behind, before] = parents;
        block.parents.clear();
        block.parents.extend(behind.into_iter().zip(before).map(|(p, q)| [p, q]));
        block.bodies = face.parents.map(|parent| Some(self.coarse.tet_bodies[parent?.index()]));
        block.patch = Some(face.patch);
    }

    fn links(&self) -> &[Link] {
        &self.periodic.links
    }

    fn images(&self, index: usize) -> Vec<(u32, GlobalId)> {
        fine_images(&self.periodic.pairs[index], &self.coarse, &self.numbering)
    }

    fn singular(&self) -> SingularTags {
        let factor = |class: &Class| match class {
            Class::Corner(corner) => {
                self.singular.corners.iter().find(|(id, _)| id == corner).map(|tag| tag.1)
            }
            _ => None,
        };
        let vertices =
            (0..).zip(&self.coarse.vertex_classes).filter_map(|(v, class)| Some((v, factor(class)?)));
        SingularTags {
            patches: self.singular.patches.clone(),
            vertices: if self.singular.corners.is_empty() { Vec::new() } else { vertices.collect() },
        }
    }

    fn masters(&self) -> Vec<(u32, GlobalId)> {
        fine_images(&self.periodic.origins, &self.coarse, &self.numbering)
    }
}

impl RefinedMesh {
    /// Whether all coordinates are stored, see [`Keep`](super::Keep).
    pub fn keeps_all(&self) -> bool {
        self.inside.points.len() == self.numbering.vertices() as usize
    }

    /// The diagonals of the octahedra of a coarse tet.
    pub(super) fn diagonals(&self, tet: TetId) -> TetDiagonals<'_> {
        self.inside.diagonals.of_tet(tet.0)
    }

    fn lattices(&self) -> Lattices<'_> {
        Lattices { mesh: &self.coarse, numbering: &self.numbering, points: &self.inside.points }
    }

    /// Fills `block` with the children of a coarse tet, by lattice points.
    fn children(&self, tet: usize, block: &mut TetBlock) {
        let cells = self.numbering.cells();
        let children = cells.children();
        let diagonals = self.inside.diagonals.of_tet(tet as u32);
        block.tets.clear();
        block.edge_nodes.clear();
        block.tets.reserve(children as usize);
        let order = self.order();
        let mut first = 0;
        for (c, d, count) in cells.rows() {
            let diagonal = |octahedron| diagonals.get(first + octahedron);
            match order {
                Order::First => {
                    push_row(self.numbering.cell_rows().around(c, d), count, &mut block.tets, diagonal);
                }
                Order::Second => push_nodes(self.numbering.rows(), [c, d, count], block, diagonal),
            }
            first += count - 1;
        }
        block.first_id = self.coarse.tet_ids[tet] * u64::from(children);
        block.first_local = tet as u64 * u64::from(children);
        block.body = Some(self.coarse.tet_bodies[tet]);
    }
}

/// Appends the ten-node children of a row of `count` cells (·, c, d), by points of the lattice of
/// nodes.
fn push_nodes(rows: &Rows, [c, d, count]: [u32; 3], block: &mut TetBlock, diagonal: impl Fn(u32) -> u8) {
    // The starts of the rows of nodes around the row of cells; those outside the tet are not used.
    let row = |i: u32, j: u32| {
        let (c, d) = (2 * c + i, 2 * d + j);
        if c + d <= rows.lattice().n() { rows.start(c, d) as u32 } else { 0 }
    };
    let around = [0, 1, 2].map(|j| [0, 1, 2].map(|i| row(i, j)));
    let places = |corners: [u8; 4]| {
        steps(corners).map(|[b, c, d]| around[usize::from(d)][usize::from(c)] + u32::from(b))
    };
    let mut push = |places: [u32; 10], cell: u32| {
        let [p, q, r, s, edges @ ..] = places.map(|place| place + 2 * cell);
        block.tets.push([p, q, r, s]);
        block.edge_nodes.push(edges);
    };
    let upright = places(UPRIGHT);
    (0..count).for_each(|cell| push(upright, cell));
    if count == 1 {
        return;
    }
    let octahedron = OCTAHEDRON.map(|children| children.map(places));
    for cell in 0..count - 1 {
        octahedron[usize::from(diagonal(cell))].iter().for_each(|child| push(*child, cell));
    }
    let upside_down = places(UPSIDE_DOWN);
    (0..count.saturating_sub(2)).for_each(|cell| push(upside_down, cell));
}

/// Appends the children of a row of cells, by lattice points.
fn push_row(rows: [usize; 4], cells: u32, tets: &mut Vec<[u32; 4]>, diagonal: impl Fn(u32) -> u8) {
    // By corner code.
    let mut places = [0; 8];
    for code in 0..8 {
        let (row, shift) = corner_place(code);
        places[usize::from(code)] = rows[row] as u32 + shift as u32;
    }
    // Written out because closures in `map` are not always inlined, and this is the innermost loop.
    let child = |[p, q, r, s]: [u8; 4], cell: u32| {
        let at = |code: u8| places[usize::from(code)] + cell;
        [at(p), at(q), at(r), at(s)]
    };
    tets.extend((0..cells).map(|cell| child(UPRIGHT, cell)));
    for cell in 0..cells - 1 {
        // With a constant for each diagonal, the codes become places in registers.
        let [p, q, r, s] = match diagonal(cell) {
            0 => OCTAHEDRON[0].map(|codes| child(codes, cell)),
            1 => OCTAHEDRON[1].map(|codes| child(codes, cell)),
            _ => OCTAHEDRON[2].map(|codes| child(codes, cell)),
        };
        tets.extend_from_slice(&[p, q, r, s]);
    }
    tets.extend((0..cells.saturating_sub(2)).map(|cell| child(UPSIDE_DOWN, cell)));
}
