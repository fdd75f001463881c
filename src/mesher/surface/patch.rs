//! Meshing of all patches in parallel, and assembly of the surface mesh.

use super::chart::{Chart, nappe, sheets};
use super::condition::condition;
use super::embed::{Conflict, Fault, embed};
use super::error::joined;
use super::front::{Advanced, advance};
use super::improve::{Improved, improve, repair_flattening, split};
use super::sheet::{Kind, Node, Piece, Sheet, Stop};
use super::topology::NONE;
use super::{PatchReport, Report, Settings, SurfaceError, SurfaceMesh};
use crate::ground::kernel::places::Places;
use crate::ground::mesh::periodic::same_place;
use crate::ground::mesh::{BoundaryTriangle, Class, VertexId};
use crate::ground::size::SizeField;
use crate::{Point, Vector};
use csg::{CurveId, Features, Geometry, PatchId, Surface};
use nalgebra::Isometry3;
use rayon::prelude::*;
use std::ops::Range;

/// A meshed patch: new vertices, and triangles in local numbers.
struct Meshed {
    /// The input vertices of the first local numbers; the other local vertices are new.
    inputs: Vec<u32>,
    points: Vec<Point>,
    triangles: Vec<[u32; 3]>,
    report: PatchReport,
}

/// Fills all patches with triangles.
///
/// `curves` contains the vertices on corners and curves and the segments, which stay unchanged;
/// vertices on patches are appended patch by patch. Patches are meshed in parallel with the same
/// result for any number of threads. Periodic copies get the moved triangles of their masters.
///
/// # Errors
/// The error of the first patch, by number, that could not be meshed.
pub fn mesh_patches(
    geometry: &Geometry,
    features: &Features,
    curves: SurfaceMesh,
    size: &dyn SizeField,
    settings: &Settings,
) -> Result<(SurfaceMesh, Report), SurfaceError> {
    let input = Input::new(geometry, features, &curves, size, settings);
    let masters = features.masters().patches;
    let first = |p: usize| {
        let meshed = masters[p].is_none().then(|| input.mesh(PatchId::new(p)));
        size.work().add(1);
        meshed
    };
    let firsts: Vec<Option<Result<Meshed, SurfaceError>>> =
        (0..features.patches.len()).into_par_iter().map(first).collect();
    let (mut meshed, mut errors): (Vec<Option<Meshed>>, Vec<SurfaceError>) = (Vec::new(), Vec::new());
    for result in firsts {
        match result {
            Some(Err(error)) => errors.push(error),
            other => meshed.push(other.and_then(Result::ok)),
        }
    }
    if let Some(error) = joined(errors, &curves) {
        return Err(error);
    }
    let copies = masters.iter().enumerate().filter_map(|(p, master)| Some((p, (*master)?)));
    let copies: Vec<(usize, Meshed)> = copies
        .map(|(p, master)| {
            let of = meshed[master.index].as_ref().expect("a master is not a copy");
            (p, input.moved(of, PatchId::new(p), &master.motion))
        })
        .collect();
    copies.into_iter().for_each(|(p, copy)| meshed[p] = Some(copy));
    let mut out = curves;
    let mut report = Report::default();
    for (p, meshed) in meshed.into_iter().flatten().enumerate() {
        let Meshed { inputs, points, triangles, report: of_patch } = meshed;
        let patch = PatchId::new(p);
        let first = out.points.len();
        let number = |v: u32| match inputs.get(v as usize) {
            Some(&input) => VertexId(input),
            None => VertexId::new(first + v as usize - inputs.len()),
        };
        out.triangles.extend(triangles.iter().map(|t| BoundaryTriangle { vertices: t.map(number), patch }));
        out.classes.extend(points.iter().map(|_| Class::Patch(patch)));
        out.points.extend(points);
        report.patches.push(of_patch);
    }
    Ok((out, report))
}

/// The common input of all patches.
struct Input<'a> {
    geometry: &'a Geometry,
    features: &'a Features,
    curves: &'a SurfaceMesh,
    size: &'a dyn SizeField,
    settings: &'a Settings,
    /// The segments of each curve.
    ranges: Vec<Range<usize>>,
    /// For each segment, the directions of the curve at its ends, into the segment.
    tangents: Vec<[Vector; 2]>,
    /// The vertex of each corner.
    corners: Vec<u32>,
    /// Vertices on corners without curves, with their corners.
    isolated: Vec<(u32, usize)>,
}

impl<'a> Input<'a> {
    fn new(
        geometry: &'a Geometry,
        features: &'a Features,
        curves: &'a SurfaceMesh,
        size: &'a dyn SizeField,
        settings: &'a Settings,
    ) -> Self {
        let mut ranges = vec![0..0; features.curves.len()];
        let mut ends_here = vec![false; curves.points.len()];
        for (s, segment) in curves.segments.iter().enumerate() {
            let range = &mut ranges[segment.curve.index()];
            *range = if range.end == 0 { s..s + 1 } else { range.start..s + 1 };
            for v in segment.vertices {
                ends_here[v.index()] = true;
            }
        }
        let mut corners = vec![u32::MAX; features.corners.len()];
        for (v, class) in curves.classes.iter().enumerate() {
            if let Class::Corner(c) = class {
                corners[c.index()] = v as u32;
            }
        }
        let isolated = curves
            .classes
            .iter()
            .enumerate()
            .filter_map(|(v, class)| match class {
                Class::Corner(c) if !ends_here[v] => Some((v as u32, c.index())),
                _ => None,
            })
            .collect();
        let tangents = Vec::new();
        let mut input =
            Self { geometry, features, curves, size, settings, ranges, tangents, corners, isolated };
        input.tangents = (0..curves.segments.len()).map(|s| input.tangents_of(s)).collect();
        input
    }

    /// The directions of the curve at the ends of a segment, into the segment.
    fn tangents_of(&self, s: usize) -> [Vector; 2] {
        let segment = &self.curves.segments[s];
        let point = |v: VertexId| &self.curves.points[v.index()];
        let [a, b] = segment.vertices.map(point);
        let range = &self.ranges[segment.curve.index()];
        let closed = self.features.curve(segment.curve).ends.is_none();
        let neighbour = |back: bool| {
            let t = match (back, s == range.start, s + 1 == range.end) {
                (true, true, _) => closed.then(|| range.end - 1),
                (true, false, _) => Some(s - 1),
                (false, _, true) => closed.then_some(range.start),
                (false, _, false) => Some(s + 1),
            };
            t.map(|t| point(self.curves.segments[t].vertices[usize::from(!back)]))
        };
        // Inside a curve both segments get the same tangent line; at corners it comes from the two
        // surfaces.
        [(neighbour(true), a, b), (neighbour(false), b, a)].map(|(before, at, other)| match before {
            Some(before) => (other - before).try_normalize(0.0).unwrap_or_default(),
            None => self.direction_at_corner(segment.curve, at, &(other - at)),
        })
    }

    /// The direction of a curve at its end corner, on the side of the chord.
    fn direction_at_corner(&self, curve: CurveId, at: &Point, chord: &Vector) -> Vector {
        /// Below this sine (half a degree) the direction from the two normals is too noisy.
        const TRANSVERSAL: f64 = 0.01;
        /// An apex, which has no normal, within this fraction of the segment.
        const APEX: f64 = 1e-6;
        let surfaces = self.features.curve(curve).surfaces.map(|s| &self.geometry.surfaces[s.index()]);
        let line = surfaces[0].normal(at).cross(&surfaces[1].normal(at));
        let is_apex = surfaces.iter().any(|s| s.has_apex_at(at, APEX * chord.norm()));
        let direction =
            if !is_apex && line.norm() > TRANSVERSAL { line * line.dot(chord).signum() } else { *chord };
        direction.try_normalize(0.0).unwrap_or_default()
    }

    /// The mesh of a master patch moved to its periodic copy.
    ///
    /// # Panics
    /// If a boundary vertex has no copy.
    fn moved(&self, of: &Meshed, id: PatchId, motion: &Isometry3<f64>) -> Meshed {
        let patch = self.features.patch(id);
        let surface = &self.geometry.surfaces[patch.surface.index()];
        let on_curves = patch.boundary.iter().flat_map(|(curve, _)| self.ranges[curve.index()].clone());
        let ends = on_curves.flat_map(|s| self.curves.segments[s].vertices).map(|v| v.0);
        let inner = patch.corners.iter().map(|corner| self.corners[corner.index()]);
        let isolated = self.isolated.iter().map(|isolated| isolated.0);
        let mut vertices: Vec<u32> = ends.chain(inner).chain(isolated).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let place = |v: u32| self.curves.points[v as usize];
        let distance = same_place(&self.features.bounds);
        let places = Places::new(vertices.into_iter().map(|v| (v, place(v))), distance);
        let copy = |&v: &u32| {
            let found = places.find(&(motion * place(v)));
            found.unwrap_or_else(|| panic!("vertex {v} has no periodic copy on patch {}", id.0))
        };
        let mut out = Meshed {
            inputs: of.inputs.iter().map(copy).collect(),
            points: of.points.iter().map(|p| motion * p).collect(),
            triangles: of.triangles.clone(),
            report: PatchReport { patch: id, ..of.report.clone() },
        };
        let at = |v: u32| match out.inputs.get(v as usize) {
            Some(&input) => place(input),
            None => out.points[v as usize - out.inputs.len()],
        };
        if let Some([a, b, c]) = out.triangles.first().map(|t| t.map(at)) {
            let normal = surface.normal(&a) * if patch.flipped { -1.0 } else { 1.0 };
            if (b - a).cross(&(c - a)).dot(&normal) < 0.0 {
                out.triangles.iter_mut().for_each(|t| t.swap(1, 2));
            }
        }
        out
    }

    fn mesh(&self, id: PatchId) -> Result<Meshed, SurfaceError> {
        let patch = self.features.patch(id);
        let surface = &self.geometry.surfaces[patch.surface.index()];
        let mut out = Meshed {
            inputs: Vec::new(),
            points: Vec::new(),
            triangles: Vec::new(),
            report: PatchReport::blank(id),
        };
        let mut parts = Vec::new();
        for &side in sheets(surface) {
            let part = Part::new(self, id, surface, side);
            if part.uses.is_empty() && part.seeds.is_empty() {
                continue;
            }
            parts.push(part.mesh()?);
        }
        // The input vertices of all parts first, then the new vertices of all parts.
        out.inputs = parts.iter().flat_map(|(part, _)| part.vertices.iter().copied()).collect();
        let total = out.inputs.len();
        let mut fixed_before = 0;
        for (part, sheet) in &parts {
            let fixed = part.vertices.len();
            let (offset, new) = (fixed_before, total + out.points.len());
            let number = |v: u32| {
                let v = v as usize;
                (if v < fixed { offset + v } else { new + v - fixed }) as u32
            };
            let (used, triangles) = finished(sheet, fixed);
            out.points.extend(used);
            for t in triangles {
                let [a, b, c] = t.map(number);
                out.triangles.push(if patch.flipped { [a, c, b] } else { [a, b, c] });
            }
            out.report.measure(sheet);
            fixed_before += fixed;
        }
        for (part, _) in parts {
            part.count(&mut out.report);
        }
        out.report.vertices = out.points.len();
        out.report.finish();
        Ok(out)
    }
}

/// One sheet of a patch with its part of the input.
struct Part<'a> {
    input: &'a Input<'a>,
    id: PatchId,
    surface: &'a Surface,
    chart: Chart,
    /// The input vertex of each local vertex.
    vertices: Vec<u32>,
    pieces: Vec<Piece>,
    /// The input segment of each piece.
    segments: Vec<usize>,
    uses: Vec<(u32, bool)>,
    seeds: Vec<Point>,
    advanced: Advanced,
    improved: Improved,
    flattening: (usize, usize),
}

impl<'a> Part<'a> {
    fn new(input: &'a Input<'a>, id: PatchId, surface: &'a Surface, side: f64) -> Self {
        let patch = input.features.patch(id);
        let here = |p: &Point| {
            let n = nappe(surface, p);
            n == side || n == 0.0
        };
        let point = |v: VertexId| &input.curves.points[v.index()];
        let mut segments: Vec<usize> = patch
            .boundary
            .iter()
            .flat_map(|&(curve, _)| input.ranges[curve.index()].clone())
            .filter(|&s| {
                let [a, b] = input.curves.segments[s].vertices.map(point);
                here(&nalgebra::center(a, b))
            })
            .collect();
        segments.sort_unstable();
        segments.dedup();
        let ends = segments.iter().flat_map(|&s| input.curves.segments[s].vertices).map(|v| v.0);
        let isolated = input
            .isolated
            .iter()
            .filter(|&&(_, corner)| input.features.corners[corner].surfaces.contains(&patch.surface));
        let inner = patch.corners.iter().map(|corner| input.corners[corner.index()]);
        let alone = isolated.map(|&(v, _)| v).chain(inner).filter(|&v| here(point(VertexId(v))));
        // In the order of the segments, so that consecutive vertices are close.
        let mut vertices: Vec<u32> = Vec::new();
        let mut sorted: Vec<(u32, usize)> = ends.chain(alone).enumerate().map(|(k, v)| (v, k)).collect();
        sorted.sort_unstable();
        sorted.dedup_by_key(|(v, _)| *v);
        sorted.sort_unstable_by_key(|&(_, k)| k);
        vertices.extend(sorted.iter().map(|&(v, _)| v));
        let mut lookup: Vec<(u32, u32)> = vertices.iter().enumerate().map(|(k, &v)| (v, k as u32)).collect();
        lookup.sort_unstable();
        let local =
            |v: VertexId| lookup[lookup.binary_search_by_key(&v.0, |&(v, _)| v).expect("listed above")].1;
        let pieces = segments
            .iter()
            .map(|&s| Piece {
                ends: input.curves.segments[s].vertices.map(local),
                tangents: input.tangents[s],
            })
            .collect();
        // The chart is oriented by the gradient; for a flipped patch the sides of curves are
        // exchanged.
        let mut uses = Vec::new();
        for &(curve, forward) in &patch.boundary {
            for s in input.ranges[curve.index()].clone() {
                if let Ok(k) = segments.binary_search(&s) {
                    uses.push((k as u32, forward != patch.flipped));
                }
            }
        }
        Self {
            input,
            id,
            surface,
            chart: Chart::new(surface, side),
            vertices,
            pieces,
            segments,
            uses,
            seeds: patch.seeds.iter().filter(|p| here(p)).copied().collect(),
            advanced: Advanced::default(),
            improved: Improved::default(),
            flattening: (0, 0),
        }
    }

    fn mesh(mut self) -> Result<(Self, Sheet<'a>), SurfaceError> {
        let settings = self.input.settings;
        let mut sheet = Sheet::new(self.surface, self.chart.clone(), self.input.size, settings);
        let meshed = self.fill(&mut sheet);
        match meshed {
            Ok(()) => Ok((self, sheet)),
            Err(Failure::Fault(fault)) => Err(self.located(fault)),
            Err(Failure::Stop(Stop::Projection(source))) => {
                Err(SurfaceError::Projection { patch: self.id, source })
            }
            Err(Failure::Stop(Stop::Size(at, size))) => {
                Err(SurfaceError::BadSize { patch: self.id, at, size })
            }
            Err(Failure::TooMany) => {
                Err(SurfaceError::TooManyVertices { patch: self.id, limit: settings.max_vertices })
            }
        }
    }

    fn fill(&mut self, sheet: &mut Sheet<'a>) -> Result<(), Failure> {
        let settings = self.input.settings;
        for node in self.fixed_nodes(sheet)? {
            sheet.nodes.push(node);
        }
        sheet.pieces = self.pieces.clone();
        let seeds: Vec<_> = self.seeds.iter().map(|p| sheet.chart.site(self.surface, p)).collect();
        embed(sheet, &self.uses, &seeds)?;
        sheet.legalise_all();
        condition(sheet, settings.max_vertices)?;
        self.advanced = advance(sheet, settings.max_vertices)?;
        if sheet.nodes.len() >= settings.max_vertices {
            return Err(Failure::TooMany);
        }
        let (found, _) = repair_flattening(sheet)?;
        self.improved = improve(sheet, settings)?;
        // The improvement penalises such triangles and makes them only if there is no alternative.
        let (more, left) = repair_flattening(sheet)?;
        self.flattening = (found + more, left);
        split_tip(sheet)?;
        Ok(())
    }

    /// The nodes on corners and curves. Their size is at most slightly larger than their longest
    /// segment, so that the first layer fits the segments.
    fn fixed_nodes(&self, sheet: &Sheet) -> Result<Vec<Node>, Stop> {
        /// Segments are shorter than wanted, because each curve has a whole number of them.
        const LONGER: f64 = 1.25;
        let mut longest = vec![0.0_f64; self.vertices.len()];
        let point = |v: u32| self.input.curves.points[self.vertices[v as usize] as usize];
        for piece in &self.pieces {
            let [a, b] = piece.ends;
            for v in [a, b] {
                longest[v as usize] = longest[v as usize].max((point(b) - point(a)).norm());
            }
        }
        longest
            .iter()
            .enumerate()
            .map(|(v, &length)| {
                let point = point(v as u32);
                let size = sheet.wanted_size(&point)?;
                let size = if length > 0.0 { size.min(LONGER * length) } else { size };
                Ok(sheet.node(point, size, Kind::Fixed))
            })
            .collect()
    }

    /// Converts a fault to the numbers and positions of the input.
    fn located(&self, fault: Fault) -> SurfaceError {
        let patch = self.id;
        let segment = |s: u32| self.segments[s as usize];
        let curve = |s: u32| self.input.curves.segments[segment(s)].curve;
        let vertex = |v: u32| self.input.curves.points[self.vertices[v as usize] as usize];
        let middle = |s: u32| {
            let [a, b] = self.pieces[s as usize].ends.map(vertex);
            nalgebra::center(&a, &b)
        };
        match fault {
            Fault::Coincident(v, _) => SurfaceError::Coincident { patch, at: vertex(v) },
            Fault::Coarse(conflicts) => {
                let (s, other) = match conflicts[0] {
                    Conflict::Crossing(s, t) => (s, Some(curve(t))),
                    Conflict::Through(s, _) | Conflict::TooLong(s) => (s, None),
                };
                let segments = conflicts.iter().flat_map(|c| match *c {
                    Conflict::Crossing(s, t) => vec![segment(s), segment(t)],
                    Conflict::Through(s, _) | Conflict::TooLong(s) => vec![segment(s)],
                });
                let (curve, at) = (curve(s), middle(s));
                SurfaceError::TooCoarse {
                    patch,
                    curve,
                    other,
                    at,
                    segments: segments.collect(),
                    places: Vec::new(),
                }
            }
            Fault::BothSides(s) => SurfaceError::BothSides { patch, curve: curve(s), at: middle(s) },
            Fault::Open | Fault::StartInTheWay => SurfaceError::NotEnclosed(patch),
            Fault::NotNumbers => SurfaceError::NotNumbers(patch),
        }
    }

    fn count(&self, report: &mut PatchReport) {
        report.refused += self.advanced.refused;
        report.swaps += self.improved.swaps;
        report.moves += self.improved.moves;
        report.collapses += self.improved.collapses;
        report.splits += self.improved.splits;
        report.flattening_repaired += self.flattening.0 - self.flattening.1;
        report.flattening_left += self.flattening.1;
    }
}

/// Splits the triangle at the apex of a cone if it is the only one there: it would coincide with
/// one in a plane through the apex.
fn split_tip(sheet: &mut Sheet) -> Result<(), Stop> {
    let apex = sheet.nodes.iter().position(|n| n.kind == Kind::Fixed && sheet.chart.is_pole(&n.site));
    if let Some(apex) = apex {
        let mut ring = Vec::new();
        sheet.mesh.around(apex as u32, &mut ring);
        if let [t] = ring[..] {
            split(sheet, t, sheet.mesh.at(t).corner(apex as u32), f64::INFINITY)?;
        }
    }
    Ok(())
}

/// Why a part was not filled.
enum Failure {
    Fault(Fault),
    Stop(Stop),
    TooMany,
}

impl From<Fault> for Failure {
    fn from(fault: Fault) -> Self {
        Self::Fault(fault)
    }
}

impl From<Stop> for Failure {
    fn from(stop: Stop) -> Self {
        Self::Stop(stop)
    }
}

/// The new points of a sheet that are used by triangles, and its triangles, with the new points
/// numbered after the `fixed` ones.
fn finished(sheet: &Sheet, fixed: usize) -> (Vec<Point>, Vec<[u32; 3]>) {
    let mut old_to_new: Vec<u32> =
        (0..sheet.nodes.len() as u32).map(|v| if (v as usize) < fixed { v } else { NONE }).collect();
    let mut triangles: Vec<[u32; 3]> = sheet.mesh.living().map(|t| sheet.mesh.at(t).v).collect();
    for v in triangles.iter().flatten() {
        old_to_new[*v as usize] = *v;
    }
    let mut points = Vec::new();
    for (new, node) in old_to_new.iter_mut().zip(&sheet.nodes).skip(fixed) {
        if *new != NONE {
            *new = (fixed + points.len()) as u32;
            points.push(node.point);
        }
    }
    for v in triangles.iter_mut().flatten() {
        *v = old_to_new[*v as usize];
    }
    (points, triangles)
}
