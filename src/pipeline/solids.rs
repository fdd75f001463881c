//! Solids of CAD files as facets.

use super::contacts::{Contact, Contacts, Meeting};
use crate::ground::mesh::Touching;
use crate::ground::projector::BrepProjector;
use crate::mesher::facets::{Crossing, FacetModel, of_brep};
use csg::PatchId;
use rayon::prelude::*;

/// A boundary representation with its tessellation.
#[derive(Debug)]
pub(super) struct Cad {
    pub model: brep::Model,
    pub tessellation: brep::Tessellation,
}

/// Faces whose facets have a smaller chord (fraction of the size of the model) get no finer ones.
const FINEST: f64 = 2e-5;

/// How often faces are made finer because their facets intersect: usually twice, and again where
/// the finer facets of one face reach through those of another one.
const MOST_ROUNDS: usize = 12;

/// Facets that intersect deeper than this, in largest distances of facets from their faces, do so
/// because the faces do: twice would be enough if the distances were not found by samples.
const DEEPER: f64 = 5.0;

/// Intersections are judged so many at once; those after the first overlap are not.
const AT_ONCE: usize = 64;

/// Facets that approximate a boundary representation.
#[derive(Debug)]
pub(super) struct Tessellated {
    pub cad: Cad,
    pub facets: FacetModel,
    pub exact: BrepProjector,
    /// Pairs of solids that touch, each with a place.
    pub touching: Vec<Meeting>,
    /// Where solids overlap, if any do.
    pub overlap: Option<Meeting>,
}

/// Approximates a boundary representation by facets. Where those of close faces intersect, these
/// faces have finer ones, unless the faces themselves intersect.
pub(super) fn tessellated(mut model: brep::Model) -> Result<Tessellated, brep::BrepError> {
    let first = brep::Tessellation::of(&mut model, &brep::Settings::default())?;
    let made = of_brep(&model, &first);
    let mut finer: Option<(brep::Tessellation, (FacetModel, BrepProjector))> = None;
    let mut overlap = None;
    for _ in 0..MOST_ROUNDS {
        let (tessellation, (facets, exact)) = match &finer {
            Some((tessellation, made)) => (tessellation, made),
            None => (&first, &made),
        };
        match verdict(facets, exact, tessellation.settings()) {
            Verdict::Free(touching, meetings) => {
                let (tessellation, (mut facets, exact)) = finer.unwrap_or((first, made));
                facets.touching = touching;
                let cad = Cad { model, tessellation };
                return Ok(Tessellated { cad, facets, exact, touching: meetings, overlap: None });
            }
            Verdict::Meet(meeting) => {
                overlap = meeting;
                break;
            }
            Verdict::Finer(settings, meeting) => {
                overlap = meeting;
                // The intersection tells more than that finer facets would be too many.
                let Ok(tessellation) = tessellation.with_settings(&mut model, settings) else { break };
                let made = of_brep(&model, &tessellation);
                finer = Some((tessellation, made));
            }
        }
    }
    let (facets, exact) = made;
    let cad = Cad { model, tessellation: first };
    Ok(Tessellated { cad, facets, exact, touching: Vec::new(), overlap })
}

/// What the intersections of facets say.
enum Verdict {
    /// There are none except those of bodies that touch.
    Free(Touching, Vec<Meeting>),
    /// Finer facets may be free of them, with these settings; the first place where two solids
    /// meet.
    Finer(Vec<brep::Settings>, Option<Meeting>),
    /// Faces intersect; the first place where two solids meet.
    Meet(Option<Meeting>),
}

fn verdict(facets: &FacetModel, exact: &BrepProjector, settings: &[brep::Settings]) -> Verdict {
    let size = facets.bounds.diagonal();
    let contacts = Contacts::new(facets, exact);
    let crossings = facets.intersections();
    let meeting = |crossing: &Crossing| Meeting { patches: crossing.patches, at: crossing.at };
    let first = |crossings: &[Crossing]| {
        crossings.iter().find(|crossing| facets.are_of_different_bodies(crossing)).map(meeting)
    };
    let (mut touch, mut left) = (Vec::new(), Vec::new());
    for some in crossings.chunks(AT_ONCE) {
        let kinds: Vec<_> = some.par_iter().map(|crossing| contacts.of(crossing)).collect();
        for (crossing, kind) in some.iter().zip(kinds) {
            match kind {
                Some(Contact::Overlap) => return Verdict::Meet(Some(meeting(crossing))),
                Some(Contact::Touch) => touch.push(*crossing),
                None if facets.is_deep(crossing) => left.push(*crossing),
                None => {}
            }
        }
    }
    let chord = |crossing: &Crossing| coarser(crossing, settings).chord;
    if left.iter().any(|crossing| crossing.depth > DEEPER * chord(crossing) * size) {
        return Verdict::Meet(first(&left));
    }
    if !left.is_empty() && left.iter().all(|crossing| chord(crossing) >= FINEST) {
        return Verdict::Finer(finer_at(&left, settings), first(&left));
    }
    match contacts.touching(&touch) {
        Ok((touching, meetings)) => {
            // Near where solids touch, the finest facets intersect, too.
            left.retain(|crossing| {
                let [a, b] = crossing.patches.map(|patch| facets.bodies_beside(patch));
                !touching.may_meet(a, b)
            });
            if left.is_empty() { Verdict::Free(touching, meetings) } else { Verdict::Meet(first(&left)) }
        }
        Err(inside) => Verdict::Meet(Some(inside)),
    }
}

/// The settings of the face with larger chords.
fn coarser(crossing: &Crossing, settings: &[brep::Settings]) -> brep::Settings {
    let [a, b] = crossing.patches.map(|patch| settings[patch.index()]);
    if a.chord > b.chord { a } else { b }
}

/// Settings with which facets that intersect are finer.
fn finer_at(crossings: &[Crossing], settings: &[brep::Settings]) -> Vec<brep::Settings> {
    let mut finer = settings.to_vec();
    for patch in crossings.iter().flat_map(|crossing| crossing.patches.map(PatchId::index)) {
        let brep::Settings { chord, angle } = settings[patch];
        if chord > FINEST {
            finer[patch] = brep::Settings { chord: 0.1 * chord, angle: 0.5 * angle };
        }
    }
    finer
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_faces_whose_facets_intersect_are_made_finer() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/geometries/step/bubbles.step");
        let read = || brep::Model::read_step(&std::fs::read(path).unwrap(), brep::Unit::OfFile).unwrap();
        let count = |tessellation: &brep::Tessellation, patch: usize| {
            tessellation.triangles.iter().filter(|t| t.patch as usize == patch).count()
        };
        let Tessellated { cad, facets, .. } = tessellated(read()).unwrap();
        assert_eq!(facets.intersections(), []);
        let coarse = brep::Tessellation::of(&mut read(), &brep::Settings::default()).unwrap();
        let chords: Vec<f64> = cad.tessellation.settings().iter().map(|s| s.chord).collect();
        // The ball and the bubble below its surface; the other bubble is far from both.
        assert!(chords[0] < 2e-4 && chords[0] == chords[2], "{chords:?}");
        let counts = [0, 1, 2].map(|patch| [&coarse, &cad.tessellation].map(|t| count(t, patch)));
        assert!(counts[1][0] == counts[1][1] && counts[1][0] > 100, "{counts:?}");
        assert!([0, 2].iter().all(|&patch| counts[patch][1] > 3 * counts[patch][0]), "{counts:?}");
    }

    #[test]
    fn the_gap_between_touching_faces_may_begin_with_no_angle() {
        // A ring on a shaft, in part where that is rounded.
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/geometries/step/seated_ring.step");
        let mut read = brep::Model::read_step(&std::fs::read(path).unwrap(), brep::Unit::OfFile).unwrap();
        read.imprint();
        let Tessellated { overlap, touching, .. } = tessellated(read).unwrap();
        assert_eq!(overlap, None);
        assert_eq!(touching.len(), 1);
    }

    #[test]
    fn solids_do_not_touch_where_their_faces_have_a_common_edge() {
        let path = concat!(env!("CARGO_MANIFEST_DIR"), "/geometries/step/touching.step");
        let mut read = brep::Model::read_step(&std::fs::read(path).unwrap(), brep::Unit::OfFile).unwrap();
        read.imprint();
        let Tessellated { facets: model, exact, .. } = tessellated(read).unwrap();
        let contacts = Contacts::new(&model, &exact);
        let mut tried = 0;
        for (curve, patches) in model.curves.iter().zip(model.patches_of_curves()) {
            let at = model.points[curve.vertices[0] as usize];
            for pair in patches.iter().flat_map(|&a| patches.iter().map(move |&b| [a, b])) {
                let crossing = Crossing { patches: pair, at, depth: 0.0 };
                tried += usize::from(model.are_of_different_bodies(&crossing));
                assert_eq!(contacts.of(&crossing), None, "{crossing:?}");
            }
        }
        assert!(tried > 0);
    }
}
