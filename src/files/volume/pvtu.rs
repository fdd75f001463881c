//! VTK's `.pvtu` index files: joins the `.vtu` pieces to one mesh.
//!
//! Vertices of several pieces with the same global id are merged, and tets are sorted by their ids.
//! Files of other programs without ids are joined at vertices with bitwise equal coordinates.
//! Vertices that are only close to each other are refused, because the mesh would have a gap there.

use super::raw::Raw;
use super::vtu::{Grid, add_boundary, parse};
use super::vtu_tags::{Tags, check_place, check_type};
use super::{VolumeMesh, finish};
use crate::Point;
use crate::files::input::{Fault, ReadError, counted, load};
use std::collections::{BTreeMap, HashMap};
use std::path::{Path, PathBuf};

/// Vertices of two pieces closer than this fraction of the diagonal, but not equal, were probably
/// one vertex before rounding.
const NEARLY: f64 = 1e-7;

/// Reads the index file, its pieces, and the boundary's index file beside it.
pub(super) fn read(path: &Path) -> Result<VolumeMesh, ReadError> {
    let mut whole = read_pieces(path)?;
    let beside = path.with_extension("boundary.pvtu");
    if whole.raw.triangles.is_empty() && !whole.vertex_ids.is_empty() && beside.exists() {
        let boundary = read_pieces(&beside)?;
        add_boundary(&mut whole, boundary).map_err(|fault| fault.in_file(&beside, b""))?;
    }
    Ok(VolumeMesh { parts: whole.parts, ..finish(Ok(whole.raw), path, b"")? })
}

/// Reads the pieces of an index file as one grid.
fn read_pieces(path: &Path) -> Result<Grid, ReadError> {
    let list = load(path)?;
    let folder = path.parent().unwrap_or(Path::new(""));
    let sources = sources(&list).map_err(|fault| fault.in_file(path, &list))?;
    let mut pieces = Vec::with_capacity(sources.len());
    for source in sources {
        let source = folder.join(source);
        let content = load(&source)?;
        pieces.push(parse(&content).map_err(|fault| fault.in_file(&source, &content))?);
    }
    join(pieces).map_err(|fault| fault.in_file(path, &list))
}

/// The piece files that an index file lists.
fn sources(list: &[u8]) -> Result<Vec<PathBuf>, Fault> {
    const OTHER_FORMAT: &str = "no piece in a VTK file of type PUnstructuredGrid: another format?";
    let mut tags = Tags::new(list);
    let mut sources = Vec::new();
    while let Some(tag) = tags.next()? {
        check_place(&tag)?;
        match tag.name {
            "VTKFile" => check_type(&tag, "PUnstructuredGrid")?,
            _ if tag.parent.is_empty() => return Err(tag.fault(OTHER_FORMAT)),
            "Piece" => {
                let source = tag.text("Source").ok_or_else(|| tag.fault("a piece without a source"))?;
                sources.push(source.into());
            }
            _ => {}
        }
    }
    if sources.is_empty() { Err(Fault::file(OTHER_FORMAT)) } else { Ok(sources) }
}

/// Joins all pieces.
fn join(pieces: Vec<Grid>) -> Result<Grid, Fault> {
    let mut whole = Grid::default();
    let have_ids = pieces.iter().all(|piece| piece.vertex_ids.len() == piece.raw.points.len());
    let places =
        if have_ids { join_by_id(&pieces, &mut whole)? } else { join_by_place(&pieces, &mut whole.raw)? };
    let have_tet_ids = pieces.iter().all(|piece| piece.tet_ids.len() == piece.raw.tets.len());
    let raw = &mut whole.raw;
    for ((piece, places), number) in pieces.into_iter().zip(places).zip(0..) {
        let of = piece.raw;
        raw.tets.extend(of.tets.iter().map(|tet| tet.map(|v| places[v as usize])));
        whole.parts.resize(raw.tets.len(), number);
        raw.tet_labels.extend(of.tet_labels);
        raw.triangles.extend(of.triangles.iter().map(|triangle| triangle.map(|v| places[v as usize])));
        raw.triangle_labels.extend(of.triangle_labels);
        raw.edges.extend(of.edges.iter().map(|edge| edge.map(|v| places[v as usize])));
        raw.edge_labels.extend(of.edge_labels);
        raw.edge_nodes.extend(of.edge_nodes.iter().map(|nodes| nodes.map(|v| places[v as usize])));
        raw.higher_order += of.higher_order;
        raw.add_names([of.body_names, of.patch_names]);
        for note in of.notes {
            if !raw.notes.contains(&note) {
                raw.notes.push(note);
            }
        }
        whole.tet_ids.extend(piece.tet_ids);
    }
    if have_tet_ids {
        sort_tets(&mut whole);
    }
    Ok(whole)
}

/// Sorts tets by their ids; of duplicates the first is kept.
fn sort_tets(whole: &mut Grid) {
    let mut order: Vec<usize> = (0..whole.tet_ids.len()).collect();
    order.sort_by_key(|&tet| whole.tet_ids[tet]);
    order.dedup_by_key(|&mut tet| whole.tet_ids[tet]);
    if whole.raw.edge_nodes.len() == whole.raw.tets.len() {
        whole.raw.edge_nodes = order.iter().map(|&tet| whole.raw.edge_nodes[tet]).collect();
    }
    whole.raw.tets = order.iter().map(|&tet| whole.raw.tets[tet]).collect();
    whole.parts = order.iter().map(|&tet| whole.parts[tet]).collect();
    whole.raw.tet_labels = order.iter().map(|&tet| whole.raw.tet_labels[tet]).collect();
}

/// Merges vertices with the same id, in order of ids. Returns the merged index of each piece's
/// vertices.
fn join_by_id(pieces: &[Grid], whole: &mut Grid) -> Result<Vec<Vec<u32>>, Fault> {
    let mut vertices: Vec<(i64, Point)> = Vec::new();
    for piece in pieces {
        vertices.extend(piece.vertex_ids.iter().copied().zip(piece.raw.points.iter().copied()));
    }
    vertices.sort_by_key(|(id, _)| *id);
    let tolerance = NEARLY * diagonal(vertices.iter().map(|(_, point)| point));
    for same in vertices.chunk_by(|a, b| a.0 == b.0) {
        let (id, point) = same[0];
        if let Some((_, other)) = same.iter().find(|(_, other)| (other - point).norm() > tolerance) {
            return Err(Fault::file(format!(
                "vertex {id} is at {} in one piece and at {} in another",
                shown(&point),
                shown(other)
            )));
        }
    }
    vertices.dedup_by_key(|(id, _)| *id);
    let place = |id: &i64| vertices.binary_search_by_key(id, |(id, _)| *id).expect("an id of a piece") as u32;
    let places = pieces.iter().map(|piece| piece.vertex_ids.iter().map(place).collect()).collect();
    whole.vertex_ids = vertices.iter().map(|(id, _)| *id).collect();
    whole.raw.points = vertices.into_iter().map(|(_, point)| point).collect();
    Ok(places)
}

/// Merges vertices with equal coordinates. Returns the merged index of each piece's vertices.
fn join_by_place(pieces: &[Grid], raw: &mut Raw) -> Result<Vec<Vec<u32>>, Fault> {
    let mut known: BTreeMap<[u64; 3], u32> = BTreeMap::new();
    // The first piece of each vertex, and the number of pieces that have it.
    let mut found: Vec<(usize, usize)> = Vec::new();
    let mut places = Vec::with_capacity(pieces.len());
    for (number, piece) in pieces.iter().enumerate() {
        let mut of_piece = Vec::with_capacity(piece.raw.points.len());
        for point in &piece.raw.points {
            let place = *known.entry([point.x, point.y, point.z].map(f64::to_bits)).or_insert_with(|| {
                raw.points.push(*point);
                found.push((number, 0));
                raw.points.len() as u32 - 1
            });
            found[place as usize].1 += 1;
            of_piece.push(place);
        }
        places.push(of_piece);
    }
    refuse_near_misses(&raw.points, &found)?;
    let merged = found.iter().filter(|(_, copies)| *copies > 1).count();
    raw.notes.push(format!(
        "the pieces have no global ids of vertices; {} of several pieces in the same places are one each",
        counted(merged, "vertex")
    ));
    Ok(places)
}

/// Refuses vertices of different pieces that are close but not equal.
fn refuse_near_misses(points: &[Point], found: &[(usize, usize)]) -> Result<(), Fault> {
    let tolerance = NEARLY * diagonal(points.iter());
    if tolerance == 0.0 {
        return Ok(());
    }
    let cell = |point: &Point| [point.x, point.y, point.z].map(|x| (x / tolerance).floor() as i64);
    // Grid cells of the tolerance's size, with one vertex each: enough to find a gap between
    // pieces.
    let mut by_cell: HashMap<[i64; 3], usize> = HashMap::new();
    for (v, point) in points.iter().enumerate() {
        let [x, y, z] = cell(point);
        for k in 0..27 {
            let beside = [x + k % 3 - 1, y + k / 3 % 3 - 1, z + k / 9 - 1];
            let Some(&other) = by_cell.get(&beside) else { continue };
            if found[other].0 != found[v].0 && (points[other] - point).norm() < tolerance {
                return Err(Fault::file(format!(
                    "the pieces have no global ids of vertices, and {} of piece {} is nearly but not exactly at {} of piece {}: \
                     they cannot be joined; write coordinates in full precision, or ids (GlobalNodeId)",
                    shown(&points[other]),
                    found[other].0 + 1,
                    shown(point),
                    found[v].0 + 1
                )));
            }
        }
        by_cell.entry([x, y, z]).or_insert(v);
    }
    Ok(())
}

fn diagonal<'a>(points: impl Iterator<Item = &'a Point> + Clone) -> f64 {
    let low = points.clone().fold(Point::from([f64::INFINITY; 3]), |low, point| low.inf(point));
    let high = points.fold(Point::from([f64::NEG_INFINITY; 3]), |high, point| high.sup(point));
    let diagonal = (high - low).norm();
    if diagonal.is_finite() { diagonal } else { 0.0 }
}

fn shown(point: &Point) -> String {
    format!("({}, {}, {})", point.x, point.y, point.z)
}
