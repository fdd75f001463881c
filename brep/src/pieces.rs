//! Pieces of patches, such as narrow tips, cut off as patches of their own.

use crate::model::{Corner, EdgeCurve, Fin, Model, On, Patch};
use crate::straight::along_straight;
use crate::tessellate::diagonal;
use crate::{Curve, Point, Surface};
use nalgebra::SVector;

/// The most segments of the curve of a cut.
const MOST_SEGMENTS: usize = 64;

/// The largest distance of the curve of a cut from its surface (fraction of the size of the model),
/// half of what tessellation allows.
const OFF: f64 = 5e-6;

/// A piece of a patch, to be cut off from one of its sides to another one.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Piece {
    /// The patch.
    pub patch: usize,
    /// The loop of the patch.
    pub of_loop: usize,
    /// The first and the last side of the piece in the direction of the loop, which are different.
    /// Those of a tip follow each other, or have a pole between them.
    pub sides: [usize; 2],
    /// The parameters on the curves of both sides between which to cut; `None` for the start of the
    /// first one and the end of the last one.
    pub at: [Option<f64>; 2],
}

impl Piece {
    /// The first and the last side of the piece.
    ///
    /// # Panics
    /// If the model has no such loop or sides.
    pub fn sides<'a>(&self, model: &'a Model) -> [&'a Fin; 2] {
        self.sides.map(|side| &model.patches[self.patch].loops[self.of_loop][side])
    }

    /// All sides of the piece, from the first to the last one.
    ///
    /// # Panics
    /// If the model has no such loop.
    pub fn all_sides<'a>(&self, model: &'a Model) -> impl Iterator<Item = &'a Fin> {
        let fins = &model.patches[self.patch].loops[self.of_loop];
        let [first, last] = self.sides;
        let count = (last + fins.len() - first) % fins.len() + 1;
        fins.iter().cycle().skip(first).take(count)
    }
}

/// A model of which pieces of patches are patches of their own.
#[derive(Clone, Debug)]
pub struct Cut {
    /// The model. Patches and curves before keep their numbers; of a divided curve that is the
    /// first part.
    pub model: Model,
    /// For each piece, its patch.
    pub patches: Vec<usize>,
    /// For each piece, the curve along which it was cut.
    pub curves: Vec<usize>,
    /// For each curve, that of the first model of which it is a part; `None` for cuts.
    pub parts_of: Vec<Option<usize>>,
    /// For each patch, that of the first model of which it is a part.
    pub patch_parts_of: Vec<usize>,
}

impl Model {
    /// Cuts pieces off their patches, along lines in the parameters. A piece may have others inside
    /// that come before it. `None` if cuts cross each other, divide a curve at one place or at its
    /// end, or pieces come in the wrong order.
    ///
    /// # Panics
    /// If there are no such loops and sides, or the sides at a cut are not curves.
    pub fn cut_off(&self, pieces: &[Piece]) -> Option<Cut> {
        let mut model = self.clone();
        let mut divisions: Vec<Vec<(f64, usize)>> = vec![Vec::new(); self.curves.len()];
        let ends: Vec<[usize; 2]> =
            pieces.iter().map(|piece| self.ends_of_cut(piece, &mut model.corners, &mut divisions)).collect();
        for (edge, at) in self.curves.iter().zip(&mut divisions).filter(|(_, at)| !at.is_empty()) {
            at.sort_by(|a, b| a.0.total_cmp(&b.0));
            let ends = edge.range.map(|t| (t, 0));
            let places = [&ends[..1], at, &ends[1..]].concat();
            if places.windows(2).any(|w| w[0].0 >= w[1].0) {
                return None;
            }
        }
        let mut parts_of: Vec<Option<usize>> = (0..self.curves.len()).map(Some).collect();
        let parts: Vec<Vec<usize>> = divisions
            .iter()
            .enumerate()
            .map(|(curve, at)| divide(&mut model.curves, &mut parts_of, curve, at))
            .collect();
        let mut fins: Vec<Vec<Vec<Vec<Fin>>>> = self
            .patches
            .iter()
            .map(|patch| {
                let of_loop =
                    |fins: &Vec<Fin>| fins.iter().map(|fin| divided(fin, &parts, self, &model)).collect();
                patch.loops.iter().map(of_loop).collect()
            })
            .collect();
        let (mut patches, mut curves) = (Vec::new(), Vec::new());
        let room = OFF * diagonal(&self.corners, &self.curves, Vec::new());
        for (piece, corners) in pieces.iter().zip(ends) {
            let of_loop = &mut fins[piece.patch][piece.of_loop];
            let mut sides = taken(of_loop, piece.sides, corners, &model)?;
            let Patch { surface, bodies, .. } = &self.patches[piece.patch];
            let flat = across(&sides[0], &sides[sides.len() - 1]);
            let places = corners.map(|corner| model.corners[corner].point);
            model.curves.push(EdgeCurve {
                curve: on_surface(surface, flat, places, room),
                range: [0.0, 1.0],
                ends: corners,
                // It ends on edges that may be off the patch.
                tolerance: corners
                    .map(|corner| model.corners[corner].tolerance)
                    .into_iter()
                    .fold(0.0, f64::max),
            });
            parts_of.push(None);
            let curve = model.curves.len() - 1;
            let cut = |is_forward: bool| Fin {
                on: On::Curve(curve),
                curve: flat.map(|[from, to]| line(from.into(), to.into())),
                range: [0.0, 1.0],
                is_forward,
            };
            of_loop[piece.sides[0]].push(cut(true));
            sides.push(cut(false));
            model.patches.push(Patch { surface: surface.clone(), loops: vec![sides], bodies: *bodies });
            curves.push(curve);
            patches.push(model.patches.len() - 1);
        }
        for (patch, loops) in model.patches.iter_mut().zip(fins) {
            patch.loops = loops.into_iter().map(|fins| fins.concat()).collect();
        }
        if !model.patch_names.is_empty() {
            model.patch_names.resize(model.patches.len(), None);
        }
        let patch_parts_of = (0..self.patches.len()).chain(pieces.iter().map(|piece| piece.patch)).collect();
        Some(Cut { model, patches, curves, parts_of, patch_parts_of })
    }

    /// The corners at both ends of the cut of a piece; new ones are added, with the places on the
    /// curves that they divide.
    fn ends_of_cut(
        &self,
        piece: &Piece,
        corners: &mut Vec<Corner>,
        divisions: &mut [Vec<(f64, usize)>],
    ) -> [usize; 2] {
        let sides = piece.sides(self);
        [0, 1].map(|k| {
            let (curve, end) = self.end_of(sides[k], k == 0);
            match piece.at[k] {
                None => end,
                Some(t) => {
                    let edge = &self.curves[curve];
                    let point = Point::from(edge.curve.point(t));
                    corners.push(Corner { point, tolerance: edge.tolerance });
                    divisions[curve].push((t, corners.len() - 1));
                    corners.len() - 1
                }
            }
        })
    }

    /// The curve of a side, and the corner at its start or end.
    ///
    /// # Panics
    /// If the side is a pole of the surface, which is no curve.
    pub fn end_of(&self, fin: &Fin, at_start: bool) -> (usize, usize) {
        let On::Curve(curve) = fin.on else { panic!("the side is a pole") };
        (curve, self.curves[curve].ends[usize::from(fin.is_forward != at_start)])
    }
}

/// Takes the sides between two corners out of a loop, of which there are the parts of each side,
/// from the `first` side to the `last` one, which is another.
fn taken(
    of_loop: &mut [Vec<Fin>],
    [first, last]: [usize; 2],
    [from, to]: [usize; 2],
    model: &Model,
) -> Option<Vec<Fin>> {
    let start = of_loop[first].iter().position(|fin| start(model, fin) == from)?;
    let mut sides = of_loop[first].split_off(start);
    let mut side = (first + 1) % of_loop.len();
    while side != last {
        sides.append(&mut of_loop[side]);
        side = (side + 1) % of_loop.len();
    }
    let end = of_loop[last].iter().position(|fin| end(model, fin) == to)?;
    sides.extend(of_loop[last].drain(..=end));
    Some(sides)
}

/// Divides a curve at parameters in ascending order; returns its parts in this order.
fn divide(
    curves: &mut Vec<EdgeCurve>,
    parts_of: &mut Vec<Option<usize>>,
    curve: usize,
    at: &[(f64, usize)],
) -> Vec<usize> {
    let whole = curves[curve].clone();
    let mut parts = vec![curve];
    for &(t, corner) in at {
        let last = &mut curves[parts[parts.len() - 1]];
        (last.range[1], last.ends[1]) = (t, corner);
        curves.push(EdgeCurve { range: [t, whole.range[1]], ends: [corner, whole.ends[1]], ..whole.clone() });
        parts_of.push(Some(curve));
        parts.push(curves.len() - 1);
    }
    parts
}

/// The sides on the parts of a curve, in the direction of the loop.
fn divided(fin: &Fin, parts: &[Vec<usize>], before: &Model, after: &Model) -> Vec<Fin> {
    let On::Curve(curve) = fin.on else { return vec![fin.clone()] };
    let range = before.curves[curve].range;
    let side = |&part: &usize| Fin {
        on: On::Curve(part),
        range: after.curves[part].range.map(|t| fin.parameter(t, range)),
        ..fin.clone()
    };
    let mut sides: Vec<Fin> = parts[curve].iter().map(side).collect();
    if !fin.is_forward {
        sides.reverse();
    }
    sides
}

fn start(model: &Model, fin: &Fin) -> usize {
    model.end_of(fin, true).1
}

fn end(model: &Model, fin: &Fin) -> usize {
    model.end_of(fin, false).1
}

fn line<const D: usize>(from: SVector<f64, D>, to: SVector<f64, D>) -> Curve<D> {
    Curve::Line { start: from, direction: to - from }
}

/// The line in the parameters from the start of one side to the end of another one.
fn across(first: &Fin, last: &Fin) -> Option<[[f64; 2]; 2]> {
    let place = |fin: &Fin, is_end: bool| {
        let curve = fin.curve.as_ref()?;
        Some(curve.point(fin.range[usize::from(is_end == fin.is_forward)]).into())
    };
    Some([place(first, false)?, place(last, true)?])
}

/// A curve between two points of a surface, close to the image of a line in its parameters.
fn on_surface(surface: &Surface, flat: Option<[[f64; 2]; 2]>, ends: [Point; 2], room: f64) -> Curve<3> {
    let [from, to] = ends.map(|end| end.coords);
    match flat.filter(|_| !surface.is_plane()) {
        None => line(from, to),
        Some(flat) => {
            let (mut spline, _) = along_straight(surface, flat, [1, MOST_SEGMENTS], room);
            spline.move_ends([from, to]);
            Curve::Spline(spline)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tessellate::{Settings, Tessellation, area, volume};
    use crate::{Unit, nearest_on_curve};

    fn read(name: &str) -> Model {
        let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../geometries/step");
        let text = std::fs::read(folder.join(name).with_extension("step")).unwrap();
        Model::read_step(&text, Unit::OfFile).unwrap()
    }

    /// The tip of a patch at a point, cut at the points of its edges with this first coordinate.
    fn tip(model: &Model, patch: usize, corner: Point, x: f64) -> Piece {
        let fins = &model.patches[patch].loops[0];
        let ends_there = |fin: &Fin| (model.corners[end(model, fin)].point - corner).norm() < 1e-6;
        let fin = fins.iter().position(ends_there).expect("a side ends in the corner");
        let sides = [fin, (fin + 1) % fins.len()];
        let at = sides.map(|k| {
            let curve = model.end_of(&fins[k], true).0;
            let foot = nearest_on_curve(&model.curves[curve].curve, &Point::new(x, 0.0, 2.0));
            Some(foot.parameter)
        });
        Piece { patch, of_loop: 0, sides, at }
    }

    /// The numbers of the patches with a tip at (2, 0, 2).
    fn patches_at_tip(model: &Model) -> Vec<usize> {
        let corner = Point::new(2.0, 0.0, 2.0);
        let is_at = |patch: &usize| {
            let ends = model.patches[*patch].loops[0].iter().map(|fin| model.corners[end(model, fin)].point);
            ends.into_iter().any(|p| (p - corner).norm() < 1e-6)
        };
        (0..model.patches.len()).filter(is_at).collect()
    }

    #[test]
    fn sides_of_a_piece_go_on_past_the_end_of_a_loop() {
        let model = read("tapered_chamfer");
        let patch = model.patches.iter().position(|patch| patch.loops[0].len() > 3).unwrap();
        let fins = &model.patches[patch].loops[0];
        let count = fins.len();
        let piece = Piece { patch, of_loop: 0, sides: [count - 2, 1], at: [None; 2] };
        let sides: Vec<On> = piece.all_sides(&model).map(|fin| fin.on).collect();
        let expected = [count - 2, count - 1, 0, 1].map(|side| fins[side].on);
        assert_eq!(sides, expected);
        assert_eq!(piece.sides(&model).map(|fin| fin.on), [sides[0], sides[3]]);
    }

    #[test]
    fn a_cut_is_as_inaccurate_as_the_edges_on_which_it_ends() {
        let mut model = read("tapered_chamfer");
        model.curves.iter_mut().for_each(|edge| edge.tolerance = 1e-3);
        let cut = model.cut_off(&[tip(&model, 6, Point::new(2.0, 0.0, 2.0), 5.0)]).unwrap();
        assert_eq!(cut.model.curves[cut.curves[0]].tolerance, 1e-3);
    }

    #[test]
    fn a_cut_leaves_area_volume_and_numbers() {
        for (name, tips_of) in [("tapered_chamfer", vec![6]), ("runout", vec![2, 7])] {
            let mut model = read(name);
            let all = patches_at_tip(&model);
            assert!(tips_of.iter().all(|patch| all.contains(patch)), "{name}: {all:?}");
            let before = Tessellation::of(&mut model, &Settings::default()).unwrap();
            let x = |patch: usize| if patch == 2 { 0.9 } else { 5.0 };
            let tips: Vec<Piece> = tips_of
                .iter()
                .map(|&patch| tip(&model, patch, Point::new(2.0, 0.0, 2.0), x(patch)))
                .collect();
            let mut cut = model.cut_off(&tips).unwrap();
            let (patches, curves) = (model.patches.len(), model.curves.len());
            assert_eq!(cut.patches, (patches..patches + tips.len()).collect::<Vec<_>>());
            // Each tip divides two edges and adds one.
            assert_eq!(cut.model.curves.len(), curves + 3 * tips.len());
            assert_eq!(cut.parts_of.iter().filter(|of| of.is_none()).count(), tips.len());
            assert!(cut.curves.iter().all(|&curve| cut.parts_of[curve].is_none()));
            // The tessellation checks that the body is closed.
            let after = Tessellation::of_cut(&mut cut, &before).unwrap();
            // Patches that no cut meets keep their triangles.
            let corners = |t: &Tessellation, patch: u32| -> Vec<[Point; 3]> {
                let of_patch = t.triangles.iter().filter(|triangle| triangle.patch == patch);
                of_patch.map(|triangle| triangle.vertices.map(|v| t.points[v as usize])).collect()
            };
            let floor = (0..patches as u32)
                .find(|&patch| corners(&before, patch).iter().flatten().all(|p| p.z < 1e-9));
            assert_eq!(corners(&before, floor.unwrap()), corners(&after, floor.unwrap()));
            let of_body = |model: &Model, t: &Tessellation| volume(model, t, 0);
            assert!((of_body(&model, &before) - of_body(&cut.model, &after)).abs() < 5e-3, "{name}");
            for ((tip, &new), &line) in tips.iter().zip(&cut.patches).zip(&cut.curves) {
                let [whole, rest, tip_alone] = [(&before, tip.patch), (&after, tip.patch), (&after, new)]
                    .map(|(t, patch)| area(t, patch));
                // Chords differ.
                assert!((whole - rest - tip_alone).abs() < 0.1 * whole, "{name}: {whole} {rest} {tip_alone}");
                assert!(tip_alone > 0.0 && tip_alone < 0.5 * whole, "{name}: {whole} {tip_alone}");
                let surface = &model.patches[tip.patch].surface;
                for t in [0.0, 0.3, 0.5, 1.0] {
                    let point = Point::from(cut.model.curves[line].curve.point(t));
                    let away = (crate::nearest_on_surface(surface, &point).point - point).norm();
                    assert!(away < 1e-9, "{name}: {away}");
                }
            }
        }
    }

    #[test]
    fn cuts_in_the_wrong_order_are_refused() {
        let model = read("tapered_chamfer");
        let one = tip(&model, 6, Point::new(2.0, 0.0, 2.0), 5.0);
        let other = tip(&model, 6, Point::new(2.0, 0.0, 2.0), 6.0);
        assert!(model.cut_off(&[one, other]).is_some());
        assert!(model.cut_off(&[other, one]).is_none(), "the other one has the tip");
    }
}
