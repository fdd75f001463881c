//! Boolean trees over half-spaces.

use crate::interval::Cell;
use crate::{Interval, Point, Surface, SurfaceId};

/// A set of points in space, as a Boolean tree.
#[derive(Clone, Debug, PartialEq)]
pub enum Solid {
    /// One side of a surface.
    Half {
        /// The surface that bounds it.
        surface: SurfaceId,
        /// Whether it is the side where the function of the surface is positive.
        positive: bool,
    },
    /// The intersection of its members (all of space if there are none).
    And(Vec<Solid>),
    /// The union of its members (the empty set if there are none).
    Or(Vec<Solid>),
    /// The complement.
    Not(Box<Solid>),
}

/// Position of a point relative to a solid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// In its interior.
    Inside,
    /// In the interior of its complement.
    Outside,
    /// On its boundary within the tolerance.
    On,
}

/// A solid restricted to a box.
#[derive(Clone, Debug, PartialEq)]
pub(crate) enum Pruned {
    /// The box and the solid are disjoint.
    Empty,
    /// The solid contains the box.
    Full,
    /// Undecided: an equivalent solid, reduced to the surfaces that may pass through the box.
    Part(Solid),
}

impl Solid {
    /// The surfaces of its half-spaces, ascending.
    pub fn surfaces(&self) -> Vec<SurfaceId> {
        fn collect(solid: &Solid, into: &mut Vec<SurfaceId>) {
            match solid {
                Solid::Half { surface, .. } => into.push(*surface),
                Solid::And(members) | Solid::Or(members) => members.iter().for_each(|m| collect(m, into)),
                Solid::Not(solid) => collect(solid, into),
            }
        }
        let mut surfaces = Vec::new();
        collect(self, &mut surfaces);
        surfaces.sort_unstable();
        surfaces.dedup();
        surfaces
    }

    /// Whether the solid contains a point for which `positive` returns the sign of each surface's
    /// function.
    pub fn contains(&self, positive: &dyn Fn(SurfaceId) -> bool) -> bool {
        match self {
            Self::Half { surface, positive: side } => positive(*surface) == *side,
            Self::And(members) => members.iter().all(|m| m.contains(positive)),
            Self::Or(members) => members.iter().any(|m| m.contains(positive)),
            Self::Not(solid) => !solid.contains(positive),
        }
    }

    /// Classifies `point`: `On` if it is within `tolerance` (a length) of a surface that bounds the
    /// solid there.
    pub fn side(&self, surfaces: &[Surface], point: &Point, tolerance: f64) -> Side {
        let answer = self.prune(&mut |id| {
            let surface = &surfaces[id.index()];
            let value = surface.value(point);
            let slack = tolerance * surface.gradient(point).norm();
            Interval::new(value - slack, value + slack)
        });
        match answer {
            Pruned::Empty => Side::Outside,
            Pruned::Full => Side::Inside,
            Pruned::Part(_) => Side::On,
        }
    }

    /// Restricts the solid to a box over which `range` bounds the function of each surface.
    ///
    /// Three-valued evaluation that keeps the undecided subtree (Duff 1992, Interval arithmetic and
    /// recursive subdivision for implicit functions and constructive solid geometry).
    pub(crate) fn prune(&self, range: &mut dyn FnMut(SurfaceId) -> Interval) -> Pruned {
        match self {
            Self::Half { surface, positive } => {
                let Interval { lo, hi } = range(*surface);
                match (lo > 0.0, hi < 0.0) {
                    (true, _) if *positive => Pruned::Full,
                    (true, _) => Pruned::Empty,
                    (_, true) if *positive => Pruned::Empty,
                    (_, true) => Pruned::Full,
                    _ => Pruned::Part(self.clone()),
                }
            }
            Self::Not(solid) => match solid.prune(range) {
                Pruned::Empty => Pruned::Full,
                Pruned::Full => Pruned::Empty,
                Pruned::Part(part) => Pruned::Part(Self::Not(Box::new(part))),
            },
            Self::And(members) => prune_members(members, range, Pruned::Empty, Pruned::Full, Self::And),
            Self::Or(members) => prune_members(members, range, Pruned::Full, Pruned::Empty, Self::Or),
        }
    }
}

/// Restricts solids to a box: `And([])` if a solid contains the box; disjoint solids are removed.
///
/// Each surface's range is computed only once, even if several solids share the surface.
pub fn prune_in<I>(surfaces: &[Surface], cell: &Cell, solids: Vec<(I, Solid)>) -> Vec<(I, Solid)> {
    let mut known: Vec<(SurfaceId, Interval)> = Vec::new();
    let mut range = |id: SurfaceId| {
        if let Some(range) = known.iter().find(|r| r.0 == id) {
            return range.1;
        }
        let range = surfaces[id.index()].value_range(cell);
        known.push((id, range));
        range
    };
    let left = |(id, solid): (I, Solid)| match solid.prune(&mut range) {
        Pruned::Empty => None,
        Pruned::Full => Some((id, Solid::And(Vec::new()))),
        Pruned::Part(part) => Some((id, part)),
    };
    solids.into_iter().filter_map(left).collect()
}

/// Prunes the members of a node. One `decisive` member decides the node, `neutral` members are
/// removed.
fn prune_members(
    members: &[Solid],
    range: &mut dyn FnMut(SurfaceId) -> Interval,
    decisive: Pruned,
    neutral: Pruned,
    join: fn(Vec<Solid>) -> Solid,
) -> Pruned {
    let mut parts = Vec::new();
    for member in members {
        match member.prune(range) {
            Pruned::Part(part) => parts.push(part),
            answer if answer == decisive => return decisive,
            _ => {}
        }
    }
    match parts.len() {
        0 => neutral,
        1 => Pruned::Part(parts.remove(0)),
        _ => Pruned::Part(join(parts)),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Vector;
    use crate::primitive::{Plane, Sphere};

    /// The unit ball, and the half-space x < 0.
    fn surfaces() -> Vec<Surface> {
        vec![
            Surface::Sphere(Sphere { center: Point::origin(), radius: 1.0 }),
            Surface::Plane(Plane { point: Point::origin(), normal: Vector::x() }),
        ]
    }

    fn half(id: u32) -> Solid {
        Solid::Half { surface: SurfaceId(id), positive: false }
    }

    #[test]
    fn points_are_inside_outside_or_on_a_half_ball() {
        let solid = Solid::And(vec![half(0), half(1)]);
        let side = |x: f64| solid.side(&surfaces(), &Point::new(x, 0.1, 0.2), 1e-9);
        assert_eq!(
            [side(-0.5), side(0.5), side(0.0), side(-2.0)],
            [Side::Inside, Side::Outside, Side::On, Side::Outside]
        );
    }

    #[test]
    fn a_surface_inside_the_solid_is_ignored() {
        let solid = Solid::Or(vec![half(0), half(1)]);
        assert_eq!(solid.side(&surfaces(), &Point::new(0.0, 0.1, 0.2), 1e-9), Side::Inside);
        assert_eq!(
            Solid::Not(Box::new(solid)).side(&surfaces(), &Point::new(0.0, 0.1, 0.2), 1e-9),
            Side::Outside
        );
    }

    #[test]
    fn pruning_keeps_only_the_surfaces_that_may_pass_through_the_box() {
        let solid = Solid::And(vec![half(0), half(1)]);
        let prune = |x: f64| {
            let cell = [Interval::new(x, x + 0.3), Interval::new(0.0, 0.3), Interval::new(0.0, 0.3)];
            solid.prune(&mut |id| surfaces()[id.index()].value_range(&cell))
        };
        assert_eq!(prune(-0.1), Pruned::Part(half(1)));
        assert_eq!(prune(-1.1), Pruned::Part(half(0)));
        assert_eq!(prune(0.2), Pruned::Empty);
        assert_eq!(prune(-0.5), Pruned::Full);
        assert_eq!(solid.surfaces(), [SurfaceId(0), SurfaceId(1)]);
    }
}
