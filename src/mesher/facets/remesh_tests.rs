//! Tests of remeshing, filling and refining facets.

use super::samples::{Soup, read_ply, read_stl, shared};
use super::*;
use crate::Point;
use crate::ground::kernel::predicates::{Sign, orient3d};
use crate::ground::mesh::{BoundaryTriangle, Class, Mesh, Segment, TET_EDGES, VertexId};
use crate::ground::progress::Work;
use crate::ground::size::{SizeField, SizeSettings, UniformSize};
use crate::mesher::surface::SurfaceMesh;
use crate::mesher::volume::ClosedSurface;
use crate::mesher::{improve, volume};
use crate::pipeline::CoarseSettings;
use crate::pipeline::model::Model;
use crate::pipeline::retries::Budget;
use csg::BodyId;
use std::collections::{BTreeMap, BTreeSet, HashSet};
use std::convert::Infallible;

fn soup(make: impl FnOnce(&mut Soup)) -> Facets {
    let mut soup = Soup::default();
    make(&mut soup);
    soup.facets
}

fn model(files: &[Facets]) -> FacetModel {
    FacetModel::new(files, &Settings::default()).unwrap()
}

/// The facets remeshed with their vertices on them.
pub(super) fn remeshed(model: &FacetModel, size: &dyn SizeField) -> (SurfaceMesh, RemeshReport) {
    constrained(model, size, &Constraints::default())
}

fn constrained(
    model: &FacetModel,
    size: &dyn SizeField,
    constraints: &Constraints,
) -> (SurfaceMesh, RemeshReport) {
    let stay = |_: &mut SurfaceMesh| Ok::<(), Infallible>(());
    remesh(model, size, (&RemeshSettings::default(), constraints), &stay, &|_| false)
        .unwrap_or_else(|never| match never {})
}

/// Curves that are to stay keep their segments, whatever the size.
#[test]
fn fixed_curves_are_not_cut() {
    let model = model(&[soup(|soup| soup.brick([0.0; 3], [1.0; 3], false))]);
    let curves = || (0..model.curves.len()).map(csg::CurveId::new);
    let piece = |c: csg::CurveId| Piece { of: Some(c), is_straight: true, is_fixed: c.index() < 3 };
    let constraints = Constraints { pieces: curves().map(piece).collect(), ..Constraints::default() };
    let (mesh, _) = constrained(&model, &UniformSize(0.2), &constraints);
    let segments = |c: csg::CurveId| mesh.segments.iter().filter(|s| s.curve == c).count();
    let counts: Vec<usize> = curves().map(segments).collect();
    assert!(counts[..3].iter().all(|&count| count == 1), "{counts:?}");
    assert!(counts[3..].iter().all(|&count| count > 3), "{counts:?}");
}

/// The shorter diagonal of a parallelogram is taken, unless another element has it.
#[test]
fn taken_edges_are_not_made() {
    let mut facets = soup(|soup| soup.brick([0.0; 3], [1.0; 3], false));
    facets.points.iter_mut().for_each(|p| p.x += 0.5 * p.y);
    let model = model(&[facets]);
    let edges = |mesh: &SurfaceMesh| -> BTreeSet<[u32; 2]> {
        let place =
            |v: VertexId| model.points.iter().position(|p| *p == mesh.points[v.index()]).unwrap() as u32;
        let sides = |t: &BoundaryTriangle| {
            let [a, b, c] = t.vertices.map(place);
            [[a, b], [b, c], [c, a]].map(|[a, b]| [a.min(b), a.max(b)])
        };
        mesh.triangles.iter().flat_map(sides).collect()
    };
    let before = edges(&keep(&model));
    let (flipped, _) = constrained(&model, &UniformSize(10.0), &Constraints::default());
    let taken: HashSet<[u32; 2]> = edges(&flipped).difference(&before).copied().collect();
    assert_eq!(taken.len(), 2, "at the top and at the bottom");
    let constraints = Constraints { taken, ..Constraints::default() };
    let (mesh, _) = constrained(&model, &UniformSize(10.0), &constraints);
    assert_eq!(edges(&mesh), before);
}

/// A box 1024 times as long as wide took 40 times as many splits as triangles were left.
#[test]
fn a_long_thin_box_takes_splits_in_proportion_to_its_length() {
    for length in [128.0, 1024.0] {
        let model = model(&[soup(|soup| soup.brick([0.0; 3], [length, 1.0, 1.0], false))]);
        let size = FacetSize::new(&model, &SizeSettings { maxh: Some(0.5), ..SizeSettings::default() });
        let (mesh, report) = remeshed(&model, &size);
        check(&model, &mesh);
        assert!(report.splits < 6 * mesh.triangles.len(), "{length}: {} splits", report.splits);
    }
}

/// Points on the inside are in a body, also of a brick with a hollow, others are not.
#[test]
fn points_are_in_bodies_or_not() {
    let hollow = model(&[soup(|soup| {
        soup.brick([0.0; 3], [3.0; 3], false);
        soup.brick([1.0; 3], [2.0; 3], true);
    })]);
    let bodies = FacetBodies::new(&hollow);
    let contained = |p: [f64; 3]| bodies.contain(&Point::from(p));
    assert!(contained([0.5, 0.61, 0.72]) && contained([2.5, 1.3, 1.4]) && contained([0.5, 1.3, 1.4]));
    assert!(!contained([1.5, 1.3, 1.4]) && !contained([-0.5, 1.3, 1.4]) && !contained([3.5, 0.6, 0.7]));
}

/// Asserts that segments, triangles and classes are consistent and that vertices lie on their
/// curves and patches.
fn check(model: &FacetModel, mesh: &SurfaceMesh) {
    let mut edges: BTreeMap<[u32; 2], Vec<u32>> = BTreeMap::new();
    for t in &mesh.triangles {
        let v = t.vertices.map(|v| v.0);
        for [a, b] in [[v[0], v[1]], [v[1], v[2]], [v[2], v[0]]] {
            edges.entry([a.min(b), a.max(b)]).or_default().push(t.patch.0);
        }
    }
    let mut by_curve: Vec<Vec<&Segment>> = vec![Vec::new(); model.curves.len()];
    for segment in &mesh.segments {
        let [a, b] = segment.vertices.map(|v| v.0);
        let patches = edges.remove(&[a.min(b), a.max(b)]);
        assert!(patches.is_some(), "segment {a}-{b} is no edge, or twice");
        by_curve[segment.curve.index()].push(segment);
    }
    for ([a, b], patches) in edges {
        assert!(patches.len() == 2 && patches[0] == patches[1], "edge {a}-{b} has {patches:?}");
    }
    for (curve, segments) in model.curves.iter().zip(by_curve) {
        assert!(segments.windows(2).all(|w| w[0].vertices[1] == w[1].vertices[0]));
        let ends = [segments[0].vertices[0], segments[segments.len() - 1].vertices[1]];
        match curve.ends {
            None => assert_eq!(ends[0], ends[1]),
            Some(corners) => {
                assert_eq!(ends.map(|v| mesh.classes[v.index()]), corners.map(Class::Corner));
            }
        }
    }
    let tolerance = 4.0 * model.projector.tolerance();
    for (p, class) in mesh.points.iter().zip(&mesh.classes) {
        let distance = match *class {
            Class::Corner(corner) => (model.points[model.corners[corner.index()] as usize] - p).norm(),
            Class::Curve(curve) => model.projector.curve_distance(curve, p),
            Class::Patch(patch) => model.projector.patch_distance(patch, p),
            Class::Body(_) => f64::INFINITY,
        };
        assert!(distance <= tolerance, "{class:?} at {p} is {distance} off");
    }
}

/// Checks the classification of a surface mesh, and that it bounds bodies.
pub(super) fn closed(model: &FacetModel, mesh: &SurfaceMesh) -> ClosedSurface {
    check(model, mesh);
    try_closed(model, mesh).unwrap()
}

fn try_closed(model: &FacetModel, mesh: &SurfaceMesh) -> Result<ClosedSurface, volume::SurfaceFaults> {
    let regions = mesh.triangles.iter().map(|t| {
        let patch = model.patch(t.patch);
        [patch.inside, patch.outside]
    });
    ClosedSurface::new(
        mesh.points.clone(),
        mesh.triangles.iter().map(|t| t.vertices.map(|v| v.0)).collect(),
        regions.collect(),
    )
}

/// The size field used for a geometry.
pub(super) fn sizes(model: &FacetModel, scale: f64) -> FacetSize {
    FacetSize::new(model, &SizeSettings { scale, ..SizeSettings::default() })
}

/// Fills a surface mesh with tets and improves them; checks that none is illegal.
fn filled(model: &FacetModel, surface: &SurfaceMesh, size: &dyn SizeField) -> (Mesh, improve::Report) {
    let closed = closed(model, surface);
    let (filled, _) = volume::mesh(&closed, size, &volume::Settings::default()).unwrap();
    let mut classes = surface.classes.clone();
    classes.resize(filled.points.len(), Class::Body(BodyId(0)));
    let mut mesh = Mesh {
        points: filled.points,
        classes,
        tets: filled.tets.into_iter().map(|t| t.map(VertexId)).collect(),
        bodies: filled.bodies,
        triangles: surface.triangles.clone(),
        segments: surface.segments.clone(),
    };
    let smoothness = FacetSmoothness(&model.projector);
    let report = improve::make_refinable(&mut mesh, size, &smoothness, &improve::Settings::default());
    assert_eq!(report.illegal_left, 0);
    (mesh, report)
}

/// The number of tets inverted by one refinement with edge midpoints projected to the facets.
fn inverted(model: &FacetModel, mesh: &Mesh) -> usize {
    let mut places: BTreeMap<[u32; 2], Class> = BTreeMap::new();
    let key = |a: VertexId, b: VertexId| [a.0.min(b.0), a.0.max(b.0)];
    for t in &mesh.triangles {
        let [a, b, c] = t.vertices;
        places.extend([key(a, b), key(b, c), key(c, a)].map(|k| (k, Class::Patch(t.patch))));
    }
    for s in &mesh.segments {
        places.insert(key(s.vertices[0], s.vertices[1]), Class::Curve(s.curve));
    }
    let middle = |a: VertexId, b: VertexId| {
        let mean = nalgebra::center(&mesh.points[a.index()], &mesh.points[b.index()]);
        match places.get(&key(a, b)) {
            Some(Class::Curve(curve)) => model.projector.project_curve(*curve, &mean),
            Some(Class::Patch(patch)) => model.projector.project_patch(*patch, &mean),
            _ => mean,
        }
    };
    let positive = |p: [&Point; 4]| orient3d(p[0], p[1], p[2], p[3]) == Sign::Positive;
    let is_inverted = |tet: &&[VertexId; 4]| {
        let [a, b, c, d] = tet.map(|v| mesh.points[v.index()]);
        let [ab, ac, ad, bc, bd, cd] = TET_EDGES.map(|[i, j]| middle(tet[i], tet[j]));
        let corners = [[&a, &ab, &ac, &ad], [&ab, &b, &bc, &bd], [&ac, &bc, &c, &cd], [&ad, &bd, &cd, &d]];
        // The inner octahedron for each of its diagonals, with the four edges around it,
        // right-handed.
        let octahedra = [
            [[&ab, &cd], [&ac, &ad], [&ad, &bd], [&bd, &bc], [&bc, &ac]],
            [[&ac, &bd], [&ab, &bc], [&bc, &cd], [&cd, &ad], [&ad, &ab]],
            [[&ad, &bc], [&ab, &ac], [&ac, &cd], [&cd, &bd], [&bd, &ab]],
        ];
        let fits = |o: &[[&Point; 2]; 5]| {
            let [from, to] = o[0];
            let signs = o[1..].iter().map(|[p, q]| orient3d(from, to, p, q));
            let signs: Vec<Sign> = signs.collect();
            signs.iter().all(|s| *s == Sign::Positive) || signs.iter().all(|s| *s == Sign::Negative)
        };
        !corners.into_iter().all(positive) || !octahedra.iter().any(fits)
    };
    mesh.tets.iter().filter(is_inverted).count()
}

/// The results of remeshing and filling.
struct Outcome {
    surface: RemeshReport,
    tets: improve::Report,
    /// The larger deviation between mesh and facets, in units of the longest edge.
    deviation: f64,
}

/// Remeshes and fills a model; checks what must hold for any solid.
fn run(model: &FacetModel, scale: f64) -> Outcome {
    let size = sizes(model, scale);
    let (mesh, surface) = remeshed(model, &size);
    assert_eq!((surface.flattening_left, surface.misfits), (0, 0));
    assert!(surface.crossings.is_empty());
    let edges = mesh.triangles.iter().flat_map(|t| {
        let p = t.vertices.map(|v| mesh.points[v.index()]);
        [(p[1] - p[0]).norm(), (p[2] - p[1]).norm(), (p[0] - p[2]).norm()]
    });
    let [out, back] = deviation(model, &mesh);
    let deviation = out.max(back) / edges.fold(0.0, f64::max);
    let (mesh, tets) = filled(model, &mesh, &size);
    assert_eq!(inverted(model, &mesh), 0, "refinement inverts tets");
    Outcome { surface, tets, deviation }
}

/// Asserts that no surface angle is below `angle` and no dihedral angle below `dihedral` (degrees).
fn assert_good(outcome: &Outcome, angle: f64, dihedral: f64) {
    let Outcome { surface, tets, deviation } = outcome;
    assert!(surface.min_angle > angle, "{surface:?}");
    assert!(surface.mean_quality > 0.75, "{surface:?}");
    assert!(tets.after.smallest_dihedral > dihedral, "{:?}", tets.after);
    assert!(*deviation < 0.25, "{deviation}");
}

#[test]
fn simple_solids_are_remeshed_well() {
    let solids = [
        soup(|s| s.brick([0.0; 3], [1.0, 2.0, 3.0], false)),
        soup(|s| s.cylinder(1.0, 3.0, 12)),
        soup(|s| s.cylinder(1.0, 3.0, 40)),
        soup(|s| s.cylinder(1.0, 3.0, 400)),
        soup(|s| s.sphere(Point::origin(), 1.0, 40, 20, false)),
        soup(|s| s.torus(3.0, 1.0, 40, 20)),
        soup(|s| s.plate_with_hole(2.0, 1.0, 0.5, 24)),
        soup(|s| s.cone(1.0, 2.0, 40)),
    ];
    for solid in solids {
        let found = model(&[solid]);
        for scale in [2.0, 1.4, 1.0, 0.7, 0.5] {
            assert_good(&run(&found, scale), 20.0, 11.0);
        }
    }
}

#[test]
fn triangles_between_close_curves_are_as_short_as_the_gap() {
    let found = model(&[soup(|s| s.plate_with_hole(2.0, 1.0, 0.05, 24))]);
    let (mesh, report) = remeshed(&found, &sizes(&found, 1.0));
    closed(&found, &mesh);
    assert!(report.min_angle > 20.0, "{report:?}");
}

#[test]
fn a_cap_on_a_sharp_edge_and_one_inside_are_gone() {
    // A box whose top has a vertex amid its front edge, closed by a cap of no height.
    let flat_caps = soup(|s| {
        let at = |x: f64, y: f64, z: f64| Point::new(x, y, z);
        for axis in 0..3 {
            for upper in [false, true] {
                if axis != 2 || !upper {
                    s.side([0.0; 3], [1.0; 3], axis, upper, false);
                }
            }
        }
        let (m, n) = (at(0.5, 0.0, 1.0), at(0.25, 0.5, 1.0));
        let [a, b, c, d] = [at(0., 0., 1.), at(1., 0., 1.), at(1., 1., 1.), at(0., 1., 1.)];
        s.add([a, b, m]);
        s.add([m, b, c]);
        // n is on the line from m to d.
        s.add([m, c, d]);
        s.add([m, d, n]);
        s.add([a, m, n]);
        s.add([a, n, d]);
    });
    let found = model(&[flat_caps]);
    assert_eq!([found.corners.len(), found.curves.len(), found.patches.len()], [8, 12, 6]);
    assert_good(&run(&found, 0.3), 25.0, 15.0);
}

#[test]
fn size_place_and_single_precision_do_not_matter() {
    let plate = Soup { facets: soup(|s| s.plate_with_hole(2.0, 1.0, 0.5, 24)), group: 0 };
    for scale in [1e-3, 1e6] {
        let turn = nalgebra::Rotation3::from_euler_angles(0.4, -1.1, 2.0);
        let moved = plate.clone().map(|p| {
            let q = turn * p * scale + crate::Vector::new(3.0, -2.0, 1.0) * scale;
            q.map(|x| f64::from(x as f32))
        });
        assert_good(&run(&model(&[moved.facets]), 1.0), 20.0, 15.0);
    }
}

#[test]
fn nested_and_neighbouring_bodies_are_remeshed_together() {
    let nested = model(&[soup(|s| {
        s.brick([0.0; 3], [4.0; 3], false);
        s.sphere(Point::new(2.0, 2.0, 2.0), 1.5, 24, 12, true);
        s.sphere(Point::new(2.0, 2.0, 2.0), 1.0, 24, 12, false);
    })]);
    assert_eq!(nested.bodies.len(), 2);
    assert_good(&run(&nested, 1.0), 20.0, 15.0);
    let brick = |low: [f64; 3], high: [f64; 3]| soup(|s| s.brick(low, high, false));
    let beside = model(&[
        brick([0.0; 3], [1.0; 3]),
        brick([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]),
        brick([0.0, 1.0, 0.0], [1.0, 2.0, 1.0]),
    ]);
    assert_eq!(beside.bodies.len(), 3);
    assert_good(&run(&beside, 0.5), 20.0, 15.0);
}

#[test]
fn the_tutorial_parts_are_remeshed_well() {
    for name in ["netgen-tutorials/hinge.stl", "netgen-tutorials/part1.stl"] {
        let Some(file) = shared(name) else { continue };
        let found = model(&[read_stl(&std::fs::read_to_string(file).unwrap())]);
        // At scale 2 the sizes are coarse compared with the smallest features.
        for (scale, dihedral) in [(2.0, 12.0), (1.0, 15.0), (0.5, 15.0)] {
            assert_good(&run(&found, scale), 20.0, dihedral);
        }
    }
}

#[test]
fn fine_surfaces_become_coarse_ones() {
    for name in ["surfaces/shaft_1M.ply", "surfaces/cube_100k.ply"] {
        let Some(file) = shared(name) else { continue };
        let found = model(&[read_ply(&std::fs::read(file).unwrap())]);
        let outcome = run(&found, 1.0);
        assert!(outcome.surface.triangles < found.triangles.len() / 7);
        assert_good(&outcome, 20.0, 15.0);
    }
}

#[test]
fn kept_facets_are_filled_as_they_are() {
    let found = model(&[soup(|s| s.torus(3.0, 1.0, 40, 20))]);
    let surface = keep(&found);
    let (mesh, _) = filled(&found, &surface, &sizes(&found, 1.0));
    assert_eq!(mesh.triangles, surface.triangles);
    assert_eq!(mesh.points[..surface.points.len()], surface.points[..]);
}

/// Two sheets a hundredth of their facets apart, and curves of the same facets: finer tets inside
/// than the facets are would only be slivers.
#[test]
fn kept_facets_get_no_finer_sizes_than_their_edges() {
    let slab = model(&[soup(|s| s.plate_with_hole(1.0, 0.98, 0.01, 32))]);
    let user = SizeSettings { maxh: Some(0.5), ..SizeSettings::default() };
    let size = FacetSize::of_kept(&slab, &user);
    let ([high, low], inside) = ([0.01, 0.0].map(|z| Point::new(0.98, 0.0, z)), Point::new(0.99, 0.0, 0.005));
    assert_eq!([high, low, inside].map(|p| size.size_at(&p)), [0.5; 3]);
    assert!(FacetSize::new(&slab, &user).size_at(&inside) < 0.05);
    let surface = keep(&slab);
    let (_, report) = volume::mesh(&closed(&slab, &surface), &size, &volume::Settings::default()).unwrap();
    assert!(report.points_inside < surface.triangles.len(), "{report:?}");
}

#[test]
fn facets_that_intersect_are_found_and_refused_by_the_mesher() {
    let crossed = model(&[soup(|s| {
        s.brick([0.0; 3], [2.0; 3], false);
        s.brick([1.0, 0.5, 0.5], [3.0, 1.5, 1.5], false);
    })]);
    assert!(!crossed.intersections().is_empty());
    let size = sizes(&crossed, 1.0);
    let (surface, report) = remeshed(&crossed, &size);
    assert!(!report.crossings.is_empty());
    let faults = try_closed(&crossed, &surface).unwrap_err();
    assert!(faults.crossings().count() > 0, "{faults}");
}

#[test]
fn the_same_facets_give_the_same_mesh() {
    let plate = soup(|s| s.plate_with_hole(2.0, 1.0, 0.5, 24));
    // Many more facets than triangles, and many more triangles than facets.
    let fine = soup(|s| s.torus(3.0, 1.0, 200, 100));
    let coarse = soup(|s| s.torus(3.0, 1.0, 20, 10));
    for (facets, edge) in [(plate, 0.5), (fine, 0.5), (coarse, 0.1)] {
        let found = model(&[facets]);
        let size = sizes(&found, edge);
        let mesh = |threads: usize| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| remeshed(&found, &size).0)
        };
        let (one, three) = (mesh(1), mesh(3));
        assert_eq!(one.points, three.points);
        assert_eq!(one.triangles, three.triangles);
    }
}

#[test]
fn surfaces_of_meshed_geometries_are_remeshed_well() {
    for name in ["boundarycondition", "cone", "cubeandspheres", "sculpture", "trafo"] {
        let Some(file) = shared(&format!("netgen-tutorials/{name}.geo")) else { continue };
        let text = std::fs::read_to_string(file).unwrap();
        let geometry = csg::language::parse_geometry(&text, name).unwrap().geometry;
        let solid = Model::from_csg(geometry).unwrap();
        let skin = solid
            .coarse_mesh(&mut CoarseSettings::default(), &Budget::default(), Work::unwatched())
            .unwrap()
            .mesh;
        let found = model(&[Facets {
            points: skin.points,
            triangles: skin.triangles.iter().map(|t| t.vertices.map(|v| v.0)).collect(),
            ..Facets::default()
        }]);
        assert_good(&run(&found, 1.0), 20.0, 12.0);
    }
}

#[test]
fn curved_walls_near_each_other_are_kept_apart_by_smaller_sizes() {
    let shell = model(&[soup(|s| {
        s.sphere(Point::origin(), 1.0, 80, 40, false);
        s.sphere(Point::origin(), 0.96, 80, 40, true);
    })]);
    let (mesh, report) = remeshed(&shell, &sizes(&shell, 1.5));
    assert!(report.corrections > 0 && report.crossings.is_empty(), "{report:?}");
    closed(&shell, &mesh);
}
