//! Reading Elmer's files: the whole mesh, unchanged.

use super::parse::{Fields, expect_readable_by_elmer, for_each_line, read_lines, room};
use super::{MAX_LINE, TET, TET_10, TRIANGLE, TRIANGLE_6};
use crate::Point;
use crate::files::input::ReadError;
use crate::files::output::with_ending;
use rayon::prelude::*;
use std::collections::BTreeMap;
use std::fs;
use std::ops::Deref;
use std::path::{Path, PathBuf};

/// Points and two-node edges, which ElmerGrid lists among the boundary elements; they bound no tet.
const POINTS_AND_EDGES: [u32; 4] = [101, 102, 202, 203];

/// An element shape: its codes of first and second order.
struct Kind {
    first: u32,
    second: u32,
}

const TETS: Kind = Kind { first: TET, second: TET_10 };
const TRIANGLES: Kind = Kind { first: TRIANGLE, second: TRIANGLE_6 };

impl Kind {
    /// Reads the nodes on edges that follow the corners of an element with this code.
    fn edge_nodes<const N: usize>(&self, code: u32, fields: &mut Fields) -> Result<Option<[u32; N]>, String> {
        if code == self.second { ids(fields, "node").map(Some) } else { Ok(None) }
    }

    /// Refuses other codes.
    fn expect(&self, code: u32) -> Result<(), String> {
        if code == self.first || code == self.second {
            return Ok(());
        }
        Err(format!("the element type is '{code}'; only {} and {} are read here", self.first, self.second))
    }
}

/// Location of a mesh.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum Layout {
    /// `FOLDER/mesh.*`
    Serial(PathBuf),
    /// `FOLDER/part.1.*` to `FOLDER/part.N.*`
    Partitioned {
        /// The folder `partitioning.N`.
        folder: PathBuf,
        /// N, counted from the files.
        parts: u32,
    },
}

impl Layout {
    /// The folder that contains the files.
    pub fn folder(&self) -> &Path {
        match self {
            Self::Serial(folder) | Self::Partitioned { folder, .. } => folder,
        }
    }
}

/// A mesh as its files describe it.
#[derive(Clone, Debug)]
pub struct ElmerMesh {
    /// Location of the files.
    pub layout: Layout,
    /// The parts in order; a serial mesh has one.
    pub parts: Vec<ElmerPart>,
}

/// Values of a file with their line numbers, because some lines may hold other kinds of values.
#[derive(Clone, Debug)]
pub struct Rows<T> {
    values: Vec<T>,
    /// Line numbers from 1; empty if the value with index k is on line k + 1.
    lines: Vec<u32>,
}

impl<T> Default for Rows<T> {
    fn default() -> Self {
        Self { values: Vec::new(), lines: Vec::new() }
    }
}

impl<T> Rows<T> {
    /// The line number of the value at `index`, from 1.
    pub fn line(&self, index: usize) -> usize {
        self.lines.get(index).map_or(index + 1, |&line| line as usize)
    }
}

impl<T> Deref for Rows<T> {
    type Target = [T];

    fn deref(&self) -> &[T] {
        &self.values
    }
}

impl<'a, T> IntoIterator for &'a Rows<T> {
    type Item = &'a T;
    type IntoIter = std::slice::Iter<'a, T>;

    fn into_iter(self) -> Self::IntoIter {
        self.values.iter()
    }
}

/// The files of one part. The value with index k is on line k + 1 of its file, unless its [`Rows`]
/// say otherwise.
#[derive(Clone, Debug)]
pub struct ElmerPart {
    /// The common prefix of the files: `DIR/mesh` or `DIR/partitioning.N/part.K`.
    pub stem: PathBuf,
    /// `.header`
    pub header: Header,
    /// `.nodes`
    pub nodes: Vec<Node>,
    /// The part's own elements in `.elements`.
    pub elements: Rows<Element>,
    /// The halo elements in `.elements`, which belong to other parts, with their owner's number
    /// from 1.
    pub halo: Halo,
    /// The triangles in `.boundary` beside the part's own elements.
    pub boundary: Rows<BoundaryElement>,
    /// Skipped lines of `.boundary` by element code: points, edges, and triangles of halo elements.
    pub left_out: BTreeMap<u32, u32>,
    /// `.shared`; empty for a serial mesh.
    pub shared: Vec<SharedNode>,
}

impl ElmerPart {
    /// The path of one of its files.
    pub fn file(&self, kind: &str) -> PathBuf {
        file(&self.stem, kind)
    }
}

fn file(stem: &Path, kind: &str) -> PathBuf {
    with_ending(stem, &format!(".{kind}"))
}

/// The counts of a part.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Header {
    /// Nodes.
    pub nodes: u32,
    /// Elements.
    pub elements: u32,
    /// Boundary elements.
    pub boundary: u32,
    /// Element codes with their counts.
    pub types: Vec<(u32, u32)>,
    /// Number of shared nodes; `None` for a serial mesh.
    pub shared: Option<u32>,
}

/// A node.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Node {
    /// Its id in the whole mesh.
    pub id: u32,
    /// Its coordinates.
    pub point: Point,
}

/// A tet.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Element {
    /// Its id in the whole mesh.
    pub id: u32,
    /// Its body.
    pub body: u32,
    /// Ids of its corners.
    pub nodes: [u32; 4],
    /// Ids of the nodes on its edges, in Elmer's order, if it is of second order.
    pub edge_nodes: Option<[u32; 6]>,
}

impl Element {
    /// Its element code.
    pub fn code(&self) -> u32 {
        if self.edge_nodes.is_some() { TET_10 } else { TET }
    }

    /// The ids of all nodes.
    pub fn all_nodes(&self) -> impl Iterator<Item = u32> + '_ {
        self.nodes.iter().chain(self.edge_nodes.iter().flatten()).copied()
    }
}

/// A triangle with a boundary number.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BoundaryElement {
    /// Its id, used in messages only.
    pub id: u32,
    /// Its boundary number.
    pub boundary: u32,
    /// Ids of the elements beside it; 0 if there is none in this part.
    pub parents: [u32; 2],
    /// Ids of its corners.
    pub nodes: [u32; 3],
    /// Ids of the nodes on its edges, around it, if it is of second order.
    pub edge_nodes: Option<[u32; 3]>,
}

impl BoundaryElement {
    /// Its element code.
    pub fn code(&self) -> u32 {
        if self.edge_nodes.is_some() { TRIANGLE_6 } else { TRIANGLE }
    }

    /// The ids of all nodes.
    pub fn all_nodes(&self) -> impl Iterator<Item = u32> + '_ {
        self.nodes.iter().chain(self.edge_nodes.iter().flatten()).copied()
    }
}

/// A shared node with its parts.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct SharedNode {
    /// The node.
    pub id: u32,
    /// The parts that have it, from 1, its owner first.
    pub parts: Vec<u32>,
}

/// Finds the meshes in a folder: `mesh.*` and each `partitioning.N` in it, or the folder itself if
/// it is a `partitioning.N`.
///
/// # Errors
/// If there is none, or if part numbers are missing.
pub fn layouts(dir: &Path) -> Result<Vec<Layout>, ReadError> {
    if dir.join("part.1.header").exists() {
        return Ok(vec![partitioned(dir.to_path_buf())?]);
    }
    let mut found = Vec::new();
    if dir.join("mesh.header").exists() {
        found.push(Layout::Serial(dir.to_path_buf()));
    }
    let mut folders = Vec::new();
    for entry in fs::read_dir(dir).map_err(ReadError::io(dir))? {
        let name = entry.map_err(ReadError::io(dir))?.file_name();
        let number = name.to_str().and_then(|n| n.strip_prefix("partitioning.")).and_then(|n| n.parse().ok());
        folders.extend(number.map(|n: u32| (n, dir.join(name))));
    }
    folders.sort();
    for (_, folder) in folders {
        found.push(partitioned(folder)?);
    }
    if found.is_empty() { Err(ReadError::NoElmerMesh(dir.to_path_buf())) } else { Ok(found) }
}

/// Finds the parts of a folder `partitioning.N`, which must be numbered 1 … N.
fn partitioned(folder: PathBuf) -> Result<Layout, ReadError> {
    let mut numbers = Vec::new();
    for entry in fs::read_dir(&folder).map_err(ReadError::io(&folder))? {
        let name = entry.map_err(ReadError::io(&folder))?.file_name();
        let number =
            name.to_str().and_then(|n| n.strip_prefix("part.")?.strip_suffix(".header")?.parse().ok());
        numbers.extend(number.map(|n: u32| n));
    }
    numbers.sort_unstable();
    match (1..).zip(&numbers).find(|(expected, number)| expected != *number) {
        None if !numbers.is_empty() => Ok(Layout::Partitioned { folder, parts: numbers.len() as u32 }),
        None => Err(ReadError::NoElmerMesh(folder)),
        Some((expected, _)) => {
            let path = folder.join(format!("part.{expected}.header"));
            Err(ReadError::io(&path)(std::io::ErrorKind::NotFound.into()))
        }
    }
}

/// Reads the mesh of a folder: its only partition, else `mesh.*`.
///
/// # Errors
/// If the folder has several partitions, a file is missing, or a line cannot belong to a mesh of
/// tets. Faults in a mesh that can be read are found by [`faults`](super::faults).
pub fn read(dir: &Path) -> Result<ElmerMesh, ReadError> {
    read_layout(&only_layout(dir)?)
}

/// Finds the mesh of a folder: its only partition, else `mesh.*`.
///
/// # Errors
/// If there is no mesh, or several partitions.
pub fn only_layout(dir: &Path) -> Result<Layout, ReadError> {
    let mut found = layouts(dir)?;
    let partitions: Vec<&Layout> = found.iter().filter(|l| matches!(l, Layout::Partitioned { .. })).collect();
    match partitions[..] {
        [] => Ok(found.remove(0)),
        [one] => Ok(one.clone()),
        _ => {
            let found = partitions.iter().map(|l| l.folder().to_path_buf()).collect();
            Err(ReadError::SeveralElmerMeshes { dir: dir.to_path_buf(), found })
        }
    }
}

/// Reads one mesh, its parts in parallel threads.
pub fn read_layout(layout: &Layout) -> Result<ElmerMesh, ReadError> {
    let parts = match layout {
        Layout::Serial(folder) => vec![read_part(folder.join("mesh"), false)?],
        Layout::Partitioned { folder, parts } => {
            let read = |k: u32| read_part(folder.join(format!("part.{k}")), true);
            let parts: Vec<_> = (1..=*parts).into_par_iter().map(read).collect();
            parts.into_iter().collect::<Result<_, _>>()?
        }
    };
    Ok(ElmerMesh { layout: layout.clone(), parts })
}

/// Returns the element count in the headers of the only partition in a folder, else of `mesh.*`.
///
/// # Errors
/// Those of [`read`].
pub fn stated_elements(dir: &Path) -> Result<u64, ReadError> {
    let stated = |stem: PathBuf, partitioned| {
        read_header(&file(&stem, "header"), partitioned).map(|header| u64::from(header.elements))
    };
    match only_layout(dir)? {
        Layout::Serial(folder) => stated(folder.join("mesh"), false),
        Layout::Partitioned { folder, parts } => {
            (1..=parts).map(|part| stated(folder.join(format!("part.{part}")), true)).sum()
        }
    }
}

pub(super) fn read_part(stem: PathBuf, partitioned: bool) -> Result<ElmerPart, ReadError> {
    let header = read_header(&file(&stem, "header"), partitioned)?;
    let nodes = read_lines(&file(&stem, "nodes"), header.nodes, node)?;
    let (elements, halo) = read_elements(&file(&stem, "elements"), header.elements)?;
    let lines = read_lines(&file(&stem, "boundary"), header.boundary, boundary_line)?;
    let (boundary, left_out) = own_boundary(lines, &elements, &halo);
    let shared = match header.shared {
        Some(count) => read_lines(&file(&stem, "shared"), count, shared_node)?,
        None => Vec::new(),
    };
    Ok(ElmerPart { stem, header, nodes, elements, halo, boundary, left_out, shared })
}

/// The halo elements of a part, with the numbers of their owners.
pub type Halo = Rows<(Element, u32)>;

/// Reads `.elements`: the part's own elements, and halo elements.
fn read_elements(path: &Path, expected: u32) -> Result<(Rows<Element>, Halo), ReadError> {
    let (mut own, mut halo) = (Rows::default(), Rows::default());
    own.values.reserve_exact(room(path, expected));
    let mut line = 0;
    for_each_line(path, element, |elements| {
        for (element, owner) in elements.drain(..) {
            line += 1;
            if owner > 0 {
                if halo.values.is_empty() {
                    // So far each value was on the line of its index.
                    own.lines.extend(1..line);
                }
                halo.values.push((element, owner));
                halo.lines.push(line);
            } else {
                own.values.push(element);
                if !halo.values.is_empty() {
                    own.lines.push(line);
                }
            }
        }
    })?;
    Ok((own, halo))
}

/// Separates the triangles beside elements of the part from the skipped lines, which are counted by
/// code.
///
/// Some of ElmerGrid's halos also contain the boundary elements of halo elements.
fn own_boundary(
    all: Vec<BoundaryLine>,
    elements: &Rows<Element>,
    halo: &Halo,
) -> (Rows<BoundaryElement>, BTreeMap<u32, u32>) {
    let mut own: Vec<u32> = Vec::new();
    if !halo.is_empty() {
        own.extend(elements.iter().map(|element| element.id));
        own.sort_unstable();
    }
    let is_foreign = |parent: &u32| own.binary_search(parent).is_err();
    let mut left_out = BTreeMap::new();
    let mut boundary = Rows::default();
    for (element, line) in all.into_iter().zip(1..) {
        match element {
            BoundaryLine::Own(element) => {
                let parents = element.parents.iter().filter(|parent| **parent != 0);
                let of_halo = !own.is_empty() && parents.clone().count() > 0 && { parents }.all(is_foreign);
                if of_halo {
                    *left_out.entry(element.code()).or_default() += 1;
                } else {
                    boundary.values.push(element);
                    boundary.lines.push(line);
                }
            }
            BoundaryLine::LeftOut(kind) => *left_out.entry(kind).or_default() += 1,
        }
    }
    (boundary, left_out)
}

fn read_header(path: &Path, partitioned: bool) -> Result<Header, ReadError> {
    let lines = read_lines(path, 0, |line| {
        let mut fields = Fields::new(line);
        let mut numbers = Vec::new();
        while !fields.is_empty() {
            numbers.push(fields.int("count")?);
        }
        Ok(numbers)
    })?;
    let error = |line: usize, message: &str| ReadError::line(path, line as u64 + 1, message);
    let [nodes, elements, boundary] = lines.first().map_or(&[][..], |l| &l[..]) else {
        return Err(error(0, "expected the numbers of nodes, elements and boundary elements"));
    };
    let [type_count] = lines.get(1).map_or(&[][..], |l| &l[..]) else {
        return Err(error(1, "expected the number of element types"));
    };
    let mut types = Vec::new();
    for k in 2..2 + *type_count as usize {
        let [code, count] = lines.get(k).map_or(&[][..], |l| &l[..]) else {
            return Err(error(k, "expected an element type and its count"));
        };
        types.push((*code, *count));
    }
    let last = 2 + types.len();
    let shared = match (partitioned, lines.get(last).map_or(&[][..], |l| &l[..])) {
        (false, _) => None,
        (true, [shared] | [shared, _]) => Some(*shared),
        (true, _) => return Err(error(last, "expected the number of shared nodes")),
    };
    Ok(Header { nodes: *nodes, elements: *elements, boundary: *boundary, types, shared })
}

fn node(line: &[u8]) -> Result<Node, String> {
    let blanks: Vec<u8>;
    let mut fields = if line.contains(&b'\t') {
        // Elmer reads only this file with Fortran's list-directed input, in which a tab is a blank.
        blanks = line.iter().map(|&b| if b == b'\t' { b' ' } else { b }).collect();
        Fields::new(&blanks)
    } else {
        Fields::new(line)
    };
    let id = fields.int("node")?;
    fields.float("tag")?;
    let point = Point::new(fields.float("x")?, fields.float("y")?, fields.float("z")?);
    fields.end()?;
    Ok(Node { id, point })
}

fn ids<const N: usize>(fields: &mut Fields, what: &str) -> Result<[u32; N], String> {
    let mut ids = [0; N];
    for id in &mut ids {
        *id = fields.int(what)?;
    }
    Ok(ids)
}

/// Parses an element and the number of its owner if it is a halo element, else 0.
fn element(line: &[u8]) -> Result<(Element, u32), String> {
    expect_readable_by_elmer(line)?;
    let mut fields = Fields::new(line);
    let (id, owner) = fields.int_and_part("element")?;
    let body = fields.int("body")?;
    let code = fields.int("element type")?;
    TETS.expect(code)?;
    let nodes = ids(&mut fields, "node")?;
    let edge_nodes = TETS.edge_nodes(code, &mut fields)?;
    fields.end()?;
    Ok((Element { id, body, nodes, edge_nodes }, owner.unwrap_or(0)))
}

/// A line of `.boundary`.
enum BoundaryLine {
    Own(BoundaryElement),
    /// A point, an edge, or a triangle of a halo element: its element code.
    LeftOut(u32),
}

fn boundary_line(line: &[u8]) -> Result<BoundaryLine, String> {
    expect_readable_by_elmer(line)?;
    let mut fields = Fields::new(line);
    let (id, owner) = fields.int_and_part("boundary element")?;
    let boundary = fields.int("boundary number")?;
    let parents = ids(&mut fields, "parent")?;
    let kind = fields.int("element type")?;
    if POINTS_AND_EDGES.contains(&kind) {
        return Ok(BoundaryLine::LeftOut(kind));
    }
    TRIANGLES.expect(kind)?;
    let nodes = ids(&mut fields, "node")?;
    let edge_nodes = TRIANGLES.edge_nodes(kind, &mut fields)?;
    fields.end()?;
    let element = BoundaryElement { id, boundary, parents, nodes, edge_nodes };
    Ok(if owner.is_some() { BoundaryLine::LeftOut(kind) } else { BoundaryLine::Own(element) })
}

fn shared_node(line: &[u8]) -> Result<SharedNode, String> {
    expect_readable_by_elmer(line)?;
    let mut fields = Fields::new(line);
    let id = fields.int("node")?;
    let count = fields.int("number of parts")?;
    if !(2..=MAX_LINE.1 as u32 - 2).contains(&count) {
        return Err(format!("{count} parts share the node; Elmer reads 2 to {}", MAX_LINE.1 - 2));
    }
    let parts = (0..count).map(|_| fields.int("part")).collect::<Result<_, _>>()?;
    fields.end()?;
    Ok(SharedNode { id, parts })
}
