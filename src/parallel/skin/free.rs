//! The part of a skin that may be remeshed.

use super::extract::sorted_ends;
use super::{Skin, SkinTriangle};
use crate::ground::mesh::{BoundaryTriangle, Class, Rank, VertexId};
use crate::ground::projector::Projector;
use crate::ground::size::Source;
use crate::mesher::facets::{Constraints, FacetCurve, FacetModel, FacetPatch, Piece, SurfacePart};
use csg::{CornerId, CurveId, PatchId};
use std::collections::{BTreeMap, HashSet};

/// No vertex, no patch.
pub(super) const NONE: u32 = u32::MAX;

/// What triangles on one side of a patch have in common.
type Group = ((PatchId, bool), [Option<csg::BodyId>; 2]);

/// The part of a skin that may change.
pub(super) struct Free<'a> {
    pub skin: &'a Skin,
    /// The triangles, by index in the skin.
    triangles: Vec<u32>,
    /// Whether each triangle of the skin may change.
    pub is_free: Vec<bool>,
    /// The vertices of these triangles, ascending.
    pub vertices: Vec<u32>,
    /// Whether each vertex of the skin must stay.
    pub is_fixed: Vec<bool>,
    /// The groups, ascending, and that of each of `triangles`.
    pub groups: Vec<Group>,
    group_of: Vec<u32>,
    /// The chains of edges, by vertices of the skin, and what they are.
    pub chains: Vec<(Vec<u32>, Piece)>,
    /// Edges between `vertices` that only other triangles have.
    taken: HashSet<[u32; 2]>,
    /// The sides of free triangles that may change, ascending.
    pub sides: Vec<[u32; 2]>,
}

impl<'a> Free<'a> {
    /// `None` if nothing may change.
    pub fn of(skin: &'a Skin, projector: &Projector, stay: &HashSet<PatchId>) -> Option<Self> {
        let shared = SharedVertices::of(skin);
        let may_change = |t: &SkinTriangle| {
            let group = t.patch.filter(|(patch, _)| !stay.contains(patch));
            group.is_some() && !shared.have_common(&t.vertices)
        };
        let is_free: Vec<bool> = skin.triangles.iter().map(may_change).collect();
        let triangles: Vec<u32> = (0..skin.triangles.len() as u32).filter(|&t| is_free[t as usize]).collect();
        if triangles.is_empty() {
            return None;
        }
        let group = |&t: &u32| {
            let triangle = &skin.triangles[t as usize];
            (triangle.patch.expect("free triangles are on patches"), triangle.beside)
        };
        let mut groups: Vec<Group> = triangles.iter().map(group).collect();
        groups.sort_unstable();
        groups.dedup();
        let group_of =
            triangles.iter().map(|t| groups.binary_search(&group(t)).expect("a group") as u32).collect();
        let mut vertices: Vec<u32> =
            triangles.iter().flat_map(|&t| skin.triangles[t as usize].vertices).collect();
        vertices.sort_unstable();
        vertices.dedup();
        let mut free = Self {
            skin,
            triangles,
            is_fixed: fixed_vertices(skin, &is_free),
            is_free,
            vertices,
            groups,
            group_of,
            chains: Vec::new(),
            taken: HashSet::new(),
            sides: Vec::new(),
        };
        free.find_edges(&shared, projector);
        Some(free)
    }

    /// Sorts the edges of all triangles into those that stay, those on curves, and the others.
    fn find_edges(&mut self, shared: &SharedVertices, projector: &Projector) {
        let of_curve = |&(ends, class): &([u32; 2], Class)| match class {
            Class::Curve(curve) => Some((sorted_ends(ends), curve)),
            _ => None,
        };
        let mut on_curve: Vec<([u32; 2], CurveId)> = self.skin.edges.iter().filter_map(of_curve).collect();
        on_curve.sort_unstable();
        let curve_of = |edge: &[u32; 2]| {
            let found = on_curve.binary_search_by_key(edge, |(ends, _)| *ends);
            found.ok().map(|k| on_curve[k].1)
        };
        let mut is_here = vec![false; self.skin.points.len()];
        self.vertices.iter().for_each(|&v| is_here[v as usize] = true);
        let uses = self.uses();
        let mut on_curves: BTreeMap<CurveId, Vec<[u32; 2]>> = BTreeMap::new();
        for at in uses.chunk_by(|a, b| a.0 == b.0) {
            let (edge, first) = at[0];
            if first == NONE {
                if edge.iter().all(|&v| is_here[v as usize]) {
                    self.taken.insert(edge);
                }
                continue;
            }
            let curve = curve_of(&edge);
            let all_free = at.iter().all(|&(_, group)| group != NONE);
            let is_inside = at.len() == 2 && at[0].1 == at[1].1;
            if !all_free || shared.have_common(&edge) || (curve.is_none() && !is_inside) {
                let is_straight = curve.is_none_or(|curve| projector.is_straight_curve(curve));
                self.chains.push((edge.to_vec(), Piece { of: curve, is_straight, is_fixed: true }));
                edge.iter().for_each(|&v| self.is_fixed[v as usize] = true);
                continue;
            }
            self.sides.push(edge);
            if let Some(curve) = curve {
                on_curves.entry(curve).or_default().push(edge);
            }
        }
        for (curve, edges) in on_curves {
            let is_straight = projector.is_straight_curve(curve);
            let piece = Piece { of: Some(curve), is_straight, is_fixed: false };
            self.chains.extend(chains(&edges, &mut self.is_fixed).into_iter().map(|chain| (chain, piece)));
        }
    }

    /// The sides of all triangles, ascending, each with the group of its triangle, or [`NONE`] if
    /// that stays.
    fn uses(&self) -> Vec<([u32; 2], u32)> {
        let mut group_at = vec![NONE; self.skin.triangles.len()];
        self.triangles.iter().zip(&self.group_of).for_each(|(&t, &group)| group_at[t as usize] = group);
        let sides = |(triangle, group): (&SkinTriangle, u32)| {
            let [a, b, c] = triangle.vertices;
            [[a, b], [b, c], [c, a]].map(|side| (sorted_ends(side), group))
        };
        let mut uses: Vec<_> = self.skin.triangles.iter().zip(group_at).flat_map(sides).collect();
        uses.sort_unstable();
        uses
    }

    /// The model to be remeshed, and what stays of it.
    pub fn model(&self) -> (FacetModel, Constraints) {
        let skin = self.skin;
        let mut place = vec![NONE; skin.points.len()];
        (0..).zip(&self.vertices).for_each(|(new, &v)| place[v as usize] = new);
        let placed = |v: u32| place[v as usize];
        let corners: Vec<u32> = self.corners().map(placed).collect();
        let corner = |v: u32| corners.binary_search(&v).ok().map(CornerId::new);
        let curve = |(chain, _): &(Vec<u32>, Piece)| {
            let vertices: Vec<u32> = chain.iter().map(|&v| placed(v)).collect();
            let ends = corner(vertices[0]).zip(corner(vertices[vertices.len() - 1])).map(|(a, b)| [a, b]);
            FacetCurve { ends, vertices, small: Vec::new() }
        };
        let triangle = |(&t, &group): (&u32, &u32)| BoundaryTriangle {
            vertices: skin.triangles[t as usize].vertices.map(|v| VertexId(placed(v))),
            patch: PatchId(group),
        };
        let patch = |&(_, [inside, outside]): &Group| FacetPatch {
            inside,
            outside,
            labels: Vec::new(),
            inaccuracy: 0.0,
        };
        let part = SurfacePart {
            points: self.vertices.iter().map(|&v| skin.points[v as usize]).collect(),
            triangles: self.triangles.iter().zip(&self.group_of).map(triangle).collect(),
            curves: self.chains.iter().map(curve).collect(),
            patches: self.groups.iter().map(patch).collect(),
            corners,
        };
        let constraints = Constraints {
            pieces: self.chains.iter().map(|(_, piece)| *piece).collect(),
            taken: self.taken.iter().map(|&edge| sorted_ends(edge.map(placed))).collect(),
        };
        (part.into(), constraints)
    }

    /// The vertices of free triangles that must stay, ascending.
    pub fn corners(&self) -> impl Iterator<Item = u32> + '_ {
        self.vertices.iter().copied().filter(|&v| self.is_fixed[v as usize])
    }

    /// The middles and lengths of the edges that stay.
    pub fn rim(&self) -> Vec<Source> {
        let fixed = self.chains.iter().filter(|(_, piece)| piece.is_fixed);
        let source = |(chain, _): &(Vec<u32>, Piece)| {
            let [a, b] = [chain[0], chain[1]].map(|v| self.skin.points[v as usize]);
            Source { point: nalgebra::center(&a, &b), size: (b - a).norm() }
        };
        fixed.map(source).collect()
    }
}

/// Whether each vertex must stay: those that other ranks have, corners, and those of triangles and
/// edges that stay.
fn fixed_vertices(skin: &Skin, is_free: &[bool]) -> Vec<bool> {
    let is_corner = |class: &Class| matches!(class, Class::Corner(_));
    let mut is_fixed: Vec<bool> = skin.classes.iter().map(is_corner).collect();
    skin.shared.ids.iter().for_each(|&v| is_fixed[v as usize] = true);
    let kept = skin.triangles.iter().zip(is_free).filter(|(_, free)| !**free);
    kept.flat_map(|(t, _)| t.vertices).for_each(|v| is_fixed[v as usize] = true);
    skin.loose_edges().into_iter().flatten().for_each(|v| is_fixed[v as usize] = true);
    is_fixed
}

/// The ranks that have the vertices of a skin.
struct SharedVertices<'a> {
    holders: Vec<&'a [Rank]>,
}

impl<'a> SharedVertices<'a> {
    fn of(skin: &'a Skin) -> Self {
        let mut holders: Vec<&[Rank]> = vec![&[]; skin.points.len()];
        skin.shared.iter().for_each(|(v, ranks)| holders[v as usize] = ranks);
        Self { holders }
    }

    /// Whether another rank has all of these vertices.
    fn have_common(&self, vertices: &[u32]) -> bool {
        let [first, rest @ ..] = vertices else { return false };
        let all = |rank: &&Rank| rest.iter().all(|&v| self.holders[v as usize].contains(rank));
        // This rank is always one of them.
        self.holders[*first as usize].iter().filter(all).count() > 1
    }
}

/// The chains that edges of one curve form between vertices that are fixed, or become so because
/// the curve ends or branches there. A closed chain without fixed vertices ends with its first
/// vertex.
fn chains(edges: &[[u32; 2]], is_fixed: &mut [bool]) -> Vec<Vec<u32>> {
    let mut at: BTreeMap<u32, Vec<usize>> = BTreeMap::new();
    for (k, ends) in edges.iter().enumerate() {
        ends.iter().for_each(|&v| at.entry(v).or_default().push(k));
    }
    at.iter().filter(|(_, edges)| edges.len() != 2).for_each(|(&v, _)| is_fixed[v as usize] = true);
    let of_fixed = at.iter().filter(|(v, _)| is_fixed[**v as usize]);
    let mut starts: Vec<(u32, usize)> =
        of_fixed.flat_map(|(&v, edges)| edges.iter().map(move |&k| (v, k))).collect();
    starts.extend(at.iter().map(|(&v, edges)| (v, edges[0])));
    let mut is_used = vec![false; edges.len()];
    let mut chains = Vec::new();
    for (start, first) in starts {
        if is_used[first] {
            continue;
        }
        let (mut chain, mut next) = (vec![start], Some(first));
        while let Some(k) = next {
            is_used[k] = true;
            let here = edges[k][usize::from(edges[k][0] == chain[chain.len() - 1])];
            chain.push(here);
            next = at[&here].iter().copied().find(|&k| !is_used[k] && !is_fixed[here as usize]);
        }
        chains.push(chain);
    }
    chains
}
