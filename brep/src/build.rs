//! The model of the shapes of a BREP file.

use crate::model::{Corner, EdgeCurve, Fin, Model, On, Patch};
use crate::placement::Placements;
use crate::read::{CurveOnSurface, File, Kind, Orientation, Use};
use crate::shapes::{Shapes, left_out};
use crate::{BrepError, Placement};
use std::collections::BTreeMap;

/// Makes the model of a file.
///
/// # Errors
/// As for [`Model::read`].
pub(crate) fn build(file: &File) -> Result<Model, BrepError> {
    let mut builder = Builder::new(file);
    builder.build()?;
    if builder.model.bodies == 0 {
        return builder.enclosed();
    }
    let Builder { mut model, without_parameters, .. } = builder;
    if without_parameters == 0 {
        return Ok(model);
    }
    let what = "edges have no curve in the parameters of a face: all are followed across their faces";
    model.notes.push(format!("{without_parameters} {what}"));
    Shapes::of(&model).remake(&model, &[])
}

/// A shape at a place: its index and the bits of its placement.
type Key = (u32, [u64; 12]);

/// A use of a shape with what all shapes above it do to it.
#[derive(Clone, Copy)]
struct Placed {
    shape: u32,
    orientation: Orientation,
    placement: Placement,
    depth: u32,
}

impl Placed {
    fn key(&self) -> Key {
        (self.shape, self.placement.bits())
    }
}

struct Builder<'a> {
    file: &'a File,
    model: Model,
    corners: BTreeMap<Key, usize>,
    curves: BTreeMap<Key, usize>,
    patches: BTreeMap<Key, usize>,
    uses: usize,
    /// Faces of no solid.
    free: Vec<Placed>,
    loose_edges: usize,
    /// Uses of edges that have no curve in the parameters of their surface, which is no plane.
    without_parameters: usize,
    placements: Placements,
}

/// Compounds may be nested this deep.
const DEEPEST: u32 = 100;
/// The most uses of shapes: a small file can use its shapes exponentially often.
const MOST_USES: usize = 20_000_000;

fn composed(outer: Orientation, inner: Orientation) -> Orientation {
    use Orientation::{External, Forward, Internal, Reversed};
    match (outer, inner) {
        (Forward, x) => x,
        (Reversed, Forward) => Reversed,
        (Reversed, Reversed) => Forward,
        (Reversed, x) => x,
        (Internal | External, _) => outer,
    }
}

impl<'a> Builder<'a> {
    fn new(file: &'a File) -> Self {
        let mut placements = Placements::default();
        placements.only(Placement::IDENTITY);
        Self {
            file,
            model: Model::default(),
            corners: BTreeMap::new(),
            curves: BTreeMap::new(),
            patches: BTreeMap::new(),
            uses: 0,
            free: Vec::new(),
            loose_edges: 0,
            without_parameters: 0,
            placements,
        }
    }

    fn placed(&mut self, part: &Use, above: &Placed) -> Result<Placed, BrepError> {
        self.uses += 1;
        let line = self.file.shapes[part.shape as usize].line;
        if self.uses > MOST_USES || above.depth >= DEEPEST {
            let what =
                format!("shapes are nested more than {DEEPEST} deep or used more than {MOST_USES} times");
            return Err(BrepError::Syntax { line, what });
        }
        Ok(Placed {
            shape: part.shape,
            orientation: composed(above.orientation, part.orientation),
            placement: self.product(&above.placement, part.location as usize),
            depth: above.depth + 1,
        })
    }

    /// A placement after one of the file: one shape reached in two ways has the same bits.
    fn product(&mut self, placement: &Placement, location: usize) -> Placement {
        if location == 0 {
            return *placement;
        }
        self.placements.only(placement.after(&self.file.locations[location]))
    }

    /// The parts of a shape, in order.
    fn parts(&mut self, of: &Placed) -> Result<Vec<Placed>, BrepError> {
        let file = self.file;
        file.shapes[of.shape as usize].parts.iter().map(|part| self.placed(part, of)).collect()
    }

    fn build(&mut self) -> Result<(), BrepError> {
        let top = Placed {
            shape: u32::MAX,
            orientation: Orientation::Forward,
            placement: Placement::IDENTITY,
            depth: 0,
        };
        let mut stack = Vec::new();
        for root in self.file.roots.iter().rev() {
            stack.push(self.placed(root, &top)?);
        }
        while let Some(shape) = stack.pop() {
            match self.file.shapes[shape.shape as usize].kind {
                Kind::Solid => self.add_body(&shape)?,
                Kind::Face { .. } => self.free.push(shape),
                Kind::Edge { .. } | Kind::Wire | Kind::Vertex { .. } => self.loose_edges += 1,
                Kind::Compound | Kind::Shell => {
                    let parts = self.parts(&shape)?;
                    stack.extend(parts.into_iter().rev());
                }
            }
        }
        let (faces, edges) = (self.free.len(), self.loose_edges);
        let notes = &mut self.model.notes;
        if self.model.bodies > 0 {
            notes.extend(left_out(faces));
        }
        if edges > 0 {
            notes.push(format!("{edges} edges, wires or vertices of no face are left out"));
        }
        Ok(())
    }

    /// The solids that the faces of a file without solids enclose.
    fn enclosed(mut self) -> Result<Model, BrepError> {
        use Orientation::{External, Internal};
        for face in std::mem::take(&mut self.free) {
            let is_inside = matches!(face.orientation, Internal | External);
            if !is_inside && !self.patches.contains_key(&face.key()) {
                self.add_side(self.model.bodies, &face)?;
                self.model.bodies += 1;
            }
        }
        let mut shapes = Shapes::of(&self.model);
        self.model.from_faces = true;
        self.model.bodies = shapes.enclose(self.loose_edges, &mut self.model.notes)?.len();
        shapes.remake(&self.model, &[])
    }

    fn add_body(&mut self, solid: &Placed) -> Result<(), BrepError> {
        let body = self.model.bodies;
        self.model.bodies += 1;
        for shell in self.parts(solid)? {
            if !matches!(self.file.shapes[shell.shape as usize].kind, Kind::Shell) {
                continue;
            }
            for face in self.parts(&shell)? {
                if matches!(self.file.shapes[face.shape as usize].kind, Kind::Face { .. }) {
                    self.add_side(body, &face)?;
                }
            }
        }
        Ok(())
    }

    /// Adds a body on one side of a face.
    fn add_side(&mut self, body: usize, face: &Placed) -> Result<(), BrepError> {
        let patch = match self.patches.get(&face.key()) {
            Some(&patch) => patch,
            None => {
                let patch = self.patch(face)?;
                self.model.patches.push(patch);
                self.patches.insert(face.key(), self.model.patches.len() - 1);
                self.model.patches.len() - 1
            }
        };
        let side = match face.orientation {
            Orientation::Forward => 0,
            Orientation::Reversed => 1,
            Orientation::Internal | Orientation::External => {
                return Err(BrepError::face(patch, "it lies inside a solid: split the solid there", None));
            }
        };
        let bodies = &mut self.model.patches[patch].bodies;
        if bodies.contains(&Some(body)) {
            let what = "a solid is on both sides of it: remove the face, or split the solid there";
            return Err(BrepError::face(patch, what, None));
        }
        if bodies[side].is_some() {
            let what = "two solids are on the same side of it: they overlap, or one is inside out";
            return Err(BrepError::face(patch, what, None));
        }
        bodies[side] = Some(body);
        Ok(())
    }

    fn patch(&mut self, face: &Placed) -> Result<Patch, BrepError> {
        let number = self.model.patches.len();
        let Kind::Face { surface } = self.file.shapes[face.shape as usize].kind else {
            unreachable!("a face");
        };
        let Some((surface, location)) = surface else {
            return Err(BrepError::face(number, "it has no surface, only triangles", None));
        };
        let own = self.file.locations[location];
        let placed = self.file.surfaces[surface].placed(&face.placement.after(&own));
        // Orientations in loops are those of the face used forward.
        let forward = Placed { orientation: Orientation::Forward, ..*face };
        let mut loops = Vec::new();
        for wire in self.parts(&forward)? {
            if !matches!(self.file.shapes[wire.shape as usize].kind, Kind::Wire) {
                continue;
            }
            let mut fins = Vec::new();
            for edge in self.parts(&wire)? {
                if matches!(edge.orientation, Orientation::Internal | Orientation::External) {
                    let what = "an edge inside of it belongs to no loop: imprinted edges are not supported";
                    return Err(BrepError::face(number, what, None));
                }
                fins.push(self.fin(
                    number,
                    &edge,
                    (surface, &face.placement.after(&own), placed.is_plane()),
                )?);
            }
            // Wires list their edges in any order if their orientation is reversed.
            if wire.orientation == Orientation::Reversed {
                fins.reverse();
            }
            loops.extend(self.loops(number, fins)?);
        }
        if loops.is_empty() {
            return Err(BrepError::face(number, "it has no edges", None));
        }
        Ok(Patch { surface: placed, loops, bodies: [None; 2] })
    }

    /// The corners at the start and the end of a side, along its loop.
    fn ends(&self, fin: &Fin) -> [usize; 2] {
        let [first, last] = match fin.on {
            On::Corner(corner) => [corner; 2],
            On::Curve(curve) => self.model.curves[curve].ends,
        };
        if fin.is_forward { [first, last] } else { [last, first] }
    }

    /// Sorts the sides of a wire into loops in which each starts where the last one ends.
    fn loops(&self, face: usize, fins: Vec<Fin>) -> Result<Vec<Vec<Fin>>, BrepError> {
        let count = fins.len();
        let extent = fins.iter().map(|fin| parameter_gap(fin, fin)).fold(0.0, f64::max);
        let joins = |k: usize| {
            let (fin, next) = (&fins[k], &fins[(k + 1) % count]);
            let is_near = parameter_gap(fin, next) <= JOINED * extent;
            self.ends(fin)[1] == self.ends(next)[0] && (is_near || count == 1)
        };
        if (0..count).all(joins) {
            return Ok(vec![fins]);
        }
        // The sides by the corner where they start.
        let mut starts: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
        for (k, fin) in fins.iter().enumerate() {
            starts.entry(self.ends(fin)[0]).or_default().push(k);
        }
        let mut is_taken = vec![false; count];
        let mut loops = Vec::new();
        for first in 0..count {
            if is_taken[first] {
                continue;
            }
            let mut order = Vec::new();
            let mut at = first;
            loop {
                is_taken[at] = true;
                order.push(fins[at].clone());
                let end = self.ends(&fins[at])[1];
                let beside = starts.get_mut(&end).map(|all| {
                    all.retain(|&k| !is_taken[k]);
                    &*all
                });
                // Where a loop meets a corner twice, the parameters decide.
                let gap = |k: usize| parameter_gap(&fins[at], &fins[k]);
                let closes = (end == self.ends(&fins[first])[0]).then(|| gap(first));
                match beside.and_then(|all| all.iter().min_by(|a, b| gap(**a).total_cmp(&gap(**b)))) {
                    Some(&next) if closes.is_none_or(|closing| gap(next) < closing) => at = next,
                    _ if closes.is_some() => break,
                    _ => {
                        let place = self.model.corners[end].point;
                        return Err(BrepError::face(face, "its edges do not form closed loops", Some(place)));
                    }
                }
            }
            loops.push(order);
        }
        Ok(loops)
    }

    fn fin(
        &mut self,
        face: usize,
        edge: &Placed,
        (surface, placement, is_plane): (usize, &Placement, bool),
    ) -> Result<Fin, BrepError> {
        let file = self.file;
        let Kind::Edge { is_degenerate, curve, on_surfaces, .. } = &file.shapes[edge.shape as usize].kind
        else {
            return Err(BrepError::face(face, "a wire has parts other than edges", None));
        };
        let is_forward = edge.orientation == Orientation::Forward;
        let on = if *is_degenerate { self.degenerate(face, edge)? } else { self.curve(face, edge)? };
        let matches = |on: &&CurveOnSurface| {
            let there = edge.placement.after(&file.locations[on.location]);
            on.surface == surface && there.is_close(placement)
        };
        match on_surfaces.iter().find(matches) {
            Some(own) => Ok(Fin {
                on,
                curve: Some(file.curves_2d[own.curves[usize::from(!is_forward)]].clone()),
                range: own.range,
                is_forward,
            }),
            None => {
                self.without_parameters += usize::from(!is_plane || *is_degenerate);
                let range = curve.map_or([0.0, 1.0], |(_, _, range)| range);
                Ok(Fin { on, curve: None, range, is_forward })
            }
        }
    }

    /// The corners at the first and the last end of an edge.
    fn vertices(&mut self, face: usize, edge: &Placed) -> Result<[usize; 2], BrepError> {
        let forward = Placed { orientation: Orientation::Forward, ..*edge };
        let mut ends = [None; 2];
        for part in self.parts(&forward)? {
            let Kind::Vertex { point, tolerance } = self.file.shapes[part.shape as usize].kind else {
                continue;
            };
            let end = match part.orientation {
                Orientation::Forward => 0,
                Orientation::Reversed => 1,
                Orientation::Internal | Orientation::External => continue,
            };
            let corners = &mut self.model.corners;
            let corner = *self.corners.entry(part.key()).or_insert_with(|| {
                let tolerance = tolerance * part.placement.scale();
                corners.push(Corner { point: part.placement.point(&point), tolerance });
                corners.len() - 1
            });
            ends[end] = Some(corner);
        }
        match ends {
            [Some(first), Some(last)] => Ok([first, last]),
            _ => Err(BrepError::face(face, "an edge has no vertex at an end", None)),
        }
    }

    fn degenerate(&mut self, face: usize, edge: &Placed) -> Result<On, BrepError> {
        let [first, last] = self.vertices(face, edge)?;
        if first == last {
            return Ok(On::Corner(first));
        }
        let place = self.model.corners[first].point;
        Err(BrepError::face(face, "an edge without length has two vertices", Some(place)))
    }

    fn curve(&mut self, face: usize, edge: &Placed) -> Result<On, BrepError> {
        if let Some(&curve) = self.curves.get(&edge.key()) {
            return Ok(On::Curve(curve));
        }
        let ends = self.vertices(face, edge)?;
        let file = self.file;
        let Kind::Edge { curve, tolerance, .. } = &file.shapes[edge.shape as usize].kind else {
            unreachable!("an edge");
        };
        let number = self.model.curves.len();
        let Some((curve, location, range)) = *curve else {
            let place = self.model.corners[ends[0]].point;
            return Err(BrepError::edge(number, "it has no curve in space", Some(place)));
        };
        if range[0] >= range[1] {
            let place = self.model.corners[ends[0]].point;
            return Err(BrepError::edge(number, "its range of parameters is empty", Some(place)));
        }
        let placement = edge.placement.after(&file.locations[location]);
        self.model.curves.push(EdgeCurve {
            curve: file.curves[curve].placed(&placement),
            range,
            ends,
            tolerance: tolerance * placement.scale(),
        });
        self.curves.insert(edge.key(), number);
        Ok(On::Curve(number))
    }
}

/// Sides join if their gap in parameters is at most this fraction of the longest side.
const JOINED: f64 = 0.01;

/// The distance in parameters between the end of one side and the start of another.
fn parameter_gap(one: &Fin, other: &Fin) -> f64 {
    let end = |fin: &Fin, at: usize| {
        let at = if fin.is_forward { at } else { 1 - at };
        fin.curve.as_ref().map(|curve| curve.point(fin.range[at]))
    };
    end(one, 1).zip(end(other, 0)).map_or(0.0, |(a, b)| (b - a).norm())
}

#[cfg(test)]
mod tests {
    use crate::{Model, Settings, Tessellation, tessellate};

    /// A BREP file of the repository.
    fn text(name: &str) -> String {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../geometries/brep");
        std::fs::read_to_string(folder.join(name).with_extension("brep")).expect("a file of the repository")
    }

    /// The volume of the only solid.
    fn volume(mut model: Model) -> f64 {
        let tessellation = Tessellation::of(&mut model, &Settings::default()).unwrap();
        tessellate::volume(&model, &tessellation, 0)
    }

    #[test]
    fn the_first_factor_of_a_placement_is_the_innermost() {
        // A quarter turn around z, a shift by 10 along x, and both.
        let table =
            "Locations 3\n1\n0 -1 0 0\n1 0 0 0\n0 0 1 0\n1\n1 0 0 10\n0 1 0 0\n0 0 1 0\n2 1 1 2 1 0\n";
        let own = text("cone_frustum");
        let placed = own.replace("Locations 0\n", table).replace("+1 0", "+1 3");
        let [own, placed] = [own, placed].map(|text| Model::read(text.as_bytes()).unwrap());
        for (before, after) in own.corners.iter().zip(&placed.corners) {
            let [x, y, z] = [before.point.x, before.point.y, before.point.z];
            assert!((after.point - crate::Point::new(10.0 - y, x, z)).norm() < 1e-12);
        }
    }

    #[test]
    fn edges_reached_by_equal_placements_up_to_rounding_are_one() {
        // A turn by one radian, the turn back, and both.
        let (s, c) = 1_f64.sin_cos();
        let turn = |s: f64| format!("1\n{c} {} 0 0\n{s} {c} 0 0\n0 0 1 0\n", -s);
        let table = format!("Locations 3\n{}{}2 1 1 2 1 0\n", turn(s), turn(-s));
        let placed = text("sphere").replace("Locations 0\n", &table).replace("+6 0 -7 0 *", "+6 0 -7 3 *");
        let model = Model::read(placed.as_bytes()).unwrap();
        assert_eq!((model.corners.len(), model.curves.len()), (2, 1));
    }

    #[test]
    fn faces_whose_edges_have_no_parameters_are_the_same_solid() {
        for name in ["cone_frustum", "sphere"] {
            let whole = text(name);
            let (geometry, shapes) = whole.split_once("TShapes").unwrap();
            let is_in_parameters = |line: &&str| line.starts_with("2  ") || line.starts_with("3  ");
            let kept: Vec<&str> = shapes.lines().filter(|line| !is_in_parameters(line)).collect();
            let bare = format!("{geometry}TShapes{}", kept.join("\n"));
            assert!(bare.len() < whole.len());
            let [whole, bare] = [&whole, &bare].map(|text| Model::read(text.as_bytes()).unwrap());
            assert!(whole.notes.is_empty() && bare.notes[0].contains("followed"), "{:?}", bare.notes);
            let [whole, bare] = [volume(whole), volume(bare)];
            assert!((bare / whole - 1.0).abs() < 1e-3, "{name}: {whole} {bare}");
        }
    }

    #[test]
    fn the_zero_that_draw_writes_last_is_no_shape() {
        let own = text("torus");
        let saved = format!("{own}\n0\n\n");
        let [own, saved] = [own, saved].map(|text| Model::read(text.as_bytes()).unwrap());
        assert_eq!(own, saved);
    }
}
