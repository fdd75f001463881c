//! What files of real programs have that they should not.

use super::{Text, assert_near, volumes};
use crate::{BrepError, Model, Settings, Tessellation, Unit, tessellate};
use std::collections::HashMap;
use std::f64::consts::PI;

/// A cylinder of radius 1 from z = 0 to 2, whose upper face looks up or down.
fn cylinder(text: &mut Text, looks_up: bool) -> [u32; 3] {
    cylinder_of_height(text, 2.0, looks_up)
}

fn cylinder_of_height(text: &mut Text, height: f64, looks_up: bool) -> [u32; 3] {
    let (low, high) = (text.circle(1.0, 0.0, 0.0), text.circle(1.0, height, 0.0));
    let frame = text.frame(0.0, 1.0);
    let surface = text.add(&format!("CYLINDRICAL_SURFACE('',#{frame},1.)"));
    let bounds = [text.bound(low, true), text.bound(high, false)];
    [text.face(surface, &bounds), text.disk(low, 0.0, false), text.disk(high, height, looks_up)]
}

#[test]
fn a_face_that_points_inside_is_turned() {
    for (looks_up, notes) in [(true, 0), (false, 1)] {
        let mut text = Text::new();
        let faces = cylinder(&mut text, looks_up);
        let (model, volumes) = volumes(&text.solid(&faces), Unit::OfFile);
        assert_near(volumes[0], 2.0 * PI);
        assert_eq!(model.notes.len(), notes, "{:?}", model.notes);
    }
}

/// A cylinder, and a ball in it, whose shell has an orientation.
fn cylinder_around_ball(orientation: &str) -> (Text, [u32; 2]) {
    let mut text = Text::new();
    let faces = cylinder(&mut text, true);
    let frame = text.frame(1.0, 1.0);
    let surface = text.add(&format!("SPHERICAL_SURFACE('',#{frame},0.5)"));
    let bound = text.vertex_bound();
    let ball = text.face(surface, &[bound]);
    let [outer, inner] = [text.shell(&faces), text.shell(&[ball])];
    let void = text.add(&format!("ORIENTED_CLOSED_SHELL('',*,#{inner},.{orientation}.)"));
    (text, [outer, void])
}

#[test]
fn shells_of_a_surface_model_that_point_inside_are_voids() {
    let (mut text, [outer, void]) = cylinder_around_ball("F");
    let model = text.add(&format!("SHELL_BASED_SURFACE_MODEL('part',(#{void},#{outer}))"));
    let (model, volumes) = volumes(&text.of_solid(model), Unit::OfFile);
    assert_eq!((volumes.len(), model.body_names), (1, vec![Some("part".to_owned())]));
    assert_near(volumes[0], 2.0 * PI - PI / 6.0);
    assert!(model.notes[1].starts_with("1 of these solids is a void"), "{:?}", model.notes);

    // One that points outside is a solid, which overlaps the other.
    let (mut text, [outer, inner]) = cylinder_around_ball("T");
    let model = text.add(&format!("SHELL_BASED_SURFACE_MODEL('part',(#{inner},#{outer}))"));
    let mut model = Model::read_step(text.of_solid(model).as_bytes(), Unit::OfFile).unwrap();
    assert_eq!(model.bodies, 2);
    let error = Tessellation::of(&mut model, &Settings { chord: 1e-3, angle: 0.2 }).unwrap_err();
    assert!(matches!(error, BrepError::Solid { .. }), "{error}");
}

#[test]
fn voids_are_voids_however_they_are_oriented() {
    for (orientation, notes) in [("F", 0), ("T", 1)] {
        let (mut text, [outer, void]) = cylinder_around_ball(orientation);
        let solid = text.add(&format!("BREP_WITH_VOIDS('part',#{outer},(#{void}))"));
        let (model, volumes) = volumes(&text.of_solid(solid), Unit::OfFile);
        assert_near(volumes[0], 2.0 * PI - PI / 6.0);
        assert_eq!(model.notes.len(), notes, "{:?}", model.notes);
    }
}

#[test]
fn an_edge_through_both_poles_of_a_sphere_is_divided_there() {
    // The half with x > 0; its only edge starts where y = 1.
    let mut text = Text::new();
    let point = text.point(0.0, 1.0, 0.0);
    let vertex = text.add(&format!("VERTEX_POINT('',#{point})"));
    let frame = text.frame_at([0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let circle = text.add(&format!("CIRCLE('',#{frame},1.)"));
    let rim = text.add(&format!("EDGE_CURVE('',#{vertex},#{vertex},#{circle},.T.)"));
    let frame = text.frame(0.0, 1.0);
    let sphere = text.add(&format!("SPHERICAL_SURFACE('',#{frame},1.)"));
    let bound = text.bound(rim, true);
    let half = text.face(sphere, &[bound]);
    let frame = text.frame_at([0.0; 3], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    let plane = text.add(&format!("PLANE('',#{frame})"));
    let bound = text.bound(rim, false);
    let disk = text.face(plane, &[bound]);
    let (model, volumes) = volumes(&text.solid(&[half, disk]), Unit::OfFile);
    assert_near(volumes[0], 2.0 / 3.0 * PI);
    assert_eq!(model.curves.len(), 3);
}

#[test]
fn a_seam_goes_around_holes() {
    // A cylinder with a face of its own from angle 0.2 to 2.9 and height 0.5 to 1.5 on its side.
    let mut text = Text::new();
    let (low, high) = (text.circle(1.0, 0.0, 0.0), text.circle(1.0, 2.0, 1.5));
    let mut at = |angle: f64, z: f64| {
        let point = text.point(angle.cos(), angle.sin(), z);
        (point, text.add(&format!("VERTEX_POINT('',#{point})")))
    };
    let corners = [at(0.2, 0.5), at(2.9, 0.5), at(2.9, 1.5), at(0.2, 1.5)];
    let up = text.add("DIRECTION('',(0.,0.,1.))");
    let up = text.add(&format!("VECTOR('',#{up},1.)"));
    let mut edge = |a: usize, b: usize, z: Option<f64>| {
        let curve = match z {
            Some(z) => {
                let frame = text.frame(z, 1.0);
                text.add(&format!("CIRCLE('',#{frame},1.)"))
            }
            None => text.add(&format!("LINE('',#{},#{up})", corners[a].0)),
        };
        text.add(&format!("EDGE_CURVE('',#{},#{},#{curve},.T.)", corners[a].1, corners[b].1))
    };
    let edges = [edge(0, 1, Some(0.5)), edge(1, 2, None), edge(3, 2, Some(1.5)), edge(0, 3, None)];
    let mut bound = |order: [(usize, &str); 4]| {
        let used = order.map(|(k, flag)| {
            format!("#{}", text.add(&format!("ORIENTED_EDGE('',*,*,#{},.{flag}.)", edges[k])))
        });
        let used = text.add(&format!("EDGE_LOOP('',({}))", used.join(",")));
        text.add(&format!("FACE_BOUND('',#{used},.T.)"))
    };
    let hole = bound([(3, "T"), (2, "T"), (1, "F"), (0, "F")]);
    let window = bound([(0, "T"), (1, "T"), (2, "F"), (3, "F")]);
    let frame = text.frame(0.0, 1.0);
    let surface = text.add(&format!("CYLINDRICAL_SURFACE('',#{frame},1.)"));
    let bounds = [text.bound(low, true), text.bound(high, false), hole];
    let faces = [
        text.face(surface, &bounds),
        text.face(surface, &[window]),
        text.disk(low, 0.0, false),
        text.disk(high, 2.0, true),
    ];
    assert_near(volumes(&text.solid(&faces), Unit::OfFile).1[0], 2.0 * PI);
}

#[test]
fn an_edge_into_a_plane_and_back_is_left_out() {
    let mut text = Text::new();
    let faces = cylinder(&mut text, true);
    let end = text.point(0.3, 0.0, 2.0);
    let end = text.add(&format!("VERTEX_POINT('',#{end})"));
    let start = text.point(1.0, 0.0, 2.0);
    let line = text.line(start, [-1.0, 0.0, 0.0], 1.0);
    // The vertex and the loop of the upper circle.
    let uses = |text: &Text, what: &str| -> u32 {
        let record = text.0.lines().filter(|line| line.contains(what)).nth(1).unwrap();
        record[1..].split(' ').next().unwrap().parse().unwrap()
    };
    let vertex = uses(&text, "VERTEX_POINT");
    let spur = text.add(&format!("EDGE_CURVE('',#{vertex},#{end},#{line},.T.)"));
    let [forth, back] = ["T", "F"].map(|flag| text.add(&format!("ORIENTED_EDGE('',*,*,#{spur},.{flag}.)")));
    let solid = text.solid(&faces);
    let last = solid.rfind("EDGE_LOOP('',(").unwrap() + "EDGE_LOOP('',(".len();
    let solid = format!("{}#{forth},#{back},{}", &solid[..last], &solid[last..]);
    let (model, volumes) = volumes(&solid, Unit::OfFile);
    assert_near(volumes[0], 2.0 * PI);
    assert_eq!(model.notes.len(), 1, "{:?}", model.notes);
}

#[test]
fn an_edge_and_a_face_without_length_are_left_out() {
    let mut text = Text::new();
    let faces = cylinder(&mut text, true);
    let point = text.point(1.0, 0.0, 2.0);
    let vertex = text.add(&format!("VERTEX_POINT('',#{point})"));
    let line = text.line(point, [0.0; 3], 0.0);
    let edge = text.add(&format!("EDGE_CURVE('',#{vertex},#{vertex},#{line},.T.)"));
    let none = text.disk(edge, 2.0, true);
    let (model, volumes) = volumes(&text.solid(&[faces[0], faces[1], faces[2], none]), Unit::OfFile);
    assert_near(volumes[0], 2.0 * PI);
    assert!(model.notes[0].starts_with("1 faces whose edges have no length"), "{:?}", model.notes);
    assert_eq!(model.patches.len(), 3);
}

/// The faces of a unit cube with edges of its own; vertices at the same place are shared.
fn cube(text: &mut Text, origin: [f64; 3], vertices: &mut HashMap<[i32; 3], u32>) -> Vec<u32> {
    let mut edges: HashMap<[u32; 2], u32> = HashMap::new();
    let mut faces = Vec::new();
    for axis in 0..3 {
        for is_upper in [false, true] {
            // Counterclockwise, seen from outside.
            let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
            let mut square = [[0, 0], [1, 0], [1, 1], [0, 1]];
            if !is_upper {
                square.reverse();
            }
            let places = square.map(|[a, b]| {
                let mut at = origin;
                at[axis] += f64::from(u8::from(is_upper));
                (at[u], at[v]) = (at[u] + f64::from(a), at[v] + f64::from(b));
                at
            });
            let corners = places.map(|at| {
                *vertices.entry(at.map(|x| x as i32)).or_insert_with(|| {
                    let point = text.point(at[0], at[1], at[2]);
                    text.add(&format!("VERTEX_POINT('',#{point})"))
                })
            });
            let mut used = Vec::new();
            for k in 0..4 {
                let (a, b) = (corners[k], corners[(k + 1) % 4]);
                let way = [0, 1, 2].map(|i| places[(k + 1) % 4][i] - places[k][i]);
                let edge = *edges.entry([a.min(b), a.max(b)]).or_insert_with(|| {
                    let start = text.point(places[k][0], places[k][1], places[k][2]);
                    let line = text.line(start, way, 1.0);
                    text.add(&format!("EDGE_CURVE('{a}',#{a},#{b},#{line},.T.)"))
                });
                let starts = format!("#{edge} = EDGE_CURVE('{a}'");
                let flag = if text.0.contains(&starts) { "T" } else { "F" };
                used.push(format!("#{}", text.add(&format!("ORIENTED_EDGE('',*,*,#{edge},.{flag}.)"))));
            }
            let edges = text.add(&format!("EDGE_LOOP('',({}))", used.join(",")));
            let bound = text.add(&format!("FACE_BOUND('',#{edges},.T.)"));
            let mut normal = [0.0; 3];
            normal[axis] = if is_upper { 1.0 } else { -1.0 };
            let mut x = [0.0; 3];
            x[u] = 1.0;
            let frame = text.frame_at(places[0], normal, x);
            let plane = text.add(&format!("PLANE('',#{frame})"));
            faces.push(text.face(plane, &[bound]));
        }
    }
    faces
}

#[test]
fn a_solid_that_touches_itself_has_one_edge_there() {
    let mut text = Text::new();
    let mut vertices = HashMap::new();
    let mut faces = cube(&mut text, [0.0; 3], &mut vertices);
    faces.extend(cube(&mut text, [1.0, 1.0, 0.0], &mut vertices));
    let (model, volumes) = volumes(&text.solid(&faces), Unit::OfFile);
    assert_near(volumes[0], 2.0);
    assert_eq!((model.curves.len(), model.notes.len()), (23, 0), "{:?}", model.notes);
}

#[test]
fn a_vertex_away_from_its_curve_is_accepted_within_the_accuracy_of_the_file() {
    let mut text = Text::new();
    let faces = cylinder(&mut text, true);
    let whole = text.solid(&faces).replacen("(1.0,0.0,2.0)", "(1.15,0.0,2.0)", 1);
    assert!(whole.contains("1.15"));
    let error = Model::read_step(whole.as_bytes(), Unit::OfFile).unwrap_err().to_string();
    assert!(error.contains("1.500e-1 away from its curve"), "{error}");
    let unit = whole.split_once("GLOBAL_UNIT_ASSIGNED_CONTEXT((").unwrap().1.split_once(')').unwrap().0;
    for (accuracy, is_read) in [(0.1, false), (0.2, true)] {
        let measure =
            format!("#9999 = UNCERTAINTY_MEASURE_WITH_UNIT(LENGTH_MEASURE({accuracy}),{unit},'','');\n");
        let text = whole
            .replace("GLOBAL_UNIT", "GLOBAL_UNCERTAINTY_ASSIGNED_CONTEXT((#9999)) GLOBAL_UNIT")
            .replace("ENDSEC;\nEND-ISO", &format!("{measure}ENDSEC;\nEND-ISO"));
        assert_eq!(Model::read_step(text.as_bytes(), Unit::OfFile).is_ok(), is_read, "{accuracy}");
    }
}

/// The text of a file of the repository.
fn file(name: &str) -> String {
    let folder = std::path::Path::new(env!("CARGO_MANIFEST_DIR")).join("../geometries/step");
    std::fs::read_to_string(folder.join(name).with_extension("step")).unwrap()
}

#[test]
fn a_side_that_is_shorter_than_the_accuracy_of_the_file_may_be_missing() {
    // The arc of radius 1e-4 where the fillet of a cube begins, which grows to 0.4.
    let mut model = Model::read_step(file("blunt_fillet").as_bytes(), Unit::OfFile).unwrap();
    let tessellation = Tessellation::of(&mut model, &Settings { chord: 1e-5, angle: 0.05 }).unwrap();
    // OpenCASCADE's volume.
    assert_near(1000.0 - tessellate::volume(&model, &tessellation, 0), 1000.0 - 999.8784702171395);
    let coarse = Tessellation::of(&mut model, &Settings::default()).unwrap();
    assert!(coarse.triangles.len() < 2000, "{}", coarse.triangles.len());
}

/// A record, that of a point with three decimals.
fn rounded(record: &str) -> String {
    let is_point = record.contains("CARTESIAN_POINT(");
    let Some((head, list)) = record.split_once("',(").filter(|_| is_point) else {
        return record.to_owned();
    };
    let number = |part: &str| part.trim().parse::<f64>().map_or(part.to_owned(), |x| format!("{x:.3}"));
    let numbers: Vec<String> = list[..list.find(')').unwrap()].split(',').map(number).collect();
    format!("{head}',({}))", numbers.join(","))
}

#[test]
fn files_with_rounded_coordinates_are_read() {
    for name in ["bent_chamfer", "bolted", "short_ridge", "tapered_chamfer", "tiny_chamfer"] {
        let text = file(name);
        let (_, exact) = volumes(&text, Unit::OfFile);
        let text = text.split(';').map(rounded).collect::<Vec<_>>().join(";");
        let (mut model, found) = volumes(&text, Unit::OfFile);
        found.into_iter().zip(exact).for_each(|(found, exact)| assert_near(found, exact));
        let tessellation = Tessellation::of(&mut model, &Settings::default()).unwrap();
        let (_, gap) = tessellation.widest_gap().unwrap();
        assert!(gap > 1e-5, "{name}: {gap}");
    }
}

#[test]
fn triangles_of_a_long_strip_join_opposite_points_of_its_sides() {
    let mut text = Text::new();
    let faces = cylinder_of_height(&mut text, 1e-3, true);
    let mut model = Model::read_step(text.solid(&faces).as_bytes(), Unit::OfFile).unwrap();
    let made = Tessellation::of(&mut model, &Settings { chord: 1e-6, angle: 0.02 }).unwrap();
    let side = model.patches.iter().position(|patch| !patch.surface.is_plane()).unwrap();
    let of_side = made.triangles.iter().filter(|t| t.patch as usize == side).count();
    let on_rims: usize = made.lines.iter().map(|line| line.len()).sum();
    assert!(of_side > 600 && of_side < on_rims + on_rims / 10, "{of_side} triangles, {on_rims} points");
}
