//! Merging with and without divided faces and tips of faces.

use super::blunt::blunt;
use super::group::{Allowed, Merged, Outcome, Small, merge_all};
use super::layout::{Layout, TipCut};
use super::report::{MergedEdge, MergedFace, MergedSmall, MergedTip};
use super::spurs::spurs;
use super::strips::{Division, Rest, divisions};
use super::tips::{Candidate, NarrowTip, candidates, narrow};
use crate::mesher::facets::exact::{Shape, grouped};
use crate::mesher::facets::{BluntEnd, FacetModel};
use brep::{BrepError, Cut, Model, On, Piece, Tessellation};
use std::collections::HashMap;

/// The most times that tips are cut off.
const ROUNDS: usize = 12;

/// The most times that they are merged. Without a tip the sizes there are larger, and more of the
/// face is narrow beside them.
const MERGES: usize = 3;

/// After so many failures to merge more tips than before, all that are new are cut off where they
/// are narrower, or left.
const FAILURES: usize = 2;

/// Merges the small faces and edges of a model, and narrow tips of faces; `None` if there are none.
///
/// Narrow faces along several faces are divided first, unless not all of their pieces are merged.
pub fn merge(model: &Model, tessellation: &Tessellation, small: &Small) -> (Option<Merged>, MergedSmall) {
    let shape = Shape::new(model, tessellation);
    let layout = Layout::new(model, tessellation, &shape);
    let allowed = Allowed::of(&layout, small);
    let mut divisions = divisions(&layout, &allowed.faces);
    divisions.extend(spurs(&layout, &allowed, &divisions));
    divisions.retain(|division| !small.kept.faces.contains(&division.face));
    while !divisions.is_empty() && !small.work.is_cancelled() {
        match merge_divided(model, tessellation, small, &divisions) {
            Ok(merged) => return merged,
            Err(failed) => divisions.retain(|division| !failed.contains(&division.face)),
        }
    }
    let without_tips = merge_all(&shape, &layout, small);
    with_tips(layout, &shape, small, without_tips)
}

/// Merges what is small, with narrow faces divided into pieces.
///
/// # Errors
/// The faces of which not all pieces are merged.
fn merge_divided(
    model: &Model,
    tessellation: &Tessellation,
    small: &Small,
    divisions: &[Division],
) -> Result<(Option<Merged>, MergedSmall), Vec<usize>> {
    let divided = |is_one: &dyn Fn(usize) -> bool| -> Vec<usize> {
        divisions.iter().map(|division| division.face).filter(|&face| is_one(face)).collect()
    };
    let all = || divided(&|_| true);
    let pieces: Vec<Piece> = divisions.iter().flat_map(|division| division.pieces.iter().copied()).collect();
    let mut cut = model.cut_off(&pieces).ok_or_else(all)?;
    let tessellation = Tessellation::of_cut(&mut cut, tessellation).map_err(|error| {
        let BrepError::Face { face, .. } = error else { return all() };
        let failed = divided(&|divided| cut.patch_parts_of.get(face - 1) == Some(&divided));
        if failed.is_empty() { all() } else { failed }
    })?;
    let shape = Shape::new(&cut.model, &tessellation);
    let mut layout = Layout::new(&cut.model, &tessellation, &shape);
    for (part, of) in cut.patch_parts_of.iter().enumerate() {
        let of_face = |division: &&Division| division.face == *of && !division.along.is_empty();
        if let Some(division) = divisions.iter().find(of_face) {
            layout.along.insert(part, division.along.clone());
        }
    }
    // The first part of a face has its number, and is what is left of it.
    let is_kept = |face: usize| divisions.iter().any(|d| d.face == face && d.rest == Rest::Kept);
    let unmerged = |report: &MergedSmall| {
        let is_merged = |part: usize| report.faces.iter().any(|merged| merged.face == part + 1);
        let unmerged = divided(&|face| {
            let must = |part: usize| part != face || !is_kept(face);
            let mut parts = cut.patch_parts_of.iter().enumerate();
            parts.any(|(part, of)| *of == face && must(part) && !is_merged(part))
        });
        if unmerged.is_empty() { Ok(()) } else { Err(unmerged) }
    };
    let without_tips = merge_all(&shape, &layout, small);
    unmerged(&without_tips.report)?;
    let (merged, report) = with_tips(layout, &shape, small, without_tips);
    unmerged(&report)?;
    Ok((merged, divided_of_file(report, model, &cut, divisions)))
}

/// Merges what is small and tips of faces; `without_tips` is the result without them.
///
/// Ends of faces whose radius vanishes are blunt if their tips are merged then.
fn with_tips(
    mut layout: Layout,
    shape: &Shape,
    small: &Small,
    mut without_tips: Outcome,
) -> (Option<Merged>, MergedSmall) {
    let Layout { model, tessellation, .. } = layout;
    let mut candidates = candidates(&layout);
    let is_merged = |face: usize| without_tips.report.faces.iter().any(|merged| merged.face == face + 1);
    let is_kept = |face: usize| small.kept.faces.contains(&face);
    candidates.retain(|candidate| !is_merged(candidate.face()) && !is_kept(candidate.face()));
    if candidates.is_empty() {
        return without_tips.finished(model, tessellation, shape);
    }
    let ungrouped = shape.ungrouped(model);
    let grouping = without_tips.merged.as_ref().map_or(&ungrouped, |merged| &merged.1);
    let size = |ends: &[BluntEnd]| (small.size)(&grouped(model, tessellation, shape, grouping, ends));
    let size_with = without_tips.size.take().unwrap_or_else(|| size(&[]));
    let mut ends = blunt(&layout, &candidates, small, &*size_with, size);
    without_tips.size = Some(size_with);
    while !ends.is_empty() && !small.work.is_cancelled() {
        layout.blunt = ends.iter().map(|(_, end)| *end).collect();
        let (outcome, tips) =
            merge_tips(&layout, shape, small, &mut candidates, merge_all(shape, &layout, small));
        let count = ends.len();
        ends.retain(|(candidate, _)| tips.iter().any(|tip| tip.candidate == *candidate));
        if ends.len() == count {
            return outcome.finished(model, tessellation, shape);
        }
    }
    layout.blunt.clear();
    let (outcome, _) = merge_tips(&layout, shape, small, &mut candidates, without_tips);
    outcome.finished(model, tessellation, shape)
}

/// Merges what is small and tips of faces at candidates, which are returned; `outcome` is the one
/// without them.
///
/// Tips are cut off as faces of their own where they are narrow beside the sizes of the model
/// without them. Those that are not merged then are cut off where they are narrower, or left; those
/// that are merged are cut off again where they are narrow beside the sizes that this gives. What
/// candidates have failed with is tried no more.
fn merge_tips(
    layout: &Layout,
    shape: &Shape,
    small: &Small,
    candidates: &mut [Candidate],
    mut outcome: Outcome,
) -> (Outcome, Vec<NarrowTip>) {
    let Layout { model, tessellation, .. } = *layout;
    let mut done = Vec::new();
    if candidates.is_empty() {
        return (outcome, done);
    }
    let of_file =
        || (small.size)(&grouped(model, tessellation, shape, &shape.ungrouped(model), &layout.blunt));
    let mut size = outcome.size.take().unwrap_or_else(of_file);
    let (mut merges, mut failures) = (0, 0);
    for _ in 0..ROUNDS {
        let tips = narrow(layout, candidates, &*size, small.tip_factors, &done);
        if tips == done || merges == MERGES || small.work.is_cancelled() {
            break;
        }
        let Some(cut) = cut_off(model, &tips) else { break };
        match merge_cut(layout, small, cut, &tips) {
            Ok(merged) => {
                (outcome, done, merges, failures) = (merged, tips, merges + 1, 0);
                let Some(of_merged) = outcome.size.take() else { break };
                size = of_merged;
            }
            Err(mut failed) => {
                failures += 1;
                if merges > 0 && failures > FAILURES {
                    // What fails is one tip after the other.
                    failed = tips.iter().filter(|tip| !done.contains(tip)).map(|tip| tip.candidate).collect();
                }
                failed.into_iter().for_each(|candidate| candidates[candidate].attempt += 1);
            }
        }
    }
    (outcome, done)
}

/// The model with tips cut off; `None` if there are none.
fn cut_off(model: &Model, tips: &[NarrowTip]) -> Option<Cut> {
    let tips: Vec<Piece> = tips.iter().map(|narrow| narrow.tip).collect();
    if tips.is_empty() { None } else { model.cut_off(&tips) }
}

/// Merges what is small, and tips that were cut off.
///
/// # Errors
/// The candidates of tips that are not merged.
fn merge_cut(uncut: &Layout, small: &Small, mut cut: Cut, tips: &[NarrowTip]) -> Result<Outcome, Vec<usize>> {
    let Layout { model, tessellation, .. } = *uncut;
    let failed = |has_failed: &dyn Fn(usize, &NarrowTip) -> bool| -> Vec<usize> {
        let failed = tips.iter().enumerate().filter(|(k, tip)| has_failed(*k, tip));
        failed.map(|(_, tip)| tip.candidate).collect()
    };
    let tessellation = Tessellation::of_cut(&mut cut, tessellation).map_err(|error| {
        let at = failed(&|k, tip| is_at(&error, tip, cut.patches[k], cut.curves[k]));
        let beside = failed(&|_, tip| is_beside(&error, tip, model));
        [at, beside, failed(&|_, _| true)].into_iter().find(|failed| !failed.is_empty()).unwrap_or_default()
    })?;
    let cut_off = |(k, narrow): (usize, &NarrowTip)| TipCut {
        tip: cut.patches[k],
        of: narrow.tip.patch,
        edge: cut.curves[k],
    };
    let cuts: Vec<TipCut> = tips.iter().enumerate().map(cut_off).collect();
    let shape = Shape::new(&cut.model, &tessellation);
    let mut layout = Layout::new(&cut.model, &tessellation, &shape);
    (layout.cuts, layout.along, layout.blunt) = (cuts, uncut.along.clone(), uncut.blunt.clone());
    let Outcome { merged, report, size, .. } = merge_all(&shape, &layout, small);
    let is_merged = |k: usize| {
        report.faces.iter().any(|merged| merged.face == cut.patches[k] + 1)
            && report.edges.iter().any(|merged| merged.edge == cut.curves[k] + 1)
    };
    let unmerged = failed(&|k, _| !is_merged(k));
    if !unmerged.is_empty() {
        return Err(unmerged);
    }
    if merged.as_ref().is_some_and(|(facets, ..)| has_crossings(facets)) {
        return Err(failed(&|_, _| true));
    }
    let report = of_file(report, model, &cut, tips);
    Ok(Outcome { merged, report, size, cut: Some((cut.model, tessellation, shape)) })
}

/// Whether an error is at a tip with this patch, cut along this curve; it is if it has no place.
fn is_at(error: &BrepError, narrow: &NarrowTip, patch: usize, curve: usize) -> bool {
    match *error {
        BrepError::Face { face, .. } => [narrow.tip.patch, patch].contains(&(face - 1)),
        BrepError::Edge { edge, .. } => curve == edge - 1,
        _ => true,
    }
}

/// Whether an error is on a face beside a tip: its curve is divided there.
fn is_beside(error: &BrepError, narrow: &NarrowTip, model: &Model) -> bool {
    let BrepError::Face { face, .. } = *error else { return false };
    let of_face = model.patches.get(face - 1).into_iter().flat_map(|patch| patch.loops.iter().flatten());
    let curves: Vec<On> = narrow.tip.all_sides(model).map(|side| side.on).collect();
    of_face.map(|fin| fin.on).any(|on| curves.contains(&on))
}

fn has_crossings(facets: &FacetModel) -> bool {
    facets.intersections().iter().any(|crossing| facets.is_deep(crossing))
}

/// The report in the numbers of the file: tips are no faces there, and parts of an edge have its
/// number.
fn of_file(report: MergedSmall, model: &Model, cut: &Cut, tips: &[NarrowTip]) -> MergedSmall {
    let is_of_file = |face: usize| face <= model.patches.len();
    let (faces, cut_off): (Vec<_>, Vec<_>) =
        report.faces.into_iter().partition(|merged| is_of_file(merged.face));
    let tip = |(narrow, patch): (&NarrowTip, &usize)| {
        let merged = cut_off.iter().find(|merged| merged.face == patch + 1)?;
        let point = model.corners[narrow.corner].point.into();
        Some(MergedTip { face: narrow.tip.patch + 1, into: merged.into, point, width: narrow.width })
    };
    let tips = tips.iter().zip(&cut.patches).filter_map(tip).collect();
    MergedSmall { faces, tips, edges: edges_of_file(report.edges, cut), named: report.named }
}

/// The report in the numbers of the file: pieces of a divided face have its number, and spurs are
/// tips.
fn divided_of_file(report: MergedSmall, model: &Model, cut: &Cut, divisions: &[Division]) -> MergedSmall {
    let of_file = |face: usize| cut.patch_parts_of[face - 1] + 1;
    let pieces =
        divisions.iter().flat_map(|division| division.pieces.iter().map(move |piece| (division, piece)));
    let spurs: HashMap<usize, &Piece> = pieces
        .zip(&cut.patches)
        .filter(|((division, _), _)| division.rest == Rest::Kept)
        .map(|((_, piece), patch)| (patch + 1, piece))
        .collect();
    let mut out = MergedSmall { edges: edges_of_file(report.edges, cut), ..report };
    out.tips.iter_mut().for_each(|tip| (tip.face, tip.into) = (of_file(tip.face), of_file(tip.into)));
    for merged in std::mem::take(&mut out.faces) {
        let (face, into, width) = (of_file(merged.face), of_file(merged.into), merged.width);
        match spurs.get(&merged.face) {
            None => out.faces.push(MergedFace { face, into, ..merged }),
            Some(spur) => {
                let (_, end) = model.end_of(spur.sides(model)[0], false);
                out.tips.push(MergedTip { face, into, point: model.corners[end].point.into(), width });
            }
        }
    }
    out
}

/// Merged edges in the numbers of the file, which has no cuts: parts of an edge have its number.
fn edges_of_file(mut edges: Vec<MergedEdge>, cut: &Cut) -> Vec<MergedEdge> {
    let edge = |edge: usize| cut.parts_of[edge - 1].map(|edge| edge + 1);
    edges.retain_mut(|merged| {
        let mut curve: Vec<usize> = merged.curve.iter().filter_map(|part| edge(*part)).collect();
        curve.dedup();
        merged.curve = curve;
        let of_file = edge(merged.edge);
        merged.edge = of_file.unwrap_or(merged.edge);
        of_file.is_some() && merged.curve.len() > 1
    });
    edges
}
