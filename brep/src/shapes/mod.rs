//! Solids by their faces, edges and vertices, without parameters, and the model made of them.

mod enclose;
mod exchange;
mod glue;
mod imprint;
mod overlap;
mod split;
#[cfg(test)]
mod tests;
mod without_area;

pub(crate) use enclose::left_out;
pub(crate) use glue::{bounds, is_same_surface};
pub(crate) use overlap::{Care, Cuts};

use crate::chart::{Chart, Loop, Side, close};
use crate::model::{AWAY, Corner, Fin, Model, On, Patch};
use crate::nearest::nearest_on_surface;
use crate::tessellate::diagonal;
use crate::{BrepError, EdgeCurve, Point, Surface, Vector};
use rayon::prelude::*;

/// The edges of a loop, each with whether it is used forward.
pub(crate) type Edges = Vec<(usize, bool)>;

/// A face of one solid.
#[derive(Clone)]
pub(crate) struct Face {
    /// The number of its record.
    pub id: u64,
    pub surface: Surface,
    /// Its loops, counterclockwise around the normal of the surface.
    pub loops: Vec<Edges>,
    /// Curves on its surface that are to divide it where they are inside of it.
    pub inner: Vec<usize>,
    pub body: usize,
    /// Whether the body is behind it, seen along the normal of its surface.
    pub is_behind: bool,
    pub name: Option<String>,
}

impl Face {
    /// The unit normal at a place, out of its body.
    fn outward(&self, place: &Point) -> Vector {
        let normal = nearest_on_surface(&self.surface, place).normal;
        if self.is_behind { normal } else { -normal }
    }
}

/// The shapes of all solids, nothing shared between them.
#[derive(Default)]
pub(crate) struct Shapes {
    pub corners: Vec<Corner>,
    pub curves: Vec<EdgeCurve>,
    pub faces: Vec<Face>,
    /// The body of each corner and curve.
    pub body_of_corner: Vec<usize>,
    pub body_of_curve: Vec<usize>,
    /// How accurate the data of each body is (length).
    pub accuracy: Vec<f64>,
    /// Vertices so far from their curve that it must be little beside the whole model: how far, and
    /// the error else.
    pub away: Vec<(f64, BrepError)>,
}

impl Shapes {
    /// The shapes of a model, one face for each side of a patch that bounds a body.
    pub fn of(model: &Model) -> Self {
        let (corners, curves) = (model.corners.clone(), model.curves.clone());
        let (body_of_corner, body_of_curve) = (vec![0; corners.len()], vec![0; curves.len()]);
        let mut shapes = Self {
            corners,
            curves,
            faces: Vec::new(),
            body_of_corner,
            body_of_curve,
            accuracy: vec![0.0; model.bodies],
            away: Vec::new(),
        };
        for (number, patch) in model.patches.iter().enumerate() {
            let edge = |fin: &Fin| match fin.on {
                On::Curve(curve) => Some((curve, fin.is_forward)),
                On::Corner(_) => None,
            };
            let edges = |fins: &Vec<Fin>| fins.iter().filter_map(edge).collect();
            let loops: Vec<Edges> =
                patch.loops.iter().map(edges).filter(|edges: &Edges| !edges.is_empty()).collect();
            for (side, body) in patch.bodies.iter().enumerate() {
                let Some(body) = *body else { continue };
                for &(curve, _) in loops.iter().flatten() {
                    shapes.body_of_curve[curve] = body;
                    shapes.curves[curve].ends.iter().for_each(|&end| shapes.body_of_corner[end] = body);
                }
                shapes.faces.push(Face {
                    id: number as u64 + 1,
                    surface: patch.surface.clone().closed(),
                    loops: loops.clone(),
                    inner: Vec::new(),
                    body,
                    is_behind: side == 0,
                    name: model.patch_names.get(number).cloned().flatten(),
                });
            }
        }
        shapes.take_accuracies();
        shapes
    }

    /// Sets the accuracy of each body to the least tolerance of its edges: programs give worse
    /// edges larger tolerances.
    fn take_accuracies(&mut self) {
        self.accuracy.fill(f64::INFINITY);
        for face in &self.faces {
            for (curve, _) in face.loops.iter().flatten() {
                let accuracy = &mut self.accuracy[face.body];
                *accuracy = accuracy.min(self.curves[*curve].tolerance);
            }
        }
        for accuracy in self.accuracy.iter_mut().filter(|accuracy| accuracy.is_infinite()) {
            *accuracy = 0.0;
        }
    }

    /// Adds a corner of a body.
    fn add_corner(&mut self, corner: Corner, body: usize) -> usize {
        self.corners.push(corner);
        self.body_of_corner.push(body);
        self.corners.len() - 1
    }

    /// The curves of a face, each once, in ascending order.
    fn curves_of(&self, face: usize) -> Vec<usize> {
        let mut curves: Vec<usize> = self.faces[face].loops.iter().flatten().map(|edge| edge.0).collect();
        curves.sort_unstable();
        curves.dedup();
        curves
    }

    /// The curves of a face that are no seams, in ascending order.
    fn curves_used_once(&self, face: usize) -> Vec<usize> {
        let mut uses: Vec<usize> = self.faces[face].loops.iter().flatten().map(|edge| edge.0).collect();
        uses.sort_unstable();
        uses.chunk_by(|a, b| a == b).filter(|uses| uses.len() == 1).flatten().copied().collect()
    }

    /// The curves of a face and those that are to divide it.
    fn curves_on(&self, face: usize) -> Vec<usize> {
        let mut curves = self.curves_of(face);
        curves.extend(&self.faces[face].inner);
        curves
    }

    /// Divides faces and edges of solids that touch on a common surface. Returns whether there may
    /// be any.
    pub fn imprint(&mut self) -> bool {
        let size = self.size();
        imprint::imprint(self, size)
    }

    /// The diagonal of the box around all shapes.
    fn size(&self) -> f64 {
        let without_edges = self.faces.iter().filter(|face| face.loops.is_empty());
        let points = without_edges.flat_map(|face| imprint::whole(&face.surface)).collect();
        diagonal(&self.corners, &self.curves, points)
    }

    /// The model of shapes that were made of an old one, without the bodies `gone`, which have no
    /// faces.
    ///
    /// # Errors
    /// As for [`Self::build`].
    pub fn remake(mut self, old: &Model, gone: &[usize]) -> Result<Model, BrepError> {
        let left: Vec<usize> = (0..old.bodies).filter(|body| !gone.contains(body)).collect();
        // What belongs to a body without faces is not used.
        let number = |body: usize| left.binary_search(&body).unwrap_or(0);
        let of_edges = [&mut self.body_of_corner, &mut self.body_of_curve].into_iter().flatten();
        for body in of_edges.chain(self.faces.iter_mut().map(|face| &mut face.body)) {
            *body = number(*body);
        }
        self.accuracy = left.iter().map(|&body| self.accuracy[body]).collect();
        let mut model = Model {
            bodies: left.len(),
            from_faces: old.from_faces,
            body_names: left.iter().filter_map(|&body| old.body_names.get(body)).cloned().collect(),
            metres: old.metres,
            notes: old.notes.clone(),
            ..Model::default()
        };
        self.build(&mut model)?;
        Ok(model)
    }

    /// Makes patches of the faces; those that two solids repeat become one.
    ///
    /// # Errors
    /// [`BrepError::Face`] for faces whose edges do not bound them.
    pub fn build(mut self, model: &mut Model) -> Result<(), BrepError> {
        let size = self.size();
        if let Some((_, error)) = self.away.drain(..).find(|(off, _)| *off > AWAY * size) {
            return Err(error);
        }
        model.notes.extend(without_area::drop_twisted(&mut self, size));
        model.notes.extend(without_area::drop_planes_without_edges(&mut self));
        glue::glue_edges(&mut self, size, glue::OF_SOLIDS);
        split::divide_at_poles(&mut self, size);
        model.notes.extend(split::drop_spurs(&mut self));
        (model.corners, model.curves) = (self.corners, self.curves);
        let mut names = Vec::new();
        // On all threads: the steps along edges take most of the time.
        let follow = |(number, face): (usize, &Face)| {
            let is_plane = face.surface.is_plane();
            (!is_plane).then(|| followed(&model.curves, number, &face.surface, &face.loops, size))
        };
        let followed: Vec<_> = self.faces.par_iter().enumerate().map(follow).collect();
        for ((number, face), followed) in self.faces.into_iter().enumerate().zip(followed) {
            names.push(face.name.clone());
            let id = face.id;
            let patch = patch(model, number, face, followed, size).map_err(|error| match error {
                BrepError::Face { face, what, place } => {
                    BrepError::Face { face, what: format!("{what} (#{id})"), place }
                }
                other => other,
            })?;
            model.patches.push(patch);
        }
        let to = glue::glue_patches(model, SAME * size);
        model.patch_names = vec![None; model.patches.len()];
        for (name, patch) in names.into_iter().zip(to) {
            model.patch_names[patch] = model.patch_names[patch].take().or(name);
        }
        Ok(())
    }
}

/// Surfaces that differ by at most this (fraction of the diagonal) are one.
pub(crate) const SAME: f64 = 1e-6;

/// Makes the patch of a face whose loops were followed on its surface; those of planes need not be.
fn patch(
    model: &mut Model,
    number: usize,
    face: Face,
    along: Option<Result<Vec<Loop>, BrepError>>,
    size: f64,
) -> Result<Patch, BrepError> {
    let bodies = if face.is_behind { [Some(face.body), None] } else { [None, Some(face.body)] };
    let Some(along) = along else {
        let fin = |&(curve, is_forward): &(usize, bool)| Fin {
            on: On::Curve(curve),
            curve: None,
            range: model.curves[curve].range,
            is_forward,
        };
        let loops: Vec<Vec<Fin>> = face.loops.iter().map(|edges| edges.iter().map(fin).collect()).collect();
        if loops.is_empty() {
            return Err(BrepError::face(number, "it has no edges", None));
        }
        face.loops
            .iter()
            .flatten()
            .try_for_each(|&(curve, _)| on_plane(model, number, &face.surface, curve, size))?;
        return Ok(Patch { surface: face.surface, loops, bodies });
    };
    let surface: Surface = face.surface;
    let given = along.and_then(|along| bounded(model, number, &surface, along, &face.loops, size));
    let sides = given.or_else(|error| {
        // Some programs write loops of left-handed surfaces the wrong way around.
        let other: Vec<_> = face.loops.iter().map(|edges| reversed(edges.clone())).collect();
        followed(&model.curves, number, &surface, &other, size)
            .and_then(|along| bounded(model, number, &surface, along, &other, size))
            .map_err(|_| error)
    })?;
    let fins = |sides: Vec<Side>| -> Result<Vec<Fin>, BrepError> {
        let all: Result<Vec<Fin>, String> = sides.into_iter().map(Side::fin).collect();
        all.map_err(|what| BrepError::face(number, what, None))
    };
    let loops = sides.into_iter().map(fins).collect::<Result<Vec<_>, _>>()?;
    Ok(Patch { surface, loops, bodies })
}

/// Gives an edge of a plane the tolerance of its distance from it: some programs round coordinates.
///
/// # Errors
/// [`BrepError::Face`] if it is too far away.
fn on_plane(
    model: &mut Model,
    number: usize,
    plane: &Surface,
    curve: usize,
    size: f64,
) -> Result<(), BrepError> {
    let edge = &mut model.curves[curve];
    let (off, place) = imprint::furthest(plane, edge);
    if off > AWAY * size {
        let what = format!("edge {} is {off:.3e} away from it", curve + 1);
        return Err(BrepError::face(number, what, Some(place)));
    }
    edge.tolerance = edge.tolerance.max(off);
    Ok(())
}

/// Loops of edges in the parameters of a surface.
fn followed(
    curves: &[EdgeCurve],
    number: usize,
    surface: &Surface,
    loops: &[Edges],
    size: f64,
) -> Result<Vec<Loop>, BrepError> {
    let chart = Chart::new(surface, size);
    loops.iter().map(|edges| chart.follow(number, curves, edges)).collect()
}

/// Joins loops in the parameters of a surface so that they bound an area.
fn bounded(
    model: &mut Model,
    number: usize,
    surface: &Surface,
    along: Vec<Loop>,
    loops: &[Edges],
    size: f64,
) -> Result<Vec<Vec<Side>>, BrepError> {
    for (one, edges) in along.iter().zip(loops) {
        for &(curve, _) in edges {
            let edge = &mut model.curves[curve];
            edge.tolerance = edge.tolerance.max(one.gap);
        }
    }
    close(&Chart::new(surface, size), number, model, along)
}

/// The loop in the other direction.
pub(crate) fn reversed(mut edges: Edges) -> Edges {
    edges.reverse();
    edges.iter_mut().for_each(|edge| edge.1 = !edge.1);
    edges
}
