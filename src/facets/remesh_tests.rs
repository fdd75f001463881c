//! Facets remeshed, filled with tets, and refined.

use super::samples::{Soup, read_ply, read_stl, shared};
use super::*;
use crate::Point;
use crate::kernel::predicates::{Sign, orient3d};
use crate::mesh::{Class, Mesh, Segment, TET_EDGES, VertexId};
use crate::size::{SizeField, SizeSettings};
use crate::surface::SurfaceMesh;
use crate::volume::ClosedSurface;
use crate::{improve, volume};
use csg::BodyId;
use std::collections::BTreeMap;

fn soup(make: impl FnOnce(&mut Soup)) -> Facets {
    let mut soup = Soup::default();
    make(&mut soup);
    soup.facets
}

fn model(files: &[Facets]) -> FacetModel {
    FacetModel::new(files, &Settings::default()).unwrap()
}

/// Panics where segments, triangles and classes do not fit each other or vertices are off their curves and patches.
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
    let regions = mesh.triangles.iter().map(|t| {
        let patch = model.patch(t.patch);
        [patch.inside, patch.outside]
    });
    ClosedSurface::new(
        mesh.points.clone(),
        mesh.triangles.iter().map(|t| t.vertices.map(|v| v.0)).collect(),
        regions.collect(),
    )
    .unwrap()
}

/// Sizes as for a geometry.
fn sizes(model: &FacetModel, scale: f64) -> FacetSize {
    FacetSize::new(model, &SizeSettings { scale, ..SizeSettings::default() })
}

/// Fills a surface mesh with tets and improves them; none must be illegal.
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

/// The tets that one refinement inverts when the middles of their edges move to the facets.
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
        // The octahedron by each of its diagonals: its four edges round it, right-handed.
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

/// Remeshes, checks and fills; the least angle of the surface, the smallest dihedral angle.
fn run(name: &str, model: &FacetModel, scale: f64) -> (RemeshReport, improve::Report) {
    let size = sizes(model, scale);
    let (surface, report) = remesh(model, &size, &RemeshSettings::default());
    let deviation = deviation(model, &surface);
    let (mesh, improved) = filled(model, &surface, &size);
    println!("{name} {scale}: {report:?} deviation {deviation:?}");
    println!(
        "{} tets, dihedral {} {} {}; inverted {}",
        mesh.tets.len(),
        improved.after.smallest_dihedral,
        improved.after.first_percentile,
        improved.folding_left,
        inverted(model, &mesh)
    );
    (report, improved)
}

#[test]
fn simple_solids_are_remeshed_well() {
    let solids = [
        ("box", soup(|s| s.brick([0.0; 3], [1.0, 2.0, 3.0], false))),
        ("cylinder", soup(|s| s.cylinder(1.0, 3.0, 40))),
        ("fine cylinder", soup(|s| s.cylinder(1.0, 3.0, 400))),
        ("coarse cylinder", soup(|s| s.cylinder(1.0, 3.0, 12))),
        ("sphere", soup(|s| s.sphere(Point::origin(), 1.0, 40, 20, false))),
        ("torus", soup(|s| s.torus(3.0, 1.0, 40, 20))),
        ("plate", soup(|s| s.plate_with_hole(2.0, 1.0, 0.5, 24))),
        ("thin plate", soup(|s| s.plate_with_hole(2.0, 1.0, 0.02, 24))),
        ("cone", soup(|s| s.cone(1.0, 2.0, 40))),
    ];
    for (name, solid) in solids {
        let found = model(&[solid]);
        for scale in [2.0, 1.0, 0.5] {
            let (report, improved) = run(name, &found, scale);
        }
    }
}

#[test]
fn nested_and_neighbouring_bodies_are_remeshed_together() {
    let nested = model(&[soup(|s| {
        s.brick([0.0; 3], [4.0; 3], false);
        s.sphere(Point::new(2.0, 2.0, 2.0), 1.5, 24, 12, true);
        s.sphere(Point::new(2.0, 2.0, 2.0), 1.0, 24, 12, false);
    })]);
    run("nested", &nested, 1.0);
    let side = |low: [f64; 3], high: [f64; 3]| soup(|s| s.brick(low, high, false));
    let beside = model(&[
        side([0.0; 3], [1.0; 3]),
        side([1.0, 0.0, 0.0], [2.0, 1.0, 1.0]),
        side([0.0, 1.0, 0.0], [1.0, 2.0, 1.0]),
    ]);
    run("beside", &beside, 0.5);
}

#[test]
fn the_tutorial_parts_are_remeshed_well() {
    for name in ["netgen-tutorials/hinge.stl", "netgen-tutorials/part1.stl"] {
        let Some(file) = shared(name) else { continue };
        let found = model(&[read_stl(&std::fs::read_to_string(file).unwrap())]);
        for scale in [2.0, 1.0, 0.5] {
            let (report, improved) = run(name, &found, scale);
        }
    }
    for name in ["surfaces/shaft_100k.ply", "surfaces/shaft_1M.ply", "surfaces/torus_100k.ply"] {
        let Some(file) = shared(name) else { continue };
        let began = std::time::Instant::now();
        let found = model(&[read_ply(&std::fs::read(file).unwrap())]);
        println!("{} facets {:?}", found.triangles.len(), began.elapsed());
        let (report, improved) = run(name, &found, 1.0);
        println!("{:?}", began.elapsed());
    }
}
