//! Whole surfaces through the volume mesher.

use super::samples::{INSIDE, Soup, check_fills};
use super::*;
use crate::size::UniformSize;
use csg::BodyId;

const A: Option<BodyId> = Some(BodyId(0));
const B: Option<BodyId> = Some(BodyId(1));

const EMPTY: Settings = Settings { fill: false, max_tets: 1 << 20 };

fn recovered(soup: Soup) -> Report {
    let surface = soup.surface().unwrap();
    let r0 = mesh(&surface, &UniformSize(1.0), &EMPTY);
    if let Err(e) = &r0 { eprintln!("FAILED {e:?}"); if std::env::var("GO").is_ok() { return Report::default(); } }
    let (mesh, report) = r0.unwrap();
    eprintln!("{} triangles: {report:?}", surface.triangles().len());
    check_fills(&surface, &mesh);
    report
}

#[test]
fn cubes_with_any_number_of_squares_are_filled() {
    for n in [1, 2, 3, 8, 13] {
        let mut soup = Soup::default();
        soup.brick([0.; 3], [1.; 3], n, INSIDE);
        assert_eq!(recovered(soup).steiner_inside, 0, "{n} squares a side");
    }
}

#[test]
fn turned_cubes_whose_sides_are_flat_up_to_rounding_are_filled() {
    for k in 0..10 {
        let mut soup = Soup::default();
        soup.brick([-1.; 3], [1.; 3], 6, INSIDE);
        let turn = nalgebra::Rotation3::from_euler_angles(0.1 * f64::from(k), 0.7, 0.3 * f64::from(k));
        soup.map(|p| turn * p);
        recovered(soup);
    }
}

#[test]
fn a_cube_in_a_cube_is_a_hole_or_a_body() {
    for inner in [None, B] {
        for (n, m) in [(1, 1), (4, 1), (1, 4), (6, 5)] {
            let mut soup = Soup::default();
            soup.brick([0.; 3], [1.; 3], n, INSIDE);
            soup.brick([0.3; 3], [0.6; 3], m, [inner, A]);
            recovered(soup);
        }
    }
}

#[test]
fn two_cubes_share_a_face() {
    for n in [1, 2, 5] {
        let mut soup = Soup::default();
        for (axis, upper) in [(0, false), (1, false), (1, true), (2, false), (2, true)] {
            soup.brick_side([0.; 3], [1.; 3], n, axis, upper, [A, None]);
        }
        for (axis, upper) in [(0, true), (1, false), (1, true), (2, false), (2, true)] {
            soup.brick_side([1., 0., 0.], [2., 1., 1.], n, axis, upper, [B, None]);
        }
        soup.brick_side([0.; 3], [1.; 3], n, 0, true, [A, B]);
        recovered(soup);
    }
}

#[test]
fn cubes_that_touch_in_a_vertex_or_an_edge_are_filled() {
    for high in [[2.; 3], [2., 2., 1.]] {
        for n in [1, 3] {
            let mut soup = Soup::default();
            soup.brick([0.; 3], [1.; 3], n, INSIDE);
            let low = [1., 1., high[2] - 1.];
            soup.brick(low, high, n, INSIDE);
            recovered(soup);
        }
    }
}

#[test]
fn spheres_and_tori_are_filled() {
    for levels in 0..5 {
        let mut soup = Soup::default();
        soup.sphere(Point::new(0.1, 0.2, 0.3), 0.7, levels, INSIDE);
        recovered(soup);
    }
    for (m, n) in [(3, 3), (8, 5), (24, 12), (60, 8), (10, 40)] {
        let mut soup = Soup::default();
        soup.torus([1.0, 0.4], [m, n], INSIDE);
        recovered(soup);
    }
}

#[test]
fn a_sphere_in_a_cube_is_filled_from_both_sides() {
    for (n, levels) in [(1, 0), (1, 3), (6, 1), (8, 3)] {
        let mut soup = Soup::default();
        soup.brick([-1.; 3], [1.; 3], n, INSIDE);
        soup.sphere(Point::origin(), 0.6, levels, [B, A]);
        recovered(soup);
    }
}

#[test]
fn thin_plates_are_filled() {
    for thickness in [1e-1, 1e-2, 1e-3, 1e-6, 1e-9] {
        let mut soup = Soup::default();
        soup.brick([0.; 3], [1., 1., thickness], 8, INSIDE);
        recovered(soup);
    }
}

#[test]
fn extreme_units_change_nothing() {
    let build = |scale: f64| {
        let mut soup = Soup::default();
        soup.torus([1.0, 0.4], [12, 6], INSIDE);
        soup.map(|p| p * scale);
        let surface = soup.surface().unwrap();
        mesh(&surface, &UniformSize(1.0), &EMPTY).unwrap().0.tets
    };
    assert_eq!(build(1.0), build(2f64.powi(-300)));
    assert_eq!(build(1.0), build(2f64.powi(300)));
}

/// The Schönhardt polyhedron: a prism whose top is turned so that its sides bend inward along their diagonals. It has no
/// tetrahedralisation without a point inside.
fn schoenhardt(turn: f64) -> Soup {
    let at = |angle: f64, z: f64| Point::new(angle.cos(), angle.sin(), z);
    let third = std::f64::consts::TAU / 3.0;
    let low: Vec<Point> = (0..3).map(|i| at(third * f64::from(i), 0.0)).collect();
    let high: Vec<Point> = (0..3).map(|i| at(third * f64::from(i) + turn, 1.0)).collect();
    let mut soup = Soup::default();
    soup.add([low[0], low[2], low[1]], INSIDE);
    soup.add([high[0], high[1], high[2]], INSIDE);
    for i in 0..3 {
        let j = (i + 1) % 3;
        // The diagonal that makes the side concave for a turn in the positive sense.
        soup.add([low[i], low[j], high[i]], INSIDE);
        soup.add([low[j], high[j], high[i]], INSIDE);
    }
    soup
}

#[test]
fn the_schoenhardt_polyhedron_gets_one_point_inside() {
    for degrees in [1.0f64, 10.0, 30.0, 45.0, 55.0] {
        for sign in [1.0, -1.0] {
            let report = recovered(schoenhardt(sign * degrees.to_radians()));
            eprintln!("{degrees} {sign} {report:?}");
        }
    }
}

/// Any surface between tets of some mesh can be filled. A lattice of n³ cubes of six tets each, squeezed and sheared so
/// that it is far from Delaunay, each tet in one of two bodies or in none: surfaces that touch themselves everywhere.
fn lattice_skin(n: u32, squeeze: [f64; 3], shear: f64, bend: f64, mut body: impl FnMut() -> Option<BodyId>) -> Soup {
    let at = |c: [u32; 3]| {
        let [x, y, z] = [0, 1, 2].map(|k| f64::from(c[k]) * squeeze[k]);
        // Triangular, so every tet keeps its volume.
        Point::new(x, y + shear * x, z + shear * y + bend * (x * x + y * y))
    };
    let mut sides = std::collections::BTreeMap::<[[u32; 3]; 3], Vec<([[u32; 3]; 3], Option<BodyId>)>>::new();
    for i in 0..n * n * n {
        let base = [i % n, i / n % n, i / n / n];
        for path in [[0, 1, 2], [0, 2, 1], [1, 0, 2], [1, 2, 0], [2, 0, 1], [2, 1, 0]] {
            let mut tet = [base; 4];
            for (k, &axis) in path.iter().enumerate() {
                tet[k + 1] = tet[k];
                tet[k + 1][axis] += 1;
            }
            let [a, b, c, d] = tet.map(at);
            if crate::kernel::simplex::volume6(&a, &b, &c, &d) < 0.0 {
                tet.swap(0, 1);
            }
            let body = body();
            for face in crate::mesh::TET_FACES {
                let face = face.map(|k| tet[k]);
                let mut key = face;
                key.sort_unstable();
                sides.entry(key).or_default().push((face, body));
            }
        }
    }
    let mut soup = Soup::default();
    for found in sides.values() {
        let (face, behind) = found[0];
        let front = found.get(1).and_then(|other| other.1);
        if behind != front {
            soup.add(face.map(at), [behind, front]);
        }
    }
    soup
}

#[test]
fn skins_of_random_bodies_in_a_bent_lattice_are_filled() {
    let mut random = crate::kernel::random::Random::new(11);
    for case in 0..1500 {
        let squeeze = [0, 1, 2].map(|_| 0.15 + random.unit());
        let (shear, bend) = (5.0 * random.unit() - 2.5, 1.0 * random.unit() * f64::from(case % 2));
        let n = 2 + case % 3;
        let soup = lattice_skin(n, squeeze, shear, bend, || match random.bits() % 4 {
            0 | 1 => None,
            2 => A,
            _ => B,
        });
        eprintln!("case {case}");
        recovered(soup);
    }
}
