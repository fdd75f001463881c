//! Places where edges of a face pass through the surface of another one.
//!
//! Each branch that is not closed inside of both faces ends at such a place, however thin the
//! common part of the solids is there.

use crate::nearest::nearest_on_surface;
use crate::project::project_to_surface;
use crate::{EdgeCurve, Point, Surface};

/// An edge is divided into so many pieces between its breaks.
const PIECES: usize = 16;
/// Halvings of a piece until its middle is where it passes through the surface.
const HALVINGS: usize = 40;

/// The points at which an edge passes through a surface, with the surface's parameters there.
pub(super) fn passes(surface: &Surface, edge: &EdgeCurve) -> Vec<(Point, [f64; 2])> {
    let within = |w: &[f64]| {
        let [from, to] = [w[0], w[1]];
        (0..PIECES).map(move |k| from + (to - from) * k as f64 / PIECES as f64)
    };
    let mut all: Vec<f64> = edge.stops().windows(2).flat_map(within).collect();
    all.push(edge.range[1]);
    let mut feet: Vec<Foot> = Vec::with_capacity(all.len());
    for &t in &all {
        let last = feet.last().map(|foot| foot.parameters);
        feet.push(foot(surface, edge, t, last));
    }
    let crossed = (0..all.len() - 1).filter(|&k| (feet[k].height < 0.0) != (feet[k + 1].height < 0.0));
    crossed.filter_map(|k| pass(surface, edge, [all[k], all[k + 1]], &feet[k])).collect()
}

/// Where an edge passes through a surface between two parameters, with the foot of the first one;
/// `None` if it only comes to its other side beyond its end.
fn pass(
    surface: &Surface,
    edge: &EdgeCurve,
    [mut low, mut high]: [f64; 2],
    first: &Foot,
) -> Option<(Point, [f64; 2])> {
    /// The edge is this close to the surface there (fraction of the piece).
    const CLOSE: f64 = 1e-6;
    let at = |t: f64| Point::from(edge.curve.point(t));
    let length = (at(high) - at(low)).norm();
    let mut parameters = first.parameters;
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        let here = foot(surface, edge, middle, Some(parameters));
        if (here.height < 0.0) == (first.height < 0.0) {
            low = middle
        } else {
            high = middle
        }
        parameters = here.parameters;
    }
    let last = foot(surface, edge, low, Some(parameters));
    (last.height.abs() <= CLOSE * length).then(|| (at(low), last.parameters))
}

/// The foot of a point of an edge on a surface.
struct Foot {
    /// The height of the point over the surface, negative behind it.
    height: f64,
    parameters: [f64; 2],
}

/// The foot near that of the last point, or the nearest one.
fn foot(surface: &Surface, edge: &EdgeCurve, t: f64, last: Option<[f64; 2]>) -> Foot {
    let point = Point::from(edge.curve.point(t));
    let near = last.map(|start| project_to_surface(surface, &point, start));
    let foot = near.filter(|foot| foot.is_converged).unwrap_or_else(|| nearest_on_surface(surface, &point));
    let way = point - foot.point;
    Foot { height: way.norm().copysign(way.dot(&foot.normal)), parameters: foot.parameters }
}
