//! Bodies that touch.

use csg::BodyId;
use std::collections::BTreeSet;

/// Pairs of bodies that touch each other in lines or points, or overlap by no more than the
/// accuracy of their geometry.
///
/// Triangles on the surfaces of both may intersect, so no triangulation of space has them all. Each
/// body is filled by itself.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Touching(BTreeSet<[BodyId; 2]>);

impl Touching {
    /// Adds each body of one surface with each of the other.
    pub fn add(&mut self, one: [Option<BodyId>; 2], other: [Option<BodyId>; 2]) {
        self.0.extend(pairs_of_bodies(one, other));
    }

    /// Whether there are no such bodies.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether surfaces between these bodies may intersect: no body is beside both of them, and
    /// bodies beside them touch.
    pub fn may_meet(&self, one: [Option<BodyId>; 2], other: [Option<BodyId>; 2]) -> bool {
        !self.is_empty()
            && !have_common_body(one, other)
            && pairs_of_bodies(one, other).any(|pair| self.0.contains(&pair))
    }
}

/// Whether a body is beside both of two surfaces.
pub(crate) fn have_common_body(one: [Option<BodyId>; 2], other: [Option<BodyId>; 2]) -> bool {
    one.iter().flatten().any(|body| other.contains(&Some(*body)))
}

/// All pairs of bodies beside one surface and another one, ascending.
pub(crate) fn pairs_of_bodies(
    one: [Option<BodyId>; 2],
    other: [Option<BodyId>; 2],
) -> impl Iterator<Item = [BodyId; 2]> {
    let bodies = one.into_iter().flatten();
    bodies.flat_map(move |a| other.into_iter().flatten().map(move |b| [a.min(b), a.max(b)]))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn surfaces_of_bodies_that_touch_may_meet_where_they_have_no_common_body() {
        let [a, b, c] = [0, 1, 2].map(|body| Some(BodyId(body)));
        let mut touching = Touching::default();
        assert!(touching.is_empty() && !touching.may_meet([a, None], [b, None]));
        touching.add([b, None], [a, None]);
        assert!(touching.may_meet([a, None], [None, b]) && touching.may_meet([b, c], [a, None]));
        assert!(!touching.may_meet([a, c], [b, c]) && !touching.may_meet([a, None], [c, None]));
        assert!(!touching.may_meet([a, None], [a, None]));
    }
}
