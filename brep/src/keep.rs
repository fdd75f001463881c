//! A model of some of its bodies.

use crate::model::{Model, On};

impl Model {
    /// Leaves out all bodies but those of some indices, with the patches, curves and corners
    /// that only others use. Bodies keep their order.
    pub fn keep_bodies(&mut self, bodies: &[usize]) {
        let to = numbers((0..self.bodies).map(|body| bodies.contains(&body)));
        for patch in &mut self.patches {
            patch.bodies = patch.bodies.map(|body| body.and_then(|body| to[body]));
        }
        let keeps: Vec<bool> =
            self.patches.iter().map(|patch| patch.bodies.iter().any(Option::is_some)).collect();
        retain(&mut self.patches, &keeps);
        retain(&mut self.patch_names, &keeps);
        retain(&mut self.body_names, &to.iter().map(Option::is_some).collect::<Vec<_>>());
        self.bodies = to.iter().flatten().count();
        self.drop_unused();
    }

    /// Leaves out curves and corners that no patch uses.
    pub(crate) fn drop_unused(&mut self) {
        let (mut has_curve, mut has_corner) =
            (vec![false; self.curves.len()], vec![false; self.corners.len()]);
        for fin in self.patches.iter().flat_map(|patch| patch.loops.iter().flatten()) {
            match fin.on {
                On::Curve(curve) => has_curve[curve] = true,
                On::Corner(corner) => has_corner[corner] = true,
            }
        }
        retain(&mut self.curves, &has_curve);
        self.curves.iter().for_each(|curve| curve.ends.iter().for_each(|&end| has_corner[end] = true));
        retain(&mut self.corners, &has_corner);
        let (curves, corners) = (numbers(has_curve.into_iter()), numbers(has_corner.into_iter()));
        for curve in &mut self.curves {
            curve.ends = curve.ends.map(|end| corners[end].expect("the end of a used curve"));
        }
        for fin in self.patches.iter_mut().flat_map(|patch| patch.loops.iter_mut().flatten()) {
            fin.on = match fin.on {
                On::Curve(curve) => On::Curve(curves[curve].expect("a used curve")),
                On::Corner(corner) => On::Corner(corners[corner].expect("a used corner")),
            };
        }
    }
}

/// The new number of each kept item.
fn numbers(keeps: impl Iterator<Item = bool>) -> Vec<Option<usize>> {
    let mut next = 0..;
    keeps.map(|keeps| if keeps { next.next() } else { None }).collect()
}

/// Keeps some items of a list that is full or empty.
fn retain<T>(items: &mut Vec<T>, keeps: &[bool]) {
    let mut keeps = keeps.iter();
    items.retain(|_| keeps.next().copied().unwrap_or(false));
}
