//! Turns faces and shells that point the wrong way, as files of several CAD programs have them.
//!
//! The shells of a body are sets of its patches that curves connect. Patches of a shell are
//! oriented alike: two that meet at a curve follow it in opposite directions. Shells within no
//! other, or an even number of others, bound the body from outside and have a positive volume; the
//! others are voids and have a negative one. A shell lies in another if the winding number of the
//! other around one of its triangles is odd (Jacobson, Kavan and Sorkine-Hornung 2013, "Robust
//! inside-outside segmentation using generalized winding numbers", section 3).

use super::{Tessellation, measure::enclosed};
use crate::{BrepError, Model, On, Point};
use std::collections::HashMap;
use std::f64::consts::TAU;

/// Turns the shells of all bodies so that their volumes have the signs of their nesting, with a
/// note for each. Returns the shells of each body.
///
/// # Errors
/// [`BrepError::Face`] if a shell to be turned has a body on each side.
pub(super) fn orient(model: &mut Model, tessellation: &Tessellation) -> Result<Vec<Vec<Shell>>, BrepError> {
    let mut triangles = vec![Vec::new(); model.patches.len()];
    for triangle in &tessellation.triangles {
        triangles[triangle.patch as usize].push(triangle.vertices.map(|v| tessellation.points[v as usize]));
    }
    let uses = Uses::new(model, tessellation);
    let mut all = Vec::new();
    for body in 0..model.bodies {
        let connected = shells(model, body, &uses);
        turn_faces(model, body, connected.iter().flat_map(|shell| shell.1.iter().copied()).collect())?;
        let shells = connected.into_iter().map(|(patches, _)| Shell::new(model, body, patches, &triangles));
        all.push(shells.collect());
    }
    if model.from_faces {
        all = join_voids(model, all);
    }
    for (body, shells) in all.iter().enumerate() {
        turn_shells(model, body, shells)?;
    }
    Ok(all)
}

/// Makes voids of bodies whose faces point inside and that lie in another one.
fn join_voids(model: &mut Model, all: Vec<Vec<Shell>>) -> Vec<Vec<Shell>> {
    let only = |body: usize| all[body].first().filter(|_| all[body].len() == 1);
    let around = |body: usize| {
        let void = only(body).filter(|shell| shell.volume < 0.0)?;
        let solids = (0..all.len()).filter_map(|other| Some((other, only(other)?)));
        let around = solids.filter(|(_, shell)| shell.volume > 0.0 && shell.contains(void.place));
        around.min_by(|a, b| a.1.volume.total_cmp(&b.1.volume)).map(|(other, _)| other)
    };
    let to: Vec<Option<usize>> = (0..all.len()).map(around).collect();
    let voids = to.iter().flatten().count();
    if voids == 0 {
        return all;
    }
    let before = |count: &mut usize, to: &Option<usize>| {
        let number = *count;
        *count += usize::from(to.is_none());
        Some(number)
    };
    let solids: Vec<usize> = to.iter().scan(0, before).collect();
    let numbers: Vec<usize> = to.iter().enumerate().map(|(body, to)| solids[to.unwrap_or(body)]).collect();
    for patch in &mut model.patches {
        patch.bodies = patch.bodies.map(|body| body.map(|body| numbers[body]));
    }
    let mut is_solid = to.iter().map(Option::is_none);
    model.body_names.retain(|_| is_solid.next() == Some(true));
    model.bodies = all.len() - voids;
    model.notes.push(match voids {
        1 => "1 of these solids is a void of another one, because its faces point inside".into(),
        _ => format!("{voids} of these solids are voids of others, because their faces point inside"),
    });
    let mut joined: Vec<Vec<Shell>> = (0..model.bodies).map(|_| Vec::new()).collect();
    for (shells, number) in all.into_iter().zip(numbers) {
        joined[number].extend(shells);
    }
    joined
}

/// Turns patches that their neighbours contradict.
fn turn_faces(model: &mut Model, body: usize, patches: Vec<usize>) -> Result<(), BrepError> {
    let Some(first) = patches.first() else { return Ok(()) };
    let (solid, count, face) = (body + 1, patches.len(), first + 1);
    let what = format!("solid {solid}: {count} of its faces, the first face {face}, pointed inside");
    model.notes.push(what);
    turn(model, body, &patches)
}

/// Turns shells whose volume does not have the sign of their nesting.
fn turn_shells(model: &mut Model, body: usize, shells: &[Shell]) -> Result<(), BrepError> {
    let is_wrong = |shell: &&Shell| {
        let others = shells.iter().filter(|other| !std::ptr::eq(*other, *shell));
        let around = others.filter(|other| other.contains(shell.place)).count();
        (shell.volume < 0.0) != (around % 2 == 1)
    };
    let wrong: Vec<&Shell> = shells.iter().filter(is_wrong).collect();
    let solid = body + 1;
    if wrong.len() == shells.len() && !wrong.is_empty() {
        model.notes.push(format!("solid {solid} was inside out"));
    } else {
        for (is_void, what) in [(true, "voids"), (false, "outer shells")] {
            let mut of_kind = wrong.iter().filter(|shell| (shell.volume > 0.0) == is_void);
            let Some(first) = of_kind.next() else { continue };
            let (count, face) = (1 + of_kind.count(), first.patches[0] + 1);
            model.notes.push(format!(
                "solid {solid}: {count} of its {what} were inside out, the first from face {face} on"
            ));
        }
    }
    wrong.into_iter().try_for_each(|shell| turn(model, body, &shell.patches))
}

/// Patches of one body that curves connect.
pub(crate) struct Shell {
    patches: Vec<usize>,
    /// The largest triangle of each patch: the patch, twice the area, the middle.
    pub largest: Vec<(usize, f64, Point)>,
    /// The triangles, counterclockwise seen from outside the body.
    triangles: Vec<[Point; 3]>,
    volume: f64,
    /// The middle of the largest triangle.
    place: Point,
    /// The least and the largest coordinates.
    bounds: [Point; 2],
}

impl Shell {
    fn new(model: &Model, body: usize, patches: Vec<usize>, triangles: &[Vec<[Point; 3]>]) -> Self {
        let mut own = Vec::new();
        let mut largest = Vec::new();
        for &patch in &patches {
            let is_behind = model.patches[patch].bodies[0] == Some(body);
            let oriented =
                triangles[patch].iter().map(|&[a, b, c]| if is_behind { [a, b, c] } else { [a, c, b] });
            own.extend(oriented);
            let area = |[a, b, c]: &[Point; 3]| (b - a).cross(&(c - a)).norm();
            let middle = |[a, b, c]: &[Point; 3]| Point::from((a.coords + b.coords + c.coords) / 3.0);
            let sized = triangles[patch].iter().map(|t| (patch, area(t), middle(t)));
            largest.extend(sized.max_by(|s, t| s.1.total_cmp(&t.1)));
        }
        let place = largest.iter().max_by(|s, t| s.1.total_cmp(&t.1)).map_or(Point::origin(), |l| l.2);
        let corners = || own.iter().flatten();
        let bounds =
            [corners().fold(place, |low, p| low.inf(p)), corners().fold(place, |high, p| high.sup(p))];
        Self { patches, largest, volume: enclosed(&own, place), triangles: own, place, bounds }
    }

    /// Whether the boxes of two shells overlap.
    pub fn is_near(&self, other: &Self) -> bool {
        (0..3).all(|i| self.bounds[0][i] <= other.bounds[1][i] && other.bounds[0][i] <= self.bounds[1][i])
    }

    pub fn contains(&self, point: Point) -> bool {
        // Parts with thousands of voids: a void's box contains hardly any of the others.
        let [low, high] = self.bounds;
        if !(0..3).all(|i| (low[i]..=high[i]).contains(&point[i])) {
            return false;
        }
        let winding = self.triangles.iter().map(|t| solid_angle(t, point)).sum::<f64>() / (2.0 * TAU);
        winding.round().rem_euclid(2.0) == 1.0
    }
}

/// Exchanges the sides of patches.
fn turn(model: &mut Model, body: usize, patches: &[usize]) -> Result<(), BrepError> {
    for &number in patches {
        let patch = &mut model.patches[number];
        let side = patch.bodies.iter().position(|b| *b == Some(body)).expect("a patch of the body");
        if patch.bodies[1 - side].is_some() {
            let [a, b] = patch.bodies.map(|body| body.map_or(0, |body| body + 1));
            let what = format!("the solids {a} and {b} beside it overlap, or one of them is inside out");
            let place = patch.loops.iter().flatten().next().map(|fin| match fin.on {
                On::Curve(curve) => model.corners[model.curves[curve].ends[0]].point,
                On::Corner(corner) => model.corners[corner].point,
            });
            return Err(BrepError::face(number, what, place));
        }
        patch.bodies.swap(0, 1);
    }
    Ok(())
}

/// The solid angle under which a triangle is seen (steradians, with its orientation), after van
/// Oosterom and Strackee (1983), "The solid angle of a plane triangle".
fn solid_angle(triangle: &[Point; 3], from: Point) -> f64 {
    let [a, b, c] = triangle.map(|p| p - from);
    let [x, y, z] = [a.norm(), b.norm(), c.norm()];
    let below = x * y * z + a.dot(&b) * z + b.dot(&c) * x + c.dot(&a) * y;
    2.0 * a.dot(&b.cross(&c)).atan2(below)
}

/// The patches that use each curve once, and whether their triangles run along it.
struct Uses {
    of_curve: Vec<Vec<(usize, bool)>>,
    of_patch: Vec<Vec<usize>>,
}

impl Uses {
    fn new(model: &Model, tessellation: &Tessellation) -> Self {
        let first = |line: &Vec<(u32, f64)>| (line[0].0, line[1].0);
        let starts: HashMap<_, _> =
            tessellation.lines.iter().enumerate().map(|(curve, line)| (first(line), curve)).collect();
        let mut of_curve = vec![Vec::new(); model.curves.len()];
        for t in &tessellation.triangles {
            for k in 0..3 {
                let [a, b] = [t.vertices[k], t.vertices[(k + 1) % 3]];
                for (side, is_forward) in [((a, b), true), ((b, a), false)] {
                    if let Some(&curve) = starts.get(&side) {
                        of_curve[curve].push((t.patch as usize, is_forward));
                    }
                }
            }
        }
        let mut of_patch = vec![Vec::new(); model.patches.len()];
        for (curve, uses) in of_curve.iter().enumerate() {
            uses.iter().for_each(|&(patch, _)| of_patch[patch].push(curve));
        }
        Self { of_curve, of_patch }
    }
}

/// The sets of patches with the body on one side only that curves connect, and which of each must
/// be turned so that they are oriented alike: at most half of them.
fn shells(model: &Model, body: usize, uses: &Uses) -> Vec<(Vec<usize>, Vec<usize>)> {
    let is_own = |patch: usize| model.patches[patch].bodies.iter().filter(|b| **b == Some(body)).count() == 1;
    let is_behind = |patch: usize| model.patches[patch].bodies[0] == Some(body);
    let mut is_turned: Vec<Option<bool>> = vec![None; model.patches.len()];
    let mut shells = Vec::new();
    for first in (0..model.patches.len()).filter(|&patch| is_own(patch)) {
        if is_turned[first].is_some() {
            continue;
        }
        is_turned[first] = Some(false);
        let mut shell = vec![first];
        let mut next = 0;
        while let Some(&patch) = shell.get(next) {
            next += 1;
            for &curve in &uses.of_patch[patch] {
                let own: Vec<_> = uses.of_curve[curve].iter().filter(|of| is_own(of.0)).collect();
                let [(a, along_a), (b, along_b)] = own[..] else { continue };
                let other = if *a == patch { *b } else { *a };
                if is_turned[other].is_none() {
                    let are_alike = (*along_a == is_behind(*a)) != (*along_b == is_behind(*b));
                    is_turned[other] = is_turned[patch].map(|turned| turned == are_alike);
                    shell.push(other);
                }
            }
        }
        shell.sort_unstable();
        let (turned, kept): (Vec<usize>, Vec<usize>) =
            shell.iter().partition(|&&patch| is_turned[patch] == Some(true));
        shells.push((shell, if turned.len() > kept.len() { kept } else { turned }));
    }
    shells
}
