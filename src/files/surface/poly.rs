//! TetGen's `.poly` and `.smesh`: points, facets of several polygons with holes, holes and regions
//! of the volume.

use super::builder::Builder;
use super::facet::{self, Fill};
use super::{ReadError, Region, Surface};
use crate::Point;
use crate::files::input::tetgen_nodes::{self, Nodes};
use crate::files::input::{Fault, Words, beside, float, int, line_of, load, shown};
use std::collections::BTreeMap;
use std::path::Path;

/// The two formats.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Kind {
    /// Facets of several polygons and holes.
    Poly,
    /// Facets of one polygon.
    Smesh,
}

/// Reads the file, and the `.node` file beside it if it has no points.
pub(super) fn read(path: &Path, kind: Kind) -> Result<Surface, ReadError> {
    let content = load(path)?;
    let mut words = Words::with_comments(&content);
    let mut nodes = tetgen_nodes::read(&mut words).map_err(|fault| fault.in_file(path, &content))?;
    if nodes.points.is_empty() {
        let beside = beside(path, "node");
        let content = load(&beside)?;
        nodes = tetgen_nodes::read(&mut Words::with_comments(&content))
            .map_err(|fault| fault.in_file(&beside, &content))?;
    }
    parse(words, nodes, kind, &content).map_err(|fault| fault.in_file(path, &content))
}

/// Parses the sections after the points.
fn parse(mut words: Words, nodes: Nodes, kind: Kind, content: &[u8]) -> Result<Surface, Fault> {
    let Nodes { base, points } = nodes;
    let count = points.len();
    let mut facets =
        Facets { builder: Builder::new(points)?, base, count, groups: BTreeMap::new(), edges: Vec::new() };
    facets.builder.set_unoriented();
    let facet_count = words.count("facets", 1)?;
    let has_markers = words.next_in_line().is_some_and(|flag| flag != b"0");
    words.rest_of_line();
    for _ in 0..facet_count {
        match kind {
            Kind::Poly => facets.facet(&mut words)?,
            Kind::Smesh => facets.polygon(&mut words, has_markers)?,
        }
    }
    if facet_count == 0 {
        return Err(Fault::file("the file has no facets"));
    }
    let holes = holes(&mut words)?;
    let regions = regions(&mut words)?;
    let mut surface = facets.builder.finish(&|offset| format!("line {}", line_of(content, offset)));
    (surface.holes, surface.regions, surface.loose_edges) = (holes, regions, facets.edges);
    Ok(surface)
}

struct Facets {
    builder: Builder,
    base: i64,
    count: usize,
    groups: BTreeMap<i64, u32>,
    edges: Vec<[Point; 2]>,
}

impl Facets {
    /// Parses `polygons [holes [marker]]`, the polygons, the holes.
    fn facet(&mut self, words: &mut Words) -> Result<(), Fault> {
        let count = words.count("polygons of a facet", 2)?;
        let begin = words.clone();
        let hole_count = match words.next_in_line() {
            Some(word) => int(word).and_then(|n| usize::try_from(n).ok()).ok_or_else(|| {
                words.fault(format!("expected the number of holes of a facet, found `{}`", shown(word)))
            })?,
            None => 0,
        };
        let marker = marker(words)?;
        words.rest_of_line();
        let mut loops = Vec::with_capacity(count);
        for _ in 0..count {
            loops.push(self.corners(words)?);
            words.rest_of_line();
        }
        let mut holes = Vec::new();
        for _ in 0..hole_count {
            words.int("the number of a hole")?;
            holes.push(words.point("a coordinate")?);
            words.rest_of_line();
        }
        self.add(loops, &holes, marker, &begin)
    }

    /// Parses `corners v … v [marker]`.
    fn polygon(&mut self, words: &mut Words, has_marker: bool) -> Result<(), Fault> {
        let corners = self.corners(words)?;
        let begin = words.clone();
        let marker = if has_marker { marker(words)? } else { 0 };
        words.rest_of_line();
        self.add(vec![corners], &[], marker, &begin)
    }

    fn corners(&self, words: &mut Words) -> Result<Vec<u32>, Fault> {
        let count = words.count("corners of a polygon", 1)?;
        (0..count).map(|_| words.vertex(self.base, self.count)).collect()
    }

    fn add(&mut self, loops: Vec<Vec<u32>>, holes: &[Point], marker: i64, at: &Words) -> Result<(), Fault> {
        let builder = &mut self.builder;
        let group = *self.groups.entry(marker).or_insert_with(|| {
            let name = if marker == 0 { "surface".into() } else { format!("marker {marker}") };
            builder.group(name, marker)
        });
        let located = |fault| at.fault(format!("the facet cannot be cut into triangles: {fault}"));
        match &loops[..] {
            // Facets of single points become loose points.
            _ if loops.iter().all(|corners| corners.len() < 2) => Ok(()),
            _ if loops.iter().all(|corners| corners.len() < 3) => {
                let pairs = loops.iter().filter(|corners| corners.len() == 2);
                self.edges.extend(pairs.map(|pair| [builder.place(pair[0]), builder.place(pair[1])]));
                Ok(())
            }
            [corners] if holes.is_empty() => builder.polygon(corners, group, at.offset()).map_err(located),
            _ => {
                let merged = |v: &u32| builder.merged(*v);
                let loops: Vec<Vec<u32>> = loops.iter().map(|l| l.iter().map(merged).collect()).collect();
                let fill = Fill::Enclosed(holes);
                let triangles = facet::triangulate(builder.points(), &loops, &fill).map_err(located)?;
                builder.face(&loops.concat(), at.offset());
                builder.triangles(&triangles, group);
                Ok(())
            }
        }
    }
}

/// The marker at the end of a line; 0 if there is none.
fn marker(words: &mut Words) -> Result<i64, Fault> {
    let Some(word) = words.next_in_line() else { return Ok(0) };
    int(word).ok_or_else(|| words.fault(format!("expected a marker, found `{}`", shown(word))))
}

/// Parses the holes of the volume; the section may be missing at the end of the file.
fn holes(words: &mut Words) -> Result<Vec<Point>, Fault> {
    if words.peek().is_none() {
        return Ok(Vec::new());
    }
    let count = words.count("holes", 4)?;
    words.rest_of_line();
    let mut holes = Vec::with_capacity(count);
    for _ in 0..count {
        words.int("the number of a hole")?;
        holes.push(words.point("a coordinate")?);
        words.rest_of_line();
    }
    Ok(holes)
}

/// Parses the regions of the volume, `number x y z attribute [largest volume]`; the section may be
/// missing.
fn regions(words: &mut Words) -> Result<Vec<Region>, Fault> {
    if words.peek().is_none() {
        return Ok(Vec::new());
    }
    let count = words.count("regions", 4)?;
    words.rest_of_line();
    let mut regions = Vec::with_capacity(count);
    for _ in 0..count {
        words.int("the number of a region")?;
        let place = words.point("a coordinate")?;
        let mut number = || {
            let Some(word) = words.next_in_line() else { return Ok(None) };
            let number = float(word).map(Some);
            number.ok_or_else(|| words.fault(format!("expected a number, found `{}`", shown(word))))
        };
        let attribute = number()?.unwrap_or(0.0);
        let max_volume = number()?.filter(|&volume| volume > 0.0);
        regions.push(Region { place, attribute, max_volume });
        words.rest_of_line();
    }
    Ok(regions)
}
