//! Remeshing of the faces of a skin on patches by the size field.
//!
//! A refined skin is as fine as the coarse mesh, and its triangles are as narrow: across a strip of
//! a coarse triangle's width there are as many pieces as along its long sides. Only interfaces need
//! the triangles of the lattice, because both ranks must have the same ones. So each rank remeshes
//! the rest of its skin ([`mesher::facets`](crate::mesher::facets)), without messages: all vertices
//! and edges that another rank may have stay, and so do corners and periodic faces. The result is
//! projected to the geometry.

use super::extract::sorted_ends;
use super::{FillError, Skin, SkinTriangle};
use crate::Point;
use crate::ground::comm::{CommError, Communicator};
use crate::ground::mesh::{BoundaryTriangle, Class, GlobalId, Rank, VertexId};
use crate::ground::projector::Projector;
use crate::ground::size::{SizeField, Source, SourceTree};
use crate::mesher::facets::{
    Constraints, FacetCurve, FacetModel, FacetPatch, Piece, RemeshSettings, SurfacePart, remesh,
};
use crate::mesher::surface::SurfaceMesh;
use crate::parallel::distribution::Shared;
use csg::{CornerId, CurveId, PatchId, ProjectionFailed};
use std::collections::{BTreeMap, HashSet};

/// Growth of the size away from edges that stay and are shorter than the size there.
const GRADING: f64 = 0.4;

/// Rounds of remeshing. The skin is close to what is wanted.
const ROUNDS: usize = 3;

/// No vertex, no patch.
const NONE: u32 = u32::MAX;

/// Why a skin cannot be remeshed.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RemeshError {
    /// A vertex has no place on the geometry.
    #[error(transparent)]
    Projection(#[from] ProjectionFailed),
    /// The remeshed triangles intersect.
    #[error("{count} pairs of remeshed triangles intersect, one near ({}, {}, {})", at.x, at.y, at.z)]
    Crossing {
        /// The number of intersections.
        count: usize,
        /// The place of one.
        at: Point,
    },
    /// The remeshed skin cannot be filled.
    #[error(transparent)]
    Fill(#[from] FillError),
}

/// *Local.* The skin with its triangles on patches remeshed by the size field, except on the
/// patches to `stay`; `None` if nothing may change.
///
/// # Errors
/// [`RemeshError`] if the result is not valid.
pub fn remeshed(
    skin: &Skin,
    projector: &Projector,
    size: &dyn SizeField,
    stay: &HashSet<PatchId>,
) -> Result<Option<Skin>, RemeshError> {
    // The faces of a mesh without geometry are its geometry.
    if *projector == Projector::Flat {
        return Ok(None);
    }
    let free = Free::of(skin, projector, stay);
    if free.triangles.is_empty() {
        return Ok(None);
    }
    let (model, constraints) = free.model();
    let rim = SourceTree::new(model.bounds, GRADING, f64::INFINITY, &free.rim_sources());
    let size = AtRim { base: size, rim };
    let settings = RemeshSettings { rounds: ROUNDS, ..RemeshSettings::default() };
    let snap = |surface: &mut SurfaceMesh| free.snap(surface, projector);
    let (surface, report) = remesh(&model, &size, (&settings, &constraints), &snap, &|_| false)?;
    match report.crossings.first() {
        Some(&at) => Err(RemeshError::Crossing { count: report.crossings.len(), at }),
        None => Ok(Some(free.replaced(&surface))),
    }
}

/// **Collective.** The number of triangles on patches of the whole mesh, if each rank has the
/// second skin in place of the first, which is that of a lattice with `of_lattice` triangles.
/// Triangles that two ranks have are in both skins.
///
/// # Errors
/// [`CommError`] if another rank fails.
pub fn boundary(comm: &dyn Communicator, skins: [&Skin; 2], of_lattice: u64) -> Result<u64, CommError> {
    let on_patches = |skin: &Skin| skin.triangles.iter().filter(|t| t.patch.is_some()).count() as u64;
    let [before, after] = comm.all_reduce_sum_u64(skins.map(on_patches))?;
    Ok(of_lattice + after - before)
}

/// The wanted size, limited by the edges that stay.
struct AtRim<'a> {
    base: &'a dyn SizeField,
    rim: SourceTree,
}

impl SizeField for AtRim<'_> {
    fn size_at(&self, point: &Point) -> f64 {
        self.base.size_at(point).min(self.rim.size_at(point))
    }
}

/// What triangles on one side of a patch have in common.
type Group = ((PatchId, bool), [Option<csg::BodyId>; 2]);

/// The part of a skin that may change.
struct Free<'a> {
    skin: &'a Skin,
    /// The triangles, by index in the skin.
    triangles: Vec<u32>,
    /// Whether each triangle of the skin may change.
    is_free: Vec<bool>,
    /// The vertices of these triangles, ascending.
    vertices: Vec<u32>,
    /// Whether each vertex of the skin must stay.
    is_fixed: Vec<bool>,
    /// The groups, ascending, and that of each of `triangles`.
    groups: Vec<Group>,
    group_of: Vec<u32>,
    /// The chains of edges, by vertices of the skin, and what they are.
    chains: Vec<(Vec<u32>, Piece)>,
    /// Edges between `vertices` that only other triangles have.
    taken: HashSet<[u32; 2]>,
    /// The sides of free triangles that may change, ascending.
    sides: Vec<[u32; 2]>,
}

impl<'a> Free<'a> {
    fn of(skin: &'a Skin, projector: &Projector, stay: &HashSet<PatchId>) -> Self {
        let shared = SharedVertices::of(skin);
        let may_change = |t: &SkinTriangle| {
            let group = t.patch.filter(|(patch, _)| !stay.contains(patch));
            group.is_some() && !shared.have_common(&t.vertices)
        };
        let is_free: Vec<bool> = skin.triangles.iter().map(may_change).collect();
        let triangles: Vec<u32> = (0..skin.triangles.len() as u32).filter(|&t| is_free[t as usize]).collect();
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
        free
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

    /// The model to be remeshed.
    fn model(&self) -> (FacetModel, Constraints) {
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
        (FacetModel::from(part), constraints)
    }

    /// The vertices of free triangles that must stay, ascending.
    fn corners(&self) -> impl Iterator<Item = u32> + '_ {
        self.vertices.iter().copied().filter(|&v| self.is_fixed[v as usize])
    }

    /// The edges that stay, as sizes at their middles.
    fn rim_sources(&self) -> Vec<Source> {
        let fixed = self.chains.iter().filter(|(_, piece)| piece.is_fixed);
        let source = |(chain, _): &(Vec<u32>, Piece)| {
            let [a, b] = [chain[0], chain[1]].map(|v| self.skin.points[v as usize]);
            Source { point: nalgebra::center(&a, &b), size: (b - a).norm() }
        };
        fixed.map(source).collect()
    }

    /// Moves vertices onto the geometry.
    fn snap(&self, surface: &mut SurfaceMesh, projector: &Projector) -> Result<(), ProjectionFailed> {
        for (point, class) in surface.points.iter_mut().zip(&surface.classes) {
            *point = match self.class(*class) {
                Class::Curve(curve) => projector.project_curve(curve, point)?,
                Class::Patch(patch) => projector.project_patch(patch, point)?,
                Class::Corner(_) | Class::Body(_) => *point,
            };
        }
        Ok(())
    }

    /// The class in the geometry of a class in the model; corners are as they were.
    fn class(&self, class: Class) -> Class {
        match class {
            Class::Curve(piece) => Class::Curve(self.chains[piece.index()].1.of.expect("a free curve")),
            Class::Patch(group) => Class::Patch(self.groups[group.index()].0.0),
            other => other,
        }
    }

    /// The skin with other free triangles.
    fn replaced(&self, surface: &SurfaceMesh) -> Skin {
        let old = self.skin;
        let mut stays = vec![true; old.points.len()];
        self.vertices.iter().for_each(|&v| stays[v as usize] = self.is_fixed[v as usize]);
        let (on, inside) =
            (0..old.points.len() as u32).partition::<Vec<u32>, _>(|&v| (v as usize) < old.on_triangles);
        let on: Vec<u32> = on.into_iter().filter(|&v| stays[v as usize]).collect();
        let corners: Vec<u32> = self.corners().collect();
        let added = corners.len()..surface.points.len();
        let mut place = vec![NONE; old.points.len()];
        (0..).zip(&on).for_each(|(new, &v)| place[v as usize] = new);
        let on_triangles = on.len() + added.len();
        (on_triangles as u32..).zip(&inside).for_each(|(new, &v)| place[v as usize] = new);

        let mut skin = Skin { on_triangles, ..Skin::default() };
        let mut push = |name: GlobalId, point: Point, class: Class| {
            skin.names.push(name);
            skin.points.push(point);
            skin.classes.push(class);
        };
        let known = |v: &u32| (old.names[*v as usize], old.points[*v as usize], old.classes[*v as usize]);
        on.iter().map(known).for_each(|(name, point, class)| push(name, point, class));
        // Only shared vertices need their names.
        added.for_each(|v| push(GlobalId::MAX, surface.points[v], self.class(surface.classes[v])));
        inside.iter().map(known).for_each(|(name, point, class)| push(name, point, class));
        skin.shared = Shared::default();
        for (v, holders) in old.shared.iter() {
            skin.shared.push(place[v as usize], holders.iter().copied());
        }
        let number = |v: VertexId| match corners.get(v.index()) {
            Some(&corner) => place[corner as usize],
            None => (on.len() + v.index() - corners.len()) as u32,
        };
        let kept = old.triangles.iter().zip(&self.is_free).filter(|(_, free)| !**free);
        skin.triangles = kept
            .map(|(t, _)| SkinTriangle { vertices: t.vertices.map(|v| place[v as usize]), ..*t })
            .chain(surface.triangles.iter().map(|t| {
                let (patch, beside) = self.groups[t.patch.index()];
                SkinTriangle { vertices: t.vertices.map(number), beside, patch: Some(patch) }
            }))
            .collect();
        let is_kept = |(ends, _): &&([u32; 2], Class)| {
            self.sides.binary_search(&sorted_ends(*ends)).is_err()
                && ends.iter().all(|&v| place[v as usize] != NONE)
        };
        skin.edges = old
            .edges
            .iter()
            .filter(is_kept)
            .map(|&(ends, class)| (ends.map(|v| place[v as usize]), class))
            .collect();
        for segment in &surface.segments {
            let piece = &self.chains[segment.curve.index()].1;
            if let Some(curve) = piece.of.filter(|_| !piece.is_fixed) {
                skin.edges.push((segment.vertices.map(number), Class::Curve(curve)));
            }
        }
        skin
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
