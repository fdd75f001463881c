//! Solids that touch, made by hand.

use super::{Edges, Face, Shapes};
use crate::model::{Corner, Model};
use crate::surface::Profile;
use crate::{BrepError, Curve, EdgeCurve, Settings, Surface, Tessellation, Vector, tessellate};
use std::f64::consts::{PI, TAU};

pub(super) const X: Vector = Vector::new(1.0, 0.0, 0.0);
pub(super) const Y: Vector = Vector::new(0.0, 1.0, 0.0);
pub(super) const Z: Vector = Vector::new(0.0, 0.0, 1.0);

/// Solids, nothing shared between them. Each function adds one.
#[derive(Default)]
pub(super) struct Solids(Shapes);

impl Solids {
    fn body(&mut self) -> usize {
        self.0.accuracy.push(1e-9);
        self.0.accuracy.len() - 1
    }

    fn corner(&mut self, point: Vector) -> usize {
        let body = self.0.accuracy.len() - 1;
        self.0.add_corner(Corner { point: point.into(), tolerance: 1e-9 }, body)
    }

    fn edge(&mut self, curve: Curve<3>, range: [f64; 2], ends: [usize; 2]) -> usize {
        self.0.curves.push(EdgeCurve { curve, range, ends, tolerance: 1e-9 });
        self.0.body_of_curve.push(self.0.accuracy.len() - 1);
        self.0.curves.len() - 1
    }

    pub fn line(&mut self, a: usize, b: usize) -> usize {
        let [start, end] = [a, b].map(|corner| self.0.corners[corner].point.coords);
        self.edge(Curve::Line { start, direction: end - start }, [0.0, 1.0], [a, b])
    }

    /// A horizontal circle around the z axis, counterclockwise, with one vertex at an angle.
    fn circle(&mut self, center: Vector, radius: f64, at: f64) -> usize {
        let corner = self.corner(center + (X * at.cos() + Y * at.sin()) * radius);
        let curve = Curve::Ellipse { center, axes: [X * radius, Y * radius] };
        self.edge(curve, [at, at + TAU], [corner; 2])
    }

    /// A face whose body is behind it.
    fn face(&mut self, surface: Surface, loops: Vec<Edges>) {
        let body = self.0.accuracy.len() - 1;
        let id = self.0.faces.len() as u64;
        self.0.faces.push(Face { id, surface, loops, inner: Vec::new(), body, is_behind: true, name: None });
    }

    /// A horizontal face that looks up or down, with loops counterclockwise seen from above.
    fn level(&mut self, z: f64, looks_up: bool, loops: Vec<Edges>) {
        let axes = if looks_up { [X, Y] } else { [Y, X] };
        let turned = |edges: Edges| if looks_up { edges } else { super::reversed(edges) };
        self.face(Surface::Plane { origin: Z * z, axes }, loops.into_iter().map(turned).collect());
    }

    /// An upright wall from z = low to high above a polygon, counterclockwise seen from above. The
    /// loops at its lower and upper end.
    fn wall(&mut self, polygon: &[Vector], [low, high]: [f64; 2]) -> [Edges; 2] {
        let count = polygon.len();
        let [below, above]: [Vec<usize>; 2] =
            [low, high].map(|z| polygon.iter().map(|p| self.corner(p + Z * z)).collect());
        let around = |solids: &mut Self, ring: &[usize]| -> Edges {
            (0..count).map(|k| (solids.line(ring[k], ring[(k + 1) % count]), true)).collect()
        };
        let rings = [around(self, &below), around(self, &above)];
        let up: Vec<usize> = (0..count).map(|k| self.line(below[k], above[k])).collect();
        for k in 0..count {
            let next = (k + 1) % count;
            let along = (polygon[next] - polygon[k]).normalize();
            let edges = vec![rings[0][k], (up[next], true), (rings[1][k].0, false), (up[k], false)];
            self.face(Surface::Plane { origin: polygon[k], axes: [along, Z] }, vec![edges]);
        }
        rings
    }

    /// A prism with holes that are circles (center and radius) through all of it.
    pub fn prism(&mut self, polygon: &[Vector], [low, high]: [f64; 2], holes: &[(Vector, f64)]) {
        self.body();
        let [below, above] = self.wall(polygon, [low, high]);
        let (mut floor, mut roof) = (vec![below], vec![above]);
        for &(center, radius) in holes {
            let [below, above] = [low, high].map(|z| self.circle(center + Z * z, radius, 0.3));
            // The body is in front of this surface.
            self.face(round(center, radius), vec![vec![(below, true)], vec![(above, false)]]);
            self.0.faces.last_mut().expect("the face of the hole").is_behind = false;
            floor.push(vec![(below, false)]);
            roof.push(vec![(above, false)]);
        }
        self.level(low, false, floor);
        self.level(high, true, roof);
    }

    /// A face with straight edges between places, and nothing else.
    pub fn polygon(&mut self, surface: Surface, places: &[Vector]) {
        self.body();
        let corners: Vec<usize> = places.iter().map(|place| self.corner(*place)).collect();
        let count = corners.len();
        let edges = (0..count).map(|k| (self.line(corners[k], corners[(k + 1) % count]), true)).collect();
        self.face(surface, vec![edges]);
    }

    pub fn block(&mut self, low: [f64; 3], high: [f64; 3]) {
        let [a, b] = [low, high];
        let polygon = [[a[0], a[1]], [b[0], a[1]], [b[0], b[1]], [a[0], b[1]]].map(|[x, y]| X * x + Y * y);
        self.prism(&polygon, [a[2], b[2]], &[]);
    }

    /// An upright cylinder whose vertices are at an angle.
    pub fn pin(&mut self, center: Vector, radius: f64, [low, high]: [f64; 2], at: f64) {
        self.body();
        let [below, above] = [low, high].map(|z| self.circle(center + Z * z, radius, at));
        self.face(round(center, radius), vec![vec![(below, true)], vec![(above, false)]]);
        self.level(low, false, vec![vec![(below, true)]]);
        self.level(high, true, vec![vec![(above, true)]]);
    }

    /// An upright cylinder with a seam between its vertices.
    pub fn pin_with_seam(&mut self, center: Vector, radius: f64, z: [f64; 2], at: f64) {
        self.pin(center, radius, z, at);
        let wall = self.0.faces.len() - 3;
        let rings: Edges = self.0.faces[wall].loops.iter().flatten().copied().collect();
        let [a, b] = [0, 1].map(|k| self.0.curves[rings[k].0].ends[0]);
        let seam = self.line(a, b);
        self.0.faces[wall].loops = vec![vec![rings[0], (seam, true), rings[1], (seam, false)]];
    }

    /// A ball.
    pub fn ball(&mut self, center: Vector, radius: f64) {
        self.body();
        let profile = Profile::Circle { major: 0.0, minor: radius };
        self.face(Surface::Round { origin: center, axes: [X, Y, Z], profile }, Vec::new());
    }

    /// States an accuracy for all solids.
    pub fn set_accuracy(&mut self, accuracy: f64) {
        self.0.accuracy.fill(accuracy);
        self.0.curves.iter_mut().for_each(|edge| edge.tolerance = accuracy);
    }

    pub fn into_shapes(self) -> Shapes {
        self.0
    }

    pub fn model(self) -> Model {
        let mut model = Model { bodies: self.0.accuracy.len(), ..Model::default() };
        self.0.build(&mut model).unwrap_or_else(|error| panic!("{error}"));
        model
    }

    /// The model, the volumes of its bodies and the area of its interfaces.
    fn measured(self) -> (Model, Vec<f64>, f64) {
        measured(self.model())
    }
}

/// A model imprinted, the volumes of its bodies and the area of its interfaces.
pub(super) fn measured(mut model: Model) -> (Model, Vec<f64>, f64) {
    model.imprint();
    let tessellation = tessellated(&mut model).unwrap_or_else(|error| panic!("{error}"));
    let volumes = (0..model.bodies).map(|body| tessellate::volume(&model, &tessellation, body)).collect();
    let shared = (0..model.patches.len()).filter(|&p| !model.patches[p].bodies.contains(&None));
    let area = shared.map(|p| tessellate::area(&tessellation, p)).sum();
    (model, volumes, area)
}

fn tessellated(model: &mut Model) -> Result<Tessellation, BrepError> {
    Tessellation::of(model, &Settings { chord: 1e-4, angle: 0.1 })
}

/// An upright cylinder that is round in both senses.
fn round(center: Vector, radius: f64) -> Surface {
    let profile = Profile::Line { radius, slope: [0.0, 1.0] };
    Surface::Round { origin: center, axes: [X, Y, Z], profile }
}

pub(super) fn square(center: Vector, half: f64, turned: f64) -> Vec<Vector> {
    let corner = |k: i32| {
        let at = turned + f64::from(k) * PI / 2.0 + PI / 4.0;
        center + (X * at.cos() + Y * at.sin()) * (half * 2.0_f64.sqrt())
    };
    (0..4).map(corner).collect()
}

/// Asserts volumes and the area of interfaces.
fn assert_measures(solids: Solids, exact: &[f64], area: f64) -> Model {
    let (model, volumes, found) = solids.measured();
    for (found, exact) in volumes.iter().zip(exact) {
        assert!((found / exact - 1.0).abs() < 2e-3, "{volumes:?}");
    }
    assert!((found - area).abs() <= 2e-3 * area, "{found} is not {area}");
    model
}

#[test]
fn a_block_over_the_corner_of_another_shares_a_rectangle() {
    let mut solids = Solids::default();
    solids.block([0.0; 3], [1.0; 3]);
    solids.block([0.3, 0.4, 1.0], [1.3, 1.4, 2.0]);
    let model = assert_measures(solids, &[1.0, 1.0], 0.42);
    // Both touching faces have two parts, of which they share one.
    assert_eq!((model.patches.len(), model.notes.len()), (13, 1), "{:?}", model.notes);
}

#[test]
fn a_bridge_shares_parts_of_one_face_with_two_piers() {
    let mut solids = Solids::default();
    solids.block([0.0; 3], [1.0; 3]);
    solids.block([2.0, 0.0, 0.0], [3.0, 1.0, 1.0]);
    solids.block([-0.2, 0.2, 1.0], [3.2, 0.8, 1.5]);
    let model = assert_measures(solids, &[1.0, 1.0, 3.4 * 0.6 * 0.5], 1.2);
    // The bridge's lower face: two piers, the part between them and those beyond.
    assert_eq!(model.patches.len(), 5 + 5 + 5 + 2 * 2 + 5);
}

#[test]
fn bricks_in_a_running_bond_share_halves_of_their_faces() {
    let mut solids = Solids::default();
    for row in 0..3 {
        for column in 0..3 {
            let at = [f64::from(column) + 0.5 * f64::from(row % 2), 0.0, 0.4 * f64::from(row)];
            solids.block(at, [at[0] + 1.0, 0.5, at[2] + 0.4]);
        }
    }
    // In each row two upright contacts, and 2.5 units of length between rows.
    assert_measures(solids, &[0.2; 9], 3.0 * 2.0 * 0.2 + 2.0 * 2.5 * 0.5);
}

#[test]
fn edges_of_turned_squares_cross() {
    let mut solids = Solids::default();
    solids.prism(&square(Vector::zeros(), 1.0, 0.0), [0.0, 0.5], &[]);
    solids.prism(&square(Vector::zeros(), 1.0, PI / 4.0), [0.5, 1.0], &[]);
    // A regular octagon around the unit circle.
    let octagon = 8.0 * (PI / 8.0).tan();
    let model = assert_measures(solids, &[2.0, 2.0], octagon);
    // Four corners of each square are left over.
    assert_eq!(model.patches.len(), 5 + 5 + 1 + 4 + 4);
}

#[test]
fn a_pin_longer_than_its_hole_shares_its_middle_wherever_its_vertices_are() {
    for at in [0.3, 0.0, 2.0] {
        let mut solids = Solids::default();
        solids.prism(&square(Vector::zeros(), 1.0, 0.0), [0.0, 1.0], &[(Vector::zeros(), 0.5)]);
        solids.pin(Vector::zeros(), 0.5, [-0.5, 1.5], at);
        let model = assert_measures(solids, &[4.0 - PI / 4.0, PI / 2.0], PI);
        assert_eq!(model.patches.len(), 7 + 4, "{at}");
    }
}

#[test]
fn solids_within_a_face_divide_it() {
    let mut solids = Solids::default();
    let ring = [(X * 0.1, 0.3)];
    solids.block([-2.0, -2.0, 0.0], [2.0, 2.0, 1.0]);
    solids.prism(&square(X * 0.1, 0.8, 0.3), [1.0, 2.0], &ring);
    solids.pin(X * 0.1, 0.2, [1.0, 1.5], 0.0);
    let hole = PI * 0.09;
    let model = assert_measures(solids, &[16.0, 2.56 - hole, PI * 0.02], 2.56 - hole + PI * 0.04);
    // The lower face of the prism, that of the pin, the ring between them and the rest.
    assert_eq!(model.patches.len(), 5 + 6 + 2 + 4);
}

#[test]
fn edges_on_one_line_do_not_hide_each_other() {
    // The first edge of the upper face and that of the block on it.
    let outline =
        [[2.0, 1.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0], [0.0, 0.0], [3.0, 0.0], [3.0, 2.0], [2.0, 2.0]];
    let mut solids = Solids::default();
    solids.prism(&outline.map(|[x, y]| X * x + Y * y), [0.0, 1.0], &[]);
    solids.block([0.2, 1.0, 1.0], [0.6, 1.5, 2.0]);
    let model = assert_measures(solids, &[5.0, 0.2], 0.2);
    assert_eq!(model.patches.len(), 10 + 1 + 5);
}

#[test]
fn curved_edges_cross_straight_ones_and_touch_them() {
    // A cylinder over an edge of a block, and one whose circle touches that edge from inside.
    for (center, area) in
        [(0.1, 0.25 * PI / 2.0 + 0.25 * 0.2_f64.asin() + 0.1 * 0.24_f64.sqrt()), (0.5, PI / 4.0)]
    {
        let mut solids = Solids::default();
        solids.block([0.0; 3], [2.0, 2.0, 1.0]);
        solids.pin(X * center + Y, 0.5, [1.0, 2.0], 1.0);
        let model = assert_measures(solids, &[4.0, PI / 4.0], area);
        // Two crossings, or one place where they touch.
        assert_eq!(model.corners.len(), 8 + 2 + if center == 0.1 { 2 } else { 1 });
    }
}

#[test]
fn a_ball_in_a_socket_has_no_edges_of_its_own() {
    let mut solids = Solids::default();
    solids.body();
    let [below, above] = solids.wall(&square(Vector::zeros(), 1.0, 0.0), [-1.0, 0.0]);
    let center = Z * 0.1;
    let profile = Profile::Circle { major: 0.0, minor: 0.6 };
    let sphere = || Surface::Round { origin: center, axes: [X, Y, Z], profile };
    let rim = solids.circle(Vector::zeros(), 0.35_f64.sqrt(), 0.0);
    solids.level(-1.0, false, vec![below]);
    solids.level(0.0, true, vec![above, vec![(rim, false)]]);
    // The lower part of the sphere is counterclockwise below the rim.
    solids.face(sphere(), vec![vec![(rim, false)]]);
    solids.0.faces.last_mut().unwrap().is_behind = false;
    solids.body();
    solids.face(sphere(), Vec::new());
    let cap = |height: f64| PI * height * height * (0.6 - height / 3.0);
    let ball = 4.0 / 3.0 * PI * 0.216;
    let model = assert_measures(solids, &[4.0 - cap(0.5), ball], TAU * 0.6 * 0.5);
    assert_eq!(model.patches.len(), 8);
}

#[test]
fn solids_with_a_gap_below_the_accuracy_that_the_file_states_stay_apart() {
    let mut solids = Solids::default();
    solids.pin(Vector::zeros(), 1.0, [0.0, 1.0], 0.3);
    solids.pin(Vector::zeros(), 1.0, [1.005, 2.005], 0.3);
    solids.0.accuracy = vec![0.01; 2];
    let model = assert_measures(solids, &[PI, PI], 0.0);
    assert_eq!(model.corners.len(), 4);
}

#[test]
fn sides_of_a_face_narrower_than_the_accuracy_that_the_file_states_have_no_common_corner() {
    const WIDTH: f64 = 0.005;
    let narrow = |other: [[f64; 3]; 2]| {
        let mut solids = Solids::default();
        solids.block([0.0; 3], [1.0, WIDTH, 1.0]);
        let [from, to] = other;
        solids.block(from, to);
        solids.set_accuracy(0.01);
        solids
    };
    // Across it, and with an edge along one side.
    let across = narrow([[0.3, -1.0, 1.0], [0.6, 1.0, 2.0]]);
    let model = assert_measures(across, &[WIDTH, 0.6], 0.3 * WIDTH);
    assert_eq!(model.corners.len(), 20);
    let along = narrow([[0.2, WIDTH, 1.0], [0.8, 1.0, 2.0]]);
    assert_measures(along, &[WIDTH, 0.6 * (1.0 - WIDTH)], 0.0);
}

#[test]
fn solids_that_touch_in_a_line_stay_apart() {
    let mut solids = Solids::default();
    solids.block([0.0; 3], [1.0; 3]);
    solids.block([1.0, 0.2, 1.0], [2.0, 0.8, 2.0]);
    let model = assert_measures(solids, &[1.0, 0.6], 0.0);
    assert_eq!((model.patches.len(), model.notes.len()), (12, 0));
}

#[test]
fn solids_that_overlap_are_refused_by_number() {
    let mut solids = Solids::default();
    solids.block([0.0; 3], [1.0; 3]);
    solids.block([0.2; 3], [0.8; 3]);
    let mut model = Model { bodies: 2, ..Model::default() };
    solids.0.build(&mut model).unwrap();
    let error = tessellated(&mut model).expect_err("a block inside of another one");
    assert!(matches!(&error, BrepError::Solid { solid: 2, what, .. } if what.contains("solid 1")), "{error}");
}

#[test]
fn an_edge_longer_than_its_narrow_face_ends_at_the_next_one() {
    const WIDTH: f64 = 0.01;
    for share in [0.03_f64, -0.03] {
        let mut solids = Solids::default();
        solids.block([0.0; 3], [WIDTH, 1.0, 1.0]);
        let mut shapes = solids.into_shapes();
        // The corners of the file are within its accuracy.
        shapes.corners.iter_mut().for_each(|corner| corner.tolerance = share.abs() * WIDTH);
        for edge in &mut shapes.curves {
            let way = edge.curve.point(edge.range[1]) - edge.curve.point(edge.range[0]);
            if way.cross(&X).norm() == 0.0 {
                edge.range[1] += share;
            }
        }
        let mut model = Model { bodies: 1, ..Model::default() };
        shapes.build(&mut model).unwrap();
        let (_, volumes, _) = measured(model);
        assert!((volumes[0] / WIDTH - 1.0).abs() < 0.05, "{volumes:?}");
    }
}
