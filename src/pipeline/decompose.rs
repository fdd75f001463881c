//! The method `decompose` on all ranks: a geometry is cut into pieces, and each piece is meshed on
//! its rank.

use super::coarse::{CoarseSettings, Sizes, Unmeshed, mesh_surface};
use super::coarse_error::{CoarseError, smaller_at};
use super::coarse_mesh::CoarseMesh;
use super::error::{Error, RequestError};
use super::geometry::Geometry;
use super::goal::Goal;
use super::model::Model;
use super::options;
use super::periodic::periodic_map;
use super::result::CoarseResult;
use super::retries::{Budget, CORRECTIONS};
use super::room;
use super::settings::{CutSettings, GenerateSettings, Request, Wanted};
use super::skins::wanted_sizes;
use super::target::Outcome;
use super::wanted::mesh_as_wanted;
use crate::ground::comm::Communicator;
use crate::ground::comm::pack::{put, take};
use crate::ground::kernel::tree::bounds;
use crate::ground::mesh::{Mesh, Rank, VertexId, sorted_face};
use crate::ground::progress::{Progress, Stage, Work};
use crate::ground::size::{PeriodicSize, SizeField, Source, SourceTree};
use crate::mesher::model::CsgModel;
use crate::mesher::surface::{self, SurfaceMesh};
use crate::parallel::decompose::{self, CutModel, CutPlane, CutStatistics, Cuts};
use crate::parallel::distribution::BareMesh;
use crate::parallel::partition;
use crate::parallel::refine::EdgeDisplacements;
use crate::parallel::skin::{self, DeliveredSizes, Filled, Improvement, PartSizes, Skin};
use crate::{Point, Vector};
use csg::{Aabb, BodyId};
use rayon::prelude::*;
use std::collections::BTreeSet;

/// The skins of all pieces.
struct Skins {
    /// For each rank, its skin and the sizes inside.
    messages: Vec<Vec<u8>>,
    boundary: u64,
}

/// The pieces before they are refined, on all ranks.
pub(super) struct Pieces {
    pub part: BareMesh,
    /// Subdivisions of each coarse edge.
    pub pieces: u32,
    pub delivered: Option<DeliveredSizes>,
    /// On rank 0 only.
    pub coarse: Option<CoarseResult>,
}

/// **Collective.** Cuts the geometry and meshes the surfaces of the pieces on rank 0, then each
/// piece on its rank, repeatedly if a number of tets is requested.
///
/// # Errors
/// The same on all ranks: a geometry that cannot be cut into this many pieces, pieces that cannot
/// be meshed.
pub(super) fn mesh_pieces(
    comm: &dyn Communicator,
    model: Option<&Model>,
    cuts: &CutSettings,
    settings: &GenerateSettings,
    how: Improvement,
    progress: &Progress,
) -> Result<Pieces, Error> {
    let request = settings.before_refinement();
    let plan = decompose::PlanSettings { together: settings.periodic_together, ..cuts.plan };
    let cuts = CutSettings { plan, ..cuts.clone() };
    let planned =
        model.map(|model| plan_cuts(comm.size(), model, &cuts, &settings.coarse, request, progress));
    let planned = comm.agree(planned.transpose())?;
    let mut numbers = planned.as_ref().map_or(vec![0.0, 0.0], |planned| {
        let expected = skin::expected_tets(&planned.coarse.mesh, &planned.sizes).iter().sum();
        vec![f64::from(planned.pieces), expected]
    });
    comm.broadcast(0, &mut numbers)?;
    let [pieces, expected] = numbers[..] else { panic!("rank 0 sent two numbers") };
    let mut goal = Goal::new(request.wanted, expected);
    loop {
        let skins = planned.as_ref().map(|planned| planned.skins(comm.size(), goal.scale, progress));
        let skins = comm.agree(skins.transpose())?;
        let mut boundary = vec![skins.as_ref().map_or(0, |skins| skins.boundary)];
        comm.broadcast(0, &mut boundary)?;
        let messages = skins.map(|skins| skins.messages);
        let message = progress.stage(Stage::Distribute, |_| comm.scatter_bytes(0, messages))?;
        let (skin, sizes) = unpack(&message);
        // The stage ends on all ranks together.
        let filled = progress.stage(Stage::Fill, |_| comm.agree(fill(comm.rank(), &skin, &sizes, how)))?;
        if goal.is_reached(comm, filled.tets.len())? {
            let delivered = skin::delivered(comm, &skin, &filled, &sizes)?;
            let part = progress.stage(Stage::Number, |_| skin::number(comm, skin, filled, boundary[0]))?;
            let result = |(planned, model): (Planned, &Model)| planned.result(comm.size(), model);
            let coarse = planned.zip(model).map(result).transpose();
            return Ok(Pieces { part, pieces: pieces as u32, delivered, coarse: comm.agree(coarse)? });
        }
    }
}

/// Fills the skin of a part.
fn fill(part: Rank, skin: &Skin, sizes: &PartSizes, how: Improvement) -> Result<Filled, Error> {
    skin::fill(skin, sizes, how).map_err(|error| Error::Fill { part, error: Box::new(error) })
}

/// A cut geometry, with the coarse mesh from which the planes were chosen.
pub struct Planned {
    cuts: Cuts,
    model: CutModel,
    coarse: CoarseMesh,
    /// Subdivisions of each coarse edge.
    pieces: u32,
    /// The sizes of the fine mesh at the vertices of the coarse one.
    sizes: Vec<f64>,
    outcome: Option<Outcome>,
    /// Number of periodic coarse triangles in another part than their copies.
    separated: usize,
}

/// Cuts a geometry into `parts` pieces.
///
/// # Errors
/// Input without geometry, no coarse mesh, unsuitable planes, pieces that cannot be
/// meshed.
pub fn planned(
    parts: u32,
    geometry: &Geometry,
    cuts: &CutSettings,
    settings: &CoarseSettings,
    wanted: Wanted,
    progress: &Progress,
) -> Result<Planned, Error> {
    options::refuse_planes(&cuts.planes)?;
    options::refuse_impossible_coarse(settings, wanted)?;
    let request = Request { wanted, refined: 1 };
    plan_cuts(parts, &geometry.model, cuts, settings, request, progress)
}

fn plan_cuts(
    parts: u32,
    model: &Model,
    cuts: &CutSettings,
    settings: &CoarseSettings,
    request: Request,
    progress: &Progress,
) -> Result<Planned, Error> {
    let Model::Csg(whole) = model else {
        return Err(RequestError::NotCuttable.into());
    };
    options::refuse_unresolved(model, &settings.size)?;
    room::refuse_too_fine(model, &settings.size, None)?;
    let (pieces, coarse, outcome) = progress.stage(Stage::Mesh, |work| {
        let budget = Budget::new(None, matches!(request.wanted, Wanted::Sizes { .. }));
        mesh_as_wanted(parts, model, settings, request, &[], &budget, work)
    })?;
    progress.stage(Stage::Cut, |_| {
        let sizes = wanted_sizes(model, &coarse.mesh, &settings.size, pieces);
        let expected = skin::expected_tets(&coarse.mesh, &sizes);
        let statistics = CutStatistics::of(&coarse.mesh, whole, &expected, pieces, parts)?;
        let mut settings = cuts.clone();
        let mut refused: Option<Error> = None;
        for seed in 0..MOST_PLANS {
            settings.plan = decompose::PlanSettings { seed, through_corners: seed == 0, ..settings.plan };
            let cuts = match plan(&statistics, parts, &settings) {
                Ok(cuts) => cuts,
                Err(error) => return Err(refused.unwrap_or(error.into())),
            };
            let separated = statistics.separated(&cuts);
            if settings.plan.together && separated > 0 {
                let tets = coarse.mesh.tets.len();
                return Err(RequestError::SplitPeriodic { lost: separated, tets }.into());
            }
            match CutModel::new(whole, &cuts, candidates(&coarse.mesh, &cuts)) {
                Ok(model) => return Ok(Planned { cuts, model, coarse, pieces, sizes, outcome, separated }),
                // Other planes may work.
                Err(error) if settings.planes.is_empty() => refused = Some(error.into()),
                Err(error) => return Err(error.into()),
            }
        }
        Err(refused.expect("there is a plan"))
    })
}

impl Planned {
    /// The planes.
    pub fn planes(&self) -> &[CutPlane] {
        &self.cuts.planes
    }

    /// The number of bodies of the cut geometry.
    pub fn bodies(&self) -> usize {
        self.model.pieces.len()
    }

    /// The pieces as the text of a geometry; `source` is the text of the whole.
    ///
    /// # Errors
    /// If tags of the whole name bodies: only pieces of these are left.
    pub fn geo_text(&self, geometry: &Geometry, source: &str) -> Result<String, RequestError> {
        let Model::Csg(whole) = &geometry.model else { return Err(RequestError::NotCuttable) };
        if !whole.geometry.boundary_overrides.is_empty() || !whole.geometry.singularities.is_empty() {
            return Err(RequestError::TaggedBodies);
        }
        Ok(decompose::geo_text(source, &whole.geometry, &self.cuts, &self.model.pieces))
    }
}

impl Planned {
    /// Meshes the skins of the pieces by the sizes times a scale.
    fn skins(&self, parts: u32, scale: f64, progress: &Progress) -> Result<Skins, Error> {
        let mesh = &self.coarse.mesh;
        let vertex_sizes: Vec<f64> = self.sizes.iter().map(|size| scale * size).collect();
        let sizes = PartSizes::new(mesh.points.clone(), mesh.tets.clone(), vertex_sizes.clone());
        let surface = progress.stage(Stage::Surface, |_| fine_surface(&self.model.model, &sizes))?;
        let skins = decompose::skins(&self.model, &surface, parts as usize).map_err(RequestError::from)?;
        let message = |skin: &Skin| {
            let mut message = decompose::pack(skin);
            pack_sizes(&mut message, skin, mesh, &vertex_sizes);
            message
        };
        let boundary = surface.triangles.iter().filter(|t| self.model.is_old(t.patch)).count() as u64;
        Ok(Skins { messages: skins.iter().map(message).collect(), boundary })
    }

    /// The statistics of the coarse mesh and of the parts that the cuts make of it.
    fn result(self, parts: u32, model: &Model) -> Result<CoarseResult, Error> {
        let Self { cuts, coarse: CoarseMesh { mesh, report, .. }, outcome, separated, .. } = self;
        let assigned: Vec<Rank> =
            mesh.tets.iter().map(|tet| cuts.leaf_of(&centre(&mesh, tet)) as Rank).collect();
        let periodic = periodic_map(model, &mesh)?;
        let mut partition = partition::assess(&mesh, &assigned, parts)?;
        partition.lost_ties = separated;
        let displacements = EdgeDisplacements::default();
        Ok(CoarseResult { displacements, report, outcome, partition, periodic })
    }
}

/// Maximum number of plans. A plan fails if a plane contains an edge or touches a face, so that its
/// pieces cannot be determined.
const MOST_PLANS: u64 = 4;

fn centre(mesh: &Mesh, tet: &[VertexId; 4]) -> Point {
    Point::from(tet.iter().map(|v| mesh.points[v.index()].coords).sum::<Vector>() / 4.0)
}

/// The user's planes, or planes chosen from the coarse mesh.
fn plan(statistics: &CutStatistics, parts: u32, settings: &CutSettings) -> Result<Cuts, RequestError> {
    if settings.planes.is_empty() {
        return decompose::plan(statistics, parts, &settings.plan).map_err(RequestError::from);
    }
    let cuts = Cuts::by_planes(&settings.planes, statistics);
    if cuts.leaves.len() != parts as usize {
        return Err(RequestError::Planes { pieces: cuts.leaves.len(), parts });
    }
    Ok(cuts)
}

/// How far a body may extend beyond the coarse tets at its boundary, in units of their edge length.
const BULGE: f64 = 0.5;

/// The parts that each body may extend into.
fn candidates(mesh: &Mesh, cuts: &Cuts) -> Vec<(usize, BodyId)> {
    let mut found = BTreeSet::new();
    for (tet, &body) in mesh.tets.iter().zip(&mesh.bodies) {
        let corners = tet.map(|v| mesh.points[v.index()]);
        let room = BULGE * corners.iter().map(|c| (c - corners[0]).norm()).fold(0.0, f64::max);
        found.extend(cuts.leaves_near(&corners, room).map(|leaf| (leaf, body)));
    }
    found.into_iter().collect()
}

/// A size field lowered by sources.
struct Lowered<'a> {
    base: &'a dyn SizeField,
    sources: SourceTree,
}

impl SizeField for Lowered<'_> {
    fn work(&self) -> &Work<'_> {
        self.base.work()
    }

    fn size_at(&self, point: &Point) -> f64 {
        self.base.size_at(point).min(self.sources.size_at(point))
    }
}

/// Growth of the sizes away from the places where they were lowered.
const GRADING: f64 = 0.3;

/// Meshes the surfaces of all pieces. Where that fails for lack of room, the sizes are lowered and
/// the surface is meshed again.
fn fine_surface(model: &CsgModel, base: &dyn SizeField) -> Result<SurfaceMesh, CoarseError> {
    let bounds = model.features.bounds;
    let mut sources: Vec<Source> = Vec::new();
    let mut corrections = 0;
    loop {
        let sources_of = SourceTree::new(bounds, GRADING, bounds.diagonal(), &sources);
        let lowered = Lowered { base, sources: sources_of };
        // Without periodic faces the same as the lowered sizes.
        let size = PeriodicSize::new(&lowered, &model.features, GRADING);
        match mesh_surface(model, Sizes { size: &size, initial: base }, corrections < CORRECTIONS) {
            Ok((surface, _)) => {
                // The ranks could not fill this surface, and would find out too late.
                let mut unfit = surface::crossings(&surface.points, &surface.triangles, |_, _| false);
                unfit.extend(coincident(&surface));
                if unfit.is_empty() || corrections == CORRECTIONS {
                    return Ok(surface);
                }
                sources.extend(unfit.into_iter().map(|point| smaller_at(point, &size)));
            }
            Err(Unmeshed::Lower(lower, _)) => sources.extend(lower),
            Err(Unmeshed::Failed(error)) => return Err(error),
        }
        corrections += 1;
    }
}

/// Finds the centres of triangles with the same corners: they occur where a piece is a lens or a
/// slice so thin that no vertex lies inside its two sides.
fn coincident(surface: &SurfaceMesh) -> Vec<Point> {
    let mut all: Vec<[VertexId; 3]> = surface.triangles.iter().map(|t| sorted_face(t.vertices)).collect();
    all.par_sort_unstable();
    let same = all.windows(2).filter(|two| two[0] == two[1]).map(|two| two[0]);
    let centre = |v: [VertexId; 3]| v.iter().map(|v| surface.points[v.index()].coords).sum::<Vector>() / 3.0;
    same.map(|corners| centre(corners).into()).collect()
}

/// Appends the coarse tets near a skin, and the sizes at their vertices.
fn pack_sizes(message: &mut Vec<u8>, skin: &Skin, mesh: &Mesh, sizes: &[f64]) {
    let skin_bounds = bounds(&skin.points);
    let near = |tet: &&[VertexId; 4]| meet(&skin_bounds, &bounds(&tet.map(|v| mesh.points[v.index()])));
    let tets: Vec<&[VertexId; 4]> = mesh.tets.iter().filter(near).collect();
    let mut used: Vec<VertexId> = tets.iter().flat_map(|tet| **tet).collect();
    used.sort_unstable();
    used.dedup();
    let place = |v: &VertexId| used.binary_search(v).expect("a used vertex") as u32;
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

/// Unpacks a rank's skin and the sizes inside.
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
    use crate::ground::comm::thread;
    use crate::ground::error::{ErrorKind, HasKind};
    use crate::ground::mesh::{BoundaryTriangle, Class};
    use crate::mesher::improve::{self, Effort, Measure};
    use crate::parallel::skin::SkinTriangle;
    use csg::PatchId;

    /// The message of a part with one tet.
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
            // Without one triangle.
            let triangles = if comm.rank() == 1 { &closed[..3] } else { &closed };
            let (skin, sizes) = unpack(&message(triangles));
            let settings = improve::Settings::of(Effort::Quick, Measure::MeanRatio);
            let how = Improvement { settings: &settings, smoothness: None };
            let filled = comm.agree(fill(comm.rank(), &skin, &sizes, how));
            filled.map(|_| ()).unwrap_err()
        });
        let failures = failures.unwrap();
        assert!(failures.iter().all(|failure| failure.kind() == ErrorKind::NoMesh));
        assert!(matches!(failures[1], Error::Fill { part: 1, .. }));
        assert_eq!(failures[0].to_string(), format!("rank 1: {}", failures[1]));
    }
}
