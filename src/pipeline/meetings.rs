//! Solids that overlap or touch, and facets that intersect.

use super::contacts::{Contact, Contacts, Meeting};
use super::{CoarseError, FacetSolid};
use crate::ground::mesh::Touching;
use crate::ground::size::SizeField;
use crate::mesher::facets::{Constraints, Crossing, RemeshSettings, keep, remesh};
use crate::mesher::surface::SurfaceMesh;
use csg::PatchId;
use std::sync::{Mutex, PoisonError};

impl FacetSolid {
    /// The error for solids that overlap, or facets that intersect where no finer facets would keep
    /// them apart.
    pub(super) fn deep_meeting(&self) -> Option<CoarseError> {
        if let Some(overlap) = &self.overlap {
            return self.solids_meet(overlap);
        }
        let crossings = self.model.intersections();
        let is_deep = crossings.iter().any(|crossing| self.model.is_deep(crossing));
        if is_deep { self.facets_meet(&crossings) } else { None }
    }

    /// The error for facets that intersect, if there is no mesh and any do.
    pub(super) fn any_meeting(&self) -> Option<CoarseError> {
        let mut crossings = self.model.intersections();
        if self.exact.is_some() {
            // Those by rounding alone come from the file, and say nothing to its user.
            crossings.retain(|crossing| self.model.is_deep(crossing));
        }
        self.facets_meet(&crossings)
    }

    /// The error for facets that intersect. Intersections of different files or solids come first.
    fn facets_meet(&self, crossings: &[Crossing]) -> Option<CoarseError> {
        if self.exact.is_some() {
            let different = crossings.iter().find(|crossing| self.model.are_of_different_bodies(crossing));
            if let Some(&Crossing { patches, at, .. }) = different {
                return self.solids_meet(&Meeting { patches, at });
            }
            let deepest = crossings.iter().max_by(|a, b| a.depth.total_cmp(&b.depth))?;
            let faces = deepest.patches.map(|patch| self.names.patches[patch.index()].number);
            return Some(CoarseError::FacesMeet { faces, count: crossings.len(), at: deepest.at });
        }
        let files = |crossing: &Crossing| {
            let file = |patch| self.model.patch(patch).labels.first().map(|label| label.0);
            let [a, b] = crossing.patches.map(file);
            a.zip(b).filter(|(a, b)| a != b).map(|(a, b)| [a.min(b), a.max(b)])
        };
        let first = crossings.iter().find(|crossing| files(crossing).is_some()).or(crossings.first())?;
        let files = files(first).map(|pair| Box::new(pair.map(|file| self.files[file as usize].clone())));
        Some(CoarseError::FacetsMeet { files, count: crossings.len(), first: first.at })
    }

    /// The error for two solids that overlap.
    fn solids_meet(&self, meeting: &Meeting) -> Option<CoarseError> {
        let [a, b] = self.solids_of(meeting);
        let solids = Box::new([a?, b?]);
        Some(CoarseError::SolidsMeet { solids, first: meeting.at, are_cut: self.overlaps_are_cut })
    }

    /// The surface mesh, and the bodies that touch, with the places that are new: facets may be
    /// apart where the elements, whose vertices are on the exact faces, are not.
    pub(super) fn surface(
        &self,
        size: &dyn SizeField,
    ) -> Result<(SurfaceMesh, Touching, Vec<Meeting>), CoarseError> {
        if self.keep_surface {
            return Ok((keep(&self.model), self.model.touching.clone(), Vec::new()));
        }
        let touching = Mutex::new((self.model.touching.clone(), Vec::new()));
        let contacts = self.exact.as_ref().map(|exact| Contacts::new(&self.model, exact));
        let touch = |crossing: &Crossing| {
            let [a, b] = crossing.patches.map(|patch| self.model.bodies_beside(patch));
            let (known, new) = &mut *touching.lock().unwrap_or_else(PoisonError::into_inner);
            if !known.may_meet(a, b)
                && contacts.as_ref().is_some_and(|contacts| contacts.of(crossing) == Some(Contact::Touch))
            {
                known.add(a, b);
                new.push(Meeting { patches: crossing.patches, at: crossing.at });
            }
            known.may_meet(a, b)
        };
        let (settings, free) = (RemeshSettings::default(), Constraints::default());
        let (surface, _) =
            remesh(&self.model, size, (&settings, &free), &|surface| self.snap(surface), &touch)?;
        let (touching, new) = touching.into_inner().unwrap_or_else(PoisonError::into_inner);
        Ok((surface, touching, new))
    }

    /// Says which solids touch.
    pub(super) fn touching_note(&self, touching: &[Meeting]) -> Option<String> {
        let first = touching.first()?;
        let [Some((a, name_a)), Some((b, name_b))] = self.solids_of(first) else { return None };
        let at = first.at;
        let more = match touching.len() - 1 {
            0 => String::new(),
            1 => ", and so does another pair of solids".into(),
            more => format!(", and so do {more} other pairs"),
        };
        Some(format!(
            "the solids {a} ({name_a}) and {b} ({name_b}) touch without a common face near ({}, {}, {}){more}: there they \
             have no common vertices, each solid is meshed by itself",
            at.x, at.y, at.z
        ))
    }

    /// The numbers and names of two solids that meet.
    fn solids_of(&self, meeting: &Meeting) -> [Option<(u32, String)>; 2] {
        meeting.patches.map(|patch: PatchId| {
            let [inside, outside] = self.model.bodies_beside(patch);
            let label = &self.names.bodies[inside.or(outside)?.index()];
            Some((label.number, label.names.first().cloned().unwrap_or_default()))
        })
    }
}
