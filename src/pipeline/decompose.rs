//! Method 1 on all ranks: a geometry cut into pieces, each meshed on its rank.

use super::coarse::{
    CoarseError, CoarseMesh, CoarseSettings, MOST_CORRECTIONS, Unmeshed, mesh_surface, smaller_at,
};
use super::generate::{CoarseResult, GenerateSettings};
use super::model::{CsgModel, Model};
use super::skins::refuse_periodic;
use super::target::Outcome;
use super::wanted::{Wanted, mesh_as_wanted};
use crate::comm::Communicator;
use crate::comm::pack::{put, take};
use crate::decompose::{self, CutModel, CutPlane, Cuts, Evidence};
use crate::dist::BareMesh;
use crate::error::{Failure, Status, agree};
use crate::improve::{self, Effort};
use crate::kernel::tree::bounds;
use crate::mesh::{Mesh, Rank, VertexId, sorted_face};
use crate::partition;
use crate::periodic::PeriodicMap;
use crate::progress::Progress;
use crate::refine::Bends;
use crate::size::{SizeField, Source, SourceTree};
use crate::skin::{self, Filled, PartSizes, Skin};
use crate::surface::{self, SurfaceMesh};
use crate::{Point, Vector};
use csg::{Aabb, BodyId};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// How a geometry is cut.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct CutSettings {
    /// How planes are chosen, where the user gives none.
    pub plan: decompose::Settings,
    /// The user's planes: each cuts all pieces that it meets.
    pub planes: Vec<CutPlane>,
}

/// What rank 0 makes of a geometry.
struct Cut {
    pieces: u32,
    coarse: CoarseResult,
    /// For each rank, its skin and the sizes in it.
    messages: Vec<Vec<u8>>,
    boundary: u64,
}

/// **Collective.** Cuts the geometry, meshes the surface of the pieces on rank 0, and the pieces each on its rank.
///
/// # Errors
/// The same on all ranks: a geometry that cannot be cut so, pieces that cannot be meshed.
pub(super) fn mesh_pieces(
    comm: &dyn Communicator,
    model: Option<&Model>,
    cuts: &CutSettings,
    settings: &GenerateSettings,
    progress: &Progress,
) -> Result<(BareMesh, u32, Option<CoarseResult>), Failure> {
    let cut = agree(comm, model.map(|model| cut(comm.size(), model, cuts, settings, progress)).transpose())?;
    let mut numbers = cut.as_ref().map_or(vec![0, 0], |cut| vec![u64::from(cut.pieces), cut.boundary]);
    comm.broadcast(0, &mut numbers)?;
    let [pieces, boundary] = numbers[..] else { panic!("rank 0 sent two numbers") };
    let (coarse, messages) = cut.map(|cut| (cut.coarse, cut.messages)).unzip();
    let message = progress.stage("distribute", || comm.scatter_bytes(0, messages))?;
    let effort = settings.coarse.effort.unwrap_or(Effort::Standard);
    let filled = progress.stage("fill", || fill(comm.rank(), &message, effort));
    let (skin, filled) = agree(comm, filled)?;
    let bare = progress.stage("number", || skin::number(comm, skin, filled, boundary))?;
    Ok((bare, pieces as u32, coarse))
}

/// Fills the skin of a part that came in a message.
fn fill(part: Rank, message: &[u8], effort: Effort) -> Result<(Skin, Filled), Failure> {
    let (skin, sizes) = unpack(message);
    let filled = skin::fill(&skin, &sizes, &improve::Settings::of(effort));
    let refused = |error| no_mesh(format!("part {part} (from 0) cannot be meshed: {error}"));
    filled.map(|filled| (skin, filled)).map_err(refused)
}

/// A geometry that is cut, and the coarse mesh that the planes were chosen by.
pub struct Planned {
    /// The planes.
    pub cuts: Cuts,
    /// The pieces.
    pub model: CutModel,
    coarse: CoarseMesh,
    /// Pieces of each coarse edge.
    pieces: u32,
    outcome: Option<Outcome>,
}

/// Cuts a geometry into so many parts.
///
/// # Errors
/// What is no geometry, what has periodic faces, no coarse mesh, planes that do not fit, pieces that cannot be meshed.
pub fn planned(
    parts: u32,
    model: &Model,
    cuts: &CutSettings,
    settings: &CoarseSettings,
    wanted: Wanted,
    progress: &Progress,
) -> Result<Planned, Failure> {
    refuse_periodic(Some(model))?;
    let Model::Csg(whole) = model else {
        return Err(Failure::input(
            "only geometries (.geo) can be cut; for triangles and meshes take the methods `refine` or `surface`",
        ));
    };
    let (pieces, coarse, outcome) =
        progress.stage("mesh", || mesh_as_wanted(parts, model, settings, wanted, &[]))?;
    progress.stage("cut", || {
        let evidence = Evidence::of(&coarse.mesh, whole, pieces, parts)?;
        let mut settings = cuts.clone();
        for seed in 0..MOST_PLANS {
            settings.plan = decompose::Settings { seed, through_corners: seed == 0, ..settings.plan };
            let cuts = plan(&evidence, parts, &settings)?;
            match CutModel::new(whole, &cuts, candidates(&coarse.mesh, &cuts)) {
                Ok(model) => return Ok(Planned { cuts, model, coarse, pieces, outcome }),
                // Other planes may do.
                Err(_) if settings.planes.is_empty() && seed + 1 < MOST_PLANS => {}
                Err(error) => return Err(no_mesh(error)),
            }
        }
        unreachable!("the last plan returns")
    })
}

/// Plans that are tried where the pieces of one cannot be told: a plane through an edge, or that touches a face.
const MOST_PLANS: u64 = 4;

fn no_mesh(error: impl std::fmt::Display) -> Failure {
    Failure::new(Status::NoValidMesh, error.to_string())
}

/// The skins of the pieces, for all ranks.
fn cut(
    parts: u32,
    model: &Model,
    cuts: &CutSettings,
    settings: &GenerateSettings,
    progress: &Progress,
) -> Result<Cut, Failure> {
    let planned = planned(parts, model, cuts, &settings.coarse, settings.wanted, progress)?;
    let Planned { cuts, model: pieces_of, coarse: CoarseMesh { mesh, report, .. }, pieces, outcome } =
        planned;
    let field = model.size_field(&settings.coarse.size);
    let vertex_sizes = skin::at_vertices(&mesh, field.as_deref(), pieces);
    let sizes = PartSizes::new(mesh.points.clone(), mesh.tets.clone(), vertex_sizes.clone());
    let surface = progress.stage("surface", || fine_surface(&pieces_of.model, &sizes)).map_err(no_mesh)?;
    let skins = decompose::skins(&pieces_of, &surface, parts as usize).map_err(no_mesh)?;
    let message = |skin: &Skin| {
        let mut message = decompose::pack(skin);
        pack_sizes(&mut message, skin, &mesh, &vertex_sizes);
        message
    };
    let messages = skins.iter().map(message).collect();
    let boundary = surface.triangles.iter().filter(|t| pieces_of.is_old(t.patch)).count() as u64;
    let assigned: Vec<Rank> = mesh.tets.iter().map(|tet| cuts.leaf_of(&centre(&mesh, tet)) as Rank).collect();
    let partition = partition::assess(&mesh, &assigned, parts).map_err(no_mesh)?;
    let (bends, periodic) = (Bends::default(), PeriodicMap::default());
    let coarse = CoarseResult { mesh, bends, parts: assigned, report, outcome, partition, periodic };
    Ok(Cut { pieces, coarse, messages, boundary })
}

fn centre(mesh: &Mesh, tet: &[VertexId; 4]) -> Point {
    Point::from(tet.iter().map(|v| mesh.points[v.index()].coords).sum::<Vector>() / 4.0)
}

/// The planes: the user's, or those that suit the coarse mesh.
fn plan(evidence: &Evidence, parts: u32, settings: &CutSettings) -> Result<Cuts, Failure> {
    if settings.planes.is_empty() {
        return decompose::plan(evidence, parts, &settings.plan).map_err(Failure::input);
    }
    let cuts = Cuts::by_planes(&settings.planes, evidence);
    if cuts.leaves.len() != parts as usize {
        return Err(Failure::input(format!(
            "the planes cut the geometry into {} pieces, for {parts} parts; each plane cuts every piece that it meets",
            cuts.leaves.len()
        )));
    }
    Ok(cuts)
}

/// How far a body may reach out of the coarse tets at its boundary, in units of their edges.
const BULGE: f64 = 0.5;

/// The parts that each body may reach into.
fn candidates(mesh: &Mesh, cuts: &Cuts) -> Vec<(usize, BodyId)> {
    let mut found = BTreeSet::new();
    for (tet, &body) in mesh.tets.iter().zip(&mesh.bodies) {
        let corners = tet.map(|v| mesh.points[v.index()]);
        let room = BULGE * corners.iter().map(|c| (c - corners[0]).norm()).fold(0.0, f64::max);
        found.extend(cuts.leaves_near(&corners, room).map(|leaf| (leaf, body)));
    }
    found.into_iter().collect()
}

/// Sizes, lowered by sources.
struct Lowered<'a> {
    base: &'a dyn SizeField,
    sources: SourceTree,
}

impl SizeField for Lowered<'_> {
    fn size_at(&self, point: &Point) -> f64 {
        self.base.size_at(point).min(self.sources.size_at(point))
    }
}

/// How fast sizes grow away from where they had to be lowered.
const GRADING: f64 = 0.3;

/// The surface mesh of all pieces. Where it fails for want of room, the sizes are lowered there and it is tried again.
fn fine_surface(model: &CsgModel, base: &dyn SizeField) -> Result<SurfaceMesh, CoarseError> {
    let bounds = model.features.bounds;
    let mut sources: Vec<Source> = Vec::new();
    let mut corrections = 0;
    loop {
        let size = Lowered { base, sources: SourceTree::new(bounds, GRADING, bounds.diagonal(), &sources) };
        match mesh_surface(model, &size, corrections < MOST_CORRECTIONS) {
            Ok((surface, _)) => {
                // The ranks could not fill it, and would say so too late.
                let mut unfit = surface::crossings(&surface.points, &surface.triangles);
                unfit.extend(coincident(&surface));
                if unfit.is_empty() || corrections == MOST_CORRECTIONS {
                    return Ok(surface);
                }
                sources.extend(unfit.into_iter().map(|point| smaller_at(point, &size)));
            }
            Err(Unmeshed::Lower(lower)) => sources.extend(lower),
            Err(Unmeshed::Failed(error)) => return Err(error),
        }
        corrections += 1;
    }
}

/// The centres of triangles with the same corners: where a piece is a lens or a slice so thin that no vertex lies inside both of its sides.
fn coincident(surface: &SurfaceMesh) -> Vec<Point> {
    let mut all: Vec<[VertexId; 3]> = surface.triangles.iter().map(|t| sorted_face(t.vertices)).collect();
    all.par_sort_unstable();
    let same = all.windows(2).filter(|two| two[0] == two[1]).map(|two| two[0]);
    let centre = |v: [VertexId; 3]| v.iter().map(|v| surface.points[v.index()].coords).sum::<Vector>() / 3.0;
    same.map(|corners| centre(corners).into()).collect()
}

/// Adds the coarse tets near a skin, and the sizes at their vertices.
fn pack_sizes(message: &mut Vec<u8>, skin: &Skin, mesh: &Mesh, sizes: &[f64]) {
    let skin_bounds = bounds(&skin.points);
    let near = |tet: &&[VertexId; 4]| meet(&skin_bounds, &bounds(&tet.map(|v| mesh.points[v.index()])));
    let tets: Vec<&[VertexId; 4]> = mesh.tets.iter().filter(near).collect();
    let mut used: Vec<VertexId> = tets.iter().flat_map(|tet| **tet).collect();
    used.sort_unstable();
    used.dedup();
    let place = |v: &VertexId| used.binary_search(v).expect("it is used") as u32;
    let point = |v: &VertexId| {
        let p = mesh.points[v.index()];
        [p.x, p.y, p.z, sizes[v.index()]]
    };
    let corners: Vec<[u32; 4]> = tets.iter().map(|tet| tet.each_ref().map(place)).collect();
    put(message, &used.iter().map(point).collect::<Vec<_>>());
    put(message, &corners);
}

fn meet(a: &Aabb, b: &Aabb) -> bool {
    (0..3).all(|k| a.min[k] <= b.max[k] && b.min[k] <= a.max[k])
}

/// A rank's skin, and the sizes in it.
fn unpack(message: &[u8]) -> (Skin, PartSizes) {
    let message = &mut &*message;
    let skin = decompose::unpack(message);
    let vertices = take::<[f64; 4]>(message);
    let tets = take::<[u32; 4]>(message).into_iter().map(|tet| tet.map(VertexId)).collect();
    let points = vertices.iter().map(|&[x, y, z, _]| Point::new(x, y, z)).collect();
    (skin, PartSizes::new(points, tets, vertices.iter().map(|v| v[3]).collect()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::comm::thread;
    use crate::mesh::{BoundaryTriangle, Class};
    use crate::skin::SkinTriangle;
    use csg::PatchId;

    /// The message of a part that is one tet.
    fn message(triangles: &[[u32; 3]]) -> Vec<u8> {
        let points = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]];
        let triangle = |&vertices: &[u32; 3]| SkinTriangle {
            vertices,
            beside: [Some(BodyId(0)), None],
            patch: Some((PatchId(0), true)),
        };
        let skin = Skin {
            names: vec![0, 1, 2, 3],
            on_triangles: 4,
            points: points.map(Point::from).to_vec(),
            classes: vec![Class::Patch(PatchId(0)); 4],
            triangles: triangles.iter().map(triangle).collect(),
            ..Skin::default()
        };
        let mesh = Mesh {
            points: skin.points.clone(),
            tets: vec![[0, 1, 2, 3].map(VertexId)],
            bodies: vec![BodyId(0)],
            ..Mesh::default()
        };
        let mut message = decompose::pack(&skin);
        pack_sizes(&mut message, &skin, &mesh, &[1.0; 4]);
        message
    }

    #[test]
    fn both_sides_of_a_lens_without_vertices_inside_are_found() {
        let triangle = |vertices: [u32; 3], patch: u32| BoundaryTriangle {
            vertices: vertices.map(VertexId),
            patch: PatchId(patch),
        };
        let surface = SurfaceMesh {
            points: [[0.0; 3], [3.0, 0.0, 0.0], [0.0, 3.0, 0.0], [0.0, 0.0, 3.0]].map(Point::from).to_vec(),
            triangles: vec![triangle([0, 1, 2], 0), triangle([1, 2, 3], 0), triangle([0, 2, 1], 1)],
            ..SurfaceMesh::default()
        };
        assert_eq!(coincident(&surface), [Point::new(1.0, 1.0, 0.0)]);
    }

    #[test]
    fn a_piece_that_one_rank_cannot_fill_ends_all_ranks_with_one_message() {
        let closed = [[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]];
        let failures = thread::run(3, |comm| {
            // One triangle is missing.
            let triangles = if comm.rank() == 1 { &closed[..3] } else { &closed };
            let filled = agree(comm, fill(comm.rank(), &message(triangles), Effort::Quick));
            filled.map(|_| ()).unwrap_err()
        });
        let failures = failures.unwrap();
        assert!(
            failures
                .iter()
                .all(|f| f.status == Status::NoValidMesh && f.to_string() == failures[0].to_string())
        );
        assert!(failures[0].to_string().contains("part 1 (from 0)"), "{}", failures[0]);
    }
}
