//! VTK's XML files of unstructured grids with one piece: tets, and triangles on their boundary.
//!
//! Arrays may be text, base64 (inline or appended) or raw, and compressed by zlib. Body and
//! boundary numbers come from the first known cell array, see [`LABELS`]; boundaries from
//! `BoundaryId` if there is one. Cells marked as copies by `vtkGhostType` are skipped. Files of
//! tetmill have names of bodies and boundaries in `FieldData`, and by default the boundary in a
//! second file, `STEM.boundary.vtu`, which is read too.

use super::raw::{Label, Raw, Shape};
use super::vtu_arrays::{Array, Document, Section};
use super::{VolumeMesh, finish};
use crate::Point;
use crate::files::input::{Fault, ReadError, coordinate, load};
use crate::files::node_order::VTK;
use std::collections::BTreeMap;
use std::path::Path;

/// Cell arrays with numbers of bodies and boundaries: ours, then those of Gmsh, of meshio for Gmsh
/// and Medit, and of Elmer.
const LABELS: [&str; 6] =
    ["BodyId", "CellEntityIds", "gmsh:physical", "medit:ref", "GeometryIds", "BoundaryId"];

/// Reads the file, and the boundary file beside it.
pub(super) fn read(path: &Path) -> Result<VolumeMesh, ReadError> {
    let content = load(path)?;
    let mut raw = parse(&content).map_err(|fault| fault.in_file(path, &content))?;
    let beside = path.with_extension("boundary.vtu");
    if raw.raw.triangles.is_empty() && !raw.vertex_ids.is_empty() && beside.exists() {
        let content = load(&beside)?;
        let boundary = parse(&content).map_err(|fault| fault.in_file(&beside, &content))?;
        add_boundary(&mut raw, boundary).map_err(|fault| fault.in_file(&beside, &content))?;
    }
    finish(Ok(raw.raw), path, &content)
}

/// A file's mesh, with the global ids of its vertices and tets if it has them.
#[derive(Default)]
pub(super) struct Grid {
    pub raw: Raw,
    pub vertex_ids: Vec<i64>,
    pub tet_ids: Vec<i64>,
    /// The piece of each tet, if several were joined.
    pub parts: Vec<u32>,
}

/// The numbers of cells in the first of these arrays that exists.
fn labels(document: &Document, names: &[&str]) -> Result<Option<Vec<i64>>, Fault> {
    let array = names.iter().find_map(|name| document.array(Section::CellData, Some(name)));
    array.map(|array| of_cells(document, array)).transpose()
}

/// The whole numbers of an array with one number for each cell.
fn of_cells(document: &Document, array: &Array) -> Result<Vec<i64>, Fault> {
    let (numbers, cells) = (array.ints()?, document.counts.cells);
    array.check_count(numbers.len(), cells, &format!("{cells} cells"))?;
    Ok(numbers)
}

/// The points of a piece.
fn points(document: &Document) -> Result<Vec<Point>, Fault> {
    let array = document.required(Section::Points, None)?;
    let coordinates = array.floats()?;
    let count = document.counts.points;
    array.check_count(coordinates.len(), count.saturating_mul(3), &format!("{count} points"))?;
    let (points, _) = coordinates.as_chunks::<3>();
    let checked = |(k, [x, y, z]): (usize, &[f64; 3])| {
        let wrong = |message| array.wrong(format!("point {k}: {message}"));
        let checked = |x: f64| coordinate(x).map_err(wrong);
        Ok(Point::new(checked(*x)?, checked(*y)?, checked(*z)?))
    };
    points.iter().enumerate().map(checked).collect()
}

/// The cells of a piece: the vertices of all cells, and where those of each end.
struct Cells<'d, 'a> {
    connectivity: Vec<i64>,
    offsets: Vec<i64>,
    types: Vec<i64>,
    /// For faults: the arrays of the vertices and of their ends.
    arrays: [&'d Array<'a>; 2],
}

impl<'d, 'a> Cells<'d, 'a> {
    fn of(document: &'d Document<'a>) -> Result<Self, Fault> {
        let array = |name| document.required(Section::Cells, Some(name));
        let arrays = [array("connectivity")?, array("offsets")?];
        let connectivity = arrays[0].ints()?;
        let offsets = of_cells(document, arrays[1])?;
        let types = of_cells(document, array("types")?)?;
        let last = offsets.last().copied().unwrap_or(0);
        let needed = u64::try_from(last).unwrap_or(0);
        arrays[0].check_count(connectivity.len(), needed, &format!("offsets up to {last}"))?;
        Ok(Self { connectivity, offsets, types, arrays })
    }

    /// The vertices of a cell, which begin where those of the previous one end.
    fn vertices(&self, cell: usize, count: usize, nodes: &mut Vec<u32>) -> Result<(), Fault> {
        let end = self.offsets[cell];
        let begin = if cell == 0 { 0 } else { self.offsets[cell - 1] };
        let range = usize::try_from(begin).ok().zip(usize::try_from(end).ok());
        let vertices = range.and_then(|(begin, end)| self.connectivity.get(begin..end));
        let wrong = || self.arrays[1].wrong(format!("the offset {end} of cell {cell} is wrong"));
        nodes.clear();
        for &vertex in vertices.ok_or_else(wrong)? {
            let index = u32::try_from(vertex).ok().filter(|&v| (v as usize) < count);
            let missing = || {
                let message = format!("cell {cell} names vertex {vertex}, and the file has {count}, from 0");
                self.arrays[0].wrong(message)
            };
            nodes.push(index.ok_or_else(missing)?);
        }
        Ok(())
    }
}

pub(super) fn parse(content: &[u8]) -> Result<Grid, Fault> {
    let document = Document::read(content)?;
    let mut raw = Raw { points: points(&document)?, edge_order: Some(&VTK), ..Raw::default() };
    let cells = Cells::of(&document)?;
    let of_tets = labels(&document, &LABELS)?;
    let of_triangles = labels(&document, &["BoundaryId"])?;
    let of_triangles = of_triangles.as_ref().or(of_tets.as_ref());
    let ids = document.ids(Section::CellData, "GlobalElementId")?;
    let mut tet_ids = Vec::new();
    let copies = labels(&document, &["vtkGhostType"])?;
    let is_copy = |cell: usize| copies.as_ref().is_some_and(|copies| copies[cell] & 1 == 1);
    let mut nodes = Vec::new();
    for (cell, &kind) in cells.types.iter().enumerate() {
        cells.vertices(cell, raw.points.len(), &mut nodes)?;
        if is_copy(cell) {
            continue;
        }
        let labels = if shape(kind) == Shape::Triangle { of_triangles } else { of_tets.as_ref() };
        let label = Label::number(labels.map_or(0, |labels| labels[cell]));
        raw.add(shape(kind), &nodes, label)
            .map_err(|message| cells.arrays[1].wrong(format!("cell {cell} is {message}")))?;
        if shape(kind) == Shape::Tet {
            raw.tet_numbers.push(cell as u64);
        }
        tet_ids.extend(ids.get(cell).filter(|_| shape(kind) == Shape::Tet));
    }
    raw.add_names(document.names()?);
    if document.array(Section::PointData, Some("PeriodicId")).is_some() {
        raw.notes.push(
            "the pairs of periodic vertices (PeriodicId) are left out: the mesh is not periodic here".into(),
        );
    }
    Ok(Grid {
        raw,
        vertex_ids: document.ids(Section::PointData, "GlobalNodeId")?,
        tet_ids,
        parts: Vec::new(),
    })
}

/// The shape of a VTK cell type.
fn shape(kind: i64) -> Shape {
    match kind {
        1 | 2 => Shape::Point,
        3 | 4 | 21 => Shape::Edge,
        5 | 22 => Shape::Triangle,
        10 | 24 => Shape::Tet,
        8 | 9 | 23 | 28 => Shape::Other("quadrangle"),
        11 | 12 | 25 | 29 => Shape::Other("hexahedron"),
        13 | 26 => Shape::Other("prism"),
        14 | 27 => Shape::Other("pyramid"),
        _ => Shape::Other("cell of another type"),
    }
}

/// Adds the triangles of a separate file; vertices are matched by their ids.
pub(super) fn add_boundary(grid: &mut Grid, boundary: Grid) -> Result<(), Fault> {
    let places: BTreeMap<i64, u32> = grid.vertex_ids.iter().copied().zip(0..).collect();
    let to_place = |&v: &u32| {
        let id = boundary.vertex_ids.get(v as usize);
        let place =
            id.and_then(|id| places.get(id)).filter(|&&place| (place as usize) < grid.raw.points.len());
        place.copied().ok_or_else(|| Fault::file(format!("vertex {v} is none of the mesh beside the file")))
    };
    for (triangle, label) in boundary.raw.triangles.iter().zip(&boundary.raw.triangle_labels) {
        let mut vertices = [0; 3];
        for (place, v) in vertices.iter_mut().zip(triangle) {
            *place = to_place(v)?;
        }
        grid.raw.triangles.push(vertices);
        grid.raw.triangle_labels.push(*label);
    }
    grid.raw.add_names([boundary.raw.body_names, boundary.raw.patch_names]);
    Ok(())
}
