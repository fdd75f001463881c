//! Small coarse meshes with their geometry.

use crate::Point;
use crate::ground::mesh::stream::{BoundaryBlock, MeshStream, TetBlock};
use crate::ground::mesh::{BoundaryTriangle, Class, Mesh, Segment, TET_EDGES, TET_FACES, VertexId};
use crate::ground::projector::Projector;
use crate::parallel::distribution::{DistMesh, from_serial};
use crate::parallel::refine::RefinedMesh;
use csg::primitive::{Cylinder, Plane, Sphere};
use csg::{Aabb, BodyId, CornerId, Curve, CurveId, Features, Geometry, Patch, PatchId, Surface, SurfaceId};
use csg::{Point as P, Vector};

/// A mesh and the geometry it is projected to.
pub struct Fixture {
    pub mesh: Mesh,
    pub projector: Projector,
}

/// One patch for each surface, and curves where two of them intersect.
fn projector(surfaces: Vec<Surface>, curves: &[[u32; 2]], bounds: [P; 2]) -> Projector {
    let patch = |surface: usize| Patch {
        surface: SurfaceId::new(surface),
        flipped: false,
        inside: Some(BodyId(0)),
        outside: None,
        cutout: None,
        boundary: Vec::new(),
        corners: Vec::new(),
        seeds: Vec::new(),
        bc: surface as u32 + 1,
        name: None,
    };
    let curve = |surfaces: &[u32; 2]| Curve {
        surfaces: surfaces.map(SurfaceId),
        ends: None,
        trace: Vec::new(),
        fins: Vec::new(),
    };
    let features = Features {
        corners: Vec::new(),
        curves: curves.iter().map(curve).collect(),
        patches: (0..surfaces.len()).map(patch).collect(),
        bounds: Aabb { min: bounds[0], max: bounds[1] },
        identified: Vec::new(),
    };
    csg::Projector::new(&Geometry { surfaces, ..Geometry::default() }, &features).into()
}

/// A classified mesh from points, tets, and the patches of each vertex; curves are pairs of
/// patches.
fn classified(
    points: Vec<Point>,
    tets: Vec<[usize; 4]>,
    bodies: Vec<BodyId>,
    on: &[Vec<u32>],
    curves: &[[u32; 2]],
) -> Mesh {
    let curve = |patches: &[u32]| CurveId::new(curves.iter().position(|c| c == patches).expect("a curve"));
    let common = |vertices: &[usize]| -> Vec<u32> {
        let first = &on[vertices[0]];
        first.iter().copied().filter(|p| vertices.iter().all(|v| on[*v].contains(p))).collect()
    };
    let classes = on.iter().enumerate().map(|(v, patches)| match patches[..] {
        [] => Class::Body(BodyId(0)),
        [patch] => Class::Patch(PatchId(patch)),
        [_, _] => Class::Curve(curve(patches)),
        _ => Class::Corner(CornerId(v as u32)),
    });
    let mut mesh = Mesh { points, classes: classes.collect(), bodies, ..Mesh::default() };
    let (mut triangles, mut segments) = (Vec::new(), Vec::new());
    for (tet, &body) in tets.iter().zip(&mesh.bodies) {
        for face in TET_FACES {
            let vertices = face.map(|k| tet[k]);
            if let [patch] = common(&vertices)[..] {
                let mut key = vertices;
                key.sort_unstable();
                triangles.push((key, body, patch, vertices));
            }
        }
        for edge in TET_EDGES {
            let mut vertices = edge.map(|k| tet[k]);
            vertices.sort_unstable();
            if let patches @ [_, _] = &common(&vertices)[..] {
                segments.push((vertices, curve(patches)));
            }
        }
    }
    // Of a triangle between two bodies the one oriented outward from the lower body stays.
    triangles.sort_unstable();
    triangles.dedup_by_key(|t| t.0);
    segments.sort_unstable();
    segments.dedup();
    mesh.tets = tets.iter().map(|tet| tet.map(VertexId::new)).collect();
    mesh.triangles = triangles
        .iter()
        .map(|t| BoundaryTriangle { vertices: t.3.map(VertexId::new), patch: PatchId(t.2) })
        .collect();
    mesh.segments =
        segments.iter().map(|s| Segment { vertices: s.0.map(VertexId::new), curve: s.1 }).collect();
    mesh
}

/// The unit cube as k³ cubes of six tets; with `core` (k a multiple of 4) the middle half is a
/// separate body.
pub fn cube(k: usize, core: bool) -> Fixture {
    let sides = |low: f64, high: f64| (0..3).flat_map(move |axis| [(axis, low, -1.0), (axis, high, 1.0)]);
    let mut planes: Vec<(usize, f64, f64)> = sides(0.0, 1.0).collect();
    if core {
        planes.extend(sides(0.25, 0.75));
    }
    let in_core = |p: &Point| p.iter().all(|x| (0.25..=0.75).contains(x));
    let curves: Vec<[u32; 2]> = (0..planes.len() as u32)
        .flat_map(|i| (i + 1..planes.len() as u32).map(move |j| [i, j]))
        .filter(|[i, j]| planes[*i as usize].0 != planes[*j as usize].0 && i / 6 == j / 6)
        .collect();
    let at = |x: usize, y: usize, z: usize| x + (k + 1) * (y + (k + 1) * z);
    let mut points = Vec::new();
    for z in 0..=k {
        for y in 0..=k {
            points.extend((0..=k).map(|x| Point::new(x as f64, y as f64, z as f64) / k as f64));
        }
    }
    let is_on = |p: &Point, plane: usize| {
        let (axis, at, _) = planes[plane];
        p[axis] == at && (plane < 6 || in_core(p))
    };
    let planes_of =
        |p: &Point| (0..planes.len()).filter(|&plane| is_on(p, plane)).map(|plane| plane as u32).collect();
    let on: Vec<Vec<u32>> = points.iter().map(planes_of).collect();
    let (mut tets, mut bodies) = (Vec::new(), Vec::new());
    for z in 0..k {
        for y in 0..k {
            for x in 0..k {
                // The six tets around the diagonal of a cube, one for each permutation of the axes.
                for order in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
                    let mut here = [x, y, z];
                    let mut tet = [at(x, y, z); 4];
                    for (corner, axis) in order.into_iter().enumerate() {
                        here[axis] += 1;
                        tet[corner + 1] = at(here[0], here[1], here[2]);
                    }
                    if matches!(order, [0, 2, 1] | [1, 0, 2] | [2, 1, 0]) {
                        tet.swap(2, 3);
                    }
                    tets.push(tet);
                    let middle = points[at(x, y, z)] + Vector::repeat(0.5 / k as f64);
                    bodies.push(BodyId(u32::from(core && in_core(&middle))));
                }
            }
        }
    }
    let surface = |&(axis, at, sign): &(usize, f64, f64)| {
        let (mut point, mut normal) = (P::origin(), Vector::zeros());
        (point[axis], normal[axis]) = (at, sign);
        Surface::Plane(Plane { point, normal })
    };
    let surfaces = planes.iter().map(surface).collect();
    Fixture {
        mesh: classified(points, tets, bodies, &on, &curves),
        projector: projector(surfaces, &curves, [P::origin(), P::new(1.0, 1.0, 1.0)]),
    }
}

/// A ball around the origin: the faces of an icosahedron, joined to its centre.
pub fn ball(radius: f64) -> Fixture {
    let golden = f64::midpoint(1.0, 5.0_f64.sqrt());
    let scale = radius / golden.hypot(1.0);
    let mut points = vec![Point::origin()];
    for axis in 0..3 {
        for (one, two) in [(1.0, golden), (1.0, -golden), (-1.0, golden), (-1.0, -golden)] {
            let mut point = Point::origin();
            (point[axis], point[(axis + 1) % 3]) = (one * scale, two * scale);
            points.push(point);
        }
    }
    let near = |a: usize, b: usize| (points[a] - points[b]).norm() < 2.1 * scale;
    let mut tets = Vec::new();
    for a in 1..points.len() {
        for b in (a + 1..points.len()).filter(|&b| near(a, b)) {
            for c in (b + 1..points.len()).filter(|&c| near(a, c) && near(b, c)) {
                let outward = points[a].coords.cross(&points[b].coords).dot(&points[c].coords) > 0.0;
                tets.push(if outward { [0, a, b, c] } else { [0, a, c, b] });
            }
        }
    }
    let on: Vec<Vec<u32>> = (0..points.len()).map(|v| if v == 0 { vec![] } else { vec![0] }).collect();
    let bodies = vec![BodyId(0); tets.len()];
    let corner = P::new(radius, radius, radius);
    Fixture {
        mesh: classified(points, tets, bodies, &on, &[]),
        projector: projector(
            vec![Surface::Sphere(Sphere { center: P::origin(), radius })],
            &[],
            [-corner, corner],
        ),
    }
}

/// A cylinder of radius 1 around the z axis with `layers` layers: eight prisms per layer, three
/// tets each.
pub fn cylinder(layers: usize) -> Fixture {
    const RING: usize = 8;
    let top = layers as f64;
    let (mut points, mut on) = (Vec::new(), Vec::new());
    for layer in 0..=layers {
        let height = layer as f64;
        let ends: Vec<u32> = [(0, 1), (layers, 2)].iter().filter(|e| e.0 == layer).map(|e| e.1).collect();
        points.push(Point::new(0.0, 0.0, height));
        on.push(ends.clone());
        for k in 0..RING {
            let (sin, cos) = (std::f64::consts::TAU * k as f64 / RING as f64).sin_cos();
            points.push(Point::new(cos, sin, height));
            on.push([vec![0], ends.clone()].concat());
        }
    }
    let mut tets = Vec::new();
    for layer in 0..layers {
        for k in 0..RING {
            let (a, b) = (1 + k, 1 + (k + 1) % RING);
            let columns = [0, a.min(b), a.max(b)];
            let at = |corner: usize, up: usize| columns[corner] + (layer + up) * (RING + 1);
            for mut tet in [
                [at(0, 0), at(1, 0), at(2, 0), at(2, 1)],
                [at(0, 0), at(1, 0), at(1, 1), at(2, 1)],
                [at(0, 0), at(0, 1), at(1, 1), at(2, 1)],
            ] {
                let [p, q, r, s] = tet.map(|v| points[v]);
                if (q - p).cross(&(r - p)).dot(&(s - p)) < 0.0 {
                    tet.swap(2, 3);
                }
                tets.push(tet);
            }
        }
    }
    let (up, origin) = (Vector::z(), P::origin());
    let surfaces = vec![
        Surface::Cylinder(Cylinder { point: origin, axis: up, radius: 1.0 }),
        Surface::Plane(Plane { point: origin, normal: -up }),
        Surface::Plane(Plane { point: P::new(0.0, 0.0, top), normal: up }),
    ];
    let curves = [[0, 1], [0, 2]];
    let bodies = vec![BodyId(0); tets.len()];
    Fixture {
        mesh: classified(points, tets, bodies, &on, &curves),
        projector: projector(surfaces, &curves, [P::new(-1.0, -1.0, 0.0), P::new(1.0, 1.0, top)]),
    }
}

/// Converts a refined whole mesh to a coarse one.
pub fn as_mesh(refined: &RefinedMesh) -> Mesh {
    let coarse = refined.coarse();
    let n = refined.pieces();
    let mut mesh =
        Mesh { points: refined.points().iter().map(|p| Point::from(*p)).collect(), ..Mesh::default() };
    let classes = coarse.vertex_classes.iter().map(|c| (c, 1));
    let classes = classes.chain(coarse.edge_classes.iter().map(|c| (c, n - 1)));
    let classes = classes.chain(coarse.face_classes.iter().map(|c| (c, (n - 1) * (n - 2) / 2)));
    mesh.classes = classes.flat_map(|(class, count)| std::iter::repeat_n(*class, count as usize)).collect();
    mesh.classes.resize(mesh.points.len(), Class::Body(BodyId(0)));
    for (e, (ends, class)) in coarse.edges.iter().zip(&coarse.edge_classes).enumerate() {
        if let Class::Curve(curve) = *class {
            let first = coarse.points.len() as u32 + e as u32 * (n - 1);
            let mut line = vec![ends[0]];
            line.extend((first..first + n - 1).map(VertexId));
            line.push(ends[1]);
            mesh.segments.extend(line.windows(2).map(|w| Segment { vertices: [w[0], w[1]], curve }));
        }
    }
    let (mut tets, mut boundary) = (TetBlock::default(), BoundaryBlock::default());
    for index in 0..refined.tet_blocks() {
        refined.tet_block(index, &mut tets);
        mesh.tets.extend(tets.tets.iter().map(|tet| tet.map(VertexId)));
        mesh.bodies.extend(tets.tets.iter().map(|_| tets.body.expect("a body")));
    }
    for index in 0..refined.boundary_blocks() {
        refined.boundary_block(index, &mut boundary);
        let patch = boundary.patch.expect("a patch");
        let triangle = |t: &[u32; 3]| BoundaryTriangle { vertices: t.map(VertexId), patch };
        mesh.triangles.extend(boundary.triangles.iter().map(triangle));
    }
    mesh
}

/// One tet with plane faces; the face opposite the first corner lies on `base` if given.
pub fn tet(corners: [[f64; 3]; 4], base: Option<Surface>) -> Fixture {
    let points = corners.map(Point::from).to_vec();
    let plane = |face: [usize; 3]| {
        let [p, q, r] = face.map(|k| points[k]);
        Surface::Plane(Plane { point: p, normal: (q - p).cross(&(r - p)).normalize() })
    };
    let mut surfaces = TET_FACES.map(plane).to_vec();
    if let Some(base) = base {
        surfaces[0] = base;
    }
    let curves: Vec<[u32; 2]> = (0..4).flat_map(|i| (i + 1..4).map(move |j| [i, j])).collect();
    let on: Vec<Vec<u32>> = (0..4).map(|v| (0..4).filter(|face| *face != v).collect()).collect();
    let mesh = classified(points, vec![[0, 1, 2, 3]], vec![BodyId(0)], &on, &curves);
    let corner = P::new(1.0, 1.0, 1.0);
    Fixture { mesh, projector: projector(surfaces, &curves, [-corner, corner]) }
}

/// The whole mesh as one part.
pub fn whole(mesh: &Mesh) -> DistMesh {
    from_serial(mesh.clone()).expect("a classified mesh")
}

/// The shell between two spheres around the origin, one prism of three tets for each face of an
/// icosahedron. Unless it is very thick, its interior edges leave the inner sphere below the
/// tangent planes.
pub fn shell(inner: f64, outer: f64) -> Fixture {
    let ball = ball(1.0).mesh;
    let count = ball.points.len() - 1;
    let sphere = |radius: f64| ball.points[1..].iter().map(move |p| p * radius);
    let points: Vec<Point> = sphere(inner).chain(sphere(outer)).collect();
    let mut tets = Vec::new();
    for tet in &ball.tets {
        let mut columns = [1, 2, 3].map(|k| tet[k].index() - 1);
        columns.sort_unstable();
        let [p, q, r] = columns;
        for mut tet in
            [[p, q, r, r + count], [p, q, q + count, r + count], [p, p + count, q + count, r + count]]
        {
            let [p, q, r, s] = tet.map(|v| points[v]);
            if (q - p).cross(&(r - p)).dot(&(s - p)) < 0.0 {
                tet.swap(2, 3);
            }
            tets.push(tet);
        }
    }
    let on: Vec<Vec<u32>> = (0..2 * count).map(|v| vec![u32::from(v >= count)]).collect();
    let bodies = vec![BodyId(0); tets.len()];
    let sphere = |radius| Surface::Sphere(Sphere { center: P::origin(), radius });
    let corner = P::new(outer, outer, outer);
    Fixture {
        mesh: classified(points, tets, bodies, &on, &[]),
        projector: projector(vec![sphere(inner), sphere(outer)], &[], [-corner, corner]),
    }
}
