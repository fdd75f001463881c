//! `revolution`: a profile rotated about an axis.

use super::conic::{Arc, Piece};
use super::primitive::Shape;
use super::profile::formula;
use super::swept::{Assembly, SweepError, Turn};
use crate::Vector;

/// Lengths below this fraction of the size of the profile count as zero.
const NOTHING: f64 = 1e-9;

/// The solid of a profile in the coordinates (height along the axis, distance from the axis).
pub(super) fn shape(point: Vector, axis: Vector, pieces: &[Piece]) -> Result<Shape, SweepError> {
    let size = pieces.iter().flat_map(Piece::control).map(|p| p.amax()).fold(0.0, f64::max);
    let tolerance = NOTHING * size;
    let last = pieces.len() - 1;
    let mut above = pieces.to_vec();
    above[0] = cut_by_axis(pieces[0]);
    above[last] = cut_by_axis(above[last].reversed()).reversed();
    if let Some(index) = above.iter().position(|piece| lowest(piece) < -tolerance) {
        let message = format!("segment {} of the profile is beyond the axis", index + 1);
        return Err(SweepError::Wrong(message, "the distance y from the axis must not be negative"));
    }
    let profile = formula(&above, true)?;
    let turn = Turn { point, axis, tolerance };
    let mut assembly = Assembly::default();
    let swept = assembly.sweep(&profile, |into, bound, face| Ok(turn.turned(into, bound, face)))?;
    Ok(assembly.shape(swept.inside))
}

/// Cuts off the start of a line that begins below the axis.
fn cut_by_axis(piece: Piece) -> Piece {
    match piece {
        Piece::Line([p, q]) if p.y < 0.0 && q.y > 0.0 => {
            let mut on_axis = p + (q - p) * (p.y / (p.y - q.y));
            on_axis.y = 0.0;
            Piece::Line([on_axis, q])
        }
        other => other,
    }
}

/// The least y of a segment, approximately.
fn lowest(piece: &Piece) -> f64 {
    /// Recursion depth: an arc is evaluated at the ends of 32 pieces.
    const DEPTH: u32 = 5;
    fn least(arc: Arc, depth: u32) -> f64 {
        let [p, q, r] = arc.points.map(|p| p.y);
        if depth == 0 || q >= p.min(r) {
            return p.min(r);
        }
        let [first, second] = arc.halves();
        least(first, depth - 1).min(least(second, depth - 1))
    }
    match *piece {
        Piece::Line([p, q]) => p.y.min(q.y),
        Piece::Arc(arc) => least(arc, DEPTH),
    }
}
