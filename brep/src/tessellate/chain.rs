//! The loops of a patch as points in its parameters.

use super::Tessellation;
use super::cross::cut;
use super::face::Tolerances;
use crate::model::{AWAY, Corner, EdgeCurve, Fin, Model, On, Patch};
use crate::project::project_to_surface;
use crate::{BrepError, Point, Surface};

/// Points on a side without length.
const AT_POLE: usize = 24;

/// Sides that end so far apart, as a fraction of the loop, are joined by one that the file left out
/// because it is shorter than its accuracy.
const SIDE: f64 = 1e-2;

/// A loop as parameters and vertices.
pub(super) type Chain = Vec<([f64; 2], u32)>;

/// A loop side by side. Each side ends before the first point of the next.
pub(super) type Sides = Vec<Chain>;

/// The points of a loop, each once, and the largest distance between a side and its curve.
pub(super) fn chain(
    model: &Model,
    number: usize,
    fins: &[Fin],
    out: &Tessellation,
    tolerances: &Tolerances,
) -> Result<(Sides, f64), BrepError> {
    let patch = &model.patches[number];
    let (mut sides, mut most_gap): (Vec<Chain>, f64) = (Vec::new(), 0.0);
    for fin in fins {
        let mut side: Chain = match fin.on {
            On::Corner(corner) => at_pole(fin, corner as u32),
            On::Curve(curve) => {
                let (side, gap) = on_curve(model, number, fin, curve, out, tolerances)?;
                most_gap = most_gap.max(gap);
                side
            }
        };
        if !fin.is_forward {
            side.reverse();
        }
        sides.push(side);
    }
    // At a pole all sides have the same parameters, without rounding.
    for k in (0..fins.len()).filter(|&k| fins.len() > 1 && matches!(fins[k].on, On::Corner(_))) {
        let (before, after) = ((k + fins.len() - 1) % fins.len(), (k + 1) % fins.len());
        let (start, end) = (sides[k][0].0, sides[k][AT_POLE].0);
        sides[before].last_mut().expect("a side has two nodes or more").0 = start;
        sides[after][0].0 = end;
    }
    join(patch, number, sides, out, (&model.corners, tolerances)).map(|sides| (sides, most_gap))
}

/// Joins sides where their ends differ in the parameters. Each side ends before the next then.
fn join(
    patch: &Patch,
    number: usize,
    mut sides: Vec<Chain>,
    out: &Tessellation,
    (corners, tolerances): (&[Corner], &Tolerances),
) -> Result<Sides, BrepError> {
    let extents = [0, 1].map(|i| {
        let along = sides.iter().flatten().map(|node| node.0[i]);
        along.clone().fold(f64::NEG_INFINITY, f64::max) - along.fold(f64::INFINITY, f64::min)
    });
    let point = |p: [f64; 2]| patch.surface.point(p);
    // The ends of sides without length between sides and the next ones.
    let mut between = Vec::new();
    for k in 0..sides.len() {
        let after = (k + 1) % sides.len();
        let (end, vertex) = sides[k][sides[k].len() - 1];
        let next = sides[after][0].0;
        let middle = [0, 1].map(|i| 0.5 * (end[i] + next[i]));
        let [from, half, to] = [end, middle, next].map(point);
        let gap = (half - from).norm().max((to - from).norm());
        let corner = &corners[vertex as usize];
        let most = (10.0 * corner.tolerance).max(1e-5 * tolerances.diagonal);
        if gap > most {
            let what =
                format!("its edges do not join in the parameters of its surface: the gap is {gap:.3e}");
            return Err(BrepError::face(number, what, Some(out.points[vertex as usize])));
        }
        between.push(None);
        // Where files are not accurate, sides may cross before their ends.
        if tolerances.cuts_sides && gap > 1e-9 * tolerances.diagonal && k != after {
            let mut one = std::mem::take(&mut sides[k]);
            let is_cut = cut(&mut one, &mut sides[after], point, most);
            sides[k] = one;
            if is_cut {
                continue;
            }
        }
        let rate = patch.surface.jet(end[0], end[1], 1);
        let is_pole = [rate.d[1][0], rate.d[0][1]].iter().any(|d| d.norm() < 1e-7 * tolerances.diagonal);
        let apart = [0, 1].map(|i| (end[i] - next[i]).abs());
        let is_side = (0..2).any(|i| apart[i] > SIDE * extents[i]);
        if is_side || (is_pole && apart[0].hypot(apart[1]) > 1e-6) {
            between[k] = Some([end, next]);
        }
    }
    let mut joined = Sides::new();
    for (mut side, between) in sides.into_iter().zip(between) {
        let vertex = side.pop().expect("a side has two nodes or more").1;
        joined.push(side);
        if let Some([end, next]) = between {
            let at = |share: f64| ([0, 1].map(|j| end[j] + share * (next[j] - end[j])), vertex);
            joined.push((0..AT_POLE).map(|i| at(i as f64 / AT_POLE as f64)).collect());
        }
    }
    Ok(joined)
}

fn at_pole(fin: &Fin, vertex: u32) -> Chain {
    let [low, high] = fin.range;
    let at = |k: usize| low + (high - low) * (k as f64 / AT_POLE as f64);
    let curve = fin.curve.as_ref().expect("a side without length has parameters");
    let [first, last]: [[f64; 2]; 2] = [low, high].map(|t| curve.point(t).into());
    let across = usize::from((last[0] - first[0]).abs() > (last[1] - first[1]).abs());
    let node = |k: usize| {
        let mut parameters: [f64; 2] = curve.point(at(k)).into();
        parameters[across] = first[across];
        (parameters, vertex)
    };
    (0..=AT_POLE).map(node).collect()
}

fn on_curve(
    model: &Model,
    number: usize,
    fin: &Fin,
    curve: usize,
    out: &Tessellation,
    tolerances: &Tolerances,
) -> Result<(Chain, f64), BrepError> {
    let surface = &model.patches[number].surface;
    let edge = &model.curves[curve];
    let most = (20.0 * edge.tolerance).max(1e-5 * tolerances.diagonal);
    let line = &out.lines[curve];
    let (mut side, mut most_gap) = (Chain::new(), 0.0_f64);
    for &(vertex, t) in line {
        let on = Point::from(edge.curve.point(t));
        let mut parameters: [f64; 2] = match &fin.curve {
            None => project_to_surface(surface, &on, [0.0; 2]).parameters,
            Some(curve) => curve.point(fin.parameter(t, edge.range)).into(),
        };
        let mut gap = (surface.point(parameters) - on).norm();
        if gap > 1e-9 * tolerances.diagonal {
            // The two curves may be parametrised differently, and that in the parameters may be
            // piecewise linear.
            let foot = project_to_surface(surface, &on, parameters);
            (parameters, gap) = (foot.parameters, (foot.point - on).norm());
        }
        if gap > most {
            let what = format!("edge {} is {gap:.3e} away from it", curve + 1);
            return Err(BrepError::face(number, what, Some(on)));
        }
        let off = (surface.point(parameters) - out.points[vertex as usize]).norm();
        if off > AWAY * tolerances.diagonal {
            let what = format!("a vertex of edge {} is {off:.3e} away from it", curve + 1);
            return Err(BrepError::face(number, what, Some(on)));
        }
        most_gap = most_gap.max(gap).max(off);
        side.push((parameters, vertex));
    }
    if fin.curve.is_some() {
        let between = |w: &[(u32, f64)]| {
            let [a, b] = [w[0].1, w[1].1];
            (1..SAMPLES).map(move |k| a + (b - a) * f64::from(k) / f64::from(SAMPLES))
        };
        let gaps = line.windows(2).flat_map(between).map(|t| gap_at(surface, fin, edge, t));
        most_gap = gaps.fold(most_gap, f64::max);
    }
    Ok((side, most_gap))
}

/// Steps between the vertices of a curve at which its distance from a patch is measured.
const SAMPLES: u32 = 6;

/// The distance of a point of a curve from a patch beside it.
fn gap_at(surface: &Surface, fin: &Fin, edge: &EdgeCurve, t: f64) -> f64 {
    let on = Point::from(edge.curve.point(t));
    let start = fin.curve.as_ref().map_or([0.0; 2], |c| c.point(fin.parameter(t, edge.range)).into());
    (project_to_surface(surface, &on, start).point - on).norm()
}
