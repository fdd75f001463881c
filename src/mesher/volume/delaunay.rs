//! Delaunay tetrahedralisation of the boundary points, inside one tet that contains them all.
//!
//! Four **far** vertices, numbered after the points, replace a ghost vertex. So hull, coplanar and
//! collinear points need no special case, also not in the flips of boundary recovery. The mesh is
//! Delaunay for the points and the far vertices together. The convex hull of the points need not be
//! in it, because boundary recovery does not depend on it. If several Delaunay meshes exist, `ties`
//! chooses one.

use super::cavity::{Cavity, Walk, walk};
use super::tetrahedra::{NO_BODY, Tetrahedra};
use super::ties;
use crate::Point;
use crate::ground::kernel::hilbert::random_rounds;
use crate::ground::kernel::predicates::{Sign, orient3d};

/// Half-side of the cube of the far vertices, in half-diagonals of the points' bounding box.
///
/// The far tet then has an inscribed sphere of 10/√3 half-diagonals, so it contains every point;
/// below √3 it would not. Much larger values make the circumspheres of far tets so large that their
/// signs need the slow exact predicates.
const FAR: f64 = 10.0;

/// Inserts all points into one large tet, whose far vertices are numbered after them. Of several
/// Delaunay meshes it makes one that has most of the triangles.
///
/// No two points may be equal.
pub(super) fn delaunay(points: &[Point], triangles: &[[u32; 3]]) -> Tetrahedra {
    delaunay_by(points, ties::ranks(points, triangles))
}

/// The Delaunay mesh whose ties are decided by the ranks of the points.
fn delaunay_by(points: &[Point], ranks: Vec<u32>) -> Tetrahedra {
    let mut mesh = Tetrahedra::new(points.to_vec());
    let first = far_tet(&mut mesh);
    mesh.ranks = ranks;
    mesh.ranks.extend(points.len() as u32..mesh.points.len() as u32);
    let mut cavity = Cavity::default();
    let mut hint = first;
    for v in random_rounds(points) {
        let point = points[v as usize];
        let Walk::Inside(seed) = walk(&mesh, hint, &point) else {
            panic!("vertex {v} lies outside the far tet");
        };
        mesh.inserted = v;
        cavity.grow(&mut mesh, seed, &point);
        cavity.fill(&mut mesh, v, NO_BODY);
        hint = cavity.filled[0];
    }
    mesh.ranks = Vec::new();
    mesh
}

/// Adds the far vertices and their tet; returns the tet.
fn far_tet(mesh: &mut Tetrahedra) -> u32 {
    let (mut low, mut high) = (mesh.points[0], mesh.points[0]);
    for p in &mesh.points {
        (low, high) = (low.inf(p), high.sup(p));
    }
    let center = nalgebra::center(&low, &high);
    let reach = FAR * 0.5 * (high - low).norm();
    let mut tet = [[1., 1., 1.], [1., -1., -1.], [-1., 1., -1.], [-1., -1., 1.]]
        .map(|d| mesh.add_point(center + crate::Vector::from(d) * reach));
    let [a, b, c, d] = tet.map(|v| mesh.point(v));
    if orient3d(a, b, c, d) == Sign::Negative {
        tet.swap(0, 1);
    }
    mesh.add_tet(tet, NO_BODY)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ground::kernel::predicates::insphere;
    use crate::ground::kernel::random::Random;
    use proptest::prelude::*;

    fn check_delaunay(points: &[Point]) {
        let mut random = Random::new(points.len() as u64);
        let mut ranks: Vec<u32> = (0..points.len() as u32).collect();
        ranks.sort_by_cached_key(|_| random.bits());
        check_delaunay_by(points, delaunay(points, &[]));
        check_delaunay_by(points, delaunay_by(points, ranks));
    }

    fn check_delaunay_by(points: &[Point], mesh: Tetrahedra) {
        assert_eq!(mesh.check(), Vec::<String>::new());
        assert_eq!(mesh.points.len(), points.len() + 4);
        assert!(mesh.at_vertex.iter().all(|&t| t != crate::mesher::half_face::NONE));
        for t in mesh.alive() {
            let [a, b, c, d] = mesh.corners(t);
            for half_face in 4 * t..4 * t + 4 {
                let other = mesh.across(half_face);
                if other != crate::mesher::half_face::NONE {
                    let e = mesh.point(mesh.apex(other));
                    assert_ne!(insphere(a, b, c, d, e), Sign::Positive, "face {:?}", mesh.face(half_face));
                }
            }
        }
    }

    #[test]
    fn a_grid_of_cospherical_points_is_delaunay() {
        let n = 7;
        let points: Vec<Point> = (0..n * n * n)
            .map(|i| Point::new(f64::from(i % n), f64::from(i / n % n), f64::from(i / n / n)) * 0.1)
            .collect();
        check_delaunay(&points);
    }

    #[test]
    fn points_of_one_plane_one_line_and_one_sphere_are_delaunay() {
        let plane: Vec<Point> =
            (0..100).map(|i| Point::new(f64::from(i % 10), f64::from(i / 10), 0.5)).collect();
        let line: Vec<Point> = (0..50).map(|i| Point::new(f64::from(i), 2.0 * f64::from(i), 0.0)).collect();
        let mut random = Random::new(1);
        let sphere: Vec<Point> = (0..300)
            .map(|_| {
                let v = crate::Vector::from_fn(|_, _| random.unit() - 0.5);
                Point::from(v.normalize())
            })
            .collect();
        for points in [plane, line, sphere, vec![Point::new(1., 2., 3.), Point::new(1., 2., 4.)]] {
            check_delaunay(&points);
        }
    }

    #[test]
    fn needles_and_far_flung_scales_are_delaunay() {
        let mut random = Random::new(2);
        let points: Vec<Point> = (0..400)
            .map(|i| {
                let scale = 2f64.powi(-(i % 40));
                Point::new(random.unit(), random.unit() * scale, random.unit() * scale * scale)
            })
            .collect();
        check_delaunay(&points);
    }

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, rng_seed: proptest::test_runner::RngSeed::Fixed(5), ..ProptestConfig::default() })]
        #[test]
        fn points_of_a_small_lattice_are_delaunay(
            cells in proptest::collection::btree_set((0..6i32, 0..6i32, 0..4i32), 1..80),
            slant in 0..3i32,
        ) {
            // The rotated lattice is coplanar and cospherical only up to rounding.
            let turn = nalgebra::Rotation3::from_euler_angles(0.3 * f64::from(slant), 0.2 * f64::from(slant), 0.0);
            let points: Vec<Point> = cells
                .iter()
                .map(|&(x, y, z)| turn * Point::new(f64::from(x), f64::from(y), f64::from(z)))
                .collect();
            check_delaunay(&points);
        }
    }
}
