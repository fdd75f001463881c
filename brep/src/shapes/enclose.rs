//! Solids of faces that enclose them, for files that have only surfaces.

use super::imprint::Groups;
use super::{Shapes, glue};
use crate::{BrepError, Point};
use std::collections::BTreeMap;

impl Shapes {
    /// Makes solids of faces that enclose them and leaves out the others, with notes. Each face
    /// must be that of a body of its own. Where faces share no edge, edges at the same place are
    /// one.
    ///
    /// Returns the number that the first face of each solid had before.
    ///
    /// # Errors
    /// [`BrepError::NoSolid`], also with the number of `edges` of no face, if nothing is enclosed.
    pub fn enclose(&mut self, edges: usize, notes: &mut Vec<String>) -> Result<Vec<usize>, BrepError> {
        let faces = self.faces.len();
        let mut solid_of = vec![None; faces];
        self.find_closed(&mut solid_of);
        // Solids that touch have common edges too, so those that are closed do not take part.
        self.unite(&solid_of);
        glue::glue_edges(self, self.size(), glue::OF_LOOSE_FACES);
        let open = self.find_closed(&mut solid_of);
        let mut first: Vec<usize> = solid_of.iter().flatten().copied().collect();
        first.sort_unstable();
        first.dedup();
        if first.is_empty() {
            return Err(BrepError::NoSolid { faces, edges, open });
        }
        let bodies: BTreeMap<usize, usize> = first.iter().copied().zip(0..).collect();
        self.number_bodies(|face| solid_of[face].map(|solid| bodies[&solid]), first.len());
        let (solids, left) = (first.len(), faces - self.faces.len());
        let (count, taken) = match solids {
            1 => ("one".to_owned(), "a solid"),
            _ => (solids.to_string(), "solids"),
        };
        let enclosing = self.faces.len();
        notes.push(format!(
            "there is no solid, but {enclosing} faces enclose {count}: they are taken as {taken}"
        ));
        notes.extend(left_out(left));
        Ok(first)
    }

    /// Of the faces without a solid, gives those that enclose one the first face of it. Returns a
    /// place on an edge that does not have two faces, if there is one.
    fn find_closed(&self, solid_of: &mut [Option<usize>]) -> Option<Point> {
        let mut faces_of = vec![Vec::new(); self.curves.len()];
        let free = |face: &usize| solid_of[*face].is_none();
        for number in (0..self.faces.len()).filter(free) {
            self.faces[number].loops.iter().flatten().for_each(|&(curve, _)| faces_of[curve].push(number));
        }
        // The first face of each set stands for it.
        let mut group = Groups::new(self.faces.len());
        for pair in faces_of.iter().flat_map(|faces| faces.windows(2)) {
            group.join(pair[0], pair[1]);
        }
        let mut is_closed: Vec<bool> = solid_of.iter().map(Option::is_none).collect();
        let mut open = None;
        for (curve, faces) in self.curves.iter().zip(&faces_of) {
            let Some(&first) = faces.first() else { continue };
            if faces.len() != 2 {
                is_closed[group.root(first)] = false;
                let [low, high] = curve.range;
                open = open.or(Some(Point::from(curve.curve.point(0.5 * (low + high)))));
            }
        }
        for (face, solid) in solid_of.iter_mut().enumerate() {
            *solid = solid.or(Some(group.root(face)).filter(|&first| is_closed[first]));
        }
        open
    }

    /// Gives the faces of each solid the body of its first face: edges of one body are not taken as
    /// one merely because they are close.
    fn unite(&mut self, solid_of: &[Option<usize>]) {
        for (number, first) in solid_of.iter().enumerate() {
            let Some(first) = *first else { continue };
            let body = self.faces[first].body;
            self.faces[number].body = body;
            for curve in self.curves_of(number) {
                self.body_of_curve[curve] = body;
                self.curves[curve].ends.iter().for_each(|&end| self.body_of_corner[end] = body);
            }
        }
    }

    /// Gives each face its new body, and leaves out those without one.
    fn number_bodies(&mut self, body: impl Fn(usize) -> Option<usize>, count: usize) {
        let mut accuracy = vec![0.0; count];
        let mut number = 0..;
        self.faces.retain_mut(|face| {
            let body = number.next().and_then(&body);
            if let Some(body) = body {
                accuracy[body] = f64::max(accuracy[body], self.accuracy[face.body]);
                face.body = body;
            }
            body.is_some()
        });
        self.accuracy = accuracy;
        self.drop_unused();
    }

    /// Leaves out curves and corners of no face; the others get the bodies of their faces.
    fn drop_unused(&mut self) {
        let (mut curves, mut corners) = (BTreeMap::new(), BTreeMap::new());
        let (old_curves, old_corners) = (std::mem::take(&mut self.curves), std::mem::take(&mut self.corners));
        self.body_of_curve.clear();
        self.body_of_corner.clear();
        for face in &mut self.faces {
            for (curve, _) in face.loops.iter_mut().flatten() {
                *curve = *curves.entry(*curve).or_insert_with_key(|&curve| {
                    let mut used = old_curves[curve].clone();
                    used.ends = used.ends.map(|end| {
                        *corners.entry(end).or_insert_with_key(|&end| {
                            self.corners.push(old_corners[end]);
                            self.body_of_corner.push(face.body);
                            self.corners.len() - 1
                        })
                    });
                    self.curves.push(used);
                    self.body_of_curve.push(face.body);
                    self.curves.len() - 1
                });
            }
        }
    }
}

/// The note that some faces are left out, if there are any.
pub(crate) fn left_out(faces: usize) -> Option<String> {
    (faces > 0).then(|| format!("{faces} faces that bound no solid are left out"))
}

#[cfg(test)]
mod tests {
    use super::super::tests::{Solids, X, measured, square};
    use super::*;
    use crate::Model;

    /// The faces of solids without those of some numbers, each with edges and corners of its own.
    fn apart(solids: Solids, without: &[usize]) -> Shapes {
        let solids = solids.into_shapes();
        let mut apart = Shapes::default();
        let kept = solids.faces.iter().enumerate().filter(|(number, _)| !without.contains(number));
        for (body, (_, face)) in kept.enumerate() {
            let mut face = face.clone();
            face.body = body;
            let mut corners = BTreeMap::new();
            for (curve, _) in face.loops.iter_mut().flatten() {
                let mut own = solids.curves[*curve].clone();
                let mut add = |end| apart.add_corner(solids.corners[end], body);
                own.ends = own.ends.map(|end| *corners.entry(end).or_insert_with(|| add(end)));
                apart.curves.push(own);
                apart.body_of_curve.push(body);
                *curve = apart.curves.len() - 1;
            }
            apart.accuracy.push(1e-9);
            apart.faces.push(face);
        }
        apart
    }

    fn enclosed(mut shapes: Shapes) -> Result<Model, BrepError> {
        let mut notes = Vec::new();
        let bodies = shapes.enclose(7, &mut notes)?.len();
        let mut model = Model { bodies, notes, ..Model::default() };
        shapes.build(&mut model)?;
        Ok(model)
    }

    /// A block, a plate with a hole, and a ball.
    fn three() -> Solids {
        let mut solids = Solids::default();
        solids.block([0.0; 3], [1.0; 3]);
        solids.prism(&square(X * 5.0, 1.0, 0.0), [0.0, 0.5], &[(X * 5.0, 0.3)]);
        solids.ball(X * 9.0, 1.0);
        solids
    }

    #[test]
    fn faces_that_enclose_solids_are_solids() {
        let pi = std::f64::consts::PI;
        let (model, volumes, _) = measured(enclosed(apart(three(), &[])).unwrap());
        let exact = [1.0, 2.0 - 0.045 * pi, 4.0 / 3.0 * pi];
        assert!(
            volumes.iter().zip(exact).all(|(found, exact)| (found / exact - 1.0).abs() < 2e-3),
            "{volumes:?}"
        );
        assert_eq!(model.notes, ["there is no solid, but 14 faces enclose 3: they are taken as solids"]);
    }

    #[test]
    fn faces_that_enclose_nothing_are_left_out_or_refused_with_the_place() {
        let (model, volumes, _) = measured(enclosed(apart(three(), &[2, 13])).unwrap());
        assert!((volumes[0] / 1.858_628 - 1.0).abs() < 2e-3, "{volumes:?}");
        let notes = [
            "there is no solid, but 7 faces enclose one: they are taken as a solid",
            "5 faces that bound no solid are left out",
        ];
        assert_eq!(model.notes, notes);

        let mut block = Solids::default();
        block.block([0.0; 3], [1.0; 3]);
        // The wall at x = 1.
        let error = enclosed(apart(block, &[1])).unwrap_err();
        let BrepError::NoSolid { faces: 5, edges: 7, open: Some(place) } = error else { panic!("{error}") };
        assert!((place.x - 1.0).abs() < 1e-12, "{place}");
    }
}
