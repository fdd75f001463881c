//! The parts that this rank reads, and the checks that need no other part.

use super::super::faults::{FaultKind, Faults, check_header};
use super::super::faults_nodes::{NodeTable, check_nodes_of};
use super::super::read::{ElmerPart, Layout, read_part};
use super::fault;
use super::ids::NewIds;
use crate::Point;
use crate::files::input::ReadError;
use crate::files::node_order::VTK;
use crate::ground::comm::Communicator;
use crate::ground::kernel::predicates::{Sign, orient3d};
use crate::ground::mesh::stream::Counts;
use crate::ground::mesh::{Class, EDGE_BETWEEN, GlobalId, Rank, TET_EDGES, VertexId};
use crate::parallel::distribution::{BareMesh, Shared};
use csg::BodyId;
use rayon::prelude::*;

/// One part with its tables sorted by id.
pub(super) struct OwnPart {
    pub files: ElmerPart,
    pub nodes: NodeTable,
    /// For each node in order of ids, the index of its line in `.shared`.
    pub shared: Vec<Option<u32>>,
    /// Indices of elements by ascending id.
    pub elements: Vec<u32>,
}

/// The parts of this rank, consecutive.
pub(super) struct OwnParts {
    /// Number of the first one, from 0.
    first: Rank,
    pub list: Vec<OwnPart>,
    /// Number of parts of the whole mesh.
    pub parts: u32,
}

/// A tet by its position in the files.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub(super) struct TetPlace {
    /// Index of the part among those of this rank.
    pub part: u32,
    /// Index in `.elements`.
    pub place: u32,
}

/// The parts of a rank merged.
pub(super) struct Assembled {
    /// The element-only part, not yet classified on patches.
    pub bare: BareMesh,
    /// Origin of each tet.
    pub of_tet: Vec<TetPlace>,
    /// The vertex of each node, by part and index in `.nodes`.
    pub local: Vec<Vec<VertexId>>,
    /// Number of tets whose orientation was reversed.
    pub turned: u64,
}

/// The rank that reads a part.
pub(super) fn reader(part: u32, parts: u32, ranks: u32) -> Rank {
    (u64::from(part) * u64::from(ranks) / u64::from(parts)) as Rank
}

impl OwnParts {
    /// *Local.* Reads and checks the parts assigned to this rank.
    pub fn read(comm: &dyn Communicator, layout: &Layout) -> Result<Self, ReadError> {
        let parts = match layout {
            Layout::Serial(_) => 1,
            Layout::Partitioned { parts, .. } => *parts,
        };
        let mine: Vec<u32> =
            (0..parts).filter(|&part| reader(part, parts, comm.size()) == comm.rank()).collect();
        let read = |&part: &u32| {
            let files = match layout {
                Layout::Serial(folder) => read_part(folder.join("mesh"), false)?,
                Layout::Partitioned { folder, .. } => {
                    read_part(folder.join(format!("part.{}", part + 1)), true)?
                }
            };
            OwnPart::new(files, part + 1)
        };
        let list: Vec<Result<OwnPart, ReadError>> = mine.par_iter().map(read).collect();
        let list = list.into_iter().collect::<Result<_, _>>()?;
        Ok(Self { first: mine.first().copied().unwrap_or(0), list, parts })
    }

    /// The files of the parts.
    pub fn files(&self) -> impl Iterator<Item = &ElmerPart> {
        self.list.iter().map(|part| &part.files)
    }

    /// The number of a part of this rank, from 0 in the whole mesh.
    pub fn number(&self, part: u32) -> Rank {
        self.first + part
    }

    /// *Local.* Merges the parts into one, in order of the new ids.
    pub fn assemble(
        &self,
        comm: &dyn Communicator,
        ids: NewIds,
        bodies: &[u32],
    ) -> Result<Assembled, ReadError> {
        let (local, vertices) = self.number_vertices(&ids.nodes);
        let mut of_tet: Vec<(GlobalId, TetPlace)> = Vec::new();
        for (part, ids) in (0..).zip(&ids.elements) {
            of_tet.extend((0..).zip(ids).map(|(place, &id)| (id, TetPlace { part, place })));
        }
        of_tet.par_sort_unstable();
        let point = |&(_, TetPlace { part, place }): &(GlobalId, TetPlace)| {
            self.list[part as usize].files.nodes[place as usize].point
        };
        let points: Vec<Point> = vertices.iter().map(point).collect();
        let tet = |&(_, at): &(GlobalId, TetPlace)| self.positive(at, &local, &points);
        let (mut positive, mut signs) = (Vec::new(), Vec::new());
        of_tet.par_iter().map(tet).unzip_into_vecs(&mut positive, &mut signs);
        if let Some(flat) = signs.par_iter().position_first(|sign| *sign == Sign::Zero) {
            let at = of_tet[flat].1;
            let what = format!("element {} is flat", self.element(at).id);
            return Err(self.element_fault(FaultKind::Inverted, at, what));
        }
        let turned = signs.iter().filter(|sign| **sign == Sign::Negative).count() as u64;
        let edge_nodes = self.edge_nodes(&of_tet, &local, &positive)?;
        let mut shared = Shared::default();
        for (id, holders) in ids.holders {
            let v = vertices.binary_search_by_key(&id, |(id, _)| *id).expect("a node of this rank");
            shared.push(v as u32, holders);
        }
        let body = |&(_, at): &(GlobalId, TetPlace)| {
            let body = bodies.binary_search(&self.element(at).body).expect("all bodies are listed");
            BodyId(body as u32)
        };
        let [all_vertices, all_tets] = ids.totals;
        let bare = BareMesh {
            rank: comm.rank(),
            ranks: comm.size(),
            totals: Counts { vertices: all_vertices, tets: all_tets, boundary: 0 },
            points: points.into_iter().map(|p| p.into()).collect(),
            vertex_ids: vertices.iter().map(|(id, _)| *id).collect(),
            vertex_classes: vec![Class::Body(BodyId(0)); vertices.len()],
            shared,
            tets: positive,
            edge_nodes,
            tet_ids: of_tet.iter().map(|(id, _)| *id).collect(),
            tet_bodies: of_tet.iter().map(body).collect(),
            ..BareMesh::default()
        };
        Ok(Assembled { bare, of_tet: of_tet.into_iter().map(|(_, at)| at).collect(), local, turned })
    }

    /// The nodes on the edges of the tets; none if the elements are of first order.
    fn edge_nodes(
        &self,
        of_tet: &[(GlobalId, TetPlace)],
        local: &[Vec<VertexId>],
        tets: &[[VertexId; 4]],
    ) -> Result<Vec<[VertexId; 6]>, ReadError> {
        let is_second = |at: TetPlace| self.element(at).edge_nodes.is_some();
        let Some(&(_, first)) = of_tet.first() else { return Ok(Vec::new()) };
        if let Some(&(_, at)) = of_tet.iter().find(|(_, at)| is_second(*at) != is_second(first)) {
            let what = format!(
                "element {} is not of the order of element {}",
                self.element(at).id,
                self.element(first).id
            );
            return Err(self.element_fault(FaultKind::EdgeNodesDiffer, at, what));
        }
        let of = |(&(_, at), tet): (&(GlobalId, TetPlace), &[VertexId; 4])| {
            let (element, part) = (self.element(at), at.part as usize);
            let vertex = |id: u32| local[part][self.list[part].nodes.find(id).expect("checked before")];
            let corners = element.nodes.map(vertex);
            let place = |v: VertexId| tet.iter().position(|corner| *corner == v).expect("the same corners");
            let mut nodes = [VertexId(0); 6];
            for (edge, node) in VTK.into_iter().zip(element.edge_nodes?) {
                let [p, q] = TET_EDGES[edge].map(|corner| place(corners[corner]));
                nodes[EDGE_BETWEEN[p][q]] = vertex(node);
            }
            Some(nodes)
        };
        Ok(of_tet.iter().zip(tets).filter_map(of).collect())
    }

    /// The element at a position in the files.
    pub fn element(&self, at: TetPlace) -> &super::super::Element {
        &self.list[at.part as usize].files.elements[at.place as usize]
    }

    /// An error located at an element.
    pub fn element_fault(&self, kind: FaultKind, at: TetPlace, what: String) -> ReadError {
        let files = &self.list[at.part as usize].files;
        fault(kind, files.file("elements"), files.elements.line(at.place as usize), what)
    }

    /// Returns the vertex of each node, by part and index, and for each vertex in order of ids one
    /// of its nodes. Nodes used by halo elements only have no vertex.
    fn number_vertices(&self, ids: &[Vec<GlobalId>]) -> (Vec<Vec<VertexId>>, Vec<(GlobalId, TetPlace)>) {
        let mut nodes: Vec<(GlobalId, TetPlace)> = Vec::new();
        for (part, ids) in (0..).zip(ids) {
            let held = |place: &u32| self.list[part as usize].nodes.contains(*place as usize);
            let places = (0..).zip(ids).filter(|(place, _)| held(place));
            nodes.extend(places.map(|(place, &id)| (id, TetPlace { part, place })));
        }
        nodes.par_sort_unstable();
        let mut local: Vec<Vec<VertexId>> = ids.iter().map(|ids| vec![VertexId(0); ids.len()]).collect();
        for (count, copies) in nodes.chunk_by(|a, b| a.0 == b.0).enumerate() {
            for (_, TetPlace { part, place }) in copies {
                local[*part as usize][*place as usize] = VertexId::new(count);
            }
        }
        nodes.dedup_by_key(|(id, _)| *id);
        (local, nodes)
    }

    /// The vertices of an element in positive orientation, and its orientation in the file.
    fn positive(&self, at: TetPlace, local: &[Vec<VertexId>], points: &[Point]) -> ([VertexId; 4], Sign) {
        let element = self.element(at);
        let part = at.part as usize;
        let vertex = |id: u32| local[part][self.list[part].nodes.find(id).expect("checked before")];
        let [a, b, c, d] = element.nodes.map(vertex);
        let [p, q, r, s] = [a, b, c, d].map(|v| &points[v.index()]);
        match orient3d(p, q, r, s) {
            Sign::Negative => ([a, b, d, c], Sign::Negative),
            sign => ([a, b, c, d], sign),
        }
    }
}

impl OwnPart {
    /// Checks the files of the part with this number, from 1.
    fn new(files: ElmerPart, number: u32) -> Result<Self, ReadError> {
        let mut faults = Faults::default();
        check_header(&files, &mut faults);
        let nodes = check_nodes_of(&files, &mut faults);
        // Parts may be empty here: the program that wrote them may have had idle ranks.
        faults.first.retain(|fault| fault.kind != FaultKind::EmptyPart);
        if let Some(first) = faults.first.into_iter().next() {
            let line = first.line.max(1);
            let message = format!("{}: {}", first.kind, first.what);
            return Err(ReadError::line(first.file, line, message));
        }
        let elements = sorted_elements(&files)?;
        let shared = shared_lines(&files, &nodes, number)?;
        Ok(Self { files, nodes, shared, elements })
    }

    /// Whether the part has an element with this id.
    pub fn has_element(&self, id: u32) -> bool {
        let elements = &self.files.elements;
        self.elements.binary_search_by_key(&id, |&place| elements[place as usize].id).is_ok()
    }
}

/// Indices of elements by ascending id.
fn sorted_elements(files: &ElmerPart) -> Result<Vec<u32>, ReadError> {
    let id = |place: &u32| files.elements[*place as usize].id;
    let mut places: Vec<u32> = (0..files.elements.len() as u32).collect();
    places.sort_by_key(id);
    match places.windows(2).find(|pair| id(&pair[0]) == id(&pair[1])) {
        None => Ok(places),
        Some(pair) => {
            let [before, line] = [pair[0], pair[1]].map(|place| files.elements.line(place as usize));
            let what = format!("element {} is on line {before} too", id(&pair[1]));
            Err(fault(FaultKind::ElementTwice, files.file("elements"), line, what))
        }
    }
}

/// For each node by ascending id, its line in `.shared`. Each line must belong to a node of the
/// part and list the part.
fn shared_lines(files: &ElmerPart, nodes: &NodeTable, number: u32) -> Result<Vec<Option<u32>>, ReadError> {
    let wrong =
        |line: usize, what: String| Err(fault(FaultKind::WrongHolders, files.file("shared"), line + 1, what));
    let mut by_place = vec![None; files.nodes.len()];
    for (line, shared) in files.shared.iter().enumerate() {
        let Some(place) = nodes.find(shared.id) else {
            return wrong(line, format!("node {} is not in this part", shared.id));
        };
        if let Some(before) = by_place[place].replace(line as u32) {
            return wrong(line, format!("node {} is on line {} too", shared.id, before + 1));
        }
        if !shared.parts.contains(&number) {
            return wrong(
                line,
                format!("node {} is listed in parts {:?}, not in this one", shared.id, shared.parts),
            );
        }
    }
    Ok(nodes.sorted().iter().map(|(_, place)| by_place[*place as usize]).collect())
}
