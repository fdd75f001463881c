//! Groups of faces and edges, chosen by their sizes and the size of the elements.

use super::chains::{Chain, chains};
use super::faces::{Joins, continued, joins};
use super::kept::Kept;
use super::layout::Layout;
use super::report::{MergedEdge, MergedFace, MergedSmall, NamedFace};
use crate::Point;
use crate::ground::mesh::Touching;
use crate::ground::progress::Work;
use crate::ground::projector::BrepProjector;
use crate::ground::size::SizeField;
use crate::mesher::facets::FacetModel;
use crate::mesher::facets::exact::{Shape, exact, grouped};
use brep::{Model, Tessellation};
use rayon::prelude::*;

/// Faces of a file as patches, and its edges as curves.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Grouping {
    /// The faces of each patch, the main face first.
    pub patches: Vec<Vec<usize>>,
    /// The edges of each curve in order, each with whether it is used forward.
    pub curves: Vec<Vec<(usize, bool)>>,
    /// Whether each edge is so short that its direction has no influence.
    pub is_short: Vec<bool>,
    /// The corners that remain, ascending.
    pub corners: Vec<u32>,
}

/// What is small.
pub struct Small<'a> {
    /// An edge or face is small if elements are at least this many times as large.
    pub factor: f64,
    /// The same where sizes are smaller because others were found too large to be merged.
    pub still_factor: f64,
    /// The largest size of elements.
    pub largest: f64,
    /// Tips of faces are cut off where elements are this many times as large as their width: those
    /// with sharp edges, and those that go on smoothly beyond an edge.
    pub tip_factors: [f64; 2],
    /// What is not merged.
    pub kept: &'a Kept,
    /// The bodies that touch.
    pub touching: &'a Touching,
    /// The wanted size of elements of a model.
    pub size: &'a dyn Fn(&FacetModel) -> Box<dyn SizeField>,
    /// Ends the search for what is small when it is cancelled.
    pub work: &'a Work<'a>,
}

/// Share of the factor of tips that must be left after they were cut off: sizes are smaller then,
/// because edges are shorter.
const TIP_STILL_SMALL: f64 = 0.25;

/// The longest edge at an end of a short one is at least this many times as long.
const LONGER: f64 = 20.0;

/// The faces and edges that may be merged.
pub(super) struct Allowed {
    pub faces: Vec<bool>,
    pub edges: Vec<bool>,
}

impl Allowed {
    /// Faces and edges far smaller than one of their neighbours and than the largest elements.
    pub fn of(layout: &Layout, small: &Small) -> Self {
        let most = small.largest / small.factor;
        let mut longest = vec![0.0_f64; layout.model.corners.len()];
        for &edge in &layout.curves {
            for end in layout.model.curves[edge].ends {
                longest[end] = longest[end].max(layout.lengths[edge]);
            }
        }
        let is_short = |edge: usize| {
            let ends = layout.model.curves[edge].ends;
            let neighbour = ends.into_iter().map(|end| longest[end]).fold(0.0, f64::max);
            let is_closed = ends[0] == ends[1];
            !is_closed && layout.lengths[edge] <= most.min(neighbour / LONGER)
        };
        let mut edges = vec![false; layout.lengths.len()];
        for &edge in &layout.curves {
            edges[edge] = is_short(edge) && !small.kept.edges.contains(&edge);
        }
        // A face that hardly turns may be as wide as a tip that does not.
        let is_bend = |face: usize| {
            small.tip_factors[1] * layout.widths[face] <= small.largest
                && continued(layout, face).next().is_some()
        };
        let mut faces = vec![false; layout.around.len()];
        loop {
            // The corner between rounded edges has only narrow faces beside it.
            let before = faces.clone();
            for face in (0..faces.len()).filter(|face| !before[*face] && !small.kept.faces.contains(face)) {
                faces[face] = LONGER * layout.widths[face] <= widest_near(layout, face, &before)
                    && (layout.widths[face] <= most || is_bend(face));
            }
            if faces == before {
                return Self { faces, edges };
            }
        }
    }
}

/// The width of the widest face beside a face, or beside one of its narrow neighbours.
fn widest_near(layout: &Layout, face: usize, is_narrow: &[bool]) -> f64 {
    let beside =
        |face: usize| layout.around[face].iter().flat_map(|&edge| layout.faces_of[edge].iter().copied());
    let near = beside(face).flat_map(|other| {
        let beyond = is_narrow[other].then(|| beside(other));
        std::iter::once(other).chain(beyond.into_iter().flatten())
    });
    near.map(|other| layout.widths[other]).fold(0.0, f64::max)
}

/// A model with patches and curves of several faces and edges.
pub type Merged = (FacetModel, BrepProjector, Grouping);

/// What was merged.
pub(super) struct Outcome {
    /// The facets with their groups; none if nothing is.
    pub merged: Option<(FacetModel, Grouping)>,
    pub report: MergedSmall,
    /// The sizes of the model after it; none if nothing may be merged.
    pub size: Option<Box<dyn SizeField>>,
    /// The model of which tips were cut off before it, if any were.
    pub cut: Option<(Model, Tessellation, Shape)>,
}

impl Outcome {
    /// What was merged of a model, if anything, with its exact faces.
    pub fn finished(
        self,
        model: &Model,
        tessellation: &Tessellation,
        shape: &Shape,
    ) -> (Option<Merged>, MergedSmall) {
        let merged = self.merged.map(|(facets, grouping)| {
            let exact = match &self.cut {
                Some((model, tessellation, shape)) => exact(model, tessellation, shape, &grouping),
                None => exact(model, tessellation, shape, &grouping),
            };
            (facets, exact, grouping)
        });
        (merged, self.report)
    }
}

/// Merges the small faces and edges of a model, of which tips may have been cut off.
///
/// What is merged must be small beside the sizes that the model has without all that may be merged,
/// and still small beside those of what is merged in the end. Merging less never makes sizes
/// larger, so faces and edges are taken out until all that are left are small.
pub(super) fn merge_all(shape: &Shape, layout: &Layout, small: &Small) -> Outcome {
    let (model, tessellation) = (layout.model, layout.tessellation);
    let mut allowed = Allowed::of(layout, small);
    for cut in &layout.cuts {
        (allowed.faces[cut.tip], allowed.edges[cut.edge]) = (true, true);
    }
    let mut factor = small.factor;
    loop {
        let is_over = small.work.is_cancelled();
        if is_over || !allowed.faces.iter().chain(&allowed.edges).any(|allowed| *allowed) {
            return Outcome { merged: None, report: MergedSmall::default(), size: None, cut: None };
        }
        let joins = joins(layout, &allowed.faces);
        let (grouping, chains) = grouping(layout, &joins, &allowed.edges);
        let mut report = report(layout, &joins, &chains, &allowed.edges);
        let mut facets = grouped(model, tessellation, shape, &grouping, &layout.blunt);
        facets.touching = small.touching.clone();
        let size = (small.size)(&facets);
        if !report.named.is_empty() {
            // A narrow face lowers the sizes around it: the largest one is that of all others.
            let largest = tessellation.points.par_iter().map(|p| size.size_at(p)).reduce(|| 0.0, f64::max);
            report.named.retain(|kept| small.factor * kept.width <= largest);
        }
        if report.faces.is_empty() && report.edges.is_empty() {
            return Outcome { merged: None, report, size: Some(size), cut: None };
        }
        let is_small = |points: Vec<Point>, extent: f64, factor: f64| {
            points.into_iter().all(|p| factor * extent <= size.size_at(&p))
        };
        let tip_factor = TIP_STILL_SMALL * small.tip_factors[0];
        let point = |v: u32| tessellation.points[v as usize];
        let points_of_edge =
            |edge: usize| tessellation.lines[edge].iter().map(|on| point(on.0)).collect::<Vec<_>>();
        let mut are_all_small = true;
        for merged in &report.faces {
            let face = merged.face - 1;
            let is_narrow = match layout.cut_of(face) {
                // It is narrower elsewhere.
                Some(cut) => is_small(points_of_edge(cut.edge), merged.width, tip_factor),
                // Elements may be smaller where it is narrower.
                None => {
                    let is_bend = continued(layout, face).any(|main| main == merged.into - 1);
                    let factor = if is_bend { factor.min(small.tip_factors[1]) } else { factor };
                    layout.local_widths[face].iter().all(|(p, width)| factor * width <= size.size_at(p))
                }
            };
            if !is_narrow {
                (allowed.faces[face], are_all_small) = (false, false);
            }
        }
        for merged in &report.edges {
            let edge = merged.edge - 1;
            let is_cut = layout.cuts.iter().any(|cut| cut.edge == edge);
            let factor = if is_cut { tip_factor } else { factor };
            if !is_small(points_of_edge(edge), merged.length, factor) {
                (allowed.edges[edge], are_all_small) = (false, false);
            }
        }
        if are_all_small {
            return Outcome { merged: Some((facets, grouping)), report, size: Some(size), cut: None };
        }
        factor = small.still_factor;
    }
}

fn grouping(layout: &Layout, joins: &[Joins], is_short: &[bool]) -> (Grouping, Vec<Chain>) {
    let faces = joins.len();
    let mut patch_of = vec![usize::MAX; faces];
    let mut patches: Vec<Vec<usize>> = Vec::new();
    for face in 0..faces {
        if !matches!(joins[face], Joins::Main(_)) {
            patch_of[face] = patches.len();
            patches.push(vec![face]);
        }
    }
    for face in 0..faces {
        if let Joins::Main(main) = joins[face] {
            patch_of[face] = patch_of[main];
            patches[patch_of[main]].push(face);
        }
    }
    let chains = chains(layout, &patch_of, is_short);
    let mut has_curve = vec![false; layout.is_corner.len()];
    for &edge in &layout.curves {
        layout.model.curves[edge].ends.iter().for_each(|&end| has_curve[end] = true);
    }
    let mut is_end = vec![false; layout.is_corner.len()];
    chains.iter().filter_map(|chain| chain.ends).flatten().for_each(|end| is_end[end] = true);
    // Tips of cones are corners of no curve.
    let remains = |&corner: &usize| layout.is_corner[corner] && (is_end[corner] || !has_curve[corner]);
    let corners = (0..layout.is_corner.len()).filter(remains).map(|corner| corner as u32).collect();
    let curves = chains.iter().map(|chain| chain.edges.clone()).collect();
    (Grouping { patches, curves, is_short: is_short.to_vec(), corners }, chains)
}

fn report(layout: &Layout, joins: &[Joins], chains: &[Chain], is_short: &[bool]) -> MergedSmall {
    let mut out = MergedSmall::default();
    for (face, joins) in joins.iter().enumerate() {
        let (name, width) = (layout.name(face).map(str::to_owned), layout.widths[face]);
        match *joins {
            Joins::Main(main) => {
                out.faces.push(MergedFace { face: face + 1, name, into: main + 1, width });
            }
            Joins::Named => {
                out.named.push(NamedFace { face: face + 1, name: name.unwrap_or_default(), width });
            }
            Joins::None => {}
        }
    }
    for chain in chains.iter().filter(|chain| chain.edges.len() > 1) {
        let curve: Vec<usize> = chain.edges.iter().map(|(edge, _)| edge + 1).collect();
        for &(edge, _) in chain.edges.iter().filter(|(edge, _)| is_short[*edge]) {
            let length = layout.lengths[edge];
            out.edges.push(MergedEdge { edge: edge + 1, curve: curve.clone(), length });
        }
    }
    out.edges.sort_by_key(|merged| merged.edge);
    out
}
